"""`dalembert flywheel`: a flywheel from a table of torque."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import bad, needed
from cli.show.output import command
from dalembert.quantities import parse_number

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result


OPTIONS = """
Arguments:
  table TABLE  CSV of torque over whole turns of the shaft; - is standard input.
What:
  speed SPEED  Mean speed of the shaft, such as 600rpm.
  fluctuation COEFFICIENT  Largest minus smallest speed, divided by the mean speed, such as 0.02 or 2%.
"""


def coefficient(text: str) -> float:
    """Read a coefficient of fluctuation, a number or a percentage."""
    try:
        value = parse_number(text.strip().removesuffix("%"))
    except ValueError:
        value = 0.0
    value = value / 100 if text.strip().endswith("%") else value
    if not 1e-60 < value <= 2:
        raise bad(
            "--fluctuation",
            f"'{text}': expected a number above 0 and at most 2, where the shaft comes to rest, such as 0.02 or 2%",
        )
    return value


@command(OPTIONS, example="flywheel-engine")
def run(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Find the flywheel that keeps the speed of a shaft within a fluctuation, from a table of its torque.

    TABLE has the columns angle_* and torque_*. The star is a unit: angle_deg, torque_N_m. The torque is linear between
    rows; two rows at one angle are a step. The rows span whole turns of the shaft, the last row included: 0 to 360 deg,
    or 0 to 720 deg of a four-stroke engine. The load is constant, the mean of the torque.
    """
    from cli.flywheel.turns import METHOD, draw, read_torque, tables, warnings, way
    from dalembert.results.result import Result

    if options.speed is None or options.fluctuation is None:
        missing = "--speed" if options.speed is None else "--fluctuation"
        raise bad(missing, "expected --speed and --fluctuation, such as --speed 600rpm --fluctuation 0.02")
    omega = needed("--speed", options.speed, "speed", positive=True)
    wheel = read_torque(options.table, omega, coefficient(options.fluctuation))

    return Result(
        way=partial(way, wheel),
        tables=tables(wheel),
        figure=partial(draw, wheel),
        method=METHOD,
        about={"title": "Flywheel"},
        warnings=[*wheel.table.warnings, *warnings(wheel)],
    )
