"""Motions in time with kinks: laws of cams, whose ends steps meet, and tables over the angle of a link that no input turns alone.

Steps pass the rows of such a table. Halved steps gain little there, so the second solution has steps of its own. Both motions here have an energy integral: the time of an
angle is a quadrature from kink to kink, and the error of the angle is the speed times the error of that time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from tests.virtualwork.test_cams import RNG, sliding
from virtualwork import Guess, Guide, Input, Link, Mechanism, Spring, Torque
from virtualwork.formulas.lifts import lift_at

TURN = 2 * math.pi
NODES, WEIGHTS = np.polynomial.legendre.leggauss(30)
# what the quadrature and its numbers round, rad
ROUNDED = 2e-13
Speed = Callable[[float], float]


def worst(run: Any, omega: Speed, kinks: list[float]) -> float:
    """The largest error of the input, over its estimate."""
    time, result = 0.0, 0.0
    angle = run.angle[:, 0].tolist()
    for i, (a, b) in enumerate(pairwise(angle), 1):
        inside = sorted((x for x in kinks if min(a, b) < x < max(a, b)), reverse=b < a)
        for part in pairwise([a, *inside, b]):
            for low, high in pairwise(np.linspace(*part, 5).tolist()):
                speeds = [omega(x) for x in ((low + high + (high - low) * NODES) / 2).tolist()]
                time += (high - low) / 2 * float((WEIGHTS / speeds).sum())
        error = abs((run.t[i] - run.t[0] - time) * omega(b))
        result = max(result, error / (run.error_estimate[i, 0] + ROUNDED))
    return result


def sprung_cam(seed: int, face: str) -> tuple[Mechanism, Callable[[float, float], Speed], list[float]]:
    """A cam with a slide against a spring along its way; its speed, of angle and speed at first; its kinks."""
    m = sliding(RNG(seed), face)
    guide, drive, cam = m.guides[0], m.cam_drives[0], m.links["cam"]
    links = dict(m.links) | {"follower": replace(m.links["follower"], center=0j)}
    far = m.through(guide) + 3.0 * np.exp(1j * guide.angle)
    spring = Spring((("follower", "F"), ("ground", "S")), 400.0, 3.0, 0.0)
    m = replace(m, ground={**m.ground, "S": far}, links=links, springs=[spring], gravity=0j)
    turned = cam.inertia + cam.mass * abs(cam.center) ** 2

    def stored(q: float) -> float:
        return 200.0 * (drive.rest + float(lift_at(drive.lift, q))) ** 2

    def inertia(q: float) -> float:
        return turned + 0.4 * float(lift_at(drive.lift, q, 1)) ** 2

    def speed(angle: float, first: float) -> Speed:
        whole = stored(angle) + 0.5 * inertia(angle) * first**2
        return lambda q: math.copysign(math.sqrt(2 * (whole - stored(q)) / inertia(q)), first)

    return m, speed, [drive.lift.first + x + TURN * n for x in drive.lift.knots for n in range(-9, 10)]


@pytest.mark.parametrize("accuracy", [1e-6, 1e-9])
@pytest.mark.parametrize(("seed", "face"), [(0, "knife"), (7, "roller"), (2, "flat")])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_estimate_holds_over_the_ends_of_a_law(
    seed: int, face: str, sense: float, accuracy: float
) -> None:
    """With seed 7 a return in 7 degrees follows a dwell: one step passed it as a whole, and the cam went on too fast."""
    m, speed, kinks = sprung_cam(seed, face)
    first = 60.0 * sense
    run = m.simulate(np.linspace(0, 0.2, 5), angle=0.3, speed=first, accuracy=accuracy)
    assert float(run.error_estimate.max()) <= accuracy
    assert worst(run, speed(0.3, first), kinks) <= 1


def test_a_cam_that_stays_in_a_dwell_turns_evenly() -> None:
    m, _, _ = sprung_cam(0, "flat")
    drive = m.cam_drives[0]
    start = drive.lift.first + drive.lift.knots[-2]
    run = m.simulate([0.0, 0.01], angle=start + 0.05, speed=1.0)
    assert abs(run.angle[1, 0] - (start + 0.06)) <= run.error_estimate[1, 0] + 1e-15


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("rows", [2, 7])
def test_the_estimate_holds_where_steps_pass_the_rows_of_a_table(seed: int, rows: int) -> None:
    """A crank of inertia J, a rod without mass, on the rod a torque T(φ): J ω²/2 grows by ∫T dφ."""
    rng = RNG(seed)
    crank, rod, inertia, start = 0.05, 0.15, 0.04, 0.2
    places = [-0.4, *np.sort(rng.uniform(-0.32, 0.32, rows - 2)), 0.4]
    torques = rng.uniform(-8, 8, rows)
    m = Mechanism(
        {"O": 0j},
        {"crank": Link({"O": 0j, "A": crank}, inertia=inertia), "rod": Link({"A": 0j, "B": rod})},
        [Guide("B", "rod")],
        inputs=Input("crank"),
        guess=Guess(start, {"rod": -0.06}),
        torques=[Torque("rod", history=tuple(zip(places, torques.tolist(), strict=True)), over="angle")],
    )

    def turned(q: float) -> float:
        return -math.asin(crank * math.sin(q) / rod)

    def work(q: float) -> float:
        x = turned(q)
        inside = np.array([places[0], *(p for p in places[1:-1] if p < x), x])
        return float(np.trapezoid(np.interp(inside, places, torques), inside))

    first = float(rng.choice([-1, 1])) * 40.0

    def omega(q: float) -> float:
        return math.copysign(math.sqrt(first**2 + 2 * (work(q) - work(start)) / inertia), first)

    sines = [-rod * math.sin(x) / crank for x in places[1:-1]]
    each = [x for s in sines if abs(s) < 1 for x in (math.asin(s), math.pi - math.asin(s))]
    run = m.simulate(np.linspace(0, 0.3, 4), angle=start, speed=first)
    assert worst(run, omega, [x + TURN * n for x in each for n in range(-4, 5)]) <= 1
