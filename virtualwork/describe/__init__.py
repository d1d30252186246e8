"""What the user says of a mechanism, frozen and in SI: its parts and loads, the TOML reader and its units; what can be wrong with it."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable
from difflib import get_close_matches


class MechanismError(ValueError):
    """A description that cannot be solved: says which table and key, what was found and what was expected."""


class DescriptionError(MechanismError):
    """The description itself is wrong: an unknown name, a contradiction, a zero length."""


class MobilityError(MechanismError):
    """The parts do not make a mechanism: a free degree of freedom, a structure, an idle input."""


class AssemblyError(MechanismError):
    """No assembly, or none that the guess would choose: names the choices."""


class ParallelGuidesError(AssemblyError):
    """The two guides of a group are parallel: its position is not determined."""


def hint(word: str, names: Iterable[str]) -> str:
    """The nearest of some names, as a question; empty where none is near.

    >>> hint("crnak", ["crank", "rocker"])
    "; did you mean 'crank'?"
    """
    close = get_close_matches(word, list(names), n=1, cutoff=0.4)
    return f"; did you mean '{close[0]}'?" if close else ""


def known(name: object, names: Collection[object], where: str, what: str) -> None:
    """Refuse a name that is none of those known.

    >>> known("crnak", ["crank"], "[[forces]] 1 link", "link")
    Traceback (most recent call last):
    virtualwork.describe.DescriptionError: [[forces]] 1 link: unknown link 'crnak'; did you mean 'crank'?
    """
    if not isinstance(name, Hashable) or name not in names:
        raise DescriptionError(f"{where}: unknown {what} '{name}'{hint(str(name), map(str, names))}")
