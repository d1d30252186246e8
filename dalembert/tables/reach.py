"""Where the cells of a sheet are, how far they reach, and how large their file is unpacked: looked at before a reader reserves memory.

A stray cell in the last corner, or a value that stands repeated a million times, makes a sheet of millions of cells out of
a file of a few kilobytes.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import PurePosixPath
from xml.etree import ElementTree
from xml.parsers import expat

from dalembert.errors import DataError, quote
from dalembert.tables import old_workbooks
from dalembert.tables.files import ZIP

Place = tuple[int, int]
"""Row and column, from 0."""
MAIN = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
LINK = "{http://schemas.openxmlformats.org/officeDocument/2006/relationships}id"
TABLE = "{urn:oasis:names:tc:opendocument:xmlns:table:1.0}"
OFFICE = "{urn:oasis:names:tc:opendocument:xmlns:office:1.0}"
# bytes of a workbook's XML
LARGEST = 500_000_000
# a sheet may reach over so many cells, and over so many more for each one that it holds
ROOM, EACH = 1_000_000, 20
MOST_CELLS = 20_000_000
# what an Office Open sheet names beyond the last row and column, for which memory cannot be reserved
BEYOND = re.compile(rb'\br="(?:[A-Z]{4,}\d*|[A-Z]*\d{8,})"')


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


def part_of(archive: zipfile.ZipFile, name: str) -> bytes:
    """Return the part of an Office Open workbook that holds the sheet of this name."""
    book = ElementTree.fromstring(archive.read("xl/workbook.xml"))
    link = next(each.get(LINK) for each in book.iter(f"{MAIN}sheet") if each.get("name") == name)
    targets = ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels"))
    target = next(each.get("Target", "") for each in targets if each.get("Id") == link)
    return archive.read(target.lstrip("/") if target.startswith("/") else str(PurePosixPath("xl") / target))


@dataclass
class Reach:
    """A sheet, the number of cells that it holds, and the number of rows and columns over which they reach."""

    sheet: str = ""
    held: int = 0
    rows: int = 0
    columns: int = 0

    def hold(self, rows: int, columns: int) -> None:
        """Count a cell, and the rows and columns up to it."""
        self.held += 1
        self.rows, self.columns = max(self.rows, rows), max(self.columns, columns)

    def check(self, file: str) -> None:
        """Refuse a sheet that reaches so far that the cells in between do not fit into memory."""
        cells = self.rows * self.columns
        if cells <= min(MOST_CELLS, ROOM + EACH * self.held):
            return
        corner, of = (
            address((self.rows - 1, self.columns - 1)),
            f" sheet {quote(self.sheet)}:" * bool(self.sheet),
        )
        if EACH * self.held >= cells:
            raise DataError(f"{file}:{of} {cells} cells: expected at most {MOST_CELLS}: save it as CSV")
        raise DataError(
            f"{file}:{of} {self.held} cells reach as far as {corner}: delete stray and repeated cells"
        )


def check_file(file: str, data: bytes) -> None:
    """Refuse a workbook that unpacks to too much, and one that is read as a whole and reaches too far.

    Raises
    ------
    zipfile.BadZipFile, expat.ExpatError
        It is damaged.
    """
    if data[:4] != ZIP:
        for held, rows, columns in old_workbooks.reaches(data):
            Reach("", held, rows, columns).check(file)
        return
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        size = sum(each.file_size for each in archive.infolist() if each.filename.endswith((".xml", ".rels")))
        if size > LARGEST:
            raise DataError(f"{file}: it unpacks to {size} bytes: expected at most {LARGEST}: save it as CSV")
        if "content.xml" in archive.namelist():
            for each in _of_open_document(archive.read("content.xml")):
                each.check(file)


def check_sheet(file: str, data: bytes, name: str) -> None:
    """Refuse an Office Open sheet that reaches too far."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        text = part_of(archive, name)
    if BEYOND.search(text):
        raise DataError(f"{file}: broken workbook (its cells lie beyond its bounds): expected .xlsx")
    columns = {match[1] for match in re.finditer(rb'\br="([A-Z]{1,3})\d', text)}
    last = max(columns, key=lambda one: (len(one), one), default=b"A").decode()
    row = re.match(rb'<(?:\w+:)?row [^>]*\br="(\d+)"', text[max(text.rfind(b"row ") - 1, 0) :])
    place = place_of(f"{last}{'1' if row is None else row[1].decode()}")
    assert place is not None
    held = len(re.findall(rb"[<:]c[ >/]", text))
    Reach(name, held, place[0] + 1, place[1] + 1).check(file)


def _of_open_document(text: bytes) -> Iterator[Reach]:
    """Yield the reach of every sheet of an Open Document spreadsheet; what stands repeated is held once."""
    sheets: list[Reach] = []
    at = {"rows": 0, "columns": 0}
    high = 1

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal high
        if tag == f"{TABLE[1:]}table":
            sheets.append(Reach(attributes.get(f"{TABLE[1:]}name", "")))
            at["rows"] = 0
        elif tag == f"{TABLE[1:]}table-row":
            high = _times(attributes, "rows")
            at["rows"] += high
            at["columns"] = 0
        elif tag in (f"{TABLE[1:]}table-cell", f"{TABLE[1:]}covered-table-cell"):
            at["columns"] += _times(attributes, "columns")
            if {f"{OFFICE[1:]}value-type", f"{TABLE[1:]}formula"} & attributes.keys() and sheets:
                sheets[-1].hold(at["rows"], at["columns"])

    parser = expat.ParserCreate(namespace_separator="}")
    parser.StartElementHandler = start
    parser.Parse(text, True)
    yield from sheets


def _times(attributes: dict[str, str], of: str) -> int:
    return int(attributes.get(f"{TABLE[1:]}number-{of}-repeated", "1"))
