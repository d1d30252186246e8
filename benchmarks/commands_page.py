"""Write docs/commands.md from the commands' own help: `python -m benchmarks.commands_page > docs/commands.md`."""

from __future__ import annotations

import inspect
from collections.abc import Iterator

import typer
from typer.core import TyperGroup

from cli import COMMANDS
from cli.app import build
from cli.examples import describe
from cli.show.commands import SHARED, help_lines
from cli.show.help import Command

_HEAD = """# Commands and options

Every command with its arguments and options, as `dalembert COMMAND --help` has them. Method and sources: [balancing](balancing.md),
[balancing in the field](field-balancing.md), [mechanisms](mechanisms.md), [virtual work](virtual-work.md), [rigid bodies](rigid-body.md).
[Tables](tables.md) describes headers, units and output. This page is written by
`python -m benchmarks.commands_page`.
"""


def page() -> Iterator[str]:
    """Yield the lines of the page."""
    yield from _HEAD.splitlines()
    of_all = help_lines(SHARED)
    shared: dict[str, list[tuple[str, str]]] = {}
    for name, (_, line) in COMMANDS.items():
        group = typer.main.get_command(build(name))
        assert isinstance(group, TyperGroup)
        command = group.commands[name]
        assert isinstance(command, Command)
        context = typer.Context(command, info_name=name, parent=typer.Context(group, info_name="dalembert"))
        yield from ("", f"## dalembert {name}", "", line)
        yield from ("", *inspect.cleandoc(command.help or "").replace("*", r"\*").splitlines())
        parameters = {param.name or "" for param in command.get_params(context)}
        solves = "json" in parameters
        # --about may be a value of the command itself too
        alike = [each for each in of_all if solves and each not in command.lines]
        for heading, records in command.panels_of(context, without=alike).items():
            yield from _table(heading, records)
        if solves and not shared:
            shared = command.panels_of(context, without=parameters - {*of_all})
        if command.example:
            described = describe(command.example)
            yield from ("", "```sh", f"dalembert examples {command.example}", described["command"], "```")
    yield from ("", "## What every command that solves takes too")
    for heading, records in shared.items():
        yield from _table(heading, records)


def _table(heading: str, records: list[tuple[str, str]]) -> Iterator[str]:
    yield from ("", f"| {heading} | |", "|---|---|")
    yield from (f"| `{_cell(option)}` | {_cell(told)} |" for option, told in records)


def _cell(text: str) -> str:
    return " ".join(text.replace("|", r"\|").split())


if __name__ == "__main__":
    print("\n".join(page()))
