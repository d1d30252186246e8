"""Derivatives to dimensions of every kind, against differences of the same formulas in fifty digits.

The formulas stand on a tape of which the dimensions are inputs. Worked out with mpmath at both sides of a dimension, 1e-20
apart, they give the derivative to some thirty digits: another way than the sweep backwards that is tested. That the
formulas themselves are right is tested elsewhere.
"""

from __future__ import annotations

from copy import copy
from importlib.resources import files
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from benchmarks.stress.tapes import DIGITS, Digits
from benchmarks.truth.mechanism import Exact
from virtualwork import Gear, Guess, Input, Link, Mechanism, Spring, TorsionSpring
from virtualwork.describe.dimensions import dimensions, value
from virtualwork.describe.parts import Force, Torque
from virtualwork.family.sensitivity import Sensitivities
from virtualwork.family.varied_formulas import VariedFormulas
from virtualwork.formulas.forces import Effort, JointForce, NewtonEuler
from virtualwork.formulas.kinematics import Angle, Point

# between them every kind: lengths, angles, masses, guides, gears, springs, motors, loads
EXAMPLES = ["boom/boom", "engine/engine", "crank-press/press", "desk-lamp/lamp", "two-disc-four-bar/four-bar",
            "quick-return/quick-return", "planetary-gear/planetary", "five-bar/five-bar", "klann/klann",
            "toggle-clamp/clamp", "stephenson-six-bar/stephenson", "governor/governor"]  # fmt: skip
KINDS = ["four-bar", "slider-crank", "inverted slider-crank", "Watt", "Stephenson", "triad"]
MOST = 24


def loaded(m, rng):
    """The same mechanism with masses, weight, springs, a force and a torque."""
    links = {
        name: Link(link.points, rng.uniform(0.5, 2), complex(*rng.normal(size=2)), rng.uniform(0.1, 1))
        for name, link in m.links.items()
    }
    first, *_, last = m.links
    at = next(iter(m.links[last].points.values()))
    return Mechanism(
        m.ground, links, m.guides, inputs=m.inputs, guess=m.guess, gravity=-9.81j,
        forces=[Force(last, at, 3 - 2j), Force(last, at, 1j, "link")], torques=[Torque(last, 0.7)],
        springs=[Spring(((last, at + 0.3), ("ground", 0.2j)), 40.0, 0.1, 2.0)],
        torsion_springs=[TorsionSpring((first, last), 3.0, 0.0, 0.2)],
    )  # fmt: skip


def asked(m, motion):
    """Places and rates of the last link, effort, and a joint force."""
    last = list(m.links)[-1]
    point, z = next(reversed(m.links[last].points.items()))
    keys = [Point(last, z, point, order) for order in range(3)]
    keys += [Angle(last, order) for order in range(3)] + [Effort(0)]
    joints = [j for j in motion.dynamics.reactions.joints if last in j.bodies]
    return [*keys, JointForce(joints[0].key, last)] if joints else keys


def sizes(m, dims, values, found):
    """What an error is measured by: the largest derivative to a dimension of the kind, or the quantity over the dimension."""
    largest = {}
    for i, quantity in enumerate(values):
        for j, d in enumerate(dims):
            typical = max(abs(float(value(m, e.path).real)) for e in dims if e.kind == d.kind) or 1.0
            size = max(np.abs(found[i][j]).max(), np.abs(quantity).max() / typical)
            largest[i, d.kind] = max(largest.get((i, d.kind), 0.0), float(size))
    return largest


def compare(m, motion):
    """The largest error of the derivatives to every dimension but the inputs' own, or to a sample; the pose's condition."""
    keys = asked(m, motion)
    dims = [d for d in dimensions(m).values() if d.where[0] != "inputs"]
    dims = dims[:: 1 + len(dims) // MOST]
    of = Sensitivities(motion.assembly, motion.poses)
    found = of.of(keys, dims)
    largest = sizes(m, dims, of.values(keys), found)
    written = VariedFormulas(motion.assembly, dims, (True, True, False), own_signs=False, settled=False)
    tape = written.tape(keys)
    given = {d.path: float(value(m, d.path).real) for d in dims}
    given |= motion.poses.entering([n for n in tape.inputs if n not in given])
    worst = 0.0
    with mp.workdps(DIGITS):
        for lane in range(motion.n):
            at = {name: mp.mpf(float(np.ravel(x)[lane if np.ndim(x) else 0])) for name, x in given.items()}
            for j, d in enumerate(dims):
                h = mp.mpf(10) ** -20 * max(1, abs(at[d.path]))
                sides: list[Any] = [tape.on(at | {d.path: at[d.path] + s * h}, Digits()) for s in (-1, 1)]
                for i, key in enumerate(keys):
                    parts = [(sides[1][n] - sides[0][n]) / (2 * h) for n in key.names]
                    true = mp.mpc(*parts) if len(parts) == 2 else parts[0]
                    off = float(abs(mp.mpmathify(found[i][j][lane].item()) - true))
                    # what does not hang on it leaves the difference's own rounding
                    worst = max(worst, off / largest[i, d.kind] if off > 1e-25 else 0.0)
    return worst, float(motion.condition.max())


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_worked_examples(name) -> None:
    m = Mechanism.from_toml(str(files("cli") / "examples" / f"{name}.toml"))
    steps = np.array([-0.05, 0.11])[:, None] * [0.2 * m.size if e.is_slide else 1.0 for e in m.inputs]
    motion = m.motion(np.array(m.at) + steps if len(m.inputs) > 1 else m.at[0] + steps[:, 0], 1.5, -0.7)
    worst, condition = compare(m, motion)

    assert condition < 30
    assert worst <= 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_random_mechanisms_with_loads(kind, random_mechanism) -> None:
    rng = np.random.default_rng(KINDS.index(kind) + 3)
    m = loaded(random_mechanism(kind, rng), rng)
    motion = m.motion(m.at[0] + np.array([0.0, 0.001]), 1.5, -0.7)
    worst, condition = compare(m, motion)

    assert condition < 1000
    assert worst <= 1e-12


def test_beside_a_limit() -> None:
    """The Watt six-bar 0.001 and 1e-5 rad from where it ends: the derivatives hold as far as the pose's condition lets them."""
    m = Mechanism.from_toml(str(files("cli") / "examples" / "watt-six-bar" / "watt.toml"))
    end = m.assembly.reach.limits()[0]
    for off in (1e-3, 1e-5):
        motion = m.motion([end.input + end.side * off], 1.5, -0.7)
        worst, condition = compare(m, motion)
        assert condition > 30
        assert worst <= 4e-16 * condition**2


class _Nudged:
    """A motion whose mechanism has a gear of another ratio, given in many digits."""

    def __init__(self, motion: Any, gear: int, ratio: Any) -> None:
        self.motion, self.mechanism = motion, copy(motion.mechanism)
        gears = list(motion.mechanism.gears)
        gears[gear] = copy(gears[gear])
        object.__setattr__(gears[gear], "ratio", ratio)
        object.__setattr__(self.mechanism, "gears", tuple(gears))

    def __getattr__(self, name: str) -> Any:
        return getattr(self.motion, name)


def geared() -> Mechanism:
    """A sun and an arm are driven; a planet and an idler on the arm mesh with the sun, a wheel on the ground with the arm."""
    return Mechanism(
        {"O": 0j, "W": 0.1},
        {
            "arm": Link({"O": 0j, "P": 0.06, "Q": 0.02 + 0.03j}, 0.4, 0.03, 2e-4),
            "sun": Link({"O": 0j, "S": 0.02}, 0.5, 0.005 + 0.001j, 1e-4),
            "planet": Link({"P": 0j, "T": 0.04}, 0.3, 0.01 - 0.02j, 3e-4),
            "idler": Link({"Q": 0j, "U": 0.015}, 0.2, 0.004 + 0.007j, 2e-5),
            "wheel": Link({"W": 0j, "V": 0.03}, 0.6, 0.002 - 0.01j, 4e-5),
        },
        gears=[
            Gear(("sun", "planet"), -0.5, "arm"),
            Gear(("sun", "idler"), 2.3, "arm"),
            Gear(("arm", "wheel"), -0.7),
        ],
        inputs=[Input(link="arm"), Input(link="sun")],
        guess=Guess(at=(0.1, 0.2)),
        gravity=-9.81j,
        torques=[Torque("idler", 0.3)],
    )


@pytest.mark.parametrize("gear", [0, 1, 2])
def test_torques_to_the_ratios_of_gears(gear: int) -> None:
    """The efforts by both ways, against all multipliers of all constraints in fifty digits: another formulation."""
    m = geared()
    motion = m.motion([[0.7, -0.4]], [[1.5, 2.0]], [[-0.7, 0.3]])
    with mp.workdps(50):
        h, ratio = mp.mpf(10) ** -15, mp.mpf(m.gears[gear].ratio)
        below, above = (Exact(_Nudged(motion, gear, ratio + s * h)).forces() for s in (-1, 1))
        true = [float((above["input", j, 0] - below["input", j, 0]) / (2 * h)) for j in "01"]
    assert max(map(abs, true)) > 1e-3
    for way in Effort, NewtonEuler:
        found = [motion.derivative(way(j), f"gears.{gear + 1}.ratio")[0] for j in (0, 1)]
        assert found == pytest.approx(true, rel=1e-12, abs=1e-13)
