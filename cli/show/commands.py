"""How a command is made of a function: its options as its help lists them, and those that every command shares."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache, cached_property
from inspect import Parameter, Signature
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import typer

from cli.read.options import bad, column_names
from dalembert.results.about import HEAD

if TYPE_CHECKING:
    from dalembert.results.result import Result


SHARED = """
Output:
  json  Print one JSON document in SI units with full precision.
  output -o --output FILE  Write the result (.csv .json .xlsx .parquet .md .tex).
  plot FILE  Draw a picture (.svg .png .pdf).
  expect FILE.csv  Compare the result with the expected values in FILE.csv.
  steps  Show the worked solution: equations with their numbers.
  digits  Print only the digits that hold against rounding.
  units UNIT,...  Units of the columns, such as mm,g,deg,N_mm,rpm.
  report FILE  Write a report (.html .md): data, results, method.
Tables:
  column NAME=HEADER...  Read column HEADER as NAME: mass_kg=Masse; repeatable.
Further options (docs/commands.md describes them):
  rtol NUMBER=1e-3  With --expect: relative tolerance of each value, of angles in radians.
  text  Print the aligned table into a pipe too (default there: CSV).
  about KEY=TEXT...  With --report: a line of its head: title=, machine=, customer=, date= or author=; repeatable.
  no_color  Print without colours, as the environment variable NO_COLOR does.
  help  Show this message and exit.
"""
"""What the help says of the options that every command shares."""


FORMS = (".csv", ".json", ".xlsx", ".parquet", ".md", ".tex")
"""Suffixes of what every result can be written as."""


def suffix_among(*suffixes: str) -> Callable[[str | Path | None], Path | None]:
    """Return the check of a file's option: its suffix is one of these, any where there are none."""

    def check(name: str | Path | None) -> Path | None:
        if name is None:
            return None
        path = Path(name)
        if suffixes and path.suffix.lower() not in suffixes:
            report = (
                "; --report writes .html" if path.suffix.lower() == ".html" and ".json" in suffixes else ""
            )
            raise typer.BadParameter(f"'{path}' has no known suffix: expected {', '.join(suffixes)}{report}")
        return path

    return check


def _tolerance(value: float) -> float:
    if not 0 <= value < float("inf"):
        raise typer.BadParameter(f"{value}: expected a number, at least 0, such as 1e-6")
    return value


@cache
def shared_parameters(*forms: str) -> dict[str, Parameter]:
    """Return the parameters that every command shares; `forms` are the further suffixes that its -o takes."""
    return parameters(
        SHARED.replace("  help  Show this message and exit.\n", ""),
        checks={
            "output": suffix_among(*FORMS, *forms),
            "plot": suffix_among(".svg", ".png", ".pdf"),
            "expect": suffix_among(),
            "report": suffix_among(".html", ".htm", ".md"),
            "rtol": _tolerance,
        },
    )


class ShowOptions(SimpleNamespace):
    """The values of the options that every command shares."""

    json: bool
    output: Path | None
    plot: Path | None
    expect: Path | None
    rtol: float
    text: bool
    steps: bool
    digits: bool
    column: list[str] | None
    units: str | None
    report: Path | None
    about: list[str] | None
    no_color: bool

    def __init__(self, **values: object) -> None:
        """Take these values; an option that is not among them has its default."""
        super().__init__(**({name: p.default for name, p in shared_parameters().items()} | values))

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

    @cached_property
    def chosen_units(self) -> dict[str, str] | None:
        """The units that `--units` names: dimension -> unit."""
        from dalembert.results.chosen_units import chosen_units

        try:
            return None if self.units is None else chosen_units(self.units)
        except ValueError as error:
            raise bad("--units", error) from None

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
        """Whether the request is a table alone, which can be written block by block."""
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


class Declared:
    """A function as a command: its text declares its own options, and it takes some of the shared ones.

    The parser reads the signature of the command that is called, and the text of its options is read then: a file may
    declare several commands.
    """

    def __init__(
        self,
        find: Callable[[SimpleNamespace, ShowOptions], Result],
        options: str,
        shared: Collection[str],
        present: Callable[[Result, ShowOptions, Mapping[str, str]], None],
        eager: Mapping[str, Callable[[bool], None]] | None,
        forms: Sequence[str],
        example: str,
    ) -> None:
        """Take the function, and what `with_options` takes."""
        self.find, self.options, self.shared, self.present = find, options, shared, present
        self.eager, self.forms, self.example = eager, forms, example
        self.__name__, self.__doc__, self.__module__ = find.__name__, find.__doc__, find.__module__
        # each parameter has its own annotation
        self.__annotations__: dict[str, object] = {}

    @cached_property
    def own(self) -> dict[str, Parameter]:
        """The parameters of its own."""
        return parameters(self.options, self.eager)

    @cached_property
    def common(self) -> dict[str, Parameter]:
        """The shared parameters that it takes."""
        common = {name: p for name, p in shared_parameters(*self.forms).items() if name in self.shared}
        # a command may have a value of its own below --about, which is no KEY=TEXT
        if "about" in self.own:
            point, head = help_lines(self.options)["about"], help_lines(SHARED)["about"]
            line = point._replace(help=f"{point.help} KEY=TEXT, {head.help[0].lower()}{head.help[1:]}")
            info = typer.Option(*line.flags, metavar=line.metavar, help=line.help)
            common["about"] = common["about"].replace(annotation=Annotated[list[str] | None, info])
        return common

    @cached_property
    def __signature__(self) -> Signature:
        own = (p for name, p in self.own.items() if name not in self.common)
        return Signature([*own, *self.common.values()])

    def __call__(self, **values: object) -> None:
        """Run the function, and show its result."""
        from dalembert.tables.headers import rename

        show = ShowOptions(**{name: values.pop(name) for name in self.common})
        if "about" in self.own:
            texts = show.about or []
            show.about = [text for text in texts if "=" in text]
            values["about"] = next((text for text in reversed(texts) if "=" not in text), None)
        if show.head and show.report is None:
            raise typer.BadParameter("expected --report FILE too", param_hint="--about")
        rename(column_names(show.column))
        call = {
            name.replace("_", " "): _typed(value)
            for name, value in values.items()
            if value != self.own[name].default and value is not None
        }
        result = self.find(SimpleNamespace(**values), show)
        with result.within():
            self.present(result, show, call)


def with_options(
    options: str,
    shared: Collection[str],
    present: Callable[[Result, ShowOptions, Mapping[str, str]], None],
    eager: Mapping[str, Callable[[bool], None]] | None = None,
    forms: Sequence[str] = (),
    example: str = "",
) -> Callable[[Callable[[SimpleNamespace, ShowOptions], Result]], Declared]:
    """Make a command of a function of its own options and of the shared ones; `present` shows its result.

    `options` declares its own, as `parameters` reads them; `shared` are those of the shared ones that it takes, `forms`
    further suffixes of -o, `example` is the worked example with which its help ends.
    """
    return lambda find: Declared(find, options, shared, present, eager, forms, example)


def _typed(value: object) -> str:
    """Return an option's value as the user gave it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)


_REQUIRED = " [required]"
_VALUE = re.compile(r"(?P<value>.+?)(?:\((?P<least>[\d.]+)-(?P<most>[\d.]*)\))?(?:=(?P<default>.+))?")
_CHOICE = re.compile(r"(?:(?:[a-z\d_-]+|[A-Z]+\d+)(?:\||$))+")


def parameters(
    text: str,
    eager: Mapping[str, Callable[[bool], None]] | None = None,
    checks: Mapping[str, Callable[[Any], Any]] | None = None,
) -> dict[str, Parameter]:
    """Read the parameters of a command, by their names, from the text of its help (`help_lines`).

    The placeholder of a value says what the value may be: `N` a whole number that is at least 1, `N(0-100)` one from 0 to 100,
    `NUMBER` and `NUMBER(0-1)` a number, `one|other` one of these words, `FILE(.html)` a file with such a suffix,
    `NAME...` an option that may be repeated, anything else a text. `=` and a value behind it is the default; without a
    placeholder it is a flag. `[required]` ends the help of an option that cannot be left out. An option without help is
    hidden: the command refuses it, and its message names the right one.

    Parameters
    ----------
    eager : mapping of name to function
        Flags that are answered before anything else is looked at.
    checks : mapping of name to function
        What checks a value, or refuses it.
    """
    result = {}
    for name, line in help_lines(text).items():
        argument = line.heading == "Arguments"
        kind, default, more = _kind(line.metavar or "", argument)
        if eager and name in eager:
            more |= {"is_eager": True, "callback": _answered(eager[name])}
        if checks and name in checks:
            more["callback"] = checks[name]
        words = line.help.removesuffix(_REQUIRED)
        if argument:
            optional = (line.metavar or "").startswith("[")
            kind, default = (kind | None, None) if optional else (kind, Parameter.empty)
            info = typer.Argument(help=words, show_default=False, **more)
        else:
            required = words != line.help
            if default is None and not required:
                kind = kind | None
            info = typer.Option(*line.flags, help=words, hidden=not words, **more)
            default = Parameter.empty if required else default
        result[name] = Parameter(
            name, Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, info]
        )
    return result


def _kind(placeholder: str, argument: bool) -> tuple[Any, Any, dict[str, Any]]:
    """Return the type of a value, its default, and what else the parser is to know of it."""
    if not placeholder:
        return bool, False, {}
    if placeholder.endswith("...") and not placeholder.endswith(",..."):
        return list[str], None, {"metavar": placeholder if argument else placeholder.removesuffix("...")}
    match = _VALUE.fullmatch(placeholder)
    assert match is not None
    value, least, most, default = match.groups()
    if value in ("N", "NUMBER"):
        kind = int if value == "N" else float
        bounds = {"min": least or (1 if value == "N" else None), "max": most}
        limits = {name: kind(bound) for name, bound in bounds.items() if bound}
        return kind, None if default is None else kind(default), {"metavar": value, **limits}
    if _CHOICE.fullmatch(value):
        # the parser shows the words itself
        return Literal[tuple(value.split("|"))], default, {}
    suffixes = re.findall(r"\.\w+", value) if "(" in value else []
    if suffixes:
        one = value.replace("(", "").replace(")", "") if len(suffixes) == 1 else value
        return Path, None, {"metavar": one, "callback": suffix_among(*suffixes)}
    # of NAME=VALUE both are placeholders
    if default is None or not default[0].isdecimal():
        return str, None, {"metavar": placeholder}
    return str, default, {"metavar": value}


def _answered(answer: Callable[[bool], None]) -> Callable[[bool], bool]:
    """A flag's function as a callback: what it prints is all."""

    def callback(value: bool) -> bool:
        if value:
            answer(value)
            raise typer.Exit
        return value

    return callback
