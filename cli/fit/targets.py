"""The target of a fit: tables of places, angles, travels and efforts, read into the library's targets."""

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
from dalembert.hints import nearest
from dalembert.quantities import is_number, parse_number

if TYPE_CHECKING:
    from virtualwork import Mechanism
    from virtualwork.family.keep import Bound
    from virtualwork.family.target import Target

# of each kind: the columns that it has behind its name, the room of the library's names
KINDS = {
    "point": ({"x": "length", "y": "length"}, "points"),
    "link": ({"angle": "angle"}, "links"),
    "slide": ({"position": "length"}, "slides"),
    "torque": ({"torque": "torque"}, "effort"),
    "force": ({"force": "force"}, "effort"),
}


@dataclass(frozen=True)
class Wanted:
    """A point, the angle of a link, the position of a slide or the input's effort that `--want` names."""

    kind: str
    name: str

    @property
    def path(self) -> str:
        """What the library calls it."""
        return f"{KINDS[self.kind][1]}.{self.name}"

    @property
    def columns(self) -> dict[str, str]:
        """Its columns, as a table of poses calls them, with their dimensions; headers are read in any case."""
        return {f"{self.name}_{part}".lower(): kind for part, kind in KINDS[self.kind][0].items()}

    @property
    def names(self) -> tuple[str, ...]:
        """What the options call it."""
        parts = KINDS[self.kind][0]
        full = tuple(f"{self.name}.{part}" for part in parts) if len(parts) == 1 else ()
        return (self.name, *full) if self.kind in ("point", "link") else full


def every_wanted(m: Mechanism) -> list[Wanted]:
    """All that a fit can aim at."""
    points = dict.fromkeys(point for named in m.bodies.values() for point in named)
    slides = dict.fromkeys(str(guide.point) for guide in m.guides)
    return [
        *(Wanted("point", name) for name in points),
        *(Wanted("link", name) for name in m.links),
        *(Wanted("slide", name) for name in slides),
        *(Wanted("force" if entry.is_slide else "torque", entry.name) for entry in m.inputs),
    ]


def wanted(m: Mechanism, names: Sequence[str]) -> list[Wanted]:
    """What `--want` names: `H`, `coupler.angle`, `B.position`; a name that is not there is an error that names the nearest."""
    every = every_wanted(m)
    known = {name: each for each in reversed(every) for name in each.names}
    result: list[Wanted] = []
    for text in (part.strip() for name in names for part in name.split(",")):
        owner, _, part = text.rpartition(".")
        if text not in known:
            if part in ("x", "y") and owner in known:
                raise options.bad("--want", f"'{text}': a point has both coordinates: expected {owner}")
            others = ", ".join(dict.fromkeys(each.names[-1] for each in every))
            raise options.bad(
                "--want",
                f"no point, link or slide is named '{text}'{nearest(text, known)}: expected one of {others}",
            )
        if known[text] in result:
            raise options.bad("--want", f"'{text}' is given twice")
        result.append(known[text])
    return result


def weights(texts: Sequence[str] | None, aims: Sequence[Wanted]) -> dict[str, float]:
    """Every `--weight NAME=NUMBER`, by the library's name."""
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
    """Every `--keep QUANTITY>=VALUE` (or `<=`), SI."""
    from virtualwork.family.keep import Bound

    every = every_wanted(m)
    known: dict[str, tuple[str, str]] = {"transmission": ("transmission", "angle")}
    for each in reversed(every):
        for part, kind in KINDS[each.kind][0].items():
            path = f"{each.path}.{part}" if each.kind == "point" else each.path
            known[f"{each.name}.{part}"] = path, kind
    result = []
    for text in texts or ():
        found = re.fullmatch(r"\s*(\S+?)\s*(>=|<=|≥|≤)\s*(\S.*?)\s*", text)
        if found is None:
            raise options.bad(
                "--keep",
                f"'{text}': expected QUANTITY>=VALUE or QUANTITY<=VALUE, such as transmission>=40deg",
            )
        name, sense, value = found.groups()
        if name not in known:
            raise options.bad(
                "--keep",
                f"no quantity is named '{name}'{nearest(name, known)}: expected one of {', '.join(known)}",
            )
        path, kind = known[name]
        if kind in ("length", "angle"):
            number = place_or_angle(value, kind, "--keep", bare)
            number = math.radians(number) if kind == "angle" else number
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
    m: Mechanism, paths: Sequence[str], asked: Sequence[Wanted], by_name: dict[str, float], said: list[str]
) -> list[Target]:
    """One target of each table: what of `asked` it has columns for."""
    found, met = [], set[Wanted]()
    for path in paths:
        target, there = _target(m, path, asked, by_name, said)
        found.append(target)
        met |= there
    missing = [each for each in asked if each not in met]
    if missing:
        parts = ", ".join(
            f"{missing[0].name}_{part}_{'m' if kind == 'length' else 'deg'}"
            for part, kind in KINDS[missing[0].kind][0].items()
        )
        raise DataError(f"{paths[-1]}: no columns of {missing[0].name}: expected {parts}")
    return found


def _target(
    m: Mechanism, path: str, asked: Sequence[Wanted], by_name: dict[str, float], said: list[str]
) -> tuple[Target, set[Wanted]]:
    from dalembert.tables.table import read
    from virtualwork.family.target import Target

    turning = not m.inputs[0].is_slide
    kinds = {"input": "angle" if turning else "length", "weight": "number"}
    short: dict[str, str] = {}
    for each in asked:
        kinds |= each.columns
        if sum(other.kind == each.kind for other in asked) == 1:
            # one alone may go without its name: x_mm, angle_deg, position_mm
            short |= {f"{part}_": f"{each.name}_{part}_".lower() for part in KINDS[each.kind][0]}

    def meant(headers: list[str]) -> list[str]:
        lower = [h.strip().lower() for h in headers]
        whole = {to for to in short.values() if any(h.startswith(to) for h in lower)}
        return [
            next((to + h[len(at) :] for at, to in short.items() if l.startswith(at) and to not in whole), h)
            for h, l in zip(headers, lower, strict=True)
        ]

    table = read(path, numbers=kinds, texts=("step",), headers=meant)
    there = [each for each in asked if any(column in table.numbers for column in each.columns)]
    for each in there or asked[:1]:
        for column, kind in each.columns.items():
            part = column.removeprefix(f"{each.name}_".lower())
            if column not in table.numbers:
                table.require(part if f"{part}_" in short else f"{each.name}_{part}", kind)
    if table.rows < 2:
        raise DataError(f"{table.file}: a target of one point: expected two or more rows")
    said += table.warnings
    si: dict[str, Any] = {name: c.si for name, c in table.numbers.items()}
    row_weight = si.get("weight")
    if row_weight is not None:
        table.reject(row_weight < 0, "weight", "a weight of 0 or more")
    places, weight = {}, {}
    for each in there:
        columns = [si[column] for column in each.columns]
        places[each.path] = np.stack(columns, axis=1) if len(columns) == 2 else columns[0]
        number = by_name.get(each.path, 1.0)
        weight[each.path] = number if row_weight is None else number * row_weight
    return Target(places, si.get("input"), weight), set(there)
