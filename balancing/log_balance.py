"""Corrections from a log of runs, and how sure they are: of themselves, of what they leave, of the next reading."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.balance import least_squares
from balancing.dependence import design, directions
from balancing.reading_errors import Errors, components, response, wider_draws
from balancing.run_log import JointFit
from dalembert.arithmetic.records import numbers, record
from dalembert.arithmetic.shapes import filled, floats

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def region_factor(probability: float, degrees_of_freedom: ArrayLike, dimensions: int = 2) -> Real:
    """Return the k of the region δᵀV⁻¹δ ≤ k² that contains the true value with a given probability.

    Parameters
    ----------
    probability
        Between 0 and 1.
    degrees_of_freedom
        ν complex degrees of freedom of the covariance V, (...); inf for an exact V.
    dimensions
        The real dimensions n of δ.

    Returns
    -------
    ndarray
        k, (...); NaN if ν is 0.

    Notes
    -----
    k² = n F(n, 2ν) (G. A. F. Seber, A. J. Lee, Linear Regression Analysis, 2003, section 5.1); χ² if ν is inf.

    Examples
    --------
    >>> region_factor(0.95, [1, 4, np.inf]).round(3)
    array([6.164, 2.986, 2.448])
    """
    from scipy.special import fdtri, gammaincinv

    nu = np.asarray(degrees_of_freedom, dtype=float)
    exact = np.isinf(nu)
    real = np.where(exact | ~(nu > 0), 1.0, 2 * nu)
    square = np.where(
        exact, 2 * gammaincinv(dimensions / 2, probability), dimensions * fdtri(dimensions, real, probability)
    )
    return np.asarray(np.sqrt(np.where(nu > 0, square, np.nan)))


@record
class Spread(NamedTuple):
    """Covariances along a vector and across it, (..., 2, 2), and the complex degrees of freedom of each, (...)."""

    covariance: Real
    degrees_of_freedom: Real


class CoefficientSpread(NamedTuple):
    """The uncertainty of influence coefficients, in SI units."""

    along: Real
    """Standard deviation along each coefficient and across it, (..., s, p); NaN where it is not known."""
    across: Real
    correlation: Complex
    """The correlation of the errors of each channel's planes, E δ_p δ̄_q/√(E|δ_p|² E|δ_q|²), (..., s, p, p)."""
    reading_sd: Real
    """√E|ε|² of the readings, (...); NaN where it is not known."""
    degrees_of_freedom: Real
    """Complex, (...); inf where the errors are stated."""


@record
@dataclass(frozen=True, eq=False, repr=False)
class LogBalance:
    """Corrections of a rotor whose log was fitted, with their uncertainty.

    The uncertainties are NaN where the squares of readings or coefficients leave the range of doubles (below 1e-150 or beyond
    1e150): choose another unit.

    Examples
    --------
    >>> from balancing import joint_fit, least_squares
    >>> on = np.array([[0], [1], [1j], [-1]])
    >>> fit = joint_fit(5 + 2 * on + 0.1 * np.array([[1], [-1], [0], [1]]), on)
    >>> found = LogBalance(fit, least_squares(fit.influence, fit.initial).corrections, fit.scatter())
    >>> found.corrections.round(3), found.deviations[0].round(3)
    (array([-2.608+0.003j]), array([0.049]))
    """

    fit: JointFit
    corrections: Complex
    """The masses to ADD to the rotor without masses, (..., p), by least squares."""
    errors: Errors
    weights: Real | None = None
    """The weights of the channels in the least squares of the corrections, (..., s)."""
    along: Complex | None = None
    """The corrections as given, where they are added to masses that stand, (..., p): their directions count, and a ridge damps them."""
    ridge: float = 0.0
    """The ridge of the least squares of the corrections."""

    def __repr__(self) -> str:
        w, errors = numbers(self.corrections), numbers(self.errors.degrees_of_freedom)
        return f"LogBalance(corrections={w}, residual={numbers(self.residual)}, degrees_of_freedom={errors})"

    def machine(self, i: int) -> LogBalance:
        """Return the balance of one of many machines, along the leading axis."""
        weights, along = (None if part is None else part[i] for part in (self.weights, self.along))
        errors = self.errors.machine(i)
        return LogBalance(self.fit.machine(i), self.corrections[i], errors, weights, along, self.ridge)

    def plot(
        self,
        sensors: Sequence[str] = (),
        planes: Sequence[str] = (),
        amplitude: str = "",
        figure: FigureBase | None = None,
    ) -> NDArray[np.object_]:
        """Draw the vibration before and after, and the corrections to add.

        Parameters
        ----------
        sensors, planes
            Their names.
        amplitude
            The unit of the vibration.
        figure
            Where to draw; None: a new figure of pyplot's.

        Returns
        -------
        array of matplotlib's polar axes: vibration, corrections; one machine's (see `machine`)

        Raises
        ------
        ImportError
            matplotlib (the extra `plot`) is missing.
        """
        from balancing.picture import before_and_after

        fit = self.fit
        here = fit.present
        history = fit.readings[here], (fit.readings - fit.residuals)[here]
        return before_and_after(
            fit.initial, self.residual, self.corrections, amplitude, sensors, planes, history, figure
        )

    @cached_property
    def residual(self) -> Complex:
        """The fitted vibration with the corrections on, (..., s); 0 within rounding."""
        left = self.fit.fitted(self.corrections[..., None, :])[..., 0, :]
        return np.asarray(np.where(np.abs(left) > self._rounding, left, 0.0))

    @property
    def _rounding(self) -> Real:
        """The possible rounding of `residual`, (..., s)."""
        noise = np.abs(self.fit.initial) + np.matvec(np.abs(self.fit.influence), np.abs(self.corrections))
        return np.asarray(1e-15 * noise)

    def _by_channel(self) -> tuple[Complex, Real, Real]:
        """Direction and deviations of the readings of each channel, (..., s, r) each."""
        errors = self.errors
        along, across = np.swapaxes(errors.along, -1, -2), np.swapaxes(errors.across, -1, -2)
        return np.swapaxes(errors.unit, -1, -2), along, across

    def _each(self) -> tuple[Complex, Real, Real]:
        """Return these for all readings in one row, (..., s·r) each."""
        unit, along, across = self._by_channel()
        flat = (*unit.shape[:-2], -1)
        return unit.reshape(flat), along.reshape(flat), across.reshape(flat)

    @property
    def covariance(self) -> Real:
        """The covariance of each correction along itself (its size) and across (its angle), (..., p, 2, 2), kg²."""
        return self._spread.covariance

    @property
    def degrees_of_freedom(self) -> Real:
        """Complex, of the covariance of each correction, (..., p)."""
        return self._spread.degrees_of_freedom

    @cached_property
    def _spread(self) -> Spread:
        fit = self.fit
        weights = np.ones(fit.initial.shape) if self.weights is None else self.weights
        left = fit.fitted(self.corrections[..., None, :])[..., 0, :]
        along = self.corrections if self.along is None else self.along
        linear, antilinear = response(fit.influence, self.corrections, left, weights, self.ridge, along)
        # θ = gain y: from the unknowns of each channel to its readings
        by_channel = np.moveaxis(linear, -3, -2), np.moveaxis(antilinear, -3, -2)
        of_readings = (
            np.moveaxis(part @ gain, -3, -2)
            for part, gain in zip(by_channel, (fit.gain, fit.gain.conj()), strict=True)
        )
        flat = [part.reshape(*part.shape[:-2], -1) for part in of_readings]
        own = components(flat[0], flat[1], along, *self._each())
        prior = fit.foreknown
        if prior is None:
            return self._together(own, None)
        # the errors of prior knowledge are shared by channels
        shared = np.einsum("...psn,...snq->...pq", linear, prior.sources)
        other = np.einsum("...psn,...snq->...pq", antilinear, prior.sources.conj())
        return self._together(own, components(shared, other, along, *_unit_errors(prior.sources)))

    def _together(self, own: Real, before: Real | None) -> Spread:
        """Add the covariances (..., k, 2, 2) of readings and of prior knowledge."""
        nu = np.asarray(self.errors.degrees_of_freedom, dtype=float)[..., None]
        if before is None or self.fit.foreknown is None:
            return Spread(own, np.broadcast_to(nu, own.shape[:-2]))
        # Welch and Satterthwaite
        a, b = (np.trace(floats(part), axis1=-2, axis2=-1) for part in (own, before))
        whole = np.square(a) / nu + np.square(b) / self.fit.foreknown.degrees_of_freedom[..., None]
        both = np.square(a + b)
        freedom = np.where(
            whole > 0, both / np.where(whole > 0, whole, 1.0), np.where(np.isnan(whole), np.nan, np.inf)
        )
        return Spread(own + before, freedom)

    @property
    def coefficients(self) -> CoefficientSpread | None:
        """The uncertainty of the influence coefficients; None if it is undetermined."""
        fit, errors = self.fit, self.errors
        gain = fit.gain[..., 1:, :]
        unit, along, across = self._by_channel()
        covariance = components(gain, None, fit.influence, unit, along, across)
        shared = (gain * (np.square(along) + np.square(across))[..., None, :]) @ np.swapaxes(
            gain, -1, -2
        ).conj()
        if fit.foreknown is not None:
            sources = fit.foreknown.sources[..., 1:, :]
            more = sources @ np.swapaxes(sources, -1, -2).conj()
            shared = shared + more
            own = np.diagonal(more, axis1=-2, axis2=-1).real / 2
            covariance = covariance + own[..., None, None] * np.eye(2)
        if not np.isfinite(covariance).any():
            return None
        size = np.sqrt(np.diagonal(shared, axis1=-2, axis2=-1).real)
        both = size[..., :, None] * size[..., None, :]
        square = np.where(fit.present, np.square(errors.along) + np.square(errors.across), 0.0)
        finite = np.isfinite(errors.degrees_of_freedom)
        return CoefficientSpread(
            np.sqrt(covariance[..., 0, 0]),
            np.sqrt(covariance[..., 1, 1]),
            np.where(both > 0, shared / np.where(both > 0, both, 1.0), 0.0),
            np.sqrt(square.sum(axis=(-2, -1)) / fit.present.sum(axis=(-2, -1))),
            np.where(finite, errors.degrees_of_freedom, np.inf),
        )

    def unknown_samples(self, n: int = 200, seed: int = 0) -> Complex:
        """Draw x₀ and α of one machine from the errors of its readings, (n, s, 1 + p)."""
        rng, fit = np.random.default_rng(seed), self.fit
        # of one machine among many the strides differ, and with them the order in which products are summed
        gain = np.ascontiguousarray(fit.gain)
        drawn = fit.unknowns + np.matvec(gain, self.errors.draw(fit.readings, n, rng))
        if fit.foreknown is None:
            return np.asarray(drawn)
        sources = np.ascontiguousarray(fit.foreknown.sources)
        one, other = rng.standard_normal((2, n, 1, sources.shape[-1])) / np.sqrt(2)
        return np.asarray(drawn + np.matvec(sources, one + 1j * other))

    def problem_samples(self, n: int = 200, seed: int = 0) -> Iterator[tuple[Complex, Complex]]:
        """Draw coefficients (s, p) and vibration (s,) of one machine from the errors of its readings."""
        for unknowns in self.unknown_samples(n, seed):
            yield unknowns[:, 1:], unknowns[:, 0]

    def correction_samples(self, n: int = 4000, seed: int = 0) -> Complex:
        """Draw least-squares corrections (n, p) of one machine from readings with their errors (Monte Carlo)."""
        drawn = self.unknown_samples(n, seed)
        alpha, here = drawn[..., 1:], drawn[..., 0]
        if not self.ridge or self.along is None:
            return least_squares(alpha, here, self.weights, ridge=self.ridge).corrections
        standing = self.corrections - self.along
        fix = least_squares(alpha, here + alpha @ standing, self.weights, ridge=self.ridge)
        return np.asarray(fix.corrections + standing)

    def residual_samples(self, n: int = 4000, seed: int = 0) -> Complex:
        """Draw the true vibration (n, s) of one machine with its corrections on, Student's errors included.

        At fixed corrections it is linear in the readings: no further approximation is made.
        """
        rng = np.random.default_rng(seed)
        masses = np.concatenate([[1.0], self.corrections])
        share = np.vecmat(masses.conj(), np.ascontiguousarray(self.fit.gain))
        error = (share * self.errors.draw(self.fit.readings, n, rng, student=True)).sum(axis=-1)
        prior = self.fit.foreknown
        if prior is not None:
            share = np.vecmat(masses.conj(), prior.sources)
            one, other = rng.standard_normal((2, n, share.shape[-1])) / np.sqrt(2)
            wider = wider_draws(rng, float(prior.degrees_of_freedom), n)
            error = error + wider * ((one + 1j * other) @ share.T)
        return np.asarray(self.residual + error)

    @property
    def deviations(self) -> tuple[Real, Real]:
        """Standard deviations of each correction's size, kg, and across it, kg, (..., p) each."""
        return np.sqrt(self.covariance[..., 0, 0]), np.sqrt(self.covariance[..., 1, 1])

    def region(self, probability: float = 0.95) -> Real:
        """Return the ellipse of each correction that holds the true one with this probability, (..., p, 2, 2).

        Its columns are the semi-axes, kg, in the coordinates along the correction and across it.
        """
        size, axes = np.linalg.eigh(self.covariance)
        k = region_factor(probability, self.degrees_of_freedom)[..., None]
        return np.asarray(axes * (k * np.sqrt(np.maximum(size, 0.0)))[..., None, :])

    def vibration_deviation(self, masses: ArrayLike, *, reading: bool = False) -> Real:
        """Standard deviation of the fitted vibration's amplitude with these masses on, (..., p) -> (..., s)."""
        return np.asarray(np.sqrt(self.vibration_spread(masses, reading=reading).covariance[..., 0, 0]))

    def vibration_spread(self, masses: ArrayLike, *, reading: bool = False) -> Spread:
        """Covariance of the fitted vibration with these masses on, along itself and across, (..., p) -> (..., s, 2, 2).

        With `reading` the scatter of one more reading is included: that of the mean weight, or of the errors stated.
        """
        w = np.asarray(masses, dtype=complex)
        value = self.fit.fitted(w[..., None, :])[..., 0, :]
        rows = design(w)
        gain = np.vecmat(rows[..., None, :].conj(), self.fit.gain)
        own = components(gain[..., None, :], None, value[..., None], *self._by_channel())[..., 0, :, :]
        if reading:
            own = own + self._own(value)
        prior = self.fit.foreknown
        if prior is None:
            return self._together(own, None)
        share = np.vecmat(rows[..., None, :].conj(), prior.sources)
        before = components(share[..., None, :], None, value[..., None], *_unit_errors(share))
        return self._together(own, before[..., 0, :, :])

    def _own(self, value: Complex) -> Real:
        """Covariance of a reading of this value, along itself and across, (..., s, 2, 2)."""
        read = self.fit.present
        errors = self.errors.along, self.errors.across
        if np.isinf(self.errors.degrees_of_freedom).all():
            # errors relative to the amplitude: those of a reading of this size
            size = np.where(read, np.abs(self.fit.readings), 0.0).max(axis=-2)
            shares = [np.max(error, axis=-2) / np.where(size > 0, size, 1.0) for error in errors]
            own = [np.square(share * np.abs(value)) for share in shares]
        else:
            squares = [np.where(read, np.square(error), 0.0) for error in errors]
            own = [square.sum(axis=-2) / read.sum(axis=-2) for square in squares]
        return np.asarray(np.stack(own, axis=-1)[..., None] * np.eye(2))

    def probability_within(self, limit: ArrayLike) -> Real:
        """Probability that the corrections as given leave each channel's true vibration within a limit, (..., s).

        The true vibration is x + σ√q z with z a circular normal vector and σ known to its degrees of freedom: the
        noncentral χ² of |·|², averaged over σ (Gauss-Legendre in its probability).
        """
        from scipy.special import chndtr, gammaincinv

        ceiling = np.broadcast_to(np.asarray(limit, dtype=float), self.residual.shape)
        spread = self.vibration_spread(self.corrections)
        variance, nu = spread.covariance[..., 0, 0], spread.degrees_of_freedom
        node, share = np.polynomial.legendre.leggauss(80)
        node, share = (node + 1) / 2, share / 2
        exact = np.isinf(nu)
        real = np.where(exact | ~(nu > 0), 1.0, nu)[..., None]
        ratio = np.where(exact[..., None], 1.0, real / gammaincinv(real, node))
        # scatter below the last digit of the limit and of the vibration decides nothing
        size = np.maximum(ceiling, np.abs(self.residual))
        matters = np.sqrt(np.maximum(variance, 0.0)) > np.finfo(float).eps * size
        true = np.maximum(np.where(matters, variance, 1.0)[..., None] * ratio, np.finfo(float).tiny)
        square = (
            np.square(np.where(matters, ceiling, 0.0)),
            np.square(np.where(matters, np.abs(self.residual), 0.0)),
        )
        within = chndtr(square[0][..., None] / true, 2.0, square[1][..., None] / true)
        sure = (np.abs(self.residual) <= ceiling + self._rounding).astype(float)
        # rounding may bring what is certain above 1, by 3e-14 with scipy before 1.17
        probability = np.where(matters, np.minimum(within @ share, 1.0), sure)
        return np.asarray(np.where(nu > 0, probability, np.nan))


def _unit_errors(sources: Complex) -> tuple[Complex, Real, Real]:
    """Direction and deviations of circular errors z, E|z|² = 1, one for each column of (..., q)."""
    ones = np.ones(sources.shape[-1])
    half = ones / np.sqrt(filled((), 2.0, sources.real))
    return ones.astype(complex), half, half


def spread(samples: Complex, about: Complex) -> Real:
    """Return the covariance (p, 2, 2) of drawn corrections (n, p), along and across the nominal ones.

    Parameters
    ----------
    samples
        Drawn corrections, complex (n, p), kg.
    about
        The nominal corrections, complex (p,), kg.

    Returns
    -------
    ndarray
        (p, 2, 2), kg²: the first axis along the nominal correction, the second across it.

    Examples
    --------
    >>> spread(np.array([[2.1 + 0j], [1.9 + 0j]]), np.array([2.0 + 0j])).round(3) + 0.0
    array([[[0.01, 0.  ],
            [0.  , 0.  ]]])
    """
    turned = (samples - about) * directions(about.conj())
    parts = np.stack([turned.real, turned.imag])
    return np.asarray(np.einsum("anp,bnp->pab", parts, parts) / len(samples))
