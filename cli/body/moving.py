"""A body put together from parts, its motion, the shaft it may be; all of it once more in numbers of 32 digits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.planes import Planes
from dalembert.angles import degrees
from rigidbody3d import Body, Motion, Shaft
from rigidbody3d.parts import Parts
from rigidbody3d.shaft import shaft_axes

if TYPE_CHECKING:
    from balancing import Correction
    from dalembert.arithmetic.doubled_arrays import Vectors

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
    """The options of the motion, in SI."""

    omega: Vector | None = None
    alpha: Vector | None = None
    frame_omega: Vector | None = None
    about: Vector | None = None
    fixed: Vector | None = None
    velocity: Vector | None = None
    acceleration: Vector | None = None
    shaft: ShaftRequest | None = None


class CorrectionMass(NamedTuple):
    """The mass in a correction plane of a shaft; or the errors of its numbers."""

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
    doubled: bool = False
    """Whether its numbers are those of the second run, doubled ones, with the decimals as they were written."""

    @cached_property
    def second(self) -> MovingBody:
        """This body in 32 digits."""
        return replace(self, doubled=True)

    @property
    def body(self) -> Body:
        """The body of all parts."""
        return self.parts.whole.in_32_digits if self.doubled else self.parts.whole

    @cached_property
    def principal_errors(self) -> tuple[Array, Array]:
        """The errors of the principal moments (3,) and of the axes (3, 3)."""
        exact: Any = self.second.body.inertia
        return self.body.principal.error_estimate(exact)

    def _numbers(self, option: ArrayLike) -> Array:
        """Numbers of an option."""
        if not self.doubled:
            return np.asarray(option, dtype=float)
        from dalembert.tables.exact import array

        result: Any = array(option)
        return result  # type: ignore[no-any-return]

    def _rates(self, option: ArrayLike) -> Array:
        """Angular velocities and accelerations of an option."""
        if not self.doubled:
            return np.asarray(option, dtype=float)
        from dalembert.tables.exact import rates

        result: Any = rates(option)
        return result  # type: ignore[no-any-return]

    @cached_property
    def motion(self) -> Motion:
        """The motion of the body, its components along the axes drawn."""
        w, body, point = self.request, self.body, self.request.fixed
        omega, alpha = self._rates(w.omega or ORIGIN), self._rates(w.alpha or ORIGIN)
        if w.shaft is not None:
            omega, alpha = (
                self.shaft_axes[2] * self._rates(rate) for rate in (w.shaft.speed, w.shaft.speed_rate)
            )
            point = ORIGIN
        frame = None if w.frame_omega is None else self._rates(w.frame_omega)
        if point is None:
            linear = self._numbers(w.velocity or ORIGIN), self._numbers(w.acceleration or ORIGIN)
            return Motion(body.inertia, omega, alpha, frame, body.mass, body.center, *linear)
        return Motion.about_fixed_point(
            body.inertia,
            omega,
            alpha,
            mass=body.mass,
            center=body.center,
            point=self._numbers(point),
            frame_omega=frame,
        )

    @cached_property
    def point(self) -> Array:
        """The point of the quantities `…_about`, (3,): --about, else --fixed, else the origin."""
        return self._numbers(self.request.about or self.request.fixed or ORIGIN)

    @property
    def moving(self) -> bool:
        """Whether the options give a motion."""
        w = self.request
        return w.shaft is not None or any(
            x is not None for x in (w.omega, w.alpha, w.velocity, w.acceleration)
        )

    @cached_property
    def shaft_axes(self) -> Array:
        """Two axes across the shaft and its own, as rows; those drawn for a shaft along z."""
        s = self.request.shaft
        assert s is not None
        return np.eye(3) if s.axis is None else shaft_axes(self._numbers(s.axis))

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
        return body.turned(self.shaft_axes, ORIGIN)

    @cached_property
    def shaft(self) -> Shaft:
        """The shaft on its bearings, along its own axes."""
        s = self.request.shaft
        assert s is not None
        gravity = self.shaft_axes @ self._numbers(s.gravity) + 0.0
        speeds = self._rates(s.speed), self._rates(s.speed_rate)
        return Shaft(self.upright(self.body), self._numbers(s.bearings), *speeds, gravity)

    def drawn(self, across: Array, along: ArrayLike = 0.0) -> Array:
        """Return a vector of the shaft, its part across and that along, along the axes drawn, (3,)."""
        return np.stack([across[0], across[1], along]) @ self.shaft_axes + 0.0

    def static_force(self, bearing: int) -> Array:
        """The force of a bearing that carries the weight, along the axes drawn, (3,); the first holds the shaft along its axis."""
        return self.drawn(self.shaft.static[bearing], self.shaft.axial if bearing == 0 else 0.0)

    @cached_property
    def correction(self) -> Correction | None:
        """The corrections of the shaft's unbalance."""
        s = self.request.shaft
        if s is None or s.planes is None:
            return None
        from balancing import correct

        return correct(self.shaft.unbalance, self.shaft.bearings, self.plane_places)

    @property
    def corrections(self) -> list[CorrectionMass]:
        """The masses of the correction planes; none without a plane."""
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

    @property
    def plane_places(self) -> Array:
        """Where the planes lie on the shaft, (p,), m."""
        places = self.planes.z
        assert places is not None
        return np.asarray(places)

    @cached_property
    def corrected(self) -> Array:
        """The dynamic forces of the bearings once the corrections are made, (2, 2)."""
        xy: Any
        if self.doubled:
            from dalembert.arithmetic.doubled_arrays import DoubledArray

            xy = np.stack(
                [DoubledArray.of(x) for x in (self.exact_correction.x, self.exact_correction.y)], axis=-1
            )
        else:
            assert self.correction is not None
            made = self.correction.unbalance
            xy = np.stack([made.real, made.imag], axis=-1)
        return self.shaft.with_masses_xy(xy, self._numbers(self.plane_places))

    @cached_property
    def exact_correction(self) -> Vectors:
        """The corrections to 32 digits, (p,)."""
        from balancing.second_run import ExactMasses
        from dalembert.arithmetic.doubled_arrays import Vectors
        from dalembert.tables.exact import writtens

        shaft: Any = self.second.shaft
        x, y = (shaft.unbalance_xy[..., i].doubled for i in range(2))
        return ExactMasses(Vectors(x, y), shaft.bearings.doubled, writtens(self.plane_places)).corrections

    @cached_property
    def correction_errors(self) -> list[CorrectionMass]:
        """The errors of the masses of the correction planes."""
        from dalembert.arithmetic.doubled_operations import off
        from dalembert.tables.exact import writtens

        fix, exact = self.correction, self.exact_correction
        assert fix is not None
        size = np.abs(fix.unbalance)
        errors = (
            off(size, exact.size),
            off(size / self.planes.radius, exact.size / writtens(self.planes.radius)),
            exact.turned(fix.unbalance),
        )
        rows = zip(self.planes.name, *(error.tolist() for error in errors), strict=True)
        return [CorrectionMass(name, 0.0, 0.0, *row) for name, *row in rows]
