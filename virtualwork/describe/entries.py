"""The tables of a TOML description, walked: every complaint names the table and the key."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from virtualwork.describe.errors import DescriptionError, hint
from virtualwork.describe.keys import UNITS, Keys
from virtualwork.describe.parts import GROUND, Link
from virtualwork.describe.units import Units, wrong

Load = Callable[[Path], bytes]
P = TypeVar("P")


class Entries:
    """What is read of every table: entries, quantities, names of links and points."""

    def __init__(self, data: dict[str, Any], folder: Path, load: Load) -> None:
        self.data, self.folder, self.load = data, folder, load
        units = data.get("units", {})
        known_keys(units, UNITS, "[units]", "key")
        self.units = Units(units)
        self.number, self.pair = self.units.number, self.units.pair
        self.links: dict[str, Link] = {}
        self.bodies: dict[str, Mapping[str, complex]] = {GROUND: {}}

    def optional(self, entry: Mapping[str, Any], keys: Keys, key: str, where: str) -> float:
        """A quantity that is 0 where it is not given."""
        return self.number(entry[key], keys[key].kind, f"{where} {key}") if key in entry else 0.0

    def table(self, name: str) -> dict[str, Any]:
        """A table of the file; empty where it is not there."""
        value = self.data.get(name, {})
        if not isinstance(value, dict):
            raise wrong(f"[{name}]", value, "a table")
        return value

    def rows(self, name: str) -> Iterable[tuple[int, dict[str, Any]]]:
        """An array of tables, counted from 1."""
        value = self.data.get(name, [])
        if isinstance(value, dict):
            value = [value]
        if not isinstance(value, list) or not all(isinstance(e, dict) for e in value):
            raise wrong(f"[[{name}]]", value, "an array of tables")
        return enumerate(value, 1)

    def every(self, name: str, read: Callable[[dict[str, Any], int], P]) -> list[P]:
        """Every entry of an array of tables, read."""
        return [read(entry, i) for i, entry in self.rows(name)] if name in self.data else []

    def csv(self, name: Any, where: str) -> list[dict[str, str]]:
        """The rows of a CSV file beside this one."""
        try:
            return table_rows(self.load(self.folder / str(name)))
        except (OSError, ValueError, csv.Error):
            raise wrong(where, name, "a CSV file that can be read") from None

    def body(self, name: Any, where: str, ground: bool = True) -> str:
        """The name of a link, or of the ground."""
        names = self.bodies if ground else self.links
        if not isinstance(name, str) or name not in names:
            raise DescriptionError(f"{where}: unknown link '{name}'{hint(str(name), names)}")
        return name

    def place(self, link: str, value: Any, where: str) -> complex | str:
        """A point of a link: its name, or [x, y] in the link's axes."""
        if isinstance(value, str):
            if value not in self.bodies[link]:
                raise DescriptionError(
                    f"{where}: unknown point '{value}' of {link}{hint(str(value), self.bodies[link])}"
                )
            return value
        return self.pair(value, "length", where)

    def point_of(self, name: Any, where: str) -> tuple[str, str]:
        """`crank.B`, or the plain name of a point that one body alone has: the body and the point."""
        link, dot, point = str(name).rpartition(".")
        if dot:
            return self.body(link, where), point
        owners = [body for body, points in self.bodies.items() if name in points]
        if len(owners) != 1:
            known = {p for points in self.bodies.values() for p in points}
            expected = " or ".join(f'"{body}.{name}"' for body in owners)
            raise wrong(
                where, name, expected or f'a link and its point such as "crank.B"{hint(str(name), known)}'
            )
        return owners[0], str(name)


def known_keys(entry: Mapping[str, Any], names: Collection[str], where: str, what: str) -> None:
    """Refuse keys that are none of the names."""
    if not isinstance(entry, Mapping):
        raise wrong(where, entry, "a table")
    for key in entry:
        if key not in names:
            raise DescriptionError(f"{where}: unknown {what} '{key}'{hint(str(key), names)}")


def need(entry: Mapping[str, Any], keys: tuple[str, ...], where: str) -> None:
    """Refuse an entry in which a key is missing."""
    for key in keys:
        if key not in entry:
            raise DescriptionError(f"{where}: '{key}' is missing")


def proper(entry: Mapping[str, Any], keys: Keys, where: str) -> None:
    """Refuse unknown keys, and an entry in which one is missing that must be there."""
    known_keys(entry, keys, where, "key")
    need(entry, tuple(name for name, key in keys.items() if key.needed), where)


def table_rows(data: bytes) -> list[dict[str, str]]:
    """Return the rows of a table: commas, semicolons or tabs between the cells; UTF-8, UTF-16 or Latin-1.

    Where the cells are not told apart by commas, a comma is a decimal one, and then no cell has a decimal point.

    Raises
    ------
    ValueError, csv.Error
        No such table.

    Examples
    --------
    >>> table_rows(b"angle_deg;fx_N\\n0;-1,5\\n90;2\\n")
    [{'angle_deg': '0', 'fx_N': '-1.5'}, {'angle_deg': '90', 'fx_N': '2'}]
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252")
    header = re.search(r"\S.*", text)
    mark = max(",;\t", key=lambda m: (header.group().count(m) if header else 0, m == ","))
    found = list(csv.DictReader(io.StringIO(text, newline=""), delimiter=mark, skipinitialspace=True))
    cells = (cell for row in found for cell in row.values() if isinstance(cell, str))
    if mark == "," or not any("," in cell for cell in cells):
        return found
    # 2.500 beside 1,5 may be 2500: it is made no number, and refused
    return [
        {key: _decimal(cell) if isinstance(cell, str) else cell for key, cell in row.items()} for row in found
    ]


def _decimal(cell: str) -> str:
    return cell.replace(".", "'").replace(",", ".")
