"""Joint forces by Newton and Euler: the groups' small Jacobians, transposed, in reverse order.

The order of solution places every body by one joint of a tree and closes loops at the others. The forces λ at the
loop joints are the multipliers of the loops: for each unknown x of a group, with Q_x the load that falls on it,

    Q_x + Σ_c λ_c·∂C_c/∂x = 0,

which is the group's own small Jacobian transposed (already formed for the velocities). Q_x gathers the loads of all
that hangs on the group, which is why groups are taken in reverse. The other joints follow from ΣF = 0 of one body or
one pin after the other (000 §2.2, d'Alembert), torques from ΣM = 0 (000 §2.3). Nothing is formed that was not
asked for: every quantity asks for what it needs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from virtualwork.dyads import Number, cross, dot
from virtualwork.errors import MechanismError
from virtualwork.loads import BLOCK, Block, Scene, path_reads, plus, times
from virtualwork.mechanism import GROUND
from virtualwork.newton import stack
from virtualwork.state import columns
from virtualwork.steps import Group, Place, Term, Turn
from virtualwork.work import carrier, effort

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from virtualwork.mechanism import Mechanism
    from virtualwork.steps import Plan

    Reals = NDArray[np.float64]

_NO_TERM = Term(0j, GROUND)
PARALLEL = (
    1e-11  # sine of the angle between two columns below which the joint forces have no digit left that counts
)

Side = tuple[str, str]  # (joint, body): the force of a joint on a body; joint is "pin:B" or "guide:0"


@dataclass(frozen=True)
class Joint:
    """A joint as the reactions see it: a pin or a guide, and the bodies it joins in the file's order."""

    key: str
    name: str
    bodies: tuple[str, ...]
    guide: int | None = None


def joints(scene: Scene) -> list[Joint]:
    """Every joint of the mechanism: pins in the order of the file, then guides."""
    m = scene.mechanism
    found = [Joint(f"pin:{name}", name, bodies) for name, bodies in m.pins.items()]
    order = list(m.bodies)
    for i, g in enumerate(m.guides):
        found.append(Joint(f"guide:{i}", g.point, tuple(sorted((g.link, g.on), key=order.index)), i))
    return found


class Reactions:
    """The joint forces of a scene, each formed when it is first asked for.

    Attributes
    ----------
    formed : set of str
        What has been formed, for `--explain` and the tests.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.plan: Plan = scene.plan
        self.mechanism: Mechanism = scene.mechanism
        self.joints = joints(scene)
        self.by_key = {joint.key: joint for joint in self.joints}
        self.formed: set[str] = set()
        self._caches: dict[Block, dict[Any, Number]] = {}

    # --- the order in which forces follow from each other -----------------------------------------------------
    @cached_property
    def multipliers(self) -> dict[Side, tuple[Group, int]]:
        """Which joint forces are multipliers of a loop: (joint, body) -> (group, loop)."""
        found: dict[Side, tuple[Group, int]] = {}
        for group in self.plan.groups:
            for c, closure in enumerate(group.closures):
                key = f"pin:{closure.joint}" if closure.guide is None else f"guide:{closure.guide}"
                body = closure.body if closure.guide is None else self.mechanism.guides[closure.guide].link
                found[key, body] = group, c
        return found

    @cached_property
    def sides(self) -> dict[str, list[Side]]:
        """The joint forces on each body; those on the ground are not unknowns of their own."""
        found: dict[str, list[Side]] = {body: [] for body in self.mechanism.links}
        for joint in self.joints:
            for body in joint.bodies:
                if body != GROUND:
                    found[body].append((joint.key, body))
        return found

    @cached_property
    def recipes(self) -> dict[Side, tuple[str, Any]]:
        """How each joint force is found: a multiplier, the balance of a body, the balance of a pin."""
        found: dict[Side, tuple[str, Any]] = {side: ("loop", at) for side, at in self.multipliers.items()}
        equations: list[tuple[str, Any, list[Side]]] = []
        for body, sides in self.sides.items():
            equations.append(("body", body, sides))
        for joint in self.joints:
            if GROUND not in joint.bodies:
                equations.append(("joint", joint.key, [(joint.key, body) for body in joint.bodies]))
        progress = True
        while progress:
            progress = False
            for kind, name, sides in equations:
                open_sides = [side for side in sides if side not in found]
                if len(open_sides) == 1:
                    found[open_sides[0]] = kind, name
                    progress = True
        return found

    @cached_property
    def couples(self) -> tuple[list[tuple[str, int]], Reals, Reals | None]:
        """The unknown torques (guides, gears, inputs), how they act on the bodies, and how ΣM = 0 gives them.

        Returns (unknowns, pattern (bodies, unknowns), inverse or None where the torques are not all determined).
        """
        bodies = list(self.mechanism.links)
        unknowns: list[tuple[str, int]] = []
        columns_: list[Reals] = []

        def add(kind: str, i: int, acts: dict[str, float]) -> None:
            column = np.zeros(len(bodies))
            for body, factor in acts.items():
                if body != GROUND:
                    column[bodies.index(body)] += factor
            unknowns.append((kind, i))
            columns_.append(column)

        m = self.mechanism
        for i, guide in enumerate(m.guides):
            if guide.is_slider:
                add("guide", i, {guide.link: 1.0, guide.on: -1.0})
        for i, gear in enumerate(m.gears):
            a, b = gear.links
            acts = {b: 1.0, a: -gear.ratio}
            acts[gear.arm] = acts.get(gear.arm, 0.0) + gear.ratio - 1.0
            add("gear", i, acts)
        for j, entry in enumerate(m.inputs):
            if not entry.is_slide:
                add("input", j, {str(entry.link): 1.0, entry.on: -1.0})
        pattern = np.array(columns_).reshape(len(unknowns), len(bodies)).T
        return unknowns, pattern, self._rows_of(pattern)

    @staticmethod
    def _rows_of(pattern: Reals) -> Reals | None:
        """A left inverse of the pattern that uses as few bodies as there are unknowns, found by pivoting."""
        n, k = pattern.shape
        inverse = np.zeros((k, n))
        if not k:
            return inverse
        left, chosen = pattern.copy(), []
        for _ in range(k):
            size = np.abs(left).max(axis=1)
            row = int(np.argmax(size))
            if not size[row] > 1e-12:
                return None
            column = int(np.argmax(np.abs(left[row])))
            chosen.append(row)
            left = left - np.outer(left[:, column] / left[row, column], left[row])
            left[row] = 0.0
        inverse[:, chosen] = np.linalg.inv(pattern[chosen])
        return inverse

    @cached_property
    def redundant(self) -> bool:
        """Whether statics cannot give every joint force: more unknowns than equations."""
        square = all(2 * len(g.closures) == len(g.angles) + len(g.slides) for g in self.plan.groups)
        every = all(side in self.recipes for sides in self.sides.values() for side in sides)
        return not square or not every or self.couples[2] is None or bool(self.plan.blocks.redundant)

    # --- what hangs on what (static) ----------------------------------------------------------------------------
    @cached_property
    def _hung(self) -> dict[str, list[tuple[str, Any]]]:
        """For each node, angle and slide: the loads, points and loops that bear on it."""
        found: dict[str, list[tuple[str, Any]]] = {}

        def put(key: str, what: str, of: Any) -> None:
            found.setdefault(key, []).append((what, of))

        def bear(base: str | None, terms: tuple[Term, ...], source: tuple[str, Any]) -> None:
            if base is not None:
                put(f"point:{base}", "force", source)
            for t in terms:
                if t.body != GROUND:
                    put(f"angle:{t.body}", "lever", (t, source))
                if t.slide is not None:
                    put(f"slide:{t.slide}", "along", (t, source))

        for body in self.mechanism.links:
            bear(*self._reference(body), ("wrench", body))
            put(f"angle:{body}", "moment", body)
        for step in self.plan.steps:
            if isinstance(step, Place):
                bear(step.base, step.terms, ("point", step.node))
            elif isinstance(step, Turn):
                for base, r in step.angle.bases:
                    put(f"angle:{base}", "tied", (step.body, r))
            elif isinstance(step, Group):
                for tie in step.ties:
                    for base, r in tie.angle.bases:
                        put(f"angle:{base}", "tied", (tie.body, r))
                for c, closure in enumerate(step.closures):
                    source = ("loop", (step, c))
                    bear(closure.start, closure.terms, source)
                    if closure.end is not None:
                        put(f"point:{closure.end}", "against", source)
        return found

    def _reference(self, body: str) -> tuple[str | None, tuple[Term, ...]]:
        """The point of a body to which its loads are reduced: the centre of mass."""
        return self.scene.path(body, self.scene.rigid[body].center)

    # --- values over one block ------------------------------------------------------------------------------------
    def _cache(self, block: Block) -> dict[Any, Number]:
        return self._caches.setdefault(block, {})

    def _memo(self, block: Block, key: Any, form: Any) -> Number:
        cache = self._cache(block)
        if key not in cache:
            cache[key] = form()
        return cache[key]

    @cached_property
    def _on(self) -> dict[str, list[Any]]:
        """The loads on each body."""
        found: dict[str, list[Any]] = {body: [] for body in self.mechanism.links}
        for load in [*self.scene.loads, *self.scene.rubs]:
            if load.body != GROUND:
                found[load.body].append(load)
        return found

    def force(self, block: Block, body: str) -> Number:
        """The sum of the loads on a body."""

        def form() -> Number:
            total: Number = None
            for load in self._on[body]:
                if load.path is not None:
                    total = plus(total, block.keep(load))
            return total

        return self._memo(block, ("force", body), form)

    @cached_property
    def carried(self) -> list[tuple[str, Reals]]:
        """Torques of motors that sit on another body than `on`: what moves their reaction there (000 §2.3).

        The input's own torque acts between the driven link and `on`; with +T on `on` and −T on the carrier added,
        the motor acts between the driven link and its carrier.
        """
        found = []
        for j, entry in enumerate(self.mechanism.inputs):
            body = entry.on if entry.is_slide else carrier(self.scene, j)
            if body != entry.on:
                torque = effort(self.scene)[:, j]
                found += [(body, -torque), (entry.on, torque)]
        return [(body, torque) for body, torque in found if body != GROUND]

    def moment(self, block: Block, body: str) -> Number:
        """The moment of the loads on a body about its centre of mass."""

        def form() -> Number:
            total: Number = None
            center = self.scene.rigid[body].center
            for load in self._on[body]:
                value = block.keep(load)
                if value is None:
                    continue
                if load.path is None:
                    total = plus(total, value)
                elif (arm := load.arm(block, center)) is not None:
                    total = plus(total, cross(arm, value))
            for carrying, torque in self.carried:
                if carrying == body:
                    total = plus(total, torque[block.rows] if block.st.many else float(torque[0]))
            return total

        return self._memo(block, ("moment", body), form)

    def _source(self, block: Block, source: tuple[str, Any]) -> Number:
        kind, of = source
        if kind == "wrench":
            return self.force(block, of)
        if kind == "point":
            return self._bearing(block, f"point:{of}")
        group, c = of
        return self.multiplier(block, group)[c]

    def _bearing(self, block: Block, key: str, without: Group | None = None) -> Number:
        """What bears on a node (force), an angle (torque) or a slide (force along it), `without` one group's loops."""

        def form() -> Number:
            total: Number = None
            for what, of in self._hung.get(key, ()):
                if what == "moment":
                    total = plus(total, self.moment(block, of))
                elif what == "tied":
                    body, r = of
                    total = plus(total, times(self._bearing(block, f"angle:{body}", without), r))
                else:
                    t, source = of if what in ("lever", "along") else (_NO_TERM, of)
                    if source[0] == "loop" and without is not None and source[1][0] is without:
                        continue
                    value = self._source(block, source)
                    if value is None:
                        continue
                    if what == "force":
                        total = plus(total, value)
                    elif what == "against":
                        total = plus(total, -value)
                    else:
                        total = plus(total, self._work(block, t, value, what == "along"))
            return total

        return self._memo(block, (key, None if without is None else without.name), form)

    @staticmethod
    def _work(block: Block, t: Term, value: Number, along: bool) -> Number:
        """What a force does when a term's body turns (its lever) or its slide moves."""
        v = t.z if t.body == GROUND else t.z * block.st.turn[t.body]
        if along:
            return dot(value, v)
        if t.slide is not None:
            v = v * block.st.slide[t.slide]
        return cross(v, value)

    def multiplier(self, block: Block, group: Group) -> list[Number]:
        """The forces λ at a group's loop joints: its Jacobian, transposed, solved for the loads on its unknowns."""

        def form() -> Number:
            self.formed.add(group.name)
            loads = [self._bearing(block, f"angle:{a}", group) for a in group.angles]
            loads += [self._bearing(block, f"slide:{s}", group) for s in group.slides]
            if all(load is None for load in loads):
                return [None] * len(group.closures)
            cols = block.by[0].columns(group)
            if group.kind != "Newton":
                (c1, c2), (q1, q2) = cols[0], loads
                det = cross(c1, c2)
                with np.errstate(divide="ignore", invalid="ignore"):
                    inverse = _inverse(det, c1, c2)
                    total = plus(
                        times(c2, None if q1 is None else q1 * inverse),
                        times(c1, None if q2 is None else q2 * -inverse),
                    )
                return [1j * total]
            return _transposed(cols, loads, block)

        return self._memo(block, ("loop", group.name), form)  # type: ignore[no-any-return]

    def on_side(self, block: Block, side: Side) -> Number:
        """The force of a joint on a body, complex; None where it is zero throughout."""

        def form() -> Number:
            joint, body = side
            self.formed.add(f"{joint} on {body}")
            if body == GROUND:
                return self._sum(block, None, [(joint, other) for other in self.by_key[joint].bodies], -1)
            kind, of = self.recipes[side]
            if kind == "loop":
                group, c = of
                return self.multiplier(block, group)[c]
            if kind == "joint":
                others = [(joint, other) for other in self.by_key[joint].bodies if other != body]
                return self._sum(block, None, others, -1)
            return self._sum(block, self.force(block, body), [s for s in self.sides[body] if s != side], -1)

        return self._memo(block, side, form)

    def _sum(self, block: Block, start: Number, sides: list[Side], sign: int) -> Number:
        """±(start + Σ of joint forces), in one pass for each; a force that is another's reaction is not formed for it."""
        parts: list[tuple[int, Number]] = [] if start is None else [(sign, start)]
        for side in sides:
            factor, value = self._signed(block, side)
            if value is not None:
                parts.append((sign * factor, value))
        if not parts:
            return None
        parts.sort(key=lambda part: -part[0])
        (factor, total), *rest = parts
        if factor < 0:
            total = -total
        for factor, value in rest:
            total = total + value if factor > 0 else total - value
        return total

    def _signed(self, block: Block, side: Side) -> tuple[int, Number]:
        """A joint force as ± one that is known."""
        joint, body = side
        if body == GROUND:
            return 1, None
        kind, _ = self.recipes[side]
        bodies = self.by_key[joint].bodies
        if kind == "joint" and len(bodies) == 2 and side not in self._cache(block):
            other = bodies[0] if bodies[1] == body else bodies[1]
            return -1, self.on_side(block, (joint, other))
        return 1, self.on_side(block, side)

    def place(self, block: Block, side: Side) -> Number:
        """Where a joint's force acts, from the body's centre of mass, in ground axes."""
        joint, body = side
        center = self.scene.rigid[body].center
        if joint.startswith("pin:"):
            return (self.mechanism.links[body].points[joint[4:]] - center) * block.st.turn[body]
        g = int(joint[6:])
        guide = self.mechanism.guides[g]
        if body == guide.link:
            return (self.mechanism.links[body].points[guide.point] - center) * block.st.turn[body]
        through = guide.through
        z = self.mechanism.bodies[body][through] if isinstance(through, str) else through
        return (z - center + self.plan.directions[g] * block.st.slide[g]) * block.st.turn[body]

    def rest(self, block: Block, body: str) -> Number:
        """ΣM about a body's centre of mass of its loads and joint forces: what torques must balance."""

        def form() -> Number:
            total = self.moment(block, body)
            for side in self.sides[body]:
                factor, value = self._signed(block, side)
                if value is not None:
                    turned = cross(self.place(block, side), value)
                    total = plus(total, turned if factor > 0 else -turned)
            return total

        return self._memo(block, ("rest", body), form)

    def couple(self, block: Block, kind: str, i: int) -> Number:
        """The torque of a guide, a gear or an input."""
        unknowns, _, inverse = self.couples
        if inverse is None:
            raise MechanismError("the torques of its guides are not determined by statics")
        row = inverse[unknowns.index((kind, i))]
        total: Number = None
        for body, factor in zip(self.mechanism.links, row, strict=True):
            if factor:
                total = plus(total, times(self.rest(block, body), -float(factor)))
        return total

    # --- over all poses -------------------------------------------------------------------------------------------
    @cached_property
    def keys(self) -> tuple[str, ...]:
        """What the places of all joints hang on."""
        keys: set[str] = set()
        for body in self.mechanism.links:
            keys |= path_reads(self._reference(body)) | {f"angle:{body}"}
        for i in range(len(self.mechanism.guides)):
            keys.add(f"slide:{i}")
        for group in self.plan.groups:
            keys |= self.plan.reads(group) | set(self.plan.writes(group))
        return tuple(sorted(keys))

    def blocks(self) -> list[Block]:
        """The scene's blocks, with what all joints' places hang on."""
        return self.scene.blocks(self.keys)

    def over(self, *forms: Callable[[Block], Number], kind: type = float) -> list[Any]:
        """Quantities over all blocks, formed block by block together; NaN where a pose is not assembled."""
        n = self.scene.motion.n
        found: list[Any] = [np.empty(n, dtype=kind) for _ in forms]

        def work(block: Block) -> None:
            for out, form in zip(found, forms, strict=True):
                value = form(block)
                out[block.rows] = 0.0 if value is None else value
            if n > BLOCK:  # over a long sweep what the quantities were made of is not kept
                cache = self._cache(block)
                for key in [key for key in cache if key[0][:4] not in ("loop", "pin:", "guid")]:
                    del cache[key]
                block._kept.clear()

        self.scene.each(self.keys, work)
        if self.scene.lost is not None:
            for out in found:
                out[self.scene.lost] = np.nan
        return found

    def joint_force(self, block: Block, joint: Joint, body: str) -> Number:
        """The force of a joint on a body over a block, without the force of an input that drives it."""
        value = plus(self.on_side(block, (joint.key, body)), self._rubbed(block, joint, body))
        if joint.guide is not None and value is not None and self._driving(joint.guide) is not None:
            rail = self.rail(block, joint.guide)
            value = value - dot(value, rail) * rail
        return value

    def _rubbed(self, block: Block, joint: Joint, body: str) -> Number:
        """The friction force along a guide belongs to its reaction."""
        total: Number = None
        for load in self.scene.rubs:
            if load.path is not None and load.body == body and load.joint == joint.key:
                total = plus(total, load.value(block))
        return total

    def _driving(self, guide: int) -> int | None:
        point = self.mechanism.guides[guide].point
        return next((j for j, e in enumerate(self.mechanism.inputs) if e.slider == point), None)

    def rail(self, block: Block, guide: int | None) -> Number:
        """The direction of a guide, a unit vector."""
        assert guide is not None
        on = self.mechanism.guides[guide].on
        d = self.plan.directions[guide]
        return d if on == GROUND else d * block.st.turn[on]

    def guide_moment(self, block: Block, guide: int, body: str) -> Number:
        """The moment a guide puts on one of its bodies about its point, over a block."""
        g = self.mechanism.guides[guide]
        if not g.is_slider:
            return None
        return times(self.couple(block, "guide", guide), 1.0 if body == g.link else -1.0)

    def effort(self, block: Block, j: int) -> Number:
        """The effort at input j by Newton and Euler: ΣM = 0 of the driven link, or the force along the slide."""
        entry = self.mechanism.inputs[j]
        if not entry.is_slide:
            return self.couple(block, "input", j)
        guide = next(i for i, g in enumerate(self.mechanism.guides) if g.point == entry.slider)
        value = self.on_side(block, (f"guide:{guide}", self.mechanism.guides[guide].link))
        return None if value is None else dot(value, self.rail(block, guide))


def _inverse(det: Number, c1: Number, c2: Number) -> Number:
    """1/det; NaN where two columns are parallel to rounding, for the joint forces have no value there."""
    size = abs(c1) * abs(c2)
    if np.ndim(det) == 0:
        return 1 / det if abs(det) > PARALLEL * size else float("nan")
    # the smallest determinant decides for the whole block, at the price of one pass
    bad = np.abs(det) <= PARALLEL * size
    inverse = 1 / det
    if bad.any():
        inverse = np.where(bad, np.nan, inverse)
    return inverse


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


def columns_of(group: Group, block: Block, scene: Scene) -> list[list[Number]]:
    """A group's Jacobian over a block, where no velocity has formed it."""
    return columns(group, block.st, scene.plan)
