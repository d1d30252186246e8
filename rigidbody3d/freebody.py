"""Free bodies: the rotation of a rigid body that no torque acts on, at any time (`free_rotation` has the formulas)."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, as_numbers, common_shape, in_32_digits, is_doubled
from rigidbody3d import attitude as quaternion
from rigidbody3d.free_rotation import FreeRotation
from rigidbody3d.inertia import check, principal
from rigidbody3d.states import InClosedForm, PictureData, from_start, in_blocks, require

Array = NDArray[np.float64]


@record
@dataclass(frozen=True, eq=False, repr=False)
class FreeBody:
    """A rigid body without torque, from its inertia and its state at time zero.

    Parameters
    ----------
    inertia
        Principal moments (..., 3) or the tensor at the centre of mass (..., 3, 3), kg·m². A single zero moment
        is a thin rod; a flat body (I1 + I2 = I3) may miss the triangle inequality by rounding (`inertia.check`).
    omega
        Angular velocity at time zero in body axes, (..., 3), rad/s.
    attitude
        Quaternion [w, x, y, z] at time zero, body to space, (..., 4).

    Raises
    ------
    ValueError
        Not finite, a tensor that is not symmetric, moments that no body has (negative, or one larger than the other two
        together), shapes that do not fit.

    Notes
    -----
    See `free_rotation`. Separatrix, permanent rotation, symmetric and spherical bodies included. The
    distance to the separatrix is computed in doubled precision: it is exact for the numbers given.

    Examples
    --------
    >>> body = FreeBody([1, 2, 3], [1.0, 0.1, 0.5])
    >>> state = body.at([0.0, 10.0])
    >>> state.omega[1].round(10)
    array([ 0.559657  , -0.83473591, -0.14516193])
    >>> float(body.period)
    14.8973683698591...
    """

    inertia: ArrayLike
    omega: ArrayLike
    attitude: ArrayLike = (1.0, 0.0, 0.0, 0.0)
    _lead: tuple[int, ...] = field(init=False, repr=False, compare=False)
    _unit: Array = field(init=False, repr=False, compare=False)
    """A power of two for each body, (b,): the rotation is that of moments near 1, whose powers neither overflow nor vanish."""
    _rotation: FreeRotation = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        moments, axes = _moments_and_axes(self.inertia)
        omega, q = as_numbers("omega", self.omega), as_numbers("attitude", self.attitude)
        if omega.shape[-1:] != (3,):
            raise ValueError(f"omega has three components, found the shape {omega.shape}")
        if not np.isfinite(omega).all():
            raise ValueError("omega must be finite")
        if not is_doubled(moments):
            _check(moments)
        lead = common_shape(inertia=moments.shape[:-1], omega=omega.shape[:-1], attitude=q.shape[:-1])
        unit = np.broadcast_to(quaternion.normalize(q), lead + (4,)).reshape(-1, 4)
        moments = np.broadcast_to(moments, lead + (3,)).reshape(-1, 3)
        axes = np.broadcast_to(axes, lead + (3, 3)).reshape(-1, 3, 3)
        spin = (axes * np.broadcast_to(omega, lead + (3,)).reshape(-1, 1, 3)).sum(axis=-1)
        size = np.ldexp(1.0, np.frexp(moments.value[:, 2] if is_doubled(moments) else moments[:, 2])[1])
        object.__setattr__(self, "_lead", lead)
        object.__setattr__(self, "_unit", size)
        object.__setattr__(self, "_rotation", FreeRotation(moments / size[:, None], axes, spin, unit))

    def at(self, t: ArrayLike) -> FreeState:
        """Return the state at times t, (n,) or a single one, s: `.omega` (..., n, 3), `.attitude` (..., n, 4)."""
        time = as_array(t)
        if time.ndim > 1:
            raise ValueError(f"times are a number or one row of numbers, found the shape {time.shape}")
        if not np.isfinite(time).all():
            raise ValueError("times must be finite")
        return FreeState(self, time)

    @property
    def period(self) -> Array:
        """The period of the angular velocity in body axes, (...), s; infinite where it is constant or never returns."""
        return self._rotation.period.reshape(self._lead)

    @property
    def momentum(self) -> Array:
        """The angular momentum in space axes, constant, (..., 3), kg·m²/s."""
        return as_array(self._rotation.momentum * self._unit[:, None]).reshape(self._lead + (3,))

    @property
    def energy(self) -> Array:
        """The kinetic energy, constant, (...), J."""
        m = self._rotation
        return as_array((m.moments * m.omega**2).sum(axis=-1) * self._unit / 2).reshape(self._lead)

    @cached_property
    def in_32_digits(self) -> FreeBody:
        """This body in doubled numbers."""
        return FreeBody(*map(in_32_digits, (self.inertia, self.omega, self.attitude)))

    def error_estimate(self, of: str = "period", exact: FreeBody | None = None) -> Array:
        """Return an estimate of the error of the period, the energy (...) or the momentum (..., 3).

        Computed twice, with 16 and with 32 digits; `exact` is the body in doubled numbers, if it has more digits than floats.
        """
        require(of, "period", "momentum", "energy")
        second: Any = getattr(exact or self.in_32_digits, of)
        here = getattr(self, of)
        off = second.off(here)
        # there may be none
        return np.where(np.isinf(here) & np.isinf(second.high), 0.0, np.where(np.isnan(off), np.inf, off))

    @property
    def separatrix(self) -> Array:
        """The complementary parameter m₁ of the motion, (...): 0 on the separatrix, 1 far from it or for a symmetric body."""
        return self._rotation.m1.reshape(self._lead)


def _moments_and_axes(inertia: ArrayLike) -> tuple[Array, Array]:
    moments, axes = principal(inertia)
    if is_doubled(inertia):
        # a thin rod is one to 16 digits
        rod = principal(inertia.value).moments[..., :1] == 0
        middle = (moments[..., 1:2] + moments[..., 2:]) / 2
        moments, axes = np.where(rod, middle * [0.0, 1.0, 1.0], moments), in_32_digits(axes)
    return moments, axes


def _check(moments: Array) -> None:
    """Raise ValueError for moments that no body has."""
    if (moments < 0).any() or (moments[..., 1] <= 0).any():
        raise ValueError(
            f"the principal moments of inertia must be positive (one may be zero: a thin rod), found {moments}"
        )
    if ((moments[..., 0] == 0) & (moments[..., 1] != moments[..., 2])).any():
        raise ValueError("a body with one zero moment is a thin rod: the other two moments must be equal")
    if reason := check(moments).reason:
        raise ValueError(f"{reason}: no body has these")


@record
@dataclass(frozen=True, eq=False, repr=False)
class FreeState(InClosedForm):
    """The state of a free body at given times; each quantity is computed on the first request."""

    body: FreeBody
    time: Array

    @cached_property
    def omega(self) -> Array:
        """Angular velocity in body axes, (..., n, 3), rad/s."""
        omega = in_blocks(self.body._rotation.omega_at, self.time, self.body._lead, 3)
        return from_start(omega, self.body.omega, self.time)

    @cached_property
    def attitude(self) -> Array:
        """Quaternion [w, x, y, z], body to space, (..., n, 4), continuous in time."""
        attitude = in_blocks(self.body._rotation.attitude_at, self.time, self.body._lead, 4)
        start = quaternion.normalize(as_numbers("attitude", self.body.attitude))
        return from_start(attitude, start, self.time)

    @cached_property
    def momentum(self) -> Array:
        """Angular momentum in space axes from this very state, (..., n, 3), kg·m²/s."""
        moments, axes = self._moments_and_axes
        spin = (axes * self.omega[..., None, :]).sum(axis=-1)
        body = (axes * (moments * spin)[..., :, None]).sum(axis=-2)
        return quaternion.rotate(self.attitude, body)

    @cached_property
    def energy(self) -> Array:
        """Kinetic energy from this very state, (..., n), J."""
        moments, axes = self._moments_and_axes
        spin = (axes * self.omega[..., None, :]).sum(axis=-1)
        return as_array((moments * spin**2).sum(axis=-1) / 2)

    @property
    def _moments_and_axes(self) -> tuple[Array, Array]:
        """The principal moments and axes, for each time."""
        moments, axes = _moments_and_axes(self.body.inertia)
        return (moments[..., None, :], axes[..., None, :, :]) if self.time.ndim else (moments, axes)

    @property
    def _picture_data(self) -> PictureData:
        return PictureData(self.body.inertia, free=True, top=False)

    @cached_property
    def in_32_digits(self) -> FreeState:
        """This state in doubled numbers."""
        return self.body.in_32_digits.at(in_32_digits(self.time))
