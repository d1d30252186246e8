"""Which assembly a pose belongs to, and where it ends: the guess, change points, limits, continuation."""
