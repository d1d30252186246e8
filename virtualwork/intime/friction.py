"""Coulomb friction in time: joints that slide, stick, break away and stick again.

In a pin of radius r the friction torque is −μ r |R| against its turning, in a guide the force −μ |N| against its slide.
R and N depend on the accelerations and on the friction itself, both linearly: with φ the friction of every joint that
rubs, M·q̈ + h = Cᵀφ and R = P + Q φ, where C holds the joints' own rates over the inputs' speeds. The φ of what slides
follows by iteration, as in every pose (`formulas.friction`). What sticks has the φ that keeps it at rest, and breaks away where
that is more than μ r |R|.

Which joints slide, and which way, is a mode. It lasts as long as no sliding joint comes to rest and no sticking one
breaks away; both end a path, at their time to rounding, and the next path begins in another mode. There is no
regularisation: what sticks stands still.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from functools import cached_property
from itertools import islice
from operator import mul
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.recorded import Number
from dalembert.arithmetic.tape import Tape
from virtualwork.describe import MechanismError
from virtualwork.formulas.forces import Bearing, RubbingRate
from virtualwork.formulas.loaded_pose import LoadedPose
from virtualwork.formulas.numbers import Reals, minus
from virtualwork.intime.equations import Equations, Lost
from virtualwork.intime.powers import motion_of
from virtualwork.intime.sliding import Mode, Values
from virtualwork.intime.watch import Floats, Rate, Value, Watch, sign

# iterations of friction and joint forces; each gains a factor of some μ r / l
LIMIT = 400
CLOSE, NEARLY = 1e-15, 1e-12
# by how much friction has grown from its first value where putting it in again does not settle
GROWN = 1e6
# rad, sizes, or of the largest rate: joints that turn back so near each other do so together
TOGETHER = 1e-9
# of the largest rate, or of a joint's largest friction: what rounding may make of zero
NOISE = 1e-12
# states whose values are kept
RECENT = 64
# ways in which a sticking joint may break away
WAYS = (" +1", " -1")


# what depends on the friction of each joint that rubs: its force, the acceleration of its slide; and the speed of it
QUANTITIES = ("x", "y", "slip", "rate")


class Rubbing(Equations):
    """The equations of motion of an assembly with friction, in one mode."""

    mode: Mode = ()
    # which way the one input moves; 0 where it rests, and of several inputs
    direction = 0.0
    # whether nothing moves in this mode
    locked = False
    # what rounding may make of zero, in each joint's watch
    noise: Sequence[float] = ()

    def refuse(self, t: float, q: Floats, v: Floats) -> None:
        super().refuse(t, q, v)
        if self._contacts[0]:
            raise MechanismError(
                "friction in time: constraints are redundant, so that statics does not determine the joint forces it "
                "depends on"
            )

    def in_mode(self, mode: Mode, direction: float = 0.0) -> Rubbing:
        """The same equations in another mode, and with another direction of the one input."""
        other = copy(self)
        other.mode, other.direction, other.locked = mode, direction, False
        other.noise = [0.0] * len(mode)
        return other

    # --- the tape ---------------------------------------------------------------------------------------------
    @cached_property
    def _contacts(self) -> tuple[bool, list[Any]]:
        """Whether joint forces are not determined, and the pairs that rub."""
        forces = self.recording(True, True, False).forces
        return forces.redundant, forces.case.contacts

    @cached_property
    def arms(self) -> list[float]:
        """The friction of each joint over its force: μ r of a pin, μ of a guide."""
        return [
            coefficient * (radius if joint.guide is None else 1.0)
            for joint, _, _, coefficient, radius in self._contacts[1]
        ]

    @cached_property
    def sizes(self) -> list[float]:
        """What the rate of each joint is relative to: 1 in a pin, the mechanism's size in a guide."""
        return [1.0 if joint.guide is None else self.mechanism.size for joint, *_ in self._contacts[1]]

    def slid_at(self, t: Reals, q: Reals, v: Reals) -> Reals:
        """The rates of the joints over what they are relative to, in many states: (joints, n)."""
        values = self._run(self.rates, t, q, v)
        rates = np.array([values[f"rate {n}"] for n in range(len(self.sizes))])
        return np.asarray(rates / np.array(self.sizes)[:, None])

    @property
    def names(self) -> list[str]:
        """The joints that rub."""
        return [joint.name for joint, *_ in self._contacts[1]]

    @cached_property
    def _recorded(self) -> tuple[Tape, Tape, Tape]:
        recording = self.recording(True, True, False)
        pose, contacts = recording.forces.pose, recording.forces.case.contacts
        rubs = [f"friction {n}" for n in range(len(self.arms))]
        result: dict[str, Number] = {}
        for n, (joint, body, other, *_) in enumerate(contacts):
            force, rate = recording.value(Bearing(n)), recording.value(RubbingRate(n))
            if joint.guide is None:
                slip = minus(pose.alpha(body), pose.alpha(other))
            else:
                slip = _second(pose, joint.guide)
            for name, value in zip(QUANTITIES, (force.real, force.imag, slip, rate), strict=True):
                result[f"{name} {n}"] = 0.0 if value is None else value
        return motion_of(recording, self.k, rubs, result)

    def values(self, t: float, q: Floats, v: Floats) -> Values:
        """The outputs of the tape at a state.

        Raises
        ------
        Lost
        """
        state = t, *q, *v
        values = self._recent.get(state)
        if values is None:
            values = self._values(t, q, v)
            if len(self._recent) >= RECENT:
                self._recent.clear()
            self._recent[state] = values
        return values

    @cached_property
    def _recent(self) -> dict[tuple[float, ...], Values]:
        """The values at states that several watches request."""
        return {}

    def _values(self, t: float, q: Floats, v: Floats) -> Values:
        self._cover(q[0])
        try:
            outputs = self._function(*self._filled(self.rates, t, q, v))
        except (ZeroDivisionError, ValueError, OverflowError):
            raise Lost from None
        if any(x - x != 0.0 for x in outputs):
            # NaN and infinity
            raise Lost
        k, c, rest = self.k, len(self.arms), iter(outputs)
        a, per = list(islice(rest, k)), [list(islice(rest, k)) for _ in range(c)]
        joints = [[list(islice(rest, 1 + c)) for _ in QUANTITIES] for _ in range(c)]
        forces = [[complex(*pair) for pair in zip(x, y, strict=True)] for x, y, *_ in joints]
        rate, slip = [of[3][0] for of in joints], [of[2][0] for of in joints]
        slips = [of[2][1:] for of in joints]
        return Values(
            a,
            per,
            [of[0] for of in forces],
            [of[1:] for of in forces],
            rate,
            slip,
            slips,
            next(rest),
            self._crossing(q[0]) is not None,
        )

    @property
    def plain(self) -> bool:
        """False: friction is found by iteration."""
        return False

    @property
    def smooth(self) -> bool:
        """False: friction jumps where a joint comes to rest."""
        return False

    @property
    def stuck(self) -> list[int]:
        """The joints that friction holds; where one input moves, those of mode 0 do not move with it, and nothing rubs."""
        holds = self.k > 1 or self.locked
        return [
            n for n, (s, arm) in enumerate(zip(self.mode, self.arms, strict=True)) if holds and arm and not s
        ]

    # --- friction at a state --------------------------------------------------------------------------------------
    def __call__(self, t: float, q: Floats, v: Floats) -> Floats:
        """The accelerations at a state in this mode, and the power."""
        if self.locked:
            return [0.0] * (self.k + 1)
        values = self.values(t, q, v)
        phi = self.friction(values)
        result = [*values.moved(phi), values.power + sum(map(mul, phi, values.rate))]
        if any(value - value != 0.0 for value in result):
            raise Lost
        return result

    def _careful(self, q: Reals) -> NDArray[np.bool_]:
        return np.ones(len(q), dtype=bool)

    def friction(self, values: Values) -> Floats:
        """The friction of every joint in this mode.

        Raises
        ------
        Lost
            Where the joints lock: no force balances its own friction. And close to a change point, where friction does
            not settle by putting it in again: without it the joint forces grow beyond any bound there, with too few digits
            left for what it takes from them.
        """
        c, mode, stuck = len(self.arms), self.mode, self.stuck
        inverse = np.linalg.pinv([[values.slips[n][m] for m in stuck] for n in stuck]) if stuck else None
        phi, first = [0.0] * c, 0.0
        for _ in range(LIMIT):
            after = [
                -s * arm * values.force(n, phi) if s else x
                for n, (s, arm, x) in enumerate(zip(mode, self.arms, phi, strict=True))
            ]
            if inverse is not None:
                for n in stuck:
                    after[n] = 0.0
                rest = [values.slid(n, after) for n in stuck]
                for n, x in zip(stuck, (inverse @ rest).tolist(), strict=True):
                    after[n] = -x
            change = max(abs(x - y) for x, y in zip(after, phi, strict=True))
            first = first or change
            if not change <= GROWN * first:
                break
            phi = after
            if change <= CLOSE * max(map(abs, phi)):
                return phi
        if change <= NEARLY * max(map(abs, phi)):
            return phi
        followed = None if values.near else values.followed(self.mode, self.arms, inverse)
        if followed is None:
            raise Lost
        return followed

    # --- modes ----------------------------------------------------------------------------------------------------
    def tendency(self, t: float, q: Floats, direction: float) -> float:
        """The acceleration of the one input, at rest, if it began to move in a direction; 0 where friction locks it."""
        try:
            mode = self._along(t, q, direction)
            values = self.values(t, q, [0.0])
            return values.moved(self.in_mode(mode).friction(values))[0]
        except Lost:
            return 0.0

    def going_on(self, t: float, q: Floats, v: Floats, ended: str) -> tuple[Rubbing, Floats]:
        """The equations in the mode that follows the end of a path, and the speeds, zero where joints stick.

        `ended` is the watch that ended it; empty at the beginning.
        """
        if ended and not ended.startswith("friction"):
            # other coordinates, or another method: the joints go on as they did
            return self, v
        of = ended.removeprefix("friction").strip()
        if self.k == 1:
            if of.startswith("away"):
                direction = float(of.removeprefix("away"))
            elif ended and of != "rest":
                direction = self.direction
            else:
                v = [0.0] if ended else v
                direction = self._decided_alone(t, q, v)
            result = self.in_mode(self._along(t, q, direction), direction)
            result.locked = not direction
            if direction:
                _, _, size = self._coefficients(t, q, direction)
                result.noise = [NOISE * size] * len(self.arms)
            return result, v
        of, _, broken = of.partition(" ")
        rates = self.values(t, q, v).rate
        still = TOGETHER * max(map(abs, rates))
        resting = (
            [n for n, s in enumerate(self.mode) if not s or str(n) == of or abs(rates[n]) <= still]
            if ended
            else [n for n, rate in enumerate(rates) if not rate]
        )
        mode = self._decided(t, q, v, resting)
        if broken:
            # friction is at its largest and can hold the joint no longer, though it does not yet move
            mode = tuple(int(broken) if str(n) == of else s for n, s in enumerate(mode))
        result = self.in_mode(mode)
        v = result._held(t, q, v)
        values = result.values(t, q, v)
        fastest, phi = max(map(abs, values.rate)), result.friction(values)
        result.noise = [
            NOISE * (fastest if s else arm * values.force(n, phi))
            for n, (s, arm) in enumerate(zip(mode, self.arms, strict=True))
        ]
        return result, v

    def _held(self, t: float, q: Floats, v: Floats) -> Floats:
        """The speeds at the beginning of this mode, without what rounding leaves in joints that stick."""
        stuck = [n for n, s in enumerate(self.mode) if not s]
        if not stuck:
            return v
        by_input = np.array([self.values(t, q, row).rate for row in np.eye(self.k).tolist()]).T[stuck]
        inverse = np.linalg.pinv(by_input)
        self.locked = not any(self.mode) and np.linalg.matrix_rank(by_input) == self.k
        slowed = np.array(v) - inverse @ (by_input @ np.array(v))
        return [0.0] * self.k if self.locked else slowed.tolist()

    def _along(self, t: float, q: Floats, direction: float) -> Mode:
        """The mode while the one input moves in a direction, just beyond a pose.

        At a dead point of a joint its rate is zero: what counts is its sign after it. Where that of a joint is zero
        beyond it too, the joint does not move.
        """
        if not direction:
            return (0,) * len(self.arms)
        here, after, size = self._coefficients(t, q, direction)
        still = TOGETHER * size
        signs = (sign(a if abs(a) > 1000 * still else b) for a, b in zip(here, after, strict=True))
        moves = (max(abs(a), abs(b)) > 1e-4 * still for a, b in zip(here, after, strict=True))
        return tuple(s if m else 0 for s, m in zip(signs, moves, strict=True))

    def _coefficients(self, t: float, q: Floats, direction: float) -> tuple[Floats, Floats, float]:
        """The joints' rates as the one input moves, at a pose and just beyond it, and what they come to.

        At a dead point of the coordinate all joints may rest: there they grow with the way.
        """
        beside = math.copysign(TOGETHER * self.scale[0], direction)
        states = ((t, [x], [math.copysign(1.0, direction)]) for x in (q[0], q[0] + beside))
        here, after = (
            [rate / size for rate, size in zip(self.values(*state).rate, self.sizes, strict=True)]
            for state in states
        )
        return (
            here,
            after,
            max([*map(abs, here), *(abs(b - a) / TOGETHER for a, b in zip(here, after, strict=True))]),
        )

    def left(self, ended: str, before: Mode) -> dict[str, float]:
        """The levels at which a path in this mode begins: those of joints that have changed theirs."""
        if not ended.startswith("friction"):
            return {}
        changed = (n for n, (a, b) in enumerate(zip(before, self.mode, strict=False)) if a != b)
        joints = [f"friction {n}{way}" for n in changed for way in ("", *WAYS)]
        return dict.fromkeys((ended, *joints), 0.0)

    def _decided_alone(self, t: float, q: Floats, v: Floats) -> float:
        """Which way the one input goes on: it moves, begins to move one way, or stays, 0."""
        if v[0]:
            return math.copysign(1.0, v[0])
        for direction in (1.0, -1.0):
            if self.tendency(t, q, direction) * direction > 0:
                return direction
        return 0.0

    def _decided(self, t: float, q: Floats, v: Floats, resting: Sequence[int]) -> Mode:
        """The mode of several degrees of freedom in which the motion goes on where some joints rest.

        Friction of a resting joint is what keeps it at rest, at most μ r |R|: computed joint by joint, over and over.
        """
        values = self.values(t, q, v)
        signs = list(values.signs)
        phi = [0.0] * len(self.arms)
        for _ in range(20 * LIMIT if resting else 0):
            before = list(phi)
            for n in range(len(phi)):
                most = self.arms[n] * values.force(n, phi)
                if n not in resting:
                    phi[n] = -signs[n] * most
                elif values.slips[n][n] > 0:
                    phi[n] = min(most, max(-most, phi[n] - values.slid(n, phi) / values.slips[n][n]))
            change = max(abs(x - y) for x, y in zip(phi, before, strict=True))
            if change <= CLOSE * max(map(abs, phi)):
                break
        else:
            if resting and not change <= NEARLY * max(map(abs, phi)):
                raise Lost
        for n in resting:
            most, slip = self.arms[n] * values.force(n, phi), values.slid(n, phi)
            slides = abs(phi[n]) >= most * (1 - 1e-9) and abs(slip) > 1e-9 * abs(values.slip[n])
            signs[n] = sign(slip) if slides else 0
        return tuple(signs)

    def watches(self) -> list[Watch]:
        """What ends a path in this mode: a sliding joint at rest, a sticking one that breaks away."""
        if self.locked and self.k == 1:
            return [self._breaking_away(1), self._breaking_away(-1)]
        result = super().watches()
        every = range(len(self.mode))
        if self.k > 1:
            for n, s in enumerate(self.mode):
                result += [self._sliding(n)] if s else [self._sticking(n, way) for way in WAYS]
            return result
        rest = _watch(
            "rest", lambda t, q, v: self.direction * v[0], lambda t, q, v, a: self.direction * a[0], True
        )
        return [*result, rest, *(self._turning_back(n) for n in every if self.mode[n])]

    def _breaking_away(self, direction: int) -> Watch:
        """A mechanism that stands, and would begin to move one way."""
        return _watch(f"away {direction}", lambda t, q, v: -direction * self.tendency(t, q, float(direction)))

    def _turning_back(self, n: int) -> Watch:
        """A joint whose rate changes its sign while the one input goes on: its coefficient does."""
        return _watch(
            str(n),
            lambda t, q, v: self.mode[n] * self.values(t, q, [self.direction]).rate[n],
            noise=self.noise[n],
        )

    def _sliding(self, n: int) -> Watch:
        """A joint that slides comes to rest."""
        way = self.mode[n]

        def slip(t: float, q: Floats, v: Floats, rates: Floats) -> float:
            values = self.values(t, q, v)
            return way * values.slid(n, self.friction(values))

        return _watch(str(n), lambda t, q, v: way * self.values(t, q, v).rate[n], slip, noise=self.noise[n])

    def _sticking(self, n: int, way: str) -> Watch:
        """A joint that sticks breaks away, one way: the friction against it is as large as it can be."""
        side = int(way)

        def spare(t: float, q: Floats, v: Floats) -> float:
            values = self.values(t, q, v)
            phi = self.friction(values)
            return self.arms[n] * values.force(n, phi) + side * phi[n]

        return _watch(f"{n}{way}", spare, noise=self.noise[n])


def _watch(
    name: str, value: Value, rate: Rate | None = None, linear: bool = False, noise: float = 0.0
) -> Watch:
    """What ends a path, in a mode, where it is no longer positive."""
    return Watch(f"friction {name}", value, rate, [0.0], ends=True, side=1, linear=linear, noise=noise)


def _second(pose: LoadedPose, guide: int) -> Number:
    """The second derivative of a slide in time."""
    factor, value = pose.second(lambda rates, k: rates.slide[guide][k - 1])
    return None if value is None else value * factor
