"""Variants released together against the same released singly."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.virtualwork.test_in_time import four_bar
from virtualwork import Friction, Input, Link, Mechanism, Torque
from virtualwork.intime.variants import Runs, Variants

G = 9.81


def pendulum(**more: object) -> Mechanism:
    return Mechanism(
        {"O": 0j},
        {"bob": Link({"O": 0j, "P": 1 + 0j}, mass=1, center=1 + 0j)},
        inputs=Input(link="bob", value=0.0),
        gravity=-1j * G,
        **more,  # type: ignore[arg-type]
    )


def same_as_singly(family: Variants, runs: Runs, apart: float, **start: object) -> None:
    """Every variant moves as it does alone, and says the same of its error."""
    for i in range(len(family)):
        one = type(family.mechanism).simulate(family[i], runs.t, **start)  # type: ignore[attr-defined]
        for of in ("angle", "speed", "acceleration"):
            alone = getattr(one, of)
            assert np.abs(getattr(runs, of)[i] - alone).max() <= apart * (1 + np.abs(alone).max())
        assert np.abs(runs.energy[i] - one.energy).max() < 100 * apart
        # singly what rounds in the accelerations is measured too
        lanes, alone = runs.error_estimate[i], one.error_estimate
        assert (lanes <= 1.001 * alone).all()
        assert (lanes >= np.where(alone > 1e-11, 0.999, 0.6) * alone).all()
        assert runs.warnings.get(i, ()) == one.warnings


@pytest.mark.parametrize("engine", ["numpy", "llvm"])
def test_lanes_move_as_single_mechanisms(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    family = four_bar().vary(
        {"links.crank.B.x": np.linspace(0.09, 0.11, 5), "links.coupler.mass": [1, 2, 3, 4, 5]}
    )
    with monkeypatch.context() as m:
        # the single ones on floats
        m.setenv("DALEMBERT_ENGINE", engine)
        runs = family.simulate(np.linspace(0, 1, 7))
    same_as_singly(family, runs, 1e-12)
    assert np.abs(runs.energy_drift).max() < 1e-9
    assert np.abs(runs.motion.effort).max() < 1e-9
    rocker = four_bar().vary({"links.crank.B.x": [family.values[2, 0]], "links.coupler.mass": [3.0]})
    assert rocker.simulate(runs.t).motion.link("rocker").omega == pytest.approx(
        runs.motion.link("rocker").omega[2:3], abs=1e-10
    )


def test_lanes_of_two_inputs_that_start_differently() -> None:
    m = Mechanism(
        {"O": 0j},
        {
            "upper": Link({"O": 0j, "P": 1 + 0j}, mass=1, center=1 + 0j),
            "lower": Link({"P": 0j, "Q": 1 + 0j}, mass=1, center=1 + 0j),
        },
        inputs=[Input(link="upper", value=0.0), Input(link="lower", value=-0.5)],
        gravity=-1j * G,
    )
    start = np.array([[0.0, -0.5], [0.1, 0.3], [-1.0, -0.2]])
    runs = m.vary({"links.lower.mass": [1.0, 1.0, 2.0]}).simulate([0, 0.5, 1.0], angle=start)
    for i, mass in enumerate((1.0, 1.0, 2.0)):
        lower = replace(m.links["lower"], mass=mass)
        one = replace(m, links={**m.links, "lower": lower}).simulate(runs.t, angle=start[i])
        assert runs.angle[i] == pytest.approx(one.angle, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["numpy", "llvm"])
def test_dead_points_and_friction_are_left_to_single_runs(
    engine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By one engine: a tape that is compiled in between, for its many uses in other tests too, rounds otherwise."""
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    family = four_bar("rocker").vary({"links.coupler.mass": [1.0, 2.0]})
    same_as_singly(family, family.simulate([0, 0.5, 1.0], speed=3.0), 1e-15, speed=3.0)
    rubbing = pendulum(friction=[Friction("O", 0.3, 0.1)]).vary({"links.bob.mass": [1.0, 2.0]})
    same_as_singly(rubbing, rubbing.simulate([0, 1.0, 8.0]), 1e-15)


def test_a_variant_that_cannot_move_says_so_and_the_others_do() -> None:
    family = pendulum().vary({"links.bob.mass": [1.0, 0.0, 2.0]})
    runs = family.simulate([0, 1.0])
    assert "no mass moves with input 'bob'" in runs.warnings[1][0]
    assert np.isnan(runs.angle[1]).all()
    assert runs.angle[0] == pytest.approx(runs.angle[2], abs=1e-12)
    assert list(runs.warnings) == [1]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"times": [1, 0]}, "times: expected rising"),
        ({"times": [0, 1], "accuracy": 1.0}, "accuracy: found 1"),
        ({"times": [0, 1], "angle": [1.0, 2.0, 3.0]}, "angle: expected a number"),
        ({"times": [0, 1], "speed": math.nan}, "speed: expected a number"),
    ],
)
def test_wrong_questions(wrong: dict[str, object], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        pendulum().vary({"links.bob.mass": [1.0, 2.0]}).simulate(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("engine", ["numpy", "llvm"])
def test_every_lane_ends_at_its_own_event(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pendulums of several lengths from the side down to the lowest place: K(sin² π/4)·√(l/g), and then the turn back."""
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    lengths = np.array([0.25, 0.5, 1.0, 2.0, 4.0, 400.0])
    family = pendulum().vary({"links.bob.P.x": lengths, "links.bob.center.x": lengths})
    t = np.linspace(0, 2, 9)
    with monkeypatch.context() as m:
        m.setenv("DALEMBERT_ENGINE", engine)
        runs = family.simulate(t, angle=0.0, until={"bob": -math.pi / 2})
    quarter = 1.854074677301371918433850347195 * np.sqrt(lengths / G)
    for i, end in enumerate(quarter[:-1]):
        n = int(np.isfinite(runs.times[i]).sum())
        assert runs.times[i, : n - 1].tolist() == t[t < end].tolist()
        assert runs.times[i, n - 1] == pytest.approx(end, abs=2e-10)
        # half a rounding of the time, one of the angle and one of the step to it
        nearest = 0.5 * np.spacing(end) * math.sqrt(2 * G / lengths[i]) + 2 * np.spacing(math.pi / 2)
        assert runs.angle[i, n - 1, 0] == pytest.approx(-math.pi / 2, abs=nearest)
        assert np.isnan(runs.angle[i, n:]).all()
        one = type(family.mechanism).simulate(family[i], t, angle=0.0, until={"bob": -math.pi / 2})  # type: ignore[attr-defined]
        assert one.t == pytest.approx(runs.times[i, :n], rel=1e-14)
        assert one.angle == pytest.approx(runs.angle[i, :n], abs=1e-14)
        assert one.energy_drift == pytest.approx(runs.energy_drift[i, :n], abs=1e-11)
        assert (runs.error_estimate[i, :n] >= 0.5 * one.error_estimate).all()
    assert runs.times[-1].tolist() == t.tolist()
    assert runs.warnings == {5: ("bob: the event is not met before 2 s",)}


def test_lanes_and_single_runs_end_alike_where_one_of_two_inputs_does() -> None:
    """A double pendulum: the lower bar passes the level upwards, in some variants only after a turn of the upper one."""
    m = Mechanism(
        {"O": 0j},
        {
            "upper": Link({"O": 0j, "P": 1 + 0j}, mass=1, center=1 + 0j),
            "lower": Link({"P": 0j, "Q": 1 + 0j}, mass=1, center=1 + 0j),
        },
        inputs=[Input(link="upper", value=0.0), Input(link="lower", value=-0.5)],
        gravity=-1j * G,
    )
    family = m.vary({"links.lower.mass": [0.5, 1.0, 3.0], "links.upper.mass": [1.0, 0.2, 2.0]})
    runs = family.simulate([0, 1.0, 2.0, 5.0], until={"lower": -2.5, "upper": -1.75})
    for i in range(3):
        one = type(family.mechanism).simulate(  # type: ignore[attr-defined]
            family[i], [0, 1.0, 2.0, 5.0], until={"lower": -2.5, "upper": -1.75}
        )
        assert one.ended == "until"
        n = len(one.t)
        assert runs.times[i, :n] == pytest.approx(one.t, abs=1e-12)
        assert np.isnan(runs.times[i, n:]).all()
        assert runs.angle[i, :n] == pytest.approx(one.angle, abs=1e-12)


def test_an_event_ends_lanes_that_are_released_singly_too() -> None:
    """A rocker that passes its dead point: no lane can, and each is released alone."""
    family = four_bar("rocker").vary({"links.coupler.mass": [1.0, 2.0]})
    runs = family.simulate([0, 0.5, 1.0], speed=3.0, until={"rocker": 1.7})
    assert np.isfinite(runs.times).sum(axis=1).tolist() == [2, 2]
    assert runs.angle[:, 1, 0] == pytest.approx([1.7, 1.7], abs=1e-14)
    with pytest.raises(ValueError, match="no input is named 'bab'"):
        family.simulate([0, 1.0], until={"bab": 1.0})


def test_variants_at_their_first_time_alone() -> None:
    runs = pendulum().vary({"links.bob.mass": [1.0, 2.0]}).simulate([0.5], angle=0.25, speed=2.0)
    assert runs.angle[:, 0, 0].tolist() == [0.25, 0.25]
    assert runs.acceleration[:, 0, 0] == pytest.approx([-G * math.cos(0.25)] * 2, rel=1e-14)


def test_forces_of_variants_under_a_torque_over_time() -> None:
    """The force that turns a point mass at 1 m with α = t/(I + m) is m α across the bar, and m ω² along it."""
    m = Mechanism(
        {"O": 0j},
        {"rotor": Link({"O": 0j}, mass=1, center=1 + 0j, inertia=2)},
        inputs=Input(link="rotor", value=0.0),
        torques=[Torque("rotor", history=((0.0, 0.0), (10.0, 10.0)), over="time")],
    )
    mass, t = np.array([1.0, 2.0]), np.array([0.0, 1.0, 2.0])
    runs = m.vary({"links.rotor.mass": mass}).simulate(t)
    alpha = t / (2 + mass[:, None])
    force = runs.motion.reaction("O", on="rotor") @ [1, 1j] / np.exp(1j * runs.angle[..., 0])
    assert force == pytest.approx(mass[:, None] * (1j * alpha - (alpha * t / 2) ** 2), abs=1e-12)
    assert runs.motion.effort == pytest.approx(np.zeros((2, 3)), abs=1e-12)
