"""A tape over a grid gives every row with every column what it gives one lane."""

from __future__ import annotations

import numpy as np
import pytest

from dalembert.arithmetic.engines import grids, run, run_grid
from dalembert.arithmetic.recorded import RECORDED, Recorder


def taped():
    """Outputs of the row, of the column, of both, of neither, and twice the same."""
    recorder = Recorder()
    a, b, q, c = (recorder.input(name) for name in "abqc")
    turned = a * RECORDED.cos(q) - b
    root = RECORDED.sqrt(turned * turned + c)
    return recorder.tape(
        {
            "row": a / b,
            "column": RECORDED.sin(q),
            "both": root,
            "chosen": RECORDED.select(turned, a, q),
            "neither": c + 1.0,
            "again": root,
            "given": q,
        }
    )


@pytest.mark.parametrize("shape", [(2, 3), (5, 1), (1, 5), (3, 9001), (700, 360), (20_000, 40)])
def test_a_grid_is_all_its_lanes(shape):
    r, c = shape
    rng = np.random.default_rng(r)
    inputs = {
        "a": rng.normal(size=(r, 1)),
        "b": rng.normal(size=(r, 1)),
        "q": rng.normal(size=(1, c)),
        "c": 2.0,
    }
    tape = taped()
    lanes = run(
        tape, {n: np.broadcast_to(x, shape).ravel() if np.ndim(x) else x for n, x in inputs.items()}, "numpy"
    )
    found = grids.run(tape, inputs, shape)
    for name, table in zip(tape.names, found, strict=True):
        np.testing.assert_allclose(table.ravel(), lanes[name], rtol=4e-16, err_msg=name)
    either = run_grid(tape, inputs, shape)
    for name in tape.names:
        np.testing.assert_allclose(either[name], lanes[name], rtol=4e-16, err_msg=name)


def test_inputs_that_hang_on_both_are_lanes_of_their_own():
    tape, q = taped(), np.arange(80.0).reshape(2, 40)
    a = np.array([[1.0], [2.0]])
    found = run_grid(tape, {"a": a, "b": 3.0, "q": q, "c": 0.5}, (2, 40))
    expected = np.sqrt((a * np.cos(q) - 3.0) ** 2 + 0.5)
    np.testing.assert_allclose(found["both"].reshape(2, 40), expected, rtol=1e-15)
