"""`dalembert export`: a mechanism for programs that draw, and for those that simulate robots."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import bad
from cli.show.output import reported
from dalembert.errors import DataError

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result, Sheet
    from virtualwork import Mechanism

FORMATS = {
    ".dxf": "drawing (DXF), and curves over the travel of the input",
    ".svg": "drawing (SVG), and curves over the travel of the input",
    ".csv": "table of the input and of every moving point over its travel",
    ".urdf": "robot (URDF) with closed loops",
    ".sdf": "robot (SDF) with closed loops",
    ".xml": "robot (MJCF, of MuJoCo) with closed loops",
}

PROFILES = (".csv", ".dxf", ".svg")

METHOD = (
    "The pose is closed by the mechanism's own solution, joint by joint, to rounding; what is written holds it with 17 "
    "digits where the format has room for them."
)


OPTIONS = """
Arguments:
  file FILE.toml  The mechanism; - is standard input.
Options:
  output --output -o FILE  File to write: .dxf, .svg, .csv, .urdf, .sdf or .xml (MJCF). [required]
  at INPUT  Start pose, such as 60deg or crank=60deg,arm=30deg (default: the file's input).
  profile FOLLOWER  Profile of the cam that moves this slider or arm, in the cam's axes (.dxf, .svg, .csv).
"""


@reported(OPTIONS)
def run(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Write a mechanism for other programs: a drawing (DXF, SVG), curves (CSV), a robot (URDF, SDF, MJCF).

    A drawing shows the pose of the file's own input, and the curves over the travel of the input; a robot starts in that
    pose, closed to the last digit. Standard error names what the format cannot hold.
    """
    from cli.cases.axes import grids
    from cli.cases.cases import load
    from cli.cases.inputs import of_one
    from cli.formats.drawing import cam_bytes, of_follower
    from dalembert.results.result import Result
    from dalembert.tables.files import name_of
    from virtualwork import MechanismError

    output, file, profile = Path(options.output), options.file, options.profile
    suffix = output.suffix.lower()
    if suffix not in FORMATS:
        raise bad("-o", f"'{output}': expected a name that ends in {', '.join(FORMATS)}")
    described = load(file)
    m, bare = described.mechanism, described.bare
    if profile is not None and (suffix not in PROFILES or options.at is not None):
        wrong = (
            "it has no pose: leave --at out" if suffix in PROFILES else f"expected -o {', '.join(PROFILES)}"
        )
        raise bad("--profile", wrong)
    moved = grids(m, None if options.at is None else [options.at], None, None, bare, [])[1]
    inputs = tuple(of_one(m, moved).part(0, 1).values[0].tolist())
    name = Path(name_of(file)).name
    try:
        if profile is not None:
            data, notes = cam_bytes(m, of_follower(m, profile), suffix, name, bare)
        else:
            data, notes = file_bytes(m, inputs, suffix, name, bare)
    except MechanismError as error:
        raise DataError(f"{file}: {error}") from None

    def sheets() -> list[Sheet]:
        from cli.cases.picture import posed
        from dalembert.results.result import Section

        whole = [] if notes else ["Nothing is left out."]
        first = Section("Written", [f"{output.name}: {FORMATS[suffix]}, {len(data)} bytes", *whole])
        return [posed("", m, inputs, bare, first)]

    return Result(
        beside={output: lambda: data},
        warnings=notes,
        sheets=sheets,
        method=METHOD,
        about={"title": m.name or "Mechanism"} | described.about,
    )


def file_bytes(
    m: Mechanism, inputs: tuple[float, ...], suffix: str, file: str, bare: Mapping[str, str]
) -> tuple[bytes, list[str]]:
    """Return the file of a mechanism that starts at the inputs, rad or m, and what is left out.

    `bare` are the units that the mechanism's own file uses.
    """
    from cli.formats.drawing import Travel, curves, draw, picture, unit_of

    travel = Travel(m)
    length, metres = unit_of(bare, suffix)
    if suffix == ".csv":
        return curves(travel, length, bare.get("angle", "rad")), []
    comment = _comment(m, inputs, file)
    if suffix in (".dxf", ".svg"):
        data = picture(draw(m, inputs, travel, length, metres), suffix, comment, metres)
        several = travel.motion is None
        return data, ["curves are left out: they need one input, and it has several"] if several else []
    from cli.formats import mjcf, sdf, urdf
    from cli.formats.skeleton import Skeleton

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
    return " ".join(f"{title}from {file} by dalembert {version('dalembert')}, at {poses}".split())
