"""The rows of a table of runs, with the masses of each, side by side: rotors of like shape become arrays together."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from balancing.runs.runs import SHOWN, Channel, Complex, Exact, Group, Lines, Real, Rows, Runs
from dalembert.errors import DataError
from dalembert.tables.table import numbered

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_arrays import Vectors

    OfRows = list[dict[str, Vectors] | None]

T = TypeVar("T", Complex, "Vectors")
Mass = TypeVar("Mass", complex, "Vectors")


YES = ("yes", "y", "true", "1", "kept", "on", "ja", "j", "bleibt")
NO = ("no", "n", "false", "0", "", "removed", "off", "nein")


class Masses(NamedTuple):
    """The masses that the rows of a table put on, an entry for each."""

    planes: list[str]
    row: Rows
    """Ascending, (k,)."""
    plane: Rows
    value: Complex
    """SI."""
    stated: NDArray[np.bool_]
    """Whether a row states masses, (n,)."""
    exact: Callable[[], Vectors]
    """The values in 32 digits, as the file has them; computed on request."""

    @classmethod
    def of(
        cls, rows: Sequence[dict[str, complex] | None], exact: Callable[[], OfRows] | None = None
    ) -> Masses:
        """Take the masses of each row, plane -> mass; None where it states none. `exact`: in 32 digits."""
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
            from dalembert.arithmetic.doubled_arrays import Vectors

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

    def _rows(self, values: Sequence[Mass]) -> list[dict[str, Mass] | None]:
        out: list[dict[str, Mass] | None] = [{} if stated else None for stated in self.stated.tolist()]
        for i, plane, mass in zip(self.row.tolist(), self.plane.tolist(), values, strict=True):
            mine = out[i]
            assert mine is not None
            mine[self.planes[plane]] = mass
        return out


@dataclass(eq=False, repr=False)
class LogRows:
    """The rows of a table of runs, as arrays."""

    of: Runs
    """The runs that the rows are about."""
    rotor: Rows
    vibration: Complex
    masses: Masses
    run: Rows
    runs: list[str]
    exact: Callable[[], Vectors]
    """`vibration` in 32 digits, as the table has it; computed on request."""
    years: Real | None
    """When it was read; NaN where the row has no date."""
    channels: list[Channel]
    channel: Rows
    """The sensor, state and speed of each row."""


class _Listed:
    """The runs, planes or channels of each rotor, in the order of the table; the rows are sorted by rotor."""

    def __init__(self, rotor: Rows, code: Rows, rotors: int) -> None:
        self.number, self.first = numbered(rotor * (int(code.max(initial=0)) + 1) + code)
        self.code = code[self.first]
        self.count = np.bincount(rotor[self.first], minlength=rotors)
        self.start = np.cumsum(self.count) - self.count
        self.place = self.number - self.start[rotor]
        """The place of each row within its rotor."""

    def of(self, rotors: Rows) -> Rows:
        """Return the numbers that these rotors have, (g, …): each of them as many."""
        return np.asarray(self.start[rotors, None] + np.arange(self.count[rotors[0]]))

    def labelled(self, label: Rows, codes: Rows | None = None) -> Rows:
        """Give rotors whose lists differ, or these codes of them, labels that differ; `label`: those of other differences."""
        of_list = self.code if codes is None else codes
        most = int(of_list.max(initial=0)) + 2
        for j in range(int(self.count.max(initial=0))):
            has = self.count > j
            code = np.where(has, of_list[np.where(has, self.start + j, 0)], most - 1)
            label = np.unique(label * most + code, return_inverse=True)[1]
        return label


class Sorted:
    """The rows of all rotors, sorted by rotor; what was on in each run, and which runs take part."""

    def __init__(self, rows: LogRows, excluded: Collection[str]) -> None:
        self.rows = rows
        self.order = np.argsort(rows.rotor, kind="stable")
        self.rotor = rows.rotor[self.order]
        self.warnings: list[str] = []
        self.runs = _Listed(self.rotor, rows.run[self.order], len(rows.of.rotors))
        self.run = self.runs.number
        """The run of each row, numbered through all rotors."""
        out = np.array([name in excluded for name in rows.runs])
        self.takes_part = ~out[self.runs.code]
        self.read = np.ones(len(out[self.runs.code]), dtype=bool)
        """Whether the readings of a run count."""
        self._on()

    def _on(self) -> None:
        """Find what was on in each run, and the last run of each rotor."""
        rows, masses = self.rows, self.rows.masses
        place = np.empty(len(self.order), dtype=np.intp)
        place[self.order] = np.arange(len(self.order))
        at = place[masses.row]
        entry = np.argsort(at, kind="stable")
        at, plane, value = at[entry], masses.plane[entry], masses.value[entry]
        loaded = np.flatnonzero(masses.stated[self.order])
        first = np.full(len(self.runs.first), -1)
        first[self.run[loaded[::-1]]] = loaded[::-1]
        counts = at == first[self.run[at]]
        self._agree(loaded, first, at, plane, value, counts)
        at, plane, entry = at[counts], plane[counts], entry[counts]
        # planes in the order of the runs
        by_run = np.argsort(self.run[at], kind="stable")
        at, plane, entry = at[by_run], plane[by_run], entry[by_run]
        rotors = len(rows.of.rotors)
        self.planes = _Listed(self.rotor[at], plane, rotors)
        width = int(self.planes.count.max(initial=0))
        on = np.zeros((len(first), width), dtype=complex)
        on[self.run[at], self.planes.place] = masses.value[entry]
        self._puts = self.run[at], self.planes.place, entry
        self.has = np.zeros(on.shape, dtype=bool)
        self.has[self.run[at], self.planes.place] = True
        self.on = on
        self.stays = stays = self._stays()
        self._leave_on(on, np.zeros((rotors, width), dtype=complex))
        if stays.any():
            self.has |= on != 0
        read = np.zeros(len(first), dtype=bool)
        read[self.run[np.isfinite(rows.vibration[self.order])]] = True
        numbers = np.where(read, np.arange(len(first)), np.repeat(self.runs.start, self.runs.count))
        self.last = np.maximum.reduceat(numbers, self.runs.start)
        """The last run of each rotor in which anything was read."""

    def _leave_on(self, on: T, standing: T) -> None:
        """Add to the masses of each run (runs, planes) what earlier ones left on; `standing` is nothing, (rotors, planes)."""
        for j in range(int(self.runs.count.max()) if self.stays.any() else 0):
            mine = np.flatnonzero(self.runs.count > j)
            run = self.runs.start[mine] + j
            on[run] = on[run] + standing[mine]
            stay = self.stays[run]
            standing[mine[stay]] = on[run[stay]]

    @cached_property
    def _exactly_on(self) -> Vectors:
        """`on` in 32 digits."""
        from dalembert.arithmetic.doubled_arrays import Vectors

        run, place, entry = self._puts
        on = Vectors.of(np.zeros(self.on.shape))
        on[run, place] = self.rows.masses.exact()[entry]
        self._leave_on(on, Vectors.of(np.zeros((len(self.runs.count), self.on.shape[1]))))
        return on

    def _agree(
        self, loaded: Rows, first: Rows, at: Rows, plane: Rows, value: Complex, counts: NDArray[np.bool_]
    ) -> None:
        """Refuse rows with other masses than the first row of their run that states masses."""
        rows = self.rows
        in_order = np.lexsort((plane, at))
        at, plane = at[in_order], plane[in_order]
        value, counts = value[in_order], counts[in_order]
        entries = np.bincount(at, minlength=len(self.order))
        start = np.cumsum(entries) - entries
        # each mass of a row beside that of the row that counts
        twin = start[first[self.run[at]]] + np.arange(len(at)) - start[at]
        many = entries[loaded] != entries[first[self.run[loaded]]]
        bad = loaded[many]
        if not len(bad):
            own, twin = np.flatnonzero(~counts), twin[~counts]
            bad = at[own[(plane[twin] != plane[own]) | (value[twin] != value[own])]]
        if len(bad):
            row = bad.min()
            size, i = next(iter(rows.of.table.cells.values())), int(self.order[row])
            name = rows.runs[rows.run[i]]
            raise rows.of.table.error(
                i, size.header, size.values[i], f"the masses as elsewhere in run {name}"
            )

    def _stays(self) -> NDArray[np.bool_]:
        """Whether what a run has put on stays on."""
        stays = np.zeros(len(self.runs.first), dtype=bool)
        if "trial_kept" in self.rows.of.table.texts:
            words, code = self.rows.of.table.numbered("trial_kept")
            for k, word in enumerate(words):
                if word.lower() not in (*YES, *NO):
                    raise self.rows.of.table.error(int(np.argmax(code == k)), "trial_kept", word, "yes or no")
            kept = np.array([word.lower() in YES for word in words])[code[self.order]]
            stays[self.run[kept]] = True
            stated = np.array([bool(word) for word in words])[code[self.order]]
            for row in np.flatnonzero(stated & ~kept & stays[self.run])[:1].tolist():
                i, name = int(self.order[row]), self.rows.runs[self.runs.code[self.run[row]]]
                raise self.rows.of.table.error(
                    i, "trial_kept", words[code[i]], f"the same as elsewhere in run {name}"
                )
        return stays

    def _planes(self) -> tuple[_Listed, Rows]:
        """List the planes of each rotor in which a run that takes part has a mass, and their columns in `on`."""
        active = np.logical_or.reduceat(self.has & self.takes_part[:, None], self.runs.start, axis=0)
        alone = (self.on[self.last] != 0) & ~active
        for rotor, place in np.argwhere(alone)[:SHOWN].tolist():
            plane = self.rows.masses.planes[self.planes.code[self.planes.start[rotor] + place]]
            self.warnings.append(
                f"{self.rows.of.of(rotor)}the last run is excluded, and the mass that stands in plane {plane} with it: the trim "
                "leaves it out, for no other run has a mass there"
            )
        rotor, place = np.nonzero(active)
        return _Listed(rotor, self.planes.code[self.planes.start[rotor] + place], len(active)), place

    @property
    def bare(self) -> NDArray[np.bool_]:
        """Which runs are without masses, (runs,)."""
        return np.asarray(~self.on.any(axis=1))

    def leave_out_loaded(self) -> bool:
        """Leave out the runs with masses, where each rotor has one run without; return whether that is so."""
        rotor_of = np.repeat(np.arange(len(self.runs.count)), self.runs.count)
        if (np.bincount(rotor_of[self.bare & self.takes_part], minlength=len(self.runs.count)) != 1).any():
            return False
        self.read = self.bare
        return True

    def parts(self, named: Sequence[str | None] | None) -> Iterator[Group]:
        """Yield rotors of like channels, planes and rows of runs, and of like `named` coefficients where such are stored."""
        rows, rotors = self.rows, len(self.rows.of.rotors)
        takes_part = (self.takes_part & self.read)[self.run] & np.isfinite(rows.vibration[self.order])
        mine = np.flatnonzero(takes_part)
        rotor, run, channel = self.rotor[mine], self.run[mine], rows.channel[self.order[mine]]
        lacking = np.flatnonzero(np.bincount(rotor, minlength=rotors) == 0)
        if len(lacking):
            of = self.rows.of.of(int(lacking[0]))
            left = (
                "of the runs that are not excluded none was read"
                if self.takes_part.any()
                else "every run is excluded"
            )
            raise DataError(f"{rows.of.table.file}: {of}{left}: expected runs to fit")
        again = _again(run * len(rows.channels) + channel)
        repeats = int(again.max()) + 1
        lines = _Listed(rotor, run * repeats + again, rotors)
        channels = _Listed(rotor, channel, rotors)
        planes, places = self._planes()
        if named is None:
            self._require_masses()
        label = planes.labelled(channels.labelled(lines.count))
        # runs that were read more often than once in like places
        place = self.runs.place[mine]
        label = lines.labelled(label, place[lines.first])
        if named is not None:
            numbers: dict[str | None, int] = {}
            of_name = np.array([numbers.setdefault(name, len(numbers)) for name in named])
            label = np.unique(label, return_inverse=True)[1] * len(numbers) + of_name
        label, begin = numbered(label)
        members, rows_of = (np.argsort(of, kind="stable") for of in (label, label[rotor]))
        many, many_rows = (np.bincount(of, minlength=len(begin)) for of in (label, label[rotor]))
        rank = np.empty(rotors, dtype=np.intp)
        rank[members] = np.arange(rotors) - np.repeat(np.cumsum(many) - many, many)
        years, weights = self._years(mine, run, lines), self._weights(mine, channels)
        for group, at in zip(
            np.split(members, np.cumsum(many)[:-1]), np.split(rows_of, np.cumsum(many_rows)[:-1]), strict=True
        ):
            here, heads, columns = lines.of(group), channels.of(group), planes.of(group)
            readings = np.full((*here.shape, heads.shape[1]), complex(np.nan))
            cells, source = (rank[rotor[at]], lines.place[at], channels.place[at]), self.order[mine[at]]
            readings[cells] = rows.vibration[source]
            first = lines.first[here]
            loads = run[first][..., None], places[columns][:, None, :]
            stand = self.last[group][:, None], places[columns]
            when = None if years is None else years[here]
            if when is not None:
                self._lacking(group, when, self.runs.code[run[first]])
            yield Group(
                group,
                Lines(rows.runs, self.runs.code[run[first]], place[first[0]], when),
                [rows.channels[c] for c in channels.code[heads[0]].tolist()],
                [rows.masses.planes[k] for k in planes.code[columns[0]].tolist()],
                readings,
                self.on[loads],
                self.on[stand],
                [rows.runs[k] for k in self.runs.code[self.last[group]].tolist()],
                None if weights is None else self._positive(group, weights[heads]),
                partial(self._exact, readings.shape, cells, source, loads, stand),
            )

    def _exact(
        self,
        shape: tuple[int, ...],
        cells: tuple[Rows, ...],
        source: Rows,
        loads: tuple[Rows, Rows],
        stand: tuple[Rows, Rows],
    ) -> Exact:
        """Lay the same rows side by side in 32 digits."""
        from dalembert.arithmetic.doubled_arrays import Vectors

        readings = Vectors.of(np.zeros(shape))
        readings[cells] = self.rows.exact()[source]
        return Exact(readings, self._exactly_on[loads], self._exactly_on[stand])

    def _require_masses(self) -> None:
        """Refuse a rotor on which no mass ever was."""
        some = np.logical_or.reduceat(
            ((self.on != 0) & self.takes_part[:, None]).any(axis=1), self.runs.start
        )
        if not some.all():
            of = self.rows.of.of(int(np.argmin(some)))
            raise DataError(
                f"{self.rows.of.table.file}: {of}no trial run: no mass ever changed; expected a positive trial mass for every "
                "plane, or stored influence coefficients"
            )

    def _weights(self, mine: Rows, channels: _Listed) -> Real | None:
        """Return the weight of each channel, from the rows that state one; 1 where none does."""
        weight = self.rows.of.table.numbers.get("weight")
        if weight is None:
            return None
        value = weight.values[self.order[mine]]
        stated, first = np.flatnonzero(~np.isnan(value)), np.full(len(channels.first), -1)
        first[channels.number[stated[::-1]]] = stated[::-1]
        other = stated[value[stated] != value[first[channels.number[stated]]]]
        for row in other[:1].tolist():
            wanted = value[first[channels.number[row]]]
            raise self.rows.of.table.error(
                int(self.order[mine[row]]),
                weight.header,
                f"{value[row]:g}",
                f"{wanted:g} as elsewhere for this sensor",
            )
        return np.where(first < 0, 1.0, value[first])

    def _positive(self, group: Rows, weights: Real) -> Real:
        """Return the weights of rotors (g, s), of which none may be negative and one has to be positive."""
        wrong = ~(weights > 0).any(axis=1) | (weights < 0).any(axis=1)
        if wrong.any():
            of = self.rows.of.of(int(group[np.argmax(wrong)]))
            raise DataError(
                f"{self.rows.of.table.file}: {of}the weights are zero or negative: expected one that is positive"
            )
        return weights

    def _years(self, mine: Rows, run: Rows, lines: _Listed) -> Real | None:
        """Return when each row of readings was read: each has a date itself, or its run has one."""
        if self.rows.years is None:
            return None
        years = self.rows.years[self.order[mine]]
        dated = np.flatnonzero(np.isfinite(years))[::-1]
        of_run, of_line = np.full(len(self.runs.first), np.nan), np.full(len(lines.first), np.nan)
        of_run[run[dated]] = years[dated]
        of_line[lines.number[dated]] = years[dated]
        return np.where(np.isnan(of_line), of_run[run[lines.first]], of_line)

    def _lacking(self, group: Rows, years: Real, run: Rows) -> None:
        """Warn of runs without a date."""
        for i in np.flatnonzero(np.isnan(years).any(axis=1)).tolist():
            names = dict.fromkeys(self.rows.runs[k] for k in run[i, np.isnan(years[i])].tolist())
            if len(self.warnings) == SHOWN:
                self.warnings.append("… and the same of further rotors: no date")
            elif len(self.warnings) < SHOWN:
                self.warnings.append(
                    f"{self.rows.of.of(int(group[i]))}no date in run{'s' * (len(names) > 1)} {', '.join(names)}: drift over time is not tested"
                )


def _again(codes: Rows) -> Rows:
    """Tell how often each code stood before.

    >>> _again(np.array([4, 2, 4, 4]))
    array([0, 0, 1, 2])
    """
    order = np.argsort(codes, kind="stable")
    inside = codes[order]
    begin = np.concatenate([[True], inside[1:] != inside[:-1]])
    out = np.empty_like(order)
    out[order] = np.arange(len(order)) - np.maximum.accumulate(np.where(begin, np.arange(len(order)), 0))
    return out
