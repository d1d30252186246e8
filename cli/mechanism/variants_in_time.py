"""`--time` with `--vary` or `--variants`: every variant let go, its rows one below the other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from cli.errors import DataError
from cli.mechanism.asked import Home, Question, Said, like
from cli.mechanism.in_time import ENERGY, METHOD, InTime, columns_of, inputs_of, known, largest, rows_of_time
from cli.mechanism.read import until_inputs, wanted
from cli.mechanism.solve import Analysis
from cli.mechanism.variants import Variants
from cli.show.columns import Column, Table
from dalembert.arithmetic.engines import anew
from virtualwork import MechanismError

if TYPE_CHECKING:
    from cli.mechanism.asked import Rows
    from cli.mechanism.in_time import Values
    from cli.mechanism.quantities import Quantity
    from cli.show.columns import Document

# variants of a part that are let go together, and one by one
TOGETHER, ONE_BY_ONE = 512, 8


class Found(NamedTuple):
    """A variant's motion: its times (none where it cannot be let go), all that is asked for, what of it is unexplained.

    `errors` has the bounds of the columns' errors, where digits are asked for.
    """

    t: Rows
    values: Values
    drift: Rows
    errors: dict[Quantity, list[float]] | None = None

    @property
    def table(self) -> Table:
        """A row for each time."""
        errors = None if self.errors is None else self.errors.__getitem__
        return Table(columns_of(self.t, self.values, errors))


@dataclass(frozen=True)
class AskedInTime(Question):
    """What is asked of every variant; `times`, `accuracy`, `until` as in `InTime`."""

    times: list[float]
    accuracy: float
    until: str | None

    method = METHOD

    @property
    def together(self) -> bool:
        """Whether the inputs and the energy are all that is asked for, which variants have as lanes."""
        asked = self.asked
        return asked.only is None and asked.branch is None and not (asked.forces or self.digits)

    def home(self, variants: Variants, json: bool) -> Home:
        """The columns that all tables have: those of the first variant that can be let go, from its first time alone."""
        each = TOGETHER if self.together else ONE_BY_ONE
        if json:
            return Home(each)
        first = replace(self, times=self.times[:1], until=None, digits=False)
        for i in range(variants.count):
            (found,) = first.found(1, variants.part(i, i + 1), Said())
            if len(found.t):
                return Home(each, found.table)
        return Home(each, Table([Column("t", "s", [None])]))

    def drawn(self, row: Rows) -> InTime:
        """A variant let go alone."""
        m = self.variant(row)
        q = wanted(m, None, None, None, self.bare)
        home = Analysis.of(self.asked, m, q, 2)
        found = InTime(home, self.times, self.accuracy, self.until, self.bare, self.asked.forces)
        # one that cannot be let go is an error now
        _ = found.run
        return found

    def found(self, first: int, shown: Rows, said: Said) -> Iterator[Found]:
        """The motions of some variants."""
        return (self._lanes if self.together else self._each)(first, shown, said)

    def _each(self, first: int, shown: Rows, said: Said) -> Iterator[Found]:
        """One by one."""
        for i, row in enumerate(shown):
            anew()
            try:
                one = self.drawn(row)
                run = one.run
                errors = one.errors if self.digits else None
                yield Found(run.t, one.shown, run.energy_drift, errors)
                for remark in run.warnings:
                    said.add(remark, [str(first + i)])
                said.any_assembled = True
            except MechanismError as error:
                said.add(str(error), [str(first + i)])
                yield Found(np.array([]), {}, np.array([]))

    def _lanes(self, first: int, shown: Rows, said: Said) -> Iterator[Found]:
        """The same, let go together."""
        anew()
        m = self.mechanism
        level = None if self.until is None else until_inputs(m, self.until, self.bare)
        try:
            family = m.vary(self.numbers(shown))
            runs = family.simulate(self.times, accuracy=self.accuracy, until=level)
        except ValueError as error:
            raise DataError(f"{self.asked.file}: {error}") from None
        for i, remarks in sorted(runs.warnings.items()):
            for remark in remarks:
                said.add(remark, [str(first + i)])
        for i, there in enumerate(np.isfinite(runs.times)):
            said.any_assembled |= bool(there.any())
            values: Values = {}
            if there.any():
                of = (runs.angle, runs.speed, runs.acceleration, runs.error_estimate)
                values = inputs_of(m, *(x[i, there] for x in of)) | {ENERGY: runs.energy[i, there]}
                values = known(values, runs.unknown[i, there])
            yield Found(runs.times[i, there], values, runs.energy_drift[i, there])

    def table(self, home: Home, first: int, shown: Rows, said: Said) -> Table:
        """The rows of some variants; one that cannot be let go has none but its own."""
        blank = Table([Column(c.name, c.unit, [None]) for c in home.pattern.columns])
        found = self.found(first, shown, said)
        tables = [like(home.pattern, of.table) if len(of.t) else blank for of in found]
        return replace(self.below(first, shown, tables), keys=("variant", "t_s"))

    def documents(self, home: Home, first: int, shown: Rows, said: Said) -> list[Document]:
        """What JSON says of some variants."""
        found: list[Document] = [
            {"time": rows_of_time(of.t, of.values), "energy_drift_J": largest(of.drift)}
            for of in self.found(first, shown, said)
        ]
        return self.named(first, shown, found)
