"""The tables beside a description: forces and laws of motion as CSV."""

from __future__ import annotations

import csv
import io
import re


def rows(data: bytes) -> list[dict[str, str]]:
    """Return the rows of a table: commas, semicolons or tabs between the cells; UTF-8, UTF-16 or Latin-1.

    Where the cells are not told apart by commas, a comma is a decimal one, and then no cell has a decimal point.

    Raises
    ------
    ValueError, csv.Error
        No such table.

    Examples
    --------
    >>> rows(b"angle_deg;fx_N\\n0;-1,5\\n90;2\\n")
    [{'angle_deg': '0', 'fx_N': '-1.5'}, {'angle_deg': '90', 'fx_N': '2'}]
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252")
    header = re.search(r"\S.*", text)
    mark = max(",;\t", key=lambda m: (header.group().count(m) if header else 0, m == ","))
    found = list(csv.DictReader(io.StringIO(text, newline=""), delimiter=mark, skipinitialspace=True))
    cells = (cell for row in found for cell in row.values() if isinstance(cell, str))
    if mark == "," or not any("," in cell for cell in cells):
        return found
    # 2.500 beside 1,5 may be 2500: it is made no number, and refused
    return [
        {key: _decimal(cell) if isinstance(cell, str) else cell for key, cell in row.items()} for row in found
    ]


def _decimal(cell: str) -> str:
    return cell.replace(".", "'").replace(",", ".")
