"""Tables as text for other documents: Markdown, LaTeX."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from dalembert.results.text import Grid, has_names, printed

if TYPE_CHECKING:
    from dalembert.results.columns import Table


def handed_on(suffix: str, tables: Mapping[str, Table], warnings: list[str]) -> bytes:
    """Return the file of this suffix: all tables, each with its name where there are several."""
    form: Callable[[Grid], str] = {".md": markdown, ".tex": _latex}[suffix]
    title = {".md": "## {}\n\n", ".tex": "% {}\n"}[suffix]
    several = len(tables) > 1
    parts = [title.format(name) * several + form(_grid(table)) for name, table in tables.items()]
    remarks = {
        ".md": [f"- {text}\n" for text in warnings],
        ".tex": [f"% {text}\n" for text in warnings],
    }[suffix]
    return "\n".join([*parts, *(["".join(remarks)] if remarks else [])]).encode()


def _grid(table: Table) -> Grid:
    texts = (printed(name, values) for name, values in table.cells.items())
    rows = [list(row) for row in zip(*texts, strict=True)]
    return Grid(list(table.cells), rows, [not has_names(values) for values in table.cells.values()])


def markdown(grid: Grid) -> str:
    """A table in Markdown."""
    header, rows, numbers = grid

    def line(row: list[str]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |\n"

    rule = ["---:" if number else "---" for number in numbers]
    return "".join(map(line, [header, rule, *rows]))


_LATEX = {**{c: f"\\{c}" for c in "&%$#_{}"}, "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}


def _latex(grid: Grid) -> str:
    """A tabular, to be put into a document by `\\input`."""
    header, rows, numbers = grid

    def escaped(cell: str) -> str:
        return re.sub(r"[&%$#_{}~^]", lambda found: _LATEX[found.group()], cell.replace("\\", "/"))

    def line(row: list[str]) -> str:
        return " & ".join(map(escaped, row)) + r" \\" + "\n"

    form = "".join("r" if number else "l" for number in numbers)
    body = f"\\hline\n{line(header)}\\hline\n{''.join(map(line, rows))}\\hline\n"
    return f"\\begin{{tabular}}{{{form}}}\n{body}\\end{{tabular}}\n"
