"""Robots that the tests of `dalembert import` read: one of each format, and how they are taken over."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from cli.formats import read
from dalembert.errors import DataError
from virtualwork import Mechanism
from virtualwork.exchange.description import described
from virtualwork.exchange.settled import settle


def taken(text: str, folder: Path | None = None) -> tuple[Mechanism, list[str]]:
    """The only mechanism of a robot file, and everything that is said."""
    _, (drawing,) = read("file", text.encode(), None, folder)
    (part,) = settle(drawing)
    made = described(part, "test")
    return Mechanism.from_toml_text(made), drawing.notes + part.notes


def refused(text: str, folder: Path | None = None) -> str:
    with pytest.raises(DataError) as error:
        taken(text, folder)
    return str(error.value)


# the four-bar of Gazebo's own tutorial: links in one plane, joints where they meet


SDF = """<?xml version="1.0"?>
<sdf version="1.6"><model name="four bar"><pose>0 0 0.5 0 0 0</pose>
<link name="AB"><pose>0 0 0 0 0 0</pose><inertial><pose>0 0.1 0 0 0 0</pose><mass>2</mass>
  <inertia><ixx>0.01</ixx><iyy>0.001</iyy><izz>0.011</izz></inertia></inertial></link>
<link name="BC"><pose>0 0.2 0 0 0 0</pose></link>
<link name="CD"><pose>0.3 0.2 0 0 0 0</pose></link>
<frame name="P" attached_to="BC"><pose>0.1 0.05 0 0 0 0</pose></frame>
<joint name="A" type="revolute"><parent>world</parent><child>AB</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="B" type="revolute"><parent>AB</parent><child>BC</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="C" type="revolute"><parent>BC</parent><child>CD</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="D" type="revolute"><parent>world</parent><child>CD</child><pose>0.02 -0.2 0 0 0 0</pose>
  <axis><xyz>0 0 1</xyz></axis></joint>
</model></sdf>"""


URDF = """<robot name="four bar">
<link name="base"/><link name="crank"/><link name="coupler"/><link name="rocker"/><link name="tip"/>
<joint name="A" type="continuous"><parent link="base"/><child link="crank"/><axis xyz="0 -1 0"/>
  <origin xyz="0 0 0.5"/></joint>
<joint name="B" type="continuous"><parent link="crank"/><child link="coupler"/><axis xyz="0 1 0"/>
  <origin xyz="0 0 0.2"/></joint>
<joint name="D" type="continuous"><parent link="base"/><child link="rocker"/><axis xyz="0 1 0"/>
  <origin xyz="0.32 0 0.5"/></joint>
<joint name="P" type="fixed"><parent link="coupler"/><child link="tip"/><origin xyz="0.1 0 0.05"/></joint>
{loop}
<transmission name="t"><joint name="A"/></transmission>
</robot>"""


LOOPS = {
    "gazebo": """<gazebo><joint name="C" type="revolute"><parent>coupler</parent><child>rocker</child>
<pose>-0.02 0 0.2 0 0 0</pose><axis><xyz>0 1 0</xyz></axis></joint></gazebo>""",
    "loop_joint": """<loop_joint name="C" type="continuous"><link1 link="coupler" xyz="0.3 0 0"/>
<link2 link="rocker" xyz="-0.02 0 0.2"/><axis xyz="0 1 0"/></loop_joint>""",
    "second parent": """<link name="end"/>
<joint name="E" type="fixed"><parent link="rocker"/><child link="end"/><origin xyz="-0.02 0 0.2"/></joint>
<joint name="C" type="continuous"><parent link="coupler"/><child link="end"/><axis xyz="0 1 0"/>
  <origin xyz="0.3 0 0"/></joint>""",
}


PISTON = 0.1 + 0.3 * math.cos(math.radians(20)), 1 - 0.3 * math.sin(math.radians(20))


MJCF = f"""<mujoco model="slider crank">
<compiler angle="degree" inertiafromgeom="false"/>
<default><joint axis="0 1 0"/><default class="rail"><joint type="slide" axis="1 0 0"/></default></default>
<worldbody>
 <body name="crank" pos="0 0 1"><joint name="hip" damping="1"/>
  <inertial pos="0.05 0 0" mass="0.2" diaginertia="1e-4 2e-4 3e-4"/>
  <body name="rod" pos="0.1 0 0" euler="0 20 0"><joint name="knee"/><site name="mid" pos="0.15 0 0"/></body></body>
 <body name="piston" pos="{PISTON[0]!r} 0 {PISTON[1]!r}"><joint name="bore" class="rail"/></body>
</worldbody>
<equality><connect body1="rod" body2="piston" anchor="0.3 0 0"/></equality>
<actuator><position name="m" joint="hip"/></actuator>
<keyframe><key qpos="0 0 0" qvel="3 0 0"/></keyframe>
</mujoco>"""
