"""What acts on the links of a mechanism in motion: weights, inertia, applied forces and torques, springs, friction.

A load is a force at a point of a body or a torque on a body. Each knows its `kind`, and forms its value over a block
of poses when it is asked; a load that is zero for the whole scene (no mass, no speed, no stiffness) is not made.
Everything else, virtual work and joint reactions, reads this list.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING
from weakref import proxy

import numpy as np

from virtualwork.dyads import Number, dot
from virtualwork.mechanism import GROUND, Force, Mechanism, Spring, Torque, TorsionSpring
from virtualwork.steps import Place, Term, combined
from virtualwork.sums import Given, Row, Rows, Sum, Turned

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.bearing import Bearing
    from virtualwork.motion import Motion
    from virtualwork.state import Jets, State
    from virtualwork.steps import Plan

    Reals = NDArray[np.float64]

BLOCK = 8192  # up to so many poses there is nothing to keep in cache
Path = tuple[str | None, tuple[Term, ...]]  # a point of a body: P[base] + Σ terms


@dataclass(frozen=True)
class Rigid:
    """Mass, centre of mass and inertia of a link, with the motors it carries."""

    mass: float
    center: complex
    inertia: float


def rigid(m: Mechanism, body: str) -> Rigid:
    """Mass properties of a link with the motors it carries (000 §2.3: their mass and centre join the link).

    The common centre is Σ m z / Σ m, and the inertia about it gains Σ m |z − z_G|² (Steiner).

    >>> from virtualwork.mechanism import Link, Motor
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


class Block:
    """A block of poses as the loads see it: positions, velocity coefficients, velocities, accelerations.

    A derivative that is identically zero is None.
    """

    def __init__(
        self, scene: Scene, i: int, rows: slice, st: State, along: Jets | None, by: list[Jets]
    ) -> None:
        self.scene: Scene = proxy(scene)  # which holds its blocks
        self.rows, self.st, self.along, self.by = rows, st, along, by
        self.one = len(by) == 1
        self.rates = scene.rates(rows, st.many) if self.one else (None, None)
        self.friction: dict[int, Number] = {}
        self._kept: dict[int, Number] = {}
        self.rows_formed: dict[Row, tuple[float, Number]] = {}

    def row(self, row: Row) -> tuple[float, Number]:
        """A row's factor and array, formed once."""
        found = self.rows_formed.get(row)
        if found is None:
            found = self.rows_formed[row] = row.form(self)
        return found

    def second(self, derivative: Callable[[Jets, int], Number]) -> tuple[float, Number]:
        """ẍ = K q̈ + L q̇² of what has the derivatives K, L over the input: a factor and an array."""
        if not self.one:
            return 1.0, None if self.along is None else derivative(self.along, 2)
        speed, rate = self.rates
        normal = None if speed is None else derivative(self.by[0], 2)
        tangential = None if rate is None else derivative(self.by[0], 1)
        if tangential is None and isinstance(speed, float):
            return speed * speed, normal  # one number for all poses: the array stays as it is
        return 1.0, plus(times(normal, times(speed, speed)), times(tangential, rate))

    def forget(self, *, lasting: bool = False) -> None:
        """Drop the arrays, or all but those that others will ask for."""
        self._kept.clear()
        kept = {row: found for row, found in self.rows_formed.items() if lasting and row.lasting}
        self.rows_formed = kept

    def position(self, path: Path) -> Number:
        """P, complex."""
        base, terms = path
        return self.st.point[base] + self.st.sum(terms) if terms else self.st.point[base]

    def coefficient(self, path: Path, j: int) -> Number:
        """∂P/∂q_j, complex."""
        return self.by[j].vector(*path, 1)

    def turning(self, body: str, j: int) -> Number:
        """∂θ/∂q_j."""
        return None if body == GROUND else self.by[j].angle[body][0]

    def velocity(self, path: Path) -> Number:
        """Ṗ, complex."""
        if self.one:
            return times(self.by[0].vector(*path, 1), self.rates[0])
        return None if self.along is None else self.along.vector(*path, 1)

    def acceleration(self, path: Path, factor: float = 1.0) -> Number:
        """P̈ = K q̈ + L q̇², complex, times a factor."""
        if not self.one:
            return None if self.along is None else times(self.along.vector(*path, 2), factor)
        speed, rate = self.rates
        return plus(
            None if speed is None else times(self.by[0].vector(*path, 2), speed * speed * factor),
            None if rate is None else times(self.by[0].vector(*path, 1), rate * factor),
        )

    def omega(self, body: str) -> Number:
        """ω."""
        if body == GROUND:
            return None
        if self.one:
            return times(self.by[0].angle[body][0], self.rates[0])
        return None if self.along is None else self.along.angle[body][0]

    def alpha(self, body: str, factor: float = 1.0) -> Number:
        """α, times a factor."""
        if body == GROUND:
            return None
        if not self.one:
            return None if self.along is None else times(self.along.angle[body][1], factor)
        speed, rate = self.rates
        return plus(
            times(self.by[0].angle[body][1], None if speed is None else speed * speed * factor),
            times(self.by[0].angle[body][0], None if rate is None else rate * factor),
        )

    def slide_rate(self, guide: int) -> Number:
        """ṡ of a guide."""
        if self.one:
            return times(self.by[0].slide[guide][0], self.rates[0])
        return None if self.along is None else self.along.slide[guide][0]

    def keep(self, load: Load) -> Number:
        """A load's value, formed once; friction anew at each iterate."""
        if isinstance(load, Rub):
            return load.value(self)
        if id(load) not in self._kept:
            self._kept[id(load)] = load.value(self)
        return self._kept[id(load)]


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

    def __init__(self, mechanism: Mechanism, plan: Plan, moves: bool) -> None:
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
        from virtualwork.friction import loads

        return loads(self) if self.mechanism.friction and self.moves else []

    @cached_property
    def bearing(self) -> Bearing:
        """How the loads bear on what moves, and how joint forces follow."""
        from virtualwork.bearing import Bearing

        return Bearing(self)

    @cached_property
    def everything(self) -> list[Load]:
        """Loads and friction."""
        return [*self.loads, *self.rubs]

    def acceleration(self, path: Path) -> Sum:
        """The acceleration of a point: Σ z·(s e^{iθ})″, from the point its body hangs on.

        >>> from virtualwork.mechanism import Input, Link
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


class Scene:
    """The loads of a mechanism over a motion."""

    def __init__(self, motion: Motion, *, at_rest: bool = False) -> None:
        self.motion = motion
        self.mechanism: Mechanism = motion.mechanism
        self.plan: Plan = motion.assembly.plan
        self.at_rest = at_rest
        self.formed: set[str] = set()
        self._blocks: dict[tuple[str, ...], list[Block]] = {}
        self._followed: dict[TorsionSpring, tuple[Reals, Reals]] = {}

    @cached_property
    def acting(self) -> Acting:
        """What acts, the same for all motions of an assembly."""
        known = self.motion.assembly.acting
        if self.moves not in known:
            known[self.moves] = Acting(self.mechanism, self.plan, self.moves)
        return known[self.moves]

    @property
    def bearing(self) -> Bearing:
        """How the loads bear on what moves, and how joint forces follow."""
        return self.acting.bearing

    @cached_property
    def drive(self) -> Reals:
        """The effort at each input by virtual work, (n, k), as motors that other links carry need it."""
        from virtualwork.work import effort

        return effort(self)

    @property
    def loads(self) -> list[Load]:
        """Every load that is not zero throughout, friction apart."""
        return self.acting.loads

    @property
    def rubs(self) -> list[Rub]:
        """The friction loads."""
        return self.acting.rubs

    @property
    def rigid(self) -> dict[str, Rigid]:
        """Mass properties of every link."""
        return self.acting.rigid

    def path(self, body: str, z: complex) -> Path:
        """Where a point of a body lies."""
        return self.acting.path(body, z)

    @cached_property
    def moves(self) -> bool:
        """Whether anything moves at all: a speed or an acceleration that is not zero."""
        return not self.at_rest and any(np.any(rate) for rates in self.motion._rates[:2] for rate in rates)

    def rates(self, rows: slice, many: bool) -> tuple[Number, Number]:
        """q̇ and q̈ of the one input over a block, None where zero."""
        found: list[Number] = []
        for rate in (self.motion._rates[0][0], self.motion._rates[1][0]):
            if self.at_rest or (isinstance(rate, float) and rate == 0.0):
                found.append(None)
            else:
                found.append(rate if isinstance(rate, float) else rate[rows] if many else float(rate[0]))
        return found[0], found[1]

    def wound(self, block: Block, spring: TorsionSpring) -> Number:
        """θ_second − θ_first − free angle: within half a turn at the guess, and from there on followed continuously.

        Where the inputs alone fix both angles they are taken as they are, whole turns included. With several inputs
        the angle lies within half a turn of free.
        """
        st, (a, b) = block.st, spring.links
        known = [self.plan.angles[body] for body in (a, b)]
        if all(not angle.bases and angle.phase is None for angle in known):
            return (st.affine(known[1]) - spring.free_angle) - st.affine(known[0])
        relative = st.turn[b] * np.conj(st.turn[a]) * complex(np.exp(-1j * spring.free_angle))
        within = np.angle(relative)
        if len(st.inputs) == 1:
            q, unwrapped = self._unwound(spring)
            rough = np.interp(np.asarray(st.inputs[0], dtype=float), q, unwrapped)
            within = within + 2 * np.pi * np.round((rough - within) / (2 * np.pi))
        return within if block.st.many else float(within)

    def _unwound(self, spring: TorsionSpring) -> tuple[Reals, Reals]:
        """The relative angle of a torsion spring followed from the guess, roughly: only its whole turns are used."""
        if spring not in self._followed:
            inputs, at = self.motion.inputs[:, 0], self.mechanism.at[0]
            low, high = min(float(np.nanmin(inputs)), at), max(float(np.nanmax(inputs)), at)
            slide = self.mechanism.inputs[0].is_slide
            step = self.mechanism.size / 720 if slide else 2 * np.pi / 720
            q = np.linspace(low, high, min(20000, 2 + int((high - low) / step)))
            along = type(self.motion)(self.motion.assembly, q)
            a, b = (along.angle(body) if body != GROUND else np.zeros(len(q)) for body in spring.links)
            relative = np.angle(np.exp(1j * (b - a - spring.free_angle)))
            there = np.isfinite(relative)
            path = np.unwrap(relative[there])
            if len(path):
                start = int(np.argmin(np.abs(q[there] - at)))
                path = path + (relative[there][start] - path[start])
                q = q[there]
            self._followed[spring] = (q, path) if len(path) else (q, np.zeros(len(q)))
        return self._followed[spring]

    # --- solving ----------------------------------------------------------------------------------------------
    def reads(self, loads: Iterable[Load]) -> set[str]:
        """What the loads' points and bodies hang on."""
        keys: set[str] = set()
        for load in loads:
            keys.add(f"angle:{load.body}")
            for path in (load.path, load.other if isinstance(load, SpringEnd) else None):
                if path is not None:
                    keys |= path_reads(path)
            if isinstance(load, TorsionEnd) and load.spring is not None:
                keys |= {f"angle:{body}" for body in load.spring.links}
        return {key for key in keys if key != f"angle:{GROUND}"}

    def _targets(self, keys: Iterable[str]) -> tuple[tuple[str, ...], int]:
        targets = tuple(sorted(self.reads([*self.loads, *self.rubs]) | set(keys)))
        if not targets:  # nothing acts: any one thing that moves will do
            targets = self.plan.writes(next(step for step in self.plan.steps if not isinstance(step, Place)))
        inertial = self.moves and any(isinstance(load, InertiaForce | InertiaTorque) for load in self.loads)
        return targets, 2 if inertial else 1

    def blocks(self, keys: Iterable[str] = ()) -> list[Block]:
        """The blocks of poses, with everything solved that the loads and `keys` hang on."""
        motion = self.motion
        targets, order = self._targets(keys)
        if targets in self._blocks:
            return self._blocks[targets]
        k = len(self.mechanism.inputs)
        along = None
        if k == 1:
            by = [motion._solve(targets, order)]
        else:
            by = [motion._solve(targets, 1, j) for j in range(k)]
            along = motion._solve(targets, order) if self.moves else None
        return self._kept_blocks(targets, by, along)

    def _kept_blocks(
        self, targets: tuple[str, ...], by: list[list[Jets]], along: list[Jets] | None
    ) -> list[Block]:
        found = [
            Block(self, i, rows, st, None if along is None else along[i], [jets[i] for jets in by])
            for i, (rows, st) in enumerate(self.motion._rows())
        ]
        for old in self._blocks.values():
            for block, before in zip(found, old, strict=True):
                block._kept, block.rows_formed = before._kept, before.rows_formed
                block.friction = before.friction
        self._blocks = {targets: found}
        return found

    def each(self, keys: Iterable[str], form: Callable[[Block], None]) -> None:
        """Form something over every block; of a single input while the block is still in cache from its solution."""
        targets, order = self._targets(keys)
        if len(self.mechanism.inputs) > 1 or targets in self._blocks or self.motion.n <= BLOCK:
            for block in self.blocks(keys):
                form(block)
            return

        def then(i: int) -> None:
            if targets not in self._blocks:
                self._kept_blocks(targets, [self.motion._jets[-1]], None)
            form(self._blocks[targets][i])

        self.motion._solve(targets, order, then=then)

    @cached_property
    def lost(self) -> NDArray[np.bool_] | None:
        """(n,): the poses that are not assembled; None where all are."""
        there = self.motion.assembled
        return None if there.all() else ~there


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
