"""Coulomb friction in time: joints that slide, stick, break away and stick again.

In a pin of radius r the friction torque is −μ r |R| against its turning, in a guide the force −μ |N| against its slide.
R and N hang on the accelerations and on the friction itself, both linearly: with φ the friction of every joint that
rubs, M·q̈ + h = Cᵀφ and R = P + Q φ, where C holds the joints' own rates over the inputs' speeds. What slides is found
by iteration, as in every pose (`formulas.friction`). What sticks has the φ that keeps it at rest, and breaks away where
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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.recorded import Number
from dalembert.arithmetic.tape import Tape
from virtualwork.describe import MechanismError
from virtualwork.formulas.block import Block
from virtualwork.formulas.numbers import Reals, dot, minus
from virtualwork.intime.equations import Equations, Lost
from virtualwork.intime.powers import motion_of
from virtualwork.intime.watch import Floats, Rate, Value, Watch

# iterations of friction and joint forces; each gains a factor of some μ r / l
LIMIT = 400
CLOSE = 1e-15
# rad, sizes, or of the largest rate: joints that turn back so near each other do so together
TOGETHER = 1e-9
Mode = tuple[int, ...]
"""For each joint that rubs: the sign of its rate, 0 where it sticks."""


# what hangs on the friction of each joint that rubs: its force, the acceleration of its slide; and the speed of it
QUANTITIES = ("x", "y", "slip", "rate")


class Values(NamedTuple):
    """What the tape says at one state; complex R = P + Q·φ, accelerations a + A·φ, of the joints' rates s + S·φ."""

    a: Floats
    per: list[Floats]
    p: list[complex]
    q: list[list[complex]]
    rate: Floats
    slip: Floats
    slips: list[Floats]
    power: float

    @property
    def signs(self) -> Mode:
        """Which way each joint slides."""
        return tuple(_sign(rate) for rate in self.rate)

    def force(self, n: int, phi: Floats) -> float:
        """A joint's force with friction, in size."""
        return float(abs(self.p[n] + sum(map(mul, self.q[n], phi))))

    def slid(self, n: int, phi: Floats) -> float:
        """The acceleration of a joint's slide with friction."""
        return float(self.slip[n] + sum(map(mul, self.slips[n], phi)))

    def moved(self, phi: Floats) -> Floats:
        """The accelerations with friction."""
        found = list(self.a)
        for x, per in zip(phi, self.per, strict=True):
            found = [a + x * b for a, b in zip(found, per, strict=True)]
        return found


class Rubbing(Equations):
    """The equations of motion of an assembly with friction, in one mode."""

    mode: Mode = ()
    # whether nothing moves in this mode
    locked = False

    def refuse(self, t: float, q: Floats, v: Floats) -> None:
        super().refuse(t, q, v)
        if self._contacts[0]:
            raise MechanismError(
                "friction in time: constraints are redundant, so that statics does not determine the joint forces it "
                "hangs on"
            )

    def in_mode(self, mode: Mode) -> Rubbing:
        """The same equations in another mode."""
        other = copy(self)
        other.mode, other.locked = mode, False
        return other

    # --- the tape ---------------------------------------------------------------------------------------------
    @cached_property
    def _contacts(self) -> tuple[bool, list[float]]:
        """Whether joint forces are not determined; μ r of each pair that rubs, or μ in a guide."""
        paths, of, _ = self.recording(True, True, False).forces
        return of.redundant, [
            coefficient * (radius if joint.guide is None else 1.0)
            for joint, _, _, coefficient, radius in paths.case.contacts
        ]

    @property
    def arms(self) -> list[float]:
        """The friction of each joint over its force: μ r of a pin, μ of a guide."""
        return self._contacts[1]

    @cached_property
    def _recorded(self) -> tuple[Tape, Tape]:
        recording = self.recording(True, True, False)
        paths, of, block = recording.forces
        rubs = [f"friction {n}" for n in range(len(self.arms))]
        for n, (joint, *_) in enumerate(paths.case.contacts):
            rub = recording.recorder.input(rubs[n])
            block.friction[n] = rub if joint.guide is None else rub * of.rail(block, joint.guide)
        found: dict[str, Number] = {}
        for n, (joint, body, other, *_) in enumerate(paths.case.contacts):
            recording.value(("force", joint.key, body))
            force = of.on_side(block, (joint.key, body))
            if joint.guide is None:
                rate = minus(block.omega(body), block.omega(other))
                slip = minus(block.alpha(body), block.alpha(other))
            else:
                force = dot(force, 1j * of.rail(block, joint.guide))
                rate, slip = block.slide_rate(joint.guide), _second(block, joint.guide)
            for name, value in zip(QUANTITIES, (force.real, force.imag, slip, rate), strict=True):
                found[f"{name} {n}"] = 0.0 if value is None else value
        return motion_of(recording, self.k, rubs, found)

    def values(self, t: float, q: Floats, v: Floats) -> Values:
        """What the tape says at a state.

        Raises
        ------
        Lost
        """
        self._cover(q[0])
        try:
            found = self._function(*self._filled(self.rates, t, q, v))
        except (ZeroDivisionError, ValueError, OverflowError):
            raise Lost from None
        if any(x - x != 0.0 for x in found):
            # NaN and infinity
            raise Lost
        k, c, rest = self.k, len(self.arms), iter(found)
        a, per = list(islice(rest, k)), [list(islice(rest, k)) for _ in range(c)]
        joints = [[list(islice(rest, 1 + c)) for _ in QUANTITIES] for _ in range(c)]
        forces = [[complex(*pair) for pair in zip(x, y, strict=True)] for x, y, *_ in joints]
        rate, slip = [of[3][0] for of in joints], [of[2][0] for of in joints]
        slips = [of[2][1:] for of in joints]
        return Values(
            a, per, [of[0] for of in forces], [of[1:] for of in forces], rate, slip, slips, next(rest)
        )

    @property
    def plain(self) -> bool:
        """False: friction is found by iteration."""
        return False

    # --- friction at a state --------------------------------------------------------------------------------------
    def __call__(self, t: float, q: Floats, v: Floats) -> Floats:
        """The accelerations at a state in this mode, and the power."""
        if self.locked:
            return [0.0] * (self.k + 1)
        values = self.values(t, q, v)
        phi = self.friction(values)
        found = [*values.moved(phi), values.power + sum(map(mul, phi, values.rate))]
        if any(value - value != 0.0 for value in found):
            raise Lost
        return found

    def _careful(self, q: Reals) -> NDArray[np.bool_]:
        return np.ones(len(q), dtype=bool)

    def friction(self, values: Values) -> Floats:
        """The friction of every joint in this mode.

        Raises
        ------
        Lost
            Where the joints lock: no force balances its own friction.
        """
        c, mode = len(self.arms), self.mode
        stuck = [n for n in range(c) if not mode[n]]
        inverse = np.linalg.pinv([[values.slips[n][m] for m in stuck] for n in stuck]) if stuck else None
        phi = [0.0] * c
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
            if not change < 1e300:
                break
            phi = after
            if change <= CLOSE * max(map(abs, phi)):
                return phi
        if change <= 1e-12 * max(map(abs, phi)):
            return phi
        raise Lost

    # --- modes ----------------------------------------------------------------------------------------------------
    def tendency(self, t: float, q: Floats, direction: float) -> float:
        """The acceleration of the one input, at rest, if it began to move in a direction; 0 where friction locks it."""
        mode = self.values(t, q, [direction]).signs
        try:
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
                return self.in_mode(self.values(t, q, [direction]).signs), v
            if ended and of != "rest":
                return self.in_mode(self._turned_back(t, q, v[0])), v
            if ended:
                v = [0.0]
            found = self.in_mode(self._decided_alone(t, q, v))
            found.locked = not any(found.mode)
            return found, v
        rates = self.values(t, q, v).rate
        still = TOGETHER * max(map(abs, rates))
        resting = (
            [n for n, s in enumerate(self.mode) if not s or str(n) == of or abs(rates[n]) <= still]
            if ended
            else [n for n, rate in enumerate(rates) if not rate]
        )
        found = self.in_mode(self._decided(t, q, v, resting))
        stuck = [n for n, s in enumerate(found.mode) if not s]
        if not stuck:
            return found, v
        by_input = np.array([self.values(t, q, row).rate for row in np.eye(self.k).tolist()]).T[stuck]
        inverse = np.linalg.pinv(by_input)
        found.locked = not any(found.mode) and np.linalg.matrix_rank(by_input) == self.k
        # without what rounding leaves in joints that stick
        slowed = np.array(v) - inverse @ (by_input @ np.array(v))
        return found, [0.0] * self.k if found.locked else slowed.tolist()

    def _turned_back(self, t: float, q: Floats, v: float) -> Mode:
        """The mode after a joint turns back while the one input goes on.

        Others may do so at the same pose: a chain that another link drives turns back as a whole.
        """
        beside = math.copysign(TOGETHER * self.scale[0], v)
        before, after = (self.values(t, [q[0] + x], [v]).rate for x in (-beside, beside))
        changed = (_sign(b) if a * b < 0 else s for a, b, s in zip(before, after, self.mode, strict=True))
        return tuple(changed)

    def left(self, ended: str, before: Mode) -> dict[str, float]:
        """The levels at which a path in this mode begins: what the end of the last one, in another mode, has met."""
        if not ended.startswith("friction"):
            return {}
        both = enumerate(zip(before, self.mode, strict=True))
        return {ended: 0.0} | {f"friction {n}": 0.0 for n, (a, b) in both if a == -b}

    def _decided_alone(self, t: float, q: Floats, v: Floats) -> Mode:
        """The mode of one degree of freedom: it moves, begins to move one way, or sticks."""
        if v[0]:
            return self.values(t, q, v).signs
        for direction in (1.0, -1.0):
            if self.tendency(t, q, direction) * direction > 0:
                return self.values(t, q, [direction]).signs
        return (0,) * len(self.arms)

    def _decided(self, t: float, q: Floats, v: Floats, resting: Sequence[int]) -> Mode:
        """The mode of several degrees of freedom in which the motion goes on where some joints rest.

        Friction of a resting joint is what keeps it at rest, at most μ r |R|: found joint by joint, over and over.
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
            if max(abs(x - y) for x, y in zip(phi, before, strict=True)) <= CLOSE * max(map(abs, phi)):
                break
        for n in resting:
            most, slip = self.arms[n] * values.force(n, phi), values.slid(n, phi)
            slides = abs(phi[n]) >= most * (1 - 1e-9) and abs(slip) > 1e-9 * abs(values.slip[n])
            signs[n] = _sign(slip) if slides else 0
        return tuple(signs)

    def watches(self) -> list[Watch]:
        """What ends a path in this mode: a sliding joint at rest, a sticking one that breaks away."""
        if self.locked and self.k == 1:
            return [self._breaking_away(1), self._breaking_away(-1)]
        found = super().watches()
        if self.k > 1:
            return found + [self._sliding(n) if s else self._sticking(n) for n, s in enumerate(self.mode)]
        rest = _watch("rest", lambda t, q, v: v[0], lambda t, q, v, a: a[0])
        return [*found, rest, *(self._turning_back(n) for n in range(len(self.mode)))]

    def _breaking_away(self, direction: int) -> Watch:
        """A mechanism that stands, and would begin to move one way."""
        return _watch(f"away {direction}", lambda t, q, v: self.tendency(t, q, float(direction)))

    def _turning_back(self, n: int) -> Watch:
        """A joint whose rate changes its sign while the one input goes on: its coefficient does."""
        return _watch(str(n), lambda t, q, v: self.values(t, q, [1.0]).rate[n])

    def _sliding(self, n: int) -> Watch:
        def slip(t: float, q: Floats, v: Floats, rates: Floats) -> float:
            values = self.values(t, q, v)
            return values.slid(n, self.friction(values))

        return _watch(str(n), lambda t, q, v: self.values(t, q, v).rate[n], slip)

    def _sticking(self, n: int) -> Watch:
        def spare(t: float, q: Floats, v: Floats) -> float:
            values = self.values(t, q, v)
            phi = self.friction(values)
            return self.arms[n] * values.force(n, phi) - abs(phi[n])

        return _watch(str(n), spare)


def _watch(name: str, value: Value, rate: Rate | None = None) -> Watch:
    """What ends a path, in a mode, where it is zero."""
    return Watch(f"friction {name}", value, rate, [0.0], ends=True)


def _sign(x: float) -> int:
    return (x > 0) - (x < 0)


def _second(block: Block, guide: int) -> Number:
    """The second derivative of a slide in time."""
    factor, value = block.second(lambda rates, k: rates.slide[guide][k - 1])
    return None if value is None else value * factor
