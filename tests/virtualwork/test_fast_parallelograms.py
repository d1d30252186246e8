"""A parallelogram without gravity keeps its speed: through hundreds of change points, in some hundred steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from virtualwork import Guess, Input, Link, Mechanism
from virtualwork.intime.estimate import LEAST
from virtualwork.intime.run import Run


def parallelogram(crank: float, ground: float, at: float) -> Mechanism:
    return Mechanism(
        {"A": 0j, "D": ground + 0j},
        {
            "crank": Link({"A": 0j, "B": crank + 0j}, mass=1, center=crank / 2 + 0j, inertia=0.01),
            "coupler": Link({"B": 0j, "C": ground + 0j}, mass=2, center=ground / 2 + 0j, inertia=0.02),
            "rocker": Link({"D": 0j, "C": crank + 0j}, mass=1.5, center=crank / 2 + 0j, inertia=0.02),
        },
        inputs=Input(link="crank"),
        guess=Guess(at, {"coupler": 0.0, "rocker": at}),
    )


def said_so(run: Run, accuracy: float) -> bool:
    """Whether the accuracy is reached, or a warning says that it is not."""
    return run.error_estimate.max() <= accuracy or any("is beyond rounding" in w for w in run.warnings)


@pytest.mark.parametrize(
    ("crank", "ground", "at", "speed"),
    [
        (0.1, 0.4, 1.0, 200.0),
        (0.1, 0.4, 1.0, -20.0),
        (1.0, 2.0, 1.0, 200.0),
        (0.2, 0.3, 0.5, 200.0),
        (0.3, 0.3, 1.0, 200.0),
    ],
)
def test_speed_is_kept(crank: float, ground: float, at: float, speed: float) -> None:
    times = np.linspace(0, 1, 11)
    run = parallelogram(crank, ground, at).simulate(times, angle=at, speed=speed)
    assert run.ended == "end"
    assert said_so(run, 1e-9)
    # it took 200 000 steps, and came to no end for minutes
    assert run.fine.steps < 2000
    np.testing.assert_allclose(run.angle[:, 0], at + speed * times, rtol=0, atol=1e-10 * abs(speed))


@pytest.mark.parametrize(
    ("crank", "ground", "speed", "accuracy"),
    [
        (0.1, 0.4, 200.0, 1e-6),
        (0.1, 0.4, -200.0, 1e-9),
        (1.0, 2.0, 200.0, 1e-9),
        # a rhombus: a single stage of a long step lies next to a change point, with its weight over the whole step
        (0.3, 0.3, 20.0, 1e-9),
        (0.3, 0.3, 0.1, 1e-9),
    ],
)
def test_the_error_is_within_its_estimate(crank: float, ground: float, speed: float, accuracy: float) -> None:
    """Without loads it turns uniformly: close to change points rounding of the rates is all that errs."""
    bounded(crank, ground, 1.0, speed, accuracy)


def bounded(crank: float, ground: float, at: float, speed: float, accuracy: float) -> None:
    times = np.linspace(0, 1, 11)
    run = parallelogram(crank, ground, at).simulate(times, angle=at, speed=speed, accuracy=accuracy)
    error = np.abs(run.angle[:, 0] - at - speed * times)
    assert run.ended == "end"
    assert said_so(run, accuracy)
    assert np.all(error <= run.error_estimate[:, 0])
    # and close to it: rounding of some turns with the largest weight of a stage, 5.8, not of a choice of poses that
    # rounding itself makes
    assert run.error_estimate.max() <= max(accuracy, 5e-9 * abs(speed))


def test_rates_close_to_a_change_point_are_interpolated_from_far_poses() -> None:
    """Where the rates vanish what poses miss is rounding: the nearer they are the more."""
    from virtualwork.intime.run import _own

    run = parallelogram(0.1, 0.4, 1.0).simulate([0.0, 0.1], angle=1.0, speed=20.0)
    equations = _own(run.assembly).equations
    rates = [equations(0.0, [q], [1.0])[0] for q in np.linspace(1.0, 10.0, 2000)]
    # its share of the square of the speed; it was 1e-8
    assert np.abs(rates).max() < 1e-11


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_estimates_at_random(seed: int) -> None:
    """Any lengths, speeds to 500 rad/s, both ways, and accuracies."""
    rng = np.random.default_rng(seed)
    crank, ground = 10 ** rng.uniform(-1.5, 0.5, 2)
    at, sense = rng.uniform(0.2, 2.9), rng.choice([-1, 1], 2)
    bounded(crank, ground, at * sense[0], 10 ** rng.uniform(-1, 2.7) * sense[1], 10 ** rng.uniform(-12, -4))


@pytest.mark.parametrize("accuracy", [1e-9, 1e-11])
def test_nothing_is_asked_below_rounding(accuracy: float, monkeypatch: pytest.MonkeyPatch) -> None:
    import virtualwork.intime.run as module

    asked, travel = [], module.travel

    def noted(*args: object, **more: object) -> object:
        asked.append(args[3])
        return travel(*args, **more)

    monkeypatch.setattr(module, "travel", noted)
    run = parallelogram(0.1, 0.4, 1.0).simulate([0.0, 0.2], angle=1.0, speed=30.0, accuracy=accuracy)
    assert said_so(run, accuracy)
    assert min(asked) >= LEAST
    assert abs(run.angle[-1, 0] - 7.0) < 1e-8


def test_a_pendulum_that_is_asked_too_much_says_so() -> None:
    bob = Link({"O": 0j, "P": 1 + 0j}, mass=1, center=1 + 0j)
    m = Mechanism({"O": 0j}, {"bob": bob}, inputs=Input(link="bob"), gravity=-9.81j)
    run = m.simulate([0.0, 1.0], angle=0.0, accuracy=1e-18)
    assert said_so(run, 1e-18)
    # of 1 m, from rest at the side: independent, in 50 digits
    assert math.isclose(run.angle[-1, 0], swung(), rel_tol=0, abs_tol=run.error_estimate[-1, 0])


def swung() -> float:
    """The angle after 1 s by the elliptic function: sin(φ/2) = k sn(K − ω t), φ from the lowest place."""
    from mpmath import asin, ellipfun, ellipk, mp, mpf, sqrt

    with mp.workdps(50):
        k, omega = sqrt(mpf(1) / 2), sqrt(mpf(9.81))
        phi = 2 * asin(k * ellipfun("sn", ellipk(k**2) - omega, k=k))
        return float(phi - mp.pi / 2)
