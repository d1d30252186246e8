"""`field --influence` with a fit and `--digits`: computed twice, against the mixed estimation solved with 50 digits."""

from __future__ import annotations

import csv
import io
from fractions import Fraction
from pathlib import Path
from typing import Any

import mpmath as mp
import pytest

from tests.conftest import Dalembert

HEAD = "sensor,plane,magnitude_per_g,phase_deg,amplitude_unit,magnitude_uncertainty_per_g,phase_uncertainty_deg,reading_sd_um,degrees_of_freedom"
SISTERS = (("4.1", "30.25", "0.08", "1.1"), ("3.9", "33", "0.1", "1.25"), ("4.4", "28.5", "0.07", "0.9"))
RUNS = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg"
BARE = ("34.1", "116.3")
TRIAL = ("29.87", "101.4", "2.5", "40")
READING_SD = "0.31"


def vector(size: str, degrees: str) -> Any:
    turn = Fraction(degrees) % 360
    return mp.mpf(size) * mp.expj(mp.mpf(turn.numerator) / turn.denominator * mp.pi / 180)


def files(tmp_path: Path, sisters: int, *, trial: bool) -> list[str]:
    for k, sister in enumerate(SISTERS[:sisters]):
        size, phase, along, across = sister
        (tmp_path / f"{k}.csv").write_text(f"{HEAD}\n1,A,{size},{phase},um,{along},{across},{READING_SD},4\n")
    rows = [
        f"0,1,{BARE[0]},{BARE[1]},,,",
        *([f"1,1,{','.join(TRIAL[:2])},A,{','.join(TRIAL[2:])}"] if trial else []),
    ]
    (tmp_path / "runs.csv").write_text("\n".join([RUNS, *rows]) + "\n")
    return [word for k in range(sisters) for word in ("--influence", f"{k}.csv")]


def prior(sisters: int) -> tuple[Any, Any]:
    """α̂ and what a machine's coefficient lies from it, E|δ|²: pooled, or of the only sister."""
    each = [vector(size, phase) for size, phase, *_ in SISTERS[:sisters]]
    own = [mp.mpf(a) ** 2 + (mp.mpf(s) * mp.mpf(b) * mp.pi / 180) ** 2 for s, _, a, b in SISTERS[:sisters]]
    mean = sum(each) / sisters
    if sisters == 1:
        return mean, own[0]
    whole = sum(abs(a - mean) ** 2 for a in each) / (sisters - 1)
    return mean, whole * (1 + mp.mpf(1) / sisters - min(sum(own) / sisters / whole, 1))


def correction(sisters: int, *, trial: bool) -> tuple[Any, Any, Any]:
    """The correction w = -x₀/α and its deviations along and across, kg: one plane, one sensor."""
    mean, gamma = prior(sisters)
    y0, variance = vector(*BARE), mp.mpf(READING_SD) ** 2
    if not trial:
        x0, alpha, errors = y0, mean, [(1, 0, variance), (0, 1, gamma)]
    else:
        # least |y₀ - x₀|²/σ² + |y₁ - x₀ - α t|²/σ² + |α - α̂|²/γ
        y1, t = vector(*TRIAL[:2]), vector(*TRIAL[2:])
        a = mp.matrix(
            [[2 / variance, t / variance], [mp.conj(t) / variance, abs(t) ** 2 / variance + 1 / gamma]]
        )
        inverse = a**-1
        of = [mp.matrix(v) for v in ([1, 0], [1, mp.conj(t)], [0, 1])]
        of = [inverse * v / scale for v, scale in zip(of, (variance, variance, gamma), strict=True)]
        x0, alpha = of[0] * y0 + of[1] * y1 + of[2] * mean
        errors = [(*v, size) for v, size in zip(of, (variance, variance, gamma), strict=True)]
    w = -x0 / alpha
    # dw = -dx₀/α + x₀ dα/α²; circular errors: alike along and across
    square = sum(abs(-dx / alpha + x0 * da / alpha**2) ** 2 * size for dx, da, size in errors)
    deviation = mp.sqrt(square / 2)
    return w, deviation, mp.degrees(deviation / abs(w))


@pytest.mark.parametrize("trial", [False, True])
@pytest.mark.parametrize("sisters", [1, 3])
def test_the_digits_that_hold(sisters: int, trial: bool, dalembert: Dalembert, tmp_path: Path) -> None:
    known = files(tmp_path, sisters, trial=trial)
    done = dalembert("field", "runs.csv", *known, "--rotation", "ccw", "--digits")
    assert done.returncode == 0, done.stderr
    assert "in full" not in done.stderr
    (row,) = csv.DictReader(io.StringIO(done.stdout))
    with mp.workdps(50):
        w, along, across = correction(sisters, trial=trial)
        true = {
            "mass_g": abs(w),
            "angle_deg": mp.degrees(mp.arg(w)) % 360,
            "mass_uncertainty_g": along,
            "angle_uncertainty_deg": across,
        }
        for name, value in true.items():
            digits = len(row[name].replace(".", "").strip("0"))
            unit = mp.mpf(10) ** (mp.floor(mp.log10(value)) - digits + 1)
            assert abs(mp.mpf(row[name]) - value) <= unit / 2, (name, row[name], mp.nstr(value, 20))
            assert abs(mp.mpf(row[name]) - value) <= value * mp.mpf("1e-12"), (name, row[name])


def test_nothing_to_correct(dalembert: Dalembert) -> None:
    text = f"{RUNS}\n0,1,0,0,,,\n1,1,10,90,A,5,0\n"
    done = dalembert("field", "-", "--reading-error", "2%,1deg", "--digits", stdin=text)
    assert done.stdout.splitlines()[1] == "1,A,0.0,0.0,0.0,,5.0,180.0"
    assert done.stderr == "warning: no vibration in the initial run: nothing to correct\n"
