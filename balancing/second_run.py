"""The formulas of balancing in numbers of 32 digits: what they and floats differ by is the error of the floats.

Corrections from known masses as in `balancing.correction`; every least-squares problem of the room, which all are
A x + b = r with Σ|r|² least, by Gram and Schmidt's orthogonalisation in its modified form (Å. Björck, BIT 7 (1967)
1-21), whose error is the condition number times 1e-32.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing.dependence import threshold
from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.doubled_arrays import Vectors
from dalembert.arithmetic.doubled_operations import part, total

Real = NDArray[np.float64]

HIDDEN = 2.0**-102
"""The possible error of a sum in 32 digits, as a share of the sizes of its terms."""


class ExactMasses(NamedTuple):
    """Unbalances (..., k) at z (..., k), and planes (..., p), as they are exactly."""

    moment: Vectors
    z: Doubled
    planes: Doubled

    @property
    def static(self) -> Vectors:
        """Σ U."""
        return self.moment.sum()

    def about(self, z: Doubled) -> Vectors:
        """Σ U (z_i - z) for positions z (..., q)."""
        arms = part(self.z, (..., None, slice(None))) - part(z, (..., None))
        return (self.moment[..., None, :] * arms).sum()

    @property
    def corrections(self) -> Vectors:
        """W_p = -Σ_q (z_p - z_q) M_q / Σ_{q<r} (z_q - z_r)², (..., p); in one plane -Σ U."""
        if self.planes.high.shape[-1] == 1:
            return -self.static[..., None]
        apart = part(self.planes, (..., slice(None), None)) - part(self.planes, (..., None, slice(None)))
        square = total(total(apart * apart)) / 2.0
        moments = self.about(self.planes)
        return -((moments[..., None, :] * apart).sum() / part(square, (..., None)))

    def residual(self, made: Vectors, about: Doubled) -> tuple[Vectors, Vectors]:
        """Return the residual of corrections as made (..., p): Σ U + Σ W, and the couple about a position (...)."""
        lever = self.planes - part(about, (..., None))
        couple = self.about(part(about, (..., None)))[..., 0] + (made * lever).sum()
        return self.static + made.sum(), couple


def smallest_squares(a: Vectors, b: Vectors) -> tuple[Vectors, Vectors]:
    """Return x (..., n) with Σ|b + A x|² least, and b + A x (..., m); of A (..., m, n), b (..., m).

    Examples
    --------
    >>> a, b = Vectors.of(np.array([[3, -2], [5, -2], [5, -3]])), Vectors.of(np.array([1, -1, 0]))
    >>> x, _ = smallest_squares(a, b)
    >>> (x * np.array(21.0)).value.real
    array([17., 31.])
    """
    columns, upper = _orthogonal(a)
    shares: list[Vectors] = []
    for q in columns:
        share = (q.conj() * b).sum() / total(q.square)
        b = b - q * share[..., None]
        shares.append(share)
    x: list[Vectors] = []
    for row, share in zip(reversed(upper), reversed(shares), strict=True):
        value = -share
        for above, solved in zip(row, reversed(x), strict=True):
            value = value - above * solved
        x.append(value)
    return Vectors.joined([each[..., None] for each in reversed(x)], axis=-1), b


def least_norm(a: Vectors, b: Vectors) -> Vectors:
    """Return the x (..., n) of least Σ|x|² with b + A x = 0; of A (..., m, n), b (..., m), m <= n.

    Examples
    --------
    >>> least_norm(Vectors.of(np.array([[1, 2]])), Vectors.of(np.array([-5]))).value.real
    array([1., 2.])
    """
    columns, upper = _orthogonal(
        Vectors.joined([a[..., k, :, None].conj() for k in range(a.shape[-2])], axis=-1)
    )
    shares: list[Vectors] = []
    for k in range(len(columns)):
        share = -b[..., k]
        for j, before in enumerate(shares):
            share = share - upper[j][k - j - 1].conj() * before
        shares.append(share)
    x = columns[0] * (shares[0] / total(columns[0].square))[..., None]
    for q, share in zip(columns[1:], shares[1:], strict=True):
        x = x + q * (share / total(q.square))[..., None]
    return x


def _orthogonal(a: Vectors) -> tuple[list[Vectors], list[list[Vectors]]]:
    """Return orthogonal columns and by what shares of them the later columns of A are more than theirs."""
    columns = [a[..., k] for k in range(a.shape[-1])]
    upper: list[list[Vectors]] = []
    for k, q in enumerate(columns):
        back, square = q.conj(), total(q.square)
        upper.append([])
        for j in range(k + 1, len(columns)):
            share = (back * columns[j]).sum() / square
            columns[j] = columns[j] - q * share[..., None]
            upper[k].append(share)
    return columns, upper


def pseudo_inverse(a: Vectors) -> Vectors:
    """Return A⁺ (..., n, m) of A (..., m, n); its rank is that of the floats nearest to it.

    Of lower rank A = C F, C independent columns of it, has A⁺ = F⁺ C⁺.

    Examples
    --------
    >>> pseudo_inverse(Vectors.of(np.array([[1, 1], [1, 1]]))).value.real
    array([[0.25, 0.25],
           [0.25, 0.25]])
    """
    rows, columns = a.shape[-2:]
    floats = a.value
    sigma = np.linalg.svd(floats, compute_uv=False)
    rank = (sigma > threshold(rows, columns) * sigma[..., :1]).sum(axis=-1)
    if (rank == columns).all():
        # A = Q U with orthogonal columns of Q: A⁺ = U⁻¹ Q⁺
        orthogonal, upper = _orthogonal(a)
        x: list[Vectors] = []
        for q, row in zip(reversed(orthogonal), reversed(upper), strict=True):
            value = q.conj() / part(total(q.square), (..., None))
            for share, below in zip(row, reversed(x), strict=True):
                value = value - below * share[..., None]
            x.append(value)
        return Vectors.joined([each[..., None, :] for each in reversed(x)], axis=-2)
    inverse = Vectors.of(np.zeros((*a.shape[:-2], columns, rows)))
    for case in np.ndindex(rank.shape):
        one, few = a[case], int(rank[case])
        if few == columns:
            inverse[case] = pseudo_inverse(one)
        elif few:
            left: Any = pseudo_inverse(one[:, _independent(floats[case], few)])
            right: Any = least_norm((left @ one)[None], Vectors.of(-np.eye(few)))
            inverse[case] = np.swapaxes(right, -1, -2) @ left
    return inverse


def _independent(a: NDArray[np.complex128], rank: int) -> list[int]:
    """Return the numbers of independent columns, each the largest off the span of those before."""
    left, numbers = a.copy(), list[int]()
    for _ in range(rank):
        sizes = np.linalg.norm(left, axis=0)
        sizes[numbers] = -1.0
        numbers.append(int(np.argmax(sizes)))
        q = left[:, numbers[-1]] / sizes[numbers[-1]]
        left -= np.outer(q, q.conj() @ left)
    return sorted(numbers)


def root_of(covariance: Vectors) -> Vectors:
    """Return Cholesky's root (..., p, p) of covariances, which may be singular."""
    root = Vectors.of(np.zeros(covariance.shape))
    for j in range(covariance.shape[-1]):
        for i in range(j, covariance.shape[-1]):
            rest: Any = covariance[..., i, j] - (root[..., i, :j] * root[..., j, :j].conj()).sum()
            if i == j:
                # what is left in the rounding of 32 digits is nothing
                some = rest.x.high > 1e-28 * covariance[..., j, j].x.high
                size = np.sqrt(np.where(some, rest.real, 1.0))
                rest = rest.real
            root[..., i, j] = rest / size * some.astype(float)
    return root
