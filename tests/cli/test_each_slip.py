"""Each likely mistake of the list in its simplest case: the slip is made here by hand, and `dalembert grade` names it."""

from __future__ import annotations

import json
from cmath import exp, phase
from collections.abc import Mapping
from math import cos, degrees, pi, radians, sqrt
from pathlib import Path
from typing import NamedTuple

import pytest

from dalembert.figures import written
from tests.conftest import Dalembert


class Slip(NamedTuple):
    """A question, its right answer, and what the slip makes of it."""

    files: Mapping[str, str]
    command: str
    quantity: str
    where: str
    right: float
    slipped: float
    name: str
    other: tuple[str, float]
    """Another unit, and how many of it the question's unit is."""


def at(size: float, angle_deg: float) -> complex:
    return size * exp(1j * radians(angle_deg))


def turned(vector: complex) -> float:
    return degrees(phase(vector)) % 360


# --- three masses in one plane, m·r in kg·mm, balanced at 35 mm -----------------------------------------
ONE, TWO, THREE = at(2.3 * 41, 25), at(1.7 * 63, 140), at(0.9 * 52, 250)
RADIUS = 35.0
MASSES = {"disc.csv": "name,mass_kg,radius_mm,angle_deg\nP,2.3,41,25\nQ,1.7,63,140\nR,0.9,52,250\n"}
WEIGHTS = {"disc.csv": "name,weight_N,radius_mm,angle_deg\nP,23,41,25\nQ,17,63,140\nR,9,52,250\n"}


def of_masses(unbalance: complex, name: str) -> Slip:
    """The mass that balances another unbalance."""
    right, slipped = abs(ONE + TWO + THREE) / RADIUS, abs(unbalance) / RADIUS
    return Slip(MASSES, "balance disc.csv --plane D:35mm", "mass_kg", "", right, slipped, name, ("g", 1e3))


def of_weights(quantity: str, share: float, name: str, other: tuple[str, float]) -> Slip:
    """Mass or weight where the masses' weights are in the table, g = 10 m/s²."""
    right = abs(ONE + TWO + THREE) / RADIUS * (1 if quantity == "mass_kg" else 10)
    command = "balance disc.csv --plane D:35mm --gravity 10"
    return Slip(WEIGHTS, command, quantity, "", right, right * share, name, other)


# --- a point of 0.3 kg, 70 mm from a shaft that turns with 420 rpm, midway between its bearings ----------------------
SHAFT = {"parts.csv": "part,shape,mass_kg,x_mm\npin,point,0.3,70\n"}


def dynamic(speed_rad_s: float) -> float:
    """The force of the rotation on the shaft in each bearing."""
    return -0.3 * 0.07 * speed_rad_s**2 / 2


# --- a four-bar: A (0, 0), D (300, 0), crank 100 at 60°, bar 250, rocker 150 -----------------------------------------
FOUR_BAR = {
    "bar.toml": '[units]\nlength = "mm"\nangle = "deg"\n[ground]\nA = [0, 0]\nD = [300, 0]\n'
    "[links.crank]\npoints = { A = [0, 0], B = [100, 0] }\n[links.bar]\npoints = { B = [0, 0], C = [250, 0] }\n"
    "[links.rocker]\npoints = { D = [0, 0], C = [150, 0] }\n"
    '[input]\nlink = "crank"\nangle = 60\n[guess]\nat = 60\nbar = 20\nrocker = 80\n'
}


def rocker(side: int) -> float:
    """The angle of the rocker by the triangle B D C."""
    to_b = at(100, 60) - 300
    cosine = (150**2 + abs(to_b) ** 2 - 250**2) / (2 * 150 * abs(to_b))
    return turned(to_b * (cosine - side * 1j * sqrt(1 - cosine**2)))


# --- measured vibration ----------------------------------------------------------------------------------------------
HEAD = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg,trial_kept\n"
FAN = {"runs.csv": HEAD + "0,1,3.4,116,,,,\n1,1,1.8,42,A,2,30,\n"}
TWO_PLANES = {
    "runs.csv": HEAD
    + "0,1,80,40,,,,\n0,2,60,55,,,,\n1,1,70,75,A,10,0,yes\n1,2,66,80,A,10,0,yes\n2,1,95,60,B,12,90,\n2,2,40,100,B,12,90,\n"
}


def fan(sense: int) -> float:
    """The angle of the correction −V₀/α, α = (V₁ − V₀)/T; with sense −1 phases count the other way."""
    before, after, trial = at(3.4, sense * 116), at(1.8, sense * 42), at(2, 30)
    return turned(-before * trial / (after - before))


def of_trials(left_on: bool) -> float:
    """The mass in plane A: α_A, α_B from the runs, and the two equations by Cramer's rule."""
    start, first, second = (
        (at(a, p), at(b, q)) for a, p, b, q in ((80, 40, 60, 55), (70, 75, 66, 80), (95, 60, 40, 100))
    )
    without = first if left_on else start
    a1, a2 = ((first[k] - start[k]) / 10 for k in (0, 1))
    b1, b2 = ((second[k] - without[k]) / at(12, 90) for k in (0, 1))
    return abs((-start[0] * b2 + start[1] * b1) / (a1 * b2 - a2 * b1))


# --- virtual work: torque·ω of a crank + F·v of a slider − m·a·v = 0 -------------------------------------------------
STATES = {
    "states.csv": "link,mass_kg,vx_m_s,vy_m_s,ax_m_s2,omega_rad_s,fx_N,torque_N_m\ncrank,,,,,21,,?\n"
    "slider,3.7,-4.3,,85,,617,\nload,530,1.9,2.9,,,,\n"
}


def torque(force: float = 1, inertia: float = 1, weight: float = 1) -> float:
    """The driving torque, with each term as often as stated."""
    return -(force * 617 * -4.3 - inertia * 3.7 * 85 * -4.3 + weight * 530 * -9.81 * 2.9) / 21


def of_work(slipped: float, name: str) -> Slip:
    return Slip(
        STATES, "work states.csv --gravity 0,-9.81", "torque_N_m", "", torque(), slipped, name, ("kN_m", 1e-3)
    )


SLIPS = {
    "a sign": of_masses(ONE - TWO + THREE, "the term of Q has the wrong sign"),
    "a sign of a power": of_work(torque(inertia=-1), "the inertia force of link slider has the wrong sign"),
    "left out": of_masses(ONE + THREE, "the term of Q is left out"),
    "a power left out": of_work(torque(weight=0), "the weight of link load is left out"),
    "ten times too large": of_masses(10 * ONE + TWO + THREE, "the term of P is ten times too large"),
    "ten times too small": of_masses(ONE + TWO / 10 + THREE, "the term of Q is ten times too small"),
    "a power ten times": of_work(
        torque(force=10), "the power of the applied force of link slider is ten times too large (2 653.1 W taken as 26 531 W)"
    ),
    "g 9.81 for 10": of_weights("mass_kg", 10 / 9.81, "g = 9.81 in place of 10", ("g", 1e3)),
    "g 10 for 9.81": of_work(torque(weight=10 / 9.81), "g = 10 in place of 9.81"),
    "mass for weight": of_weights("weight_N", 1 / 10, "the mass in place of the weight", ("kN", 1e-3)),
    "mass for weight in a sum": of_work(torque(weight=1 / 9.81), "the mass in place of the weight"),
    "diameter for radius": of_masses((ONE + TWO + THREE) / 2, "the diameter in place of the radius of the plane"),
    "diameter for a mass's radius": of_masses(2 * ONE + TWO + THREE, "the diameter of P in place of its radius"),
    "degrees for radians": of_masses(
        abs(ONE) * exp(25j) + TWO + THREE, "the angle of P: degrees taken as radians"
    ),
    "sine for cosine": of_masses(at(abs(ONE), 90 - 25) + TWO + THREE, "sine in place of cosine at P"),
    "180°": Slip(
        MASSES, "balance disc.csv --plane D:35mm", "angle_deg", "", turned(-ONE - TWO - THREE), turned(ONE + TWO + THREE),
        "180° off: the angle of the unbalance in place of the correction's, or the wrong quadrant", ("rad", pi / 180),
    ),
    "rpm for rad/s": Slip(
        SHAFT, "body parts.csv --shaft=-500mm:500mm --speed 420rpm", "bearing1_dynamic_N", 'axis = "x"', dynamic(420 * pi / 30),
        dynamic(420), "420rpm: rpm taken for rad/s", ("kN", 1e-3),
    ),
    "the other assembly": Slip(
        FOUR_BAR, "mechanism bar.toml --at 60deg", "rocker_angle_deg", "", rocker(1), rocker(-1), "the other assembly",
        ("rad", pi / 180),
    ),
    "a trial mass left on": Slip(
        TWO_PLANES, "field runs.csv", "mass_g", 'plane = "A"', of_trials(True), of_trials(False),
        "a trial mass that was left on is taken as removed", ("kg", 1e-3),
    ),
    "the phase the other way": Slip(
        FAN, "field runs.csv", "angle_deg", "", fan(1), fan(-1), "the phase is counted the other way", ("rad", pi / 180)
    ),
}  # fmt: skip


def mistakes(
    dalembert: Dalembert, folder: Path, own: Slip, figures: int, *answers: str
) -> list[tuple[str, str | None]]:
    """Verdict and likely mistake of each answer, by a student of its own."""
    for name, text in own.files.items():
        (folder / name).write_text(text)
    where = f"where = {{ {own.where} }}\n" if own.where else ""
    (folder / "e.toml").write_text(
        f'command = "{own.command}"\n[[ask]]\nquantity = "{own.quantity}"\n{where}figures = {figures}\n'
    )
    lines = "".join(f"{k};{own.quantity};{answer}\n" for k, answer in enumerate(answers))
    (folder / "a.csv").write_text(f"student;quantity;answer\n{lines}")
    done = dalembert("grade", "e.toml", "a.csv", "--json")
    assert done.returncode == 0, done.stderr
    return [(mark["verdict"], mark["mistake"]) for mark in json.loads(done.stdout)["marks"]]


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_by_hand_is_named(slip: str, dalembert: Dalembert, tmp_path: Path) -> None:
    """With three, four and six figures, in another unit, with a decimal comma; and another wrong answer is not."""
    own = SLIPS[slip]
    unit, times = own.other
    for figures in (3, 4, 6):
        right, wrong = written(own.right, figures), written(own.slipped, figures)
        elsewhere = f"{written(own.slipped * times, figures)} {unit}"
        off = own.right + 77.7 if own.quantity.endswith("deg") else 1.37 * own.right
        made = mistakes(
            dalembert,
            tmp_path,
            own,
            figures,
            right,
            wrong,
            wrong.replace(".", ","),
            elsewhere,
            written(off, figures),
        )
        named = ("wrong", own.name)
        assert made == [("right", None), named, named, named, ("wrong", None)], figures


def test_two_slips_are_named_with_four_digits_and_one_before_two(
    dalembert: Dalembert, tmp_path: Path
) -> None:
    """The force with the wrong sign and the weight left out; with three figures it has no name."""
    slipped = torque(force=-1, weight=0)
    name = "the applied force of link slider has the wrong sign and the weight of link load is left out"
    for figures, expected in ((3, None), (4, name), (6, name)):
        own = of_work(slipped, "")
        assert mistakes(dalembert, tmp_path, own, figures, written(slipped, figures)) == [("wrong", expected)]


def test_the_right_answers_are_those_of_a_calculator() -> None:
    """Two masses by the law of cosines, 115° apart; the three powers."""
    two = 94.3**2 + 107.1**2 + 2 * 94.3 * 107.1 * cos(radians(115))
    assert abs(ONE + TWO) == pytest.approx(sqrt(two), rel=1e-12)
    assert torque() == pytest.approx((2653.1 - 1352.35 + 15077.97) / 21, rel=1e-12)
