"""Free rotation whose momentum begins in a plane of two principal axes: it leaves it again at once."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.truth.rotation import taylor
from rigidbody3d import FreeBody
from rigidbody3d.attitude import angle_between


@pytest.mark.parametrize("omega", [(1.0, 0.7, 0.0), (1.0, 0.0, 0.5), (0.0, 0.7, -1.0)])
def test_one_component_is_zero(omega: tuple[float, float, float]) -> None:
    body = FreeBody([1.0, 2.0, 2.5], omega, [0.5, 0.5, -0.5, 0.5])
    exact, q = taylor([1.0, 2.0, 2.5], omega, 3.0, [0.5, 0.5, -0.5, 0.5])
    state = body.at(3.0)
    np.testing.assert_allclose(state.omega, [float(x) for x in exact], atol=1e-14)
    wanted = np.array([float(x) for x in q])
    assert angle_between(state.attitude, wanted / np.linalg.norm(wanted)) < 1e-14
    assert np.abs(state.omega).min() > 1e-3
    assert np.isfinite(body.period)


def test_times_must_be_finite() -> None:
    body = FreeBody([1.0, 2.0, 3.0], [1.0, 0.1, 0.5])
    for bad in ([0.0, np.nan], np.inf):
        with pytest.raises(ValueError, match="finite"):
            body.at(bad)
    with pytest.raises(ValueError, match="one row"):
        body.at([[0.0], [1.0]])
