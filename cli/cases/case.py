"""What a command does with every mechanism: its case, and its study; those of a single table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar
from uuid import uuid4

import numpy as np

from cli.cases.axes import Grid
from cli.cases.inputs import of_one
from cli.cases.rows import joined
from cli.cases.values import Driven, Varied, with_numbers
from cli.show.result import Result
from dalembert.dataclass import dataclass, field
from dalembert.results.columns import Table
from dalembert.results.columns import document as result_document
from virtualwork import MechanismError

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.cases.analysis import Request
    from cli.cases.inputs import InputGrid, Inputs
    from cli.cases.together import Together
    from cli.show.commands import ShowOptions
    from dalembert.results.columns import Document
    from dalembert.results.way import Topic
    from virtualwork import Mechanism
    from virtualwork.describe.dimensions import Dimension

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
    key : str
        By which a process finds what it has prepared for it.
    """

    request: Request
    mechanism: Mechanism
    bare: dict[str, str]
    digits: bool
    json: bool
    names: tuple[Driven | Varied, ...] = ()
    moved: Grid | None = None
    key: str = field(default_factory=lambda: uuid4().hex)

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
        poses = 1 if self.moved is None else self.moved.n
        rows = TOGETHER[json] if together else ONE_BY_ONE[1][json]
        most = rows if together else ONE_BY_ONE[0]
        return max(1, min(most, rows // poses))

    # --- variants -------------------------------------------------------------------------------------------------
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
