"""What the estimates of rounding errors are made of: sizes of rates, inverses, and the second order near a limit.

Close to a limit of the input the second order counts. With f = h² − c for the loop, c uncertain by κ, h = √c, and
τ = κ/2h² the ratio of the second-order step to the first, h^(1−2k) changes by no more than

    ((1 − 2τ)^(1/2 − k) − 1)/((2k − 1)τ)    times what the first order says;

from τ = 1/2 on the pose may lie on the limit itself: its position errs by no more than √κ = √(2/τ) times the first
order, and of its rates no digit is known.
"""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.rates import Rates
from virtualwork.plan.steps import Term

# a singular value is not taken for smaller: the second order decides there, and does not see it
FLOOR = 1e-13


class Sizes:
    """The sizes of rates: every product by the sizes of its factors, every sum without cancellation."""

    def __init__(self, rates: Rates) -> None:
        self.along = rates
        self._turn: dict[str, list[Any]] = {}

    def turn(self, body: str, k: int) -> Any:
        """Of the k-th derivative of e^{iθ}."""
        if k == 0:
            return 1.0
        if body == GROUND:
            return 0.0
        known = self._turn.setdefault(body, [1.0])
        rates = self.along.angle[body]
        while len(known) <= k:
            m = len(known)
            known.append(sum(comb(m - 1, j) * np.abs(rates[j]) * known[m - 1 - j] for j in range(m)))
        return known[k]

    def term(self, t: Term, k: int) -> Any:
        """Of the k-th derivative of z·s·e^{iθ}."""
        if t.slide is None:
            return abs(t.z) * self.turn(t.body, k)
        s = [self.along.st.slide[t.slide], *self.along.slide[t.slide]]
        return abs(t.z) * sum(comb(k, j) * np.abs(s[j]) * self.turn(t.body, k - j) for j in range(k + 1))


def value_of(rates: Rates, t: Term, k: int) -> Any:
    """The k-th derivative of a term."""
    value = rates.vector((None, (t,)), k)
    return 0.0 if value is None else value


def sum_of(rates: Rates, terms: tuple[Term, ...], k: int) -> Any:
    """The k-th derivative of a sum of terms."""
    value = rates.vector((None, terms), k)
    return 0.0 if value is None else value


def kept(high: Reals, low: Reals) -> Reals:
    """How much more than the first order a position errs: within a limit's rounding √κ in all.

    That is taken twice, for the third order and the root's own rounding.
    """
    # (1 − √(1 − 2τ))/τ without cancellation
    near = 2 / (1 + np.sqrt(np.maximum(1 - 2 * high, 0.0)))
    return np.where(high < 0.5, near, 2 * np.minimum(2.0, np.sqrt(2 / np.maximum(low, 0.5))))


def grown(tau: Reals, k: int) -> Reals:
    """How much more than the first order a derivative errs, where the second-order step is a share τ of the first.

    τ is taken a quarter larger, for the third order.
    """
    tau = 1.25 * tau
    grown = np.expm1((0.5 - k) * np.log1p(-2 * tau)) / ((2 * k - 1) * np.maximum(tau, 1e-30))
    return np.where(tau < 1e-12, 1.0, np.where(tau < 0.5, grown, np.inf))


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
            size = np.abs(out).max(axis=(1, 2)) * np.abs(j).max(axis=(1, 2))
        good = good & ~(size < 0.1 / FLOOR)
    if good.any():
        left, s, right = np.linalg.svd(j[good], full_matrices=False)
        s = np.maximum(s, FLOOR * s[:, :1])
        out[good] = np.swapaxes(right, 1, 2) @ (np.swapaxes(left, 1, 2) / s[..., None])
    return out
