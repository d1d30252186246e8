"""The bytes of a file for another program, and what that file cannot hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from cli.formats.drawing import DXF_UNITS, draw, dxf, svg
from cli.formats.skeleton import Skeleton, Travel
from dalembert.errors import DataError
from dalembert.results.text import csv_text
from dalembert.units import UNITS, to_si

if TYPE_CHECKING:
    from virtualwork import Mechanism


def file_bytes(
    m: Mechanism, inputs: tuple[float, ...], suffix: str, file: str, bare: Mapping[str, str]
) -> tuple[bytes, list[str]]:
    """Return the file of a mechanism that starts at the inputs, rad or m, and what is omitted.

    `bare` are the units that the mechanism's own file uses.
    """
    travel = Travel(m)
    length = bare.get("length", "m")
    metres = to_si(1.0, "length", length)
    if suffix == ".csv":
        return _curves(travel, length, metres, bare.get("angle", "rad")), []
    s = Skeleton(m, inputs, travel.limits)
    comment = _comment(m, inputs, file)
    if suffix in (".dxf", ".svg"):
        if length not in DXF_UNITS:
            length, metres = "m", 1.0
        drawing = draw(s, travel, length, metres)
        notes = (
            []
            if travel.motion is not None
            else ["curves are left out: they need one input, and it has several"]
        )
        if suffix == ".svg":
            return svg(drawing, comment, metres * 1000), notes
        return dxf(drawing, comment), notes
    if suffix == ".xml":
        from cli.formats.mjcf import write
    elif suffix == ".sdf":
        from cli.formats.sdf import write
    else:
        from cli.formats.urdf import write
    return write(s, travel, comment), _left_out(s, suffix)


def _comment(m: Mechanism, inputs: tuple[float, ...], file: str) -> str:
    """Return the comment: what it is, from which file, by which version, in which pose."""
    from importlib.metadata import version

    poses = ", ".join(
        f"{e.name} = {v if e.is_slide else np.degrees(v):.12g} {'m' if e.is_slide else 'deg'}"
        for e, v in zip(m.inputs, inputs, strict=True)
    )
    title = f"{m.name}, " if m.name else ""
    return " ".join(f"{title}from {file} by dalembert {version('dalembert')}, at {poses}".split())


def _curves(travel: Travel, length: str, factor: float, angle: str) -> bytes:
    """Return the table of the input and of every moving point over its travel."""
    m = travel.m
    if travel.motion is None:
        raise DataError(
            "curves are of one input, and it has several: `dalembert mechanism --cases` takes them"
        )
    if length not in UNITS["length"]:
        length, factor = "m", 1.0
    q = travel.motion.inputs[:, 0]
    if m.inputs[0].is_slide:
        columns = {f"input_{length}": q / factor}
    else:
        columns = {"input_rad": q} if angle == "rad" else {"input_deg": np.degrees(q)}
    for name in travel.moving:
        for k, axis in enumerate("xy"):
            columns[f"{name}_{axis}_{length}"] = travel.curve(name)[:, k] / factor
    return csv_text({name: values.tolist() for name, values in columns.items()}).encode()


def _left_out(s: Skeleton, suffix: str) -> list[str]:
    """Name what a robot's format cannot hold."""
    m = s.m
    result = []
    for what, loads in (
        ("forces", m.forces),
        ("torques", m.torques),
        ("springs", m.springs),
        ("torsion springs", m.torsion_springs),
        ("friction", m.friction),
    ):
        if loads and not (suffix == ".xml" and "springs" in what):
            result.append(f"{what} are left out: {len(loads)}")
    if m.cams:
        result.append(f"cams are left out: {len(m.cams)}: the format has no such joint")
    if m.racks and suffix == ".sdf":
        result.append(f"racks are left out: {len(m.racks)}: the format has no such joint")
    light = [name for name, body in s.bodies.items() if body.mass <= 0 and name in m.links]
    if light and suffix != ".urdf":
        result.append(
            f"without mass: {', '.join(light)}: the format takes none: a millionth of the heaviest is given"
        )
    for k, e in enumerate(m.inputs):
        j = s.driven(k)
        if suffix == ".xml" or (j is not None and j.input == k):
            continue
        instead = f": {j.link} is driven against {j.on} instead" if j is not None else ""
        result.append(f"input {e.name} is left out: no pin joins {e.link} and {e.on}{instead}")
    if suffix == ".urdf" and m.gravity:
        result.append("gravity is left out: the format has none")
    return result
