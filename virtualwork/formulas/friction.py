"""Coulomb friction in pins and guides: loads that hang on the reactions they change, found by iteration.

A pin of radius r with the reaction R resists its relative turning with μ r |R|; a guide resists sliding with μ |N|,
N normal to it (Norton, Design of Machinery, §11.9 names the model; the iteration starts without friction). Where
nothing slides there is no friction: its value at rest is not determined, only bounded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from virtualwork.formulas.numbers import Number, dot, minus, times
from virtualwork.formulas.reactions import Reactions
from virtualwork.formulas.scene import Scene

# iterations; each gains a factor of some μ r / l
LIMIT = 200
# relative change at which a pose has converged
CLOSE = 1e-14


def settle(scene: Scene) -> tuple[int, NDArray[np.bool_]]:
    """Iterate friction and reactions until neither changes.

    Returns
    -------
    iterations : int
    converged : array (n,) of bool
        Where False the joints lock: no motion at this speed and coefficient is in equilibrium.
    """
    n = scene.poses.n
    converged = np.zeros(n, dtype=bool)
    count = 0
    reactions = Reactions(scene)
    while count < LIMIT:
        count += 1
        converged[:] = True
        _anew(reactions)
        for block in reactions.blocks():
            change: Number = 0.0
            scale: Number = 0.0
            fresh: dict[int, Number] = {}
            for number, (joint, body, other, coefficient, radius) in enumerate(scene.case.contacts):
                force = reactions.on_side(block, (joint.key, body))
                if force is None:
                    continue
                if joint.guide is None:
                    rate = minus(block.omega(body), block.omega(other))
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
        if (converged | ~scene.poses.assembled).all():
            break
    _anew(reactions)
    scene.formed.clear()
    return count, converged


def _anew(reactions: Reactions) -> None:
    """Forget what was formed with the friction before."""
    reactions.scene.setting.drive = None
    for block in reactions.scene.blocks(reactions.keys):
        block.forget()
