"""Contact forces of cams as force terms: what balances all that bears on a follower's coordinate, along the normal."""

from __future__ import annotations

from collections.abc import Iterable

from dalembert.dataclass import dataclass
from virtualwork.formulas.block import Block
from virtualwork.formulas.force_terms import Combination, ForceTerm
from virtualwork.formulas.numbers import Number, cross
from virtualwork.formulas.touches import Touch
from virtualwork.plan.steps import Path


@dataclass(frozen=True, eq=False)
class Lifted(ForceTerm):
    """What bears on the coordinate of a follower, as it bears on its cam's angle: times y′."""

    touch: Touch
    of: Combination

    def form(self, block: Block) -> tuple[float, Number]:
        value = self.of.value(block)
        return 1.0, None if value is None else self.touch.rate(block.st, 1) * value

    def reads(self) -> Iterable[ForceTerm | None]:
        return self.of


@dataclass(frozen=True, eq=False)
class ContactForce(ForceTerm):
    """The contact force on the follower: what balances all that bears on its coordinate, along the normal."""

    touch: Touch
    of: Combination
    lasts = True

    def form(self, block: Block) -> tuple[float, Number]:
        value = self.of.value(block)
        return 1.0, None if value is None else value * self.touch.at(block.st).unit()

    def reads(self) -> Iterable[ForceTerm | None]:
        return self.of


@dataclass(frozen=True, eq=False)
class ContactMoment(ForceTerm):
    """The moment of the contact force on the follower about a point that moves with `path`."""

    touch: Touch
    force: ForceTerm
    path: Path

    def form(self, block: Block) -> tuple[float, Number]:
        factor, force = block.formed(self.force)
        if force is None:
            return 1.0, None
        return factor, cross(
            self.touch.axis(block.st) - block.st.at(self.path) + self.touch.at(block.st).place(), force
        )

    def reads(self) -> Iterable[ForceTerm | None]:
        return (self.force,)
