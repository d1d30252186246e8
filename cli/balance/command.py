"""`dalembert balance`: rotors whose eccentric masses are known."""

from __future__ import annotations

from typing import Annotated

import typer

from cli.read import options
from cli.show.output import Digits, Expect, Json, Output, Plot, Rtol, Text, show


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
    gravity: Annotated[float, typer.Option(help="g for weights, m/s².")] = 9.80665,
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
        str | None, typer.Option(help="Balance quality grade of ISO 21940-11, such as G2.5.")
    ] = None,
    speed: Annotated[str | None, typer.Option(help="Highest service speed, such as 3000rpm.")] = None,
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
    json: Json = False,
    output: Output = None,
    plot: Plot = None,
    expect: Expect = None,
    rtol: Rtol = 1e-3,
    text: Text = False,
    digits: Digits = False,
) -> None:
    """Balance rotors from a table of known eccentric masses, in one, two or more planes.

    TABLE has the columns mass_* and radius_* (or weight_* and radius_*, or unbalance_*), angle_*, z_* (not
    needed with one plane), and if wanted rotor and name; * is a unit: mass_kg, radius_mm, angle_deg, z_mm.
    Angles are counter-clockwise as seen against +z.
    """
    # numpy and what stands on it are loaded only once the command line itself is in order
    from cli.balance import solve as job

    if (plane is None) == (planes is None):
        raise options.bad("--plane", "expected --plane (once or more) or --planes FILE.csv")
    if not 1e-9 < gravity < 1e9:
        raise options.bad("--gravity", f"'{gravity:g}': expected a positive number of m/s²")
    wanted = job.Wanted(
        gravity=gravity,
        remove=remove,
        mass_step=options.with_unit("--round-mass", round_mass, "mass", positive=True),
        angle_step=options.with_unit("--round-angle", round_angle, "angle", positive=True),
        center=options.quantity("--center-z", center_z, "length"),
        tolerance=tolerance_of(grade, speed, rotor_mass, permissible, bearings),
    )
    from cli.read.planes import from_options, from_table

    chosen = from_table(planes) if planes is not None else from_options(plane or [])
    shown = job.balance(job.read_rotors(table, wanted.gravity, needs_z=chosen.several), chosen, wanted)
    show(shown, json=json, output=output, plot=plot, expect=expect, rtol=rtol, text=text, digits=digits)


def tolerance_of(
    grade: str | None,
    speed: str | None,
    rotor_mass: str | None,
    permissible: str | None,
    bearings: str | None,
) -> tuple[str | None, float, tuple[float, float] | None] | None:
    """Return the grade's name, U_per in kg·m and the bearing planes; None where no tolerance is asked for."""
    from balancing import grade_value, permissible_unbalance

    planes = None
    if bearings is not None:
        parts = bearings.split(":")
        if len(parts) != 2:
            raise options.bad("--bearings", f"'{bearings}': expected Z1:Z2, such as 0mm:400mm")
        z1, z2 = (options.quantity("--bearings", part, "length") or 0.0 for part in parts)
        if z1 == z2:
            raise options.bad("--bearings", f"'{bearings}': the two bearings lie at the same place")
        planes = (z1, z2)
    omega = options.quantity("--speed", speed, "speed", positive=True)
    mass = options.quantity("--rotor-mass", rotor_mass, "mass", positive=True)
    if permissible is not None:
        if grade is not None:
            raise options.bad("--permissible", "expected --grade or --permissible, not both")
        whole = options.quantity("--permissible", permissible, "unbalance", positive=True)
        assert whole is not None
        return None, whole, planes
    if grade is None:
        if planes is not None:
            raise options.bad(
                "--bearings", "the bearings are for a tolerance: expected --grade or --permissible too"
            )
        return None
    try:
        value = grade_value(grade)
    except ValueError as error:
        raise options.bad("--grade", error) from None
    for flag, given in (("--speed", omega), ("--rotor-mass", mass)):
        if given is None:
            raise options.bad(flag, "--grade needs --speed and --rotor-mass")
    assert omega is not None
    assert mass is not None
    return f"G{value * 1000:g}", float(permissible_unbalance(value, omega, mass)), planes
