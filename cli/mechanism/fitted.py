"""`--fit`: the dimensions of which a point comes through given places, and the file with them in it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.errors import DataError
from cli.mechanism.solve import load
from cli.mechanism.tables import beside
from cli.mechanism.variants import assigned, assignment, in_si, quantity
from cli.read import options
from cli.read.files import read_bytes
from cli.read.units import read_degrees, to_si
from cli.show.columns import Column, Result, Table
from virtualwork.describe.dimensions import Dimension, value
from virtualwork.describe.errors import DescriptionError
from virtualwork.describe.units import Units

if TYPE_CHECKING:
    from cli.show.columns import Document
    from virtualwork import Mechanism
    from virtualwork.family.fitting import Fit

# relative: how well what is written has to read as what was found
WRITTEN = 1e-12


def fitted(
    file: str,
    target: str | None,
    point: str | None,
    free: Sequence[str] | None,
    change: Sequence[str] | None,
    seed: int,
    others: Sequence[str],
) -> Result:
    """Find the dimensions, and show them; `others` are options that do not go with it."""
    for flag, given in (("--fit", target), ("--point", point), ("--free", free)):
        if not given:
            example = {"--fit": "TARGET.csv", "--point": "NAME", "--free": "PATH=LOW:HIGH"}[flag]
            there = "--fit" if flag != "--fit" else "--point" if point else "--free"
            raise options.bad(flag, f"missing beside {there}: expected {flag} {example}")
    if others:
        raise options.bad("--fit", f"expected without {others[0]}: it finds dimensions, not poses")
    assert target is not None
    assert point is not None
    assert free is not None
    m, bare, said, about = load(file)
    if len(m.inputs) != 1:
        raise options.bad("--fit", f"{len(m.inputs)} inputs: expected a mechanism with one")
    m = assigned(m, bare, change) if change else m
    if not any(point in points for points in m.bodies.values()):
        names = ", ".join(dict.fromkeys(p for points in m.bodies.values() for p in points))
        raise options.bad("--point", f"no point is named '{point}': expected one of {names}")
    bounds = _bounds(m, free, bare)
    places, inputs = _target(m, point, target, said)
    try:
        found = m.fit(point, places, bounds, inputs, seed=seed)
    except DescriptionError as error:
        raise options.bad("--free", error) from None
    return Result(
        document=lambda: _document(found),
        tables={"fit": lambda: _numbers(found), "points": lambda: _places(found)},
        notes=lambda: m.name,
        afterword=lambda: (
            f"{point} comes within {found.max:.3g} m of all {len(found.target)} target points, "
            f"{found.rms:.3g} m in the root of the mean square; the file's own numbers and "
            f"{found.starts - 1} others were starts."
        ),
        toml=lambda: _text(file, found, bare).encode(),
        warnings=[*said, *found.remarks],
        method="Nonlinear least squares within bounds, from many starts, with exact derivatives.",
        about={"title": m.name or "Mechanism"} | about,
    )


def _bounds(m: Mechanism, free: Sequence[str], bare: Mapping[str, str]) -> dict[str, tuple[float, float]]:
    """Every `--free PATH=LOW:HIGH` in SI."""
    found: dict[str, tuple[float, float]] = {}
    for text in free:
        (dimension, *both), span = assignment(m, text, "--free", "LOW:HIGH")
        if both:
            raise options.bad("--free", f"'{text}': two numbers: expected {dimension.path} or {both[0].path}")
        if dimension.path in found:
            raise options.bad("--free", f"'{text}': {dimension.path} is given twice")
        ends = span.split(":")
        if len(ends) != 2:
            raise options.bad("--free", f"'{text}': expected PATH=LOW:HIGH, such as {dimension.path}=...:...")
        low, high = (in_si(dimension, quantity(dimension, end, "--free", bare)) for end in ends)
        if not low < high:
            raise options.bad(
                "--free", f"'{text}': expected the lower bound first, and a higher one after it"
            )
        found[dimension.path] = low, high
    return found


def _target(m: Mechanism, point: str, path: str, said: list[str]) -> tuple[Any, Any]:
    """The places (n, 2) and, where the table has them, the inputs (n,), SI."""
    from cli.read.tables import read

    turning = not m.inputs[0].is_slide
    kinds = {"x": "length", "y": "length", "input": "angle" if turning else "length"}
    # a table of poses has the point's name before its coordinates
    own = {f"{point}_{axis}_".lower(): f"{axis}_" for axis in "xy"}

    def meant(headers: list[str]) -> list[str]:
        return [
            next((to + h[len(at) :] for at, to in own.items() if h.lower().startswith(at)), h)
            for h in headers
        ]

    table = read(path, numbers=kinds, texts=("step",), headers=meant)
    for name in ("x", "y"):
        table.require(name, "length")
    if table.rows < 2:
        raise DataError(f"{table.file}: a target of one point: expected two or more rows")
    said += table.warnings
    si = {name: np.asarray(to_si(c.values, kinds[name], c.unit)) for name, c in table.numbers.items()}
    return np.stack([si["x"], si["y"]], axis=1), si.get("input")


def _shown(dimension: Dimension, si: float) -> float:
    return read_degrees(si) if dimension.unit == "deg" else si


def _document(found: Fit[Mechanism]) -> Document:
    numbers = zip(found.dimensions, found.values.tolist(), strict=True)
    return {
        "name": found.mechanism.name,
        "fit": {
            "parameters": {d.header: _shown(d, si) for d, si in numbers},
            "rms_m": found.rms,
            "max_m": found.max,
            "starts": found.starts,
            "evaluations": found.evaluations,
        },
    }


def _numbers(found: Fit[Mechanism]) -> Table:
    """One row: the dimensions, and how near they come."""
    numbers = zip(found.dimensions, found.values.tolist(), strict=True)
    parameters = [Column(d.path, d.unit, [_shown(d, si)]) for d, si in numbers]
    return Table(
        [
            *parameters,
            Column("rms", "m", [found.rms]),
            Column("max", "m", [found.max]),
            Column("starts", "", [float(found.starts)]),
            Column("evaluations", "", [float(found.evaluations)]),
        ]
    )


def _places(found: Fit[Mechanism]) -> Table:
    """A row for each place of the target."""
    turning = not found.mechanism.inputs[0].is_slide
    inputs = np.degrees(found.inputs) if turning else found.inputs
    return Table(
        [
            Column("input", "deg" if turning else "m", inputs),
            Column("x", "m", found.positions.real),
            Column("y", "m", found.positions.imag),
            Column("target_x", "m", found.target.real),
            Column("target_y", "m", found.target.imag),
            Column("distance", "m", found.distances),
        ]
    )


def _text(file: str, found: Fit[Mechanism], bare: Mapping[str, str]) -> str:
    """The file's own text with the fitted numbers."""
    import tomlkit

    from virtualwork import Mechanism

    name, data = read_bytes(file)
    document = tomlkit.parse(data.decode("utf-8-sig"))
    for dimension, si in zip(found.dimensions, found.values.tolist(), strict=True):
        _write(document, dimension, si, Units(dict(bare)))
    text = tomlkit.dumps(document)
    folder = Path() if file == "-" else Path(file).parent
    again = Mechanism.from_toml_text(text, name, folder, partial(beside, []))
    for path, si in found.parameters.items():
        if not math.isclose(float(value(again, path).real), si, rel_tol=WRITTEN, abs_tol=1e-15):
            raise DataError(
                f"{name}: {path}: it does not stand in the file as a number that could be replaced"
            )
    return text


def _write(document: Any, dimension: Dimension, si: float, units: Units) -> None:
    """Put a number where it stands in the document, in the unit of the file."""
    path, where = dimension.path.split("."), dimension.where
    if where[0] in ("guides", "gears"):
        # lists count from 1, and slots apart from sliders
        rows = document[path[0]]
        of, rest = (rows[int(path[1]) - 1] if isinstance(rows, list) else rows), where[2:]
    elif where[0] == "links":
        of, rest = document["links"][where[1]]["points"], where[3:]
    else:
        of, rest = document[where[0]], where[1:]
    *way, last = (0 if key == "x" else 1 if key == "y" else key for key in rest)
    for key in way:
        of = of[key]
    if isinstance(of.get(last) if isinstance(last, str) else of[last], str):
        of[last] = f"{_shown(dimension, si)!r} {dimension.unit}".strip()
    else:
        of[last] = si / units.factors.get(dimension.kind, 1.0)
