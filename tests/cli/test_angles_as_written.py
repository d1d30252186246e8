"""An angle with its unit reaches the mechanism as it is written, in floats and in 32 digits, whichever option or file has it."""

from __future__ import annotations

import json
import math
import random
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest

from cli.cases.axes import assigned, at_axis, cases_axis, over_axis, quantity
from cli.cases.cases import Cases
from cli.cases.inputs import Driven, Grid, Varied, of_one
from tests.conftest import Dalembert
from virtualwork import Mechanism
from virtualwork.describe.dimensions import dimensions

FOUR_BAR = """
name = "four-bar"
ground = { A = [0, 0], D = [0.1, 0] }
input = { link = "crank", angle = "40 deg", speed = 10 }
guess = { at = "40 deg", coupler = "20 deg", rocker = "57 deg" }
[links]
crank = { points = { A = [0, 0], B = [0.04, 0] } }
coupler = { points = { B = [0, 0], C = [0.12, 0], H = { from = "C", length = 0.03, angle = "0.2 rad" } } }
rocker = { points = { D = [0, 0], C = [0.08, 0] } }
"""
SINGLE = [
    "0.3",
    "-0.3",
    "0",
    "1",
    "3.1",
    "0.1",
    "1e-3",
    "0.1234567890123456",
    "0.12345678901234567890123",
    "2.718281828459045",
]


def decimals(n: int) -> list[str]:
    """Decimals of every length, in a fixed order."""
    drawn = random.Random(7)
    return [f"{drawn.uniform(-7, 7):.{drawn.randint(1, 19)}f}" for _ in range(n)]


@pytest.fixture(scope="module")
def m() -> Mechanism:
    return Mechanism.from_toml_text(FOUR_BAR)


def exact_rest(text: str, si: float) -> float:
    return float(Fraction(text) - Fraction(si))


@pytest.mark.parametrize("text", SINGLE)
def test_radians_are_the_float(m: Mechanism, text: str) -> None:
    inputs = of_one(m, Grid((at_axis(m, [f"{text}rad"], {}),))).whole
    assert inputs.values.tolist() == [[float(text)]]
    assert inputs.rest is not None
    assert inputs.rest().tolist() == [[exact_rest(text, float(text))]]


def test_of_many_decimals_the_pose_is_bit_for_bit_that_of_the_library(m: Mechanism) -> None:
    texts = decimals(400)
    inputs = of_one(m, Grid((at_axis(m, [f"{text}rad" for text in texts], {}),))).whole
    numbers = np.array([float(text) for text in texts])
    assert inputs.rest is not None
    assert (inputs.values[:, 0] == numbers).all()
    assert inputs.rest()[:, 0].tolist() == [exact_rest(text, float(text)) for text in texts]
    point = m.motion(numbers).point("H").position
    assert (m.motion(inputs.values).point("H").position == point).all()
    with mpmath.workdps(40):
        degrees = [float(mpmath.mpf(text) * 180 / mpmath.pi) for text in texts]
    assert inputs.shown[:, 0].tolist() == degrees


def test_degrees_beside_radians(m: Mechanism) -> None:
    inputs = of_one(m, Grid((at_axis(m, ["0.3rad", "60deg", "12.345678901234567deg"], {}),))).whole
    assert inputs.values[:, 0].tolist() == [0.3, math.radians(60), math.radians(12.345678901234567)]
    assert inputs.shown[1:, 0].tolist() == [60.0, 12.345678901234567]
    assert inputs.rest is not None
    with mpmath.workdps(40):
        exact = [mpmath.mpf("0.3"), mpmath.pi / 3, mpmath.mpf("12.345678901234567") * mpmath.pi / 180]
        rest = [float(x - mpmath.mpf(si)) for x, si in zip(exact, inputs.values[:, 0].tolist(), strict=True)]
    assert inputs.rest()[:, 0].tolist() == rest


@pytest.mark.parametrize(
    ("text", "degrees"), [("0.25rev", 90), ("-0.25 rev", -90), ("0rev", 0), ("1rev", 360), ("0.1rev", 36)]
)
def test_turns_are_turns(dalembert: Dalembert, tmp_path: Path, text: str, degrees: float) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    done = dalembert("mechanism", "m.toml", "--at", text, "--only", "B.x", "--json")
    (pose,) = json.loads(done.stdout)["poses"]
    assert pose["input_deg"] == degrees
    assert pose["points"]["B"]["x_m"] == pytest.approx(0.04 * math.cos(math.radians(degrees)), abs=1e-17)


def test_thousandths_of_a_radian(m: Mechanism) -> None:
    inputs = of_one(m, Grid((at_axis(m, ["300mrad"], {}),))).whole
    assert inputs.values.tolist() == [[0.3]]


@pytest.mark.parametrize(
    ("span", "texts"),
    [
        ("0rad:3rad:0.1rad", [f"{k / 10}" for k in range(31)]),
        ("3rad:0rad:-0.1rad", [f"{k / 10}" for k in range(30, -1, -1)]),
        ("-0.3rad:0.3rad/6", ["-0.3", "-0.2", "-0.1", "0", "0.1", "0.2", "0.3"]),
        ("0deg:3rad:1.5rad", ["0", "1.5", "3"]),
        ("0mrad:300mrad:100mrad", ["0", "0.1", "0.2", "0.3"]),
    ],
)
def test_a_range_in_radians(m: Mechanism, span: str, texts: list[str]) -> None:
    for axis in (over_axis(m, span, {}), over_axis(m, f"links.coupler.H.angle={span}", {})):
        places = np.arange(axis.n)
        shown, si = axis.at(places)
        assert si[:, 0].tolist() == [float(text) for text in texts]
        rest = [exact_rest(text, float(text)) for text in texts]
        assert axis.rest_at(places)[:, 0].tolist() == pytest.approx(rest, rel=1e-15, abs=1e-40)
        with mpmath.workdps(40):
            assert shown[:, 0].tolist() == [float(mpmath.mpf(text) * 180 / mpmath.pi) for text in texts]


def test_a_range_in_degrees_and_turns(m: Mechanism) -> None:
    _, si = over_axis(m, "0deg:90deg/900", {}).at(np.arange(901))
    assert si[:, 0].tolist() == [math.radians(k / 10) for k in range(901)]
    shown, _ = over_axis(m, "0rev:1rev/4", {}).at(np.arange(5))
    assert shown[:, 0].tolist() == [0, 90, 180, 270, 360]


def test_a_range_in_rpm_is_one_of_whole_numbers(m: Mechanism) -> None:
    axis = over_axis(m, "input.speed=100rpm:300rpm:50rpm", {})
    _, si = axis.at(np.arange(5))
    speed = Varied(dimensions(m)["input.speed"])
    assert si[:, 0].tolist() == [quantity(speed, f"{n}rpm", "--set", {}).si for n in range(100, 301, 50)]


@pytest.mark.parametrize("text", [*SINGLE, *decimals(30)])
def test_a_number_that_is_set(m: Mechanism, text: str) -> None:
    number = quantity(Varied(dimensions(m)["links.coupler.H.angle"]), f"{text}rad", "--set", {})
    assert number.si == float(text)
    assert number.rest == exact_rest(text, float(text))
    changed = assigned(m, {}, [f"links.coupler.H.angle={text}rad"])
    assert changed.value("links.coupler.H.angle") == float(text)
    assert changed.decimals is not None
    assert changed.decimals.rest("angle", float(text)) == exact_rest(text, float(text))


def test_radians_in_a_table_and_in_the_file(m: Mechanism, tmp_path: Path) -> None:
    texts = [x for x in decimals(150) if len(x) < 17]
    (tmp_path / "cases.csv").write_text("crank_rad\n" + "\n".join(texts))
    axis = cases_axis(m, str(tmp_path / "cases.csv"), set(), [])
    places = np.arange(axis.n)
    shown, si = axis.at(places)
    assert si[:, 0].tolist() == [float(text) for text in texts]
    rest = [exact_rest(text, float(text)) for text in texts]
    assert axis.rest_at(places)[:, 0].tolist() == pytest.approx(rest, rel=1e-14, abs=1e-40)
    with mpmath.workdps(40):
        assert shown[:, 0].tolist() == [float(mpmath.mpf(text) * 180 / mpmath.pi) for text in texts]
    for text in SINGLE:
        own = Mechanism.from_toml_text(FOUR_BAR.replace('angle = "40 deg"', f'angle = "{text} rad"'))
        inputs = of_one(own, None).whole
        assert inputs.values.tolist() == [[float(text)]]
        assert inputs.rest is not None
        assert inputs.rest().tolist() == [[exact_rest(text, float(text))]]


def test_every_way_of_writing_it_gives_the_same_digits(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(FOUR_BAR)
    (tmp_path / "n.toml").write_text(FOUR_BAR.replace('angle = "40 deg"', 'angle = "0.7 rad"'))
    (tmp_path / "cases.csv").write_text("crank_rad\n0.7\n")
    ways = [
        ("m.toml", "--at", "0.7rad"),
        ("m.toml", "--at", "700mrad"),
        ("m.toml", "--cases", "cases.csv"),
        ("m.toml", "--over", "0.7rad:0.8rad:0.2rad"),
        ("m.toml", "--over", "input.angle=0.7rad:0.8rad:0.2rad"),
        ("m.toml", "--set", "input.angle=0.7rad"),
        ("n.toml",),
    ]
    position = Mechanism.from_toml_text(FOUR_BAR).motion(np.array([0.7])).point("H").position[0].tolist()
    for file, *options in ways:
        done = dalembert("mechanism", file, *options, "--json")
        document = json.loads(done.stdout)
        (pose,) = document.get("variants", [document])[0]["poses"]
        assert [pose["points"]["H"][key] for key in ("x_m", "y_m")] == position, options
    digits = {
        dalembert("mechanism", file, *options, "--only", "H.x,H.ax", "--digits").stdout.split(",", 2)[-1]
        for file, *options in ways[:4]
    }
    assert len(digits) == 1


def test_a_variant_of_an_angle_in_radians_is_set_exactly(m: Mechanism) -> None:
    varied = Grid((over_axis(m, "links.coupler.H.angle=0.1rad:0.7rad:0.1rad", {}),))
    cases = Cases(None, m, {}, varied)  # type: ignore[arg-type]
    assert cases.in_si(cases.rows(0, 7)) == {"links.coupler.H.angle": [k / 10 for k in range(1, 8)]}
    assert Driven.of(m, 0).own(m).shown == 40.0


@pytest.mark.parametrize("text", ["1e-999999999deg", "-1e-999999999rad", "1e-999999999mrad", "-0deg", "0rev"])
def test_what_is_below_all_floats_is_zero(m: Mechanism, text: str) -> None:
    inputs = of_one(m, Grid((at_axis(m, [text], {}),))).whole
    assert inputs.rest is not None
    assert (inputs.values.tolist(), inputs.shown.tolist(), inputs.rest().tolist()) == ([[0]], [[0]], [[0]])
