"""What is worked out rotor by rotor, each by itself, so that another process can do it: minimax, limits, drawn errors."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from balancing import Balance, Doubtful, Infeasible, LogBalance, NotConverged, least_squares, minimax, spread
from cli.field.runs import Complex, Real

ROUNDED = 1 + 64 * float(np.finfo(float).eps)
"""A residual that is beyond its limit by less than this factor is so by rounding."""


class Sought(NamedTuple):
    """What corrections are to keep, and how their errors are drawn."""

    objective: str
    limit: Real | None
    """Of each plane, SI."""
    ceiling: float | None
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
    fix = _quietly(minimax, alpha, here, limit, weights=weights)
    if ceiling is None or float(fix.residual_max) <= ceiling * ROUNDED:
        return fix, False
    least = _quietly(minimax, alpha, here, limit) if weights is not None else fix
    if float(least.residual_max) > ceiling * ROUNDED:
        raise Infeasible(float(least.residual_max) / ceiling, np.array([ceiling]))
    return fix, True


def within_limits(
    alpha: Complex, here: Complex, limit: Real | None, ceiling: float | None, weights: Real | None
) -> tuple[Balance, bool]:
    """Least-squares corrections that keep the limits; the weights never stand against them."""
    return _quietly(least_squares, alpha, here, weights, max_mass=limit, max_residual=ceiling), False


def _quietly(solve: Callable[..., Balance], *data: object, **limits: object) -> Balance:
    """Solve without Python's warning: the command reads it from the result."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Doubtful)
        return solve(*data, **limits)


def confidence(
    balance: LogBalance, corrections: Complex, standing: Complex, sought: Sought, limited: bool
) -> tuple[Real, float]:
    """The covariance of the corrections, (p, 2, 2), and what 95 % of the largest residuals stay below."""
    draws = sought.draws or 4000
    try:
        if limited:
            problems = balance.problem_samples(min(sought.draws or 200, 1000))
            covariance = spread(limited_samples(problems, standing, balance.weights, sought), corrections)
        elif sought.draws:
            covariance = spread(balance.correction_samples(draws) - standing, corrections)
        else:
            covariance = balance.covariance
    except (ValueError, NotConverged):
        covariance = np.full((len(corrections), 2, 2), np.nan)
    left = np.abs(balance.residual_samples(draws)).max(axis=1)
    return covariance, float(np.quantile(left, 0.95))


def limited_samples(
    problems: Iterable[tuple[Complex, Complex]], standing: Complex, weights: Real | None, sought: Sought
) -> Complex:
    """Draw corrections under limits or of the minimax problem: no formula, each draw is solved."""
    samples = []
    for alpha, v in problems:
        here = v + alpha @ standing
        if sought.objective == "minimax":
            fix = _quietly(minimax, alpha, here, sought.limit, weights=weights)
        else:
            try:
                fix, _ = within_limits(alpha, here, sought.limit, sought.ceiling, weights)
            except Infeasible:
                # readings from which the limit cannot be met: as near to it as can be
                fix = _quietly(minimax, alpha, here, sought.limit)
        samples.append(fix.corrections)
    return np.stack(samples)
