"""Rigid bodies: momentum of many states; free rotation, the heavy top and integration against extended precision."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cli.bench.measure import Measurement, measured, reference
from rigidbody3d import FreeBody, Motion, Top, integrate
from rigidbody3d.attitude import angle_between

Array = NDArray[np.float64]

DOMAIN = "rotation"


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time and error of momentum and wrench, and of rotations in time."""
    rng = np.random.default_rng(3)
    states = 100_000 if quick else 1_000_000
    I = np.diag([1.0, 2.0, 2.5]) - 0.1
    w, alpha, a = rng.normal(size=(3, states, 3))
    exact = _exact_rate(I, w[:50], alpha[:50])
    for method, work in (("blocks", _blocks), ("einsum", _einsum)):
        found = work(I, w[:50], alpha[:50], a[:50])[1]
        error = float(np.abs(found - exact).max() / np.abs(exact).max())
        call = partial(work, I, w, alpha, a)
        yield measured(DOMAIN, "H, its rate and -m a", method, call, size=states, error=error, aim_ns=20)
    for body in reference("rotation")["bodies"]:
        inertia, omega, answers = body["inertia"], body["omega"], body["answers"]
        times = np.array([answer["t_s"] for answer in answers])
        wanted = np.array([answer["attitude"] for answer in answers])
        many = np.linspace(0, 20, 1000 if quick else 10_000)
        error = float(angle_between(FreeBody(inertia, omega).at(times).attitude, wanted).max())
        yield measured(
            DOMAIN,
            f"free rotation: {body['name']}",
            "closed form",
            partial(_free, inertia, omega, many),
            size=len(many),
            error=error,
            aim_ns=2000,
            aim_error=1e-14 * (1 + 20 * float(np.linalg.norm(omega))),
        )
        for rtol in (1e-6, 1e-10, 1e-13):
            run = partial(integrate, inertia, omega, t=times[-1:], rtol=rtol)
            error = float(angle_between(run().attitude, wanted[-1:])[0])
            yield measured(
                DOMAIN,
                f"free rotation: {body['name']}",
                f"DOP853, {rtol:g}, one state",
                run,
                error=error,
                budget=0.1,
            )
    many = np.linspace(0, 20, 1000 if quick else 10_000)
    top = ([1, 1, 0.6], 1.2, [0.5, 1.0, 3.0], [0.8, 0.6, 0, 0])
    yield measured(DOMAIN, "heavy top", "closed form", partial(_top, top, many), size=len(many), aim_ns=2000)


def _blocks(I: Array, w: Array, alpha: Array, a: Array) -> tuple[Array, Array, Array]:
    motion = Motion(I, w, alpha, mass=2.0, acceleration=a)
    rate = motion.rate
    return motion.momentum, rate, motion.inertia_force


def _einsum(I: Array, w: Array, alpha: Array, a: Array) -> tuple[Array, Array, Array]:
    H = np.einsum("ij,nj->ni", I, w)
    return H, np.einsum("ij,nj->ni", I, alpha) + np.cross(w, H), -2.0 * a


def _free(inertia: Any, omega: Any, t: Array) -> Array:
    state = FreeBody(inertia, omega).at(t)
    return state.omega + state.attitude[:, :3]


def _top(given: Any, t: Array) -> Array:
    return Top(*given).at(t).attitude


def _exact_rate(I: Array, w: Array, alpha: Array) -> Array:
    """I α + ω × I ω in rational numbers."""
    from fractions import Fraction

    tensor = [[Fraction(x) for x in row] for row in I.tolist()]
    out = []
    for spin, rate in zip(w.tolist(), alpha.tolist(), strict=True):
        x = [Fraction(v) for v in spin]
        r = [Fraction(v) for v in rate]
        H = [sum(t * v for t, v in zip(row, x, strict=True)) for row in tensor]
        out.append(
            [
                float(
                    sum(t * v for t, v in zip(tensor[i], r, strict=True))
                    + x[(i + 1) % 3] * H[(i + 2) % 3]
                    - x[(i + 2) % 3] * H[(i + 1) % 3]
                )
                for i in range(3)
            ]
        )
    return np.array(out)


# --- random campaigns at singular places: the error, and the bound ε·(1 + phase) that the documentation states ---


def _there_and_back(rng: np.random.Generator) -> list[tuple[float, float]]:
    """Momentum and energy from the state itself, at moments and motions near every special case."""
    moments = np.sort(rng.uniform(0.05, 1, 3))
    moments = np.array([moments[0] + moments[1], moments[1] + moments[2], moments[2] + moments[0]])
    near = 10.0 ** rng.uniform(-16, 0)
    if rng.integers(2):
        moments[1] = moments[0] * (1 + near)
    omega = rng.normal(size=3) * 10.0 ** rng.uniform(-12, 0, 3) * 10.0 ** rng.uniform(-6, 6)
    if rng.integers(2):  # near the separatrix
        I1, I2, I3 = np.sort(moments)
        order = np.argsort(moments)
        if I3 > I2 > I1:
            ratio = np.sqrt(I1 * (I2 - I1) / (I3 * (I3 - I2)))
            omega[order[2]] = ratio * omega[order[0]] * (1 + near * rng.normal())
    size = float(np.linalg.norm(omega))
    body = FreeBody(moments, omega)
    state = body.at(rng.uniform(-100, 100) / size)
    H, E = float(np.linalg.norm(body.momentum)), float(body.energy)
    return [
        (float(np.abs(state.momentum - body.momentum).max()) / H, 4e-15),
        (abs(float(state.energy) - E) / E, 4e-15),
        (abs(float(np.linalg.norm(state.attitude)) - 1), 1e-15),
    ]


def _back_again(rng: np.random.Generator) -> list[tuple[float, float]]:
    """Two spans of time are one: the attitude after both against that after their sum."""
    moments = np.sort(rng.uniform(0.2, 1, 3))
    moments[2] = min(moments[2], moments[0] + moments[1])
    omega = rng.normal(size=3)
    size = float(np.linalg.norm(omega))
    first, second = rng.uniform(0, 30, 2) / size
    body = FreeBody(moments, omega)
    middle = body.at(first)
    parts = FreeBody(moments, middle.omega, middle.attitude).at(second)
    # what rounding of the state in the middle does grows with the time and, near the separatrix, with the distance
    slack = 4e-16 * (1 + (first + second) * size) * (1 + 0.1 / float(body.separatrix))
    return [(float(angle_between(parts.attitude, body.at(first + second).attitude)), slack)]


CAMPAIGNS = {
    "free rotation, kept quantities": ("near symmetric, near the separatrix, near the axes", _there_and_back),
    "free rotation in two spans": ("random bodies, phases to 60 rad", _back_again),
}
