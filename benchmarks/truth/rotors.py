"""Corrections from known masses, in rational numbers."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def exact_corrections(moment: Complex, z: Real, planes: Real) -> list[tuple[Fraction, Fraction]]:
    """Solve min Σ|W|² under Σ U + Σ W = 0, Σ U z + Σ W z_p = 0 in rational numbers (one plane: the first only)."""
    p = [Fraction(x) for x in planes.tolist()]
    parts = []
    for part in (moment.real, moment.imag):
        u = [Fraction(x) for x in part.tolist()]
        force = sum(u)
        if len(p) == 1:
            parts.append([-force])
            continue
        couple = sum(a * Fraction(b) for a, b in zip(u, z.tolist(), strict=True))
        # the multipliers of the two conditions: W_p = a + b z_p
        n, s, q = Fraction(len(p)), sum(p), sum(x * x for x in p)
        a = (-force * q + couple * s) / (n * q - s * s)
        b = (-couple * n + force * s) / (n * q - s * s)
        parts.append([a + b * x for x in p])
    return list(zip(*parts, strict=True))


def off(found: complex, true: tuple[Fraction, Fraction]) -> float:
    """Return the distance of a complex double from an exact complex number."""
    return math.hypot(Fraction(found.real) - true[0], Fraction(found.imag) - true[1])
