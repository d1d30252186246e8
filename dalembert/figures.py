"""Significant figures of numbers as people type them, in decimal arithmetic: what is right, rounded, too short."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import ROUND_HALF_DOWN, ROUND_HALF_UP, Context, Decimal
from fractions import Fraction
from functools import lru_cache
from math import isfinite

from dalembert.units import MINUS

TIE = Decimal("1e-13")
"""Share of a computed number within which it may lie on either side of a tie."""
_NUMBER = re.compile(
    r"\s*(?:[^\W\d]\w*\s*(?=[=≈]))?[\s=≈~]*([+-]?)\s*((?:\d+(?:[ ']\d{3}(?!\d))*)(?:[.,]\d*(?:[ ']\d{3}(?!\d))*)*|[.,]\d+)"
    r"(?:\s*(?:[eE]|[·*x×]?\s*10\s*(?:\^|\*\*)\s*\(?|[·*x×]\s*10\s*)\s*([+-]?\d+)\)?)?\s*(.*?)\s*\Z",
    re.DOTALL,
)
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_PLAIN = str.maketrans(
    {MINUS: "-", **dict.fromkeys("‐‑–", "-"), "’": "'", **dict.fromkeys("\u00a0\u202f\u2009", " ")}
)
"""Signs of word processors and web pages as they stand on a keyboard."""


def last_place(number: str) -> int:
    """Return the power of ten at which the last figure of a decimal number stands, as a file or an option writes it.

    >>> last_place("0.250"), last_place("1,2e−3"), last_place("70"), last_place("1.5e3")
    (-3, -4, 0, 2)
    """
    mantissa, _, exponent = number.translate(_PLAIN).replace(",", ".").lower().partition("e")
    return int(exponent or 0) - len(mantissa.strip().partition(".")[2])


@dataclass(frozen=True)
class Typed:
    """A number as it was typed, and its unit behind it."""

    value: Decimal
    unit: str = ""

    @property
    def digits(self) -> int:
        """The number of its figures, zeros at the end of a whole number included.

        >>> [one.digits for text in ("82350", "0.050", "1.2e3") for one in typed(text)]
        [5, 2, 2]
        """
        return max(len(self.value.as_tuple().digits), 1) if self.value else 1

    @property
    def half_unit(self) -> Decimal:
        """Half a unit of its last figure."""
        return Decimal((0, (5,), int(self.value.as_tuple().exponent) - 1))

    @property
    def half_units(self) -> Iterator[Decimal]:
        """Half a unit of its last figure, and of those that zeros at the end of a whole number leave open."""
        _, digits, exponent = self.value.as_tuple()
        assert isinstance(exponent, int)
        yield self.half_unit
        if exponent >= 0 and self.value:
            for k in range(len(digits) - len("".join(map(str, digits)).rstrip("0"))):
                yield Decimal((0, (5,), exponent + k))

    def half_unit_at(self, figures: int) -> Decimal:
        """Half a unit of its last figure; of a whole number zeros behind its first `figures` may come from rounding.

        >>> [str(one.half_unit_at(3)) for text in ("5470", "54.70", "500", "5") for one in typed(text)]
        ['5', '0.005', '0.5', '0.5']
        """
        most = Decimal((0, (5,), self.value.adjusted() - figures))
        return max((half for half in self.half_units if half <= most), default=self.half_unit)


def typed(text: str) -> list[Typed]:
    """Read a number as people type it; several readings where a comma may stand for thousands.

    Parameters
    ----------
    text : str
        `1.23`, `1,23`, `1.23e0`, `1,23·10^2`, `82 350`, `18.1 kJ`, `256.8°`, `≈ 3`, `T2 = 3 N m`.

    Returns
    -------
    list of Typed
        The readings, the likeliest first; empty where it is no number.

    Examples
    --------
    >>> [(str(one.value), one.unit) for one in typed("18,1 kJ")]
    [('18.1', 'kJ')]
    >>> [str(one.value) for one in typed("82,350")], typed("five")
    (['82.350', '82350'], [])
    """
    text = text.translate(_PLAIN).rstrip(" .,;")
    power = re.search(r"10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)", text)
    if power is not None:
        text = text[: power.start(1)] + "^" + power[1].translate(_SUPERSCRIPTS) + text[power.end(1) :]
    match = _NUMBER.match(text)
    if match is None:
        return []
    sign, body, exponent, unit = match.groups()
    if exponent and len(exponent.lstrip("+-0")) > 3:
        return []
    readings = []
    for plain in _pointed(body.strip()):
        value = Decimal(f"{sign}{plain}{f'e{exponent}' if exponent else ''}")
        readings.append(Typed(value, unit))
    return readings


def _pointed(body: str) -> list[str]:
    """Return a number's digits with a decimal point, in every way that its marks can be meant."""
    body = body.replace(" ", "").replace("'", "")
    marks = re.findall(r"[.,]", body)
    if not marks:
        return [body]
    grouped = re.fullmatch(r"\d{1,3}(?:([.,])\d{3})(?:\1\d{3})*", body) is not None
    together = re.sub(r"[.,]", "", body)
    if len(marks) == 1:
        point = body.replace(",", ".")
        return [point, together] if grouped and marks[0] == "," and body[0] != "0" else [point]
    if len(set(marks)) == 1:
        return [together] if grouped else []
    # the last mark is the decimal one, the other parts thousands
    whole, _, rest = body.rpartition(marks[-1])
    if marks.count(marks[-1]) > 1 or not re.fullmatch(r"\d{1,3}(?:[.,]\d{3})+", whole):
        return []
    return [re.sub(r"[.,]", "", whole) + "." + rest]


@lru_cache(maxsize=64)
def _context(figures: int, rounding: str) -> Context:
    return Context(prec=figures, rounding=rounding, Emax=10**6, Emin=-(10**6))


def rounded(value: float | Decimal, figures: int) -> Decimal:
    """Round to significant figures, halves away from zero.

    >>> rounded(1.234, 3), rounded(-0.05, 3), rounded(99.96, 3)
    (Decimal('1.23'), Decimal('-0.0500'), Decimal('100'))
    """
    exact = value if isinstance(value, Decimal) else Decimal(value)
    short = _context(figures, ROUND_HALF_UP).plus(exact)
    if not short:
        return Decimal(0)
    # with every zero that the figures have
    exponent = short.adjusted() - figures + 1
    return short.quantize(Decimal((0, (1,), exponent)), context=_context(figures + 2, ROUND_HALF_UP))


def written(value: float | Decimal, figures: int) -> str:
    """Write a number with its significant figures.

    >>> written(103000.4, 3), written(0.0001234, 3), written(1.5, 3), written(123456789, 3)
    ('103000', '0.000123', '1.50', '1.23e+8')
    """
    number = rounded(value, figures)
    if number and not -5 <= number.adjusted() < 8:
        return f"{number:e}"
    return f"{number:f}"


class Right:
    """A right number and the required figures: the judge of typed numbers.

    Parameters
    ----------
    value : float or Fraction
        The right number.
    figures : int
        The required number of significant figures.

    Examples
    --------
    >>> right = Right(1.234, 3)
    >>> [right.verdict(one) for text in ("1.225", "1.2349", "1.235", "1.22", "1.2", "2") for one in typed(text)]
    ['right', 'right', 'rounding', 'rounding', 'figures', 'wrong']
    """

    def __init__(self, value: float | Fraction, figures: int) -> None:
        if not isfinite(value):
            raise ValueError(f"expected a finite number, found {value}")
        exact = value if isinstance(value, Fraction) else Fraction(value)
        self.value = Context(prec=60).divide(Decimal(exact.numerator), Decimal(exact.denominator))
        self.figures = figures
        self.answer = rounded(self.value, figures)
        self._up = _context(figures, ROUND_HALF_UP)
        # a computed number close to a tie may be rounded either way
        slack = self.value * (1 + TIE), self.value * (1 - TIE)
        down = _context(figures, ROUND_HALF_DOWN)
        self._answers = {self._up.plus(each) for each in (self.value, *slack)} | {
            down.plus(each) for each in (self.value, *slack)
        }
        self._slack = abs(self.value) * TIE

    @property
    def unit(self) -> Decimal:
        """One unit of the last required figure."""
        exponent = self.answer.adjusted() - self.figures + 1
        return Decimal((0, (1,), exponent))

    def verdict(self, number: Typed) -> str:
        """Judge a number: `right`, `rounding` (one unit of the last figure off), `figures` (too few) or `wrong`.

        Right is what rounds to the right value at the required figures, and the right value rounded to more figures.
        """
        a = number.value
        if not self.answer:
            return "wrong" if a else "right"
        if self._up.plus(a) in self._answers:
            return "right"
        off = abs(a - self.value) - self._slack
        half = self.unit / 2
        verdict = "wrong"
        for own in number.half_units:
            if off <= own:
                if own <= half:
                    return "right"
                # a single figure, or none that is right, tells nothing
                verdict = "figures" if own < abs(a) else verdict
        if verdict == "wrong" and off < 3 * half:
            return "rounding"
        return verdict
