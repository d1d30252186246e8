"""`--find NAME --so-that QUANTITY=VALUE`: the number of a mechanism with which a quantity of its pose has a value."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

from cli.cases.analysis import Analysis, Request
from cli.cases.inputs import of_one
from cli.cases.poses import column
from cli.cases.quantities import Quantity, cells_of, keys_of, solved
from cli.cases.values import Varied, dimension_named, place_or_angle, with_numbers
from cli.read.options import bad
from dalembert.errors import DataError
from dalembert.quantities import is_number, parse_number, parse_quantity
from dalembert.units import LISTED, UNITS, from_si, to_si, written
from virtualwork import MechanismError

if TYPE_CHECKING:
    from cli.cases.axes import Grid
    from virtualwork import Mechanism

SIDES = 96
"""Samples on either side of the file's own number: evenly spaced at first, then further and further apart."""
EVEN = 32
"""So many are evenly spaced, a 32nd of the number's own size apart; angles are sampled by 3°."""
GROWTH = 1.35
CLOSE = 1e-9
"""By how much of its size a value may be missed: more is a jump, and no root."""


class Found(NamedTuple):
    """The mechanism with the number that was sought."""

    mechanism: Mechanism
    header: str
    """The number's path, with its unit."""
    value: float
    text: str
    """A sentence that says it."""


def find(
    m: Mechanism, bare: Mapping[str, str], request: Request, moved: Grid | None, name: str, wanted: str
) -> Found:
    """Return the mechanism with the number nearest to its own with which the quantity has the value.

    Raises
    ------
    typer.BadParameter
        A name or a value that means nothing.
    DataError
        No number in reach gives the value.
    """
    of = dimension_named(m, name, name, "--find")
    word, equals, text = wanted.rpartition("=")
    if not equals or not word.strip():
        raise bad("--so-that", f"'{wanted}': expected QUANTITY=VALUE, such as B.vx=3m_s")
    its_own = request._replace(only=[word.strip()], order=None)

    def analysis(mechanism: Mechanism) -> Analysis:
        return Analysis(its_own, mechanism, of_one(mechanism, moved))

    whole = analysis(m)
    whole.check_names()
    choices = [each for each in whole.tabled if word.strip() in each.names]
    if len(choices) != 1:
        every = ", ".join(dict.fromkeys(n for each in whole.tabled for n in each.names[:1]))
        raise bad("--so-that", f"'{word.strip()}': expected one number: {every}")
    (each,) = choices
    target, unit = _value(each, text, bare)

    def miss(x: float) -> float:
        try:
            a = analysis(with_numbers(m, [of.of], [x]))
            shown = cells_of([each], solved(a.motions[0], keys_of([each])), a.inputs.n, a.set_angles)[each][0]
        except (MechanismError, DataError):
            return math.nan
        if shown is None:
            return math.nan
        value = float(shown) - target
        # angles are the same a turn further on
        return (value + 180.0) % 360.0 - 180.0 if each.turns else value

    own = m.value(of.label)
    start = _shown(of, float(own.real)) if own == own else 0.0
    root = _nearest(miss, start, 0.0 if of.unit != "deg" else 3.0, max(abs(target), 1e-300))
    goal = f"{word.strip()} = {_amount(target, unit)}"
    if root is None:
        at = miss(start)
        now = "none" if at != at else _amount((at + target) % 360.0 if each.turns else at + target, unit)
        raise DataError(f"--find {name}: no value in reach of its own gives {goal} (its own gives {now})")
    found = with_numbers(m, [of.of], [root])
    return Found(found, of.of.header, root, f"{name} = {_text(of, root, bare)} gives {goal}")


def _amount(value: float, unit: str) -> str:
    return f"{value:.6g}°" if unit == "deg" else f"{value:.6g} {written(unit)}".rstrip()


def _shown(of: Varied, si: float) -> float:
    return math.degrees(si) if of.unit == "deg" else si


def _text(of: Varied, shown: float, bare: Mapping[str, str]) -> str:
    """The number in the file's own unit."""
    unit = bare.get("length", of.unit) if of.kind == "length" else of.unit
    if of.kind == "length" and unit in UNITS["length"]:
        return f"{float(from_si(shown, 'length', unit)):.10g} {written(unit)}"
    return f"{shown:.10g}°" if of.unit == "deg" else f"{shown:.10g} {written(of.unit)}".rstrip()


def _value(each: Quantity, text: str, bare: Mapping[str, str]) -> tuple[float, str]:
    """The value in the unit that the quantity is shown in, and that unit."""
    unit = column(each.header, []).unit
    if unit == "deg":
        return place_or_angle(text, "angle", "--so-that", bare), unit
    if unit == "m":
        return place_or_angle(text, "length", "--so-that", bare), unit
    if is_number(text):
        return parse_number(text), unit
    dimensions = [d for d in LISTED if unit in UNITS[d]]
    for dimension in dimensions:
        try:
            value, its = parse_quantity(text, dimension)
        except ValueError:
            continue
        return float(from_si(to_si(value, dimension, its), dimension, unit)), unit
    raise bad("--so-that", f"'{text}': expected a number, in {written(unit)} or with its unit")


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
