"""A mechanism's file while it is read: its tables, the units of its bare numbers, the links and points that it names."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

from dalembert.dataclass import dataclass, field
from dalembert.hints import nearest
from dalembert.tables.files import split_sheet
from virtualwork.describe import DescriptionError, require
from virtualwork.describe.units import Units, wrong

GROUND = "ground"
Load = Callable[[Path], bytes]


class File:
    """The tables of a file; `load` reads the tables that lie beside it in its folder."""

    def __init__(self, data: dict[str, Any], folder: Path, load: Load) -> None:
        self.data, self.folder, self.load = data, folder, load
        self.units = Units({})
        self.bodies: dict[str, Mapping[str, complex]] = {}

    def table(self, name: str) -> dict[str, Any]:
        """A table of the file; empty where it is missing."""
        value = self.data.get(name, {})
        if not isinstance(value, dict):
            raise wrong(f"[{name}]", value, "a table")
        return value

    def rows(self, name: str) -> list[dict[str, Any]]:
        """An array of tables; a single table is an array of one."""
        value = self.data.get(name, [])
        if isinstance(value, dict):
            value = [value]
        if not isinstance(value, list) or not all(isinstance(e, dict) for e in value):
            raise wrong(f"[[{name}]]", value, "an array of tables")
        return value

    def beside(self, name: Any) -> bytes:
        """The bytes of a file in the same folder; the name may end in the sheet of a workbook."""
        try:
            return self.load(self.folder / str(name))
        except OSError:
            return self.load(self.folder / split_sheet(str(name))[0])

    def point_of(self, name: Any, where: str) -> tuple[str, str]:
        """`crank.B`, or the plain name of a point that one body alone has: the body and the point. Names may have dots."""
        text = str(name)
        parted = [(text[:i], text[i + 1 :]) for i, letter in enumerate(text) if letter == "."]
        owners = [body for body, points in self.bodies.items() if text in points]
        there = [(body, point) for body, point in parted if point in self.bodies.get(body, ())]
        if there or (parted and not owners):
            return (there or parted)[-1]
        if len(owners) == 1:
            return owners[0], text
        names = {p for points in self.bodies.values() for p in points}
        expected = " or ".join(f'"{body}.{name}"' for body in owners)
        raise wrong(where, name, expected or f'a link and its point such as "crank.B"{nearest(text, names)}')


@dataclass(frozen=True)
class Entry:
    """One table of a part: where it stands, its keys as the file has them, and the fields that are read so far."""

    file: File
    where: str
    keys: Mapping[str, Any]
    fields: dict[str, Any] = field(default_factory=dict)
    # the table of which it is a row
    above: Entry | None = None

    @property
    def slides(self) -> bool:
        """Whether it is a part that moves a slider."""
        return "slider" in self.keys if self.above is None else self.above.slides


def require_keys(entry: Mapping[str, Any], names: Collection[str], where: str, noun: str) -> None:
    """Refuse keys that are none of the names.

    Raises
    ------
    DescriptionError
    """
    if not isinstance(entry, Mapping):
        raise wrong(where, entry, "a table")
    for key in entry:
        if key not in names:
            require(key, names, where, noun)


def missing(where: str, name: str) -> DescriptionError:
    """The error for a key that must be there."""
    return DescriptionError(f"{where}: '{name}' is missing")
