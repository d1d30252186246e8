"""Damaged inputs, short: never an exception, a warning of numpy's, half a file or a long wait."""

from __future__ import annotations

import time

import pytest

from benchmarks.fuzz.trial import trial


@pytest.mark.slow
def test_damaged_inputs_are_handled() -> None:
    end = time.monotonic() + 12
    faults = []
    for seed in range(100_000):
        outcome = trial(seed)
        if outcome.fault:
            faults.append((seed, outcome))
        if time.monotonic() > end:
            break
    print(f"{seed + 1} damaged inputs")
    assert seed >= 20
    assert not faults, faults[:5]
