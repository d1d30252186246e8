"""Stress of the kinematics: four-bars and slider-cranks near limits and change points, against 50 digits."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np

from benchmarks.stress.pairs import Pairs
from benchmarks.truth.four_bar import coupler_point
from virtualwork import Guess, Input, Link, Mechanism


def _four_bar(lengths: list[float], angle: float, side: int, omega: float) -> Pairs:
    """Compare C of a four-bar with its closed form in 50 digits: position, velocity, acceleration."""
    a, b, c, d = lengths
    with mp.workdps(50):
        a_, b_, c_, d_ = map(mp.mpf, lengths)
        true = coupler_point(a_, b_, c_, d_, mp.mpf(angle), side, mp.mpf(omega))
    if true is None:
        return []
    pin = complex(true[0])
    crank = a * complex(math.cos(angle), math.sin(angle))
    guess = {
        "coupler": math.atan2((pin - crank).imag, (pin - crank).real),
        "rocker": math.atan2(pin.imag, (pin - d).real),
    }
    m = Mechanism(
        ground={"A": (0, 0), "D": (d, 0)},
        links={
            "crank": Link({"A": (0, 0), "B": (a, 0)}),
            "coupler": Link({"B": (0, 0), "C": (b, 0)}),
            "rocker": Link({"D": (0, 0), "C": (c, 0)}),
        },
        inputs=Input(link="crank"),
        guess=Guess(at=(angle,), angles=guess),
    )
    motion = m.motion(angle, speed=omega, acceleration=0.0)
    if not motion.assembled[0]:
        # within rounding of its limit it may be said not to assemble; farther in that is an error
        return [(0.0 if float(true[3]) < 1e-14 else math.inf, 1.0)]
    point = motion.point("C")
    found = [point.complex(order)[0] for order in range(3)]
    with mp.workdps(50):
        errors = [float(abs(mp.mpc(complex(x)) - t)) for x, t in zip(found, true[:3], strict=True)]
    return [(error, float(point.error_estimate(order)[0])) for order, error in enumerate(errors)]


def _links(rng: np.random.Generator) -> list[float]:
    scale = 10.0 ** rng.uniform(-12, 12)
    return [float(x) for x in scale * 10.0 ** rng.uniform(-0.5, 0.5, 4)]


def _anywhere(rng: np.random.Generator) -> Pairs:
    return _four_bar(
        _links(rng), float(rng.uniform(0, 2 * math.pi)), int(rng.choice([-1, 1])), float(rng.normal() * 10)
    )


def _near_limit(rng: np.random.Generator) -> Pairs:
    """An input 1e-1 … 1e-15 from where coupler and rocker are in line."""
    a, b, c, d = _links(rng)
    for reach in (b + c, abs(b - c)):
        cosine = (a * a + d * d - reach * reach) / (2 * a * d)
        if abs(cosine) < 1:
            limit = math.acos(cosine)
            inward = -1 if reach == b + c else 1
            angle = limit + inward * 10.0 ** rng.uniform(-15, -1)
            return _four_bar([a, b, c, d], angle, int(rng.choice([-1, 1])), float(rng.normal() * 10))
    return []


def _near_change_point(rng: np.random.Generator) -> Pairs:
    """A parallelogram whose coupler is off by 1e-2 … 1e-14, within 1e-1 … 1e-12 of being folded."""
    scale = 10.0 ** rng.uniform(-3, 3)
    a, d = scale * rng.uniform(0.5, 2, 2)
    b = d * (1 + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-14, -2))
    angle = rng.choice([0.0, math.pi]) + rng.choice([-1, 1]) * 10.0 ** rng.uniform(-12, -1)
    return _four_bar(
        [float(a), float(b), float(a), float(d)], float(angle), int(rng.choice([-1, 1])), float(rng.normal())
    )


CAMPAIGNS = {
    "four-bars": ("random lengths, scale 1e-12 … 1e12, both assemblies", _anywhere),
    "near dead points": ("four-bars 1e-1 … 1e-15 from a limit of the input", _near_limit),
    "near change points": ("nearly parallelograms, nearly folded", _near_change_point),
}
