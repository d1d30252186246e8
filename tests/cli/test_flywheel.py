"""`dalembert flywheel`: closed forms, a textbook's table, whole turns only."""

from __future__ import annotations

import csv
import io
from fractions import Fraction

import numpy as np
import pytest

from balancing import torque_cycle
from tests.cli.printed import document
from tests.conftest import Dalembert

OPTIONS = ("--speed", "10rad_s", "--fluctuation", "0.02")


def table(angles, torques, header: str = "angle_deg,torque_N_m") -> str:
    return f"{header}\n" + "".join(f"{a:.17g},{t:.17g}\n" for a, t in zip(angles, torques, strict=True))


def test_a_sine_in_closed_form(dalembert: Dalembert) -> None:
    # T = 5 + 3 sin θ stores 2·3 J between 0 and 180 deg; straight lines of step h store (h/2)/tan(h/2) of it
    angles = np.arange(0, 361, 10)
    sine = table(angles, 5 + 3 * np.sin(np.radians(angles)))
    found = document(dalembert("flywheel", "-", *OPTIONS, "--json", stdin=sine))
    half = np.radians(5)
    fluctuation = 6 * half / np.tan(half)
    assert found["mean_torque_N_m"] == pytest.approx(5, rel=1e-14)
    assert found["work_J"] == pytest.approx(10 * np.pi, rel=1e-14)
    assert found["energy_fluctuation_J"] == pytest.approx(fluctuation, rel=1e-13)
    assert found["flywheel_inertia_kg_m2"] == pytest.approx(fluctuation / (0.02 * 100), rel=1e-13)
    assert found["slowest_angle_deg"] % 360 == pytest.approx(0, abs=1e-9)
    assert found["fastest_angle_deg"] == pytest.approx(180, rel=1e-12)


def test_extremes_between_rows_do_not_depend_on_the_rows() -> None:
    # a triangle: from -1 at 0 to 3 at 90 deg, back to -1 at 360; mean 1, crossed at 45 and 225 deg
    coarse = torque_cycle(np.radians([0, 90, 360]), [-1, 3, -1])
    fine = torque_cycle(
        np.radians([0, 10, 90, 100, 300, 360]), [-1, -1 + 40 / 90, 3, 3 - 40 / 270, -1 + 240 / 270, -1]
    )
    for cycle in (coarse, fine):
        assert cycle.mean == pytest.approx(1, rel=1e-14)
        # the triangle above the mean: half of 180 deg times 2
        assert cycle.fluctuation == pytest.approx(np.pi, rel=1e-14)
        assert np.degrees([cycle.slowest, cycle.fastest]) == pytest.approx([45, 225], rel=1e-13)


def test_steps_and_both_ends_of_a_cycle() -> None:
    # 4 N·m over the first quarter, 0 after it: E rises by 3·π/2
    pulse = torque_cycle(np.radians([0, 90, 90, 360]), [4, 4, 0, 0])
    assert (pulse.mean, pulse.fluctuation) == pytest.approx((1, 1.5 * np.pi), rel=1e-14)
    mirrored = torque_cycle(np.radians([0, 270, 270, 360]), [0, 0, -4, -4])
    assert (mirrored.mean, mirrored.fluctuation) == pytest.approx((-1, 1.5 * np.pi), rel=1e-14)


@pytest.mark.slow
def test_random_tables_against_fractions(first_seed: int) -> None:
    rng = np.random.default_rng(first_seed)
    for _ in range(300):
        n = int(rng.integers(2, 9))
        at = [Fraction(0), *sorted(Fraction(int(k), 64) for k in rng.integers(0, 400, n)), Fraction(7)]
        torque = [Fraction(int(k), 8) for k in rng.integers(-40, 40, n + 2)]
        spans = list(zip(at, at[1:], torque, torque[1:], strict=False))
        work = sum((b - a) * (s + t) / 2 for a, b, s, t in spans)
        mean = work / at[-1]
        energy, levels = Fraction(0), [Fraction(0)]
        for a, b, s, t in spans:
            if (s - mean) * (t - mean) < 0:
                share = (s - mean) / (s - t)
                levels.append(energy + (s - mean) * share * (b - a) / 2)
            energy += (b - a) * (s + t - 2 * mean) / 2
            levels.append(energy)
        found = torque_cycle([float(x) for x in at], [float(x) for x in torque])
        off = found.error_estimate()
        assert abs(Fraction(found.work) - work) <= off["work"]
        assert abs(Fraction(found.fluctuation) - (max(levels) - min(levels))) <= off["fluctuation"]


def test_the_table_of_shigley(dalembert: Dalembert) -> None:
    dalembert("examples", "flywheel-engine")
    call = ("flywheel", "torque.csv", "--speed", "250rad_s", "--fluctuation", "0.1")
    (row,) = csv.DictReader(io.StringIO(dalembert(*call).stdout))
    assert float(row["mean_torque_lbf_in"]) == pytest.approx(268, abs=0.5)
    found = document(dalembert(*call, "--json"))
    pound_inch = 0.45359237 * 9.80665 * 0.0254
    # the book: the loop from 0 to 180 deg as a whole; the range of the energy is larger
    at_180 = next(each["energy_J"] for each in found["cycle"] if each["angle_deg"] == 180)
    assert at_180 / pound_inch == pytest.approx(3531, abs=1)
    assert found["energy_fluctuation_J"] > at_180
    assert found["turns"] == 2


def test_units_percent_and_radians_as_they_are_written(dalembert: Dalembert) -> None:
    degrees = document(dalembert("flywheel", "-", *OPTIONS, "--json", stdin=table([0, 90, 360], [-1, 3, -1])))
    call = ("flywheel", "-", "--speed", "10rad_s", "--fluctuation", "2%", "--json")
    radians = "angle_rad,torque_N_mm\n0,-1000\n1.57,3000\n6.28,-1000\n"
    rounded = document(dalembert(*call, stdin=radians))
    for name in ("mean_torque_N_m", "energy_fluctuation_J", "flywheel_inertia_kg_m2"):
        assert rounded[name] == pytest.approx(degrees[name], rel=1e-12)


def test_a_constant_torque_needs_no_flywheel(dalembert: Dalembert) -> None:
    done = dalembert("flywheel", "-", *OPTIONS, "--json", stdin=table([0, 360], [3, 3]))
    assert document(done)["flywheel_inertia_kg_m2"] == 0
    assert "nothing for a flywheel to store" in done.stderr


def test_an_open_end_is_named(dalembert: Dalembert) -> None:
    done = dalembert("flywheel", "-", *OPTIONS, stdin=table([0, 360], [3, 1]))
    assert "a step between one cycle and the next" in done.stderr


BAD = {
    "a part of a turn": (table([0, 50, 100], [1, 2, 1]), "found 0 to 100 deg, not whole turns of the shaft; expected a last row at 360 deg"),
    "the last row missing": (
        table(range(0, 360, 5), [1] * 72),
        "found 0 to 355 deg, not whole turns of the shaft; expected a last row at 360 deg: the last row is missing",
    ),
    "more than a turn": (table([0, 500], [1, 2]), "expected a last row at 360 deg or 720 deg"),
    "radians": ("angle_rad,torque_N_m\n0,1\n6.2,1\n", "expected a last row at 6.28319 rad"),
    "one row": (table([0], [1]), "found 0 to 0 deg"),
    "falling": (table([0, 180, 90, 360], [1, 2, 3, 1]), "row 3 (line 4), column angle_deg: found '90'"),
    "no torque": ("angle_deg\n0\n360\n", "no column torque_N_m"),
    "no angle": ("torque_N_m\n0\n360\n", "no column angle_deg"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_tables(case: str, dalembert: Dalembert) -> None:
    text, message = BAD[case]
    done = dalembert("flywheel", "-", *OPTIONS, stdin=text)
    assert done.returncode == 1
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--fluctuation", "0.02"), "expected --speed and --fluctuation"),
        (("--speed", "10rad_s"), "expected --speed and --fluctuation"),
        (("--speed", "0rpm", "--fluctuation", "0.02"), "positive"),
        (("--speed", "10rad_s", "--fluctuation", "0"), "above 0 and at most 2"),
        (("--speed", "10rad_s", "--fluctuation", "two"), "above 0 and at most 2"),
        (("--speed", "10rad_s", "--fluctuation", "300%"), "above 0 and at most 2"),
    ],
)
def test_bad_options(options: tuple[str, ...], message: str, dalembert: Dalembert) -> None:
    done = dalembert("flywheel", "-", *options, stdin=table([0, 360], [1, 2]))
    assert done.returncode == 2
    assert message in " ".join(done.stderr.split())


def test_a_percentage_without_its_sign_is_doubted(dalembert: Dalembert) -> None:
    """`--fluctuation 2` for 2 % gave a flywheel of a hundredth without a word."""
    table = "angle_deg,torque_N_m\n0,0\n180,10\n360,0\n"
    for coefficient, doubt in (("2", True), ("0.6", True), ("2%", False), ("0.02", False)):
        done = dalembert("flywheel", "-", "--speed", "600rpm", "--fluctuation", coefficient, stdin=table)
        assert ("2 % is written 2% or 0.02" in done.stderr) == doubt
