"""Numbers, options, workbooks and outputs that were taken or refused without a word, or with a wrong one."""

from __future__ import annotations

import csv
import io
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from dalembert.quantities import parse_number, parse_quantity
from tests.cli.logs import log
from tests.cli.measured import FAN, HEAD, table
from tests.cli.printed import document
from tests.conftest import COMMAND, Dalembert

FULL = Path("/dev/full")
LOG = log([(0, 0), (10, -90), (30, -60)])
TWO_PLANES = table(
    "0,1,3.4,116,,,", "0,2,2,30,,,", "1,1,1.8,42,A,2,0", "1,2,2,40,A,2,0", "2,1,3,90,B,2,0", "2,2,3,9,B,2,0"
)


@pytest.mark.parametrize("few", ["1", "2", "39"])
def test_too_few_draws(few: str, dalembert: Dalembert) -> None:
    done = dalembert("field", "-", "--reading-error", "2%,2deg", "--monte-carlo", few, stdin=FAN)
    assert done.returncode == 2
    assert "expected 40 at least" in done.stderr
    taken = dalembert("field", "-", "--reading-error", "2%,2deg", "--monte-carlo", "40", stdin=FAN)
    assert taken.returncode == 0


def test_a_prediction_is_shown_where_the_table_goes_into_a_pipe(dalembert: Dalembert, tmp_path: Path) -> None:
    asked = ("--predict", "10kg@-90deg")
    done = dalembert("field", "-", *asked, stdin=LOG)
    assert done.stdout.startswith("rotor,plane,mass_kg")
    entries = document(dalembert("field", "-", *asked, "--json", stdin=LOG))["rotors"][0]["predict"]
    for entry in entries:
        assert f"{entry['amplitude']:.4g}" in done.stderr
    # beside a file it has a file of its own
    dalembert("field", "-", *asked, "-o", "fix.csv", stdin=LOG)
    rows = list(csv.DictReader(io.StringIO((tmp_path / "fix-predict.csv").read_text())))
    assert [row["state"] for row in rows] == ["100%n", "100%U"]
    for row, entry in zip(rows, entries, strict=True):
        assert float(row["amplitude_um_pp"]) == pytest.approx(entry["amplitude"], rel=1e-12)
        assert float(row["phase_deg"]) == pytest.approx(entry["phase_deg"], rel=1e-12)
    # where it stands already nothing more is said
    assert "should read" not in dalembert("field", "-", *asked, "--text", stdin=LOG).stderr
    assert "should read" not in dalembert("field", "-", *asked, "--json", stdin=LOG).stderr


def test_what_an_option_requests_is_shown_where_the_table_goes_into_a_pipe(dalembert: Dalembert) -> None:
    runs = FAN + "2,1,4.5,109,A,2,180\n3,1,2.1,98,A,2,90\n"
    requested = ("--suggest", "--max-mass", "50g", "--robust", "--blades", "3")
    done = dalembert("field", "-", *requested, stdin=runs)
    (rotor,) = document(dalembert("field", "-", *requested, "--json", stdin=runs))["rotors"]
    assert done.stdout.startswith("rotor,plane,mass_g")
    assert done.stdout.count("\n") == 2
    entries = [
        *rotor["suggest"]["masses"],
        *rotor["robust"]["corrections"],
        *rotor["corrections"][0]["split"],
    ]
    for entry in entries:
        assert f"mass_g {1e3 * entry['mass_kg']:.6g}, " in done.stderr
    assert f"uncertainty_after_g {1e3 * rotor['suggest']['uncertainty_after_kg']:.6g}" in done.stderr


def test_the_view_of_two_planes_is_shown_where_the_table_goes_into_a_pipe(dalembert: Dalembert) -> None:
    done = dalembert("field", "-", "--view", "static-couple", stdin=TWO_PLANES)
    (rotor,) = document(dalembert("field", "-", "--view", "static-couple", "--json", stdin=TWO_PLANES))[
        "rotors"
    ]
    for part in rotor["static_couple"].values():
        assert f"mass_g {1e3 * part['mass_kg']:.6g}, angle_deg {part['angle_deg']:.6g}" in done.stderr


@pytest.mark.skipif(not FULL.exists(), reason="no file that is always full")
@pytest.mark.parametrize("options", [(), ("--json",), ("--help",)])
def test_standard_output_that_is_full(options: tuple[str, ...], dalembert: Dalembert, tmp_path: Path) -> None:
    (tmp_path / "fan.csv").write_text(FAN)
    program = dalembert("--version").args[0]
    with FULL.open("w") as full:
        done = subprocess.run(
            [program, "field", "fan.csv", *options],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            check=False,
        )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("dalembert: standard output: cannot write: ")
    assert "internal" not in done.stderr
    assert "Exception" not in done.stderr


def test_a_unicode_minus_is_a_minus(dalembert: Dalembert) -> None:
    minus = "\N{MINUS SIGN}"
    assert parse_number(f"{minus}300") == -300
    assert parse_quantity(f"{minus}30 deg", "angle") == (-30, "deg")
    assert parse_number(f"1e{minus}3") == 0.001
    turned = FAN.replace("A,2,0", f"A,2,{minus}20")
    plain = FAN.replace("A,2,0", "A,2,-20")
    assert dalembert("field", "-", stdin=turned).stdout == dalembert("field", "-", stdin=plain).stdout
    assert dalembert("place", f"3g@{minus}20deg").stdout == dalembert("place", "3g@-20deg").stdout
    for text in (f"{minus}{minus}3", "\N{EN DASH}3", f"3{minus}3"):
        with pytest.raises(ValueError, match=text[-1]):
            parse_number(text)


@pytest.mark.parametrize(
    ("cell", "expected"),
    [
        ("1e300", "expected a number of at most 1e+60"),
        ("-1e61", "expected a number of at most 1e+60"),
        ("1e400", "expected a number of at most 1e+60"),
        ("five", "expected a number\n"),
        ("inf", "expected a number\n"),
        ("nan", "expected a number\n"),
    ],
)
def test_a_number_that_is_too_large_is_a_number(cell: str, expected: str, dalembert: Dalembert) -> None:
    done = dalembert("field", "-", stdin=FAN.replace("3.4", cell))
    assert done.returncode == 1
    assert f"found '{cell}', {expected}" in done.stderr


@pytest.mark.parametrize(
    ("ref", "right"), [("1", True), ("1,0", True), ("1,5", False), ("0,5", False), ("x", False)]
)
def test_ref_is_a_whole_number(ref: str, right: bool, dalembert: Dalembert) -> None:
    rows = f""" ;DoubleA;phase;mass;phase;ref;use
100%n;80;40;0;0;-1;0
100%n;99,030381;43,960790;10;-90;1;1
100%n;95,459687;55,577102;10;90;{ref};1
"""
    done = dalembert("field", "-", stdin=rows)
    assert (done.returncode == 0) is right
    if not right:
        assert f"column ref: found '{ref}', expected -1, or the number of an earlier run" in done.stderr


def test_a_missing_folder_is_named_by_the_file_that_was_asked_for(
    dalembert: Dalembert, tmp_path: Path
) -> None:
    for options in (
        ("-o", "nodir/x.csv"),
        ("--plot", "nodir/x.csv.svg"),
        ("--save-influence", "nodir/x.csv"),
    ):
        done = dalembert("field", "-", *options, stdin=FAN)
        assert done.returncode == 1
        assert f"{options[1]}: cannot write: no folder nodir" in done.stderr
        assert list(tmp_path.iterdir()) == []
    # before any other file is written
    dalembert("field", "-", "-o", "there.csv", "--plot", "nodir/x.svg", stdin=FAN)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--speed", "3000rpm"), "expected --grade too"),
        (("--rotor-mass", "12kg"), "expected --grade too"),
        (("--permissible", "30g_mm", "--speed", "3000rpm"), "goes with --grade"),
        (("--bearings", "0mm:90mm"), "expected --grade or --permissible for a tolerance"),
    ],
)
def test_a_speed_without_a_grade_is_not_ignored(
    options: tuple[str, ...], says: str, dalembert: Dalembert
) -> None:
    table = "mass_g,radius_mm,angle_deg\n10,20,30\n"
    done = dalembert("balance", "-", "--plane", "A:20mm", *options, stdin=table)
    assert done.returncode == 2
    assert says in " ".join(done.stderr.split())
    if options[0] != "--bearings":
        done = dalembert("field", "-", *options, stdin=FAN)
        assert done.returncode == 2
        assert says in " ".join(done.stderr.split())


def workbook(path: Path, *, shown: bool) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append([*HEAD.split(","), "remark"])
    for row in ([0, 1, 3.4, 116, None, None, None, 0.5], [1, 1, 1.8, 42, "A", 0.02, 0, 0.5]):
        sheet.append(row)
    if not shown:
        sheet["F3"].number_format = "0.0%"
        sheet["H2"].number_format = "0%"  # a column that is not read
        sheet.row_dimensions[3].hidden = True
        sheet.row_dimensions[9].hidden = True  # an empty one
        sheet.column_dimensions["D"].hidden = True
        sheet.column_dimensions["H"].hidden = True
    book.save(path)


def test_hidden_rows_and_percentages_of_a_workbook_are_remarked(dalembert: Dalembert, tmp_path: Path) -> None:
    workbook(tmp_path / "shown.xlsx", shown=True)
    workbook(tmp_path / "hidden.xlsx", shown=False)
    plain = document(dalembert("field", "shown.xlsx", "--json"))
    looks = document(dalembert("field", "hidden.xlsx", "--json"))
    assert looks["rotors"] == plain["rotors"]
    more = [w for w in looks["warnings"] if w.replace("hidden.xlsx", "shown.xlsx") not in plain["warnings"]]
    assert [w.split(": ", 2)[2] for w in more] == [
        "the row 3 is hidden and takes part",
        "the column D is hidden and takes part",
        "the cell F3 is shown as percentage, and read as the number behind: 50 % is 0.5",
    ]


OPEN_DOCUMENT = """<office:document-content xmlns:office="urn:oasis:names:tc:opendocument:xmlns:office:1.0"
 xmlns:table="urn:oasis:names:tc:opendocument:xmlns:table:1.0" xmlns:text="urn:oasis:names:tc:opendocument:xmlns:text:1.0"
 office:version="1.2"><office:body><office:spreadsheet><table:table table:name="S">
<table:table-column table:number-columns-repeated="5"/><table:table-column table:visibility="collapse"/>{rows}
</table:table></office:spreadsheet></office:body></office:document-content>"""


def test_the_same_of_an_open_document(dalembert: Dalembert, tmp_path: Path) -> None:
    import zipfile

    def cell(value: str, kind: str = "float") -> str:
        if not value:
            return "<table:table-cell/>"
        if kind == "string":
            return f'<table:table-cell office:value-type="string"><text:p>{value}</text:p></table:table-cell>'
        return f'<table:table-cell office:value-type="{kind}" office:value="{value}"><text:p>{value}</text:p></table:table-cell>'

    def row(cells: list[str], looks: str = "") -> str:
        return f"<table:table-row{looks}>{''.join(cells)}</table:table-row>"

    first = row([cell(v) for v in ("0", "1", "3.4", "116")] + [cell("")] * 3)
    last = [
        cell("1"),
        cell("1"),
        cell("1.8"),
        cell("42"),
        cell("A", "string"),
        cell("0.02", "percentage"),
        cell("0"),
    ]
    rows = row([cell(name, "string") for name in HEAD.split(",")]) + first
    rows += row(last, ' table:visibility="filter"')
    with zipfile.ZipFile(tmp_path / "o.ods", "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("META-INF/manifest.xml", "<manifest/>")
        archive.writestr("content.xml", OPEN_DOCUMENT.format(rows=rows))
    warnings = " ".join(document(dalembert("field", "o.ods", "--json"))["warnings"])
    assert "the row 3 is hidden" in warnings
    assert "the column F is hidden" in warnings
    assert "the cell F3 is shown as percentage" in warnings


def test_a_phase_just_below_a_full_turn_is_not_printed_as_360(dalembert: Dalembert) -> None:
    """A residual of 359.999 degrees was rounded to 360 in the terminal's tables."""
    v0, v1 = 3.0 * np.exp(-1e-5j), 1.0 * np.exp(-1e-5j)
    cells = [f"{float(abs(v))!r},{float(np.degrees(np.angle(v)) % 360)!r}" for v in (v0, v1)]
    text = table(f"0,1,{cells[0]},,,", f"1,1,{cells[1]},A,2,0", f"2,1,{cells[0]},,,")
    for options in ((), ("--fit",), ("--max-mass", "1g")):
        said = dalembert("field", "-", "--text", *options, stdin=text).stdout
        assert "360" not in said.split(), said
        for row in csv.DictReader(io.StringIO(dalembert("field", "-", *options, stdin=text).stdout)):
            assert 0 <= float(row["angle_deg"]) < 360
    entry = json.loads(dalembert("field", "-", "--json", stdin=text).stdout)["rotors"][0]["corrections"][0]
    assert 0 <= entry["angle_deg"] < 360


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        ("dx_mm,dtheta_deg", "vx_mm_s and omega_rad_s"),
        ("dy [mm],dphi [deg]", "vy_mm_s and omega_rad_s"),
        ("DX_m,dy_m", "vx_mm_s and vy_mm_s"),
    ],
)
def test_virtual_displacements_are_named_and_not_taken_for_rest(
    columns: str, expected: str, dalembert: Dalembert
) -> None:
    """They were ignored, and then 'omega of link 2 is zero'."""
    text = f"link,{columns},fx_N,torque_N_m\n2,1,2,,?\n4,3,4,-10,\n"
    done = dalembert("work", "-", stdin=text)
    assert done.returncode == 1
    first, second = columns.split(",")
    assert (
        f"the columns {first} and {second} hold virtual displacements: expected velocities, {expected}"
        in done.stderr
    )
    # beside velocities such a column is one of the keeper's own
    both = "link,dx_mm,vx_mm_s,omega_rad_s,fx_N,torque_N_m\n2,1,,2,,?\n4,3,5,,-10,\n"
    assert dalembert("work", "-", stdin=both).returncode == 0


def test_rows_of_a_run_that_contradict_each_other(dalembert: Dalembert) -> None:
    """One `yes` kept the mass, whatever the other rows of the run had; the weight of the sensor's first row counted alone."""

    def field(head: str, *ends: str) -> subprocess.CompletedProcess[str]:
        rows = ["0,1,3.4,116,,,", "0,2,2,10,,,", "1,1,1.8,42,A,2,0", "1,2,2.5,33,A,2,0"]
        return dalembert(
            "field", "-", stdin=table(*map(",".join, zip(rows, ends, strict=True)), head=f"{HEAD},{head}")
        )

    done = field("trial_kept", "", "", "yes", "no")
    assert (done.returncode, "the same as elsewhere in run 1" in done.stderr) == (1, True)
    assert field("trial_kept", "", "", "", "yes").returncode == 0
    done = field("weight", "1", "3", "2", "3")
    assert (done.returncode, "found '2', expected 1 as elsewhere for this sensor" in done.stderr) == (1, True)
    assert field("weight", "1", "3", "1", "3").stdout == field("weight", "", "", "1", "3").stdout


def test_a_pipe_whose_encoding_lacks_a_character(dalembert: Dalembert, tmp_path: Path) -> None:
    """Windows pipes are cp1252, which has neither the minus sign nor the root of a worked solution."""
    dalembert("examples", "riul-rotor")
    planes = ["--plane", "A:0mm:20mm", "--plane", "B:90mm:20mm"]
    done = subprocess.run(
        [str(COMMAND), "balance", "rotor.csv", *planes, "--steps"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": "cp1252"},
        capture_output=True,
        check=False,
        timeout=300,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert "d2 = \\u2212(563.718" in done.stdout.decode("cp1252")


@pytest.mark.parametrize("options", [["--about", "title=\udcff", "--report", "r.html"], ["-o", "x.csv"]])
def test_an_option_that_is_no_text_in_utf_8(options: list[str], dalembert: Dalembert, tmp_path: Path) -> None:
    dalembert("examples", "riul-rotor")
    plane = "A:20mm" if "--about" in options else "\udcff:20mm"
    done = dalembert("balance", "rotor.csv", "--plane", plane, *options)
    assert done.returncode == 1
    assert "expected text in UTF-8" in done.stderr
    assert not [path for path in tmp_path.iterdir() if path.name[0] in ".rx" and path.name != "rotor.csv"]


def test_a_picture_that_cannot_be_drawn_is_refused(dalembert: Dalembert, tmp_path: Path) -> None:
    """--plot of several variants wrote no file, with status 0; `trial` and `signal` have no picture and list no --plot."""
    (tmp_path / "crank.toml").write_text(
        '[ground]\nO = [0, 0]\n[links.crank]\npoints = { O = [0, 0], P = [1, 0] }\n[input]\nlink = "crank"\n'
    )
    picture = tmp_path / "p.svg"
    call = ("mechanism", str(tmp_path / "crank.toml"), "--at", "30deg")
    done = dalembert(*call, "--over", "links.crank.P.x=1m:2m:1m", "--plot", str(picture))
    assert (done.returncode, done.stdout) == (2, "")
    assert "--plot: expected one mechanism" in done.stderr
    assert not picture.exists()
    assert dalembert(*call, "--plot", str(picture)).returncode == 0
    assert picture.exists()
    for words in (("trial",), ("signal",)):
        assert "--plot" not in dalembert(*words, "--help").stdout


def test_a_unit_made_of_words_is_converted(dalembert: Dalembert) -> None:
    states = "link,torque_lbf_ft,omega_rpm\na,?,60\nb,3,60\n"
    done = dalembert("work", "-", "--units", "N_m", stdin=states)
    assert done.stdout == "step,link,torque_N_m\n1,a,-4.067453844994201\n"


def test_a_wanted_result_may_carry_its_unit(dalembert: Dalembert) -> None:
    body = "inertia = [1.0, 2.0, 3.0]\nomega = [0.0, 0.0, 1.0]\n"
    for wanted in ("energy=6J", "momentum.z=6 kg m²/s"):
        done = dalembert("spin", "-", "--find", "omega.z", "--so-that", wanted, "--json", stdin=body)
        assert document(done)["found"]["omega.z_rad_s"] == pytest.approx(2.0, rel=1e-12)


def test_a_number_that_is_too_large_is_called_so(dalembert: Dalembert) -> None:
    done = dalembert("body", "-", "--omega", "1e99,0,0", stdin="part,shape,mass_kg\na,point,1\n")
    assert (done.returncode, "'1e99' is too large a number" in done.stderr) == (2, True)


PENDULUM = """gravity = [0, -9.81]
[ground]
O = [0, 0]
[links.bob]
points = { O = [0, 0], P = [1, 0] }
mass = 2
center = [1, 0]
[input]
link = "bob"
speed = 1
[[friction]]
joint = "O"
coefficient = 0.1
"""


@pytest.mark.parametrize("call", [("forces", "-"), ("simulate", "-", "--time", "0:1:0.5")])
def test_friction_at_a_pin_without_a_radius_is_named(call: tuple[str, ...], dalembert: Dalembert) -> None:
    text = PENDULUM
    line = "warning: [[friction]] 1: no effect at the pin O: its friction acts on the radius of the pin; add radius"
    assert line in dalembert(*call, stdin=text).stderr.splitlines()
    assert "no effect" not in dalembert(*call, stdin=text + "radius = 0.01\n").stderr
