"""`dalembert spin`: the rotation of a body in time."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cli.read import options
from cli.show.commands import ShowOptions, suffix_among
from cli.show.output import command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cli.show.columns import Result


class Method(StrEnum):
    """How the rotation is found."""

    exact = "exact"
    integrate = "integrate"


class Integrator(StrEnum):
    """What integrates it."""

    dop853 = "DOP853"
    splitting = "splitting"


EXAMPLE = "tennis-racket"
OPTIONS = """
Arguments:
  body BODY.toml  The body and its state; - is standard input.
What:
  time START:STOP:STEP  Times in seconds, such as 0:10:0.01 or 0:10/1000.
  at T  A time, s; may be repeated.
How:
  method  Default: exact wherever a closed form exists, else integrate.
  integrator  For integration; the splitting is for a symmetric top.
Output: of the rotation:
  html FILE.html  Write a page that moves to FILE: play, slider, curves, values.
"""


@command(OPTIONS)
def run(
    body: str,
    time: str | None = None,
    at: list[str] | None = None,
    method: Annotated[Method | None, typer.Option(show_default=False)] = None,
    integrator: Integrator = Integrator.dop853,
    html: Annotated[Path | None, typer.Option(callback=suffix_among(".html"))] = None,
    *,
    show: ShowOptions,
) -> Result:
    """Turn a body through time: angular velocity, attitude, momentum and energy at any instant.

    BODY.toml holds inertia = [I1, I2, I3] (or a 3 × 3 matrix, or parts = "parts.csv"), kg·m²; omega in body axes,
    rad/s; attitude = [w, x, y, z], body to space (default [1, 0, 0, 0]); if wanted a table [top] with mgl in N·m
    (then inertia is about the fixed point, the axis is body z and gravity acts along -z of space), or torque =
    [x, y, z] in N·m with frame = "body" or "space".
    """
    import numpy as np

    from cli.show.columns import Result
    from cli.spin import columns, words
    from cli.spin.read import read_body
    from cli.spin.solve import Rotation

    if time is not None and at:
        raise options.bad("--at", "expected --time or --at, not both")
    if time is not None:
        times = options.time_range("--time", time)
    else:
        times = [options.number_or_quantity("--at", text, "time") for text in at or ["0"]]
    if html is not None:
        from cli.show.page import refuse_long

        refuse_long(len(times))
    given = read_body(body)
    found = Rotation(given, np.array(times), method.value if method else None, integrator.value)
    found.states  # noqa: B018  faults of the data are found before anything is shown

    def figure() -> Figure:
        from cli.spin.picture import draw

        return draw(found)

    def page() -> bytes:
        from cli.show.page import shown
        from rigidbody3d.animation import turning_page

        table = shown(columns.states(found), show.units)
        made = turning_page(given.name, given.inertia, given.omega, table, given.mgl is not None)
        return made.html.encode()

    return Result(
        document=lambda: columns.document(found),
        tables={"states": lambda: columns.states(found)},
        notes=lambda: words.notes(found),
        afterword=lambda: words.afterword(found),
        figure=figure,
        beside={} if html is None else {html: page},
        method=words.METHOD,
        about={"title": given.name or "Rotation in time"} | given.about,
        warnings=[*given.warnings, *words.warnings(found), *(words.coarse(found) if html else ())],
    )
