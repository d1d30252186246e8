"""Balancing logs as people keep them: read in every layout, all runs fitted at once, doubt said aloud."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.conftest import Dalembert


def polar(size: float, degrees: float) -> complex:
    return size * complex(np.exp(1j * np.radians(degrees)))


# the invented machine: two states of one sensor
STATES = {"100%n": (polar(80, 40), polar(2, 150)), "100%U": (polar(60, 55), polar(2.5, 140))}
BEST = -sum(v * a.conjugate() for v, a in STATES.values()) / sum(abs(a) ** 2 for _, a in STATES.values())


def number(value: float) -> str:
    return f"{value:.17g}".replace(".", ",")


def vector(value: complex) -> str:
    return f"{number(abs(value))};{number(float(np.degrees(np.angle(value))))}"


def log(
    masses: Sequence[tuple[float, float]], *, lagging: bool = False, skip: Sequence[tuple[int, str]] = ()
) -> str:
    """Write layout 1: one row a reading, masses as they are on the rotor."""
    lines = [" ;DoubleA;phase;mass;phase"]
    for k, (size, angle) in enumerate(masses):
        for state, (v0, alpha) in STATES.items():
            v = v0 + alpha * polar(size, angle)
            if (k + 1, state) not in skip:
                read = vector(v.conjugate() if lagging else v)
                lines.append(f"{state};{read};{number(size)};{number(angle)}")
    return "\n".join(lines) + "\n"


THREE = [(0, 0), (10, -90), (30, -60)]


def found(done: subprocess.CompletedProcess[str]) -> tuple[Any, list[str]]:
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    return document["rotors"][0], document["warnings"]


def correction(rotor: Any, plane: int = 0) -> complex:
    one = rotor["corrections"][plane]
    return polar(one["mass_kg"], one["angle_deg"])


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
    assert any("every row takes part" in warning for warning in warnings)
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
    ],
)
def test_layout_3_vectors(text: str, dalembert: Dalembert) -> None:
    rotor, _ = found(dalembert("field", "-", "--json", stdin=text))
    assert abs(correction(rotor) - BEST) < 1e-5
    assert [one["sensor"] for one in rotor["residual"]] == ["1", "2"]
    assert rotor["fit"]["degrees_of_freedom"] == 0
    assert rotor["fit"]["residual_sd"] is None


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


TABLE = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"


def standard(masses: Sequence[complex], error: Sequence[complex], sensors: int = 2) -> str:
    """Write a table of runs, in g and µm."""
    lines = [TABLE]
    for k, (w, e) in enumerate(zip(masses, error, strict=True)):
        for s in range(sensors):
            v = polar(80 + s, 40) + polar(2, 150 - 20 * s) * w + e * (1 + s)
            on = f"A,{abs(w):.17g},{np.degrees(np.angle(w)):.17g}" if w else ",,"
            lines.append(f"{k},{s},{abs(v):.17g},{np.degrees(np.angle(v)):.17g},{on}\n")
    return "".join(lines)


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


MASSES = [0, 10j, 12, -9 - 9j, 8 - 8j, 0]
ERRORS = [0.2, -0.1j, 0.15j, -0.2, 0.1 + 0.1j, -0.05]


def test_more_runs_than_unknowns_are_fitted_as_generalised_least_squares(dalembert: Dalembert) -> None:
    rotor, _ = found(dalembert("field", "-", "--json", stdin=standard(MASSES, ERRORS)))
    w = np.array(MASSES, dtype=complex)
    rows = np.stack([np.ones(6), w], axis=1)
    x0, alpha, squares = [], [], 0.0
    for s in range(2):
        y = polar(80 + s, 40) + polar(2, 150 - 20 * s) * w + np.array(ERRORS) * (1 + s)
        real = np.block([[rows.real, -rows.imag], [rows.imag, rows.real]])
        theta, (left,), _, _ = np.linalg.lstsq(real, np.concatenate([y.real, y.imag]), rcond=None)
        x0.append(theta[0] + 1j * theta[2])
        alpha.append(theta[1] + 1j * theta[3])
        squares += float(left)
    best = -np.vdot(alpha, x0) / np.vdot(alpha, alpha).real
    assert correction(rotor) * 1000 == pytest.approx(best, rel=1e-10)
    assert rotor["fit"]["degrees_of_freedom"] == 12 - 4
    assert rotor["fit"]["residual_sd"] == pytest.approx(np.sqrt(squares / 8), rel=1e-10)


def test_the_predicted_run_is_the_fitted_value_with_its_scatter(dalembert: Dalembert) -> None:
    text = standard(MASSES, ERRORS, sensors=1)
    rotor, _ = found(dalembert("field", "-", "--json", "--predict", "7g@25", stdin=text))
    w = np.array(MASSES, dtype=complex)
    rows, new = np.stack([np.ones(6), w], axis=1), np.array([1, polar(7, 25)])
    y = polar(80, 40) + polar(2, 150) * w + np.array(ERRORS)
    theta = np.linalg.lstsq(rows, y, rcond=None)[0]
    variance = float(np.sum(np.abs(y - rows @ theta) ** 2)) / 4 / 2
    leverage = float((new @ np.linalg.inv(rows.conj().T @ rows) @ new.conj()).real)
    (one,) = rotor["predict"]
    assert polar(one["amplitude"], one["phase_deg"]) == pytest.approx(new @ theta, rel=1e-10)
    assert one["amplitude_uncertainty"] == pytest.approx(np.sqrt(variance * (1 + leverage)), rel=1e-9)
    named, _ = found(dalembert("field", "-", "--json", "--predict", "A=7g@25deg", stdin=text))
    assert named["predict"] == rotor["predict"]


def test_the_suggested_run_keeps_the_limit_and_tells_more(dalembert: Dalembert) -> None:
    options = ("--suggest", "--max-mass", "60g")
    text = standard(MASSES, ERRORS, sensors=1)
    rotor, _ = found(dalembert("field", "-", "--json", *options, stdin=text))
    suggested = rotor["suggest"]
    (mass,) = suggested["masses"]
    assert 0 < mass["mass_kg"] <= 0.06 * (1 + 1e-12)
    assert suggested["uncertainty_after_kg"] < suggested["uncertainty_before_kg"]
    free, _ = found(dalembert("field", "-", "--json", stdin=text))
    before = free["corrections"][0]["mass_uncertainty_kg"]
    assert suggested["uncertainty_before_kg"] == pytest.approx(before, rel=1e-9)
    assert dalembert("field", "-", "--suggest", stdin=text).returncode == 2


def test_excluded_runs_and_a_robust_fit(dalembert: Dalembert) -> None:
    masses, errors = [*MASSES, 11j, 3 + 3j, -7], [*ERRORS, 0.1, -0.1, 0.05j]
    good = standard(masses, errors, sensors=1)
    errors[3] += 25
    bad = standard(masses, errors, sensors=1)
    rotor, warnings = found(dalembert("field", "-", "--json", "--robust", stdin=bad))
    assert any("run 3" in warning and "outlier" in warning for warning in warnings)
    (marked,) = [one for one in rotor["fit"]["residuals"] if one["outlier"]]
    assert marked["run"] == "3"
    without, _ = found(dalembert("field", "-", "--json", "--exclude", "3", stdin=bad))
    same, _ = found(dalembert("field", "-", "--json", "--exclude", "3", stdin=good))
    assert without["corrections"] == same["corrections"]
    assert without["fit"]["runs"] == 8
    (robust,) = rotor["robust"]["corrections"]
    truth = correction(same)
    assert abs(polar(robust["mass_kg"], robust["angle_deg"]) - truth) < 0.2 * abs(correction(rotor) - truth)
    assert dalembert("field", "-", "--exclude", "33", stdin=bad).returncode == 2


def test_the_sense_of_the_phase(dalembert: Dalembert) -> None:
    off_line = [*THREE, (20, 45)]
    rotor, warnings = found(dalembert("field", "-", "--json", stdin=log(off_line, lagging=True)))
    assert rotor["fit"]["phase_sense"] == "lag"
    assert abs(correction(rotor) - BEST) < 1e-11
    assert any("phase lags" in warning and "turned round" in warning for warning in warnings)
    told, warnings = found(
        dalembert("field", "-", "--json", "--phase-lag", stdin=log(off_line, lagging=True))
    )
    assert told["fit"]["phase_sense"] == "lag"
    assert not any("phase" in warning for warning in warnings)
    assert abs(correction(told) - BEST) < 1e-11
    against, warnings = found(dalembert("field", "-", "--json", "--phase-lag", stdin=log(off_line)))
    assert against["fit"]["phase_sense"] == "lead"
    assert any("phase leads" in warning and "was obeyed" in warning for warning in warnings)
    line, _ = found(dalembert("field", "-", "--json", stdin=log([(0, 0), (10, 20), (30, 20), (15, 200)])))
    assert line["fit"]["phase_sense"] is None


def test_repeats_that_contradict_each_other_are_named(dalembert: Dalembert) -> None:
    masses = [0, 10j, 12, 12.1, -9 - 9j, 8 - 8j, 0]
    errors = [0.2, -0.1j, 0.15j, 60, 0.1 + 0.1j, -0.05, 0]
    done = dalembert("field", "-", "--json", stdin=standard(masses, errors, sensors=1))
    _, warnings = found(done)
    (said,) = [warning for warning in warnings if "contradict" in warning]
    assert "runs 2 and 3" in said


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
        (log(THREE).replace("30;-60", "30;x", 1), ["found 'x'", "angle of the mass"]),
        (log(THREE).replace("30;-60", "-30;-60", 1), ["found '-30'", "a mass that is not negative"]),
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


def test_limits_minimax_and_a_residual_limit_go_with_a_fit(dalembert: Dalembert) -> None:
    text = log([*THREE, (20, 45)]).replace("100%n;80;", "100%n;80,5;")
    for options in (
        ["--objective", "minimax"],
        ["--max-mass", "10kg"],
        ["--max-residual", "30um", "--max-mass", "99kg"],
    ):
        rotor, _ = found(dalembert("field", "-", "--json", *options, stdin=text))
        assert rotor["corrections"][0]["mass_uncertainty_kg"] > 0
    within = [one["probability_within"] for one in rotor["residual"]]
    assert all(0.5 < p <= 1 for p in within)


def test_text_and_report_tell_the_history(dalembert: Dalembert, tmp_path: Any) -> None:
    text = standard(MASSES, ERRORS)
    options = ["--predict", "5g@10", "--robust", "--suggest", "--max-mass", "90g"]
    done = dalembert("field", "-", "--text", *options, "--report", "r.html", stdin=text)
    assert done.returncode == 0, done.stderr
    for words in (
        "6 runs, 12 readings fitted together",
        "a run with 5 g at 10.00° in A should read",
        "A-optimal",
        "robust fit (Huber)",
    ):
        assert words in done.stdout
    page = (tmp_path / "r.html").read_text()
    drawn = dalembert("field", "-", "--plot", "p.svg", *options, stdin=text)
    assert drawn.returncode == 0, drawn.stderr
    picture = (tmp_path / "p.svg").read_text()
    # a dot for each reading, one for what was fitted to it, one among the residuals
    assert picture.count("<use ") >= 3 * 12
    for words in (
        "sensor 0, µm",
        "sensor 1, µm",
        "corrections to ADD, g",
        "95 % region of each correction, enlarged",
        "standardised residuals",
        "predicted run, 95 % region of a reading",
        "masses of the next run",
        # runs that lie near one another
        "0, 5",
    ):
        assert f"<!-- {words} -->" in picture
        assert f"<!-- {words} -->" in page
    assert "12 readings fitted together" in page
    assert "standardised" in page


def test_many_machines_with_runs_of_their_own(dalembert: Dalembert) -> None:
    rng = np.random.default_rng(3)
    lines, truth = [f"rotor,{TABLE}"], {}
    for m in range(60):
        v0, alpha = 10 * rng.normal() + 9j, 2 + rng.normal() * 1j
        truth[f"m{m}"] = -v0 / alpha
        for k in range(3 + m % 4):
            w = 0 if k == 0 else polar(rng.uniform(1, 4), rng.uniform(0, 360))
            v = v0 + alpha * w
            on = f"A,{abs(w):.17g},{np.degrees(np.angle(w)):.17g}" if w else ",,"
            lines.append(f"m{m},{k},1,{abs(v):.17g},{np.degrees(np.angle(v)):.17g},{on}\n")
    done = dalembert("field", "-", "--json", stdin="".join(lines))
    assert done.returncode == 0, done.stderr
    for rotor in json.loads(done.stdout)["rotors"]:
        assert correction(rotor) * 1000 == pytest.approx(truth[rotor["rotor"]], rel=1e-11)


def test_machines_with_runs_planes_and_repeats_of_their_own_are_each_least_squares(tmp_path: Any) -> None:
    from cli.field.log import read_log

    rng = np.random.default_rng(11)
    known, lines = {}, []
    for m in range(12):
        planes = [f"P{m % 2}", "Q"][: 1 + m % 3 // 2]
        on = [np.zeros(len(planes), complex)]
        on += [
            rng.uniform(2, 9, len(planes)) * np.exp(1j * rng.uniform(0, 6, len(planes)))
            for _ in range(3 + m % 4)
        ]
        rows, read = [], []
        for j, masses in enumerate(on):
            # some runs were read twice in one state, some not at all in the other
            for state in ["hot"] * (1 + (j + m) % 2) + ["cold"] * ((j + 2 * m) % 7 != 3):
                v = complex(*rng.normal(0, 30, 2))
                cells = (
                    ";".join(planes),
                    *(
                        ";".join(f"{f(w):.17g}" for w in masses)
                        for f in (abs, lambda w: np.degrees(np.angle(w)))
                    ),
                )
                put = ",".join(cells) if j else ",,"
                lines.append(f"m{m},m{m}-{j},{state},{abs(v):.17g},{np.degrees(np.angle(v)):.17g},{put}\n")
                rows.append((state, [1, *masses]))
                read.append(v)
        known[f"m{m}"] = rows, np.array(read), set(planes)
    order = rng.permutation(len(lines))
    # runs of a machine stay in their order, machines are mixed
    mixed = sorted(order.tolist(), key=lambda i: (lines[i].split("-")[1].split(",")[0].zfill(2), i))
    path = tmp_path / "log.csv"
    path.write_text(
        "rotor,run,state,amplitude_um,phase_deg,trial_plane,trial_mass_kg,trial_angle_deg\n"
        + "".join(lines[i] for i in mixed)
    )
    runs = read_log(str(path), lagging=False)
    seen = 0
    for group in runs.groups:
        assert group.fit is not None
        for i, r in enumerate(group.rotors.tolist()):
            rows, all_read, planes_of = known[runs.rotors[r]]
            assert set(group.planes) == planes_of
            for s, channel in enumerate(group.channels):
                mine = [k for k, (state, _) in enumerate(rows) if state == channel.state]
                design = np.array([rows[k][1] for k in mine])
                theirs = np.linalg.lstsq(design, all_read[mine], rcond=None)[0]
                assert np.abs(group.fit.unknowns[i, s] - theirs).max() < 1e-10 * np.abs(theirs).max()
                assert len(mine) == group.fit.present[i, :, s].sum()
                seen += 1
    assert seen == 24


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
