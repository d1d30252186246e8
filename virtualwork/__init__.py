"""Planar mechanisms: kinematics, and equilibrium at rest and in motion by virtual work."""

from virtualwork.describe.errors import AssemblyError, DescriptionError, MechanismError, MobilityError
from virtualwork.describe.loads import Force, Friction, Motor, Spring, Torque, TorsionSpring
from virtualwork.describe.parts import GROUND, Gear, Guess, Guide, Input, Link
from virtualwork.mechanism import Mechanism
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
    "GROUND",
    "AssemblyError",
    "DescriptionError",
    "Force",
    "Friction",
    "Gear",
    "Guess",
    "Guide",
    "Input",
    "Link",
    "Mechanism",
    "MechanismError",
    "MobilityError",
    "Motor",
    "Spring",
    "Torque",
    "TorsionSpring",
    "block_on_bar",
    "crank_rod_piston",
    "on_incline",
    "on_moving_ramp",
    "rotation",
    "second_point",
    "sense",
]
