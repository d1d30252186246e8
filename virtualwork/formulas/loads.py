"""What acts on the links of a mechanism: weights, inertia, applied forces and torques, springs and dampers, friction.

A load is a force at a point of a body or a torque on a body. It stands here once: its value at a pose, the
displacement on which it does work, its potential, and the second variation of its work. Everything else, virtual work,
joint reactions and equilibrium, asks it for these. Loads between two bodies come as two, action and reaction; of such
a pair one side carries the work of both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from dalembert.dataclass import dataclass, field
from virtualwork.describe import DescriptionError
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.force_terms import Combination, ForceTerms, LoadTerm, Turned
from virtualwork.formulas.loaded_pose import LoadedPose
from virtualwork.formulas.numbers import Complexes, Number, Reals, cross, dot, plus, times
from virtualwork.formulas.rates import Rates
from virtualwork.plan.steps import Path, path_reads

# kinds of loads that a link's own mass brings; with what is applied, all that acts from outside
OWN = ("weight", "inertia force", "inertia torque")
EXTERNAL = (*OWN, "applied force", "applied torque")


@dataclass(frozen=True, eq=False)
class Load:
    """A force (complex) at a point of a body, or a torque (real) on it where `path` is None.

    `place` is the point in the body's axes. `carries`: of action and reaction, this side carries the work of both.
    `mate`: the other side, of which this one is the opposite. `rail`: the guide on whose rail it acts.
    """

    kind: str
    body: str
    path: Path | None
    place: complex = 0j
    carries: bool = field(default=True, kw_only=True)
    mate: Load | None = field(default=None, kw_only=True)
    rail: int | None = field(default=None, kw_only=True)

    lasts = False
    # of the derivatives that it depends on
    order = 1

    @property
    def stores(self) -> bool:
        """Whether it gives back what is done against it: a weight, a spring."""
        return self.kind in ("weight", "spring", "torsion spring")

    def form(self, pose: LoadedPose) -> Number:
        """Its value at a pose: complex N, or N·m; None where it is zero."""
        raise NotImplementedError

    def combination(self, force_terms: ForceTerms) -> Combination:
        """Its value as constants times force terms."""
        if self.mate is not None:
            return self.mate.combination(force_terms).times(-1.0)
        return Combination({force_terms(LoadTerm, self): 1.0})

    def reads(self) -> set[str]:
        """What it depends on: `angle:BODY`, `slide:GUIDE`, `point:NODE`."""
        return {f"angle:{self.body}"} | (set() if self.path is None else path_reads(self.path))

    @property
    def name(self) -> str:
        """How the ledger calls it."""
        return f"{self.body}: {self.kind}"

    def arm(self, pose: LoadedPose, center: complex) -> Number:
        """Where a force acts, from a point of its body, in ground axes; None at the point itself."""
        return None if self.place == center else (self.place - center) * pose.st.turn[self.body]

    # --- its work ----------------------------------------------------------------------------------------------
    def displacement(self, pose: LoadedPose, j: int) -> Number:
        """The virtual displacement on which it does work, for a unit of input j; None where it cannot move."""
        if not self.carries:
            return None
        return pose.turning(self.body, j) if self.path is None else pose.coefficient(self.path, j)

    def power(self, pose: LoadedPose, j: int) -> Number:
        """Its virtual work for a unit of input j, or None: it is not evaluated where nothing moves."""
        moved = self.displacement(pose, j)
        return None if moved is None else self.work(pose.formed(self), moved)

    def work(self, value: Number, moved: Number) -> Number:
        """The work of its value on a displacement."""
        if value is None or moved is None:
            return None
        return value * moved if self.path is None else dot(value, moved)

    def wasted(self, pose: LoadedPose, j: int) -> Number:
        """The part of `power` that no potential and no speed holds: of dampers, applied loads, drives."""
        return None if self.stores or self.kind in OWN else self.power(pose, j)

    def potential(self, pose: LoadedPose) -> Number:
        """Its potential, J; NaN where it has none, None on the side that does not carry."""
        return np.nan

    def second(self, pose: LoadedPose, rates: Rates) -> Number:
        """The derivative of its virtual work along a direction in the inputs, over which the rates are taken."""
        value = pose.formed(self)
        if value is None:
            return None
        if self.path is None:
            return times(angle_rate(rates, self.body, 2), value)
        total = times_dot(value, rates.vector(self.path, 2))
        first = rates.vector(self.path, 1)
        return total if first is None else plus(total, times_dot(self.turned(pose, rates), first))

    def turned(self, pose: LoadedPose, rates: Rates) -> Number:
        """The derivative of a force itself along the direction of the rates."""
        return None


def times_dot(a: Number, b: Number) -> Number:
    """a·b as vectors, where None is zero."""
    return None if a is None or b is None else dot(a, b)


def angle_rate(rates: Rates, body: str, k: int) -> Number:
    """A body's k-th derivative of its angle; None for the ground."""
    return None if body == GROUND else rates.angle[body][k - 1]


@dataclass(frozen=True, eq=False)
class Constant(Load):
    """A weight, a force of fixed components in ground axes, or a torque."""

    amount: Number = 0.0

    def form(self, pose: LoadedPose) -> Number:
        return self.amount

    def combination(self, force_terms: ForceTerms) -> Combination:
        return Combination({None: self.amount})

    def potential(self, pose: LoadedPose) -> Number:
        if self.path is not None:
            return -dot(self.amount, pose.position(self.path))
        angle = pose.setting.plan.angles[self.body]
        # of a torque on a link whose whole turns are not known there is none
        return np.nan if not angle.by_inputs else -self.amount * pose.st.affine(angle)


@dataclass(frozen=True, eq=False)
class Follower(Load):
    """A force of fixed components in link axes."""

    amount: complex = 0j

    def form(self, pose: LoadedPose) -> Number:
        return self.amount * pose.st.turn[self.body]

    def combination(self, force_terms: ForceTerms) -> Combination:
        return Combination({force_terms(Turned, self.body, None): self.amount})

    def turned(self, pose: LoadedPose, rates: Rates) -> Number:
        turning = angle_rate(rates, self.body, 1)
        return None if turning is None else 1j * pose.formed(self) * turning


@dataclass(frozen=True, eq=False)
class Tabled(Load):
    """A force or a torque of a table, linear between its rows; periodic where the table is one.

    Its `axis` is the one input, the time, or the angle or speed of the link it acts on.
    """

    table: tuple[tuple[float, complex], ...] = ()
    periodic: bool = False
    link_axes: bool = False
    axis: str = "input"

    def alike(self, other: Tabled) -> bool:
        """Whether another load gives the same force everywhere."""
        return vars(self) | {"table": id(self.table)} == vars(other) | {"table": id(other.table)}

    def _in_cycle(self, q: Number) -> tuple[Reals, Complexes, Reals]:
        at, force = (np.array(column) for column in zip(*self.table, strict=True))
        q = np.asarray(q, dtype=float)
        if self.periodic:
            # the table is one cycle of a whole number of turns
            with np.errstate(invalid="ignore"):
                q = at[0] + np.mod(q - at[0], at[-1] - at[0])
        return at, force, q

    def place_in(self, pose: LoadedPose) -> Number:
        """What the table is over, at a pose.

        Raises
        ------
        DescriptionError
            Where it is over the time, and the poses have none.
        """
        if self.axis == "input":
            return pose.st.inputs[0]
        if self.axis == "time":
            return self.timed(pose.time)
        if self.axis == "speed":
            return 0.0 if pose.omega(self.body) is None else pose.omega(self.body)
        angle = pose.setting.plan.angles[self.body]
        if angle.by_inputs:
            return pose.st.affine(angle)
        return self.in_turn(pose.st.kind.angle(pose.st.turn[self.body]))

    def timed(self, time: Number) -> Number:
        """The time; refused where the poses have none."""
        if time is None:
            what = f"the torque on {self.body} is a table over time: it acts in a simulation only"
            raise DescriptionError(what)
        return time

    def in_turn(self, angle: Number) -> Number:
        """An angle whose whole turns are not known: in the turn that begins with the table."""
        first = self.table[0][0]
        return first + (angle - first) % (2 * np.pi)

    def over(self, q: Number) -> Number:
        """The force at places of the table, in the axes of the load; NaN outside."""
        at, force, q = self._in_cycle(q)
        outside = (q < at[0]) | (q > at[-1])
        values = np.where(outside, np.nan, np.interp(q, at, force.real) + 1j * np.interp(q, at, force.imag))
        return values if values.ndim else complex(values)

    def form(self, pose: LoadedPose) -> Number:
        result = pose.table(self)
        if self.path is None:
            return result.real
        return result * pose.st.turn[self.body] if self.link_axes else result

    def second(self, pose: LoadedPose, rates: Rates) -> Number:
        total = super().second(pose, rates)
        first = angle_rate(rates, self.body, 1)
        if self.path is not None or self.axis != "angle" or first is None:
            return total
        return plus(total, pose.slope(self).real * first * first)

    def slope(self, q: Number) -> Number:
        """The slope of the table at places of it."""
        at, force, q = self._in_cycle(q)
        place = np.clip(np.searchsorted(at, q, side="right") - 1, 0, len(at) - 2)
        values = np.diff(force)[place] / np.diff(at)[place]
        return values if values.ndim else complex(values)

    def turned(self, pose: LoadedPose, rates: Rates) -> Number:
        """Its derivative over the input, in ground axes."""
        steep = pose.slope(self)
        if not self.link_axes:
            return steep
        turning = pose.by[0].angle[self.body][0]
        along = steep * pose.st.turn[self.body]
        return along if turning is None else along + 1j * turning * pose.formed(self)


@dataclass(frozen=True, eq=False)
class InertiaForce(Load):
    """−m·a_G (d'Alembert; Ibrahim eq. 2.2.1; Riul eq. 5); `acceleration` is a_G as a combination."""

    mass: float = 0.0
    acceleration: Combination = field(default_factory=Combination)
    order = 2

    def form(self, pose: LoadedPose) -> Number:
        assert self.path is not None
        return pose.acceleration(self.path, -self.mass)

    def combination(self, force_terms: ForceTerms) -> Combination:
        return self.acceleration.times(-self.mass)


@dataclass(frozen=True, eq=False)
class InertiaTorque(Load):
    """−I_G·α (Ibrahim §2.3; Riul eq. 5)."""

    inertia: float = 0.0
    order = 2

    def form(self, pose: LoadedPose) -> Number:
        return pose.alpha(self.body, -self.inertia)

    def combination(self, force_terms: ForceTerms) -> Combination:
        return Combination({force_terms.second("angle", self.body): -self.inertia})


@dataclass(frozen=True, eq=False)
class FrictionLoad(Load):
    """Coulomb friction of a joint on one of its two sides, from the last iterate of its reaction.

    `number` counts the pairs that rub. The work of a guide's friction on a moving link is that along its slide.
    """

    joint: str = ""
    number: int = 0
    sign: float = 1.0
    guide: int | None = None

    def form(self, pose: LoadedPose) -> Number:
        return times(pose.friction.get(self.number), self.sign)

    def arm(self, pose: LoadedPose, center: complex) -> Number:
        if self.rail is None:
            return super().arm(pose, center)
        along = pose.setting.plan.directions[self.rail] * pose.st.slide[self.rail]
        return (self.place - center + along) * pose.st.turn[self.body]

    def displacement(self, pose: LoadedPose, j: int) -> Number:
        on = GROUND if self.guide is None else pose.setting.mechanism.guides[self.guide].on
        if self.guide is None or on == GROUND or not self.carries:
            return super().displacement(pose, j)
        return times(pose.by[j].slide[self.guide][0], self.sign * pose.rail(self.guide))


def applied_loads(loads: Iterable[Load], link: str) -> list[Load]:
    """What acts on a link but its weight and inertia."""
    return [load for load in loads if load.body == link and load.kind not in OWN]


def reduced(loads: Iterable[Load], pose: LoadedPose, center: complex) -> tuple[Number, Number]:
    """The sum of a link's loads at a pose and their moment about a point of the link; None where zero."""
    return _summed(loads, pose, lambda load: load.arm(pose, center))


def shaking_loads(loads: Iterable[Load]) -> list[Load]:
    """What acts on the moving links from outside."""
    return [load for load in loads if load.kind in EXTERNAL and load.body != GROUND]


def resultant(loads: Iterable[Load], pose: LoadedPose) -> tuple[Number, Number]:
    """The sum of loads at a pose and their moment about the ground's origin; None where zero."""
    return _summed(loads, pose, lambda load: None if load.path is None else pose.position(load.path))


def _summed(loads: Iterable[Load], pose: LoadedPose, arm: Callable[[Load], Number]) -> tuple[Number, Number]:
    """The sum of loads, and their moment by the arm of each."""
    force: Number = None
    moment: Number = None
    for load in loads:
        value = pose.formed(load)
        if value is None:
            continue
        if load.path is None:
            moment = plus(moment, value)
            continue
        force = plus(force, value)
        at = arm(load)
        if at is not None:
            moment = plus(moment, cross(at, value))
    return force, moment
