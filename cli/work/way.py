"""The worked solution of virtual power: the ledger of every step, the equation of the first with its numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from cli.cases.ledger import Entry, ledger, of_link, why_not
from cli.work.power import WorkBalance
from cli.work.states import LOADS
from dalembert.results.columns import names
from dalembert.results.way import Topic, figures
from virtualwork.textbook.link_states import KINDS


def way(w: WorkBalance) -> list[Topic]:
    """The worked solution."""
    steps = [([names("step", [step.name])], list(entries(w, i))) for i, step in enumerate(w.states.steps)]
    return [ledger("steps[]", steps, _equations(w, [instants for _, instants in steps]))]


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
        why = why_not(load, rate, works, fastest[1])
        return Entry(link, kind, torque=load, omega=rate, power=power, workless=why, field=field)
    why = why_not(load, rate, works, fastest[0])
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
            f"{figures(float(c))}·{_name(u.cells[0].link, u.cells[0].quantity, u.name)}"
            for c, u in zip(coefficients, step.unknowns, strict=True)
            if c
        ]
        lines.append(f"  {' + '.join(left)} + ({figures(power)}) = 0" if left else f"  {figures(power)} = 0")
    for unknown, cell, value in w.unknowns(0):
        name = _name(cell.link, cell.quantity, unknown.name)
        unit = "N·m" if cell.quantity == "torque" else "N"
        lines.append(f"{name} = {'not determined' if value is None else f'{figures(value)} {unit}'}")
    return lines


def _name(link: str, quantity: str, name: str) -> str:
    """How an equation calls an unknown."""
    return name or of_link(LOADS[quantity].split("_")[0].replace("torque", "T"), link)
