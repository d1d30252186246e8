"""A slider-crank whose pins and guide rub, against its own equations of Newton and Euler, solved by putting friction in again."""

from __future__ import annotations

import math

import numpy as np
import pytest

from virtualwork import Force, Friction, Guess, Guide, Input, Link, Mechanism

CRANK, ROD, G = 0.05, 0.16, 9.81
MASS, ROD_MASS, ROD_INERTIA, CENTER = 2.0, 0.8, 0.002, 0.06
RADII = {"O": 0.02, "A": 0.015, "B": 0.01}


def torque(angle: float, speed: float, offset: float, push: float, mu: tuple[float, ...]) -> float:
    """The effort of the crank; `mu` of the pins O, A and B, and of the guide."""
    a = CRANK * np.exp(1j * angle)
    turned = math.asin((offset - a.imag) / ROD)
    e = np.exp(1j * turned)
    omega = -speed * a.real / (ROD * e.real)
    alpha = (speed**2 * a.imag + ROD * omega**2 * e.imag) / (ROD * e.real)
    moved = (1j * speed * a + 1j * omega * ROD * e).real
    bent = 1j * alpha - omega**2
    piston, rod = (-(speed**2) * a + bent * x * e for x in (ROD, CENTER))
    effort, guided, at_a, at_b = 0.0, 0.0, 0j, 0j
    for _ in range(60):
        rubs = [
            mu[1] * RADII["A"] * abs(at_a) * np.sign(omega - speed),
            mu[2] * RADII["B"] * abs(at_b) * np.sign(omega),
        ]
        along = MASS * piston.real - push + mu[3] * abs(guided) * np.sign(moved)
        # moments of the rod about A: the force of the piston, −(along, across), its weight, its inertia, and friction
        held = ROD_MASS * CENTER * (np.conj(e) * (rod + 1j * G)).imag + ROD_INERTIA * alpha
        across = (ROD * e.imag * along - held - rubs[0] - rubs[1]) / (ROD * e.real)
        at_b = complex(along, across)
        at_a = at_b + ROD_MASS * (rod + 1j * G)
        guided = MASS * G - across
        effort = (np.conj(a) * at_a).imag - rubs[0] + mu[0] * RADII["O"] * abs(at_a) * np.sign(speed)
    return float(effort)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(
    "rubbing", [(0, 0, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1), (0, 0, 1, 1), (1, 1, 1, 1), (1, 1, 0, 0)]
)
def test_pins_and_guide_rub_by_themselves(seed: int, rubbing: tuple[int, ...]) -> None:
    """An entry with a radius is the pin's, one without is the guide's; entries of coefficient 0 change nothing."""
    rng = np.random.default_rng(seed)
    angle, speed = rng.uniform(0, 2 * math.pi), rng.uniform(10, 60) * rng.choice([-1, 1])
    offset, push = rng.uniform(-0.02, 0.02), rng.uniform(-800, 800)
    mu = tuple(float(x) for x in rng.uniform(0.02, 0.2, 4) * rubbing)
    m = Mechanism(
        {"O": 0j},
        {
            "crank": Link({"O": 0j, "A": CRANK}),
            "rod": Link({"A": 0j, "B": ROD}, ROD_MASS, CENTER, ROD_INERTIA),
            "piston": Link({"B": 0j}, MASS),
        },
        [Guide("B", "piston", through=1j * offset, turned=0.0)],
        inputs=Input("crank", speed=float(speed), acceleration=0.0),
        guess=Guess(0.0, {"rod": 0.0}),
        forces=[Force("piston", 0j, complex(push))],
        friction=[*(Friction(pin, mu[i], RADII[pin]) for i, pin in enumerate("OAB")), Friction("B", mu[3])],
        gravity=-1j * G,
    )
    scale = CRANK * (abs(push) + MASS * CRANK * speed**2)
    assert float(m.motion([angle]).effort[0]) == pytest.approx(
        torque(angle, speed, offset, push, mu), abs=1e-12 * scale
    )
