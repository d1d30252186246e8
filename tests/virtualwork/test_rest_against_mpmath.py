"""Positions of rest: estimates of inputs, potential, stiffness and periods against closed forms and 50 digits."""

from __future__ import annotations

import math
import pickle
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from benchmarks.stress.loaded import constants_of, under_loads
from benchmarks.stress.topologies import generate
from benchmarks.truth.at_rest import AtRest
from tests.virtualwork.judged import judge
from virtualwork import Force, Guess, Guide, Input, Link, Mechanism, Spring, Torque, TorsionSpring
from virtualwork.describe import MechanismError
from virtualwork.study.equilibrium import Equilibrium

Pair = tuple[float, float]


def apart(value: float | None, true: Any, estimate: float) -> Pair:
    """The error and its estimate."""
    assert value is not None
    return float(abs(mp.mpf(value) - true)), estimate


def pairs(m: Mechanism, e: Equilibrium) -> list[Pair]:
    """The errors of everything that a position of rest has, with their estimates."""
    constants = None
    with mp.workdps(60):
        if m.assembly.phases:
            # what the guess fixes by way of loops is no number of the description
            rates = [[0.0] * len(e.inputs)] * 2
            constants = constants_of(m.motion([list(e.inputs)], *rates))[0]
        true = AtRest(m, list(e.inputs), constants)
        every = [
            apart(q, exact, estimate)
            for q, exact, estimate in zip(e.inputs, true.inputs, e.error_estimate(), strict=True)
        ]
        least = min(mp.eigsy(true.stiffness, eigvals_only=True))
        every.append(apart(e.stiffness, least, *e.error_estimate("stiffness")))
        if e.potential is not None and not m.torques:
            every.append(apart(e.potential, true.potential, *e.error_estimate("potential")))
        periods = true.periods[: len(e.periods)] if e.stable else []
        for period, exact, estimate in zip(e.periods, periods, e.error_estimate("periods"), strict=True):
            every.append(apart(period, exact, estimate))
    return every


def test_physical_pendulums() -> None:
    """2π √(I / (m g l)) with I about the pin, and m g l."""
    rng, every = np.random.default_rng(26), []
    for _ in range(30):
        mass, length, inertia, g = (float(x) for x in rng.uniform(0.1, 9, 4))
        m = Mechanism(
            {"O": 0j}, {"bob": Link({"O": 0j}, mass, length, inertia)}, inputs=Input(link="bob"),
            gravity=-g * 1j,
        )  # fmt: skip
        down = m.equilibria().found[1]
        with mp.workdps(40):
            couple = mp.mpf(mass) * mp.mpf(g) * mp.mpf(length)
            about = mp.mpf(inertia) + mp.mpf(mass) * mp.mpf(length) ** 2
            every.append(apart(down.potential, -couple, *down.error_estimate("potential")))
            every.append(apart(down.stiffness, couple, *down.error_estimate("stiffness")))
            period = 2 * mp.pi * mp.sqrt(about / couple)
            every.append(apart(down.period, period, *down.error_estimate("periods")))
    judge(every)


def test_blocks_on_springs() -> None:
    """A block of mass m on a slide that a spring of stiffness k holds along it: 2π √(m / k), and k s² / 2 − m g s."""
    rng, every = np.random.default_rng(27), []
    for _ in range(10):
        mass, stiffness, free, g = (float(x) for x in rng.uniform(0.5, 2, 4))
        stiffness *= 40
        m = Mechanism(
            {"O": 0j, "W": -5.0}, {"block": Link({"B": 0j}, mass)},
            [Guide("B", "block", angle=0.0, turned=0.0)], inputs=Input(slider="B"),
            guess=Guess(0.1, {"block": 0.0}), gravity=complex(g),
            springs=[Spring((("block", "B"), ("ground", "W")), stiffness, free)],
        )  # fmt: skip
        (rest,) = m.equilibria([[-4.9, 5.0]]).found
        with mp.workdps(40):
            k, weight = mp.mpf(stiffness), mp.mpf(mass) * mp.mpf(g)
            s = weight / k
            at = s + mp.mpf(free) - 5
            every.append(apart(rest.inputs[0], at, *rest.error_estimate()))
            potential = k * s**2 / 2 - weight * at
            every.append(apart(rest.potential, potential, *rest.error_estimate("potential")))
            period = 2 * mp.pi * mp.sqrt(mp.mpf(mass) / k)
            every.append(apart(rest.period, period, *rest.error_estimate("periods")))
    judge(every)


@pytest.mark.parametrize("second", [1.0, 1e-7])
def test_both_periods_of_double_pendulums(second: float) -> None:
    """Also where the second bob is so light that both periods are nearly equal to those of single pendulums."""
    rng, every = np.random.default_rng(28), []
    for _ in range(6):
        a, b = (float(x) for x in rng.uniform(0.5, 2, 2))
        links = {"a": Link({"O": 0j, "P": a}, 1.1, a), "b": Link({"P": 0j, "Q": b}, second, b)}
        m = Mechanism({"O": 0j}, links, inputs=[Input(link="a"), Input(link="b")], gravity=-9.81j)
        (hanging,) = (e for e in m.equilibria().found if e.stable)
        every += pairs(m, hanging)
    judge(every)


def test_a_spring_that_is_wound() -> None:
    """The whole turn in a spring's twist has more than 16 digits too."""
    m = Mechanism(
        {"O": 0j}, {"bar": Link({"O": 0j}, 2, 0.5, 0.1)}, inputs=Input(link="bar"), gravity=-9.81j,
        torsion_springs=[TorsionSpring(("ground", "bar"), 0.5, 0.4, turns=1)],
    )  # fmt: skip
    every = []
    with mp.workdps(40):
        g, k = mp.mpf(9.81), mp.mpf(0.5)

        def twist(q: Any) -> Any:
            return q - mp.mpf(0.4) + 2 * mp.pi

        for e in m.equilibria().found:
            q = mp.findroot(lambda q: g * mp.cos(q) + k * twist(q), e.inputs[0])
            every.append(apart(e.inputs[0], q, *e.error_estimate()))
            potential = g * mp.sin(q) + k * twist(q) ** 2 / 2
            every.append(apart(e.potential, potential, *e.error_estimate("potential")))
            every.append(apart(e.stiffness, k - g * mp.sin(q), *e.error_estimate("stiffness")))
    # a turn either way of the guess
    assert len(every) == 12
    judge(every)


def test_a_force_by_a_table() -> None:
    """How steep the table is counts in the stiffness; no potential."""
    at = np.linspace(0, 2 * np.pi, 8).tolist()
    force = [0.3 + 1j, 1.7, -2.2j, 4.1 + 2j, 3.3, -1.1j, 0.7, 0.3 + 1j]
    history = tuple(zip(at, force, strict=True))
    m = Mechanism(
        {"O": 0j}, {"bar": Link({"O": 0j}, 2, 0.5, 0.1)}, inputs=Input(link="bar"), gravity=-9.81j,
        forces=[Force("bar", 1 + 0.2j, frame="link", history=history, periodic=True)],
    )  # fmt: skip
    every = []
    for e in m.equilibria().found:
        i = int(np.searchsorted(at, e.inputs[0], "right")) - 1
        with mp.workdps(40):
            arm = mp.mpc(0, 1) * mp.mpc(1 + 0.2j)
            slope = (mp.mpc(force[i + 1]) - mp.mpc(force[i])) / (mp.mpf(at[i + 1]) - mp.mpf(at[i]))

            def effort(q: Any, i: int = i, slope: Any = slope, arm: Any = arm) -> Any:
                push = mp.mpc(force[i]) + slope * (q - mp.mpf(at[i]))
                return mp.re(mp.conj(push) * arm) - mp.mpf(9.81) * mp.cos(q)

            q = mp.findroot(effort, e.inputs[0])
            stiffness = -(mp.mpf(9.81) * mp.sin(q) + mp.re(mp.conj(slope) * arm))
            every.append(apart(e.inputs[0], q, *e.error_estimate()))
            every.append(apart(e.stiffness, stiffness, *e.error_estimate("stiffness")))
            assert e.error_estimate("potential") == ()
            if e.stable:
                period = 2 * mp.pi * mp.sqrt((mp.mpf(0.1) + mp.mpf(0.5)) / stiffness)
                every.append(apart(e.period, period, *e.error_estimate("periods")))
    assert every
    judge(every)


def of_seeds(seeds: range) -> list[Pair]:
    """Random mechanisms under loads, at their positions of rest."""
    every: list[Pair] = []
    for seed in seeds:
        m = under_loads(generate(seed), np.random.default_rng(seed))
        try:
            found = m.equilibria().found
        except MechanismError:
            continue
        for e in [e for e in found if e.stable is not None][:2]:
            every += pairs(m, e)
    return every


@pytest.mark.slow
def test_any_topology() -> None:
    judge(of_seeds(range(8)))


@pytest.mark.slow
def test_any_topology_of_many_more(first_seed: int) -> None:
    judge(of_seeds(range(first_seed, first_seed + 40)))


def test_where_the_stiffness_vanishes_no_digit_holds() -> None:
    """A bar that a torque as large as its weight's holds level: the first and the second variation vanish."""
    m = Mechanism(
        {"O": 0j}, {"bar": Link({"O": 0j}, 1, 1.0)}, inputs=Input(link="bar"), gravity=-1j,
        torques=[Torque("bar", 1.0)],
    )  # fmt: skip
    (level,) = m.equilibria().found
    assert level.stable is None
    for of in ("inputs", "potential", "stiffness"):
        assert level.error_estimate(of) == (math.inf,)
    assert level.error_estimate("periods") == ()


def test_it_pickles_with_its_estimates() -> None:
    m = Mechanism({"O": 0j}, {"bob": Link({"O": 0j}, 2, 0.5)}, inputs=Input(link="bob"), gravity=-9.81j)
    down = m.equilibria().found[1]
    estimates = down.error_estimate("periods")
    again = pickle.loads(pickle.dumps(down))
    assert again == down
    assert again.error_estimate("periods") == estimates
    with pytest.raises(ValueError, match="expected inputs, potential, stiffness or periods"):
        down.error_estimate("period")
