"""Other programs in and out: each file here is one format, or what the formats share. Here: `dalembert import`, and which program a file is of."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from cli.formats.values import LARGEST_FILE, MOST_LINKS, check_count, values_in
from cli.read.options import bad
from cli.show.output import reported
from dalembert.errors import DataError
from dalembert.tables.files import read_bytes

if TYPE_CHECKING:
    from cli.formats.drawn import Drawing
    from cli.formats.robot import Robot
    from cli.show.commands import ShowOptions
    from dalembert.results.result import Result, Sheet

# kinds of files, as --from names them
KINDS = {
    "pmks-text": "PMKS text or link (`ground, input, R, 0, 0`; `?mech=…`), and its JSON",
    "pmks-web": "PMKS+ link or string",
    "motiongen": "MotionGen JSON",
    "linkage": "Linkage (.linkage2)",
    "linkage_sim": "linkage_sim JSON",
    "freecad": "FreeCAD sketch (.FCStd)",
    "urdf": "URDF robot",
    "sdf": "SDF model",
    "mjcf": "MuJoCo's MJCF",
}
# outermost element -> the format
ROOTS = {"robot": "urdf", "sdf": "sdf", "mujoco": "mjcf"}
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
    from dalembert.results.result import Result

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
    from dalembert.results.report import CODE
    from dalembert.results.result import Section, Sheet
    from virtualwork import Mechanism, MechanismError

    first = Section("Imported", taken)
    file = Sheet("", [Section("The file for dalembert mechanism", [CODE + made.rstrip("\n")])])
    try:
        m = Mechanism.from_toml_text(made)
        inputs = tuple(at if e.value is None else e.value for e, at in zip(m.inputs, m.at, strict=True))
        return [posed(title, m, inputs, tomllib.loads(made).get("units", {}), first), file]
    except MechanismError as error:
        return [Sheet(title, [first, Section("Mechanism", [str(error)])]), file]


# --- which program a file is of -----------------------------------------------------------------------------------
def unknown(file: str) -> DataError:
    """Return the error of a file whose kind is not recognized."""
    programs = "; ".join(f"{name} ({what})" for name, what in KINDS.items())
    return DataError(f"{file}: unknown format: expected {programs}; name it with --from")


def decoded(file: str, data: bytes) -> str:
    """Return a file's text; DataError where the file is too large or binary."""
    if len(data) > LARGEST_FILE:
        raise DataError(f"{file}: {len(data)} bytes: expected at most {LARGEST_FILE} (10 MB)")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252", errors="replace")
    if "\0" in text:
        raise unknown(file)
    return text


def parsed(file: str, text: str) -> Any:
    """Return a JSON document; DataError names the line and column of what is wrong."""
    import json

    def refuse(word: str) -> float:
        raise DataError(f"{file}: found {word}, expected finite numbers")

    try:
        result = json.loads(text, parse_constant=refuse)
    except json.JSONDecodeError as error:
        raise DataError(
            f"{file}: line {error.lineno}, column {error.colno}: no valid JSON ({error.msg}); is the file cut off?"
        ) from None
    except (RecursionError, ValueError):
        raise DataError(
            f"{file}: no valid JSON: nested too deeply, or a number of thousands of digits"
        ) from None
    check_count(file, values_in(result), "values")
    return result


def kind_of(file: str, text: str) -> str:
    """Return the kind of a text.

    >>> kind_of("", "ground, input, R, 0, 0")
    'pmks-text'
    """
    start = text.lstrip()
    if start.startswith("<"):
        if re.search(r"<\s*linkage2\b", start[:2000], re.IGNORECASE):
            return "linkage"
        tag = re.search(r"<([A-Za-z_][\w.-]*)", re.sub(r"<!--.*?(?:-->|\Z)", "", start, flags=re.DOTALL))
        if tag and tag[1] in ROOTS:
            return ROOTS[tag[1]]
        raise unknown(file)
    if start.startswith(("{", "[")):
        data = parsed(file, text)
        first = data[0] if isinstance(data, list) and data else data
        if isinstance(first, dict):
            if isinstance(first.get("bodies"), dict):
                return "linkage_sim"
            if "Joints" in first:
                return "pmks-text"
            if {"mechanism", "mechanisms"} & first.keys() or {"joints", "links"} <= first.keys():
                return "motiongen"
        raise unknown(file)
    from urllib.parse import unquote

    from cli.formats import pmksweb

    line = next((unquote(row).strip() for row in text.splitlines() if row.strip()), "")
    if "mech=" in text or "mech%3" in text.lower():
        return "pmks-text"
    string = line.rpartition("?")[2]
    if (
        pmksweb.LISTED.search(text)
        or pmksweb.STRING.fullmatch(string)
        or ("pmksplus" in line and "." in string)
    ):
        return "pmks-web"
    if any(re.search(r"(^|[\s,])(R|P|RP|G)[\s,]+[-+.\d]", row, re.IGNORECASE) for row in text.splitlines()):
        return "pmks-text"
    raise unknown(file)


def read(file: str, data: bytes, kind: str | None, folder: Path | None = None) -> tuple[str, list[Drawing]]:
    """Return the kind and the drawings of a file; files that it includes must lie in its folder."""
    kind, drawings = _read(file, data, kind, folder)
    for d in drawings:
        check_count(file, len(d.bodies), "links", MOST_LINKS)
    return kind, drawings


def _read(file: str, data: bytes, kind: str | None, folder: Path | None) -> tuple[str, list[Drawing]]:
    from cli.formats import freecad, linkage2, linkage_sim, motiongen, pmks, pmksweb

    if kind == "freecad" or (kind is None and freecad.is_document(data)):
        return "freecad", freecad.read(file, data)
    text = decoded(file, data)
    if not text.strip():
        raise DataError(f"{file}: the file is empty: expected a mechanism of another program")
    kind = kind or kind_of(file, text)
    if kind in ROOTS.values():
        from cli.formats import plane

        return kind, [plane.drawing(read_robot(file, data, folder))]
    if kind == "linkage":
        return kind, linkage2.read(file, text)
    if kind in ("pmks-text", "pmks-web"):
        check_count(file, text.count("\n"), "lines")
    if kind == "pmks-text":
        return kind, pmks.read(file, parsed(file, text) if text.lstrip()[:1] in ("{", "[") else text)
    if kind == "pmks-web":
        return kind, pmksweb.read(file, text)
    document = parsed(file, text)
    return kind, (motiongen if kind == "motiongen" else linkage_sim).read(file, document)


def read_robot(file: str, data: bytes, folder: Path | None) -> Robot:
    """Read a robot file; files that it includes must lie in `folder`."""
    from cli.formats import mjcf, sdf, urdf
    from cli.formats.markup import parse

    root = parse(file, data)
    kind = ROOTS.get(root.tag)
    if kind is None:
        expected = ", ".join(f"<{tag}> ({name.upper()})" for tag, name in ROOTS.items())
        raise DataError(f"{file}: found <{root.tag}>, expected {expected}")
    if kind == "urdf":
        return urdf.read(file, root)
    return sdf.read(file, root) if kind == "sdf" else mjcf.read(file, root, folder)
