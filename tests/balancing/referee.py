"""The problems of balancing under limits as clarabel solves them: an independent solver of cone problems."""

from __future__ import annotations

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def _cones(rows: Complex, offset: Complex, radius: Real, with_t: Real) -> tuple[Real, Real]:
    """|rows w + offset| <= radius + with_t t  as  G x + s = h over x = (Re w, Im w, t), s in cones of three."""
    k, p = rows.shape
    g, h = np.zeros((k, 3, 2 * p + 1)), np.zeros((k, 3))
    g[:, 0, -1], h[:, 0] = -with_t, radius
    g[:, 1, :p], g[:, 1, p:-1], h[:, 1] = -rows.real, rows.imag, offset.real
    g[:, 2, :p], g[:, 2, p:-1], h[:, 2] = -rows.imag, -rows.real, offset.imag
    return g.reshape(3 * k, 2 * p + 1), h.ravel()


def _solve(p: Real, q: Real, parts: list[tuple[Real, Real]]) -> tuple[Complex, str]:
    g, h = np.concatenate([g for g, _ in parts]), np.concatenate([h for _, h in parts])
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-10
    settings.max_iter = 500
    cones = [clarabel.SecondOrderConeT(3)] * (len(h) // 3)
    got = clarabel.DefaultSolver(
        sparse.csc_matrix(np.triu(p)), q, sparse.csc_matrix(g), h, cones, settings
    ).solve()
    x = np.array(got.x)
    n = (len(x) - 1) // 2
    return x[:n] + 1j * x[n:-1], str(got.status)


def minimax_by_clarabel(alpha: Complex, v: Complex, limit: Real) -> tuple[Complex, str]:
    """The corrections of the least largest residual with |w_p| <= limit_p, and how the solver ended."""
    s, p = alpha.shape
    unit = np.abs(v).max()
    size = np.where(np.isfinite(limit), limit, unit / np.linalg.norm(alpha, axis=0))
    parts = [_cones(alpha * size / unit, v / unit, np.zeros(s), np.ones(s))]
    capped = np.flatnonzero(np.isfinite(limit))
    parts.append(
        _cones(
            np.eye(p, dtype=complex)[capped],
            np.zeros(len(capped)),
            np.ones(len(capped)),
            np.zeros(len(capped)),
        )
    )
    q = np.zeros(2 * p + 1)
    q[-1] = 1
    w, status = _solve(np.zeros((2 * p + 1, 2 * p + 1)), q, parts)
    return w * size, status


def least_squares_by_clarabel(alpha: Complex, v: Complex, limit: Real, ceiling: Real) -> tuple[Complex, str]:
    """The corrections of the least sum of squares with |w_p| <= limit_p, |r_s| <= ceiling_s."""
    p = alpha.shape[1]
    unit = np.abs(v).max()
    size = np.where(np.isfinite(limit), limit, unit / np.linalg.norm(alpha, axis=0))
    a, b = alpha * size / unit, v / unit
    capped = np.flatnonzero(np.isfinite(limit))
    parts = [
        _cones(
            np.eye(p, dtype=complex)[capped],
            np.zeros(len(capped)),
            np.ones(len(capped)),
            np.zeros(len(capped)),
        )
    ]
    held = np.flatnonzero(np.isfinite(ceiling))
    c = ceiling[held] / unit
    parts.append(_cones(a[held] / c[:, None], b[held] / c, np.ones(len(held)), np.zeros(len(held))))
    m = np.concatenate([np.concatenate([a.real, -a.imag], 1), np.concatenate([a.imag, a.real], 1)])
    big = np.zeros((2 * p + 1, 2 * p + 1))
    big[:-1, :-1] = m.T @ m
    q = np.zeros(2 * p + 1)
    q[:-1] = m.T @ np.concatenate([b.real, b.imag])
    q[-1] = 0
    big[-1, -1] = 1  # t is not used
    w, status = _solve(big, q, parts)
    return w * size, status
