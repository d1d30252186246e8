"""`--time` with `--vary` or `--variants`: every variant let go, its rows one below the other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.errors import DataError
from cli.mechanism.asked import Said
from cli.mechanism.in_time import METHOD, InTime, columns_of, inputs_of, largest, rows_of_time
from cli.mechanism.many import joined
from cli.mechanism.read import wanted
from cli.mechanism.solve import Analysis
from cli.mechanism.variants import Variants, in_si, with_numbers
from cli.show.columns import Column, Result, Table
from virtualwork import MechanismError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cli.mechanism.in_time import Parts
    from cli.show.columns import Document
    from virtualwork import Mechanism


@dataclass(eq=False)
class VariantsInTime:
    """One call with `--time` of many variants.

    Attributes
    ----------
    question : InTime
        What is asked of the mechanism itself.
    names : list of str or None
        `--only`.
    """

    question: InTime
    variants: Variants
    names: list[str] | None
    branch: str | None

    @property
    def mechanism(self) -> Mechanism:
        """What they are variants of."""
        return self.question.analysis.mechanism

    @cached_property
    def found(self) -> tuple[list[tuple[Any, Parts, Any]], Said]:
        """Of each variant the times, what is found at them, and its energy drift; and what must be said."""
        said, q = Said(), self.question
        rows = self.variants.part(0, self.variants.count)
        together = self.names is None and self.branch is None and not q.forces and q.until is None
        return (self._together if together else self._singly)(rows, said), said

    def _together(self, rows: Any, said: Said) -> list[tuple[Any, Parts, Any]]:
        numbers = {
            d.path: [in_si(d, x) for x in column]
            for d, column in zip(self.variants.dimensions, rows.T.tolist(), strict=True)
        }
        try:
            runs = self.mechanism.vary(numbers).simulate(self.question.times, accuracy=self.question.accuracy)
        except ValueError as error:
            raise DataError(f"{self.question.analysis.file}: {error}") from None
        for i, remarks in sorted(runs.warnings.items()):
            for remark in remarks:
                said.add(remark, [str(i + 1)])
        of = (runs.angle, runs.speed, runs.acceleration, runs.error_estimate)
        return [
            (
                runs.t,
                {
                    "inputs": inputs_of(self.mechanism, *(x[i] for x in of)),
                    "energy": {"": {"energy_J": runs.energy[i]}},
                },
                runs.energy_drift[i],
            )
            for i in range(len(rows))
        ]

    def _singly(self, rows: Any, said: Said) -> list[tuple[Any, Parts, Any]]:
        found: list[tuple[Any, Parts, Any]] = []
        q = self.question
        for i, row in enumerate(rows):
            try:
                m = with_numbers(self.mechanism, self.variants.dimensions, row.tolist())
                home = Analysis.of(
                    q.analysis.file, m, wanted(m, None, None, None, q.bare), 2, self.names, self.branch
                )
                one = InTime(home, q.times, q.accuracy, q.until, q.bare, q.forces)
                found.append((one.run.t, one.fine, one.run.energy_drift))
                for remark in one.run.warnings:
                    said.add(remark, [str(i + 1)])
            except MechanismError as error:
                said.add(str(error), [str(i + 1)])
                found.append((np.array([]), {}, np.array([])))
        return found

    def table(self) -> Table:
        """The rows of every variant; one that cannot be let go has none but its own."""
        found, _ = self.found
        several = len(self.mechanism.inputs) > 1
        tables, rows = [], self.variants.part(0, self.variants.count)
        parts = [columns_of(t, of, several) for t, of, _ in found]
        pattern = max(parts, key=len)
        for i, (row, columns) in enumerate(zip(rows.tolist(), parts, strict=True)):
            if len(columns) < len(pattern):
                columns = [Column(c.header, c.unit, [None]) for c in pattern]
            n = len(columns[0].values)
            given = [
                Column(d.path, d.unit, [value] * n)
                for d, value in zip(self.variants.dimensions, row, strict=True)
            ]
            tables.append(Table([Column("variant", "", [str(i + 1)] * n), *given, *columns]))
        return Table(joined(tables).columns, keys=("variant", "t_s"))

    def document(self) -> Document:
        """The JSON document."""
        found, _ = self.found
        rows = self.variants.part(0, self.variants.count).tolist()
        return {
            "name": self.mechanism.name,
            "variants": [
                {
                    "variant": str(i + 1),
                    "set": {d.header: x for d, x in zip(self.variants.dimensions, row, strict=True)},
                    "time": rows_of_time(t, of),
                    "energy_drift_J": largest(drift),
                }
                for i, (row, (t, of, drift)) in enumerate(zip(rows, found, strict=True))
            ],
        }

    def result(self, about: Mapping[str, str]) -> Result:
        """The call in every form it can be shown in."""
        found, said = self.found
        return Result(
            document=self.document,
            tables={"variants": self.table},
            notes=lambda: self.mechanism.name,
            method=METHOD,
            about={"title": self.mechanism.name or "Mechanism"} | dict(about),
            warnings=[*self.question.analysis.warnings, *said.lines()],
            failed=lambda: not any(len(t) and np.isfinite(drift).any() for t, _, drift in found),
        )
