"""Published rotors with known eccentric masses: each to its printed digits, and to the exact answer.

The exact answers were computed from the printed data in rational or extended arithmetic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from balancing import allocate, correct, grade_value, permissible_unbalance


@dataclass(frozen=True)
class Case:
    """Masses, radii, angles (deg), places; correction planes and radii; printed and exact (mass, angle)."""

    source: str
    mass: list[float]
    radius: list[float]
    angle: list[float]
    z: list[float]
    planes: list[float]
    at: list[float]
    printed: list[tuple[float, float]]
    exact: list[tuple[float, float]]
    amount: float  # half of the last printed digit, or the draughtsman's
    turn: float


CASES = [
    Case(
        "Riul, example 2 (a2 = 65 mm; the scan reads 25)",
        [9, 6], [30, 50], [60, 210], [20, 65], [0, 90], [20, 20],
        [(7.20, 256.8), (8.37, 19.7)],
        [(7.199575562487884, 256.82017736549676), (8.370750257003406, 19.67710193893957)],
        0.006, 0.05,
    ),
    Case(
        "Riul, example 2 with the scan's a2 = 25 mm",
        [9, 6], [30, 50], [60, 210], [20, 25], [0, 90], [20, 20],
        [(5.5309, 318.34), (2.1704, 346.28)],
        [(5.530852714559602, 318.3373262594001), (2.1703631070629967, 346.28048670888876)],
        5e-5, 0.005,
    ),
    Case(
        "Sarkar, Theory of Machines, illustration 8.1",
        [12, 10, 18, 15], [40, 50, 60, 30], [0, 60, 130, 270], [0, 0, 0, 0], [0], [100],
        [(8.1, 267.5)], [(8.111306, 267.47113)], 0.05, 0.05,
    ),
    Case(
        "Norton, Design of Machinery, example 12-1",
        [1.2, 1.8], [1.135, 0.822], [113.4, 48.8], [0, 0], [0], [1],
        [(2.402, 259.6)], [(2.402718, 259.60134)], 0.001, 0.05,
    ),
    Case(
        "Bevan, example 14.1: a mass outside the planes",
        [200], [9], [0], [-10], [0, 50], [15, 15],
        [(144, 180), (24, 0)], [(144, 180), (24, 0)], 0.5, 0.5,
    ),
    Case(
        "Sarkar, illustration 8.3 (Khurmi 21.2), from a drawing board",
        [200, 300, 400, 200], [80, 70, 60, 80], [0, 45, 115, 235], [-100, 200, 300, 600], [0, 400], [100, 100],
        [(350, 214), (182.5, 348)],
        [(352.97211865500117, 213.3713235327847), (184.05902382370212, 347.1977262078124)],
        4, 1,
    ),
    Case(
        "Uicker, Pennock, Shigley, problem 15.1: the single correction",
        [2, 1.5, 3], [0.025, 0.035, 0.04], [90, 195, 285], [0.2, 0.2, 0.2], [0.2], [0.05],
        [(1.638, 76.1)], [(1.6378449374397988, 76.11441009799778)], 0.0005, 0.05,
    ),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.source)
def test_published_rotor(case: Case) -> None:
    moment = np.array(case.mass) * case.radius * np.exp(1j * np.radians(case.angle))
    fix = correct(moment, case.z, case.planes)
    for mass, angle, printed, exact in zip(
        fix.mass(case.at), np.degrees(fix.angle), case.printed, case.exact, strict=True
    ):
        assert mass == pytest.approx(printed[0], abs=case.amount)
        assert abs(math.remainder(angle - printed[1], 360)) <= case.turn
        # the exact values are given to at least seven digits
        digits = 1e-13 if len(repr(exact[0])) > 12 or exact[0] == round(exact[0]) else 1e-6
        assert mass == pytest.approx(exact[0], rel=digits)
        assert abs(math.remainder(angle - exact[1], 360)) <= 360 * digits


def test_riul_example_2_step_by_step() -> None:
    """Every printed intermediate of the example, in N·mm with g = 10."""
    weights = 10 * np.array([9, 6]) * [30, 50] * np.exp(1j * np.radians([60, 210]))
    fix = correct(weights, [20, 65], [0, 90])
    assert fix.static == pytest.approx(-1248.076211353316 + 838.2685902179843j, rel=1e-14)
    a, b = fix.unbalance
    assert b == pytest.approx(1576.3883748662838 + 563.7180910626702j, rel=1e-14)
    assert a == pytest.approx(-328.3121635129678 - 1401.9866812806545j, rel=1e-14)
    for value, printed in (
        (b.real, 1576.4),
        (b.imag, 563.7),
        (abs(b), 1674.2),
        (a.real, -328.3),
        (a.imag, -1402.0),
    ):
        assert value == pytest.approx(printed, abs=0.06)
    assert abs(b) / 20 == pytest.approx(83.7, abs=0.05)
    assert abs(a) / 20 == pytest.approx(72.0, abs=0.05)


def test_xie_planes_close_to_each_other_amplify() -> None:
    """Xie, Flexible Rotor Dynamic Balancing, ch. 4: a unit at 0.1 L, planes at 0.4 L and 0.6 L."""
    np.testing.assert_allclose(correct([1], [0.1], [0.4, 0.6]).unbalance, [-2.5, 1.5], rtol=1e-14)


def test_micropoise_couple() -> None:
    """56 oz·in² is 1 oz at 8 in in each of two planes 7 in apart, 180° from each other."""
    couple = correct([8, -8], [0, 7], [0, 7])
    assert abs(couple.couple(3.5)) == 56
    np.testing.assert_allclose(couple.mass([8, 8]), [1, 1])


def test_uicker_bearing_forces() -> None:
    """Problem 15.1: U ω² carried to the bearings 1 m apart."""
    moment = np.array([2 * 0.025, 1.5 * 0.035, 3 * 0.04]) * np.exp(1j * np.radians([90, 195, 285]))
    omega = 300 * math.pi / 30
    fix = correct(moment, 0.2, [0.0, 1.0])
    assert abs(fix.static) * omega**2 == pytest.approx(80.82440801428882, rel=1e-13)
    assert np.degrees(np.angle(fix.static)) == pytest.approx(-103.88558990200222, rel=1e-13)
    forces = np.abs(fix.unbalance) * omega**2
    np.testing.assert_allclose(forces, [64.65952641143106, 16.164881602857765], rtol=1e-13)


@pytest.mark.parametrize(
    ("source", "grade", "rpm", "mass", "printed", "exact"),
    [
        ("WIDIA catalogue K53", "G6.3", 10000, 2, 12, 12.032113697747288),
        ("amarschn/tools", "G2.5", 3000, 10, 79.57, 79.57747154594767),
        ("ISO 21940-11, the annex's turbine", "G2.5", 3000, 3600, 28600, 28647.88975654116),
    ],
)
def test_permissible_unbalance(
    source: str, grade: str, rpm: float, mass: float, printed: float, exact: float
) -> None:
    found = float(permissible_unbalance(grade_value(grade), rpm * math.pi / 30, mass)) * 1e6
    assert found == pytest.approx(exact, rel=1e-14)
    assert found == pytest.approx(printed, rel=4e-3)


def test_iso_annex_turbine_shares() -> None:
    np.testing.assert_allclose(
        allocate(28647.88975654116, 1500, 0, 2400), [10742.958658702935, 17904.931097838227], rtol=1e-14
    )


def test_shares_have_limits() -> None:
    np.testing.assert_allclose(allocate(100, 0.9, 0, 1), [30, 70])
    np.testing.assert_allclose(allocate(100, 0.6, 0, 1), [40, 60])
    # outboard: the centre beyond bearing B
    np.testing.assert_allclose(allocate(100, 1.2, 0, 1), [30, 120])
    np.testing.assert_allclose(allocate(100, 2, 0, 1), [100, 130])
    np.testing.assert_allclose(allocate(100, 0.6, 1, 0), [60, 40])


def test_easa_constants() -> None:
    """EASA's constants of U = k G W/N in oz·in and lb, g·in and lb, g·mm and kg."""
    per_kg_mm = 30 / math.pi * 1000
    pound, inch, ounce = 0.45359237, 25.4, 28.349523125
    found = [per_kg_mm * pound / inch / ounce, per_kg_mm * pound / inch, per_kg_mm]
    assert found == pytest.approx([6.015, 170.5, 9549], abs=0.5)
    value = float(permissible_unbalance(1e-3, math.pi / 30, pound)) / (ounce * 1e-3 * inch * 1e-3)
    assert value == pytest.approx(6.0153049357566735, rel=1e-13)
