"""`--html` of examples, variants, rotations, motions under forces and notebooks, in a real browser; what is refused."""

from __future__ import annotations

import csv
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.pages import EVIL, FOUR_BAR, Opened
from tests.conftest import Dalembert
from tests.four_bars import body, four_bar
from virtualwork import Mechanism


@pytest.mark.slow
def test_a_six_bar_takes_less_than_250_kB(dalembert: Dalembert, tmp_path: Path) -> None:
    """The Klann leg with masses, velocities, accelerations and all joint forces."""
    text = (files("cli.examples") / "klann" / "klann.toml").read_text()
    heavy = text.replace("points = {", "mass = 0.7\ncenter = [80, 5]\ninertia = 0.01\npoints = {") + "\n"
    (tmp_path / "m.toml").write_text("gravity = [0, -9.81]\n" + heavy)
    options = ("--over", "0deg:360deg:1deg", "--set", "input.acceleration=0")
    done = dalembert("forces", "m.toml", *options, "--page", "m.html")
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "m.html").read_text()
    assert "const tapes = {" in page
    assert len(page.encode()) <= 250_000


@pytest.mark.slow
def test_variants_are_ghosts_over_the_first(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """Cranks of 40, 35 and 30 mm; with 500 mm it cannot be put together."""
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    (tmp_path / "v.csv").write_text("links.crank.B.x_mm\n40\n35\n30\n500\n")
    done = dalembert(
        "mechanism", "m.toml", "--over", "0:90:1", "--cases", "v.csv", "--page", "m.html", "-o", "m.csv"
    )
    assert done.returncode == 0, done.stderr
    opened = Opened(browser, tmp_path / "m.html")
    opened.set(40)
    (full,) = opened.paths("#view g:not(.ghost) > g > .link.b0")
    ghosts = opened.paths("#view .ghost .link.b0")
    lengths = [float(np.hypot(*(p[1] - p[0]))) for p in (full, *ghosts)]
    assert [40 * length / lengths[0] for length in lengths] == pytest.approx([40, 35, 30], rel=1e-3)
    assert opened.text("legend").startswith("in full: variant 1; faint: variant 2; variant 3")
    # the plot shows them too
    assert len(opened.paths(".plot:first-child .curve.ghost")) == len(ghosts)
    assert opened.faults() == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "file", "options"),
    [
        ("engine", "engine", ("--over", "90deg:810deg:6deg", "--units", "mm,rad")),
        ("planetary-gear", "planetary", ("--over", "0deg:2160deg:60deg")),
        ("quick-return", "quick-return", ("--over", "0deg:360deg:5deg", "--order", "position")),
        ("five-bar", "five-bar", ("--cases", "five-bar/inputs.csv")),
        ("desk-lamp", "lamp", ()),
        # heights that rounding alone changes have an axis too
        ("scissors-lift", "lift", ("--over", "0.3m:0.5m:0.004m")),
        ("peaucellier", "peaucellier", ("--over", "-40deg:40deg:5deg")),
        ("parallelogram", "parallelogram", ("--over", "0deg:360deg:5deg", "--branch", "all")),
    ],
)
def test_examples_open_without_a_fault(
    example: str, file: str, options: tuple[str, ...], dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    folder = Path(str(files("cli.examples")))
    options = tuple(str(folder / word) if word.endswith(".csv") else word for word in options)
    command = "forces" if example == "engine" else "mechanism"
    done = dalembert(command, folder / example / f"{file}.toml", *options, "--page", "m.html")
    assert done.returncode == 0, done.stderr
    opened = Opened(browser, tmp_path / "m.html")
    for key in ["v", "a", "f", "i", "p", "End"]:
        opened.press(key)
    assert opened.faults() == []
    assert "NaN" not in opened("return document.querySelector('#view svg').outerHTML")
    poses = int(opened("return document.getElementById('slider').max"))
    for pose in range(0, poses + 1, max(1, poses // 9)):
        opened.set(pose)
        assert opened.names_in_one_place() == []
    opened.press("End")
    motion = Mechanism.from_toml(str(folder / example / f"{file}.toml")).motion
    last = opened.table("Points")
    if "mm,rad" in options:
        # the crank of 45 mm at 810°: straight up, in the unit that was asked for
        assert list(map(float, last["A"][:2])) == pytest.approx([0, 45], abs=1e-9)
    if example == "quick-return":
        # without speeds the centres are still known, from velocities for a unit of the input
        assert opened.table("Instant centres")["ground / link4"] == ["∞", "∞"]
        opened.set(20)
        centre = list(map(float, opened.table("Instant centres")["ground / link4"]))
        point = motion(np.radians(100)).point("E")
        # E moves along the vertical slot: the centre lies on its height
        assert centre[1] == pytest.approx(point.position[0, 1], rel=1e-5)


@pytest.mark.slow
def test_spin(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    (tmp_path / "body.toml").write_text(
        f"name = '{EVIL}'\ninertia = [1, 2, 3]\nomega = [0.01, 1, 0.01]\nattitude = [0.8, 0.6, 0, 0]\n"
    )
    done = dalembert("spin", "body.toml", "--time", "0:20:0.1", "--page", "body.html")
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader(done.stdout.splitlines()))
    opened = Opened(browser, tmp_path / "body.html")
    faces = opened.paths("#view .face")
    for i in (0, 99, 200):
        opened.set(i)
        shown = opened.table("Angular velocity, body axes") | opened.table(
            "Attitude [w, x, y, z], body to space"
        )
        assert {name: cell for name, (cell,) in shown.items()} == {
            name: value for name, value in rows[i].items() if name.startswith(("omega", "attitude"))
        }
    assert not np.allclose(faces[0], opened.paths("#view .face")[0], atol=2)
    # H is constant in space: its arrow does not move
    arrows = []
    for i in (0, 150):
        opened.set(i)
        arrows.append(opened.paths("#view .force")[0])
    assert arrows[0] == pytest.approx(arrows[1], abs=0.05)
    assert opened("return window.broken ?? null") is None
    assert opened.text("pose").startswith("t_s 15 ")
    assert opened.faults() == []


@pytest.mark.slow
def test_a_notebook_shows_the_same_page_in_a_frame(tmp_path: Path, browser: Any) -> None:
    motion = Mechanism.from_toml_text(FOUR_BAR).motion(np.linspace(0, 2 * np.pi, 37), speed=10.0)
    (tmp_path / "cell.html").write_text(
        f"<!doctype html><title>x</title>{motion.animate(forces=True)._repr_html_()}"
    )
    opened = Opened(browser, tmp_path / "cell.html")
    frame = browser.find_element("tag name", "iframe")
    browser.switch_to.frame(frame)
    try:
        opened.set(20)
        expected = [repr(float(x)) for x in motion.point("C").position[20]]
        assert opened.table("Points")["C"][:2] == expected
        assert len(opened.table("Joint forces")) == 4
    finally:
        browser.switch_to.default_content()
    assert opened.faults() == []


def test_a_page_of_too_few_states_says_so(dalembert: Dalembert, tmp_path: Path) -> None:
    """1 rad/s over steps of 2 s is 115° from pose to pose; π/12 rad a step take 0.3 s."""
    (tmp_path / "body.toml").write_text("inertia = [1, 2, 3]\nomega = [0, 1, 0]\n")
    for step, said in (
        (
            2,
            "warning: --page: the body turns up to 115 deg from one pose to the next: with steps of 0.3 s it turns smoothly\n",
        ),
        (0.25, ""),
    ):
        done = dalembert("spin", "body.toml", "--time", f"0:20:{step}", "--page", "b.html")
        assert done.returncode == 0
        assert done.stderr == said


LET_GO = four_bar(
    body(1, (50, 0), 0.001),
    body(2, (175, 0), 0.02),
    body(1.5, (125, 0), 0.008),
    lengths=(100, 350, 250, 400),
    head='name = "released"\ngravity = [0, -9.81]',
    driven="rocker",
    at=99,
    rates="speed = 5",
    guess={"coupler": 27, "crank": 60},
)


@pytest.mark.slow
def test_a_motion_under_forces_moves_by_its_own_time(
    dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    """The rocker drives the crank through dead points, where the run goes on in another coordinate."""
    (tmp_path / "m.toml").write_text(LET_GO)
    names = ("A", "D", "B", "C", "crank", "coupler", "rocker")
    call = ("m.toml", "--time", "0.5:2.5:0.01", "--forces", "--only")
    done = dalembert("simulate", *call, "B", "--page", "m.html")
    assert done.returncode == 0, done.stderr
    every = dalembert("simulate", *call, ",".join(names))
    rows = list(csv.DictReader(every.stdout.splitlines()))
    assert len(rows) == 201
    turned = [float(row["crank_angle_deg"]) for row in rows]
    assert turned[-1] - turned[0] > 720
    opened = Opened(browser, tmp_path / "m.html")
    listed = set(
        opened("return [...document.querySelector('.plot select').options].map((o) => o.textContent)")
    )
    assert listed == set(rows[0])
    for i in (0, 60, 137, 200):
        opened.set(i)
        row = rows[i]
        # the run that the page shows was made for other names: it agrees to rounding
        for name, cells in opened.table("Points").items():
            expected = [float(row[f"{name}_{axis}_m"]) for axis in "xy"]
            assert list(map(float, cells[:2])) == pytest.approx(expected, rel=1e-9)
        links = opened.table("Links")
        assert set(links) == {"crank", "coupler", "rocker"}
        for name, (angle, omega, alpha) in links.items():
            assert float(angle) == pytest.approx(float(row[f"{name}_angle_deg"]), rel=1e-9)
            assert float(omega) == pytest.approx(float(row[f"{name}_omega_rad_s"]), rel=1e-5)
            assert float(alpha) == pytest.approx(float(row[f"{name}_alpha_rad_s2"]), rel=1e-5)
        forces = opened.table("Joint forces")
        assert len(forces) == 4
        for name, cells in forces.items():
            joint, of, on = re.fullmatch(r"(.*): (.*) on (.*)", name).groups()  # type: ignore[union-attr]
            expected = [float(row[f"{joint}_{of}_on_{on}_f{axis}_N"]) for axis in "xy"]
            assert list(map(float, cells)) == pytest.approx(expected, rel=1e-5)
        # drawn where the table says: the crank's two ends, 100 mm apart at its angle
        crank, _, rocker = opened.paths("#view .link")
        assert np.hypot(*np.diff(rocker, axis=0)[0]) / np.hypot(*np.diff(crank, axis=0)[0]) == pytest.approx(
            2.5, rel=0.01
        )
        drawn = np.degrees(np.arctan2(crank[0, 1] - crank[1, 1], crank[1, 0] - crank[0, 0]))
        assert (drawn - turned[i] + 180) % 360 - 180 == pytest.approx(0, abs=0.5)
    # frames by hand, 120 ms apart: as many seconds of the motion go by, at the speed chosen, and after 2 s it begins anew
    opened.set(0)
    opened("window.requestAnimationFrame = (f) => (window.due = f); document.getElementById('play').click()")
    opened("due(1000)")
    speed = {"1/2": 0.5}[opened("return document.getElementById('speed').selectedOptions[0].textContent")]
    for frame in range(1, 41):
        opened("due(arguments[0])", 1000 + 120 * frame)
        told = float(re.match(r"t_s ([\d.]+),", opened.text("pose"))[1])  # type: ignore[index]
        assert told == pytest.approx(0.5 + 0.12 * frame * speed % 2, abs=0.0051)
    assert opened.faults() == []


def test_bad_use_is_refused(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    (tmp_path / "body.toml").write_text("inertia = [1, 2, 3]\nomega = [0, 1, 0]\n")
    for arguments, said in (
        (("mechanism", "m.toml", "--page", "m.pdf"), "'m.pdf' has no known suffix: expected .html"),
        (
            ("mechanism", "m.toml", "--over", "0:360:0.01", "--page", "m.html"),
            "36001 poses: expected at most 20000",
        ),
        (
            ("spin", "body.toml", "--time", "0:30000:1", "--page", "b.html"),
            "30001 poses: expected at most 20000",
        ),
        (
            ("simulate", "m.toml", "--time", "0:30:0.001", "--page", "m.html"),
            "30001 poses: expected at most 20000",
        ),
    ):
        done = dalembert(*arguments)
        assert done.returncode == 2
        assert said in " ".join(done.stderr.split())
        assert not list(tmp_path.glob("*.html"))
