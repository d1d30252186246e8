"""The order of solution as data: a flat list of steps, each knowing what it reads and what it writes.

The list of steps
-----------------
`Turn`   the angle of a body from the inputs and from angles already known
`Slide`  a slide that is an input
`Place`  a point from a point already known:  P = P_base + Σ z·s·e^{iθ}
`Group`  the angles and slides of an Assur group from its loop closures

Every position in the mechanism is a `base` point and a sum of `Term`s, each a constant z in the axes of one body,
perhaps times a slide. That is all that derivatives, virtual displacements and reactions need to know.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

from virtualwork.describe.parts import GROUND

# ("angle", link), ("x", link), ("y", link), ("px", pin), ("py", pin), ("slide", guide)
Variable = tuple[str, str]
# a point of a body; the number of a guide and what of it: where its line runs, which way
Slot = tuple[str, str] | tuple[int, str]


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


@dataclass(frozen=True)
class Term:
    """One vector of a loop: z, constant in the axes of `body`, times the slide of guide `slide` (None: 1)."""

    z: complex
    body: str
    slide: int | None = None


# where a point lies: P[base] + Σ terms; base None is the ground's origin
Path = tuple[str | None, tuple[Term, ...]]


def path_reads(path: Path) -> set[str]:
    """What a point hangs on: `angle:BODY`, `slide:GUIDE`, `point:NODE`."""
    return _term_reads(path[1]) | _node(path[0])


@dataclass(frozen=True)
class Angle:
    """θ = const + Σ k·input + Σ r·θ_base + Σ p·K_gear.

    K is the constant of a gear, K = Σ c·θ of its links: the guess gives it once the links before it are placed.
    """

    const: float = 0.0
    inputs: tuple[tuple[int, float], ...] = ()
    bases: tuple[tuple[str, float], ...] = ()
    gears: tuple[tuple[int, float], ...] = ()
    # of what was added up to const: its rounding is so many times the unit's
    size: float = field(default=0.0, compare=False)

    def at(self, inputs: tuple[float, ...]) -> float | None:
        """The angle at given inputs, or None where it hangs on other angles."""
        if self.bases or self.gears:
            return None
        return self.const + sum(k * inputs[j] for j, k in self.inputs)


@dataclass(frozen=True)
class Turn:
    """The angle of a body follows from inputs and known angles."""

    body: str
    angle: Angle


@dataclass(frozen=True)
class Slide:
    """The slide of a guide is an input."""

    guide: int
    input: int


@dataclass(frozen=True)
class Place:
    """A point from a known one: P = P[base] + Σ terms; base None is the ground's origin."""

    node: str
    base: str | None
    terms: tuple[Term, ...]


@dataclass(frozen=True)
class Closure:
    """A loop that closes: P[start] + Σ terms − P[end] = 0; made by cutting `joint` on link `body`."""

    start: str | None
    end: str | None
    terms: tuple[Term, ...]
    joint: str
    body: str
    guide: int | None = None


Kind = Literal["RRR", "RRP", "RPR", "PRP", "Newton"]


@dataclass(frozen=True)
class Group:
    """An Assur group: its links, its own unknown angles and slides, its loops.

    `kind` is the case of the planar vector equation (M. A. Chace, J. Eng. Ind. 85 (1963) 289): RRR two angles,
    RRP an angle and a slide of known direction, RPR an angle and a slide that turns with it, PRP two slides;
    'Newton' for everything larger.
    """

    name: str
    links: tuple[str, ...]
    kind: Kind
    angles: tuple[str, ...]
    slides: tuple[int, ...]
    closures: tuple[Closure, ...]
    # bodies of the group whose angle hangs on the group's own
    ties: tuple[Turn, ...] = ()

    @cached_property
    def members(self) -> tuple[str, ...]:
        """The bodies whose angle is an unknown of the group or tied to one."""
        return (*self.angles, *(t.body for t in self.ties))


Step = Turn | Slide | Place | Group


def turns(steps: Iterable[Step]) -> Iterator[Turn]:
    """Every angle that follows from others, by itself or tied inside a group."""
    for step in steps:
        if isinstance(step, Turn):
            yield step
        elif isinstance(step, Group):
            yield from step.ties


@dataclass(frozen=True)
class Blocks:
    """The irreducible blocks of coordinates in their order of solution, and the redundant equations."""

    order: tuple[tuple[Variable, ...], ...]
    redundant: tuple[str, ...]
    # Grübler's: coordinates less equations of joints
    mobility: int


@dataclass(frozen=True)
class Plan:
    """The order of solution: the steps, and where each body stands once they are done.

    `anchors[body] = (node, terms)`: the point z of that body lies at P[node] + Σ terms + z·e^{iθ}.
    `angles[body]` is the body's angle in terms of inputs and of the groups' free angles.
    """

    steps: tuple[Step, ...]
    anchors: Mapping[str, tuple[str | None, tuple[Term, ...]]]
    angles: Mapping[str, Angle]
    directions: Mapping[int, complex]
    blocks: Blocks
    guide_nodes: Mapping[int, str] = field(default_factory=dict)

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """The Assur groups in their order of solution."""
        return tuple(step for step in self.steps if isinstance(step, Group))

    def reads(self, step: Step) -> set[str]:
        """What a step reads: `angle:BODY`, `point:NODE`, `slide:GUIDE`."""
        if isinstance(step, Turn):
            return {f"angle:{base}" for base, _ in step.angle.bases}
        if isinstance(step, Slide):
            return set()
        if isinstance(step, Place):
            return _term_reads(step.terms) | _node(step.base)
        own = {f"angle:{body}" for body in step.members} | {f"slide:{g}" for g in step.slides}
        needs: set[str] = set()
        for closure in step.closures:
            needs |= _term_reads(closure.terms) | _node(closure.start) | _node(closure.end)
        for tie in step.ties:
            needs |= {f"angle:{base}" for base, _ in tie.angle.bases}
        return needs - own

    def writes(self, step: Step) -> tuple[str, ...]:
        """What a step makes known."""
        if isinstance(step, Turn):
            return (f"angle:{step.body}",)
        if isinstance(step, Slide):
            return (f"slide:{step.guide}",)
        if isinstance(step, Place):
            return (f"point:{step.node}",)
        return (*(f"angle:{body}" for body in step.members), *(f"slide:{g}" for g in step.slides))

    def needed(self, targets: Iterable[str]) -> tuple[Step, ...]:
        """The steps that the targets hang on, in order; nothing more."""
        wanted, chosen = set(targets), []
        for step in reversed(self.steps):
            if wanted.intersection(self.writes(step)):
                chosen.append(step)
                wanted |= self.reads(step)
        return tuple(reversed(chosen))


def _term_reads(terms: tuple[Term, ...]) -> set[str]:
    return {f"angle:{t.body}" for t in terms if t.body != GROUND} | {
        f"slide:{t.slide}" for t in terms if t.slide is not None
    }


def _node(name: str | None) -> set[str]:
    return set() if name is None else {f"point:{name}"}


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
