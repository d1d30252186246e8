"""Which options of `dalembert mechanism` go together, as data; and values that an option itself refuses."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from cli.mechanism.read import names
from cli.read import options

if TYPE_CHECKING:
    from cli.mechanism.command import Options
    from cli.show.commands import ShowOptions


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


# have a table of their own, as --forces has
STUDIES = "newton check equilibrium flywheel counterweights"
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
    flags = {name: flag for name, value in every.items() for flag in options.given(**{name: value})}
    if asked.branch == "all":
        flags["every_branch"] = "--branch all"

    def given(names: str) -> list[str]:
        return [flags[name] for name in names.split() if name in flags]

    for rule in RULES:
        own, others = given(rule.of), given(rule.without)
        missing = rule.needs and not given(rule.needs)
        if own and (missing or others) and (not rule.where or given(rule.where)):
            raise options.bad(own[0], rule.message.format(first=(*others, "")[0], all=" or ".join(others)))
    own = given(f"forces {STUDIES}")
    if show.holds_one and len(own) > 1:
        told = f"{' and '.join(own)} are tables of their own, and CSV holds one: ask for --json or --text"
        raise options.bad(own[1], told)


def _refuse_values(asked: Options) -> None:
    if asked.branch is not None and asked.branch != "all" and options.whole(asked.branch) < 1:
        raise options.bad("--branch", f"'{asked.branch}': expected all, or the number of an assembly")
    if asked.only is not None and not names(asked.only):
        raise options.bad("--only", "expected names of links or points")
    if asked.counterweights is not None and not names(asked.counterweights):
        raise options.bad("--counterweights", "expected names of links")
    if asked.flywheel is not None and not 0 < asked.flywheel < float("inf"):
        raise options.bad("--flywheel", "expected a positive speed fluctuation, such as 0.02")
    if asked.draws is not None and asked.draws < 2:
        raise options.bad("--draws", f"{asked.draws}: expected two or more drawn mechanisms")
