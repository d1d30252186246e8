"""Readings of one sensor taken more than once in a run: said aloud, and in the uncertainty."""

from __future__ import annotations

import json
import subprocess
from typing import Any

import numpy as np
import pytest

from tests.conftest import Dalembert

HEAD = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"
LAST = "1,1,60,80,A,10,0\n"
CONTRADICTION = HEAD + "0,1,90,20,,,\n0,1,300,200,,,\n" + LAST
AGREEMENT = HEAD + "0,1,90,20,,,\n0,1,93,21,,,\n0,1,91,19,,,\n" + LAST
SAME = HEAD + "0,1,90,20,,,\n0,1,90,20,,,\n0,1,90,20,,,\n" + LAST


def polar(size: float, degrees: float) -> complex:
    return size * complex(np.exp(1j * np.radians(degrees)))


def rotor(done: subprocess.CompletedProcess[str]) -> tuple[Any, list[str]]:
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    return found["rotors"][0], found["warnings"]


def test_a_contradiction_is_said_with_its_figures(dalembert: Dalembert) -> None:
    done = dalembert("field", "-", stdin=CONTRADICTION)
    for figure in ("run 0", "90 um at 20°", "300 um at 200°", "contradict", "105"):
        assert figure in done.stderr
    assert "contradict" not in dalembert("field", "-", stdin=AGREEMENT).stderr


def by_hand(readings: list[complex], n: int = 1) -> float:
    """One standard deviation of the mass, g: w = -V₀t/(V₁ - V₀), and the variance that the repeats show."""
    v0, v1, t = complex(np.mean(readings)), polar(60, 80), 10.0
    nu = len(readings) - 1
    single = sum(abs(v - v0) ** 2 for v in readings) / nu / 2  # of each component
    by_v0, by_v1 = -v1 * t / (v1 - v0) ** 2, v0 * t / (v1 - v0) ** 2
    return float(np.sqrt(abs(by_v0) ** 2 * single / len(readings) + abs(by_v1) ** 2 * single))


@pytest.mark.parametrize(
    ("text", "readings"),
    [
        (CONTRADICTION, [polar(90, 20), polar(300, 200)]),
        (AGREEMENT, [polar(90, 20), polar(93, 21), polar(91, 19)]),
    ],
)
def test_the_scatter_enters_the_uncertainty(text: str, readings: list[complex], dalembert: Dalembert) -> None:
    found, _ = rotor(dalembert("field", "-", "--json", stdin=text))
    (correction,) = found["corrections"]
    assert correction["mass_uncertainty_kg"] * 1000 == pytest.approx(by_hand(readings), rel=1e-12)
    # they are more readings than unknowns: a fit with something to spare
    fit = found["fit"]
    assert (fit["runs"], fit["readings"]) == (2, len(readings) + 1)
    assert fit["degrees_of_freedom"] == len(readings) - 1
    squares = sum(abs(v - np.mean(readings)) ** 2 for v in readings)
    assert fit["residual_sd"] == pytest.approx(np.sqrt(squares / (len(readings) - 1)), rel=1e-12)
    assert "degrees of freedom" in dalembert("field", "-", "--text", stdin=AGREEMENT).stdout
    assert "mass_uncertainty_g" in dalembert("field", "-", stdin=text).stdout


def test_a_stated_error_holds_in_place_of_the_scatter(dalembert: Dalembert) -> None:
    """As in every fit; a scatter that is larger by the chi-square test is a warning."""

    def answer(text: str, *options: str) -> tuple[float, str]:
        found, warned = rotor(dalembert("field", "-", "--json", *options, stdin=text))
        return float(found["corrections"][0]["mass_uncertainty_kg"]), " ".join(warned)

    v0, v1 = complex(np.mean([polar(90, 20), polar(93, 21), polar(91, 19)])), polar(60, 80)
    by_v0, by_v1 = -v1 * 10 / (v1 - v0) ** 2, v0 * 10 / (v1 - v0) ** 2
    # 2 % and as much across of a reading are circular errors, independent of one another
    each = [abs(by_v0) / 3 * 0.02 * size for size in (90, 93, 91)] + [abs(by_v1) * 0.02 * 60]
    size, _ = answer(AGREEMENT, "--reading-error", f"2%,{float(np.degrees(0.02))!r}deg")
    assert size * 1000 == pytest.approx(np.sqrt(np.sum(np.square(each))), rel=1e-9)
    small, warned = answer(CONTRADICTION, "--reading-error", "0.01%,0.01deg")
    assert small < answer(CONTRADICTION)[0] / 100
    assert "more than --reading-error states" in warned


def test_repeats_that_agree_entirely_tell_no_error(dalembert: Dalembert) -> None:
    found, _ = rotor(dalembert("field", "-", "--json", stdin=SAME))
    assert found["corrections"][0]["mass_uncertainty_kg"] == 0
    assert found["fit"]["residual_sd"] == 0


def test_few_repeats_leave_the_residual_wide(dalembert: Dalembert) -> None:
    """The 95 % are of Student's distribution: 2 real degrees of freedom against 4."""
    two, _ = rotor(dalembert("field", "-", "--json", stdin=HEAD + "0,1,90,20,,,\n0,1,93,21,,,\n" + LAST))
    sd = two["fit"]["residual_sd"]
    # a reading's own normal error alone stays below 1.73 sd in 95 % of cases
    v0, v1 = (polar(90, 20) + polar(93, 21)) / 2, polar(60, 80)
    w = -v0 / (v1 - v0)
    normal = np.sqrt(abs(1 - w) ** 2 / 2 + abs(w) ** 2) * sd * np.sqrt(-np.log(0.05))
    # |normal|² over χ²: F with 2 and 2 degrees of freedom, whose 95 % point is 19
    assert two["residual_max_95"] == pytest.approx(normal * np.sqrt(19 / -np.log(0.05)), rel=0.1)


def test_digits_and_limits_go_with_repeats(dalembert: Dalembert) -> None:
    for options in (("--digits",), ("--max-mass", "3g"), ("--objective", "minimax"), ("--from-here",)):
        done = dalembert("field", "-", *options, stdin=AGREEMENT)
        assert done.returncode == 0, done.stderr
        assert "mass_uncertainty_g" in done.stdout
    # rotors with repeats beside rotors without
    several = "rotor," + HEAD + "".join(f"a,{row}\n" for row in AGREEMENT.splitlines()[1:])
    several += "".join(f"b,{row}\n" for row in SAME.splitlines()[-2:])
    done = dalembert("field", "-", stdin=several)
    assert done.returncode == 0, done.stderr
    rows = done.stdout.splitlines()
    assert rows[1].startswith("a,A,")
    assert rows[1].split(",")[4] != ""
    assert rows[2].startswith("b,A,")
