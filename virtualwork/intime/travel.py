"""One way through all times, at one tolerance: as many paths as it takes, each in coordinates that hold there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from virtualwork.formulas.numbers import Reals
from virtualwork.intime.coordinates import FOLDING, TURN, Coordinates
from virtualwork.intime.equations import Floats
from virtualwork.intime.explicit import DormandPrince
from virtualwork.intime.joined import Joined
from virtualwork.intime.path import MOST, Path, Watch, walk

# changes of coordinates in one simulation
CHANGES = 10_000


@dataclass
class Leg:
    """A path and its coordinates; `first` are the inputs at its beginning."""

    coordinates: Coordinates
    path: Path
    first: Floats

    @cached_property
    def inputs(self) -> Reals:
        """The inputs at the nodes (n, k), whole turns and all."""
        q, v = np.array(self.path.q), np.array(self.path.v)
        if self.coordinates.own:
            return q
        rates = np.array(self.path.rates)[:, : q.shape[1]]
        found, speed, _ = self.coordinates.states(q, v, rates, np.zeros_like(q))
        step = np.diff(self.path.t)[:, None]
        near = 0.5 * (speed[1:] + speed[:-1]) * step
        change = np.diff(found, axis=0)
        turning = np.array([not e.is_slide for e in self.coordinates.inputs])
        change = np.where(turning, change - TURN * np.round((change - near) / TURN), change)
        return np.asarray(self.first + np.concatenate([np.zeros((1, q.shape[1])), np.cumsum(change, axis=0)]))

    def at(self, times: Reals) -> tuple[Reals, Reals, Reals, Reals]:
        """The coordinates, their speeds and accelerations, and the work."""
        q, v, work = self.path.at(times)
        return q, v, self.path.equations.many(times, q, v)[:, : q.shape[1]], work

    def states(self, times: Reals) -> tuple[Reals, Reals, Reals, Reals]:
        """The inputs, their speeds and accelerations, and the work."""
        q, v, a, work = self.at(times)
        if self.coordinates.own:
            return q, v, a, work
        t = np.array(self.path.t)
        i = np.clip(np.searchsorted(t, times, side="right") - 1, 0, len(t) - 1)
        near = self.inputs[i]
        speed = self.coordinates.states(q, v, a, near)[1]
        return *self.coordinates.states(q, v, a, near + 0.5 * speed * (times - t[i])[:, None]), work


@dataclass
class Travel:
    """The legs, one after the other, and why the last one ended."""

    legs: list[Leg] = field(default_factory=list)
    ended: str = ""

    @property
    def end(self) -> float:
        """The last time reached."""
        return self.legs[-1].path.t[-1]

    @property
    def steps(self) -> int:
        """How many steps were taken."""
        return sum(len(leg.path.t) - 1 for leg in self.legs)

    @property
    def nodes(self) -> Reals:
        """The times between steps."""
        return np.unique(np.concatenate([leg.path.t for leg in self.legs]))

    @property
    def methods(self) -> list[str]:
        """The methods used."""
        return list(dict.fromkeys(leg.path.method.name for leg in self.legs))

    def _parts(self, times: Reals) -> list[tuple[Leg, Any]]:
        """The legs, each with the rows of the times on it."""
        begins = np.array([leg.path.t[0] for leg in self.legs])
        which = np.clip(np.searchsorted(begins, times, side="right") - 1, 0, None)
        return [(leg, rows) for i, leg in enumerate(self.legs) if len(rows := np.flatnonzero(which == i))]

    def at(self, times: Reals) -> tuple[Reals, Reals, Reals, Reals]:
        """The inputs, their speeds and accelerations (n, k), and the work done (n,)."""
        k = self.legs[0].path.equations.k
        out = [np.empty((len(times), k)) for _ in range(3)]
        work = np.empty(len(times))
        for leg, rows in self._parts(times):
            *found, work[rows] = leg.states(times[rows])
            for whole, part in zip(out, found, strict=True):
                whole[rows] = part
        return out[0], out[1], out[2], work

    def energy(self, times: Reals) -> Reals:
        """Kinetic energy and that of gravity and springs, (n,) J."""
        out = np.empty(len(times))
        for leg, rows in self._parts(times):
            q, v, _ = leg.path.at(times[rows])
            out[rows] = leg.path.equations.energies(q, v)
        return out

    def motion(self, times: Reals) -> Any:
        """The motion through times: a `Motion`, or several joined."""
        parts = [(rows, leg.coordinates.motion(*leg.at(times[rows])[:3])) for leg, rows in self._parts(times)]
        return parts[0][1] if len(parts) == 1 else Joined(parts, len(times))

    def link_angle(self, name: str, times: Reals) -> Reals:
        """A link's angle (n,) rad, followed from the first time on through all whole turns."""
        every = np.union1d(self.nodes[self.nodes <= times[-1]], times)
        link = self.motion(every).link(name)
        angle, omega = link.angle, link.omega
        near = 0.5 * (omega[1:] + omega[:-1]) * np.diff(every)
        change = np.diff(angle)
        change -= TURN * np.round((change - near) / TURN)
        whole = angle[0] + np.concatenate([[0.0], np.cumsum(change)])
        for j, entry in enumerate(self.legs[0].coordinates.inputs):
            if entry.link == name and entry.on == "ground":
                # as the input itself is counted
                whole += TURN * np.round((self.legs[0].first[j] - whole[0]) / TURN)
        return np.asarray(whole[np.searchsorted(every, times)])


def travel(
    coordinates: Coordinates,
    start: tuple[float, Floats, Floats],
    end: float,
    tolerance: float,
    until: Mapping[int, float],
) -> Travel:
    """Go from a state of the inputs to a time, or until an input has a value.

    Parameters
    ----------
    coordinates : Coordinates
        The inputs themselves.
    until : mapping of an input's number to its value
    """
    found = Travel()
    t, q, v = start
    inputs, work = q, 0.0
    while True:
        # what the inputs were at the last node
        near = list(inputs)
        folding = coordinates.margin(q) < FOLDING

        def check(t: float, q: Floats, v: Floats) -> str:
            nonlocal folding
            if until and not coordinates.own:
                near[:] = coordinates.states(*(np.array([x]) for x in (q, v, v, near)))[0][0].tolist()
            was, folding = folding, coordinates.margin(q) < FOLDING
            return "folding" if folding and not was else ""

        watches = [
            Watch("until", _input(coordinates, j, near), [level], ends=True) for j, level in until.items()
        ]
        budget = MOST - found.steps
        path = walk(
            coordinates.equations,
            DormandPrince(),
            (t, q, v, work),
            end,
            tolerance,
            watches,
            check=check,
            budget=budget,
        )
        found.legs.append(Leg(coordinates, path, inputs))
        found.ended = path.ended
        if path.ended not in ("folding", "lost") or len(found.legs) > CHANGES:
            return found
        other = coordinates.better(path.q[-1])
        if other is None:
            if path.ended == "lost":
                return found
            other = coordinates
        t, work = path.t[-1], path.work[-1]
        inputs = found.legs[-1].inputs[-1].tolist()
        q, v = _in(coordinates, other, path.q[-1], path.v[-1])
        coordinates = other


def _input(coordinates: Coordinates, j: int, near: Floats) -> Callable[[float, Floats, Floats], float]:
    """Input j at a state."""
    if coordinates.own:
        return lambda t, q, v: q[j]
    return lambda t, q, v: float(coordinates.states(*(np.array([x]) for x in (q, v, v, near)))[0][0, j])


def _in(old: Coordinates, new: Coordinates, q: Floats, v: Floats) -> tuple[Floats, Floats]:
    """A state in other coordinates: where they are, and the speeds of what they measure."""
    motion = old.motion(np.array([q]), np.array([v]))
    speeds = []
    for entry in new.equations.mechanism.inputs:
        if entry.is_slide:
            speeds.append(float(motion.slide(entry.name).speed[0]))
        else:
            base = 0.0 if entry.on == "ground" else float(motion.link(entry.on).omega[0])
            speeds.append(float(motion.link(entry.name).omega[0]) - base)
    return list(new.equations.mechanism.at), speeds
