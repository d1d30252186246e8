"""Free bodies: the rotation of a rigid body that no torque acts on, at any time (`free_rotation` has the formulas)."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_numbers, common_shape
from rigidbody3d import attitude as quaternion
from rigidbody3d.free_rotation import FreeRotation
from rigidbody3d.inertia import check, principal
from rigidbody3d.rounding_in_time import FEW, STATE, apart, require, tensors_off
from rigidbody3d.states import AtTimes, Seen, in_blocks

Array = NDArray[np.float64]


@record
@dataclass(frozen=True, eq=False, repr=False)
class FreeBody:
    """A rigid body that no torque acts on, from its inertia and its state at time zero.

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
    distance to the separatrix is worked out in doubled precision: it is exact for the numbers given.

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
    _rotation: FreeRotation = field(init=False, repr=False, compare=False)

    # moments put off by their errors, to see what that does, may be those of no body
    _of_a_body: ClassVar[bool] = True

    def __post_init__(self) -> None:
        moments, axes = principal(self.inertia)
        omega, q = as_numbers("omega", self.omega), as_numbers("attitude", self.attitude)
        if omega.shape[-1:] != (3,):
            raise ValueError(f"omega has three components, found the shape {omega.shape}")
        if not np.isfinite(omega).all():
            raise ValueError("omega must be finite")
        if (moments < 0).any() or (moments[..., 1] <= 0).any():
            raise ValueError(
                f"the principal moments of inertia must be positive (one may be zero: a thin rod), found {moments}"
            )
        if ((moments[..., 0] == 0) & (moments[..., 1] != moments[..., 2])).any():
            raise ValueError("a body with one zero moment is a thin rod: the other two moments must be equal")
        if self._of_a_body and (reason := check(moments).reason):
            raise ValueError(f"{reason}: no body has these")
        lead = common_shape(inertia=moments.shape[:-1], omega=omega.shape[:-1], attitude=q.shape[:-1])
        unit = np.broadcast_to(quaternion.normalize(q), lead + (4,)).reshape(-1, 4)
        moments = np.broadcast_to(moments, lead + (3,)).reshape(-1, 3)
        axes = np.broadcast_to(axes, lead + (3, 3)).reshape(-1, 3, 3)
        spin = np.einsum("bij,bj->bi", axes, np.broadcast_to(omega, lead + (3,)).reshape(-1, 3))
        object.__setattr__(self, "_lead", lead)
        object.__setattr__(self, "_rotation", FreeRotation(moments, axes, spin, unit))

    def at(self, t: ArrayLike) -> FreeState:
        """Return the state at times t, (n,) or a single one, s: `.omega` (..., n, 3), `.attitude` (..., n, 4)."""
        time = np.asarray(t, dtype=float)
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
        return self._rotation.momentum.reshape(self._lead + (3,))

    @property
    def energy(self) -> Array:
        """The kinetic energy, constant, (...), J."""
        m = self._rotation
        return np.asarray((m.moments * m.omega**2).sum(axis=-1) / 2).reshape(self._lead)

    def error_estimate(self, of: str = "period", tensor: ArrayLike = 0.0) -> Array:
        """Return a bound of the rounding error of the period, the energy (...) or the momentum (..., 3).

        `tensor` bounds the errors of the tensor's own entries, (..., 3, 3), kg·m², where it was worked out.
        """
        require(of, "period", "momentum", "energy")
        here = getattr(self, of)
        size = quaternion.length(here) if of == "momentum" else np.abs(here)
        total = FEW * np.where(np.isfinite(size), size, 0.0)
        for other in tensors_off(self.inertia, tensor):
            there = getattr(_PutOff(other, self.omega, self.attitude), of)
            with np.errstate(invalid="ignore"):
                change = np.where(there == here, 0.0, np.abs(there - here))
            total = total + (change.max(axis=-1, keepdims=True) if of == "momentum" else change)
        return np.asarray(total + np.zeros(np.shape(here)))

    @property
    def separatrix(self) -> Array:
        """The complementary parameter m₁ of the motion, (...): 0 on the separatrix, 1 far from it or for a symmetric body."""
        return self._rotation.m1.reshape(self._lead)


class _PutOff(FreeBody):
    """A free body whose tensor is put off by its error."""

    _of_a_body = False


@record
@dataclass(frozen=True, eq=False, repr=False)
class FreeState(AtTimes):
    """The state of a free body at given times; each quantity is computed on the first request."""

    body: FreeBody
    time: Array

    @cached_property
    def omega(self) -> Array:
        """Angular velocity in body axes, (..., n, 3), rad/s."""
        return in_blocks(self.body._rotation.omega_at, self.time, self.body._lead, 3)

    @cached_property
    def attitude(self) -> Array:
        """Quaternion [w, x, y, z], body to space, (..., n, 4), continuous in time."""
        return in_blocks(self.body._rotation.attitude_at, self.time, self.body._lead, 4)

    @cached_property
    def momentum(self) -> Array:
        """Angular momentum in space axes from this very state, (..., n, 3), kg·m²/s."""
        moments, axes = principal(self.body.inertia)
        tensor = np.einsum("...ki,...k,...kj->...ij", axes, moments, axes)
        one = tensor[..., None, :, :] if self.time.ndim else tensor
        body = np.einsum("...ij,...j->...i", one, self.omega)
        return quaternion.rotate(self.attitude, body)

    @cached_property
    def energy(self) -> Array:
        """Kinetic energy from this very state, (..., n), J."""
        moments, axes = principal(self.body.inertia)
        if self.time.ndim:
            moments, axes = moments[..., None, :], axes[..., None, :, :]
        spin = np.einsum("...ij,...j->...i", axes, self.omega)
        return np.asarray((moments * spin**2).sum(axis=-1) / 2)

    @property
    def _seen(self) -> Seen:
        return Seen(self.body.inertia, free=True, top=False)

    def error_estimate(self, of: str = "attitude", tensor: ArrayLike = 0.0) -> Array:
        """Return a bound of the rounding error of a quantity, the given data as exact.

        Parameters
        ----------
        of
            "attitude", as an angle (..., n), rad; "omega" or "momentum", (..., n, 3); "energy", (..., n).
        tensor
            Bounds of the errors of the tensor's own entries, (..., 3, 3), kg·m², where it was worked out.

        Notes
        -----
        A phase is rounded where it is a large number: the error of attitude and omega grows as ε·|ω|t, and in no
        other way; momentum and energy do not feel it. An oblique tensor counts as off by a few ε.

        Examples
        --------
        >>> late = FreeBody([1, 2, 3], [1.0, 0.1, 0.5]).at([1.0, 1e6])
        >>> late.error_estimate() < 1e-14
        array([ True, False])
        """
        require(of, *STATE)
        body = self.body
        total: Array | float = 0.0
        # each entry of the tensor in turn is put off by its error, and by that of working out principal axes
        for other in tensors_off(body.inertia, tensor):
            total = total + apart(_PutOff(other, body.omega, body.attitude).at(self.time), self, of)
        return np.asarray(self._rounding(of) + total)

    def _rounding(self, of: str) -> Array:
        """Bound what rounding does on the way from the given tensor to the state."""
        body = self.body
        motion, lead = body._rotation, body._lead
        late, angle, across = motion.phase_errors(np.atleast_1d(self.time))
        shape = lead + self.time.shape
        if of == "attitude":
            return (FEW + EPS * angle).reshape(shape)
        if of == "omega":
            axes = np.broadcast_to(principal(body.inertia).axes, (*lead, 3, 3)).reshape(-1, 3, 3)
            w = self.omega.reshape(motion.count, -1, 3) @ np.swapaxes(axes, -1, -2)
            I = motion.moments[:, None, :]
            torque = np.cross(I * w, w)
            rise = np.divide(torque, I, out=np.zeros_like(torque), where=I > 0)
            bound = EPS * late[..., None] * np.abs(rise) + FEW * (np.abs(w) + across)
            return (bound @ np.abs(axes)).reshape(*shape, 3)
        # both stay what they were however late the state is
        size = FEW * 3 * (np.abs(body.energy) if of == "energy" else quaternion.length(body.momentum)[..., 0])
        rounding = np.zeros(shape) + (size[..., None] if self.time.ndim else size)
        return rounding[..., None] + np.zeros(3) if of == "momentum" else rounding
