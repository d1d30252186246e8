"""The rows of the tables of field balancing, what names them, and the columns that several tables have."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cli.field.field_balancing import FieldBalancing, Solved
from cli.read.runs.runs import Channel, Complex, Real
from dalembert.angles import degrees
from dalembert.results.columns import ABSENT, Column, Table, names, number
from dalembert.results.text import angle_text
from dalembert.units import from_si, written

Tables = dict[str, Callable[[], Table]]

READINGS = ("rotor", "sensor", "state", "speed_rpm")
"""What names a row that is of a sensor."""


@dataclass(eq=False, repr=False)
class Rows:
    """The rows of a table, and the columns that name them: the rotor, where there are several, then plane, sensor …"""

    rotor: Column
    shown: list[Column]
    hidden: list[Column]
    """Those of the JSON document alone."""
    solved: Sequence[Solved] = ()
    sizes: Sequence[int] = ()
    """How many rows the rotors of each group have together."""
    order: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    @classmethod
    def of(cls, b: FieldBalancing, rotors: Iterable[str]) -> Rows:
        """Return rows of these rotors."""
        rotor = names("rotor", rotors)
        return cls(rotor, [rotor] if b.runs.several else [], [] if b.runs.several else [rotor])

    @classmethod
    def each(cls, b: FieldBalancing, count: Callable[[Solved], int] = lambda _: 1) -> Rows:
        """Return rows of all rotors, as many of each rotor of a group."""
        counts = [count(solved) for solved in b.solved]
        groups = list(zip((solved.group.rotors for solved in b.solved), counts, strict=True))
        rotor = np.concatenate([np.repeat(of, n) for of, n in groups])
        order = np.lexsort((np.concatenate([np.tile(np.arange(n), len(of)) for of, n in groups]), rotor))
        rows = cls.of(b, [b.runs.rotors[r] for r in rotor[order].tolist()])
        return replace(rows, solved=b.solved, sizes=[len(of) * n for of, n in groups], order=order)

    @classmethod
    def planes(cls, b: FieldBalancing) -> Rows:
        """Return a row for each rotor and plane."""
        rows = cls.each(b, lambda solved: len(solved.planes))
        rows.shown.append(names("plane", rows.cells(lambda solved: solved.planes)))
        return rows

    @classmethod
    def sensors(cls, b: FieldBalancing) -> Rows:
        """Return a row for each rotor and sensor."""
        rows = cls.each(b, lambda solved: len(solved.group.channels))
        return rows.read(b, rows.cells(lambda solved: solved.group.channels))

    def read(self, b: FieldBalancing, of: Sequence[Channel]) -> Rows:
        """Add the columns that name sensors: with state and speed where the table has them, else those are JSON's alone."""
        self.shown.append(names("sensor", [channel.sensor for channel in of]))
        states = [channel.state for channel in of]
        if any(state is not None for state in states):
            stored = [ABSENT if state is None else state for state in states]
            self.shown.append(Column("state", "", states, None, "state", stored))
        # in JSON states stand where speeds do
        speeds = [ABSENT if c.state is not None and c.speed is None else c.speed for c in of]
        unit = b.runs.speed_unit or "rpm"
        cells = [None if c.speed is None else from_si(c.speed, "speed", unit) for c in of]
        column = Column("speed", unit, cells, None, "speed_rad_s", speeds)
        (self.hidden if all(cell is None for cell in cells) else self.shown).append(column)
        return self

    def table(
        self,
        columns: Sequence[Column],
        keys: Sequence[str],
        place: str,
        above: str = "",
        below: str = "",
        *,
        hidden: Sequence[Column] = (),
        shown: bool = True,
    ) -> Table:
        """Return the table of these rows; one that is not shown is of the document alone."""
        every, unseen = [*self.shown, *columns], [*self.hidden, *hidden]
        if not shown:
            every, unseen = [], [*every, *unseen]
        return Table(every, keys, f"rotors[].{place}".removesuffix("."), above, below, unseen)

    def numbers(self, of: Callable[[Solved], ArrayLike]) -> NDArray[Any]:
        """Put numbers of the groups, (g, n) each, into the order of the rows."""
        return np.concatenate([np.ravel(of(solved)) for solved in self.solved])[self.order]

    def several(self, of: Callable[[Solved], Iterable[ArrayLike]]) -> list[NDArray[Any]]:
        """Put several such numbers into the order of the rows."""
        parts = zip(*(of(solved) for solved in self.solved), strict=True)
        return [np.concatenate([np.ravel(part) for part in groups])[self.order] for groups in parts]

    def cells(self, of: Callable[[Solved], Sequence[Any]]) -> list[Any]:
        """Put cells that all rotors of a group have into the order of the rows."""
        every = [cell for solved in self.solved for cell in list(of(solved)) * len(solved.group.rotors)]
        return [every[k] for k in self.order.tolist()]

    def some(self, of: Callable[[Solved], ArrayLike | None]) -> tuple[Real, list[Any]]:
        """Put numbers that not every group has into the order of the rows: as shown, and as JSON has them."""
        parts = [(of(solved), n) for solved, n in zip(self.solved, self.sizes, strict=True)]
        there = np.repeat([v is not None for v, _ in parts], self.sizes)[self.order].tolist()
        numbers = [np.broadcast_to(np.nan if v is None else np.asarray(v, dtype=float), n) for v, n in parts]
        values = np.concatenate(numbers)[self.order]
        return values, [v if has else ABSENT for v, has in zip(values.tolist(), there, strict=True)]


def masses(b: FieldBalancing, values: Complex, place: str | None = "") -> list[Column]:
    """Return size and angle of masses or unbalances."""
    per, unit = b.runs.per, b.runs.mass_unit
    return [
        number(per, per, np.abs(values), unit, place=place),
        number("angle", "angle", degrees(values), place=place),
    ]


def uncertainties(b: FieldBalancing, along: Real, across: Real) -> list[Column]:
    """Return the standard deviations of size and angle of masses."""
    per, unit = b.runs.per, b.runs.mass_unit
    return [
        number(f"{per}_uncertainty", per, along, unit),
        number("angle_uncertainty", "angle", across),
    ]


def amplitude(b: FieldBalancing, name: str, values: ArrayLike, place: str | None = "") -> Column:
    """Return a quantity in the unit of the readings, which JSON keeps; `place`: its key, if that is not the name."""
    array = np.asarray(values, dtype=float)
    return Column(name, b.runs.amplitude_unit, array, None, name if place == "" else place, array)


def vibration(b: FieldBalancing, value: Complex) -> list[Column]:
    """Return amplitude and phase."""
    return [amplitude(b, "amplitude", np.abs(value)), number("phase", "angle", degrees(value))]


def amplitude_unit(b: FieldBalancing) -> str:
    """The amplitude's unit as people write it."""
    return written(b.runs.amplitude_unit)


def masses_text(b: FieldBalancing, planes: Sequence[str], of: Iterable[complex], spec: str = ".2f") -> str:
    """Write masses in their planes as a sentence has them; those that are zero are left out."""
    return " and ".join(
        f"{b.amount(abs(w)):.6g} {b.unit} at {angle_text(degrees(complex(w)), spec)}° in {plane}"
        for plane, w in zip(planes, of, strict=True)
        if w
    )
