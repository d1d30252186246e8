"""`dalembert import`: files whose parts do not fit together are named in one line, or import what fits."""

from __future__ import annotations

import pytest

from cli.formats import read
from dalembert.errors import DataError
from tests.cli.imported import FORMATS, only, taken


@pytest.mark.parametrize("mechanisms", ["3", '{"a": {}}', '"x"'])
def test_motiongen_without_a_list_of_mechanisms_is_refused(mechanisms: str) -> None:
    with pytest.raises(DataError, match=r"file: mechanisms: found .*, expected a list of mechanisms"):
        read("file", f'{{"mechanisms": {mechanisms}}}'.encode(), None)


@pytest.mark.parametrize("document", ["3", "null", '"x"'])
def test_motiongen_that_is_no_object_is_refused(document: str) -> None:
    with pytest.raises(DataError, match="file: mechanisms: found"):
        read("file", document.encode(), "motiongen")


# a crank at the origin, a wheel that nothing but gears holds
LOOSE_WHEEL = """<sdf version="1.9"><model name="m">
<link name="crank"/><link name="wheel"/>
<joint name="A" type="revolute"><parent>world</parent><child>crank</child><axis><xyz>0 0 1</xyz></axis></joint>
<joint name="g" type="gearbox"><parent>crank</parent><child>wheel</child><gearbox_ratio>2</gearbox_ratio>
<gearbox_reference_body>world</gearbox_reference_body></joint>
</model></sdf>"""


def test_gears_of_a_wheel_without_a_pin_are_left_out_with_it() -> None:
    (m,), notes = taken(LOOSE_WHEEL)
    assert list(m.links) == ["crank"]
    assert not m.gears
    assert "gears crank, wheel: left out with their link" in notes


# a rail moves up; a massless block slides in it and on the ground at 45 deg, and carries a rod by a pin
TWO_RAILS = """<mujoco><compiler angle="radian"/><worldbody>
<body name="rail"><joint name="R" type="slide" axis="0 1 0"/>
<body name="block B" pos="1 0 0"><joint name="S" type="slide" axis="1 0 0"/>
<body name="rod"><joint name="B"/><site name="tip" pos="0 1 0"/></body></body></body>
<body name="foot" pos="1 0 0"><joint name="F" type="slide" axis="1 1 0"/></body></worldbody>
<equality><weld body1="block B" body2="foot"/></equality></mujoco>"""


def test_a_block_in_two_slides_stays_a_body() -> None:
    (m,), _ = taken(TWO_RAILS)
    assert set(m.links) == {"rail", "block B"}
    assert len(m.guides) == 3
    up = m.motion(m.at[0] + 0.25).at("block B", 0j).position[0] - m.motion().at("block B", 0j).position[0]
    assert tuple(up) == pytest.approx((0.25, 0.25), abs=1e-15)


SIM = (FORMATS / "linkage_sim" / "four_bar.json").read_text(encoding="utf-8")
PULLED = (FORMATS / "pmksweb" / "Force.txt").read_text(encoding="utf-8").strip()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"joints": {', '"joints": {"J9": 3,', "joint J9: 'type' is missing"),
        ('"forces": [', '"forces": "", "others": [', "forces: found '', expected a list of objects"),
    ],
)
def test_entries_of_linkage_sim_that_are_no_objects_are_refused(old: str, new: str, message: str) -> None:
    assert old in SIM
    with pytest.raises(DataError, match=message):
        taken(SIM.replace(old, new))


def test_keys_of_linkage_sim_that_are_not_read_are_named() -> None:
    _, notes = taken(SIM.replace('"mass"', '"weight"').replace('"forces"', '"loads"'))
    assert "body crank, weight: left out: it is not read" in notes
    assert "loads: left out: it is not read" in notes


def test_a_string_of_pmks_web_that_ends_inside_a_force_is_refused() -> None:
    """Without the last part the numbers of the force would stand for the active object."""
    assert only(PULLED).forces
    for end in range(PULLED.rindex("2F1,") + 4, PULLED.rindex(".")):
        with pytest.raises(DataError, match=r"the string ends there: .* is it cut off"):
            taken(PULLED[:end])
