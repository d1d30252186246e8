"""The quantities of poses in numbers of 32 digits: the tape with every number of the description as an input.

What was decided in the first run, which assembly, which whole turn and which way a joint slips, enters. The unknowns of
groups without a closed form go on with Newton's method from those of the first run, and so does the friction of joints
until it fits the forces that these bear.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.engines.doubled import TURN, Answer, compared, run
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.guard import guarded
from virtualwork.describe.dimensions import dimensions
from virtualwork.digits.exact import Balance, Exact, Gap, Unknown
from virtualwork.formulas.forces import Rub
from virtualwork.formulas.kinematics import Angle
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.loads import Tabled
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.recording import NAMES
from virtualwork.formulas.statics import NULL
from virtualwork.formulas.tapes import taped
from virtualwork.plan.steps import Group

# steps of Newton's method in 32 digits at most, and a step, of 1 rad or the size, that is the last
STEPS, SMALL = 8, 2.0**-60
# the last change of any friction, relative; by what share it is moved to see what depends on it
SETTLED, NUDGE = 2.0**-72, 2.0**-40

Results = dict[Quantity, list[Doubled]]
NONE: Mapping[str, Doubled] = MappingProxyType({})


@guarded
class SecondRun:
    """The quantities of poses in numbers of 32 digits.

    Attributes
    ----------
    rest : array (n, k)
        What the inputs are exactly, less the floats.
    """

    def __init__(self, poses: Lanes, rest: Reals | None = None) -> None:
        self.poses, self.n, self.lock = poses, poses.n, poses.lock
        self.branch = poses.branch
        self.rest = self._rest() if rest is None else rest
        self._solutions: dict[str, Doubled] = {}

    def _rest(self) -> Reals:
        own = self.poses.input_rest
        if own is not None:
            rest = own() if callable(own) else np.asarray(own, dtype=float)
            return np.broadcast_to(rest, self.poses.inputs.shape)
        rest = np.zeros(self.poses.inputs.shape)
        if self.n == 1:
            rest[0] = [self._decimals(j, "value", x) for j, x in enumerate(self.poses.inputs[0].tolist())]
        return rest

    def _decimals(self, j: int, name: str, x: float) -> float:
        """What an input's own number of the file is exactly, less the float; 0 for any other."""
        m = self.poses.mechanism
        if m.decimals is None or getattr(m.inputs[j], name) != x:
            return 0.0
        where = "inputs", j, name
        kind = next((d.kind for d in dimensions(m).values() if d.where == where), "")
        return m.decimals.rest(kind, x)

    @cached_property
    def exact(self) -> Exact:
        """The formulas of the branch, with its numbers as inputs."""
        branch, plain = self.branch, self.poses.recording
        key = "exact", plain.moves, plain.turning_over
        if key not in branch.recordings:
            branch.recordings[key] = Exact(branch, plain)
        made: Exact = branch.recordings[key]
        return made

    def some(self, which: NDArray[np.bool_]) -> SecondRun:
        """Some of the poses."""
        return SecondRun(self.poses.some(which), self.rest[which])

    def sign(self, group: str) -> Doubled:
        """The sign of a closed form."""
        return Doubled(
            np.broadcast_to(np.asarray(self.branch.sign(group, self.poses.inputs[:, 0]), dtype=float), self.n)
        )

    def again(self, rows: NDArray[np.intp], nodes: Reals) -> SecondRun:
        """Some of the poses, each at several inputs (rows, nodes), with its own rates."""
        each = np.repeat(rows, nodes.shape[1])
        rates = [[rate[each] if np.ndim(rate) else rate for rate in of] for of in self.poses.rates]
        some = self.poses.again(nodes.reshape(-1, 1), rates)
        some.time = None if self.poses.time is None else np.asarray(self.poses.time)[each]
        return SecondRun(some, np.zeros((len(each), 1)))

    def doubled(self, keys: Sequence[Quantity], changed: Mapping[str, Doubled] | None = None) -> Results:
        """The quantities, real or as two parts, each Doubled of (n,) or of a number.

        `changed` inputs enter in place of their own numbers.
        """
        tape = taped(self.branch, self.exact, tuple(keys))
        changed = dict(changed or {})
        results = run(tape, self.entering(tape.inputs, changed))
        zero = Doubled(0.0)
        return {key: [results.get(name, zero) for name in key.names] for key in keys}

    def compared(
        self,
        values: Mapping[Quantity, Any],
        others: Sequence[Quantity] = (),
        changed: Mapping[str, Doubled] | None = None,
    ) -> tuple[dict[Quantity, Reals], Results]:
        """Estimates (n,) of the errors of quantities as they were handed out, (n,) each; and other quantities as `doubled`."""
        tape = taped(self.branch, self.exact, (*values, *others))
        changed = dict(changed or {})
        entering = self.entering(tape.inputs, changed)
        answers = {Answer(key.names, key.is_angle): parts(key, value) for key, value in values.items()}
        estimates, results = compared(tape, entering, answers)
        zero = Doubled(0.0)
        return (
            {
                key: of if np.shape(of) == (self.n,) else np.full(self.n, of)
                for key, of in zip(values, estimates, strict=True)
            },
            {key: [results.get(name, zero) for name in key.names] for key in others},
        )

    def uncertain(self, key: Quantity) -> list[Reals]:
        """By how much a quantity moves with each number that is not known exactly."""
        moved: list[Reals] = []
        if not self._uncertain:
            return moved
        of = taped(self.branch, self.exact, (key,)).inputs
        enter = [name for name in self._uncertain if name in of]
        here = self.doubled([key])[key] if enter else []
        for name in enter:
            moved.append(apart(key, self.doubled([key], {name: self._uncertain[name]})[key], here))
        return moved

    @cached_property
    def _uncertain(self) -> dict[str, Doubled]:
        """The inputs of tapes that are not known exactly, moved by as much as they may be off."""
        moved: dict[str, Doubled] = {}
        error = np.broadcast_to(np.asarray(self.poses.input_error, dtype=float), self.poses.inputs.shape)
        for j in range(error.shape[1]):
            if error[:, j].any():
                moved[f"q{j}"] = self._input(j) + error[:, j]
        for name, phase in self.exact.phases.items():
            moved[name] = Doubled(phase) + 2 * EPS * max(1.0, abs(phase))
        for group in self.branch.plan.groups:
            if group.name in self.exact.folded and self.exact.enters(group):
                # a double root moves by the root of what its loops leave open: an arm of length l that turns by a
                # small angle φ is shorter along its line by l·φ²/2
                keys: list[Quantity] = [Gap(group.name, i) for i in range(len(group.closures))]
                gap = length([part.value for parts in self.doubled(keys).values() for part in parts])
                turn = np.sqrt(2 * gap / _shortest(group, self.poses.mechanism.size))
                for i, name in enumerate(group.unknowns):
                    off = turn if i < len(group.angles) else turn * self.poses.mechanism.size
                    moved[name] = self._unknown(group.name, str(i)) + off
        return moved

    # --- what enters ------------------------------------------------------------------------------------------------
    def entering(self, inputs: Iterable[str], changed: Mapping[str, Doubled] = NONE) -> dict[str, Any]:
        """The inputs of a tape, by their names; `changed` ones in place of their own numbers."""
        entering: dict[str, Any] = dict(changed)
        others: list[str] = []
        unknown: list[Doubled] = []
        for name in inputs:
            kind, _, of = name.partition(" ")
            if name in entering:
                continue
            if name in self.exact.known:
                entering[name] = self.exact.known[name]
            elif kind == "x":
                entering[name] = self._unknown(*of.rsplit(" ", 1))
            elif kind in ("friction", "slip"):
                entering[name] = self._rubbing(name)
            elif kind == "f":
                unknown = unknown or self._unknown_forces(changed)
                entering[name] = unknown[int(of)]
            elif kind == "table":
                number, part = of.split()
                entering[name] = self._table(int(number))[part == "y"]
            elif kind == "slope":
                number, part = of.split()
                entering[name] = self._slope(int(number))[part == "y"]
            elif not of and name[0] == "q":
                entering[name] = self._input(int(name[1:]))
            elif not of:
                order, j = NAMES.index(name[0]), int(name[1:])
                rate = self.poses.rates[order - 1][j]
                own = ("speed", "acceleration", "jerk")[order - 1]
                entering[name] = (
                    rate if np.ndim(rate) else Doubled(float(rate), self._decimals(j, own, float(rate)))
                )
            else:
                others.append(name)
        return entering | self.poses.entering(others)

    def _input(self, j: int) -> Doubled:
        return Doubled(self.poses.inputs[:, j], self.rest[:, j])

    def _unknown(self, group: str, i: str) -> Doubled:
        """An unknown of a group without a closed form, by Newton's method from that of the first run."""
        if f"x {group} {i}" not in self._solutions:
            before = [
                g for g in self.branch.plan.groups if self.exact.enters(g) and g.name not in self.exact.folded
            ]
            keys: list[Unknown] = []
            for g in before:
                keys += [Unknown(g.name, k) for k in range(len(g.angles) + len(g.slides))]
                if g.name == group:
                    break
            new = [key for key in keys if f"x {key.group} {key.number}" not in self._solutions]
            self._solve(new or keys, group)
        return self._solutions[f"x {group} {i}"]

    def _solve(self, keys: Sequence[Unknown], group: str) -> None:
        inputs = [f"x {key.group} {key.number}" for key in keys]
        if any(g.name == group for g in self.branch.plan.groups if g.name in self.exact.folded):
            of = next(g for g in self.branch.plan.groups if g.name == group)
            inputs, keys = list(of.unknowns), []
        first = self.poses.entering(inputs)
        self._solutions |= {name: Doubled(x) for name, x in first.items()}
        for _ in range(STEPS if keys else 0):
            results = self.doubled(keys)
            steps = 0.0
            for name, key in zip(inputs, keys, strict=True):
                new, old = results[key][0], self._solutions[name]
                steps = max(steps, float(np.nanmax(np.abs((new - old).value), initial=0.0)))
                self._solutions[name] = new
            if not steps > SMALL * max(1.0, self.poses.mechanism.size):
                break

    # --- redundant statics ------------------------------------------------------------------------------------------
    def _unknown_forces(self, changed: Mapping[str, Doubled]) -> list[Doubled]:
        """The unknown forces of all links, A f + b = 0, with `changed` inputs; NaN where statics does not determine them.

        What the f of the first run leave there in 32 digits, A⁺ times that, is what they are off by: one step of iterative
        refinement (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., §12.1).
        """
        statics = self.poses.statics
        value, least = statics.solved[0], np.nan_to_num(statics.least[0])
        # what statics does not determine has a part in the balance too
        least_forces = {f"f {i}": Doubled(column) for i, column in enumerate(least.T)}
        keys: list[Quantity] = [Balance(row) for row in range(statics.rows)]
        left = self.doubled(keys, {**changed, **least_forces})
        rest = np.stack([np.broadcast_to(left[key][0].value, self.n) for key in keys], axis=1)
        off = np.full(value.shape, np.nan)
        system = statics.system[0]
        good = np.isfinite(system).all(axis=(1, 2)) & np.isfinite(rest).all(axis=1)
        off[good] = (np.linalg.pinv(system[good], rcond=NULL) @ rest[good][..., None])[..., 0]
        off[np.isnan(value)] = np.nan
        return [Doubled(f) - by for f, by in zip(least.T, off.T, strict=True)]

    # --- friction ---------------------------------------------------------------------------------------------------
    def _rubbing(self, name: str) -> Doubled:
        """The friction of a contact and which way it slips, from the first run on until the friction fits its force."""
        if name not in self._solutions:
            for n, size in enumerate(self.poses.friction):
                self._solutions |= {f"friction {n}": Doubled(size), f"slip {n}": Doubled(-np.sign(size))}
            # where statics does not determine what a contact bears, nothing determines its friction
            names = [f"friction {n}" for n, x in enumerate(self.poses.friction) if not np.isnan(x).all()]
            slopes = self._slopes(names) if names else np.empty(0)
            for _ in range(STEPS if names else 0):
                rest = self._unfit(names)
                change = np.linalg.solve(slopes, np.array([x.value for x in rest]).T[:, :, None])[:, :, 0].T
                old = [self._solutions[of] for of in names]
                for of, step in zip(names, change, strict=True):
                    self._solutions[of] = self._solutions[of] + step
                size = np.abs([x.value for x in old]).max(axis=0, initial=0.0)
                if not np.nanmax(np.abs(change) / np.where(size > 0, size, 1.0), initial=0.0) > SETTLED:
                    break
        return self._solutions[name]

    def _unfit(self, names: Sequence[str], changed: Mapping[str, Doubled] | None = None) -> list[Doubled]:
        """By how much the forces of the contacts ask for other friction than enters, (n,) each; 0 where joints stick."""
        keys: list[Quantity] = [Rub(int(of.removeprefix("friction "))) for of in names]
        results = self.doubled(keys, changed)
        enters = {of: self._solutions[of] for of in names} | dict(changed or {})
        slides = self._slides + np.zeros(self.n)
        return [(results[key][0] - enters[of]) * slides for key, of in zip(keys, names, strict=True)]

    @property
    def _slides(self) -> NDArray[np.bool_]:
        """Whether the friction of a pose follows from the forces of its contacts, (n,) or (1,)."""
        return np.asarray(np.isnan(self.poses.holding[0]))

    def _slopes(self, names: Sequence[str]) -> Reals:
        """How what does not fit falls with each friction, (n, contacts, contacts), for Newton's method."""
        rest = self._unfit(names)
        size = np.abs([self._solutions[of].value for of in names]).max(axis=0, initial=0.0)
        by = NUDGE * np.where(size > 0, size, 1.0)
        slopes = np.empty((self.n, len(names), len(names)))
        for k, of in enumerate(names):
            other = self._unfit(names, {of: self._solutions[of] + by})
            slopes[:, :, k] = np.array([(x - y).value / by for x, y in zip(rest, other, strict=True)]).T
        # what locks or sticks has no friction to look for
        there = np.isfinite(slopes).all(axis=(1, 2)) & self._slides
        slopes[~there] = np.eye(len(names))
        return slopes

    def _table(self, number: int) -> tuple[Doubled, Doubled]:
        """What a table gives, linear between its rows."""
        along, (step, first), (change, before) = self._row(number)
        share = (along - first) / step
        x, y = (share * rise + of for rise, of in zip(change, before, strict=True))
        return x, y

    def _slope(self, number: int) -> tuple[Doubled, Doubled]:
        """How steep a table is between its rows."""
        _, (step, _), (change, _) = self._row(number)
        x, y = (rise / step for rise in change)
        return x, y

    def _row(
        self, number: int
    ) -> tuple[Doubled, tuple[Doubled, Doubled], tuple[list[Doubled], list[Doubled]]]:
        """The place in a table, and of the row before it: the step to the next and where it begins; the same of the force's parts."""
        table = self.exact.tables[number]
        at, *parts = (np.array(column) for column in zip(*self._exact_rows(table), strict=True))
        place = self._place(table)
        if table.periodic:
            first, last = at[0, 0], at[-1, 0]
            cycles = np.floor((place.high - first) / (last - first))
            turns = (last - first) / (2 * math.pi)
            whole = abs(turns - round(turns)) <= 4 * EPS * abs(turns)
            period = TURN * float(round(turns)) if whole else Doubled(*at[-1]) - Doubled(*at[0])
            place = place - period * cycles
        i = np.clip(np.searchsorted(at[:, 0], place.high, "right") - 1, 0, len(at) - 2)
        step, *change = (Doubled(*of[i + 1].T) - Doubled(*of[i].T) for of in (at, *parts))
        return place, (step, Doubled(*at[i].T)), (change, [Doubled(*part[i].T) for part in parts])

    def _exact_rows(self, table: Tabled) -> list[list[tuple[float, float]]]:
        """The numbers of a table, place and both parts of the force, each as the float and what its decimals are off it."""
        decimals, m = self.poses.mechanism.decimals, self.poses.mechanism
        over = "length" if table.axis == "input" and m.inputs[0].is_slide else table.axis
        kinds = "angle" if over == "input" else over, *["force" if table.axis == "input" else "torque"] * 2
        return [
            [(x, decimals.rest(kind, x) if decimals else 0.0) for kind, x in zip(kinds, row, strict=True)]
            for row in ((at, force.real, force.imag) for at, force in table.table)
        ]

    def _place(self, table: Tabled) -> Doubled:
        """What a table is over."""
        if table.axis == "input":
            return self._input(0)
        if table.axis == "time":
            return Doubled(np.asarray(table.timed(self.poses.time), dtype=float))
        key: Quantity = Angle(table.body, int(table.axis == "speed"))
        (place,) = self.doubled([key])[key]
        if table.axis == "speed":
            return place + np.zeros(self.n)
        # in the turn in which the first run reads it
        turns = np.rint((self.poses.place(table) - place.high) / (2 * math.pi))
        whole: Doubled = place + TURN * turns
        return whole


def _shortest(group: Group, size: float) -> float:
    """The shortest arm that turns with a group's unknowns, of a size at most."""
    terms = (t for closure in group.closures for t in closure.terms)
    arms = (abs(complex(t.z)) for t in terms if t.body in group.members and t.slide is None)
    return min((arm for arm in arms if arm), default=size)


def parts(key: Quantity, value: Any) -> list[Any]:
    """The parts of a quantity, (n,) each."""
    return [value] if len(key.names) == 1 else [value.real, value.imag]


def apart(key: Quantity, parts: Sequence[Any], others: Sequence[Any]) -> Reals:
    """How far two values of a quantity lie from each other, (n,); angles have no whole turns."""
    with np.errstate(invalid="ignore"):
        differences = [a - b for a, b in zip(parts, others, strict=True)]
        if key.is_angle:
            differences = [x - TURN * np.rint(x.high / (2 * math.pi)) for x in differences]
        return length([each.value for each in differences])


def length(parts: list[Any]) -> Reals:
    """The size of what has one part or two, infinite where it is no number."""
    with np.errstate(invalid="ignore"):
        size = np.abs(parts[0])
        for part in parts[1:]:
            size = np.hypot(size, part)
    return np.fmin(np.where(np.isnan(size), np.inf, size), np.inf)
