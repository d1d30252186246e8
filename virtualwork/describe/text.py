"""The TOML text of a mechanism, by the keys that its parts declare: the reverse of the reader."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields
from typing import Any

from virtualwork.describe import DescriptionError
from virtualwork.describe.curves import Rows, TorqueOrTable
from virtualwork.describe.description import FILE, Description
from virtualwork.describe.file import require_keys
from virtualwork.describe.forms import Free, Nested, Pair, Scalar
from virtualwork.describe.keys import keys_of, table_keys
from virtualwork.describe.parts import PARTS, TABLES, Guess, Input, Link
from virtualwork.describe.units import SI, Units

Table = dict[str, Any]


class Exact(Units):
    """Units in which every number is written so that the same number is read back."""

    def bare(self, si: float, dimension: str) -> Any:
        """The shortest such number; with the SI unit behind it where no bare number is read back the same."""
        near = super().bare(si, dimension)
        for digits in range(12, 18):
            number = float(f"{near:.{digits}g}")
            if self.number(number, dimension, "") == si:
                return number
        for number in (math.nextafter(near, -math.inf), math.nextafter(near, math.inf)):
            if self.number(number, dimension, "") == si:
                return number
        return f"{si!r} {'m' if dimension == 'length' else 'rad'}"


class AsWritten(Units):
    """Units of parts whose numbers are those of the file already."""

    def __init__(self) -> None:
        super().__init__({})

    def bare(self, si: float, dimension: str) -> float:
        """The number itself."""
        return si


def toml_text(
    m: Description, length: str = "m", angle: str = "rad", parts: Mapping[str, Any] | None = None
) -> str:
    """The TOML text of a mechanism; the same mechanism is read from it.

    Parameters
    ----------
    m : Description
    length, angle : str
        The units of bare lengths and angles.
    parts : mapping, optional
        Written in place of its own, by the names that `Description` gives them.

    Raises
    ------
    DescriptionError
        Where a part has no text: rows without the name of a table, an end of a spring at a point without a name.

    Examples
    --------
    >>> from virtualwork.describe.parts import Input, Link
    >>> arm = Link({"O": 0j, "P": 0.12}, mass=2.0)
    >>> print(toml_text(Description({"O": 0j}, {"arm": arm}, inputs=Input("arm", speed=3.0)), "mm"), end="")
    [units]
    length = "mm"
    angle = "rad"
    <BLANKLINE>
    [ground]
    O = [0, 0]
    <BLANKLINE>
    [links.arm]
    points = { O = [0, 0], P = [120, 0] }
    mass = 2
    <BLANKLINE>
    [input]
    link = "arm"
    speed = 3
    """
    units = {"length": length, "angle": angle}
    parts = parts or {f.name: getattr(m, f.name) for f in fields(Description)}
    tree = document(parts, Exact(units))
    if m.tolerances:
        from virtualwork.describe.dimensions import named

        exact = Exact(units)
        limits = {path: (named(m, path)[0].kind, limit) for path, limit in m.tolerances.items()}
        tree["tolerances"] = {path: Scalar(kind).text(v, exact) for path, (kind, v) in limits.items()}
    return written(tree | {"units": units})


def document(parts: Mapping[str, Any], units: Units = SI) -> Table:
    """The parts of a description as the tables of a file.

    Parameters
    ----------
    parts : mapping
        The parts by the names that `Description` gives them.
    units : Units
        Those of the file.

    Raises
    ------
    DescriptionError
        Where a part has no text.
    """
    place = Pair("length")
    tree: Table = {name: parts[name] for name in ("name",) if parts.get(name)}
    if parts.get("gravity"):
        tree["gravity"] = Pair("acceleration").text(parts["gravity"], units)
    tree["ground"] = {name: place.text(z, units) for name, z in parts["ground"].items()}
    tree["links"] = {name: _link(link, units) for name, link in parts["links"].items()}
    for kind in PARTS:
        for i, part in enumerate(parts.get(kind.collection, ()), 1):
            try:
                table = table_of(part, units, part.slides)
            except DescriptionError as error:
                raise DescriptionError(f"[[{part.table}]] {i}: {error}") from None
            tree.setdefault(part.table, []).append(table)
    guess = _guess(parts.get("guess") or Guess(), parts.get("inputs", ()), units)
    return tree | ({"guess": guess} if guess else {})


def table_of(part: Any, units: Units = SI, slides: bool = False) -> Table:
    """The table of one part: its keys with their values, defaults left out.

    Raises
    ------
    DescriptionError
        Where a value has no text.
    """
    table: Table = {}
    keys = keys_of(type(part))
    for key in keys:
        value = getattr(part, key.field)
        if value is None or isinstance(key.form, Free) or not key.applies(part):
            continue
        if key.needed or key.unless or callable(key.default) or value != key.default:
            rows = isinstance(key.form, Nested)
            table[key.name] = (
                [table_of(row, units, slides) for row in value]
                if rows
                else key.form.text(value, units, slides)
            )
    declared = {key.field for key in keys}
    history = getattr(part, "history", None)
    if isinstance(history, Rows) and history.name:
        # what is read from a table in the file's folder, which the file names
        declared |= {"history", "over", "periodic"}
        table |= {key.name: history.name for key in keys if isinstance(key.form, TorqueOrTable)}
    for f in fields(part):
        default = f.default_factory() if f.default_factory is not MISSING else f.default
        if f.name not in declared and getattr(part, f.name) != default and not isinstance(part, Link):
            raise DescriptionError(f"{f.name}: cannot be written into the file")
    return table


def _link(link: Link, units: Units) -> Table:
    points = {
        name: table_of(link.polar[name], units) if name in link.polar else Pair("length").text(z, units)
        for name, z in link.points.items()
    }
    return {"points": points} | table_of(link, units)


def _guess(guess: Guess, inputs: tuple[Input, ...], units: Units) -> Table:
    table: Table = {}
    if guess.at is not None:
        of_input = Scalar("angle", sliding="length")
        at = [of_input.text(q, units, e.is_slide) for q, e in zip(guess.at, inputs, strict=True)]
        table["at"] = at[0] if len(at) == 1 else at
    table |= {name: Scalar("angle").text(angle, units) for name, angle in guess.angles.items()}
    return table | {name: Pair("length").text(z, units) for name, z in guess.points.items()}


def written(tree: Mapping[str, Any]) -> str:
    """The TOML text of a file's tables, in the order of their declarations.

    Raises
    ------
    DescriptionError
        A table or key that no file has.
    """
    lines: list[str] = []
    for head, table in _tables(tree):
        lines += ["", head] if head and lines else [head] if head else []
        lines += [f"{key_text(key)} = {value_text(value)}" for key, value in table.items()]
    return "\n".join(lines) + "\n"


def _tables(tree: Mapping[str, Any]) -> Iterator[tuple[str, Table]]:
    require_keys(tree, {*FILE, *TABLES}, "the file", "table or key")
    whole = {key: tree[key] for key in ("name", "source", "note", "gravity") if key in tree}
    if whole:
        yield "", whole
    for name in ("report", "units", "ground"):
        if name in tree:
            yield f"[{name}]", tree[name]
    for name, link in tree["links"].items():
        yield f"[links.{key_text(name)}]", _ordered(link, Link, "")
    for table, kind in TABLES.items():
        entries = tree.get(table, [])
        for entry in entries:
            alone = table == "input" and len(entries) == 1
            yield f"[{table}]" if alone else f"[[{table}]]", _ordered(entry, kind, table)
        if table == "input" and "guess" in tree:
            yield "[guess]", tree["guess"]
    if "tolerances" in tree:
        yield "[tolerances]", tree["tolerances"]


def _ordered(entry: Mapping[str, Any], kind: type, table: str) -> Table:
    keys = table_keys(kind, table)
    require_keys(entry, keys, f"[{table or 'links'}]", "key")
    return {name: entry[name] for name in keys if name in entry}


def key_text(name: str) -> str:
    """A key, quoted where it is no plain word."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else value_text(name)


def value_text(value: object) -> str:
    """A value as TOML has it.

    >>> value_text(-0.0), value_text(1e22), value_text(["a", 0.1]), value_text('x"'), value_text({"A": [1.0]})
    ('0.0', '1e+22', '["a", 0.1]', '"x\\\\""', '{ A = [1.0] }')
    """
    if isinstance(value, float):
        return repr(value + 0.0)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(value_text, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key_text(k)} = {value_text(v)}' for k, v in value.items())} }}"
    # a JSON string is a basic string of TOML, but for the one control character that JSON leaves as it is
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
