"""Variants of a mechanism that are let go together: lanes of one loop of steps, each with steps of its own.

The formulas are recorded once with the varied dimensions as inputs of the tape. What a lane cannot do is done singly,
as `Mechanism.simulate` does it: loops that fold, change points on the way, stiff dampers, friction, tables, variants
whose branch is not told by a comparison.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.engines import run
from dalembert.arithmetic.tape import Tape
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import MechanismError
from virtualwork.family.family import Family
from virtualwork.family.part import Part, Solver
from virtualwork.family.written import Written
from virtualwork.formulas.numbers import Reals
from virtualwork.intime.control import first_steps
from virtualwork.intime.coordinates import FOLDING
from virtualwork.intime.ends import events, passed
from virtualwork.intime.estimate import FIRST, GAIN, LEAST, TRIES, rounding, share, spread
from virtualwork.intime.explicit import names
from virtualwork.intime.marching import beginning, follow, march, over
from virtualwork.intime.powers import motion_of, places_and_speeds
from virtualwork.intime.run import levels_of, not_met, reached, rising, simulate
from virtualwork.intime.runs import Runs
from virtualwork.intime.watch import Levels

Mask = NDArray[np.bool_]
# steps of one variant; beyond them it is done singly
MOST = 20_000
# rounds between two looks, at first and later
SOON, LATER = 16, 128


class Variants(Family):
    """Variants of a mechanism that can be let go; `Mechanism.vary` makes them."""

    # what is written down once: the formulas, and the tapes of accelerations and energies
    alike: Solver | None = None
    tapes: tuple[Tape, Tape] | None = None

    def simulate(
        self,
        times: ArrayLike,
        angle: ArrayLike | None = None,
        speed: ArrayLike | None = None,
        accuracy: float = 1e-9,
        until: Mapping[str, float] | None = None,
    ) -> Runs:
        """Let go of the inputs of every variant; see `Mechanism.simulate`.

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
            np.stack(self.own(name), axis=-1) if given is None else _starts(what, given, len(self), k)
            for what, name, given in (("angle", "value", angle), ("speed", "speed", speed))
        )
        levels = levels_of(self.mechanism.inputs, until)
        runs = Runs.of(self, t)
        alone = np.ones(len(self), dtype=bool)
        lanes = _Lanes.of(self, t, q, v, levels)
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
            runs.put(int(i), own)
        return runs


def _starts(name: str, given: ArrayLike, v: int, k: int) -> Reals:
    value = np.asarray(given, dtype=float)
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
    written: Written
    rates: Tape
    energy: Tape
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
        if solver.written is None or not solver.together.any():
            return None
        family.alike = solver
        given = {d.path: family.values[:, i] for i, d in enumerate(family.dimensions)}
        given |= {f"sign {name}": sign for name, sign in solver.signs.items()}
        if family.tapes is None:
            try:
                family.tapes = motion_of(solver.written.recording, k)
            except ZeroDivisionError:
                # no mass moves: each says so
                return None
        rates, energy = family.tapes
        if not {*places_and_speeds(k), *given}.issuperset(rates.inputs):
            return None
        scale = np.ones((len(q), k))
        slides = [j for j, e in enumerate(m.inputs) if e.is_slide]
        if slides:
            scale[:, slides] = np.array([family[i].size for i in range(len(q))])[:, None]
        return cls(
            family, solver, solver.written, rates, energy, given, solver.together, t, q, v, scale, levels
        )

    @property
    def k(self) -> int:
        """Inputs."""
        return int(self.q.shape[1])

    def some(self, rows: Any) -> dict[str, Reals]:
        """What enters the tapes in some variants."""
        return {name: x[rows] for name, x in self.given.items()}

    # --- through time -----------------------------------------------------------------------------------------------
    def fill(self, runs: Runs, accuracy: float) -> Mask:
        """Let go of all that can be; which variants must be done singly, (v,)."""
        alone = ~self.together
        rows, tolerance = np.flatnonzero(self.together), max(LEAST, FIRST * accuracy)
        nodes = self.way(rows, tolerance, alone)
        for tries in range(TRIES):
            coarse, nodes = nodes, self.halved(rows, nodes)
            times = self.times(rows, nodes, alone)
            found = self._at(rows, nodes, times, self._error(coarse, nodes, times, share(tolerance)))
            past = np.isnan(times)[:, :, None]
            worst = np.where(past, 0.0, found["error"] / self.scale[rows, None]).max(axis=(1, 2), initial=0.0)
            holds = worst <= accuracy
            self._put(runs, rows[holds], {name: x[holds] for name, x in found.items()})
            tolerance /= GAIN + 1
            last = tolerance <= LEAST or tries == TRIES - 1 or len(nodes["t"]) > MOST
            # what does not hold is tried again, and at last left to say itself why not
            again = ~holds & ~alone[rows] & np.isfinite(worst) & (not last)
            alone[rows[~holds & ~again]] = True
            if not again.any():
                break
            rows, nodes = rows[again], {name: x[:, again] for name, x in nodes.items()}
        return alone

    def _constants(self, rows: NDArray[np.intp]) -> dict[str, Any]:
        """What enters the loop in some variants."""
        return self.some(rows) | {f"scale{j}": self.scale[rows, j] for j in range(self.k)}

    def way(self, rows: NDArray[np.intp], tolerance: float, alone: Mask) -> dict[str, Reals]:
        """The nodes of a way through all times, (rounds, lanes); marks in `alone` what has to be done singly.

        A round in which a lane took no step repeats its last node.
        """
        k, t = self.k, self.t
        span = float(t[-1] - t[0])
        given = self._constants(rows) | {"tolerance": tolerance, "end": float(t[-1]), "span": span}
        places, speeds, rates = names(k)
        q, v = self.q[rows].T, self.v[rows].T
        with np.errstate(all="ignore"):
            begin = run(self.rates, given | dict(zip((*places, *speeds), (*q, *v), strict=True)))
            slopes = np.stack([np.broadcast_to(begin[name], len(rows)) for name in rates])
        fastest, h = first_steps(span, tolerance, self.scale[rows].T, q, v, slopes)
        state = beginning(float(t[0]), q, v, slopes, h, fastest, 0.0)
        state["left"] = np.where(np.isfinite(slopes).all(axis=0) & (span > 0), 1.0, 0.0)
        kept = ("t", *places, *speeds, *rates, "work")
        nodes = [{name: np.broadcast_to(state[name], len(rows))[None] for name in kept}]
        taken = 0
        while state["left"].max() > 0 and taken < MOST:
            found = march(k, self.rates, given, state, SOON if taken < 4 * SOON else LATER)
            state = found.state
            nodes.append(found.nodes)
            taken += len(found.nodes["t"])
            if self.levels:
                # one step beyond the event is enough
                last = {
                    name: np.concatenate([*(part[name] for part in nodes[-2:-1]), found.nodes[name]])
                    for name in kept
                }
                state["left"] = np.where(passed(last, self.levels, k)[:-1].any(axis=0), 0.0, state["left"])
        whole = {name: np.concatenate([part[name] for part in nodes]) for name in kept}
        ended = whole["t"][-1] >= t[-1]
        if self.levels:
            hits = passed(whole, self.levels, k)
            ended |= hits.any(axis=0)
            beyond = np.where(hits.any(axis=0), np.argmax(hits, axis=0) + 2, len(whole["t"]))
            at = np.minimum(np.arange(len(whole["t"]))[:, None], beyond)
            whole = {name: np.take_along_axis(x, at, axis=0) for name, x in whole.items()}
        alone[rows[~ended]] = True
        alone[rows[self._folds(rows, whole)]] = True
        return whole

    def halved(self, rows: NDArray[np.intp], nodes: Mapping[str, Reals]) -> dict[str, Reals]:
        """The nodes of the same ways in steps half as long."""
        k = self.k
        places, speeds, rates = names(k)
        first = {name: x[0] for name, x in nodes.items()}
        none = [np.zeros(len(rows))] * k
        state = beginning(
            first["t"],
            [first[x] for x in places],
            [first[x] for x in speeds],
            [first[x] for x in rates],
            0.0,
            none,
            first["work"],
        )
        t = nodes["t"]
        times = np.stack([0.5 * (t[1:] + t[:-1]), t[1:]], axis=1).reshape(-1, t.shape[1])
        found = follow(k, self.rates, self.some(rows), state, times).nodes
        return {name: np.concatenate([x[None], found[name]]) for name, x in first.items()}

    def times(self, rows: NDArray[np.intp], nodes: Mapping[str, Reals], alone: Mask) -> Reals:
        """The times up to each lane's event, it the last, (lanes, n); then NaN."""
        found = np.tile(self.t, (len(rows), 1))
        if self.levels:
            ends = events(self.k, self.rates, self.some(rows), nodes, self.levels)
            self.late[rows] = np.isnan(ends)
            # the level that the coarser way passed at its very end
            alone[rows[np.isnan(ends) & (nodes["t"][-1] < self.t[-1])]] = True
            for row, end in zip(found, ends, strict=True):
                if end < self.t[-1]:
                    its = reached(self.t, end)
                    row[: len(its)], row[len(its) :] = its, np.nan
        return found

    def _error(
        self, coarse: Mapping[str, Reals], fine: Mapping[str, Reals], times: Reals, of: float
    ) -> Reals:
        """The error of the inputs at all times, (lanes, n, k): that of the coarser way's next node."""
        places, speeds, rates = names(self.k)
        q, v, a = (np.stack([fine[name][::2].T for name in x], axis=-1) for x in (places, speeds, rates[:-1]))
        other = np.stack([coarse[name].T for name in places], axis=-1)
        found = spread(q, other, of) + rounding(coarse["t"].T, q, v, a)
        at = np.stack([(coarse["t"] < x).sum(axis=0) for x in times.T], axis=1)
        at = np.minimum(at, len(coarse["t"]) - 1)
        return np.asarray(found[np.arange(len(found))[:, None], at])

    def _at(
        self, rows: NDArray[np.intp], nodes: Mapping[str, Reals], t: Reals, error: Reals
    ) -> dict[str, Reals]:
        """The states at all times (lanes, n), from the node before each; NaN where the time is."""
        k = self.k
        places, speeds, rates = names(k)
        before = np.stack([(nodes["t"] <= x).sum(axis=0) - 1 for x in t.T], axis=1)
        lanes = np.arange(len(rows))[:, None]
        state = {name: x[np.maximum(before, 0), lanes] for name, x in nodes.items()}
        q, v, slopes = (np.stack([state[name] for name in of], axis=-1) for of in (places, speeds, rates))
        work, h = state["work"].copy(), t - state["t"]
        lane, on = np.nonzero(h > 0)
        if len(lane):
            here = (state["t"][lane, on], q[lane, on], v[lane, on], slopes[lane, on], h[lane, on])
            dq, dv, dw = over(k, self.rates, self.some(rows[lane]), *here)
            q[lane, on] += dq
            v[lane, on] += dv
            work[lane, on] += dw
        past = np.isnan(t)
        for x in (q, v, work, error):
            x[past] = np.nan
        return {"t": t, "q": q, "v": v, "work": work, "error": error}

    def _folds(self, rows: NDArray[np.intp], nodes: Mapping[str, Reals]) -> Mask:
        """In which lanes a loop folds on the way."""
        closed = [g.name for g in self.written.closed]
        n = len(nodes["t"])
        folds = np.zeros(len(rows), dtype=bool)
        if closed:
            tape = self.written.tape([("margin", name) for name in closed])
            given = {name: np.tile(x, n) for name, x in self.some(rows).items()}
            given |= {f"q{j}": nodes[f"q{j}"].ravel() for j in range(self.k)}
            with np.errstate(all="ignore"):
                found = run(tape, given)
            for name in tape.names:
                margin = np.broadcast_to(found[name], n * len(rows)).reshape(n, -1)
                folds |= ~(margin >= FOLDING).all(axis=0)
        q = nodes["q0"]
        self.low[rows] = np.fmin(self.low[rows], q.min(axis=0))
        self.high[rows] = np.fmax(self.high[rows], q.max(axis=0))
        return folds

    def meet(self) -> Mask:
        """Which variants may have a change point on their way, (v,)."""
        if self.k > 1:
            return np.zeros(len(self.q), dtype=bool)
        f, ends = self.family, np.stack([self.low, self.high], axis=1)[:, :, None]
        rates: list[list[Any]] = [[1.0], [1.0], [0.0]]
        return ~Solver(Part(f.mechanism, f.dimensions, f.values, ends, rates), self.solver).together

    def _put(self, runs: Runs, rows: NDArray[np.intp], found: Mapping[str, Reals]) -> None:
        n = len(self.t)
        given = {name: np.repeat(x, n) for name, x in self.some(rows).items()}
        given |= dict(
            zip(
                places_and_speeds(self.k),
                np.concatenate([found["q"], found["v"]], axis=2).reshape(-1, 2 * self.k).T,
                strict=True,
            )
        )
        with np.errstate(all="ignore"):
            slopes, energy = (run(tape, given) for tape in (self.rates, self.energy))
        for j in range(self.k):
            runs.inputs[2, rows, :, j] = np.broadcast_to(slopes[f"a{j}"], len(rows) * n).reshape(-1, n)
        for of, values in zip((0, 1, 3), (found["q"], found["v"], found["error"]), strict=True):
            runs.inputs[of, rows] = values
        runs.energies[0, rows] = np.broadcast_to(energy["energy"], len(rows) * n).reshape(-1, n)
        runs.energies[1, rows] = found["work"]
        runs.times[rows] = found["t"]
