"""Estimates of the error of a motion in time: never below it, and no more than some ten times it, after a thousand periods too."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

from tests.virtualwork.released import G, block, pendulum
from virtualwork import Mechanism, Spring
from virtualwork.intime.run import Run

# the block of the spring across its guide, by a Taylor series of 25 digits (mpmath's odefun)
ACROSS = (
    "0",
    "-0.6297510834476919569144",
    "-0.08611421672069867507213",
    "-0.5175109941469816586895",
    "-0.218035950620519367839",
    "-0.3730150173120140141717",
    "-0.3683953872748369611977",
)


def off(run: Run, exact: list[mp.mpf]) -> np.ndarray:
    """The errors of the one input."""
    return np.array([float(abs(mpf(q) - x)) for q, x in zip(run.angle[:, 0].tolist(), exact, strict=True)])


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("periods", [1, 30, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("accuracy", [1e-8, 1e-6])
def test_a_pendulum_of_many_periods(accuracy: float, periods: int, side: int) -> None:
    """From the side, sin(φ/2) = k cd(ωt): what has rounded grows with the time, and a pendulum pulls it back."""
    start = 0.0 if side > 0 else -math.pi
    with mp.workdps(30):
        k, omega = mp.sin((mpf(start) + mp.pi / 2) / 2), mp.sqrt(mpf(G))
        period = 4 * mp.ellipk(k * k) / omega
        t = np.linspace(0.0, float(period * (periods + mpf("0.3"))), 5)
        run = pendulum().simulate(t, angle=start, accuracy=accuracy)
        exact = [
            2 * mp.asin(k * mp.ellipfun("cd", omega * x, m=k * k)) - mp.pi / 2 for x in map(mpf, t.tolist())
        ]
        error = off(run, exact)
    assert not run.warnings
    assert (error[1:] <= run.error_estimate[1:, 0]).all()
    assert run.error_estimate.max() < accuracy
    assert run.error_estimate[-1, 0] < 50 * error[1:].max()


@pytest.mark.parametrize("beside", [1e-9, -1e-9, 1e-7])
def test_beyond_the_last_digit_the_estimate_is_infinite(beside: float) -> None:
    """From its upper rest a pendulum turns back there: after the second time two solutions may be whole turns off."""
    start = math.pi / 2 - beside
    t = np.linspace(0.0, 40.0, 81)
    run = pendulum().simulate(t, angle=start)
    with mp.workdps(40):
        k, omega = mp.sin((mpf(start) + mp.pi / 2) / 2), mp.sqrt(mpf(G))
        swings = [2 * mp.asin(k * mp.ellipfun("cd", omega * x, m=k * k)) for x in map(mpf, t.tolist())]
        exact = [(x if beside > 0 else 2 * mp.pi - x) - mp.pi / 2 for x in swings]
        error = off(run, exact)
    estimate = run.error_estimate[:, 0]
    assert (error <= estimate).all()
    lost = np.isinf(estimate)
    assert lost[-1]
    assert not lost[t < 15].any()
    assert (np.diff(lost.astype(int)) >= 0).all()
    assert f"no digit holds from {t[np.argmax(lost)]:g} s on" in run.warnings[0]


def wheel(folder: Path, torques: tuple[str, ...]) -> Mechanism:
    path = folder / "wheel.toml"
    loads = "".join(f'[[torques]]\nlink = "wheel"\ntorque = {torque}\n' for torque in torques)
    path.write_text(
        "[ground]\nO = [0, 0]\n[links.wheel]\npoints = { O = [0, 0] }\ninertia = 0.3\n"
        '[input]\nlink = "wheel"\nangle = 0\nspeed = 0\n' + loads
    )
    return Mechanism.from_toml(path)


@pytest.mark.parametrize(
    "torques",
    [("0.1",), ("100.1", "-100"), ("-100.1", "100"), ("1000.1", "-1000.0001"), ("3.1", "-1.7", "-1.3999999")],
)
def test_torques_that_nearly_cancel(tmp_path: Path, torques: tuple[str, ...]) -> None:
    """What is left of 100.1 − 100 has three digits fewer than either, if the decimals of the file are exact."""
    run = wheel(tmp_path, torques).simulate([0.0, 1.0, 3.0])
    with mp.workdps(30):
        left = sum(map(mpf, torques), mpf(0)) / mpf("0.3")
        error = off(run, [left * t * t / 2 for t in (0, 1, 9 / mpf(3))])
    assert (error <= run.error_estimate[:, 0]).all()
    assert run.error_estimate.max() < 200 * np.finfo(float).eps * 9 / 0.6 * max(
        abs(float(x)) for x in torques
    )


@pytest.mark.parametrize("torques", [(), ("0",), ("100.1", "-100.1")])
def test_no_torque_is_left(tmp_path: Path, torques: tuple[str, ...]) -> None:
    run = wheel(tmp_path, torques).simulate([0.0, 3.0])
    assert (run.angle == 0).all()
    assert run.error_estimate.max() < 1e-11


@pytest.mark.parametrize("side", [1, -1])
def test_variants_of_torques_that_nearly_cancel(tmp_path: Path, side: int) -> None:
    """The lanes of a family have the same estimates."""
    m = wheel(tmp_path, (f"{100.1 * side}", f"{-100 * side}"))
    runs = m.vary({"links.wheel.inertia": [0.3, 0.6]}).simulate([0.0, 3.0])
    with mp.workdps(30):
        left = (mpf("100.1") - 100) * side
        exact = [left / mpf(x) * 9 / 2 for x in ("0.3", "0.6")]
        error = np.array(
            [float(abs(mpf(q) - x)) for q, x in zip(runs.angle[:, 1, 0].tolist(), exact, strict=True)]
        )
    assert (error <= runs.error_estimate[:, 1, 0]).all()


@pytest.mark.parametrize("side", [1, -1])
def test_steps_whose_errors_cancel_in_the_first_solution(side: int) -> None:
    """A spring across a guide: the errors of its steps nearly cancel, and those of their halves do not."""
    anchor = complex(-0.33277013180612913 * side, 0.1341793893996964)
    spring = Spring((("block", 0j), ("ground", anchor)), 518.7304705270017, 0.06575266386222572)
    m = block(gravity=-1j * G, springs=[spring])
    t = np.linspace(0.0, 2.852466978766111, 7)
    run = m.simulate(t, speed=-2.5448888415098203 * side, accuracy=1.0516801728859907e-10)
    with mp.workdps(25):
        error = off(run, [side * mpf(x) for x in ACROSS])
    assert (error <= run.error_estimate[:, 0]).all()


@pytest.mark.parametrize("side", [1, -1])
def test_a_stiff_spring_holds_what_has_rounded(side: int) -> None:
    """Long after it has come to rest against a force its place is known to rounding: nothing grows with the time."""
    spring = Spring((("block", 0j), ("ground", -1.0 + 0j)), 9166.0, 1.0 + 4e-4 * side, 500.0)
    run = block(springs=[spring]).simulate(np.linspace(0.0, 40.0, 5), angle=0.3 * side, accuracy=1e-10)
    assert not run.warnings
    assert np.abs(run.angle[1:, 0] - 4e-4 * side).max() <= run.error_estimate.max() < 1e-10
