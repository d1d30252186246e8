"""Which angles the motion is followed in, and the inputs from them.

An input stops being a coordinate where its linkage folds: at a dead point of its own it turns back, while the mechanism
goes on. There another link's angle takes its place, chosen by how far every loop is from folding over it; the inputs
follow from the pose.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import replace
from functools import cached_property
from itertools import product

import numpy as np

from dalembert.arithmetic.engines import run
from dalembert.arithmetic.tape import Tape
from virtualwork.branch.assembly import Assembly
from virtualwork.describe.errors import MechanismError
from virtualwork.describe.parts import GROUND, Guess, Input
from virtualwork.formulas.numbers import Reals
from virtualwork.intime.equations import Equations
from virtualwork.intime.watch import Floats
from virtualwork.motion import Motion

TURN = 2 * math.pi
# the relative radicand of a loop's closed form, the squared sine of its transmission angle, below which another
# coordinate is looked for; by how much it must be better
FOLDING, BETTER = 0.02, 4.0


class Coordinates:
    """The coordinates of one path, and the mechanism's own inputs in them.

    Attributes
    ----------
    equations : Equations
    own : bool
        Whether they are the inputs themselves.
    """

    def __init__(self, equations: Equations, inputs: tuple[Input, ...]) -> None:
        self.equations, self.inputs = equations, inputs
        self.own = equations.mechanism.inputs == inputs

    def of(self, equations: Equations) -> Coordinates:
        """The same coordinates with the equations in another mode of friction."""
        other = copy(self)
        other.equations = equations
        return other

    def motion(
        self, q: Reals, v: Reals | float = 0.0, a: Reals | float = 0.0, t: Reals | None = None
    ) -> Motion:
        """The motion over coordinates (n, k)."""
        found = Motion(self.equations.assembly, q, v, a)
        found.poses.time = t
        return found

    def states(self, q: Reals, v: Reals, a: Reals, near: Reals) -> tuple[Reals, Reals, Reals]:
        """The inputs, their speeds and accelerations (n, k); of the inputs' whole turns those nearest to `near`."""
        if self.own:
            return q, v, a
        motion = self.motion(q, v, a)
        found = np.empty((3, *q.shape))
        for j, entry in enumerate(self.inputs):
            if entry.is_slide:
                slide = motion.slide(entry.name)
                found[:, :, j] = slide.position, slide.speed, slide.acceleration
                continue
            link = motion.link(entry.name)
            value = np.array([link.angle, link.omega, link.alpha])
            if entry.on != GROUND:
                base = motion.link(entry.on)
                value -= np.array([base.angle, base.omega, base.alpha])
            value[0] += TURN * np.round((near[:, j] - value[0]) / TURN)
            found[:, :, j] = value
        return found[0], found[1], found[2]

    # --- how far from folding -----------------------------------------------------------------------------------
    @cached_property
    def _margins(self) -> Tape | None:
        """The relative radicands of all loops; None where there is none to look at."""
        a = self.equations.assembly
        names = [g.name for g in a.plan.groups if g.kind not in ("Newton", "PRP")]
        if not names or a.geared or len(names) < len(a.plan.groups):
            return None
        recording = self.equations.recording(False, False, False)
        return recording.tape([("margin", name) for name in names])

    @cached_property
    def _margin(self) -> Callable[[float, Floats, Floats], tuple[float, ...]] | None:
        return None if self._margins is None else self.equations.function(self._margins)

    def stands(self, q: Reals) -> bool:
        """Whether no loop folds at any of many places, (n, k); False where that takes more than the tape."""
        if self._margins is None:
            return True
        given = {f"q{j}": q[:, j] for j in range(q.shape[1])}
        if not given.keys() >= set(self._margins.inputs):
            return False
        return bool(len(q) == 0 or (run(self._margins, given).table >= FOLDING).all())

    def margin(self, q: Floats) -> float:
        """How far every loop is from folding: the least relative radicand, 1 at a right angle."""
        if self._margin is None:
            return 1.0
        try:
            return min(self._margin(0.0, q, q))
        except (ZeroDivisionError, ValueError, OverflowError):
            return 0.0

    def folds(self, q: Floats) -> bool:
        """Whether other coordinates should be looked for: a loop folds, and not towards a change point."""
        return self.margin(q) < FOLDING and not self.equations.passes(q[0])

    def others(self, q: Floats) -> Iterator[Coordinates]:
        """The same pose in other coordinates: the inputs themselves, then every link's angle for one of those now used."""
        m, k = self.equations.mechanism, self.equations.k
        if any(force.history for force in m.forces):
            # they are given over the input
            return
        motion = self.motion(np.array([q]))
        angles = {name: float(motion.link(name).angle[0]) for name in m.links}
        points = {
            name: complex(motion.point(name).complex(0)[0])
            for link in m.links.values()
            for name in link.points
            if name not in m.ground
        }
        choices = [] if self.own else [self.inputs]
        for j, name in product(range(k), m.links):
            if all(e.link != name for e in m.inputs):
                choices.append((*m.inputs[:j], Input(link=name), *m.inputs[j + 1 :]))
        for entries in choices:
            at = tuple(self._value(motion, entry) for entry in entries)
            described = replace(m, inputs=entries, guess=Guess(at, angles, points))
            try:
                yield Coordinates(type(self.equations)(Assembly.from_guess(described)), self.inputs)
            except MechanismError:
                # the link cannot be a coordinate: others are
                continue

    @staticmethod
    def _value(motion: Motion, entry: Input) -> float:
        if entry.is_slide:
            return float(motion.slide(entry.name).position[0])
        angle = float(motion.link(entry.name).angle[0])
        return angle if entry.on == GROUND else angle - float(motion.link(entry.on).angle[0])

    def better(self, q: Floats) -> Coordinates | None:
        """The coordinates in which every loop is farthest from folding at a pose; None where none are much better."""
        best, most = None, BETTER * max(self.margin(q), 0.0)
        for other in self.others(q):
            found = other.margin(list(other.equations.mechanism.at))
            if found > max(most, FOLDING):
                best, most = other, found
        return best
