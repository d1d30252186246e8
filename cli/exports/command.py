"""`dalembert export`: a mechanism for programs that draw, and for those that simulate robots."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from cli.errors import DataError, one_line
from cli.read.files import refuse_inputs
from cli.show.files import write

SUFFIXES = (".dxf", ".svg", ".csv", ".urdf", ".sdf", ".xml")


def run(
    file: Annotated[str, typer.Argument(metavar="FILE.toml", help="The mechanism; - is standard input.")],
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Ends in .dxf, .svg, .csv, .urdf, .sdf or .xml (MJCF)."
        ),
    ],
    at: Annotated[
        str | None,
        typer.Option(
            metavar="INPUT",
            help="The start pose, such as 60deg or crank=60deg,arm=30deg; else the file's own.",
        ),
    ] = None,
) -> None:
    """Write a mechanism for other programs: a drawing (DXF, SVG), curves (CSV), a robot (URDF, SDF, MJCF).

    A drawing shows the pose of the file's own input, and the curves over the travel of the input; a robot starts in that
    pose, closed to the last digit. What a format cannot hold is named on standard error.
    """
    from cli.exports.written import written
    from cli.mechanism.read import wanted
    from cli.mechanism.solve import load
    from virtualwork import MechanismError

    suffix = output.suffix.lower()
    if suffix not in SUFFIXES:
        raise typer.BadParameter(
            f"'{output}': expected a name that ends in {', '.join(SUFFIXES)}", param_hint="-o"
        )
    given = load(file)
    m, bare = given.mechanism, given.bare
    inputs = tuple(wanted(m, None if at is None else [at], None, None, bare).values[0].tolist())
    refuse_inputs([output])
    name = "standard input" if file == "-" else Path(file).name
    try:
        data, notes = written(m, inputs, suffix, name, bare)
    except MechanismError as error:
        raise DataError(f"{file}: {error}") from None
    for note in notes:
        print(f"note: {one_line(note)}", file=sys.stderr)
    write(output, data)
