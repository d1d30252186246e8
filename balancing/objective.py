"""The objective of corrections: least squares or the least maximum, within limits; and their uncertainty under limits."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from balancing.balance import Balance, least_squares, minimax
from balancing.limited import Infeasible, NotConverged
from balancing.log_balance import LogBalance, spread

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

ROUNDED = 1 + 64 * float(np.finfo(float).eps)
"""A residual that is beyond its limit by less than this factor is so by rounding."""


@dataclass(frozen=True, eq=False)
class Objective:
    """The objective of the corrections of a machine.

    Examples
    --------
    >>> fix, beyond = Objective(max_mass=np.array([1.0])).solve(np.array([[2 + 0j]]), np.array([6 + 0j]), None)
    >>> fix.corrections.round(12), beyond
    (array([-1.+0.j]), False)
    """

    minimax: bool = False
    """Whether the largest residual is the least, or the sum of squares."""
    max_mass: Real | None = None
    """Limit of each plane, SI, (p,)."""
    max_residual: float | None = None
    ridge: float = 0.0

    @property
    def limited(self) -> bool:
        """Whether the corrections are others than those by plain least squares."""
        return self.minimax or self.max_mass is not None or self.max_residual is not None

    def drawn(self, draws: int | None) -> int:
        """Return how many sets of readings the covariance is drawn from; 0: it is of first order."""
        return min(draws or 200, 1000) if self.limited else draws or 0

    def met(self, fix: Balance) -> NDArray[np.bool_]:
        """Return which machines of corrections by plain least squares keep the limits, (g,)."""
        beyond = np.zeros(len(fix.corrections), dtype=bool)
        if self.max_mass is not None:
            beyond |= (np.abs(fix.corrections) > self.max_mass).any(axis=1)
        if self.max_residual is not None:
            beyond |= (np.abs(fix.residual) > self.max_residual).any(axis=1)
        return ~beyond

    def solve(self, alpha: Complex, here: Complex, weights: Real | None) -> tuple[Balance, bool]:
        """Return one machine's corrections, and whether it is the weights that leave a residual beyond the limit.

        By least squares they keep the limit whatever the weights.

        Raises
        ------
        Infeasible, NotConverged, DependentPlanes
        """
        if not self.minimax:
            masses, ceiling = self.max_mass, self.max_residual
            return least_squares(alpha, here, weights, max_mass=masses, max_residual=ceiling), False
        ceiling = self.max_residual
        fix = minimax(alpha, here, self.max_mass, weights=weights)
        if ceiling is None or float(fix.residual_max) <= ceiling * ROUNDED:
            return fix, False
        least = minimax(alpha, here, self.max_mass) if weights is not None else fix
        if float(least.residual_max) > ceiling * ROUNDED:
            raise Infeasible(float(least.residual_max) / ceiling, np.array([ceiling]))
        return fix, True

    def confidence(
        self, balance: LogBalance, corrections: Complex, standing: Complex, draws: int | None = None
    ) -> tuple[Real, float]:
        """Return the covariance of the corrections, (p, 2, 2), and what 95 % of the largest residuals stay below.

        Parameters
        ----------
        balance
            Of one machine, with the errors of its readings.
        corrections, standing
            What is added, and what was on before that, (p,).
        draws
            How many sets of readings are drawn; None: the covariance to first order, where no limit is in its way.
        """
        try:
            if self.limited:
                problems = balance.problem_samples(self.drawn(draws))
                covariance = spread(self._samples(problems, standing, balance.weights), corrections)
            elif draws:
                covariance = spread(balance.correction_samples(draws) - standing, corrections)
            else:
                covariance = balance.covariance
        except (ValueError, NotConverged):
            covariance = np.full((len(corrections), 2, 2), np.nan)
        left = np.abs(balance.residual_samples(draws or 4000)).max(axis=1)
        return covariance, float(np.quantile(left, 0.95))

    def _samples(
        self, problems: Iterable[tuple[Complex, Complex]], standing: Complex, weights: Real | None
    ) -> Complex:
        """Draw corrections under limits or of the minimax problem: no formula, each draw is solved."""
        samples = []
        for alpha, v in problems:
            here = v + alpha @ standing
            if self.minimax:
                fix = minimax(alpha, here, self.max_mass, weights=weights)
            else:
                try:
                    fix, _ = self.solve(alpha, here, weights)
                except Infeasible:
                    # readings from which the limit cannot be met: as near to it as can be
                    fix = minimax(alpha, here, self.max_mass)
            samples.append(fix.corrections)
        return np.stack(samples)
