"""The inertia tensor: its products, moved and turned, its principal axes, and whether a body can have it.

Products of inertia are I_xy = +∫ x y dm everywhere; the tensor carries them with the minus sign,

    I = [[ I_xx, -I_xy, -I_xz],
         [-I_xy,  I_yy, -I_yz],
         [-I_xz, -I_yz,  I_zz]]          (Riul II, eqs. 31-35).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, as_numbers, in_32_digits, is_doubled, sorting

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_arrays import DoubledArray

Array = NDArray[np.float64]

RTOL = 1e-9
"""The share of the largest principal moment by which a tensor may miss the triangle inequality: flat bodies meet it exactly."""


class _Axes(NamedTuple):
    moments: Array
    axes: Array


@record
class Principal(_Axes):
    """Principal moments in ascending order (..., 3), and their axes as the rows of a rotation (..., 3, 3)."""

    tensor: Array
    """Their tensor (..., 3, 3), or moments (..., 3)."""

    @property
    def condition(self) -> Array:
        """The factor by which the axes magnify a relative error of the tensor, (..., 3): ‖I‖ over the gap to the next moment."""
        gap = np.diff(self.moments, axis=-1)
        nearest = np.concatenate(
            [gap[..., :1], np.minimum(gap[..., :1], gap[..., 1:]), gap[..., 1:]], axis=-1
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.abs(self.moments).max(axis=-1, keepdims=True) / nearest)

    def error_estimate(self, exact: DoubledArray | None = None) -> _Axes:
        """Return estimates of the errors of the moments (..., 3) and of the axes' components (..., 3, 3).

        Parameters
        ----------
        exact
            The tensor to 32 digits, (..., 3, 3), kg·m² (`Body.in_32_digits`): default: the tensor of floats, taken as exact.

        Notes
        -----
        Computed twice, with 16 and with 32 digits, both from these axes. Of two moments that are equal the axes are as good
        as any: the estimate then is how far they are from principal axes.

        Examples
        --------
        >>> near = principal(tensor(1, 1.001, 1.0002, ixy=1e-3, ixz=1e-4))
        >>> error = near.error_estimate()
        >>> bool(error.moments.max() < 1e-15 < 1e-14 < error.axes.max() < 1e-12)
        True
        """
        from rigidbody3d.eigenvectors import eigenvectors, unknown

        tensor: Any = in_32_digits(self.tensor) if exact is None else exact
        second: tuple[Any, Any] = (
            eigenvectors(tensor, self.axes) if tensor.ndim == self.axes.ndim else principal(tensor)
        )
        moments, axes = second
        hidden, swing = unknown(moments)
        return _Axes(moments.off(self.moments) + hidden, axes.off(self.axes) + swing)


@record
class Validity(NamedTuple):
    """Whether a body can have a tensor; see `check`."""

    valid: NDArray[np.bool_]
    margin: Array
    """Smallest of the principal moments and of I1 + I2 - I3, kg·m²; negative: no body has it."""
    moments: Array
    reason: str
    """The fault of the first bad tensor; empty if there is none."""


def tensor(
    ixx: ArrayLike,
    iyy: ArrayLike,
    izz: ArrayLike,
    ixy: ArrayLike = 0.0,
    ixz: ArrayLike = 0.0,
    iyz: ArrayLike = 0.0,
) -> Array:
    """Return the inertia tensor (..., 3, 3) of moments and products, kg·m².

    Parameters
    ----------
    ixx, iyy, izz
        Moments of inertia, (...), kg·m².
    ixy, ixz, iyz
        Products of inertia +∫ x y dm …, (...), kg·m²; the tensor has their negatives (Riul II, eq. 31).

    Examples
    --------
    >>> tensor(2, 3, 4, ixy=0.5)[0]
    array([ 2. , -0.5, -0. ])
    """
    return _arranged(*map(as_array, (ixx, iyy, izz, ixy, ixz, iyz)))


def _arranged(*entries: Array) -> Array:
    xx, yy, zz, xy, xz, yz = np.broadcast_arrays(*entries)
    rows = [[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def vectors(name: str, value: ArrayLike) -> Array:
    """Return vectors of three numbers, (..., 3).

    Raises
    ------
    ValueError
        Other things than numbers, or not three of them.

    Examples
    --------
    >>> vectors("pin", [0, 1])
    Traceback (most recent call last):
    ...
    ValueError: pin must have the shape (..., 3), found (2,)
    """
    numbers = as_numbers(name, value)
    if numbers.shape[-1:] != (3,):
        raise ValueError(f"{name} must have the shape (..., 3), found {numbers.shape}")
    return numbers


def products(inertia: ArrayLike) -> Array:
    """Return the products of inertia I_xy, I_xz, I_yz = +∫ x y dm … of a tensor, (..., 3), kg·m².

    Parameters
    ----------
    inertia
        The tensor, (..., 3, 3), kg·m²; it has -I_xy (Riul II, eq. 31).

    Examples
    --------
    >>> products(tensor(2, 3, 4, ixy=0.5, iyz=-0.25))
    array([ 0.5 ,  0.  , -0.25])
    """
    I = as_array(inertia)
    return np.stack([-I[..., 0, 1], -I[..., 0, 2], -I[..., 1, 2]], axis=-1) + 0.0


def shift(mass: ArrayLike, offset: ArrayLike) -> Array:
    """Return the tensor of a point mass at an offset, the term of the parallel axis theorem, (..., 3, 3), kg·m².

    Parameters
    ----------
    mass
        (...), kg.
    offset
        From the point of reference to the mass, (..., 3), m.

    Notes
    -----
    m (|r|² E - r rᵀ), its diagonal as sums of squares: m (y² + z²) … (Beer and Johnston, ch. 9).

    Examples
    --------
    >>> shift(2.0, [3.0, 0.0, 0.0]).diagonal()
    array([ 0., 18., 18.])
    """
    m = as_array(mass)
    x, y, z = np.moveaxis(as_array(offset), -1, 0)
    return _arranged(
        m * (y * y + z * z), m * (x * x + z * z), m * (x * x + y * y), m * (x * y), m * (x * z), m * (y * z)
    )


def turn(inertia: ArrayLike, rotation: ArrayLike) -> Array:
    """Return a tensor in the axes that it has been turned into, R I Rᵀ, (..., 3, 3); exactly symmetric.

    Examples
    --------
    >>> turn(np.diag([1.0, 2.0, 3.0]), [[0, -1, 0], [1, 0, 0], [0, 0, 1]]).diagonal()
    array([2., 1., 3.])
    """
    I, R = as_array(inertia), as_array(rotation)
    turned = R @ I @ np.swapaxes(R, -1, -2)
    return (turned + np.swapaxes(turned, -1, -2)) / 2


def principal(inertia: ArrayLike) -> Principal:
    """Return the principal moments, ascending, and the principal axes.

    Parameters
    ----------
    inertia
        The tensor (..., 3, 3), or the moments about axes already principal (..., 3), kg·m².

    Returns
    -------
    Principal
        `.moments` (..., 3) and `.axes` (..., 3, 3): each row is an axis, together right-handed; each of the
        first two axes points where its largest component is positive.

    Raises
    ------
    ValueError
        Not finite, not symmetric, or another shape.

    Notes
    -----
    det(I - λE) = 0 (Riul II, eqs. 45-47), by LAPACK's symmetric eigensolver: the closed form of the cubic
    loses half the digits where moments are close. A tensor that is diagonal keeps its very numbers.

    Examples
    --------
    >>> principal(tensor(2, 2, 3, ixy=1)).moments.round(12)
    array([1., 3., 3.])
    """
    I = as_numbers("inertia", inertia)
    result = Principal(*_principal(I))
    result.tensor = I
    return result


def _principal(I: Array) -> _Axes:
    if I.shape[-1:] != (3,):
        raise ValueError(f"inertia must be 3 moments or a 3 x 3 tensor, found the shape {I.shape}")
    if not np.isfinite(I).all():
        raise ValueError("inertia must be finite")
    if I.ndim == 1 or I.shape[-2] != 3:
        return _sorted(I)
    if is_doubled(I):
        from rigidbody3d.eigenvectors import eigenvectors

        pair: tuple[Array, Array] = eigenvectors(I, _principal(I.value).axes)
        return _Axes(*pair)
    if I.ndim == 2 and np.array_equal(I, np.diag(np.diag(I))):
        return _sorted(np.diag(I))
    scale = np.abs(I).max(axis=(-1, -2), keepdims=True)
    if (np.abs(I - np.swapaxes(I, -1, -2)) > 1e-12 * scale).any():
        raise ValueError("the inertia tensor must be symmetric")
    moments, columns = np.linalg.eigh((I + np.swapaxes(I, -1, -2)) / 2)
    axes = np.swapaxes(columns, -1, -2)
    # a thin rod in oblique axes: the least moment is nothing but rounding
    rod = (np.abs(moments[..., 0]) <= 2e-15 * moments[..., 2]) & (
        moments[..., 2] - moments[..., 1] <= 4e-15 * moments[..., 2]
    )
    middle = (moments[..., 1] + moments[..., 2]) / 2
    moments = np.where(rod[..., None], np.stack([np.zeros_like(middle), middle, middle], axis=-1), moments)
    diagonal = (I * np.eye(3) == I).all(axis=(-1, -2))
    if diagonal.any():
        plain = _sorted(np.diagonal(I, axis1=-2, axis2=-1))
        moments = np.where(diagonal[..., None], plain.moments, moments)
        axes = np.where(diagonal[..., None, None], plain.axes, axes)
    return _Axes(moments, _right_handed(axes))


def free_axes(moments: ArrayLike) -> NDArray[np.bool_]:
    """Return whether two principal moments (..., 3), ascending, are equal to rounding: any axes across will do.

    >>> bool(free_axes([1.0, 1.0, 2.0])), bool(free_axes([1.0, 1.5, 2.0]))
    (True, False)
    """
    m = np.asarray(moments, dtype=float)
    return np.asarray(np.diff(m, axis=-1).min(axis=-1) <= RTOL * np.abs(m).max(axis=-1))


def own_axes(principal: tuple[Array, Array]) -> Array:
    """Return principal axes (3, 3) that lie along the body's own axes where equal moments leave them free.

    Examples
    --------
    A disk about an oblique pair of axes: the pair is turned back.

    >>> own_axes((np.array([1.0, 1.0, 2.0]), np.array([[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]])))
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    moments, axes = principal[0], np.array(principal[1])
    close = np.diff(moments) <= RTOL * np.abs(moments).max()
    if close.all():
        return np.eye(3)
    if not close.any():
        return axes
    first = 0 if close[0] else 1
    alone = axes[2 if first == 0 else 0]
    # the own axis that lies nearest to the plane across, and what is at right angles to it there
    k = int(np.argmin(np.abs(alone)))
    one = np.eye(3)[k] - alone[k] * alone
    one = one / np.linalg.norm(one)
    other = np.cross(alone, one)
    axes[first], axes[first + 1] = one, other
    return _right_handed(axes) + 0.0


def _sorted(moments: Array) -> _Axes:
    order = sorting(moments)
    return _Axes(np.take_along_axis(moments, order, axis=-1), _right_handed(np.eye(3)[order]))


def _right_handed(axes: Array) -> Array:
    largest = np.take_along_axis(axes, np.abs(axes).argmax(axis=-1)[..., None], axis=-1)
    axes = axes * np.where(largest < 0, -1.0, 1.0)
    hand = np.einsum("...i,...i->...", np.cross(axes[..., 0, :], axes[..., 1, :]), axes[..., 2, :])
    axes[..., 2, :] *= np.where(hand < 0, -1.0, 1.0)[..., None]
    return axes


def check(inertia: ArrayLike, rtol: float = RTOL) -> Validity:
    """Return whether a body can have a tensor: no negative moment, none larger than the sum of the other two.

    Parameters
    ----------
    inertia
        Tensor (..., 3, 3) or principal moments (..., 3), kg·m².
    rtol
        How far, as a part of the largest moment, an inequality may be missed. Flat bodies (I1 + I2 = I3) and
        thin rods (I1 = 0) meet it with equality, and rounding must not reject them.

    Returns
    -------
    Validity
        `.valid` (...) and `.reason`, which names the broken inequality.

    Notes
    -----
    The principal moments are tested, not the diagonal: I1 + I2 - I3 = 2∫ z² dm ≥ 0 holds in principal axes and
    is stronger there. No such test detects a product of inertia with the wrong sign.

    Examples
    --------
    >>> check([1, 1, 3]).reason
    'the principal moments 1, 1, 3 kg·m² break the triangle inequality: 1 + 1 < 3'
    >>> bool(check([1, 2, 3]).valid)
    True
    """
    moments = principal(inertia).moments
    triangle = moments[..., 0] + moments[..., 1] - moments[..., 2]
    margin = np.minimum(moments[..., 0], triangle)
    valid = margin >= -rtol * np.abs(moments).max(axis=-1)
    reason = ""
    if not valid.all():
        I1, I2, I3 = moments[np.unravel_index(np.argmin(valid), valid.shape)]
        if -rtol * max(abs(I1), abs(I3)) > I1:
            reason = f"the principal moment {I1:.6g} kg·m² is negative"
        else:
            reason = (
                f"the principal moments {I1:.6g}, {I2:.6g}, {I3:.6g} kg·m² break the triangle inequality: "
                f"{I1:.6g} + {I2:.6g} < {I3:.6g}"
            )
    return Validity(np.asarray(valid), np.asarray(margin), moments, reason)


def second_moments(inertia: ArrayLike) -> Array:
    """Return ∫ r rᵀ dm at the same point, ½ tr(I) E − I, (..., 3, 3), kg·m²: a body has it where no eigenvalue is negative.

    Its eigenvalues are (I2 + I3 − I1)/2 …: definiteness and the triangle inequality of a tensor in one.

    Examples
    --------
    >>> second_moments(np.diag([2.0, 3.0, 4.0])).diagonal()
    array([2.5, 1.5, 0.5])
    """
    I = np.asarray(inertia, dtype=float)
    return np.asarray(np.trace(I, axis1=-2, axis2=-1)[..., None, None] / 2 * np.eye(3) - I)


def nearest(inertia: ArrayLike) -> Array:
    """Return the nearest tensor to this one (3, 3) that a body can have, by the sum of squared differences of the entries.

    Parameters
    ----------
    inertia
        A symmetric tensor (3, 3), kg·m².

    Raises
    ------
    ValueError
        Not finite, not symmetric, or another shape.

    Notes
    -----
    The axes stay, since the set of such tensors and the distance are the same in all axes; the moments go to the nearest
    point of the cone I1 ≤ I2 + I3 …: of its faces, edges and tip those are tried that the point may lie on (a projection
    on each, the nearest that is in the cone).

    Examples
    --------
    >>> nearest(np.diag([1.0, 1.0, 2.3])).diagonal().round(12)
    array([1.1, 1.1, 2.2])
    """
    I = np.asarray(inertia, dtype=float)
    if I.shape != (3, 3):
        raise ValueError(f"inertia must be a 3 x 3 tensor, found the shape {I.shape}")
    principal_values = principal(I)
    if (
        principal_values.moments[0] + principal_values.moments[1] >= principal_values.moments[2]
        and principal_values.moments[0] >= 0
    ):
        return np.asarray((I + I.T) / 2)
    # rows a of a·moments ≥ 0
    sides = np.ones((3, 3)) - 2 * np.eye(3)
    best = np.zeros(3)
    for chosen in ([0], [1], [2], [0, 1], [0, 2], [1, 2]):
        A = sides[chosen]
        point = principal_values.moments - A.T @ np.linalg.solve(A @ A.T, A @ principal_values.moments)
        inside = (sides @ point >= -1e-14 * np.abs(principal_values.moments).max()).all()
        if inside and np.linalg.norm(point - principal_values.moments) < np.linalg.norm(
            best - principal_values.moments
        ):
            best = point
    # on a face or an edge, to the last bit
    best[np.abs(best) <= 1e-15 * np.abs(best).max()] = 0.0
    made = principal_values.axes.T @ np.diag(best) @ principal_values.axes
    return np.asarray((made + made.T) / 2)
