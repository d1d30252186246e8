"""`dalembert examples`: the worked examples, listed or written into the current folder."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Annotated

import typer

from cli.errors import DataError, nearest
from cli.show.files import write

EXAMPLES = files("cli") / "examples"
ABOUT = "example.toml"
EXPECTED = "expected.csv"


def run(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="The example to write here.")] = None,
) -> None:
    """List the worked examples; with NAME, write its input files into the current folder and show its command."""
    if name is None:
        about = {folder: describe(folder) for folder in names()}
        width = max(map(len, about))
        for folder, described in about.items():
            print(f"{folder.ljust(width)}  {described['line']}")
        return
    if name not in names():
        raise DataError(f"no example '{name}': expected one of {', '.join(names())}{nearest(name, names())}")
    described = describe(name)
    for file in sorted(EXAMPLES.joinpath(name).iterdir(), key=lambda file: file.name):
        if file.name == ABOUT:
            continue
        here = Path(file.name)
        data = file.read_bytes()
        if here.name == EXPECTED and _is_an_examples(here) and here.read_bytes() != data:
            here = Path(f"{name}-{EXPECTED}")
        known = _is_an_examples(here) or (here.is_file() and here.read_bytes() == data)
        if here.exists() and not known:
            raise DataError(f"{here}: there is another file of this name here: nothing was overwritten")
        write(here, data)
        kept = "" if here.name == file.name else f" ({file.name} is another example's)"
        print(f"wrote {here}{kept}")
    print(f"source: {described['source']}\nrun:\n  {described['command']}")


def _is_an_examples(here: Path) -> bool:
    """Whether a file is as some example wrote it, so that nothing of the user's is lost by writing over it."""
    return here.is_file() and any(
        folder.joinpath(here.name).is_file() and folder.joinpath(here.name).read_bytes() == here.read_bytes()
        for folder in EXAMPLES.iterdir()
    )


def names() -> list[str]:
    """Return the names of the examples, in order."""
    return sorted(folder.name for folder in EXAMPLES.iterdir() if folder.joinpath(ABOUT).is_file())


def describe(name: str) -> dict[str, str]:
    """Return what an example's `example.toml` says of it: line, command, source."""
    about: dict[str, str] = tomllib.loads(EXAMPLES.joinpath(name, ABOUT).read_text(encoding="utf-8"))
    return about
