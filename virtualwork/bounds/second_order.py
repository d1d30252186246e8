"""The errors of unknowns that an iteration found, and the second order near a limit.

Close to a limit of the input the second order counts. With f = h² − c for the loop, c uncertain by κ, h = √c, and
τ = κ/2h² the ratio of the second-order step to the first, h^(1−2k) changes by no more than

    ((1 − 2τ)^(1/2 − k) − 1)/((2k − 1)τ)    times what the first order says;

from τ = 1/2 on the pose may lie on the limit itself: its position errs by no more than √κ = √(2/τ) times the first
order, and of its rates no digit is known.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.numbers import Reals, stack
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.positions import State, columns, ratio
from virtualwork.plan.steps import Group

# a singular value is not taken for smaller: the second order decides there, and does not see it
FLOOR = 1e-13
# a share of the second order in the first that adds nothing
FAR = 8e-13


@dataclass(frozen=True)
class Solution:
    """How wrong the unknowns of a group may be: J⁻¹ times what its loops leave open.

    Attributes
    ----------
    inverse : array (n, unknowns, 2·loops)
        Close to a limit larger or smaller than J⁻¹, as the second order has it.
    tau : array (n,)
        The second-order step as a share of the first.
    """

    inverse: Reals
    tau: Reals


def solution(group: Group, poses: Poses, residual: Reals) -> Solution:
    """How wrong the unknowns of a group may be, from what its loops leave open, (n, 2·loops)."""
    plan = poses.plan
    poses.solve([*plan.writes(group), *plan.reads(group)], 0)
    scale = np.array([1 / poses.mechanism.size] * len(group.angles) + [1.0] * len(group.slides))
    moved, tau = np.empty((poses.n, len(scale), residual.shape[1])), np.empty(poses.n)
    with np.errstate(all="ignore"):
        for rows, st in poses.rows():
            jacobian = stack(columns(group, st), rows.stop - rows.start)
            back = inverse(jacobian * scale)
            first = (np.abs(back) @ residual[rows, :, None])[..., 0]
            high, low = _second(group, st, back, first, scale)
            moved[rows] = back * (scale * kept(high, low))[..., None]
            tau[rows] = high.max(axis=1, initial=0.0)
    return Solution(moved, tau)


def _second(group: Group, st: State, back: Reals, first: Reals, scale: Reals) -> tuple[Reals, Reals]:
    """The second-order step of every unknown as a share of its first: no less than it is, and no more, (n, unknowns).

    No less: all terms of the second order by their sizes. No more: with their signs, for a step in the direction
    in which J is weakest.
    """
    weak = np.argmax(np.square(back).sum(axis=1), axis=1)
    step = np.take_along_axis(back, weak[:, None, None], axis=2)[..., 0]
    step *= np.min(first / np.maximum(np.abs(step), 1e-300), axis=1, initial=np.inf)[:, None]
    parts: list[Reals] = []
    for move in (first * scale, step * scale):
        sized = not parts
        bent = np.zeros((len(first), len(group.closures)), complex)
        for i, closure in enumerate(group.closures):
            for t in closure.terms:
                shares = [ratio(group, t.body, angle) for angle in group.angles]
                turned: Any = sum((abs(r) if sized else r) * move[:, c] for c, r in enumerate(shares) if r)
                bare = t.z * (1.0 if t.body == GROUND else st.turn[t.body])
                value = bare if t.slide is None else bare * st.slide[t.slide]
                along: Any = 0.0
                if t.slide in group.slides:
                    along = 2j * bare * move[:, len(group.angles) + group.slides.index(t.slide)] * turned
                curve = value * turned**2
                bent[:, i] += np.abs(curve) + np.abs(along) if sized else along - curve
        pairs = np.repeat(np.abs(bent), 2, axis=1) if sized else bent.view(float)
        second = np.abs((np.abs(back) if sized else back) @ pairs[..., None])[..., 0]
        parts.append(np.divide(second, first, out=np.zeros_like(second), where=first > 0))
    return parts[0], parts[1]


def kept(high: Reals, low: Reals) -> Reals:
    """How much more than the first order a position errs: within a limit's rounding √κ in all.

    That is taken twice, for the third order and the root's own rounding.
    """
    # (1 − √(1 − 2τ))/τ without cancellation
    near = 2 / (1 + np.sqrt(np.maximum(1 - 2 * high, 0.0)))
    return np.where(high < 0.5, near, 2 * np.minimum(2.0, np.sqrt(2 / np.maximum(low, 0.5))))


def grown(tau: Reals, k: float) -> Reals:
    """How much more than the first order a derivative errs, where the second-order step is a share τ of the first.

    τ is taken a quarter larger, for the third order. One number where no pose is near a limit.
    """
    tau = np.asarray(tau)
    near = ~(tau < FAR)
    if not near.any():
        return np.ones(())
    found, tau = np.ones(tau.shape), 1.25 * tau[near]
    more = np.expm1((0.5 - k) * np.log1p(-2 * tau)) / ((2 * k - 1) * tau)
    found[near] = np.where(tau < 0.5, more, np.inf)
    return found


def inverse(j: Reals) -> Reals:
    """J⁻¹ (of least squares with redundant loops); a singular value below FLOOR of the largest is taken as FLOOR."""
    out = np.full((len(j), j.shape[2], j.shape[1]), np.nan)
    good: Any = np.isfinite(j).all(axis=(1, 2))
    if j.shape[1] == j.shape[2]:
        try:
            out[good] = np.linalg.inv(j[good])
        except np.linalg.LinAlgError:
            out[good] = np.nan
        with np.errstate(invalid="ignore"):
            size = np.abs(out).max(axis=(1, 2), initial=0.0) * np.abs(j).max(axis=(1, 2), initial=0.0)
        good = good & ~(size < 0.1 / FLOOR)
    if good.any():
        left, s, right = np.linalg.svd(j[good], full_matrices=False)
        s = np.maximum(s, FLOOR * s[:, :1])
        out[good] = np.swapaxes(right, 1, 2) @ (np.swapaxes(left, 1, 2) / s[..., None])
    return out
