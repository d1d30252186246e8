"""A tape over a grid: every row with every column, such as variants with poses, or both signs with variants.

What depends on the row alone, or on the column alone, is worked out once for it; only the rest is a lane for each pair.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.engines.blocks import Blocks, one_by_one
from dalembert.arithmetic.tape import Tape

Reals = NDArray[np.float64]
# columns at a time: what depends on them alone stays in the cache; lanes at a time
WIDE, BLOCK = 16384, 8192


class Grid(Blocks):
    """A tape prepared for a grid, on whose row (1) or column (2) what is not of lanes depends, or on neither."""

    def over(self, inputs: Mapping[str, Any], out: Sequence[NDArray[Any]], shape: tuple[int, int]) -> None:
        """Run: inputs are numbers, (r, 1), (1, c) or (r, c); of each output (r, c), or for a test (r,)."""
        r, c = shape
        values = one_by_one(self.tape, inputs, self.of_lanes)
        operands = [inputs[name] for name in self.varying] + [
            np.asarray(values[number]) for number in self.read
        ]
        tests = [k for k, row in enumerate(self.written) if out[row].ndim == 1]
        tall, wide = max(1, BLOCK // c), min(c, BLOCK)
        room = np.empty((self.slots + len(tests), tall * wide + 8))
        decided = np.empty(tall * wide, dtype=bool)
        for i in range(0, r if self.parts else 0, tall):
            for j in range(0, c, wide):
                high, broad = min(tall, r - i), min(wide, c - j)
                rows, columns = slice(i, i + high), slice(j, j + broad)
                here = [_cut(x, rows, columns) for x in operands]
                slots = [slot[: high * broad].reshape(high, broad) for slot in room]
                tried = dict(zip(tests, slots[self.slots :], strict=True))
                tables = [
                    tried[k] if k in tried else out[row][rows, columns] for k, row in enumerate(self.written)
                ]
                mask = decided[: high * broad].reshape(high, broad)
                for part in self.parts:
                    part(*here, *tables, *slots[: self.slots], mask)
                for k, table in tried.items():
                    out[self.written[k]][rows] &= (table > 0).all(axis=1)
        for row, kind, source in self.fill:
            of = values[source] if kind == "common" else inputs[source] if kind == "input" else out[source]
            value = np.asarray(of)
            if out[row].ndim == 2:
                out[row][:] = value
            else:
                out[row][:] &= value if value.dtype == bool else (value > 0).all(axis=-1)


def _cut(x: Reals, rows: slice, columns: slice) -> Any:
    """What a block sees of a value that depends on the row, on the column, on both or on neither."""
    if not x.ndim:
        return x[()]
    return x[rows if x.shape[0] > 1 else slice(None), columns if x.shape[1] > 1 else slice(None)]


@lru_cache(maxsize=64)
def compiled(tape: Tape, rows: frozenset[str], columns: frozenset[str]) -> Grid:
    """The tape prepared for a grid, once; `rows` and `columns` name the inputs that depend on them, or on both."""
    return Grid(tape, {name: (name in rows) + 2 * (name in columns) for name in tape.inputs}, 3)


def run(
    tape: Tape, inputs: Sequence[Reals], shape: tuple[int, int], out: Sequence[NDArray[Any]] | NDArray[Any]
) -> None:
    """Run a tape over a grid.

    Parameters
    ----------
    tape : Tape
    inputs : sequence of array
        In the order of the tape's: (), (r, 1), (1, c) or (r, c).
    shape : (r, c)
    out : sequence of array
        Of each output (r, c), or (r,) of bool: whether it is positive in every column. Such are the last.

    Examples
    --------
    >>> from dalembert.arithmetic.recorded import RECORDED, Recorder
    >>> recorder = Recorder()
    >>> tape = recorder.tape({"x": recorder.input("r") * RECORDED.cos(recorder.input("q"))})
    >>> out = np.empty((1, 2, 3))
    >>> run(tape, [np.array([[1.0], [2.0]]), np.array([[0.0, np.pi, 0.0]])], (2, 3), out)
    >>> out[0]
    array([[ 1., -1.,  1.],
           [ 2., -2.,  2.]])
    """
    r, c = shape
    arrays = dict(zip(tape.inputs, inputs, strict=True))
    # a grid of one row or one column has both kinds all the same
    rows = frozenset(name for name, x in arrays.items() if x.ndim and len(x) == r and (r > 1 or c > 1))
    columns = frozenset(
        name for name, x in arrays.items() if x.ndim and (name not in rows or x.shape[1] == c)
    )
    grid = compiled(tape, rows, columns)
    for table in out:
        if table.ndim == 1:
            table[:] = True
    with np.errstate(all="ignore"):
        for j in range(0, c, WIDE):
            wide = min(WIDE, c - j)
            part = {name: x[:, j : j + wide] if name in columns else x for name, x in arrays.items()}
            grid.over(
                part, [table[:, j : j + wide] if table.ndim == 2 else table for table in out], (r, wide)
            )
