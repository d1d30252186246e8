"""A pose as the loads see it: where points lie, how far they move, what has been formed there already.

Whatever depends on loads, a load's value or a quantity made of several, is formed once, on the first request.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any, Protocol, cast

import numpy as np

from dalembert.arithmetic.varied import rotation
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND, TorsionSpring
from virtualwork.formulas.numbers import Complexes, ForceKind, Number, Reals, plus, times
from virtualwork.formulas.poses import Poses, alone
from virtualwork.formulas.positions import Samples, State, follow, unwound, whole
from virtualwork.formulas.rates import Rates
from virtualwork.formulas.winding import counted
from virtualwork.plan.steps import Path, Plan


class Shared:
    """What a pose does not say of itself: rates of the inputs, the time, how far torsion springs are wound."""

    turn: Number = 2 * np.pi
    """A whole turn."""

    def __init__(self, mechanism: Description, plan: Plan) -> None:
        self.mechanism, self.plan = mechanism, plan

    @property
    def rates(self) -> tuple[Number, Number]:
        """q̇ and q̈ of the one input, None where zero."""
        raise NotImplementedError

    @property
    def time(self) -> Number:
        """The time; None where there is none."""
        return None

    def wound(self, spring: TorsionSpring, st: State, within: Number) -> Number:
        """A torsion spring's twist with its whole turns, from what lies within half a turn of free."""
        raise NotImplementedError

    def twist(self, st: State, spring: TorsionSpring) -> Number:
        """θ_second − θ_first − free angle: within half a turn at the guess, and from there on followed continuously.

        Where the inputs alone fix both angles they are taken as they are, whole turns included. The spring's own `turns`
        are added.
        """
        a, b = spring.links
        angles = [self.plan.angles[body] for body in (a, b)]
        if all(angle.by_inputs for angle in angles):
            twist = (st.affine(angles[1]) - spring.free_angle) - st.affine(angles[0])
            return twist + self.turn * spring.turns if spring.turns else twist
        return self.wound(spring, st, self.within(st, spring))

    @staticmethod
    def within(st: State, spring: TorsionSpring) -> Number:
        """A torsion spring's twist, within half a turn of free."""
        a, b = spring.links
        return st.kind.angle(st.turn[b] * st.turn[a].conjugate() * rotation(-spring.free_angle))


class Setting(Shared):
    """That of poses."""

    def __init__(self, poses: Poses) -> None:
        super().__init__(poses.mechanism, poses.plan)
        self.poses = poses
        self._followed: dict[TorsionSpring, Samples] = {}

    @cached_property
    def moves(self) -> bool:
        """Whether anything moves at all: a speed or an acceleration that is not zero."""
        return any(self.poses.moves[:2])

    @property
    def rates(self) -> tuple[Number, Number]:
        speed, acceleration, _ = self.poses.rates
        return alone(speed[0]), alone(acceleration[0])

    @property
    def time(self) -> Number:
        return None if self.poses.time is None else float(self.poses.time[0])

    def wound(self, spring: TorsionSpring, st: State, within: Number) -> Number:
        """A torsion spring's twist with its whole turns, from what lies within half a turn of free.

        With one input followed along it, with several along a straight line of inputs from the guess: NaN where that
        leads through places that cannot be assembled.
        """
        if len(st.inputs) > 1:
            result = self.along_lines(spring, st.inputs, within)
        else:
            result = whole(self._counted(spring), st.inputs[0], within)
        result = result + 2 * np.pi * spring.turns
        return result if st.many else float(np.ravel(result)[0])

    def along_lines(
        self,
        spring: TorsionSpring,
        inputs: Sequence[Number],
        within: Number,
        start: Sequence[float] | None = None,
    ) -> Reals:
        """A twist with its whole turns along straight lines, from the guess or from `start`, where it is `principal`."""
        turns, reached = counted(partial(self._twists, spring), self.mechanism, inputs, start)
        return np.where(reached, unwound(within, turns[0]), np.nan)

    def _twists(self, spring: TorsionSpring, inputs: Sequence[Reals]) -> Complexes:
        """e^{iφ} of a torsion spring's twist at inputs, (1, n); NaN where it is not assembled."""
        along = self.poses.again(np.stack(inputs, axis=1))
        a, b = (along.angle(body) if body != GROUND else 0.0 for body in spring.links)
        turns: Complexes = np.exp(1j * (b - a - spring.free_angle))
        return np.broadcast_to(turns, (1, along.n))

    def _counted(self, spring: TorsionSpring) -> Samples:
        """The twist of a torsion spring followed from the guess over all requested poses."""
        if spring not in self._followed:
            m = self.mechanism
            inputs, at = self.poses.inputs[:, 0], m.at[0]
            low, high = min(float(np.nanmin(inputs)), at), max(float(np.nanmax(inputs)), at)
            turn = m.size if m.inputs[0].is_slide else 2 * np.pi
            # of very many turns fewer samples each
            samples = int(min(720.0, max(24.0, 20000 * turn / max(high - low, turn))) * (high - low) / turn)

            def angle(q: Reals) -> Reals:
                twist: Reals = np.angle(self._twists(spring, [q])[0])
                return twist

            self._followed[spring] = follow(angle, np.linspace(low, high, 2 + samples), at, turn)
        return self._followed[spring]


class Formed(Protocol):
    """Something that is formed once: a load, or a quantity made of loads."""

    @property
    def lasts(self) -> bool:
        """Whether a motion keeps it for others that ask later."""

    def form(self, pose: LoadedPose) -> Any:
        """Its value."""


class Table(Protocol):
    """A load with a table."""

    def place_in(self, pose: LoadedPose) -> Number:
        """What the table is over, at a pose."""

    def over(self, q: Number) -> Number:
        """What the table gives there."""

    def slope(self, q: Number) -> Number:
        """How steep the table is there."""

    def alike(self, other: Any) -> bool:
        """Whether another load gives the same force everywhere."""


class LoadedPose:
    """A pose as the loads see it: positions, velocity coefficients, velocities, accelerations.

    A derivative that is identically zero is None.

    Attributes
    ----------
    drive : function
        The torque of an input's motor, by virtual work.
    friction : dict of a contact's number to its friction
    """

    drive: Callable[[int], Number]

    def __init__(self, setting: Shared, st: State, along: Rates | None, by: list[Rates]) -> None:
        self.setting, self.st, self.along, self.by = setting, st, along, by
        self.kind = cast(ForceKind, st.kind)
        self.one = len(by) == 1
        self.rates = setting.rates if self.one else (None, None)
        self.friction: dict[int, Number] = {}
        self.kept: dict[Formed, Any] = {}
        # the names of the joint forces formed so far
        self.names: set[str] = set()

    def formed(self, what: Formed) -> Any:
        """The value of a load or a quantity, formed once."""
        if what not in self.kept:
            self.kept[what] = what.form(self)
        return self.kept[what]

    def table(self, load: Table) -> Number:
        """What a table gives."""
        return load.over(load.place_in(self))

    def slope(self, load: Table) -> Number:
        """How steep a table is."""
        return load.slope(load.place_in(self))

    @property
    def time(self) -> Number:
        """The time; None where the pose has none."""
        return self.setting.time

    def second(self, derivative: Callable[[Rates, int], Number]) -> tuple[float, Number]:
        """ẍ = K q̈ + L q̇² of what has the derivatives K, L over the input: a factor and a value."""
        if not self.one:
            return 1.0, None if self.along is None else derivative(self.along, 2)
        speed, rate = self.rates
        normal = None if speed is None else derivative(self.by[0], 2)
        tangential = None if rate is None else derivative(self.by[0], 1)
        if tangential is None and isinstance(speed, float):
            # a plain number: what is recorded of the rest stays as it is
            return speed * speed, normal
        return 1.0, plus(times(normal, times(speed, speed)), times(tangential, rate))

    def _first(self, derivative: Callable[[Rates], Number]) -> Number:
        """ẋ = K q̇."""
        if self.one:
            return times(derivative(self.by[0]), self.rates[0])
        return None if self.along is None else derivative(self.along)

    def position(self, path: Path) -> Number:
        """P, complex."""
        return self.st.at(path)

    def rail(self, guide: int) -> Number:
        """The direction of a guide, a unit vector."""
        on, d = self.setting.mechanism.guides[guide].on, self.setting.plan.directions[guide]
        return d if on == GROUND else d * self.st.turn[on]

    def coefficient(self, path: Path, j: int) -> Number:
        """∂P/∂q_j, complex."""
        return self.by[j].vector(path, 1)

    def turning(self, body: str, j: int) -> Number:
        """∂θ/∂q_j."""
        return None if body == GROUND else self.by[j].angle[body][0]

    def velocity(self, path: Path) -> Number:
        """Ṗ, complex."""
        return self._first(lambda rates: rates.vector(path, 1))

    def omega(self, body: str) -> Number:
        """ω."""
        return None if body == GROUND else self._first(lambda rates: rates.angle[body][0])

    def slide_rate(self, guide: int) -> Number:
        """ṡ of a guide."""
        return self._first(lambda rates: rates.slide[guide][0])

    def acceleration(self, path: Path, factor: float = 1.0) -> Number:
        """P̈ = K q̈ + L q̇², complex, times a factor."""
        own, value = self.second(lambda rates, k: rates.vector(path, k))
        return None if value is None else value * (own * factor)

    def alpha(self, body: str, factor: float = 1.0) -> Number:
        """α, times a factor."""
        if body == GROUND:
            return None
        own, value = self.second(lambda rates, k: rates.angle[body][k - 1])
        return None if value is None else value * (own * factor)
