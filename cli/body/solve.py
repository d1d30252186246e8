"""What `dalembert body` does: parts in, mass properties, momentum, wrench and shaft out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cli.read.parts import Parts, read_parts
from cli.read.planes import Planes
from cli.read.units import degrees
from cli.show.output import Columns, Shown
from rigidbody3d import Motion, Shaft

if TYPE_CHECKING:
    from balancing import Correction

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
G0 = 9.80665
ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class ShaftWanted:
    """A shaft turning about z."""

    bearings: tuple[float, float]
    speed: float
    speed_rate: float
    gravity: Vector
    planes: Planes | None


@dataclass(frozen=True)
class Wanted:
    """What was asked for, in SI."""

    omega: Vector | None = None
    alpha: Vector | None = None
    frame_omega: Vector | None = None
    about: Vector | None = None
    fixed: Vector | None = None
    velocity: Vector | None = None
    acceleration: Vector | None = None
    shaft: ShaftWanted | None = None


def solve(path: str, wanted: Wanted) -> Shown:
    """Read the parts and work out what was asked for."""
    answer = Answer(read_parts(path), wanted)
    return Shown(
        document=answer.document,
        columns=answer.columns(),
        keys=("axis",),
        table=answer.table,
        notes=answer.notes,
        figure=answer.figure,
        errors=answer.errors,
        warnings=[*answer.parts.warnings, *answer.warnings()],
    )


@dataclass(frozen=True)
class Answer:
    """A body and its motion; each quantity is computed when it is first asked for."""

    parts: Parts
    wanted: Wanted

    @cached_property
    def motion(self) -> Motion:
        """The motion of the body, its components along the axes drawn."""
        w, body = self.wanted, self.parts.whole
        if w.shaft is not None:
            spin, rate = (0.0, 0.0, w.shaft.speed), (0.0, 0.0, w.shaft.speed_rate)
            return Motion.about_fixed_point(body.inertia, spin, rate, mass=body.mass, center=body.center)
        omega, alpha = w.omega or ORIGIN, w.alpha or ORIGIN
        if w.fixed is not None:
            return Motion.about_fixed_point(
                body.inertia,
                omega,
                alpha,
                mass=body.mass,
                center=body.center,
                point=w.fixed,
                frame_omega=w.frame_omega,
            )
        return Motion(
            body.inertia,
            omega,
            alpha,
            w.frame_omega,
            body.mass,
            body.center,
            w.velocity or ORIGIN,
            w.acceleration or ORIGIN,
        )

    @property
    def point(self) -> Vector:
        """The point that `…_about` speaks of: as given, else the fixed point, else the origin."""
        return self.wanted.about or self.wanted.fixed or ORIGIN

    @property
    def moving(self) -> bool:
        """Whether any motion was asked about."""
        w = self.wanted
        return w.shaft is not None or any(
            x is not None for x in (w.omega, w.alpha, w.velocity, w.acceleration)
        )

    @cached_property
    def shaft(self) -> Shaft:
        """The shaft on its bearings."""
        s = self.wanted.shaft
        assert s is not None
        return Shaft(self.parts.whole, s.bearings, s.speed, s.speed_rate, s.gravity)

    @cached_property
    def correction(self) -> Correction | None:
        """The corrections of the shaft's unbalance."""
        s = self.wanted.shaft
        if s is None or s.planes is None:
            return None
        from balancing import correct

        assert s.planes.z is not None
        return correct(self.shaft.unbalance, self.shaft.bearings, s.planes.z)

    @cached_property
    def corrected(self) -> Array:
        """The dynamic forces of the bearings once the corrections are made."""
        s, fix = self.wanted.shaft, self.correction
        assert s is not None
        assert s.planes is not None
        assert fix is not None
        return self.shaft.with_masses(fix.unbalance, np.asarray(s.planes.z))

    def warnings(self) -> list[str]:
        """Say where eq. 44 with a constant tensor would go wrong, and what is not balanced in one plane."""
        found = []
        motion = self.motion
        if motion.frame_omega is not None:
            size = np.abs(motion.momentum).max() * max(
                np.abs(motion.omega).max(), np.abs(motion.frame_omega).max()
            )
            if np.abs(motion.tensor_rate).max() > 1e-12 * size:
                wrong = motion.rate - motion.tensor_rate
                found.append(
                    "the inertia tensor is not constant in the axes of --frame-omega: the relative rate holds its change too; "
                    f"eq. 44 with a constant tensor would give {', '.join(f'{x:.6g}' for x in wrong)} N·m"
                )
        s = self.wanted.shaft
        if s is not None and s.planes is not None and len(s.planes.name) == 1:
            found.append("one correction plane balances the static unbalance only: the couple stays")
        return found

    # --- what is shown ---

    def document(self) -> dict[str, Any]:
        """Return the JSON document."""
        body, motion, moments = self.parts.whole, self.motion, self.parts.whole.principal
        document: dict[str, Any] = {
            "mass_kg": float(body.mass),
            "center_m": _list(body.center),
            "inertia_kg_m2": _list(body.inertia),
            "principal_kg_m2": _list(moments.moments),
            "principal_axes": _list(moments.axes),
            "momentum_kg_m2_s": _list(motion.momentum),
            "about_m": _list(self.point),
            "momentum_about_kg_m2_s": _list(motion.momentum_about(self.point)),
            "momentum_rate_N_m": _list(motion.rate),
            "momentum_rate_about_N_m": _list(motion.rate_about(self.point)),
            "rate_terms_N_m": {"relative": _list(motion.relative), "transport": _list(motion.transport)},
            "inertia_force_N": _list(motion.inertia_force),
            "inertia_moment_N_m": _list(motion.inertia_wrench.moment),
            "energy_J": float(motion.energy),
            "products": "+∫xy dm; the matrix carries -I_xy",
        }
        if self.wanted.shaft is not None:
            document["shaft"] = self._shaft_document(self.wanted.shaft)
        return document

    def _shaft_document(self, s: ShaftWanted) -> dict[str, Any]:
        shaft = self.shaft
        bearings: list[dict[str, Any]] = [
            {"z_m": z, "static_N": _list(static), "dynamic_N": _list(dynamic)}
            for z, static, dynamic in zip(s.bearings, shaft.static, shaft.dynamic, strict=True)
        ]
        corrections = []
        if self.correction is not None and s.planes is not None:
            for bearing, left in zip(bearings, self.corrected, strict=True):
                bearing["corrected_dynamic_N"] = _list(left)
            for row in self._corrections():
                corrections.append(row)
        return {
            "bearings": bearings,
            "axial_N": float(shaft.axial),
            "drive_torque_N_m": float(shaft.drive_torque),
            "static_unbalance_kg_m": float(np.abs(shaft.static_unbalance)),
            "static_angle_deg": float(degrees(shaft.static_unbalance)),
            "corrections": corrections,
        }

    def _corrections(self) -> list[dict[str, Any]]:
        s, fix = self.wanted.shaft, self.correction
        if s is None or s.planes is None or fix is None:
            return []
        mass = np.abs(fix.unbalance) / s.planes.radius
        return [
            {
                "plane": name,
                "z_m": float(z),
                "radius_m": float(radius),
                "unbalance_kg_m": float(abs(u)),
                "mass_kg": float(m),
                "weight_N": float(m * G0),
                "angle_deg": float(degrees(u)),
            }
            for name, z, radius, u, m in zip(
                s.planes.name, np.asarray(s.planes.z), s.planes.radius, fix.unbalance, mass, strict=True
            )
        ]

    def _vectors(self) -> dict[str, Any]:
        """Quantity with its unit -> a scalar or three components, in the order they are shown in."""
        body, motion, moments = self.parts.whole, self.motion, self.parts.whole.principal
        rows: dict[str, Any] = {"mass_kg": float(body.mass), "center_m": body.center}
        rows |= {f"inertia_{axis}_kg_m2": row for axis, row in zip("xyz", body.inertia, strict=True)}
        rows["principal_kg_m2"] = moments.moments
        rows |= {f"principal_axis_{i + 1}": row for i, row in enumerate(moments.axes)}
        if self.moving:
            rows |= {
                "momentum_kg_m2_s": motion.momentum,
                "momentum_about_kg_m2_s": motion.momentum_about(self.point),
                "momentum_rate_N_m": motion.rate,
                "rate_relative_N_m": motion.relative,
                "rate_transport_N_m": motion.transport,
                "momentum_rate_about_N_m": motion.rate_about(self.point),
                "inertia_force_N": motion.inertia_force,
                "inertia_moment_N_m": motion.inertia_wrench.moment,
                "energy_J": float(motion.energy),
            }
        if self.wanted.shaft is not None:
            shaft = self.shaft
            for i in range(2):
                axial = float(shaft.axial) if i == 0 else 0.0
                rows[f"bearing{i + 1}_static_N"] = [*shaft.static[i], axial]
                rows[f"bearing{i + 1}_dynamic_N"] = [*shaft.dynamic[i], 0.0]
                if self.correction is not None:
                    rows[f"bearing{i + 1}_corrected_N"] = [*self.corrected[i], 0.0]
            rows["drive_torque_N_m"] = float(shaft.drive_torque)
        return {
            name: x + 0.0 if isinstance(x, float) else [float(v) + 0.0 for v in x] for name, x in rows.items()
        }

    def columns(self) -> Columns:
        """Return the CSV: a row for each axis, then one for each correction plane; scalars stand in the first row."""
        corrections = self._corrections()
        blank = [None] * len(corrections)
        columns: dict[str, list[Any]] = {"axis": [*"xyz", *(row["plane"] for row in corrections)]}
        for name, value in self._vectors().items():
            columns[name] = [*([value, None, None] if isinstance(value, float) else value), *blank]
        for name in ("z_m", "radius_m", "unbalance_kg_m", "mass_kg", "angle_deg") if corrections else ():
            key = f"correction_{name}"
            columns[key] = [None, None, None, *(row[name] for row in corrections)]
        return columns

    def table(self) -> Columns:
        """Return the terminal's table: a row for each quantity."""
        rows: dict[str, list[Any]] = {"quantity": [], "value": [], "x": [], "y": [], "z": []}
        for name, value in self._vectors().items():
            scalar = isinstance(value, float)
            cells = [value, None, None, None] if scalar else [None, *value]
            for column, cell in zip(rows, [name, *cells], strict=True):
                rows[column].append(cell)
        for row in self._corrections():
            for name in ("mass_kg", "angle_deg"):
                for column, cell in zip(
                    rows, [f"plane {row['plane']}: {name}", row[name], None, None, None], strict=True
                ):
                    rows[column].append(cell)
        return rows

    def errors(self) -> Columns:
        """Return bounds of the rounding errors of what is shown."""
        from cli.body.columns import errors

        return errors(self)

    def notes(self) -> str:
        """Say which conventions hold."""
        lines = [
            f"{len(self.parts.name)} parts; inertia at the centre of mass, products as +∫xy dm (the matrix carries -I_xy)"
        ]
        if self.moving:
            lines.append(
                f"momentum at the centre of mass, and about {', '.join(f'{x:g}' for x in self.point)} m; rates are true ones"
            )
        if self.wanted.shaft is not None:
            lines.append("bearing forces act on the shaft; dynamic ones leave the static part out")
        return "\n".join(lines)

    def figure(self) -> Any:
        """Draw the parts, the principal axes and the vectors of the motion."""
        from cli.body.picture import draw

        return draw(self)


def _list(x: Any) -> Any:
    return (np.asarray(x, dtype=float) + 0.0).tolist()
