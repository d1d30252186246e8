"""`--find NAME --so-that QUANTITY=VALUE`: the search for the number with which a quantity has a value."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from cli.read.options import bad
from dalembert.dataclass import replace
from dalembert.errors import DataError
from dalembert.hints import nearest
from dalembert.quantities import is_number, number_and_unit, parse_number, parse_quantity
from dalembert.units import LISTED, UNITS, from_si, to_si, unit_name, written

if TYPE_CHECKING:
    from dalembert.results.result import Result

SIDES = 96
"""Samples on either side of the present number: evenly spaced at first, then further and further apart."""
EVEN = 32
"""So many are evenly spaced, a 32nd of the number's own size apart; angles are sampled by 3°."""
GROWTH = 1.35
CLOSE = 1e-9
"""By how much of its size a value may be missed: more is a jump, and no root."""


class Sought(NamedTuple):
    """A number that the search may change."""

    header: str
    """Its name with its unit, in results."""
    unit: str
    """The unit of `start` and of the root."""
    start: float
    """The present number."""


class Goal(NamedTuple):
    """The quantity that is to have a value."""

    name: str
    unit: str
    """The unit of its values."""
    value: float
    turns: bool = False
    """Whether it is an angle that is the same a turn further on."""


class Found(NamedTuple):
    """The number with which the quantity has the value."""

    header: str
    value: float
    text: str
    """A sentence that says it."""


def pair(find: str | None, so_that: str | None) -> tuple[str, str] | None:
    """Return both options; None where neither is there."""
    if find is None and so_that is None:
        return None
    if find is None or so_that is None:
        raise bad("--find" if find is None else "--so-that", "expected --find NAME --so-that QUANTITY=VALUE")
    return find, so_that


def quantity_and_value(text: str, example: str) -> tuple[str, str]:
    """Part `QUANTITY=VALUE`."""
    word, equals, value = text.rpartition("=")
    if not equals or not word.strip():
        raise bad("--so-that", f"'{text}': expected QUANTITY=VALUE, such as {example}")
    return word.strip(), value


T = TypeVar("T")


def solve(
    choices: Mapping[str, tuple[Sought, Callable[[float], T]]],
    name: str,
    wanted: str,
    example: str,
    quantities_of: Callable[[T], Mapping[str, tuple[float, str]]],
    vectors: str = "",
) -> tuple[T, Found]:
    """Return what a number of these makes with which a quantity has the value `wanted`; of several numbers the nearest to the present one.

    `choices` has for each name the present number, and what another one makes; `quantities_of` each quantity of that by its
    name, with its unit. `vectors` says how names of vectors go on, where only their heads are listed.

    Raises
    ------
    typer.BadParameter
        A name or a value that means nothing.
    DataError
        No number in reach gives the value.
    """
    if name not in choices:
        raise bad("--find", f"'{name}': expected one of {', '.join(choices)}{nearest(name, choices)}")
    sought, change = choices[name]
    word, text = quantity_and_value(wanted, example)
    quantities = quantities_of(change(sought.start))
    if word not in quantities:
        each = dict.fromkeys(quantity.partition(".")[0] for quantity in quantities) if vectors else quantities
        names = f"one of {', '.join(each)}{vectors}"
        raise bad("--so-that", f"'{word}': expected {names}{nearest(word, quantities)}")
    unit = quantities[word][1]
    goal = Goal(word, unit, value_in(unit, text), unit == "deg")

    def value(x: float) -> float | None:
        try:
            return quantities_of(change(x))[word][0]
        except (DataError, ValueError, KeyError):
            return None

    root = search(name, sought, goal, value)
    shown = f"{root:.10g}°" if sought.unit == "deg" else f"{root:.10g} {written(sought.unit)}".rstrip()
    sentence = f"{name} = {shown} gives {word} = {amount(goal.value, unit)}"
    return change(root), Found(sought.header, root, sentence)


def value_in(unit: str, text: str) -> float:
    """Read the wanted value in a unit of results."""
    if is_number(text):
        return parse_number(text)
    for dimension in (each for each in LISTED if unit in UNITS[each]):
        try:
            value, its = parse_quantity(text, dimension)
        except ValueError:
            continue
        return value if its == unit else float(from_si(to_si(value, dimension, its), dimension, unit))
    # results alone have some units, such as J and kg_m2_s
    parts = number_and_unit(text)
    if parts and unit_name(parts[1]) == unit:
        return parse_number(parts[0])
    raise bad("--so-that", f"'{text}': expected a number, in {written(unit)} or with its unit")


def search(name: str, sought: Sought, goal: Goal, of: Callable[[float], float | None]) -> float:
    """Return the number nearest to its present one with which the quantity has the value.

    `of` gives the quantity for a number: None or NaN where it has none.

    Raises
    ------
    DataError
        No number in reach gives the value.

    Examples
    --------
    >>> square = Goal("area", "m2", 9.0)
    >>> search("side", Sought("side_m", "m", 2.0), square, lambda side: side * side)
    3.0
    """

    def miss(x: float) -> float:
        value = of(x)
        if value is None:
            return math.nan
        value = float(value) - goal.value
        return (value + 180.0) % 360.0 - 180.0 if goal.turns else value

    step = 3.0 if sought.unit == "deg" else 0.0
    root = _nearest(miss, sought.start, step, max(abs(goal.value), 1e-300))
    if root is None:
        at = miss(sought.start) + goal.value
        now = "none" if at != at else amount(at % 360.0 if goal.turns else at, goal.unit)
        aim = f"{goal.name} = {amount(goal.value, goal.unit)}"
        raise DataError(f"--find {name}: no value in reach of its own gives {aim} (its own gives {now})")
    return root


def amount(value: float, unit: str) -> str:
    """Return a value with its unit, as it is read."""
    return f"{value:.6g}°" if unit == "deg" else f"{value:.6g} {written(unit)}".rstrip()


def _nearest(miss: Callable[[float], float], start: float, step: float, size: float) -> float | None:
    """The root nearest to the start; None where there is none in reach."""
    here = miss(start)
    if here == 0:
        return start
    sides = dict.fromkeys((1, -1), (start, here))
    # angles go once around, other numbers from a tenth to many times their own size
    for far in _distances(abs(start) or 1.0, step):
        roots = []
        for side in (1, -1):
            x = start + side * far
            value = miss(x)
            before, old = sides[side]
            sides[side] = x, value
            if value == 0:
                roots.append(x)
            elif value * old < 0:
                root = _between(miss, before, x, size + abs(value) + abs(old))
                roots += [] if root is None else [root]
        if roots:
            return min(roots, key=lambda x: abs(x - start))
    return None


def _distances(own: float, step: float) -> Iterator[float]:
    if step:
        yield from (step * k for k in range(1, 121))
        return
    far = 0.0
    pace = own / EVEN
    for k in range(SIDES):
        far += pace
        yield far
        if k >= 2 * EVEN:
            pace *= GROWTH


def _between(miss: Callable[[float], float], low: float, high: float, size: float) -> float | None:
    """The root in an interval whose ends have different signs; None where the sign changes at a jump."""
    from scipy.optimize import brentq

    try:
        root = float(brentq(miss, low, high, xtol=1e-300, rtol=4 * 2.220446049250313e-16, maxiter=200))
    except (RuntimeError, ValueError):
        return None
    return root if abs(miss(root)) <= CLOSE * size else None


def with_found(result: Result, solution: Found) -> Result:
    """Return the result with the number that `--find` found: above the table, in JSON, and in a note where a table alone is shown."""
    notes, document, aside = result.notes, result.documented, result.aside
    return replace(
        result,
        notes=lambda: "\n".join(filter(None, (notes(), f"found: {solution.text}"))),
        document=lambda: {**document(), "found": {solution.header: solution.value}},
        aside=lambda: [*aside(), f"found: {solution.text}"],
    )
