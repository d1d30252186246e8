"""The rotation of a body in time, and what is constant in its motion: in closed form or integrated, with its errors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.errors import DataError
from dalembert.results.columns import finite
from rigidbody3d.attitude import rotate
from rigidbody3d.freebody import FreeBody, FreeState
from rigidbody3d.gyroscope import cones as cones_of
from rigidbody3d.gyroscope import sleeping_threshold as threshold_of
from rigidbody3d.gyroscope import steady_precession as steady_of
from rigidbody3d.inertia import principal
from rigidbody3d.integration import MOST, Trajectory, integrate
from rigidbody3d.top import Top, TopState
from rigidbody3d.turning_body import TurningBody

Array = NDArray[np.float64]

DEFAULT_STEPS = 20_000
"""Steps of an integration without --method integrate: some seconds."""
EQUAL = 1e-12
"""Two principal moments as near as this, relatively, are those of a body of revolution."""


@dataclass(frozen=True)
class Rotation:
    """A body in time; each quantity is computed on the first request.

    Parameters
    ----------
    body : TurningBody
        The body and its state at time zero, by `read_body`.
    time : array (n,)
        s.
    method : "exact", "integrate" or None
        The closed form, or integration; None is the closed form where there is one.
    integrator : "DOP853" or "splitting"

    Raises
    ------
    DataError
        There is no closed form, or the integration takes too many steps.

    Examples
    --------
    A body that turns about a principal axis goes on doing so:

    >>> state = [0.0, 0.0, 2.0], [1.0, 0.0, 0.0, 0.0]
    >>> body = TurningBody("", "", np.array([1.0, 2.0, 3.0]), *map(np.array, state), None, None, "body", [], {})
    >>> turning = Rotation(body, np.array([0.0, 1.0]), None, "DOP853")
    >>> turning.exact, turning.states.omega
    (True, array([[0., 0., 2.],
           [0., 0., 2.]]))
    """

    body: TurningBody
    time: Array
    method: str | None
    integrator: str

    @cached_property
    def round_moments(self) -> Array | None:
        """(I1, I1, I3) of a top whose axis is body z; None if it is no symmetric top."""
        I = self.body.inertia
        size = np.abs(I).max()
        if I.ndim == 2:
            if np.abs(I - np.diag(np.diag(I))).max() > EQUAL * size:
                return None
            I = np.diag(I)
        return None if abs(I[0] - I[1]) > EQUAL * size else _round(I)

    @cached_property
    def exact(self) -> bool:
        """Whether a closed form is used."""
        g = self.body
        closed = not g.forced and (not g.mgl or self.round_moments is not None)
        if self.method == "exact" and not closed:
            why = "a torque" if g.forced else "a top whose two moments across body z differ"
            raise DataError(f"{g.file}: there is no closed form for {why}: expected --method integrate")
        return closed and self.method != "integrate"

    @cached_property
    def states(self) -> FreeState | TopState | Trajectory:
        """The states at the times of the request."""
        return self.at(self.time)

    def at(self, time: Array) -> FreeState | TopState | Trajectory:
        """Return the states at other times."""
        g = self.body
        try:
            if self.exact:
                if g.mgl is None or self.round_moments is None:
                    return FreeBody(g.inertia, g.omega, g.attitude).at(time)
                return Top(self.round_moments, g.mgl, g.omega, g.attitude).at(time)
            return integrate(
                g.inertia,
                g.omega,
                g.attitude,
                time,
                torque=g.torque,
                frame=g.frame,
                mgl=g.mgl or 0.0,
                method=self.integrator,
                most=MOST if self.method == "integrate" else DEFAULT_STEPS,
            )
        except (ValueError, RuntimeError) as error:
            wait = (
                ", or --method integrate to wait for it"
                if self.method is None and "steps" in str(error)
                else ""
            )
            raise DataError(f"{g.file}: {error}{wait}") from None

    @cached_property
    def drift(self) -> dict[str, float | None]:
        """How far momentum and energy stray from those at time zero, relatively; None where they are not constant."""
        g = self.body
        if g.forced:
            return {"momentum": None, "energy": None}
        tensor = _tensor(g.inertia)
        H = rotate(g.attitude, tensor @ g.omega)
        w, x, y, z = g.attitude
        E = g.omega @ tensor @ g.omega / 2 + (g.mgl or 0.0) * (w * w + z * z - x * x - y * y)
        stray = self.states.momentum - H
        if g.mgl is not None:  # about the vertical only
            stray = stray[:, 2:]
        size = float(np.linalg.norm(H))
        scale = max(abs(float(E)), abs(g.mgl or 0.0))
        energy = float(np.abs(self.states.energy - E).max())
        momentum = float(np.linalg.norm(stray, axis=-1).max())
        return {
            "momentum": momentum / size if size else momentum,
            "energy": energy / scale if scale else energy,
        }

    @cached_property
    def period(self) -> float | None:
        """The period of ω in body axes; None where it is constant, or not periodic."""
        if not self._free or self._like(0, 2):
            return None
        return finite(float(_period(self.body)))

    def cones(self) -> dict[str, float | None] | None:
        """Return the cones of a free symmetric body."""
        if self._pole is None:
            return None
        return {name: float(value) for name, value in _cones(self.body, self._pole).items()}

    def steady(self) -> dict[str, float | None] | None:
        """Return the rates of steady precession of a top at its tilt at time zero."""
        if self.body.mgl is None or self.round_moments is None:
            return None
        rates = _steady(self.body, self.round_moments)
        if not self.round_moments[2]:
            return {name: finite(float(rates[name])) for name in ("slow_rad_s", "fast_rad_s")} | {
                "sleeping_threshold_rad_s": None
            }
        return {name: finite(float(value)) for name, value in rates.items()}

    @property
    def nutation_period(self) -> float | None:
        """The period of nutation of a top; None of any other body."""
        return finite(float(self.states.top.nutation_period)) if isinstance(self.states, TopState) else None

    @property
    def _free(self) -> bool:
        return not self.body.forced and self.body.mgl is None

    @cached_property
    def _pole(self) -> int | None:
        """Which principal axis is that of a free body of revolution; None of a sphere, or of three different moments."""
        oblate, prolate = self._like(0, 1), self._like(1, 2)
        return None if not self._free or oblate == prolate else 2 if oblate else 0

    def _like(self, one: int, other: int) -> bool:
        """Whether two principal moments are equal to rounding."""
        moments = self._moments
        return bool(moments[other] - moments[one] <= EQUAL * moments[2])

    @cached_property
    def _moments(self) -> Array:
        """The principal moments, ascending."""
        return principal(self.body.inertia).moments

    def constant_error(self, name: str, value: float) -> Array:
        """The error of a period, or of a number of cones or of steady precession, by computing twice."""
        exact: Any = self._exact_constants[name]
        off: Array = exact.off(value)
        return np.atleast_1d(np.where(np.isnan(off), np.inf, off))

    @cached_property
    def _exact_constants(self) -> dict[str, Any]:
        body: Any = self.body.exact()
        if self._free:
            cones = {} if self._pole is None else _cones(body, self._pole)
            return {"period": _period(body), **cones}
        moments = body.inertia if body.inertia.ndim == 1 else np.diagonal(body.inertia)
        nutation = self._exact[0].top.nutation_period if isinstance(self.states, TopState) else None
        return {"nutation_period": nutation, **_steady(body, _round(moments))}

    def errors(self, of: str) -> Array:
        """The errors of a quantity of the states by computing twice, of an integration of its method too."""
        s, exact = self.states, self._exact
        if isinstance(s, Trajectory):
            return s.error_estimate(of, exact)
        errors = s.error_estimate(of, exact[0])
        if len(exact) > 1:
            # two moments that differ by rounding were taken as one
            errors = 3 * errors + 2 * s.error_estimate(of, exact[1])
        return np.asarray(errors)

    @cached_property
    def _exact(self) -> Any:
        """The states in doubled numbers; of an integration the tensor alone."""
        body = self.body.exact()
        I: Any = body.inertia
        if isinstance(self.states, Trajectory):
            return I if I.ndim == 2 else I[:, None] * np.eye(3)
        from dalembert.tables.exact import array

        time: Any = array(self.time)
        if isinstance(self.states, FreeState):
            return [FreeBody(I, body.omega, body.attitude).at(time)]
        mgl: Any = body.mgl
        moments = I if I.ndim == 1 else np.diagonal(I)
        each = [_round(moments), *([moments[[0, 0, 2]]] if (moments[0] != moments[1]).any() else [])]
        return [Top(about, mgl, body.omega, body.attitude).at(time) for about in each]


def _period(g: TurningBody) -> Any:
    return FreeBody(g.inertia, g.omega).period


def _cones(g: TurningBody, pole: int) -> dict[str, Any]:
    """The cones of a free body of revolution, of floats or of doubled numbers."""
    moments, axes = principal(g.inertia)
    order = [(pole + 1) % 3, (pole + 2) % 3, pole]
    result = cones_of(moments[order[0]], moments[pole], (axes @ g.omega)[order])
    return {
        "space_half_angle_deg": np.degrees(result.space),
        "body_half_angle_deg": np.degrees(result.body),
        "precession_rad_s": result.precession,
        "spin_rad_s": result.spin,
    }


def _steady(g: TurningBody, moments: Array) -> dict[str, Any]:
    """The rates of steady precession of a top with moments (3,), of floats or of doubled numbers."""
    mgl: Any = g.mgl
    w, x, y, z = g.attitude
    tilt = 2 * np.arctan2(np.hypot(x, y), np.hypot(w, z))
    rates = steady_of(moments[0], moments[2], mgl, tilt, g.omega[2])
    threshold = threshold_of(moments[0], moments[2], mgl)
    return {"slow_rad_s": rates.slow, "fast_rad_s": rates.fast, "sleeping_threshold_rad_s": threshold}


def _round(I: Array) -> Array:
    """Moments (I1, I1, I3) of those of a top, (3,)."""
    return (I[[0, 1, 2]] + I[[1, 0, 2]]) / 2


def _tensor(inertia: Array) -> Array:
    return np.diag(inertia) if inertia.ndim == 1 else inertia
