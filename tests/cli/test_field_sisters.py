"""Stored coefficients with their uncertainty: of the machine itself, of sister machines, and `ALPHA` of a file of vectors."""

from __future__ import annotations

import csv
import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from balancing import LogBalance, fit_with_prior, joint_fit, least_squares, pooled_prior, stored_prior
from tests.conftest import Dalembert

HEAD = "run,sensor,state,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"
STATES = ("cold", "hot")
ONS = np.array([[0, 0], [12, 0], [0, 9j], [-8, 4], [5j, -7]])


def polar(size: float, degrees: float) -> complex:
    return size * complex(np.exp(1j * np.radians(degrees)))


def written(z: complex) -> str:
    return f"{abs(z):.17g},{np.degrees(np.angle(z)):.17g}"


def machine(seed: int, runs: int = 5, differ: float = 0.05) -> tuple[str, Any, Any]:
    """Write a machine's runs, alike but for `differ`: one sensor in two states, two planes; with readings and coefficients."""
    alike, rng = np.random.default_rng(0), np.random.default_rng(seed)

    def circular(of: np.random.Generator, *shape: int) -> Any:
        return of.normal(size=shape) + 1j * of.normal(size=shape)

    alpha = circular(alike, 2, 2) * (1 + differ * circular(rng, 2, 2))
    on = ONS[:runs]
    readings = 30 * circular(rng, 2) + on @ alpha.T + 0.2 * circular(rng, runs, 2)
    lines = [HEAD]
    for k, masses in enumerate(on):
        planes = [name for name, mass in zip("AB", masses, strict=True) if mass]
        given = [written(mass).split(",") for mass in masses if mass]
        cells = ",".join(
            [";".join(planes), ";".join(one[0] for one in given), ";".join(one[1] for one in given)]
        )
        lines += [f"{k},1,{state},{written(readings[k, s])},{cells}\n" for s, state in enumerate(STATES)]
    return "".join(lines), readings, alpha


def document(done: subprocess.CompletedProcess[str]) -> tuple[Any, list[str]]:
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    return found["rotors"][0], found["warnings"]


def masses(rotor: Any) -> Any:
    return np.array([1000 * polar(one["mass_kg"], one["angle_deg"]) for one in rotor["corrections"]])


def test_coefficients_are_stored_with_what_is_known_of_them(dalembert: Dalembert, tmp_path: Path) -> None:
    text, readings, _ = machine(1)
    done = dalembert("field", "-", "--save-influence", "c.csv", stdin=text)
    assert done.returncode == 0, done.stderr
    rows = list(csv.DictReader((tmp_path / "c.csv").read_text().splitlines()))
    fit = joint_fit(readings, ONS)
    variance = float(fit.residual_sd) ** 2
    for s in range(2):
        rows_of = np.concatenate([np.ones((5, 1)), ONS], axis=1)
        c = variance * np.linalg.inv(rows_of.conj().T @ rows_of)[1:, 1:]
        for p in range(2):
            row = rows[2 * s + p]
            assert (row["state"], row["plane"]) == (STATES[s], "AB"[p])
            sd = np.sqrt(c[p, p].real / 2)
            size = float(row["magnitude_per_g"])
            assert float(row["magnitude_uncertainty_per_g"]) == pytest.approx(sd, rel=1e-10)
            assert float(row["phase_uncertainty_deg"]) == pytest.approx(np.degrees(sd / size), rel=1e-10)
            assert float(row["reading_sd_um"]) == pytest.approx(float(fit.residual_sd), rel=1e-10)
            assert float(row["degrees_of_freedom"]) == 4
        share = c[1, 0] / np.sqrt(c[0, 0].real * c[1, 1].real)
        size, turn = rows[2 * s + 1]["correlation"].split("@")
        assert polar(float(size), float(turn)) == pytest.approx(share, rel=1e-9)
    # one shot on the machine itself: what its own coefficients give, and how sure they are
    one, again, _ = machine(1, runs=1)
    rotor, warnings = document(dalembert("field", "-", "--json", "--influence", "c.csv", stdin=one))
    assert masses(rotor) == pytest.approx(least_squares(fit.influence, again[0]).corrections, rel=1e-9)
    gain = np.linalg.inv(rows_of.conj().T @ rows_of)[1:, 1:] * variance
    prior = stored_prior(fit.influence, np.stack([gain, gain]), 4)
    sd = float(fit.residual_sd)
    known = fit_with_prior(again[:1], ONS[:1], prior, sd)
    found = LogBalance(known, least_squares(known.influence, known.initial).corrections, known.known(sd, 4))
    told = [1000 * one["mass_uncertainty_kg"] for one in rotor["corrections"]]
    assert told == pytest.approx(found.deviations[0], rel=1e-9)
    assert any("do not show how machines differ" in warning for warning in warnings)
    assert rotor["fit"]["prior"] == {
        "machines": 1,
        "scatter_between_machines": None,
        "reading_sd": pytest.approx(sd, rel=1e-9),
    }


def test_sister_machines_are_pooled_and_their_scatter_is_told(dalembert: Dalembert, tmp_path: Path) -> None:
    options: list[str] = []
    alphas, covariances, squares = [], [], 0.0
    rows = np.concatenate([np.ones((5, 1)), ONS], axis=1)
    for seed in range(1, 6):
        text, readings, _ = machine(seed)
        assert dalembert("field", "-", "--save-influence", f"{seed}.csv", stdin=text).returncode == 0
        options += ["--influence", f"{seed}.csv"]
        fit = joint_fit(readings, ONS)
        alphas.append(fit.influence)
        squares += float(fit.sum_of_squares)
        c = np.linalg.inv(rows.conj().T @ rows)[1:, 1:] * float(fit.residual_sd) ** 2
        covariances.append(np.stack([c, c]))
    prior = pooled_prior(alphas, covariances)
    sd = np.sqrt(squares / 20)
    for runs in (1, 2, 5):
        text, readings, alpha = machine(9, runs=runs)
        rotor, _ = document(dalembert("field", "-", "--json", *options, "--predict", "A=5g@20", stdin=text))
        if runs < 5:
            fit = fit_with_prior(readings, ONS[:runs], prior, sd)
            errors = fit.known(sd, 20)
        else:
            fit = fit_with_prior(readings, ONS[:runs], prior)
            errors = fit.scatter()
        found = LogBalance(fit, least_squares(fit.influence, fit.initial).corrections, errors)
        assert masses(rotor) == pytest.approx(found.corrections, rel=1e-9)
        told = [1000 * one["mass_uncertainty_kg"] for one in rotor["corrections"]]
        assert told == pytest.approx(found.deviations[0], rel=1e-9)
        predicted = fit.fitted([[polar(5, 20), 0]])[0]
        assert [polar(o["amplitude"], o["phase_deg"]) for o in rotor["predict"]] == pytest.approx(
            predicted, rel=1e-9
        )
        assert rotor["fit"]["prior"]["machines"] == 5
        assert rotor["fit"]["prior"]["scatter_between_machines"] == pytest.approx(float(prior.scatter))
        best = least_squares(alpha, readings[0]).corrections
        assert np.abs(masses(rotor) - best).max() < 0.4 * np.abs(best).max()
    text = dalembert("field", "-", "--text", *options, stdin=text).stdout
    assert re.search(r"prior machines +5\n", text)
    # a file of several machines is as many sisters
    joined = [(tmp_path / f"{seed}.csv").read_text().splitlines() for seed in range(1, 6)]
    lines = [f"rotor,{joined[0][0]}"] + [f"m{k},{line}" for k, one in enumerate(joined) for line in one[1:]]
    (tmp_path / "all.csv").write_text("\n".join(lines) + "\n")
    one, _, _ = machine(9, runs=1)
    apart, _ = document(dalembert("field", "-", "--json", *options, stdin=one))
    together, _ = document(dalembert("field", "-", "--json", "--influence", "all.csv", stdin=one))
    assert together == apart
    # and of a machine that it names the coefficients are its own
    own, _ = document(
        dalembert(
            "field",
            "-",
            "--json",
            "--influence",
            "all.csv",
            stdin=f"rotor,{one.replace(chr(10), chr(10) + 'm2,')}"[:-3],
        )
    )
    assert own["influence"][0]["magnitude_per_kg"] == pytest.approx(1000 * abs(alphas[2][0, 0]), rel=1e-9)


def test_a_robust_fit_with_coefficients_known_before(dalembert: Dalembert, tmp_path: Path) -> None:
    for seed in range(3):
        text, _, _ = machine(seed)
        made = dalembert(
            "field", "-", "--fit", "--save-influence", str(tmp_path / f"s{seed}.csv"), stdin=text
        )
        assert made.returncode == 0, made.stderr
    sisters = [part for seed in range(3) for part in ("--influence", str(tmp_path / f"s{seed}.csv"))]
    good, _, _ = machine(9)
    head, *lines = good.splitlines()
    # repeated base runs, of which one is wrong
    again = [f"again{k},{lines[0].split(',', 1)[1]}" for k in range(4)]
    run, sensor, state, size, *rest = again[1].split(",")
    wrong = [*lines, again[0], ",".join([run, sensor, state, str(float(size) + 60), *rest]), *again[2:]]
    fine, _ = document(dalembert("field", "-", "--json", *sisters, stdin="\n".join([head, *lines, *again])))
    bad, _ = document(
        dalembert("field", "-", "--json", "--robust", *sisters, stdin="\n".join([head, *wrong]))
    )
    robust = np.array(
        [1000 * polar(one["mass_kg"], one["angle_deg"]) for one in bad["robust"]["corrections"]]
    )
    assert np.abs(robust - masses(fine)).max() < 0.2 * np.abs(masses(bad) - masses(fine)).max()
    stated = dalembert(
        "field",
        "-",
        "--json",
        "--robust",
        "--reading-error",
        "1%,1deg",
        *sisters,
        stdin="\n".join([head, *wrong]),
    )
    assert document(stated)[0]["robust"]["corrections"]
    # one run: nothing to weigh
    single = "\n".join([head, *lines[:2]])
    one, _ = document(dalembert("field", "-", "--json", "--robust", *sisters, stdin=single))
    assert one["robust"]["corrections"][0]["mass_kg"] == one["corrections"][0]["mass_kg"]


def test_stated_errors_of_trial_runs_are_stored_too(dalembert: Dalembert, tmp_path: Path) -> None:
    text = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n0,1,3.4,116,,,\n1,1,1.8,42,A,2,0\n"
    done = dalembert("field", "-", "--reading-error", "2%,2deg", "--save-influence", "c.csv", stdin=text)
    assert done.returncode == 0, done.stderr
    (row,) = csv.DictReader((tmp_path / "c.csv").read_text().splitlines())
    # α = (V₁ - V₀)/t, both readings with errors along and across
    v0, v1 = polar(3.4, 116), polar(1.8, 42)
    alpha = (v1 - v0) / 2
    parts = []
    for v in (v0, v1):
        for error in (0.02 * v / 2, 1j * np.radians(2) * v / 2):
            along = error * np.conj(alpha) / abs(alpha)
            parts.append([along.real, along.imag])
    sds = np.linalg.norm(parts, axis=0)
    assert float(row["magnitude_uncertainty_per_g"]) == pytest.approx(sds[0], rel=1e-9)
    assert float(row["phase_uncertainty_deg"]) == pytest.approx(np.degrees(sds[1] / abs(alpha)), rel=1e-9)
    assert row["degrees_of_freedom"] == ""
    plain = dalembert("field", "-", "--save-influence", "d.csv", stdin=text)
    assert plain.returncode == 0
    assert "uncertainty" not in (tmp_path / "d.csv").read_text()


STATED = "sensor,plane,magnitude_per_kg,phase_deg,magnitude_uncertainty_per_kg,phase_uncertainty_deg"


def test_a_state_of_an_exact_log_without_masses(dalembert: Dalembert, tmp_path: Path) -> None:
    """A log of base runs alone, without a column of masses, and coefficients from elsewhere."""
    (tmp_path / "c.csv").write_text(f"{STATED}\n1,1,2,150,0.2,\n")
    text = "state;amplitude_um;phase\nn;80;40\nn;82;41\nn;79;40\n"
    rotor, _ = document(dalembert("field", "-", "--json", "--influence", "c.csv", stdin=text))
    x0 = np.mean([polar(80, 40), polar(82, 41), polar(79, 40)])
    (one,) = rotor["corrections"]
    assert polar(one["mass_kg"], one["angle_deg"]) == pytest.approx(-x0 / polar(2, 150), rel=1e-12)
    # 0.2 of 2: 10 %, in each component, beside which the readings hardly count
    assert one["mass_uncertainty_kg"] == pytest.approx(0.1 * one["mass_kg"], rel=0.02)
    assert rotor["fit"]["degrees_of_freedom"] == 2


def test_alpha_of_a_file_of_vectors(dalembert: Dalembert, tmp_path: Path) -> None:
    text = "A: [80@40, 60@55]\nALPHA: [[2@150], [2.5@140]]\n"
    rotor, warnings = document(dalembert("field", "-", "--json", stdin=text))
    a = np.array([polar(2, 150), polar(2.5, 140)])
    best = -np.vdot(a, [polar(80, 40), polar(60, 55)]) / np.vdot(a, a).real
    (one,) = rotor["corrections"]
    assert polar(one["mass_kg"], one["angle_deg"]) == pytest.approx(best, rel=1e-12)
    assert any("state no uncertainty and count as exact" in warning for warning in warnings)
    (tmp_path / "alpha.yaml").write_text(text)
    (tmp_path / "r.csv").write_text("run,sensor,amplitude_um,phase_deg\n0,1,80,40\n0,2,60,55\n")
    for options in ((), ("--fit",)):
        other, _ = document(dalembert("field", "r.csv", "--json", "--influence", "alpha.yaml", *options))
        assert other["corrections"][0]["mass_kg"] == pytest.approx(abs(best), rel=1e-12)
    # where there are trial runs they tell
    both = text + "B: [[99.030381@43.960790], [84.932821@53.529955]]\nU: [10@-90]\n"
    rotor, warnings = document(dalembert("field", "-", "--json", stdin=both.replace("2@150", "9@9")))
    assert rotor["corrections"][0]["mass_kg"] == pytest.approx(abs(best), rel=1e-6)
    assert any(
        "ALPHA is not used: the trial runs determine the coefficients" in warning for warning in warnings
    )
    # slow roll is taken off
    slow = text + "A0: [5@10, 3@20]\n"
    rotor, _ = document(dalembert("field", "-", "--json", stdin=slow))
    still = -np.vdot(a, [polar(80, 40) - polar(5, 10), polar(60, 55) - polar(3, 20)]) / np.vdot(a, a).real
    (one,) = rotor["corrections"]
    assert polar(one["mass_kg"], one["angle_deg"]) == pytest.approx(still, rel=1e-12)


@pytest.mark.parametrize(
    ("stored", "text", "words"),
    [
        (f"{STATED}\n1,1,2,150,-0.2,\n", None, ["found '-0.2'", "an uncertainty that is not negative"]),
        (
            f"{STATED},correlation\n1,A,2,150,0.2,,\n1,B,2,150,0.2,,x\n",
            None,
            ["correlation", "found 'x'", "0.5@0"],
        ),
        (f"{STATED}\n2,A,2,150,0.2,\n", None, ["no coefficient of sensor 1 for plane A"]),
        (f"{STATED}\n1,A,2,150,0.2,\n1,A,3,150,0.2,\n", None, ["one coefficient for sensor 1 and plane A"]),
        (f"{STATED}\n1,B,2,150,0.2,\n", "trial", ["plane A", "has no stored coefficient", "expected B"]),
        (None, "A: [1@2]\nALPHA: [[1@2, 1@3], [4@5]]\n", ["rows of different lengths"]),
        (None, "ALPHA: [[1@2]]\n", ["no A", "it has influence coefficients alone"]),
        (None, "A: [1@2]\nALPHA: [[1-2]]\n", ["ALPHA", "found '1-2'", "amplitude@phase"]),
    ],
)
def test_what_cannot_be_used_is_said(
    stored: str | None, text: str | None, words: list[str], dalembert: Dalembert, tmp_path: Path
) -> None:
    table = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_kg,trial_angle_deg\n0,1,80,40,,,\n"
    if text == "trial":
        text = table + "1,1,70,40,A,1,0\n"
    options = []
    if stored is not None:
        (tmp_path / "c.csv").write_text(stored)
        options = ["--influence", "c.csv"]
    done = dalembert("field", "-", *options, stdin=text or table)
    assert done.returncode == 1, done.stdout
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    for word in words:
        assert word in done.stderr


# -- the sense of the phase of stored coefficients ---------------------------------------------------------------

HEADER = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"
LAGGING = "coefficients were measured with a phase that lags"


def lagging_runs(count: int) -> str:
    """The runs of 80 µm at 40° and 2 µm/g at 150°, on an instrument that counts the other way."""
    masses = (0, 10, 10j, -10)[:count]
    rows = []
    for run, on in enumerate(masses):
        v = np.conj(80 * np.exp(1j * np.radians(40)) + 2 * np.exp(1j * np.radians(150)) * on)
        trial = f"A,{abs(on)!r},{float(np.degrees(np.angle(on)))!r}" if on else ",,"
        rows.append(f"{run},1,{float(abs(v))!r},{float(np.degrees(np.angle(v)))!r},{trial}\n")
    return HEADER + "".join(rows)


@pytest.mark.parametrize(("count", "options"), [(2, ("--phase-lag",)), (2, ("--rotation", "cw")), (4, ())])
def test_coefficients_of_a_lagging_phase_are_not_used_silently(
    count: int, options: tuple[str, ...], dalembert: Dalembert
) -> None:
    done = dalembert("field", "-", *options, "--save-influence", "c.csv", stdin=lagging_runs(count))
    assert done.returncode == 0, done.stderr

    def later(*more: str) -> tuple[complex, str]:
        result = dalembert("field", "-", "--influence", "c.csv", *more, "--json", stdin=lagging_runs(1))
        (fix,) = json.loads(result.stdout)["rotors"][0]["corrections"]
        return fix["mass_kg"] * 1e3 * np.exp(1j * np.radians(fix["angle_deg"])), result.stderr + result.stdout

    # −V0/α, 40 g at 40 + 180 − 150 = 70°
    right, says = later("--phase-lag")
    assert right == pytest.approx(40 * np.exp(1j * np.radians(70)), rel=1e-9)
    assert LAGGING not in says
    wrong, says = later()
    assert abs(wrong - right) > 1
    assert "c.csv: the " + LAGGING in says
    assert "add --phase-lag" in says
    assert LAGGING not in later("--rotation", "ccw")[1]


def test_coefficients_of_a_leading_phase_or_of_an_earlier_version(
    dalembert: Dalembert, tmp_path: Path
) -> None:
    dalembert("field", "-", "--save-influence", "c.csv", stdin=lagging_runs(2))
    stored = (tmp_path / "c.csv").read_text().splitlines()
    assert "phase_sense" not in stored[0]
    (tmp_path / "said.csv").write_text(f"{stored[0]},phase_sense\n{stored[1]},lag\n")
    unstated = "the file does not say how the phase was counted"
    for file, options, warned in (
        ("c.csv", (), False),
        ("c.csv", ("--rotation", "ccw"), False),
        ("c.csv", ("--phase-lag",), True),
        ("c.csv", ("--rotation", "cw"), True),
        ("c.csv", ("--phase-lag", "--rotation", "cw"), False),
        ("said.csv", ("--phase-lag",), False),
    ):
        done = dalembert("field", "-", "--influence", file, *options, stdin=lagging_runs(1))
        assert done.returncode == 0
        assert LAGGING not in done.stderr
        assert (f"warning: {file}: the phases of the runs were reversed" in done.stderr) is warned
        assert (unstated in done.stderr) is warned


def test_coefficients_at_speeds_for_runs_without_one(dalembert: Dalembert, tmp_path: Path) -> None:
    stored = "sensor,speed_rpm,plane,magnitude_per_g,phase_deg\n1,1500,A,2,150\n1,3000,A,3,10\n"
    (tmp_path / "c.csv").write_text(stored)
    done = dalembert("field", "-", "--influence", "c.csv", stdin=lagging_runs(1))
    assert done.returncode == 1
    assert "expected one coefficient for sensor 1 and plane A, or runs with a speed" in done.stderr
