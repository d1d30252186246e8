"""Real linear systems of loops: from complex columns to solutions, over all poses together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from virtualwork.formulas.numbers import PARALLEL, Number, Reals

# a singular value below this share of the largest is that of a null vector
SINGULAR = 1e-6


def stack(cols: list[list[Number]], n: int) -> Reals:
    """The real Jacobian (n, 2·loops, unknowns) from complex columns."""
    loops, unknowns = len(cols), len(cols[0])
    out = np.empty((n, 2 * loops, unknowns))
    for i, row in enumerate(cols):
        for j, c in enumerate(row):
            out[:, 2 * i, j] = np.real(c)
            out[:, 2 * i + 1, j] = np.imag(c)
    return out


def stack_rows(rows: list[Number], n: int) -> Reals:
    """The real loop gaps (n, 2·loops) from complex ones."""
    out = np.empty((n, 2 * len(rows)))
    for i, w in enumerate(rows):
        out[:, 2 * i] = np.real(w)
        out[:, 2 * i + 1] = np.imag(w)
    return out


def solve(jacobian: Reals, right: Reals) -> Reals:
    """Solve Φ·x = right for each pose; with redundant loops by QR. A singular pose gives NaN, never a least norm."""
    rows, unknowns = jacobian.shape[-2:]
    if rows != unknowns:
        q, r = np.linalg.qr(jacobian)
        right = np.einsum("nij,ni->nj", q, right)
        jacobian = r
    good = np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
    out = np.full((len(right), unknowns), np.nan)
    try:
        out[good] = np.linalg.solve(jacobian[good], right[good][..., None])[..., 0]
    except np.linalg.LinAlgError:
        for i in np.flatnonzero(good):
            try:
                out[i] = np.linalg.solve(jacobian[i], right[i])
            except np.linalg.LinAlgError:
                continue
    return out


def inverse_norm(jacobian: Reals) -> Reals:
    """‖J⁻¹‖∞ of each pose (of the pseudo-inverse, with redundant loops); inf where singular, NaN where unknown."""
    out = np.full(len(jacobian), np.nan)
    good = np.isfinite(jacobian).all(axis=(1, 2))
    some = jacobian[good]
    if some.shape[-2] != some.shape[-1]:
        inverse = np.linalg.pinv(some)
    else:
        try:
            inverse = np.linalg.inv(some)
        except np.linalg.LinAlgError:
            inverse = np.full_like(some, np.inf)
            for i, j in enumerate(some):
                try:
                    inverse[i] = np.linalg.inv(j)
                except np.linalg.LinAlgError:
                    continue
    out[good] = np.abs(inverse).sum(axis=2).max(axis=1, initial=0.0)
    return out


def condition(cols: list[list[Number]], angles: int, size: Number, n: int) -> Reals:
    """‖J⁻¹‖∞ of each pose from complex columns, those of so many angles divided by the mechanism's size."""
    with np.errstate(all="ignore"):
        jacobian = stack(cols, n)
        jacobian[:, :, :angles] /= np.reshape(size, (-1, 1, 1))
        return inverse_norm(jacobian)


def singular_values(cols: list[list[Number]], angles: int, n: int) -> Reals:
    """The singular values of the Jacobian (lengths scaled) at each pose; NaN where it is not assembled."""
    jacobian = stack(cols, n)
    good = np.isfinite(jacobian).all(axis=(1, 2))
    size = np.abs(jacobian[good][:, :, :angles]).max(initial=0.0)
    if angles and size > 0:
        jacobian[:, :, :angles] /= size
    out = np.full((n, min(jacobian.shape[1:])), np.nan)
    out[good] = np.linalg.svd(jacobian[good], compute_uv=False)
    return out


def singular_poses(cols: list[list[Number]], angles: int, n: int) -> NDArray[np.bool_]:
    """Which poses have a Jacobian whose smallest singular value is below 1e-6 of its largest."""
    s = singular_values(cols, angles, n)
    return np.asarray(s[:, -1] < SINGULAR * s[:, 0])


def solve_columns(cols: list[list[Number]], right: list[Number]) -> list[Number]:
    """Solve Σ column·x + right = 0 for the unknowns' derivatives."""
    shape = np.broadcast_shapes(*(np.shape(c) for row in cols for c in row), *(np.shape(w) for w in right))
    n = int(np.prod(shape))
    x = solve(stack(cols, n), -stack_rows(right, n))
    return [x[:, j] if shape else float(x[0, j]) for j in range(x.shape[1])]


def solve_determined(cols: list[list[Number]], right: list[Number], angles: int) -> list[Number]:
    """The same where J is singular in every pose: what a null vector of J moves is not determined, and NaN."""
    shape = np.broadcast_shapes(*(np.shape(c) for row in cols for c in row), *(np.shape(w) for w in right))
    n = int(np.prod(shape))
    jacobian, w = stack(cols, n), stack_rows(right, n)
    good = np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(w).all(axis=1)
    out = np.full((n, jacobian.shape[2]), np.nan)
    if good.any():
        size = np.abs(jacobian[good][:, :, :angles]).max(initial=0.0) or 1.0
        scale = np.array([1.0] * angles + [size] * (jacobian.shape[2] - angles))
        jacobian = jacobian[good] * scale / size
        _, s, null = np.linalg.svd(jacobian)
        loose = (s < SINGULAR * s[:, :1]).astype(float)
        free = np.einsum("nk,nkj->nj", loose, np.abs(null[:, : s.shape[1]])) > SINGULAR
        least = -(np.linalg.pinv(jacobian, rcond=SINGULAR) @ (w[good] / size)[..., None])[..., 0]
        out[good] = np.where(free, np.nan, least * scale)
    return [out[:, j] if shape else float(out[0, j]) for j in range(out.shape[1])]


def solve_transposed(cols: list[list[Number]], loads: list[Number]) -> list[Number]:
    """Solve Σ_c λ_c·∂C_c/∂x + Q_x = 0 for the complex λ of the loops; None is no load."""
    given = [0.0 if load is None else load for load in loads]
    shape = np.broadcast_shapes(*(np.shape(c) for row in cols for c in row), *(np.shape(q) for q in given))
    n = int(np.prod(shape))
    jacobian = np.swapaxes(stack(cols, n), -1, -2)
    right = np.zeros((n, len(loads)))
    for i, load in enumerate(given):
        right[:, i] = -load
    good = np.asarray(np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(right).all(axis=1))
    out = np.full((n, jacobian.shape[-1]), np.nan)
    if jacobian.shape[-1] == jacobian.shape[-2]:
        good &= np.linalg.cond(np.where(good[:, None, None], jacobian, np.eye(len(loads)))) < 1 / PARALLEL
        out[good] = np.linalg.solve(jacobian[good], right[good][..., None])[..., 0]
    found = out[:, 0::2] + 1j * out[:, 1::2]
    return [found[:, c] if shape else complex(found[0, c]) for c in range(found.shape[1])]
