"""`dalembert fit`: dimensions that meet a target."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.cases import FILE, VARIANTS, WORKERS
from cli.read.options import bad
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result

EXAMPLE = "straight-line-fit"
OPTIONS = f"""
{FILE}  target TARGET.csv...  The target: columns H_x_mm, H_y_mm, coupler_angle_deg, crank_torque_N_m, optionally input_deg.
{VARIANTS}{WORKERS}
Target and free dimensions:
  want NAME...  Quantity that meets the target: H, H.y, coupler.angle, B.position, crank.torque; repeatable.
  free NAME=LOW:HIGH...  Dimension to fit, with its bounds; repeatable.
  weight NAME=NUMBER...  Weight of a wanted quantity (default 1); repeatable.
  keep QUANTITY>=VALUE...  Constraint over the range of the input: transmission>=40deg, H.y<=0.3m; repeatable.
Search:
  starts N  Number of starting points (default 256).
  best N  Number of distinct solutions (default 1).
  seed N(0-)=0  Random seed of the starting points.
"""


@command(OPTIONS, forms=[".toml"])
def run(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Fit dimensions of a mechanism to a target: a path, a function of the input, a guided body, an effort.

    Where the target has no column for the input, the input is free at each row, and the rows keep their order.
    --keep holds from the first to the last input of the target, or over a whole turn where the input is free.
    -o FILE.toml writes the mechanism's file with the fitted numbers.
    """
    from cli.cases.cases import Cases, naming
    from cli.cases.loop import result
    from cli.fit.fitting import STARTS, Fits, aims, bounds
    from cli.fit.targets import kept

    for flag, value, example in (
        ("--want", options.want, "--want H"),
        ("--free", options.free, "--free NAME=LOW:HIGH"),
    ):
        if not value:
            raise bad(flag, f"missing: expected {example}")
    cases = Cases.of(options)
    if cases.varied is not None and show.form == ".toml":
        raise bad(
            "-o",
            f"'{show.output}': expected one mechanism, such as --set NAME=VALUE makes, or a table (.csv)",
        )
    cases.refuse_inputs("the rows of the target have the inputs: expected a dimension, links.crank.B.x=...")
    with naming(options.file):
        targets = aims(cases.mechanism, options.target, options.want, options.weight, cases.warnings)
        free = bounds(cases.mechanism, options.free, cases.bare)
        keep = kept(cases.mechanism, options.keep, cases.bare)
    # worker processes fit the variants, or the starts of one mechanism
    workers = 1 if cases.varied is not None else options.workers or 1
    study = Fits(
        cases,
        show,
        aims=targets,
        free=free,
        keep=keep,
        starts=options.starts or STARTS,
        seed=options.seed,
        best=options.best or 1,
        workers=workers,
    )
    return result(study, options)
