"""Shapes and handles of a page that computes: the numbers of its shapes, and the points to drag."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from dalembert.arithmetic.recorded import Number, Real, Recorder, bare
from dalembert.arithmetic.tape import Tape
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import dimensions
from virtualwork.drawing import Circle, Coil, Drawing, Line, Row
from virtualwork.formulas.profiles import STEPS, counts, written_profile


def drawn_numbers(
    own: Drawing, live: Drawing, written: Description
) -> tuple[list[list[Any]], dict[str, Number]]:
    """Which numbers of the drawing depend on dimensions, and these numbers by their rows.

    Each run of numbers is (shape, what of it, first place in that, first row of the tape, how many).
    """
    places: list[list[Any]] = []
    numbers: dict[str, Number] = {}

    def note(shape: int, what: str, k: int, number: Any) -> None:
        if isinstance(bare(number), Real):
            last = places[-1] if places else None
            if last and last[:2] == [shape, what] and k == last[2] + last[4]:
                last[4] += 1
            else:
                places.append([shape, what, k, len(numbers), 1])
            numbers[f"{len(numbers)}"] = bare(number)

    def parts(z: Any) -> Iterator[Any]:
        z = bare(z)
        yield from (z.real, z.imag)

    for i, (mine, shape) in enumerate(zip(own.parts, live.parts, strict=True)):
        assert type(mine) is type(shape)
        if shape.role == "cam":
            # a tape of its own has all points of a profile
            continue
        if isinstance(shape, (Line, Row)):
            for k, x in enumerate(x for z in shape.points for x in parts(z)):
                note(i, "p", k, x)
            for k, x in enumerate(parts(shape.step) if isinstance(shape, Row) else ()):
                note(i, "d", k, x)
        elif isinstance(shape, Circle):
            for k, x in enumerate(parts(shape.centre)):
                note(i, "z", k, x)
            note(i, "s", 0, shape.radius)
        elif isinstance(shape, Coil):
            for e, (_, z) in enumerate(shape.ends):
                for k, x in enumerate(parts(z)):
                    note(i, "ends", 3 * e + 1 + k, x)
    for i, points in enumerate(written.bodies.values()):
        for k, x in enumerate(parts(next(iter(points.values()), 0j))):
            note(i, "at", k, x)
    for i, label in enumerate(live.labels):
        for k, x in enumerate(parts(label.at)):
            note(i, "label", k, x)
    return places, numbers


def profiles(written: Description, recorder: Recorder) -> dict[str, Tape]:
    """The tape of each cam's profile: a lane is a point, which enters as the number of its piece and its share of that."""
    tapes = {}
    for i, drive in enumerate(written.cam_drives):
        z = bare(written_profile(written, drive, recorder.input("piece"), recorder.input("share")))
        tapes[f"cam{i}"] = recorder.tape({"x": z.real, "y": z.imag})
    return tapes


def cams(own: Drawing, m: Description) -> list[dict[str, Any]]:
    """Which shape each cam's profile is, and how many points it has on each piece of its law."""
    shapes = [i for i, part in enumerate(own.parts) if part.role == "cam"]
    return [
        {"shape": i, "counts": counts(drive.lift, STEPS)}
        for i, drive in zip(shapes, m.cam_drives, strict=True)
    ]


def handles(m: Description) -> list[list[Any]]:
    """Return the handles: the path of a point, its body, its name, and for a point in polar form the point it is counted from."""
    result: list[list[Any]] = [[f"ground.{name}", "ground", name, None] for name in m.ground]
    every = dimensions(m)
    for link, part in m.links.items():
        for point in part.points:
            for path in (f"links.{link}.{point}", f"links.{link}.points.{point}"):
                if f"{path}.x" in every:
                    result.append([path, link, point, None])
                elif point in part.polar and f"{path}.length" in every:
                    result.append([path, link, point, part.polar[point].origin])
    return result
