"""The rotor's own unbalance, from its vibration: what no limit, ridge or rounding of the corrections changes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.balance import least_squares
from balancing.checked_data import checked
from balancing.dependence import adjoint, columns_scaled, condition_number

Complex = NDArray[np.complex128]


def initial_unbalance(
    influence: ArrayLike, initial: ArrayLike, weights: ArrayLike | None = None, *, singular: float = 1e12
) -> Complex:
    """Find the unbalance in the correction planes that best explains the initial vibration.

    It is the rotor's: no limit, ridge or rounding of the corrections changes it.

    Parameters
    ----------
    influence, initial, weights
        As for `least_squares`.
    singular
        The condition number from which on planes count as dependent.

    Returns
    -------
    ndarray
        u of V = α u, complex (..., p), kg; NaN in each plane where the readings do not determine it: planes that no
        sensor distinguishes, or fewer sensors than planes.

    Raises
    ------
    ValueError
        Not finite, or shapes that do not fit.

    Notes
    -----
    The minimum of ‖V - α u‖ is unique in plane p where every null vector of α has a zero there (Golub and Van Loan,
    Matrix Computations, 4th ed., section 5.5: rank-deficient least squares by the SVD).

    Examples
    --------
    Two planes that act alike and a third: 6 is seen of the two together, 5 of the third.

    >>> initial_unbalance([[1, 1, 0], [2, 2, 0], [0, 0, 1]], [6, 12, 5]).real
    array([nan, nan,  5.])
    """
    alpha, v, root = checked(influence, initial, weights)
    if bool((condition_number(alpha, weights) < singular).all()):
        return np.asarray(-least_squares(alpha, v, weights).corrections)
    a, b = (alpha, v) if root is None else (alpha * root[..., None], v * root)
    scaled, scale = columns_scaled(a)
    readings, planes = scaled.shape[-2:]
    left, sigma, right = np.linalg.svd(scaled, full_matrices=readings < planes)
    k = sigma.shape[-1]
    seen = sigma * singular > sigma[..., :1]
    along = np.matvec(adjoint(left), b) / np.where(seen, sigma, 1.0)
    u = np.matvec(adjoint(right[..., :k, :]), np.where(seen, along, 0.0)) * scale
    null = np.concatenate([~seen, np.ones((*seen.shape[:-1], planes - k), dtype=bool)], axis=-1)
    hidden = np.linalg.norm(np.where(null[..., None], right, 0.0), axis=-2)
    # a null vector is known to the rounding of α, not to that of its own components
    return np.where(hidden > 1e-6, complex(np.nan, np.nan), u)
