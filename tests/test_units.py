"""One table of units: what is taken anywhere is taken everywhere, exactly."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from dalembert.decimals import decimal_to_si, times
from dalembert.quantities import number_in_si, parse_quantity
from dalembert.units import LISTED, UNITS, composed, find_unit, from_si, to_si, unit_name, written
from virtualwork.describe import DescriptionError
from virtualwork.describe.units import Units

# NIST SP 811, appendix B: exact by definition
EXACT = {
    "in": Fraction(254, 10000),
    "ft": Fraction(3048, 10000),
    "lb": Fraction(45359237, 10**8),
    "oz": Fraction(45359237, 16 * 10**8),
    "kgf": Fraction(980665, 10**5),
    "lbf": Fraction(45359237, 10**8) * Fraction(980665, 10**5),
}


@pytest.mark.parametrize("word", EXACT)
def test_factors_are_those_of_the_definition(word: str) -> None:
    unit = composed(word)
    assert unit is not None
    (num, den), _ = unit
    assert Fraction(num) / Fraction(den) == EXACT[word]


def test_slug_and_blob_are_what_a_pound_force_accelerates() -> None:
    slug, blob = composed("slug"), composed("blob")
    assert slug is not None
    assert blob is not None
    assert Fraction(slug[0][0]) / Fraction(slug[0][1]) == EXACT["lbf"] / EXACT["ft"]
    assert Fraction(blob[0][0]) / Fraction(blob[0][1]) == EXACT["lbf"] / EXACT["in"]


@pytest.mark.parametrize(
    ("text", "dimension", "si"),
    [
        ("0.4ft", "length", 0.12192),
        ("0.1rev", "angle", 0.2 * math.pi),
        ("700 1/min", "speed", 700 * math.pi / 30),
        ("700 U/min", "speed", 700 * math.pi / 30),
        ("2 kN", "force", 2000.0),
        ("1 slug", "mass", 14.593902937206364),
        ("4 N/mm", "stiffness", 4000.0),
        ("30 g.mm", "unbalance", 3e-5),
        ("700 RPM", "speed", 700 * math.pi / 30),
        ("2 Kg", "mass", 2.0),
        ("3 m·s⁻¹", "velocity", 3.0),
        ("4 rads s⁻²", "angular acceleration", 4.0),
        ("5 kgfm", "torque", 49.03325),
        ("-3 °", "angle", -3 * math.pi / 180),
        ("−3 mm", "length", -0.003),
    ],
)
def test_options_tables_and_files_take_the_same_units(text: str, dimension: str, si: float) -> None:
    from dalembert.quantities import parse_quantity

    assert number_in_si(text, dimension) == pytest.approx(si, rel=4e-16)
    assert Units({}).number(text, dimension, "x") == pytest.approx(si, rel=4e-16)
    number, unit = parse_quantity(text, dimension)
    assert to_si(number, dimension, unit) == pytest.approx(si, rel=4e-16)


@pytest.mark.parametrize(
    ("text", "dimension"),
    [
        ("4 N m", "stiffness"),
        ("3 kg", "length"),
        ("5 rad", "length"),
        ("2 mm s", "velocity"),
        ("1e99 m", "length"),
    ],
)
def test_other_dimensions_are_refused(text: str, dimension: str) -> None:
    with pytest.raises(DescriptionError, match="expected"):
        Units({}).number(text, dimension, "x")


@pytest.mark.parametrize("dimension", [d for d in LISTED if d not in ("number", "amplitude", "per")])
def test_a_unit_as_people_write_it_is_the_unit(dimension: str) -> None:
    for unit in LISTED[dimension]:
        assert find_unit(dimension, unit_name(written(unit))) == unit
        assert find_unit(dimension, unit.upper()) == unit


def test_what_is_looked_up_does_not_change_the_table() -> None:
    before = {dimension: list(units) for dimension, units in UNITS.items()}
    assert find_unit("length", "km") == "km"
    assert find_unit("length", "furlong") is None
    assert before == {dimension: list(units) for dimension, units in UNITS.items()}


@pytest.mark.parametrize(
    "suffix", ["T", "FT", "REV", "LBF_FT", "KN_MM", "N_MM", "kn_m", "MM", "SLUG", "N/MM2"]
)
def test_the_case_of_a_header_does_not_matter_where_small_letters_are_a_unit(suffix: str) -> None:
    """Headers in capitals, as old machines print them; a prefix that only a capital can mean stays unknown."""
    small = {d for d in UNITS if find_unit(d, suffix.lower())}
    assert {d for d in UNITS if find_unit(d, suffix)} == small
    assert (small == set()) == (suffix in ("KN_MM", "N/MM2"))


@pytest.mark.parametrize(
    ("text", "dimension", "unit"),
    [
        ("3 Nm", "torque", "N_m"),
        ("3kNm", "torque", "kN_m"),
        ("4 Nm/rad", "torsional stiffness", "N_m_per_rad"),
        ("5 Nms/rad", "torsional damping", "N_m_s_per_rad"),
        ("2 gmm", "unbalance", "g_mm"),
        ("3 kgm²", "inertia", "kg_m2"),
        ("2 inches", "length", "in"),
        ("90 degrees", "angle", "deg"),
        ("5 lbs", "mass", "lb"),
        ("7 radians/sec", "speed", "rad_s"),
    ],
)
def test_units_as_people_write_them(text: str, dimension: str, unit: str) -> None:
    assert parse_quantity(text, dimension)[1] == unit


@pytest.mark.parametrize(("text", "dimension"), [("2 gm", "mass"), ("3 NM", "torque"), ("20 1/s", "speed")])
def test_units_of_two_meanings_are_refused(text: str, dimension: str) -> None:
    """Grams or g·m, newton or nautical, rad/s or Hz."""
    with pytest.raises(ValueError, match="unknown"):
        parse_quantity(text, dimension)


@pytest.mark.whole
@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("oz-in", "oz_in"),
        ("N-m", "N_m"),
        ("º", "deg"),
        ("µm pk-pk", "um_pp"),
        ("µm p-p", "um_pp"),
        ("mm/s RMS", "mm_s_rms"),
        ("mm/s r.m.s.", "mm_s_rms"),
        ("mil pk", "mil_pk"),
        ("mm/s 0-p", "mm_s_pk"),
    ],
)
def test_spellings_of_instruments(text: str, name: str) -> None:
    assert unit_name(text) == name


def test_a_unit_as_people_write_it_is_read_again() -> None:
    for dimension in ("length", "unbalance", "amplitude", "speed", "torque", "density"):
        for unit in UNITS[dimension]:
            assert unit_name(written(unit)) == unit


@pytest.mark.parametrize(
    "unit", ["km/h", "m/min", "mm/s", "m/s²", "rad/s²", "N·m", "kg·m²", "kg·m²/s", "g·mm", "°/s"]
)
def test_what_stands_below_a_stroke_stays_there(unit: str) -> None:
    """A sheet asked for km·h."""
    assert written(unit_name(unit)) == unit


RATIOS = sorted(
    {factor for units in UNITS.values() for factor in units.values() if isinstance(factor[0], int)}
)


def decimals_of(figures: int, seed: int) -> list[Fraction]:
    import random

    draw = random.Random(seed)
    numbers = [Fraction(draw.randrange(10**figures), 10 ** draw.randrange(figures + 4)) for _ in range(400)]
    return [*numbers, *(-x for x in numbers), Fraction(0)]


@pytest.mark.parametrize("figures", [1, 3, 6, 12, 15])
@pytest.mark.parametrize("ratio", [r for r in RATIOS if isinstance(r[1], int)])
def test_a_decimal_is_converted_with_one_rounding_alone_and_in_a_column(
    ratio: tuple[int, int], figures: int
) -> None:
    numbers = decimals_of(figures, seed=figures)
    right = [float(x * Fraction(*ratio)) for x in numbers]
    values = [float(x) for x in numbers]
    assert times(np.array(values), *ratio).tolist() == right
    assert [times(x, *ratio) for x in values] == right
    assert times(np.array(values) * 1j, *ratio).imag.tolist() == right
    assert [decimal_to_si(repr(x), ratio) for x in values] == right


@pytest.mark.parametrize(
    ("dimension", "unit", "figures"),
    [("mass", unit, figures) for unit in ("g", "mg", "t") for figures in (1, 3, 6, 12)]
    + [
        (*of, figures)
        for of in (("force", "lbf"), ("mass", "oz"), ("unbalance", "oz_in"), ("length", "in"))
        for figures in (1, 3, 8)
    ],
)
def test_a_decimal_comes_back_as_it_was_written(dimension: str, unit: str, figures: int) -> None:
    values = np.array([float(x) for x in decimals_of(figures, seed=7) if abs(x) < 10**9])
    stored = to_si(values, dimension, unit)
    assert from_si(stored, dimension, unit).tolist() == values.tolist()
    assert [from_si(x, dimension, unit) for x in stored.tolist()] == values.tolist()
    turned = from_si((stored * (1 + 1j))[::-1], dimension, unit)
    assert turned.real.tolist() == turned.imag.tolist() == values[::-1].tolist()


def test_numbers_of_computations_and_no_numbers_keep_their_floats() -> None:
    third = np.array([1 / 3, -0.0, math.nan, math.inf, 1e300, 1e-300, 2.0**52 + 1])
    for many, one in zip(times(third, 1, 1000).tolist(), third.tolist(), strict=True):
        assert repr(many) == repr(times(one, 1, 1000)) == repr(one / 1000)
    assert times(np.array([]), 1, 1000).shape == (0,)
    assert times(np.array([[7.1]]), 1, 1000).tolist() == [[0.0071]]
