"""`dalembert place`: a correction put where masses can go."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import bad, exact_degrees, exact_places, needed, places, quantity, refuse, weights
from cli.show.output import command

if TYPE_CHECKING:
    from fractions import Fraction

    from cli.place.placing import Drill
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result
    from dalembert.results.way import Topic


FIRST, FLAT = "0deg", "180deg"
"""Default angle of the first blade, default point angle of the drill."""
OPTIONS = """
Arguments:
  corrections MASS@ANGLE ...  Corrections to ADD, such as 83.5g@308.87deg; or a FILE that dalembert field wrote (CSV, JSON, workbook).
What:
  rotor NAME  With a FILE: rotor to place.
  plane NAME  With a FILE: plane to place.
  positions ANGLES  Angles where masses can go, such as 292.5deg,315deg.
  blades N(1-10000)  Number of blades, evenly spaced.
  max_mass MASS  Largest mass of each place, such as 5g.
How: weights as they are:
  stock MASSES  Weights in stock, such as 1g,2g,5g: uses the fewest within 1 % of the correction, at most three.
  weights MASSES  Weights of fixed mass at any angle, such as 4g,4g: gives the angle of each.
How: elsewhere:
  at_radius R  Radius of the corrections.
  to_radius R  Radius of the masses.
  at_z Z  Axial position of the corrections.
  to_z Z1:Z2  Axial positions of the new planes.
How: drilling:
  drill DIAMETER  Diameter of holes, opposite the corrections.
  density DENSITY  Density of the drilled material, such as 7850kg_m3.
  remove  The corrections are material to REMOVE.
Further options (docs/commands.md describes them):
  first ANGLE=0deg  Angle of the first blade.
  numbering with|against=with  Blade numbers increase with the angles or against them.
  pieces N=1  Largest number of weights from stock on one place.
  max_pieces N  Largest number of weights from stock: gives the least error, in place of the fewest weights.
  drill_point ANGLE=180deg  Point angle of the drill, such as 118deg; 180deg is flat.
  max_depth DEPTH  Largest depth of a hole; a place gets more holes if necessary.
"""


@command(OPTIONS, example="blades")
def run(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Put a correction where masses can go: holes, blades, weights in stock, another radius, drilling.

    Several corrections are added as vectors first. Without --positions or --blades the result is one mass. In a FILE
    each plane of each rotor is placed on its own.
    """
    from cli.place.placing import Placing, Request, read_corrections
    from cli.place.tables import METHOD, draw, tables, way
    from dalembert.results.result import Result, Section, Sheet
    from dalembert.results.text import heading

    every = read_corrections(options.corrections, options.rotor, options.plane)
    stated = (
        []
        if options.remove or not every[0].removed
        else [f"{options.corrections[0]}: its corrections are material to remove"]
    )
    remove = options.remove or every[0].removed
    radii = _radii(options.at_radius, options.to_radius)
    drilled = _drill(options.drill, options.density, options.drill_point, options.max_depth)
    in_stock, fixed = weights("--stock", options.stock), weights("--weights", options.weights)
    if in_stock is not None and drilled is not None:
        raise bad("--stock", "weights from stock are not drilled: expected --stock or --drill")
    if fixed is not None:
        turned = "does not go with --weights, which have a mass of their own and stand at any angle"
        refuse(
            turned,
            positions=options.positions,
            blades=options.blades,
            stock=options.stock,
            max_mass=options.max_mass,
        )
        refuse(turned, max_pieces=options.max_pieces, drill=options.drill, remove=remove)
    if in_stock is None:
        refuse("goes with --stock", pieces=options.pieces > 1, max_pieces=options.max_pieces)
    if options.blades is None and options.first != FIRST:
        raise bad("--first", "goes with --blades")
    moved = _planes(options.at_z, options.to_z)
    chosen = places(options.positions, options.blades, options.first, options.numbering)
    if in_stock is not None and chosen is None:
        raise bad("--stock", "expected --positions or --blades for the weights to go to")
    limit = quantity("--max-mass", options.max_mass, "mass", positive=True)

    def exact() -> list[Fraction]:
        return exact_places(options.positions, options.blades, options.first, options.numbering)

    request = Request(
        chosen,
        limit,
        in_stock,
        fixed,
        options.pieces,
        options.max_pieces,
        radii,
        drilled,
        moved,
        remove,
        exact,
    )
    placings = [Placing(correction, request) for correction in every]
    alone = len(placings) == 1
    if not alone and show.plot is not None:
        raise bad("--plot", "draws one correction: expected --rotor and --plane too")

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
        raise bad(one if value is None else other, f"expected both {one} and {other}")


def _radii(at_radius: str | None, to_radius: str | None) -> tuple[float, float] | None:
    """Read --at-radius and --to-radius."""
    at = quantity("--at-radius", at_radius, "length", positive=True)
    to = quantity("--to-radius", to_radius, "length", positive=True)
    _both("--at-radius", at, "--to-radius", to)
    return None if at is None or to is None else (at, to)


def _drill(drill: str | None, density: str | None, drill_point: str, max_depth: str | None) -> Drill | None:
    """Read --drill and what goes with it."""
    from fractions import Fraction

    from cli.place.placing import Drill

    diameter = quantity("--drill", drill, "length", positive=True)
    rho = quantity("--density", density, "density", positive=True)
    _both("--drill", diameter, "--density", rho)
    deepest = quantity("--max-depth", max_depth, "length", positive=True)
    if deepest is not None and diameter is None:
        raise bad("--max-depth", "is for --drill")
    if drill_point != FLAT and diameter is None:
        raise bad("--drill-point", "is for --drill")
    point = needed("--drill-point", drill_point, "angle", positive=True)
    if point > math.pi * (1 + 1e-15):
        raise bad("--drill-point", "expected at most 180deg")
    if diameter is None or rho is None:
        return None
    return Drill(diameter, rho, min(point, math.pi), deepest, min(exact_degrees(drill_point), Fraction(180)))


def _planes(at_z: str | None, to_z: str | None) -> tuple[float, list[float]] | None:
    """Read --at-z and --to-z."""
    at = quantity("--at-z", at_z, "length")
    _both("--at-z", at, "--to-z", to_z)
    if at is None or to_z is None:
        return None
    planes = [needed("--to-z", part, "length") for part in to_z.split(":")]
    if len(planes) < 2:
        raise bad("--to-z", f"'{to_z}': expected two planes or more, such as 0mm:90mm")
    if len(set(planes)) < len(planes):
        raise bad("--to-z", f"'{to_z}': two planes lie at the same place")
    return at, planes
