"""`dalembert import`: mechanisms of other programs stand where they are drawn, and move.

The files under tests/data/formats are small examples of each program's format.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dalembert.errors import DataError
from tests.cli.imported import FORMATS, FOUR_BAR, at, moves, only, taken
from tests.conftest import Dalembert
from virtualwork import Mechanism

FILES = sorted(file for file in FORMATS.glob("*/*"))
POINT = re.compile(r"-?\d+(?:\.\d+)?")


@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.name}")
def test_every_example_is_taken_over_assembled_and_moves(
    file: Path, dalembert: Dalembert, tmp_path: Path
) -> None:
    done = dalembert("import", file, "-o", "m.toml")
    assert done.returncode == 0, done.stderr
    assert "refuse" not in done.stderr
    assert "stands" not in done.stderr.replace("where its bodies stand", "")
    m = Mechanism.from_toml(tmp_path / "m.toml")
    slide = m.inputs[0].is_slide
    moves(m, m.size * 1e-3 if slide else math.radians(2))
    assert dalembert("import", file).stdout == (tmp_path / "m.toml").read_text().replace(
        'name = "m"', f'name = "{file.stem}"'
    )


def test_linkage_points_stand_at_the_coordinates_of_the_file() -> None:
    text = (FORMATS / "linkage2/klann.linkage2").read_text()
    m = only(text)
    for x, y, name in re.findall(r'x="(\S+)" y="(\S+)" id="(\d+)"', text):
        expected = float(x) * 0.0254 / 96, float(y) * 0.0254 / 96
        assert at(m, f"C{name}") == pytest.approx(expected, rel=1e-14, abs=1e-13 * m.size)


def test_motiongen_points_stand_at_the_coordinates_of_the_file() -> None:
    text = (FORMATS / "motiongen/elliptical_crank.json").read_text()
    m = only(text)
    for joint in json.loads(text)["joints"]:
        if joint["id"] in ("J1", "J2", "J3", "J4", "J5", "J6"):
            expected = joint["x"] * 0.0254, joint["y"] * 0.0254
            assert at(m, joint["id"]) == pytest.approx(expected, rel=1e-14, abs=1e-13 * m.size)
    assert m.inputs[0].speed == pytest.approx(10 * math.pi / 30, rel=1e-15)


def test_linkage_sim_assembles_what_no_file_places_and_keeps_its_loads() -> None:
    m = only((FORMATS / "linkage_sim/four_bar.json").read_bytes())
    (x, y), (u, v) = at(m, "B"), at(m, "C")
    assert (x, y) == (0.11, 0.0)
    assert math.hypot(u - x, v - y) == pytest.approx(0.41, rel=1e-14)
    assert m.gravity == -9.81j
    assert m.links["coupler"].mass == 0.9
    assert m.inputs[0].speed == 2 * math.pi
    assert m.guess.angles["rocker"] == pytest.approx(m.motion(0.0).link("rocker").angle[0], abs=1e-14)


# --- Linkage ----------------------------------------------------------------------------------------------------
def linkage(inside: str) -> str:
    return f'<linkage2>\n<program units="Inches"/>\n{inside}\n</linkage2>\n'


ANCHORS = (
    '<connector id="0" anchor="true" input="true" rpm="15" x="0" y="0"/><connector id="1" x="0" y="96"/>'
)
CRANK = '<Link id="0"><connector id="0"/><connector id="1"/></Link>'


def test_missing_blanks_any_order_and_unknown_attributes_are_forgiven() -> None:
    text = linkage(
        '<connector anchor="true"rpm="15"input="true" colour="1" y="0" x="0"id="0"/>'
        '<connector y="96" x="0" id="1"/>' + CRANK
    )
    m = only(text)
    assert m.inputs[0].speed == pytest.approx(-15 * math.pi / 30)
    assert at(m, "C1") == pytest.approx((0, 0.0254))


def test_every_link_on_a_motor_turns_with_it() -> None:
    more = '<connector id="2" x="96" y="0"/><Link id="1"><connector id="0"/><connector id="2"/></Link>'
    m = only(linkage(ANCHORS + more + CRANK))
    assert len(m.links) == 1
    assert at(m, "C2", math.pi / 2) == pytest.approx((0, 0.0254))


def test_an_actuator_drives_along_its_line() -> None:
    text = linkage(
        '<connector id="0" anchor="true" x="0" y="0"/><connector id="1" anchor="true" x="96" y="0"/>'
        '<connector id="2" x="48" y="96"/>'
        '<Link id="0"><connector id="0"/><connector id="2"/></Link>'
        '<Link id="1" actuator="true" throw="48" cpm="15"><connector id="1"/><connector id="2"/></Link>'
    )
    m = only(text)
    assert m.inputs[0].is_slide
    assert m.inputs[0].speed == pytest.approx(2 * 0.5 * 0.0254 * 15 / 60)
    far = at(m, "C2", 0.01)
    assert math.dist(far, (0.0254, 0)) == pytest.approx(0.0254 * math.hypot(0.5, 1) + 0.01)
    assert math.dist(far, (0, 0)) == pytest.approx(0.0254 * math.hypot(0.5, 1))


@pytest.mark.parametrize(("kind", "ratio"), [("gears", -2.0), ("chain", 2.0)])
def test_gears_turn_against_each_other_and_chains_alike(kind: str, ratio: float) -> None:
    text = linkage(
        ANCHORS + CRANK + '<connector id="3" anchor="true" x="192" y="0"/>'
        '<Link id="7" gear="true"><connector id="0"/></Link><Link id="8" gear="true"><connector id="3"/></Link>'
        f'<ratios><ratio type="{kind}"><link id="7" size="2"/><link id="8" size="1"/></ratio></ratios>'
    )
    motion = only(text).motion(0.2, speed=1.0)
    assert motion.link("L8").omega[0] == pytest.approx(ratio)


def test_a_planet_meshes_with_a_gear_on_the_motors_shaft() -> None:
    text = linkage(
        ANCHORS
        + CRANK
        + '<connector id="9" anchor="true" x="0" y="0"/><connector id="8" anchor="true" x="300" y="0"/>'
        '<Link id="5" gear="true"><connector id="9"/><connector id="8"/></Link>'
        '<Link id="6" gear="true"><connector id="1"/></Link>'
        '<ratios><ratio type="gears"><link id="5" size="2"/><link id="6" size="1"/></ratio></ratios>'
    )
    assert only(text).motion(0.2, speed=1.0).link("L6").omega[0] == pytest.approx(3.0)


def test_a_fixed_pin_in_a_moving_slot_and_a_rider_on_a_moving_link() -> None:
    over = '<slidelimit id="1"/><slidelimit id="2"/></connector>'
    text = linkage(
        ANCHORS
        + CRANK
        + '<connector id="2" x="400" y="96"/><Link id="1"><connector id="1"/><connector id="2"/></Link>'
        + f'<connector id="3" anchor="true" slider="true" x="200" y="96">{over}'
    )
    m = only(text)
    assert [(g.link, g.on, g.point) for g in m.guides] == [("ground", "L1", "C3")]
    x, y = at(m, "C2", -math.pi / 2)
    assert (x / 0.0254 * 96, y / 0.0254 * 96) == pytest.approx(
        (96 + 400 * 104 / math.hypot(104, 96), 400 * 96 / math.hypot(104, 96))
    )


@pytest.mark.parametrize("how", ['fastenlink="0"', '><fastenlink id="0"/', "attribute"])
def test_fastened_parts_are_one(how: str) -> None:
    head = f'<Link id="5" {how}>' if how != "attribute" else '<Link id="5"><fastenconnector id="1"/>'
    more = f'<connector id="2" x="96" y="0"/>{head}<connector id="2"/><connector id="1"/></Link>'
    m = only(linkage(ANCHORS + CRANK + more))
    assert list(m.links) == ["L0"]


def test_arcs_drawings_and_idle_parts_are_named() -> None:
    text = linkage(
        ANCHORS + CRANK + '<connector id="9" layer="2" x="1" y="1"/>'
        '<connector id="4" x="9" y="9"/><connector id="5" x="19" y="9"/>'
        '<Link id="4"><connector id="4"/><connector id="5"/></Link>'
        '<connector id="6" slider="true" slideradius="30" x="2" y="2"><slidelimit id="4"/><slidelimit id="5"/></connector>'
    )
    _, notes = taken(text)
    said = "\n".join(notes)
    assert "L4: left out" in said
    assert "slideradius of C6: left out" in said
    assert "drawing only" in said


def test_doubled_links_and_two_machines_in_one_file() -> None:
    second = ANCHORS.replace('"0" y', '"500" y').replace('id="0"', 'id="20"').replace('id="1"', 'id="21"')
    other = '<Link id="6"><connector id="20"/><connector id="21"/></Link>'
    found, _ = taken(linkage(ANCHORS + second + CRANK + CRANK.replace('Link id="0"', 'Link id="1"') + other))
    assert [list(m.links) for m in found] == [["L0"], ["L6"]]
    assert found[1].links["L6"].points.keys() == {"C20", "C21"}


# --- MotionGen ----------------------------------------------------------------------------------------------------
def test_a_motiongen_document_of_the_program_itself() -> None:
    data = json.loads((FORMATS / "motiongen/slider_crank_invented.json").read_text())
    for link in data["links"]:
        link["jointIds"] = link.pop("joints")
        link["slotIds"] = link.pop("slots", [])
    m = only(json.dumps({"version": 1, "mechanism": data}))
    assert at(m, "J3") == pytest.approx((3.2 * 0.0254, 0), abs=1e-16)


def test_a_welded_end_of_a_cylinder_fixes_its_guide() -> None:
    data = json.loads((FORMATS / "motiongen/cylinder_boom_invented.json").read_text())
    data["joints"][3]["isWelded"] = True
    data["links"][0]["joints"] = ["J3", "J2"]
    data["links"].append({"joints": ["J2", "J1"]})
    m = only(json.dumps(data))
    assert m.guides[0].on == "ground"


# --- linkage_sim ----------------------------------------------------------------------------------------------------
def four_bar() -> Any:
    return json.loads((FORMATS / "linkage_sim/four_bar.json").read_text())


def test_fixed_bodies_and_point_masses_become_one_body() -> None:
    data = four_bar()
    data["bodies"]["arm"] = {
        "attachment_points": {"X": [0, 0], "Y": [0, 0.1]},
        "mass": 0.9, "cg_local": [0.0, 0.0], "izz_cg": 0.0,
        "point_masses": [{"mass": 0.1, "local_pos": [0, 0]}],
    }  # fmt: skip
    data["joints"]["F"] = {
        "type": "fixed", "body_i": "coupler", "point_i": "C", "body_j": "arm", "point_j": "X",
        "delta_theta_0": math.pi / 2,
    }  # fmt: skip
    m = only(json.dumps(data))
    assert "arm" not in m.links
    coupler = m.links["coupler"]
    assert coupler.mass == pytest.approx(1.9)
    assert coupler.center == pytest.approx((0.9 * 0.205 + 1.0 * 0.41) / 1.9)
    assert coupler.inertia == pytest.approx(0.012 + 0.9 * 1.0 / 1.9 * 0.205**2)
    assert coupler.points["Y"] == pytest.approx(0.31)


def test_a_moment_of_inertia_without_mass_is_kept() -> None:
    """As of a wheel on a fixed axle; a mass on it adds its own m·r²."""
    data = four_bar()
    data["bodies"]["crank"] |= {"mass": 0.0, "izz_cg": 0.02}
    assert only(json.dumps(data)).rigid["crank"].inertia == 0.02
    data["bodies"]["crank"]["point_masses"] = [{"mass": 0.5, "local_pos": [0.1, 0]}]
    crank = only(json.dumps(data)).rigid["crank"]
    assert (crank.mass, crank.center, crank.inertia) == (0.5, 0.1, 0.02)


def test_bodies_drawn_in_the_axes_of_the_ground_stand_there() -> None:
    data = four_bar()
    places = {
        "A": (0, 0),
        "B": (0.0, 0.11),
        "C": (0.3, 0.27),
        "D": (0.38, 0.0),
        "O2": (0, 0),
        "O4": (0.38, 0),
    }
    for body in data["bodies"].values():
        body["attachment_points"] = {p: places[p] for p in body["attachment_points"]}
    data["drivers"]["D1"]["theta_0"] = 0.3
    (m,), notes = taken(json.dumps(data))
    assert at(m, "C") == pytest.approx(places["C"], rel=1e-13)
    assert any("theta_0 is left out" in note for note in notes)


def test_a_driven_distance_is_a_cylinder() -> None:
    data = four_bar()
    del data["drivers"]
    data["linear_drivers"] = [
        {"id": "L", "body_a": "ground", "point_a": [0.2, -0.1], "body_b": "crank", "point_b": [0.06, 0.02],
         "velocity": 0.01, "length_0": 0.19}
    ]  # fmt: skip
    m = only(json.dumps(data))
    (x, y), (u, v) = at(m, "linear driver L b", 0.005), (0.2, -0.1)
    assert math.hypot(x - u, y - v) == pytest.approx(0.195, rel=1e-13)
    assert m.inputs[0].speed == 0.01


def test_springs_and_loads_keep_their_meaning_and_the_rest_is_named() -> None:
    data = four_bar()
    data["forces"] += [
        {"type": "LinearSpring", "body_a": "crank", "point_a": [0.11, 0], "body_b": "ground", "point_b": [0.1, 0.3],
         "stiffness": 100.0, "free_length": 0.2},
        {"type": "TorsionSpring", "body_i": "ground", "body_j": "rocker", "stiffness": 2.0, "free_angle": 0.1},
        {"type": "ExternalTorque", "body_id": "rocker", "torque": 1.5},
        {"type": "ForceZone", "body_id": "rocker"},
        {"type": "ExternalForce", "body_id": "rocker", "local_point": [0, 0], "force": [1, 0],
         "modulation": {"modulation_type": "Expression", "expr": "__import__('os')"}},
    ]  # fmt: skip
    (m,), notes = taken(json.dumps(data))
    assert (m.springs[0].stiffness, m.springs[0].free_length) == (100.0, 0.2)
    assert m.torsion_springs[0].free_angle == 0.1
    assert m.torques[0].torque == 1.5
    assert not m.forces
    assert any("ForceZone" in note for note in notes)
    assert any("ExternalForce" in note for note in notes)


# --- properties ----------------------------------------------------------------------------------------------------
number_text = st.integers(-9999, 9999).map(lambda k: k / 100)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(number_text, number_text), min_size=5, max_size=5, unique=True))
def test_coordinates_in_are_coordinates_out(places: list[tuple[float, float]]) -> None:
    """Any four-bar with a coupler point, away from its dead points and change points."""
    a, b, c, d, _ = (complex(*z) for z in places)
    arms = [(b - a), (c - b), (c - d)]
    if any(abs(arm) < 1 for arm in arms) or abs(a - d) < 1 or abs((arms[1].conjugate() * arms[2]).imag) < 20:
        return
    names = ["ground crank", "crank coupler", "coupler rocker", "rocker ground", "coupler"]
    m = only("\n".join(f"{n} R {x!r} {y!r}" for n, (x, y) in zip(names, places, strict=True)))
    for k, z in enumerate(places, 1):
        assert at(m, f"J{k}") == pytest.approx(z, rel=1e-10, abs=1e-10)
    moves(m, 1e-3)


def test_a_symmetric_double_butterfly_moves_from_where_it_is_drawn() -> None:
    """Its drawn pose is a triple root: the links move as the cube root of the input, and no rate is determined there."""
    text = "\n".join(
        [
            "crank ground R 0 0",
            *(
                "crank up1 R 3 3",
                "crank up2 R -3 3",
                "up1 wing1 R 3 8",
                "up2 wing2 R -3 8",
                "wing1 wing2 R 0 10",
            ),
            *("wing1 leg1 R 5 10", "wing2 leg2 R -5 10", "leg2 ground R -5 -4", "leg1 ground R 5 -4"),
        ]
    )
    (m,), notes = taken(text)
    assert not any("cannot move" in note or "drawn place" in note for note in notes)
    turn = np.array([1e-9, 8e-9, 1e-6, 1e-3, 0.01, 0.1, 0.2])
    q = np.concatenate([-turn[::-1], [0.0], turn])
    motion = m.motion(q, speed=1.0)
    assert motion.assembled.all()
    at = {name: motion.point(name).position for name in (f"J{k}" for k in range(1, 11))}
    assert at["J6"][7] == pytest.approx([0, 10], abs=1e-15)
    # the same linkage, mirrored for the mirrored input
    for a, b, length in (
        ("J7", "J10", 14),
        ("J8", "J9", 14),
        ("J2", "J4", 5),
        ("J3", "J5", 5),
        ("J4", "J6", 13**0.5),
    ):
        assert np.hypot(*(at[a] - at[b]).T) == pytest.approx(length, rel=1e-12)
    assert at["J6"][::-1] * [-1, 1] == pytest.approx(at["J6"], abs=1e-6)
    # eight times the input is twice the way
    assert at["J6"][9, 0] / at["J6"][8, 0] == pytest.approx(2, rel=1e-3)
    # and the rates are those of the places
    before, after = (m.motion(0.1 + h).point("J6").position[0] for h in (-1e-5, 1e-5))
    assert (after - before) / 2e-5 == pytest.approx(motion.point("J6").velocity[13], rel=1e-6)
    assert np.isnan(motion.point("J6").velocity[7]).all()


@pytest.mark.parametrize(("turned", "goes_on"), [(0.3, True), (0.7, False)])
def test_a_double_butterfly_of_rounded_coordinates(turned: float, goes_on: bool) -> None:
    """Six decimals: still nearly upright, or with a fold of its own between the two sides, which is not stepped over."""
    rows = [
        *("crank ground 0 0", "crank up1 3 3", "crank up2 -3 3", "up1 wing1 3 8", "up2 wing2 -3 8"),
        *("wing1 wing2 0 10", "wing1 leg1 5 10", "wing2 leg2 -5 10", "leg2 ground -5 -4", "leg1 ground 5 -4"),
    ]
    drawn = []
    for a, b, x, y in (row.split() for row in rows):
        z = complex(float(x), float(y)) * np.exp(1j * turned)
        drawn.append(f"{a} {b} R {z.real:.6f} {z.imag:.6f}")
    (m,), notes = taken("\n".join(drawn))
    assert m.motion(np.linspace(-0.2, 0.2, 41)).assembled.sum() == (41 if goes_on else 1)
    assert any("its input cannot move" in note for note in notes) != goes_on


def test_limits_of_strokes_and_turns_are_named() -> None:
    text = (FORMATS / "motiongen/cylinder_boom_invented.json").read_text()
    assert any("stroke 0.8 of cylinder 1: left out" in note for note in taken(text)[1])
    turning = (FORMATS / "motiongen/elliptical_crank.json").read_text()
    assert not any("max" in note for note in taken(turning)[1])
    said = taken(
        turning.replace('"riders": ["J6"]', '"riders": ["J6"], "max": 2').replace("{", '{"springs": [1],', 1)
    )[1]
    assert any("max 2 of slot 1: left out" in note for note in said)
    assert any("springs: left out" in note for note in said)
    said = taken(turning.replace('"max": 360', '"max": 90'))[1]
    assert any("min 0, max 90 of actuator 1: left out" in note for note in said)


# --- bad input ----------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the file is empty: expected a mechanism of another program"),
        ("hello world", "unknown format"),
        ("<html/>", "unknown format"),
        ("\0\1\2", "unknown format"),
        ("ground a R 0 0\na b R 1", "line 2: found 'a b R 1', expected link"),
        ("ground a R 0 0\na ground R nan 1", "expected link"),
        ("ground a R 0 0\na b R 1e999 1", "line 2"),
        ('{"bodies": {"ground": ', "line 1, column"),
        ("[" * 100_000, "nested too deeply"),
        ('{"joints": [{"id": "A", "x": 0}], "links": []}', "joint 1"),
        ('{"joints": [{"id": "A", "x": NaN, "y": 0}], "links": []}', "NaN"),
        ('{"joints": [{"id": "A", "x": 0, "y": 0}], "links": [{"joints": ["B"]}]}', "link 1"),
        ('{"bodies": {"ground": {}}, "joints": {}}', "body ground: 'attachment_points' is missing"),
        ("<linkage2><connector id='0' x='1'", "line 1: found '<connector id='0' x='1'', expected a tag"),
        ("<linkage2>\n<Link id='0'>\n", "<Link> is not closed; is the file cut off?"),
        ("<linkage2>\n<Link id='0'><connector id='3'/></Link></linkage2>", "line 2: <Link> 0"),
        ('<!DOCTYPE l [<!ENTITY a "aa">]><linkage2/>', "refused"),
        ("<linkage2>" + "<a>" * 50, "nested more than 20 deep"),
        ("0P.TY.K,0.101.MA,A,0mv,0VU,0.GB,B,0e_,E6,0", "the string ends there"),
        ("0P.TY.K,0.101.MA,A,0mv.GB,B,0e_,E6,0..YRAB,AB,Fe,Fe,0ix,08i,c5cae9,A,B,,...JBq", "joint 1"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_with_their_place(text: str, said: str) -> None:
    with pytest.raises(DataError) as error:
        taken(text)
    assert said in str(error.value)


def test_a_bad_file_is_one_line_and_status_1(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("ground a R 0 0\na b R 1")
    done = dalembert("import", "a.txt", "-o", "b.toml")
    assert done.returncode == 1
    assert done.stderr.startswith("dalembert: a.txt: line 2: ")
    assert not (tmp_path / "b.toml").exists()
    assert dalembert("import", "none.txt").returncode == 1
    assert dalembert("import", "a.txt", "--from", "cad").returncode == 2
    assert dalembert("import", "a.txt", "-o", "b.csv").returncode == 2
    big = tmp_path / "big.txt"
    big.write_bytes(b"ground a R 0 0\n" * 700_000)
    assert "10 MB" in dalembert("import", "big.txt").stderr


def test_an_input_is_never_written_over(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(FOUR_BAR.replace("|", "\n"))
    assert dalembert("import", "a.toml", "-o", "a.toml").returncode == 2
    assert "ground input" in (tmp_path / "a.toml").read_text()
