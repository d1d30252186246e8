"""Reading a mechanism from its TOML description."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from virtualwork.describe import DescriptionError, MechanismError, require
from virtualwork.describe.description import FILE, UNITS, Description
from virtualwork.describe.file import Entry, File, Load, require_keys
from virtualwork.describe.keys import Part, place_of, read_fields, table_keys
from virtualwork.describe.parts import GROUND, PARTS, TABLES, Guess, Input, Link, Polar
from virtualwork.describe.units import Units, text_of, wrong

D = TypeVar("D", bound=Description)


def read(path: Path, make: Callable[..., D], load: Load = Path.read_bytes) -> D:
    """Read a mechanism from a TOML file; `make` takes its parts, `load` reads it and the tables beside it.

    Raises
    ------
    DescriptionError
        Names the file, the table and the key, what was found and what was expected.
    OSError
        Where the file cannot be read.
    """
    return read_text(load(path).decode("utf-8-sig"), make, str(path), path.parent, load)


def read_text(
    text: str,
    make: Callable[..., D],
    file: str = "<text>",
    folder: Path | None = None,
    load: Load = Path.read_bytes,
) -> D:
    """Read a mechanism from TOML text; `folder` is where its input tables lie, which `load` reads."""
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise DescriptionError(f"{file}: no valid TOML: nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise DescriptionError(f"{file}: no valid TOML: {error}") from None
    except ValueError:
        raise DescriptionError(f"{file}: no valid TOML: a number of thousands of digits") from None
    try:
        file_read = File(data, folder or Path(), load)
        parts = _parts(file_read)
        made = make(**parts)
        tolerances = _tolerances(file_read, made)
        return make(**parts, tolerances=tolerances) if tolerances else made
    except MechanismError as error:
        raise type(error)(f"{file}: {error}") from None


def _parts(file: File) -> dict[str, Any]:
    """Every part of the mechanism, under the name that `Description` gives it."""
    require_keys(file.data, [*FILE, *TABLES], "the file", "table or key")
    units = file.data.get("units", {})
    require_keys(units, UNITS, "[units]", "key")
    file.units = Units(units)
    ground = {
        name: file.units.pair(v, "length", f"[ground] {name}") for name, v in file.table("ground").items()
    }
    links = {name: _link(file, name, entry) for name, entry in file.table("links").items()}
    file.bodies = {GROUND: ground} | {name: link.points for name, link in links.items()}
    lists: dict[str, list[Part]] = {kind.collection: [] for kind in PARTS}
    for table, kind in TABLES.items():
        rows, keys = file.rows(table), table_keys(kind, table)
        for i, row in enumerate(rows, 1):
            entry = Entry(file, place_of(table, i, len(rows)), row)
            lists[kind.collection].append(kind(**read_fields(entry, keys)))
    if not lists["inputs"]:
        raise DescriptionError(
            "[input]: missing: nothing drives the mechanism; expected a table [input] with link or slider"
        )
    inputs = [part for part in lists["inputs"] if isinstance(part, Input)]
    return {
        "ground": ground,
        "links": links,
        "guess": _guess(file, inputs),
        "name": _name(file),
        "gravity": _gravity(file),
        "decimals": file.units.decimals,
        **lists,
    }


def _name(file: File) -> str:
    return text_of(file.data.get("name", ""), "name")


def _gravity(file: File) -> complex:
    value = file.data.get("gravity", [0, 0])
    if isinstance(value, list) and len(value) == 2:
        return file.units.pair(value, "acceleration", "gravity")
    raise wrong("gravity", value, "two accelerations [x, y]")


def _link(file: File, name: str, table: Any) -> Link:
    where = f"[links.{name}]"
    if not isinstance(table, dict):
        raise wrong(where, table, "a table with points")
    points = table.get("points", {})
    if not isinstance(points, dict):
        raise wrong(f"{where} points", points, "a table { A = [0, 0], B = [120, 0] }")
    fields = read_fields(Entry(file, where, table), table_keys(Link))
    places = {p: _point(file, v, f"{where} points.{p}") for p, v in points.items()}
    try:
        return Link(places, **fields)
    except DescriptionError as error:
        raise DescriptionError(f"{where} {error}") from None


def _point(file: File, value: Any, where: str) -> complex | Polar:
    """A point of a link: [x, y], or its distance and direction from another one."""
    if not isinstance(value, dict):
        return file.units.pair(value, "length", where)
    if not isinstance(value.get("from"), str):
        raise DescriptionError(f"{where} from: expected the name of another point of this link")
    return Polar(**read_fields(Entry(file, where, value), table_keys(Polar)))


def _guess(file: File, inputs: list[Input]) -> Guess:
    table, units = file.table("guess"), file.units
    at = _guessed_inputs(table["at"], inputs, units) if "at" in table else None
    angles: dict[str, float] = {}
    points: dict[str, complex] = {}
    names = {p for body in file.bodies.values() for p in body}
    links = file.bodies.keys() - {GROUND}
    # of inputs that are slides
    slides: dict[str, float] = {}
    for key, value in table.items():
        where = f"[guess] {key}"
        if key in table_keys(Guess):
            continue
        if key in names and (isinstance(value, list) or key not in links):
            if not isinstance(value, list) and any(e.slider == key for e in inputs):
                slides[key] = units.number(value, "length", where)
            else:
                points[key] = units.pair(value, "length", where)
        else:
            require(key, links | names, where, "link or point")
            angles[key] = units.number(value, "angle", where)
    if at is None and slides:
        own = (e.value if e.value is not None else (slides | angles).get(e.name, 0.0) for e in inputs)
        at = list(own)
    return Guess(at, angles, points)


def _guessed_inputs(values: Any, inputs: list[Input], units: Units) -> list[float]:
    """The input, or every input, for which the guess holds; where one is not named, the description's own value."""
    where = "[guess] at"
    kinds = ["length" if e.is_slide else "angle" for e in inputs]
    if isinstance(values, dict):
        require_keys(values, {e.name for e in inputs}, where, "input")
        own = {e.name: e.value for e in inputs if e.value is not None}
        if any(e.name not in values and e.name not in own for e in inputs):
            raise wrong(where, values, "a value for every input")
        return [
            units.number(values[e.name], kind, where) if e.name in values else own[e.name]
            for kind, e in zip(kinds, inputs, strict=True)
        ]
    row = values if isinstance(values, list) else [values]
    if len(row) != len(inputs):
        raise wrong(where, values, f"{len(inputs)} value(s), one for each input")
    return [units.number(value, kind, where) for value, kind in zip(row, kinds, strict=True)]


def _tolerances(file: File, m: Description) -> dict[str, float]:
    """The limits ± of dimensions, by their paths; quoted, or with the words of the path as tables."""
    limits: dict[str, float] = {}
    if "tolerances" not in file.data:
        return limits
    # most files have none
    from virtualwork.describe.dimensions import named

    def walk(table: Mapping[str, Any], before: str) -> None:
        for key, value in table.items():
            path = f"{before}{key}"
            if isinstance(value, dict):
                walk(value, f"{path}.")
                continue
            where = f"[tolerances] {path}"
            try:
                kind = named(m, path)[0].kind
            except DescriptionError as error:
                raise DescriptionError(f"[tolerances]: {error}") from None
            limits[path] = file.units.number(value, kind, where)
            if limits[path] < 0:
                raise wrong(where, value, "a limit of zero or more")

    walk(file.table("tolerances"), "")
    return limits
