"""The estimates of rounding errors of link states, positions of rest and cycles, against fractions and 50 digits."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath as mp
import numpy as np

from benchmarks.stress.groups import compare
from tests.virtualwork.judged import judge
from virtualwork import Guess, Guide, Input, Link, Mechanism, Spring
from virtualwork.formulas.kinematics import Carried
from virtualwork.study.cycle import Cycle
from virtualwork.textbook.link_states import LinkStates, UnitLoad
from virtualwork.textbook.power_balance import balance

# --- tables of link states ------------------------------------------------------------------------------------------


def test_link_states_against_fractions() -> None:
    rng = np.random.default_rng(11)
    ratios, slacks = [], []
    for _ in range(300):
        n = int(rng.integers(2, 40))
        scale = 10.0 ** rng.uniform(-6, 6, 4)
        v = (rng.normal(size=n) + 1j * rng.normal(size=n)) * scale[0]
        force = (rng.normal(size=n) + 1j * rng.normal(size=n)) * scale[1]
        omega, torque = rng.normal(size=n) * scale[2], rng.normal(size=n) * scale[3]
        mass = np.abs(rng.normal(size=n))
        if rng.random() < 0.5:  # a power that nearly cancels
            torque[0] -= ((force * v.conj()).real.sum() + (omega * torque).sum()) / omega[0]
            mass[:] = 0
        unknown = rng.normal(size=n)
        found = balance(
            LinkStates(v, omega, mass=mass, force=force, torque=torque, gravity=-9.81j * scale[1]),
            [UnitLoad(torque=unknown)],
        )
        if not found.determined[0]:
            continue
        f = Fraction
        power = sum(
            f(a.real) * f(b.real)
            + f(a.imag) * f(b.imag)
            + f(t) * f(w)
            - f(m) * f(9.81 * scale[1]) * f(b.imag)
            for a, b, t, w, m in zip(
                force.tolist(), v.tolist(), torque.tolist(), omega.tolist(), mass.tolist(), strict=True
            )
        )
        coefficient = sum(f(u) * f(w) for u, w in zip(unknown.tolist(), omega.tolist(), strict=True))
        error = abs(float(f(float(found.value[0])) + power / coefficient))
        bound = float(found.error_estimate()[0])
        ratios.append(error / bound)
        slacks.append(bound / error if error else 1.0)
    assert max(ratios) <= 1
    assert np.median(slacks) <= 100


def test_several_unknowns_against_fractions() -> None:
    rng = np.random.default_rng(12)
    slacks = []
    for _ in range(100):
        omega = rng.normal(size=(2, 3))
        torque = rng.normal(size=3)
        found = balance(
            LinkStates(np.zeros((2, 3)), omega, torque=np.array([torque, torque])),
            [UnitLoad(torque=[1, 0, 0]), UnitLoad(torque=[0, 1, 0])],
        )
        w = [[Fraction(x) for x in row] for row in omega.tolist()]
        p = [-sum(a * Fraction(t) for a, t in zip(row, torque.tolist(), strict=True)) for row in w]
        det = w[0][0] * w[1][1] - w[0][1] * w[1][0]
        true = ((p[0] * w[1][1] - p[1] * w[0][1]) / det, (p[1] * w[0][0] - p[0] * w[1][0]) / det)
        for value, exact, bound in zip(
            found.value.tolist(), true, found.error_estimate().tolist(), strict=True
        ):
            error = abs(float(Fraction(value) - exact))
            assert error <= bound
            slacks.append(bound / error if error else 1.0)
    assert np.median(slacks) <= 100


def test_an_unknown_that_is_not_determined_has_no_bound() -> None:
    found = balance(LinkStates([0, 3], [0, 0], force=[0, 5]), [UnitLoad(torque=[1, 0])])
    assert np.isinf(found.error_estimate()[0])


# --- positions of rest, cycles ----------------------------------------------------------------------------------------


def test_equilibria_against_50_digits() -> None:
    """A bob on a spring: the roots of Re(F̄·dP/dq) by mpmath."""
    m = Mechanism(
        ground={"O": 0j, "S": 1.5 + 0.3j},
        links={"bob": Link({"O": 0j, "P": 1}, mass=2, center=0.5 + 0.1j)},
        inputs=Input(link="bob"),
        gravity=-9.81j,
        springs=[Spring((("bob", 1 + 0j), ("ground", 1.5 + 0.3j)), 7.0, 0.4)],
    )
    found = m.equilibria().found
    assert len(found) >= 2
    with mp.workdps(40):

        def force(q: mp.mpf) -> mp.mpf:
            e = mp.expj(q)
            weight = mp.re(mp.conj(mp.mpc(0, -2 * mp.mpf(9.81))) * mp.mpc(0, 1) * mp.mpc(0.5, 0.1) * e)
            d = mp.mpc(1.5, 0.3) - e
            pull = 7 * (1 - mp.mpf(0.4) / abs(d)) * d
            return weight + mp.re(mp.conj(pull) * mp.mpc(0, 1) * e)

        for e in found:
            true = mp.findroot(force, mp.mpf(e.inputs[0]))
            (estimate,) = e.error_estimate()
            error = abs(true - mp.mpf(e.inputs[0]))
            assert error <= estimate <= 1.02 * error + 1e-30
            assert estimate <= 1e-13


def test_a_cycle_of_a_weight() -> None:
    """A turning weight: the effort is m g r cos q, its mean 0, its root mean square m g r/√2."""
    m = Mechanism(
        {"O": 0j}, {"arm": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="arm"), gravity=-9.81j
    )
    cycle = Cycle(m.motion(np.linspace(0, 2 * np.pi, 361), 1.0, 0.0))
    bound = cycle.error_estimate()
    assert abs(cycle.mean) <= bound["mean"] <= 1e-13
    assert abs(cycle.work) <= bound["work"] <= 1e-12
    assert abs(cycle.rms - 9.81 / math.sqrt(2)) <= bound["rms"] <= 1e-13
    assert abs(cycle.peak - 9.81) <= bound["peak"] <= 1e-13
    assert bound["fluctuation"] <= 1e-11


def test_a_guide_that_turns() -> None:
    """A block on a turning bar (000 §1.8): the estimate of its slide and rates."""
    m = Mechanism(
        ground={"A": 0j, "D": 1.5},
        links={"crank": Link({"A": 0j, "B": 1}), "bar": Link({"D": 0j})},
        guides=[Guide("B", "crank", on="bar", through=0.3j)],
        inputs=Input(link="crank"),
        guess=Guess(at=1.0, angles={"bar": 2.0}),
    )
    judge([p for q in (1.0, 1.2, 2.0) for p in compare(m.motion(q, 2.0, -1.0))])


def test_the_point_of_a_rail_at_which_a_slide_stands() -> None:
    """Its velocity i·ω·(T + s·e^{iδ})·e^{iθ}, without that along the rail: of a driven slide on a turning arm."""
    rng, pairs = np.random.default_rng(3), []
    for _ in range(50):
        at, turned = complex(*rng.normal(size=2)), float(rng.uniform(-3, 3))
        m = Mechanism(
            {"A": 0j},
            {"arm": Link({"A": 0j, "T": at}), "block": Link({"B": 0j})},
            guides=[Guide("B", "block", on="arm", through="T", angle=turned, turned=0.0)],
            inputs=[Input(link="arm"), Input(slider="B")],
            guess=Guess([0.3, 0.4]),
        )
        q, s, speed = rng.normal(size=3)
        motion = m.motion([[q, s]], [[speed, 0.7]])
        with mp.workdps(40):
            place = (mp.mpc(at) + mp.mpf(s) * mp.expj(mp.mpf(turned))) * mp.expj(mp.mpf(q))
            off = abs(1j * mp.mpf(speed) * place - mp.mpc(complex(motion.value(Carried(0, 1))[0])))
        pairs.append((float(off), float(motion.rounding.of(Carried(0, 1))[0])))
    judge(pairs)
