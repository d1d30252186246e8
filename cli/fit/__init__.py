"""`dalembert fit`: dimensions that meet a target."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.cases.options import CASES, FILE, WORKERS, Options
from cli.show.output import declared_command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "straight-line-fit"
OPTIONS = f"""
{FILE}  target TARGET.csv...  The target: columns H_x_mm, coupler_angle_deg, crank_torque_N_m, optionally input_deg.
{CASES}{WORKERS}
What:
  want NAME...  Quantity that meets the target: H, coupler.angle, B.position, crank.torque; repeatable.
  free NAME=LOW:HIGH...  Dimension to fit, with its bounds; repeatable.
  weight NAME=NUMBER...  Weight of a wanted quantity; repeatable.
  keep QUANTITY>=VALUE...  Constraint over the sweep: transmission>=40deg, H.y<=0.3m; repeatable.
How:
  starts N  Number of starting points (default 256).
  best N  Number of distinct solutions (default 1).
  seed N=0  Random seed of the starting points.
"""


@declared_command(OPTIONS, Options)
def run(own: Options, show: ShowOptions) -> Result:
    """Fit dimensions of a mechanism to a target: a path, a function of the input, a guided body, an effort.

    Without a column for the input, the input is free at each row of the target, and the rows keep their order. -o
    FILE.toml writes the mechanism's
    file with the fitted numbers. --keep holds from the first to the last input of the target, over a whole turn where
    the input is free.
    """
    from cli.cases.call import Call, naming
    from cli.fit.fitting import STARTS, Fits, aims, bounds
    from cli.fit.targets import kept
    from cli.read.options import bad

    for flag, value, example in (
        ("--want", own.want, "--want H"),
        ("--free", own.free, "--free NAME=LOW:HIGH"),
    ):
        if not value:
            raise bad(flag, f"missing: expected {example}")
    call = Call.of(own, show)
    call.refuse_inputs("the rows of the target have the inputs: expected a dimension, links.crank.B.x=...")
    with naming(own.file):
        targets = aims(call.mechanism, own.target, own.want, own.weight, call.remarks)
        free = bounds(call.mechanism, own.free, call.bare)
        keep = kept(call.mechanism, own.keep, call.bare)
    workers = 1 if call.varied is not None else call.workers
    return call.result(
        Fits,
        aims=targets,
        free=free,
        keep=keep,
        starts=own.starts or STARTS,
        seed=own.seed,
        best=own.best or 1,
        workers=workers,
    )
