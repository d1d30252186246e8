"""A torsion spring whose twist grows past half a turn, with several inputs: its torque goes on with it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.virtualwork.released import four_bar
from tests.virtualwork.test_winding_with_several_inputs import swinging
from virtualwork import Gear, Guess, Input, Link, Mechanism, TorsionSpring

STIFFNESS = 0.9


def sprung(**more: object) -> Mechanism:
    """The coupler swings past half a turn; a spring holds it to the ground."""
    m = swinging()
    links = {**m.links, "coupler": Link({"B": (0, 0), "C": (1.2, 0)}, mass=1.0, center=0.6, inertia=0.2)}
    return Mechanism(
        m.ground,
        {name: links[name] for name in ("first", "second", "coupler", "other")},
        inputs=m.inputs,
        guess=Guess(at=(0.0, 0.0), angles={"coupler": 2.9, "other": -2.9}),
        torsion_springs=[TorsionSpring(("ground", "coupler"), STIFFNESS, 0.0)],
        **more,  # type: ignore[arg-type]
    )


def efforts(m: Mechanism, path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The efforts at rest, and k·φ·∂φ/∂q with the coupler's angle followed along the path from the guess."""
    motion = m.motion(path)
    turned = np.unwrap(motion.link("coupler").angle)
    slopes = np.stack([motion.link("coupler").coefficient(j) for j in range(2)], axis=1)
    return motion.effort, STIFFNESS * turned[:, None] * slopes


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_effort_goes_on_past_half_a_turn(way: float) -> None:
    t = way * np.linspace(0, 4 * np.pi, 401)
    m = sprung()
    path = np.stack([t, -t], axis=1)
    found, true = efforts(m, path)
    turned = m.motion(path).link("coupler").angle
    assert turned.min() < -3
    assert turned.max() > 3
    np.testing.assert_allclose(found, true, rtol=0, atol=1e-12 * np.abs(true).max())
    # a pose asked alone has the turns of the sweep, by every engine
    alone = np.array([m.motion(path[i : i + 1]).effort[0] for i in range(0, 401, 80)])
    np.testing.assert_allclose(alone, true[::80], rtol=0, atol=1e-12 * np.abs(true).max())


@pytest.mark.parametrize("engine", ["python", "numpy"])
def test_engines_and_bounds(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    t = np.linspace(0, 4 * np.pi, 101)
    m = sprung()
    found, true = efforts(m, np.stack([t, -t], axis=1))
    error = m.motion(np.stack([t, -t], axis=1)).dynamics.error_estimate().effort
    assert (np.abs(found - true) <= error + 1e-13).all()


def test_variants() -> None:
    t = np.linspace(0, 4 * np.pi, 50)
    m = sprung()
    family = m.vary(
        {"torsion_springs.1.stiffness": [STIFFNESS, 2 * STIFFNESS], "links.coupler.mass": [1.0, 3.0]}
    )
    _, true = efforts(m, np.stack([t, -t], axis=1))
    found = family.motion(np.stack([t, -t], axis=1)).effort
    np.testing.assert_allclose(found[0], true, rtol=0, atol=1e-12 * np.abs(true).max())
    np.testing.assert_allclose(found[1], 2 * true, rtol=0, atol=1e-12 * np.abs(true).max())


def test_energy_is_kept_in_time() -> None:
    """Released at speed, the coupler passes half a turn from free: the spring's potential goes on with its torque."""
    gearless = sprung()
    heavy = Mechanism(
        gearless.ground,
        {
            **gearless.links,
            "first": Link({"A": (0, 0), "B": (0.3, 0)}, inertia=2.0),
            "second": Link({"D": (0, 0), "E": (0.15, 0)}, inertia=2.0),
        },
        inputs=gearless.inputs,
        guess=gearless.guess,
        torsion_springs=gearless.torsion_springs,
    )
    run = heavy.simulate(np.linspace(0, 0.9, 19), angle=[0.0, 0.0], speed=[6.0, -6.0])
    twist = np.unwrap(run.motion.link("coupler").angle)
    assert twist.min() < -np.pi < twist.max()
    assert run.ended == "end"
    assert np.abs(run.energy_drift).max() < 1e-8 * run.energy[0]


def test_springs_that_inputs_alone_turn_stay_as_they_are() -> None:
    m = Mechanism(
        {"A": 0j, "D": 1 + 0j},
        {"a": Link({"A": 0j}), "b": Link({"D": 0j})},
        inputs=[Input(link="a"), Input(link="b")],
        torsion_springs=[TorsionSpring(("a", "b"), 2.0, 0.5)],
    )
    q = np.array([[0.0, 0.0], [1.0, 9.0], [-20.0, 3.0]])
    np.testing.assert_allclose(m.motion(q).effort[:, 1], 2 * (q[:, 1] - q[:, 0] - 0.5), rtol=1e-15)


@pytest.mark.slow
def test_a_spring_beside_a_gear_of_half_turns() -> None:
    """The wheel's own angle is counted; the spring on it agrees with that."""
    m = swinging()
    m = Mechanism(
        m.ground,
        m.links,
        gears=[Gear(("coupler", "wheel"), 0.5)],
        inputs=m.inputs,
        guess=m.guess,
        torsion_springs=[TorsionSpring(("ground", "wheel"), STIFFNESS, 1.0)],
    )
    t = np.linspace(0, 2 * np.pi, 9)
    motion = m.motion(np.stack([t, -t], axis=1))
    turned = np.unwrap(motion.link("wheel").angle)
    turned += 2 * np.pi * np.round((1.0 - turned[0]) / (2 * np.pi))
    true = (
        STIFFNESS
        * (turned - 1.0)[:, None]
        * np.stack([motion.link("wheel").coefficient(j) for j in range(2)], axis=1)
    )
    np.testing.assert_allclose(motion.effort, true, rtol=0, atol=1e-12 * np.abs(true).max())


@pytest.mark.parametrize("speed", [-8.0, 8.0])
def test_whole_turns_are_kept_where_another_link_becomes_the_coordinate(speed: float) -> None:
    """The rocker drives; the crank winds its spring past half a turn on the way to the rocker's dead point."""
    free = math.radians(60) - math.copysign(3.0, speed)
    m = four_bar("rocker", torsion_springs=[TorsionSpring(("ground", "crank"), 0.5, free)])
    run = m.simulate(np.linspace(0, 0.6, 25), speed=speed)
    crank = np.unwrap(run.motion.link("crank").angle)
    assert np.ptp(crank) > np.pi
    assert run.ended == "end"
    assert len(run.fine.legs) > 1
    assert np.abs(run.energy_drift).max() < 1e-7 * np.abs(run.energy).max()
