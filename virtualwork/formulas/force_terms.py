"""Forces and torques as combinations of terms with constant coefficients, added before any pose is looked at.

But for springs and friction, a force on a link is a fixed combination of a few vectors: of 1 (a weight), of e^{iθ} (a
force that turns with its link), of second derivatives (−m·a_G = −m Σ z (e^{iθ})″) and of other joint forces. Such
vectors are the terms; a `Combination` holds their coefficients, which depend on the mechanism alone. Combinations
are added and weighed as numbers, once for each mechanism. The value of a term or a combination at a pose is formed when it is
first requested, and never twice. The contact force of a cam is a term too: it balances all that bears on its follower's
coordinate, along the normal.
"""

from __future__ import annotations

from collections.abc import Container, Hashable, Iterable
from typing import Any

from dalembert.dataclass import dataclass
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.loaded_pose import Formed, LoadedPose
from virtualwork.formulas.numbers import Number, cross
from virtualwork.formulas.rates import Rates
from virtualwork.formulas.touches import Touch
from virtualwork.plan.steps import Path, Term


class ForceTerm:
    """A vector (complex) or a number (real) at each pose; two terms are the same only if they are one object."""

    lasts = False
    """Whether a motion keeps its values for others that ask later."""

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        """A factor and the value at a pose; None where it is zero."""
        raise NotImplementedError

    def reads(self) -> Iterable[ForceTerm | None]:
        """The terms it is made of."""
        return ()


class Combination(dict[ForceTerm | None, Any]):
    """Σ coefficient·term; the term None is the constant 1.

    >>> force = Combination({None: 3 - 2j})
    >>> force.add(Combination({None: 1j}), 2)
    >>> force
    {None: (3+0j)}
    """

    def add(self, other: Combination, factor: complex = 1.0) -> None:
        """Add another, times a factor; what cancels is gone."""
        for term, c in other.items():
            total = self.get(term, 0.0) + factor * c
            if total:
                self[term] = total
            else:
                self.pop(term, None)

    def times(self, factor: complex) -> Combination:
        """The combination times a factor."""
        return Combination({term: factor * c for term, c in self.items()})

    def value(self, pose: LoadedPose) -> Number:
        """Its value at a pose; None where it is zero."""
        total: Number = None
        for term, c in self.items():
            if term is None:
                part = c
            else:
                factor, v = pose.formed(term)
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
class Turned(ForceTerm):
    """s·e^{iθ} of a body, with the slide s of a guide or without."""

    body: str
    slide: int | None

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        e = pose.st.turn[self.body]
        return 1.0, e if self.slide is None else pose.st.slide[self.slide] * (e + 0j)


@dataclass(frozen=True, eq=False)
class SecondRate(ForceTerm):
    """The second derivative in time: of s·e^{iθ}, of a point (`node`), or of a body's angle."""

    kind: str
    name: str
    slide: int | None = None

    def derivative(self, rates: Rates, k: int) -> Number:
        """Its k-th derivative along the rates."""
        if self.kind == "node":
            return rates.point[self.name][k - 1]
        if self.kind == "angle":
            return rates.angle[self.name][k - 1]
        return (
            rates.turn(self.name, k)
            if self.slide is None
            else rates.vector((None, (Term(1.0, self.name, self.slide),)), k)
        )

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        return pose.second(self.derivative)


@dataclass(frozen=True, eq=False)
class LoadTerm(ForceTerm):
    """A load that is no combination of other terms: of a spring, of friction, of a table."""

    load: Formed

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        return 1.0, pose.formed(self.load)


@dataclass(frozen=True, eq=False)
class Total(ForceTerm):
    """A combination whose value more than one other reads."""

    of: Combination

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        return 1.0, self.of.value(pose)

    def reads(self) -> Iterable[ForceTerm | None]:
        return self.of


@dataclass(frozen=True, eq=False)
class Transmitted(Total):
    """What a chain of links passes down: each of its joints reads it."""

    lasts = True


@dataclass(frozen=True, eq=False)
class Lever(ForceTerm):
    """What a force does for a unit turn of a body, (s e^{iθ}) × F, or (`along`) for a unit of its slide, e^{iθ}·F.

    The lever's constant z in the body's axes is taken into the force: (z e) × F = e × (z̄ F).
    """

    body: str
    slide: int | None
    force: Combination
    along: bool = False

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        force = self.force.value(pose)
        if force is None:
            return 1.0, None
        e = pose.st.turn[self.body]
        if self.slide is not None:
            e = e * pose.st.slide[self.slide]
        work = e.conjugate() * force
        return 1.0, work.real if self.along else work.imag

    def reads(self) -> Iterable[ForceTerm | None]:
        return self.force


@dataclass(frozen=True, eq=False)
class Carried(ForceTerm):
    """The torque of input j's motor, where it sits on another body than `on`."""

    input: int

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        return 1.0, pose.drive(self.input)


class ForceTerms:
    """Makes each term once: what is made of the same is the same term."""

    def __init__(self) -> None:
        self._made: dict[Hashable, ForceTerm] = {}

    def __call__(self, kind: type[ForceTerm], *of: Any) -> ForceTerm:
        """The term of a kind."""
        key = (kind, *(frozenset(x.items()) if isinstance(x, Combination) else x for x in of))
        if key not in self._made:
            self._made[key] = kind(*of)
        return self._made[key]

    def second(self, kind: str, name: str, slide: int | None = None) -> ForceTerm:
        """The term of a second derivative in time."""
        return self(SecondRate, kind, name, slide)

    def total(self, terms: Combination) -> Combination:
        """A combination that is formed once for all who read it."""
        if len(terms) < 2 and (None in terms or not terms):
            return terms
        return terms if list(terms.values()) == [1.0] else Combination({self(Total, terms): 1.0})

    def lever(self, body: str, slide: int | None, force: Combination, along: bool = False) -> Combination:
        """The work of a force for a unit turn, or a unit of the slide, as a combination of real terms.

        Of the force's part in the body's own (e^{iθ})″ = (iα − ω²)e^{iθ} only α is left, e × (e)″ = α: this turns
        I_G·α into (I_G + m|z|²)·α, the inertia about the point that carries the body (Steiner).
        """
        rest, lever = Combination(force), Combination()
        if slide is None and not along and body != GROUND:
            second, bare = self.second("turn", body), self(Turned, body, None)
            c = 0j + rest.get(second, 0.0)
            if c and not c.imag:
                del rest[second]
                lever.add(Combination({self.second("angle", body): c.real}))
            c = 0j + rest.pop(bare, 0.0)
            if c.imag:
                lever.add(Combination({None: c.imag}))
        if rest:
            lever.add(Combination({self(Lever, body, slide, rest, along): 1.0}))
        return lever


def in_order(term: ForceTerm, formed: Container[Any]) -> list[ForceTerm]:
    """The terms that one is made of, each after those it is made of itself, and that one last; not below what is formed.

    This order keeps the chain of calls short, however long the chain of links.
    """
    done: set[ForceTerm] = set()
    result: list[ForceTerm] = []
    stack: list[tuple[ForceTerm, bool]] = [(term, False)]
    while stack:
        here, open_ = stack.pop()
        if open_:
            result.append(here)
        elif here not in done and here not in formed:
            done.add(here)
            stack.append((here, True))
            stack += [(part, False) for part in here.reads() if part is not None and part not in done]
    return result


@dataclass(frozen=True, eq=False)
class Lifted(Total):
    """What bears on the coordinate of a follower, as it bears on its cam's angle: times y′."""

    touch: Touch

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        value = self.of.value(pose)
        return 1.0, None if value is None else self.touch.rate(pose.st, 1) * value


@dataclass(frozen=True, eq=False)
class ContactForce(Transmitted):
    """The contact force on the follower: what balances all that bears on its coordinate, along the normal."""

    touch: Touch

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        value = self.of.value(pose)
        return 1.0, None if value is None else value * self.touch.at(pose.st).unit()


@dataclass(frozen=True, eq=False)
class ContactMoment(ForceTerm):
    """The moment of the contact force on the follower about a point that moves with `path`."""

    touch: Touch
    force: ForceTerm
    path: Path

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        factor, force = pose.formed(self.force)
        if force is None:
            return 1.0, None
        return factor, cross(
            self.touch.axis(pose.st) - pose.st.at(self.path) + self.touch.at(pose.st).place(), force
        )

    def reads(self) -> Iterable[ForceTerm | None]:
        return (self.force,)
