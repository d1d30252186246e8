"""Spreadsheets: the cells of one sheet as the texts that a CSV file would have, and the cells that hold no value."""

from __future__ import annotations

import io
import os
import re
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import date, time, timedelta
from pathlib import PurePosixPath
from typing import Any
from xml.etree import ElementTree

from dalembert.errors import DataError, quote
from dalembert.tables import old_workbooks
from dalembert.tables.files import ZIP

Place = tuple[int, int]
"""Row and column, from 0."""
Faults = dict[Place, tuple[str, str]]
"""Cells that have no value of their own: what was found, and what was expected."""
MAIN = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
LINK = "{http://schemas.openxmlformats.org/officeDocument/2006/relationships}id"
TABLE = "{urn:oasis:names:tc:opendocument:xmlns:table:1.0}"
OFFICE = "{urn:oasis:names:tc:opendocument:xmlns:office:1.0}"
PERCENT = ("9", "10")  # number formats that every workbook has
# of a sheet, blank ones too: calamine reserves memory for all
MOST_CELLS = 50_000_000
# what reading a part of a damaged archive raises
DAMAGED = (EOFError, KeyError, OSError, RuntimeError, ValueError, zipfile.BadZipFile, zlib.error)


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
    faults: Faults = field(default_factory=dict)
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
    if data[:4] != ZIP and not old_workbooks.is_within_bounds(data):
        raise DataError(f"{file}: broken workbook (its cells lie beyond its bounds): expected .xls")
    try:
        with _panics():
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
            _check_reach(file, data, name)
            sheet = book.get_sheet_by_name(name)
            cells = sheet.to_python(skip_empty_area=False)
            merged = sheet.merged_cell_ranges or []
    except calamine.PasswordError:
        raise locked from None
    except (calamine.CalamineError, OSError, ValueError) as error:
        if _is_locked(data):
            raise locked from None
        raise DataError(f"{file}: broken workbook ({error}): expected .xlsx, .xls or .ods") from None
    faults, unseen = _looks(data, name)
    for (top, left), (bottom, right) in merged:
        span = f"{address((top, left))}:{address((bottom, right))}"
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                faults[row, column] = (f"merged cells {span}", "a value in each cell")
    return Sheet(file, name, [each for each in names if each != name], _texts(cells), faults, unseen)


@contextmanager
def _panics() -> Iterator[None]:
    """Raise ValueError where calamine panics over a damaged file, and discard the trace that it prints itself."""
    with ExitStack() as stack:
        # a process may have no standard error
        with suppress(OSError):
            kept, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
            stack.callback(os.close, nothing)
            stack.callback(os.close, kept)
            stack.callback(os.dup2, kept, 2)
            os.dup2(nothing, 2)
        try:
            yield
        except BaseException as error:
            # pyo3 derives it from BaseException and has no name to import it by
            if type(error).__name__ == "PanicException":
                raise ValueError(error) from None
            raise


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


# -- what calamine does not read: encryption, formulas without a stored value, errors, what is hidden, percentages -----


def _is_locked(data: bytes) -> bool:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return b"encryption-data" in archive.read("META-INF/manifest.xml")
    except DAMAGED:
        return False


def _fault(formula: str, error: str) -> tuple[str, str]:
    if error:
        return quote(error), "a value, not an error"
    return (
        f"the formula {quote('=' + formula)} without a stored value",
        "a value: open the workbook in a spreadsheet program and save it",
    )


def _check_reach(file: str, data: bytes, name: str) -> None:
    """Refuse an Office Open sheet that reaches so far that the cells in between do not fit into memory."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            text = _part_of(archive, name)
    except (*DAMAGED, StopIteration, ElementTree.ParseError):
        return
    last = max(set(re.findall(rb'\br="([A-Z]{1,3})\d', text)), key=lambda one: (len(one), one), default=b"A")
    row = re.match(rb'<row [^>]*\br="(\d{1,7})"', text[max(text.rfind(b"<row "), 0) :])
    corner = f"{last.decode()}{'1' if row is None else row[1].decode()}"
    rows, columns = (k + 1 for k in place_of(corner) or (0, 0))
    if rows * columns > MOST_CELLS:
        raise DataError(
            f"{file}: sheet {quote(name)}: its cells reach to {corner}: expected at most {MOST_CELLS} cells: delete the stray ones"
        )


def _looks(data: bytes, name: str) -> tuple[Faults, Unseen]:
    """Find the cells of a sheet without a value of their own, hidden rows and columns, percentages.

    Nothing in a file that holds them otherwise: calamine has read the cells.
    """
    if data[:4] != ZIP:
        return {}, Unseen(*old_workbooks.looks(data, name))
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if "content.xml" in archive.namelist():
                return _in_open_document(archive.read("content.xml"), name)
            return _in_office_open(archive, name)
    except (*DAMAGED, StopIteration, ElementTree.ParseError):
        return {}, Unseen()


def _part_of(archive: zipfile.ZipFile, name: str) -> bytes:
    """Return the part of an Office Open workbook that holds the sheet of this name."""
    book = ElementTree.fromstring(archive.read("xl/workbook.xml"))
    link = next(each.get(LINK) for each in book.iter(f"{MAIN}sheet") if each.get("name") == name)
    targets = ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels"))
    target = next(each.get("Target", "") for each in targets if each.get("Id") == link)
    return archive.read(target.lstrip("/") if target.startswith("/") else str(PurePosixPath("xl") / target))


def _in_office_open(archive: zipfile.ZipFile, name: str) -> tuple[Faults, Unseen]:
    text = _part_of(archive, name)
    styles = _percent_styles(archive) if b' s="' in text else frozenset()
    faults: Faults = {}
    rows, columns, percent = set(), set(), set()
    if not styles and not any(mark in text for mark in (b"<f", b't="e"', b"hidden")):
        return faults, Unseen()
    for _, each in ElementTree.iterparse(io.BytesIO(text)):
        if each.tag == f"{MAIN}col" and each.get("hidden") in ("1", "true"):
            columns |= set(range(int(each.get("min", "1")) - 1, min(int(each.get("max", "1")), 16384)))
        elif each.tag == f"{MAIN}c" and (place := place_of(each.get("r", ""))) is not None:
            formula, value = (each.findtext(f"{MAIN}{tag}") for tag in "fv")
            if each.get("t") == "e":
                faults[place] = _fault("", value or "an error")
            elif formula is not None and not value:
                faults[place] = _fault(formula, "")
            elif value is not None and each.get("t", "n") == "n" and each.get("s") in styles:
                percent.add(place)
        elif each.tag == f"{MAIN}row":
            if each.get("hidden") in ("1", "true"):
                rows.add(int(each.get("r", "1")) - 1)
            each.clear()
    return faults, Unseen(frozenset(rows), frozenset(columns), frozenset(percent))


def _percent_styles(archive: zipfile.ZipFile) -> frozenset[str]:
    """Return the numbers of the cell styles that show percentages."""
    styles = ElementTree.fromstring(archive.read("xl/styles.xml"))
    formats = {
        each.get("numFmtId") for each in styles.iter(f"{MAIN}numFmt") if "%" in each.get("formatCode", "")
    }
    shown = styles.find(f"{MAIN}cellXfs")
    every = () if shown is None else shown
    return frozenset(str(k) for k, one in enumerate(every) if one.get("numFmtId") in {*PERCENT, *formats})


def _in_open_document(text: bytes, name: str) -> tuple[Faults, Unseen]:
    faults: Faults = {}
    if not any(mark in text for mark in (b"formula", b"spanned", b"visibility", b"percentage")):
        return faults, Unseen()
    tables = ElementTree.fromstring(text).iter(f"{TABLE}table")
    sheet = next(each for each in tables if each.get(f"{TABLE}name") == name)
    columns = {k for k, one in _repeated(sheet.iter(f"{TABLE}table-column"), "columns") if _hidden(one)}
    rows, percent = set(), set()
    for row, line in _repeated(sheet.iter(f"{TABLE}table-row"), "rows"):
        if _hidden(line):
            rows.add(row)
        for column, cell in _repeated(line, "columns"):
            formula, kind = cell.get(f"{TABLE}formula"), cell.get(f"{OFFICE}value-type")
            wide, high = (int(cell.get(f"{TABLE}number-{k}-spanned", "1")) for k in ("columns", "rows"))
            if wide * high > 1:
                span = f"{address((row, column))}:{address((row + high - 1, column + wide - 1))}"
                faults[row, column] = (f"merged cells {span}", "a value in each cell")
            elif formula is not None and kind is None:
                faults[row, column] = _fault(formula.partition("=")[2], "")
            elif kind == "percentage":
                percent.add((row, column))
    return faults, Unseen(frozenset(rows), frozenset(columns), frozenset(percent))


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
