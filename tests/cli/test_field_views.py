"""`dalembert field`: static and couple parts, stored headers, the commands beside it, its help."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from tests.cli.measured import FAN, W, runs
from tests.cli.printed import document
from tests.conftest import Dalembert

BOTH = runs("A,1,0,", "B,1,90,", on=[[1, 0], [0, 1j]])


def vector(entry: dict[str, float]) -> complex:
    return complex(1e3 * entry["mass_kg"] * np.exp(1j * np.radians(entry["angle_deg"])))


def test_static_and_couple_parts_add_up_to_the_corrections(dalembert: Dalembert) -> None:
    (rotor,) = document(dalembert("field", "-", "--json", "--view", "static-couple", stdin=BOTH))["rotors"]
    static, couple = (vector(rotor["static_couple"][part]) for part in ("static", "couple"))
    assert static == pytest.approx((W[0] + W[1]) / 2, rel=1e-12)
    assert couple == pytest.approx((W[0] - W[1]) / 2, rel=1e-12)
    fix = [vector(entry) for entry in rotor["corrections"]]
    assert [static + couple, static - couple] == pytest.approx(fix, rel=1e-12)
    (plain,) = document(dalembert("field", "-", "--json", stdin=BOTH))["rotors"]
    assert "static_couple" not in plain
    assert plain["corrections"] == rotor["corrections"]
    shown = dalembert("field", "-", "--text", "--view", "static-couple", stdin=BOTH).stdout
    assert "Static: to ADD in each of both planes" in shown
    done = dalembert("field", "-", "--view", "static-couple", stdin=FAN)
    assert done.returncode == 2
    assert "need two planes, found 1: A" in " ".join(done.stderr.split())


def test_headers_from_a_file(dalembert: Dalembert, tmp_path) -> None:  # type: ignore[no-untyped-def]
    text = FAN.replace("amplitude_um", "Anzeige").replace("trial_mass_g", "Testgewicht")
    (tmp_path / "headers.toml").write_text('amplitude_um = "Anzeige"\ntrial_mass_g = "Testgewicht"\n')
    assert dalembert("field", "-", stdin=text).returncode == 1
    done = dalembert("field", "-", "--columns", "headers.toml", stdin=text)
    assert done.stdout == dalembert("field", "-", stdin=FAN).stdout
    # --column goes before the file
    other = text.replace("Anzeige", "Wert")
    done = dalembert("field", "-", "--columns", "headers.toml", "--column", "amplitude_um=Wert", stdin=other)
    assert done.stdout == dalembert("field", "-", stdin=FAN).stdout
    for wrong, words in (("amplitude_um = 1", "expected a header in quotes"), ("a = ", "headers.toml: ")):
        (tmp_path / "headers.toml").write_text(wrong)
        done = dalembert("field", "-", "--columns", "headers.toml", stdin=text)
        assert done.returncode == 1
        assert words in done.stderr


@pytest.mark.whole
@pytest.mark.parametrize(
    ("old", "new"),
    [
        (("--signal", "s.csv"), "dalembert signal FILE.csv"),
        (("--signal", "s.csv", "--pulses", "6"), "dalembert signal FILE.csv"),
        (("--suggest-trial", "--rotor-mass", "9kg"), "dalembert trial --rotor-mass MASS"),
        (("--suggest-trial", "--planes", "2"), "dalembert trial --rotor-mass MASS"),
        (("runs.csv", "--planes", "2"), "dalembert trial --planes N"),
    ],
)
def test_an_old_spelling_is_answered_by_the_new_one(
    old: tuple[str, ...], new: str, dalembert: Dalembert
) -> None:
    done = dalembert("field", *old)
    assert done.returncode == 2
    assert new in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_the_help_lists_few_options_and_names_all(dalembert: Dalembert) -> None:
    page = dalembert("field", "--help").stdout
    own = page[: page.index("\nOutput:\n")]
    assert len(re.findall(r"^  -", own, re.MULTILINE)) <= 14
    for name in ("--view", "--columns", "--ridge", "--method <influence|four-run>", "--rotation <ccw|cw>"):
        assert name in " ".join(page.split())
    for name in ("--signal", "--suggest-trial"):
        assert name not in page


def test_units_and_digits_leave_the_document_alone(dalembert: Dalembert) -> None:
    options = ("--reading-error", "2%,2deg", "--blades", "8", "--json")
    plain, other = (
        json.loads(dalembert("field", "-", *options, *more, stdin=BOTH).stdout)
        for more in ((), ("--units", "oz,rad", "--digits"))
    )
    assert plain == other
