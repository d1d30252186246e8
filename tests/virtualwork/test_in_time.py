"""Motion under forces against closed forms: pendulum, oscillator, rotor, gears, friction, tables, benchmarks."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest

from benchmarks.truth import falling_four_bar
from tests.virtualwork.released import G, block, double_pendulum, four_bar, holds, pendulum, rotor
from virtualwork import (
    Force,
    Gear,
    Guess,
    Guide,
    Input,
    Link,
    Mechanism,
    MechanismError,
    Spring,
    Torque,
    TorsionSpring,
)


@pytest.mark.parametrize("accuracy", [1e-6, 1e-9, 1e-11])
def test_pendulum_against_elliptic_functions(accuracy: float) -> None:
    """From rest at the side: sin(φ/2) = k sn(K − √(g/l)·t), k = sin 45° (Whittaker, Analytical Dynamics, §44)."""
    t = np.linspace(0, 10, 201)
    run = pendulum().simulate(t, angle=0.0, accuracy=accuracy)
    with mp.workdps(25):
        m = mp.mpf(1) / 2
        exact = [
            2 * mp.asin(mp.sqrt(m) * mp.ellipfun("sn", mp.ellipk(m) - mp.sqrt(mp.mpf(G)) * float(x), m=m))
            - mp.pi / 2
            for x in t[::10]
        ]
        error = max(abs(mp.mpf(float(a)) - b) for a, b in zip(run.angle[::10, 0], exact, strict=True))
    holds(run, float(error), accuracy)
    assert np.abs(run.energy_drift).max() < 20 * accuracy


def test_pendulum_of_iftomm_a01_after_ten_seconds() -> None:
    """IFToMM benchmark A01: 1 m, 1 kg, 9.81 m/s², from rest at x = −1."""
    run = pendulum().simulate([0, 1, 2, 5, 10], angle=math.pi)
    x, y = run.motion.point("P").position.T
    assert np.allclose(
        x[1:],
        [0.98629175113187532, -0.79356619534332175, -0.94230543504375734, -0.27508746257611686],
        rtol=0,
        atol=1e-9,
    )
    assert np.allclose(y[1:3], [-0.16501085312554117, -0.60848393044379151], rtol=0, atol=1e-9)


@pytest.mark.parametrize("damping", [0.0, 0.3, 4.0, 50.0, 5e3, 1e6])
def test_damped_oscillator_from_swinging_to_stiff(damping: float) -> None:
    """ẍ + c ẋ + 4 x = 0 from x = 1/2: its two exponentials; a stiff damper takes the implicit method by itself."""
    m = block(springs=[Spring((("block", 0j), ("ground", -1 + 0j)), 4.0, 1.0, damping)])
    t = np.linspace(0, 10, 41)
    run = m.simulate(t, angle=0.5)
    large = (-damping - np.emath.sqrt(damping**2 - 16)) / 2
    small = 4 / large
    if damping == 4.0:
        exact = 0.5 * (1 + 2 * t) * np.exp(-2 * t)
    else:
        a = -0.5 * small / (large - small)
        exact = np.real(a * np.exp(large * t) + (0.5 - a) * np.exp(small * t))
    holds(run, float(np.abs(run.angle[:, 0] - exact).max()), 1e-9)
    assert ("Radau" in " ".join(run.fine.methods)) == (damping >= 50)
    assert np.abs(run.energy_drift).max() < 1e-8


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(("share", "stiffness"), [(1.0, 2e6), (1.0, 2e10), (2.0, 2e8), (0.05, 2e6)])
def test_a_stiff_spring_and_its_damper_come_to_rest(share: float, stiffness: float, accuracy: float) -> None:
    """ẍ + 2 D ω ẋ + ω² x = 0 for many times the decay: the block stands at 0, and no energy comes from anywhere."""
    w = math.sqrt(stiffness)
    m = block(springs=[Spring((("block", 0j), ("ground", -1 + 0j)), stiffness, 1.0, 2 * share * w)])
    run = m.simulate([0.0, 500 / (share * w), 1e4 / (share * w)], angle=1e-3, accuracy=accuracy)
    # e^-67 is left of 1 mm, and rounding
    assert np.abs(run.angle[1:, 0]).max() < 1e-13
    assert (np.abs(run.angle[1:, 0]) <= run.error_estimate[1:, 0] + 1e-15).all()
    assert abs(run.energy_drift[-1]) <= 10 * accuracy * run.energy[0]


@pytest.mark.parametrize(("stiffness", "damping"), [(1e7, 1e3), (1e5, 1e3), (1e8, 1e4)])
def test_a_stiff_coupling_in_absolute_and_in_relative_angles(stiffness: float, damping: float) -> None:
    """Two bars that are all but one: the same motion, whichever angles are its coordinates."""
    links = {
        "upper": Link({"O": 0j, "P": 1 + 0j}, mass=1, center=0.6 + 0j, inertia=0.1),
        "lower": Link({"P": 0j, "Q": 1 + 0j}, mass=1.3, center=0.5 + 0.1j, inertia=0.2),
    }
    coupling = TorsionSpring(("upper", "lower"), stiffness, 0.1, damping)
    runs = []
    for on, speed in (("ground", 2.0), ("upper", 1.0)):
        m = Mechanism(
            {"O": 0j},
            links,
            inputs=[Input(link="upper"), Input(link="lower", on=on)],
            torsion_springs=[coupling],
            gravity=-1j * G,
        )
        runs.append(m.simulate([0.0, 0.5, 1.0], angle=[0.0, -0.5], speed=[1.0, speed]))
    absolute, relative = runs
    error = np.maximum(absolute.error_estimate, relative.error_estimate.sum(axis=1)[:, None])
    assert (np.abs(np.cumsum(relative.angle, axis=1) - absolute.angle) <= error).all()
    assert error.max() < 1e-7


def test_constant_torque_on_a_rotor() -> None:
    run = rotor(torques=[Torque("rotor", 3.0)]).simulate([0, 1, 100], angle=0.5, speed=-2.0)
    t = run.t
    assert np.allclose(run.angle[:, 0], 0.5 - 2 * t + 0.75 * t**2, rtol=1e-14, atol=0)
    assert np.allclose(run.speed[:, 0], -2 + 1.5 * t, rtol=1e-14, atol=1e-14)


def test_torsion_spring_and_damper() -> None:
    """2 φ̈ + 0.4 φ̇ + 8 φ = 0: e^{−0.1 t}(cos ωt + 0.1/ω sin ωt), ω² = 4 − 0.01; it turns several times."""
    m = rotor(torsion_springs=[TorsionSpring(("ground", "rotor"), 8.0, 0.0, 0.4)])
    t = np.linspace(0, 20, 81)
    run = m.simulate(t, angle=10.0)
    w = math.sqrt(3.99)
    exact = 10 * np.exp(-0.1 * t) * (np.cos(w * t) + 0.1 / w * np.sin(w * t))
    holds(run, float(np.abs(run.angle[:, 0] - exact).max()), 1e-9)


def test_gears_share_their_inertia() -> None:
    """A torque on the second wheel, ratio −1/3: α₁ = n·T/(I₁ + n² I₂)."""
    m = Mechanism(
        {"A": 0j, "B": 4 + 0j},
        {"one": Link({"A": 0j}, inertia=2), "two": Link({"B": 0j}, inertia=27)},
        gears=[Gear(("one", "two"), -1 / 3)],
        inputs=Input(link="one"),
        torques=[Torque("two", 5.0)],
    )
    run = m.simulate([0, 2], angle=0.0)
    assert run.acceleration[:, 0] == pytest.approx([-5 / 3 / 5] * 2, rel=1e-14)
    assert run.angle[-1, 0] == pytest.approx(-2 / 3, rel=1e-13)


def test_motor_curve_over_speed() -> None:
    """T = 20 (1 − ω/100) on 2 kg·m²: ω = 100 (1 − e^{−t/10})."""
    curve = ((-100.0, 40.0), (50.0, 10.0), (200.0, -20.0))
    m = rotor(torques=[Torque("rotor", history=curve, over="speed")])
    run = m.simulate([0, 10, 20], angle=0.0)
    exact = 100 * (run.t - 10 * (1 - np.exp(-run.t / 10)))
    assert np.allclose(run.angle[:, 0], exact, rtol=1e-12, atol=1e-9)
    assert np.abs(run.energy_drift).max() < 1e-7


def test_torque_over_time_is_followed_through_its_kinks() -> None:
    """Up to 4 N·m at 1 s and down to 0 at 2 s, on 2 kg·m²; the table's end is the motion's."""
    table = ((0.0, 0.0), (1.0, 4.0), (2.0, 0.0), (3.0, 0.0))
    m = rotor(torques=[Torque("rotor", history=table, over="time")])
    run = m.simulate([0, 1, 2, 2.5, 5], angle=0.0)
    assert run.t[-1] == 3.0
    assert np.allclose(run.angle[:, 0], [0, 1 / 3, 2, 3, 4], rtol=1e-11)
    assert "ends at 3 s: the table of the applied torque on rotor ends at 3 s" in " ".join(run.warnings)


def test_torque_over_an_angle_repeats_and_does_the_work_of_its_area() -> None:
    """1 at 0° and 360°, 3 at 180° on 1 kg·m²: a turn's work is 4π, wherever its rows are cut."""
    table = ((0.0, 1.0), (math.pi, 3.0), (2 * math.pi, 1.0))
    m = rotor(1.0, torques=[Torque("rotor", history=table, over="angle", periodic=True)])
    run = m.simulate([0, 100], angle=0.0, until={"rotor": 6 * math.pi})
    assert run.angle[-1, 0] == pytest.approx(6 * math.pi, rel=1e-15)
    assert run.speed[-1, 0] == pytest.approx(math.sqrt(2 * 12 * math.pi), rel=1e-10)


def test_event_to_rounding() -> None:
    """A quarter swing of the pendulum from the side takes K(1/2)·√(l/g)."""
    run = pendulum().simulate(np.linspace(0, 5, 6), angle=0.0, until={"bob": -math.pi / 2})
    with mp.workdps(25):
        quarter = float(mp.ellipk(mp.mpf(1) / 2) / mp.sqrt(mp.mpf(G)))
    assert run.t[-1] == pytest.approx(quarter, abs=2e-10)
    assert run.angle[-1, 0] == pytest.approx(-math.pi / 2, rel=1e-15)
    assert len(run.t) == 2


# after 1, 2, 5 and 10 s (benchmarks.truth.double_pendulum)
DOUBLE_PENDULUM = [
    ("-2.06346047829304440026064", "-2.825698395035491239630028"),
    ("-1.973982413972820947108786", "-2.398486954136604287364049"),
    ("-1.630951027088622800761202", "-2.255694745236806018304574"),
    ("-2.684057329739153252662475", "-3.090668097315319789813611"),
]


def test_double_pendulum_against_forty_digits() -> None:
    """Two points of 1 kg on bars of 1 m, from rest at 0 and −0.5 rad; Taylor series with 40 digits."""
    run = double_pendulum().simulate([0, 1, 2, 5, 10], accuracy=1e-9)
    exact = np.array(DOUBLE_PENDULUM, dtype=float)
    error = np.abs(run.angle[1:] - exact[:, :2])
    assert error.max() <= 1e-9
    assert (error <= run.error_estimate[1:]).all()


@pytest.mark.slow
def test_free_double_pendulum_keeps_energy_and_momentum() -> None:
    m = double_pendulum(gravity=0j)
    run = m.simulate(np.linspace(0, 20, 101), speed=[3.0, -5.0], accuracy=1e-10)
    momentum = sum(
        (run.motion.point(p).complex(0).conjugate() * run.motion.point(p).complex(1)).imag for p in "PQ"
    )
    assert np.ptp(momentum) < 1e-8
    assert np.ptp(run.energy) < 1e-8
    assert np.abs(run.motion.effort).max() < 1e-9


@pytest.mark.parametrize("driver", ["crank", "rocker"])
def test_dead_points_of_the_input_are_passed(driver: str) -> None:
    """The same motion released with the crank as input, and with the rocker, which has dead points."""
    t = np.linspace(0, 5, 101)
    run = four_bar(driver).simulate(t, speed={"crank": 15.0, "rocker": four_bar_rate()}[driver])
    assert not run.warnings
    assert np.abs(run.energy_drift).max() < 1e-8
    crank = run.fine.link_angle("crank", t)
    reference = four_bar("crank").simulate(t, speed=15.0)
    assert np.abs(crank - reference.angle[:, 0]).max() < 2e-9
    assert np.abs(run.motion.link("rocker").angle - reference.motion.link("rocker").angle).max() < 1e-9
    assert np.ptp(crank) > 4 * math.pi
    assert (len(run.fine.legs) > 1) == (driver == "rocker")


def four_bar_rate() -> float:
    """The rocker's speed while the crank has 15 rad/s."""
    return float(four_bar().motion(math.radians(60), speed=15.0).link("rocker").omega[0])


def test_loops_close_and_joint_forces_balance_at_every_time() -> None:
    run = four_bar().simulate(np.linspace(0, 3, 301), speed=4.0)
    motion = run.motion
    pins = [motion.at(link, "C").complex(0) for link in ("coupler", "rocker")]
    assert np.abs(pins[0] - pins[1]).max() < 1e-15
    assert np.abs(motion.effort).max() < 1e-10
    force, _ = motion.dynamics.shaking
    bearings = motion.reaction("A", on="crank") + motion.reaction("D", on="rocker")
    assert np.abs(force + bearings).max() < 1e-9


@pytest.mark.parametrize("accuracy", [1e-6, 1e-11])
def test_four_bar_that_falls_for_ten_seconds_against_its_energy(accuracy: float) -> None:
    """Without friction it goes to and fro, and its time is a quadrature: no equation of motion is used."""
    start = math.radians(60)
    exact = float(falling_four_bar.angle(10, start, digits=16, points=160))
    run = four_bar().simulate([0, 10], accuracy=accuracy)
    holds(run, abs(run.angle[-1, 0] - exact), accuracy)
    assert abs(run.energy_drift[-1]) < 100 * accuracy


def test_andrews_mechanism() -> None:
    """Andrews' squeezing mechanism after 0.03 s, β to 22 digits, from its file among the examples."""
    folder = Path(__file__).parents[2] / "cli" / "examples" / "andrews"
    m = Mechanism.from_toml(folder / "andrews.toml")
    for accuracy in (1e-6, 3e-10, 1e-12):
        run = m.simulate([0.0, 0.015, 0.03], accuracy=accuracy)
        holds(run, abs(run.angle[-1, 0] - 15.81077119515370709712), accuracy)


def bars(n: int) -> Mechanism:
    """N four-bars of uniform bars of 1 m and 1 kg, the cranks upright (IFToMM benchmark A02)."""
    links = {
        f"crank{i}": Link({f"A{i}": 0j, f"B{i}": 1 + 0j}, mass=1, center=0.5 + 0j, inertia=1 / 12)
        for i in range(n + 1)
    }
    links |= {
        f"coupler{i}": Link({f"B{i}": 0j, f"B{i + 1}": 1 + 0j}, mass=1, center=0.5 + 0j, inertia=1 / 12)
        for i in range(n)
    }
    upright = {f"crank{i}": math.pi / 2 for i in range(1, n + 1)} | {f"coupler{i}": 0.0 for i in range(n)}
    return Mechanism(
        {f"A{i}": complex(i) for i in range(n + 1)},
        links,
        inputs=Input(link="crank0", value=math.pi / 2, speed=-1.0),
        guess=Guess(math.pi / 2, upright),
        gravity=-1j * G,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "exact"),
    [
        (1, 31.9147412977380245),
        (2, 31.7505971869861018),
        (10, 31.6217298227818726),
        (40, 31.5974337439857377),
    ],
)
def test_n_four_bars_of_iftomm_a02_through_their_change_points(n: int, exact: float) -> None:
    """φ̈ = k sin φ, k = 3g(3N + 1)/(2(4N + 1)), from upright at 1 m/s: ten change points of every loop in 10 s."""
    # rounding close to the change points of forty loops may be 4e-9
    run = bars(n).simulate([0, 10], accuracy=1e-9 if n < 40 else 1e-8)
    holds(run, abs(math.pi / 2 - run.angle[-1, 0] - exact), 1e-9)
    assert np.abs(run.energy_drift).max() < 1e-8


def test_slider_crank_of_haug_against_its_published_integral() -> None:
    """E. J. Haug, Intermediate Dynamics, ex. 6.1.8; ∫T dt over 10 s as an example of SUNDIALS prints it, to its rtol of 1e-6.

    Crank 1/2, rod 1 carried on as far again, a spring and a damper between their middles, a force at the rod's end.
    """
    m = Mechanism(
        {"O": 0j},
        {
            "crank": Link({"O": 0j, "B": 0.5 + 0j}, inertia=1),
            "rod": Link({"B": 0j, "C": 1 + 0j}, inertia=2),
            "slider": Link({"C": 0j}, mass=1),
        },
        guides=[Guide("C", "slider", turned=0.0)],
        inputs=Input(link="crank", value=math.pi / 2),
        guess=Guess(math.pi / 2, {"rod": -0.5, "slider": 0.0}),
        springs=[Spring((("crank", 0.25 + 0j), ("rod", 0.5 + 0j)), 1.0, 1.0, 1.0)],
        forces=[Force("rod", 2 + 0j, 1 + 0j)],
    )
    run = m.simulate(np.linspace(0, 10, 2001))
    crank, rod, slider = run.speed[:, 0], run.motion.link("rod").omega, run.motion.slide("C").speed
    twice = crank**2 + slider**2 + 2 * rod**2
    weights = np.array([1, *[4, 2] * 999, 4, 1]) * 0.005 / 3
    assert weights @ twice / 2 == pytest.approx(3.3366160662909388, rel=5e-6)
    assert np.abs(run.energy_drift).max() < 1e-8
    assert not run.warnings


# --- what cannot be ---------------------------------------------------------------------------------------------------
def test_no_mass_on_an_input_is_named() -> None:
    with pytest.raises(MechanismError, match="no mass moves with input 'rotor'"):
        rotor(0.0, torques=[Torque("rotor", 1.0)]).simulate([0, 1])
    m = double_pendulum()
    bare = replace(m, links={**m.links, "lower": Link({"P": 0j, "Q": 1 + 0j})})
    with pytest.raises(MechanismError, match="no mass moves with input 'lower'"):
        bare.simulate([0, 1])


@pytest.mark.slow
def test_an_accuracy_beyond_rounding_names_what_is_reached() -> None:
    run = pendulum().simulate(np.linspace(0, 100, 11), angle=0.0, accuracy=1e-15)
    assert "accuracy 1e-15 is beyond rounding here" in run.warnings[0]
    assert run.error_estimate.max() < 1e-9


@pytest.mark.slow
def test_chaos_past_all_digits_is_said() -> None:
    run = double_pendulum().simulate(np.linspace(0, 60, 61), angle=[2.0, 2.5])
    assert "no digit holds from" in run.warnings[0]
    assert run.error_estimate[5].max() < 1e-9
    assert run.error_estimate[-1].max() > 0.1


def test_rest_at_a_change_point_is_named_with_its_time() -> None:
    """A parallelogram stretched out: at rest it may go on in two ways, with a speed only in one."""
    flat = replace(
        bars(1),
        inputs=(Input(link="crank0", value=0.0),),
        guess=Guess(0.0, {"crank1": 0.0, "coupler0": 0.0}),
    )
    assert "at 0 s it rests at a change point" in flat.simulate([0, 0.1], accuracy=1e-6).warnings[0]
    assert not flat.simulate([0, 0.1], speed=1.0, accuracy=1e-6).warnings


@pytest.mark.parametrize("wrong", [{"times": [0, 0]}, {"times": []}, {"times": [0, 1], "accuracy": 2.0}])
def test_wrong_questions(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"times|accuracy"):
        pendulum().simulate(**wrong)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="no input is named 'bab'"):
        pendulum().simulate([0, 1], until={"bab": 1.0})


def test_a_motion_that_takes_too_many_steps_ends_with_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    for room in ("run", "travel"):
        monkeypatch.setattr(f"virtualwork.intime.{room}.MOST", 40)
    run = pendulum().simulate(np.linspace(0, 1000, 11))
    assert run.t[-1] < 1000
    (said,) = (text for text in run.warnings if "steps" in text)
    assert (
        said
        == f"ends at {run.t[-1]:.9g} s, after 40 steps: a larger permissible error (--accuracy) needs fewer"
    )


def test_wheels_without_a_loop_turn_as_far_as_they_like() -> None:
    """No change point is looked for, turn after turn: α = 3/(2 + 4·1)."""
    m = Mechanism(
        {"A": 0j, "B": 4 + 0j},
        {"one": Link({"A": 0j}, inertia=2.0), "two": Link({"B": 0j}, inertia=4.0)},
        gears=[Gear(("one", "two"), -1.0)],
        inputs=Input(link="one"),
        torques=[Torque("one", 3.0)],
    )
    run = m.simulate([0, 1, 2], angle=0.25, speed=1e5)
    t = np.array([0.0, 1.0, 2.0])
    assert run.angle[:, 0] == pytest.approx(0.25 + 1e5 * t + 0.25 * t * t, rel=1e-12)
    assert np.abs(run.angle[:, 0]).max() > 30_000 * 2 * np.pi
    far = m.motion(run.angle[:, 0])
    assert far.link("two").omega == pytest.approx([0, 0, 0])
    assert far.assembled.all()
