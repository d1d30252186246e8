"""The bytes of an input."""

from __future__ import annotations

import sys
from pathlib import Path

from cli.errors import DataError


def read_bytes(path: str) -> tuple[str, bytes]:
    """Read a file, or standard input for `-`: what messages call it, and what it holds."""
    file = "standard input" if path == "-" else path
    try:
        return file, sys.stdin.buffer.read() if path == "-" else Path(path).read_bytes()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise DataError(f"{file}: {reason}") from None
