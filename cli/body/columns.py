"""A body and its motion as columns, and as the JSON document."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cli.body.solve import Array, MovingBody
from cli.read.parts import READ
from cli.read.units import G0, degrees
from cli.show.columns import Column, Table
from rigidbody3d.inertia import Principal

if TYPE_CHECKING:
    from cli.show.columns import Document, Json


class Quantity(NamedTuple):
    """A scalar or a vector, with the bounds of its components' errors."""

    name: str
    unit: str
    value: ArrayLike
    error: Callable[[], ArrayLike]

    def column(self, laid: Callable[[list[float]], list[float | None]]) -> Column:
        """Return it as a column in which its numbers, and their bounds, are laid so."""

        def error() -> list[float]:
            return [bound or 0.0 for bound in laid(_numbers(self.error()))]

        return Column(self.name, self.unit, laid(_numbers(self.value)), error)


def _of_body(found: MovingBody) -> Iterator[Quantity]:
    body, moments = found.parts.whole, found.parts.whole.principal

    def tensor_error(row: int) -> Array:
        return np.asarray(found.body_error.inertia[row])

    def principal_error() -> Principal:
        return moments.error_estimate(found.body_error.inertia)

    def axis_error(axis: int) -> Array:
        return np.asarray(principal_error().axes[axis])

    yield Quantity("mass", "kg", body.mass, lambda: found.body_error.mass)
    yield Quantity("center", "m", body.center, lambda: found.body_error.center)
    for i, axis in enumerate("xyz"):
        yield Quantity(f"inertia_{axis}", "kg_m2", body.inertia[i], partial(tensor_error, i))
    yield Quantity("principal", "kg_m2", moments.moments, lambda: principal_error().moments)
    for i in range(3):
        yield Quantity(f"principal_axis_{i + 1}", "", moments.axes[i], partial(axis_error, i))


def _of_motion(found: MovingBody) -> Iterator[Quantity]:
    motion, point = found.motion, found.point

    def error(of: str) -> ArrayLike:
        return motion.error_estimate(of, point, found.body_error, READ)

    for name, unit, value, of in (
        ("momentum", "kg_m2_s", motion.momentum, "momentum"),
        ("momentum_about", "kg_m2_s", motion.momentum_about(point), "momentum_about"),
        ("momentum_rate", "N_m", motion.rate, "rate"),
        ("rate_relative", "N_m", motion.relative, "relative"),
        ("rate_transport", "N_m", motion.transport, "transport"),
        ("momentum_rate_about", "N_m", motion.rate_about(point), "rate_about"),
        ("inertia_force", "N", motion.inertia_force, "inertia_force"),
        ("inertia_moment", "N_m", motion.inertia_wrench.moment, "inertia_moment"),
        ("energy", "J", motion.energy, "energy"),
    ):
        yield Quantity(name, unit, value, partial(error, of))


def _of_shaft(found: MovingBody) -> Iterator[Quantity]:
    """Forces of the bearings across the axis; the first takes the axial force."""
    shaft = found.shaft

    def error(of: str, i: int) -> list[float]:
        axial = float(shaft.error_estimate("axial", READ)) if of == "static" and i == 0 else 0.0
        return [*shaft.error_estimate(of, READ)[i], axial]

    def left_error(i: int) -> list[float]:
        return [*found.corrected_error[[i, i]], 0.0]

    for i in range(2):
        static = [*shaft.static[i], float(shaft.axial) if i == 0 else 0.0]
        yield Quantity(f"bearing{i + 1}_static", "N", static, partial(error, "static", i))
        dynamic = [*shaft.dynamic[i], 0.0]
        yield Quantity(f"bearing{i + 1}_dynamic", "N", dynamic, partial(error, "dynamic", i))
        if found.correction is not None:
            left = [*found.corrected[i], 0.0]
            yield Quantity(f"bearing{i + 1}_corrected", "N", left, partial(left_error, i))
    yield Quantity(
        "drive_torque", "N_m", shaft.drive_torque, lambda: shaft.error_estimate("drive_torque", READ)
    )


def _quantities(found: MovingBody) -> list[Quantity]:
    """Return what is shown, in the order in which it is shown."""
    return [
        *_of_body(found),
        *(_of_motion(found) if found.moving else ()),
        *(_of_shaft(found) if found.request.shaft is not None else ()),
    ]


def axes(found: MovingBody) -> Table:
    """A row for each axis, then one for each correction plane; scalars stand in the first row."""
    corrections = found.corrections
    below = len(corrections)

    def in_rows(numbers: list[float]) -> list[float | None]:
        return [*numbers, *[None] * (3 - len(numbers) + below)]

    def of_correction(name: str) -> list[float]:
        return [0.0, 0.0, 0.0, *(getattr(bound, name) for bound in found.correction_errors)]

    columns = [Column("axis", "", [*"xyz", *(c.plane for c in corrections)])]
    columns += [quantity.column(in_rows) for quantity in _quantities(found)]
    units = {"z": "m", "radius": "m", "unbalance": "kg_m", "mass": "kg", "angle": "deg"}
    for name, unit in units.items() if corrections else ():
        values = [None, None, None, *(getattr(c, name) for c in corrections)]
        error = None if unit == "m" else partial(of_correction, name)
        columns.append(Column(f"correction_{name}", unit, values, error))
    return Table(columns, keys=("axis",))


def quantities(found: MovingBody) -> Table:
    """The terminal's table: a row for each quantity, then mass and angle of each correction."""

    def in_cells(numbers: list[float]) -> list[float | None]:
        return [*numbers, None, None, None] if len(numbers) == 1 else [None, *numbers]

    def of_correction(i: int, name: str) -> float:
        return float(getattr(found.correction_errors[i], name))

    given = _quantities(found)
    for i, c in enumerate(found.corrections):
        for name, unit in (("mass", "kg"), ("angle", "deg")):
            value, error = getattr(c, name), partial(of_correction, i, name)
            given.append(Quantity(f"plane {c.plane}: {name}", unit, value, error))
    rows = [quantity.column(in_cells) for quantity in given]

    def bounds(k: int) -> list[float]:
        return [in_cells(_numbers(quantity.error()))[k] or 0.0 for quantity in given]

    columns = [Column("quantity", "", [row.header for row in rows])]
    columns += [
        Column(name, "", [row.values[k] for row in rows], partial(bounds, k))
        for k, name in enumerate(("value", "x", "y", "z"))
    ]
    return Table(columns)


def document(found: MovingBody) -> Document:
    """The JSON document."""
    of = {quantity.name: _plain(quantity.value) for quantity in (*_of_body(found), *_of_motion(found))}
    document: Document = {
        "mass_kg": of["mass"],
        "center_m": of["center"],
        "inertia_kg_m2": [of[f"inertia_{axis}"] for axis in "xyz"],
        "principal_kg_m2": of["principal"],
        "principal_axes": [of[f"principal_axis_{i}"] for i in (1, 2, 3)],
        "momentum_kg_m2_s": of["momentum"],
        "about_m": _plain(found.point),
        "momentum_about_kg_m2_s": of["momentum_about"],
        "momentum_rate_N_m": of["momentum_rate"],
        "momentum_rate_about_N_m": of["momentum_rate_about"],
        "rate_terms_N_m": {term: of[f"rate_{term}"] for term in ("relative", "transport")},
        "inertia_force_N": of["inertia_force"],
        "inertia_moment_N_m": of["inertia_moment"],
        "energy_J": of["energy"],
        "products": "+∫xy dm; the matrix carries -I_xy",
    }
    if found.request.shaft is None:
        return document
    shaft = found.shaft
    bearings: list[Document] = [
        {"z_m": z, "static_N": _plain(static), "dynamic_N": _plain(dynamic)}
        for z, static, dynamic in zip(found.request.shaft.bearings, shaft.static, shaft.dynamic, strict=True)
    ]
    if found.correction is not None:
        for bearing, left in zip(bearings, found.corrected, strict=True):
            bearing["corrected_dynamic_N"] = _plain(left)
    document["shaft"] = {
        "bearings": bearings,
        "axial_N": float(shaft.axial),
        "drive_torque_N_m": float(shaft.drive_torque),
        "static_unbalance_kg_m": float(np.abs(shaft.static_unbalance)),
        "static_angle_deg": float(degrees(shaft.static_unbalance)),
        "corrections": [
            {
                "plane": c.plane,
                "z_m": c.z,
                "radius_m": c.radius,
                "unbalance_kg_m": c.unbalance,
                "mass_kg": c.mass,
                "weight_N": c.mass * G0,
                "angle_deg": c.angle,
            }
            for c in found.corrections
        ],
    }
    return document


def _numbers(value: ArrayLike) -> list[float]:
    numbers: list[float] = np.atleast_1d(np.asarray(value, dtype=float) + 0.0).tolist()
    return numbers


def _plain(value: ArrayLike) -> Json:
    return (np.asarray(value, dtype=float) + 0.0).tolist()  # type: ignore[no-any-return]
