"""`dalembert tolerance`: what the tolerances of dimensions do to the motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.cases.options import CASES, FILE, WORKERS, Options
from cli.show.output import declared_command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "tolerances"
OPTIONS = f"""
{FILE}{CASES}{WORKERS}
What:
  only NAME,...  Show only these quantities: H.x,coupler.angle,crank.torque; H is all of H.
  order position|velocity|acceleration|jerk  Highest derivative (default: the highest that the input's rates give).
  draws N  Number of mechanisms drawn within the tolerances.
  seed N=0  With --draws: random seed.
  distribution normal|uniform=normal  With --draws: normal (a limit is three standard deviations) or uniform (a limit is an end).
"""


@declared_command(OPTIONS, Options)
def run(own: Options, show: ShowOptions) -> Result:
    """Compute the effect of the [tolerances] of FILE.toml on the motion: worst case, standard deviation, shares.

    Worst case and standard deviation are of first order, from exact derivatives. --draws solves drawn mechanisms in
    addition. The table has a row for each pose.
    """
    from cli.cases.analysis import unknown
    from cli.cases.call import Call
    from cli.read.options import bad
    from cli.tolerance.spread import Spreads
    from virtualwork.quantities import places

    if own.draws is not None and own.draws < 2:
        raise bad("--draws", f"{own.draws}: expected two or more drawn mechanisms")
    call = Call.of(own, show)
    only = call.request.only
    if only is not None and unknown(places(call.mechanism, 3, only), only) is not None:
        call.request = call.request._replace(forces=True)
    workers = 1 if call.varied is not None else call.workers
    return call.result(
        Spreads, draws=own.draws or 0, seed=own.seed, distribution=own.distribution, workers=workers
    )
