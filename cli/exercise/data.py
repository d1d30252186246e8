"""The tables of an exercise's data: their rows, columns and cells by name, and a drawn value as a cell."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from functools import cached_property

from cli.exercise.description import Value
from dalembert.quantities import is_number
from dalembert.tables.headers import heading
from dalembert.units import composed, parted

NAMES = ("name", "link", "part", "rotor", "cylinder", "run")
"""Columns that may name the rows of a table."""
COMMA = re.compile(r"\s*[-+]?\d*,\d+(?:[eE][-+]?\d+)?\s*")


def cell_of(name: str) -> tuple[str, str, str] | None:
    """Take the name of a table's cell apart.

    >>> cell_of("rotor.csv:W1.mass_kg"), cell_of("links.crank.B.x")
    (('rotor.csv', 'W1', 'mass_kg'), None)
    """
    file, colon, rest = name.partition(":")
    row, dot, column = rest.rpartition(".")
    return (file, row, column) if colon and dot and row else None


@dataclass(eq=False, repr=False)
class DataTable:
    """A table of the exercise as its file has it: header and cells."""

    header: list[str]
    rows: list[list[str]] = field(default_factory=list)

    def row(self, name: str) -> int | None:
        """Return the row of a name: of a column that names rows, else the row's number."""
        for title in (*NAMES, "plane", "step"):
            column = self.column(title)
            if column is not None:
                cells = [row[column] for row in self.rows]
                if cells.count(name) == 1:
                    return cells.index(name)
        if name.isdecimal() and 1 <= int(name) <= len(self.rows):
            return int(name) - 1
        return None

    def column(self, title: str) -> int | None:
        """Return the place of a column by its header, or by quantity and unit: `mass_kg` for `mass [kg]`."""
        for k, each in enumerate(self.header):
            if title.lower() in (each.strip().lower(), heading(each).name.lower()):
                return k
        return None

    def quantity(self, column: int) -> tuple[str, str]:
        """Return the quantity of a column and its unit, which is empty where there is none."""
        return parted(heading(self.header[column]).name, further=("kg_m2", "kg_m2_s"))

    def number(self, row: int, column: int) -> Decimal | None:
        """Return the number of a cell; None where it holds none."""
        text = self.rows[row][column].strip().replace(",", ".")
        return Decimal(text) if is_number(text) else None

    @cached_property
    def naming(self) -> str | None:
        """The title of the column that names the rows; None where there is none."""
        for title in NAMES:
            column = self.column(title)
            if column is not None and len({row[column] for row in self.rows}) == len(self.rows):
                return title
        return None

    @cached_property
    def names(self) -> list[str]:
        """What the rows are called."""
        column = None if self.naming is None else self.column(self.naming)
        return [str(k) if column is None else row[column] for k, row in enumerate(self.rows, 1)]

    def called(self, row: int) -> str:
        """Return what a row is called in a sentence: its name, or row 3, or cylinder 2."""
        title = "row" if self.naming in (None, "name") else self.naming
        return f"{title} {self.names[row]}" if self.names[row].isdecimal() else self.names[row]

    @cached_property
    def has_commas(self) -> bool:
        """Whether its decimal sign is a comma."""
        return any(COMMA.fullmatch(cell) for row in self.rows for cell in row)

    def changed(self, cells: dict[tuple[int, int], str], further: dict[str, list[str]]) -> DataTable:
        """Return the table with other cells and with further columns by their titles; numbers have a decimal point."""
        rows = [list(row) for row in self.rows]
        for (row, column), text in cells.items():
            rows[row][column] = text.replace(".", ",") if self.has_commas else text
        return DataTable(
            [*self.header, *further],
            [[*row, *(each[k] for each in further.values())] for k, row in enumerate(rows)],
        )

    def text(self) -> str:
        """Return the table as CSV."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n", delimiter=";" if self.has_commas else ",")
        writer.writerow(self.header)
        writer.writerows(self.rows)
        return stream.getvalue()


def converted(value: Value, unit: str) -> str | None:
    """Return a drawn value as a cell in a column's unit, exactly; None where the units do not fit."""
    if not value.unit:
        return f"{value.number:f}"
    own, wanted = composed(value.unit), composed(unit) if unit else None
    if own is None or wanted is None or own[1] != wanted[1]:
        return None
    if own[0] == wanted[0]:
        return f"{value.number:f}"
    (n, d), (wn, wd) = own[0], wanted[0]
    if isinstance(n, int) and isinstance(d, int) and isinstance(wn, int) and isinstance(wd, int):
        number = Fraction(value.number) * Fraction(n, d) / Fraction(wn, wd)
        exact = Decimal(number.numerator) / Decimal(number.denominator)
        return f"{exact:f}"
    return repr(float(value.number) * n / d * wd / wn)
