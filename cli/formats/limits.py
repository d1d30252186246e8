"""How large a file of another program may be: what is larger is refused in one line before work begins that grows with its square."""

from __future__ import annotations

from typing import Any

from dalembert.errors import DataError

# bytes
LARGEST_FILE = 10_000_000
# elements of XML, values of JSON, lines of text
MOST_PARTS = 20_000
# links of a mechanism or a robot
MOST_LINKS = 1000


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
