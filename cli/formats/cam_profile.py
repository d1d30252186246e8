"""The profile of a cam for a workshop: its curve in the cam's own axes (DXF, SVG), or a table of its points (CSV)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from cli.formats.drawing import DXF_UNITS, Strokes, dxf, svg
from cli.read.options import bad
from dalembert.hints import nearest
from dalembert.results.text import csv_text
from dalembert.units import UNITS, to_si
from virtualwork.describe.cams import CamDrive
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.profiles import FINE, ProfilePoint, profile
from virtualwork.study.cams import check_cam

SUFFIXES = (".csv", ".dxf", ".svg")


def of_follower(m: Description, name: str) -> CamDrive:
    """Return the cam that moves a follower, which is named by its sliding point or its arm.

    Raises
    ------
    BadParameter
    """
    names = {str(cam.slider or cam.follower): number for number, cam in enumerate(m.cams)}
    if name not in names:
        expected = (
            f"one of the followers {', '.join(names)}{nearest(name, names)}"
            if names
            else "a mechanism with [[cams]]"
        )
        raise bad("--profile", f"'{name}': expected {expected}")
    return m.cam_drives[names[name]]


def file_bytes(
    m: Description, drive: CamDrive, suffix: str, file: str, bare: Mapping[str, str]
) -> tuple[bytes, list[str]]:
    """Return the profile as a file, and warnings; `bare` are the units of the mechanism's own file."""
    points = profile(m, drive, FINE)
    length = bare.get("length", "m")
    if length not in (UNITS["length"] if suffix == ".csv" else DXF_UNITS):
        length = "m"
    metres = to_si(1.0, "length", length)
    notes = check_cam(m, drive.number).warnings
    if suffix == ".csv":
        return _table(points, drive, length, metres, bare.get("angle", "rad")), notes
    comment = " ".join(f"{m.name}: profile of {drive.label}, from {file}".split())
    center = m.bodies[drive.cam.cam][drive.pin] / metres
    drawing = _drawing(points, length, metres, center, drive.cam.base_radius / metres)
    return (svg(drawing, comment, metres * 1000) if suffix == ".svg" else dxf(drawing, comment)), notes


def _drawing(
    points: list[ProfilePoint], length: str, metres: float, center: complex, radius: float
) -> Strokes:
    """Return the profile, the pitch curve and a cross at the axis."""
    from virtualwork.shapes import Line

    shapes = [
        Line("GEARS", GROUND, tuple(point.profile / metres for point in points), closed=True),
        *(
            Line("JOINTS", GROUND, (center - way * radius / 10, center + way * radius / 10))
            for way in (1 + 0j, 1j)
        ),
    ]
    if any(point.pitch != point.profile for point in points):
        shapes.append(Line("CURVES", GROUND, tuple(point.pitch / metres for point in points), closed=True))
    return Strokes(length, list(shapes))


def _table(points: list[ProfilePoint], drive: CamDrive, length: str, metres: float, angle: str) -> bytes:
    """Return a row for each point: the cam's angle, the lift, the profile, the pitch curve, pressure angle and radius."""
    turned: Callable[[float], float] = float if angle == "rad" else math.degrees
    unit = "rad" if angle == "rad" else "deg"
    slides = drive.guide is not None
    columns = {
        f"cam_{unit}": [turned(point.angle) for point in points],
        (f"lift_{length}" if slides else f"swing_{unit}"): [
            point.lift / metres if slides else turned(point.lift) for point in points
        ],
        f"profile_x_{length}": [point.profile.real / metres for point in points],
        f"profile_y_{length}": [point.profile.imag / metres for point in points],
        f"pitch_x_{length}": [point.pitch.real / metres for point in points],
        f"pitch_y_{length}": [point.pitch.imag / metres for point in points],
        f"pressure_angle_{unit}": [turned(point.pressure_angle) for point in points],
        f"curvature_radius_{length}": [
            None if math.isinf(point.curvature_radius) else point.curvature_radius / metres
            for point in points
        ],
    }
    return csv_text(columns).encode()
