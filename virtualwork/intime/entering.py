"""What the tapes of a motion cannot decide by themselves: unknowns without a closed form, whole turns, loads given by tables."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from dalembert.arithmetic.engines import floats
from dalembert.arithmetic.tape import Tape
from virtualwork.branch.assembly import Assembly
from virtualwork.describe.cams import CamDrive
from virtualwork.describe.laws import TURN
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.group_loops import unknowns
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.loaded_pose import Setting
from virtualwork.formulas.loads import Tabled
from virtualwork.formulas.positions import State, principal, unwound
from virtualwork.formulas.winding import NODES
from virtualwork.intime.watch import Floats, Rate, Value, Watch
from virtualwork.plan.steps import Plan

# Newton's steps from one pose to the next; rad or sizes: a change from which one more step leaves rounding alone, and
# how far off the last pose may be to begin from; a step is at most this share of the one before, else another solution may be
# as near
LIMIT, CLOSE, FAR, SURE = 8, 1e-9, 0.3, 0.25


class Placed:
    """The poses of an assembly, closed on its branch one after the other.

    With a `tape`, a step of Newton's method on the unknowns of all groups without a closed form, and what else enters
    it (`known`), they are followed from pose to pose; the branch itself closes them where that leads too far, and wherever
    it `crosses` another.

    Examples
    --------
    >>> from virtualwork import Guess, Input, Link, Mechanism
    >>> bars = {"crank": Link({"A": 0j, "B": 1}), "rod": Link({"B": 0j, "C": 2}), "arm": Link({"D": 0j, "C": 2})}
    >>> m = Mechanism({"A": 0j, "D": 2}, bars, inputs=Input(link="crank"), guess=Guess(1.0, points={"C": 2 + 2j}))
    >>> bool(np.angle(Placed(m.assembly).state([1.0]).turn["rod"]) == m.motion(1.0).link("rod").angle[0])
    True
    """

    def __init__(
        self,
        assembly: Assembly,
        tape: Tape | None = None,
        known: Mapping[str, Value] | None = None,
        crosses: Callable[[], bool] = lambda: False,
    ) -> None:
        self.assembly, self.tape, self.known, self.crosses = assembly, tape, known or {}, crosses
        self._step = None if tape is None else floats.compiled(tape)
        size = assembly.mechanism.size
        self.larger = [g for g in assembly.plan.groups if g.kind == "Newton"]
        self.scale = {
            name: 1.0 if i < len(g.angles) else size for g in self.larger for i, name in enumerate(g.unknowns)
        }
        # from far off the steps may lead to another assembly: a turn later the mechanism need not stand as before
        self._units = [size if e.is_slide else 1.0 for e in assembly.mechanism.inputs]
        self._at: Floats = []
        self._x: dict[str, float] = {}
        self._state: tuple[Floats, State] = [], State([])
        # springs' twists, followed from the guess over all inputs met
        self._wound: tuple[float, float, Setting] | None = None
        # with several inputs: of each spring poses that were met, and its twist there
        self._twists: dict[int, list[tuple[Floats, float]]] = {}

    def state(self, q: Floats) -> State:
        """The pose at the inputs; NaN where it cannot be assembled."""
        if q != self._state[0]:
            with np.errstate(all="ignore"):
                self._state = list(q), self.assembly.state(tuple(q))
        return self._state[1]

    def unknown(self, name: str) -> Value:
        """An unknown of a group without a closed form, as it is called on the tape."""

        def value(t: float, q: Floats, v: Floats) -> float:
            if q != self._at:
                self._x, self._at = self._settled(q), list(q)
            return self._x[name]

        return value

    def _settled(self, q: Floats) -> dict[str, float]:
        """All unknowns at the inputs."""
        near = all(abs(a - b) <= FAR * unit for a, b, unit in zip(q, self._at, self._units, strict=False))
        result = self._followed(q) if self._x and near and not self.crosses() else None
        if result is None:
            st = self.state(q)
            result = {
                name: _one(x)
                for g in self.larger
                for name, x in zip(g.unknowns, unknowns(g, st), strict=True)
            }
        return result

    def _followed(self, q: Floats) -> dict[str, float] | None:
        """The same from those of the last pose; None where that does not lead there."""
        if self.tape is None or self._step is None:
            return None
        now, last = self._x, math.inf
        given = {name: of(0.0, q, q) for name, of in self.known.items()}
        for _ in range(LIMIT):
            try:
                solved = self._step(
                    *(given[name] if name in given else now[name] for name in self.tape.inputs)
                )
            except (ZeroDivisionError, ValueError, OverflowError):
                return None
            before, now = now, dict(zip(self.tape.names, solved, strict=True))
            if not all(abs(value - self._x[name]) <= FAR * self.scale[name] for name, value in now.items()):
                return None
            moved = max(abs(value - before[name]) / self.scale[name] for name, value in now.items())
            if moved <= CLOSE:
                return now
            if not moved <= SURE * last:
                # it may lead to another solution
                return None
            last = moved
        return None

    def angle(self, body: str) -> Value:
        """A body's angle with its whole turns."""
        return lambda t, q, v: _one(self.state(q).angle[body])

    def twist(self, number: int) -> Value:
        """The twist of a torsion spring, followed from the guess."""
        spring = self.assembly.mechanism.torsion_springs[number]
        if len(self.assembly.mechanism.inputs) > 1:
            return lambda t, q, v: self._near(number, q)
        return lambda t, q, v: _one(self._setting(q[0]).twist(self.state(q), spring))

    def _near(self, number: int, q: Floats) -> float:
        """The twist with several inputs: along a straight line from the nearest pose met before, at first the guess."""
        m = self.assembly.mechanism
        spring, met = m.torsion_springs[number], self._twists.setdefault(number, [])
        units = np.array([m.size if e.is_slide else 2 * math.pi for e in m.inputs])
        state, setting = self.state(q), self._setting(q[0])
        if not met:
            met.append((list(m.at), _one(setting.twist(self.assembly.state(m.at), spring))))
        apart = np.abs((np.array([at for at, _ in met]) - q) / units).max(axis=1)
        at, twist = met[int(np.argmin(apart))]
        within = Setting.within(state, spring)
        if apart.min() * NODES <= 1:
            return _one(unwound(within, twist))
        own = _one(Setting.within(self.assembly.state(tuple(at)), spring))
        result = _one(setting.along_lines(spring, state.inputs, within, at) + twist - principal(own))
        if math.isfinite(result):
            met.append((list(q), result))
        return result

    def _setting(self, q: float) -> Setting:
        """Poses over all inputs met so far, and a turn further."""
        if self._wound is None or not self._wound[0] < q < self._wound[1]:
            low, high = self._wound[:2] if self._wound else (q, q)
            span = self.assembly.track.length
            ends = np.tile(self.assembly.mechanism.at, (2, 1))
            ends[:, 0] = min(low, q - span), max(high, q + span)
            self._wound = *ends[:, 0].tolist(), Setting(Lanes(self.assembly, ends))
        return self._wound[2]


def _one(x: Any) -> float:
    """The number of one pose, which may stand in an array."""
    return float(np.ravel(x)[0])


# --- loads given by tables ------------------------------------------------------------------------------------------
# of a table's span: how far beyond its ends it is read, for a step may reach there by its rounding
EDGE = 1e-12
# in a turn of an input, or on a way of 2π sizes of a slide: places that no step passes where it does not meet kinks
PACES = 36
# rad: how far a cam is from the end of a segment when it has left it, for its acceleration may have a step there
LEAVES = 1e-5


def place(load: Tabled, plan: Plan) -> tuple[Value, Rate] | None:
    """What a table is over and its derivative, where it is the time, or a sum of inputs or of their speeds; else None."""
    if load.axis == "time":
        return lambda t, q, v: t, lambda t, q, v, a: 1.0
    if load.axis == "input":
        return lambda t, q, v: q[0], lambda t, q, v, a: v[0]
    angle = plan.angles[load.body]
    if not angle.by_inputs:
        return None
    if load.axis == "angle":
        return angle_of(plan, load.body)
    terms = angle.inputs
    return (
        lambda t, q, v: sum(c * v[j] for j, c in terms),
        lambda t, q, v, a: sum(c * a[j] for j, c in terms),
    )


def angle_of(plan: Plan, body: str, on: str = GROUND) -> tuple[Value, Rate]:
    """The angle of a body against another and its derivative; inputs turn both."""
    a, b = plan.angles[body], plan.angles[on]
    const, terms = a.const - b.const, (*a.inputs, *((j, -c) for j, c in b.inputs))
    return (
        lambda t, q, v: const + sum(c * q[j] for j, c in terms),
        lambda t, q, v, a: sum(c * v[j] for j, c in terms),
    )


def reader(load: Tabled, at: Value, *, imaginary: bool) -> Value:
    """One component of what a table gives, of what it is over; NaN outside."""
    places = [x for x, _ in load.table]
    values = [y.imag if imaginary else y.real for _, y in load.table]
    rows = zip(values[:-1], values[1:], places[:-1], places[1:], strict=True)
    slopes = [(b - a) / (y - x) for a, b, x, y in rows]
    first, span = places[0], places[-1] - places[0]

    def value(t: float, q: Floats, v: Floats) -> float:
        x = at(t, q, v)
        if load.periodic:
            x = first + (x - first) % span
        i = bisect_right(places, x) - 1
        if not 0 <= i < len(slopes):
            if not -EDGE * span <= x - first <= (1 + EDGE) * span:
                return math.nan
            i = min(max(i, 0), len(slopes) - 1)
        return values[i] + slopes[i] * (x - places[i])

    return value


def every_kink(loads: Sequence[Tabled], drives: Sequence[CamDrive], plan: Plan) -> list[Watch | None]:
    """The kinks of each table that is not over the time, and of each cam; None where they depend on more than the inputs."""
    tables = [kinks(load, plan, f"table {n}") for n, load in enumerate(loads) if load.axis != "time"]
    return [*tables, *(ends_of_law(drive, plan, f"cam {n}") for n, drive in enumerate(drives))]


def kinks(load: Tabled, plan: Plan, name: str) -> Watch | None:
    """The rows of a table, that no step may pass; None of a table over what depends on more than the inputs."""
    of = place(load, plan)
    if of is None:
        return None
    rows = [x for x, _ in load.table]
    period = rows[-1] - rows[0] if load.periodic else None
    return Watch(name, *of, rows[:-1] if period else rows, period, linear=True)


def ends_of_law(drive: CamDrive, plan: Plan, name: str) -> Watch | None:
    """The ends of the segments of a cam's law, or the rows of its table, that no step may pass.

    Over a dwell steps grow, and would pass a short rise as a whole. None of a cam that more than inputs turn.
    """
    if not (plan.angles[drive.cam.cam].by_inputs and plan.angles[drive.on].by_inputs):
        return None
    value, rate = angle_of(plan, drive.cam.cam, drive.on)
    rows = [drive.lift.first + x for x in drive.lift.knots[:-1]]
    return Watch(name, value, rate, rows, TURN, linear=True, noise=LEAVES)


def paces(scale: Floats) -> list[Watch]:
    """Places of every input that no step may pass, where kinks cannot be met: no step is longer than from one to the next."""

    def pace(j: int, size: float) -> Watch:
        way, noise = TURN / PACES * size, LEAVES * size
        return Watch(
            f"pace {j}", lambda t, q, v: q[j], lambda t, q, v, a: v[j], [0.0], way, linear=True, noise=noise
        )

    return [pace(j, size) for j, size in enumerate(scale)]


def ends(load: Tabled, plan: Plan, t: float, q: Floats, v: Floats) -> str:
    """The sentence on a table that ends at a state; else empty."""
    of, (first, last) = place(load, plan), (load.table[0][0], load.table[-1][0])
    if of is None or load.periodic:
        return ""
    at, near = of[0](t, q, v), 1e-6 * (last - first)
    if first + near < at < last - near:
        return ""
    end = last if at > first + near else first
    unit = {"time": "s", "speed": "rad/s"}.get(load.axis, "rad")
    return f"the table of the {load.kind} on {load.body} ends at {end:.6g} {unit}"
