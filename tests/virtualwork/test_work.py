"""Effort, reactions, equilibrium, cycle, friction and counterweights of mechanisms, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.virtualwork.mechanisms import SWEEP, four_bar, slider_crank
from virtualwork import (
    Force,
    Friction,
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
from virtualwork.formulas.forces import Effort, NewtonEuler, Reaction
from virtualwork.study.ledger import ledger

# -- virtual work and Newton-Euler ------------------------------------------------------------------------------


def test_virtual_work_is_newton_euler() -> None:
    """Both efforts agree to rounding of the largest term, over random masses, springs and both assemblies."""
    rng = np.random.default_rng(7)
    worst = 0.0
    for _ in range(40):
        links = {
            "crank": Link(
                {"A": 0j, "B": 0.04},
                rng.uniform(0, 2),
                complex(*rng.normal(size=2)) * 0.05,
                rng.uniform(0, 0.01),
            ),
            "coupler": Link(
                {"B": 0j, "C": 0.12},
                rng.uniform(0, 2),
                complex(*rng.normal(size=2)) * 0.05,
                rng.uniform(0, 0.01),
            ),
            "rocker": Link(
                {"D": 0j, "C": 0.08},
                rng.uniform(0, 2),
                complex(*rng.normal(size=2)) * 0.05,
                rng.uniform(0, 0.01),
            ),
        }
        m = Mechanism(
            ground={"A": 0j, "D": 0.1},
            links=links,
            inputs=Input(link="crank"),
            guess=Guess(at=(0.7,), angles={"coupler": 0.3, "rocker": rng.choice([1.0, -2.0])}),
            gravity=complex(*rng.normal(size=2)) * 10,
            forces=[
                Force(
                    "coupler", complex(*rng.normal(size=2)) * 0.1, complex(*rng.normal(size=2)) * 50, "link"
                )
            ],
            torques=[Torque("rocker", rng.normal())],
            springs=[Spring((("coupler", 0.05 + 0.02j), ("ground", 0.3j)), 100.0, 0.1, 2.0)],
            torsion_springs=[TorsionSpring(("ground", "rocker"), 2.0, 0.4, 0.1)],
        )
        motion = m.motion(SWEEP, float(rng.normal() * 30), float(rng.normal() * 100))
        works, _, _ = ledger(motion.dynamics)
        largest = np.max([np.abs(work) for work in works.values()], axis=0)
        gap = np.abs(motion.dynamics.newton_euler[:, 0] - motion.effort) / largest
        worst = max(worst, float(gap.max()))
    assert worst <= 1e-12


def test_static_slider_crank_in_closed_form() -> None:
    """T = F r sin(θ + φ)/cos φ, and the guide's reaction −F tan φ."""
    r, length, force = 0.1, 0.3, -1000.0
    m = slider_crank(r, length, forces=[Force("piston", 0j, force)])
    theta = np.array([0.4, 1.2, 2.5, 4.0, 5.5])
    phi = np.arcsin(r * np.sin(theta) / length)
    motion = m.motion(theta)
    exact = force * r * np.sin(theta + phi) / np.cos(phi)
    assert motion.effort == pytest.approx(exact, rel=1e-13)
    guide = next(j for j in motion.dynamics.reactions.joints if j.guide == 0)
    wall = motion.dynamics.joint_force(guide, "piston")
    assert np.abs(wall.real).max() <= 1e-11
    assert wall.imag == pytest.approx(-force * np.tan(phi), rel=1e-12)


def test_only_what_is_asked_for_is_formed() -> None:
    m = four_bar()
    motion = m.motion(1.0, 10.0)
    _ = motion.effort
    assert motion.dynamics.__dict__.get("reactions") is None  # the effort forms no reaction
    motion.reaction("C", on="rocker")
    formed = motion.dynamics.forces.pose.names
    assert not any("A on" in name or "D on" in name for name in formed)
    motion.reaction("A", on="crank")
    assert "pin:A on crank" in formed
    # of many poses the tape has no more than that either
    poses = m.motion(SWEEP, 10.0).poses
    effort, one, both = (
        poses.operations(keys)
        for keys in (
            [Effort(0)],
            [Reaction("C", "rocker")],
            [Effort(0), Reaction("C", "rocker")],
        )
    )
    assert max(effort, one) < both < poses.operations([Effort(0), NewtonEuler(0)]) + one


def test_loads_that_do_no_work_are_never_evaluated() -> None:
    # the crank's centre of mass is its fixed pin; a force on the rocker acts at the rocker's fixed pin
    m = Mechanism(
        ground={"A": 0j, "D": 0.1},
        links={
            "crank": Link({"A": 0j, "B": 0.04}, 1.0, 0j, 1e-3),
            "coupler": Link({"B": 0j, "C": 0.12}),
            "rocker": Link({"D": 0j, "C": 0.08}),
        },
        inputs=Input(link="crank"),
        guess=Guess(at=(0.7,), angles={"coupler": 0.3, "rocker": 1.0}),
        gravity=-9.81j,
        forces=[Force("rocker", 0j, 500.0 + 0j)],
    )
    motion = m.motion(SWEEP, 10.0)
    assert (motion.effort == 0).all()
    dynamics = motion.dynamics
    # no load was evaluated, each acts where nothing moves or its rate is zero; nor anything made of loads
    kept = dynamics.pose.kept.values()
    assert all(value is None or value[1] is None for value in kept)
    works, workless, _ = ledger(dynamics)
    assert "crank: weight" in workless
    assert "rocker: applied force" in workless
    assert [name for name in works if "rocker" in name or "coupler" in name] == []


def test_shaking_force_is_what_the_ground_feels() -> None:
    m = four_bar(
        gravity=-9.81j, springs=[Spring((("rocker", 0.05 + 0j), ("ground", 0.2 + 0.1j)), 50.0, 0.02, 1.0)]
    )
    motion = m.motion(SWEEP, 20.0, 5.0)
    force, moment = motion.dynamics.shaking
    pins = [(name, link, motion.reaction(name, link)) for name, link in (("A", "crank"), ("D", "rocker"))]
    end = motion.at("rocker", 0.05).complex(0) - (0.2 + 0.1j)
    rate = motion.at("rocker", 0.05).complex(1)
    length = np.abs(end)
    pull = (50.0 * (length - 0.02) + (end.conjugate() * rate).real / length) * end / length  # on the ground
    total = -sum(reaction for _, _, reaction in pins) + np.stack([pull.real, pull.imag], axis=-1)
    assert np.abs(total - force).max() <= 1e-12 * np.abs(force).max()
    about = -sum(
        motion.point(n).position[:, 0] * f[:, 1] - motion.point(n).position[:, 1] * f[:, 0]
        for n, _, f in pins
    )
    about = about + 0.2 * pull.imag - 0.1 * pull.real - motion.effort
    assert np.abs(about - moment).max() <= 1e-12 * np.abs(moment).max()


def test_dead_point_spoils_no_other_pose() -> None:
    # driven at the piston, the crank's dead point makes the velocity ratio infinite
    m = Mechanism(
        ground={"O": 0j},
        links={
            "crank": Link({"O": 0j, "A": 0.1}),
            "rod": Link({"A": 0j, "B": 0.3}),
            "piston": Link({"B": 0j}),
        },
        guides=[Guide("B", "piston", turned=0.0)],
        inputs=Input(slider="B"),
        guess=Guess(at=(0.35,), angles={"crank": 0.7, "rod": -0.2}),
        torques=[Torque("crank", 5.0)],
    )
    motion = m.motion(np.array([0.4, 0.35, 0.3]))
    assert not np.isfinite(motion.effort[0])
    x = np.array([0.35, 0.3])
    cosine = (x**2 + 0.01 - 0.09) / (2 * x * 0.1)
    theta = np.arccos(cosine)
    phi = np.arcsin(0.1 * np.sin(theta) / 0.3)
    ratio = -0.1 * np.sin(theta + phi) / np.cos(phi)  # dx/dθ
    assert motion.effort[1:] == pytest.approx(-5.0 / ratio, rel=1e-12)


def test_a_serial_arm_with_motors_on_its_links() -> None:
    """The same arm driven by relative angles, and by absolute ones with the motor carried by the upper link."""
    links = {"upper": Link({"O": 0j, "E": 1}, 2, 0.5, 0.1), "lower": Link({"E": 0j}, 1, 0.4, 0.05)}
    relative = Mechanism(
        {"O": 0j}, links, inputs=(Input(link="upper"), Input(link="lower", on="upper")), gravity=-9.81j
    )
    carried = Mechanism(
        {"O": 0j},
        links,
        inputs=(Input(link="upper"), Input(link="lower")),
        gravity=-9.81j,
        motors=[Motor("upper", "lower")],
    )
    at_rest = relative.motion(np.array([[0.3, 0.5]])).effort[0]
    lower = 9.81 * 0.4 * math.cos(0.8)
    assert at_rest == pytest.approx([9.81 * 2 * math.cos(0.3) + lower, lower], rel=1e-14)
    one = relative.motion(np.array([[0.3, 0.5]]), np.array([[1.0, 2.0]]), np.array([[0.5, -1.0]]))
    other = carried.motion(np.array([[0.3, 0.8]]), np.array([[1.0, 3.0]]), np.array([[0.5, -0.5]]))
    for motion in (one, other):
        assert motion.effort[0] == pytest.approx(one.effort[0], rel=1e-13)
        assert motion.dynamics.newton_euler[0] == pytest.approx(one.effort[0], rel=1e-13)
        for joint, on in (("O", "upper"), ("E", "lower")):
            assert motion.reaction(joint, on)[0] == pytest.approx(one.reaction(joint, on)[0], rel=1e-13)


# -- friction ---------------------------------------------------------------------------------------------------


def test_friction_of_a_guide_in_closed_form() -> None:
    """A slider-crank whose guide rubs: the rod's force S obeys S cos φ + μ|S sin φ| = F when the piston moves outward."""
    r, length, force, mu = 0.1, 0.3, -1000.0, 0.2
    m = slider_crank(r, length, forces=[Force("piston", 0j, force)], friction=[Friction("B", mu)])
    theta = np.array([4.0, 4.5, 5.5])  # ẋ > 0 against the load
    motion = m.motion(theta, 1.0)
    phi = np.arcsin(r * np.sin(theta) / length)
    rod = -force / (np.cos(phi) - mu * np.abs(np.sin(phi)))  # pushes the piston outward
    exact = -rod * r * np.sin(theta + phi)
    assert motion.effort == pytest.approx(exact, rel=1e-12)
    assert motion.dynamics.newton_euler[:, 0] == pytest.approx(exact, rel=1e-12)
    assert 1 < motion.dynamics.friction_iterations < 60
    assert not motion.dynamics.locked.any()


def test_friction_of_a_pin_in_closed_form() -> None:
    """A turning arm with a load at its pin: the torque is μ r |F| against the turning."""
    m = Mechanism(
        {"O": 0j}, {"arm": Link({"O": 0j}, mass=10.0)}, inputs=Input(link="arm"), gravity=-9.81j,
        friction=[Friction("O", 0.1, 0.02)],
    )  # fmt: skip
    for speed in (2.0, -2.0):
        assert m.motion(0.3, speed).effort[0] == pytest.approx(
            math.copysign(0.1 * 0.02 * 98.1, speed), rel=1e-14
        )
    assert m.motion(0.3, 0.0).effort[0] == 0.0


def test_friction_that_locks_is_said() -> None:
    """A guide loaded beyond its friction angle cannot move, however hard the rod pushes."""
    m = slider_crank(0.1, 0.11, forces=[Force("piston", 0j, -1000.0)], friction=[Friction("B", 0.9)])
    motion = m.motion(np.array([1.5 * np.pi - 0.25, 5.9]), 1.0)
    assert motion.dynamics.locked.tolist() == [True, False]
    assert np.isnan(motion.effort[0])
    assert np.isfinite(motion.effort[1])


# -- redundant constraints -----------------------------------------------------------------------------------------


def test_redundant_reactions_are_said_to_be_undetermined() -> None:
    """A parallelogram with a third, equal crank moves; along the coupler the pins share what statics cannot tell."""
    m = Mechanism(
        ground={"A": 0j, "D": 2 + 0j, "F": 1 + 0j},
        links={
            "crank": Link({"A": 0j, "B": 1}),
            "coupler": Link({"B": 0j, "E": 1, "C": 2}, 3.0, 0.8),
            "middle": Link({"F": 0j, "E": 1}),
            "rocker": Link({"D": 0j, "C": 1}),
        },
        inputs=Input(link="crank"),
        guess=Guess(at=(1.0,), angles={"coupler": 0.0, "middle": 1.0, "rocker": 1.0}),
        gravity=-9.81j,
    )
    motion = m.motion(np.array([0.9, 1.2]))
    d = motion.dynamics
    assert d.reactions.redundant
    # the torque is determined: the coupler does not turn, the weight falls with the crank's pin
    assert d.newton_euler[:, 0] == pytest.approx(3 * 9.81 * np.cos([0.9, 1.2]), rel=1e-12)
    assert motion.effort == pytest.approx(3 * 9.81 * np.cos([0.9, 1.2]), rel=1e-12)
    assert np.isnan(motion.reaction("E", "middle")).any()
    assert d.statics is not None
    said = " ".join(d.statics.undetermined())
    assert "does not determine" in said
    assert "determined are the sums of" in said
