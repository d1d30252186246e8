"""Files are written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from cli.errors import DataError


def write_all(files: Mapping[Path, Callable[[], bytes | Iterable[bytes]]]) -> None:
    """Write files one after the other, each formed when its turn comes."""
    for path, data in files.items():
        write(path, data())


def write(path: Path, data: bytes | Iterable[bytes]) -> None:
    """Write a file; `data` may come in parts."""
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        try:
            with partial.open("wb") as stream:
                stream.writelines([data] if isinstance(data, bytes) else data)
            os.replace(partial, path)
        finally:
            partial.unlink(missing_ok=True)
    except OSError as error:
        raise DataError(f"{path}: cannot write: {error.strerror or error}") from None
