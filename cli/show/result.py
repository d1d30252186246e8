"""What a command has computed, in every form it can be shown in; its tables say what it holds (`dalembert.results`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, NamedTuple

from dalembert.dataclass import dataclass, field, replace
from dalembert.results.columns import Table, document

if TYPE_CHECKING:
    from pathlib import Path
    from typing import TypeAlias

    from matplotlib.figure import Figure

    from cli.read.root_search import Found
    from cli.show.bars import Bars
    from dalembert.results.columns import Document, Json
    from dalembert.results.way import Topic

    # of a table, or of a list of the JSON document; and what is written of it
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
    """Whether it is for who wants to know how: set small, so that it stays one page."""


@dataclass(eq=False, repr=False)
class Result:
    """The result of a command, in every form it can be shown in; each is formed on request."""

    document: Callable[[], Document] | None = None
    """The JSON document without its warnings, where it is not that of the tables."""
    tables: Mapping[str, Callable[[], Table]] = field(default_factory=dict)
    """Name -> table; the first is the CSV."""
    head: Mapping[str, Json] = field(default_factory=dict)
    """The top of the JSON document, in front of the tables."""
    companions: Sequence[str] = ()
    """Which further tables go beside a file that holds one table, as FILE-name.csv."""
    screen: Callable[[], Table] | None = None
    """The terminal's table, where another layout reads better than that of the CSV."""
    expected: Sequence[Callable[[], Table]] = ()
    """Further tables whose columns a file of expected values may have."""
    notes: Callable[[], str] = lambda: ""
    """What the terminal shows above the table."""
    afterword: Callable[[], str] = lambda: ""
    """What the terminal shows below the table."""
    aside: Callable[[], Sequence[str]] = lambda: ()
    """What else was asked for and stands in no table: told on standard error where the table alone is shown."""
    figure: Callable[[], Figure] | None = None
    method: str = ""
    """How it was found, and after whom: for the report."""
    sheets: Callable[[], Iterable[Sheet]] | None = None
    """What the report shows, where that is more than the notes, the tables, the afterword and the picture."""
    shows_input: bool = False
    """Whether the sheets show what the tables that were read hold."""
    about: Mapping[str, str] = field(default_factory=dict)
    """What the file itself says for the head of the report."""
    beside: Mapping[Path, Callable[[], bytes | Iterable[bytes]]] = field(default_factory=dict)
    """Files that options of the command itself ask for."""
    warnings: list[str] = field(default_factory=list)
    failed: Callable[[], bool] = lambda: False
    """Whether nothing that was requested could be computed: status 1, once all is shown."""
    blocks: Callable[[Form], Iterator[Written]] | None = None
    """The table or the JSON's list in parts, where it is too long to be held: nothing else is written then.

    Whoever works a part out, perhaps another process, makes what is written of it too.
    """
    shared: bool = False
    """Whether the parts are worked out by several processes."""
    blocks_name: str = "poses"
    """What the table in parts is called, or the list in JSON, which stands behind what else is in the document."""
    within: Callable[[], AbstractContextManager[None]] = nullcontext
    """What the forms are made within: it turns errors of a library into messages for the user."""
    way: Callable[[], Sequence[Topic]] | None = None
    """The worked solution, formed with --steps alone."""
    shows_way: bool = False
    """Whether it is asked for."""
    toml: Callable[[], bytes] | None = None
    """The mechanism's file that was found, for -o FILE.toml."""
    late_warnings: Callable[[], list[str]] = list
    """What there is to say once all parts are written."""

    def documented(self) -> Document:
        """Return the JSON document, without its warnings."""
        if self.document is not None:
            whole = self.document()
        else:
            whole = {**self.head, **document(table() for table in self.tables.values())}
        if self.shows_way and self.way is not None:
            whole = {**whole, "way": [topic.documented() for topic in self.way()]}
        return whole


def with_found(result: Result, solution: Found) -> Result:
    """Return the result with the number of --find: above the table, in JSON, in addition to a table alone."""
    notes, document, aside = result.notes, result.documented, result.aside
    return replace(
        result,
        notes=lambda: "\n".join(filter(None, (notes(), f"found: {solution.text}"))),
        document=lambda: {**document(), "found": {solution.header: solution.value}},
        aside=lambda: [*aside(), f"found: {solution.text}"],
    )
