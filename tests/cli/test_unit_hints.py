"""Units of instruments without a scale, and what a wrong unit is taken for."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.conftest import Dalembert


def fan(amplitude: str, first: float = 3.4, second: float = 1.8) -> str:
    head = f"run,{amplitude},phase_deg,trial_plane,trial_mass_g,trial_angle_deg"
    return f"{head}\n0,{first},116,,,\n1,{second},42,A,2,0\n"


@pytest.mark.parametrize("unit", ["counts", "mV", "V", "g", "counts_pk", "mV_rms", "Counts"])
def test_units_of_amplitude(unit: str, dalembert: Dalembert) -> None:
    done = dalembert("field", "-", "--json", stdin=fan(f"amplitude_{unit}"))
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["amplitude_unit"].lower() == unit.lower()
    # Brüel & Kjær, application note 17-227
    assert found["rotors"][0]["corrections"][0]["mass_kg"] == pytest.approx(0.002012, abs=5e-7)


def test_volts_and_millivolts_convert_and_counts_do_not(dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "runout.csv").write_text("amplitude_mV,phase_deg\n400,30\n")
    in_volts = dalembert("field", "-", "--runout", "runout.csv", stdin=fan("amplitude_V"))
    (tmp_path / "runout.csv").write_text("amplitude_V,phase_deg\n0.4,30\n")
    assert in_volts.returncode == 0, in_volts.stderr
    assert (
        in_volts.stdout == dalembert("field", "-", "--runout", "runout.csv", stdin=fan("amplitude_V")).stdout
    )
    mixed = dalembert("field", "-", "--runout", "runout.csv", stdin=fan("amplitude_counts"))
    assert mixed.returncode == 1
    assert "do not mix" in mixed.stderr
    limited = dalembert("field", "-", "--max-residual", "2counts", stdin=fan("amplitude_counts"))
    assert limited.returncode == 0, limited.stderr


@pytest.mark.parametrize(
    ("column", "said"),
    [
        ("mass_mm", "'mm' is a unit of length"),
        ("mass_um", "'um' is a unit of length"),
        ("mass_mV", "'mV' is a unit of voltage"),
        ("radius_mg", "'mg' is a unit of mass"),
        ("radius_m2", ""),
        ("angle_rad_s", "'rad_s' is a unit of speed"),
    ],
)
def test_no_unit_of_another_dimension_is_suggested(column: str, said: str, dalembert: Dalembert) -> None:
    quantity = column.split("_")[0]
    header = ["mass_kg", "radius_mm", "angle_deg"]
    names = ",".join(column if name.startswith(quantity) else name for name in header)
    done = dalembert("balance", "-", "--plane", "A:20mm", stdin=f"{names}\n1,10,30\n")
    assert done.returncode == 1
    assert "did you mean" not in done.stderr
    assert said in done.stderr


@pytest.mark.parametrize(("unit", "meant"), [("mms", "mm_s"), ("count", "counts"), ("grms", "g_rms")])
def test_a_misspelt_unit(unit: str, meant: str, dalembert: Dalembert) -> None:
    done = dalembert("field", "-", stdin=fan(f"amplitude_{unit}"))
    assert done.returncode == 1
    assert f"did you mean '{meant}'?" in done.stderr


@pytest.mark.parametrize("unit", ["mm2", "mil_s", "mW", "kg"])
def test_what_is_no_amplitude(unit: str, dalembert: Dalembert) -> None:
    done = dalembert("field", "-", stdin=fan(f"amplitude_{unit}"))
    assert done.returncode == 1
    hint = done.stderr.partition("did you mean")[2]
    assert hint in ("", " 'm_s'?\n")  # of a velocity that is not known, one that is
    assert (hint == "") == (unit != "mil_s")


def test_an_option_with_a_unit_of_another_dimension(dalembert: Dalembert) -> None:
    done = dalembert("balance", "-", "--plane", "A:20mm", "--rotor-mass", "12mm", stdin="")
    assert done.returncode == 2
    assert "did you mean" not in done.stderr
    assert "unit of length" in " ".join(done.stderr.replace("│", " ").split())


def test_no_column_of_another_dimension_is_suggested(dalembert: Dalembert, tmp_path: Path) -> None:
    for column, hint in (
        ("unbalance_kg", "'mass_kg'"),
        ("masse_kg", "'mass_kg'"),
        ("angle_mm", "'radius_mm'"),
    ):
        (tmp_path / "expected.csv").write_text(f"{column}\n1\n")
        done = dalembert(
            "balance",
            "-",
            "--plane",
            "A:20mm",
            "--expect",
            "expected.csv",
            stdin="mass_kg,radius_mm,angle_deg\n1,10,30\n",
        )
        assert done.returncode == 1
        assert done.stderr.partition("did you mean ")[2].rstrip("?\n") in (hint, "")


RAMP = """
[units]
length = "mm"
angle = "deg"
[ground]
O = [0, 0]
[links.ramp]
points = { C = [0, 0], L = [600, 346.4101615137755] }
[links.block]
points = { A = [0, 0] }
mass = 1
[[sliders]]
point = "C"
link = "ramp"
on = "ground"
through = "O"
angle = 0
[[sliders]]
point = "A"
link = "block"
on = "ramp"
through = "C"
angle = 30
[[input]]
slider = "C"
position = 0
[[input]]
slider = "A"
position = 250
[guess]
at = [0, 250]
"""


def test_equilibria_of_slides_print_their_unit(dalembert: Dalembert) -> None:
    springs = """
gravity = [0, -9.81]
[[springs]]
between = ["ramp.C", "ground.O"]
stiffness = 100
free_length = 0
[[springs]]
between = ["block.A", "ramp.C"]
stiffness = 100
free_length = 500
"""
    done = dalembert("equilibrium", "-", "--text", stdin=springs + RAMP)
    assert done.returncode == 0, done.stderr
    # along the ramp m·g·sin 30° against 100 N/m: 49.05 mm below the free length
    assert "A_input_m" in done.stdout
    assert " 0.45095  true" in done.stdout


def test_an_unknown_amplitude_names_what_instruments_measure(dalembert: Dalembert) -> None:
    done = dalembert("field", "-", stdin=fan("amplitude_furlong"))
    assert done.returncode == 1
    assert (
        "expected amplitude_um, amplitude_mm_s, amplitude_mm_s2, amplitude_V or amplitude_counts"
        in done.stderr
    )


def test_a_unit_of_amplitude_is_no_misspelt_minute(dalembert: Dalembert) -> None:
    done = dalembert("field", "-", "--units", "mil", stdin=fan("amplitude_um"))
    assert done.returncode == 2
    assert "'mil' is a unit of amplitude" in " ".join(done.stderr.split())
    assert "did you mean" not in done.stderr


def test_a_length_of_a_mechanism_is_no_angle(dalembert: Dalembert) -> None:
    done = dalembert("mechanism", "-", stdin='units = { length = "parsec" }\n')
    assert "expected a unit of length such as 'mm'\\n" in done.stderr.replace("\n", "\\n")
