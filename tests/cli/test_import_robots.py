"""`dalembert import` of planar robots: URDF, SDF and MJCF as others write them, and what is refused of them."""

from __future__ import annotations

import math
import random
import re
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from cli.formats import read
from dalembert.errors import DataError
from tests.cli.robots import LOOPS, MJCF, SDF, URDF, refused, taken
from tests.conftest import Dalembert
from virtualwork import Mechanism
from virtualwork.exchange.description import described
from virtualwork.exchange.settled import settle


def test_an_sdf_model_stands_where_its_poses_say() -> None:
    m, notes = taken(SDF)
    assert set(m.links) == {"AB", "BC", "CD"}
    motion = m.motion()
    places = {"A": (0, 0), "B": (0, 0.2), "C": (0.3, 0.2), "D": (0.32, 0), "P": (0.1, 0.25)}
    for point, at in places.items():
        assert motion.point(point).position[0] == pytest.approx(at, abs=1e-15)
    assert m.rigid["AB"].mass == 2
    assert m.rigid["AB"].inertia == 0.011
    assert any("no actuator: A is taken as the input" in note for note in notes)
    turned = m.motion(0.3).point("C").position[0]
    assert math.dist(turned, (0.32, 0)) == pytest.approx(math.hypot(0.02, 0.2), rel=1e-14)


@pytest.mark.parametrize("loop", LOOPS)
def test_a_urdf_loop_is_closed_in_each_of_its_notations(loop: str) -> None:
    m, notes = taken(URDF.format(loop=LOOPS[loop]))
    motion = m.motion()
    # the plane is x-z
    for point, at in {"B": (0, 0.7), "C": (0.3, 0.7), "D": (0.32, 0.5), "tip": (0.1, 0.75)}.items():
        assert motion.point(point).position[0] == pytest.approx(at, abs=1e-14), point
    assert m.inputs[0].link == "crank"
    assert not any("actuator" in note for note in notes)
    turned = m.motion(0.2).point("C").position[0]
    assert math.dist(turned, (0.32, 0.5)) == pytest.approx(math.hypot(0.02, 0.2), rel=1e-13)


@pytest.mark.parametrize(("axes", "plane"), [(["1 0 0"], "xy"), (["0 0 1"], "xz"), (["0 3 4"], "yz"), (["1 0 2", "2 0 4", "1 0 0"], "xz")])  # fmt: skip
def test_a_robot_of_slides_alone_lies_in_a_plane_of_the_world_where_it_can(
    axes: list[str], plane: str
) -> None:
    bodies = "".join(
        f'<body name="b{k}"><joint name="s{k}" type="slide" axis="{axis}"/><geom size=".1"/>'
        for k, axis in enumerate(axes)
    ) + "</body>" * len(axes)
    drives = "".join(f'<motor joint="s{k}"/>' for k in range(len(axes)))
    m, _ = taken(f"<mujoco><worldbody>{bodies}</worldbody><actuator>{drives}</actuator></mujoco>")
    way = np.array(axes[0].split(), dtype=float)
    along = complex(*(way["xyz".index(axis)] for axis in plane))
    assert np.exp(1j * m.guides[0].angle) == pytest.approx(along / abs(along), abs=1e-15)


@pytest.mark.parametrize("seed", range(4))
def test_damage_anywhere_is_a_message_or_a_mechanism(seed: int) -> None:
    """Words of a file exchanged, taken out or doubled: never anything but a DataError."""
    draw = random.Random(seed)
    words = [
        "0",
        "-1",
        "1e300",
        "nan",
        "inf",
        "",
        "1 2",
        "world",
        "fixed",
        "ball",
        "slide",
        "<",
        "crank",
        "A",
    ]
    for _ in range(60):
        text = draw.choice([SDF, MJCF, *(URDF.format(loop=loop) for loop in LOOPS.values())])
        for _ in range(draw.randint(1, 3)):
            pattern = draw.choice([r'"[^"]*"', r">[^<>]+<", r"-?\d+\.?\d*", r" \w+=\"[^\"]*\"", r"<[^<>]*/>"])
            spans = [found.span() for found in re.finditer(pattern, text)]
            if spans:
                a, b = draw.choice(spans)
                inside = 1 if pattern[0] in '">' else 0
                word = draw.choice([*words, text[a + inside : b - inside] * 2])
                text = text[: a + inside] + word + text[b - inside :]
        with suppress(DataError):
            for d in read("file", text.encode(), None)[1]:
                for part in settle(d):
                    described(part, "test")


def test_poses_of_sdf_relative_to_frames_links_and_in_degrees() -> None:
    text = SDF.replace(
        '<link name="BC"><pose>0 0.2 0 0 0 0</pose></link>',
        '<frame name="F"><pose degrees="true">0 0 0 0 0 90</pose></frame>'
        '<link name="BC"><pose relative_to="F">0.2 0 0 0 0 -1.5707963267948966</pose></link>',
    ).replace('version="1.6"', 'version="1.9"')
    m, _ = taken(text)
    assert m.motion().point("B").position[0] == pytest.approx((0, 0.2), abs=1e-15)
    assert "relative to itself" in refused(
        text.replace('<frame name="F"><pose degrees="true">', '<frame name="F"><pose relative_to="BC">')
    )


def test_the_model_of_a_world_with_a_floor_is_the_one_that_has_joints() -> None:
    floor = '<model name="floor"><static>true</static><link name="link"/></model>'
    model = SDF[SDF.index("<model") : SDF.index("</sdf>")]
    m, notes = taken(f'<sdf version="1.6"><world name="w">{floor}{model}</world></sdf>')
    assert m.name == "four bar"
    assert "models left out: floor" in notes


def test_joints_of_sdf_between_frames_are_those_of_the_links_that_hold_the_frames() -> None:
    frames = (
        '<frame name="W" attached_to="world"/><frame name="E" attached_to="BC"><pose>0.3 0 0 0 0 0</pose></frame>'
        '<frame name="F" attached_to="CD"/><frame name="G" attached_to="F"/><frame name="H" attached_to="H"/>'
    )
    text = SDF.replace('<joint name="A"', f'{frames}<joint name="A"', 1)
    text = text.replace("<parent>world</parent><child>AB", "<parent>W</parent><child>AB")
    between = "<parent>BC</parent><child>CD</child>"
    m, _ = taken(text.replace(between, "<parent>E</parent><child>G</child>").replace('attached_to="H"', ""))
    ours, theirs = m.motion(0.3), taken(SDF)[0].motion(0.3)
    for point in "ABCDP":
        assert ours.point(point).position[0] == pytest.approx(theirs.point(point).position[0], abs=1e-15)
    assert "'H' is attached to itself" in refused(text)


def test_a_robot_whose_loop_is_open_as_it_stands_is_assembled_and_said() -> None:
    m, notes = taken(URDF.format(loop=LOOPS["loop_joint"].replace("-0.02 0 0.2", "0 0 0.25")))
    assert any("joint C is 0.0539 m open as the file stands" in note for note in notes)
    (at,) = m.motion().point("C").position
    assert math.dist(at, (0.32, 0.5)) == pytest.approx(0.25, rel=1e-12)


def test_mimicked_joints_are_gears() -> None:
    text = """<robot name="g"><link name="base"/><link name="a"/><link name="b"/>
<joint name="one" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/></joint>
<joint name="two" type="continuous"><parent link="base"/><child link="b"/><origin xyz="1 0 0"/><axis xyz="0 0 -1"/>
<mimic joint="one" multiplier="2.5"/></joint></robot>"""
    m, _ = taken(text)
    assert m.motion(0.1, speed=2.0).link("b").omega[0] == pytest.approx(-5.0)


def test_weight_that_does_not_act_in_mjcf_and_positions_that_sdf_starts_from_are_heard() -> None:
    assert taken(MJCF)[0].gravity == pytest.approx(-9.81j)
    still = MJCF.replace("<worldbody>", '<option><flag gravity="disable"/></option><worldbody>')
    assert taken(still)[0].gravity == 0
    held = MJCF.replace('name="rod"', 'name="rod" gravcomp="1"')
    assert "body 'rod': its gravcomp is left out: its whole weight acts" in taken(held)[1]
    moved = SDF.replace("<axis>", "<axis><initial_position>0.3</initial_position>", 1)
    assert "joint 'A': its initial_position is left out: the pose is that of coordinate 0" in taken(moved)[1]


@pytest.mark.parametrize(
    ("text", "old", "new", "note"),
    [
        (SDF, "<mass>2</mass>", "<masss>2</masss>", "<masss> in <inertial>: left out: it is not read"),
        (SDF, "<inertial>", '<inertial auto="true">', "link 'AB': the mass and inertia of its shapes are not imported (auto)"),
        (SDF, "<inertial>", '<inertial><pose frame="A">0 0 0 0 0 0</pose>', "pose: its attribute frame (A) is left out"),
        (SDF, "<model name=", '<model placement_frame="A" name=', "model: placement_frame='A' is left out: the model stands elsewhere"),
        (SDF, "<link name=", "<include/><link name=", "<include> in the model: left out"),
        (SDF, "</model>", "</model><model_2/>", "<model_2> in <sdf>: left out: it is not read"),
        (SDF, '<link name="AB">', '<link name="AB"><gravity>0</gravity>', "link 'AB': its <gravity> is left out: its whole weight acts"),
        (URDF.format(loop=""), '<link name="tip"/>', '<link name="tip"><inertia1/></link>', "<inertia1> in <link>: left out: it is not read"),
        (URDF.format(loop=""), "</robot>", "<gazebo><springStiffness>3</springStiffness></gazebo></robot>", "<springStiffness> in <gazebo>: left out"),
        (MJCF, "<actuator>", "<tendons/><actuator>", "<tendons> in <mujoco>: left out: it is not read"),
        (MJCF, "<actuator>", '<tendon><fixed name="t" range="0 1"><joint joint="hip" coef="1"/></fixed></tendon><actuator>', "tendon 't': its limits are left out"),
        (MJCF, "<actuator>", '<keyframe><key qvel="1 2"/></keyframe><actuator>', "key, qvel: left out: found 2 speeds, expected"),
    ],
)  # fmt: skip
def test_what_is_not_read_is_named(text: str, old: str, new: str, note: str) -> None:
    assert old in text
    new = (
        text.replace(old, new).replace("</inertial>", "</inertia1>")
        if "inertia1" in new
        else text.replace(old, new)
    )
    assert any(note in each for each in taken(new)[1])


@pytest.mark.parametrize("text", [SDF, URDF.format(loop=LOOPS["gazebo"]), MJCF], ids=["sdf", "urdf", "mjcf"])
def test_name_spaces_and_encodings_change_nothing(text: str) -> None:
    ours = text.replace("crank", "Kürbel").replace("AB", "Kürbel")
    root = re.search("<(robot|sdf|mujoco) ", ours)
    assert root is not None
    spaced = ours.replace(root[0], f'{root[0]}xmlns="http://example.org" ')
    expected = taken(ours)
    for data in (
        spaced.encode(),
        ours.encode("cp1252"),
        ours.encode("utf-16"),
        ours.encode("utf-8-sig"),
        ours.replace(root[0], f"<!-- {root[0]}> -->\n{root[0]}").encode(),
    ):
        _, (drawing,) = read("file", data, None)
        (part,) = settle(drawing)
        assert (Mechanism.from_toml_text(described(part, "test")), drawing.notes + part.notes) == expected


def test_axes_rounded_to_a_few_digits_are_planar_and_said() -> None:
    m, notes = taken(URDF.format(loop=LOOPS["gazebo"]).replace(
        '<axis xyz="0 1 0"/>\n  <origin xyz="0 0 0.2"/>', '<axis xyz="0 0 1"/>\n  <origin xyz="0 0 0.2" rpy="-1.5708 0 0"/>'
    ).replace("</link>", "</link>"))  # fmt: skip
    assert any("axes are off by up to 0.00021 deg" in note for note in notes)
    assert m.links


# --- what is refused -----------------------------------------------------------------------------------------------


def test_a_spatial_robot_is_refused_with_its_joint_and_by_how_much() -> None:
    tilted = URDF.format(loop=LOOPS["gazebo"]).replace(
        '<child link="rocker"/><axis xyz="0 1 0"/>', '<child link="rocker"/><axis xyz="0 1 0.1"/>'
    )
    assert refused(tilted) == (
        "file: no planar mechanism: joint 'D': its axis stands 5.711 deg off the normal of the plane of the others"
    )
    lifted = MJCF.replace('type="slide" axis="1 0 0"', 'type="slide" axis="1 0.02 0"')
    assert "joint 'bore': its slide leaves the plane by 1.146 deg" in refused(lifted)
    floating = SDF.replace('name="C" type="revolute"', 'name="C" type="universal"')
    assert "joint 'C' is of the type 'universal'" in refused(floating)


BOMB = """<?xml version="1.0"?>
<!DOCTYPE lolz [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>
<{root} name="&b;"><link name="x"/></{root}>"""


OUTSIDE = '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><{root} name="&x;"/>'


@pytest.mark.parametrize("root", ["robot", "sdf", "mujoco"])
@pytest.mark.parametrize("text", [BOMB, OUTSIDE, "<!DOCTYPE {root} SYSTEM 'http://x/y.dtd'><{root}/>"])
def test_bombs_and_entities_are_refused(text: str, root: str) -> None:
    assert refused(text.format(root=root)) == "file: declarations and entities of XML are refused"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<robot name='r'><link name='a'>", "line 1, column 32: no valid XML (no element found); is the file cut off?"),
        ("<robot>\n<link name='a'></robot>", "line 2, column 18: no valid XML (mismatched tag)"),
        ("<robot/>", "<robot>: no link"),
        ("<robot><link/></robot>", "a <link> has no 'name'"),
        ("<robot><link name='a'/><link name='a'/></robot>", "two links are called 'a'"),
        ("<robot><link name='a'/></robot>", "nothing in it moves"),
        ("<robot><link name='a'/><joint name='j' type='revolute'><parent link='a'/></joint></robot>", "joint 'j': <child link=…> is missing"),
        ("<robot><link name='a'/><joint name='j' type='revolute'><parent link='b'/><child link='a'/></joint></robot>", "joint 'j': no link is called 'b': expected one of a"),
        (URDF.format(loop="").replace('xyz="0 0 0.2"', 'xyz="0 0 ${2*0.1}"'), "joint 'B', origin xyz: found '${2*0.1}', expected a finite number"),
        (URDF.format(loop="").replace('xyz="0 0 0.2"', 'xyz="0 0 nan"'), "joint 'B', origin xyz: found 'nan', expected a finite number"),
        (URDF.format(loop="").replace('xyz="0 0 0.2"', 'xyz="0 0.2"'), "joint 'B', origin xyz: found '0 0.2', expected 3 numbers"),
        (URDF.format(loop="").replace('xyz="0 -1 0"', 'xyz="0 0 0"'), "joint 'A', axis: found '0 0 0', expected a direction"),
        (URDF.format(loop='<joint name="X" type="fixed"><parent link="rocker"/><child link="base"/></joint>'), "every link is the child of a joint"),
        ("<sdf version='1.9'/>", "<sdf>: no <model>"),
        (SDF.replace("<parent>AB</parent>", ""), "joint 'B': <parent> is missing"),
        (SDF.replace("<pose>0 0.2 0 0 0 0</pose>", "<pose>0 0.2 0</pose>"), "link 'BC', pose: found '0 0.2 0', expected 6 numbers"),
        (SDF.replace("<mass>2</mass>", "<mass>-2</mass>"), "link 'AB', mass: found -2, expected one of zero or more"),
        (MJCF.replace('class="rail"/></body>', 'class="none"/></body>'), "no default class is called 'none'"),
        (MJCF.replace('body2="piston"', 'body2="none"'), "no link is called 'none'"),
        (MJCF.replace('joint="hip"', 'joint="none"'), "no joint is called 'none'"),
        (MJCF.replace('euler="0 20 0"', 'quat="0 0 0 0"'), "body 'rod': found '0 0 0 0', expected a quaternion"),
        ("<mujoco>" + "<frame>" * 200 + "</frame>" * 200 + "</mujoco>", "nested more than 100 deep"),
        (MJCF.replace("<actuator>", '<tendon><fixed name="t" stiffness="3" springlength=""/></tendon><actuator>', 1), "tendon 't', springlength: found '', expected 1 or 2 numbers"),
        ("<robot name='r'><link name='a'><visual><geometry><cylinder radius='1 2' length='1'/></geometry></visual></link></robot>", "link 'a', radius: found '1 2', expected 1 number"),
        (MJCF.replace("<actuator>", '<tendon><spatial class="none" stiffness="3"/></tendon><actuator>', 1), "<spatial>: no default class is called 'none'"),
        (MJCF.replace("<actuator>", '<tendon><fixed class="none"/></tendon><actuator>', 1), "<fixed>: no default class is called 'none'"),
        ('<mujoco><worldbody><body name="a"><joint name="j"/><geom size=".1" mass="-2"/></body></worldbody></mujoco>', "body 'a', geom mass: found '-2', expected one of zero or more"),
        ("<html/>", "unknown format: expected pmks-text"),
    ],
)  # fmt: skip
def test_damaged_robots_are_refused_with_their_place(text: str, said: str) -> None:
    assert said in refused(text)


@pytest.mark.parametrize("text", [SDF, URDF.format(loop=LOOPS["gazebo"]), MJCF], ids=["sdf", "urdf", "mjcf"])
def test_a_robot_cut_off_anywhere_is_refused(text: str) -> None:
    for end in range(20, len(text) - 8, 37):
        assert "file" in refused(text[:end])


def test_a_large_robot_is_refused(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "big.urdf").write_bytes(b"<robot>" + b" " * 10_000_001)
    for arguments in (("import", "big.urdf"), ("body", "big.urdf", "--check-inertias")):
        done = dalembert(*arguments)
        assert done.returncode == 1
        assert "expected at most 10000000 (10 MB)" in done.stderr


def test_the_command_tells_the_format_or_takes_its_name(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "robot.txt").write_text(SDF)
    done = dalembert("import", "robot.txt", "-o", "m.toml")
    assert done.returncode == 0, done.stderr
    assert Mechanism.from_toml(tmp_path / "m.toml").name == "four bar"
    assert dalembert("import", "robot.txt", "--from", "sdf").returncode == 0
    assert dalembert("import", "-", stdin=SDF).returncode == 0
    done = dalembert("import", "robot.txt", "--from", "linkage")
    assert done.returncode == 1
