"""The topology of a mechanism: what its order of solution depends on, the plan kept for it, and which equations go together.

Which links meet, which points of a link lie at the same place, how angles are tied: no length is in it. A plan is made
once for a topology, with its vectors written down in the names of the points (`sums.Vector`); a mechanism puts its numbers in.

The equations of the joints and the coordinates they hold form a bipartite graph; its Dulmage-Mendelsohn decomposition
(A. L. Dulmage, N. S. Mendelsohn, Can. J. Math. 10 (1958) 517) is unique, and says what is solved together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

from dalembert.arithmetic.recorded import Constant
from dalembert.arithmetic.varied import direction
from dalembert.dataclass import dataclass, field, replace
from virtualwork.describe import MobilityError
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.plan.steps import (
    Blocks,
    Closure,
    Group,
    Place,
    Plan,
    Relation,
    Slot,
    Step,
    Term,
    Variable,
    guide_label,
)

KEPT = 256


@dataclass(frozen=True)
class Topology:
    """What a plan depends on.

    Attributes
    ----------
    bodies : tuple of (body, tuple of (point, slot))
        The slot is that of the first point of the body at the same place; None at the origin.
    guides : tuple
        What each joins, the slot through which its line runs, and the angle that a slider ties.
    inputs : tuple
        What is driven.
    first : Description
        The one that the plan is made from.
    """

    bodies: tuple[tuple[str, tuple[tuple[str, Slot | None], ...]], ...]
    guides: tuple[tuple[Any, ...], ...]
    inputs: tuple[tuple[Any, ...], ...]
    merged: bool
    first: Description = field(compare=False, repr=False)
    phases: Mapping[int, float] = field(compare=False, repr=False)

    @classmethod
    def of(cls, m: Description, merged: bool, phases: Mapping[int, float]) -> Topology:
        """The topology of a mechanism."""
        # of each body: the first that lies at a place
        places: dict[str, dict[complex, Slot]] = {body: {} for body in m.bodies}
        bodies = tuple(
            (
                body,
                tuple(
                    (p, None if z == 0 else places[body].setdefault(z, (body, p))) for p, z in points.items()
                ),
            )
            for body, points in m.bodies.items()
        )
        guides = []
        for i, g in enumerate(m.guides):
            z = m.through(g)
            line = None if z == 0 else places[g.on].setdefault(z, (i, "through"))
            guides.append((g.point, g.link, g.on, line, None if g.turned is None else (g.angle, g.turned)))
        inputs = tuple((e.link, e.on, e.slider) for e in m.inputs)
        return cls(bodies, tuple(guides), inputs, merged, m, phases)

    def plan(self, make: Callable[[Topology], Plan]) -> Plan:
        """The order of solution in names: made once, but where a gear's constant, or a constant that varies, is in it."""
        tied = [angle for *_, angles in self.guides if angles for angle in angles]
        if self.first.meshes or self.first.cams or any(isinstance(angle, Constant) for angle in tied):
            return make(self)
        return _kept(self, make)

    def filled(self, make: Callable[[Topology], Plan]) -> Plan:
        """The order of solution with the numbers of its mechanism."""
        m, plan = self.first, self.plan(make)
        directions = {i: direction(g.angle) for i, g in enumerate(m.guides)}

        def number(z: Any) -> complex:
            total: complex = 0j
            for (of, name), times in z.parts.items():
                if isinstance(of, str):
                    value = m.bodies[of][name]
                else:
                    value = m.through(m.guides[of]) if name == "through" else directions[of]
                total = total + (value if times == 1 else -value if times == -1 else times * value)
            return total

        def terms(of: tuple[Term, ...]) -> tuple[Term, ...]:
            return tuple([Term(number(t.z), t.body, t.slide) for t in of])

        def step(of: Step) -> Step:
            if isinstance(of, Place):
                return Place(of.node, of.base, terms(of.terms))
            if isinstance(of, Group):
                loops = [
                    Closure(c.start, c.end, terms(c.terms), c.joint, c.body, c.guide) for c in of.closures
                ]
                return replace(of, closures=tuple(loops))
            return of

        return replace(
            plan,
            steps=tuple(map(step, plan.steps)),
            anchors={body: (base, terms(own)) for body, (base, own) in plan.anchors.items()},
            directions=directions,
        )


@lru_cache(maxsize=KEPT)
def _kept(topology: Topology, make: Callable[[Topology], Plan]) -> Plan:
    return make(topology)


@dataclass(frozen=True)
class Equation:
    """One scalar equation of a joint: its label, and the coordinates it holds."""

    label: str
    variables: tuple[Variable, ...]
    is_input: bool = False


def equations(m: Description, tied: Sequence[Relation]) -> tuple[list[Variable], list[Equation]]:
    """The coordinates of a mechanism and the scalar equations of its inputs and joints; `tied`: its relations between angles."""
    variables: list[Variable] = []
    for link in m.links:
        variables += [("angle", link), ("x", link), ("y", link)]
    for pin, bodies in m.pins.items():
        if GROUND not in bodies:
            variables += [("px", pin), ("py", pin)]
    variables += [("slide", str(i)) for i in range(len(m.guides))]

    def body(name: str, axis: str) -> tuple[Variable, ...]:
        return () if name == GROUND else ((axis, name), ("angle", name))

    rows = [
        Equation(f"input {e.name}", (("slide", str(m.guide_of(e))),), True) for e in m.inputs if e.is_slide
    ]
    for relation in tied:
        angles = tuple(
            ("slide", str(x)) if isinstance(x, int) else ("angle", x) for x in relation.shares if x != GROUND
        ) + tuple(("angle", key.removeprefix("angle:")) for key in sorted(relation.right.reads))
        rows.append(Equation(relation.label, angles, relation.kind == "input"))
    for pin, bodies in m.pins.items():
        for name in bodies:
            if name != GROUND:
                for axis, coordinate in (("x", "px"), ("y", "py")):
                    at_pin: tuple[Variable, ...] = () if GROUND in bodies else ((coordinate, pin),)
                    rows.append(Equation(f"pin {pin}", body(name, axis) + at_pin))
    for i, g in enumerate(m.guides):
        for axis in "xy":
            held = body(g.link, axis) + body(g.on, axis) + (("slide", str(i)),)
            rows.append(Equation(guide_label(m, i), held))
    return variables, rows


def decompose(m: Description, tied: Sequence[Relation]) -> Blocks:
    """Split the coordinates of a mechanism into irreducible blocks, in their order of solution.

    Raises
    ------
    MobilityError
        Where coordinates stay free, or inputs are too many; the message names the links.
    """
    variables, rows = equations(m, tied)
    joints = sum(not row.is_input for row in rows)
    mobility = len(variables) - joints
    of_variable = _match(rows)
    matched = set(of_variable.values())
    spare = [i for i in range(len(rows)) if i not in matched]
    _refuse_free(m, variables, rows, of_variable, mobility)
    if any(rows[i].is_input for i in spare):
        names = ", ".join(rows[i].label.removeprefix("input ") for i in spare if rows[i].is_input)
        raise MobilityError(
            f"[input]: {len(m.inputs)} inputs for mobility {mobility}: '{names}' is driven twice or cannot move"
        )
    # what the redundant equations touch is solved together, all equations at once
    over: set[Variable] = set()
    stack = [v for i in spare for v in rows[i].variables]
    while stack:
        v = stack.pop()
        if v not in over:
            over.add(v)
            stack += rows[of_variable[v]].variables
    after = {v: [u for u in rows[of_variable[v]].variables if u != v] for v in variables}
    if over:
        ring = sorted(over, key=variables.index)
        for a, b in zip(ring, ring[1:] + ring[:1], strict=True):
            after[a] = [*after[a], b]
    return Blocks(
        tuple(_components(variables, after)), tuple(dict.fromkeys(rows[i].label for i in spare)), mobility
    )


def _match(rows: list[Equation]) -> dict[Variable, int]:
    """A maximum matching by augmenting paths (H. W. Kuhn, 1955); earlier equations stay matched."""
    of_variable: dict[Variable, int] = {}

    for first in range(len(rows)):
        # the equations on the way, each with the variables it has not tried; a chain of links makes it long
        way = [(first, iter(rows[first].variables))]
        through: list[Variable] = []
        seen: set[Variable] = set()
        while way:
            v = next((v for v in way[-1][1] if v not in seen), None)
            if v is None:
                way.pop()
                del through[-1:]
                continue
            seen.add(v)
            through.append(v)
            if v not in of_variable:
                of_variable.update(zip(through, (i for i, _ in way), strict=True))
                break
            i = of_variable[v]
            way.append((i, iter(rows[i].variables)))
    return of_variable


def _refuse_free(
    m: Description,
    variables: list[Variable],
    rows: list[Equation],
    of_variable: dict[Variable, int],
    mobility: int,
) -> None:
    free = {v for v in variables if v not in of_variable}
    if not free:
        return
    grown = True
    # what can move with the free coordinates
    while grown:
        grown = False
        for v, i in of_variable.items():
            if v not in free and free.intersection(rows[i].variables):
                free.add(v)
                grown = True
    links = [
        link for link in m.links if any(name == link for kind, name in free if kind in ("angle", "x", "y"))
    ]
    if not m.inputs:
        raise MobilityError(f"[input]: missing; the mechanism has mobility {mobility} and nothing drives it")
    raise MobilityError(
        f"a free degree of freedom: {', '.join(links) or 'a point'} can still move while every input "
        f"({', '.join(e.name for e in m.inputs)}) is held; add a joint or an [[input]]"
    )


def _components(
    variables: list[Variable], after: dict[Variable, list[Variable]]
) -> list[tuple[Variable, ...]]:
    """Strongly connected components, what is needed first (R. Tarjan, SIAM J. Comput. 1 (1972) 146)."""
    index: dict[Variable, int] = {}
    low: dict[Variable, int] = {}
    stack: list[Variable] = []
    on: set[Variable] = set()
    components: list[tuple[Variable, ...]] = []
    place = {v: i for i, v in enumerate(variables)}

    def visit(root: Variable) -> None:
        work = [(root, iter(after[root]))]
        index[root] = low[root] = len(index)
        stack.append(root)
        on.add(root)
        while work:
            v, rest = work[-1]
            for u in rest:
                if u not in index:
                    index[u] = low[u] = len(index)
                    stack.append(u)
                    on.add(u)
                    work.append((u, iter(after[u])))
                    break
                if u in on:
                    low[v] = min(low[v], index[u])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[v])
                if low[v] == index[v]:
                    block = []
                    while True:
                        u = stack.pop()
                        on.discard(u)
                        block.append(u)
                        if u == v:
                            break
                    components.append(tuple(sorted(block, key=place.__getitem__)))

    for v in variables:
        if v not in index:
            visit(v)
    return components
