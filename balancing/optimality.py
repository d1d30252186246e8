"""Bounds of the rounding errors of corrections under limits and of the minimax problem.

Such an optimum is where its conditions hold (Karush, Kuhn, Tucker). With the rows E_k z + e_k of the limits and, in
the minimax problem, of the readings, ρ_k their values and u_k = ρ_k/|ρ_k|, μ_k their multipliers, the conditions are

    Bᴴ(B w + b) + Σ μ_k E_kᴴ u_k = 0,    |ρ_k| = h_k + f_k t  for each row that is active,    Σ μ_k f_k = 1,

the first sum for least squares, t and the last condition for minimax. Their values F at the corrections as given out,
with the errors that evaluating them has, and the inverse of their Jacobian K, bound the distance from the true
optimum: |δ| ≤ |K⁻¹F| + |K⁻¹| δF. Where K is singular, or the active rows are not sure, nothing is bounded: the optimum
is not unique, or not a smooth function of the data. The reason is given.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from balancing.cone_problem import real_rows
from balancing.dependence import adjoint, columns_scaled, roundings
from balancing.rounding import Bounds, Solved

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

ACTIVE = 1e-9
"""A row nearer to its limit than this, relatively, counts as active."""
WEAK = 1e-6
"""An active row that pulls less than this share of the strongest one is not sure to be active."""
SINGULAR = 1e11
"""A Jacobian beyond this condition number, in coordinates without units, is singular."""


@dataclass(frozen=True)
class _Rows:
    """The rows of a problem in w, all of size one: the objective's (least squares) and the constraints'."""

    square: Complex
    at: Complex
    e: Complex
    offset: Complex
    h: Real
    f: Real
    square_error: tuple[Real, Real]
    """Bounds of errors of `square` and `at`."""
    e_error: tuple[Real, Real]


def optimum_bounds(
    solved: Solved, minimax: bool, max_mass: Real | None, max_residual: Real | None
) -> tuple[Bounds, str]:
    """Bound the errors of the corrections and of the residual; inf with the reason where they are not bounded."""
    sensors, planes = solved.influence.shape
    try:
        optimum = _Optimum(solved.corrections, minimax, _rows(solved, minimax, max_mass, max_residual))
    except _NotBounded as reason:
        nothing = Bounds(np.full(planes, np.inf), np.full(sensors, np.inf))
        return nothing, str(reason)
    residual = optimum.bound(solved.influence) + solved.evaluation_error
    return Bounds(optimum.bound(np.eye(planes, dtype=complex)), residual), ""


class _NotBounded(Exception):
    """Why there is no bound."""


def _rows(solved: Solved, minimax: bool, max_mass: Real | None, max_residual: Real | None) -> _Rows:
    alpha, v, w = solved.influence, solved.initial, solved.corrections
    sensors, planes = alpha.shape
    c = roundings(planes)
    da, db = solved.data_errors
    limit = np.broadcast_to(np.inf if max_mass is None else max_mass, (planes,))
    limited = np.flatnonzero(np.isfinite(limit))
    caps = np.zeros((len(limited), planes), dtype=complex)
    caps[np.arange(len(limited)), limited] = 1 / limit[limited]
    weight = np.ones(sensors) if solved.weights is None else solved.weights
    # readings that no plane moves are no part of it
    if minimax:
        e, at, de, dat = (x * (weight if x.ndim == 1 else weight[:, None]) for x in (alpha, v, da, db))
        moved = np.abs(e).max(axis=1) > 0
        e, at, de, dat = e[moved], at[moved], de[moved], dat[moved]
        unit = float(np.abs(at + e @ w).max())
        h, f = np.zeros(len(at)), np.ones(len(at))
        square, of = np.zeros((0, planes), dtype=complex), np.zeros(0, dtype=complex)
        none = np.zeros((0, planes)), np.zeros(0)
        e, at, de, dat = (x / unit for x in (e, at, de, dat))
        square_error = none
    else:
        root = np.sqrt(weight)
        square, of = alpha * root[:, None], v * root
        unit = float(np.abs(of + square @ w).max()) or 1.0
        square, of = square / unit, of / unit
        square_error = da * root[:, None] / unit, db * root / unit
        ceiling = np.broadcast_to(np.inf if max_residual is None else max_residual, (sensors,))
        capped = np.isfinite(ceiling)
        e, at, de, dat = ((x[capped].T / ceiling[capped]).T for x in (alpha, v, da, db))
        h, f = np.ones(len(at)), np.zeros(len(at))
    ones = np.ones(len(limited))
    return _Rows(
        square,
        of,
        np.concatenate([e, caps]),
        np.concatenate([at, np.zeros(len(limited))]),
        np.concatenate([h, ones]),
        np.concatenate([f, 0 * ones]),
        square_error,
        (np.concatenate([de, c * np.abs(caps)]), np.concatenate([dat, 0 * ones])),
    )


class _Optimum:
    """The conditions at the corrections as given out, and the inverse of their Jacobian."""

    def __init__(self, w: Complex, with_t: bool, rows: _Rows) -> None:
        planes = len(w)
        value = rows.offset + rows.e @ w
        size = np.abs(value)
        # of each value
        wrong = rows.e_error[0] @ np.abs(w) + rows.e_error[1]
        # the unit is chosen so that t = 1
        radius = rows.h + rows.f
        active = size >= radius * (1 - ACTIVE) - 4 * wrong
        # a reading that stands twice holds the corrections once
        twice = np.ones(len(size), dtype=bool)
        twice[np.unique(np.column_stack([rows.e, rows.offset, radius]), axis=0, return_index=True)[1]] = False
        active &= ~twice
        if not active.any():
            raise _NotBounded("no limit is reached, and the optimum lies within rounding of the edge of one")
        scaled, scale = columns_scaled(np.concatenate([rows.square, rows.e]))
        order = np.argsort(-np.abs(scaled).max(axis=1), kind="stable")
        _, upper = np.linalg.qr(scaled[order])
        diagonal = np.abs(np.diag(upper))
        if len(upper) < planes or not diagonal.min() > 1e-15 * diagonal.max():
            raise _NotBounded("the planes depend on each other, and no limit tells them apart")
        # w = undo z: coordinates without units or κ(α)
        undo: Complex = np.asarray(scale[:, None] * np.linalg.inv(upper), dtype=complex)
        e, value, f = rows.e[active], value[active], rows.f[active]
        self.wrong = wrong[active]
        self.e, self.size = e, size[active]
        turn = value / self.size
        along_rows = turn.conj()[:, None] * (e @ undo)
        re, im = real_rows(along_rows)
        m, n = len(e), 2 * planes + with_t
        self.gradient = np.zeros((m, n))
        self.gradient[:, : 2 * planes] = re
        if with_t:
            self.gradient[:, -1] = -f
        self.across = np.zeros((m, n))
        self.across[:, : 2 * planes] = im
        left = rows.at + rows.square @ w
        slope = np.zeros(n)
        pull = adjoint(undo) @ (adjoint(rows.square) @ left)
        slope[:planes], slope[planes : 2 * planes] = pull.real, pull.imag
        if with_t:
            slope[-1] = 1.0
        mu = np.linalg.lstsq(self.gradient.T, -slope, rcond=1e-13)[0]
        hessian = self.across.T @ ((mu / self.size)[:, None] * self.across)
        squares = np.concatenate(real_rows(rows.square @ undo))
        hessian[: 2 * planes, : 2 * planes] += squares.T @ squares
        # multipliers in units of their size: the condition number is then one without units
        unit = float(max(np.abs(hessian).max(), np.abs(mu).max()))
        system = np.zeros((n + m, n + m))
        system[:n, :n], system[n:, :n], system[:n, n:] = hessian / unit, self.gradient, self.gradient.T
        if not np.linalg.cond(system) < SINGULAR:
            if np.linalg.matrix_rank(self.gradient, rtol=1 / SINGULAR) < m:
                raise _NotBounded(
                    "more limits and readings are active at the optimum than hold the corrections, and what each one holds "
                    "is not determined"
                )
            raise _NotBounded(
                "the optimum is not unique, or the next thing to it: other corrections leave as much"
            )
        # of least squares the squares' own pull is what the limits hold against
        strength = mu * np.linalg.norm(self.gradient, axis=1)
        if not strength.min() > WEAK * max(float(strength.max()), float(np.linalg.norm(left))):
            raise _NotBounded("a limit or a reading is only just active: a little more, and it would not be")
        inverse = np.linalg.inv(system)
        inverse[:, :n] /= unit
        inverse[n:, :] *= unit
        # the response of w, complex, to each condition
        self.response = undo @ (inverse[:planes] + 1j * inverse[planes : 2 * planes])
        value_left = np.concatenate([slope + self.gradient.T @ mu, self.size - radius[active]])
        self.value, self.mu, self.n, self.planes = value_left, mu, n, planes
        self.rows, self.turn, self.undo, self.left = rows, turn, undo, left
        self.squares, self.w = squares, np.abs(w)
        self._check(rows, size, radius, active, twice)

    def bound(self, of: Complex) -> Real:
        """Bound the error of a linear function of the corrections, its rows (..., p)."""
        response = of @ self.response
        n, p = self.n, self.planes
        out = np.abs(response @ self.value)
        # an error of an active row's value: along it, and across it, where it turns its pull
        out += np.abs(response[:, n:]) @ self.wrong
        out += np.abs(response[:, :n] @ self.across.T) @ (self.mu / self.size * self.wrong)
        # of the residual of least squares
        da, db = self.rows.square_error
        off = da @ self.w + db
        out += np.abs(response[:, : 2 * p] @ self.squares.T) @ np.concatenate([off, off])
        # of the rows themselves in the sums of the pulls: in the coordinates of w
        pulls = da.T @ np.abs(self.left) + self._of_active(self.rows.e_error[0]).T @ self.mu
        # zᵣ = Re Σ conj(undo) g …
        back = self.undo.conj()
        by_re = response[:, :p] @ back.real.T + response[:, p : 2 * p] @ back.imag.T
        by_im = -response[:, :p] @ back.imag.T + response[:, p : 2 * p] @ back.real.T
        out += (np.abs(by_re) + np.abs(by_im)) @ pulls
        if n > 2 * p:
            out += np.abs(response[:, 2 * p]) * roundings(len(self.mu)) * self.mu.sum()
        return np.asarray(out)

    def _of_active(self, rows: Real) -> Real:
        return rows[self.active]

    def _check(
        self,
        rows: _Rows,
        size: Real,
        radius: Real,
        active: NDArray[np.bool_],
        twice: NDArray[np.bool_],
    ) -> None:
        """See to it that what is inactive stays so, and that the values hardly turn: else first order is not enough."""
        self.active = active
        moved = self.bound(rows.e)
        turned = moved[active] / self.size
        if turned.max(initial=0.0) > 1e-3 or (size + moved >= radius)[~(active | twice)].any():
            raise _NotBounded(
                "the problem is so badly conditioned that rounding decides which limits are active"
            )
