"""The equations of motion of an assembly in its inputs, M(q)·q̈ + h(q, q̇, t) = 0, on a tape.

The effort at the inputs by virtual work is linear in their accelerations: with no effort given, it is M·q̈ + h. M is
its derivative to the accelerations (one sweep backwards over the tape), h its value without them. Loops are closed at
every evaluation, so that nothing drifts.

What a tape cannot decide enters it as a number: the sign of a closed form at the pose, the unknowns of a group that has
none, whole turns (`entering`), what a table says. Near change points what is smooth is interpolated (`crossing`).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from copy import copy
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.engines import floats, run
from dalembert.arithmetic.tape import Tape
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import MechanismError
from virtualwork.formulas.forces import Effort
from virtualwork.formulas.group_loops import unknowns
from virtualwork.formulas.kinematics import Angle
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.loads import Tabled
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.recording import Recording
from virtualwork.intime.crossing import OTHER, Crossing, crossings, narrowed, nearest
from virtualwork.intime.entering import Placed, ends, every_kink, paces, place, reader
from virtualwork.intime.powers import motion_of, state_names
from virtualwork.intime.watch import Floats, Value, Watch

# of a turn: how far beyond an input its change points are looked for
AHEAD = 1.0
# beyond the inputs that were looked over no step goes farther
FAR = 64.0
# how near a change point a fold is its own
NEAR = 0.1
# rad, or of a slide's size: how far beyond its end a motion is tested for inputs that lie too far from the guess
NEXT = 1e-6
# a speed of the input, rad/s or m/s, beside whose forces all others are small
FAST = 1e4
# of what an interpolation has been seen to miss at two poses, what it may miss
SEEN = 2.0
TURN = 2 * math.pi
EVERYWHERE, NOWHERE = (-math.inf, math.inf), (math.inf, -math.inf)


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
        self._covered = NOWHERE
        self._flips: dict[str, list[float]] = {}
        self._crossings: list[Crossing] = []
        self.share = 1.0
        self._known: dict[tuple[float, float], Crossing] = {}
        # starts that were looked at
        self._begun: set[tuple[float, ...]] = set()
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
        crossing = self._crossing(q[0])
        if crossing is not None:
            if not crossing.smooth:
                raise Lost
            result = crossing.interpolated([self._plain(t, [x], v) for x in crossing.nodes], q[0])
        else:
            result = self._plain(t, q, v)
        for value in result:
            # NaN and infinity
            if value - value != 0.0:
                raise Lost
        return result

    def _plain(self, t: float, q: Floats, v: Floats) -> Floats:
        """The accelerations and the power away from change points."""
        try:
            return list(self._function(*self._filled(self.rates, t, q, v)))
        except (ZeroDivisionError, ValueError, OverflowError):
            raise Lost from None

    def refuse(self, t: float, q: Floats, v: Floats) -> None:
        """Refuse a start from which nothing can be followed.

        Raises
        ------
        MechanismError
            Not assembled there, or an input on which no mass moves; which, and what is missing.
        """
        if (t, *q, *v) in self._begun:
            return
        names = [e.name for e in self.mechanism.inputs]
        mass, rest = self._by_poses(t, q)
        if not (np.isfinite(mass).all() and np.isfinite(rest).all()):
            raise MechanismError("it cannot be assembled at the start, or stands at a limit of its input")
        # how much of each input's own inertia is left when the others are free to follow
        whole = np.linalg.eigvalsh(mass * np.outer(self.scale, self.scale))
        if not mass.any() or whole[0] <= 1e-14 * whole[-1]:
            least = names[int(np.argmin(np.diag(mass) * np.square(self.scale)))]
            raise MechanismError(
                f"no mass moves with input '{least}': its acceleration is not determined; "
                "expected a mass or an inertia on a link that it moves"
            )
        self._begun.add((t, *q, *v))

    def many(self, t: Reals, q: Reals, v: Reals) -> Reals:
        """The accelerations and the power at many states, (n, k + 1); NaN where there are none."""
        out = np.full((len(q), self.k + 1), np.nan)
        careful = self._careful(q)
        rows = np.flatnonzero(~careful)
        if len(rows):
            values = self._run(self.rates, t[rows], q[rows], v[rows])
            for j, name in enumerate(self.rates.names):
                out[rows, j] = values[name]
        for i in np.flatnonzero(careful):
            try:
                out[i] = self(float(t[i]), q[i].tolist(), v[i].tolist())
            except Lost:
                continue
        return out

    def _careful(self, q: Reals) -> NDArray[np.bool_]:
        """Which states no tape can do by itself, (n,)."""
        for end in (q[:, 0].min(), q[:, 0].max()) if len(q) else ():
            with suppress(Lost):
                self._cover(float(end))
        low, high = self._covered
        careful = ~((q[:, 0] >= low) & (q[:, 0] <= high))
        if self._crossings:
            careful |= np.array([self._crossing(x) is not None for x in q[:, 0].tolist()], dtype=bool)
        return careful

    def _by_poses(self, t: float, q: Floats) -> tuple[Reals, Reals]:
        """M (k, k) and h (k,) at rest in a pose, from the effort of k + 1 motions through it: at rest nothing slides."""
        k = self.k
        with np.errstate(all="ignore"):
            unit = np.vstack([np.zeros(k), np.eye(k)])
            poses = Lanes(self.assembly, np.tile(q, (k + 1, 1)), 0.0, unit)
            poses.time = np.full(k + 1, t)
            result = np.stack(poses.taped([Effort(j) for j in range(k)]), axis=1)
        return (result[1:] - result[0]).T, result[0]

    @cached_property
    def kinks(self) -> list[Watch | None]:
        """The kinks of tables and of cams' laws; None where they depend on more than the inputs, so that steps pass them."""
        return every_kink(self._tables, self.mechanism.cam_drives, self.assembly.plan)

    def watches(self) -> list[Watch]:
        """What a step must not pass: kinks, and where those cannot be met too long a way."""
        return [*filter(None, self.kinks), *(paces(self.scale) if None in self.kinks else ())]

    @cached_property
    def stops(self) -> list[float]:
        """Times that no step passes: the rows of tables."""
        return sorted({x for load in self._tables if load.axis == "time" for x, _ in load.table})

    def outside(self, t: float, q: Floats, v: Floats) -> str:
        """Why a motion cannot go on from a state: a table ends there, or it lies too far from the guess; empty otherwise."""
        every = (ends(load, self.assembly.plan, t, q, v) for load in self._tables)
        try:
            self._cover(q[0] + math.copysign(NEXT * self.scale[0], v[0]))
        except Lost as lost:
            return str(lost)
        return next(filter(None, every), "")

    # --- the tape ---------------------------------------------------------------------------------------------
    @cached_property
    def _recorded(self) -> tuple[Tape, Tape, Tape]:
        """The tapes of accelerations and power, of the energies, and of the sizes of loads."""
        return motion_of(self.recording(True, True, False), self.k)

    @cached_property
    def _tables(self) -> list[Tabled]:
        """The loads that tables give, in the order of the tape."""
        return LoadCase(self.mechanism, self.assembly.plan, moves=True).tables

    def recording(self, *moves: bool, settled: bool = True) -> Recording:
        """The formulas of the assembly, with what the equations can fill in: speeds and accelerations as `moves`."""
        a = self.assembly
        turning = {name for name, flips in a.track.flips.items() if len(flips)}
        return Recording(self.mechanism, a.plan, a.signs, moves, turning, a.geared, settled)

    def function(self, tape: Tape) -> Callable[[float, Floats, Floats], tuple[float, ...]]:
        """A tape of such a recording as a function of a state."""
        function, fillers = floats.compiled(tape), [self._filler(name) for name in tape.inputs]
        return lambda t, q, v: function(*(of(t, q, v) for of in fillers))

    # --- for steps that are tapes themselves ----------------------------------------------------------------------
    @cached_property
    def plain(self) -> bool:
        """Whether the tape of the motion depends on the state alone: on nothing that has to be looked up."""
        return set(state_names(self.k)).issuperset(self.rates.inputs)

    @property
    def smooth(self) -> bool:
        """Whether the accelerations are smooth in the state: there is no change point near which they are interpolated."""
        return not self._crossings

    @property
    def rates(self) -> Tape:
        """The tape of accelerations and power; of (t, q, q̇) alone where this is `plain`."""
        return self._recorded[0]

    @property
    def called(self) -> tuple[tuple[str, ...], Callable[..., Sequence[float]]]:
        """The names of the arguments with which a step calls the rates, and the function that it calls.

        Raises
        ------
        Lost
        """
        if self.plain and self._covered == EVERYWHERE and not self._crossings:
            # there is no change point to look for
            return self.rates.inputs, self._function
        k = self.k
        return tuple(state_names(k)), lambda t, *y: self(t, list(y[:k]), list(y[k:]))

    @cached_property
    def _function(self) -> Callable[..., tuple[float, ...]]:
        return floats.compiled(self.rates)

    def energies(self, t: Reals, q: Reals, v: Reals) -> Reals:
        """Kinetic energy and that of gravity and springs together, (n,) J."""
        near, tape, out = [self._crossing(x) for x in q[:, 0].tolist()], self._recorded[1], np.empty(len(q))
        rows = np.flatnonzero([crossing is None for crossing in near])
        if len(rows):
            out[rows] = self._run(tape, t[rows], q[rows], v[rows])["energy"]
        for i, crossing in enumerate(near):
            if crossing is not None:
                n = len(crossing.nodes)
                nodes = np.full(n, t[i]), np.array(crossing.nodes)[:, None], np.tile(v[i], (n, 1))
                beside = self._run(tape, *nodes)["energy"]
                (out[i],) = crossing.interpolated(beside[:, None].tolist(), float(q[i, 0]))
        return out

    def load_sizes(self, t: Reals, q: Reals, v: Reals) -> Reals:
        """What the loads add to the accelerations, each by itself, summed without signs, (n, k): what cancels has rounded.

        Nothing where poses near change points stand for them.
        """
        values = self._run(self._recorded[2], t, q, v)
        sizes = np.stack([np.broadcast_to(values[f"size{j}"], len(q)) for j in range(self.k)], axis=1)
        near = np.array([self._crossing(x) is not None for x in q[:, 0].tolist()])
        return np.where(np.isfinite(sizes) & ~near[:, None], sizes, 0.0)

    def _run(self, tape: Tape, t: Reals, q: Reals, v: Reals) -> Mapping[str, Any]:
        if self.plain:
            entering = dict(zip(state_names(self.k), (t, *q.T, *v.T), strict=True))
        else:
            states = zip(t.tolist(), q.tolist(), v.tolist(), strict=True)
            filled = np.array([self._filled(tape, *state) for state in states])
            entering = dict(zip(tape.inputs, filled.T.copy(), strict=True))
        with np.errstate(all="ignore"):
            return run(tape, entering)

    @cached_property
    def _fillers(self) -> dict[str, Value]:
        """What gives each input of the tapes at a state."""
        return {name: self._filler(name) for tape in self._recorded for name in tape.inputs}

    def _filled(self, tape: Tape, t: float, q: Floats, v: Floats) -> Floats:
        return [self._fillers[name](t, q, v) for name in tape.inputs]

    def _filler(self, name: str) -> Value:
        """How an input of the tape depends on the state."""
        kind, _, of = name.partition(" ")
        if kind == "sign":
            return self._sign(of)
        if kind == "x":
            return self._placed.unknown(name)
        if kind == "near":
            spring = of.startswith("spring ")
            return self._placed.twist(int(of.removeprefix("spring "))) if spring else self._placed.angle(of)
        if kind == "table":
            number, axis = of.split()
            load = self._tables[int(number)]
            known = place(load, self.assembly.plan)
            at = self._followed(load) if known is None else known[0]
            return reader(load, at, imaginary=axis == "y")
        j = int(name[1:])
        if name[0] == "q":
            return lambda t, q, v: q[j]
        return lambda t, q, v: v[j]

    def _followed(self, load: Tabled) -> Value:
        """The angle or speed of a link that depends on more than the inputs, by a tape of its own."""
        order = 1 if load.axis == "speed" else 0
        function = self.function(self.recording(True, False, False).tape([Angle(load.body, order)]))
        first = load.table[0][0]

        def at(t: float, q: Floats, v: Floats) -> float:
            (x,) = function(t, q, v)
            return x if order else first + (x - first) % TURN

        return at

    @cached_property
    def _placed(self) -> Placed:
        """What enters the tapes of poses, one pose after the other."""
        larger = [g for g in self.assembly.plan.groups if g.kind == "Newton"]
        if not larger or self.assembly.geared:
            return Placed(self.assembly)
        recording = self.recording(False, False, False, settled=False)
        recording.solve([key for g in larger for key in self.assembly.plan.writes(g)], 0)
        st = recording.st
        after = {name: x for g in larger for name, x in zip(g.unknowns, unknowns(g, st), strict=True)}
        tape = recording.recorder.tape(after)
        known = {name: self._filler(name) for name in tape.inputs if not name.startswith("x ")}
        return Placed(self.assembly, tape, known, lambda: self.crosses)

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
            if max(track.low - q, q - track.high) > FAR * track.length:
                # a stage of a step that is too long
                raise Lost
            try:
                track.cover(q - ahead, q + ahead)
            except MechanismError as error:
                # so many turns from the guess
                raise Lost(str(error)) from None
            low, high = min(low, q - ahead), max(high, q + ahead)
            self._flips.update({name: at.tolist() for name, at in track.flips.items()})
            self._crossings = crossings(track.crossings, self.scale[0], self._settled, self.share)
        self._covered = (low, high) if track.active and not track.settled else EVERYWHERE

    def _settled(self, at: float, widest: float) -> Crossing:
        """The crossing at a change point, made once."""
        if (at, widest) not in self._known:
            # of an input that moves fast a change of its speed by itself within a radian, or a size
            least = [0.0, FAST**2 / self.scale[0]]
            self._known[at, widest] = narrowed(self._samples, at, widest, least)
        return self._known[at, widest]

    def _samples(self, q: float) -> Floats:
        """What is interpolated near change points, at rest and where it moves fast; NaN where there is none."""
        try:
            return [self._plain(self.stops[0] if self.stops else 0.0, [q], [v])[0] for v in (0.0, FAST)]
        except Lost:
            return [math.nan, math.nan]

    def _crossing(self, q: float) -> Crossing | None:
        """The change point that an input is close to."""
        result = nearest(self._crossings, q) if self._crossings else None
        return result if result is not None and abs(q - result.at) < result.inner else None

    def blur(self, t: Reals, q: Reals, v: Reals, stages: Reals, weights: Reals) -> tuple[Reals, Reals]:
        """How far the speed may be wrong by each step for interpolation near change points, and the point next to each, both (n − 1,).

        Nodes (n,) of a path, where in a step the method's `stages` stand, and their `weights`. What an interpolation
        has been seen to miss counts at the stages that lie on its inner part, each with its weight over the whole step:
        the others do not know of it. Beyond that part it falls off, as rounding does there.
        """
        h, way, c = np.diff(t), np.diff(q), stages[:, None]
        # Hermite's polynomial through two nodes
        there = q[:-1] + c * way + c * (1 - c) * ((1 - c) * (h * v[:-1] - way) - c * (h * v[1:] - way))
        speed = np.maximum(np.abs(v[1:]), np.abs(v[:-1])) / FAST
        result = np.zeros((len(self._crossings), len(h)))
        for one, crossing in zip(result, self._crossings, strict=True):
            apart = np.abs(there - crossing.at) / crossing.inner
            each = weights[:, None] / np.maximum(apart, 1.0) ** 2
            counts = np.where((apart <= 1).all(axis=0), 1.0, np.sqrt(np.square(each).sum(axis=0)))
            still, fast = crossing.missed
            one[:] = SEEN * counts * (still + fast * speed**2) * h
        return result.max(axis=0), result.argmax(axis=0)

    def otherwise(self) -> Equations:
        """The same equations, interpolated from other poses near change points."""
        return self.sharing(OTHER)

    def sharing(self, share: float) -> Equations:
        """The same equations, interpolated from poses farther from change points or nearer, by what share."""
        other = copy(self)
        other.share, other._covered, other._crossings = share, NOWHERE, []
        other._cover(self.mechanism.at[0])
        return other

    @property
    def crosses(self) -> bool:
        """Whether there are change points, as far as was looked."""
        return bool(self._crossings)

    def meets(self, q: float) -> bool:
        """Whether an input is at a change point, but for rounding."""
        result = nearest(self._crossings, q)
        return result is not None and abs(q - result.at) < 1e-7 * self.scale[0]

    def clear(self, q: Reals) -> bool:
        """Whether no change point is near any of the values of the first input, as far as can be looked."""
        low, high = float(q.min()), float(q.max())
        try:
            for end in (low, high):
                self._cover(end)
        except Lost:
            return False
        return not any(low - c.inner <= c.at <= high + c.inner for c in self._crossings)

    def passes(self, q: float) -> bool:
        """Whether a change point is near: there every loop folds, in all coordinates, and goes on."""
        result = nearest(self._crossings, q)
        return result is not None and abs(q - result.at) < NEAR * self.assembly.track.length
