"""Motions of constant acceleration, against closed forms, on every engine: nothing of their tapes hangs on the state."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dalembert.arithmetic import engines
from dalembert.arithmetic.engines import floats
from dalembert.arithmetic.loop import Calls
from dalembert.arithmetic.recorded import Recorder
from tests.virtualwork.released import G, block, rotor
from virtualwork import Force, Gear, Guess, Guide, Input, Link, Mechanism, Torque

# each engine counts, and each sense
pytestmark = pytest.mark.whole
TIMES = np.array([0.0, 0.1, 0.7, 2.0, 3.0])
ENGINES = ["python", "numpy", "llvm", ""]


@pytest.fixture(params=ENGINES)
def engine(request, monkeypatch):
    monkeypatch.delenv("DALEMBERT_ENGINE", raising=False)
    if request.param:
        monkeypatch.setenv("DALEMBERT_ENGINE", request.param)
    return request.param


def accelerates(m: Mechanism, start: list[float], speed: list[float], a: list[float], **more: object) -> None:
    """The motion is s₀ + v₀·t + a·t²/2, to the estimate of its error."""
    run = m.simulate(TIMES, angle=start, speed=speed, **more)
    t = TIMES[:, None]
    true = np.array(start) + np.array(speed) * t + 0.5 * np.array(a) * t**2
    assert not run.warnings
    assert run.error_estimate.max() <= 1e-9
    assert np.all(np.abs(run.angle - true) <= run.error_estimate + 1e-15 * np.abs(true))
    np.testing.assert_allclose(run.speed, np.array(speed) + np.array(a) * t, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(run.acceleration, np.tile(a, (len(TIMES), 1)), rtol=1e-13, atol=0)
    assert np.abs(run.energy_drift).max() <= 1e-12 * max(1e-3, np.abs(run.energy).max())


@pytest.mark.parametrize("speed", [5.0, -5.0, 0.0, 1e4, 1e-9])
def test_a_free_flywheel_keeps_its_speed(engine, speed):
    accelerates(rotor(), [0.3], [speed], [0.0])


@pytest.mark.parametrize("torque", [4.0, -1e-6])
def test_a_flywheel_under_a_torque(engine, torque):
    accelerates(rotor(torques=[Torque("rotor", torque)]), [0.3], [1.0], [torque / 2.0])


def incline(angle: float, **more: object) -> Mechanism:
    return Mechanism(
        {"O": 0j},
        {"block": Link({"P": 0j}, mass=2)},
        guides=[Guide("P", "block", angle=angle, turned=0.0)],
        inputs=Input(slider="P", value=0.0),
        gravity=-1j * G,
        **more,  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("degrees", [30.0, -30.0, 90.0, 1e-6])
def test_a_frictionless_incline(engine, degrees):
    angle = math.radians(degrees)
    accelerates(incline(angle), [0.2], [3.0], [-G * math.sin(angle)])


def test_a_block_on_level_ground(engine):
    accelerates(block(), [0.1], [3.0], [0.0])
    accelerates(block(forces=[Force("block", 0j, -2 + 0j)]), [0.1], [3.0], [-2.0])


def wheels(ratio: float) -> Mechanism:
    return Mechanism(
        {"A": 0j, "D": 0.4 + 0j},
        {"a": Link({"A": 0j}, inertia=2.0), "b": Link({"D": 0j}, inertia=0.5)},
        gears=[Gear(("a", "b"), ratio)],
        inputs=Input(link="a"),
        torques=[Torque("b", 3.0)],
    )


@pytest.mark.parametrize("ratio", [-2.0, 3.0, -0.01, 100.0])
def test_geared_wheels(engine, ratio):
    accelerates(wheels(ratio), [0.0], [1.0], [3.0 * ratio / (2.0 + 0.5 * ratio**2)])


def test_a_four_bar_whose_crank_alone_has_inertia(engine):
    bare = Mechanism(
        {"A": 0j, "D": 0.4 + 0j},
        {
            "crank": Link({"A": 0j, "B": 0.1 + 0j}, inertia=0.1),
            "coupler": Link({"B": 0j, "C": 0.35 + 0j}),
            "rocker": Link({"D": 0j, "C": 0.25 + 0j}),
        },
        inputs=Input(link="crank"),
        guess=Guess(math.radians(60), {"coupler": 0.47, "rocker": 1.73}),
        torques=[Torque("crank", -0.5)],
    )
    accelerates(bare, [0.2], [7.0], [-5.0])


def test_two_flywheels_that_nothing_joins(engine):
    pair = Mechanism(
        {"A": 0j, "D": 0.4 + 0j},
        {"a": Link({"A": 0j}, inertia=2.0), "b": Link({"D": 0j}, inertia=0.5)},
        inputs=[Input(link="a"), Input(link="b")],
        torques=[Torque("b", 3.0)],
    )
    accelerates(pair, [0.1, -0.2], [5.0, 0.0], [0.0, 6.0])


def test_one_of_two_inputs_keeps_its_speed_while_the_other_swings(engine):
    both = Mechanism(
        {"A": 0j, "D": 0.4 + 0j},
        {"wheel": Link({"A": 0j}, inertia=2.0), "bob": Link({"D": 0j}, mass=1, center=1 + 0j)},
        inputs=[Input(link="wheel"), Input(link="bob")],
        gravity=-1j * G,
    )
    run = both.simulate(TIMES, angle=[0.1, 0.0], speed=[5.0, 0.0])
    np.testing.assert_allclose(run.angle[:, 0], 0.1 + 5 * TIMES, rtol=1e-13)


@pytest.mark.parametrize("count", [1, 3, 40])
def test_variants_of_a_flywheel(engine, count):
    inertia, start = np.linspace(1.0, 3.0, count), np.linspace(-4, 4, count)
    family = rotor(torques=[Torque("rotor", 4.0)]).vary({"links.rotor.inertia": inertia})
    run = family.simulate(TIMES, angle=0.3, speed=start[:, None])
    true = 0.3 + start[:, None] * TIMES + 2.0 / inertia[:, None] * TIMES**2
    np.testing.assert_allclose(run.angle[..., 0], true, rtol=1e-13, atol=1e-13)


def first_crossing(change: float, speed: float, a: float) -> float:
    """When speed·t + a·t²/2 first is a change, t > 0; infinite where it never is."""
    if not a:
        return change / speed if change * speed > 0 else math.inf
    radicand = speed**2 + 2 * a * change
    if radicand < 0:
        return math.inf
    w = -(speed + math.copysign(math.sqrt(radicand), speed))
    return min((t for t in (w / a, -2 * change / w) if t > 0), default=math.inf)


def ends_at(m: Mechanism, start: float, speed: float, a: float, level: float, times=TIMES) -> None:
    """The motion ends where its angle first has a level, to rounding; at its last time where it never does."""
    run = m.simulate(times, angle=start, speed=speed, until={"rotor": level})
    true, span = first_crossing(level - start, speed, a), float(times[-1] - times[0])
    close = 8 * np.finfo(float).eps * (abs(times[-1]) + span)
    if true < math.inf:
        steep = abs(speed + a * true)
        close += 8 * np.finfo(float).eps * (abs(start) + abs(level) + abs(speed) * true) / steep
    # between the two rounding says
    assert true > span or run.ended == "until"
    assert true <= span + close or run.ended == "end"
    assert run.t[-1] - times[0] == pytest.approx(min(true, span), abs=close)
    assert bool(run.warnings) == (run.ended == "end")
    if run.ended == "until":
        # what is left is the rounding of the time
        assert abs(run.angle[-1, 0] - level) <= run.error_estimate[-1, 0] + close * abs(run.speed[-1, 0])


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("level", [1.0, 0.2, 1e-9, 5.9999, 6.0, 6.0001, 0.0, -1.0])
def test_a_free_flywheel_ends_at_its_level(engine, level, sense):
    """In a step, at a time that is asked for, at the last one to rounding, beyond it, at the start, behind it."""
    ends_at(rotor(), 0.0, 2.0 * sense, 0.0, level * sense)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("level", [0.9, -3.0, -30.0, 0.0, 1.2501])
def test_a_flywheel_that_turns_back_ends_at_its_first_crossing(engine, level, sense):
    """Out and back, at the last time, at the start, never."""
    m = rotor(torques=[Torque("rotor", -20.0 * sense)])
    ends_at(m, 0.0, 5.0 * sense, -10.0 * sense, level * sense)


def test_a_flywheel_that_turns_back_at_its_level(engine):
    """There a level is met as nearly as the motion is wanted: 1e-9 rad, which takes 1.4e-5 s."""
    m = rotor(torques=[Torque("rotor", -20.0)])
    run = m.simulate(TIMES, angle=0.0, speed=5.0, until={"rotor": 1.25})
    assert run.ended == "until"
    assert run.t[-1] == pytest.approx(0.5, abs=2e-5)


@pytest.mark.parametrize("count", [1, 40])
def test_variants_of_a_flywheel_end_at_their_levels(engine, count):
    """The first variant comes to the level at the last time."""
    speeds = np.linspace(2.0, 7.0, count)
    runs = rotor().vary({"links.rotor.inertia": np.full(count, 2.0)})
    found = runs.simulate(TIMES, angle=0.0, speed=speeds[:, None], until={"rotor": 6.0})
    np.testing.assert_allclose(np.nanmax(found.times, axis=1), 6.0 / speeds, rtol=1e-14)
    assert not found.warnings


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(60))
def test_levels_at_random(engine, seed):
    """Any speed, torque, level and times: at rest, slow and fast, near and far, the last time among the crossings."""
    rng = np.random.default_rng(seed)
    a = rng.choice([0.0, rng.normal(), 1e-3 * rng.normal(), 100 * rng.normal()])
    speed = rng.choice([0.0, 2.0, -2.0, rng.normal(), 100 * rng.normal(), 1e-6 * rng.normal()])
    start = rng.choice([0.0, 0.3, rng.normal(), 1e3 * rng.normal()])
    times = np.unique(rng.choice([0.0, 0.1, 0.7, 2.0, 3.0], rng.integers(2, 6))) + rng.choice([0, -1.0, 1e3])
    span = times[-1] - times[0]
    t = rng.choice([rng.uniform(0, span), span, span * (1 - 1e-13), span * rng.uniform(1, 1.3), 1e-9 * span])
    way = speed * t + 0.5 * a * t**2
    level = start + rng.choice([way, round(way, 2), 0.0])
    # on its level to rounding from the start, or so near its turn that it may only touch it
    if 0 < abs(level - start) < 1e-15 * max(1, abs(level)) or not span:
        return
    if a and abs(start - 0.5 * speed**2 / a - level) < 1e-9 * max(1.0, abs(level)):
        return
    ends_at(rotor(2.0, torques=[Torque("rotor", 2.0 * a)]) if a else rotor(), start, speed, a, level, times)


@pytest.mark.parametrize("begin", [1e3, -1e6, 1e8])
def test_when_it_starts_makes_no_difference(engine, begin):
    """A step is as long as the times at its ends say: 1e8 s are rounded to 1e-8 s."""
    times = begin + np.array([0.0, 0.5, 3.0])
    run = rotor().simulate(times, angle=0.0, speed=100.0)
    np.testing.assert_allclose(run.angle[:, 0], 100 * (times - begin), rtol=1e-14)
    assert run.error_estimate.max() <= 1e-11
    nodes = run.coarse.legs[0].nodes
    np.testing.assert_allclose(nodes.q[:, 0], 100 * (nodes.t - begin), rtol=1e-14)


def test_calls_that_are_given_nothing():
    """A body whose calls are given nothing still calls; what nothing uses of them is left out."""
    again = Recorder()
    calls, x = Calls(again, [], ["y"]), again.input("x")
    _, (y,) = calls({}), calls({})
    tape = again.tape({"x": x + 2.0 * y})
    assert floats.compiled(tape, (), ("y",))(lambda: (5.0,), 1.0) == (11.0,)


@pytest.mark.parametrize("lanes", [(1, 3), (3, 1), (2, 50)])
def test_a_tape_without_inputs_over_a_grid(engine, lanes):
    recorder = Recorder()
    fixed = recorder.tape({"y": 2.0})
    np.testing.assert_array_equal(engines.run_grid(fixed, {}, lanes), np.full((1, *lanes), 2.0))
    assert float(engines.run(fixed, {})["y"]) == 2.0
