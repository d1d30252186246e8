"""The text of a table, and how its cells are distinguished: CSV as spreadsheets write it, or a sheet of a workbook."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice, takewhile
from typing import TYPE_CHECKING

from dalembert.dataclass import dataclass, field, replace
from dalembert.errors import DataError, cell_error, quote
from dalembert.quantities import is_number
from dalembert.tables.files import is_workbook, read_bytes, remember, split_sheet
from dalembert.tables.headers import Heading, heading, is_unit, likeness, offers

if TYPE_CHECKING:
    from dalembert.tables.workbooks import Sheet

# rows in which the delimiter and the header are looked for
LOOKED_AT = 20
# as many as a sheet of a workbook has
MOST_COLUMNS = 16_384

LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")
_CONTROLS = bytes([*range(9), *range(14, 32), 127])
DASHES = ("-", "\N{EN DASH}", "\N{EM DASH}", "\N{MINUS SIGN}")
_QUOTED = re.compile(r'"[^"]*"')
_COMMENT = re.compile(r"^\s*#(?!\d)", re.MULTILINE)
# a number whose comma may stand between thousands; one that has no mark there
_GROUPED = re.compile(r"(?<![\d.,])[1-9]\d{0,2},\d{3}(?![\d.,])")
_UNGROUPED = re.compile(r"\d{4}")
# rows from which importing pandas pays
LARGE = 10_000
OTHERS = {"<": "XML or HTML", "{": "JSON"}  # how files begin that are no tables
SHOWN = 8  # hidden rows and percentages that a warning names


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
    """The number of records above the header."""
    units_below: bool = False
    """Whether the row below the header holds units."""
    records: list[tuple[int, list[str]]] | None = None
    """Lines and cells in place of those of the text, where they are laid out otherwise."""
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
        plain = not (self.records or self.above or self.units_below or self.unnamed_first)
        return (
            plain and not _COMMENT.search(self.text) and self.sheet is None and self.text.count("\n") >= LARGE
        )

    def has_commas(self, columns: Iterable[Iterable[str]]) -> bool:
        """Return whether these cells have decimal commas: no comma separates cells, and a cell contains one.

        Warn where each may be one between thousands too.
        """
        if self.delimiter == ",":
            return False
        cells = [cell for column in columns for cell in column]
        with_comma = [cell for cell in cells if "," in cell]
        doubtful = bool(with_comma) and all(_GROUPED.search(cell) for cell in with_comma)
        if doubtful and not any(map(_UNGROUPED.search, cells)):
            number = _GROUPED.findall(with_comma[0])[0]
            warning = (
                f"{self.file}: read {quote(number)} as {float(number.replace(',', '.')):g}, with a decimal comma; "
                f"write {number.replace(',', '')} if the comma is between thousands"
            )
            if warning not in self.warnings:
                self.warnings.append(warning)
        return bool(with_comma)

    def everything(self) -> Iterator[tuple[int, list[str]]]:
        """Yield (line, cells) of every row that is not blank."""
        if self.records is not None:
            yield from self.records
            return
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
        """Yield (line, cells) of every row of data; comments in lines of their own are left out."""
        width, below = len(self.headings), islice(self.everything(), self.above + 1 + self.units_below, None)
        return (row for row in below if not _is_comment(row[1], width))

    def full_rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield (line, cells) of every row of data, as many cells as the header has; a row with fewer or more is refused."""
        width = len(self.headings)
        for k, (line, cells) in enumerate(self.rows(), 1):
            if len(cells) < width or any(cell.strip() for cell in cells[width:]):
                many = "s" * (len(cells) != 1)
                raise DataError(
                    f"{self.file}: row {k} (line {line}): found {len(cells)} cell{many}, expected {width}"
                )
            yield line, cells[:width]

    def laid_out(self, headings: Sequence[Heading], rows: Iterable[tuple[int, list[str]]]) -> Source:
        """Return the table with other columns, and the rows of data that it then has."""
        records = [(0, [each.written for each in headings]), *rows]
        return replace(
            self,
            headings=list(headings),
            records=records,
            sheet=None,
            above=0,
            units_below=False,
            unnamed_first=False,
        )

    def named(self, names: Sequence[str]) -> Source:
        """Return the table with its columns under these names, and warn of it; a column whose name another one has too keeps its own."""
        read = [
            (k, each, name)
            for k, (each, name) in enumerate(zip(self.headings, names, strict=True))
            if name != each.name and names.count(name) == 1
        ]
        if not read:
            return self
        headings = list(self.headings)
        for k, each, name in read:
            headings[k] = Heading(each.written, name)
        taken = ", ".join(f"{quote(each.written)} as {name}" for _, each, name in read)
        self.warnings.append(f"{self.file}: read {taken}")
        return replace(self, headings=headings)

    def filled(self, columns: Iterable[int]) -> list[int]:
        """Return those of some columns that have a header, or a cell that is not blank."""
        columns = list(columns)
        bare = [k for k in columns if not self.headings[k].written]
        used = (
            {k for _, cells in self.rows() for k in bare if k < len(cells) and cells[k].strip()}
            if bare
            else {}
        )
        return [k for k in columns if self.headings[k].written or k in used]

    def error(self, index: int, column: str, value: str, expected: str) -> DataError:
        """Make the one line for a cell of a row of data; `column` as the header spells it, or by the name it was read as."""
        column = next((each.written for each in self.headings if each.name == column), column)
        line, _ = next(islice(self.rows(), index, None))
        if self.sheet is None:
            return cell_error(self.file, index + 1, line, column, value, expected)
        from dalembert.tables.reach import address

        at = f"row {line}"
        if column in self.header:
            at = f"cell {address((line - 1, self.header.index(column)))}"
        return DataError(
            f"{self.file}: sheet {quote(self.sheet.name)}, {at}, column {column}: "
            f"found {quote(value)}, expected {expected}"
        )

    def check_cells(self, columns: Iterable[int]) -> None:
        """Refuse merged cells, errors and formulas without a value in the columns that are read."""
        if self.sheet is None:
            return
        used = set(columns)
        # merged cells within header and units part no values
        head = [line for line, _ in islice(self.everything(), self.above + 1 + self.units_below)]
        top, rows = head[self.above] - 1, head[-1]
        self._warn_of_unseen(used, top)
        for (row, column), (value, expected) in sorted(self.sheet.faults.items()):
            if row >= rows and column in used:
                raise self.sheet.error((row, column), value, expected)

    def _warn_of_unseen(self, used: set[int], top: int) -> None:
        """Warn of hidden rows, hidden columns and percentages that take part."""
        assert self.sheet is not None
        from dalembert.tables.reach import address, letters

        looks, of = self.sheet.unseen, f"{self.file}: sheet {quote(self.sheet.name)}"
        filled = {line - 1 for line, _ in self.everything()} if looks.rows else set()
        rows = sorted(row + 1 for row in looks.rows if row >= top and row in filled)
        columns = sorted(letters(k) for k in looks.columns & used)
        percent = sorted(place for place in looks.percent if place[0] > top and place[1] in used)
        for what, names in (("row", list(map(str, rows))), ("column", columns)):
            if names:
                many = len(names) > 1
                self.warnings.append(
                    f"{of}: the {what}{'s' * many} {_some(names)} {'are' if many else 'is'} hidden and take{'s' * (not many)} part"
                )
        if percent:
            many = len(percent) > 1
            self.warnings.append(
                f"{of}: the cell{'s' * many} {_some(list(map(address, percent)))} {'are' if many else 'is'} shown as percentage"
                f"{'s' * many}, and read as the number{'s' * many} behind: 50 % is 0.5"
            )

    def hint(self, unread: Sequence[Heading], missed: Mapping[str, str], texts: Sequence[str]) -> str:
        """Return the hint for a missing column: the header, columns of a similar meaning, and the other sheets."""
        parts = [f"the header is: {', '.join(self.header)}"]
        if offered := offers(unread, missed, texts):
            parts.append(f"did you mean {' '.join(offered)}?")
        if self.sheet is not None:
            parts.insert(0, f"sheet {quote(self.sheet.name)}")
            if self.sheet.others:
                others = ", ".join(map(quote, self.sheet.others))
                parts.append(f"other sheets: {others}; choose one by '{self.file}#{self.sheet.others[0]}'")
        return f"({'; '.join(parts)})"


def open_source(path: str, dimensions: Mapping[str, str], texts: Sequence[str] | None) -> Source:
    """Open a file, or standard input for `-`, and find its header; `texts` is None where every column is taken."""
    remember(path)
    path, wanted = split_sheet(path)
    return source_of(*read_bytes(path), dimensions, texts, wanted)


def source_of(
    file: str, data: bytes, dimensions: Mapping[str, str], texts: Sequence[str] | None, wanted: str = ""
) -> Source:
    """Find the header in the bytes of a file; `wanted` is the sheet of a workbook."""
    warnings: list[str] = []
    if is_workbook(data):
        from dalembert.tables.workbooks import read_sheet

        sheet = read_sheet(file, data, wanted)
        source = Source(file, "", "", warnings, sheet)
        if sheet.others and not wanted:
            others = ", ".join(map(quote, sheet.others))
            warnings.append(f"{file}: read the sheet {quote(sheet.name)}; there are also {others}")
    else:
        text = decoded(file, data, warnings)
        other = "TOML" if file.lower().endswith(".toml") else OTHERS.get(text.lstrip()[:1])
        if other:
            raise DataError(f"{file}: this is {other}: expected a table, as CSV or a workbook")
        source = Source(file, text, delimiter(text), warnings)
    first = list(islice(source.everything(), LOOKED_AT))
    if not first:
        raise DataError(f"{file}: the file is empty{source.of_sheet}: expected a header and rows")
    width = max(len(cells) for _, cells in first)
    if width > MOST_COLUMNS:
        raise DataError(f"{file}: {width} columns: expected at most {MOST_COLUMNS}")
    _find_header(source, first, dimensions, texts)
    return source


def _find_header(
    source: Source,
    records: list[tuple[int, list[str]]],
    dimensions: Mapping[str, str],
    texts: Sequence[str] | None,
) -> None:
    """Find the header below a title, the units below the header, and what is off in its width."""
    candidates = [[heading(cell) for cell in cells] for _, cells in records]
    if texts is not None:
        scores = [likeness(row, dimensions, texts) for row in candidates]
        source.above = scores.index(max(scores)) if max(scores) > 1 else 0
    source.headings = candidates[source.above]
    line, _ = records[source.above]
    if source.above:
        source.warnings.append(
            f"{source.file}: the header is in line {line}; what stands above it is not read"
        )
    below = records[source.above + 1 :]
    if below and _are_units(source.headings, below, dimensions, texts):
        source.units_below = True
        _take_units(source, *below[0], dimensions)
        below = below[1:]
    width = len(source.headings)
    longer = [len(cells) == width + 1 and bool(cells[-1].strip()) for _, cells in below]
    if below and all(longer) and not any(_is_number(cells[0]) for _, cells in below):
        source.headings.insert(0, heading(""))
        source.unnamed_first = True


def _are_units(
    headings: Sequence[Heading],
    below: list[tuple[int, list[str]]],
    dimensions: Mapping[str, str],
    texts: Sequence[str] | None,
) -> bool:
    """Whether the row below the header holds units: no number in it, a unit where numbers are expected."""
    (_, cells), rest = below[0], below[1:]
    if any(map(_is_number, cells)):
        return False
    units = [k for k, cell in enumerate(cells[: len(headings)]) if is_unit(cell)]
    if texts is not None and any(likeness([headings[k]], dimensions, ()) for k in units):
        return True
    filled = [k for k, cell in enumerate(cells) if cell.strip(" -[]()")]
    if not (rest and units) or units != filled:
        return False
    if texts is None:
        return all(_is_number(rest[0][1][k]) for k in units)
    # a header over two columns names one of them, and its words may be foreign
    numbers = [cell for k in units for cell in rest[0][1][k : k + 1] if cell.strip()]
    return len(units) > 1 and bool(numbers) and all(map(_is_number, numbers))


def _take_units(source: Source, line: int, cells: list[str], dimensions: Mapping[str, str]) -> None:
    for k, (each, cell) in enumerate(zip(source.headings, cells, strict=False)):
        try:
            source.headings[k] = each.with_unit(cell, dimensions)
        except ValueError as error:
            value, expected = quote(cell.strip()), f"'{error}', the unit in its header {quote(each.written)}"
            if source.sheet is not None:
                raise source.sheet.error((line - 1, k), value, expected) from None
            raise DataError(
                f"{source.file}: row of units (line {line}), column {each.written}: "
                f"found {value}, expected {expected}"
            ) from None


def _some(names: Sequence[str]) -> str:
    """List a few names, and how many more there are."""
    few = ", ".join(names[:SHOWN])
    return f"{few} and {len(names) - SHOWN} more" if len(names) > SHOWN else few


def _is_comment(cells: Sequence[str], width: int) -> bool:
    """Whether a row of a table of several columns is a comment: # and words, in one cell or a number of cells of its own.

    >>> [_is_comment(cells, 3) for cells in (["# end", "", ""], ["# by Ann", " at noon"], ["#A", "5", "7"], ["#1", "", ""])]
    [True, True, False, False]
    """
    marked = width > 1 and bool(cells) and bool(_COMMENT.match(cells[0]))
    return marked and (len(cells) != width or not any(cell.strip() for cell in cells[1:]))


def _is_number(cell: str) -> bool:
    return is_number(cell.replace(",", "."))


# -- bytes as text, whatever program wrote them ---------------------------------------------------------


def decoded(file: str, data: bytes, warnings: list[str]) -> str:
    """Return the text of UTF-8, UTF-16 or Windows-1252."""
    codec = "utf-8-sig"
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        codec = "utf-16"
    elif b"\0" in data[:200] and len(data) % 2 == 0:
        # without a byte order mark: ASCII in UTF-16 has its zeros on one side
        codec = "utf-16-le" if not any(data[1:200:2]) else "utf-16-be" if not any(data[:200:2]) else codec
    try:
        text = data.decode(codec)
    except UnicodeDecodeError:
        try:
            text = data.decode("cp1252")
        except UnicodeDecodeError:
            raise DataError(f"{file}: this is not text: expected CSV in UTF-8") from None
        codec = "cp1252"
    raw = text.encode()
    if len(raw.translate(None, _CONTROLS)) != len(raw):
        raise DataError(f"{file}: this is not text (control characters): expected CSV in UTF-8")
    if codec != "utf-8-sig":
        warnings.append(
            f"{file}: read as {'Windows-1252 (Latin-1)' if codec == 'cp1252' else 'UTF-16'}, for it is not UTF-8"
        )
    return text


def delimiter(text: str) -> str:
    r"""Return the mark that parts the most of the first lines into equally many cells.

    A comma in the numbers of a single column, or before the unit in its header, parts nothing.

    >>> delimiter("mass_g,angle_deg\n1,5"), delimiter("mass_g\n1,5"), delimiter("mass, g\n1.5")
    (',', ';', ';')
    """
    lines = (match.group() for match in LINE.finditer(text))
    first = list(islice((_QUOTED.sub("", line) for line in lines if line.strip()), LOOKED_AT))

    def alike(mark: str) -> int:
        counts = Counter(line.count(mark) for line in first if mark in line)
        return max(counts.values(), default=0)

    marks = [mark for mark in "\t;|," if alike(mark)]
    return ";" if marks == [","] and _is_one_column(first) else max(marks, key=alike, default=";")


def _is_one_column(lines: Sequence[str]) -> bool:
    """Whether lines with commas are a single column: a header, perhaps a row of units, then numbers."""
    above = list(takewhile(lambda line: not _is_number(line), lines))
    numbers = lines[len(above) :]
    commas = [line for line in above if "," in line]
    only_units = all(heading(line).unit for line in commas) and not any("," in line for line in numbers)
    return bool(above and numbers) and all(map(_is_number, numbers)) and (not commas or only_units)


def without_dashes(cells: Iterable[str]) -> list[str]:
    """Return cells as they are, but those blank in which a dash alone stands.

    >>> without_dashes(["-", "-3", "a"])
    ['', '-3', 'a']
    """
    return ["" if cell.strip() in DASHES else cell for cell in cells]
