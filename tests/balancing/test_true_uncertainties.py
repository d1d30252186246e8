"""What a fit of all runs says of itself is true: regions and predictions hold as often as they say, over simulated campaigns.

Each kind is 2 000 machines of a design of their own: random masses, true vectors, readings with circular errors.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from balancing import JointFit, LogBalance, drift, joint_fit, least_squares, region_factor

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]

MACHINES = 2000
SD = 0.02
LEVELS = np.array([0.683, 0.95])


def circular(rng: np.random.Generator, *shape: int) -> Complex:
    """Draw complex numbers with E|z|² = 1."""
    return np.asarray((rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2))


def campaign(
    rng: np.random.Generator, planes: int, channels: int, spare: int
) -> tuple[Complex, Complex, Complex]:
    """Draw masses (g, r, p), true unknowns (g, s, 1 + p) and readings (g, r, s), `spare` of them more than unknowns."""
    more = -(-spare // channels)
    runs = 1 + planes + more
    angle = rng.uniform(0, 2 * np.pi, (MACHINES, runs, planes))
    masses = rng.uniform(0.3, 1, angle.shape) * np.exp(1j * angle)
    masses[:, 0] = 0
    angle = rng.uniform(0, 2 * np.pi, (MACHINES, channels, 1 + planes))
    unknowns = rng.uniform(2, 4, angle.shape) * np.exp(1j * angle)
    exact = unknowns[:, None, :, 0] + np.einsum("gsp,grp->grs", unknowns[..., 1:], masses)
    readings = exact + SD * circular(rng, MACHINES, runs, channels)
    # the last run lacks some states
    readings[:, -1, spare - (more - 1) * channels if more else channels :] = np.nan
    return masses, unknowns, readings


def with_errors(fit: JointFit) -> LogBalance:
    """Return corrections with the scatter of the fit, or, with nothing left over, with that it is known to have."""
    errors = fit.scatter()
    if not fit.degrees_of_freedom.all():
        each = np.full(fit.readings.shape, SD / np.sqrt(2))
        errors = replace(
            errors, along=each, across=each, degrees_of_freedom=np.full(len(fit.readings), np.inf)
        )
    return LogBalance(fit, least_squares(fit.influence, fit.initial).corrections, errors)


KINDS = [(planes, states, spare) for planes in (1, 2) for states in (1, 2, 3, 4) for spare in range(7)]


@pytest.mark.slow
@pytest.mark.parametrize(("planes", "states", "spare"), KINDS)
def test_regions_and_predicted_runs_cover_what_they_say(planes: int, states: int, spare: int) -> None:
    rng = np.random.default_rng(1000 * planes + 100 * states + spare)
    # as many sensors as planes, so that every state tells them apart
    channels = planes * states
    masses, unknowns, readings = campaign(rng, planes, channels, spare)
    fit = joint_fit(readings, masses)
    assert (fit.degrees_of_freedom == spare).all()
    found = with_errors(fit)
    true = least_squares(unknowns[..., 1:], unknowns[..., 0]).corrections
    off = (true - found.corrections) * np.exp(-1j * np.angle(found.corrections))
    off = np.stack([off.real, off.imag], axis=-1)
    distance = np.vecdot(off, np.linalg.solve(found.covariance, off[..., None])[..., 0])
    k = np.stack([region_factor(level, found.errors.degrees_of_freedom) for level in LEVELS])
    of_corrections = (distance <= k[..., None] ** 2).mean(axis=(1, 2))
    new = 0.7 * np.exp(1j * rng.uniform(0, 6, (MACHINES, planes)))
    read = unknowns[..., 0] + np.matvec(unknowns[..., 1:], new) + SD * circular(rng, MACHINES, channels)
    expected = fit.fitted(new[:, None])[:, 0]
    own = np.square(found.vibration_deviation(new)) + SD**2 / 2
    if spare:
        own = np.square(found.vibration_deviation(new, reading=True))
    of_run = (np.abs(read - expected) ** 2 / own <= k[..., None] ** 2).mean(axis=(1, 2))
    # planes and channels of one machine are not independent of one another: counted as one
    allowed = 4 * np.sqrt(LEVELS * (1 - LEVELS) / MACHINES)
    assert (np.abs(of_corrections - LEVELS) <= allowed).all(), (of_corrections, of_run)
    assert (np.abs(of_run - LEVELS) <= allowed).all(), (of_corrections, of_run)


@pytest.mark.parametrize(("planes", "channels", "spare"), [(1, 1, 2), (1, 2, 5), (2, 2, 6)])
def test_drift_that_is_not_there_is_told_as_often_as_stated(planes: int, channels: int, spare: int) -> None:
    rng = np.random.default_rng(spare)
    masses, _, readings = campaign(rng, planes, channels, spare)
    years = np.sort(rng.uniform(0, 10, masses.shape[:2]), axis=1)
    found = drift(joint_fit(readings, masses), years)
    for level in (0.05, 0.3):
        allowed = 4 * np.sqrt(level * (1 - level) / MACHINES)
        assert abs((found.probability < level).mean() - level) <= allowed
    # and one that is there, with its uncertainty
    rate = 0.3 * circular(rng, MACHINES, 1, channels)
    with_rate = drift(joint_fit(readings + rate * years[..., None], masses), years)
    assert (with_rate.probability < 0.05).mean() > 0.5
    told = np.isfinite(with_rate.rate)
    error = np.abs(with_rate.rate - rate[:, 0])[told] / with_rate.deviation[told]
    k = region_factor(0.95, spare - told.sum(axis=1))
    inside = (error <= np.repeat(k, told.sum(axis=1))).mean()
    assert abs(inside - 0.95) <= 4 * np.sqrt(0.95 * 0.05 / MACHINES)


def test_drift_is_the_f_test_of_the_longer_model() -> None:
    from scipy.stats import f

    rng = np.random.default_rng(3)
    masses = np.concatenate([np.zeros((1, 1)), 5 * circular(rng, 7, 1)])
    years = np.sort(rng.uniform(0, 10, 8))
    readings = 40 + masses @ circular(rng, 1, 2) + years[:, None] * [0.3, 0.1j] + circular(rng, 8, 2)
    readings[5, 1] = np.nan
    found = drift(joint_fit(readings, masses), years)
    squares, rates = np.zeros(2), []
    for s in range(2):
        read = np.isfinite(readings[:, s])
        short = np.stack([np.ones(8), masses[:, 0]], axis=1)[read]
        longer = np.column_stack([short, years[read]])
        for j, rows in enumerate((short, longer)):
            real = np.block([[rows.real, -rows.imag], [rows.imag, rows.real]])
            y = readings[read, s]
            theta, (left,), _, _ = np.linalg.lstsq(real, np.concatenate([y.real, y.imag]), rcond=None)
            squares[j] += float(left)
        rates.append(theta[2] + 1j * theta[5])
    assert found.rate == pytest.approx(np.array(rates), rel=1e-10)
    value = (squares[0] - squares[1]) / 4 / (squares[1] / (2 * (15 - 6)))
    assert float(found.probability) == pytest.approx(float(f.sf(value, 4, 18)), rel=1e-9)


def test_what_no_time_tells_is_not_tested() -> None:
    on = np.array([[0], [1], [1j], [-1], [2]])
    readings = 3 + on @ [[2 + 1j]] + 0.1 * circular(np.random.default_rng(4), 5, 1)
    fit = joint_fit(readings, on)
    for years in (np.full(5, 7.0), [1, 2, np.nan, 3, 4]):
        found = drift(fit, years)
        assert np.isnan(found.probability)
        assert np.isnan(found.rate).all()
    exact = drift(joint_fit(3 + on @ [[2 + 1j]], on), np.arange(5))
    assert float(exact.probability) == 1
    assert np.isnan(drift(joint_fit(readings[:3], on[:3]), np.arange(3)).probability)
