"""The files that are read: each is remembered, so that no output is written over it."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from dalembert.errors import DataError

ZIP, OLE = b"PK\x03\x04", b"\xd0\xcf\x11\xe0"
SUFFIXES = (".xlsx", ".xlsm", ".xls", ".ods")
# device and inode: a link to a file is the file
_read: set[tuple[int, int]] = set()
# the tables and descriptions that were read, as the user named them
_named: dict[str, None] = {}
# what can be read only once: standard input, pipes
_held: dict[str, bytes] = {}


def forget() -> None:
    """Begin a call: nothing has been read."""
    _read.clear()
    _held.clear()
    _named.clear()


def remember(path: str) -> None:
    """Remember how the user named a table or a description."""
    _named[path] = None


def named() -> list[str]:
    """Return the tables and descriptions that were read, in order."""
    return list(_named)


def note(path: str | Path) -> Path:
    """Remember that a file is read."""
    with suppress(OSError, ValueError):
        # standard input may be a file too
        status = os.fstat(sys.stdin.fileno()) if path == "-" else os.stat(path)
        _read.add((status.st_dev, status.st_ino))
    return Path(path)


def load(path: str | Path) -> bytes:
    """Read a file, or standard input for `-`; OSError or ValueError where it cannot be."""
    name = str(path)
    if not name:
        raise ValueError("expected the name of a file")
    if name in _held:
        return _held[name]
    file = note(path)
    data = sys.stdin.buffer.read() if path == "-" else file.read_bytes()
    if path == "-" or not os.path.isfile(path):
        _held[name] = data
    return data


def name_of(path: str) -> str:
    """Return what messages call a file."""
    return "standard input" if path == "-" else path or "''"


def read_bytes(path: str) -> tuple[str, bytes]:
    """Read a file: what messages call it, and what it holds."""
    file = name_of(path)
    try:
        return file, load(path)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise DataError(f"{file}: {reason}") from None


def read_toml(path: str) -> tuple[str, dict[str, Any]]:
    """Read a TOML file: what messages call it, and what it holds.

    Raises
    ------
    DataError
        The file cannot be read, is no text, or is no valid TOML.
    """
    import tomllib

    file, data = read_bytes(path)
    try:
        return file, tomllib.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise DataError(f"{file}: this is not text: expected TOML in UTF-8") from None
    except RecursionError:
        raise DataError(f"{file}: no valid TOML: nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise DataError(f"{file}: no valid TOML: {error}") from None
    except ValueError:
        raise DataError(f"{file}: no valid TOML: a number of thousands of digits") from None


def is_input(path: str | Path) -> bool:
    """Whether a file has been read in this call, under this name or another."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return False
    return (status.st_dev, status.st_ino) in _read


def is_workbook(data: bytes) -> bool:
    """Whether a file's bytes are those of a spreadsheet."""
    return data[:4] in (ZIP, OLE)


def split_sheet(path: str) -> tuple[str, str]:
    """Split `FILE.xlsx#Sheet name`."""
    file, mark, sheet = path.partition("#")
    return (file, sheet) if mark and file.lower().endswith(SUFFIXES) else (path, "")
