"""Spreadsheets: the cells of one sheet as the texts that a CSV file would have, and the cells that hold no value."""

from __future__ import annotations

import io
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from datetime import date, time, timedelta
from itertools import product
from typing import Any
from xml.etree import ElementTree
from xml.parsers.expat import ExpatError

from dalembert.errors import DataError, quote
from dalembert.tables import old_workbooks
from dalembert.tables.files import ZIP
from dalembert.tables.reach import (
    MAIN,
    OFFICE,
    TABLE,
    Place,
    address,
    check_file,
    check_sheet,
    part_of,
    place_of,
)

Faults = dict[Place, tuple[str, str]]
"""Cells that have no value of their own: what was found, and what was expected."""
PERCENT = ("9", "10")  # number formats that every workbook has
# what reading a part of a damaged archive raises
DAMAGED = (
    *(EOFError, LookupError, OSError, RuntimeError, StopIteration, ValueError, struct.error),
    *(zipfile.BadZipFile, zlib.error, ElementTree.ParseError, ExpatError),
)


@dataclass(frozen=True)
class Unseen:
    """Cells that a person sees in another way than they are read."""

    rows: frozenset[int] = frozenset()
    """The hidden ones, from 0."""
    columns: frozenset[int] = frozenset()
    percent: frozenset[Place] = frozenset()
    """Numbers that are shown as percentages: 50 % is 0.5."""


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
    with suppress(*DAMAGED):
        # what is damaged calamine names itself
        check_file(file, data)
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
            with suppress(*DAMAGED):
                check_sheet(file, data, name)
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
    rows = _texts(cells)
    for (top, left), (bottom, right) in merged:
        span = f"{address((top, left))}:{address((bottom, right))}"
        # those that reach beyond the cells hide nothing there
        for row in range(top, min(bottom + 1, len(rows))):
            for column in range(left, min(right + 1, len(rows[row]))):
                faults[row, column] = (f"merged cells {span}", "a value in each cell")
    return Sheet(file, name, [each for each in names if each != name], rows, faults, unseen)


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
    except DAMAGED:
        return {}, Unseen()


def _in_office_open(archive: zipfile.ZipFile, name: str) -> tuple[Faults, Unseen]:
    text = part_of(archive, name)
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
    columns = {
        k
        for left, wide, one in _repeated(sheet.iter(f"{TABLE}table-column"), "columns")
        if _hidden(one)
        for k in range(left, left + wide)
    }
    rows, percent = set(), set()
    for top, high, line in _repeated(sheet.iter(f"{TABLE}table-row"), "rows"):
        if _hidden(line):
            rows |= set(range(top, top + high))
        for left, wide, cell in _repeated(line, "columns"):
            formula, kind = cell.get(f"{TABLE}formula"), cell.get(f"{OFFICE}value-type")
            right, down = (int(cell.get(f"{TABLE}number-{k}-spanned", "1")) for k in ("columns", "rows"))
            places = product(range(top, top + high), range(left, left + wide))
            if right * down > 1:
                span = f"{address((top, left))}:{address((top + down - 1, left + right - 1))}"
                faults |= dict.fromkeys(places, (f"merged cells {span}", "a value in each cell"))
            elif formula is not None and kind is None:
                faults |= dict.fromkeys(places, _fault(formula.partition("=")[2], ""))
            elif kind == "percentage":
                percent |= set(places)
    return faults, Unseen(frozenset(rows), frozenset(columns), frozenset(percent))


def _hidden(element: ElementTree.Element) -> bool:
    return element.get(f"{TABLE}visibility", "visible") != "visible"


def _repeated(
    elements: Iterator[ElementTree.Element] | ElementTree.Element, of: str
) -> Iterator[tuple[int, int, ElementTree.Element]]:
    """Yield rows or cells, each with its first number and how many there are; of many, as of blank space, the first ones."""
    at = 0
    for element in elements:
        times = int(element.get(f"{TABLE}number-{of}-repeated", "1"))
        yield at, min(times, 1000), element
        at += times
