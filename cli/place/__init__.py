"""`dalembert place`: a correction put where masses can go."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cli.read import options
from cli.show.commands import ShowOptions
from cli.show.output import command

if TYPE_CHECKING:
    from fractions import Fraction

    from cli.place.placing import Drill
    from cli.show.result import Result
    from dalembert.results.way import Topic


EXAMPLE = "blades"
FIRST, FLAT = "0deg", "180deg"
"""Default angle of the first blade, default point angle of the drill."""
OPTIONS = """
Arguments:
  corrections MASS@ANGLE ...  Corrections to ADD, such as 83.5g@308.87deg; or a FILE that dalembert field wrote (CSV, JSON, workbook).
What:
  rotor NAME  With a FILE: rotor to place.
  plane NAME  With a FILE: plane to place.
  positions ANGLES  Angles where masses can go, such as 292.5deg,315deg.
  blades N  Number of blades, evenly spaced, numbered from 1.
  max_mass MASS  Largest mass of each place, such as 5g.
How: weights as they are:
  stock MASSES  Weights in stock, such as 1g,2g,5g: uses the fewest within 1 % of the correction, at most three.
  weights MASSES  Weights of fixed mass at any angle, such as 4g,4g: gives the angle of each.
  max_pieces N  Largest number of weights from stock: gives the least error, in place of the fewest weights.
How: elsewhere:
  at_radius R  Radius of the corrections.
  to_radius R  Radius of the masses.
  at_z Z  Axial position of the corrections.
  to_z Z1:Z2  Axial positions of the new planes: force and moment stay equal.
How: drilling:
  drill DIAMETER  Diameter of holes: removes material opposite the corrections.
  density DENSITY  Density of the drilled material, such as 7850kg_m3.
  remove  The corrections are material to REMOVE: drill at their angles, not opposite.
Further options (docs/commands.md describes them):
  first ANGLE  Angle of the first blade.
  numbering  Blade numbers increase with the angles or against them.
  pieces N  Largest number of weights from stock on one place.
  drill_point ANGLE  Point angle of the drill, such as 118deg; 180deg is flat.
  max_depth DEPTH  Largest depth of a hole; a place gets more holes if necessary.
"""


@command(OPTIONS)
def run(
    corrections: list[str],
    rotor: str | None = None,
    plane: str | None = None,
    positions: str | None = None,
    blades: Annotated[int | None, typer.Option(min=1, max=options.PLACES)] = None,
    first: str = FIRST,
    numbering: Literal["with", "against"] = "with",
    max_mass: str | None = None,
    stock: str | None = None,
    weights: str | None = None,
    pieces: Annotated[int, typer.Option(min=1)] = 1,
    max_pieces: Annotated[int | None, typer.Option(min=1)] = None,
    at_radius: str | None = None,
    to_radius: str | None = None,
    at_z: str | None = None,
    to_z: str | None = None,
    drill: str | None = None,
    density: str | None = None,
    drill_point: str = FLAT,
    max_depth: str | None = None,
    remove: bool = False,
    *,
    show: ShowOptions,
) -> Result:
    """Put a correction where masses can go: holes, blades, weights in stock, another radius, drilling.

    Several corrections are added as vectors first. Without --positions or --blades the result is one mass. In a FILE
    each plane of each rotor is placed on its own.
    """
    from cli.place.placing import Placing, Request, read_corrections
    from cli.place.tables import METHOD, draw, tables, way
    from cli.show.result import Result, Section, Sheet
    from dalembert.results.text import heading

    every = read_corrections(corrections, rotor, plane)
    stated = (
        []
        if remove or not every[0].removed
        else [f"{corrections[0]}: its corrections are material to remove"]
    )
    remove = remove or every[0].removed
    radii = _radii(at_radius, to_radius)
    drilled = _drill(drill, density, drill_point, max_depth)
    in_stock, fixed = options.weights("--stock", stock), options.weights("--weights", weights)
    if in_stock is not None and drilled is not None:
        raise options.bad("--stock", "weights from stock are not drilled: expected --stock or --drill")
    if fixed is not None:
        turned = "does not go with --weights, which have a mass of their own and stand at any angle"
        options.refuse(turned, positions=positions, blades=blades, stock=stock, max_mass=max_mass)
        options.refuse(turned, max_pieces=max_pieces, drill=drill, remove=remove)
    if in_stock is None:
        options.refuse("goes with --stock", pieces=pieces > 1, max_pieces=max_pieces)
    if blades is None and first != FIRST:
        raise options.bad("--first", "goes with --blades")
    moved = _planes(at_z, to_z)
    chosen = options.places(positions, blades, first, numbering)
    if in_stock is not None and chosen is None:
        raise options.bad("--stock", "expected --positions or --blades for the weights to go to")
    limit = options.quantity("--max-mass", max_mass, "mass", positive=True)

    def exact_places() -> list[Fraction]:
        return options.exact_places(positions, blades, first, numbering)

    request = Request(
        chosen, limit, in_stock, fixed, pieces, max_pieces, radii, drilled, moved, remove, exact_places
    )
    placings = [Placing(correction, request) for correction in every]
    alone = len(placings) == 1
    if not alone and show.plot is not None:
        raise options.bad("--plot", "draws one correction: expected --rotor and --plane too")

    def sheet(placing: Placing) -> Sheet:
        parts = {name: table() for name, table in tables([placing]).items()}
        sections = [Section(heading(name), [table.above, table]) for name, table in parts.items()]
        return Sheet(placing.correction.name, sections, lambda: draw(placing))

    def topics() -> list[Topic]:
        return [topic for each in placings for topic in way(each, "" if alone else each.correction.name)]

    return Result(
        way=topics,
        tables=tables(placings),
        figure=(lambda: draw(placings[0])) if alone else None,
        method=METHOD,
        sheets=None if alone else lambda: map(sheet, placings),
        about={"title": "Placement of a correction"},
        warnings=stated
        + [
            text if alone else f"{placing.correction.name}: {text}"
            for placing in placings
            for text in placing.warnings
        ],
    )


def _both(one: str, value: object, other: str, second: object) -> None:
    """Refuse one of two options without the other."""
    if (value is None) != (second is None):
        raise options.bad(one if value is None else other, f"expected both {one} and {other}")


def _radii(at_radius: str | None, to_radius: str | None) -> tuple[float, float] | None:
    """Read --at-radius and --to-radius."""
    at = options.quantity("--at-radius", at_radius, "length", positive=True)
    to = options.quantity("--to-radius", to_radius, "length", positive=True)
    _both("--at-radius", at, "--to-radius", to)
    return None if at is None or to is None else (at, to)


def _drill(drill: str | None, density: str | None, drill_point: str, max_depth: str | None) -> Drill | None:
    """Read --drill and what goes with it."""
    from fractions import Fraction

    from cli.place.placing import Drill

    diameter = options.quantity("--drill", drill, "length", positive=True)
    rho = options.quantity("--density", density, "density", positive=True)
    _both("--drill", diameter, "--density", rho)
    deepest = options.quantity("--max-depth", max_depth, "length", positive=True)
    if deepest is not None and diameter is None:
        raise options.bad("--max-depth", "is for --drill")
    if drill_point != FLAT and diameter is None:
        raise options.bad("--drill-point", "is for --drill")
    point = options.needed("--drill-point", drill_point, "angle", positive=True)
    if point > math.pi * (1 + 1e-15):
        raise options.bad("--drill-point", "expected at most 180deg")
    if diameter is None or rho is None:
        return None
    return Drill(
        diameter, rho, min(point, math.pi), deepest, min(options.exact_degrees(drill_point), Fraction(180))
    )


def _planes(at_z: str | None, to_z: str | None) -> tuple[float, list[float]] | None:
    """Read --at-z and --to-z."""
    at = options.quantity("--at-z", at_z, "length")
    _both("--at-z", at, "--to-z", to_z)
    if at is None or to_z is None:
        return None
    planes = [options.needed("--to-z", part, "length") for part in to_z.split(":")]
    if len(planes) < 2:
        raise options.bad("--to-z", f"'{to_z}': expected two planes or more, such as 0mm:90mm")
    if len(set(planes)) < len(planes):
        raise options.bad("--to-z", f"'{to_z}': two planes lie at the same place")
    return at, planes
