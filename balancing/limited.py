"""The smallest largest residual, exactly, and limits on masses and residuals; each answer with its proof.

    min t        with |V_s + α_s w| <= t,  |w_p| <= m_p                       (minimax)
    min Σ|r_s|²  with |V_s + α_s w| <= c_s,  |w_p| <= m_p                     (least squares)

are second-order cone problems: |·| of a complex number is a cone in three dimensions (`balancing.cone_problem` solves
them). The dual solution is the proof. For any y with Σ|y_s| = 1, and for any x and y, no w within the limits leaves less
than

    max |r_s|   >= Re yᴴV - Σ m_p |(αᴴy)_p|,
    ½ Σ |r_s|²  >= Re xᴴV - ½|x|² + Re yᴴV - Σ c_s |y_s| - Σ m_p |(αᴴ(x + y))_p|,

where αᴴy, αᴴ(x + y) are zero for planes without a limit (Boyd and Vandenberghe, Convex Optimization, section 5.2). What
the masses leave is held against that: the gap comes with the answer, and above `PROVEN` there is none.
"""

from __future__ import annotations

from collections.abc import Callable
from decimal import ROUND_CEILING, Context
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing.cone_problem import ConeProblem, real_rows, solve
from balancing.dependence import DependentPlanes, adjoint, columns_scaled, roundings
from balancing.qr import smallest_squares
from balancing.triangle import triangle
from dalembert.arithmetic.exact import EPS

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Residual = Callable[[Complex, Complex, Complex], Complex]

CLOSED = 1e-12
"""An answer whose gap is at most this, or rounding, is not solved again."""
PROVEN = 1e-9
"""Above this gap there is no answer."""
TIGHT = 1e-8
"""Limits of residuals that are nearer to the smallest that can be met, relatively, are kept by the minimax corrections."""
ROOM = 4.0
"""Units of the last place of a row's terms that it keeps from its limit where an answer is solved again."""
CUTS = 1e-11, 1e-14, 1e-11, 1e-14
"""Where an answer is solved again, the share of the largest singular value below which one is none: the finer one where planes
are nearly dependent, the coarser one where the optimum is not unique."""
SQUARES = 10.0
"""The squares count so often as much as the room that the limits leave: then the multipliers have the size of 1."""


class Infeasible(ValueError):
    """No corrections meet the residual limits; `smallest` is the smallest limit that can be met.

    Of several limits `smallest` belongs to the lowest one: all of them times `factor` can be met.
    """

    def __init__(self, factor: float, limits: Real) -> None:
        self.factor = factor
        self.smallest = factor * float(limits.min())
        text = f"the residual limit cannot be met: the smallest that can is {self.rounded_up}"
        if float(limits.max()) > float(limits.min()):
            text = f"the residual limits cannot be met: the smallest that can are {factor:.6g} times as large"
        super().__init__(text)

    @property
    def rounded_up(self) -> str:
        """`smallest` less its rounding in six digits, rounded up: a limit of this can be met."""
        least = self.smallest * (1 - 64 * EPS)
        return f"{float(Context(prec=6, rounding=ROUND_CEILING).create_decimal_from_float(least)):g}"


class NotConverged(ArithmeticError):
    """The best corrections are not proven optimal; `gap` is the largest relative excess of their residual."""

    def __init__(self, gap: float, condition: float, apart: float = 1.0) -> None:
        self.gap, self.condition = gap, condition
        text = f"the corrections cannot be proven to be the best: the residual may exceed the least one by a share of {gap:.2g}"
        if apart > condition:
            text += (
                f": the readings respond to the masses in sizes {apart:.2g} times apart, as in different units: give weights, or "
                "readings in one unit"
            )
        elif condition > 1e5:
            text += (
                f": the planes are nearly dependent (condition number {condition:.2g}), and the rounding of the masses alone "
                "changes the residual by as much: leave a plane out, or limit the masses further"
            )
        super().__init__(text)


class Optimum(NamedTuple):
    """Corrections (p,), a lower bound of the objective, and by what share the objective may lie above its least value.

    `of_largest`: the objective is the largest residual in units of its limits, as no other corrections keep these.
    """

    corrections: Complex
    bound: float
    gap: float
    of_largest: bool = False


def limited_least_squares(
    alpha: Complex, v: Complex, root: Real | None, limit: Real, ceiling: Real
) -> Optimum:
    """Return the corrections of least squares within limits: of masses (p,) and of residuals (s,), inf for none.

    `root` are the square roots of weights (s,); None: all are one. Raises Infeasible, NotConverged.
    """
    a, b = (alpha, v) if root is None else (alpha * root[:, None], v * root)
    try:
        free, _ = smallest_squares(a, b)
        if (np.abs(free) <= limit).all() and (np.abs(v + np.matvec(alpha, free)) <= ceiling).all():
            return Optimum(free, float(np.square(np.abs(b + a @ free)).sum()), 0.0)
    except DependentPlanes:
        if not np.isfinite(limit).all():
            raise
    capped = np.isfinite(ceiling)
    # in units of their limits
    e, offset = (alpha[capped].T / ceiling[capped]).T, v[capped] / ceiling[capped]

    def kept(w: Complex) -> bool:
        # as `Balance.residual` is computed: another order of sums may differ by a unit in the last place
        return bool((np.abs(v + np.matvec(alpha, w)) <= ceiling).all() and (np.abs(w) <= limit).all())

    inside, room = None, 1.0
    if capped.any():
        # the corrections farthest within all limits, in units of these
        caps = _caps(limit)
        nowhere, none = np.full(len(limit), np.inf), np.zeros(len(caps), dtype=complex)
        inside = smallest_maximum(
            np.concatenate([e, caps]), np.concatenate([offset, none]), nowhere
        ).corrections
        least = None
        if not kept(inside):
            least = smallest_maximum(e, offset, limit)
            inside = least.corrections
            factor = float((np.abs(v + alpha @ inside)[capped] / ceiling[capped]).max())
            # the smallest limit itself can be missed by rounding
            if factor > 1 + min(_rounding(e, offset, inside), PROVEN):
                raise Infeasible(factor, ceiling[capped])
        room = 1 - max(float(np.abs(offset + e @ inside).max()), float((np.abs(inside) / limit).max()))
        if room <= TIGHT:
            least = least or smallest_maximum(e, offset, limit)
            w = least.corrections
            if float(np.abs(offset + e @ w).max()) >= 1 - TIGHT:
                return Optimum(w if kept(w) else inside, least.bound, least.gap, of_largest=True)
    return _Limited(limit, (a, b), (e, offset), inside, kept, room=room).solved()


def smallest_maximum(a: Complex, b: Complex, limit: Real) -> Optimum:
    """Return the minimax corrections within limits (p,) and a lower bound of the largest |b + a w|.

    Raises NotConverged.
    """
    limited = bool((limit < np.inf).all())
    if limited and (np.abs(b) > np.abs(a) @ limit).any():
        # more than all masses together can do: something is left
        return _Limited(limit, None, (a, b)).solved()
    free: Complex | None = None
    try:
        free, _ = smallest_squares(a, b)
        largest = float(np.abs(b + np.matvec(a, free)).max())
        nothing = 64 * EPS * max(float(np.abs(b).max()), float((np.abs(a) @ np.abs(free)).max()))
        if largest <= nothing and (np.abs(free) <= limit).all():
            return Optimum(free, 0.0, 0.0)
    except DependentPlanes:
        if not limited:
            raise
    return _Limited(limit, None, (a, b), start=None if limited else free).solved()


def _rounding(a: Complex, b: Complex, w: Complex) -> float:
    """Return the possible error of b + a w for a rounded w."""
    return roundings(len(w)) * float((np.abs(b) + np.abs(a) @ np.abs(w)).max(initial=0.0))


def _caps(limit: Real) -> Complex:
    """Return the rows of w_p/m_p for planes with a limit m_p."""
    return np.diag(1 / limit).astype(complex)[np.isfinite(limit)]


def _in_floats(a: Complex, b: Complex, w: Complex) -> Complex:
    """Return b + a w."""
    return np.asarray(b + a @ w)


def _in_32_digits(a: Complex, b: Complex, w: Complex) -> Complex:
    """Return b + a w, rounded once: of large masses that leave little it has all its digits."""
    from dalembert.arithmetic.doubled_arrays import Vectors

    return (Vectors.of(b) + (Vectors.of(a) * Vectors.of(w)[None]).sum()).value


class _Limited:
    """One of the two problems: `squares` (B, b) to make least, or none; the `cones` (E, e) are within 1, or to make least.

    Where there are cones within 1: corrections `inside` all limits, and whether given ones are, as results are computed.
    """

    def __init__(
        self,
        limit: Real,
        squares: tuple[Complex, Complex] | None,
        cones: tuple[Complex, Complex],
        inside: Complex | None = None,
        kept: Callable[[Complex], bool] | None = None,
        start: Complex | None = None,
        room: float = 1.0,
    ) -> None:
        nothing = np.zeros(len(limit), dtype=complex)
        self.start = inside if inside is not None else nothing if start is None else start
        self.limit, self.squares, self.cones, self.inside, self.kept = limit, squares, cones, inside, kept
        self.limited = np.flatnonzero(np.isfinite(limit))
        self.a, self.b = cones if squares is None else squares
        # next to infeasible the multipliers are large without this factor of the squares
        self.share = float(np.clip(SQUARES * room, TIGHT, 1.0))

    def solved(self) -> Optimum:
        """Solve, again from what was reached where the gap is not closed; refuse what is not the optimum."""
        start = self.start
        best: Optimum | None = None
        for again, cut in enumerate(CUTS):
            # where digits are missing, what is left is taken in 32 of them
            residual = _in_32_digits if again else _in_floats
            unit = float(np.abs(residual(self.a, self.b, start)).max()) or 1.0
            problem = self._problem(start, unit, residual, cut)
            if again:
                # limits that leave room for rounding each row, so that the masses need not be moved away from all of them
                e, offset = self.cones
                own = (
                    0 * np.abs(offset) if self.squares is None else np.abs(offset) + np.abs(e) @ np.abs(start)
                )
                own = np.concatenate([own, np.ones(len(self.limited))])
                problem.h -= np.minimum(ROOM * EPS * own, PROVEN)
            step, force = solve(problem)
            w = self._within(start + step, problem.to_w)
            force = force[: len(self.cones[1])] / self.share
            # of the step as it was solved: w is rounded, which shows where it leaves little
            stepped = residual(self.a, self.b, start) + self.a @ step
            reached = self._judged(w, stepped, force, unit, problem.to_w, residual)
            if best is None or reached.gap < best.gap:
                best = reached
            if best.gap <= CLOSED:
                break
            start = best.corrections
        assert best is not None
        if best.gap > PROVEN:
            scaled, _ = columns_scaled(self.a)
            size = np.abs(scaled).max(axis=1)
            alike = scaled[size > 0] / size[size > 0, None]
            sigma = np.linalg.svd(alike, compute_uv=False)
            condition = float(sigma[0] / sigma[-1]) if sigma[-1] > 0 else np.inf
            raise NotConverged(best.gap, condition, float(size.max() / size[size > 0].min()))
        return best

    def _problem(self, start: Complex, unit: float, residual: Residual, cut: float) -> ConeProblem:
        """Put the steps from `start` into coordinates in which its rows are orthonormal, and neither κ(α) nor any unit is left.

        Where masses are limited the limits' own rows |w_p/m_p| stand below the coefficients: with QR of both together
        even dependent planes have coordinates.
        """
        caps = _caps(self.limit)
        stack, scale = columns_scaled(np.concatenate([self.a / unit, caps]))
        order = np.argsort(-np.abs(stack).max(axis=1), kind="stable")
        to_w: Complex = np.asarray(scale[:, None] * np.linalg.inv(triangle(stack[order])), dtype=complex)
        e, offset = self.cones
        readings, ones, none = len(offset), np.ones(len(caps)), np.zeros(len(caps), dtype=complex)
        free = self.squares is None
        of_cones = unit if free else 1.0
        exact, root = residual is _in_32_digits, np.sqrt(self.share) / unit
        return ConeProblem(
            np.concatenate([e / of_cones, caps]),
            np.concatenate([residual(e, offset, start) / of_cones, residual(caps, none, start)]),
            0.0 if exact else EPS * float((np.abs(e) @ np.abs(start)).max(initial=0.0)) / of_cones,
            np.concatenate([np.full(readings, 0.0 if free else 1.0), ones]),
            np.concatenate([np.full(readings, 1.0 if free else 0.0), 0 * ones]),
            None if free else self.a * root,
            None if free else residual(self.a, self.b, start) * root,
            to_w,
            cut,
        )

    def _within(self, w: Complex, to_w: Complex) -> Complex:
        """Bring w, which misses its limits by rounding, within all of them.

        By the last digits it is shortened as a whole: what planes do against each other then changes by no more than their sum.
        """
        if len(self.limited):
            w = self._moved_within(w, to_w)
            w = w / max(1.0, float((np.abs(w) / self.limit).max()))
            while (np.abs(w) > self.limit).any():
                w = w * (1 - EPS)
        inside, kept = self.inside, self.kept
        if inside is not None and kept is not None and not kept(w):
            # next to infeasible: towards the minimax corrections all limits hold
            low, high = 0.0, 1.0
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (low, middle) if kept(w + middle * (inside - w)) else (middle, high)
            w = inside if high == 1 else w + high * (inside - w)
        return np.asarray(w + 0.0, dtype=complex)

    def _moved_within(self, w: Complex, to_w: Complex) -> Complex:
        """Return the nearest masses within their limits: of readings in units far apart a part of 1e-12 turns a row round."""
        for _ in range(4):
            over = np.abs(w) / self.limit - 1
            beyond = np.flatnonzero(over > ROOM * EPS)
            if not len(beyond):
                break
            rows = (w[beyond].conj() / np.abs(w[beyond]) / self.limit[beyond])[:, None] * to_w[beyond]
            real, _ = real_rows(rows)
            moved = np.linalg.lstsq(real, -over[beyond] - 2 * EPS, rcond=None)[0]
            w = w + to_w @ (moved[: len(w)] + 1j * moved[len(w) :])
        return w

    def _reach(self, to_w: Complex, unit: float, left: Complex) -> Real:
        """Bound how far the masses (p,) of the optimum are from ones that keep the limits and leave `left`: it leaves less."""
        most = float(np.linalg.norm(left))
        if self.squares is None:
            most = float(np.abs(left).max()) * np.sqrt(len(left))
        length = 2 * np.hypot(most / unit, np.sqrt(len(self.limited)))
        return np.asarray(1.01 * length * np.linalg.norm(to_w, axis=1))

    def _judged(
        self, w: Complex, stepped: Complex, y: Complex, unit: float, to_w: Complex, residual: Residual
    ) -> Optimum:
        """Hold what w leaves against the dual bound of the forces y of the cones, and of those of the squares.

        These are what w leaves, or what its numbers before rounding do (`stepped`): each proves a bound.
        """
        left = residual(self.a, self.b, w)
        reach = self._reach(to_w, unit, left)
        # the rounding of a residual that is small against the readings is no gap
        excused = min(2 * _rounding(self.a, self.b, w), PROVEN * float(np.abs(self.b).max()))
        if self.squares is None:
            value = float(np.abs(left).max())
        else:
            value = float(np.square(np.abs(left)).sum())
            excused *= 2 * float(np.abs(left).sum()) + len(left) * excused
        bound = 0.0
        # planes that do not touch their limit pull nothing at the optimum; where that is not so to rounding, y is made
        # orthogonal to them. Of large masses that leave little a limit may be missed by less than 1e-9 and yet be free
        none, size = np.zeros(len(w), dtype=bool), np.abs(w)
        near, nearest = (size < (1 - share) * self.limit for share in (1e-9, 64 * EPS))
        squares = [left] if self.squares is None else [left, stepped]
        for loose, pull in product((none, near, nearest, ~np.isfinite(self.limit)), squares):
            bound = max(bound, self._bound(w, (pull, y), unit, reach, loose, residual))
            if value - bound <= 32 * EPS * value:
                break
        gap = max(value - bound - excused, 0.0) / value if value > 0 else 0.0
        return Optimum(w, bound, gap)

    def _bound(
        self,
        w: Complex,
        pulls: tuple[Complex, Complex],
        unit: float,
        reach: Real,
        loose: NDArray[np.bool_],
        residual: Residual,
    ) -> float:
        """Return the lower bound that the forces of squares and cones prove, made orthogonal to the `loose` planes.

        The optimum is in `reach`.

        The products with readings are taken as those with what w leaves, which is small: no digits cancel.
        """
        e, offset = self.cones
        rows, at, forces = e, offset, pulls[1]
        if self.squares is not None:
            # the squares in units in which they stand beside those of the limits
            rows, at = np.concatenate([self.a / unit, e]), np.concatenate([self.b / unit, offset])
            forces = np.concatenate([pulls[0] / unit, pulls[1]])
        none = np.zeros(len(w), dtype=complex)
        pull = residual(adjoint(rows), none, forces)
        if loose.any():
            scaled, scale = columns_scaled(rows[:, loose])
            u, sigma, vh = np.linalg.svd(scaled, full_matrices=False)
            kept = sigma > 1e-13 * sigma[0]
            u, undo = u[:, kept], (vh[kept].T / sigma[kept]).T * scale
            for _ in range(2):
                forces = forces - u @ (u.conj().T @ forces)
            pull = residual(adjoint(rows), none, forces)
            if residual is _in_32_digits:
                # rounding of the forces leaves a pull: it is taken off in further digits
                more = u @ (undo @ pull[loose])
                forces, pull = forces - more, residual(adjoint(rows), pull, -more)
        total = float(np.abs(forces[len(forces) - len(offset) :]).sum())
        constant = 0.0
        if self.squares is not None:
            constant = 0.5 * float(np.square(np.abs(forces[: len(self.b)])).sum()) + total
        elif total > 0:
            forces, pull = forces / total, pull / total
        left, size = residual(rows, at, w), np.abs(pull)
        lost = size * reach
        k = self.limited
        # m_p|pull| + Re pull* w: its parts along and across as products, for both terms are large
        turned, most = pull[k].conj() * w[k], size[k] * np.abs(w[k])
        across = np.divide(
            np.square(turned.imag), most - turned.real, out=most + turned.real, where=turned.real < 0
        )
        lost[k] = np.minimum(lost[k], size[k] * (self.limit[k] - np.abs(w[k])) + across)
        proof = float(np.vdot(forces, left).real) - float(lost.sum()) - constant
        # less what rounding may have added
        terms = np.abs(left) if residual is _in_32_digits else np.abs(at) + np.abs(rows) @ np.abs(w)
        proof -= roundings(len(w)) * float(np.abs(forces) @ terms) + 8 * EPS * constant
        return proof * (1.0 if self.squares is None else 2.0 * unit**2)
