"""Rigid bodies in space: inertia, angular momentum, shafts, rotation in time."""
