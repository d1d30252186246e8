"""Measured vibration: least squares by QR, SVD and normal equations, the minimax problem, many rotors at once."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from balancing import (
    influence_coefficients,
    influence_from_amplitudes,
    least_squares,
    minimax,
    place_from_stock,
)
from benchmarks.speed.measure import Measurement, measured, worst
from benchmarks.truth import reference
from benchmarks.truth.rotors import off

Complex = NDArray[np.complex128]

DOMAIN = "field"


def as_complex(pairs: Any) -> Complex:
    """Read [re, im] pairs."""
    both = np.asarray(pairs, dtype=float)
    return np.asarray(both[..., 0] + 1j * both[..., 1])


def measure(quick: bool) -> Iterator[Measurement]:
    """Yield time and error of the solvers of 24 × 8 problems, and of tables of rotors of two planes and two sensors."""
    yield from _least_squares()
    yield from _minimax()
    yield from _other_jobs()
    yield from _rotors((1, 100, 10_000) if quick else (1, 10, 100, 1000, 10_000, 100_000))


def _least_squares() -> Iterator[Measurement]:
    work = "least squares, 24 sensors × 8 planes"
    cases = reference("least_squares")["cases"]
    for case in cases:
        alpha, v, true = (as_complex(case[key]) for key in ("influence", "initial", "corrections"))
        for method, solve, aim in (
            ("QR, the library's", _qr, 40e3),
            ("SVD (numpy's lstsq)", _svd, None),
            ("normal equations, a warning", _normal, None),
        ):
            found = solve(alpha, v)
            yield measured(
                DOMAIN,
                work,
                method,
                partial(solve, alpha, v),
                error=worst(found, true),
                condition=case["condition"],
                aim_ns=aim if case is cases[0] else None,
                budget=0.1,
            )


def _qr(alpha: Complex, v: Complex) -> Complex:
    return least_squares(alpha, v).corrections


def _svd(alpha: Complex, v: Complex) -> Complex:
    return np.asarray(np.linalg.lstsq(alpha, -v, rcond=None)[0])


def _normal(alpha: Complex, v: Complex) -> Complex:
    """The corrections by ᾱᵀα w = -ᾱᵀV, as most texts print it: half of the digits."""
    adjoint = alpha.conj().T
    return np.asarray(np.linalg.solve(adjoint @ alpha, -(adjoint @ v)))


def _minimax() -> Iterator[Measurement]:
    known = reference("minimax")
    alpha, v, true = as_complex(known["influence"]), as_complex(known["initial"]), known["objective"]
    fix = minimax(alpha, v)
    assert fix.bound is not None
    work = "minimax, 24 sensors × 8 planes"
    call = partial(minimax, alpha, v)
    error = float(abs(fix.residual_max - true)) / true
    yield measured(
        DOMAIN, work, "the largest residual", call, error=error, aim_ns=2.5e6, aim_error=1e-9, budget=0.5
    )
    error = abs(fix.bound - true) / true
    yield measured(DOMAIN, work, "its dual bound: no corrections leave less", call, error=error)


def _other_jobs() -> Iterator[Measurement]:
    """Yield the four-run method, from amplitudes without phases, and the choice among weights in stock."""
    masses = 12.3 * np.exp(2j * np.pi * np.arange(3) / 3)
    true = 0.1 + 0.3j
    readings = np.abs(6.1 + true * masses)[:, None]
    call = partial(influence_from_amplitudes, [6.1], readings, masses)
    error = float(abs(call().influence[0] / true - 1))
    yield measured(DOMAIN, "other jobs", "four runs, amplitudes alone", call, error=error)
    arms = 2 * np.pi * np.arange(16) / 16
    stock = partial(place_from_stock, 17.3 * np.exp(1j), arms, [1, 2, 5])
    yield measured(DOMAIN, "other jobs", "three weights in stock, 16 places", stock)


def _rotors(sizes: tuple[int, ...]) -> Iterator[Measurement]:
    rng = np.random.default_rng(5)
    most = max(sizes)

    def draw(*shape: int) -> Complex:
        return np.asarray(rng.normal(size=(most, *shape)) + 1j * rng.normal(size=(most, *shape)))

    initial, trials = draw(2), draw(2, 2)
    masses = np.asarray(rng.uniform(0.5, 2.0, (most, 2, 1)) * np.eye(2) + 0j)
    work = "rotors of two planes and two sensors"
    for rotors in sizes:
        part = slice(0, rotors)

        def balanced(part: slice = part) -> Complex:
            alpha = influence_coefficients(initial[part], trials[part], masses[part])
            return least_squares(alpha, initial[part]).corrections

        found = balanced()
        error = max(
            _error(initial[i], trials[i], masses[i].diagonal(), found[i]) for i in range(min(rotors, 20))
        )
        yield measured(DOMAIN, work, "coefficients and corrections", balanced, size=rotors, error=error)


Exact = tuple[Fraction, Fraction]


def _exact(z: complex) -> Exact:
    return Fraction(z.real), Fraction(z.imag)


def _times(a: Exact, b: Exact) -> Exact:
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _minus(a: Exact, b: Exact) -> Exact:
    return a[0] - b[0], a[1] - b[1]


def _over(a: Exact, b: Exact) -> Exact:
    size = b[0] * b[0] + b[1] * b[1]
    return _times(a, (b[0] / size, -b[1] / size))


def _error(initial: Complex, trials: Complex, masses: Complex, found: Complex) -> float:
    """Return the error of two corrections over their largest, by Cramer's rule in rational numbers."""
    v = [_exact(z) for z in initial.tolist()]
    alpha = [
        [_over(_minus(_exact(trials[p, s]), v[s]), _exact(masses[p])) for p in range(2)] for s in range(2)
    ]
    (a, b), (c, d) = alpha
    det = _minus(_times(a, d), _times(b, c))
    true = [
        _over(_minus(_times(b, v[1]), _times(d, v[0])), det),
        _over(_minus(_times(c, v[0]), _times(a, v[1])), det),
    ]
    size = max(float(abs(complex(float(x), float(y)))) for x, y in true)
    return max(off(w, t) for w, t in zip(found.tolist(), true, strict=True)) / size
