"""Names that no other thing has, and groups of things by name."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import Generic, TypeVar

Thing = TypeVar("Thing", bound=Hashable)


def unused(wanted: str, used: Iterable[str], between: str = "_") -> str:
    """Return a name that is not used: the wanted one, or that with a number.

    >>> unused("B", {"B", "B_2"})
    'B_3'
    """
    used, name, k = set(used), wanted, 1
    while name in used:
        k += 1
        name = f"{wanted}{between}{k}"
    return name


class Groups(Generic[Thing]):
    """Things that are joined into groups, each of which is called as one of its things.

    >>> groups = Groups("abcd")
    >>> groups.join("b", "a", "d"), groups.join("d", "a")
    (True, False)
    >>> groups.of("a"), groups.all()
    ('b', [['a', 'b', 'd'], ['c']])
    """

    def __init__(self, names: Iterable[Thing]) -> None:
        self._above = {name: name for name in names}

    def of(self, name: Thing) -> Thing:
        """Return what the group of a thing is called."""
        while self._above[name] != name:
            name = self._above[name]
        return name

    def join(self, *names: Thing) -> bool:
        """Join the groups of things under the name of the first's; return whether they were several."""
        groups = [self.of(name) for name in names]
        self._above |= dict.fromkeys(groups, groups[0]) if groups else {}
        return len(set(groups)) > 1

    def all(self) -> list[list[Thing]]:
        """Return the groups, in the order in which their first things were named."""
        result: dict[Thing, list[Thing]] = {}
        for name in self._above:
            result.setdefault(self.of(name), []).append(name)
        return list(result.values())
