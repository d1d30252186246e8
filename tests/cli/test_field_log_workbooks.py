"""Balancing logs kept in workbooks, .xlsx and .ods: each layout gives what the same log gives as text."""

from __future__ import annotations

import json
import subprocess
import zipfile
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import openpyxl
import pytest

from tests.conftest import Dalembert

Rows = Sequence[Sequence[object]]

LAYOUT_1 = """ ;DoubleA;phase;mass;phase
100%n;80;40;0;0
100%U;60;55;0;0
100%n;99,030381;43,960790;10;-90
100%U;84,932821;53,529955;10;-90
100%n;127,164307;61,188851;30;-60
100%U;131,839941;68,911067;30;-60
"""
LAYOUT_2 = """ ;DoubleA;phase;mass;phase;ref;use
100%n;80;40;0;0;-1;0
100%n;99,030381;43,960790;10;-90;1;1
100%n;95,459687;55,577102;10;90;2;1
"""
LAYOUT_4 = """start,state,speed_Hz,amplitude_counts,phase_deg
1,without,49.0,151.2,20.4
2,without,49.3,150.9,20.0
3,with 0.06 g,49.0,24.8,39.5
"""
LAYOUT_3 = "A: [80@40, 60@55]\nB: [[99.030381@43.960790], [84.932821@53.529955]]\nU: [10@-90]\n"
VECTORS: Rows = [
    ("A", "80@40", "60@55"),
    ("B", "99.030381@43.960790"),
    (None, "84.932821@53.529955"),
    ("U", "10@-90"),
]


def cells(text: str) -> Rows:
    """Return the cells of a table, numbers as numbers."""
    mark = ";" if ";" in text else ","
    rows = [line.split(mark) for line in text.splitlines()]

    def cell(written: str) -> object:
        try:
            return float(written.replace(",", "."))
        except ValueError:
            return written.strip() or None

    return [[cell(written) for written in row] for row in rows]


def xlsx(path: Path, rows: Rows) -> None:
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append(list(row))
    book.save(path)


def ods(path: Path, rows: Rows) -> None:
    """Write the least that is an OpenDocument spreadsheet."""

    def cell(value: object) -> str:
        if value is None:
            return "<table:table-cell/>"
        if isinstance(value, float | int):
            return f'<table:table-cell office:value-type="float" office:value="{value!r}"/>'
        if isinstance(value, datetime):
            return f'<table:table-cell office:value-type="date" office:date-value="{value.isoformat()}"/>'
        return f'<table:table-cell office:value-type="string"><text:p>{escape(str(value))}</text:p></table:table-cell>'

    body = "".join(f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in rows)
    names = "".join(
        f' xmlns:{name}="urn:oasis:names:tc:opendocument:xmlns:{name}:1.0"'
        for name in ("office", "table", "text")
    )
    kind = "application/vnd.oasis.opendocument.spreadsheet"
    content = (
        f'<?xml version="1.0"?><office:document-content{names} office:version="1.2"><office:body><office:spreadsheet>'
        f'<table:table table:name="Log">{body}</table:table></office:spreadsheet></office:body></office:document-content>'
    )
    manifest = (
        '<?xml version="1.0"?><manifest:manifest xmlns:manifest="urn:oasis:names:tc:opendocument:xmlns:manifest:1.0">'
        f'<manifest:file-entry manifest:full-path="/" manifest:media-type="{kind}"/>'
        '<manifest:file-entry manifest:full-path="content.xml" manifest:media-type="text/xml"/></manifest:manifest>'
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mimetype", kind, zipfile.ZIP_STORED)
        archive.writestr("content.xml", content)
        archive.writestr("META-INF/manifest.xml", manifest)


def rotor(done: subprocess.CompletedProcess[str]) -> Any:
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["rotors"][0]


@pytest.mark.parametrize("write", [xlsx, ods])
@pytest.mark.parametrize(
    ("text", "rows"),
    [
        (LAYOUT_1, cells(LAYOUT_1)),
        (LAYOUT_2, cells(LAYOUT_2)),
        (LAYOUT_3, VECTORS),
        # the lines of the text, each in a cell
        (LAYOUT_3, [[line] for line in LAYOUT_3.splitlines()]),
        (LAYOUT_4, cells(LAYOUT_4)),
    ],
)
def test_each_layout_in_a_workbook(
    text: str, rows: Rows, write: Callable[[Path, Rows], None], dalembert: Dalembert, tmp_path: Path
) -> None:
    path = tmp_path / f"log.{write.__name__}"
    write(path, rows)
    assert rotor(dalembert("field", path, "--json")) == rotor(dalembert("field", "-", "--json", stdin=text))


@pytest.mark.parametrize("write", [xlsx, ods])
def test_dates_of_a_workbook(
    write: Callable[[Path, Rows], None], dalembert: Dalembert, tmp_path: Path
) -> None:
    masses = [(0, 0), (10, -90), (30, -60), (0, 0), (20, 45)]
    sizes = [80.0, 99.1, 127.3, 82.0, 96.0]
    head = ["date", "state", "amplitude_um", "phase", "mass_kg", "phase"]
    days = [datetime(2012 + k, 3, 1) for k in range(5)]
    rows = [
        [day, "n", size, 40.0 + k, *mass]
        for k, (day, size, mass) in enumerate(zip(days, sizes, masses, strict=True))
    ]
    path = tmp_path / f"log.{write.__name__}"
    write(path, [head, *rows])
    text = "\n".join(
        ";".join(map(str, row)) for row in ([head, *[[f"{row[0]:%d.%m.%Y}", *row[1:]] for row in rows]])
    )
    found = rotor(dalembert("field", path, "--json"))
    assert found == rotor(dalembert("field", "-", "--json", stdin=text))
    assert found["fit"]["drift"]["probability"] is not None


def test_a_faulty_cell_of_a_log_is_named_by_its_place(dalembert: Dalembert, tmp_path: Path) -> None:
    rows = [list(row) for row in cells(LAYOUT_1)]
    rows[3][1] = "much"
    xlsx(tmp_path / "log.xlsx", rows)
    done = dalembert("field", "log.xlsx")
    assert done.returncode == 1
    assert "cell B4, column DoubleA: found 'much', expected a number" in done.stderr


def test_merged_cells_of_a_header_part_no_values(dalembert: Dalembert, tmp_path: Path) -> None:
    rows: Rows = [
        ("Lauf", "Lager A", None, "Lager B", None, "Masse", "Winkel"),
        (None, "mm/s", "°", "mm/s", "°", "g", "Grad"),
        (0, 5, 40, 4, 100, None, None),
        (1, 6, 90, 4.5, 110, 10, 0),
    ]
    xlsx(tmp_path / "plain.xlsx", rows)
    plain = dalembert("field", "plain.xlsx", "--json")
    book = openpyxl.load_workbook(tmp_path / "plain.xlsx")
    for merged in ("A1:A2", "B1:C1", "D1:E1"):
        book.active.merge_cells(merged)
    book.save(tmp_path / "merged.xlsx")
    assert rotor(dalembert("field", "merged.xlsx", "--json")) == rotor(plain)
    # from the units into the values, and among the values
    for merged in ("A2:A3", "C3:C4"):
        book = openpyxl.load_workbook(tmp_path / "plain.xlsx")
        book.active.merge_cells(merged)
        book.save(tmp_path / "merged.xlsx")
        done = dalembert("field", "merged.xlsx")
        assert (done.returncode, done.stdout) == (1, "")
        assert f"merged cells {merged}, expected a value in each cell" in done.stderr


@pytest.mark.parametrize("date", ["14.3.19", "14.03.2019", "2019-03-14", "14.03.19, 08:30"])
def test_a_german_date(date: str, dalembert: Dalembert) -> None:
    rows = "0;{};1;5;40;;;\n1;15.3.2019;1;6;90;A;10;0\n"
    head = "Lauf;Datum;Lager;Amplitude [mm/s];Phase [Grad];Ebene;Testmasse [g];Testwinkel [Grad]\n"
    done = dalembert("field", "-", stdin=head + rows.format(date))
    assert done.returncode == 0
    assert "'Datum' as date" in done.stderr
    wrong = dalembert("field", "-", stdin=head + rows.format("30.2.19"))
    assert (wrong.returncode, wrong.stdout) == (1, "")
    assert "row 1 (line 2), column Datum: found '30.2.19', expected a date" in wrong.stderr
