"""Racks, belts and cams in fits, tolerances and pages: the simplest case of each, with its closed form."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.computed_pages import machines
from tests.conftest import Dalembert
from tests.node import needs_node
from virtualwork import Belt, Cam, Guide, Input, Link, Mechanism, Rack, Segment

Q = np.array([0.2, 0.7, 1.3, 2.9])


def rack(radius: float = 0.03) -> Mechanism:
    """A pinion and a rack below it."""
    return Mechanism(
        {"O": 0j},
        {"pinion": Link({"O": 0j}), "rack": Link({"R": 0j}, 2.0)},
        [Guide("R", "rack", through=-0.03j, turned=0.0)],
        racks=[Rack("pinion", "R", radius)],
        inputs=Input("pinion", value=0.0, speed=2.0),
    )


def belt(radius: float = 0.15) -> Mechanism:
    """A belt to a drum with a point."""
    return Mechanism(
        {"M": 0j, "D": 0.4},
        {"motor": Link({"M": 0j}), "drum": Link({"D": 0j, "E": 0.1})},
        belts=[Belt(("motor", "drum"), (0.06, radius))],
        inputs=Input("motor", value=0.0, speed=30.0),
    )


def cam(rise: float = 0.02) -> Mechanism:
    """A knife edge that rises over half a turn."""
    law = (Segment(end=3.0, rise=rise, motion="3-4-5"), Segment(end=4.0), Segment(motion="cycloidal"))
    return Mechanism(
        {"O": 0j},
        {"cam": Link({"O": 0j}), "rod": Link({"F": 0j}, 0.5)},
        [Guide("F", "rod", angle=1.0, turned=0.0)],
        cams=[Cam("cam", 0.04, slider="F", law=law)],
        inputs=Input("cam", value=0.0, speed=5.0),
    )


CASES: list[tuple[Any, str, str, float, tuple[float, float]]] = [
    (rack, "racks.1.radius", "slides.R", 0.041, (0.01, 0.08)),
    (belt, "belts.1.radii.2", "links.drum", 0.21, (0.1, 0.3)),
    (cam, "cams.1.law.1.rise", "slides.F", 0.031, (0.005, 0.05)),
]
NAMES = ["rack", "belt", "cam"]


@pytest.mark.parametrize(("make", "path", "wanted", "true", "bounds"), CASES, ids=NAMES)
def test_a_fit_finds_the_dimension(make: Any, path: str, wanted: str, true: float, bounds: Any) -> None:
    motion = make(true).motion(Q)
    kind, name = wanted.split(".")
    target = motion.slide(name).position if kind == "slides" else motion.link(name).angle
    fit = make().fit(wanted, target, {path: bounds}, Q, starts=8)
    assert fit.parameters[path] == pytest.approx(true, rel=1e-9)


TOLERANCES = [
    ("rack-lift", "racks.1.radius", "R.y", lambda q: q),
    ("belt-drive", "belts.1.radii.1", "drum.omega", lambda q: None),
    ("cam-valve", "cams.1.law.1.rise", "V.position", lambda q: (1 - np.cos(1.5 * q)) / 2),
]


@pytest.mark.parametrize(("name", "path", "wanted", "slope"), TOLERANCES, ids=NAMES)
def test_tolerances_are_slopes_times_limits(
    dalembert: Dalembert, tmp_path: Path, name: str, path: str, wanted: str, slope: Any
) -> None:
    dalembert("examples", name)
    file = tmp_path / f"{name}.toml"
    file.write_text(
        file.read_text(encoding="utf-8") + f'\n[tolerances]\n"{path}" = "0.1 mm"\n', encoding="utf-8"
    )
    done = dalembert("tolerance", file.name, "--at", "60deg", "--only", wanted)
    assert done.returncode == 0, done.stderr
    (row,) = csv.DictReader(done.stdout.splitlines())
    worst = float(next(value for column, value in row.items() if "_worst_" in column))
    if wanted == "drum.omega":
        m = Mechanism.from_toml(str(file))
        limit = 1e-4 / m.belts[0].radii[0] * abs(m.motion(np.array([1.0])).link("drum").omega[0])
    else:
        limit = 1e-4 * slope(np.pi / 3)
    assert worst == pytest.approx(limit, rel=1e-9)


@needs_node
def test_pages_compute_racks_belts_and_cams(tmp_path: Path) -> None:
    """A page stands where the program does, with another dimension too."""
    pages, tries, names, true = [], [], [], []
    for make, path, wanted, changed, _ in CASES:
        m = make()
        name = wanted.split(".")[1]
        what = f"{name}.position" if wanted.startswith("slides") else f"{name}.omega"
        page = m.motion(np.linspace(0, 6, 13)).page().html
        pages.append(page)
        tries.append([{"input": 1.1}, {path: changed, "input": 1.1}])
        names.append([what])
        for each in (m, make(changed)):
            motion = each.motion(np.array([1.1]))
            of = motion.slide(name).position if wanted.startswith("slides") else motion.link(name).omega
            true.append(float(of[0]))
    found = machines(pages, tmp_path, tries, names)
    assert np.allclose(np.ravel(found), true, rtol=1e-13)
