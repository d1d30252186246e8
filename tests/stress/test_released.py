"""Random linkages released from rest: the error against the bodies' own coordinates, within the estimate."""

from __future__ import annotations

import pytest

from benchmarks.stress.campaigns import replay


def _holds(seed: int) -> None:
    for error, estimate in replay("released linkages", seed):
        assert error <= estimate


# 36, 126 and 129 come near folding, where halves of steps gain less than elsewhere; of 122 the references of 1e-12 and
# 1e-10 agreed by chance, both 1e-13 off
@pytest.mark.parametrize("seed", [36, 122, 126, 129])
def test_linkage_released_where_an_estimate_was_too_small(seed: int) -> None:
    _holds(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(80))
def test_linkage_released(seed: int) -> None:
    _holds(seed)
