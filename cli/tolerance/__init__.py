"""`dalembert tolerance`: what the tolerances of dimensions do to the motion."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.cases import CASES, FILE, WORKERS
from cli.read.options import bad, refuse
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "tolerances"
OPTIONS = f"""
{FILE}{CASES}{WORKERS}
Quantities:
  only NAME,...  Show only these quantities: H.x,coupler.angle,crank.torque; H is all of H.
  order position|velocity|acceleration|jerk  Highest derivative (default: the highest that the input's rates give).
Drawn mechanisms:
  draws N  Number of mechanisms drawn at random within the tolerances.
  seed N(0-)  With --draws: random seed (default 0).
  distribution normal|uniform  With --draws: normal (default; a limit is three standard deviations) or uniform (a limit is an end).
"""


@command(OPTIONS)
def run(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Compute the effect of the [tolerances] of FILE.toml on the motion: worst case, standard deviation, shares.

    Worst case and standard deviation are of first order, from exact derivatives. --draws solves drawn mechanisms in
    addition. The table has a row for each pose.
    """
    from cli.cases.analysis import unknown
    from cli.cases.cases import Cases
    from cli.cases.loop import result
    from cli.tolerance.spread import Spreads
    from dalembert.dataclass import replace
    from virtualwork.quantities import places

    if options.draws is not None and options.draws < 2:
        raise bad("--draws", f"{options.draws}: expected two or more drawn mechanisms")
    if options.draws is None:
        refuse("needs --draws", seed=options.seed is not None, distribution=options.distribution)
    cases = Cases.of(options)
    only = cases.request.only
    if only is not None and unknown(places(cases.mechanism, 3, only), only) is not None:
        cases = replace(cases, request=cases.request._replace(forces=True))
    # worker processes solve the variants, or what is drawn of one mechanism
    workers = 1 if cases.varied is not None else options.workers or 1
    study = Spreads(
        cases,
        show,
        draws=options.draws or 0,
        seed=options.seed or 0,
        distribution=options.distribution or "normal",
        workers=workers,
    )
    return result(study, options)
