"""Stress of mass properties and momentum: holes, far parts, nearly equal moments, against fractions and 50 digits."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from benchmarks.stress.pairs import Pairs
from rigidbody3d import Body, Motion, Shaft, compose, principal
from rigidbody3d.inertia import turn

Real = NDArray[np.float64]
exact = np.vectorize(Fraction, otypes=[object])
"""Doubles as fractions, in numpy's arrays of objects."""


def _worst(found: Any, true: Any, bound: Any) -> tuple[float, float]:
    """Return error and bound of the component where the error is largest for its bound."""
    off = np.abs(np.asarray(exact(found) - true, dtype=float)).ravel()
    limit = np.broadcast_to(bound, np.shape(found)).ravel()
    ratio = np.divide(off, limit, out=np.where(off > 0, np.inf, 0.0), where=limit > 0)
    k = int(np.argmax(ratio))
    return float(off[k]), float(limit[k])


def _cross(a: Any, b: Any) -> Any:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _point_tensor(mass: Any, offset: Any) -> Any:
    return mass * (offset @ offset * np.eye(3, dtype=int) - np.outer(offset, offset))


def _rotation(rng: np.random.Generator) -> Real:
    return np.linalg.qr(rng.normal(size=(3, 3)))[0]


def _tensor(rng: np.random.Generator, spread: float = 0.0) -> Real:
    """Return the tensor of some body in oblique axes; `spread` > 0: two moments that differ by as little."""
    x, y, z = rng.uniform(0.05, 1, 3)
    moments = np.array([y + z, x + z, x + y])
    if spread:
        moments[1] = moments[0] * (1 + spread)
    return turn(np.diag(moments), _rotation(rng))


def _parts(rng: np.random.Generator) -> Body:
    """Return parts of all sizes, some far away, some of them holes that leave next to nothing."""
    count = int(rng.integers(2, 6))
    scale = 10.0 ** rng.uniform(-12, 12)
    mass = 10.0 ** rng.uniform(-3, 3, count) * 10.0 ** rng.uniform(-12, 12)
    size = 10.0 ** rng.uniform(-3, 0, count)
    center = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-3, 3, (count, 1))
    if rng.integers(2):
        center += rng.normal(size=3) * 10.0 ** rng.uniform(0, 8)
    inertia = np.array([m * s * s * _tensor(rng) for m, s in zip(mass, size, strict=True)])
    if rng.integers(2):  # the first part with a hole that is nearly the whole of it
        left = 10.0 ** rng.uniform(-14, -1)
        mass[1], inertia[1] = -mass[0] * (1 - left), -inertia[0] * (1 - left) ** 2
        center[1] = center[0] + rng.normal(size=3) * left * size[0]
    return Body(mass, center * scale, inertia * scale**2)


def _whole(parts: Body) -> tuple[Any, Any, Any]:
    """Return mass, centre and tensor of parts, in fractions."""
    m, c, I = exact(parts.mass), exact(parts.center), exact(parts.inertia)
    total = m.sum()
    middle = (m[:, None] * c).sum(axis=0) / total
    tensor = I.sum(axis=0) + sum(_point_tensor(*x) for x in zip(m, c - middle, strict=True))
    return total, middle, tensor


def _composition(rng: np.random.Generator) -> Pairs:
    parts = _parts(rng)
    if not parts.mass.sum() > 0:
        return []
    body, (mass, center, tensor) = compose(parts), _whole(parts)
    error = body.error_estimate()
    point = exact(rng.normal(size=3) * np.abs(body.center))
    about = tensor + _point_tensor(mass, center - point)
    at = point.astype(float)
    return [
        _worst(body.mass, mass, error.mass),
        _worst(body.center, center, error.center),
        _worst(body.inertia, tensor, error.inertia),
        _worst(body.about(at), about, body.error_estimate(at).inertia),
    ]


def _shapes(rng: np.random.Generator) -> Pairs:
    """A thin-walled box, as the difference of two, turned: what is left after the hole."""
    wall = 10.0 ** rng.uniform(-12, -0.5)
    scale = 10.0 ** rng.uniform(-12, 12)
    outer = rng.uniform(0.5, 2, 3) * scale
    inner = outer * (1 - wall)
    names = ("width", "height", "depth")
    mass = np.array([outer.prod(), -inner.prod()]) / scale**3
    sizes = dict(zip(names, np.stack([outer, inner], axis=-1), strict=True))
    R = _rotation(rng)
    each = Body.of("box", mass, np.zeros((2, 3)), **sizes)
    body = compose(each).turned(R)
    own = []
    for m, sides in zip(exact(mass), exact(np.stack([outer, inner])), strict=True):
        a, b, c = sides**2 / 12 * m
        own.append(np.diag([b + c, a + c, a + b]))
    Q = exact(R)
    return [
        _worst(each.inertia, np.array(own), each.error_estimate().inertia),
        _worst(body.inertia, Q @ (own[0] + own[1]) @ Q.T, body.error_estimate().inertia),
    ]


# --- principal moments ---


def _eigen(tensor: Any) -> tuple[Real, Any]:
    """Return principal moments and axes (rows) to 50 digits, ascending."""
    values, vectors = mp.eigsy(
        mp.matrix([[mp.mpf(x.numerator) / x.denominator for x in row] for row in tensor])
    )
    order = sorted(range(3), key=lambda i: values[i])
    return np.array([values[i] for i in order]), np.array([[vectors[j, i] for j in range(3)] for i in order])


def _off(found: Real, true: Any) -> Real:
    """Return |found - true| of numbers of 50 digits, where doubles are exact."""
    return np.array(
        [float(abs(mp.mpf(float(x)) - y)) for x, y in zip(found.ravel(), np.ravel(true), strict=True)]
    )


def _largest(off: Real, bound: Real) -> tuple[float, float]:
    limit = np.broadcast_to(bound, off.shape).ravel()
    k = int(np.argmax(off / np.maximum(limit, 1e-300)))
    return float(off[k]), float(limit[k])


def _axes(found: Any, tensor: Any, worked_out: Any = None) -> Pairs:
    with mp.workdps(50):
        moments, axes = _eigen(tensor)
        error = found.error_estimate(worked_out)
        signs = [1 if mp.fdot(a, map(float, b)) > 0 else -1 for a, b in zip(axes, found.axes, strict=True)]
        axes = np.array([s * row for s, row in zip(signs, axes, strict=True)])
        return [
            _largest(_off(found.moments, moments), error.moments),
            _largest(_off(found.axes, axes), error.axes.ravel()),
        ]


def _near_moments(rng: np.random.Generator) -> Pairs:
    tensor = _tensor(rng, 10.0 ** rng.uniform(-15, -1)) * 10.0 ** rng.uniform(-12, 12)
    return _axes(principal(tensor), exact(tensor))


def _flat(rng: np.random.Generator) -> Pairs:
    """Particles near one oblique plane: I1 + I2 = I3 to 1e-1 … 1e-15, or near one line."""
    count = int(rng.integers(3, 7))
    thick = 10.0 ** rng.uniform(-8, -1, 2) * [1.0, rng.integers(2)]
    at = rng.normal(size=(count, 3)) * [1.0, thick[0] if thick[1] else 1.0, thick[1] or thick[0]]
    center = (at @ _rotation(rng)) * 10.0 ** rng.uniform(-12, 12)
    parts = Body(rng.uniform(0.1, 1, count), center, np.zeros((count, 3, 3)))
    body = compose(parts)
    return _axes(body.principal, _whole(parts)[2], body.in_32_digits.inertia)


# --- momentum and shafts ---


def _momentum(rng: np.random.Generator) -> Pairs:
    """H, Ḣ, energy of a whole of parts, one or many states, where the rate nearly vanishes too."""
    parts = _parts(rng)
    if not parts.mass.sum() > 0:
        return []
    body = compose(parts)
    mass, center, I = _whole(parts)
    w, alpha, frame, v, a = rng.normal(size=(5, 3)) * 10.0 ** rng.uniform(-6, 6)
    if rng.integers(2) and np.linalg.cond(body.inertia) < 1e12:  # all but no moment is needed
        H = body.inertia @ w
        alpha = np.linalg.solve(body.inertia, -np.cross(w, H)) * (1 + 10.0 ** rng.uniform(-14, 0))
    turning = bool(rng.integers(2))
    many = not turning and bool(rng.integers(2))
    given = [np.stack([x, x]) if many else x for x in (w, alpha, v, a)]
    motion = Motion(
        body.inertia,
        given[0],
        given[1],
        frame if turning else None,
        body.mass,
        body.center,
        velocity=given[2],
        acceleration=given[3],
    )
    point = body.center + rng.normal(size=3) * np.abs(body.center)
    w, alpha, frame, v, a, at = map(exact, (w, alpha, frame, v, a, point))
    H = I @ w
    if turning:
        alpha = alpha + _cross(frame, w)
    rate = I @ alpha + _cross(w, H)
    true: dict[str, Any] = {
        "rate": rate,
        "momentum": H,
        "transport": _cross(frame if turning else w, H),
        "force": mass * a,
        "energy": mass * (v @ v) / 2 + w @ H / 2,
        "momentum_about": H + _cross(center - at, mass * v),
        "rate_about": rate + _cross(center - at, mass * a),
    }
    if turning:
        true["relative"] = rate - true["transport"]
    found: dict[str, Any] = {
        "momentum_about": lambda: motion.momentum_about(point),
        "rate_about": lambda: motion.rate_about(point),
    }
    return [
        _worst(
            found.get(name, lambda name=name: getattr(motion, name))(),
            np.array([answer, answer]) if many else answer,
            motion.error_estimate(name, point, body.in_32_digits),
        )
        for name, answer in true.items()
    ]


def _shaft(rng: np.random.Generator) -> Pairs:
    """Bearing forces and drive torque of a balanced rotor: what is left of large unbalances."""
    parts = _parts(rng)
    if not parts.mass.sum() > 0:
        return []
    body = compose(parts)
    span = np.abs(parts.center).max() + 1e-300
    z = np.sort(rng.uniform(-1, 1, 2)) * span
    if rng.integers(2):
        z[1] = z[0] + span * 10.0 ** rng.uniform(-9, 0)
    if z[0] == z[1]:
        return []
    speed, pull = rng.normal(size=2) * 10.0 ** rng.uniform(-3, 4)
    shaft = Shaft(body, z, speed, pull, rng.normal(size=3) * 10)
    mass, center, I = _whole(parts)
    z1, z2 = exact(z)
    s, p, g = Fraction(float(speed)), Fraction(float(pull)), exact(shaft.gravity)
    across = center[:2]
    dynamic, static = [], []
    for here, other in ((z1, z2), (z2, z1)):
        x, y = (-I[:2, 2] + mass * across * (center[2] - other)) / (here - other)
        dynamic.append([-s * s * x - p * y, -s * s * y + p * x])
        static.append(-mass * (g[:2] * (center[2] - other) - across * g[2]) / (here - other))
    about = I[2, 2] + mass * (across @ across)
    torque = about * p - mass * (across[0] * g[1] - across[1] * g[0])
    answers: tuple[tuple[str, Any], ...] = (
        ("dynamic", np.array(dynamic)),
        ("static", np.array(static)),
        ("drive_torque", torque),
    )
    return [_worst(getattr(shaft, name), true, shaft.error_estimate(name)) for name, true in answers]


CAMPAIGNS: dict[str, tuple[str, Callable[[np.random.Generator], Pairs]]] = {
    "bodies of parts": ("holes that leave 1e-1 … 1e-14, parts far away, scales 1e-12 … 1e12", _composition),
    "thin walls": ("a box less a box, walls of 0.3 … 1e-12 of it, turned", _shapes),
    "nearly equal principal moments": ("two moments that differ by 1e-1 … 1e-15", _near_moments),
    "nearly flat masses": ("particles near a plane or a line, to 1e-1 … 1e-8 of their size", _flat),
    "momentum of bodies of parts": ("with holes, far parts, and rates that nearly vanish", _momentum),
    "shafts with attached parts": ("with holes, far parts, and bearings close together", _shaft),
}
