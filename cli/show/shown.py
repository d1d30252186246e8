"""A result as columns by header with their bounds beside them: what has not yet become a `Result`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.show.columns import Column, Result, Table
from cli.show.output import ShowOptions, suffix_among
from cli.show.output import show as show_result

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# The options that every command shares.
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document, SI units, full precision.")]
Output = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="FILE",
        help="Write the result to FILE (.csv or .json).",
        callback=suffix_among(".csv", ".json"),
    ),
]
Plot = Annotated[
    Path | None,
    typer.Option(
        "--plot",
        metavar="FILE",
        help="Write a picture to FILE (.svg, .png or .pdf).",
        callback=suffix_among(".svg", ".png", ".pdf"),
    ),
]
Expect = Annotated[
    Path | None,
    typer.Option(
        "--expect",
        metavar="FILE.csv",
        help="Check the result against expected values under the same column names.",
    ),
]
Rtol = Annotated[
    float, typer.Option("--rtol", min=0.0, help="Relative tolerance of --expect (for angles: radians).")
]
Text = Annotated[bool, typer.Option("--text", help="Print the aligned table even into a pipe.")]

Digits = Annotated[
    bool, typer.Option("--digits", help="In tables and CSV print only the digits that hold against rounding.")
]

Columns = Mapping[str, Sequence[Any]]


@dataclass(frozen=True)
class Shown:
    document: Callable[[], dict[str, Any]]
    columns: Columns
    keys: Sequence[str] = ()
    table: Callable[[], Columns] | None = None
    notes: Callable[[], str] = lambda: ""
    afterword: Callable[[], str] = lambda: ""
    figure: Callable[[], Figure] | None = None
    errors: Callable[[], Columns] = dict
    table_errors: Callable[[], Columns] | None = None
    warnings: list[str] = field(default_factory=list)


def show(shown: Shown, *, beside: Mapping[Path, bytes] | None = None, **options: Any) -> None:
    errors = cache(shown.errors)
    table_errors = errors if shown.table_errors is None else cache(shown.table_errors)

    def of(columns: Columns, errors: Callable[[], Columns] = errors) -> Table:
        found = errors() if options.get("digits") else {}
        return Table(
            [
                Column(
                    name.removesuffix("_deg"),
                    "deg" * name.endswith("_deg"),
                    values,
                    _of(found, name),
                )
                for name, values in columns.items()
            ],
            shown.keys,
        )

    table = shown.table
    show_result(
        Result(
            document=shown.document,
            tables={"": lambda: of(shown.columns)},
            screen=None if table is None else lambda: of(table(), table_errors),
            notes=shown.notes,
            afterword=shown.afterword,
            figure=shown.figure,
            beside={path: lambda data=data: data for path, data in (beside or {}).items()},  # type: ignore[misc]
            warnings=shown.warnings,
        ),
        ShowOptions(**options),
    )


def _of(found: Columns, name: str) -> Callable[[], Sequence[Any]] | None:
    return (lambda: found[name]) if name in found else None
