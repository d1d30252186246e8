"""What `--fit` aims at: tables of places, angles and travels, read into the library's targets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.errors import DataError
from cli.read import options
from virtualwork.describe import hint

if TYPE_CHECKING:
    from virtualwork import Mechanism
    from virtualwork.family.target import Target

# of each kind: its option, the columns that it has behind its name, the room of the library's names
KINDS = {
    "point": ("--point", {"x": "length", "y": "length"}, "points"),
    "link": ("--link", {"angle": "angle"}, "links"),
    "slide": ("--slide", {"position": "length"}, "slides"),
}


@dataclass(frozen=True)
class Wanted:
    """A point, link or slide that `--point`, `--link` or `--slide` names."""

    kind: str
    name: str

    @property
    def path(self) -> str:
        """What the library calls it."""
        return f"{KINDS[self.kind][2]}.{self.name}"

    @property
    def columns(self) -> dict[str, str]:
        """Its columns, as a table of poses calls them, with their dimensions; headers are read in any case."""
        return {f"{self.name}_{part}".lower(): kind for part, kind in KINDS[self.kind][1].items()}


def wanted(
    m: Mechanism, points: Sequence[str] | None, links: Sequence[str] | None, slides: Sequence[str] | None
) -> list[Wanted]:
    """What is aimed at; a name that is not there is an error that names the nearest."""
    known: dict[str, list[str]] = {
        "point": [point for named in m.bodies.values() for point in named],
        "link": list(m.links),
        "slide": [str(guide.point) for guide in m.guides],
    }
    found = []
    for kind, names in (("point", points), ("link", links), ("slide", slides)):
        flag = KINDS[kind][0]
        for name in names or ():
            if name not in known[kind]:
                there = dict.fromkeys(known[kind])
                what = {"slide": "slot or slider"}.get(kind, kind)
                others = f": expected one of {', '.join(there)}" if there else ""
                raise options.bad(flag, f"no {what} is named '{name}'{hint(name, there)}{others}")
            found.append(Wanted(kind, name))
    for i, each in enumerate(found):
        if each in found[:i]:
            raise options.bad(KINDS[each.kind][0], f"'{each.name}' is given twice")
    return found


def weights(given: Sequence[str] | None, asked: Sequence[Wanted]) -> dict[str, float]:
    """Every `--weight NAME=NUMBER`, by the library's name."""
    found: dict[str, float] = {}
    for text in given or ():
        name, equals, number = text.rpartition("=")
        of = [each for each in asked if each.name == name.strip()]
        try:
            weight = float(number)
        except ValueError:
            weight = float("nan")
        if not equals or not 0 <= weight < float("inf"):
            raise options.bad("--weight", f"'{text}': expected NAME=NUMBER, 0 or more")
        if not of:
            names = ", ".join(each.name for each in asked)
            raise options.bad("--weight", f"'{text}': expected one of {names}")
        found |= dict.fromkeys((each.path for each in of), weight)
    return found


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
            for part, kind in KINDS[missing[0].kind][1].items()
        )
        raise DataError(f"{paths[-1]}: no columns of {missing[0].name}: expected {parts}")
    return found


def _target(
    m: Mechanism, path: str, asked: Sequence[Wanted], by_name: dict[str, float], said: list[str]
) -> tuple[Target, set[Wanted]]:
    from cli.read.tables import read
    from virtualwork.family.target import Target

    turning = not m.inputs[0].is_slide
    kinds = {"input": "angle" if turning else "length", "weight": "number"}
    short: dict[str, str] = {}
    for each in asked:
        kinds |= each.columns
        if sum(other.kind == each.kind for other in asked) == 1:
            # one alone may go without its name: x_mm, angle_deg, position_mm
            short |= {f"{part}_": f"{each.name}_{part}_".lower() for part in KINDS[each.kind][1]}

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
