"""`dalembert balance`: rotors whose eccentric masses are known."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from cli.read import options
from cli.show.output import command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.show.columns import Result


EXAMPLE = "riul-rotor"
PANELS = {
    "What": "plane planes gravity",
    "How": "remove round_mass round_angle workers",
    "How: the tolerance": "grade speed rotor_mass permissible bearings center_z",
}


@command
def run(
    table: Annotated[
        str, typer.Argument(metavar="TABLE", help="CSV of eccentric masses; - is standard input.")
    ],
    plane: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[:Z]:RADIUS", help="A correction plane, such as A:0mm:20mm; once: static balancing."
        ),
    ] = None,
    planes: Annotated[
        str | None,
        typer.Option(metavar="FILE.csv", help="The planes as a table: plane, z_*, radius_*, rotor."),
    ] = None,
    gravity: Annotated[float, typer.Option(metavar="G", help="g for weights, m/s².")] = 9.80665,
    remove: Annotated[
        bool, typer.Option("--remove", help="Corrections as material to remove, not to add.")
    ] = False,
    round_mass: Annotated[
        str | None, typer.Option(metavar="MASS", help="Round the corrections to this step, such as 0.1g.")
    ] = None,
    round_angle: Annotated[
        str | None, typer.Option(metavar="ANGLE", help="Round the angles to this step, such as 1deg.")
    ] = None,
    center_z: Annotated[
        str | None,
        typer.Option(metavar="Z", help="Where the centre of mass lies: for the couple and the tolerance."),
    ] = None,
    grade: Annotated[
        str | None, typer.Option(metavar="GRADE", help="Balance quality grade of ISO 21940-11, such as G2.5.")
    ] = None,
    speed: Annotated[
        str | None, typer.Option(metavar="SPEED", help="Highest service speed, such as 3000rpm.")
    ] = None,
    rotor_mass: Annotated[
        str | None, typer.Option(metavar="MASS", help="Mass of the rotor, such as 12kg.")
    ] = None,
    permissible: Annotated[
        str | None,
        typer.Option(
            metavar="UNBALANCE", help="Permissible residual unbalance, such as 30g_mm, in place of a grade."
        ),
    ] = None,
    bearings: Annotated[
        str | None, typer.Option(metavar="Z1:Z2", help="The bearing planes, where the tolerance holds.")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, metavar="N", help="Processes that solve many rotors.")] = 1,
) -> Result:
    """Balance rotors from a table of known eccentric masses, in one, two or more planes.

    TABLE has the columns mass_* and radius_* (or weight_* and radius_*, or unbalance_*), angle_*, z_* (not
    needed with one plane), and if wanted rotor and name; * is a unit: mass_kg, radius_mm, angle_deg, z_mm.
    Angles are counter-clockwise as seen against +z.
    """
    # numpy and what stands on it are loaded only once the command line itself is in order
    from cli.balance import columns, words
    from cli.balance.read import read_rotors
    from cli.balance.solve import Balancing, Request
    from cli.read.planes import from_options, from_table
    from cli.read.tolerance import tolerance_of
    from cli.show.columns import Result, Sheet

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
        found = Balancing(rotors, chosen, request, executor)

    def figure() -> Figure:
        from cli.balance.picture import draw

        return draw(found)

    return Result(
        document=lambda: columns.document(found),
        tables={"corrections": lambda: columns.corrections(found)},
        notes=lambda: words.notes(found),
        afterword=lambda: words.verdicts(found),
        figure=figure,
        method=words.METHOD,
        sheets=lambda: [Sheet("", words.sections(found), figure)],
        about={"title": "Balancing of known masses"},
        warnings=[*rotors.table.warnings, *words.warnings(found)],
    )
