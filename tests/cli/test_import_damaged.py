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


def test_comments_that_are_not_closed_are_passed_over_once() -> None:
    """300 000 of them took minutes, once for each to the end of the file."""
    for text in ("<!--" * 300_000, "<robot><a:b/>" + "<?" * 300_000):
        with pytest.raises(DataError, match=r"unknown format|no valid XML"):
            read("file", text.encode(), None)


def test_many_prefixes_are_declared_at_once() -> None:
    used = " ".join(f'p{k}:a="1"' for k in range(40_000))
    with pytest.raises(DataError, match="no link: expected one or more"):
        read("file", f"<robot><x:y {used}/></robot>".encode(), None)


@pytest.mark.slow
def test_frames_of_sdf_may_follow_one_another_without_end() -> None:
    """Each frame is 1 mm farther than the next one, and a joint stands in the first."""
    text = '<sdf version="1.9"><model name="m"><link name="crank"/>' + "".join(
        f'<frame name="f{k}"><pose relative_to="f{k + 1}">0.001 0 0 0 0 0</pose></frame>' for k in range(2000)
    )
    text += (
        '<frame name="f2000"/><joint name="A" type="revolute"><pose relative_to="f0"/><parent>world</parent>'
    )
    text += "<child>crank</child><axis><xyz>0 0 1</xyz></axis></joint></model></sdf>"
    m = only(text)
    assert m.ground["A"].real == pytest.approx(2.0, rel=1e-12)
    looped = text.replace('<frame name="f2000"/>', '<frame name="f2000"><pose relative_to="f7"/></frame>')
    with pytest.raises(DataError, match="the pose of 'f7' is relative to itself"):
        read("file", looped.encode(), None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<robot>" + "<link/>" * 20_000 + "</robot>", "20001 elements: expected at most 20000"),
        ('{"joints": [' + "0," * 20_000 + "0]}", "20003 values: expected at most 20000"),
        ("ground, a, R, 0, 0\n" * 20_001, "20001 lines: expected at most 20000"),
        ("<linkage2>" + "<a/>" * 40_000 + "</linkage2>", "40002 elements: expected at most 40000"),
        (
            "<robot>" + "".join(f'<link name="l{k}"/>' for k in range(1002)) + "</robot>",
            "1001 links: expected at most 1000",
        ),
        (
            "\n".join(f"l{k}, l{k + 1}, R, {k}, 0" for k in range(1100)) + "\nl0, ground, R, 0, 1",
            "1102 links: expected at most 1000",
        ),
    ],
)
def test_a_file_that_holds_too_much_is_refused_in_one_line(text: str, message: str) -> None:
    with pytest.raises(DataError, match=f"^file: {message}$"):
        read("file", text.encode(), None)
