"""A robust fit is a fixed point: one more weighted fit, computed another way, does not move it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from balancing import joint_fit, robust_fit

Complex = NDArray[np.complex128]


def weighted_again(readings: Complex, masses: Complex, unknowns: Complex, freedom: int) -> Complex:
    """One round of Huber's weights from some unknowns (1 + p, s), by numpy's least squares sensor by sensor."""
    a = np.hstack([np.ones((len(masses), 1)), masses])
    read = np.isfinite(readings)
    size = np.abs(np.where(read, readings - a @ unknowns, np.nan))
    sd = np.sqrt(read.sum() / freedom) * np.nanmedian(size) / np.sqrt(2 * np.log(2))
    weight = np.minimum(1.0, 1.5 * sd / np.where(size > 0, size, sd))
    columns = []
    for s in range(readings.shape[1]):
        mine = read[:, s]
        root = np.sqrt(weight[mine, s])
        columns.append(np.linalg.lstsq(root[:, None] * a[mine], root * readings[mine, s], rcond=None)[0])
    return np.array(columns).T


def vectors(rng: np.random.Generator, *shape: int) -> Complex:
    """Random complex numbers."""
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def change(seed: int) -> float:
    """By how much one more round moves the unknowns of a random log, relative to the largest."""
    rng = np.random.default_rng(seed)
    planes, sensors = rng.integers(1, 3), rng.integers(1, 4)
    runs = int(rng.integers(planes + 4, 12))
    masses = vectors(rng, runs, planes)
    masses[0] = 0
    readings = 3 * vectors(rng, sensors) + masses @ vectors(rng, planes, sensors)
    readings += 0.05 * vectors(rng, runs, sensors)
    for _ in range(rng.integers(0, 3)):
        readings[rng.integers(runs), rng.integers(sensors)] += rng.choice([0.3, 3, 30])
    if seed % 3 == 0:
        readings[runs - 1, 0] = np.nan
    fit = joint_fit(readings, masses)
    robust = robust_fit(fit)
    unknowns = np.vstack([robust.initial[None], robust.influence.T])
    again = weighted_again(readings, masses, unknowns, int(fit.degrees_of_freedom))
    return float(np.abs(again - unknowns).max() / np.abs(unknowns).max())


def test_robust_fits_are_fixed_points() -> None:
    assert max(map(change, range(120))) < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(120, 600))
def test_more_robust_fits_are_fixed_points(seed: int) -> None:
    assert change(seed) < 1e-10
