"""The front door: the names of the commands; each command's file is loaded when it is called."""

from __future__ import annotations

import errno
import os
import sys
import warnings
from collections.abc import Callable
from io import TextIOWrapper

import typer
from typer.core import TyperGroup

from cli import COMMANDS, COMPLETE, GROUPS, completed_words, function_of
from dalembert.arithmetic.choice import EngineError, wanted
from dalembert.errors import DataError, one_line


class Front(TyperGroup):
    """The front door: its help has the commands in groups."""

    def format_commands(self, ctx, formatter) -> None:  # type: ignore[no-untyped-def]
        """Write a heading for each group."""
        for heading, names in GROUPS.items():
            with formatter.section(heading):
                formatter.write_dl([(name, line) for name, (_, line) in names.items()])


# a file of standard output that takes no more
FULL = (errno.ENOSPC, errno.EFBIG, errno.EIO, errno.EDQUOT)


def _version(show: bool) -> None:
    if show:
        from importlib.metadata import version

        typer.echo(f"dalembert {version('dalembert')}")
        raise typer.Exit


def _front(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Show the version and exit."
    ),
) -> None:
    """Balancing of rotors and mechanics of mechanisms, by d'Alembert's principle."""


def _elsewhere() -> None:
    """Stand in for a command that was not called: its file is not loaded."""


def _call_of(example: str) -> str:
    from cli.examples import describe

    return str(describe(example)["command"])


def build(called: str | None) -> typer.Typer:
    """Build the command line; of a command that is called, that command alone, and its file alone is loaded.

    Help, completion and a name that is mistyped need the names of all: to build the others takes longer than to read a table.
    """
    called = called or ""
    names = [called] if called in COMMANDS and COMPLETE not in os.environ else [*COMMANDS]
    app = typer.Typer(
        cls=Front,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        add_completion=False,
        no_args_is_help=True,
        # help is as wide as the terminal
        context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 10_000},
    )
    app.callback()(_front)
    for name in names:
        _, line = COMMANDS[name]
        if name == called:
            # the front door's own help is shown without it
            from cli.show.help import with_help

            function = function_of(name)
            if COMPLETE in os.environ:
                from cli.completion import complete

                complete(function, name)
            app.command(name, short_help=line, cls=with_help(function, _call_of))(function)
        else:
            app.command(name, short_help=line)(_elsewhere)
    return app


def _words() -> list[str]:
    """Return the words of the command line; where a shell completes it, those that it has so far."""
    if COMPLETE not in os.environ:
        return sys.argv[1:]
    from typer.completion import completion_init  # type: ignore[attr-defined]

    completion_init()
    return completed_words()[1:]


def main(front: Callable[[str | None], Callable[..., object]] = build) -> None:
    """Run the command; a data error is one line on standard error and status 1, never a traceback.

    `front` builds the command line: one that is used many times need not be built each time.
    """
    # Small matrices only: a pool of BLAS threads costs more to start than it gives. The user's word goes first.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # the command says on standard error what is doubtful of a guess
    warnings.filterwarnings("ignore", r"\[(guess|input)\]", UserWarning)
    called = next((word for word in _words() if not word.startswith("-")), None)
    if called is not None:
        from dalembert.tables.files import forget

        forget()
    # what the encoding of a pipe or a console lacks is shown as its code, as on standard error
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        wanted()  # an unknown engine is refused before any work
        try:
            front(called)(prog_name="dalembert")
        finally:
            # what cannot be written is an error here, not at shutdown
            sys.stdout.flush()
    except (DataError, EngineError) as error:
        sys.exit(_fail(str(error)))
    except BrokenPipeError:
        # the reader of the pipe has gone (`| head`): nothing more to say
        _silence()
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    except MemoryError:
        sys.exit(_fail("not enough memory for this input"))
    except UnicodeEncodeError as error:
        part = error.object[max(error.start - 20, 0) : error.end + 20]
        text = next((word for word in sys.argv if error.object[error.start] in word), part)
        sys.exit(_fail(f"{text!a}: a character that UTF-8 does not have: expected text in UTF-8"))
    except Exception as error:
        if isinstance(error, OSError) and error.errno in FULL and error.filename is None:
            _silence()
            sys.exit(_fail(f"standard output: cannot write: {error.strerror}"))
        if os.environ.get("DALEMBERT_TRACEBACK"):
            raise
        sys.exit(
            _fail(
                f"internal error ({type(error).__name__}: {error}); this is a fault of dalembert, please "
                "report it; DALEMBERT_TRACEBACK=1 shows where"
            )
        )


def _silence() -> None:
    """Send standard output nowhere: shutdown then does not complain of what it cannot write."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(message: str) -> int:
    print(f"dalembert: {one_line(message)}", file=sys.stderr)
    return 1
