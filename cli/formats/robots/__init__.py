"""Robots: the files of links and joints in space (URDF, SDF, MJCF), and the plane in which a planar one moves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from dalembert.errors import DataError

if TYPE_CHECKING:
    from cli.formats.robots.robot import Robot

# outermost element -> the format
ROOTS = {"robot": "urdf", "sdf": "sdf", "mujoco": "mjcf"}


def read_robot(file: str, data: bytes, folder: Path | None) -> Robot:
    """Read a robot file; files that it includes must lie in `folder`."""
    from cli.formats.markup import parse, plain
    from cli.formats.robots import mjcf, sdf, urdf

    root = parse(file, data)
    kind = ROOTS.get(plain(root))
    if kind is None:
        expected = ", ".join(f"<{tag}> ({name.upper()})" for tag, name in ROOTS.items())
        raise DataError(f"{file}: found <{plain(root)}>, expected {expected}")
    if kind == "urdf":
        return urdf.read(file, root)
    return sdf.read(file, root) if kind == "sdf" else mjcf.read(file, root, folder)
