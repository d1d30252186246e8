"""A study that gives one table of each mechanism, whatever its inputs: what it is, where it rests, how it moves when released."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cli.cases.loop import Case, Study
from cli.show.result import Result
from dalembert.results.columns import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from dalembert.results.columns import Document


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

    def words(self) -> str:
        """What a terminal shows below the table."""
        return ""

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
            tables={self.title: case.table},
            notes=lambda: case.name,
            afterword=case.words,
            figure=case.figure if case.is_drawn else None,
            method=self.method,
            warnings=case.warnings(),
        )
