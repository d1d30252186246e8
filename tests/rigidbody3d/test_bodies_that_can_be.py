"""Which moments a free body may have, what its motion loads, and that the order of questions changes nothing."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from dalembert.arithmetic.doubled_arrays import DoubledArray
from rigidbody3d import FreeBody, Motion


@pytest.mark.parametrize("moments", [[1, 2, 5], [5, 2, 1], [2, 5, 1], [1e-9, 2e-9, 5e-9], [1, 1, 2 + 1e-6]])
def test_no_body_has_a_moment_larger_than_the_other_two(moments: list[float]) -> None:
    with pytest.raises(ValueError, match="break the triangle inequality"):
        FreeBody(moments, [1.0, 0.1, 0.5])
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    tensor = turn @ np.diag(moments) @ turn.T
    with pytest.raises(ValueError, match="break the triangle inequality"):
        FreeBody((tensor + tensor.T) / 2, [1.0, 0.1, 0.5])


@pytest.mark.whole
@pytest.mark.parametrize(
    "moments", [[1, 2, 3], [0.1, 0.2, 0.1 + 0.2], [0.1, 0.7, 0.1 + 0.7], [1, 1, 2], [0, 1, 1]]
)
@pytest.mark.parametrize("size", [1e-12, 1, 1e12])
def test_flat_bodies_and_rods_are_bodies(moments: list[float], size: float) -> None:
    """0.1 + 0.2 is above 0.3 by rounding: so are the moments of a flat body."""
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    tensor = size * turn @ np.diag(moments) @ turn.T
    for one in (
        (size * np.array(moments), (tensor + tensor.T) / 2) if moments[0] else (size * np.array(moments),)
    ):
        assert np.isfinite(FreeBody(one, [1.0, 0.1, 0.5]).at(3.0).error_estimate()).all()


def test_a_flat_body_may_be_off_by_the_error_of_its_tensor() -> None:
    body = FreeBody(np.diag([1.0, 2.0, 3.0]), [1.0, 0.1, 0.5])
    # to 32 digits it breaks the triangle inequality
    exact = FreeBody(DoubledArray(np.diag([1.0, 2.0, 3.001])), [1.0, 0.1, 0.5])
    assert float(body.error_estimate("energy", exact)) > 1e-4


def test_a_body_of_revolution_needs_no_elliptic_functions() -> None:
    code = (
        "import sys\nfrom rigidbody3d import FreeBody\n"
        "state = FreeBody([1, 1, 2], [1.0, 0.1, 3.0]).at([0.0, 1.0])\nstate.omega, state.attitude, state.error_estimate()\n"
        "print([m for m in sys.modules if m.startswith('scipy')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("states", [1, 5, 20_000])
def test_the_order_of_questions_changes_no_digit(states: int) -> None:
    rng = np.random.default_rng(states)
    I = np.diag([1.0, 2.0, 2.5]) + 0.1
    w, alpha = rng.normal(size=(2, states, 3))
    first, second = Motion(I, w, alpha), Motion(I, w, alpha)
    momentum, rate = first.momentum, first.rate
    assert np.array_equal(second.rate, rate)
    assert np.array_equal(second.momentum, momentum)
    assert momentum == pytest.approx(w @ I, rel=1e-14, abs=1e-14)
    assert rate == pytest.approx(alpha @ I + np.cross(w, w @ I), rel=1e-12, abs=1e-12)
