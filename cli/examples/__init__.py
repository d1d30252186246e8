"""`dalembert examples`: the worked examples, listed or written into the current folder."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from cli.show.output import reported
from dalembert.errors import DataError
from dalembert.hints import nearest

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result, Section

EXAMPLES = Path(__file__).parent
ABOUT = "example.toml"
EXPECTED = "expected.csv"


METHOD = (
    "Every example is run by the project's own tests, and compared with its expected.csv where it has one: the same check "
    "is `--expect expected.csv` behind its command."
)


OPTIONS = """
Arguments:
  name [NAME]  Example whose files are written into the current folder.
"""


@reported(OPTIONS)
def run(options: SimpleNamespace, _: ShowOptions) -> Result:
    """List the worked examples; with NAME, write its input files into the current folder and show its command."""
    from dalembert.results.result import Result, Sheet

    name = options.name
    listed = names() if name is None else [name]
    if name is not None and name not in names():
        hint = nearest(name.lower(), names())
        raise DataError(f"no example '{name}': expected one that dalembert examples lists{hint}")
    about = {folder: describe(folder) for folder in listed}
    files = {} if name is None else _here(name)
    width = max(map(len, about))
    lines = [f"{folder.ljust(width)}  {example['line']}" for folder, example in about.items()]
    if name is not None:
        lines = [f"wrote {here}{kept}" for here, (_, kept) in files.items()]
        lines += [f"source: {about[name]['source']}", "run:", f"  {about[name]['command']}"]
    return Result(
        notes=lambda: "".join(f"{line}\n" for line in lines),
        beside={here: partial(bytes, data) for here, (data, _) in files.items()},
        sheets=lambda: [Sheet("", [_section(folder, example, files) for folder, example in about.items()])],
        method=METHOD,
        about={"title": "Worked examples" if name is None else f"Worked example: {name}"},
    )


def _here(name: str) -> dict[Path, tuple[bytes, str]]:
    """Return the files of an example by the names that they get here, each with a remark on its name.

    Raises
    ------
    DataError
        A file of the user's own has that name.
    """
    result = {}
    own = [
        *EXAMPLES.joinpath(name).iterdir(),
        *(EXAMPLES / each for each in describe(name).get("beside", ())),
    ]
    for file in sorted(own, key=lambda file: file.name):
        if file.name == ABOUT:
            continue
        here = Path(file.name)
        data = file.read_bytes()
        if here.name == EXPECTED and _is_an_examples(here) and here.read_bytes() != data:
            here = Path(f"{name}-{EXPECTED}")
        ours = _is_an_examples(here) or (here.is_file() and here.read_bytes() == data)
        if here.exists() and not ours:
            raise DataError(
                f"{here}: this folder has another file of this name: nothing was written; use another folder"
            )
        result[here] = data, "" if here.name == file.name else f" ({file.name} is another example's)"
    return result


def _section(name: str, example: Mapping[str, str], files: Mapping[Path, tuple[bytes, str]]) -> Section:
    """Return what a report says of an example, and its files."""
    from dalembert.results.report import CODE, text_of_file
    from dalembert.results.result import Section

    parts = [example["line"], f"source: {example['source']}", CODE + example["command"]]
    for here, (data, _) in files.items():
        parts += [f"{here}:", text_of_file(data)]
    return Section(name, parts)


def _is_an_examples(here: Path) -> bool:
    """Whether a file is as some example wrote it, so that nothing of the user's is lost by writing over it."""
    return here.is_file() and any(
        folder.joinpath(here.name).is_file() and folder.joinpath(here.name).read_bytes() == here.read_bytes()
        for folder in EXAMPLES.iterdir()
    )


def names() -> list[str]:
    """Return the names of the examples, in order."""
    return sorted(folder.name for folder in EXAMPLES.iterdir() if folder.joinpath(ABOUT).is_file())


def describe(name: str) -> dict[str, Any]:
    """Return what an example's `example.toml` says of it: line, command, source; beside, which it has of other examples."""
    about: dict[str, Any] = tomllib.loads(EXAMPLES.joinpath(name, ABOUT).read_text(encoding="utf-8"))
    return about
