"""The largest pages that compute: at most 250 kB; hatching, teeth and profiles stand in them once, and are the program's."""

from __future__ import annotations

import json
import math
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dalembert.arithmetic.exact import EPS
from tests.computed_pages import machines
from tests.node import needs_node
from tests.stress.test_pages_agree import faults, tried
from tests.virtualwork.test_cams import CASES, FACES, sliding, swinging
from virtualwork import Mechanism
from virtualwork.describe import DescriptionError
from virtualwork.describe.dimensions import changed, dimensions, value
from virtualwork.drawing import Row, draw
from virtualwork.formulas.lifts import located
from virtualwork.formulas.numbers import ONE
from virtualwork.formulas.profiles import STEPS, counts
from virtualwork.formulas.touches import carried
from virtualwork.motion import Motion
from virtualwork.picture.paper import travel_of

LARGEST = 250_000


def example(name: str) -> Mechanism:
    return Mechanism.from_toml(str(files("cli") / "examples" / f"{name}.toml"))


@pytest.mark.parametrize(
    "name", ["rack-lift/rack-lift", "cam-valve/cam-valve", "andrews/andrews", "jansen/jansen"]
)
def test_the_largest_examples(name: str) -> None:
    m = example(name)
    page = Motion(m.assembly, m.at + np.linspace(0, 2 * np.pi, 361), 3.0, 1.5).page(True).html
    assert "const tapes" in page
    assert len(page.encode()) <= LARGEST


def test_a_longer_rack_has_the_same_size() -> None:
    """Twice as far, twice the hatching: on the page it is one stroke and how many."""
    m = example("rack-lift/rack-lift")
    sizes, strokes = [], []
    for turns in (1, 2):
        motion = Motion(m.assembly, m.at + np.linspace(0, 2 * np.pi * turns, 361), 3.0, 1.5)
        page = motion.page(True).html
        sizes.append(len(page.encode()))
        data = re.search(r'id="data">(.*?)</script>', page, re.DOTALL)
        assert data is not None
        shapes = json.loads(data[1])["series"][0]["shapes"]
        strokes.append(sum(shape.get("n", 0) for shape in shapes))
        assert strokes[-1] > 100
    assert strokes[1] > 1.5 * strokes[0]
    assert abs(sizes[1] - sizes[0]) < 1000


def test_the_lines_of_a_row() -> None:
    """Strokes on their own, teeth in one line: each is the first, moved by whole steps."""
    drawing = draw(example("rack-lift/rack-lift"))
    rows = [part for part in drawing.parts if isinstance(part, Row)]
    assert {row.role for row in rows} == {"hatch", "rack"}
    for row in rows:
        lines = row.lines()
        assert len(lines) == (1 if row.joined else row.count)
        points = np.array([z for line in lines for z in line.points]).reshape(row.count, -1)
        steps = np.diff(points, axis=0)
        assert np.allclose(steps, row.step, rtol=1e-9, atol=0)
    assert [len(part.lines()) if isinstance(part, Row) else 1 for part in drawing.parts].count(1) < len(
        drawing.shapes
    )


# roundings of y′, the slope of a lift
SLOPE = 32 * EPS


def touching(m: Mechanism, points: list[int]) -> list[tuple[complex, float]]:
    """The profile of the first cam by the formulas of a pose: so many points on each piece of its law, and what rounding may move each by.

    The flat face of an arm touches at c/(1 − y′) along it, without end where y′ = 1: an error of y′ grows by c/(1 − y′)² there.
    """
    drive = m.cam_drives[0]
    of, center, found = drive.lift, m.bodies[drive.cam.cam][drive.pin], []
    for low, high, count in zip(of.knots, of.knots[1:], points, strict=False):
        for j in range(count):
            angle = of.first + low + (high - low) * (j / count)
            pose = carried(m, drive, ONE, located(ONE, of, ONE.exp(angle)))
            touch = pose.touch()
            rounding = SLOPE * abs(touch / (1 - pose.rates[0])) if pose.flat and pose.arm else 0.0
            found.append((center + touch * ONE.exp(-angle), rounding))
    return found


def narrow(m: Mechanism) -> bool:
    """Whether a segment of the law is so short that the rounding of an angle shows in its steep lift."""
    return float(np.diff(m.cam_drives[0].lift.knots).min()) < 0.03


def apart(every: list[Mechanism], rng: np.random.Generator, times: int, folder: Path) -> float:
    """How far profiles on pages lie from the program's after changes of dimensions, beyond rounding; of the size of the mechanism."""
    pages, changes, true = [], [], []
    for m in every:
        at = [m.at] if len(m.inputs) > 1 else m.at + np.linspace(0, 1, 5)
        pages.append(Motion(m.assembly, at, 3.0, 1.5).page().html)
        assert "const tapes" in pages[-1]
        numbers = [d.path for d in dimensions(m).values() if d.where[0] != "inputs"]
        tries: list[dict[str, float]] = [{}]
        while len(tries) <= times:
            some = rng.choice(numbers, size=min(3, len(numbers)), replace=False).tolist()
            change = {path: float(np.real(value(m, path))) * (1 + 0.01 * rng.uniform(-1, 1)) for path in some}
            try:
                steep = narrow(changed(m, change))
            except DescriptionError:
                # a segment of the law that is short ends before it begins
                continue
            if steep:
                continue
            tries.append(change)
        changes.append(tries)
        own = counts(m.cam_drives[0].lift, STEPS)
        true.append([touching(changed(m, change), own) for change in tries])
    answers = machines(pages, folder, changes, [[] for _ in every], drawn=True)
    worst = 0.0
    for m, rows, profiles in zip(every, answers, true, strict=True):
        for shapes, profile in zip(rows, profiles, strict=True):
            (drawn,) = (shape["p"] for shape in shapes if shape["r"] == "cam")
            places, rounding = np.array(profile).T
            off = np.abs(np.array(drawn[::2]) + 1j * np.array(drawn[1::2]) - places) - rounding.real
            worst = max(worst, float(off.max() / np.real(m.size)))
    return worst


def pitch_line(points: np.ndarray[Any, Any], step: complex) -> float:
    """How far to the left of the origin the middle of a rack's teeth runs, whatever the size of a tooth."""
    return float((points.mean() * step.conjugate()).imag / abs(step))


@needs_node
def test_teeth_follow_the_dimensions(tmp_path: Path) -> None:
    """The teeth as they stand, and of a wheel of another radius: their middle runs where the program has it."""
    m = example("rack-lift/rack-lift")
    motion = Motion(m.assembly, m.at + np.linspace(0, 2 * np.pi, 361))
    travel = travel_of(motion.poses)
    (path,) = (path for path in dimensions(m) if path.endswith("radius"))
    radius = float(np.real(value(m, path)))
    tries = [{}, {path: 1.25 * radius}]
    (answers,) = machines([motion.page().html], tmp_path, [tries], [[]], drawn=True)
    lines = []
    for change, shapes in zip(tries, answers, strict=True):
        (part,) = (p for p in draw(changed(m, change), travel).parts if isinstance(p, Row) and p.joined)
        (shape,) = (shape for shape in shapes if shape.get("j"))
        points = np.array(shape["p"]).reshape(-1, 2) @ [1, 1j]
        step = complex(*map(float, shape["d"]))
        if not change:
            assert shape["n"] == part.count
            assert np.allclose([*points, step], [*part.points, part.step], rtol=0, atol=1e-15)
        lines.append(pitch_line(points, step))
        assert lines[-1] == pytest.approx(pitch_line(np.array(part.points), part.step), abs=1e-15)
    assert abs(lines[1] - lines[0]) == pytest.approx(0.25 * radius, rel=1e-12)


@needs_node
def test_the_simplest_profile(tmp_path: Path) -> None:
    """A roller cam of four segments: its own numbers, and after changes."""
    assert apart([example("cam-valve/cam-valve")], np.random.default_rng(1), 3, tmp_path) < 1e-14


@pytest.mark.slow
@needs_node
def test_profiles_of_every_kind(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    assert apart([make(rng) for _, make in CASES], rng, 1, tmp_path) < 1e-13


@pytest.mark.slow
@needs_node
@pytest.mark.parametrize("known", [0, 5, None])
def test_random_profiles(tmp_path: Path, first_seed: int, known: int | None) -> None:
    """Flat faces of arms that lift at nearly the speed of their cam touch it metres away: 7e-11 and 8e-12 off."""
    rng = np.random.default_rng(first_seed if known is None else known)
    every = [sliding(rng, face, on_arm) for face in FACES for on_arm in (False, True) for _ in range(15)]
    every += [swinging(rng, face, sense) for face in FACES for sense in ("ccw", "cw") for _ in range(15)]
    assert apart([m for m in every if not narrow(m)], rng, 2, tmp_path) < 1e-12


@pytest.mark.parametrize("step", [5, pytest.param(1, marks=pytest.mark.slow)])
def test_a_table_of_lift(step: int, tmp_path: Path) -> None:
    """A row every 5 degrees, or every degree: the page of its forces stays below the limit, and is the program's."""
    text = files("cli").joinpath("examples/cam-valve/cam-valve.toml").read_text()
    law = re.compile(r"law = \[.*?\n\]", re.DOTALL)
    (tmp_path / "m.toml").write_text(law.sub('table = "lift.csv"', text))
    lifts = [f"{t},{25 * (1 - math.cos(math.radians(t))) if t % 360 else 0.0!r}" for t in range(0, 361, step)]
    (tmp_path / "lift.csv").write_text("\n".join(["angle_deg,lift_mm", *lifts]))
    m = Mechanism.from_toml(tmp_path / "m.toml")
    page = Motion(m.assembly, np.linspace(0, 2 * np.pi, 361), 3.0, 1.5).page(True).html
    assert "const tapes" in page
    assert len(page.encode()) <= LARGEST
    if step == 1:
        trial = tried("table", m, np.random.default_rng(1), 6, 0.1)
        assert trial is not None
        assert faults([trial], tmp_path, 1e-12) == []
