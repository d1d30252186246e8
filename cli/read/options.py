"""Option values with a unit: a bad one is wrong usage, status 2."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

from dalembert.angles import in_turn
from dalembert.errors import DataError
from dalembert.units import SMALLEST, UNITS, to_si

if TYPE_CHECKING:
    from concurrent.futures import Executor
    from fractions import Fraction

    from dalembert.written import Steps


STATES = 250_000  # what a gigabyte holds, integrated and shown
PLACES = 10_000  # holes or blades on one rotor


def whole(text: str) -> int:
    """Read a whole number that is not negative; -1 where it is none, or one of more than 18 digits."""
    text = text.strip()
    return int(text) if text.isascii() and text.isdecimal() and len(text) <= 18 else -1


def bad(flag: str, message: object) -> typer.BadParameter:
    """Make the usage error of an option."""
    return typer.BadParameter(str(message), param_hint=flag)


def flags_of(**values: object) -> list[str]:
    """Return the flags of the options that have a value, each under the name that the function has for it."""
    there = (name for name, value in values.items() if value not in (None, False, [], ()))
    return [f"--{name.replace('_', '-')}" for name in there]


def refuse(message: str, **values: object) -> None:
    """Refuse the first of these options that is given."""
    for flag in flags_of(**values):
        raise bad(flag, message)


_NAME = re.compile(r'\s*(?:"([^"]*)")?([^,]*)')


def between_commas(text: str) -> list[str]:
    """Return the names between commas; a name with a comma of its own stands in quotes.

    >>> between_commas('H.x, "B,2".y,"C,3"')
    ['H.x', 'B,2.y', 'C,3']
    """
    names = ("".join(match.groups("")).strip() for match in _NAME.finditer(text))
    return [name for name in names if name]


def only(text: str | None, names: Sequence[str]) -> Sequence[str]:
    """Read --only: the names between commas, all of them where there is none."""
    if text is None:
        return names
    words = between_commas(text)
    for word in words or [text]:
        if word not in names:
            raise bad("--only", f"'{word}': expected {', '.join(names)}")
    return words


def column_names(pairs: list[str] | None) -> dict[str, str]:
    """Read `mass_kg=Masse`: name here -> header in the file."""
    names = {}
    for pair in pairs or ():
        name, equals, header = pair.partition("=")
        if not equals or not name.strip():
            raise bad("--column", f"'{pair}': expected NAME=HEADER, such as mass_kg=Masse")
        names[name.strip()] = header.strip()
    return names


def _read(flag: str, text: str, dimension: str, positive: bool) -> tuple[float, str]:
    # a help reads no quantities
    from dalembert.quantities import parse_quantity

    try:
        value, unit = parse_quantity(text, dimension)
    except ValueError as error:
        raise bad(flag, error) from None
    if positive and not value >= SMALLEST:
        raise bad(flag, f"'{text}': expected a positive value")
    return value, unit


def _in_si(value: float, dimension: str, unit: str) -> float:
    # without a unit it is in SI
    return float(to_si(value, dimension, unit or next(iter(UNITS[dimension]))))


def with_unit(
    flag: str, text: str | None, dimension: str, *, positive: bool = False
) -> tuple[float, str] | None:
    """Read a value and the unit it was given in; None stays None."""
    return None if text is None else _read(flag, text, dimension, positive)


def needed(flag: str, text: str, dimension: str, *, positive: bool = False) -> float:
    """Read a value that is given, in SI."""
    value, unit = _read(flag, text, dimension, positive)
    return _in_si(value, dimension, unit)


def quantity(flag: str, text: str | None, dimension: str, *, positive: bool = False) -> float | None:
    """Read a value in SI; None stays None."""
    return None if text is None else needed(flag, text, dimension, positive=positive)


def in_degrees(flag: str, text: str, *, positive: bool = False) -> float:
    """Read an angle in degrees."""
    _read(flag, text, "angle", positive)
    return float(exact_degrees(text))


def mass_at(
    flag: str, text: str, vector: str, dimension: str, expected: str
) -> tuple[float, str, float, str]:
    """Read the `MASS@ANGLE` of an option's text, each with its unit; a bare angle is in degrees."""
    from dalembert.quantities import is_number

    mass, mark, angle = vector.partition("@")
    if not mark:
        raise bad(flag, expected)
    size, unit = _read(flag, mass, dimension, positive=False)
    if size < 0:
        raise bad(flag, f"'{text}': expected a mass that is not negative")
    turn = _read(flag, f"{angle}deg" if is_number(angle) else angle, "angle", positive=False)
    return size, unit, *turn


def reading_error(text: str | None) -> tuple[float, float] | None:
    """Read `2%,2deg`: relative error of the amplitude, error of the phase in rad."""
    if text is None:
        return None
    from dalembert.quantities import parse_number

    amplitude, phase = 0.0, 0.0
    for part in text.split(","):
        part = part.strip()
        if part.endswith("%"):
            try:
                amplitude = parse_number(part[:-1]) / 100
            except ValueError:
                raise bad("--reading-error", f"'{part}': expected a share such as 2%") from None
        else:
            phase = needed("--reading-error", part, "angle")
    if amplitude < 0 or phase < 0 or amplitude + phase == 0:
        raise bad("--reading-error", f"'{text}': expected positive errors, such as 2%,2deg")
    return amplitude, phase


def mass_limits(texts: Sequence[str]) -> dict[str, tuple[float, str]]:
    """Read `--max-mass`, such as `5g` or `A=5g,B=8g`: plane -> value and unit; the key "" is for all planes."""
    limits: dict[str, tuple[float, str]] = {}
    for text in ",".join(texts).split(",") if texts else ():
        plane, mark, value = text.rpartition("=")
        if mark and not plane.strip():
            raise bad("--max-mass", f"'{text}': expected a plane's name before =, such as A=5g")
        dimension = "unbalance" if "_" in value or "*" in value or "·" in value else "mass"
        limit = with_unit("--max-mass", value, dimension, positive=True)
        assert limit is not None
        if plane.strip() in limits:
            raise bad("--max-mass", f"'{text}': this limit is given twice")
        limits[plane.strip()] = limit
    return limits


def two_bearings(flag: str, text: str) -> tuple[float, float]:
    """Read `Z1:Z2`, the places of two bearings, m."""
    parts = text.split(":")
    if len(parts) != 2:
        raise bad(flag, f"'{text}': expected Z1:Z2, such as 0mm:400mm")
    z1, z2 = (needed(flag, part, "length") for part in parts)
    if z1 == z2:
        raise bad(flag, f"'{text}': the two bearings lie at the same place")
    return z1, z2


def places(
    positions: str | None, blades: int | None, first: str, numbering: str = "with"
) -> list[float] | None:
    """Return the angles of the places where masses can go, in degrees; None where none are given.

    `numbering`: `with` where the numbers of the blades go up in the angles' sense, `against` where they go the other way.
    """
    if positions is not None and blades is not None:
        raise bad("--blades", "expected --positions or --blades, not both")
    if blades is not None:
        start, way = in_degrees("--first", first), -1 if numbering == "against" else 1
        return [in_turn(start + way * (360.0 * k / blades)) for k in range(blades)]
    if first != "0deg":
        raise bad("--first", "goes with --blades: it is the angle of the first blade")
    if numbering == "against":
        raise bad(
            "--numbering", "goes with --blades: --positions are numbered in the order in which they stand"
        )
    if positions is None:
        return None
    chosen = [in_degrees("--positions", part) for part in positions.split(",")]
    turned = sorted(in_turn(angle) for angle in chosen)
    for one, other in zip(turned, [*turned[1:], turned[0] + 360.0], strict=True):
        if len(turned) > 1 and other - one < 1e-7:
            raise bad("--positions", f"two positions at {one:g}deg")
    return chosen


def weights(flag: str, text: str | None) -> list[float] | None:
    """Read the masses of an option, kg: 1g,2g,5g."""
    return None if text is None else [needed(flag, part, "mass", positive=True) for part in text.split(",")]


def exact_degrees(text: str) -> Fraction:
    """An angle in degrees as it is written; of radians with fifty digits of π.

    >>> exact_degrees("292.5deg")
    Fraction(585, 2)
    """
    from dalembert.quantities import exactly, exactly_in_degrees, option_digits

    return exactly_in_degrees(exactly(*option_digits(text, "angle")))


def exact_places(
    positions: str | None, blades: int | None, first: str, numbering: str = "with"
) -> list[Fraction]:
    """Return the angles of `places` as they are written."""
    from fractions import Fraction

    if blades is None:
        return [exact_degrees(part) for part in (positions or "").split(",")]
    start, way = exact_degrees(first), -1 if numbering == "against" else 1
    return [start + way * Fraction(360 * k, blades) for k in range(blades)]


def plane_vector(flag: str, text: str, dimension: str) -> complex:
    """Read `X,Y` as x + iy, in units as `vector` does."""
    return complex(*components(flag, text, dimension, 2))


def vector(flag: str, text: str | None, dimension: str) -> tuple[float, float, float] | None:
    """Read `x,y,z` in SI, or in the units that stand with the numbers; a unit behind the last serves all without one."""
    if text is None:
        return None
    x, y, z = components(flag, text, dimension, 3)
    return x, y, z


def components(flag: str, text: str, dimension: str, count: int) -> list[float]:
    """Read one, two or three numbers between commas, in units as `vector` does."""
    parts = [part.strip() for part in text.split(",")]
    expected = ("a number", "two numbers X,Y", "three numbers x,y,z")[count - 1]
    if len(parts) != count:
        raise bad(flag, f"'{text}': expected {expected}")
    try:
        numbers = [_number_and_unit(part, dimension) for part in parts]
    except ValueError as error:
        raise bad(flag, f"'{text}': expected {expected}: {error}") from None
    return [_in_si(value, dimension, unit or numbers[-1][1]) for value, unit in numbers]


def _number_and_unit(text: str, dimension: str) -> tuple[float, str]:
    from dalembert.quantities import parse_number, parse_quantity

    try:
        return parse_number(text), ""
    except ValueError:
        return parse_quantity(text, dimension)


def number_or_quantity(flag: str, text: str, dimension: str) -> float:
    """Read a value in SI, or in the unit that stands with it."""
    try:
        value, unit = _number_and_unit(text.strip(), dimension)
    except ValueError as error:
        raise bad(flag, error) from None
    return _in_si(value, dimension, unit)


def time_range(flag: str, text: str) -> list[float]:
    """Read `START:STOP:STEP` or `START:STOP/N` in seconds."""
    return grid(flag, text, lambda part: number_or_quantity(flag, part, "time"), "states", "0:10:0.01")


def steps(
    flag: str, text: str, read: Callable[[list[str]], list[float] | list[Fraction]], example: str
) -> Steps:
    """Read `START:STOP:STEP` or `START:STOP/N` (N equal steps); a step that divides the range includes its end.

    `read` reads the two or three; of floats the decimals that they print as count.
    """
    from fractions import Fraction

    from dalembert.written import Steps

    count = None
    body = text
    if "/" in text:
        body, _, number = text.rpartition("/")
        if whole(number) < 1:
            raise bad(flag, f"'{text}': expected a number of equal steps after the /, such as 0:10/1000")
        count = whole(number)
    parts = body.split(":")
    if len(parts) != (2 if count else 3):
        raise bad(flag, f"'{text}': expected START:STOP:STEP or START:STOP/N, such as {example}")
    # the decimals that the numbers print as, exactly: 50mm and a step of 1mm are 0.051, not 0.051000000000000004
    start, stop, *by = [Fraction(repr(x)) if isinstance(x, float) else x for x in read(parts)]
    if count is None:
        if by[0] == 0 or (stop - start) * by[0] < 0:
            raise bad(flag, f"'{text}': a step of {parts[2]} never gets from {parts[0]} to {parts[1]}")
        ratio = (stop - start) / by[0]
        count = round(ratio)
        if abs(ratio - count) * 10**9 > max(Fraction(1), ratio):
            stop, count = start + int(ratio) * by[0], int(ratio)
    below = math.lcm(start.denominator, stop.denominator) * max(count, 1)
    first, last = int(start * below), int(stop * below)
    return Steps(first, (last - first) // max(count, 1), below, count + 1)


def grid(
    flag: str, text: str, read: Callable[[str], float], what: str, example: str, most: int = STATES
) -> list[float]:
    """The values of such a range; `what` is counted, `most` of them at most."""
    first, each, below, n = steps(flag, text, lambda parts: [*map(read, parts)], example)
    if n - 1 > most:
        raise bad(flag, f"'{text}': {float(n - 1):.3g} {what}: expected at most {most}")
    return [(first + i * each) / below for i in range(n)]


@contextmanager
def processes(workers: int) -> Iterator[Executor | None]:
    """So many worker processes, for `with`; None for one."""
    if workers < 2:
        yield None
        return
    from dalembert.arithmetic.parts import LostPart
    from dalembert.arithmetic.processes import Processes

    try:
        with Processes(workers) as pool:
            yield pool
    except LostPart as lost:
        raise DataError(str(lost)) from None


def refuse_long(count: int) -> None:
    """Refuse --page of more poses than a page can hold."""
    from dalembert.page import fits

    try:
        fits(count)
    except ValueError as error:
        raise bad("--page", str(error)) from None
