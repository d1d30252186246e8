"""Pages of rotors that compute: tables of masses, mode shapes, machines' sheets."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.test_pages_that_compute import EXAMPLES, Computing
from tests.conftest import Dalembert

RIUL = (
    EXAMPLES / "riul-rotor" / "rotor.csv",
    "--plane",
    "A:0mm:20mm",
    "--plane",
    "B:90mm:20mm",
    "--gravity",
    "10",
)


def test_a_table_of_masses(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    done = dalembert("balance", *RIUL, "--page", "b.html", "--json")
    assert done.returncode == 0, done.stderr
    page = Computing(browser, tmp_path / "b.html")

    def hold(out: str) -> None:
        for row in json.loads(out)["rotors"][0]["corrections"]:
            plane = row["plane"]
            assert page.get(f"{plane}.unbalance") == pytest.approx(row["unbalance_kg_m"], rel=1e-12)
            assert page.get(f"{plane}.mass") == pytest.approx(row["mass_kg"], rel=1e-12)
            assert page.get(f"{plane}.angle") == pytest.approx(math.radians(row["angle_deg"]), rel=1e-12)

    hold(done.stdout)
    for plane, arrow in zip("AB", page.paths("svg.polygon path.closing"), strict=True):
        # counter-clockwise, where a screen's y points down
        x, y = arrow[1] - arrow[0]
        assert math.remainder(math.atan2(-y, x) - page.get(f"{plane}.angle"), 2 * math.pi) == pytest.approx(
            0, abs=1e-3
        )
    page.type("W1.radius", "3,5 cm")
    page.button("add a row")
    page.put(W3__weight=12.0, W3__radius=0.04, W3__angle=1.0, W3__z=0.05)
    (tmp_path / "again.csv").write_text(page("return dalembert.csv()"))
    again = dalembert("balance", "again.csv", *RIUL[1:], "--json")
    assert again.returncode == 0, again.stderr
    hold(again.stdout)
    for text in ("", "much", "-3"):
        page.type("W2.weight", text)
        assert page.alert
        assert math.isnan(page.get("A.unbalance"))
        assert page.table("Corrections: material to add")["A"] == ["–"] * 3
        assert page("return dalembert.csv()") == ""
    page.button("undo")
    page.button("reset")
    hold(done.stdout)
    assert page("return document.documentElement.scrollWidth <= innerWidth")
    assert page.faults() == []


@pytest.mark.slow
def test_a_plane_whose_place_is_not_stated(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """What its correction leaves of the couple was that of a plane at z = 0."""
    assert (
        dalembert(
            "balance", RIUL[0], "--plane", "A:20mm", "--center-z", "45mm", "--page", "b.html"
        ).returncode
        == 0
    )
    page = Computing(browser, tmp_path / "b.html")
    assert page.get("couple.unbalance") > 0
    assert math.isnan(page.get("residual.couple"))
    assert page.faults() == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "how",
    [
        ("--round-mass", "0.1g", "--round-angle", "1deg"),
        ("--round-mass", "2g"),
        ("--round-angle", "7deg", "--remove"),
        ("--mass", "A:0.3kg"),
        ("--mass", "B:0.3kg", "--round-angle", "5deg"),
        ("--mass", "B:0.33kg", "--round-mass", "0.1kg"),
    ],
    ids=" ".join,
)
def test_corrections_as_they_are_given_out(
    how: tuple[str, ...], dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    """Rounded, or of a mass that is fixed: the page leaves what the program leaves, for the edited table too."""
    options = (*RIUL[1:], *how)
    if "--mass" in how:
        options = (
            tuple(part.replace("A:0mm:20mm", "A:0mm:?") for part in options) if how[1][0] == "A" else options
        )
    done = dalembert("balance", RIUL[0], *options, "--page", "b.html", "--json")
    assert done.returncode == 0, done.stderr
    page = Computing(browser, tmp_path / "b.html")
    for change in ({}, {"W1__radius": 0.035, "W2__angle": 2.2}):
        if change:
            page.put(**change)
            (tmp_path / "again.csv").write_text(page("return dalembert.csv()"))
            done = dalembert("balance", "again.csv", *options, "--json")
            assert done.returncode == 0, done.stderr
        (rotor,) = json.loads(done.stdout)["rotors"]
        largest = max(row["unbalance_kg_m"] for row in rotor["corrections"])
        for row in rotor["corrections"]:
            plane = row["plane"]
            assert page.get(f"{plane}.unbalance") == pytest.approx(row["unbalance_kg_m"], rel=1e-12)
            assert page.get(f"{plane}.mass") == pytest.approx(row["mass_kg"], rel=1e-12)
            assert page.get(f"{plane}.radius") == pytest.approx(row["radius_m"], rel=1e-12)
            assert page.get(f"{plane}.angle") == pytest.approx(math.radians(row["angle_deg"]), rel=1e-12)
        for name, key in (("static", "static_unbalance_kg_m"), ("couple", "couple_unbalance_kg_m2")):
            assert page.get(f"residual.{name}") == pytest.approx(rotor["residual"][key], abs=1e-12 * largest)
    assert page.faults() == []


def test_a_machines_sheet(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    file = EXAMPLES / "fan-one-plane" / "fan.csv"
    assert dalembert("field", file, "--save-influence", "alpha.csv").returncode == 0
    done = dalembert(
        "field", file, "--blades", "8", "--reading-error", "2%,2deg", "--page", "f.html", "--json"
    )
    assert done.returncode == 0, done.stderr
    page = Computing(browser, tmp_path / "f.html")
    (row,) = json.loads(done.stdout)["rotors"][0]["corrections"]
    assert page.get("1.mass") == pytest.approx(row["mass_kg"], rel=1e-12)
    assert page.get("1.angle") == pytest.approx(math.radians(row["angle_deg"]), rel=1e-12)
    assert page.get("residual/bearing/amplitude") == pytest.approx(0, abs=1e-14)
    split = {part["angle_deg"]: part["mass_kg"] for part in row["split"]}
    for i in (1, 2):
        angle = math.degrees(page.get(f"split.1.{i}.angle"))
        assert page.get(f"split.1.{i}.mass") == pytest.approx(split[round(angle)], rel=1e-9)
        x, y = page(
            f"const at = document.querySelectorAll('svg.dialled circle.on')[{i - 1}]; return [at.cx, at.cy].map((of) => of.baseVal.value)"
        )
        # counter-clockwise, where a screen's y points down
        assert math.remainder(math.degrees(math.atan2(130 - y, x - 150)) - angle, 360) == pytest.approx(
            0, abs=0.1
        )
    # another session: an initial run, and a run with what was advised, whose trim the program finds too
    page.put(**{"initial/bearing/amplitude": 4.0, "initial/bearing/phase": 1.0})
    page.put(**{"run 2/bearing/amplitude": 0.8, "run 2/bearing/phase": 2.5})
    page.put(**{"run 2/1/mass": 0.0015, "run 2/1/angle": 4.5})
    (tmp_path / "again.csv").write_text(page("return dalembert.csv()"))
    again = dalembert("field", "again.csv", "--influence", "alpha.csv", "--json")
    assert again.returncode == 0, again.stderr
    (row,) = json.loads(again.stdout)["rotors"][0]["trim"]
    found = page.get("trim.1.mass") * np.exp(1j * page.get("trim.1.angle"))
    trim = row["mass_kg"] * np.exp(1j * math.radians(row["angle_deg"]))
    assert abs(found - trim) < 1e-9 * abs(trim)
    for text in ("", "x", "-1"):
        page.type("initial/bearing/amplitude", text)
        assert page.alert
        assert math.isnan(page.get("1.mass"))
    page.button("reset")
    assert page.faults() == []


def test_a_sheet_names_what_is_beyond_a_limit(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """Least squares without limits: the program's own numbers, and a remark where a mass is beyond its limit."""
    file = EXAMPLES / "fan-one-plane" / "fan.csv"
    errors = ("--reading-error", "2%,2deg")
    plain = dalembert("field", file, *errors, "--json")
    (row,) = json.loads(plain.stdout)["rotors"][0]["corrections"]
    limits = ("--max-mass", "1g", "--max-residual", "2mm_s")
    assert dalembert("field", file, *errors, *limits, "--page", "f.html").returncode == 0
    page = Computing(browser, tmp_path / "f.html")
    assert page.get("1.mass") == pytest.approx(row["mass_kg"], rel=1e-12)
    # w = −v/α: the relative errors of a new reading and of the coefficient, which is as likely off in every direction
    assert dalembert("field", file, *errors, "--save-influence", "alpha.csv").returncode == 0
    with (tmp_path / "alpha.csv").open() as rows:
        (alpha,) = csv.DictReader(rows)
    size = float(alpha["magnitude_per_g"])
    off = math.hypot(
        float(alpha["magnitude_uncertainty_per_g"]) / size,
        math.radians(float(alpha["phase_uncertainty_deg"])),
    )
    for name, error in (("mass", 0.02 * row["mass_kg"]), ("angle", math.radians(2))):
        unit = row["mass_kg"] if name == "mass" else 1.0
        assert page.get(f"1.{name}_uncertainty") == pytest.approx(
            math.hypot(error, unit * off / math.sqrt(2)), rel=1e-6
        )
    assert "is more than its limit of 1 g" in page.text("answers")
    # the trim of the first run is the correction itself; a small vibration needs none
    assert page.get("trim.1.mass_uncertainty") == page.get("1.mass_uncertainty")
    assert "no trim is needed" not in page.text("answers")
    page.put(**{"initial/bearing/amplitude": 0.5})
    assert "no trim is needed, the vibration is within the limit" in page.text("answers")
    assert "is more than its limit" not in page.text("answers")
    assert page.faults() == []


def rows_of_a_sheet(
    page: Computing, folder: Path, dalembert: Dalembert, *words: object
) -> list[dict[str, Any]]:
    """What the program makes of the rows of a sheet: its trims."""
    (folder / "again.csv").write_text(page("return dalembert.csv()"))
    done = dalembert("field", "again.csv", "--influence", "alpha.csv", *words, "--json")
    assert done.returncode == 0, done.stderr
    return list(json.loads(done.stdout)["rotors"][0]["trim"])


PUMP = EXAMPLES / "pump-trials-left-on" / "pump.csv"


def test_a_sheet_and_a_tolerance(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """A plane needs a trim where the program says so; of a limit of the vibration and a tolerance both must be met."""
    assert dalembert("field", PUMP, "--save-influence", "alpha.csv").returncode == 0
    words = ("--permissible", "2000g_mm", "--radius", "150mm", "--max-residual", "0.5mil")
    done = dalembert("field", PUMP, *words, "--page", "f.html")
    assert done.returncode == 0, done.stderr
    page = Computing(browser, tmp_path / "f.html")
    names = [name for name in page("return dalembert.names") if name.startswith("initial/")]
    first = {name: page.get(name) for name in names if name.endswith("amplitude")}
    verdicts = set()
    for share in (1.0, 0.03):
        page.put(**{name: share * x for name, x in first.items()})
        for row in rows_of_a_sheet(page, tmp_path, dalembert, *words):
            said = f"Plane {row['plane']}: no trim is needed, the vibration is within the limit and the unbalance is within the tolerance."
            assert (said not in page.text("answers")) == row["needed"]
            verdicts.add(row["needed"])
    assert verdicts == {True, False}
    assert page.faults() == []


@pytest.mark.slow
def test_places_that_do_not_reach_a_trim(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """Two holes a third of a turn apart reach what lies between them; of the rest the nearer one takes what it can."""
    file = EXAMPLES / "fan-one-plane" / "fan.csv"
    assert dalembert("field", file, "--save-influence", "alpha.csv").returncode == 0
    words = ("--positions", "100deg,30deg")
    assert dalembert("field", file, *words, "--page", "f.html").returncode == 0
    page = Computing(browser, tmp_path / "f.html")
    for phase in range(5, 360, 40):
        page.put(**{"initial/bearing/phase": math.radians(phase)})
        (row,) = rows_of_a_sheet(page, tmp_path, dalembert, *words)
        expected = {round(part["angle_deg"]): part["mass_kg"] for part in row["split"]}
        found = {
            round(math.degrees(page.get(f"split.1.{i}.angle"))): page.get(f"split.1.{i}.mass") for i in (1, 2)
        }
        assert {angle: mass for angle, mass in found.items() if mass} == {
            angle: pytest.approx(mass, rel=1e-9) for angle, mass in expected.items()
        }
        missed = "cannot be reached from these places" in page.text("answers")
        assert missed == (len(expected) < 2)
    assert page.faults() == []


def test_a_sheet_is_of_readings_with_phases(dalembert: Dalembert, tmp_path: Path) -> None:
    done = dalembert(
        "field", EXAMPLES / "fan-four-run" / "four_run.csv", "--method", "four-run", "--page", "f.html"
    )
    assert done.returncode == 2
    assert "amplitudes with phases" in " ".join(done.stderr.split())
    assert not (tmp_path / "f.html").exists()


def modal_page_holds(
    words: tuple[str, ...], changes: list[dict[str, float]], dalembert: Dalembert, folder: Path, browser: Any
) -> Computing:
    """A page of modal balancing beside the program, for the table as it is and as it is edited."""
    for name in ("rotor.csv", "modes.csv"):
        (folder / name).write_text((EXAMPLES / "modal-turbine" / name).read_text())
    options = (*words, "--modes", "modes.csv")
    assert dalembert("balance", "rotor.csv", *options, "--page", "b.html").returncode == 0
    page = Computing(browser, folder / "b.html")
    for change in ({}, *changes):
        assert page.put(**change)
        (folder / "again.csv").write_text(page("return dalembert.csv()"))
        done = dalembert("balance", "again.csv", *options, "--json")
        assert done.returncode == 0, done.stderr
        (rotor,) = json.loads(done.stdout)["rotors"]
        largest = max(row["unbalance_kg_m"] for row in rotor["corrections"])
        for row in rotor["corrections"]:
            found = page.get(f"{row['plane']}.mass") * np.exp(1j * page.get(f"{row['plane']}.angle"))
            expected = row["mass_kg"] * np.exp(1j * math.radians(row["angle_deg"]))
            assert abs(found - expected) < 1e-12 * largest / row["radius_m"]
        for mode in rotor["modes"]:
            name, size = f"mode {mode['mode']}", mode["initial"]["modal_unbalance_kg_m"]
            assert page.get(f"{name}.unbalance") == pytest.approx(size, rel=1e-12)
            assert page.get(f"{name}.angle") == pytest.approx(
                math.radians(mode["initial"]["angle_deg"]), rel=1e-12
            )
            left = mode["residual"]["modal_unbalance_kg_m"]
            assert page.get(f"residual.{name}") == pytest.approx(left, rel=1e-9, abs=1e-12 * largest)
        residual = rotor["residual"]["static_unbalance_kg_m"]
        assert page.get("residual.static") == pytest.approx(residual, abs=1e-12 * largest)
    return page


TURBINE = ("--plane", "A:300mm:80mm", "--plane", "B:900mm:80mm")


def test_modes(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """A mass moves along the shaft from one cubic of the shapes to another; beyond the shaft there is no shape, and no answer."""
    names = [
        line.split(",")[0]
        for line in (EXAMPLES / "modal-turbine" / "rotor.csv").read_text().splitlines()[1:3]
    ]
    first, second = (f"{name}__z" for name in names)
    page = modal_page_holds(TURBINE, [{first: 0.71, second: 0.0}], dalembert, tmp_path, browser)
    corrections = page.table("Corrections: material to add")
    assert "–" not in {cell for cells in corrections.values() for cell in cells}
    for z in ("-1 mm", "9 m"):
        page.type(first.replace("__", "."), z)
        assert "where the mode shapes are known" in page.alert
        assert math.isnan(page.get("A.mass"))
    page.button("undo")
    page.button("add a row")
    assert not math.isnan(page.get("A.mass"))
    assert page.faults() == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        (*TURBINE, "--plane", "C:1m:70mm"),
        (*TURBINE, "--mode-count", "1"),
        (*TURBINE, "--plane", "C:500mm:70mm", "--plane", "D:1m:70mm", "--rigid"),
        (*TURBINE, "--round-mass", "0.1g", "--round-angle", "1deg"),
        (*TURBINE, "--remove", "--grade", "G2.5", "--speed", "3000rpm", "--rotor-mass", "60kg"),
    ],
    ids=" ".join,
)
def test_modes_of_all_kinds(
    words: tuple[str, ...], dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    rng = np.random.default_rng(17)
    table = (EXAMPLES / "modal-turbine" / "rotor.csv").read_text().splitlines()[1:]
    changes = [
        {f"{row.split(',')[0]}__z": float(rng.uniform(0.01, 1.1)) for row in table[:4]} for _ in range(3)
    ]
    page = modal_page_holds(words, changes, dalembert, tmp_path, browser)
    assert page.faults() == []
