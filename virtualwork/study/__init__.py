"""What is asked of a whole motion: check, equilibrium, cycle, counterweights, Newton's table."""
