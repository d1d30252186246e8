"""Motion under forces of groups without a closed form, with friction and through dead points of the input.

The authority is `benchmarks.truth.bodies_in_time`: every body's own coordinates, with the joint forces as multipliers.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.truth.bodies_in_time import Bodies
from virtualwork import Friction, Gear, Guess, Input, Link, Mechanism, TorsionSpring

G = 9.81


def frame(**more: object) -> Mechanism:
    """An A-frame of two bars and a plate, shaken by a crank and a rod: three pins of the plate, no closed form."""
    return Mechanism(
        {"G": 1.5 + 0.6j, "A": 0j, "D": 1 + 0j},
        {
            "crank": Link({"G": 0j, "F": 0.2 + 0j}, mass=1, center=0.1 + 0j, inertia=0.02),
            "rod": Link({"F": 0j, "E": 1.05 + 0j}, mass=0.5, center=0.5 + 0j, inertia=0.05),
            "plate": Link(
                {"B": 0j, "C": 0.8 + 0j, "E": 0.45 + 0.6j}, mass=1.2, center=0.4 + 0.2j, inertia=0.06
            ),
            "left": Link({"A": 0j, "B": 0.7 + 0j}, mass=0.6, center=0.35 + 0j, inertia=0.03),
            "right": Link({"D": 0j, "C": 0.75 + 0j}, mass=0.6, center=0.35 + 0j, inertia=0.03),
        },
        inputs=Input(link="crank", value=math.pi / 2),
        guess=Guess(
            math.pi / 2, points={"B": 0.1 + 0.69j, "C": 0.88 + 0.74j, "E": 0.5 + 1.3j, "F": 1.5 + 0.8j}
        ),
        gravity=-1j * G,
        **more,  # type: ignore[arg-type]
    )


def watt(**more: object) -> Mechanism:
    """A crank-rocker whose rocker drives a second one: at its dead points the second loop turns back as a whole."""
    return Mechanism(
        {"A": 0j, "D": 0.4 + 0j, "G": 0.9 + 0.1j},
        {
            "crank": Link({"A": 0j, "B": 0.1 + 0j}, mass=1, center=0.05 + 0j, inertia=0.1),
            "coupler": Link({"B": 0j, "C": 0.35 + 0j}, mass=2, center=0.175 + 0j, inertia=0.02),
            "rocker": Link(
                {"D": 0j, "C": 0.25 + 0j, "E": 0.2 + 0.1j}, mass=1.5, center=0.125 + 0j, inertia=0.01
            ),
            "rod": Link({"E": 0j, "F": 0.4 + 0j}, mass=0.4, center=0.2 + 0j, inertia=0.01),
            "arm": Link({"G": 0j, "F": 0.3 + 0j}, mass=0.4, center=0.15 + 0j, inertia=0.01),
        },
        inputs=Input(link="crank", value=math.radians(60)),
        guess=Guess(math.radians(60), {"coupler": 0.47, "rocker": 1.73}, points={"F": 0.65 + 0.3j}),
        gravity=-1j * G,
        **more,  # type: ignore[arg-type]
    )


def apart(m: Mechanism, end: float, speed: float, accuracy: float, tolerance: float) -> float:
    """The largest difference of any link's angle from that of the bodies, and that no effort is left."""
    t = np.linspace(0, end, 5)
    run = m.simulate(t, speed=speed, accuracy=accuracy)
    assert not run.warnings
    assert np.abs(run.energy_drift).max() < 10 * accuracy
    assert np.abs(run.motion.effort).max() < 1e-9
    exact = Bodies(m).angles([e.value or 0.0 for e in m.inputs], speed, t, tolerance)
    # whole turns count in the input
    crank = exact[str(m.inputs[0].link)]
    found = [np.abs(run.angle[:, 0] - run.angle[0, 0] - (crank - crank[0])).max()]
    for name, angle in exact.items():
        found.append(np.abs(np.exp(1j * angle) - np.exp(1j * run.motion.link(name).angle)).max())
    return float(max(found))


def test_a_frame_through_dead_points_of_its_crank() -> None:
    """The crank cannot go round: it turns back twice, where another angle is the coordinate."""
    assert apart(frame(), 0.8, 6.0, 1e-9, 1e-12) < 2e-9


@pytest.mark.slow
def test_a_frame_with_friction_in_every_pin() -> None:
    m = frame(friction=[Friction(name, 0.3, 0.02) for name in "ABCDEFG"])
    assert apart(m, 0.6, 6.0, 1e-8, 1e-10) < 5e-8


@pytest.mark.slow
def test_a_chain_that_turns_back_as_a_whole_with_friction() -> None:
    """All joints of the second loop come to rest at one pose: each of them rubs the other way from there on."""
    m = watt(friction=[Friction(name, 0.3, 0.02) for name in "ABCDEFG"])
    assert apart(m, 0.25, 15.0, 1e-7, 1e-9) < 2e-7


@pytest.mark.slow
def test_a_frame_comes_to_rest_by_friction_and_stays() -> None:
    m = frame(friction=[Friction(name, 0.5, 0.1) for name in "ABCDEFG"])
    run = m.simulate([0, 0.5, 1, 20], speed=2.0, accuracy=1e-6)
    assert not run.warnings
    assert run.speed[-1, 0] == 0
    assert run.acceleration[-1, 0] == 0
    assert np.ptp(run.angle[1:, 0]) == 0
    assert np.abs(run.energy_drift).max() < 1e-6


@pytest.mark.slow
def test_a_torsion_spring_between_links_that_no_input_turns_alone() -> None:
    m = watt(torsion_springs=[TorsionSpring(("coupler", "rocker"), 30.0, 0.5, 0.0)])
    run = m.simulate(np.linspace(0, 1, 21), speed=15.0)
    assert not run.warnings
    assert np.abs(run.energy_drift).max() < 1e-8
    assert np.abs(run.motion.effort).max() < 1e-10
    free = watt().simulate([0, 1], speed=15.0)
    assert abs(run.angle[-1, 0] - free.angle[-1, 0]) > 0.01


@pytest.mark.slow
def test_a_gear_of_fractional_ratio_on_a_loop_with_friction() -> None:
    """A wheel that the rocker turns 1.3 times over: its energy is followed, and its friction's work."""
    m = watt()
    wheel = Link({"D": 0j}, mass=1.0, center=0j, inertia=0.02)
    m = Mechanism(
        m.ground,
        {**m.links, "wheel": wheel},
        gears=[Gear(("rocker", "wheel"), 1.3)],
        inputs=m.inputs,
        guess=Guess(
            math.radians(60), {"coupler": 0.47, "rocker": 1.73, "wheel": 0.0}, points={"F": 0.65 + 0.3j}
        ),
        gravity=-1j * G,
        friction=[Friction("A", 0.3, 0.02)],
    )
    run = m.simulate(np.linspace(0, 0.5, 11), speed=15.0)
    assert not run.warnings
    assert np.abs(run.energy_drift).max() < 1e-8
    assert np.abs(run.motion.effort).max() < 1e-9
