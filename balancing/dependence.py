"""Can the readings distinguish the planes? Condition numbers, and the combinations of planes that no sensor sees.

All of it is of coefficients whose columns are first brought to like size by powers of two: a plane of small effect
does not count as a dependent one, and nothing is rounded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.shapes import as_numbers, common_shape, floats

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Unseen(ValueError):
    """A combination of unknowns leaves no trace in the data; `case` says of which rotor or channel."""

    def __init__(self, message: str, combination: Complex, case: tuple[int, ...] = ()) -> None:
        self.combination = combination
        self.case = case
        super().__init__(message)


class DependentPlanes(Unseen):
    """The readings cannot distinguish the planes of rotor `case`: no sensor sees the `combination`."""


class DependentTrials(Unseen):
    """The trial runs cannot distinguish the effects of the planes: no run has tried the `combination`."""


def condition_number(influence: ArrayLike, weights: ArrayLike | None = None) -> Real:
    """Return σ_max/σ_min of the coefficients, (...): by what factor relative errors of readings can grow.

    The columns are first scaled to within a factor of two of the largest, by powers of two (without rounding),
    so that a plane of small effect does not count as a dependent one. It is inf for dependent planes.

    Parameters
    ----------
    influence
        α, complex (..., s, p), amplitude per kg.
    weights
        w_s >= 0, (..., s); default 1 each.

    Examples
    --------
    >>> float(condition_number([[1, 0], [0, 1000]]).round(3))
    1.953
    """
    alpha = _weighted(influence, weights)
    scaled, _ = columns_scaled(alpha)
    if alpha.shape[-2] < alpha.shape[-1]:
        return np.full(alpha.shape[:-2], np.inf)
    sigma = np.linalg.svd(scaled, compute_uv=False)
    low = sigma[..., -1]
    dependent = low <= threshold(*alpha.shape[-2:]) * sigma[..., 0]
    return np.asarray(np.where(dependent, np.inf, sigma[..., 0] / np.where(dependent, 1.0, low)))


def plane_significance(influence: ArrayLike, weights: ArrayLike | None = None) -> Real:
    """Return the share of each plane's effect that the other planes cannot produce, (..., p).

    Parameters
    ----------
    influence
        α, complex (..., s, p), amplitude per kg.
    weights
        w_s >= 0, (..., s); default 1 each.

    Returns
    -------
    ndarray
        (..., p) in [0, 1]: the sine of the angle between a plane's column and all the others' span. 1: the
        plane is independent of the others; near 0: the others can do what it does, and it should be left out.

    Notes
    -----
    After Darlow, ASME 82-GT (1982), "non-independent balance planes". Every column is held against ALL the
    others (of planes that are dependent only together, no two are alike). With A = QR the sine of column j
    is 1/(‖a_j‖ ‖row j of R⁻¹‖).

    Examples
    --------
    Three planes, of which the third does what the first two do together:

    >>> plane_significance([[1, 0, 1], [0, 1, 1], [0, 0, 0.01]]).round(4)
    array([0.01  , 0.01  , 0.0071])
    """
    scaled, _ = columns_scaled(_weighted(influence, weights))
    norms = np.linalg.norm(scaled, axis=-2)
    unit = scaled / np.where(norms > 0, norms, 1.0)[..., None, :]
    out = np.zeros(unit.shape[:-2] + unit.shape[-1:])
    for j in range(unit.shape[-1]):
        others = np.delete(unit, j, axis=-1)
        # orthogonal complement by the SVD, so that others which depend on each other do no harm
        u, sigma, _ = np.linalg.svd(others, full_matrices=False)
        keep = sigma > threshold(*unit.shape[-2:]) * sigma[..., :1]
        left = unit[..., j]
        # twice is enough (Kahan, Parlett)
        for _ in range(2):
            inside = np.where(keep, np.matvec(adjoint(u), left), 0)
            left = left - np.matvec(u, inside)
        out[..., j] = np.linalg.norm(left, axis=-1)
    return np.where(out > threshold(*unit.shape[-2:]), np.minimum(out, 1.0), 0.0)


def unseen(influence: ArrayLike, weights: ArrayLike | None = None) -> tuple[Complex, float]:
    """Return the combination of planes with the least effect on the readings, and its relative effect.

    Parameters
    ----------
    influence
        α, complex (s, p), amplitude per kg.
    weights
        w_s >= 0, (s,); default 1 each.

    Returns
    -------
    combination, effect
        Complex (p,) with the largest component 1; σ_min/σ_max of the scaled coefficients, 0 for a combination without any
        effect.

    Examples
    --------
    >>> np.abs(unseen([[1, 2], [2, 4]])[0]).round(3)
    array([1. , 0.5])
    """
    scaled, scale = columns_scaled(_weighted(influence, weights))
    _, sigma, vh = np.linalg.svd(scaled)
    smallest = sigma[-1] / sigma[0] if len(sigma) == scaled.shape[1] and sigma[0] > 0 else 0.0
    return _normed(vh[-1].conj() * scale), float(smallest)


def _weighted(influence: ArrayLike, weights: ArrayLike | None) -> Complex:
    alpha = as_numbers("influence", influence, complex)
    if alpha.ndim < 2:
        raise ValueError(f"influence must be (..., s, p), found the shape {alpha.shape}")
    if weights is None:
        return alpha
    w = as_numbers("weights", weights)
    common_shape(influence=alpha.shape[:-1], weights=w.shape)
    return np.asarray(alpha * np.sqrt(w)[..., None])


def _normed(direction: Complex) -> Complex:
    return np.asarray(direction / direction[np.argmax(np.abs(direction) >= 0.999 * np.abs(direction).max())])


def columns_scaled(a: Complex) -> tuple[Complex, Real]:
    """Return a·diag(scale) with columns within a factor of two of the largest, and the scale (powers of two)."""
    values = floats(a)
    size = np.abs(values)
    square = np.einsum("...sp,...sp->...p", size, size)
    low, high = square.min(initial=1e200), square.max(initial=1e-200)
    if low > 1e-280 and high < 1e280:
        # within a factor of two already
        if high < 4 * low:
            return a, np.ones(square.shape)
        # ⌊log₂ of the norms' ratio⌋
        exponent = (np.frexp(square.max(axis=-1, keepdims=True) / square)[1] - 1) >> 1
    else:
        # the squares leave the range of numbers, or a column is zero
        peak = np.maximum(np.abs(values.real), np.abs(values.imag)).max(axis=-2)
        highest = peak.max(axis=-1, keepdims=True)
        exponent = np.where(peak > 0, np.frexp(highest)[1] - np.frexp(peak)[1], 0)
    if not exponent.any():
        return a, np.ones(square.shape)
    scale = np.ldexp(1.0, exponent)
    return a * scale[..., None, :], scale


def damped(a: Complex, ridge: float) -> Complex:
    """Return A (..., m, n) with the rows λ‖A_k‖ of a ridge below it; the norm of a column of zeros is the largest, or 1."""
    norms = np.linalg.norm(a, axis=-2)
    largest = norms.max(axis=-1, keepdims=True)
    norms = ridge * np.where(norms > 0, norms, np.where(largest > 0, largest, 1.0))
    return np.concatenate([a, norms[..., None] * np.eye(norms.shape[-1])], axis=-2)


def threshold(rows: int, columns: int) -> float:
    """Below this ratio of singular values a combination of planes lies in the rounding of the data."""
    return 64 * max(rows, columns) * EPS


def require_independent(
    a: Complex,
    scale: Real,
    rows: int,
    columns: int,
    what: str,
    error: type[DependentPlanes | DependentTrials],
) -> None:
    """Raise where the columns, which are scaled, depend on each other: with the combination that is not seen."""
    if rows >= columns:
        sigma = np.linalg.svd(a, compute_uv=False)
        bad = ~(sigma[..., -1] > threshold(rows, columns) * sigma[..., 0])
        if not bad.any():
            return
        case = tuple(int(i[0]) for i in np.nonzero(bad)) if bad.ndim else ()
    else:
        case = (0,) * (a.ndim - 2)
    vh = np.linalg.svd(a[case])[2]
    combination = _normed(vh[-1].conj() * np.broadcast_to(scale, a.shape[:-2] + scale.shape[-1:])[case])
    planes = np.flatnonzero(np.abs(combination) > 1e-6).tolist()
    if rows < columns:
        message = f"{columns} planes need at least as many {what}, found {rows}"
    elif len(planes) == 1:
        message = f"the {what} do not show plane {planes[0]} at all"
    else:
        message = f"the {what} do not tell the planes {', '.join(map(str, planes))} apart"
    raise error(message, combination, case)


def adjoint(a: Complex) -> Complex:
    """Return the conjugate transpose of matrices (..., m, n)."""
    return np.swapaxes(a, -1, -2).conj()


def design(masses: Complex) -> Complex:
    """Return the rows (1, w) by which θ = (x₀, α) makes the vibration with masses w on, (..., p) -> (..., 1 + p)."""
    return np.concatenate([np.ones((*masses.shape[:-1], 1), dtype=complex), masses], axis=-1)


def directions(z: Complex) -> Complex:
    """Return complex numbers brought to the size 1; 1 for 0."""
    size = np.abs(z)
    return np.where(size > 0, z / np.where(size > 0, size, 1.0), 1.0)


def roundings(terms: int) -> float:
    """Return by what share of its terms' size a computed sum of this number of complex products can be wrong."""
    return (terms / 4 + 2) * EPS
