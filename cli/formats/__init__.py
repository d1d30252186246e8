"""`dalembert import`: mechanisms of other programs. Drawings are read by `virtualwork`, robots by `rigidbody3d`."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.read.options import bad
from cli.show.output import reported
from dalembert.errors import DataError
from rigidbody3d.robots.reading import FORMATS, ROOTS
from virtualwork.exchange.programs import PROGRAMS

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result, Sheet
    from virtualwork.exchange.drawn import Drawing
    from virtualwork.exchange.programs import ImportedMechanism

# kinds of files, as --from names them
KINDS = {**PROGRAMS, **FORMATS}

METHOD = (
    "Lengths are differences of the file's own decimals, rounded once. The imported mechanism is assembled again and compared "
    "with the drawing, point by point."
)


OPTIONS = f"""
Arguments:
  file FILE  The other program's file, or its link in quotes; - is standard input.
Options:
  output --output -o FILE(.toml)  File to write (default: standard output).
  kind --from {"|".join(KINDS)}  Program of the file (default: recognized by the content).
"""


@reported(OPTIONS)
def run(options: SimpleNamespace, _: ShowOptions) -> Result:
    """Read a mechanism of another program: PMKS text and links, PMKS+ links, MotionGen, Linkage, linkage_sim, FreeCAD sketches, planar robots (URDF, SDF, MJCF).

    The result is a file for `dalembert mechanism`. In the drawn pose, which is that of input 0, the links' axes are
    parallel to the ground's; links of a robot keep their own axes. Standard error names what was not imported.
    Several mechanisms in one file become FILE-1.toml, FILE-2.toml and so on.
    """
    from dalembert.results.result import Result
    from virtualwork.exchange.programs import mechanisms_of, opened

    name, data, path = opened(options.file)
    program, drawings = read(name, data, options.kind, path and path.parent)
    result, lost = mechanisms_of(name, program, drawings, path)
    several = len(result) > 1
    if several and options.output is None:
        raise bad(
            "-o", f"{name} holds {len(result)} mechanisms: expected a file, which becomes FILE-1.toml …"
        )
    ends = [f"-{k}" for k in range(1, len(result) + 1)] if several else [""]
    output: Path | None = options.output
    paths = [output.with_name(f"{output.stem}{end}{output.suffix}") for end in ends] if output else []
    titles = [path.name for path in paths] if several else [""]
    lines = [
        f"{title}: {note}" if several else note
        for title, m in zip(titles, result, strict=True)
        for note in (*m.notes, *([f"`dalembert mechanism` will refuse it: {m.refused}"] if m.refused else []))
    ]

    def sheets() -> list[Sheet]:
        taken = [f"{name}: {KINDS[program].partition(' (')[0]}, {len(data)} bytes"]
        return [
            sheet
            for title, m in zip(titles, result, strict=True)
            for sheet in _pages(
                title, taken if lost or m.notes or m.refused else [*taken, "All of it is imported."], m
            )
        ]

    return Result(
        notes=lambda: f"wrote {', '.join(map(str, paths))}\n" if several else "" if paths else result[0].toml,
        beside={path: m.toml.encode for path, m in zip(paths, result, strict=False)},
        warnings=[*lost, *lines],
        sheets=sheets,
        shows_input=True,
        method=METHOD,
        about={"title": drawings[0].name or "Imported mechanism"},
    )


def _pages(title: str, taken: list[str], made: ImportedMechanism) -> list[Sheet]:
    """Return the sheets of a mechanism, and of its file; `taken`: the file that it was imported from."""
    import tomllib

    from cli.cases.picture import posed
    from dalembert.results.report import CODE
    from dalembert.results.result import Section, Sheet
    from virtualwork import MechanismError

    first = Section("Imported", taken)
    file = Sheet("", [Section("The file for dalembert mechanism", [CODE + made.toml.rstrip("\n")])])
    try:
        m = made.mechanism
        return [posed(title, m, m.own_inputs, tomllib.loads(made.toml).get("units", {}), first), file]
    except MechanismError as error:
        return [Sheet(title, [first, Section("Mechanism", [str(error)])]), file]


def read(file: str, data: bytes, kind: str | None, folder: Path | None = None) -> tuple[str, list[Drawing]]:
    """Return the kind and the drawings of a file; files that it includes must lie in its folder."""
    from rigidbody3d.robots import reading
    from virtualwork.exchange import programs
    from virtualwork.exchange.planar_robot import ImpossibleInertia

    try:
        kind = programs.program_of(file, data, kind, ROOTS)
        if kind not in FORMATS:
            return kind, programs.read(file, data, kind)
        return kind, [programs.planar(reading.read(file, data, folder))]
    except programs.UnknownProgram:
        raise DataError(f"{programs.unknown(file, KINDS)}; name it with --from") from None
    except ImpossibleInertia as error:
        raise DataError(f"{error}: see `dalembert body --check-inertias`") from None
