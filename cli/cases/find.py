"""`--find NAME --so-that QUANTITY=VALUE`: the number of a mechanism with which a quantity of its pose has a value."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from cli.cases.analysis import Analysis, Request
from cli.cases.axes import dimension_named, place_or_angle
from cli.cases.inputs import Varied, of_one, with_numbers
from cli.cases.poses import cells_of, column, keys_of, solved
from cli.read import root_search
from cli.read.options import bad
from dalembert.errors import DataError
from dalembert.units import UNITS, from_si, written
from virtualwork import MechanismError
from virtualwork.quantities import Component

if TYPE_CHECKING:
    from cli.cases.inputs import Grid
    from virtualwork import Mechanism


class Changed(NamedTuple):
    """The mechanism with the number that was sought."""

    mechanism: Mechanism
    found: root_search.Found


def find(
    m: Mechanism,
    bare: Mapping[str, str],
    request: Request,
    moved: Grid | None,
    name: str | None,
    wanted: str | None,
) -> Changed:
    """Return the mechanism with the number nearest to its own with which the quantity has the value.

    Raises
    ------
    typer.BadParameter
        A name or a value that means nothing.
    DataError
        No number in reach gives the value.
    """
    both = root_search.pair(name, wanted)
    assert both is not None
    name, wanted = both
    of = dimension_named(m, name, name, "--find")
    word, text = root_search.quantity_and_value(wanted, "B.vx=3m_s")
    its_own = request._replace(only=[word], order=None)

    def analysis(mechanism: Mechanism) -> Analysis:
        return Analysis(its_own, mechanism, of_one(mechanism, moved))

    whole = analysis(m)
    whole.check_names()
    choices = [each for each in whole.tabled if word in each.names]
    if len(choices) != 1:
        every = ", ".join(dict.fromkeys(n for each in whole.tabled for n in each.names[:1]))
        raise bad("--so-that", f"'{word}': expected one number: {every}")
    (each,) = choices
    target, unit = _value(each, text, bare)

    def value(x: float) -> float | None:
        try:
            a = analysis(with_numbers(m, [of.of], [x]))
            return cells_of([each], solved(a.motions[0], keys_of([each])), a.inputs.n, a.set_angles)[each][0]
        except (MechanismError, DataError):
            return None

    own = m.value(of.label)
    sought = root_search.Sought(of.of.header, of.unit, _shown(of, float(own.real)) if own == own else 0.0)
    goal = root_search.Goal(word, unit, target, bool(each.link))
    root = root_search.search(name, sought, goal, value)
    text = f"{name} = {_text(of, root, bare)} gives {word} = {root_search.amount(target, unit)}"
    return Changed(with_numbers(m, [of.of], [root]), root_search.Found(sought.header, root, text))


def _shown(of: Varied, si: float) -> float:
    return math.degrees(si) if of.unit == "deg" else si


def _text(of: Varied, shown: float, bare: Mapping[str, str]) -> str:
    """The number in the file's own unit."""
    unit = bare.get("length", of.unit) if of.kind == "length" else of.unit
    if of.kind == "length" and unit in UNITS["length"]:
        return f"{float(from_si(shown, 'length', unit)):.10g} {written(unit)}"
    return f"{shown:.10g}°" if of.unit == "deg" else f"{shown:.10g} {written(of.unit)}".rstrip()


def _value(each: Component, text: str, bare: Mapping[str, str]) -> tuple[float, str]:
    """The value in the unit that the quantity is shown in, and that unit."""
    unit = column(each.header, []).unit
    if unit == "deg":
        return place_or_angle(text, "angle", "--so-that", bare), unit
    if unit == "m":
        return place_or_angle(text, "length", "--so-that", bare), unit
    return root_search.value_in(unit, text), unit
