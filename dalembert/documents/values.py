"""What a file of another program holds: text, a JSON document, so much at most, finite numbers; errors name the place."""

from __future__ import annotations

import json
from fractions import Fraction
from typing import Any

from dalembert.errors import DataError, quote
from dalembert.units import LARGEST

# bytes
LARGEST_FILE = 10_000_000
# elements of XML, values of JSON, lines of text
MOST_PARTS = 20_000
# links of a mechanism or a robot
MOST_LINKS = 1000


def check_size(file: str, data: bytes) -> None:
    """Refuse a file that is too large."""
    if len(data) > LARGEST_FILE:
        raise DataError(f"{file}: {len(data)} bytes: expected at most {LARGEST_FILE} (10 MB)")


def check_count(file: str, count: int, what: str, most: int = MOST_PARTS) -> None:
    """Refuse a file that holds too many of something."""
    if count > most:
        raise DataError(f"{file}: {count} {what}: expected at most {most}")


def values_in(document: Any) -> int:
    """Return how many objects, lists and their values a JSON document has.

    >>> values_in({"a": [1, 2], "b": {}})
    5
    """
    waiting, count = [document], 0
    while waiting:
        value = waiting.pop()
        count += 1
        if isinstance(value, list | dict):
            waiting += value.values() if isinstance(value, dict) else value
    return count


def decoded(file: str, data: bytes) -> str | None:
    """Return a file's text, None where it is binary; DataError where the file is too large."""
    check_size(file, data)
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252", errors="replace")
    return None if "\0" in text else text


def parsed(file: str, text: str) -> Any:
    """Return a JSON document; DataError names the line and column of what is wrong."""

    def refuse(word: str) -> float:
        raise DataError(f"{file}: found {word}, expected finite numbers")

    try:
        result = json.loads(text, parse_constant=refuse)
    except json.JSONDecodeError as error:
        raise DataError(
            f"{file}: line {error.lineno}, column {error.colno}: no valid JSON ({error.msg}); is the file cut off?"
        ) from None
    except (RecursionError, ValueError):
        raise DataError(
            f"{file}: no valid JSON: nested too deeply, or a number of thousands of digits"
        ) from None
    check_count(file, values_in(result), "values")
    return result


def exact(value: float) -> Fraction:
    """Return the decimal that a number was written as; ValueError where it is no finite number.

    >>> float(exact(0.3) - exact(0.1))
    0.2
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise ValueError(f"found {value!r}, expected a finite number")
    return Fraction(repr(value))


def damaged(file: str, where: str, value: object, expected: str) -> DataError:
    """Return the error of a file: the place, the value there, the expected value."""
    return DataError(f"{file}: {where}: found {quote(str(value))}, expected {expected}")


def finite(file: str, where: str, word: object) -> float:
    """Return the finite number that a word is; DataError names the place where it is none."""
    try:
        value = float(str(word).replace("_", " "))
        exact(value)
    except ValueError:
        raise damaged(file, where, word, "a finite number") from None
    return value


def objects(file: str, where: str, value: Any) -> list[dict[str, Any]]:
    """Return the objects of a JSON list, or of an object by their ids; none where there is no value."""
    if isinstance(value, dict):
        value = [{"id": k} | v if isinstance(v, dict) else v for k, v in value.items()]
    value = [] if value is None else value
    if not isinstance(value, list) or not all(isinstance(e, dict) for e in value):
        raise damaged(file, where, value, "a list of objects")
    return value
