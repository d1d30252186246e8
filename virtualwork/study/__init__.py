"""What is required of a whole motion: check, equilibrium, cycle, counterweights, Newton's table."""
