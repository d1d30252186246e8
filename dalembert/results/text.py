"""Results as text: CSV and JSON with every digit, an aligned table with six."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from json.encoder import encode_basestring as _quoted
from math import floor, isfinite, log10
from typing import TYPE_CHECKING, Any, NamedTuple

from dalembert.results.columns import Column, Table
from dalembert.units import written

if TYPE_CHECKING:
    from dalembert.results.columns import Document, Json, Values

GOOD, BAD = ("ok", "within", "stable"), ("WRONG", "beyond", "unstable")
"""Verdicts, as they stand in cells and sentences."""


class Grid(NamedTuple):
    """A table as it is printed: a header and rows of text, and which columns are numbers, to the right."""

    header: list[str]
    rows: list[list[str]]
    numbers: list[bool]


def csv_text(columns: Mapping[str, Values], header: bool = True) -> str:
    """Return CSV with every digit of every number; without its header for a further part of a table."""
    import csv

    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    if header:
        writer.writerow(columns)
    writer.writerows(zip(*map(_plain_column, columns.values()), strict=True))
    return stream.getvalue()


def _plain_column(column: Values) -> Sequence[object]:
    """Return a column's cells as CSV writes them: a numpy array of numbers, or names alone, in one step."""
    if not isinstance(column, Sequence) and column.dtype.kind == "f":
        numbers: list[float] = column.tolist()
        return numbers if (column == column).all() else ["" if x != x else x for x in numbers]
    if isinstance(column, list) and set(map(type, column)) == {str}:
        return column
    return [plain(value) for value in column]


def plain(value: object) -> str | float:
    """Return a cell as CSV writes it: numpy's numbers as Python's, yes and no as JSON spells them."""
    value = value.item() if hasattr(value, "item") else value
    if value is None or value != value:
        return ""
    return str(value).lower() if isinstance(value, bool) else value  # type: ignore[return-value]


def printed(name: str, column: Values) -> list[str]:
    """Return a column's cells as they are shown: numbers to 6 significant digits."""
    values = [plain(value) for value in column]
    return [_six_digits(name, value) if isinstance(value, float) else str(value) for value in values]


NOISE = 1e-12
"""Of the largest number of a column, or of a vector's components: what is smaller is what rounding left of 0."""


def without_noise(columns: Sequence[Column]) -> list[Values]:
    """Return the values of columns as people read them: what rounding left of 0 is 0.

    Components x, y and z of one vector have one size. Numbers without a unit may be of several quantities, which say nothing of
    each other.

    >>> without_noise([Column("x", "m", [0.04, 2.4e-18, None]), Column("y", "m", [2.4e-18] * 3)])
    [[0.04, 0.0, None], [0.0, 0.0, 0.0]]
    >>> without_noise([Column("x", "m", [0.04]), Column("error", "m", [2.4e-18]), Column("ratio", "", [4.0, 2.4e-18])])
    [[0.04], [2.4e-18], [4.0, 2.4e-18]]
    """
    largest: dict[tuple[str, str], float] = {}
    keys = [(c.name[:-1] if c.name.endswith(("x", "y", "z")) else c.name, c.unit) for c in columns]
    for key, column in zip(keys, columns, strict=True):
        sizes = (abs(v) for v in column.values if isinstance(v, float) and isfinite(v))
        largest[key] = max(largest.get(key, 0.0), max(sizes, default=0.0))
    return [
        [0.0 if isinstance(v, float) and abs(v) < NOISE * largest[key] else v for v in column.values]
        if column.unit
        else column.values
        for key, column in zip(keys, columns, strict=True)
    ]


def table_text(columns: Mapping[str, Values], keys: Sequence[str] = (), width: int | None = None) -> str:
    """Return an aligned table, numbers to the right, names to the left.

    What is wider than `width` is laid out in blocks one below the other, each with the key columns in front.
    """
    laid: dict[str, list[str]] = {}
    for name, column in columns.items():
        cells = [name, *printed(name, column)]
        longest = max(map(len, cells))
        aligned = str.ljust if has_names(column) else str.rjust
        laid[name] = [aligned(cell, longest) for cell in cells]
    return "\n".join(
        "".join("  ".join(row).rstrip() + "\n" for row in zip(*(laid[name] for name in block), strict=True))
        for block in in_blocks({name: len(cells[0]) for name, cells in laid.items()}, keys, width)
    )


def as_list(table: Table) -> Table:
    """Return a table of one row as a list: a row for each quantity, its value and unit.

    >>> narrow = as_list(Table([Column("static_unbalance", "g_mm", [2.0])]))
    >>> print(table_text(narrow.cells, narrow.keys, 26))
    quantity          value
    static unbalance  2
    <BLANKLINE>
    quantity          unit
    static unbalance  g·mm
    <BLANKLINE>
    >>> as_list(Table([Column("magnitude_per", "g", [2.0])])).cells
    {'quantity': ['magnitude per g'], 'value': ['2'], 'unit': ['']}
    """
    texts = [printed(column.header, column.values)[0] for column in table.columns]
    names = [column.name.replace("_", " ") for column in table.columns]
    units = [written(column.unit) for column in table.columns]
    # a magnitude per g is not in g
    per = [name.endswith(" per") for name in names]
    return Table(
        [
            Column(
                "quantity", "", [f"{n} {u}" if p else n for n, u, p in zip(names, units, per, strict=True)]
            ),
            Column("value", "", texts),
            Column(
                "unit", "", ["" if p or t == "none" else u for t, u, p in zip(texts, units, per, strict=True)]
            ),
        ],
        ["quantity"],
        above=table.above,
        below=table.below,
    )


def has_names(column: Values) -> bool:
    """Whether a column holds names, which stand to the left."""
    return any(isinstance(value, str) and value for value in map(plain, column))


def in_blocks(widths: Mapping[str, int], keys: Sequence[str], width: int | None) -> list[list[str]]:
    """Part columns into blocks that are no wider than `width`, each with the key columns in front."""
    front = [name for name in widths if name in keys]
    blocks: list[list[str]] = [[]]
    for name in widths:
        last = blocks[-1]
        wide = sum(widths[other] + 2 for other in last) + widths[name]
        if width is not None and wide > width and len(last) > len(front) and name not in keys:
            blocks.append(list(front))
        blocks[-1].append(name)
    return blocks


def _six_digits(name: str, value: float) -> str:
    cell = f"{value:.6g}"
    return "0" if cell == "360" and value < 360 and name.endswith("_deg") else cell


def heading(name: str) -> str:
    """Return a table's name as a heading."""
    text = name.strip("-").replace("_", " ")
    return text[:1].upper() + text[1:]


def angle_text(degrees: float, spec: str) -> str:
    """Format an angle in [0, 360); what rounds to a full turn is 0."""
    text = format(float(degrees), spec)
    return format(0.0, spec) if float(text) == 360.0 else text


def paragraphs(*parts: str) -> str:
    """Join what is not empty with a blank line between."""
    return "\n".join(part.rstrip("\n") + "\n" for part in parts if part)


def with_uncertainty(value: float, uncertainty: float | None) -> str:
    """Write a number as people do: to the place of its uncertainty, which has two figures below 3, else one.

    Without one: four figures.

    >>> with_uncertainty(95.1234, 0.913), with_uncertainty(95.1234, 0.123), with_uncertainty(12345.6, 230.0)
    ('95.1 ± 0.9', '95.12 ± 0.12', '12350 ± 230')
    >>> with_uncertainty(2.01168, None), with_uncertainty(0.0, None), with_uncertainty(0.3, 0.0)
    ('2.012', '0', '0.3')
    """
    if uncertainty is None or not isfinite(uncertainty) or uncertainty <= 0:
        return f"{value:.4g}"
    place = floor(log10(uncertainty))
    two = float(f"{uncertainty / 10**place:.2g}") < 3
    last = place - two
    if round(uncertainty / 10**last) == 10 and not two:
        last += 1
    shown = (f"{round(number / 10**last) * 10**last:.{max(-last, 0)}f}" for number in (value, uncertainty))
    return " ± ".join(shown)


# -- JSON in parts ----------------------------------------------------------------------------------------

_LINE, _WORDS = "\n ", {None: "null", True: "true", False: "false"}


def json_parts(document: Document) -> Iterator[str]:
    """Yield a document in parts: the text of a long sweep is three times the size of its numbers."""
    for i, (name, value) in enumerate(document.items()):
        yield ",{"[not i]
        if isinstance(value, list) and value:
            yield f"{_LINE}{_quoted(name)}: ["
            for j, element in enumerate(value):
                yield json_elements([element], first=not j)
            yield f"{_LINE}]"
        else:
            yield json_members({name: value})
    yield "\n}\n" if document else "{}\n"


def json_members(document: Document, line: str = _LINE) -> str:
    """Return the text between the braces of a document, each member behind the beginning of its line."""
    return ",".join(
        [
            # numbers are most of it
            f"{line}{_quoted(name)}: {repr(value) if type(value) is float and value - value == 0 else _json(value, line)}"
            for name, value in document.items()
        ]
    )


def json_elements(elements: Sequence[Json], first: bool) -> str:
    """Return elements of a list that is a member of the document."""
    line = f"{_LINE} "
    text = ",".join([line + _json(element, line) for element in elements])
    return text if first else f",{text}"


def _json(value: Any, line: str) -> str:
    """Return a value as JSON with an indent of one blank, its lines begun so; the standard encoder takes five times as long."""
    if isinstance(value, str):
        return _quoted(value)
    if value is None or value is True or value is False:
        return _WORDS[value]
    if isinstance(value, dict):
        return f"{{{json_members(value, line + ' ')}{line}}}" if value else "{}"
    if isinstance(value, (list, tuple)):
        inner = f"{line} "
        return f"[{','.join([inner + _json(each, inner) for each in value])}{line}]" if value else "[]"
    if isinstance(value, float):
        if value - value != 0:
            raise ValueError(f"{value}: no number of JSON")
        return float.__repr__(value)
    if isinstance(value, int):
        return int.__repr__(value)
    return _json(value.tolist(), line)
