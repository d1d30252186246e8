"""Bounds of the rounding errors of a motion's quantities, from the adjoint of the tape that records them.

A quantity y is a list of real operations (`virtualwork.formulas.recording`); each rounds, and the adjoint says how much
of that arrives at y (`dalembert.arithmetic.rounding`). What enters the tape and is not exact brings its own error: the
input, where it was swept; the constant of an angle, a sum of others; what a table gives; and the unknowns x of a group
without a closed form, which an iteration found. They are off by δx = −J⁻¹·gap to first order (N. J. Higham, Accuracy and
Stability of Numerical Algorithms, 2nd ed., SIAM 2002, §7.1), the gap that they leave in the group's loops, as computed
and with the roundings of computing it. That step is on the tape, groups one after the other.

Close to a limit the second order counts too: see `virtualwork.bounds.second_order`. Dimensions, loads and inputs are
taken as exact. A bound is infinite where no digit is known, NaN where the pose is not assembled.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property, reduce
from types import MappingProxyType
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.engines import run
from dalembert.arithmetic.guard import guarded
from dalembert.arithmetic.rounding import FEW, bounds_of_few, rounding_bounds
from dalembert.arithmetic.tape import Tape
from virtualwork.bounds.doubted import Doubted
from virtualwork.bounds.second_order import FAR, Solution, grown, solution
from virtualwork.formulas.asked import FORCES, Key, names, over_blocks
from virtualwork.formulas.lanes import Lanes, Turning, taped
from virtualwork.formulas.loads import Tabled
from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.formulas.poses import Poses

# roundings of a constant that is none of the plan's: the product of a mass and a place
CONSTANT = 1.0
# units by which the cosine of an input of an even sweep errs besides, where e^{iq} is a product of three factors
SWEPT = 3.0
# quantities × operations of a tape of theirs: its sweep is some two times as long
LONGEST, LONGEST_OF_ONE = 2500, 700
# lanes that a sweep on numbers costs as much as, however few they are
EACH = 100
EMPTY: Mapping[str, Any] = MappingProxyType({})
# what a load's derivatives and its lever make of a limit's root h: a force of order k goes as h^(−2k)
BESIDE_LIMIT = 0.5


@guarded
class Bounds:
    """Bounds of the rounding errors of quantities, by their keys (`Recording.value`)."""

    def __init__(self, poses: Poses, *, careful: bool = False, swept: bool = False) -> None:
        self.poses, self.n, self.lock = poses, poses.n, poses.lock
        # poses that are asked for bounds are those of an assembly
        self.branch = cast(Turning, poses.branch)
        # every group's unknowns are judged by the gaps that they leave, however they were found
        self.careful = careful
        self.swept = swept or any(st.spins for st in poses.states())
        self.lanes = Lanes(self.branch, poses)
        self._known: dict[Key, Reals] = {}
        self._solutions: dict[str, Solution] = {}

    def of(self, key: Key) -> Reals:
        """The bound of a quantity's error, (n,); the length of the error of a vector."""
        self.together([key])
        return self._known[key]

    def together(self, keys: Iterable[Key]) -> None:
        """Form the bounds of several quantities, which have most of the sweep in common; `of` gives them out."""
        new = [key for key in dict.fromkeys(keys) if key not in self._known]
        if self.poses.mechanism.friction:
            # found by iteration
            rubbed = {key: np.full(self.n, np.inf) for key in new if key[0] in FORCES}
            self._known |= rubbed
            new = [key for key in new if key not in rubbed]
        cost = taped(self.branch, self.recording, tuple(new)).cost
        while new:
            # as many as one tape is fit for
            here = new[: max(1, (LONGEST if self.n > 1 else LONGEST_OF_ONE) // max(cost, 1))]
            new = new[len(here) :]
            self._known |= self._formed(here)
            if self._beside is not None:
                rows, beside = self._beside
                beside.together(here)
                for key in here:
                    self._known[key][rows] = beside.of(key)

    @cached_property
    def _beside(self) -> tuple[NDArray[np.bool_], Bounds] | None:
        """The poses close to a change point, where a series replaces the closed forms."""
        if self.careful:
            return None
        # what was covered is known then
        _ = self.lanes.recording
        rows = self.branch.close_to_change(self.poses.inputs[:, 0])
        if not rows.any():
            return None
        some = self.poses.some(rows)
        given = np.broadcast_to(np.asarray(self.poses.input_error, dtype=float), self.poses.inputs.shape)
        some.input_error = given[rows]
        some.time = None if self.poses.time is None else self.poses.time[rows]
        return rows, Bounds(some, careful=True, swept=self.swept)

    @cached_property
    def recording(self) -> Doubted:
        """The formulas of the branch, with the constants of its plan as inputs, and unknowns that may be wrong."""
        branch, plain = self.branch, self.lanes.recording
        entered = frozenset(g.name for g in branch.plan.groups) if self.careful else frozenset(branch.folded)
        key = "doubted", plain.moves, plain.turning_over, entered
        if key not in branch.recordings:
            branch.recordings[key] = Doubted(plain, branch, entered)
        found: Doubted = branch.recordings[key]
        return found

    # --- what is asked for ------------------------------------------------------------------------------------------
    def _formed(self, keys: list[Key]) -> dict[Key, Reals]:
        bounds: dict[Key, Reals] = {}
        closed: dict[Key, Key] = {}
        if self.branch.may_open:
            closed = {key: ("closed", *self.recording.hangs_on(key)) for key in keys}
        found = self.run(keys, dict.fromkeys(closed.values()), values=self.careful)
        nowhere = ~np.isfinite(self.poses.inputs).all(axis=1)
        # roots are the same for many quantities: whether one is near its limit is looked at once
        roots = {id(x): x for name, x in found.items() if name.startswith("tau(")}
        entered = any(map(self.recording.enters, self.branch.plan.groups))
        near = entered or not all(np.all(tau < FAR) for tau in roots.values())
        for key in keys:
            # what is no number is infinite
            bound = np.fmin(np.broadcast_to(self._bound(key, found, near), self.n), np.inf)
            if nowhere.any():
                bound[nowhere] = np.nan
            if key in closed:
                bound[~np.isfinite(np.broadcast_to(found[names(closed[key])[0]], self.n))] = np.nan
            bounds[key] = bound
        return bounds

    def _bound(self, key: Key, found: Mapping[str, Any], near: bool) -> Any:
        """The bound of a quantity from what a sweep gives; `near`: some pose may be near a limit."""
        parts, order = names(key), self._order(key)
        with np.errstate(all="ignore"):
            bound = _length([found[f"error({name})"] for name in parts])
            if order and near:
                bound = bound * grown(self._tau(key, found), order)
            if self.careful:
                bound = bound + self._apart(key, [found[name] for name in parts])
        return bound

    def _apart(self, key: Key, parts: list[Any]) -> Any:
        """By how much a quantity as it was found is off from the tape's."""
        apart = over_blocks(self.poses, key) - (parts[0] if len(parts) == 1 else parts[0] + 1j * parts[1])
        return np.abs(np.angle(np.exp(1j * apart)) if key[0] == "angle" and not key[2] else apart)

    def _order(self, key: Key) -> float:
        """Half the power of 1/h with which a quantity grows at a limit, less one half."""
        if key[0] not in FORCES:
            return 0.0 if key[0] in ("turn", "gap") else float(key[-1])
        moves = any(self.recording.moves[:2])
        return BESIDE_LIMIT + (2.0 if moves else BESIDE_LIMIT)

    def run(
        self,
        keys: Sequence[Key],
        more: Iterable[Key] = (),
        known: Mapping[str, Reals] = EMPTY,
        values: bool = True,
    ) -> Mapping[str, Any]:
        """Bounds of quantities, `error(name)`, and their τ, `tau(name)`; more by its names, the quantities too if `values`.

        `known` enters, exact, besides.
        """
        tape = taped(self.branch, self.recording, (*keys, *more))
        given = {**known} | self._entering(name for name in tape.inputs if name not in known)
        errors = self._errors(tape.inputs)
        inputs = {name: f"error {name}" for name in errors}
        given |= {inputs[name]: error for name, error in errors.items()}
        wanted = tuple(name for key in keys for name in names(key))
        how = CONSTANT, SWEPT if self.swept else 0.0
        key = "bounds", tape, tuple(inputs), wanted, how, values
        if key not in self.branch.recordings:
            asked = self.branch.recordings.setdefault("asked for bounds", {})
            asked[key] = asked.get(key, 0) + self.n + EACH
            if asked[key] <= FEW:
                return bounds_of_few(tape, given, inputs, wanted, *how)
            whole = rounding_bounds(tape, inputs, wanted, *how)
            left = set() if values else set(wanted)
            self.branch.recordings[key] = _once(whole, [name for name in whole.names if name not in left])
        if self.n == 1:
            given = {name: float(np.ravel(value)[0]) for name, value in given.items()}
        written, called = self.branch.recordings[key]
        found = run(written, given)
        once = {first: found[first] for first in called.values()}
        return {name: once[first] for name, first in called.items()}

    def _tau(self, key: Key, found: Mapping[str, Any]) -> Any:
        """τ of roots that a quantity hangs on, on the tape, and of groups whose unknowns enter."""
        tau = _largest(found, [key])
        groups = self.recording.hangs_on(key)
        for group in self.branch.plan.groups:
            if group.name in groups and self.recording.enters(group):
                tau = np.maximum(tau, self._solution(group.name).tau)
        return tau

    def residual(self, keys: Sequence[Key], known: Mapping[str, Reals] = EMPTY) -> tuple[Reals, Reals]:
        """The size of what should be zero, as computed and with its rounding, (n, rows), and τ, (n,)."""
        found = self.run(keys, known=known)
        rows = [row for key in keys for row in names(key)]
        left = np.empty((self.n, len(rows)))
        for i, row in enumerate(rows):
            left[:, i] = found[f"error({row})"] + np.abs(found[row])
        # a gap is what the unknowns of its own group leave
        tau = _largest(found, keys) if keys[0][0] == "gap" else self._tau(keys[0], found)
        return left, np.broadcast_to(tau, self.n)

    # --- what enters -------------------------------------------------------------------------------------------------
    def _entering(self, inputs: Iterable[str]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        rest = []
        for name in inputs:
            kind, _, of = name.partition(" ")
            if name in self.recording.constants:
                found[name] = self.recording.constants[name][0]
            elif name == "step":
                found[name] = 1.0
            elif kind == "inverse":
                group, i, r = of.rsplit(" ", 2)
                found[name] = self._solution(group).inverse[:, int(i), int(r)]
            else:
                rest.append(name)
        return found | self.lanes.entering(rest)

    def _errors(self, inputs: Iterable[str]) -> dict[str, Any]:
        """The errors of what enters, where it is not exact."""
        given = np.broadcast_to(np.asarray(self.poses.input_error, dtype=float), self.poses.inputs.shape)
        found: dict[str, Any] = {}
        for name in inputs:
            kind, _, of = name.partition(" ")
            if name in self.recording.constants:
                error = self.recording.constants[name][1]
                if error:
                    found[name] = error
            elif name == "step":
                # none of it is made
                found[name] = 1.0
            elif kind == "table":
                found[name] = self._table(int(of.split()[0]))
            elif not of and kind[0] == "q" and given[:, int(kind[1:])].any():
                found[name] = given[:, int(kind[1:])]
        return found

    def _solution(self, name: str) -> Solution:
        """What the loops of a group leave open, and what its unknowns are wrong by for it."""
        if name not in self._solutions:
            group = next(g for g in self.branch.plan.groups if g.name == name)
            keys: list[Key] = [("gap", name, i) for i in range(len(group.closures))]
            left, _ = self.residual(keys)
            self._solutions[name] = solution(group, self.poses, left)
        return self._solutions[name]

    def _table(self, number: int) -> Reals:
        """Of what a table gives: its reading, and where it is read."""
        case = self.recording.forces[0].case
        table = [load for load in case.loads if isinstance(load, Tabled)][number]
        at, force = np.array([row[0] for row in table.table]), np.array([row[1] for row in table.table])
        steep = float(np.max(np.abs(np.diff(force) / np.diff(at)), initial=0.0))
        far = np.abs(self.poses.inputs[:, 0]) if table.axis == "input" else np.abs(at).max()
        read = 2 * EPS * float(np.abs(force).max()) + EPS * steep * (far + np.abs(at).max())
        if table.axis in ("angle", "speed"):
            read = read + steep * self.of(("angle", table.body, int(table.axis == "speed")))
        return np.broadcast_to(read, self.n)


def _largest(found: Mapping[str, Any], keys: Iterable[Key]) -> Any:
    """The largest τ of some quantities."""
    return reduce(np.maximum, [found[f"tau({name})"] for key in keys for name in names(key)])


def _once(tape: Tape, names: Iterable[str]) -> tuple[Tape, dict[str, str]]:
    """A tape that has each result once, and what outputs are called there."""
    first: dict[int, str] = {}
    known = dict(tape.outputs)
    called = {name: first.setdefault(known[name], name) for name in names}
    return tape.pruned(first.values()), called


def _length(parts: list[Any]) -> Any:
    return parts[0] if len(parts) == 1 else np.hypot(*parts)
