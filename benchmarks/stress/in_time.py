"""Stress of motion under forces against closed forms: the error at every time against the estimate that is given."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

import mpmath as mp
import numpy as np

from benchmarks.stress.pairs import Pairs
from benchmarks.truth import double_pendulum, falling_four_bar
from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism, Spring, Torque
from virtualwork.intime.run import Run

G, DIGITS = 9.81, 50


def _asked(rng: np.random.Generator, longest: float = 20.0) -> tuple[Any, float]:
    """Times, few or some, and an accuracy."""
    end = 10.0 ** rng.uniform(-0.5, np.log10(longest))
    times = [0.0, end] if rng.random() < 0.5 else np.linspace(0, end, rng.integers(3, 9))
    return times, 10.0 ** rng.uniform(-12, -2)


def _pairs(run: Run, exact: Any) -> Pairs:
    """The error and the estimate at every time but the first."""
    with mp.workdps(DIGITS):
        return [
            (float(abs(mp.mpf(q) - exact(mp.mpf(t)))), estimate)
            for t, q, estimate in zip(
                run.t[1:].tolist(),
                run.angle[1:, 0].tolist(),
                run.error_estimate[1:, 0].tolist(),
                strict=True,
            )
        ]


def _pendulum(rng: np.random.Generator) -> Pairs:
    """A pendulum of 1 m that swings, from rest or not: sin(θ/2) = k sn(√g t + u₀ | k²) (Whittaker, §44)."""
    bob = Link({"O": 0j, "P": 1 + 0j}, mass=1, center=1 + 0j)
    m = Mechanism({"O": 0j}, {"bob": bob}, inputs=Input(link="bob"), gravity=-1j * G)
    at, speed = float(rng.uniform(-3.0, -0.1)), float(rng.choice([0.0, rng.uniform(-4, 4)]))
    with mp.workdps(DIGITS):
        theta, g = mp.mpf(at) + mp.pi / 2, mp.mpf(G)
        k2 = (mp.mpf(speed) ** 2 / 2 - g * mp.cos(theta) + g) / (2 * g)
        if k2 >= 1:
            return []
        k = mp.sqrt(k2)
        start = mp.mpf(1) if theta > 0 and not speed else mp.sin(theta / 2) / k
        start = mp.mpf(-1) if theta < 0 and not speed else start
        u = mp.ellipf(mp.asin(start), k2)
        u = 2 * mp.ellipk(k2) - u if speed < 0 else u

    times, accuracy = _asked(rng)
    run = m.simulate(times, angle=at, speed=speed, accuracy=accuracy)
    return _pairs(run, lambda t: 2 * mp.asin(k * mp.ellipfun("sn", u + mp.sqrt(g) * t, m=k2)) - mp.pi / 2)


def _damped(stiffness: float, damping: float, at: float, times: Any, accuracy: float) -> Pairs:
    """A block of 1 kg on a spring with a damper, released at rest: its two exponentials."""
    m = Mechanism(
        {"O": 0j},
        {"block": Link({"P": 0j}, mass=1)},
        guides=[Guide("P", "block", turned=0.0)],
        inputs=Input(slider="P", value=0.0),
        springs=[Spring((("block", 0j), ("ground", -1 + 0j)), stiffness, 1.0, damping)],
    )
    with mp.workdps(DIGITS):
        c, k, x = mp.mpf(damping), mp.mpf(stiffness), mp.mpf(at)
        fast = (-c - mp.sqrt(c * c - 4 * k)) / 2
        slow = k / fast
        part = -x * slow / (fast - slow)
    run = m.simulate(times, angle=at, accuracy=accuracy)
    return _pairs(run, lambda t: mp.re(part * mp.exp(fast * t) + (x - part) * mp.exp(slow * t)))


def _oscillator(rng: np.random.Generator) -> Pairs:
    """From swinging to stiff."""
    damping, stiffness = (10.0 ** rng.uniform([-2, -1], [3, 3])).tolist()
    return _damped(stiffness, damping, 0.5, *_asked(rng))


def _stiff(rng: np.random.Generator) -> Pairs:
    """Up to 1 GN/m, damped so that it comes to rest within some fifty swings, and long after that."""
    stiffness = float(10.0 ** rng.uniform(2, 9))
    damping = float(10.0 ** rng.uniform(-1, 3)) * stiffness**0.5
    at = float(rng.choice([0.5, 1e-3, -1e-2]))
    return _damped(stiffness, damping, at, np.linspace(0, 1, 4), 10.0 ** rng.uniform(-8, -2))


def _wheels(rng: np.random.Generator) -> Pairs:
    """Two wheels on gears of a ratio n, a torque on each: α = (T₁ + n T₂)/(I₁ + n² I₂)."""
    ratio = float(rng.choice([1.0, -1 / 3, -0.5, -2.0, 0.25]))
    one, two = (10.0 ** rng.uniform(-2, 2, 2)).tolist()
    first, second = (rng.normal(size=2) * 10.0 ** rng.uniform(-2, 2, 2)).tolist()
    at, speed = rng.normal(), rng.normal() * 10
    m = Mechanism(
        {"A": 0j, "B": 4 + 0j},
        {"one": Link({"A": 0j}, inertia=one), "two": Link({"B": 0j}, inertia=two)},
        gears=[Gear(("one", "two"), ratio)],
        inputs=Input(link="one"),
        torques=[Torque("one", first), Torque("two", second)],
    )
    with mp.workdps(DIGITS):
        n = mp.mpf(ratio)
        alpha = (mp.mpf(first) + n * mp.mpf(second)) / (mp.mpf(one) + n * n * mp.mpf(two))
    times, accuracy = _asked(rng)
    run = m.simulate(times, angle=at, speed=speed, accuracy=accuracy)
    return _pairs(run, lambda t: mp.mpf(at) + mp.mpf(speed) * t + alpha * t * t / 2)


def _double_pendulum(rng: np.random.Generator) -> Pairs:
    """Two points on bars of 1 m, from rest anywhere: the Taylor series with 40 digits."""
    bars = {
        "upper": Link({"O": 0j, "P": 1 + 0j}, mass=1, center=1 + 0j),
        "lower": Link({"P": 0j, "Q": 1 + 0j}, mass=1, center=1 + 0j),
    }
    m = Mechanism({"O": 0j}, bars, inputs=[Input(link="upper"), Input(link="lower")], gravity=-1j * G)
    start = rng.uniform(-3, 3, 2).tolist()
    a, b = (format(Decimal(x), "f") for x in start)
    exact = double_pendulum.state(1, a, b, steps=120)
    pairs: Pairs = []
    for accuracy in (10.0 ** rng.uniform(-12, -2, 3)).tolist():
        run = m.simulate([0, 1], angle=start, accuracy=accuracy)
        with mp.workdps(DIGITS):
            pairs += [
                (float(abs(mp.mpf(q) - x)), estimate)
                for q, x, estimate in zip(
                    run.angle[-1].tolist(), exact[:2], run.error_estimate[-1].tolist(), strict=True
                )
            ]
    return pairs


def _falling_four_bar(rng: np.random.Generator) -> Pairs:
    """A crank-rocker from rest at any crank angle above, at a time and some accuracies: by its energy, as a quadrature."""
    a, b, c, d = (float(getattr(falling_four_bar, x)) for x in ("CRANK", "COUPLER", "ROCKER", "BASE"))
    parts = zip(
        ("A B", "B C", "D C"), (a, b, c), falling_four_bar.MASSES, falling_four_bar.INERTIAS, strict=True
    )
    links = {
        names.replace(" ", ""): Link(
            {names[0]: 0j, names[2]: complex(x)},
            mass=float(mass),
            center=complex(x / 2),
            inertia=float(inertia),
        )
        for names, x, mass, inertia in parts
    }
    at = float(rng.uniform(0.4, 1.4))
    guess = Guess(np.pi / 3, {"BC": 0.47, "DC": 1.73})
    m = Mechanism(
        {"A": 0j, "D": complex(d)}, links, inputs=Input(link="AB", value=at), guess=guess, gravity=-1j * G
    )
    end = float(rng.uniform(0.3, 3.0))
    try:
        exact = falling_four_bar.angle(mp.mpf(end), mp.mpf(at), 20, 160)
    except ArithmeticError:
        return []
    pairs: Pairs = []
    for accuracy in (10.0 ** rng.uniform(-12, -2, 4)).tolist():
        pairs += _pairs(m.simulate([0, end], angle=at, accuracy=accuracy), lambda _: exact)
    return pairs


CAMPAIGNS = {
    "pendulum in time": ("any start and accuracy, against elliptic functions", _pendulum),
    "damped oscillator in time": ("from swinging to stiff, against its exponentials", _oscillator),
    "stiff oscillator in time": ("to rest and long after, against its exponentials", _stiff),
    "geared wheels in time": ("constant torques, against their parabola", _wheels),
    "four-bar in time": ("from any height, against a quadrature by its energy", _falling_four_bar),
    "double pendulum in time": ("any start, against Taylor series of 40 digits", _double_pendulum),
}
