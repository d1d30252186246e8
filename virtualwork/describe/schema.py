"""The JSON Schema (draft 2020-12) of a mechanism's TOML file, from the keys that its parts declare."""

from __future__ import annotations

from typing import Any

from dalembert.quantities import expected
from virtualwork.describe.description import FILE, UNITS
from virtualwork.describe.forms import PAIR, SCALAR, TEXT, Free, Nested, Pair, Scalar, Schema
from virtualwork.describe.keys import Key, Keys, table_keys
from virtualwork.describe.parts import TABLES, Guess, Link, Polar


def schema() -> Schema:
    """Return the JSON Schema of the file.

    Names are not followed: that a link or point exists, the reader alone knows.

    Examples
    --------
    >>> sorted(schema()["properties"]["motors"]["anyOf"][0]["properties"])
    ['carrier', 'center', 'drives', 'mass']
    """
    entries: Schema = {}
    for name, kind in TABLES.items():
        entry = _table(table_keys(kind, name))
        many = {"type": "array", "items": entry} | ({"minItems": 1} if name == "input" else {})
        entries[name] = {"anyOf": [entry, many]}
    file = _table(FILE)
    # a number, perhaps with its unit behind it
    number = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": r"^\s*[-+]?(\d|\.\d)"}]}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A mechanism of dalembert",
        **file,
        "properties": file["properties"] | entries,
        "required": [*file["required"], "input"],
        "$defs": {
            "quantity": number,
            "pair": {"type": "array", "items": SCALAR, "minItems": 2, "maxItems": 2},
        },
    }


def _table(keys: Keys) -> Schema:
    properties = {}
    for name, key in keys.items():
        properties[name] = _form(key) | {"description": _description(key)}
        if key.shown is not None:
            properties[name]["default"] = key.shown
    table = {
        "type": "object",
        "properties": properties,
        "required": [name for name, key in keys.items() if key.needed],
        "additionalProperties": False,
    }
    either = [
        [name, other]
        for name, key in keys.items()
        for other in keys
        if key.unless and keys[other].field == key.unless
    ]
    if either:
        choices = [{"oneOf": [{"required": [name]} for name in pair]} for pair in either]
        table |= choices[0] if len(choices) == 1 else {"allOf": choices}
    beside = {name: [key.beside] for name, key in keys.items() if key.beside}
    return table | ({"dependentRequired": beside} if beside else {})


def _description(key: Key) -> str:
    if isinstance(key.form, (Scalar, Pair)):
        return f"{key.meaning} ({expected(key.form.dimension(slides=False))})"
    return key.meaning


def _form(key: Key) -> Schema:
    if isinstance(key.form, Nested):
        return {"type": "array", "items": _table(table_keys(key.form.of)), "minItems": 1}
    return _free(key.form.name) if isinstance(key.form, Free) else key.form.schema()


def _each(value: Schema) -> Schema:
    """A table whose keys are names."""
    return {"type": "object", "additionalProperties": value}


def _free(name: str) -> Schema:
    """The schema of a value that the reader takes in a way of its own."""
    forms: dict[str, Any] = {
        "anything": dict,
        "name": lambda: {"type": ["string", "number"]},
        "report": lambda: _each(TEXT),
        "units": lambda: _table(UNITS),
        "ground": lambda: _each(PAIR),
        "points": lambda: _each({"anyOf": [PAIR, _table(table_keys(Polar))]}),
        "links": lambda: _each(_table(table_keys(Link))) | {"minProperties": 1},
        "guess": lambda: _table(table_keys(Guess)) | _each({"anyOf": [SCALAR, PAIR]}),
        "inputs": lambda: {"anyOf": [SCALAR, {"type": "array", "items": SCALAR}, _each(SCALAR)]},
        # quoted paths, or their words as tables
        "tolerances": lambda: _each({"anyOf": [SCALAR, {"type": "object"}]}),
    }
    form: Schema = forms[name]()
    return form
