"""Percussion: what an impulse changes of a body's motion, free, held at a point, or hinged on an axis.

m Δv = J + R,  I Δω = r × J + p × R          (F. P. Beer, E. R. Johnston, Vector Mechanics for Engineers: Dynamics, ch. 18)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_numbers, common_shape
from rigidbody3d.inertia import principal, shift, vectors

Array = NDArray[np.float64]

NONE = 4e-15
"""A moment of inertia below this share of the largest is one of rounding."""
ASIDE = 1e-12
"""An impulse has no moment about an axis where it is below this share of lever times impulse."""


@record
class Blow(NamedTuple):
    """The effect of an impulse: changes of velocity of the centre of mass and of angular velocity, and the impulse of the pin."""

    velocity: Array
    omega: Array
    reaction: Array


def strike(
    mass: ArrayLike,
    inertia: ArrayLike,
    impulse: ArrayLike,
    offset: ArrayLike,
    pin: ArrayLike | None = None,
    axis: ArrayLike | None = None,
) -> Blow:
    """Return the change of a body's motion by an impulse: a free body, held at a point, or hinged on an axis.

    Parameters
    ----------
    mass, inertia
        (...), kg, and the tensor at the centre of mass, (..., 3, 3), kg·m².
    impulse
        (..., 3), N·s.
    offset
        From the centre of mass to where it strikes, (..., 3), m.
    pin
        From the centre of mass to a point held fixed, (..., 3), m; None: a free body.
    axis
        Direction of a hinge through the pin, (..., 3); None: a ball joint.

    Returns
    -------
    Blow
        Changes Δv (m/s) and Δω (rad/s), and the impulse with which the pin answers (N·s), (..., 3) each.

    Raises
    ------
    ValueError
        Shapes that do not fit; a mass that is not positive; an axis without a pin, of zeros, or about which the body has no
        moment of inertia; a blow that turns the body about such an axis.

    Notes
    -----
    m Δv = J + R, I Δω = r × J + p × R, and at the pin Δv + Δω × p = 0 (Beer and Johnston, ch. 18). The pin does
    not feel a blow at the centre of percussion. A thin rod takes no rotation about its own axis.

    Examples
    --------
    A rod hung at its end does not pull at its pin if struck at two thirds of its length.

    >>> from rigidbody3d import inertia_of
    >>> rod = inertia_of("rod", 3.0, length=1.0)
    >>> strike(3.0, rod, [1, 0, 0], [0, 0, -1 / 6], pin=[0, 0, 0.5], axis=[0, 1, 0]).reaction.round(12) + 0.0
    array([0., 0., 0.])
    """
    m, I = as_numbers("mass", mass), as_numbers("inertia", inertia)
    J, r = vectors("impulse", impulse), vectors("offset", offset)
    if I.shape[-2:] != (3, 3):
        raise ValueError(f"inertia must have the shape (..., 3, 3), found {I.shape}")
    common_shape(mass=m.shape, inertia=I.shape[:-2], impulse=J.shape[:-1], offset=r.shape[:-1])
    if not (m > 0).all():
        raise ValueError(f"the mass must be positive, found {np.min(m):g} kg")
    if pin is None:
        if axis is not None:
            raise ValueError("an axis needs a pin: a point that it goes through")
        move = np.asarray(J / m[..., None])
        return Blow(move, _turned_by(I, r, J), np.zeros_like(move))
    p = vectors("pin", pin)
    at_pin = I + shift(m, p)
    spin = _turned_by(at_pin, r - p, J) if axis is None else _hinged(at_pin, r - p, J, vectors("axis", axis))
    v = np.asarray(np.cross(p, spin))
    return Blow(v, spin, np.asarray(m[..., None] * v - J))


def _turned_by(inertia: Array, lever: Array, impulse: Array) -> Array:
    """Δω of an impulse at a lever, by principal axes: nothing turns about an axis without a moment of inertia."""
    moments, axes = principal(inertia)
    along = (axes * np.cross(lever, impulse)[..., None, :]).sum(axis=-1)
    none = moments <= NONE * moments[..., 2:]
    size = np.linalg.norm(lever, axis=-1) * np.linalg.norm(impulse, axis=-1)
    if (none & (np.abs(along) > ASIDE * size[..., None])).any():
        raise ValueError("the impulse turns the body about an axis about which it has no moment of inertia")
    rates = np.where(none, 0.0, along / np.where(none, 1.0, moments))
    return np.asarray((rates[..., None] * axes).sum(axis=-2))


def _hinged(inertia: Array, lever: Array, impulse: Array, axis: Array) -> Array:
    """Δω of an impulse at a lever from a hinge."""
    size = np.linalg.norm(axis, axis=-1, keepdims=True)
    if not (size > 0).all():
        raise ValueError("the axis of a hinge is a direction: not all of its numbers are 0")
    n = axis / size
    about = np.einsum("...i,...ij,...j->...", n, inertia, n)
    if (about <= NONE * np.trace(inertia, axis1=-2, axis2=-1)).any():
        raise ValueError("the body has no moment of inertia about the axis of its hinge")
    return np.asarray(n * ((n * np.cross(lever, impulse)).sum(axis=-1) / about)[..., None])
