"""Coulomb friction in pins and guides: loads that hang on the reactions they change, found by iteration.

A pin of radius r with the reaction R resists its relative turning with μ r |R|; a guide resists sliding with μ |N|,
N normal to it (Norton, Design of Machinery, §11.9 names the model; the iteration starts without friction). Where
nothing slides there is no friction: its value at rest is not determined, only bounded.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from virtualwork.describe.errors import DescriptionError
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.closed_forms import Number, dot
from virtualwork.formulas.loads import Acting, Rub, plus, times
from virtualwork.formulas.reactions import Reactions
from virtualwork.formulas.scene import Scene
from virtualwork.joints import Joint, joints
from virtualwork.plan.steps import Term, combined

if TYPE_CHECKING:
    from numpy.typing import NDArray

LIMIT = 200  # iterations; each gains a factor of some μ r / l
CLOSE = 1e-14  # relative change at which a pose has converged


def pairs(scene: Scene | Acting) -> list[tuple[Joint, str, str, float, float]]:
    """What rubs: (joint, body, the body it rubs on, coefficient, radius)."""
    found = []
    known = joints(scene.mechanism)
    for i, entry in enumerate(scene.mechanism.friction, 1):
        here = [joint for joint in known if joint.name == entry.joint]
        if not here:
            raise DescriptionError(
                f"[[friction]] {i} joint: '{entry.joint}' is no joint: nothing is pinned or guided there"
            )
        for joint in here:
            if joint.guide is not None:
                g = scene.mechanism.guides[joint.guide]
                found.append((joint, g.link, g.on, entry.coefficient, entry.radius))
            elif entry.radius or len(here) == 1:
                first, *others = joint.bodies
                found += [(joint, body, first, entry.coefficient, entry.radius) for body in others]
    return found


def loads(scene: Acting) -> list[Rub]:
    """The friction loads of a scene, each pair's two sides."""
    found: list[Rub] = []
    m = scene.mechanism
    for number, (joint, body, other, _, _) in enumerate(pairs(scene)):
        if joint.guide is None:
            found.append(Rub("friction", body, None, 0j, joint.key, number, 1.0))
            if other != GROUND:
                found.append(Rub("friction", other, None, 0j, joint.key, number, -1.0))
            continue
        g = m.guides[joint.guide]
        if body != GROUND:
            z = m.links[body].points[g.point]
            found.append(Rub("friction", body, scene.path(body, z), z, joint.key, number, 1.0, joint.guide))
        if other != GROUND:
            through = m.bodies[other][g.through] if isinstance(g.through, str) else g.through
            base, terms = scene.path(other, through)
            rail = Term(scene.plan.directions[joint.guide], other, joint.guide)
            path = base, combined((*terms, rail))
            found.append(Rub("friction", other, path, through, joint.key, number, -1.0, joint.guide))
    return found


def settle(scene: Scene) -> tuple[int, NDArray[np.bool_]]:
    """Iterate friction and reactions until neither changes.

    Returns
    -------
    iterations : int
    converged : array (n,) of bool
        Where False the joints lock: no motion at this speed and coefficient is in equilibrium.
    """
    n = scene.motion.n
    rubbing = pairs(scene)
    converged = np.zeros(n, dtype=bool)
    count = 0
    reactions = Reactions(scene)
    while count < LIMIT:
        count += 1
        converged[:] = True
        scene.__dict__.pop("drive", None)
        for block in reactions.blocks():
            block.forget()
            change: Number = 0.0
            scale: Number = 0.0
            fresh: dict[int, Number] = {}
            for number, (joint, body, other, coefficient, radius) in enumerate(rubbing):
                force = reactions.on_side(block, (joint.key, body))
                if force is None:
                    continue
                if joint.guide is None:
                    rate = plus(block.omega(body), times(block.omega(other), -1.0))
                    value = times(-coefficient * radius * abs(force), None if rate is None else np.sign(rate))
                else:
                    rail = reactions.rail(block, joint.guide)
                    rate = block.slide_rate(joint.guide)
                    normal = abs(dot(force, 1j * rail))
                    value = times(-coefficient * normal * rail, None if rate is None else np.sign(rate))
                if value is None:
                    continue
                fresh[number] = value
                before = block.friction.get(number, 0.0)
                change = np.maximum(change, abs(value - before) / np.where(value == 0, 1.0, abs(value)))
                scale = np.maximum(scale, abs(value))
            block.friction.clear()
            block.friction.update(fresh)
            converged[block.rows] = ~(change > CLOSE * 8) & np.isfinite(scale)
        if (converged | ~scene.motion.assembled).all():
            break
    for block in reactions.blocks():
        block.forget()
    scene.__dict__.pop("drive", None)
    scene.formed.clear()
    return count, converged
