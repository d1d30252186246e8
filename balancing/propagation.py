"""First-order propagation of errors of readings to the corrections of least squares."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from balancing.dependence import adjoint, damping_norms, design, directions

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def response(
    alpha: Complex,
    corrections: Complex,
    left: Complex,
    weights: Real,
    ridge: float = 0.0,
    damped: Complex | None = None,
) -> tuple[Complex, Complex]:
    """Return how least-squares corrections follow x₀ and α: L and A, (..., p, s, 1 + p) each.

    Parameters
    ----------
    alpha, corrections, left, weights, ridge
        α (..., s, p), w (..., p), the residual e = x₀ + α w (..., s), and the weights (..., s) and λ they were found with.
    damped
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
    if ridge:
        norms = ridge * damping_norms(a)
        a = np.concatenate([a, norms[..., None] * np.eye(norms.shape[-1])], axis=-2)
    scale = 1 / np.linalg.norm(a, axis=-2)
    q, r = np.linalg.qr(a * scale[..., None, :])
    inverse = np.linalg.inv(r) * scale[..., None]
    gain = (inverse @ adjoint(q))[..., : alpha.shape[-2]] * root[..., None, :]
    m = inverse @ adjoint(inverse)
    linear = -gain[..., None] * design(corrections)[..., None, None, :]
    antilinear = np.zeros_like(linear)
    antilinear[..., 1:] = -m[..., :, None, :] * (weights * left)[..., None, :, None]
    if ridge:
        added = (corrections if damped is None else damped)[..., None, :]
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
    return np.asarray(parts @ np.swapaxes(parts, -1, -2))
