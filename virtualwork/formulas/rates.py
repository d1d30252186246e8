"""Derivatives of every order along derivatives of the inputs.

They follow Leibniz's rule on e^{iθ}:  (e^{iθ})⁽ᵏ⁾ = i Σ_j C(k−1, j) θ⁽ʲ⁺¹⁾ (e^{iθ})⁽ᵏ⁻¹⁻ʲ⁾. The part of a loop's k-th
derivative that holds no unknown of order k is its right-hand side; the columns of the Jacobian are the same for every
order. This is the velocity (Ibrahim §1.4), acceleration (§1.5, with the Coriolis term 2ω·ṡ of §1.10) and jerk in one
formula.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import comb
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from virtualwork.describe.laws import Lift
from virtualwork.describe.meshes import Coordinate
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.lifts import composed
from virtualwork.formulas.numbers import Number, cross, determined, plus, singular_poses, solve_columns, times
from virtualwork.formulas.positions import State, columns
from virtualwork.plan.steps import Angle, Group, Path, Place, Plan, Step, Term, Turn

NOTHING: Mapping[int, Any] = MappingProxyType({})


class Passage(Protocol):
    """How the derivatives go on where a Jacobian vanishes though the branch does not end."""

    @property
    def changes(self) -> Mapping[str, tuple[Any, ...]]:
        """The change points of each group in what was covered."""

    def bridge_rates(self, group: Group, q: Number, k: int, x: list[Number], singular: Any) -> list[Number]:
        """The k-th derivatives of a group's unknowns with those at singular poses replaced."""

    def mend_rates(self, group: Group, q: Number, k: int, x: list[Number]) -> list[Number]:
        """The k-th derivatives of a group's unknowns with those close to a change point replaced."""


class Rates:
    """Derivatives of every order along derivatives of the inputs, over the poses of one `State`.

    Attributes
    ----------
    rates : list over inputs of [first, second, third ... derivative]
    angle : dict of body to [θ′, θ″, ...]
    point : dict of node to [P′, P″, ...]
    slide : dict of guide to [s′, s″, ...]

    A derivative that is identically zero is None, and costs nothing.
    """

    def __init__(
        self, plan: Plan, st: State, rates: list[list[Number]], passage: Passage | None = None
    ) -> None:
        self.plan, self.st, self.rates, self.passage = plan, st, rates, passage
        self.angle: dict[str, list[Number]] = {GROUND: []}
        self.point: dict[str | None, list[Number]] = {None: []}
        self.slide: dict[int, list[Number]] = {}
        self._turn: dict[tuple[str, int], Number] = {}
        self._normal: dict[str, Number] = {}
        self._columns: dict[str, list[list[Number]]] = {}
        self._inverse: dict[str, Number] = {}

    def rate(self, j: int, k: int) -> Number:
        """The k-th derivative of input j."""
        return self.rates[j][k - 1] if k <= len(self.rates[j]) else None

    def turn_partial(self, body: str, k: int, top: Number) -> Number:
        """(e^{iθ})⁽ᵏ⁾ with θ⁽ᵏ⁾ replaced by `top`."""
        theta = self.angle[body]
        if k == 2 and theta[0] is not None:
            # the commonest case, (iα − ω²)·e^{iθ}, in one step; the right side of a group asks for its second part first
            if body not in self._normal:
                self._normal[body] = -(theta[0] * theta[0]) * self.st.turn[body]
            normal = self._normal[body]
            return normal if top is None else normal + 1j * (top * self.st.turn[body])
        total: Number = None
        for j in range(k - 1):
            if theta[j] is not None:
                total = plus(total, times(comb(k - 1, j), times(theta[j], self.turn(body, k - 1 - j))))
        if top is not None:
            total = plus(total, times(top, self.st.turn[body]))
        return None if total is None else 1j * total

    def turn(self, body: str, k: int) -> Number:
        """(e^{iθ})⁽ᵏ⁾."""
        if k == 0:
            return self.st.turn[body]
        if body == GROUND:
            return None
        if (body, k) not in self._turn:
            self._turn[body, k] = self.turn_partial(body, k, self.angle[body][k - 1])
        return self._turn[body, k]

    def vector(self, path: Path, k: int) -> Number:
        """The k-th derivative of a point, P[base] + Σ terms."""
        base, terms = path
        v: Number = None if base is None else self.point[base][k - 1]
        for t in terms:
            v = plus(v, self._term(t, k))
        return v

    def advance(self, steps: Iterable[Step], k: int) -> None:
        """Carry steps on to derivatives of order k, from those of the lower orders."""
        for step in steps:
            if isinstance(step, Place):
                _put(self.point, step.node, k, self.vector((step.base, step.terms), k))
            elif isinstance(step, Group):
                self._group(step, k)
            elif isinstance(step, Turn):
                self._write_tied(step, k)
            else:
                _put(self.slide, step.guide, k, self.rate(step.input, k))

    def _tied(self, angle: Angle, k: int, without: tuple[Coordinate, ...] = ()) -> Number:
        value: Number = None
        for j, f in angle.inputs:
            value = plus(value, times(f, self.rate(j, k)))
        for base, r in angle.bases:
            if base not in without:
                known = self.slide[base] if isinstance(base, int) else self.angle[base]
                value = plus(value, times(r, known[k - 1]))
        for of, r in angle.cams:
            value = plus(value, times(r, composed(k, self.st.lifts[of], self.against(of, k))))
        return value

    def against(self, of: Lift, k: int) -> list[Number]:
        """The derivatives up to the k-th of a cam's angle against the body that carries it."""
        on = self.angle[of.on]
        if not on:
            return self.angle[of.cam][:k]
        return [plus(a, times(-1, b)) for a, b in zip(self.angle[of.cam][:k], on[:k], strict=True)]

    def _write_tied(self, tie: Turn, k: int) -> None:
        """Store the k-th derivative of an angle or a slide that is tied to others."""
        store: dict[Any, list[Number]] = self.slide if tie.slides else self.angle
        _put(store, tie.body, k, self._tied(tie.angle, k))

    def _term(
        self, t: Term, k: int, tops: dict[str, Number] | None = None, unknown: Mapping[int, Number] = NOTHING
    ) -> Number:
        """(z·s·e^{iθ})⁽ᵏ⁾; `tops` stand for (e^{iθ})⁽ᵏ⁾, and `unknown` for s⁽ᵏ⁾ without what is not known of it."""
        highest = tops[t.body] if tops and t.body in tops else self.turn(t.body, k)
        if t.slide is None:
            return times(t.z, highest)
        s = self.slide.get(t.slide, [])
        total = None if highest is None else self.st.slide[t.slide] * highest
        for j in range(1, k + 1):
            rate = unknown[t.slide] if j == k and t.slide in unknown else s[j - 1]
            if rate is not None:
                e = self.turn(t.body, k - j)
                if e is not None:
                    total = plus(total, times(comb(k, j), rate * e))
        return times(t.z, total)

    def right_side(self, group: Group, k: int) -> list[Number]:
        """The k-th derivative of each loop with the unknowns' own k-th derivatives left out."""
        tops: dict[str, Number] = {}
        for body in group.angles:
            self.angle.setdefault(body, [])
            tops[body] = self.turn_partial(body, k, None)
        own: tuple[Coordinate, ...] = (*group.angles, *group.slides)
        runs: dict[int, Number] = dict.fromkeys(group.slides)
        for tie in group.ties:
            if isinstance(tie.body, int):
                runs[tie.body] = self._tied(tie.angle, k, own)
                continue
            self.angle.setdefault(tie.body, [])
            tops[tie.body] = self.turn_partial(tie.body, k, self._tied(tie.angle, k, own))
        rows = []
        for closure in group.closures:
            w: Number = None
            if closure.start is not None:
                w = self.point[closure.start][k - 1]
            if closure.end is not None:
                w = plus(w, times(-1, self.point[closure.end][k - 1]))
            for t in closure.terms:
                w = plus(w, self._term(t, k, tops, runs))
            rows.append(0j if w is None else w)
        return rows

    def columns(self, group: Group) -> list[list[Number]]:
        """The group's Jacobian, formed once for all orders."""
        if group.name not in self._columns:
            self._columns[group.name] = columns(group, self.st)
        return self._columns[group.name]

    def inverse(self, group: Group) -> Number:
        """1/(c1 × c2) of a closed form's two columns, formed once for all orders and the joint forces."""
        if group.name not in self._inverse:
            c1, c2 = self.columns(group)[0]
            self._inverse[group.name] = 1 / cross(c1, c2)
        return self._inverse[group.name]

    def _group(self, group: Group, k: int) -> None:
        right = self.right_side(group, k)
        cols = self.columns(group)
        if group.name in self.st.folded:
            x = solve_columns(cols, right, determined)
        elif group.kind != "Newton":
            x = crossed(cols[0], right[0], self.inverse(group))
        else:
            x = self.st.kind.solve(cols, right)
        if group.name not in self.st.folded:
            x = passed(self.passage, group, self.st.inputs[0], cols, k, x)
        self.write(group, k, x)

    def write(self, group: Group, k: int, x: list[Number]) -> None:
        """Store the unknowns' k-th derivatives and those of the angles tied to them."""
        n = len(group.angles)
        for body in group.members:
            for j in [j for known, j in self._turn if known == body and j >= k]:
                del self._turn[body, j]
            if k == 1:
                self._normal.pop(body, None)
        for body, value in zip(group.angles, x[:n], strict=True):
            _put(self.angle, body, k, value)
        for g, value in zip(group.slides, x[n:], strict=True):
            _put(self.slide, g, k, value)
        for tie in group.ties:
            self._write_tied(tie, k)


def crossed(columns: Sequence[Number], right: Number, inverse: Number) -> list[Number]:
    """The two unknowns' derivatives of a loop with a closed form: x₁·c₁ + x₂·c₂ + w = 0, with 1/(c₁ × c₂)."""
    c1, c2 = columns
    return [cross(c2, right) * inverse, cross(right, c1) * inverse]


def passed(
    passage: Passage | None, group: Group, q: Number, cols: list[list[Number]], k: int, x: list[Number]
) -> list[Number]:
    """The k-th derivatives of a group's unknowns, where its Jacobian vanishes though the branch goes on as the passage has them."""
    if passage is None:
        return x
    if group.kind == "Newton":
        singular = singular_poses(cols, np.size(q))
        if singular.any():
            x = passage.bridge_rates(group, q, k, x, singular)
    return passage.mend_rates(group, q, k, x) if passage.changes else x


def _put(store: dict[Any, list[Number]], key: Any, k: int, value: Number) -> None:
    series = store.setdefault(key, [])
    del series[k - 1 :]
    series.append(value)


def chain_rule(order: int, get: Callable[[int], Number], rates: Sequence[Number]) -> Number:
    """A derivative in time of what has the derivatives K, L, M over the input, from q̇, q̈, q⃛; None is zero."""
    v, a, j = rates
    # what each derivative over the input is weighed with
    if order == 1:
        weights: tuple[Number, ...] = (v,)
    elif order == 2:
        weights = a, None if v is None else v * v
    else:
        second = None if v is None or a is None else 3.0 * v * a
        weights = j, second, None if v is None else v * v * v
    total: Number = None
    for k in range(order, 0, -1):
        weight = weights[k - 1]
        value = None if weight is None else get(k)
        if value is not None:
            # a factor of exactly 1 costs nothing
            value = value if isinstance(weight, float) and weight == 1.0 else value * weight
            total = value if total is None else total + value
    return total
