"""What `dalembert import` says: the kinds it knows, and what was not imported."""

from __future__ import annotations

from dalembert.errors import DataError, quote

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


def unknown(file: str) -> DataError:
    """Refuse a file of no known kind."""
    programs = "; ".join(f"{name} ({what})" for name, what in KINDS.items())
    return DataError(f"{file}: of no known kind: expected {programs}; --from names one")


def damaged(file: str, where: str, value: object, expected: str) -> DataError:
    """Refuse a file at the place where it is no longer what it should be."""
    return DataError(f"{file}: {where}: found {quote(str(value))}, expected {expected}")
