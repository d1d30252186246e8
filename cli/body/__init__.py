"""The commands on bodies: which options each takes, and what it shows.

`body` is mass properties and forces of a motion (`moving.py`, `tables.py`, `way.py`; a robot's tensors: `inertias.py`),
`spin` the rotation in time (`states.py`).
"""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import (
    bad,
    number_or_quantity,
    only,
    quantity,
    refuse,
    refuse_long,
    time_range,
    two_bearings,
    vector,
)
from cli.show.output import command

if TYPE_CHECKING:
    from cli.body.moving import ShaftRequest
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result
    from dalembert.results.way import Topic


@command(
    """
Arguments:
  parts PARTS  CSV of parts; - is standard input.
What:
  omega X,Y,Z  Angular velocity, rad/s, such as 0,4,12.
  alpha X,Y,Z  Angular acceleration, rad/s².
  frame_omega X,Y,Z  Angular velocity of other axes, rad/s: --alpha is the rate of omega's components in them.
  fixed X,Y,Z  Point about which the body turns, m.
  velocity X,Y,Z  Velocity of the centre of mass, m/s.
  acceleration X,Y,Z  Acceleration of the centre of mass, m/s².
  find NAME  Number to find: omega.y, speed or a cell, rod.ry.
  so_that QUANTITY=VALUE  With --find: wanted result, such as momentum.x=2.
  only NAME,...  Show only these: mass,inertia,momentum,bearing1.
Shaft:
  shaft Z1:Z2  Two bearings along the axis, such as 0mm:400mm.
  axis AXIS  Axis: x, y, z (default), -x … or a vector 1,0,1.
  speed SPEED  Speed of the shaft, such as 1200rpm.
  speed_rate RATE  Rate of the speed, such as 10rad_s2.
  gravity X,Y,Z  Gravity on the shaft, m/s², such as 0,-9.81,0.
  correct NAME:Z:RADIUS...  Correction plane, A:0mm:20mm; repeatable.
Robot:
  check_inertias  Check the inertia tensors of a robot file.
Further options (docs/commands.md describes them):
  about X,Y,Z  Point of reference of angular momentum and inertia, m, fixed in space (default: --fixed, else the origin).
""",
    example="riul-rod",
)
def body(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Compute mass, centre of mass and inertia of a body from its parts, its angular momentum, and the forces and
    moments of its motion.

    PARTS has a row for each part: part, shape, mass_* (of a hole negative) or density_*, and x_* y_* z_* of its centre of
    mass. The star is a unit. axis_x axis_y axis_z (default z) and rx_* ry_* rz_* (turns about the fixed axes, in this order)
    place it. A column body separates several bodies. Shapes and their dimensions: point; rod length; disk, ring radius;
    arc radius, angle; cylinder, cone radius, length; tube radius, inner_radius, length; box width, height, depth; plate
    width, height; sphere radius, inner_radius; tensor ixx iyy izz ixy ixz iyz, products as +∫xy dm; mesh file, file_unit
    (STL, OBJ). A point may have radius and angle for x and y. Thin shapes take linear_density_* or area_density_*.
    """
    from cli.body import tables
    from cli.body.moving import MovingBody, Request
    from cli.read.root_search import pair, with_found
    from dalembert.results.result import Result
    from rigidbody3d.parts import read_bodies, read_table

    request = Request(
        omega=vector("--omega", options.omega, "speed"),
        alpha=vector("--alpha", options.alpha, "angular acceleration"),
        frame_omega=vector("--frame-omega", options.frame_omega, "speed"),
        about=vector("--about", options.about, "length"),
        fixed=vector("--fixed", options.fixed, "length"),
        velocity=vector("--velocity", options.velocity, "velocity"),
        acceleration=vector("--acceleration", options.acceleration, "acceleration"),
        shaft=_shaft(options),
    )
    if options.check_inertias:
        others = request != Request() or options.find or options.so_that or options.only
        if (
            others
            or options.axis
            or options.gravity
            or options.speed
            or options.speed_rate
            or options.correct
        ):
            raise bad("--check-inertias", "cannot be combined with options of a motion or a shaft")
        return _inertias(options.parts)
    of_center = {"velocity": options.velocity, "acceleration": options.acceleration}
    if options.fixed is not None:
        refuse("the motion of the centre of mass follows from --fixed: expected one of them", **of_center)
    if options.shaft is not None:
        free = {
            "omega": options.omega,
            "alpha": options.alpha,
            "frame_omega": options.frame_omega,
            "fixed": options.fixed,
        }
        refuse("a shaft turns about its axis at --speed and --speed-rate", **free, **of_center)
    sought, solution = pair(options.find, options.so_that), None
    if sought is None:
        bodies = [MovingBody(each, request) for each in read_bodies(options.parts)]
    else:
        from cli.body.way import find as search

        moving, solution = search(read_table(options.parts), options.parts, request, *sought)
        bodies = [moving]

    chosen = None if options.only is None else only(options.only, tables.names_of(bodies[0]))

    def way() -> list[Topic]:
        from cli.body.way import way

        return way(bodies)

    result = Result(
        tables=tables.tables(bodies, chosen),
        screen=lambda: [tables.every(bodies, partial(tables.quantities, only=chosen))],
        figure=partial(tables.draw, bodies),
        way=way,
        method=tables.METHOD,
        about={
            "title": "A shaft on two bearings"
            if options.shaft is not None
            else "Mass properties and motion of a body"
        },
        warnings=tables.warnings(bodies),
    )
    return result if solution is None else with_found(result, solution)


def _inertias(file: str) -> Result:
    from cli.body.inertias import table, warnings
    from dalembert.results.result import Result
    from rigidbody3d import check_robot_inertias, read_robot

    robot = read_robot(file)
    each = check_robot_inertias(robot)
    return Result(
        tables={"inertias": lambda: table(each)},
        warnings=warnings(robot, each),
        failed=lambda: not all(check.valid for check in each),
    )


def _shaft(options: SimpleNamespace) -> ShaftRequest | None:
    from cli.body.moving import ShaftRequest
    from cli.read.rotor_options import from_options

    if options.shaft is None:
        names = ("axis", "speed", "speed_rate", "gravity", "correct")
        of_shaft = {name: getattr(options, name) for name in names}
        refuse("this is for a shaft: expected --shaft Z1:Z2 too", **of_shaft)
        return None
    planes = from_options(options.correct, "--correct") if options.correct else None
    if planes is not None and planes.z is None:
        raise bad("--correct", "a correction plane of a shaft needs its place: NAME:Z:RADIUS")
    return ShaftRequest(
        axis=None if options.axis is None else _axis(options.axis),
        bearings=two_bearings("--shaft", options.shaft),
        speed=quantity("--speed", options.speed, "speed") or 0.0,
        speed_rate=quantity("--speed-rate", options.speed_rate, "angular acceleration") or 0.0,
        gravity=vector("--gravity", options.gravity, "acceleration") or (0.0, 0.0, 0.0),
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
        raise bad("--axis", f"'{text}': expected x, y, z, -x, -y, -z or a vector such as 1,0,1")
    direction = vector("--axis", text, "number")
    assert direction is not None
    if not any(direction):
        raise bad("--axis", f"'{text}': expected a direction: all three numbers are 0")
    return direction


@command(
    """
Arguments:
  body BODY.toml  The body and its state; - is standard input.
What:
  time START:STOP:STEP  Times in seconds, such as 0:10:0.01 or 0:10/1000.
  at T...  Time in seconds; repeatable (default: 0).
  find NAME  Number of the file to find: omega.z, inertia.3, top.mgl, or tilt of a top.
  so_that QUANTITY=VALUE  With --find: wanted value of a result, such as slow=0.5rad_s or momentum.z=2.
  only NAME,...  Show only these results: omega, attitude, momentum, energy, drift, period, nutation_period, cones, steady.
How:
  method exact|integrate  Use the closed form, or integrate (default: exact where a closed form exists).
  integrator DOP853|splitting=DOP853  Method of integration; splitting is for a symmetric top.
Output:
  page FILE(.html)  Write a page that replays the rotation, with curves and values.
""",
    example="tennis-racket",
)
def spin(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Compute the rotation of a body in time: angular velocity, attitude, momentum and energy at any instant.

    BODY.toml has inertia = [I1, I2, I3] in kg·m² (or a 3 × 3 matrix, or parts = "parts.csv"), omega in body axes in
    rad/s, and attitude = [w, x, y, z], a quaternion from body to space (default [1, 0, 0, 0]). A top has a table [top]
    with mgl in N·m, weight times distance: then inertia is about the fixed point, the axis is body z and gravity acts
    along -z of space. A torque is torque = [x, y, z] in N·m with frame = "body" or "space". Other units stand in
    quotes, such as "700 rpm".
    """
    import numpy as np

    from cli.body import states
    from cli.read.root_search import pair, with_found
    from dalembert.results.result import Result
    from rigidbody3d.rotation_in_time import Rotation
    from rigidbody3d.turning_body import read_body

    if options.time is not None and options.at:
        raise bad("--at", "expected --time or --at, not both")
    if options.time is not None:
        times = time_range("--time", options.time)
    else:
        times = [number_or_quantity("--at", text, "time") for text in options.at or ["0"]]
    chosen = only(options.only, states.QUANTITIES)
    if options.page is not None:
        refuse_long(len(times))
    turning = read_body(options.body)
    rotation = Rotation(turning, np.array(times), options.method, options.integrator)
    sought, solution = pair(options.find, options.so_that), None
    if sought is not None:
        rotation, solution = states.find(rotation, *sought)
        turning = rotation.body
    if rotation.exact and options.integrator != "DOP853":
        raise bad("--integrator", "expected --method integrate too: this rotation has a closed form")
    rotation.states  # noqa: B018  faults of the data are errors before anything is shown

    def moving() -> bytes:
        from dalembert.results.chosen_units import shown
        from rigidbody3d.animation import turning_page

        table = shown(states.states(rotation), show.chosen_units)
        made = turning_page(turning.name, turning.inertia, turning.omega, table, turning.mgl is not None)
        return made.html.encode()

    result = Result(
        way=partial(states.way, rotation),
        tables=states.tables(rotation, chosen),
        head={"method": "exact" if rotation.exact else rotation.integrator},
        figure=partial(states.draw, rotation),
        beside={} if options.page is None else {options.page: moving},
        method=states.METHOD,
        about={"title": turning.name or "Rotation in time"} | turning.about,
        warnings=[
            *turning.warnings,
            *states.warnings(rotation, () if options.only is None else chosen),
            *(states.coarse(rotation) if options.page else ()),
        ],
    )
    return result if solution is None else with_found(result, solution)
