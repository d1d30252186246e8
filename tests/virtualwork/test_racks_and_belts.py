"""Racks, belts and chains: against closed forms by hand and their mirror images."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from virtualwork import (
    Belt,
    DescriptionError,
    Force,
    Friction,
    Guess,
    Guide,
    Input,
    Link,
    Mechanism,
    Rack,
    Torque,
)
from virtualwork.describe.dimensions import changed, dimensions
from virtualwork.describe.dimensions import value as number_at
from virtualwork.describe.reader import read_text
from virtualwork.describe.text import toml_text
from virtualwork.drawing import Circle, Line, draw
from virtualwork.formulas.forces import Generalized

R = 0.03


def rack(radius: float = R, angle: float = 0.0, **given: Any) -> Mechanism:
    """A pinion of 1e-4 kg·m² on the ground and a rack of 2 kg that it meets at its pitch circle."""
    inputs = given.pop("inputs", Input("pinion", value=0.0, speed=2.0, acceleration=10.0, jerk=7.0))
    along = complex(math.cos(angle), math.sin(angle))
    return Mechanism(
        {"O": 0j},
        {"pinion": Link({"O": 0j, "E": 0.05j}, inertia=1e-4), "rack": Link({"R": 0j}, 2.0)},
        guides=[Guide("R", "rack", through=-1j * radius * along, angle=angle, turned=0.0)],
        racks=[Rack("pinion", "R", radius)],
        inputs=inputs,
        **given,
    )


Q = np.linspace(-4.0, 9.0, 14)


@pytest.mark.parametrize("radius", [R, -R])
@pytest.mark.parametrize("angle", [0.0, 2.0])
def test_a_pinion_moves_its_rack_by_its_radius(radius: float, angle: float) -> None:
    motion = rack(radius, angle).motion(Q)
    along = complex(math.cos(angle), math.sin(angle))
    for order, rate in enumerate((Q, 2.0, 10.0, 7.0)):
        start = -1j * radius * along if order == 0 else 0.0
        assert np.allclose(
            motion.point("R").complex(order), start + radius * rate * along, rtol=0, atol=1e-15
        )
    effort = (1e-4 + 2 * R**2) * 10.0
    assert np.allclose(motion.effort, effort, rtol=1e-14)
    assert np.allclose(motion.dynamics.newton_euler[:, 0], effort, rtol=1e-14)
    # the bearing holds the pinion against the tooth force, the guide nothing: they meet on its line
    tooth = 2.0 * radius * 10.0 * along
    assert np.allclose(motion.reaction("O", on="pinion"), [tooth.real, tooth.imag], rtol=1e-14, atol=1e-16)
    assert np.allclose(motion.reaction("R", on="rack"), 0.0, atol=1e-15)
    assert motion.effort == pytest.approx(motion.dynamics.value(Generalized(0)))


def test_a_rack_on_an_arm_that_is_driven_on_another_stands_at_its_guess() -> None:
    m = Mechanism(
        {"O": 0j},
        {"arm": Link({"O": 0j, "A": 1 + 0j}), "fore": Link({"A": 0j}), "bar": Link({"P": 0j})},
        guides=[Guide("P", "bar", on="fore", through=0.25j, turned=0.0)],
        racks=[Rack("arm", "P", 0.5)],
        inputs=[Input("arm", value=0.25), Input("fore", on="arm", value=math.pi / 2)],
        guess=Guess((0.0, math.pi / 2), {}, {"P": 0.75 + 2j}),
    )
    motion = m.motion([[0.0, math.pi / 2], [0.0, math.pi / 2 - 0.5]])
    assert np.allclose(motion.slide("P").position, [2.0, 2.25], rtol=0, atol=1e-15)


def test_a_rack_turns_its_pinion() -> None:
    m = rack(
        inputs=Input(slider="R", value=0.0, speed=0.3, acceleration=4.0), guess=Guess(angles={"pinion": 0.5})
    )
    s = np.linspace(-0.2, 0.3, 7)
    motion = m.motion(s)
    turned = np.angle(np.exp(1j * (motion.link("pinion").angle - 0.5 - s / R)))
    assert np.abs(turned).max() < 1e-14
    assert motion.link("pinion").omega == pytest.approx(0.3 / R, rel=1e-14)
    assert motion.effort == pytest.approx(2 * 4.0 + 1e-4 * 4.0 / R**2, rel=1e-14)
    assert motion.dynamics.newton_euler[:, 0] == pytest.approx(motion.effort, rel=1e-14)
    # from the rack to the pinion: its torque is r times the force
    assert motion.reaction("O", on="pinion")[:, 0] == pytest.approx(-1e-4 * 4.0 / R**2, rel=1e-13)


def test_a_guide_beside_the_pitch_line_bears_the_moment() -> None:
    m = rack()
    low = Guide("R", "rack", through=-0.05j, angle=0.0, turned=0.0)
    motion = Mechanism(m.ground, m.links, [low], racks=m.racks, inputs=m.inputs).motion(0.3)
    joint = next(j for j in motion.dynamics.reactions.joints if j.guide is not None)
    # teeth at −30 mm push the rack, of which the guided point runs at −50 mm, with 0.6 N
    assert motion.dynamics.joint_moment(joint, "rack") == pytest.approx(0.6 * 0.02, rel=1e-14)


@pytest.mark.parametrize("side", [1, -1])
def test_a_wheel_rolls_on_a_rack(side: int) -> None:
    """The point of a rolling circle runs on a cycloid: x = r(φ − sin φ), y = r(1 − cos φ)."""
    r, phi = 0.25, np.linspace(0, 7, 15)
    m = Mechanism(
        {},
        {"wheel": Link({"C": 0j, "P": -1j * side * r}, 3.0, 0j, 0.1)},
        guides=[Guide("C", "wheel", through=1j * side * r)],
        racks=[Rack("wheel", "C", -side * r)],
        inputs=Input("wheel", value=0.0, speed=-side * 2.0, acceleration=-side * 5.0),
        guess=Guess(points={"C": 1j * side * r}),
    )
    motion = m.motion(-side * phi)
    cycloid = r * (phi - np.sin(phi)) + 1j * side * r * (1 - np.cos(phi))
    assert np.abs(motion.point("P").complex(0) - cycloid).max() < 1e-15
    assert motion.effort == pytest.approx(-side * (0.1 + 3 * r**2) * 5.0, rel=1e-14)
    assert motion.dynamics.newton_euler[:, 0] == pytest.approx(motion.effort, rel=1e-14)


def test_a_rack_of_a_slider_crank_turns_a_wheel() -> None:
    motion = engine().motion(Q)
    slide = motion.slide("B")
    # at the guess, crank 0, B stands at 260 mm and the wheel at 0.2
    turned = motion.link("wheel").angle - 0.2 - (slide.position - 0.26) / 0.05
    assert np.abs(np.angle(np.exp(1j * turned))).max() < 1e-13
    assert motion.link("wheel").omega == pytest.approx(slide.speed / 0.05, rel=1e-13)
    assert motion.link("wheel").alpha == pytest.approx(slide.acceleration / 0.05, rel=1e-12)
    assert motion.dynamics.newton_euler == pytest.approx(motion.dynamics.effort, rel=1e-10)
    power = motion.effort * 12.0
    fast = engine().motion(Q + 1e-6, 12.0, 0.0), engine().motion(Q - 1e-6, 12.0, 0.0)
    energy = [_energy(of) for of in fast]
    # what the crank's power does not put into motion goes into the torque on the wheel
    steady = engine().motion(Q, 12.0, 0.0)
    power = steady.effort * 12.0 + 3.0 * steady.link("wheel").omega
    assert power == pytest.approx((energy[0] - energy[1]) / 2e-6 * 12.0, rel=1e-5)


def engine() -> Mechanism:
    """A slider-crank whose slide carries a rack, and a wheel that it turns."""
    return Mechanism(
        {"O": 0j, "P": 0.4 + 0.05j},
        {
            "crank": Link({"O": 0j, "A": 0.06}),
            "rod": Link({"A": 0j, "B": 0.2}, 1.0, 0.1, 2e-3),
            "rack": Link({"B": 0j}, 2.0),
            "wheel": Link({"P": 0j, "Q": 0.02 + 0.01j}, 0.5, 0.01, 0.01),
        },
        guides=[Guide("B", "rack", turned=0.0)],
        racks=[Rack("wheel", "B", 0.05)],
        torques=[Torque("wheel", 3.0)],
        inputs=Input("crank", value=0.0, speed=12.0, acceleration=3.0),
        guess=Guess(0.0, {"rod": 0.0, "wheel": 0.2}),
    )


def _energy(motion: Any) -> Any:
    total = 0.0
    for name, link in motion.mechanism.links.items():
        speed = np.abs(motion.at(name, link.center).complex(1))
        total = total + link.mass * speed**2 / 2 + link.inertia * motion.link(name).omega ** 2 / 2
    return total


@pytest.mark.parametrize("crossed", [False, True])
def test_pulleys_turn_inversely_as_their_radii(crossed: bool) -> None:
    m = Mechanism(
        {"M": 0j, "D": 0.4},
        {"motor": Link({"M": 0j}, inertia=0.002), "drum": Link({"D": 0j}, inertia=0.6)},
        belts=[Belt(("motor", "drum"), (0.06, 0.15), crossed)],
        inputs=Input("motor", value=0.0, speed=30.0, acceleration=20.0),
    )
    ratio = -0.4 if crossed else 0.4
    motion = m.motion(Q)
    assert np.abs(np.exp(1j * (motion.link("drum").angle - ratio * Q)) - 1).max() < 1e-14
    assert motion.link("drum").omega == pytest.approx(30 * ratio, rel=1e-15)
    assert motion.effort == pytest.approx((0.002 + 0.6 * 0.16) * 20, rel=1e-14)
    assert motion.dynamics.newton_euler[:, 0] == pytest.approx(motion.effort, rel=1e-14)


def test_a_belt_of_equal_pulleys_on_an_arm_keeps_a_platform_level() -> None:
    m = Mechanism(
        {"A": 0j, "G": 1.0},
        {"arm": Link({"A": 0j, "B": 0.3}), "shelf": Link({"B": 0j, "S": 0.1j})},
        belts=[Belt(("ground", "shelf"), (0.05, 0.05), arm="arm")],
        inputs=Input("arm", value=0.0),
    )
    motion = m.motion(Q)
    assert np.abs(motion.link("shelf").angle).max() == 0.0
    assert np.abs(motion.point("S").complex(0) - (0.3 * np.exp(1j * Q) + 0.1j)).max() < 1e-15


def test_a_rack_falls_with_its_pinion() -> None:
    """a = F/(m + I/r²), from rest."""
    m = rack(forces=[Force("rack", None, 5.0)], inputs=Input("pinion", value=0.0, speed=0.0))
    run = m.simulate(np.linspace(0, 2, 5))
    a = 5.0 / (2.0 + 1e-4 / R**2)
    assert run.angle[:, 0] == pytest.approx(a * run.t**2 / 2 / R, rel=1e-9)


def test_friction_of_the_bearing_holds_the_tooth_force() -> None:
    m = rack(
        angle=math.pi / 2,
        gravity=-10j,
        friction=[Friction("O", 0.1, 0.01)],
        inputs=Input("pinion", value=0.0, speed=2.0),
    )
    # 2 kg at 10 m/s², steadily: F r, and μ R F of the bearing
    assert m.motion(0.4).effort == pytest.approx(20 * R + 0.1 * 0.01 * 20, rel=1e-12)


def test_variants_sensitivities_and_digits() -> None:
    m = rack()
    radii = np.array([0.02, 0.03, -0.04])
    family = m.vary({"racks.1.radius": radii}).motion(Q)
    start = m.motion(Q).point("R").complex(0)[0].imag
    assert np.allclose(family.point("R").complex(0), radii[:, None] * Q + 1j * start, atol=1e-15)
    motion = m.motion(Q)
    assert motion.point("R").sensitivity("racks.1.radius")[:, 0] == pytest.approx(Q, abs=1e-14)
    assert motion.sensitivity("effort", "racks.1.radius") == pytest.approx(2 * 2 * R * 10, rel=1e-12)
    assert np.all(motion.point("R").error_estimate() < 1e-15)
    belt = Mechanism(
        {"M": 0j, "D": 0.4},
        {"motor": Link({"M": 0j}), "drum": Link({"D": 0j})},
        belts=[Belt(("motor", "drum"), (0.06, 0.15))],
        inputs=Input("motor", value=0.0, speed=30.0),
    )
    assert [path for path in dimensions(belt) if path.startswith("belts")] == [
        "belts.1.radii.1",
        "belts.1.radii.2",
    ]
    varied = belt.vary({"belts.1.radii.2": np.array([0.1, 0.2])}).motion(Q)
    assert np.allclose(varied.link("drum").omega, [[18.0], [9.0]], rtol=1e-15)


def test_the_file_comes_back() -> None:
    m = Mechanism(
        {"O": 0j, "D": 0.4},
        {"pinion": Link({"O": 0j}), "drum": Link({"D": 0j}), "rack": Link({"R": 0j})},
        guides=[Guide("R", "rack", through=-0.03j, turned=0.0)],
        belts=[Belt(("pinion", "drum"), (0.02, 0.05), True)],
        racks=[Rack("pinion", "R", 0.03)],
        inputs=Input("drum", value=0.0),
    )
    text = toml_text(m, "mm", "deg")
    assert "crossed = true" in text
    assert read_text(text, Mechanism) == m


BAD = [
    ({"racks": [Rack("pinion", "R", 0.0)]}, r"\[\[racks\]\] 1 radius: found 0, expected a radius other than zero"),
    ({"racks": [Rack("pinon", "R", 0.1)]}, r"\[\[racks\]\] 1 gear: .*did you mean 'pinion'"),
    ({"racks": [Rack("pinion", "S", 0.1)]}, r"\[\[racks\]\] 1 slider: unknown slot or slider 'S'"),
    ({"racks": [Rack("rack", "R", 0.1)]}, r"\[\[racks\]\] 1 slider: the wheel 'rack' cannot turn in a slider"),
    ({"belts": [Belt(("pinion", "pinion"), (0.1, 0.1))]}, r"\[\[belts\]\] 1: found the links pinion and pinion and the arm ground, expected two links and an arm"),
    ({"belts": [Belt(("pinion", "rack"), (0.1, -0.1))]}, r"\[\[belts\]\] 1 radii: found -0.1 m, expected a radius above"),
]  # fmt: skip


@pytest.mark.parametrize(("parts", "message"), BAD)
def test_what_is_refused(parts: dict[str, Any], message: str) -> None:
    m = rack()
    with pytest.raises(DescriptionError, match=message):
        Mechanism(m.ground, m.links, m.guides, inputs=m.inputs, **parts)


def test_two_racks_on_one_pinion_that_slide_against_each_other_are_one_freedom() -> None:
    m = rack()
    twice = Mechanism(
        m.ground, m.links, m.guides, racks=[*m.racks, Rack("pinion", "R", 0.05)], inputs=m.inputs
    )
    with pytest.raises(Exception, match="input"):
        twice.motion(0.1)


# --- drawn ------------------------------------------------------------------------------------------------------------
def test_a_rack_is_drawn_with_teeth_along_the_pitch_circle() -> None:
    drawing = draw(rack(0.03, 0.0), [(-0.1, 0.2)])
    (wheel,) = [s for s in drawing.shapes if isinstance(s, Circle) and s.role == "wheel"]
    (teeth,) = [s for s in drawing.shapes if isinstance(s, Line) and s.role == "rack"]
    assert (wheel.body, wheel.radius, teeth.body) == ("pinion", 0.03, "rack")
    heights = {round(z.imag, 12) for z in teeth.points}
    # the guided point stands on the pitch line, and the teeth reach either side of it
    assert len(heights) == 2
    assert sum(heights) == pytest.approx(0.0, abs=1e-12)
    assert min(z.real for z in teeth.points) < -0.2
    assert max(z.real for z in teeth.points) > 0.1


@pytest.mark.parametrize("crossed", [False, True])
def test_a_belt_is_drawn_as_tangents_of_its_wheels(crossed: bool) -> None:
    m = Mechanism(
        {"M": 0j, "D": 0.4 + 0.1j},
        {"motor": Link({"M": 0j}), "drum": Link({"D": 0j})},
        belts=[Belt(("motor", "drum"), (0.06, 0.15), crossed)],
        inputs=Input("motor", value=0.0),
    )
    (belt,) = [s for s in draw(m).shapes if isinstance(s, Line) and s.role == "belt"]
    points = np.array([*belt.points, belt.points[0]])
    longest = np.argsort(-np.abs(np.diff(points)))[:2]
    for k in longest:
        a, b = points[k], points[k + 1]
        along = (b - a) / abs(b - a)
        for centre, radius in ((0j, 0.06), (0.4 + 0.1j, 0.15)):
            assert abs(((centre - a) * along.conjugate()).imag) == pytest.approx(radius, rel=1e-12)
    away = math.sqrt(abs(0.4 + 0.1j) ** 2 - (0.15 + (0.06 if crossed else -0.06)) ** 2)
    assert np.abs(np.diff(points))[longest] == pytest.approx(away, rel=1e-12)


# --- at random, in 50 digits ------------------------------------------------------------------------------------------
def test_the_examples_stand(tmp_path: Path) -> None:
    from cli.examples import EXAMPLES

    for name in ("rack-lift", "belt-drive", "doubling-rack"):
        m = Mechanism.from_toml(EXAMPLES / name / f"{name}.toml")
        assert m.motion().assembled.all()


@pytest.mark.parametrize("path", ["racks.1.radius", "links.rod.B.x", "links.crank.A.x", "links.rod.mass"])
def test_sensitivities_of_a_wheel_behind_a_loop(path: str) -> None:
    """The wheel stands at its guess where the guess places the slide: that place depends on the dimensions too."""
    m, h = engine(), 1e-6
    motion = m.motion(Q)
    exact = motion.link("wheel").sensitivity(path), motion.sensitivity("effort", path)
    there = number_at(m, path)
    moved = [changed(m, {path: there + s * h}).motion(Q) for s in (1, -1)]
    turned = np.angle(np.exp(1j * (moved[0].link("wheel").angle - moved[1].link("wheel").angle)))
    assert exact[0] == pytest.approx(turned / (2 * h), rel=1e-6, abs=1e-7)
    assert exact[1] == pytest.approx((moved[0].effort - moved[1].effort) / (2 * h), rel=1e-5, abs=1e-5)
