"""Planar mechanisms: kinematics, and equilibrium at rest and in motion by virtual work."""

from typing import TYPE_CHECKING

from dalembert.on_use import on_use

if TYPE_CHECKING:
    from virtualwork.describe import AssemblyError, DescriptionError, MechanismError, MobilityError
    from virtualwork.describe.parts import (
        GROUND,
        Belt,
        Cam,
        Force,
        Friction,
        Gear,
        Guess,
        Guide,
        Input,
        Link,
        Motor,
        Polar,
        Rack,
        Segment,
        Spring,
        Torque,
        TorsionSpring,
    )
    from virtualwork.exchange.export import export_mechanism
    from virtualwork.exchange.programs import ImportedMechanism, import_mechanisms
    from virtualwork.family.keep import Bound
    from virtualwork.family.target import Target
    from virtualwork.mechanism import Mechanism
    from virtualwork.motion import Motion
    from virtualwork.study import counterweights
    from virtualwork.study.check import Check, grashof_class
    from virtualwork.study.cycle import Cycle
    from virtualwork.study.equilibrium import Equilibria, Equilibrium
    from virtualwork.study.ledger import ledger
    from virtualwork.textbook.combinations import (
        block_on_bar,
        crank_rod_piston,
        on_incline,
        on_moving_ramp,
        rotation,
        second_point,
        sense,
    )
    from virtualwork.textbook.link_states import LinkStates, UnitLoad
    from virtualwork.textbook.newton import newton
    from virtualwork.textbook.power_balance import balance

__all__ = [
    "GROUND",
    "AssemblyError",
    "Belt",
    "Bound",
    "Cam",
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
    "ImportedMechanism",
    "Input",
    "Link",
    "LinkStates",
    "Mechanism",
    "MechanismError",
    "MobilityError",
    "Motion",
    "Motor",
    "Polar",
    "Rack",
    "Segment",
    "Spring",
    "Target",
    "Torque",
    "TorsionSpring",
    "UnitLoad",
    "balance",
    "block_on_bar",
    "counterweights",
    "crank_rod_piston",
    "export_mechanism",
    "grashof_class",
    "import_mechanisms",
    "ledger",
    "newton",
    "on_incline",
    "on_moving_ramp",
    "rotation",
    "second_point",
    "sense",
]

# where each name stands; a room is loaded when one of its names is used
_HOMES = {
    "virtualwork.describe": "AssemblyError DescriptionError MechanismError MobilityError",
    "virtualwork.describe.parts": "GROUND Belt Cam Force Friction Gear Guess Guide Input Link Motor Polar Rack Segment Spring Torque TorsionSpring",
    "virtualwork.study.ledger": "ledger",
    "virtualwork.mechanism": "Mechanism",
    "virtualwork.motion": "Motion",
    "virtualwork.study": "counterweights",
    "virtualwork.exchange.export": "export_mechanism",
    "virtualwork.exchange.programs": "ImportedMechanism import_mechanisms",
    "virtualwork.family.keep": "Bound",
    "virtualwork.family.target": "Target",
    "virtualwork.study.check": "Check grashof_class",
    "virtualwork.study.cycle": "Cycle",
    "virtualwork.study.equilibrium": "Equilibria Equilibrium",
    "virtualwork.textbook.combinations": "block_on_bar crank_rod_piston on_incline on_moving_ramp rotation second_point sense",
    "virtualwork.textbook.link_states": "LinkStates UnitLoad",
    "virtualwork.textbook.power_balance": "balance",
    "virtualwork.textbook.newton": "newton",
}

__getattr__, __dir__ = on_use(globals(), _HOMES)
