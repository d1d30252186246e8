"""Which readings of a log are in doubt: outliers, contradicting repeats, drift, the sense of the phase, a robust fit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.dependence import design
from balancing.prior import Prior, fit_with_prior, runs_alone
from balancing.reading_errors import Errors
from balancing.run_log import JointFit, joint_fit
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_numbers, common_shape

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

LEVEL = 0.05
"""The probability with which each test errs."""
NEAR = 0.02  # masses within this share of the largest are a repeat
HUBER = 1.5  # standard deviations of a component
ROUNDS = 3000  # of weighted fits: near a reading that gains or loses its full weight a round may move it by a hundredth only
MEDIAN = float(np.sqrt(2 * np.log(2)))  # of |·| of a circular vector with components of standard deviation 1


def outlier_probability(fit: JointFit) -> Real:
    """Return the probability by chance of a largest residual like each one, (..., r, s); NaN if untested.

    Parameters
    ----------
    fit
        The fit of the runs.

    Notes
    -----
    The share f = |r|²/((1 - h) Σ|r|²) of ν complex degrees of freedom has the distribution Beta(1, ν - 1), so that it is
    exceeded with the probability (1 - f)^(ν - 1): the test of the largest studentised residual (Cook and Weisberg,
    Residuals and Influence in Regression, 1982, section 2.2.2) in complex numbers, where every direction counts
    (two-sided), times the number of readings (Bonferroni). It needs ν ≥ 2.

    Examples
    --------
    >>> on = np.arange(8.0)[:, None] * 1j
    >>> read = 5 + 2 * on + 0.01 * np.sin(np.arange(8.0) ** 2)[:, None]
    >>> read[3] += 1
    >>> outlier_probability(joint_fit(read, on))[:, 0].round(3)
    array([1., 1., 1., 0., 1., 1., 1., 1.])
    """
    nu = np.asarray(fit.degrees_of_freedom, dtype=float)[..., None, None]
    share = np.square(fit.standardized) / np.where(nu >= 2, nu, np.nan)
    return _chance(share, nu, np.isfinite(share).sum(axis=(-2, -1), keepdims=True))


def _chance(share: Real, nu: Real, tests: Real | int) -> Real:
    """Return the probability that one of this number of shares is as large as this."""
    chance = np.minimum(tests * np.clip(1 - share, 0.0, 1.0) ** (nu - 1), 1.0)
    return np.asarray(np.where(np.isfinite(share), chance, np.nan))


@record
class Repeat(NamedTuple):
    """Two readings of one channel with the same masses on, and how probable so large a difference is by chance."""

    runs: tuple[int, int]
    channel: int
    difference: float
    """|difference| of the residuals."""
    probability: float
    """NaN where there is no further reading to compare with."""


def repeats(fit: JointFit, errors: Errors | None = None) -> Iterator[Repeat]:
    """Yield the repeated readings of one machine, (r, s), with the test of their difference.

    Parameters
    ----------
    fit
        The fit of one machine.
    errors
        Errors of the readings; None: the residuals give them.

    Yields
    ------
    Repeat
        `.runs`, the two runs, and `.probability` of such a difference by chance.

    Notes
    -----
    The difference of two readings with equal masses is a direction of the residuals, and has the test of
    `outlier_probability`. With given errors the probability of such a |difference|² of two circular errors is
    exp(-|difference|²/(E|ε₁|² + E|ε₂|²)), times the number of pairs.

    Examples
    --------
    >>> found = repeats(joint_fit([[1], [1.1], [3], [3.1], [2]], [[0], [0], [1], [1], [0.5]]))
    >>> [(one.runs, round(one.probability, 2)) for one in found]
    [((0, 1), 0.68), ((2, 3), 0.68)]
    """
    fit = fit.alone
    size = np.abs(fit.masses).max(initial=0.0)
    close = np.abs(fit.masses[:, None] - fit.masses[None]).max(axis=-1) <= NEAR * size
    pairs = np.argwhere(np.triu(close, 1))
    both = fit.present[pairs[:, 0]] & fit.present[pairs[:, 1]]
    nu = float(fit.degrees_of_freedom)
    weights = np.ones(fit.readings.shape) if fit.weights is None else fit.weights
    for k, s in np.argwhere(both).tolist():
        one, other = pairs[k].tolist()
        apart = float(abs(fit.residuals[one, s] - fit.residuals[other, s]))
        of_both = 1 / weights[one, s] + 1 / weights[other, s]
        share = apart**2 / (of_both * float(fit.sum_of_squares)) if apart else 0.0
        chance = float(_chance(np.asarray(share), np.asarray(nu), int(both.sum()))) if nu >= 2 else np.nan
        if errors is not None and np.isinf(errors.degrees_of_freedom):
            variance = sum(errors.along[j, s] ** 2 + errors.across[j, s] ** 2 for j in (one, other))
            chance = min(int(both.sum()) * float(np.exp(-(apart**2) / variance)), 1.0) if variance else np.nan
        yield Repeat((one, other), s, apart, chance)


@record
class Drift(NamedTuple):
    """The rate at which the vibration changes with time, and the probability of such a rate by chance."""

    rate: Complex
    """The rate of each channel, in readings per unit of time, (..., s); NaN if the times do not determine it."""
    deviation: Real
    """Standard deviation of each component of the rate, (..., s); NaN where there is no further reading."""
    probability: Real
    """The probability for all channels together, (...); NaN if untested."""


def drift(fit: JointFit, times: ArrayLike) -> Drift:
    """Test whether the vibration drifts with time, y = x₀ + αw + βt, with one β for each channel.

    Parameters
    ----------
    fit
        The fit of the runs without drift.
    times
        The time of each run, (..., r), in any unit from any origin.

    Returns
    -------
    Drift
        `.rate` β (..., s), amplitude in the unit of time, with its error; `.probability` (...) of so large a rate by chance.

    Notes
    -----
    With t⊥ the part of t that x₀ and α cannot follow, β = t⊥ᴴr/‖t⊥‖² (Frisch and Waugh; Seber and Lee, section 3.7), and
    the k channels whose t⊥ is not zero lessen the sum of squares by the share f = Σ|t⊥ᴴr|²/‖t⊥‖²/Σ|r|². Without drift f is
    distributed as Beta(k, ν - k): the F test of k complex coefficients with 2k and 2(ν - k) degrees of freedom. It needs
    ν > k.

    Examples
    --------
    >>> on, day = np.array([[0], [1], [1j], [-1], [0], [1]]), np.arange(6.0)
    >>> noise = 0.05 * np.exp(1j * np.arange(6) ** 2)[:, None]
    >>> found = drift(joint_fit(5 + 2 * on + 0.1 * day[:, None] + noise, on), day)
    >>> found.rate.real.round(2), bool(found.probability < 0.01)
    (array([0.09]), True)
    """
    from scipy.special import betainc

    fit = fit.alone
    time = as_numbers("times", times)
    common_shape(times=time.shape, runs=fit.present.shape[:-1])
    time = time - time.mean(axis=-1, keepdims=True)
    shared = np.where(fit.present, time[..., None], 0.0)
    by_channel = np.swapaxes(shared, -1, -2)
    followed = np.swapaxes(design(fit.masses) @ np.swapaxes(np.matvec(fit.gain, by_channel), -1, -2), -1, -2)
    weights = 1.0 if fit.weights is None else np.swapaxes(fit.weights, -1, -2)
    read = np.swapaxes(fit.present, -1, -2)
    free = np.where(read, by_channel - followed, 0.0)
    length = (weights * np.square(np.abs(free))).sum(axis=-1)
    detectable = length > 1e-20 * (weights * np.square(by_channel)).sum(axis=-1)
    left = np.swapaxes(np.where(fit.present, fit.residuals, 0.0), -1, -2)
    along = (weights * free.conj() * left).sum(axis=-1)
    safe = np.where(detectable, length, 1.0)
    k, nu = detectable.sum(axis=-1), np.asarray(fit.degrees_of_freedom)
    rate = np.where(detectable, along / safe, np.nan)
    less = np.where(detectable, np.square(np.abs(along)) / safe, 0.0).sum(axis=-1)
    tested = (k > 0) & (nu > k)
    whole = fit.sum_of_squares
    share = np.clip(less / np.where(whole > 0, whole, 1.0), 0.0, 1.0)
    chance = betainc(np.where(tested, nu - k, 1), np.where(tested, k, 1), 1 - share)
    variance = np.maximum(whole - less, 0.0) / np.where(tested, nu - k, np.nan) / 2
    deviation = np.where(detectable, np.sqrt(variance[..., None] / safe), np.nan)
    return Drift(rate, deviation, np.asarray(np.where(tested, chance, np.nan)))


def phase_sense(fit: JointFit) -> tuple[Real, Real, Real]:
    """Return whether the phase leads (1), lags (-1) or is undecided (0), and both sums of squares, (...).

    The runs are fitted as they are, and with every reading conjugate. If the masses lie on a line, both fits are equal
    and the runs cannot decide. A sense is chosen if its sum of squares is smaller by the F(2ν, 2ν) quantile of 95 %.

    Parameters
    ----------
    fit
        The fit of the runs as they are.

    Returns
    -------
    sense, lead, lag
        The sense, and the sums of squares with a leading and with a lagging phase.

    Examples
    --------
    >>> on = np.array([[0], [1], [1j], [-1 - 1j]])
    >>> [float(phase_sense(joint_fit(read, on))[0]) for read in (3 + 2j * on, (3 + 2j * on).conj())]
    [1.0, -1.0]
    """
    from scipy.special import fdtri

    turned = fit.again(fit.readings.conj())
    nu = np.asarray(fit.degrees_of_freedom, dtype=float)
    square = np.square(np.abs(np.where(fit.present, fit.readings, 0.0)))
    weighed = square if fit.weights is None else fit.weights * square
    # sums of squares in the rounding of the readings are alike
    floor = np.square(1e3 * EPS) * weighed.sum(axis=(-2, -1))
    lead, lag = fit.sum_of_squares, turned.sum_of_squares
    enough = fdtri(2 * np.maximum(nu, 1), 2 * np.maximum(nu, 1), 1 - LEVEL)
    leads = (lag > enough * lead) & (lag > floor)
    lags = (lead > enough * lag) & (lead > floor)
    sense = np.where(nu > 0, leads.astype(float) - lags.astype(float), 0.0)
    return sense, lead, lag


def robust_fit(fit: JointFit, prior: Prior | None = None, deviation: ArrayLike | None = None) -> JointFit:
    """Fit again with Huber's weights, which reduce the effect of a few wrong readings.

    Parameters
    ----------
    fit
        The fit of all runs, with `prior` if there is one.
    prior
        Coefficients from before the runs; they are not weighted.
    deviation
        With a prior √E|ε|² of the readings, (..., r, s) or a shape that broadcasts; None or NaN: the scatter of the runs,
        also with Huber's weights.

    Returns
    -------
    JointFit
        With the weights of its readings.

    Notes
    -----
    Huber, Robust Statistics (1981), section 7.8: weight 1 up to k standard deviations of a component, beyond it k/|r|,
    by repeated weighted fits; k = 1.5, where complex normal errors lose 5 % of efficiency. The standard deviation is the
    median of |r| over √(2 ln 2), made up for the unknowns fitted. With a prior it is held fixed, and what is least is
    Σ h(|r|)/σ² + (α - α̂)ᴴ Γ⁻¹ (α - α̂) with h = |r|² up to c = kσ/√2 and 2c|r| - c² beyond.

    Examples
    --------
    >>> on = np.arange(8.0)[:, None] * 1j
    >>> read = 5 + 2 * on + 0.01 * np.exp(1j * np.arange(8.0) ** 2)[:, None]
    >>> read[3] += 10
    >>> plain = joint_fit(read, on)
    >>> abs(plain.initial - 5).round(1), abs(robust_fit(plain).initial - 5).round(1)
    (array([1.7]), array([0.]))
    """
    if prior is None:
        weights = np.ones(fit.readings.shape) if fit.weights is None else fit.weights
        return _huber(fit, lambda share: joint_fit(fit.readings, fit.masses, weights * share))[0]
    sd = np.asarray(np.nan if deviation is None else deviation, dtype=float)
    if np.isnan(sd).any():
        _, of_runs = _huber(fit.alone, lambda share: runs_alone(fit.readings, fit.masses, share))
        sd = np.where(np.isnan(sd), np.sqrt(2) * of_runs, sd)
    spread = np.broadcast_to(sd, fit.readings.shape)
    again = partial(fit_with_prior, fit.readings, fit.masses, prior)
    return _huber(again(spread), lambda share: again(spread / np.sqrt(share)), spread / np.sqrt(2))[0]


def _huber(
    fit: JointFit, again: Callable[[Real], JointFit], deviation: Real | None = None
) -> tuple[JointFit, Real]:
    """Fit with Huber's shares of the weights until nothing changes; with the standard deviations of a component, or `deviation`."""
    root = 1.0 if fit.weights is None else np.sqrt(fit.weights)
    count = fit.present.sum(axis=(-2, -1))
    grown = np.sqrt(count / np.maximum(fit.degrees_of_freedom, 1))
    current, sd = fit, np.zeros(())
    for _ in range(ROUNDS):
        size = np.where(fit.present, np.abs(current.residuals) * root, np.nan)
        sd = (
            (grown * np.nanmedian(size, axis=(-2, -1)) / MEDIAN)[..., None, None]
            if deviation is None
            else deviation
        )
        beyond = fit.present & (size > HUBER * sd) & (sd > 0)
        share = np.where(beyond, HUBER * sd / np.where(beyond, size, 1.0), 1.0)
        before, current = current, again(share)
        change = np.abs(current.unknowns - before.unknowns)
        if (change <= 1e-12 * np.abs(current.unknowns).max(axis=-1, keepdims=True)).all():
            break
    return current, sd
