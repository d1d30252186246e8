"""Poses: blocks of them, each solved as far as it is asked, and never twice.

Poses run in blocks small enough to stay in cache; a block keeps what it has solved. With one input, derivatives are
taken once with respect to the input (the velocity coefficients K = dx/dq, L = d²x/dq², M = d³x/dq³), so that
ẋ = K·q̇,  ẍ = K·q̈ + L·q̇²,  x⃛ = K·q⃛ + 3L·q̇·q̈ + M·q̇³.  With several inputs they are taken along the inputs' rates.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property, partial
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.guard import Lock, guarded
from virtualwork.describe.description import Description
from virtualwork.formulas.kinematics import Angle, Kinematic, Partial, Point
from virtualwork.formulas.numbers import Complexes, Number, Reals, condition, real_array
from virtualwork.formulas.positions import BLOCK, State, columns, run
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.rates import Passage, Rates, chain_rule
from virtualwork.plan.steps import Group, Plan, Step


class Branch(Protocol):
    """One assembly of a mechanism, as its poses need it: what to solve, and which way every loop closes."""

    @property
    def lock(self) -> Lock:
        """Of all that is worked out of it."""

    @property
    def mechanism(self) -> Description:
        """What moves."""

    @property
    def plan(self) -> Plan:
        """The order of solution."""

    @property
    def prepared(self) -> dict[bool, Any]:
        """What acts at rest (False) and in motion (True), made once for all poses."""

    @property
    def load_paths(self) -> dict[bool, Any]:
        """How the loads bear on joints and inputs, at rest (False) and in motion (True)."""

    @property
    def merged(self) -> tuple[Plan, Group | None]:
        """All loops at once."""

    @property
    def passage(self) -> Passage | None:
        """How derivatives go through change points; None with several inputs."""

    @property
    def recordings(self) -> dict[Any, Any]:
        """What has been written down of it."""

    @property
    def known_steps(self) -> dict[tuple[str, ...], tuple[Step, ...]]:
        """The steps that targets depend on, as far as requested."""

    @property
    def plain(self) -> dict[str, Callable[[State], None]]:
        """The closed forms that keep their sign wherever the input goes, each ready to be solved."""

    @property
    def close(self) -> Callable[[Group, State], None]:
        """Closes the loops of any other group on its branch."""

    def cover(self, low: float, high: float) -> None:
        """Look for change points and limits over the inputs from low to high."""


def check_rate(name: str, rate: Reals, n: int, k: int) -> None:
    """Refuse a rate of k inputs that does not go with n poses.

    Raises
    ------
    ValueError
    """
    shapes = [(n, k), (k,), (1, k)] if k > 1 else [(n,), (n, 1)]
    if rate.size != 1 and rate.shape not in shapes:
        raise ValueError(
            f"{name}: expected a number or shape {shapes[0]}, as the angle has, found {rate.shape}"
        )


@guarded
class Poses:
    """Poses of an assembly over given inputs and their rates.

    Attributes
    ----------
    inputs : array (n, k)
    block_of : int, optional
        The number of poses of which these are a part: they have the digits that all have together.
    input_error : float or array (n, k)
        Bound of the inputs' own errors, for the estimates of rounding errors: 0 where they are exact as given.
    input_rest : float or array (n, k), or a function that gives them, optional
        What the inputs are exactly, less the floats: where they stand in degrees or in decimals.
    """

    def __init__(
        self,
        branch: Branch,
        angle: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        jerk: ArrayLike | None = None,
        block_of: int | None = None,
    ) -> None:
        self.block_of = block_of
        self._known_steps, self._plain, self._close = branch.known_steps, branch.plain, branch.close
        self.branch, self.plan, self.lock = branch, branch.plan, branch.lock
        self.mechanism = m = branch.mechanism
        k = len(m.inputs)
        if angle is None:
            given = [e.value for e in m.inputs]
            angle = [a if v is None else v for v, a in zip(given, m.at, strict=True)]
            angle = angle if k == 1 else [angle]
        q = real_array("angle", angle)
        if k == 1:
            q = q.reshape(-1, 1)
        elif q.ndim == 1 and q.shape == (k,):
            q = q.reshape(1, k)
        elif q.ndim != 2 or q.shape[1] != k:
            raise ValueError(f"angle: expected shape (n, {k}) for {k} inputs, found {q.shape}")
        self.inputs = q
        self.n = len(q)
        self.rates = [
            self._given(name, value, [getattr(e, name) for e in m.inputs])
            for name, value in (("speed", speed), ("acceleration", acceleration), ("jerk", jerk))
        ]
        self.input_error: ArrayLike = 0.0
        self.input_rest: ArrayLike | Callable[[], Reals] | None = None
        # (n,) s, where the poses are those of a motion in time
        self.time: Reals | None = None
        self._solved: list[tuple[Step, int]] = []
        self._done: set[tuple[int, int, int]] = set()
        self._blocks: list[State] | None = None
        self._along: dict[int, list[Rates]] = {}

    def _given(self, name: str, value: ArrayLike | None, own: list[float | None]) -> list[Number]:
        """One rate of the inputs, a scalar or (n,) array for each input."""
        k = len(own)
        if value is None:
            return [v or 0.0 for v in own]
        v = real_array(name, value)
        if v.ndim == 0:
            return [float(v)] * k
        check_rate(name, v, self.n, k)
        if k == 1:
            v = v.reshape(-1)
            return [float(v[0])] if len(v) == 1 else [v]
        v = np.broadcast_to(v, (self.n, k)) if v.ndim == 1 else v
        return [v[:, j] for j in range(k)]

    def again(self, inputs: Reals, rates: list[list[Number]] | None = None) -> Self:
        """The same assembly at other inputs (n, k), at rest or with other rates of them."""
        other = type(self)(self.branch, inputs if inputs.shape[1] > 1 else inputs[:, 0], 0.0, 0.0, 0.0)
        if rates is not None:
            other.rates = rates
        return other

    def some(self, which: NDArray[np.bool_]) -> Self:
        """Some of these poses, `which` of them (n,), with their rates."""

        def of(rate: Number) -> Number:
            return rate[which] if np.ndim(rate) else rate

        return self.again(self.inputs[which], [[of(rate) for rate in rates] for rates in self.rates])

    @cached_property
    def assembled(self) -> NDArray[np.bool_]:
        """(n,) bool: which poses can be assembled."""
        self.solve([key for g in self.plan.groups for key in self.plan.writes(g)], 0)
        whole = np.ones(self.n, dtype=bool)
        for rows, st in self.rows():
            for g in self.plan.groups:
                for value in (*(st.turn[body] for body in g.angles), *(st.slide[s] for s in g.slides)):
                    # the sum of squares is finite where all of them are; else each is looked at
                    if not np.isfinite(np.vdot(value, value)):
                        whole[rows] &= np.isfinite(value)
        return np.asarray(whole & np.isfinite(self.inputs).all(axis=1))

    @property
    def condition(self) -> Reals:
        """(n,): ‖J⁻¹‖∞ of the constraint Jacobian of all loops, lengths divided by the mechanism's size.

        A relative error ε in the lengths or the input moves the pose by some ε·condition.
        """
        _, group = self.branch.merged
        if group is None:
            return np.where(self.assembled, 1.0, np.nan)
        self.solve([key for s in self.plan.steps for key in self.plan.writes(s)], 0)
        size = self.mechanism.size
        whole = np.empty(self.n)
        for rows, st in self.rows():
            whole[rows] = condition(columns(group, st), len(group.angles), size, rows.stop - rows.start)
            if st.folded:
                whole[rows][np.isfinite(whole[rows])] = np.inf
        return whole

    # --- solving ----------------------------------------------------------------------------------------------
    @property
    def solved(self) -> list[tuple[Step, int]]:
        """What has been worked out so far, (step, order); order 0 is position."""
        return self._solved

    def states(self) -> list[State]:
        """The blocks of poses."""
        if self._blocks is None:
            k = self.inputs.shape[1]
            if k == 1 and self.n:
                q = self.inputs[:, 0]
                self.branch.cover(float(q.min()), float(q.max()))
            if not self.many:
                self._blocks = [State([float(v) for v in self.inputs[0]])]
            else:
                self._blocks = [
                    State([self.inputs[i : i + BLOCK, j] for j in range(k)], many=True)
                    for i in range(0, self.n, BLOCK)
                ]
        return self._blocks

    @property
    def many(self) -> bool:
        """Whether these are many poses, or a part of many."""
        return self.n != 1 or self.block_of is not None

    def rows(self) -> Iterator[tuple[slice, State]]:
        """The blocks, each with the poses that are in it."""
        for i, st in enumerate(self.states()):
            yield slice(i * BLOCK, min((i + 1) * BLOCK, self.n)), st

    def solve(
        self,
        targets: Iterable[str],
        order: int,
        which: int = -1,
        then: Callable[[int], None] | None = None,
    ) -> list[Rates]:
        """Work out the targets' derivatives up to an order; `which`: along the motion (−1), or for input j alone.

        `then` is called with each block's number while the block is still in cache, and what it forms is forgotten.
        """
        wanted = tuple(targets)
        steps = self._known_steps.get(wanted)
        if steps is None:
            steps = self._known_steps[wanted] = self.plan.needed(wanted)
        missing: list[tuple[int, list[Step]]] = []
        for k in range(order + 1):
            key = which if k else -2
            new = [s for s in steps if (id(s), k, key) not in self._done]
            if new:
                missing.append((k, new))
                self._done.update((id(s), k, key) for s in new)
                self._solved += [(s, k) for s in new]
        if not missing and then is None:
            return self._along.get(which, [])
        states = self.states()
        if order and which not in self._along:
            self._along[which] = [self._rates_of(st, i, which) for i, st in enumerate(states)]
        many = len(states) > 1
        with np.errstate(all="ignore"):
            for i, st in enumerate(states):
                try:
                    self._advance(i, which, missing)
                except (ZeroDivisionError, OverflowError):
                    # one pose on Python numbers at a singular place: the same again on arrays
                    states[i] = State([np.array([q]) for q in st.inputs], many=True)
                    for w in self._along:
                        self._along[w] = [self._rates_of(s, b, w) for b, s in enumerate(states)]
                    for step, k in self._solved:
                        for w in list(self._along) if k else [-2]:
                            if (id(step), k, w) in self._done:
                                self._advance(i, w, [(k, [step])])
                if then is not None:
                    then(i)
                if many and order:
                    self._along[which][i].slim()
        return self._along.get(which, [])

    @property
    def along_input(self) -> list[Rates]:
        """The derivatives over the one input, block by block, as far as they are solved."""
        return self._along[-1]

    def _advance(self, i: int, which: int, missing: list[tuple[int, list[Step]]]) -> None:
        for k, steps in missing:
            if k == 0:
                run(steps, self.states()[i], self._close, self._plain)
            else:
                self._along[which][i].advance(steps, k)

    def _rates_of(self, st: State, block: int, which: int) -> Rates:
        k = self.inputs.shape[1]
        if k == 1:
            return Rates(self.plan, st, [[1.0]], self.branch.passage)
        if which >= 0:
            return Rates(self.plan, st, [[1.0] if j == which else [] for j in range(k)])
        rows = slice(block * BLOCK, (block + 1) * BLOCK)
        return Rates(self.plan, st, [[part(rate[j], rows, st.many) for rate in self.rates] for j in range(k)])

    # --- over all poses -----------------------------------------------------------------------------------------
    def join(self, parts: list[Number], kind: type) -> Any:
        """The blocks' values as one array (n,)."""
        if len(parts) == 1:
            value: Any = np.asarray(parts[0], dtype=kind)
            return value.copy() if value.shape == (self.n,) else np.full(self.n, value)
        sizes = (np.shape(st.inputs[0]) for st in self.states())
        return np.concatenate(
            [np.broadcast_to(np.asarray(p, dtype=kind), size) for p, size in zip(parts, sizes, strict=True)]
        )

    def over(self, form: Callable[[int, State], Number], kind: type = float) -> Any:
        """What a form gives of each block, as one array (n,); None is zero."""
        values = (form(i, st) for i, st in enumerate(self.states()))
        return self.join([0.0 if v is None else v for v in values], kind)

    def in_time(self, order: int, get: Callable[[int, int], Number], kind: type = float) -> Any:
        """Chain rule from derivatives with respect to the one input to derivatives in time."""
        if self.inputs.shape[1] > 1:
            return self.over(lambda i, st: get(i, order), kind)
        rates = [rate[0] for rate in self.rates]

        def form(i: int, st: State) -> Number:
            rows = slice(i * BLOCK, (i + 1) * BLOCK)
            return chain_rule(order, partial(get, i), [part(x, rows, st.many) for x in rates])

        return self.over(form, kind)

    # --- quantities -------------------------------------------------------------------------------------------
    def rate(self, j: int, order: int) -> Reals:
        """The order-th derivative of input j in time, (n,)."""
        return np.broadcast_to(np.asarray(self.rates[order - 1][j], dtype=float), (self.n,))

    def values(self, quantities: Sequence[Quantity]) -> list[Any]:
        """Quantities, (n,) each."""
        return self.by_blocks(quantities)

    def taped(self, quantities: Sequence[Quantity]) -> list[Any] | None:
        """Quantities from the tape; None where there is none."""
        return None

    def by_blocks(self, quantities: Sequence[Quantity]) -> list[Any]:
        """Quantities of motion by the formulas over blocks, (n,) each; what they depend on is solved in one pass."""
        wanted: dict[tuple[int, int], dict[str, None]] = {}
        kinematic = []
        for quantity in quantities:
            if not isinstance(quantity, Kinematic):
                raise KeyError(quantity)
            which = quantity.input if isinstance(quantity, Partial) and self.inputs.shape[1] > 1 else -1
            kinematic.append((quantity, (quantity.order, which)))
            wanted.setdefault((quantity.order, which), {}).update(dict.fromkeys(quantity.targets(self)))
        rates = {of: self.solve(targets, *of) for of, targets in wanted.items()}
        return [self._formed(quantity, rates[of]) for quantity, of in kinematic]

    def _formed(self, of: Kinematic, rates: list[Rates]) -> Any:
        number = complex if of.is_vector else float
        if of.order == 0:
            return self.over(lambda _, st: of.place(self, st), number)
        if not rates:
            # nothing moves it
            return np.zeros(self.n, number)
        if isinstance(of, Partial):
            return self.over(lambda i, _: of.rate(self, rates[i], of.order), number)
        return self.in_time(of.order, lambda i, k: of.rate(self, rates[i], k), number)

    def angle(self, body: str, order: int = 0) -> Reals:
        """A link's angle, (n,) rad, or its ω, α or angular jerk."""
        return self.values((Angle(body, order),))[0]  # type: ignore[no-any-return]

    def point(self, body: str, z: complex, order: int = 0, node: str | None = None) -> Complexes:
        """Position (order 0) or a time derivative of any point of a body, x + iy, (n,)."""
        return self.values((Point(body, z, node, order),))[0]  # type: ignore[no-any-return]

    def columns(self, group: Group) -> list[list[Complexes]]:
        """The Jacobian of one Assur group: for each of its loops, the column of each of its unknowns, (n,) complex."""
        rates = self.solve([*self.plan.writes(group), *self.plan.reads(group)], 1)
        blocks = [r.columns(group) for r in rates]
        return [
            [self.join([b[i][j] for b in blocks], complex) for j in range(len(blocks[0][i]))]
            for i in range(len(group.closures))
        ]


def part(rate: Number, rows: slice, many: bool) -> Number:
    """A rate of an input, a number or (n,), over a block of poses; None where it is zero throughout."""
    if isinstance(rate, float):
        return rate or None
    return rate[rows] if many else float(rate[0])
