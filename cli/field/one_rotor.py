"""What is worked out rotor by rotor, each by itself, so that another process can do it: minimax, limits, drawn errors."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from balancing import Balance, Infeasible, Readings, least_squares, minimax, spread
from cli.field.runs import Complex, Real


class Sought(NamedTuple):
    """What corrections are to keep, and how their errors are drawn."""

    objective: str
    limit: Real | None
    """Of each plane, SI."""
    ridge: float
    draws: int | None


def least_maximum(
    alpha: Complex, here: Complex, limit: Real | None, ceiling: float | None, weights: Real | None
) -> tuple[Balance, bool]:
    """Minimax corrections, and whether it is the weights that leave a residual beyond the ceiling.

    Raises
    ------
    Infeasible
        Where even they leave more than the ceiling.
    """
    fix = minimax(alpha, here, limit, weights=weights)
    if ceiling is None or float(fix.residual_max) <= ceiling * (1 + 1e-9):
        return fix, False
    least = float(minimax(alpha, here, limit).residual_max) if weights is not None else fix.residual_max
    if least > ceiling * (1 + 1e-9):
        raise Infeasible(float(least))
    return fix, True


def within_limits(
    alpha: Complex, here: Complex, limit: Real | None, ceiling: float | None, weights: Real | None
) -> tuple[Balance, bool]:
    """Least-squares corrections that keep the limits; the weights never stand against them."""
    return least_squares(alpha, here, weights, max_mass=limit, max_residual=ceiling), False


def confidence(
    readings: Readings,
    corrections: Complex,
    standing: Complex,
    weights: Real | None,
    sought: Sought,
    limited: bool,
) -> tuple[Real, float]:
    """The covariance of the corrections, (p, 2, 2), and what 95 % of the largest residuals stay below."""
    total, draws = corrections + standing, sought.draws or 4000
    try:
        if limited:
            problems = readings.problem_samples(min(sought.draws or 200, 1000))
            covariance = spread(limited_samples(problems, standing, weights, sought), corrections)
        elif sought.draws:
            samples = readings.correction_samples(weights, sought.ridge, draws) - standing
            covariance = spread(samples, corrections)
        else:
            covariance = readings.covariance(total, weights, sought.ridge, along=corrections)
    except ValueError:
        covariance = np.full((len(corrections), 2, 2), np.nan)
    left = np.abs(readings.residual_samples(total, draws)).max(axis=1)
    return covariance, float(np.quantile(left, 0.95))


def limited_samples(
    problems: Iterable[tuple[Complex, Complex]], standing: Complex, weights: Real | None, sought: Sought
) -> Complex:
    """Draw corrections under limits or of the minimax problem: no formula, each draw is solved."""
    samples = []
    for alpha, v in problems:
        here = v + alpha @ standing
        if sought.objective == "minimax":
            samples.append(minimax(alpha, here, sought.limit, weights=weights).corrections)
        else:
            samples.append(least_squares(alpha, here, weights, max_mass=sought.limit).corrections)
    return np.stack(samples)
