"""Variants in parts of fixed size, worked out here or by processes: no number hangs on how many there are."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from typing import Any, NamedTuple

from cli.errors import DataError
from cli.mechanism.asked import Said
from cli.mechanism.variants import Variants
from cli.read.options import processes
from cli.show.progress import progress
from dalembert.arithmetic.parts import LostPart, in_parts


class Solved(NamedTuple):
    """What a part gives: what is written of its table, or its documents."""

    found: Any
    said: Said


def solved(function: Any, variants: Variants, each: int, workers: int, said: Said) -> Iterator[Any]:
    """What a function of (first, values) gives of all parts, in their order, each of so many variants.

    What it says of them is added to `said`.
    """
    count = variants.count
    starts = range(0, count, each)
    work = ((a + 1, variants.part(a, a + each)) for a in starts)
    workers = min(workers, len(starts))
    with processes(workers) as pool:
        try:
            with closing(in_parts(function, work, pool, 2 * workers)) as parts:
                for found, its in progress(parts, count, "variants", each):
                    said.join(its)
                    yield found
        except LostPart as lost:
            first, last = (lost.number - 1) * each + 1, min(lost.number * each, count)
            raise DataError(
                f"variants {first} to {last}: the process that solved them died, and died again when it was done once more"
            ) from None
