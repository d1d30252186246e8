"""Free-body diagrams on a page that computes: every link in equilibrium, the program's own forces, after a drag too."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.pages import Opened
from tests.conftest import Dalembert
from virtualwork import Mechanism
from virtualwork.describe.dimensions import changed
from virtualwork.study.free_bodies import free_bodies

EXAMPLES = Path(str(files("cli.examples")))
ACTIONS = """
return Object.fromEntries(whole.loose.map(({ b, parts }) => {
  const { forces, torques } = actions(parts, shown);
  return [whole.bodies[b].name, [...forces.map((f) => [f.n, ...f.place, ...f.force, 0]), ...torques.map((t) => [t.n, 0, 0, 0, 0, t.torque])]];
}))
"""
LIFT = (
    "gravity = [0, -9.81]\n[ground]\nO = [0, 0]\n[links.block]\npoints = { B = [0, 0], P = [0.2, 0.1] }\nmass = 3\ncenter = [0.1, 0]\n"
    "inertia = 0.02\n[links.arm]\npoints = { P = [0, 0], Q = [0.3, 0] }\nmass = 1\ncenter = [0.15, 0]\n"
    '[[sliders]]\npoint = "B"\nlink = "block"\non = "ground"\nthrough = "O"\nangle = "70 deg"\n'
    '[[input]]\nslider = "B"\nposition = 0.4\nspeed = 0.3\nacceleration = 2\n[[input]]\nlink = "arm"\non = "block"\nangle = "20 deg"\nspeed = 4\n'
    '[[forces]]\nlink = "arm"\npoint = "Q"\nforce = [5, -7]\nframe = "link"\n[guess]\nat = [0.4, "20 deg"]\n'
)


def totals(bodies: dict[str, list[list[Any]]]) -> None:
    """ΣF = 0 and ΣM = 0 about the origin of every link."""
    for link, rows in bodies.items():
        x, y, fx, fy, torque = np.array([row[1:] for row in rows], dtype=float).T
        size, arm = (
            np.hypot(fx, fy).sum() or 1.0,
            np.abs(torque).sum() + (np.hypot(x, y) * np.hypot(fx, fy)).sum(),
        )
        assert abs(fx.sum()) + abs(fy.sum()) < 1e-12 * size, link
        assert abs((x * fy - y * fx + torque).sum()) < 1e-12 * (arm or 1.0), link


def check(page: Opened, m: Mechanism, inputs: Any) -> None:
    drawn = page(ACTIONS)
    totals(drawn)
    for body in free_bodies(m.motion(inputs).dynamics):
        expected = [
            (f.name, f.at[0].real, f.at[0].imag, f.force[0].real, f.force[0].imag, 0.0) for f in body.forces
        ]
        expected += [(t.name, 0.0, 0.0, 0.0, 0.0, t.torque[0]) for t in body.torques]
        largest = max((np.abs(row[1:]).max() for row in expected), default=1.0)
        rows = {row[0]: row[1:] for row in drawn[body.link] if np.any(np.abs(row[3:]) > 1e-12 * largest)}
        wanted = {row[0]: row[1:] for row in expected if np.any(np.abs(row[3:]) > 1e-12 * largest)}
        assert rows.keys() == wanted.keys(), body.link
        for name, row in wanted.items():
            np.testing.assert_allclose(rows[name], row, atol=1e-11 * largest, err_msg=f"{body.link}: {name}")


TURN = np.radians(20)


@pytest.mark.slow
def test_belts_turn_every_link(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    path = EXAMPLES / "belt-drive/belt-drive.toml"
    done = dalembert("forces", path, "--at", "30deg", "--page", "p.html")
    assert done.returncode == 0, done.stderr
    page, m = Opened(browser, tmp_path / "p.html"), Mechanism.from_toml(str(path))
    check(page, m, np.radians([30.0]))
    assert page("return dalembert.set(arguments[0])", {"belts.1.radii.1": 0.07})
    check(page, changed(m, {"belts.1.radii.1": 0.07}), np.radians([30.0]))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "at", "inputs", "change"),
    [
        ("crank-press/press.toml", "75deg", np.radians([75.0]), {"links.rod.B.x": 0.37}),
        ("robot-arm/arm.toml", "upper=20deg,fore=20deg", [[TURN, TURN]], {"links.fore.mass": 3.5}),
        ("boom/boom.toml", "", None, {}),
        ("cam-valve/cam-valve.toml", "50deg", np.radians([50.0]), {"cams.1.base_radius": 0.021}),
        ("rack-lift/rack-lift.toml", "30deg", np.radians([30.0]), {"racks.1.radius": 0.031}),
        ("lift.toml", "B=0.4m,arm=20deg", [[0.4, TURN]], {"links.block.mass": 5.0}),
    ],
)
def test_every_link_is_in_equilibrium(
    file: str,
    at: str,
    inputs: Any,
    change: dict[str, float],
    dalembert: Dalembert,
    tmp_path: Path,
    browser: Any,
) -> None:
    (tmp_path / "lift.toml").write_text(LIFT)
    path = tmp_path / file if file == "lift.toml" else EXAMPLES / file
    done = dalembert("forces", path, *(("--at", at) if at else ()), "--page", "p.html")
    assert done.returncode == 0, done.stderr
    page = Opened(browser, tmp_path / "p.html")
    m = Mechanism.from_toml(str(path))
    check(page, m, inputs)
    if change:
        assert page("return dalembert.set(arguments[0])", change)
        check(page, changed(m, change), inputs)
    page("document.querySelector('[data-toggle=\"free bodies\"]').click()")
    links = page("return [...document.querySelectorAll('#loose figcaption')].map((one) => one.textContent)")
    assert links == list(m.links)
    assert page("return document.querySelectorAll('#loose path').length") > len(links)
    assert page("return document.documentElement.scrollWidth <= innerWidth")
    assert not page.faults()
