"""Derivatives to dimensions of every kind, against differences of the same formulas in fifty digits.

The formulas stand on a tape of which the dimensions are inputs. Worked out with mpmath at both sides of a dimension, 1e-20
apart, they give the derivative to some thirty digits: another way than the sweep backwards that is tested. That the
formulas themselves are right is tested elsewhere.
"""

from __future__ import annotations

from importlib.resources import files
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from benchmarks.stress.tapes import DIGITS, Digits
from virtualwork import Link, Mechanism, Spring, TorsionSpring
from virtualwork.describe.dimensions import dimensions, value
from virtualwork.describe.loads import Force, Torque
from virtualwork.family.sensitivity import Sensitivities
from virtualwork.family.written import Written
from virtualwork.formulas.asked import names
from virtualwork.formulas.lanes import Lanes

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
    keys = [("point", last, z, point, order) for order in range(3)]
    keys += [("angle", last, order) for order in range(3)] + [("effort", 0)]
    joints = [j for j in motion.dynamics.reactions.joints if last in j.bodies]
    return [*keys, ("force", joints[0].key, last)] if joints else keys


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
    written = Written(motion.assembly, dims, (True, True, False), own_signs=False, settled=False)
    tape = written.tape(keys)
    given = {d.path: float(value(m, d.path).real) for d in dims}
    given |= Lanes(motion.assembly, motion.poses).entering([n for n in tape.inputs if n not in given])
    worst = 0.0
    with mp.workdps(DIGITS):
        for lane in range(motion.n):
            at = {name: mp.mpf(float(np.ravel(x)[lane if np.ndim(x) else 0])) for name, x in given.items()}
            for j, d in enumerate(dims):
                h = mp.mpf(10) ** -20 * max(1, abs(at[d.path]))
                sides: list[Any] = [tape.on(at | {d.path: at[d.path] + s * h}, Digits()) for s in (-1, 1)]
                for i, key in enumerate(keys):
                    parts = [(sides[1][n] - sides[0][n]) / (2 * h) for n in names(key)]
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
    end = m.assembly.track.limits()[0]
    for off in (1e-3, 1e-5):
        motion = m.motion([end.input + end.side * off], 1.5, -0.7)
        worst, condition = compare(m, motion)
        assert condition > 30
        assert worst <= 4e-16 * condition**2
