"""Bytes of a table as text, whatever program wrote them."""

from __future__ import annotations

import re
from collections import Counter
from itertools import islice

from cli.errors import DataError

# so many rows are looked at for what parts the cells, and for the header
LOOKED_AT = 20

LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")
_CONTROLS = bytes([*range(9), *range(14, 32), 127])
_QUOTED = re.compile(r'"[^"]*"')


def decoded(file: str, data: bytes, warnings: list[str]) -> str:
    """Return the text of UTF-8, UTF-16 or Windows-1252."""
    codec = "utf-8-sig"
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        codec = "utf-16"
    elif b"\0" in data[:200] and len(data) % 2 == 0:
        # without a byte order mark: ASCII in UTF-16 has its zeros on one side
        codec = "utf-16-le" if not any(data[1:200:2]) else "utf-16-be" if not any(data[:200:2]) else codec
    try:
        text = data.decode(codec)
    except UnicodeDecodeError:
        try:
            text = data.decode("cp1252")
        except UnicodeDecodeError:
            raise DataError(f"{file}: this is not text: expected CSV in UTF-8") from None
        codec = "cp1252"
    raw = text.encode()
    if len(raw.translate(None, _CONTROLS)) != len(raw):
        raise DataError(f"{file}: this is not text (control characters): expected CSV in UTF-8")
    if codec != "utf-8-sig":
        warnings.append(
            f"{file}: read as {'Windows-1252 (Latin-1)' if codec == 'cp1252' else 'UTF-16'}, for it is not UTF-8"
        )
    return text


def delimiter(text: str) -> str:
    """Return the mark that parts the most of the first lines into equally many cells."""
    lines = (match.group() for match in LINE.finditer(text))
    first = list(islice((_QUOTED.sub("", line) for line in lines if line.strip()), LOOKED_AT))

    def alike(mark: str) -> int:
        counts = Counter(line.count(mark) for line in first if mark in line)
        return max(counts.values(), default=0)

    return max("\t;,", key=alike) if any(map(alike, "\t;,")) else ","
