"""A command run for its result alone: nothing is written or printed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from dalembert.errors import DataError

if TYPE_CHECKING:
    from cli.show.result import Result

_taken: list[list[Result]] = []


def take(result: Result) -> bool:
    """Hand a result to whoever runs the command; False where it is run by a user."""
    if not _taken:
        return False
    _taken[-1].append(result)
    return True


@contextmanager
def _taking() -> Iterator[list[Result]]:
    _taken.append([])
    try:
        yield _taken[-1]
    finally:
        _taken.pop()


@cache
def _runner(name: str) -> Callable[[Sequence[str]], Any]:
    """Return what runs a command on the words behind its name."""
    import typer

    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command(name)(import_module(f"cli.{name}").run)
    built = typer.main.get_command(app)
    return lambda words: built.main(list(words), prog_name="dalembert", standalone_mode=False)


@cache
def options_of(name: str) -> frozenset[str]:
    """Return the options that a command takes."""
    import typer

    app = typer.Typer(add_completion=False)
    app.command(name)(import_module(f"cli.{name}").run)
    return frozenset(flag for parameter in typer.main.get_command(app).params for flag in parameter.opts)


def result_of(words: Sequence[str]) -> Result:
    """Return the result of a command line such as `balance rotor.csv --plane A:20mm`, with its tables and document.

    Raises
    ------
    DataError
        Bad data, or an option that the command does not take.
    """
    name, *rest = words
    with _taking() as taken:
        try:
            _runner(name)([*rest, "--text", "--json"])
        except DataError:
            raise
        except Exception as error:
            # of a usage error the sentence
            message = getattr(error, "format_message", None)
            if message is None:
                raise
            raise DataError(f"{name}: {message()}") from None
    if not taken:
        raise DataError(f"{name}: no result: expected options that compute")
    result = taken[0]
    if "--steps" in rest and result.way is not None:
        return replace(result, way=cache(result.way), shows_way=True)
    return result
