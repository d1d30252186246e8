"""The laws of a cam: how a follower's lift goes over the turn of its cam, and what is the same at every rise.

Every law is made of pieces of one form, in the local variable u = (θ − a)/w of the piece:

    s(θ) = y₀ + h·[Σ p_j u^j + A·V_m(ω u)],     V_0(x) = x − sin x, V_1 = 1 − cos x, V_2 = sin x, V_3 = cos x …

each V the derivative of the one before it, so that the k-th derivative is that of the polynomial and A ω^k V_{m+k}, over
w^k. A rise is point-symmetric about its middle: its second half is the first one counted from its end (w negative),
and the lift near either dwell loses no digit. The formulas of a rise of 1 over 0 ≤ u ≤ 1 are those of R. L. Norton,
Design of Machinery, 5th ed., §8.3 (eqs. 8.6, 8.12, 8.14, 8.15, 8.21, 8.23, 8.25).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from dalembert.dataclass import dataclass
from virtualwork.describe import DescriptionError
from virtualwork.describe.forms import Choice, Scalar
from virtualwork.describe.keys import convert, declared

if TYPE_CHECKING:
    from decimal import Decimal

TURN = 2 * math.pi
# of a turn, and of the largest rise: ends this near are the same
SAME = 1e-9


@dataclass(frozen=True)
class Piece:
    """One piece of a law: s = level + height·[Σ powers_j u^j + amplitude·V_family(frequency·u)], u = (θ − start)/width.

    `start` is counted from the beginning of the law; a negative width counts from the end of a rise.
    """

    start: float
    width: float
    level: float
    height: float
    powers: tuple[float, ...] = ()
    amplitude: float = 0.0
    frequency: float = 0.0
    family: int = 1


@dataclass(frozen=True)
class Lift:
    """The lift of a follower over the angle of `cam` against `on`: pieces between knots, over one turn.

    Attributes
    ----------
    cam, on : str
        The cam, and the body that carries both the cam and its follower.
    first : float
        The angle at which the first piece begins, rad.
    turn : float
        2π, to the digits of the other numbers.
    knots : tuple of float
        From 0 to a turn, one more than there are pieces.
    pieces : tuple of Piece
    """

    cam: str
    on: str
    first: float
    turn: float
    knots: tuple[float, ...]
    pieces: tuple[Piece, ...]


# --- a rise of 1 over 0 ≤ u ≤ 1: its pieces up to the middle -----------------------------------------------------------
# (end of the piece, powers, amplitude, frequency, family); a piece that ends beyond the middle is counted from the middle,
# about which it is odd, and is the only one without a second half
Half = tuple[float, tuple[Any, ...], Any, Any, int]


def _modified_sine(pi: Any) -> tuple[Half, ...]:
    share = 1 / (4 + pi)
    return (
        (1 / 8, (), share / 4, 4 * pi, 0),
        (7 / 8, (0.0, pi * share), 2.25 * share, 4 * pi / 3, 2),
    )


def _modified_trapezoid(pi: Any) -> tuple[Half, ...]:
    share = 1 / (2 + pi)
    amplitude = share / (2 * pi)
    return (
        (1 / 8, (), amplitude, 4 * pi, 0),
        (3 / 8, (share * (pi / 16 - 0.5 / pi), share * (2 - pi), share * 4 * pi), 0.0, 0.0, 1),
        (5 / 8, (0.0, 2 - 2 * share), amplitude, 4 * pi, 2),
    )


RISES: Mapping[str, Callable[[Any], tuple[Half, ...]]] = {
    "simple harmonic": lambda pi: ((0.5, (), 0.5, pi, 1),),
    "cycloidal": lambda pi: ((0.5, (), 0.5 / pi, 2 * pi, 0),),
    "3-4-5": lambda pi: ((0.5, (0.0, 0.0, 0.0, 10.0, -15.0, 6.0), 0.0, 0.0, 1),),
    "4-5-6-7": lambda pi: ((0.5, (0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0), 0.0, 0.0, 1),),
    "modified sine": _modified_sine,
    "modified trapezoid": _modified_trapezoid,
}
"""The laws of a rise, of π to the digits of the numbers that they are made with."""

DWELL = "dwell"
MOTIONS = (DWELL, *RISES)


@dataclass(frozen=True)
class Segment:
    """One segment of a law: a dwell, or a rise (negative: a return) between two angles of the cam.

    Where it has no beginning it begins where the one before ends, the first at 0; where the last has no end it closes
    the turn. One segment that moves may have no rise: it takes what brings the follower back to where it began.
    """

    start: float | None = declared(
        Scalar("angle"),
        "the cam's angle at its beginning; default: the end of the one before",
        default=None,
        name="from",
    )
    end: float | None = declared(
        Scalar("angle"),
        "the cam's angle at its end; default, of the last alone: a turn after the first begins",
        default=None,
        name="to",
    )
    rise: float | None = declared(
        Scalar("angle", sliding="length"),
        "by how much the follower rises, negative: returns; left out of one segment: what closes the turn",
        default=None,
    )
    motion: str = declared(Choice(MOTIONS), f"the law: {', '.join(MOTIONS)}", default=DWELL, needed=True)

    def __post_init__(self) -> None:
        convert(self)


@dataclass(frozen=True)
class Span:
    """A segment with its numbers: angles from `start` to `end`, the lift from `low` to `high`."""

    start: Any
    end: Any
    low: Any
    high: Any
    motion: str


def spans(law: Sequence[Segment], where: str, pi: Any = math.pi) -> tuple[Span, ...]:
    """The segments of a law with what they leave out.

    Parameters
    ----------
    law : sequence of Segment
    where : str
        The place that an error names.
    pi : float
        π, as precise as is wanted.

    Raises
    ------
    DescriptionError
        A gap or an overlap of segments, a law that does not cover one turn, or does not come back.

    Examples
    --------
    >>> there_and_back = [Segment(0.0, 2.0, 0.02, "cycloidal"), Segment(end=3.0), Segment(motion="3-4-5")]
    >>> [(span.start, round(span.end, 4), span.high) for span in spans(there_and_back, "law")]
    [(0.0, 2.0, 0.02), (2.0, 3.0, 0.02), (3.0, 6.2832, 0.0)]
    """
    if not law:
        raise DescriptionError(f"{where}: found no segment, expected at least one")
    begin = law[0].start if law[0].start is not None else 0.0
    closing = _closing(law, where)
    result: list[Span] = []
    at, level = begin, 0.0
    for i, segment in enumerate(law, 1):
        here = f"{where} {i}"
        start = at if segment.start is None else segment.start
        if not abs(start - at) <= SAME * TURN:
            raise DescriptionError(
                f"{here} from: found {_deg(start)}, expected {_deg(at)}, where the segment before ends"
            )
        end = segment.end
        if end is None:
            if i < len(law):
                raise DescriptionError(f"{here} to: missing; only the last segment may leave it out")
            end = begin + 2 * pi
        if not end > start:
            raise DescriptionError(
                f"{here} to: found {_deg(end)}, expected more than {_deg(start)}, its beginning"
            )
        rise: Any = 0.0 if segment.rise is None else segment.rise
        if segment.motion == DWELL and rise != 0:
            raise DescriptionError(
                f"{here} rise: found {float(complex(rise).real):g}, expected none: a dwell does not move"
            )
        if i - 1 == closing[0]:
            rise = closing[1]
        result.append(Span(start, end, level, level + rise, segment.motion))
        at, level = end, level + rise
    if not abs(at - begin - TURN) <= SAME * TURN:
        raise DescriptionError(
            f"{where}: found {_deg(at - begin)} from the first beginning to the last end, expected a turn, 360 deg"
        )
    largest = max(abs(complex(span.high - span.low)) for span in result)
    if not abs(level) <= SAME * largest:
        raise DescriptionError(
            f"{where}: found a lift of {float(complex(level).real):g} at the end of the turn, expected the lift of its "
            "beginning, 0: leave out `rise` of one segment"
        )
    return tuple(result)


def _closing(law: Sequence[Segment], where: str) -> tuple[int, Any]:
    """The segment that has no rise, and what closes the turn."""
    open_ = [i for i, s in enumerate(law) if s.rise is None and s.motion != DWELL]
    if len(open_) > 1:
        raise DescriptionError(f"{where} {open_[1] + 1} rise: missing; only one segment may leave it out")
    total: Any = 0.0
    for segment in law:
        if segment.rise is not None:
            total = total + segment.rise
    return (open_[0], -total) if open_ else (-1, 0.0)


def _deg(angle: Any) -> str:
    return f"{math.degrees(float(complex(angle).real)):.10g} deg"


def pieces(law: Sequence[Span], pi: Any = math.pi) -> tuple[tuple[Any, ...], tuple[Piece, ...]]:
    """The knots of a law, counted from its beginning, and its pieces; `pi` as precise as is wanted."""
    knots: list[Any] = [0.0]
    result: list[Piece] = []
    for span in law:
        begin, width = span.start - law[0].start, span.end - span.start
        if span.motion == DWELL:
            result.append(Piece(begin, width, span.low, 1.0))
            knots.append(begin + width)
            continue
        rise, before = span.high - span.low, 0.0
        # the second half, from its end: where each piece ends, and the piece
        back: list[tuple[float, Piece]] = []
        for end, powers, amplitude, frequency, family in RISES[span.motion](pi):
            form = powers, amplitude, frequency, family
            if end > 0.5:
                result.append(Piece(begin + 0.5 * width, width, 0.5 * (span.low + span.high), rise, *form))
            else:
                result.append(Piece(begin, width, span.low, rise, *form))
                back.append((1 - before, Piece(begin + width, -width, span.high, -rise, *form)))
            knots.append(begin + end * width)
            before = end
        for end, piece in reversed(back):
            result.append(piece)
            knots.append(begin + end * width)
    knots[-1] = 2 * pi
    return tuple(knots), tuple(result)


def splined(
    table: Sequence[tuple[float, float]],
    off: Sequence[tuple[float, float]] = (),
    number: Callable[[str, Decimal], Any] = lambda _, x: float(x),
) -> tuple[float, tuple[float, ...], tuple[Piece, ...]]:
    """The periodic cubic spline through a table of lift over a turn: its first angle, knots and pieces.

    Parameters
    ----------
    table : sequence of (angle, lift)
        Rising angles, rad, over one whole turn; the last lift is the first.
    off : sequence of (angle, lift), optional
        What the numbers of the table are exactly, less the floats.
    number : function of a name and a number
        What a number of a piece becomes; by default a float.
    """
    # loaded here: few mechanisms have a cam, and fewer a table of its lift
    from decimal import Context, localcontext

    from dalembert.arithmetic.splines import DIGITS, periodic, sums

    angles, lifts = zip(*table, strict=True)
    at, y = map(sums, (angles, lifts), zip(*off, strict=True) if off else [[0.0] * len(table)] * 2)
    y[-1] = y[0]
    with localcontext(Context(prec=DIGITS)):
        bends = periodic(at, y)
        first, result = at[0], []
        for i, (bend, following) in enumerate(pairwise([*bends, bends[0]])):
            width = at[i + 1] - at[i]
            square = width * width / 6
            slope = y[i + 1] - y[i] - square * (2 * bend + following)
            powers = (slope, 3 * square * bend, square * (following - bend))
            numbers = (number(f"{i} {j}", x) for j, x in enumerate((at[i] - first, width, y[i], *powers)))
            begin, wide, level, *terms = numbers
            result.append(Piece(begin, wide, level, 1.0, (0.0, *terms)))
        begins = tuple(float(a - first) for a in at[:-1])
    return number("first", first), (*begins, TURN), tuple(result)
