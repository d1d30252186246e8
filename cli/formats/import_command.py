"""`dalembert import`: a mechanism of another program as a description of ours."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

from cli.formats import KINDS, ROOTS, read
from cli.read.options import bad
from cli.show.output import reported
from dalembert.errors import DataError
from dalembert.tables.files import read_bytes

if TYPE_CHECKING:
    from cli.show.commands import ShowOptions
    from cli.show.result import Result, Sheet


# an address itself holds the mechanism: nothing is fetched
LINK = re.compile(r"[a-z]+://", re.IGNORECASE)

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
    from cli.formats.description import described
    from cli.formats.settled import settle
    from cli.show.result import Result

    link = LINK.match(options.file) is not None
    name, data = ("the link", options.file.encode()) if link else read_bytes(options.file)
    folder = None if link or options.file == "-" else Path(options.file).parent
    program, drawings = read(name, data, options.kind, folder)
    stem = "" if folder is None else Path(options.file).stem
    result: list[tuple[str, list[str]]] = []
    lost: list[str] = []
    for d in drawings:
        d.name = d.name or stem
        parts = settle(d)
        lost += d.notes
        for k, part in enumerate(parts, 1):
            part.name = part.name if len(parts) == 1 else f"{part.name} {k}".strip()
            result.append((described(part, f"imported from {program}"), part.notes))
    if not result:
        mend = ": give it an actuator on a joint that can move" if program in ROOTS.values() else ""
        raise DataError(
            "; ".join([f"{name}: no mechanism: nothing in it is driven by an input{mend}", *lost])
        )
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
        for title, (_, notes) in zip(titles, result, strict=True)
        for note in notes
    ]

    def sheets() -> list[Sheet]:
        taken = [f"{name}: {KINDS[program].partition(' (')[0]}, {len(data)} bytes"]
        return [
            sheet
            for title, (made, its) in zip(titles, result, strict=True)
            for sheet in _pages(title, taken if lost or its else [*taken, "All of it is imported."], made)
        ]

    return Result(
        notes=lambda: f"wrote {', '.join(map(str, paths))}\n" if several else "" if paths else result[0][0],
        beside={path: made.encode for path, (made, _) in zip(paths, result, strict=False)},
        warnings=[*lost, *lines],
        sheets=sheets,
        shows_input=True,
        method=METHOD,
        about={"title": drawings[0].name or "Imported mechanism"},
    )


def _pages(title: str, taken: list[str], made: str) -> list[Sheet]:
    """Return the sheets of a mechanism, and of its file; `taken`: the file that it was imported from."""
    import tomllib

    from cli.cases.picture import posed
    from cli.show.report import CODE
    from cli.show.result import Section, Sheet
    from virtualwork import Mechanism, MechanismError

    first = Section("Imported", taken)
    file = Sheet("", [Section("The file for dalembert mechanism", [CODE + made.rstrip("\n")])])
    try:
        m = Mechanism.from_toml_text(made)
        inputs = tuple(at if e.value is None else e.value for e, at in zip(m.inputs, m.at, strict=True))
        return [posed(title, m, inputs, tomllib.loads(made).get("units", {}), first), file]
    except MechanismError as error:
        return [Sheet(title, [first, Section("Mechanism", [str(error)])]), file]
