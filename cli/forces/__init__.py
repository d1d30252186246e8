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
  only NAME,...  Only these: crank.torque,B.coupler.fx,shaking.fx,H.x.
  flywheel NUMBER  Flywheel inertia for this speed fluctuation: 0.02.
  counterweights LINK,...  Counterweights on these links for the least shaking force.
  find NAME  Find this dimension: input.speed, links.crank.B.x; the pose is one.
  so_that QUANTITY=VALUE  What it is to give: B.vx=3m_s, crank.torque=12.
Output:
  page FILE(.html)  Write a page on which the mechanism moves, with arrows.
  states FILE(.csv)  Write the states of all links: what dalembert work reads.
"""


@declared_command(OPTIONS, Options)
def run(own: Options, show: ShowOptions) -> Result:
    """Compute the forces of a planar mechanism: effort at the inputs, joint forces, shaking force.

    The loads of FILE.toml act: gravity, forces, torques, springs, friction and the inertia of its masses. The table has
    a row for each pose. Over a whole cycle also mean, peak, r.m.s., power and energy.
    """
    from cli.cases.analysis import names
    from cli.cases.call import Call
    from cli.forces.cycle import Forces, checked

    weights = names(own.counterweights, "--counterweights", "names of links, such as crank, rocker")
    call = Call.of(own, show, forces=True)
    checked(call, own.flywheel, weights, own.states)
    return call.result(Forces, flywheel=own.flywheel, counterweights=weights, states=own.states)
