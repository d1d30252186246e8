"""The estimate of a link's rounding error where another loop of the same pose does not close, against 50 digits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest

from benchmarks.truth.mechanism import Exact
from virtualwork import Guess, Mechanism


@pytest.mark.parametrize("where", ["beyond the limit", "at the limit"])
def test_another_group_of_the_pose_takes_nothing_away(
    where: str, random_mechanism: Callable[..., Mechanism]
) -> None:
    """A Watt linkage whose second loop does not close, or only just: its four-bar errs as the four-bar alone does."""
    six = random_mechanism("Watt", np.random.default_rng(3))
    six = replace(six, ground=six.ground | {"A": six.ground["A"] + 1e-3})
    names = ("crank", "coupler", "rocker")
    guess = Guess(six.guess.at, {name: six.guess.angles[name] for name in names})
    four = replace(six, links={name: six.links[name] for name in names}, guess=guess)
    ends = [v for v in six.assembly.reach.limits() if v.group != six.assembly.plan.groups[0].name]
    assert len(ends) == 6
    if where == "at the limit":
        inputs = np.array([v.input + v.side * d for v in ends for d in (0.0, 1e-15, 1e-13, 1e-11, 1e-9)])
    else:
        inputs = np.linspace(0.0, 2 * np.pi, 61)
    whole, alone = six.motion(inputs, 1.0, 0.5), four.motion(inputs, 1.0, 0.5)
    rows = np.flatnonzero(
        alone.assembled & ~whole.assembled if where == "beyond the limit" else alone.assembled
    )
    assert len(rows) >= 9
    pairs = []
    exact = {i: Exact(alone, int(i)) for i in rows}
    for name in names[1:]:
        link = whole.link(name)
        for order, values in enumerate((link.angle, link.omega, link.alpha)):
            bound = link.error_estimate(order)
            np.testing.assert_allclose(bound[rows], alone.link(name).error_estimate(order)[rows], rtol=1e-9)
            for i in rows:
                error = abs(exact[i].angle(name, order) - mp.mpf(float(values[i])))
                pairs.append((float(error), bound[i]))
    assert all(error <= bound for error, bound in pairs)
    assert np.median([bound / error for error, bound in pairs if error > 0]) <= 100
