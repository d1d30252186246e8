"""Damaged inputs, short: never an exception, a warning of numpy's, half a file or a long wait."""

from __future__ import annotations

import time

import pytest

from benchmarks.fuzz import trial as fuzzed
from benchmarks.fuzz.trial import trial


@pytest.mark.slow
def test_damaged_inputs_are_handled(monkeypatch: pytest.MonkeyPatch) -> None:
    # a longest time says nothing on a machine that is shared: here only what does not end is a fault
    monkeypatch.setattr(fuzzed, "LONGEST", 60.0)
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
