"""Spreadsheets: the cells of one sheet as the texts that a CSV file would have, and the cells that hold no value."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import date, time, timedelta
from pathlib import PurePosixPath
from typing import Any
from xml.etree import ElementTree

from cli.errors import DataError, quote
from cli.read.files import ZIP

_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+\s*")

Place = tuple[int, int]
"""Row and column, from 0."""


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

    def error(self, place: Place, found: str, expected: str) -> DataError:
        """Make the one line for a cell."""
        return DataError(
            f"{self.file}: sheet {quote(self.name)}, cell {address(place)}: found {found}, expected {expected}"
        )


def address(place: Place) -> str:
    """Return a cell's name: `C5`."""
    row, column = place
    letters = ""
    while column >= 0:
        letters = chr(ord("A") + column % 26) + letters
        column = column // 26 - 1
    return f"{letters}{row + 1}"


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
    return Sheet(file, name, [each for each in names if each != name], _texts(cells), faults)


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

_MAIN = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
_LINK = "{http://schemas.openxmlformats.org/officeDocument/2006/relationships}id"
_TABLE = "{urn:oasis:names:tc:opendocument:xmlns:table:1.0}"
_OFFICE = "{urn:oasis:names:tc:opendocument:xmlns:office:1.0}"


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
                yield from _open_document(archive.read("content.xml"), name)
            else:
                yield from _office_open(archive, name)
        except (KeyError, ElementTree.ParseError):
            # calamine has read the cells: no more can be said
            return


def _fault(formula: str, error: str) -> tuple[str, str]:
    if error:
        return quote(error), "a value, not an error"
    return (
        f"the formula {quote('=' + formula)} without a stored value",
        "a value: open the workbook in a spreadsheet program and save it",
    )


def _office_open(archive: zipfile.ZipFile, name: str) -> Iterator[tuple[Place, tuple[str, str]]]:
    book = ElementTree.fromstring(archive.read("xl/workbook.xml"))
    link = next(each.get(_LINK) for each in book.iter(f"{_MAIN}sheet") if each.get("name") == name)
    targets = ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels"))
    target = next(each.get("Target", "") for each in targets if each.get("Id") == link)
    path = target.lstrip("/") if target.startswith("/") else str(PurePosixPath("xl") / target)
    text = archive.read(path)
    if b"<f" not in text and b't="e"' not in text:
        return
    for _, cell in ElementTree.iterparse(io.BytesIO(text)):
        if cell.tag != f"{_MAIN}c":
            continue
        formula, value = cell.find(f"{_MAIN}f"), cell.find(f"{_MAIN}v")
        place = _place(cell.get("r", ""))
        if place is not None and cell.get("t") == "e":
            yield place, _fault("", (value.text if value is not None else "") or "an error")
        elif place is not None and formula is not None and (value is None or value.text is None):
            yield place, _fault(formula.text or "", "")
        cell.clear()


def _place(written: str) -> Place | None:
    found = re.fullmatch(r"([A-Z]+)(\d+)", written)
    if found is None:
        return None
    column = 0
    for letter in found.group(1):
        column = 26 * column + ord(letter) - ord("A") + 1
    return int(found.group(2)) - 1, column - 1


def _open_document(text: bytes, name: str) -> Iterator[tuple[Place, tuple[str, str]]]:
    if b"formula" not in text and b"spanned" not in text:
        return
    tables = ElementTree.fromstring(text).iter(f"{_TABLE}table")
    sheet = next(each for each in tables if each.get(f"{_TABLE}name") == name)
    row = 0
    for line in sheet.iter(f"{_TABLE}table-row"):
        column = 0
        for cell in line:
            formula = cell.get(f"{_TABLE}formula")
            wide, high = (int(cell.get(f"{_TABLE}number-{k}-spanned", "1")) for k in ("columns", "rows"))
            if wide * high > 1:
                span = f"{address((row, column))}:{address((row + high - 1, column + wide - 1))}"
                yield (row, column), (f"merged cells {span}", "a value in each cell")
            elif formula is not None and cell.get(f"{_OFFICE}value-type") is None:
                yield (row, column), _fault(formula.partition("=")[2], "")
            column += int(cell.get(f"{_TABLE}number-columns-repeated", "1"))
        row += int(line.get(f"{_TABLE}number-rows-repeated", "1"))
