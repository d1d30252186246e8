"""`dalembert body`: mass properties, angular momentum, d'Alembert's wrench, a shaft on two bearings."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cli.read import options
from cli.show.output import command

if TYPE_CHECKING:
    from cli.body.moving import ShaftRequest
    from cli.show.result import Result
    from dalembert.results.way import Topic

_VECTOR = "X,Y,Z"


EXAMPLE = "riul-rod"
OPTIONS = """
Arguments:
  parts PARTS  CSV of parts; - is standard input.
What:
  omega X,Y,Z  Angular velocity, rad/s, such as 0,4,12.
  alpha X,Y,Z  Angular acceleration, rad/s². With --frame-omega: the rate of omega's components in those axes.
  frame_omega X,Y,Z  Angular velocity of axes that do not turn with the body, rad/s.
  fixed X,Y,Z  Point about which the body turns, m. The motion of the centre of mass follows from it.
  velocity X,Y,Z  Velocity of the centre of mass, m/s.
  acceleration X,Y,Z  Acceleration of the centre of mass, m/s².
  find NAME  Number to find, such as omega.y, the shaft's speed or a cell of the table, rod.ry.
  so_that QUANTITY=VALUE  With --find: wanted value of a result, such as momentum.x=2 or bearing1_dynamic.size=20N.
  only NAME,...  Show only these results, such as mass,inertia,principal_axes,momentum,bearing1.
Shaft:
  shaft Z1:Z2  Positions of the two bearings along the axis, such as 0mm:400mm.
  axis AXIS  Axis of the shaft through the origin: x, y, z (default), -x … or a vector, such as 1,0,1.
  speed SPEED  Speed of the shaft, such as 1200rpm.
  speed_rate RATE  Angular acceleration of the shaft, such as 10rad_s2.
  gravity X,Y,Z  Gravity on the shaft, m/s², such as 0,-9.81,0.
  correct NAME:Z:RADIUS  Correction plane of the shaft, such as A:0mm:20mm; repeatable.
Robot:
  check_inertias  Check the inertia tensors of a robot file (URDF, SDF, MJCF).
Further options (docs/commands.md describes them):
  about X,Y,Z  Point about which the angular momentum is given, m, fixed in space (default: --fixed, else the origin).
"""


@command(OPTIONS)
def run(
    parts: str,
    omega: str | None = None,
    alpha: str | None = None,
    frame_omega: str | None = None,
    about: str | None = None,
    fixed: str | None = None,
    velocity: str | None = None,
    acceleration: str | None = None,
    find: str | None = None,
    so_that: str | None = None,
    only: str | None = None,
    shaft: str | None = None,
    axis: str | None = None,
    speed: str | None = None,
    speed_rate: str | None = None,
    gravity: str | None = None,
    correct: list[str] | None = None,
    check_inertias: bool = False,
) -> Result:
    """Compute mass, centre of mass and inertia of a body from its parts, its angular momentum, and the forces and
    moments of its motion.

    PARTS has a row for each part: part, shape, mass_* (of a hole negative) or density_*, and x_* y_* z_* of its centre of
    mass. The star is a unit. axis_x axis_y axis_z (default z) and rx_* ry_* rz_* (turns about the fixed axes, in this order)
    place it. A column body tells several bodies apart. Shapes and their dimensions: point; rod length; disk, ring radius;
    arc radius, angle; cylinder, cone radius, length; tube radius, inner_radius, length; box width, height, depth; plate
    width, height; sphere radius, inner_radius; tensor ixx iyy izz ixy ixz iyz, products as +∫xy dm; mesh file, file_unit
    (STL, OBJ). A point may have radius and angle for x and y. Thin shapes take linear_density_* or area_density_*.
    """
    from cli.body import tables
    from cli.body.moving import MovingBody, Request
    from cli.read.parts import read_bodies, read_table
    from cli.read.root_search import pair
    from cli.show.result import Result, with_found

    request = Request(
        omega=options.vector("--omega", omega, "speed"),
        alpha=options.vector("--alpha", alpha, "angular acceleration"),
        frame_omega=options.vector("--frame-omega", frame_omega, "speed"),
        about=options.vector("--about", about, "length"),
        fixed=options.vector("--fixed", fixed, "length"),
        velocity=options.vector("--velocity", velocity, "velocity"),
        acceleration=options.vector("--acceleration", acceleration, "acceleration"),
        shaft=_shaft(shaft, axis, speed, speed_rate, gravity, correct),
    )
    if check_inertias:
        others = request != Request() or find or so_that or only
        if others or axis or gravity or speed or speed_rate or correct:
            raise options.bad("--check-inertias", "goes with no option of a motion or a shaft")
        return _inertias(parts)
    of_center = {"velocity": velocity, "acceleration": acceleration}
    if fixed is not None:
        options.refuse(
            "the motion of the centre of mass follows from --fixed: expected one of them", **of_center
        )
    if shaft is not None:
        free = {"omega": omega, "alpha": alpha, "frame_omega": frame_omega, "fixed": fixed}
        options.refuse("a shaft turns about its axis at --speed and --speed-rate", **free, **of_center)
    sought, solution = pair(find, so_that), None
    if sought is None:
        bodies = [MovingBody(each, request) for each in read_bodies(parts)]
    else:
        from cli.body.way import find as search

        moving, solution = search(read_table(parts), parts, request, *sought)
        bodies = [moving]

    chosen = None if only is None else options.only(only, tables.names_of(bodies[0]))

    def way() -> list[Topic]:
        from cli.body.way import way

        return way(bodies)

    result = Result(
        tables=tables.tables(bodies, chosen),
        screen=lambda: tables.every(bodies, partial(tables.quantities, only=chosen)),
        figure=partial(tables.draw, bodies),
        way=way,
        method=tables.METHOD,
        about={
            "title": "A shaft on two bearings"
            if shaft is not None
            else "Mass properties and motion of a body"
        },
        warnings=tables.warnings(bodies),
    )
    return result if solution is None else with_found(result, solution)


def _inertias(file: str) -> Result:
    from pathlib import Path

    from cli.body.inertias import checks, table, warnings
    from cli.formats import read_robot
    from cli.show.result import Result
    from dalembert.tables.files import read_bytes

    name, data = read_bytes(file)
    robot = read_robot(name, data, None if file == "-" else Path(file).parent)
    each = checks(robot)
    return Result(
        tables={"inertias": lambda: table(each)},
        warnings=warnings(robot, each),
        failed=lambda: not all(check.valid for check in each),
    )


def _shaft(
    shaft: str | None,
    axis: str | None,
    speed: str | None,
    speed_rate: str | None,
    gravity: str | None,
    correct: list[str] | None,
) -> ShaftRequest | None:
    from cli.body.moving import ShaftRequest
    from cli.read.rotor_options import from_options

    if shaft is None:
        of_shaft = {
            "axis": axis,
            "speed": speed,
            "speed_rate": speed_rate,
            "gravity": gravity,
            "correct": correct,
        }
        options.refuse("this is for a shaft: expected --shaft Z1:Z2 too", **of_shaft)
        return None
    planes = from_options(correct, "--correct") if correct else None
    if planes is not None and planes.z is None:
        raise options.bad("--correct", "a correction plane of a shaft needs its place: NAME:Z:RADIUS")
    return ShaftRequest(
        axis=None if axis is None else _axis(axis),
        bearings=options.two_bearings("--shaft", shaft),
        speed=options.quantity("--speed", speed, "speed") or 0.0,
        speed_rate=options.quantity("--speed-rate", speed_rate, "angular acceleration") or 0.0,
        gravity=options.vector("--gravity", gravity, "acceleration") or (0.0, 0.0, 0.0),
        planes=planes,
    )


def _axis(text: str) -> tuple[float, float, float]:
    """Read the direction of a shaft: a letter with its sign, or a vector."""
    name = text.strip().lower()
    letter = name.lstrip("+-")
    if letter in ("x", "y", "z") and len(name) <= 2:
        size = -1.0 if name[0] == "-" else 1.0
        x, y, z = (size * (letter == each) + 0.0 for each in "xyz")
        return x, y, z
    if "," not in text:
        raise options.bad("--axis", f"'{text}': expected x, y, z, -x, -y, -z or a vector such as 1,0,1")
    vector = options.vector("--axis", text, "number")
    assert vector is not None
    if not any(vector):
        raise options.bad("--axis", f"'{text}': expected a direction: all three numbers are 0")
    return vector
