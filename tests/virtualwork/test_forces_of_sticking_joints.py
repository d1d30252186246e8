"""Joint forces while friction holds a joint: the friction is what balances the other loads, by hand and by virtual work."""

from __future__ import annotations

import cmath
import math
import pickle

import mpmath as mp
import numpy as np
import pytest

from tests.virtualwork.released import G, block, double_pendulum, four_bar
from virtualwork import Force, Friction, Guide, Input, Link, Mechanism
from virtualwork.describe.dimensions import changed
from virtualwork.formulas.forces import Effort, JointMoment, Shaking
from virtualwork.intime.run import Run


def moment(run: Run, joint: str, body: str) -> np.ndarray:
    """The moment of a pin on a body at the run's times."""
    (pin,) = (j for j in run.first_motion.dynamics.reactions.joints if j.name == joint)
    return np.asarray(run.motion.dynamics.joint_moment(pin, body))


@pytest.mark.parametrize("slope", [0.3, -0.3, 0.0, math.pi - 0.3])
@pytest.mark.parametrize("speed", [2.0, -2.0, 0.0])
def test_a_block_held_on_an_incline_bears_its_weight(slope: float, speed: float) -> None:
    m = Mechanism(
        {"O": 0j},
        {"block": Link({"P": 0j}, mass=3)},
        guides=[Guide("P", "block", angle=slope, turned=0.0)],
        inputs=Input(slider="P", value=0.0),
        gravity=-1j * G,
        friction=[Friction("P", 0.5)],
    )
    run = m.simulate([0, 0.01, 20, 30, 40], angle=0.0, speed=speed)
    held = run.speed[:, 0] == 0
    assert held.tolist() == [not speed, not speed, True, True, True]
    assert not run.fine.undetermined(run.t).any()
    force = run.motion.reaction("P", on="block")
    assert force[held] == pytest.approx(np.tile([0.0, 3 * G], (held.sum(), 1)), abs=1e-13)
    along, normal = cmath.exp(1j * slope), 3 * G * math.cos(slope)
    sliding = 1j * along * normal - 0.5 * abs(normal) * along * math.copysign(1.0, speed)
    if speed:
        assert force[0] == pytest.approx([sliding.real, sliding.imag], abs=1e-13)
    assert run.motion.effort == pytest.approx([0.0] * 5, abs=1e-13)
    # and its digits
    assert (run.rounding(Shaking()) < 1e-13).all()
    again = pickle.loads(pickle.dumps(run.motion._parts[-1][1] if speed else run.motion))
    assert again.reaction("P", on="block")[-1] == pytest.approx([0.0, 3 * G], abs=1e-13)


@pytest.mark.parametrize("pull", [1.5, -1.5, 0.0])
def test_a_pull_below_the_limit_is_held(pull: float) -> None:
    m = block(gravity=-1j * G, friction=[Friction("P", 0.2)], forces=[Force("block", 0j, complex(pull))])
    run = m.simulate([0, 1, 10], angle=0.0)
    assert run.motion.reaction("P", on="block") == pytest.approx(np.tile([-pull, G], (3, 1)), abs=1e-13)


def test_before_it_moves_a_joint_that_breaks_away_has_its_full_friction() -> None:
    """Pulled with more than μ m g from rest: the friction of the first instant is that of sliding."""
    m = block(gravity=-1j * G, friction=[Friction("P", 0.2)], forces=[Force("block", 0j, 5 + 0j)])
    run = m.simulate([0, 1], angle=0.0)
    assert run.motion.reaction("P", on="block") == pytest.approx(np.tile([-0.2 * G, G], (2, 1)), abs=1e-13)


def test_a_four_bar_held_by_one_pin_against_the_slope_of_its_potential() -> None:
    """The friction torque on the crank at rest is dV/dθ, V = Σ m g y, of the loop closed in 30 digits."""
    run = four_bar(friction=[Friction("A", 0.3, 0.1)]).simulate(np.linspace(0, 20, 5))
    assert run.speed[-1, 0] == 0
    pose = run.motion.link("coupler").angle[-1], run.motion.link("rocker").angle[-1]

    def turned(angle: object) -> object:
        return mp.mpc(mp.cos(angle), mp.sin(angle))

    def potential(theta: object) -> object:
        crank = mp.mpf("0.1") * turned(theta)

        def gap(coupler: object, rocker: object) -> list[object]:
            left = crank + mp.mpf("0.35") * turned(coupler) - mp.mpf("0.4") - mp.mpf("0.25") * turned(rocker)
            return [mp.re(left), mp.im(left)]

        coupler, rocker = mp.findroot(gap, pose)
        y = [
            crank / 2,
            2 * (crank + mp.mpf("0.175") * turned(coupler)),
            1.5 * mp.mpf("0.125") * turned(rocker),
        ]
        return mp.mpf("9.81") * sum(map(mp.im, y))

    with mp.workdps(30):
        slope = float(mp.diff(potential, mp.mpf(float(run.angle[-1, 0]))))
    assert moment(run, "A", "crank")[-1] == pytest.approx(slope, rel=1e-12)
    assert run.motion.effort[-1] == pytest.approx(0.0, abs=1e-14)


def test_an_elbow_that_sticks_while_the_shoulder_slides() -> None:
    """The moment of the elbow on the lower arm is that of d'Alembert's forces about it: m e × (a − g)."""
    m = double_pendulum(friction=[Friction("O", 0.3, 0.1), Friction("P", 0.3, 0.5)])
    t = np.array([0.51, 0.53, 0.55])
    run = m.simulate([0, *t, 0.6])
    modes = [leg.equations.mode for leg in run.fine.legs]  # type: ignore[attr-defined]
    assert modes[1] == (-1, 0)
    assert run.fine.legs[0].end < t[0]
    assert t[-1] < run.fine.legs[1].end
    q, w, a = run.angle[1:4], run.speed[1:4], run.acceleration[1:4]
    arms = np.exp(1j * q)
    mass = (arms * (1j * a - w**2)).sum(axis=1) + 1j * G
    exact = (arms[:, 1].conj() * mass).imag
    assert moment(run, "P", "lower")[1:4] == pytest.approx(exact, abs=1e-12)
    assert (np.abs(exact) < 0.15 * np.abs(mass)).all()
    assert np.abs(run.motion.effort).max() < 1e-13
    assert max(run.rounding(Effort(j)).max() for j in range(2)) < 1e-13


def test_two_pins_that_hold_one_motion_are_not_determined() -> None:
    run = four_bar(friction=[Friction(j, 0.3, 0.05) for j in "AB"]).simulate(np.linspace(0, 20, 5))
    stands = run.speed[:, 0] == 0
    # released from rest it moves at once
    assert run.fine.undetermined(run.t).tolist() == [False, *stands[1:].tolist()]
    assert stands[-1]
    # a pin without friction holds nothing
    one = four_bar(friction=[Friction("A", 0.3, 0.1), Friction("B", 0.0, 0.1)]).simulate([0, 20])
    assert not one.fine.undetermined(one.t).any()
    (pin,) = (j for j in one.first_motion.dynamics.reactions.joints if j.name == "B")
    assert one.motion.values([JointMoment(pin.key, "coupler")])[0] == pytest.approx([0.0, 0.0], abs=1e-300)


def test_without_friction_nothing_is_held() -> None:
    run = block().simulate([0, 1])
    assert not run.fine.undetermined(run.t).any()


def test_variants_have_the_forces_of_each_alone() -> None:
    """Three coefficients: two blocks are held on their way, one slides on; and one that has already met its end."""
    mu = np.array([0.5, 0.2, 0.9])
    m = Mechanism(
        {"O": 0j},
        {"block": Link({"P": 0j}, mass=3)},
        guides=[Guide("P", "block", angle=0.3, turned=0.0)],
        inputs=Input(slider="P", value=0.0),
        gravity=-1j * G,
        friction=[Friction("P", 0.5)],
    )
    t = [0.0, 0.1, 2.0]
    runs = m.vary({"friction.1.coefficient": mu}).simulate(t, speed=1.0)
    force = runs.motion.reaction("P", on="block")
    for i, coefficient in enumerate(mu.tolist()):
        one = changed(m, {"friction.1.coefficient": coefficient}).simulate(t, speed=1.0)
        assert force[i] == pytest.approx(one.motion.reaction("P", on="block"), abs=1e-13)
    assert np.abs(runs.motion.effort).max() < 1e-13
    assert (runs.speed[:, -1, 0] == 0).tolist() == [True, False, True]
    ends = m.vary({"friction.1.coefficient": mu}).simulate(t, speed=1.0, until={"P": -0.5})
    force = ends.motion.reaction("P", on="block")
    assert force[0, -1] == pytest.approx([0.0, 3 * G], abs=1e-13)
    assert np.isfinite(force[1]).all()
    assert ends.angle[1, -1, 0] == -0.5
