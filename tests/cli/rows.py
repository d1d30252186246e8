"""Rows of variants, as the commands send them to the functions that solve them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cli.cases.inputs import Axis, Varied
from dalembert.written import ROWS


def rows(names: Sequence[Varied], shown: ArrayLike) -> NDArray[Any]:
    """Numbers as they are shown, (rows, names) or (names,)."""
    numbers = np.asarray(shown, dtype=float)
    result = np.zeros(numbers.shape, dtype=ROWS)
    result["shown"] = numbers
    result["si"] = np.where([name.unit == "deg" for name in names], np.radians(numbers), numbers)
    return result


def axis(names: Sequence[Varied], shown: ArrayLike) -> Axis:
    """The axis of a table of such rows."""
    return Axis("--cases", tuple(names), rows=rows(names, shown))
