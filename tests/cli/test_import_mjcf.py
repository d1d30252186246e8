"""`dalembert import` of MJCF: what its defaults, shapes, equalities and compiler mean."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tests.cli.robots import MJCF, refused, taken


def test_an_mjcf_slider_crank_with_classes_and_degrees() -> None:
    m, notes = taken(MJCF)
    assert m.guides[0].is_slider
    assert m.gravity == pytest.approx(-9.81j)
    assert m.rigid["crank"].inertia == 2e-4
    # a joint about +y turns clockwise in the plane x-z
    assert m.inputs[0].speed == pytest.approx(-3.0)
    motion = m.motion()
    along = math.cos(math.radians(20))
    assert motion.point("mid").position[0] == pytest.approx(
        (0.1 + 0.15 * along, 1 - 0.15 * math.sin(math.radians(20)))
    )
    q = 0.4
    x = 0.1 * math.cos(q) + math.sqrt(0.09 - (0.1 * math.sin(q) + 0.3 * math.sin(math.radians(20))) ** 2)
    assert m.motion(q).link("rod").angle[0] < 0
    piston = m.motion(q).point("connect 1").position[0]
    assert piston == pytest.approx((x, 1 - 0.3 * math.sin(math.radians(20))), rel=1e-12)
    # the joint's damper, N·m·s/rad, holds against 3 rad/s
    assert m.torsion_springs[0].damping == 1
    assert not notes


def test_springs_of_mjcf_ask_for_mujocos_effort() -> None:
    """A joint's spring in degrees, a tendon between two sites, one on a joint: statics against MuJoCo's own forces."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo reads its own format: pip install mujoco")
    text = """<mujoco><option gravity="0 0 0"/><compiler angle="degree"/><worldbody><site name="s" pos="0.3 0.4 0"/>
<body name="arm" euler="0 0 30"><joint name="hip" axis="0 0 -1" stiffness="2" springref="20"/><geom size=".1" mass="0"/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><site name="t" pos="0.2 0 0"/></body></worldbody>
<tendon><spatial name="a" stiffness="30" springlength="0.1"><site site="s"/><site site="t"/></spatial>
<fixed name="b" stiffness="3" springlength="0.2"><joint joint="hip" coef="2"/></fixed></tendon></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    state = mujoco.MjData(model)
    m, _ = taken(text)
    for q in (0.0, 0.4, -0.7):
        state.qpos[0] = q
        mujoco.mj_inverse(model, state)
        assert m.motion(math.radians(30) - q).effort == pytest.approx([-state.qfrc_inverse[0]], rel=1e-12)


def test_mujoco_agrees_with_what_is_read_of_poses() -> None:
    """Every way to write an orientation, nested frames and defaults, against MuJoCo's own reader."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo reads its own format: pip install mujoco")
    from rigidbody3d.robots.reading import read as read_robot

    text = """<mujoco><compiler angle="degree" eulerseq="zyX"/>
<default><default class="s"><site pos="0 0 0.1"/></default></default><worldbody>
<body name="a" pos="1 2 3" euler="10 20 30"><joint axis="1 2 3" pos=".1 .2 .3"/><geom size=".1"/>
 <frame pos="0 1 0" axisangle="0 1 1 40"><body name="b" quat="1 2 3 4" childclass="s"><joint type="slide"/><geom size=".1"/>
  <site name="p"/><frame zaxis="1 1 -1"><site name="q" pos="1 0 0"/></frame>
  <body name="c" xyaxes="1 1 0 0 1 1"><geom size=".1"/><body name="d" zaxis="0 0 -1"><geom size=".1"/>
   <frame pos="1 0 2" euler="0 0 30"><joint name="last" axis="1 0 1" pos=".1 0 0"/></frame></body></body></body></frame>
</body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    state = mujoco.MjData(model)
    mujoco.mj_forward(model, state)
    robot = read_robot("file", text.encode(), None)
    for name in "abcd":
        assert robot.links[name].pose[:3, 3] == pytest.approx(state.body(name).xpos, abs=1e-14)
        assert robot.links[name].pose[:3, :3] == pytest.approx(state.body(name).xmat.reshape(3, 3), abs=1e-14)
    for name, link in (("p", "b"), ("q", "b")):
        at = robot.links[link].pose @ np.append(robot.links[link].points[name], 1)
        assert at[:3] == pytest.approx(state.site(name).xpos, abs=1e-14)
    joints = list(robot.joints.values())
    for k in (0, -1):
        assert joints[k].axis == pytest.approx(state.xaxis[k], abs=1e-14)
        assert joints[k].ends[1] == pytest.approx(state.xanchor[k], abs=1e-14)


def test_springs_of_a_chain_count_the_whole_turns_of_both_inputs() -> None:
    """Two arms about −y, the first turned by more than half a turn: its spring is wound by what MuJoCo has."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo reads its own format: pip install mujoco")
    text = """<mujoco><compiler angle="degree"/><default><geom contype="0" conaffinity="0"/></default><worldbody>
<body name="a" euler="0 -160 0"><joint name="one" axis="0 1 0" stiffness="5" springref="40"/><geom size=".1" pos=".3 0 0"/>
<body name="b" pos="1 0 0" euler="0 -130 0"><joint name="two" axis="0 1 0" ref="-20"/><geom size=".1" pos=".3 0 0"/></body></body>
</worldbody><actuator><motor joint="one"/><motor joint="two"/></actuator></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    state = mujoco.MjData(model)
    mujoco.mj_inverse(model, state)
    m, _ = taken(text)
    effort = m.motion([[e.value for e in m.inputs]], [[0.0, 0.0]], [[0.0, 0.0]]).effort[0]
    assert np.abs(effort) == pytest.approx(np.abs(state.qfrc_inverse), rel=1e-12)


@pytest.mark.parametrize("total", [-1, 14])
def test_masses_that_follow_from_shapes_are_mujocos(total: int) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo reads its own format: pip install mujoco")
    from rigidbody3d.robots.reading import read as read_robot

    shapes = [
        '<geom size=".1"/>',
        '<geom type="capsule" size=".02" fromto="0 0 0 .1 .2 .3"/>',
        '<geom type="capsule" size=".02 .3" pos="1 0 0" euler="10 20 30"/>',
        '<geom type="cylinder" size=".05 .2" mass="3"/>',
        '<geom type="box" size=".1 .2 .3" density="10" quat="1 2 3 4"/>',
        '<geom type="box" size=".1 .2" fromto="0 0 0 1 1 0"/><geom class="heavy" pos="0 1 0"/>',
        '<geom type="ellipsoid" size=".1 .2 .3"/>',
        '<geom type="ellipsoid" size=".1" fromto="0 0 0 0 .1 .4"/>',
        '<frame pos="1 2 0" euler="0 40 0"><geom type="box" size=".1 .2 .3" pos="0 0 1"/></frame>',
    ]
    bodies = "".join(f'<body name="b{k}"><joint/>{s}</body>' for k, s in enumerate(shapes))
    text = f"""<mujoco><compiler angle="degree" settotalmass="{total}"/><default><default class="heavy"><geom size=".2" density="5000"/></default>
</default><worldbody>{bodies}</worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    robot = read_robot("file", text.encode(), None)
    for k in range(len(shapes)):
        held, theirs = robot.links[f"b{k}"].inertial, model.body(f"b{k}")
        assert held is not None
        assert held.mass == pytest.approx(float(theirs.mass[0]), rel=1e-12)
        assert held.pose[:3, 3] == pytest.approx(theirs.ipos, abs=1e-14)
        assert np.linalg.eigvalsh(held.tensor) == pytest.approx(np.sort(theirs.inertia), rel=1e-9)


@pytest.mark.parametrize("powers", ["0.1 2.5", "0.1 2.5 0 0 0"])
def test_coupled_joints_of_mjcf_are_gears_and_what_is_no_ratio_is_named(powers: str) -> None:
    joint = '<joint name="{0}" axis="0 0 1"/><geom size=".1"/>'
    text = f"""<mujoco><worldbody><body name="a">{joint.format("one")}</body>
<body name="b" pos="1 0 0">{joint.format("two")}</body></worldbody>
<equality><joint joint1="two" joint2="one" polycoef="{powers}"/></equality>
<actuator><velocity joint="one"/></actuator></mujoco>"""
    m, notes = taken(text)
    assert m.motion(0.1, speed=2.0).link("b").omega[0] == pytest.approx(5.0)
    assert "equality 'joint 1': its offset 0.1 is left out: the pose is that of the file" in notes
    assert "not a straight line" in str(taken(text.replace(powers, "0 1 2"))[1])


def test_an_equality_that_its_default_switches_off_is_left_out() -> None:
    off = MJCF.replace("<worldbody>", '<default><equality active="false"/></default><worldbody>', 1)
    assert any("left out: it is not active" in note for note in taken(off)[1])


def test_default_sections_of_mjcf_add_up() -> None:
    """Files that are included bring sections of their own."""
    split = '<default><geom size=".1"/></default><worldbody>'
    assert taken(MJCF.replace("<worldbody>", split, 1)) == taken(MJCF)


def test_includes_are_followed_inside_the_folder_alone(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    body, rest = MJCF.split("<worldbody>")
    (home / "world.xml").write_text(
        "<mujoco><worldbody>" + rest.partition("</worldbody>")[0] + "</worldbody></mujoco>"
    )
    (tmp_path / "secret.xml").write_text("<mujoco/>")
    text = body + '<include file="{}"/>' + rest.partition("</worldbody>")[2]
    m, _ = taken(text.format("world.xml"), home)
    assert set(m.links) == {"crank", "rod", "piston"}
    for path in ("../secret.xml", str(tmp_path / "secret.xml")):
        assert "lies outside the file's folder: not read" in refused(text.format(path), home)
    (home / "link.xml").symlink_to(tmp_path / "secret.xml")
    assert "lies outside" in refused(text.format("link.xml"), home)
    assert "No such file" in refused(text.format("none.xml"), home)
    assert "standard input has no folder" in refused(text.format("world.xml"))
    (home / "loop.xml").write_text('<mujoco><include file="loop.xml"/></mujoco>')
    assert "more than 20 files are included" in refused(text.format("loop.xml"), home)


# --- masses: what the compiler makes of them, as MuJoCo 3 and 4 do ----------------------------------------------------
BALL = '<geom type="sphere" size="0.1" mass="2" group="{}"/>'
STATED = '<inertial pos="0.2 0 0" mass="2" diaginertia="{}"/>'
MASSES = {
    "inertiagrouprange='0 1'": (BALL.format(0) + BALL.format(2), 2.0, 2 / 5 * 2 * 0.01),
    "inertiafromgeom='true'": (STATED.format("1 1 1"), 2.0, 1.0),
    "inertiafromgeom='true' inertiagrouprange='3 5'": (STATED.format("1 1 1") + BALL.format(0), 2.0, 1.0),
    "boundmass='3'": (STATED.format("1 1 1"), 3.0, 1.0),
    "boundinertia='0.5'": (STATED.format("0.1 0.2 0.25"), 2.0, 0.5),
    "balanceinertia='true'": (STATED.format("1 1 4"), 2.0, 2.0),
    "balanceinertia='true' boundinertia='3' settotalmass='4'": (STATED.format("1 1 4"), 4.0, 6.0),
}


@pytest.mark.parametrize("compiler", MASSES)
def test_the_compiler_changes_masses(compiler: str) -> None:
    inside, mass, inertia = MASSES[compiler]
    m, notes = taken(
        f"<mujoco><compiler {compiler}/><worldbody><body name='a'><joint name='j'/>{inside}</body></worldbody></mujoco>"
    )
    assert m.links["a"].mass == pytest.approx(mass, rel=1e-15)
    assert m.links["a"].inertia == pytest.approx(inertia, rel=1e-14)
    assert notes == ["the file has no actuator: j is taken as the input"]


@pytest.mark.parametrize(
    ("inside", "compiler", "note"),
    [
        (BALL.format(0).replace("/>", " shellinertia='true'/>"), "", "body 'a': shellinertia of 1 shapes is left out: they are taken as solid"),
        ("", "boundmass='0.5'", "boundmass: left out for a, which stay without mass"),
        ("<geom type='mesh' mesh='m'/>", "", "body 'a': the mass of a m is not imported"),
        ("<geom type='mesh' mesh='m' mass='0'/>", "", ""),
        ("<geom type='plane' size='1 1 1'/>", "", ""),
        ("<joint name='k' springdamper='0.1 1'/>", "", "joint 'k': its springdamper is left out: give stiffness and damping"),
    ],
)  # fmt: skip
def test_masses_and_springs_that_are_not_read_are_named(inside: str, compiler: str, note: str) -> None:
    _, notes = taken(
        f"<mujoco><compiler {compiler}/><worldbody><body name='b'><joint name='j'/>{BALL.format(0)}"
        f"<body name='a' pos='1 0 0'><joint name='i'/>{inside}</body></body></worldbody>"
        "<actuator><motor joint='j'/><motor joint='i'/><motor joint='k'/></actuator></mujoco>".replace(
            "" if "'k'" in inside else "<motor joint='k'/>", ""
        )
    )
    assert notes == [note] * bool(note)


def test_coordinates_of_the_world_are_refused() -> None:
    assert refused("<mujoco><compiler coordinate='global'/></mujoco>") == (
        "file: compiler, coordinate: found 'global', expected local"
    )


def test_what_an_option_disables_is_named() -> None:
    _, notes = taken(MJCF.replace("<worldbody>", "<option><flag equality='disable'/></option><worldbody>"))
    assert "option: 'equality' is disabled there, and acts here" in notes


# --- equalities: a parallelogram; the bar and the rocker meet at (1, 1) -----------------------------------------------
PARALLELOGRAM = """<mujoco><worldbody>
<body name="crank"><joint name="A"/><body name="bar" pos="0 1 0"><joint name="B"/><site name="C1" pos="1 0 0"/></body></body>
<body name="rocker" pos="1 0 0" quat="1 0 0 1"><joint name="D"/><site name="C2" pos="1 0 0" quat="1 0 0 -1"/></body>
</worldbody><equality>{}</equality><actuator><motor joint="A"/></actuator></mujoco>"""


@pytest.mark.parametrize(
    "equality",
    [
        "<connect body1='bar' body2='rocker' anchor='1 0 0'/>",
        "<connect body1='rocker' body2='bar' anchor='1 0 0'/>",
        "<connect site1='C1' site2='C2'/>",
        "<weld body1='bar' body2='rocker' anchor='1 0 0' torquescale='0'/>",
        "<weld body1='rocker' body2='bar' anchor='1 0 0' torquescale='0'/>",
        "<weld site1='C1' site2='C2' torquescale='0'/>",
        "<weld body1='bar' body2='rocker' relpose='1 -1 0 1 0 0 1' anchor='1 0 0' torquescale='0'/>",
    ],
)
def test_what_holds_a_point_alone_is_a_pin(equality: str) -> None:
    m, notes = taken(PARALLELOGRAM.format(equality))
    assert notes == []
    motion = m.motion(np.array([0.0, 0.3]), speed=1.0)
    assert motion.link("rocker").omega == pytest.approx([1.0, 1.0], rel=1e-12)
    # the crank is upright at angle 0
    x, y = motion.at("rocker", 1 + 0j).position[1]
    assert (x, y) == pytest.approx((1 - np.sin(0.3), np.cos(0.3)), abs=1e-12)


# a crank, and a flag that is hinged beside it and welded to it
FLAG = """<mujoco><worldbody>
<body name="crank"><joint name="A"/><site name="s" pos="1 0 0"/></body>
<body name="flag" pos="1 0 0"><site name="t"/></body></worldbody>
<equality>{}</equality><actuator><motor joint="A"/></actuator></mujoco>"""


@pytest.mark.parametrize(
    ("weld", "said"),
    [
        ("relpose='1 0 0 1 0 0 0'", ""),
        # without an orientation nothing of it counts
        ("relpose='5 0 0 0 0 0 0'", ""),
        ("relpose='1 0.25 0 1 0 0 0'", "joint w is 0.25 m open as the file stands"),
        ("relpose='1 0 0 0.5 0 0 0.5'", "turned by a sine of 1 out of it: fixed as they stand"),
    ],
)
def test_a_weld_whose_pose_is_not_that_of_the_file_is_named(weld: str, said: str) -> None:
    text = FLAG.replace('<body name="flag" pos="1 0 0">', '<body name="flag" pos="1 0 0"><freejoint/>')
    m, notes = taken(text.format(f"<weld name='w' body1='crank' body2='flag' {weld}/>"))
    assert set(m.links) == {"crank"}
    assert [note for note in notes if "free joint" not in note] == [
        note for note in notes if said and said in note
    ]


def test_a_site_may_close_two_loops_and_hold_a_spring() -> None:
    """The rocker is a point of two bodies; a spring pulls at the same site."""
    text = PARALLELOGRAM.format("<connect site1='C1' site2='C2'/><connect site1='C1' site2='C2'/>").replace(
        "<actuator>",
        "<tendon><spatial stiffness='3'><site site='C1'/><site site='O'/></spatial></tendon><actuator>",
    )
    text = text.replace("<worldbody>", "<worldbody><site name='O' pos='0 3 0'/>")
    m, _ = taken(text)
    assert len(m.springs) == 1
    assert m.springs[0].stiffness == 3.0


def test_a_tendon_without_a_name_may_pull() -> None:
    text = PARALLELOGRAM.format("<connect site1='C1' site2='C2'/>").replace(
        "<actuator>", "<tendon><fixed stiffness='2'><joint joint='D' coef='1'/></fixed></tendon><actuator>"
    )
    m, _ = taken(text)
    assert [s.stiffness for s in m.torsion_springs] == [2.0]


def test_free_bodies_that_equalities_tie_move_with_them() -> None:
    """A parallelogram (0, 0), (0, 1), (1, 1), (1, 0) whose bar and rocker are free; and a body that nothing ties."""
    text = """<mujoco><worldbody><body name="crank"><joint name="A"/></body>
    <body name="bar" pos="0.5 1 0"><freejoint/></body><body name="rocker" pos="1 0 0"><freejoint/></body>
    <body name="stone" pos="9 9 0"><freejoint/></body></worldbody><equality>
    <connect body1="crank" body2="bar" anchor="0 1 0"/><connect body1="bar" body2="rocker" anchor="0.5 0 0"/>
    <connect body1="rocker" anchor="0 0 0"/></equality></mujoco>"""
    m, notes = taken(text)
    assert set(m.links) == {"crank", "bar", "rocker"}
    assert "body 'stone': its free joint is left out: the body is fixed" in notes
    motion = m.motion(0.3, speed=1.0)
    assert float(motion.link("rocker").omega[0]) == pytest.approx(1.0, rel=1e-12)
    assert float(motion.link("bar").omega[0]) == pytest.approx(0.0, abs=1e-12)
