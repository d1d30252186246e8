"""Other programs in and out: each file here is one format, or what the formats share. Here: which program a file is of."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cli.formats.values import LARGEST_FILE, MOST_LINKS, check_count, values_in
from dalembert.errors import DataError

if TYPE_CHECKING:
    from cli.formats.drawn import Drawing
    from cli.formats.robot import Robot

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
