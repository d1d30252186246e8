"""The formulas of balancing in numbers of 32 digits: what they and floats differ by is the error of the floats.

Corrections from known masses as in `balancing.correction`; every least-squares problem of the room, which all are
A x + b = r with Σ|r|² least, by Gram and Schmidt's orthogonalisation in its modified form (Å. Björck, BIT 7 (1967)
1-21), whose error is the condition number times 1e-32.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.doubled_vectors import Vectors, part, total

Real = NDArray[np.float64]

HIDDEN = 2.0**-102
"""What a sum in 32 digits may be off by, of the sizes of its terms."""


class ExactMasses(NamedTuple):
    """Unbalances (..., k) at z (..., k), and planes (..., p), as they are exactly."""

    moment: Vectors
    z: Doubled
    planes: Doubled

    @property
    def static(self) -> Vectors:
        """Σ U."""
        return self.moment.total()

    def about(self, z: Doubled) -> Vectors:
        """Σ U (z_i - z) for positions z (..., q)."""
        arms = part(self.z, (..., None, slice(None))) - part(z, (..., None))
        return (self.moment[..., None, :] * arms).total()

    @property
    def corrections(self) -> Vectors:
        """W_p = -Σ_q (z_p - z_q) M_q / Σ_{q<r} (z_q - z_r)², (..., p); in one plane -Σ U."""
        if self.planes.high.shape[-1] == 1:
            return -self.static[..., None]
        apart = part(self.planes, (..., slice(None), None)) - part(self.planes, (..., None, slice(None)))
        square = total(total(apart * apart)) / 2.0
        moments = self.about(self.planes)
        return -((moments[..., None, :] * apart).total() / part(square, (..., None)))

    def residual(self, made: Vectors, about: Doubled) -> tuple[Vectors, Vectors]:
        """What corrections as made (..., p) leave: Σ U + Σ W, and the couple about a position (...)."""
        lever = self.planes - part(about, (..., None))
        couple = self.about(part(about, (..., None)))[..., 0] + (made * lever).total()
        return self.static + made.total(), couple


def smallest_squares(a: Vectors, b: Vectors) -> tuple[Vectors, Vectors]:
    """Return x (..., n) with Σ|b + A x|² least, and b + A x (..., m); of A (..., m, n), b (..., m).

    Examples
    --------
    >>> a, b = Vectors.of(np.array([[3, -2], [5, -2], [5, -3]])), Vectors.of(np.array([1, -1, 0]))
    >>> x, _ = smallest_squares(a, b)
    >>> (x * np.array(21.0)).value.real
    array([17., 31.])
    """
    n = a.shape[-1]
    columns = [a[..., k] for k in range(n)]
    upper: list[list[Vectors]] = []
    shares: list[Vectors] = []
    for k in range(n):
        q = columns[k]
        back, square = q.conj, total(q.square)
        row = []
        for j in range(k + 1, n):
            share = (back * columns[j]).total() / square
            columns[j] = columns[j] - q * share[..., None]
            row.append(share)
        share = (back * b).total() / square
        b = b - q * share[..., None]
        upper.append(row)
        shares.append(share)
    x: list[Vectors] = []
    for row, share in zip(reversed(upper), reversed(shares), strict=True):
        value = -share
        for above, solved in zip(row, reversed(x), strict=True):
            value = value - above * solved
        x.append(value)
    return Vectors.joined([each[..., None] for each in reversed(x)], axis=-1), b
