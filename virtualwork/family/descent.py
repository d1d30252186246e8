"""Residuals of a fit and their derivatives to the dimensions alone: inputs that are free follow the dimensions.

At given dimensions every free input is the one at which its pose comes nearest, found by Gauss and Newton's step from where
it was. What is left has the derivatives of the residuals less their part along the path (variable projection: G. H.
Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; with L. Kaufman's shorter Jacobian, BIT 15 (1975) 49). With inputs
and dimensions unknown side by side the same search creeps along a curved valley.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from virtualwork.family.design import Design
from virtualwork.family.target import Aim
from virtualwork.formulas.numbers import Reals

# of the mechanism's size, or rad: how far a pose that cannot be assembled counts as away
AWAY = 10.0
# steps of the inputs at most, the longest of them, and the one that is the last: rad, or of the mechanism's size
STEPS, LONGEST, SHORTEST = 12, 0.1, 1e-8


class _Here(NamedTuple):
    """Residuals, their derivatives, and the inputs, at some dimensions."""

    residuals: Reals
    jacobian: Reals
    inputs: list[Reals]


class Descent:
    """One way down from one start.

    Parameters
    ----------
    aims, designs : sequences
        The targets, and what is asked of a design for each.
    values : callable
        The dimensions of shares.
    width : array (d,)
        Of the bounds: the derivative of that.
    inputs : sequence of array
        Of each target; those that are free begin there.
    """

    def __init__(
        self,
        aims: Sequence[Aim],
        designs: Sequence[Design],
        values: Callable[[Reals], Reals],
        width: Reals,
        inputs: Sequence[Reals],
    ) -> None:
        self.aims, self.designs, self.values, self.width = aims, designs, values, width
        self.inputs = list(inputs)
        self._last: tuple[bytes, _Here] | None = None

    def residuals(self, x: Reals) -> Reals:
        """How far every row of every target is off, weighted."""
        return self.at(x).residuals

    def jacobian(self, x: Reals) -> Reals:
        """Its derivatives to the shares."""
        return self.at(x).jacobian

    def at(self, x: Reals) -> _Here:
        """All of it; the last is kept."""
        name = x.tobytes()
        if self._last is None or self._last[0] != name:
            self._last = name, self._found(self.values(x))
        return self._last[1]

    def _found(self, values: Reals) -> _Here:
        d = len(values)
        off, slopes, inputs = [], [], []
        for i, (aim, design) in enumerate(zip(self.aims, self.designs, strict=True)):
            q = self.inputs[i]
            if aim.inputs is None:
                q = self.inputs[i] = self._followed(aim, design, values, q)
            apart = aim.apart(design(values, q))
            slope = design.slopes(values, q) * aim.scale[..., None]
            there = slope[..., :d] * self.width
            if aim.inputs is None:
                along = slope[..., d]
                with np.errstate(invalid="ignore", divide="ignore"):
                    part = (along[..., None] * there).sum(axis=0) / (along**2).sum(axis=0)[:, None]
                # where the path stands still there is nothing to take away
                there = there - along[..., None] * np.where(np.isfinite(part), part, 0.0)
            off.append(np.where(np.isfinite(apart), apart, AWAY).ravel())
            slopes.append(np.where(np.isfinite(there), there, 0.0).reshape(-1, d))
            inputs.append(q)
        return _Here(np.concatenate(off), np.concatenate(slopes), inputs)

    @staticmethod
    def _followed(aim: Aim, design: Design, values: Reals, q: Reals) -> Reals:
        """The inputs at which the poses come nearest."""
        m = design.mechanism
        unit = m.size if m.inputs[0].is_slide else 1.0
        for _ in range(STEPS):
            apart = aim.apart(design(values, q))
            along = design.slopes(values, q, inputs_alone=True)[..., -1] * aim.scale
            with np.errstate(invalid="ignore", divide="ignore"):
                step = -(apart * along).sum(axis=0) / (along**2).sum(axis=0)
            step = np.clip(np.where(np.isfinite(step), step, 0.0), -LONGEST * unit, LONGEST * unit)
            q = q + step
            if np.abs(step).max() < SHORTEST * unit:
                break
        return q
