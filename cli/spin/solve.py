"""What `dalembert spin` does: a body from TOML, its states in time, what is constant in its motion."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cli.errors import DataError, nearest
from cli.read.units import LARGEST
from cli.show.output import Columns, Shown
from rigidbody3d import Body, FreeBody, FreeState, Top, TopState, Trajectory, check, integrate, principal
from rigidbody3d import cones as cones_of
from rigidbody3d import sleeping_threshold as threshold_of
from rigidbody3d import steady_precession as steady_of
from rigidbody3d.attitude import normalize, rotate
from rigidbody3d.spin import MOST

Array = NDArray[np.float64]

KEYS = ("name", "inertia", "parts", "omega", "attitude", "top", "torque", "frame")
UNASKED = 20_000
"""Steps of an integration that nobody asked for by name: some seconds."""
EQUAL = 1e-12
"""Two principal moments as near as this, relatively, are those of a body of revolution."""


@dataclass(frozen=True)
class Given:
    """The body as described."""

    file: str
    name: str
    inertia: Array
    omega: Array
    attitude: Array
    mgl: float | None
    torque: Array | None
    frame: str
    warnings: list[str]
    rounded: Callable[[], Array] | None = None
    """Bounds of the errors of the tensor of a body made of parts, (3, 3)."""


def read_body(path: str) -> Given:
    """Read BODY.toml."""
    file = "standard input" if path == "-" else path
    try:
        data = sys.stdin.buffer.read() if path == "-" else Path(path).read_bytes()
        document = tomllib.loads(data.decode("utf-8-sig"))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise DataError(f"{file}: {reason}") from None
    except RecursionError:
        raise DataError(f"{file}: no valid TOML: nested too deeply") from None
    for key in document:
        if key not in KEYS:
            raise DataError(f"{file}: unknown key '{key}': expected {', '.join(KEYS)}{nearest(key, KEYS)}")
    top = document.get("top")
    mgl = None
    if top is not None:
        if not isinstance(top, dict) or set(top) != {"mgl"}:
            raise DataError(f"{file}: [top] holds mgl = weight times distance, N·m, and nothing else")
        mgl = float(_numbers(file, "top.mgl", top["mgl"], ()))
    warnings: list[str] = []
    rounded: Callable[[], Array] | None = None
    if ("inertia" in document) == ("parts" in document):
        raise DataError(f'{file}: expected inertia = [I1, I2, I3] (or a matrix) or parts = "parts.csv"')
    if "parts" in document:
        from cli.read.parts import read_parts

        if not isinstance(document["parts"], str):
            raise DataError(f"{file}: parts: found {document['parts']!r}, expected the name of a CSV file")
        folder = Path() if path == "-" else Path(path).parent
        parts = read_parts(str(folder / document["parts"]))
        warnings += parts.warnings
        about = None if mgl is None else [0.0, 0.0, 0.0]
        inertia = parts.whole.inertia if about is None else parts.whole.about(about)
        rounded = partial(_tensor_error, parts.whole, about)
    else:
        inertia = _numbers(file, "inertia", document["inertia"], (3,), (3, 3))
    try:
        verdict = check(inertia)
    except ValueError as error:
        raise DataError(f"{file}: inertia: {error}") from None
    if not verdict.valid:
        raise DataError(f"{file}: inertia: no body has it: {verdict.reason}")
    if not verdict.moments[1] > 0:
        raise DataError(
            f"{file}: inertia: found no moment of inertia: expected at least two that are positive"
        )
    if "omega" not in document:
        raise DataError(f"{file}: no omega: expected the angular velocity in body axes, rad/s")
    torque = document.get("torque")
    frame = document.get("frame", "body")
    if frame not in ("body", "space"):
        raise DataError(f'{file}: frame: found {frame!r}, expected "body" or "space"')
    attitude = _numbers(file, "attitude", document.get("attitude", [1, 0, 0, 0]), (4,))
    try:
        attitude = normalize(attitude)
    except ValueError as error:
        raise DataError(f"{file}: attitude: {error}") from None
    return Given(
        file,
        str(document.get("name", "")),
        inertia,
        _numbers(file, "omega", document["omega"], (3,)),
        attitude,
        mgl,
        None if torque is None else _numbers(file, "torque", torque, (3,)),
        frame,
        warnings,
        rounded,
    )


def _tensor_error(body: Body, about: list[float] | None) -> Array:
    return body.error_estimate(about).inertia


def _numbers(file: str, key: str, value: Any, *shapes: tuple[int, ...]) -> Array:
    wanted = " or ".join("×".join(map(str, shape)) if shape else "one" for shape in shapes)

    def plain(x: Any) -> bool:
        return (
            all(map(plain, x))
            if isinstance(x, list)
            else isinstance(x, (int, float)) and not isinstance(x, bool)
        )

    try:
        array = np.array(value, dtype=float) if plain(value) else np.array([np.nan])
    except (ValueError, OverflowError):
        array = np.array([np.nan])
    if array.shape not in shapes or not (np.abs(array) <= LARGEST).all():
        raise DataError(
            f"{file}: {key}: found {value!r}, expected {wanted} finite number{'s' * (wanted != 'one')}"
        )
    return array


def solve(path: str, times: list[float], method: str | None, integrator: str) -> Shown:
    """Read the body and work out its states."""
    answer = Answer(read_body(path), np.array(times), method, integrator)
    answer.states  # noqa: B018  faults of the data are found before anything is shown
    return Shown(
        document=answer.document,
        columns=answer.columns(),
        notes=answer.notes,
        figure=answer.figure,
        errors=answer.errors,
        warnings=[*answer.given.warnings, *answer.warnings()],
    )


@dataclass(frozen=True)
class Answer:
    """A body in time; each quantity is computed when it is first asked for."""

    given: Given
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
        return _finite(FreeBody(g.inertia, g.omega).period)

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
            "slow_rad_s": _finite(rates.slow),
            "fast_rad_s": _finite(rates.fast),
            "sleeping_threshold_rad_s": _finite(threshold_of(across, along, g.mgl)) if along else None,
        }

    def warnings(self) -> list[str]:
        """Say what was done otherwise than a reader might think."""
        found = []
        if self.given.mgl is not None and self.round_moments is None:
            found.append("a top whose moments across body z differ has no closed form: it was integrated")
        steady = self.steady()
        if steady is not None and steady["slow_rad_s"] is None:
            found.append("the spin is too slow for steady precession at this tilt")
        return found

    # --- what is shown ---

    def document(self) -> dict[str, Any]:
        """Return the JSON document."""
        s = self.states
        rows = zip(
            self.time.tolist(),
            (s.omega + 0.0).tolist(),
            (s.attitude + 0.0).tolist(),
            (s.momentum + 0.0).tolist(),
            s.energy.tolist(),
            strict=True,
        )
        names = ("t_s", "omega_rad_s", "attitude", "momentum_kg_m2_s", "energy_J")
        return {
            "states": [dict(zip(names, row, strict=True)) for row in rows],
            "method": "exact" if self.exact else self.integrator,
            "drift": self.drift,
            "period_s": self.period,
            "nutation_period_s": self._nutation_period(),
            "cones": self.cones(),
            "steady": self.steady(),
        }

    def _nutation_period(self) -> float | None:
        return _finite(self.states.top.nutation_period) if isinstance(self.states, TopState) else None

    def columns(self) -> Columns:
        """Return the CSV: a row for each time."""
        s = self.states
        columns: dict[str, Any] = {"t_s": self.time}
        columns |= {f"omega_{a}_rad_s": s.omega[:, i] for i, a in enumerate("xyz")}
        columns |= {f"attitude_{a}": s.attitude[:, i] for i, a in enumerate("wxyz")}
        columns |= {f"momentum_{a}_kg_m2_s": s.momentum[:, i] for i, a in enumerate("xyz")}
        columns["energy_J"] = s.energy
        plain: dict[str, Any] = {name: np.asarray(column) + 0.0 for name, column in columns.items()}
        return plain

    def errors(self) -> Columns:
        """Return bounds of the rounding errors, of an integration of its method too, in the columns of the CSV."""
        s, rounded = self.states, self.given.rounded
        tensor = np.zeros((3, 3)) if rounded is None else rounded()
        if isinstance(s, TopState):
            # two moments that differ by rounding were taken as one
            between = np.abs(np.diff(np.diag(_tensor(self.given.inertia))[:2]))[0] / 2
            off = np.diag(tensor) + [between, between, 0.0]
            found = {of: s.error_estimate(of, off) for of in ("omega", "attitude", "momentum", "energy")}
        else:
            found = {of: s.error_estimate(of, tensor) for of in ("omega", "attitude", "momentum", "energy")}
        columns: dict[str, Any] = {f"omega_{a}_rad_s": found["omega"][:, i] for i, a in enumerate("xyz")}
        # a turn by an angle moves a quaternion by half of it
        columns |= {f"attitude_{a}": found["attitude"] / 2 for a in "wxyz"}
        columns |= {f"momentum_{a}_kg_m2_s": found["momentum"][:, i] for i, a in enumerate("xyz")}
        columns["energy_J"] = found["energy"]
        return columns

    def notes(self) -> str:
        """Say what is constant in the motion."""
        lines = [
            "omega in body axes, momentum in space axes, attitude [w, x, y, z] from body to space; "
            + ("closed form" if self.exact else f"integrated by {self.integrator}")
        ]
        drift = self.drift
        if drift["momentum"] is not None:
            lines.append(f"drift: momentum {drift['momentum']:.2g}, energy {drift['energy']:.2g} (relative)")
        if self.period is not None:
            lines.append(f"period of omega in body axes: {self.period:.6g} s")
        nutation = self._nutation_period()
        if nutation is not None:
            lines.append(f"period of nutation: {nutation:.6g} s")
        for found in (self.cones(), self.steady()):
            if found is not None:
                lines.append(
                    ", ".join(f"{name}: {'none' if x is None else f'{x:.6g}'}" for name, x in found.items())
                )
        return "\n".join(lines)

    def figure(self) -> Any:
        """Draw ω(t), the polhode and the trace of the body's axis."""
        from cli.spin.picture import draw

        return draw(self)


def _tensor(inertia: Array) -> Array:
    return np.diag(inertia) if inertia.ndim == 1 else inertia


def _finite(x: Any) -> float | None:
    value = float(x)
    return value if np.isfinite(value) else None
