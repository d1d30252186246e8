"""Cams that would have to pull their follower: at which speed, and from when on in a motion in time."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from tests.virtualwork.test_cams import RNG, sliding
from virtualwork import Mechanism, Spring


def held_by_a_spring() -> Mechanism:
    """A roller that slides, a spring along its way, without preload at the cam's axis; no gravity."""
    m = sliding(RNG(11), "roller")
    guide = m.guides[0]
    along = np.exp(1j * guide.angle)
    far = m.through(guide) + 3.0 * along
    links = dict(m.links) | {"follower": replace(m.links["follower"], center=0j)}
    spring = Spring((("follower", "F"), ("ground", "S")), 400.0, 3.0, 0.0)
    return replace(m, ground={**m.ground, "S": far}, links=links, springs=[spring], gravity=0j)


def test_lift_off_is_where_the_contact_force_vanishes() -> None:
    """A spring of preload F and stiffness k, a mass m: F + k s + m a ω² = 0 first where (F + k s)/(−m a) is least."""
    from virtualwork.formulas.lifts import lift_at
    from virtualwork.study.cams import lift_off

    m = held_by_a_spring()
    drive = m.cam_drives[0]
    q = np.linspace(0, 2 * math.pi, 200001)
    push = 400.0 * (drive.rest + lift_at(drive.lift, q))
    bend = lift_at(drive.lift, q, 2)
    speeds = np.sqrt(push[bend < 0] / (0.4 * -bend[bend < 0]))
    found = lift_off(m.assembly, 0)
    assert found is not None
    assert found.speed == pytest.approx(speeds.min(), rel=1e-8)
    for factor in (1 - 1e-7, 1 + 1e-7):
        motion = m.motion(np.array([found.at]), speed=factor * found.speed, acceleration=0.0)
        assert (motion.dynamics.contact(0)[0] > 0) == (factor < 1)


@pytest.mark.parametrize("sense", [1, -1])
def test_a_run_says_from_when_on_a_cam_would_have_to_pull(sense: int) -> None:
    """By energy: ω² = 2(E - k y²/2)/(J + m s'²); the follower is pressed by k y + m(s'' ω² + s' α), and t = ∫dθ/ω."""
    from scipy.integrate import quad
    from scipy.optimize import brentq

    from virtualwork.formulas.lifts import lift_at

    m = held_by_a_spring()
    drive, cam = m.cam_drives[0], m.links["cam"]
    whole, mass, k, start = cam.inertia + cam.mass * abs(cam.center) ** 2, 0.4, 400.0, 60.0
    energy = 0.5 * whole * start**2 + 0.5 * k * drive.rest**2

    def omega(q: Any) -> Any:
        y, slope = drive.rest + lift_at(drive.lift, q), lift_at(drive.lift, q, 1)
        return np.sqrt(2 * (energy - 0.5 * k * y * y) / (whole + mass * slope**2))

    def press(q: Any) -> Any:
        y, slope, bend = (lift_at(drive.lift, q, order) for order in range(3))
        y, square = y + drive.rest, omega(q) ** 2
        alpha = -(mass * slope * bend * square + k * y * slope) / (whole + mass * slope**2)
        return k * y + mass * (bend * square + slope * alpha)

    # backwards from a whole turn
    begin = 0.0 if sense > 0 else 2 * math.pi
    q = begin + sense * np.linspace(0, 2 * math.pi, 20001)
    first = int(np.argmax(press(q) < 0))
    assert first > 1
    there = brentq(lambda x: float(press(x)), q[first - 1], q[first], xtol=1e-15)
    turns = drive.lift.first + np.add.outer(2 * math.pi * np.arange(-1, 2), drive.lift.knots)
    inside = [x for x in turns.ravel() if min(begin, there) < x < max(begin, there)]
    knots = sorted({begin, *inside, there}, reverse=sense < 0)
    time = sum(
        abs(quad(lambda x: 1 / float(omega(x)), *part, epsabs=0, epsrel=1e-13)[0]) for part in pairwise(knots)
    )

    run = m.simulate([0.0, 0.5 * time, 3 * time], angle=begin, speed=sense * start, accuracy=1e-11)
    assert len(run.warnings) == 1
    assert run.warnings[0].startswith("contact lost at ")
    assert float(run.warnings[0].split()[3]) == pytest.approx(time, rel=1e-8)
    assert "cam cam-F" in run.warnings[0]
    assert not m.simulate([0.0, 0.9 * time], angle=begin, speed=sense * start).warnings
    # as slowly as the spring allows, and each of several variants by itself
    assert not m.simulate([0.0, 0.1], angle=begin, speed=sense * 1.0).warnings
    runs = m.vary({"links.follower.mass": [1e-6, 0.4]}).simulate(
        [0.0, 2 * time], angle=begin, speed=sense * start
    )
    assert [bool(runs.warnings.get(i)) for i in range(2)] == [False, True]
