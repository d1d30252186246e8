"""README's test command draws the same random cases every time: a first run on a good checkout does not fail by chance."""

from __future__ import annotations

import pytest
from hypothesis import is_hypothesis_test


def test_every_property_of_the_quick_run_is_derandomized(request: pytest.FixtureRequest) -> None:
    if request.config.getoption("markexpr") == "slow":
        pytest.skip("the slow run draws anew")
    drawn = {
        item.nodeid.split("[")[0]: item.obj._hypothesis_internal_use_settings
        for item in request.session.items
        if isinstance(item, pytest.Function) and is_hypothesis_test(item.obj)
    }
    assert all(kept.derandomize and kept.database is None for kept in drawn.values()), drawn
