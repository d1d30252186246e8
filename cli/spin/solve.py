"""The rotation of a body in time, and what is constant in its motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cli.errors import DataError
from cli.show.columns import finite
from cli.spin.read import Array, TurningBody
from rigidbody3d import FreeBody, FreeState, Top, TopState, Trajectory, integrate, principal
from rigidbody3d import cones as cones_of
from rigidbody3d import sleeping_threshold as threshold_of
from rigidbody3d import steady_precession as steady_of
from rigidbody3d.attitude import rotate
from rigidbody3d.integration import MOST

UNASKED = 20_000
"""Steps of an integration that nobody asked for by name: some seconds."""
EQUAL = 1e-12
"""Two principal moments as near as this, relatively, are those of a body of revolution."""


@dataclass(frozen=True)
class Rotation:
    """A body in time; each quantity is computed when it is first asked for."""

    given: TurningBody
    time: Array
    method: str | None
    integrator: str

    @cached_property
    def round_moments(self) -> Array | None:
        """(I1, I1, I3) of a top whose axis is body z; None if it is no symmetric top."""
        I = self.given.inertia
        size = np.abs(I).max()
        if I.ndim == 2:
            if np.abs(I - np.diag(np.diag(I))).max() > EQUAL * size:
                return None
            I = np.diag(I)
        if abs(I[0] - I[1]) > EQUAL * size:
            return None
        across = I[0] if I[0] == I[1] else (I[0] + I[1]) / 2
        return np.array([across, across, I[2]])

    @cached_property
    def exact(self) -> bool:
        """Whether a closed form is used."""
        g = self.given
        closed = g.torque is None and (g.mgl is None or self.round_moments is not None)
        if self.method == "exact" and not closed:
            why = "a torque" if g.torque is not None else "a top whose two moments across body z differ"
            raise DataError(f"{g.file}: there is no closed form for {why}: expected --method integrate")
        return closed and self.method != "integrate"

    @cached_property
    def states(self) -> FreeState | TopState | Trajectory:
        """The states at the times asked for."""
        return self.at(self.time)

    def at(self, time: Array) -> FreeState | TopState | Trajectory:
        """Return the states at other times."""
        g = self.given
        try:
            if self.exact:
                if g.mgl is None:
                    return FreeBody(g.inertia, g.omega, g.attitude).at(time)
                assert self.round_moments is not None
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
                most=MOST if self.method == "integrate" else UNASKED,
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
        g = self.given
        if g.torque is not None:
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
        g = self.given
        if g.torque is not None or g.mgl is not None:
            return None
        return finite(float(FreeBody(g.inertia, g.omega).period))

    def cones(self) -> dict[str, float | None] | None:
        """Return the cones of a free symmetric body."""
        g = self.given
        if g.torque is not None or g.mgl is not None:
            return None
        moments, axes = principal(g.inertia)
        low, middle, high = moments.tolist()
        oblate, prolate = middle - low <= EQUAL * high, high - middle <= EQUAL * high
        if oblate == prolate:  # a sphere, or three different moments
            return None
        pole = 2 if oblate else 0
        order = [(pole + 1) % 3, (pole + 2) % 3, pole]
        found = cones_of(moments[order[0]], moments[pole], (axes @ g.omega)[order])
        return {
            "space_half_angle_deg": float(np.degrees(found.space)),
            "body_half_angle_deg": float(np.degrees(found.body)),
            "precession_rad_s": float(found.precession),
            "spin_rad_s": float(found.spin),
        }

    def steady(self) -> dict[str, float | None] | None:
        """Return the rates of steady precession of a top at its tilt at time zero."""
        g = self.given
        if g.mgl is None or self.round_moments is None:
            return None
        across, _, along = self.round_moments
        w, x, y, z = g.attitude
        tilt = 2 * np.arctan2(np.hypot(x, y), np.hypot(w, z))
        rates = steady_of(across, along, g.mgl, tilt, g.omega[2])
        return {
            "slow_rad_s": finite(float(rates.slow)),
            "fast_rad_s": finite(float(rates.fast)),
            "sleeping_threshold_rad_s": finite(float(threshold_of(across, along, g.mgl))) if along else None,
        }

    @property
    def nutation_period(self) -> float | None:
        """The period of nutation of a top; None of any other body."""
        return finite(float(self.states.top.nutation_period)) if isinstance(self.states, TopState) else None

    @cached_property
    def bounds(self) -> dict[str, Array]:
        """Bounds of the rounding errors of the states, of an integration of its method too."""
        s, rounded = self.states, self.given.rounded
        tensor = np.zeros((3, 3)) if rounded is None else rounded()
        if isinstance(s, TopState):
            # two moments that differ by rounding were taken as one
            between = np.abs(np.diff(np.diag(_tensor(self.given.inertia))[:2]))[0] / 2
            tensor = np.diag(tensor) + [between, between, 0.0]
        return {of: s.error_estimate(of, tensor) for of in ("omega", "attitude", "momentum", "energy")}


def _tensor(inertia: Array) -> Array:
    return np.diag(inertia) if inertia.ndim == 1 else inertia
