"""Every stress campaign, short: errors within the program's own estimates, and the estimates not idle."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.stress.campaigns import Tally, campaigns, run

pytestmark = pytest.mark.slow

TALLIES: dict[str, Tally] = {}


@pytest.mark.parametrize("name", campaigns())
def test_campaign(name: str) -> None:
    tally = None
    # where others use the processor too, a few trials may take longer
    for seconds in (60.0 / len(campaigns()), 15.0):
        for tally in run(name, seconds):
            if tally.trials >= 400:
                break
        assert tally is not None
        if len(tally.ratios) >= 3:
            break
    assert tally is not None
    TALLIES[name] = tally
    print(
        f"{name}: {tally.trials} trials, worst {tally.worst:.3g} of the estimate, seed {tally.seed}, "
        f"slack {tally.slack:.3g}"
    )
    assert len(tally.ratios) >= 3
    # of a few hundred answers one may lie beyond: 99.9 % of them is asked of long runs
    beyond = sum(ratio > 1 for ratio in tally.ratios)
    assert beyond <= 1 + len(tally.ratios) // 1000, f"replay with seed {tally.seed}"
    assert tally.worst < 2, f"replay with seed {tally.seed}"


def test_the_estimates_are_near_the_errors() -> None:
    """The median estimate, over all campaigns, is within a factor of 100 of the error."""
    if len(TALLIES) < len(campaigns()):
        pytest.skip("needs all the campaigns, in this process, before it")
    medians = [tally.slack for tally in TALLIES.values()]
    assert np.median(medians) <= 100
    # a stiff motion comes to rest: its error dies away, and the largest so far is what the estimate keeps
    assert max(tally.slack for name, tally in TALLIES.items() if name != "stiff oscillator in time") <= 1000
