"""The commands on rotors that are small: which options each takes, and what it shows.

Each has its tables beside it: `trial` and `signal` (`before_field.py`), `place` (`placed.py`),
`index` (`positions.py`), `engine` (`orders.py`), `flywheel` (`turns.py`). `balance` and `field` have
folders of their own.
"""

from __future__ import annotations

import math
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import bad, exact_degrees, exact_places, needed, places, quantity, refuse, weights
from cli.show.output import command
from dalembert.quantities import parse_number

if TYPE_CHECKING:
    from fractions import Fraction

    from balancing.placement_request import Drill
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result
    from dalembert.results.way import Topic


@command(
    """
What:
  rotor_mass MASS  Mass of the rotor, such as 120kg. [required]
  speed SPEED  Speed of the run, such as 3000rpm. [required]
  radius LENGTH  Radius of the trial mass, such as 200mm. [required]
  planes N=1  Number of correction planes.
""",
    without=("column", "plot"),
)
def trial(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Suggest a trial mass for the first run: large enough to change the vibration, small enough to be safe.

    Its centrifugal force is a tenth of the static load of each plane.
    """
    from cli.rotor.before_field import RULE, suggestion, way_of_trial
    from dalembert.results.result import Result

    mass = needed("--rotor-mass", options.rotor_mass, "mass", positive=True)
    speed = needed("--speed", options.speed, "speed", positive=True)
    radius = needed("--radius", options.radius, "length", positive=True)

    return Result(
        way=partial(way_of_trial, mass, speed, radius, options.planes),
        tables={"trial": partial(suggestion, mass, speed, radius, options)},
        method=f"Rule: {RULE}.",
        about={"title": "Trial mass"},
    )


@command(
    """
Arguments:
  recording FILE  CSV of a recording: t_s, mark (or tacho), A_um …; - is standard input.
What:
  pulses N(1-10000)=1  Number of pulses of the mark in one turn.
""",
    without=("plot",),
)
def signal(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Compute amplitude and phase of a recorded vibration, once per turn.

    FILE has the columns t_*, mark (once per turn; tacho, keyphasor, pulse and trigger are other names) and a column of
    vibration for each sensor: A_um, B_um, acceleration_m_s2. The rows of the result are readings for dalembert field.
    """
    from balancing.runs.recording import read_recording
    from cli.rotor.before_field import vectors, way_of_recording
    from dalembert.results.result import Result

    try:
        read = read_recording(options.recording, options.pulses)
    except ValueError as error:
        raise bad("--pulses", error) from None

    return Result(
        way=partial(way_of_recording, read),
        tables={"signal": lambda: vectors(read)},
        head={"amplitude_unit": read.unit},
        about={"title": "Vibration once per turn"},
        warnings=read.warnings,
    )


FIRST, FLAT = "0deg", "180deg"
"""Default angle of the first blade, default point angle of the drill."""


@command(
    """
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
""",
    example="blades",
)
def place(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Put a correction where masses can go: holes, blades, weights in stock, another radius, drilling.

    Several corrections are added as vectors first. Without --positions or --blades the result is one mass. In a FILE
    each plane of each rotor is placed on its own.
    """
    from balancing.placement_request import Placing, Request
    from cli.rotor.placed import METHOD, corrections_of, draw, tables, way
    from dalembert.results.result import Result, Section, Sheet
    from dalembert.results.text import heading

    every = corrections_of(options.corrections, options.rotor, options.plane)
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

    from balancing.placement_request import Drill

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


@command(
    """
Arguments:
  readings READINGS  CSV with a row for each position of the rotor on its mandrel; - is standard input.
What:
  phase_lag  The instrument's phase lags: reverse its sign.
""",
    example="index-mandrel",
)
def index(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Separate a rotor's unbalance from its mandrel's: index balancing, by least squares over all positions.

    READINGS has the columns turned_deg (the angle by which the rotor was turned on the mandrel) with unbalance_* and
    angle_*, or amplitude_* and phase_deg; * is a unit. Each reading is mandrel + rotor·e^{i·turned}. All angles are
    counted in one common sense from the mandrel's zero mark; the rotor's angle is that of its position turned = 0.
    """
    from cli.rotor.positions import METHOD, draw, read_positions, tables, warnings, way
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


@command(
    """
Arguments:
  cylinders CYLINDERS  CSV with a row for each cylinder; - is standard input.
What:
  speed SPEED  Speed of the crankshaft, such as 3000rpm.
  order N(1-100)=8  Highest order: the highest multiple of the speed that is computed.
Counterweights and balance shafts:
  counterweight_share NUMBER(0-1)  Share of the reciprocating masses that counterweights balance, such as 0.5. They balance the rotating masses too.
  plane NAME:Z:RADIUS...  Plane of counterweights, such as A:0mm:60mm; repeatable (default: opposite each crank pin).
  shaft ORDER:Z:with|against...  Balance shaft at ORDER times the speed, with or against the crank, such as 2:150mm:against; repeatable.
""",
    example="inline-four",
)
def engine(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Compute the shaking forces and couples of an engine by exact orders, and the residuals after counterweights and
    balance shafts.

    CYLINDERS has the columns cylinder, crank_deg, bank_deg, z_*, throw_*, rod_*, reciprocating_* and rotating_* (masses).
    The star is a unit. The crank pin stands at θ + crank_deg. bank_deg is the direction of the cylinder's axis,
    counter-clockwise from +x (default 90). Forces are those on the frame, couples are Σ z·F about z = 0. One shaft
    balances a force; two of one order and sense balance force and couple.
    """
    from balancing.cylinders import Engine, read_cylinders
    from cli.read.rotor_options import from_options
    from cli.rotor.orders import METHOD, draw, read_shafts, tables, warnings, way
    from dalembert.results.result import Result

    if options.speed is None:
        raise bad("--speed", "expected the speed of the crankshaft, such as --speed 3000rpm")
    omega = needed("--speed", options.speed, "speed", positive=True)
    planes = None if options.plane is None else from_options(options.plane)
    read = read_cylinders(options.cylinders)
    engine = Engine(
        read,
        omega,
        options.order,
        options.counterweight_share,
        planes,
        read_shafts(options.shaft or [], options.order),
        read.pins,
    )

    return Result(
        way=partial(way, engine),
        tables=tables(engine),
        figure=partial(draw, engine),
        method=METHOD,
        about={"title": "Balance of an engine"},
        warnings=[*engine.cylinders.table.warnings, *warnings(engine)],
    )


@command(
    """
Arguments:
  table TABLE  CSV of torque over whole turns of the shaft; - is standard input.
What:
  speed SPEED  Mean speed of the shaft, such as 600rpm.
  fluctuation COEFFICIENT  Largest minus smallest speed, divided by the mean speed, such as 0.02 or 2%.
""",
    example="flywheel-engine",
)
def flywheel(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Find the flywheel that keeps the speed of a shaft within a fluctuation, from a table of its torque.

    TABLE has the columns angle_* and torque_*. The star is a unit: angle_deg, torque_N_m. The torque is linear between
    rows; two rows at one angle are a step. The rows span whole turns of the shaft, the last row included: 0 to 360 deg,
    or 0 to 720 deg of a four-stroke engine. The load is constant, the mean of the torque.
    """
    from cli.rotor.turns import METHOD, draw, read_torque, tables, warnings, way
    from dalembert.results.result import Result

    if options.speed is None or options.fluctuation is None:
        missing = "--speed" if options.speed is None else "--fluctuation"
        raise bad(missing, "expected --speed and --fluctuation, such as --speed 600rpm --fluctuation 0.02")
    omega = needed("--speed", options.speed, "speed", positive=True)
    wheel = read_torque(options.table, omega, _coefficient(options.fluctuation))

    return Result(
        way=partial(way, wheel),
        tables=tables(wheel),
        figure=partial(draw, wheel),
        method=METHOD,
        about={"title": "Flywheel"},
        warnings=[*wheel.table.warnings, *warnings(wheel)],
    )


def _coefficient(text: str) -> float:
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
