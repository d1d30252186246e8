"""What bears on what: from the loads on the links to the loops, the joints and the inputs, as sums of rows.

The order of solution places every body by one joint of a tree and closes loops at the others. A force at
P = P[base] + Σ z·s·e^{iθ} bears on the base as it is, on each angle with its lever, (z s e^{iθ}) × F, on each slide
along it. What bears on an angle θ or a slide of the tree, its generalized force Q, is so a sum whose coefficients hang
on the mechanism alone. The links' inertia appears in it as in the equations of an open chain of links: a link's
inertia about the point it hangs on, times α, and its mass times that point's acceleration.

- Virtual work needs nothing else: with κ = dθ/dq the effort is −Σ Q κ, Q of the loads alone.
- The forces λ at the loop joints are the multipliers of the loops: for each unknown x of a group

      Q_x + Σ_c λ_c·∂C_c/∂x = 0,

  the group's own small Jacobian transposed, already formed for the velocities. Q_x gathers the loads and loop forces
  of all that hangs on the group, which is why groups are taken in reverse.
- The other joints follow from ΣF = 0 of one body or one pin after the other (000 §2.2, d'Alembert), torques from
  ΣM = 0 (000 §2.3).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.closed_forms import Number
from virtualwork.formulas.effort import carrier
from virtualwork.formulas.loads import Acting, Rub
from virtualwork.formulas.quantities import Passed, Row, Sum, in_order
from virtualwork.joints import Order, Side
from virtualwork.newton import stack
from virtualwork.plan.steps import Group, Place, Term, Turn

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork.formulas.scene import Block, Scene

    Reals = NDArray[np.float64]
    Hung = tuple[
        Term | None, float, tuple[str, Any]
    ]  # lever (None: the point itself), sign, source of the force

LONG = 4  # a sum on its way down a chain of links is formed where it has more rows than this, and is one row from there
DEEP = 20  # groups; forming a row of one calls for that of the next, some ten calls deep for each
PARALLEL = (
    1e-11  # sine of the angle between two columns below which the joint forces have no digit left that counts
)


class Bearing:
    """The loads of a mechanism on its tree, its loops and its joints; made once for an assembly."""

    def __init__(self, acting: Acting) -> None:
        self.acting, self.rows = acting, acting.rows
        self.mechanism, self.plan = acting.mechanism, acting.plan
        self.order = Order(self.mechanism, self.plan)
        self._deep = len(self.plan.groups) > DEEP
        self._known: dict[Any, Sum] = {}
        self._on_group: dict[str, list[Sum]] = {}
        self._first: dict[Row, list[Row]] = {}
        self._sides: dict[Side, Sum] = {}
        self._hung: dict[str, list[Hung]] = {}
        self._tied: dict[str, list[tuple[str, float]]] = {}
        self._hang()
        for step in reversed(
            self.plan.steps
        ):  # from the last link inward, or long chains would nest the calls
            if isinstance(step, Place):
                self.node(step.node)
                self.node(step.node, free=True)

    def value(self, block: Block, terms: Sum) -> Number:
        """The array of a sum over a block; what a long chain of links passes on is formed from its far end."""
        if self._deep:
            for row in terms:
                if row is not None and row not in self._first:
                    self._first[row] = [part for part in in_order(row) if part.lasting]
                for part in self._first[row] if row is not None else ():
                    block.row(part)
        return terms.value(block)

    # --- the tree ---------------------------------------------------------------------------------------------
    def _hang(self) -> None:
        """Note for each node, angle and slide what bears on it."""

        def bear(
            base: str | None,
            terms: Iterable[Term],
            source: tuple[str, Any],
            along: Iterable[Term] | None = None,
        ) -> None:
            if base is not None:
                self._hung.setdefault(f"point:{base}", []).append((None, 1.0, source))
            for t in terms:
                if t.body != GROUND:
                    self._hung.setdefault(f"angle:{t.body}", []).append((t, 1.0, source))
            for t in terms if along is None else along:
                if t.slide is not None:
                    self._hung.setdefault(f"slide:{t.slide}", []).append((t, 1.0, source))

        for load in self.acting.everything:
            if load.path is not None and load.body != GROUND:
                # what rubs on a rail acts where the pin stands, but on the rail, which does not slide with the pin
                rail = isinstance(load, Rub) and load.guide is not None and load.sign < 0
                along = self.acting.path(load.body, load.place)[1] if rail else None
                bear(*load.path, ("load", load), along)
        for step in self.plan.steps:
            ties = step.ties if isinstance(step, Group) else (step,) if isinstance(step, Turn) else ()
            for tie in ties:
                for base, r in tie.angle.bases:
                    self._tied.setdefault(f"angle:{base}", []).append((tie.body, r))
            if isinstance(step, Place):
                bear(step.base, step.terms, ("point", step.node))
            elif isinstance(step, Group):
                for c, closure in enumerate(step.closures):
                    source = ("loop", (step, c))
                    bear(closure.start, closure.terms, source)
                    if closure.end is not None:
                        self._hung.setdefault(f"point:{closure.end}", []).append((None, -1.0, source))

    def _source(self, source: tuple[str, Any], free: bool) -> Sum:
        kind, of = source
        if kind == "load":
            return of.sum(self.acting)  # type: ignore[no-any-return]
        if kind == "point":
            return self.node(of, free=free)
        return Sum() if free else Sum({self.multiplier(*of): 1.0})

    def node(self, node: str, *, free: bool = False) -> Sum:
        """The force that bears on a point; `free`: of the loads alone, as if every loop were open."""
        key = node, free
        if key not in self._known:
            total = Sum()
            for _, sign, source in self._hung.get(f"point:{node}", ()):
                total.add(self._source(source, free), sign)
            self._known[key] = Sum({self.rows(Passed, total): 1.0}) if len(total) > LONG else total
        return self._known[key]

    def own(self, key: str, without: Group | None = None, *, free: bool = False) -> Sum:
        """Q of an angle or a slide, N·m or N: `without` the loops of one group, or `free` of all.

        What bears on angles tied to this one is not in it.
        """
        known = key, without and without.name, free
        if known not in self._known:
            levers: dict[tuple[str, int | None], Sum] = {}
            along = key.startswith("slide:")
            for t, _, source in self._hung.get(key, ()):
                if t is None or (source[0] == "loop" and source[1][0] is without):
                    continue
                force = levers.setdefault((t.body, None if along else t.slide), Sum())
                force.add(self._source(source, free), t.z.conjugate())
            total = Sum() if along else self.torque(key.removeprefix("angle:"), free=free)
            for (body, slide), force in levers.items():
                total.add(self.rows.lever(body, slide, force, along))
            self._known[known] = self.rows.total(total)
        return self._known[known]

    def bearing(self, key: str, without: Group) -> Sum:
        """Q of an angle or a slide, of all that is tied to it too, `without` the loops of one group."""
        total = Sum(self.own(key, without))
        for body, r in self._tied.get(key, ()):
            total.add(self.bearing(f"angle:{body}", without), r)
        return total

    def on_group(self, group: Group) -> list[Sum]:
        """Q of each unknown of a group, angles and then slides, without its own loops."""
        if group.name not in self._on_group:
            keys = [*(f"angle:{a}" for a in group.angles), *(f"slide:{s}" for s in group.slides)]
            self._on_group[group.name] = [self.bearing(key, group) for key in keys]
        return self._on_group[group.name]

    @cached_property
    def working(self) -> list[tuple[str | None, int, Sum]]:
        """Q of the loads alone for each body's angle and each slide on which any bears: (body, or None, guide, Q)."""
        bodies = [(body, -1, self.own(f"angle:{body}", free=True)) for body in self.mechanism.links]
        slides = [(None, g, self.own(f"slide:{g}", free=True)) for g in range(len(self.mechanism.guides))]
        return [entry for entry in (*bodies, *slides) if entry[2]]

    # --- one body -----------------------------------------------------------------------------------------------
    def force(self, body: str) -> Sum:
        """The sum of the forces on a body."""
        total = Sum()
        for load in self.acting.everything:
            if load.body == body and load.path is not None:
                total.add(load.sum(self.acting))
        return total

    def torque(self, body: str, *, free: bool = False) -> Sum:
        """The sum of the torques on a body, without what its forces' levers make; `free` of the motors it carries."""
        total = Sum()
        for load in self.acting.everything:
            if load.body == body and load.path is None:
                total.add(load.sum(self.acting))
        for carrying, j, sign in () if free else carried(self.acting):
            if carrying == body:
                total.add(Sum({self.rows(Carried, j): sign}))
        return total

    def moment(
        self, body: str, about: complex, sides: Iterable[tuple[complex, int | None, complex, Sum]] = ()
    ) -> Sum:
        """The moment on a body about a point of its own, of its loads and of further forces at its points.

        `sides`: (place z, guide or None, direction d, force): at z, or at z + d·s of a guide.
        """
        levers: dict[int | None, Sum] = {}

        def at(place: complex, slide: int | None, direction: complex, force: Sum) -> None:
            levers.setdefault(None, Sum()).add(force, (place - about).conjugate())
            if slide is not None:
                levers.setdefault(slide, Sum()).add(force, direction.conjugate())

        for load in self.acting.everything:
            if load.body == body and load.path is not None:
                slide = load.guide if isinstance(load, Rub) and load.sign < 0 else None
                direction = 0j if slide is None else self.plan.directions[slide]
                at(load.place, slide, direction, load.sum(self.acting))
        for entry in sides:
            at(*entry)
        total = self.torque(body)
        for slide, force in levers.items():
            total.add(self.rows.lever(body, slide, force))
        return total

    # --- joints -------------------------------------------------------------------------------------------------
    def multiplier(self, group: Group, loop: int) -> Row:
        """λ of a loop, as a row."""
        key = "loop", group.name, loop
        if key not in self._known:
            solved = self.rows(Solved, self, group)
            self._known[key] = Sum({self.rows(Multiplier, solved, loop): 1.0})
        return next(iter(self._known[key]))  # type: ignore[return-value]

    def side(self, side: Side) -> Sum:
        """The force of a joint on a body: the reaction of one that is known, or a row of its own."""
        if side not in self._sides:
            self._sides[side] = self._side(side)
        return self._sides[side]

    def _side(self, side: Side) -> Sum:
        joint, body = side
        if body == GROUND:
            total = Sum()
            for other in self.order.by_key[joint].bodies:
                if other != GROUND:
                    total.add(self.side((joint, other)), -1.0)
            return total
        kind, of = self.order.recipes[side]
        if kind == "loop":
            return Sum({self.multiplier(*of): 1.0})
        bodies = self.order.by_key[joint].bodies
        if kind == "joint" and len(bodies) == 2:
            return self.side((joint, bodies[0] if bodies[1] == body else bodies[1])).times(-1.0)
        return Sum({self.rows(SideForce, self, side): 1.0})

    def balance(self, side: Side) -> Sum:
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
            total = Sum()
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
        through = guide.through
        z = points[through] if isinstance(through, str) else through
        return complex(z), g, self.plan.directions[g]

    def rest(self, body: str) -> Sum:
        """ΣM of a body's loads and joint forces: what torques must balance.

        About the joint whose force was found last, from ΣF = 0, so that this force has no lever.
        """
        key = "rest", body
        if key not in self._known:
            about = self.acting.rigid[body].center
            sides = self.order.sides[body]
            for side in sides:
                z, guide, _ = self.place(side)
                if self.order.recipes[side] == ("body", body) and guide is None:
                    about, sides = z, [s for s in sides if s != side]
                    break
            acts = [(*self.place(side), self.side(side)) for side in sides]
            self._known[key] = self.rows.total(self.moment(body, about, acts))
        return self._known[key]

    def couple(self, kind: str, i: int) -> Sum:
        """The torque of a guide, a gear or an input, from the bodies' ΣM = 0."""
        key = "couple", kind, i
        if key not in self._known:
            total = Sum()
            for body, factor in self.order.couple(kind, i).items():
                total.add(self.rest(body), -factor)
            self._known[key] = total
        return self._known[key]


@dataclass(frozen=True, eq=False)
class Solved(Row):
    """The forces λ at the loop joints of a group: its Jacobian, transposed, solved for what bears on its unknowns."""

    bearing: Bearing
    group: Group
    lasting = True

    def reads(self) -> Iterable[Row | None]:
        return [row for load in self.bearing.on_group(self.group) for row in load]

    def form(self, block: Block) -> tuple[float, Number]:
        group = self.group
        block.scene.formed.add(group.name)
        loads = [load.value(block) for load in self.bearing.on_group(self.group)]
        if all(load is None for load in loads):
            return 1.0, [None] * len(group.closures)
        cols = block.by[0].columns(group)
        if group.kind == "Newton":
            return 1.0, _transposed(cols, loads, block)
        (c1, c2), (q1, q2) = cols[0], loads
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            inverse = _regular(block.by[0].inverse(group), c1, c2)
            # λ = i (c2 q1 − c1 q2)/(c1 × c2)
            if q1 is None:
                total = c1 * (q2 * -inverse)
            else:
                total = c2 * (q1 * inverse)
                total = total if q2 is None else total - c1 * (q2 * inverse)
        return 1.0, [1j * total]


@dataclass(frozen=True, eq=False)
class Multiplier(Row):
    """The force λ at one loop joint of a group."""

    solved: Row
    loop: int

    def form(self, block: Block) -> tuple[float, Number]:
        return 1.0, block.row(self.solved)[1][self.loop]

    def reads(self) -> Iterable[Row | None]:
        return (self.solved,)


@dataclass(frozen=True, eq=False)
class SideForce(Row):
    """The force of a joint on a body from ΣF = 0."""

    bearing: Bearing
    side: Side
    lasting = True

    def form(self, block: Block) -> tuple[float, Number]:
        joint, body = self.side
        block.scene.formed.add(f"{joint} on {body}")
        return 1.0, self.bearing.balance(self.side).value(block)

    def reads(self) -> Iterable[Row | None]:
        return self.bearing.balance(self.side)


@dataclass(frozen=True, eq=False)
class Carried(Row):
    """The torque of input j's motor, where it sits on another body than `on`."""

    input: int

    def form(self, block: Block) -> tuple[float, Number]:
        torque = block.scene.drive[:, self.input]
        return 1.0, torque[block.rows] if block.st.many else float(torque[0])


def carried(scene: Scene | Acting) -> list[tuple[str, int, float]]:
    """Torques of motors that sit on another body than `on`, (body, input, sign): what moves their reaction there.

    The input's own torque acts between the driven link and `on`; with +T on `on` and −T on the carrier added, the
    motor acts between the driven link and its carrier (000 §2.3).
    """
    found = []
    for j, entry in enumerate(scene.mechanism.inputs):
        body = entry.on if entry.is_slide else carrier(scene, j)
        if body != entry.on:
            found += [(body, j, -1.0), (entry.on, j, 1.0)]
    return [entry for entry in found if entry[0] != GROUND]


def _regular(inverse: Number, c1: Number, c2: Number) -> Number:
    """1/(c1 × c2); NaN where two columns are parallel to rounding, for the joint forces have no value there."""
    # the norms over the block are above the largest entry: in most blocks they say that no pose is near
    bound = np.vdot(inverse, inverse).real * np.vdot(c1, c1).real * np.vdot(c2, c2).real
    if bound < 1 / PARALLEL**2:
        return inverse
    if np.ndim(inverse) == 0:
        return float("nan")
    return np.where(np.abs(inverse) * (np.abs(c1) * np.abs(c2)) < 1 / PARALLEL, inverse, np.nan)


def _transposed(cols: list[list[Number]], loads: list[Number], block: Block) -> list[Number]:
    """Solve Σ_c λ_c·∂C_c/∂x + Q_x = 0 of a larger group."""
    shape = np.shape(block.st.inputs[0])
    n = int(np.prod(shape))
    jacobian = np.swapaxes(stack(cols, n), -1, -2)
    right = np.zeros((n, len(loads)))
    for i, load in enumerate(loads):
        if load is not None:
            right[:, i] = -load
    good = np.asarray(np.isfinite(jacobian).all(axis=(1, 2)) & np.isfinite(right).all(axis=1))
    out = np.full((n, jacobian.shape[-1]), np.nan)
    if jacobian.shape[-1] == jacobian.shape[-2]:
        good &= np.linalg.cond(np.where(good[:, None, None], jacobian, np.eye(len(loads)))) < 1 / PARALLEL
        out[good] = np.linalg.solve(jacobian[good], right[good][..., None])[..., 0]
    found = out[:, 0::2] + 1j * out[:, 1::2]
    return [found[:, c] if shape else complex(found[0, c]) for c in range(found.shape[1])]
