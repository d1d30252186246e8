"""The front door: the names of the commands; each command's file is loaded when it is called."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from importlib import import_module

import typer

from cli.errors import DataError, one_line

# name -> (module with a function `run`, the line shown by `dalembert --help`)
COMMANDS = {
    "balance": ("cli.balance.command", "Balance rotors from a table of known eccentric masses."),
    "field": ("cli.field.command", "Balance rotors from measured vibration and trial masses."),
    "place": ("cli.place.command", "Put a correction where masses can go: holes, blades, weights in stock."),
    "mechanism": ("cli.mechanism.command", "Solve a planar mechanism: motion, limits, torque, joint forces."),
    "work": ("cli.work.command", "Find the load that balances a table of link states, by virtual work."),
    "body": ("cli.body.command", "Put a body together: inertia, angular momentum, shaft reactions."),
    "spin": ("cli.spin.command", "Turn a body through time: free, under gravity, under a torque."),
    "import": ("cli.imports.command", "Take over a mechanism drawn in another program."),
    "export": (
        "cli.exports.command",
        "Write a mechanism for other programs: DXF, SVG, CSV, URDF, SDF, MJCF.",
    ),
    "completion": ("cli.completion.command", "Print the completion script for bash, zsh or fish."),
    "examples": ("cli.examples.command", "List the worked examples, or write one into the current folder."),
}


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
    from cli.examples.command import describe

    return describe(example)["command"]


def build(called: str | None) -> typer.Typer:
    """Build the command line with only the called command's file loaded."""
    app = typer.Typer(
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        add_completion=False,
        no_args_is_help=True,
        # help is as wide as the terminal
        context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 10_000},
    )
    app.callback()(_front)
    for name, (module, line) in COMMANDS.items():
        if name == called:
            # the front door's own help is shown without it
            from cli.show.commands import with_help

            file = import_module(module)
            kind = with_help(getattr(file, "OPTIONS", ""), getattr(file, "EXAMPLE", ""), _call_of)
            app.command(name, short_help=line, cls=kind)(file.run)
        else:
            app.command(name, short_help=line)(_elsewhere)
    return app


def _words() -> list[str]:
    """Return the words of the command line; where a shell completes it, those that it has so far."""
    if "_DALEMBERT_COMPLETE" not in os.environ:
        return sys.argv[1:]
    from typer.completion import completion_init  # type: ignore[attr-defined]

    completion_init()
    return (os.environ.get("COMP_WORDS") or os.environ.get("_TYPER_COMPLETE_ARGS") or "").split()[1:]


def main(front: Callable[[str | None], Callable[..., object]] = build) -> None:
    """Run the command; a data error is one line on standard error and status 1, never a traceback.

    `front` builds the command line: one that is used many times need not be built each time.
    """
    # Small matrices only: a pool of BLAS threads costs more to start than it gives. The user's word goes first.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    called = next((word for word in _words() if not word.startswith("-")), None)
    if called is not None:
        from cli.read.files import forget

        forget()
    try:
        front(called)(prog_name="dalembert")
    except DataError as error:
        sys.exit(_fail(str(error)))
    except BrokenPipeError:
        # The reader of the pipe has gone (`| head`): nothing more to say, and no complaint at shutdown.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    except MemoryError:
        sys.exit(_fail("not enough memory for this input"))
    except Exception as error:
        if os.environ.get("DALEMBERT_TRACEBACK"):
            raise
        sys.exit(
            _fail(
                f"internal error ({type(error).__name__}: {error}); this is a fault of dalembert, please "
                "report it; DALEMBERT_TRACEBACK=1 shows where"
            )
        )


def _fail(message: str) -> int:
    print(f"dalembert: {one_line(message)}", file=sys.stderr)
    return 1
