"""The folder of a class: written whole or not at all; sheets and questions that an earlier run left there are removed."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from cli.exercise.questions import NUMBAS, PRAIRIELEARN, SERVER, TAG
from cli.exercise.sheets import mark
from dalembert.errors import DataError
from dalembert.tables.files import is_input
from dalembert.tables.table import read


def put(folder: Path, files: Mapping[str, bytes]) -> list[str]:
    """Write all files of a folder, or none: a new folder appears at once, in one that is there files are replaced.

    Returns
    -------
    list of str
        The files of an earlier run that were removed: sheets of students who are not in the class, questions for systems
        that are not requested. They have the numbers of an older key.

    Raises
    ------
    DataError
        Where the folder cannot be written, or would lose answers that were filled in, or one of the inputs.
    """
    _refuse(folder, files)
    parent = folder.parent
    if not parent.is_dir():
        raise DataError(f"{folder}: cannot write: no folder {parent}")
    removed: list[str] = []
    try:
        made = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", suffix=".part", dir=parent))
        try:
            for name, data in files.items():
                path = made / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(data)
            if folder.is_dir():
                removed = [name for name in _earlier(folder) if name not in files]
                for name in removed:
                    folder.joinpath(name).unlink()
                _remove_empty_folders(folder, removed)
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
    return removed


def _earlier(folder: Path) -> Iterator[str]:
    """Yield sheets and questions in a folder that this command wrote: they say so themselves, a sheet with its name."""
    for path in sorted(folder.glob("sheet-*.html")):
        if path.is_file() and mark(path.name).encode() in path.read_bytes():
            yield path.name
    exam = folder / NUMBAS
    if exam.is_file() and f'"{TAG}"'.encode() in exam.read_bytes():
        yield NUMBAS
    for server in sorted(folder.glob(f"{PRAIRIELEARN}/*/server.py")):
        if server.read_bytes() == SERVER.encode():
            question = server.parent
            files = (question / name for name in ("info.json", "question.html", "server.py", "variants.json"))
            yield from (path.relative_to(folder).as_posix() for path in files if path.is_file())


def _remove_empty_folders(folder: Path, removed: Iterable[str]) -> None:
    """Remove the folders within a folder that the removal of files has emptied."""
    within = {parent for name in removed for parent in Path(name).parents} - {Path()}
    for parent in sorted(within, reverse=True):
        # one that has other files stays
        with suppress(OSError):
            folder.joinpath(parent).rmdir()


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
                f"{answers}: its answers would be lost: expected another folder; nothing was written"
            )
