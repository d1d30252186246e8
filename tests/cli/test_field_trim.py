"""What stands on the rotor in its last run, and the trim: what to add to it as it stands."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest

from tests.cli.logs import polar
from tests.cli.measured import ALPHA, FAN, HEAD, V0, W, cell, runs, table
from tests.cli.printed import document
from tests.conftest import Dalembert

BOTH = [[1, 0], [1, 1j]]


def vectors(entries: Any, key: str = "mass_kg") -> Any:
    return np.array([polar(entry[key], entry["angle_deg"]) for entry in entries])


def rotor_of(dalembert: Dalembert, text: str, *options: str) -> Any:
    return document(dalembert("field", "-", "--json", *options, stdin=text))["rotors"][0]


@pytest.mark.parametrize("kept", ["yes", "no", ""])
@pytest.mark.parametrize("options", [(), ("--fit",), ("--objective", "minimax"), ("--max-mass", "9g")])
def test_every_mass_of_the_last_run_stands(kept: str, options: tuple[str, ...], dalembert: Dalembert) -> None:
    """Whether it is meant to stay or not: by the readings of that run it is on."""
    text = runs("A,1,0,yes", f"B,1,90,{kept}", on=BOTH)
    rotor = rotor_of(dalembert, text, *options)
    assert np.abs(vectors(rotor["standing"]) * 1e3 - [1, 1j]).max() < 1e-15
    assert np.abs(vectors(rotor["corrections"]) * 1e3 - W).max() < 1e-6
    total = vectors(rotor["standing"]) + vectors(rotor["trim"])
    assert np.abs(total - vectors(rotor["corrections"])).max() < 1e-15
    assert [entry["plane"] for entry in rotor["trim"]] == ["A", "B"]
    assert all(entry["needed"] is True for entry in rotor["trim"])
    here = rotor_of(dalembert, text, "--from-here", *options)
    assert np.abs(vectors(here["corrections"]) - vectors(rotor["trim"])).max() < 1e-8
    assert vectors(here["trim"]).tolist() == vectors(here["corrections"]).tolist()
    assert vectors(here["standing"]).tolist() == vectors(rotor["standing"]).tolist()


def fan(*last: complex, scatter: float = 0.02, seed: int = 1) -> str:
    """A fan whose correction is 95 g at 250°: an initial run, a trial run, and runs with these masses."""
    rng = np.random.default_rng(seed)
    alpha = 0.05 * np.exp(2j)
    rows = []
    for k, on in enumerate([0, 20, *last]):
        v = alpha * (on - polar(95, 250))
        v += scatter * (rng.normal() + 1j * rng.normal())
        mass = f"A,{float(abs(on))!r},{float(np.degrees(np.angle(on)))!r}" if on else ",,"
        rows.append(f"{k},1,{cell(v)},{mass}")
    return table(*rows)


def test_a_last_run_with_the_correction_on_is_trimmed_and_not_doubled(dalembert: Dalembert) -> None:
    """Add 95 g to a fan that runs with 95 g: the most dangerous answer there was."""
    text = fan(polar(94, 249), polar(95, 250))
    for options in ((), ("--from-here",)):
        rotor = rotor_of(dalembert, text, *options)
        (trim,) = rotor["trim"]
        assert trim["mass_kg"] < 2e-3
        assert vectors(rotor["standing"]) == pytest.approx([polar(0.095, 250)])
        warnings = document(dalembert("field", "-", "--json", *options, stdin=text))["warnings"]
        assert not any("kept" in warning for warning in warnings)
    done = dalembert("field", "-", "--from-here", "--text", stdin=text)
    assert "to ADD to the rotor as it stands" in done.stdout
    assert re.search(r"standing mass +95 +g\nstanding angle +250 +°", done.stdout)
    (row,) = csv.DictReader(io.StringIO(dalembert("field", "-", "--from-here", stdin=text).stdout))
    assert float(row["mass_g"]) < 2
    assert row["mass_g"] == row["trim_mass_g"]


@pytest.mark.parametrize(
    ("last", "options", "needed"),
    [
        # far off, and nothing says what is enough
        (polar(60, 250), (), True),
        # the vibration as it stands is within the limit
        (polar(90, 250), ("--max-residual", "0.4um"), False),
        (polar(60, 250), ("--max-residual", "0.4um"), True),
        # the unbalance is within the tolerance; 5 g at 200 mm are 1000 g·mm
        (polar(90, 250), ("--permissible", "1100g_mm", "--radius", "200mm"), False),
        (polar(90, 250), ("--permissible", "900g_mm", "--radius", "200mm"), True),
        # of two limits both count
        (polar(90, 250), ("--permissible", "900g_mm", "--radius", "200mm", "--max-residual", "0.4um"), True),
        # it is not known better
        (polar(94.9, 250), ("--reading-error", "5%,5deg"), False),
        (polar(60, 250), ("--reading-error", "5%,5deg"), True),
    ],
)
def test_needed(last: complex, options: tuple[str, ...], needed: bool, dalembert: Dalembert) -> None:
    text = fan(last, scatter=1e-9)
    rotor = rotor_of(dalembert, text, *options)
    (trim,) = rotor["trim"]
    assert trim["needed"] is needed
    said = dalembert("field", "-", "--text", *options, stdin=text).stdout
    assert re.search(r"^needed +(yes|no)$", said, re.MULTILINE)[1] == ("yes" if needed else "no")  # type: ignore[index]


def test_needed_is_per_plane(dalembert: Dalembert) -> None:
    """A is within its half of the tolerance, B is not; nothing is left to correct in a plane that has it all."""
    on = [[1, 0], [0, 1j], W - [0.1, 2]]
    masses = [";".join(repr(float(x)) for x in f(on[2])) for f in (np.abs, lambda z: np.degrees(np.angle(z)))]
    text = runs("A,1,0,", "B,1,90,", f"A;B,{masses[0]},{masses[1]},", on=on)
    tolerance = ("--permissible", "100g_mm", "--radius", "100mm")
    assert [entry["needed"] for entry in rotor_of(dalembert, text, *tolerance)["trim"]] == [False, True]
    on[2] = W - [0, 2]
    masses = [";".join(repr(float(x)) for x in f(on[2])) for f in (np.abs, lambda z: np.degrees(np.angle(z)))]
    text = runs("A,1,0,", "B,1,90,", f"A;B,{masses[0]},{masses[1]},", on=on)
    assert [entry["needed"] for entry in rotor_of(dalembert, text)["trim"]] == [False, True]


def test_the_uncertainty_is_along_the_trim(dalembert: Dalembert) -> None:
    """The masses that stand are known: the trim's own error is the correction's, turned to the trim's direction."""
    text = fan(polar(70, 200), scatter=1e-9)
    options = ("--reading-error", "3%,0.1deg")
    rotor = rotor_of(dalembert, text, *options)
    here = rotor_of(dalembert, text, "--from-here", *options)
    (fix,), (trim,), (same,) = rotor["corrections"], rotor["trim"], here["corrections"]
    assert trim["mass_uncertainty_kg"] == pytest.approx(same["mass_uncertainty_kg"], rel=1e-9)
    assert trim["angle_uncertainty_deg"] == pytest.approx(same["angle_uncertainty_deg"], rel=1e-9)
    assert trim["mass_uncertainty_kg"] != pytest.approx(fix["mass_uncertainty_kg"], rel=1e-2)


def test_a_last_run_without_masses(dalembert: Dalembert) -> None:
    """An initial run that is written last: nothing stands, and the trim is the correction."""
    head, first, last = FAN.splitlines()
    for text in ("\n".join([head, last, first]), fan(polar(50, 0), 0)):
        rotor = rotor_of(dalembert, text)
        assert vectors(rotor["standing"]).tolist() == [0]
        assert vectors(rotor["trim"]).tolist() == vectors(rotor["corrections"]).tolist()
        assert "no mass" in dalembert("field", "-", "--text", stdin=text).stdout


def test_a_run_left_out_of_the_fit_stands_all_the_same(dalembert: Dalembert) -> None:
    text = fan(polar(60, 240), polar(94, 250), polar(90, 250))
    rotor = rotor_of(dalembert, text, "--exclude", "4")
    assert vectors(rotor["standing"]) == pytest.approx([polar(0.090, 250)])
    # a mass in a plane that only the excluded run has: its effect is not known, and that is said
    other = text + "5,1,1,20,C,7,0\n"
    done = document(dalembert("field", "-", "--json", "--exclude", "5", stdin=other))
    assert [entry["plane"] for entry in done["rotors"][0]["standing"]] == ["A"]
    assert any("plane C" in warning for warning in done["warnings"])


def test_stored_coefficients(dalembert: Dalembert, tmp_path: Path) -> None:
    text = runs("A,1,0,yes", "B,1,90,", on=BOTH)
    dalembert("field", "-", "--save-influence", "ic.csv", stdin=text)
    rotor = rotor_of(dalembert, text, "--influence", "ic.csv")
    assert np.abs(vectors(rotor["standing"]) * 1e3 - [1, 1j]).max() < 1e-15
    assert np.abs(vectors(rotor["trim"]) * 1e3 - (W - [1, 1j])).max() < 1e-12
    done = document(
        dalembert("field", "-", "--json", "--influence", "ic.csv", stdin=text.replace("B,1,", "C,1,"))
    )
    assert np.abs(vectors(done["rotors"][0]["standing"]) * 1e3 - [1, 0]).max() < 1e-15
    assert any("plane C" in warning for warning in done["warnings"])
    moments = text.replace("trial_mass_g", "trial_unbalance_g_mm")
    done = document(dalembert("field", "-", "--json", "--influence", "ic.csv", stdin=moments))
    assert any("other masses" in warning for warning in done["warnings"])


def test_four_runs_without_phase(dalembert: Dalembert) -> None:
    trials = [(0, 0), (8, 0), (8, 120), (8, 240)]
    rows = [
        f"{k},1,{float(abs(6 * np.exp(0.5j) + 0.7 * polar(m, a)))!r},,{f'A,{m},{a}' if m else ',,'}"
        for k, (m, a) in enumerate(trials)
    ]
    rotor = rotor_of(dalembert, table(*rows), "--method", "four-run")
    assert vectors(rotor["standing"]) == pytest.approx([polar(0.008, 240)])
    assert vectors(rotor["trim"]) == pytest.approx(vectors(rotor["corrections"]) - polar(0.008, 240))


def test_unbalances_and_places(dalembert: Dalembert) -> None:
    text = runs("A,1,0,yes", "B,1,90,", on=BOTH).replace("trial_mass_g", "trial_unbalance_g_mm")
    rotor = rotor_of(dalembert, text, "--blades", "8")
    assert np.abs(vectors(rotor["trim"], "unbalance_kg_m") * 1e6 - (W - [1, 1j])).max() < 1e-12
    assert "unbalance_uncertainty_kg_m" in rotor["trim"][0]
    for entry in [*rotor["corrections"], *rotor["trim"]]:
        parts = sum(vectors(entry["split"], "unbalance_kg_m"))
        assert parts == pytest.approx(polar(entry["unbalance_kg_m"], entry["angle_deg"]), rel=1e-12)
    out = dalembert("field", "-", stdin=text).stdout
    assert out.splitlines()[0].endswith("trim_unbalance_g_mm,trim_angle_deg")


def test_workbook_report_and_terminal_say_it(dalembert: Dalembert, tmp_path: Path) -> None:
    text = runs("A,1,0,yes", "B,1,90,", on=BOTH)
    dalembert("field", "-", "--report", "out.md", "--blades", "8", stdin=text)
    page = (tmp_path / "out.md").read_text()
    for options in ((), ("--from-here",)):
        dalembert("field", "-", "-o", "out.xlsx", "--blades", "8", *options, stdin=text)
        head, *cells = openpyxl.load_workbook(tmp_path / "out.xlsx")["corrections"].values
        at = {name: k for k, name in enumerate(head)}
        trim = [polar(row[at["trim_mass_g"]], row[at["trim_angle_deg"]]) for row in cells]
        assert np.abs(np.array(trim) - (W - [1, 1j])).max() < 1e-12
        said = dalembert("field", "-", "--text", "--blades", "8", *options, stdin=text).stdout
        for out in (page, said):
            assert re.search(r"A\W+2\W+1\W+0\W+2.0885\W+29.425", out)
            assert re.search(r"B\W+2\W+1\W+90\W", out)


def test_digits_of_the_trim(dalembert: Dalembert) -> None:
    text = runs("A,1,0,yes", "B,1,90,", on=BOTH)
    full, short = (
        list(csv.DictReader(io.StringIO(dalembert("field", "-", *options, stdin=text).stdout)))
        for options in ((), ("--digits",))
    )
    for row, digits, exact in zip(full, short, W - [1, 1j], strict=True):
        assert len(digits["trim_mass_g"]) <= len(row["trim_mass_g"])
        assert abs(float(digits["trim_mass_g"]) - abs(exact)) < 1e-10 * abs(exact)


@pytest.mark.slow
def test_random_logs_against_their_hidden_truth(dalembert: Dalembert) -> None:
    """Random rotors, planes, kept and taken-off masses: corrections are the hidden ones, the trim is what is lacking."""
    rng = np.random.default_rng()
    seed = int(rng.integers(2**32))
    rng = np.random.default_rng(seed)
    for _ in range(60):
        p = int(rng.integers(1, 4))
        s = p + int(rng.integers(0, 3))
        alpha = rng.normal(size=(s, p)) + 1j * rng.normal(size=(s, p))
        w = rng.normal(size=p) + 1j * rng.normal(size=p)
        rows, standing = [f"0,{k},{cell(v)},,,," for k, v in enumerate(-alpha @ w)], np.zeros(p, complex)
        on = standing
        for run in range(p + int(rng.integers(0, 3))):
            plane = run % p
            mass, turn = rng.uniform(0.5, 3), rng.integers(0, 360)
            on = standing + polar(mass, turn) * np.eye(p)[plane]
            kept = rng.random() < 0.5
            text = f"{'ABC'[plane]},{mass!r},{turn},{'yes' if kept else 'no'}"
            rows += [f"{run + 1},{k},{cell(v)},{text}" for k, v in enumerate(alpha @ (on - w))]
            standing = on if kept else standing
        options = ("--fit",) if rng.random() < 0.3 else ()
        rotor = rotor_of(dalembert, table(*rows, head=HEAD + ",trial_kept"), *options)
        condition = float(np.linalg.cond(alpha)) * 1e-9
        assert np.abs(vectors(rotor["standing"]) * 1e3 - on).max() < 1e-12, seed
        assert np.abs(vectors(rotor["trim"]) * 1e3 - (w - on)).max() < condition, seed


def test_the_json_has_what_the_contract_names(dalembert: Dalembert) -> None:
    rotor = json.loads(dalembert("field", "-", "--json", stdin=FAN).stdout)["rotors"][0]
    (standing,), (trim,) = rotor["standing"], rotor["trim"]
    assert set(standing) == {"plane", "mass_kg", "angle_deg"}
    assert {"plane", "mass_kg", "angle_deg", "mass_uncertainty_kg", "needed"} <= set(trim)
    assert abs(V0[0] + ALPHA[0] @ W) < 1e-12


def test_a_split_on_blades_numbered_against_the_angles(dalembert: Dalembert) -> None:
    """The same weights at the same angles, under the numbers that run the other way; in the trim too."""
    text = runs("A,1,0,yes", "B,1,90,yes", on=BOTH)
    there, back = (
        rotor_of(dalembert, text, "--blades", "7", *more) for more in ((), ("--numbering", "against"))
    )
    for key in ("corrections", "trim"):
        for one, other in zip(there[key], back[key], strict=True):
            numbers = [{m["position"]: m["mass_kg"] for m in entry["split"]} for entry in (one, other)]
            turned = {str((8 - int(name)) % 7 + 1): mass for name, mass in numbers[0].items()}
            assert numbers[1] == pytest.approx(turned, rel=1e-13)
