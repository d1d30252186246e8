"""Quantities of many poses, each pose by the formulas on floats, as a truth for tapes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.quantity import Quantity
from virtualwork.motion import Motion


def pose_by_pose(
    motion: Motion, keys: Sequence[Quantity], rows: Sequence[int] | NDArray[Any] | None = None
) -> list[Any]:
    """The quantities of some poses, (rows,) each."""
    of = motion.poses
    found = []
    for i in range(of.n) if rows is None else rows:
        rates = [[float(rate[i]) if np.ndim(rate) else rate for rate in rates] for rates in of.rates]
        one: Lanes = of.again(of.inputs[i : i + 1], rates)
        one.time = None if of.time is None else of.time[i : i + 1]
        found.append(one.values(keys))
    return [np.concatenate(column) for column in zip(*found, strict=True)]
