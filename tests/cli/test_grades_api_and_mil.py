"""`--grade API` and `--grade MIL` by hand in both systems of units, in balance and in field."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from balancing import api_unbalance, journal_loads, mil_unbalance, permissible_unbalance
from tests.cli.printed import document
from tests.conftest import Dalembert

RPM = np.pi / 30
LB, OZ_IN = 0.45359237, 0.45359237 / 16 * 0.0254
ROTOR = "unbalance_g_mm,angle_deg,z_mm\n500,30,100\n300,200,300\n"
PLANES = ("--plane", "A:0mm:50mm", "--plane", "B:400mm:50mm")
FAN = "run,sensor,amplitude_mm_s,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n0,b,3.4,116,,,\n1,b,1.8,42,1,2,0\n"


def test_a_published_comparison() -> None:
    # energy-tech, "Rotor balancing": 1000 lb at 15 000 rpm: API 0.13 and MIL 0.27 oz·in in each plane, ISO G2.5 1.0 in all
    speed = 15_000 * RPM
    assert api_unbalance(500 * LB, speed) / OZ_IN == pytest.approx(4 * 500 / 15_000, rel=1e-14)
    assert mil_unbalance(1000 * LB, speed) / OZ_IN == pytest.approx(4 * 1000 / 15_000, rel=1e-14)
    assert permissible_unbalance(0.0025, speed, 1000 * LB) / OZ_IN == pytest.approx(1.0, rel=3e-3)


def test_by_hand_in_grams_and_millimetres() -> None:
    # U = 6350 W/N g·mm
    assert api_unbalance(85.0, 2960 * RPM) * 1e6 == pytest.approx(6350 * 85 / 2960, rel=1e-14)
    assert mil_unbalance(85.0, 2960 * RPM) * 1e6 == pytest.approx(6350 * 85 / 2960, rel=1e-14)


def test_the_three_ranges_of_mil() -> None:
    for rpm, each in ((100, 0.177), (149.9, 0.177), (151, 4000 / 151**2), (500, 4000 / 500**2), (999, 4000 / 999**2), (1001, 4 / 1001), (60_000, 4 / 60_000)):  # fmt: skip
        assert mil_unbalance(LB, rpm * RPM) / OZ_IN == pytest.approx(each, rel=1e-12)


def test_loads_of_journals_between_and_beyond_the_bearings() -> None:
    assert journal_loads(80.0, 0.1, 0.0, 0.4) == pytest.approx([60, 20], rel=1e-15)
    assert journal_loads(80.0, 0.5, 0.0, 0.4) == pytest.approx([20, 100], rel=1e-15)
    assert journal_loads(80.0, 0.1, 0.4, 0.0) == pytest.approx([20, 60], rel=1e-15)


def test_api_in_the_bearings_and_without_them(dalembert: Dalembert) -> None:
    call = ("balance", "-", *PLANES, "--grade", "API", "--speed", "3000rpm", "--rotor-mass", "12kg", "--json")
    whole = 0.00635 * 12 / 3000
    for options, shares in (
        ((), (0.5, 0.5)),
        (("--center-z", "100mm"), (0.5, 0.5)),
        (("--center-z", "100mm", "--bearings", "-100mm:400mm"), (0.6, 0.4)),
        (("--center-z", "450mm", "--bearings", "-100mm:400mm"), (0.1, 1.1)),
    ):
        (rotor,) = document(dalembert(*call, *options, stdin=ROTOR))["rotors"]
        tolerance = rotor["tolerance"]
        assert tolerance["grade"] == "API"
        assert tolerance["permissible_kg_m"] == pytest.approx(whole, rel=1e-14)
        assert [p["permissible_kg_m"] for p in tolerance["planes"]] == pytest.approx(
            [share * whole for share in shares], rel=1e-13
        )
    done = dalembert(*call, "--center-z", "100mm", stdin=ROTOR)
    assert "no --bearings: half of the rotor's mass" in done.stderr


def test_mil_in_the_correction_planes(dalembert: Dalembert) -> None:
    call = ("balance", "-", *PLANES, "--speed", "3000rpm", "--rotor-mass", "12kg")
    for spelling in ("MIL", "mil", "MIL-STD-167-1"):
        done = dalembert(*call, "--grade", spelling, "--center-z", "100mm", "--json", stdin=ROTOR)
        (rotor,) = document(done)["rotors"]
        assert rotor["tolerance"]["grade"] == "MIL"
        each = 0.00635 * 12 / 3000
        assert [p["permissible_kg_m"] for p in rotor["tolerance"]["planes"]] == pytest.approx(
            [each, each], rel=1e-14
        )
        assert done.stderr == ""
    text = dalembert(*call, "--grade", "MIL", "--text", stdin=ROTOR).stdout
    assert "MIL: U_per = 25.4 g·mm in each plane" in text
    refused = dalembert(*call, "--grade", "MIL", "--bearings", "0mm:400mm", stdin=ROTOR)
    assert refused.returncode == 2
    assert "holds in the correction planes" in " ".join(refused.stderr.split())


def test_in_the_field(dalembert: Dalembert) -> None:
    options = ("--speed", "3000rpm", "--rotor-mass", "12kg", "--radius", "200mm")
    for grade in ("API", "MIL"):
        (rotor,) = document(dalembert("field", "-", "--grade", grade, *options, "--json", stdin=FAN))[
            "rotors"
        ]
        (plane,) = rotor["tolerance"]["planes"]
        assert plane["permissible_kg_m"] == pytest.approx(0.00635 * 12 / 3000, rel=1e-14)
        assert plane["initial_kg_m"] == pytest.approx(0.2 * 0.00201168, rel=1e-4)
        assert plane["within"] is False


@pytest.mark.parametrize("missing", ["--speed", "--rotor-mass"])
def test_what_a_grade_needs(missing: str, dalembert: Dalembert) -> None:
    options = {"--speed": "3000rpm", "--rotor-mass": "12kg"}
    del options[missing]
    words = [word for pair in options.items() for word in pair]
    done = dalembert("balance", "-", *PLANES, "--grade", "API", *words, stdin=ROTOR)
    assert done.returncode == 2
    assert "--grade needs --speed and --rotor-mass" in " ".join(done.stderr.split())


def test_a_pipe_has_the_verdict_of_a_grade_beside_the_corrections(
    dalembert: Dalembert, tmp_path: Path
) -> None:
    """10 g at 20 mm are 200 g·mm; G2.5 of 12 kg at 3000 rpm permits 95.5 g·mm. Steps of 20 g cannot correct them."""
    (tmp_path / "rotor.csv").write_text("mass_g,radius_mm,angle_deg\n10,20,30\n")
    words = ("balance", "rotor.csv", "--plane", "A:20mm")
    grade = ("--grade", "G2.5", "--speed", "3000rpm", "--rotor-mass", "12kg")
    plain = dalembert(*words)
    graded = dalembert(*words, *grade)
    assert graded.stdout == plain.stdout
    assert "residual_g_mm 0, verdict within" in graded.stderr
    coarse = dalembert(*words, *grade, "--round-mass", "25g")
    assert "permissible_g_mm 95.493, initial_g_mm 200, residual_g_mm 200, verdict beyond" in coarse.stderr
    # the terminal's table and the document have it themselves
    assert "verdict" not in dalembert(*words, *grade, "--json").stderr
    assert "note:" not in dalembert(*words, *grade, "--text").stderr


@pytest.mark.parametrize("bearings", [(), ("--bearings", "-100mm:500mm")])
def test_what_rounding_leaves_of_a_residual_is_shown_as_nothing(
    bearings: tuple[str, ...], dalembert: Dalembert
) -> None:
    options = (*PLANES, "--grade", "API", "--speed", "2960rpm", "--rotor-mass", "85kg", "--center-z", "150mm")
    text = dalembert("balance", "-", *options, *bearings, "--text", stdin=ROTOR).stdout
    rows = [line.split() for line in text.splitlines() if line.endswith(" within")]
    assert [row[-2] for row in rows] == ["0", "0"]
    rough = dalembert(
        "balance", "-", *options, *bearings, "--round-mass", "0.1g", "--text", stdin=ROTOR
    ).stdout
    rows = [line.split() for line in rough.splitlines() if line.endswith(" within")]
    assert all(float(row[-2]) > 0.01 for row in rows)


@pytest.mark.parametrize(
    ("column", "value", "unit"),
    [
        ("trial_mass_g", "20", "g·mm"),
        ("trial_mass_oz", "2", "oz·in"),
        ("trial_mass_lb", "0.1", "oz·in"),
        ("trial_unbalance_oz_in", "2", "oz·in"),
        ("trial_unbalance_kg_mm", "2", "kg·mm"),
    ],
)
def test_the_tolerance_is_in_units_like_those_of_the_trials(
    column: str, value: str, unit: str, dalembert: Dalembert, tmp_path: Path
) -> None:
    text = f"run,sensor,amplitude_mil,phase_deg,trial_plane,{column},trial_angle_deg\n0,b,3.4,116,,,\n1,b,1.8,42,1,{value},0\n"
    options = ["--grade", "API", "--speed", "3560rpm", "--rotor-mass", "180lb"]
    if "mass" in column:
        options += ["--radius", "5in"]
    done = dalembert("field", "-", *options, "--text", "--report", "r.md", stdin=text)
    assert done.returncode == 0, done.stderr
    # 4 W/N oz·in, W half of the rotor or, with one plane, all of it
    whole = 4 * 180 / 3560 * OZ_IN * {"g·mm": 1e6, "oz·in": 1 / OZ_IN, "kg·mm": 1e3}[unit]
    assert f"U_per = {whole:.6g} {unit}, shared equally" in done.stdout
    assert f"tolerance API: {whole:.6g} {unit}, shared equally" in (tmp_path / "r.md").read_text()
