"""The topology of a mechanism: what its order of solution hangs on, and the plan kept for it.

Which links meet, which points of a link lie at the same place, how angles are tied: no length is in it. A plan is made
once for a topology, with its vectors written down in the names of the points (`order.Vector`); a mechanism puts its numbers in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

from dalembert.arithmetic.recorded import Constant
from dalembert.arithmetic.varied import Varied, rotation
from virtualwork.describe.description import Description
from virtualwork.plan.steps import Closure, Group, Place, Plan, Slot, Step, Term

KEPT = 256


def direction(angle: float) -> complex:
    """e^{i·angle}, exact at the quarter turns, so that a guide at 90° is not tilted by a rounding.

    >>> direction(math.pi / 2)
    1j
    """
    if isinstance(angle, Varied):
        return rotation(angle)
    quarter = angle / (math.pi / 2)
    if abs(quarter - round(quarter)) <= 1e-15 * max(1.0, abs(quarter)):
        return (1 + 0j, 1j, -1 + 0j, -1j)[round(quarter) % 4]
    return rotation(angle)  # type: ignore[no-any-return]


@dataclass(frozen=True)
class Topology:
    """What a plan hangs on.

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
        if self.first.gears or any(isinstance(angle, Constant) for angle in tied):
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
