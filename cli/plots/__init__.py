"""Pictures; matplotlib is loaded only when one is asked for."""
