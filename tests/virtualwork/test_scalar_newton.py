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
