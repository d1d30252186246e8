"""Tables as people have them: foreign headers, units in brackets or in a row, titles, `--column`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import Dalembert

PLANE = ("--plane", "A:20mm")
PLAIN = "mass_g,radius_mm,angle_deg\n90.5,30,60\n60,50.25,210\n"

SAME = {
    "brackets": "mass [g],radius [mm],angle [°]\n90.5,30,60\n60,50.25,210\n",
    "parentheses": "Mass (g),Radius (mm),Angle (deg)\n90.5,30,60\n60,50.25,210\n",
    "commas": '"Mass, g","radius, mm","angle, °"\n90.5,30,60\n60,50.25,210\n',
    "semicolons with commas in the header": "Mass, g;Radius, mm;Angle, °\n90,5;30;60\n60;50,25;210\n",
    "only decimal commas": "Mass, g;Radius, mm;Angle, °\n90,5;30,0;60,0\n60,0;50,25;210,0\n",
    "in": "mass in g;radius in mm;angle in °\n90,5;30;60\n60;50,25;210\n",
    "as quotients": "mass / g;radius / mm;angle / deg\n90,5;30;60\n60;50,25;210\n",
    "a row of units": "mass;radius;angle\ng;mm;°\n90,5;30;60\n60;50,25;210\n",
    "a row of units in brackets": "mass;radius;angle\n[g];[mm];[deg]\n90,5;30;60\n60;50,25;210\n",
    "a row of units that agrees": "mass_g\tradius [mm]\tangle\ng\tmm\tdeg\n90,5\t30\t60\n60\t50,25\t210\n",
    "units of some": "mass_g,radius_mm,angle\n,,deg\n90.5,30,60\n60,50.25,210\n",
    "an angle with its sign": "mass_g,radius_mm,angle_°\n90.5,30,60\n60,50.25,210\n",
    "a title": "Rotor 7; hall 2\n\nmass_g;radius_mm;angle_deg\n90,5;30;60\n60;50,25;210\n",
    "a title with words of quantities": "Mass\nmass [g],radius [mm],angle [°]\n90.5,30,60\n60,50.25,210\n",
    "strokes between cells": "mass [g]|radius [mm]|angle [°]\n90,5|30|60\n60|50,25|210\n",
    "a first column without a header": ",mass_g,radius_mm,angle_deg\nW1,90.5,30,60\nW2,60,50.25,210\n",
    "a header shorter than its rows": "mass_g,radius_mm,angle_deg\nW1,90.5,30,60\nW2,60,50.25,210\n",
}


@pytest.mark.parametrize("table", SAME)
def test_a_table_means_what_the_plain_one_means(table: str, dalembert: Dalembert) -> None:
    done = dalembert("balance", "-", *PLANE, stdin=SAME[table])
    assert done.returncode == 0, done.stderr
    assert done.stdout == dalembert("balance", "-", *PLANE, stdin=PLAIN).stdout
    if "title" in table:
        assert "the header is in line" in done.stderr


def test_micro_and_per_minute(dalembert: Dalembert) -> None:
    head = "run;speed [{}];amplitude [{}];phase [{}];trial plane;trial mass [g];trial angle [{}]"
    rows = "\n0;1480;3,4;116;;;\n1;1480;1,8;42;A;2;0\n"
    plain = dalembert("field", "-", "--json", stdin=head.format("rpm", "um", "deg", "deg") + rows)
    assert plain.returncode == 0, plain.stderr
    for units in (("1/min", "µm", "°", "°"), ("U/min", "μm", "deg", "°"), ("min⁻¹", "um", "°", "deg")):
        done = dalembert("field", "-", "--json", stdin=head.format(*units) + rows)
        assert done.stdout == plain.stdout, done.stderr


def test_a_large_table_with_a_row_of_units(dalembert: Dalembert) -> None:
    rows = "".join(f"R{i};90,5;30;60\nR{i};60;50,25;210\n" for i in range(6000))
    units = dalembert("balance", "-", *PLANE, stdin=f"rotor;mass;radius;angle\n;g;mm;°\n{rows}")
    plain = dalembert("balance", "-", *PLANE, stdin=f"rotor;mass_g;radius [mm];angle_deg\n{rows}")
    assert units.returncode == plain.returncode == 0, units.stderr + plain.stderr
    assert units.stdout == plain.stdout


GERMAN = "Teil;Masse [g];Halbmesser;Winkel\n;;mm;°\nW1;90,5;30;60\nW2;60;50,25;210\n"
COLUMNS = ("--column", "mass_g=Masse [g]", "--column", "radius=halbmesser", "--column", "angle_deg=Winkel")


def test_column_takes_a_foreign_name(dalembert: Dalembert) -> None:
    plain = dalembert("balance", "-", *PLANE, stdin=PLAIN)
    done = dalembert("balance", "-", *PLANE, *COLUMNS, stdin=GERMAN)
    assert done.returncode == 0, done.stderr
    assert done.stdout == plain.stdout
    short = dalembert("balance", "-", *PLANE, "--column", "mass=Masse", *COLUMNS[2:], stdin=GERMAN)
    assert short.stdout == plain.stdout
    named = dalembert(
        "balance", "-", *PLANE, "--column", "name=", stdin=SAME["a header shorter than its rows"]
    )
    assert (named.stdout, named.stderr) == (plain.stdout, "")


@pytest.mark.parametrize(
    ("mass", "radius", "angle"),
    [
        ("Mass [g]", "Radius [mm]", "Theta [deg]"),
        ("Masse [g]", "Halbmesser [mm]", "Winkel [deg]"),
        ("massa [g]", "raio [mm]", "ângulo [deg]"),
        ("Masa (g)", "Radio (mm)", "Ángulo (deg)"),
        ("masse_g", "rayon_mm", "angle_deg"),
    ],
)
def test_words_of_other_languages_are_read_and_said(
    mass: str, radius: str, angle: str, dalembert: Dalembert
) -> None:
    done = dalembert("balance", "-", *PLANE, stdin=f"{mass};{radius};{angle}\n90,5;30;60\n60;50,25;210\n")
    assert done.returncode == 0, done.stderr
    assert done.stdout == dalembert("balance", "-", *PLANE, stdin=PLAIN).stdout
    foreign = {mass: "mass_g", radius: "radius_mm", angle: "angle_deg"}
    for header, name in foreign.items():
        english = header.lower().startswith(name.partition("_")[0] + " ") or header == name
        assert (f"'{header}' as {name}" in done.stderr) is not english


@pytest.mark.parametrize("column", ["mass_g=Masse (Probe)", "mass_g=Masse"])
def test_words_in_brackets_are_no_unit(column: str, dalembert: Dalembert) -> None:
    table = "Masse (Probe);radius_mm;angle_deg\n90,5;30;60\n60;50,25;210\n"
    done = dalembert("balance", "-", *PLANE, "--column", column, stdin=table)
    assert done.stdout == dalembert("balance", "-", *PLANE, stdin=PLAIN).stdout
    refused = dalembert("balance", "-", *PLANE, stdin=table)
    assert (refused.returncode, refused.stdout) == (1, "")
    assert "did you mean" not in refused.stderr
    clash = dalembert("balance", "-", *PLANE, "--column", "mass_g=Masse", stdin=table.replace("Probe", "kg"))
    assert "found the unit 'kg' in the file, expected 'g'" in clash.stderr


def test_every_column_of_a_german_table_is_read(dalembert: Dalembert, tmp_path: Path) -> None:
    planes = ("--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm")
    german = "Läufer;Bezeichnung;Gewicht [N];Radius [mm];Winkellage [Grad];Abstand [mm]\n"
    plain = "rotor;name;weight_N;radius_mm;angle_deg;z_mm\n"
    rows = "A;W1;90,5;30;60;10\nA;W2;60;50,25;210;30\nB;W1;1;2;3;4\n"
    done = dalembert("balance", "-", *planes, stdin=german + rows)
    assert done.returncode == 0, done.stderr
    assert done.stdout == dalembert("balance", "-", *planes, stdin=plain + rows).stdout
    (tmp_path / "planes.csv").write_text("Ebene;z [mm];Halbmesser [mm]\nA;0;20\nB;90;20\n")
    again = dalembert("balance", "-", "--planes", "planes.csv", stdin=german + rows)
    assert again.stdout == done.stdout


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("Masse [g];Gewicht [g];Radius [mm];Winkel [°]", "no column mass_kg"),  # two of one meaning
        ("Masse [mm];Radius [mm];Winkel [°];Name", "Masse [mm], Radius [mm], Winkel [°], Name)\n"),
        ("Masse [Pfund];Radius [mm];Winkel [°];Name", "Masse [Pfund], Radius [mm], Winkel [°], Name)\n"),
        ("Masse;Radius [mm];Winkel [°];Name", "--column mass_kg=Masse"),
        ("Masse [g];Radius [mm];Unwucht [g mm];Winkel [°]", "mixed columns Masse [g] and Unwucht [g mm]"),
    ],
)
def test_a_foreign_header_that_is_not_plain_is_refused(
    header: str, message: str, dalembert: Dalembert
) -> None:
    done = dalembert("balance", "-", *PLANE, stdin=f"{header}\n1;2;3;4\n")
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (1, "", 1)
    assert message in done.stderr


def test_a_table_that_can_be_read_is_read_as_it_is(dalembert: Dalembert) -> None:
    done = dalembert("balance", "-", *PLANE, stdin="mass_g;radius_mm;angle_deg;Abstand [mm]\n1;2;3;4\n")
    assert done.stderr == (
        "warning: standard input: ignored the column 'Abstand [mm]'; to read: --column z_mm='Abstand [mm]'\n"
    )


@pytest.mark.parametrize("header", ["Winkel [Grad];Drehmoment [Nm]", "Kurbelwinkel / Grad;Moment / N m"])
def test_a_german_table_of_torque(header: str, dalembert: Dalembert) -> None:
    options = ("--speed", "600rpm", "--fluctuation", "0.02")
    rows = "0;10\n180;-10\n360;10\n"
    done = dalembert("flywheel", "-", *options, stdin=f"{header}\n{rows}")
    assert done.stdout == dalembert("flywheel", "-", *options, stdin=f"angle_deg;torque_N_m\n{rows}").stdout
    assert done.returncode == 0


@pytest.mark.parametrize(
    ("header", "plain"),
    [
        ("Umschlagwinkel [Grad];Unwucht [g mm];Winkel [Grad]", "turned_deg;unbalance_g_mm;angle_deg"),
        ("Drehwinkel [°];Schwingweg [µm];Phase [°]", "turned_deg;amplitude_um;phase_deg"),
        ("turned_deg;Unwucht [g mm];Winkel [°]", "turned_deg;unbalance_g_mm;angle_deg"),
    ],
)
def test_a_german_table_of_positions(header: str, plain: str, dalembert: Dalembert) -> None:
    rows = "0;5,5;30\n180;4;100\n"
    done = dalembert("index", "-", stdin=f"{header}\n{rows}")
    assert done.returncode == 0, done.stderr
    assert done.stdout == dalembert("index", "-", stdin=f"{plain}\n{rows}").stdout


@pytest.mark.parametrize(
    "trial",
    [
        "Ebene;Testmasse [g];Testwinkel [°]",
        "Ausgleichsebene;Ausgleichsmasse [g];Ausgleichswinkel [Grad]",
        "Wuchtebene;Setzgewicht [Gramm];Setzwinkel [Grad]",
        "Ebene;Testunwucht [g mm];Testwinkel [Grad]",
    ],
)
def test_a_german_word_for_a_trial_mass(trial: str, dalembert: Dalembert) -> None:
    rows = "\n0;1;80,5;40;;;\n1;1;60;90;A;5;0\n"
    plain = "run;sensor;amplitude_um;phase_deg;trial_plane;trial_mass_g;trial_angle_deg"
    if "unwucht" in trial:
        plain = plain.replace("trial_mass_g", "trial_unbalance_g_mm")
    done = dalembert("field", "-", stdin=f"Lauf;Lager;Schwingweg [µm];Phase [°];{trial}{rows}")
    assert done.returncode == 0, done.stderr
    assert done.stdout == dalembert("field", "-", stdin=plain + rows).stdout


def test_a_german_run_out(dalembert: Dalembert, tmp_path: Path) -> None:
    runs = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n0,1,5,40,,,\n1,1,6,90,A,10,0\n"
    (tmp_path / "plain.csv").write_text("sensor;amplitude_um;phase_deg\n1;0,5;30\n")
    (tmp_path / "german.csv").write_text("Lager;Schwingweg [µm];Phase [Grad]\n1;0,5;30\n", encoding="utf-8")
    german, plain = (
        dalembert("field", "-", "--runout", f"{name}.csv", stdin=runs) for name in ("german", "plain")
    )
    assert german.returncode == 0, german.stderr
    assert german.stdout == plain.stdout


def test_a_recording_with_a_german_time(dalembert: Dalembert) -> None:
    rows = "".join(f"{k};{int(k % 20 == 3)};{k % 20}\n" for k in range(100))
    plain = dalembert("signal", "-", stdin=f"t_ms;mark;A_um\n{rows}")
    assert plain.returncode == 0, plain.stderr
    for time in ("Zeit [ms]", "time_ms"):
        assert dalembert("signal", "-", stdin=f"{time};Mark;A [µm]\n{rows}").stdout == plain.stdout


@pytest.mark.parametrize(
    ("mass", "expected"),
    [
        ("1.010,5", "a number without marks between its thousands"),
        ("1 010,5", "a number without marks between its thousands"),
        ("1,010.5", "a number without marks between its thousands"),
        ("1'010", "a number without marks between its thousands"),
        ("1.010", "a number with a decimal comma, as elsewhere in the file"),  # 1010 or 1.01
        ("10,5 g", "a number alone: its unit stands in the header"),
        ("10.05.2024", "a number"),
        ("", "a number"),
    ],
)
def test_a_cell_that_is_no_number_among_decimal_commas(
    mass: str, expected: str, dalembert: Dalembert
) -> None:
    done = dalembert("balance", "-", *PLANE, stdin=f"mass_g;radius_mm;angle_deg\n{mass};20,5;30\n")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.endswith(f"found '{mass}', expected {expected}\n")


def test_a_column_that_may_be_meant_is_offered_in_the_remark(dalembert: Dalembert) -> None:
    done = dalembert("balance", "-", *PLANE, stdin="Läufer,mass_g,radius_mm,angle_deg\nA,1,2,3\nB,1,2,3\n")
    assert done.returncode == 0
    assert "ignored the column 'Läufer'; to read: --column rotor='Läufer'" in done.stderr


@pytest.mark.parametrize(
    ("table", "options", "status", "message"),
    [
        (
            "mass_kg;radius;angle\ng;mm;°\n1;2;3\n",
            (),
            1,
            "row of units (line 2), column mass_kg: found 'g', expected 'kg', the unit in its header",
        ),
        ("mass;radius;angle\nkg;mm;V\n1;2;3\n", (), 1, "column angle has the unknown unit 'V'"),
        ("mass;radius;angle\n1;2;3\n", (), 1, "column mass has no unit: expected mass_kg"),
        (GERMAN, ("--column", "mass_kg=Masse"), 1, "found the unit 'g' in the file, expected 'kg'"),
        (PLAIN, ("--column", "mass_kg=Gewicht"), 1, "no table has a column 'Gewicht'"),
        (PLAIN, ("--column", "mass_kg"), 2, "expected NAME=HEADER, such as mass_kg=Masse"),
        ("mass_g,radius_mm,angle_deg\n1,2,3,4\n", (), 1, "row 1 (line 2): found 4 cells, expected 3"),
    ],
)
def test_what_contradicts_itself(
    table: str, options: tuple[str, ...], status: int, message: str, dalembert: Dalembert
) -> None:
    done = dalembert("balance", "-", *PLANE, *options, stdin=table)
    assert done.returncode == status
    assert message in " ".join(done.stderr.split())
    assert done.stdout == ""


def test_expected_values_under_foreign_headers(dalembert: Dalembert, tmp_path: Path) -> None:
    expected = "Mass [g];angle\n;deg\n75,554;326,056\n"
    (tmp_path / "expected.csv").write_text(expected)
    done = dalembert("balance", "-", *PLANE, "--expect", "expected.csv", stdin=PLAIN)
    assert done.returncode == 0, done.stderr
    assert "2 of 2" in done.stdout
    (tmp_path / "expected.csv").write_text(expected.replace("Mass", "Masse"))
    mapped = ("--expect", "expected.csv", "--column", "mass_g=Masse")
    assert dalembert("balance", "-", *PLANE, *mapped, stdin=PLAIN).stdout == done.stdout


def test_a_column_name_may_add_how_an_amplitude_is_read(dalembert):
    rows = "run,sensor,Schwing [mm/s],phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n0,1,5,40,,,\n1,1,6,90,A,10,0\n"
    done = dalembert("field", "-", "--column", "amplitude_mm_s_rms=Schwing [mm/s]", "--json", stdin=rows)
    assert done.returncode == 0, done.stderr
    assert '"amplitude_unit": "mm_s_rms"' in done.stdout
    done = dalembert("field", "-", "--column", "amplitude_um=Schwing [mm/s]", stdin=rows)
    assert done.returncode == 1
    assert "expected 'um'" in done.stderr


def test_columns_without_a_header(dalembert: Dalembert) -> None:
    """Those without any cell, as spreadsheets leave them at the end, are none; of others their number is said."""
    empty = "mass_g,radius_mm,angle_deg,,\n90.5,30,60,,\n60,50.25,210,,\n"
    done = dalembert("balance", "-", *PLANE, stdin=empty)
    assert (done.returncode, done.stderr) == (0, "")
    done = dalembert("balance", "-", *PLANE, stdin=empty.replace("60,,", "60,x,y"))
    assert done.stderr == "warning: standard input: ignored 2 columns without a header\n"


@pytest.mark.parametrize("unit", ["g.mm", "g·mm", "g mm", "g*mm", "g_mm"])
def test_every_spelling_of_an_unbalance(unit: str, dalembert: Dalembert) -> None:
    done = dalembert("balance", "-", "--plane", "A:1mm", stdin=f"unbalance [{unit}],angle_deg\n10,0\n")
    assert done.stdout == "rotor,plane,radius_mm,unbalance_g_mm,mass_g,angle_deg\n1,A,1.0,10.0,10.0,180.0\n"
