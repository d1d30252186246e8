"""`dalembert balance`: rotors whose eccentric masses are known."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.read import options
from cli.show.commands import ShowOptions, suffix_among
from cli.show.output import command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.show.result import Result
    from dalembert.results.way import Topic


EXAMPLE = "riul-rotor"
OPTIONS = """
Arguments:
  table TABLE  CSV of eccentric masses; - is standard input.
What:
  plane NAME[:Z]:RADIUS  A correction plane, such as A:0mm:20mm; once: static balancing.
  planes FILE.csv  The planes as a table: plane, z_*, radius_*, rotor.
  gravity G  g for weights, m/s².
How:
  remove  Corrections as material to remove, not to add.
  round_mass MASS  Round the corrections to this step, such as 0.1g.
  round_angle ANGLE  Round the angles to this step, such as 1deg.
  workers N  Processes that solve many rotors.
How: the tolerance:
  center_z Z  Where the centre of mass lies: for the couple and the tolerance.
  grade GRADE  Balance quality grade of ISO 21940-11, such as G2.5; or API (4W/N), or MIL (MIL-STD-167-1).
  speed SPEED  Highest service speed, such as 3000rpm.
  rotor_mass MASS  Mass of the rotor, such as 12kg.
  permissible UNBALANCE  Permissible residual unbalance, such as 30g_mm, in place of a grade.
  bearings Z1:Z2  The bearing planes, where the tolerance holds.
Output:
  page FILE.html  Write a page with the masses to edit, which computes the corrections itself.
"""


@command(OPTIONS)
def run(
    table: str,
    plane: list[str] | None = None,
    planes: str | None = None,
    gravity: float = 9.80665,
    remove: bool = False,
    round_mass: str | None = None,
    round_angle: str | None = None,
    center_z: str | None = None,
    grade: str | None = None,
    speed: str | None = None,
    rotor_mass: str | None = None,
    permissible: str | None = None,
    bearings: str | None = None,
    workers: Annotated[int, typer.Option(min=1)] = 1,
    page: Annotated[Path | None, typer.Option(callback=suffix_among(".html"))] = None,
    *,
    show: ShowOptions,
) -> Result:
    """Balance rotors from a table of known eccentric masses, in one, two or more planes.

    TABLE has the columns mass_* and radius_* (or weight_* and radius_*, or unbalance_*), angle_*, z_* (not
    needed with one plane), and if wanted rotor and name; * is a unit: mass_kg, radius_mm, angle_deg, z_mm.
    Angles are counter-clockwise as seen against +z.
    """
    # numpy and what stands on it are loaded only once the command line itself is in order
    from cli.balance.rotors import Balancing, Request, read_rotors
    from cli.balance.tables import METHOD, tables, warnings
    from cli.read.planes import from_options, from_table
    from cli.read.tolerance import tolerance_of
    from cli.show.result import Result

    if (plane is None) == (planes is None):
        raise options.bad("--plane", "expected --plane (once or more) or --planes FILE.csv")
    if not 1e-9 < gravity < 1e9:
        raise options.bad("--gravity", f"'{gravity:g}': expected a positive number of m/s²")
    request = Request(
        gravity=gravity,
        remove=remove,
        mass_step=options.with_unit("--round-mass", round_mass, "mass", positive=True),
        angle_step=options.with_unit("--round-angle", round_angle, "angle", positive=True),
        center=options.quantity("--center-z", center_z, "length"),
        tolerance=tolerance_of(grade, speed, rotor_mass, permissible, bearings),
    )
    chosen = from_table(planes) if planes is not None else from_options(plane or [])
    rotors = read_rotors(table, gravity, needs_z=chosen.several)
    with options.processes(workers) as executor:
        balancing = Balancing(rotors, chosen, request, executor)

    def figure() -> Figure:
        from cli.balance.picture import draw

        return draw(balancing, polygons=show.steps)

    def way() -> list[Topic]:
        from cli.balance.way import way

        return way(balancing)

    def sheet() -> bytes:
        from cli.balance.page import sheet

        return sheet(balancing).html.encode()

    return Result(
        tables=tables(balancing),
        beside={} if page is None else {page: sheet},
        head={"correction": "remove" if remove else "add"},
        figure=figure,
        way=way,
        method=METHOD,
        about={"title": "Balancing of known masses"},
        warnings=[*rotors.table.warnings, *warnings(balancing)],
    )
