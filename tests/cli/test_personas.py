"""As people do it: from an empty folder, with files as they have them, by the documented commands alone."""

from __future__ import annotations

import csv
import json
import math
import subprocess
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from tests.conftest import Dalembert
from tests.four_bars import four_bar


def polar(size: float, degrees: float) -> complex:
    return size * complex(math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))


def done(found: subprocess.CompletedProcess[str]) -> str:
    assert found.returncode == 0, found.stderr
    return found.stdout


def test_a_technician_with_a_german_csv_and_a_workbook(dalembert: Dalembert, tmp_path: Path) -> None:
    """Known masses as a German spreadsheet exports them, then the fan's runs in a workbook, a report for the customer."""
    (tmp_path / "massen.csv").write_bytes(
        "Auswuchtung Läufer 7\r\n\r\nMasse;Halbmesser;Winkel\r\n[g];[mm];[°]\r\n90,5;30;60\r\n60;50,25;210\r\n".encode(
            "cp1252"
        )
    )
    balanced = dalembert("balance", "massen.csv", "--plane", "A:20mm")
    assert "read 'Masse' as mass_g, 'Halbmesser' as radius_mm, 'Winkel' as angle_deg" in balanced.stderr
    rows = list(csv.DictReader(done(balanced).splitlines()))
    needed = -(polar(90.5 * 30, 60) + polar(60 * 50.25, 210))
    assert float(rows[0]["unbalance_g_mm"]) == pytest.approx(abs(needed), rel=1e-12)
    assert float(rows[0]["angle_deg"]) == pytest.approx(math.degrees(np.angle(needed)) % 360, abs=1e-9)

    v0, alpha = polar(120, 35), polar(8, 200)
    book = openpyxl.Workbook()
    notes = book.worksheets[0]
    notes.title = "Notizen"
    notes.append(["Lüfter 3, Halle 2"])
    sheet = book.create_sheet("Messung")
    sheet.append(
        ["run", "sensor", "amplitude [µm]", "phase [°]", "trial_plane", "trial mass [g]", "trial angle [°]"]
    )
    for run, on in ((0, 0), (1, polar(10, 90))):
        v = v0 + alpha * on
        trial = ["A", 10, 90] if on else [None, None, None]
        sheet.append([run, "Lager", abs(v), math.degrees(np.angle(v)) % 360, *trial])
    book.save(tmp_path / "Lüfter.xlsx")
    options = (
        "--report",
        "Bericht.html",
        "--about",
        "machine=Lüfter 3",
        "--about",
        "customer=Müller",
        "-o",
        "fix.xlsx",
    )
    done(dalembert("field", "Lüfter.xlsx#Messung", *options))
    header, row = openpyxl.load_workbook(tmp_path / "fix.xlsx")["corrections"].iter_rows(values_only=True)
    fix = dict(zip(header, row, strict=True))
    assert polar(fix["mass_g"], fix["angle_deg"]) == pytest.approx(-v0 / alpha, rel=1e-9)
    page = (tmp_path / "Bericht.html").read_text(encoding="utf-8")
    for word in ("Lüfter 3", "Müller", "Corrections", "Verdict", "<svg", f"{abs(v0 / alpha):.6g}"):
        assert word in page
    # onto the twelve blades of the fan
    placed = json.loads(done(dalembert("place", "fix.xlsx", "--blades", "12", "--json")))
    together = sum(polar(m["mass_kg"] * 1000, m["angle_deg"]) for m in placed["masses"])
    assert together == pytest.approx(-v0 / alpha, rel=1e-9)


def test_a_teacher_with_degrees_and_millimetres(dalembert: Dalembert, tmp_path: Path) -> None:
    """A four-bar of the book, bare numbers in the file's units, the pupils' answers checked, a sheet in LaTeX."""
    (tmp_path / "bar.toml").write_text(four_bar(head='name = "Exercise 4"', rates='speed = "10 rpm"'))
    call = ("mechanism", "bar.toml", "--at", "40", "--only", "C,coupler,rocker")
    (row,) = csv.DictReader(done(dalembert(*call, "--units", "mm,deg,rpm")).splitlines())
    # Norton's example 4-1: θ3 = 20.298°, θ4 = 57.325°
    assert float(row["coupler_angle_deg"]) == pytest.approx(20.298, abs=1e-3)
    assert float(row["rocker_angle_deg"]) == pytest.approx(57.325, abs=1e-3)
    assert float(row["C_x_mm"]) == pytest.approx(100 + 80 * math.cos(math.radians(57.325)), abs=2e-3)
    one, two, three = (math.radians(a) for a in (40, 20.298, 57.325))
    rocker = 40 * 10 * math.sin(one - two) / (80 * math.sin(three - two))
    assert float(row["rocker_omega_rpm"]) == pytest.approx(rocker, rel=1e-3)
    (tmp_path / "answers.csv").write_text("input_deg;coupler_angle_deg;rocker_angle_deg\n40;20,298;57,325\n")
    assert "2 of 2 values within" in done(dalembert(*call, "--expect", "answers.csv"))
    (tmp_path / "answers.csv").write_text("input_deg,coupler_angle_deg\n40,117.286\n")
    wrong = dalembert(*call, "--expect", "answers.csv")
    assert wrong.returncode == 1
    assert "WRONG" in wrong.stdout
    done(dalembert("mechanism", "bar.toml", "--over", "0:360:30", "--only", "rocker", "-o", "sheet.tex"))
    assert (tmp_path / "sheet.tex").read_text().count(r"\\") == 14
    # the check of the linkage, in a pipe
    rows = list(csv.DictReader(done(dalembert("inspect", "bar.toml")).splitlines()))
    assert {"quantity": "grashof", "of": "crank, coupler, rocker", "value": "crank-rocker"} in rows


def test_a_designer_with_six_bars_and_a_wide_table(dalembert: Dalembert, tmp_path: Path) -> None:
    """A Watt six-bar: all of it over a turn in a workbook and Parquet, variants, a report that fits the paper."""
    done(dalembert("examples", "watt-six-bar"))
    call = ("mechanism", "watt.toml", "--over", "0deg:5deg:0.5deg")
    links = [
        line.split(".")[1].rstrip("]")
        for line in (tmp_path / "watt.toml").read_text().splitlines()
        if line.startswith("[links.")
    ]
    everything = ("--only", ",".join(links), "--order", "acceleration")
    rows = list(csv.DictReader(done(dalembert(*call, *everything)).splitlines()))
    assert len(rows[0]) == 2 + 3 * len(links)
    for name in ("wide.xlsx", "wide.parquet"):
        done(dalembert(*call, *everything, "-o", name))
    sheet = openpyxl.load_workbook(tmp_path / "wide.xlsx").worksheets[0]
    header, *cells = sheet.iter_rows(values_only=True)
    assert list(header) == list(rows[0])
    for written, row in zip(cells, rows, strict=True):
        assert [float(c) for c in written] == [float(c) for c in row.values()]
    # the terminal's width is kept, each block with the key columns in front
    text = done(dalembert(*call, *everything, "--report", "watt.html", "--about", "title=Draft 2", "--text"))
    assert "step" in text
    page = (tmp_path / "watt.html").read_text()
    assert "<h1>Draft 2</h1>" in page
    assert page.count('<th class="n">step</th>') >= 2
    crank = next(name for name in links if f'link = "{name}"' in (tmp_path / "watt.toml").read_text())
    points = json.loads(done(dalembert("mechanism", "watt.toml", "--at", "0deg", "--json")))["poses"][0][
        "points"
    ]
    assert points
    varied = list(
        csv.DictReader(
            done(
                dalembert(
                    "mechanism",
                    "watt.toml",
                    "--at",
                    "0deg",
                    "--only",
                    crank,
                    "--over",
                    "input.speed=30rpm:90rpm:30rpm",
                )
            ).splitlines()
        )
    )
    assert [row["variant"] for row in varied] == ["1", "2", "3"]
    assert [float(row[f"{crank}_omega_rad_s"]) for row in varied] == pytest.approx(
        [math.pi * k for k in (1, 2, 3)]
    )
