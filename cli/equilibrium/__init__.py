"""`dalembert equilibrium`: the positions of rest and their stability."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.cases import FILE, RANGES, WORKERS
from cli.read.options import bad
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "desk-lamp"
OPTIONS = f"{FILE}{RANGES}{WORKERS}"


@command(OPTIONS)
def run(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Find the positions in which a mechanism rests under its loads without effort, and their stability.

    A stable position has its period of small oscillations, without dampers and friction. --over or --cases of an
    input set the range of the search. The default is one turn, or as many turns as the loads need to repeat. Where
    they never repeat (turns wind up a torsion spring), it is one turn either way of the guess, or the range between
    the limits; for a slide, two sizes of the mechanism either way.
    """
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.equilibrium.rest import Equilibria

    cases = Cases.of(options)
    if options.at:
        raise bad(
            "--at",
            "equilibrium searches a range of the input: expected --over, such as --over 0deg:90deg:1deg",
        )
    return result(Equilibria(cases, show), options)
