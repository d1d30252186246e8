"""Decimal commas are read wherever the comma does not part the cells."""

from __future__ import annotations

from pathlib import Path

import pytest

from dalembert.tables.table import read
from tests.conftest import Dalembert

FAN = """run;sensor;amplitude_mm_s;phase_deg;trial_plane;trial_mass_g;trial_angle_deg
0;1;3,4;116,5;;;
1;1;1,8;42;A;2,25;10,5
"""
TWO = """run;sensor;amplitude_um;phase_deg;trial_plane;trial_mass_g;trial_angle_deg
0;1;30;116;;;
0;2;31;16;;;
1;1;12;42;"A;B";"2,25;3,5";"10,5;20"
1;2;14;40;"A;B";"2,25;3,5";"10,5;20"
2;1;15;82;B;2,5;10,5
2;2;17;340;B;2,5;10,5
"""


def pointed(text: str) -> str:
    """The same table with points."""
    return text.replace(",", ".")


@pytest.mark.parametrize("text", [FAN, TWO])
@pytest.mark.parametrize("mark", [";", "\t"])
def test_trial_masses_and_angles(text: str, mark: str, dalembert: Dalembert) -> None:
    if mark == "\t":
        quoted = text.split('"')
        text = "".join(part if k % 2 else part.replace(";", mark) for k, part in enumerate(quoted))
    with_commas, with_points = (dalembert("field", "-", stdin=t) for t in (text, pointed(text)))
    assert with_commas.returncode == 0, with_commas.stderr
    assert with_commas.stdout == with_points.stdout


@pytest.mark.slow
def test_a_long_table(dalembert: Dalembert) -> None:
    head, first, second = FAN.splitlines()
    for numbers in ("{};{}", "{};{},5"):  # whole amplitudes and such with a comma
        body = "\n".join(
            f"{r};{a}\n{r};{b}"
            for r in range(6000)
            for a, b in [(first.replace("3,4", numbers.format(3, 4)[2:]), second)]
        )
        text = f"rotor;{head}\n{body}\n"
        done = dalembert("field", "-", stdin=text)
        assert done.returncode == 0, done.stderr
        assert done.stdout == dalembert("field", "-", stdin=pointed(text)).stdout


def test_a_cell_with_a_point_among_commas_is_named(dalembert: Dalembert) -> None:
    done = dalembert("field", "-", stdin=FAN.replace("2,25", "2.25"))
    assert done.returncode == 1
    assert "row 2 (line 3), column trial_mass_g: found '2.25'" in done.stderr
    assert "decimal comma" in done.stderr


COMMANDS = {
    "field": ("field", "-"),
    "balance": ("balance", "-", "--plane", "A:20mm"),
    "place": ("place", "7.1996g@33.3deg", "--blades", "16"),
}
TABLES = {"field": FAN, "balance": "mass_kg,radius_mm,angle_deg\n1.25,10.5,33.3\n", "place": ""}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("mark", [";", "\t"])
def test_expected_values(command: str, mark: str, dalembert: Dalembert, tmp_path: Path) -> None:
    found = dalembert(*COMMANDS[command], stdin=TABLES[command])
    assert found.returncode == 0, found.stderr
    assert "." in found.stdout
    expected = tmp_path / "expected.csv"
    expected.write_text(found.stdout.replace(",", mark).replace(".", ","))
    done = dalembert(*COMMANDS[command], "--expect", "expected.csv", stdin=TABLES[command])
    assert done.returncode == 0, done.stdout + done.stderr
    assert "WRONG" not in done.stdout


def test_a_name_keeps_its_comma(dalembert: Dalembert, tmp_path: Path) -> None:
    table = "rotor;mass_kg;radius_mm;angle_deg\nno 1,5;1,25;10;30\n"
    (tmp_path / "expected.csv").write_text("rotor;mass_kg;angle_deg\nno 1,5;0,625;210,0\n")
    done = dalembert("balance", "-", "--plane", "A:20mm", "--expect", "expected.csv", stdin=table)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "no 1,5" in done.stdout


STATES = """link,vx_m_s,vy_m_s,fx_N,torque_N_m,omega_rad_s
1,1.5,0,?F*0.5,,
2,2.25,0,?F*-1.5,,
3,0,0,,10.5,2.5
"""


@pytest.mark.parametrize("mark", [";", "\t"])
def test_factors_of_an_unknown(mark: str, dalembert: Dalembert) -> None:
    with_points = dalembert("work", "-", stdin=STATES)
    assert with_points.returncode == 0, with_points.stderr
    text = STATES.replace(",", mark).replace(".", ",")
    with_commas = dalembert("work", "-", stdin=text)
    assert with_commas.returncode == 0, with_commas.stderr
    assert with_commas.stdout == with_points.stdout
    long = "".join(
        mark.join([str(step), row]) + "\n" for step in range(4000) for row in text.splitlines()[1:]
    )
    done = dalembert("work", "-", stdin=f"step{mark}{text.splitlines()[0]}\n{long}")
    assert done.returncode == 0, done.stderr
    last = done.stdout.splitlines()[-1].split(",")
    assert last[1:] == with_points.stdout.splitlines()[-1].split(",")[1:]


def test_words_among_expected_numbers_keep_their_commas(dalembert: Dalembert, tmp_path: Path) -> None:
    assert dalembert("examples", "watt-six-bar").returncode == 0
    text = "quantity;of;value\nmost_m;B.x;-2,3987737135926186\ngroup;BCD + CFG;RRR, closed form\n"
    (tmp_path / "e.csv").write_text(text)
    done = dalembert("inspect", "watt.toml", "--expect", "e.csv")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    "text",
    [
        "mass_g\n1,5\n22,25\n",
        "mass\n[g]\n1,5\n22,25\n",
        "mass, g\n1.5\n22.25\n",
        '"mass, g"\n"1,5"\n"22,25"\n',
    ],
)
def test_a_single_column_needs_no_other_mark(text: str, tmp_path: Path) -> None:
    (tmp_path / "table.csv").write_text(text)
    column = read(str(tmp_path / "table.csv"), numbers={"mass": "mass"}).numbers["mass"]
    assert (column.unit, column.values.tolist()) == ("g", [1.5, 22.25])


def test_bars_part_cells_with_decimal_commas(tmp_path: Path) -> None:
    """Of two marks that stand in every line the bar parts the cells: three commas a line, two bars."""
    (tmp_path / "table.csv").write_text("mass, g|radius, mm|angle, deg\n1,5|20,5|30,25\n2,5|21,5|40,5\n")
    table = read(str(tmp_path / "table.csv"), numbers={"mass": "mass", "radius": "length", "angle": "angle"})
    assert table.numbers["angle"].values.tolist() == [30.25, 40.5]


ONE = "name;mass_g;radius_mm;angle_deg\n"


@pytest.mark.parametrize(
    ("rows", "doubtful"),
    [
        ("A;1,010;20;0", True),
        ("A;12,500;20;0\nB;3;20;90\nC;1,125;30,250;90", True),
        ("A;1,010;20;0\nB;1,5;20;90", False),
        ("A;0,010;20;0", False),
        ("A;1,010;1000;0", False),
        ("A;1,01;20;0", False),
        ("A;1;20;0", False),
    ],
)
def test_a_comma_that_may_part_thousands_is_named(rows: str, doubtful: bool, dalembert: Dalembert) -> None:
    done = dalembert("balance", "-", "--plane", "A:20mm", stdin=ONE + rows + "\n")
    assert done.stdout == dalembert("balance", "-", "--plane", "A:20mm", stdin=pointed(ONE + rows)).stdout
    assert ("if the comma is between thousands" in done.stderr) == doubtful
    if rows == "A;1,010;20;0":
        assert "read '1,010' as 1.01, with a decimal comma; write 1010 if" in done.stderr


@pytest.mark.parametrize("above", ["", "# fan 3\n"])
@pytest.mark.parametrize("end", ["# end", "# read by Ann; Monday", "#end;;;", "  # end\n\n# and so on", "#"])
def test_comments_below_the_header_are_left_out(above: str, end: str, dalembert: Dalembert) -> None:
    rows = ["A;1,5;20;0", "#B;2;20;90", "#3;2,5;20;90"]
    plain = dalembert("balance", "-", "--plane", "A:20mm", stdin=ONE + "\n".join(rows))
    assert plain.returncode == 0
    for at in (0, 1, len(rows)):
        text = above + ONE + "\n".join([*rows[:at], end, *rows[at:]])
        done = dalembert("balance", "-", "--plane", "A:20mm", stdin=text)
        assert (done.returncode, done.stdout) == (0, plain.stdout), done.stderr


def test_a_row_that_is_too_short_is_no_comment(dalembert: Dalembert) -> None:
    done = dalembert("balance", "-", "--plane", "A:20mm", stdin=ONE + "#1;2\n")
    assert done.returncode == 1
    assert "row 1 (line 2): found 2 cells, expected 4" in done.stderr
    done = dalembert("balance", "-", "--plane", "A:20mm", stdin=ONE + "# end\n")
    assert "a header and no rows" in done.stderr


def test_a_comment_below_a_long_table(dalembert: Dalembert) -> None:
    text = "rotor,mass_g,radius_mm,angle_deg\n" + "".join(f"{k},1.5,20,30\n" for k in range(10_100))
    done = dalembert("balance", "-", "--plane", "A:20mm", stdin=f"{text}# end\n")
    assert (done.returncode, done.stdout.count("\n")) == (0, 10_101)
