"""The tables beside a description, forces and laws of motion: read as every table, handed on as the plain CSV that the library reads."""

from __future__ import annotations

from pathlib import Path

from dalembert.results.text import csv_text
from dalembert.tables.files import note, split_sheet
from dalembert.tables.table import Numbers, read
from dalembert.units import UNITS, to_si

_KNOWN = {
    "time": "time",
    "t": "time",
    "angle": "angle",
    "position": "length",
    "speed": "speed",
    "fx": "force",
    "fy": "force",
    "torque": "torque",
}
# what the library reads as it stands; anything else is put into the first of them
_PLAIN = {"angle": ("rad", "deg"), "position": ("m", "mm")}


def beside(warnings: list[str], path: Path) -> bytes:
    """Return a table as plain CSV: commas, points, units of the library; remarks are added to `warnings`.

    Raises
    ------
    OSError
        No such file.
    DataError
        As of every table: row or cell, column, what was found, what was expected.
    """
    note(split_sheet(str(path))[0]).stat()
    table = read(str(path), numbers=_KNOWN, texts=("step",), blank=tuple(_KNOWN))
    warnings += table.warnings
    columns = dict(_plain(name, column) for name, column in table.numbers.items())
    return csv_text(columns).encode()


def _plain(name: str, column: Numbers) -> tuple[str, list[float]]:
    """Return header and values of a column; where the library knows its unit the digits are those of the file."""
    dimension = _KNOWN[name]
    first = next(iter(UNITS[dimension]))
    if column.unit in _PLAIN.get(name, (first,)):
        return f"{name}_{column.unit}", column.values.tolist()
    si = _PLAIN.get(name, (first,))[0]
    return f"{name}_{si}", to_si(column.values, dimension, column.unit).tolist()
