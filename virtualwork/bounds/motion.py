"""Bounds of the rounding errors of a motion: first-order componentwise perturbation of its loop closures.

The loops C(x, q) = 0 of all groups together have the unknowns x (angles, slides) and the Jacobian J = ∂C/∂x, block
triangular in the order of solution. A pose x̂ that the program found leaves in each loop a residual; what it is
as computed, and the rounding of computing it, some ε·Σ|terms|, bound together the residual ρ₀ of x̂ in exact numbers.
Then to first order J·δx = −ρ₀, and componentwise |δx| ≤ |J⁻¹|·ρ₀ (N. J. Higham, Accuracy and Stability of
Numerical Algorithms, 2nd ed., §7.2; the residual as a measure of backward error: §7.1).

The k-th time derivative of a loop is an equation in x⁽ᵏ⁾, and leaves its own residual ρ_k. Variation and time derivative
commute, (J·δx)⁽ᵏ⁾ = −ρ_k, so that by Leibniz's rule

    J·δx⁽ᵏ⁾ = −ρ_k − Σ_{j<k} C(k, j)·J⁽ᵏ⁻ʲ⁾·δx⁽ʲ⁾,      every δx⁽ᵏ⁾ = Σ_j A_kj·ρ_j,  |δx⁽ᵏ⁾| ≤ Σ_j |A_kj|·|ρ_j|.

Close to a limit the second order counts too: see `virtualwork.bounds.second_order`. The given data, dimensions and inputs,
are taken as exact.
"""

from __future__ import annotations

from functools import cached_property
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualwork.bounds.second_order import Sizes, grown, inverse, kept, sum_of, value_of
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.positions import State
from virtualwork.formulas.rates import Rates
from virtualwork.plan.steps import Angle, Closure, Group, Place, Slide, Term, Turn, combined

# roundings that a term collects, at worst, on its way into a sum: e^{iθ}, z·e^{iθ}, the sum
ROUNDINGS = 0.5
# so many entries of one matrix over all poses are worked on at once
ENTRIES = 1 << 21

# a point from the ground: its terms, and the points on the way
Route = tuple[tuple[Term, ...], tuple[str, ...]]


class MotionErrors:
    """Bounds of the rounding errors of one motion; each is formed when first asked for."""

    def __init__(self, poses: Poses) -> None:
        self.poses, self.plan = poses, poses.plan
        self.n = poses.n
        self.size = poses.mechanism.size
        self.groups: tuple[Group, ...] = self.plan.groups
        self.angles = [body for g in self.groups for body in g.angles]
        self.slides = [s for g in self.groups for s in g.slides]
        # ∂θ_body/∂x
        self.share: dict[str, dict[int, float]] = {GROUND: {}}
        self.routes: dict[str | None, Route] = {None: ((), ())}
        self.ties: list[Turn] = []
        self.given: Reals = np.broadcast_to(np.asarray(poses.input_error, dtype=float), poses.inputs.shape)
        self.driven = {step.guide: step.input for step in self.plan.steps if isinstance(step, Slide)}
        for step in self.plan.steps:
            if isinstance(step, Turn):
                self._tie(step)
            elif isinstance(step, Group):
                for body in step.angles:
                    self.share[body] = {self.angles.index(body): 1.0}
                for tie in step.ties:
                    self._tie(tie)
            elif isinstance(step, Place):
                terms, nodes = self.routes[step.base]
                self.routes[step.node] = combined((*terms, *step.terms)), (*nodes, step.node)
        self.closures = [closure for g in self.groups for closure in g.closures]
        self.loops = [self._whole(closure) for closure in self.closures]
        self._solved: list[Reals] = []
        self._made: dict[str, list[Reals]] = {}

    def _tie(self, tie: Turn) -> None:
        total: dict[int, float] = {}
        for base, r in tie.angle.bases:
            for column, share in self.share[base].items():
                total[column] = total.get(column, 0.0) + r * share
        self.share[tie.body] = total
        self.ties.append(tie)

    def _whole(self, closure: Closure) -> Route:
        """A loop from the ground, and the points that bring a rounding of their own into it."""
        (first, there), (last, back) = self.routes[closure.start], self.routes[closure.end]
        nodes = set(there) ^ set(back) | {node for node in (closure.start, closure.end) if node is not None}
        negative = tuple(Term(-t.z, t.body, t.slide) for t in last)
        return combined((*first, *closure.terms, *negative)), tuple(sorted(nodes))

    # --- the motion as computed ---------------------------------------------------------------------------------
    @cached_property
    def _state(self) -> State:
        """Rotations of length 1 and slides over all poses."""
        poses = self.poses
        poses.solve([key for s in self.plan.steps for key in self.plan.writes(s)], 0)
        states = poses.states()
        found = State([poses.inputs[:, j] for j in range(poses.inputs.shape[1])], many=True)
        self._length: dict[str, Any] = {GROUND: 0.0}
        self._unwound: dict[str, Any] = {GROUND: 0.0}
        for body in self.share:
            if body == GROUND:
                continue
            e = poses.join([st.turn[body] for st in states], complex)
            # a pose that is not assembled has none
            with np.errstate(all="ignore"):
                length = np.abs(e)
                found.turn[body] = e / length
            self._length[body] = np.abs(length - 1)
            known = all(body in st.angle for st in states)
            self._unwound[body] = np.abs(
                poses.join([st.angle[body] for st in states], float) if known else np.angle(e)
            )
        for guide in states[0].slide if states else ():
            found.slide[guide] = poses.join([st.slide[guide] for st in states], float)
        return found

    def _rates_of(self, order: int, rows: slice) -> Rates:
        """The motion's time derivatives over some poses, as rates."""
        st = State([q[rows] for q in self._state.inputs], many=True)
        st.turn = {body: e if body == GROUND else e[rows] for body, e in self._state.turn.items()}
        st.slide = {guide: s[rows] for guide, s in self._state.slide.items()}
        rates = Rates(self.plan, st, [])
        for body in self.share:
            if body != GROUND:
                rates.angle[body] = [self.poses.angle_derivative(body, k)[rows] for k in range(1, order + 1)]
        for guide in st.slide:
            rates.slide[guide] = [self.poses.slide_derivative(guide, k)[rows] for k in range(1, order + 1)]
        return rates

    @cached_property
    def _relative(self) -> dict[str, Any]:
        """What every e^{iθ} is wrong by, apart from its unknowns: roundings, its length, a tied angle's own sum."""
        st = self._state
        own: dict[str, Any] = dict.fromkeys(self.share, 0.0)
        for tie in self.ties:
            own[tie.body] = self._own(tie.angle, own, st)
        found = {body: ROUNDINGS * EPS + self._length[body] + own[body] for body in self.share}
        return found | {GROUND: EPS / 2}

    def _own(self, angle: Angle, own: dict[str, Any], st: State) -> Any:
        """The rounding of const + Σ k·input + Σ r·θ_base, the bases' own among it."""
        plain = len(angle.inputs) == 1 and angle.inputs[0][1] == 1.0
        # in a sweep e^{iθ} is a product of three factors
        error: Any = (
            1.5 * EPS if angle.inputs and self.poses.swept and len(self.poses.mechanism.inputs) == 1 else 0.0
        )
        for j, k in angle.inputs:
            error = error + abs(k) * self.given[:, j]
        # the constant is itself a sum of angles of this size
        error = error + EPS * max(abs(angle.const), angle.size)
        if not plain:
            error = error + EPS * (abs(angle.const) + 2 * sum(abs(k * st.inputs[j]) for j, k in angle.inputs))
        for base, r in angle.bases:
            error = error + abs(r) * own[base]
            # an angle times a ratio is rounded as large as it is, whole turns and all
            turned = 1.0 if abs(r) == 1.0 else abs(r) * (1 + self._unwound[base])
            error = error + EPS * turned
        return error

    # --- the unknowns -------------------------------------------------------------------------------------------
    def unknowns(self, order: int) -> Reals:
        """Bounds of the errors of every unknown's derivative of one order, (n, unknowns): all angles, all slides."""
        if len(self._solved) <= order:
            u, rows = len(self.angles) + len(self.slides), 2 * len(self.loops)
            found = [np.zeros((self.n, u)) for _ in range(order + 1)]
            self._tau = np.zeros((self.n, u))
            step = max(1, ENTRIES // max(1, u * rows))
            with np.errstate(all="ignore"):
                for start in range(0, self.n if u else 0, step):
                    part = slice(start, min(start + step, self.n))
                    for whole, some in zip(found, self._some(order, part), strict=True):
                        whole[part] = some
            self._solved = found
        return self._solved[order]

    @property
    def tau(self) -> Reals:
        """The second-order step of every unknown as a share of its first, (n, unknowns); from 1/2 on, at a limit."""
        self.unknowns(0)
        return self._tau

    def _some(self, order: int, rows: slice) -> list[Reals]:
        """The bounds over some poses, orders 0 … order."""
        rates = self._rates_of(order, rows)
        n = len(rates.st.inputs[0])
        scale = np.array([1 / self.size] * len(self.angles) + [1.0] * len(self.slides))
        j = [self._jacobian(rates, m, n) * scale for m in range(order + 1)]
        residual = [self._residual(rates, rows, k, n) for k in range(order + 1)]
        # a group that has no pose, or no rates, takes none from those before it
        unknown = [self._unknown(j[k], residual[k]) for k in range(order + 1)]
        back = -self._inverse(j[0])
        for matrix in (*j, *residual):
            matrix[~np.isfinite(matrix)] = 0.0
        a: list[list[Reals]] = []
        for k in range(order + 1):
            row = []
            for i in range(k):
                right = sum(comb(k, m) * (j[k - m] @ a[m][i]) for m in range(i, k))
                row.append(back @ right)
            a.append([*row, back])
        bounds = [
            sum((np.abs(a[k][i]) @ residual[i][..., None])[..., 0] for i in range(k + 1)) * scale
            for k in range(order + 1)
        ]
        high, low = self._second(rates, back, bounds[0], scale)
        self._tau[rows] = high
        found = [bounds[0] * kept(high, low), *(b * grown(high, k) for k, b in enumerate(bounds[1:], 1))]
        for k, bound in enumerate(found):
            bound[np.any(unknown[: k + 1], axis=0)] = np.nan
        return found

    def _unknown(self, j: Reals, residual: Reals) -> NDArray[np.bool_]:
        """Which unknowns belong to a group with a loop that is no number, (n, unknowns)."""
        bad: Any = ~(np.isfinite(j).all(axis=2) & np.isfinite(residual))
        out = np.zeros((len(j), j.shape[2]), dtype=bool)
        for rows, own in self._blocks:
            out[:, own] |= np.any(bad[:, rows], axis=1)[:, None]
        return out

    @cached_property
    def _blocks(self) -> list[tuple[slice, list[int]]]:
        """The rows and the columns of every group in J."""
        found, row = [], 0
        for g in self.groups:
            slides = [len(self.angles) + self.slides.index(s) for s in g.slides]
            own = [self.angles.index(a) for a in g.angles] + slides
            found.append((slice(row, row + 2 * len(g.closures)), own))
            row += 2 * len(g.closures)
        return found

    def _inverse(self, j: Reals) -> Reals:
        """J⁻¹, group after group; zero for the unknowns of a group that is not assembled.

        As one matrix it would be of least squares wherever one group is not assembled or stands at a limit: the loops
        of that group would then count as equations of the groups before it, and make their bounds too small.
        """
        out = np.zeros((len(j), j.shape[2], j.shape[1]))
        for rows, own in self._blocks:
            block = inverse(j[:, rows, own])
            block[~np.isfinite(block)] = 0.0
            # what the groups before it move in its loops
            moved = j[:, rows] @ out
            moved[~np.isfinite(moved)] = 0.0
            out[:, own] = -block @ moved
            out[:, own, rows] = block
        return out

    def _jacobian(self, rates: Rates, m: int, n: int) -> Reals:
        """The m-th time derivative of J, (n, 2·loops, unknowns)."""
        out = np.zeros((n, 2 * len(self.loops), len(self.angles) + len(self.slides)))
        for i, (terms, _) in enumerate(self.loops):
            for t in terms:
                turned = 1j * value_of(rates, t, m)
                for column, r in self.share[t.body].items():
                    out[:, 2 * i, column] += r * np.real(turned)
                    out[:, 2 * i + 1, column] += r * np.imag(turned)
                if t.slide in self.slides:
                    column = len(self.angles) + self.slides.index(t.slide)
                    along = value_of(rates, Term(t.z, t.body), m)
                    out[:, 2 * i, column] += np.real(along)
                    out[:, 2 * i + 1, column] += np.imag(along)
        return out

    def _residual(self, rates: Rates, rows: slice, k: int, n: int) -> Reals:
        """The size of what the k-th derivative of each loop leaves, (n, 2·loops): as computed, and its rounding."""
        out = np.empty((n, 2 * len(self.loops)))
        for i, (terms, nodes) in enumerate(self.loops):
            left = rates.vector((None, terms), k)
            noise = self._noise(rates, rows, terms, nodes, k)
            out[:, 2 * i] = np.abs(np.real(0.0 if left is None else left)) + noise
            out[:, 2 * i + 1] = np.abs(np.imag(0.0 if left is None else left)) + noise
        return out

    def _noise(
        self, rates: Rates, rows: slice, terms: tuple[Term, ...], nodes: tuple[str, ...], k: int
    ) -> Any:
        """The rounding of a sum of terms, and of the points on the way."""
        sizes = Sizes(rates)
        noise: Any = 0.0
        for t in terms:
            relative = self._relative[t.body]
            noise = noise + sizes.term(t, k) * (relative if np.ndim(relative) == 0 else relative[rows])
            if t.slide in self.driven:
                noise = noise + abs(t.z) * sizes.turn(t.body, k) * self.given[rows, self.driven[t.slide]]
        for node in nodes:
            noise = noise + EPS * np.abs(sum_of(rates, self.routes[node][0], k))
        return noise

    def _second(self, rates: Rates, back: Reals, first: Reals, scale: Reals) -> tuple[Reals, Reals]:
        """The second-order step of every unknown as a share of its first: no less than it is, and no more, (n, unknowns).

        No less: all terms of the second order by their sizes. No more: with their signs, for a step in the direction
        in which J is weakest.
        """
        n, first = len(first), first / scale
        weak = np.argmax(np.square(back).sum(axis=1), axis=1)
        step = np.take_along_axis(back, weak[:, None, None], axis=2)[..., 0]
        step *= np.min(first / np.maximum(np.abs(step), 1e-300), axis=1)[:, None]
        parts: list[Reals] = []
        for move in (first * scale, step * scale):
            sized = not parts
            bent = np.zeros((n, len(self.loops)), complex)
            for i, (terms, _) in enumerate(self.loops):
                for t in terms:
                    value, bare = value_of(rates, t, 0), value_of(rates, Term(t.z, t.body), 0)
                    share = self.share[t.body].items()
                    turned = sum((abs(r) if sized else r) * move[:, column] for column, r in share)
                    along: Any = 0.0
                    if t.slide in self.slides:
                        along = 2j * bare * move[:, len(self.angles) + self.slides.index(t.slide)] * turned
                    curve = value * turned**2
                    bent[:, i] += np.abs(curve) + np.abs(along) if sized else along - curve
            pairs = np.repeat(np.abs(bent), 2, axis=1) if sized else bent.view(float)
            pairs[~np.isfinite(pairs)] = 0.0
            matrix = np.abs(back) if sized else back
            second = np.abs(matrix @ pairs[..., None])[..., 0]
            parts.append(np.divide(second, first, out=np.zeros_like(second), where=first > 0))
        return parts[0], parts[1]

    # --- what is asked for ----------------------------------------------------------------------------------------
    def angle(self, body: str, order: int = 0) -> Reals:
        """Bound of the error of a link's angle (rad), ω, α or angular jerk, (n,)."""
        made = self._made.setdefault(body, [])
        while len(made) <= order:
            made.append(self._angle(body, len(made)))
        return made[order]

    def _angle(self, body: str, k: int) -> Reals:
        if body == GROUND:
            return np.zeros(self.n)
        if k == 0:
            return np.asarray(self.rotation(body) + EPS / 2 * np.abs(np.angle(self._state.turn[body])))
        total = self._moved(body, k)
        total += ROUNDINGS * EPS * np.abs(self.poses.angle_derivative(body, k))
        return total + self._tied(body, k)

    def _tied(self, body: str, k: int) -> Reals:
        """The rounding of the k-th rate of an angle that is a sum of others, theirs among it; (n,), else zero."""
        total = np.zeros(self.n)
        angle = next((tie.angle for tie in self.ties if tie.body == body), Angle())
        terms = [(abs(f), np.abs(self.poses.rate(j, k))) for j, f in angle.inputs]
        terms += [(abs(r), self._sized(base, k)) for base, r in angle.bases if base != GROUND]
        if not terms or (len(terms) == 1 and terms[0][0] == 1.0 and angle.inputs):
            return total
        for f, size in terms:
            # the factor, its product, the products of the law of motion, and every sum after it
            total = total + EPS * (1 + k + len(terms)) / 2 * f * size
        for base, r in angle.bases:
            total = total + abs(r) * self._tied(base, k)
        return total

    def _sized(self, body: str, k: int) -> Reals:
        """The sizes of what the law of motion adds up to the k-th rate of an angle, (n,)."""
        if len(self.poses.mechanism.inputs) > 1 or k == 1:
            return np.abs(self.poses.angle_derivative(body, k))
        v, a = self.poses.rate(0, 1), self.poses.rate(0, 2)
        weights = [a, v * v] if k == 2 else [self.poses.rate(0, 3), 3 * v * a, v**3]
        total = np.zeros(self.n)
        for order, weight in enumerate(weights, 1):
            total = total + np.abs(self.poses.angle_coefficient(body, order=order) * weight)
        return total

    def slide(self, guide: int, order: int = 0) -> Reals:
        """Bound of the error of a slide (m) or of its rates, (n,)."""
        if guide not in self.slides:
            return np.array(self.given[:, self.driven[guide]]) if order == 0 else np.zeros(self.n)
        found = self.unknowns(order)[:, len(self.angles) + self.slides.index(guide)]
        return found + EPS * np.abs(self.poses.slide_derivative(guide, order))

    def point(self, body: str, z: complex, node: str | None = None, order: int = 0) -> Reals:
        """Bound of the error of a point's position (m), velocity, acceleration or jerk, (n,): the length of the error."""
        base, own = (node, ()) if node is not None else self.plan.anchors[body]
        last = () if node is not None else (*own, Term(z, body))
        terms, nodes = self.routes[base]
        terms = combined((*terms, *last))
        with np.errstate(all="ignore"):
            everywhere = slice(0, self.n)
            rates = self._rates_of(order, everywhere)
            total = np.zeros(self.n) + self._noise(rates, everywhere, terms, nodes, order)
            for t in terms:
                for j in range(order + 1):
                    c = comb(order, j)
                    if t.body != GROUND:
                        turned = self._moved(t.body, j)
                        total += c * np.abs(value_of(rates, t, order - j)) * turned
                    if t.slide in self.slides:
                        bare = value_of(rates, Term(t.z, t.body), order - j)
                        total += (
                            c
                            * np.abs(bare)
                            * self.unknowns(j)[:, len(self.angles) + self.slides.index(t.slide)]
                        )
            out: Reals = total + EPS * np.abs(sum_of(rates, terms, order))
        return out

    def rotation(self, body: str) -> Reals:
        """Bound of the error of a link's e^{iθ}, (n,)."""
        return np.asarray(self._moved(body, 0) + self._relative[body])

    def _moved(self, body: str, k: int) -> Reals:
        """What the unknowns' errors do to an angle."""
        total = np.zeros(self.n)
        for column, r in self.share[body].items():
            total += abs(r) * self.unknowns(k)[:, column]
        return total
