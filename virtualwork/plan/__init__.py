"""What must be solved, and in which order: each kind of joint once, the graph of its equations, the steps. Pure data."""
