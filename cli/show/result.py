"""What a command has computed, in every form it can be shown in; its tables say what it holds (`dalembert.results`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from shutil import get_terminal_size
from typing import TYPE_CHECKING, NamedTuple

from cli.read.options import bad
from dalembert.dataclass import dataclass, field, replace
from dalembert.decimals import Scaled
from dalembert.hints import nearest
from dalembert.results.columns import Table, document
from dalembert.units import UNITS, dimensions, find_unit, from_si, to_si, unit_name

if TYPE_CHECKING:
    from pathlib import Path
    from typing import TypeAlias

    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from cli.read.root_search import Found
    from dalembert.results.columns import Column, Document, Json, Values
    from dalembert.results.way import Topic

    Part: TypeAlias = "Table | list[Document]"
    Form = Callable[[Part, int], "Written"]


BLOCKS = 24
BARS_STYLE = """
.bars { display: grid; grid-template-columns: fit-content(42%) 1fr max-content; gap: .8mm 2mm; align-items: center; margin: 2mm 0; font-size: 9pt }
.bars span:nth-child(3n) { font-variant-numeric: tabular-nums; text-align: right } .track { position: relative; display: block; height: 3.4mm; background: #f2f2f2 }
.track i, .track u { position: absolute; top: 0; bottom: 0; print-color-adjust: exact; -webkit-print-color-adjust: exact } .track i { left: 0; background: #8a8a8a }
.track i.after { background: #06632f } .track i.over { background: #b00020 } .track u { width: .4mm; background: #b00020; top: -.6mm; bottom: -.6mm }
"""


@dataclass(frozen=True, eq=False, repr=False)
class Bar:
    """A bar: its label, how long it is, and the number beside it."""

    label: str
    value: float
    text: str
    after: bool
    """Whether it shows what was made of the first one."""


@dataclass(frozen=True, eq=False, repr=False)
class Bars:
    """Bars of one scale, with the limit that they are held against."""

    rows: Sequence[Bar]
    limit: float | None = None
    limit_text: str = ""

    @property
    def _whole(self) -> float:
        return max([row.value for row in self.rows] + [1.1 * (self.limit or 0.0)]) or 1.0

    def html(self) -> str:
        """Return them as HTML."""
        import html

        cells = []
        for row in self.rows:
            over = self.limit is not None and row.value > self.limit * (1 + 1e-9)
            kind = f' class="{"over" if over else "after"}"' if row.after else ""
            line = "" if self.limit is None else f'<u style="left:{100 * self.limit / self._whole:.2f}%"></u>'
            cells.append(
                f'<span>{html.escape(row.label)}</span><span class="track"><i{kind} style="width:{100 * row.value / self._whole:.2f}%">'
                f"</i>{line}</span><span>{html.escape(row.text)}</span>"
            )
        note = f"<p>{html.escape(self.limit_text)}</p>\n" if self.limit_text else ""
        return f'<div class="bars">{"".join(cells)}</div>\n{note}'

    def text(self) -> str:
        """Return them as lines of blocks, in a fixed width."""
        wide = max(len(row.label) for row in self.rows)
        lines = [
            f"{row.label:<{wide}}  {'█' * round(BLOCKS * row.value / self._whole) or '▏'} {row.text}"
            for row in self.rows
        ]
        return "\n".join([*lines, *([self.limit_text] if self.limit_text else [])])


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


def with_found(result: Result, solution: Found) -> Result:
    """Return the result with the number of --find: above the table, in JSON, in addition to a table alone."""
    notes, document, aside = result.notes, result.documented, result.aside
    return replace(
        result,
        notes=lambda: "\n".join(filter(None, (notes(), f"found: {solution.text}"))),
        document=lambda: {**document(), "found": {solution.header: solution.value}},
        aside=lambda: [*aside(), f"found: {solution.text}"],
    )


# amplitudes keep the unit they were measured in, and what is per such a unit with them
_DIMENSIONS = [dimension for dimension in UNITS if dimension not in ("number", "amplitude", "per")]
_MEASURED = ("amplitude", "magnitude")


def chosen_units(text: str) -> dict[str, str]:
    """Read `mm,g,deg,N_mm,rpm`: dimension -> unit.

    Raises
    ------
    typer.BadParameter
        An unknown unit, or two of one dimension.
    """
    chosen: dict[str, str] = {}
    for part in text.split(","):
        word = unit_name(part)
        fitting = {d: unit for d in _DIMENSIONS if (unit := find_unit(d, word))}
        if not any(unit in UNITS[d] for d, unit in fitting.items()) and dimensions(word):
            # a unit of vibration, such as mil
            fitting = {}
        if not word or not fitting:
            units = sorted({unit for d in _DIMENSIONS for unit in UNITS[d]})
            hint = (
                f"; '{word}' is a unit of amplitude, and amplitudes keep the file's"
                if dimensions(word)
                else nearest(word, units)
            )
            raise bad(
                "--units",
                f"'{part.strip()}' is no unit of a column: expected units such as mm,g,deg,N_mm,rpm{hint}",
            )
        for dimension, unit in fitting.items():
            if chosen.setdefault(dimension, unit) != unit:
                both = f"{chosen[dimension]} and {unit}"
                raise bad("--units", f"{both} are both units of {dimension}: expected one of them")
    return chosen


def in_units(table: Table, chosen: Mapping[str, str]) -> Table:
    """Return the table with its columns in the units chosen, as far as they fit."""
    columns = [_in_unit(column, chosen) for column in table.columns]
    renamed = {old.header: new.header for old, new in zip(table.columns, columns, strict=True)}
    return replace(table, columns=columns, keys=[renamed.get(key, key) for key in table.keys])


def finished(table: Table, units: str | None, digits: bool) -> tuple[Table, int]:
    """Return the table in the chosen units, with --digits cut to its right digits, and the number of those without a right digit."""
    if units is not None:
        table = in_units(table, chosen_units(units))
    if not digits:
        return table, 0
    # loaded where --digits needs it
    from dalembert.results.digits import digits_that_hold

    return digits_that_hold(table)


def _in_unit(column: Column, chosen: Mapping[str, str]) -> Column:
    fits = [d for d in _DIMENSIONS if d in chosen and find_unit(d, column.unit) == column.unit]
    if not fits or chosen[fits[0]] == column.unit or column.name.startswith(_MEASURED):
        return column
    dimension = fits[0]
    old, new, error = column.unit, chosen[dimension], column.error

    def convert(value: Scaled) -> Scaled:
        return from_si(to_si(value, dimension, old), dimension, new)

    def cells(values: Values) -> Values:
        if not isinstance(values, Sequence):
            return convert(values)
        return [
            value if value is None or isinstance(value, str) else convert(float(value)) for value in values
        ]

    def errors() -> Sequence[float] | NDArray[np.float64]:
        import numpy as np

        assert error is not None
        return convert(np.asarray(error(), dtype=float))

    return replace(column, unit=new, values=cells(column.values), error=None if error is None else errors)


WAY_ROWS = 72
"""Rows of a table of the worked solution that a terminal shows."""


def way_text(result: Result, units: str | None, terminal: bool) -> str:
    """Return the topics as text, one below the other."""
    assert result.way is not None
    chosen = None if units is None else chosen_units(units)
    width = get_terminal_size().columns if terminal else None
    lines = [""]
    for topic in result.way():
        lines += [topic.heading, "-" * len(topic.heading)]
        for part in topic.parts:
            if isinstance(part, str):
                lines.append(part.rstrip("\n"))
            elif part.columns and part.length:
                table = part if chosen is None else in_units(part, chosen)
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
