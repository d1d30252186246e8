"""What `dalembert import` takes as an argument and in older forms: links of PMKS+, several guides at a point, prefixes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.cli.imported import taken
from tests.conftest import Dalembert
from virtualwork import Mechanism

NEW = (
    "0P.TY.K,0.101.MA,A,0mv,0VU,0.GB,B,0e_,E6,0.GC,C,l1,WW,0.KD,D,qD,0Pk,0..YRAB,AB,Fe,Fe,0ix,08i,c5cae9,A,B,,"
    ".YRBC,BC,Fe,Fe,32,NJ,303e9f,B,C,,.YRCD,CD,Fe,Fe,nd,3P,0d125a,C,D,,...JBq"
)
JOINTS = "A,-1.24,-0.89,AB,R,t,{0}t,%0AB,-0.1,2.01,AB%7CCB,R,f,{0}f,%0AC,4.26,2.27,CB%7CDC,R,f,{0}f,%0AD,3.36,-1.01,DC,R,t,{0}f,%0A"
LINKS = "AB,{0}-0.67,0.56,A%7CB,,l%0ACB,{0}2.08,2.14,B%7CC,F1,l%0ADC,{0}3.81,0.63,C%7CD,,l%0A"


def old(
    angle: str = "0,0.1,", masses: str = "1,1,", forces: str = "", settings: str = "10,false,false,cm"
) -> str:
    return f"https://app.example.org/?j={JOINTS.format(angle)}&l={LINKS.format(masses)}&f={forces}&pp=&tp=&s={settings}"


@pytest.mark.parametrize(
    "link", [f"https://app.example.org/?{NEW}", old(), old("Null,"), old(masses="R,1,1,")]
)
def test_a_link_is_an_argument(dalembert: Dalembert, link: str) -> None:
    done = dalembert("import", link)
    assert done.returncode == 0, done.stderr
    m = Mechanism.from_toml_text(done.stdout)
    assert len(m.links) == 3
    assert m.motion().assembled.all()


def test_an_old_link_of_a_four_bar_with_masses_and_a_force() -> None:
    text = old(masses="R,2,3,", forces="F1,CB,1.8,2.123,1.8,4.123,t,true,5,%0A", settings="20,true,true,cm")
    (m,), _ = taken(text)
    for point, at in {"A": (-1.24, -0.89), "B": (-0.1, 2.01), "C": (4.26, 2.27), "D": (3.36, -1.01)}.items():
        assert m.motion().point(point).position[0] == pytest.approx(np.array(at) / 100, rel=1e-12)
    # clockwise: the sense of a positive speed is counter-clockwise
    assert m.inputs[0].speed == pytest.approx(-20 * math.pi / 30, rel=1e-15)
    assert m.gravity == pytest.approx(-9.81j)
    rigid = m.rigid["CB"]
    assert (rigid.mass, rigid.inertia) == (2, pytest.approx(3e-4, rel=1e-14))
    (force,) = m.forces
    assert force.force == pytest.approx(5j)
    assert force.frame == "ground"


def test_an_old_link_of_a_slider_crank() -> None:
    """The slider's joint is a pin of the rod on a line of the ground: the pin keeps its height."""
    text = (
        "?j=A,-1.76,-1.99,AB,R,t,0,0.1,t,%0AB,0.52,1.95,AB%7CCB,R,f,0,0.1,f,%0AC,2.54,0.15,CB,P,t,0,0.1,f,%0A"
        "&l=AB,1,1,-0.4,1.13,A%7CB,,l%0ACB,1,1,0.97,1.64,B%7CC,,l%0A&f=&pp=&tp=&s=10,false,false,cm"
    )
    (m,), _ = taken(text)
    motion = m.motion(np.linspace(-0.2, 0.2, 13))
    assert motion.point("C").position[:, 1] == pytest.approx(np.full(13, 0.15e-2), rel=1e-12)
    b, c = (motion.point(p).position for p in "BC")
    assert np.hypot(*(b - c).T) == pytest.approx(np.full(13, math.hypot(2.02, 1.8) / 100), rel=1e-12)


@pytest.mark.parametrize(
    ("link", "said"),
    [
        ("https://app.example.org/?j=A,1,2,AB,R,t,0,t", "the link: unknown format"),
        (old().replace("-1.24", "abc", 1), "joint A: found 'abc', expected a finite number"),
        (old().replace("A%7CB", "A%7CX", 1), "link AB: found 'X', expected one of the joints A, B, C, D"),
        ("https://app.example.org/", "the link: unknown format"),
    ],
)
def test_a_bad_link_is_one_line(dalembert: Dalembert, link: str, said: str) -> None:
    done = dalembert("import", link)
    assert done.returncode == 1
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def linkage(*lines: str) -> str:
    return "\n".join(
        ["<linkage2>", '<program zoom="1" scalefactor="1" units="Millimeters" />', *lines, "</linkage2>"]
    )


def actuator(number: int, a: int, b: int) -> str:
    return f'<Link id="{number}" layer="16" actuator="true" throw="50" cpm="5"><connector id="{a}" /><connector id="{b}" /></Link>'


def test_two_actuators_at_one_point() -> None:
    """They hold it: its distances from both anchors are driven."""
    places = {0: (0, 0), 1: (400, 0), 2: (150, 200)}
    head = [
        f'<connector id="{i}" x="{x}" y="{y}" layer="16" anchor="{str(i < 2).lower()}" />'
        for i, (x, y) in places.items()
    ]
    mm = 25.4e-3 / 96
    (m,), notes = taken(linkage(*head, actuator(0, 0, 2), actuator(1, 1, 2)))
    assert not any("refuse" in note for note in notes)
    drawn = [abs(complex(*places[2]) - complex(*places[k])) * mm for k in (0, 1)]
    q = np.array([[0.0, 0.0], [0.004, 0.0], [0.0, -0.003], [0.002, 0.003]])
    z = m.motion(q).point("C2").position @ [1, 1j]
    for k in (0, 1):
        assert np.abs(z - complex(*places[k]) * mm) == pytest.approx(drawn[k] + q[:, k], rel=1e-12)


def test_a_pin_in_two_slots_has_a_shoe() -> None:
    """An ellipse's trammel made wrong: one pin of a bar in a slot of the crank and in one of the ground."""
    text = linkage(
        '<connector id="0" x="0" y="0" layer="16" anchor="true" input="true" rpm="10" />',
        '<connector id="1" x="300" y="100" layer="16" />',
        '<connector id="2" x="0" y="200" layer="16" anchor="true" />',
        '<connector id="3" x="400" y="200" layer="16" anchor="true" />',
        '<connector id="4" x="150" y="50" layer="16" slider="true"><slidelimit id="0" /><slidelimit id="1" /></connector>',
        '<Link id="0" layer="16"><connector id="0" /><connector id="1" /></Link>',
        '<Link id="1" layer="16"><connector id="4" /><connector id="2" /></Link>',
    )
    (m,), notes = taken(text)
    assert not any("refuse" in note for note in notes)
    motion = m.motion(np.linspace(-0.2, 0.2, 5))
    z = motion.point("C4").position @ [1, 1j] / (25.4e-3 / 96)
    assert np.abs(z - 200j) == pytest.approx(np.full(5, abs(150 + 50j - 200j)), rel=1e-12)


def test_a_speed_of_zero_is_no_speed() -> None:
    (m,), notes = taken(
        "set=s0&mech=ground input R 0 0\ninput coupler R 1 2\ncoupler out R 5 3\nground out R 4 0"
    )
    assert m.inputs[0].speed is None
    assert any("has the speed 0" in note for note in notes)


SDF = """<?xml version="1.0"?>
<!-- <sdf> as drawn -->
<sdf version="1.7"><model name="m"><link name="base"/>
<link name="arm"><pose>0 0 0 0 0 0</pose><collision name="c"><drake:proximity_properties><drake:mu>1</drake:mu></drake:proximity_properties></collision></link>
<joint name="w" type="fixed" drake:kind="a"><parent>world</parent><child>base</child></joint>
<joint name="j" type="revolute"><parent>base</parent><child>arm</child><axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""


def test_prefixes_that_nobody_declares(dalembert: Dalembert) -> None:
    done = dalembert("import", "-", stdin=SDF)
    assert done.returncode == 0, done.stderr
    declared = dalembert("import", "-", stdin=SDF.replace("<sdf version", '<sdf xmlns:drake="d" version'))
    assert done.stdout == declared.stdout
    bad = dalembert("import", "-", stdin=SDF.replace("</model>", ""))
    assert bad.returncode == 1
    assert "no valid XML (mismatched tag)" in bad.stderr
