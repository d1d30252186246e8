"""From a table of link states to its unknown loads, with the ledger of virtual power."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cli.errors import DataError, quote
from cli.read.headers import spellings
from cli.read.tables import Table, read
from cli.read.units import from_si, parse_number, to_si
from cli.show.shown import Shown
from cli.show.text import table_text
from virtualwork.textbook.link_states import KINDS, Balance, LinkStates, UnitLoad, balance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Real = NDArray[np.float64]

COLUMNS = {
    "mass": "mass",
    "inertia": "inertia",
    "vx": "velocity",
    "vy": "velocity",
    "ax": "acceleration",
    "ay": "acceleration",
    "omega": "speed",
    "alpha": "angular acceleration",
    "fx": "force",
    "fy": "force",
    "fvx": "velocity",
    "fvy": "velocity",
    "torque": "torque",
}
LOADS = {"fx": "fx_N", "fy": "fy_N", "torque": "torque_N_m"}
SHOWN_STEPS = 3  # up to so many steps the terminal shows each term


class Cell(NamedTuple):
    """Where an unknown acts: the link, which of its rows (0 but for a second force), the quantity, its share."""

    link: str
    occurrence: int
    quantity: str
    factor: float


@dataclass(frozen=True)
class Unknown:
    """An unknown load and the cells it stands in; `name` is empty for a bare `?`."""

    name: str
    cells: tuple[Cell, ...]
    row: int

    @property
    def label(self) -> str:
        """How a message calls it: by its cells."""
        cells = " and ".join(f"{LOADS[cell.quantity]} of link {cell.link}" for cell in self.cells)
        return f"?{self.name} ({cells})"


@dataclass
class Step:
    """An instant: its velocity fields, each a set of rows, and its unknowns."""

    name: str
    fields: dict[str, list[int]] = field(default_factory=dict)
    unknowns: list[Unknown] = field(default_factory=list)


@dataclass(frozen=True)
class States:
    """A table of link states, in SI."""

    table: Table
    steps: list[Step]
    values: dict[str, Real]
    occurrence: list[int]
    warnings: list[str]

    @property
    def links(self) -> list[str]:
        """The link of each row."""
        return self.table.texts["link"]


def read_states(path: str) -> States:
    """Read the states of links, one row per link, step and velocity field, and find the unknowns."""
    table = read(path, numbers=COLUMNS, texts=["step", "field", "link"], blank=list(COLUMNS), marker="?")
    if "link" not in table.texts:
        raise DataError(f"{table.file}: no column link (the header is: {', '.join(table.header)})")
    if not table.numbers:
        raise DataError(
            f"{table.file}: no column of states or loads: expected some of vx_m_s, omega_rad_s, fx_N …"
        )
    for (row, quantity), mark in table.marks.items():
        if quantity not in LOADS:
            raise table.error(
                row, table.numbers[quantity].header, mark, "a number: only a force or torque may be unknown"
            )
    for quantity in ("mass", "inertia"):
        if quantity in table.numbers:
            table.reject(table.numbers[quantity].values < 0, quantity, f"a {quantity} that is not negative")
    warnings: list[str] = []
    values = {
        name: np.asarray(to_si(column.values, COLUMNS[name], column.unit))
        for name, column in table.numbers.items()
    }
    for name, value in values.items():
        overflown = ~np.isfinite(value) & np.isfinite(table.numbers[name].values)
        table.reject(overflown, name, "a number of a size that can be computed with")
    _point_velocity(values, table, warnings)
    values = {name: np.nan_to_num(value, nan=0.0) for name, value in values.items()}
    steps, occurrence = _sets(table, values)
    _unknowns(table, steps, occurrence)
    states = States(table, steps, values, occurrence, warnings)
    _check(states)
    return states


def _point_velocity(values: dict[str, Real], table: Table, warnings: list[str]) -> None:
    """Fill the velocity of the force's point where it is empty: the centre of mass's."""
    zero = np.zeros(table.rows)
    for axis, other in (("x", "y"), ("y", "x")):
        given = values.get(f"fv{axis}", np.full(table.rows, np.nan))
        center = np.nan_to_num(values.get(f"v{axis}", zero), nan=0.0)
        force = np.nan_to_num(values.get(f"f{axis}", zero), nan=1.0)
        if f"fv{other}" in values:
            half = np.isnan(given) & ~np.isnan(values[f"fv{other}"]) & (center != 0) & (force != 0)
            if half.any():
                row = int(np.argmax(half))
                warnings.append(
                    f"{table.file}: row {row + 1}: fv{other} is given and fv{axis} is empty: "
                    f"taken as the centre of mass's, v{axis} = {center[row]:g} m/s"
                )
        if f"fv{axis}" in values or f"fv{other}" in values:
            values[f"fv{axis}"] = np.where(np.isnan(given), center, given)


def _sets(table: Table, values: dict[str, Real]) -> tuple[list[Step], list[int]]:
    """Sort the rows into steps and velocity fields; a link's second row in a set is its occurrence 1."""
    steps: dict[str, Step] = {}
    seen: dict[tuple[str, str, str], int] = {}
    occurrence = []
    named = table.texts.get("step") or ["1"] * table.rows
    fields = table.texts.get("field") or [""] * table.rows
    massive = (
        sum((values.get(name, np.zeros(table.rows)) for name in ("mass", "inertia")), np.zeros(table.rows))
        > 0
    )
    for row, (step, of, link) in enumerate(zip(named, fields, table.texts["link"], strict=True)):
        steps.setdefault(step, Step(step)).fields.setdefault(of, []).append(row)
        count = seen.get((step, of, link), 0)
        seen[step, of, link] = count + 1
        if count and massive[row]:
            raise table.error(
                row,
                "link",
                link,
                f"each link once in a {'field' if of else 'step'} (a row of its own for a second force has no mass)",
            )
        occurrence.append(count)
    return list(steps.values()), occurrence


def _unknowns(table: Table, steps: list[Step], occurrence: list[int]) -> None:
    """Sort the marks into unknowns, as many in each step as it has velocity fields."""
    if not table.marks:
        where = " or ".join(spellings(name, COLUMNS[name]).split(",")[0] for name in LOADS)
        raise DataError(f"{table.file}: no unknown: expected one cell marked ? in a column such as {where}")
    marks: dict[int, list[tuple[str, str, float]]] = {}
    for (row, quantity), mark in table.marks.items():
        marks.setdefault(row, []).append((quantity, *_mark(table, row, quantity, mark)))
    for step in steps:
        cells: dict[str, dict[Cell, int]] = {}
        for rows in step.fields.values():
            for row in rows:
                for quantity, name, factor in marks.get(row, ()):
                    cell = Cell(table.texts["link"][row], occurrence[row], quantity, factor)
                    cells.setdefault(name, {}).setdefault(cell, row)
        at = f"{table.file}: step {quote(step.name)}"
        bare = cells.get("", {})
        if len(bare) > 1:
            second = list(bare.items())[1]
            raise table.error(
                second[1],
                table.numbers[second[0].quantity].header,
                "?",
                f"one ? in step {step.name} (the first is {LOADS[next(iter(bare)).quantity]} of link {next(iter(bare)).link}); "
                "several unknowns are marked ?NAME and need as many velocity fields, a column field",
            )
        if not cells:
            raise DataError(f"{at}: no unknown in it: expected one cell marked ?")
        step.unknowns = [Unknown(name, tuple(found), min(found.values())) for name, found in cells.items()]
        if len(step.unknowns) != len(step.fields):
            raise DataError(
                f"{at}: found {_count(len(step.unknowns), 'unknown')} ({', '.join(u.label for u in step.unknowns)}) and "
                f"{_count(len(step.fields), 'velocity field')} (column field): expected as many of the one as of the other"
            )


def _mark(table: Table, row: int, quantity: str, mark: str) -> tuple[str, float]:
    """Read `?`, `?NAME` or `?NAME*FACTOR` (a component of an unknown of given direction, its reaction): name and factor."""
    name, star, factor = mark[1:].partition("*")
    try:
        share = parse_number(factor) if star else 1.0
        if share == 0:
            raise ValueError
    except ValueError:
        raise table.error(
            row, table.numbers[quantity].header, mark, "?, ?NAME or ?NAME*FACTOR with a factor other than 0"
        ) from None
    return name.strip(), share


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def _check(states: States) -> None:
    """Say what the table leaves open: fields that disagree on the instant, accelerations without masses."""
    table, values = states.table, states.values
    fixed = [
        name for name in ("mass", "inertia", "ax", "ay", "alpha", "fx", "fy", "torque") if name in values
    ]
    for step in states.steps:
        first, *others = step.fields.values()
        known = {(states.links[row], states.occurrence[row]): row for row in first}
        for rows in others:
            for row in rows:
                model = known.get((states.links[row], states.occurrence[row]))
                for name in fixed:
                    if {(row, name), (model, name)} & table.marks.keys():
                        continue
                    if model is None or values[name][row] != values[name][model]:
                        states.warnings.append(
                            f"{table.file}: row {row + 1}: {table.numbers[name].header} of link {states.links[row]} is not that "
                            "of the step's first velocity field: taken as given (the loads of one instant are the same in each)"
                        )
                        return
    if "inertia" in values and ("ax" in values or "ay" in values):
        zero = np.zeros(table.rows)
        carried = (values["inertia"] > 0) & ((values.get("ax", zero) != 0) | (values.get("ay", zero) != 0))
        given = table.numbers.get("mass")
        blank = np.isnan(given.values) if given is not None else np.ones(table.rows, dtype=bool)
        if (carried & blank).any():
            row = int(np.argmax(carried & blank))
            header = given.header if given is not None else "mass_kg"
            raise table.error(
                row, header, "", f"a mass: link {states.links[row]} has an inertia and its centre accelerates"
            )
    for rate, body in (("ax", "mass"), ("ay", "mass"), ("alpha", "inertia")):
        if body not in values and values.get(rate, np.zeros(1)).any():
            states.warnings.append(
                f"{table.file}: there is {rate} and no column {body}_*: no inertia loads from it"
            )


@dataclass
class Balanced:
    """The unknowns of every step, and the power of every term."""

    states: States
    gravity: complex
    warnings: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.where: dict[int, tuple[int, int]] = {}
        self.groups: list[tuple[LinkStates, Balance, NDArray[np.intp]]] = []
        sizes: dict[int, list[int]] = {}
        for index, step in enumerate(self.states.steps):
            sizes.setdefault(len(step.fields), []).append(index)
        for k, members in sizes.items():
            rows = self._places(members, k)
            arrays = {
                name: np.where(rows >= 0, value[rows], 0.0) for name, value in self.states.values.items()
            }

            def vector(
                x: str, y: str, arrays: dict[str, Real] = arrays, shape: tuple[int, ...] = rows.shape
            ) -> Any:
                if x not in arrays and y not in arrays:
                    return 0j
                z = np.zeros(shape, dtype=complex)
                z.real, z.imag = arrays.get(x, 0.0), arrays.get(y, 0.0)
                return z

            zero = np.zeros(rows.shape)
            states = LinkStates(
                velocity=vector("vx", "vy") + zero,
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
            with np.errstate(over="ignore", invalid="ignore"):
                solved = balance(states, self._patterns(members, rows))
            if not (np.isfinite(solved.power).all() and np.isfinite(solved.value[solved.determined]).all()):
                raise DataError(f"{self.states.table.file}: the powers are too large to be computed with")
            for place, index in enumerate(members):
                self.where[index] = (len(self.groups), place)
            self.groups.append((states, solved, rows))
        self._say_undetermined()

    def _places(self, members: list[int], k: int) -> NDArray[np.intp]:
        """Return the rows of the steps as (steps, fields, links), one field squeezed out; −1 where there is none."""
        steps = [self.states.steps[index] for index in members]
        n = max(len(rows) for step in steps for rows in step.fields.values())
        places = np.full((len(steps), k, n), -1, dtype=np.intp)
        for i, step in enumerate(steps):
            for j, rows in enumerate(step.fields.values()):
                places[i, j, : len(rows)] = rows
        return places[:, 0] if k == 1 else places

    def _patterns(self, members: list[int], rows: NDArray[np.intp]) -> list[UnitLoad]:
        """Return each unknown's unit load on the rows of every step."""
        k = len(self.states.steps[members[0]].fields)
        loads = [(np.zeros(rows.shape, dtype=complex), np.zeros(rows.shape)) for _ in range(k)]
        unit = {"fx": 1.0, "fy": 1j}
        for i, index in enumerate(members):
            place = {row: at for at, row in np.ndenumerate(rows[i]) if row >= 0}
            by_cell: dict[tuple[str, int], list[int]] = {}
            for row in place:
                by_cell.setdefault((self.states.links[row], self.states.occurrence[row]), []).append(row)
            for unknown, (force, torque) in zip(self.states.steps[index].unknowns, loads, strict=True):
                for cell in unknown.cells:
                    for row in by_cell[cell.link, cell.occurrence]:
                        if cell.quantity == "torque":
                            torque[(i, *place[row])] += cell.factor
                        else:
                            force[(i, *place[row])] += unit[cell.quantity] * cell.factor
        return [UnitLoad(force, torque) for force, torque in loads]

    def _say_undetermined(self) -> None:
        """Name each unknown that no equation holds; where nothing is determined, that is an error."""
        complaints: list[DataError] = []
        found = 0
        table = self.states.table
        for index, step in enumerate(self.states.steps):
            group, place = self.where[index]
            solved = self.groups[group][1]
            for j, unknown in enumerate(step.unknowns):
                if solved.determined[place, j]:
                    found += 1
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
        if complaints and not found:
            raise complaints[0]
        self.warnings += [str(complaint) for complaint in complaints[:5]]
        if len(complaints) > 5:
            self.warnings.append(f"… and so in {len(complaints) - 5} further cells")

    # -- shown ---------------------------------------------------------------------------------------------

    def terms(self, index: int) -> Iterator[tuple[str, str, str, float | None]]:
        """Yield (field, link, kind, power in W) of each load in a step; the power is None where it does no work."""
        for *head, power, _ in self._terms(index):
            yield (*head, power)  # type: ignore[misc]

    def _terms(
        self, index: int, *, bounds: bool = False
    ) -> Iterator[tuple[str, str, str, float | None, float]]:
        """Yield the terms of a step with the bounds of their rounding errors (0 where not asked for)."""
        step = self.states.steps[index]
        group, place = self.where[index]
        states, solved, _ = self.groups[group]
        single = len(step.fields) == 1
        wrong = self.term_bounds[group] if bounds else {}

        def error(kind: str, at: tuple[int, ...]) -> float:
            return float(wrong[kind][at]) if bounds else 0.0

        for f, (of, rows) in enumerate(step.fields.items()):
            here: tuple[int, ...] = (place,) if single else (place, f)
            for kind in KINDS:
                if kind not in states.terms:
                    continue
                term = states.terms[kind]
                for i, row in enumerate(rows):
                    if term.works[(*here, i)]:
                        yield (
                            of,
                            self.states.links[row],
                            kind,
                            float(term.power[(*here, i)]),
                            error(kind, (*here, i)),
                        )
                    elif term.workless[(*here, i)]:
                        yield of, self.states.links[row], kind, None, 0.0
            for j, unknown in enumerate(step.unknowns):
                if solved.determined[place, j]:
                    power = float(solved.unknown_power[place, f, j])
                    yield of, unknown.cells[0].link, "unknown", power, error("unknown", (place, f, j))

    @cached_property
    def term_bounds(self) -> list[dict[str, Real]]:
        """Bounds of the rounding errors of each group's powers by kind, and of its unknowns' powers."""
        found = []
        for (states, solved, _), value in zip(self.groups, self.bounds, strict=True):
            assert solved.given is not None
            unit = np.stack([states.unit_power_error_estimate(of) for of in solved.given[1]], axis=-1)
            unit = unit[..., None, :] if solved.value.shape[-1] == 1 else unit
            unknown = np.abs(solved.coefficient) * value[..., None, :]
            wrong = {kind: states.term_error_estimate(kind) for kind in states.terms}
            found.append(wrong | {"unknown": unknown + unit * np.abs(solved.value)[..., None, :]})
        return found

    @cached_property
    def bounds(self) -> list[Real]:
        """Bounds of the rounding errors of each group's unknowns."""
        return [solved.error_estimate() for _, solved, _ in self.groups]

    def errors(self) -> dict[str, list[float]]:
        """Bounds of the rounding errors of the columns' numbers, in their units."""
        used = [name for name in LOADS if any(quantity == name for _, quantity in self.states.table.marks)]
        found: dict[str, list[float]] = {self.states.table.numbers[name].header: [] for name in used}
        for index, step in enumerate(self.states.steps):
            group, place = self.where[index]
            for unknown, bound in zip(step.unknowns, self.bounds[group][place].tolist(), strict=True):
                for cell in unknown.cells:
                    for name in used:
                        column = self.states.table.numbers[name]
                        size = abs(bound * cell.factor) if name == cell.quantity else 0.0
                        found[column.header].append(float(from_si(size, COLUMNS[name], column.unit)))
        return found

    def ledger_errors(self) -> dict[str, list[float]]:
        """Bounds of the rounding errors of the ledger's powers."""
        steps = range(len(self.states.steps))
        return {"power_W": [error for index in steps for *_, error in self._terms(index, bounds=True)]}

    def values(self, index: int) -> list[float | None]:
        """The unknowns of a step in SI; None where they are not determined."""
        group, place = self.where[index]
        return [None if value != value else value for value in self.groups[group][1].value[place].tolist()]

    def document(self) -> dict[str, Any]:
        """The JSON document."""
        steps = []
        for index, step in enumerate(self.states.steps):
            group, place = self.where[index]
            solved = self.groups[group][1]
            several = len(step.fields) > 1
            terms, workless = [], []
            for of, link, kind, power in self.terms(index):
                extra = {"field": of} if several else {}
                if power is None:
                    workless.append(f"{link}: {kind}" + (f" (field {of})" if several else ""))
                else:
                    terms.append({**extra, "link": link, "kind": kind, "power_W": power})
            unknowns = [
                {
                    "link": cell.link,
                    "quantity": LOADS[cell.quantity],
                    "value": None if value is None else value * cell.factor,
                    **({"name": unknown.name} if unknown.name else {}),
                }
                for unknown, value in zip(step.unknowns, self.values(index), strict=True)
                for cell in unknown.cells
            ]
            sums = solved.sum[place].tolist()
            entry = {
                "step": step.name,
                "unknowns": unknowns,
                "terms": terms,
                "sum_W": max(sums, key=abs),
                "workless": workless,
            }
            if several:
                entry["sums_W"] = dict(zip(step.fields, sums, strict=True))
                condition = float(solved.condition[place])
                entry["condition"] = condition if np.isfinite(condition) else None
            steps.append(entry)
        return {"steps": steps}

    def columns(self) -> dict[str, list[Any]]:
        """The CSV: one row per step and unknown, in the units of the marked columns."""
        used = [name for name in LOADS if any(quantity == name for _, quantity in self.states.table.marks)]
        headers = {name: self.states.table.numbers[name] for name in used}
        columns: dict[str, list[Any]] = {"step": [], "link": []}
        if any(unknown.name for step in self.states.steps for unknown in step.unknowns):
            columns["unknown"] = []
        columns |= {column.header: [] for column in headers.values()}
        for index, step in enumerate(self.states.steps):
            for unknown, value in zip(step.unknowns, self.values(index), strict=True):
                for cell in unknown.cells:
                    columns["step"].append(step.name)
                    columns["link"].append(cell.link)
                    if "unknown" in columns:
                        columns["unknown"].append(unknown.name)
                    for name, column in headers.items():
                        shown = None
                        if name == cell.quantity and value is not None:
                            shown = float(from_si(value * cell.factor, COLUMNS[name], column.unit))
                        columns[column.header].append(shown)
        return columns

    def ledger(self) -> dict[str, list[Any]]:
        """The ledger as a table: one row per step and term; a load that does no work has power 0."""
        columns: dict[str, list[Any]] = {"step": [], "field": [], "link": [], "kind": [], "power_W": []}
        for index, step in enumerate(self.states.steps):
            for of, link, kind, power in self.terms(index):
                for name, cell in zip(columns, (step.name, of, link, kind, power or 0.0), strict=True):
                    columns[name].append(cell)
        if all(len(step.fields) == 1 for step in self.states.steps):
            del columns["field"]
        return columns

    @cached_property
    def brief(self) -> bool:
        """Whether there are few enough steps to show each term."""
        return len(self.states.steps) <= SHOWN_STEPS

    def notes(self) -> str:
        """The ledger, above the terminal's table."""
        if not self.brief:
            return f"{len(self.states.steps)} steps; --ledger shows the power of every term\n\nunknowns:"
        parts = []
        for index, step in enumerate(self.states.steps):
            lines = list(self.terms(index))
            several = len(step.fields) > 1
            kept = [line for line in lines if line[3] is not None]
            ledger: dict[str, list[Any]] = {"field": [line[0] for line in kept]} if several else {}
            ledger |= {
                "link": [line[1] for line in kept],
                "kind": [line[2] for line in kept],
                "power_W": [line[3] for line in kept],
            }
            group, place = self.where[index]
            sums = self.groups[group][1].sum[place].tolist()
            workless = [f"{link}: {kind}" for _, link, kind, power in lines if power is None]
            title = f"step {step.name}: virtual power" if len(self.states.steps) > 1 else "virtual power"
            parts.append(
                f"{title}\n{table_text(ledger)}sum {', '.join(f'{value:.3g}' for value in sums)} W"
                + (f"\ndo no work: {', '.join(workless)}" if workless else "")
            )
        return "\n\n".join([*parts, "unknowns:"])

    def figure(self) -> Figure:
        """The ledger of one step as bars; of several, each unknown against the step."""
        from cli.work.picture import curves, ledger

        if len(self.states.steps) == 1:
            lines = [line for line in self.terms(0) if line[3] is not None]
            several = len(self.states.steps[0].fields) > 1
            labels = [f"{link}: {kind}" + (f" ({of})" if several else "") for of, link, kind, _ in lines]
            return ledger(labels, [power or 0.0 for *_, power in lines])
        series: dict[str, list[float]] = {}
        for index, step in enumerate(self.states.steps):
            for unknown, value in zip(step.unknowns, self.values(index), strict=True):
                for cell in unknown.cells:
                    name = f"link {cell.link}, {LOADS[cell.quantity]}"
                    series.setdefault(name, [np.nan] * len(self.states.steps))[index] = (
                        np.nan if value is None else value
                    )
        return curves([step.name for step in self.states.steps], series)


def balanced(states: States, gravity: complex, *, ledger: bool = False) -> Shown:
    """Balance every step and return the result ready to be shown."""
    result = Balanced(states, gravity)
    columns = result.ledger() if ledger else result.columns()
    return Shown(
        document=result.document,
        columns=columns,
        keys=[name for name in ("step", "field", "link", "kind", "unknown") if name in columns],
        notes=(lambda: "") if ledger else result.notes,
        figure=result.figure,
        errors=result.ledger_errors if ledger else result.errors,
        warnings=[*states.table.warnings, *states.warnings, *result.warnings],
    )
