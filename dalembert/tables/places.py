"""Where a cell of a workbook is: its name, and the part of the file that holds its sheet."""

from __future__ import annotations

import re
import zipfile
from pathlib import PurePosixPath
from xml.etree import ElementTree

Place = tuple[int, int]
"""Row and column, from 0."""
MAIN = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
LINK = "{http://schemas.openxmlformats.org/officeDocument/2006/relationships}id"
TABLE = "{urn:oasis:names:tc:opendocument:xmlns:table:1.0}"
OFFICE = "{urn:oasis:names:tc:opendocument:xmlns:office:1.0}"


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
