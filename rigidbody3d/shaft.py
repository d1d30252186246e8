"""A shaft with attached bodies, turning about z on two bearings: reactions, driving torque, unbalance.

In the plane across the shaft a vector is a complex number x + iy, here the pair (x, y). With U = ∫ (x + iy) dm the static unbalance and
V(z1) = ∫ (x + iy)(z - z1) dm, the inertia of a body turning at ω, ω̇ asks the bearings for

    R2 = (-ω² + i ω̇) V(z1)/(z2 - z1),   R1 = (-ω² + i ω̇) V(z2)/(z1 - z2),

the moment about the other bearing over the span: no reaction is the difference of large numbers.
(Beer and Johnston, ch. 18; Meriam and Kraige, ch. 7, with I_xz and I_yz about the bearings.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import components, numbers, record, table
from dalembert.arithmetic.shapes import as_array, in_32_digits
from rigidbody3d.attitude import length
from rigidbody3d.body import Body
from rigidbody3d.inertia import vectors
from rigidbody3d.states import require

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import FigureBase

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def shaft_axes(axis: ArrayLike) -> Array:
    """Return axes for a shaft along any vector (..., 3): two across it and its own as rows, right-handed, (..., 3, 3).

    The first lies nearest to the coordinate axis that follows the largest component: y for a shaft along x, x for one along
    z. A body turned by the matrix about the origin has its shaft along z: `Shaft(body.turned(axes, (0, 0, 0)), ...)`.

    Raises
    ------
    ValueError
        A vector of zeros, or one that is not finite.

    Examples
    --------
    >>> shaft_axes([2.0, 0.0, 0.0])
    array([[0., 1., 0.],
           [0., 0., 1.],
           [1., 0., 0.]])
    """
    n = as_array(axis)
    largest = np.abs(n).max(axis=-1, keepdims=True)
    if n.shape[-1:] != (3,) or not (np.isfinite(n).all() and (largest > 0).all()):
        raise ValueError(f"the axis of a shaft is a vector of three numbers, not all 0, found {axis!r}")
    n = n / largest
    n = n / length(n)
    following = (np.abs(n).argmax(axis=-1) + 1) % 3
    first = np.eye(3)[following]
    first = first - n * (n * first).sum(axis=-1)[..., None]
    first = first / length(first)
    return np.stack([first, np.cross(n, first), n], axis=-2) + 0.0


@record
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Shaft:
    """A body that turns about the z-axis on two bearings, in the drawn position.

    Parameters
    ----------
    body
        What turns; leading axes are shafts.
    bearings
        z1 and z2, (2,) or (..., 2), m. The first also holds the shaft along z.
    speed
        ω, (...), rad/s.
    speed_rate
        ω̇, (...), rad/s².
    gravity
        The acceleration of gravity as a vector, (3,) or (..., 3), m/s²; default none.

    Raises
    ------
    ValueError
        Both bearings at one place.

    Examples
    --------
    Riul's example 4 on a shaft: a rod of length 2b = 1 m, 60° from the shaft it is welded to, 10 rad/s.

    >>> from rigidbody3d import Body
    >>> tilt = np.radians(60)
    >>> R = [[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]]
    >>> rod = Body.of("rod", 4.0, length=1.0).turned(R)
    >>> Shaft(rod, (-0.5, 0.5), 10.0).dynamic.round(6)
    array([[ 14.433757,   0.      ],
           [-14.433757,   0.      ]])
    """

    body: Body
    bearings: Array
    speed: Array
    speed_rate: Array
    gravity: Array

    def __init__(
        self,
        body: Body,
        bearings: ArrayLike,
        speed: ArrayLike = 0.0,
        speed_rate: ArrayLike = 0.0,
        gravity: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        z = as_array(bearings)
        if z.shape[-1:] != (2,) or not np.isfinite(z).all():
            raise ValueError(f"two bearings have two finite positions z1, z2, found {bearings!r}")
        if (z[..., 0] == z[..., 1]).any():
            raise ValueError("the two bearings lie at the same place: they cannot hold a moment")
        object.__setattr__(self, "body", body)
        object.__setattr__(self, "bearings", z)
        object.__setattr__(self, "speed", as_array(speed))
        object.__setattr__(self, "speed_rate", as_array(speed_rate))
        object.__setattr__(self, "gravity", vectors("gravity", gravity))

    def __repr__(self) -> str:
        speed, unbalance = numbers(self.speed), numbers(self.unbalance)
        return f"<Shaft: bearings at {numbers(self.bearings)} m, {speed} rad/s, unbalance {unbalance} kg·m>"

    # --- vectors across the shaft as pairs (..., 2) of x and y ---

    @property
    def _weight(self) -> Array:
        return self.body.mass[..., None] * self.gravity

    @property
    def static_unbalance_xy(self) -> Array:
        """U as x and y, (..., 2), kg·m."""
        return self.body.mass[..., None] * self.body.center[..., :2]

    def moment_unbalance_xy(self, z: ArrayLike) -> Array:
        """Return V(z) as x and y, (..., 2), kg·m²."""
        arm = self.body.center[..., 2] - as_array(z)
        return -self.body.inertia[..., :2, 2] + self.static_unbalance_xy * arm[..., None]

    @cached_property
    def unbalance_xy(self) -> Array:
        """The dynamic unbalance in the planes of the bearings as x and y, (..., 2, 2), kg·m."""
        z1, z2 = self.bearings[..., 0], self.bearings[..., 1]
        planes = [
            self.moment_unbalance_xy(there) * (1 / (here - there))[..., None]
            for here, there in ((z1, z2), (z2, z1))
        ]
        return np.stack(np.broadcast_arrays(*planes), axis=-2)

    def _turning(self, unbalance: Array) -> Array:
        """The forces that unbalances (..., 2, 2) ask for: times -ω² + i ω̇."""
        pull, push = -np.square(self.speed)[..., None], self.speed_rate[..., None]
        x, y = unbalance[..., 0], unbalance[..., 1]
        return np.stack([pull * x - push * y, pull * y + push * x], axis=-1) + 0.0

    # --- the requested quantities ---

    @property
    def static_unbalance(self) -> Complex:
        """U = ∫ (x + iy) dm, (...), kg·m."""
        return _complex(self.static_unbalance_xy)

    def moment_unbalance(self, z: ArrayLike) -> Complex:
        """Return V(z) = ∫ (x + iy)(z' - z) dm about a plane, (...), kg·m²: the products I_xz + i I_yz about it."""
        return _complex(self.moment_unbalance_xy(z))

    @property
    def unbalance(self) -> Complex:
        """The dynamic unbalance as two unbalances in the planes of the bearings, (..., 2), kg·m."""
        return _complex(self.unbalance_xy)

    @cached_property
    def dynamic(self) -> Array:
        """Forces of the bearings on the shaft that the turning asks for, (..., 2, 2): bearing, then x and y, N."""
        return self._turning(self.unbalance_xy)

    @cached_property
    def static(self) -> Array:
        """Forces of the bearings on the shaft that carry the weight, (..., 2, 2): bearing, then x and y, N."""
        weight, c, z = self._weight, self.body.center, self.bearings
        # the moment of the weight about each bearing, its part along the shaft included
        arms = (c[..., 2:] - z[..., ::-1])[..., None]
        lever = weight[..., None, :2] * arms - (c[..., :2] * weight[..., 2:])[..., None, :]
        span = np.stack([z[..., 0] - z[..., 1], z[..., 1] - z[..., 0]], axis=-1)
        return -lever * (1 / span)[..., None] + 0.0

    @property
    def axial(self) -> Array:
        """Force along z of the bearings on the shaft, (...), N."""
        return 0.0 - self._weight[..., 2]

    @property
    def drive_torque(self) -> Array:
        """Torque about z that drives the shaft: I_zz ω̇ less the moment of the weight, (...), N·m."""
        c, weight = self.body.center, self._weight
        about = self.body.inertia[..., 2, 2] + self.body.mass * (c[..., 0] ** 2 + c[..., 1] ** 2)
        return about * self.speed_rate - (c[..., 0] * weight[..., 1] - c[..., 1] * weight[..., 0])

    def to_frame(self) -> pd.DataFrame:
        """Return a table with a row per bearing: z_m, what it carries at rest and because of the turning, the unbalance."""
        columns = {"z_m": self.bearings}
        columns |= components("static_*_N", self.static, "xy") | components("dynamic_*_N", self.dynamic, "xy")
        columns |= {
            "unbalance_kg_m": np.abs(self.unbalance),
            "angle_deg": np.degrees(np.angle(self.unbalance)) % 360,
        }
        return table(columns, ("shaft", "bearing"))

    def plot(self, names: Sequence[str] = (), figure: FigureBase | None = None) -> NDArray[np.object_]:
        """Draw the shaft from two sides, and below each view the bearing forces in its plane; return the axes (2, 2).

        `names` are those of the parts. One shaft, else a ValueError. Without a figure it is a new one of pyplot's;
        without matplotlib (the extra `plot`) an ImportError.
        """
        from rigidbody3d.picture import views

        forces = ({"static": self.static} if self.gravity.any() else {}) | {"dynamic": self.dynamic}
        return views.shaft(self.body.solids(), names, self.body.whole(), self.bearings, forces, figure=figure)

    @cached_property
    def in_32_digits(self) -> Shaft:
        """This shaft in doubled numbers."""
        entering = (self.bearings, self.speed, self.speed_rate, self.gravity)
        return Shaft(self.body.in_32_digits, *map(in_32_digits, entering))

    def error_estimate(self, of: str) -> Array:
        """Return an estimate of the error of a quantity, in its shape and unit; of a complex one: of its size.

        Parameters
        ----------
        of
            Its name: dynamic, static, axial, drive_torque, unbalance, static_unbalance.

        Notes
        -----
        Computed twice, with 16 and with 32 digits, from what the body was made of (`Body.in_32_digits`).

        Examples
        --------
        >>> from rigidbody3d import Body
        >>> rotor = Body(4.0, [1e-3, 0.0, 1.0], np.diag([1.0, 1.0, 0.1]))
        >>> bool((Shaft(rotor, (0.0, 2.0), 100.0).error_estimate("dynamic") < 1e-13).all())
        True
        """
        require(of, *ESTIMATED)
        name = f"{of}_xy" if of.endswith("unbalance") else of
        second: Any = getattr(self.in_32_digits, name)
        off: Array = second.off(getattr(self, name))
        return np.hypot(off[..., 0], off[..., 1]) if name != of else off

    def with_masses(self, unbalance: ArrayLike, z: ArrayLike) -> Array:
        """Return the dynamic forces with further unbalances (..., k) at z (k,) on the shaft, (..., 2, 2), N.

        For masses small beside the shaft's: their own weight and inertia about z are left out.
        """
        U = np.asarray(unbalance, dtype=complex)
        return self.with_masses_xy(np.stack([U.real, U.imag], axis=-1), np.asarray(z, dtype=float))

    def with_masses_xy(self, unbalance: Array, z: Array) -> Array:
        """Return `with_masses` for unbalances (..., k, 2) as x and y."""
        z1, z2 = self.bearings[..., 0], self.bearings[..., 1]
        shares = [
            (unbalance * ((z - there[..., None]) / (here - there)[..., None])[..., None]).sum(axis=-2)
            for here, there in ((z1, z2), (z2, z1))
        ]
        return self._turning(self.unbalance_xy + np.stack(shares, axis=-2))


ESTIMATED = ("static_unbalance", "unbalance", "dynamic", "static", "axial", "drive_torque")
"""The quantities of a shaft with an error estimate."""


def _complex(pairs: Array) -> Complex:
    return np.asarray(pairs[..., 0] + 1j * pairs[..., 1])
