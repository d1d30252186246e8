"""The order of solution of a mechanism: its Assur groups, as a flat list of steps that is plain data.

The equations of the joints and the coordinates they hold form a bipartite graph. Its Dulmage-Mendelsohn
decomposition (A. L. Dulmage, N. S. Mendelsohn, Can. J. Math. 10 (1958) 517) is unique; its irreducible blocks, in
order, are the Assur groups: each is solved when what it depends on is known. Angles tied by sliders, gears and
inputs are linear relations and are eliminated before anything else; what remains of a block is its loop closure
R_1 e^{iθ1} + R_2 e^{iθ2} + ... = 0 (Ibrahim eq. 1.3.1; Nicoletti, lecture 7) in its own few angles and slides.

All of this depends on which points are the same, not on where they lie: the vectors R are written down in the points'
names (`sums.Vector`), and another mechanism of the same topology only puts its own numbers in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any

from virtualwork.describe import MobilityError
from virtualwork.describe.description import Description
from virtualwork.describe.meshes import Coordinate
from virtualwork.describe.parts import GROUND
from virtualwork.plan.steps import (
    Angle,
    Closure,
    Group,
    Kind,
    Path,
    Place,
    Plan,
    Relation,
    Slide,
    Step,
    Term,
    Turn,
    Variable,
    relations,
)
from virtualwork.plan.sums import Vector, combined, longer
from virtualwork.plan.ties import eliminated, guessed
from virtualwork.plan.topology import Topology, decompose


def plan(m: Description, *, merged: bool = False, phases: Mapping[int, float] | None = None) -> Plan:
    """The order of solution of a mechanism.

    Parameters
    ----------
    m : Description
    merged : bool
        All loops at once in one group (the Newton-Raphson of Nicoletti, lecture 7) instead of group by group.
    phases : mapping of a gear's number to its constant Σ c·θ, rad, optional
        Where they are known already.

    Raises
    ------
    MobilityError
        A free degree of freedom, too many inputs.
    """
    return Topology.of(m, merged, phases or {}).filled(planned)


def planned(topology: Topology) -> Plan:
    """The order of solution of a topology, its vectors in the names of points."""
    return _Planner(topology).run()


class _Planner:
    """Walks the blocks in order and writes the steps."""

    def __init__(self, topology: Topology) -> None:
        self.m = m = topology.first
        self.merged, self.phases = topology.merged, topology.phases
        self.points: dict[str, dict[str, Any]] = {
            body: {p: Vector.of(slot) for p, slot in slots} for body, slots in topology.bodies
        }
        # a point of each guide's line
        self.throughs: list[Any] = [Vector.of(line) for _, _, _, line, _ in topology.guides]
        self.guess: dict[Coordinate, float] = guessed(m) if m.meshes else {}
        self.relations = list(relations(m))
        self.driven = {m.guide_of(e): j for j, e in enumerate(m.inputs) if e.is_slide}
        self.steps: list[Step] = []
        # of angles, and of slides
        self.angles: dict[Coordinate, Angle] = {GROUND: Angle()}
        self.anchors: dict[str, Path] = {GROUND: (None, ())}
        self.nodes: set[str] = set()
        self.slides_known: set[int] = set()
        self.directions: dict[int, Any] = {i: Vector.of((i, "direction")) for i in range(len(m.guides))}
        # (joint, body) already spent to place a body or to close a loop
        self.used: set[tuple[str, str]] = set()
        # long chains: what is done is not looked through again for every block
        # bodies whose angle the steps written so far give
        self.solved: set[str] = set()
        # placed bodies whose pins are placed too
        self.settled: set[str] = set()
        # bodies all of whose loops are closed
        self.joined: set[str] = set()

    def run(self) -> Plan:
        self.blocks = decompose(self.m, self.relations)
        for body_point, z in self.points[GROUND].items():
            self._place(body_point, GROUND, z)
        pending = list(self.blocks.order)
        if self.merged and not self.m.cams:
            pending = [tuple(v for block in pending for v in block)]
        for block in pending:
            self._block(block)
        for body, points in self.points.items():
            for name, z in points.items():
                self._place(name, body, z)
        for g in self.m.guides:
            self._place(g.point, g.link, self.points[g.link][g.point])
        return Plan(
            tuple(self.steps),
            self.anchors,
            {body: angle for body, angle in self.angles.items() if isinstance(body, str)},
            self.directions,
            self.blocks,
        )

    # --- points -------------------------------------------------------------------------------------------
    def _place(self, node: str, body: str, z: Any) -> None:
        """Place a point that is not placed yet, where its body is."""
        if node not in self.nodes and body in self.anchors:
            base, terms = self.anchors[body]
            self.steps.append(Place(node, base, longer(terms, Term(z, body))))
            self.nodes.add(node)
            self.used.add((node, body))

    # --- one block ----------------------------------------------------------------------------------------
    def _block(self, block: tuple[Variable, ...]) -> None:
        fresh = [name for kind, name in block if kind == "angle"]
        slides = sorted(int(name) for kind, name in block if kind == "slide")
        for i in slides:
            if i in self.driven:
                self.steps.append(Slide(i, self.driven[i]))
                self.slides_known.add(i)
                self.angles[i] = Angle(inputs=((self.driven[i], 1.0),))
        open_, ties = self._eliminate([*(i for i in slides if i not in self.slides_known), *fresh])
        free = [x for x in open_ if isinstance(x, str)]
        own = tuple(tie for tie in ties if any(base in open_ for base, _ in tie.angle.bases))
        for tie in ties:
            if tie not in own:
                self.steps.append(tie)
                self._known(tie.body)
        self._settle()
        moving = {name for kind, name in block if kind in "xy"} - set(self.anchors)
        closures, trees = self._loops(moving)
        unknown = tuple(x for x in open_ if isinstance(x, int))
        # a wheel that a rack of the loops turns, and that holds none of them, follows
        looped = {x for closure in closures for t in closure.terms for x in (t.body, t.slide)}
        after = tuple(
            tie
            for tie in own
            if tie.body not in looped and all(isinstance(base, int) for base, _ in tie.angle.bases)
        )
        own = tuple(tie for tie in own if tie not in after)
        if closures or free or unknown:
            held = {*free, *(t.body for t in own), *moving}
            links = tuple(b for b in self.m.links if b in held)
            group = Group(" + ".join(links), links, "Newton", tuple(free), unknown, tuple(closures), own)
            self.steps.append(replace(group, kind=self._kind(group)))
            coordinates: tuple[Coordinate, ...] = (*group.members, *unknown, *group.tied_slides)
            for x in coordinates:
                self._known(x)
        for tie in after:
            self.steps.append(tie)
            self._known(tie.body)
        self.anchors.update(trees)
        self._settle()

    def _known(self, x: Coordinate) -> None:
        """Note that an angle or a slide is known from here on."""
        if isinstance(x, int):
            self.slides_known.add(x)
        else:
            self.solved.add(x)

    def _kind(self, group: Group) -> Kind:
        """Chace's case, where the group is one loop with two unknowns that turn or slide simply."""
        if len(group.closures) != 1 or len(group.angles) + len(group.slides) != 2:
            return "Newton"
        terms = group.closures[0].terms
        own = {body: body for body in group.angles}
        for tie in group.ties:
            if isinstance(tie.body, int):
                return "Newton"
            bases = [(b, r) for b, r in tie.angle.bases if b in group.angles]
            if len(bases) != 1 or len(tie.angle.bases) != 1 or not _unit(bases[0][1]) or tie.angle.gears:
                return "Newton"
            own[tie.body] = str(bases[0][0])
        held = {own.get(t.body) for t in terms} | {t.slide for t in terms}
        if not held.issuperset((*group.angles, *group.slides)):
            # an unknown that its loop does not hold
            return "Newton"
        turning = {own.get(t.body) for t in terms if t.slide in group.slides and t.slide is not None}
        if len(group.angles) == 2:
            return "RRR"
        if len(group.angles) == 1:
            return "RRP" if turning == {None} else "RPR"
        return "PRP"

    # --- angles: sliders, gears, belts, racks and inputs are linear relations --------------------------------
    def _relations(self, fresh: list[Coordinate]) -> list[tuple[Relation, Angle]]:
        """Σ c·θ = const + Σ k·input, for every relation all of whose angles are known once this block is."""
        new = set(fresh)
        relations = []
        for relation in self.relations:
            bodies = relation.shares.keys()
            if not all(body in new or body in self.angles for body in bodies):
                continue
            turned = {of.cam for of, _ in relation.right.cams} & new
            if turned:
                raise MobilityError(
                    f"[[cams]] {relation.number + 1} ({turned.pop()}): its own follower would have to turn it; a cam "
                    "moves its follower alone: drive the cam"
                )
            if bodies & new:
                right = relation.right
                if relation.gear is not None:
                    phase = self.phases.get(relation.gear)
                    right = Angle(phase) if phase is not None else Angle(gears=((relation.gear, 1.0),))
                relations.append((relation, right))
        return relations

    def _eliminate(self, fresh: list[Coordinate]) -> tuple[list[Coordinate], list[Turn]]:
        """Gauss-Jordan on the linear relations: which angles and slides stay free, and what the others are.

        A slide is tied to angles only where it has to be: the wheel of a rack turns with its slide, of which no whole
        turns have to be known.
        """
        rows: list[tuple[dict[Coordinate, float], Angle]] = []
        wheels = {mesh.rack.gear for mesh in self.m.meshes if mesh.rack is not None}
        for relation, right in self._relations(fresh):
            c = relation.shares
            relation_angle = replace(right, gears=())
            for body, factor in c.items():
                if body not in fresh:
                    relation_angle = relation_angle.plus(self.angles[body], -factor)
            unknown = {body: factor for body, factor in c.items() if body in fresh}
            if self.m.meshes:
                there = relation_angle.at(self.m.at)
                stands = sum(factor * self.guess.get(body, 0.0) for body, factor in unknown.items())
                if right.gears:
                    # its constant is that of the guess, at once where no link before it has to be placed
                    relation_angle = relation_angle.plus(right if there is None else Angle(stands - there))
                elif relation.kind == "guide" and there is not None and unknown.keys() <= self.guess.keys():
                    # gears count whole turns: those of a slider are the guess's
                    whole = round(complex(stands - there).real / (2 * math.pi))
                    relation_angle = (
                        relation_angle.plus(Angle(2 * math.pi * whole)) if whole else relation_angle
                    )
            rows.append((unknown, relation_angle))
        solved = eliminated(rows, fresh, wheels)
        free = [b for b in fresh if b not in solved]
        for x in free:
            self.angles[x] = Angle(bases=((x, 1.0),))
        turns = []
        for b, (others, value) in solved.items():
            angle = value
            for other, f in others.items():
                angle = angle.plus(Angle(bases=((other, 1.0),)), f)
            self.angles[b] = Angle(bases=((b, 1.0),)) if angle.gears else angle
            turns.append(Turn(b, angle))
        return free, turns

    # --- positions ------------------------------------------------------------------------------------------
    def _settle(self) -> None:
        """Place every body whose angle is known and that a joint ties to a placed one."""
        progress = True
        while progress:
            progress = False
            for body in self.m.links:
                if body not in self.anchors and body in self.solved:
                    attached = self._attach(
                        body, set(self.anchors), lambda b, z: self._chain(b, z, self.anchors)
                    )
                    if attached is not None:
                        self.anchors[body] = attached
                        progress = True
            for body in [b for b in self.anchors if b not in self.settled]:
                self.settled.add(body)
                for name, z in self.points[body].items():
                    if name in self.m.pins:
                        self._place(name, body, z)

    def _chain(self, body: str, z: Any, anchors: Mapping[str, Path]) -> Path:
        base, terms = anchors[body]
        return base, longer(terms, Term(z, body))

    def _attach(self, body: str, placed: Collection[str], chain: Callable[[str, Any], Path]) -> Path | None:
        """The first joint that ties a body to the placed ones: pins first, then guides whose slide is known."""
        points = self.points[body]
        for name, z in points.items():
            if name in self.nodes:
                self.used.add((name, body))
                return name, longer((), Term(-z, body))
        for i in range(len(self.m.guides)):
            if i not in self.slides_known or (f"guide {i}", "") in self.used:
                continue
            result = self._by_guide(i, body, placed, chain)
            if result is not None:
                return result
        return None

    def _by_guide(
        self, i: int, body: str, placed: Collection[str], chain: Callable[[str, Any], Path]
    ) -> Path | None:
        g, d = self.m.guides[i], self.directions[i]
        if g.link == body and g.on in placed:
            base, terms = chain(g.on, self.throughs[i])
            result = (
                base,
                combined((*terms, Term(d, g.on, i), Term(-self.points[body][g.point], body))),
            )
        elif g.on == body and g.link in placed:
            base, terms = chain(g.link, self.points[g.link][g.point])
            result = base, combined((*terms, Term(-self.throughs[i], body), Term(-d, body, i)))
        else:
            return None
        self.used.add((f"guide {i}", ""))
        return result

    def _loops(self, moving: set[str]) -> tuple[list[Closure], dict[str, Path]]:
        """A tree over the block's bodies from what is placed; every joint outside the tree closes a loop."""
        anchors = dict(self.anchors)
        nodes: dict[str, Path] = {name: (name, ()) for name in self.nodes}
        closures: list[Closure] = []
        # all loops at once: the driven links last, so that loops close over the passive side, as Nicoletti writes them
        last = {str(e.link) for e in self.m.inputs} if self.merged else set()
        # placed bodies matter where they meet what moves, or one that was placed since the last loops were closed
        fresh = moving | (set(anchors) - self.joined)
        pins = {name for body in fresh for name in self.points[body]}
        queue = [body for body in anchors if not pins.isdisjoint(self.points[body])]
        self.joined.update(anchors, moving)
        guides = [i for i in range(len(self.m.guides)) if (f"guide {i}", "") not in self.used]

        def chain(body: str, z: Any) -> Path:
            return self._chain(body, z, anchors)

        def join(body: str, name: str) -> None:
            """Enter a body at pin `name`, or close the loop there where it already stands."""
            z = self.points[body][name]
            if (name, body) in self.used:
                return
            if body in anchors:
                if name in nodes:
                    base, terms = chain(body, z)
                    if base == name and not terms:
                        return
                    self.used.add((name, body))
                    self._close(closures, (base, terms), nodes[name], name, body, None)
                else:
                    nodes[name] = chain(body, z)
                    self.used.add((name, body))
            else:
                base, terms = nodes[name]
                anchors[body] = base, longer(terms, Term(-z, body))
                self.used.add((name, body))
                queue.append(body)

        visited: set[str] = set()
        while True:
            while queue:
                body = next((b for b in queue if b not in last), queue[0])
                queue.remove(body)
                if body in visited:
                    continue
                visited.add(body)
                for name, z in self.points[body].items():
                    if name not in self.m.pins:
                        continue
                    if name not in nodes:
                        nodes[name] = chain(body, z)
                        self.used.add((name, body))
                    for other in self.m.pins[name]:
                        if other in moving or other in anchors:
                            join(other, name)
            # pins first: a guide carries a slide and is a poorer branch of the tree
            closed = False
            for i in list(guides):
                g = self.m.guides[i]
                for body in (g.link, g.on):
                    if body in moving and body not in anchors and not closed:
                        entry = self._by_guide(i, body, set(anchors), chain)
                        if entry is not None:
                            anchors[body] = entry
                            queue.append(body)
                            guides.remove(i)
                            closed = True
            if not closed:
                break
        for i in guides:
            g = self.m.guides[i]
            if g.link in anchors and g.on in anchors and (f"guide {i}", "") not in self.used:
                base, terms = chain(g.on, self.throughs[i])
                line = base, combined((*terms, Term(self.directions[i], g.on, i)))
                pin = chain(g.link, self.points[g.link][g.point])
                self.used.add((f"guide {i}", ""))
                # the loop's force is that on a body which moves: of a fixed pin in a slot, on the slot's
                if g.link == GROUND:
                    self._close(closures, line, pin, g.point, g.on, i)
                else:
                    self._close(closures, pin, line, g.point, g.link, i)
        return closures, {b: a for b, a in anchors.items() if b not in self.anchors}

    def _close(
        self, closures: list[Closure], there: Path, here: Path, joint: str, body: str, guide: int | None
    ) -> None:
        (start, plus), (end, minus) = there, here
        terms = combined((*plus, *(Term(-t.z, t.body, t.slide) for t in minus)))
        closures.append(Closure(start, end, terms, joint, body, guide))


def _unit(share: Any) -> bool:
    """Whether an angle turns as another one does."""
    return bool(share == 1.0 or (share.is_integer() and 1.0 <= share <= 1.0))
