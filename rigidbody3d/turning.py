"""How the parts of a body are turned: their axis, then angles about fixed axes; of floats and of doubled numbers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.angles import cosine_sine
from dalembert.tables.table import Table

Array = NDArray[np.float64]
TURNS = ("rx", "ry", "rz")


def rotation_of(table: Table, values: dict[str, Array]) -> Array:
    """How each part is turned, (k, 3, 3): its axis first, then about the fixed x, y and z; degrees are exact at quarter turns."""
    if any(f"axis_{axis}" in values for axis in "xyz"):
        axis = vectors(values, *(f"axis_{a}" for a in "xyz"))
        blank = np.all([np.isnan(values[f"axis_{a}"]) for a in "xyz" if f"axis_{a}" in values], axis=0)
        zero = ~axis.any(axis=-1) & ~blank
        if zero.any():
            header = next(table.numbers[f"axis_{a}"].header for a in "zyx" if f"axis_{a}" in table.numbers)
            index = int(np.argmax(zero))
            raise table.error(index, header, "0", "an axis that is not zero in every component")
    else:
        axis = np.zeros((table.rows, 3))
    turns = []
    for number, name in enumerate(TURNS):
        if name in table.numbers:
            angle = table.numbers[name]
            turns.append((number, *cosine_sine(np.nan_to_num(angle.values), angle.unit)))
    return turned(turns, along(axis))


def vectors(values: dict[str, Array], *names: str) -> Array:
    """Three columns as vectors (k, 3); what is blank is zero."""
    rows = len(next(iter(values.values()), ()))
    return np.stack([np.nan_to_num(values.get(name, np.zeros(rows))) for name in names], axis=-1)


def turned(turns: Iterable[tuple[int, Any, Any]], first: Array) -> Array:
    """Turn further about fixed axes: the number of each, cosines and sines (k,)."""
    turn = first
    for axis, c, s in turns:
        zero = np.zeros_like(c)
        rows = [[zero, zero, zero] for _ in range(3)]
        p, q = (axis + 1) % 3, (axis + 2) % 3
        rows[axis][axis] = zero + 1.0
        rows[p][p] = rows[q][q] = c
        rows[p][q], rows[q][p] = -s, s
        turn = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2) @ turn
    return turn


def along(axis: Array) -> Array:
    """The shortest turn that brings z onto each part's axis (k, 3), (k, 3, 3); about x where the axis is -z; none where it is blank."""
    axis = np.where((axis == 0).all(axis=-1)[:, None], [0.0, 0.0, 1.0], axis)
    size = np.sqrt(np.square(axis).sum(axis=-1))
    x, y, z = (axis / size[:, None]).T
    across = x * x + y * y
    # 1/(1 + z), by the other quotient where z is near -1
    k = np.where(z >= 0, 1 / (1 + np.abs(z)), (1 + np.abs(z)) / np.where(across > 0, across, 1.0))
    rows = [[1 - k * x * x, -k * x * y, x], [-k * x * y, 1 - k * y * y, y], [-x, -y, z]]
    turn = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    reverse = (across == 0) & (z < 0)
    return np.where(reverse[:, None, None], np.diag([1.0, -1.0, -1.0]), turn)
