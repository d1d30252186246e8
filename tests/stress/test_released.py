"""Random linkages released from rest: the error against the bodies' own coordinates, within the estimate."""

from __future__ import annotations

import pytest

from benchmarks.stress.campaigns import replay


# 36, 126 and 129 come near folding, where halves of steps gain less than elsewhere; of 122 the references of 1e-12 and
# 1e-10 agreed by chance, both 1e-13 off
@pytest.mark.parametrize(
    "seed", [36, 122, 126, 129, 0, *range(1, 36), *range(37, 122), *range(123, 126), *range(130, 240)]
)
def test_linkage_released(seed: int) -> None:
    for error, estimate in replay("released linkages", seed):
        assert error <= estimate
