"""The search of a fit: where it begins, and one way down from there.

It begins at points of a low-discrepancy sequence, and where inputs are free at those of a coarse sweep at which the poses
come near the rows of a target in their order. On the way down free inputs follow the dimensions: at given dimensions every
one is where its pose comes nearest, found by Gauss and Newton's step from where it was. What is left has the derivatives
of the residuals less their part along the path (variable projection: G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10
(1973) 413; with L. Kaufman's shorter Jacobian, BIT 15 (1975) 49). With inputs and dimensions unknown side by side the same
search creeps along a curved valley.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from virtualwork.family.design import Design
from virtualwork.family.keep import Held
from virtualwork.family.target import Aim
from virtualwork.formulas.numbers import Reals

# poses of the coarse sweep
COARSE = 120
# of those, the nearest ones to the first row with which an order may begin
FIRSTS = 24
# rad: inputs that are one
EQUAL = 1e-9
# steps of the inputs at most, the longest of them, and the one that is the last: rad, or of the mechanism's size
STEPS, LONGEST, SHORTEST = 12, 0.1, 1e-8


# --- where it begins --------------------------------------------------------------------------------------------
def shares(own: Reals, count: int, seed: int) -> Reals:
    """Places between the bounds, 0 to 1, (count, d): the file's own, as near as the bounds let them, then Sobol's."""
    from scipy.stats import qmc

    drawn = qmc.Sobol(len(own), seed=seed).random_base2(max(0, int(np.ceil(np.log2(max(count, 1))))))
    return np.vstack([np.clip(own, 0.0, 1.0), drawn])[:count]


def along(away: Reals, q: Reals, turning: bool) -> list[tuple[float, Reals]]:
    """The inputs (n,) of places that meet a target's rows in their order, either way round, with what is left.

    Parameters
    ----------
    away : array (poses, n)
        How far each pose is from each row, squared.
    q : array (poses,)
        Evenly spaced; of a turning input over a whole turn.
    """
    span = len(q) * float(q[1] - q[0])
    result = []
    for sense in (1, -1):
        cost, places = _in_order(away[::sense], turning)
        # past the end of the turn the input goes on
        turns, k = np.divmod(places, len(q))
        result.append((cost, q[::sense][k] + sense * turns * span))
    return sorted(result, key=lambda each: each[0])


def _in_order(away: Reals, cyclic: bool) -> tuple[float, NDArray[np.intp]]:
    """Which pose goes to which row, (n,), so that poses never go back and Σ away (poses, n) is least.

    Around a turn any pose near the first row may be the first, and poses past the last go on from the first.

    >>> _in_order(np.array([[9.0, 0.0], [0.0, 9.0], [4.0, 4.0]]), True)
    (0.0, array([1, 3]))
    """
    m, n = away.shape
    firsts = np.argsort(away[:, 0], kind="stable")[:FIRSTS] if cyclic else np.zeros(1, dtype=int)
    around = (firsts[:, None] + np.arange(m)) % m
    total = away[around, 0].copy()
    if cyclic:
        total[:, 1:] = np.inf
    before = []
    for j in range(1, n):
        least = np.minimum.accumulate(total, axis=1)
        # where the least so far was
        here = np.where(total == least, np.arange(m), 0)
        before.append(np.maximum.accumulate(here, axis=1))
        total = least + away[around, j]
    first, k = np.unravel_index(np.argmin(total), total.shape)
    cost = float(total[first, k])
    places = [int(k)]
    for back in reversed(before):
        places.append(int(back[first, places[-1]]))
    return cost, firsts[first] + np.array(places[::-1])


def in_turn(q: Reals, at: float) -> Reals:
    """Inputs a whole turn or more from others, one after the other within a turn, where that can be, and next to `at`.

    >>> in_turn(np.array([6.2, 0.1, 0.2]), 0.0)
    array([-0.08318531,  0.1       ,  0.2       ])
    """
    turn = 2 * np.pi
    steps = np.diff(q)
    if not ((steps >= 0).all() or (steps <= 0).all()):
        ways = []
        for sense in (1.0, -1.0):
            # a step back of a rounding is none around the turn
            on = (sense * steps + EQUAL) % turn - EQUAL
            ways.append((on.sum(), q[0] + sense * np.concatenate([[0.0], np.cumsum(on)])))
        travel, found = min(ways, key=lambda way: way[0])
        q = found if travel <= turn else q
    return np.asarray(q - turn * np.round((q[0] - at) / turn))


# --- the way down -----------------------------------------------------------------------------------------------
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
        The targets, and the request to a design for each.
    values : callable
        The dimensions of shares.
    width : array (d,)
        Of the bounds: the derivative of that.
    inputs : sequence of array
        Of each target; those that are free begin there.
    held : Held, optional
        What is kept: its rows stand below the residuals.
    """

    def __init__(
        self,
        aims: Sequence[Aim],
        designs: Sequence[Design],
        values: Callable[[Reals], Reals],
        width: Reals,
        inputs: Sequence[Reals],
        held: Held | None = None,
    ) -> None:
        self.aims, self.designs, self.values, self.width = aims, designs, values, width
        self.inputs, self.held = list(inputs), held
        self._last: tuple[bytes, _Here] | None = None

    def residuals(self, x: Reals) -> Reals:
        """Return the weighted distance of every row of every target."""
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
            apart = aim.counted(design(values, q))
            slope = design.slopes(values, q) * aim.scale[..., None]
            there = slope[..., :d] * self.width
            if aim.inputs is None:
                along = slope[..., d]
                with np.errstate(invalid="ignore", divide="ignore"):
                    part = (along[..., None] * there).sum(axis=0) / (along**2).sum(axis=0)[:, None]
                # where the path stands still there is nothing to take away
                there = there - along[..., None] * np.where(np.isfinite(part), part, 0.0)
            off.append(apart.ravel())
            slopes.append(np.where(np.isfinite(there), there, 0.0).reshape(-1, d))
            inputs.append(q)
        if self.held is not None:
            rows, slope = self.held.rows(values)
            off.append(rows)
            slopes.append(slope)
        return _Here(np.concatenate(off), np.concatenate(slopes), inputs)

    def forget(self) -> None:
        """The rows weigh otherwise from here on."""
        self._last = None

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
