"""Spreadsheets: the cells of one sheet as the texts that a CSV file would have, and the cells that hold no value."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import date, time, timedelta
from pathlib import PurePosixPath
from typing import Any
from xml.etree import ElementTree

from dalembert.errors import DataError, quote
from dalembert.tables.files import ZIP

Place = tuple[int, int]
"""Row and column, from 0."""
MAIN = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
LINK = "{http://schemas.openxmlformats.org/officeDocument/2006/relationships}id"
TABLE = "{urn:oasis:names:tc:opendocument:xmlns:table:1.0}"
OFFICE = "{urn:oasis:names:tc:opendocument:xmlns:office:1.0}"
PERCENT = ("9", "10")  # number formats that every workbook has


@dataclass(frozen=True)
class Unseen:
    """Cells that a person sees in another way than they are read."""

    rows: frozenset[int] = frozenset()
    """The hidden ones, from 0."""
    columns: frozenset[int] = frozenset()
    percent: frozenset[Place] = frozenset()
    """Numbers that are shown as percentages: 50 % is 0.5."""


def address(place: Place) -> str:
    """Return a cell's name: `C5`."""
    return f"{letters(place[1])}{place[0] + 1}"


def letters(column: int) -> str:
    """Return a column's name: `AB` for 27."""
    name = ""
    while column >= 0:
        name = chr(ord("A") + column % 26) + name
        column = column // 26 - 1
    return name


def place_of(written: str) -> Place | None:
    """Return the place of a cell by its name; None where it is none."""
    match = re.fullmatch(r"([A-Z]+)(\d+)", written)
    if match is None:
        return None
    column = 0
    for letter in match.group(1):
        column = 26 * column + ord(letter) - ord("A") + 1
    return int(match.group(2)) - 1, column - 1


_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+\s*")


@dataclass(frozen=True)
class Sheet:
    """A sheet of a workbook."""

    file: str
    name: str
    others: list[str]
    rows: list[list[str]]
    """All as wide as the widest."""
    faults: dict[Place, tuple[str, str]] = field(default_factory=dict)
    """Cells that have no value of their own: what was found, and what was expected."""
    unseen: Unseen = field(default_factory=Unseen)

    def error(self, place: Place, value: str, expected: str) -> DataError:
        """Make the one line for a cell."""
        return DataError(
            f"{self.file}: sheet {quote(self.name)}, cell {address(place)}: found {value}, expected {expected}"
        )


def read_sheet(file: str, data: bytes, wanted: str) -> Sheet:
    """Read a sheet, by its name or the first.

    Raises
    ------
    DataError
        An encrypted or broken workbook; no such sheet; the extra `excel` is not installed.
    """
    try:
        import python_calamine as calamine
    except ImportError:
        raise DataError(
            f"{file}: spreadsheets need python-calamine: install dalembert with its extra, dalembert[excel]"
        ) from None
    locked = DataError(f"{file}: the workbook is encrypted: expected one without a password")
    if "EncryptedPackage".encode("utf-16-le") in data:
        raise locked
    try:
        book = calamine.CalamineWorkbook.from_filelike(io.BytesIO(data))
        names = [
            sheet.name for sheet in book.sheets_metadata if sheet.typ == calamine.SheetTypeEnum.WorkSheet
        ]
        shown = [
            sheet.name
            for sheet in book.sheets_metadata
            if sheet.name in names and sheet.visible == calamine.SheetVisibleEnum.Visible
        ]
        first = next(iter(shown or names), None)
        if first is None:
            raise DataError(f"{file}: no sheet in the workbook: expected a table")
        name = next((each for each in names if each.lower() == wanted.lower()), None) if wanted else first
        if name is None:
            raise DataError(
                f"{file}: no sheet {quote(wanted)}: expected one of {', '.join(map(quote, names))}"
            )
        sheet = book.get_sheet_by_name(name)
        cells = sheet.to_python(skip_empty_area=False)
        merged = sheet.merged_cell_ranges or []
    except calamine.PasswordError:
        raise locked from None
    except (calamine.CalamineError, OSError, ValueError) as error:
        if _is_locked(data):
            raise locked from None
        raise DataError(f"{file}: broken workbook ({error}): expected .xlsx, .xls or .ods") from None
    faults: dict[Place, tuple[str, str]] = {}
    if data[:4] == ZIP:
        faults = dict(_faults(data, name))
    for (top, left), (bottom, right) in merged:
        span = f"{address((top, left))}:{address((bottom, right))}"
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                faults[row, column] = (f"merged cells {span}", "a value in each cell")
    hidden = unseen(data, name)
    return Sheet(file, name, [each for each in names if each != name], _texts(cells), faults, hidden)


def _texts(cells: list[list[Any]]) -> list[list[str]]:
    """Return cells as texts; numbers with the decimal mark that numbers written as text have."""
    strings = (cell for row in cells for cell in row if isinstance(cell, str))
    comma = any(map(_DECIMAL_COMMA.fullmatch, strings))
    rows = [[_text(cell, comma) for cell in row] for row in cells]
    width = max((k + 1 for row in rows for k, cell in enumerate(row) if cell.strip()), default=0)
    return [[*row[:width], *[""] * (width - len(row))] for row in rows]


def _text(cell: str | float | date | time | timedelta, comma: bool) -> str:
    if isinstance(cell, str):
        return cell
    if isinstance(cell, float) and cell.is_integer() and abs(cell) < 2**53:
        return str(int(cell))
    if isinstance(cell, float):
        return repr(cell).replace(".", ",") if comma else repr(cell)
    return str(cell).lower() if isinstance(cell, bool) else str(cell)


# -- what calamine does not tell: encrypted OpenDocument, formulas without a stored value, errors in cells ----------


def _is_locked(data: bytes) -> bool:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return b"encryption-data" in archive.read("META-INF/manifest.xml")
    except (KeyError, OSError, RuntimeError, zipfile.BadZipFile):
        return False


def _faults(data: bytes, name: str) -> Iterator[tuple[Place, tuple[str, str]]]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        try:
            if "content.xml" in archive.namelist():
                yield from _faults_in_open_document(archive.read("content.xml"), name)
            else:
                yield from _faults_in_office_open(archive, name)
        except (KeyError, ElementTree.ParseError):
            # calamine has read the cells: no more is known
            return


def _fault(formula: str, error: str) -> tuple[str, str]:
    if error:
        return quote(error), "a value, not an error"
    return (
        f"the formula {quote('=' + formula)} without a stored value",
        "a value: open the workbook in a spreadsheet program and save it",
    )


def _faults_in_office_open(archive: zipfile.ZipFile, name: str) -> Iterator[tuple[Place, tuple[str, str]]]:
    text = part_of(archive, name)
    if b"<f" not in text and b't="e"' not in text:
        return
    for _, cell in ElementTree.iterparse(io.BytesIO(text)):
        if cell.tag != f"{MAIN}c":
            continue
        formula, value = cell.find(f"{MAIN}f"), cell.find(f"{MAIN}v")
        place = place_of(cell.get("r", ""))
        if place is not None and cell.get("t") == "e":
            yield place, _fault("", (value.text if value is not None else "") or "an error")
        elif place is not None and formula is not None and (value is None or value.text is None):
            yield place, _fault(formula.text or "", "")
        cell.clear()


def _faults_in_open_document(text: bytes, name: str) -> Iterator[tuple[Place, tuple[str, str]]]:
    if b"formula" not in text and b"spanned" not in text:
        return
    tables = ElementTree.fromstring(text).iter(f"{TABLE}table")
    sheet = next(each for each in tables if each.get(f"{TABLE}name") == name)
    row = 0
    for line in sheet.iter(f"{TABLE}table-row"):
        column = 0
        for cell in line:
            formula = cell.get(f"{TABLE}formula")
            wide, high = (int(cell.get(f"{TABLE}number-{k}-spanned", "1")) for k in ("columns", "rows"))
            if wide * high > 1:
                span = f"{address((row, column))}:{address((row + high - 1, column + wide - 1))}"
                yield (row, column), (f"merged cells {span}", "a value in each cell")
            elif formula is not None and cell.get(f"{OFFICE}value-type") is None:
                yield (row, column), _fault(formula.partition("=")[2], "")
            column += int(cell.get(f"{TABLE}number-columns-repeated", "1"))
        row += int(line.get(f"{TABLE}number-rows-repeated", "1"))


# -- where in the file a sheet stands; hidden rows and columns, percentages --------------------------------


def part_of(archive: zipfile.ZipFile, name: str) -> bytes:
    """Return the part of an Office Open workbook that holds the sheet of this name."""
    book = ElementTree.fromstring(archive.read("xl/workbook.xml"))
    link = next(each.get(LINK) for each in book.iter(f"{MAIN}sheet") if each.get("name") == name)
    targets = ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels"))
    target = next(each.get("Target", "") for each in targets if each.get("Id") == link)
    return archive.read(target.lstrip("/") if target.startswith("/") else str(PurePosixPath("xl") / target))


def unseen(data: bytes, name: str) -> Unseen:
    """Find hidden rows and columns and percentages in a sheet; nothing in a file that holds them otherwise."""
    if data[:4] != ZIP:
        from dalembert.tables.old_workbooks import looks

        return Unseen(*looks(data, name))
    with (
        zipfile.ZipFile(io.BytesIO(data)) as archive,
        suppress(KeyError, StopIteration, ElementTree.ParseError),
    ):
        if "content.xml" in archive.namelist():
            return _looks_in_open_document(archive.read("content.xml"), name)
        return _looks_in_office_open(archive, name)
    return Unseen()


def _looks_in_office_open(archive: zipfile.ZipFile, name: str) -> Unseen:
    text = part_of(archive, name)
    styles = _percent_styles(archive) if b' s="' in text else frozenset()
    if b"hidden" not in text and not styles:
        return Unseen()
    rows, columns, percent = set(), set(), set()
    for _, each in ElementTree.iterparse(io.BytesIO(text)):
        if each.tag == f"{MAIN}col" and each.get("hidden") in ("1", "true"):
            columns |= set(range(int(each.get("min", "1")) - 1, min(int(each.get("max", "1")), 16384)))
        elif each.tag == f"{MAIN}c" and each.get("s") in styles and each.get("t", "n") == "n":
            place = place_of(each.get("r", ""))
            if place is not None and each.find(f"{MAIN}v") is not None:
                percent.add(place)
        elif each.tag == f"{MAIN}row":
            if each.get("hidden") in ("1", "true"):
                rows.add(int(each.get("r", "1")) - 1)
            each.clear()
    return Unseen(frozenset(rows), frozenset(columns), frozenset(percent))


def _percent_styles(archive: zipfile.ZipFile) -> frozenset[str]:
    """Return the numbers of the cell styles that show percentages."""
    styles = ElementTree.fromstring(archive.read("xl/styles.xml"))
    formats = {
        each.get("numFmtId") for each in styles.iter(f"{MAIN}numFmt") if "%" in each.get("formatCode", "")
    }
    shown = styles.find(f"{MAIN}cellXfs")
    every = () if shown is None else shown
    return frozenset(str(k) for k, one in enumerate(every) if one.get("numFmtId") in {*PERCENT, *formats})


def _looks_in_open_document(text: bytes, name: str) -> Unseen:
    if b"visibility" not in text and b"percentage" not in text:
        return Unseen()
    tables = ElementTree.fromstring(text).iter(f"{TABLE}table")
    sheet = next(each for each in tables if each.get(f"{TABLE}name") == name)
    columns = {k for k, one in _repeated(sheet.iter(f"{TABLE}table-column"), "columns") if _hidden(one)}
    rows, percent = set(), set()
    for row, line in _repeated(sheet.iter(f"{TABLE}table-row"), "rows"):
        if _hidden(line):
            rows.add(row)
        for column, cell in _repeated(line, "columns"):
            if cell.get(f"{OFFICE}value-type") == "percentage":
                percent.add((row, column))
    return Unseen(frozenset(rows), frozenset(columns), frozenset(percent))


def _hidden(element: ElementTree.Element) -> bool:
    return element.get(f"{TABLE}visibility", "visible") != "visible"


def _repeated(
    elements: Iterator[ElementTree.Element] | ElementTree.Element, of: str
) -> Iterator[tuple[int, ElementTree.Element]]:
    """Yield rows or cells with their numbers; of what stands many times over, as blank space does, the first ones."""
    at = 0
    for element in elements:
        times = int(element.get(f"{TABLE}number-{of}-repeated", "1"))
        yield from ((at + k, element) for k in range(min(times, 1000)))
        at += times
