"""A table of link states, in SI, and its unknowns."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.errors import DataError, quote
from dalembert.quantities import parse_number
from dalembert.tables.headers import spellings
from dalembert.tables.table import Table, read

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
class StateTable:
    """A table of link states, in SI."""

    table: Table
    steps: list[Step]
    values: dict[str, Real]
    occurrence: list[int]
    warnings: list[str]

    @property
    def exact(self) -> dict[str, Any]:
        """The numbers in 32 digits, in SI, of the decimals as they are written; what is blank is zero."""
        from dalembert.tables.exact import column

        rows = range(self.table.rows)
        values: dict[str, Any] = {name: column(x, rows) for name, x in self.table.numbers.items()}
        for axis in "xy":
            name = f"fv{axis}"
            if name in self.values:
                center = values.get(f"v{axis}", np.zeros(self.table.rows))
                point = (
                    self.table.numbers[name].values if name in values else np.full(self.table.rows, np.nan)
                )
                values[name] = np.where(np.isnan(point), center, values.get(name, center))
        return values

    @property
    def links(self) -> list[str]:
        """The link of each row."""
        return self.table.texts["link"]

    def places(self, members: list[int], k: int) -> NDArray[np.intp]:
        """Return the rows of the steps as (steps, fields, links), one field squeezed out; −1 where there is none."""
        steps = [self.steps[index] for index in members]
        n = max(len(rows) for step in steps for rows in step.fields.values())
        places = np.full((len(steps), k, n), -1, dtype=np.intp)
        for i, step in enumerate(steps):
            for j, rows in enumerate(step.fields.values()):
                places[i, j, : len(rows)] = rows
        return places[:, 0] if k == 1 else places

    def unit_loads(self, members: list[int], rows: NDArray[np.intp]) -> list[Real]:
        """Return what each unknown is per unit on the rows of every step: force along x and y, torque, (3, ...)."""
        k = len(self.steps[members[0]].fields)
        loads = [np.zeros((3, *rows.shape)) for _ in range(k)]
        for i, index in enumerate(members):
            place = {row: at for at, row in np.ndenumerate(rows[i]) if row >= 0}
            by_cell: dict[tuple[str, int], list[int]] = {}
            for row in place:
                by_cell.setdefault((self.links[row], self.occurrence[row]), []).append(row)
            for unknown, load in zip(self.steps[index].unknowns, loads, strict=True):
                for cell in unknown.cells:
                    for row in by_cell[cell.link, cell.occurrence]:
                        load[(("fx", "fy", "torque").index(cell.quantity), i, *place[row])] += cell.factor
        return loads


def read_states(path: str) -> StateTable:
    """Read the states of links, one row per link, step and velocity field, and find the unknowns.

    Parameters
    ----------
    path : str
        CSV or workbook with the columns of `COLUMNS`, step, field and link; an unknown load is marked ? or ?NAME.

    Returns
    -------
    StateTable
        `values`, each column in SI; `steps`, the rows of each velocity field and the unknowns.

    Raises
    ------
    DataError
        The table cannot be read, has no unknown, or not as many in a step as velocity fields.

    Examples
    --------
    A weight of 20 N on a link that sinks at 0.5 m/s, and the torque on another one that turns at 2 rad/s:

    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder, "states.csv")
    ...     _ = table.write_text("link,fy_N,vy_m_s,torque_N_m,omega_rad_s\\n1,,,?,2\\n2,-20,-0.5,,\\n")
    ...     states = read_states(str(table))
    >>> states.values["fy"], states.steps[0].unknowns[0].label
    (array([  0., -20.]), '? (torque_N_m of link 1)')
    """
    table = read(path, numbers=COLUMNS, texts=["step", "field", "link"], blank=list(COLUMNS), marker="?")
    table.needed("link")
    _no_displacements(table)
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
            table.reject(
                table.numbers[quantity].values < 0,
                quantity,
                f"{'an' if quantity == 'inertia' else 'a'} {quantity} that is not negative",
            )
    warnings: list[str] = []
    values = {name: column.si for name, column in table.numbers.items()}
    for name, value in values.items():
        overflown = ~np.isfinite(value) & np.isfinite(table.numbers[name].values)
        table.reject(overflown, name, "a number of a size that can be computed with")
    _point_velocity(values, table, warnings)
    values = {name: np.nan_to_num(value, nan=0.0) for name, value in values.items()}
    steps, occurrence = _sets(table, values)
    _unknowns(table, steps, occurrence)
    states = StateTable(table, steps, values, occurrence, warnings)
    _check(states)
    return states


def _no_displacements(table: Table) -> None:
    """Refuse virtual displacements in place of velocities: without them every rate would be zero."""
    rates = {"dx": "vx_mm_s", "dy": "vy_mm_s", "dtheta": "omega_rad_s", "dphi": "omega_rad_s"}
    rates |= {"δx": "vx_mm_s", "δy": "vy_mm_s", "δθ": "omega_rad_s", "δφ": "omega_rad_s"}
    rates |= {"dfx": "fvx_mm_s", "dfy": "fvy_mm_s"}
    words = ((header, re.split(r"[^a-zδθφ]", header.strip().lower())[0]) for header in table.header)
    meant = {header: rates[word] for header, word in words if word in rates}
    if meant and not {"vx", "vy", "omega", "fvx", "fvy"} & table.numbers.keys():
        many = len(meant) > 1
        raise DataError(
            f"{table.file}: the column{'s' * many} {' and '.join(meant)} hold{'s' * (not many)} virtual displacements: expected "
            f"velocities, {' and '.join(dict.fromkeys(meant.values()))}: the displacements of one virtual instant over any "
            "time, 1 mm as 1 mm/s"
        )


def _point_velocity(values: dict[str, Real], table: Table, warnings: list[str]) -> None:
    """Fill the velocity of the force's point where it is empty: the centre of mass's."""
    zero = np.zeros(table.rows)
    for axis, other in (("x", "y"), ("y", "x")):
        point = values.get(f"fv{axis}", np.full(table.rows, np.nan))
        center = np.nan_to_num(values.get(f"v{axis}", zero), nan=0.0)
        force = np.nan_to_num(values.get(f"f{axis}", zero), nan=1.0)
        if f"fv{other}" in values:
            half = np.isnan(point) & ~np.isnan(values[f"fv{other}"]) & (center != 0) & (force != 0)
            if half.any():
                row = int(np.argmax(half))
                warnings.append(
                    f"{table.file}: row {row + 1}: fv{other} is given and fv{axis} is empty: "
                    f"taken as the centre of mass's, v{axis} = {center[row]:g} m/s"
                )
        if f"fv{axis}" in values or f"fv{other}" in values:
            values[f"fv{axis}"] = np.where(np.isnan(point), center, point)


def _sets(table: Table, values: dict[str, Real]) -> tuple[list[Step], list[int]]:
    """Sort the rows into steps and velocity fields; a link's second row in a set is its occurrence 1."""
    steps: dict[str, Step] = {}
    seen: dict[tuple[str, str, str], int] = {}
    occurrence = []
    zero = np.zeros(table.rows)
    massive = values.get("mass", zero) + values.get("inertia", zero) > 0
    sets = zip(table.named("step"), table.named("field", ""), table.texts["link"], strict=True)
    for row, (step, of, link) in enumerate(sets):
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
            first, second, *_ = bare
            raise table.error(
                bare[second],
                table.numbers[second.quantity].header,
                "?",
                f"one ? in step {step.name} (the first is {LOADS[first.quantity]} of link {first.link}); "
                "several unknowns are marked ?NAME and need as many velocity fields, a column field",
            )
        if not cells:
            raise DataError(f"{at}: no unknown in it: expected one cell marked ?")
        step.unknowns = [Unknown(name, tuple(marked), min(marked.values())) for name, marked in cells.items()]
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


def _check(states: StateTable) -> None:
    """Warn of fields that disagree on the instant and of accelerations without masses."""
    table, values = states.table, states.values
    fixed = [
        name for name in ("mass", "inertia", "ax", "ay", "alpha", "fx", "fy", "torque") if name in values
    ]
    for step in states.steps:
        first, *others = step.fields.values()
        models = {(states.links[row], states.occurrence[row]): row for row in first}
        for rows in others:
            for row in rows:
                model = models.get((states.links[row], states.occurrence[row]))
                for name in fixed:
                    if {(row, name), (model, name)} & table.marks.keys():
                        continue
                    if model is None or values[name][row] != values[name][model]:
                        states.warnings.append(
                            f"{table.file}: row {row + 1}: {table.numbers[name].header} of link {states.links[row]} is not that "
                            "of the step's first velocity field: each row is used as it stands (the loads of one instant are the same in each field)"
                        )
                        return
    if "inertia" in values and ("ax" in values or "ay" in values):
        zero = np.zeros(table.rows)
        carried = (values["inertia"] > 0) & ((values.get("ax", zero) != 0) | (values.get("ay", zero) != 0))
        mass = table.numbers.get("mass")
        blank = np.isnan(mass.values) if mass is not None else np.ones(table.rows, dtype=bool)
        if (carried & blank).any():
            row = int(np.argmax(carried & blank))
            header = mass.header if mass is not None else "mass_kg"
            raise table.error(
                row, header, "", f"a mass: link {states.links[row]} has an inertia and its centre accelerates"
            )
    for rate, body in (("ax", "mass"), ("ay", "mass"), ("alpha", "inertia")):
        if body not in values and values.get(rate, np.zeros(1)).any():
            states.warnings.append(
                f"{table.file}: there is {rate} and no column {body}_*: no inertia loads from it"
            )
