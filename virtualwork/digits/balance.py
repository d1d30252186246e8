"""Positions of rest in 32 digits: by Newton's method on the generalized forces; mass, stiffness and potential there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.doubled_arrays import DoubledArray
from dalembert.arithmetic.engines.doubled import LAST, OWN
from virtualwork.digits.second_run import STEPS, SecondRun
from virtualwork.formulas.at_rest import Mass, Potential, Stiffness
from virtualwork.formulas.forces import Generalized
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.quantity import Quantity

# a step, of the way so far, that changes no digit of an estimate
SETTLED = 2.0**-20


class Balance:
    """The position without effort next to one pose at rest, in 32 digits.

    Attributes
    ----------
    off, unknown : array (k,)
        The way of each input to it, and what may be unknown of that way. Infinite where Newton's method does not settle: the stiffness
        vanishes.

    Parameters
    ----------
    stiffness : array (k, k)
        The derivative of the effort, in 16 digits.
    """

    def __init__(self, poses: Lanes, stiffness: Reals) -> None:
        self.poses, self.k = poses, len(stiffness)
        self.off, self.unknown = self._newton(stiffness)
        self.settled = bool(np.isfinite(self.off).all())

    def _newton(self, stiffness: Reals) -> tuple[Reals, Reals]:
        poses, keys = self.poses, [Generalized(j) for j in range(self.k)]
        off, way, unsettled = np.zeros(self.k), np.inf, np.full(self.k, np.inf)
        least = LAST * max(1.0, poses.mechanism.size, float(np.abs(poses.inputs).max()))
        if poses.branch.folded or not np.isfinite(stiffness).all():
            return unsettled, unsettled
        for _ in range(STEPS):
            run = SecondRun(poses, off[None])
            forces = run.doubled(keys)
            effort = np.array([float(np.squeeze(forces[key][0].value)) for key in keys])
            try:
                step = np.linalg.solve(stiffness, -effort)
                uncertain = [np.sum([x[0] for x in run.uncertain(key)]) for key in keys]
                moved = np.abs(np.linalg.inv(stiffness)) @ uncertain
            except np.linalg.LinAlgError:
                break
            before, way = way, float(np.abs(step).max())
            off = off + step
            if way <= max(SETTLED * float(np.abs(off).max()), least):
                return off, moved
            if not way < 0.5 * before:
                break
        return unsettled, unsettled

    @property
    def input_errors(self) -> Reals:
        """The estimate of each input's error, (k,)."""
        return np.asarray(OWN * (np.abs(self.off) + self.unknown) + LAST * np.abs(self.poses.inputs[0]))

    def potential_error(self, potential: float) -> float:
        """The estimate of the potential's error."""
        if not self.settled:
            return np.inf
        exact, unknown = self._values([Potential()])
        return float(_error(DoubledArray(potential), exact[0], unknown[0]))

    def stiffness_error(self, least: float, stiffness: Reals) -> float:
        """The estimate of the error of the smallest eigenvalue of the stiffness."""
        if not self.settled:
            return np.inf
        vectors = np.linalg.eigh(stiffness)[1]
        one = DoubledArray(np.eye(self.k)), np.zeros((self.k, self.k))
        exact, unknown = _eigenvalues(self._matrix(Stiffness), one, vectors)
        return float(_error(DoubledArray(least), exact[0], unknown[0]))

    def period_errors(self, periods: Reals, vectors: Reals) -> Reals:
        """The estimates of the errors of periods, with the shapes of the oscillations in the columns of `vectors`."""
        if not self.settled:
            return np.full(len(periods), np.inf)
        squares, unknown = _eigenvalues(self._matrix(Mass), self._matrix(Stiffness), vectors)
        swings = slice(len(periods))
        exact = 2 * np.pi * np.sqrt(squares[swings])
        share = unknown[swings] / squares.value[swings]
        return np.asarray(_error(DoubledArray(periods), exact, 0.5 * share * periods))

    def _matrix(self, kind: type[Mass | Stiffness]) -> tuple[DoubledArray, Reals]:
        """A symmetric matrix (k, k), and what is unknown of its entries."""
        pairs = [(max(i, j), min(i, j)) for i in range(self.k) for j in range(self.k)]
        values, unknown = self._values([kind(i, j) for i, j in pairs])
        return values.reshape(self.k, self.k), unknown.reshape(self.k, self.k)

    def _values(self, keys: Sequence[Quantity]) -> tuple[DoubledArray, Reals]:
        """Quantities at the position without effort, and how far they move with what is unknown."""
        distinct = list(dict.fromkeys(keys))
        run = SecondRun(self.poses, self.off[None])
        here = run.doubled(distinct)
        unknown = {key: float(np.sum([x[0] for x in run.uncertain(key)])) for key in distinct}
        for j in np.flatnonzero(self.unknown):
            beside = self.off.copy()
            beside[j] += self.unknown[j]
            there = SecondRun(self.poses, beside[None]).doubled(distinct)
            for key in distinct:
                unknown[key] += abs(float(np.squeeze((there[key][0] - here[key][0]).value)))
        numbers = [_number(here[key][0]) for key in keys]
        high, low = ([float(np.squeeze(part)) for part in parts] for parts in zip(*numbers, strict=True))
        return DoubledArray(high, low), np.array([unknown[key] for key in keys])


def _number(x: Doubled) -> tuple[Any, Any]:
    return x.high, x.low


def _error(value: DoubledArray, exact: Any, unknown: Any) -> Any:
    """How far a value lies from its second run, with what is unknown of that."""
    return OWN * (np.abs((value - exact).value) + unknown) + LAST * np.abs(value.value)


def _eigenvalues(
    first: tuple[DoubledArray, Reals], second: tuple[DoubledArray, Reals], vectors: Reals
) -> tuple[DoubledArray, Reals]:
    """The eigenvalues μ of A x = μ B x in 32 digits, (k,), and what is unknown of them, from eigenvectors in 16 digits.

    Rayleigh's quotient is off by e² / gap and by e at most, with the e that each other vector leaves in the residual (B. N. Parlett, The
    Symmetric Eigenvalue Problem, ch. 11).
    """
    x = DoubledArray(vectors)
    a, b = (x.T @ matrix @ x for matrix, _ in (first, second))
    k = range(len(vectors.T))
    numerator = DoubledArray([a.high[i, i] for i in k], [a.low[i, i] for i in k])
    denominator = DoubledArray([b.high[i, i] for i in k], [b.low[i, i] for i in k])
    values = numerator / denominator
    rough, size = values.value, np.sqrt(np.abs(denominator.value))
    scaled = (a - b * values).value / (size[:, None] * size)
    rest = np.abs(scaled - np.diag(np.diag(scaled)))
    with np.errstate(divide="ignore", invalid="ignore"):
        gaps = np.abs(rough[:, None] - rough)
        coupled = np.where(rest > 0, np.minimum(rest, rest * rest / gaps), 0.0).sum(axis=0)
    absolute = np.abs(vectors)
    moved = [np.diag(absolute.T @ unknown @ absolute) for _, unknown in (first, second)]
    return values, coupled + (moved[0] + np.abs(rough) * moved[1]) / (size * size)
