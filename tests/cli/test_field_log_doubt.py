"""Doubt about a log that was fitted: drift over time where runs have dates, the largest residual to be expected."""

from __future__ import annotations

import json
import re
import subprocess
from datetime import datetime
from typing import Any

import numpy as np
import pytest

from tests.conftest import Dalembert

HEAD = "date,run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"
DATES = ["2012-03-01", "14.03.2013", "2014/07/02", "2015-01-01 08:30", "2016-12-24", "1.2.2018", "2019-05"]
DAYS = [(2012, 3, 1), (2013, 3, 14), (2014, 7, 2), (2015, 1, 1), (2016, 12, 24), (2018, 2, 1), (2019, 5, 1)]
YEARS = [(datetime(*day) - datetime(2012, 3, 1)).days / 365.25 for day in DAYS]
MASSES = [0, 10j, 12, 0, -9 - 9j, 8 - 8j, 0]


def log(rate: complex, dates: list[str] = DATES, scatter: float = 0.2) -> str:
    lines = [HEAD]
    errors = scatter * np.exp(1j * np.arange(7.0) ** 2)
    for k, (w, date, e) in enumerate(zip(MASSES, dates, errors, strict=True)):
        v = 60 + 20j + (2 - 1j) * w + rate * YEARS[k] + e
        on = f"A,{abs(w):.17g},{np.degrees(np.angle(w)):.17g}" if w else ",,"
        lines.append(f"{date},{k},1,{abs(v):.17g},{np.degrees(np.angle(v)):.17g},{on}\n")
    return "".join(lines)


def found(done: subprocess.CompletedProcess[str]) -> tuple[Any, list[str]]:
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    return document["rotors"][0], document["warnings"]


def test_drift_is_told_with_its_level_in_text_and_json(dalembert: Dalembert) -> None:
    rotor, warnings = found(dalembert("field", "-", "--json", stdin=log(1.5j)))
    drift = rotor["fit"]["drift"]
    assert drift["drifts"] is True
    assert drift["level"] == 0.05
    assert drift["probability"] < 0.05
    (rate,) = drift["rates"]
    assert rate["amplitude_per_year"] == pytest.approx(1.5, abs=3 * rate["amplitude_per_year_uncertainty"])
    assert rate["phase_deg"] == pytest.approx(90, abs=10)
    (said,) = [warning for warning in warnings if "drifts" in warning]
    for word in ("F test at 5%", "in a year sensor 1 by", "--exclude"):
        assert word in said
    still, warnings = found(dalembert("field", "-", "--json", stdin=log(0)))
    assert still["fit"]["drift"]["drifts"] is False
    assert not any("drift" in warning for warning in warnings)
    text = dalembert("field", "-", "--text", stdin=log(0)).stdout
    assert "drift probability" in text
    assert "drift_probability: by chance in so many logs (F test at 5%)" in text


def test_dates_that_lack_or_are_none(dalembert: Dalembert) -> None:
    rotor, warnings = found(dalembert("field", "-", "--json", stdin=log(1.5j, [*DATES[:3], "", *DATES[4:]])))
    assert rotor["fit"]["drift"]["probability"] is None
    assert any("no date in run 3: drift over time is not tested" in warning for warning in warnings)
    for wrong in ("03/14/2012", "yesterday", "2012-13-01"):
        done = dalembert("field", "-", "--fit", stdin=log(0, [wrong, *DATES[1:]]))
        assert done.returncode == 1
        for word in ("row 1", "column date", f"found '{wrong}'", "a date such as 2019-03-14"):
            assert word in done.stderr
    without, _ = found(dalembert("field", "-", "--json", stdin=log(0).replace("date", "remark")))
    assert "drift" not in without["fit"]


def test_another_day_is_another_run(dalembert: Dalembert) -> None:
    text = """date;state;amplitude_um;phase;mass_kg;phase
2019-01-05;n;80;40;0;0
2019-01-05;u;60;55;0;0
2019-02-05;n;99,0;44,0;10;-90
2019-02-05;u;84,9;53,5;10;-90
2019-03-05;n;127,2;61,2;30;-60
2019-04-05;u;131,8;68,9;30;-60
"""
    rotor, _ = found(dalembert("field", "-", "--json", stdin=text))
    assert [one["run"] for one in rotor["fit"]["residuals"]] == ["1", "1", "2", "2", "3", "4"]


@pytest.mark.parametrize("options", [(), ("--reading-error", "2%,2deg"), ("--max-mass", "9g")])
def test_the_largest_residual_to_be_expected(options: tuple[str, ...], dalembert: Dalembert) -> None:
    rotor, _ = found(dalembert("field", "-", "--json", *options, stdin=log(0)))
    (left,) = rotor["residual"]
    largest, sd = rotor["residual_max_95"], left["amplitude_uncertainty"]
    if left["amplitude"] < 1e-9:
        # one channel, brought to nothing: |error| of two components, Student's with 5 complex degrees of freedom
        k = 2.4477 if options else 2.8656
        assert largest == pytest.approx(k * sd, rel=0.05)
    else:
        assert left["amplitude"] + sd < largest < left["amplitude"] + 3 * sd
    exact, _ = found(dalembert("field", "-", "--json", "--max-mass", "9g", stdin=log(0, scatter=0)))
    assert exact["residual_max_95"] == pytest.approx(exact["residual_max"], rel=1e-12)
    said = dalembert("field", "-", "--text", *options, stdin=log(0)).stdout
    assert re.search(rf"residual max 95 +{largest:.6g} +µm", said)
    assert "stays below it in 95 % of cases" in said


TWICE = """run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg
0,1,80,40,,,
1,1,90,41,A,5,0
1,1,97,43,A,5,0
"""
LINE = """ ;DoubleA;phase;mass;phase
n;80;40;0;0
n;99;44;10;20
n;120;46;20;20
n;61;33;10;200
"""


def test_two_readings_that_differ_by_more_than_their_stated_error(dalembert: Dalembert) -> None:
    """8 % and 2° apart: too far for errors of 1 % and 1°, not for those of 5 % and 3°."""
    told = [
        found(dalembert("field", "-", "--json", "--fit", "--reading-error", error, stdin=TWICE))[1]
        for error in ("1%,1deg", "5%,3deg")
    ]
    (said,) = [warning for warning in told[0] if "contradict" in warning]
    for word in ("run 1, sensor 1", "with the same masses:", "90 um at 41°", "97 um at 43°"):
        assert word in said
    assert not any("contradict" in warning for warning in told[1])


def test_masses_on_one_line_cannot_tell_the_sense_of_the_phase(dalembert: Dalembert) -> None:
    for options in ((), ("--phase-lag",)):
        rotor, _ = found(dalembert("field", "-", "--json", *options, stdin=LINE))
        assert rotor["fit"]["phase_sense"] is None
        said = dalembert("field", "-", "--text", *options, stdin=LINE).stdout
        assert (
            "the sense of the phase cannot be determined: add a run with a mass at an angle off the line"
            in said
        )


def test_a_state_read_once_is_left_out_and_what_is_known_of_it_is_said(dalembert: Dalembert) -> None:
    head = " ;DoubleA;phase;mass;phase\nn;80;40;0;0\nn;99;44;10;20\n"
    for once, words in (
        (
            "u;60;30;0;0\n",
            "its vibration without masses is known, but the effect of a mass in plane 1 is not",
        ),
        (
            "u;60;30;10;20\n",
            "its effect cannot be separated from the vibration without it: add a run without",
        ),
    ):
        rotor, warnings = found(dalembert("field", "-", "--json", stdin=head + once))
        assert [one["state"] for one in rotor["residual"]] == ["n"]
        (said,) = [warning for warning in warnings if "was read once" in warning]
        assert words in said
        assert "it takes no part in the fit" in said


def test_planes_that_no_run_tells_apart(dalembert: Dalembert) -> None:
    text = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"
    for run, size in enumerate((0, 5, 10, 7)):
        on = f"A;B,{size};{size},0;90" if size else ",,"
        text += f"{run},1,{80 + size},40,{on}\n{run},2,{70 - size},30,{on}\n"
    done = dalembert("field", "-", "--fit", stdin=text)
    assert done.returncode == 1
    assert "do not separate the planes: add a run in which the mass of one plane alone changes" in done.stderr


def test_a_rotor_whose_runs_do_not_show_the_sense_beside_one_that_lags(dalembert: Dalembert) -> None:
    """One instrument may have read both: the rotor that was not turned round is named."""
    rows = [
        "R1,0,1,10,0,,,",
        "R1,1,1,10,90,A,5,0",
        "R2,0,1,10,0,,,",
        "R2,1,1,11.18034,-26.565,A,5,0",
        "R2,2,1,5.0,0,A,5,90",
    ]
    rows += ["R2,3,1,11.18034,26.565,A,5,180", "R2,4,1,15.0,0,A,5,270"]
    text = "\n".join([f"rotor,{HEAD.partition(',')[2].strip()}", *rows]) + "\n"
    done = dalembert("field", "-", stdin=text)
    assert done.returncode == 0, done.stderr
    assert "rotor R2: the runs show that the instrument's phase lags" in done.stderr
    assert "the phases of 1 rotor (R1) were not reversed" in done.stderr
    stated = dalembert("field", "-", "--phase-lag", stdin=text)
    assert "were not reversed" not in stated.stderr
