"""The equations of motion of an assembly in its inputs, M(q)·q̈ + h(q, q̇, t) = 0, on a tape.

The effort at the inputs by virtual work is linear in their accelerations: with no effort given, it is M·q̈ + h. M is
its derivative to the accelerations (one sweep backwards over the tape), h its value without them. Loops are closed at
every evaluation, so that nothing drifts.

What a tape cannot decide enters it as a number: the sign of a closed form at the pose, the whole turns of a spring,
what a table says. Where a tape cannot go, near change points and with groups that have no closed form, the poses'
own formulas give M and h from k + 1 motions at once.
"""

from __future__ import annotations

import cmath
import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from dalembert.arithmetic.adjoint import derivatives
from dalembert.arithmetic.engines import floats, run
from dalembert.arithmetic.recorded import RECORDED, Number, rotation
from dalembert.arithmetic.systems import solved
from dalembert.arithmetic.tape import Tape
from virtualwork.branch.assembly import Assembly
from virtualwork.describe.errors import MechanismError
from virtualwork.formulas.block import Block, Setting
from virtualwork.formulas.effort import effort
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.loads import Load, Tabled
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.positions import State
from virtualwork.formulas.recording import Recording
from virtualwork.formulas.scene import Scene
from virtualwork.intime.watch import Floats, Watch

# of a turn: how far beyond an input its change points are looked for
AHEAD = 1.0
TURN = 2 * math.pi
# of a table's span: how far beyond its ends it is read
EDGE = 1e-9
Value = Callable[[float, Floats, Floats], float]
Rate = Callable[[float, Floats, Floats, Floats], float]


class Lost(ArithmeticError):
    """No acceleration at a state: it cannot be assembled, or lies outside a table."""


class Equations:
    """The motion of one assembly under its loads.

    Attributes
    ----------
    k : int
        Degrees of freedom.
    scale : list of float
        What an error of each input is relative to: 1 rad, or the mechanism's size.
    """

    def __init__(self, assembly: Assembly) -> None:
        self.assembly, self.mechanism = assembly, assembly.mechanism
        self.k = len(self.mechanism.inputs)
        self.scale = [self.mechanism.size if e.is_slide else 1.0 for e in self.mechanism.inputs]
        self.warnings: list[str] = []
        self._covered = (math.inf, -math.inf)
        self._flips: dict[str, list[float]] = {}
        self._near: list[tuple[float, float]] = []
        self._cover(self.mechanism.at[0])

    def __call__(self, t: float, q: Floats, v: Floats) -> Floats:
        """The accelerations at a state, and the power of what stores nothing.

        Raises
        ------
        Lost
            Where there are none.
        """
        if not self._covered[0] <= q[0] <= self._covered[1]:
            self._cover(q[0])
        if self._careful(q[0]):
            found = self.many(np.array([t]), np.array([q]), np.array([v]))[0].tolist()
        else:
            try:
                found = self._function(*self._filled(t, q, v))
            except (ZeroDivisionError, ValueError, OverflowError):
                raise Lost from None
        for value in found:
            # NaN and infinity
            if value - value != 0.0:
                raise Lost
        return list(found)

    def refuse(self, t: float, q: Floats, v: Floats) -> None:
        """Refuse a start from which nothing can be followed.

        Raises
        ------
        MechanismError
            Not assembled there, or an input on which no mass moves; which, and what is missing.
        """
        names = [e.name for e in self.mechanism.inputs]
        mass, rest, *_ = self.by_poses(np.array([t]), np.array([q]), np.array([v]))
        if not (np.isfinite(mass).all() and np.isfinite(rest).all()):
            raise MechanismError("it cannot be assembled at the start, or stands at a limit of its input")
        # how much of each input's own inertia is left when the others are free to follow
        whole = np.linalg.eigvalsh(mass[0] * np.outer(self.scale, self.scale))
        if not mass[0].any() or whole[0] <= 1e-14 * whole[-1]:
            least = names[int(np.argmin(np.diag(mass[0]) * np.square(self.scale)))]
            raise MechanismError(
                f"no mass moves with input '{least}': its acceleration is not determined; "
                "expected a mass or an inertia on a link that it moves"
            )

    def many(self, t: Reals, q: Reals, v: Reals) -> Reals:
        """The same of many states, (n, k + 1); NaN where there are none."""
        out = np.full((len(q), self.k + 1), np.nan)
        if not len(q):
            return out
        for end in (float(q[:, 0].min()), float(q[:, 0].max())):
            self._cover(end)
        careful = np.array([self._careful(x) for x in q[:, 0].tolist()])
        rows = np.flatnonzero(~careful)
        if len(rows):
            found = self._run(self._tape, t, q, v, rows)
            for j, name in enumerate(self._tape.names):
                out[rows, j] = found[name]
        rows = np.flatnonzero(careful)
        if len(rows):
            mass, rest, power, _ = self.by_poses(t[rows], q[rows], v[rows])
            good = np.isfinite(mass).all(axis=(1, 2)) & np.isfinite(rest).all(axis=1)
            out[rows[good], : self.k] = np.linalg.solve(mass[good], -rest[good, :, None])[..., 0]
            out[rows[good], self.k] = power[good]
        return out

    def by_poses(self, t: Reals, q: Reals, v: Reals) -> tuple[Reals, Reals, Reals, Reals]:
        """M (n, k, k), h (n, k), the power of what stores nothing and the potential (n,), by the poses' own formulas.

        The effort of k + 1 motions through each pose gives M and h.
        """
        n, k = q.shape
        speeds = np.repeat(v, k + 1, axis=0)
        unit = np.tile(np.vstack([np.zeros(k), np.eye(k)]), (n, 1))
        with np.errstate(all="ignore"):
            poses = Poses(self.assembly, np.repeat(q, k + 1, axis=0), speeds, unit)
            poses.time = np.repeat(t, k + 1)
            scene = Scene(poses)
            found = effort(scene).reshape(n, k + 1, k)
            power, stored = np.zeros(n * (k + 1)), np.zeros(n * (k + 1))
            for block in scene.blocks():
                power[block.rows] = wasted(scene.loads, block, list(speeds[block.rows].T))
                stored[block.rows] = potential(scene.loads, block)
        mass = np.swapaxes(found[:, 1:] - found[:, :1], 1, 2)
        return mass, found[:, 0], power[:: k + 1], stored[:: k + 1]

    def watches(self) -> list[Watch]:
        """What a step must not pass: the kinks of tables over what hangs on the inputs alone."""
        found = []
        for number, load in enumerate(self._tables):
            of = self._linear(load)
            if of is not None and load.axis != "time":
                knots = [x for x, _ in load.table]
                period = knots[-1] - knots[0] if load.periodic else None
                found.append(Watch(f"table {number}", *of, knots[:-1] if period else knots, period))
        return found

    @cached_property
    def stops(self) -> list[float]:
        """Times that no step passes: the rows of tables."""
        return sorted({x for load in self._tables if load.axis == "time" for x, _ in load.table})

    def outside(self, t: float, q: Floats, v: Floats) -> str:
        """Which table ends at a state; empty where none does."""
        for load in self._tables:
            of, (first, last) = self._linear(load), (load.table[0][0], load.table[-1][0])
            if of is None or load.periodic:
                continue
            at, near = of[0](t, q, v), 1e-6 * (last - first)
            if not first + near < at < last - near:
                unit = {"time": "s", "speed": "rad/s"}.get(load.axis, "rad")
                return f"the table of the {load.kind} on {load.body} ends at {last if at > first + near else first:.6g} {unit}"
        return ""

    def _linear(self, load: Tabled) -> tuple[Value, Rate] | None:
        """What a table is over and its derivative, where it is a sum of inputs or of their speeds; None where not."""
        if load.axis == "time":
            return lambda t, q, v: t, lambda t, q, v, a: 1.0
        if load.axis == "input":
            return lambda t, q, v: q[0], lambda t, q, v, a: v[0]
        angle = self.assembly.plan.angles[load.body]
        if angle.bases:
            return None
        const, terms = angle.const, angle.inputs
        if load.axis == "angle":
            return (
                lambda t, q, v: const + sum(c * q[j] for j, c in terms),
                lambda t, q, v, a: sum(c * v[j] for j, c in terms),
            )
        return (
            lambda t, q, v: sum(c * v[j] for j, c in terms),
            lambda t, q, v, a: sum(c * a[j] for j, c in terms),
        )

    # --- the tape ---------------------------------------------------------------------------------------------
    @cached_property
    def _recorded(self) -> tuple[Tape, Tape]:
        """The tapes of accelerations and power, and of the energies."""
        a = self.assembly
        turning = {name for name, flips in a.track.flips.items() if len(flips)}
        recording = Recording(
            self.mechanism, a.plan, a.signs, (True, True, False), turning_over=turning, geared=a.geared
        )
        k, names = self.k, [f"effort {j}" for j in range(self.k)]
        motion = recording.tape([("effort", j) for j in range(k)])
        free = derivatives(motion, [f"a{j}" for j in range(k)])
        _, _, block = recording.forces
        again = recording.recorder
        inputs = {name: again.input(name) for name in motion.inputs}
        still = motion.on(inputs | {f"a{j}": 0.0 for j in range(k)}, RECORDED)
        slopes = free.on(inputs, RECORDED)
        mass = [[slopes[f"d({name})/d(a{j})"] for j in range(k)] for name in names]
        right = [-still[name] for name in names]
        found = [right[0] / mass[0][0]] if k == 1 else solved(mass, right)
        loads = recording.forces[0].case.loads
        speeds = [again.input(f"v{j}") for j in range(k)]
        kinetic: Number = 0.0
        for i in range(k):
            for j in range(k):
                kinetic = kinetic + 0.5 * (speeds[i] * mass[i][j] * speeds[j])
        outputs = {f"a{j}": value for j, value in enumerate(found)}
        return (
            again.tape(outputs | {"power": wasted(loads, block, speeds)}),
            again.tape({"energy": kinetic + potential(loads, block)}),
        )

    @cached_property
    def _tables(self) -> list[Tabled]:
        """The loads that tables give, in the order of the tape."""
        case = LoadCase(self.mechanism, self.assembly.plan, moves=True)
        return [load for load in case.loads if isinstance(load, Tabled)]

    @property
    def _tape(self) -> Tape:
        return self._recorded[0]

    @cached_property
    def _function(self) -> Callable[..., tuple[float, ...]]:
        return floats.compiled(self._tape)

    def energies(self, t: Reals, q: Reals, v: Reals) -> Reals:
        """Kinetic energy and that of gravity and springs together, (n,) J."""
        careful = np.array([self._careful(x) for x in q[:, 0].tolist()], dtype=bool)
        out = np.empty(len(q))
        if careful.any():
            mass, _, _, stored = self.by_poses(t[careful], q[careful], v[careful])
            out[careful] = stored + 0.5 * np.einsum("ni,nij,nj->n", v[careful], mass, v[careful])
        if not careful.all():
            found = self._run(self._recorded[1], t, q, v, np.flatnonzero(~careful))
            out[~careful] = found["energy"]
        return out

    def _run(self, tape: Tape, t: Reals, q: Reals, v: Reals, rows: Any) -> Mapping[str, Any]:
        states = zip(t[rows].tolist(), q[rows].tolist(), v[rows].tolist(), strict=True)
        given = np.array([self._filled(*state, tape=tape) for state in states])
        with np.errstate(all="ignore"):
            return run(tape, dict(zip(tape.inputs, given.T.copy(), strict=True)))

    @cached_property
    def _fillers(self) -> dict[str, Value]:
        """What gives each input of the tapes at a state."""
        return {name: self._filler(name) for tape in self._recorded for name in tape.inputs}

    def _filled(self, t: float, q: Floats, v: Floats, tape: Tape | None = None) -> Floats:
        return [self._fillers[name](t, q, v) for name in (tape or self._tape).inputs]

    def _filler(self, name: str) -> Value:
        """How an input of the tape hangs on the state."""
        kind, _, of = name.partition(" ")
        if kind == "sign":
            return self._sign(of)
        if kind == "turns":
            return self._turns(int(of.removeprefix("spring ")))
        if kind == "table":
            number, axis = of.split()
            return self._table(int(number), axis == "y")
        j = int(name[1:])
        if name[0] == "q":
            return lambda t, q, v: q[j]
        return lambda t, q, v: v[j]

    def _table(self, number: int, imaginary: bool) -> Value:
        """One component of what a table gives."""
        load = self._tables[number]
        known = self._linear(load)
        place = self._followed(load) if known is None else known[0]
        at = [x for x, _ in load.table]
        given = [y.imag if imaginary else y.real for _, y in load.table]
        slopes = [
            (b - a) / (y - x) for a, b, x, y in zip(given[:-1], given[1:], at[:-1], at[1:], strict=True)
        ]
        first, span = at[0], at[-1] - at[0]

        def value(t: float, q: Floats, v: Floats) -> float:
            x = place(t, q, v)
            if load.periodic:
                x = first + (x - first) % span
            i = bisect_right(at, x) - 1
            if not 0 <= i < len(slopes):
                # a step may reach beyond the last row by its rounding
                if not -EDGE * span <= x - first <= (1 + EDGE) * span:
                    return math.nan
                i = min(max(i, 0), len(slopes) - 1)
            return given[i] + slopes[i] * (x - at[i])

        return value

    def _followed(self, load: Tabled) -> Value:
        """The angle or speed of a link that hangs on more than the inputs, by a tape of its own."""
        a = self.assembly
        recording = Recording(self.mechanism, a.plan, a.signs, (True, False, False), self._flips)
        order = 1 if load.axis == "speed" else 0
        tape = recording.tape([("angle", load.body, order)])
        function, first = floats.compiled(tape), load.table[0][0]

        def place(t: float, q: Floats, v: Floats) -> float:
            (x,) = function(*(self._fillers[name](t, q, v) for name in tape.inputs))
            return x if order else first + (x - first) % TURN

        return place

    def _turns(self, number: int) -> Value:
        """The whole turns of a torsion spring, followed from the guess."""
        spring = self.mechanism.torsion_springs[number]
        a = self.assembly
        recording = Recording(self.mechanism, a.plan, a.signs, (False,) * 3, self._flips)
        tape = recording.tape([("turn", body) for body in spring.links])
        known: list[Setting] = []

        def turns(t: float, q: Floats, v: Floats) -> float:
            ends = known[-1].poses.inputs[:, 0] if known else (0.0, 0.0)
            if not ends[0] < q[0] < ends[-1]:
                span = self.assembly.track.length
                known.append(
                    Setting(Poses(a, [min(q[0], ends[0]) - span, max(q[0], ends[-1]) + span]), False)
                )
            e = run(tape, {name: self._fillers[name](t, q, v) for name in tape.inputs})
            first, second = (complex(e[f"turn {body} x"], e[f"turn {body} y"]) for body in spring.links)
            within = cmath.phase(second * first.conjugate() * rotation(-spring.free_angle))
            return float(round((known[-1].wound(spring, State(list(q)), within) - within) / TURN))

        return turns

    def _sign(self, group: str) -> Value:
        base, start = self.assembly.signs[group], self.assembly.track.start
        flips = self._flips

        def sign(t: float, q: Floats, v: Floats) -> float:
            at = flips[group]
            return base * (1.0 - 2.0 * ((bisect_right(at, q[0]) - bisect_right(at, start)) & 1))

        return sign

    # --- along the one input ------------------------------------------------------------------------------------
    def _cover(self, q: float) -> None:
        """Look for change points around an input, and note them."""
        track = self.assembly.track
        low, high = self._covered
        if track.active and math.isfinite(q) and not low <= q <= high:
            ahead = AHEAD * track.length
            track.cover(q - ahead, q + ahead)
            low, high = min(low, q - ahead), max(high, q + ahead)
            self._flips.update({name: at.tolist() for name, at in track.flips.items()})
            self._near = sorted((c.input, c.reach) for of in track.changes.values() for c in of)
        self._covered = (low, high) if track.active and not track.settled else (-math.inf, math.inf)

    def _careful(self, q: float) -> bool:
        """Whether a state needs the poses' own formulas: near a change point, or wherever no tape goes."""
        if self._untaped:
            return True
        return any(abs(q - at) < reach for at, reach in self._near)

    @cached_property
    def _untaped(self) -> bool:
        a = self.assembly
        return bool(a.geared) or any(g.kind == "Newton" for g in a.plan.groups)


def wasted(loads: Iterable[Load], block: Block, speeds: list[Number]) -> Number:
    """The power of what stores nothing: of applied forces and torques, dampers, drives."""
    total: Number = 0.0
    for load in loads:
        for j, speed in enumerate(speeds):
            work = load.wasted(block, j)
            total = total if work is None else total + work * speed
    return total


def potential(loads: Iterable[Load], block: Block) -> Number:
    """What gravity and springs hold, J."""
    total: Number = 0.0
    for load in loads:
        if load.stores and load.carries:
            total = total + load.potential(block)
    return total
