"""What fuzzing broke, and holds now: each fault as the smallest call that showed it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from cli.cases.analysis import Analysis, Request
from cli.cases.axes import grids
from cli.cases.cases import load
from cli.cases.inputs import of_one
from dalembert.errors import LONGEST
from tests.conftest import Dalembert

# each is a whole command, or several
pytestmark = pytest.mark.slow

COMMAND = Path(sys.executable).with_name("dalembert")

CRANK = "[ground]\nA = [0, 0]\n[links.crank]\npoints = { A = [0, 0], B = [1, 0] }\n"
INPUT = '[input]\nlink = "crank"\nangle = 1\n'
MECHANISMS = {
    "nested": (f"name = {'[' * 3000}{']' * 3000}\n" + CRANK + INPUT, "nested too deeply"),
    "a number of thousands of digits": (f"name = {'9' * 5000}\n" + CRANK + INPUT, "no valid TOML"),
    "a number beyond a double": (CRANK + f"mass = {10**400}\n" + INPUT, r"crank\] mass: found 1000"),
    "a number for a table": ("units = 3\n" + CRANK + INPUT, r"\[units\]: found 3, expected a table"),
    "a table for a name": (f"name = {{ a = 1 }}\n{CRANK}{INPUT}", "name: found .*expected text"),
    "a table for a link": (
        CRANK + INPUT + '[[torsion_springs]]\nlinks = [{ a = 1 }, "crank"]\n',
        "expected text",
    ),
    "a list for a point": (
        CRANK.replace("[1, 0]", "{ from = [1], length = 1, angle = 0 }") + INPUT,
        r"points.B from: expected the name of another point",
    ),
    "a law that is no text": (CRANK + INPUT.replace("angle = 1", 'law = "binary.csv"'), "binary.csv: this is not text"),
    "a law beyond all measure": (CRANK + INPUT.replace("angle = 1", 'law = "far.csv"'), "column angle_deg: found .inf., expected a number"),
    "a law of rows at one instant": (
        CRANK + INPUT.replace("angle = 1", 'law = "close.csv"'),
        "too close in time",
    ),
    "a group without an unknown of its own": (
        """ground = { O = [0, 0] }
links = { sun = { points = { O = [0, 0], P = [60, 0] } }, arm = { points = { O = [0, 0], P = [60, 0] } }, \
planet = { points = { P = [0, 0], T = [40, 0] } } }
gears = [{ links = ["sun", "planet"], ratio = -0.5, arm = "arm" }, { links = ["planet", "ground"], ratio = 0.4, arm = "arm" }]
input = { link = "sun", angle = 0 }
guess = { at = 0 }
""",
        "it is a structure",
    ),
}  # fmt: skip
LAWS = {
    "binary.csv": b"\xff\xfe\x00\xd8\0",
    "far.csv": b"time_s,angle_deg\n0,0\n1,inf\n2,3\n3,4\n",
    "close.csv": b"time_s,angle_deg\n0,0\n1e-320,10\n1,20\n2,30\n3,10\n",
}


@pytest.mark.parametrize("name", MECHANISMS)
def test_mechanisms(name: str, dalembert: Dalembert, tmp_path: Path) -> None:
    text, message = MECHANISMS[name]
    (tmp_path / "m.toml").write_text(text)
    for file, data in LAWS.items():
        (tmp_path / file).write_bytes(data)
    done = dalembert("mechanism", "m.toml")
    assert (done.returncode, done.stdout) == (1, "")
    assert re.search(message, done.stderr), done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert len(done.stderr) < LONGEST + 100


def test_a_nested_body(dalembert: Dalembert) -> None:
    done = dalembert("spin", "-", stdin=f"inertia = {'[' * 3000}{']' * 3000}\n")
    assert done.returncode == 1
    assert "nested too deeply" in done.stderr


def test_what_a_file_holds_reaches_no_terminal(dalembert: Dalembert) -> None:
    text = CRANK + INPUT.replace('"crank"', '"\\u001b[31m\\u2028\\ufeffred"')
    done = dalembert("mechanism", "-", stdin=text)
    assert done.returncode == 1
    assert done.stderr.rstrip("\n").isprintable()
    assert r"\x1b[31m" in done.stderr
    # a warning too: of columns that are not known
    done = dalembert("body", "-", stdin="part,shape,mass_kg,\ufeffx\na,point,1,2\n")
    assert (done.returncode, r"'\ufeffx'" in done.stderr) == (0, True)


def test_a_message_keeps_its_ends(dalembert: Dalembert) -> None:
    done = dalembert("spin", "-", stdin=f"{'x' * 100_000} = 1\n")
    assert done.returncode == 1
    assert done.stderr.startswith("dalembert: standard input: unknown key 'xxx")
    assert "expected name, inertia, parts" in done.stderr
    assert len(done.stderr) < LONGEST + 100


def test_links_that_differ_beyond_all_numbers(dalembert: Dalembert, tmp_path: Path) -> None:
    """A link of 1e60 m is named, also where a second bar makes the mobility a matter of singular values."""
    dalembert("examples", "peaucellier")
    file = tmp_path / "peaucellier.toml"
    text = file.read_text()
    twice = "[links.ac_2]\npoints = { A = [0, 0], C = [1, 0] }\n"
    far = re.sub(r"(\[links\.ad\]\npoints = \{ A = \[0, 0\], D = \[)1", r"\g<1>1e60", text)
    assert far != text
    for more in ("", twice):
        file.write_text(far.replace("[input]", more + "[input]"))
        done = dalembert("mechanism", "peaucellier.toml")
        assert done.returncode == 1
        assert "1e+60 m too long" in done.stderr


LARGE = [
    ("mechanism", "klann.toml", "--over", "0deg:360deg/999999999", "--json"),
    ("mechanism", "klann.toml", "--over", "0deg:360deg/999999999", "--text"),
    ("mechanism", "klann.toml", "--over", "0deg:360deg/999999999", "--only", "H,G,F", "-o", "h.json"),
]


@pytest.mark.parametrize("arguments", LARGE)
def test_sweeps_that_do_not_fit(arguments: tuple[str, ...], dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "klann")
    done = dalembert(*arguments)
    assert (done.returncode, done.stdout) == (1, "")
    assert re.search(r"would take [\d.]+ GB: expected at most \d+ poses", done.stderr)
    assert not (tmp_path / "h.json").exists()


USAGE = {
    ("mechanism", "klann.toml", "--over", "0deg:360deg/" + "9" * 5000): "number of equal steps",
    ("mechanism", "klann.toml", "--over", "0deg:360deg:1e-30deg"): "3.6e+32 values: expected at most 1e+15",
    ("mechanism", "klann.toml", "--branch", "9" * 5000): "the number of an assembly",
    ("mechanism", "klann.toml", "--branch", "²"): "the number of an assembly",
    (
        "forces",
        "klann.toml",
        "--over",
        "0deg:9deg/3",
        "--counterweights",
        " ,",
    ): "expected names of links",
    ("spin", "b.toml", "--time", "0:1:1e-30"): "expected at most 250000",
    ("spin", "b.toml", "--time", "0:1/100000000"): "expected at most 250000",
    ("spin", "b.toml", "--time", "0:1/" + "9" * 5000): "number of equal steps",
    ("place", "5g@0deg", "--blades", "20000000"): "expected a number from",
    ("field", "r.csv", "--blades", "20000000"): "expected a number from",
    ("field", "r.csv", "--monte-carlo", "1000000000", "--reading-error", "2%"): "expected a number from",
}


@pytest.mark.parametrize("arguments", USAGE)
def test_counts_beyond_measure(arguments: tuple[str, ...], dalembert: Dalembert) -> None:
    dalembert("examples", "klann")
    done = dalembert(*arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert USAGE[arguments] in " ".join(done.stderr.split())


@pytest.mark.skipif(not hasattr(os, "wait4"), reason="the system does not tell a process's memory")
@pytest.mark.parametrize(
    "options",
    [["--json"], [], ["--only", "H", "--json"], ["--only", "H"]],
)
def test_a_sweep_takes_no_more_than_is_reckoned(
    options: list[str], dalembert: Dalembert, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reckoned bytes decide what is refused: they are held against those of the process."""
    dalembert("examples", "klann")
    peak = {}
    for n in (10, 5000):
        arguments = ["mechanism", "klann.toml", "--over", f"0deg:360deg/{n}", *options]
        process = subprocess.Popen([COMMAND, *arguments], cwd=tmp_path, stdout=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode == 0
        peak[n] = used.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    monkeypatch.chdir(tmp_path)
    m = load("klann.toml").mechanism
    names = ["H"] if "--only" in options else None
    _, moved = grids(m, None, ["0deg:360deg/5000"], None, {}, [])
    analysis = Analysis(Request("klann.toml", names, 2), m, of_one(m, moved))
    as_json = "--json" in options
    reckoned = analysis.bytes_each(json=as_json, table=not as_json, states=False) * 4990
    assert peak[5000] - peak[10] <= reckoned + 8e6  # what the allocator keeps


def test_json_in_parts_is_the_same_on_both_ways(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "klann")
    call = ("mechanism", "klann.toml", "--over", "0deg:360deg/20")
    assert dalembert(*call, "-o", "k.json").returncode == 0
    text = dalembert(*call, "--json").stdout
    assert text == (tmp_path / "k.json").read_text("utf-8")
    assert len(json.loads(text)["poses"]) == 21


def test_files_beside_a_result_wait_for_the_expected_values(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "fan-one-plane")
    call = ("field", "fan.csv", "--save-influence", "c.csv", "--report", "r.html")
    assert dalembert(*call, "--expect", "missing.csv").returncode == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["expected.csv", "fan.csv"]
    assert dalembert(*call, "--expect", "expected.csv").returncode == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["c.csv", "expected.csv", "fan.csv", "r.html"]


def test_an_integration_of_many_turns_is_for_those_who_ask_for_it(dalembert: Dalembert) -> None:
    body = "inertia = [1, 2, 2.5]\nomega = [23270, 2, 3]\ntorque = [0.1, 0, 0.2]\n"
    done = dalembert("spin", "-", "--at", "2", stdin=body)
    assert (done.returncode, done.stdout) == (1, "")
    assert "or --method integrate to wait for it" in done.stderr
    done = dalembert("spin", "-", "--at", "1e9", "--method", "integrate", stdin=body)
    assert (done.returncode, done.stdout) == (1, "")
    assert "expected a shorter time" in done.stderr
    top = "inertia = [1, 1, 2]\nomega = [1, 2, 1e9]\n[top]\nmgl = 3\n"
    done = dalembert(
        "spin", "-", "--at", "1e9", "--method", "integrate", "--integrator", "splitting", stdin=top
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert "expected a shorter time" in done.stderr


def test_a_radius_that_nothing_can_be_divided_by(dalembert: Dalembert) -> None:
    table = "mass_g,radius_mm,angle_deg,z_mm\n9,30,60,20\n"
    done = dalembert("balance", "-", "--plane", "A:1e-320mm", stdin=table)
    assert (done.returncode, "expected a positive radius" in done.stderr) == (2, True)
    done = dalembert("place", "5g@0deg", "--at-radius", "1m", "--to-radius", "1e-320mm")
    assert (done.returncode, "expected a positive value" in done.stderr) == (2, True)


def test_a_dyad_stretched_all_along(dalembert: Dalembert, tmp_path: Path) -> None:
    """Crank and arms turn about one point: rounding alone crosses zero, some hundred times a turn."""
    dalembert("examples", "peaucellier")
    file = tmp_path / "peaucellier.toml"
    text = file.read_text()
    moved = text.replace("points = { P = [0, 0], A = [1, 0] }", "points = { A = [1, 0], O = [0, 0] }")
    assert moved != text
    file.write_text(moved)
    done = dalembert("inspect", "peaucellier.toml", "--json")
    assert done.returncode in (0, 1)
    if done.returncode == 0:
        assert json.loads(done.stdout)["check"]["change_points_deg"] == []
    else:
        assert "cannot be assembled" in done.stderr


def test_a_dyad_between_points_that_coincide(dalembert: Dalembert) -> None:
    text = CRANK.replace("A = [0, 0]\n[links", "A = [0, 0]\nD = [4, 0]\n[links", 1) + INPUT
    dyad = "[links.rod]\npoints = { D = [0, 0], C = [4, 0] }\n[links.rocker]\npoints = { D = [0, 0], C = [3, 0] }\n"
    guess = "[guess]\nat = 1\nrod = 1\nrocker = 2\n"
    done = dalembert("inspect", "-", stdin=text + dyad + guess)
    assert done.returncode == 1


def test_many_stored_coefficients_are_looked_through_once(dalembert: Dalembert, tmp_path: Path) -> None:
    rows = "".join(f"1,{speed},A,2000,30\n" for speed in range(1000, 31_000))
    (tmp_path / "stored.csv").write_text("sensor,speed_rpm,plane,magnitude_per_kg,phase_deg\n" + rows)
    (tmp_path / "runs.csv").write_text("run,sensor,speed_rpm,amplitude_um,phase_deg\n0,1,3000,70,40\n")
    done = dalembert("field", "runs.csv", "--influence", "stored.csv", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["rotors"][0]["corrections"][0]["mass_kg"] == pytest.approx(70 / 2000)


def test_a_limit_of_pieces_that_is_none(dalembert: Dalembert) -> None:
    call = ("place", "83.5g@308.87deg", "--blades", "8", "--stock", "10g,20g,50g", "--max-pieces")
    assert dalembert(*call, "100000000000").stdout == dalembert(*call, "8").stdout


def test_a_large_table_is_read_without_a_word_of_its_reader(tmp_path: Path) -> None:
    rows = "".join(f"r{i},1.1,30,{i % 360}\n" for i in range(12_000))
    (tmp_path / "t.csv").write_text("rotor,mass_g,radius_mm,angle_deg\n" + rows)
    call = [sys.executable, "-W", "error", "-m", "cli", "balance", "t.csv", "--plane", "A:20mm"]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.count(b"\n") == 12_001


def test_a_tangent_where_nothing_is_assembled(dalembert: Dalembert, tmp_path: Path) -> None:
    """The sweep passes a change point of one group at which another is not assembled."""
    dalembert("examples", "peaucellier")
    file = tmp_path / "peaucellier.toml"
    text = file.read_text()
    moved = text.replace("points = { O = [0, 0], C = [2, 0] }", "points = { C = [2, 0], P = [0, 0] }")
    assert moved != text
    file.write_text(moved)
    done = dalembert("mechanism", "peaucellier.toml", "--over", "-90deg:90deg:90deg", "--only", "B")
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) == 4


def test_a_change_point_where_another_group_has_no_direction(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "scissors-lift")
    file = tmp_path / "lift.toml"
    text = file.read_text()
    moved = text.replace("A = [0, 0]", "A = [1, 0]", 1)
    assert moved != text
    file.write_text(moved)
    assert dalembert("mechanism", "lift.toml", "--over", "0.4m:1.15m:0.05m").returncode == 0


def test_a_picture_of_forces_where_nothing_is_assembled(dalembert: Dalembert, tmp_path: Path) -> None:
    assert dalembert("examples", "engine").returncode == 0
    file = tmp_path / "engine.toml"
    file.write_text(re.sub(r"^O = .*$", "O = [-415.7, 0]", file.read_text(), count=1, flags=re.MULTILINE))
    done = dalembert("forces", "engine.toml", "--over", "90deg:810deg:90deg", "--plot", "engine.png")
    assert done.returncode == 1
    assert "Warning" not in done.stderr
    assert "cannot be assembled" in done.stderr
