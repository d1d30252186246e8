"""The target of a fit: tables of places, coordinates, angles, travels and efforts, read into the library's targets."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.axes import place_or_angle
from cli.read import options
from dalembert.errors import DataError
from dalembert.hints import choices as hint
from dalembert.quantities import is_number, parse_number

if TYPE_CHECKING:
    from virtualwork import Mechanism
    from virtualwork.family.keep import Bound
    from virtualwork.family.target import Target

# the dimension of each part of a name
DIMENSIONS = {
    "x": "length",
    "y": "length",
    "angle": "angle",
    "position": "length",
    "torque": "torque",
    "force": "force",
}


@dataclass(frozen=True)
class Wanted:
    """A point or its coordinate, the angle of a link, the position of a slide or the input's effort that `--want` names.

    Attributes
    ----------
    path : str
        Its name in the library.
    name : str
        The name of the point, link, slide or input.
    parts : tuple of str
        Its numbers.
    names : tuple of str
        Its names in the options.
    """

    path: str
    name: str
    parts: tuple[str, ...]
    names: tuple[str, ...]

    @property
    def columns(self) -> dict[str, str]:
        """Its columns, as a table of poses calls them, with their dimensions."""
        return {f"{self.name}_{part}": DIMENSIONS[part] for part in self.parts}


def every_wanted(m: Mechanism) -> list[Wanted]:
    """Return all quantities that a fit can aim at."""
    points = dict.fromkeys(point for named in m.bodies.values() for point in named)
    slides = dict.fromkeys(str(guide.point) for guide in m.guides)
    efforts = [(str(entry.name), "force" if entry.is_slide else "torque") for entry in m.inputs]
    return [
        *(Wanted(f"points.{name}", name, ("x", "y"), (name,)) for name in points),
        *(Wanted(f"links.{name}", name, ("angle",), (name, f"{name}.angle")) for name in m.links),
        *(Wanted(f"slides.{name}", name, ("position",), (f"{name}.position",)) for name in slides),
        *(Wanted(f"effort.{name}", name, (effort,), (f"{name}.{effort}",)) for name, effort in efforts),
        *(
            Wanted(f"points.{name}.{axis}", name, (axis,), (f"{name}.{axis}",))
            for name in points
            for axis in "xy"
        ),
    ]


def wanted(m: Mechanism, names: Sequence[str]) -> list[Wanted]:
    """Read the names of `--want`: `H`, `H.y`, `coupler.angle`; the error of an unknown name suggests the nearest."""
    every = every_wanted(m)
    choices = {name: each for each in reversed(every) for name in each.names}
    result: list[Wanted] = []
    for text in (part for name in names for part in options.between_commas(name) or [name]):
        if text not in choices:
            raise options.bad(
                "--want", f"no point, link or slide is named '{text}'{hint(text, reversed(choices))}"
            )
        new = choices[text]
        if any(new.columns.keys() & each.columns.keys() for each in result):
            raise options.bad("--want", f"'{text}' is given twice")
        result.append(new)
    return result


def weights(texts: Sequence[str] | None, aims: Sequence[Wanted]) -> dict[str, float]:
    """Read every `--weight NAME=NUMBER`, by the library's name."""
    weights: dict[str, float] = {}
    for text in texts or ():
        name, equals, number = text.rpartition("=")
        of = [each for each in aims if name.strip() in each.names]
        try:
            weight = float(number)
        except ValueError:
            weight = float("nan")
        if not equals or not 0 <= weight < float("inf"):
            raise options.bad("--weight", f"'{text}': expected NAME=NUMBER, 0 or more")
        if not of:
            names = ", ".join(each.names[-1] for each in aims)
            raise options.bad("--weight", f"'{text}': expected one of {names}")
        weights |= dict.fromkeys((each.path for each in of), weight)
    return weights


def kept(m: Mechanism, texts: Sequence[str] | None, bare: Mapping[str, str]) -> list[Bound]:
    """Read every `--keep QUANTITY>=VALUE` (or `<=`), SI."""
    from virtualwork.family.keep import Bound

    every = every_wanted(m)
    choices: dict[str, tuple[str, str]] = {"transmission": ("transmission", "angle")}
    for each in reversed(every):
        if len(each.parts) == 1:
            choices[each.names[-1]] = each.path, DIMENSIONS[each.parts[0]]
    result = []
    for text in texts or ():
        match = re.fullmatch(r"\s*(\S+?)\s*(>=|<=|≥|≤)\s*(\S.*?)\s*", text)
        if match is None:
            raise options.bad(
                "--keep",
                f"'{text}': expected QUANTITY>=VALUE or QUANTITY<=VALUE, such as transmission>=40deg",
            )
        name, sense, value = match.groups()
        if name not in choices:
            raise options.bad("--keep", f"no quantity is named '{name}'{hint(name, reversed(choices))}")
        path, kind = choices[name]
        if kind in ("length", "angle"):
            number = place_or_angle(value, kind, "--keep", bare).si
        elif is_number(value):
            number = parse_number(value)
        else:
            number = options.needed("--keep", value, kind)
        least = sense in (">=", "≥")
        if name == "transmission" and not (least and 0 <= number <= math.pi / 2):
            raise options.bad("--keep", f"'{text}': expected transmission>=ANGLE, from 0deg to 90deg")
        result.append(Bound(path, number if least else None, None if least else number))
    return result


def targets(
    m: Mechanism, paths: Sequence[str], aims: Sequence[Wanted], by_name: dict[str, float], warnings: list[str]
) -> list[Target]:
    """Read one target from each table: the wanted quantities that it has columns for."""
    result, met = [], set[Wanted]()
    for path in paths:
        target, present = _target(m, path, aims, by_name, warnings)
        result.append(target)
        met |= present
    missing = [each for each in aims if each not in met]
    if missing:
        units = {"length": "m", "angle": "deg", "torque": "N_m", "force": "N"}
        columns = ", ".join(f"{column}_{units[of]}" for column, of in missing[0].columns.items())
        raise DataError(f"{paths[-1]}: no columns of {missing[0].names[-1]}: expected {columns}")
    return result


def _target(
    m: Mechanism, path: str, aims: Sequence[Wanted], by_name: dict[str, float], warnings: list[str]
) -> tuple[Target, set[Wanted]]:
    from dalembert.tables.table import read
    from virtualwork.family.target import Target

    turning = not m.inputs[0].is_slide
    kinds = {"input": "angle" if turning else "length", "weight": "number"}
    short: dict[str, str] = {}
    names = {each.name for each in aims}
    alike = {name.lower() for name in names}
    for each in every_wanted(m):
        # a point H beside a wanted h has columns of its own
        if each in aims or (each.name.lower() in alike and each.name not in names):
            kinds |= each.columns
    for each in aims:
        for part in each.parts:
            if sum(part in other.parts for other in aims) == 1:
                # one alone may go without its name: x_mm, angle_deg, position_mm
                short[f"{part}_"] = f"{each.name}_{part}_"
            if part in ("torque", "force"):
                # as `dalembert forces` writes it
                short[f"input_{part}_"] = f"{each.name}_{part}_"

    def meant(headers: list[str]) -> list[str]:
        lower = [h.strip().lower() for h in headers]
        whole = {to for to in short.values() if any(h.startswith(to.lower()) for h in lower)}
        return [
            next((to + h[len(at) :] for at, to in short.items() if l.startswith(at) and to not in whole), h)
            for h, l in zip(headers, lower, strict=True)
        ]

    table = read(path, numbers=kinds, texts=("step",), headers=meant)
    present = [each for each in aims if any(column in table.numbers for column in each.columns)]
    for each in present or aims[:1]:
        for column, kind in each.columns.items():
            part = column.removeprefix(f"{each.name}_")
            if column not in table.numbers:
                table.require(part if f"{part}_" in short else f"{each.name}_{part}", kind)
    if table.rows < 2:
        raise DataError(f"{table.file}: a target of one point: expected two or more rows")
    warnings += table.warnings
    si: dict[str, Any] = {name: c.si for name, c in table.numbers.items()}
    row_weight = si.get("weight")
    if row_weight is not None:
        table.reject(row_weight < 0, "weight", "a weight of 0 or more")
    places, weight = {}, {}
    for each in present:
        columns = [si[column] for column in each.columns]
        places[each.path] = np.stack(columns, axis=1) if len(columns) == 2 else columns[0]
        number = by_name.get(each.path, 1.0)
        weight[each.path] = number if row_weight is None else number * row_weight
    return Target(places, si.get("input"), weight), set(present)
