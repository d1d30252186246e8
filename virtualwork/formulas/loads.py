"""What acts on the links of a mechanism in motion: weights, inertia, applied forces and torques, springs, friction.

A load is a force at a point of a body or a torque on a body. Each knows its `kind`, and forms its value over a block
of poses when it is asked; a load that is zero for the whole scene (no mass, no speed, no stiffness) is not made.
Everything else, virtual work and joint reactions, reads this list.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from virtualwork.describe.description import Description
from virtualwork.describe.loads import Force, Spring, Torque, TorsionSpring
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.closed_forms import Number, dot
from virtualwork.formulas.quantities import Given, Rows, Sum, Turned
from virtualwork.plan.steps import Place, Term, combined

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.formulas.load_paths import Bearing
    from virtualwork.formulas.scene import Block
    from virtualwork.plan.steps import Plan

    Reals = NDArray[np.float64]

Path = tuple[str | None, tuple[Term, ...]]  # a point of a body: P[base] + Σ terms


@dataclass(frozen=True)
class Rigid:
    """Mass, centre of mass and inertia of a link, with the motors it carries."""

    mass: float
    center: complex
    inertia: float


def rigid(m: Description, body: str) -> Rigid:
    """Mass properties of a link with the motors it carries (000 §2.3: their mass and centre join the link).

    The common centre is Σ m z / Σ m, and the inertia about it gains Σ m |z − z_G|² (Steiner).

    >>> from virtualwork import Link, Motor
    >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 1}, mass=2, center=0.25, inertia=0.1)},
    ...                 motors=[Motor("arm", "tool", mass=1, center=1)])
    >>> rigid(arm, "arm")
    Rigid(mass=3.0, center=(0.5+0j), inertia=0.475)
    """
    link = m.links[body]
    parts = [(link.mass, link.center, link.inertia)]
    parts += [(motor.mass, motor.center, 0.0) for motor in m.motors if motor.carrier == body and motor.mass]
    if len(parts) == 1:
        return Rigid(*parts[0])
    mass = sum(part[0] for part in parts)
    center = sum((part[0] * part[1] for part in parts), 0j) / mass if mass else link.center
    return Rigid(mass, center, sum(i + w * abs(z - center) ** 2 for w, z, i in parts))


@dataclass(frozen=True, eq=False)
class Load:
    """A force (complex) at a point of a body, or a torque (real) on it where `path` is None.

    `place` is the point in the body's axes. Loads between two bodies come as two, action and reaction.
    """

    kind: str
    body: str
    path: Path | None
    place: complex = 0j

    def value(self, block: Block) -> Number:
        """Its value over a block: complex N, or N·m; None where it is zero."""
        raise NotImplementedError

    def sum(self, acting: Acting) -> Sum:
        """Its value as constants times rows."""
        return Sum({acting.rows(Given, self): 1.0})

    @property
    def name(self) -> str:
        """How the ledger calls it."""
        return f"{self.body}: {self.kind}"

    def arm(self, block: Block, center: complex) -> Number:
        """Where a force acts, from a point of its body, in ground axes; None at the point itself."""
        return None if self.place == center else (self.place - center) * block.st.turn[self.body]


@dataclass(frozen=True, eq=False)
class Constant(Load):
    """A weight, a force of fixed components in ground axes, or a torque."""

    amount: Number = 0.0

    def value(self, block: Block) -> Number:
        return self.amount

    def sum(self, acting: Acting) -> Sum:
        return Sum({None: self.amount})


@dataclass(frozen=True, eq=False)
class Follower(Load):
    """A force of fixed components in link axes."""

    amount: complex = 0j

    def value(self, block: Block) -> Number:
        return self.amount * block.st.turn[self.body]

    def sum(self, acting: Acting) -> Sum:
        return Sum({acting.rows(Turned, self.body, None): self.amount})


@dataclass(frozen=True, eq=False)
class Tabled(Load):
    """A force given over the input by a table, linear between its rows; periodic where the table is one."""

    table: tuple[tuple[float, complex], ...] = ()
    turns: bool = False
    link_axes: bool = False

    def _in_cycle(self, block: Block) -> tuple[Reals, NDArray[np.complex128], Reals]:
        at = np.array([row[0] for row in self.table])
        force = np.array([row[1] for row in self.table])
        q = np.asarray(block.st.inputs[0], dtype=float)
        if self.turns:  # the table is one cycle of a whole number of turns
            q = at[0] + np.mod(q - at[0], at[-1] - at[0])
        return at, force, q

    def value(self, block: Block) -> Number:
        at, force, q = self._in_cycle(block)
        outside = (q < at[0]) | (q > at[-1])
        values = np.where(outside, np.nan, np.interp(q, at, force.real) + 1j * np.interp(q, at, force.imag))
        found = values if block.st.many else complex(values)
        return found * block.st.turn[self.body] if self.link_axes else found

    def slope(self, block: Block) -> Number:
        """Its derivative over the input, in ground axes."""
        at, force, q = self._in_cycle(block)
        place = np.clip(np.searchsorted(at, q, side="right") - 1, 0, len(at) - 2)
        values = np.diff(force)[place] / np.diff(at)[place]
        if not self.link_axes:
            return values if block.st.many else complex(values)
        turning = block.by[0].angle[self.body][0]
        turned = values * block.st.turn[self.body]
        return turned if turning is None else turned + 1j * turning * self.value(block)


@dataclass(frozen=True, eq=False)
class InertiaForce(Load):
    """−m·a_G (d'Alembert; 000 eq. 2.2.1; Riul eq. 5)."""

    mass: float = 0.0

    def value(self, block: Block) -> Number:
        assert self.path is not None
        return block.acceleration(self.path, -self.mass)

    def sum(self, acting: Acting) -> Sum:
        assert self.path is not None
        return acting.acceleration(self.path).times(-self.mass)


@dataclass(frozen=True, eq=False)
class InertiaTorque(Load):
    """−I_G·α (000 §2.3; Riul eq. 5)."""

    inertia: float = 0.0

    def value(self, block: Block) -> Number:
        return block.alpha(self.body, -self.inertia)

    def sum(self, acting: Acting) -> Sum:
        return Sum({acting.rows.second("angle", self.body): -self.inertia})


@dataclass(frozen=True, eq=False)
class SpringEnd(Load):
    """What a spring and damper pulls at one end: toward the other with k(l − l₀) + c·l̇."""

    spring: Spring | None = None
    other: Path = (None, ())
    first: bool = True
    mate: Load | None = None  # the other end, where it is on a link too

    def sum(self, acting: Acting) -> Sum:
        return super().sum(acting) if self.mate is None else self.mate.sum(acting).times(-1.0)

    def value(self, block: Block) -> Number:
        assert self.path is not None
        assert self.spring is not None
        d = block.position(self.other) - block.position(self.path)
        s = self.spring
        pull: Number = None
        length2 = d.real * d.real + d.imag * d.imag
        if s.stiffness:
            # with no free length the pull is k·d: no direction is needed, and none is asked for at zero length
            pull = (
                s.stiffness * (1 - s.free_length / np.sqrt(length2)) * d if s.free_length else s.stiffness * d
            )
        if s.damping:
            rate = plus(block.velocity(self.other), times(block.velocity(self.path), -1.0))
            if rate is not None:
                pull = plus(pull, (s.damping * dot(d, rate) / length2) * d)
        return pull


@dataclass(frozen=True, eq=False)
class TorsionEnd(Load):
    """What a torsion spring and damper turns one link with: k·φ + c·φ̇ against the relative angle φ from free."""

    spring: TorsionSpring | None = None
    sign: float = 1.0
    mate: Load | None = None

    def sum(self, acting: Acting) -> Sum:
        return super().sum(acting) if self.mate is None else self.mate.sum(acting).times(-1.0)

    def value(self, block: Block) -> Number:
        assert self.spring is not None
        s = self.spring
        turn: Number = None
        if s.stiffness:
            turn = s.stiffness * block.scene.wound(block, s)
        if s.damping:
            rate = plus(block.omega(s.links[1]), times(block.omega(s.links[0]), -1.0))
            turn = plus(turn, times(rate, s.damping))
        return times(turn, self.sign)


@dataclass(frozen=True, eq=False)
class Rub(Load):
    """Coulomb friction of a joint on one of its two sides, from the last iterate of its reaction."""

    joint: str = ""
    number: int = 0
    sign: float = 1.0
    guide: int | None = None

    def value(self, block: Block) -> Number:
        return times(block.friction.get(self.number), self.sign)

    def arm(self, block: Block, center: complex) -> Number:
        if self.guide is None or self.sign > 0:
            return super().arm(block, center)
        along = block.scene.plan.directions[self.guide] * block.st.slide[self.guide]
        return (self.place - center + along) * block.st.turn[self.body]


class Acting:
    """What acts on a mechanism, at rest or moving; a load that is zero throughout is not in the list.

    It hangs on no motion: an assembly makes it once for rest and once for all motions.
    """

    def __init__(self, mechanism: Description, plan: Plan, moves: bool) -> None:
        self.mechanism, self.plan, self.moves = mechanism, plan, moves
        self.rows = Rows()
        self._paths: dict[tuple[str, complex], Path] = {}
        self._places = {step.node: step for step in plan.steps if isinstance(step, Place)}

    def path(self, body: str, z: complex) -> Path:
        """Where a point of a body lies: P[base] + Σ terms, as the order of solution places it."""
        if (body, z) not in self._paths:
            base, terms = self.plan.anchors[body]
            self._paths[body, z] = base, combined((*terms, Term(z, body)))
        return self._paths[body, z]

    @cached_property
    def rigid(self) -> dict[str, Rigid]:
        """Mass properties of every link."""
        return {body: rigid(self.mechanism, body) for body in self.mechanism.links}

    @cached_property
    def loads(self) -> list[Load]:
        """Every load that is not zero throughout, friction apart."""
        m = self.mechanism
        found: list[Load] = []
        for body, r in self.rigid.items():
            g = self.path(body, r.center)
            if r.mass and m.gravity:
                found.append(Constant("weight", body, g, r.center, r.mass * m.gravity))
            if r.mass and self.moves:
                found.append(InertiaForce("inertia force", body, g, r.center, r.mass))
            if r.inertia and self.moves:
                found.append(InertiaTorque("inertia torque", body, None, r.center, r.inertia))
        found += [load for force in m.forces for load in self._force(force)]
        found += [self._torque(torque) for torque in m.torques if torque.torque]
        for spring in m.springs:
            if spring.stiffness or (spring.damping and self.moves):
                found += self._spring(spring)
        for torsion in m.torsion_springs:
            if torsion.stiffness or (torsion.damping and self.moves):
                found += self._torsion(torsion)
        return found

    def _force(self, force: Force) -> list[Load]:
        path = self.path(force.link, force.point)
        table = getattr(force, "history", None)
        if table:
            turns = bool(getattr(force, "periodic", False))
            return [
                Tabled("applied force", force.link, path, force.point, table, turns, force.frame == "link")
            ]
        if not force.force:
            return []
        kind = Follower if force.frame == "link" else Constant
        return [kind("applied force", force.link, path, force.point, force.force)]

    def _torque(self, torque: Torque) -> Load:
        return Constant("applied torque", torque.link, None, 0j, torque.torque)

    def _spring(self, spring: Spring) -> list[Load]:
        ends = [self.path(*end) for end in spring.between]
        found: list[Load] = []
        for k, (body, z) in enumerate(spring.between):
            if body != GROUND:
                mate = found[0] if found else None
                found.append(SpringEnd("spring", body, ends[k], z, spring, ends[1 - k], k == 0, mate))
        return found

    def _torsion(self, torsion: TorsionSpring) -> list[Load]:
        found: list[Load] = []
        for body, sign in zip(torsion.links, (1.0, -1.0), strict=True):
            if body != GROUND:
                mate = found[0] if found else None
                found.append(TorsionEnd("torsion spring", body, None, 0j, torsion, sign, mate))
        return found

    @cached_property
    def rubs(self) -> list[Rub]:
        """The friction loads, two for each pair that rubs: what the one side feels and its reaction."""
        from virtualwork.formulas.friction import loads

        return loads(self) if self.mechanism.friction and self.moves else []

    @cached_property
    def bearing(self) -> Bearing:
        """How the loads bear on what moves, and how joint forces follow."""
        from virtualwork.formulas.load_paths import Bearing

        return Bearing(self)

    @cached_property
    def everything(self) -> list[Load]:
        """Loads and friction."""
        return [*self.loads, *self.rubs]

    def acceleration(self, path: Path) -> Sum:
        """The acceleration of a point: Σ z·(s e^{iθ})″, from the point its body hangs on.

        >>> from virtualwork import Input, Link
        >>> crank = Mechanism({"A": 0j}, {"crank": Link({"A": 0j})}, inputs=Input(link="crank"))
        >>> acting = Acting(crank, crank.assembly.plan, moves=True)
        >>> [(row.kind, row.name, z) for row, z in acting.acceleration(acting.path("crank", 0.5j)).items()]
        [('turn', 'crank', 0.5j)]
        """
        base, terms = path
        found = Sum()
        step = None if base is None else self._places[base]
        if step is not None and step.base in self._fixed and len(step.terms) == 1:
            terms = combined(
                (*step.terms, *terms)
            )  # as many vectors as with the point, and the turning alone
            base = None
        if base is not None and base not in self._fixed:
            found.add(Sum({self.rows.second("node", base): 1.0}))
        for t in terms:
            if t.body != GROUND or t.slide is not None:
                found.add(Sum({self.rows.second("turn", t.body, t.slide): t.z}))
        return found

    @cached_property
    def _fixed(self) -> set[str | None]:
        """The points that do not move."""
        found: set[str | None] = {None}
        for node, step in self._places.items():
            if step.base in found and all(t.body == GROUND and t.slide is None for t in step.terms):
                found.add(node)
        return found


def path_reads(path: Path) -> set[str]:
    """What a point hangs on."""
    base, terms = path
    keys = {f"angle:{t.body}" for t in terms if t.body != GROUND}
    keys |= {f"slide:{t.slide}" for t in terms if t.slide is not None}
    if base is not None:
        keys.add(f"point:{base}")
    return keys


def plus(a: Number, b: Number) -> Number:
    """a + b, where None is zero."""
    return b if a is None else a if b is None else a + b


def times(a: Number, b: Number) -> Number:
    """a·b, where None is zero."""
    return None if a is None or b is None else a * b
