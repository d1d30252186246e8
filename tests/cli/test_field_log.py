"""Balancing logs as people keep them: read in every layout, all runs fitted at once, doubt said aloud."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.logs import BEST, ERRORS, MASSES, STATES, TABLE, THREE, correction, found, log, polar, standard
from tests.conftest import Dalembert


def test_layout_1_exact(dalembert: Dalembert) -> None:
    rotor, _ = found(dalembert("field", "-", "--json", stdin="\ufeff" + log(THREE)))
    assert abs(correction(rotor) - BEST) < 1e-12 * abs(BEST)
    fit = rotor["fit"]
    assert {key: fit[key] for key in ("runs", "readings", "degrees_of_freedom", "phase_sense")} == {
        "runs": 3,
        "readings": 6,
        "degrees_of_freedom": 2,
        "phase_sense": "lead",
    }
    assert fit["residual_sd"] < 1e-12 * 80
    for entry, after in zip(fit["initial"], rotor["residual"], strict=True):
        v0, alpha = STATES[entry["state"]]
        assert abs(polar(entry["amplitude"], entry["phase_deg"]) - v0) < 1e-12 * abs(v0)
        assert abs(polar(after["amplitude"], after["phase_deg"]) - v0 - alpha * BEST) < 1e-11
        assert after["state"] == entry["state"]
    assert [one["run"] for one in fit["residuals"]] == ["1", "1", "2", "2", "3", "3"]


def test_the_published_page_s_rounded_figures(dalembert: Dalembert) -> None:
    rows = """ ;DoubleA;phase;mass;phase
100%n;80;40;0;0
100%U;60;55;0;0
100%n;99,030381;43,960790;10;-90
100%U;84,932821;53,529955;10;-90
100%n;127,164307;61,188851;30;-60
100%U;131,839941;68,911067;30;-60
"""
    rotor, _ = found(dalembert("field", "-", "--json", stdin=rows))
    assert abs(correction(rotor) - BEST) < 1e-6
    assert rotor["influence"][1]["magnitude_per_kg"] == pytest.approx(2.5, abs=1e-7)


def test_layout_2_masses_on_top_of_others(dalembert: Dalembert) -> None:
    rows = """ ;DoubleA;phase;mass;phase;ref;use
100%n;80;40;0;0;-1;0
100%n;99,030381;43,960790;10;-90;1;1
100%n;95,459687;55,577102;10;90;2;1
"""
    rotor, warnings = found(dalembert("field", "-", "--json", stdin=rows))
    assert rotor["influence"][0]["magnitude_per_kg"] == pytest.approx(2, abs=1e-6)
    assert rotor["fit"]["residual_sd"] < 1e-6
    assert correction(rotor) == pytest.approx(polar(40, 70), abs=1e-5)
    assert any("every row is used" in warning for warning in warnings)
    # all on top of the base run: absolute, a header spelt in full
    absolute = rows.replace("ref;use", "reference;useful").replace("10;90;2;1", "14,142135623730951;-45;1;1")
    again, _ = found(dalembert("field", "-", "--json", stdin=absolute))
    assert correction(again) == pytest.approx(correction(rotor), abs=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "A: [80@40, 60@55]\nB: [[99.030381@43.960790], [84.932821@53.529955]]\nU: [10@-90]\n",
        "---\n# sensors\nA:\n  - 80@40\n  - 60@55\nB:\n  - - 99.030381@43.960790\n  - - 84.932821@53.529955\nU:\n  - 10@-90\n",
        "A: 80@40, 60@55\nB: [[99.030381@43.960790],\n    [84.932821@53.529955]]\nU: 10@-90\nkeep_trial: False\n",
        '{"A": ["80@40", "60@55"], "B": [["99.030381@43.960790"], ["84.932821@53.529955"]], "U": ["10@-90"]}',
        '\ufeff {\n "U": ["10@-90"], "keep_trial": false, "weight_const": {"0": 50},\n "A": ["80@40", "60@55"],\n'
        ' "B": [["99.030381@43.960790"],\n ["84.932821@53.529955"]]}\n',
    ],
)
def test_layout_3_vectors(text: str, dalembert: Dalembert) -> None:
    rotor, _ = found(dalembert("field", "-", "--json", stdin=text))
    assert abs(correction(rotor) - BEST) < 1e-5
    assert [one["sensor"] for one in rotor["residual"]] == ["1", "2"]
    assert rotor["fit"]["degrees_of_freedom"] == 0
    assert rotor["fit"]["residual_sd"] is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"A": ["80@40"', "standard input: line 1: no JSON"),
        ('{"A": ["80@40"], "B": 3, "U": ["1@0"]}', "B: found '3', expected amplitude@phase"),
        ('{"A": ["80@40"], "A": ["60@40"]}', "A stands twice"),
        ('{"A": null}', "no B: expected A (initial vectors), B (trial runs)"),
    ],
)
def test_layout_3_as_json_that_is_wrong(text: str, said: str, dalembert: Dalembert) -> None:
    done = dalembert("field", "-", stdin=text)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert said in done.stderr


def test_layout_3_with_masses_left_on_slow_roll_and_limits(dalembert: Dalembert) -> None:
    rng = np.random.default_rng(1)
    x0, alpha = rng.normal(size=3) + 2j, rng.normal(size=(3, 2)) + 1j * rng.normal(size=(3, 2))
    slow, u = 0.3 * rng.normal(size=3) + 0.1j, np.array([polar(2, 30), polar(3, 200)])
    runs = [x0 + alpha[:, 0] * u[0] + slow, x0 + alpha @ u + slow]

    def cell(v: complex) -> str:
        return f"{abs(v):.17g}@{np.degrees(np.angle(v)):.17g}"

    text = "\n".join(
        [
            f"A: [{', '.join(map(cell, x0 + slow))}]",
            f"B: [{', '.join(f'[{cell(a)}, {cell(b)}]' for a, b in zip(*runs, strict=True))}]",
            f"U: [{', '.join(map(cell, u))}]",
            f"A0: [{', '.join(map(cell, slow))}]",
            "keep_trial: True",
        ]
    )
    rotor, _ = found(dalembert("field", "-", "--json", stdin=text))
    best = -np.linalg.lstsq(alpha, x0, rcond=None)[0]
    assert [correction(rotor, 0), correction(rotor, 1)] == pytest.approx(best.tolist(), abs=1e-11)
    limited, _ = found(dalembert("field", "-", "--json", stdin=text + "\nweight_const: {0: 0.01}"))
    assert limited["corrections"][0]["mass_kg"] == pytest.approx(min(0.01, abs(best[0])))


STARTS = """start,state,speed_Hz,amplitude_counts,phase_deg
1,without,49.0,151.2,20.4
2,without,52.3,186.9,22.0
3,with 0.06 g,49.0,24.8,39.5
"""


def test_layout_4_starts_at_speeds_far_apart_are_kept_apart(dalembert: Dalembert) -> None:
    done = dalembert("field", "-", "--json", stdin=STARTS)
    rotor, warnings = found(done)
    v0, v1 = polar(151.2, 20.4), polar(24.8, 39.5)
    assert correction(rotor) == pytest.approx(-v0 * 0.06e-3 / (v1 - v0), abs=1e-15)
    assert json.loads(done.stdout)["amplitude_unit"] == "counts"
    (left_out,) = [warning for warning in warnings if "52.3" in warning]
    for word in ("once", "run 2", "vibration without masses is known", "plane 1", "another mass"):
        assert word in left_out
    near, _ = found(dalembert("field", "-", "--json", stdin=STARTS.replace("52.3", "49.6")))
    assert near["fit"]["degrees_of_freedom"] == 1


def test_no_run_without_a_mass_and_a_state_that_a_run_lacks(dalembert: Dalembert) -> None:
    text = log([(10, -90), (30, -60), (20, 100), (5, 0)], skip=[(2, "100%U")])
    rotor, _ = found(dalembert("field", "-", "--json", stdin=text))
    assert abs(correction(rotor) - BEST) < 1e-11
    assert rotor["fit"]["readings"] == 7
    assert rotor["fit"]["runs"] == 4


def test_a_state_that_was_not_read_may_be_a_row_of_blank_cells(dalembert: Dalembert) -> None:
    head, *lines = standard(MASSES, ERRORS, sensors=1).splitlines()
    blank = "9,1,,," + ",".join(lines[2].split(",")[4:])
    full, _ = found(dalembert("field", "-", "--json", stdin="\n".join([head, *lines])))
    same, _ = found(dalembert("field", "-", "--json", stdin="\n".join([head, *lines, blank])))
    assert same == full
    half = "9,1,7,," + ",".join(lines[2].split(",")[4:])
    done = dalembert("field", "-", stdin="\n".join([head, *lines, half]))
    assert done.returncode == 1
    assert "amplitude and phase both blank" in done.stderr


def test_plain_headers_of_a_run_s_masses_and_radians(dalembert: Dalembert) -> None:
    plain = (
        "run,amplitude_um,phase_rad,mass_g,angle_rad\n1,80,0.7,,\n2,99,0.77,10,-1.57\n3,127,1.07,30,-1.05\n"
    )
    theirs = plain.replace("mass_g", "trial_mass_g").replace("angle_rad", "trial_angle_rad")
    one, other = (dalembert("field", "-", stdin=text) for text in (plain, theirs))
    assert one.returncode == 0, one.stderr
    assert one.stdout == other.stdout


def test_just_enough_runs_give_todays_answer(dalembert: Dalembert) -> None:
    text = standard([0, 10j], [0, 0])
    today, _ = found(dalembert("field", "-", "--json", stdin=text))
    fit, _ = found(dalembert("field", "-", "--json", "--fit", stdin=text))
    assert "fit" not in today
    assert correction(fit) == pytest.approx(correction(today), rel=1e-12)
    stated = [
        found(dalembert("field", "-", "--json", *more, "--reading-error", "2%,2deg", stdin=text))[0]
        for more in ([], ["--fit"])
    ]
    first, second = (one["corrections"][0]["mass_uncertainty_kg"] for one in stated)
    assert first == pytest.approx(second, rel=1e-10)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (log([(0, 0), (0, 0)]), ["no mass ever changed"]),
        (log([(10, 5), (10, 5)]), ["was read 2 times (runs 1, 2)", "run without", "another mass"]),
        (log([(0, 0)]), ["no mass ever changed"]),
        ("A: [80@40]\nU: [1@2]\n", ["no B", "trial runs"]),
        ("A: [80@40]\nB: [[1@2, 3@4]]\nU: [1@2]\n", ["B has 1 rows of 2", "1 trial runs"]),
        ("A: [80@40] [60@55]\nB: [[1@2]]\nU: [1@2]\n", ["A: found 2 lists, expected one"]),
        ("A: [80-40]\nB: [[1@2]]\nU: [1@2]\n", ["A: found '80-40'", "amplitude@phase"]),
        (log(THREE).replace("30;-60", "30;x", 1), ["found 'x'", "angle of the trial mass"]),
        (log(THREE).replace("30;-60", "-30;-60", 1), ["found '-30'", "a positive trial mass, or 0"]),
        (" ;DoubleA;phase;mass;phase;ref\nn;1;2;0;0;-1\nn;2;3;1;0;7\n", ["ref", "found '7'", "earlier run"]),
        ("start,state,speed_Hz,amplitude_counts,phase_deg\n1,without,49,1,2\n", ["no unit"]),
        (" ;phase;mass;phase\nn;1;0;0\n", ["no column amplitude"]),
    ],
)
def test_bad_logs(text: str, words: list[str], dalembert: Dalembert) -> None:
    done = dalembert("field", "-", stdin=text)
    assert done.returncode == 1
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    for word in words:
        assert word in done.stderr


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--predict", "7g"], "MASS@ANGLE"),
        (["--predict", "B=7g@3"], "no plane B"),
        (["--predict", "7mm@3"], "unknown mass unit"),
        (["--fit", "--method", "four-run"], "--fit"),
    ],
)
def test_wrong_usage(options: list[str], word: str, dalembert: Dalembert, tmp_path: Any) -> None:
    (tmp_path / "c.csv").write_text("sensor,speed_rpm,plane,magnitude_per_g,phase_deg\n0,,A,1,2\n")
    done = dalembert("field", "-", *options, stdin=standard(MASSES, ERRORS))
    assert done.returncode == 2
    assert word in done.stderr


def test_a_table_with_runs_to_spare_may_repeat_the_base_run_and_lack_a_reading(dalembert: Dalembert) -> None:
    text = standard(MASSES, [0] * 6)
    lacking = "".join(
        line for line in text.splitlines(keepends=True) if not line.startswith(("2,1,", "0,0,"))
    )
    for table, readings in ((text, 12), (lacking, 10)):
        rotor, _ = found(dalembert("field", "-", "--json", stdin=table))
        assert rotor["fit"]["readings"] == readings
        assert rotor["fit"]["residual_sd"] < 1e-12


def test_a_kept_mass_stays_on_where_its_run_is_left_out(dalembert: Dalembert) -> None:
    x0, alpha = 40 + 9j, np.array([2 + 1j, -1 + 3j])
    runs = [(0, 0, ""), (5, 0, "yes"), (5, 4j, ""), (5, -3, ""), (5 + 2j, 0, ""), (5, 1, "")]
    lines = [TABLE.strip() + ",trial_kept\n"]
    for k, (a, b, kept) in enumerate(runs):
        v = x0 + alpha @ np.array([a, b])
        put = a if k == 1 else a - 5 if k > 1 and a != 5 else b
        plane = "" if k == 0 else "A" if k == 1 or a != 5 else "B"
        on = f"{abs(put):.17g},{np.degrees(np.angle(put)):.17g}" if k else ","
        lines.append(f"{k},1,{abs(v):.17g},{np.degrees(np.angle(v)):.17g},{plane},{on},{kept}\n")
    text = "".join(lines)
    rotor, _ = found(dalembert("field", "-", "--json", "--exclude", "1", "--ridge", "0.1", stdin=text))
    assert rotor["fit"]["residual_sd"] < 1e-12
    for one, a in zip(rotor["influence"], alpha, strict=True):
        assert polar(one["magnitude_per_kg"], one["phase_deg"]) / 1000 == pytest.approx(a, rel=1e-11)


def test_a_large_log_is_read_as_a_small_one_line_breaks_in_cells_too(
    dalembert: Dalembert, tmp_path: Path
) -> None:
    """A blank cell may be quoted and hold a line break."""
    head = "rotor,run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"
    runs = ('1,1,10,20,,"\n",', '2,1,14,50,A,"5\n",30', "3,1,9,80,A,7,100")
    for name, count in (("small.csv", 1), ("large.csv", 4000)):
        rows = "".join(f"m{i},{run}\n" for i in range(count) for run in runs)
        (tmp_path / name).write_text(head + rows)
    small, large = (dalembert("field", name, "--fit") for name in ("small.csv", "large.csv"))
    assert small.returncode == large.returncode == 0, large.stderr
    assert large.stdout.splitlines()[:2] == small.stdout.splitlines()
