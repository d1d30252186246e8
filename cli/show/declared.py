"""Options from their text: what a command's help prints is what is parsed; an option is declared nowhere else.

Below each heading a line is an option's name, its flags where they are others than that name, what stands for its value,
and behind two blanks its help:

    at INPUT...  A pose, such as 60deg; repeatable.
    order position|velocity|acceleration|jerk  How often places are differentiated.
    seed N=0  Random seed of --draws.
    newton  All loops at once by Newton-Raphson.

A value of words parted by | is a choice; N is a whole number from 1 on, N=0 one from 0 on, NUMBER a number; ... makes a
list; without a value it is a flag; behind N=, NUMBER= or a choice= stands the default. FILE(.html) has one of these
suffixes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from inspect import Parameter
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from cli.show.commands import suffix_among, told

_DEFAULT = re.compile(r"(N|NUMBER|[a-z|-]+)=(.*)")
Complete = Callable[[Any, list[str], str], list[str]]


def parameters(
    text: str,
    eager: Mapping[str, Callable[[bool], None]] | None = None,
    complete: Mapping[str, Complete] | None = None,
) -> dict[str, Parameter]:
    """The parameters of a command, by their names.

    Parameters
    ----------
    eager : mapping of name to function
        Flags that are answered before anything else is looked at.
    complete : mapping of name to function
        What a shell completes an option's value with.
    """
    found = {}
    for name, line in told(text).items():
        kind, default, more = _kind(line.metavar or "", line.heading == "Arguments")
        shown = line.metavar
        if shown is not None and not shown.endswith(",..."):
            shown = shown.removesuffix("...")
        if "=" in (line.metavar or "") and (match := _DEFAULT.fullmatch(line.metavar or "")):
            shown = match[1]
        if eager and name in eager:
            more = {"is_eager": True, "callback": _answered(eager[name])}
        if complete and name in complete:
            more["autocompletion"] = complete[name]
        if line.heading == "Arguments":
            info = typer.Argument(metavar=shown, help=line.help, **more)
        else:
            words = "|" in (shown or "") and kind is not str
            info = typer.Option(*line.flags, metavar=None if words else shown, help=line.help, **more)
        found[name] = Parameter(
            name, Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, info]
        )
    return found


def _kind(metavar: str, argument: bool) -> tuple[Any, Any, dict[str, Any]]:
    """An option's type, its default, and further settings."""
    if not metavar:
        return bool, False, {}
    if argument:
        optional = metavar.startswith("[")
        if metavar.endswith("..."):
            return list[str], Parameter.empty, {}
        return (str | None, None, {}) if optional else (str, Parameter.empty, {})
    if metavar.endswith("...") and not metavar.endswith(",..."):
        return list[str] | None, None, {}
    match = _DEFAULT.fullmatch(metavar)
    value, default = (match[1], match[2]) if match else (metavar, None)
    if value == "N":
        least = 1 if default is None else 0
        return (int, int(default), {"min": least}) if default else (int | None, None, {"min": least})
    if value == "NUMBER":
        return (float, float(default), {}) if default else (float | None, None, {})
    if "|" in value and value.islower():
        choice = Literal[tuple(value.split("|"))]  # type: ignore[valid-type]
        return (choice, default, {}) if default else (choice | None, None, {})
    suffixes = re.findall(r"\.\w+", value) if "(" in value else []
    if suffixes:
        return Path | None, None, {"callback": suffix_among(*suffixes)}
    return str | None, None, {}


def _answered(answer: Callable[[bool], None]) -> Callable[[bool], bool]:
    """A flag's function as a callback: what it prints is all."""

    def callback(value: bool) -> bool:
        if value:
            answer(value)
            raise typer.Exit
        return value

    return callback
