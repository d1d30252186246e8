"""`dalembert spin`: the rotation of a body in time."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import bad, number_or_quantity, only, time_range
from cli.show.output import command

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result


OPTIONS = """
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
"""


@command(OPTIONS, example="tennis-racket")
def run(options: SimpleNamespace, show: ShowOptions) -> Result:
    """Compute the rotation of a body in time: angular velocity, attitude, momentum and energy at any instant.

    BODY.toml has inertia = [I1, I2, I3] in kg·m² (or a 3 × 3 matrix, or parts = "parts.csv"), omega in body axes in
    rad/s, and attitude = [w, x, y, z], a quaternion from body to space (default [1, 0, 0, 0]). A top has a table [top]
    with mgl in N·m, weight times distance: then inertia is about the fixed point, the axis is body z and gravity acts
    along -z of space. A torque is torque = [x, y, z] in N·m with frame = "body" or "space". Other units stand in
    quotes, such as "700 rpm".
    """
    import numpy as np

    from cli.read.root_search import pair, with_found
    from cli.spin import tables
    from cli.spin.rotation import Rotation, read_body
    from dalembert.results.result import Result

    if options.time is not None and options.at:
        raise bad("--at", "expected --time or --at, not both")
    if options.time is not None:
        times = time_range("--time", options.time)
    else:
        times = [number_or_quantity("--at", text, "time") for text in options.at or ["0"]]
    chosen = only(options.only, tables.QUANTITIES)
    if options.page is not None:
        from cli.read.options import refuse_long

        refuse_long(len(times))
    turning = read_body(options.body)
    rotation = Rotation(turning, np.array(times), options.method, options.integrator)
    sought, solution = pair(options.find, options.so_that), None
    if sought is not None:
        rotation, solution = tables.find(rotation, *sought)
        turning = rotation.body
    if rotation.exact and options.integrator != "DOP853":
        raise bad("--integrator", "expected --method integrate too: this rotation has a closed form")
    rotation.states  # noqa: B018  faults of the data are errors before anything is shown

    def moving() -> bytes:
        from dalembert.results.chosen_units import shown
        from rigidbody3d.animation import turning_page

        table = shown(tables.states(rotation), show.chosen_units)
        made = turning_page(turning.name, turning.inertia, turning.omega, table, turning.mgl is not None)
        return made.html.encode()

    result = Result(
        way=partial(tables.way, rotation),
        tables=tables.tables(rotation, chosen),
        head={"method": "exact" if rotation.exact else rotation.integrator},
        figure=partial(tables.draw, rotation),
        beside={} if options.page is None else {options.page: moving},
        method=tables.METHOD,
        about={"title": turning.name or "Rotation in time"} | turning.about,
        warnings=[
            *turning.warnings,
            *tables.warnings(rotation, () if options.only is None else chosen),
            *(tables.coarse(rotation) if options.page else ()),
        ],
    )
    return result if solution is None else with_found(result, solution)
