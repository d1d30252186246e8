"""The bipartite graph of joints' equations and coordinates, and its Dulmage-Mendelsohn decomposition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from virtualwork.describe.description import Description
from virtualwork.describe.errors import MobilityError
from virtualwork.describe.parts import GROUND
from virtualwork.plan.joints import Relation, guide_label
from virtualwork.plan.steps import Blocks, Variable


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
        angles = tuple(("angle", body) for body in relation.shares if body != GROUND)
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

    def augment(i: int, seen: set[Variable]) -> bool:
        for v in rows[i].variables:
            if v not in seen:
                seen.add(v)
                if v not in of_variable or augment(of_variable[v], seen):
                    of_variable[v] = i
                    return True
        return False

    for i in range(len(rows)):
        augment(i, set())
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
    found: list[tuple[Variable, ...]] = []
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
                    found.append(tuple(sorted(block, key=place.__getitem__)))

    for v in variables:
        if v not in index:
            visit(v)
    return found
