"""Modal balancing: corrections whose modal sums are opposite to those of the unbalances.

An isotropic rotor deflects, turning at ω, by its modes φ_k: r(z) = Σ_k q_k φ_k(z). The unbalances U_i at z_i enter mode k by
their modal sum alone,

    q_k (ω_k² − ω² + 2i ζ_k ω_k ω) m_k = ω² Σ_i U_i φ_k(z_i),

because the modes are orthogonal (R. E. D. Bishop, G. M. L. Gladwell, The vibration and balancing of an unbalanced flexible
rotor, J. Mech. Eng. Sci. 1 (1959) 66-77, eqs. 13 ff.). Corrections w_p at z_p leave the first N modes without excitation at
every speed where

    Σ_i U_i φ_k(z_i) + Σ_p w_p φ_k(z_p) = 0,    k = 1 … N:

N planes for N modes. In rigid bearings that is all; where the force and the couple on the bearings are to vanish at low speeds
too, Σ U + Σ w = 0 and Σ U z + Σ w z = 0 stand beside them: N + 2 planes (W. Kellenberger, Should a flexible rotor be balanced in N
or (N + 2) planes?, J. Eng. Ind. 94 (1972) 548-560).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.dependence import adjoint, threshold
from dalembert.arithmetic.records import record
from dalembert.dataclass import dataclass

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class UnreachedMode(ValueError):
    """The planes have no effect on the `combination` (q,) of conditions; its largest component is 1."""

    def __init__(self, message: str, combination: Real, case: tuple[int, ...]) -> None:
        self.combination, self.case = combination, case
        super().__init__(message)


@record
@dataclass(frozen=True, eq=False, repr=False)
class ModalCorrection:
    """Corrections that leave the given modes without excitation, computed by `modal_corrections`."""

    unbalance: Complex
    """To ADD in each plane, (..., p), kg·m."""
    modal: Complex
    """Σ U φ_k before correction, (..., q)."""
    at_planes: Real
    """φ_k(z_p), (..., q, p)."""
    condition_number: Real
    """σ_max/σ_min of the conditions, each brought to the size 1, (...)."""

    def residual_of(self, unbalance: ArrayLike) -> Complex:
        """Return the modal sums with these corrections, (..., p) -> (..., q)."""
        return np.asarray(self.modal + np.matvec(self.at_planes, np.asarray(unbalance, dtype=complex)))


def modal_corrections(moment: ArrayLike, shapes: ArrayLike, at_planes: ArrayLike) -> ModalCorrection:
    """Find the corrections with the least Σ|w|² whose modal sums are opposite to those of the unbalances.

    Parameters
    ----------
    moment
        Unbalances m·r·e^{iθ}, complex (..., m), kg·m.
    shapes
        φ_k at the unbalances, real (..., q, m); any scale of each mode. Rows of 1 and of z are force and couple.
    at_planes
        φ_k at the correction planes, (..., q, p), p >= q.

    Returns
    -------
    ModalCorrection
        `.unbalance` (..., p) complex, to ADD, kg·m; `.residual_of(unbalance)` (..., q) the modal sums that they leave.

    Raises
    ------
    UnreachedMode
        The planes cannot act on a mode (all lie at its nodes), or not on modes apart from one another.
    ValueError
        Fewer planes than conditions, not finite, or shapes that do not fit.

    Notes
    -----
    Each condition is scaled to the size 1; the solution of least norm is by the SVD.

    Examples
    --------
    A uniform shaft of length 1 in rigid bearings, φ = sin kπz, with 1 kg·m at its middle and one plane at 1/4: the first
    mode alone.

    >>> fix = modal_corrections([1.0], [[1.0]], [[np.sin(np.pi / 4)]])
    >>> fix.unbalance.round(6), abs(fix.residual_of(fix.unbalance)).round(12)
    (array([-1.414214+0.j]), array([0.]))
    """
    u, phi = np.asarray(moment, dtype=complex), np.asarray(shapes, dtype=float)
    planes = np.asarray(at_planes, dtype=float)
    if phi.shape[-1:] != u.shape[-1:] or phi.shape[-2:-1] != planes.shape[-2:-1]:
        raise ValueError(f"shapes do not fit: moment {u.shape}, shapes {phi.shape}, at_planes {planes.shape}")
    if not (np.isfinite(u).all() and np.isfinite(phi).all() and np.isfinite(planes).all()):
        raise ValueError("moment and shapes must be finite")
    conditions, count = planes.shape[-2:]
    if count < conditions:
        raise ValueError(f"{conditions} conditions need at least as many planes, found {count}")
    modal = np.matvec(phi, u)
    size = np.maximum(np.abs(planes).max(axis=-1), np.abs(phi).max(axis=-1, initial=0.0))
    size = np.where(size > 0, size, 1.0)
    left, sigma, right = np.linalg.svd(planes / size[..., None], full_matrices=False)
    bad = ~(sigma[..., -1] > threshold(conditions, count) * sigma[..., 0])
    if bad.any():
        case = tuple(int(i[0]) for i in np.nonzero(bad)) if bad.ndim else ()
        combination = left[case][:, -1]
        combination = combination / combination[np.argmax(np.abs(combination))]
        raise UnreachedMode(
            "the planes cannot act on the conditions apart from one another", combination, case
        )
    w = np.matvec(adjoint(right), np.matvec(adjoint(left), -modal / size) / sigma)
    lead = np.broadcast_shapes(w.shape[:-1], modal.shape[:-1])
    at = np.broadcast_to(planes, (*lead, conditions, count))
    return ModalCorrection(np.asarray(w + 0.0), modal, at, np.asarray(sigma[..., 0] / sigma[..., -1]))


def shapes_at(stations: ArrayLike, shapes: ArrayLike, z: ArrayLike) -> Real:
    """Interpolate mode shapes between their stations by cubic splines, (k, ...).

    Parameters
    ----------
    stations
        Axial positions with values of the shapes, rising, (n,), m.
    shapes
        The values, (k, n), of any scale.
    z
        Axial positions, (...), m.

    Raises
    ------
    ValueError
        A position beyond the stations, stations that do not rise, or shapes that do not fit.

    Examples
    --------
    >>> shapes_at([0, 1, 2, 3], [[0, 1, 8, 27]], [1.5, 2.0])
    array([[3.375, 8.   ]])
    """
    x, at = np.asarray(stations, dtype=float), np.asarray(z, dtype=float)
    spline = _spline(x, shapes)
    if ((at < x[0]) | (at > x[-1])).any():
        raise ValueError(f"a place beyond the stations, which reach from {x[0]:g} to {x[-1]:g}")
    return np.asarray(spline(at))


def shape_pieces(stations: ArrayLike, shapes: ArrayLike) -> Real:
    """The cubics of `shapes_at` from each station to the next, in powers of the distance from it: (n − 1, k, 4).

    >>> shape_pieces([0, 1, 2, 3], [[0, 1, 8, 27]])[1].round(12)
    array([[1., 3., 3., 1.]])
    """
    return np.moveaxis(np.asarray(_spline(stations, shapes).c)[::-1], 0, -1)


def _spline(stations: ArrayLike, shapes: ArrayLike) -> CubicSpline:
    from scipy.interpolate import CubicSpline

    x = np.asarray(stations, dtype=float)
    if x.ndim != 1 or len(x) < 2 or not (np.diff(x) > 0).all():
        raise ValueError("expected at least two stations, ascending")
    return CubicSpline(x, np.asarray(shapes, dtype=float), axis=1)
