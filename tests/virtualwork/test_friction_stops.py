"""What dry friction stops stands: blocks, inclines, flywheels and several rubbing joints against closed forms.

Friction takes energy and never gives any: every run is asked for it by the product itself (`intime.sticking.gains`), and here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.virtualwork.released import G, block, double_pendulum, four_bar
from virtualwork import Force, Friction, Guide, Input, Link, Mechanism, Spring, Torque
from virtualwork.intime.friction import Rubbing
from virtualwork.intime.run import Run
from virtualwork.intime.sticking import gains

Exact = Callable[[float], Sequence[float]]


def braked(v: float, drive: float, friction: float, t: float) -> float:
    """How far a body has come that a constant force drives and friction brakes, both over its mass."""
    way = 0.0
    if v:
        a = drive - math.copysign(friction, v)
        stop = -v / a if a * v < 0 else math.inf
        if t < stop:
            return v * t + a * t * t / 2
        way, t = -v * v / (2 * a), t - stop
    if abs(drive) <= friction:
        return way
    return way + (drive - math.copysign(friction, drive)) * t * t / 2


def agrees(run: Run, exact: Exact) -> None:
    """The run reaches its end, is what it should be, and knows how exact it is."""
    assert run.ended == "end", run.warnings
    assert all("beyond rounding" in of for of in run.warnings), run.warnings
    truth = np.array([exact(t) for t in run.t.tolist()])
    # what rounds in the truth itself
    slack = 1e-13 * max(1.0, np.abs(truth).max())
    assert (np.abs(run.angle - truth) <= run.error_estimate + slack).all()


def incline(mu: float, slope: float, mass: float = 2.0) -> Mechanism:
    return Mechanism(
        {"O": 0j},
        {"block": Link({"P": 0j}, mass=mass)},
        guides=[Guide("P", "block", angle=slope, turned=0.0)],
        inputs=Input(slider="P", value=0.0),
        gravity=-1j * G,
        friction=[Friction("P", mu)],
    )


def flywheel(mu: float, radius: float, inertia: float, torque: float, mass: float = 2.0) -> Mechanism:
    return Mechanism(
        {"O": 0j},
        {"wheel": Link({"O": 0j}, mass=mass, inertia=inertia)},
        inputs=Input(link="wheel", value=0.0),
        gravity=-1j * G,
        friction=[Friction("O", mu, radius)],
        torques=[Torque("wheel", torque)] if torque else [],
    )


def two_blocks(mu: Sequence[float], slopes: Sequence[float], mass: Sequence[float]) -> Mechanism:
    """Each on its own guide."""
    return Mechanism(
        {"O": 0j, "Q": 5 + 1j},
        {"a": Link({"P": 0j}, mass=mass[0]), "b": Link({"R": 0j}, mass=mass[1])},
        guides=[
            Guide("P", "a", angle=slopes[0], turned=0.0),
            Guide("R", "b", through="Q", angle=slopes[1], turned=0.0),
        ],
        inputs=[Input(slider="P", value=0.0), Input(slider="R", value=0.0)],
        gravity=-1j * G,
        friction=[Friction("P", mu[0]), Friction("R", mu[1])],
    )


def stacked(mu: Sequence[float], mass: Sequence[float], force: float) -> Mechanism:
    """A block on a block on the ground."""
    return Mechanism(
        {"O": 0j},
        {"a": Link({"P": 0j, "S": 0j}, mass=mass[0]), "b": Link({"R": 0j}, mass=mass[1])},
        guides=[Guide("P", "a", turned=0.0), Guide("R", "b", on="a", through="S", turned=0.0)],
        inputs=[Input(slider="P", value=0.0), Input(slider="R", value=0.0)],
        gravity=-1j * G,
        friction=[Friction("P", mu[0]), Friction("R", mu[1])],
        forces=[Force("a", 0j, complex(force))] if force else [],
    )


def on_each_other(
    mu: Sequence[float], mass: Sequence[float], force: float, v: Sequence[float], end: float
) -> list[float]:
    """Where two stacked blocks are, the upper one on the lower one: from one change of what slides to the next."""
    upper, both = mu[1] * mass[1] * G, mu[0] * (mass[0] + mass[1]) * G
    x, w, t = [0.0, 0.0], list(v), 0.0

    def rates(low: int | None, high: int | None) -> tuple[float, float] | None:
        """Accelerations where the joints slide one way, or stick (None); nothing where they could not."""
        if high is None and low is None:
            return (0.0, 0.0) if abs(force) <= both else None
        if high is None and low is not None:
            a = (force - low * both) / (mass[0] + mass[1])
            return (a, 0.0) if abs(a) <= mu[1] * G else None
        assert high is not None
        on = -high * upper
        if low is None:
            return (0.0, on / mass[1]) if abs(force - on) <= both else None
        a = (force - low * both - on) / mass[0]
        return a, on / mass[1] - a

    def sign(y: float) -> int:
        return int(y > 0) - int(y < 0)

    while True:
        options = []
        for low in [sign(w[0])] if w[0] else [None, 1, -1]:
            for high in [sign(w[1])] if w[1] else [None, 1, -1]:
                a = rates(low, high)
                begins = a is not None and all(
                    y or s is None or s * b > 0 for y, s, b in zip(w, (low, high), a, strict=True)
                )
                if begins:
                    options.append(a)
        (a, *_) = options
        assert a is not None
        stops = [-y / b if y * b < 0 else math.inf for y, b in zip(w, a, strict=True)]
        d = min(*stops, end - t)
        x = [y + (u + b * d / 2) * d for y, u, b in zip(x, w, a, strict=True)]
        w = [0.0 if s <= d else u + b * d for u, b, s in zip(w, a, stops, strict=True)]
        t += d
        if not min(stops) <= d or t >= end:
            return x


def swinging(k: float, mass: float, mu: float, x: float, v: float, end: float) -> float:
    """A block on a spring: sines about the dead band's ends, until it rests inside the band."""
    w, band = math.sqrt(k / mass), mu * mass * G / k
    while True:
        if not v and abs(x) <= band:
            return x
        middle = -math.copysign(band, v or -x)
        a, b = x - middle, v / w
        turn = (math.atan2(b, a) % math.pi or math.pi) / w if v else math.pi / w
        d = min(turn, end)
        x = middle + a * math.cos(w * d) + b * math.sin(w * d)
        if turn >= end:
            return x
        v, end = 0.0, end - turn


# --- the textbook's ---------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("mu", [0.2, 0.3])
@pytest.mark.parametrize("v", [1.0, 2.0, 3.0, -1.0, -3.0])
@pytest.mark.parametrize("accuracy", [1e-4, 1e-9, 1e-13])
def test_a_block_on_level_ground_stops_and_stands(v: float, mu: float, accuracy: float) -> None:
    """v²/(2 μ g) away, after v/(μ g)."""
    m = block(gravity=-1j * G, friction=[Friction("P", mu)])
    run = m.simulate(np.arange(0, 3.01, 0.5), angle=0.1, speed=v, accuracy=accuracy)
    agrees(run, lambda t: [0.1 + braked(v, 0.0, mu * G, t)])
    assert run.speed[-1, 0] == 0
    assert run.energy[-1] == pytest.approx(0, abs=1e-25)
    assert (np.diff(run.work) <= 0).all()


@pytest.mark.parametrize("mu", [0.3, 0.9])
@pytest.mark.parametrize("slope", [0.5, -0.5])
@pytest.mark.parametrize("v", [0.0, 2.0, -2.0])
def test_a_block_on_an_incline(mu: float, slope: float, v: float) -> None:
    """Up and down; where μ < tan it slides back."""
    run = incline(mu, slope).simulate([0, 0.2, 0.5, 1, 3], speed=v)
    agrees(run, lambda t: [braked(v, -G * math.sin(slope), mu * G * math.cos(slope), t)])


@pytest.mark.parametrize("torque", [0.0, 0.05, -0.05, 0.3, -0.3])
@pytest.mark.parametrize("v", [0.0, 5.0, -5.0])
def test_a_flywheel_with_friction_in_its_pin(torque: float, v: float) -> None:
    run = flywheel(0.4, 0.02, 0.1, torque).simulate([0, 1, 3, 5, 20], speed=v)
    agrees(run, lambda t: [braked(v, torque / 0.1, 0.4 * 0.02 * 2.0 * G / 0.1, t)])


@pytest.mark.parametrize("v", [(3.0, -1.0), (-3.0, 3.0), (0.0, 2.0)])
def test_two_rubbing_joints_stop_one_after_the_other(v: tuple[float, float]) -> None:
    mu, slopes = (0.3, 0.6), (0.0, 0.4)
    run = two_blocks(mu, slopes, (2.0, 1.0)).simulate([0, 0.3, 0.6, 1, 2], speed=v)
    agrees(
        run,
        lambda t: [
            braked(v[i], -G * math.sin(slopes[i]), mu[i] * G * math.cos(slopes[i]), t) for i in range(2)
        ],
    )


@pytest.mark.parametrize(("force", "v"), [(0.0, (2.0, 0.0)), (0.0, (0.0, -2.0)), (60.0, (0.0, 0.0))])
def test_a_block_on_a_block(force: float, v: tuple[float, float]) -> None:
    mu, mass = (0.2, 0.5), (3.0, 1.0)
    run = stacked(mu, mass, force).simulate([0, 0.2, 0.5, 1, 2], speed=v)
    agrees(run, lambda t: on_each_other(mu, mass, force, v, t) if t else [0.0, 0.0])


def test_a_joint_that_holds_breaks_away_when_the_torque_has_grown() -> None:
    """Two wheels, the one under t N·m: it breaks away at μ r m g, and turns by (t − t₀)³/(6 J)."""
    m = Mechanism(
        {"O": 0j, "Q": 5 + 0j},
        {"a": Link({"O": 0j}, mass=2.0, inertia=3.0), "b": Link({"Q": 0j}, mass=1.0, inertia=0.5)},
        inputs=[Input(link="a", value=0.0), Input(link="b", value=0.0)],
        gravity=-1j * G,
        friction=[Friction("O", 0.5, 0.1), Friction("Q", 0.2, 0.1)],
        torques=[Torque("a", history=((0.0, 0.0), (10.0, 10.0)), over="time")],
    )
    run = m.simulate([0, 0.5, 1, 2, 4, 6], speed=[0.0, 3.0])
    begins, brake = 0.5 * 0.1 * 2.0 * G, 0.2 * 0.1 * G / 0.5
    agrees(run, lambda t: [max(0.0, t - begins) ** 3 / 18, braked(3.0, 0.0, brake, t)])


def test_friction_that_would_drive_ends_the_run() -> None:
    """Where a joint slides against its mode the path is cut before, whatever has led there."""
    run = block(gravity=-1j * G, friction=[Friction("P", 0.3)]).simulate([0, 0.5], speed=3.0)
    leg = run.fine.legs[0]
    equations = leg.equations
    assert isinstance(equations, Rubbing)
    assert gains(leg, 0.0) == (pytest.approx(3.0), None)
    wrong = replace(leg, coordinates=leg.coordinates.of(equations.in_mode((-1,), -1.0)))
    assert gains(wrong, 0.0) == (pytest.approx(3.0), (0, "P"))


# --- campaigns --------------------------------------------------------------------------------------------------------
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(150))
def test_one_joint_at_random(seed: int) -> None:
    """Inclines and flywheels with any driving force, both ways, to any accuracy."""
    rng = np.random.default_rng(seed)
    mu, slope = rng.uniform(0.05, 1.0), rng.integers(2) * rng.uniform(-1.2, 1.2)
    v, mass = float(rng.integers(-1, 2)) * 10 ** rng.uniform(-3, 2), 10 ** rng.uniform(-2, 2)
    accuracy = 10 ** rng.uniform(-13, -3)
    drive, friction = -G * math.sin(slope), mu * G * math.cos(slope)
    end = 10 ** rng.uniform(-1, 1) * max(abs(v) / friction, 0.1)
    run = incline(mu, slope, mass).simulate(np.linspace(0, end, 7), speed=v, accuracy=accuracy)
    agrees(run, lambda t: [braked(v, drive, friction, t)])
    inertia, radius = 10 ** rng.uniform(-3, 2), 10 ** rng.uniform(-3, -1)
    torque = float(rng.integers(-1, 2)) * mu * radius * mass * G * rng.uniform(0, 3)
    drive, friction = torque / inertia, mu * radius * mass * G / inertia
    end = 10 ** rng.uniform(-1, 1) * max(abs(v) / friction, 0.1)
    m = flywheel(mu, radius, inertia, torque, mass)
    run = m.simulate(np.linspace(0, end, 7), speed=v, accuracy=accuracy)
    agrees(run, lambda t: [braked(v, drive, friction, t)])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_several_joints_at_random(seed: int) -> None:
    """Two blocks, stacked blocks, and a block on a spring that turns back and back."""
    rng = np.random.default_rng(seed)
    accuracy = 10 ** rng.uniform(-12, -4)
    mu, mass = rng.uniform(0.05, 1.0, 2).tolist(), (10 ** rng.uniform(-1, 1, 2)).tolist()
    v = (rng.integers(-1, 2, 2) * 10 ** rng.uniform(-2, 1, 2)).tolist()
    slopes = (rng.integers(2, size=2) * rng.uniform(-1, 1, 2)).tolist()
    end = 10 ** rng.uniform(-1, 1) * max(*map(abs, v), 0.1 * G) / (min(mu) * G)
    times = np.linspace(0, end, 7)
    run = two_blocks(mu, slopes, mass).simulate(times, speed=v, accuracy=accuracy)
    agrees(
        run,
        lambda t: [
            braked(v[i], -G * math.sin(slopes[i]), mu[i] * G * math.cos(slopes[i]), t) for i in range(2)
        ],
    )
    force = float(rng.integers(-1, 2)) * mu[0] * G * sum(mass) * rng.uniform(0, 3)
    run = stacked(mu, mass, force).simulate(times, speed=v, accuracy=accuracy)
    agrees(run, lambda t: on_each_other(mu, mass, force, v, t) if t else [0.0, 0.0])
    k, x = 10 ** rng.uniform(0, 3), rng.uniform(-1, 1)
    m = Mechanism(
        {"O": 0j},
        {"block": Link({"P": 0j}, mass=mass[0])},
        guides=[Guide("P", "block", turned=0.0)],
        inputs=Input(slider="P", value=0.0),
        gravity=-1j * G,
        friction=[Friction("P", mu[0])],
        springs=[Spring((("block", 0j), ("ground", 0j)), k)],
    )
    end = rng.uniform(0.5, 20) * math.sqrt(mass[0] / k)
    run = m.simulate(np.linspace(0, end, 7), angle=x, speed=v[0], accuracy=accuracy)
    agrees(run, lambda t: [swinging(k, mass[0], mu[0], x, v[0], t)])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(30))
def test_a_pendulum_with_friction_in_its_pin_at_random(seed: int) -> None:
    """Against scipy's integrator from one rest to the next, with the pin's force by iteration."""
    rng = np.random.default_rng(seed)
    mu, radius, length = rng.uniform(0.1, 0.8), rng.uniform(0.01, 0.15), rng.uniform(0.3, 1.5)
    mass, inertia, end = rng.uniform(0.3, 3), rng.uniform(0, 0.3), rng.uniform(0.3, 6)
    q, v = rng.uniform(-4, 4), float(rng.integers(-1, 2)) * rng.uniform(0, 8)
    m = Mechanism(
        {"O": 0j},
        {"bob": Link({"O": 0j}, mass=mass, center=length + 0j, inertia=inertia)},
        inputs=Input(link="bob"),
        gravity=-1j * G,
        friction=[Friction("O", mu, radius)],
    )
    run = m.simulate([0, end], angle=q, speed=v)

    def rate(q: float, v: float, sense: float) -> float:
        whole, out = inertia + mass * length**2, np.exp(1j * q)
        a = 0.0
        for _ in range(200):
            force = mass * (length * (1j * a - v * v) * out + 1j * G)
            a = (-mass * G * length * math.cos(q) - sense * mu * radius * abs(force)) / whole
        return a

    t = 0.0
    while t < end:
        sense = math.copysign(1, v) if v else next((s for s in (1, -1) if rate(q, 0, s) * s > 0), 0)
        if not sense:
            break

        def turns(_: float, y: np.ndarray, sense: float = sense) -> float:
            return float(y[1]) * sense

        turns.terminal, turns.direction = True, -1  # type: ignore[attr-defined]
        found = solve_ivp(
            lambda _, y, s=sense: [y[1], rate(y[0], y[1], s)],
            (0, end - t),
            [q, v],
            "DOP853",
            events=turns,
            rtol=1e-12,
            atol=1e-13,
        )
        t += found.t[-1]
        q, v = float(found.y[0, -1]), 0.0 if found.status else float(found.y[1, -1])
    assert run.angle[-1, 0] == pytest.approx(q, abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_friction_takes_energy_from_linkages_at_random(seed: int) -> None:
    """A four-bar and a double pendulum with friction in some pins: never any work but negative."""
    rng = np.random.default_rng(seed)
    pins = [Friction(j, rng.uniform(0.05, 0.5), rng.uniform(0.003, 0.03)) for j in "ABCD"]
    m = four_bar(friction=pins[: rng.integers(1, 5)])
    runs = [m.simulate(np.linspace(0, 2, 41), speed=rng.uniform(-15, 15), accuracy=1e-7)]
    m = double_pendulum(friction=[Friction(j, rng.uniform(0.1, 0.5), rng.uniform(0.02, 0.15)) for j in "OP"])
    runs.append(m.simulate(np.linspace(0, 5, 101), speed=rng.uniform(-5, 5, 2), accuracy=1e-6))
    for run in runs:
        assert run.ended == "end", run.warnings
        assert (np.diff(run.work) <= 1e-12 * np.ptp(run.energy)).all()
        assert np.abs(run.energy_drift).max() <= 1e-4 * np.ptp(run.energy)
