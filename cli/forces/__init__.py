"""`dalembert forces`: the effort at the inputs, the forces in the joints, the shaking force."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.cases import BRANCH, CASES, FILE, WORKERS
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "door-closer"
OPTIONS = f"""
{FILE}{CASES}{BRANCH}{WORKERS}
Quantities:
  only NAME,...  Show only these: crank.torque,B.coupler.fx,H.x.
  find NAME  Dimension to find: input.speed, links.crank.B.x.
  so_that QUANTITY=VALUE  With --find: wanted value of a quantity, such as B.vx=3m_s or crank.torque=12.
Over a whole cycle:
  flywheel NUMBER  Compute the flywheel for this fluctuation of speed, such as 0.02.
  counterweights LINK,...  Compute counterweights on these links for the least shaking force.
Output:
  page FILE(.html)  Write a page that computes: the mechanism moves, with its forces as arrows.
  states FILE(.csv)  Write the states of all links, as dalembert work reads them.
"""


@command(OPTIONS)
def run(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Compute the forces of a planar mechanism: effort at the inputs, joint forces, shaking force.

    The loads of FILE.toml act: gravity, forces, torques, springs, friction and the inertia of its masses. The table has
    a row for each pose. A whole cycle gives mean, peak, r.m.s., power and energy in addition.
    """
    from cli.cases.analysis import names
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.forces.cycle import Forces

    weights = names(options.counterweights, "--counterweights", "names of links, such as crank, rocker")
    study = Forces(
        Cases.of(options, forces=True),
        show,
        find=options.find,
        so_that=options.so_that,
        flywheel=options.flywheel,
        counterweights=weights,
        states=options.states,
    )
    study.check_options()
    return result(study, options)
