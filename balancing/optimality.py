"""Rounding errors of corrections under limits and of the minimax problem: computed twice, with 16 and with 32 digits.

Such an optimum is where its conditions hold (Karush, Kuhn, Tucker). With the rows E_k z + e_k of the limits and, in
the minimax problem, of the readings, ρ_k their values and u_k = ρ_k/|ρ_k|, μ_k their multipliers, the conditions are

    Bᴴ(B w + b) + Σ μ_k E_kᴴ u_k = 0,    |ρ_k| = h_k + f_k t  for each row that is active,    Σ μ_k f_k = 1,

the first sum for least squares, t and the last condition for minimax. From the corrections as given out Newton's method
goes on with their values F in 32 digits and the inverse of their Jacobian K in 16, to the optimum. Where K is singular, or the active rows are not sure, there is no estimate: the optimum
is not unique, or not a smooth function of the data. The reason is given.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from balancing.cone_problem import real_rows
from balancing.dependence import adjoint, columns_scaled
from balancing.rounding import Problem
from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.doubled_arrays import Vectors
from dalembert.arithmetic.doubled_functions import DOUBLED
from dalembert.arithmetic.doubled_operations import part, total
from dalembert.arithmetic.exact import EPS

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

    square: Vectors
    at: Vectors
    e: Vectors
    offset: Vectors
    h: Real
    f: Real
    moved: Real
    """The possible errors of the values of `e` in floats."""


def optimum_again(
    problem: Problem, minimax: bool, max_mass: Real | None, max_residual: Real | None
) -> tuple[Vectors | None, str]:
    """Return the corrections (p,) in 32 digits; None with the reason where they are not determined."""
    try:
        return _Optimum(
            problem.corrections, minimax, _rows(problem, minimax, max_mass, max_residual)
        ).true, ""
    except _NotBounded as reason:
        return None, str(reason)


class _NotBounded(Exception):
    """There is no bound; the message has the reason."""


def _rows(problem: Problem, minimax: bool, max_mass: Real | None, max_residual: Real | None) -> _Rows:
    (alpha, v), w = problem.floats, problem.corrections
    sensors, planes = alpha.shape
    limit = np.broadcast_to(np.inf if max_mass is None else max_mass, (planes,))
    limited = np.flatnonzero(np.isfinite(limit))
    ones = np.ones(len(limited))
    caps = Vectors.of(np.eye(planes)[limited]) / limit[limited, None]
    weight = np.ones(sensors) if problem.weights is None else problem.weights
    none = np.zeros((0, planes)), np.zeros(0)
    if minimax:
        # readings that no plane moves are no part of it
        held = np.abs(alpha).max(axis=1) * weight > 0
        unit = float((weight * np.abs(v + alpha @ w))[held].max())
        by = np.full(int(held.sum()), unit)
        h, f = np.zeros(len(by)), np.ones(len(by))
        square, of = Vectors.of(none[0]), Vectors.of(none[1])
    else:
        root = DOUBLED.sqrt(Doubled(np.asarray(weight, dtype=float)))
        unit = float((root.value * np.abs(v + alpha @ w)).max()) or 1.0
        scale = root / unit
        square, of = problem.influence * part(scale, (..., None)), problem.initial * scale
        ceiling = np.broadcast_to(np.inf if max_residual is None else max_residual, (sensors,))
        held = np.isfinite(ceiling)
        weight, by = np.ones(sensors), ceiling[held]
        h, f = np.ones(len(by)), np.zeros(len(by))
    own = Doubled(weight[held]) / by
    e, at = problem.influence[held] * part(own, (..., None)), problem.initial[held] * own
    return _Rows(
        square,
        of,
        Vectors.joined([e, caps]),
        Vectors.joined([at, Vectors.of(0 * ones)]),
        np.concatenate([h, ones]),
        np.concatenate([f, 0 * ones]),
        np.concatenate([problem.moved[held] * own.value, 4 * EPS * ones]),
    )


class _Optimum:
    """The conditions at the corrections as given out, and the inverse of their Jacobian."""

    def __init__(self, w: Complex, with_t: bool, exact: _Rows) -> None:
        planes = len(w)
        rows_e, rows_square = exact.e.value, exact.square.value
        start = Vectors.of(w)
        value = (exact.offset + (exact.e * start[None]).sum()).value
        size = np.abs(value)
        # the unit is chosen so that t = 1
        radius = exact.h + exact.f
        active = size >= radius * (1 - ACTIVE) - 4 * exact.moved
        # a reading that stands twice holds the corrections once
        twice = np.ones(len(size), dtype=bool)
        twice[
            np.unique(np.column_stack([rows_e, exact.offset.value, radius]), axis=0, return_index=True)[1]
        ] = False
        active &= ~twice
        if not active.any():
            raise _NotBounded("no limit is reached, and the optimum lies within rounding of the edge of one")
        scaled, scale = columns_scaled(np.concatenate([rows_square, rows_e]))
        order = np.argsort(-np.abs(scaled).max(axis=1), kind="stable")
        _, upper = np.linalg.qr(scaled[order])
        diagonal = np.abs(np.diag(upper))
        if len(upper) < planes or not diagonal.min() > 1e-15 * diagonal.max():
            raise _NotBounded("the planes depend on each other, and no limit tells them apart")
        # w = undo z: coordinates without units or κ(α)
        undo: Complex = np.asarray(scale[:, None] * np.linalg.inv(upper), dtype=complex)
        e, value, f = rows_e[active], value[active], exact.f[active]
        self.size = size[active]
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
        left = (exact.at + (exact.square * start[None]).sum()).value
        slope = np.zeros(n)
        pull = adjoint(undo) @ (adjoint(rows_square) @ left)
        slope[:planes], slope[planes : 2 * planes] = pull.real, pull.imag
        if with_t:
            slope[-1] = 1.0
        mu = np.linalg.lstsq(self.gradient.T, -slope, rcond=1e-13)[0]
        hessian = self.across.T @ ((mu / self.size)[:, None] * self.across)
        squares = np.concatenate(real_rows(rows_square @ undo))
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
            raise _NotBounded("a limit or a reading is only just active")
        inverse = np.linalg.inv(system)
        inverse[:, :n] /= unit
        inverse[n:, :] *= unit
        self.mu, self.n, self.planes = mu, n, planes
        self.rows, self.undo, self.active = exact, undo, active
        self.true = self._true(start, inverse, with_t)
        self._check(size, radius, active | twice)

    def _true(self, w: Vectors, inverse: NDArray[np.floating], with_t: bool) -> Vectors:
        """Go on from the corrections to where the conditions hold in 32 digits."""
        rows, active, p = self.rows, self.active, self.planes
        e, offset, h, f = rows.e[active], rows.offset[active], rows.h[active], rows.f[active]
        mu, t = Doubled(self.mu), Doubled(np.ones(1))
        last = np.inf
        for _ in range(40):
            value = offset + (e * w[None]).sum()
            size = value.size
            pull = (e.conj() * (value * (mu / size))[:, None]).sum(0)
            if len(rows.at.x.high):
                left = rows.at + (rows.square * w[None]).sum()
                pull = pull + (rows.square.conj() * left[:, None]).sum(0)
            slope = adjoint(self.undo) @ pull.value
            conditions = [slope.real, slope.imag, (size - (t * f + h)).value]
            if with_t:
                conditions.insert(2, (1.0 - total(mu * f)).value[None])
            step = -inverse @ np.concatenate(conditions)
            moved = self.undo @ (step[:p] + 1j * step[p : 2 * p])
            w = w + Vectors.of(moved)
            mu = mu + step[self.n :]
            if with_t:
                t = t + step[2 * p : 2 * p + 1]
            reach = float(np.abs(step).max())
            if reach < 1e-24 or (reach >= last / 2 and last < 1e-20):
                return w
            if not reach < 2 * last:
                break
            last = min(reach, last)
        raise _NotBounded("the problem is so badly conditioned that its optimum in 32 digits is not reached")

    def _check(self, size: Real, radius: Real, held: NDArray[np.bool_]) -> None:
        """See to it that what is inactive stays so, and that the values hardly turn: else first order is not enough."""
        value = (self.rows.offset + (self.rows.e * self.true[None]).sum()).value
        moved = np.abs(np.abs(value) - size)
        turned = moved[self.active] / self.size
        if turned.max(initial=0.0) > 1e-3 or (size + moved >= radius)[~held].any():
            raise _NotBounded(
                "the problem is so badly conditioned that rounding decides which limits are active"
            )
