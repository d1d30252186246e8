"""Prior knowledge of a machine: influence coefficients of sister machines, which enter the fit of its runs.

Of m sister machines the coefficients α_k are known, each with the error of its own runs. The mean α̂ of m differs from the
α of a further machine as machines differ from one another, and their scatter shows by how much. The trade calls the use of it
one-shot balancing: the first correction comes before any trial run. It enters the fit of a machine's own runs
as mixed estimation (Theil and Goldberger, Int. Econ. Rev. 2 (1961) 65-78),

    min  Σ_j |y_j - x₀ - Σ_p α_p w_jp|²/σ²  +  (α - α̂)ᴴ Γ⁻¹ (α - α̂),

so that informative runs count more.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.dependence import adjoint, columns_scaled, design, threshold
from balancing.qr import pseudo_inverse
from balancing.run_log import Foreknown, JointFit
from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, as_vectors, filled, floats, in_32_digits, is_doubled

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_arrays import Vectors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@record
@dataclass(frozen=True, eq=False, repr=False)
class Prior:
    """Influence coefficients from earlier measurements, and the scatter of one machine about them."""

    mean: Complex
    """α̂, (..., s, p)."""
    factor: Complex
    """(..., s, p, q): a machine's α lies from α̂ by factor·z, the q errors z circular with E|z|² = 1."""
    degrees_of_freedom: Real
    """Complex, of the estimate that the factor is; inf where it is known. (...)"""
    root: Complex
    """A root of the Γ that each channel's coefficients are weighed with, (..., s, p, p)."""
    scatter: Real
    """Between machines, as a share of the coefficients' size: √(mean of |α_k - α̂|²/|α̂|²), readings' errors taken off; NaN
    of one machine. (...)"""


def stored_prior(mean: ArrayLike, covariance: ArrayLike, degrees_of_freedom: ArrayLike = np.inf) -> Prior:
    """Return the prior of one machine from its coefficients (..., s, p) and their covariance (..., s, p, p).

    One machine does not show how machines differ: the prior is for the same machine, or for one exactly like it.

    Parameters
    ----------
    mean
        α, complex (..., s, p), amplitude per kg.
    covariance
        E δδᴴ of the errors of each channel, (..., s, p, p).
    degrees_of_freedom
        Complex degrees of freedom of the covariance, (...).

    Raises
    ------
    ValueError
        A covariance with a negative eigenvalue, or shapes that do not fit.

    Examples
    --------
    >>> stored_prior([[2.0]], [[[0.04]]]).factor
    array([[[0.2+0.j]]])
    """
    alpha, c = as_vectors(mean), as_vectors(covariance)
    channels, planes = alpha.shape[-2:]
    if c.shape != (*alpha.shape, planes):
        raise ValueError(f"shapes do not fit: mean {alpha.shape}, covariance {c.shape}")
    root = _root(c)
    # the channels' errors are independent of one another
    factor = np.zeros_like(root.real, dtype=complex, shape=(*alpha.shape, channels, planes))
    for s in range(channels):
        factor[..., s, :, s, :] = root[..., s, :, :]
    lead = alpha.shape[:-2]
    nu = np.broadcast_to(np.asarray(degrees_of_freedom, dtype=float), lead)
    return Prior(alpha, factor.reshape(*alpha.shape, channels * planes), nu, root, np.full(lead, np.nan))


def _root(covariance: Complex) -> Complex:
    """A root (..., p, p) of covariances."""
    if is_doubled(covariance):
        from balancing.second_run import root_of

        doubled: Any = covariance
        return as_vectors(root_of(doubled))
    size, axes = np.linalg.eigh(covariance)
    if not (size > -1e-9 * np.abs(size).max(axis=-1, keepdims=True, initial=1e-300)).all():
        raise ValueError("a covariance must not be negative")
    return np.asarray(axes * np.sqrt(np.maximum(size, 0.0))[..., None, :])


def pooled_prior(coefficients: ArrayLike, covariances: ArrayLike | None = None) -> Prior:
    """Pool the coefficients of sister machines, (m, s, p) with m ≥ 2, and estimate their scatter.

    Parameters
    ----------
    coefficients
        α of each machine, complex (m, s, p), amplitude per kg.
    covariances
        E δδᴴ of the error of each, (m, s, p, p); None: no errors.

    Returns
    -------
    Prior
        `.mean` (s, p), `.scatter` (relative), `.degrees_of_freedom` m - 1.

    Raises
    ------
    ValueError
        Fewer than two machines, or another shape.

    Notes
    -----
    All machines count alike. With D the deviations from their mean, T = DDᴴ/(m - 1) is the covariance of all coefficients of a
    machine together, whatever is common to its sensors and planes, with m - 1 complex degrees of freedom; it holds the scatter
    of machines and the mean S of `covariances`. A further machine differs from the mean by T - S + T/m, taken as
    T·(1 + 1/m - min(1, tr S/tr T)), the traces of relative sizes. In the fit each coefficient is weighed with the mean relative
    scatter of all.

    Examples
    --------
    >>> found = pooled_prior([[[2.0]], [[2.4]], [[1.6]]])
    >>> found.mean, found.scatter.round(3), found.degrees_of_freedom
    (array([[2.+0.j]]), np.float64(0.2), array(2.))
    """
    each = as_vectors(coefficients)
    if each.ndim != 3 or len(each) < 2:
        raise ValueError(f"expected coefficients (m, s, p) of two machines or more, found shape {each.shape}")
    machines = filled((), float(len(each)), each.real)
    mean = each.sum(axis=0) / machines
    d = np.moveaxis(each - mean, 0, -1) / np.sqrt(machines - 1)
    square = np.square(np.abs(mean))
    scale = np.where(square > 0, square, floats(square).max() or 1.0)

    def share(sizes: Real) -> Real:
        """The mean of sizes (s, p), each as a share of the coefficient's own."""
        shares = (sizes / scale).reshape(-1)
        return as_array(shares.sum(axis=-1) / len(shares))

    whole = share(np.square(np.abs(d)).sum(axis=-1))
    taken = filled((), 0.0, whole)
    if covariances is not None and whole != 0:
        own = np.diagonal(as_vectors(covariances), axis1=-2, axis2=-1).real
        taken = np.minimum(share(own.sum(axis=0) / machines) / whole, 1.0)
    left = 1 + 1 / machines - taken
    root = np.sqrt(whole * left * scale)[..., None] * np.eye(mean.shape[-1], dtype=complex)
    scatter = as_array(np.sqrt(whole * (1 - taken)))
    return Prior(mean, d * np.sqrt(left), np.asarray(float(len(each) - 1)), root, scatter)


def fit_with_prior(
    readings: ArrayLike, masses: ArrayLike, prior: Prior, deviation: ArrayLike | None = None
) -> JointFit:
    """Fit initial vibration and coefficients to runs and to earlier coefficients.

    Parameters
    ----------
    readings, masses
        As for `joint_fit`, (..., r, s) and (..., r, p); no run with a mass is needed.
    prior
        Of (s, p), or (..., s, p).
    deviation
        √E|ε|² of the readings, (..., r, s) or what broadcasts; None: as the runs alone scatter, and where they leave no
        degree of freedom 0, so that the prior serves for what the runs do not determine.

    Returns
    -------
    JointFit
        Its degrees of freedom, `residual_sd` and `standardized` residuals are those of the runs alone; `foreknown` carries the
        errors of the prior to the unknowns.

    Raises
    ------
    ValueError
        A channel without a reading, infinite, or shapes that do not fit.

    Notes
    -----
    With α = α̂ + Γ^½u and σ taken to be known it is the least squares of u and x₀ in one, by the SVD, so that Γ may be
    singular and σ zero. The unknowns are linear in y and α̂, and errors of both are carried on whatever Γ was.

    Examples
    --------
    One shot: a single run of 80 at 40°, and sisters with 2, 2.4, 1.6 at 150°.

    >>> turn = lambda degrees: np.exp(1j * np.radians(degrees))
    >>> sisters = pooled_prior(np.array([2.0, 2.4, 1.6])[:, None, None] * turn(150))
    >>> fit = fit_with_prior([[80 * turn(40)]], [[0]], sisters)
    >>> np.abs(fit.initial).round(9), np.abs(fit.influence).round(9)
    (array([80.]), array([[2.]]))
    """
    y, t = as_vectors(readings), as_vectors(masses)
    if y.ndim < 2 or t.ndim < 2 or y.shape[:-1] != t.shape[:-1]:
        raise ValueError(f"shapes do not fit: readings {y.shape}, masses {t.shape}")
    if prior.mean.shape[-2:] != (y.shape[-1], t.shape[-1]):
        raise ValueError(f"shapes do not fit: readings {y.shape}, masses {t.shape}, prior {prior.mean.shape}")
    if np.isinf(y).any() or not np.isfinite(t).all():
        raise ValueError("masses must be finite, and readings finite or NaN")
    present = np.isfinite(y)
    if not present.any(axis=-2).all():
        raise ValueError("a channel has no reading")
    plain = runs_alone(y, t)
    if deviation is None:
        scatter = plain.residual_sd[..., None, None]
        each = np.where(np.isnan(scatter), 0.0, scatter)
    else:
        each = as_array(deviation)
    sd = np.swapaxes(np.where(present, np.broadcast_to(each, y.shape), 0.0), -1, -2)
    read = np.swapaxes(present, -1, -2)
    typical = sd.sum(axis=-1) / read.sum(axis=-1)
    floor = np.maximum(sd, 1e-3 * typical[..., None])
    # weights relative to the typical reading, so that all errors may be zero
    root = np.where(read, np.where(floor > 0, typical[..., None] / np.where(floor > 0, floor, 1.0), 1.0), 0.0)
    share = np.square(root) / np.square(root).sum(axis=-1, keepdims=True)
    w = t[..., None, :, :]

    def centred(rows: Any) -> Any:
        """Take off x₀: root·(rows - their weighted mean)."""
        return as_vectors(root[..., None] * (rows - share[..., None, :] @ rows))

    steps = centred(w) @ prior.root
    below = np.broadcast_to(
        typical[..., None, None] * np.eye(t.shape[-1]), (*steps.shape[:-2], *[t.shape[-1]] * 2)
    )
    of_u = pseudo_inverse(np.concatenate([steps, below], axis=-2))[..., : y.shape[-2]]
    of_alpha = prior.root @ of_u @ centred(np.eye(y.shape[-2]))
    of_alpha = np.where(read[..., None, :], of_alpha, 0.0)
    follows = np.eye(t.shape[-1]) - of_alpha @ w
    on_average = share[..., None, :] @ w
    gain = np.concatenate([share[..., None, :] - on_average @ of_alpha, of_alpha], axis=-2)
    of_mean = np.concatenate([-on_average @ follows, follows], axis=-2)
    b = np.swapaxes(np.where(present, y, 0.0), -1, -2)
    unknowns = np.matvec(gain, b) + np.matvec(
        of_mean, np.broadcast_to(prior.mean, of_mean.shape[:-2] + t.shape[-1:])
    )
    leverage = np.clip(np.einsum("...rn,...snr->...rs", floats(design(t)), floats(gain)).real, 0.0, 1.0)
    nu = np.broadcast_to(prior.degrees_of_freedom, y.shape[:-2])
    foreknown = Foreknown(plain, of_mean @ prior.factor, nu, partial(_again, y, t, prior, deviation))
    return JointFit(y, t, None, as_vectors(unknowns + 0.0), gain, leverage, foreknown=foreknown)


def _again(readings: Complex, masses: Complex, prior: Prior, deviation: ArrayLike | None) -> Vectors:
    """Return the unknowns in 32 digits, of floats as exact."""
    known = replace(
        prior, **{name: in_32_digits(getattr(prior, name)) for name in ("mean", "factor", "root")}
    )
    sd = None if deviation is None else in_32_digits(np.asarray(deviation, dtype=float))
    fit = fit_with_prior(in_32_digits(readings), in_32_digits(masses), known, sd)
    return cast("Vectors", fit.unknowns)


def runs_alone(readings: ArrayLike, masses: ArrayLike, weights: ArrayLike | None = None) -> JointFit:
    """Fit the runs alone, of least norm where they do not determine the unknowns, which are counted; as `joint_fit`.

    >>> one = runs_alone([[5], [5.2]], [[0], [0]])
    >>> one.unknowns.real, int(one.degrees_of_freedom)
    (array([[5.1, 0. ]]), 1)
    """
    y, t = as_vectors(readings), as_vectors(masses)
    present = np.isfinite(y)
    w = None if weights is None else np.broadcast_to(np.asarray(weights, dtype=float), y.shape)
    root = np.swapaxes(present * (1.0 if w is None else np.sqrt(w)), -1, -2)
    scaled, scale = columns_scaled(root[..., None] * design(t)[..., None, :, :])
    left, sigma, right = np.linalg.svd(floats(scaled), full_matrices=False)
    seen = sigma > threshold(*scaled.shape[-2:]) * sigma[..., :1]
    left = np.where(seen[..., None, :], left, 0.0)
    back = adjoint(right) / np.where(seen, sigma, 1.0)[..., None, :]
    inverse = pseudo_inverse(scaled) if is_doubled(scaled) else back @ adjoint(left)
    gain = scale[..., None] * inverse * root[..., None, :]
    unknowns = np.matvec(gain, np.swapaxes(np.where(present, y, 0.0), -1, -2))
    leverage = np.swapaxes(np.square(np.abs(left)).sum(axis=-1), -1, -2)
    count = np.asarray(seen.sum(axis=(-2, -1)))
    return JointFit(y, t, w, as_vectors(unknowns), gain, leverage, count=count)
