"""`dalembert export`: what is written is read back by the program it is for, and says the same."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from cli.errors import DataError
from cli.exports.skeleton import Joint, Skeleton
from cli.exports.written import written
from cli.imports.assembled import described
from cli.imports.drawn import settle
from cli.imports.told import read
from virtualwork import Mechanism

Run = Callable[..., "CompletedProcess[str]"]
EXAMPLES = Path(__file__).parents[2] / "cli" / "examples"
FOUR_BAR = """
name = "Four-bar <A & B>"
gravity = [0, -9.81]
[units]
length = "mm"
angle = "deg"
[ground]
A = [0, 0]
D = [100, 0]
[links.crank]
points = { A = [0, 0], B = [40, 0] }
mass = 0.4
center = [20, 3]
inertia = "80 kg mm2"
[links.coupler]
points = { B = [0, 0], C = [110, 0], P = [60, 40] }
mass = 0.6
center = [55, 10]
inertia = "700 kg mm2"
[links.rocker]
points = { D = [0, 0], C = [80, 0] }
mass = 0.5
center = [40, 0]
inertia = "300 kg mm2"
[input]
link = "crank"
angle = 60
speed = "300 rpm"
[guess]
at = 60
coupler = 20
rocker = 90
"""
SLIDER_CRANK = """
gravity = [0, -9.81]
[units]
length = "mm"
angle = "deg"
[ground]
O = [0, 0]
[links.crank]
points = { O = [0, 0], A = [45, 0] }
mass = 0.5
center = [10, 0]
inertia = 1e-4
[links.rod]
points = { A = [0, 0], B = [150, 0] }
mass = 0.7
center = [50, 0]
inertia = 1e-3
[links.piston]
points = { B = [0, 0] }
mass = 0.9
[[sliders]]
point = "B"
link = "piston"
through = [10, -20]
angle = 30
turned = -30
[input]
link = "crank"
angle = 40
speed = "600 rpm"
[guess]
at = 40
rod = -10
"""
PLANETARY = """
gravity = [0, -9.81]
[ground]
O = [0, 0]
[links.sun]
points = { O = [0, 0] }
mass = 1
inertia = 0.01
[links.arm]
points = { O = [0, 0], C = [0.12, 0] }
mass = 0.5
center = [0.06, 0]
inertia = 0.002
[links.planet]
points = { C = [0, 0], T = [0.04, 0] }
mass = 0.3
center = [0.01, 0]
inertia = 0.0005
[[gears]]
links = ["sun", "planet"]
ratio = -2.0
arm = "arm"
[[gears]]
links = ["planet", "ground"]
ratio = 0.25
arm = "arm"
[input]
link = "sun"
angle = "20 deg"
speed = "100 rad/s"
[guess]
at = "20 deg"
arm = 0.3
planet = 0
"""
SPRINGS = (
    FOUR_BAR
    + """
[[springs]]
between = ["coupler.P", "ground.D"]
stiffness = "4 N/mm"
free_length = 60
damping = 15
[[torsion_springs]]
links = ["ground", "rocker"]
stiffness = 2.5
free_angle = 90
damping = 0.01
[[torsion_springs]]
links = ["coupler", "crank"]
stiffness = 1.5
free_angle = 70
"""
)
MASSIVE = {"four-bar": FOUR_BAR, "springs": SPRINGS, "slider-crank": SLIDER_CRANK, "planetary": PLANETARY}
ROBOTS = (".xml", ".urdf", ".sdf")
# inputs that no joint is: another joint is driven in their place, and it is said
ELSEWHERE = {"desk-lamp", "double-pendulum"}
FILES = sorted(p for p in EXAMPLES.glob("*/*.toml") if "[links." in p.read_text())


def home(m: Mechanism) -> tuple[float, ...]:
    return tuple(at if e.value is None else e.value for e, at in zip(m.inputs, m.at, strict=True))


def exported(m: Mechanism, suffix: str, inputs: tuple[float, ...] | None = None) -> bytes:
    units = {"length": "mm", "angle": "deg"}
    return written(m, home(m) if inputs is None else inputs, suffix, "file.toml", units)[0]


def taken_back(data: bytes) -> Mechanism:
    _, (drawing,) = read("file", data, None)
    (part,) = settle(drawing)
    return Mechanism.from_toml_text(described(part, "test"))


def moved(m: Mechanism, inputs: Any) -> Any:
    return m.motion(inputs if len(m.inputs) > 1 else np.asarray(inputs)[:, 0])


# --- round trips --------------------------------------------------------------------------------------------------
@pytest.mark.slow
@pytest.mark.parametrize("suffix", ROBOTS)
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.parent.name)
def test_every_example_comes_back_with_the_same_motion(file: Path, suffix: str) -> None:
    """Every named point of every link, over the input around the start, to 1e-13 of the mechanism's size."""
    if file.parent.name in ELSEWHERE and suffix != ".xml":
        pytest.skip("another joint is driven")
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
    data, notes = written(m, m.at, suffix, "file.toml", {})
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


def test_mjcf_keeps_the_value_of_the_input() -> None:
    m = Mechanism.from_toml(EXAMPLES / "scissors-lift" / "lift.toml")
    back = taken_back(exported(m, ".xml"))
    assert [e.value for e in back.inputs] == pytest.approx(home(m), rel=1e-14)


# --- MuJoCo -------------------------------------------------------------------------------------------------------
def in_mujoco(data: bytes) -> tuple[Any, Any, Any]:
    mujoco = pytest.importorskip(
        "mujoco", reason="MuJoCo reads back what is written for it: pip install mujoco"
    )
    model = mujoco.MjModel.from_xml_string(data.decode())
    state = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, state, 0)
    mujoco.mj_forward(model, state)
    return mujoco, model, state


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.parent.name)
def test_mujoco_stands_where_we_do_and_its_loops_are_closed(file: Path) -> None:
    m = Mechanism.from_toml(file)
    _, _, state = in_mujoco(exported(m, ".xml"))
    ours = moved(m, np.array([home(m)]))
    for name, link in m.links.items():
        body = state.body(name)
        for point, z in link.points.items():
            at = body.xpos + body.xmat.reshape(3, 3) @ [z.real, z.imag, 0.0]
            assert at[:2] == pytest.approx(ours.point(point).position[0], abs=1e-14 * m.size)
    if state.nefc:
        assert np.abs(state.efc_pos).max() <= 1e-14 * m.size
        fastest = max(1.0, *(abs(e.speed or 0.0) for e in m.inputs))
        assert np.abs(state.efc_vel).max() <= 1e-13 * fastest


def accelerations(m: Mechanism, q: float, speed: float) -> Any:
    """The accelerations of the joints' coordinates, in MuJoCo's order."""
    s, motion = Skeleton(m, (q,)), m.motion(q, speed)

    def alpha(body: str) -> float:
        return float(motion.link(body).alpha[0]) if body in m.links else 0.0

    found = []
    for b in s.walk():
        j = b.joint
        slide = j.kind == "slide"
        found.append(float(motion.slide(j.point).acceleration[0]) if slide else alpha(j.link) - alpha(j.on))
    return np.array(found)


@pytest.mark.parametrize("name", MASSIVE)
def test_mujocos_inverse_dynamics_asks_for_our_effort(name: str) -> None:
    """Its joint torques without the loops' forces, carried to the input by the joints' own speeds (virtual work)."""
    m = Mechanism.from_toml_text(MASSIVE[name])
    speed = m.inputs[0].speed or 0.0
    q = np.linspace(0, 2 * math.pi, 12, endpoint=False)
    ours = m.motion(q, speed).effort
    for angle, effort in zip(q, ours, strict=True):
        mujoco, model, state = in_mujoco(exported(m, ".xml", (float(angle),)))
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        state.qacc[:] = accelerations(m, float(angle), speed)
        mujoco.mj_inverse(model, state)
        assert state.qfrc_inverse @ state.qvel / speed == pytest.approx(effort, abs=1e-8 * np.abs(ours).max())


@pytest.mark.parametrize(
    ("name", "share"), [("four-bar", 3e-4), ("springs", 6e-4), ("slider-crank", 3e-4), ("planetary", 1e-5)]
)
def test_our_effort_keeps_mujocos_input_at_its_speed(name: str, share: float) -> None:
    """Forward dynamics with its own soft constraints: what is left of the acceleration, as a share of ω²."""
    m = Mechanism.from_toml_text(MASSIVE[name])
    speed = m.inputs[0].speed or 0.0
    q = np.linspace(0, 2 * math.pi, 12, endpoint=False)
    for angle, effort in zip(q, m.motion(q, speed).effort, strict=True):
        mujoco, model, state = in_mujoco(exported(m, ".xml", (float(angle),)))
        state.ctrl[0] = effort
        mujoco.mj_forward(model, state)
        assert abs(state.joint(int(model.actuator_trnid[0, 0])).qacc[0]) <= share * speed**2


def test_mujoco_reads_the_urdf_and_stands_where_we_do() -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo reads URDF too: pip install mujoco")
    m = Mechanism.from_toml_text(FOUR_BAR)
    data = (
        exported(m, ".urdf")
        .decode()
        .replace("<robot ", '<robot xmlns:x="x" ', 1)
        .replace("</robot>", '<mujoco><compiler fusestatic="false"/></mujoco></robot>')
    )
    model = mujoco.MjModel.from_xml_string(data)
    state = mujoco.MjData(model)
    mujoco.mj_forward(model, state)
    ours = m.motion()
    for link, point in (("crank", "A"), ("rocker", "D"), ("P", "P")):
        assert state.body(link).xpos[:2] == pytest.approx(ours.point(point).position[0], abs=1e-15)
    assert float(model.body("coupler").mass[0]) == 0.6


def coordinate(s: Skeleton, j: Joint) -> float:
    """How far a joint has turned or slid in a skeleton's pose."""
    if j.kind == "turn":
        return s.parts[j.link].turn - s.parts[j.on].turn
    return next(own.value for own in s.joints if own.name == j.name)


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.parent.name)
def test_yourdfpy_stands_where_we_do_in_every_pose(file: Path) -> None:
    """A reader of URDF alone: masses, and with our coordinates of the tree the place and turn of every link."""
    yourdfpy = pytest.importorskip("yourdfpy", reason="a reader of URDF: pip install yourdfpy")
    m = Mechanism.from_toml(file)
    robot = yourdfpy.URDF.load(io.BytesIO(exported(m, ".urdf")), load_meshes=False)
    assert robot.validate()
    for name in m.links:
        held = robot.link_map[name].inertial
        assert (0.0 if held is None else held.mass) == m.rigid[name].mass
    start = Skeleton(m, home(m))
    for share in (0.0, 0.01, -0.02):
        inputs = tuple(
            at + share * (m.size if e.is_slide else 1.0) for at, e in zip(home(m), m.inputs, strict=True)
        )
        try:
            there = Skeleton(m, inputs)
        except DataError:
            continue  # beyond a limit
        way = {j.name: coordinate(there, j) - coordinate(start, j) for j in (b.joint for b in there.walk())}
        robot.update_cfg({name: way[name] for name in robot.actuated_joint_names})
        for b in start.walk():
            part, end = there.parts[b.child], b.joint.ends[b.child == b.joint.link]
            found, at, turn = robot.get_transform(b.child, "ground"), part.world(end), part.turn
            assert found[:2, 3] == pytest.approx((at.real, at.imag), abs=1e-14 * m.size), b.child
            assert found[:2, 0] == pytest.approx((math.cos(turn), math.sin(turn)), abs=1e-14), b.child


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


# --- drawings -------------------------------------------------------------------------------------------------------
def test_ezdxf_reads_the_drawing_in_the_unit_of_the_file(tmp_path: Path, dalembert: Run) -> None:
    ezdxf = pytest.importorskip(
        "ezdxf", reason="DXF is written and read by ezdxf: pip install 'dalembert[cad]'"
    )
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    done = dalembert("export", "m.toml", "-o", "m.dxf")
    assert (done.returncode, done.stderr, done.stdout) == (0, "", "")
    drawing = ezdxf.readfile(tmp_path / "m.dxf")
    assert not drawing.audit().has_errors
    assert drawing.header["$INSUNITS"] == 4
    space = drawing.modelspace()
    m = Mechanism.from_toml_text(FOUR_BAR)
    pins = sorted(
        (round(c.dxf.center.x, 9), round(c.dxf.center.y, 9)) for c in space.query("CIRCLE[layer=='JOINTS']")
    )
    stand = m.motion()
    assert pins == sorted(tuple(np.round(stand.point(p).position[0] * 1000, 9)) for p in "ABCD")
    (curve,) = space.query("LWPOLYLINE[layer=='CURVES']")
    assert curve.closed
    ours = m.motion(np.linspace(m.at[0], m.at[0] + 2 * math.pi, 721)[:-1]).point("P").position * 1000
    assert np.array(curve.get_points("xy")) == pytest.approx(ours, abs=1e-9)
    assert len(space.query("LWPOLYLINE[layer=='LINKS']")) == 3
    assert {t.dxf.text for t in space.query("TEXT")} >= {
        "A",
        "B",
        "C",
        "D",
        "P",
        "crank",
        "coupler",
        "rocker",
    }
    assert (tmp_path / "m.dxf").read_text().startswith("999\nFour-bar <A & B>, from m.toml by dalembert ")


def test_svg_is_in_true_size_with_a_group_for_each_layer(tmp_path: Path, dalembert: Run) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    assert dalembert("export", "m.toml", "-o", "m.svg", "--at", "90").returncode == 0
    text = (tmp_path / "m.svg").read_text()
    root = ElementTree.fromstring(text)
    space = "{http://www.w3.org/2000/svg}"
    width = float((root.get("viewBox") or "").split()[2])
    assert float((root.get("width") or "")[:-2]) == pytest.approx(width, rel=1e-5)
    groups = {g.get("id"): g for g in root.findall(f"{space}g")}
    layers = "GROUND GUIDES LINKS GEARS SPRINGS MASSES CURVES JOINTS POINTS NAMES"
    assert list(groups) == layers.split()
    pins = {
        (float(c.get("cx") or 0), float(c.get("cy") or 0)) for c in groups["JOINTS"].findall(f"{space}circle")
    }
    assert any(math.dist(p, (0, -40)) < 1e-12 for p in pins)
    assert "crank = 90 deg" in text
    assert "Four-bar &lt;A &amp; B" not in text.partition("<svg")[0]


def test_curves_are_the_motion(tmp_path: Path, dalembert: Run) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    assert dalembert("export", "m.toml", "-o", "m.csv").returncode == 0
    rows = list(csv.DictReader((tmp_path / "m.csv").read_text().splitlines()))
    assert list(rows[0]) == ["input_deg", "B_x_mm", "B_y_mm", "C_x_mm", "C_y_mm", "P_x_mm", "P_y_mm"]
    assert len(rows) == 721
    m = Mechanism.from_toml_text(FOUR_BAR)
    q = np.radians([float(r["input_deg"]) for r in rows])
    found = np.array([[float(r["P_x_mm"]), float(r["P_y_mm"])] for r in rows])
    assert found == pytest.approx(m.motion(q).point("P").position * 1000, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".dxf", ".svg"])
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.parent.name)
def test_every_example_is_drawn(file: Path, suffix: str) -> None:
    if suffix == ".dxf":
        pytest.importorskip("ezdxf", reason="pip install 'dalembert[cad]'")
    assert len(exported(Mechanism.from_toml(file), suffix)) > 1000


# --- what is said, and what is refused ----------------------------------------------------------------------------
def test_source_and_version_stand_in_every_robot(tmp_path: Path, dalembert: Run) -> None:
    (tmp_path / "my--file.toml").write_text(FOUR_BAR)
    for suffix in ROBOTS:
        assert dalembert("export", "my--file.toml", "-o", f"m{suffix}").returncode == 0
        head = (tmp_path / f"m{suffix}").read_text().splitlines()[1]
        assert "from my- -file.toml by dalembert" in head
        assert "crank = 60 deg" in head


def test_what_a_format_cannot_hold_is_named(tmp_path: Path, dalembert: Run) -> None:
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
def test_bad_calls(arguments: list[str], status: int, said: str, tmp_path: Path, dalembert: Run) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    (tmp_path / "far.toml").write_text(FOUR_BAR.replace("C = [110, 0]", "C = [400, 0]"))
    (tmp_path / "broken.toml").write_text("[ground\n")
    done = dalembert("export", *arguments)
    assert done.returncode == status, done.stderr
    assert said in done.stderr
    assert not list(tmp_path.glob("m.[!t]*"))


def test_an_input_is_never_written_over(tmp_path: Path, dalembert: Run) -> None:
    (tmp_path / "m.xml").write_text(FOUR_BAR)
    assert dalembert("export", "m.xml", "-o", "m.xml").returncode == 2
    assert (tmp_path / "m.xml").read_text() == FOUR_BAR
