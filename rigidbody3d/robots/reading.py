"""Which format a robot's file has; `read_robot` is the door of a notebook."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from dalembert.errors import DataError
from dalembert.tables.files import read_bytes

if TYPE_CHECKING:
    from dalembert.documents.robots import Robot

FORMATS = {"urdf": "URDF robot", "sdf": "SDF model", "mjcf": "MuJoCo's MJCF"}
# outermost element -> the format
ROOTS = {"robot": "urdf", "sdf": "sdf", "mujoco": "mjcf"}


def read_robot(path: str | Path) -> Robot:
    """Read a robot in space from a URDF, SDF or MJCF file: its links with their inertias, its joints, what drives them.

    Parameters
    ----------
    path : str or Path
        The file; its outermost element shows the format. Files that an MJCF includes must lie in its folder.

    Returns
    -------
    Robot
        `links` and `joints` by name, in SI and rad, as they stand in the file's own configuration; `notes` of what was not
        imported. `links[name].pose` (4, 4) places a link in the world; `link_body` returns its mass, centre and tensor.
        `virtualwork.import_mechanisms` makes mechanisms of a planar robot.

    Raises
    ------
    DataError
        The file cannot be read, or is no robot.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> inertial = '<mass value="2"/><origin xyz="0.1 0 0"/><inertia ixx="1" iyy="2" izz="3"/>'
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "arm.urdf")
    ...     _ = file.write_text(f'<robot name="r"><link name="arm"><inertial>{inertial}</inertial></link></robot>')
    ...     robot = read_robot(file)
    >>> robot.links["arm"].pose[:3, 3], robot.links["arm"].inertial.mass
    (array([0., 0., 0.]), 2.0)
    """
    name = str(path)
    file, data = read_bytes(name)
    return read(file, data, None if name == "-" else Path(path).parent)


def read(file: str, data: bytes, folder: Path | None) -> Robot:
    """Read a robot's file; files that it includes must lie in `folder`.

    Raises
    ------
    DataError
    """
    from dalembert.documents.markup import parse
    from rigidbody3d.robots import mjcf, sdf, urdf

    root = parse(file, data)
    kind = ROOTS.get(root.tag)
    if kind is None:
        expected = ", ".join(f"<{tag}> ({name.upper()})" for tag, name in ROOTS.items())
        raise DataError(f"{file}: found <{root.tag}>, expected {expected}")
    if kind == "mjcf":
        robot = mjcf.read(file, root, folder)
    else:
        robot = (urdf if kind == "urdf" else sdf).read(file, root)
    robot.format = kind
    return robot
