"""Planar mechanisms: kinematics, and equilibrium at rest and in motion by virtual work."""
