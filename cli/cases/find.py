"""`--find NAME --so-that QUANTITY=VALUE`: the dimension of a mechanism with which a quantity has a value at one pose."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from cli.cases.analysis import Analysis
from cli.cases.axes import dimension_named, place_or_angle
from cli.cases.inputs import of_one, with_numbers
from cli.cases.poses import cells_of, column, keys_of, solved
from cli.read import root_search
from cli.read.options import bad
from cli.read.written import DEGREES, Written
from dalembert.dataclass import replace
from dalembert.errors import DataError
from dalembert.units import UNITS, from_si, written
from virtualwork import MechanismError

if TYPE_CHECKING:
    from cli.cases.cases import Cases
    from cli.cases.inputs import Varied
    from virtualwork import Mechanism
    from virtualwork.quantities import Component


def with_root(cases: Cases, find: str | None, so_that: str | None) -> Cases:
    """Return the cases with the number that --find seeks, the nearest to the file's own.

    Raises
    ------
    typer.BadParameter
        A name or a value means nothing.
    DataError
        No number in reach gives the value.
    """
    if cases.varied is not None or cases.poses > 1:
        raise bad("--find", "expected one pose of one mechanism, such as --at 60deg")
    m, bare = cases.mechanism, cases.bare
    pair = root_search.pair(find, so_that)
    assert pair is not None
    name, wanted = pair
    dimension = dimension_named(m, name, name, "--find")
    word, text = root_search.quantity_and_value(wanted, "B.vx=3m_s")
    request = cases.request._replace(only=[word], order=None)

    def analysis(mechanism: Mechanism) -> Analysis:
        return Analysis(request, mechanism, of_one(mechanism, cases.moved))

    component = _quantity(analysis(m), word)
    target, unit = _target(component, text, bare)

    def at(x: float) -> Written:
        is_angle = dimension.unit == "deg"
        return Written.of(repr(x), DEGREES if is_angle else (1, 1), is_angle=is_angle)

    def value(x: float) -> float | None:
        try:
            return number_at(analysis(with_numbers(m, [dimension.of], [at(x)])), component)
        except (MechanismError, DataError):
            return None

    own = float(m.value(dimension.label).real)
    start = 0.0 if own != own else math.degrees(own) if dimension.unit == "deg" else own
    sought = root_search.Sought(dimension.of.header, dimension.unit, start)
    goal = root_search.Goal(word, unit, target, bool(component.link))
    root = root_search.search(name, sought, goal, value)
    sentence = f"{name} = {_in_unit_of_file(dimension, root, bare)} gives {word} = {root_search.amount(target, unit)}"
    found = root_search.Found(sought.header, root, sentence)
    return replace(cases, mechanism=with_numbers(m, [dimension.of], [at(root)]), found=found)


def _quantity(nominal: Analysis, word: str) -> Component:
    """Return the one quantity of this name."""
    nominal.check_names("--so-that")
    components = [each for each in nominal.tabled if word in each.names]
    if len(components) != 1:
        names = ", ".join(dict.fromkeys(n for each in nominal.tabled for n in each.names[:1]))
        raise bad("--so-that", f"'{word}': expected one number: {names}")
    return components[0]


def number_at(analysis: Analysis, component: Component) -> float | None:
    """Return a quantity of the first pose, as it is shown; None where it has no value."""
    computed = solved(analysis.motions[0], keys_of([component]))
    return cells_of([component], computed, analysis.inputs.n, analysis.set_angles)[component][0]


def _target(component: Component, text: str, bare: Mapping[str, str]) -> tuple[float, str]:
    """Return the value that --so-that names, in the unit that the quantity is shown in, and that unit."""
    unit = column(component.header, []).unit
    kind = {"deg": "angle", "m": "length"}.get(unit)
    if kind is None:
        return root_search.value_in(unit, text), unit
    return place_or_angle(text, kind, "--so-that", bare).shown, unit


def _in_unit_of_file(dimension: Varied, shown: float, bare: Mapping[str, str]) -> str:
    """Return a number in the file's own unit."""
    unit = bare.get("length", dimension.unit) if dimension.kind == "length" else dimension.unit
    if dimension.kind == "length" and unit in UNITS["length"]:
        return f"{float(from_si(shown, 'length', unit)):.10g} {written(unit)}"
    if dimension.unit == "deg":
        return f"{shown:.10g}°"
    return f"{shown:.10g} {written(dimension.unit)}".rstrip()
