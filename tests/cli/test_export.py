"""`dalembert export`: what is written is read back by the program it is for, and says the same."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from cli.formats import read
from dalembert.errors import DataError
from tests.cli.exported import EXAMPLES, FILES, FOUR_BAR, MASSIVE, PLANETARY, exported, home, moved
from tests.conftest import Dalembert
from virtualwork import Mechanism
from virtualwork.exchange.description import described
from virtualwork.exchange.export import file_bytes
from virtualwork.exchange.settled import settle

ROBOTS = (".xml", ".urdf", ".sdf")
# inputs that no joint is: another joint is driven in their place, and it is said
ELSEWHERE = {"desk-lamp", "double-pendulum"}
RACKS = {"rack-lift", "doubling-rack"}
CAMS = {"cam-valve"}


def taken_back(data: bytes) -> Mechanism:
    _, (drawing,) = read("file", data, None)
    (part,) = settle(drawing)
    return Mechanism.from_toml_text(described(part, "test"))


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ROBOTS)
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.parent.name)
def test_every_example_comes_back_with_the_same_motion(file: Path, suffix: str) -> None:
    """Every named point of every link, over the input around the start, to 1e-13 of the mechanism's size."""
    if file.parent.name in ELSEWHERE and suffix != ".xml":
        pytest.skip("another joint is driven")
    if file.parent.name in RACKS and suffix == ".sdf":
        pytest.skip("the format has no rack: it is left out, and said")
    if file.parent.name in CAMS:
        pytest.skip("the formats have no cam: it is left out, and said")
    m = Mechanism.from_toml(file)
    back = taken_back(exported(m, suffix))
    order = [[e.name for e in back.inputs].index(e.name) for e in m.inputs]
    steps = np.linspace(-0.05, 0.05, 11)[:, None] * [m.size if e.is_slide else 2 * math.pi for e in m.inputs]
    there = np.empty_like(steps)
    there[:, order] = steps
    ours = moved(m, np.array(home(m)) + steps)
    theirs = moved(back, np.array([e.value for e in back.inputs]) + there)
    assert (ours.assembled == theirs.assembled).all()
    assert ours.assembled.any()
    for link in m.links.values():
        for point in link.points:
            gap = np.abs(ours.point(point).position - theirs.point(point).position)[ours.assembled]
            assert gap.max() <= 1e-13 * m.size, point
    for name, link in m.links.items():
        assert back.rigid[name].mass == pytest.approx(m.rigid[name].mass, rel=1e-15)
        if m.rigid[name].mass:
            assert back.rigid[name].inertia == pytest.approx(m.rigid[name].inertia, rel=1e-12, abs=1e-30)
        if suffix == ".xml":
            assert back.links[name].points == pytest.approx(link.points, abs=1e-15 * m.size)
    for e, j in zip(m.inputs, order, strict=True):
        assert (back.inputs[j].speed or 0.0) == pytest.approx(e.speed or 0.0, rel=1e-13)


@pytest.mark.parametrize("suffix", ROBOTS)
@pytest.mark.parametrize("name", MASSIVE)
def test_the_effort_comes_back(name: str, suffix: str) -> None:
    if name == "springs" and suffix != ".xml":
        pytest.skip("the format has no springs")
    m = Mechanism.from_toml_text(MASSIVE[name])
    back = taken_back(exported(m, suffix))
    q = np.linspace(0, 2 * math.pi, 25)
    speed = m.inputs[0].speed or 0.0
    ours, theirs = m.motion(q, speed).effort, back.motion(q, speed).effort
    if suffix == ".urdf":
        # the format has no gravity
        ours = Mechanism.from_toml_text(MASSIVE[name].replace("-9.81", "0")).motion(q, speed).effort
    # the piston's inertia is zero, and a robot's is not; it does not turn
    assert theirs == pytest.approx(ours, abs=1e-10 * np.abs(ours).max())


@pytest.mark.slow
@pytest.mark.parametrize(("suffix", "least"), [(".xml", 50), (".urdf", 50), (".sdf", 50)])
def test_mechanisms_of_any_topology_come_back(suffix: str, least: int) -> None:
    """A hundred with pins, slots, prisms and gears joined at random, to 1e-11 of their size.

    No case is one that is nearly singular, or of which a part stands still or moves on its own.
    """
    compared = sum(comes_back(seed, suffix) for seed in range(1, 101))
    assert compared >= least


def comes_back(seed: int, suffix: str) -> bool:
    """A drawn mechanism is exported, imported and compared; False where something is named that it lacks."""
    from benchmarks.stress.topologies import generate, regularity

    drawn = generate(seed)
    m = drawn.mechanism
    if regularity(drawn) < 1e-2 or not moved(m, np.array([m.at])).assembled.all():
        return False
    data, notes = file_bytes(m, m.at, suffix, "file.toml", {})
    _, (read_back,) = read("file", data, None)
    parts = settle(read_back)
    undriven = [note for note in notes if "no pin joins" in note and "instead" not in note]
    if undriven or len(parts) != 1 or set(parts[0].bodies) < {"ground", *m.links}:
        return False
    back = Mechanism.from_toml_text(described(parts[0], "test"))
    steps = np.linspace(-0.01, 0.01, 5)[:, None] * np.ones(len(m.at))
    ours = moved(m, np.array(m.at) + steps)
    there = []
    for e in back.inputs:
        if e.is_slide and e.name in [own.name for own in m.inputs]:
            way = steps[:, [own.name for own in m.inputs].index(e.name)]
        elif not e.is_slide and {str(e.link), e.on} <= {"ground", *m.links}:
            # whatever joint is driven: it turns as it does in the mechanism itself
            way = np.unwrap(turned(ours, str(e.link)) - turned(ours, e.on))
        else:
            return False
        there.append(e.value + way - way[2])
    theirs = moved(back, np.stack(there, axis=-1))
    for name, link in m.links.items():
        for point, z in link.points.items():
            # a link keeps its axes, but for URDF, where they begin at its joint
            if suffix == ".urdf" and point not in back.bodies[name]:
                continue
            gap = ours.at(name, point).position - theirs.at(name, point if suffix == ".urdf" else z).position
            assert np.abs(gap).max() <= 1e-11 * m.size, (seed, point)
    return True


def turned(motion: Any, body: str) -> Any:
    return 0.0 if body == "ground" else motion.link(body).angle


WHEEL = """
[ground]
O = [0, 0]
[links.wheel]
points = { O = [0, 0] }
inertia = 0.25
[input]
link = "wheel"
angle = 0
"""


@pytest.mark.whole
@pytest.mark.parametrize("suffix", ROBOTS)
def test_a_wheel_with_a_moment_of_inertia_and_no_mass_keeps_it(suffix: str) -> None:
    """Its effort is I·α."""
    back = taken_back(exported(Mechanism.from_toml_text(WHEEL), suffix))
    assert back.rigid["wheel"].mass == 0
    assert back.motion(0.0, 0.0, 8.0).effort[0] == pytest.approx(2.0, rel=1e-15)


def test_a_needle_of_a_millionth_keeps_its_mass_in_mjcf() -> None:
    """The least mass that MuJoCo is told lies below every one that is not zero, but not below its own."""
    text = """
[ground]
O = [0, 0]
[links.arm]
points = { O = [0, 0], A = [1, 0] }
mass = 1
inertia = 0.1
[links.needle]
points = { A = [0, 0], B = [0.1, 0] }
mass = %s
inertia = %s
[[input]]
link = "arm"
angle = 0
[[input]]
link = "needle"
angle = 0
"""
    m = Mechanism.from_toml_text(text % ("3e-9", "2e-12"))
    data, notes = file_bytes(m, (0.0, 0.0), ".xml", "f", {})
    back = taken_back(data).links["needle"]
    assert (back.mass, back.inertia) == (3e-9, pytest.approx(2e-12, rel=1e-14))
    assert notes == []
    m = Mechanism.from_toml_text(text % ("3e-9", "1e-17"))
    assert file_bytes(m, (0.0, 0.0), ".xml", "f", {})[1] == [
        "needle: MuJoCo raises a mass or a moment of inertia below 2e-15"
    ]


def test_mjcf_keeps_the_value_of_the_input() -> None:
    m = Mechanism.from_toml(EXAMPLES / "scissors-lift" / "lift.toml")
    back = taken_back(exported(m, ".xml"))
    assert [e.value for e in back.inputs] == pytest.approx(home(m), rel=1e-14)


# --- URDF and SDF by a reader of XML --------------------------------------------------------------------------------
def test_sdf_has_every_joint_where_both_links_have_it() -> None:
    m = Mechanism.from_toml_text(FOUR_BAR)
    root = ElementTree.fromstring(exported(m, ".sdf"))
    model = root.find("world/model")
    assert model is not None
    assert root.findtext("world/gravity") == "0.0 -9.81 0.0"
    joints = {e.get("name"): e for e in model.iter("joint")}
    assert len(joints) == 4
    ours = m.motion()
    for name, e in joints.items():
        link = model.find(f"link[@name='{e.findtext('child')}']")
        assert link is not None
        x, y, *_, turn = map(float, (link.findtext("pose") or "").split())
        u, v, *_ = map(float, (e.findtext("pose") or "").split())
        at = complex(x, y) + complex(u, v) * complex(math.cos(turn), math.sin(turn))
        expected = ours.point(str(name)[0]).position[0]
        assert (at.real, at.imag) == pytest.approx(tuple(expected), abs=1e-16)
    assert e.find("axis/limit/effort") is not None
    driven = [e.findtext("joint_name") for e in model.iter("plugin")]
    assert driven == ["A"]
    assert float(joints["A"].findtext("axis/limit/effort") or 0) == pytest.approx(
        np.abs(m.motion(np.linspace(0, 2 * math.pi, 721), 10 * math.pi).effort).max(), rel=1e-4
    )
    assert {e.findtext("axis/limit/effort") for n, e in joints.items() if n != "A"} == {"0.0"}


def test_urdf_is_a_tree_whose_loops_stand_in_gazebo() -> None:
    m = Mechanism.from_toml_text(FOUR_BAR)
    root = ElementTree.fromstring(exported(m, ".urdf"))
    children = [e.find("child").get("link") for e in root.findall("joint")]  # type: ignore[union-attr]
    assert sorted(children) == ["P", "coupler", "crank", "rocker"]
    (loop,) = root.findall("gazebo/joint")
    assert {loop.findtext("parent"), loop.findtext("child")} == {"coupler", "rocker"}


def test_gears_of_two_joints_are_mimicked_others_are_gearboxes() -> None:
    root = ElementTree.fromstring(exported(Mechanism.from_toml_text(PLANETARY), ".urdf"))
    assert len(list(root.iter("mimic"))) + len(root.findall("gazebo/joint[@type='gearbox']")) == 2
    sdf = ElementTree.fromstring(exported(Mechanism.from_toml_text(PLANETARY), ".sdf"))
    boxes = [e for e in sdf.iter("joint") if e.get("type") == "gearbox"]
    assert [float(e.findtext("gearbox_ratio") or 0) for e in boxes] == [2.0, -4.0]


@pytest.mark.parametrize("suffix", ROBOTS)
def test_a_joint_or_a_point_that_is_called_as_a_link_or_the_world_has_a_name_of_its_own(suffix: str) -> None:
    """SDF has one name for each of its links, joints and frames, and keeps `world` for itself."""
    text = FOUR_BAR.replace("crank", "B").replace("D = ", "world = ").replace("P = ", "rocker = ")
    m = Mechanism.from_toml_text(text)
    ours, theirs = m.motion(), taken_back(exported(m, suffix)).motion()
    names = {
        "C": "C",
        "B": "B 2",
        "world": "world 2",
        "rocker": "rocker_2" if suffix == ".xml" else "rocker point",
    }
    for point, name in names.items():
        assert theirs.point(name).position[0] == pytest.approx(ours.point(point).position[0], abs=1e-15)
    with pytest.raises(DataError, match="the link 'world' is called as the ground"):
        exported(Mechanism.from_toml_text(FOUR_BAR.replace("crank", "world")), suffix)


# --- what is said, and what is refused ----------------------------------------------------------------------------
def test_source_and_version_stand_in_every_robot(tmp_path: Path, dalembert: Dalembert) -> None:
    (tmp_path / "my--file.toml").write_text(FOUR_BAR)
    for suffix in ROBOTS:
        assert dalembert("export", "my--file.toml", "-o", f"m{suffix}").returncode == 0
        head = (tmp_path / f"m{suffix}").read_text().splitlines()[1]
        assert "from my- -file.toml by dalembert" in head
        assert "crank = 60 deg" in head


def test_what_a_format_cannot_hold_is_named(tmp_path: Path, dalembert: Dalembert) -> None:
    (tmp_path / "m.toml").write_text(
        FOUR_BAR.replace("mass = 0.5\n", "") + '[[springs]]\nbetween = ["P", "ground.D"]\nstiffness = 100\n'
    )
    said = dalembert("export", "m.toml", "-o", "m.urdf").stderr
    assert "springs are left out: 1" in said
    assert "gravity is left out" in said
    assert "without mass: rocker" in dalembert("export", "m.toml", "-o", "m.sdf").stderr


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (["m.toml", "-o", "m.step"], 2, "expected a name that ends in .dxf, .svg, .csv, .urdf, .sdf, .xml"),
        (["m.toml"], 2, "--output"),
        (["none.toml", "-o", "m.dxf"], 1, "none.toml"),
        (["m.toml", "-o", "m.xml", "--at", "north"], 2, "--at"),
        (["m.toml", "-o", "none/m.xml"], 1, "cannot write"),
        (["far.toml", "-o", "m.xml"], 1, "cannot be assembled"),
        (["broken.toml", "-o", "m.xml"], 1, "no valid TOML"),
    ],
)  # fmt: skip
def test_bad_calls(
    arguments: list[str], status: int, said: str, tmp_path: Path, dalembert: Dalembert
) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    (tmp_path / "far.toml").write_text(FOUR_BAR.replace("C = [110, 0]", "C = [400, 0]"))
    (tmp_path / "broken.toml").write_text("[ground\n")
    done = dalembert("export", *arguments)
    assert done.returncode == status, done.stderr
    assert said in done.stderr
    assert not list(tmp_path.glob("m.[!t]*"))


def test_an_input_is_never_written_over(tmp_path: Path, dalembert: Dalembert) -> None:
    (tmp_path / "m.xml").write_text(FOUR_BAR)
    assert dalembert("export", "m.xml", "-o", "m.xml").returncode == 2
    assert (tmp_path / "m.xml").read_text() == FOUR_BAR
