"""The errors of readings: their standard deviations, draws of them, and what they do to the corrections to first order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from balancing.dependence import adjoint, damped, design, directions
from balancing.qr import inverses
from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, floats

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@record
@dataclass(frozen=True, eq=False, repr=False)
class Errors:
    """Standard deviations of readings, independent of one another: along the direction `unit` and across it."""

    unit: Complex
    """(..., r, s), size 1."""
    along: Real
    across: Real
    degrees_of_freedom: Real
    """Complex, of the estimate they are; inf where they are known. (...)"""
    phase: Real | None = None
    """Where the error across is one of the phase, which turns the reading: in rad, (..., r, s); 0 elsewhere."""
    stated: NDArray[np.bool_] | None = None
    """Where the error along is known and no estimate, (..., r, s); across that is where it is one of the phase."""

    def machine(self, i: int) -> Errors:
        """Return those of one of many machines, along the leading axis."""
        phase, stated = (None if part is None else part[i] for part in (self.phase, self.stated))
        return Errors(self.unit[i], self.along[i], self.across[i], self.degrees_of_freedom[i], phase, stated)

    def draw(self, readings: Complex, n: int, rng: np.random.Generator, *, student: bool = False) -> Complex:
        """Draw errors of one machine's readings (r, s), (n, s, r); with `student` those of an estimate are the wider."""
        unit, along, across = (np.swapaxes(part, -1, -2) for part in (self.unit, self.along, self.across))
        one, other = rng.standard_normal((2, n, *unit.shape))
        if student:
            wider = wider_draws(rng, float(self.degrees_of_freedom), n)[..., None]
            one = one * (wider if self.stated is None else np.where(self.stated.T, 1.0, wider))
            other = other * (wider if self.phase is None else np.where(self.phase.T > 0, 1.0, wider))
        if self.phase is None:
            return np.asarray(unit * (along * one + 1j * across * other))
        turn, y = self.phase.T, np.nan_to_num(readings.T)
        aside = 1j * unit * np.where(turn > 0, 0.0, across) * other
        return np.asarray((y + unit * along * one) * np.exp(1j * turn * other) + aside - y)


def wider_draws(rng: np.random.Generator, degrees_of_freedom: float, n: int) -> Real:
    """Draw by what factor σ may be larger than its estimate, (n, 1)."""
    if not 0 < degrees_of_freedom < np.inf:
        return np.ones((n, 1))
    return np.asarray(np.sqrt(degrees_of_freedom / rng.gamma(degrees_of_freedom, size=n))[:, None])


def response(
    alpha: Complex,
    corrections: Complex,
    left: Complex,
    weights: Real,
    ridge: float = 0.0,
    along: Complex | None = None,
) -> tuple[Complex, Complex]:
    """Return how least-squares corrections follow x₀ and α: L and A, (..., p, s, 1 + p) each.

    Parameters
    ----------
    alpha, corrections, left, weights, ridge
        α (..., s, p), w (..., p), the residual e = x₀ + α w (..., s), and the weights (..., s) and λ they were found with.
    along
        What the ridge damps, (..., p): the corrections as given, where they are added to masses that stand; None: w.

    Notes
    -----
    The corrections have αᴴW(x₀ + αw) = 0. With M = (αᴴWα)⁻¹ = R⁻¹R⁻ᴴ of the QR factors its differential is

        dw = -M αᴴW (dx₀ + dα w) - M dαᴴ W e,

    linear (L) in θ = (x₀, α) and, because the coefficients have errors too, antilinear (A). The ridge follows the
    coefficients as well: λ² ‖α_p‖² w_p.

    Examples
    --------
    One sensor, one plane, w = -x₀/α:

    >>> one = np.ones((1, 1), complex)
    >>> response(2 * one, -3 * one[0], 0 * one[0], np.ones(1))[0].real
    array([[[-0.5,  1.5]]])
    """
    root = np.sqrt(weights)
    a = root[..., None] * alpha
    damps = bool(floats(ridge))
    inverse, half = inverses(damped(a, ridge) if damps else a)
    gain = inverse[..., : alpha.shape[-2]] * root[..., None, :]
    m = half @ adjoint(half)
    linear = -gain[..., None] * design(corrections)[..., None, None, :]
    antilinear = np.zeros_like(linear)
    antilinear[..., 1:] = -m[..., :, None, :] * (weights * left)[..., None, :, None]
    if damps:
        added = (corrections if along is None else along)[..., None, :]
        pull = ridge**2 * (weights[..., None] * alpha * added)[..., None, :, :]
        back = ridge**2 * (weights[..., None] * alpha.conj() * added)[..., None, :, :]
        antilinear[..., 1:] -= m[..., :, None, :] * pull
        linear[..., 1:] -= m[..., :, None, :] * back
    return linear, antilinear


def components(
    linear: Complex, antilinear: Complex | None, direction: Complex, unit: Complex, along: Real, across: Real
) -> Real:
    """Return the covariance (..., p, 2, 2) along directions (..., p) and across them.

    Parameters
    ----------
    linear, antilinear
        How the quantities (..., p) follow the readings (..., n) and their conjugates, (..., p, n).
    direction
        Any size; where it is 0 that of the real axis is taken.
    unit, along, across
        Each reading's direction, and its standard deviation along and across it, (..., n).
    """
    back = directions(direction.conj())[..., None]
    turned = back * linear * unit[..., None, :]
    other = 0.0 if antilinear is None else back * antilinear * unit.conj()[..., None, :]
    radial = (turned + other) * along[..., None, :]
    aside = 1j * (turned - other) * across[..., None, :]
    parts = np.concatenate([radial, aside], axis=-1)
    parts = np.stack([parts.real, parts.imag], axis=-2)
    return as_array(parts @ np.swapaxes(parts, -1, -2))
