"""How far a position lies from where a mechanism rests: by Newton's method on the generalized forces in 32 digits."""

from __future__ import annotations

import numpy as np

from dalembert.arithmetic.engines.doubled import LAST
from virtualwork.digits.second_run import STEPS, SecondRun
from virtualwork.formulas.forces import Generalized
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import Reals

# a step, of the way so far, that changes no digit of an estimate
SETTLED = 2.0**-20


def off_balance(poses: Lanes, stiffness: Reals) -> Reals:
    """The way of each input (k,) from one pose at rest to the one without effort, and what may be unknown of it.

    `stiffness` (k, k): the derivative of the effort, in 16 digits. Infinite where the method does not settle: the stiffness vanishes.
    """
    keys = [Generalized(j) for j in range(len(stiffness))]
    off, way = np.zeros(len(stiffness)), np.inf
    least = LAST * max(1.0, poses.mechanism.size, float(np.abs(poses.inputs).max()))
    if poses.branch.folded or not np.isfinite(stiffness).all():
        return np.full(len(off), np.inf)
    for _ in range(STEPS):
        run = SecondRun(poses, off[None])
        found = run.doubled(keys)
        effort = np.array([float(np.squeeze(found[key][0].value)) for key in keys])
        try:
            step = np.linalg.solve(stiffness, -effort)
            unknown = [np.sum([x[0] for x in run.uncertain(key)]) for key in keys]
            moved = np.abs(np.linalg.inv(stiffness)) @ unknown
        except np.linalg.LinAlgError:
            break
        before, way = way, float(np.abs(step).max())
        off = off + step
        if way <= max(SETTLED * float(np.abs(off).max()), least):
            return np.asarray(np.abs(off) + moved)
        if not way < 0.5 * before:
            break
    return np.full(len(off), np.inf)
