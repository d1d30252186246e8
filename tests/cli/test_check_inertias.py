"""`dalembert body ROBOT --check-inertias`: which tensors no body has, the nearest that one has, what has slipped."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidbody3d.robots.inertias import InertiaCheck, check_robot_inertias
from rigidbody3d.robots.reading import read as read_robot
from tests.conftest import Dalembert

ENTRIES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def link(entries: str, mass: str = "1", more: str = "", at: str = "0 0 0") -> str:
    values = dict(zip(ENTRIES, (*entries.split(), "0", "0", "0"), strict=False))
    inertia = " ".join(f'{k}="{v}"' for k, v in values.items())
    return (
        f'<robot name="r"><link name="arm"><inertial><origin xyz="{at}"/><mass value="{mass}"/>'
        f"<inertia {inertia}/></inertial>{more}</link></robot>"
    )


def only(text: str) -> InertiaCheck:
    (found,) = check_robot_inertias(read_robot("file", text.encode(), None))
    return found


def box(size: str, at: str = "0 0 0") -> str:
    return f'<visual><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></visual>'


@pytest.mark.parametrize(
    ("entries", "likely"),
    [
        ("0.0010 0.0330 0.330", "a slipped decimal in izz"),
        ("0.00123 0.0125 0.127", "a slipped decimal in izz"),
        ("0.0234 0.412 0.0405", "a slipped decimal in iyy"),
        ("1.25 0.0123 0.0131", "a slipped decimal in ixx"),
        ("0.021 0.022 0.023 0.12", "a slipped decimal in ixy"),
        ("0.021 0.022 23.5", "g for kg in izz"),
        ("0.021 0.022 23500.5", "mm for m in izz"),
        ("-0.021 0.022 0.023", "a stray minus sign in ixx"),
        ("1.1 0.9 0.8 0 0.7 0.1", None),
    ],
)
def test_what_is_broken_and_what_has_slipped(entries: str, likely: str | None) -> None:
    found = only(link(entries))
    # by hand: least eigenvalue of ½ tr(I) E − I
    I = found.held.tensor
    assert np.linalg.eigvalsh(np.trace(I) / 2 * np.eye(3) - I)[0] < -1e-3
    assert not found.valid
    assert found.likely is None or likely is None or found.likely == likely
    assert (found.likely is None) == (likely is None) or "ixz" in str(found.likely)


def test_entries_in_another_order() -> None:
    """Typed as MJCF has them, ixx iyy izz 0 0 0, into URDF's ixx ixy ixz iyy iyz izz."""
    text = link("0.021 0 0 0.023 0.022 0").replace('ixx="0.021" iyy="0"', 'ixx="0.021" iyy="0"')
    found = only(text.replace('ixy="0.023" ixz="0.022"', 'ixy="0.022" ixz="0.023"'))
    assert not found.valid
    assert found.likely == "entries in another order"


def test_the_parallel_axis_taken_off_twice() -> None:
    """A rod of 1 kg and 0.3 m along x: m·L²/12 = 0.0075, less m·d² for d = 0.15 m."""
    found = only(link("0.00001 -0.015 -0.015", at="0.15 0 0"))
    assert not found.valid
    assert "about the origin instead of the centre" in str(found.likely)


def test_what_a_body_can_have_but_not_this_one() -> None:
    """A rod of 0.2 m: m·L²/12 = 0.00333; about its end m·L²/3 = 0.01333; in g·mm² and kg·mm² far more."""
    shape = box("0.2 0.01 0.01", "0.1 0 0")
    right = only(link("0.00001 0.00334 0.00333", more=shape, at="0.1 0 0"))
    assert (right.valid, right.likely) == (True, None)
    ends = only(link("0.00001 0.01334 0.01333", more=shape, at="0.1 0 0"))
    assert (ends.valid, ends.likely) == (True, "about the origin instead of the centre of mass")
    large = only(link("10.1 3340.1 3330.1", more=box("0.2 0.01 0.01")))
    assert (large.valid, large.likely) == (True, "mm for m")


def test_the_last_printed_digit_is_forgiven_and_no_more() -> None:
    assert only(link("0.001 0.002 0.0031")).valid
    assert not only(link("0.0010 0.0020 0.0032")).valid
    # a whole number is exact
    assert not only(link("1 1 3")).valid
    assert only(link("1 2 3")).valid
    # a flat plate, rounded in oblique axes
    turned = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    I = turned @ np.diag([0.1, 0.2, 0.3]) @ turned.T
    values = [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]
    assert only(link(" ".join(f"{v:.4f}" for v in values))).valid


def test_the_digits_are_told_apart_rigorously() -> None:
    """No tensor inside the printed digits of one that is called broken can be a body's: drawn at random."""
    draw = np.random.default_rng(11)
    said = 0
    for _ in range(300):
        V = np.linalg.qr(draw.normal(size=(3, 3)))[0]
        a, b = draw.uniform(0.1, 1.0, 2)
        I = V @ np.diag([a, b, (a + b) * (1 + draw.uniform(0, 0.02))]) @ V.T
        text = " ".join(f"{v:.2f}" for v in (I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]))
        found = only(link(text))
        corners = found.held.half * draw.choice([-1, 1], size=(400, 3, 3))
        corners = np.triu(corners) + np.swapaxes(np.triu(corners, 1), -1, -2)
        near = found.held.tensor + corners
        S = np.trace(near, axis1=1, axis2=2)[:, None, None] / 2 * np.eye(3) - near
        best = np.linalg.eigvalsh(S)[:, 0].max()
        if not found.valid:
            said += 1
            assert best < 0
    assert said > 10


SDF = """<sdf version="1.9"><model name="m"><link name="arm"><inertial><mass>1</mass><inertia>
<ixx>0.01</ixx><iyy>0.01</iyy><izz>0.2</izz></inertia></inertial></link></model></sdf>"""
MJCF = """<mujoco><worldbody><body name="arm"><inertial pos="0 0 0" mass="1" {}/><geom size=".1"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("r.urdf", link("0.01 0.01 0.2")),
        ("r.sdf", SDF),
        ("r.xml", MJCF.format('diaginertia="0.01 0.01 0.2"')),
        ("r.xml", MJCF.format('fullinertia="0.01 0.01 0.2 0 0 0"')),
    ],
)
def test_every_format_by_the_command(name: str, text: str, tmp_path: Path, dalembert: Dalembert) -> None:
    (tmp_path / name).write_text(text)
    done = dalembert("body", name, "--check-inertias", "--json")
    assert done.returncode == 1
    (body,) = json.loads(done.stdout)["bodies"]
    assert (body["link"], body["valid"], body["likely"]) == ("arm", False, "a slipped decimal in izz")
    assert body["principal_kg_m2"] == [0.01, 0.01, 0.2]
    # 0.2 − 0.02 shared by three
    assert np.diag(body["nearest_kg_m2"]) == pytest.approx([0.07, 0.07, 0.14], rel=1e-12)
    assert "link 'arm': impossible for any body" in done.stderr
    (tmp_path / name).write_text(text.replace("0.2", "0.02"))
    done = dalembert("body", name, "--check-inertias")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[0].startswith("link,valid,principal_1_kg_m2")


@pytest.mark.parametrize(
    ("text", "arguments", "status", "said"),
    [
        (
            link("0.01 0.01 0.02"),
            ["--omega", "1,2,3"],
            2,
            "cannot be combined with options of a motion or a shaft",
        ),
        ("part,shape,mass_kg\na,point,1\n", [], 1, "no valid XML"),
        ('<robot name="r"><link name="a"/></robot>', [], 1, "no link has an inertia"),
        (link("0.01 ten 0.02"), [], 1, "link 'arm', inertia iyy: found 'ten', expected a finite number"),
        ("<!DOCTYPE r [<!ENTITY a 'b'>]><robot/>", [], 1, "refused"),
        ("<html/>", [], 1, "found <html>, expected <robot> (URDF), <sdf> (SDF), <mujoco> (MJCF)"),
    ],
)
def test_bad_calls(
    text: str, arguments: list[Any], status: int, said: str, tmp_path: Path, dalembert: Dalembert
) -> None:
    (tmp_path / "r.urdf").write_text(text)
    done = dalembert("body", "r.urdf", "--check-inertias", *arguments)
    assert done.returncode == status
    assert said in done.stderr


def chain(inertia: str, shape: str = "", joint: str = "0 0 0.5") -> str:
    """A link of 2 kg on a base, its joint at its origin, its centre at half its length."""
    values = " ".join(f'{k}="{v}"' for k, v in zip(ENTRIES, (*inertia.split(), "0", "0", "0"), strict=False))
    return (
        '<robot name="r"><link name="base"/><link name="tip"/><link name="arm">'
        f'<inertial><origin xyz="0 0 0.5"/><mass value="2"/><inertia {values}/></inertial>{shape}</link>'
        '<joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>'
        f'<joint name="k" type="fixed"><parent link="arm"/><child link="tip"/><origin xyz="{joint}"/></joint></robot>'
    )


# a rod of 1 m and 0.1 m across
ROD = 0.168, 0.168, 0.0025


@pytest.mark.parametrize("factor", [1e3, 1e-3, 1e6, 1e-6, 1.0, 10.0, 0.1])
@pytest.mark.parametrize(
    "shape", ["", '<visual><geometry><cylinder radius="0.05" length="1"/></geometry></visual>']
)
def test_a_whole_tensor_that_lost_its_decimals(factor: float, shape: str) -> None:
    entries = " ".join(f"{v * factor:.6e}" for v in ROD)
    found = only(chain(entries, shape.replace("<geometry>", '<origin xyz="0 0 0.5"/><geometry>')))
    assert found.valid
    if max(factor, 1 / factor) < 100:
        # ten times as much no rod of 1 m can have
        assert (found.likely is None) == (factor < 10 or not shape)
    else:
        power = round(abs(np.log10(factor)))
        assert str(found.likely).startswith({3: "g for kg", 6: "mm for m"}[power])
        assert found.too_small == (factor < 1)


def test_a_wheel_whose_joint_is_at_its_centre_is_as_large_as_the_robot_at_most() -> None:
    """Nothing says how far the link itself reaches."""
    text = chain("{0} {0} {0}", joint="0 0 1").replace(
        '<origin xyz="0 0 0.5"/><mass', '<origin xyz="0 0 0"/><mass'
    )
    text = text.replace('<link name="arm">', '<link name="far"/><link name="arm">').replace(
        '<parent link="arm"/><child link="tip"/>', '<parent link="base"/><child link="tip"/>'
    )
    assert only(text.format("0.2")).likely is None
    assert str(only(text.format("200")).likely).startswith("g for kg")


def test_whole_numbers_of_a_tensor_that_no_body_has() -> None:
    """0.0213 0.0218 0.0009 kg·m² of 0.2 kg that reach 0.5 m, without their points, read as thousandths of grams."""
    text = chain("213 430 213").replace('value="2"', 'value="0.2"')
    found = only(text)
    assert not found.valid
    assert found.likely is not None
