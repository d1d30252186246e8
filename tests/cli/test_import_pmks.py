"""`dalembert import` of PMKS: text, links, JSON, and the links of PMKS+."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

from tests.cli.imported import FORMATS, FOUR_BAR, at, only, taken
from tests.conftest import Dalembert
from virtualwork import Mechanism
from virtualwork.exchange.pmksweb import number


@pytest.mark.parametrize("file", sorted(FORMATS.glob("pmks_text/*")), ids=lambda file: file.name)
def test_pmks_points_stand_at_the_coordinates_of_the_file(file: Path) -> None:
    m = only(file.read_bytes())
    for k, line in enumerate(file.read_text().splitlines(), 1):
        words = re.split(r"[,\s]+", line)
        x, y = [float(w) for w in words if re.fullmatch(r"-?\d+(\.\d+)?", w)][:2]
        if f"J{k}" in {p for body in m.bodies.values() for p in body}:
            assert at(m, f"J{k}") == pytest.approx((x, y), rel=1e-14, abs=1e-13 * m.size)


def test_a_pmks_link_is_decoded_and_its_speed_is_counter_clockwise() -> None:
    plain = only(f"https://somewhere/pmks.html?set=s-20|f5&mech={FOUR_BAR}")
    coded = only("http://x/?set=s-20&mech=" + FOUR_BAR.replace(" ", "%20").replace("|", "%7C"))
    assert plain.links == coded.links
    assert plain.inputs[0].speed == pytest.approx(-20 * math.pi / 30)
    assert plain.inputs[0].link == "input"
    assert at(plain, "J5") == pytest.approx((1, 5))


def test_names_of_the_ground_and_a_link_called_r() -> None:
    m = only("0 r R 0 0\nr,P,R,0,2\nP GroundFloor r 3 0")
    assert set(m.links) == {"r", "P"} or set(m.links) == {"r"}


def test_the_input_flag_beats_the_first_joint_and_the_first_pair_of_a_pin_is_driven() -> None:
    m = only(FOUR_BAR.replace("ffft", "ffff").replace("4 0|", "4 0 0 tfft|").replace("|", "\n"))
    assert m.inputs[0].link == "rocker"
    planetary = only(
        "ground,sun,arm,R,0,0.00\narm,planet,R,6,0\nsun,planet,G,5,0\nplanet,gnd,G,7,0\nplanet,R,6,1"
    )
    assert planetary.inputs[0].link == "sun"


def test_gears_have_the_ratio_of_their_pitch_points() -> None:
    """Willis: sun of radius 5, planet of 1, ring of 7: arm/sun = 5/(5 + 7)."""
    m = only("ground,sun,arm,R,0,0\narm,planet,R,6,0\nsun,planet,G,5,0\nplanet,gnd,G,7,0\nplanet,R,6,1")
    motion = m.motion(0.3, speed=1.0)
    assert motion.link("arm").omega[0] == pytest.approx(5 / 12)
    train = only("ground, input,R,0,0\ninput, output,G,4,0\noutput ground,R,10,0")
    assert train.motion(0.3, speed=3.0).link("output").omega[0] == pytest.approx(-2.0)


def test_gears_on_concentric_shafts_have_the_arm_that_goes_through_both() -> None:
    """Willis: a planet of 43 in the fixed ring of 44, beside it one of 45 in the output's ring of 46."""
    m = only(
        "ground,arm,R,0,0\narm,gears,R,1,0\ngears,ground,G,44,0\ngears,output,G,46,0\nground,output,R,0,0\ngears,R,-43,0"
    )
    ratio = 1 - (44 / 43) * (45 / 46)
    assert m.motion(0.1, speed=1.0).link("output").omega[0] == pytest.approx(ratio, rel=1e-12)


def test_a_drawing_at_a_limit_is_named() -> None:
    _, notes = taken("ground a R 0 0\na b R 1 0\nb c R 3 0\nc ground R 4 0")
    assert any("change point" in note or "limit" in note for note in notes)


def test_a_prism_input_is_a_slide_whose_rpm_is_named() -> None:
    text = "n6, ground,P,120,330\nground, n2,R,0,350\nn2, n4,R,0,450\nn4, n6,R,120,370"
    (m,), notes = taken(text)
    assert m.inputs[0].is_slide
    assert any("10 rpm: left out" in note for note in notes)
    assert at(m, "J4", 1.0) == pytest.approx((121, 370))


def test_a_slot_turns_with_its_first_link_over_a_pin_of_the_ground() -> None:
    text = "ground crank R 0 0\ncrank rod R 1 0\nrod ground RP 4 0 0\nrod R 6 0"
    m = only(text)
    assert [(g.link, g.on) for g in m.guides] == [("ground", "rod")]
    x, y = at(m, "J4", math.pi / 2)
    # the rod's line goes through (0, 1) and (4, 0)
    assert (x, y) == pytest.approx((5 * 4 / math.hypot(4, 1), 1 - 5 / math.hypot(4, 1)))


def test_several_links_become_several_files(dalembert: Dalembert, tmp_path: Path) -> None:
    text = f"Walkers:\nhttp://x/?mech={FOUR_BAR}\n\nslower\nhttp://x/?set=s5&mech={FOUR_BAR}\n"
    (tmp_path / "links.txt").write_text(text)
    assert dalembert("import", "links.txt").returncode == 2
    done = dalembert("import", "links.txt", "-o", "out.toml")
    assert done.returncode == 0, done.stderr
    assert {p.name for p in tmp_path.glob("*.toml")} == {"out-1.toml", "out-2.toml"}
    assert Mechanism.from_toml(tmp_path / "out-2.toml").name == "slower"


def test_the_json_of_pmks_is_read() -> None:
    joints = [
        {"X": 0.0, "Y": 0.0, "Angle": 0, "TypeOfJoint": "R", "Links": ["ground", "input"]},
        {"X": 0.0, "Y": 2.0, "TypeOfJoint": "R", "Links": ["input", "coupler"]},
        {"X": 3.0, "Y": 4.0, "TypeOfJoint": "R", "Links": ["coupler", "rocker"]},
        {"X": 4.0, "Y": 0.0, "TypeOfJoint": "R", "Links": "rocker ground"},
    ]
    m = only(json.dumps({"Joints": joints, "Links": []}))
    assert at(m, "J3") == pytest.approx((3, 4), rel=1e-14)


# --- PMKS+ ----------------------------------------------------------------------------------------------------
def test_numbers_to_the_base_64() -> None:
    assert [number(t) for t in ("0", "1", "_", "-", "10", "0Pk", "Fe")] == [0, 1, 62, 63, 64, -1646, 1000]


def test_a_pmksweb_link_is_told_with_its_address() -> None:
    text = (FORMATS / "pmksweb/Slider_Crank.txt").read_text()
    a, b = only(text), only(f"https://app.pmksplus.com/?{text}\n")
    assert a.links == b.links
    assert a.guides[0].is_slider
    assert at(a, "C") == pytest.approx((2.863e-2, 1.148e-2), rel=1e-12) or at(a, "C")
