"""The lift of a cam's follower and its derivatives, of every order, from one text (`describe.laws` has the form).

The lift depends on the direction of the cam alone: θ is taken from e^{i(θ_cam − θ_on)}, within one turn from where the
law begins. Its derivatives along the input are those of a function of a function (Faà di Bruno).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from dalembert.arithmetic.recorded import bare
from dalembert.arithmetic.varied import direction
from dalembert.dataclass import dataclass, field
from virtualwork.describe.laws import TURN, Lift
from virtualwork.formulas.numbers import EPS, Kind, Number, plus, times

# an angle so near a knot stands at it: what the rounding of a direction can make
NEAR = 16 * TURN * EPS
# below this V_0 = x − sin x is a series, in which nothing cancels
SMALL = 0.5
SERIES = tuple((-1.0) ** j / math.factorial(2 * j + 3) for j in range(7))


@dataclass(frozen=True)
class Located:
    """Where a cam's angle lies in its law: the local variable, and the numbers of the piece it lies on."""

    kind: Kind
    u: Number
    width: Number
    level: Number
    height: Number
    powers: tuple[Number, ...]
    amplitude: Number
    frequency: Number
    family: Number
    families: tuple[int, ...]
    # derivatives of the lift, and V, once they are formed
    known: dict[tuple[str, int], Number] = field(default_factory=dict, compare=False, repr=False)


def located(kind: Kind, of: Lift, turn: Number) -> Located:
    """Find the piece of a law at the direction e^{iθ} of its cam against the body that carries it."""
    first = direction(of.first)
    angle = kind.angle(turn if first == 1 else turn * first.conjugate())
    angle = kind.select(angle + NEAR, angle, angle + of.turn)
    return placed(kind, of, angle, lambda values: kind.among(angle + NEAR, of.knots, values))


def placed(kind: Kind, of: Lift, angle: Number, chosen: Callable[[list[Number]], Number]) -> Located:
    """An angle of a law, and the numbers of its piece: `chosen` takes one of a number for each piece."""

    def among(name: str) -> Number:
        return chosen([getattr(piece, name) for piece in of.pieces])

    def power(j: int) -> Number:
        return chosen([piece.powers[j] if j < len(piece.powers) else 0.0 for piece in of.pieces])

    highest = max(len(piece.powers) for piece in of.pieces)
    width = among("width")
    u = (angle - among("start")) / width
    return Located(
        kind,
        u,
        width,
        among("level"),
        among("height"),
        tuple(power(j) for j in range(highest)),
        among("amplitude"),
        among("frequency"),
        among("family"),
        tuple(sorted({piece.family for piece in of.pieces if piece.amplitude})),
    )


def lift(at: Located, k: int) -> Number:
    """The k-th derivative of the lift to the angle of its cam, formed once."""
    if ("lift", k) not in at.known:
        at.known["lift", k] = _derived(at, k)
    return at.known["lift", k]


def _derived(at: Located, k: int) -> Number:
    total: Number = None
    # Horner's rule
    for j in range(len(at.powers) - 1, k - 1, -1):
        c = math.perm(j, k) * at.powers[j]
        total = c if total is None else total * at.u + c
    for family in at.families:
        wave = at.amplitude * _form(at, family + k)
        for _ in range(k):
            wave = wave * at.frequency
        if len(at.families) > 1:
            wave = at.kind.select(0.5 - abs(at.family - family), wave, 0.0)
        total = plus(total, wave)
    value = times(at.height, total)
    for _ in range(k):
        value = None if value is None else value / at.width
    if k == 0:
        value = plus(at.level, value)
    return 0.0 if value is None else value


def _form(at: Located, m: int) -> Number:
    """V_m(ω u): x − sin x, 1 − cos x, sin x, cos x, and on as the derivatives of a sine go."""
    x = at.frequency * at.u
    if m == 0:
        square, series = x * x, 0.0 * x
        for c in reversed(SERIES):
            series = series * square + c
        return at.kind.select(SMALL - abs(x), x * square * series, x - _form(at, 2))
    if m == 1:
        # 1 − cos x, in which nothing cancels
        half = at.kind.exp(0.5 * x).imag
        return 2 * (half * half)
    if ("exp", 0) not in at.known:
        at.known["exp", 0] = at.kind.exp(x)
    e = at.known["exp", 0]
    value = (e.imag, e.real)[m % 2]
    return -value if (m - 2) % 4 > 1 else value


def composed(k: int, of: Located, rates: list[Number]) -> Number:
    """The k-th derivative of a lift along the input, of the derivatives of its cam's angle (Faà di Bruno)."""
    # bell[i][j]: the partial Bell polynomial B_{i,j} of the rates; None is zero
    bell: list[list[Number]] = [[1.0] + [None] * k]
    for i in range(1, k + 1):
        row: list[Number] = [None]
        for j in range(1, k + 1):
            total: Number = None
            for a in range(1, i - j + 2):
                total = plus(total, times(math.comb(i - 1, a - 1), times(rates[a - 1], bell[i - a][j - 1])))
            row.append(total)
        bell.append(row)
    value: Number = None
    for j in range(1, k + 1):
        if bell[k][j] is not None:
            value = plus(value, times(lift(of, j), bell[k][j]))
    return value


def lift_at(of: Lift, angle: Any, k: int = 0) -> Any:
    """A lift, or its k-th derivative, at angles of the cam, an array or a number, rad."""
    from virtualwork.formulas.numbers import MANY, ONE

    kind: Kind = ONE if isinstance(angle, (int, float)) else MANY
    return bare(lift(located(kind, of, kind.exp(angle)), k))
