"""Which angles the motion is followed in, and the inputs from them.

An input stops being a coordinate where its linkage folds: at a dead point of its own it turns back, while the mechanism
goes on. There another link's angle takes its place, chosen by how far every loop is from folding over it; the inputs
follow from the pose.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from dalembert.arithmetic.engines import run
from dalembert.arithmetic.recorded import Number
from dalembert.arithmetic.systems import regularity
from dalembert.arithmetic.tape import Tape
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import MechanismError
from virtualwork.describe.parts import GROUND, Guess, Input
from virtualwork.formulas.loops import Margin, Regularity
from virtualwork.formulas.numbers import PARTS, Reals
from virtualwork.formulas.positions import columns, unwound
from virtualwork.intime.equations import Equations
from virtualwork.intime.growth import BESIDE
from virtualwork.intime.watch import Floats, Watch
from virtualwork.motion import Motion

# the relative radicand of a loop's closed form, the squared sine of its transmission angle, below which another
# coordinate is looked for; by how much it must be better
FOLDING, BETTER = 0.02, 4.0
# by how much a pose may differ, on a circle of radius 1, and be the same
SAME = 1e-6


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
        # all that were made on the way, these among them
        self.made = [self]

    def of(self, equations: Equations) -> Coordinates:
        """The same coordinates with the equations in another mode of friction."""
        other = copy(self)
        other.equations = equations
        return other

    def otherwise(self) -> Coordinates:
        """The same coordinates, and all that follow them, interpolated from other poses near change points."""
        other = self.of(self.equations.otherwise())
        other.made = [other]
        return other

    def motion(
        self, q: Reals, v: Reals | float = 0.0, a: Reals | float = 0.0, t: Reals | None = None
    ) -> Motion:
        """The motion over coordinates (n, k)."""
        result = Motion(self.equations.assembly, q, v, a)
        result.poses.time = t
        return result

    def states(self, q: Reals, v: Reals, a: Reals, near: Reals) -> tuple[Reals, Reals, Reals]:
        """The inputs, their speeds and accelerations (n, k); of the inputs' whole turns those nearest to `near`."""
        if self.own:
            return q, v, a
        motion = self.motion(q, v, a)
        result = np.empty((3, *q.shape))
        for j, entry in enumerate(self.inputs):
            result[:, :, j] = [measured(motion, entry, order) for order in range(3)]
            if not entry.is_slide:
                result[0, :, j] = unwound(result[0, :, j], near[:, j])
        return result[0], result[1], result[2]

    # --- small changes ------------------------------------------------------------------------------------------
    def seen(self, q: Reals) -> Reals:
        """The derivatives of the inputs to the coordinates at many places (n, k), (inputs, coordinates, n)."""
        at_rest = np.zeros_like(q)
        rates = [self.states(q, at_rest + unit, at_rest, at_rest)[1].T for unit in np.eye(q.shape[1])]
        return np.stack(rates, axis=1)

    def onto(self, other: Coordinates, q: Floats, v: Floats) -> Reals:
        """The derivatives of a state (q, q̇) in other coordinates to that in these, (2k, 2k)."""
        k, entries = self.equations.k, other.equations.mechanism.inputs
        if entries == self.equations.mechanism.inputs:
            return np.eye(2 * k)
        by = BESIDE * np.array(self.equations.scale)
        places = np.concatenate([q + np.diag(by), q - np.diag(by), np.tile(q, (k, 1))])
        motion = self.motion(places, np.concatenate([np.tile(v, (2 * k, 1)), np.eye(k)]))
        after, before, own = np.split(np.array([measured(motion, entry, 1) for entry in entries]), 3, axis=1)
        return np.block([[own, np.zeros((k, k))], [(after - before) / (2 * by), own]])

    # --- how far from folding -----------------------------------------------------------------------------------
    @cached_property
    def _margins(self) -> Tape | None:
        """The relative radicands of all loops, or what takes their place; None without loops."""
        a = self.equations.assembly
        groups = [g for g in a.plan.groups if g.kind != "PRP"]
        recording = self.equations.recording(False, False, False)
        result: dict[str, Number] = {}
        for g in groups:
            if g.kind == "Newton":
                # of two links this is the sine, and its square the radicand
                regular = recording.value(Regularity(g.name))
                result[g.name] = regular * regular
            else:
                result[g.name] = recording.value(Margin(g.name))
        return recording.recorder.tape(result) if result else None

    @cached_property
    def _margin(self) -> Callable[[float, Floats, Floats], tuple[float, ...]] | None:
        return None if self._margins is None else self.equations.function(self._margins)

    def stands(self, q: Reals) -> bool:
        """Whether no loop folds at any of many places, (n, k); False where that takes more than the tape."""
        if self._margins is None:
            return True
        entering = {f"q{j}": q[:, j] for j in range(q.shape[1])}
        if not entering.keys() >= set(self._margins.inputs):
            return False
        return bool(len(q) == 0 or (run(self._margins, entering).table >= FOLDING).all())

    def margin(self, q: Floats) -> float:
        """How far every loop is from folding: the least relative radicand, 1 at a right angle."""
        if self._margin is None:
            return 1.0
        try:
            # NaN where a group without a closed form cannot be assembled
            return min(x if x == x else 0.0 for x in self._margin(0.0, q, q))
        except (ZeroDivisionError, ValueError, OverflowError):
            return 0.0

    def folds(self, q: Floats, below: float = FOLDING) -> bool:
        """Whether other coordinates should be looked for: a loop folds, and not towards a change point."""
        return self.margin(q) < below and not self.equations.passes(q[0])

    def better(self, q: Floats, near: Floats) -> tuple[Coordinates, Floats] | None:
        """Those in which every loop is farthest from folding at a pose, and their values; None where none are much better.

        The inputs themselves are taken with the whole turns of those that are near.
        """
        m, k = self.equations.mechanism, self.equations.k
        if any(force.history for force in m.forces):
            # they are given over the input
            return None
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
        best, most = None, BETTER * max(self.margin(q), 0.0)
        for entries in choices:
            at = [float(measured(motion, entry, 0)[0]) for entry in entries]
            if entries == self.inputs:
                at = [
                    x if e.is_slide else float(unwound(x, y))
                    for e, x, y in zip(entries, at, near, strict=True)
                ]
            try:
                assembly = Assembly.from_guess(
                    replace(m, inputs=entries, guess=Guess(tuple(at), angles, points))
                )
            except MechanismError:
                # the link cannot be a coordinate: others are
                continue
            opening = opened(assembly, at)
            if opening > most:
                best, most = (assembly, entries, at), opening
        if best is None:
            return None
        assembly, entries, at = best
        if m.torsion_springs:
            assembly = wound(assembly, at, twists(motion))
        for known in self.made:
            # what lies along the branch is known of it
            there = known.equations.mechanism
            if (there.inputs, there.torsion_springs) == (entries, assembly.mechanism.torsion_springs) and (
                known.stands_at(at, angles)
            ):
                return known, at
        other = Coordinates(type(self.equations)(assembly).sharing(self.equations.share), self.inputs)
        other.made = self.made
        self.made.append(other)
        return other, at

    def stands_at(self, q: Floats, angles: Mapping[str, float]) -> bool:
        """Whether the links have these angles there."""
        motion = self.motion(np.array([q]))
        apart = [cmath.exp(1j * (motion.link(name).angle[0] - a)) - 1 for name, a in angles.items()]
        return all(abs(x) < SAME for x in apart)


def twists(motion: Motion) -> list[float]:
    """The twists of all torsion springs in one pose, with their whole turns."""
    return [float(motion.poses.twist(i)[0]) for i in range(len(motion.mechanism.torsion_springs))]


def wound(assembly: Assembly, at: Floats, twisted: Sequence[float]) -> Assembly:
    """The same assembly with torsion springs that have so much twist at inputs: whole turns are their own."""
    m, here = assembly.mechanism, twists(Motion(assembly, np.array([at])))
    turned = [round((x - y) / (2 * math.pi)) for x, y in zip(twisted, here, strict=True)]
    if not any(turned):
        return assembly
    springs = [replace(s, turns=s.turns + n) for s, n in zip(m.torsion_springs, turned, strict=True)]
    return Assembly.from_guess(replace(m, torsion_springs=tuple(springs)))


def measured(motion: Motion, entry: Input, order: int) -> Reals:
    """What an input measures in a motion, (n,), or its speed or acceleration; an angle without its whole turns."""
    if entry.is_slide:
        return np.asarray(getattr(motion.slide(entry.name), ("position", "speed", "acceleration")[order]))
    of = ("angle", "omega", "alpha")[order]
    value = getattr(motion.link(entry.name), of)
    return np.asarray(value if entry.on == GROUND else value - getattr(motion.link(entry.on), of))


def opened(assembly: Assembly, at: Floats) -> float:
    """How far every loop is from folding at the inputs of the guess: as `Coordinates.margin`."""
    st, margins = assembly.state(tuple(at)), [1.0]
    for g in assembly.plan.groups:
        if g.kind == "Newton":
            rows = [[part(c) for c in row] for row in columns(g, st) for part in PARTS]
            margins.append(float(np.ravel(regularity(rows))[0]) ** 2)
        elif g.kind != "PRP":
            margins.append(float(np.ravel(st.margin[g.name])[0]))
    return min(x if x == x else 0.0 for x in margins)


@dataclass
class Monitor:
    """The check of a path at every node: whether its coordinates fold, and what the inputs are there."""

    coordinates: Coordinates
    near: Floats
    # a margin below which they fold: where no others were better, a quarter of what it was
    below: float
    follows: bool
    # the coordinate at the last node
    last: float

    def __call__(self, t: float, q: Floats, v: Floats) -> str:
        if self.follows:
            self.near = self.inputs(q, v)
        if self._strays(q, v):
            return "undecided"
        if self.coordinates.folds(q, self.below):
            return "folding"
        if self.below < FOLDING and not self.coordinates.folds(q):
            self.below = FOLDING
        return ""

    def _strays(self, q: Floats, v: Floats) -> bool:
        """Whether another coordinate takes for a change point what the inputs do not: by its rounding, that is larger."""
        last, self.last = self.last, q[0]
        if self.coordinates.own or self.coordinates.equations.clear(np.array([last, q[0]])):
            return False
        return not self.coordinates.made[0].equations.passes(self.inputs(q, v)[0])

    def quiet(self, q: Reals) -> bool:
        """Whether nothing folds at any of many places, and none has to be followed."""
        return not self.follows and self.below == FOLDING and self.coordinates.stands(q)

    def inputs(self, q: Floats, v: Floats) -> Floats:
        """The inputs at a state, with the whole turns of those at the last node."""
        state = [np.array([x]) for x in (q, v, v, self.near)]
        return self.coordinates.states(*state)[0][0].tolist()  # type: ignore[no-any-return]

    def until(self, j: int, level: float, side: int, noise: float, touch: float) -> Watch:
        """The end where input j has a value; see `Watch`."""
        if self.coordinates.own:
            return Watch(
                f"until {j}",
                lambda t, q, v: q[j],
                lambda t, q, v, a: v[j],
                [level],
                ends=True,
                side=side,
                linear=True,
                touch=touch,
                noise=noise,
            )
        value = lambda t, q, v: self.inputs(q, v)[j]  # noqa: E731
        return Watch(f"until {j}", value, None, [level], ends=True, side=side, touch=touch, noise=noise)
