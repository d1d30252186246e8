"""Planar mechanisms: kinematics, and equilibrium at rest and in motion by virtual work."""

from virtualwork.describe.errors import AssemblyError, DescriptionError, MechanismError, MobilityError
from virtualwork.mechanism import Gear, Guess, Guide, Input, Link, Mechanism
from virtualwork.textbook.combinations import (
    block_on_bar,
    crank_rod_piston,
    on_incline,
    on_moving_ramp,
    rotation,
    second_point,
    sense,
)

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
    "block_on_bar",
    "crank_rod_piston",
    "on_incline",
    "on_moving_ramp",
    "rotation",
    "second_point",
    "sense",
]
