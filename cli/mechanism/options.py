"""The options of `dalembert mechanism`, which of them go together, and values that an option itself refuses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import typer

from cli.read.options import bad, whole
from cli.read.options import given as flags_of
from cli.show.commands import suffix_among

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions


# have a table of their own, as --forces has
STUDIES = "newton check equilibrium flywheel counterweights"
# of a fit alone
FITTING = "fit point link slide free weight starts best"


def _print_schema(asked: bool) -> None:
    if asked:
        import json

        from virtualwork.describe.schema import schema

        typer.echo(json.dumps(schema(), indent=2, ensure_ascii=False))
        raise typer.Exit


# each method that dataclass makes costs a tenth of a millisecond at every start
@dataclass(eq=False, repr=False)
class Options:
    """The options of its own, in the order in which the help lists them."""

    file: str
    at: list[str] | None = None
    sweep: str | None = None
    inputs: str | None = None
    only: str | None = None
    order: Literal["position", "velocity", "acceleration", "jerk"] | None = None
    branch: str | None = None
    newton: bool = False
    check: bool = False
    explain: bool = False
    forces: bool = False
    equilibrium: bool = False
    flywheel: float | None = None
    counterweights: str | None = None
    graph: str | None = None
    time: str | None = None
    accuracy: str | None = None
    until: str | None = None
    states: Annotated[Path | None, typer.Option(callback=suffix_among(".csv"))] = None
    html: Annotated[Path | None, typer.Option(callback=suffix_among(".html"))] = None
    change: list[str] | None = None
    vary: list[str] | None = None
    variants: str | None = None
    tolerance: bool = False
    draws: int | None = None
    seed: Annotated[int, typer.Option(min=0)] = 0
    distribution: Literal["normal", "uniform"] = "normal"
    workers: Annotated[int | None, typer.Option(min=1)] = None
    fit: list[str] | None = None
    point: list[str] | None = None
    link: list[str] | None = None
    slide: list[str] | None = None
    free: list[str] | None = None
    weight: list[str] | None = None
    starts: Annotated[int | None, typer.Option(min=1)] = None
    best: Annotated[int | None, typer.Option(min=1)] = None
    schema: Annotated[bool, typer.Option(is_eager=True, callback=_print_schema)] = False

    @property
    def names(self) -> list[str] | None:
        """What --only names."""
        return None if self.only is None else names(self.only)

    @property
    def swept(self) -> bool:
        """Whether the poses are a cycle."""
        return self.sweep is not None or self.inputs is not None

    @property
    def tables(self) -> list[str]:
        """The options given that have a table of their own."""
        return self._given(f"forces {STUDIES}")

    @property
    def fits(self) -> bool:
        """Whether a fit is asked for, or something of one."""
        return bool(self._given(FITTING))

    def _given(self, names: str) -> list[str]:
        return flags_of(**{name: getattr(self, name) for name in names.split()})


def names(text: str) -> list[str]:
    """Names between commas."""
    return [name.strip() for name in text.split(",") if name.strip()]


# --- which go together ------------------------------------------------------------------------------------------------
class Rule(NamedTuple):
    """Where one of `of` is given, what must be given too or must not be: names of options, blanks between them."""

    of: str
    message: str
    """What is said of the first of `of` that is given; {first} and {all} are those that are in its way."""
    needs: str = ""
    """One of these must be given."""
    without: str = ""
    """None of these may be given."""
    where: str = ""
    """The rule holds where one of these is given too."""


RULES = (
    Rule(
        "flywheel counterweights",
        "expected a cycle too: --sweep, such as --sweep 0deg:360deg:1deg",
        needs="sweep inputs",
    ),
    Rule("graph", "expected --plot FILE too: the picture that the curves are drawn into", needs="plot"),
    Rule(
        "states explain graph plot",
        "expected one mechanism, and no --vary or --variants beside it",
        without="vary variants",
    ),
    Rule(
        "workers",
        "expected --draws, --vary, --variants or --fit: one mechanism is one process's",
        needs="draws vary variants fit",
    ),
    Rule(
        "tolerance draws",
        "expected poses or forces of one mechanism, and no {all} beside it",
        without=f"vary variants branch states graph html {STUDIES}",
    ),
    Rule(
        "fit",
        "expected without {first}: it finds dimensions, not poses",
        without=f"forces {STUDIES} at sweep inputs vary variants time only order html states tolerance draws branch "
        "explain graph",
    ),
    Rule(
        "time",
        "expected without {first}: the loads decide the poses",
        without=f"at sweep inputs order graph states explain {STUDIES} every_branch tolerance draws",
    ),
    Rule("accuracy until", "expected --time too", needs="time"),
    Rule(
        "html",
        "expected no --until beside variants: a page has one clock for all; --set shows one of them",
        without="until",
        where="vary variants",
    ),
)


def refuse_clashes(asked: Options, show: ShowOptions) -> None:
    """Refuse options that do not go together, and bad values of those that need no mechanism to be judged."""
    _refuse_values(asked)
    every = vars(asked) | {"plot": show.plot}
    flags = {name: flag for name, value in every.items() for flag in flags_of(**{name: value})}
    if asked.branch == "all":
        flags["every_branch"] = "--branch all"

    def given(names: str) -> list[str]:
        return [flags[name] for name in names.split() if name in flags]

    for rule in RULES:
        own, others = given(rule.of), given(rule.without)
        missing = rule.needs and not given(rule.needs)
        if own and (missing or others) and (not rule.where or given(rule.where)):
            raise bad(own[0], rule.message.format(first=(*others, "")[0], all=" or ".join(others)))
    own = asked.tables
    if show.holds_one and len(own) > 1:
        told = f"{' and '.join(own)} are tables of their own, and CSV holds one: ask for --json or --text"
        raise bad(own[1], told)


def _refuse_values(asked: Options) -> None:
    if asked.branch is not None and asked.branch != "all" and whole(asked.branch) < 1:
        raise bad("--branch", f"'{asked.branch}': expected all, or the number of an assembly")
    if asked.names == []:
        raise bad("--only", "expected names of links or points")
    if asked.counterweights is not None and not names(asked.counterweights):
        raise bad("--counterweights", "expected names of links")
    if asked.flywheel is not None and not 0 < asked.flywheel < float("inf"):
        raise bad("--flywheel", "expected a positive speed fluctuation, such as 0.02")
    if asked.draws is not None and asked.draws < 2:
        raise bad("--draws", f"{asked.draws}: expected two or more drawn mechanisms")
