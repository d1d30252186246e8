"""Planar mechanisms: kinematics, and equilibrium at rest and in motion by virtual work."""

from virtualwork.describe.errors import AssemblyError, DescriptionError, MechanismError, MobilityError
from virtualwork.describe.loads import Force, Friction, Motor, Spring, Torque, TorsionSpring
from virtualwork.describe.parts import GROUND, Gear, Guess, Guide, Input, Link
from virtualwork.formulas.effort import ledger
from virtualwork.mechanism import Mechanism, equilibria
from virtualwork.study import counterweights
from virtualwork.study.check import Check, grashof_class
from virtualwork.study.cycle import Cycle
from virtualwork.study.equilibrium import Equilibria, Equilibrium
from virtualwork.textbook.combinations import (
    block_on_bar,
    crank_rod_piston,
    on_incline,
    on_moving_ramp,
    rotation,
    second_point,
    sense,
)
from virtualwork.textbook.link_states import LinkStates, UnitLoad, balance

__all__ = [
    "GROUND",
    "AssemblyError",
    "Check",
    "Cycle",
    "DescriptionError",
    "Equilibria",
    "Equilibrium",
    "Force",
    "Friction",
    "Gear",
    "Guess",
    "Guide",
    "Input",
    "Link",
    "LinkStates",
    "Mechanism",
    "MechanismError",
    "MobilityError",
    "Motor",
    "Spring",
    "Torque",
    "TorsionSpring",
    "UnitLoad",
    "balance",
    "block_on_bar",
    "counterweights",
    "crank_rod_piston",
    "equilibria",
    "grashof_class",
    "ledger",
    "on_incline",
    "on_moving_ramp",
    "rotation",
    "second_point",
    "sense",
]
