"""Every engine against the others, against fifty digits within its bound, and against what 0.1.0 answered.

0.1.0 had no tape: its answers for the worked examples stand in `tests/data/answers_of_0_1_0.json`, three poses each,
every quantity that an evaluator knows, with all their digits. Python's and numpy's engines do the same operations in
the same order and differ by a sine's last place; LLVM's code joins products and sums into one rounding, so that what a
condition κ makes of a rounding is of that size there: 4e-15·κ of the largest value. (The prototype's Watt six-bar, 4e-13
off: it stands from −0.097 to 0.093 rad alone, where its accelerations grow without end, and the sweep's first and last
poses were 0.001 rad from there. `test_the_watt_six_bar_beside_its_limits` has those poses in fifty digits.)
"""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from benchmarks.stress.campaigns import replay
from benchmarks.stress.tapes import beside_fifty_digits, disagreement, exact, near_the_guess
from benchmarks.stress.topologies import generate
from dalembert.arithmetic.engines import run
from dalembert.arithmetic.engines.doubled import Answer, compared
from virtualwork import Mechanism
from virtualwork.describe import MechanismError
from virtualwork.formulas.kinematics import Angle
from virtualwork.formulas.tapes import taped

ANSWERS = json.loads(
    (Path(__file__).parents[1] / "data" / "answers_of_0_1_0.json").read_text(encoding="utf-8")
)
TOLERANCE = 4e-15


def example(name):
    """A worked example."""
    return Mechanism.from_toml(str(files("cli") / "examples" / name))


@pytest.mark.parametrize("engine", ["python", "numpy", pytest.param("llvm", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ANSWERS)
def test_the_answers_of_0_1_0(name, engine, monkeypatch) -> None:
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    monkeypatch.setenv("DALEMBERT_ENGINE", engine)
    m, known = example(name), ANSWERS[name]
    given = np.array(known["input"]).reshape(3, -1)
    found = m.evaluator(*known["values"])(given if len(m.inputs) > 1 else given[:, 0], 1.5, -0.7)
    condition = max([c for c in known["condition"] if c is not None], default=1.0)
    kinds = {
        key: (key.split(".")[0], key.split(".")[-1] if key.count(".") > 1 else "") for key in known["values"]
    }
    kinds |= {key: ("force", "") for key in kinds if key.startswith(("effort", "reactions"))}
    largest = dict.fromkeys(kinds.values(), 0.0)
    for key, values in known["values"].items():
        largest[kinds[key]] = max(largest[kinds[key]], *(abs(v) for v in values if v is not None), 0.0)
    for key, values in known["values"].items():
        true = np.array([np.nan if v is None else v for v in values])
        value = np.ravel(found[key])
        if key.startswith("reactions"):
            # in poses that do not stand 0.1.0 said that a joint force has no x, but y = 0
            true = np.where(
                np.isnan(true.reshape(3, 2)).any(axis=1, keepdims=True), np.nan, true.reshape(3, 2)
            ).ravel()
        assert (np.isnan(value) == np.isnan(true)).all(), key
        off = float(np.nanmax(np.abs(value - true), initial=0.0))
        assert off <= TOLERANCE * condition * largest[kinds[key]], key


@pytest.mark.parametrize("seed", [2, 11])
def test_the_engines_and_fifty_digits_on_some_mechanism(seed) -> None:
    rng = np.random.default_rng(seed)
    motion = near_the_guess(generate(seed).mechanism, rng)
    apart, condition = disagreement(motion, ("python", "numpy"))
    assert apart <= TOLERANCE * condition
    pairs = beside_fifty_digits(motion, rng, ("python", "numpy"))
    assert pairs
    assert all(error <= bound for error, bound in pairs)


@pytest.mark.slow
@pytest.mark.parametrize(("engine", "count"), [("numpy", 150), ("llvm", 20)])
def test_the_engines_agree_on_mechanisms_of_any_topology(engine, count) -> None:
    """The first of a thousand: `python -m benchmarks stress` goes on."""
    if engine == "llvm":
        pytest.importorskip("llvmlite")
    rng, compared = np.random.default_rng(5), 0
    for seed in range(count):
        try:
            found = disagreement(near_the_guess(generate(seed).mechanism, rng), ("python", engine))
        except MechanismError:
            continue
        if found is not None:
            apart, condition = found
            assert apart <= TOLERANCE * (condition if engine == "llvm" else 1.0), seed
            compared += 1
    assert compared > 0.75 * count


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tapes of any topology", "tapes of four-bars"])
def test_the_tape_beside_fifty_digits(name) -> None:
    pairs = [pair for seed in range(100) for pair in replay(name, seed)]
    assert len(pairs) > 400
    held = np.mean([error <= bound for error, bound in pairs])
    assert held >= 0.999


def test_the_watt_six_bar_beside_its_limits() -> None:
    """The answers of 0.1.0, of the tape and those in fifty digits: the poses next to the limits differ by their condition."""
    m = example("watt-six-bar/watt.toml")
    q = np.linspace(-0.3, 0.3, 101)
    motion = m.motion(q, 3.0)
    stands = np.flatnonzero(motion.assembled)
    assert q[stands[[0, -1]]] == pytest.approx([-0.096, 0.09])
    keys = tuple(Angle(link, order) for link in m.links for order in range(3))
    lanes = motion.poses
    tape = taped(motion.assembly, lanes.recording, keys)
    given = lanes.entering(tape.inputs)
    found = run(tape, given, "numpy")
    estimates, _ = compared(tape, given, {Answer((name,)): [found[name]] for name in tape.names})
    bounds = dict(zip(tape.names, estimates, strict=True))
    apart = {}
    for i in stands:
        truth = exact(tape, given, i)
        for key in keys:
            (name,) = key.names
            value, bound = (np.broadcast_to(x, motion.n) for x in (found[name], bounds[name]))
            assert abs(value[i] - truth[name]) <= bound[i], (key, q[i])
            scale = np.nanmax(np.abs(value[stands]))
            apart[i] = max(apart.get(i, 0.0), float(abs(value[i] - truth[name]) / scale) if scale else 0.0)
    # 1e-13 of the largest acceleration next to the limits, its last places elsewhere
    ends = apart[stands[0]], apart[stands[-1]]
    assert min(ends) > 5e-14
    assert max(apart[i] for i in stands[2:-2]) < 1e-14
