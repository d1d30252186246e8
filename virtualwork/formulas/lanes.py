"""Quantities of many poses, or of one, from the tape: each pose is a lane.

What is wanted is written down once for an assembly (`recording`), pruned, and run by the engine that suits the count of
poses. Poses close to a change point, where two branches meet, are left to `Poses`, whose series carry them through.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.choice import wanted
from dalembert.arithmetic.engines import as_part, floats, run
from dalembert.arithmetic.guard import guarded
from dalembert.arithmetic.tape import Tape
from virtualwork.formulas.forces import Force
from virtualwork.formulas.kept import Later, later
from virtualwork.formulas.loops import Closed, Margin, Regularity
from virtualwork.formulas.newton import unknowns
from virtualwork.formulas.numbers import SINGULAR, Number, Reals, leave_out
from virtualwork.formulas.poses import Branch, Poses
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.recording import NAMES, NEAR, Recording
from virtualwork.plan.steps import Step

if TYPE_CHECKING:
    from virtualwork.formulas.dynamics import Dynamics
    from virtualwork.formulas.loads import Tabled

# poses from which on a second request brings all of its kind, and how many times the operations of those requested
MANY_POSES, WASTE = 10_000, 4
# times that one pose is asked for from which on the tape pays
OFTEN = 50
# tapes of later requests that an assembly keeps
MANY = 256

# quantities of one pose, real or complex, as a function of the input, its speed, acceleration and jerk
Ready = Callable[[float, float, float, float], tuple[complex, ...]]


class Turning(Branch, Protocol):
    """A branch whose closed forms may change their sign along the input."""

    @property
    def signs(self) -> Mapping[str, int]:
        """The sign of each closed form at the guess."""

    @property
    def geared(self) -> set[str]:
        """Bodies whose angle itself is needed."""

    @property
    def recordings(self) -> dict[Any, Any]:
        """What has been written down of it."""

    @property
    def turning_over(self) -> frozenset[str]:
        """The closed forms that change their sign somewhere in what was covered."""

    @property
    def may_open(self) -> bool:
        """Whether it cannot be assembled somewhere in what was covered, as far as is known."""

    @property
    def settled(self) -> bool:
        """Whether no change point lies anywhere, however far the input turns."""

    @property
    def folded(self) -> set[str]:
        """The groups that are singular in every pose."""

    def sign(self, group: str, q: Reals) -> Number:
        """The sign of a closed form at inputs."""

    @property
    def change_points(self) -> list[tuple[float, float]]:
        """Where two branches meet, each with how far off poses are close to it, in what was covered."""

    @property
    def phases(self) -> Mapping[int, float]:
        """The constants of gears, by their numbers."""

    def close_to_change(self, q: Reals) -> NDArray[np.bool_]:
        """Which inputs are close to a change point."""


@guarded
class Lanes(Poses):
    """Poses of an assembly whose quantities come from the tape.

    Parameters are those of `Poses`.
    """

    branch: Turning

    def __init__(
        self,
        branch: Turning,
        angle: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        jerk: ArrayLike | None = None,
        block_of: int | None = None,
    ) -> None:
        super().__init__(branch, angle, speed, acceleration, jerk, block_of)
        self.known: dict[Quantity, Any] = {}
        # which quantities of one pose come from the tape
        self._taped: dict[Quantity, bool] = {}
        # values of operations for later requests, by their numbers; and where doubts are right
        self._kept: dict[int, Any] = {}
        self._bad: dict[Quantity, NDArray[np.bool_] | None] = {}
        # kinds and orders that were requested
        self._requested: set[tuple[type[Quantity], int]] = set()
        self._repeated = False

    @cached_property
    def recording(self) -> Recording:
        """The formulas of the branch, for rates that are zero where these are."""
        inputs = self.inputs
        if inputs.shape[1] == 1 and len(inputs) and not self.branch.settled:
            self.branch.cover(float(np.nanmin(inputs)), float(np.nanmax(inputs)))
        moves = tuple(any(np.any(rate) for rate in rates) for rates in self.rates)
        return recorded(self.branch, moves)

    @property
    def solved(self) -> list[tuple[Step, int]]:
        """What has been worked out so far, (step, order); order 0 is position."""
        result = {(id(step), k): (step, k) for step, k in self._solved}
        for steps, order in (key.steps(self.recording) for key in self.known):
            result |= {(id(step), k): (step, k) for k in range(order + 1) for step in steps}
        return list(result.values())

    def takes(self, keys: Iterable[Quantity]) -> bool:
        """Whether the tape has these quantities; a group that is singular in every pose it has not."""
        recording = self.recording
        return not self.branch.folded and recording.takes(keys)

    def operations(self, keys: Iterable[Quantity]) -> int:
        """What quantities of a pose cost, in operations on real numbers, with all that they depend on."""
        return taped(self.branch, self.recording, tuple(keys)).cost

    def values(self, keys: Sequence[Quantity], forces: Callable[[], Dynamics] | None = None) -> list[Any]:
        """The quantities, each (n,), real or complex: of many poses from the tape, of one by the formulas on floats.

        One pose that is asked for often comes from the tape too, as a function of floats. What `takes` does not take, and
        poses close to a change point, are worked out over blocks, forces by what `forces` gives.
        """
        new = tuple(key for key in keys if key not in self._taped)
        if new and not self.many and not wanted():
            self._taped |= dict.fromkeys(new, self._often(new) and self.one(new))
        elif new:
            new = self._foreseen(new)
            if self.many or not self.one(new):
                self._fill(new, forces)
            # not before: what a table is over is asked for on the way, and may be among these
            self._taped |= dict.fromkeys(new, True)
        # what was handed out once stays as it is, to its last digit
        by_blocks = self._by_blocks([key for key in keys if not self._taped[key]], forces)
        return [self.known[key].copy() if self._taped[key] else by_blocks[key] for key in keys]

    def _foreseen(self, keys: tuple[Quantity, ...]) -> tuple[Quantity, ...]:
        """What a request is answered with: the second of a kind and order over very many poses brings all of them.

        One tape for all is cheaper than one for each; what nobody asks for twice is not computed.
        """
        kinds = {key.family for key in keys}
        self._repeated = self._repeated or not kinds.isdisjoint(self._requested)
        self._requested |= kinds
        if len(kinds) > 1 or not self._repeated or self.n < MANY_POSES:
            return keys
        ((kind, order),) = kinds
        more = [key for key in kind.every(self.mechanism, order) if key not in self.known]
        spent = self.operations([*keys, *(key for key in self.known if key.family in kinds)])
        if not self.takes(more) or self.operations([*keys, *more]) > WASTE * spent:
            return keys
        return tuple(dict.fromkeys((*keys, *more)))

    def taped(self, keys: Sequence[Quantity]) -> list[Any] | None:
        """Quantities of many poses from the tape; None of one pose, and where the tape does not have them."""
        return self.values(keys) if self.many and self.takes(keys) else None

    def _often(self, keys: tuple[Quantity, ...]) -> bool:
        """Whether one pose has been asked for so often that to write the tape pays: some milliseconds."""
        counts = self.branch.recordings.setdefault("asked", {})
        counts[keys] = counts.get(keys, 0) + 1
        return bool(counts[keys] > OFTEN)

    def _fill(self, keys: tuple[Quantity, ...], forces: Callable[[], Dynamics] | None) -> None:
        if self.takes(keys):
            # a part of a sweep has the digits of the whole
            if self.block_of:
                as_part(self.block_of, self._run, list(keys))
            else:
                self._run(list(keys))
        else:
            self.known |= self._by_blocks(keys, forces)

    def _by_blocks(
        self, keys: Sequence[Quantity], forces: Callable[[], Dynamics] | None = None
    ) -> dict[Quantity, Any]:
        """Quantities worked out over blocks."""
        loaded = [key for key in keys if isinstance(key, Force)]
        moving = [key for key in keys if not key.is_force]
        result = dict(zip(moving, self.by_blocks(moving), strict=True))
        if loaded:
            of = _dynamics_of(self) if forces is None else forces()
            result |= {key: key.read(of) for key in loaded}
        return result

    def one(self, keys: tuple[Quantity, ...]) -> bool:
        """Work out one pose that depends on nothing but its input, by a function of floats; False where it depends on more."""
        given = [self.inputs, *(rates[0] for rates in self.rates)]
        values = [x if isinstance(x, float) else float(np.ravel(x)[0]) for x in given]
        function = ready(self.branch, tuple(x != 0.0 for x in values[1:]), keys)
        if function is None:
            return False
        try:
            result = function(*values)
        except (ZeroDivisionError, ValueError, OverflowError):
            return False
        self.known.update((key, np.array([value])) for key, value in zip(keys, result, strict=True))
        return True

    def _run(self, keys: list[Quantity]) -> None:
        doubts = [key for key in dict.fromkeys(self._doubts(keys)) if key not in self._bad]
        # what is asked for first may be all: from the second time on, something is kept for those to come
        kept = dict(self._kept) if self.known and self.n > 1 else None
        asked, known = (*keys, *doubts), frozenset(kept or ())
        cut = _cut(self.branch, self.recording, asked, None if kept is None else known)
        given = self.entering(name for name in cut.tape.inputs if name not in cut.takes)
        if kept:
            given |= {name: kept[number] for name, number in cut.takes.items()}
        out = run(cut.tape, given, pairs=[key.names[0] for key in keys if key.is_vector])
        self._kept.update((number, out[name]) for name, number in cut.leaves.items())
        for key in doubts:
            self._bad[key] = self._where_bad(key, out[key.names[0]])
        # what a table is over has been handed out
        keys = [key for key in keys if key not in self.known]
        for key in keys:
            value = key.of_rows(out, self.n)
            for nowhere in (self._nowhere, *map(self._bad.get, self._closed(key))):
                if nowhere is not None:
                    leave_out(value, nowhere)
            self.known[key] = value
        careful = self._careful
        for key in self._doubts(keys):
            bad = self._bad[key]
            if not isinstance(key, Closed) and bad is not None:
                careful = careful | bad
        if careful.any():
            again = self.some(careful)._by_blocks(keys)
            for key in keys:
                self.known[key][careful] = again[key]

    def _doubts(self, keys: Iterable[Quantity]) -> Iterator[Quantity]:
        """What tells where quantities cannot be had, or not from the tape."""
        forces = False
        for key in keys:
            yield from self._closed(key)
            forces = forces or key.is_force
            if key.is_force or key.order:
                yield from (Regularity(g.name) for g in self.branch.plan.groups if g.kind == "Newton")
        if forces:
            yield from (Margin(g.name) for g in self.branch.plan.groups if g.kind not in ("Newton", "PRP"))

    def _closed(self, key: Quantity) -> list[Quantity]:
        """What tells where the groups that a quantity depends on are not assembled."""
        return [Closed((group,)) for group in key.groups(self.recording)] if self.branch.may_open else []

    def _where_bad(self, key: Quantity, found: Any) -> NDArray[np.bool_] | None:
        """The poses that a doubt is right about; None where it is right about none."""
        if isinstance(key, Closed):
            bad = ~np.isfinite(found)
        else:
            bad = np.abs(found) < (NEAR if isinstance(key, Margin) else SINGULAR)
        return np.broadcast_to(bad, self.n) if np.any(bad) else None

    @cached_property
    def _nowhere(self) -> NDArray[np.bool_] | None:
        """The poses whose input is no number; None where there are none."""
        finite = np.isfinite(self.inputs)
        return None if finite.all() else np.asarray(~finite.all(axis=1))

    @cached_property
    def _careful(self) -> NDArray[np.bool_]:
        """The poses close to a change point."""
        return self.branch.close_to_change(self.inputs[:, 0])

    def entering(self, inputs: Iterable[str]) -> dict[str, Any]:
        """The inputs of a tape, by their names."""
        result: dict[str, Any] = {}
        for name in inputs:
            kind, _, of = name.partition(" ")
            if not of:
                j = int(name[1:])
                value = self.inputs[:, j] if name[0] == "q" else self.rates[NAMES.index(name[0]) - 1][j]
                result[name] = value
            elif kind == "sign":
                result[name] = np.asarray(self.branch.sign(of, self.inputs[:, 0]), dtype=float)
            elif kind == "x":
                result[name] = self._unknown(*of.rsplit(" ", 1))
            elif kind == "table":
                number, part = of.split()
                force = self._table(int(number))
                result[name] = force.real if part == "x" else force.imag
            elif of.startswith("spring "):
                result[name] = self.twist(int(of.removeprefix("spring ")))
            else:
                result[name] = self._angle(of)
        if self.n == 1:
            result = {name: float(np.ravel(value)[0]) for name, value in result.items()}
        return result

    def _unknown(self, group: str, i: str) -> Reals:
        """An unknown of a group without a closed form, from its own iteration."""
        of = next(g for g in self.branch.plan.groups if g.name == group)
        self.solve(self.branch.plan.writes(of), 0)
        return self.over(lambda _, st: unknowns(of, st)[int(i)])  # type: ignore[no-any-return]

    def _angle(self, body: str) -> Reals:
        """A body's angle with its whole turns."""
        self.solve((f"angle:{body}",), 0)
        return self.over(lambda _, st: st.angle[body])  # type: ignore[no-any-return]

    def twist(self, number: int) -> Reals:
        """A torsion spring's twist with its whole turns, (n,)."""
        from virtualwork.formulas.scene import Scene

        spring = self.branch.mechanism.torsion_springs[number]
        setting = Scene(self).setting
        self.solve(tuple(f"angle:{body}" for body in spring.links if body != "ground"), 0)
        return self.over(lambda _, st: setting.twist(st, spring))  # type: ignore[no-any-return]

    def _table(self, number: int) -> Any:
        """What a table gives."""
        table = self.recording.tables[number]
        return table.over(self.place(table), True)

    def place(self, table: Tabled) -> Reals:
        """What a table is over."""
        if table.axis == "input":
            return self.inputs[:, 0]
        if table.axis == "time":
            return np.asarray(table.timed(self.time))
        if table.axis == "speed":
            return self.angle(table.body, 1)
        known = self.branch.plan.angles[table.body]
        if not known.by_inputs:
            return np.asarray(table.in_turn(self.angle(table.body)))
        return np.asarray(known.const + sum(c * self.inputs[:, j] for j, c in known.inputs))


def over_blocks(poses: Poses, key: Quantity, forces: Dynamics | None = None) -> Any:
    """A quantity worked out over blocks of poses, (n,)."""
    if isinstance(key, Force):
        return key.read(forces or _dynamics_of(poses))
    return poses.by_blocks((key,))[0]


def _dynamics_of(poses: Poses) -> Dynamics:
    # a dozen files: positions and rates do not load them
    from virtualwork.formulas.dynamics import Dynamics

    return Dynamics(poses, taped=False)


def recorded(branch: Turning, moves: tuple[bool, ...]) -> Recording:
    """The formulas of a branch, written down once for rates that are zero or not."""
    key = moves, branch.turning_over
    with branch.lock:
        if key not in branch.recordings:
            branch.recordings[key] = Recording(
                branch.mechanism, branch.plan, branch.signs, moves, branch.turning_over, branch.geared
            )
    result: Recording = branch.recordings[key]
    return result


def taped(branch: Turning, recording: Recording, keys: tuple[Quantity, ...]) -> Tape:
    """The tape of quantities, pruned once."""
    key = recording, keys
    with branch.lock:
        if key not in branch.recordings:
            branch.recordings[key] = recording.tape(keys)
    result: Tape = branch.recordings[key]
    return result


def _cut(
    branch: Turning, recording: Recording, keys: tuple[Quantity, ...], known: frozenset[int] | None
) -> Later:
    """The tape of quantities, from what is known on; None where nothing is, nor to be left."""
    if known is None:
        return Later(taped(branch, recording, keys), {}, {})
    with branch.lock:
        made = branch.recordings.setdefault("later", {})
        key = recording, keys, known
        if key not in made:
            if len(made) >= MANY:
                del made[next(iter(made))]
            made[key] = later(recording, keys, known)
        result: Later = made[key]
        return result


def ready(branch: Turning, moves: tuple[bool, ...], keys: tuple[Quantity, ...]) -> Ready | None:
    """Quantities of one pose as a function of floats; None where they depend on more than the input and its rates.

    Such a mechanism has one input that turns, no change point, no limit, and a closed form for every group.
    """
    recordings = branch.recordings
    name = "ready", moves, keys
    if name not in recordings:
        with branch.lock:
            recordings[name] = _made(branch, moves, keys)
    result: Ready | None = recordings[name]
    return result


def _made(branch: Turning, moves: tuple[bool, ...], keys: tuple[Quantity, ...]) -> Ready | None:
    poses = Lanes(branch)
    if poses.inputs.shape[1] > 1 or not (branch.settled and poses.takes(keys)) or branch.may_open:
        return None
    tape = taped(branch, recorded(branch, moves), keys)
    arguments = tuple(f"{name}0" for name in NAMES)
    if not floats.takes(tape) or not set(tape.inputs) <= set(arguments):
        return None
    return floats.compiled(tape, among=arguments, vectors=tuple(len(key.names) == 2 for key in keys))
