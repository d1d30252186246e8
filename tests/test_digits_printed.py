"""`--digits`: the digits that are printed are those of the exact number, and nearly all of them."""

from __future__ import annotations

import random
from decimal import Decimal

import pytest

from dalembert.results.columns import Column, Table
from dalembert.results.digits import digits_that_hold


def printed(value: float, error: float) -> float:
    table, _ = digits_that_hold(Table([Column("x", "", [value], error=lambda: [error])]))
    (cell,) = table.columns[0].values
    return float(cell)  # type: ignore[arg-type]


def figures(value: float) -> int:
    return len(Decimal(repr(value)).normalize().as_tuple().digits)


@pytest.mark.parametrize(
    ("value", "error", "digits"),
    [
        (2.0, 0.0, 2.0),
        (1.26, 0.1, 1.0),
        (1.26, 0.01, 1.3),
        (1.25, 0.01, 1.0),
        (-1.26, 0.01, -1.3),
        (9.99, 0.02, 10.0),
        (0.4, 0.5, 0.0),
        # the double beside 9870.62255492673218…, less than half its last place away
        (9870.622554926733, 7.3e-13, 9870.62255492673),
        # a double does not tell its seventeenth digit, and the sixteenth is not sure
        (2.8546374847052385, 8e-17, 2.85463748470524),
    ],
)
def test_one_number(value: float, error: float, digits: float) -> None:
    assert printed(value, error) == digits


def test_random_numbers() -> None:
    """Of 3000 numbers none has a digit that the exact one has not; of what both have in common half a digit is lost."""
    draw, lost = random.Random(3), []
    for _ in range(3000):
        exact = Decimal(draw.randint(10**29, 10**30 - 1)).scaleb(-29 + draw.randint(-3, 3))
        value = float(exact) * (1 + draw.uniform(-1, 1) * 10 ** draw.uniform(-17.5, -3))
        error = float(abs(Decimal(value) - exact)) * draw.uniform(1.0, 1.05) + 1e-40
        shown = Decimal(repr(printed(value, error))).normalize()
        if not shown:
            continue
        assert abs(shown - exact) <= Decimal("0.5000001").scaleb(int(shown.as_tuple().exponent)), (
            exact,
            value,
        )
        common = [k for k in range(17) if f"{Decimal(value):.{k}e}" == f"{exact:.{k}e}"]
        lost.append(max(common, default=-1) + 1 - figures(float(shown)))
    assert sorted(lost)[len(lost) // 2] <= 0
    assert sum(lost) / len(lost) < 0.6
