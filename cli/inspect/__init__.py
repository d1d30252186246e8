"""`dalembert inspect`: what kind of mechanism it is, and in which order it is solved."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.cases import FILE, VARIANTS, WORKERS
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "watt-six-bar"
OPTIONS = f"""
{FILE}{VARIANTS}{WORKERS}
Quantities:
  only NAME,...  Count the operations of these quantities in addition: H.x,coupler.omega,crank.torque.
"""


@command(OPTIONS)
def run(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Inspect a planar mechanism: mobility, groups, Grashof classes, limits, dead and change points, strokes.

    The results hold for the whole range of the input. A terminal shows the order of solution in addition.
    """
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.inspect.character import Inspection

    cases = Cases.of(options, forces=True)
    cases.refuse_inputs(
        "inspect covers the whole range of the input: expected a dimension, links.crank.B.x=..."
    )
    return result(Inspection(cases, show), options)
