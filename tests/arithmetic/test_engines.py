"""The engines agree with each other and with fifty digits, at singular places, in threads, with a broken cache."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import threading
import warnings
from pathlib import Path
from random import Random

import mpmath
import numpy as np
import pytest

from dalembert.arithmetic import engines
from dalembert.arithmetic.choice import ENGINES
from dalembert.arithmetic.engines import blocks, llvm, run
from dalembert.arithmetic.recorded import RECORDED, Real, Recorder
from dalembert.arithmetic.tape import Tape

pytest.importorskip("llvmlite")


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("DALEMBERT_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("DALEMBERT_ENGINE", raising=False)
    monkeypatch.setattr(llvm, "_compiled", {})
    return tmp_path / "cache"


def random_tape(seed: int, length: int = 60) -> Tape:
    """Operations drawn at random, kept away from overflow."""
    random, recorder = Random(seed), Recorder()
    values: list[Real] = [recorder.input(name) for name in "abc"]
    while len(values) < length:
        x, y = random.choice(values), random.choice(values)
        kind = random.randrange(9)
        new = (
            x + y if kind == 0 else x - y * 0.5 if kind == 1 else x * y * 0.3 if kind == 2
            else x / (y * y + 1.0) if kind == 3 else RECORDED.sin(x) if kind == 4 else RECORDED.cos(x) if kind == 5
            else (x * x + 0.1).sqrt() if kind == 6 else RECORDED.atan2(x, y) if kind == 7
            else RECORDED.select(x - y, x, -y)
        )  # fmt: skip
        if isinstance(new, Real):
            values.append(new)
    outputs = {f"y{k}": v for k, v in enumerate(random.sample(values, 6))}
    return recorder.tape(
        {**outputs, "twice": values[-1], "again": values[-1], "minus": -values[-1], "k": 2.5}
    )


@pytest.mark.parametrize(
    "n", [7, 1025, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 3, 8, 9, 1000, 1024, 2500))]
)
@pytest.mark.parametrize("uniform", ["", "b", "ac", "abc"])
def test_engines_agree_for_any_count_of_lanes(n: int, uniform: str) -> None:
    rng = np.random.default_rng(n)
    inputs = {name: rng.normal() if name in uniform else rng.normal(size=n) for name in "abc"}
    for seed in range(3):
        tape = random_tape(seed, 25)
        tables = [np.asarray(run(tape, inputs, engine).table) for engine in ENGINES]
        for table in tables[1:]:
            # decisions fall alike in all lanes but those on the very edge
            np.testing.assert_allclose(table, tables[0], rtol=1e-12, atol=1e-14)


def test_two_vectors_in_turn_have_the_bits_of_one(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    inputs = {name: rng.normal(size=1003) for name in "abc"}
    inputs["a"][17], inputs["b"][18] = 1e300, 0.0
    for seed in range(5):
        tape = random_tape(seed)
        monkeypatch.setattr(llvm, "_compiled", {})
        in_turn = run(tape, inputs, "llvm").table
        monkeypatch.setattr(llvm, "_compiled", {})
        monkeypatch.setattr(llvm, "SHORT", 0)
        monkeypatch.setattr(llvm, "FORMAT", "one vector")
        np.testing.assert_array_equal(in_turn, run(tape, inputs, "llvm").table)
        monkeypatch.undo()


@pytest.mark.parametrize("engine", ENGINES)
def test_the_parts_of_a_complex_number_lie_one_beside_the_other(engine: str) -> None:
    recorder = Recorder()
    q, r = recorder.input("q"), recorder.input("r")
    x, y = r * RECORDED.cos(q), r * RECORDED.sin(q)
    tape = recorder.tape({"sum": x + y, "x": x, "y": y, "size": r, "dx": -y, "dy": x})
    for n in (1, 3, 8, 1030, 20_000):
        inputs = {"q": np.linspace(0, 7, n), "r": 2.0}
        plain = run(tape, inputs, engine)
        found = run(tape, inputs, engine, pairs=("x", "dx"))
        for name in tape.names:
            np.testing.assert_array_equal(found[name], plain[name])
        for pair in (("x", "y"), ("dx", "dy")):
            z = found.complex(*pair)
            assert z.dtype == complex
            assert np.shares_memory(z, found[pair[0]])
            np.testing.assert_array_equal(z, plain.complex(*pair))
            assert not np.shares_memory(plain.complex(*pair), plain[pair[0]])


def test_one_lane_of_floats_is_pythons_own_arithmetic() -> None:
    tape = random_tape(5)
    assert (
        run(tape, {"a": 0.3, "b": -0.7, "c": 1.9})["y0"]
        == run(tape, {"a": np.array([0.3]), "b": -0.7, "c": 1.9}, "python")["y0"]
    )


def ulps(found: np.ndarray, exact: list[mpmath.mpf]) -> float:
    return max(
        float(abs(mpmath.mpf(float(x)) - y) / mpmath.mpf(float(np.spacing(abs(float(y))))))
        for x, y in zip(found, exact, strict=True)
    )


def test_sine_cosine_and_arctangent_within_two_units_for_every_double() -> None:
    recorder = Recorder()
    x, y = recorder.input("x"), recorder.input("y")
    tape = recorder.tape({"sin": RECORDED.sin(x), "cos": RECORDED.cos(x), "atan2": RECORDED.atan2(y, x)})
    rng = np.random.default_rng(7)
    n = 400
    xs = np.concatenate(
        [
            rng.uniform(-8, 8, n),
            rng.uniform(-2e6, 2e6, n),
            # the doubles next to multiples of a right angle, and all sizes
            np.round(rng.uniform(-1e6, 1e6, n)) * (math.pi / 2),
            10.0 ** rng.uniform(-300, 308, n) * rng.choice([-1, 1], n),
            [6381956970095103.0 * 2.0**797, 5e-324, math.pi, 1e22],
        ]
    )
    ys = np.roll(xs, 17) * np.exp(rng.normal(size=len(xs)))
    found = run(tape, {"x": xs, "y": ys}, "llvm")
    with mpmath.workdps(700):
        for name, exact in (("sin", mpmath.sin), ("cos", mpmath.cos)):
            assert ulps(found[name], [exact(mpmath.mpf(float(v))) for v in xs]) <= 2
    with mpmath.workdps(40):
        exact_angles = [mpmath.atan2(float(b), float(a)) for a, b in zip(xs, ys, strict=True)]
        good = np.array([abs(float(v)) > 1e-300 for v in exact_angles])
        assert ulps(found["atan2"][good], [v for v, g in zip(exact_angles, good, strict=True) if g]) <= 2


def test_axes_signed_zeros_and_infinities_are_those_of_the_system() -> None:
    recorder = Recorder()
    x, y = recorder.input("x"), recorder.input("y")
    tape = recorder.tape({"atan2": RECORDED.atan2(y, x), "sin": RECORDED.sin(x), "cos": RECORDED.cos(x)})
    special = [0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, math.nan, 5e-324, -5e-324, 1e308]
    xs, ys = map(np.ravel, np.meshgrid(special, special))
    found = run(tape, {"x": xs, "y": ys}, "llvm")
    # sine and cosine of ±1 are the engine's own, to two units as above; of all else here they are exact, or the system's
    own = np.abs(xs) == 1
    with np.errstate(all="ignore"):
        for name, exact in (("atan2", np.arctan2(ys, xs)), ("sin", np.sin(xs)), ("cos", np.cos(xs))):
            same = ~own if name != "atan2" else np.ones(len(xs), bool)
            np.testing.assert_array_equal(found[name][same], exact[same])
            if name != "atan2":
                assert ulps(found[name][own], [getattr(mpmath, name)(float(v)) for v in xs[own]]) <= 2
            number = ~np.isnan(exact)
            np.testing.assert_array_equal(np.signbit(found[name][number]), np.signbit(exact[number]))


@pytest.mark.parametrize("engine", ENGINES)
def test_the_binade_of_a_number_is_exact(engine: str) -> None:
    recorder = Recorder()
    tape = recorder.tape({"b": RECORDED.binade(recorder.input("x"))})
    xs = np.array([3.0, -0.75, 1.0, np.nextafter(1.0, 0.0), 2.0**1000 * 1.9, math.inf, 0.0, -5e-324])
    exact = [2.0, 0.5, 1.0, 0.5, 2.0**1000, math.inf, 0.0, 0.0]
    np.testing.assert_array_equal(run(tape, {"x": xs}, engine)["b"], exact)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_singular_lane_is_infinite_or_nan_and_the_others_are_not_touched(engine: str) -> None:
    recorder = Recorder()
    x = recorder.input("x")
    tape = recorder.tape({"inverse": 1.0 / x, "root": x.sqrt()})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = run(tape, {"x": np.array([4.0, 0.0, -1.0])}, engine)
        one = run(tape, {"x": -1.0}, engine)
    np.testing.assert_array_equal(found["inverse"], [0.25, math.inf, -1.0])
    np.testing.assert_array_equal(found["root"], [2.0, 0.0, math.nan])
    assert math.isnan(one["root"])
    assert one["inverse"] == -1.0


def test_what_is_wrong_is_named() -> None:
    tape = random_tape(1)
    with pytest.raises(KeyError, match="b"):
        run(tape, {"a": 1.0, "c": 2.0})
    with pytest.raises(ValueError, match="different lengths: 2, 3"):
        run(tape, {"a": np.ones(2), "b": np.ones(3), "c": 1.0})
    with pytest.raises(ValueError, match="engine 'cuda': expected python, numpy, llvm"):
        run(tape, {"a": 1.0, "b": 1.0, "c": 1.0}, "cuda")


def test_the_size_of_the_work_chooses(monkeypatch: pytest.MonkeyPatch) -> None:
    tape = random_tape(2)
    monkeypatch.setattr(engines, "_done", {})
    assert engines.chosen(tape, 1) == "python"
    assert engines.chosen(tape, 1000) == "numpy"
    assert engines.chosen(tape, 10**8) == "llvm"
    monkeypatch.setenv("DALEMBERT_ENGINE", "llvm")
    run(tape, {"a": 1.0, "b": np.ones(9), "c": 1.0})
    assert llvm._compiled


@pytest.mark.parametrize("engine", ["numpy", "llvm"])
def test_threads_at_once_get_the_right_numbers(engine: str) -> None:
    tape = random_tape(3)
    rng = np.random.default_rng(0)
    work = [{name: rng.normal(size=5000) for name in "abc"} for _ in range(8)]
    alone = [run(tape, inputs, engine).table for inputs in work]
    found: list[object] = [None] * len(work)

    def ask(k: int) -> None:
        for _ in range(5):
            found[k] = run(tape, work[k], engine).table

    threads = [threading.Thread(target=ask, args=(k,)) for k in range(len(work))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for got, wanted in zip(found, alone, strict=True):
        np.testing.assert_array_equal(got, wanted)  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_very_long_tape_is_not_compiled() -> None:
    recorder = Recorder()
    x = recorder.input("x")
    y = x
    for k in range(60_000):
        y = y + x * (1.0 / (k + 3))
    tape = recorder.tape({"y": y})
    columns, out = [np.ones(10)], np.empty((1, 10))
    assert not llvm.run(tape, columns, out, (1, out.shape[1]))
    exact = 1 + math.fsum(1.0 / (k + 3) for k in range(60_000))
    for engine in ENGINES:
        np.testing.assert_allclose(run(tape, {"x": np.ones(10)}, engine)["y"], exact, rtol=1e-11)


def test_compiled_code_is_kept_and_a_damaged_file_is_made_anew(own_cache: Path) -> None:
    tape = random_tape(4)
    inputs = {name: np.linspace(0.1, 1, 20) for name in "abc"}
    first = run(tape, inputs, "llvm").table
    (file,) = own_cache.iterdir()
    whole = file.read_bytes()
    for damaged in (b"", whole[:100], whole[:-1] + bytes([whole[-1] ^ 1])):
        file.write_bytes(damaged)
        llvm._compiled.clear()
        np.testing.assert_array_equal(run(tape, inputs, "llvm").table, first)
        assert file.read_bytes() == whole
    assert [f.suffix for f in own_cache.iterdir()] == [".o"]


def test_a_cache_that_cannot_be_written_is_ignored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("DALEMBERT_CACHE", str(blocked / "cache"))
    inputs = {name: np.linspace(0.1, 1, 20) for name in "abc"}
    tape = random_tape(6)
    np.testing.assert_allclose(
        run(tape, inputs, "llvm").table, run(tape, inputs, "numpy").table, rtol=1e-12, atol=1e-14
    )


def test_where_no_code_can_be_made_numpy_does_the_work_and_says_so_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import llvmlite.binding as binding

    def refuse() -> None:
        raise OSError("forbidden")

    monkeypatch.setattr(binding, "initialize_native_target", refuse)
    monkeypatch.setattr(llvm, "_unusable", [])
    tape, inputs = random_tape(8), {name: np.linspace(0.1, 1, 20) for name in "abc"}
    with pytest.warns(RuntimeWarning, match="forbidden"):
        found = run(tape, inputs, "llvm").table
    np.testing.assert_array_equal(found, run(tape, inputs, "numpy").table)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(random_tape(9), inputs, "llvm")


def test_a_few_lanes_load_neither_llvmlite_nor_scipy() -> None:
    script = (
        "import sys\nfrom dalembert.arithmetic.recorded import *\nfrom dalembert.arithmetic.engines import run\n"
        "r = Recorder()\nrun(r.tape({'y': r.input('x') * 2.0}), {'x': 1.0})\n"
        "print(sorted({name.split('.')[0] for name in sys.modules} & {'llvmlite', 'scipy', 'pandas'}))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_blocks_do_uniform_work_once() -> None:
    recorder = Recorder()
    a, x = recorder.input("a"), recorder.input("x")
    tape = recorder.tape({"y": RECORDED.sin(a) * x, "a": a, "x": x})
    prepared = blocks.compiled(tape, frozenset("a"))
    assert (len(prepared.parts), prepared.slots, prepared.varying) == (1, 0, ["x"])
    found = run(tape, {"a": 0.5, "x": np.arange(3.0)}, "numpy")
    np.testing.assert_array_equal(found["y"], math.sin(0.5) * np.arange(3.0))
    np.testing.assert_array_equal(found["a"], [0.5] * 3)
    assert os.environ.get("DALEMBERT_ENGINE") is None


@pytest.mark.whole
@pytest.mark.parametrize("sign", [1, -1])
def test_sums_of_two_products_have_the_same_digits_whatever_was_recorded_before(sign: int) -> None:
    """Compiled code joins one product and the sum into one rounding: it took the one that was recorded later."""
    x = {name: np.random.default_rng(k).normal(size=100) for k, name in enumerate("abcd")}
    results = []
    for order in ("", "ab", "cd", "ba,dc", "cd,ab"):
        recorder = Recorder()
        for a, b in filter(None, order.split(",")):
            _ = recorder.input(a) * recorder.input(b)
        a, b, c, d = (recorder.input(name) for name in "abcd")
        if order == "cd":
            _ = sign * c * d + a * b, a * b - sign * c * d
        total = a * b + sign * c * d
        tape = recorder.tape({"sum": total, "turned": -total})
        results.append(run(tape, x, "llvm"))
    for of in results:
        assert np.array_equal(of["sum"], results[0]["sum"])
        assert np.array_equal(of["turned"], -of["sum"])
