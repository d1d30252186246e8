"""What all commands on a mechanism share: its cases, each a variant at its inputs, and the one loop over them."""
