"""What a command does with every mechanism: its case, and its study; those of a single table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar
from uuid import UUID, uuid4

import numpy as np

from cli.cases.analysis import Analysis
from cli.cases.inputs import Driven, Grid, Varied, of_one, with_numbers
from cli.show.result import Result
from dalembert.dataclass import dataclass, field, replace
from dalembert.results.columns import Column, Table
from dalembert.results.columns import document as result_document
from virtualwork import MechanismError

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.cases.analysis import Request
    from cli.cases.inputs import InputGrid, Inputs
    from cli.cases.together import Together
    from cli.show.commands import ShowOptions
    from dalembert.results.columns import Cell, Document
    from dalembert.results.way import Topic
    from virtualwork import Mechanism
    from virtualwork.describe.dimensions import Dimension
    from virtualwork.family.part import Part

    Rows = NDArray[np.float64]

# rows of a part that is solved together; variants and rows of one that is solved one by one; of a table and of
# documents, where a row takes some kilobytes
TOGETHER, ONE_BY_ONE = (1 << 16, 1 << 12), (64, (1 << 14, 1 << 12))


class Case:
    """One mechanism with its inputs, and what a command tells of it."""

    def tables(self) -> Iterator[Table]:
        """Its rows, a block of poses at a time."""
        raise NotImplementedError

    def pattern(self) -> Table:
        """A table with the columns that the tables of all variants have."""
        return joined(list(self.tables()))

    def document(self) -> Document:
        """What the JSON document has of it."""
        raise NotImplementedError

    def warnings(self) -> list[str]:
        """What to warn of, once all is worked out."""
        return []

    def way(self) -> list[Topic]:
        """The worked solution, for --steps."""
        return []

    def assembled(self, table: Table) -> list[bool] | bool:
        """Whether the pose of each row of its table is assembled; or whether anything is."""
        return True


@dataclass(frozen=True)
class Study:
    """What a command does with every case: all that another process needs to know.

    Attributes
    ----------
    mechanism : Mechanism
        What the variants are variants of.
    bare : mapping
        The file's units of bare numbers.
    digits : bool
        Whether bounds of the errors are needed.
    json : bool
        Whether the JSON document is formed.
    names : tuple of Driven or Varied
        What a row of variants sets.
    moved : Grid, optional
        The inputs that all variants go through.
    key : UUID
        By which a process finds what it has prepared for it.
    """

    request: Request
    mechanism: Mechanism
    bare: dict[str, str]
    digits: bool
    json: bool
    names: tuple[Driven | Varied, ...] = ()
    moved: Grid | None = None
    key: UUID = field(default_factory=uuid4)

    method = ""
    blank: ClassVar[Mapping[str, Any]] = {}
    """What JSON has of a variant that cannot be assembled, where that is not the form of others."""
    one_blank_row = False
    """Whether a variant that cannot be assembled has one row; else as many as others have."""

    def case(self, row: Rows | None = None) -> Case:
        """The case of a row of variants, or of the mechanism itself.

        Raises
        ------
        MechanismError
        """
        raise NotImplementedError

    def cases(self, shown: Rows) -> Iterator[tuple[Case | None, list[str]]]:
        """The cases of some variants, each with its remarks; None where one cannot be assembled."""
        for row in shown:
            try:
                yield self.case(row), []
            except MechanismError as error:
                yield None, [str(error)]

    def result(self, case: Case) -> Result:
        """The result of a mechanism alone, in every form."""
        raise NotImplementedError

    def page(self, cases: Sequence[tuple[str, Case]], units: str | None) -> bytes:
        """The page that moves, of every case by its name."""
        raise NotImplementedError

    @property
    def frames(self) -> int:
        """How many states of a case the page shows."""
        return 1 if self.moved is None else self.moved.n

    def warnings(self) -> list[str]:
        """What to remark on the request itself, whatever the variant."""
        return []

    def together(self, row: Rows, json: bool) -> Together | None:
        """How variants are solved at once; None where they are not.

        `row`: of one that can be assembled, which has all that is varied.
        """
        return None

    def in_blocks(self, show: ShowOptions) -> bool:
        """Whether the table of the mechanism itself is written a block at a time."""
        return False

    def beside_table(self) -> Mapping[Path, Callable[[], Iterable[bytes]]]:
        """Further files of the mechanism itself."""
        return {}

    def check_size(self, show: ShowOptions, times: int) -> None:
        """Of so many variants refuse what would take more memory than there is, before it is begun."""

    def size(self, json: bool, together: bool) -> int:
        """How many variants a part has."""
        rows = TOGETHER[json] if together else ONE_BY_ONE[1][json]
        most = rows if together else ONE_BY_ONE[0]
        return max(1, min(most, rows // (1 if self.moved is None else self.moved.n)))

    # --- variants -------------------------------------------------------------------------------------------------
    @cached_property
    def own(self) -> Analysis:
        """The mechanism itself, over the inputs of the call."""
        return Analysis(self.request, self.mechanism, self.inputs(self.mechanism, None))

    def analysis(self, row: Rows | None = None) -> Analysis:
        """A variant over its inputs, or the mechanism itself.

        Raises
        ------
        MechanismError
        """
        if row is None:
            return self.own
        m = self.variant(row)
        return Analysis(self.request, m, self.inputs(m, row))

    def __getstate__(self) -> dict[str, Any]:
        """What another process needs: all but what is worked out of it."""
        return {name: value for name, value in vars(self).items() if name != "own"}

    @property
    def dimensions(self) -> list[Dimension]:
        """The dimensions that vary."""
        return [name.of for name in self.names if isinstance(name, Varied)]

    def numbers(self, shown: Rows) -> Rows:
        """Of rows of variants the dimensions alone."""
        return shown[:, [isinstance(name, Varied) for name in self.names]]

    def variant(self, row: Rows) -> Mechanism:
        """The mechanism with a variant's numbers.

        Raises
        ------
        MechanismError
        """
        return with_numbers(self.mechanism, self.dimensions, self.numbers(row[None])[0].tolist())

    def in_si(self, shown: Rows) -> dict[str, list[float]]:
        """The numbers of variants by path, SI."""
        return {
            d.path: [Varied(d).si(x) for x in column]
            for d, column in zip(self.dimensions, self.numbers(shown).T.tolist(), strict=True)
        }

    def inputs(self, m: Mechanism, row: Rows | None) -> Inputs | InputGrid:
        """The inputs of a variant."""
        if row is None:
            return of_one(m, self.moved)
        its = [
            (name, float(x), float(np.radians(x)) if name.unit == "deg" else float(x))
            for name, x in zip(self.names, row, strict=True)
            if isinstance(name, Driven)
        ]
        return of_one(m, self.moved, its)

    def part(self, shown: Rows) -> tuple[Part, Rows]:
        """Variants as a part of a family, and their inputs as they are shown, (v or 1, n, k)."""
        from virtualwork.family.family import Family
        from virtualwork.family.part import Part

        m, v = self.mechanism, len(shown)
        family = Family(m, self.in_si(shown))
        own = self.inputs(m, None).whole
        names = () if self.moved is None else self.moved.names
        moved = {name.j for name in names if isinstance(name, Driven)}
        si, seen = own.values[None], own.shown[None]
        rates = family.rates(own.speed, own.acceleration)
        # what each variant has of its own: a column of inputs, or another position in its file
        for name, column in zip(self.names, shown.T, strict=True):
            j = (
                name.j
                if isinstance(name, Driven)
                else int(name.of.where[1])
                if name.of.where[0] == "inputs"
                else -1
            )
            if j < 0 or (j in moved and not isinstance(name, Driven)):
                continue
            numbers = np.radians(column) if name.unit == "deg" else np.asarray(column, dtype=float)
            if isinstance(name, Driven) and name.order:
                rates[name.order - 1][j] = numbers[:, None]
            elif isinstance(name, Driven) or name.of.where[-1] == "value":
                if len(si) == 1:
                    si, seen = (np.repeat(x, v, axis=0) for x in (si, seen))
                value = Driven.of(m, j)
                si[:, :, j] = numbers[:, None]
                as_shown = column if isinstance(name, Driven) else [value.shown(x) for x in numbers.tolist()]
                seen[:, :, j] = np.asarray(as_shown)[:, None]
        return Part(m, family.dimensions, family.values, si, rates), seen


class TableCase(Case):
    """What a study gives of one mechanism."""

    name: str
    """That of the mechanism."""

    def table(self) -> Table:
        """The one table."""
        raise NotImplementedError

    def tables(self) -> Iterator[Table]:
        """The one table."""
        yield self.table()

    def further(self) -> Mapping[str, Callable[[], Table]]:
        """Further tables of a terminal, a workbook, a report; by name."""
        return {}

    def documented(self) -> Iterable[Table]:
        """The tables that JSON has, as far as they have a place there."""
        return [self.table(), *(table() for table in self.further().values())]

    def document(self) -> Document:
        """What the JSON document has of it."""
        return result_document(self.documented())

    @property
    def is_drawn(self) -> bool:
        """Whether there is a picture."""
        return True

    def figure(self) -> Figure:
        """The picture."""
        raise NotImplementedError


@dataclass(frozen=True)
class TableStudy(Study):
    """What gives one table of each mechanism."""

    title = ""
    """What the table is called in a workbook and a report."""
    one_blank_row = True

    def result(self, case: Case) -> Result:
        """The result of one mechanism, in every form."""
        assert isinstance(case, TableCase)
        document: Document = case.document()
        return Result(
            document=lambda: {"name": case.name, **document},
            tables={self.title: case.table, **case.further()},
            notes=lambda: case.name,
            figure=case.figure if case.is_drawn else None,
            method=self.method,
            warnings=case.warnings(),
        )


# --- tables of many variants: the same columns for all, one below the other ----
def length(table: Table) -> int:
    """How many rows a table has."""
    return len(table.columns[0].values) if table.columns else 1


def like(pattern: Table, table: Table) -> Table:
    """A table with the columns of the first."""
    columns = {c.header: c for c in table.columns}
    empty: list[Cell] = [None] * length(table)
    return Table(
        [columns.get(c.header) or Column(c.name, c.unit, empty) for c in pattern.columns], pattern.keys
    )


def emptied(pattern: Table) -> Table:
    """The rows of a variant that cannot be assembled: what names them stays."""
    return Table(
        [
            c if c.header in pattern.keys else Column(c.name, c.unit, [None] * len(c.values))
            for c in pattern.columns
        ],
        pattern.keys,
    )


def without_bounds(table: Table) -> Table:
    """A table without the bounds of its errors."""
    return replace(table, columns=[replace(c, error=None) for c in table.columns])


def joined(tables: Sequence[Table]) -> Table:
    """Tables of the same columns, one below the other."""
    if len(tables) == 1:
        return tables[0]

    def bounds(parts: Sequence[Column]) -> Iterator[float]:
        for part in parts:
            # a variant that is not assembled has no numbers, and no bounds of them
            yield from [0.0] * len(part.values) if part.error is None else part.error()

    def column(*parts: Column) -> Column:
        error = None if all(part.error is None for part in parts) else lambda: list(bounds(parts))
        return replace(parts[0], values=[value for part in parts for value in part.values], error=error)

    return replace(tables[0], columns=list(map(column, *(table.columns for table in tables))))


def blank(part: Any, key: str = "") -> Any:
    """Poses that are not assembled, in the form of others: what names them stays."""
    if isinstance(part, dict):
        return {key: blank(value, key) for key, value in part.items()}
    if isinstance(part, list):
        return [] if key == "marks" else [blank(each, key) for each in part]
    if isinstance(part, bool):
        return False
    return part if isinstance(part, str) or key in ("input_deg", "input_m", "branch") else None
