"""Forces and torques as sums of rows with constant coefficients, added before any pose is looked at.

But for springs and friction, a force on a link is a fixed combination of a few vectors: of 1 (a weight), of e^{iθ} (a
force that turns with its link), of second derivatives (−m·a_G = −m Σ z (e^{iθ})″) and of other joint forces. Such
vectors are the rows; a `Sum` holds their coefficients, which hang on the mechanism alone. Sums are added and weighed
as numbers, once for each mechanism. An array over the poses is formed of a row or a sum when its value is asked for,
and never twice.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.closed_forms import Number
from virtualwork.plan.steps import Term

if TYPE_CHECKING:
    from virtualwork.formulas.loads import Load
    from virtualwork.formulas.scene import Block
    from virtualwork.state import Jets


class Row:
    """A vector (complex) or a number (real) at each pose; two rows are the same only if they are one object."""

    lasting = False
    """Whether its array is kept over a long sweep, for others that ask later."""

    def form(self, block: Block) -> tuple[float, Number]:
        """A factor and an array over a block of poses; None for an array of zeros."""
        raise NotImplementedError

    def reads(self) -> Iterable[Row | None]:
        """The rows it is made of."""
        return ()


class Sum(dict[Row | None, Any]):
    """Σ coefficient·row; the row None is the constant 1.

    >>> force = Sum({None: 3 - 2j})
    >>> force.add(Sum({None: 1j}), 2)
    >>> force
    {None: (3+0j)}
    """

    def add(self, other: Sum, factor: complex = 1.0) -> None:
        """Add a sum, times a factor; what cancels is gone."""
        for row, c in other.items():
            total = self.get(row, 0.0) + factor * c
            if total:
                self[row] = total
            else:
                self.pop(row, None)

    def times(self, factor: complex) -> Sum:
        """The sum times a factor."""
        return Sum({row: factor * c for row, c in self.items()})

    def value(self, block: Block) -> Number:
        """Its array over a block, or one number where it is the same at every pose; None where it is zero."""
        total: Number = None
        for row, c in self.items():
            if row is None:
                part = c
            else:
                factor, v = block.row(row)
                if v is None:
                    continue
                c = c * factor
                if c == -1 and total is not None:
                    total = total - v
                    continue
                part = v if c == 1 else c * v
            total = part if total is None else total + part
        return total


@dataclass(frozen=True, eq=False)
class Turned(Row):
    """s·e^{iθ} of a body, with the slide s of a guide or without."""

    body: str
    slide: int | None

    def form(self, block: Block) -> tuple[float, Number]:
        e = block.st.turn[self.body]
        return 1.0, e if self.slide is None else block.st.slide[self.slide] * (e + 0j)


@dataclass(frozen=True, eq=False)
class SecondRate(Row):
    """The second derivative in time: of s·e^{iθ}, of a point (`node`), or of a body's angle."""

    kind: str
    name: str
    slide: int | None = None

    def derivative(self, jets: Jets, k: int) -> Number:
        """Its k-th derivative along the jets."""
        if self.kind == "node":
            return jets.point[self.name][k - 1]
        if self.kind == "angle":
            return jets.angle[self.name][k - 1]
        return (
            jets.turn(self.name, k)
            if self.slide is None
            else jets.vector(None, (Term(1.0, self.name, self.slide),), k)
        )

    def form(self, block: Block) -> tuple[float, Number]:
        return block.second(self.derivative)


@dataclass(frozen=True, eq=False)
class Given(Row):
    """A load that is no combination of other rows: of a spring, of friction, of a table."""

    load: Load

    def form(self, block: Block) -> tuple[float, Number]:
        return 1.0, block.keep(self.load)


@dataclass(frozen=True, eq=False)
class Total(Row):
    """A sum whose array more than one other sum reads."""

    sum: Sum

    def form(self, block: Block) -> tuple[float, Number]:
        return 1.0, self.sum.value(block)

    def reads(self) -> Iterable[Row | None]:
        return self.sum


@dataclass(frozen=True, eq=False)
class Passed(Total):
    """What a chain of links passes down: each of its joints reads it."""

    lasting = True


@dataclass(frozen=True, eq=False)
class Lever(Row):
    """What a force does for a unit turn of a body, (s e^{iθ}) × F, or (`along`) for a unit of its slide, e^{iθ}·F.

    The lever's constant z in the body's axes is taken into the force: (z e) × F = e × (z̄ F).
    """

    body: str
    slide: int | None
    force: Sum
    along: bool = False

    def form(self, block: Block) -> tuple[float, Number]:
        force = self.force.value(block)
        if force is None:
            return 1.0, None
        e = block.st.turn[self.body]
        if self.slide is not None:
            e = e * block.st.slide[self.slide]
        work = e.conjugate() * force
        return 1.0, work.real if self.along else work.imag

    def reads(self) -> Iterable[Row | None]:
        return self.force


class Rows:
    """Makes each row once: what is made of the same is the same row."""

    def __init__(self) -> None:
        self._made: dict[Hashable, Row] = {}

    def __call__(self, kind: type[Row], *of: Any) -> Row:
        """The row of a kind."""
        key = (kind, *(frozenset(x.items()) if isinstance(x, Sum) else x for x in of))
        if key not in self._made:
            self._made[key] = kind(*of)
        return self._made[key]

    def second(self, kind: str, name: str, slide: int | None = None) -> Row:
        """The row of a second derivative in time."""
        return self(SecondRate, kind, name, slide)

    def total(self, terms: Sum) -> Sum:
        """A sum that is formed once for all who read it."""
        if len(terms) < 2 and (None in terms or not terms):
            return terms
        return terms if list(terms.values()) == [1.0] else Sum({self(Total, terms): 1.0})

    def lever(self, body: str, slide: int | None, force: Sum, along: bool = False) -> Sum:
        """The work of a force for a unit turn, or a unit of the slide, as a sum of real rows.

        Of the force's part in the body's own (e^{iθ})″ = (iα − ω²)e^{iθ} only α is left, e × (e)″ = α: this turns
        I_G·α into (I_G + m|z|²)·α, the inertia about the point the body hangs on (Steiner).
        """
        rest, found = Sum(force), Sum()
        if slide is None and not along and body != GROUND:
            second, bare = self.second("turn", body), self(Turned, body, None)
            c = complex(rest.get(second, 0.0))
            if c and not c.imag:
                del rest[second]
                found.add(Sum({self.second("angle", body): c.real}))
            c = complex(rest.pop(bare, 0.0))
            if c.imag:
                found.add(Sum({None: c.imag}))
        if rest:
            found.add(Sum({self(Lever, body, slide, rest, along): 1.0}))
        return found


def in_order(row: Row) -> list[Row]:
    """The rows that a row is made of, each after those it is made of itself, and the row last.

    Forming them so keeps the chain of calls short, however long the chain of links.
    """
    done: set[Row] = set()
    found: list[Row] = []
    stack: list[tuple[Row, bool]] = [(row, False)]
    while stack:
        here, open_ = stack.pop()
        if open_:
            found.append(here)
        elif here not in done:
            done.add(here)
            stack.append((here, True))
            stack += [(part, False) for part in here.reads() if part is not None and part not in done]
    return found
