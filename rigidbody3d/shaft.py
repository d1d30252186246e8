"""A shaft with attached bodies, turning about z on two bearings: reactions, driving torque, unbalance.

In the plane across the shaft a vector is a complex number x + iy. With U = ∫ (x + iy) dm the static unbalance and
V(z1) = ∫ (x + iy)(z - z1) dm, the inertia of a body turning at ω, ω̇ asks the bearings for

    R2 = (-ω² + i ω̇) V(z1)/(z2 - z1),   R1 = (-ω² + i ω̇) V(z2)/(z1 - z2),

the moment about the other bearing over the span: no reaction is the difference of large numbers.
(Beer and Johnston, ch. 18; Meriam and Kraige, ch. 7, with I_xz and I_yz about the bearings.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import components, numbers, record, table
from rigidbody3d.body import Body
from rigidbody3d.rounding import MassProperties
from rigidbody3d.rounding_in_time import require

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
    n = np.asarray(axis, dtype=float)
    largest = np.abs(n).max(axis=-1, keepdims=True)
    if n.shape[-1:] != (3,) or not (np.isfinite(n).all() and (largest > 0).all()):
        raise ValueError(f"the axis of a shaft is a vector of three numbers, not all 0, found {axis!r}")
    n = n / largest
    n = n / np.linalg.norm(n, axis=-1, keepdims=True)
    following = (np.abs(n).argmax(axis=-1) + 1) % 3
    first = np.eye(3)[following]
    first = first - n * (n * first).sum(axis=-1, keepdims=True)
    first = first / np.linalg.norm(first, axis=-1, keepdims=True)
    return np.stack([first, np.cross(n, first), n], axis=-2) + 0.0


@dataclass(frozen=True, eq=False, repr=False)
class _Formulas:
    """The formulas of a shaft, on arrays of any kind of number, recorded ones for bounds too."""

    body: Body | MassProperties
    bearings: Array
    speed: Array
    speed_rate: Array
    gravity: Array

    @property
    def _turning(self) -> Complex:
        """-ω² + i ω̇: what the acceleration of a point is to its place across the shaft."""
        return np.asarray(-np.square(self.speed) + 1j * self.speed_rate)

    @property
    def _weight(self) -> Array:
        return np.asarray(self.body.mass[..., None] * self.gravity)

    @property
    def static_unbalance(self) -> Complex:
        """U = ∫ (x + iy) dm, (...), kg·m."""
        return np.asarray(self.body.mass * _across(self.body.center))

    def moment_unbalance(self, z: ArrayLike) -> Complex:
        """Return V(z) = ∫ (x + iy)(z' - z) dm about a plane, (...), kg·m²: the products I_xz + i I_yz about it."""
        I, c = self.body.inertia, self.body.center
        central = -I[..., 0, 2] - 1j * I[..., 1, 2]
        return np.asarray(central + self.static_unbalance * (c[..., 2] - np.asarray(z)))

    @cached_property
    def unbalance(self) -> Complex:
        """The dynamic unbalance as two unbalances in the planes of the bearings, (..., 2), kg·m."""
        z1, z2 = self.bearings[..., 0], self.bearings[..., 1]
        return np.stack(
            np.broadcast_arrays(
                self.moment_unbalance(z2) * (1 / (z1 - z2)), self.moment_unbalance(z1) * (1 / (z2 - z1))
            ),
            axis=-1,
        )

    @cached_property
    def dynamic(self) -> Array:
        """Forces of the bearings on the shaft that the turning asks for, (..., 2, 2): bearing, then x and y, N."""
        return _parts(self._turning[..., None] * self.unbalance)

    @cached_property
    def static(self) -> Array:
        """Forces of the bearings on the shaft that carry the weight, (..., 2, 2): bearing, then x and y, N."""
        weight, c, z = self._weight, self.body.center, self.bearings
        across = _across(weight)
        # the moment of the weight about each bearing, its part along the shaft included
        lever = across[..., None] * (c[..., 2:] - z[..., ::-1]) - (_across(c) * weight[..., 2])[..., None]
        span = np.stack([z[..., 0] - z[..., 1], z[..., 1] - z[..., 0]], axis=-1)
        return _parts(-lever * (1 / span))

    @property
    def axial(self) -> Array:
        """Force along z of the bearings on the shaft, (...), N."""
        return np.asarray(0.0 - self._weight[..., 2])

    @property
    def drive_torque(self) -> Array:
        """Torque about z that drives the shaft: I_zz ω̇ less the moment of the weight, (...), N·m."""
        c, weight = self.body.center, self._weight
        about = self.body.inertia[..., 2, 2] + self.body.mass * (c[..., 0] ** 2 + c[..., 1] ** 2)
        return np.asarray(about * self.speed_rate - (c[..., 0] * weight[..., 1] - c[..., 1] * weight[..., 0]))


@record
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Shaft(_Formulas):
    """A body turning about the z-axis on two bearings, in the position drawn.

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

    def __init__(
        self,
        body: Body,
        bearings: ArrayLike,
        speed: ArrayLike = 0.0,
        speed_rate: ArrayLike = 0.0,
        gravity: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        z = np.asarray(bearings, dtype=float)
        if z.shape[-1:] != (2,) or not np.isfinite(z).all():
            raise ValueError(f"two bearings have two finite positions z1, z2, found {bearings!r}")
        if (z[..., 0] == z[..., 1]).any():
            raise ValueError("the two bearings lie at the same place: they cannot hold a moment")
        object.__setattr__(self, "body", body)
        object.__setattr__(self, "bearings", z)
        object.__setattr__(self, "speed", np.asarray(speed, dtype=float))
        object.__setattr__(self, "speed_rate", np.asarray(speed_rate, dtype=float))
        object.__setattr__(self, "gravity", np.asarray(gravity, dtype=float))

    def __repr__(self) -> str:
        speed, unbalance = numbers(self.speed), numbers(self.unbalance)
        return f"<Shaft: bearings at {numbers(self.bearings)} m, {speed} rad/s, unbalance {unbalance} kg·m>"

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

    def error_estimate(self, of: str, given: float = 0.0) -> Array:
        """Return a bound of the rounding error of a quantity, in its shape and unit; of a complex one: of its size.

        Parameters
        ----------
        of
            Its name: dynamic, static, axial, drive_torque, unbalance, static_unbalance.
        given
            By how much of themselves speed, gravity and the places of the bearings may be off.

        Notes
        -----
        With what the body itself has from how it was made (`Body.error_estimate`).

        Examples
        --------
        >>> from rigidbody3d import Body
        >>> rotor = Body(4.0, [1e-3, 0.0, 1.0], np.diag([1.0, 1.0, 0.1]))
        >>> bool((Shaft(rotor, (0.0, 2.0), 100.0).error_estimate("dynamic") < 1e-13).all())
        True
        """
        from dalembert.arithmetic.bounds import bounds, read

        require(of, *ESTIMATED)
        entering = self.body.given()
        for name, axes in (("bearings", 1), ("speed", 0), ("speed_rate", 0), ("gravity", 1)):
            entering[name] = read(getattr(self, name), axes, given)
        return bounds(_quantity, entering, of)[0]

    def with_masses(self, unbalance: ArrayLike, z: ArrayLike) -> Array:
        """Return the dynamic forces with further unbalances (..., k) at z (k,) on the shaft, (..., 2, 2), N.

        For masses small beside the shaft's: their own weight and inertia about z are left out.
        """
        U, at = np.asarray(unbalance, dtype=complex), np.asarray(z, dtype=float)
        z1, z2 = self.bearings[..., 0], self.bearings[..., 1]
        share = np.stack(
            [
                (U * (at - z2[..., None]) / (z1 - z2)[..., None]).sum(axis=-1),
                (U * (at - z1[..., None]) / (z2 - z1)[..., None]).sum(axis=-1),
            ],
            axis=-1,
        )
        return _parts(self._turning[..., None] * (self.unbalance + share))


ESTIMATED = ("static_unbalance", "unbalance", "dynamic", "static", "axial", "drive_torque")
"""What a shaft has estimates of."""


def _quantity(of: str, *, mass: Array, center: Array, inertia: Array, **given: Array) -> list[Array]:
    """A quantity of a shaft, from the numbers it is worked out of."""
    return [getattr(_Formulas(MassProperties(mass, center, inertia), **given), of)]


def _across(vector: Array) -> Complex:
    return np.asarray(vector[..., 0] + 1j * vector[..., 1])


def _parts(z: Complex) -> Array:
    x, y = _recorded_parts(z) if z.dtype == object else (z.real, z.imag)
    return np.stack([x, y], axis=-1) + 0.0


_recorded_parts = np.frompyfunc(lambda z: (z.real, z.imag), 1, 2)
