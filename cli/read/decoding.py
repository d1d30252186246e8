"""Bytes of a table as text, whatever program wrote them."""

from __future__ import annotations

import re

from cli.errors import DataError


def decoded(file: str, data: bytes, warnings: list[str]) -> str:
    """Return the text of UTF-8, UTF-16 or Windows-1252."""
    if data[:4] == b"PK\x03\x04":
        raise DataError(
            f"{file}: this is a spreadsheet or zip file: expected CSV text (save the sheet as CSV)"
        )
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
    if re.search(r"[\0-\x08\x0e-\x1f\x7f]", text):
        raise DataError(f"{file}: this is not text (control characters): expected CSV in UTF-8")
    if codec != "utf-8-sig":
        warnings.append(
            f"{file}: read as {'Windows-1252 (Latin-1)' if codec == 'cp1252' else 'UTF-16'}, for it is not UTF-8"
        )
    return text


def delimiter(text: str) -> str:
    """Return what parts the cells of the header: a comma, a semicolon or a tab."""
    first = re.search(r"\S.*", text)
    header = first.group() if first else ""
    return max(",;\t", key=lambda mark: (header.count(mark), mark == ","))
