"""The rounding errors of a cycle's numbers: a slider-crank in closed form, its sums and splines in 50 digits."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from dalembert.arithmetic.doubled_arrays import DoubledArray
from dalembert.arithmetic.doubled_splines import Spline
from tests.virtualwork.judged import judge
from virtualwork import Cycle, Guess, Guide, Input, Link, Mechanism, Torque

SPEED = 7.0


def slider_crank(r: float, rod: float, e: float, piston: float, crank: float) -> Mechanism:
    """A crank and a piston with masses, on a line at the height e."""
    lean = float(np.arcsin(e / rod))
    return Mechanism(
        {"A": 0j},
        {
            "crank": Link({"A": 0j, "B": complex(r)}, mass=crank, center=complex(r)),
            "rod": Link({"B": 0j, "C": complex(rod)}),
            "piston": Link({"C": 0j}, mass=piston),
        },
        guides=[Guide("C", "piston", through=complex(0, e), turned=0.0)],
        inputs=Input(link="crank", value=0.0),
        guess=Guess(0.0, {"crank": 0.0, "rod": lean}),
        gravity=-9.81j,
    )


def effort(q: Any, r: float, rod: float, e: float, piston: float, crank: float) -> Any:
    """The torque on the crank: m·x″·x′·ω² of the piston, and the crank's weight."""
    sine, cosine = r * mp.sin(q), r * mp.cos(q)
    s = sine - e
    p = mp.sqrt(mp.mpf(rod) ** 2 - s * s)
    rate = -sine - s * cosine / p
    second = -cosine - (cosine**2 - s * sine) / p - s * s * cosine**2 / p**3
    return piston * second * rate * SPEED**2 + crank * mp.mpf(9.81) * cosine


def spline(x: Any, y: Any) -> Any:
    """The integral of the cubic spline with no knot at the second place and the last but one: its second derivatives."""
    n = len(x)
    h = [b - a for a, b in pairwise(x)]
    d = [(b - a) / w for (a, b), w in zip(pairwise(y), h, strict=True)]
    a, right = mp.zeros(n), mp.zeros(n, 1)
    for i in range(1, n - 1):
        a[i, i - 1], a[i, i], a[i, i + 1] = h[i - 1], 2 * (h[i - 1] + h[i]), h[i]
        right[i] = 6 * (d[i] - d[i - 1])
    a[0, 0], a[0, 1], a[0, 2] = h[1], -h[0] - h[1], h[0]
    a[n - 1, n - 3], a[n - 1, n - 2], a[n - 1, n - 1] = h[-1], -h[-2] - h[-1], h[-2]
    m = mp.lu_solve(a, right)
    return sum(h[i] * (y[i] + y[i + 1]) / 2 - h[i] ** 3 * (m[i] + m[i + 1]) / 24 for i in range(n - 1))


def truth(cycle: Cycle, size: tuple[float, ...], turn: bool) -> dict[str, Any]:
    """The numbers of a cycle in 50 digits, and the peak where it is the top nearby."""
    n, end = cycle.poses.n, float(cycle.input[-1])
    whole = 2 * mp.pi if turn else mp.mpf(end)
    x = [whole * i / (n - 1) for i in range(n)]
    y = [effort(q, *size) for q in x]

    def over(values: Any) -> Any:
        return whole * sum(values[1:]) / (n - 1) if turn else spline(x, values)

    found = {"work": over(y), "mean": over(y) / whole, "rms": mp.sqrt(over([v * v for v in y]) / whole)}
    at = mp.findroot(lambda q: mp.diff(lambda p: effort(p, *size), q), cycle.peak_at)
    if abs(at - cycle.peak_at) < 1e-6 and 1e-6 < abs(at) < abs(whole) - 1e-6:
        found |= {"peak": abs(effort(at, *size)), "peak_at": at}
        found["peak_power"] = found["peak"] * SPEED
    return found


@pytest.mark.parametrize("turn", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_slider_crank(turn: bool) -> None:
    rng = np.random.default_rng(5 + turn)
    pairs: dict[str, list[tuple[float, float]]] = {}
    for _ in range(10):
        r, rod = rng.uniform(0.1, 1), rng.uniform(2, 4)
        size = (r, rod, rng.uniform(-0.4, 0.4), *rng.uniform(0.1, 3, 2))
        n, end = (361, 2 * np.pi) if turn else (41, float(rng.uniform(0.5, 5)) * float(rng.choice([-1, 1])))
        cycle = Cycle(slider_crank(*size).motion(np.linspace(0, end, n), SPEED, 0.0))
        errors = cycle.error_estimate()
        with mp.workdps(50):
            for name, exact in truth(cycle, size, turn).items():
                error = float(abs(mp.mpf(getattr(cycle, name)) - exact))
                pairs.setdefault(name, []).append((error, errors[name]))
    for some in pairs.values():
        judge(some)


def test_a_flywheel_against_a_closed_form() -> None:
    """A weight on an arm: ∫ τ dq = m·g·r·sin q goes from -m·g·r to m·g·r; what the spline leaves out is no rounding."""
    m = Mechanism(
        {"O": 0j}, {"arm": Link({"O": 0j}, mass=2.0, center=0.5)}, inputs=Input(link="arm"), gravity=-9.81j
    )
    cycle = Cycle(m.motion(np.linspace(0, 2 * np.pi, 2881), 10.0))
    assert 0 < cycle.error_estimate()["fluctuation"] < 1e-13
    assert cycle.fluctuation == pytest.approx(2 * 9.81, rel=1e-12)


def test_a_peak_at_a_row_of_a_table() -> None:
    """Two straight lines meet at 2 rad: the place of the peak is known as well as the row."""
    rows = ((0.0, 0.0), (2.0, -5.0), (2 * np.pi, 0.0))
    m = Mechanism(
        {"O": 0j},
        {"arm": Link({"O": 0j, "P": 1.0})},
        inputs=Input(link="arm"),
        torques=[Torque("arm", history=rows, over="angle", periodic=True)],
    )
    cycle = Cycle(m.motion(np.linspace(0, 2 * np.pi, 361), 1.0, 0.0))
    errors = cycle.error_estimate()
    assert abs(cycle.peak - 5) <= errors["peak"] <= 1e-12
    assert abs(cycle.peak_at - 2) <= errors["peak_at"] <= 1e-12


def test_a_law_over_time() -> None:
    """There and back against a torque of 3 N·m: the work is none, the mean 3 N·m."""
    m = Mechanism(
        {"O": 0j},
        {"arm": Link({"O": 0j, "P": 1.0})},
        inputs=Input(link="arm"),
        torques=[Torque("arm", -3.0)],
    )
    t = np.linspace(0, 1, 51)
    turning = 2 * np.pi * t
    speed, acceleration = 2 * np.pi**2 * np.sin(turning), 4 * np.pi**3 * np.cos(turning)
    motion = m.motion(np.pi * (1 - np.cos(turning)), speed, acceleration)
    motion.poses.time = t
    cycle = Cycle(motion)
    errors = cycle.error_estimate()
    assert errors["work"] <= 1e-12
    assert abs(cycle.mean - 3) <= errors["mean"] <= 1e-14
    assert abs(cycle.rms - 3) <= errors["rms"] <= 1e-14
    assert abs(cycle.peak - 3) <= errors["peak"] <= 1e-14


@pytest.mark.parametrize("n", [2, 3, 4, 5, 40])
@pytest.mark.parametrize("periodic", [False, True])
def test_the_spline_is_that_of_scipy(n: int, periodic: bool) -> None:
    rng = np.random.default_rng(n)
    x, y = np.sort(rng.normal(size=n)), rng.normal(size=n)
    if periodic:
        y[-1] = y[0]
    own = Spline(DoubledArray(x), DoubledArray(y), periodic)
    other = CubicSpline(x, y, bc_type="periodic" if periodic else "not-a-knot")
    for at in (x[0], 0.7 * x[0] + 0.3 * x[-1], x[-1]):
        assert float(own.at(at).value) == pytest.approx(float(other(at)), abs=1e-13)
        assert float(own.up_to(at).value) == pytest.approx(float(other.integrate(x[0], at)), abs=1e-13)
    back = Spline(DoubledArray(x[::-1]), DoubledArray(y[::-1]), periodic)
    assert float(back.up_to(x[0])) == pytest.approx(-float(other.integrate(x[0], x[-1])), abs=1e-13)


def test_a_parallelogram_through_its_change_points() -> None:
    """A torque of 2 N·m on the rocker, which turns with the crank: the weights' work is none over a turn."""
    m = Mechanism(
        {"A": 0j, "D": 3 + 0j},
        {
            "crank": Link({"A": 0j, "B": 1}, mass=1, center=0.5, inertia=0.1),
            "coupler": Link({"B": 0j, "C": 3}, mass=2, center=1.2 + 0.1j, inertia=0.3),
            "rocker": Link({"D": 0j, "C": 1}, mass=1, center=0.3, inertia=0.1),
        },
        inputs=Input("crank"),
        guess=Guess(1.0, {"coupler": 0.0, "rocker": 1.0}),
        gravity=-9.81j,
        torques=[Torque("rocker", 2.0)],
    )
    for turns, n in ((1, 361), (-2, 721), (1, 100)):
        cycle = Cycle(m.motion(np.linspace(0.1, 0.1 + 2 * np.pi * turns, n), 3.0, 0.0))
        off = abs(cycle.work + 4 * np.pi * turns)
        assert off <= cycle.error_estimate()["work"] + 1e-15 <= 1.5 * off + 2e-15


@pytest.mark.parametrize("n", [2, 3, 4])
def test_a_cycle_of_few_poses(n: int) -> None:
    m = slider_crank(0.3, 1.0, 0.1, 1.0, 2.0)
    errors = Cycle(m.motion(np.linspace(0.2, 1.0, n), SPEED, 0.0)).error_estimate()
    assert all(np.isfinite(error) for error in errors.values())
