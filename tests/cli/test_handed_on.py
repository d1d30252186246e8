"""Results as people hand them on: workbooks, Markdown, LaTeX, HTML; units of choice; wide tables on a terminal."""

from __future__ import annotations

import csv
import io
import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import openpyxl
import pytest

from tests.conftest import Dalembert

ROTOR = "rotor,name,mass_g,radius_mm,angle_deg,z_mm\na|b_%,W1,90.5,30,60,20\na|b_%,W2,60,50.25,210,65\n=1+1,W,1,2,3,4\n"
BALANCE = ("balance", "-", "--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm")


def test_a_workbook_has_every_digit(dalembert: Dalembert, tmp_path: Path) -> None:
    plain = dalembert(*BALANCE, stdin=ROTOR)
    done = dalembert(*BALANCE, "-o", "out.xlsx", stdin=ROTOR)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    book = openpyxl.load_workbook(tmp_path / "out.xlsx")
    assert book.sheetnames == ["corrections", "rotors"]
    sheet = book.worksheets[0]
    header, *rows = sheet.iter_rows(values_only=True)
    wanted_header, *wanted = csv.reader(io.StringIO(plain.stdout))
    assert list(header) == wanted_header
    for row, expected in zip(rows, wanted, strict=True):
        for found, cell in zip(row, expected, strict=True):
            assert found == (cell if isinstance(found, str) else float(cell))


def test_what_is_written_is_read_again(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert(*BALANCE, "-o", "out.xlsx", stdin=ROTOR)
    done = dalembert(*BALANCE, "--expect", "out.xlsx", stdin=ROTOR)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "WRONG" not in done.stdout


def test_never_over_the_workbook_that_is_read(dalembert: Dalembert, tmp_path: Path) -> None:
    made = openpyxl.Workbook()
    for row in csv.reader(io.StringIO(ROTOR.replace("=1+1", "c"))):
        made.worksheets[0].append(row)
    made.save(tmp_path / "rotor.xlsx")
    before = (tmp_path / "rotor.xlsx").read_bytes()
    (tmp_path / "link.md").symlink_to("rotor.xlsx")
    for output in ("rotor.xlsx", "./rotor.xlsx", "link.md"):
        done = dalembert("balance", "rotor.xlsx#Sheet", *BALANCE[2:], "-o", output)
        assert done.returncode == 2
        assert "is an input" in " ".join(done.stderr.split())
        assert (tmp_path / "rotor.xlsx").read_bytes() == before


def test_a_workbook_holds_every_table(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "pump-trials-left-on")
    done = dalembert("field", "pump.csv", "-o", "out.xlsx")
    assert done.returncode == 0, done.stderr
    book = openpyxl.load_workbook(tmp_path / "out.xlsx")
    assert book.sheetnames[:2] == ["corrections", "influence"]
    dalembert("examples", "klann")
    done = dalembert("forces", "klann.toml", "--over", "0:360:30", "-o", "check.xlsx", "--plot", "p.svg")
    assert done.returncode == 0, done.stderr
    assert set(openpyxl.load_workbook(tmp_path / "check.xlsx").sheetnames) >= {"poses"}


def test_text_documents(dalembert: Dalembert, tmp_path: Path) -> None:
    for name in ("out.md", "out.tex"):
        assert dalembert(*BALANCE, "-o", name, stdin=ROTOR).returncode == 0
    markdown, latex = ((tmp_path / f"out.{s}").read_text() for s in ("md", "tex"))
    assert markdown.startswith("## corrections\n\n| rotor | plane | z_mm |")
    assert markdown.splitlines()[3] == "| --- | --- | ---: | ---: | ---: | ---: | ---: |"
    assert markdown.splitlines()[4].startswith(r"| a\|b_% | A | 0 | 20 | ")
    assert r"\begin{tabular}{llrrrrr}" in latex
    assert r"a|b\_\% & A & 0 & 20 & " in latex


def test_names_with_signs_of_the_form(dalembert: Dalembert, tmp_path: Path) -> None:
    """A cell that begins with [ would be an argument of the line's end before it; `<i>` is no markup."""
    rows = 'rotor,name,unbalance_g_mm,angle_deg\n[1],w,1,0\n"<i>*2*",w,1,90\n"a\\b\n`c`",w,1,90\n'
    for name in ("out.md", "out.tex"):
        done = dalembert("balance", "-", "--plane", "A:20mm", "-o", name, stdin=rows)
        assert done.returncode == 0, done.stderr
    markdown, latex = ((tmp_path / f"out.{s}").read_text() for s in ("md", "tex"))
    names = [line.split(" | ")[0].lstrip("| ") for line in markdown.splitlines()[4:7]]
    assert names == ["[1]", r"\<i>*2*", r"a\\b `c`"]
    names = [line.split(" & ")[0] for line in latex.splitlines() if " & A & " in line][:3]
    assert names == ["{}[1]", r"\textless{}i\textgreater{}*2*", r"a\textbackslash{}b `c`"]


def test_no_known_suffix(dalembert: Dalembert, tmp_path: Path) -> None:
    done = dalembert(*BALANCE, "-o", "out.doc", stdin=ROTOR)
    assert done.returncode == 2
    assert "expected .csv, .json, .xlsx, .parquet, .md, .tex" in " ".join(done.stderr.split())


def test_units_of_choice(dalembert: Dalembert, tmp_path: Path) -> None:
    plain = list(csv.DictReader(io.StringIO(dalembert(*BALANCE, stdin=ROTOR).stdout)))
    done = dalembert(*BALANCE, "--units", "in, kg·m,oz,rad", "-o", "out.csv", stdin=ROTOR)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(io.StringIO((tmp_path / "out.csv").read_text())))
    assert list(rows[0]) == ["rotor", "plane", "z_in", "radius_in", "unbalance_kg_m", "mass_oz", "angle_rad"]
    for row, before in zip(rows, plain, strict=True):
        assert float(row["z_in"]) == pytest.approx(float(before["z_mm"]) / 25.4, rel=1e-15)
        assert float(row["unbalance_kg_m"]) == pytest.approx(
            float(before["unbalance_g_mm"]) * 1e-6, rel=1e-15
        )
        assert float(row["mass_oz"]) == pytest.approx(float(before["mass_g"]) / 28.349523125, rel=1e-15)
        assert float(row["angle_rad"]) == pytest.approx(
            float(before["angle_deg"]) * 0.017453292519943295, rel=1e-15
        )
    documents = [
        dalembert(*BALANCE, "--json", *more, stdin=ROTOR).stdout for more in ((), ("--units", "kg,in"))
    ]
    assert json.loads(documents[0]) == json.loads(documents[1])
    done = dalembert(*BALANCE, "--units", "in,kg_m,oz,rad", "--expect", "out.csv", stdin=ROTOR)
    assert done.returncode == 0, done.stdout


def test_units_of_a_mechanism(dalembert: Dalembert) -> None:
    dalembert("examples", "engine")
    command = ("forces", "engine.toml", "--over", "0:90:45", "--digits")
    before, after = (
        list(csv.DictReader(io.StringIO(dalembert(*command, *more).stdout)))
        for more in ((), ("--units", "N_mm,kN"))
    )
    for old, new in zip(before, after, strict=True):
        assert float(new["input_torque_N_mm"]) == pytest.approx(
            1000 * float(old["input_torque_N_m"]), rel=1e-12
        )
        assert "shaking_fx_kN" in new
        assert new["input_deg"] == old["input_deg"]


@pytest.mark.parametrize(
    ("units", "message"),
    [
        ("mm,furlong", "'furlong' is no unit"),
        ("mm,in", "mm and in are both units of length"),
        ("", "is no unit"),
    ],
)
def test_bad_units(units: str, message: str, dalembert: Dalembert) -> None:
    done = dalembert(*BALANCE, "--units", units, stdin=ROTOR)
    assert done.returncode == 2
    assert message in " ".join(done.stderr.split())


def on_a_terminal(arguments: list[str], folder: Path, columns: int) -> str:
    """What a command shows on a terminal so many columns wide."""
    ours, theirs = pty.openpty()
    command = [str(Path(sys.executable).with_name("dalembert")), *arguments]
    env = {**os.environ, "COLUMNS": str(columns)}
    with subprocess.Popen(command, stdout=theirs, cwd=folder, env=env) as process:
        os.close(theirs)
        shown = b""
        while True:
            try:
                part = os.read(ours, 65536)
            except OSError:
                break
            if not part:
                break
            shown += part
        assert process.wait() == 0
    os.close(ours)
    return shown.decode().replace("\r\n", "\n")


def test_a_wide_table_in_blocks_on_a_terminal(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "klann")
    arguments = ["mechanism", "klann.toml", "--over", "0:20:10", "--only", "H,leg,arm,coupler"]
    wide = dalembert(*arguments, "--text").stdout
    assert max(map(len, wide.splitlines())) > 80
    shown = on_a_terminal(arguments, tmp_path, 80)
    assert max(map(len, shown.splitlines())) <= 80
    blocks = [block.splitlines() for block in shown.split("\n\n") if block.startswith("step")]
    assert len(blocks) > 1
    assert all(block[0].split()[:2] == ["step", "input_deg"] and len(block) == 4 for block in blocks)
    header = next(line for line in wide.splitlines() if line.startswith("step"))
    assert [
        *blocks[0][0].split(),
        *(name for block in blocks[1:] for name in block[0].split()[2:]),
    ] == header.split()
    assert on_a_terminal(arguments, tmp_path, 1000) == wide
