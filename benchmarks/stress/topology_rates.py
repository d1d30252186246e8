"""The motion of mechanisms of any topology to many digits, against the estimates of the rounding errors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import mpmath as mp
import numpy as np

from benchmarks.stress.topologies import Topology, evaluate, generate, regularity
from virtualwork import GROUND
from virtualwork.plan.order import plan
from virtualwork.plan.steps import turns

DIGITS = 40
ORDER = 2  # position, velocity, acceleration


class _Series:
    """A truncated Taylor series in time, of numbers of many digits."""

    def __init__(self, c: list[Any]) -> None:
        self.c = c

    def __add__(self, other: Any) -> _Series:
        return _Series([a + b for a, b in zip(self.c, _series(other).c, strict=True)])

    def __sub__(self, other: Any) -> _Series:
        return _Series([a - b for a, b in zip(self.c, _series(other).c, strict=True)])

    def __mul__(self, other: Any) -> _Series:
        a, b = self.c, _series(other).c
        return _Series([sum((a[j] * b[k - j] for j in range(k + 1)), mp.mpf(0)) for k in range(ORDER + 1)])

    def conjugate(self) -> _Series:
        return _Series([mp.conj(c) for c in self.c])

    def turned(self) -> _Series:
        """e^{i·self}: its derivative is i·self′ times itself."""
        e = [mp.expj(self.c[0])]
        for k in range(1, ORDER + 1):
            e.append(sum(mp.mpc(0, j) * self.c[j] * e[k - j] for j in range(1, k + 1)) / k)
        return _Series(e)


def _series(value: Any) -> _Series:
    if isinstance(value, _Series):
        return value
    return _Series([mp.mpmathify(value), *[mp.mpf(0)] * ORDER])


def _turn(data: tuple[Any, ...]) -> tuple[dict[str, Any], Any, Any]:
    """A relation of angles; of a gear's arm the share is what makes all shares together zero, which a float rounds."""
    held, const, j = data
    exact = {body: mp.mpf(c) for body, c in held.items()}
    if const is None and len(held) == 3:
        arm = list(held)[2]
        exact[arm] -= sum(exact.values())
    return exact, const, j


# rad: so near the guess a gear's constant that the program fixes is the guess's, but for rounding
GUESSED = 1e-9


def _constants(t: Topology, inputs: list[_Series]) -> list[Any]:
    """The constants of gears and belts, Σ c·θ of the links as they are placed.

    Guides, inputs and other gears place a link a rounding from where the guess has it. Where loops place it, the constant
    is the program's own: it is a number of the mechanism then, which no digits of the guess say better.
    """
    placed, found = _placed(t, inputs), []
    gears = [
        held for held, const, _ in (_turn(data) for kind, data in t.rows if kind == "turn") if const is None
    ]
    by_loops = {gear for turn in turns(plan(t.mechanism).steps) for gear, _ in turn.angle.gears}
    for i, held in enumerate(gears):
        stands = sum((c * placed.get(b, t.angles.get(b, 0.0)) for b, c in held.items()), mp.mpf(0))
        own = (
            t.mechanism.assembly.phases[i] if i in by_loops and not placed.keys() >= held.keys() else math.inf
        )
        found.append(mp.mpf(own) if abs(own - stands) < GUESSED else stands)
    return found


def _placed(t: Topology, inputs: list[_Series]) -> dict[str, Any]:
    """The angles of the guess's pose that guides, inputs and gears fix without any loop."""
    fixed: dict[str, Any] = {GROUND: mp.mpf(0)}
    rows = [_turn(data) for kind, data in t.rows if kind == "turn"]
    while True:
        rows = [row for row in rows if not fixed.keys() >= row[0].keys()]
        choices = (some for k in range(1, len(rows) + 1) for some in combinations(rows, k))
        found = next((some for some in choices if _fit(some, fixed)), None)
        if found is None:
            return fixed
        new = list(dict.fromkeys(body for held, _, _ in found for body in held if body not in fixed))
        matrix, right = mp.zeros(len(new)), mp.zeros(len(new), 1)
        for i, (held, const, j) in enumerate(found):
            there = sum(c * mp.mpf(t.angles[body]) for body, c in held.items() if body in new)
            if const is None:
                # the gear's constant takes up whatever the guess says
                right[i] = there
            else:
                value = mp.arg(_exact_direction(const[0])) + mp.mpf(const[1])
                value += 0 if j is None else inputs[j].c[0]
                value -= sum(c * fixed[body] for body, c in held.items() if body not in new)
                right[i] = value + 2 * mp.pi * mp.nint((there - value) / (2 * mp.pi))
            for body, c in held.items():
                if body in new:
                    matrix[i, new.index(body)] = c
        fixed |= dict(zip(new, mp.lu_solve(matrix, right), strict=True))


def _fit(rows: Sequence[Any], fixed: Mapping[str, Any]) -> bool:
    """Whether relations between angles fix as many as they are."""
    return len({body for held, _, _ in rows for body in held} - fixed.keys()) == len(rows)


def _exact_rows(t: Topology, x: list[_Series], inputs: list[_Series]) -> list[_Series]:
    """Every constraint along a motion."""
    constants = iter(_constants(t, inputs))
    column = {body: 3 * i for i, body in enumerate(t.mechanism.links)}
    turns = {body: x[i + 2].turned() for body, i in column.items()} | {GROUND: _series(1)}

    def seat(body: str, z: complex) -> _Series:
        arm: _Series = turns[body] * mp.mpmathify(z)
        if body == GROUND:
            return arm
        there: _Series = x[column[body]] + x[column[body] + 1] * mp.mpc(0, 1) + arm
        return there

    out = []
    for kind, data in t.rows:
        if kind == "pin":
            gap = seat(*data[:2]) - seat(*data[2:])
            out += [_Series([mp.re(c) for c in gap.c]), _Series([mp.im(c) for c in gap.c])]
        elif kind == "turn":
            held, const, j = _turn(data)
            if const is None:
                const = next(constants)
            else:
                const = mp.arg(_exact_direction(const[0])) + mp.mpf(const[1])
            total = _series(-mp.mpmathify(const))
            for body, c in held.items():
                if body != GROUND:
                    total = total + x[column[body] + 2] * c
            out.append(total if j is None else total - inputs[j])
        else:
            gap = seat(*data[:2]) - seat(*data[2:4])
            d = turns[data[2]] * _exact_direction(data[4])
            seen = (d.conjugate() * gap).c
            if kind == "line":
                out.append(_Series([mp.im(c) for c in seen]))
            else:
                out.append(_Series([mp.re(c) for c in seen]) - inputs[data[5]])
    return out


def _exact_direction(angle: float) -> Any:
    """e^{i·angle}; what is within rounding of a quarter turn is one."""
    quarter = round(2 * angle / math.pi)
    exact = abs(angle - quarter * math.pi / 2) < 1e-15 * max(1.0, abs(angle))
    return mp.mpc(0, 1) ** quarter if exact else mp.expj(angle)


def exact(t: Topology, inputs: list[list[float]]) -> list[_Series] | None:
    """The motion at the pose, x, y, θ of every link, by Newton's iteration in 40 digits on all constraints at once.

    `inputs` are value, speed and acceleration of each.
    """
    with mp.workdps(DIGITS):
        factorial = [math.factorial(k) for k in range(ORDER + 1)]
        driving = [_Series([mp.mpf(v) / f for v, f in zip(row, factorial, strict=True)]) for row in inputs]
        inverse = np.linalg.inv(evaluate(t, t.unknowns(), t.inputs)[1])
        x = [_series(v) for v in t.unknowns()]
        for k in range(ORDER + 1):
            for _ in range(8):
                left = [row.c[k] for row in _exact_rows(t, x, driving)]
                step = inverse @ np.array([float(v) for v in left])
                for series, move in zip(x, step, strict=True):
                    series.c[k] -= mp.mpf(float(move))
                if np.abs(step).max() < 1e-30:
                    break
            else:
                return None
        return x


def _size(error: Any) -> float:
    """The size of an error; what the digits of the truth do not show is none."""
    return float(abs(error)) if abs(error) > mp.mpf(10) ** (8 - DIGITS) else 0.0


def rates(rng: np.random.Generator) -> list[tuple[float, float]]:
    """Positions, rates and second rates of every link and point of one mechanism, against their estimates."""
    t = generate(int(rng.integers(1 << 31)))
    if regularity(t) <= 1e-3:
        return []
    m = t.mechanism
    driving = [[v, e.speed or 0.0, e.acceleration or 0.0] for v, e in zip(t.inputs, m.inputs, strict=True)]
    true = exact(t, driving)
    if true is None:
        return []
    q = np.array([driving])
    motion = m.motion(*(q[:, :, k] if len(m.inputs) > 1 else q[:, 0, k] for k in range(3)))
    if not motion.assembled[0]:
        return [(math.inf, 1.0)]
    pairs = []
    with mp.workdps(DIGITS):
        for i, (body, link) in enumerate(m.links.items()):
            theta, turning = true[3 * i + 2], motion.link(body)
            off = float(mp.arg(mp.expj(theta.c[0]) / mp.expj(mp.mpf(float(turning.angle[0])))))
            pairs.append((abs(off), float(turning.error_estimate(0)[0])))
            for k, found in ((1, turning.omega), (2, turning.alpha)):
                error = _size(theta.c[k] * math.factorial(k) - mp.mpf(float(found[0])))
                pairs.append((error, float(turning.error_estimate(k)[0])))
            origin = true[3 * i] + true[3 * i + 1] * mp.mpc(0, 1)
            for name, z in link.points.items():
                seat = origin + theta.turned() * mp.mpmathify(z)
                point = motion.point(name) if name in m.pins else motion.at(body, z)
                for k in range(ORDER + 1):
                    found = mp.mpmathify(complex(point.complex(k)[0]))
                    error = _size(seat.c[k] * math.factorial(k) - found)
                    pairs.append((error, float(point.error_estimate(k)[0])))
    return pairs


CAMPAIGNS = {
    "any topology": (
        "links, slots, prisms and gears joined at random, at the pose they were drawn in",
        rates,
    ),
}
