"""Beer and Johnston, sample problem 10.3: the cylinder of a hydraulic lift table, F_DH = 5.15 kN at 60°."""

from __future__ import annotations

import math

import pytest

from virtualwork import Force, Guess, Guide, Input, Link, Mechanism


def test_hydraulic_lift_table() -> None:
    a, length, theta = 0.7, 3.2, math.radians(60)
    d = a * complex(math.cos(theta), math.sin(theta))
    s = abs(d - length)
    m = Mechanism(
        {"E": 0j, "H": length},
        {
            "member": Link({"E": 0j, "D": a, "B": 2 * a}),
            "tube": Link({"H": 0j}),
            "rod": Link({"D": 0j}),
        },
        guides=[Guide("D", "rod", "tube", turned=0.0)],
        inputs=Input(slider="D"),
        guess=Guess(at=(s,), angles={"member": theta, "tube": 2.9, "rod": 2.9}),
        forces=[Force("member", 2 * a + 0j, -0.5j * 1000 * 9.81)],
    )
    motion = m.motion(s)
    assert motion.effort[0] == pytest.approx(5157.17949008649, rel=1e-13)
    assert motion.dynamics.newton_euler[0, 0] == pytest.approx(5157.17949008649, rel=1e-13)
    # W cot θ · s/L, by hand
    assert motion.effort[0] == pytest.approx(9810 / math.tan(theta) * s / length, rel=1e-13)
