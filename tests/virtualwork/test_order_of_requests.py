"""What was requested before changes no digit of an answer, in compiled code too."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from virtualwork import Force, Guess, Guide, Input, Link, Mechanism


def cylinder() -> Mechanism:
    """A boom that a cylinder lifts: the arm of its point B stands in the loop and in B's own position."""
    return Mechanism(
        {"A": 0j, "P": 0.4 - 0.1j},
        {
            "boom": Link({"A": 0j, "B": 0.3 + 0.05j, "T": 1.0}, 5.0, 0.5, 0.4),
            "rod": Link({"B": 0j}, 0.5, 0.05j),
            "barrel": Link({"P": 0j}, 1.0, 0.1, 0.01),
        },
        guides=[Guide("B", "rod", on="barrel", turned=0.0)],
        inputs=Input(slider="B"),
        guess=Guess(0.35, {"boom": 0.6, "barrel": 1.9}),
        gravity=-9.81j,
        forces=[Force("boom", "T", -100j)],
    )


@pytest.mark.whole
@pytest.mark.parametrize("engine", ["python", "numpy", "llvm"])
def test_pairs_of_requests(engine, monkeypatch):
    """The speed of the boom differed in its last digit once the position of B was there."""
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    q = np.linspace(0.32, 0.38, 40)
    requests = {
        "place": lambda motion: motion.point("B").position,
        "speed": lambda motion: motion.link("boom").omega,
        "acceleration": lambda motion: motion.link("boom").alpha,
        "effort": lambda motion: motion.effort,
        "force": lambda motion: motion.reaction("B", on="rod"),
    }
    alone = {name: of(cylinder().motion(q, 2.0, -1.0)) for name, of in requests.items()}
    for names in permutations(requests, 3):
        motion = cylinder().motion(q, 2.0, -1.0)
        for name in names:
            assert np.array_equal(requests[name](motion), alone[name]), (names, name)
