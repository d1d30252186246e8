"""The folder of an exercise: formed whole, then put in its place."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from dalembert.errors import DataError
from dalembert.tables.files import is_input
from dalembert.tables.table import read


def put(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write all files of a folder, or none: a new folder appears at once, in one that is there files are replaced.

    Raises
    ------
    DataError
        Where the folder cannot be written, or would lose answers that were filled in, or one of the inputs.
    """
    _refuse(folder, files)
    parent = folder.parent
    if not parent.is_dir():
        raise DataError(f"{folder}: cannot write: no folder {parent}")
    try:
        made = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", suffix=".part", dir=parent))
        try:
            for name, data in files.items():
                path = made / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(data)
            if folder.is_dir():
                for name in files:
                    folder.joinpath(name).parent.mkdir(parents=True, exist_ok=True)
                    os.replace(made / name, folder / name)
            else:
                made.chmod(0o777 & ~_mask())
                os.replace(made, folder)
        finally:
            shutil.rmtree(made, ignore_errors=True)
    except OSError as error:
        raise DataError(f"{folder}: cannot write: {error.strerror or error}") from None


def _mask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _refuse(folder: Path, files: Mapping[str, bytes]) -> None:
    if folder.exists() and not folder.is_dir():
        raise DataError(f"{folder}: cannot write: found a file, expected a folder or a new name")
    for name in files:
        path = folder / name
        if is_input(path):
            raise DataError(f"{path}: is an input: expected another folder; nothing was written")
    answers = folder / "answers.csv"
    if answers.is_file():
        try:
            filled = any(cell.strip() for cell in read(str(answers), texts=None).texts.get("answer", []))
        except DataError:
            filled = True
        if filled:
            raise DataError(
                f"{answers}: found answers in it, expected none: they would be lost; give another folder; nothing was written"
            )
