"""Open chains of many links: no call nests as deep as the chain is long."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from virtualwork import Input, Link, Mechanism

G = 9.81


def chain(n: int) -> Mechanism:
    """n bars of 1 m and 1 kg, each driven against the ground; the next hangs on its end."""
    links = {f"l{i}": Link({f"P{i}": 0j, f"P{i + 1}": 1 + 0j}, 1.0, 0.5) for i in range(n)}
    return Mechanism({"P0": 0j}, links, inputs=tuple(Input(link=name) for name in links), gravity=-G * 1j)


@contextmanager
def shallow(calls: int) -> Iterator[None]:
    """Few calls may nest."""
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(len(inspect.stack()) + calls)
    try:
        yield
    finally:
        sys.setrecursionlimit(before)


@pytest.mark.parametrize(("n", "calls"), [(150, 200), pytest.param(300, 200, marks=pytest.mark.slow)])
def test_positions_and_forces_of_a_chain(n: int, calls: int) -> None:
    angles = 0.01 * np.arange(n)
    with shallow(calls):
        motion = chain(n).motion(angles[None])
        end = motion.point(f"P{n}").position[0]
        effort = motion.effort[0]
        by_forces = motion.dynamics.newton_euler[0]
    assert complex(*end) == pytest.approx(np.exp(1j * angles).sum(), rel=1e-13)
    # each bar carries its own weight at its middle and the later ones at its end
    exact = G * np.cos(angles) * (0.5 + np.arange(n)[::-1])
    assert effort == pytest.approx(exact, rel=1e-12, abs=1e-12 * G * n)
    assert by_forces == pytest.approx(exact, rel=1e-11, abs=1e-11 * G * n)
