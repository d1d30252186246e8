"""Every stress campaign, short: errors within the program's own estimates, and the estimates not idle."""

from __future__ import annotations

import pytest

from cli.bench.stress import campaigns, run


@pytest.mark.parametrize("name", campaigns())
def test_campaign(name: str) -> None:
    tally = None
    for tally in run(name, 1.5):
        if tally.trials >= 400:
            break
    assert tally is not None
    print(
        f"{name}: {tally.trials} trials, worst {tally.worst:.3g} of the estimate, seed {tally.seed}, slack {tally.slack:.3g}"
    )
    assert tally.trials >= 20
    assert tally.bounded >= 0.999, f"worst {tally.worst:.3g} of the estimate: replay with seed {tally.seed}"
    assert tally.slack <= 100
