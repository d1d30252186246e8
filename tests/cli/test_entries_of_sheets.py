"""Tables of masses and machines' sheets: entries that are half typed, undo, rows of one name, the keyboard."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from tests.cli.test_pages_of_rotors import PUMP
from tests.cli.test_pages_that_compute import Computing
from tests.computed_pages import script_and_data
from tests.conftest import Dalembert


@pytest.fixture
def pump(dalembert: Dalembert, tmp_path: Path, browser: Any) -> Computing:
    done = dalembert("field", PUMP, "--page", "f.html")
    assert done.returncode == 0, done.stderr
    page = Computing(browser, tmp_path / "f.html")
    # a browser keeps what was typed for the next test
    page.button("reset")
    return page


def rotor(rows: list[str], dalembert: Dalembert, folder: Path, browser: Any) -> tuple[Computing, float]:
    """The page of a table of masses, and the program's unbalance in plane A."""
    (folder / "r.csv").write_text("\n".join(["name,mass_g,radius_mm,angle_deg", *rows, ""]))
    done = dalembert("balance", "r.csv", "--plane", "A:20mm", "--page", "b.html", "--json")
    assert done.returncode == 0, done.stderr
    unbalance = json.loads(done.stdout)["rotors"][0]["corrections"][0]["unbalance_kg_m"]
    return Computing(browser, folder / "b.html"), unbalance


def test_a_half_of_a_reading_or_of_a_mass(pump: Computing) -> None:
    """A mass without its angle was taken for the advised one; beside half a reading copied rows had masses of zero."""
    full = {"run 2/1/amplitude": 1.5, "run 2/1/phase": 1.0, "run 2/aft/mass": 0.005, "run 2/aft/angle": 0.5}
    assert pump.put(**full)
    rows = pump("return dalembert.csv()")
    assert "5;6.6" in rows
    for name in full:
        pump.type(name, "")
        of, what = name.split("/")[1:]
        # below the fields of its run: on a phone the answers stand far below
        (box,) = pump(
            "return [...document.querySelectorAll('fieldset')].map(f => f.textContent).filter(t => t.includes('missing'))"
        )
        assert box.startswith("run 2")
        assert box.endswith(f"The {what} of {of} in run 2 is missing.")
        assert math.isnan(pump.get("aft.mass"))
        assert pump("return dalembert.csv()") == ""
        pump.button("undo")
    assert pump("return dalembert.csv()") == rows
    # neither mass nor angle: the advised mass, and that is no half
    for name in ("run 2/aft/mass", "run 2/aft/angle"):
        pump.type(name, "")
    assert "15.32979" in pump("return dalembert.csv()")
    pump.button("reset")
    assert "missing" not in pump.text("entries")
    assert pump.faults() == []


def test_a_run_that_is_not_read_in_full_does_not_end_the_work(pump: Computing) -> None:
    """With the advised masses nothing is left of the corrections, but something may be left of the vibration."""
    assert pump.put(**{"run 2/1/amplitude": 1.5, "run 2/1/phase": 1.0})
    assert "no unbalance is left" not in pump.text("answers")
    pump.button("reset")
    # nothing is left where nothing moves
    names = [name for name in pump("return dalembert.names") if name.startswith("initial/")]
    assert pump.put(**dict.fromkeys(names, 0.0))
    assert pump.text("answers").count("no unbalance is left") == 2
    pump.button("reset")
    assert pump.faults() == []


def test_one_change_by_a_script_is_undone_at_once(
    pump: Computing, dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    names = ["initial/1/amplitude", "initial/2/amplitude", "initial/2/phase"]
    before = [pump.get(name) for name in names]
    assert pump.put(**dict.fromkeys(names, 2.5))
    pump.button("undo")
    assert [pump.get(name) for name in names] == before
    page, _ = rotor(["a,5,20,30", "b,7,20,100"], dalembert, tmp_path, browser)
    assert page.put(a__mass=0.001, b__mass=0.002, b__angle=3.0)
    assert page.put(a__mass=0.004)
    page.button("undo")
    assert (page.get("a.mass"), page.get("b.mass")) == (0.001, 0.002)
    page.button("undo")
    assert page("return dalembert.csv()").splitlines()[1:] == ["a,5,20,30", "b,7,20,100"]


@pytest.mark.parametrize(
    ("names", "shown"),
    [
        (["2", "2"], ["2", "3"]),
        (["a", "b"], ["a", "b"]),
        (["a", "a", "3", "a"], ["a", "2", "3", "4"]),
        (["", "1", ""], ["2", "1", "3"]),
        (["", ""], ["1", "2"]),
    ],
)
def test_rows_of_one_name_are_two(
    names: list[str], shown: list[str], dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    """The second row with the name 2 had that name too, and one mass counted twice."""
    rows = [f"{name},{5 + k},20,{40 * k}" for k, name in enumerate(names)]
    page, unbalance = rotor(rows, dalembert, tmp_path, browser)
    assert page("return dalembert.names.filter((n) => n.endsWith('.mass'))") == [
        f"{name}.mass" for name in shown
    ]
    assert page.get("A.unbalance") == pytest.approx(unbalance, rel=1e-12)


@pytest.mark.parametrize("angles", [(0, 180), (90, 270), (-90, 90), (0, 120, 240), (360, 540)])
def test_masses_that_balance_each_other_leave_nothing(
    angles: tuple[int, ...], dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    """Two masses opposite each other had a correction of 6e-16 g at 270°: the second computation had the same π."""
    rows = [f"W{k},5,20,{angle}" for k, angle in enumerate(angles)]
    page, unbalance = rotor(rows, dalembert, tmp_path, browser)
    assert unbalance < 1e-19

    def cells(row: str) -> list[str]:
        return list(
            page(
                "return [...document.querySelectorAll('#answers tr')].filter((r) => r.cells[0].textContent ==="
                " arguments[0]).map((r) => [...r.cells].slice(1).map((c) => c.textContent))[0]",
                row,
            )
        )

    assert cells("A") == ["0", "–", "0"]
    assert cells("static, g·mm") == ["0", "–", "0"]
    # a little more or less of one of them is no rounding
    page.type("W0.mass", "5.000001")
    assert cells("A") == ["0.000001", f"{(angles[0] + 180) % 360}", "0.00002"]
    page.type("W0.mass", "4.999999")
    assert cells("A") == ["0.000001", f"{angles[0] % 360}", "0.00002"]


def test_a_mass_has_a_radius(dalembert: Dalembert, tmp_path: Path, browser: Any) -> None:
    """A mass at radius 0 was answered as no unbalance, and the program refused the copied rows; a row of zeros is none."""
    page, unbalance = rotor(["W1,5,20,30", "W2,7,20,100", "W3,0,0,0"], dalembert, tmp_path, browser)
    rows = page("return dalembert.csv()")
    assert page.get("A.unbalance") == pytest.approx(unbalance, rel=1e-12)
    assert not page.put(**{"W2.radius": 0.0})
    assert page.text("alert") == "W2.radius: found 0, expected a positive radius, for there is a mass"
    assert math.isnan(page.get("A.unbalance"))
    assert page("return dalembert.csv()") == ""
    assert page("return document.querySelectorAll('svg.polygon').length") == 0
    assert page.put(**{"W2.mass": 0.0})
    assert page.get("A.unbalance") == pytest.approx(1e-4, rel=1e-12)
    page.button("undo")
    page.button("undo")
    assert page("return dalembert.csv()") == rows
    # each of several, named
    assert not page.put(**{"W1.radius": 0.0, "W2.radius": 0.0})
    assert page.text("alert").count("positive radius") == 2
    page.button("reset")
    assert page.text("alert") == ""


def test_the_keyboard_goes_on_where_rows_come_and_go(
    dalembert: Dalembert, tmp_path: Path, browser: Any
) -> None:
    page, _ = rotor(["W1,5,20,30", "W2,7,20,100"], dalembert, tmp_path, browser)

    def focus() -> str:
        return str(
            page("const e = document.activeElement; return e.dataset.name ?? e.ariaLabel ?? e.textContent")
        )

    def remove(k: int) -> str:
        page("document.querySelectorAll('.cells button')[arguments[0]].click()", k)
        return focus()

    page.button("add a row")
    assert focus() == "W3.mass"
    assert [remove(0), remove(1), remove(0)] == ["remove W2", "remove W2", "add a row"]
    assert page.get("A.unbalance") == 0
    assert page.faults() == []


@pytest.mark.parametrize("first", ["0", "Lauf 1", "initial"])
def test_the_initial_run_of_a_sheet_is_initial(first: str, dalembert: Dalembert, tmp_path: Path) -> None:
    """A sheet is for the next readings: its entries have the same names whatever the log calls its runs."""
    (tmp_path / "r.csv").write_text(
        "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"
        f"{first},1,5,20,,,\ntrial,1,3,60,A,10,0\n"
    )
    assert dalembert("field", "r.csv", "--page", "f.html").returncode == 0
    _, data = script_and_data((tmp_path / "f.html").read_text())
    assert data["sheet"]["runs"] == ["initial", "run 2", "run 3", "run 4"]
    assert data["sheet"]["values"] == {"initial/1/amplitude": 5, "initial/1/phase": math.radians(20)}
