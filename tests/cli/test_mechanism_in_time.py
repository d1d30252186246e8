"""`dalembert mechanism --time`: what it shows, in every form, and what it refuses."""

from __future__ import annotations

import csv
import io
import json
import math
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import Dalembert

PENDULUM = """
name = "Pendulum"
gravity = [0, -9.81]
[units]
angle = "deg"
[ground]
O = [0, 0]
[links.bob]
points = { O = [0, 0], P = [1, 0] }
mass = 1
center = [1, 0]
[input]
link = "bob"
angle = 0
speed = 0
"""


@pytest.fixture
def pendulum(tmp_path: Path) -> Path:
    path = tmp_path / "pendulum.toml"
    path.write_text(PENDULUM)
    return path


def test_json_has_what_is_promised(dalembert: Dalembert, pendulum: Path) -> None:
    done = dalembert("simulate", str(pendulum), "--time", "0:1:0.5", "--only", "P,bob", "--forces", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert [row["t_s"] for row in found["time"]] == [0, 0.5, 1]
    last = found["time"][-1]
    # of IFToMM benchmark A01: (−0.98629175, −0.16501085) m
    assert last["inputs"]["bob"]["angle_deg"] == pytest.approx(math.degrees(-2.975823638319696), abs=1e-6)
    assert set(last["inputs"]["bob"]) == {
        "angle_deg",
        "speed_rad_s",
        "acceleration_rad_s2",
        "error_estimate_deg",
    }
    assert last["energy_J"] == pytest.approx(0, abs=1e-9)
    assert last["points"]["P"]["x_m"] == pytest.approx(math.cos(-2.975823638319696), abs=1e-8)
    assert last["links"]["bob"]["angle_deg"] == last["inputs"]["bob"]["angle_deg"]
    (reaction,) = last["reactions"]
    # a point on a bar: its tension alone, 3 m g sin θ downwards from the horizontal start
    assert math.hypot(reaction["fx_N"], reaction["fy_N"]) == pytest.approx(
        3 * 9.81 * math.sin(2.975823638319696), rel=1e-7
    )
    assert abs(found["energy_drift_J"]) < 1e-8
    assert found["warnings"] == []


def test_csv_and_the_event(dalembert: Dalembert, pendulum: Path) -> None:
    done = dalembert("simulate", str(pendulum), "--time", "0:10:0.25", "--until", "bob=-90")
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    assert list(rows[0]) == [
        "t_s", "input_deg", "input_speed_rad_s", "input_acceleration_rad_s2", "input_error_estimate_deg", "energy_J"
    ]  # fmt: skip
    assert float(rows[-1]["input_deg"]) == pytest.approx(-90, abs=1e-12)
    assert float(rows[-1]["t_s"]) == pytest.approx(1.8540746773013719 / math.sqrt(9.81), abs=1e-9)
    assert len(rows) == 4


def test_digits_are_those_of_the_estimate(dalembert: Dalembert, pendulum: Path) -> None:
    done = dalembert("simulate", str(pendulum), "--time", "0:1:1", "--accuracy", "1e-4", "--digits")
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    printed = rows[-1]["input_deg"]
    assert 10 < len(printed.lstrip("-")) < 14
    # all digits hold but half a unit of the last
    last = 10.0 ** -len(printed.partition(".")[2])
    assert float(printed) == pytest.approx(math.degrees(-2.975823638319696), abs=0.51 * last, rel=0)


def test_a_picture(dalembert: Dalembert, pendulum: Path, tmp_path: Path) -> None:
    done = dalembert(
        "simulate", str(pendulum), "--time", "0:1:0.1", "--plot", str(tmp_path / "p.svg"), "--text"
    )
    assert done.returncode == 0, done.stderr
    assert "explicit Runge-Kutta method of order 8" in done.stdout
    assert "mechanism at" in (tmp_path / "p.svg").read_text() or (tmp_path / "p.svg").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (("--time", "0:1"), 2, "START:STOP:STEP"),
        (("--time", "1:0:-0.1"), 2, "rising"),
        (("--time", "0:1:0.1", "--accuracy", "fine"), 2, "--accuracy"),
        (("--time", "0:1:0.1", "--until", "bab=3"), 2, "no input drives 'bab'"),
        (("--time", "0:1:0.1", "--until", "bob=3", "--until", "bob=4"), 2, "bob is given twice"),
        (("--time", "0:1:0.1", "--check"), 2, "--check is now dalembert inspect"),
        (("--until", "bob=3"), 2, "such as --time 0:10:0.01"),
        (("--time", "0:1:0.1", "--only", "Q"), 2, "no link or point is named 'Q'"),
        (("--time", "0:1:0.1", "--only", "bob.torque"), 2, "dalembert simulate with --forces"),
        (
            ("--time", "0:1:1", "--only", "bob.torque", "--forces"),
            0,
            "--only bob.torque: a released input has no effort",
        ),
        (("--time", "0:1:0.1", "--set", "links.bob.mass=0"), 1, "no mass moves with input 'bob'"),
    ],
)
def test_what_is_refused_or_left_out(
    dalembert: Dalembert, pendulum: Path, words: tuple[str, ...], status: int, said: str
) -> None:
    done = dalembert("simulate", str(pendulum), *words)
    assert done.returncode == status
    assert said in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr


def test_a_torque_over_time_is_refused_in_a_pose(dalembert: Dalembert, pendulum: Path) -> None:
    pendulum.write_text(PENDULUM + '[[torques]]\nlink = "bob"\ntorque = "t.csv"\n')
    pendulum.with_name("t.csv").write_text("t_s,torque_N_m\n0,1\n2,1\n")
    done = dalembert("forces", str(pendulum), "--at", "30deg")
    assert done.returncode == 1
    assert "it acts in a simulation only" in done.stderr
    assert dalembert("simulate", str(pendulum), "--time", "0:1:1").returncode == 0


def test_variants_are_released_together(dalembert: Dalembert, pendulum: Path) -> None:
    """Rows begin with the variant; each is what the file with that number gives."""
    vary = "--over", "links.bob.P.x=1:2:1", "--set", "links.bob.center.x=0.5"
    done = dalembert("simulate", pendulum, "--time", "0:1:0.5", *vary)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    assert [row["variant"] for row in rows] == ["1"] * 3 + ["2"] * 3
    one = dalembert("simulate", pendulum, "--time", "0:1:0.5", *vary[2:], "--set", "links.bob.P.x=2")
    alone = list(csv.DictReader(io.StringIO(one.stdout)))
    for row, own in zip(rows[3:], alone, strict=True):
        assert float(row["links.bob.P.x_m"]) == 2
        assert math.isclose(float(row["input_deg"]), float(own["input_deg"]), abs_tol=1e-9)
        assert math.isclose(float(row["energy_J"]), float(own["energy_J"]), abs_tol=1e-9)


def test_variants_with_an_end_and_points_in_json(dalembert: Dalembert, pendulum: Path) -> None:
    more = "--over", "links.bob.mass=0:1:1", "--until", "bob=-90deg", "--only", "P", "--json"
    done = dalembert("simulate", pendulum, "--time", "0:2:1", *more)
    assert done.returncode == 0, done.stderr
    none, one = json.loads(done.stdout)["variants"]
    assert none["time"] == []
    assert none["energy_drift_J"] is None
    assert one["set"] == {"links.bob.mass_kg": 1.0}
    assert math.isclose(one["time"][-1]["inputs"]["bob"]["angle_deg"], -90)
    assert math.isclose(one["time"][-1]["points"]["P"]["y_m"], -1)
    assert "variant 1: no mass moves with input 'bob'" in done.stderr


@pytest.mark.slow
def test_variants_by_several_processes_give_the_same_bytes(
    dalembert: Dalembert, pendulum: Path, tmp_path: Path
) -> None:
    """In parts of fixed size: as CSV, each variant to its own event, and as Parquet."""
    vary = "--over", "links.bob.center.x=0.5:2:0.00125", "--time", "0:1:1"
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    for path, workers in ((one, "1"), (two, "2")):
        done = dalembert("simulate", pendulum, *vary, "--until", "bob=-90", "--workers", workers, "-o", path)
        assert done.returncode == 0, done.stderr
    assert one.read_bytes() == two.read_bytes()
    rows = list(csv.DictReader(io.StringIO(one.read_text())))
    assert len(rows) == 2 * 1201
    for row in (rows[1], rows[1001], rows[2401]):
        quarter = 1.854074677301371918 * math.sqrt(float(row["links.bob.center.x_m"]) / 9.81)
        assert float(row["t_s"]) == pytest.approx(quarter, abs=1e-9)
    parquet = pytest.importorskip("pyarrow.parquet")
    file = tmp_path / "variants.parquet"
    done = dalembert("simulate", pendulum, *vary, "--workers", "2", "-o", file)
    assert done.returncode == 0, done.stderr
    assert parquet.read_table(file).num_rows == 2 * 1201
    assert parquet.ParquetFile(file).num_row_groups == 3


@pytest.mark.slow
def test_digits_of_variants_one_by_one_and_by_processes(dalembert: Dalembert, pendulum: Path) -> None:
    more = (
        "--time",
        "0:1:1",
        "--accuracy",
        "1e-5",
        "--over",
        "links.bob.mass=0:9:1",
        "--digits",
        "--only",
        "P",
    )
    done = dalembert("simulate", pendulum, *more)
    assert done.returncode == 0, done.stderr
    assert dalembert("simulate", pendulum, *more, "--workers", "2").stdout == done.stdout
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    assert len(rows) == 1 + 2 * 9
    assert rows[0]["P_x_m"] == rows[0]["t_s"] == ""
    assert all(len(row["P_x_m"].lstrip("-")) < 13 for row in rows[2::2])
    assert all(float(row["P_x_m"]) == pytest.approx(-0.98629175, abs=1e-5) for row in rows[2::2])
    assert "variant 1: no mass moves with input 'bob'" in done.stderr


def test_a_page_of_variants_in_time(dalembert: Dalembert, pendulum: Path, tmp_path: Path) -> None:
    page = tmp_path / "variants.html"
    vary = "--time", "0:1:0.1", "--over", "links.bob.mass=0:2:1", "--over", "input.speed=0:1:1"
    done = dalembert("simulate", pendulum, *vary, "--page", page)
    assert done.returncode == 0, done.stderr
    text = page.read_text()
    assert "variant 3" in text
    assert "variant 6" in text
    assert "variant 1" not in text
    done = dalembert("simulate", pendulum, *vary, "--page", page, "--until", "bob=-90")
    assert done.returncode == 2
    assert "shows all variants at the same time" in " ".join(done.stderr.split())


def test_the_first_row_is_as_it_was_given(dalembert: Dalembert, pendulum: Path) -> None:
    """60° is 59.99999999999999° on the way through radians and back."""
    pendulum.write_text(PENDULUM.replace("angle = 0", "angle = 60"))
    done = dalembert("simulate", pendulum, "--time", "0:1:1", "--only", "bob")
    first = next(csv.DictReader(io.StringIO(done.stdout)))
    assert (first["input_deg"], first["bob_angle_deg"]) == ("60.0", "60.0")
    done = dalembert("simulate", pendulum, "--time", "0:1:1", "--over", "input.angle=60:61:1", "--json")
    shown = [of["time"][0]["inputs"]["bob"]["angle_deg"] for of in json.loads(done.stdout)["variants"]]
    assert shown == [60.0, 61.0]


# a double pendulum released above: no motion keeps a digit for a minute
CHAOS = (
    PENDULUM.replace("[input]", "[[input]]").replace("angle = 0", "angle = 115")
    + """
[links.lower]
points = { P = [0, 0], Q = [1, 0] }
mass = 1
center = [1, 0]
[[input]]
link = "lower"
angle = 145
speed = 0
"""
)


@pytest.mark.parametrize("more", [(), ("--digits",), ("--over", "input.1.speed=0:0:1")])
def test_where_no_digit_is_known_cells_are_empty_with_one_warning(
    dalembert: Dalembert, pendulum: Path, more: tuple[str, ...]
) -> None:
    pendulum.write_text(CHAOS)
    done = dalembert("simulate", pendulum, "--time", "0:60:12", "--only", "Q", *more)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    lost = [name for name, cell in rows[-1].items() if not cell]
    assert {"upper" in name or "lower" in name or name.startswith(("bob", "Q")) for name in lost} == {True}
    assert len(lost) == 2 * 3 + 6
    # the energy is known as long as it is kept
    assert float(rows[-1]["energy_J"]) == pytest.approx(float(rows[0]["energy_J"]), abs=1e-6)
    assert rows[-1]["lower_input_error_estimate_deg"] == "inf"
    assert 0 < float(rows[1]["lower_input_error_estimate_deg"]) < 1
    assert all(rows[1].values())
    (line,) = done.stderr.splitlines()
    assert "no digit holds from" in line
    if not more:
        done = dalembert("simulate", pendulum, "--time", "0:60:12", "--json")
        found = json.loads(done.stdout)
        assert found["time"][-1]["inputs"]["lower"]["angle_deg"] is None
        assert found["time"][-1]["inputs"]["lower"]["error_estimate_deg"] is None
        assert len(found["warnings"]) == 1


def test_json_with_forces_has_points_and_links_too(dalembert: Dalembert, pendulum: Path) -> None:
    """INTERFACE: points, links, and reactions with --forces; alone, and of variants; `--only` leaves out the others."""

    def rows(*more: str) -> list[dict[str, Any]]:
        done = dalembert("simulate", str(pendulum), "--time", "0:1:0.5", "--forces", "--json", *more)
        assert done.returncode == 0, done.stderr
        document = json.loads(done.stdout)
        found: list[dict[str, Any]] = (
            document["variants"][0]["time"] if "variants" in document else document["time"]
        )
        return found

    alone, named, varied = rows(), rows("--only", "P,bob"), rows("--set", "links.bob.mass=1")
    for row in alone:
        del row["points"]["O"]
    assert alone == named
    assert alone[-1]["points"]["P"]["ay_m_s2"] == named[-1]["points"]["P"]["ay_m_s2"]
    assert alone[-1]["reactions"]
    assert varied[-1]["points"]["P"]["x_m"] == pytest.approx(alone[-1]["points"]["P"]["x_m"], abs=1e-8)
    only = rows("--only", "bob")[-1]
    assert "bob" in only["links"]
    assert "P" not in only.get("points", {})


def test_a_workbook_has_the_word_for_an_infinite_error(dalembert: Dalembert, pendulum: Path) -> None:
    """It has no number for it: Excel would call the file damaged."""
    from openpyxl import load_workbook

    pendulum.write_text(CHAOS)
    done = dalembert("simulate", pendulum, "--time", "0:60:30", "--only", "Q", "-o", "c.xlsx", "--json")
    assert done.returncode == 0, done.stderr
    (head, *_, last) = load_workbook(pendulum.parent / "c.xlsx").worksheets[0].iter_rows()
    (cell,) = (c for h, c in zip(head, last, strict=True) if h.value == "lower_input_error_estimate_deg")
    assert (cell.value, cell.data_type) == ("inf", "s")
    assert json.loads(done.stdout)["time"][-1]["inputs"]["lower"]["error_estimate_deg"] is None
