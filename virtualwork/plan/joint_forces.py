"""In which order joint forces follow from each other: multipliers of loops, balances of bodies and pins."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualwork.describe.description import Description
from virtualwork.describe.errors import MechanismError
from virtualwork.describe.parts import GROUND
from virtualwork.plan.joints import Joint, joints, relations
from virtualwork.plan.steps import Group, Plan

Reals = NDArray[np.float64]
# the force of a joint on a body, (joint, body); a joint is "pin:B" or "guide:0"
Side = tuple[str, str]


class Order:
    """How each joint force is found: as a multiplier of a loop, or from the balance of a body or a pin."""

    def __init__(self, mechanism: Description, plan: Plan) -> None:
        self.mechanism, self.plan = mechanism, plan
        self.joints = joints(mechanism)
        self.by_key = {joint.key: joint for joint in self.joints}

    @cached_property
    def pairs(self) -> list[tuple[Joint, str, str]]:
        """Every joint force once, as (joint, on, from): of two bodies on the later, of more on each from the pin."""
        found: list[tuple[Joint, str, str]] = []
        for joint in self.joints:
            if len(joint.bodies) == 2:
                found.append((joint, joint.bodies[1], joint.bodies[0]))
            else:
                found += [(joint, body, "pin") for body in joint.bodies if body != GROUND]
        return found

    @cached_property
    def multipliers(self) -> dict[Side, tuple[Group, int]]:
        """Which joint forces are multipliers of a loop: (joint, body) -> (group, loop)."""
        found: dict[Side, tuple[Group, int]] = {}
        for group in self.plan.groups:
            for c, closure in enumerate(group.closures):
                key = f"pin:{closure.joint}" if closure.guide is None else f"guide:{closure.guide}"
                found[key, closure.body] = group, c
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

        for relation in sorted(relations(self.mechanism), key=lambda r: r.kind == "input"):
            column = np.zeros(len(bodies))
            for body, factor in relation.shares.items():
                if body != GROUND:
                    # of a ratio that varies, its number
                    column[bodies.index(body)] += complex(factor).real
            unknowns.append((relation.kind, relation.number))
            columns_.append(column)
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

    def couple(self, kind: str, i: int) -> dict[str, float]:
        """How the torque of a guide, a gear or an input follows from what the bodies' ΣM leaves: body -> factor."""
        unknowns, _, inverse = self.couples
        if inverse is None:
            raise MechanismError("the torques of its guides are not determined by statics")
        row = inverse[unknowns.index((kind, i))]
        return {body: float(f) for body, f in zip(self.mechanism.links, row, strict=True) if f}
