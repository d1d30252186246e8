"""What was on the rotor in each row of a table of runs: which rows state it, and the masses, several joined by ';'."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from dalembert.angles import phasor
from dalembert.errors import DataError, quote
from dalembert.quantities import parse_number
from dalembert.tables.table import Cells, Numbers, Table, numbered
from dalembert.units import LARGEST, SMALLEST, to_si

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_vectors import Vectors

    OfRows = list[dict[str, Vectors] | None]

T = TypeVar("T", complex, "Vectors")
Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Rows = NDArray[np.intp]
Flags = NDArray[np.bool_]
YES = ("yes", "y", "true", "1", "kept", "on", "ja", "j", "bleibt")
NO = ("no", "n", "false", "0", "", "removed", "off", "nein")


class Masses(NamedTuple):
    """What the rows of a table put on, an entry for each mass."""

    planes: list[str]
    row: Rows
    """Ascending, (k,)."""
    plane: Rows
    value: Complex
    """SI."""
    stated: NDArray[np.bool_]
    """Whether a row says anything of masses, (n,)."""
    exact: Callable[[], Vectors]
    """The values in 32 digits, as the file has them; worked out on request."""

    @classmethod
    def of(
        cls, rows: Sequence[dict[str, complex] | None], exact: Callable[[], OfRows] | None = None
    ) -> Masses:
        """Take the masses of each row, plane -> mass; None where it says nothing of them. `exact`: in 32 digits."""
        planes: dict[str, int] = {}
        entries = [
            (i, planes.setdefault(plane, len(planes)), mass)
            for i, masses in enumerate(rows)
            for plane, mass in (masses or {}).items()
        ]
        row, plane, value = zip(*entries, strict=True) if entries else ((), (), ())
        stated = np.array([masses is not None for masses in rows])
        at, of = (np.array(part, dtype=np.intp) for part in (row, plane))

        def values() -> Vectors:
            from dalembert.arithmetic.doubled_vectors import Vectors

            if exact is None or not entries:
                return Vectors.of(np.array(value, dtype=complex))
            each = [mass for masses in exact() for mass in (masses or {}).values()]
            return Vectors.joined([mass[None] for mass in each])

        return cls(list(planes), at, of, np.array(value, dtype=complex), stated, values)

    def by_row(self) -> list[dict[str, complex] | None]:
        """Return them as `of` takes them."""
        return self._rows(self.value.tolist())

    def exact_by_row(self) -> OfRows:
        """Return the same in 32 digits."""
        values = self.exact()
        return self._rows([values[k] for k in range(len(self.row))])

    def _rows(self, values: Sequence[T]) -> list[dict[str, T] | None]:
        out: list[dict[str, T] | None] = [{} if stated else None for stated in self.stated.tolist()]
        for i, plane, mass in zip(self.row.tolist(), self.plane.tolist(), values, strict=True):
            mine = out[i]
            assert mine is not None
            mine[self.planes[plane]] = mass
        return out


@dataclass(eq=False, repr=False)
class MassColumns:
    """The columns that state what was on the rotor."""

    table: Table
    size: Cells
    """Masses or unbalances."""
    per: str
    """`mass` or `unbalance`."""
    rotor: Rows
    """Of each row."""

    @cached_property
    def stated(self) -> Flags:
        """Which rows state a mass, (n,)."""
        return np.array([bool(cell) for cell in self.size.values])

    @cached_property
    def named(self) -> Flags:
        """Which rows name a plane, (n,)."""
        planes, plane = self.table.numbered("trial_plane")
        return np.array([bool(name) for name in planes])[plane]

    def check_runs(self, run_names: list[str], run: Rows) -> None:
        """Refuse rows that contradict those of their run: another plane, or a plane, a mark that it is kept, and no mass."""
        of_run = numbered(self.rotor * len(run_names) + run)[0]
        states = first_of_run(of_run, self.stated)
        for i in np.flatnonzero(self.named & (states < 0))[:1].tolist():
            raise self._wrong(i, self.size.header, "", "a trial mass")
        names, plane = self.table.numbered("trial_plane")
        for i in np.flatnonzero(self.named & (plane != plane[states]) & self.named[states])[:1].tolist():
            one, other = names[plane[states[i]]], names[plane[i]]
            raise self._wrong(
                i,
                "trial_plane",
                other,
                f"{quote(one)} as elsewhere in run {run_names[run[i]]}; several masses in one run are joined by ';' "
                f"({one};{other})",
            )
        words, code = self.table.numbered("trial_kept")
        kept = np.array([word.lower() in YES for word in words])[code]
        for i in np.flatnonzero(kept & (states < 0))[:1].tolist():
            expected = f"the trial mass that is kept after run {run_names[run[i]]}"
            raise self._wrong(i, "trial_plane", "", expected)

    def _wrong(self, row: int, column: str, value: str, expected: str) -> DataError:
        return self.table.error(row, column, value, expected)

    def masses(self) -> Masses:
        """Read the masses of each row, several joined by ';'; a mass of zero is none."""
        table, size, per = self.table, self.size, self.per
        if not self.stated.any():
            return Masses.of([None] * table.rows)
        angle = table.cells.get("trial_angle")
        names, code = table.numbered("trial_plane")
        planes: dict[str, int] = {}
        for name in names:
            for part in (name or "1").split(";"):
                planes.setdefault(part.strip(), len(planes))
        plane = np.array([planes.get(name or "1", -1) for name in names])[code]
        # one mass in a row, its numbers in order: all these rows together, and the others one by one
        plain = self.stated & np.array([";" not in name for name in names])[code]
        if "trial_plane" in table.texts:
            plain &= self.named
        sizes, angles = size.parsed, None if angle is None else angle.parsed
        if sizes is None or angles is None:
            plain[:] = False
            sizes = angles = np.zeros(table.rows)
        plain &= (sizes >= 0) & (sizes <= LARGEST) & (np.abs(angles) <= LARGEST)
        others = [
            (i, planes[name], mass, turn)
            for i in np.flatnonzero(self.stated & ~plain).tolist()
            for name, mass, turn in self._of_row(i, names[code[i]], angle)
        ]
        row, where, more, turns = (
            np.array(part) for part in (zip(*others, strict=True) if others else ((), (), (), ()))
        )
        row = np.concatenate([np.flatnonzero(plain), row.astype(np.intp)])
        where = np.concatenate([plane[plain], where.astype(np.intp)])
        around = np.concatenate([angles[plain], turns])
        unit = angle.unit if angle is not None else "deg"
        amounts = np.concatenate([sizes[plain], more])
        on = phasor(np.asarray(to_si(amounts, per, size.unit)), around, unit)
        # several in one plane of a run are one
        _, first, entry = np.unique(row * max(len(planes), 1) + where, return_index=True, return_inverse=True)
        value = np.zeros(len(first), dtype=complex)
        np.add.at(value, entry, on)

        def exact() -> Vectors:
            from cli.read.exact import vectors

            each = vectors(Numbers("", size.unit, amounts, per).exact, Numbers("", unit, around, "angle"))
            return _added(each, entry, len(first))

        return Masses(list(planes), row[first], where[first], value, self.stated, exact)

    def _of_row(self, i: int, name: str, angle: Cells | None) -> Iterator[tuple[str, float, float]]:
        """Yield plane, size and angle of each mass of a row, as the file has them."""
        size = self.size
        cell, turn = size.values[i], "" if angle is None else angle.values[i]
        names = [part.strip() for part in name.split(";")] if name else ["1"]
        if "" in names:
            raise self._wrong(i, "trial_plane", name, "a plane's name before and after each ';'")
        parts, around = cell.split(";"), turn.split(";") if turn else [""] * len(names)
        for cells, target in ((size, parts), (angle or size, around)):
            if len(target) != len(names):
                joined = f"{len(names)} joined by ';' as in trial_plane"
                raise self._wrong(i, cells.header, cells.values[i], f"masses and angles, {joined}")
        for one, part, at in zip(names, parts, around, strict=True):
            mass = self._number(size, i, part, "a trial mass")
            if mass < 0 or 0 < mass < SMALLEST:
                raise self._wrong(i, size.header, cell, "a positive trial mass, or 0 where none is on")
            if not at.strip() and mass:
                header = angle.header if angle is not None else "trial_angle_deg"
                raise self._wrong(i, header, turn, "the angle of the trial mass")
            if not name and "trial_plane" in self.table.texts:
                if not mass:
                    continue
                raise self._wrong(i, "trial_plane", "", "the plane of the trial mass")
            turned_by = (
                0.0
                if angle is None or not at.strip()
                else self._number(angle, i, at, "the angle of the trial mass")
            )
            yield one, mass, turned_by

    def _number(self, cells: Cells, row: int, text: str, expected: str) -> float:
        try:
            return cells.number(text)
        except ValueError:
            more = ", with a decimal comma as elsewhere in the file" if cells.decimal_comma else ""
            raise self._wrong(row, cells.header, cells.values[row], expected + more) from None


def first_of_run(of_run: Rows, rows: Flags) -> Rows:
    """Return for each row the first of its run among some rows, -1 where there is none."""
    first = np.full(int(of_run.max(initial=0)) + 1, -1)
    at = np.flatnonzero(rows)[::-1]
    first[of_run[at]] = at
    return first[of_run]


def _added(each: Vectors, entry: Rows, count: int) -> Vectors:
    """Add up vectors (k,) of like entries."""
    from dalembert.arithmetic.doubled_vectors import Vectors

    total = Vectors.of(np.zeros(count))
    order = np.argsort(entry, kind="stable")
    starts = np.searchsorted(entry[order], np.arange(count))
    rank = np.arange(len(entry)) - starts[entry[order]]
    for k in range(int(rank.max(initial=-1)) + 1):
        mine = order[rank == k]
        total[entry[mine]] = total[entry[mine]] + each[mine]
    return total


def turned(angle: float, unit: str) -> complex:
    """e^{iφ} of an angle."""
    return complex(phasor(np.ones(1), np.array([angle]), unit)[0])


def turned_exactly(angle: float, unit: str) -> Vectors:
    """The same in 32 digits."""
    from cli.read.exact import turns

    return turns(Numbers("", unit, np.array([angle]), "angle"))[0]


def on_top(
    table: Table,
    rotor: Rows,
    masses: list[dict[str, T] | None],
    turn_of: Callable[[float, str], T],
) -> list[dict[str, T] | None]:
    """Add what is below each mass: `ref` numbers the run, within its state, on top of which it stands; -1 for none.

    Its angle counts from the angle written in that run's row; `turn_of` makes a vector of an angle in a unit.
    """
    angle = table.cells.get("trial_angle")
    state = table.named("state", "")
    sensor = table.named("sensor")
    seen: dict[tuple[int, str, str], list[int]] = {}
    out: list[dict[str, T] | None] = []
    for i, text in enumerate(table.texts["ref"]):
        before = seen.setdefault((int(rotor[i]), state[i], sensor[i]), [])
        try:
            number = parse_number(text.replace(",", ".")) if text else -1
            below = int(number) if number == int(number) else 0
        except ValueError:
            below = 0
        own = len(before) + 1
        if below != -1 and not 1 <= below < own and not below == own == 1:
            raise table.error(i, "ref", text, "-1, or the number of an earlier run in this state")
        mine = dict(masses[i] or {})
        if 1 <= below < own:
            base = before[below - 1]
            written = angle.values[base] if angle is not None else ""
            if written and angle is not None:
                turn = turn_of(angle.number(written), angle.unit)
                mine = {plane: mass * turn for plane, mass in mine.items()}
            for plane, mass in (out[base] or {}).items():
                mine[plane] = mine[plane] + mass if plane in mine else mass
        before.append(i)
        out.append(mine)
    return out
