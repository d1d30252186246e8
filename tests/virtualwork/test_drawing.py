"""What a mechanism is drawn as, against its own sizes: pitch radii, outlines, how far a guide is used."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
import pytest

from virtualwork import Gear, Guide, Input, Link, Mechanism, Spring
from virtualwork.drawing import ROLES, Circle, Coil, Line, draw, hull


def example(name: str, file: str) -> Mechanism:
    return Mechanism.from_toml(str(files("cli.examples") / name / f"{file}.toml"))


def wheels(mechanism: Mechanism) -> dict[str, float]:
    """Return the pitch radius of each body's wheel, mm."""
    return {
        s.body: 1e3 * s.radius for s in draw(mechanism).shapes if isinstance(s, Circle) and s.role == "wheel"
    }


def test_pitch_circles_touch() -> None:
    """Sun 20 and planet 40 on an arm of 60; the planet runs in a ring of 100 (the ratios are -20/40 and 40/100)."""
    found = wheels(example("planetary-gear", "planetary"))
    assert found == pytest.approx({"sun": 20, "planet": 40, "ground": 100})


def test_wheels_on_one_axis_have_no_pitch_circles() -> None:
    links = {name: Link({"O": 0j}) for name in ("a", "b")}
    pair = Mechanism({"O": 0j}, links, gears=[Gear(("a", "b"), -2.0)], inputs=Input(link="a"))
    assert not wheels(pair)
    # a wheel without a pitch circle is drawn all the same
    assert [s.body for s in draw(pair).shapes if s.role == "link"] == ["a", "b"]


def test_an_outline_is_the_hull_and_the_hull_is_convex() -> None:
    rng = np.random.default_rng(7)
    cloud = [complex(*xy) for xy in rng.normal(size=(60, 2))]
    ring = np.array(hull(cloud))
    for a, b in zip(ring, np.roll(ring, -1), strict=True):
        # every point lies to the left of every side
        assert (((b - a).conjugate() * (np.array(cloud) - a)).imag >= -1e-12).all()
    assert set(ring) <= set(cloud)


def test_a_guide_is_as_long_as_it_is_used() -> None:
    """Scotch yoke: the pin's slot is used over ±50 mm, whatever the mechanism's size."""
    motion = example("scotch-yoke", "yoke").motion(np.linspace(0, 2 * np.pi, 721))
    (slot,) = (s for s in motion.drawing.shapes if s.role == "slot")
    assert isinstance(slot, Line)
    ends = np.array(slot.points)
    beyond = 1.35 * motion.drawing.symbol
    assert np.ptp(ends.imag) == pytest.approx(0.1 + 2 * beyond)
    assert np.ptp(ends.real) == pytest.approx(2 * beyond)


def test_a_guide_of_a_single_pose_is_drawn_some_way_about_its_pin() -> None:
    motion = example("scotch-yoke", "yoke").motion([1.2])
    (slot,) = (s for s in motion.drawing.shapes if s.role == "slot")
    assert isinstance(slot, Line)
    ends = np.array(slot.points)
    assert ends.mean().imag == pytest.approx(0.05 * np.sin(1.2), rel=1e-6)
    assert np.ptp(ends.imag) > 0.04


def test_a_block_lies_along_its_guide_whichever_way_its_link_is_turned() -> None:
    engine = example("engine", "engine")
    motion = engine.motion([0.3])
    (block,) = (s for s in motion.drawing.shapes if s.role == "block")
    assert isinstance(block, Line)
    corners = np.array([motion.at(block.body, z).complex(0)[0] for z in block.points])
    # the piston moves along y; its block is longer along the guide than across
    assert np.ptp(corners.imag) == pytest.approx(6.4 * motion.drawing.symbol)
    assert np.ptp(corners.real) == pytest.approx(4 * motion.drawing.symbol)


def test_a_spring_ends_where_it_is_fastened() -> None:
    coil = Coil((("a", 0j), ("b", 1j)), 0.1)
    line = np.array(coil.along(2 + 1j, 5 + 5j))
    assert line[0] == 2 + 1j
    assert line[-1] == 5 + 5j
    # its turns keep their width
    across = ((line - line[0]) / (3 + 4j) * 5).imag
    assert np.abs(across).max() == pytest.approx(0.1)
    assert coil.along(1j, 1j)[0] == 1j


def test_shapes_have_known_roles_and_finite_points() -> None:
    bare = Mechanism(
        {"O": 0j},
        {"arm": Link({"O": 0j, "P": 1}, mass=1, center=0.5), "block": Link({"B": 0j})},
        guides=[Guide("B", "block", "arm", "O", 0.0, turned=0.0)],
        inputs=[Input(link="arm"), Input(slider="B")],
        springs=[Spring((("arm", 1 + 0j), ("ground", 3j)), 1.0)],
    )
    shapes = [*draw(bare).shapes]
    shapes += bare.motion([[0.0, np.nan]]).drawing.shapes
    shapes += example("klann", "klann").motion(np.linspace(0, 6, 20)).drawing.shapes
    assert {s.role for s in shapes} <= set(ROLES)
    for s in shapes:
        points = (
            s.points if isinstance(s, Line) else [z for _, z in s.ends] if isinstance(s, Coil) else [s.centre]
        )
        assert np.isfinite(points).all(), s
