"""What corrections of rotors are computed from, the corrections, their trim and uncertainty; what is worked out rotor by rotor."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from balancing import (
    AmplitudeFit,
    Balance,
    Doubtful,
    Infeasible,
    JointFit,
    LogBalance,
    NotConverged,
    least_squares,
    minimax,
    spread,
)
from balancing.dependence import directions
from balancing.reading_errors import Errors
from cli.field.runs import Complex, Group, Real
from cli.read.rounding import EPS

UNKNOWN_ANGLE = 60.0  # an angle that is uncertain by more (degrees) is not known


@dataclass(eq=False, repr=False)
class Problem:
    """What the corrections of a group are found from."""

    group: Group
    planes: list[str]
    fit: JointFit
    """Initial vibration and coefficients, run-out and all."""
    fits: list[list[AmplitudeFit]]
    """Of the four-run method, rotor by rotor, plane by plane."""
    initial: Complex
    """(g, s), run-out off."""
    standing: Complex
    """(g, p): what is on the rotor in its last run."""
    start: Complex
    """(g, p): what is on the rotor where the corrections start from: that, or nothing."""
    limit: Real | None
    """Of each plane, SI; None where there is none."""

    @property
    def alpha(self) -> Complex:
        """The influence coefficients, (g, s, p)."""
        return self.fit.influence

    @cached_property
    def here(self) -> Complex:
        """The vibration where the corrections start from, (g, s)."""
        return self.initial + np.matvec(self.alpha, self.start) if self.start.any() else self.initial


@dataclass(eq=False, repr=False)
class Solved(Problem):
    """A group's result."""

    corrections: Complex
    """(g, p), as given out (from here, where that was asked for)."""
    residual: Complex
    condition: Real
    bound: Real | None
    """Of the largest residual, as the dual problem proves it."""
    unbalance: Complex | None
    """(g, p): the rotor's own in its initial state; NaN where the readings do not determine it."""
    covariance: Real | None = None
    residual_95: Real | None = None
    balance: LogBalance | None = None
    """Where all runs were fitted at once: what the corrections leave, and how sure it is."""

    @property
    def fitted(self) -> LogBalance:
        """The balance of a log whose runs were all fitted at once."""
        assert self.balance is not None
        return self.balance

    @property
    def total(self) -> Complex:
        """What is added to the rotor in its initial state, (g, p)."""
        return self.corrections + self.start

    @cached_property
    def trim(self) -> Complex:
        """What is added to the rotor as it stands in its last run, (g, p)."""
        trim = self.corrections + (self.start - self.standing)
        terms = np.abs(self.total) + np.abs(self.standing)
        return np.where(np.abs(trim) > 4 * EPS * terms, trim, 0)

    @cached_property
    def uncertainty(self) -> tuple[Real, Real]:
        """The standard deviations of size (SI) and angle (degrees), (g, p) each; NaN where they are not known."""
        return self.uncertainty_of(self.corrections)

    def uncertainty_of(self, masses: Complex) -> tuple[Real, Real]:
        """Return the same of what differs from the corrections by masses that are known, (g, p)."""
        size = np.abs(masses)
        if self.covariance is None:
            return np.full(size.shape, np.nan), np.full(size.shape, np.nan)
        turn = directions(self.corrections) * directions(masses).conj()
        axes = np.moveaxis(np.array([[turn.real, -turn.imag], [turn.imag, turn.real]]), (0, 1), (-2, -1))
        covariance = axes @ self.covariance @ np.swapaxes(axes, -1, -2)
        along, across = (np.sqrt(covariance[..., k, k]) for k in (0, 1))
        angle = np.where(size > 0, np.degrees(across / np.where(size > 0, size, 1.0)), np.nan)
        return along, np.where(angle <= UNKNOWN_ANGLE, angle, np.nan)


def errors_of_means(fit: JointFit, group: Group, amplitude: float, phase: float) -> Errors:
    """Return the errors of the readings of an initial run and trial runs: stated, or as repeats scatter where that is more.

    What repeats show (a type A evaluation, JCGM 100:2008, 4.2) is the less for their mean; what is stated (type B, 4.3) is
    not averaged away.
    """
    shape = fit.readings.shape
    mean, scatter, count = np.zeros(shape, dtype=complex), np.zeros(shape), np.ones(shape)
    for j, trial in enumerate(group.trials):
        if trial.lines[-1] < shape[1]:
            mean[:, trial.lines] = group.means[:, [j]]
            scatter[:, trial.lines] = group.mean_error[:, [j]]
            count[:, trial.lines] = group.counts[j]
    size = np.abs(mean)
    along, across = scatter > amplitude * size, scatter > phase * size
    of_reading = np.sqrt(count) * fit.present
    return Errors(
        directions(mean),
        of_reading * np.maximum(scatter, amplitude * size),
        of_reading * np.maximum(scatter, phase * size),
        np.full(len(mean), float(group.repeats) or np.inf),
        np.where(across, 0.0, phase * np.sqrt(count)),
        ~along,
    )


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
