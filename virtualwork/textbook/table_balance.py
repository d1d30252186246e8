"""The balance of virtual power of a table of link states: the unknowns of every step, the power of every term."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.errors import DataError
from dalembert.results.columns import finite
from virtualwork.textbook.link_states import KINDS, LinkStates, UnitLoad
from virtualwork.textbook.power_balance import Again, Balance, balance
from virtualwork.textbook.state_table import Cell, Real, StateTable, Unknown

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled import Doubled


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
    """The unknowns of every step, and the power of every term.

    Parameters
    ----------
    states : StateTable
        A table of link states, by `read_states`.
    gravity : complex
        gx + i·gy, m/s², on the masses of the table.

    Raises
    ------
    DataError
        The velocities determine no unknown, or a power overflows.

    Notes
    -----
    The applied forces and the inertia forces together do no work on the velocities (J. A. Riul, Dinâmica das Máquinas,
    unit II, eqs. 1–5): `balance` of each group of steps with as many velocity fields.

    Examples
    --------
    A weight of 20 N sinks at 0.5 m/s; a torque on a link that turns at 2 rad/s holds it:

    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from virtualwork.textbook.state_table import read_states
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder, "states.csv")
    ...     _ = table.write_text("link,fy_N,vy_m_s,torque_N_m,omega_rad_s\\n1,,,?,2\\n2,-20,-0.5,,\\n")
    ...     work = WorkBalance(read_states(str(table)), 0j)
    >>> [torque for _, _, torque in work.unknowns(0)], [term.power for term in work.terms(0)]
    ([-5.0], [10.0, -10.0])
    """

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
