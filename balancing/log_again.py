"""A log in numbers of 32 digits: the fit of its runs, with prior knowledge too, and the deviations of its corrections.

The formulas of `balancing.run_log`, `balancing.prior`, `balancing.reading_errors` and `balancing.log_balance`; every decision, such as
the rank of a fit, is that of the floats.
"""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing.dependence import columns_scaled
from balancing.second_run import applied, chosen, damped, product, pseudo_inverse
from dalembert.arithmetic.doubled import Doubled, doubled
from dalembert.arithmetic.doubled_arrays import Vectors
from dalembert.arithmetic.doubled_functions import DOUBLED
from dalembert.arithmetic.doubled_operations import part, total

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]


class ExactFit(NamedTuple):
    """A fit of runs: `balancing.run_log`, `balancing.prior`."""

    unknowns: Vectors
    """θ = (x₀, α), (..., s, 1 + p)."""
    gain: Vectors
    """(..., s, 1 + p, r)."""
    residual_sd: Doubled
    """The standard deviation of the runs alone, (...); NaN where no degree of freedom is left."""
    sources: Vectors | None = None
    """(..., s, 1 + p, q), as those of `Foreknown`."""


class ExactPrior(NamedTuple):
    """Prior knowledge of the coefficients, as `balancing.prior.Prior`."""

    mean: Vectors
    factor: Vectors
    root: Vectors


def exact_fit(readings: Vectors, masses: Vectors, present: Flags, degrees_of_freedom: Real) -> ExactFit:
    """Fit readings (..., r, s), of those `present`, with masses (..., r, p); of least norm where they do not determine θ."""
    read = np.swapaxes(present, -1, -2).astype(float)
    ones = Vectors.of(np.ones((*masses.shape[:-1], 1)))
    rows = Vectors.joined([ones, masses], axis=-1)[..., None, :, :] * read[..., None]
    scale = columns_scaled(rows.value)[1]
    gain = pseudo_inverse(rows * scale[..., None, :]) * scale[..., None] * read[..., None, :]
    y = readings.swapped() * read
    unknowns = applied(gain, y)
    square = total(total((y - applied(rows, unknowns)).square))
    spare = np.where(degrees_of_freedom > 0, degrees_of_freedom, np.nan)
    return ExactFit(unknowns, gain, DOUBLED.sqrt(square / spare))


def exact_mean(readings: Vectors, present: Flags, alpha: Vectors, degrees_of_freedom: Real) -> ExactFit:
    """Fit x₀ alone, with the coefficients (..., s, p) given."""
    none = Vectors.of(np.zeros((*present.shape[:-1], 0)))
    fit = exact_fit(readings, none, present, degrees_of_freedom)
    nothing = Vectors.of(np.zeros((*alpha.shape, present.shape[-2])))
    return ExactFit(
        Vectors.joined([fit.unknowns, alpha], axis=-1),
        Vectors.joined([fit.gain, nothing], axis=-2),
        fit.residual_sd,
    )


def exact_stored(mean: Vectors, covariance: Vectors) -> ExactPrior:
    """Return the prior of one machine, (s, p) and (s, p, p); the root of Γ is Cholesky's."""
    channels, planes = mean.shape
    root = Vectors.of(np.zeros(covariance.shape))
    for j in range(planes):
        for i in range(j, planes):
            rest = covariance[:, i, j] - (root[:, i, :j] * root[:, j, :j].conj()).sum()
            if i == j:
                # what is left in the rounding of 32 digits is nothing
                some = rest.x.high > 1e-28 * covariance[:, j, j].x.high
                size = DOUBLED.sqrt(chosen(some, rest.x, 1.0))
                rest = Vectors(size, size * 0.0) * size
            root[:, i, j] = (rest / size) * some.astype(float)
    factor = Vectors.of(np.zeros((channels, planes, channels, planes)))
    for s in range(channels):
        factor[s, :, s, :] = root[s]
    columns = [factor[..., s, k, None] for s in range(channels) for k in range(planes)]
    return ExactPrior(mean, Vectors.joined(columns, axis=-1), root)


def exact_pooled(each: Vectors, covariances: Vectors) -> ExactPrior:
    """Pool the coefficients of sister machines, (m, s, p) and (m, s, p, p): `balancing.prior.pooled_prior`."""
    machines = float(len(each.x.high))
    mean = each.sum(0) / np.array(machines)
    d = (each - mean[None]) / DOUBLED.sqrt(Doubled(np.array(machines - 1)))
    square = mean.square
    largest = float(square.high.max()) or 1.0
    scale = chosen(square.high > 0, square, largest)
    many = np.array(float(scale.high.size))

    def share(sizes: Doubled) -> Doubled:
        return total(total(sizes / scale)) / many

    whole = share(total(d.square, 0))
    own = Doubled(
        *(
            np.diagonal(x + 0.0 * covariances.x.high, axis1=-2, axis2=-1)
            for x in (covariances.x.high, covariances.x.low)
        )
    )
    taken = share(total(own, 0) / np.array(machines)) / whole if whole.high else Doubled(np.array(0.0))
    if taken.high > 1:
        taken = Doubled(np.array(1.0))
    left = Doubled(np.array(1.0)) + Doubled(np.array(1.0)) / machines - taken
    size = DOUBLED.sqrt(scale * (whole * left))
    root = part(size, (..., None)) * np.eye(each.shape[-1])
    factor = d * DOUBLED.sqrt(left)
    sources = Vectors.joined([factor[k][..., None] for k in range(int(machines))], axis=-1)
    return ExactPrior(mean, sources, Vectors(root, root * 0.0))


def exact_prior_fit(
    plain: ExactFit, readings: Vectors, masses: Vectors, present: Flags, prior: ExactPrior, deviation: Doubled
) -> ExactFit:
    """Fit runs with prior knowledge: `balancing.prior.fit_with_prior`; `deviation` (..., r, s) of the readings."""
    read = np.swapaxes(present, -1, -2)
    sd = chosen(present, deviation)
    sd = Doubled(*(np.swapaxes(x, -1, -2) for x in (sd.high, sd.low)))
    typical = total(sd) / read.sum(axis=-1).astype(float)
    least = part(typical, (..., None)) * Doubled.of(Fraction(1, 1000))
    low = sd.high < least.high
    floor = Doubled(np.where(low, least.high, sd.high), np.where(low, least.low, sd.low))
    weighed = read & (floor.high > 0)
    floor = chosen(weighed, floor, 1.0)
    root = part(typical, (..., None)) / floor
    root = chosen(weighed, root, np.where(read, 1.0, 0.0))
    square = root * root
    share = square / part(total(square), (..., None))
    w = masses[..., None, :, :]

    def centred(rows: Vectors) -> Vectors:
        mean = (rows * part(share, (..., None))).sum(-2)
        return (rows - mean[..., None, :]) * part(root, (..., None))

    runs, planes = masses.shape[-2:]
    steps = product(centred(w), prior.root)
    below = part(typical, (..., None, None)) * np.eye(planes)
    of_u = pseudo_inverse(Vectors.joined([steps, Vectors(below, below * 0.0)], axis=-2))[..., :runs]
    of_alpha = product(product(prior.root, of_u), centred(Vectors.of(np.eye(runs))))
    follows = Vectors.of(np.eye(planes)) - product(of_alpha, w)
    row = Vectors(share, share * 0.0)[..., None, :]
    on_average = product(row, w)
    gain = Vectors.joined([row - product(on_average, of_alpha), of_alpha], axis=-2)
    of_mean = Vectors.joined([-product(on_average, follows), follows], axis=-2)
    y = readings.swapped() * read.astype(float)
    unknowns = applied(gain, y) + applied(of_mean, prior.mean)
    return ExactFit(unknowns, gain, plain.residual_sd, product(of_mean, prior.factor))


class ExactErrors(NamedTuple):
    """Standard deviations of readings (..., r, s), along a direction of size 1 and across it."""

    unit: Vectors
    along: Doubled
    across: Doubled


def correction_deviations(
    fit: ExactFit,
    initial: Vectors,
    corrections: Vectors,
    given: Vectors,
    errors: ExactErrors,
    weights: Real | None = None,
    ridge: float | Doubled = 0.0,
) -> tuple[Doubled, Doubled]:
    """Return the deviations of least-squares corrections (..., p), as given, along themselves and across.

    As `balancing.reading_errors` and `LogBalance.covariance` have them. `initial`: (..., s), the vibration without masses;
    `corrections`: all that is added to the rotor without masses; `given`: what is added to it as it stands.
    """
    alpha = fit.unknowns[..., 1:]
    channels = alpha.shape[-2]
    w = np.ones(alpha.shape[:-1]) if weights is None else weights
    root = DOUBLED.sqrt(Doubled(w))
    a = alpha * part(root, (..., None))
    ridge = doubled(ridge)
    inverse = pseudo_inverse(damped(ridge, a) if ridge.high else a)
    own = inverse[..., :channels] * part(root, (..., None, slice(None)))
    m = product(inverse, inverse.swapped().conj())[..., :, None, :]
    left = (initial + applied(alpha, corrections)) * w
    ones = Vectors.of(np.ones((*corrections.shape[:-1], 1)))
    linear = -(own[..., None] * Vectors.joined([ones, corrections], axis=-1)[..., None, None, :])
    antilinear = -(m * left[..., None, :, None])
    if ridge.high:
        square = ridge * ridge
        pulled = alpha * given[..., None, :] * w[..., None] * square
        antilinear = antilinear - m * pulled[..., None, :, :]
        back = alpha.conj() * given[..., None, :] * w[..., None] * square
        linear[..., 1:] = linear[..., 1:] - m * back[..., None, :, :]
    size = given.size
    some = size.high > 0
    turn = given.conj() / chosen(some, size, 1.0)
    turn = turn + Vectors.of((~some).astype(complex))
    squares = [Doubled(np.zeros(some.shape)) for _ in range(2)]

    def add(gain: Vectors, unit: Vectors | None, along: Doubled, across: Doubled) -> None:
        """Add the squares of what errors (..., s, n) bring, by the gain (..., s, 1 + p, n) of the unknowns."""
        first = (linear[..., None] * gain[..., None, :, :, :]).sum(-2)
        second = (antilinear[..., None] * gain[..., None, :, 1:, :].conj()).sum(-2)
        if unit is None:
            # the same errors in all channels
            first, second = first.sum(-2)[..., None, :], second.sum(-2)[..., None, :]
        else:
            first, second = first * unit[..., None, :, :], second * unit[..., None, :, :].conj()
        first, second = first * turn[..., None, None], second * turn[..., None, None]
        radial, aside = (first + second) * along, (first - second) * across
        for k, parts in enumerate(((radial.x, aside.y), (radial.y, aside.x))):
            for one in parts:
                squares[k] = squares[k] + total(total(one * one))

    def by_channel(x: Doubled) -> Doubled:
        return Doubled(*(np.swapaxes(y, -1, -2)[..., None, :, :] for y in (x.high, x.low + 0.0 * x.high)))

    add(fit.gain, errors.unit.swapped(), by_channel(errors.along), by_channel(errors.across))
    if fit.sources is not None:
        half = DOUBLED.sqrt(Doubled(np.array(0.5)))
        add(fit.sources, None, half, half)
    along, across = (DOUBLED.sqrt(x) for x in squares)
    return along, across
