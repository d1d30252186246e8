"""The TOML file of a mechanism in pieces: a page puts its own numbers between them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from virtualwork.describe import DescriptionError
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import parts_with
from virtualwork.describe.text import toml_text


def toml_template(m: Description, paths: Sequence[str]) -> list[Any] | None:
    """The file as lines of text and paths of dimensions; None where it cannot be written.

    A number that is left out as it is the default stands only where it was changed.
    """
    marked = {path: 0.5 + (i + 1) * 1.000123456789e-4 for i, path in enumerate(paths)}
    try:
        own = toml_text(m)
        # marks are no mechanism: the segments of a cam's law would not close
        text = toml_text(m, parts=parts_with(m, marked))
    except DescriptionError:
        return None
    written = set(_keyed(own))
    marks = {repr(number): path for path, number in marked.items()}
    lines: list[Any] = []
    for (head, key), line in zip(_keyed(text), text.splitlines(), strict=True):
        pieces: list[Any] = [""]
        for word in _words(line):
            if word in marks:
                pieces += [[marks[word]], ""]
            else:
                pieces[-1] += word
        lines.append({"of": pieces, "needed": (head, key) in written or not key})
    present = {word for line in text.splitlines() for word in _words(line)} & set(marks)
    return lines if len(present) == len(marks) else None


def _words(line: str) -> list[str]:
    """A line of TOML as numbers and the text between them."""
    return re.split(r"((?<![\w.\"+-])\d+\.\d+(?![\w.\"]))", line)


def _keyed(text: str) -> list[tuple[str, str]]:
    """Each line's table and key; tables of a list are counted."""
    keys, head, count = [], "", 0
    for line in text.splitlines():
        if line.startswith("["):
            count += 1
            head = f"{line} {count}"
            keys.append((head, ""))
        else:
            keys.append((head, line.partition(" = ")[0] if " = " in line else ""))
    return keys
