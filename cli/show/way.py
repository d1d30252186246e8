"""The worked solution on the terminal and in the report."""

from __future__ import annotations

from shutil import get_terminal_size
from typing import TYPE_CHECKING

from cli.show.in_units import chosen_units, in_units
from cli.show.result import Section, Sheet
from dalembert.results.columns import Table
from dalembert.results.text import table_text

if TYPE_CHECKING:
    from cli.show.result import Result
    from dalembert.results.way import Topic

ROWS = 72
"""Rows of a table that a terminal shows."""


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
                lines.append(_shown(part if chosen is None else in_units(part, chosen), width))
        lines.append("")
    return "\n".join(lines)


def _shown(table: Table, width: int | None) -> str:
    cells = {header: values[:ROWS] for header, values in table.cells.items()}
    more = f"… and {table.length - ROWS} further rows\n" if table.length > ROWS else ""
    above = f"{table.above}\n" if table.above else ""
    return f"{above}{table_text(cells, table.keys, width)}{more}{table.below}".rstrip("\n")


def way_sheets(result: Result) -> list[Sheet]:
    """Return the pages of the report that hold the way: a picture ends its page."""
    assert result.way is not None
    sheets: list[Sheet] = []
    open_topics: list[Topic] = []

    def close() -> None:
        if open_topics:
            title = "" if sheets else "The way"
            sections = [Section(topic.heading, _with_sentences(topic)) for topic in open_topics]
            sheets.append(Sheet(title, sections, open_topics[-1].figure))
            open_topics.clear()

    for topic in result.way():
        open_topics.append(topic)
        if topic.figure is not None:
            close()
    close()
    return sheets


def _with_sentences(topic: Topic) -> list[str | Table]:
    parts: list[str | Table] = []
    for part in topic.parts:
        parts += [part.above, part, part.below] if isinstance(part, Table) else [part]
    return parts
