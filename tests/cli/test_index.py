"""`dalembert index`: the rotor's part and the mandrel's, by hand and from drawn numbers; what is refused."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

from balancing import index_balancing
from tests.cli.printed import document
from tests.conftest import Dalembert


def vector(part: dict, size: str = "unbalance_kg_m", angle: str = "angle_deg") -> complex:
    return part[size] * np.exp(1j * np.radians(part[angle]))


def test_two_positions_by_hand(dalembert: Dalembert) -> None:
    # 5 + 0i and 0 + 3i: half the difference and half the sum
    found = document(
        dalembert("index", "-", "--json", stdin="turned_deg,unbalance_g_mm,angle_deg\n0,5,0\n180,3,90\n")
    )
    assert vector(found["rotor"]) * 1e6 == pytest.approx(2.5 - 1.5j, rel=1e-15)
    assert vector(found["mandrel"]) * 1e6 == pytest.approx(2.5 + 1.5j, rel=1e-15)
    assert found["rotor"]["uncertainty_kg_m"] is None


@pytest.mark.parametrize(
    ("header", "rows"),
    [
        ("turned_deg,unbalance_g_mm", "0,5@0\n180,3@90\n"),
        ("turned_deg,unbalance_g_mm", "0,5 / 0°\n180,3∠90\n"),
        ("turned_deg,amplitude_um", "0,5@0\n180,3@90\n"),
    ],
)
def test_cells_of_size_and_angle_are_those_of_field(dalembert: Dalembert, header: str, rows: str) -> None:
    result = document(dalembert("index", "-", "--json", stdin=f"{header}\n{rows}"))
    of = ("unbalance_kg_m", "angle_deg", 1e6) if "unbalance" in header else ("amplitude", "phase_deg", 1.0)
    assert vector(result["rotor"], *of[:2]) * of[2] == pytest.approx(2.5 - 1.5j, rel=1e-15)


def test_three_positions_of_amplitudes_and_the_sense_of_the_phase(dalembert: Dalembert) -> None:
    # rotor 2 µm at 30°, mandrel 1 µm at 200°, at 0, 120 and 240°
    rotor, mandrel = 2 * np.exp(1j * np.radians(30)), np.exp(1j * np.radians(200))
    read = [mandrel + rotor * np.exp(1j * np.radians(t)) for t in (0, 120, 240)]
    for sign, option in ((1, ()), (-1, ("--phase-lag",))):
        rows = "".join(
            f"{t},{abs(v):.17g},{sign * np.degrees(np.angle(v)):.17g}\n"
            for t, v in zip((0, 120, 240), read, strict=True)
        )
        table = f"turned_deg,amplitude_um,phase_deg\n{rows}"
        found = document(dalembert("index", "-", "--json", *option, stdin=table))
        assert found["amplitude_unit"] == "um"
        assert vector(found["rotor"], "amplitude", "phase_deg") == pytest.approx(rotor, rel=1e-14)
        assert vector(found["mandrel"], "amplitude", "phase_deg") == pytest.approx(mandrel, rel=1e-14)
        assert all(found[part]["angle_deg"] == found[part]["phase_deg"] for part in ("rotor", "mandrel"))


def test_least_squares_and_its_scatter_against_numpy() -> None:
    rng = np.random.default_rng(5)
    turned = np.radians([0, 40, 95, 200, 310, 310])
    read = rng.normal(size=(3, 6)) + 1j * rng.normal(size=(3, 6))
    both = index_balancing(read, turned)
    a = np.stack([np.exp(1j * turned), np.ones(6)], axis=-1)
    for i, v in enumerate(read):
        solution, square, *_ = np.linalg.lstsq(a, v)
        np.testing.assert_allclose([both.rotor[i], both.mounting[i]], solution, rtol=1e-13)
        assert both.residual_sd[i] == pytest.approx(np.sqrt(square[0] / 4), rel=1e-13)
    spread = np.sqrt(np.diag(np.linalg.inv(a.conj().T @ a)).real / 2)
    assert both.uncertainty == pytest.approx(both.residual_sd * spread[0], rel=1e-13)
    assert spread[0] == pytest.approx(spread[1], rel=1e-13)


@pytest.mark.slow
def test_how_far_the_parts_lie_off_is_their_uncertainty(first_seed: int) -> None:
    rng = np.random.default_rng(first_seed)
    turned = np.radians([0, 60, 200, 250])
    noise = 0.1 * (rng.normal(size=(40_000, 4)) + 1j * rng.normal(size=(40_000, 4)))
    both = index_balancing(3 + 2j * np.exp(1j * turned) + noise, turned)
    for off in (both.rotor - 2j, both.mounting - 3):
        for part in (off.real, off.imag):
            assert part.std() == pytest.approx(np.sqrt(np.square(both.uncertainty).mean()), rel=0.03)


def test_csv_and_digits(dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "index-mandrel")
    rows = list(csv.DictReader(io.StringIO(dalembert("index", "readings.csv").stdout)))
    assert [row["part"] for row in rows] == ["rotor", "mandrel"]
    assert float(rows[0]["unbalance_g_mm"]) == pytest.approx(90, rel=0.01)
    assert float(rows[1]["angle_deg"]) == pytest.approx(70, rel=0.01)
    cut = list(csv.DictReader(io.StringIO(dalembert("index", "readings.csv", "--digits").stdout)))
    for row, short in zip(rows, cut, strict=True):
        for name in ("unbalance_g_mm", "angle_deg"):
            assert float(short[name]) == pytest.approx(float(row[name]), rel=1e-12)
            assert len(short[name]) <= len(row[name])
    dalembert("index", "readings.csv", "-o", "out.md", "--report", "report.md")
    # tables of the JSON document alone are no sheets
    for file in ("out.md", "report.md"):
        assert [line for line in (tmp_path / file).read_text().splitlines() if line.startswith("#")][
            -1
        ].endswith("eadings")


def test_positions_close_together_are_named(dalembert: Dalembert) -> None:
    near = "turned_deg,amplitude_um,phase_deg\n0,5,30\n20,3,300\n"
    done = dalembert("index", "-", stdin=near)
    # 1 / sin 10°
    assert "grow by a factor of 5.76" in done.stderr


BAD = {
    "one position": ("turned_deg,amplitude_um,phase_deg\n0,5,30\n", "two at least"),
    "never turned": ("turned_deg,amplitude_um,phase_deg\n0,5,30\n360,5,30\n", "not turned"),
    "no turned": ("amplitude_um,phase_deg\n5,30\n5,30\n", "no column turned_deg"),
    "no reading": ("turned_deg,phase_deg\n0,5\n", "no column unbalance_g_mm"),
    "both": ("turned_deg,amplitude_um,unbalance_g_mm,phase_deg\n0,5,3,1\n", "mixed columns"),
    "no phase": ("turned_deg,amplitude_um\n0,5\n180,5\n", "no column phase_deg"),
    "a negative reading": (
        "turned_deg,amplitude_um,phase_deg\n0,5,30\n180,-5,30\n",
        "row 2 (line 3), column amplitude_um: found '-5'",
    ),
    "two planes": (
        "plane,turned_deg,amplitude_um,phase_deg\nA,0,5,30\nB,180,5,30\n",
        "column plane: found 'A' and 'B', expected the readings of one plane",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_readings(case: str, dalembert: Dalembert) -> None:
    table, message = BAD[case]
    done = dalembert("index", "-", stdin=table)
    assert done.returncode == 1
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("of", ["rotor", "mandrel"])
def test_one_part_alone(of: str, dalembert: Dalembert) -> None:
    """Three positions: the rounding of 120° was shown as the other part, and as its uncertainty."""
    turned = (0, 120, 240)
    rows = "".join(f"{angle},5,{angle if of == 'rotor' else 0}\n" for angle in turned)
    done = dalembert("index", "-", "--json", stdin="turned_deg,unbalance_g_mm,angle_deg\n" + rows)
    parts = json.loads(done.stdout)
    other = parts["mandrel" if of == "rotor" else "rotor"]
    assert other == {"unbalance_kg_m": 0.0, "angle_deg": 0.0, "uncertainty_kg_m": 0.0}
    assert parts[of]["unbalance_kg_m"] == pytest.approx(5e-6, rel=1e-15)
    assert {row["residual_kg_m"] for row in parts["readings"]} == {0.0}
