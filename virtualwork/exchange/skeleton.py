"""A mechanism as bodies and joints of two bodies each in its start pose: the tree, what closes its loops, what a format leaves out.

A pin of several bodies becomes joints of two each; a slot becomes a massless block that slides and is pinned.
"""

from __future__ import annotations

import cmath
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from dalembert.documents.markup import digits
from dalembert.documents.robots import BLOCK, WORLD
from dalembert.errors import DataError
from virtualwork.describe.meshes import Mesh
from virtualwork.describe.parts import GROUND
from virtualwork.drawing import hull
from virtualwork.exchange.drawing import Travel, bodies_of, start_of
from virtualwork.exchange.drawn import Body, Groups, unused
from virtualwork.parts_of_motion import SlideMotion

if TYPE_CHECKING:
    from virtualwork.mechanism import Mechanism

# half the thickness of a link's strokes, of the mechanism's size
THICK = 0.008
# a rate of nothing, for an input's of one
STILL = 1e-9


@dataclass
class Joint:
    """A joint: `link` turns against `on`, or slides along a direction of the ground, rad, in the start pose.

    `ends` is its place in the axes of `on` and of `link`; `value` its coordinate in the start pose, `rate` its speed.
    """

    name: str
    kind: Literal["turn", "slide"]
    on: str
    link: str
    ends: tuple[complex, complex]
    point: str
    direction: float = 0.0
    value: float = 0.0
    rate: float = 0.0
    input: int | None = None
    guide: int | None = None
    limits: tuple[float, float] | None = None

    def axis(self, body: Body, sense: float) -> tuple[float, float, float]:
        """Return its axis in those of a body: about which it turns, or along which it slides."""
        if self.kind == "turn":
            return 0.0, 0.0, sense
        along = sense * cmath.rect(1.0, self.direction - body.turn)
        return along.real, along.imag, 0.0

    def turn_about(self) -> None:
        """Turn `on` against `link` instead."""
        self.on, self.link = self.link, self.on
        self.ends, self.rate = (self.ends[1], self.ends[0]), -self.rate


@dataclass(frozen=True)
class Branching:
    """A joint of the tree: `sense` is −1 where the parent is the link that moves along its coordinate."""

    joint: Joint
    parent: str
    child: str
    sense: float


class Skeleton:
    """The bodies, the joints, the tree and the loops of a mechanism at some inputs."""

    def __init__(self, m: Mechanism, inputs: tuple[float, ...], travel: Travel) -> None:
        if WORLD in m.links:
            raise DataError(f"the link '{WORLD}' is called as the ground of robots: give it another name")
        self.m, self.inputs, self.travel = m, inputs, travel
        self.start = start_of(m, inputs)
        self.bodies = bodies_of(m, self.start)
        self.joints: list[Joint] = []
        self._pins()
        self._guides()
        self._indirect_inputs()
        for joint in self.joints:
            joint.limits = travel.limits if joint.input is not None else None
        self._branch()

    # --- joints -----------------------------------------------------------------------------------------------
    def _wanted(self) -> list[tuple[str, str]]:
        """Pairs of bodies between which a joint is wanted: of inputs, then of gears, belts and racks and their arms."""
        pairs = [(e.on, str(e.link)) for e in self.m.inputs if not e.is_slide]
        pairs += [(g.arm, link) for g in self.m.gears for link in g.links]
        pairs += [(b.arm, link) for b in self.m.belts for link in b.links]
        racks = [(self.m.guides[self.m.guide_at(rack.slider)].on, rack.gear) for rack in self.m.racks]
        return pairs + racks

    def _pins(self) -> None:
        wanted = self._wanted()
        for point, bodies in self.m.pins.items():
            pairs = [p for p in wanted if set(p) <= set(bodies)]
            pairs += [(bodies[0], other) for other in bodies[1:]]
            for on, link in (pairs[k] for k in _spanning(bodies, pairs)):
                ends = self.m.bodies[on][point], self.m.bodies[link][point]
                self._turn(point, on, link, (ends[0], ends[1]))

    def _turn(self, point: str, on: str, link: str, ends: tuple[complex, complex]) -> None:
        """Add a pin; an input's coordinate is that of the input, any other's is 0 in the start pose."""
        joint = Joint(self._name(point), "turn", on, link, ends, point)
        for j, e in enumerate(self.m.inputs):
            if not e.is_slide and {e.link, e.on} == {on, link} and not self.joint_of(j):
                joint.input, joint.value = j, self.inputs[j]
                if e.link == on:
                    joint.turn_about()
        joint.rate = self._omega(joint.link) - self._omega(joint.on)
        self.joints.append(joint)

    def _omega(self, body: str) -> float:
        return float(self.start.link(body).omega[0]) if body in self.m.links else 0.0

    def _guides(self) -> None:
        m = self.m
        for k, g in enumerate(m.guides):
            on, link, rider = self.bodies[g.on], self.bodies[g.link], g.link
            slide = SlideMotion(self.start, k)
            value, at = float(slide.position[0]), link.points[g.point]
            direction = on.turn + g.angle
            if not g.is_slider:
                rider = unused(f"{BLOCK}{g.point}", self.bodies, " ")
                link = self.bodies[rider] = Body({g.point: 0j}, link.world(at), direction)
                self._turn(g.point, g.link, rider, (at, 0j))
                at = 0j
                self.joints[-1].rate = self._omega(g.on) - self._omega(g.link)
            joint = Joint(self._name(g.point), "slide", g.on, rider, (on.inside(link.world(at)), at), g.point)
            joint.direction, joint.value, joint.rate = direction, value, float(slide.speed[0])
            joint.guide = k
            driver = m.driver_of(k)
            if driver is not None and m.guide_of(m.inputs[driver]) == k:
                joint.input = driver
            self.joints.append(joint)

    def _indirect_inputs(self) -> None:
        """Take as an input's joint one of bodies that turn as its links do: along a guide nothing turns."""
        self.alike = Groups(self.bodies)
        for j in self.joints:
            if j.kind == "slide":
                self.alike.join(j.on, j.link)
        for k, e in enumerate(self.m.inputs):
            if e.is_slide or self.joint_of(k):
                continue
            wanted = [self.alike.of(body) for body in (str(e.link), e.on)]
            for j in self.joints:
                pair = [self.alike.of(body) for body in (j.on, j.link)]
                if j.kind == "turn" and j.input is None and set(pair) == set(wanted):
                    j.input, j.value = k, self.inputs[k]
                    if pair[0] == wanted[0]:
                        j.turn_about()
                    break

    def joint_of(self, k: int) -> Joint | None:
        """Return the joint whose coordinate is an input."""
        return next((j for j in self.joints if j.input == k), None)

    def _name(self, wanted: str) -> str:
        # no two of SDF's links, joints and frames have one name
        return unused(wanted, {WORLD, *self.bodies, *(j.name for j in self.joints)}, " ")

    # --- tree -------------------------------------------------------------------------------------------------
    def _branch(self) -> None:
        """Take joints into the tree: those that are driven, then slides, then those on which gears turn."""
        wanted = [set(pair) for pair in self._wanted()]

        def rank(j: Joint) -> int:
            if j.input is not None:
                return 0
            if j.kind == "slide":
                return 1
            # a light block hangs between two links, and no loop is closed on it where that can be
            if not {j.on, j.link} <= {GROUND, *self.m.links}:
                return 2
            return 3 if {j.on, j.link} in wanted else 4

        order = sorted(self.joints, key=rank)
        taken = [order[k] for k in _spanning(self.bodies, [(j.on, j.link) for j in order])]
        self.closing = [j for j in self.joints if j not in taken]
        # a slide that closes a loop carries a block, which is fixed to the link
        self.welds: list[tuple[str, str]] = []
        for j in [j for j in self.closing if j.kind == "slide"]:
            link, block = self.bodies[j.link], unused(f"carriage {j.point}", self.bodies, " ")
            self.bodies[block] = Body(at=link.at, turn=link.turn)
            self.welds.append((j.link, block))
            self.closing.remove(j)
            j.link = block
            taken.append(j)
        self.children: dict[str, list[Branching]] = {}
        # the pins that turn each body against the ground, with their sense
        self.path: dict[str, dict[str, float]] = {GROUND: {}}
        waiting = [GROUND]
        while waiting:
            parent = waiting.pop(0)
            for j in [j for j in taken if parent in (j.on, j.link)]:
                taken.remove(j)
                if parent == j.link and j.kind == "turn" and j.input is None:
                    j.turn_about()
                child = j.link if parent == j.on else j.on
                branching = Branching(j, parent, child, 1.0 if child == j.link else -1.0)
                self.children.setdefault(parent, []).append(branching)
                turned = {j.name: branching.sense} if j.kind == "turn" else {}
                self.path[child] = self.path[parent] | turned
                waiting.append(child)
        lost = [name for name in self.bodies if name not in self.path]
        if lost:
            raise DataError(
                f"{', '.join(lost)}: no chain of pins and guides joins it to the ground: not exported"
            )

    def free_points(self, name: str) -> dict[str, complex]:
        """Return the named points of a link that no joint holds, in its axes; none is called as a body is."""
        held = {*self.m.pins, *(j.point for j in self.joints)}
        points = {} if name == GROUND else self.bodies[name].points
        bodies = {WORLD, *self.bodies}
        return {f"{p} point" if p in bodies else p: z for p, z in points.items() if p not in held}

    def walk(self, parent: str = GROUND) -> Iterator[Branching]:
        """Yield the tree's joints, each branch to its end."""
        for b in self.children.get(parent, ()):
            yield b
            yield from self.walk(b.child)

    def terms(self, shares: Mapping[str, float]) -> dict[str, float]:
        """Return a sum of the bodies' angles as one of the tree's pins."""
        result: dict[str, float] = {}
        for body, c in shares.items():
            for name, sense in self.path[body].items():
                result[name] = result.get(name, 0.0) + c * sense
        return {name: c for name, c in result.items() if abs(c) > 1e-12}

    def mesh(self, mesh: Mesh) -> dict[str, float]:
        """Return what a gear, a belt or a rack holds, as a sum of the tree's coordinates."""
        result = self.terms(mesh.torques)
        if mesh.guide is not None:
            slide = next(j.name for j in self.joints if j.guide == mesh.guide)
            result[slide] = mesh.shares[mesh.guide]
        return result

    def driven(self, k: int) -> Joint | None:
        """Return the joint whose coordinate is an input; where none is, the one on which its link hangs in the tree."""
        own = self.joint_of(k)
        if own is not None:
            return own
        unit = [[float(i == k) for i in range(len(self.inputs))]]
        motion = self.m.motion(
            *(np.array([self.inputs]), unit) if len(self.inputs) > 1 else (self.inputs[0], 1.0)
        )

        def moves(j: Joint) -> bool:
            bodies = (self.alike.of(body) for body in (j.on, j.link))
            on, link = (float(motion.link(body).omega[0]) if body != GROUND else 0.0 for body in bodies)
            return abs(on - link) > STILL

        hanging = (
            b.joint for b in self.walk() if b.child == self.m.inputs[k].link and b.joint.kind == "turn"
        )
        return next((j for j in hanging if j.input is None and moves(j)), None)

    def free_input(self, j: int) -> dict[str, float]:
        """Return an input's angle as a sum of the tree's pins, where no joint is it."""
        e = self.m.inputs[j]
        return self.terms({str(e.link): 1.0, e.on: -1.0})

    # --- how a link is drawn ------------------------------------------------------------------------------------
    @property
    def thickness(self) -> float:
        """Half the thickness of a link's strokes, m."""
        return THICK * self.m.size

    def strokes(self, name: str) -> list[tuple[complex, complex]]:
        """Return what a body looks like: the sides of the hull of its points, in its axes."""
        ends = hull(self.bodies[name].points.values())
        return list(zip(ends, ends[1:] + (ends[:1] if len(ends) > 2 else ()), strict=False))

    def boxes(self, name: str) -> Iterator[tuple[complex, float, tuple[float, float, float]]]:
        """Yield the strokes as boxes: the middle, the direction and the sides of each."""
        for a, b in self.strokes(name):
            yield (a + b) / 2, cmath.phase(b - a), (abs(b - a), 2 * self.thickness, 2 * self.thickness)

    # --- what a format leaves out -------------------------------------------------------------------------------
    def left_out(self, holds: Collection[str], racks: str = "") -> list[str]:
        """Name what a format cannot hold.

        Parameters
        ----------
        holds : collection of str
            What it holds of springs, torsion springs, gravity, inputs (of any two links), massless (links without mass).
        racks : str
            Its own sentence on the racks that it cannot hold; empty where there are none.
        """
        m = self.m
        loads = {
            "forces": m.forces,
            "torques": m.torques,
            "springs": m.springs,
            "torsion springs": m.torsion_springs,
            "friction": m.friction,
        }
        result = [
            f"{what} {'is' if what == 'friction' else 'are'} left out: {len(parts)}"
            for what, parts in loads.items()
            if parts and what not in holds
        ]
        if m.cams:
            result.append(f"cams are left out: {len(m.cams)}: the format has no such joint")
        result += [racks] if racks else []
        light = [name for name, body in self.bodies.items() if body.mass <= 0 and name in m.links]
        if light and "massless" not in holds:
            result.append(
                f"without mass: {', '.join(light)}: the format requires a mass: a millionth of the heaviest is written"
            )
        for k, e in enumerate(m.inputs if "inputs" not in holds else ()):
            j = self.driven(k)
            if j is None or j.input != k:
                instead = f": {j.link} is driven against {j.on} instead" if j is not None else ""
                result.append(f"input {e.name} is left out: no pin joins {e.link} and {e.on}{instead}")
        for k, e in enumerate(m.inputs):
            laws = {"acceleration": e.acceleration, "jerk": e.jerk, "table of its motion": e.history}
            lost = [what for what, law in laws.items() if law]
            if lost:
                are = "is" if len(lost) == 1 else "are"
                result.append(
                    f"{' and '.join(lost)} of input {e.name} {are} left out: the format has its speed alone"
                )
            if k in m.carried:
                result.append(
                    f"the motor of input {e.name} is left out: it sits on {m.carrier(k)}, and drives against {e.on}"
                )
        if m.gravity and "gravity" not in holds:
            result.append("gravity is left out: the format has none")
        return result


def spatial(z: complex) -> str:
    """Return a place of the plane as one of space."""
    return digits(z.real, z.imag, 0.0)


def _spanning(nodes: Iterable[str], pairs: list[tuple[str, str]]) -> list[int]:
    """Return which of some pairs, the first before the last, join all nodes without a loop (Kruskal).

    >>> _spanning("abc", [("a", "b"), ("b", "a"), ("b", "c"), ("a", "c")])
    [0, 2]
    """
    groups = Groups(nodes)
    return [k for k, pair in enumerate(pairs) if groups.join(*pair)]
