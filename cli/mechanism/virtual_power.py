"""Virtual power of link states: their unknown loads and the power of every term; tables, picture, worked solution."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.cases.ledger import Entry, of_link, why_not
from cli.cases.ledger import ledger as ledger_topic
from dalembert.drawing.sheet import blank
from dalembert.results.columns import Column, Table, names, number
from dalembert.results.way import Topic, figures
from virtualwork.textbook import picture
from virtualwork.textbook.link_states import KINDS
from virtualwork.textbook.state_table import COLUMNS, LOADS, Cell
from virtualwork.textbook.table_balance import Term, WorkBalance

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
        picture.ledger(bars, figure)
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
    picture.over_steps(x, series, figure)
    return figure


def way(w: WorkBalance) -> list[Topic]:
    """The worked solution: the ledger of every step, the equation of the first with its numbers."""
    steps = [([names("step", [step.name])], list(entries(w, i))) for i, step in enumerate(w.states.steps)]
    return [ledger_topic("steps[]", steps, _equations(w, [instants for _, instants in steps]))]


def entries(w: WorkBalance, index: int) -> Iterator[Entry]:
    """Yield every load of a step, those that do no work too; the unknown's in the end."""
    step, (states, solved, place) = w.states.steps[index], w.at(index)
    products = states.products()
    for f, (of, rows) in enumerate(step.fields.items()):
        here: tuple[int, ...] = (place,) if len(step.fields) == 1 else (place, f)

        def at(values: object, here: tuple[int, ...] = here) -> Any:
            return np.broadcast_to(np.asarray(values), states.shape)[here].tolist()

        fastest = [float(largest[here][..., 0]) for largest in states.fastest]
        for kind in KINDS:
            if kind not in states.terms:
                continue
            term = states.terms[kind]
            loads, rates = map(at, products[kind])
            for i, row in enumerate(rows):
                works, workless = bool(term.works[(*here, i)]), term.workless[(*here, i)]
                if works or workless:
                    power = float(term.power[(*here, i)])
                    yield _entry(w.states.links[row], kind, loads[i], rates[i], power, works, fastest, of)
        velocities, omegas = at(states.applied_velocity), at(states.omega)
        by_cell = {(w.states.links[row], w.states.occurrence[row]): i for i, row in enumerate(rows)}
        for unknown, cell, load in w.unknowns(index):
            j, k = step.unknowns.index(unknown), by_cell.get((cell.link, cell.occurrence))
            if load is None or not solved.determined[place, j] or k is None:
                continue
            turns = cell.quantity == "torque"
            direction = 1j if cell.quantity == "fy" else 1.0
            rate = omegas[k] if turns else velocities[k]
            along = (direction * rate.conjugate()).real
            whole = load * direction
            yield _entry(cell.link, "unknown", whole, rate, load * along, along != 0, fastest, of)


def _entry(
    link: str,
    kind: str,
    load: complex | float,
    rate: complex | float,
    power: float,
    works: bool,
    fastest: list[float],
    field: str,
) -> Entry:
    """A force at a velocity, or a torque, a plain number, at an angular velocity."""
    if isinstance(load, float) and isinstance(rate, float):
        why = why_not(rate, works, fastest[1])
        return Entry(link, kind, torque=load, omega=rate, power=power, workless=why, field=field)
    why = why_not(rate, works, fastest[0])
    return Entry(link, kind, complex(load), complex(rate), power=power, workless=why, field=field)


def _equations(w: WorkBalance, steps: list[list[Entry]]) -> list[str]:
    """The equation in symbols, each product with its numbers, and the solution, of the first step."""
    step, terms = w.states.steps[0], steps[0]
    _, solved, at = w.at(0)
    lines = []
    if len(steps) > 1:
        lines.append(f"Step {step.name}; the others in the same way.")
    idle: dict[str, list[str]] = {}
    for entry in terms:
        if entry.workless:
            idle.setdefault(entry.workless, []).append(f"{entry.symbol} ({entry.kind})")
    lines += [f"No work, {why}: {', '.join(dict.fromkeys(which))}." for why, which in idle.items()]
    for place, of in enumerate(step.fields):
        here = [entry for entry in terms if entry.field == of and not entry.workless]
        if not here:
            continue
        name = f" in the velocity field {of}" if of else ""
        lines.append(f"ΣF·V + ΣT·ω = 0{name}:")
        lines.append("  " + " + ".join(f"{e.symbol}·{e.rate}" for e in here) + " = 0")
        loads = [entry for entry in here if entry.kind != "unknown"]
        lines += [f"  {entry.equation()}" for entry in loads]
        power = sum(entry.power for entry in loads)
        coefficients = solved.coefficient[at, place]
        left = [
            f"{figures(float(c))}·{u.name or _symbol(u.cells[0])}"
            for c, u in zip(coefficients, step.unknowns, strict=True)
            if c
        ]
        lines.append(f"  {' + '.join(left)} + ({figures(power)}) = 0" if left else f"  {figures(power)} = 0")
    for unknown, cell, value in w.unknowns(0):
        unit = "N·m" if cell.quantity == "torque" else "N"
        answer = "not determined" if value is None else f"{figures(value)} {unit}"
        lines.append(f"{unknown.name or _symbol(cell)} = {answer}")
    return lines


def _symbol(cell: Cell) -> str:
    """How an equation calls the load of a cell."""
    return of_link(LOADS[cell.quantity].split("_")[0].replace("torque", "T"), cell.link)
