"""Planar mechanisms: kinematics, and equilibrium at rest and in motion by virtual work."""

from virtualwork.errors import AssemblyError, DescriptionError, MechanismError, MobilityError
from virtualwork.mechanism import Gear, Guess, Guide, Input, Link, Mechanism

__all__ = [
    "AssemblyError",
    "DescriptionError",
    "Gear",
    "Guess",
    "Guide",
    "Input",
    "Link",
    "Mechanism",
    "MechanismError",
    "MobilityError",
]
