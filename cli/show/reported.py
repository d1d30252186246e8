"""Commands that write files of their own kind, and a report of them where it is asked for."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from cli.errors import one_line
from cli.read.about import HEAD
from cli.read.files import refuse_inputs
from cli.show.commands import ShowOptions, with_options
from cli.show.output import reported as pages_of

if TYPE_CHECKING:
    from cli.show.columns import Result


def reported(options: str) -> Callable[[Callable[..., Result]], Callable[..., None]]:
    """Make a command of a function that returns the files to be written and what a report says of them.

    `options` is what the help says of its own. The files are `beside` of its result, `notes` is what goes to standard output, `warnings` are the remarks.
    """
    return lambda find: with_options(find, options, ("report", *HEAD), _hand_on)


def _hand_on(result: Result, options: ShowOptions, asked: Mapping[str, str]) -> None:
    from cli.show.files import write_all

    pages = pages_of(result, options, asked)
    refuse_inputs([*result.beside, *pages])
    for note in result.warnings:
        print(f"note: {one_line(note)}", file=sys.stderr)
    write_all({**result.beside, **pages})
    sys.stdout.write(result.notes())
