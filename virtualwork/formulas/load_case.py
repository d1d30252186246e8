"""The loads of a mechanism, at rest or in motion: what its description gives, as loads that act.

A load that is zero for the whole case (no mass, no speed, no stiffness) is not made.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cached_property

from virtualwork.describe import DescriptionError
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND, Force, Spring, Torque, TorsionSpring
from virtualwork.formulas.force_terms import Combination, ForceTerms
from virtualwork.formulas.loads import (
    Constant,
    Follower,
    FrictionLoad,
    InertiaForce,
    InertiaTorque,
    Load,
    Tabled,
)
from virtualwork.formulas.springs import SpringEnd, TorsionEnd
from virtualwork.plan.steps import Joint, Path, Place, Plan, Term, joints, path_reads
from virtualwork.plan.sums import combined


class LoadCase:
    """What acts on a mechanism, at rest or moving; a load that is zero throughout is not in the list.

    It depends on no motion: an assembly makes it once for rest and once for all motions.
    """

    def __init__(self, mechanism: Description, plan: Plan, moves: bool) -> None:
        self.mechanism, self.plan, self.moves = mechanism, plan, moves
        self.force_terms = ForceTerms()
        self._paths: dict[tuple[str, complex], Path] = {}
        self._places = {step.node: step for step in plan.steps if isinstance(step, Place)}

    def path(self, body: str, z: complex) -> Path:
        """Where a point of a body lies: P[base] + Σ terms, as the order of solution places it."""
        if (body, z) not in self._paths:
            base, terms = self.plan.anchors[body]
            self._paths[body, z] = base, combined((*terms, Term(z, body)))
        return self._paths[body, z]

    @cached_property
    def loads(self) -> list[Load]:
        """Every load that is not zero throughout, friction apart."""
        m = self.mechanism
        loads: list[Load] = []
        for body, r in self.mechanism.rigid.items():
            at = body, self.path(body, r.center), r.center
            if r.mass and m.gravity:
                loads.append(Constant("weight", *at, r.mass * m.gravity))
            if r.mass and self.moves:
                loads.append(InertiaForce("inertia force", *at, r.mass, self.acceleration(at[1])))
            if r.inertia and self.moves:
                loads.append(InertiaTorque("inertia torque", body, None, r.center, r.inertia))
        loads += [self._force(force) for force in m.forces if force.history or force.force]
        loads += [self._torque(torque) for torque in m.torques if torque.history or torque.torque]
        for spring in m.springs:
            if spring.stiffness or (spring.damping and self.moves):
                loads += self._spring(spring)
        for torsion in m.torsion_springs:
            if torsion.stiffness or (torsion.damping and self.moves):
                loads += self._torsion(torsion)
        return loads

    @cached_property
    def tables(self) -> list[Tabled]:
        """The loads that tables give, in the order in which their forces enter a tape."""
        return [load for load in self.loads if isinstance(load, Tabled)]

    def _force(self, force: Force) -> Load:
        place = self.mechanism.place(force.link, force.point)
        at = "applied force", force.link, self.path(force.link, place), place
        if force.history:
            return Tabled(*at, force.history, force.periodic, force.frame == "link")
        return (Follower if force.frame == "link" else Constant)(*at, force.force)

    @staticmethod
    def _torque(torque: Torque) -> Load:
        at = "applied torque", torque.link, None, 0j
        if torque.history:
            return Tabled(*at, torque.history, torque.periodic, axis=torque.over)
        return Constant(*at, torque.torque)

    def _spring(self, spring: Spring) -> list[Load]:
        between = [(body, self.mechanism.place(body, point)) for body, point in spring.between]
        ends = [self.path(*end) for end in between]
        result: list[Load] = []
        for k, (body, z) in enumerate(between):
            if body != GROUND:
                end = SpringEnd("spring", body, ends[k], z, spring=spring, other=ends[1 - k])
                result.append(_beside(end, result))
        return result

    def _torsion(self, spring: TorsionSpring) -> list[Load]:
        result: list[Load] = []
        for body, sign in zip(spring.links, (1.0, -1.0), strict=True):
            if body != GROUND:
                result.append(
                    _beside(TorsionEnd("torsion spring", body, None, sign=sign, spring=spring), result)
                )
        return result

    @cached_property
    def contacts(self) -> list[tuple[Joint, str, str, float, float]]:
        """What rubs: (joint, body, the body it rubs on, coefficient, radius)."""
        m, result = self.mechanism, []
        every = joints(m) if m.friction and self.moves else []
        for i, entry in enumerate(m.friction if self.moves else (), 1):
            here = [joint for joint in every if joint.name == entry.joint]
            if not here:
                raise DescriptionError(
                    f"[[friction]] {i} joint: '{entry.joint}' is no joint: nothing is pinned or guided there"
                )
            pins, guides = ([x for x in here if (x.guide is None) == pin] for pin in (True, False))
            # with a radius the pin rubs, without one the guide, where the point has both
            for joint in (pins or guides) if entry.radius else (guides or pins):
                if joint.guide is not None:
                    g = m.guides[joint.guide]
                    result.append((joint, g.link, g.on, entry.coefficient, entry.radius))
                else:
                    first, *others = joint.bodies
                    result += [(joint, body, first, entry.coefficient, entry.radius) for body in others]
        return result

    @cached_property
    def friction(self) -> list[FrictionLoad]:
        """The friction loads, two for each contact: what the one side feels and its reaction."""
        result: list[FrictionLoad] = []
        for number, (joint, body, other, _, _) in enumerate(self.contacts):
            for side, sign in ((body, 1.0), (other, -1.0)):
                if side == GROUND:
                    continue
                if joint.guide is None:
                    result.append(FrictionLoad("friction", side, None, 0j, joint.key, number, sign))
                else:
                    result.append(self._along(joint.guide, side, sign, joint.key, number, body == GROUND))
        return result

    def _along(self, i: int, side: str, sign: float, key: str, number: int, alone: bool) -> FrictionLoad:
        """The friction along a guide on the body that slides (sign +1), or on the rail, where the pin stands."""
        guide = self.mechanism.guides[i]
        if sign > 0:
            z = self.mechanism.bodies[side][guide.point]
            return FrictionLoad("friction", side, self.path(side, z), z, key, number, sign, i)
        through = self.mechanism.through(guide)
        base, terms = self.path(side, through)
        path = base, combined((*terms, Term(self.plan.directions[i], side, i)))
        return FrictionLoad("friction", side, path, through, key, number, sign, i, carries=alone, rail=i)

    @cached_property
    def everything(self) -> list[Load]:
        """Loads and friction."""
        return [*self.loads, *self.friction]

    @cached_property
    def _reads(self) -> set[str]:
        """What the loads depend on."""
        return set().union(*(load.reads() for load in self.everything))

    def targets(self, keys: Iterable[str] = ()) -> tuple[tuple[str, ...], int]:
        """What `keys` and the loads depend on, `angle:BODY`, `slide:GUIDE`, `point:NODE`, and to which derivative."""
        reads = set(keys).union(self._reads) - {f"angle:{GROUND}"}
        if not reads:
            # nothing acts: any one thing that moves will do
            reads = set(self.plan.writes(next(s for s in self.plan.steps if not isinstance(s, Place))))
        return tuple(sorted(reads)), max((load.order for load in self.loads), default=1)

    @cached_property
    def places(self) -> tuple[str, ...]:
        """What the places of all joints depend on."""
        keys = {f"slide:{i}" for i in range(len(self.mechanism.guides))}
        for body, r in self.mechanism.rigid.items():
            keys |= path_reads(self.path(body, r.center)) | {f"angle:{body}"}
        for group in self.plan.groups:
            keys |= self.plan.reads(group) | set(self.plan.writes(group))
        return tuple(sorted(keys))

    def acceleration(self, path: Path) -> Combination:
        """The acceleration of a point: Σ z·(s e^{iθ})″, from the point that carries its body.

        >>> from virtualwork import Input, Link, Mechanism
        >>> crank = Mechanism({"A": 0j}, {"crank": Link({"A": 0j})}, inputs=Input(link="crank"))
        >>> case = LoadCase(crank, crank.assembly.plan, moves=True)
        >>> [(of.kind, of.name, z) for of, z in case.acceleration(case.path("crank", 0.5j)).items()]
        [('turn', 'crank', 0.5j)]
        """
        base, terms = path
        result = Combination()
        step = None if base is None else self._places[base]
        if step is not None and step.base in self._fixed and len(step.terms) == 1:
            terms = combined(
                (*step.terms, *terms)
            )  # as many vectors as with the point, and the turning alone
            base = None
        if base is not None and base not in self._fixed:
            result.add(Combination({self.force_terms.second("node", base): 1.0}))
        for t in terms:
            if t.body != GROUND or t.slide is not None:
                result.add(Combination({self.force_terms.second("turn", t.body, t.slide): t.z}))
        return result

    @cached_property
    def _fixed(self) -> set[str | None]:
        """The points that do not move."""
        result: set[str | None] = {None}
        for node, step in self._places.items():
            if step.base in result and all(t.body == GROUND and t.slide is None for t in step.terms):
                result.add(node)
        return result

    @cached_property
    def carried(self) -> list[tuple[str, int, float]]:
        """Torques of motors that sit on another body than `on`, (body, input, sign): what moves their reaction there.

        The input's own torque acts between the driven link and `on`; with +T on `on` and −T on the carrier added, the
        motor acts between the driven link and its carrier (Ibrahim §2.3).
        """
        result = []
        for j in self.mechanism.carried:
            result += [(self.mechanism.carrier(j), j, -1.0), (self.mechanism.inputs[j].on, j, 1.0)]
        return [entry for entry in result if entry[0] != GROUND]


def _beside(load: Load, before: list[Load]) -> Load:
    """One side of a pair, after the other if that is there: the first carries the work of both."""
    return replace(load, carries=False, mate=before[0]) if before else load
