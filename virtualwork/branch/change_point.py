"""A change point: where two branches cross, the tangents through it, and every higher derivative there.

Where the Jacobian Φ of a group vanishes while its loops still close on both sides, two branches cross. With the left
null vector n of Φ, the n-component of the k-th derivative of the loops holds no k-th derivative of the unknowns:
at k = 2 it is a quadratic in the free rate along Φ's null vector, whose two roots are the tangents of the two
branches; at k > 2 it is linear in the free (k−1)-th rate. So the branch goes on smoothly, with exact derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import factorial
from typing import Any, Protocol

import numpy as np

from virtualwork.branch.choice import Choice
from virtualwork.branch.sampling import chebyshev_nodes
from virtualwork.formulas.numbers import Number, Reals, stack, stack_rows
from virtualwork.formulas.positions import State, tied
from virtualwork.formulas.rates import Passage, Rates
from virtualwork.plan.steps import Group, Step

# of the series through a change point
ORDER = 12
# share of the series' radius of convergence, within which it replaces the closed form
REACH = 0.03
# of a turn over 2π: how far to each side of a change point its branches are compared with the closed form
SPANS = 0.02, 0.0025, 3e-4, 4e-5, 5e-6


class Along(Passage, Protocol):
    """The way of the one input, as change points and continuations need it."""

    assembly: Choice
    start: float
    length: float
    whole: bool
    flips: dict[str, Reals]
    folded: set[str]

    def run(self, steps: Iterable[Step], st: State) -> None:
        """Work out positions, each group on its branch."""

    def pose(self, steps: Iterable[Step], inputs: Sequence[float], singular: bool = False) -> State:
        """What steps make of one pose."""


@dataclass(frozen=True)
class ChangePoint:
    """Where a group's two branches cross: the input, the unknowns there, and their derivatives.

    `turn` and `slide` are the unknowns at the point; `rates[k−1]` their k-th derivatives along the branch taken.
    """

    group: str
    input: float
    turn: tuple[complex, ...]
    slide: tuple[float, ...]
    rates: Any
    reach: float
    # first rates of the branch not taken
    other: Any = None

    def unknown(self, delta: Number, order: int) -> Any:
        """The unknowns' derivatives of one order at a distance from the point (order 0: their change)."""
        n = len(self.rates)
        total = np.zeros((*np.shape(delta), len(self.rates[0])))
        for j in range(n - order, -1, -1):
            k = order + j
            if k == 0:
                continue
            total = total + np.multiply.outer(delta**j, self.rates[k - 1]) / factorial(j)
        return total


def branches(group: Group, start: Callable[[], Rates], order: int) -> list[list[Reals]]:
    """The derivatives [x′, x″, ... x⁽ᵒʳᵈᵉʳ⁾] of a group's unknowns on each branch through a change point.

    Parameters
    ----------
    start : callable
        Gives fresh `Rates` at the change point, with everything the group depends on known to order + 1.

    Returns
    -------
    list of branches
        Two where two tangents cross; one where both fall together; none where the tangent is not determined.
    """
    d = start()
    jacobian = stack(d.columns(group), 1)[0]
    if not np.isfinite(jacobian).all():
        # what the group depends on is not assembled here
        return []
    u, s, vt = np.linalg.svd(jacobian)
    left, null = u[:, -1], vt[-1]
    span = len(s) - 1

    def particular(right: Reals) -> Reals:
        """The solution of Φ·x = −right without a component along the null vector."""
        return np.asarray(vt[:span].T @ ((u[:, :span].T @ -right) / s[:span]))

    def gap(d: Rates, k: int) -> Reals:
        return np.asarray(stack_rows(d.right_side(group, k), 1)[0])

    base = particular(gap(d, 1))

    def second(rate: float) -> float:
        trial = start()
        trial.right_side(group, 1)
        trial.write(group, 1, list(base + rate * null))
        return float(left @ gap(trial, 2))

    c, plus, minus = second(0.0), second(1.0), second(-1.0)
    a, b = (plus + minus) / 2 - c, (plus - minus) / 2
    branches = []
    for rate in _roots(a, b, c):
        trial = start()
        trial.right_side(group, 1)
        series = [base + rate * null]
        trial.write(group, 1, list(series[0]))
        slope = 2 * a * rate + b
        for k in range(2, order + 1):
            x = particular(gap(trial, k))
            trial.write(group, k, list(x))
            rest = float(left @ gap(trial, k + 1))
            # the (k+1)-th derivative holds (k+1)·n·(f_xx x′ + f_xq)·x⁽ᵏ⁾; at k = 1 it is twice, which is the slope
            mu = -rest / (slope * (k + 1) / 2) if slope != 0 else np.nan
            x = x + mu * null
            trial.write(group, k, list(x))
            series.append(x)
        branches.append(series)
    return branches


def _roots(a: float, b: float, c: float) -> list[float]:
    """Real roots of a·x² + b·x + c without cancellation."""
    scale = max(abs(a), abs(b), abs(c))
    if scale == 0:
        return []
    if abs(a) <= 1e-14 * scale:
        return [-c / b] if b else []
    inside = b * b - 4 * a * c
    if inside < -1e-9 * scale * scale:
        return []
    q = -0.5 * (b + np.copysign(np.sqrt(max(inside, 0.0)), b))
    roots = [q / a, c / q] if q else [0.0, -b / a]
    return [float(r) for r in roots]


def through(way: Along, group: Group, q0: float, share: float) -> ChangePoint:
    """The exact branch through a change point.

    Where the links are nearly equal one of the branches turns many times faster than the input: the closed form
    is then compared with the series closer to the point, until one of the series is the branch. Everything is looked
    at `share` times as near as where the input itself is what turns fastest.
    """
    for span in SPANS:
        change, miss = _nearest(way, group, q0, span, share)
        if miss < 1e-6:
            break
    return change


def _nearest(way: Along, group: Group, q0: float, span: float, share: float) -> tuple[ChangePoint, float]:
    """The series that the closed form follows within a span around a change point, and how far they are apart."""
    choice = way.assembly
    nodes = span * share * chebyshev_nodes(12) * way.length / (2 * np.pi)
    st = State([q0 + nodes])
    way.run(choice.needed(choice.plan.writes(group)), st)
    weights = _at_centre(nodes)
    turn, slide = [], []
    for body in group.angles:
        e = complex(np.sum(weights * st.turn[body]))
        turn.append(e / abs(e))
    for g in group.slides:
        slide.append(float(np.sum(weights * st.slide[g])))
    before = choice.before(group)

    def start() -> Rates:
        at = State([q0])
        way.run(before, at)
        for j, body in enumerate(group.angles):
            at.turn[body] = turn[j]
        for j, g in enumerate(group.slides):
            at.slide[g] = slide[j]
        for tie in group.ties:
            tied(tie, at)
        d = Rates(choice.plan, at, [[1.0]], way)
        for k in range(1, ORDER + 2):
            d.advance(before, k)
        return d

    try:
        candidates = branches(group, start, ORDER)
    except ZeroDivisionError:
        # a group that this one depends on has no direction here
        candidates = []
    best, nearest = None, np.inf
    probe = int(np.argmax(nodes))
    for rates in candidates:
        change = ChangePoint(group.name, q0, tuple(turn), tuple(slide), np.array(rates), 0.0)
        move = change.unknown(nodes[probe], 0)
        miss = (
            sum(
                abs(turn[j] * np.exp(1j * move[j]) - st.turn[body][probe])
                for j, body in enumerate(group.angles)
            )
            + sum(
                abs(slide[j] + move[len(turn) + j] - st.slide[g][probe]) for j, g in enumerate(group.slides)
            )
            / choice.mechanism.size
        )
        if miss < nearest:
            best, nearest = rates, miss
    if best is None or not np.isfinite(best).all():
        unknown = np.full((ORDER, len(turn) + len(slide)), np.nan)
        return ChangePoint(group.name, q0, tuple(turn), tuple(slide), unknown, 0.0), np.inf
    scale = np.array([1.0] * len(turn) + [choice.mechanism.size] * len(slide))
    terms = [float(np.abs(r / scale).max()) / factorial(k) for k, r in enumerate(best, 1)]
    radius = (
        min(t ** (-1 / k) for k, t in enumerate(terms, 1) if t > 0 and k >= 3)
        if max(terms[2:]) > 0
        else np.inf
    )
    reach = REACH * min(radius, share * (1.0 if way.length > 6 else way.length))
    others = [rates[0] for rates in candidates if rates is not best]
    change = ChangePoint(
        group.name, q0, tuple(turn), tuple(slide), np.array(best), reach, others[0] if others else None
    )
    return change, float(nearest)


def _at_centre(nodes: Reals) -> Reals:
    """Weights of polynomial interpolation from the nodes to 0 (barycentric, second form)."""
    w = np.array([1 / np.prod(x - np.delete(nodes, i)) for i, x in enumerate(nodes)])
    w = w / -nodes
    return np.asarray(w / w.sum())


# --- poses close to one ------------------------------------------------------------------------------------------
class ChangePoints(tuple[ChangePoint, ...]):
    """The change points of one group in the order of their inputs; what `mend` looks up."""

    @cached_property
    def between(self) -> Reals:
        """The inputs half way from each to the next."""
        at = np.array([change.input for change in self])
        return np.asarray((at[1:] + at[:-1]) / 2)

    def close_by(self, q: Number) -> Iterator[tuple[ChangePoint, Any, Number]]:
        """Those close to inputs q: each with which of the inputs (None: the one), and how far they are."""
        if not self:
            return
        places = np.searchsorted(self.between, q)
        if np.ndim(q) == 0:
            change = self[int(places)]
            if abs(q - change.input) < change.reach:
                yield change, None, q - change.input
            return
        for i in np.unique(places):
            near = (places == i) & (np.abs(q - self[i].input) < self[i].reach)
            if near.any():
                yield self[i], near, q[near] - self[i].input


def mend(changes: ChangePoints, group: Group, st: State) -> None:
    """Replace positions close to a change point by the series through it."""
    for change, near, delta in changes.close_by(st.inputs[0]):
        move = change.unknown(delta, 0)
        for j, body in enumerate(group.angles):
            put(st.turn, body, near, change.turn[j] * np.exp(1j * move[..., j]))
        for j, g in enumerate(group.slides):
            put(st.slide, g, near, change.slide[j] + move[..., len(group.angles) + j])
        put(st.margin, group.name, near, np.zeros(np.shape(delta)))
        for tie in group.ties:
            tied(tie, st)


def mend_rates(changes: ChangePoints, q: Number, k: int, x: list[Number]) -> list[Number]:
    """The same for the unknowns' k-th derivatives."""
    for change, near, delta in changes.close_by(q):
        rate = change.unknown(delta, k)
        for j in range(len(x)):
            put(x, j, near, rate[..., j])
    return x


def put(store: Any, key: Any, near: Any, value: Any) -> None:
    """Replace a value, or those of some poses."""
    if near is None:
        store[key] = complex(value) if np.iscomplexobj(value) else float(value)
        return
    whole = np.array(np.broadcast_to(store[key], near.shape))
    whole[near] = value
    store[key] = whole
