"""Which program a drawing is of, and its mechanisms; `import_mechanisms` is the door of a notebook."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from dalembert.documents.values import MOST_LINKS, check_count, decoded, parsed
from dalembert.errors import DataError
from dalembert.tables.files import read_bytes

if TYPE_CHECKING:
    from dalembert.documents.robots import Robot
    from virtualwork.exchange.drawn import Drawing
    from virtualwork.mechanism import Mechanism

PROGRAMS = {
    "pmks-text": "PMKS text or link (`ground, input, R, 0, 0`; `?mech=…`), and its JSON",
    "pmks-web": "PMKS+ link or string",
    "motiongen": "MotionGen JSON",
    "linkage": "Linkage (.linkage2)",
    "linkage_sim": "linkage_sim JSON",
    "freecad": "FreeCAD sketch (.FCStd)",
}
# an address itself holds the mechanism: nothing is fetched
LINK = re.compile(r"[a-z]+://", re.IGNORECASE)
NO_ROOTS: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True)
class ImportedMechanism:
    """A mechanism read from another program's file: its name, its TOML text, and notes of what was not imported.

    `refused` says why it has no motion, such as a free degree of freedom; it is empty where it moves.
    """

    name: str
    toml: str
    notes: tuple[str, ...] = ()
    refused: str = ""

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism, in SI; MechanismError, here or on its first motion, where it is refused."""
        from virtualwork.mechanism import Mechanism

        return Mechanism.from_toml_text(self.toml)


def import_mechanisms(source: str | Path | Robot, program: str | None = None) -> list[ImportedMechanism]:
    """Read the mechanisms of another program's file or link, or of a planar robot; one source may hold several.

    Parameters
    ----------
    source : str, Path or Robot
        The file; a link that itself holds the mechanism (nothing is fetched from the network); a robot of
        `rigidbody3d.read_robot`, which is laid into the plane in which all its joints move.
    program : str, optional
        The program of a file or link: `pmks-text`, `pmks-web`, `motiongen`, `linkage`, `linkage_sim` or `freecad`;
        recognized by the content where it is None.

    Returns
    -------
    list of ImportedMechanism
        In the order of the file. The lengths of each TOML text are in the file's own unit; its guess is the drawn pose.

    Raises
    ------
    DataError
        The file cannot be read, its program is not recognized, the robot is not planar, or nothing is driven by an input.
    ValueError
        Another `program`.

    Notes
    -----
    Lengths are differences of the file's own decimals, rounded once. The imported mechanism is assembled again and
    compared with the drawing, point by point.

    Examples
    --------
    >>> (four_bar,) = import_mechanisms(
    ...     "http://pmks.example/?mech=ground input R 0 0 0 ffft|input rod R 0 2|rod rocker R 3 4|rocker ground R 4 0"
    ... )
    >>> four_bar.notes
    ('the file has no unit of length: numbers are taken as metres',)
    >>> four_bar.mechanism.motion(0.0).point("J3").position.round(12)
    array([[3., 4.]])
    """
    if program is not None and program not in PROGRAMS:
        raise ValueError(f"program '{program}': expected one of {', '.join(PROGRAMS)}")
    if isinstance(source, str | Path):
        file, data, path = opened(str(source))
        try:
            program = program_of(file, data, program)
        except UnknownProgram as error:
            raise DataError(f"{error}; name it with `program`") from None
        made, lost = mechanisms_of(file, program, read(file, data, program), path)
    else:
        made, lost = mechanisms_of(source.file, source.format, [planar(source)], Path(source.file))
    return [replace(m, notes=(*lost, *m.notes)) for m in made]


def opened(source: str) -> tuple[str, bytes, Path | None]:
    """Return what messages call a file or link, what it holds, and its path; None for a link and for standard input."""
    if LINK.match(source):
        return "the link", source.encode(), None
    return *read_bytes(source), None if source == "-" else Path(source)


def mechanisms_of(
    file: str, program: str, drawings: list[Drawing], path: Path | None
) -> tuple[list[ImportedMechanism], list[str]]:
    """Return the mechanisms of a file's drawings, and notes of what belongs to none; the path names what has no name."""
    from virtualwork.exchange.description import described
    from virtualwork.exchange.settled import settle

    result: list[ImportedMechanism] = []
    lost: list[str] = []
    for d in drawings:
        d.name = d.name or (path.stem if path else "")
        parts = settle(d)
        lost += d.notes
        for k, part in enumerate(parts, 1):
            part.name = part.name if len(parts) == 1 else f"{part.name} {k}".strip()
            text = described(part, f"imported from {program}")
            result.append(ImportedMechanism(part.name, text, tuple(part.notes), part.refused))
    if not result:
        # a drawing's first joint that can move drives where the program says none
        mend = "" if program in PROGRAMS else ": give it an actuator on a joint that can move"
        nothing = f"{file}: no mechanism: nothing in it is driven by an input{mend}"
        raise DataError("; ".join([nothing, *lost]))
    return result, lost


def planar(robot: Robot) -> Drawing:
    """Return a robot in the plane in which it moves.

    Raises
    ------
    DataError
        It is not planar, or too large.
    """
    from virtualwork.exchange import planar_robot

    return _checked(robot.file, [planar_robot.drawing(robot)])[0]


# --- which program a file is of -----------------------------------------------------------------------------------
class UnknownProgram(DataError):
    """A file whose program is not recognized."""


def unknown(file: str, programs: Mapping[str, str] = PROGRAMS) -> UnknownProgram:
    """Return the error of a file that none of some programs wrote."""
    expected = "; ".join(f"{name} ({what})" for name, what in programs.items())
    return UnknownProgram(f"{file}: unknown format: expected {expected}")


def program_of(
    file: str, data: bytes, program: str | None = None, roots: Mapping[str, str] = NO_ROOTS
) -> str:
    """Return the program of a file: that which is named, or the one that its content shows.

    `roots` are outermost elements of XML that the caller reads itself, and the names of their formats.

    >>> program_of("", b"ground, input, R, 0, 0")
    'pmks-text'

    Raises
    ------
    UnknownProgram
    DataError
        The file is empty or too large.
    """
    from virtualwork.exchange import freecad

    if program == "freecad" or (program is None and freecad.is_document(data)):
        return "freecad"
    text = decoded(file, data)
    if text is not None and not text.strip():
        raise DataError(f"{file}: the file is empty: expected a mechanism of another program")
    result = None if text is None else program or _recognized(file, text, roots)
    if result is None:
        raise unknown(file)
    return result


def _recognized(file: str, text: str, roots: Mapping[str, str]) -> str | None:
    start = text.lstrip()
    if start.startswith("<"):
        if re.search(r"<\s*linkage2\b", start[:2000], re.IGNORECASE):
            return "linkage"
        tag = re.search(r"<([A-Za-z_][\w.-]*)", re.sub(r"<!--.*?(?:-->|\Z)", "", start, flags=re.DOTALL))
        return roots.get(tag[1]) if tag else None
    if start.startswith(("{", "[")):
        return _of_json(parsed(file, text))
    from urllib.parse import unquote

    from virtualwork.exchange import pmksweb

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
    joint = r"(^|[\s,])(R|P|RP|G)[\s,]+[-+.\d]"
    return "pmks-text" if any(re.search(joint, row, re.IGNORECASE) for row in text.splitlines()) else None


def _of_json(data: object) -> str | None:
    first = data[0] if isinstance(data, list) and data else data
    if not isinstance(first, dict):
        return None
    if isinstance(first.get("bodies"), dict):
        return "linkage_sim"
    if "Joints" in first:
        return "pmks-text"
    motiongen = {"mechanism", "mechanisms"} & first.keys() or {"joints", "links"} <= first.keys()
    return "motiongen" if motiongen else None


def read(file: str, data: bytes, program: str) -> list[Drawing]:
    """Return the drawings of a file of one of the programs.

    Raises
    ------
    DataError
    """
    from virtualwork.exchange import freecad

    return _checked(
        file, freecad.read(file, data) if program == "freecad" else _drawings(file, data, program)
    )


def _checked(file: str, drawings: list[Drawing]) -> list[Drawing]:
    for d in drawings:
        check_count(file, len(d.bodies), "links", MOST_LINKS)
    return drawings


def _drawings(file: str, data: bytes, program: str) -> list[Drawing]:
    from virtualwork.exchange import linkage2, linkage_sim, motiongen, pmks, pmksweb

    text = decoded(file, data)
    if text is None:
        raise unknown(file)
    if program == "linkage":
        return linkage2.read(file, text)
    if program in ("pmks-text", "pmks-web"):
        check_count(file, text.count("\n"), "lines")
    if program == "pmks-text":
        return pmks.read(file, parsed(file, text) if text.lstrip()[:1] in ("{", "[") else text)
    if program == "pmks-web":
        return pmksweb.read(file, text)
    if program == "motiongen":
        return motiongen.read(file, parsed(file, text))
    return linkage_sim.read(file, parsed(file, text))
