"""Strokes, extremes and dead centres against closed forms and dense scans."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism
from virtualwork.study.strokes import Stroke


def slider_crank(r: float = 0.05, rod: float = 0.2, offset: float = 0.03, side: int = 1) -> Mechanism:
    """A crank, a rod and a point in a slot that lies `offset` above the pivot."""
    return Mechanism(
        {"O": 0j},
        {"crank": Link({"O": 0j, "A": r}), "rod": Link({"A": 0j, "B": rod})},
        [Guide("B", "rod", through=1j * offset)],
        inputs=Input("crank"),
        guess=Guess(math.pi / 2, {"rod": 0.0 if side > 0 else math.pi}),
    )


def four_bar(a: float, b: float, c: float, d: float = 1.0, up: int = 1) -> Mechanism:
    """A four-bar on the ground line from A to D."""
    links = {
        "crank": Link({"A": 0j, "B": a}),
        "coupler": Link({"B": 0j, "C": b}),
        "rocker": Link({"D": 0j, "C": c}),
    }
    return Mechanism(
        {"A": 0j, "D": d}, links, inputs=Input("crank"),
        guess=Guess(0.0, {"coupler": up * 1.0, "rocker": up * 1.8}),
    )  # fmt: skip


def by_name(m: Mechanism) -> dict[str, Stroke]:
    """The strokes by name."""
    return {s.name: s for s in m.check.strokes}


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("offset", [0.0, 0.03, -0.03])
def test_slider_crank(side: int, offset: float) -> None:
    """The slide is farthest and nearest with crank and rod in line: √((l ± r)² − e²)."""
    s = by_name(slider_crank(offset=offset, side=side))["B"]
    far, near = (math.sqrt((0.2 + k * 0.05) ** 2 - offset**2) for k in (1, -1))
    least, most = (near, far) if side > 0 else (-far, -near)
    assert (s.least, s.most) == pytest.approx((least, most), rel=1e-14)
    assert s.stroke == pytest.approx(far - near, rel=1e-13)
    # the crank stands along the rod there, or against it
    outer, inner = math.asin(offset / 0.25), math.asin(offset / 0.15) + math.pi
    if side < 0:
        outer, inner = math.pi - outer, 3 * math.pi - inner
    at = (inner, outer) if side > 0 else (outer, inner)
    assert [math.remainder(q, math.tau) for q in (s.at, s.most_at)] == pytest.approx(
        [math.remainder(q, math.tau) for q in at], abs=1e-13
    )


@pytest.mark.parametrize("up", [1, -1])
def test_rocker(up: int) -> None:
    """A rocker's dead centres have crank and coupler in line (law of cosines); a link that turns round has no stroke."""
    s = by_name(four_bar(0.3, 0.9, 0.7, up=up))
    far, near = (math.acos((1 + 0.7**2 - (0.9 + k * 0.3) ** 2) / (2 * 0.7)) for k in (1, -1))
    ends = [math.pi - up * x for x in (near, far)]
    least, most = sorted(ends)
    assert (s["rocker.angle"].least, s["rocker.angle"].most) == pytest.approx((least, most), rel=1e-14)
    assert "crank.angle" not in s
    assert s["B.x"].stroke == pytest.approx(0.6, rel=1e-14)
    assert not {"A.x", "D.y"} & s.keys()


def test_a_range_with_limits_ends_there() -> None:
    """A triple-rocker driven at one end: the extremes of the coupler's pin lie at limits too."""
    m = four_bar(0.8, 0.5, 0.6)
    assert m.check.input_limits is not None
    low, high = m.check.input_limits
    s = by_name(m)["B.y"]
    ends = [0.8 * math.sin(q) for q in (low, high)]
    assert (s.least, s.most) == pytest.approx((min(ends), max(ends)), rel=1e-12)


def test_a_planet_needs_its_own_turns() -> None:
    """A pencil on a planet of ratio −1/3 comes back after three turns of its arm."""
    m = Mechanism(
        {"O": 0j},
        {"arm": Link({"O": 0j, "P": 1.0}), "planet": Link({"P": 0j, "T": 0.5})},
        inputs=Input("arm"),
        gears=[Gear(("arm", "planet"), 1 / 3)],
        guess=Guess(0.0, {"planet": 0.0}),
    )
    s = by_name(m)["T.x"]
    q = np.linspace(0, 6 * math.pi, 2_000_001)
    x = np.cos(q) + 0.5 * np.cos(q / 3)
    assert (s.least, s.most) == pytest.approx((x.min(), x.max()), abs=1e-10)


def test_none_without_a_range() -> None:
    """A slide without ends runs on; two inputs have no extremes over one."""
    free = Mechanism(
        {}, {"block": Link({"B": 0j})}, [Guide("B", "block", turned=0.0)], inputs=Input(slider="B")
    )
    two = Mechanism(
        {"O": 0j},
        {"a": Link({"O": 0j, "P": 1.0}), "b": Link({"P": 0j})},
        inputs=[Input(link="a"), Input(link="b")],
    )
    assert free.check.strokes == two.check.strokes == ()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_random_four_bars_against_a_scan(seed: int) -> None:
    """No pose of a dense scan lies beyond; the places told have the values told."""
    rng = np.random.default_rng(seed)
    while True:
        a, b, c = rng.uniform(0.1, 1.5, 3)
        if abs(b - c) < abs(1 - a) < b + c:
            break
    m = four_bar(a, b, c, up=int(rng.choice([1, -1])))
    found = by_name(m)
    limits = m.check.input_limits
    low, high = limits or (0.0, m.check.assembly.reach.period or math.tau)
    motion = m.motion(np.linspace(low, high, 20_001))

    def of(motion: Any, s: Stroke) -> Any:
        owner, part = s.name.split(".")
        if part == "angle":
            return motion.link(owner).angle
        return motion.point(owner).position[:, "xy".index(part)]

    assert found
    for s in found.values():
        seen = of(motion, s)
        at_ends = of(m.motion([s.at, s.most_at]), s)
        if s.turns:
            middle = (s.least + s.most) / 2
            seen, at_ends = (middle + np.angle(np.exp(1j * (x - middle))) for x in (seen, at_ends))
            if s.stroke > math.pi:
                continue
        seen = seen[np.isfinite(seen)]
        near = limits is not None  # where places are known to the root of rounding
        assert seen.min() >= s.least - (1e-7 if near else 1e-13)
        assert seen.max() <= s.most + (1e-7 if near else 1e-13)
        for value, told in zip(at_ends, (s.least, s.most), strict=True):
            if np.isfinite(value):
                assert value == pytest.approx(told, abs=1e-6 if near else 1e-13)
