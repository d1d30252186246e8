"""Vectors `amplitude@phase`: in cells of a table, or behind keys (YAML, JSON, text, a sheet), brought to a table of runs."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import NamedTuple

import numpy as np

from dalembert.angles import phasor
from dalembert.errors import DataError, quote
from dalembert.quantities import parse_number
from dalembert.tables.files import read_bytes, remember, split_sheet
from dalembert.tables.headers import Heading, plain_word, words_of
from dalembert.tables.sources import LINE, Source, decoded, open_source, without_dashes
from dalembert.tables.table import Cells, Numbers, Table
from dalembert.units import find_unit, parted, unit_name

AMPLITUDE, UNBALANCE = words_of("amplitude"), words_of("unbalance")
MASS = words_of("mass", "weight", "trial_mass")
KEYS = ("A", "B", "U", "ALPHA", "A0", "keep_trial", "weight_const")


class Alpha(NamedTuple):
    """The coefficients `ALPHA` of a file of vectors."""

    file: str
    rows: list[list[tuple[float, float]]]
    """(size, degrees), a row for each sensor, a column for each plane."""


@dataclass(frozen=True)
class Layout:
    """A log as a table of runs, and what it states besides."""

    table: Table
    is_log: bool = True
    """Whether its masses alone may distinguish its runs."""
    max_mass: dict[str, float] = field(default_factory=dict)
    """Limits of the corrections, plane -> kg."""
    runout: dict[str, complex] = field(default_factory=dict)
    """Slow roll, sensor -> vector."""
    alpha: Alpha | None = None
    """Coefficients in place of trial runs."""


def vectors_of(path: str) -> Layout | None:
    """Read a file of vectors; None where it is none."""
    file, text = _keyed_file(path)
    return None if text is None else _vectors(file, text)


def alpha_of(path: str) -> Alpha | None:
    """Return the coefficients of a file of vectors; None where it is none, or has no ALPHA."""
    file, text = _keyed_file(path)
    return None if text is None else _alpha(file, _values(file, text))


def _alpha(file: str, values: dict[str, object]) -> Alpha | None:
    if "ALPHA" not in values:
        return None
    rows = [
        [(float(size), float(turn)) for size, turn in (_polar(file, "ALPHA", cell) for cell in _flat(row))]
        for row in _listed(values["ALPHA"])
    ]
    if len({len(row) for row in rows}) > 1:
        raise DataError(f"{file}: ALPHA has rows of different lengths: expected a column for each plane")
    return Alpha(file, rows)


def _keyed_file(path: str) -> tuple[str, str | None]:
    """Return a file's name, and its text where it holds vectors: `KEY:` and lists, or a sheet or an object of JSON like it."""
    file, data = read_bytes(split_sheet(path)[0])
    # quotes of JSON are no quotes of a table
    if re.match(rb'(?:\xef\xbb\xbf)?\s*\{\s*"\w+"\s*:', data):
        remember(path)
        return file, decoded(file, data, [])
    source = open_source(path, {}, None)
    text = source.text if source.sheet is None else _sheet_text(source.sheet.rows)
    return source.file, text if _keyed(text) else None


def _sheet_text(rows: list[list[str]]) -> str:
    """Write the rows of a sheet as a file of vectors has them; a row without a key is a further sensor's."""
    lines: list[str] = []
    for row in rows:
        first, *cells = (cell.strip() for cell in row) if row else [""]
        cells = [cell for cell in cells if cell]
        key = first.rstrip(" :=")
        if key in KEYS and cells:
            lines.append(f"{key}: [[{', '.join(cells)}]]")
        elif not first and cells and lines and lines[-1].endswith("]]"):
            lines[-1] = f"{lines[-1][:-1]}, [{', '.join(cells)}]]"
        elif first or cells:
            lines.append(" ".join([first, *cells]))
    return "\n".join(lines)


def _keyed(text: str) -> bool:
    """Tell whether the first line that says something is `KEY:` and a list."""
    for line in LINE.finditer(text):
        head = line.group().split("#")[0].strip()
        if head and head != "---":
            return re.match(r"[A-Za-z_]\w*\s*[:=]\s*(\[|$|[-+\d.]+\s*@)", head) is not None
    return False


def _vectors(file: str, text: str) -> Layout:
    """Read `A`, `B`, `U` … whose cells are `amplitude@phase`."""
    values = _values(file, text)
    # with coefficients no trial run is needed
    stored = "ALPHA" in values and "B" not in values
    for key in ("A",) if stored else ("A", "B", "U"):
        if key not in values:
            more = (
                ": it has influence coefficients alone, as they are stored"
                if key == "A" and "ALPHA" in values
                else ""
            )
            raise DataError(
                f"{file}: no {key}: expected A (initial vectors), B (trial runs) and U (trial masses), or A and ALPHA{more}"
            )
    first = [_polar(file, "A", cell) for cell in _flat(values["A"])]
    trials = (
        [[] for _ in first]
        if stored
        else [[_polar(file, "B", cell) for cell in _flat(row)] for row in _listed(values["B"])]
    )
    masses = [] if stored else [_polar(file, "U", cell) for cell in _flat(values["U"])]
    slow = [_polar(file, "A0", cell) for cell in _flat(values.get("A0", []))]
    if len(trials) != len(first) or any(len(row) != len(masses) for row in trials):
        raise DataError(
            f"{file}: B has {len(trials)} rows of {len(trials[0]) if trials else 0}: expected a row for each of {len(first)} sensors "
            f"with a column for each of {len(masses)} trial runs"
        )
    if slow and len(slow) != len(first):
        raise DataError(f"{file}: A0 has {len(slow)} vectors: expected one for each of {len(first)} sensors")
    kept = "yes" if "".join(_flat(values.get("keep_trial", ""))).lower() in ("true", "yes", "1") else "no"
    runs = [(0, s, first[s]) for s in range(len(first))]
    runs += [(j + 1, s, row[j]) for j in range(len(masses)) for s, row in enumerate(trials)]
    on = [masses[j - 1] if j else ("", "") for j, _, _ in runs]
    table = Table(file, list(values), len(runs))
    table.texts = {
        "run": [str(j) if j else "initial" for j, _, _ in runs],
        "sensor": [str(s + 1) for _, s, _ in runs],
        "trial_plane": [str(j) if j else "" for j, _, _ in runs],
        "trial_kept": [kept if j else "" for j, _, _ in runs],
    }
    table.cells = {
        "trial_mass": Cells("U", "kg", [size for size, _ in on]),
        "trial_angle": Cells("U", "deg", [turn for _, turn in on]),
    }
    size, turn = (np.array([float(read[k]) for _, _, read in runs]) for k in (0, 1))
    table.numbers = {
        "amplitude": Numbers("A", "um", size, "amplitude"),
        "phase": Numbers("A", "deg", turn, "angle"),
    }
    table.warnings.append(f"{file}: no units: amplitudes are taken as um, masses as kg, angles as deg")
    for key in set(values) - {
        "A",
        "B",
        "U",
        "A0",
        "keep_trial",
        "weight_const",
        *(["ALPHA"] if stored else []),
    }:
        why = ": the trial runs determine the coefficients" if key == "ALPHA" else ""
        table.warnings.append(f"{file}: {key} is not used{why}")
    rest, around = (np.array([float(one[k]) for one in slow]) for k in (0, 1))
    limits = re.findall(r"([\d.]+)\s*:\s*([\d.]+)", str(values.get("weight_const", "")))
    # planes are numbered from 0 there
    return Layout(
        table,
        max_mass={str(int(float(plane)) + 1): float(limit) for plane, limit in limits},
        runout={str(s + 1): v for s, v in enumerate(phasor(rest, around, "deg").tolist())} if slow else {},
        alpha=_alpha(file, values) if stored else None,
    )


def _values(file: str, text: str) -> dict[str, object]:
    """Return key -> text, or nested lists of texts: JSON, and YAML as far as such files use it."""
    if text.lstrip().startswith("{"):
        return _of_json(file, text)
    whole = "\n".join(line.split("#")[0].rstrip() for line in text.splitlines())
    parts = re.split(r"^([A-Za-z_]\w*)\s*[:=]", whole, flags=re.MULTILINE)
    out: dict[str, object] = {}
    for key, value in zip(parts[1::2], parts[2::2], strict=True):
        value_text = value.strip()
        if key in out:
            raise DataError(f"{file}: {key} stands twice: expected it once")
        if value_text.startswith("-"):
            value_text = _dashed(value_text)
        listed = value_text.startswith("[") or (key in ("A", "B", "U", "A0", "ALPHA") and "@" in value_text)
        out[key] = (
            _nested(file, key, value_text if value_text.startswith("[") else f"[{value_text}]")
            if listed
            else value_text
        )
    return out


def _of_json(file: str, text: str) -> dict[str, object]:
    """Return key -> text, or nested lists of texts, of an object of JSON."""

    def leaves(value: object) -> object:
        if isinstance(value, list):
            return [leaves(each) for each in value]
        if isinstance(value, dict):
            return ", ".join(f"{key}: {leaves(each)}" for key, each in value.items())
        return value if isinstance(value, str) else json.dumps(value)

    def once(pairs: list[tuple[str, object]]) -> dict[str, object]:
        for k, (key, _) in enumerate(pairs):
            if key in (name for name, _ in pairs[:k]):
                raise DataError(f"{file}: {key} stands twice: expected it once")
        return dict(pairs)

    try:
        values: dict[str, object] = json.loads(text, object_pairs_hook=once)
    except json.JSONDecodeError as error:
        raise DataError(
            f"{file}: line {error.lineno}: no JSON: {error.msg[:1].lower()}{error.msg[1:]}"
        ) from None
    except RecursionError:
        raise DataError(f"{file}: lists too deep: expected rows of vectors such as 80@40") from None
    return {key: leaves(value) for key, value in values.items()}


def _dashed(text: str) -> str:
    """Write a list of dashes, one or two deep, with brackets."""
    rows: list[list[str]] = []
    nested = False
    for line in text.splitlines():
        stripped = line.strip()
        if stripped.startswith("- -"):
            rows.append([stripped[3:].strip()])
            nested = True
        elif stripped.startswith("-"):
            inner = nested and line.startswith((" ", "\t")) and rows
            if inner and line.index("-") > 0:
                rows[-1].append(stripped[1:].strip())
            else:
                rows.append([stripped[1:].strip()])
    return "[" + ", ".join(f"[{', '.join(row)}]" if nested else row[0] for row in rows) + "]"


def _nested(file: str, key: str, text: str) -> list[object]:
    """Read brackets and commas."""
    stack: list[list[object]] = [[]]
    for token in re.findall(r"[\[\],]|[^\[\],]+", text):
        if token == "[":
            inner: list[object] = []
            stack[-1].append(inner)
            stack.append(inner)
        elif token == "]":
            if len(stack) == 1:
                raise DataError(f"{file}: {key}: a bracket ']' too many")
            stack.pop()
        elif token != "," and token.strip():
            stack[-1].append(token.strip().strip("'\""))
    if len(stack) != 1:
        raise DataError(f"{file}: {key}: a bracket is not closed")
    if len(stack[0]) > 1:
        raise DataError(f"{file}: {key}: found {len(stack[0])} lists, expected one")
    return _listed(stack[0][0]) if stack[0] else []


def _listed(value: object) -> list[object]:
    return value if isinstance(value, list) else [value]


def _flat(value: object) -> list[str]:
    """Return the texts of a list, or of a list of lists of one."""
    return [
        text for item in _listed(value) for text in (_flat(item) if isinstance(item, list) else [str(item)])
    ]


def _polar(file: str, key: str, cell: str) -> tuple[str, str]:
    size, mark, turn = cell.partition("@")
    try:
        if not mark or parse_number(size) < 0:
            raise ValueError
        parse_number(turn)
    except ValueError:
        raise DataError(f"{file}: {key}: found '{cell}', expected amplitude@phase, such as 80@40") from None
    return size.strip(), turn.strip()


# -- cells of a table that hold size and angle ------------------------------------------------------------------

POLAR = re.compile(
    r"([-+\d.,e]*\d)\s*([^\W\d_][^@∠<∡]*?)?\s*[@∠<∡/]\s*([-+\u2212\d.,]*\d)\s*(?:°|deg)?", re.IGNORECASE
)
FIRST = 50
"""So many rows show whether the cells of a column hold vectors."""


def parted_cells(source: Source) -> Source:
    """Return a table in which each column of cells such as `12@45`, `12 mm/s ∠ 45°` or `12 / 45` is two, the second its angle."""
    sizes = {k: size for k, each in enumerate(source.headings) if (size := _size_of(each))}
    head = [cells for _, cells in islice(source.rows(), FIRST)]
    columns = {
        k: size
        for k, size in sizes.items()
        if any(
            POLAR.fullmatch(part.strip()) for cells in head if k < len(cells) for part in cells[k].split(";")
        )
    }
    if not columns:
        return source
    source.check_cells(k for k, each in enumerate(source.headings) if each.written)
    headings = [
        one
        for k, each in enumerate(source.headings)
        for one in (each, *([Heading(each.written, columns[k].angle, "deg")] if k in columns else []))
    ]

    def rows() -> Iterator[tuple[int, list[str]]]:
        for i, (line, cells) in enumerate(source.rows()):
            parts = [
                _sizes_and_angles(source, i, k, cell, columns[k]) if k in columns else (cell,)
                for k, cell in enumerate(cells)
            ]
            yield line, [one for part in parts for one in part]

    taken = ", ".join(quote(source.headings[k].written) for k in columns)
    source.warnings.append(f"{source.file}: read size and angle (degrees) from the cells of {taken}")
    return source.laid_out(headings, rows())


class _Size(NamedTuple):
    """A column of sizes, and what the column of their angles is called."""

    dimension: str
    unit: str
    angle: str


def _size_of(each: Heading) -> _Size | None:
    """Return what a column of vibrations or masses holds; None for other columns."""
    stem, written = (each.base, each.unit) if each.unit else parted(each.name)
    words = stem.split("_")
    plain = [plain_word(word) for word in words]
    for kinds, dimension, name in (
        (MASS, "mass", "angle"),
        (UNBALANCE, "unbalance", "angle"),
        (AMPLITUDE, "amplitude", "phase"),
    ):
        if (unit := find_unit(dimension, written)) and any(word in kinds for word in plain):
            angle = "_".join(name if p in kinds else word for p, word in zip(plain, words, strict=True))
            return _Size(dimension, unit, angle)
    unit = find_unit("amplitude", written)
    return _Size("amplitude", unit, f"phase_{stem}") if unit else None


def _sizes_and_angles(source: Source, row: int, column: int, cell: str, size: _Size) -> tuple[str, str]:
    """Return the sizes and the angles of a cell, several joined by ';'."""
    parts = without_dashes(part.strip() for part in cell.split(";"))
    matches = [match for part in parts if (match := POLAR.fullmatch(part))]
    if not any(parts) or parts == ["0"]:
        return cell, ""
    if len(matches) < len(parts):
        raise source.error(row, source.header[column], cell, "size@angle as in other rows, such as 80@40")
    if any(m[2] and find_unit(size.dimension, unit_name(m[2])) != size.unit for m in matches):
        raise source.error(row, source.header[column], cell, f"{size.unit}, the unit in the header")
    return ";".join(m[1] for m in matches), ";".join(m[3] for m in matches)
