"""What bears on what: from the loads on the links to the loops, the joints and the inputs, as combinations of force terms.

The order of solution places every body by one joint of a tree and closes loops at the others. A force at
P = P[base] + Σ z·s·e^{iθ} bears on the base as it is, on each angle with its lever, (z s e^{iθ}) × F, on each slide
along it. What bears on an angle θ or a slide of the tree, its generalized force Q, is so a sum whose coefficients depend
on the mechanism alone. The links' inertia appears in it as in the equations of an open chain of links: a link's
inertia about the point that carries it, times α, and its mass times that point's acceleration.

- Virtual work needs nothing else: with κ = dθ/dq the effort is −Σ Q κ, Q of the loads alone.
- The forces λ at the loop joints are the multipliers of the loops: for each unknown x of a group

      Q_x + Σ_c λ_c·∂C_c/∂x = 0,

  the group's own small Jacobian transposed, already formed for the velocities. Q_x gathers the loads and loop forces
  of all that depends on the group, which is why groups are taken in reverse.
- The other joints follow from ΣF = 0 of one body or one pin after the other (Ibrahim §2.2, d'Alembert), torques from
  ΣM = 0 (Ibrahim §2.3).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np

from dalembert.dataclass import dataclass
from virtualwork.describe.meshes import Coordinate
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.force_terms import (
    Carried,
    Combination,
    ContactForce,
    ContactMoment,
    ForceTerm,
    Lifted,
    Transmitted,
    in_order,
)
from virtualwork.formulas.load_case import LoadCase
from virtualwork.formulas.loaded_pose import LoadedPose
from virtualwork.formulas.numbers import Number, dot
from virtualwork.formulas.touches import Touch, Touches
from virtualwork.plan.joint_forces import Order, Side
from virtualwork.plan.steps import Group, Place, Term, Turn, key_of

# lever (None: the point itself), sign, source of the force
Borne = tuple[Term | None, float, tuple[str, Any]]

# a combination on its way down a chain of links is formed where it has more terms than this, and is one from there
LONG = 4
# groups; forming a term of one calls for that of the next, some ten calls deep for each
DEEP = 20


class LoadPaths:
    """The loads of a mechanism on its tree, its loops and its joints; made once for an assembly."""

    def __init__(self, case: LoadCase) -> None:
        self.case, self.force_terms = case, case.force_terms
        self.mechanism, self.plan = case.mechanism, case.plan
        self.order = Order(self.mechanism, self.plan)
        self._deep = max(len(self.plan.groups), len(self.mechanism.links)) > DEEP
        self._known: dict[Any, Combination] = {}
        self._on_group: dict[str, list[Combination]] = {}
        self._sides: dict[Side, Combination] = {}
        self._borne: dict[str, list[Borne]] = {}
        self._tied: dict[str, list[tuple[Coordinate, float]]] = {}
        self.touches = Touches(self.mechanism, self.plan)
        self._note_bases()
        # from the last link inward, or long chains would nest the calls
        for step in reversed(self.plan.steps):
            if isinstance(step, Place):
                self.node(step.node)
                self.node(step.node, free=True)

    def value(self, pose: LoadedPose, terms: Combination) -> Number:
        """The value of a sum at a pose; what a long chain of links passes on is formed from its far end."""
        if self._deep:
            for row in terms:
                for part in in_order(row, pose.kept) if row is not None else ():
                    if part.lasts:
                        pose.formed(part)
        return terms.value(pose)

    # --- the tree ---------------------------------------------------------------------------------------------
    def _note_bases(self) -> None:
        """Note for each node, angle and slide what bears on it."""

        def bear(
            base: str | None,
            terms: Iterable[Term],
            source: tuple[str, Any],
            along: Iterable[Term] | None = None,
        ) -> None:
            if base is not None:
                self._borne.setdefault(f"point:{base}", []).append((None, 1.0, source))
            for t in terms:
                if t.body != GROUND:
                    self._borne.setdefault(f"angle:{t.body}", []).append((t, 1.0, source))
            for t in terms if along is None else along:
                if t.slide is not None:
                    self._borne.setdefault(f"slide:{t.slide}", []).append((t, 1.0, source))

        for load in self.case.everything:
            if load.path is not None and load.body != GROUND:
                # what rubs on a rail acts where the pin stands, but on the rail, which does not slide with the pin
                along = None if load.rail is None else self.case.path(load.body, load.place)[1]
                bear(*load.path, ("load", load), along)
        for step in self.plan.steps:
            ties = step.ties if isinstance(step, Group) else (step,) if isinstance(step, Turn) else ()
            for tie in ties:
                for base, r in tie.angle.bases:
                    self._tied.setdefault(key_of(base), []).append((tie.body, r))
            if isinstance(step, Place):
                bear(step.base, step.terms, ("point", step.node))
            elif isinstance(step, Group):
                for c, closure in enumerate(step.closures):
                    source = ("loop", (step, c))
                    bear(closure.start, closure.terms, source)
                    if closure.end is not None:
                        self._borne.setdefault(f"point:{closure.end}", []).append((None, -1.0, source))

    def _source(self, source: tuple[str, Any], free: bool) -> Combination:
        kind, of = source
        if kind == "load":
            return of.combination(self.force_terms)  # type: ignore[no-any-return]
        if kind == "point":
            return self.node(of, free=free)
        return Combination() if free else Combination({self.multiplier(*of): 1.0})

    def node(self, node: str, *, free: bool = False) -> Combination:
        """The force that bears on a point; `free`: of the loads alone, as if every loop were open."""
        key = node, free
        if key not in self._known:
            total = Combination()
            for _, sign, source in self._borne.get(f"point:{node}", ()):
                total.add(self._source(source, free), sign)
            self._known[key] = (
                Combination({self.force_terms(Transmitted, total): 1.0}) if len(total) > LONG else total
            )
        return self._known[key]

    def own(self, key: str, without: Group | None = None, *, free: bool = False) -> Combination:
        """Q of an angle or a slide, N·m or N: `without` the loops of one group, or `free` of all.

        What bears on angles tied to this one is not in it.
        """
        name = key, without and without.name, free
        if name not in self._known:
            levers: dict[tuple[str, int | None], Combination] = {}
            along = key.startswith("slide:")
            for t, _, source in self._borne.get(key, ()):
                if t is None or (source[0] == "loop" and source[1][0] is without):
                    continue
                force = levers.setdefault((t.body, None if along else t.slide), Combination())
                force.add(self._source(source, free), t.z.conjugate())
            total = Combination() if along else self.torque(key.removeprefix("angle:"), free=free)
            for (body, slide), force in levers.items():
                total.add(self.force_terms.lever(body, slide, force, along))
            self._known[name] = self.force_terms.total(total)
        return self._known[name]

    def with_ties(self, key: str, without: Group | None) -> Combination:
        """Q of an angle or a slide, of all that is tied to it too, `without` the loops of one group."""
        total = Combination(self.own(key, without))
        for body, r in self._tied.get(key, ()):
            total.add(self.with_ties(key_of(body), without), r)
        for touch, sign in self.touches.turned_by(key):
            lifted = self.with_ties(touch.coordinate, without)
            if lifted:
                total.add(Combination({self.force_terms(Lifted, lifted, touch): sign}))
        return total

    def push(self, touch: Touch) -> Combination:
        """What a cam does along the coordinate of its follower: it balances all that bears on that."""
        return self.with_ties(touch.coordinate, None).times(-1.0)

    def contact(self, touch: Touch) -> ForceTerm:
        """The contact force of a cam on its follower."""
        key = "contact", touch.drive.number
        if key not in self._known:
            of = self.force_terms(ContactForce, self.push(touch), touch)
            self._known[key] = Combination({of: 1.0})
        return next(iter(self._known[key]))  # type: ignore[return-value]

    def on_group(self, group: Group) -> list[Combination]:
        """Q of each unknown of a group, angles and then slides, without its own loops."""
        if group.name not in self._on_group:
            keys = [*(f"angle:{a}" for a in group.angles), *(f"slide:{s}" for s in group.slides)]
            self._on_group[group.name] = [self.with_ties(key, group) for key in keys]
        return self._on_group[group.name]

    @cached_property
    def working(self) -> list[tuple[str | None, int, Combination]]:
        """Q of the loads alone for each body's angle and each slide on which any bears: (body, or None, guide, Q)."""
        bodies = [(body, -1, self.own(f"angle:{body}", free=True)) for body in self.mechanism.links]
        slides = [(None, g, self.own(f"slide:{g}", free=True)) for g in range(len(self.mechanism.guides))]
        return [entry for entry in (*bodies, *slides) if entry[2]]

    # --- one body -----------------------------------------------------------------------------------------------
    def force(self, body: str, *, touched: bool = True) -> Combination:
        """The sum of the forces on a body, those of cams (`touched`) among them."""
        total = Combination()
        for touch, sign in self.touches.on(body) if touched else ():
            total.add(Combination({self.contact(touch): sign}))
        for load in self.case.everything:
            if load.body == body and load.path is not None:
                total.add(load.combination(self.force_terms))
        return total

    def torque(self, body: str, *, free: bool = False) -> Combination:
        """The sum of the torques on a body, without what its forces' levers make; `free` of the motors it carries."""
        total = Combination()
        for load in self.case.everything:
            if load.body == body and load.path is None:
                total.add(load.combination(self.force_terms))
        for carrying, j, sign in () if free else self.case.carried:
            if carrying == body:
                total.add(Combination({self.force_terms(Carried, j): sign}))
        return total

    def moment(
        self,
        body: str,
        about: complex,
        sides: Iterable[tuple[complex, int | None, complex, Combination]] = (),
        *,
        touched: bool = True,
    ) -> Combination:
        """The moment on a body about a point of its own, of its loads and of further forces at its points.

        `sides`: (place z, guide or None, direction d, force): at z, or at z + d·s of a guide.
        """
        levers: dict[int | None, Combination] = {}

        def at(place: complex, slide: int | None, direction: complex, force: Combination) -> None:
            levers.setdefault(None, Combination()).add(force, (place - about).conjugate())
            if slide is not None:
                levers.setdefault(slide, Combination()).add(force, direction.conjugate())

        for load in self.case.everything:
            if load.body == body and load.path is not None:
                direction = 0j if load.rail is None else self.plan.directions[load.rail]
                at(load.place, load.rail, direction, load.combination(self.force_terms))
        for entry in sides:
            at(*entry)
        total = self.torque(body)
        for touch, sign in self.touches.on(body) if touched else ():
            acts = self.force_terms(ContactMoment, touch, self.contact(touch), self.case.path(body, about))
            total.add(Combination({acts: sign}))
        for slide, force in levers.items():
            total.add(self.force_terms.lever(body, slide, force))
        return total

    # --- joints -------------------------------------------------------------------------------------------------
    def multiplier(self, group: Group, loop: int) -> ForceTerm:
        """λ of a loop, as a row."""
        key = "loop", group.name, loop
        if key not in self._known:
            solved = self.force_terms(LoopForces, self, group)
            self._known[key] = Combination({self.force_terms(Multiplier, solved, loop): 1.0})
        return next(iter(self._known[key]))  # type: ignore[return-value]

    def side(self, side: Side) -> Combination:
        """The force of a joint on a body: the reaction of a joint that is solved, or a row of its own."""
        if side not in self._sides:
            self._sides[side] = self._side(side)
        return self._sides[side]

    def _side(self, side: Side) -> Combination:
        joint, body = side
        if body == GROUND:
            total = Combination()
            for other in self.order.by_key[joint].bodies:
                if other != GROUND:
                    total.add(self.side((joint, other)), -1.0)
            return total
        kind, of = self.order.recipes[side]
        if kind == "loop":
            return Combination({self.multiplier(*of): 1.0})
        bodies = self.order.by_key[joint].bodies
        if kind == "joint" and len(bodies) == 2:
            return self.side((joint, bodies[0] if bodies[1] == body else bodies[1])).times(-1.0)
        return Combination({self.force_terms(SideForce, self, side): 1.0})

    def balance(self, side: Side) -> Combination:
        """The force of a joint on a body from ΣF = 0 of the body or of the pin."""
        key = "balance", side
        if key in self._known:
            return self._known[key]
        joint, body = side
        kind, _ = self.order.recipes[side]
        if kind == "body":
            total = self.force(body)
            others = [s for s in self.order.sides[body] if s != side]
        else:
            total = Combination()
            others = [(joint, other) for other in self.order.by_key[joint].bodies if other != body]
        for other in others:
            total.add(self.side(other))
        self._known[key] = total.times(-1.0)
        return self._known[key]

    def place(self, side: Side) -> tuple[complex, int | None, complex]:
        """Where a joint's force acts on a body, in its axes: at z, or at z + d·s of a guide."""
        joint, body = side
        points = self.mechanism.bodies[body]
        if joint.startswith("pin:"):
            return points[joint[4:]], None, 0j
        g = int(joint[6:])
        guide = self.mechanism.guides[g]
        if body == guide.link:
            return points[guide.point], None, 0j
        return self.mechanism.through(guide), g, self.plan.directions[g]

    def rest(self, body: str) -> Combination:
        """ΣM of a body's loads and joint forces: what torques must balance.

        About the joint whose force was computed last, from ΣF = 0: this force has no lever.
        """
        key = "rest", body
        if key not in self._known:
            about = self.mechanism.rigid[body].center
            sides = self.order.sides[body]
            for side in sides:
                z, guide, _ = self.place(side)
                if self.order.recipes[side] == ("body", body) and guide is None:
                    about, sides = z, [s for s in sides if s != side]
                    break
            acts = [(*self.place(side), self.side(side)) for side in sides]
            total = self.moment(body, about, acts)
            for guide, mesh in self.order.along.items():
                share = self.mechanism.meshes[mesh].torques.get(body, 0.0)
                if share:
                    total.add(Combination({self.force_terms(ToothForce, self, guide): share}))
            self._known[key] = self.force_terms.total(total)
        return self._known[key]

    def tooth(self, mesh: int) -> Combination:
        """The tooth force of a rack along its slide: that on the link of the guide is positive, N."""
        rack = self.mechanism.meshes[mesh]
        assert rack.guide is not None
        if self.order.along.get(rack.guide) == mesh:
            return Combination({self.force_terms(ToothForce, self, rack.guide): 1.0})
        return self.couple("rack", mesh)

    def couple(self, kind: str, i: int) -> Combination:
        """The torque of a guide, a gear or an input, from the bodies' ΣM = 0."""
        key = "couple", kind, i
        if key not in self._known:
            total = Combination()
            for body, factor in self.order.couple(kind, i).items():
                total.add(self.rest(body), -factor)
            self._known[key] = total
        return self._known[key]


@dataclass(frozen=True, eq=False)
class LoopForces(ForceTerm):
    """The forces λ at the loop joints of a group: its Jacobian, transposed, solved for what bears on its unknowns."""

    paths: LoadPaths
    group: Group
    lasts = True

    def reads(self) -> Iterable[ForceTerm | None]:
        return [row for load in self.paths.on_group(self.group) for row in load]

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        group = self.group
        pose.names.add(group.name)
        loads = [load.value(pose) for load in self.paths.on_group(self.group)]
        if group.name in pose.st.folded:
            # singular in every pose: it may be under stress without any load
            nothing = np.full(np.shape(pose.st.inputs[0]), complex(np.nan, np.nan))[()]
            return 1.0, [nothing] * len(group.closures)
        if all(load is None for load in loads):
            return 1.0, [None] * len(group.closures)
        cols = pose.by[0].columns(group)
        if group.kind == "Newton":
            return 1.0, pose.kind.transposed(cols, loads)
        (c1, c2), (q1, q2) = cols[0], loads
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            inverse = pose.kind.regular(pose.by[0].inverse(group), c1, c2)
            # λ = i (c2 q1 − c1 q2)/(c1 × c2)
            if q1 is None:
                total = c1 * (q2 * -inverse)
            else:
                total = c2 * (q1 * inverse)
                total = total if q2 is None else total - c1 * (q2 * inverse)
        return 1.0, [1j * total]


@dataclass(frozen=True, eq=False)
class Multiplier(ForceTerm):
    """The force λ at one loop joint of a group."""

    solved: ForceTerm
    loop: int

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        return 1.0, pose.formed(self.solved)[1][self.loop]

    def reads(self) -> Iterable[ForceTerm | None]:
        return (self.solved,)


@dataclass(frozen=True, eq=False)
class SideForce(ForceTerm):
    """The force of a joint on a body from ΣF = 0."""

    paths: LoadPaths
    side: Side
    lasts = True

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        joint, body = self.side
        pose.names.add(f"{joint} on {body}")
        return 1.0, self.paths.balance(self.side).value(pose)

    def reads(self) -> Iterable[ForceTerm | None]:
        return self.paths.balance(self.side)


@dataclass(frozen=True, eq=False)
class ToothForce(ForceTerm):
    """The tooth force of a rack, as the force along the guide of its slide."""

    paths: LoadPaths
    guide: int
    lasts = True

    def form(self, pose: LoadedPose) -> tuple[float, Number]:
        g = self.paths.mechanism.guides[self.guide]
        # the ground has no forces of its own: it feels the reverse of the link's
        body, sign = (g.link, 1.0) if g.link != GROUND else (g.on, -1.0)
        force = self.paths.side((f"guide:{self.guide}", body)).value(pose)
        if force is None:
            return 1.0, None
        return sign, dot(force, pose.rail(self.guide))

    def reads(self) -> Iterable[ForceTerm | None]:
        g = self.paths.mechanism.guides[self.guide]
        return self.paths.side((f"guide:{self.guide}", g.link if g.link != GROUND else g.on))
