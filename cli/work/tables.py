"""What is computed of link states: the unknown loads, the power of every term, the sums of the steps; the picture."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.show.picture import blank
from cli.work.power import Term, WorkBalance
from cli.work.states import COLUMNS, LOADS
from dalembert.results.columns import Column, Table, names, number
from virtualwork.textbook.picture import ledger as draw_ledger
from virtualwork.textbook.picture import over_steps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

METHOD = (
    "Virtual power: the applied forces and the inertia forces −m·a, −I·α together do no work on the given velocities "
    "(d'Alembert and Lagrange; J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 1–5)."
)


def tables(w: WorkBalance, *, ledger_first: bool = False) -> dict[str, Callable[[], Table]]:
    """The tables of a result, the CSV's first."""
    parts = {
        "unknowns": lambda: unknowns(w),
        "ledger": lambda: ledger(w),
        "steps": lambda: steps(w),
        "terms": lambda: terms(w),
    }
    first = "ledger" if ledger_first else "unknowns"
    return {first: parts.pop(first), **parts}


def unknowns(w: WorkBalance) -> Table:
    """A row for each step and unknown, in the units of the marked columns."""
    table, instants = w.states.table, w.states.steps
    cells = [(step.name, *cell) for i, step in enumerate(instants) for cell in w.unknowns(i)]
    keys = [
        names("step", [step for step, *_ in cells]),
        names("link", [cell.link for _, _, cell, _ in cells]),
    ]
    if any(unknown.name for _, unknown, *_ in cells):
        keys.append(names("unknown", [unknown.name or None for _, unknown, *_ in cells], "name"))

    loads = []
    for load in LOADS:
        if any(quantity == load for _, quantity in table.marks):
            si = [np.nan if value is None or cell.quantity != load else value for _, _, cell, value in cells]
            unit = table.numbers[load].unit
            loads.append(number(load, COLUMNS[load], si, unit, place=None, exact=w.exact_unknowns))
    documented = [
        names("quantity", [LOADS[cell.quantity] for _, _, cell, _ in cells]),
        names("value", [value for *_, value in cells]),
    ]
    return Table([*keys, *loads], [key.name for key in keys], "steps[].unknowns[]", documented=documented)


def _terms(w: WorkBalance) -> list[tuple[str, Term]]:
    return [(step.name, term) for i, step in enumerate(w.states.steps) for term in w.terms(i)]


def _named(w: WorkBalance, rows: list[tuple[str, Term]]) -> list[Column]:
    """Step, field (where a step has several), link and kind of each term."""
    several = any(len(step.fields) > 1 for step in w.states.steps)
    return [
        names("step", [step for step, _ in rows]),
        *([names("field", [term.field or None for _, term in rows])] if several else []),
        names("link", [term.link for _, term in rows]),
        names("kind", [term.kind for _, term in rows]),
    ]


def ledger(w: WorkBalance) -> Table:
    """A row for each step and term; the power of a load that does no work is 0."""
    rows = _terms(w)

    def error() -> list[float]:
        return [term.error for i in range(len(w.states.steps)) for term in w.terms(i, errors=True)]

    named = _named(w, rows)
    power = number("power", "power", [term.power or 0.0 for _, term in rows], error=error, place=None)
    return Table([*named, power], [column.name for column in named])


def terms(w: WorkBalance) -> Table:
    """The terms that do work, of the document alone."""
    rows = [(step, term) for step, term in _terms(w) if term.power is not None]
    power = names("power_W", [term.power for _, term in rows])
    return Table([], ("step",), "steps[].terms[]", documented=[*_named(w, rows), power])


def steps(w: WorkBalance) -> Table:
    """A row for each step: the sum of its powers, and the loads that do no work."""
    instants = w.states.steps
    sums = [w.sums(i) for i in range(len(instants))]
    workless = [
        [
            f"{term.link}: {term.kind}" + (f" (field {term.field})" if len(step.fields) > 1 else "")
            for term in w.terms(i)
            if term.power is None
        ]
        for i, step in enumerate(instants)
    ]
    columns = [
        names("step", [step.name for step in instants]),
        number("sum", "power", [max(each, key=abs) for each in sums]),
        Column("workless", "", [", ".join(each) for each in workless], place="workless", stored=workless),
    ]
    documented = []
    if any(len(step.fields) > 1 for step in instants):
        by_field: list[Any] = [
            dict(zip(step.fields, each, strict=True)) if len(step.fields) > 1 else None
            for step, each in zip(instants, sums, strict=True)
        ]
        condition = [w.condition(i) if len(step.fields) > 1 else None for i, step in enumerate(instants)]
        columns.insert(2, names("condition", condition))
        documented.append(Column("sums", "", [None] * len(sums), place="sums_W", stored=by_field))
    return Table(columns, ("step",), "steps[]", documented=documented)


def draw(w: WorkBalance) -> Figure:
    """Draw the ledger of one step as bars; of several, each unknown against the step."""
    figure, instants = blank(), w.states.steps
    if len(instants) == 1:
        several = len(instants[0].fields) > 1
        bars = [
            (term.link, term.kind + (f" ({term.field})" if several else ""), term.power)
            for term in w.terms(0)
            if term.power is not None
        ]
        draw_ledger(bars, figure)
        return figure
    series: dict[tuple[str, str], list[float]] = {}
    for index in range(len(instants)):
        for _, cell, value in w.unknowns(index):
            symbol, unit = LOADS[cell.quantity].split("_", 1)
            name = f"{symbol} on link {cell.link}", unit.replace("_", "·")
            series.setdefault(name, [np.nan] * len(instants))[index] = np.nan if value is None else value
    try:
        x = np.array([float(step.name) for step in instants])
    except ValueError:
        x = np.arange(1.0, len(instants) + 1)
    over_steps(x, series, figure)
    return figure
