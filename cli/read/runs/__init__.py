"""Tables and logs of measured runs, as people keep them."""
