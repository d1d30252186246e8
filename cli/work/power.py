"""From the states of links to their unknown loads, by virtual power, and the power of every term."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cli.work.states import Cell, Real, StateTable, Unknown
from dalembert.arithmetic.doubled import Doubled
from dalembert.errors import DataError
from dalembert.results.columns import finite
from virtualwork.textbook.link_states import KINDS, LinkStates, UnitLoad
from virtualwork.textbook.power_balance import Again, Balance, balance


def _unit_load(x: Any, y: Any, torque: Any) -> UnitLoad:
    force = np.zeros_like(x, dtype=complex)
    force.real, force.imag = x, y
    return UnitLoad(force, torque)


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
            rows = self._places(members, k)
            self.places.append((members, rows))
            states = self._link_states(self.states.values, rows)
            with np.errstate(over="ignore", invalid="ignore"):
                solved = balance(states, [_unit_load(*of) for of in self._patterns(members, rows)])
            if not (np.isfinite(solved.power).all() and np.isfinite(solved.value[solved.determined]).all()):
                raise DataError(f"{self.states.table.file}: the powers are too large to be computed with")
            for place, index in enumerate(members):
                self.where[index] = (len(self.groups), place)
            self.groups.append((states, solved))
        self._warn_of_undetermined()

    def _link_states(self, values: Mapping[str, Any], rows: NDArray[np.intp]) -> LinkStates:
        """Return the states of rows of the table, of floats or in 32 digits; −1 is no row."""
        arrays = {name: np.where(rows >= 0, value[rows], 0.0) for name, value in values.items()}
        zero = np.zeros(rows.shape)

        def vector(x: str, y: str) -> Any:
            a, b = (arrays.get(name, zero) + zero for name in (x, y))
            z = np.zeros_like(a + b, dtype=complex)
            # both of one kind of number
            z.real, z.imag = a + 0.0 * b, b + 0.0 * a
            return z

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

    def _places(self, members: list[int], k: int) -> NDArray[np.intp]:
        """Return the rows of the steps as (steps, fields, links), one field squeezed out; −1 where there is none."""
        steps = [self.states.steps[index] for index in members]
        n = max(len(rows) for step in steps for rows in step.fields.values())
        places = np.full((len(steps), k, n), -1, dtype=np.intp)
        for i, step in enumerate(steps):
            for j, rows in enumerate(step.fields.values()):
                places[i, j, : len(rows)] = rows
        return places[:, 0] if k == 1 else places

    def _patterns(self, members: list[int], rows: NDArray[np.intp]) -> list[Real]:
        """Return what each unknown is per unit on the rows of every step: force along x and y, torque, (3, ...)."""
        k = len(self.states.steps[members[0]].fields)
        loads = [np.zeros((3, *rows.shape)) for _ in range(k)]
        for i, index in enumerate(members):
            place = {row: at for at, row in np.ndenumerate(rows[i]) if row >= 0}
            by_cell: dict[tuple[str, int], list[int]] = {}
            for row in place:
                by_cell.setdefault((self.states.links[row], self.states.occurrence[row]), []).append(row)
            for unknown, load in zip(self.states.steps[index].unknowns, loads, strict=True):
                for cell in unknown.cells:
                    for row in by_cell[cell.link, cell.occurrence]:
                        load[(("fx", "fy", "torque").index(cell.quantity), i, *place[row])] += cell.factor
        return loads

    def _warn_of_undetermined(self) -> None:
        """Name each unknown that no equation holds; where nothing is determined, that is an error."""
        complaints: list[DataError] = []
        determined = 0
        table = self.states.table
        for index, step in enumerate(self.states.steps):
            solved, place = self._solved(index)
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

    def _solved(self, index: int) -> tuple[Balance, int]:
        """Return the balance that a step is in, and its place there."""
        group, place = self.where[index]
        return self.groups[group][1], place

    def group(self, index: int) -> tuple[LinkStates, Balance]:
        """Return the states that a step is among, and what balances them."""
        return self.groups[self.where[index][0]]

    def terms(self, index: int, *, errors: bool = False) -> Iterator[Term]:
        """Yield the terms of a step, with their rounding errors on request."""
        step = self.states.steps[index]
        group, place = self.where[index]
        states, solved = self.groups[group]
        single = len(step.fields) == 1
        wrong = self.term_errors[group] if errors else {}

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
        from cli.read.exact import plain
        from dalembert.arithmetic.doubled_arrays import DoubledComplex

        groups = []
        for (members, rows), (_, solved) in zip(self.places, self.groups, strict=True):
            states = self._link_states(self.states.exact, rows)
            gravity: Any = DoubledComplex(plain(self.gravity.real), plain(self.gravity.imag))
            states = replace(states, gravity=gravity)
            unknowns = [_unit_load(*map(plain, of)) for of in self._patterns(members, rows)]
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
        from cli.read.exact import plain

        cells = [
            self.second[group][1].value[place, j] * plain(cell.factor)
            for group, place, step in ((*self.where[i], step) for i, step in enumerate(self.states.steps))
            for j, unknown in enumerate(step.unknowns)
            for cell in unknown.cells
        ]
        both: Any = np.stack(cells)
        return both.doubled  # type: ignore[no-any-return]

    def sums(self, index: int) -> list[float]:
        """The sum of the powers of each velocity field of a step, W."""
        solved, place = self._solved(index)
        sums: list[float] = solved.sum[place].tolist()
        return sums

    def condition(self, index: int) -> float | None:
        """The condition number of a step's equations; None where they do not determine the unknowns."""
        solved, place = self._solved(index)
        return finite(solved.condition[place])

    def unknowns(self, index: int) -> Iterator[tuple[Unknown, Cell, float | None]]:
        """Yield each cell of a step's unknowns: its load in SI, None where it is not determined."""
        solved, place = self._solved(index)
        for unknown, value in zip(
            self.states.steps[index].unknowns, solved.value[place].tolist(), strict=True
        ):
            for cell in unknown.cells:
                yield unknown, cell, None if value != value else value * cell.factor
