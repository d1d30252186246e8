"""A mechanism for programs that draw, and for those that simulate robots; `export_mechanism` is the door of a notebook."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from virtualwork.mechanism import Mechanism

FORMATS = {
    ".dxf": "drawing (DXF), and curves over the travel of the input",
    ".svg": "drawing (SVG), and curves over the travel of the input",
    ".csv": "table of the input and of every moving point over its travel",
    ".urdf": "robot (URDF) with closed loops",
    ".sdf": "robot (SDF) with closed loops",
    ".xml": "robot (MJCF, of MuJoCo) with closed loops",
}


def export_mechanism(
    mechanism: Mechanism,
    path: str | Path,
    at: float | Sequence[float] | None = None,
    length: str = "m",
    angle: str = "rad",
) -> list[str]:
    """Write a mechanism for another program: a drawing, a table of curves, or a robot, by the suffix of the path.

    Parameters
    ----------
    mechanism : Mechanism
    path : str or Path
        .dxf, .svg: drawing of a pose, with curves over the travel of the input; .csv: these curves; .urdf, .sdf,
        .xml (MJCF): robot with closed loops and inertias, in SI.
    at : float or sequence of float, optional
        Inputs of the pose, rad or m; the mechanism's own where it is None.
    length, angle : str
        Units of drawings and tables, such as `mm` and `deg`.

    Returns
    -------
    list of str
        What the format cannot hold.

    Raises
    ------
    ValueError
        Another suffix or unit, or another number of inputs.
    DataError, MechanismError
        It cannot be assembled there; curves of several inputs; DXF without the extra `cad`; the file cannot be written.
        Then nothing is.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from virtualwork import Input, Link, Mechanism
    >>> crank = Link({"O": 0j, "P": 0.1}, mass=1.0, center=0.05, inertia=1e-3)
    >>> m = Mechanism({"O": 0j}, {"crank": crank}, inputs=Input(link="crank"), gravity=-9.81j)
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "crank.urdf")
    ...     print(export_mechanism(m, file, at=0.5))
    ...     print('<mass value="1.0"' in file.read_text())
    ['gravity is left out: the format has none']
    True
    """
    from dalembert.hints import nearest
    from dalembert.results.files import write
    from dalembert.units import UNITS

    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise ValueError(f"'{path}': expected a name that ends in {', '.join(FORMATS)}")
    for kind, unit in (("length", length), ("angle", angle)):
        if unit not in UNITS[kind]:
            raise ValueError(f"{kind}: '{unit}' is no unit of {kind}{nearest(unit, UNITS[kind])}")
    if at is None:
        at = mechanism.own_inputs
    inputs = [at] if isinstance(at, int | float) else list(at)
    if len(inputs) != len(mechanism.inputs):
        names = ", ".join(e.name for e in mechanism.inputs)
        raise ValueError(f"at: found {len(inputs)} values, expected one for each input: {names}")
    data, notes = file_bytes(
        mechanism, tuple(map(float, inputs)), suffix, "", {"length": length, "angle": angle}
    )
    write(path, data)
    return notes


def file_bytes(
    m: Mechanism, inputs: tuple[float, ...], suffix: str, file: str, bare: Mapping[str, str]
) -> tuple[bytes, list[str]]:
    """Return the file of a mechanism that starts at the inputs, rad or m, and what is left out.

    `file` is the mechanism's own, if it has one, and `bare` are the units that it uses.
    """
    from virtualwork.exchange.drawing import Travel, curves, draw, picture, unit_of

    travel = Travel(m)
    length, metres = unit_of(bare, suffix)
    if suffix == ".csv":
        return curves(travel, length, bare.get("angle", "rad")), []
    comment = _comment(m, inputs, file)
    if suffix in (".dxf", ".svg"):
        data = picture(draw(m, inputs, travel, length, metres), suffix, comment, metres)
        several = travel.motion is None
        return data, ["curves are left out: they need one input, and it has several"] if several else []
    from virtualwork.exchange import mjcf, sdf, urdf
    from virtualwork.exchange.skeleton import Skeleton

    writers = {".urdf": urdf.write, ".sdf": sdf.write, ".xml": mjcf.write}
    return writers[suffix](Skeleton(m, inputs, travel), comment)


def _comment(m: Mechanism, inputs: tuple[float, ...], file: str) -> str:
    """Return the comment: what it is, from which file, by which version, in which pose."""
    from importlib.metadata import version

    poses = ", ".join(
        f"{e.name} = {v if e.is_slide else math.degrees(v):.12g} {'m' if e.is_slide else 'deg'}"
        for e, v in zip(m.inputs, inputs, strict=True)
    )
    title = f"{m.name}, " if m.name else ""
    source = f"from {file} " if file else ""
    return " ".join(f"{title}{source}by dalembert {version('dalembert')}, at {poses}".split())
