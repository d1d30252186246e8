"""What a command has computed, in every form it can be shown in; its tables say what it holds (`dalembert.results`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from shutil import get_terminal_size
from typing import TYPE_CHECKING, NamedTuple

from dalembert.dataclass import dataclass, field
from dalembert.results.chosen_units import in_units
from dalembert.results.columns import Table, document

if TYPE_CHECKING:
    from pathlib import Path
    from typing import TypeAlias

    from matplotlib.figure import Figure

    from dalembert.results.bars import Bars
    from dalembert.results.columns import Document, Json
    from dalembert.results.way import Topic

    Part: TypeAlias = "Table | list[Document]"
    Form = Callable[[Part, int], "Written"]


class Written(NamedTuple):
    """What is written of a part: its bytes, or the part as it is shown, or nothing where it has a file."""

    data: bytes | Part
    unknown: int
    """Of how many of its numbers --digits knows no digit."""


@dataclass(eq=False, repr=False)
class Section:
    """A part of a report below a heading of its own: paragraphs and tables."""

    title: str
    parts: Sequence[str | Table | Bars]


@dataclass(eq=False, repr=False)
class Sheet:
    """What begins a page of a report."""

    title: str
    sections: Sequence[Section]
    figure: Callable[[], Figure] | None = None
    dense: bool = False
    """Whether it is for readers who check the method: set small, to stay on one page."""


@dataclass(eq=False, repr=False)
class Result:
    """The result of a command, in every form it can be shown in; each is formed on request."""

    document: Callable[[], Document] | None = None
    """The JSON document without its warnings, where it is not that of the tables."""
    tables: Mapping[str, Callable[[], Table]] = field(default_factory=dict)
    """Name -> table; the first is the CSV."""
    head: Mapping[str, Json] = field(default_factory=dict)
    """The top of the JSON document, in front of the tables."""
    requested: Sequence[str] = ()
    """Which further tables an option requests: where the first table alone is shown, standard error has them in words."""
    companions: Sequence[str] = ()
    """Which further tables go beside a file that holds one table, as FILE-name.csv."""
    screen: Callable[[], Sequence[Table]] | None = None
    """The terminal's tables in place of the CSV's, where another layout reads better."""
    expected: Sequence[Callable[[], Table]] = ()
    """Further tables whose columns a file of expected values may have."""
    notes: Callable[[], str] = lambda: ""
    """What the terminal shows above the table."""
    afterword: Callable[[], str] = lambda: ""
    """What the terminal shows below the table."""
    aside: Callable[[], Sequence[str]] = lambda: ()
    """Requested results that stand in no table: lines for standard error, where the table alone is shown."""
    figure: Callable[[], Figure] | None = None
    plotted: Callable[[], Figure] | None = None
    """The picture of --plot, where it shows more than that of the report."""
    method: str = ""
    """The method and its source, for the report."""
    sheets: Callable[[], Iterable[Sheet]] | None = None
    """What the report shows, where that is more than the notes, the tables, the afterword and the picture."""
    shows_input: bool = False
    """Whether the sheets show what the tables that were read hold."""
    about: Mapping[str, str] = field(default_factory=dict)
    """What the file itself says for the head of the report."""
    beside: Mapping[Path, Callable[[], bytes | Iterable[bytes]]] = field(default_factory=dict)
    """Files that options of the command itself request."""
    warnings: list[str] = field(default_factory=list)
    failed: Callable[[], bool] = lambda: False
    """Whether nothing that was requested could be computed: status 1, once all is shown."""
    blocks: Callable[[Form], Iterator[Written]] | None = None
    """The table or the JSON's list in parts, where it is too long to be held: nothing else is written then.

    Whoever works a part out, perhaps another process, makes what is written of it too.
    """
    blocks_name: str = "poses"
    """What the table in parts is called, or the list in JSON, which stands behind what else is in the document."""
    within: Callable[[], AbstractContextManager[None]] = nullcontext
    """What the forms are made within: it turns errors of a library into messages for the user."""
    way: Callable[[], Sequence[Topic]] | None = None
    """The worked solution, formed with --steps alone."""
    shows_way: bool = False
    """Whether the worked solution is requested."""
    toml: Callable[[], bytes] | None = None
    """The file of the resulting mechanism, for -o FILE.toml."""
    late_warnings: Callable[[], list[str]] = list
    """Warnings that depend on all written parts."""

    def documented(self) -> Document:
        """Return the JSON document, without its warnings."""
        if self.document is not None:
            whole = self.document()
        else:
            whole = {**self.head, **document(table() for table in self.tables.values())}
        if self.shows_way and self.way is not None:
            whole = {**whole, "way": [topic.documented() for topic in self.way()]}
        return whole


WAY_ROWS = 72
"""Rows of a table of the worked solution that a terminal shows."""


def way_text(result: Result, units: Mapping[str, str] | None, terminal: bool) -> str:
    """Return the topics as text, one below the other."""
    assert result.way is not None
    width = get_terminal_size().columns if terminal else None
    lines = [""]
    for topic in result.way():
        lines += [topic.heading, "-" * len(topic.heading)]
        for part in topic.parts:
            if isinstance(part, str):
                lines.append(part.rstrip("\n"))
            elif part.columns and part.length:
                table = part if units is None else in_units(part, units)
                lines.append(table_block(table, width, WAY_ROWS).rstrip("\n"))
        lines.append("")
    return "\n".join(lines)


def table_block(table: Table, width: int | None, rows: int | None = None, title: str = "") -> str:
    """Return a table as a terminal shows it, its sentences above and below; of a long one the first rows."""
    from dalembert.results.text import table_text, without_noise

    if title and table.columns and not table.length:
        return f"{title.removesuffix(':')}: none\n"
    shown = zip(table.columns, without_noise(table.columns), strict=True)
    cells = {column.header: values[:rows] for column, values in shown}
    more = f"… and {table.length - rows} further rows" if rows and table.length > rows else ""
    parts = (title or table.above, table_text(cells, table.keys, width), more, table.below)
    return "".join(part.rstrip("\n") + "\n" for part in parts if part)


def way_sheets(result: Result) -> list[Sheet]:
    """Return the pages of the report that hold the way: a picture ends its page."""
    assert result.way is not None
    sheets: list[Sheet] = []
    open_topics: list[Topic] = []

    def close() -> None:
        if open_topics:
            title = "" if sheets else "Worked solution"
            sections = [Section(topic.heading, with_sentences(topic.parts)) for topic in open_topics]
            sheets.append(Sheet(title, sections, open_topics[-1].figure))
            open_topics.clear()

    for topic in result.way():
        open_topics.append(topic)
        if topic.figure is not None:
            close()
    close()
    return sheets


def with_sentences(parts: Iterable[str | Table]) -> list[str | Table]:
    """Return parts of a report, each table between the sentences above and below it."""
    return [
        each
        for part in parts
        for each in ((part.above, part, part.below) if isinstance(part, Table) else (part,))
    ]
