"""`python -m benchmarks` measures what it says."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchmarks import page
from benchmarks.speed import DOMAINS, measure
from benchmarks.speed.measure import Measurement
from dalembert.errors import DataError

Benchmarks = Callable[..., subprocess.CompletedProcess[str]]
ROOT = Path(__file__).parents[1]

EPS = 2.0**-52


@pytest.fixture
def benchmarks(tmp_path: Path) -> Benchmarks:
    """Run `python -m benchmarks ARGS` in an empty folder, on the program as it is installed."""
    script = f"import runpy, sys; sys.path.append({str(ROOT)!r}); "
    script += "runpy.run_module('benchmarks', run_name='__main__', alter_sys=True)"

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", script, *map(str, arguments)],
            capture_output=True,
            text=True,
            cwd=tmp_path,
            check=False,
        )

    return run


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measure, "patience", 0.0)


def of(domain: str) -> dict[tuple[str, str], list[Measurement]]:
    """Measure a domain in quick sizes; each method's measurements by work and method."""
    from importlib import import_module

    found: dict[tuple[str, str], list[Measurement]] = {}
    for m in import_module(DOMAINS[domain][0]).measure(quick=True):
        assert m.domain == domain
        assert m.ns > 0
        assert m.units > 0
        assert m.error is None or math.isfinite(m.error)
        found.setdefault((m.work, m.method), []).append(m)
    return found


def errors(found: dict[tuple[str, str], list[Measurement]], method: str = "") -> list[float]:
    return [m.error for (_, name), ms in found.items() for m in ms if m.error is not None and method in name]


@pytest.mark.slow
def test_motion_in_time() -> None:
    found = of("in-time")
    assert max(errors(found)) < 1e-6
    assert {"Andrews' mechanism, 0.03 s, accuracy 3e-10"} < {work for work, _ in found}


def test_mechanisms() -> None:
    found = of("mechanisms")
    for (work, method), ms in found.items():
        if method.startswith("closed form") or "torque" in work or "pose" in work:
            assert all(m.error is None or m.error <= 20 * EPS for m in ms), (work, method)
    newton = [
        found["Four-bar: every angle, closed form against Newton", f"Newton, {k} steps"] for k in (1, 2, 3, 4)
    ]
    first, second, third, fourth = (ms[0].error or 0.0 for ms in newton)
    assert 1e-4 < first < 0.1
    assert second < 10 * first**2  # it converges with the square
    assert third < 10 * second**2
    assert fourth <= 20 * EPS
    whole = found["four-bar: cost against poses", "one call"]
    assert [m.size for m in whole] == [10**k for k in range(6)]
    assert whole[-1].bytes is not None
    assert whole[-1].bytes < 200 * whole[-1].size  # the answer is 16 bytes a pose
    # each of n four-bars takes over the angle of the one before
    chain = found["chain of four-bars: cost against links", "moved, 946 poses"]
    assert all((m.error or 1.0) <= 4 * m.size**2 * EPS for m in chain)


def test_skipping() -> None:
    calls = [ms[0].operations or 0 for ms in of("skipping").values()]
    assert calls[0] == max(calls)
    everything, _, torque, no_gravity, at_rest, one_force, velocity, foot, pin = calls
    assert everything > torque > no_gravity > at_rest > one_force
    assert velocity > foot > pin > 0
    # a closed form, two placements and what drives them: arm and leg are not touched
    assert pin < 0.7 * foot


def test_field() -> None:
    found = of("field")
    work = "least squares, 24 sensors × 8 planes"
    for m in found[work, "QR, the library's"]:
        assert m.condition is not None
        assert (m.error or 0.0) <= 4 * m.condition * EPS
    # the warning: it loses digits with the square of the condition
    assert (found[work, "normal equations, a warning"][-1].error or 0.0) > 1e-3
    assert all(e <= 1e-12 for e in errors(found, "the largest residual"))
    assert all(e <= 1e-9 for e in errors(found, "dual bound"))
    assert all(e <= 1e-12 for e in errors(found, "coefficients and corrections"))


def test_bodies() -> None:
    found = of("bodies")
    assert all(e <= 16 * EPS for e in errors(found, "the library's"))
    assert errors(found, "stored at the centre of mass") == [0.0]
    assert errors(found, "parallel axes, twice")[0] > 1e-6


@pytest.mark.slow
def test_rotation() -> None:
    found = of("rotation")
    for (work, method), ms in found.items():
        for m in ms:
            if method == "closed form" and m.error is not None:
                # radians, or how far |ω| = 3.2 turns the top
                turned = 2 * math.pi * m.size if work == "attitude after many revolutions" else 20.0
                turned *= 3.2 if work.startswith("heavy top") else 1
                assert m.error <= 2 * EPS * turned, work
    integrated = [
        ms for (work, method), ms in found.items() if work.startswith("attitude to") and "DOP853" in method
    ]
    assert len(integrated) == 4
    for ms in integrated:  # tolerances of 1e-6 and 1e-12
        loose, tight = (m.error or 0.0 for m in ms)
        assert tight <= loose <= 1e-4
        assert tight <= 1e-9


@pytest.mark.slow
def test_commands() -> None:
    found = of("commands")
    assert all(ms[0].ratio is not None and ms[0].floor for ms in found.values())


@pytest.mark.slow
def test_the_command_and_its_page(benchmarks: Benchmarks, tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text("# Here\n<!-- bench:rotors -->\nold\n<!-- end -->\nkept\n")
    done = benchmarks(
        "speed", "rotors", "--quick", "--docs", "page.md", "--plot", "bench.png", "-o", "results.json"
    )
    assert done.returncode == 0, done.stderr
    measured = json.loads((tmp_path / "results.json").read_text())["measurements"]
    errors = {m["method"]: m["error"] for m in measured if m["work"].startswith("nearly balanced")}
    assert errors["compensated"] <= 1e-15 < 1e-8 < errors["plain sums"]
    assert (tmp_path / "bench.png").read_bytes().startswith(b"\x89PNG")
    text = (tmp_path / "page.md").read_text()
    assert "old" not in text
    assert text.startswith("# Here\n<!-- bench:rotors -->\n*Measured ")
    assert text.endswith("<!-- end -->\nkept\n")
    assert "| compensated | 10,000 |" in text
    assert (tmp_path / "pictures" / "bench-rotors.svg").read_text().startswith("<?xml")


def test_peers_that_are_missing_or_break_do_not_end_the_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from benchmarks import peers

    def broken(quick: bool) -> Any:
        yield Measurement("rotors", "work", "how", 1, 1.0, 1.0)
        raise ZeroDivisionError("theirs")

    def works(quick: bool) -> Any:
        yield Measurement("rotors", "work", "how", 1, 1.0, 1.0)

    tried = (("no_such_package_here", broken), ("numpy", broken), ("scipy", works))
    monkeypatch.setitem(peers.PEERS, "rotors", tried)
    found = list(peers.measure("rotors", quick=True))
    assert [(m.peer, m.method.split()[0]) for m in found] == [(True, "scipy")]
    said = capsys.readouterr().err
    assert "numpy failed: ZeroDivisionError: theirs" in said
    assert "peers not installed, left out: no_such_package_here" in said


def test_the_pages_have_a_place_for_every_domain() -> None:
    page.check(ROOT / "docs" / "quality" / "benchmarks.md", ["aims", "stress", *DOMAINS])


def test_a_page_without_marks(tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text("nothing")
    with pytest.raises(DataError, match="expected the marks <!-- bench:rotors -->"):
        page.check(tmp_path / "page.md", ["rotors"])


def test_an_unknown_domain(benchmarks: Benchmarks) -> None:
    done = benchmarks("speed", "rotor")
    assert done.returncode == 2
    assert "did you mean 'rotors'?" in done.stderr


@pytest.mark.slow
def test_campaigns_and_their_table(benchmarks: Benchmarks, tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- bench:stress -->\n<!-- end -->\nafter\n")
    names = ("rotor scales", "nearly flat masses")
    done = benchmarks("stress", *names, "--time", "2s", "--seed", "50", "--docs", "page.md", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["campaigns"]
    assert [row["campaign"] for row in found] == list(names)
    assert all(row["share_bounded"] == 1 and 0 < row["worst_error_over_estimate"] < 1 for row in found)
    table = page.read_text().split("\n\n")[1].splitlines()
    assert [line.split(" | ")[0] for line in table[2:4]] == [f"| {name}" for name in names]
    # one case again, by its seed
    (again,) = json.loads(benchmarks("stress", names[0], "--seed", found[0]["worst_seed"], "--json").stdout)[
        "campaigns"
    ]
    assert again["trials"] == 1
    assert again["worst_error_over_estimate"] == found[0]["worst_error_over_estimate"]


@pytest.mark.slow
def test_damaged_inputs(benchmarks: Benchmarks) -> None:
    done = benchmarks("fuzz", "24", "--seed", "7", "--workers", "2", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["first_seed"], found["inputs"], found["faults"]) == (7, 24, [])
    rows = found["commands"]
    assert sum(row["inputs"] for row in rows) == 24
    for row in rows:
        assert row["inputs"] == row["results"] + row["data_errors"] + row["usage_errors"]
        assert row["slowest_seed"] in range(7, 31)
    # one of them again, by its seed
    seed = rows[0]["slowest_seed"]
    done = benchmarks("fuzz", "1", "--seed", seed)
    assert done.stdout.splitlines()[1].startswith(f"{rows[0]['command']},1,")


def test_a_damaged_input_is_the_same_each_time() -> None:
    from benchmarks.fuzz.trial import replayed

    assert all(replayed(seed) == replayed(seed) for seed in range(40))
    assert len({str(replayed(seed)) for seed in range(40)}) == 40


STUBBORN = """
import math, os
from benchmarks.fuzz.trial import Outcome

def case(seed):
    if seed == 1:
        math.factorial(10**8)  # in compiled code: only another process can end it
    elif seed == 2:
        return Outcome("c", ["x"], 0.0, str(len(bytearray(3 * 2**30))), None)
    elif seed == 3:
        os.abort()
    elif seed == 4:
        import time
        time.sleep(100)
    return Outcome("c", ["x"], 0.0, "result", None)
"""


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="limits as on Linux")
@pytest.mark.slow
def test_limits_are_held_from_outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A loop in compiled code, more than 1 GiB, a crash, an endless wait: each a fault, and the run goes on."""
    from importlib import import_module

    from benchmarks.fuzz import workers as fuzz_workers

    (tmp_path / "stubborn.py").write_text(STUBBORN)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(fuzz_workers, "LONGEST", 1.0)
    case = import_module("stubborn").case
    found = dict(fuzz_workers.run(0, 6, case=case, patience=8.0))
    assert sorted(found) == list(range(6))
    assert found[0].fault is found[5].fault is None
    assert "killed after" in str(found[1].fault)
    assert found[1].seconds > 1.0
    assert "1 GiB of memory" in str(found[2].fault)
    assert "SIGABRT" in str(found[3].fault)
    assert "killed after" in str(found[4].fault)


@pytest.mark.parametrize(
    ("status", "out", "err", "files", "said"),
    [
        (0, "x\n", "", {}, None),
        (0, "", "", {}, "nothing shown"),
        (0, "{\n \"a\": NaN}", "", {}, "NaN in it"),
        (0, "x\n", "x.py:3: RuntimeWarning: overflow", {}, "stray warning"),
        (1, "", "dalembert: t.csv: found 'x', expected a number\n", {}, None),
        (1, "", "dalembert: \n", {}, "data error of 1 lines"),
        (1, "", "dalembert: one\ntwo and three\n", {}, "data error of 2 lines"),
        (1, "", "dalembert: t.csv: \x1b[31m found\n", {}, "control characters"),
        (1, "half", "dalembert: t.csv: found 'x', expected a number\n", {}, "error after output"),
        (1, "", "dalembert: t.csv: found 'x', expected a number\n", {"o.csv": b"1"}, "error after writing o.csv"),
        (1, "", "dalembert: not enough memory for this input\n", {}, "not enough memory"),
        (1, "WRONG\n", "", {}, None),
        (2, "", "Usage: x\n\nError: Invalid value for --at: 'x'\n", {}, None),
        (2, "", "Usage: x\n", {}, "usage error that says nothing"),
        (0, "x\n", "", {".o.csv.7.part": b"1"}, "left .o.csv.7.part"),
        (3, "", "", {}, "status 3"),
    ],
)  # fmt: skip
def test_what_is_a_fault(
    status: int,
    out: str,
    err: str,
    files: dict[str, bytes],
    said: str | None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from benchmarks.fuzz.cases import Case
    from benchmarks.fuzz.trial import Ended, judge

    monkeypatch.chdir(tmp_path)
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    _, fault = judge(Case("balance", ["balance"], {}), Ended(status, out, err))
    assert fault is None if said is None else said in str(fault)


def installed(folder: Path, answer: str) -> Path:
    """Write a stand-in for an installation's `dalembert` with one worked example."""
    script = folder / answer
    script.write_text(
        '#!/bin/sh\n[ "$2" ] || { echo "one   the only example"; exit; }\n'
        f'[ "$1" = examples ] && {{ echo "run:"; echo "  dalembert solve x --plot p.svg"; exit; }}\necho "$*"; echo {answer}\n'
    )
    script.chmod(0o755)
    return script


def test_outputs_are_compared_byte_for_byte(tmp_path: Path) -> None:
    from benchmarks.same_outputs import compare

    old, new = (str(installed(tmp_path, answer)) for answer in ("fourty", "forty"))
    assert compare(old, old) == (5, [])
    compared, found = compare(old, new)
    assert compared == 5
    assert len(found) == 4
    assert found[1] == "one: dalembert solve x --json\n  line 2\n  old fourty\n  new forty"


def test_the_files_that_a_sweep_passes() -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "benchmarks" / "trace_passes.py")],
        capture_output=True,
        text=True,
        check=True,
    )
    head, *rows = done.stdout.splitlines()
    counted = {name: [int(x) for x in rest] for name, *rest in (row.split(",") for row in rows)}
    assert head == "package,files,called,changes"
    assert {"cli", "virtualwork", "all"} <= set(counted)
    files, called, changes = counted["virtualwork"]
    assert 2 < called <= files < changes
    assert counted["all"][0] == sum(row[0] for name, row in counted.items() if name != "all")
