"""Many variants at once and in several processes: the rows of each described alone, whoever works them out."""

from __future__ import annotations

import json

import numpy as np
import pyarrow.parquet
import pytest

from cli.cases.analysis import Request
from cli.cases.axes import grids
from cli.cases.cases import Cases
from cli.cases.inputs import Grid, Varied
from cli.cases.loop import Loop, unchanged
from cli.mechanism.poses import Poses
from cli.show.commands import ShowOptions
from dalembert.errors import DataError
from tests.cli.rows import axis
from virtualwork import Mechanism
from virtualwork.describe.dimensions import dimensions

FOUR_BAR = """
name = "four-bar"
gravity = [0, -9.81]
ground = { A = [0, 0], D = [0.1, 0] }
input = { link = "crank", speed = 10 }
guess = { at = "40 deg", coupler = "20 deg", rocker = "57 deg" }
[links]
crank = { points = { A = [0, 0], B = [0.04, 0] }, mass = 0.5 }
coupler = { points = { B = [0, 0], C = [0.12, 0], H = [0.05, 0.03] }, mass = 0.25 }
rocker = { points = { D = [0, 0], C = [0.08, 0] } }
"""
PATHS = ("links.crank.B.x", "ground.D.x", "links.coupler.C.x")


@pytest.fixture
def table(tmp_path):
    """Write the four-bar and rows of a table of its variants: whole turns, limits, change points, out of reach."""
    rng = np.random.default_rng(3)
    rows = np.array([0.04, 0.1, 0.12]) + 0.03 * rng.normal(size=(40, 3))
    # a parallelogram, which goes through change points; one that no crank turns; one far out of reach
    rows[7], rows[20], rows[33] = (0.08, 0.12, 0.12), (0.1, 0.1, 0.12), (0.04, 0.5, 0.12)
    (tmp_path / "m.toml").write_text(FOUR_BAR)

    def write(name, low, high):
        head = ",".join(f"{path}_m" for path in PATHS)
        lines = [",".join(map(repr, row)) for row in rows[low:high].tolist()]
        (tmp_path / name).write_text("\n".join([head, *lines]) + "\n")
        return name

    return write


def test_remarks_are_those_of_each_described_alone(dalembert, table):
    call = ("mechanism", "m.toml", "--over", "0deg:360deg:24deg", "--only", "H", "--cases")
    many = dalembert(*call, table("all.csv", 0, 40)).stderr.splitlines()
    few = dalembert(*call, table("few.csv", 0, 31)).stderr.splitlines()
    assert len(few) == len(many) == 11
    assert many[:10] == few[:10]
    assert "cannot be assembled" in many[0]
    further = [int(lines[10].split()[1]) for lines in (few, many)]
    assert 0 < further[0] < further[1]


@pytest.mark.parametrize("asked", [("mechanism", "--only", "H"), ("forces",)])
def test_no_byte_hangs_on_the_number_of_workers(dalembert, table, tmp_path, asked):
    call = (
        asked[0],
        "m.toml",
        "--over",
        "0deg:360deg:24deg",
        *asked[1:],
        "--cases",
        table("v.csv", 0, 40),
    )
    alone = dalembert(*call, "-o", "alone.csv")
    for form in ("csv", "parquet"):
        shared = dalembert(*call, "--workers", "2", "-o", f"shared.{form}")
        assert shared.returncode == alone.returncode == 0
        assert shared.stderr == alone.stderr
    assert (tmp_path / "shared.csv").read_bytes() == (tmp_path / "alone.csv").read_bytes()


@pytest.mark.slow
def test_no_digit_hangs_on_what_a_process_has_done_before(dalembert, tmp_path):
    # work that pays for compiled code, but no part of it does; where there is none all is numpy's
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    vary = (
        "--over",
        f"links.crank.B.x=0.035:0.045/{182 * 48 - 1}",
        "--over",
        "0deg:359deg:1deg",
        "--only",
        "H",
    )
    written = []
    for options in (("-o", "one.parquet"), ("--workers", "2", "-o", "two.parquet")):
        done = dalembert("mechanism", "m.toml", *vary, *options)
        assert (done.returncode, done.stderr) == (0, "")
        written.append(pyarrow.parquet.read_table(tmp_path / options[-1], columns=["H_x_m", "H_vy_m_s"]))
    assert written[0].num_rows == 182 * 48 * 360
    assert written[0].equals(written[1])


@pytest.mark.slow
def test_workers_write_one_file_of_parquet(dalembert, tmp_path):
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    # 4000 variants in 37 poses are three parts
    vary = ("--over", "links.crank.B.x=0.035:0.045/3999", "--over", "0deg:360deg:10deg", "--only", "C")
    for options in (("-o", "one.parquet"), ("--workers", "2", "-o", "two.parquet")):
        done = dalembert("mechanism", "m.toml", *vary, "--units", "mm,deg", *options)
        assert (done.returncode, done.stderr) == (0, "")
    one, two = (pyarrow.parquet.ParquetFile(tmp_path / f"{name}.parquet") for name in ("one", "two"))
    assert one.num_row_groups == two.num_row_groups == 3
    assert one.metadata.num_rows == 4000 * 37
    assert "C_x_mm" in one.schema_arrow.names
    assert one.read().equals(two.read())
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.toml", "one.parquet", "two.parquet"]


@pytest.mark.slow
def test_json_of_several_workers_is_that_of_one(dalembert, table, tmp_path):
    call = ("mechanism", "m.toml", "--over", "0deg:720deg:6deg", "--json", "--cases")
    # 121 poses each: a part holds 33 of the variants
    alone, shared = (dalembert(*call, table("v.csv", 0, 40), *more) for more in ((), ("--workers", "2")))
    assert shared.stdout == alone.stdout
    assert [v["variant"] for v in json.loads(shared.stdout)["variants"]] == [str(i) for i in range(1, 41)]
    words = [word for word in call if word != "--json"]
    written = dalembert(*words, "v.csv", "-o", "v.json")
    assert written.stderr == alone.stderr
    assert (tmp_path / "v.json").read_text() == alone.stdout


class Sent:
    """What becomes of an expression that is sent to a worker in the place of a form."""

    def __init__(self, text):
        self.text = text

    def __reduce__(self):
        return eval, (self.text,)


def question(v):
    """Variants of the four-bar at one pose, one by one, as with --branch."""
    m = Mechanism.from_toml_text(FOUR_BAR)
    varied = Grid((axis([Varied(dimensions(m)["ground.D.x"])], np.linspace(0.1, 0.11, v)[:, None]),))
    _, moved = grids(m, ["40deg"], None, None, {}, [])
    cases = Cases(Request("m.toml", order=0, branch="1"), m, {}, varied, moved)
    return Loop(Poses(cases, ShowOptions()), 2)


@pytest.mark.slow
def test_a_part_whose_worker_died_is_done_again(tmp_path):
    flag = tmp_path / "died"
    dies_once = f"(p := __import__('pathlib').Path({str(flag)!r})).exists() or (p.touch(), __import__('os')._exit(1)) and None"
    form = Sent(f"(None, {dies_once}, __import__('cli.cases.loop', fromlist=['unchanged']).unchanged)[2]")
    found = [row for part in question(130).blocks(form) for row in part.data.columns[0].values]
    assert flag.exists()
    expected = [row for part in question(130).blocks(unchanged) for row in part.data.columns[0].values]
    assert found == expected
    assert len(set(found)) == 130


@pytest.mark.slow
def test_variants_that_kill_their_worker_twice_are_named():
    with pytest.raises(DataError, match="variants 1 to 64: the process that solved them died"):
        list(question(130).blocks(Sent("__import__('os')._exit(1)")))
