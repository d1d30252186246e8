"""`dalembert export`: a mechanism for programs that draw, and for those that simulate robots."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import bad
from cli.show.output import reported
from dalembert.errors import DataError

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result, Sheet
    from virtualwork.describe.cams import CamDrive
    from virtualwork.describe.description import Description

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
    from dalembert.results.result import Result
    from dalembert.tables.files import name_of
    from virtualwork import MechanismError
    from virtualwork.exchange.drawing import SeveralInputs, cam_bytes
    from virtualwork.exchange.export import FORMATS, file_bytes

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
            data, notes = cam_bytes(m, _follower(m, profile), suffix, name, bare)
        else:
            data, notes = file_bytes(m, inputs, suffix, name, bare)
    except MechanismError as error:
        raise DataError(f"{file}: {error}") from None
    except SeveralInputs as error:
        raise DataError(f"{error}: use `dalembert mechanism --cases`") from None

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


def _follower(m: Description, name: str) -> CamDrive:
    """Return the cam that moves a follower, which is named by its sliding point or its arm.

    Raises
    ------
    BadParameter
    """
    from dalembert.hints import nearest

    names = {str(cam.slider or cam.follower): number for number, cam in enumerate(m.cams)}
    if name not in names:
        expected = (
            f"one of the followers {', '.join(names)}{nearest(name, names)}"
            if names
            else "a mechanism with [[cams]]"
        )
        raise bad("--profile", f"'{name}': expected {expected}")
    return m.cam_drives[names[name]]
