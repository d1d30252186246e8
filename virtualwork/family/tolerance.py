"""The effect of tolerances of dimensions on quantities: to first order, and by drawing mechanisms.

With exact slopes s_i = ∂f/∂d_i and independent dimensions of limits ± t_i, three standard deviations each,

    worst = Σ |s_i| t_i,      σ² = Σ (s_i t_i/3)²,      share_i = (s_i t_i/3)²/σ²

(the propagation of small errors; JCGM 100, GUM, eq. 10). Drawn mechanisms are solved as they are, whatever is small.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, named, number_of
from virtualwork.family.family import Family
from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.formulas.quantity import Quantity

# draws of one stream of random numbers
STREAM = 4096
# drawn numbers held at a time
HELD = 1 << 22
# the quantiles of three standard deviations
QUANTILES = (0.00135, 0.99865)


@dataclass(frozen=True, eq=False)
class Spread:
    """The effect of the tolerances on one number, pose by pose, to first order.

    Attributes
    ----------
    worst, sd : array (n,)
    shares : array (d, n)
        Of each dimension in the variance; 0 where there is none.
    """

    worst: Reals
    sd: Reals
    shares: Reals


def spread(slopes: Sequence[Reals], limits: Sequence[float]) -> Spread:
    """The worst case and the standard deviation of a number, from its slopes and the limits of the dimensions.

    >>> effect = spread([np.array([3.0]), np.array([-4.0])], [3.0, 3.0])
    >>> effect.worst, effect.sd, effect.shares[:, 0]
    (array([21.]), array([5.]), array([0.36, 0.64]))
    """
    moved = np.abs(np.asarray(slopes)) * np.asarray(limits)[:, None]
    variances = (moved / 3) ** 2
    total = variances.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = np.where(total > 0, variances / total, np.where(np.isnan(total), np.nan, 0.0))
    return Spread(moved.sum(axis=0), np.sqrt(total), shares)


def rounded(effect: Spread, errors: Sequence[Reals], limits: Sequence[float]) -> tuple[Reals, Reals]:
    """The rounding errors of worst case and standard deviation, (n,) each, from those of the slopes.

    >>> effect = spread([np.array([3.0]), np.array([-4.0])], [3.0, 3.0])
    >>> worst, sd = rounded(effect, [np.array([1e-9]), np.array([1e-9])], [3.0, 3.0])
    >>> worst.round(12), sd.round(12)
    (array([6.e-09]), array([1.414e-09]))
    """
    moved = np.asarray(errors) * np.asarray(limits)[:, None]
    own = len(limits) * EPS
    return moved.sum(axis=0) + own * effect.worst, np.sqrt(((moved / 3) ** 2).sum(axis=0)) + own * effect.sd


def limits(m: Description, requested: Mapping[str, float]) -> dict[Dimension, float]:
    """The limits of single numbers, of tolerances by path: that of a point holds for both coordinates.

    Raises
    ------
    DescriptionError
        Where a path names no number.
    """
    return {dimension: limit for path, limit in requested.items() for dimension in named(m, path)}


@dataclass(frozen=True, eq=False)
class Drawn:
    """The statistics of one number over drawn mechanisms, pose by pose, from those that are assembled.

    Attributes
    ----------
    mean, sd : array (n,)
    quantiles, errors : array (2, n)
        Those of ± three standard deviations of a normal distribution, and their own sampling errors (one standard
        deviation, from the order statistics beside them).
    """

    mean: Reals
    sd: Reals
    quantiles: Reals
    errors: Reals


def drawn_numbers(
    m: Description, limits: Mapping[Dimension, float], draws: int, seed: int, distribution: str
) -> dict[str, Reals]:
    """The numbers of drawn mechanisms by path, (draws,) each.

    Each stream of `STREAM` draws has its own seed, so that more draws leave the first ones as they were.

    Parameters
    ----------
    distribution : "normal" or "uniform"
        Normal with a third of the limit as standard deviation, and not cut off; or uniform between the limits.
    """
    streams = np.random.SeedSequence(seed).spawn(-(-draws // STREAM))
    parts = []
    for stream in streams:
        rng, shape = np.random.default_rng(stream), (STREAM, len(limits))
        parts.append(rng.normal(size=shape) / 3 if distribution == "normal" else rng.uniform(-1, 1, shape))
    unit = np.concatenate(parts)[:draws]
    return {
        d.path: float(number_of(m, d)) + limit * unit[:, i] for i, (d, limit) in enumerate(limits.items())
    }


def drawn(
    m: Description,
    numbers: Mapping[str, Reals],
    inputs: Reals,
    rates: Sequence[Any],
    keys: Sequence[Quantity],
    executor: Executor | None = None,
) -> Iterator[tuple[slice, list[Any], Any]]:
    """Quantities of drawn mechanisms, some poses at a time: (poses, values (draws, poses) of each key, assembled).

    Parameters
    ----------
    inputs : array (n, k)
    rates : speed and acceleration, as `Family.motion` takes them
    """
    family = Family(m, numbers)
    n, k = inputs.shape
    each = max(1, HELD // (len(family) * max(len(keys), 1)))
    for a in range(0, n, each):
        rows = slice(a, min(a + each, n))
        speed, acceleration = (r[rows] if np.ndim(r) else r for r in rates)
        q = inputs[rows]
        motion = family.motion(q[:, 0] if k == 1 else q, speed, acceleration, executor)
        yield rows, motion.values(list(keys)), motion.assembled


def summary(values: Reals, nominal: Reals, turn: float | None = None) -> Drawn:
    """Mean, standard deviation and quantiles of drawn values (draws, n); of an angle beside its nominal value, within a turn.

    >>> sample = summary(np.array([[359.0], [0.0], [np.nan]]), np.array([0.0]), 360.0)
    >>> float(sample.mean[0]), round(float(sample.sd[0]), 3)
    (359.5, 0.707)
    """
    apart = values - nominal
    if turn is not None:
        apart = apart - turn * np.round(apart / turn)
    ordered = np.sort(apart, axis=0)
    count = np.isfinite(apart).sum(axis=0)
    poses = np.arange(ordered.shape[1])
    quantiles, errors = np.full((2, len(poses)), np.nan), np.full((2, len(poses)), np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.nansum(apart, axis=0) / count
        # of none or one there is no deviation
        sd = np.sqrt(np.nansum((apart - mean) ** 2, axis=0) / np.where(count > 1, count - 1, np.nan))
        for i, p in enumerate(QUANTILES):
            # the order statistics: NaN stands last
            last = np.maximum(count - 1, 0)
            place = p * last
            low = np.floor(place).astype(int)
            high = np.minimum(low + 1, last)
            share = place - low
            quantiles[i] = (1 - share) * ordered[low, poses] + share * ordered[high, poses]
            aside = np.ceil(np.sqrt(count * p * (1 - p))).astype(int)
            ends = [np.clip(low + side * aside, 0, last) for side in (-1, 1)]
            errors[i] = (ordered[ends[1], poses] - ordered[ends[0], poses]) / 2
    mean, quantiles = nominal + mean, nominal + quantiles
    if turn is not None:
        # of what lies a rounding below zero the rest is the whole turn
        mean, quantiles = (np.mod(np.mod(x, turn), turn) for x in (mean, quantiles))
    return Drawn(mean, sd, quantiles, errors)
