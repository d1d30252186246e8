"""Robots of several loops: six-bars and legs in URDF, SDF and MJCF, with too few and too many actuators."""

from __future__ import annotations

import cmath

import numpy as np
import pytest

from tests.cli.imported import taken
from virtualwork import Mechanism

INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'


def meeting(p: complex, r: float, q: complex, s: float) -> complex:
    """Where two circles meet, to the left of the way from p to q."""
    d = abs(q - p)
    along = (r * r - s * s + d * d) / (2 * d)
    return p + (q - p) / d * complex(along, (r * r - along * along) ** 0.5)


# a four-bar A B C D, and a dyad F on its rocker's point E and the ground's G
A, D, G = 0j, 4 + 0j, 7.5 + 0j
B = A + cmath.rect(1.2, 0.9)
C = meeting(B, 3.5, D, 2.5)
E = D + (C - D) / abs(C - D) * cmath.rect(1.8, -0.5)
F = meeting(E, 3.0, G, 2.2)
SIX = {"crank": A, "coupler": B, "rocker": D, "dyad": E, "last": G}
SIX_TREE = [
    ("A", "base", "crank"),
    ("B", "crank", "coupler"),
    ("D", "base", "rocker"),
    ("E", "rocker", "dyad"),
]
SIX_TREE += [("G", "base", "last")]
SIX_LOOPS = [("C", "coupler", "rocker", C), ("F", "dyad", "last", F)]
# a leg of five bars
KNEES = A + cmath.rect(2, 2.2), 2 + cmath.rect(2, 0.9)
LEG = {"l1": A, "l2": KNEES[0], "r1": 2 + 0j, "r2": KNEES[1]}
LEG_TREE = [("A", "base", "l1"), ("B", "l1", "l2"), ("D", "base", "r1"), ("E", "r1", "r2")]
FOOT = meeting(KNEES[0], 3.0, KNEES[1], 3.2)
LEG_LOOPS = [("C", "l2", "r2", FOOT)]

Places = dict[str, complex]
Tree = list[tuple[str, str, str]]
Loops = list[tuple[str, str, str, complex]]


def vector(z: complex) -> str:
    return f"{z.real:.15g} {z.imag:.15g} 0"


def urdf(places: Places, tree: Tree, loops: Loops, how: str, more: str = "") -> str:
    at = {"base": 0j} | places
    parts = ['<link name="base"/>', *(f'<link name="{n}">{INERTIAL}</link>' for n in places)]

    def joint(name: str, a: str, b: str, z: complex, type_: str = "continuous") -> str:
        ends = (
            f'<parent link="{a}"/><child link="{b}"/><origin xyz="{vector(z - at[a])}"/><axis xyz="0 0 1"/>'
        )
        return f'<joint name="{name}" type="{type_}">{ends}</joint>'

    parts += [joint(name, a, b, at[b]) for name, a, b in tree]
    for name, a, b, z in loops:
        if how == "loop_joint":
            one, two = (
                f'<link{k} link="{n}" xyz="{vector(z - at[n])}" rpy="0 0 0"/>' for k, n in ((1, a), (2, b))
            )
            parts.append(
                f'<loop_joint name="{name}" type="revolute">{one}{two}<axis xyz="0 0 1"/></loop_joint>'
            )
        elif how == "gazebo":
            ends = f"<parent>{a}</parent><child>{b}</child><pose>{vector(z - at[b])} 0 0 0</pose>"
            parts.append(
                f'<gazebo><joint name="{name}" type="revolute">{ends}<axis><xyz>0 0 1</xyz></axis></joint></gazebo>'
            )
        else:
            end = f"end_{name}"
            parts += [f'<link name="{end}"/>', joint(f"{name}_end", a, end, z, "fixed")]
            parts.append(joint(name, b, end, z))
    return f'<robot name="r">{"".join(parts)}{more}</robot>'


def driven(*joints: str) -> str:
    inside = "".join(f'<joint name="{j}"><command_interface name="position"/></joint>' for j in joints)
    return f'<ros2_control name="c" type="system">{inside}</ros2_control>'


def sdf(places: Places, tree: Tree, loops: Loops) -> str:
    links = "".join(
        f'<link name="{n}"><pose>{vector(z)} 0 0 0</pose><inertial><mass>1</mass></inertial></link>'
        for n, z in places.items()
    )
    ends = [(name, a, b, places[b]) for name, a, b in tree] + loops
    joints = "".join(
        f'<joint name="{name}" type="revolute"><parent>{a}</parent><child>{b}</child>'
        f"<pose>{vector(z - places[b])} 0 0 0</pose><axis><xyz>0 0 1</xyz></axis></joint>"
        for name, a, b, z in ends
    )
    world = '<joint name="w" type="fixed"><parent>world</parent><child>base</child></joint>'
    return f'<sdf version="1.8"><model name="r"><link name="base"/>{links}{world}{joints}</model></sdf>'


def mjcf(places: Places, tree: Tree, loops: Loops) -> str:
    def bodies(parent: str, at: complex) -> str:
        return "".join(
            f'<body name="{b}" pos="{vector(places[b] - at)}"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
            f'<joint name="{name}" type="hinge" axis="0 0 1"/>{bodies(b, places[b])}</body>'
            for name, a, b in tree
            if a == parent
        )

    equal = "".join(
        f'<connect name="{name}" body1="{a}" body2="{b}" anchor="{vector(z - places[a])}"/>'
        for name, a, b, z in loops
    )
    return (
        f'<mujoco model="r"><worldbody>{bodies("base", 0j)}</worldbody><equality>{equal}</equality></mujoco>'
    )


SIXES = {how: urdf(SIX, SIX_TREE, SIX_LOOPS, how) for how in ("loop_joint", "gazebo", "second parent")}
SIXES |= {"sdf": sdf(SIX, SIX_TREE, SIX_LOOPS), "mjcf": mjcf(SIX, SIX_TREE, SIX_LOOPS)}
ACTUATORS = [(), ("A",), ("A", "G"), ("G", "A"), ("A", "B", "D", "E", "G")]


def stands(m: Mechanism, places: Places, loops: Loops) -> None:
    """All loops are closed where the file has them, and stay so."""
    motion = m.motion(np.array([m.at]) if len(m.at) > 1 else m.at[0])
    assert motion.assembled.all()
    for name, _, _, z in loops:
        assert motion.point(name).position[0] == pytest.approx([z.real, z.imag], abs=1e-13)
    for name, z in places.items():
        if name in m.links:
            assert motion.link(name).angle[0] == pytest.approx(0.0, abs=1e-13), z


@pytest.mark.parametrize("how", SIXES)
def test_a_six_bar_has_one_input(how: str) -> None:
    (m,), _ = taken(SIXES[how])
    assert len(m.inputs) == 1
    stands(m, SIX, SIX_LOOPS)


@pytest.mark.parametrize("joints", ACTUATORS)
def test_actuators_that_follow_from_others_are_left_out(joints: tuple[str, ...]) -> None:
    (m,), notes = taken(urdf(SIX, SIX_TREE, SIX_LOOPS, "loop_joint", driven(*joints) if joints else ""))
    assert [e.link for e in m.inputs] == ["last" if joints[:1] == ("G",) else "crank"]
    assert sum("left out as an input" in note for note in notes) == max(len(joints) - 1, 0)
    stands(m, SIX, SIX_LOOPS)


@pytest.mark.parametrize("joints", [(), ("A",), ("D",), ("A", "D"), ("A", "B", "D", "E"), ("A", "B")])
@pytest.mark.parametrize("how", ["loop_joint", "gazebo"])
def test_a_leg_of_five_bars_has_two_inputs(joints: tuple[str, ...], how: str) -> None:
    (m,), notes = taken(urdf(LEG, LEG_TREE, LEG_LOOPS, how, driven(*joints) if joints else ""))
    want = {"l1", "l2"} if joints == ("A", "B") else {"l1", "r1"}
    assert {e.link for e in m.inputs} == want
    assert any("in addition" in note for note in notes) == (len(joints) < 2)
    assert not any("refuse" in note for note in notes)
    stands(m, LEG, LEG_LOOPS)
    # the foot of the symmetric question: both hips turned, its distances from both knees are the shanks
    if want == {"l1", "r1"}:
        q = np.array([m.at]) + np.array([[0.1, -0.2]])
        foot, left, right = (m.motion(q).point(p).position[0] @ [1, 1j] for p in "CBE")
        assert abs(foot - left) == pytest.approx(3.0, rel=1e-13)
        assert abs(foot - right) == pytest.approx(3.2, rel=1e-13)


@pytest.mark.parametrize("write", [sdf, mjcf])
def test_a_leg_in_the_other_formats(write: object) -> None:
    (m,), _ = taken(write(LEG, LEG_TREE, LEG_LOOPS))  # type: ignore[operator]
    assert {e.link for e in m.inputs} == {"l1", "r1"}


def test_two_pistons_of_a_table() -> None:
    """Three legs on a slide each: a table that rises by one and is turned by the other; the third joint would be too many."""
    text = """<mujoco model="t"><compiler angle="radian"/><worldbody><body name="post" pos="0 1 0">
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="rise" type="slide" axis="0 1 0"/>
<body name="table" pos="0 0 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<joint name="tilt" type="hinge" axis="0 0 1"/></body></body>
<body name="rod" pos="1 0.2 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<joint name="foot" type="hinge" axis="0 0 1"/>
<body name="piston" pos="0 0.3 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<joint name="push" type="slide" axis="0 1 0"/></body></body></worldbody>
<equality><connect body1="piston" body2="table" anchor="0 0.5 0"/></equality>
<actuator><position name="a" joint="rise"/><position name="b" joint="push"/><position name="c" joint="tilt"/></actuator></mujoco>"""
    (m,), notes = taken(text)
    assert len(m.inputs) == 2
    assert sum("left out as an input" in note for note in notes) == 1
    assert not any("refuse" in note for note in notes)
