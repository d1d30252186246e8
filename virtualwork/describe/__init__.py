"""The description of a mechanism, frozen and in SI: its parts and loads, its file, and the errors of both.

Each part declares its keys beside its fields (`parts`, `keys`, `forms`); reader, schema, dimensions and text follow.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable

from dalembert.hints import choices


class MechanismError(ValueError):
    """A mechanism that cannot be solved; the message names table, key, value and the expected value."""


class DescriptionError(MechanismError):
    """The description is wrong: an unknown name, a contradiction, a zero length."""


class MobilityError(MechanismError):
    """The parts are no mechanism: a free degree of freedom, a structure, or an input without effect."""


class AssemblyError(MechanismError):
    """The mechanism has no assembly, or the guess chooses none; the message names the possible choices."""


class ParallelGuidesError(AssemblyError):
    """The two guides of a group are parallel: its position is not determined."""


def require(name: object, names: Collection[object], where: str, noun: str) -> None:
    """Refuse a name that is none of these; the nearest one is suggested.

    >>> require("crnak", ["crank"], "[[forces]] 1 link", "link")
    Traceback (most recent call last):
    virtualwork.describe.DescriptionError: [[forces]] 1 link: unknown link 'crnak'; did you mean 'crank'?
    """
    if not isinstance(name, Hashable) or name not in names:
        raise DescriptionError(f"{where}: unknown {noun} '{name}'{choices(str(name), map(str, names))}")
