"""Variants of a mechanism that are simulated together: lanes of one loop of steps, each with steps of its own.

The formulas are recorded once with the varied dimensions as inputs of the tape. What a lane cannot do is done singly,
as `Mechanism.simulate` does it: loops that fold, change points on the way, stiff dampers, friction, tables, variants
whose branch no comparison decides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.engines import run
from dalembert.arithmetic.guard import guarded
from dalembert.arithmetic.tape import Tape
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import MechanismError
from virtualwork.family.family import Family, FamilyMotion
from virtualwork.family.part import Part, Solver
from virtualwork.family.varied_formulas import VariedFormulas
from virtualwork.formulas.numbers import EPS, Reals, real_array
from virtualwork.intime.control import first_steps
from virtualwork.intime.coordinates import FOLDING
from virtualwork.intime.defect import step_errors
from virtualwork.intime.ends import events, passed, sides
from virtualwork.intime.estimate import GAIN, LEAST, SAFETY, TRIES, first_tolerance
from virtualwork.intime.growth import at_start, flows, grown, ways_of, within
from virtualwork.intime.marching import Nodes, beginning, follow, march, over
from virtualwork.intime.powers import motion_of, names
from virtualwork.intime.run import drift, levels_of, not_met, reached, rising, simulate
from virtualwork.intime.sticking import of_variants
from virtualwork.intime.watch import Levels

Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]
# steps of one variant; beyond them it is done singly
MOST = 20_000
# steps of which the errors are computed at a time: what they need then stays near the processor
HELD = 1 << 13
# rounds between two looks, at first and later
SOON, LATER = 16, 128
# the results of each variant over its times
FOUND = ("angle", "speed", "acceleration", "error_estimate", "energy", "work")


@dataclass(frozen=True, eq=False)
class Runs:
    """The result of `Variants.simulate`: every array has a leading axis of variants.

    Attributes
    ----------
    t : array (n,)
        The requested times, s.
    times : array (v, n)
        Those of each variant: where its motion ends before the last, that of its end comes after those before it, and
        what follows is NaN. So is all of a variant that cannot be simulated.
    angle, speed, acceleration : array (v, n, k)
        The inputs (rad, or m of a slide; not wrapped) and their rates.
    error_estimate : array (v, n, k)
        How far the inputs may be from the truth.
    energy, work : array (v, n)
        Kinetic energy and that of gravity and springs, and the work of what stores none, J.
    unknown : array (v, n)
        Whether no digit of the inputs holds, nor any after that time.
    warnings : dict of a variant's place to its warnings
    """

    family: Family
    t: Reals
    times: Reals = field(repr=False)
    angle: Reals = field(repr=False)
    speed: Reals = field(repr=False)
    acceleration: Reals = field(repr=False)
    error_estimate: Reals = field(repr=False)
    energy: Reals = field(repr=False)
    work: Reals = field(repr=False)
    unknown: Mask = field(repr=False)
    warnings: dict[int, tuple[str, ...]] = field(default_factory=dict)
    # of variants with friction: what holds joints at rest, (c, n) at times (n,)
    holding: dict[int, Callable[[Reals], Reals]] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, family: Family, t: Reals) -> Runs:
        """Nothing yet."""
        v, n, k = len(family), len(t), len(family.mechanism.inputs)
        times, energy, work = np.full((3, v, n), np.nan)
        angle, speed, acceleration, error = np.full((4, v, n, k), np.nan)
        unknown = np.zeros((v, n), dtype=bool)
        return cls(family, t, times, angle, speed, acceleration, error, energy, work, unknown)

    @property
    def energy_drift(self) -> Reals:
        """(v, n): the change of energy since the first time that the work of the loads does not explain, J."""
        return drift(self.energy, self.work)

    @cached_property
    def motion(self) -> FamilyMotion:
        """The motion of every variant through all times: points, links, slides, joint forces."""
        f = self.family
        rates = [list(np.moveaxis(of, 2, 0)) for of in (self.speed, self.acceleration)]
        rates.append([0.0] * len(rates[0]))
        held = of_variants(self.holding, self.times)
        return FamilyMotion(Part(f.mechanism, f.dimensions, f.values, self.angle, rates, self.times, held))

    def put(self, rows: Any, times: Reals, **columns: Reals) -> None:
        """Keep the results of some variants at their times (…, n), which may be fewer than the requested ones."""
        n = times.shape[-1]
        for name, values in {"times": times, **columns}.items():
            of = getattr(self, name)
            of[rows, n:] = np.nan
            of[rows, :n] = values


@guarded
class Variants(Family):
    """Variants of a mechanism that can be simulated; `Mechanism.vary` makes them."""

    # what is written down once: the formulas, and the tapes of accelerations, energies and loads
    alike: Solver | None = None
    tapes: tuple[Tape, Tape, Tape] | None = None

    def simulate(
        self,
        times: ArrayLike,
        angle: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        accuracy: float = 1e-9,
        until: Mapping[str, float] | None = None,
    ) -> Runs:
        """Simulate every variant; see `Mechanism.simulate`.

        Parameters
        ----------
        times : array (n,)
            Rising, s; the motions start at the first.
        angle, speed : float, array (k,) or (v, k), optional
            The inputs at the first time, rad or m, and their speeds. Default: each description's own.
        accuracy : float
            The wanted error of the inputs at every time, relative to one radian or the mechanism's size.
        until : mapping of an input's name to its value, optional
            Each motion ends where an input has it, at that time to rounding.

        Returns
        -------
        Runs

        Raises
        ------
        ValueError
            Times that do not rise; an accuracy that is none; an input that is none.

        Examples
        --------
        Three pendulums that fall from the side:

        >>> from virtualwork import Input, Link, Mechanism
        >>> bob = Link({"O": 0j, "P": 1}, mass=1, center=1)
        >>> pendulum = Mechanism({"O": 0j}, {"bob": bob}, inputs=Input(link="bob"), gravity=-9.81j)
        >>> runs = pendulum.vary({"links.bob.P.x": [0.5, 1.0, 2.0], "links.bob.center.x": [0.5, 1.0, 2.0]}).simulate(
        ...     [0, 0.2], angle=0.0)
        >>> runs.angle[:, -1, 0].round(6)
        array([-0.390401, -0.195949, -0.098069])
        """
        t = rising(times)
        if not 0 < accuracy < 1:
            raise ValueError(f"accuracy: found {accuracy:g}, expected a number between 0 and 1")
        k = len(self.mechanism.inputs)
        q, v = (
            np.stack(self.own(name), axis=-1) if start is None else _starts(what, start, len(self), k)
            for what, name, start in (("angle", "value", angle), ("speed", "speed", speed))
        )
        levels = levels_of(self.mechanism.inputs, until)
        runs = Runs.of(self, t)
        alone = np.ones(len(self), dtype=bool)
        # a cam that loses its follower is looked for in each motion
        lanes = None if self.mechanism.cam_drives else _Lanes.of(self, t, q, v, levels)
        if lanes is not None:
            alone = lanes.fill(runs, accuracy) | lanes.meet()
            for i in np.flatnonzero(lanes.late & ~alone):
                runs.warnings[int(i)] = (not_met(until or (), float(t[-1])),)
        for i in np.flatnonzero(alone):
            try:
                own = simulate(Assembly.from_guess(self[int(i)]), t, q[i], v[i], accuracy, until)
            except MechanismError as error:
                runs.warnings[int(i)] = (str(error),)
                continue
            runs.put(int(i), own.t, **{name: getattr(own, name) for name in FOUND})
            runs.unknown[i, : len(own.t)] = own.unknown
            if self.mechanism.friction:
                runs.holding[int(i)] = own.fine.holding
            if own.warnings:
                runs.warnings[int(i)] = own.warnings
        return runs


def _starts(name: str, start: ArrayLike, v: int, k: int) -> Reals:
    value = real_array(name, start)
    if not np.isfinite(value).all() or value.shape not in ((), (k,), (v, k)):
        raise ValueError(
            f"{name}: expected a number, or shape ({k},) or ({v}, {k}), all finite; found {value.shape}"
        )
    return np.array(np.broadcast_to(value, (v, k)))


@dataclass
class _Lanes:
    """Variants on the tape: what enters it, (v,) each, and where they start."""

    family: Variants
    solver: Solver
    written: VariedFormulas
    rates: Tape
    energy: Tape
    loads: Tape
    given: dict[str, Reals]
    together: Mask
    t: Reals
    q: Reals
    v: Reals
    scale: Reals
    levels: Levels

    def __post_init__(self) -> None:
        # which lanes do not meet the level that ends them
        self.late = np.zeros(len(self.q), dtype=bool)
        # the first input's least and largest value so far
        self.low, self.high = self.q[:, 0].copy(), self.q[:, 0].copy()

    @classmethod
    def of(cls, family: Variants, t: Reals, q: Reals, v: Reals, levels: Levels) -> _Lanes | None:
        """The lanes of a family; None where its motion is not on one tape."""
        m = family.mechanism
        k = q.shape[1]
        if m.friction:
            return None
        part = Part(m, family.dimensions, family.values, q[:, None], [[1.0] * k, [1.0] * k, [0.0] * k])
        solver = Solver(part, family.alike)
        if solver.written is None or solver.written.iterated or not solver.together.any():
            return None
        family.alike = solver
        entering = {d.path: family.values[:, i] for i, d in enumerate(family.dimensions)}
        entering |= {f"sign {name}": sign for name, sign in solver.signs.items()}
        if family.tapes is None:
            try:
                family.tapes = motion_of(solver.written.recording, k)
            except ZeroDivisionError:
                # no mass moves: each says so
                return None
        rates, energy, loads = family.tapes
        places, speeds, _ = names(k)
        if not {*places, *speeds, *entering}.issuperset(rates.inputs):
            return None
        scale = np.ones((len(q), k))
        slides = [j for j, e in enumerate(m.inputs) if e.is_slide]
        if slides:
            scale[:, slides] = np.array([family[i].size for i in range(len(q))])[:, None]
        return cls(
            family,
            solver,
            solver.written,
            rates,
            energy,
            loads,
            entering,
            solver.together,
            t,
            q,
            v,
            scale,
            levels,
        )

    @property
    def k(self) -> int:
        """Inputs."""
        return int(self.q.shape[1])

    def some(self, rows: Rows) -> dict[str, Reals]:
        """What enters the tapes in some variants."""
        return {name: x[rows] for name, x in self.given.items()}

    # --- through time -----------------------------------------------------------------------------------------------
    def fill(self, runs: Runs, accuracy: float) -> Mask:
        """Simulate all that can be simulated together; which variants must be done singly, (v,)."""
        alone = ~self.together
        rows, tolerance = np.flatnonzero(self.together), first_tolerance(accuracy)
        nodes = self.way(rows, tolerance, alone)
        for tries in range(TRIES):
            nodes = self.halved(rows, nodes)
            times = self.times(rows, nodes, alone)
            past = np.isnan(times)
            error = self._error(rows, nodes, times)
            error[past] = np.nan
            for j, level in self.levels.items():
                beside = np.abs(nodes.q[-1, :, j] - level) <= error[:, -1, j]
                alone[rows[self.late[rows] & beside]] = True
            worst = np.where(past[..., None], 0.0, error / self.scale[rows, None]).max(
                axis=(1, 2), initial=0.0
            )
            holds = worst <= accuracy
            self._put(runs, rows, np.flatnonzero(holds), nodes, times[holds], error[holds])
            tolerance = max(LEAST, tolerance / (GAIN + 1))
            last = tolerance <= LEAST or tries == TRIES - 1 or len(nodes.t) > MOST
            # what does not hold is tried again, and at last left to say itself why not
            again = ~holds & ~alone[rows] & np.isfinite(worst) & (not last)
            alone[rows[~holds & ~again]] = True
            if not again.any():
                break
            rows, nodes = rows[again], nodes.at(np.s_[:, again])
        return alone

    def way(self, rows: Rows, tolerance: float, alone: Mask) -> Nodes:
        """The nodes of a way through all times, (rounds, lanes); marks in `alone` what has to be done singly.

        A round in which a lane took no step repeats its last node.
        """
        t, n = self.t, len(rows)
        end, span = float(t[-1]), float(t[-1] - t[0])
        entering = self.some(rows) | {"tolerance": tolerance, "end": end, "span": span}
        entering |= {f"scale{j}": self.scale[rows, j] for j in range(self.k)}
        q, v, scale = self.q[rows], self.v[rows], self.scale[rows].T
        slopes = self._run(self.rates, rows, q, v)
        first = Nodes(np.column_stack([np.full(n, t[0]), q, v, slopes, np.zeros(n)]), self.k)
        ways = sides(first, self.levels, scale.T)
        fastest, h = first_steps(span, tolerance, scale, q.T, v.T, slopes.T)
        state = beginning(first, h, fastest)
        state["left"] = np.where(np.isfinite(slopes).all(axis=1) & (span > 0), 1.0, 0.0)
        parts = [first.at(None)]
        taken = 0
        while state["left"].max() > 0 and taken < MOST:
            marched, state = march(self.k, self.rates, entering, state, SOON if taken < 4 * SOON else LATER)
            parts.append(marched)
            taken += len(marched.t)
            if self.levels:
                # one step beyond the event is enough
                hits = passed(parts[-2].then(marched), self.levels, ways)[:-1].any(axis=0)
                state["left"] = np.where(hits, 0.0, state["left"])
        whole = parts[0].then(*parts[1:])
        hits = passed(whole, self.levels, ways)
        ended = (whole.t[-1] >= end) | hits.any(axis=0)
        if self.levels:
            beyond = np.where(hits.any(axis=0), np.argmax(hits, axis=0) + 2, len(whole.t))
            whole = whole.at((np.minimum(np.arange(len(whole.t))[:, None], beyond), np.arange(n)))
        alone[rows[~ended]] = True
        alone[rows[self._folds(rows, whole)]] = True
        return whole

    def halved(self, rows: Rows, nodes: Nodes) -> Nodes:
        """The nodes of the same ways in steps half as long."""
        t, first = nodes.t, nodes.at(np.s_[:1])
        times = np.stack([0.5 * (t[1:] + t[:-1]), t[1:]], axis=1).reshape(-1, t.shape[1])
        result = follow(self.k, self.rates, self.some(rows), beginning(first.at(0)), times)
        return first.then(result.nodes)

    def times(self, rows: Rows, nodes: Nodes, alone: Mask) -> Reals:
        """The times up to each lane's event, it the last, (lanes, n); then NaN."""
        result = np.tile(self.t, (len(rows), 1))
        if self.levels:
            ways = sides(nodes.at(0), self.levels, self.scale[rows])
            ends, doubt = events(self.rates, self.some(rows), nodes, self.levels, ways)
            alone[rows[doubt]] = True
            self.late[rows] = np.isnan(ends)
            # the level that the coarser way passed at its very end
            alone[rows[np.isnan(ends) & (nodes.t[-1] < self.t[-1])]] = True
            for row, end in zip(result, ends, strict=True):
                if end < self.t[-1]:
                    its = reached(self.t, end)
                    row[: len(its)], row[len(its) :] = its, np.nan
        return result

    def _error(self, rows: Rows, nodes: Nodes, times: Reals) -> Reals:
        """The error of the inputs at all times, (lanes, n, k), as `estimate.errors`."""
        result, t = np.empty((len(rows), 1 + len(nodes.t) // 2, self.k)), nodes.t[::2]
        for lanes in np.array_split(np.arange(len(rows)), 1 + len(rows) * len(nodes.t) // HELD):
            result[lanes] = self._off(rows[lanes], nodes.at(np.s_[:, lanes]))
        at = np.stack([(t < x).sum(axis=0) for x in times.T], axis=1)
        return np.asarray(result[np.arange(len(result))[:, None], np.minimum(at, len(t) - 1)])

    def _off(self, rows: Rows, nodes: Nodes) -> Reals:
        """What the motions make of rounding and of the errors of the steps, the largest so far, (lanes, rounds, k)."""
        scale, h, k = self.scale[rows].T, np.diff(nodes.t[::2], axis=0), self.k

        def of(_: Reals, q: Reals, v: Reals, tape: Tape = self.rates) -> Reals:
            flat = (x.reshape(k, -1).T for x in (q, v))
            return self._run(tape, np.tile(rows, q.shape[1]), *flat)[:, :k].T.reshape(q.shape)

        q, v, a = (np.moveaxis(x, -1, 0) for x in (nodes.q, nodes.v, nodes.rates[..., :-1]))
        flow, rounds, slopes = flows(of, scale, nodes.t, q, v, a)
        middle, local = step_errors(of, slopes, nodes.t, q, v, a)
        start = at_start(q[:, 0], v[:, 0])
        q, v = q[:, ::2], v[:, ::2]
        off = grown(flow, h, rounds, ways_of(h, q, v, of(h, q, v, self.loads)), start, local)
        rounded, stepped = (np.maximum.accumulate(x, axis=1) for x in (off.rounded, off.stepped))
        stepped, rounded = SAFETY * within(stepped, middle, h)[:k], np.minimum(rounded[:k], scale[:, None])
        return np.asarray((rounded + stepped + 4 * EPS * np.abs(q)).T)

    def _folds(self, rows: Rows, nodes: Nodes) -> Mask:
        """In which lanes a loop folds on the way."""
        q = nodes.q[..., 0]
        self.low[rows] = np.fmin(self.low[rows], q.min(axis=0))
        self.high[rows] = np.fmax(self.high[rows], q.max(axis=0))
        margins = self.written.margins
        if not margins:
            return np.zeros(len(rows), dtype=bool)
        result = self._run(
            self.written.tape(margins), np.tile(rows, len(nodes.t)), nodes.q.reshape(-1, self.k)
        )
        return np.asarray(~(result >= FOLDING).all(axis=1).reshape(-1, len(rows)).all(axis=0))

    def meet(self) -> Mask:
        """Which variants may have a change point on their way, (v,)."""
        if self.k > 1:
            return np.zeros(len(self.q), dtype=bool)
        f, ends = self.family, np.stack([self.low, self.high], axis=1)[:, :, None]
        rates: list[list[Any]] = [[1.0], [1.0], [0.0]]
        return ~Solver(Part(f.mechanism, f.dimensions, f.values, ends, rates), self.solver).together

    def _put(self, runs: Runs, rows: Rows, lanes: Rows, nodes: Nodes, t: Reals, error: Reals) -> None:
        """Keep the states of some lanes at times (lanes, n), each from the node before; NaN where the time is."""
        rows, begin = rows[lanes], nodes.t[:, lanes]
        before = np.stack([(begin <= x).sum(axis=0) - 1 for x in t.T], axis=1)
        node = nodes.at((np.maximum(before, 0), lanes[:, None]))
        h = t - node.t
        lane, on = np.nonzero(h > 0)
        if len(lane):
            changes = over(self.rates, self.some(rows[lane]), node.at((lane, on)), h[lane, on])
            for of, change in zip((node.q, node.v, node.work), changes, strict=True):
                of[lane, on] += change
        for of in (node.q, node.v, node.work):
            of[np.isnan(t)] = np.nan
        every, q, v = np.repeat(rows, t.shape[1]), node.q.reshape(-1, self.k), node.v.reshape(-1, self.k)
        slopes, energy = (
            self._run(tape, every, q, v).reshape(*t.shape, len(tape.names))
            for tape in (self.rates, self.energy)
        )
        columns = node.q, node.v, slopes[..., :-1], error, energy[..., 0], node.work
        runs.put(rows, t, **dict(zip(FOUND, columns, strict=True)))

    def _run(self, tape: Tape, rows: Rows, q: Reals, v: Reals | None = None) -> Reals:
        """A tape's outputs (n, outputs) in states (n, k) of variants."""
        entering = self.some(rows) | {f"q{j}": x for j, x in enumerate(q.T)}
        entering |= {} if v is None else {f"v{j}": x for j, x in enumerate(v.T)}
        with np.errstate(all="ignore"):
            result = run(tape, entering)
        return np.stack([np.broadcast_to(result[name], len(rows)) for name in tape.names], axis=-1)
