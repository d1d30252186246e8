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
from operator import mul
from typing import NamedTuple

import numpy as np

from dalembert.arithmetic.adjoint import derivatives
from dalembert.arithmetic.recorded import RECORDED, Number
from dalembert.arithmetic.systems import solved
from dalembert.arithmetic.tape import Tape
from virtualwork.describe import MechanismError
from virtualwork.formulas.block import Block
from virtualwork.formulas.numbers import Reals, dot, minus
from virtualwork.intime.equations import Equations, Lost
from virtualwork.intime.powers import potential, wasted
from virtualwork.intime.watch import Floats, Watch

# iterations of friction and joint forces; each gains a factor of some μ r / l
LIMIT = 400
CLOSE = 1e-15
# rad, sizes, or of the largest rate: joints that turn back so near each other do so together
TOGETHER = 1e-9
Mode = tuple[int, ...]
"""For each joint that rubs: the sign of its rate, 0 where it sticks."""


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
        k = self.k
        recording = self.recording(True, True, False)
        again = recording.recorder
        paths, of, block = recording.forces
        contacts = paths.case.contacts
        count = len(contacts)
        rubs = [again.input(f"friction {n}") for n in range(count)]
        found: dict[str, Number] = {}
        for n, (joint, *_rest) in enumerate(contacts):
            block.friction[n] = rubs[n] if joint.guide is None else rubs[n] * of.rail(block, joint.guide)
        for n, (joint, body, other, *_rest) in enumerate(contacts):
            recording.value(("force", joint.key, body))
            force = of.on_side(block, (joint.key, body))
            if joint.guide is None:
                rate, slip = (
                    minus(block.omega(body), block.omega(other)),
                    minus(block.alpha(body), block.alpha(other)),
                )
            else:
                force = dot(force, 1j * of.rail(block, joint.guide))
                rate, slip = block.slide_rate(joint.guide), _second(block, joint.guide)
            for name, value in (("x", force.real), ("y", force.imag), ("rate", rate), ("slip", slip)):
                found[f"{name} {n}"] = 0.0 if value is None else value
        found |= {f"effort {j}": recording.value(("effort", j)) for j in range(k)}
        motion = again.tape(found)
        inputs = {name: again.input(name) for name in motion.inputs}
        free = [f"a{j}" for j in range(k)] + [f"friction {n}" for n in range(count)]
        there = [name for name in free if name in motion.inputs]
        slopes = derivatives(motion, there).on(inputs, RECORDED)
        still = motion.on(inputs | dict.fromkeys(there, 0.0), RECORDED)

        def slope(of: str, to: str) -> Number:
            return slopes.get(f"d({of})/d({to})", 0.0)

        mass = [[slope(f"effort {i}", f"a{j}") for j in range(k)] for i in range(k)]
        a0 = _solved(mass, [-still[f"effort {i}"] for i in range(k)])
        per = [
            _solved(mass, [-slope(f"effort {i}", f"friction {m}") for i in range(k)]) for m in range(count)
        ]
        out: dict[str, Number] = {f"a {j}": value for j, value in enumerate(a0)}
        out |= {f"per {m} {j}": per[m][j] for m in range(count) for j in range(k)}
        for n in range(count):
            out[f"rate {n}"] = still[f"rate {n}"]
            for name in ("x", "y", "slip"):
                of_a = [slope(f"{name} {n}", f"a{j}") for j in range(k)]
                out[f"{name} {n}"] = sum((s * x for s, x in zip(of_a, a0, strict=True)), still[f"{name} {n}"])
                for m in range(count):
                    own = slope(f"{name} {n}", f"friction {m}")
                    out[f"{name} {n} {m}"] = sum((s * x for s, x in zip(of_a, per[m], strict=True)), own)
        speeds = [again.input(f"v{j}") for j in range(k)]
        out["power"] = wasted(paths.case.loads, block, speeds)
        kinetic: Number = 0.0
        for i in range(k):
            for j in range(k):
                kinetic = kinetic + 0.5 * (speeds[i] * mass[i][j] * speeds[j])
        return again.tape(out), again.tape({"energy": kinetic + potential(paths.case.loads, block)})

    def values(self, t: float, q: Floats, v: Floats) -> Values:
        """What the tape says at a state.

        Raises
        ------
        Lost
        """
        if not self._covered[0] <= q[0] <= self._covered[1]:
            self._cover(q[0])
        try:
            found = self._function(*self._filled(t, q, v))
        except (ZeroDivisionError, ValueError, OverflowError):
            raise Lost from None
        if any(x - x != 0.0 for x in found):
            # NaN and infinity
            raise Lost
        k, c = self.k, len(self.arms)
        x = iter(found)
        a = [next(x) for _ in range(k)]
        per = [[next(x) for _ in range(k)] for _ in range(c)]
        rate, slip, p, slips, forces = [], [], [], [], []
        for _ in range(c):
            rate.append(next(x))
            real, real_per = next(x), [next(x) for _ in range(c)]
            imag, imag_per = next(x), [next(x) for _ in range(c)]
            p.append(complex(real, imag))
            forces.append([complex(*pair) for pair in zip(real_per, imag_per, strict=True)])
            slip.append(next(x))
            slips.append([next(x) for _ in range(c)])
        return Values(a, per, p, forces, rate, slip, slips, next(x))

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
        power = values.power + sum(f * r for f, r in zip(phi, values.rate, strict=True))
        found = [*_moved(values, phi), power]
        if any(value - value != 0.0 for value in found):
            raise Lost
        return found

    def many(self, t: Reals, q: Reals, v: Reals) -> Reals:
        """The same of many states, (n, k + 1); NaN where there are none."""
        if self.locked:
            return np.zeros((len(q), self.k + 1))
        out = np.full((len(q), self.k + 1), np.nan)
        for i, state in enumerate(zip(t.tolist(), q.tolist(), v.tolist(), strict=True)):
            try:
                out[i] = self(*state)
            except Lost:
                continue
        return out

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
                -s * arm * abs(r) if s else x
                for s, arm, r, x in zip(mode, self.arms, _forces(values, phi), phi, strict=True)
            ]
            if inverse is not None:
                for n in stuck:
                    after[n] = 0.0
                rest = [values.slip[n] + sum(map(mul, values.slips[n], after)) for n in stuck]
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
        signs = [_sign(r) for r in self.values(t, q, [direction]).rate]
        try:
            values = self.values(t, q, [0.0])
            return _moved(values, self.in_mode(tuple(signs)).friction(values))[0]
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
                return self.in_mode(tuple(_sign(r) for r in self.values(t, q, [direction]).rate)), v
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
            return tuple(_sign(r) for r in self.values(t, q, v).rate)
        for direction in (1.0, -1.0):
            if self.tendency(t, q, direction) * direction > 0:
                return tuple(_sign(r) for r in self.values(t, q, [direction]).rate)
        return (0,) * len(self.arms)

    def _decided(self, t: float, q: Floats, v: Floats, resting: Sequence[int]) -> Mode:
        """The mode of several degrees of freedom in which the motion goes on where some joints rest.

        Friction of a resting joint is what keeps it at rest, at most μ r |R|: found joint by joint, over and over.
        """
        values = self.values(t, q, v)
        signs = [_sign(r) for r in values.rate]
        phi = [0.0] * len(self.arms)
        for _ in range(20 * LIMIT if resting else 0):
            before = list(phi)
            for n in range(len(phi)):
                most = self.arms[n] * abs(_forces(values, phi)[n])
                if n not in resting:
                    phi[n] = -signs[n] * most
                elif values.slips[n][n] > 0:
                    slip = values.slip[n] + sum(map(mul, values.slips[n], phi))
                    phi[n] = min(most, max(-most, phi[n] - slip / values.slips[n][n]))
            if max(abs(x - y) for x, y in zip(phi, before, strict=True)) <= CLOSE * max(map(abs, phi)):
                break
        for n in resting:
            most = self.arms[n] * abs(_forces(values, phi)[n])
            slip = values.slip[n] + sum(map(mul, values.slips[n], phi))
            slides = abs(phi[n]) >= most * (1 - 1e-9) and abs(slip) > 1e-9 * abs(values.slip[n])
            signs[n] = _sign(slip) if slides else 0
        return tuple(signs)

    def watches(self) -> list[Watch]:
        """What ends a path in this mode: a sliding joint at rest, a sticking one that breaks away."""
        if self.locked and self.k == 1:
            return [self._breaking_away(1), self._breaking_away(-1)]
        found = super().watches()
        if self.k == 1:
            found.append(
                Watch("friction rest", lambda t, q, v: v[0], lambda t, q, v, a: a[0], [0.0], ends=True)
            )
            return found + [self._turning_back(n) for n in range(len(self.mode))]
        return found + [self._sliding(n) if s else self._sticking(n) for n, s in enumerate(self.mode)]

    def _breaking_away(self, direction: int) -> Watch:
        """A mechanism that stands, and would begin to move one way."""

        def tendency(t: float, q: Floats, v: Floats) -> float:
            return self.tendency(t, q, float(direction))

        return Watch(f"friction away {direction}", tendency, None, [0.0], ends=True)

    def _turning_back(self, n: int) -> Watch:
        """A joint whose rate changes its sign while the one input goes on: its coefficient does."""
        return Watch(
            f"friction {n}", lambda t, q, v: self.values(t, q, [1.0]).rate[n], None, [0.0], ends=True
        )

    def _sliding(self, n: int) -> Watch:
        def slip(t: float, q: Floats, v: Floats, rates: Floats) -> float:
            values = self.values(t, q, v)
            return float(values.slip[n] + sum(map(mul, values.slips[n], self.friction(values))))

        return Watch(f"friction {n}", lambda t, q, v: self.values(t, q, v).rate[n], slip, [0.0], ends=True)

    def _sticking(self, n: int) -> Watch:
        def spare(t: float, q: Floats, v: Floats) -> float:
            values = self.values(t, q, v)
            phi = self.friction(values)
            return self.arms[n] * abs(_forces(values, phi)[n]) - abs(phi[n])

        return Watch(f"friction {n}", spare, None, [0.0], ends=True)


def _sign(x: float) -> int:
    return (x > 0) - (x < 0)


def _forces(values: Values, phi: Floats) -> list[complex]:
    """The joint forces with friction."""
    return [p + sum(map(mul, q, phi)) for p, q in zip(values.p, values.q, strict=True)]


def _moved(values: Values, phi: Floats) -> Floats:
    """The accelerations with friction."""
    found = list(values.a)
    for x, per in zip(phi, values.per, strict=True):
        found = [a + x * b for a, b in zip(found, per, strict=True)]
    return found


def _second(block: Block, guide: int) -> Number:
    """The second derivative of a slide in time."""
    factor, value = block.second(lambda rates, k: rates.slide[guide][k - 1])
    return None if value is None else value * factor


def _solved(mass: list[list[Number]], right: list[Number]) -> list[Number]:
    return [right[0] / mass[0][0]] if len(right) == 1 else solved(mass, right)
