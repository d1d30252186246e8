"""`dalembert completion`: the script that lets a shell complete commands and options."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from enum import StrEnum
from functools import partial
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer
from typer.completion import get_completion_script  # type: ignore[attr-defined]

from cli import COMPLETE, completed_words

if TYPE_CHECKING:
    from virtualwork import Mechanism


NAMES = """
# NAME=VALUE is one word, and no blank follows NAME=
COMP_WORDBREAKS=${COMP_WORDBREAKS//=/}
"""


class Shell(StrEnum):
    """The shells that are known."""

    bash = "bash"
    zsh = "zsh"
    fish = "fish"


def run(
    shell: Annotated[Shell, typer.Argument(metavar="SHELL", help="The shell: bash, zsh or fish.")],
) -> None:
    """Print the completion script of a shell: source <(dalembert completion bash), in fish dalembert completion fish | source."""
    script = get_completion_script(prog_name="dalembert", complete_var=COMPLETE, shell=shell.value)
    if shell is Shell.bash:
        ends = "    [[ ${COMPREPLY[0]} == *= ]] && compopt -o nospace 2>/dev/null\n    return 0\n"
        script = script.replace("    return 0\n", ends) + NAMES
    typer.echo(script)


Words = Callable[[typer.Context], Iterable[str]]


def complete(run: Callable[..., object], command: str) -> None:
    """Add to a command's parameters what completes their values; its options stay as they are."""
    if command == "examples":
        _add(run, {"name": _one_of(_examples)})
        return
    dimension, target = _one_of(_dimensions), _one_of(_targets)
    ranges = _one_of(lambda ctx: [*_inputs(ctx), *_dimensions(ctx)])
    words = {"set": dimension, "over": ranges, "free": dimension, "want": target, "column": _headers}
    # of `work` and `export` --only names something else
    words |= {"only": partial(_after_comma, _quantities)} if "over" in signature(run).parameters else {}
    _add(run, words)


def _add(
    run: Callable[..., object], completions: dict[str, Callable[[typer.Context, str], list[str]]]
) -> None:
    for name, words in completions.items():
        parameter = signature(run).parameters.get(name)
        if parameter is not None:
            (_, info) = get_args(parameter.annotation)
            info.autocompletion = _quiet(words)


def _quiet(words: Callable[[typer.Context, str], list[str]]) -> Callable[[typer.Context, str], list[str]]:
    """Return what completes a word, nothing where the file cannot be read: a shell shows no messages."""

    def completed(ctx: typer.Context, incomplete: str) -> list[str]:
        try:
            return words(ctx, incomplete)
        except (OSError, ValueError, RuntimeError):
            return []

    return completed


def _one_of(words: Words) -> Callable[[typer.Context, str], list[str]]:
    return lambda ctx, incomplete: [word for word in words(ctx) if word.startswith(incomplete)]


def _after_comma(words: Words, ctx: typer.Context, incomplete: str) -> list[str]:
    """Complete the last name of a list."""
    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{word}" for word in words(ctx) if word.startswith(last)]


def _files() -> list[str]:
    """The files that the command line names so far: the parser knows none before the option is complete."""
    return [word for word in completed_words() if Path(word).is_file()]


def _mechanism() -> Mechanism:
    from virtualwork import Mechanism

    (file,) = [name for name in _files() if name.endswith(".toml")]
    return Mechanism.from_toml(file)


def _examples(_: typer.Context) -> list[str]:
    from cli.examples import names

    return names()


def _quantities(ctx: typer.Context) -> list[str]:
    """The names that --only takes: of all of a point, link or joint, and of each of its quantities."""
    from virtualwork import quantities
    from virtualwork.plan.joint_forces import pairs
    from virtualwork.plan.steps import joints

    m = _mechanism()
    every = quantities.places(m, 3)
    if ctx.info_name in ("forces", "inspect", "simulate", "tolerance"):
        every += quantities.forces(m, pairs(joints(m)))
    owners = [name for each in every for name in each.owners]
    return list(dict.fromkeys([*owners, *(name for each in every for name in each.names[:1])]))


def _targets(_: typer.Context) -> list[str]:
    """The names that --want takes."""
    from cli.mechanism.targets import every_wanted

    return [name for each in every_wanted(_mechanism()) for name in each.names]


def _dimensions(_: typer.Context) -> list[str]:
    """The paths of a mechanism's numbers."""
    from virtualwork.describe.dimensions import dimensions

    return [f"{name}=" for name in dimensions(_mechanism())]


def _inputs(_: typer.Context) -> list[str]:
    """The inputs of a mechanism."""
    return [f"{entry.name}=" for entry in _mechanism().inputs]


def _headers(_: typer.Context, incomplete: str) -> list[str]:
    """`NAME=` with the headers of the tables in the command."""
    from dalembert.tables.sources import open_source

    name, equals, begun = incomplete.partition("=")
    if not equals:
        return []
    headers = [header for path in _files() for header in open_source(path, {}, None).header]
    return [f"{name}={header}" for header in headers if header.startswith(begun)]
