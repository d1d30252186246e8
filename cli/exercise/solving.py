"""The exercise's files with a student's numbers in them, and the command run on them."""

from __future__ import annotations

import csv
import io
import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from fractions import Fraction
from functools import cached_property
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cli.exercise.description import Ask, Exercise, Solved, Value, value_of
from cli.read.options import components
from cli.show.output import parser_of, result_of
from dalembert.errors import DataError, quote
from dalembert.quantities import is_number, unit_ratio
from dalembert.tables.files import SUFFIXES, read_bytes, split_sheet
from dalembert.tables.headers import heading
from dalembert.tables.sources import open_source
from dalembert.units import parted

if TYPE_CHECKING:
    from balancing.planes import Planes
    from cli.balance.rotors import Rotors

MECHANISM = ("mechanism", "forces", "inspect", "equilibrium", "simulate", "tolerance")
"""Commands on a mechanism's file: they take --set."""
_TABLES = (".csv", ".tsv", ".txt", *SUFFIXES)
_FILES = (".toml", *_TABLES)


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
    """Return a drawn value as a cell in a column's unit, exactly where that is a decimal; None where the units do not fit."""
    if not value.unit:
        return f"{value.number:f}"
    scale = unit_ratio(value.unit, unit) if unit else None
    if scale is None:
        return None
    if scale == 1:
        return f"{value.number:f}"
    number = Fraction(value.number) * scale
    exact = Decimal(number.numerator) / Decimal(number.denominator)
    # 7 deg in rev, or anything in rad, is no decimal
    return f"{exact:f}" if Fraction(exact) == number else repr(float(number))


@dataclass(eq=False, repr=False)
class Workshop:
    """A folder for the tables of variants, and what all variants have in common."""

    exercise: Exercise
    folder: Path
    read: dict[str, DataTable] = field(default_factory=dict)

    def table(self, name: str) -> DataTable:
        """Return a table of the exercise."""
        if name not in self.read:
            source = open_source(str(self.exercise.folder / name), {}, None)
            header = list(source.header)
            # cells that a short row lacks are blank
            rows = [[*cells, *[""] * (len(header) - len(cells))] for _, cells in source.rows()]
            self.read[name] = DataTable(header, rows)
        return self.read[name]

    def cell(self, name: str) -> tuple[str, int, int] | None:
        """Return file, row and column of a table's cell by its name: `rotor.csv:W1.mass_kg`; None where there is none."""
        parts = cell_of(name)
        if parts is None or parts[0] not in self.tables:
            return None
        table = self.table(parts[0])
        row, column = table.row(parts[1]), table.column(parts[2])
        return None if row is None or column is None else (parts[0], row, column)

    @cached_property
    def tables(self) -> list[str]:
        """The tables that the command names."""
        return [word for word in self.exercise.command[1:] if split_sheet(word)[0].lower().endswith(_TABLES)]

    @cached_property
    def mechanism(self) -> str | None:
        """The mechanism's file, where the command has one."""
        words = self.exercise.command
        if words[0] not in MECHANISM:
            return None
        return next((word for word in words[1:] if word.lower().endswith(".toml")), None)

    @cached_property
    def described(self) -> Any:
        """The mechanism as its file describes it."""
        from cli.cases.cases import load

        assert self.mechanism is not None
        return load(str(self.exercise.folder / self.mechanism))

    @cached_property
    def dimensions(self) -> Mapping[str, Any]:
        """The dimensions of the mechanism by their paths."""
        from virtualwork.describe.dimensions import dimensions

        return {} if self.mechanism is None else dimensions(self.described.mechanism)

    def by_column(self, ask: Ask) -> Ask:
        """Return a question with its quantity's column, where it names the quantity as --only does: H.x is H_x."""
        if "." not in ask.quantity or self.mechanism is None:
            return ask
        from virtualwork.describe import DescriptionError
        from virtualwork.quantities import named

        try:
            columns = named(self.described.mechanism, ask.quantity)
        except DescriptionError:
            return ask
        if columns[0].reverse and "--only" not in self.exercise.command:
            raise DataError(
                f"{self.exercise.file}: [[ask]], key quantity: found {quote(ask.quantity)}, the force on the other link, which is no "
                f"column of the command: expected --only {ask.quantity} with the other quantities in the command"
            )
        return replace(ask, quantity=columns[0].header) if len(columns) == 1 else ask

    def entered(self, name: str, value: Value) -> tuple[str, int, int, str]:
        """Return file, row and column of a drawn value's cell, and its text.

        Raises
        ------
        DataError
            A unit that is not the column's.
        """
        place = self.cell(name)
        assert place is not None
        file, row, column = place
        text = converted(value, self.table(file).quantity(column)[1])
        if text is None:
            raise DataError(
                f"{self.exercise.file}: [draw], {name}: found {quote(str(value))}, expected a value in the unit of the column "
                f"{self.table(file).header[column]}"
            )
        return file, row, column, text

    def problem(self, drawn: Mapping[str, Value]) -> Problem:
        """Return the exercise with a student's numbers."""
        return Problem(self, dict(drawn))

    def datum(self, name: str, drawn: Mapping[str, Value]) -> Value | None:
        """Return a datum by the name that stands in braces in the text; None where there is none."""
        cell = self.cell(name)
        if cell is not None:
            file, row, column = cell
            unit = self.table(file).quantity(column)[1]
            if name in drawn:
                return Value(drawn[name].number, drawn[name].unit or unit)
            number = self.table(file).number(row, column)
            return None if number is None else Value(number, unit)
        if name in drawn:
            return drawn[name]
        if name in self.dimensions:
            return self._dimension(name)
        return None

    def _dimension(self, name: str) -> Value:
        from dalembert.units import LISTED, from_si
        from virtualwork.describe.dimensions import value

        text = self._written(name)
        if text is not None:
            return text
        m, bare, *_ = self.described
        kind = self.dimensions[name].kind
        unit = {"length": bare.get("length", "m"), "angle": bare.get("angle", "deg")}.get(kind)
        unit = unit or (LISTED[kind][0] if LISTED.get(kind) else "")
        number = float(value(m, name))  # type: ignore[arg-type]
        shown = from_si(number, kind, unit) if unit else number
        return Value(Decimal(f"{shown:.12g}"), unit)

    def _written(self, name: str) -> Value | None:
        """A number with its unit as the mechanism's file has it, such as 300 rpm; None where it is another form."""
        import tomllib

        assert self.mechanism is not None
        here: Any = tomllib.loads(
            read_bytes(str(self.exercise.folder / self.mechanism))[1].decode("utf-8-sig")
        )
        for part in name.split("."):
            if isinstance(here, list) and part.isdecimal() and 1 <= int(part) <= len(here):
                here = here[int(part) - 1]
            elif isinstance(here, dict) and part in here:
                here = here[part]
            else:
                return None
        return value_of(here) if isinstance(here, str) and not is_number(here) else None


def placeholders(word: str) -> list[str]:
    return re.findall(r"\{([A-Za-z_]\w*)\}", word)


@dataclass(eq=False, repr=False)
class Problem:
    """The exercise with the numbers of one student, perhaps with a slip in them."""

    workshop: Workshop
    drawn: dict[str, Value]
    cells: dict[tuple[str, int, int], str] = field(default_factory=dict)
    """Further cells of tables: file, row, column -> text."""
    added: dict[str, tuple[str, list[str]]] = field(default_factory=dict)
    """A further column of a table: its title and cells."""
    words: Sequence[str] = ()
    """The command's words, where they are not the exercise's own."""
    further: Sequence[str] = ()
    """Words behind the command's."""

    @property
    def exercise(self) -> Exercise:
        """The exercise."""
        return self.workshop.exercise

    @cached_property
    def place(self) -> Path:
        """The folder of its tables."""
        return Path(tempfile.mkdtemp(dir=self.workshop.folder))

    @cached_property
    def tables(self) -> dict[str, DataTable]:
        """The tables with this student's numbers."""
        shop = self.workshop
        cells: dict[str, dict[tuple[int, int], str]] = {name: {} for name in shop.tables}
        for name, value in self.drawn.items():
            if shop.cell(name) is not None:
                file, row, column, text = shop.entered(name, value)
                cells[file][row, column] = text
        for (file, row, column), text in self.cells.items():
            cells[file][row, column] = text
        return {
            name: shop.table(name).changed(changed, dict([self.added[name]] if name in self.added else []))
            for name, changed in cells.items()
        }

    @cached_property
    def command(self) -> list[str]:
        """The words of the command, files in place."""
        changed = (
            {cell[0] for name in self.drawn if (cell := self.workshop.cell(name))}
            | {name for name, *_ in self.cells}
            | set(self.added)
        )
        words = []
        for word in filter(None, self.words or self.exercise.command):
            for name in placeholders(word):
                if name in self.drawn:
                    word = word.replace(f"{{{name}}}", self.drawn[name].option)
            if word in changed:
                # a folder of its own: the tables of other students and slips stay as they are
                path = self.place / Path(word).with_suffix(".csv").name
                path.write_text(self.tables[word].text(), encoding="utf-8")
                words.append(str(path))
            elif split_sheet(word)[0].lower().endswith(_FILES) and "=" not in word:
                words.append(str(self.exercise.folder / word))
            else:
                words.append(word)
        for name, value in self.drawn.items():
            if cell_of(name) is None and name in self.workshop.dimensions:
                words += ["--set", f"{name}={value.option}"]
        return [*words, *self.further]

    @cached_property
    def parameters(self) -> Mapping[str, Any]:
        """What the command's words say, by the names of its parameters."""
        name, *rest = self.command
        values: Mapping[str, Any] = parser_of(name).make_context(name, rest).params
        return values

    @cached_property
    def gravity(self) -> float:
        """The g of the command or of the mechanism's file, m/s²; 0 where there is none."""
        text = self.parameters.get("gravity")
        if text is not None:
            return hypot(*components("--gravity", text, "acceleration", text.count(",") + 1))
        if self.workshop.mechanism is not None:
            return abs(complex(self.workshop.described.mechanism.gravity))
        return 0.0

    def known_masses(self) -> tuple[Rotors, Planes]:
        """Read the masses and the correction planes of `dalembert balance`."""
        from balancing.planes import read_planes
        from cli.balance.rotors import read_rotors
        from cli.read.rotor_options import from_options

        own = self.parameters
        planes = read_planes(own["planes"]) if own["planes"] else from_options(own["plane"], sought=True)
        return read_rotors(own["table"], self.gravity, needs_z=planes.several), planes

    def result(self, *further: str) -> Solved:
        """Run the command.

        Raises
        ------
        DataError
            Named after the exercise: files in the temporary folder are none that the user knows.
        """
        words = [*self.command, *further]
        try:
            result = result_of(words)
            with result.within():
                tables = [table() for table in result.tables.values()]
                document = result.documented()
                failed = result.failed()
        except DataError as error:
            text = str(error).replace(f"{self.place}/", "")
            raise DataError(f"{self.exercise.file}: key command: {text}") from None
        if failed:
            reason = f": {result.warnings[0]}" if result.warnings else ""
            raise DataError(f"{self.exercise.file}: key command: no case of it can be solved{reason}")
        return Solved(self.exercise, tables, document, result)
