"""What no dimension moves has no tolerance, no share, no warning and no picture; what is not assembled has none either."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.four_bars import four_bar
from virtualwork import Force, Guess, Guide, Input, Link, Mechanism
from virtualwork.describe.dimensions import named
from virtualwork.formulas.forces import Effort, JointForce, Shaking
from virtualwork.formulas.kinematics import Angle, Point, Slide

SLIDE = """
name = "vertical slide"
ground = { O = [0, 0] }
sliders = [{ link = "block", on = "ground", point = "R", through = [0.013, 0], angle = "90 deg" }]
input = { link = "crank", angle = "30 deg", speed = 10 }
guess = { at = "30 deg", R = [0.013, 0.17] }
[links]
crank = { points = { O = [0, 0], Q = [0.05, 0] } }
rod = { points = { Q = [0, 0], R = [0.15, 0] } }
block = { points = { R = [0, 0] } }
[tolerances]
"links.crank.Q.x" = "0.05 mm"
"links.rod.R.x" = "0.05 mm"
"""


def slide(angle, size=1.0):
    """A slider-crank whose slide stands at an angle, loaded across it and along it."""
    turn = np.exp(1j * angle)
    return Mechanism(
        {"O": 0j},
        {
            "crank": Link({"O": 0j, "Q": 0.05 * size}, 1.0, 0.01 * size),
            "rod": Link({"Q": 0j, "R": 0.15 * size}, 0.5, 0.07 * size),
            "block": Link({"R": 0j}, 2.0),
        },
        guides=[Guide("R", "block", through=0.013 * size * turn / 1j, angle=angle, turned=0.0)],
        inputs=Input("crank", speed=10.0),
        guess=Guess(angle, points={"R": 0.2 * size * turn}),
        gravity=-9.81j,
        forces=[Force("block", None, 30.0 * turn)],
    )


def varying(m, paths, keys, q, limit=1e-4):
    motion = m.motion(q, 10.0, 0.0)
    limits = {d: limit for path in paths for d in named(m, path)}
    return motion.sensitivities.vary(keys, limits)


POINT = [Point("block", 0j, "R", k) for k in range(3)]
PATHS = ("links.crank.Q.x", "links.rod.R.x", "links.rod.R.y")


@pytest.mark.parametrize("size", [1.0, 1e-6, 1e5])
def test_only_the_way_along_an_upright_slide_varies(size):
    q = np.linspace(0.1, 6.0, 23)
    for quarter in range(-3, 6):
        found = varying(slide(quarter * np.pi / 2, size), PATHS, [*POINT, Angle("block", 0)], q, 1e-9)
        assert found[:3] == [(quarter % 2 == 0, quarter % 2 == 1)] * 3, quarter
        assert found[3] == (False,)
    # neither coordinate is constant where the slide leans, however little
    for angle in (0.7, np.pi / 2 + 1e-9, -2.0):
        assert varying(slide(angle, size), PATHS, POINT, q, 1e-12 * size) == [(True, True)] * 3


def test_forces_across_and_along():
    q = np.linspace(0.1, 6.0, 23)
    m = slide(0.0)
    keys = [Shaking(), Effort(0), Angle("rod", 0), Angle("crank", 0), Slide(0, 1)]
    assert varying(m, PATHS, keys, q) == [(True, True), (True,), (True,), (False,), (True,)]
    # masses move nothing; the mass of what slides level loads its slide by its weight
    assert varying(m, ["links.block.mass"], [*POINT, Slide(0, 0)], q) == [(False, False)] * 3 + [(False,)]
    (joint,) = {j.key for j in m.motion(0.3).dynamics.reactions.joints if j.guide is not None}
    assert varying(m, ["links.block.mass"], [JointForce(joint, "block")], q) == [(False, True)]


def test_the_command_shows_what_varies_alone(dalembert, tmp_path):
    (tmp_path / "m.toml").write_text(SLIDE)
    shown = dalembert("tolerance", "m.toml", "--draws", "100", "--only", "R", "--json")
    assert (shown.returncode, shown.stderr) == (0, "")
    document = json.loads(shown.stdout)
    its = document["tolerance"]
    names = ["R_y_m", "R_vy_m_s", "R_position_m", "R_speed_m_s"]
    assert list(its["columns"]) == list(its["drawn"]["columns"]) == names
    assert {s["column"] for s in its["shares"]} == set(names)
    # y = r sin q + √(l² − (r cos q − e)²)
    r, rod, e, q = 0.05, 0.15, 0.013, np.radians(30)
    across = r * np.cos(q) - e
    root = np.sqrt(rod**2 - across**2)
    slopes = np.abs([np.sin(q) - across * np.cos(q) / root, rod / root])
    assert its["columns"]["R_y_m"]["worst"] == pytest.approx([slopes.sum() * 5e-5], rel=1e-12)
    table = dalembert("tolerance", "m.toml", "--only", "R").stdout.splitlines()[0]
    assert "R_x_m,R_y_m,R_y_worst_m,R_y_sd_m,R_vx_m_s,R_vy_m_s,R_vy_worst" in table
    # a pin's moment is zero whatever the dimensions are
    for name in ("R.rod.moment", "crank.difference_torque"):
        zero = dalembert("tolerance", "m.toml", "--only", name, "--json")
        assert (zero.returncode, json.loads(zero.stdout)["tolerance"]["columns"]) == (0, {})
    none = dalembert("tolerance", "m.toml", "--only", "block", "--plot", "p.svg", "--json")
    assert json.loads(none.stdout)["tolerance"] == {"columns": {}, "shares": []}
    assert "none of the numbers shown depends on [tolerances]" in none.stderr
    assert not (tmp_path / "p.svg").exists()


def test_what_is_not_assembled_is_null_everywhere(dalembert, tmp_path):
    limits = '[tolerances]\n"links.crank.B.x" = 0.05\n"ground.D.y" = 0.1\n'
    text = four_bar(rates="speed = 10", more=limits).replace("D = [100, 0]", "D = [190, 0]")
    assert "190" in text
    (tmp_path / "m.toml").write_text(text)
    shown = dalembert("tolerance", "m.toml", "--at", "40", "--at", "180", "--draws", "20", "--json")  # fmt: skip
    its = json.loads(shown.stdout)["tolerance"]
    places = [list(of.values()) for of in its["columns"].values()]
    places += [list(of.values()) for of in its["drawn"]["columns"].values()]
    places += [[share["share"]] for share in its["shares"]]
    assert len(places) > 20
    for first, second in (values for of in places for values in of):
        assert first is not None
        assert second is None


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_random_upright_slides(seed):
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-4, 4)
    quarter = int(rng.integers(-4, 5))
    m = slide(quarter * np.pi / 2, size)
    q = rng.uniform(-7, 7, int(rng.integers(2, 50)))
    # a point beside the rod's end makes it longer to second order only
    paths = rng.permutation(PATHS[:2])[: rng.integers(1, 3)]
    found = varying(m, paths, POINT, q, size * 10.0 ** rng.uniform(-12, -1))
    assert found == [(quarter % 2 == 0, quarter % 2 == 1)] * 3
