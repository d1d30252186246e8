"""Every stress campaign, short: errors within the program's own estimates, and the estimates not idle."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from benchmarks.stress.campaigns import Tally, campaigns, run

pytestmark = pytest.mark.slow


@pytest.fixture(scope="session")
def slacks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which every process of this run leaves how near its campaigns' estimates are."""
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "slacks"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.mark.parametrize("name", campaigns())
def test_campaign(name: str, slacks: Path) -> None:
    """Errors lie within their estimates; once all have run, the median estimate is within a factor of 100 of the error."""
    tally: Tally | None = None
    # where others use the processor too, a few trials may take longer
    for seconds in (60.0 / len(campaigns()), 15.0):
        for tally in run(name, seconds):
            if tally.trials >= 400:
                break
        assert tally is not None
        if len(tally.ratios) >= 3:
            break
    assert tally is not None
    print(
        f"{name}: {tally.trials} trials, worst {tally.worst:.3g} of the estimate, seed {tally.seed}, "
        f"slack {tally.slack:.3g}"
    )
    assert len(tally.ratios) >= 3
    # of a few hundred answers one may lie beyond: 99.9 % of them is asked of long runs
    beyond = sum(ratio > 1 for ratio in tally.ratios)
    assert beyond <= 1 + len(tally.ratios) // 1000, f"replay with seed {tally.seed}"
    assert tally.worst < 2, f"replay with seed {tally.seed}"
    # a stiff motion comes to rest: its error dies away, and the largest so far is what the estimate keeps
    assert tally.slack <= 1000 or name == "stiff oscillator in time"
    (slacks / str([*campaigns()].index(name))).write_text(repr(tally.slack))
    every = [float(file.read_text() or "nan") for file in slacks.iterdir()]
    if len(every) == len(campaigns()):
        assert np.nanmedian(every) <= 100
