"""Documents as JSON, in parts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from json.encoder import encode_basestring as _quoted
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dalembert.results.columns import Document, Json

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
