"""Files are written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import typer

from dalembert.errors import DataError
from dalembert.tables.files import is_input


def write_all(files: Mapping[Path, Callable[[], bytes | Iterable[bytes]]]) -> None:
    """Write files one after the other, each formed when its turn comes."""
    for path, data in files.items():
        write(path, data())


def refuse_inputs(outputs: Iterable[Path]) -> None:
    """Refuse outputs that are inputs of this call, or one another, before any of them is written."""
    seen: set[str] = set()
    for path in outputs:
        if is_input(path):
            raise typer.BadParameter(f"'{path}' is an input: expected another file; nothing was written")
        name = os.path.realpath(path)
        if name in seen:
            raise typer.BadParameter(f"'{path}' is given twice: expected a file for each output")
        seen.add(name)


def check_folders(paths: Iterable[Path]) -> None:
    """Refuse the first file whose folder is missing, before any is written."""
    for path in paths:
        if not path.parent.is_dir():
            raise DataError(f"{path}: cannot write: no folder {path.parent}")


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
