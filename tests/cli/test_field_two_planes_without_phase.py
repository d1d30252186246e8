"""Two planes without phase: an initial run, three trial runs in each plane, amplitudes alone (Everett 1987)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.cli.logs import polar
from tests.cli.measured import table
from tests.cli.printed import document
from tests.conftest import Dalembert

HEAD = "run,sensor,amplitude_um,trial_plane,trial_mass_g,trial_angle_deg"


def machine(seed: int, sensors: int = 2) -> tuple[Any, Any]:
    rng = np.random.default_rng(seed)
    alpha = rng.normal(size=(sensors, 2)) + 1j * rng.normal(size=(sensors, 2))
    return alpha, rng.uniform(2, 6, 2) * np.exp(1j * rng.uniform(0, 6, 2))


def sheet(alpha: Any, w: Any, runs: list[tuple[str, float, float]], turn: complex = 1) -> str:
    """Write the runs; each sensor's phase is its own, and no reading tells it."""
    rows, v0 = [], -alpha @ w
    for k, (plane, mass, angle) in enumerate(runs):
        on = np.array([mass * (plane == name) for name in "AB"]) * polar(1, angle)
        put = f"{plane},{mass},{angle}" if plane else ",,"
        rows += [f"{k},{s},{float(abs(v))!r},{put}" for s, v in enumerate(v0 + alpha @ on * turn)]
    return table(*rows, head=HEAD)


SEVEN = [("", 0, 0), *((plane, 2.5, angle) for plane in "AB" for angle in (0, 120, 240))]


def found(dalembert: Dalembert, text: str) -> Any:
    done = document(dalembert("field", "-", "--method", "four-run", "--json", stdin=text))
    (rotor,) = done["rotors"]
    return np.array([polar(c["mass_kg"], c["angle_deg"]) for c in rotor["corrections"]]) * 1e3, rotor


@pytest.mark.parametrize("seed", range(8))
def test_seven_runs_give_both_corrections(seed: int, dalembert: Dalembert) -> None:
    alpha, w = machine(seed)
    fix, rotor = found(dalembert, sheet(alpha, w, SEVEN))
    assert np.abs(fix - w).max() < 1e-8 * np.abs(w).max()
    assert rotor["residual_max"] < 1e-8 * np.abs(alpha @ w).max()
    assert [(m["sensor"], m["plane"]) for m in rotor["misfit"]] == [
        ("0", "A"),
        ("1", "A"),
        ("0", "B"),
        ("1", "B"),
    ]
    # the mirror image: every angle counted the other way
    mirrored = [(plane, mass, -angle) for plane, mass, angle in SEVEN]
    fix, _ = found(dalembert, sheet(alpha.conj(), w.conj(), mirrored))
    assert np.abs(fix - w.conj()).max() < 1e-8 * np.abs(w).max()


def test_a_third_sensor_takes_part(dalembert: Dalembert) -> None:
    alpha, w = machine(3, sensors=3)
    fix, _ = found(dalembert, sheet(alpha, w, SEVEN))
    assert np.abs(fix - w).max() < 1e-8 * np.abs(w).max()


def test_one_plane_in_each_run_and_three_runs_in_each_plane(dalembert: Dalembert) -> None:
    alpha, w = machine(1)
    few = dalembert("field", "-", "--method", "four-run", stdin=sheet(alpha, w, [*SEVEN[:3], *SEVEN[4:]]))
    assert few.returncode == 1
    assert "a third trial run in this plane" in few.stderr
    both = sheet(alpha, w, SEVEN).replace("6,0,", "6,0,").splitlines()
    both[-2:] = [line.replace("B,2.5,240", "A;B,2.5;2.5,0;240") for line in both[-2:]]
    done = dalembert("field", "-", "--method", "four-run", stdin="\n".join(both))
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "a mass in one plane" in done.stderr
