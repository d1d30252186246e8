"""`read_robot`, `link_body` and `check_robot_inertias`: the inertias of a robot's file in a notebook."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dalembert.errors import DataError
from rigidbody3d import check_robot_inertias, link_body, read_robot

LINK = """<link name="{name}"><inertial><mass value="2"/><origin xyz="0.1 0.2 0" rpy="{rpy}"/>
<inertia ixx="0.03" iyy="0.04" izz="0.05" ixy="0.01"/></inertial></link>"""


def robot_of(tmp_path: Path, *links: str) -> Path:
    file = tmp_path / "a.urdf"
    file.write_text(f'<robot name="r">{"".join(links)}</robot>')
    return file


@pytest.mark.parametrize(
    ("rpy", "tensor"),
    [
        ("0 0 0", [[0.03, 0.01, 0], [0.01, 0.04, 0], [0, 0, 0.05]]),
        # a quarter turn about z, and back: x and y change places, their product its sign
        ("0 0 1.5707963267948966", [[0.04, -0.01, 0], [-0.01, 0.03, 0], [0, 0, 0.05]]),
        ("0 0 -1.5707963267948966", [[0.04, -0.01, 0], [-0.01, 0.03, 0], [0, 0, 0.05]]),
        ("1.5707963267948966 0 0", [[0.03, 0, 0.01], [0, 0.05, 0], [0.01, 0, 0.04]]),
    ],
)
def test_a_link_is_a_body_in_its_own_axes(tmp_path: Path, rpy: str, tensor: list[list[float]]) -> None:
    robot = read_robot(robot_of(tmp_path, LINK.format(name="a", rpy=rpy)))
    body = link_body(robot.links["a"])
    assert body is not None
    assert body.mass == 2
    assert body.center.tolist() == [0.1, 0.2, 0.0]
    assert np.abs(body.inertia - tensor).max() < 1e-17


def test_links_without_an_inertia_have_no_body_and_no_check(tmp_path: Path) -> None:
    robot = read_robot(robot_of(tmp_path, '<link name="a"/>'))
    assert link_body(robot.links["a"]) is None
    assert check_robot_inertias(robot) == []


def test_each_link_has_its_check(tmp_path: Path) -> None:
    bad = LINK.format(name="b", rpy="0 0 0").replace("0.05", "0.5")
    robot = read_robot(robot_of(tmp_path, LINK.format(name="a", rpy="0 0 0"), bad, '<link name="c"/>'))
    assert [(c.link.name, c.valid, c.likely) for c in check_robot_inertias(robot)] == [
        ("a", True, None),
        ("b", False, "a slipped decimal in izz"),
    ]
    # by hand: the second moments of the slipped one, ½ tr(I) − izz < 0
    assert (0.03 + 0.04 + 0.5) / 2 - 0.5 < 0


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.urdf", "<robot/>", "<robot>: no link: expected one or more"),
        ("a.sdf", "<sdf/>", "<sdf>: no <model>"),
        (
            "a.xml",
            "<mechanism/>",
            r"found <mechanism>, expected <robot> \(URDF\), <sdf> \(SDF\), <mujoco> \(MJCF\)",
        ),
        ("a.urdf", "", "no valid XML"),
    ],
)
def test_what_is_no_robot_is_refused_in_one_line(tmp_path: Path, name: str, text: str, message: str) -> None:
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(DataError, match=message):
        read_robot(file)
    with pytest.raises(DataError, match=r"no\.urdf: No such file"):
        read_robot(tmp_path / "no.urdf")
