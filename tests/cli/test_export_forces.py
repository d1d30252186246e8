"""Robots written and read again: joint forces, racks on moving links, and what a format cannot hold."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from tests.cli.exported import MASSIVE, exported, home, moved
from tests.cli.imported import only
from tests.conftest import Dalembert
from virtualwork import Input, Link, Mechanism
from virtualwork.exchange.export import file_bytes

ROBOTS = (".xml", ".urdf", ".sdf")
# a bar slides on a rocker as the wheel on the rocker turns; its tip runs in a slot of the ground
RACK_ON_ROCKER = """
[ground]
O = [0, 0]
[links.rocker]
points = { O = [0, 0], C = [0.2, 0.1] }
mass = 1
center = [0.1, 0.02]
inertia = 0.01
[links.wheel]
points = { C = [0, 0], T = [0.05, 0] }
mass = 0.4
center = [0.01, 0]
inertia = 0.002
[links.bar]
points = { S = [0, 0], Q = [0.3, 0.05] }
mass = 0.7
center = [0.1, 0]
inertia = 0.005
[[sliders]]
point = "S"
link = "bar"
on = "rocker"
through = [0.1, 0.05]
[[slots]]
point = "Q"
link = "bar"
through = [0.4, 0]
angle = 1.2
[[racks]]
gear = "wheel"
slider = "S"
radius = 0.05
[input]
link = "wheel"
angle = 0.1
[guess]
at = 0.1
rocker = 0.1
bar = 0.1
S = [0.1, 0.06]
"""
# a plate slides on the shoe of a pin of two links, and drives a rack
PLATE = """
[ground]
O = [0, 0]
[links.arm]
points = { O = [0, 0], P = [0.2, 0] }
[links.rod]
points = { P = [0, 0], T = [0.1, 0] }
[links.plate]
points = { E = [0.3, 0] }
[links.bar]
points = { R = [0, 0] }
[[slots]]
point = "P"
link = "arm"
on = "plate"
[[sliders]]
point = "R"
link = "bar"
through = [0, -0.1]
[[racks]]
gear = "plate"
slider = "R"
radius = 0.1
[[input]]
link = "arm"
[[input]]
link = "rod"
[[input]]
link = "plate"
[[input]]
slider = "P"
[guess]
at = [0.2, 0.1, 0.3, 0.1]
R = [0, -0.1]
"""
# the rack's wheel turns on an arm: its angle against the ground is that of two joints
ROLLING = """
[ground]
O = [0, 0]
[links.arm]
points = { O = [0, 0], C = [0.2, 0] }
[links.wheel]
points = { C = [0, 0], T = [0.05, 0] }
[links.bar]
points = { R = [0, 0] }
[[sliders]]
point = "R"
link = "bar"
through = [0, -0.1]
[[racks]]
gear = "wheel"
slider = "R"
radius = 0.1
[[input]]
link = "arm"
[[input]]
link = "wheel"
on = "arm"
[guess]
at = [0.2, 0.3]
R = [0, -0.1]
"""
# two bars and the ground pinned in a triangle
TRIANGLE = """<sdf version="1.9"><model name="triangle">
<link name="base"/><link name="a"/><link name="b"/>
<joint name="A" type="revolute"><parent>base</parent><child>a</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="B" type="revolute"><pose>1 0 0 0 0 0</pose><parent>base</parent><child>b</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="C" type="revolute"><pose>0 1 0 0 0 0</pose><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""


def without_gravity(m: Mechanism) -> Mechanism:
    return Mechanism(**{f.name: getattr(m, f.name) for f in fields(m)} | {"gravity": 0j})


def joint_forces(motion: Any, m: Mechanism) -> dict[tuple[str, str], Any]:
    """The force at each pin of two bodies and at each guide, on a link that it holds."""
    held = {point: bodies for point, bodies in m.pins.items() if len(bodies) == 2}
    held |= {g.point: (g.link, g.on) for g in m.guides if g.point not in m.pins}
    on = {point: next(body for body in bodies if body != "ground") for point, bodies in held.items()}
    return {(point, body): motion.reaction(point, body) for point, body in on.items()}


def same_forces(m: Mechanism, suffix: str, speed: float, acceleration: float) -> int:
    """Compare the forces at every joint with those of the mechanism read again; return how many there are."""
    back = only(exported(m, suffix))
    ours = without_gravity(m) if suffix == ".urdf" else m
    steps = np.linspace(-0.3, 0.3, 7)
    here = ours.motion(home(m)[0] + steps, speed, acceleration)
    there = back.motion(home(back)[0] + steps, speed, acceleration)
    assert here.assembled.all()
    theirs = joint_forces(there, back)
    largest = max(float(np.abs(force).max()) for force in joint_forces(here, ours).values())
    for (point, on), force in joint_forces(here, ours).items():
        assert theirs[point, on] == pytest.approx(force, abs=1e-9 * largest), (point, on)
    return len(theirs)


@pytest.mark.parametrize("suffix", ROBOTS)
@pytest.mark.parametrize("name", MASSIVE)
def test_joint_forces_come_back(name: str, suffix: str) -> None:
    if name == "springs" and suffix != ".xml":
        pytest.skip("the format has no springs")
    assert same_forces(Mechanism.from_toml_text(MASSIVE[name]), suffix, 20.0, -30.0) >= 1


def test_a_rack_stays_on_the_link_that_carries_its_wheel() -> None:
    """The tree of MJCF hangs the rocker on the bar: the line of the slide is the rocker's still."""
    m = Mechanism.from_toml_text(RACK_ON_ROCKER)
    (guide,) = (g for g in only(exported(m, ".xml")).guides if g.point == "S")
    assert (guide.link, guide.on) == ("bar", "rocker")
    assert same_forces(m, ".xml", 2.0, 5.0) == 4


def test_a_rack_is_driven_by_the_link_and_not_by_its_massless_shoe() -> None:
    back = only(exported(Mechanism.from_toml_text(PLATE), ".xml"))
    assert [rack.gear for rack in back.racks] == ["plate"]


def test_urdf_names_the_racks_that_it_leaves_out() -> None:
    m = Mechanism.from_toml_text(ROLLING)
    notes = file_bytes(m, home(m), ".urdf", "file.toml", {})[1]
    assert notes == ["racks are left out: 1: <mimic> ties one joint to one other"]
    assert file_bytes(m, home(m), ".xml", "file.toml", {})[1] == [
        "without mass: arm, wheel, bar: the format requires a mass: a millionth of the heaviest is written"
    ]


@pytest.mark.whole
@pytest.mark.parametrize(("seed", "toothed"), [(15, True), (22, True), (254, False)])
def test_a_pose_that_angles_alone_do_not_choose_comes_back(seed: int, toothed: bool) -> None:
    """The guess names every joint where Newton's method goes elsewhere from angles alone, and gears count its whole turns."""
    from benchmarks.stress.topologies import generate

    m = generate(seed, toothed).mechanism
    back = only(exported(m, ".xml"))
    ours, theirs = moved(m, np.array([home(m)])), moved(back, np.array([home(back)]))
    for name, link in m.links.items():
        for z in link.points.values():
            gap = np.abs(ours.at(name, z).position - theirs.at(name, z).position)
            assert gap.max() <= 1e-12 * m.size


def test_a_robot_that_cannot_move_is_refused_in_one_line(dalembert: Dalembert, tmp_path: Any) -> None:
    (tmp_path / "triangle.sdf").write_text(TRIANGLE)
    done = dalembert("import", "triangle.sdf", "-o", "m.toml")
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert (
        "no mechanism: nothing in it is driven by an input: give it an actuator on a joint that can move"
        in line
    )
    assert "a, b: left out: no joint there can move" in line
    assert not (tmp_path / "m.toml").exists()


WINCH = """
[ground]
O = [0, 0]
[links.arm]
points = { O = [0, 0], C = [1, 0] }
mass = 1
[links.drum]
points = { C = [0, 0] }
mass = 2
[[input]]
link = "arm"
speed = 2
acceleration = 3
[[input]]
link = "drum"
jerk = 1
acceleration = 4
[[motors]]
carrier = "arm"
drives = "drum"
mass = 0.5
[[friction]]
joint = "O"
coefficient = 0.1
radius = 0.01
"""


@pytest.mark.whole
@pytest.mark.parametrize("suffix", ROBOTS)
def test_what_a_robot_cannot_hold_is_named(suffix: str) -> None:
    m = Mechanism.from_toml_text(WINCH)
    notes = file_bytes(m, home(m), suffix, "file.toml", {})[1]
    assert notes[0] == "friction is left out: 1"
    assert "acceleration of input arm is left out: the format has its speed alone" in notes
    assert "acceleration and jerk of input drum are left out: the format has its speed alone" in notes
    assert "the motor of input drum is left out: it sits on arm, and drives against ground" in notes


DOOR = """
[ground]
O = [0, 0]
[links.door]
points = { O = [0, 0], E = [1, 0] }
mass = 1
[[torsion_springs]]
links = ["ground", "door"]
stiffness = 2
free_angle = 3
[input]
link = "door"
angle = 4
"""


@pytest.mark.parametrize("angle", [4, 2, -9])
def test_a_torsion_spring_counts_the_whole_turns_of_its_input(angle: int) -> None:
    m = Mechanism.from_toml_text(DOOR.replace("angle = 4", f"angle = {angle}"))
    back = only(exported(m, ".xml"))
    assert home(back) == pytest.approx(home(m), rel=1e-15)
    steps = np.linspace(-1, 1, 5)
    ours, theirs = m.motion(angle + steps).effort, back.motion(angle + steps).effort
    assert theirs == pytest.approx(ours, rel=1e-12)


GEARED = """
[ground]
A = [0, 0]
D = [1, 0]
W = [2, 0]
[links.crank]
points = { A = [0, 0], B = [0.4, 0] }
[links.coupler]
points = { B = [0, 0], C = [1.1, 0] }
[links.rocker]
points = { D = [0, 0], C = [0.8, 0] }
[links.wheel]
points = { W = [0, 0] }
[[gears]]
links = ["rocker", "wheel"]
ratio = 300
[[torsion_springs]]
links = ["ground", "wheel"]
stiffness = 2
[input]
link = "crank"
angle = "300 deg"
[guess]
at = "60 deg"
coupler = "20 deg"
rocker = "90 deg"
"""


@pytest.mark.parametrize("ratio", [3, 0.1, -3, 300, -1000])
def test_a_torsion_spring_behind_a_fast_gear_is_wound_by_all_its_turns(ratio: float) -> None:
    """By the rocker's own turn from the guess, in steps of a thousandth of a degree."""
    m = Mechanism.from_toml_text(GEARED.replace("ratio = 300", f"ratio = {ratio}"))
    written = ET.fromstring(file_bytes(m, home(m), ".xml", "file.toml", {})[0])
    (tendon,) = (e for e in written.iter("fixed") if e.get("springlength"))
    rocker = m.motion(np.radians(np.linspace(60, 300, 240_001))).link("rocker").angle
    wound = ratio * (np.unwrap(rocker)[-1] - rocker[0])
    # the coordinate of the tree is 0 in the start pose
    assert float(tendon.get("springlength", "")) == pytest.approx(-wound, rel=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_the_greatest_effort_is_that_between_the_samples_too(sign: int) -> None:
    """Of a crank with a weight the effort is m·g·r·|sin|, at its largest for 90° and 270°."""
    crank = Mechanism(
        {"O": 0j},
        {"crank": Link({"O": 0j}, mass=2.0, center=complex(0.3, 0.07))},
        inputs=Input(link="crank", value=0.123, speed=5.0 * sign),
        gravity=complex(0, -9.81),
    )
    written = ET.fromstring(file_bytes(crank, home(crank), ".xml", "file.toml", {})[0])
    low, high = map(float, next(written.iter("motor")).get("ctrlrange", "").split())
    assert (-low, high) == pytest.approx((2 * 9.81 * abs(complex(0.3, 0.07)),) * 2, rel=1e-14)
