"""Bounds of formulas on arrays, against fractions: no error beyond them, and none of the lanes is mixed with another."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from dalembert.arithmetic import bounds as module
from dalembert.arithmetic.bounds import bounds, read

exact = np.vectorize(Fraction, otypes=[object])


def triple(sign, a, b, c):
    """Return a · (b × c) with a sign, and the vector."""
    across = np.cross(b, c)
    return (sign * (a * across).sum(axis=-1), across / 3)


@pytest.mark.parametrize("few", [0, 4096])
def test_many_lanes_and_few_against_fractions(few, monkeypatch) -> None:
    # written down as a tape, and swept on numbers
    monkeypatch.setattr(module, "FEW", few)
    rng = np.random.default_rng(3)
    b = rng.normal(size=(4, 1, 3))
    c = b + rng.normal(size=(4, 5, 3)) * 1e-6
    a = rng.normal(size=3)
    product, vector = bounds(triple, {"a": (a, 1, 0.0), "b": (b, 1, 0.0), "c": (c, 1, 0.0)}, -1.0)
    assert (product.shape, vector.shape) == ((4, 5), (4, 5, 3))
    found, true = triple(-1.0, a, b, c), triple(-1, exact(a), exact(b), exact(c))
    for number, bound in enumerate((product, vector)):
        off = np.abs(np.asarray(exact(found[number]) - true[number], dtype=float))
        assert (off <= bound).all()
        assert np.median(bound[off > 0] / off[off > 0]) < 30


def test_what_numbers_are_off_by_is_carried_on() -> None:
    x = np.array([2.0, 3.0])
    (own,) = bounds(lambda x: [x * x], {"x": (x, 0, 0.0)})
    (carried,) = bounds(lambda x: [x * x], {"x": (x, 0, [0.0, 1e-8])})
    (relative,) = bounds(lambda x: [x * x], {"x": read(x, 0, 1e-8)})
    # half a unit in the last place
    np.testing.assert_allclose(own, 0.5 * np.spacing(x * x), rtol=1e-5)
    np.testing.assert_allclose(carried - own, [0, 6e-8], rtol=1e-5, atol=1e-20)
    np.testing.assert_allclose(relative, 2e-8 * x * x, rtol=1e-5)


def test_a_complex_number_is_off_by_the_size_of_its_error() -> None:
    (both,) = bounds(lambda x, y: [x + 1j * y], {"x": (1.0, 0, 3e-8), "y": ([2.0], 0, 4e-8)})
    np.testing.assert_allclose(both, [5e-8], rtol=1e-5)
