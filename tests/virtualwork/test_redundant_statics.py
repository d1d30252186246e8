"""Redundant constraints: what statics still determines, against the same mechanism without the redundant part."""

from __future__ import annotations

import math

import numpy as np
import pytest

from virtualwork import GROUND, Force, Gear, Guess, Guide, Input, Link, Mechanism, Torque


def parallelogram(third_crank: bool) -> Mechanism:
    """A parallelogram that swings a lever by a slot, an arm by a prism, and a wheel; perhaps with a third crank."""
    links = {
        "crank": Link({"A": 0j, "B": 1}, 2.0, 0.4 + 0.1j, 0.2),
        "coupler": Link({"B": 0j, "E": 1, "C": 2, "T": 1.5 + 0.5j}, 3.0, 0.8, 0.3),
        "rocker": Link({"D": 0j, "C": 1, "S": 0.7 + 0.2j}),
        "lever": Link({"G": 0j}, 1.0, 0.5, 0.1),
        "block": Link({"T": 0j}, 0.5, 0.1, 0.01),
        "arm": Link({"H": 0j}, 1.5, 0.6, 0.2),
        "wheel": Link({"A": 0j}, 0.5, 0j, 0.05),
    }
    guides = [
        Guide("S", "rocker", "lever", 0.1j, 0.2),
        Guide("T", "block", "arm", "H", -0.3, 0.5),
    ]
    guess = {"coupler": 0.0, "rocker": 1.0, "lever": -0.5, "arm": 0.5, "wheel": 0.2}
    if third_crank:
        links["middle"] = Link({"F": 0j, "E": 1})
        guess["middle"] = 1.0
    ground = {"A": 0j, "D": 2, "F": 1, "G": 1.2 + 1.5j, "H": 4 + 0.3j}
    return Mechanism(
        ground if third_crank else {k: v for k, v in ground.items() if k != "F"},
        links,
        guides,
        [Gear(("crank", "wheel"), -2.0)],
        inputs=Input(link="crank"),
        guess=Guess(1.0, guess),
        gravity=-9.81j,
        torques=[Torque("lever", 3.0), Torque("wheel", -1.0)],
        forces=[Force("arm", 1.0 + 0j, 5.0 - 8.0j, "link")],
    )


def test_joints_beside_the_redundancy_feel_nothing_of_it() -> None:
    alone, both = (parallelogram(third).motion(np.array([0.9, 1.1]), 2.0, -1.5) for third in (False, True))
    assert alone.dynamics.statics is None
    assert both.dynamics.statics is not None
    assert both.assembled.all()
    assert both.dynamics.newton_euler == pytest.approx(alone.dynamics.newton_euler, rel=1e-10)
    assert both.effort == pytest.approx(alone.effort, rel=1e-11)
    size = 100.0
    seen = 0
    for joint in alone.dynamics.reactions.joints:
        if {"crank", "coupler", "rocker"} & set(joint.bodies) and joint.name in "BCD":
            continue  # along the coupler the three cranks share what no statics can tell
        twin = next(j for j in both.dynamics.reactions.joints if j.key == joint.key)
        for body in joint.bodies:
            if joint.name == "A":
                continue
            force = alone.dynamics.joint_force(joint, body)
            assert np.isfinite(force).all()
            assert np.abs(both.dynamics.joint_force(twin, body) - force).max() < 1e-11 * size, (
                joint.name,
                body,
            )
            if joint.guide is not None:
                moment = alone.dynamics.joint_moment(joint, body)
                assert both.dynamics.joint_moment(twin, body) == pytest.approx(moment, abs=1e-11 * size)
            seen += 1
    assert seen >= 8


def test_a_piston_in_a_prism_and_a_slot() -> None:
    """The prism and the slot share the piston's side force: only their sum −F tan φ is determined, and the torque."""
    r, length, force = 0.1, 0.3, -1000.0
    m = Mechanism(
        {"O": 0j},
        {
            "crank": Link({"O": 0j, "A": r}),
            "rod": Link({"A": 0j, "B": length}),
            "piston": Link({"B": 0j, "K": 0.05}),
        },
        [Guide("B", "piston", turned=0.0), Guide("K", "piston")],
        inputs=Input(link="crank"),
        guess=Guess(1.0, {"rod": -0.3}),
        forces=[Force("piston", 0j, force)],
    )
    theta = np.array([0.4, 1.2, 2.5])
    phi = np.arcsin(r * np.sin(theta) / length)
    d = m.motion(theta).dynamics
    torque = force * r * np.sin(theta + phi) / np.cos(phi)
    assert d.statics is not None
    assert d.newton_euler[:, 0] == pytest.approx(torque, rel=1e-11)
    rod = force * (1 - 1j * np.tan(phi))  # what crosses the rod: along it, its part along the line the load
    for name, body, sign in (("A", "rod", -1), ("A", "crank", 1), ("O", "crank", -1), ("O", GROUND, 1)):
        (joint,) = (j for j in d.reactions.joints if j.name == name and j.guide is None)
        assert d.joint_force(joint, body) == pytest.approx(sign * rod, rel=1e-11)
    prism, slot = (j for j in d.reactions.joints if j.guide is not None)
    assert np.isnan(d.joint_force(prism, "piston")).all()
    assert np.isnan(d.joint_force(slot, "piston")).all()
    assert np.isnan(d.joint_moment(prism, "piston")).all()
    said = d.statics.undetermined()
    assert said[0] == (
        "statics does not determine the normal force of guide B, the moment of guide B, the normal force of guide K"
    )
    assert said[1:] == ["determined are the sums of normal force on piston at B and K"]


def test_a_driven_piston_in_a_prism_and_a_slot() -> None:
    """Driven at the piston against a torque on the crank: P = T cos φ/(r sin(θ + φ)) along the line, by the rod."""
    r, length, torque = 0.1, 0.3, 40.0
    m = Mechanism(
        {"O": 0j},
        {
            "crank": Link({"O": 0j, "A": r}),
            "rod": Link({"A": 0j, "B": length}),
            "piston": Link({"B": 0j, "K": 0.05}),
        },
        [Guide("B", "piston", "ground", "O", 0.6, 0.0), Guide("K", "piston", "ground", "O", 0.6)],
        inputs=Input(slider="B"),
        guess=Guess(0.35, {"crank": 1.3, "rod": 0.3}),
        torques=[Torque("crank", torque)],
    )
    x = np.array([0.25, 0.35])
    theta = np.arccos((x**2 + r**2 - length**2) / (2 * r * x))  # of the crank to the line
    phi = np.arcsin(r * np.sin(theta) / length)
    push = torque * np.cos(phi) / (r * np.sin(theta + phi))
    d = m.motion(x).dynamics
    assert d.statics is not None
    assert d.effort[:, 0] == pytest.approx(push, rel=1e-12)
    assert d.newton_euler[:, 0] == pytest.approx(push, rel=1e-11)
    (pin,) = (j for j in d.reactions.joints if j.name == "A" and j.guide is None)
    pull = push * (1 - 1j * np.tan(phi)) * np.exp(0.6j)  # along the rod, which hangs back by φ from the line
    assert d.joint_force(pin, "crank") == pytest.approx(pull, rel=1e-11)


def test_two_equal_gear_pairs_share_their_force() -> None:
    """A wheel of ratio −2 behind two meshes of which one would do: the driving torque is −2·T_wheel all the same."""
    m = Mechanism(
        {"A": 0j, "D": 3},
        {"pinion": Link({"A": 0j}), "wheel": Link({"D": 0j})},
        gears=[Gear(("pinion", "wheel"), -2.0), Gear(("pinion", "wheel"), -2.0)],
        inputs=Input(link="pinion"),
        torques=[Torque("wheel", 5.0)],
    )
    d = m.motion(np.array([0.3])).dynamics
    assert d.statics is not None
    assert d.newton_euler[0, 0] == pytest.approx(2 * 5.0, rel=1e-12)
    assert d.effort[0, 0] == pytest.approx(2 * 5.0, rel=1e-14)
    assert d.statics.undetermined() == ["statics does not determine the gear of gear 1, the gear of gear 2"]


def test_a_load_that_nothing_can_hold_has_no_reactions() -> None:
    """A parallelogram with three cranks in one line, pushed across: the self-stress is no answer to the push."""
    m = Mechanism(
        {"A": 0j, "D": 2, "F": 1},
        {
            "crank": Link({"A": 0j, "B": 1}),
            "coupler": Link({"B": 0j, "E": 1, "C": 2}),
            "middle": Link({"F": 0j, "E": 1}),
            "rocker": Link({"D": 0j, "C": 1}),
        },
        inputs=Input(link="crank"),
        guess=Guess(1.0, {"coupler": 0.0, "middle": 1.0, "rocker": 1.0}),
        forces=[Force("coupler", 1.0 + 0j, -10j)],
    )
    d = m.motion(np.array([0.0, math.pi / 2])).dynamics
    # upright the cranks carry the push between them and the input feels nothing; flat it turns them all
    assert d.newton_euler[1, 0] == pytest.approx(0.0, abs=1e-12)
    assert d.effort[1, 0] == pytest.approx(0.0, abs=1e-14)
    assert np.isnan(d.newton_euler[0, 0])


def test_what_is_determined_of_three_cranks_is_named() -> None:
    """The cranks share the coupler's load; known are the sums that the forces on each link, and on all, must have."""
    m = Mechanism(
        {"A": 0j, "D": 2, "F": 1},
        {
            "crank": Link({"A": 0j, "B": 1}),
            "coupler": Link({"B": 0j, "E": 1, "C": 2}, 3.0, 0.8),
            "middle": Link({"F": 0j, "E": 1}),
            "rocker": Link({"D": 0j, "C": 1}),
        },
        inputs=Input(link="crank"),
        guess=Guess(1.0, {"coupler": 0.0, "middle": 1.0, "rocker": 1.0}),
        gravity=-9.81j,
    )
    d = m.motion(np.array([0.9, 1.2])).dynamics
    assert d.statics is not None
    open_, sums = d.statics.undetermined()
    pins = (
        "A on crank",
        "D on rocker",
        "F on middle",
        "B on crank",
        "B on coupler",
        "E on coupler",
        "E on middle",
    )
    for axis in ("fx", "fy"):
        for pin in (*pins, "C on coupler", "C on rocker"):
            assert f"{axis} at {pin}" in open_
    links = ("crank at A and B", "coupler at B and E and C", "middle at F and E", "rocker at D and C")
    assert sums == "determined are the sums of " + "; ".join(
        text
        for axis in ("fx", "fy")
        for text in (*(f"{axis} on {link}" for link in links), f"{axis} from the ground at A and D and F")
    )


def test_a_dyad_out_of_reach_at_the_guess_beside_redundant_cranks() -> None:
    """Its branch is that of the guessed angles, as it is without the third crank."""
    turns = np.array([0.5, 1.5])
    reached = []
    for third in (False, True):
        ground = {"A": 0j, "D": 2, "Z": 1 + 3.5j} | ({"F": 1} if third else {})
        links = {
            "crank": Link({"A": 0j, "B": 1}),
            "coupler": Link({"B": 0j, "E": 1, "C": 2}),
            "rocker": Link({"D": 0j, "C": 1}),
            "bar": Link({"E": 0j, "R": 1.4}),
            "arm": Link({"Z": 0j, "R": 1.4}),
        } | ({"middle": Link({"F": 0j, "E": 1})} if third else {})
        angles = {"coupler": 0.0, "rocker": 0.1, "middle": 0.1, "bar": 1.0, "arm": -2.0}
        guess = Guess(0.1, {name: angle for name, angle in angles.items() if name in links})
        motion = Mechanism(ground, links, inputs=Input(link="crank"), guess=guess).motion(turns)
        assert motion.assembled.tolist() == [False, True]
        reached.append(motion.point("R").position[1])
    assert reached[1] == pytest.approx(reached[0], rel=1e-12)
