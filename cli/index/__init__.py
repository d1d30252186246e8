"""`dalembert index`: the rotor's unbalance apart from the mandrel's."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result


OPTIONS = """
Arguments:
  readings READINGS  CSV with a row for each position of the rotor on its mandrel; - is standard input.
What:
  phase_lag  The instrument's phase lags: reverse its sign.
"""


@command(OPTIONS, example="index-mandrel")
def run(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Separate a rotor's unbalance from its mandrel's: index balancing, by least squares over all positions.

    READINGS has the columns turned_deg (the angle by which the rotor was turned on the mandrel) with unbalance_* and
    angle_*, or amplitude_* and phase_deg; * is a unit. Each reading is mandrel + rotor·e^{i·turned}. All angles are
    counted in one common sense from the mandrel's zero mark; the rotor's angle is that of its position turned = 0.
    """
    from cli.index.positions import METHOD, draw, read_positions, tables, warnings, way
    from dalembert.results.result import Result

    positions = read_positions(options.readings, options.phase_lag)

    return Result(
        way=partial(way, positions),
        tables=tables(positions),
        head={"amplitude_unit": positions.unit} if positions.quantity == "amplitude" else {},
        figure=partial(draw, positions),
        method=METHOD,
        about={"title": "Index balancing"},
        warnings=[*positions.table.warnings, *warnings(positions)],
    )
