"""A self-contained part of a family: some variants over given inputs, solved on the tape together or one by one.

On the tape a lane is one variant in one pose. Variants whose branch is not decided by a comparison at the guess, and by nodes that
go on from there where groups have no closed form, are described one by one; so are mechanisms whose gears count whole turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.engines import Outputs, run_grid
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import MechanismError
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, by_path, changed
from virtualwork.family.branches import at_guess, chosen, followed, stays_within, with_signs
from virtualwork.family.friction import friction_of
from virtualwork.family.varied_formulas import VariedFormulas
from virtualwork.formulas.forces import Force
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.loops import Closed, Twist
from virtualwork.formulas.numbers import Number, Reals, leave_out
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.recording import NAMES


class Assembled(Quantity, kind="assembled"):
    """0 where a pose is assembled."""


ASSEMBLED = Assembled()
Mask = NDArray[np.bool_]
RATES = ("speed", "acceleration", "jerk")
# rad: a torsion spring that is twisted by no more all along its way counts no whole turns
HALF = 2.6
# lanes of a part: what is got ready for each is little beside them
LANES = 1 << 19
# variants described one by one whose poses are kept for the next question
KEPT = 500


@dataclass(frozen=True, eq=False)
class Part:
    """Variants and the inputs of their poses: everything that a worker needs.

    Attributes
    ----------
    mechanism : Description
    dimensions : tuple of Dimension
    values : array (v, d)
    inputs : array (v or 1, n, k)
    rates : speed, acceleration, jerk of each input
        A number, or an array that broadcasts to (v, n).
    time : array (v, n), optional
        s, where the poses are those of motions in time.
    held : array (c, v, n), optional
        The friction of each contact where joints of such motions stick, else NaN.
    """

    mechanism: Description
    dimensions: tuple[Dimension, ...]
    values: Reals
    inputs: Reals
    rates: list[list[Number]]
    time: Reals | None = None
    held: Reals | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """Variants and poses."""
        return len(self.values), self.inputs.shape[1]

    def some(self, rows: slice) -> Part:
        """A part of the variants."""

        def of(x: Number) -> Number:
            return x[rows] if np.ndim(x) and len(x) > 1 else x

        rates = [[of(rate) for rate in order] for order in self.rates]
        time, held = (
            None if self.time is None else self.time[rows],
            None if self.held is None else self.held[:, rows],
        )
        return replace(
            self, values=self.values[rows], inputs=of(self.inputs), rates=rates, time=time, held=held
        )

    def described(self, i: int) -> Description:
        """The i-th variant."""
        return changed(self.mechanism, by_path(self.dimensions, self.values[i].tolist()))

    def poses(self, i: int) -> Lanes:
        """The i-th variant, put together alone.

        Raises
        ------
        MechanismError
        """
        one = self.some(slice(i, i + 1))
        q = one.inputs[0]
        assembly = Assembly.from_guess(self.described(i))
        result = Lanes(assembly, q if q.shape[1] > 1 else q[:, 0], 0.0, 0.0, 0.0)
        result.rates = [
            [float(np.ravel(r)[0]) if np.size(r) == 1 else np.broadcast_to(r, (1, len(q)))[0] for r in order]
            for order in one.rates
        ]
        result.time = None if one.time is None else one.time[0]
        result.held = None if one.held is None else one.held[:, 0]
        return result


class Solver:
    """The motion of the variants of a part.

    Attributes
    ----------
    reasons : dict of a variant's place to why it cannot be put together
    """

    def __init__(self, part: Part, like: Solver | None = None) -> None:
        self.part = part
        if like is not None:
            # another part of the same variants: the same formulas, unless these move where those do not
            self.assembly = like.assembly
            if all(theirs or not mine for mine, theirs in zip(self.moves, like.moves, strict=True)):
                self.written, self.moves = like.written, like.moves
        self.reasons: dict[int, str] = {}
        self._poses: dict[int, Lanes | None] = {}
        self._frictions: dict[Any, Reals] = {}

    @cached_property
    def assembly(self) -> Assembly | None:
        """The assembly of the mechanism itself; None if its own dimensions cannot be assembled."""
        try:
            result = assembled(self.part.mechanism)
            _ = result.track
        except MechanismError:
            return None
        return result

    @cached_property
    def moves(self) -> tuple[bool, ...]:
        """Whether the inputs have a speed, an acceleration, a jerk: whether one that varies is zero depends on no variant."""
        varied = {d.where[-1] for d in self.part.dimensions if d.where[0] == "inputs"}
        rates = zip(RATES, self.part.rates, strict=True)
        return tuple(name in varied or any(np.any(rate) for rate in order) for name, order in rates)

    @cached_property
    def written(self) -> VariedFormulas | None:
        """The formulas with the dimensions as inputs; None where the branch is more than signs."""
        m = self.part.mechanism
        own = self.assembly
        if own is None or own.geared or own.folded:
            return None
        if m.guess.at is None and any(
            d.where[0] == "inputs" and d.where[-1] == "value" for d in self.part.dimensions
        ):
            return None
        fixed = tuple(d for d in self.part.dimensions if d.where[0] != "inputs")
        key = "family", fixed, self.moves
        if key not in own.recordings:
            own.recordings[key] = VariedFormulas(own, fixed, self.moves, own_signs=True)
        result: VariedFormulas = own.recordings[key]
        return None if result.open_gears or (result.iterated and not result.follows) else result

    @cached_property
    def _given(self) -> dict[str, Reals]:
        return {
            d.path: np.ascontiguousarray(self.part.values[:, i]) for i, d in enumerate(self.part.dimensions)
        }

    @cached_property
    def _chosen(self) -> tuple[dict[str, Reals], dict[str, Reals], Mask]:
        """The sign of each closed form, the unknowns of groups without one, and which variants are on the tape."""
        part, written, v = self.part, self.written, self.part.shape[0]
        if written is None or self.assembly is None:
            return {}, {}, np.zeros(v, dtype=bool)
        if written.iterated:
            return followed(written, self.assembly, self._given, v, part.inputs, *self._span)
        signs, together = chosen(written, part.mechanism, self._given, v, *self._span)
        return signs, {}, together

    @cached_property
    def _span(self) -> tuple[Reals, Reals]:
        """The least and the largest value of the one input of each variant, with that of the guess.

        (v,) each, or (1,) where all are requested the same.
        """
        at, q = self.part.mechanism.at[0], self.part.inputs[:, :, 0]
        low = np.minimum(np.nanmin(q, axis=1, initial=np.inf), at)
        high = np.maximum(np.nanmax(q, axis=1, initial=-np.inf), at)
        return low, high

    @property
    def signs(self) -> dict[str, Reals]:
        """The sign of each closed form of each variant, (v,), by the group's name."""
        return self._chosen[0]

    @property
    def together(self) -> Mask:
        """Which variants are on the tape, (v,)."""
        return self._chosen[-1]

    @cached_property
    def open_at_guess(self) -> Mask:
        """Which variants on the tape are not assembled at the input of the guess itself, (v,)."""
        if self.written is None or not self.written.closed or self.written.iterated:
            return np.zeros(self.part.shape[0], dtype=bool)
        margins = at_guess(self.written, self.part.mechanism, self._given, self.part.shape[0])
        return np.asarray(~np.logical_and.reduce([margin > 0 for margin in margins.values()]))

    def values(self, keys: Sequence[Quantity], out: Sequence[NDArray[Any]] | None = None) -> list[Any]:
        """Quantities, each (v, n); NaN where a pose is not assembled.

        `out`: where to write them, as `room` has it.
        """
        found, alone = self.lanes(keys, out)
        for place in np.flatnonzero(alone):
            self._one(int(place), keys, found)
        return found

    def lanes(
        self, keys: Sequence[Quantity], out: Sequence[NDArray[Any]] | None = None
    ) -> tuple[list[Any], Mask]:
        """The quantities of the variants that are on the tape; and which are not, (v,): of those they are NaN."""
        v, n = self.part.shape
        there = self._taken(keys) if self.takes(keys) else np.zeros(v, dtype=bool)
        alone = ~there
        result = list(room(keys, v, n) if out is None else out)
        each = max(1, LANES // max(n, 1))
        whole = bool(there.all())
        places = np.arange(0) if whole else np.flatnonzero(there)
        for i in range(0, v if whole else len(places), each):
            rows = slice(i, min(i + each, v)) if whole else places[i : i + each]
            alone[self._on_tape(keys, rows, result)] = True
        if not whole or alone.any():
            for to in result:
                leave_out(to, alone)
        return result, alone

    def takes(self, keys: Sequence[Quantity]) -> bool:
        """Whether the tape has such quantities: redundant statics and twists are of each variant."""
        m, written = self.part.mechanism, self.written
        if written is None:
            return False
        if all(not key.is_force for key in keys):
            return True
        if any(table.axis != "input" for table in written.recording.tables):
            # what a table gives is known beforehand where it is over the input
            return False
        if self.part.held is not None:
            return False
        if m.friction:
            # where nothing moves, each has a warning
            of = written.recording.forces
            return bool(of.case.contacts) and not of.redundant
        return written.recording.takes(keys)

    def _taken(self, keys: Sequence[Quantity]) -> Mask:
        """Which variants have quantities on the tape: of forces those whose torsion springs count no whole turns."""
        if any(key.is_force for key in keys):
            return self.together & self._unwound
        return self.together

    @cached_property
    def _unwound(self) -> Mask:
        """Which variants' torsion springs stay within half a turn of free all the way, (v,)."""
        v, m = self.part.shape[0], self.part.mechanism
        result = np.ones(v, dtype=bool)
        if self.written is None:
            return result
        if len(m.inputs) > 1 or self.written.iterated:
            # each counts along lines of its own
            fixed = (self.written.plan.angles[body].by_inputs for s in m.torsion_springs for body in s.links)
            return np.full(v, all(fixed))
        low, high = self._span
        for number in range(len(m.torsion_springs)):
            known = with_signs(self._given, self.signs)
            result &= stays_within(self.written, m, known, Twist(number), HALF, v, low, high)
        return result

    def _on_tape(
        self, keys: Sequence[Quantity], rows: NDArray[np.intp] | slice, out: list[Any]
    ) -> NDArray[np.intp]:
        """Work out some variants on the tape; and which of all are better described alone."""
        assert self.written is not None
        v, n = len(self.part.values[rows]), self.part.shape[1]
        requested = list(dict.fromkeys(key for key in keys if key != ASSEMBLED))
        tape = self.written.tested(requested, [ASSEMBLED] if ASSEMBLED in keys else [])
        # straight to their place where that is in one piece
        together = isinstance(rows, slice)
        to = [x[rows] for x in out] if together else room(keys, v, n)
        first = dict(zip(reversed(keys), reversed(to), strict=True))
        rows_of = [part for key in requested for part in parts(first[key])]
        sound = np.empty(v, dtype=bool)
        run_grid(tape, {name: self._entering(name, rows) for name in tape.inputs}, (v, n), [*rows_of, sound])
        for key, x in zip(keys, to, strict=True):
            if key == ASSEMBLED:
                x[:] = 0.0
            elif x is not first[key]:
                x[:] = first[key]
        self._leave_out_locked(keys, to, rows)
        near = np.arange(0)
        if not sound.all():
            unsound = np.flatnonzero(~sound)
            of = unsound + rows.start if isinstance(rows, slice) else rows[unsound]
            values, close = self._with_gaps(keys, of)
            near = of[close]
            for x, value in zip(to, values, strict=True):
                x[unsound] = value
        if not together:
            for x, value in zip(out, to, strict=True):
                x[rows] = value
        return near

    def _with_gaps(self, keys: Sequence[Quantity], rows: NDArray[np.intp]) -> tuple[list[Any], Mask]:
        """Return the variants on the tape with a pose that is not assembled, and those of them that are better described alone."""
        assert self.written is not None
        v, n = len(rows), self.part.shape[1]
        written = self.written
        closed = {key: Closed(key.groups(written.recording)) for key in keys}
        doubts = written.doubts(keys)
        requested = [key for key in keys if key != ASSEMBLED]
        whole = list(dict.fromkeys(closed.values()))
        tape = written.tape((*requested, *whole, *doubts))
        table = run_grid(tape, {name: self._entering(name, rows) for name in tape.inputs}, (v, n))
        outputs = Outputs(tape, np.reshape(table, (-1, v * n)))
        lanes = {key: key.of_rows(outputs, v * n).reshape(v, n) for key in (*requested, *whole, *doubts)}
        near = np.zeros(v, dtype=bool)
        for key, least in doubts.items():
            near |= (np.abs(lanes[key]) < least).any(axis=1)
        gaps = {key: ~np.isfinite(lanes[key]) for key in whole}
        values = [np.zeros((v, n)) if key == ASSEMBLED else lanes[key] for key in keys]
        for key, here in zip(keys, values, strict=True):
            if gaps[closed[key]].any():
                leave_out(here, gaps[closed[key]])
        self._leave_out_locked(keys, values, rows)
        return values, near

    def _leave_out_locked(
        self, keys: Sequence[Quantity], values: Sequence[Any], rows: NDArray[np.intp] | slice
    ) -> None:
        """Leave out the forces of poses that friction locks."""
        rubbed = [x for key, x in zip(keys, values, strict=True) if isinstance(key, Force) and key.is_rubbed]
        if rubbed and self.part.mechanism.friction:
            locked = np.asarray(np.isnan(self._friction(rows)).any(axis=0))
            for x in rubbed if locked.any() else ():
                leave_out(x, locked)

    def _friction(self, rows: NDArray[np.intp] | slice) -> Reals:
        """The friction of each contact of some variants on the tape, (c, v, n); NaN where the joints lock."""
        name = rows.indices(self.part.shape[0]) if isinstance(rows, slice) else rows.tobytes()
        if name not in self._frictions:
            assert self.written is not None
            shape = len(self.part.values[rows]), self.part.shape[1]
            enter = partial(self._entering, rows=rows)
            self._frictions[name] = friction_of(self.written, enter, shape)
        return self._frictions[name]

    def _entering(self, name: str, rows: NDArray[np.intp] | slice) -> Any:
        """An input of the tape for some variants: a number, or what broadcasts to (v, n)."""
        kind, _, group = name.partition(" ")
        if group and kind == "sign":
            sign = self.signs[group][rows]
            return float(sign[0]) if (sign == sign[0]).all() else sign[:, None]
        if name in self._given:
            return self._given[name][rows, None]
        if kind == "friction":
            return self._friction(rows)[int(group)]
        if kind == "x":
            of, i = group.rsplit(" ", 1)
            return self._chosen[1][of][rows, :, int(i)]
        if kind == "near":
            # a torsion spring that counts no whole turns
            return 0.0
        if kind == "table":
            number, part = group.split()
            assert self.written is not None
            table = self.written.recording.tables[int(number)]
            q = self.part.inputs[:, :, 0]
            force = np.asarray(table.over(q.ravel())).reshape(q.shape)
            value = force.real if part == "x" else force.imag
            return value[rows] if len(value) > 1 else value
        j = int(name[1:])
        value = self.part.inputs[:, :, j] if name[0] == "q" else self.part.rates[NAMES.index(name[0]) - 1][j]
        # what is the same in all lanes is computed once
        if np.size(value) == 1:
            return float(np.ravel(value)[0])
        return value[rows] if len(value) > 1 else value

    def _one(self, i: int, keys: Sequence[Quantity], out: list[Any]) -> None:
        """Describe one variant alone."""
        if i not in self._poses or self._poses[i] is None:
            try:
                poses: Lanes | None = None if i in self.reasons else self.part.poses(i)
            except MechanismError as error:
                poses = None
                self.reasons[i] = str(error)
            if len(self._poses) >= KEPT:
                self._poses.clear()
            self._poses[i] = poses
        poses = self._poses[i]
        if poses is not None:
            requested = [key for key in keys if key != ASSEMBLED]
            with np.errstate(all="ignore"):
                found = dict(zip(requested, poses.values(requested), strict=True))
                for key, values in zip(keys, out, strict=True):
                    values[i] = np.where(poses.assembled, 0.0, np.nan) if key == ASSEMBLED else found[key]


def room(keys: Sequence[Quantity], v: int, n: int) -> list[NDArray[Any]]:
    """Arrays (v, n) for quantities, real or complex."""
    return [np.empty((v, n), complex if key.is_vector else float) for key in keys]


def parts(x: NDArray[Any]) -> list[Reals]:
    """The real and the imaginary part of complex numbers, or real numbers as they are."""
    return [x.real, x.imag] if np.iscomplexobj(x) else [x]


# of the mechanisms that a process keeps
_lock = Lock()
_assembled: dict[int, Assembly] = {}
# mechanisms of which a process keeps what it has written down
MECHANISMS = 8


def assembled(mechanism: Description) -> Assembly:
    """A mechanism put together once, with what has been written down of it.

    Raises
    ------
    MechanismError
    """
    with _lock:
        result = _assembled.get(id(mechanism))
        if result is None or result.mechanism is not mechanism:
            while len(_assembled) >= MECHANISMS:
                _assembled.pop(next(iter(_assembled)), None)
            result = _assembled[id(mechanism)] = Assembly.from_guess(mechanism)
        return result
