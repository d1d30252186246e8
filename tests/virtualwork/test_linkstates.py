"""The balance of virtual power from plain arrays, against exact rational arithmetic."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from virtualwork.textbook.link_states import KINDS, LinkStates, UnitLoad
from virtualwork.textbook.power_balance import balance

numbers = st.floats(-1e3, 1e3).filter(lambda x: x == 0 or abs(x) > 1e-3)
pair = st.tuples(numbers, numbers)
positive = st.floats(1e-3, 1e3)
link = st.fixed_dictionaries(
    {
        "velocity": pair,
        "omega": numbers,
        "mass": positive,
        "inertia": positive,
        "acceleration": pair,
        "alpha": numbers,
        "force": pair,
        "point_velocity": pair,
        "torque": numbers,
    }
)


def states(links: list[dict[str, Any]], gravity: tuple[float, float]) -> LinkStates:
    columns: dict[str, Any] = {
        name: np.array([complex(*row[name]) if isinstance(row[name], tuple) else row[name] for row in links])
        for name in links[0]
    }
    return LinkStates(**columns, gravity=complex(*gravity))


def exact_power(row: dict[str, Any], gravity: tuple[float, float]) -> tuple[Fraction, Fraction]:
    """Return eq. (5) for one link in rational arithmetic, and the sum of the sizes of its products."""
    q = Fraction

    def dot(a: Any, b: Any) -> list[Fraction]:
        return [q(a[0]) * q(b[0]), q(a[1]) * q(b[1])]

    m = q(row["mass"])
    products = [
        *dot(row["force"], row["point_velocity"]),
        q(row["torque"]) * q(row["omega"]),
        *(m * part for part in dot(gravity, row["velocity"])),
        *(-m * part for part in dot(row["acceleration"], row["velocity"])),
        -q(row["inertia"]) * q(row["alpha"]) * q(row["omega"]),
    ]
    return sum(products, q(0)), sum(map(abs, products), q(0))


@given(st.lists(link, min_size=1, max_size=5), pair)
@settings(max_examples=50, deadline=None)
def test_power_is_that_of_equation_5(links: list[dict[str, Any]], gravity: tuple[float, float]) -> None:
    exact = [exact_power(row, gravity) for row in links]
    total, size = sum(e[0] for e in exact), sum(e[1] for e in exact)
    speeds = [
        max(abs(complex(*row["velocity"])), abs(complex(*row["point_velocity"])), abs(row["omega"]))
        for row in links
    ]
    loads = sum(
        abs(complex(*row["force"])) + abs(row["torque"]) + row["mass"] * abs(complex(*gravity))
        + row["mass"] * abs(complex(*row["acceleration"])) + row["inertia"] * abs(row["alpha"])
        for row in links
    )  # fmt: skip
    # a load that does no work but for rounding is left out: up to 8 ε of load times the largest velocity
    bound = 1e-14 * (float(size) + loads * max(speeds))
    assert abs(Fraction(float(states(links, gravity).power)) - total) <= bound


@given(st.lists(link, min_size=1, max_size=5), st.floats(0.1, 1e3))
@settings(max_examples=100, deadline=None)
def test_the_unknown_brings_the_sum_to_zero(links: list[dict[str, Any]], omega: float) -> None:
    table = states([{**links[0], "omega": omega}, *links], (0.0, -9.81))
    unit = np.zeros(len(links) + 1)
    unit[0] = 1.0
    found = balance(table, [UnitLoad(torque=unit)])
    if not found.determined[0]:
        assert abs(omega) < 1e-14 * max(abs(row["omega"]) for row in links)
        return
    largest = max([np.abs(term.power).max() for term in table.terms.values()], default=0.0)
    assert abs(found.sum[0]) <= 1e-14 * largest


def test_absent_kinds_are_not_multiplied_out() -> None:
    table = LinkStates(velocity=[1, 2j], omega=[3, 0], torque=[4, 0])
    assert list(table.terms) == ["applied torque"]
    assert set(table.terms) < set(KINDS)


def test_a_force_normal_to_its_velocity_does_no_work() -> None:
    # at 30° the product of normal vectors is not zero in floating point
    direction = np.exp(1j * np.radians(30.0))
    table = LinkStates(velocity=[direction], omega=[0.0], force=[1e3j * direction])
    term = table.terms["applied force"]
    assert term.workless.all()
    assert table.power == 0.0
    table = LinkStates(velocity=[direction, 0.0], omega=[0.0, 0.0], force=[direction, 5.0])
    assert table.terms["applied force"].workless.tolist() == [False, True]  # at a fixed support


def test_steps_are_one_call() -> None:
    rng = np.random.default_rng(1)
    n = 1000
    v, omega, force = rng.normal(size=(n, 3)) + 1j, rng.normal(size=(n, 3)), rng.normal(size=(n, 3)) - 2j
    many = balance(LinkStates(velocity=v, omega=omega, force=force), [UnitLoad(torque=[0, 1, 0])])
    one = balance(LinkStates(velocity=v[7], omega=omega[7], force=force[7]), [UnitLoad(torque=[0, 1, 0])])
    assert many.value.shape == (n, 1)
    assert many.value[7] == pytest.approx(one.value, rel=1e-15)


def test_an_unknown_that_does_no_work_spoils_no_other_step() -> None:
    table = LinkStates(velocity=np.zeros((2, 2)), omega=[[0, 1], [2, 1]], torque=[[0, 3], [0, 3]])
    found = balance(table, [UnitLoad(torque=[1, 0])])
    assert found.works[:, 0].tolist() == [False, True]
    assert np.isnan(found.value[0, 0])
    assert found.value[1, 0] == -1.5
    assert found.condition.tolist() == [np.inf, 1.0]


def test_several_unknowns_with_as_many_fields() -> None:
    rng = np.random.default_rng(2)
    for k in (2, 3, 4):
        v = rng.normal(size=(50, k, 5)) + 1j * rng.normal(size=(50, k, 5))
        omega = rng.normal(size=(50, k, 5))
        force = rng.normal(size=(50, 1, 5)) + 1j * rng.normal(size=(50, 1, 5))
        unknowns = [UnitLoad(torque=np.eye(5)[0]), *(UnitLoad(force=np.eye(5)[j] * 1j) for j in range(1, k))]
        found = balance(LinkStates(velocity=v, omega=omega, force=force), unknowns)
        assert found.determined.all()
        size = np.abs(found.unknown_power).max(axis=-1) + np.abs(found.power)
        assert (np.abs(found.sum) <= 1e-14 * size * found.condition[:, None]).all()


def test_dependent_fields_determine_what_they_can() -> None:
    # twice the same field: T of link 0 and F of link 1 are not told apart; F alone acts in a third
    v = np.array([[0, 1, 1], [0, 2, 2], [0, 0, 1]], dtype=complex)
    omega = np.array([[1, 0, 0], [2, 0, 0], [0, 0, 0]])
    unknowns = [UnitLoad(torque=[1, 0, 0]), UnitLoad(force=[0, 1, 0]), UnitLoad(force=[0, 0, 1])]
    table = LinkStates(velocity=v, omega=omega, force=[0, 5, 7])
    found = balance(table, unknowns)
    assert found.condition == np.inf
    assert found.determined.tolist() == [False, False, True]
    assert found.value[2] == pytest.approx(-7.0, rel=1e-13)
    # without a solution nothing is determined
    contradictory = LinkStates(velocity=v, omega=omega, torque=[[1, 0, 0], [0, 0, 0], [0, 0, 0]])
    assert not balance(contradictory, unknowns).determined.any()


def test_fields_must_be_as_many_as_unknowns() -> None:
    with pytest.raises(ValueError, match="2 unknowns need 2 velocity fields"):
        balance(
            LinkStates(velocity=np.ones((3, 2)), omega=[1, 1]),
            [UnitLoad(torque=[1, 0]), UnitLoad(torque=[0, 1])],
        )
