"""The balance of virtual power as columns, unknowns or ledger, and as the JSON document."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cli.read.units import from_si
from cli.show.columns import Column, Table
from cli.work.read import COLUMNS, LOADS
from cli.work.solve import WorkBalance

if TYPE_CHECKING:
    from cli.show.columns import Document

KEYS = ("step", "field", "link", "kind", "unknown")


def unknowns(found: WorkBalance) -> Table:
    """One row per step and unknown, in the units of the marked columns."""
    table = found.states.table
    steps = found.states.steps
    cells = [(step.name, *cell) for i, step in enumerate(steps) for cell in found.unknowns(i)]
    columns = [
        Column("step", "", [step for step, *_ in cells]),
        Column("link", "", [cell.link for _, _, cell, _ in cells]),
    ]
    if any(unknown.name for _, unknown, *_ in cells):
        columns.append(Column("unknown", "", [unknown.name for _, unknown, *_ in cells]))

    def errors(name: str, unit: str) -> list[float]:
        return [
            from_si(abs(bound * cell.factor) if cell.quantity == name else 0.0, COLUMNS[name], unit)
            for i, step in enumerate(steps)
            for unknown, bound in zip(step.unknowns, found.unknown_bounds(i), strict=True)
            for cell in unknown.cells
        ]

    for name in LOADS:
        if any(quantity == name for _, quantity in table.marks):
            given = table.numbers[name]
            values = [
                None if value is None or cell.quantity != name else from_si(value, COLUMNS[name], given.unit)
                for _, _, cell, value in cells
            ]
            columns.append(Column(name, given.unit, values, partial(errors, name, given.unit)))
    return Table(columns, [column.name for column in columns if column.name in KEYS])


def ledger(found: WorkBalance) -> Table:
    """One row per step and term; a load that does no work has power 0."""
    steps = found.states.steps
    terms = [(step.name, term) for i, step in enumerate(steps) for term in found.terms(i)]

    def errors() -> list[float]:
        return [term.error for i in range(len(steps)) for term in found.terms(i, bounds=True)]

    several = any(len(step.fields) > 1 for step in steps)
    columns = [
        Column("step", "", [step for step, _ in terms]),
        *([Column("field", "", [term.field for _, term in terms])] if several else []),
        Column("link", "", [term.link for _, term in terms]),
        Column("kind", "", [term.kind for _, term in terms]),
        Column("power", "W", [term.power or 0.0 for _, term in terms], errors),
    ]
    return Table(columns, [column.name for column in columns if column.name in KEYS])


def document(found: WorkBalance) -> Document:
    """The JSON document."""
    return {"steps": [_step(found, index) for index in range(len(found.states.steps))]}


def _step(found: WorkBalance, index: int) -> Document:
    step, sums = found.states.steps[index], found.sums(index)
    several = len(step.fields) > 1
    terms: list[Document] = []
    workless = []
    for term in found.terms(index):
        if term.power is None:
            workless.append(f"{term.link}: {term.kind}" + (f" (field {term.field})" if several else ""))
        else:
            of: Document = {"field": term.field} if several else {}
            terms.append({**of, "link": term.link, "kind": term.kind, "power_W": term.power})
    entry: Document = {
        "step": step.name,
        "unknowns": [
            {
                "link": cell.link,
                "quantity": LOADS[cell.quantity],
                "value": value,
                **({"name": unknown.name} if unknown.name else {}),
            }
            for unknown, cell, value in found.unknowns(index)
        ],
        "terms": terms,
        "sum_W": max(sums, key=abs),
        "workless": workless,
    }
    if several:
        entry["sums_W"] = dict(zip(step.fields, sums, strict=True))
        entry["condition"] = found.condition(index)
    return entry
