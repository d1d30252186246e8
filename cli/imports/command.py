"""`dalembert import`: a mechanism of another program as a description of ours."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from cli.errors import DataError, one_line
from cli.imports.words import KINDS
from cli.read.files import read_bytes, refuse_inputs
from cli.show.files import write

Kind = StrEnum("Kind", {name.replace("-", "_"): name for name in KINDS})  # type: ignore[misc]


def run(
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="The other program's file or link; - is standard input.")
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE.toml", help="Where to write it; else standard output."),
    ] = None,
    kind: Annotated[
        Kind | None, typer.Option("--from", help="The program it is from; else told by the content.")
    ] = None,
) -> None:
    """Read a mechanism of another program: PMKS text and links, PMKS+ links, MotionGen, Linkage, linkage_sim, planar robots (URDF, SDF, MJCF).

    What is written is a file for `dalembert mechanism`. The links' axes are parallel to the ground's in the drawn pose,
    which is that of input 0; a robot's keep their own. All that is not taken over is named on standard error. Several mechanisms in one file
    become FILE-1.toml, FILE-2.toml and so on.
    """
    from cli.imports.assembled import described
    from cli.imports.drawn import settle
    from cli.imports.told import read

    if output is not None and output.suffix.lower() != ".toml":
        raise typer.BadParameter(f"'{output}': expected a name that ends in .toml", param_hint="-o")
    name, data = read_bytes(file)
    folder = None if file == "-" else Path(file).parent
    told, drawings = read(name, data, None if kind is None else str(kind.value), folder)
    stem = "" if file == "-" else Path(file).stem
    found: list[tuple[str, list[str]]] = []
    lost: list[str] = []
    for d in drawings:
        d.name = d.name or stem
        parts = settle(d)
        lost += d.notes
        for k, part in enumerate(parts, 1):
            part.name = part.name if len(parts) == 1 else f"{part.name} {k}".strip()
            found.append((described(part, f"imported from {told}"), part.notes))
    for note in lost:
        _say(note)
    if not found:
        raise DataError(f"{name}: no mechanism: nothing in it is driven by an input")
    if len(found) > 1 and output is None:
        raise typer.BadParameter(
            f"{name} holds {len(found)} mechanisms: expected a file, which becomes FILE-1.toml …",
            param_hint="-o",
        )
    paths = []
    if output is not None:
        paths = [output]
        if len(found) > 1:
            paths = [output.with_name(f"{output.stem}-{k}{output.suffix}") for k in range(1, len(found) + 1)]
        refuse_inputs(paths)
    for k, (made, notes) in enumerate(found):
        for note in notes:
            _say(note if len(found) == 1 else f"{paths[k].name}: {note}")
        if paths:
            write(paths[k], made.encode())
        else:
            sys.stdout.write(made)
    if len(paths) > 1:
        print(f"wrote {', '.join(map(str, paths))}", file=sys.stderr)


def _say(note: str) -> None:
    print(f"note: {one_line(note)}", file=sys.stderr)
