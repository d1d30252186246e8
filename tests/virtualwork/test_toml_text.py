"""A mechanism is read back the same from the TOML text of its parts."""

from __future__ import annotations

import dataclasses
import json
import random
import re
import tomllib
from pathlib import Path
from typing import ClassVar

import pytest

from virtualwork import (
    Force,
    Gear,
    Guess,
    Guide,
    Input,
    Link,
    Mechanism,
    Motor,
    Spring,
    Torque,
    TorsionSpring,
)
from virtualwork.describe import DescriptionError
from virtualwork.describe.dimensions import changed, dimensions
from virtualwork.describe.file import Entry, File
from virtualwork.describe.forms import Body, Place, Scalar
from virtualwork.describe.keys import Part, check, declared, keys_of, read_fields, table_keys
from virtualwork.describe.parts import PARTS, TABLES, Friction, Polar
from virtualwork.describe.text import table_of, toml_text, written
from virtualwork.describe.units import Units
from virtualwork.toml_template import toml_template

ROOT = Path(__file__).parents[2]
FILES = [
    path
    for path in sorted((ROOT / "cli" / "examples").glob("*/*.toml"))
    if "links" in tomllib.loads(path.read_text(encoding="utf-8"))
]
UNITS = [("m", "rad"), ("mm", "deg"), ("in", "deg"), ("ft", "rad")]


def everything() -> Mechanism:
    """Every part, and every field of it that a file can hold, off its default."""
    return Mechanism(
        name='a "name"',
        gravity=(0.3, -9.81),
        ground={"A": (0.1, 0.2), "D": (0.4, 0), "S": (0, -0.2), "R": (0.9, 0)},
        links={
            "crank": Link({"A": 0j, "B": (0.1, 0.03)}, 0.5, (0.04, 0.01), 0.003),
            "coupler": Link({"B": 0j, "C": (0.35, 0), "P": Polar("C", 0.2, 0.3), "mass": (0.1, 0.2)}),
            "rocker": Link({"D": 0j, "C": (0.25, 0)}),
            "rod": Link({"P": 0j, "Q": (0.5, 0)}, 1.0),
            "block 1": Link({"Q": 0j}),
        },
        guides=[
            Guide("Q", "block 1", "ground", (0.1 + 0.3j), 0.2, 0.1),
            Guide("P", "rod", "coupler", "C", 0.1),
        ],
        gears=[Gear(("crank", "rocker"), -2.5, "coupler")],
        inputs=[Input("crank", "rocker", value=1.0, speed=2.0, acceleration=3.0, jerk=4.0), Input(slider="Q", value=0.2, speed=1.0)],
        guess=Guess([1.0, 0.2], {"coupler": 0.3}, {"C": (0.4, 0.2)}),
        forces=[Force("coupler", "P", (1 + 2j), "link"), Force("rod", 0.1 + 0.2j, 3j), Force("rod", None, 1 + 0j)],
        torques=[Torque("rocker", -0.7)],
        springs=[Spring((("coupler", "P"), ("ground", "S")), 100.0, 0.1, 3.0)],
        torsion_springs=[TorsionSpring(("crank", "ground"), 2.0, 0.3, 0.1)],
        motors=[Motor("coupler", "rod", 0.2, 0.1 + 0.05j)],
        friction=[Friction("C", 0.1, 0.01)],
        tolerances={"links.crank.B": 1e-5, "springs.1.stiffness": 2.0, "sliders.1.turned": 0.01},
    )  # fmt: skip


@pytest.mark.parametrize("units", UNITS)
def test_every_part_is_read_back(units: tuple[str, str]) -> None:
    m = everything()
    back = Mechanism.from_toml_text(toml_text(m, *units))
    # slots stand before sliders in a file
    order = dataclasses.replace(m, guides=m.guides[::-1])
    assert back == order
    assert list(dimensions(back)) == list(dimensions(order))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_examples_are_read_back(path: Path) -> None:
    m = Mechanism.from_toml(path)
    for units in UNITS:
        assert Mechanism.from_toml_text(toml_text(m, *units), folder=path.parent) == m


@pytest.mark.slow
def test_any_numbers_are_read_back() -> None:
    rng, m = random.Random(25), everything()
    for _ in range(300):
        paths = [path for path in dimensions(m) if rng.random() < 0.3]
        other = changed(m, {path: rng.uniform(0.1, 1) * 10 ** rng.randint(-9, 6) for path in paths})
        units = rng.choice(UNITS)
        assert Mechanism.from_toml_text(toml_text(other, *units)) == dataclasses.replace(
            other, guides=other.guides[::-1]
        )


def test_what_no_file_can_say_is_refused() -> None:
    arm = {"arm": Link({"O": 0j, "P": 1})}
    spring = Spring((("arm", 1 + 1j), ("ground", "O")), 3.0)
    with pytest.raises(DescriptionError, match=r"\[\[springs\]\] 1: .* needs a named point"):
        toml_text(Mechanism({"O": 0j}, arm, inputs=Input("arm"), springs=[spring]))
    wound = TorsionSpring(("ground", "arm"), 3.0, turns=2)
    with pytest.raises(DescriptionError, match=r"\[\[torsion_springs\]\] 1: turns: cannot be written"):
        toml_text(Mechanism({"O": 0j}, arm, inputs=Input("arm"), torsion_springs=[wound]))
    with pytest.raises(DescriptionError, match="unknown key 'stifness'; did you mean 'stiffness'"):
        written({"links": {}, "springs": [{"stifness": 3}]})


def test_a_point_beside_its_table_is_told_where_it_belongs() -> None:
    text = "[ground]\nO = [0, 0]\n[links.crank]\n{} = [0, 0]\n"
    for key, expected in (("O", "expected points = { O = [x, y], … }"), ("centre", "did you mean 'center'?")):
        with pytest.raises(
            DescriptionError, match=re.escape(f"[links.crank]: unknown key '{key}'")
        ) as refused:
            Mechanism.from_toml_text(text.format(key))
        assert str(refused.value).endswith(expected)


def test_every_key_fills_a_field_of_its_part() -> None:
    assert {table for kind in PARTS for table in kind.tables} == set(TABLES)
    for table, kind in TABLES.items():
        names = {f.name for f in dataclasses.fields(kind)}
        assert {key.field for key in table_keys(kind, table).values()} <= names
        for key in keys_of(kind):
            # what a schema shows as the default is JSON
            json.dumps(key.shown)
            assert (
                key.needed
                or key.unless
                or key.shown is not None
                or key.default is None
                or callable(key.default)
            )


CAM = """
[ground]
U = [0, 0]
[links.cam]
points = { U = [0, 0] }
[links.valve]
points = { F = [0, 0] }
[[sliders]]
point = "F"
[input]
link = "cam"
[[cams]]
cam = "cam"
slider = "F"
base_radius = 0.02
"""
TURN = "[{ to = 2, rise = 0.01, motion = '3-4-5' }, { to = 3, motion = 'dwell' }, { motion = '3-4-5' }]"
WHOLE = (
    "[{ from = 0, to = 2, rise = 0.01, motion = '3-4-5' }, { from = 2, to = 3, motion = 'dwell' },"
    " { from = 3, to = '1 rev', rise = -0.01, motion = '3-4-5' }]"
)


@pytest.mark.parametrize("law", [TURN, WHOLE])
def test_the_file_of_a_page_has_a_place_for_every_number_of_a_cams_law(law: str) -> None:
    m = Mechanism.from_toml_text(f"{CAM}law = {law}")
    lines = toml_template(m, list(m.dimensions))
    assert lines is not None
    text = "\n".join(
        "".join(piece if isinstance(piece, str) else repr(m.value(piece[0])) for piece in line["of"])
        for line in lines
        if line["needed"]
    )
    assert Mechanism.from_toml_text(text) == m


MIRROR = [
    ({"friction": [Friction("X", 0.1)]}, r"\[\[friction\]\] 1 joint: unknown point 'X'"),
    ({"motors": [Motor("arm", "ram")]}, r"\[\[motors\]\] 1 drives: unknown link 'ram'"),
    ({"motors": [Motor("ram", "arm")]}, r"\[\[motors\]\] 1 carrier: unknown link 'ram'"),
    ({"torsion_springs": [TorsionSpring(("ram", "arm"))]}, r"\[\[torsion_springs\]\] 1 links: unknown link 'ram'"),
    ({"forces": [Force("arm", "X", 1j)]}, r"\[\[forces\]\] 1 point: unknown point of link arm 'X'"),
    ({"forces": [Force("arm", None, 1j, "world")]}, r"\[\[forces\]\] 1 frame: found 'world'"),
    ({"forces": [Torque("arm", 1.0)]}, "forces 1: expected Force, found Torque"),
    ({"friction": [Friction("P", -0.1)]}, r"\[\[friction\]\] 1 coefficient: found -0.1, but it must not be negative"),
    ({"friction": [Friction("P", 0.1, -0.01)]}, r"\[\[friction\]\] 1 radius: found -0.01, but it must not be negative"),
    ({"motors": [Motor("arm", "arm", -1.0)]}, r"\[\[motors\]\] 1 mass: found -1.0, but it must not be negative"),
    ({"gears": [Gear(("arm", "arm"), 2.0)]}, r"\[\[gears\]\] 1: found the links arm and arm and the arm ground"),
    ({"inputs": [Input("arm", on="arm")]}, r"\[input\] on: link 'arm' cannot turn against itself"),
    ({"inputs": [Input("arm", slider="P")]}, r"\[input\].*either a link or a slider"),
]  # fmt: skip


@pytest.mark.parametrize(("parts", "message"), MIRROR)
def test_names_are_checked_in_python_as_in_a_file(parts: dict[str, list[object]], message: str) -> None:
    arm = {"arm": Link({"O": 0j, "P": 1})}
    with pytest.raises(DescriptionError, match=message):
        Mechanism({"O": 0j}, arm, **({"inputs": Input("arm")} | parts))  # type: ignore[arg-type]


ARM = "[ground]\nO = [0, 0]\n[links.arm]\npoints = { O = [0, 0], P = [1, 0] }\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[input]\nlink = "arm"\nposition = 1', r"\[input\]: 'position' needs 'slider', which is missing"),
        ('[input]\nslider = "P"\nlink = "arm"', r"\[input\]: found both of link and slider"),
        ("[input]\nspeed = 1", r"\[input\]: found none of link and slider"),
        ('[input]\nlink = "arm"\n[[forces]]\nlink = "arm"', r"\[\[forces\]\] 1: found none of force and table"),
        ('[input]\nlink = "arm"\n[[torques]]\nlink = "arm"', r"\[\[torques\]\] 1: 'torque' is missing"),
        ('[input]\nlink = "arm"\n[[friction]]\njoint = "X"\ncoefficient = 1', r"\[\[friction\]\] 1 joint: unknown"),
        ('[input]\nlink = "arm"\n[[springs]]\nbetween = ["arm.X", "ground.O"]', r"1 between: unknown point of link arm"),
        ('[input]\nlink = "arm"\n[[springs]]\nbetween = ["ram.P", "ground.O"]', r"1 between: unknown link 'ram'"),
        ('[input]\nlink = "arm"\n[guess]\nP = 3', r"\[guess\] P: found 3, expected two numbers \[x, y\]"),
        ('[input]\nlink = "arm"\n[guess]\narm = [1, 2]', r"\[guess\] arm: found \[1, 2\], expected an angle"),
        ('[input]\nlink = "arm"\n[guess]\nram = 3', r"\[guess\] ram: unknown link or point 'ram'; did you mean 'arm'"),
        ('[input]\nslider = "P"\n[[slots]]\npoint = "Q"\nlink = "arm"', r"\[\[slots\]\] 1 \(Q\) point: unknown point of link arm 'Q'"),
        ('[input]\nlink = "arm"\n[[forces]]\nlink = "arm"\nforce = [0, 0]\nframe = "lnk"', r"frame: found 'lnk', expected 'ground' or 'link'; did you mean 'link'"),
        (f'[input]\nlink = "arm"\nspeed = 1{"0" * 300}', r"\[input\] speed: found 10{56}\.\.\., expected an angular speed"),
    ],
)  # fmt: skip
def test_files_are_refused_in_words_of_their_keys(text: str, message: str) -> None:
    with pytest.raises(DescriptionError, match=message):
        Mechanism.from_toml_text(ARM + text)


def test_the_guess_of_a_driven_slide_is_where_it_stands_as_the_guess_of_a_driven_link_is() -> None:
    slide = (
        "[ground]\nO = [0, 0]\n[links.block]\npoints = { B = [0, 0] }\n[[sliders]]\npoint = 'B'\n"
        "[input]\nslider = 'B'\n[guess]\nB = '20 mm'"
    )
    assert Mechanism.from_toml_text(slide).at == (0.02,)
    assert Mechanism.from_toml_text(f"{ARM}[input]\nlink = 'arm'\n[guess]\narm = '20 mrad'").at == (0.02,)
    # a position of the file's own pose comes before it
    own = slide.replace("slider = 'B'", "slider = 'B'\nposition = '3 mm'")
    assert Mechanism.from_toml_text(own).at == (0.003,)


def test_a_torque_by_a_table_has_no_constant_to_vary() -> None:
    arm = {"arm": Link({"O": 0j, "P": 1})}
    m = Mechanism({"O": 0j}, arm, inputs=Input("arm"), torques=[Torque("arm", history=((0, 1), (1, 2)))])
    assert "torques.1.torque" not in dimensions(m)
    # its mirror image: a force by a table
    m = Mechanism({"O": 0j}, arm, inputs=Input("arm"), forces=[Force("arm", "P", history=((0, 1j), (1, 2j)))])
    assert not [path for path in dimensions(m) if path.startswith("forces")]


@dataclasses.dataclass(frozen=True)
class Rack(Part):
    """A part that no room knows."""

    tables: ClassVar = ("racks",)
    collection: ClassVar = "racks"

    link: str = declared(Body(ground=False), "the rack")
    pinion: str = declared(Body(), "the toothed link", default="ground")
    radius: float = declared(Scalar("length", negative=False), "of the pinion", default=0.05)
    at: complex = declared(Place("link"), "a point of the pitch line", default=0j)


def test_a_new_part_is_its_dataclass_alone() -> None:
    file = File({}, Path(), Path.read_bytes)
    file.units = Units({"length": "mm"})
    keys = table_keys(Rack, "racks")
    rack = Rack(**read_fields(Entry(file, "[[racks]] 1", {"link": "arm", "radius": 20, "at": [3, 4]}), keys))
    assert rack == Rack("arm", "ground", 0.02, 0.003 + 0.004j)
    assert table_of(rack, file.units) == {"link": "arm", "radius": 20, "at": [3, 4]}
    assert keys["radius"].shown == 0.05
    m = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 1})}, inputs=Input("arm"))
    check(rack, "[[racks]] 1", m)
    for wrong, message in [
        (Rack("ram"), r"\[\[racks\]\] 1 link: unknown link 'ram'; did you mean 'arm'"),
        (Rack("arm", at="X"), r"\[\[racks\]\] 1 at: unknown point of link arm 'X'"),  # type: ignore[arg-type]
        (Rack("arm", radius=-1.0), r"\[\[racks\]\] 1 radius: found -1.0, but it must not be negative"),
    ]:
        with pytest.raises(DescriptionError, match=message):
            check(wrong, "[[racks]] 1", m)
    with pytest.raises(DescriptionError, match="unknown key 'radios'; did you mean 'radius'"):
        read_fields(Entry(file, "[[racks]] 1", {"link": "arm", "radios": 20}), keys)
