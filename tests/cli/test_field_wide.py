"""Sheets with a row a run and a column pair for each sensor, as people keep them, in English and German."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest

from tests.cli.logs import polar
from tests.cli.measured import ALPHA, HEAD, V0, W, cell, corrections, table
from tests.cli.printed import document
from tests.conftest import Dalembert

ON = [[0, 0], [1, 0], [1, 1j]]
READ = [V0 + ALPHA @ np.asarray(on) for on in ON]
LONG = table(
    *(
        f"{run},{'ABC'[s]},{cell(v)},{masses}"
        for run, (values, masses) in enumerate(zip(READ, [",,,", "1,1,0,yes", "2,1,90,no"], strict=True))
        for s, v in enumerate(values)
    ),
    head=HEAD.replace("_um", "_mm_s") + ",trial_kept",
)
PAIRS = [
    ("{s}_mm_s", "{s}_deg"),
    ("amplitude_{s}_mm_s", "phase_{s}_deg"),
    ("{s} amplitude [mm/s]", "{s} phase [°]"),
    ("Lager {s} [mm/s]", "Phase Lager {s} [°]"),
    ("Schwinggeschwindigkeit {s} (mm/s)", "Winkel {s} (°)"),
    ("Amplitude {s}, mm/s", "Phase {s}"),
    ("Messstelle {s} in mm/s", "Phasenwinkel {s} [deg]"),
]
TRIALS = [
    ("trial_plane", "trial_mass_g", "trial_angle_deg", "trial_kept"),
    ("Ebene", "Masse [g]", "Winkel [°]", "bleibt"),
    ("plane", "Testmasse (g)", "Winkel", "bleibt"),
]


def wide(
    pair: tuple[str, str], trial: tuple[str, str, str, str], run: str = "run", comma: bool = False
) -> str:
    names = [name.format(s=s) for s in "ABC" for name in pair]
    rows = [[run, *names, *trial]]
    words = {True: ("ja", "nein"), False: ("yes", "no")}[trial[3] == "bleibt"]
    masses = [["", "", "", ""], ["1", "1", "0", words[0]], ["2", "1", "90", words[1]]]
    for number, (values, on) in enumerate(zip(READ, masses, strict=True)):
        read = [part for v in values for part in cell(v).split(",")]
        rows.append([str(number), *read, *on])
    if comma:
        return "\n".join(";".join(row).replace(".", ",") for row in rows) + "\n"
    return "\n".join(",".join(f'"{each}"' if "," in each else each for each in row) for row in rows) + "\n"


def rotor(done: Any) -> Any:
    found = document(done)["rotors"][0]
    return {key: found[key] for key in ("corrections", "trim", "standing", "influence", "residual")}


@pytest.mark.parametrize("pair", PAIRS)
def test_a_wide_sheet_is_the_long_one(pair: tuple[str, str], dalembert: Dalembert) -> None:
    plain = rotor(dalembert("field", "-", "--json", stdin=LONG))
    assert np.abs(corrections(dalembert("field", "-", "--json", stdin=LONG)) * 1e3 - W).max() < 1e-12
    for trial, run, comma in zip(TRIALS, ("run", "Lauf", "Messung"), (False, True, True), strict=True):
        done = dalembert("field", "-", "--json", stdin=wide(pair, trial, run, comma))
        assert rotor(done) == plain
        (said,) = (w for w in document(done)["warnings"] if "a row a run" in w)
        assert f"'{pair[0].format(s='B')}' is the amplitude at sensor B" in said
        assert f"'{pair[1].format(s='B')}' is the phase at sensor B" in said
        assert "is the angle of the trial mass" in said


def test_trial_masses_in_a_column_for_each_plane(dalembert: Dalembert) -> None:
    names = ["trial_mass_1_g", "trial_angle_1_deg", "trial_mass_2_g", "trial_angle_2_deg"]
    rows = [",".join(["run", *(f"{s}_{u}" for s in "ABC" for u in ("mm_s", "deg")), *names])]
    for run, (values, on) in enumerate(
        zip(READ, [["", "", "", ""], ["1", "0", "0", ""], ["1", "0", "1", "90"]], strict=True)
    ):
        rows.append(",".join([str(run), *(cell(v) for v in values), *on]))
    done = dalembert("field", "-", "--json", stdin="\n".join(rows) + "\n")
    assert np.abs(corrections(done) * 1e3 - W).max() < 1e-12
    # the same with a fit of all runs
    done = dalembert("field", "-", "--json", "--fit", stdin="\n".join(rows) + "\n")
    assert np.abs(corrections(done) * 1e3 - W).max() < 1e-12


def test_a_wide_sheet_of_a_workbook(dalembert: Dalembert, tmp_path: Path) -> None:
    """It was refused with: unknown unit 'A_deg'."""
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    for k, line in enumerate(wide(("amplitude_{s}_mm_s", "phase_{s}_deg"), TRIALS[0]).splitlines()):
        cells = line.split(",")
        sheet.append(cells if k == 0 else [float(c) if c and c[-1].isdigit() else c or None for c in cells])
    book.save(tmp_path / "w.xlsx")
    found = rotor(dalembert("field", "w.xlsx", "--json"))
    kept = [polar(entry["mass_kg"] * 1e3, entry["angle_deg"]) for entry in found["standing"]]
    trim = [polar(entry["mass_kg"] * 1e3, entry["angle_deg"]) for entry in found["trim"]]
    assert np.abs(np.array(kept) - ON[-1]).max() < 1e-12
    assert np.abs(np.array(trim) - (W - ON[-1])).max() < 1e-12


@pytest.mark.parametrize(
    ("header", "says"),
    [
        (
            "run,A_mm_s,A_deg,B_mm_s",
            "the column B_mm_s is the amplitude at sensor B, and no column is the phase there",
        ),
        ("run,A_mm_s,A_deg,phase_B_deg", "is the phase at sensor B, and no column is the amplitude there"),
        ("run,A_mm_s,A_deg,A [mm/s]", "A_mm_s and A [mm/s] are both the amplitude at sensor A"),
        ("run,A_mm_s,A_deg,B_um,B_deg", "the sensors are in mm_s and um: expected one unit"),
    ],
)
def test_what_is_wrong_in_a_wide_sheet(header: str, says: str, dalembert: Dalembert) -> None:
    row = ",".join(["1"] * (header.count(",") + 1))
    done = dalembert("field", "-", stdin=f"{header}\n{row}\n{row}\n")
    assert done.returncode == 1
    assert says in done.stderr


def test_a_wrong_cell_is_named_by_its_line(dalembert: Dalembert) -> None:
    text = wide(PAIRS[0], TRIALS[0]).replace("1,1,0,yes", "1,one,0,yes")
    done = dalembert("field", "-", stdin=text)
    assert done.returncode == 1
    assert "line 3" in done.stderr
    assert "'one'" in done.stderr


def test_without_a_column_of_runs_each_row_is_one(dalembert: Dalembert) -> None:
    text = wide(PAIRS[0], TRIALS[0])
    bare = "\n".join(line.split(",", 1)[1] for line in text.splitlines())
    done = dalembert("field", "-", "--json", stdin=bare)
    assert np.abs(corrections(done) * 1e3 - W).max() < 1e-12
    assert any("each row is a run" in w for w in document(done)["warnings"])


BY_READING = """\
run;sensor;amplitude_mm_s;phase_deg;trial_plane;trial_mass_g;trial_angle_deg;speed_rpm
1;L1;5,5;30;;;;1500
2;L1;4,5;80;A;5;0;1500
"""


@pytest.mark.parametrize(
    "header",
    [
        "Lauf;Aufnehmer;Schwinggeschwindigkeit [mm/s];Phasenwinkel [°];Ebene;Testmasse [g];Winkel [°];Drehzahl [1/min]",
        "Messlauf;Messstelle;Schwingung (mm/s);Phase;Ausgleichsebene;Probegewicht (g);Winkellage (°);Drehzahl (U/min)",
        "run;Messpunkt;amplitude_mm_s;phase_deg;Ebene;Masse [g];Winkel [°];speed_rpm",
    ],
)
def test_german_words_in_a_table_with_a_row_a_reading(dalembert: Dalembert, header: str) -> None:
    """As in sheets with a row a run; in English nothing is renamed."""
    plain = dalembert("field", "-", stdin=BY_READING)
    assert plain.returncode == 0, plain.stderr
    german = dalembert("field", "-", stdin="\n".join([header, *BY_READING.splitlines()[1:]]))
    assert german.stdout == plain.stdout
    assert "as sensor" in german.stderr
    assert "as sensor" not in plain.stderr


@pytest.mark.parametrize("sensor", ["Lager", "Sensor", "Messstelle"])
@pytest.mark.parametrize(
    "masses",
    [
        ("Ebene", "Masse [g]", "Winkel [°]"),
        ("Ausgleichsebene", "Testmasse [g]", "Testwinkel [°]"),
        ("Wuchtebene", "Probegewicht [g]", "Probewinkel [°]"),
    ],
    ids=lambda names: names[0],
)
def test_a_german_table_with_a_row_for_each_reading(
    sensor: str, masses: tuple[str, ...], dalembert: Dalembert
) -> None:
    """Every word is known, also where that for the sensor is the English one, and `Lager` is a sensor."""
    head = ";".join(("Lauf", sensor, "Schwinggeschwindigkeit [mm/s]", "Phase [°]", *masses, "bleibt"))
    lines = [
        line.replace(",", ";").replace(".", ",").replace("yes", "ja").replace("no", "nein")
        for line in LONG.splitlines()
    ]
    done = dalembert("field", "-", "--json", stdin="\n".join([head, *lines[1:]]) + "\n")
    assert rotor(done) == rotor(dalembert("field", "-", "--json", stdin=LONG))


def test_a_german_table_of_one_sensor(dalembert: Dalembert) -> None:
    table = "Lauf;Schwingweg [µm];Phase [°];Masse [g];Winkel [°]\n1;3,4;116;;\n2;1,8;42;2;0\n"
    english = "run,amplitude_um,phase_deg,trial_mass_g,trial_angle_deg\n1,3.4,116,,\n2,1.8,42,2,0\n"
    done = dalembert("field", "-", stdin=table)
    assert done.stdout == dalembert("field", "-", stdin=english).stdout
    assert "read 'Lauf' as run, 'Schwingweg [µm]' as amplitude_um, 'Masse [g]' as trial_mass_g" in done.stderr


def test_words_of_a_wide_sheet_that_hold_the_trial_mass(dalembert: Dalembert) -> None:
    """The plane was ignored as `Ausgleichsebene`, and the angle not found as `Testwinkel 1`."""
    rows = [",".join(cell(v) for v in read) for read in READ]
    sensors = ",".join(f"{s}_mm_s,{s}_deg" for s in "ABC")
    ones = [f"Lauf,{sensors},Ausgleichsebene,Gewicht [g],Winkel [°],bleibt", f"0,{rows[0]},,,,"]
    ones += [f"1,{rows[1]},1,1,0,ja", f"2,{rows[2]},2,1,90,nein"]
    each = [
        f"Lauf,{sensors},Testmasse 1 [g],Testwinkel 1 [°],Testmasse 2 [g],Testwinkel 2 [°]",
        f"0,{rows[0]},,,,",
    ]
    each += [f"1,{rows[1]},1,0,,", f"2,{rows[2]},1,0,1,90"]
    plain = rotor(dalembert("field", "-", "--json", stdin=LONG))
    for lines in (ones, each):
        assert rotor(dalembert("field", "-", "--json", stdin="\n".join(lines) + "\n")) == plain


def test_plane_and_kept_without_trial(dalembert: Dalembert) -> None:
    """They were ignored with a warning: both trial masses were in one plane, and none stayed on."""
    done = dalembert(
        "field", "-", "--json", stdin=LONG.replace("trial_plane", "plane").replace("trial_kept", "kept")
    )
    assert document(done) == document(dalembert("field", "-", "--json", stdin=LONG))


def test_column_goes_before_the_file_of_columns(dalembert: Dalembert, tmp_path: Path) -> None:
    """Of two names for one header that of the option is taken: the other one was said to be missing."""
    (tmp_path / "names.toml").write_text('trial_mass_g = "TW"\nphase_deg = "Ph"\n')
    runs = "run,amplitude_um,Ph,TW,trial_angle_deg\n0,10,0,,\n1,12,45,2,0\n"
    call = ("field", "-", "--columns", "names.toml", "--column", "trial_mass_kg=TW")
    assert dalembert(*call, stdin=runs).stdout.startswith("rotor,plane,mass_kg,")


# -- cells that hold size and angle ------------------------------------------------------------------------------


@pytest.mark.parametrize("mark", ["@", "∠", " / ", " @ ", "<", "/"])
@pytest.mark.parametrize("degree", ["", "°", " deg"])
def test_a_cell_may_hold_amplitude_and_phase(dalembert: Dalembert, mark: str, degree: str) -> None:
    """A mass of 5 g at 0° halves 4 mm/s at 90°: the unbalance is 10 g, to be corrected at 0°."""
    rows = [("0", "4", "90", "", ""), ("1", "2", "90", "5", "0")]
    long = "run,sensor,amplitude_mm_s,trial_plane,trial_mass_g\n" + "".join(
        f"{run},1,{size}{mark}{turn}{degree},{'1' if mass else ''},{f'{mass}{mark}{at}{degree}' if mass else ''}\n"
        for run, size, turn, mass, at in rows
    )
    wide = "Lauf;A [mm/s];B [mm/s];Masse [g]\n" + "".join(
        f"{run};{size},0{mark}{turn},0{degree};{size}{mark}{turn}{degree};{f'{mass},0{mark}{at}{degree}' if mass else ''}\n"
        for run, size, turn, mass, at in rows
    )
    for text in (long, wide):
        result = document(dalembert("field", "-", "--json", stdin=text))
        (fix,) = result["rotors"][0]["corrections"]
        assert fix["mass_kg"] == pytest.approx(0.010, rel=1e-12)
        assert fix["angle_deg"] % 360 == pytest.approx(0, abs=1e-9)
        assert any("read size and angle (degrees) from the cells of" in line for line in result["warnings"])


@pytest.mark.parametrize("mark", [" @ ", "@", " ∠ ", " / ", "<"])
@pytest.mark.parametrize(("unit", "mass"), [(" mm/s", " g"), ("mm/s", "g"), ("", " g"), (" mm/s", "")])
def test_a_cell_may_have_the_unit_of_its_header(
    dalembert: Dalembert, mark: str, unit: str, mass: str
) -> None:
    text = (
        f"run;sensor;amplitude_mm_s;trial_plane;trial_mass_g\n0;1;4,0{unit}{mark}90°;;\n"
        f"1;1;2,0{unit}{mark}90;A;5{mass}{mark}0°\n"
    )
    (fix,) = document(dalembert("field", "-", "--json", stdin=text))["rotors"][0]["corrections"]
    assert fix["mass_kg"] == pytest.approx(0.010, rel=1e-12)
    assert fix["angle_deg"] % 360 == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("cell", "says"),
    [
        ("2 um @ 90°", "found '2 um @ 90°', expected mm_s, the unit in the header"),
        ("2 mm @ 90°", "expected mm_s, the unit in the header"),
        ("2 in/s @ 90°", "expected mm_s, the unit in the header"),
        ("2 mm/s @ 12 o'clock", "expected size@angle as in other rows"),
        ("2 mm/s", "expected size@angle as in other rows"),
    ],
)
def test_a_cell_of_another_unit_is_refused(dalembert: Dalembert, cell: str, says: str) -> None:
    text = f"run,sensor,amplitude_mm_s,trial_plane,trial_mass_g\n0,1,4@90,,\n1,1,{cell},A,5@0\n"
    done = dalembert("field", "-", stdin=text)
    assert (done.returncode, done.stdout) == (1, "")
    assert f"row 2 (line 3), column amplitude_mm_s: found '{cell}'" in done.stderr
    assert says in done.stderr


@pytest.mark.parametrize("first", ["Lager A", "A", "1"])
def test_a_header_over_two_columns_with_units_below(dalembert: Dalembert, first: str) -> None:
    rows = "0;4;90;1;0;;;\n1;2;90;1;0;P;5;0\n"
    over = f"Lauf;{first};;Lager B;;Ebene;Masse;Winkel\n;mm/s;°;mm/s;°;;g;°\n{rows}"
    plain = f"Lauf;{first} [mm/s];{first} [°];Lager B [mm/s];Lager B [°];Ebene;Masse [g];Winkel [°]\n{rows}"
    one, other = (document(dalembert("field", "-", "--json", stdin=text)) for text in (over, plain))
    assert one["rotors"] == other["rotors"]
    assert one["rotors"][0]["corrections"][0]["mass_kg"] == pytest.approx(0.010, rel=1e-12)


@pytest.mark.parametrize("dash", ["-", "\N{EN DASH}", "\N{EM DASH}", "\N{MINUS SIGN}", " - "])
@pytest.mark.parametrize(
    "table",
    [
        "run,sensor,speed_rpm,amplitude_mm_s,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"
        "0,1,1500,4,90,DASH,DASH,DASH\n0,2,1500,1,0,DASH,DASH,DASH\n1,1,1500,2,90,P,5,0\n1,2,1500,1,0,P,5,0\n",
        "run,sensor,amplitude_mm_s,trial_plane,trial_mass_g\n0,1,4@90,DASH,DASH\n1,1,2@90,P,5@0\n1,2,DASH,P,5@0\n0,2,3@1,,\n",
        "Lauf;A [mm/s];Phase A;B [mm/s];Phase B;m A [g];Winkel A;m B [g];Winkel B\n"
        "0;4,5;90;4;DASH;DASH;DASH;DASH;DASH\n1;2;90;2;3;5;0;DASH;DASH\n2;2;90;2;3;DASH;DASH;5;0\n",
    ],
    ids=["long", "cells of two", "wide"],
)
def test_a_dash_stands_for_an_empty_cell(dalembert: Dalembert, table: str, dash: str) -> None:
    dashed, blank = (dalembert("field", "-", "--json", stdin=table.replace("DASH", x)) for x in (dash, ""))
    assert (dashed.returncode, dashed.stdout) == (blank.returncode, blank.stdout)
    assert "found '-'" not in dashed.stderr


def test_a_dash_is_no_number_where_one_is_needed(dalembert: Dalembert) -> None:
    done = dalembert(
        "balance", "-", "--plane", "A:9mm:5mm", stdin="mass_g,radius_mm,angle_deg,z_mm\n-,1,2,3\n"
    )
    assert done.returncode == 1
    assert "found '-', expected a number" in done.stderr


def test_several_masses_in_a_cell(dalembert: Dalembert) -> None:
    """4 mm/s at 90° that 10 g at 0° would correct, with 5 g at 0° in A, and with this and 3 g at 90° in B."""
    head = "run,sensor,amplitude_mm_s,trial_plane,trial_mass_g\n"
    text = head + "0,1,4@90,,\n1,1,2@90,A,5@0\n2,1,2@90,A;B,5@0;3@90\n"
    text += "0,2,1@0,,\n1,2,1@0,A,5@0\n2,2,2@0,A;B,5@0;3@90\n"
    fix = document(dalembert("field", "-", "--json", stdin=text))["rotors"][0]["corrections"]
    assert [each["mass_kg"] for each in fix] == pytest.approx([0.010, 0.003], rel=1e-12)
    assert fix[1]["angle_deg"] == pytest.approx(270, abs=1e-9)


def test_a_cell_without_its_angle_is_named(dalembert: Dalembert) -> None:
    text = "run,sensor,amplitude_mm_s,trial_plane,trial_mass_g,trial_angle_deg\n0,1,4@90,,,\n1,1,2,1,5,0\n"
    result = dalembert("field", "-", stdin=text)
    assert result.returncode == 1
    assert "row 2 (line 3), column amplitude_mm_s: found '2', expected size@angle" in result.stderr


@pytest.mark.parametrize(
    ("header", "speed"), [("rpm", "1500"), ("RPM", "1500"), ("speed [1/min]", "1500"), ("speed_Hz", "25")]
)
def test_words_for_the_speed(dalembert: Dalembert, header: str, speed: str) -> None:
    """`rpm` alone was ignored, with an empty sentence beside."""
    text = f"run,sensor,{header},amplitude_mm_s,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"
    text += f"0,1,{speed},4,90,,,\n1,1,{speed},2,90,1,5,0\n"
    result = document(dalembert("field", "-", "--json", stdin=text))
    assert result["rotors"][0]["influence"][0]["speed_rad_s"] == pytest.approx(50 * np.pi, rel=1e-12)
    assert not any(line.endswith("read ") for line in result["warnings"])


@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("amplitude_ips", "in_s"),
        ("amplitude (µm pk-pk)", "um_pp"),
        ("velocity (mm/s RMS)", "mm_s_rms"),
        ("velocity_mm_s", "mm_s"),
        ("displacement [mils p-p]", "mil_pp"),
        ("1X amp [in/s 0-pk]", "in_s_pk"),
        ("acceleration [g peak]", "g_pk"),
        ("Schwinggeschwindigkeit [mm/s eff]", "mm_s_rms"),
    ],
)
def test_amplitudes_as_instruments_print_them(dalembert: Dalembert, header: str, unit: str) -> None:
    text = f"run,sensor,{header},phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n0,1,0.4,90,,,\n1,1,0.2,90,1,5,0\n"
    result = document(dalembert("field", "-", "--json", stdin=text))
    assert result["amplitude_unit"] == unit
    assert result["rotors"][0]["corrections"][0]["mass_kg"] == pytest.approx(0.010, rel=1e-12)
