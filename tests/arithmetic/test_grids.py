"""A tape over a grid gives every row with every column what it gives one lane."""

from __future__ import annotations

import numpy as np
import pytest

from dalembert.arithmetic.choice import ENGINES
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
    found = np.empty((len(tape.outputs), *shape))
    grids.run(tape, [np.asarray(inputs[name]) for name in tape.inputs], shape, found)
    for name, table in zip(tape.names, found, strict=True):
        np.testing.assert_allclose(table.ravel(), lanes[name], rtol=4e-16, err_msg=name)
    for name, table in zip(tape.names, run_grid(tape, inputs, shape), strict=True):
        np.testing.assert_allclose(table.ravel(), lanes[name], rtol=4e-16, err_msg=name)


@pytest.mark.parametrize("columns", [1, 2, 5, 31, 40])
def test_a_row_has_the_same_bits_however_many_there_are(monkeypatch, columns):
    monkeypatch.setenv("DALEMBERT_ENGINE", "numpy")
    recorder = Recorder()
    a, q, same = (recorder.input(name) for name in ("a", "q", "same"))
    turned = RECORDED.sin(same) * RECORDED.atan2(a, same) + RECORDED.cos(q + RECORDED.sqrt(same))
    tape = recorder.tape({"both": turned, "same": RECORDED.cos(same), "none": 1.0 / (same - abs(same))})
    a, q = np.random.default_rng(1).normal(size=(5000, 1)), np.linspace(0.0, 3.0, columns)[None]
    for number in np.random.default_rng(2).uniform(0.1, 50.0, 20):
        whole = run_grid(tape, {"a": a, "q": q, "same": number}, (5000, columns))
        few = run_grid(tape, {"a": a[:7], "q": q, "same": number}, (7, columns))
        np.testing.assert_array_equal(np.array(few), np.array(whole)[:, :7])


@pytest.mark.parametrize("engine", ENGINES)
def test_inputs_that_hang_on_both_are_lanes_of_their_own(monkeypatch, engine):
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    tape, q = taped(), np.arange(80.0).reshape(2, 40)
    a = np.array([[1.0], [2.0]])
    found = run_grid(tape, {"a": a, "b": 3.0, "q": q, "c": 0.5}, (2, 40))[tape.rows["both"]]
    expected = np.sqrt((a * np.cos(q) - 3.0) ** 2 + 0.5)
    np.testing.assert_allclose(found, expected, rtol=2e-15)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    "shape", [(4, 3), (4, 1), (3, 8), (5, 45), (2, 20_001), (40, 360), (5000, 1), (3000, 2)]
)
def test_outputs_go_to_their_place_and_a_test_says_one_thing_of_a_row(monkeypatch, engine, shape):
    r, c = shape
    recorder = Recorder()
    a, q, p = (recorder.input(name) for name in "aqp")
    x, y = a * RECORDED.cos(q), a * RECORDED.sin(q) + p
    root = RECORDED.sqrt(x)
    tape = recorder.tape({"x": x, "y": y, "both": x * y, "clear": root + 1.0, "row": a, "far": x + 1e3})
    angle = np.linspace(-1.5, 1.5, c)[None]
    # the cosine of one row is negative somewhere, and its root not a number
    size = np.where(np.arange(r) == r // 2, -1.0, np.arange(r) + 1.0)[:, None]
    z, both, tests = np.empty((r, c), complex), np.empty((r, c)), [np.empty(r, bool) for _ in range(3)]
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    given = {"a": size, "q": angle, "p": np.linspace(0, 1, r * c).reshape(shape)}
    run_grid(tape, given, shape, [z.real, z.imag, both, *tests])
    expected = size * np.exp(1j * angle) + 1j * given["p"]
    np.testing.assert_allclose(z, expected, rtol=1e-15, atol=1e-15 * r)
    np.testing.assert_allclose(both, z.real * z.imag, rtol=1e-15)
    assert tests[0].tolist() == tests[1].tolist() == (size[:, 0] > 0).tolist()
    assert tests[2].all()
