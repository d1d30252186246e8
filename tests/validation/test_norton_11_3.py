"""Norton, Design of Machinery, ex. 11-3: four-bar in inches, pounds and blobs; printed T12 = 243 lb·in."""

from __future__ import annotations

import math

import numpy as np
import pytest

from virtualwork import Force, Guess, Input, Link, Mechanism, Torque

G = 386.0  # in/s²


def polar(r: float, degrees: float) -> complex:
    return r * complex(math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))


def test_norton_11_3() -> None:
    cg3 = polar(9, 45)
    m = Mechanism(
        {"O2": 0j, "O4": 19},
        {
            "2": Link({"O2": 0j, "A": 5}, 1.5 / G, polar(3, 30), 0.4),
            "3": Link({"A": 0j, "B": 15}, 7.7 / G, cg3, 1.5),
            "4": Link({"O4": 0j, "B": 10}, 5.8 / G, 5, 0.8),
        },
        inputs=Input(link="2"),
        guess=Guess(at=(math.radians(60),), angles={"3": 0.4, "4": 1.8}),
        forces=[Force("3", cg3 + polar(3, 100), polar(80, 330))],
        torques=[Torque("4", 120.0)],
    )
    motion = m.motion(math.radians(60), 25.0, -40.0)
    assert motion.link("3").alpha[0] == pytest.approx(120.9, abs=0.05)
    assert motion.link("4").alpha[0] == pytest.approx(276.29, abs=0.005)
    assert round(motion.effort[0]) == 243
    # computed in extended precision from the same data
    assert motion.effort[0] == pytest.approx(243.2375907612, rel=1e-12)
    assert motion.dynamics.newton_euler[0, 0] == pytest.approx(243.2375907612, rel=1e-12)
    forces = {
        ("O2", "2"): (-117.559592, -107.458527),
        ("A", "2"): (118.025914, 100.172257),
        ("B", "3"): (-1.309563, 87.401486),
        ("O4", "4"): (-20.237824, 77.658131),
    }
    for (joint, on), force in forces.items():
        assert motion.reaction(joint, on)[0] == pytest.approx(force, abs=1e-6)
    force, moment = motion.dynamics.shaking
    assert force[0] == pytest.approx((117.559592 + 20.237824, 107.458527 - 77.658131), abs=1e-6)
    assert moment[0] == pytest.approx(-19 * 77.658131 - 243.237591, abs=1e-4)
    assert np.isfinite(motion.dynamics.newton_euler).all()
