"""Friction in a pin between two arms and in a slot that moves, each in closed form."""

from __future__ import annotations

import cmath
import math

import mpmath as mp
import numpy as np
import pytest

from benchmarks.truth.constraints import DIGITS
from benchmarks.truth.mechanism import Exact
from virtualwork import DescriptionError, Friction, Guess, Guide, Input, Link, Mechanism, Torque
from virtualwork.study.ledger import ledger

G = 9.81


def cross(a: complex, b: complex) -> float:
    return (a.conjugate() * b).imag


@pytest.mark.parametrize("speeds", [(1.0, 3.0), (2.0, -1.0), (1.5, 1.5)])
@pytest.mark.parametrize("swap", [False, True])
def test_an_elbow_that_rubs(speeds: tuple[float, float], swap: bool) -> None:
    """μ r |R| at the elbow, R = m (a − g) of the lower arm, on it and back on the upper one; none where nothing slips."""
    mu, radius, reach, center, mass = 0.2, 0.03, 1.2, 0.4, 3.0
    links = {"upper": Link({"O": 0j, "E": reach}), "lower": Link({"E": 0j}, mass, center)}
    if swap:
        links = dict(reversed(links.items()))
    m = Mechanism(
        {"O": 0j},
        links,
        inputs=(Input(link="upper"), Input(link="lower")),
        gravity=-G * 1j,
        friction=[Friction("E", mu, radius)],
    )
    one, two = 0.3, 0.9
    motion = m.motion(np.array([[one, two]]), speed=list(speeds))
    arm, end = reach * cmath.exp(1j * one), center * cmath.exp(1j * two)
    held = mass * (-(speeds[0] ** 2) * arm - speeds[1] ** 2 * end + G * 1j)
    slip = math.copysign(1.0, speeds[1] - speeds[0]) if speeds[1] != speeds[0] else 0.0
    rub = mu * radius * abs(held) * slip
    exact = [cross(arm, held) - rub, cross(end, held) + rub]
    assert motion.dynamics.effort[0] == pytest.approx(exact, rel=1e-13)
    assert motion.dynamics.newton_euler[0] == pytest.approx(exact, rel=1e-13)
    (pin,) = (j for j in motion.dynamics.reactions.joints if j.name == "E")
    assert motion.dynamics.joint_moment(pin, "lower")[0] == pytest.approx(-rub, rel=1e-13)
    assert motion.dynamics.joint_moment(pin, "upper")[0] == pytest.approx(rub, rel=1e-13)


@pytest.mark.parametrize("speed", [2.0, -2.0, 0.0])
def test_a_slot_that_turns_and_rubs(speed: float) -> None:
    """A quick return, its lever loaded with M: N = M/d across the slot, and μ N along it against the sliding."""
    mu, load, base = 0.3, 25.0, -1.5
    m = Mechanism(
        {"O": 0j, "Q": base},
        {"crank": Link({"O": 0j, "B": 1.0}), "lever": Link({"Q": 0j})},
        [Guide("B", "crank", "lever", "Q")],
        inputs=Input(link="crank"),
        guess=Guess(1.0, {"lever": 0.5}),
        torques=[Torque("lever", load)],
        friction=[Friction("B", mu)],
    )
    q = np.array([0.4, 1.2, 4.0])
    motion = m.motion(q, speed)
    for i, theta in enumerate(q):
        pin = cmath.exp(1j * theta)
        d = abs(pin - base)
        rail = (pin - base) / d
        normal = load / d  # on the pin, along i·rail: the lever would turn on with M
        sliding = (1j * pin * speed * rail.conjugate()).real
        rub = -mu * normal * (math.copysign(1.0, sliding) if sliding else 0.0)
        exact = -cross(pin, normal * 1j * rail + rub * rail)
        assert motion.effort[i] == pytest.approx(exact, rel=1e-13)
        assert motion.dynamics.newton_euler[i, 0] == pytest.approx(exact, rel=1e-13)
        works, workless, _ = ledger(motion.dynamics)
        assert sum(works.values())[i] == pytest.approx(-exact, rel=1e-13)
        assert workless == []
        (guide,) = (j for j in motion.dynamics.reactions.joints if j.name == "B")
        force = motion.dynamics.joint_force(guide, "crank")[i]
        assert force == pytest.approx(normal * 1j * rail + rub * rail, rel=1e-13)
        assert motion.dynamics.joint_force(guide, "lever")[i] == pytest.approx(-force, rel=1e-13)


def test_a_plate_that_hangs_on_its_rubbing_rail() -> None:
    """The plate is placed by the rail itself: driven along it at 2 m/s, μ m g cos θ pushes with its weight's part."""
    mu, mass, slope = 0.25, 4.0, 0.3
    m = Mechanism(
        {"O": 0j},
        {"arm": Link({"O": 0j, "B": 1.0}), "plate": Link({"K": 0j}, mass, 0j)},
        [Guide("B", "arm", "plate", 0j, slope, 0.0)],
        inputs=[Input(link="arm"), Input(slider="B")],
        guess=Guess((0.6, 0.0)),
        gravity=-G * 1j,
        friction=[Friction("B", mu)],
    )
    # the plate turns with the arm, at θ − slope; the rail lies along θ; the pin slides on it at s
    for speed in (2.0, -2.0):
        motion = m.motion(np.array([[0.6, 0.4]]), speed=[0.0, speed])
        normal = mass * G * math.cos(0.6)
        push = -mass * G * math.sin(0.6) + math.copysign(mu * normal, speed)
        # the plate's centre stands at B − s·e^{iθ}: the arm holds its weight there
        torque = mass * G * (1 - 0.4) * math.cos(0.6)
        assert motion.dynamics.effort[0] == pytest.approx([torque, push], rel=1e-13)
        assert motion.dynamics.newton_euler[0] == pytest.approx([torque, push], rel=1e-13)


def test_friction_where_there_is_no_joint() -> None:
    m = Mechanism(
        {"O": 0j},
        {"bar": Link({"O": 0j, "P": 1}, 1.0, 0.5)},
        inputs=Input(link="bar"),
        friction=[Friction("P", 0.1, 0.01)],
    )
    motion = m.motion(0.3, 1.0)
    with pytest.raises(DescriptionError, match="no joint"):
        motion.effort  # noqa: B018


@pytest.mark.parametrize("tilt", [0.3, 1.7, -2.1])
def test_what_does_not_slide_does_not_rub(tilt: float) -> None:
    """A block held on a lever by a prism and a slot: its slides' rates are rounding, whose sign once gave them friction."""
    links = {
        "lever": Link({"O": 0j}, 2.0, 0.4 + 0.1j, 0.3),
        "block": Link({"A": 0.1 + 0.2j, "B": -0.3 + 0.1j}, 1.5, 0.2 - 0.1j, 0.1),
    }
    guides = [
        Guide("A", "block", "lever", 0.7 + 0.3j, tilt, turned=0.2),
        Guide("B", "block", "lever", 0.5 - 0.2j, tilt + 1.1),
    ]
    guess = Guess(1.0, {"block": 1.2 + tilt})
    q = np.linspace(0.4, 1.9, 25)
    forces = []
    for friction in ([], [Friction("A", 0.3), Friction("B", 0.2)]):
        m = Mechanism(
            {"O": 0j},
            links,
            guides,
            inputs=Input(link="lever"),
            guess=guess,
            gravity=-G * 1j,
            friction=friction,
        )
        dynamics = m.motion(q, 1.3, -0.7).dynamics
        forces.append([dynamics.joint_force(joint, "block") for joint in dynamics.reactions.joints[1:]])
    np.testing.assert_allclose(forces[1], forces[0], rtol=0, atol=1e-12)


def pushed(*friction: Friction) -> Mechanism:
    """A slider-crank that its slider drives; a slot along the rod holds the two parts of it in line."""
    angle = 0.3
    lean = -math.asin(math.sin(angle) / 2)
    place = math.cos(angle) + 2 * math.cos(lean)
    return Mechanism(
        {"A": 0j},
        {
            "crank": Link({"A": 0j, "B": 1.0}, 1.0, 0.5),
            "near": Link({"B": 0j, "H": 0.75}, 1.0, 0.5, 0.25),
            "far": Link({"H": 0j, "K": 0.5, "C": 1.25}, 1.0, 0.75, 0.25),
            "block": Link({"C": 0j}, 3.0),
        },
        [Guide("C", "block", turned=0.0), Guide("K", "far", "near", "H")],
        inputs=Input(slider="C", value=place),
        guess=Guess(place, {"crank": angle, "near": lean, "far": lean}),
        gravity=-G * 1j,
        friction=friction,
    )


@pytest.mark.parametrize("off", [1e-7, 1e-3, 1e-5, 1e-9])
def test_a_pin_in_a_rod_of_two_parts_does_not_rub(off: float) -> None:
    """Beside the dead point both turn fast together, and what rounds there is no slip, for the judge of the campaigns neither.

    Truth: the forces without friction, in fifty digits.
    """
    motion = pushed(Friction("H", 0.2, 0.05)).motion(3 - off, 7e3, 0.1)
    true, judged = Exact(pushed().motion(3 - off, 7e3, 0.1)).forces(), Exact(motion).forces()
    dynamics, estimate = motion.dynamics, motion.dynamics.error_estimate()
    (pin,) = (j for j in dynamics.reactions.joints if j.name == "H")
    assert dynamics.joint_moment(pin, "far")[0] == 0
    with mp.workdps(DIGITS):
        parts = [true["pin:H", "far", part] for part in (0, 1)]
        for part, x in enumerate(parts):
            assert abs(judged["pin:H", "far", part] / x - 1) < mp.mpf(10) ** -25
        error = abs(mp.mpc(*parts) - mp.mpc(complex(dynamics.joint_force(pin, "far")[0])))
        assert error <= estimate.joint_force(pin, "far")[0]
