"""The nearest tensor that a body can have, against a general optimizer and against many draws."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from rigidbody3d.inertia import check, nearest, second_moments


@pytest.mark.parametrize("seed", range(8))
def test_no_tensor_of_a_body_is_nearer(seed: int) -> None:
    """Every body's second moments are L Lᵀ: the least distance over L by quasi-Newton, which knows no cone."""
    draw = np.random.default_rng(seed)
    A = draw.normal(size=(3, 3))
    I = A + A.T + draw.uniform(-1, 3) * np.eye(3)
    found = nearest(I)
    assert check(found, rtol=1e-12).valid

    def distance(entries: np.ndarray) -> float:
        L = entries.reshape(3, 3)
        S = L @ L.T
        return float(((np.trace(S) * np.eye(3) - S - I) ** 2).sum())

    best = min(
        minimize(distance, draw.normal(size=9), method="BFGS", options={"gtol": 1e-10, "maxiter": 4000}).fun
        for _ in range(3)
    )
    assert ((found - I) ** 2).sum() == pytest.approx(best, rel=1e-6, abs=1e-9)


def test_a_bodys_tensor_is_its_own_nearest() -> None:
    I = np.array([[2.0, -0.3, 0.1], [-0.3, 3.0, 0.2], [0.1, 0.2, 4.0]])
    assert (nearest(I) == I).all()
    assert np.trace(second_moments(I)) == pytest.approx(np.trace(I) / 2)


def test_nothing_but_a_tensor_is_taken() -> None:
    with pytest.raises(ValueError, match="3 x 3"):
        nearest([1, 2, 3])
    with pytest.raises(ValueError, match="symmetric"):
        nearest([[1, 2, 0], [0, 1, 0], [0, 0, 1]])
