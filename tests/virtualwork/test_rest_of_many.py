"""Loads at rest of many positions at once equal those of each position alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from virtualwork import Force, Guess, Guide, Input, Link, Mechanism, Spring, Torque, TorsionSpring
from virtualwork.study.loads_at_rest import Rest

G = 9.81
TABLE = ((-3.0, -2.0), (-0.4, 1.0), (1.1, 4.0), (3.3, -2.0))


def bar(**loads: Any) -> Mechanism:
    """A bar of 2 kg on a pivot."""
    return Mechanism(
        {"O": 0j}, {"bar": Link({"O": 0j}, 2.0, 0.5)}, inputs=Input(link="bar"), gravity=-G * 1j, **loads
    )


def slider_crank() -> Mechanism:
    """A spring pulls the piston, a force turns with the rod."""
    return Mechanism(
        {"O": 0j, "S": 0.7 + 0.1j},
        {"crank": Link({"O": 0j, "A": 0.1}, 1.0, 0.04j), "rod": Link({"A": 0j, "B": 0.3}, 3.0, 0.12 + 0.02j)},
        [Guide("B", "rod")],
        inputs=Input(link="crank"),
        springs=[Spring((("rod", "B"), ("ground", "S")), 400.0, 0.2)],
        forces=[Force("rod", 0.1 + 0j, 3.0 - 2.0j, "link")],
        guess=Guess(1.0, {"rod": -0.3}),
        gravity=-G * 1j,
    )


def arm(**loads: Any) -> Mechanism:
    """Two inputs."""
    return Mechanism(
        {"O": 0j},
        {"upper": Link({"O": 0j, "E": 1}, 2.0, 0.4), "lower": Link({"E": 0j}, 1.0, 0.3 + 0.1j)},
        inputs=(Input(link="upper"), Input(link="lower")),
        torsion_springs=[TorsionSpring(("upper", "lower"), 3.0, 0.4)],
        gravity=-G * 1j,
        **loads,
    )


def rocker() -> Mechanism:
    """A rocker with torques by tables over its own angle, and over its speed, and a force that turns with it, over the input."""
    bars = {
        "crank": Link({"A": 0j, "B": 0.1}),
        "rod": Link({"B": 0j, "C": 0.35}),
        "rocker": Link({"D": 0j, "C": 0.25}),
    }
    return Mechanism(
        {"A": 0j, "D": 0.4 + 0j},
        bars,
        inputs=Input(link="crank"),
        torques=[
            Torque("rocker", history=TABLE, periodic=True, over="angle"),
            Torque("rocker", history=TABLE, over="speed"),
        ],
        forces=[Force("rocker", 0.1j, history=((-4.0, 2.0 + 1j), (0.2, -1j), (4.0, 3.0 + 0j)), frame="link")],
        guess=Guess(1.0, {"rod": 0.5, "rocker": 1.7}),
    )


CASES = {
    "bar": bar,
    "mirrored": lambda: replace(bar(torques=[Torque("bar", -2.0)]), gravity=G * 1j),
    "spring": lambda: bar(torsion_springs=[TorsionSpring(("ground", "bar"), 3.0, 0.7)]),
    "slider-crank": slider_crank,
    "arm": arm,
    "arm, tables": lambda: arm(
        torques=[
            Torque("lower", history=TABLE, periodic=True, over="angle"),
            Torque("upper", history=TABLE, over="speed"),
        ]
    ),
    "rocker, tables": rocker,
    "no load": lambda: Mechanism({"O": 0j}, {"bar": Link({"O": 0j})}, inputs=Input(link="bar")),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("n", [2, 32, 1000])
def test_many_positions_have_the_loads_of_each_alone(name: str, n: int) -> None:
    assembly = CASES[name]().assembly
    k = len(assembly.mechanism.inputs)
    inputs = np.random.default_rng(n).uniform(-3, 3, (n, k))
    many = Rest(assembly, inputs)
    for i in (0, n // 2, n - 1):
        alone = Rest(assembly, inputs[i : i + 1])
        size = 1e-12 * (1.0 + np.nan_to_num(many.force()[1][i]).max())
        for ours, its in (
            (many.force()[0], alone.force()[0]),
            (many.potential(), alone.potential()),
            (many.hessian(), alone.hessian()),
            (many.mass(), alone.mass()),
        ):
            np.testing.assert_allclose(ours[i], its[0], rtol=1e-12, atol=size)
