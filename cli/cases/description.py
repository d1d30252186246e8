"""The mechanism's file with the tables beside it, read as every file is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from cli.cases.tables_beside import beside
from cli.read.about import about
from dalembert.errors import DataError
from dalembert.tables.files import read_bytes, remember

if TYPE_CHECKING:
    from virtualwork import Mechanism


class Described(NamedTuple):
    """A mechanism as its file describes it."""

    mechanism: Mechanism
    bare: dict[str, str]
    """The units of bare lengths and angles, as far as `[units]` names them."""
    warnings: list[str]
    """Remarks about the tables beside the file."""
    about: dict[str, str]
    """What the file has for the head of a report."""


def load(path: str) -> Described:
    """Read a description; - is standard input."""
    import tomllib

    from virtualwork import Mechanism

    remember(path)
    file, data = read_bytes(path)
    warnings: list[str] = []
    try:
        text = data.decode("utf-8-sig")
        folder = Path() if path == "-" else Path(path).parent
        mechanism = Mechanism.from_toml_text(text, file, folder, lambda table: _beside(warnings, table))
    except UnicodeDecodeError:
        raise DataError(f"{file}: this is not text: expected TOML in UTF-8") from None
    except ValueError as error:
        raise DataError(str(error)) from None
    document = tomllib.loads(text)
    units = {kind: str(unit) for kind, unit in document.get("units", {}).items()}
    return Described(mechanism, units, warnings, about(file, document))


def _beside(warnings: list[str], path: Path) -> bytes:
    # loaded where the file has a table beside it

    return beside(warnings, path)


@contextmanager
def naming(file: str) -> Iterator[None]:
    """Name the file in what is wrong with a mechanism."""
    from virtualwork import MechanismError

    try:
        yield
    except MechanismError as error:
        raise DataError(f"{error}" if str(error).startswith(file) else f"{file}: {error}") from None
