"""Small files of large tables: stray cells, repeated values, lines of delimiters, archives that unpack to gigabytes."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from struct import pack

import openpyxl
import pytest

from dalembert.errors import DataError
from dalembert.tables import reach
from dalembert.tables.sources import source_of
from dalembert.tables.workbooks import read_sheet

HERE = Path(__file__).parent / "workbooks"
SHEET = "xl/worksheets/sheet1.xml"
VALUE = '<table:table-cell office:value-type="float" office:value="5"{}/>'
ROW = "<table:table-row{}>{}</table:table-row>"
BLANK = "<table:table-cell{}/>"


def rewritten(data: bytes, change: Callable[[str], str], part: str) -> bytes:
    """Return a workbook with one part changed."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            text = old.read(name)
            new.writestr(name, change(text.decode()) if name == part else text)
    return out.getvalue()


def open_document(rows: str) -> bytes:
    """Return a sheet of three rows and three columns with further rows below."""
    return rewritten(
        (HERE / "masses.ods").read_bytes(),
        lambda text: text.replace("</table:table>", rows + "</table:table>"),
        "content.xml",
    )


def office_open(cell: str = "C3", change: Callable[[str], str] = str) -> bytes:
    """Return a sheet of three rows and three columns with a further cell."""
    book, out = openpyxl.Workbook(), io.BytesIO()
    for row in (("mass [g]", "radius (mm)", "Angle, °"), (90.5, 30, 60), (60, 50.25, 210)):
        book.active.append(row)
    book.active[cell] = 1
    book.save(out)
    return rewritten(out.getvalue(), change, SHEET)


def many(of: str, times: int) -> str:
    """Return the attribute of what stands repeated."""
    return f' table:number-{of}-repeated="{times}"'


@pytest.mark.parametrize("times", [1_048_573, 4_000_000_000])
def test_blank_rows_at_the_end_cost_nothing(times: int) -> None:
    below = ROW.format(many("rows", times), BLANK.format(many("columns", times)))
    assert len(read_sheet("file", open_document(below), "").rows) == 3


REACHING = {
    "a value repeated down": (ROW.format(many("rows", 1_048_570), 3 * VALUE.format("")), "C1048573", 12),
    "a value repeated to the right": (
        ROW.format("", VALUE.format(many("columns", 4_000_000))),
        "HSODD4",
        10,
    ),
    "a row behind blank ones": (
        ROW.format(many("rows", 1_048_570), BLANK.format("")) + ROW.format("", VALUE.format("")),
        "C1048574",
        10,
    ),
}


@pytest.mark.parametrize("case", REACHING)
def test_a_sheet_that_reaches_far_is_refused_with_its_last_cell(case: str) -> None:
    rows, corner, held = REACHING[case]
    message = f"file: sheet 'Massen': {held} cells reach as far as {corner}: delete stray and repeated cells"
    with pytest.raises(DataError, match=f"^{re.escape(message)}$"):
        read_sheet("file", open_document(rows), "")


@pytest.mark.parametrize("cell", ["A1048576", "AU1048576", "XFD1048576"])
def test_a_stray_cell_far_below_is_refused(cell: str) -> None:
    corner = cell if cell != "A1048576" else "C1048576"
    with pytest.raises(DataError, match=f"sheet 'Sheet': 10 cells reach as far as {corner}"):
        read_sheet("file", office_open(cell), "")


def test_a_stray_cell_far_to_the_right_is_read() -> None:
    assert len(read_sheet("file", office_open("XFD3"), "").rows[0]) == 16384


def test_a_false_dimension_costs_nothing() -> None:
    data = office_open(
        change=lambda text: re.sub('dimension ref="[^"]*"', 'dimension ref="A1:XFD1048576"', text)
    )
    assert len(read_sheet("file", data, "").rows) == 3


def test_merged_cells_beyond_the_others_cost_nothing() -> None:
    merge = '</sheetData><mergeCells count="1"><mergeCell ref="C3:XFD1048576"/></mergeCells>'
    sheet = read_sheet("file", office_open(change=lambda text: text.replace("</sheetData>", merge)), "")
    assert list(sheet.faults) == [(2, 2)]


@pytest.mark.parametrize("row", ["4000000000", "99999999999"])
def test_a_row_beyond_the_last_is_refused(row: str) -> None:
    """The reader of workbooks would end the process."""
    data = office_open(change=lambda text: re.sub(r' r="[A-Z]+\d+"', "", text).replace('r="3"', f'r="{row}"'))
    with pytest.raises(DataError, match="its cells lie beyond its bounds"):
        read_sheet("file", data, "")


def test_a_stray_cell_of_an_old_workbook_is_refused() -> None:
    """[MS-XLS] 2.4.175, MulRk: row, first column, formats and values, last column."""
    data = (HERE / "masses.xls").read_bytes()
    at = data.index(pack("<HHHH", 0xBD, 24, 2, 0))
    assert len(read_sheet("file", data, "").rows) == 3
    far = pack("<HH", 0xFFFF, 0xFD) + data[at + 8 : at + 26] + pack("<H", 0xFF)
    with pytest.raises(DataError, match="9 cells reach as far as IV65536"):
        read_sheet("file", data[: at + 4] + far + data[at + 28 :], "")


@pytest.mark.parametrize("kind", ["xlsx", "ods"])
def test_an_archive_that_unpacks_to_too_much_is_refused(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reach, "LARGEST", 100_000)
    space = " " * 100_000
    data = (
        office_open(change=lambda text: text.replace("</sheetData>", space + "</sheetData>"))
        if kind == "xlsx"
        else open_document(space)
    )
    assert len(data) < 10_000
    with pytest.raises(DataError, match=r"it unpacks to 1[01]\d{4} bytes: expected at most 100000"):
        read_sheet("file", data, "")


def test_a_line_of_delimiters_is_refused() -> None:
    with pytest.raises(DataError, match=r"^f: 20001 columns: expected at most 16384$"):
        source_of("f", b"a" + b"," * 20_000 + b"\n1\n", {}, None)
