"""Robot files: URDF, SDF and MJCF as links, joints and inertias in space."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cli.read.robots.robot import Robot

# outermost element -> what the format is called
ROOTS = {"robot": "urdf", "sdf": "sdf", "mujoco": "mjcf"}


def read_robot(file: str, data: bytes, folder: Path | None) -> Robot:
    """Read a robot file; `folder` is where files that it includes must lie."""
    from cli.read.robots import mjcf, sdf, urdf
    from cli.read.robots.elements import parse, plain
    from dalembert.errors import DataError

    root = parse(file, data)
    kind = ROOTS.get(plain(root))
    if kind is None:
        expected = ", ".join(f"<{tag}> ({name.upper()})" for tag, name in ROOTS.items())
        raise DataError(f"{file}: found <{plain(root)}>, expected {expected}")
    if kind == "urdf":
        return urdf.read(file, root)
    return sdf.read(file, root) if kind == "sdf" else mjcf.read(file, root, folder)
