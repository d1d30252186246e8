"""The joints of a mechanism, and its order of solution as data: steps that know what they read and what they write.

A pin or a guide holds a point; a slider, a gear, a belt and a turning input tie angles, Σ c·θ = const + Σ k·input, and a
rack ties a slide to them. The shares c are also how the torque of the joint acts on the bodies.

The list of steps
-----------------
`Turn`   the angle of a body, or a slide, from the inputs and from angles and slides already known
`Slide`  a slide that is an input
`Place`  a point from a point already known:  P = P_base + Σ z·s·e^{iθ}
`Group`  the angles and slides of an Assur group from its loop closures

Every position in the mechanism is a `base` point and a sum of `Term`s, each a constant z in the axes of one body,
perhaps times a slide. That is all that derivatives, virtual displacements and reactions need to know.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from typing import Literal, TypeVar

from dalembert.dataclass import dataclass, field
from virtualwork.describe import DescriptionError
from virtualwork.describe.description import Description
from virtualwork.describe.laws import Lift
from virtualwork.describe.meshes import Coordinate
from virtualwork.describe.parts import GROUND

# ("angle", link), ("x", link), ("y", link), ("px", pin), ("py", pin), ("slide", guide)
Variable = tuple[str, str]
# a point of a body; the number of a guide and what of it: where its line runs, which way
Slot = tuple[str, str] | tuple[int, str]
Key = TypeVar("Key", int, str, "str | int", Lift)


@dataclass(frozen=True)
class Term:
    """One vector of a loop: z, constant in the axes of `body`, times the slide of guide `slide` (None: 1)."""

    z: complex
    body: str
    slide: int | None = None


# where a point lies: P[base] + Σ terms; base None is the ground's origin
Path = tuple[str | None, tuple[Term, ...]]


def path_reads(path: Path) -> set[str]:
    """What a point depends on: `angle:BODY`, `slide:GUIDE`, `point:NODE`."""
    return _term_reads(path[1]) | _node(path[0])


def key_of(x: Coordinate) -> str:
    """The key of an angle or a slide: `angle:BODY`, `slide:GUIDE`."""
    return f"slide:{x}" if isinstance(x, int) else f"angle:{x}"


@dataclass(frozen=True)
class Angle:
    """θ = const + Σ k·input + Σ r·θ_base + Σ p·K_gear + Σ f·s_cam; a base may be a slide too, and so may be what is tied.

    s is the lift of a cam; K is the constant of a gear, a belt or a rack, K = Σ c·x: the guess gives it once the links before it are placed.
    """

    const: float = 0.0
    inputs: tuple[tuple[int, float], ...] = ()
    bases: tuple[tuple[Coordinate, float], ...] = ()
    gears: tuple[tuple[int, float], ...] = ()
    cams: tuple[tuple[Lift, float], ...] = ()

    @property
    def by_inputs(self) -> bool:
        """Whether the inputs alone say what it is, as a sum."""
        return not self.bases and not self.cams

    @property
    def runs(self) -> bool:
        """Whether it goes on and on where an input does: a lift alone comes back."""
        return bool(self.inputs or self.bases)

    @property
    def reads(self) -> set[str]:
        """What it depends on: `angle:BODY`, `slide:GUIDE`."""
        turned = {f"angle:{body}" for of, _ in self.cams for body in (of.cam, of.on) if body != GROUND}
        return {key_of(base) for base, _ in self.bases} | turned

    @property
    def turning(self) -> tuple[tuple[str, float], ...]:
        """The bases that are angles of bodies."""
        return tuple((base, r) for base, r in self.bases if isinstance(base, str))

    def at(self, inputs: tuple[float, ...]) -> float | None:
        """The angle at given inputs, or None where it depends on other angles."""
        if self.bases or self.gears or self.cams:
            return None
        return self.const + sum(k * inputs[j] for j, k in self.inputs)

    def plus(self, other: Angle, factor: float = 1.0) -> Angle:
        """This angle and so many times another."""
        return Angle(
            self.const + factor * other.const,
            _sums(self.inputs, other.inputs, factor),
            _sums(self.bases, other.bases, factor),
            _sums(self.gears, other.gears, factor),
            _sums(self.cams, other.cams, factor),
        )


def _sums(
    own: tuple[tuple[Key, float], ...], other: tuple[tuple[Key, float], ...], factor: float
) -> tuple[tuple[Key, float], ...]:
    total = dict(own)
    for key, k in other:
        total[key] = total.get(key, 0.0) + factor * k
    return tuple((key, k) for key, k in total.items() if k != 0)


@dataclass(frozen=True)
class Turn:
    """The angle of a body, or the slide of a guide, follows from inputs and from known angles and slides."""

    body: Coordinate
    angle: Angle

    @property
    def slides(self) -> bool:
        """Whether it is a slide."""
        return isinstance(self.body, int)


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

    @property
    def cut(self) -> tuple[str, str]:
        """The key of the joint that is cut, and the link."""
        return f"pin:{self.joint}" if self.guide is None else f"guide:{self.guide}", self.body


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
    # bodies of the group whose angle depends on the group's own
    ties: tuple[Turn, ...] = ()

    @cached_property
    def members(self) -> tuple[str, ...]:
        """The bodies whose angle is an unknown of the group or tied to one."""
        return (*self.angles, *(t.body for t in self.ties if isinstance(t.body, str)))

    @cached_property
    def unknowns(self) -> tuple[str, ...]:
        """The names of its unknowns as inputs of a tape, angles and then slides."""
        return tuple(f"x {self.name} {i}" for i in range(len(self.angles) + len(self.slides)))

    @cached_property
    def tied_slides(self) -> tuple[int, ...]:
        """The guides whose slide is tied to the unknowns."""
        return tuple(t.body for t in self.ties if isinstance(t.body, int))

    @cached_property
    def shares(self) -> dict[Coordinate, dict[int, float]]:
        """Of each angle and slide how many times as fast as each unknown it moves: ∂x/∂x_j ≠ 0 by j."""
        unknowns: tuple[Coordinate, ...] = (*self.angles, *self.slides)
        places = {x: j for j, x in enumerate(unknowns)}
        tied = {t.body: {places[b]: r for b, r in t.angle.bases if r and b in places} for t in self.ties}
        return tied | {x: {j: 1.0} for x, j in places.items()}


Step = Turn | Slide | Place | Group


def turns(steps: Iterable[Step]) -> Iterator[Turn]:
    """Every angle that follows from others, by itself or tied inside a group."""
    for step in steps:
        if isinstance(step, Turn):
            yield step
        elif isinstance(step, Group):
            yield from step.ties


def geared(steps: Iterable[Step]) -> set[str]:
    """Bodies of which a gear of fractional ratio, or a rack, needs the angle with its whole turns, directly or indirectly."""
    result: set[str] = set()
    for turn in reversed(list(turns(steps))):
        needs = turn.slides or turn.body in result
        result |= {body for body, ratio in turn.angle.turning if needs or not ratio.is_integer()}
    return result


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

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """The Assur groups in their order of solution."""
        return tuple(step for step in self.steps if isinstance(step, Group))

    def reads(self, step: Step) -> set[str]:
        """What a step reads: `angle:BODY`, `point:NODE`, `slide:GUIDE`."""
        if isinstance(step, Turn):
            return step.angle.reads
        if isinstance(step, Slide):
            return set()
        if isinstance(step, Place):
            return _term_reads(step.terms) | _node(step.base)
        own = set(self.writes(step))
        needs: set[str] = set()
        for closure in step.closures:
            needs |= _term_reads(closure.terms) | _node(closure.start) | _node(closure.end)
        for tie in step.ties:
            needs |= tie.angle.reads
        return needs - own

    def writes(self, step: Step) -> tuple[str, ...]:
        """What a step makes known."""
        if isinstance(step, Turn):
            return (key_of(step.body),)
        if isinstance(step, Slide):
            return (f"slide:{step.guide}",)
        if isinstance(step, Place):
            return (f"point:{step.node}",)
        slides = (*step.slides, *step.tied_slides)
        return (*(f"angle:{body}" for body in step.members), *(f"slide:{g}" for g in slides))

    def needed(self, targets: Iterable[str]) -> tuple[Step, ...]:
        """The steps that the targets depend on, in order; nothing more."""
        wanted, chosen = set(targets), []
        for step, writes, reads in self._backwards:
            if not wanted.isdisjoint(writes):
                chosen.append(step)
                wanted |= reads
        return tuple(reversed(chosen))

    @cached_property
    def _backwards(self) -> tuple[tuple[Step, tuple[str, ...], set[str]], ...]:
        """The steps from the last to the first, each with what it writes and what it reads."""
        return tuple((step, self.writes(step), self.reads(step)) for step in reversed(self.steps))


def _term_reads(terms: tuple[Term, ...]) -> set[str]:
    return {f"angle:{t.body}" for t in terms if t.body != GROUND} | {
        f"slide:{t.slide}" for t in terms if t.slide is not None
    }


def _node(name: str | None) -> set[str]:
    return set() if name is None else {f"point:{name}"}


@dataclass(frozen=True)
class Joint:
    """A joint that holds a point: a pin or a guide, and the bodies it joins in the file's order."""

    key: str
    name: str
    bodies: tuple[str, ...]
    guide: int | None = None
    label: str = ""


def joints(m: Description) -> list[Joint]:
    """Every joint of the mechanism that holds a point: pins in the order of the file, then guides."""
    joints = [Joint(f"pin:{name}", name, bodies, None, f"pin {name}") for name, bodies in m.pins.items()]
    order = list(m.bodies)
    for i, g in enumerate(m.guides):
        bodies = tuple(sorted((g.link, g.on), key=order.index))
        joints.append(Joint(f"guide:{i}", g.point, bodies, i, guide_label(m, i)))
    return joints


def joints_at(joints: Iterable[Joint], name: str, on: str) -> list[Joint]:
    """The joints of a link at a point: a pin, a guide, or both.

    Raises
    ------
    DescriptionError
        Where there is none.
    """
    named = [joint for joint in joints if joint.name == name]
    if not named:
        known = ", ".join(dict.fromkeys(joint.name for joint in joints))
        raise DescriptionError(f"no joint at '{name}': expected one of {known}")
    result = [joint for joint in named if on in joint.bodies]
    if not result:
        raise DescriptionError(f"link '{on}' has no joint at '{name}'")
    return result


def guide_label(m: Description, i: int) -> str:
    """How messages call a guide."""
    return f"{'slider' if m.guides[i].is_slider else 'slot'} {m.guides[i].point}"


@dataclass(frozen=True)
class Relation:
    """Angles and slides that a slider, a gear, a belt, a rack, a cam or a turning input ties: Σ share·x = right.

    `number` counts the guides, the meshes (`Description.meshes`), the cams or the inputs of the file. The constant of a mesh is
    that of the guess.
    """

    kind: Literal["guide", "gear", "belt", "rack", "cam", "input"]
    number: int
    label: str
    shares: Mapping[Coordinate, float]
    right: Angle = field(default_factory=Angle)

    @property
    def gear(self) -> int | None:
        """The number of the mesh of a gear, a belt or a rack; None of others."""
        return None if self.kind in ("guide", "cam", "input") else self.number

    @property
    def torques(self) -> dict[str, float]:
        """The shares of angles alone: how its torque acts on each body."""
        return {body: c for body, c in self.shares.items() if isinstance(body, str)}


def relations(m: Description) -> Iterator[Relation]:
    """Every relation between angles and slides: of inputs, sliders, gears, belts, racks and cams."""
    for j, e in enumerate(m.inputs):
        if e.link is not None:
            yield Relation(
                "input", j, f"input {e.name}", {e.link: 1.0, e.on: -1.0}, Angle(inputs=((j, 1.0),))
            )
    for i, g in enumerate(m.guides):
        if g.turned is not None:
            right = Angle(g.angle + g.turned)
            yield Relation("guide", i, guide_label(m, i), {g.link: 1.0, g.on: -1.0}, right)
    for i, mesh in enumerate(m.meshes):
        yield Relation(mesh.kind, i, mesh.label, mesh.shares)
    for i, drive in enumerate(m.cam_drives):
        right = Angle(drive.rest, cams=((drive.lift, drive.cam.sign),))
        follower: dict[Coordinate, float] = (
            {drive.body: 1.0, drive.on: -1.0} if drive.body else {int(drive.guide or 0): 1.0}
        )
        yield Relation("cam", i, drive.label, follower, right)
