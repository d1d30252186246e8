"""Poses: where an assembly stands at given inputs, and of one pose all derivatives, solved as far as requested, and never twice.

With one input, derivatives are taken once with respect to the input (the velocity coefficients K = dx/dq, L = d²x/dq²,
M = d³x/dq³), so that ẋ = K·q̇,  ẍ = K·q̈ + L·q̇²,  x⃛ = K·q⃛ + 3L·q̇·q̈ + M·q̇³.  With several inputs they are taken along
the inputs' rates. Derivatives of many poses come from the tape (`lanes`).
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property, partial
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.engines import as_part
from dalembert.arithmetic.guard import guarded, unlocked
from virtualwork.formulas.branch import Branch
from virtualwork.formulas.kinematics import Angle, Kinematic, Partial, Point
from virtualwork.formulas.numbers import Complexes, Number, Reals, condition, real_array
from virtualwork.formulas.positions import BLOCK, State, columns, run
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.rates import Rates, chain_rule
from virtualwork.plan.steps import Step


def as_inputs(angle: ArrayLike, k: int, once: bool = False) -> Reals:
    """Inputs as an array (n, k), from a number or an array (n,) where k is 1, from (k,) or (n, k); see `real_array`.

    >>> as_inputs([0.0, 0.5], 1).shape, as_inputs([0.0, 0.5], 2).shape
    ((2, 1), (1, 2))

    Raises
    ------
    ValueError
    """
    q = real_array("angle", angle, once)
    if k == 1 and q.ndim < 2:
        return q.reshape(-1, 1)
    if k > 1 and q.shape == (k,):
        return q.reshape(1, k)
    if q.ndim != 2 or q.shape[1] != k:
        expected = "a number or shape (n,) for one input" if k == 1 else f"shape (n, {k}) for {k} inputs"
        raise ValueError(f"angle: expected {expected}, found {q.shape}")
    return q


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
    once : bool
        Whether one request alone is made, at once: then no array is copied, or kept for later ones.
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
        once: bool = False,
    ) -> None:
        self.block_of, self.once = block_of, once
        self._plain, self._close = branch.plain, branch.close
        self.branch, self.plan, self.lock = branch, branch.plan, branch.lock
        self.mechanism = m = branch.mechanism
        k = len(m.inputs)
        if angle is None:
            own = [e.value for e in m.inputs]
            angle = [a if v is None else v for v, a in zip(own, m.at, strict=True)]
            angle = angle if k == 1 else [angle]
        self.inputs = q = as_inputs(angle, k, once)
        self.n = len(q)
        self.rates = [
            self._given(name, value, [getattr(e, name) for e in m.inputs])
            for name, value in (("speed", speed), ("acceleration", acceleration), ("jerk", jerk))
        ]
        self.input_error: ArrayLike = 0.0
        self.input_rest: ArrayLike | Callable[[], Reals] | None = None
        # (n,) s, where the poses are those of a motion in time
        self.time: Reals | None = None
        # (c, n), or a function that gives it: the friction of each contact where joints of such a motion stick, else NaN
        self.held: Reals | Callable[[], Reals] | None = None
        self._solved: list[tuple[Step, int]] = []
        # by order and input: which steps are carried on to it, by their identity
        self._done: defaultdict[tuple[int, int], set[int]] = defaultdict(set)
        self._blocks: list[State] | None = None
        self._along: dict[int, Rates] = {}
        self._begin()

    def _begin(self) -> None:
        """Set the state that a class below adds; each calls the one above it."""

    def _given(self, name: str, value: ArrayLike | None, own: list[float | None]) -> list[Number]:
        """One rate of the inputs, a scalar or (n,) array for each input."""
        k = len(own)
        if value is None:
            return [v or 0.0 for v in own]
        v = real_array(name, value, self.once)
        if v.ndim == 0:
            return [float(v)] * k
        check_rate(name, v, self.n, k)
        if k == 1:
            v = v.reshape(-1)
            return [float(v[0])] if len(v) == 1 else [v]
        v = np.broadcast_to(v, (self.n, k)) if v.ndim == 1 else v
        return [v[:, j] for j in range(k)]

    def again(self, inputs: Reals, rates: list[list[Number]] | None = None) -> Self:
        """The assembly at other inputs (n, k), at rest or with other rates of them."""
        other = type(self)(self.branch, inputs if inputs.shape[1] > 1 else inputs[:, 0], 0.0, 0.0, 0.0)
        if rates is not None:
            other.rates = rates
        return other

    def some(self, which: NDArray[np.bool_]) -> Self:
        """Some of these poses, `which` of them (n,), with their rates."""

        def of(rate: Number) -> Number:
            return rate[which] if np.ndim(rate) else rate

        some = self.again(self.inputs[which], [[of(rate) for rate in rates] for rates in self.rates])
        some.time = None if self.time is None else np.asarray(self.time)[which]
        if self.held is not None:
            some.held = self.holding[:, which]
        return some

    @cached_property
    def assembled(self) -> NDArray[np.bool_]:
        """(n,) bool: which poses can be assembled."""
        finite: NDArray[np.bool_] = np.asarray(np.isfinite(self.inputs).all(axis=1))
        # only the inputs show which loops open
        self.cover()
        if not self.branch.may_open:
            return finite
        self.solve([key for g in self.plan.groups for key in self.plan.writes(g)])
        for rows, st in self.rows():
            for g in self.plan.groups:
                for value in (*(st.turn[body] for body in g.angles), *(st.slide[s] for s in g.slides)):
                    # the sum of squares is finite where all of them are; else each is looked at
                    if not np.isfinite(np.vdot(value, value)):
                        finite[rows] &= np.isfinite(value)
        return finite

    @property
    def condition(self) -> Reals:
        """(n,): ‖J⁻¹‖∞ of the constraint Jacobian of all loops, lengths divided by the mechanism's size.

        A relative error ε in the lengths or the input moves the pose by some ε·condition.
        """
        _, group = self.branch.merged
        if group is None:
            return np.where(self.assembled, 1.0, np.nan)
        self.solve([key for s in self.plan.steps for key in self.plan.writes(s)])
        size = self.mechanism.size
        whole = np.empty(self.n)
        for rows, st in self.rows():
            whole[rows] = condition(columns(group, st), len(group.angles), size, rows.stop - rows.start)
            if st.folded:
                whole[rows][np.isfinite(whole[rows])] = np.inf
        return whole

    @property
    def moves(self) -> tuple[bool, ...]:
        """Whether the inputs have a speed, an acceleration, a jerk that is not zero everywhere."""
        moves = [any(np.any(rate) if np.ndim(rate) else rate for rate in rates) for rates in self.rates]
        # what friction holds at rest bears forces as what slides does
        moves[0] = moves[0] or self.held is not None
        return tuple(moves)

    @cached_property
    def holding(self) -> Reals:
        """The friction of each contact that is known beforehand, (c, n) or (c, 1); NaN where it is not."""
        if self.held is None:
            return np.full((1, 1), np.nan)
        return self.held() if callable(self.held) else self.held

    # --- solving ----------------------------------------------------------------------------------------------
    @property
    def solved(self) -> list[tuple[Step, int]]:
        """What has been worked out so far, (step, order); order 0 is position."""
        return self._solved

    def cover(self) -> None:
        """Look for change points and limits over the one input of all poses, of those that have one."""
        if self.inputs.shape[1] == 1 and self.n:
            self.branch.cover(
                float(np.fmin.reduce(self.inputs[:, 0])), float(np.fmax.reduce(self.inputs[:, 0]))
            )

    def states(self) -> list[State]:
        """The blocks of poses."""
        if self._blocks is None:
            k = self.inputs.shape[1]
            self.cover()
            if not self.many:
                # of infinity Python has no sine
                self._blocks = [State([v if math.isfinite(v) else math.nan for v in self.inputs[0].tolist()])]
            else:
                self._blocks = [
                    State([self.inputs[i : i + BLOCK, j] for j in range(k)]) for i in range(0, self.n, BLOCK)
                ]
        return self._blocks

    @property
    @unlocked
    def many(self) -> bool:
        """Whether these are many poses, or a part of many."""
        return self.n != 1 or self.block_of is not None

    def rows(self) -> Iterator[tuple[slice, State]]:
        """The blocks, each with the poses that are in it."""
        for i, st in enumerate(self.states()):
            yield slice(i * BLOCK, min((i + 1) * BLOCK, self.n)), st

    def _new(self, steps: Sequence[Step], k: int, which: int) -> list[Step]:
        """The steps that are not yet carried on to an order."""
        done = self._done[k, which]
        return [] if done.issuperset(map(id, steps)) else [step for step in steps if id(step) not in done]

    def _note(self, steps: Sequence[Step], k: int, which: int) -> None:
        self._done[k, which].update(map(id, steps))
        self._solved.extend((step, k) for step in steps)

    def solve(self, targets: Iterable[str]) -> None:
        """Work out the targets' positions."""
        new = self._new(self.branch.needed(targets), 0, -2)
        if not new:
            return
        # a part of a sweep has the digits of the whole
        if self.block_of:
            as_part(self.block_of, self._place, new)
        else:
            self._place(new)
        self._note(new, 0, -2)

    def _place(self, new: list[Step]) -> None:
        """Do the steps that are new."""
        states = self.states()
        with np.errstate(all="ignore"):
            for i, st in enumerate(states):
                try:
                    run(new, st, self._close, self._plain)
                except (ZeroDivisionError, OverflowError):
                    # one pose on Python numbers at a singular place: the same again on arrays
                    states[i] = State([np.array([q]) for q in st.inputs])
                    done = (step for step, k in self._solved if not k)
                    run([*done, *new], states[i], self._close, self._plain)

    def advance(self, targets: Iterable[str], order: int, which: int = -1) -> None:
        """Work out the derivatives of one pose: along the motion (−1), or over input `which` alone.

        Raises
        ------
        ZeroDivisionError
            At a singular pose, whose derivatives come from the tape.
        """
        steps = self.branch.needed(targets)
        self.solve(targets)
        if self.states()[0].many:
            raise ZeroDivisionError
        with np.errstate(all="ignore"):
            for k in range(1, order + 1):
                new = self._new(steps, k, which)
                if new:
                    self.along(which).advance(new, k)
                    self._note(new, k, which)

    def along(self, which: int = -1) -> Rates:
        """The derivatives of one pose along the motion, or over one input, as far as they are worked out."""
        if which not in self._along:
            (st,), k = self.states(), self.inputs.shape[1]
            if k == 1:
                rates = Rates(self.plan, st, [[1.0]], self.branch.passage)
            elif which >= 0:
                rates = Rates(self.plan, st, [[1.0] if j == which else [] for j in range(k)])
            else:
                rates = Rates(self.plan, st, [[alone(rate[j]) for rate in self.rates] for j in range(k)])
            self._along[which] = rates
        return self._along[which]

    # --- over all poses -----------------------------------------------------------------------------------------
    def join(self, parts: list[Number], kind: type) -> Any:
        """The blocks' values as one array (n,)."""
        if len(parts) == 1:
            value: Any = np.asarray(parts[0], dtype=kind)
            return value.copy() if value.shape == (self.n,) else np.full(self.n, value)
        if not parts:
            return np.empty(0, dtype=kind)
        sizes = (np.shape(st.inputs[0]) for st in self.states())
        return np.concatenate(
            [np.broadcast_to(np.asarray(p, dtype=kind), size) for p, size in zip(parts, sizes, strict=True)]
        )

    def over(self, form: Callable[[State], Number], kind: type = float) -> Any:
        """What a form gives of each block, as one array (n,)."""
        return self.join([form(st) for st in self.states()], kind)

    # --- quantities -------------------------------------------------------------------------------------------
    def rate(self, j: int, order: int) -> Reals:
        """The order-th derivative of input j in time, (n,)."""
        return np.broadcast_to(np.asarray(self.rates[order - 1][j], dtype=float), (self.n,))

    def values(self, quantities: Sequence[Quantity]) -> list[Any]:
        """Quantities (n,) each."""
        raise NotImplementedError

    def taped(self, quantities: Sequence[Quantity]) -> list[Any]:
        """Quantities from the tape, of one pose too."""
        raise NotImplementedError

    def by_floats(self, quantities: Sequence[Quantity]) -> list[Any]:
        """Quantities of the motion of one pose, by the formulas as they stand, (1,) each."""
        result: list[Any] = []
        for of in quantities:
            if not isinstance(of, Kinematic):
                raise KeyError(of)
            targets = tuple(of.targets(self))
            self.solve(targets)
            value = self._derivative(of, targets) if of.order else of.place(self, self.states()[0])
            result.append(
                np.array(0.0 if value is None else value, complex if of.is_vector else float).reshape(1)
            )
        return result

    def _derivative(self, of: Kinematic, targets: tuple[str, ...]) -> Number:
        several = self.inputs.shape[1] > 1
        which = of.input if isinstance(of, Partial) and several else -1
        self.advance(targets, of.order, which)
        rates = self.along(which)
        if several or isinstance(of, Partial):
            return of.rate(self, rates, of.order)
        return chain_rule(of.order, partial(of.rate, self, rates), [alone(rate[0]) for rate in self.rates])

    def angle(self, body: str, order: int = 0) -> Reals:
        """A link's angle, (n,) rad, or its ω, α or angular jerk."""
        return self.values((Angle(body, order),))[0]  # type: ignore[no-any-return]

    def point(self, body: str, z: complex, order: int = 0, node: str | None = None) -> Complexes:
        """Position (order 0) or a time derivative of any point of a body, x + iy, (n,)."""
        return self.values((Point(body, z, node, order),))[0]  # type: ignore[no-any-return]


def alone(rate: Number) -> Number:
    """A rate of an input of one pose, a number or (1,); None where it is zero."""
    return (rate if isinstance(rate, float) else float(rate[0])) or None
