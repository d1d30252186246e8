"""Bounds of the rounding errors of rotations in time: free bodies and heavy tops in closed form, integrated ones.

A closed form is wrong in two ways. Its phase u0 + λt is a large number and rounded as one: that is an error of the
time, (1 + |u0|)/λ + t times ε, and moves the state along its own path. The angles that run on, of the node and of
the spin, are large numbers too: they turn the body about the momentum or about its axis by ε times their size. All
else is rounded a few times and keeps its last digits.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.exact import EPS
from rigidbody3d import attitude as quaternion
from rigidbody3d.inertia import principal

Array = NDArray[np.float64]

FEW = 12 * EPS
"""What a dozen roundings leave."""

STATE = ("attitude", "omega", "momentum", "energy")
"""What a state in time has estimates of."""


class State(Protocol):
    """A state in time, of whatever kind."""

    @property
    def attitude(self) -> Array: ...
    @property
    def omega(self) -> Array: ...
    @property
    def momentum(self) -> Array: ...
    @property
    def energy(self) -> Array: ...


def require(of: str, *names: str) -> None:
    """Raise ValueError where there is no estimate of a quantity of this name."""
    if of not in names:
        raise ValueError(f"no estimate for '{of}': expected one of {', '.join(names)}")


def apart(there: State, here: State, of: str) -> Array:
    """Return how far two states are apart: an angle, the size of a vector (..., 1), a difference."""
    if of == "attitude":
        return quaternion.angle_between(there.attitude, here.attitude)
    off = np.abs(getattr(there, of) - getattr(here, of))
    return np.asarray(off if of == "energy" else quaternion.length(off))


def tensors_off(inertia: ArrayLike, tensor: ArrayLike, axes: bool = True) -> list[Array]:
    """Return the tensors with one entry off each; none where the tensor is exact and, if axes are sought, diagonal."""
    I = np.asarray(inertia, dtype=float)
    E = np.asarray(tensor, dtype=float)
    if I.ndim == 1 or I.shape[-2:] != (3, 3):
        if not E.any():
            return []
        I = I[..., None, :] * np.eye(3)
    E = np.broadcast_to(E, I.shape)
    if axes:
        oblique = (I * np.eye(3) != I).any(axis=(-1, -2), keepdims=True)
        E = E + np.where(oblique, 4 * EPS * np.abs(I).max(axis=(-1, -2), keepdims=True), 0.0)
    if not E.any():
        return []
    # a moment of zero, of a thin rod, shall not become negative
    rod = np.where(principal(I).moments[..., :1, None] <= 8 * E.max(), 4.0, 0.0) * E.max() * np.eye(3)
    bounds = []
    for i in range(3):
        for j in range(i, 3):
            entry = np.zeros((3, 3))
            entry[i, j] = entry[j, i] = 1.0
            bounds.append(I + rod + E * entry)
    return bounds
