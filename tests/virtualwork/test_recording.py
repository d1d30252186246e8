"""The formulas on the tape are those on arrays: all quantities of random mechanisms, with loads, on every engine.

What is compared are two executions of one text, and the closure of every loop in 40 digits is tested elsewhere
(`test_any_numbers`); here it is the recording that is tested: what enters, what is pruned, what engines make of it.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from virtualwork import Link, Mechanism, Spring, TorsionSpring
from virtualwork.describe.parts import Force, Torque
from virtualwork.formulas.forces import Effort, JointForce, JointMoment, NewtonEuler, Shaking, ShakingMoment
from virtualwork.formulas.kinematics import Angle, Point, PointPartial, Slide
from virtualwork.formulas.recording import Recording

KINDS = ["four-bar", "slider-crank", "inverted slider-crank", "Watt", "Stephenson", "triad"]


def loaded(m, rng):
    """The same mechanism with masses, gravity, springs, a force and a torque."""
    links = {
        name: Link(
            link.points, *rng.uniform(0.5, 2, 1), complex(*rng.normal(size=2)), *rng.uniform(0.1, 1, 1)
        )
        for name, link in m.links.items()
    }
    first, *_, last = m.links
    at = next(iter(m.links[last].points.values()))
    values = {f.name: getattr(m, f.name) for f in fields(m)}
    return Mechanism(
        **values
        | {
            "links": links,
            "gravity": -9.81j,
            "forces": [Force(last, at, 3 - 2j), Force(last, at, 1j, "link")],
            "torques": [Torque(last, 0.7)],
            "springs": [Spring(((last, at + 0.3), ("ground", 0.2j)), 40.0, 0.1, 2.0)],
            "torsion_springs": [TorsionSpring((first, last), 3.0, 0.0, 0.2)],
        }
    )


def quantities(m, motion):
    """Every quantity and its array by the way over blocks."""
    found = {}
    for body, link in m.links.items():
        for name, z in link.points.items():
            for order in range(4):
                found[Point(body, z, name, order)] = motion.at(body, name).complex(order)
            found[PointPartial(body, z + 0.1, None, 0, 1)] = motion.at(body, z + 0.1).coefficient()
        for order, what in enumerate(("angle", "omega", "alpha", "jerk")):
            found[Angle(body, order)] = getattr(motion.link(body), what)
    for i in range(len(m.guides)):
        for order, what in enumerate(("position", "speed", "acceleration", "jerk")):
            found[Slide(i, order)] = getattr(motion.slide(m.guides[i].point), what)
    forces = motion.dynamics
    found[Effort(0)], found[NewtonEuler(0)] = forces.effort[:, 0], forces.newton_euler[:, 0]
    for joint in forces.reactions.joints:
        for body in joint.bodies:
            found[JointForce(joint.key, body)] = forces.joint_force(joint, body)
            found[JointMoment(joint.key, body)] = forces.joint_moment(joint, body)
    force, moment = forces.shaking
    found[Shaking()], found[ShakingMoment()] = force[:, 0] + 1j * force[:, 1], moment
    return found


@pytest.mark.parametrize("engine", ["python", "numpy", "llvm"])
@pytest.mark.parametrize("kind", KINDS)
def test_every_quantity_is_that_of_the_poses(kind, engine, random_mechanism, monkeypatch) -> None:
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    rng = np.random.default_rng(KINDS.index(kind))
    m = loaded(random_mechanism(kind, rng), rng)
    n = 6
    given = {"q0": m.at[0] + rng.uniform(-0.001, 0.001, n)}
    given |= {name: rng.normal(size=n) for name in ("v0", "a0", "j0")}
    motion = m.motion(given["q0"], given["v0"], given["a0"], given["j0"])
    expected = quantities(m, motion)
    found = motion.poses.values(list(expected))
    condition = float(motion.condition.max())
    for (key, true), value in zip(expected.items(), found, strict=True):
        assert np.abs(value - true).max() <= 4e-15 * condition**2 * max(np.abs(true).max(), 1e-9), key


def test_what_is_not_asked_for_is_not_on_the_tape(random_mechanism) -> None:
    m = random_mechanism("Watt", np.random.default_rng(0))
    recording = Recording(m, m.assembly.plan, m.assembly.signs, (True, False, False))
    crank = recording.tape([Angle("crank", 1)])
    assert crank.cost == 0, "the crank turns with the input"
    dyad = recording.tape([Angle("coupler", 0)]).cost
    both = recording.tape([Angle("coupler", 0), Angle("sixth", 0)]).cost
    assert 0 < dyad < both
    assert recording.tape([Angle("coupler", 0)]).cost == dyad
    # without acceleration of the input there is none on the tape
    assert "a0" not in recording.tape([Angle("sixth", 2)]).inputs
