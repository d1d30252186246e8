"""`dalembert engine`: exact orders against the differentiated slider-crank, textbooks' engines, balance shafts."""

from __future__ import annotations

import csv
import io
import json

import mpmath as mp
import numpy as np
import pytest

from balancing.engine import piston_orders, reciprocating_forces, shaft_unbalances, turning_force
from tests.cli.printed import document
from tests.conftest import Dalembert

HEAD = "cylinder,crank_deg,bank_deg,z_mm,throw_mm,rod_mm,reciprocating_g,rotating_g\n"
CROSS = ((0, -150), (90, -50), (270, 50), (180, 150))
V8 = HEAD + "".join(
    f"{2 * i + k},{crank},{bank},{z},45,150,500,400\n"
    for i, (crank, z) in enumerate(CROSS)
    for k, bank in ((1, 135), (2, 45))
)
INLINE = HEAD + "".join(
    f"{i},{c},90,{z},45,150,500,400\n"
    for i, (c, z) in enumerate(zip((0, 180, 180, 0), (-135, -45, 45, 135), strict=True))
)
SIX = HEAD + "".join(
    f"{i},{c},90,{100 * i - 250},45,150,500,400\n" for i, c in enumerate((0, 120, 240, 240, 120, 0))
)


def engine(dalembert: Dalembert, table: str, *options: str) -> dict:
    return document(dalembert("engine", "-", "--speed", "3000rpm", *options, "--json", stdin=table))


@pytest.mark.parametrize("ratio", ["0.3", "0.0001", "0.95", "0.99"])
def test_orders_are_those_of_the_differentiated_slider_crank(ratio: str) -> None:
    with mp.workdps(40):
        L = mp.mpf(ratio)

        def acceleration(phi):
            # -s''/r of s = r cos φ + √(l² - r² sin² φ), r = 1
            s, c = mp.sin(phi), mp.cos(phi)
            root = mp.sqrt(1 / L**2 - s**2)
            return c + (c**2 - s**2) / root + (s * c) ** 2 / root**3

        points = 64 if L < 0.5 else 2048
        values = [acceleration(2 * mp.pi * i / points) for i in range(points)]
        # the trapezoid rule is exact up to the order that folds back
        for k in range(1, 9):
            exact = 2 * mp.fsum(v * mp.cos(2 * mp.pi * i * k / points) for i, v in enumerate(values)) / points
            found = piston_orders(float(ratio), 8)[k - 1]
            assert abs(found - exact) <= 1e-13 * abs(exact) + 1e-30


def test_the_series_of_the_textbooks() -> None:
    ratio = 0.02
    A = piston_orders(ratio, 7)
    assert A[0] == 1
    assert not A[2::2].any()
    assert A[1] == pytest.approx(ratio + ratio**3 / 4 + 15 * ratio**5 / 128, rel=1e-9)
    assert A[3] == pytest.approx(-(ratio**3) / 4 - 3 * ratio**5 / 16, rel=1e-6)
    assert A[5] == pytest.approx(9 * ratio**5 / 128, rel=1e-3)


def test_forces_of_any_layout_against_the_accelerations_of_its_pistons() -> None:
    rng = np.random.default_rng(3)
    n, omega, K = 5, 120.0, 40
    crank, bank, z = rng.uniform(0, 360, n), rng.uniform(0, 360, n), rng.normal(size=n)
    throw, rod, mass = rng.uniform(0.03, 0.05, n), rng.uniform(0.12, 0.2, n), rng.uniform(0.2, 1, n)
    forces = reciprocating_forces(crank, bank, z, throw, rod, mass, omega, K)
    theta = np.linspace(0, 2 * np.pi, 13)
    phi = theta[:, None] + np.radians(crank - bank)
    s, c = np.sin(phi), np.cos(phi)
    root = np.sqrt((rod / throw) ** 2 - s**2)
    along = mass * throw * omega**2 * (c + (c**2 - s**2) / root + (s * c) ** 2 / root**3)
    axis = np.exp(1j * np.radians(bank))
    for couple, exact in ((False, (along * axis).sum(axis=1)), (True, (along * axis * z).sum(axis=1))):
        C = forces.coefficients(couple)
        k = np.arange(1, K + 1)[:, None]
        shape = np.stack([np.cos(k * theta), np.sin(k * theta)], axis=1)
        found = np.einsum("kap,kpt->ta", C, shape)
        np.testing.assert_allclose(
            found[:, 0] + 1j * found[:, 1], exact, rtol=0, atol=1e-11 * np.abs(along).max()
        )
        # the half-axis of the ellipse of each order
        fine = np.linspace(0, 2 * np.pi, 20_001)
        for order in (1, 2):
            x, y = (
                C[order - 1, a, 0] * np.cos(order * fine) + C[order - 1, a, 1] * np.sin(order * fine)
                for a in (0, 1)
            )
            assert forces.largest(couple)[order - 1] == pytest.approx(np.hypot(x, y).max(), rel=1e-6)


def test_an_inline_four_and_its_lanchester_shafts(dalembert: Dalembert) -> None:
    found = engine(dalembert, INLINE, "--shaft", "2:0mm:with", "--shaft", "2:0mm:against")
    one = 0.5 * 0.045 * (100 * np.pi) ** 2
    first, second = found["orders"][:2]
    assert first["force_max_N"] == first["couple_max_N_m"] == second["couple_max_N_m"] == 0
    force = 4 * one * float(piston_orders(0.3)[1])
    assert second["force_N"]["y"] == pytest.approx([-force, 0], rel=1e-14)
    assert found["residual_orders"][1]["force_max_N"] == 0
    assert found["residual_orders"][3]["force_max_N"] == pytest.approx(
        4 * one * -piston_orders(0.3)[3], rel=1e-13
    )
    for shaft, direction in zip(found["shafts"], ("with", "against"), strict=True):
        assert shaft["direction"] == direction
        assert shaft["unbalance_kg_m"] == pytest.approx(force / 2 / (200 * np.pi) ** 2, rel=1e-14)
        assert shaft["angle_deg"] == pytest.approx(90)
    assert found["counterweights"] == []
    assert found["rotating"]["unbalance_kg_m"] == 0


def test_a_cross_plane_v8_is_balanced_by_counterweights_alone(dalembert: Dalembert) -> None:
    for planes in ((), ("--plane", "A:-200mm:60mm", "--plane", "B:200mm:60mm")):
        found = engine(dalembert, V8, "--counterweight-share", "0.5", *planes)
        first, second = found["orders"][:2]
        assert first["force_max_N"] == 0
        # at 90 deg a pair's first order turns with the crank, m r ω²: the couple is Σ z m r ω² e^{i crank}
        pins = [z / 1000 * np.exp(1j * np.radians(c)) for c, z in CROSS]
        couple = 0.5 * 0.045 * (100 * np.pi) ** 2 * abs(sum(pins))
        assert first["couple_max_N_m"] == pytest.approx(couple, rel=1e-13)
        assert second["force_max_N"] == second["couple_max_N_m"] == 0
        assert found["residual_orders"][0]["force_max_N"] == 0
        assert found["residual_orders"][0]["couple_max_N_m"] == 0
    # masses at the planes' radius: (2·rotating + reciprocating)·Σ z e^{i crank}/0.4 m
    mass = (0.8 + 0.5) * 0.045 * abs(sum(pins)) / 0.4 / 0.06
    assert [c["mass_kg"] for c in found["counterweights"]] == pytest.approx([mass, mass], rel=1e-13)


def test_an_inline_six_has_nothing_below_order_six(dalembert: Dalembert) -> None:
    found = engine(dalembert, SIX)
    assert all(each["force_max_N"] == each["couple_max_N_m"] == 0 for each in found["orders"][:5])
    assert found["orders"][5]["force_max_N"] > 0


def test_a_single_cylinder_with_half_its_mass_and_a_shaft_against(dalembert: Dalembert) -> None:
    one = "crank_deg,throw_mm,rod_mm,reciprocating_kg,rotating_kg\n0,45,150,0.5,0.4\n"
    whole = 0.5 * 0.045 * (100 * np.pi) ** 2
    found = engine(dalembert, one, "--counterweight-share", "0.5")
    assert found["counterweights"][0]["unbalance_kg_m"] == pytest.approx(0.65 * 0.045, rel=1e-15)
    assert found["residual_orders"][0]["force_max_N"] == pytest.approx(whole / 2, rel=1e-14)
    found = engine(dalembert, one, "--counterweight-share", "0.5", "--shaft", "1:0mm:against")
    assert found["residual_orders"][0]["force_max_N"] == 0
    # without anything the rotating mass stays
    found = engine(dalembert, one)
    assert found["residual_orders"][0]["force_N"]["x"] == pytest.approx([0.4 / 0.5 * whole, 0], rel=1e-14)


def test_two_shafts_take_up_a_couple() -> None:
    three = reciprocating_forces([0, 120, 240], 90, [0, 0.1, 0.2], 0.05, 0.15, 0.4, 200.0)
    assert three.largest()[0] == 0
    z = [-0.1, 0.4]
    parts = [
        turning_force(shaft_unbalances(three, z, 200.0, 1, against), z, 200.0, 8, 1, against)
        for against in (False, True)
    ]
    left = three.joined(*parts)
    assert left.largest()[0] == left.largest(couple=True)[0] == 0
    assert three.largest(couple=True)[0] > 100


def test_a_locomotive_of_the_textbook(dalembert: Dalembert) -> None:
    dalembert("examples", "locomotive")
    planes = (
        "--plane",
        "left:-0.75m:0.6m",
        "--plane",
        "right:0.75m:0.6m",
        "--counterweight-share",
        "0.6666666666666666",
    )
    found = document(dalembert("engine", "cylinders.csv", "--speed", "300rpm", *planes, "--json"))
    # Khurmi and Gupta, Theory of Machines, ch. 22: 105 kg at 200 and 250 deg, 25 127 N, 8797 N·m, 27 602 N with a rounded share of 46.6 kg
    left, right = found["counterweights"]
    assert [left["mass_kg"], right["mass_kg"]] == pytest.approx([105, 105], rel=5e-3)
    assert [left["angle_deg"], right["angle_deg"]] == pytest.approx([200, 250], rel=1e-3)
    loco = found["locomotive"]
    force = 180 * 0.3 * (10 * np.pi) ** 2 / 3
    assert loco["tractive_effort_N"] == pytest.approx(np.sqrt(2) * force, rel=1e-13)
    assert loco["tractive_effort_N"] == pytest.approx(25_127, rel=1e-3)
    assert loco["swaying_couple_N_m"] == pytest.approx(0.7 / np.sqrt(2) * force, rel=1e-13)
    assert loco["swaying_couple_N_m"] == pytest.approx(8797, rel=1e-3)
    assert loco["hammer_blow_N"] == pytest.approx(27_602, rel=6e-3)


def test_csv_has_a_row_an_order(dalembert: Dalembert) -> None:
    done = dalembert("engine", "-", "--speed", "3000rpm", "--order", "6", "--digits", stdin=SIX)
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    assert [row["order"] for row in rows] == list("123456")
    assert float(rows[1]["force_max_N"]) == 0
    assert {"force_y_cos_N", "couple_x_sin_N_m"} < set(rows[0])


def test_shafts_with_nothing_to_balance_are_named(dalembert: Dalembert) -> None:
    done = dalembert("engine", "-", "--speed", "3000rpm", "--shaft", "3:0mm:with", stdin=INLINE)
    assert "the shaft has nothing to balance" in done.stderr
    done = dalembert("engine", "-", "--speed", "3000rpm", "--shaft", "1:0mm:with", stdin=V8)
    assert "one shaft cannot balance it; add a second one" in done.stderr


@pytest.mark.parametrize("places", [["10mm"], ["10mm", "90mm"], ["90mm", "10mm"], ["0mm", "50mm", "90mm"]])
def test_rounding_is_nothing_for_a_shaft_to_balance(dalembert: Dalembert, places: list[str]) -> None:
    """Half of the reciprocating masses on the crank leave no first order that turns with it, and no couple."""
    rows = "1,17,33,7,45,150,530,410\n2,131,-71,-130,51,170,710,370\n3,-299,200,61,37,140,290,110\n"
    shafts = [word for z in places for word in ("--shaft", f"1:{z}:with")]
    done = dalembert(
        "engine",
        "-",
        "--speed",
        "3000rpm",
        "--counterweight-share",
        "0.5",
        *shafts,
        "--json",
        stdin=HEAD + rows,
    )
    result = json.loads(done.stdout)
    assert [shaft["unbalance_kg_m"] for shaft in result["shafts"]] == [0] * len(places)
    assert all("the shaft has nothing to balance" in text for text in result["warnings"])
    assert len(result["warnings"]) == len(places)
    against = engine(dalembert, HEAD + rows, "--counterweight-share", "0.5", "--shaft", "1:10mm:against")
    assert against["shafts"][0]["unbalance_kg_m"] > 1e-4


ROW = "1,0,90,0,45,150,500,400\n"
BAD = {
    "a short rod": (
        HEAD + "1,0,90,0,45,45,500,400\n",
        "column rod_mm: found '45', expected a rod that is longer",
    ),
    "no throw": (HEAD + "1,0,90,0,0,45,500,400\n", "column throw_mm: found '0', expected a positive length"),
    "a name twice": (
        HEAD + ROW + ROW,
        "row 2 (line 3), column cylinder: found '1', expected each cylinder once",
    ),
    "no mass": (HEAD + "1,0,90,0,45,150,0,0\n", "every mass is zero"),
    "a negative mass": (HEAD + "1,0,90,0,45,150,-5,0\n", "column reciprocating_g: found '-5'"),
    "no crank": ("throw_mm,rod_mm,reciprocating_g\n45,150,5\n", "no column crank_deg"),
    "no z": ("crank_deg,throw_mm,rod_mm,reciprocating_g\n0,45,150,5\n0,45,150,5\n", "no column z_m"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_cylinders(case: str, dalembert: Dalembert) -> None:
    table, message = BAD[case]
    done = dalembert("engine", "-", "--speed", "3000rpm", stdin=table)
    assert done.returncode == 1
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "expected the speed of the crankshaft"),
        (("--speed", "0rpm"), "positive"),
        (("--speed", "1rpm", "--shaft", "2:0mm"), "expected ORDER:Z:with or ORDER:Z:against"),
        (("--speed", "1rpm", "--shaft", "2:0mm:along"), "expected ORDER:Z:with or ORDER:Z:against"),
        (("--speed", "1rpm", "--shaft", "0:0mm:with"), "expected ORDER:Z:with or ORDER:Z:against"),
        (("--speed", "1rpm", "--shaft", "9:0mm:with"), "above the highest"),
        (("--speed", "1rpm", "--shaft", "2:0mm:with", "--shaft", "2:0m:with"), "at one place"),
        (("--speed", "1rpm", "--counterweight-share", "1.5"), "expected a number from 0 to 1"),
        (("--speed", "1rpm", "--plane", "A:60"), "--plane"),
    ],
)
def test_bad_options(options: tuple[str, ...], message: str, dalembert: Dalembert) -> None:
    done = dalembert("engine", "-", *options, stdin=HEAD + ROW)
    assert done.returncode == 2
    assert message in " ".join(done.stderr.split())


def test_counterweights_of_nothing(dalembert, tmp_path) -> None:
    (tmp_path / "one.csv").write_text("crank_deg,throw_mm,rod_mm,reciprocating_kg\n0,50,200,1\n")
    engine = ("engine", "one.csv", "--speed", "3000rpm")
    for option in (("--plane", "A:0mm:60mm"), ("--counterweight-share", "0")):
        assert "the counterweights are zero" in dalembert(*engine, *option).stderr
    assert "are zero" not in dalembert(*engine, "--counterweight-share", "0.5").stderr


def test_the_way_has_counterweights_shafts_and_residuals_in_numbers(dalembert, tmp_path) -> None:
    (tmp_path / "three.csv").write_text(
        "cylinder,crank_deg,z_mm,throw_mm,rod_mm,reciprocating_kg,rotating_kg\n"
        "1,0,0,50,200,1,0.2\n2,120,100,50,200,1,0.2\n3,240,200,50,200,1,0.2\n"
    )
    options = ("--counterweight-share", "0.5", "--shaft", "1:0mm:against", "--shaft", "1:300mm:against")
    result = json.loads(
        dalembert("engine", "three.csv", "--speed", "3000rpm", *options, "--steps", "--json").stdout
    )
    way = {topic["topic"]: topic for topic in result["way"]}
    weights = way["counterweights"]["counterweights"]
    assert weights[0] == {"counterweight": "1", "x_kg_m": pytest.approx(-0.035), "y_kg_m": 0.0, "z_m": 0.0}
    for shaft, shown in zip(result["shafts"], way["shafts"]["shafts"], strict=True):
        assert np.hypot(shown["x_kg_m"], shown["y_kg_m"]) == pytest.approx(shaft["unbalance_kg_m"])
    for row in way["residual"]["orders"]:
        whole = result["residual_orders"][row["order"] - 1]
        assert [row["y_cos_N"], row["y_sin_N"]] == whole["force_N"]["y"]
        assert [row["couple_y_cos_N_m"], row["couple_y_sin_N_m"]] == whole["couple_N_m"]["y"]
