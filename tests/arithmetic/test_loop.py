"""Loops of a tape on its own results, on every engine."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dalembert.arithmetic.engines import floats, rounds
from dalembert.arithmetic.loop import Calls, Loop
from dalembert.arithmetic.recorded import RECORDED, Recorder


def newton() -> Loop:
    """Kepler's equation E − e·sin E = M by Newton's method; what is called gives the gap and its slope."""
    inner = Recorder()
    x, e = inner.input("x"), inner.input("e")
    gap = inner.tape(
        {"gap": x - e * RECORDED.sin(x) - inner.input("mean"), "slope": 1.0 - e * RECORDED.cos(x)}
    )
    outer = Recorder()
    calls = Calls(outer, ["x"], ["gap", "slope"])
    x, left = outer.input("x"), outer.input("left")
    gap_here, slope = calls({"x": x})
    after = x - gap_here / slope
    # of a lane that is done nothing changes
    new = RECORDED.select(left, after, x)
    moved = abs(after - x) - 1e-15
    body = outer.tape({"x": new, "left": RECORDED.select(left, moved, left)} | calls.outputs)
    return Loop(body, gap, ("x",))


@pytest.mark.parametrize("engine", ["numpy", "llvm"])
def test_keplers_equation_in_lanes_that_end_at_different_rounds(engine: str) -> None:
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    mean = np.linspace(0.0, 3.0, 21)
    e = np.linspace(0.0, 0.9, 21)
    state, kept = rounds.run(newton(), {"mean": mean, "e": e}, {"x": mean, "left": 1.0}, 50, engine)
    assert np.abs(state["x"] - e * np.sin(state["x"]) - mean).max() < 4e-15
    assert (kept["x"][-1] == state["x"]).all()
    assert len(kept["x"]) < 50
    # lanes are done after rounds of their own, and keep what they have
    assert len({int((np.diff(column) != 0).sum()) for column in kept["x"].T}) > 2


def test_rounds_go_on_where_they_stopped() -> None:
    given, state = {"mean": np.array([1.0, 2.0]), "e": 0.8}, {"x": 1.5, "left": 1.0}
    whole, _ = rounds.run(newton(), given, state, 50, "numpy")
    part, kept = rounds.run(newton(), given, state, 2, "numpy")
    assert kept["x"].shape == (2, 2)
    assert rounds.run(newton(), given, part, 50, "numpy")[0]["x"] == pytest.approx(whole["x"], rel=1e-16)


@pytest.mark.parametrize("engine", ["numpy", "llvm"])
def test_no_round_leaves_the_state_as_it_was(engine: str) -> None:
    """Compiled code wrote a round beyond what it had been given room for."""
    state, kept = rounds.run(
        newton(), {"mean": np.array([1.0, 2.0]), "e": 0.8}, {"x": 1.5, "left": 1.0}, 0, engine
    )
    assert state["x"].tolist() == [1.5, 1.5]
    assert kept["x"].shape == (0, 2)


def test_the_body_on_floats_calls_a_function() -> None:
    loop = newton()
    function = floats.compiled(loop.body, loop.passed, loop.inner.names)
    seen = []

    def kepler(x: float) -> tuple[float, float]:
        seen.append(x)
        return x - 0.5 * math.sin(x) - 1.0, 1.0 - 0.5 * math.cos(x)

    of = {"x": 1.0, "left": 1.0}
    x, left = function(kepler, *(of[name] for name in loop.body.inputs if name in of))
    assert seen == [1.0]
    assert x == pytest.approx(1.0 + 0.5 * math.sin(1.0) / (1.0 - 0.5 * math.cos(1.0)), rel=1e-15)
    assert left > 0


@pytest.mark.parametrize("engine", ["numpy", "llvm"])
def test_every_round_is_fed_its_own(engine: str) -> None:
    """Horner's rule in three lanes: a round for each coefficient."""
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    inner, outer = Recorder(), Recorder()
    product = inner.tape({"y": inner.input("p") * inner.input("x")})
    calls = Calls(outer, ["p"], ["y"])
    (y,) = calls({"p": outer.input("p")})
    body = outer.tape({"p": y + outer.input("c"), "left": outer.input("left")} | calls.outputs)
    rows = np.array([[1.0, 2.0, 0.5], [0.0, -1.0, 2.0], [3.0, 4.0, -5.0]])
    x = np.array([2.0, 3.0, -1.0])
    state, _ = rounds.run(
        Loop(body, product, ("p",), ("c",)), {"x": x}, {"p": 0.0, "left": 1.0}, 3, engine, {"c": rows}
    )
    assert (state["p"] == rows[0] * x**2 + rows[1] * x + rows[2]).all()


def test_what_is_called_is_counted_and_written_out() -> None:
    loop = newton()
    assert loop.cost == loop.body.cost + loop.inner.cost
    assert loop.constants == ("e", "mean") or loop.constants == ("mean", "e")
    assert not any(name.startswith("call") for name in (*loop.whole.inputs, *loop.whole.names))
