"""`dalembert place` as a user runs it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.printed import document
from tests.conftest import Dalembert


def total(found: Any) -> complex:
    return complex(sum(m["mass_kg"] * np.exp(1j * np.radians(m["angle_deg"])) for m in found["masses"]))


def test_blades(dalembert: Dalembert) -> None:
    found = document(dalembert("place", "83.5g@308.87deg", "--blades", "16", "--json"))
    assert found["target"] == {"mass_kg": 0.0835, "angle_deg": pytest.approx(308.87)}
    assert [(m["position"], m["angle_deg"]) for m in found["masses"]] == [("14", 292.5), ("15", 315)]
    assert [m["mass_kg"] * 1e3 for m in found["masses"]] == pytest.approx([23.29999, 61.49617], abs=1e-5)
    assert all(m["drill_depth_m"] is None for m in found["masses"])
    assert found["error_kg"] == 0
    assert found["warnings"] == []
    by_name = document(dalembert("place", "83.5g@308.87deg", "--positions", "315deg,292.5deg", "--json"))
    assert [m["position"] for m in by_name["masses"]] == ["1", "2"]
    shifted = document(dalembert("place", "1g@10deg", "--blades", "4", "--first", "10deg", "--json"))
    assert shifted["masses"][0]["angle_deg"] == 10


def test_a_place_just_below_zero_stands_at_zero_not_at_360(dalembert: Dalembert) -> None:
    # -1e-15 % 360 is 360.0
    found = document(dalembert("place", "3g@0deg", "--positions=-1e-15deg", "--json"))
    assert [m["angle_deg"] for m in found["masses"]] == [0.0]


def test_blades_numbered_against_the_angles(dalembert: Dalembert) -> None:
    """Same masses at the same angles; the blade at 360° − θ has θ's number, and the first stays where it is."""
    vector = ["83.5g@308.87deg", "--blades", "16", "--json"]
    there, back = (document(dalembert("place", *vector, *more)) for more in ([], ["--numbering", "against"]))
    assert [(m["position"], m["angle_deg"]) for m in back["masses"]] == [("3", 315), ("4", 292.5)]
    by_angle = [{m["angle_deg"]: m["mass_kg"] for m in found["masses"]} for found in (there, back)]
    assert by_angle[0].keys() == by_angle[1].keys()
    assert list(by_angle[1].values()) == pytest.approx(
        [by_angle[0][angle] for angle in by_angle[1]], rel=1e-14
    )
    first = ["1g@50deg", "--blades", "4", "--first", "50deg", "--numbering", "against", "--json"]
    assert document(dalembert("place", *first))["masses"][0]["position"] == "1"
    refused = dalembert("place", "1g@50deg", "--positions", "0deg,90deg", "--numbering", "against")
    assert refused.returncode == 2
    assert "--numbering" in refused.stderr
    assert "goes with --blades" in refused.stderr


def test_limits(dalembert: Dalembert) -> None:
    found = document(dalembert("place", "20g@30deg", "--blades", "12", "--max-mass", "8g", "--json"))
    assert max(m["mass_kg"] for m in found["masses"]) <= 0.008
    assert abs(total(found) - 0.02 * np.exp(1j * np.pi / 6)) < 1e-15
    beyond = document(dalembert("place", "20g@30deg", "--blades", "3", "--max-mass", "5g", "--json"))
    assert beyond["error_kg"] > 0
    assert abs(abs(total(beyond) - 0.02 * np.exp(1j * np.pi / 6)) - beyond["error_kg"]) < 1e-15
    assert "cannot be reached" in beyond["warnings"][0]
    done = dalembert("place", "20g@30deg", "--max-mass", "5g")
    assert done.returncode == 1
    assert "beyond --max-mass" in done.stderr


def test_stock(dalembert: Dalembert) -> None:
    found = document(dalembert("place", "7.3g@100deg", "--blades", "6", "--stock", "1g,2g,5g", "--json"))
    assert {round(m["mass_kg"], 9) for m in found["masses"]} <= {0.001, 0.002, 0.005}
    assert abs(abs(total(found) - 0.0073 * np.exp(1j * np.radians(100))) - found["error_kg"]) < 1e-15
    few = document(
        dalembert(
            "place", "7.3g@100deg", "--blades", "6", "--stock", "1g,2g,5g", "--max-pieces", "2", "--json"
        )
    )
    assert len(few["masses"]) <= 2
    assert few["error_kg"] >= found["error_kg"]


def test_combining_and_radius(dalembert: Dalembert) -> None:
    found = document(dalembert("place", "3g@0deg", "4g@90deg", "--json"))
    (mass,) = found["masses"]
    assert mass["mass_kg"] == pytest.approx(0.005, rel=1e-14)
    assert mass["angle_deg"] == pytest.approx(np.degrees(np.arctan2(4, 3)))
    out = document(dalembert("place", "10g@40deg", "--at-radius", "20mm", "--to-radius", "35mm", "--json"))
    assert out["masses"][0]["mass_kg"] == pytest.approx(0.01 * 20 / 35, rel=1e-14)
    none = document(dalembert("place", "3g@10deg", "3g@190deg", "--blades", "5", "--json"))
    assert none["masses"] == []
    assert "nothing to place" in none["warnings"][0]


def test_drilling_is_opposite(dalembert: Dalembert) -> None:
    options = ["--drill", "10mm", "--density", "7850kg_m3", "--json"]
    (hole,) = document(dalembert("place", "10g@30deg", *options))["masses"]
    assert hole["drill_depth_m"] == pytest.approx(0.01 / 7850 / (np.pi * 0.005**2), rel=1e-14)
    assert hole["angle_deg"] == pytest.approx(210)
    (hole,) = document(dalembert("place", "10g@30deg", "--remove", *options))["masses"]
    assert hole["angle_deg"] == pytest.approx(30)
    (deep,) = document(dalembert("place", "10g@30deg", "--max-depth", "6mm", *options))["masses"]
    assert deep["holes"] == 3
    assert deep["drill_depth_m"] * 3 == pytest.approx(hole["drill_depth_m"], rel=1e-12)


def test_wrong_usage(dalembert: Dalembert) -> None:
    for arguments in (
        [],
        ["10g"],
        ["10@30deg"],
        ["10g@30kg"],
        ["-1g@30deg"],
        ["10g@30deg", "--blades", "0"],
        ["10g@30deg", "--blades", "4", "--positions", "0deg"],
        ["10g@30deg", "--stock", "1g"],
        ["10g@30deg", "--blades", "4", "--stock", "0g"],
        ["10g@30deg", "--drill", "10mm"],
        ["10g@30deg", "--at-radius", "10mm"],
        ["10g@30deg", "--positions", "0deg,360deg"],
        ["10g@30deg", "--max-depth", "1mm"],
    ):
        assert dalembert("place", *arguments).returncode == 2, arguments


def test_text_and_picture(dalembert: Dalembert, tmp_path: Path) -> None:
    done = dalembert("place", "83.5g@308.87deg", "--blades", "16", "--text", "--plot", "p.png")
    assert "material to add" in done.stdout
    assert ["error", "0", "g"] in [line.split() for line in done.stdout.splitlines()]
    assert (tmp_path / "p.png").read_bytes()[:4] == b"\x89PNG"


def test_other_planes(dalembert: Dalembert, tmp_path: Path) -> None:
    found = document(dalembert("place", "12g@40deg", "--at-z", "30mm", "--to-z", "0mm:90mm", "--json"))
    assert [m["z_m"] for m in found["masses"]] == [0, 0.09]
    assert [m["mass_kg"] for m in found["masses"]] == pytest.approx([0.008, 0.004], rel=1e-12)
    over = document(
        dalembert(
            "place",
            "12g@40deg",
            "--at-z",
            "-30mm",
            "--to-z",
            "0mm:90mm",
            "--blades",
            "8",
            "--json",
            "--plot",
            "p.png",
        )
    )
    for z, share in ((0.0, 16e-3), (0.09, -4e-3)):
        parts = [
            m["mass_kg"] * np.exp(1j * np.radians(m["angle_deg"])) for m in over["masses"] if m["z_m"] == z
        ]
        assert abs(sum(parts) - share * np.exp(1j * np.radians(40))) < 1e-16
    assert dalembert("place", "12g@40deg", "--to-z", "0mm:90mm").returncode == 2
    assert dalembert("place", "12g@40deg", "--at-z", "1mm", "--to-z", "0mm:0mm").returncode == 2


@pytest.mark.parametrize(
    ("options", "warning"),
    [
        (
            ("--positions", "0deg,90deg"),
            "2 weights leave an error of 3.586 g (71.72%); one more does not make it smaller",
        ),
        (("--blades", "8", "--max-pieces", "1"), "at most 1 weight leaves an error of 4 g (80.00%)"),
        (
            ("--blades", "8", "--max-mass", "0.5g"),
            "0 weights leave an error of 5 g (100.00%); one more does not make it smaller",
        ),
    ],
)
def test_weights_from_stock_that_do_not_come_near(
    options: tuple[str, ...], warning: str, dalembert: Dalembert
) -> None:
    """The error stood in JSON alone: 1 g on each of 0° and 90° is 1.414 g of 5 g."""
    found = document(dalembert("place", "5g@45deg", "--stock", "1g", *options, "--json"))
    assert found["warnings"] == [warning]


@pytest.mark.parametrize(
    ("option", "value", "other"),
    [
        ("--pieces", "2", "--stock"),
        ("--max-pieces", "2", "--stock"),
        ("--first", "10deg", "--blades"),
        ("--drill-point", "118deg", "--drill"),
    ],
)
def test_an_option_without_the_one_that_it_goes_with(
    option: str, value: str, other: str, dalembert: Dalembert
) -> None:
    done = dalembert("place", "6g@30deg", option, value)
    assert done.returncode == 2
    assert option in done.stderr
    assert other in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("83,5g@30deg",),
        ("83.5g@308,87deg",),
        ("5g@30deg", "--at-radius", "20,5mm", "--to-radius", "30mm"),
    ],
)
def test_a_decimal_comma_in_an_option_is_named(arguments: tuple[str, ...], dalembert: Dalembert) -> None:
    done = dalembert("place", *arguments)
    assert done.returncode == 2
    assert "has a comma in its number: expected a decimal point" in done.stderr
