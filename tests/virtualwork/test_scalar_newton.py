"""Newton and Raphson for one equation, as the third document has it: the table, and where it fails."""

from __future__ import annotations

import math

import numpy as np
import pytest

import dalembert
from virtualwork import newton


def test_the_root_of_two_and_its_mirror_image() -> None:
    for guess, root in ((1.0, math.sqrt(2)), (-1.0, -math.sqrt(2))):
        table = newton(lambda x: x * x - 2, guess)
        assert table.root == pytest.approx(root, rel=1e-15)
        for row, following in zip(table.rows, table.rows[1:], strict=False):
            assert row.slope == 2 * row.x
            assert following.x == row.x - row.f / row.slope


def test_the_angle_of_a_crank_by_one_equation() -> None:
    """The position of an in-line slider-crank, r = 1, l = 3: at which crank angle is x = 3?"""

    def f(q):
        return np.cos(q) + np.sqrt(9 - np.sin(q) ** 2) - 3

    table = newton(f, 1.0)
    assert f(table.root) == pytest.approx(0, abs=1e-15)
    # cosine rule: 1 + 9 − 6 cos γ with x = 3: cos q = (x² + 1 − 9)/(2x)
    assert math.cos(table.root) == pytest.approx(1 / 6)
    given = newton(
        f, 1.0, derivative=lambda q: -np.sin(q) - np.sin(q) * np.cos(q) / np.sqrt(9 - np.sin(q) ** 2)
    )
    assert given.root == pytest.approx(table.root, rel=1e-15)


def test_what_does_not_converge_is_no_answer() -> None:
    cases = (
        (lambda x: x * x + 1, None, 0.5, "after 50 steps"),
        (lambda x: x * x + 1, None, 1.0, "meets no axis"),
        (np.cbrt, lambda x: 1 / (3 * np.cbrt(x) ** 2), 1.0, "after 50 steps"),
    )
    for f, slope, guess, reason in cases:
        table = newton(f, guess, derivative=slope)
        assert math.isnan(table.root)
        assert reason in table.reason
    assert newton(lambda x: x, 0.0).root == 0.0


@pytest.mark.parametrize(
    ("f", "guess"),
    [
        (lambda x: 1 / (x - 1), math.nextafter(1, 2)),
        (lambda x: 1 / (x - 1), math.nextafter(1, 0)),
        (lambda x: 1 / (x - 3) ** 2, math.nextafter(3, 4)),
        (np.tan, math.pi / 2),
        (lambda x: np.exp(-x), 800.0),  # zero by underflow alone
        (lambda x: 0 * x, 3.0),
    ],
)
def test_a_pole_and_a_flat_stretch_are_no_root(f, guess) -> None:
    table = newton(f, guess)
    assert math.isnan(table.root)
    assert "|f| does not grow on both sides" in table.reason


def test_a_wrong_derivative_makes_no_root() -> None:
    assert not newton(lambda x: x - 2, 3.0, derivative=lambda x: 1e300).converged


@pytest.mark.parametrize(
    ("f", "slope", "guess", "reason"),
    [
        (lambda x: 1 / x, None, 0.0, "x1 = 0: float division by zero"),
        (math.log, lambda x: 1 / x, 3.0, "x2 = -0.295837: "),
        (lambda x: x**0.5, lambda x: 0.5 / abs(x) ** 0.5, -4.0, "x1 = -4: f is not real there"),
        (lambda x: x * math.nan, None, 1.0, "not finite"),
        (lambda x: x**3 - 2 * x + 2, None, 0.0, "after 50 steps"),  # 0, 1, 0, 1, …
    ],
)
def test_where_f_has_no_number_the_table_ends_with_the_reason(f, slope, guess, reason) -> None:
    table = newton(f, guess, derivative=slope)
    assert math.isnan(table.root)
    assert reason in table.reason


def test_roots_at_once_at_an_end_and_double_ones_are_found() -> None:
    assert newton(lambda x: x * x, 0.0).root == 0.0
    assert newton(np.cbrt, 0.0, derivative=lambda x: math.inf).root == 0.0
    assert newton(lambda x: (x - 1) ** 2, 2.0).root == pytest.approx(1, rel=1e-14)
    assert newton(lambda x: (x - 1) * np.sqrt(x - 1), 2.0, limit=90).root == pytest.approx(1, rel=1e-14)


def test_near_a_root_where_f_is_rounding_alone_the_derivative_is_still_taken() -> None:
    rng = np.random.default_rng(3)
    for a, b, c in rng.normal(size=(200, 3)):
        table = newton(lambda x: a * np.cos(x) + b * np.sin(2 * x) + c * x, c)  # noqa: B023
        if table.converged:
            size = max(abs(a), abs(b), abs(c * table.root))
            x = table.root
            assert abs(a * math.cos(x) + b * math.sin(2 * x) + c * x) < 1e-12 * size * max(1, abs(x))


def test_bounds_of_the_iteration_that_mean_nothing() -> None:
    for name in ("limit", "accuracy"):
        with pytest.raises(ValueError, match=name):
            newton(np.cos, 1.0, **{name: -1})


@pytest.mark.parametrize("f", [abs, lambda x: x ** (1 / 3) if np.iscomplexobj(x) else np.cbrt(x), math.cos])
def test_a_function_without_a_complex_neighbourhood_needs_its_derivative(f) -> None:
    with pytest.raises(ValueError, match="derivative"):
        newton(f, -2.0)


def test_a_function_of_floats_alone_needs_its_derivative() -> None:
    with pytest.raises(ValueError, match="derivative"):
        newton(math.cos, 1.0)
    assert newton(math.cos, 1.0, derivative=lambda x: -math.sin(x)).root == pytest.approx(math.pi / 2)
    with pytest.raises(ValueError, match="finite"):
        newton(math.cos, math.nan)


def test_the_front_door_has_it_and_prints_its_table() -> None:
    table = dalembert.newton(lambda x: np.cos(x) - x, 1.0)
    assert "root 0.739085133215" in repr(table)
    assert list(table.to_frame().columns) == ["x", "f", "slope", "step"]
