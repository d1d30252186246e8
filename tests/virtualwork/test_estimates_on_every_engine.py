"""Estimates of rounding are the same one by one and together, and on every engine."""

from __future__ import annotations

import numpy as np
import pytest

from tests.virtualwork.test_rounding import example, heavy
from virtualwork.digits.estimates import Estimates
from virtualwork.formulas.forces import Effort, Shaking
from virtualwork.formulas.loops import Margin
from virtualwork.formulas.tapes import taped


@pytest.mark.parametrize("poses", [1, 40, 5000])
@pytest.mark.parametrize("name", ["stephenson-six-bar", "engine", "two-disc-four-bar"])
def test_together_bounds_are_what_they_are_one_by_one(name: str, poses: int) -> None:
    """A few on numbers, many on a tape; groups without a closed form, slides, loads."""
    m = example(name)
    last = list(m.links)[-1]
    names = [f"links.{last}.{k}" for k in ("angle", "omega", "alpha")] + ["effort", "shaking.force"]
    names += [f"points.{point}.acceleration" for point in m.links[last].points]
    q = m.at[0] + np.linspace(-0.02, 0.03, poses)
    together = m.motion(q, 3.0, 1.0).error_estimates(*names)
    assert list(together) == names
    for one in names:
        alone = m.motion(q, 3.0, 1.0).error_estimates(one)[one]
        assert alone.shape == (poses,)
        assert np.isfinite(alone).all()
        np.testing.assert_allclose(together[one], alone, rtol=1e-9)
    assert (together["effort"] == m.motion(q, 3.0, 1.0).dynamics.error_estimate().effort[:, 0]).all()


@pytest.mark.parametrize("name", ["klann", "engine", "quick-return"])
def test_every_engine_has_the_same_estimates(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the same answers: doubled numbers as they stand, and the tape of what they do by numpy and compiled."""
    pytest.importorskip("llvmlite")
    monkeypatch.setattr("dalembert.arithmetic.engines.doubled.PAYS", 0.0)
    m = heavy(example(name))
    q = m.at[0] + np.linspace(-0.02, 0.03, 40)
    monkeypatch.setenv("DALEMBERT_ENGINE", "numpy")
    motion = m.motion(q, 3.0, 1.0)
    last = list(m.links)[-1]
    keys = [motion.link(last).key(k) for k in (0, 1, 2)] + [Effort(0), Shaking()]
    values = dict(zip(keys, motion.values(keys), strict=True))
    found = {}
    for engine in ("python", "numpy", "llvm"):
        monkeypatch.setenv("DALEMBERT_ENGINE", engine)
        estimates = Estimates(motion.poses, lambda keys: [values[key] for key in keys])
        estimates.together(keys)
        found[engine] = [estimates.of(key) for key in keys]
    for key, *each in zip(keys, *found.values(), strict=True):
        for other in each[1:]:
            np.testing.assert_allclose(other, each[0], rtol=1e-9, err_msg=str(key))


def test_what_is_not_asked_for_is_not_computed_twice() -> None:
    """The second run of one point costs less than that of all: counted in operations, margins of its own groups alone."""
    m = example("klann")
    motion = m.motion(np.linspace(0.0, 1.0, 5), 3.0, 1.0)
    branch, exact = motion.rounding.branch, motion.rounding.second.exact
    few, all_ = (
        taped(branch, exact, tuple(motion.point(name).key(2) for name in names)).cost
        for names in (("B",), m.points)
    )
    assert 5 * few < all_

    def margins() -> set[str]:
        tapes = [key[1] for key in branch.recordings if key[0] is exact]
        return {of.group for keys in tapes for of in keys if isinstance(of, Margin)}

    motion.point("B").error_estimate()
    assert not margins()
    motion.point("H").error_estimate()
    assert len(margins()) == 2
