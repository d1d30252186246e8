"""Estimates of the rounding errors of a motion's quantities: computed twice, with 16 and with 32 digits, and compared.

The second run is the same tape with every number of the description as an input (`exact`), on doubled numbers. What was
decided in the first run, which assembly and which whole turn, enters; the unknowns of groups without a closed form go on
with Newton's method from those of the first. What neither run knows adds to the difference: an input that is not exact,
and the constant of a gear that the guess fixes by way of other links.

Close to a change point, where the Jacobian of a loop vanishes though the branch goes on, the second run is interpolated
between poses farther off, by Lagrange's polynomial in its barycentric form (J.-P. Berrut, L. N. Trefethen, SIAM Review 46,
2004, eq. 4.2).

An estimate is infinite where no digit holds, NaN where the pose is not assembled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.engines.doubled import run
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.guard import guarded
from virtualwork.describe.dimensions import dimensions
from virtualwork.digits.exact import QUARTER, Exact
from virtualwork.formulas.asked import FORCES, Key, names, over_blocks
from virtualwork.formulas.lanes import Lanes, Turning, taped
from virtualwork.formulas.loads import Tabled
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.recording import NAMES

# of the difference, and of the quantity: what the second run itself may be off by, far from singular places
OWN, LAST = 1.01, 2.0**-96
# a radicand, relative, that rounding may reach, and the share of it that rounding takes
NEAR, DOUBTED = 1e-12, 0.1
# steps of Newton's method in 32 digits at most, and a step, of 1 rad or the size, that is the last
STEPS, SMALL = 8, 2.0**-60
# nodes on the way through a change point, and how many times farther off than the poses that a series carries through
NODES, FARTHER = 24, (8.0, 5.0)
# of the radicand: where branches are no farther apart they meet
MEETING = 1e-18
TURN = QUARTER * 4.0

Values = Callable[[Sequence[Key]], Sequence[Any]]
Found = dict[Key, list[Doubled]]


@guarded
class Estimates:
    """Estimates of the rounding errors of quantities, by their keys (`Recording.value`).

    Parameters
    ----------
    poses : Poses
    values : function of keys, optional
        Gives the quantities as they were handed out, (n,) each; default those of the poses.
    """

    def __init__(self, poses: Poses, values: Values | None = None) -> None:
        self.poses, self.n, self.lock = poses, poses.n, poses.lock
        # poses that are asked for estimates are those of an assembly
        self.branch = cast(Turning, poses.branch)
        self._values = values or (lambda keys: [over_blocks(poses, key) for key in keys])
        self._known: dict[Key, Reals] = {}

    def of(self, key: Key) -> Reals:
        """The estimate of a quantity's error, (n,); the length of the error of a vector."""
        self.together([key])
        return self._known[key]

    def together(self, keys: Iterable[Key]) -> None:
        """Form the estimates of several quantities, which have most of the second run in common; `of` gives them out."""
        new = [key for key in dict.fromkeys(keys) if key not in self._known]
        lost = [key for key in new if self._lost(key)]
        self._known |= {key: np.full(self.n, np.inf) for key in lost}
        new = [key for key in new if key not in lost]
        if not new:
            return
        values = dict(zip(new, self._values(new), strict=True))
        found = self.second.doubled(new)
        errors = {key: _apart(key, values[key], found[key]) for key in new}
        rows = self._close_to_change
        if rows.any():
            errors = self._passing(new, rows, values, errors)
        for group, rows in self._undecided.items():
            here = [key for key in new if group in self.second.exact.hangs_on(key)]
            some = self.second.some(rows)
            other = some.doubled(here, {f"sign {group}": -some.sign(group)}) if here else {}
            for key in here:
                errors[key][rows] = np.maximum(errors[key][rows], _apart(key, values[key][rows], other[key]))
        for key in new:
            for more in self.second.uncertain(key, found):
                errors[key] = errors[key] + more
            # what is no number is infinite
            known = np.isfinite(values[key])
            size = np.abs(values[key])
            estimate = np.where(errors[key] < np.inf, OWN * errors[key] + LAST * size, np.inf)
            self._known[key] = np.where(known, estimate, np.nan)

    @cached_property
    def second(self) -> SecondRun:
        """The poses in 32 digits."""
        return SecondRun(self.poses)

    def _lost(self, key: Key) -> bool:
        """Whether a quantity has no second run: a rate where the speed is not determined, forces that friction takes part in."""
        if key[0] in FORCES and self.poses.mechanism.friction:
            return True
        if not self.branch.folded:
            return False
        rates = key[0] in FORCES or (key[0] != "turn" and key[-1] != 0)
        return rates and not self.branch.folded.isdisjoint(self.second.exact.hangs_on(key))

    @cached_property
    def _undecided(self) -> dict[str, NDArray[np.bool_]]:
        """The poses so near a limit of a group that rounding may have taken the one of its two assemblies for the other."""
        groups = [g for g in self.second.exact.closed if g.name not in self.second.exact.folded]
        keys: list[Key] = [("margin", g.name) for g in groups]
        margins = self.second.doubled(keys)
        found = {}
        for group, key in zip(groups, keys, strict=True):
            exact = margins[key][0].value
            self.poses.solve(self.poses.plan.writes(group), 0)
            near = np.abs(exact) < NEAR
            if np.any(near):
                first = self._margin(group.name)
                rows = near & (np.abs(first - exact) > DOUBTED * np.abs(exact)) & ~self._close_to_change
                if rows.any():
                    found[group.name] = rows
        return found

    def _margin(self, group: str) -> Reals:
        """The radicand of a closed form in the first run, relative, (n,)."""
        return self.poses.over(lambda _, st: st.margin[group])  # type: ignore[no-any-return]

    # --- change points ----------------------------------------------------------------------------------------------
    @cached_property
    def _close_to_change(self) -> NDArray[np.bool_]:
        """The poses close to a change point, where a series replaces the closed forms."""
        if self.poses.inputs.shape[1] > 1:
            return np.zeros(self.n, dtype=bool)
        _ = self.second.lanes.recording
        return self.branch.close_to_change(self.poses.inputs[:, 0])

    def _passing(
        self,
        keys: Sequence[Key],
        rows: NDArray[np.bool_],
        values: Mapping[Key, Any],
        errors: Mapping[Key, Reals],
    ) -> dict[Key, Reals]:
        """The errors close to change points, by interpolation where two branches meet there exactly.

        Where the numbers keep them apart, if only in their last digits, the formulas themselves say what happens.
        """
        turns: list[Key] = [("turn", body) for g in self.second.exact.closed for body in g.angles]
        margins: list[Key] = [("margin", g.name) for g in self.second.exact.closed]
        some = self.second.some(rows)
        beside = self._interpolated([*keys, *turns], rows)
        here = some.doubled([*turns, *margins])
        root = np.sqrt(
            np.abs(np.min([np.broadcast_to(here[key][0].value, some.n) for key in margins], axis=0))
        )
        apart = [
            _length([(a - b).value for a, b in zip(here[key], beside[0][key], strict=True)]) for key in turns
        ]
        meet = np.max(apart, axis=0) * root < MEETING
        found = {}
        for key in keys:
            part = values[key][rows]
            smooth = np.maximum(*(_apart(key, part, each[key]) for each in beside))
            found[key] = errors[key].copy()
            found[key][rows] = np.where(meet, smooth, errors[key][rows])
        return found

    def _interpolated(self, keys: Sequence[Key], rows: NDArray[np.bool_]) -> list[Found]:
        """The quantities close to change points from poses farther off, two times: how far these are apart tells of both."""
        q = self.poses.inputs[rows, 0]
        places = self.branch.change_points
        nearest = [min(places, key=lambda place: abs(x - place[0])) for x in q.tolist()]
        found = []
        for farther in FARTHER:
            steps = np.cos((np.arange(NODES) + 0.5) * (math.pi / NODES))
            nodes = np.array([at + farther * reach * steps for at, reach in nearest])
            lanes = self.second.again(np.flatnonzero(rows), nodes).doubled(keys)
            weights = _weights(nodes, Doubled(q, self.second.rest[rows, 0]))
            found.append(
                {
                    key: [_weighted(part, weights, nodes.shape) for part in parts]
                    for key, parts in lanes.items()
                }
            )
        return found


@guarded
class SecondRun:
    """The quantities of poses in numbers of 32 digits.

    Attributes
    ----------
    rest : array (n, k)
        What the inputs are exactly, less the floats.
    """

    def __init__(self, poses: Poses, rest: Reals | None = None) -> None:
        self.poses, self.n, self.lock = poses, poses.n, poses.lock
        self.branch = cast(Turning, poses.branch)
        self.lanes = Lanes(self.branch, poses)
        self.rest = self._rest() if rest is None else rest
        self._solutions: dict[str, Doubled] = {}

    def _rest(self) -> Reals:
        given = self.poses.input_rest
        if given is not None:
            rest = given() if callable(given) else np.asarray(given, dtype=float)
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
        branch, plain = self.branch, self.lanes.recording
        key = "exact", plain.moves, plain.turning_over
        if key not in branch.recordings:
            branch.recordings[key] = Exact(branch, plain)
        made: Exact = branch.recordings[key]
        return made

    def some(self, which: NDArray[np.bool_]) -> SecondRun:
        """Some of the poses."""
        some = self.poses.some(which)
        some.time = None if self.poses.time is None else np.asarray(self.poses.time)[which]
        return SecondRun(some, self.rest[which])

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

    def doubled(self, keys: Sequence[Key], changed: Mapping[str, Doubled] | None = None) -> Found:
        """The quantities, real or as two parts, each Doubled of (n,) or of a number.

        `changed` inputs enter in place of their own numbers.
        """
        tape = taped(self.branch, self.exact, tuple(keys))
        changed = dict(changed or {})
        found = run(tape, self.entering(name for name in tape.inputs if name not in changed) | changed)
        zero = Doubled(0.0)
        return {key: [found.get(name, zero) for name in names(key)] for key in keys}

    def uncertain(self, key: Key, found: Found) -> list[Reals]:
        """By how much a quantity moves with each number that is not known exactly."""
        moved = []
        of = taped(self.branch, self.exact, (key,)).inputs
        for name, other in self._uncertain.items():
            if name in of:
                parts = self.doubled([key], {name: other})[key]
                moved.append(_length([(a - b).value for a, b in zip(parts, found[key], strict=True)]))
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
                # a double root moves by the root of what its loops leave open
                keys: list[Key] = [("gap", group.name, i) for i in range(len(group.closures))]
                gap = _length([part.value for parts in self.doubled(keys).values() for part in parts])
                turn = np.sqrt(gap / self.poses.mechanism.size)
                for i in range(len(group.angles) + len(group.slides)):
                    off = turn if i < len(group.angles) else turn * self.poses.mechanism.size
                    moved[f"x {group.name} {i}"] = self._unknown(group.name, str(i)) + off
        return moved

    # --- what enters ------------------------------------------------------------------------------------------------
    def entering(self, inputs: Iterable[str]) -> dict[str, Any]:
        """The inputs of a tape, by their names."""
        found: dict[str, Any] = {}
        others = []
        for name in inputs:
            kind, _, of = name.partition(" ")
            if name in self.exact.known:
                found[name] = self.exact.known[name]
            elif kind == "x":
                found[name] = self._unknown(*of.rsplit(" ", 1))
            elif kind == "table":
                number, part = of.split()
                found[name] = self._table(int(number))[part == "y"]
            elif not of and name[0] == "q":
                found[name] = self._input(int(name[1:]))
            elif not of:
                order, j = NAMES.index(name[0]), int(name[1:])
                rate = self.poses.rates[order - 1][j]
                own = ("speed", "acceleration", "jerk")[order - 1]
                found[name] = (
                    rate if np.ndim(rate) else Doubled(float(rate), self._decimals(j, own, float(rate)))
                )
            else:
                others.append(name)
        return found | self.lanes.entering(others)

    def _input(self, j: int) -> Doubled:
        return Doubled(self.poses.inputs[:, j], self.rest[:, j])

    def _unknown(self, group: str, i: str) -> Doubled:
        """An unknown of a group without a closed form, by Newton's method from that of the first run."""
        if f"x {group} {i}" not in self._solutions:
            before = [
                g for g in self.branch.plan.groups if self.exact.enters(g) and g.name not in self.exact.folded
            ]
            keys: list[Key] = []
            for g in before:
                keys += [("unknown", g.name, k) for k in range(len(g.angles) + len(g.slides))]
                if g.name == group:
                    break
            self._solve([key for key in keys if f"x {key[1]} {key[2]}" not in self._solutions] or keys, group)
        return self._solutions[f"x {group} {i}"]

    def _solve(self, keys: Sequence[Key], group: str) -> None:
        inputs = [f"x {of} {i}" for _, of, i in keys]
        if any(g.name == group for g in self.branch.plan.groups if g.name in self.exact.folded):
            of = next(g for g in self.branch.plan.groups if g.name == group)
            inputs, keys = [f"x {group} {i}" for i in range(len(of.angles) + len(of.slides))], []
        first = self.lanes.entering(inputs)
        self._solutions |= {name: Doubled(x) for name, x in first.items()}
        for _ in range(STEPS if keys else 0):
            found = self.doubled(keys)
            steps = 0.0
            for name, key in zip(inputs, keys, strict=True):
                new, old = found[key][0], self._solutions[name]
                steps = max(steps, float(np.nanmax(np.abs((new - old).value), initial=0.0)))
                self._solutions[name] = new
            if not steps > SMALL * max(1.0, self.poses.mechanism.size):
                break

    def _table(self, number: int) -> tuple[Doubled, Doubled]:
        """What a table gives, linear between its rows."""
        case = self.exact.forces[0].case
        table = [load for load in case.loads if isinstance(load, Tabled)][number]
        at, force = (np.array(column) for column in zip(*table.table, strict=True))
        place = self._place(table)
        if table.periodic:
            cycles = np.floor((place.high - at[0]) / (at[-1] - at[0]))
            turns = (at[-1] - at[0]) / (2 * math.pi)
            whole = abs(turns - round(turns)) <= 4 * EPS * abs(turns)
            period = TURN * float(round(turns)) if whole else Doubled(at[-1]) - at[0]
            place = place - period * cycles
        i = np.clip(np.searchsorted(at, place.high, "right") - 1, 0, len(at) - 2)
        share = (place - at[i]) / (Doubled(at[i + 1]) - at[i])
        x, y = (share * (Doubled(part[i + 1]) - part[i]) + part[i] for part in (force.real, force.imag))
        return x, y

    def _place(self, table: Tabled) -> Doubled:
        """What a table is over."""
        if table.axis == "input":
            return self._input(0)
        if table.axis == "time":
            return Doubled(np.asarray(table.timed(self.poses.time), dtype=float))
        key: Key = ("angle", table.body, int(table.axis == "speed"))
        (place,) = self.doubled([key])[key]
        if table.axis == "speed":
            return place + np.zeros(self.n)
        # in the turn in which the first run reads it
        turns = np.rint((self.lanes.place(table) - place.high) / (2 * math.pi))
        whole: Doubled = place + TURN * turns
        return whole


def _apart(key: Key, value: Any, exact: Sequence[Doubled]) -> Reals:
    """The size of the difference of a quantity and its second run, (n,)."""
    parts = [value] if len(exact) == 1 else [value.real, value.imag]
    with np.errstate(invalid="ignore"):
        apart = [of - Doubled(part) for of, part in zip(exact, parts, strict=True)]
        if key[0] == "angle" and key[2] == 0:
            apart = [apart[0] - TURN * np.rint(apart[0].high / (2 * math.pi))]
        return _length([each.value for each in apart])


def _length(parts: list[Any]) -> Reals:
    with np.errstate(invalid="ignore"):
        size = np.abs(parts[0])
        for part in parts[1:]:
            size = np.hypot(size, part)
    return np.fmin(np.where(np.isnan(size), np.inf, size), np.inf)


def _weights(nodes: Reals, q: Doubled) -> list[Doubled]:
    """The barycentric weights of values at nodes (rows, nodes) for their polynomial at q (rows,); their sum is 1."""
    weights = []
    columns = [Doubled(column) for column in nodes.T]
    for i, node in enumerate(columns):
        product = q - node
        for k, other in enumerate(columns):
            if k != i:
                product = product * (node - other)
        weights.append(1.0 / product)
    total = weights[0]
    for weight in weights[1:]:
        total = total + weight
    return [weight / total for weight in weights]


def _weighted(values: Doubled, weights: Sequence[Doubled], shape: tuple[int, ...]) -> Doubled:
    total: Doubled = Doubled(0.0)
    high, low = (np.broadcast_to(part, math.prod(shape)).reshape(shape) for part in (values.high, values.low))
    for i, weight in enumerate(weights):
        total = total + weight * Doubled(high[:, i], low[:, i])
    return total
