"""Sums of points and of terms of a loop, as the order of solution adds them up."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from virtualwork.plan.steps import Slot, Term


class Vector:
    """A sum of a body's points, each so many times, as the order of solution adds them up.

    >>> a, b = Vector.of(("arm", "A")), Vector.of(("arm", "B"))
    >>> a + -b == 0, a + -b + -a + b == 0
    (False, True)
    """

    __slots__ = ("parts",)

    def __init__(self, parts: Mapping[Slot, int]) -> None:
        self.parts = parts

    @classmethod
    def of(cls, slot: Slot | None) -> Vector:
        """One of them; None is the origin."""
        return cls({} if slot is None else {slot: 1})

    def __add__(self, other: Any) -> Vector:
        if other == 0:
            return self
        sums = dict(self.parts)
        for slot, times in other.parts.items():
            total = sums.get(slot, 0) + times
            if total:
                sums[slot] = total
            else:
                del sums[slot]
        return Vector(sums)

    __radd__ = __add__

    def __neg__(self) -> Vector:
        return Vector({slot: -times for slot, times in self.parts.items()})

    def __eq__(self, other: object) -> bool:
        return self.parts == other.parts if isinstance(other, Vector) else not self.parts and other == 0


def combined(terms: Iterable[Term]) -> tuple[Term, ...]:
    """Add terms of the same body and slide; drop those that cancel."""
    sums: dict[tuple[str, int | None], complex] = {}
    for t in terms:
        sums[t.body, t.slide] = sums.get((t.body, t.slide), 0j) + t.z
    return tuple(Term(z, body, slide) for (body, slide), z in sums.items() if z != 0)


def longer(terms: tuple[Term, ...], t: Term) -> tuple[Term, ...]:
    """Terms and one more, added to that of the same body and slide."""
    if any(own.body == t.body and own.slide == t.slide for own in terms):
        return combined((*terms, t))
    return (*terms, t) if t.z != 0 else terms
