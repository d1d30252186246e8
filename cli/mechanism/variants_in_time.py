"""`--time` with `--vary` or `--variants`: every variant let go, its rows one below the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.errors import DataError
from cli.mechanism.asked import Said
from cli.mechanism.in_time import METHOD, InTime, columns_of, inputs_of, known, largest, rows_of_time
from cli.mechanism.many import joined, like
from cli.mechanism.parted import Solved, solved
from cli.mechanism.read import until_inputs, wanted
from cli.mechanism.solve import Analysis
from cli.mechanism.variants import Variants, in_si, with_numbers
from cli.show.columns import Column, Result, Table, Written
from dalembert.arithmetic.engines import anew
from virtualwork import Mechanism, MechanismError
from virtualwork.describe.dimensions import Dimension

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from cli.mechanism.in_time import Parts
    from cli.show.columns import Document, Form

    Rows = NDArray[np.float64]

# variants of a part that are let go together, and one by one
TOGETHER, ONE_BY_ONE = 512, 8


class Found(NamedTuple):
    """A variant's motion: its times (none where it cannot be let go), all that is asked for, what of it is unexplained.

    `errors` has the bounds of the columns' errors, where digits are asked for.
    """

    t: Rows
    parts: Parts
    drift: Rows
    errors: dict[tuple[str, Any, str], list[float]] | None = None


@dataclass(frozen=True)
class AskedInTime:
    """What is asked of every variant: all that another process needs to know.

    Attributes
    ----------
    mechanism : Mechanism
        What they are variants of.
    dimensions : tuple of Dimension
        What is varied.
    times, accuracy, until, bare, forces
        As in `InTime`.
    only, branch
        As in `Analysis`.
    digits : bool
        Whether the errors of all numbers are asked for.
    """

    file: str
    mechanism: Mechanism
    dimensions: tuple[Dimension, ...]
    times: list[float]
    accuracy: float
    until: str | None
    bare: Mapping[str, str]
    forces: bool
    only: list[str] | None
    branch: str | None
    digits: bool

    @property
    def together(self) -> bool:
        """Whether the inputs and the energy are all that is asked for, which variants have as lanes."""
        return self.only is None and self.branch is None and not (self.forces or self.digits)

    def alone(self, row: Rows) -> InTime:
        """The question, asked of one variant.

        Raises
        ------
        MechanismError
        """
        m = with_numbers(self.mechanism, self.dimensions, row.tolist())
        q = wanted(m, None, None, None, self.bare)
        home = Analysis.of(self.file, m, q, 2, self.only, self.branch)
        return InTime(home, self.times, self.accuracy, self.until, self.bare, self.forces)

    def each(self, first: int, shown: Rows, said: Said) -> Iterator[Found]:
        """The variants from `first` on, one by one."""
        for i, row in enumerate(shown):
            anew()
            try:
                one = self.alone(row)
                run = one.run
                errors = one.errors if self.digits else None
                yield Found(run.t, one.shown, run.energy_drift, errors)
                for remark in run.warnings:
                    said.add(remark, [str(first + i)])
                said.any_assembled = True
            except MechanismError as error:
                said.add(str(error), [str(first + i)])
                yield Found(np.array([]), {}, np.array([]))

    def lanes(self, first: int, shown: Rows, said: Said) -> Iterator[Found]:
        """The same, let go together."""
        anew()
        numbers = {
            d.path: [in_si(d, x) for x in column]
            for d, column in zip(self.dimensions, shown.T.tolist(), strict=True)
        }
        m = self.mechanism
        level = None if self.until is None else until_inputs(m, self.until, self.bare)
        try:
            runs = m.vary(numbers).simulate(self.times, accuracy=self.accuracy, until=level)
        except ValueError as error:
            raise DataError(f"{self.file}: {error}") from None
        for i, remarks in sorted(runs.warnings.items()):
            for remark in remarks:
                said.add(remark, [str(first + i)])
        for i, there in enumerate(np.isfinite(runs.times)):
            said.any_assembled |= bool(there.any())
            parts: Parts = {}
            if there.any():
                of = (runs.angle, runs.speed, runs.acceleration, runs.error_estimate)
                parts = {
                    "inputs": inputs_of(m, *(x[i, there] for x in of)),
                    "energy": {"": {"energy_J": runs.energy[i, there]}},
                }
                parts = known(parts, runs.unknown[i, there])
            yield Found(runs.times[i, there], parts, runs.energy_drift[i, there])


def motions(asked: AskedInTime, first: int, shown: Rows) -> Solved:
    """What is found of some variants, which are called from `first` on."""
    said = Said()
    way = asked.lanes if asked.together else asked.each
    return Solved(list(way(first, shown, said)), said)


def rows(asked: AskedInTime, pattern: Table, form: Form, first: int, shown: Rows) -> Solved:
    """The rows of some variants, with the columns of a pattern."""
    found, said = motions(asked, first, shown)
    return Solved(form(table_of(asked, pattern, first, shown, found), first - 1), said)


def table_of(asked: AskedInTime, pattern: Table, first: int, shown: Rows, found: list[Found]) -> Table:
    """The rows of variants; one that cannot be let go has none but its own."""
    tables = []
    for i, (row, of) in enumerate(zip(shown.tolist(), found, strict=True)):
        whole = Table([Column(c.name, c.unit, [None]) for c in pattern.columns])
        if len(of.t):
            whole = like(pattern, Table(_columns(asked, of)))
        n = len(whole.columns[0].values)
        given = [Column(d.path, d.unit, [value] * n) for d, value in zip(asked.dimensions, row, strict=True)]
        tables.append(Table([Column("variant", "", [str(first + i)] * n), *given, *whole.columns]))
    return Table(joined(tables).columns, keys=("variant", "t_s"))


def _columns(asked: AskedInTime, of: Found) -> list[Column]:
    several, errors = len(asked.mechanism.inputs) > 1, of.errors
    if errors is None:
        return columns_of(of.t, of.parts, several)
    return columns_of(of.t, of.parts, several, lambda *which: errors[which])


@dataclass(eq=False)
class VariantsInTime:
    """One call with `--time` of many variants.

    Attributes
    ----------
    workers : int
        How many processes.
    remarks : list of str
        What there is to say already.
    """

    asked: AskedInTime
    variants: Variants
    workers: int = 1
    remarks: list[str] = field(default_factory=list)
    said: Said = field(default_factory=Said)

    def _solved(self, function: Any) -> Iterator[Any]:
        """What a function gives of all parts, in their order."""
        self.said = Said()
        each = TOGETHER if self.asked.together else ONE_BY_ONE
        return solved(function, self.variants, each, self.workers, self.said)

    @cached_property
    def pattern(self) -> Table:
        """The columns that all tables have: those of the first variant that can be let go, from its first time alone."""
        first = replace(self.asked, times=self.asked.times[:1], until=None, digits=False)
        for i in range(self.variants.count):
            (found,), _ = motions(first, 1, self.variants.part(i, i + 1))
            if len(found.t):
                return Table(_columns(first, found))
        return Table([Column("t", "s", [None])])

    @cached_property
    def found(self) -> list[Found]:
        """The motions of all variants."""
        return [each for part in self._solved(partial(motions, self.asked)) for each in part]

    def blocks(self, form: Form) -> Iterator[Written]:
        """What is written of the table, part by part."""
        yield from self._solved(partial(rows, self.asked, self.pattern, form))

    def table(self) -> Table:
        """The rows of every variant."""
        every = self.variants.part(0, self.variants.count)
        return table_of(self.asked, self.pattern, 1, every, self.found)

    def document(self) -> Document:
        """The JSON document."""
        every = self.variants.part(0, self.variants.count).tolist()
        return {
            "name": self.asked.mechanism.name,
            "variants": [
                {
                    "variant": str(i + 1),
                    "set": {d.header: x for d, x in zip(self.variants.dimensions, row, strict=True)},
                    "time": rows_of_time(of.t, of.parts),
                    "energy_drift_J": largest(of.drift),
                }
                for i, (row, of) in enumerate(zip(every, self.found, strict=True))
            ],
        }

    def runs(self) -> list[tuple[str, InTime]]:
        """Each variant that can be let go, by its name, alone."""
        found = []
        for i in range(self.variants.count):
            try:
                one = self.asked.alone(self.variants.part(i, i + 1)[0])
                _ = one.run
            except MechanismError:
                # the rows say why
                continue
            found.append((str(i + 1), one))
        return found

    def result(self, streams: bool, about: Mapping[str, str]) -> Result:
        """The call as one table alone, written part by part, or in every form it can be shown in."""
        asked = self.asked
        about = {"title": asked.mechanism.name or "Mechanism"} | dict(about)
        if streams:
            return Result(
                document=dict,
                blocks=self.blocks,
                blocks_name="variants",
                shared=self.workers > 1,
                warnings=self.remarks,
                late_warnings=lambda: self.said.lines(),
                failed=lambda: not self.said.any_assembled,
            )
        _ = self.found
        return Result(
            document=self.document,
            tables={"variants": self.table},
            notes=lambda: asked.mechanism.name,
            method=METHOD,
            about=about,
            warnings=[*self.remarks, *self.said.lines()],
            failed=lambda: not self.said.any_assembled,
        )
