"""Results out: an aligned table, CSV, JSON, a picture; never a partly written file."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cli.errors import DataError, one_line

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def suffix_among(*suffixes: str) -> Callable[[Path | None], Path | None]:
    """The callback of an option that names a file: its suffix is one of these."""

    def check(path: Path | None) -> Path | None:
        if path is not None and path.suffix.lower() not in suffixes:
            raise typer.BadParameter(f"'{path}' has no known suffix: expected {', '.join(suffixes)}")
        return path

    return check


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
    """A result in every form it can be shown in."""

    document: Callable[[], dict[str, Any]]
    """The JSON document, without its warnings; built only when asked for."""
    columns: Columns
    """The CSV: column name -> values, all of one length; strings are keys, None an empty cell."""
    keys: Sequence[str] = ()
    """The columns that name a row."""
    table: Callable[[], Columns] | None = None
    """The terminal's table, where another layout reads better than that of the CSV."""
    notes: Callable[[], str] = lambda: ""
    """What the terminal shows above the table."""
    afterword: Callable[[], str] = lambda: ""
    """What the terminal shows below the table."""
    figure: Callable[[], Figure] | None = None
    errors: Callable[[], Columns] = dict
    """Bounds of the rounding errors of the columns of computed numbers, in their units."""
    table_errors: Callable[[], Columns] | None = None
    """The same of the terminal's table, where its rows are others."""
    warnings: list[str] = field(default_factory=list)


def show(
    shown: Shown,
    *,
    json: bool = False,
    output: Path | None = None,
    plot: Path | None = None,
    expect: Path | None = None,
    rtol: float = 1e-3,
    text: bool = False,
    digits: bool = False,
    beside: Mapping[Path, bytes] | None = None,
) -> None:
    """Write the files asked for and those `beside` them, print the result, end with status 1 if an expectation is not met."""
    report = None
    if expect is not None:
        from cli.show.expect import compare

        report = compare(shown.columns, shown.keys, str(expect), rtol, other=shown.table)
        checked = f"{table_text(report.columns)}\n{report.summary}"
    if digits:
        shown = _with_digits_that_hold(shown)
    for path, data in (beside or {}).items():
        write(path, data)
    if plot is not None and shown.figure is not None:
        write(plot, _picture(shown.figure, plot.suffix.lower()[1:]))
    if output is not None:
        if output.suffix.lower() == ".json":
            write(output, (part.encode() for part in _json(shown)))
        else:
            write(output, csv_text(shown.columns).encode())
    for warning in shown.warnings:
        print(f"warning: {one_line(warning)}", file=sys.stderr)
    if json:
        sys.stdout.writelines(_json(shown))
        if report is not None:
            print(checked, file=sys.stderr)
    elif report is not None:
        print(checked)
    elif text or (sys.stdout.isatty() and output is None):
        columns = shown.columns if shown.table is None else shown.table()
        sys.stdout.write(_paragraphs(shown.notes(), table_text(columns), shown.afterword()))
    elif output is None:
        sys.stdout.write(csv_text(shown.columns))
    sys.stdout.flush()
    if report is not None and not report.passed:
        raise typer.Exit(1)


def write(path: Path, data: bytes | Iterable[bytes]) -> None:
    """Write a file whole or not at all; `data` may come in parts."""
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        try:
            with partial.open("wb") as stream:
                stream.writelines([data] if isinstance(data, bytes) else data)
            os.replace(partial, path)
        finally:
            partial.unlink(missing_ok=True)
    except OSError as error:
        raise DataError(f"{path}: cannot write: {error.strerror or error}") from None


def csv_text(columns: Columns) -> str:
    """Return CSV with every digit of every number."""
    import csv

    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*map(_plain_column, columns.values()), strict=True))
    return stream.getvalue()


def _plain_column(column: Sequence[Any]) -> Sequence[Any]:
    """Return a column's cells as CSV writes them, a numpy array of finite numbers in one step."""
    array: Any = column
    if hasattr(array, "dtype") and array.dtype.kind == "f" and (array == array).all():
        values: list[float] = array.tolist()
        return values
    return [_plain(value) for value in column]


def _plain(value: Any) -> Any:
    """Return a cell as CSV writes it: numpy's numbers as Python's, yes and no as JSON spells them."""
    value = value.item() if hasattr(value, "item") else value
    if value is None or value != value:
        return ""
    return str(value).lower() if isinstance(value, bool) else value


def _with_digits_that_hold(shown: Shown) -> Shown:
    """Cut the CSV's columns, and those of the terminal's table that bear the same names."""
    errors, table = shown.errors(), shown.table
    of_table = errors if shown.table_errors is None else shown.table_errors()
    unknown = sum(sum(error == float("inf") for error in column) for column in (errors or of_table).values())
    noted = f"--digits: of {unknown} numbers no digit is known to hold; their cells are empty"
    return replace(
        shown,
        warnings=[*shown.warnings, *([noted] if unknown else [])],
        columns=digits_that_hold(shown.columns, errors),
        table=None if table is None else lambda: digits_that_hold(table(), of_table),
    )


def digits_that_hold(columns: Columns, errors: Columns) -> Columns:
    """Return columns with each number that has an error cut to the digits before it; none where no digit is known."""
    return {
        name: [
            _below_a_turn(name, _cut(value, error)) for value, error in zip(column, errors[name], strict=True)
        ]
        if name in errors
        else column
        for name, column in columns.items()
    }


def _below_a_turn(name: str, value: Any) -> Any:
    """Return an angle that was rounded up to a full turn as 0: output angles lie in [0, 360)."""
    return 0.0 if name.endswith("_deg") and value == 360 else value


def _cut(value: Any, error: float) -> Any:
    from math import floor, inf, log10

    if error == inf:
        return None  # no digit is known
    if value is None or not value or not error > 0:
        return value

    digits = floor(log10(abs(value) / error)) if error < abs(value) else 0
    return float(f"{value:.{min(digits, 17) - 1}e}") if digits > 0 else 0.0


def table_text(columns: Columns) -> str:
    """Return an aligned table, numbers to 6 significant digits and to the right, names to the left."""
    printed = []
    for name, column in columns.items():
        values = [_plain(value) for value in column]
        cells = [_six_digits(name, value) if isinstance(value, float) else str(value) for value in values]
        width = max(map(len, [name, *cells]))
        left = any(isinstance(value, str) and value for value in values)
        printed.append([cell.ljust(width) if left else cell.rjust(width) for cell in [name, *cells]])
    return "".join("  ".join(row).rstrip() + "\n" for row in zip(*printed, strict=True))


def _six_digits(name: str, value: float) -> str:
    cell = f"{value:.6g}"
    return "0" if cell == "360" and value < 360 and name.endswith("_deg") else cell


def _paragraphs(*parts: str) -> str:
    return "\n".join(part.rstrip("\n") + "\n" for part in parts if part)


def _json(shown: Shown) -> Iterator[str]:
    """Yield the document in parts: the text of a long sweep is three times the size of its numbers."""
    import json

    encoder = json.JSONEncoder(
        ensure_ascii=False, indent=1, allow_nan=False, default=lambda array: array.tolist()
    )
    yield from encoder.iterencode({**shown.document(), "warnings": shown.warnings})
    yield "\n"


def _picture(draw: Callable[[], Figure], suffix: str) -> bytes:
    try:
        import matplotlib
    except ImportError:
        raise DataError(
            "--plot needs matplotlib: install dalembert with its extra, dalembert[plot]"
        ) from None
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "dalembert"  # the same picture is the same file
    stream = io.BytesIO()
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(suffix)
    draw().savefig(stream, format=suffix, dpi=150, metadata=metadata)
    return stream.getvalue()
