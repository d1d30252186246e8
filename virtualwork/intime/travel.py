"""One way through all times, at one tolerance: as many paths as it takes, each in coordinates that hold there."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.intime.coordinates import BETTER, FOLDING, Coordinates, Monitor, measured
from virtualwork.intime.equations import TURN, Lost
from virtualwork.intime.friction import Rubbing
from virtualwork.intime.growth import Off, within
from virtualwork.intime.implicit import Radau
from virtualwork.intime.path import Method, Path, followed
from virtualwork.intime.sticking import gains, holding, rests
from virtualwork.intime.walk import MOST, Walk
from virtualwork.intime.watch import Floats, noise

# changes of coordinates in one simulation
CHANGES = 10_000
# changes of the mode of friction at one time, for each joint that rubs
MODES = 3
CHATTERS = "it is not determined which joints stick there and which slide"
GAINS = "friction would drive joint {} there: its direction of sliding is not determined"
UNDECIDED = "it is so close to a change point that rounding would decide its further motion"
NO_FURTHER = "it cannot move further: a limit, or a pose where its motion is not determined"


# changes of coordinates and of their speeds, (n, k) each
Moved = tuple[Reals, Reals]


@dataclass
class Travel:
    """The legs, one after the other, and why the last one ended."""

    legs: list[Path] = field(default_factory=list)
    ended: str = ""
    # the solution in steps twice as long, where there is one
    coarse: Travel | None = None

    @property
    def end(self) -> float:
        """The last time reached."""
        return self.legs[-1].end

    @property
    def steps(self) -> int:
        """How many steps were taken."""
        return sum(leg.steps for leg in self.legs)

    @property
    def stiff(self) -> bool:
        """Whether a leg ended for it was stiff."""
        return any(leg.ended == "stiff" for leg in self.legs)

    @property
    def rough(self) -> bool:
        """Whether halves of steps gain less than the method's order: near a fold of a loop, or where steps pass kinks."""
        return any(leg.ended == "folding" or None in leg.equations.kinks for leg in self.legs)

    @property
    def undecided(self) -> float | None:
        """The first time at which it rests at a change point; None where it never does.

        With a speed the motion is decided there: only one of the branches that meet goes on with it.
        """
        for leg in self.legs:
            if not leg.equations.crosses:
                continue
            nodes, meets = leg.nodes, leg.equations.meets
            t, q, v = (of.tolist() for of in (nodes.t, nodes.q[:, 0], nodes.v[:, 0]))
            rest = 1e-7 * max(map(abs, v))
            for i in range(len(t)):
                if meets(q[i]) and abs(v[i]) <= rest:
                    return float(t[i])
                if i and v[i] * v[i - 1] < 0:
                    turn = leg.turning(i - 1)
                    if meets(float(leg.at(np.array([turn]))[0][0, 0])):
                        return turn
        return None

    def backwards(self) -> None:
        """From now on reach every time from the node after it.

        Where a time lies in the first part of a step another solution reaches it by the very same step: from behind
        it is another one.
        """
        for leg in self.legs:
            leg.backwards = True

    @property
    def nodes(self) -> Reals:
        """The times between steps."""
        return np.unique(np.concatenate([leg.nodes.t for leg in self.legs]))

    @property
    def jumps(self) -> Floats:
        """The times at which a joint with friction comes to rest, turns back or breaks away."""
        return [leg.end for leg in self.legs if leg.ended.startswith("friction")]

    def blur(self, times: Reals) -> Reals:
        """How far the coordinate may be wrong for interpolation near change points, at times between nodes too, (n,)."""
        t, places, place = [self.legs[0].nodes.t[:1]], [np.zeros(1)], 0.0
        # the square of the speed's error by all passages before
        before = 0.0
        for leg in self.legs:
            if leg.steps and leg.equations.crosses:
                nodes, h = leg.nodes, np.diff(leg.nodes.t)
                first = nodes.t, nodes.q[:, 0], nodes.v[:, 0]
                each, point = leg.equations.blur(*first, *leg.method.stages)
                # errors of one passage are alike, those of several are not
                parts = np.split(each, np.flatnonzero(np.diff(point)) + 1)
                sums = [np.cumsum(part) for part in parts]
                ends = before + np.cumsum([0.0, *(x[-1] ** 2 for x in sums)])
                speeds = np.sqrt(np.concatenate([y + x**2 for x, y in zip(sums, ends, strict=False)]))
                way = place + np.cumsum(speeds * h)
                t, places = [*t, nodes.t[1:]], [*places, way]
                before, place = float(ends[-1]), float(way[-1])
        return np.interp(times, np.concatenate(t), np.concatenate(places))

    @property
    def judged(self) -> bool:
        """Whether the steps of all legs are judged by their defect."""
        return all(leg.judged for leg in self.legs)

    @cached_property
    def off(self) -> tuple[Reals, Reals, Reals]:
        """Times between steps of the coarse solution (n,); what the motion has made of the rounding of all steps before, and of their errors: of inputs and speeds, the largest so far, (n, 2k), the latter within the step before too."""
        between = (self.coarse or self).nodes
        times: list[Reals] = []
        offs: list[list[Reals]] = [[], [], []]
        last: Off | None = None
        for before, leg in zip([None, *self.legs], self.legs, strict=False):
            if before is not None and last is not None and before.followed and leg.followed:
                _, q, v, *_ = before.last
                last = last.onto(before.coordinates.onto(leg.coordinates, q, v))
            begin, end = leg.rows[0][0], leg.end
            inner = between[(between > begin) & (between < end)]
            t = np.concatenate([[begin], inner, [end][: leg.steps]])
            *parts, middle, last = leg.off(t, last)
            times.append(t)
            for of, x in zip(offs, (*parts, np.pad(middle, ((0, 0), (1, 0)))), strict=True):
                of.append(x)
        rounded, stepped, middle = (np.concatenate(of, axis=1) for of in offs)
        rounded, stepped = (np.maximum.accumulate(of, axis=1).T for of in (rounded, stepped))
        stepped = within(stepped.T, middle[:, 1:], np.diff(np.concatenate(times))).T
        k, scale = self.legs[0].equations.k, self.legs[0].equations.scale
        rounded[:, :k] = np.minimum(rounded[:, :k], scale)
        return np.concatenate(times), rounded, stepped

    @property
    def halves(self) -> Floats:
        """The times of the nodes, and in the middle between them."""
        return [x for a, b in pairwise(self.nodes.tolist()) for x in (0.5 * (a + b), b)]

    @property
    def methods(self) -> list[str]:
        """The methods used."""
        return list(dict.fromkeys(leg.method.name for leg in self.legs))

    def _parts(self, times: Reals) -> list[tuple[Path, Any]]:
        """The legs, each with the rows of the times on it."""
        begins = np.array([leg.rows[0][0] for leg in self.legs])
        which = np.clip(np.searchsorted(begins, times, side="right") - 1, 0, None)
        return [(leg, rows) for i, leg in enumerate(self.legs) if len(rows := np.flatnonzero(which == i))]

    def at(self, times: Reals) -> tuple[Reals, Reals, Reals, Reals]:
        """The inputs, their speeds and accelerations (n, k), and the work done (n,)."""
        k = self.legs[0].equations.k
        out = [np.empty((len(times), k)) for _ in range(3)]
        work = np.empty(len(times))
        for leg, rows in self._parts(times):
            *parts, work[rows] = leg.states(times[rows])
            for whole, part in zip(out, parts, strict=True):
                whole[rows] = part
        return out[0], out[1], out[2], work

    def undetermined(self, times: Reals) -> NDArray[np.bool_]:
        """Whether friction holds joints that rub, and statics does not determine it, at times, (n,)."""
        still = np.zeros(len(times), dtype=bool)
        for leg, rows in self._parts(times):
            if isinstance(leg.equations, Rubbing):
                still[rows] = rests(leg.equations, leg.at(times[rows])[1])
        return still & np.isnan(self.holding(times)).all(axis=0)

    def holding(self, times: Reals) -> Reals:
        """The friction of each contact (c, n) at times, NaN where none holds a joint or statics does not determine it."""
        parts = []
        for leg, rows in self._parts(times):
            held = np.full((1, len(rows)), np.nan)
            if isinstance(leg.equations, Rubbing):
                held = holding(leg.equations, times[rows], *leg.at(times[rows])[:2])
            parts.append((rows, held))
        result = np.empty((len(parts[0][1]), len(times)))
        for rows, held in parts:
            result[:, rows] = held
        return result

    def energy(self, times: Reals, moved: Moved | None = None) -> Reals:
        """Kinetic energy and that of gravity and springs, (n,) J; `moved`: with other inputs and speeds, by so much."""
        out = np.empty(len(times))
        for leg, rows in self._parts(times):
            q, v, _, _ = leg.at(times[rows])
            if moved is not None:
                q, v = q + moved[0][rows], v + moved[1][rows]
            out[rows] = leg.equations.energies(times[rows], q, v)
        return out

    def motion(self, times: Reals, moved: Moved | None = None) -> Any:
        """The motion through times: a `Motion`, or several joined; `moved`: with other inputs and speeds, by so much."""
        parts = []
        for leg, rows in self._parts(times):
            q, v, a, _ = leg.at(times[rows])
            if moved is not None:
                # other coordinates may be as wrong as the inputs; what friction locks has no speed
                locked = isinstance(leg.equations, Rubbing) and leg.equations.locked
                q, v = q + moved[0][rows], v if locked else v + moved[1][rows]
                a = leg.equations.many(times[rows], q, v)[:, :-1]
            part = leg.coordinates.motion(q, v, a, times[rows])
            if isinstance(leg.equations, Rubbing) and rests(leg.equations, v).any():
                part.poses.held = partial(holding, leg.equations, times[rows], q, v)
            parts.append((rows, part))
        return parts[0][1] if len(parts) == 1 else Joined(parts, len(times))

    def link_angle(self, name: str, times: Reals, moved: Moved | None = None) -> Reals:
        """A link's angle (n,) rad, followed from the first time on through all whole turns; `moved` as of `motion`."""
        every = np.union1d(self.nodes[self.nodes <= times[-1]], times)
        link = self.motion(every).link(name)
        angle, omega = link.angle[:, None], link.omega[:, None]
        whole = angle[0] + followed(angle, omega, every, True)[:, 0]
        for j, entry in enumerate(self.legs[0].coordinates.inputs):
            if entry.link == name and entry.on == "ground":
                # as the input itself is counted
                whole += TURN * np.round((self.legs[0].first[j] - whole[0]) / TURN)
        result = np.asarray(whole[np.searchsorted(every, times)])
        if moved is not None:
            off = self.motion(times, moved).link(name).angle - self.motion(times).link(name).angle
            result += off - TURN * np.round(off / TURN)
        return result


def travel(
    coordinates: Coordinates,
    start: tuple[float, Floats, Floats],
    end: float,
    tolerance: float,
    until: Mapping[int, float],
    method: Method,
    accuracy: float,
    like: Travel | None = None,
    progress: Callable[[float], None] | None = None,
) -> Travel:
    """Go from a state of the inputs to a time, or until an input has a value.

    Parameters
    ----------
    coordinates : Coordinates
        The inputs themselves.
    until : mapping of an input's number to its value
    method : Method
        Where it proves stiff, the implicit one goes on.
    accuracy : float
        What is wanted: a level that ends the motion is met so nearly, where the motion turns back there; where a loop is so nearly folded, and no other coordinate leads on, that rounding of the rates
        is more than it, rounding decides how the motion goes on.
    like : Travel, optional
        Each of its steps is done in two halves.
    """
    way, scale = Travel(), coordinates.equations.scale
    sides = dict.fromkeys(until, 0)
    plan = [] if like is None else like.halves
    t, q, v = start
    inputs, work = q, 0.0
    ended, idle, fastest = "", 0, 0.0
    while True:
        equations = coordinates.equations
        left: dict[str, float] = {}
        if isinstance(equations, Rubbing):
            before = equations.mode
            try:
                equations, v = equations.going_on(t, q, v, ended)
            except Lost:
                way.ended = NO_FURTHER
                return way
            # in the mode of this leg, out of which the next one comes
            coordinates, left = coordinates.of(equations), equations.left(ended, before)
            idle = idle + 1 if way.legs and not way.legs[-1].steps else 0
            if idle > MODES * (1 + len(equations.mode)):
                way.ended = CHATTERS
                return way
        below = FOLDING if not coordinates.folds(q) else coordinates.margin(q) / BETTER
        monitor = Monitor(coordinates, inputs, below, bool(until) and not coordinates.own, q[0])
        ends = [
            monitor.until(j, level, sides[j], float(noise(level, scale[j])), accuracy * scale[j])
            for j, level in until.items()
        ]
        if not way.legs:
            # levels at which the motion begins
            left |= {
                watch.name: level
                for watch, (j, level) in zip(ends, until.items(), strict=True)
                if abs(q[j] - level) <= watch.noise
            }
        watches = [*ends, *equations.watches()]
        most = MOST if like is None else MOST + 2 * like.steps
        path = Path(coordinates, method, inputs)
        arguments = path, end, tolerance, watches, equations.stops, monitor, most - way.steps, left, plan
        Walk(*arguments, progress).go(t, q, v, work)
        way.legs.append(path)
        way.ended = path.ended
        if isinstance(equations, Rubbing):
            fastest, gain = gains(path, fastest)
            if gain is not None:
                path.cut(gain[0])
                way.ended = path.ended = GAINS.format(gain[1])
                return way
        if path.ended.startswith("until"):
            way.ended = "until"
            return way
        sides = {j: watch.side for j, watch in zip(until, ends, strict=True)}
        if path.ended in ("end", "budget") or len(way.legs) > CHANGES:
            return way
        if path.ended == "undecided":
            # the last node lies where that has been
            path.drop()
        t, q, v, _, work = path.last
        inputs, ended = path.inputs[-1].tolist(), path.ended
        if ended.startswith("friction"):
            continue
        if path.ended == "stiff":
            method = Radau()
            continue
        way.ended = equations.outside(t, q, v) if path.ended == "lost" else ""
        if way.ended:
            # a table over time reads a little beyond its end
            path.back(equations.stops)
        other = None if way.ended else coordinates.better(q, inputs)
        if (
            other is None
            and coordinates.margin(q) * accuracy < EPS
            and not coordinates.equations.passes(q[0])
        ):
            path.ended = "undecided" if path.ended == "folding" else path.ended
        if path.ended == "undecided":
            way.ended = UNDECIDED
            return way
        if other is None and path.ended == "lost":
            way.ended = way.ended or NO_FURTHER
            return way
        if other is not None:
            motion = coordinates.motion(np.array([q]), np.array([v]))
            coordinates, q = other
            v = [float(measured(motion, entry, 1)[0]) for entry in coordinates.equations.mechanism.inputs]
            if isinstance(equations, Rubbing) and isinstance(coordinates.equations, Rubbing):
                direction = math.copysign(1.0, v[0]) if v[0] else 0.0
                coordinates = coordinates.of(coordinates.equations.in_mode(equations.mode, direction))
                # from rest it is decided again
                ended = ended if any(v) else ""


class Joined:
    """The attributes of `Motion`, requested of every part and joined row by row.

    Arrays are joined along their poses, pairs, lists and mappings of them part by part; whatever else a motion gives is joined in the same way.

    Examples
    --------
    >>> from virtualwork import Input, Link, Mechanism
    >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 2})}, inputs=Input(link="crank"))
    >>> parts = [(np.array([1, 2]), crank.motion([0.0, 1.0], speed=3.0)), (np.array([0]), crank.motion(0.5, speed=1.0))]
    >>> Joined(parts, 3).link("crank").omega
    array([1., 3., 3.])
    """

    def __init__(self, parts: Sequence[tuple[NDArray[np.intp], Any]], n: int) -> None:
        self._parts, self._n = parts, n

    def __repr__(self) -> str:
        return f"Joined({self._parts[0][1]!r}, {self._n} poses)"

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return self._joined([getattr(of, name) for _, of in self._parts])

    def __call__(self, *args: Any, **keywords: Any) -> Any:
        """Call the attribute of every part."""
        return self._joined([of(*args, **keywords) for _, of in self._parts])

    def _joined(self, answers: list[Any]) -> Any:
        first = answers[0]
        if isinstance(first, np.ndarray):
            out = np.empty((self._n, *first.shape[1:]), first.dtype)
            for (rows, _), part in zip(self._parts, answers, strict=True):
                out[rows] = part
            return out
        if isinstance(first, (tuple, list)) and all(isinstance(part, np.ndarray) for part in first):
            return type(first)(self._joined(list(parts)) for parts in zip(*answers, strict=True))
        if isinstance(first, dict):
            return {key: self._joined([part[key] for part in answers]) for key in first}
        if first is None or isinstance(first, (bool, str, float, list)):
            return first
        return Joined([(rows, of) for (rows, _), of in zip(self._parts, answers, strict=True)], self._n)
