"""The loops of a group over its unknowns, on tapes: how far they are from closing, their Jacobian, one step of a search.

A tape holds the topology alone. What the group depends on enters it, and so does every constant: groups of mechanisms that
differ in their dimensions have one tape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from itertools import repeat
from typing import Any

import numpy as np

from dalembert.arithmetic.engines import floats, lanes_in_all, run
from dalembert.arithmetic.guard import Lock, guarded, own_lock
from dalembert.arithmetic.recorded import RECORDED, Recorder, bare, squared
from dalembert.arithmetic.tape import Tape
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.numbers import EPS, PARTS, WRITTEN, Number, Reals, solve
from virtualwork.formulas.positions import State, columns, loop, turn
from virtualwork.plan.steps import Group, Term, Turn

# of a state: what is complex
VECTORS = "turn", "point"
# of the size of a mechanism, or of a slide beyond it: the rounding of a loop
ROUNDED = 64 * EPS
# rad, or the same share of that size: a step this short is the last one
LAST = 1e-7
# how often a step is halved, less one
HALVED = 12
# a number above this is none
LARGEST = 1e300
# unknowns up to which the linear system of a step is on the tape
WHOLE = 8
# poses up to which a search is faster on floats, one by one
FEW = 64


def write_unknowns(group: Group, st: State, x: Reals) -> None:
    """Put an array (n, unknowns) of a group's unknowns into the state."""
    put_unknowns(group, st, [x[:, j] if st.many else float(x[0, j]) for j in range(x.shape[1])])


def unknowns(group: Group, st: State) -> list[Number]:
    """A group's unknowns in a state: angles, and then slides."""
    # a closed form leaves the rotation alone
    angles = [st.angle[b] if b in st.angle else st.kind.angle(st.turn[b]) for b in group.angles]
    return angles + [st.slide[s] for s in group.slides]


def put_unknowns(group: Group, st: State, x: Sequence[Number]) -> None:
    """Put a group's unknowns, angles and then slides, into the state, with the bodies tied to them."""
    for body, angle in zip(group.angles, x, strict=False):
        st.angle[body] = angle
        st.turn[body] = st.kind.exp(angle)
    for g, slide in zip(group.slides, x[len(group.angles) :], strict=True):
        st.slide[g] = slide
    for tie in group.ties:
        turn(tie, st)


def gaps(group: Group, st: State) -> list[Number]:
    """How far each loop is from closing."""
    return [loop(closure, st) for closure in group.closures]


def bent(group: Group, st: State, v: Sequence[Number]) -> list[list[Number]]:
    """The derivative of J·v along each unknown, complex: loops × unknowns, for a direction v of the unknowns."""
    rows = []
    for closure in group.closures:
        row: list[Number] = [0.0] * len(v)
        for t in closure.terms:
            turns = group.shares.get(t.body, {})
            slides = group.shares.get(t.slide, {}) if t.slide is not None else {}
            turned = sum((f * v[j] for j, f in turns.items()), 0.0)
            moved = sum((f * v[j] for j, f in slides.items()), 0.0)
            length = 1.0 if t.slide is None else st.slide[t.slide]
            e = t.z * st.turn[t.body]
            for j, f in turns.items():
                row[j] = row[j] + f * (1j * moved - turned * length) * e
            for j, f in slides.items():
                row[j] = row[j] + f * 1j * turned * e
        rows.append(row)
    return rows


@guarded
class Topology:
    """A group whose constants enter: what its tapes are written from, once for all groups of its kind."""

    def __init__(self, group: Group) -> None:
        self.recorder = Recorder()
        self.constants: list[str] = []
        self.group = _with_constants(group, self._constant)
        tied = [tie.angle for tie in group.ties]
        self.inputs = sorted({j for angle in tied for j, _ in angle.inputs})
        self.reads = list(_reads(group))
        self.enters = [f"q {j}" for j in self.inputs]
        for store, key in self.reads:
            name = f"{store} {key}"
            self.enters += [f"{name} x", f"{name} y"] if store in VECTORS else [name]
        count = len(group.angles) + len(group.slides)
        self.unknowns, self.directions = [f"x {j}" for j in range(count)], [f"d {j}" for j in range(count)]
        self.solved = ["after", *(f"step {j}" for j in range(count))]

    @property
    def lock(self) -> Lock:
        """Of the recorder."""
        return own_lock(self)

    def _constant(self, _: float) -> Number:
        self.constants.append(f"constant {len(self.constants)}")
        return self.recorder.input(self.constants[-1])

    def state(self, x: Sequence[Number]) -> State:
        """What the group depends on, recorded, with some unknowns put into it."""
        enter = self.recorder.input
        st = State([enter(f"q {j}") for j in range(max(self.inputs, default=-1) + 1)], kind=WRITTEN)
        for store, key in self.reads:
            name = f"{store} {key}"
            vector = store in VECTORS
            getattr(st, store)[key] = (
                WRITTEN.join(enter(f"{name} x"), enter(f"{name} y")) if vector else enter(name)
            )
        put_unknowns(self.group, st, x)
        return st

    def entered(self, names: Sequence[str]) -> list[Number]:
        """Recorded inputs by their names."""
        return [self.recorder.input(name) for name in names]

    @cached_property
    def linear(self) -> tuple[Tape, list[int]]:
        """The tape of the gaps and of those entries of the Jacobian that are not nothing, and the places of these."""
        st = self.state(self.entered(self.unknowns))
        entries = _parts(columns(self.group, st))
        places = [
            place for place, value in enumerate(entries) if not (isinstance(value, float) and value == 0)
        ]
        outputs = [*_parts([[gap] for gap in gaps(self.group, st)]), *(entries[place] for place in places)]
        return self.recorder.tape({str(row): value for row, value in enumerate(outputs)}), places

    @cached_property
    def bent(self) -> Tape:
        """The tape of `bent`, row by row."""
        st = self.state(self.entered(self.unknowns))
        entries = _parts(bent(self.group, st, self.entered(self.directions)))
        return self.recorder.tape({str(row): value for row, value in enumerate(entries)})

    @cached_property
    def whole(self) -> bool:
        """Whether the linear system of a step is on the tape of the search: it grows with the cube of the unknowns."""
        return len(self.unknowns) <= WHOLE

    @cached_property
    def search(self) -> Tape:
        """The tape of one round of a damped Newton search: from a state of the search, `SEARCH`, to the next.

        A step x_{k+1} = x_k − factor·Φ⁻¹·f(x_k) that would not reduce the gap is halved. No angle turns by more than a
        radian in a step. `left` counts the steps that may follow; at zero the search is over. Of many unknowns the gap and
        the next step enter.
        """
        select = RECORDED.select
        x, d = self.entered(self.unknowns), self.entered(self.directions)
        gap, longest, factor, tries, left, size = self.entered((*SEARCH, "size"))
        to = [a + factor * b for a, b in zip(x, d, strict=True)]
        if self.whole:
            st = self.state(to)
            f = gaps(self.group, st)
            after, dx = RECORDED.sqrt(sum(map(squared, f), 0.0)), WRITTEN.solve(columns(self.group, st), f)
        else:
            after, *dx = self.entered(self.solved)
        angles = len(self.group.angles)

        def reach(x: Sequence[Number]) -> Number:
            """What a loop's rounding is relative to: the mechanism's size, or a slide that runs beyond it."""
            return _largest(map(abs, x[angles:]), size)

        far = reach(to)
        # what is no number is not less than another
        less = select(gap * (1 + 1e-12) - after, 1.0, 0.0)
        worse = select(gap - ROUNDED * reach(x), 1.0 - less, 0.0)
        again = select(tries - 1.5, worse, 0.0)
        ends = select(ROUNDED * far - after, select(longest - LAST, 0.0, 1.0), 0.0)
        goes_on = select(LARGEST - after, select(LARGEST - sum(map(abs, dx), 0.0), 1.0, 0.0), 0.0)
        step = _largest((abs(b if j < angles else b / far) for j, b in enumerate(dx)), 0.0)
        scale = 1.0 / select(step - 1.0, step, 1.0)
        # of dependent constraints rounding leaves a gap that no step makes less: it is closed, and stays as it is;
        # and a pose that no part of the step brings nearer to closing, or that is singular, will not close
        following = select(worse + ends, 0.0, select(goes_on, left - 1.0, 0.0))
        accepted = (*to, *(b * scale for b in dx), after, step, 1.0, float(HALVED), following)
        rejected = (*x, *d, gap, longest, 0.5 * factor, tries - 1.0, left)
        pairs = zip((*self.unknowns, *self.directions, *SEARCH), rejected, accepted, strict=True)
        return self.recorder.tape({name: select(again, old, new) for name, old, new in pairs})


# of a search, in addition to the unknowns and the step to be taken: the gap and the longest entry of the undamped step that led
# there, the share of the step that is tried, the times that it may be, and the steps that may follow
SEARCH = "gap", "longest", "factor", "tries", "left"


def _largest(values: Any, largest: Number) -> Number:
    for value in values:
        largest = RECORDED.select(value - largest, value, largest)
    return largest


def _parts(entries: Sequence[Sequence[Number]]) -> list[Number]:
    """Complex entries, loops × columns, as real ones, row by row."""
    return [part(entry) for row in entries for part in PARTS for entry in row]


def _reads(group: Group) -> list[tuple[str, Any]]:
    """What a group reads of a state: where it is kept, and its key."""
    terms = [term for closure in group.closures for term in closure.terms]
    tied = [tie.angle for tie in group.ties]
    bases = {base for angle in tied for base, _ in angle.bases}
    bodies = {t.body for t in terms} | {b for b in bases if isinstance(b, str)}
    bodies |= {body for angle in tied for of, _ in angle.cams for body in (of.cam, of.on)}
    # a ratio that is no whole number, and a slide, need the angle itself
    angles = {
        b for tie in group.ties for b, r in tie.angle.turning if tie.slides or not float(r).is_integer()
    }
    slides = {t.slide for t in terms if t.slide is not None} | {b for b in bases if isinstance(b, int)}
    points = {p for closure in group.closures for p in (closure.start, closure.end) if p is not None}
    own = {*group.members, GROUND}
    return [
        *(("turn", body) for body in sorted(bodies - own)),
        *(("angle", body) for body in sorted(angles - own)),
        *(("slide", guide) for guide in sorted(slides - {*group.slides, *group.tied_slides})),
        *(("point", node) for node in sorted(points)),
    ]


_topology = lru_cache(maxsize=64)(Topology)


def _with_constants(group: Group, number: Callable[[Number], Number]) -> Group:
    """A group with other numbers in place of its constants; zeros stay, and cost nothing."""

    def term(t: Term) -> Term:
        return replace(t, z=WRITTEN.join(*(number(part) if part else 0.0 for part in (t.z.real, t.z.imag))))

    def tie(t: Turn) -> Turn:
        return replace(t, angle=replace(t.angle, const=number(t.angle.const))) if t.angle.const else t

    closures = tuple(replace(of, terms=tuple(map(term, of.terms))) for of in group.closures)
    return replace(group, closures=closures, ties=tuple(map(tie, group.ties)))


class Loops:
    """The loops of a group over its unknowns, in the poses of a state.

    Examples
    --------
    The gaps of a four-bar whose crank AB stands at a right angle, with the coupler along x and the rocker upright:

    >>> from virtualwork import Guess, Input, Link, Mechanism
    >>> m = Mechanism({"A": 0j, "D": 3}, {"crank": Link({"A": 0j, "B": 1}), "coupler": Link({"B": 0j, "C": 3}),
    ...     "rocker": Link({"D": 0j, "C": 2})}, inputs=Input("crank"), guess=Guess(0.0, {"coupler": 0.7, "rocker": 1.7}))
    >>> loops = Loops(m.assembly.plan.groups[0])
    >>> f, jacobian = loops.over(m.assembly.state((np.pi / 2,)))(np.array([[0.0, np.pi / 2]]))
    >>> f.round(12) + 0.0, jacobian.round(12) + 0.0
    (array([[ 0., -1.]]), array([[[0., 2.],
            [3., 0.]]]))
    """

    few = FEW

    def __init__(self, group: Group) -> None:
        self.group = group
        self._constants: list[Number] = []

        def one(value: Number) -> float:
            self._constants.append(value)
            return 1.0

        self._of = _topology(_with_constants(group, one))

    @property
    def tape(self) -> Tape:
        """The tape of a step of `search`, which groups of the same topology share."""
        return self._of.search

    def over(self, st: State) -> Callable[[Reals], tuple[Reals, Reals]]:
        """Gaps (n, 2·loops) and Jacobian (n, 2·loops, unknowns) as a function of the unknowns x, (n, unknowns).

        A state of one pose goes with any number of unknowns, one of n poses with as many.
        """
        return partial(self._linear, self.fixed(st))

    def bent(self, st: State, x: Reals, v: Reals) -> Reals:
        """The derivative of J·v along each unknown, (n, 2·loops, unknowns), for directions v (n, unknowns)."""
        names = [*self._of.unknowns, *self._of.directions]
        table = self._run(self._of.bent, self.fixed(st), names, np.concatenate([x, v], axis=1).T)
        return np.broadcast_to(table.T, (len(x), len(table))).reshape(len(x), -1, v.shape[1])

    def search(self, st: State, start: Reals, size: Number, limit: int) -> tuple[Reals, Reals]:
        """Where a damped Newton search of so many steps ends, (n, unknowns), and the gap that it leaves, (n,) m."""
        of, fixed, (n, count) = self._of, [*self.fixed(st), size], start.shape
        order = (*of.constants, *of.enters, "size", *of.unknowns, *of.directions, *SEARCH)
        order = order if of.whole else (*order, *of.solved)
        state = np.zeros((2 * count + len(SEARCH), n))
        state[:count] = start.T
        state[2 * count :].T[:] = np.inf, np.inf, 1.0, 1.0, limit + 1.0
        # the digits of a pose depend on how many there are in all, and of one pose on nothing
        one, few = _one_pose(fixed), lanes_in_all(n) <= self.few
        on_floats, going = floats.takes(of.search), np.arange(n)
        while going.size:
            here = [value[going] if isinstance(value, np.ndarray) else value for value in fixed]
            rows = state[:, going]
            if on_floats and (few or (one and going.size <= FEW)):
                step = floats.compiled(of.search, among=order)
                lanes = (v.tolist() if isinstance(v, np.ndarray) else repeat(v, going.size) for v in here)
                pairs = zip(zip(*lanes, strict=True), rows.T.tolist(), strict=True)
                result = np.array([self._alone(step, own, values) for own, values in pairs]).T
                # at a singular pose numpy goes on with infinity and NaN
                on_floats = False
            else:
                named = dict(zip(order, (*here, *rows, *self._solved(here, rows)), strict=True))
                result = np.asarray(run(of.search, named, "numpy").table)
            state[:, going] = result
            going = going[result[-1] > 0]
        return state[:count].T, state[2 * count]

    def _alone(
        self, step: Callable[..., Sequence[float]], fixed: Sequence[float], state: Sequence[float]
    ) -> Sequence[float]:
        """The state of a search in one pose after all its steps, or as far as Python's floats go."""
        try:
            while state[-1] > 0:
                state = step(*fixed, *state, *self._solved(fixed, state))
        except (ZeroDivisionError, ValueError, OverflowError):
            pass
        return state

    def _solved(self, fixed: Sequence[Number], state: Any) -> Sequence[Number]:
        """The gap after the step that a search is about to try, and the next step, where its tape has none."""
        if self._of.whole:
            return ()
        rows = np.asarray(state).reshape(len(state), -1)
        count = len(self._of.unknowns)
        x, d, factor = rows[:count], rows[count : 2 * count], rows[2 * count + SEARCH.index("factor")]
        f, jacobian = self._linear(list(fixed[:-1]), (x + factor * d).T)
        result = np.sqrt((f * f).sum(axis=1)), *solve(jacobian, -f).T
        return result if np.ndim(state) > 1 else [float(value[0]) for value in result]

    def stands(self, st: State) -> Any:
        """Whether all that the group depends on is assembled: bool, or array (n,) of bool.

        The gaps alone do not say it: what both ends of a loop share is not in them.
        """
        return np.isfinite(sum(self.fixed(st)))

    def entering(self, st: State) -> list[Number]:
        """The constants of the group and what it depends on in a state, recorded ones too."""
        values = [st.inputs[j] for j in self._of.inputs]
        for store, key in self._of.reads:
            value = getattr(st, store)[key]
            values += [value.real, value.imag] if store in VECTORS else [value]
        return [bare(value) for value in (*self._constants, *values)]

    def fixed(self, st: State) -> list[Number]:
        """The same of floats, or arrays (n,)."""
        return [v if isinstance(v, np.ndarray) else float(v) for v in self.entering(st)]

    def _linear(self, fixed: list[Number], x: Reals) -> tuple[Reals, Reals]:
        """See `over`."""
        tape, places = self._of.linear
        table, n, rows = self._run(tape, fixed, self._of.unknowns, x.T), len(x), 2 * len(self.group.closures)
        jacobian = np.zeros((n, rows * x.shape[1]))
        for place, entry in zip(places, table[rows:], strict=True):
            jacobian[:, place] = entry
        f = np.empty((n, rows))
        f.T[:] = table[:rows]
        return f, jacobian.reshape(n, rows, x.shape[1])

    def _run(self, tape: Tape, fixed: list[Number], names: Sequence[str], columns: Reals) -> Reals:
        """The outputs of a tape, (outputs, n), or (outputs, 1) where they are the same for all."""
        order = (*self._of.constants, *self._of.enters, *names)
        if columns.shape[1] == 1 and _one_pose(fixed) and floats.takes(tape):
            try:
                values = floats.compiled(tape, among=order)(*fixed, *columns[:, 0].tolist())
                return np.array(values)[:, None]
            except (ZeroDivisionError, ValueError, OverflowError):
                pass
        # on one engine: the digits of a pose depend on no other work
        table = np.asarray(run(tape, dict(zip(order, (*fixed, *columns), strict=True)), "numpy").table)
        return table if table.ndim > 1 else table[:, None]


def _one_pose(fixed: Sequence[Number]) -> bool:
    return not any(isinstance(value, np.ndarray) for value in fixed)
