"""Estimates of many poses at once, of toothed mechanisms and of redundant statics, against truths of their own."""

from __future__ import annotations

import os
from typing import Any

import mpmath as mp
import numpy as np

from benchmarks.stress.random_linkages import four_bar
from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.doubled_functions import DOUBLED
from virtualwork import Belt, Guess, Guide, Input, Link, Mechanism, Rack

Pairs = list[tuple[float, float]]
# poses of a sweep, and steps of Newton's method from its answers in 32 digits
POSES, STEPS = 300, 4


class _Plane:
    """A complex doubled number."""

    def __init__(self, x: Any, y: Any) -> None:
        self.x, self.y = x, y

    @classmethod
    def turn(cls, angle: Doubled) -> _Plane:
        sine, cosine = DOUBLED.sincos(angle)
        return cls(cosine, sine)

    def __mul__(self, factor: Any) -> _Plane:
        return _Plane(self.x * factor, self.y * factor)

    def __add__(self, other: _Plane) -> _Plane:
        return _Plane(self.x + other.x, self.y + other.y)

    def __sub__(self, other: _Plane) -> _Plane:
        return _Plane(self.x - other.x, self.y - other.y)

    def turned(self) -> _Plane:
        """A quarter turn on."""
        return _Plane(-self.y, self.x)


def _solved(p: _Plane, q: _Plane, right: _Plane) -> tuple[Doubled, Doubled]:
    """u, v with u·p − v·q = right, by Cramer's rule."""
    d = p.y * q.x - p.x * q.y
    return (right.y * q.x - right.x * q.y) / d, (right.y * p.x - right.x * p.y) / d


def sweep(rng: np.random.Generator) -> Pairs:
    """A four-bar at many inputs at once, 1 … 1e-9 rad from a limit: by its angles, with Newton's method in 32 digits."""
    m, at = four_bar(rng, float(rng.choice([-1, 1])) * 1e-3, 1.0, limit=True)
    limit = _limit(m, at)
    if limit is None:
        return []
    off = 10.0 ** rng.uniform(-9, 0, POSES)
    q = limit + np.sign(at - limit) * off
    speed, acceleration = (float(x) for x in rng.normal(size=2) * 3)
    engine = os.environ.get("DALEMBERT_ENGINE")
    os.environ["DALEMBERT_ENGINE"] = str(rng.choice(["numpy", "llvm"]))
    try:
        motion = m.motion(q, speed, acceleration)
        here = motion.assembled
        names = [
            "points.C",
            *(f"links.{link}.{k}" for link in ("coupler", "rocker") for k in ("angle", "omega", "alpha")),
        ]
        estimates = motion.error_estimates(*names)
        links = motion.link("coupler"), motion.link("rocker")
        answers = [motion.point("C").complex(0), *(v for x in links for v in (x.angle, x.omega, x.alpha))]
    finally:
        del os.environ["DALEMBERT_ENGINE"]
        if engine is not None:
            os.environ["DALEMBERT_ENGINE"] = engine
    truth = _truth(m, q, speed, acceleration, links[0].angle, links[1].angle)
    pairs: Pairs = []
    for name, answer, true in zip(names, answers, truth, strict=True):
        parts = [answer] if len(true) == 1 else [answer.real, answer.imag]
        error = np.zeros(len(q))
        for part, exact in zip(parts, true, strict=True):
            error = np.hypot(error, (part - exact.high) - exact.low)
        pairs += zip(error[here].tolist(), estimates[name][here].tolist(), strict=True)
    return pairs


def _limit(m: Mechanism, at: float) -> float | None:
    """The limit of the input beside a pose, by the lengths alone, rounded."""
    a, b, c, d = _lengths(m)
    cosines = [(a * a + d * d - r * r) / (2 * a * d) for r in (b + c, abs(b - c))]
    limits = [sign * float(np.arccos(x)) for x in cosines if abs(x) < 1 for sign in (1, -1)]
    return min(limits, key=lambda q: abs(q - at), default=None)


def _lengths(m: Mechanism) -> tuple[float, float, float, float]:
    a, b, c = (
        float(abs(m.links[link].points[point]))
        for link, point in (("crank", "B"), ("coupler", "C"), ("rocker", "C"))
    )
    return a, b, c, float(complex(m.ground["D"]).real)


def _truth(m: Mechanism, q: Any, speed: float, acceleration: float, *angles: Any) -> list[list[Doubled]]:
    a, b, c, d = _lengths(m)
    crank = _Plane.turn(Doubled(q)) * a
    coupler, rocker = (Doubled(np.array(x)) for x in angles)
    base = _Plane(Doubled(d), Doubled(0.0))
    for _ in range(STEPS):
        p, r = _Plane.turn(coupler) * b, _Plane.turn(rocker) * c
        gap = crank + p - r - base
        u, v = _solved(p.turned(), r.turned(), gap * -1.0)
        coupler, rocker = coupler + u, rocker + v
    p, r = _Plane.turn(coupler) * b, _Plane.turn(rocker) * c
    w3, w4 = _solved(p.turned(), r.turned(), crank.turned() * -speed)
    # ω²·r of each link, and the crank's own
    right = crank * (Doubled(speed) * speed) - crank.turned() * acceleration + p * (w3 * w3) - r * (w4 * w4)
    a3, a4 = _solved(p.turned(), r.turned(), right)
    pin = r + base
    return [[pin.x, pin.y], [coupler], [w3], [a3], [rocker], [w4], [a4]]


def toothed(rng: np.random.Generator) -> Pairs:
    """A wheel whose belt turns a pinion whose rack slides: places, rates and the effort in a line each."""
    first, second, radius, angle, inertia, mass = (float(x) for x in rng.uniform(0.1, 3.0, 6))
    crossed = bool(rng.random() < 0.5)
    along = complex(np.cos(angle), np.sin(angle))
    m = Mechanism(
        ground={"O": 0j, "P": 4 + 0j},
        links={
            "wheel": Link({"O": 0j}, inertia=inertia),
            "pinion": Link({"P": 0j, "E": complex(*rng.normal(size=2))}, inertia=2 * inertia),
            "rack": Link({"R": 0j}, mass),
        },
        guides=[Guide("R", "rack", through=4 - 1j * radius * along, angle=angle, turned=0.0)],
        racks=[Rack("pinion", "R", radius)],
        belts=[Belt(("wheel", "pinion"), (first, second), crossed)],
        inputs=Input(link="wheel", value=0.0),
    )
    q = rng.uniform(-20, 20, 12)
    rates = [float(x) for x in rng.normal(size=2) * 3]
    motion = m.motion(q, *rates)
    pinion, point, slide = motion.link("pinion"), motion.point("E"), motion.slide("R")
    found = [
        (pinion.omega, pinion.error_estimate(1)),
        (pinion.alpha, pinion.error_estimate(2)),
        (slide.speed, slide.error_estimate(1)),
        (slide.acceleration, slide.error_estimate(2)),
        *((point.complex(k), point.error_estimate(k)) for k in (0, 1, 2)),
        (motion.effort, motion.dynamics.error_estimate().effort[:, 0]),
    ]
    pairs: Pairs = []
    with mp.workdps(50):
        ratio = mp.mpf(first) / mp.mpf(second) * (-1 if crossed else 1)
        w, alpha = (ratio * mp.mpf(rate) for rate in rates)
        arm = mp.mpc(m.links["pinion"].points["E"])
        inert = mp.mpf(inertia) + ratio**2 * (mp.mpf(2 * inertia) + mp.mpf(mass) * mp.mpf(radius) ** 2)
        for i, at in enumerate(q.tolist()):
            turned = arm * mp.expj(ratio * mp.mpf(at))
            true = [
                w,
                alpha,
                radius * w,
                radius * alpha,
                4 + turned,
                1j * w * turned,
                (1j * alpha - w * w) * turned,
                inert * mp.mpf(rates[1]),
            ]
            for exact, (value, bound) in zip(true, found, strict=True):
                error = abs(exact - mp.mpmathify(value[i].item()))
                pairs.append((0.0 if error < mp.mpf(10) ** -35 else float(error), float(bound[i])))
    return pairs


def platform(rng: np.random.Generator) -> Pairs:
    """A platform on parallel cranks: what each carries nobody knows; the torque is W·r·cos q."""
    cranks = int(rng.integers(3, 6))
    radius, gravity, mass = (float(x) for x in rng.uniform(0.3, 9.0, 3))
    bars = {f"bar{i}": Link({f"A{i}": 0j, f"B{i}": radius}) for i in range(cranks)}
    top = Link({f"B{i}": complex(i) for i in range(cranks)}, mass, complex(*rng.uniform(-1, 1, 2)))
    m = Mechanism(
        ground={f"A{i}": complex(i) for i in range(cranks)},
        links={**bars, "top": top},
        inputs=Input(link="bar0"),
        guess=Guess(at=1.0, angles={**{f"bar{i}": 1.0 for i in range(1, cranks)}, "top": 0.0}),
        gravity=-1j * gravity,
    )
    q = rng.uniform(0.2, 2.9, 8)
    dynamics = m.motion(q).dynamics
    bounds = dynamics.error_estimate()
    pairs: Pairs = []
    with mp.workdps(40):
        for i, at in enumerate(q):
            true = mp.mpf(mass) * mp.mpf(gravity) * mp.mpf(radius) * mp.cos(mp.mpf(float(at)))
            for value, bound in (
                (dynamics.newton_euler, bounds.newton_euler),
                (dynamics.effort, bounds.effort),
            ):
                pairs.append((float(abs(true - mp.mpf(float(value[i, 0])))), float(bound[i, 0])))
    return pairs


CAMPAIGNS = {
    "sweeps beside limits": ("four-bars at 300 inputs at once, 1 … 1e-9 rad from a limit", sweep),
    "toothed": ("a wheel, its belt, a pinion, its rack: by a line each", toothed),
    "redundant platforms": ("on three to five parallel cranks: the torque", platform),
}
