"""Estimates of rounding errors by computing twice, over many answers: as large as the errors, and hardly larger.

`DALEMBERT_TESTS_ANSWERS=1000000` asks for so many answers; a share of them comes of every campaign.
"""

from __future__ import annotations

import os

import numpy as np
import pytest

from benchmarks.stress.campaigns import campaigns

ANSWERS = int(os.environ.get("DALEMBERT_TESTS_ANSWERS", "12000"))
# of each campaign its share of the answers: those against 50 digits cost a hundred times more than sweeps
SHARES = {
    "sweeps beside limits": 0.8,
    "toothed": 0.08,
    "redundant platforms": 0.01,
    "near dead points": 0.01,
    "near change points": 0.01,
    "slider-cranks": 0.02,
    "turning blocks": 0.02,
    "geared five-bars": 0.02,
    "forces near dead points": 0.01,
    "any topology": 0.01,
    "loaded mechanisms of any topology": 0.02,
    "near-singular triads": 0.01,
}


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", list(SHARES))
def test_no_error_is_larger_than_its_estimate(name: str, first_seed: int) -> None:
    trial = campaigns()[name][1]
    wanted, seed = max(100, int(SHARES[name] * ANSWERS)), first_seed
    errors: list[float] = []
    estimates: list[float] = []
    worst = 0.0, -1
    missed = 0
    while len(errors) < wanted:
        for error, estimate in trial(np.random.default_rng(seed)):
            errors.append(error)
            estimates.append(estimate)
            missed += not error <= estimate
            worst = max(worst, (error / estimate if estimate else 0.0, seed))
        seed += 1
    over = np.divide(estimates, errors, out=np.ones(len(errors)), where=np.array(errors) > 0)
    print(f"{name}: {len(errors)} answers, {missed} missed, worst {worst}, median {np.median(over):.4f}")
    assert missed <= 1e-4 * len(errors), worst
    assert np.median(over) <= 2
    if name == "sweeps beside limits":
        # from 1 rad to 1e-9 rad from a limit
        assert np.quantile(over, 0.999) <= 4
