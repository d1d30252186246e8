"""Limits and assemblies of any topology against a scan of all constraints (benchmarks.stress.assemblies)."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.stress.assemblies import one_input, wrong_assemblies, wrong_limits


def _limits(seeds: range) -> int:
    met = 0
    for seed in seeds:
        t = one_input(seed)
        if t is not None:
            assert wrong_limits(t) == [], f"seed {seed}"
            met += t.mechanism.check.input_limits is not None
    return met


def _assemblies(seeds: range) -> int:
    several = 0
    for seed in seeds:
        t = one_input(seed)
        # a gear of another tooth is another mechanism, not another assembly
        if t is not None and not t.mechanism.gears and len(t.mechanism.links) <= 4:
            assert wrong_assemblies(t, np.random.default_rng(seed)) == [], f"seed {seed}"
            several += len(t.mechanism.assemblies()) > 1
    return several


@pytest.mark.parametrize("seed", [19, 294])
def test_the_limit_of_a_slide_beyond_the_size_of_the_mechanism(seed: int) -> None:
    """Of 0.1.0: said to be infinitely far."""
    t = one_input(seed)
    assert t is not None
    assert t.mechanism.inputs[0].is_slide
    assert wrong_limits(t) == []
    low, high = t.mechanism.check.input_limits or (0.0, 0.0)
    assert max(t.inputs[0] - low, high - t.inputs[0]) > t.mechanism.size


def test_a_limit_on_one_side_alone() -> None:
    t = one_input(112)
    assert t is not None
    assert wrong_limits(t) == []
    assert t.mechanism.check.input_limits[1] == np.inf


def test_limits_are_where_a_scan_can_go_no_further() -> None:
    assert _limits(range(18)) > 2


def test_every_assembly_is_listed_and_closes() -> None:
    assert _assemblies(range(60)) > 2
