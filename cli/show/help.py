"""What a command says of its options: the help below its headings, refusals in plain words, the new names of old options."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from textwrap import wrap
from typing import Any

import typer
from typer.core import TyperCommand

from cli import COMMANDS
from cli.show.commands import SHARED, Declared, HelpLine, help_lines

FURTHER = "Further options"
"""What a heading begins with whose options the help names only; docs/commands.md describes them."""


class Command(TyperCommand):
    """A command whose help has the options below headings: what, how, output."""

    lines: Mapping[str, HelpLine] = {}
    example = ""
    # the call that an example shows, by the example's name
    call_of: Callable[[str], str]

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words; an option of an older version is answered by one line that names the new one."""
        try:
            return super().parse_args(ctx, args)
        except Exception as error:
            if isinstance(error, typer.BadParameter):
                error.message = in_plain_words(error.message)
            # of a NoSuchOption the option
            option = getattr(error, "option_name", None)
            # one of its own lacks its value
            if option is None or any(option in param.opts for param in self.get_params(ctx)):
                raise
            line = renamed(ctx.info_name or "", option)
            if line is None:
                raise
            typer.echo(line, err=True)
            raise typer.Exit(2) from None

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the words behind the command's name: arguments stand there as the help below calls them."""
        return [piece.strip("{}") for piece in super().collect_usage_pieces(ctx)]

    def panels_of(self, ctx: Any, without: Collection[str] = ()) -> dict[str, list[tuple[str, str]]]:
        """Return the rows of help below their headings, further options last; `without`: parameters to leave out."""
        shared = help_lines(SHARED)
        place = {name: line.heading for name, line in {**shared, **self.lines}.items()}
        listed = (
            "Arguments",
            "Options",
            *(line.heading for of in (self.lines, shared) for line in of.values()),
        )
        headings = sorted(listed, key=lambda heading: heading.startswith(FURTHER))
        rows: dict[str, list[tuple[str, str]]] = {heading: [] for heading in headings}
        for param in self.get_params(ctx):
            if param.name in without:
                continue
            record = param.get_help_record(ctx)
            if record is not None:
                heading = "Arguments" if param.param_type_name == "argument" else "Options"
                flags, words = record
                # that a number counts goes without saying
                words = _RANGE.sub(_span, _COUNTS.sub("", words))
                rows[place.get(param.name or "", heading)].append((flags, words))
        return {heading: records for heading, records in rows.items() if records}

    def format_options(self, ctx, formatter) -> None:  # type: ignore[no-untyped-def]
        for heading, records in self.panels_of(ctx).items():
            with formatter.section(heading):
                if heading.startswith(FURTHER):
                    lead = " " * formatter.current_indent
                    text = ", ".join(flags for flags, _ in records)
                    # names are not cut at their hyphens
                    lines = wrap(text, formatter.width - len(lead), break_on_hyphens=False)
                    formatter.write("".join(f"{lead}{line}\n" for line in lines))
                else:
                    formatter.write_dl(records)

    def format_epilog(self, ctx, formatter) -> None:  # type: ignore[no-untyped-def]
        if self.example:
            with formatter.section(f"Example (dalembert examples {self.example} writes its files here)"):
                formatter.write(f"  {self.call_of(self.example)}\n")


# the parser's own words for a value that is no number, or out of range
_NO_NUMBER = re.compile(r"('.*') is not a valid (int|float)\w*(?: range)?\.?", re.DOTALL)
_RANGE = re.compile(r"(?:(\d+)(?:\.0)?<=)?x([<>]=)(\d+)(?:\.0)?")
_COUNTS = re.compile(r"  \[x>=[01](?:\.0)?\]|; x>=[01](?:\.0)?(?=\])")
_OUTSIDE = re.compile(rf"(\S+) is not in the range ({_RANGE.pattern})\.?")


def _span(match: re.Match[str]) -> str:
    """A range of numbers, as help and messages say it."""
    least, sign, bound = match.groups()
    return f"from {least} to {bound}" if least else f"at {'least' if sign == '>=' else 'most'} {bound}"


def in_plain_words(message: str) -> str:
    """Return the parser's message about a value in the words of all other messages.

    >>> in_plain_words("'abc' is not a valid int range."), in_plain_words("'abc' is not a valid float.")
    ("'abc': expected a whole number", "'abc': expected a number")
    >>> in_plain_words("-1 is not in the range x>=1."), in_plain_words("0 is not in the range 1<=x<=100.")
    ('-1: expected a number, at least 1', '0: expected a number from 1 to 100')
    """
    if match := _NO_NUMBER.fullmatch(message):
        return f"{match[1]}: expected a {'whole ' if match[2] == 'int' else ''}number"
    if match := _OUTSIDE.fullmatch(message):
        return f"{match[1]}: expected a number {_RANGE.sub(_span, match[2])}".replace(
            "number at", "number, at"
        )
    return message


def with_help(command: Callable[..., None], call_of: Callable[[str], str]) -> type[Command]:
    """Return the kind of command whose help lists the options of this one, and ends in its example's call."""
    if not isinstance(command, Declared):
        return Command
    own = {
        "lines": help_lines(command.options),
        "example": command.example,
        "call_of": staticmethod(call_of),
    }
    return type("Command", (Command,), own)


# option -> its new spelling; of all commands
EVERYWHERE = {
    "--title": "--about title=…",
    "--machine": "--about machine=…",
    "--customer": "--about customer=…",
    "--date": "--about date=…",
    "--author": "--about author=…",
    "--html": "--page FILE.html",
}
# of the commands on a mechanism
MECHANISM = {
    "--sweep": "--over 0deg:360deg:1deg",
    "--inputs": "--cases FILE.csv",
    "--vary": "--over NAME=FROM:TO:STEP",
    "--variants": "--cases FILE.csv",
    "--change": "--set NAME=VALUE",
    "--graph": "--only NAME,... with --plot FILE",
    "--check": "dalembert inspect FILE.toml",
    "--explain": "dalembert inspect FILE.toml",
    "--forces": "dalembert forces FILE.toml",
    "--flywheel": "dalembert forces FILE.toml --flywheel 0.02",
    "--counterweights": "dalembert forces FILE.toml --counterweights LINK,...",
    "--states": "dalembert forces FILE.toml --states FILE.csv",
    "--equilibrium": "dalembert equilibrium FILE.toml",
    "--time": "dalembert simulate FILE.toml --time 0:10:0.01",
    "--accuracy": "dalembert simulate FILE.toml --accuracy NUMBER",
    "--until": "dalembert simulate FILE.toml --until INPUT=VALUE",
    "--tolerance": "dalembert tolerance FILE.toml",
    "--draws": "dalembert tolerance FILE.toml --draws N",
    "--seed": "--seed of dalembert tolerance and dalembert fit",
    "--distribution": "dalembert tolerance FILE.toml --distribution uniform",
    "--fit": "dalembert fit FILE.toml TARGET.csv",
    "--point": "dalembert fit FILE.toml TARGET.csv --want H",
    "--link": "dalembert fit FILE.toml TARGET.csv --want coupler.angle",
    "--slide": "dalembert fit FILE.toml TARGET.csv --want B.position",
    "--free": "dalembert fit FILE.toml TARGET.csv --free NAME=LOW:HIGH",
    "--weight": "dalembert fit FILE.toml TARGET.csv --weight NAME=NUMBER",
    "--starts": "dalembert fit FILE.toml TARGET.csv --starts N",
    "--best": "dalembert fit FILE.toml TARGET.csv --best N",
    "--newton": "dalembert mechanism FILE.toml --newton",
    "--order": "dalembert mechanism FILE.toml --order velocity",
}
FIELD = {
    "--signal": "dalembert signal FILE.csv",
    "--pulses": "dalembert signal FILE.csv --pulses N",
    "--suggest-trial": "dalembert trial --rotor-mass MASS --speed SPEED --radius LENGTH",
    "--planes": "dalembert trial --planes N",
}


def renamed(command: str, option: str) -> str | None:
    """The line about an option that a command has not; None where it never was one.

    >>> renamed("mechanism", "--sweep")
    'dalembert mechanism: --sweep is now --over 0deg:360deg:1deg'
    """
    on_mechanism = COMMANDS[command][0].startswith("cli.mechanism.")
    own = MECHANISM if on_mechanism else FIELD if command == "field" else {}
    new = EVERYWHERE.get(option) or own.get(option)
    return None if new is None else f"dalembert {command}: {option} is now {new}"
