"""Tables beside a mechanism's file are read as every table: a law of motion as spreadsheets and people write it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from virtualwork import Mechanism, Torque
from virtualwork.describe import DescriptionError

CRANK = """
[ground]
A = [0, 0]
[links.crank]
points = { A = [0, 0], B = [1, 0] }
[input]
link = "crank"
law = "law.csv"
"""


def crank(folder: Path, table: bytes) -> Mechanism:
    (folder / "law.csv").write_bytes(table)
    (folder / "crank.toml").write_text(CRANK)
    return Mechanism.from_toml(folder / "crank.toml")


PLAIN = b"time_s,angle_deg\n0,0\n1,10.5\n2,40\n"


@pytest.mark.whole
@pytest.mark.parametrize(
    "table",
    [
        PLAIN,
        b"time [s];angle [deg]\n0;0\n1;10,5\n2;40\n",
        b"time\tangle\ns\tdeg\n0\t0\n1\t10.5\n2\t40\n",
        "time_s,angle (°),note\n0,0,\n1,10.5,x\n2,40,\n".encode("utf-16"),
        "\ntime_s;angle_deg;größe\n0;0;1\n1;10,5;2\n2;40;3\n".encode("cp1252"),
    ],
    ids=["plain", "brackets", "row of units", "UTF-16", "Windows-1252"],
)
def test_every_spelling_of_a_law_is_one_law(table: bytes, tmp_path: Path) -> None:
    plain, other = crank(tmp_path, PLAIN), crank(tmp_path, table)
    (one,), (two,) = plain.inputs, other.inputs
    assert one.history == two.history
    assert np.degrees([angle for _, angle in two.history]) == pytest.approx([0, 10.5, 40])


@pytest.mark.whole
@pytest.mark.parametrize(
    ("table", "words"),
    [
        (b'time_s,angle_deg\n0,"0\n', "balanced quotes"),
        (b"time_s,angle_deg\n0,\x01\x02\n", "this is not text"),
        (b"", "the file is empty"),
        (b"time_s,speed_rpm\n0,1\n1,2\n", "found the columns time_s, speed_rpm, expected time_s or t_s, and angle_deg"),
        (b"time_s,angle_deg\n0,0\n1,x\n", "row 2 (line 3), column angle_deg: found 'x', expected a number"),
        (b"time_s;angle_deg\n0;1,5\n1;2.500\n", "column angle_deg: found '2.500', expected a number with a decimal comma"),
        (b"time_s,angle_deg\n0,0\n1\n", "row 2 (line 3), column angle_deg: found '', expected a number"),
        (b"time_s,angle_deg\n0,0\n1,nan\n", "column angle_deg: found 'nan', expected a number"),
        (b"time_s,angle_deg,angle_rad\n0,0,0\n1,90,1\n", "more than once, by the columns angle_deg and angle_rad"),
        (b"time_s,angle\n0,0\n1,90\n", "the column angle has no unit"),
        (b"time_s,angle_mm\n0,0\n1,90\n", "the column angle_mm has the unknown unit 'mm'"),
        (b"time_s,angle_deg\n1,0\n0,90\n", "at least two rows with rising time_s"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_table_is_one_sentence(table: bytes, words: str, tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match="law") as error:
        crank(tmp_path, table)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("keys", "table", "rows"),
    [
        ('law = "t.csv"', "Time (ms),Angle [rev]\n0,0\n500,0.25\n", [(0, 0), (0.5, np.pi / 2)]),
        ('law = "t.csv"', "angle_deg,t_s\n0,0\n90,0.5\n", [(0, 0), (0.5, np.pi / 2)]),
        ('[[forces]]\nlink = "crank"\ntable = "t.csv"', "angle_deg,fx_kN,fy_lbf\n0,1,2\n90,3,\n", [(0, 1000 + 8.896443230521j), (np.pi / 2, 3000)]),
        ('[[forces]]\nlink = "crank"\ntable = "t.csv"', "angle_rad,fy_N\n0,1\n1,2\n", [(0, 1j), (1, 2j)]),
        ('[[torques]]\nlink = "crank"\ntorque = "t.csv"', "speed_Hz,torque_N_mm\n0,20\n1,-3\n", [(0, 0.02), (2 * np.pi, -0.003)]),
    ],
)  # fmt: skip
def test_a_table_takes_any_unit_and_any_case(
    keys: str, table: str, rows: list[tuple[float, complex]], tmp_path: Path
) -> None:
    (tmp_path / "t.csv").write_text(table)
    m = Mechanism.from_toml_text(CRANK.replace('law = "law.csv"', keys), folder=tmp_path)
    history = next(part.history for part in (*m.forces, *m.torques, *m.inputs))
    assert history is not None
    assert np.array(history).ravel().tolist() == pytest.approx(np.array(rows).ravel().tolist(), rel=1e-15)


def test_a_law_in_a_workbook_is_that_of_the_sheet_that_its_name_ends_in(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl", reason="workbooks: pip install 'dalembert[excel]'")
    book = openpyxl.Workbook()
    for sheet, step in ((book.active, 30), (book.create_sheet("second one"), 60)):
        for row in (["time [s]", "angle [deg]"], [0, 0], [1, step]):
            sheet.append(row)
    book.save(tmp_path / "law.xlsx")
    for name, last in (("law.xlsx", 30), ("law.xlsx#second one", 60)):
        m = Mechanism.from_toml_text(CRANK.replace("law.csv", name), folder=tmp_path)
        assert m.inputs[0].history == ((0, 0), (1, np.radians(last)))
    with pytest.raises(DescriptionError, match=r"\[input\] law: law.xlsx: no sheet 'third'"):
        Mechanism.from_toml_text(CRANK.replace("law.csv", "law.xlsx#third"), folder=tmp_path)


@pytest.mark.parametrize(
    "header", ["t_s,speed_rpm,torque_N_m", "torque_N_m,angle_deg,speed_rad_s", "time_s,t_s,torque_N_m"]
)
def test_a_torque_over_two_quantities_is_refused(header: str, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(f"{header}\n0,0,1\n1,2,3\n")
    keys = '[[torques]]\nlink = "crank"\ntorque = "t.csv"'
    with pytest.raises(DescriptionError, match="expected one of them: a table is over one quantity") as error:
        Mechanism.from_toml_text(CRANK.replace('law = "law.csv"', keys), folder=tmp_path)
    one, other = (column for column in header.split(",") if "torque" not in column)
    assert all(column in str(error.value) for column in (one, other))


def test_a_torque_over_what_it_cannot_be_over_is_refused() -> None:
    with pytest.raises(DescriptionError, match="found 'input', expected time, angle or speed"):
        Torque("crank", history=((0.0, 1.0), (1.0, 2.0)), over="input")  # type: ignore[arg-type]
