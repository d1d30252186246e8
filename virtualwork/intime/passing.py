"""Where a polynomial over a step passes a level: from its control values, that enclose it, and its own turns.

Over a step a coordinate is the polynomial of degree 5 through q, q̇ and q̈ at both ends. Its control values b_i in
Σ C(n, i) xⁱ (1 − x)ⁿ⁻ⁱ b_i, 0 ≤ x ≤ 1, are those of Bernstein's form (G. Farin, Curves and Surfaces for CAGD, 5th ed.,
2002, ch. 6): the polynomial lies between the least and the largest, so that most steps need no further look, and what
is linear in the coordinates has the same linear combination of their control values.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import comb
from typing import Any

import numpy as np

from virtualwork.formulas.numbers import EPS, Reals

# degree of a coordinate's polynomial; of one through samples of what is not linear in the coordinates
DEGREE, SAMPLED = 5, 6
# halvings until a share of a step has all digits of the polynomial
HALVINGS = 40


def offsets(v: Any, a: Any, h: Any, dq: Any, v1: Any, a1: Any) -> tuple[Any, ...]:
    """Control values of a coordinate over a step, less its value at the beginning: numbers or arrays.

    `v`, `a` at the beginning, `v1`, `a1` at the end; `dq` is the change.

    >>> offsets(1.0, 0.0, 1.0, 1.0, 1.0, 0.0)
    (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
    """
    first, last = 0.2 * h * v, 0.2 * h * v1
    return (
        0.0 * dq,
        first,
        2 * first + 0.05 * h * h * a,
        dq - 2 * last + 0.05 * h * h * a1,
        dq - last,
        dq,
    )


def speeds(v: Any, a: Any, h: Any, c: Sequence[Any], v1: Any, a1: Any) -> tuple[Any, ...]:
    """Control values of the coordinate's speed, as a polynomial of degree 5 too; `c` are the coordinate's `offsets`.

    >>> [round(x, 12) for x in speeds(0.0, 1.0, 1.0, offsets(0.0, 1.0, 1.0, 0.5, 1.0, 1.0), 1.0, 1.0)]
    [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    """
    of = v, v + 0.25 * h * a, 5 * (c[3] - c[2]) / h, v1 - 0.25 * h * a1, v1
    inner = (0.2 * i * of[i - 1] + (1 - 0.2 * i) * of[i] for i in range(1, 5))
    return v, *inner, v1


@cache
def basis(degree: int, samples: int) -> Reals:
    """Bernstein's polynomials at evenly spaced shares of a step, (samples + 1, degree + 1)."""
    return weights(np.linspace(0.0, 1.0, samples + 1), degree)


@cache
def through() -> Reals:
    """The control values of the polynomial through evenly spaced samples, as a matrix (samples, samples)."""
    return np.asarray(np.linalg.inv(basis(SAMPLED, SAMPLED)))


def weights(x: Reals, degree: int) -> Reals:
    """Bernstein's polynomials at shares x (…), (…, degree + 1)."""
    i = np.arange(degree + 1)
    x = np.asarray(x)[..., None]
    return np.asarray([comb(degree, j) for j in i] * x**i * (1 - x) ** (degree - i))


def turns(b: Reals) -> Reals:
    """Shares of the step between which polynomials (n, degree + 1) rise or fall, rising from 0 to 1: (n, degree + 1).

    Some may stand twice, and some be no turn: none is left out.

    Examples
    --------
    x² − x turns at 0.5:

    >>> turns(np.array([[0.0, -0.5, 0.0]]))
    array([[0. , 0.5, 1. ]])
    """
    d = np.diff(b, axis=1)
    d = d / np.maximum(np.abs(d).max(axis=1, keepdims=True), 1e-300)
    n, m = len(d), d.shape[1] - 1
    out = np.zeros((n, m + 2))
    out[:, -1] = 1.0
    if m:
        # in x/(1 − x) the slope is a polynomial with these coefficients; a root far out is the step's end
        of = d * [comb(m, j) for j in range(m + 1)]
        of[:, -1] = np.where(np.abs(of[:, -1]) < EPS, EPS, of[:, -1])
        companion = np.zeros((n, m, m))
        companion[:, range(1, m), range(m - 1)] = 1.0
        companion[:, :, -1] = -of[:, :-1] / of[:, -1:]
        roots = np.linalg.eigvals(companion).real
        out[:, 1:-1] = np.sort(np.where(roots > 0, roots / (1 + np.abs(roots)), 0.0), axis=1)
    return out


def at(b: Reals, x: Reals) -> Reals:
    """Polynomials (n, degree + 1) at shares (n, m) each."""
    return np.asarray((weights(x, b.shape[1] - 1) * b[:, None]).sum(axis=-1))


def zero(g: Reals, low: Reals, high: Reals) -> Reals:
    """Where polynomials (n, degree + 1) that are positive at shares `low` (n,) and are not at `high` come to zero."""
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        beyond = at(g, middle[:, None])[:, 0] <= 0
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return np.asarray(0.5 * (low + high))
