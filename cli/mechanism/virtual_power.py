"""Virtual power of link states: their unknown loads and the power of every term; tables, picture, worked solution."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cli.cases.ledger import Entry, why_not
from cli.cases.ledger import ledger as ledger_topic
from cli.mechanism.link_states import COLUMNS, LOADS, Cell, Real, StateTable, Unknown
from dalembert.drawing.sheet import blank
from dalembert.errors import DataError
from dalembert.results.columns import Column, Table, finite, names, number
from dalembert.results.way import Topic, figures
from virtualwork.textbook import picture
from virtualwork.textbook.link_states import KINDS, LinkStates, UnitLoad
from virtualwork.textbook.power_balance import Again, Balance, balance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dalembert.arithmetic.doubled import Doubled

METHOD = (
    "Virtual power: the applied forces and the inertia forces −m·a, −I·α together do no work on the given velocities "
    "(d'Alembert and Lagrange; J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 1–5)."
)


def _vector(x: Any, y: Any) -> Any:
    """Return x + iy, of floats or of numbers in 32 digits."""
    z = np.zeros_like(x, dtype=complex)
    z.real, z.imag = x, y
    return z


class Term(NamedTuple):
    """A load in a velocity field of a step; its power is None where it does no work."""

    field: str
    link: str
    kind: str
    power: float | None
    error: float = 0.0
    """The power's rounding error, on request."""


@dataclass
class WorkBalance:
    """The unknowns of every step, and the power of every term."""

    states: StateTable
    gravity: complex
    warnings: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.where: dict[int, tuple[int, int]] = {}
        self.groups: list[tuple[LinkStates, Balance]] = []
        self.places: list[tuple[list[int], NDArray[np.intp]]] = []
        sizes: dict[int, list[int]] = {}
        for index, step in enumerate(self.states.steps):
            sizes.setdefault(len(step.fields), []).append(index)
        for k, members in sizes.items():
            rows = self.states.places(members, k)
            self.places.append((members, rows))
            states = self._link_states(self.states.values, rows)
            with np.errstate(over="ignore", invalid="ignore"):
                loads = self.states.unit_loads(members, rows)
                solved = balance(states, [UnitLoad(_vector(x, y), torque) for x, y, torque in loads])
            if not (np.isfinite(solved.power).all() and np.isfinite(solved.value[solved.determined]).all()):
                raise DataError(f"{self.states.table.file}: the powers are too large to be computed with")
            for place, index in enumerate(members):
                self.where[index] = (len(self.groups), place)
            self.groups.append((states, solved))
        if self.gravity and "mass" not in self.states.values:
            self.warnings.append("--gravity: there is no column mass_*: no weights from it")
        self._warn_of_undetermined()

    def _link_states(self, values: Mapping[str, Any], rows: NDArray[np.intp]) -> LinkStates:
        """Return the states of rows of the table, of floats or in 32 digits; −1 is no row."""
        arrays = {name: np.where(rows >= 0, value[rows], 0.0) for name, value in values.items()}
        zero = np.zeros(rows.shape)

        def vector(x: str, y: str) -> Any:
            a, b = (arrays.get(name, zero) + zero for name in (x, y))
            # both of one kind of number
            return _vector(a + 0.0 * b, b + 0.0 * a)

        return LinkStates(
            velocity=vector("vx", "vy"),
            omega=arrays.get("omega", zero),
            mass=arrays.get("mass", 0.0),
            inertia=arrays.get("inertia", 0.0),
            acceleration=vector("ax", "ay"),
            alpha=arrays.get("alpha", 0.0),
            force=vector("fx", "fy"),
            torque=arrays.get("torque", 0.0),
            point_velocity=vector("fvx", "fvy") if "fvx" in arrays else None,
            gravity=self.gravity,
        )

    def _warn_of_undetermined(self) -> None:
        """Name each unknown that no equation holds; where nothing is determined, that is an error."""
        complaints: list[DataError] = []
        determined = 0
        table = self.states.table
        for index, step in enumerate(self.states.steps):
            _, solved, place = self.at(index)
            for j, unknown in enumerate(step.unknowns):
                if solved.determined[place, j]:
                    determined += 1
                    continue
                cell = unknown.cells[0]
                at = table.numbers[cell.quantity].header
                if not solved.works[place, j]:
                    rate = (
                        "omega"
                        if cell.quantity == "torque"
                        else f"the velocity along {' and '.join(c.quantity for c in unknown.cells)}"
                    )
                    reason = f"an unknown that does work: {rate} of link {cell.link} is zero in step {step.name}, so that any value balances"
                else:
                    reason = (
                        f"as many independent velocity fields as unknowns: those of step {step.name} depend on each other, "
                        "so that they do not determine it"
                    )
                complaints.append(table.error(unknown.row, at, f"?{unknown.name}", reason))
        if complaints and not determined:
            raise complaints[0]
        self.warnings += [str(complaint) for complaint in complaints[:5]]
        if len(complaints) > 5:
            self.warnings.append(f"… and {len(complaints) - 5} further cells")

    def at(self, index: int) -> tuple[LinkStates, Balance, int]:
        """Return the states of the group of a step, their balance, and the place of the step there."""
        group, place = self.where[index]
        return *self.groups[group], place

    def terms(self, index: int, *, errors: bool = False) -> Iterator[Term]:
        """Yield the terms of a step, with their rounding errors on request."""
        step = self.states.steps[index]
        states, solved, place = self.at(index)
        single = len(step.fields) == 1
        wrong = self.term_errors[self.where[index][0]] if errors else {}

        def error(kind: str, at: tuple[int, ...]) -> float:
            return float(wrong[kind][at]) if errors else 0.0

        for f, (of, rows) in enumerate(step.fields.items()):
            here: tuple[int, ...] = (place,) if single else (place, f)
            for kind in KINDS:
                if kind not in states.terms:
                    continue
                term = states.terms[kind]
                for i, row in enumerate(rows):
                    at, link = (*here, i), self.states.links[row]
                    if term.works[at]:
                        yield Term(of, link, kind, float(term.power[at]), error(kind, at))
                    elif term.workless[at]:
                        yield Term(of, link, kind, None)
            for j, unknown in enumerate(step.unknowns):
                if solved.determined[place, j]:
                    power = float(solved.unknown_power[place, f, j])
                    yield Term(of, unknown.cells[0].link, "unknown", power, error("unknown", (place, f, j)))

    @cached_property
    def second(self) -> list[tuple[LinkStates, Again]]:
        """The states of each group and what balances them in 32 digits, of the decimals of the table as they are written."""
        from dalembert.arithmetic.doubled_arrays import Vectors
        from dalembert.tables.exact import plain

        groups = []
        for (members, rows), (_, solved) in zip(self.places, self.groups, strict=True):
            states = self._link_states(self.states.exact, rows)
            gravity: Any = Vectors.of_parts(plain(self.gravity.real), plain(self.gravity.imag))
            states = replace(states, gravity=gravity)
            loads = (map(plain, of) for of in self.states.unit_loads(members, rows))
            unknowns = [UnitLoad(_vector(x, y), torque) for x, y, torque in loads]
            groups.append((states, solved.second_run((states, unknowns))))
        return groups

    @cached_property
    def term_errors(self) -> list[dict[str, Real]]:
        """The rounding errors of each group's powers by kind, and of its unknowns' powers."""
        groups = []
        for (states, solved), (exact, again) in zip(self.groups, self.second, strict=True):
            wrong = {kind: states.error_estimate(kind, exact) for kind in states.terms}
            groups.append(wrong | {"unknown": again.unknown_power.off(solved.unknown_power)})
        return groups

    def exact_unknowns(self) -> Doubled:
        """The load of each cell of all unknowns in 32 digits, (cells,)."""
        from dalembert.arithmetic.doubled_arrays import DoubledArray
        from dalembert.tables.exact import plain

        values: list[Any] = [again.value for _, again in self.second]
        cells = [
            (*self.where[i], j, cell.factor)
            for i, step in enumerate(self.states.steps)
            for j, unknown in enumerate(step.unknowns)
            for cell in unknown.cells
        ]
        high, low = (
            [getattr(values[group], part)[place, j] for group, place, j, _ in cells]
            for part in ("high", "low")
        )
        loads: Any = DoubledArray(high, low) * plain([factor for *_, factor in cells])
        return loads.doubled  # type: ignore[no-any-return]

    def sums(self, index: int) -> list[float]:
        """The sum of the powers of each velocity field of a step, W."""
        _, solved, place = self.at(index)
        return [float(power) for power in solved.sum[place]]

    def condition(self, index: int) -> float | None:
        """The condition number of a step's equations; None where they do not determine the unknowns."""
        _, solved, place = self.at(index)
        return finite(solved.condition[place])

    def unknowns(self, index: int) -> Iterator[tuple[Unknown, Cell, float | None]]:
        """Yield each cell of a step's unknowns: its load in SI, None where it is not determined."""
        _, solved, place = self.at(index)
        for unknown, value in zip(
            self.states.steps[index].unknowns, solved.value[place].tolist(), strict=True
        ):
            for cell in unknown.cells:
                yield unknown, cell, None if value != value else value * cell.factor


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
            f"{figures(float(c))}·{u.name or u.cells[0].symbol}"
            for c, u in zip(coefficients, step.unknowns, strict=True)
            if c
        ]
        lines.append(f"  {' + '.join(left)} + ({figures(power)}) = 0" if left else f"  {figures(power)} = 0")
    for unknown, cell, value in w.unknowns(0):
        unit = "N·m" if cell.quantity == "torque" else "N"
        answer = "not determined" if value is None else f"{figures(value)} {unit}"
        lines.append(f"{unknown.name or cell.symbol} = {answer}")
    return lines
