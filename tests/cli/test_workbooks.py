"""Workbooks as tables: sheets, cells that hold no value, files that are none."""

from __future__ import annotations

import io
import subprocess
import sys
import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from struct import pack

import openpyxl
import pytest

from dalembert.errors import DataError
from dalembert.tables.old_workbooks import looks
from dalembert.tables.workbooks import read_sheet
from tests.conftest import Dalembert

HERE = Path(__file__).parent / "workbooks"
PRESS = str(Path(__file__).parents[2] / "cli/examples/crank-press/press.toml")
PLANE = ("--plane", "A:20mm")
PLAIN = "mass_g,radius_mm,angle_deg\n90.5,30,60\n60,50.25,210\n"
ROWS = (("mass [g]", "radius (mm)", "Angle, °"), (90.5, 30, 60), (60, 50.25, 210))


def book(path: Path, sheets: dict[str, tuple[tuple[object, ...], ...]], *, merge: str = "") -> None:
    """Write a workbook; of its first sheet some cells may be merged."""
    made = openpyxl.Workbook()
    made.remove(made.active)
    for name, rows in sheets.items():
        sheet = made.create_sheet(name)
        for row in rows:
            sheet.append(row)
    if merge:
        made.worksheets[0].merge_cells(merge)
    made.save(path)


@pytest.fixture
def plain(dalembert: Dalembert) -> str:
    """What the same table gives as CSV."""
    return dalembert("balance", "-", *PLANE, stdin=PLAIN).stdout


@pytest.mark.parametrize("name", ["masses.xlsx", "masses.xls", "masses.ods"])
def test_each_kind_of_workbook(name: str, dalembert: Dalembert, plain: str, tmp_path: Path) -> None:
    book(tmp_path / "masses.xlsx", {"Masses": ROWS})
    path = tmp_path / name if name.endswith("xlsx") else HERE / name
    for done in (
        dalembert("balance", path, *PLANE),
        dalembert("balance", "-", *PLANE, stdin=path.read_bytes()),
    ):
        assert done.returncode == 0, done.stderr
        assert (done.stdout, done.stderr) == (plain, "")


def test_the_first_sheet_or_the_one_named(dalembert: Dalembert, plain: str, tmp_path: Path) -> None:
    book(
        tmp_path / "b.xlsx", {"Masses": ROWS, "Fan 2": (ROWS[0], (1, 2, 3)), "Notes": (("none",), ("empty",))}
    )
    first = dalembert("balance", "b.xlsx", *PLANE)
    assert first.stdout == plain
    assert first.stderr == "warning: b.xlsx: read the sheet 'Masses'; there are also 'Fan 2', 'Notes'\n"
    named = dalembert("balance", "b.xlsx#masses", *PLANE)
    assert (named.stdout, named.stderr) == (plain, "")
    other = dalembert("balance", "b.xlsx#Fan 2", *PLANE)
    assert other.returncode == 0
    assert other.stdout != plain
    missing = dalembert("balance", "b.xlsx#Fan 3", *PLANE)
    assert missing.returncode == 1
    assert "no sheet 'Fan 3': expected one of 'Masses', 'Fan 2', 'Notes'" in missing.stderr
    notes = dalembert("balance", "b.xlsx#Notes", *PLANE)
    assert notes.returncode == 1
    assert "sheet 'Notes'; the header is: none; other sheets: 'Masses', 'Fan 2'" in notes.stderr
    assert len(notes.stderr.splitlines()) == 1


BAD = {
    "merged": (
        (*ROWS, (1, 2, 3), (None, 2, 3)),
        "A4:A5",
        "cell A4: found merged cells A4:A5, expected a value in each cell",
    ),
    "a formula": (
        (*ROWS, ("=A2*2", 2, 3)),
        "",
        "cell A4: found the formula '=A2*2' without a stored value, expected a value",
    ),
    "an error": ((*ROWS, ("#DIV/0!", 2, 3)), "", "cell A4: found '#DIV/0!', expected a value, not an error"),
    "a text": ((*ROWS, (1, "wide", 3)), "", "cell B4, column radius (mm): found 'wide', expected a number"),
    "a blank": ((*ROWS, (1, None, 3)), "", "cell B4, column radius (mm): found '', expected a number"),
    "negative": (
        (*ROWS, (-1, 2, 3)),
        "",
        "cell A4, column mass [g]: found '-1', expected a mass that is not negative",
    ),
    "units": (
        (("mass [kg]", "radius", "angle"), ("g", "mm", "°"), (1, 2, 3)),
        "",
        "cell A2: found 'g', expected 'kg', the unit in its header 'mass [kg]'",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_one_line_with_sheet_and_cell(case: str, dalembert: Dalembert, tmp_path: Path) -> None:
    rows, merge, message = BAD[case]
    book(tmp_path / "b.xlsx", {"Sheet 1": rows}, merge=merge)
    done = dalembert("balance", "b.xlsx", *PLANE, "-o", "out.csv")
    assert done.returncode == 1
    assert (done.stdout, len(done.stderr.splitlines())) == ("", 1)
    assert done.stderr.startswith(f"dalembert: b.xlsx: sheet 'Sheet 1', {message}")
    assert not (tmp_path / "out.csv").exists()


def test_what_stands_in_columns_that_are_not_read_is_no_fault(
    dalembert: Dalembert, plain: str, tmp_path: Path
) -> None:
    rows = ((*ROWS[0], "remark"), (*ROWS[1], "=A2"), (*ROWS[2], "#N/A"))
    book(tmp_path / "b.xlsx", {"Sheet 1": rows})
    assert dalembert("balance", "b.xlsx", *PLANE).stdout == plain


def rewritten(path: Path, change: Callable[[str, bytes], bytes]) -> bytes:
    """A zip file with its members changed."""
    out = io.BytesIO()
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            new.writestr(name, change(name, old.read(name)))
    return out.getvalue()


def test_an_open_document(dalembert: Dalembert) -> None:
    def formula(name: str, data: bytes) -> bytes:
        return data.replace(b'office:value-type="float" office:value="90.5"', b'table:formula="of:=2*3"')

    def merged(name: str, data: bytes) -> bytes:
        cell = b'<table:table-cell office:value-type="float" office:value="90.5"'
        return data.replace(cell, cell + b' table:number-rows-spanned="2"')

    def encrypted(name: str, data: bytes) -> bytes:
        entry = b'<manifest:file-entry manifest:full-path="content.xml"'
        if name.startswith("META"):
            assert entry in data
            return data.replace(entry, b"<manifest:encryption-data/>" + entry)
        return data[::-1] if name == "content.xml" else data

    for change, message in (
        (formula, "cell A2: found the formula '=2*3' without a stored value"),
        (merged, "cell A2: found merged cells A2:A3"),
        (encrypted, "the workbook is encrypted: expected one without a password"),
    ):
        done = dalembert("balance", "-", *PLANE, stdin=rewritten(HERE / "masses.ods", change))
        assert done.returncode == 1
        assert message in done.stderr


def test_encrypted_and_broken(dalembert: Dalembert, tmp_path: Path) -> None:
    book(tmp_path / "b.xlsx", {"Masses": ROWS})
    data = (tmp_path / "b.xlsx").read_bytes()
    locked = (HERE / "masses.xls").read_bytes() + "EncryptedPackage".encode("utf-16-le")
    for content, message in (
        (locked, "the workbook is encrypted"),
        (data[: len(data) // 2], "broken workbook"),
        (data[:4] + bytes(200), "broken workbook"),
        ((HERE / "masses.xls").read_bytes()[:700], "broken workbook"),
        (rewritten(tmp_path / "b.xlsx", lambda name, old: old[: len(old) // 2]), "broken workbook"),
    ):
        done = dalembert("balance", "-", *PLANE, stdin=content)
        assert done.returncode == 1
        assert message in done.stderr
        assert len(done.stderr.splitlines()) == 1


def test_no_output_over_the_workbook(dalembert: Dalembert, tmp_path: Path) -> None:
    book(tmp_path / "b.xlsx", {"Masses": ROWS})
    before = (tmp_path / "b.xlsx").read_bytes()
    (tmp_path / "link.csv").symlink_to("b.xlsx")
    done = dalembert("balance", "b.xlsx#Masses", *PLANE, "-o", "link.csv")
    assert done.returncode == 2
    assert (tmp_path / "b.xlsx").read_bytes() == before


def test_a_technicians_sheet(dalembert: Dalembert, tmp_path: Path) -> None:
    """Title, blank row, units below the header, numbers typed as text with a comma, a merged title."""
    rows = (
        ("Auswuchten Lüfter 3",),
        (),
        ("Lauf", "Messstelle", "Amplitude", "Phase", "Ebene", "Testmasse", "Testwinkel"),
        (None, None, "mm/s", "°", None, "g", "°"),
        (0, 1, "3,4", 116),
        (1, 1, 1.8, 42, "A", 2, 0),
    )
    book(tmp_path / "fan.xlsx", {"Tabelle1": rows}, merge="A1:G1")
    columns = "run=Lauf sensor=Messstelle trial_plane=Ebene trial_mass=Testmasse trial_angle=Testwinkel"
    options = [word for pair in columns.split() for word in ("--column", pair)]
    csv = "run,sensor,amplitude_mm_s,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n0,1,3.4,116,,,\n1,1,1.8,42,A,2,0\n"
    wanted = dalembert("field", "-", "--json", stdin=csv).stdout.partition('"warnings"')[0]
    assert '"mass_kg"' in wanted
    # its German words are known; they can be mapped by hand too
    for words in ([], options):
        done = dalembert("field", "fan.xlsx", *words, "--json")
        assert done.returncode == 0, done.stderr
        assert done.stdout.partition('"warnings"')[0] == wanted


def compound(stream: bytes) -> bytes:
    """A compound document of sectors of 512 bytes: one of the table, one of the directory, and the stream's."""
    count = max(8, -(-len(stream) // 512))
    free, last, table = 0xFFFFFFFF, 0xFFFFFFFE, 0xFFFFFFFD
    head = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(16)
    head += pack("<HHHHH6x", 62, 3, 0xFFFE, 9, 6) + pack("<IIIIIIIII", 0, 1, 1, 0, 4096, last, 0, last, 0)
    head += pack("<109I", 0, *[free] * 108)
    following = [table, last, *range(3, 2 + count), last]

    def entry(name: str, kind: int, first: int, size: int) -> bytes:
        title = name.encode("utf-16-le") + bytes(2)
        return title.ljust(64, b"\0") + pack("<HBB48xIQ", len(title), kind, 1, first, size)

    directory = entry("Root Entry", 5, last, 0) + entry("Workbook", 2, 2, count * 512)
    sectors = pack(f"<{len(following)}I", *following).ljust(512, b"\xff") + directory.ljust(512, b"\0")
    return head + sectors + stream.ljust(count * 512, b"\0")


def test_what_is_hidden_in_an_old_workbook() -> None:
    """Rows, columns and percentages, of plain, short, many and computed numbers; of the sheet that is read alone."""

    def record(kind: int, body: bytes) -> bytes:
        return pack("<HH", kind, len(body)) + body

    styles = b"".join(record(0xE0, pack("<HH16x", 0, number)) for number in (0, 10, 164))
    formats = record(0x41E, pack("<HHB", 164, 4, 0) + b"0.0%")
    end = record(0x0A, b"")
    sheet = record(0x7D, pack("<HHHHHH", 3, 4, 2304, 0, 1, 0)) + record(
        0x7D, pack("<HHHHHH", 5, 5, 9, 0, 0, 0)
    )
    for row, options in ((0, 0x100), (1, 0x120), (2, 0x100)):
        sheet += record(0x208, pack("<HHHHHHHH", row, 0, 6, 255, 0, 0, options, 15))
    sheet += record(0x203, pack("<HHHd", 1, 0, 1, 0.5)) + record(0x203, pack("<HHHd", 1, 1, 0, 0.5))
    sheet += record(0x27E, pack("<HHHI", 1, 2, 2, 0)) + record(0xBD, pack("<HHHIHIH", 2, 0, 0, 0, 1, 0, 1))
    value = pack("<d", 0.5)
    sheet += record(0x06, pack("<HHH8s", 2, 3, 1, value)) + record(
        0x06, pack("<HHH8s", 2, 4, 1, b"\0" * 6 + b"\xff" * 2)
    )
    other = record(0x208, pack("<HHHHHHHH", 7, 0, 6, 255, 0, 0, 0x20, 15))

    def book(first: int, second: int) -> bytes:
        names = ((first, b"\x05\0Other"), (second, b"\x03\x01" + "Öl1".encode("utf-16-le")))
        return (
            styles + formats + b"".join(record(0x85, pack("<IH", at, 0) + name) for at, name in names) + end
        )

    begin = len(book(0, 0))
    data = compound(book(begin, begin + len(other + end)) + other + end + sheet + end)
    rows, columns, percent = map(set, looks(data, "Öl1"))
    assert (rows, columns, percent) == ({1}, {3, 4}, {(1, 0), (1, 2), (2, 1), (2, 3)})
    assert list(map(set, looks(data, "Other"))) == [{7}, set(), set()]
    # of what is damaged nothing is known
    assert not any(looks(data[:1100], "Öl1"))
    assert not any(looks(b"\xd0\xcf", "Öl1"))


def test_a_hidden_row_of_an_old_workbook_is_named(dalembert: Dalembert, plain: str, tmp_path: Path) -> None:
    data = bytearray((HERE / "masses.xls").read_bytes())
    data[data.index(pack("<HHH", 0x208, 16, 2)) + 4 + 12] |= 0x20
    (tmp_path / "m.xls").write_bytes(data)
    done = dalembert("balance", "m.xls", *PLANE)
    assert done.stdout == plain
    assert done.stderr == "warning: m.xls: sheet 'Massen': the row 3 is hidden and takes part\n"


def test_digits_of_further_sheets_are_cut(dalembert: Dalembert, tmp_path: Path) -> None:
    """The sheet of the cycle too has the right digits alone with --digits; it had all."""
    sheets = []
    for options in ((), ("--digits",)):
        path = tmp_path / f"{len(options)}.xlsx"
        done = dalembert("forces", PRESS, "--over", "0deg:360deg:1deg", *options, "-o", str(path))
        assert done.returncode == 0, done.stderr
        rows = list(openpyxl.load_workbook(path)["cycle"].iter_rows(values_only=True))
        sheets.append(dict(zip(*rows, strict=True)))
    whole, cut = sheets
    assert cut == pytest.approx(whole, rel=1e-9)
    assert len(repr(cut["peak_power_W"])) < len(repr(whole["peak_power_W"]))


@pytest.mark.parametrize("name", ["masses.xls", "masses.ods"])
def test_a_workbook_cut_off_or_changed_anywhere_is_read_or_refused_in_one_line(name: str) -> None:
    """calamine panics over some, and of others reads what zipfile refuses."""
    data = (HERE / name).read_bytes()
    for place in range(8, len(data), 41):
        for damaged in (data[:place], data[:place] + bytes([data[place] ^ 0x55]) + data[place + 1 :]):
            with suppress(DataError):
                read_sheet("file", damaged, "")


def test_a_panic_is_one_line(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "cut.xls").write_bytes((HERE / "masses.xls").read_bytes()[:4400])
    done = dalembert("balance", str(tmp_path / "cut.xls"), *PLANE)
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert "broken workbook" in done.stderr


def test_an_old_workbook_that_reserves_too_many_rows_is_refused() -> None:
    """[MS-XLS] 2.4.90, Dimensions: first row, last row, first column, last column. calamine would end the process."""
    data = (HERE / "masses.xls").read_bytes()
    at = data.index(pack("<HHIIHH", 0x200, 14, 0, 3, 0, 3))
    for rows in (pack("<II", 0, 0x55000003), pack("<II", 85, 3)):
        with pytest.raises(DataError, match="its cells lie beyond its bounds"):
            read_sheet("file", data[: at + 4] + rows + data[at + 12 :], "")


def test_a_workbook_is_read_where_there_is_no_standard_error(plain: str) -> None:
    code = "import os; os.close(2); from cli.app import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "balance", str(HERE / "masses.xls"), *PLANE],
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    )
    assert done.stdout == plain
