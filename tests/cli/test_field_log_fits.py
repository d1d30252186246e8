"""`dalembert field LOG`: more runs than unknowns, fitted together: what is predicted, suggested, left out, told."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest

from tests.cli.logs import BEST, ERRORS, MASSES, TABLE, THREE, correction, found, log, polar, standard
from tests.conftest import Dalembert


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
    assert any("phase lags" in warning and "were reversed" in warning for warning in warnings)
    told, warnings = found(
        dalembert("field", "-", "--json", "--phase-lag", stdin=log(off_line, lagging=True))
    )
    assert told["fit"]["phase_sense"] == "lag"
    assert not any("phase" in warning for warning in warnings)
    assert abs(correction(told) - BEST) < 1e-11
    against, warnings = found(dalembert("field", "-", "--json", "--phase-lag", stdin=log(off_line)))
    assert against["fit"]["phase_sense"] == "lead"
    assert any(
        "phase leads" in warning and "states otherwise and has priority" in warning for warning in warnings
    )
    line, _ = found(dalembert("field", "-", "--json", stdin=log([(0, 0), (10, 20), (30, 20), (15, 200)])))
    assert line["fit"]["phase_sense"] is None


def test_repeats_that_contradict_each_other_are_named(dalembert: Dalembert) -> None:
    masses = [0, 10j, 12, 12.1, -9 - 9j, 8 - 8j, 0]
    errors = [0.2, -0.1j, 0.15j, 60, 0.1 + 0.1j, -0.05, 0]
    done = dalembert("field", "-", "--json", stdin=standard(masses, errors, sensors=1))
    _, warnings = found(done)
    (said,) = [warning for warning in warnings if "contradict" in warning]
    assert "runs 2 and 3" in said


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


def test_readings_without_scatter_keep_a_limit_or_do_not(dalembert: Dalembert) -> None:
    """5 + 2 w at one sensor, 1 − 2 w at the other: w = −1 leaves 3 at both."""
    rows = [(run, w, 5 + 2 * w, 1 - 2 * w) for run, w in enumerate([0, 1, -1, 2])]
    lines = ["run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg"]
    for run, w, *read in rows:
        mass = f"A,{abs(w)},{180 * (w < 0)}" if w else ",,"
        lines += [f"{run},{s},{abs(x)},{180 * (x < 0)},{mass}" for s, x in enumerate(read)]
    text = "\n".join(lines) + "\n"
    for limit in ("3um", "3.1um", "1e9um"):
        rotor, _ = found(dalembert("field", "-", "--json", "--max-residual", limit, stdin=text))
        assert [one["probability_within"] for one in rotor["residual"]] == [1, 1]
    refused = dalembert("field", "-", "--max-residual", "2.9um", stdin=text)
    assert refused.returncode == 1
    assert "the smallest limit that can be met is 3 um" in refused.stderr


def test_text_and_report_tell_the_history(dalembert: Dalembert, tmp_path: Any) -> None:
    text = standard(MASSES, ERRORS)
    options = ["--predict", "5g@10", "--robust", "--suggest", "--max-mass", "90g"]
    done = dalembert("field", "-", "--text", *options, "--report", "r.html", stdin=text)
    assert done.returncode == 0, done.stderr
    for words in (
        "runs and readings fitted together",
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
    assert re.search(r">readings</th>.{0,400}?<td[^>]*>12<", page, re.DOTALL)
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

    from cli.field.fit import Request, measured_groups

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
    runs, _ = measured_groups(str(path), Request(rotation="ccw"))
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
