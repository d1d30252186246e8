"""A body put together from parts, its motion, the shaft it may be, and bounds of the rounding errors of all that."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cli.read.parts import READ, Parts
from cli.read.planes import Planes
from dalembert.angles import degrees
from rigidbody3d import Body, Motion, Shaft
from rigidbody3d.shaft import shaft_axes

if TYPE_CHECKING:
    from balancing import Correction
    from rigidbody3d.rounding import BodyError

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
AXES = "xyz"
ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class ShaftRequest:
    """A shaft turning about an axis through the origin."""

    axis: Vector | None
    """Its direction; None: z."""
    bearings: tuple[float, float]
    speed: float
    speed_rate: float
    gravity: Vector
    planes: Planes | None


@dataclass(frozen=True)
class Request:
    """What was asked for, in SI."""

    omega: Vector | None = None
    alpha: Vector | None = None
    frame_omega: Vector | None = None
    about: Vector | None = None
    fixed: Vector | None = None
    velocity: Vector | None = None
    acceleration: Vector | None = None
    shaft: ShaftRequest | None = None


class CorrectionMass(NamedTuple):
    """What goes into a correction plane of a shaft; with bounds of its errors in place of numbers, what they may be off by."""

    plane: str
    z: float
    radius: float
    unbalance: float
    mass: float
    angle: float


@dataclass(frozen=True)
class MovingBody:
    """A body and its motion; each quantity is computed on the first request."""

    parts: Parts
    request: Request

    @cached_property
    def motion(self) -> Motion:
        """The motion of the body, its components along the axes drawn."""
        w, body = self.request, self.parts.whole
        omega, alpha, point = w.omega or ORIGIN, w.alpha or ORIGIN, w.fixed
        if w.shaft is not None:
            x, y, z = self.shaft_axes[2].tolist()
            omega, alpha = (
                tuple(n * rate for n in (x, y, z)) for rate in (w.shaft.speed, w.shaft.speed_rate)
            )
            point = ORIGIN
        if point is None:
            velocity, acceleration = w.velocity or ORIGIN, w.acceleration or ORIGIN
            return Motion(
                body.inertia, omega, alpha, w.frame_omega, body.mass, body.center, velocity, acceleration
            )
        return Motion.about_fixed_point(
            body.inertia,
            omega,
            alpha,
            mass=body.mass,
            center=body.center,
            point=point,
            frame_omega=w.frame_omega,
        )

    @property
    def point(self) -> Vector:
        """The point that `…_about` speaks of: as given, else the fixed point, else the origin."""
        return self.request.about or self.request.fixed or ORIGIN

    @property
    def moving(self) -> bool:
        """Whether any motion was asked about."""
        w = self.request
        return w.shaft is not None or any(
            x is not None for x in (w.omega, w.alpha, w.velocity, w.acceleration)
        )

    @cached_property
    def shaft_axes(self) -> Array:
        """Two axes across the shaft and its own, as rows; those drawn for a shaft along z."""
        s = self.request.shaft
        assert s is not None
        return np.eye(3) if s.axis is None else shaft_axes(s.axis)

    @property
    def letters(self) -> str:
        """The names of those three axes."""
        for letters in ("xyz", "yzx", "zxy"):
            if (self.shaft_axes == np.eye(3)[["xyz".index(a) for a in letters]]).all():
                return letters
        return "ξηζ"

    def upright(self, body: Body) -> Body:
        """Return a body, or parts, along the axes of the shaft."""
        if self.letters == "xyz":
            return body
        return body.turned(self.shaft_axes, ORIGIN, self._axes_error)

    @cached_property
    def _axes_error(self) -> Array:
        """What the entries of the shaft's axes may be off by: those along coordinate axes are exact."""
        rough = 4 * READ * np.ones((3, 3))
        return np.where(np.isin(self.shaft_axes, (-1.0, 0.0, 1.0)).all(), 0.0, rough)

    @cached_property
    def shaft(self) -> Shaft:
        """The shaft on its bearings, along its own axes."""
        s = self.request.shaft
        assert s is not None
        gravity = self.shaft_axes @ s.gravity + 0.0
        return Shaft(self.upright(self.parts.whole), s.bearings, s.speed, s.speed_rate, gravity)

    def drawn(self, across: ArrayLike, along: float = 0.0) -> Array:
        """Return a vector of the shaft, its part across and that along, along the axes drawn, (3,)."""
        return np.asarray(np.append(across, along) @ self.shaft_axes + 0.0)

    def drawn_error(
        self, across: ArrayLike, error: ArrayLike, along: float = 0.0, rest: float = 0.0
    ) -> Array:
        """Bound the errors of such a vector, from those of its part across and of that along."""
        turned = np.append(error, rest) @ np.abs(self.shaft_axes)
        return np.asarray(turned + np.abs(np.append(across, along)) @ self._axes_error)

    @cached_property
    def correction(self) -> Correction | None:
        """The corrections of the shaft's unbalance."""
        s = self.request.shaft
        if s is None or s.planes is None:
            return None
        from balancing import correct

        assert s.planes.z is not None
        return correct(self.shaft.unbalance, self.shaft.bearings, s.planes.z)

    @property
    def corrections(self) -> list[CorrectionMass]:
        """The masses of the correction planes; none where no plane was given."""
        fix = self.correction
        if fix is None:
            return []
        planes = self.planes
        mass, angle = np.abs(fix.unbalance) / planes.radius, degrees(fix.unbalance)
        numbers = (planes.z, planes.radius, np.abs(fix.unbalance), mass, angle)
        columns = (np.asarray(x, dtype=float).tolist() for x in numbers)
        return list(map(CorrectionMass, planes.name, *columns))

    @property
    def planes(self) -> Planes:
        """The shaft's correction planes."""
        assert self.request.shaft is not None
        assert self.request.shaft.planes is not None
        return self.request.shaft.planes

    @cached_property
    def corrected(self) -> Array:
        """The dynamic forces of the bearings once the corrections are made."""
        assert self.correction is not None
        return self.shaft.with_masses(self.correction.unbalance, np.asarray(self.planes.z))

    # -- bounds of rounding errors -------------------------------------------------------------------------

    @cached_property
    def body_error(self) -> BodyError:
        """Of mass, centre of mass and tensor."""
        return self.parts.whole.error_estimate()

    @cached_property
    def unbalance_error(self) -> Array:
        """Of the corrections' unbalances, (p,): their own rounding, and what that of the shaft's becomes in them."""
        from balancing import correct

        fix, shaft = self.correction, self.shaft
        assert fix is not None
        z = np.asarray(self.planes.z)
        # the planes' places are read too: as good as unbalances that are off by as much of the moment
        bound = shaft.error_estimate("unbalance", READ) + READ * np.abs(shaft.unbalance)
        share = correct(np.eye(2, dtype=complex), shaft.bearings, z).unbalance
        misplaced = READ * (np.abs(z).max() + np.abs(shaft.bearings).max()) / (np.ptp(z) or 1.0)
        several = len(z) > 1
        own = fix.error_estimate() + bound @ np.abs(share)
        return np.asarray(own + misplaced * np.abs(fix.unbalance).sum() * several)

    @cached_property
    def corrected_error(self) -> Array:
        """Of the bearings' forces once corrected, (2,): a difference of nearly equal forces."""
        s, fix, shaft = self.request.shaft, self.correction, self.shaft
        assert s is not None
        assert fix is not None
        z, bearings = np.asarray(self.planes.z), shaft.bearings
        arm = np.abs(z - bearings[::-1, None]) / abs(bearings[1] - bearings[0])
        rounded = self.unbalance_error + 4 * READ * np.abs(fix.unbalance)
        own = shaft.error_estimate("unbalance", READ) + 4 * READ * np.abs(shaft.unbalance)
        return np.asarray(np.hypot(s.speed**2, s.speed_rate) * (own + arm @ rounded))

    @cached_property
    def correction_errors(self) -> list[CorrectionMass]:
        """Of the masses of the correction planes."""
        assert self.correction is not None
        bound, amount = self.unbalance_error, np.abs(self.correction.unbalance)
        mass = (bound + READ * amount) / self.planes.radius
        angle = np.degrees(np.divide(bound, amount, out=np.zeros_like(bound), where=amount > 0))
        return [
            CorrectionMass(name, 0.0, 0.0, *row)
            for name, *row in zip(
                self.planes.name, bound.tolist(), mass.tolist(), angle.tolist(), strict=True
            )
        ]
