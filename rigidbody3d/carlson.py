"""Carlson's symmetric elliptic integrals to 32 digits, by the duplication theorem.

B. C. Carlson, Numerical Algorithms 10 (1995) 13-26; NIST Digital Library of Mathematical Functions, §19.36(i): duplication draws the
arguments together, and a series of order seven ends it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dalembert.arithmetic.doubled_arrays import DoubledArray

Doubled = Any
"""A `DoubledArray`, or what enters its operations."""

SPREAD = 3e-5
"""The share of their mean by which the arguments may differ at the end: the series leaves out its eighth power."""


def first(x: Doubled, y: Doubled, z: Doubled) -> Doubled:
    """R_F(x, y, z) of numbers that are not negative, at most one of them 0.

    >>> float(first(DoubledArray(1.0), 2.0, 4.0).value)
    0.6850858166...
    """
    x, y, z = _together(x, y, z)
    for _ in range(40):
        mean = (x + y + z) / 3
        if _near(mean, x, y, z):
            break
        a, b, c = np.sqrt(x), np.sqrt(y), np.sqrt(z)
        shift = a * b + b * c + c * a
        x, y, z = (x + shift) / 4, (y + shift) / 4, (z + shift) / 4
    X, Y = 1 - x / mean, 1 - y / mean
    Z = -X - Y
    e2, e3 = X * Y - Z * Z, X * Y * Z
    # DLMF 19.36.1
    series = 1 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44
    series = series - 5 * e2 * e2 * e2 / 208 + 3 * e3 * e3 / 104 + e2 * e2 * e3 / 16
    return series / np.sqrt(mean)


def third(x: Doubled, y: Doubled, z: Doubled, p: Doubled) -> Doubled:
    """R_J(x, y, z, p) with p no less than the others, of which at most one is 0.

    >>> float(third(DoubledArray(2.0), 3.0, 4.0, 5.0).value)
    0.1429757966...
    """
    x, y, z, p = _together(x, y, z, p)
    delta = (p - x) * (p - y) * (p - z)
    total, factor = 0.0 * x, 1.0
    for _ in range(40):
        mean = (x + y + z + 2 * p) / 5
        if _near(mean, x, y, z, p):
            break
        a, b, c, d = np.sqrt(x), np.sqrt(y), np.sqrt(z), np.sqrt(p)
        across = (d + a) * (d + b) * (d + c)
        e = delta * factor**3 / (across * across)
        total = total + _elementary(e) * factor / across
        shift = a * b + b * c + c * a
        x, y, z, p = ((v + shift) / 4 for v in (x, y, z, p))
        factor /= 4
    X, Y, Z = 1 - x / mean, 1 - y / mean, 1 - z / mean
    P = -(X + Y + Z) / 2
    e2 = X * Y + X * Z + Y * Z - 3 * P * P
    e3 = X * Y * Z + 2 * e2 * P + 4 * P * P * P
    e4 = (2 * X * Y * Z + e2 * P + 3 * P * P * P) * P
    e5 = X * Y * Z * P * P
    # DLMF 19.36.2
    series = 1 - 3 * e2 / 14 + e3 / 6 + 9 * e2 * e2 / 88 - 3 * e4 / 22 - 9 * e2 * e3 / 52 + 3 * e5 / 26
    series = series - e2 * e2 * e2 / 16 + 3 * e3 * e3 / 40 + 3 * e2 * e4 / 20
    series = series + 45 * e2 * e2 * e3 / 272 - 9 * (e3 * e4 + e2 * e5) / 68
    return series * factor / (mean * np.sqrt(mean)) + 6 * total


def _elementary(e: Doubled) -> Doubled:
    """R_C(1, 1 + e), arctan(√e)/√e, for e ≥ 0."""
    root = np.sqrt(np.where(e > 1e-60, e, 1.0))
    return np.where(e > 1e-60, np.arctan(root) / root, 1.0)


def _together(*x: Doubled) -> list[Doubled]:
    return list(np.broadcast_arrays(*(v if isinstance(v, DoubledArray) else DoubledArray(v) for v in x)))


def _near(mean: Doubled, *x: Doubled) -> bool:
    return all((np.abs((v - mean).high) <= SPREAD * mean.high).all() for v in x)
