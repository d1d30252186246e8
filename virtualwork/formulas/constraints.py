"""The constraints of all joints in the coordinates of all links: their Jacobian, for mobility by rank."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.numbers import Reals, dot
from virtualwork.formulas.positions import State
from virtualwork.plan.joints import joints, relations


def constraint_jacobian(m: Description, st: State) -> tuple[list[str], Reals]:
    """The Jacobian of every joint's constraints in the coordinates (θ, x, y) of each link, lengths over the size.

    Returns
    -------
    labels : list of str
        The joint of each row.
    jacobian : array (constraints, 3·links)
    """
    column = {link: 3 * i for i, link in enumerate(m.links)}
    tied = {(r.kind, r.number): r for r in relations(m)}
    labels: list[str] = []
    rows: list[Reals] = []

    def turned(body: str) -> complex:
        return complex(np.ravel(st.turn[body])[0])

    def point(label: str, parts: list[tuple[str, complex, float]], *normals: complex) -> None:
        """Σ sign·point = 0 along each normal; a point moves by i·z·e^{iθ}, 1, i with its body's θ, x, y."""
        for normal in normals:
            row = np.zeros(3 * len(column))
            for body, z, sign in parts:
                if body != GROUND:
                    for k, v in enumerate((1j * z * turned(body) / m.size, 1 + 0j, 1j)):
                        row[column[body] + k] += sign * dot(v, normal)
            labels.append(label)
            rows.append(row)

    def angles(kind: Literal["guide", "gear"], number: int) -> None:
        if (kind, number) in tied:
            row = np.zeros(3 * len(column))
            for body, share in tied[kind, number].shares.items():
                if body != GROUND:
                    row[column[body]] += share
            labels.append(tied[kind, number].label)
            rows.append(row)

    for joint in joints(m):
        if joint.guide is None:
            first, *others = joint.bodies
            for other in others:
                ends = [(body, m.bodies[body][joint.name], s) for body, s in ((first, 1.0), (other, -1.0))]
                point(joint.label, ends, 1 + 0j, 1j)
            continue
        g = m.guides[joint.guide]
        d = complex(math.cos(g.angle), math.sin(g.angle))
        place = m.through(g) + float(np.ravel(st.slide[joint.guide])[0]) * d
        ends = [(g.link, m.bodies[g.link][g.point], 1.0), (g.on, place, -1.0)]
        point(joint.label, ends, 1j * d * turned(g.on))
        angles("guide", joint.guide)
    for i in range(len(m.gears)):
        angles("gear", i)
    return labels, np.array(rows) if rows else np.zeros((0, 3 * len(column)))
