"""`dalembert fit`: dimensions that meet a target."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.cases.options import CASES, FILE, WORKERS, Asked
from cli.show.output import declared_command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "straight-line-fit"
OPTIONS = f"""
{FILE}  target TARGET.csv...  The target: columns H_x_mm, coupler_angle_deg, perhaps input_deg.
{CASES}{WORKERS}
What:
  want NAME...  What meets it: H, coupler.angle, B.position; repeatable.
  free NAME=LOW:HIGH...  A dimension to fit, with its bounds; repeatable.
  weight NAME=NUMBER...  Weight of a wanted quantity; repeatable.
How:
  starts N  Number of starting points (default 256).
  best N  Number of distinct solutions (default 1).
  seed N=0  Random seed of the starting points.
"""


@declared_command(OPTIONS, Asked)
def run(asked: Asked, show: ShowOptions) -> Result:
    """Fit dimensions of a mechanism to a target: a path, a function of the input, a guided body.

    Without a column for the input it is free at each row of the target, in order. -o FILE.toml writes the mechanism's
    file with the fitted numbers.
    """
    from cli.cases.analysis import Request
    from cli.cases.call import Call, naming
    from cli.fit.fitting import STARTS, Fits, aims, bounds
    from cli.read.options import bad

    for flag, value, example in (
        ("--want", asked.want, "--want H"),
        ("--free", asked.free, "--free NAME=LOW:HIGH"),
    ):
        if not value:
            raise bad(flag, f"missing: expected {example}")
    call = Call.of(asked, show, Request(asked.file))
    call.refuse_inputs("the rows of the target have the inputs: expected a dimension, links.crank.B.x=...")
    with naming(asked.file):
        targets = aims(call.mechanism, asked.target, asked.want, asked.weight, call.remarks)
        free = bounds(call.mechanism, asked.free, call.bare)
    workers = 1 if call.varied is not None else call.workers
    study = call.study(
        Fits,
        aims=targets,
        free=free,
        starts=asked.starts or STARTS,
        seed=asked.seed,
        best=asked.best or 1,
        workers=workers,
    )
    return call.result(study)
