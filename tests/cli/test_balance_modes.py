"""`dalembert balance --modes`: the table of mode shapes, what vanishes, what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.logs import polar
from tests.conftest import Dalembert

ROTOR = "name,unbalance_g_mm,angle_deg,z_mm\ndisc,100,30,400\nhub,50,200,725\n"
PLANES = ("--plane", "A:250mm:50mm", "--plane", "B:500mm:50mm", "--plane", "C:750mm:50mm")
Z = np.linspace(0, 1000, 41)
U = np.array([polar(100, 30), polar(50, 200)])


def shape(k: int, z: Any) -> Any:
    return np.sin(k * np.pi * np.asarray(z) / 1000)


def wide(count: int = 3) -> str:
    rows = [",".join([f"{z:g}", *(f"{shape(k, z):.15f}" for k in range(1, count + 1))]) for z in Z]
    return "\n".join(["z_mm," + ",".join(f"mode_{k}" for k in range(1, count + 1)), *rows]) + "\n"


def corrections(done: Any, key: str = "corrections") -> Any:
    assert done.returncode == 0, done.stderr
    (rotor,) = json.loads(done.stdout)["rotors"]
    return np.array([polar(c["unbalance_kg_m"], c["angle_deg"]) for c in rotor[key]]) * 1e6, rotor


def test_the_modal_sums_of_a_uniform_shaft(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "modes.csv").write_text(wide())
    planes = np.array([250, 500, 750])
    expected = -0.5 * sum(shape(k, planes) * (U @ shape(k, [400, 725])) for k in (1, 2, 3))
    done = dalembert("balance", "-", *PLANES, "--modes", "modes.csv", "--json", stdin=ROTOR)
    found, rotor = corrections(done)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    for k, mode in enumerate(rotor["modes"], 1):
        assert mode["mode"] == str(k)
        assert mode["initial"]["modal_unbalance_kg_m"] * 1e6 == pytest.approx(
            abs(U @ shape(k, [400, 725])), rel=1e-6
        )
        assert mode["residual"]["modal_unbalance_kg_m"] == 0
    # a row for each mode and station; a part of the modes
    long = "mode,shape,z_m\n" + "".join(f"{k},{shape(k, z):.15f},{z / 1000}\n" for k in (1, 2, 3) for z in Z)
    (tmp_path / "long.csv").write_text(long)
    same, _ = corrections(dalembert("balance", "-", *PLANES, "--modes", "long.csv", "--json", stdin=ROTOR))
    assert np.abs(same - found).max() < 1e-9
    first, rotor = corrections(
        dalembert("balance", "-", *PLANES, "--modes", "modes.csv", "--mode-count", "1", "--json", stdin=ROTOR)
    )
    assert len(rotor["modes"]) == 1
    assert shape(1, planes) @ first == pytest.approx(-(U @ shape(1, [400, 725])), rel=1e-9)


def test_force_and_couple_vanish_too(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "modes.csv").write_text(wide(1))
    found, rotor = corrections(
        dalembert("balance", "-", *PLANES, "--modes", "modes.csv", "--rigid", "--json", stdin=ROTOR)
    )
    planes = np.array([250, 500, 750])
    system = np.array([np.ones(3), planes, shape(1, planes)])
    right = -np.array([U.sum(), U @ [400, 725], U @ shape(1, [400, 725])])
    assert found == pytest.approx(np.linalg.solve(system, right), rel=1e-6)
    assert rotor["residual"]["static_unbalance_kg_m"] < 1e-15
    assert rotor["residual"]["couple_unbalance_kg_m2"] < 1e-16
    # rounded masses leave modal sums, and the table says how much
    rough = dalembert(
        "balance", "-", *PLANES, "--modes", "modes.csv", "--round-mass", "0.1g", "--json", stdin=ROTOR
    )
    assert json.loads(rough.stdout)["rotors"][0]["modes"][0]["residual"]["modal_unbalance_kg_m"] > 1e-8


@pytest.mark.whole
@pytest.mark.parametrize(
    ("modes", "options", "status", "says"),
    [
        (wide(), PLANES[:4], 1, "need at least 3 planes, found 2"),
        (wide(2), ("--plane", "A:500mm:9mm", "--plane", "B:1000mm:9mm"), 1, "do not act on mode 2"),
        (wide(), (*PLANES[:4], "--plane", "C:1500mm:9mm"), 1, "a plane stands at 1.5 m"),
        (wide().replace("0.", "x.", 1), PLANES, 1, "found 'x."),
        ("z_mm,mode_1\n0,0\n0,1\n", PLANES, 1, "stands twice at z = 0 m"),
        ("z_mm,mode_1\n0,0\n1000,0\n", PLANES, 1, "zero everywhere"),
        ("z_mm\n0\n", PLANES, 1, "a column for each mode"),
        ("x,mode_1\n0,0\n", PLANES, 1, "z_m"),
        (wide(), (*PLANES, "--mode-count", "4"), 2, "has 3 modes"),
    ],
)
def test_what_is_refused(
    modes: str, options: tuple[str, ...], status: int, says: str, dalembert: Dalembert, tmp_path: Path
) -> None:
    (tmp_path / "modes.csv").write_text(modes)
    done = dalembert("balance", "-", *options, "--modes", "modes.csv", "--json", stdin=ROTOR)
    assert done.returncode == status
    assert done.stdout == ""
    assert says in done.stderr
    assert status == 2 or done.stderr.count("\n") == 1


def test_its_options_need_the_table(dalembert: Dalembert) -> None:
    for option in (("--rigid",), ("--mode-count", "2")):
        done = dalembert("balance", "-", *PLANES, *option, stdin=ROTOR)
        assert done.returncode == 2
        assert "needs --modes" in done.stderr


def test_the_worked_solution_of_the_modes(dalembert: Dalembert, tmp_path: Path) -> None:
    """Σ U·φ of each mode, the shapes at the planes, corrections with which both sums vanish; with force and couple too."""
    (tmp_path / "modes.csv").write_text(wide())
    planes = (*PLANES, "--plane", "D:900mm:50mm", "--plane", "E:100mm:50mm")
    for further, conditions in (((), 3), (("--rigid",), 5), (("--mode-count", "1"), 1)):
        words = ("balance", "-", *planes, "--modes", "modes.csv", *further)
        done = dalembert(*words, "--steps", "--json", stdin=ROTOR)
        made, _ = corrections(done)
        way = json.loads(done.stdout)["way"]
        assert [t["topic"] for t in way] == ["modal sums", "system", *(f"plane {p}" for p in "ABCDE")]
        sums = np.array([complex(s["x_kg_m"], s["y_kg_m"]) for s in way[0]["sums"]]) * 1e6
        at_planes = np.array([row["at_planes"] for row in way[1]["rows"]])
        assert at_planes.shape == (conditions, 5)
        assert np.abs(sums + at_planes @ made).max() < 1e-9 * np.abs(sums).max()
        first = 2 if further == ("--rigid",) else 0
        for k in range(1, conditions - first + 1):
            expected = U @ shape(k, [400, 725])
            assert abs(sums[first + k - 1] - expected) < 1e-6 * abs(expected)
        unbalances = [complex(t["x_kg_m"], t["y_kg_m"]) * 1e6 for t in way[2:]]
        assert np.abs(np.array(unbalances) - made).max() < 1e-12 * np.abs(made).max()
