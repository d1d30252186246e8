"""`dalembert forces`: the effort at the inputs, the forces in the joints, the shaking force."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.cases.options import BRANCH, CASES, FILE, WORKERS, Options
from cli.show.output import declared_command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "door-closer"
OPTIONS = f"""
{FILE}{CASES}{BRANCH}{WORKERS}
What:
  only NAME,...  Show only these quantities: crank.torque,B.coupler.fx,shaking.fx,H.x.
  flywheel NUMBER  Compute the flywheel for this fluctuation of speed, such as 0.02.
  counterweights LINK,...  Compute counterweights on these links for the least shaking force.
  find NAME  Dimension to find at one pose: input.speed, links.crank.B.x.
  so_that QUANTITY=VALUE  With --find: value of a quantity, such as B.vx=3m_s or crank.torque=12.
Output:
  page FILE(.html)  Write a page that computes: the mechanism moves, with its forces as arrows.
  states FILE(.csv)  Write the states of all links, as dalembert work reads them.
"""


@declared_command(OPTIONS, Options)
def run(own: Options, show: ShowOptions) -> Result:
    """Compute the forces of a planar mechanism: effort at the inputs, joint forces, shaking force.

    The loads of FILE.toml act: gravity, forces, torques, springs, friction and the inertia of its masses. The table has
    a row for each pose. A whole cycle gives mean, peak, r.m.s., power and energy in addition.
    """
    from cli.cases.analysis import names
    from cli.cases.call import Call
    from cli.forces.cycle import Forces, checked

    weights = names(own.counterweights, "--counterweights", "names of links, such as crank, rocker")
    call = Call.of(own, show, forces=True)
    checked(call, own.flywheel, weights, own.states)
    return call.result(Forces, flywheel=own.flywheel, counterweights=weights, states=own.states)
