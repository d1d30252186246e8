"""The JSON Schema (draft 2020-12) of a mechanism's TOML file, from the keys that its reader knows."""

from __future__ import annotations

from typing import Any

from virtualwork.describe.entries import ENTRIES, FILE, GUESS, LINK, POINT, UNITS, Keys
from virtualwork.describe.units import EXPECTED

Schema = dict[str, Any]

# a number, perhaps with its unit behind it
_QUANTITY = {"anyOf": [{"type": "number"}, {"type": "string", "pattern": r"^\s*[-+]?(\d|\.\d)"}]}
_A_QUANTITY = {"$ref": "#/$defs/quantity"}
_PAIR = {"type": "array", "items": _A_QUANTITY, "minItems": 2, "maxItems": 2}
_A_PAIR = {"$ref": "#/$defs/pair"}
_TEXT = {"type": "string"}
# an input is an angle of a link, or a position of a slider
_CHOICES: dict[str, Schema] = {
    "input": {
        "oneOf": [{"required": ["link"]}, {"required": ["slider"]}],
        "dependentRequired": {"on": ["link"], "angle": ["link"], "position": ["slider"]},
    },
    "forces": {"oneOf": [{"required": ["force"]}, {"required": ["table"]}]},
}


def schema() -> Schema:
    """Return the JSON Schema of the file.

    Names are not followed: that a link or point exists, the reader alone knows.

    Examples
    --------
    >>> sorted(schema()["properties"]["motors"]["anyOf"][0]["properties"])
    ['carrier', 'center', 'drives', 'mass']
    """
    entries: Schema = {}
    for name, keys in ENTRIES.items():
        entry = _table(keys) | _CHOICES.get(name, {})
        many = {"type": "array", "items": entry} | ({"minItems": 1} if name == "input" else {})
        entries[name] = {"anyOf": [entry, many]}
    file = _table(FILE)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A mechanism of dalembert",
        **file,
        "properties": file["properties"] | entries,
        "required": [*file["required"], "input"],
        "$defs": {"quantity": _QUANTITY, "pair": _PAIR},
    }


def _table(keys: Keys) -> Schema:
    properties = {}
    for name, key in keys.items():
        properties[name] = _form(key.kind) | {"description": _told(key.kind, key.told)}
        if key.default is not None:
            properties[name]["default"] = key.default
    return {
        "type": "object",
        "properties": properties,
        "required": [name for name, key in keys.items() if key.needed],
        "additionalProperties": False,
    }


def _told(kind: str, told: str) -> str:
    quantity = EXPECTED.get(kind.removeprefix("pair of "))
    return told if quantity is None else f"{told} ({quantity[0]})"


def _named(of: Schema) -> Schema:
    return {"type": "object", "additionalProperties": of}


def _form(kind: str) -> Schema:
    """What a value of this kind looks like."""
    if kind in EXPECTED:
        return _A_QUANTITY
    return _A_PAIR if kind.startswith("pair of ") else _FORMS[kind]


_FORMS: dict[str, Schema] = {
    "anything": {},
    "text": _TEXT,
    "texts": {"type": "object", "additionalProperties": _TEXT},
    "name": {"type": ["string", "number"]},
    "torque or table": {"anyOf": [_A_QUANTITY, _TEXT]},
    "two texts": {"type": "array", "items": _TEXT, "minItems": 2, "maxItems": 2},
    "frame": {"enum": ["ground", "link"]},
    "point": {"anyOf": [_TEXT, _A_PAIR]},
    "ground": _named(_A_PAIR),
    "inputs": {"anyOf": [_A_QUANTITY, {"type": "array", "items": _A_QUANTITY}, _named(_A_QUANTITY)]},
}
# tables of keys whose forms stand above
_FORMS["units"] = _table(UNITS)
_FORMS["points"] = _named({"anyOf": [_A_PAIR, _table(POINT)]})
_FORMS["links"] = _named(_table(LINK)) | {"minProperties": 1}
# quoted paths, or their words as tables
_FORMS["tolerances"] = {
    "type": "object",
    "additionalProperties": {"anyOf": [_A_QUANTITY, {"type": "object"}]},
}
_FORMS["guess"] = _table(GUESS) | _named({"anyOf": [_A_QUANTITY, _A_PAIR]})
