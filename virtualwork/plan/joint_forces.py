"""In which order joint forces follow from each other: multipliers of loops, balances of bodies and pins."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from typing import Any

from virtualwork.describe import MechanismError
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.plan.steps import Group, Joint, Plan, joints, relations

# the force of a joint on a body, (joint, body); a joint is "pin:B" or "guide:0"
Side = tuple[str, str]


def pairs(every: Iterable[Joint]) -> list[tuple[Joint, str, str]]:
    """Every joint force once, as (joint, on, from): of two bodies on the later, of more on each from the pin."""
    pairs: list[tuple[Joint, str, str]] = []
    for joint in every:
        if len(joint.bodies) == 2:
            pairs.append((joint, joint.bodies[1], joint.bodies[0]))
        else:
            pairs += [(joint, body, "pin") for body in joint.bodies if body != GROUND]
    return pairs


class Order:
    """How each joint force is found: as a multiplier of a loop, or from the balance of a body or a pin."""

    def __init__(self, mechanism: Description, plan: Plan) -> None:
        self.mechanism, self.plan = mechanism, plan
        self.joints = joints(mechanism)
        self.by_key = {joint.key: joint for joint in self.joints}

    @cached_property
    def pairs(self) -> list[tuple[Joint, str, str]]:
        """Every joint force once; see `pairs`."""
        return pairs(self.joints)

    @cached_property
    def multipliers(self) -> dict[Side, tuple[Group, int]]:
        """Which joint forces are multipliers of a loop: (joint, body) -> (group, loop)."""
        return {
            closure.cut: (group, c) for group in self.plan.groups for c, closure in enumerate(group.closures)
        }

    @cached_property
    def sides(self) -> dict[str, list[Side]]:
        """The joint forces on each body; those on the ground are not unknowns of their own."""
        sides: dict[str, list[Side]] = {body: [] for body in self.mechanism.links}
        for joint in self.joints:
            for body in joint.bodies:
                if body != GROUND:
                    sides[body].append((joint.key, body))
        return sides

    @cached_property
    def recipes(self) -> dict[Side, tuple[str, Any]]:
        """How each joint force is found: a multiplier, the balance of a body, the balance of a pin."""
        recipes: dict[Side, tuple[str, Any]] = {side: ("loop", at) for side, at in self.multipliers.items()}
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
                open_sides = [side for side in sides if side not in recipes]
                if len(open_sides) == 1:
                    recipes[open_sides[0]] = kind, name
                    progress = True
        return recipes

    @cached_property
    def couples(self) -> tuple[list[tuple[str, int]], list[dict[str, Any]] | None]:
        """The unknown torques (guides, gears, inputs), and how the bodies' ΣM = 0 gives each: body -> factor.

        None in place of the factors where the torques are not all determined. The tooth force of a rack is one of them
        only where its guide does not tell it; what a cam does acts as a load that virtual work has given.
        """
        bodies = list(self.mechanism.links)
        placed = set(self.along.values())
        every = [
            r
            for r in relations(self.mechanism)
            if r.kind != "cam" and (r.gear is None or r.gear not in placed)
        ]
        tied = sorted(every, key=lambda r: r.kind == "input")
        pattern = [[r.torques.get(body, 0.0) for r in tied] for body in bodies]
        inverse = left_inverse(pattern)
        factors = None
        if inverse is not None:
            factors = [{body: f for body, f in zip(bodies, row, strict=True) if f} for row in inverse]
        return [(r.kind, r.number) for r in tied], factors

    @cached_property
    def racks(self) -> dict[int, list[int]]:
        """The racks of each guide: the numbers of their meshes."""
        racks: dict[int, list[int]] = {}
        for i, mesh in enumerate(self.mechanism.meshes):
            if mesh.guide is not None:
                racks.setdefault(mesh.guide, []).append(i)
        return racks

    @cached_property
    def along(self) -> dict[int, int]:
        """The guides whose own force along the rail is the tooth force of one rack: guide -> mesh."""
        return {
            guide: meshes[0]
            for guide, meshes in self.racks.items()
            if len(meshes) == 1 and self.mechanism.driver_of(guide) is None
        }

    @cached_property
    def redundant(self) -> bool:
        """Whether statics cannot give every joint force: more unknowns than equations."""
        square = all(2 * len(g.closures) == len(g.angles) + len(g.slides) for g in self.plan.groups)
        every = all(side in self.recipes for sides in self.sides.values() for side in sides)
        several = any(
            len(meshes) > 1 and self.mechanism.driver_of(guide) is None
            for guide, meshes in self.racks.items()
        )
        return (
            several or not square or not every or self.couples[1] is None or bool(self.plan.blocks.redundant)
        )

    def is_pushed(self, guide: int) -> bool:
        """Whether another part than the rail pushes along a guide: an input, a cam, or the teeth of a wheel that has a bearing."""
        driven = self.mechanism.driver_of(guide) is not None
        cam = any(drive.guide == guide for drive in self.mechanism.cam_drives)
        return driven or cam or any(self.meshing(mesh) is not None for mesh in self.racks.get(guide, ()))

    def meshing(self, mesh: int) -> str | None:
        """Where the teeth of a rack's wheel act.

        The name of the pin on which the wheel turns on the body that carries the rack's guide; "" where the wheel rolls
        along a rack of that body; None where it is neither, and the tooth force is taken to act along the guide.
        """
        of = self.mechanism.meshes[mesh]
        assert of.guide is not None
        g = self.mechanism.guides[of.guide]
        if of.wheel == g.link:
            return ""
        wheel, carrier = self.mechanism.bodies[of.wheel], self.mechanism.bodies[g.on]
        return next((name for name in wheel if name in carrier), None)

    def couple(self, kind: str, i: int) -> dict[str, Any]:
        """How the torque of a guide, a gear or an input follows from what the bodies' ΣM leaves: body -> factor."""
        unknowns, factors = self.couples
        if factors is None:
            raise MechanismError("the torques of its guides are not determined by statics")
        return factors[unknowns.index((kind, i))]


def left_inverse(pattern: list[list[Any]]) -> list[list[Any]] | None:
    """A left inverse that uses as few rows as there are columns, by Gauss and Jordan; None where there is none.

    Its numbers are floats, or constants that vary: a pivot is chosen by the number.

    Examples
    --------
    >>> left_inverse([[1.0, -2.0], [0.0, 4.0], [0.0, 1.0]])
    [[1.0, 0.5, 0.0], [0.0, 0.25, 0.0]]
    """
    n, k = len(pattern), len(pattern[0]) if pattern else 0
    # columns are combined until each has one of the chosen rows to itself; below them, how
    columns = [[*(row[c] for row in pattern), *(float(c == d) for d in range(k))] for c in range(k)]
    chosen: dict[int, int] = {}
    while len(chosen) < k:
        free = [c for c in range(k) if c not in chosen.values()]
        left = [(i, c) for i in range(n) if i not in chosen for c in free if columns[c][i]]
        row, pivot = max(left, key=lambda at: _size(columns[at[1]][at[0]]), default=(-1, 0))
        if row < 0 or not _size(columns[pivot][row]) > 1e-12:
            return None
        chosen[row] = pivot
        own = columns[pivot] = [v / columns[pivot][row] if v else 0.0 for v in columns[pivot]]
        for c in range(k):
            share = columns[c][row]
            if c != pivot and share:
                columns[c] = [v - share * w if w else v for v, w in zip(columns[c], own, strict=True)]
                columns[c][row] = 0.0
    return [[columns[chosen[i]][n + d] if i in chosen else 0.0 for i in range(n)] for d in range(k)]


def _size(number: Any) -> float:
    return abs(complex(number))
