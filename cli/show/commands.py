"""How a command is made of a function: its options as its help lists them, and those that every command shares."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy
from functools import wraps
from inspect import Parameter, signature
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, get_args

import typer
from typer.core import TyperCommand

from cli.read.options import HEAD, column_names
from dalembert.dataclass import dataclass

if TYPE_CHECKING:
    from cli.show.result import Result


SHARED = """
Tables:
  column NAME=HEADER  Read the column HEADER of the file as NAME, such as mass_kg=Masse; repeatable.
Output:
  json  Print one JSON document in SI units with full precision.
  output -o --output FILE  Write the result to FILE (.csv .json .xlsx .parquet .md .tex).
  plot FILE  Draw a picture (.svg, .png or .pdf).
  expect FILE.csv  Compare the result with the expected values in FILE.csv.
  steps  Show the worked solution: equations with their numbers.
  digits  Print only the right digits: computed twice, with 16 and with 32 digits.
  units UNIT,...  Show the columns in these units, such as mm,g,deg,N_mm,rpm.
  report FILE  Write a report (.html or .md) with data, results and method.
Further options (docs/commands.md describes them):
  rtol NUMBER  With --expect: relative tolerance of each value, of angles in radians.
  about KEY=TEXT  With --report: a line of its head: title=, machine=, customer=, date= or author=; repeatable.
  text  Print the aligned table into a pipe too (default there: CSV).
  no_color  Print without colours, as the environment variable NO_COLOR does.
  help  Show this message and exit.
"""
"""What the help says of the options that every command shares."""


FORMS = (".csv", ".json", ".xlsx", ".parquet", ".md", ".tex")
"""Suffixes of what every result can be written as."""


def suffix_among(*suffixes: str) -> Callable[[Path | None], Path | None]:
    """Return the check of a file's option: its suffix is one of these."""

    def check(path: Path | None) -> Path | None:
        if path is not None and path.suffix.lower() not in suffixes:
            report = (
                "; --report writes .html" if path.suffix.lower() == ".html" and ".json" in suffixes else ""
            )
            raise typer.BadParameter(f"'{path}' has no known suffix: expected {', '.join(suffixes)}{report}")
        return path

    return check


def _tolerance(value: float) -> float:
    if not 0 <= value < float("inf"):
        raise typer.BadParameter(f"{value}: expected a number from 0 on, such as 1e-6")
    return value


# each method that dataclass makes costs a tenth of a millisecond at every start
@dataclass(eq=False, repr=False)
class ShowOptions:
    """The options that every command shares, in the order in which its help lists them."""

    json: bool = False
    output: Annotated[Path | None, typer.Option(callback=suffix_among(*FORMS, ".toml"))] = None
    plot: Annotated[Path | None, typer.Option(callback=suffix_among(".svg", ".png", ".pdf"))] = None
    expect: Path | None = None
    rtol: Annotated[float, typer.Option(callback=_tolerance)] = 1e-3
    text: bool = False
    steps: bool = False
    digits: bool = False
    column: list[str] | None = None
    units: str | None = None
    report: Annotated[Path | None, typer.Option(callback=suffix_among(".html", ".htm", ".md"))] = None
    about: list[str] | None = None
    no_color: bool = False

    @property
    def head(self) -> dict[str, str]:
        """The head of the report, as --about has it."""
        result = {}
        for text in self.about or ():
            key, equals, value = text.partition("=")
            if not equals or key.strip() not in HEAD:
                keys = ", ".join(f"{name}=" for name in HEAD)
                raise typer.BadParameter(f"'{text}': expected one of {keys} and a text", param_hint="--about")
            result[key.strip()] = value.strip()
        return result

    @property
    def form(self) -> str:
        """The suffix of what is written to a file, or to a pipe; empty for the terminal's table and for checks."""
        if self.output is not None:
            return self.output.suffix.lower()
        if self.json:
            return ".json"
        return "" if self.text or self.steps or self.expect is not None or sys.stdout.isatty() else ".csv"

    @property
    def holds_one(self) -> bool:
        """Whether what is written holds one table."""
        return self.form in (".csv", ".parquet")

    @property
    def streams(self) -> bool:
        """Whether a table is all that is asked for, so that it can be written block by block."""
        return self.form in (".csv", ".parquet", ".xlsx") and not (self.json or self._others)

    @property
    def streams_json(self) -> bool:
        """Whether one JSON document is: what --digits says of the table would stand in it too."""
        return self.form == ".json" and not (self.json and self.output) and not (self.digits or self._others)

    @property
    def _others(self) -> bool:
        return bool(self.text or self.plot or self.expect or self.report or self.steps)

    @property
    def needs_table(self) -> bool:
        """Whether a table is formed: JSON alone needs none."""
        return not self.json or self.expect is not None or self.output is not None

    @property
    def as_json(self) -> bool:
        """Whether the JSON document is formed."""
        return self.json or (self.output is not None and self.output.suffix.lower() == ".json")


class HelpLine(NamedTuple):
    """The help of a parameter, and the heading that it stands below."""

    heading: str
    flags: Sequence[str]
    metavar: str | None
    help: str


def help_lines(options: str) -> dict[str, HelpLine]:
    """Read the help of a command's parameters.

    Below each heading a line is a parameter's name as the function has it, its flags where they are others than that
    name, the placeholder of its value, and after two blanks its help.
    """
    result = {}
    heading = ""
    for line in filter(str.strip, options.splitlines()):
        if not line.startswith(" "):
            heading = line.removesuffix(":")
            continue
        head, _, words = line.strip().partition("  ")
        name, *others = head.split(" ")
        flags = [word for word in others if word.startswith("-")]
        metavar = " ".join(others[len(flags) :])
        result[name] = HelpLine(heading, flags or [f"--{name.replace('_', '-')}"], metavar or None, words)
    return result


def with_options(
    find: Callable[..., Result],
    options: str,
    chosen: Sequence[str] | None,
    present: Callable[[Result, ShowOptions, Mapping[str, str]], None],
    values: Callable[..., object] | None = None,
    declared: Mapping[str, Parameter] | None = None,
) -> Callable[..., None]:
    """Make a command that takes these of the shared options too, None for all, and presents its result.

    `options` is what its help says of its own, as `help_lines` reads it. `values` is a class of them: then the function takes
    one of these and the shared ones. `declared`: its options, where their text is their only declaration.
    """
    own = dict(declared) if declared is not None else _parameters(values or find, options)
    shared = _parameters(ShowOptions, SHARED)
    shared = {name: p for name, p in shared.items() if chosen is None or name in chosen}
    # a command may have a value of its own below --about, which is no KEY=TEXT
    two = "about" in own
    if two:
        point, head = help_lines(options)["about"], help_lines(SHARED)["about"]
        line = point._replace(help=f"{point.help} KEY=TEXT: {head.help}")
        shared["about"] = shared["about"].replace(annotation=_annotated(list[str] | None, line))

    @wraps(find)
    def run(**values_of: object) -> None:
        from dalembert.tables.headers import rename

        options = ShowOptions(**{name: values_of.pop(name) for name in shared})  # type: ignore[arg-type]
        if two:
            texts = options.about or []
            options.about = [text for text in texts if "=" in text]
            values_of["about"] = next((text for text in reversed(texts) if "=" not in text), None)
        if options.head and options.report is None:
            raise typer.BadParameter("expected --report FILE too", param_hint="--about")
        rename(column_names(options.column))
        messages = {
            name.replace("_", " "): _typed(value)
            for name, value in values_of.items()
            if value != own[name].default and value is not None
        }
        if "show" in own:
            values_of["show"] = options
        result = find(**values_of) if values is None else find(values(**values_of), options)
        with result.within():
            present(result, options, messages)

    mine = [p for name, p in own.items() if name != "show" and not (two and name == "about")]
    parameters = [*mine, *shared.values()]
    run.__signature__ = signature(find).replace(parameters=parameters, return_annotation=None)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in parameters}
    return run


def _typed(value: object) -> str:
    """Return an option's value as the user gave it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return (
        ", ".join(map(str, value))
        if isinstance(value, (list, tuple))
        else str(getattr(value, "value", value))
    )


def _parameters(of: Callable[..., object], options: str) -> dict[str, Parameter]:
    """Return the parameters with their types and help; what is returned is not looked at, nor loaded for it."""
    names, lines = vars(sys.modules[of.__module__]), help_lines(options)
    return {
        name: p.replace(
            kind=Parameter.KEYWORD_ONLY,
            annotation=_annotated(eval(p.annotation, names), lines[name]) if name != "show" else None,
        )
        for name, p in signature(of).parameters.items()
    }


def _annotated(kind: Any, line: HelpLine) -> object:
    """Add to a parameter's type its help."""
    argument = line.heading == "Arguments"
    kind, default = get_args(kind) if hasattr(kind, "__metadata__") else (kind, None)
    info = copy(default) or (typer.Argument() if argument else typer.Option())
    info.param_decls = None if argument else line.flags
    info.metavar, info.help = line.metavar, line.help
    return Annotated[kind, info]


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
            from cli.renamed import renamed

            line = renamed(ctx.info_name or "", option)
            if line is None:
                raise
            typer.echo(line, err=True)
            raise typer.Exit(2) from None

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
                rows[place.get(param.name or "", heading)].append((flags, _RANGE.sub(_span, words)))
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
_TYPES = {
    "integer": "a whole number",
    "int range": "a whole number",
    "float": "a number",
    "float range": "a number",
}
_NO_NUMBER = re.compile(r"('.*') is not a valid (integer|int range|float range|float)\.?", re.DOTALL)
_RANGE = re.compile(r"(?:(\d+)(?:\.0)?<=)?x([<>]=)(\d+)(?:\.0)?")
_OUTSIDE = re.compile(rf"(\S+) is not in the range ({_RANGE.pattern})\.?")


def _span(match: re.Match[str]) -> str:
    """A range of numbers, as help and messages say it."""
    least, sign, bound = match.groups()
    return f"from {least} to {bound}" if least else f"from {bound} on" if sign == ">=" else f"at most {bound}"


def in_plain_words(message: str) -> str:
    """Say what the parser has against a value as all other messages do.

    >>> in_plain_words("'abc' is not a valid int range.")
    "'abc': expected a whole number"
    >>> in_plain_words("-1 is not in the range x>=1."), in_plain_words("0 is not in the range 1<=x<=100.")
    ('-1: expected a number from 1 on', '0: expected a number from 1 to 100')
    """
    if match := _NO_NUMBER.fullmatch(message):
        return f"{match[1]}: expected {_TYPES[match[2]]}"
    if match := _OUTSIDE.fullmatch(message):
        return f"{match[1]}: expected a number {_RANGE.sub(_span, match[2])}"
    return message


def with_help(options: str, example: str, call_of: Callable[[str], str]) -> type[Command]:
    """Return the kind of command whose help says this of its options, and ends in this example's call."""
    own = {"lines": help_lines(options), "example": example, "call_of": staticmethod(call_of)}
    return type("Command", (Command,), own)


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
    parameters = {}
    for name, line in help_lines(text).items():
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
            # typer shows the words of a choice itself
            words = "|" in (shown or "") and (shown or "").islower()
            info = typer.Option(*line.flags, metavar=None if words else shown, help=line.help, **more)
        parameters[name] = Parameter(
            name, Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, info]
        )
    return parameters


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
