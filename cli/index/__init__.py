"""`dalembert index`: the rotor's unbalance apart from the mandrel's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cli.show.output import command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.show.result import Result
    from dalembert.results.way import Topic


EXAMPLE = "index-mandrel"
OPTIONS = """
Arguments:
  readings READINGS  CSV with a row for each position of the rotor on its mandrel; - is standard input.
What:
  phase_lag  The phase of the instrument lags.
"""


@command(OPTIONS)
def run(readings: str, phase_lag: bool = False) -> Result:
    """Separate a rotor's unbalance from its mandrel's: index balancing, by least squares over all positions.

    READINGS has the columns turned_deg (the angle by which the rotor was turned on the mandrel) with unbalance_* and
    angle_*, or amplitude_* and phase_deg; * is a unit. Each reading is mandrel + rotor·e^{i·turned}. All angles are
    counted in one common sense from the mandrel's zero mark; the rotor's angle is that of its position turned = 0.
    """
    from cli.index.readings import read_positions
    from cli.index.tables import METHOD, tables, warnings
    from cli.show.result import Result

    positions = read_positions(readings, phase_lag)

    def figure() -> Figure:
        from balancing.picture import indexed
        from cli.show.picture import blank

        picture = blank()
        indexed(
            positions.shown(positions.readings),
            positions.shown(positions.parts.residuals),
            complex(positions.shown(positions.parts.rotor)),
            complex(positions.shown(positions.parts.mounting)),
            positions.quantity,
            positions.spoken_unit,
            figure=picture,
        )
        return picture

    def way() -> list[Topic]:
        from cli.index.tables import way

        return way(positions)

    return Result(
        way=way,
        tables=tables(positions),
        head={"amplitude_unit": positions.unit} if positions.quantity == "amplitude" else {},
        figure=figure,
        method=METHOD,
        about={"title": "Index balancing"},
        warnings=[*positions.table.warnings, *warnings(positions)],
    )
