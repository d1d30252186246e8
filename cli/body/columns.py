"""The digits that hold of a body's answers: bounds of the rounding errors of all that `dalembert body` shows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cli.read.parts import READ

if TYPE_CHECKING:
    from cli.body.solve import Answer
    from cli.show.output import Columns

Real = NDArray[np.float64]

_MOTION = {
    "momentum_kg_m2_s": "momentum",
    "momentum_about_kg_m2_s": "momentum_about",
    "momentum_rate_N_m": "rate",
    "rate_relative_N_m": "relative",
    "rate_transport_N_m": "transport",
    "momentum_rate_about_N_m": "rate_about",
    "inertia_force_N": "inertia_force",
    "inertia_moment_N_m": "inertia_moment",
    "energy_J": "energy",
}


def errors(answer: Answer) -> Columns:
    """Return bounds in the columns of the CSV, and in those of the terminal's table."""
    bounds, corrections = _vectors(answer), _corrections(answer)
    columns: dict[str, list[float]] = {}
    below = [0.0] * len(next(iter(corrections.values()), []))
    for name, bound in bounds.items():
        columns[name] = [*([float(bound), 0.0, 0.0] if np.ndim(bound) == 0 else bound), *below]
    for name, bound in corrections.items():
        columns[f"correction_{name}"] = [0.0, 0.0, 0.0, *bound]
    # the table: a row for each quantity, then mass and angle of each correction
    rows = [[float(b), 0.0, 0.0, 0.0] if np.ndim(b) == 0 else [0.0, *b] for b in bounds.values()]
    for pair in zip(*(corrections.get(name, ()) for name in ("mass_kg", "angle_deg")), strict=True):
        rows += [[value, 0.0, 0.0, 0.0] for value in pair]
    return {**columns, **dict(zip(("value", "x", "y", "z"), map(list, zip(*rows, strict=True)), strict=True))}


def _vectors(answer: Answer) -> dict[str, Any]:
    """Return bounds under the names, and in the order, of what is shown."""
    body = answer.parts.whole
    error, moments = body.error_estimate(), body.principal
    principal = moments.error_estimate(error.inertia)
    bounds: dict[str, Any] = {"mass_kg": float(error.mass), "center_m": error.center}
    bounds |= {f"inertia_{axis}_kg_m2": row for axis, row in zip("xyz", error.inertia, strict=True)}
    bounds["principal_kg_m2"] = principal.moments
    bounds |= {f"principal_axis_{i + 1}": row for i, row in enumerate(principal.axes)}
    if answer.moving:
        for name, quantity in _MOTION.items():
            bounds[name] = answer.motion.error_estimate(quantity, answer.point, error, READ)
    if answer.wanted.shaft is not None:
        shaft = answer.shaft
        static, dynamic, axial, torque = (
            shaft.error_estimate(name, READ) for name in ("static", "dynamic", "axial", "drive_torque")
        )
        for i in range(2):
            bounds[f"bearing{i + 1}_static_N"] = [*static[i], float(axial) if i == 0 else 0.0]
            bounds[f"bearing{i + 1}_dynamic_N"] = [*dynamic[i], 0.0]
            if answer.correction is not None:
                left = float(_corrected(answer)[i])
                bounds[f"bearing{i + 1}_corrected_N"] = [left, left, 0.0]
        bounds["drive_torque_N_m"] = float(torque)
    return bounds


def _unbalance(answer: Answer) -> Real:
    """Bound the corrections' unbalances, (p,): their own rounding, and what that of the shaft's becomes in them."""
    from balancing import correct

    s, fix = answer.wanted.shaft, answer.correction
    assert s is not None
    assert s.planes is not None
    assert s.planes.z is not None
    assert fix is not None
    given = answer.shaft.error_estimate("unbalance", READ)
    # the planes' places are read too: as good as unbalances that are off by as much of the moment
    given = given + READ * np.abs(answer.shaft.unbalance)
    share = correct(np.eye(2, dtype=complex), answer.shaft.bearings, s.planes.z).unbalance
    z = np.asarray(s.planes.z)
    spread = np.ptp(z) or 1.0
    misplaced = READ * (np.abs(z).max() + np.abs(answer.shaft.bearings).max()) / spread
    return np.asarray(
        fix.error_estimate() + given @ np.abs(share) + misplaced * np.abs(fix.unbalance).sum() * (len(z) > 1)
    )


def _corrected(answer: Answer) -> Real:
    """Bound the bearings' forces once corrected, (2,): a difference of nearly equal forces."""
    s, fix = answer.wanted.shaft, answer.correction
    assert s is not None
    assert s.planes is not None
    assert fix is not None
    z, bearings = np.asarray(s.planes.z), answer.shaft.bearings
    arm = np.abs(z - bearings[::-1, None]) / abs(bearings[1] - bearings[0])
    rounded = _unbalance(answer) + 4 * READ * np.abs(fix.unbalance)
    size = np.hypot(s.speed**2, s.speed_rate)
    own = answer.shaft.error_estimate("unbalance", READ) + 4 * READ * np.abs(answer.shaft.unbalance)
    return np.asarray(size * (own + arm @ rounded))


def _corrections(answer: Answer) -> dict[str, list[float]]:
    s, fix = answer.wanted.shaft, answer.correction
    if s is None or s.planes is None or fix is None:
        return {}
    bound, amount, radius = _unbalance(answer), np.abs(fix.unbalance), np.asarray(s.planes.radius)
    angle = np.divide(bound, amount, out=np.zeros_like(bound), where=amount > 0)
    return {
        "unbalance_kg_m": bound.tolist(),
        "mass_kg": ((bound + READ * amount) / radius).tolist(),
        "angle_deg": np.degrees(angle).tolist(),
    }
