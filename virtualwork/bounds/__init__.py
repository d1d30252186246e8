"""Bounds of the rounding errors of motions and forces."""
