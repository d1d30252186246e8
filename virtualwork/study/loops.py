"""The loops of a mechanism as a book writes them, and both roots of each closed form with its vectors."""

from __future__ import annotations

from collections import deque
from itertools import groupby
from typing import NamedTuple

import numpy as np

from virtualwork.branch.assembly import Assembly
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.closed_forms import Case
from virtualwork.formulas.positions import State
from virtualwork.plan.steps import Group, Place, Plan, joints

CASES = {"RPR": 1, "RRP": 2, "PRP": 3, "RRR": 4}
"""Chace's case of each kind of group: length and direction of one vector, length of one and direction of another, two
lengths, two directions (M. A. Chace, J. Eng. Ind. 85 (1963) 289)."""


class Loop(NamedTuple):
    """A vector loop: the joints from the start to where it is cut, along the one way and along the other.

    The bodies of each way stand between its joints.
    """

    one: tuple[str, ...]
    along_one: tuple[str, ...]
    other: tuple[str, ...]
    along_other: tuple[str, ...]

    @property
    def text(self) -> str:
        """The loop as text: `A→B→C − A→D→C = 0` (Ibrahim eq. 1.3.1); ways of the same joints with their links.

        A pin on the slider that it moves is one point: O→A→B − O→B = 0.
        """
        one, other = ("→".join(name for name, _ in groupby(way)) for way in (self.one, self.other))
        if one == other:
            one, other = f"{one} ({', '.join(self.along_one)})", f"{other} ({', '.join(self.along_other)})"
        return f"{one} − {other} = 0"


def loops(m: Description, plan: Plan) -> list[Loop]:
    """Return every independent loop of a mechanism, in the order of solution.

    Examples
    --------
    >>> from virtualwork import Guess, Input, Link, Mechanism
    >>> m = Mechanism({"A": 0j, "D": 3}, {"crank": Link({"A": 0j, "B": 1}), "coupler": Link({"B": 0j, "C": 3}),
    ...     "rocker": Link({"D": 0j, "C": 2})}, inputs=Input(link="crank"), guess=Guess(0.0, {"coupler": 0.7, "rocker": 1.4}))
    >>> [loop.text for loop in loops(m, m.assembly.plan)]
    ['A→B→C − A→D→C = 0']
    """
    names = {joint.key: joint.name for joint in joints(m)}
    edges = {(joint.key, body) for joint in joints(m) for body in joint.bodies}
    cuts = [closure.cut for group in plan.groups for closure in group.closures]
    left = edges - set(cuts)
    order = [*m.ground]
    loops = []
    for joint, body in cuts:
        way = _way(left, joint, body)
        if way is None:
            continue
        # joint, body, joint, body … back to the body that was cut off
        pins, bodies = way[::2], way[1::2]
        n = len(pins)
        grounded = [k for k in range(1, n) if GROUND in (bodies[k - 1], bodies[k])]
        ranks = {k: order.index(names[pins[k]]) if names[pins[k]] in order else len(order) for k in range(n)}
        start = min(grounded or [min(1, n - 1)], key=lambda k: (ranks[k], k))
        first = tuple(names[pins[k]] for k in range(start, -1, -1))
        along_first = tuple(bodies[k] for k in range(start - 1, -1, -1))
        second = tuple(names[pins[k % n]] for k in range(start, n + 1))
        along_second = tuple(bodies[k] for k in range(start, n))
        pair = [(first, along_first), (second, along_second)]
        # the way that does not begin on the ground goes first: the driven side
        pair.sort(key=lambda way: way[1][:1] == (GROUND,))
        loops.append(Loop(*pair[0], *pair[1]))
    return loops


def _way(edges: set[tuple[str, str]], joint: str, body: str) -> list[str] | None:
    """The shortest way from a joint to a body over joints and bodies: joint, body, joint … body."""
    near: dict[str, list[str]] = {}
    for key, of in sorted(edges):
        near.setdefault(key, []).append(f"body {of}")
        near.setdefault(f"body {of}", []).append(key)
    came, waiting = {joint: ""}, deque([joint])
    goal = f"body {body}"
    while waiting:
        here = waiting.popleft()
        if here == goal:
            way = [here]
            while came[way[-1]]:
                way.append(came[way[-1]])
            return [node.removeprefix("body ") for node in reversed(way)]
        for other in near.get(here, ()):
            if other not in came:
                came[other] = here
                waiting.append(other)
    return None


class Root(NamedTuple):
    """One assembly of a group: where its joint lies, its angles (rad) and its slides (m)."""

    point: complex
    angles: tuple[float, ...]
    slides: tuple[float, ...]


class GroupAt(NamedTuple):
    """A closed form at a pose: W + V·e^{iφ} + … = 0 with its vectors, both roots, and which of them (from 1) is taken."""

    offset: complex
    vectors: tuple[complex, complex]
    roots: tuple[Root, ...]
    taken: int


def apex(m: Description, group: Group) -> tuple[str, str]:
    """Return the joint that a group's roots tell apart, and a link of the group that has it."""
    bodies = [body for body in m.links if body in group.links] or list(group.links)
    inner = [j for j in joints(m) if sum(body in group.links for body in j.bodies) > 1]
    for joint in inner:
        if joint.guide is None:
            return joint.name, next(body for body in joint.bodies if body in group.links)
    closure = group.closures[0]
    if closure.guide is not None:
        g = m.guides[closure.guide]
        return g.point, g.link
    return closure.joint, closure.body if closure.body in m.bodies else bodies[0]


def closed_form(assembly: Assembly, group: Group, inputs: tuple[float, ...]) -> GroupAt | None:
    """Return both roots of a group in closed form at a pose; None where it is not assembled."""
    m, plan = assembly.mechanism, assembly.plan
    whole = assembly.state(inputs)
    case = Case(group)
    if any(not np.isfinite(complex(np.ravel(whole.turn.get(body, np.nan))[0])) for body in group.angles):
        return None
    name, body = apex(m, group)
    sign = float(np.ravel(assembly.sign(group.name, np.array([inputs[0]])))[0])
    w, (v, u) = case.offset(whole), case.vectors(whole)
    roots = []
    for each in (1.0, -1.0) if group.kind != "PRP" else (1.0,):
        st = State(list(inputs))
        for step in plan.steps:
            if step is group:
                break
            assembly.run([step], st)
        case.solve(st, each, m.size)
        _places(plan, st)
        base, terms = plan.anchors[body]
        z = m.bodies[body][name]
        at = st.at((base, terms)) + (z if body == GROUND else z * st.turn[body])
        angles = tuple(float(np.angle(st.turn[b])) for b in group.angles)
        roots.append(Root(complex(at), angles, tuple(float(st.slide[g]) for g in group.slides)))
    taken = 1 if group.kind == "PRP" or sign > 0 else 2
    return GroupAt(complex(w), (complex(v), complex(u)), tuple(roots), taken)


def _places(plan: Plan, st: State) -> None:
    """Place every point that the known angles and slides give."""
    for step in plan.steps:
        if isinstance(step, Place) and step.node not in st.point:
            placed = all(
                (t.body == GROUND or t.body in st.turn) and (t.slide is None or t.slide in st.slide)
                for t in step.terms
            )
            if placed and (step.base is None or step.base in st.point):
                moved = st.sum(step.terms)
                st.point[step.node] = moved if step.base is None else st.point[step.base] + moved
