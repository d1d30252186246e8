"""What tapes of poses need from outside, and the poses whose derivatives enter a tape.

Unknowns of groups without a closed form, friction and redundant statics enter (`entering`). Close to a change point, where two
branches meet, and at singular poses the groups' derivatives enter too (`formulas.recording`): a series carries them through.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.engines import Outputs, run
from dalembert.arithmetic.guard import guarded
from virtualwork.formulas.forces import Bearing, Effort, Entry
from virtualwork.formulas.group_loops import unknowns
from virtualwork.formulas.kinematics import AnglePartial
from virtualwork.formulas.loops import Closed, Margin, Regularity
from virtualwork.formulas.numbers import (
    FAST,
    SINGULAR,
    Complexes,
    Reals,
    cross,
    determined,
    solve_columns,
)
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.rates import crossed, passed
from virtualwork.formulas.recording import NAMES, NEAR, GroupColumn, Recording, RightSide
from virtualwork.formulas.tapes import entered, recorded, taped
from virtualwork.plan.steps import Group

if TYPE_CHECKING:
    from virtualwork.formulas.loads import Tabled
    from virtualwork.formulas.statics import Statics


def is_closed(doubt: Quantity) -> bool:
    """Whether a doubt is about the assembly of a group, not about a singular one."""
    return isinstance(doubt, Closed)


@guarded
class Solving(Poses):
    """Poses of an assembly, with what their tapes need."""

    def _begin(self) -> None:
        super()._begin()
        # where doubts are right
        self._bad: dict[Quantity, NDArray[np.bool_] | None] = {}
        # whether the derivatives of groups enter; and those, with the unknowns
        self._enter = False
        self._entered: dict[tuple[Any, ...], Any] = {}
        # some of the poses, whose derivatives enter
        self._apart: dict[bytes, Self] = {}

    @cached_property
    def recording(self) -> Recording:
        """The formulas of the branch, for rates that are zero where these are."""
        return entered(self.branch, self.moves) if self.enters else recorded(self.branch, self.moves)

    @cached_property
    def enters(self) -> bool:
        """Whether the derivatives of groups enter: of poses close to a change point, and where a group is singular in every pose."""
        if not self.branch.settled:
            self.cover()
        return self._enter or bool(self.branch.folded)

    def _apart_of(self, doubts: Sequence[Quantity]) -> tuple[NDArray[np.bool_], Self] | None:
        """The poses whose derivatives enter, by what tells where groups are singular: which, and these alone; None where there are none."""
        if self.enters:
            return None
        new = [key for key in doubts if key not in self._bad]
        self._bad |= {
            key: self._where_bad(key, value) for key, value in zip(new, self._raw(new), strict=True)
        }
        rows = self._careful
        for bad in map(self._bad.get, doubts):
            rows = bad if rows is None else rows if bad is None else rows | bad
        if rows is None:
            return None
        name = rows.tobytes()
        if name not in self._apart:
            self._apart[name] = self.some(rows)
            self._apart[name]._enter = True
        return rows, self._apart[name]

    def _singular(self, keys: Sequence[Quantity]) -> list[Quantity]:
        """What tells where a group is singular that quantities depend on."""
        return [key for key in self._doubts(tuple(keys)) if not is_closed(key)]

    def _raw(self, keys: Sequence[Quantity], friction: Reals | None = None) -> list[Any]:
        """Quantities as the tape has them, with another friction; not kept."""
        if not keys:
            return []
        tape = taped(self.branch, self.recording, tuple(keys))
        out: Outputs = run(
            tape,
            self.entering(tape.inputs, friction),
            pairs=[key.names[0] for key in keys if key.is_vector],
        )
        return [key.of_rows(out, self.n) for key in keys]

    def _too_fast(self, j: int) -> NDArray[np.bool_]:
        """Where a link turns too fast beside the input for a force to have a number."""
        reach = self.mechanism.size if self.mechanism.inputs[j].is_slide else 1.0
        needed = self.plan.needed(self.recording.forces.case.targets()[0])
        bodies = (body for g in needed if isinstance(g, Group) for body in g.angles)
        keys = [AnglePartial(body, j, 1) for body in bodies]
        result = np.zeros(self.n, dtype=bool)
        for rate in self._raw(keys):
            result |= ~(np.abs(rate) * reach < FAST)
        return result

    # --- what is solved outside ---------------------------------------------------------------------------------------
    @cached_property
    def _settled(self) -> tuple[Reals, int]:
        """The friction of each contact (c, n), NaN where the joints lock; and how often it was exchanged for the forces."""
        from virtualwork.formulas.friction import read, settled, written

        recording = self.recording
        c, doubts = len(recording.forces.case.contacts), self._singular([Effort(0)])
        if not c:
            return np.zeros((0, self.n)), 0
        with recording.lock:
            tape = recording.rubbing = recording.rubbing or written(recording, doubts)
        keys = [Bearing(k) for k in range(c)]

        def bears(friction: Reals) -> Complexes:
            return np.reshape(self._raw(keys, friction), (c, self.n))

        rows = run(tape, self.entering(tape.inputs))
        self._doubted(doubts, rows)
        arms, free, per = read(rows, c, self.n, bears)
        apart = self._apart_of(doubts)
        if apart is not None:
            arms[:, apart[0]] = np.nan
        friction, count = settled(arms, free, per, bears)
        if apart is not None:
            friction[:, apart[0]], more = apart[1]._settled
            count = max(count, more)
        holding = self.holding
        return np.where(np.isnan(holding), friction, holding), count

    @property
    def friction(self) -> Reals:
        """The friction of each contact, (c, n): the torque of a pin, the force along a guide; NaN where the joints lock."""
        return self._settled[0]

    @property
    def friction_iterations(self) -> int:
        """How often friction and joint forces were exchanged until they agreed."""
        return self._settled[1]

    @cached_property
    def locked(self) -> NDArray[np.bool_]:
        """(n,): poses in which friction locks the mechanism: no reaction balances its own friction."""
        nowhere = np.isnan(self.friction).any(axis=0)
        return np.asarray(nowhere & self.assembled if nowhere.any() else nowhere)

    @cached_property
    def statics(self) -> Statics:
        """All equilibrium equations at once, where the constraints are redundant."""
        return self._statics()

    def _statics(self, friction: Reals | None = None) -> Statics:
        from virtualwork.formulas.statics import Statics

        forces = self.recording.forces
        keys = [Entry(*place) for place in forces.system]
        entries = dict(zip(forces.system, self._raw(keys, friction), strict=True))
        apart = self._apart_of(self._singular(keys)) if friction is None else None
        if apart is not None:
            for value, again in zip(entries.values(), apart[1]._raw(keys), strict=True):
                value[apart[0]] = again
        return Statics(forces.order, entries, self.n, self.lock)

    def _doubts(self, keys: tuple[Quantity, ...]) -> tuple[Quantity, ...]:
        """The quantities that show where others have no value, or none from the tape."""
        # only the inputs show which loops open
        enters, recording = self.enters, self.recording
        name = keys, self.branch.may_open
        if name not in recording.doubts:
            recording.doubts[name] = tuple(dict.fromkeys(self._each_doubt(*name, enters)))
        return recording.doubts[name]

    def _each_doubt(self, keys: tuple[Quantity, ...], opens: bool, enters: bool) -> Iterator[Quantity]:
        groups, forces = self.branch.plan.groups, any(key.is_force for key in keys)
        for key in keys if opens else ():
            yield from self._closed(key)
        if not enters and (forces or any(key.order for key in keys)):
            yield from (Regularity(g.name) for g in groups if g.kind == "Newton")
        if not enters and forces:
            yield from (Margin(g.name) for g in groups if g.kind not in ("Newton", "PRP"))

    def _closed(self, key: Quantity) -> list[Quantity]:
        """What tells where the groups that a quantity depends on are not assembled."""
        return [Closed((group,)) for group in key.groups(self.recording)]

    def _doubted(self, doubts: Iterable[Quantity], rows: Outputs) -> None:
        """Note where doubts are right, by a run that has them."""
        for key in doubts:
            if key not in self._bad:
                self._bad[key] = self._where_bad(key, key.of_rows(rows, self.n))

    def _where_bad(self, key: Quantity, values: Any) -> NDArray[np.bool_] | None:
        """The poses that a doubt is right about; None where it is right about none."""
        if is_closed(key):
            bad = ~np.isfinite(values)
        else:
            least = NEAR if isinstance(key, Margin) else SINGULAR
            # mostly of no pose: that takes one pass
            if np.size(values) and np.min(values) >= least:
                return None
            bad = np.abs(values) < least
        return np.broadcast_to(bad, self.n) if np.any(bad) else None

    @cached_property
    def _nowhere(self) -> NDArray[np.bool_] | None:
        """The poses whose input is no number; None where there are none."""
        # the sum of squares is finite where all of them are; else each is looked at
        with np.errstate(over="ignore"):
            if np.isfinite(np.vdot(self.inputs, self.inputs)):
                return None
        finite = np.isfinite(self.inputs)
        return None if finite.all() else np.asarray(~finite.all(axis=1))

    @cached_property
    def _careful(self) -> NDArray[np.bool_] | None:
        """The poses close to a change point; None where there are none."""
        close = self.branch.close_to_change(self.inputs[:, 0]) if self.branch.change_points else None
        return close if close is not None and close.any() else None

    def entering(self, inputs: Iterable[str], friction: Reals | None = None) -> dict[str, Any]:
        """The inputs of a tape, by their names; the friction (c, n) where it is not that of the poses."""
        statics: Statics | None = None
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
                group, i = of.rsplit(" ", 1)
                result[name] = self._unknowns(group)[int(i)]
            elif kind == "rate":
                group, i, order, way = of.rsplit(" ", 3)
                result[name] = self._derivatives(group, int(order), int(way))[int(i)]
            elif kind == "friction":
                result[name] = (self.friction if friction is None else friction)[int(of)]
            elif kind == "f":
                statics = statics or (self.statics if friction is None else self._statics(friction))
                result[name] = statics.solved[0][:, int(of)]
            elif kind == "time":
                result[name] = self.time
            elif kind in ("table", "slope"):
                number, part = of.split()
                force = self._table(int(number), kind)
                result[name] = force.real if part == "x" else force.imag
            elif of.startswith("spring "):
                result[name] = self.twist(int(of.removeprefix("spring ")))
            else:
                result[name] = self._angle(of)
        if self.n == 1:
            result = {name: float(np.ravel(value)[0]) for name, value in result.items()}
        return result

    def _unknowns(self, group: str) -> list[Reals]:
        """The unknowns of a group that enters, from its own branch."""
        name = (group,)
        if name not in self._entered:
            of = next(g for g in self.branch.plan.groups if g.name == group)
            self.solve(self.branch.plan.writes(of))
            each = range(len(of.angles) + len(of.slides))
            self._entered[name] = [
                self.join([unknowns(of, st)[i] for st in self.states()], float) for i in each
            ]
        return self._entered[name]  # type: ignore[no-any-return]

    def _derivatives(self, group: str, order: int, way: int) -> list[Any]:
        """The derivatives of the unknowns of a group that enters, (n,) each: over an input, or in time (`entering`)."""
        name = group, order, way
        if name not in self._entered:
            of = next(g for g in self.branch.plan.groups if g.name == group)
            loops, each = range(len(of.closures)), range(len(of.angles) + len(of.slides))
            keys: list[Quantity] = [GroupColumn(group, loop, i) for loop in loops for i in each]
            keys += [RightSide(group, loop, way, order) for loop in loops]
            values = self._raw(keys)
            cols = [values[loop * len(each) : (loop + 1) * len(each)] for loop in loops]
            right = values[len(loops) * len(each) :]
            with np.errstate(all="ignore"):
                if group in self.branch.folded:
                    rates = solve_columns(cols, right, determined)
                elif of.kind == "Newton":
                    rates = solve_columns(cols, right)
                else:
                    rates = crossed(cols[0], right[0], 1 / cross(*cols[0]))
                if group not in self.branch.folded:
                    rates = passed(self.branch.passage, of, self.inputs[:, 0], cols, order, rates)
            self._entered[name] = rates
        return self._entered[name]  # type: ignore[no-any-return]

    def _angle(self, body: str) -> Reals:
        """A body's angle with its whole turns."""
        self.solve((f"angle:{body}",))
        return self.over(lambda st: st.angle[body])  # type: ignore[no-any-return]

    def twist(self, number: int) -> Reals:
        """A torsion spring's twist with its whole turns, (n,)."""
        from virtualwork.formulas.loaded_pose import Setting

        spring = self.branch.mechanism.torsion_springs[number]
        setting = Setting(self)
        self.solve(tuple(f"angle:{body}" for body in spring.links if body != "ground"))
        return self.over(lambda st: setting.twist(st, spring))  # type: ignore[no-any-return]

    def _table(self, number: int, kind: str) -> Any:
        """What a table gives, or how steep it is."""
        table = self.recording.tables[number]
        place = self.place(table)
        return table.over(place) if kind == "table" else table.slope(place)

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
