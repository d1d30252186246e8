"""The worked solution of `dalembert work`: which forces do work, the power of each, the equation and its unknown."""

from __future__ import annotations

from collections.abc import Iterator

from cli.cases.ledger import Entry, ledger, of_link, why_not
from cli.work.power import WorkBalance
from cli.work.states import LOADS
from dalembert.results.columns import names
from dalembert.results.way import Topic, figures
from virtualwork.textbook.link_states import KINDS


def way(w: WorkBalance) -> list[Topic]:
    """The topics."""
    steps = [([names("step", [step.name])], list(entries(w, i))) for i, step in enumerate(w.states.steps)]
    return [ledger("steps[]", steps, _equations(w, [instants for _, instants in steps]))]


def entries(w: WorkBalance, index: int) -> Iterator[Entry]:
    """Yield every load of a step, those that do no work too; the unknown's in the end."""
    step, states, solved = w.states.steps[index], *w.group(index)
    place = w.where[index][1]
    products = states.products()
    for f, (of, rows) in enumerate(step.fields.items()):
        here: tuple[int, ...] = (place,) if len(step.fields) == 1 else (place, f)
        fast, turning = (float(largest[here][..., 0]) for largest in states.fastest)
        for kind in KINDS:
            if kind not in states.terms:
                continue
            term = states.terms[kind]
            load, rate = (_at(each, states.shape, here) for each in products[kind])
            for i, row in enumerate(rows):
                if not (term.works[(*here, i)] or term.workless[(*here, i)]):
                    continue
                works, power = bool(term.works[(*here, i)]), float(term.power[(*here, i)])
                link = w.states.links[row]
                if kind in ("applied torque", "inertia torque"):
                    value, omega = float(load[i]), float(rate[i])
                    why = why_not(value, omega, works, turning)
                    yield Entry(link, kind, torque=value, omega=omega, power=power, workless=why, field=of)
                else:
                    force, velocity = complex(load[i]), complex(rate[i])
                    why = why_not(force, velocity, works, fast)
                    yield Entry(link, kind, force, velocity, power=power, workless=why, field=of)
        velocities = _at(states.applied_velocity, states.shape, here)
        omegas = _at(states.omega, states.shape, here)
        by_cell = {(w.states.links[row], w.states.occurrence[row]): i for i, row in enumerate(rows)}
        for unknown, cell, amount in w.unknowns(index):
            j = step.unknowns.index(unknown)
            at = by_cell.get((cell.link, cell.occurrence))
            if amount is None or not solved.determined[place, j] or at is None:
                continue
            value, i = amount, at
            if cell.quantity == "torque":
                omega = float(omegas[i])
                yield Entry(
                    cell.link, "unknown", torque=value, omega=omega, power=value * omega, field=of,
                    workless=why_not(value, omega, omega != 0, turning),
                )  # fmt: skip
            else:
                force = value * (1.0 if cell.quantity == "fx" else 1j)
                velocity = complex(velocities[i])
                power = (force * velocity.conjugate()).real
                yield Entry(
                    cell.link, "unknown", force, velocity, power=power, field=of,
                    workless=why_not(force, velocity, power != 0, fast),
                )  # fmt: skip


def _at(values: object, shape: tuple[int, ...], here: tuple[int, ...]):  # type: ignore[no-untyped-def]
    import numpy as np

    return np.broadcast_to(np.asarray(values), shape)[here]


def _equations(w: WorkBalance, steps: list[list[Entry]]) -> list[str]:
    """The equation in symbols, each product with its numbers, and the solution, of the first step."""
    step, terms = w.states.steps[0], steps[0]
    lines = []
    if len(steps) > 1:
        lines.append(f"Step {step.name}; the others in the same way.")
    idle: dict[str, list[str]] = {}
    for entry in terms:
        if entry.workless:
            idle.setdefault(entry.workless, []).append(f"{entry.symbol} ({entry.kind})")
    lines += [f"No work, {why}: {', '.join(dict.fromkeys(which))}." for why, which in idle.items()]
    for number, of in enumerate(step.fields):
        here = [entry for entry in terms if entry.field == of and not entry.workless]
        if not here:
            continue
        name = f" in the velocity field {of}" if of else ""
        lines.append(f"ΣF·V + ΣT·ω = 0{name}:")
        lines.append("  " + " + ".join(f"{e.symbol}·{e.rate}" for e in here) + " = 0")
        loads = [entry for entry in here if entry.kind != "unknown"]
        lines += [f"  {entry.equation()}" for entry in loads]
        power = sum(entry.power for entry in loads)
        coefficients = w.group(0)[1].coefficient[w.where[0][1], number]
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
