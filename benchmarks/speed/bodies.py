"""Rigid bodies in space: angular momentum, its rate and the inertia force of many states; tensors that are moved."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.speed.measure import Measurement, measured, peak, seconds
from rigidbody3d import Body, Motion, inertia_of

Real = NDArray[np.float64]
Answer = tuple[Real, Real, Real]

DOMAIN = "bodies"


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time and error of H, Ḣ and -m a, beside einsum, and of moving a tensor."""
    rng = np.random.default_rng(11)
    most = 100_000 if quick else 1_000_000
    tensor = np.array([[2.0, -0.3, 0.1], [-0.3, 1.5, -0.2], [0.1, -0.2, 1.0]])
    omega, alpha, acceleration = (rng.normal(size=(most, 3)) for _ in range(3))
    mass = rng.uniform(1, 2, most)
    work = "H, Ḣ and -m a of many states of one body"
    methods: tuple[tuple[str, Callable[..., Answer]], ...] = (
        ("the library's", _ours),
        ("einsum and cross", _einsum),
    )
    for states in [10**k for k in range(8) if 10**k <= most]:
        part = slice(0, states)
        given = tensor, omega[part], alpha[part], mass[part], acceleration[part]
        last = states == most
        beside = seconds(partial(_einsum, *given), 0.3 if last else 0.1) / states * 1e9
        for method, work_out in methods:
            call = partial(work_out, *given)
            error = _error(tensor, omega, alpha, mass, acceleration, call(), min(states, 20))
            known = {"error": error, "bytes": float(peak(call))}
            found = measured(DOMAIN, work, method, call, size=states, budget=0.3 if last else 0.1, **known)
            if last and work_out is _ours:
                found = replace(found, aim_ns=20.0, floor="einsum", ratio=found.ns / beside, aim_ratio=1 / 3)
            yield found
        call = partial(_copy, *given)
        yield measured(DOMAIN, work, "copying as many bytes", call, size=states, budget=0.1)
    yield from _moved(10_000 if quick else 100_000)


def _ours(tensor: Real, omega: Real, alpha: Real, mass: Real, acceleration: Real) -> Answer:
    motion = Motion(tensor, omega, alpha, mass=mass, acceleration=acceleration)
    rate = motion.rate
    return motion.momentum, rate, motion.inertia_force


def _einsum(tensor: Real, omega: Real, alpha: Real, mass: Real, acceleration: Real) -> Answer:
    momentum = np.einsum("ij,nj->ni", tensor, omega)
    rate = np.einsum("ij,nj->ni", tensor, alpha) + np.cross(omega, momentum)
    return momentum, rate, -mass[:, None] * acceleration


def _copy(tensor: Real, omega: Real, alpha: Real, mass: Real, acceleration: Real) -> Answer:
    return omega.copy(), alpha.copy(), acceleration.copy()


def _error(
    tensor: Real, omega: Real, alpha: Real, mass: Real, acceleration: Real, found: Answer, count: int
) -> float:
    """Return the worst error of some states over the size of what was added up, in rational numbers."""
    I = [[Fraction(x) for x in row] for row in tensor.tolist()]
    worst = 0.0
    for n in range(count):
        w, a = ([Fraction(x) for x in row[n].tolist()] for row in (omega, alpha))
        H = [sum(I[i][j] * w[j] for j in range(3)) for i in range(3)]
        rate = [
            sum(I[i][j] * a[j] for j in range(3))
            + w[(i + 1) % 3] * H[(i + 2) % 3]
            - w[(i + 2) % 3] * H[(i + 1) % 3]
            for i in range(3)
        ]
        force = [-Fraction(float(mass[n])) * Fraction(x) for x in acceleration[n].tolist()]
        exact = [[Fraction(x) for x in row] for row in (H, rate, force)]
        for mine, true in zip(found, exact, strict=True):
            off = max(abs(Fraction(x) - y) for x, y in zip(mine[n].tolist(), true, strict=True))
            worst = max(worst, float(off / max(abs(y) for y in true)))
    return worst


def _moved(moves: int) -> Iterator[Measurement]:
    """Yield what is left of a small tensor after it was moved far away and back, many times."""
    start = inertia_of("box", 3.0, width=0.01, height=0.02, depth=0.03)
    offset = np.array([1e4, -2e4, 3e4])
    work = "a tensor moved 37 km away and back"
    body = Body(np.array(3.0), np.zeros(3), start)

    def there_and_back() -> Real:
        return body.moved(offset).moved(-offset).inertia

    def steiner() -> Real:
        """Shifted to the far point and back by the parallel axis theorem, as when the tensor is stored there."""
        far = 3.0 * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        return np.asarray(start + far - far)

    for method, call in (("stored at the centre of mass", there_and_back), ("parallel axes, twice", steiner)):
        off = float(np.abs(call() - start).max() / start.max())
        yield measured(DOMAIN, work, method, call, error=off, budget=0.1)
    many = np.random.default_rng(12).normal(size=(moves, 3))
    bodies = Body(np.full(moves, 3.0), np.zeros((moves, 3)), start)
    yield measured(
        DOMAIN,
        "tensors about many points",
        "parallel axes",
        partial(bodies.about, many),
        size=moves,
        error=_about_error(start, many[:20], bodies.about(many)[:20]),
    )


def _about_error(start: Real, points: Real, found: Real) -> float:
    """Return the worst error of tensors about points, in rational numbers."""
    worst = 0.0
    for at, mine in zip(points.tolist(), found.tolist(), strict=True):
        r = [Fraction(x) for x in at]
        square = sum(x * x for x in r)
        true = [
            [Fraction(start[i, j]) + 3 * ((square if i == j else 0) - r[i] * r[j]) for j in range(3)]
            for i in range(3)
        ]
        off = max(abs(Fraction(mine[i][j]) - true[i][j]) for i in range(3) for j in range(3))
        worst = max(worst, float(off / max(true[i][i] for i in range(3))))
    return worst
