"""`dalembert place`: a correction put where masses can go."""

from __future__ import annotations

from typing import Annotated

import typer

from cli.read import options
from cli.show.shown import Digits, Expect, Json, Output, Plot, Rtol, Text, show


def run(
    corrections: Annotated[
        list[str],
        typer.Argument(metavar="MASS@ANGLE ...", help="Corrections to ADD, such as 83.5g@308.87deg."),
    ],
    positions: Annotated[
        str | None, typer.Option(metavar="ANGLES", help="Where masses can go, such as 292.5deg,315deg.")
    ] = None,
    blades: Annotated[
        int | None,
        typer.Option(min=1, max=options.PLACES, help="So many places, evenly spaced, numbered from 1."),
    ] = None,
    first: Annotated[str, typer.Option(metavar="ANGLE", help="Angle of the first blade.")] = "0deg",
    max_mass: Annotated[
        str | None, typer.Option(metavar="MASS", help="Limit of each place, such as 5g.")
    ] = None,
    stock: Annotated[
        str | None, typer.Option(metavar="MASSES", help="Weights in stock, such as 1g,2g,5g; one a place.")
    ] = None,
    pieces: Annotated[int, typer.Option(min=1, help="How many weights from stock go on one place.")] = 1,
    max_pieces: Annotated[
        int | None, typer.Option(min=1, help="How many weights from stock altogether.")
    ] = None,
    at_radius: Annotated[
        str | None, typer.Option(metavar="R", help="Radius the corrections were found for.")
    ] = None,
    to_radius: Annotated[str | None, typer.Option(metavar="R", help="Radius the masses go to.")] = None,
    at_z: Annotated[
        str | None, typer.Option(metavar="Z", help="Where along the shaft the corrections were found for.")
    ] = None,
    to_z: Annotated[
        str | None,
        typer.Option(
            metavar="Z1:Z2", help="Carry them over to these planes, with the same force and moment."
        ),
    ] = None,
    drill: Annotated[
        str | None, typer.Option(metavar="DIAMETER", help="Remove material instead, by drilling opposite.")
    ] = None,
    density: Annotated[
        str | None, typer.Option(help="Density of the material drilled, such as 7850kg_m3.")
    ] = None,
    drill_point: Annotated[
        str, typer.Option(metavar="ANGLE", help="Point angle of the drill, such as 118deg; 180deg is flat.")
    ] = "180deg",
    max_depth: Annotated[
        str | None, typer.Option(metavar="DEPTH", help="Deepest hole; more are drilled at a place if needed.")
    ] = None,
    remove: Annotated[
        bool,
        typer.Option(
            "--remove", help="The vectors are material to REMOVE already: drill there, not opposite."
        ),
    ] = False,
    json: Json = False,
    output: Output = None,
    plot: Plot = None,
    expect: Expect = None,
    rtol: Rtol = 1e-3,
    text: Text = False,
    digits: Digits = False,
) -> None:
    """Put a correction where masses can go: holes, blades, weights in stock, another radius, drilling.

    Several corrections are combined first. Without --positions or --blades the result is the one mass.
    """
    vectors = [_vector(spec) for spec in corrections]
    at = options.quantity("--at-radius", at_radius, "length", positive=True)
    to = options.quantity("--to-radius", to_radius, "length", positive=True)
    if (at is None) != (to is None):
        raise options.bad(
            "--to-radius" if to is None else "--at-radius", "expected both --at-radius and --to-radius"
        )
    diameter = options.quantity("--drill", drill, "length", positive=True)
    rho = options.quantity("--density", density, "density", positive=True)
    if (diameter is None) != (rho is None):
        raise options.bad("--density" if rho is None else "--drill", "expected both --drill and --density")
    deepest = options.quantity("--max-depth", max_depth, "length", positive=True)
    if deepest is not None and diameter is None:
        raise options.bad("--max-depth", "is for --drill")
    point = options.quantity("--drill-point", drill_point, "angle", positive=True)
    assert point is not None
    if point > 3.141592653589794:
        raise options.bad("--drill-point", "expected at most 180deg")
    weights = None
    if stock is not None:
        weights = [
            options.quantity("--stock", part, "mass", positive=True) or 0.0 for part in stock.split(",")
        ]
        if diameter is not None:
            raise options.bad("--stock", "weights from stock are not drilled: expected --stock or --drill")
    moved = _planes(options.quantity("--at-z", at_z, "length"), to_z)
    chosen = options.places(positions, blades, first)
    if weights is not None and chosen is None:
        raise options.bad("--stock", "expected --positions or --blades for the weights to go to")
    from cli import place_job as job

    wanted = job.Wanted(
        places=chosen,
        limit=options.quantity("--max-mass", max_mass, "mass", positive=True),
        stock=weights,
        pieces=pieces,
        max_pieces=max_pieces,
        ratio=1.0 if at is None or to is None else at / to,
        drill=None if diameter is None or rho is None else (diameter, rho, min(point, job.PI)),
        deepest=deepest,
        planes=moved,
        remove=remove,
        unit=vectors[0][0][1],
    )
    shown = job.place_corrections([(mass, angle) for mass, angle in vectors], wanted)
    show(shown, json=json, output=output, plot=plot, expect=expect, rtol=rtol, text=text, digits=digits)


def _planes(at: float | None, text: str | None) -> tuple[float, list[float]] | None:
    """Read --at-z and --to-z."""
    if (at is None) != (text is None):
        raise options.bad("--to-z" if text is None else "--at-z", "expected both --at-z and --to-z")
    if at is None or text is None:
        return None
    planes = [options.quantity("--to-z", part, "length") or 0.0 for part in text.split(":")]
    if len(planes) < 2:
        raise options.bad("--to-z", f"'{text}': expected two planes or more, such as 0mm:90mm")
    if len(set(planes)) < len(planes):
        raise options.bad("--to-z", f"'{text}': two planes lie at the same place")
    return at, planes


def _vector(spec: str) -> tuple[tuple[float, str], tuple[float, str]]:
    """Read `83.5g@308.87deg`."""
    mass, mark, angle = spec.partition("@")
    if not mark:
        raise options.bad("MASS@ANGLE", f"'{spec}': expected a mass and an angle, such as 83.5g@308.87deg")
    size, turn = (
        options.with_unit("MASS@ANGLE", mass, "mass"),
        options.with_unit("MASS@ANGLE", angle, "angle"),
    )
    assert size is not None
    assert turn is not None
    if size[0] < 0:
        raise options.bad("MASS@ANGLE", f"'{spec}': expected a mass that is not negative")
    return size, turn
