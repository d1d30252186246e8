"""What `dalembert export` writes as a robot, read by MuJoCo and by a reader of URDF: it stands and pulls as ours."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dalembert.errors import DataError
from tests.cli.exported import FILES, FOUR_BAR, MASSIVE, exported, home, moved
from virtualwork import Mechanism
from virtualwork.exchange.drawing import Travel
from virtualwork.exchange.skeleton import Joint, Skeleton


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
    s, motion = Skeleton(m, (q,), Travel(m)), m.motion(q, speed)

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
        return s.bodies[j.link].turn - s.bodies[j.on].turn
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
    start = Skeleton(m, home(m), Travel(m))
    for share in (0.0, 0.01, -0.02):
        inputs = tuple(
            at + share * (m.size if e.is_slide else 1.0) for at, e in zip(home(m), m.inputs, strict=True)
        )
        try:
            there = Skeleton(m, inputs, Travel(m))
        except DataError:
            continue  # beyond a limit
        way = {j.name: coordinate(there, j) - coordinate(start, j) for j in (b.joint for b in there.walk())}
        robot.update_cfg({name: way[name] for name in robot.actuated_joint_names})
        for b in start.walk():
            part, end = there.bodies[b.child], b.joint.ends[b.child == b.joint.link]
            found, at, turn = robot.get_transform(b.child, "ground"), part.world(end), part.turn
            assert found[:2, 3] == pytest.approx((at.real, at.imag), abs=1e-14 * m.size), b.child
            assert found[:2, 0] == pytest.approx((math.cos(turn), math.sin(turn)), abs=1e-14), b.child
