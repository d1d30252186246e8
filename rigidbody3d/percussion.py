"""Percussion: what an impulse changes of a body's motion, free, held at a point, or hinged on an axis.

m Δv = J + R,  I Δω = r × J + p × R          (F. P. Beer, E. R. Johnston, Vector Mechanics for Engineers: Dynamics, ch. 18)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_numbers, common_shape
from rigidbody3d.inertia import shift

Array = NDArray[np.float64]


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
        Shapes that do not fit.

    Notes
    -----
    m Δv = J + R, I Δω = r × J + p × R, and at the pin Δv + Δω × p = 0 (Beer and Johnston, ch. 18). The pin does
    not feel a blow at the centre of percussion.

    Examples
    --------
    A rod hung at its end does not pull at its pin if struck at two thirds of its length.

    >>> from rigidbody3d import inertia_of
    >>> rod = inertia_of("rod", 3.0, length=1.0)
    >>> strike(3.0, rod, [1, 0, 0], [0, 0, -1 / 6], pin=[0, 0, 0.5], axis=[0, 1, 0]).reaction.round(12) + 0.0
    array([0., 0., 0.])
    """
    m, I = as_numbers("mass", mass), as_numbers("inertia", inertia)
    J, r = as_numbers("impulse", impulse), as_numbers("offset", offset)
    if I.shape[-2:] != (3, 3) or J.shape[-1:] != (3,) or r.shape[-1:] != (3,):
        raise ValueError(
            "inertia must be (..., 3, 3), impulse and offset (..., 3), "
            f"found {I.shape}, {J.shape} and {r.shape}"
        )
    common_shape(mass=m.shape, inertia=I.shape[:-2], impulse=J.shape[:-1], offset=r.shape[:-1])
    if pin is None:
        spin = np.asarray(np.linalg.solve(I, np.cross(r, J)[..., None])[..., 0])
        move = np.asarray(J / m[..., None])
        return Blow(move, spin, np.zeros_like(move))
    p = np.asarray(pin, dtype=float)
    at_pin = I + shift(m, p)
    moment = np.cross(r - p, J)
    if axis is None:
        spin = np.asarray(np.linalg.solve(at_pin, moment[..., None])[..., 0])
    else:
        n = np.asarray(axis, dtype=float)
        n = n / np.linalg.norm(n, axis=-1, keepdims=True)
        lever = np.einsum("...i,...ij,...j->...", n, at_pin, n)
        spin = n * ((n * moment).sum(axis=-1) / lever)[..., None]
    v = np.asarray(np.cross(p, spin))
    return Blow(v, spin, np.asarray(m[..., None] * v - J))
