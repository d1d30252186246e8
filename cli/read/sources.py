"""The text of a table, and how its cells are told apart: CSV as spreadsheets write it, or a sheet of a workbook."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import TYPE_CHECKING

from cli.errors import DataError, cell_error, quote
from cli.read.decoding import LINE, LOOKED_AT, decoded, delimiter
from cli.read.files import is_workbook, read_bytes, remember, split_sheet
from cli.read.headers import Heading, heading, is_unit, likeness, offers
from cli.read.units import is_number

if TYPE_CHECKING:
    from cli.read.workbooks import Sheet

# rows from which importing pandas pays
LARGE = 10_000


@dataclass(eq=False, repr=False)
class Source:
    """A table before its cells are read."""

    file: str
    text: str
    delimiter: str
    """None parts the cells of a workbook: there it is empty."""
    warnings: list[str]
    sheet: Sheet | None = None
    headings: list[Heading] = field(default_factory=list)
    above: int = 0
    """How many records stand above the header."""
    units_below: bool = False
    """Whether the row below the header holds units."""
    unnamed_first: bool = False
    """Whether the rows begin with a cell for which the header has none."""

    @property
    def of_sheet(self) -> str:
        """Which sheet of the file, for messages about the table as a whole; nothing for CSV."""
        return "" if self.sheet is None else f" (sheet {quote(self.sheet.name)})"

    @property
    def header(self) -> list[str]:
        """The header, as the file writes it."""
        return [each.written for each in self.headings]

    @property
    def large(self) -> bool:
        """Whether pandas pays, and can read the text as it is."""
        plain = not (self.above or self.units_below or self.unnamed_first)
        return plain and self.sheet is None and self.text.count("\n") >= LARGE

    def has_commas(self, columns: Iterable[Iterable[str]]) -> bool:
        """Tell whether these cells have decimal commas: where no comma parts cells, and one stands in a cell."""
        return self.delimiter != "," and any("," in cell for column in columns for cell in column)

    def everything(self) -> Iterator[tuple[int, list[str]]]:
        """Yield (line, cells) of every row that is not blank."""
        if self.sheet is not None:
            for line, row in enumerate(self.sheet.rows, 1):
                if any(cell and not cell.isspace() for cell in row):
                    yield line, row
            return
        lines = (match.group() for match in LINE.finditer(self.text))
        reader = csv.reader(lines, delimiter=self.delimiter, strict=True)
        line = 1
        try:
            for record in reader:
                if any(cell and not cell.isspace() for cell in record):
                    yield line, record
                line = reader.line_num + 1
        except csv.Error as error:
            raise DataError(f"{self.file}: line {line}: {error}: expected CSV with balanced quotes") from None

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield (line, cells) of every row of data."""
        return islice(self.everything(), self.above + 1 + self.units_below, None)

    def error(self, index: int, column: str, found: str, expected: str) -> DataError:
        """Make the one line for a cell of a row of data; `column` as the header spells it."""
        line, _ = next(islice(self.rows(), index, None))
        if self.sheet is None:
            return cell_error(self.file, index + 1, line, column, found, expected)
        from cli.read.workbooks import address

        at = f"row {line}"
        if column in self.header:
            at = f"cell {address((line - 1, self.header.index(column)))}"
        return DataError(
            f"{self.file}: sheet {quote(self.sheet.name)}, {at}, column {column}: "
            f"found {quote(found)}, expected {expected}"
        )

    def check_cells(self, columns: Iterable[int]) -> None:
        """Refuse merged cells, errors and formulas without a value in the columns that are read."""
        if self.sheet is None or not self.sheet.faults:
            return
        used = set(columns)
        top = next(islice(self.everything(), self.above, None))[0] - 1
        for (row, column), (found, expected) in sorted(self.sheet.faults.items()):
            if row >= top and column in used:
                raise self.sheet.error((row, column), found, expected)

    def told(self, unread: Sequence[Heading], missed: Mapping[str, str], texts: Sequence[str]) -> str:
        """Say, where a column is missed, what the header is, what of it may be meant, and which other sheets there are."""
        parts = [f"the header is: {', '.join(self.header)}"]
        if offered := offers(unread, missed, texts):
            parts.append(f"did you mean {' '.join(offered)}?")
        if self.sheet is not None:
            parts.insert(0, f"sheet {quote(self.sheet.name)}")
            if self.sheet.others:
                others = ", ".join(map(quote, self.sheet.others))
                parts.append(f"other sheets: {others}; choose one by '{self.file}#{self.sheet.others[0]}'")
        return f"({'; '.join(parts)})"


def open_source(path: str, known: Mapping[str, str], texts: Sequence[str] | None) -> Source:
    """Open a file, or standard input for `-`, and find its header; `texts` is None where every column is taken."""
    remember(path)
    path, wanted = split_sheet(path)
    file, data = read_bytes(path)
    warnings: list[str] = []
    if is_workbook(data):
        from cli.read.workbooks import read_sheet

        sheet = read_sheet(file, data, wanted)
        source = Source(file, "", "", warnings, sheet)
        if sheet.others and not wanted:
            others = ", ".join(map(quote, sheet.others))
            warnings.append(f"{file}: read the sheet {quote(sheet.name)}; there are also {others}")
    else:
        text = decoded(file, data, warnings)
        source = Source(file, text, delimiter(text), warnings)
    first = list(islice(source.everything(), LOOKED_AT))
    if not first:
        raise DataError(f"{file}: the file is empty{source.of_sheet}: expected a header and rows")
    _find_header(source, first, known, texts)
    return source


def _find_header(
    source: Source,
    records: list[tuple[int, list[str]]],
    known: Mapping[str, str],
    texts: Sequence[str] | None,
) -> None:
    """Find the header below a title, the units below the header, and what is off in its width."""
    candidates = [[heading(cell) for cell in cells] for _, cells in records]
    if texts is not None:
        scores = [likeness(row, known, texts) for row in candidates]
        source.above = scores.index(max(scores)) if max(scores) > 1 else 0
    source.headings = candidates[source.above]
    line, _ = records[source.above]
    if source.above:
        source.warnings.append(
            f"{source.file}: the header is in line {line}; what stands above it is not read"
        )
    below = records[source.above + 1 :]
    if below and _are_units(source.headings, below, known, texts):
        source.units_below = True
        _take_units(source, *below[0], known)
        below = below[1:]
    width = len(source.headings)
    longer = [len(cells) == width + 1 and bool(cells[-1].strip()) for _, cells in below]
    if below and all(longer) and not any(_is_number(cells[0]) for _, cells in below):
        source.headings.insert(0, heading(""))
        source.unnamed_first = True


def _are_units(
    headings: Sequence[Heading],
    below: list[tuple[int, list[str]]],
    known: Mapping[str, str],
    texts: Sequence[str] | None,
) -> bool:
    """Whether the row below the header holds units: no number in it, a unit where numbers are expected."""
    (_, cells), rest = below[0], below[1:]
    if any(map(_is_number, cells)):
        return False
    units = [k for k, cell in enumerate(cells[: len(headings)]) if is_unit(cell)]
    if texts is None:
        filled = [k for k, cell in enumerate(cells) if cell.strip(" -[]()")]
        return bool(rest and units) and units == filled and all(_is_number(rest[0][1][k]) for k in units)
    return any(likeness([headings[k]], known, ()) for k in units)


def _take_units(source: Source, line: int, cells: list[str], known: Mapping[str, str]) -> None:
    for k, (each, cell) in enumerate(zip(source.headings, cells, strict=False)):
        try:
            source.headings[k] = each.with_unit(cell, known)
        except ValueError as error:
            found, expected = quote(cell.strip()), f"'{error}', the unit in its header {quote(each.written)}"
            if source.sheet is not None:
                raise source.sheet.error((line - 1, k), found, expected) from None
            raise DataError(
                f"{source.file}: row of units (line {line}), column {each.written}: "
                f"found {found}, expected {expected}"
            ) from None


def _is_number(cell: str) -> bool:
    return is_number(cell.replace(",", "."))
