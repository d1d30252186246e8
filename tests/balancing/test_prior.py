"""Coefficients of sister machines as prior knowledge of the fit: an independent solution, limiting cases, true regions."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from numpy.typing import NDArray

from balancing import (
    LogBalance,
    Prior,
    fit_with_prior,
    joint_fit,
    least_squares,
    pooled_prior,
    region_factor,
    robust_fit,
    stored_prior,
)
from balancing.second_run import pseudo_inverse
from dalembert.arithmetic.doubled_arrays import Vectors

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


def circular(rng: np.random.Generator, *shape: int) -> Complex:
    """Draw complex numbers with E|z|² = 1."""
    return np.asarray((rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2))


def covariance(rng: np.random.Generator, channels: int, planes: int) -> Complex:
    root = circular(rng, channels, planes, planes)
    return np.asarray(root @ np.swapaxes(root, -1, -2).conj() + 0.1 * np.eye(planes))


def real(a: Complex) -> Real:
    """Return the real matrix of a complex one, over (Re, Im)."""
    return np.block([[a.real, -a.imag], [a.imag, a.real]])


def test_it_is_the_generalised_least_squares_of_runs_and_prior_together() -> None:
    rng = np.random.default_rng(1)
    masses, readings = circular(rng, 5, 2), 9 * circular(rng, 5, 3)
    readings[1, 0] = readings[4, 2] = np.nan
    mean, c = circular(rng, 3, 2), covariance(rng, 3, 2)
    deviation = rng.uniform(0.2, 0.9, readings.shape)
    fit = fit_with_prior(readings, masses, stored_prior(mean, c), deviation)
    found = LogBalance(fit, np.zeros(2, complex), fit.known(0.0))
    for s in range(3):
        read = np.isfinite(readings[:, s])
        rows = np.concatenate([np.ones((5, 1)), masses], axis=1)[read]
        a = np.concatenate([rows, np.eye(3)[1:]])
        b = np.concatenate([readings[read, s], mean[s]])
        v = np.zeros((len(b), len(b)), dtype=complex)
        v[: len(rows), : len(rows)] = np.diag(deviation[read, s] ** 2)
        v[len(rows) :, len(rows) :] = c[s]
        inverse = np.linalg.inv(real(v))
        normal = real(a).T @ inverse @ real(a)
        theta = np.linalg.solve(normal, real(a).T @ inverse @ np.concatenate([b.real, b.imag]))
        assert np.abs(fit.unknowns[s] - (theta[:3] + 1j * theta[3:])).max() < 1e-10
        # what readings and prior bring to the errors of the unknowns is the inverse of the normal equations
        assert fit.foreknown is not None
        spread = (fit.gain[s] * deviation[:, s] ** 2) @ fit.gain[s].conj().T
        spread = spread + fit.foreknown.sources[s] @ fit.foreknown.sources[s].conj().T
        theirs = np.linalg.inv(normal)
        assert np.abs(spread - (theirs[:3, :3] + 1j * theirs[3:, :3])).max() < 1e-10
        # with no masses on, x₀'s own, of a component
        of_initial = found.vibration_spread(np.zeros(2)).covariance[s]
        assert of_initial == pytest.approx(
            np.linalg.norm(fit.foreknown.sources[s, 0]) ** 2 / 2 * np.eye(2), rel=1e-9, abs=1e-12
        )


def test_a_prior_that_knows_nothing_is_the_fit_of_the_runs_and_one_that_knows_all_stays() -> None:
    rng = np.random.default_rng(2)
    masses, readings = circular(rng, 6, 2), 9 * circular(rng, 6, 3)
    mean = circular(rng, 3, 2)
    plain = joint_fit(readings, masses)
    vague = fit_with_prior(readings, masses, stored_prior(mean, 1e16 * np.broadcast_to(np.eye(2), (3, 2, 2))))
    assert vague.unknowns == pytest.approx(plain.unknowns, abs=1e-9)
    assert vague.residual_sd == pytest.approx(float(plain.residual_sd), rel=1e-12)
    assert vague.standardized == pytest.approx(plain.standardized, rel=1e-9)
    sure = fit_with_prior(readings, masses, stored_prior(mean, np.zeros((3, 2, 2))))
    assert (sure.influence == mean).all()
    assert sure.initial == pytest.approx((readings - masses @ mean.T).mean(axis=0), abs=1e-12)
    # without any error the runs decide what they determine, the prior the rest
    x0, alpha = circular(rng, 3), circular(rng, 3, 2)
    one = masses[:2] * [1, 0]
    exact = fit_with_prior(x0 + one @ alpha.T, one, stored_prior(mean, np.broadcast_to(np.eye(2), (3, 2, 2))))
    assert exact.influence[:, 1] == pytest.approx(mean[:, 1], abs=1e-12)
    assert exact.influence[:, 0] == pytest.approx(alpha[:, 0], abs=1e-12)
    assert exact.initial == pytest.approx(x0, abs=1e-12)
    assert int(exact.degrees_of_freedom) == 0


@pytest.mark.parametrize("stated", [True, False])
def test_a_robust_fit_with_a_prior_is_the_least_of_huber_s_function(stated: bool) -> None:
    from scipy.optimize import minimize

    rng = np.random.default_rng(7)
    masses, x0, alpha = circular(rng, 9, 2), 30 * circular(rng, 1), circular(rng, 1, 2)
    readings = x0 + masses @ alpha.T + 0.2 * circular(rng, 9, 1)
    readings[4] += 8
    readings[2] = np.nan
    c = covariance(rng, 1, 2) / 50
    prior = stored_prior(alpha + 0.1 * circular(rng, 1, 2), c)
    plain = fit_with_prior(readings, masses, prior, 0.2)
    found = robust_fit(plain, prior, 0.2 if stated else None)
    # of the runs alone: 8 readings, 3 unknowns; half of |r|² is below σ² ln 2
    alone = robust_fit(joint_fit(np.delete(readings, 2, axis=0), np.delete(masses, 2, axis=0)))
    scatter = np.sqrt(8 / 5 / np.log(2)) * np.median(np.abs(alone.residuals))
    sigma = 0.2 if stated else float(scatter)
    inverse = np.linalg.inv(c[0])
    read = np.isfinite(readings[:, 0])

    def objective(parts: Real) -> float:
        theta = parts[:3] + 1j * parts[3:]
        r = np.abs(readings[read, 0] - theta[0] - masses[read] @ theta[1:])
        k = 1.5 * sigma / np.sqrt(2)
        off = theta[1:] - prior.mean[0]
        h = np.where(r <= k, r**2, 2 * k * r - k**2)
        return float(h.sum() / sigma**2 + (off.conj() @ inverse @ off).real)

    ours = np.concatenate([found.unknowns[0].real, found.unknowns[0].imag])
    start = np.concatenate([plain.unknowns[0].real, plain.unknowns[0].imag])
    theirs = minimize(
        objective, start, method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-13, "maxfev": 40_000}
    )
    assert objective(ours) <= theirs.fun * (1 + 1e-12)
    assert theirs.x == pytest.approx(ours, abs=2e-5)
    truth = np.concatenate([x0, alpha[0]])
    assert np.abs(found.unknowns[0] - truth).max() < 0.5 * np.abs(plain.unknowns[0] - truth).max()


def test_a_robust_fit_with_a_prior_leaves_good_readings_and_runs_without_scatter_alone() -> None:
    rng = np.random.default_rng(8)
    masses, mean = circular(rng, 2, 6, 2), circular(rng, 3, 2)
    prior = stored_prior(mean, np.broadcast_to(0.01 * np.eye(2), (3, 2, 2)))
    exact = 9 + masses @ mean.T
    fit = fit_with_prior(exact, masses, prior)
    assert robust_fit(fit, prior).unknowns == pytest.approx(fit.unknowns, abs=1e-12)
    # base runs alone, one of them wrong: the coefficients stay as they were known
    bases = 30 + 0.1 * circular(rng, 7, 3)
    bases[5] += 20
    on = np.zeros((7, 2))
    found = robust_fit(fit_with_prior(bases, on, prior), prior)
    assert found.influence == pytest.approx(mean, abs=1e-12)
    assert np.abs(found.initial - 30).max() < 0.2


def test_machines_side_by_side_are_fitted_as_if_alone() -> None:
    rng = np.random.default_rng(3)
    masses, readings = circular(rng, 4, 3, 2), 9 * circular(rng, 4, 3, 2)
    readings[2, 1, 0] = np.nan
    prior = pooled_prior(circular(rng, 4, 2, 2))
    many = fit_with_prior(readings, masses, prior, 0.3)
    found = LogBalance(
        many, least_squares(many.influence, many.initial).corrections, many.known(np.full(4, 0.3))
    )
    for i in range(4):
        one = fit_with_prior(readings[i], masses[i], prior, 0.3)
        assert many.unknowns[i] == pytest.approx(one.unknowns, rel=1e-12)
        alone = LogBalance(one, found.corrections[i], one.known(0.3))
        assert found.covariance[i] == pytest.approx(alone.covariance, rel=1e-10, abs=1e-12)
        assert found.machine(i).covariance == pytest.approx(alone.covariance, rel=1e-10, abs=1e-12)
        assert found.degrees_of_freedom[i] == pytest.approx(alone.degrees_of_freedom, rel=1e-10)


MACHINES = 2000


@pytest.mark.slow
@pytest.mark.parametrize(
    ("planes", "channels", "sisters", "runs", "common"),
    [(1, 1, 4, 1, False), (1, 3, 5, 1, True), (2, 4, 6, 1, False), (1, 2, 4, 3, False), (2, 2, 5, 4, True)],
)
def test_regions_with_sister_machines_cover_what_they_say(
    planes: int, channels: int, sisters: int, runs: int, common: bool
) -> None:
    """Machines differ by 4 %: each coefficient by itself, or all of a machine alike; readings scatter by 0.02 of some 3."""
    rng = np.random.default_rng(100 * planes + 10 * sisters + runs)
    sd, levels, inside, total = 0.02, np.array([0.683, 0.95]), np.zeros(2), 0
    for _ in range(MACHINES):
        true_mean = rng.uniform(1, 2, (channels, planes)) * np.exp(
            2j * np.pi * rng.uniform(0, 1, (channels, planes))
        )
        differ = circular(rng, sisters + 1, *((1, 1) if common else (channels, planes)))
        each = true_mean * (1 + 0.04 * differ)
        prior = pooled_prior(each[:sisters])
        alpha = each[sisters:]
        masses = circular(rng, 1, runs, planes)
        masses[:, 0] = 0
        x0 = 3 * np.exp(2j * np.pi * rng.uniform(0, 1, (1, channels)))
        readings = x0[:, None] + masses @ np.swapaxes(alpha, 1, 2) + sd * circular(rng, 1, runs, channels)
        fit = fit_with_prior(readings, masses, prior, sd)
        found = LogBalance(
            fit, least_squares(fit.influence, fit.initial).corrections, fit.known(np.full(1, sd))
        )
        best = least_squares(alpha, x0).corrections
        off = (best - found.corrections) * np.exp(-1j * np.angle(found.corrections))
        off = np.stack([off.real, off.imag], axis=-1)
        distance = np.vecdot(off, np.linalg.solve(found.covariance, off[..., None])[..., 0])
        k = np.stack([region_factor(level, found.degrees_of_freedom) for level in levels])
        inside += (distance <= k**2).mean(axis=(1, 2))
        total += 1
    allowed = 4 * np.sqrt(levels * (1 - levels) / total)
    assert (np.abs(inside / total - levels) <= allowed).all(), inside / total


def test_the_scatter_between_machines_is_told_from_the_errors_of_their_runs() -> None:
    rng = np.random.default_rng(5)
    each = 2 * (1 + 0.1 * circular(rng, 400, 3, 1)) + 0.3 * circular(rng, 400, 3, 1)
    found = pooled_prior(each, np.full((400, 3, 1, 1), 0.09))
    assert float(found.scatter) == pytest.approx(0.1, rel=0.05)
    # a further machine lies from the mean by its own scatter alone
    assert np.linalg.norm(found.factor, axis=-1) == pytest.approx(0.2, rel=0.15)
    alike = pooled_prior(2 + 0.3 * circular(rng, 9, 3, 1), np.full((9, 3, 1, 1), 4.0))
    assert float(alike.scatter) == 0
    known = pooled_prior(each)
    assert float(known.scatter) == pytest.approx(np.hypot(0.1, 0.15), rel=0.05)


def test_bad_input_is_refused() -> None:
    prior = stored_prior([[2.0]], [[[0.1]]])
    assert isinstance(prior, Prior)
    for call in (
        lambda: pooled_prior([[[1.0]]]),
        lambda: stored_prior([[2.0]], [[0.1]]),
        lambda: stored_prior([[2.0]], [[[-0.1]]]),
        lambda: fit_with_prior([[np.nan]], [[0]], prior),
        lambda: fit_with_prior([[1, 2]], [[0]], prior),
        lambda: fit_with_prior([[np.inf]], [[0]], prior),
    ):
        with pytest.raises(ValueError, match=r"expected|shapes|negative|no reading|finite"):
            call()


def test_the_errors_of_a_fit_with_a_prior_are_those_against_fifty_digits() -> None:
    """Mixed estimation by its normal equations (Theil and Goldberger 1961), of the floats as exact."""
    rng = np.random.default_rng(11)
    on, read = circular(rng, 3, 5, 2), circular(rng, 3, 5, 2)
    root = circular(rng, 2, 2, 2) + np.eye(2)
    prior = stored_prior(circular(rng, 2, 2), root @ np.swapaxes(root, -1, -2).conj())
    deviation = 0.125
    fit = fit_with_prior(read, on, prior, deviation)
    error = fit.error_estimate()
    shifted, runout = fit.without(np.ones(2, dtype=complex)), np.array([[1.0, 0, 0]] * 2)
    assert shifted.error_estimate() == pytest.approx(error, rel=0.3, abs=1e-16)
    assert np.allclose(shifted.unknowns, fit.unknowns - runout)
    with mp.workdps(50):
        for i, s in np.ndindex(3, 2):
            rows = mp.matrix([[1, *map(mp.mpmathify, w)] for w in on[i].tolist()])
            weighed = mp.matrix(prior.root[s].tolist())
            gamma = (weighed * weighed.H) ** -1
            below = mp.zeros(3, 3)
            below[1:, 1:] = gamma
            mean = mp.matrix([0, *prior.mean[s].tolist()])
            y = mp.matrix(read[i, :, s].tolist())
            scale = mp.mpf(deviation) ** -2
            exact = mp.lu_solve(rows.H * rows * scale + below, rows.H * y * scale + below * mean)
            true = [float(abs(exact[k] - mp.mpmathify(fit.unknowns[i, s, k]))) for k in range(3)]
            assert (true <= error[i, s] * (1 + 1e-9)).all()
            assert (error[i, s] <= 2 * np.array(true) + 1e-25).all()
            one = fit.machine(i).error_estimate()[s]
            assert (one == error[i, s]).all()


def test_the_inverse_of_dependent_columns_is_numpy_s() -> None:
    rng = np.random.default_rng(3)
    a = circular(rng, 4, 6, 3)
    a[1, :, 2], a[2] = 2j * a[1, :, 0], 0.0
    a[3, :, 1:] = a[3, :, :1]
    assert np.allclose(pseudo_inverse(Vectors.of(a)).value, np.linalg.pinv(a), atol=1e-13)
