"""What users' files do wrong: one line that names file, row, column, value and what was expected; status 1."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from tests.conftest import Dalembert

HEAD = "mass_kg,radius_mm,angle_deg,z_mm\n"
GOOD = HEAD + "9,30,60,20\n6,50,210,65\n"
TWO = ("--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm")

BAD = {
    "a letter": (
        HEAD + "9,30,60,20\n6,5o,210,65\n",
        r"row 2 \(line 3\), column radius_mm: found '5o', expected a number",
    ),
    "an empty cell": (
        HEAD + "9,,60,20\n",
        r"row 1 \(line 2\), column radius_mm: found '', expected a number",
    ),
    "NaN": (HEAD + "9,30,nan,20\n", r"row 1 .*column angle_deg: found 'nan'"),
    "inf": (HEAD + "inf,30,60,20\n", r"row 1 .*column mass_kg: found 'inf'"),
    "too large": (HEAD + "1e999,30,60,20\n", r"row 1 .*column mass_kg: found '1e999'"),
    "underscore": (HEAD + "1_0,30,60,20\n", r"column mass_kg: found '1_0'"),
    "a negative mass": (
        HEAD + "-9,30,60,20\n",
        r"row 1 .*column mass_kg: found '-9', expected a mass that is not neg",
    ),
    "a negative radius": (
        HEAD + "9,-30,60,20\n",
        r"row 1 .*column radius_mm: found '-30', expected a radius",
    ),
    "no radius": (HEAD + "9,0,60,20\n", r"row 1 .*column radius_mm: found '0', expected a positive radius"),
    "a missing column": ("mass_kg,radius_mm,z_mm\n9,30,20\n", r"no column angle_deg or angle_rad"),
    "no mass": ("radius_mm,angle_deg,z_mm\n9,30,20\n", r"no column mass_kg .*weight_N"),
    "no z": ("mass_kg,radius_mm,angle_deg\n9,30,20\n", r"no column z_m, z_mm"),
    "a column twice": ("mass_kg,mass_g,radius_mm,angle_deg,z_mm\n9,1,1,1,1\n", r"columns mass_kg and mass_g"),
    "the same column twice": (
        "mass_kg,mass_kg,radius_mm,angle_deg,z_mm\n9,1,1,1,1\n",
        r"columns mass_kg and mass_kg",
    ),
    "a name twice": (
        "rotor,rotor,mass_kg,radius_mm,angle_deg,z_mm\n1,1,9,1,1,1\n",
        r"column rotor stands twice",
    ),
    "an unknown unit": (
        "mass_stone,radius_mm,angle_deg,z_mm\n9,1,1,1\n",
        r"column mass_stone .*unknown unit 'stone'",
    ),
    "a nearly known unit": (
        "mass_kgs,radius_mm,angle_deg,z_mm\n9,1,1,1\n",
        r"unit 'kgs'.* did you mean 'kg'\?",
    ),
    "no unit": ("mass_kg,radius,angle_deg,z_mm\n9,1,1,1\n", r"column radius has no unit: expected radius_m"),
    "masses and weights": (
        "mass_kg,weight_N,radius_mm,angle_deg,z_mm\n9,1,1,1,1\n",
        r"mixed columns mass_kg and weight_N",
    ),
    "masses and unbalances": (
        "mass_kg,unbalance_g_mm,radius_mm,angle_deg,z_mm\n9,1,1,1,1\n",
        r"mixed columns",
    ),
    "empty": ("", r"file is empty"),
    "only blanks": ("\n \n\n", r"file is empty"),
    "only a header": (HEAD, r"a header and no rows"),
    "a short row": (HEAD + "9,30,60\n", r"row 1 \(line 2\): found 3 cells, expected 4"),
    "a long row": (HEAD + "9,30,60,20,7\n", r"row 1 \(line 2\): found 5 cells, expected 4"),
    "an open quote": (HEAD + '9,30,60,"20\n', r"line 2: .*quotes"),
    "binary": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0", r"this is not text"),
    "a workbook": (b"PK\x03\x04\x14\0\0", r"rotor.csv: broken workbook .*: expected .xlsx, .xls or .ods"),
    "mixed decimals": (
        "mass_kg;radius_mm;angle_deg;z_mm\n9,5;3.0;60;20\n",
        r"column radius_mm: found '3.0'.*decimal comma",
    ),
    "1e6 comma": (HEAD + '"9,5",30,60,20\n', r"column mass_kg: found '9,5'"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files(name: str, dalembert: Dalembert, tmp_path: Path) -> None:
    content, message = BAD[name]
    (tmp_path / "rotor.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
    done = dalembert("balance", "rotor.csv", *TWO, "-o", "out.csv")
    assert done.returncode == 1
    assert done.stdout == ""
    assert re.search(message, done.stderr), done.stderr
    assert "rotor.csv" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["rotor.csv"]


RIGHT = "1,A,0.0,20.0"
READ = {
    "upper case and spaces": " Mass_KG , Radius_MM,ANGLE_deg,Z_mm\n 9 ,30,60,20\n6,50,210,65\n",
    "another order": "z_mm,angle_deg,radius_mm,mass_kg\n20,60,30,9\n65,210,50,6\n",
    "blank lines": HEAD + "\n9,30,60,20\n\n  \n6,50,210,65\n\n",
    "empty rows of a sheet": HEAD + "9,30,60,20\n,,,\n6,50,210,65\n",
    "semicolons and commas": "mass_kg;radius_mm;angle_deg;z_mm\n9,0;30;60,00;20\n6;50;210;65,0\n",
    "semicolons and points": "mass_kg;radius_mm;angle_deg;z_mm\n9.0;30;60;20\n6;50;210;65\n",
    "tabs": GOOD.replace(",", "\t"),
    "carriage returns": GOOD.replace("\n", "\r\n"),
    "old carriage returns": GOOD.replace("\n", "\r"),
    "a byte order mark": "\ufeff" + GOOD,
    "a quoted newline": 'name,mass_kg,radius_mm,angle_deg,z_mm\n"m\n1",9,30,60,20\nm2,6,50,210,65\n',
    "names like numbers": "name,mass_kg,radius_mm,angle_deg,z_mm\n07,9,30,60,20\nNA,6,50,210,65\n",
    "no last newline": GOOD.rstrip("\n"),
    "trailing commas": HEAD + "9,30,60,20,\n6,50,210,65,,\n",
}


@pytest.mark.parametrize("name", READ)
def test_files_that_spreadsheets_write(name: str, dalembert: Dalembert) -> None:
    base = dalembert("balance", "-", *TWO, stdin=GOOD)
    assert base.returncode == 0
    done = dalembert("balance", "-", *TWO, stdin=READ[name])
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == base.stdout


@pytest.mark.parametrize(
    ("codec", "said"), [("utf-16", "UTF-16"), ("utf-16-le", "UTF-16"), ("latin-1", "Windows-1252")]
)
def test_other_encodings_are_read_and_said(codec: str, said: str, dalembert: Dalembert) -> None:
    text = "name,mass_kg,radius_mm,angle_deg,z_mm\nMühle,9,30,60,20\nm2,6,50,210,65\n"
    done = dalembert("balance", "-", *TWO, stdin=text.encode(codec))
    assert done.returncode == 0
    assert done.stdout == dalembert("balance", "-", *TWO, stdin=GOOD).stdout
    assert f"read as {said}" in done.stderr


def test_extra_columns_are_ignored_and_said(dalembert: Dalembert) -> None:
    done = dalembert(
        "balance", "-", *TWO, stdin="note,mass_kg,radius_mm,angle_deg,z_mm,mass_note\nx,9,30,60,20,y\n"
    )
    assert done.returncode == 0
    assert "ignored the columns 'note', 'mass_note'" in done.stderr


@pytest.mark.parametrize("bad", ["x", "", "nan", "1_0"])
@pytest.mark.slow
def test_the_last_of_many_rows_is_named(bad: str, dalembert: Dalembert, tmp_path: Path) -> None:
    rows = 100_000
    (tmp_path / "rotor.csv").write_text("rotor," + HEAD + "7,9,30,60,20\n" * rows + f"8,9,{bad},60,20\n")
    done = dalembert("balance", "rotor.csv", *TWO)
    assert done.returncode == 1
    assert (
        f"row {rows + 1} (line {rows + 2}), column radius_mm: found '{bad}', expected a number" in done.stderr
    )


@pytest.mark.parametrize("delimiter", [",", ";"])
def test_large_and_small_tables_read_the_same(delimiter: str, dalembert: Dalembert, tmp_path: Path) -> None:
    """The same rotors through the csv module and through pandas, digit by digit."""
    head = "rotor,name,mass_g,radius_mm,angle_deg,z_mm\n"
    cells = [
        ("07", "a b", 1.1, 30.3, 60.7, 0.1),
        ("NA", "", 2.3, 0.3, 359.9, 1 / 3),
        ("7", "ü", 1e-7, 12, 0, 5e300),
    ]
    cells = [*cells[:2], ("7", "ü", 1e-7, 12.0, 0.0, -40.0)]
    rows = ["".join(",".join(map(str, cell)) + "\n") for cell in cells]

    def write(text: str) -> str:
        return text if delimiter == "," else text.replace(",", ";").replace(".", ",")

    (tmp_path / "small.csv").write_text(write(head + "".join(rows)))
    many = "".join(f"R{i}" + rows[0][2:] for i in range(12_000))
    (tmp_path / "large.csv").write_text(write(head + "".join(rows) + many))
    small = dalembert("balance", "small.csv", *TWO)
    large = dalembert("balance", "large.csv", *TWO)
    assert small.returncode == large.returncode == 0
    assert large.stdout.splitlines()[:7] == small.stdout.splitlines()
    assert len(large.stdout.splitlines()) == 1 + 2 * 12_003
    assert large.stderr == ""


def test_missing_unreadable_and_a_folder(dalembert: Dalembert, tmp_path: Path) -> None:
    for name in ("none.csv", str(tmp_path), "x" * 300):
        done = dalembert("balance", name, *TWO)
        assert done.returncode == 1
        assert len(done.stderr.splitlines()) == 1


cell = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True).map(str),
    st.integers(-5, 400).map(str),
    st.text(max_size=6),
    st.sampled_from(["", " ", "1,5", "1.5", "?", "NA", "-0", "1e308", "1e-320", '"', "ü", "\r", "0x1"]),
)
header = st.lists(
    st.one_of(
        st.sampled_from(
            [
                "mass_kg",
                "mass_g",
                "weight_N",
                "radius_mm",
                "angle_deg",
                "z_mm",
                "unbalance_g_mm",
                "rotor",
                "name",
                "Z_IN",
            ]
        ),
        st.text(max_size=8),
    ),
    max_size=7,
)


HUGE = ["mass_kg", "radius_mm", "angle_deg", "z_mm"]


@settings(
    max_examples=300,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
@given(
    head=header,
    rows=st.lists(st.lists(cell, max_size=7), max_size=5),
    delimiter=st.sampled_from(",;\t"),
    newline=st.sampled_from(["\n", "\r\n"]),
)
@example(head=HUGE, rows=[["1e308", "1e308", "0", "0"]], delimiter=",", newline="\n")
@example(head=HUGE, rows=[["1e300", "1e3", "0", "1e300"]], delimiter=",", newline="\n")
@pytest.mark.slow
def test_random_tables_never_break_the_command(
    head: list[str],
    rows: list[list[str]],
    delimiter: str,
    newline: str,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """In this process, for speed: any outcome but a result, a data error or a usage error fails."""
    import contextlib
    import io

    import typer

    from cli.app import build
    from dalembert.errors import DataError

    path = tmp_path_factory.mktemp("random") / "t.csv"
    path.write_bytes(
        newline.join(delimiter.join(row) for row in [head, *rows]).encode("utf-8", "surrogatepass")
    )
    command = typer.main.get_command(build("balance"))
    for planes in (["--plane", "A:20mm"], list(TWO)):
        with (
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()),
            contextlib.suppress(DataError),
        ):
            assert command.main(["balance", str(path), "--json", *planes], standalone_mode=False) in (0, None)


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("klann.toml", '[units]\nlength = "mm"\n[ground]\nA = [0, 90]\n', "TOML"),
        ("robot.urdf", '<robot name="r"><link name="arm"/></robot>\n', "XML or HTML"),
        ("result.json", '{\n "rotors": []\n}\n', "JSON"),
    ],
)
def test_a_file_of_another_kind_is_named(
    name: str, text: str, kind: str, dalembert: Dalembert, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text)
    for command in (["balance", name, "--plane", "A:1mm"], ["body", name], ["work", name]):
        done = dalembert(*command)
        line = f"dalembert: {name}: this is {kind}: expected a table, as CSV or a workbook\n"
        assert (done.returncode, done.stdout, done.stderr) == (1, "", line)
