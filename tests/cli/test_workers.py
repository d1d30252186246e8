"""`--workers` of rotors and machines: the same bytes, the same refusals."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from balancing import CoincidentPlanes, correct
from balancing.correction import PART


def runs(machines, seed=0):
    """Two sensors, two planes: an initial and two trial runs of each machine."""
    rng = np.random.default_rng(seed)
    lines = ["rotor,run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg"]
    for rotor in range(1, machines + 1):
        alpha = rng.normal(size=(2, 2, 2)) @ [1, 1j] * 4 + 8 * np.eye(2)
        initial = rng.normal(size=(2, 2)) @ [1, 1j] * 30
        for run, plane in (("0", None), ("A", 0), ("B", 1)):
            read = initial if plane is None else initial + alpha[:, plane] * 5
            trial = ",," if plane is None else f"{'AB'[plane]},5,0"
            for sensor, v in enumerate(read, 1):
                lines.append(
                    f"{rotor},{run},{sensor},{float(abs(v))!r},{float(np.degrees(np.angle(v))) % 360!r},{trial}"
                )
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    "asked",
    [
        ("--objective", "minimax", "--max-mass", "4g"),
        pytest.param(
            ("--max-mass", "3g", "--reading-error", "2%,2deg", "--monte-carlo", "40"), marks=pytest.mark.slow
        ),
        ("--reading-error", "2%,2deg"),
    ],
)
def test_machines_of_several_processes_have_the_digits_of_one(dalembert, asked):
    table = runs(4)
    alone = dalembert("field", "-", *asked, "--json", stdin=table)
    shared = dalembert("field", "-", *asked, "--json", "--workers", "2", stdin=table)
    assert alone.returncode == shared.returncode == 0, alone.stderr
    assert shared.stdout == alone.stdout
    assert shared.stderr == alone.stderr


def test_a_refusal_names_the_machine_whoever_finds_it(dalembert):
    call = ("field", "-", "--max-mass", "0.1g", "--max-residual", "2um")
    alone = dalembert(*call, stdin=runs(3))
    shared = dalembert(*call, "--workers", "2", stdin=runs(3))
    assert alone.returncode == shared.returncode == 1
    assert "rotor 1: no corrections" in alone.stderr
    assert shared.stderr == alone.stderr


def test_rotors_of_several_processes_have_the_digits_of_one(dalembert, tmp_path):
    n = PART + 100
    rng = np.random.default_rng(1)
    lines = [
        f"{i // 2},{mass!r},10,{angle!r},{z!r}"
        for i, (mass, angle, z) in enumerate(zip(*rng.random((3, 2 * n)).tolist(), strict=True))
    ]
    (tmp_path / "r.csv").write_text("\n".join(["rotor,mass_g,radius_mm,angle_deg,z_mm", *lines]) + "\n")
    call = ("balance", "r.csv", "--plane", "A:0mm:20mm", "--plane", "B:9mm:20mm")
    for name, more in (("alone.csv", ()), ("shared.csv", ("--workers", "2"))):
        assert dalembert(*call, *more, "-o", name).returncode == 0
    assert (tmp_path / "shared.csv").read_bytes() == (tmp_path / "alone.csv").read_bytes()


def test_rotors_go_to_any_executor(monkeypatch):
    monkeypatch.setattr("balancing.correction.PART", 7)
    rng = np.random.default_rng(2)
    u, z = rng.normal(size=(40, 3, 2)) @ [1, 1j], rng.normal(size=(40, 3))
    with ThreadPoolExecutor(2) as pool:
        shared = correct(u, z, [0.0, 1.0, 3.0], executor=pool)
        with pytest.raises(CoincidentPlanes):
            correct(u, z, [1.0, 1.0], executor=pool)
    np.testing.assert_array_equal(shared.unbalance, correct(u, z, [0.0, 1.0, 3.0]).unbalance)
    # what was worked out elsewhere balances: Σ U + Σ W = 0
    np.testing.assert_allclose(u.sum(axis=1), -shared.unbalance.sum(axis=1), atol=1e-14)
