"""`dalembert bench` measures what it says."""

from __future__ import annotations

import json
import math
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cli.bench import measure, page
from cli.bench.measure import Measurement
from cli.commands.bench import DOMAINS
from cli.errors import DataError

Dalembert = Callable[..., subprocess.CompletedProcess[str]]

EPS = 2.0**-52


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
    calls = [ms[0].kernels or 0 for ms in of("skipping").values()]
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


def test_rotation() -> None:
    found = of("rotation")
    for (work, method), ms in found.items():
        for m in ms:
            if method == "closed form" and m.error is not None:
                turned = 2 * math.pi * m.size if work == "attitude after many revolutions" else 20.0
                assert m.error <= 2 * EPS * turned, work
    integrated = [
        ms for (work, method), ms in found.items() if work.startswith("attitude to") and "DOP853" in method
    ]
    assert len(integrated) == 4
    for ms in integrated:  # tolerances of 1e-6 and 1e-12
        loose, tight = (m.error or 0.0 for m in ms)
        assert tight <= loose <= 1e-4
        assert tight <= 1e-9


def test_commands() -> None:
    found = of("commands")
    assert all(ms[0].ratio is not None and ms[0].floor for ms in found.values())


def test_the_command_and_its_page(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text("# Here\n<!-- bench:rotors -->\nold\n<!-- end -->\nkept\n")
    done = dalembert(
        "bench", "rotors", "--quick", "--docs", "page.md", "--plot", "bench.png", "-o", "results.json"
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
    from cli.bench import peers

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
    page.check(Path(__file__).parents[2] / "docs" / "benchmarks.md", ["aims", *DOMAINS])


def test_a_page_without_marks(tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text("nothing")
    with pytest.raises(DataError, match="expected the marks <!-- bench:rotors -->"):
        page.check(tmp_path / "page.md", ["rotors"])


def test_an_unknown_domain(dalembert: Dalembert) -> None:
    done = dalembert("bench", "rotor")
    assert done.returncode == 2
    assert "did you mean 'rotors'?" in done.stderr
