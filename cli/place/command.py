"""`dalembert place`: a correction put where masses can go."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from cli.place.read import Request, read_corrections, read_drill, read_planes, read_ratio, read_stock
from cli.read import options
from cli.show.commands import ShowOptions
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.columns import Result, Table


EXAMPLE = "blades"
OPTIONS = """
Arguments:
  corrections MASS@ANGLE ...  Corrections to ADD, such as 83.5g@308.87deg; or a FILE that dalembert field wrote (CSV, JSON, workbook).
What:
  rotor NAME  The rotor, of a file.
  plane NAME  The plane, of a file.
  positions ANGLES  Where masses can go, such as 292.5deg,315deg.
  blades N  So many places, evenly spaced, numbered from 1.
  first ANGLE  Angle of the first blade.
  max_mass MASS  Limit of each place, such as 5g.
  stock MASSES  Weights in stock, such as 1g,2g,5g; one a place.
  pieces N  How many weights from stock go on one place.
  max_pieces N  How many weights from stock altogether.
How: elsewhere:
  at_radius R  Radius the corrections were found for.
  to_radius R  Radius the masses go to.
  at_z Z  Where along the shaft the corrections were found for.
  to_z Z1:Z2  Carry them over to these planes, with the same force and moment.
How: drilling:
  drill DIAMETER  Remove material instead, by drilling opposite.
  density DENSITY  Density of the material drilled, such as 7850kg_m3.
  drill_point ANGLE  Point angle of the drill, such as 118deg; 180deg is flat.
  max_depth DEPTH  Deepest hole; more are drilled at a place if needed.
  remove  The vectors are material to REMOVE already: drill there, not opposite.
"""


@command(OPTIONS)
def run(
    corrections: list[str],
    rotor: str | None = None,
    plane: str | None = None,
    positions: str | None = None,
    blades: Annotated[int | None, typer.Option(min=1, max=options.PLACES)] = None,
    first: str = "0deg",
    max_mass: str | None = None,
    stock: str | None = None,
    pieces: Annotated[int, typer.Option(min=1)] = 1,
    max_pieces: Annotated[int | None, typer.Option(min=1)] = None,
    at_radius: str | None = None,
    to_radius: str | None = None,
    at_z: str | None = None,
    to_z: str | None = None,
    drill: str | None = None,
    density: str | None = None,
    drill_point: str = "180deg",
    max_depth: str | None = None,
    remove: bool = False,
    *,
    show: ShowOptions,
) -> Result:
    """Put a correction where masses can go: holes, blades, weights in stock, another radius, drilling.

    Several corrections are combined first. Without --positions or --blades the result is the one mass. Of a file each
    rotor's plane is placed by itself.
    """
    read = read_corrections(corrections, rotor, plane)
    ratio = read_ratio(at_radius, to_radius)
    drilled = read_drill(drill, density, drill_point, max_depth)
    weights = read_stock(stock)
    if weights is not None and drilled is not None:
        raise options.bad("--stock", "weights from stock are not drilled: expected --stock or --drill")
    moved = read_planes(at_z, to_z)
    chosen = options.places(positions, blades, first)
    if weights is not None and chosen is None:
        raise options.bad("--stock", "expected --positions or --blades for the weights to go to")
    limit = options.quantity("--max-mass", max_mass, "mass", positive=True)
    from cli.place import columns, picture, words
    from cli.place.solve import Placing
    from cli.show.columns import Result, Section, Sheet

    request = Request(chosen, limit, weights, pieces, max_pieces, ratio, drilled, moved, remove)
    found = [Placing(of, request) for of in read]
    alone = len(found) == 1
    if not alone and show.plot is not None:
        raise options.bad("--plot", "draws one correction: expected --rotor and --plane too")

    def sheet(placing: Placing) -> Sheet:
        one = [placing]
        parts: list[str | Table] = [words.notes(one), columns.masses(one), words.errors(one)]
        title = "" if alone else placing.of.name
        return Sheet(title, [Section("Masses", parts)], lambda: picture.draw(placing))

    return Result(
        document=lambda: columns.document(found),
        tables={"masses": lambda: columns.masses(found)},
        notes=lambda: words.notes(found),
        afterword=lambda: words.errors(found),
        figure=(lambda: picture.draw(found[0])) if alone else None,
        method=words.METHOD,
        sheets=lambda: map(sheet, found),
        about={"title": "Placement of a correction"},
        warnings=[
            text if alone else f"{placing.of.name}: {text}" for placing in found for text in placing.warnings
        ],
    )
