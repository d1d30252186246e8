"""`dalembert field` as a user runs it."""

from __future__ import annotations

import csv
import io
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.measured import ALPHA, FAN, HEAD, V0, W, cell, corrections, runs, table
from tests.cli.printed import document
from tests.conftest import Dalembert


def test_the_document(dalembert: Dalembert) -> None:
    found = document(dalembert("field", "-", "--json", stdin=FAN))
    assert {"rotors", "amplitude_unit", "warnings"} <= set(found)
    assert found["amplitude_unit"] == "um"
    (rotor,) = found["rotors"]
    assert rotor["rotor"] == "1"
    (alpha,) = rotor["influence"]
    assert set(alpha) == {"sensor", "speed_rad_s", "plane", "magnitude_per_kg", "phase_deg"}
    change = 1.8 * np.exp(1j * np.radians(42)) - 3.4 * np.exp(1j * np.radians(116))
    assert alpha["magnitude_per_kg"] == pytest.approx(abs(change) / 0.002, rel=1e-14)
    assert alpha["speed_rad_s"] is None
    assert rotor["condition_number"] == 1
    (fix,) = rotor["corrections"]
    assert fix["mass_uncertainty_kg"] is None
    assert fix["angle_uncertainty_deg"] is None
    assert fix["mass_kg"] == pytest.approx(2.011676e-3, rel=1e-6)
    assert 0 <= fix["angle_deg"] < 360
    assert rotor["residual"] == [{"sensor": "1", "speed_rad_s": None, "amplitude": 0.0, "phase_deg": 0.0}]
    assert rotor["residual_rms"] == rotor["residual_max"] == 0


def test_the_columns(dalembert: Dalembert) -> None:
    out = dalembert("field", "-", stdin=FAN).stdout
    (row,) = csv.DictReader(io.StringIO(out))
    assert list(row) == ["rotor", "plane", "mass_g", "angle_deg", "trim_mass_g", "trim_angle_deg"]
    assert float(row["mass_g"]) == pytest.approx(2.011676, rel=1e-6)


@pytest.mark.parametrize(
    ("masses", "on"),
    [
        (["A,1,0,no", "B,1,90,no"], [[1, 0], [0, 1j]]),
        (["A,1,0,yes", "B,1,90,yes"], [[1, 0], [1, 1j]]),
        (["A,1,0,yes", "B,1,90,"], [[1, 0], [1, 1j]]),
        (["A,1,0,", "B,1,90,yes"], [[1, 0], [0, 1j]]),
        (["A;B,1;2,0;90,", "B,1,90,"], [[1, 2j], [0, 1j]]),
        (["A;B,1;2,0;90,yes", "A,1,180,no"], [[1, 2j], [0, 2j]]),
        # a mass put on twice, and a run with nothing new but what was kept
        (["A,1,0,yes", "B,1,90,yes", "A,1,90,no", ",,,"], [[1, 0], [1, 1j], [1 + 1j, 1j], [1, 1j]]),
        (["A,1,0,", "B,1,90,", "A;B,1;1,45;45,"], [[1, 0], [0, 1j], np.exp(0.25j * np.pi) * np.ones(2)]),
    ],
)
def test_masses_put_on_left_on_taken_off(masses: list[str], on: Any, dalembert: Dalembert) -> None:
    found = corrections(dalembert("field", "-", "--json", stdin=runs(*masses, on=on)))
    assert np.abs(found * 1e3 - W).max() < 1e-12


def test_from_here(dalembert: Dalembert) -> None:
    text = runs("A,1,0,yes", "B,1,90,", on=[[1, 0], [1, 1j]])
    found = corrections(dalembert("field", "-", "--json", "--from-here", stdin=text))
    assert np.abs(found * 1e3 - (W - [1, 1j])).max() < 1e-12
    bare = runs("A,1,0,", "B,1,90,", ",,,", ",,,", on=[[1, 0], [0, 1j], [0, 0], [0, 0]])
    done = dalembert("field", "-", "--json", "--from-here", stdin=bare)
    assert "the last run has no mass on the rotor" in " ".join(document(done)["warnings"])


def test_units_and_unbalances(dalembert: Dalembert) -> None:
    text = runs("A,1,0,", "B,1,90,", on=[[1, 0], [0, 1j]])
    ounces = text.replace("trial_mass_g", "trial_mass_oz").replace("amplitude_um", "AMPLITUDE_MIL")
    done = dalembert("field", "-", "--json", stdin=ounces)
    assert document(done)["amplitude_unit"] == "mil"
    assert np.abs(corrections(done) / 0.028349523125 - W).max() < 1e-12
    moments = text.replace("trial_mass_g", "trial_unbalance_g_mm")
    done = dalembert("field", "-", "--json", stdin=moments)
    assert np.abs(corrections(done, "unbalance_kg_m") * 1e6 - W).max() < 1e-12
    assert "magnitude_per_kg_m" in document(done)["rotors"][0]["influence"][0]
    assert dalembert("field", "-", stdin=moments).stdout.startswith("rotor,plane,unbalance_g_mm,angle_deg")


def test_the_sense_of_the_phase(dalembert: Dalembert) -> None:
    text = runs("A,1,0,", "B,1,90,", on=[[1, 0], [0, 1j]])
    mirrored = runs("A,1,0,", "B,1,90,", on=[[1, 0], [0, 1j]])
    head, *lines = mirrored.splitlines()
    turned = [line.split(",") for line in lines]
    for row in turned:
        row[3] = repr(-float(row[3]))
    lagging = "\n".join([head, *(",".join(row) for row in turned)])
    plain = document(dalembert("field", "-", "--json", stdin=text))["rotors"]
    for options in (["--phase-lag"], ["--rotation", "cw"], ["--phase-lag", "--rotation", "ccw"]):
        assert document(dalembert("field", "-", "--json", *options, stdin=lagging))["rotors"] == plain
    again = document(dalembert("field", "-", "--json", "--phase-lag", "--rotation", "cw", stdin=text))
    assert again["rotors"] == plain


def test_stored_coefficients_come_back(dalembert: Dalembert, tmp_path: Path) -> None:
    text = runs("A,1,0,", "B,1,90,", on=[[1, 0], [0, 1j]])
    first = corrections(dalembert("field", "-", "--json", "--save-influence", "ic.csv", stdin=text))
    header = (tmp_path / "ic.csv").read_text().splitlines()[0]
    assert header.startswith("sensor,speed_rpm,plane,magnitude_per_g,phase_deg")
    initial = "\n".join(text.splitlines()[:4])
    done = dalembert("field", "-", "--json", "--influence", "ic.csv", stdin=initial)
    assert np.abs(corrections(done) - first).max() < 1e-14
    assert dalembert("field", "-", "--influence", "ic.csv", stdin=initial).stdout.startswith(
        "rotor,plane,mass_g,"
    )
    # trial runs in the table are not used, and said so
    done = dalembert("field", "-", "--json", "--influence", "ic.csv", stdin=text)
    assert np.abs(corrections(done) - first).max() < 1e-14
    assert any("trial runs are not used" in w for w in document(done)["warnings"])
    # other units of one kind convert, other kinds do not
    mils = initial.replace("amplitude_um", "amplitude_mil")
    done = dalembert("field", "-", "--json", "--influence", "ic.csv", stdin=mils)
    assert np.abs(corrections(done) / 25.4 - first).max() < 1e-13
    speeds = initial.replace("amplitude_um", "amplitude_mm_s")
    done = dalembert("field", "-", "--json", "--influence", "ic.csv", stdin=speeds)
    assert done.returncode == 1
    assert "do not mix" in done.stderr


def test_several_speeds(dalembert: Dalembert, tmp_path: Path) -> None:
    head = "run,sensor,speed_rpm,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg"
    rows = []
    for run, (trial, on) in enumerate([(",,", [0, 0]), ("A,1,0", [1, 0]), ("B,1,90", [0, 1j])]):
        for s, v in enumerate(V0 + ALPHA @ np.asarray(on)):
            rows.append(f"{run},{'x' if s < 2 else 'y'},{900 if s == 0 else 1800},{cell(v)},{trial}")
    done = dalembert("field", "-", "--json", "--save-influence", "ic.csv", stdin=table(*rows, head=head))
    assert np.abs(corrections(done) * 1e3 - W).max() < 1e-12
    channels = document(done)["rotors"][0]["residual"]
    assert [c["sensor"] for c in channels] == ["x", "x", "y"]
    assert [c["speed_rad_s"] for c in channels] == pytest.approx([30 * np.pi, 60 * np.pi, 60 * np.pi])
    again = dalembert("field", "-", "--json", "--influence", "ic.csv", stdin=table(*rows[:3], head=head))
    assert np.abs(corrections(again) * 1e3 - W).max() < 1e-12


def test_an_amplitude_that_is_too_small_to_square(dalembert: Dalembert) -> None:
    done = dalembert(
        "field", "-", stdin=table("0,1,5e-160,0,,,", "1,1,7e-160,0,A,1,0", "2,1,4e-160,9,A,1,180")
    )
    assert done.returncode == 1
    assert done.stderr.endswith("found '5e-160', expected 0, or an amplitude of 1e-60 at least\n")


def test_runout(dalembert: Dalembert, tmp_path: Path) -> None:
    text = runs("A,1,0,", "B,1,90,", on=[[1, 0], [0, 1j]], v0=V0 + 0.5j)
    (tmp_path / "r.csv").write_text("sensor,amplitude_mm,phase_deg\n0,0.0005,90\n1,0.0005,90\n2,0.0005,90\n")
    found = corrections(dalembert("field", "-", "--json", "--runout", "r.csv", stdin=text))
    assert np.abs(found * 1e3 - W).max() < 1e-12
    (tmp_path / "r.csv").write_text("sensor,amplitude_um,phase_deg\n9,0.5,90\n")
    done = dalembert("field", "-", "--runout", "r.csv", stdin=text)
    assert done.returncode == 1
    assert "found '9', expected a sensor of the runs" in done.stderr


def test_runout_is_turned_with_the_readings(dalembert: Dalembert, tmp_path: Path) -> None:
    """Runs show that the instrument of rotor x lags; those of y do not show the sense, so that y stays as it is alone."""
    head = HEAD.replace("run,", "rotor,run,", 1)
    runout, initial, alpha = 1 + 2j, 3 - 1j, 2 + 1j
    on = {"x": [0, 1, 1j, -1], "y": [0, 1]}
    rows = [
        f"{rotor},{k},1,{cell((initial + alpha * w + runout).conjugate())},{f'A,1,{np.degrees(np.angle(w))}' if w else ',,'}"
        for rotor, masses in on.items()
        for k, w in enumerate(masses)
    ]
    (tmp_path / "r.csv").write_text(f"sensor,amplitude_um,phase_deg\n1,{cell(runout.conjugate())}\n")
    call = ("field", "-", "--runout", "r.csv")
    together = document(dalembert(*call, "--json", stdin=table(*rows, head=head)))
    alone = document(dalembert(*call, "--json", stdin=table(*rows[4:], head=head)))
    turned = document(dalembert(*call, "--json", "--phase-lag", stdin=table(*rows, head=head)))
    assert any(
        "rotor x: the runs show that the instrument's phase lags" in text for text in together["warnings"]
    )
    assert together["rotors"][1]["corrections"] == alone["rotors"][0]["corrections"]
    w = -initial / alpha
    for rotor in (together["rotors"][0], *turned["rotors"]):
        (fix,) = rotor["corrections"]
        assert 1e3 * fix["mass_kg"] == pytest.approx(abs(w), rel=1e-14)
        assert fix["angle_deg"] == pytest.approx(np.degrees(np.angle(w)) % 360, rel=1e-14)
    (fix,) = together["rotors"][1]["corrections"]
    assert fix["angle_deg"] == pytest.approx(-np.degrees(np.angle(w)) % 360, rel=1e-14)
    digits = dalembert(*call, "--digits", stdin=table(*rows, head=head)).stdout.splitlines()
    assert digits[2].startswith("y,A,1.41421356237")


def goodman(*more: str) -> tuple[str, str]:
    alpha = [(3, 180), (5, 180), (5, 180)], [(2, 0), (2, 0), (3, 0)]
    initial = table("0,1,1,180", "0,2,1,0", "0,3,0,0", head="run,sensor,amplitude_um,phase_deg")
    rows = ["sensor,plane,magnitude_per_kg,phase_deg"]
    for plane, column in zip("AB", alpha, strict=True):
        rows += [f"{s + 1},{plane},{m},{p}" for s, (m, p) in enumerate(column)]
    return initial, "\n".join([*rows, *more])


def test_objectives_and_limits(dalembert: Dalembert, tmp_path: Path) -> None:
    initial, coefficients = goodman()
    (tmp_path / "g.csv").write_text(coefficients)

    def field(*options: str) -> subprocess.CompletedProcess[str]:
        return dalembert("field", "-", "--influence", "g.csv", "--json", *options, stdin=initial)

    assert np.abs(corrections(field()) * 21 - [17, 31]).max() < 1e-11
    done = field("--objective", "minimax")
    assert np.abs(corrections(done) - [1, 1.8]).max() < 1e-12
    (rotor,) = document(done)["rotors"]
    assert rotor["residual_max"] == pytest.approx(0.4, rel=1e-12)
    assert rotor["residual_bound"] == pytest.approx(0.4, rel=1e-12)
    assert np.abs(corrections(field("--objective", "minimax", "--max-mass", "1.2kg"))).max() <= 1.2
    held = corrections(field("--max-mass", "A=500g", "--max-mass", "B=1kg"))
    assert abs(held[0]) <= 0.5
    assert abs(held[1]) <= 1
    within = document(field("--max-residual", "0.45um"))["rotors"][0]
    assert within["residual_max"] <= 0.45 * (1 + 1e-12)
    beyond = field("--max-residual", "0.39um")
    assert beyond.returncode == 1
    assert "smallest limit that can be met is 0.4 um" in beyond.stderr
    assert field("--objective", "minimax", "--max-residual", "0.39um").returncode == 1
    for options in (
        ["--max-mass", "C=1kg"],
        ["--max-mass", "1g_mm"],
        ["--max-mass", "-1g"],
        ["--objective", "best"],
    ):
        assert field(*options).returncode == 2
    assert field("--max-residual", "1mm_s").returncode == 1


def test_weights_by_row(dalembert: Dalembert) -> None:
    head = HEAD + ",weight"
    lines = runs("A,1,0,", "B,1,90,", on=[[1, 0], [0, 1j]], v0=V0 + [0, 0, 5]).splitlines()[1:]
    text = table(
        *(f"{line.rpartition(',')[0]},{'0' if line.split(',')[1] == '2' else ''}" for line in lines),
        head=head,
    )
    assert np.abs(corrections(dalembert("field", "-", "--json", stdin=text)) * 1e3 - W).max() < 1e-11


def test_uncertainty(dalembert: Dalembert) -> None:
    done = document(dalembert("field", "-", "--json", "--reading-error", "2%,2deg", stdin=FAN))
    (fix,) = done["rotors"][0]["corrections"]
    v0, v1 = 3.4 * np.exp(1j * np.radians(116)), 1.8 * np.exp(1j * np.radians(42))
    part = v1 / (v1 - v0)
    size = np.sqrt(2 * (part.real * 0.02) ** 2 + 2 * (part.imag * np.radians(2)) ** 2)
    angle = np.sqrt(2 * (part.imag * 0.02) ** 2 + 2 * (part.real * np.radians(2)) ** 2)
    assert fix["mass_uncertainty_kg"] == pytest.approx(fix["mass_kg"] * size, rel=1e-9)
    assert fix["angle_uncertainty_deg"] == pytest.approx(np.degrees(angle), rel=1e-9)
    assert done["rotors"][0]["residual_max_95"] > 0
    drawn = document(
        dalembert("field", "-", "--json", "--reading-error", "2%,2deg", "--monte-carlo", "20000", stdin=FAN)
    )
    assert drawn["rotors"][0]["corrections"][0]["mass_uncertainty_kg"] == pytest.approx(
        fix["mass_uncertainty_kg"], rel=0.05
    )
    minimax = dalembert("field", "-", "--objective", "minimax", "--reading-error", "1%", stdin=FAN)
    assert minimax.stdout.startswith("rotor,plane,mass_g,angle_deg,mass_uncertainty_g,angle_uncertainty_deg")


def test_four_run(dalembert: Dalembert) -> None:
    head = "run,sensor,amplitude_mm_s,trial_plane,trial_mass_g,trial_angle_deg"
    rows = ["0,1,6.1,,,", "1,1,7.7,1,12.3,0", "2,1,3.2,1,12.3,120", "3,1,10.3,1,12.3,240"]
    done = document(dalembert("field", "-", "--method", "four-run", "--json", stdin=table(*rows, head=head)))
    (fix,) = done["rotors"][0]["corrections"]
    assert fix["mass_kg"] == pytest.approx(16.36431e-3, rel=1e-6)
    assert fix["angle_deg"] == pytest.approx(89.9562, abs=1e-4)
    assert done["rotors"][0]["misfit"][0]["amplitude"] == pytest.approx(0.0595, abs=1e-4)
    assert (
        "\nAlternatives: none\n"
        in dalembert("field", "-", "--method", "four-run", "--text", stdin=table(*rows, head=head)).stdout
    )
    three = document(
        dalembert("field", "-", "--method", "four-run", "--json", stdin=table(*rows[:3], head=head))
    )
    assert len(three["rotors"][0]["alternatives"]) == 1
    assert "two corrections fit" in three["warnings"][0]
    wild = table(rows[0], "1,1,30,1,12.3,0", "2,1,1,1,12.3,120", "3,1,1,1,12.3,240", head=head)
    done = dalembert("field", "-", "--method", "four-run", stdin=wild)
    assert done.returncode == 1
    assert "inconsistent" in done.stderr
    both = dalembert("field", "-", "--method", "four-run", "--phase-lag", stdin=table(*rows, head=head))
    assert both.returncode == 2


def test_many_rotors_in_one_table(dalembert: Dalembert) -> None:
    """Rotors measured alike and otherwise, their rows mixed; names are text."""
    one = runs("A,1,0,", "B,1,90,", on=[[1, 0], [0, 1j]]).splitlines()
    other = runs("B,1,0,yes", "A,1,90,", on=[[0, 1], [1j, 1]]).splitlines()
    rows = [f"07,{a}" for a in one[1:]] + [f"7,{b}" for b in other[1:]] + [f"NA,{a}" for a in one[1:]]
    mixed = rows[::2] + rows[1::2]
    order = sorted(range(len(mixed)), key=lambda i: mixed[i].split(",")[1])
    text = table(*(mixed[i] for i in order), head="rotor," + one[0])
    found = document(dalembert("field", "-", "--json", stdin=text))
    assert {r["rotor"] for r in found["rotors"]} == {"07", "7", "NA"}
    for rotor in found["rotors"]:
        by_plane = {
            c["plane"]: c["mass_kg"] * np.exp(1j * np.radians(c["angle_deg"])) for c in rotor["corrections"]
        }
        assert abs(by_plane["A"] * 1e3 - W[0]) < 1e-12
        assert abs(by_plane["B"] * 1e3 - W[1]) < 1e-12
    columns = list(csv.DictReader(io.StringIO(dalembert("field", "-", stdin=text).stdout)))
    assert [row["rotor"] for row in columns] == [
        r["rotor"] for r in found["rotors"] for _ in r["corrections"]
    ]


def test_a_trial_mass_is_suggested(dalembert: Dalembert) -> None:
    options = ["--rotor-mass", "100kg", "--speed", "1500rpm", "--radius", "200mm", "--planes", "2"]
    done = json.loads(dalembert("trial", "--json", *options).stdout)
    assert done["trial"]["mass_kg"] == pytest.approx(0.1 * 50 * 9.80665 / (157.07963267948966**2 * 0.2))
    assert "tenth" in done["trial"]["rule"]
    assert dalembert("trial", *options[:-4]).returncode == 2


def test_text_report_and_pictures(dalembert: Dalembert, tmp_path: Path) -> None:
    text = runs("A,1,0,yes", "B,1,90,", on=[[1, 0], [1, 1j]])
    done = dalembert(
        "field",
        "-",
        "--text",
        "--report",
        "r.html",
        "--plot",
        "p.png",
        "--reading-error",
        "2%,2deg",
        stdin=text,
    )
    assert done.returncode == 0, done.stderr
    for said in (
        "one common sense",
        "ADD",
        "REMOVE",
        "vibration before, and as predicted",
        "condition number",
        "95 %",
    ):
        assert said in done.stdout
    page = (tmp_path / "r.html").read_text()
    for said in ("Vibration", "Influence coefficients", "Corrections", "predicted", "<svg"):
        assert said in page
    assert "<script" not in page
    assert 'src="http' not in page
    assert (tmp_path / "p.png").read_bytes()[:4] == b"\x89PNG"


def test_speeds_that_differ_a_little_are_one_speed(dalembert: Dalembert, tmp_path: Path) -> None:
    head = "run,sensor,speed_rpm,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg"
    rows = []
    for run, (trial, on) in enumerate([(",,", [0, 0]), ("A,1,0", [1, 0]), ("B,1,90", [0, 1j])]):
        for s, v in enumerate(V0 + ALPHA @ np.asarray(on)):
            rows.append(f"{run},x,{(900, 1500, 3000)[s] + run},{cell(v)},{trial}")
    done = dalembert("field", "-", "--json", "--save-influence", "ic.csv", stdin=table(*rows, head=head))
    assert np.abs(corrections(done) * 1e3 - W).max() < 1e-12
    again = dalembert("field", "-", "--json", "--influence", "ic.csv", stdin=table(*rows[:3], head=head))
    assert np.abs(corrections(again) * 1e3 - W).max() < 1e-12
    # without a column run the table is the initial run
    plain = table(*(row.partition(",")[2] for row in rows[:3]), head=head.partition(",")[2])
    again = dalembert("field", "-", "--json", "--influence", "ic.csv", stdin=plain)
    assert np.abs(corrections(again) * 1e3 - W).max() < 1e-12
    far = table(
        *rows[:3], *(row.replace(",903,", ",1200,").replace(",901,", ",1200,") for row in rows[3:]), head=head
    )
    done = dalembert("field", "-", stdin=far)
    assert done.returncode == 1
    assert "no reading of sensor x at 901 in run 1" in done.stderr
    assert "speeds more than 5 % apart" in done.stderr


def test_the_split_onto_places(dalembert: Dalembert) -> None:
    (fix,) = document(dalembert("field", "-", "--json", "--blades", "12", stdin=FAN))["rotors"][0][
        "corrections"
    ]
    parts = [m["mass_kg"] * np.exp(1j * np.radians(m["angle_deg"])) for m in fix["split"]]
    assert len(parts) == 2
    assert abs(sum(parts) - fix["mass_kg"] * np.exp(1j * np.radians(fix["angle_deg"]))) < 1e-17
    assert dalembert("field", "-", "--blades", "3", "--positions", "0deg", stdin=FAN).returncode == 2


def test_a_mass_of_zero_is_none(dalembert: Dalembert) -> None:
    """Also where the initial run states it, with or without a plane; a plane without any mass is not determined."""
    for bare in (",0,0", "A,0,0", ",,"):
        done = dalembert("field", "-", "--json", stdin=table(f"0,1,3,0,{bare}", "1,1,5,0,A,2,0"))
        assert abs(corrections(done)[0] * 1e3 + 3) < 1e-12
    done = dalembert("field", "-", stdin=table("0,1,3,0,,,", "1,1,5,0,A,0,0", "2,1,4,0,B,2,0"))
    assert done.returncode == 1
    assert "2 planes (A, B) and 1 trial run" in done.stderr


def test_runs_without_an_initial_one_are_fitted_with_stored_coefficients(
    dalembert: Dalembert, tmp_path: Path
) -> None:
    text = runs("A,1,0,", "B,1,90,", on=[[1, 0], [0, 1j]])
    dalembert("field", "-", "--save-influence", "ic.csv", stdin=text)
    head, *rows = text.splitlines()
    done = dalembert("field", "-", "--json", "--influence", "ic.csv", stdin=table(*rows[3:], head=head))
    assert np.abs(corrections(done) * 1e3 - W).max() < 1e-12
    assert document(done)["rotors"][0]["fit"]["runs"] == 2
