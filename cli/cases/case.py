"""A case and a study: what a command computes of one mechanism, and what it does with all of them.

A command declares a `Case`, with tables, warnings and a picture of one mechanism at its inputs, and a `Study`, which
has the command's own options and makes the cases. `cli/cases/loop.py` runs a study over all cases.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple
from uuid import UUID, uuid4

from cli.cases.cases import Cases
from dalembert.dataclass import dataclass, field, replace
from dalembert.results.columns import Column, Table
from dalembert.results.columns import document as result_document
from dalembert.results.result import Result
from virtualwork import MechanismError

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.cases.analysis import Analysis
    from cli.cases.cases import Rows
    from cli.show.commands import ShowOptions
    from dalembert.results.columns import Cell, Document
    from dalembert.results.way import Topic
    from virtualwork.family.part import Part

    # for some variants and their inputs as they are shown, (v or 1, n, k)
    Together = Callable[[Part, Rows], "AtOnce"]

# rows of a part that is solved together; variants and rows of one that is solved one by one; of a table and of
# documents, where a row takes some kilobytes
TOGETHER, ONE_BY_ONE = (1 << 16, 1 << 12), (64, (1 << 14, 1 << 12))


class AtOnce(NamedTuple):
    """Some variants that are solved at once.

    Attributes
    ----------
    answer : Table or list of documents
        One variant after the other, a row or a document for each pose; without meaning where a variant is left alone.
    assembled : array (v, n)
    alone : array (v,)
        The variants that have to be solved one by one.
    """

    answer: Any
    assembled: NDArray[np.bool_]
    alone: NDArray[np.bool_]


class Case:
    """One mechanism at its inputs, and what a command computes of it."""

    study: Study

    @property
    def name(self) -> str:
        """The name of the mechanism."""
        return self.study.cases.mechanism.name

    # --- its tables -----------------------------------------------------------------------------------------------
    def table(self) -> Table:
        """Return the table that CSV has."""
        raise NotImplementedError

    def tables(self) -> Iterator[Table]:
        """Yield that table block by block."""
        yield self.table()

    def pattern(self) -> Table:
        """Return a table with the columns that the tables of all variants have."""
        return self.table()

    def further(self) -> Mapping[str, Callable[[], Table]]:
        """Return the further tables of a terminal, a workbook and a report, by name."""
        return {}

    def documented(self) -> Iterable[Table]:
        """Return the tables of the JSON document; those without a place there are left out."""
        return [self.table(), *(table() for table in self.further().values())]

    def document(self) -> Document:
        """Return the JSON document, without the name of the mechanism."""
        return result_document(self.documented())

    def assembled(self, rows: int = 0) -> list[bool] | bool:
        """Return whether each of so many rows has a pose that is assembled; of other rows, whether any pose is."""
        return True

    def warnings(self) -> list[str]:
        """Return the warnings, once all is computed."""
        return []

    # --- all forms ------------------------------------------------------------------------------------------------
    def way(self) -> list[Topic]:
        """Return the worked solution, for --steps."""
        return []

    @property
    def is_drawn(self) -> bool:
        """Whether there is a picture."""
        return True

    def figure(self) -> Figure:
        """Draw the picture."""
        raise NotImplementedError

    def result(self) -> Result:
        """Return the result of this mechanism alone, in every form."""
        document = cache(self.document)
        if self.study.json:
            # before its warnings
            document()
        return Result(
            document=lambda: {"name": self.name, **document()},
            tables={self.study.title: self.table, **self.further()},
            notes=lambda: self.name,
            figure=self.figure if self.is_drawn else None,
            method=self.study.method,
            warnings=self.warnings(),
            failed=lambda: not self.assembled(),
        )


@dataclass(frozen=True)
class Study:
    """What a command does with every case; another process gets it whole.

    Attributes
    ----------
    cases : Cases
    show : ShowOptions
        The forms that are requested.
    key : UUID
        The key of what a process keeps from one part to the next.
    """

    cases: Cases
    show: ShowOptions
    key: UUID = field(default_factory=uuid4)

    title = ""
    """The name of the table in a workbook and a report."""
    method = ""
    blank: ClassVar[Mapping[str, Any]] = {}
    """The JSON document of a variant that cannot be assembled, where it has not the form of the others."""
    one_blank_row = True
    """Whether a variant that cannot be assembled has one row; else as many rows as the others."""

    @property
    def json(self) -> bool:
        """Whether the JSON document is formed."""
        return self.show.as_json

    def resolved(self) -> Study:
        """Return the study with the numbers that it has to find first."""
        return self

    def case(self, analysis: Analysis) -> Case:
        """Return the case of one mechanism at its inputs.

        Raises
        ------
        MechanismError
        """
        raise NotImplementedError

    def each(self, rows: Rows) -> Iterator[tuple[Case | None, list[str]]]:
        """Yield the cases of some variants, each with its warnings; None where one cannot be assembled."""
        for row in rows:
            try:
                yield self.case(self.cases.analysis(row)), []
            except MechanismError as error:
                yield None, [str(error)]

    def together(self, row: Rows, json: bool) -> Together | None:
        """Return the function that solves many variants at once; None where they are solved one by one.

        `row`: numbers of a variant that can be assembled, which has all that varies.
        """
        return None

    def size(self, json: bool, together: bool) -> int:
        """Return the number of variants of a part."""
        rows = TOGETHER[json] if together else ONE_BY_ONE[1][json]
        most = rows if together else ONE_BY_ONE[0]
        return max(1, min(most, rows // self.cases.poses))

    def warnings(self) -> list[str]:
        """Return the warnings of the request itself, which hold for every variant."""
        return []

    def check_size(self, times: int) -> None:
        """Refuse so many variants (`times`) that would take more memory than there is, before they are solved."""

    # --- files ----------------------------------------------------------------------------------------------------
    @property
    def in_blocks(self) -> bool:
        """Whether the table of the mechanism itself is written block by block."""
        return False

    def files(self) -> Mapping[Path, Callable[[], Iterable[bytes]]]:
        """Return the further files of the mechanism itself."""
        return {}

    @property
    def frames(self) -> int:
        """The number of states of a case that the page shows."""
        return self.cases.poses

    def page(self, cases: Sequence[tuple[str, Case]], units: Mapping[str, str] | None) -> bytes:
        """Return the page on which every case, by its name, moves."""
        raise NotImplementedError


# --- tables of many variants: the same columns for all, one below the other -------------------------------------------
def length(table: Table) -> int:
    """Return the number of rows of a table; one of a table without columns."""
    return len(table.columns[0].values) if table.columns else 1


def like(pattern: Table, table: Table) -> Table:
    """Return a table with the columns of a pattern; what the table lacks is empty."""
    columns = {c.header: c for c in table.columns}
    empty: list[Cell] = [None] * length(table)
    return Table(
        [columns.get(c.header) or Column(c.name, c.unit, empty) for c in pattern.columns], pattern.keys
    )


def emptied(pattern: Table) -> Table:
    """Return the rows of a variant that cannot be assembled: the columns that name a row stay."""
    return Table(
        [
            c if c.header in pattern.keys else Column(c.name, c.unit, [None] * len(c.values))
            for c in pattern.columns
        ],
        pattern.keys,
    )


def without_errors(table: Table) -> Table:
    """Return a table without the errors of its numbers."""
    return replace(table, columns=[replace(c, error=None) for c in table.columns])


def joined(tables: Sequence[Table]) -> Table:
    """Put tables of the same columns one below the other."""
    if len(tables) == 1:
        return tables[0]

    def errors(parts: Sequence[Column]) -> Iterator[float]:
        for part in parts:
            # a variant that is not assembled has no numbers, and no errors of them
            yield from [0.0] * len(part.values) if part.error is None else part.error()

    def column(*parts: Column) -> Column:
        error = None if all(part.error is None for part in parts) else lambda: list(errors(parts))
        return replace(parts[0], values=[value for part in parts for value in part.values], error=error)

    return replace(tables[0], columns=list(map(column, *(table.columns for table in tables))))


def unassembled(part: Any, key: str = "") -> Any:
    """Return poses that are not assembled, in the form of others: what names a pose stays."""
    if isinstance(part, dict):
        return {key: unassembled(value, key) for key, value in part.items()}
    if isinstance(part, list):
        return [] if key == "marks" else [unassembled(each, key) for each in part]
    if isinstance(part, bool):
        return False
    return part if isinstance(part, str) or key in ("input_deg", "input_m", "branch") else None
