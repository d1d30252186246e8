"""`dalembert place` with weights as they are: few from stock, and fixed ones at any angle."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from balancing import place_from_stock
from tests.conftest import Dalembert


def placed(dalembert: Dalembert, *arguments: str) -> Any:
    done = dalembert("place", *arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def total(found: Any) -> complex:
    return complex(sum(m["mass_kg"] * np.exp(1j * np.radians(m["angle_deg"])) for m in found["masses"]))


BLADES = ("95g@250deg", "--blades", "11", "--stock", "5g,10g,20g,50g")


def test_stock_takes_three_weights_at_most_and_says_what_more_would_leave(dalembert: Dalembert) -> None:
    """280 g stood on all eleven blades for a correction of 95 g."""
    found = placed(dalembert, *BLADES)
    assert len(found["masses"]) == 3
    angles, goal = 2 * np.pi * np.arange(11) / 11, 0.095 * np.exp(1j * np.radians(250))
    stock = [0.005, 0.01, 0.02, 0.05]
    best, more = (abs(place_from_stock(goal, angles, stock, max_pieces=n).error) for n in (3, 4))
    assert found["error_kg"] == pytest.approx(best, rel=1e-9)
    (warning,) = found["warnings"]
    assert f"with 4 it would be {more * 1e3:.4g} g (--max-pieces 4)" in warning
    again = placed(dalembert, *BLADES, "--max-pieces", "4")
    assert again["error_kg"] == pytest.approx(more, rel=1e-9)


@pytest.mark.parametrize(
    ("correction", "count"),
    [
        # one weight on its place, and 0.9 % beside it
        ("20g@90deg", 1),
        ("20.18g@90deg", 1),
        # half a turn of the sense, and another scale of masses
        ("20.18g@270deg", 1),
        # two that lie on either side; two on opposite sides of the shaft
        ("50g@36.869897645844deg", 2),
        ("30.1g@0deg", 2),
    ],
)
def test_the_fewest_weights_within_a_hundredth(correction: str, count: int, dalembert: Dalembert) -> None:
    found = placed(dalembert, correction, "--blades", "4", "--stock", "20g,30g,40g,50g")
    assert sum(round(m["mass_kg"], 9) > 0 for m in found["masses"]) <= count
    assert found["error_kg"] <= 0.01 * found["target"]["mass_kg"]


def test_nothing_from_stock_where_that_comes_nearest(dalembert: Dalembert) -> None:
    found = placed(dalembert, "1g@20deg", "--blades", "2", "--stock", "50g")
    assert found["masses"] == []
    assert found["error_kg"] == pytest.approx(0.001)
    none = placed(dalembert, "5g@20deg", "5g@200deg", "--blades", "8", "--stock", "5g")
    assert none["masses"] == []


def test_two_weights_are_spread_about_the_correction(dalembert: Dalembert, tmp_path: Path) -> None:
    found = placed(dalembert, "6g@30deg", "--weights", "4g,4g")
    aside = np.degrees(np.arccos(6 / 8))
    assert [m["angle_deg"] for m in found["masses"]] == pytest.approx([(30 - aside) % 360, 30 + aside])
    assert [m["mass_kg"] for m in found["masses"]] == pytest.approx([0.004, 0.004])
    assert [m["position"] for m in found["masses"]] == ["1", "2"]
    assert found["error_kg"] == 0
    assert found["warnings"] == []
    done = dalembert(
        "place", "6g@30deg", "--weights", "4g,4g", "--plot", "w.png", "--report", "w.html", "--digits"
    )
    row = next(csv.DictReader(io.StringIO(done.stdout)))
    assert row["mass_g"] == "4.0"
    assert float(row["angle_deg"]) == pytest.approx((30 - aside) % 360, abs=1e-11)
    assert (tmp_path / "w.png").exists()


def test_three_weights_at_another_radius(dalembert: Dalembert) -> None:
    found = placed(
        dalembert, "3g@100deg", "--weights", "2g,2g,2g", "--at-radius", "20mm", "--to-radius", "15mm"
    )
    aside = np.degrees(np.arccos((4 / 2 - 1) / 2))
    assert [m["angle_deg"] for m in found["masses"]] == pytest.approx([100 - aside, 100, 100 + aside])
    assert total(found) == pytest.approx(0.004 * np.exp(1j * np.radians(100)))


@pytest.mark.parametrize(
    ("correction", "weights", "miss", "words"),
    [
        ("9g@30deg", "4g,4g", 1, "8 g at most"),
        ("1g@30deg", "4g,2g", 1, "2 g at least"),
        ("3g@0deg", "4g", 1, "4 g"),
    ],
)
def test_weights_that_cannot_reach_it(
    correction: str, weights: str, miss: float, words: str, dalembert: Dalembert
) -> None:
    found = placed(dalembert, correction, "--weights", weights)
    assert found["error_kg"] * 1e3 == pytest.approx(miss)
    (warning,) = found["warnings"]
    assert words in warning
    assert f"missed by {miss:g} g" in warning


@pytest.mark.parametrize(
    "options",
    [
        ("--blades", "4"),
        ("--positions", "0deg"),
        ("--stock", "1g"),
        ("--max-mass", "5g"),
        ("--max-pieces", "2"),
        ("--drill", "5mm", "--density", "7850kg_m3"),
        ("--remove",),
    ],
)
def test_what_does_not_go_with_weights(options: tuple[str, ...], dalembert: Dalembert) -> None:
    done = dalembert("place", "6g@30deg", "--weights", "4g,4g", *options)
    assert done.returncode == 2
    assert "--weights" in done.stderr


@pytest.mark.parametrize("weights", ["4g,4g", "4g,4g,4g", "5g,3g,2g", "4g,3g,2g,1g"])
@pytest.mark.parametrize("correction", [["0g@0deg"], ["3g@10deg", "3g@190deg"]])
def test_weights_for_no_correction_cancel(dalembert: Dalembert, correction: list[str], weights: str) -> None:
    result = placed(dalembert, *correction, "--weights", weights)
    assert len(result["masses"]) == weights.count(",") + 1
    assert abs(total(result)) < 1e-15 * 0.012
    assert (result["error_kg"], result["error_angle_deg"]) == (0, 0)
    assert result["warnings"] == ["the corrections add up to nothing: the weights are set against each other"]
