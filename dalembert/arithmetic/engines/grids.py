"""A tape over a grid: every row with every column, such as variants with poses, or both signs with variants.

What hangs on the row alone, or on the column alone, is worked out once for it; only the rest is a lane for each pair.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.arrays import NUMPY
from dalembert.arithmetic.engines.blocks import Blocks
from dalembert.arithmetic.tape import Tape, performed

Reals = NDArray[np.float64]
# columns at a time: what hangs on them alone stays in the cache; lanes at a time
WIDE, BLOCK = 16384, 8192


class Grid(Blocks):
    """A tape prepared for a grid; `rows` and `columns` name the inputs that hang on them."""

    def __init__(self, tape: Tape, rows: frozenset[str], columns: frozenset[str]) -> None:
        self.by = {name: (name in rows) + 2 * (name in columns) for name in tape.inputs}
        super().__init__(tape, frozenset(tape.inputs))

    def lanes_of(self, tape: Tape, uniform: frozenset[str]) -> list[bool]:
        """Which operations hang on the row and on the column."""
        hangs: list[int] = []
        for kind, *arguments in tape.operations:
            if kind == "input":
                hangs.append(self.by[arguments[0]])
            elif kind == "const":
                hangs.append(0)
            else:
                on = 0
                for a in arguments:
                    on |= hangs[a]
                hangs.append(on)
        return [on == 3 for on in hangs]

    def over(self, inputs: Mapping[str, Any], out: Sequence[Reals]) -> None:
        """Run: inputs are numbers, (r, 1) or (1, c); `out` has a table (r, c) for each output."""
        r, c = out[0].shape
        values: list[Any] = []
        for number, (kind, *arguments) in enumerate(self.tape.operations):
            if kind == "const":
                values.append(np.float64(arguments[0]))
            elif kind == "input":
                values.append(inputs[arguments[0]])
            elif self.of_lanes[number]:
                values.append(None)
            else:
                values.append(performed(kind, [values[a] for a in arguments], NUMPY))
        known = [np.asarray(values[number]) for number in self.read]
        tall, wide = max(1, BLOCK // c), min(c, BLOCK)
        room = np.empty((self.slots, tall * wide + 8))
        decided = np.empty(tall * wide, dtype=bool)
        for i in range(0, r if self.parts else 0, tall):
            for j in range(0, c, wide):
                high, broad = min(tall, r - i), min(wide, c - j)
                here = [_cut(x, slice(i, i + high), slice(j, j + broad)) for x in known]
                tables = [out[row][i : i + high, j : j + broad] for row in self.written]
                slots = [slot[: high * broad].reshape(high, broad) for slot in room]
                mask = decided[: high * broad].reshape(high, broad)
                for part in self.parts:
                    part(*here, *tables, *slots, mask)
        for row, kind, source in self.fill:
            out[row][:] = values[source] if kind == "common" else out[source]


def _cut(x: Reals, rows: slice, columns: slice) -> Any:
    """What a block sees of a value that hangs on the row, on the column, or on neither."""
    if not x.ndim:
        return x[()]
    return x[rows] if x.shape[0] > 1 else x[:, columns] if x.shape[1] > 1 else x


@lru_cache(maxsize=64)
def compiled(tape: Tape, rows: frozenset[str], columns: frozenset[str]) -> Grid:
    """The tape prepared for a grid, once."""
    return Grid(tape, rows, columns)


def run(tape: Tape, inputs: Mapping[str, Any], shape: tuple[int, int]) -> Reals:
    """Run a tape over a grid.

    Parameters
    ----------
    tape : Tape
    inputs : mapping of name to number, array (r, 1) or array (1, c)
    shape : (r, c)

    Returns
    -------
    array (outputs, r, c)
        In the order of the tape's outputs.

    Examples
    --------
    >>> from dalembert.arithmetic.recorded import RECORDED, Recorder
    >>> recorder = Recorder()
    >>> tape = recorder.tape({"x": recorder.input("r") * RECORDED.cos(recorder.input("q"))})
    >>> run(tape, {"r": np.array([[1.0], [2.0]]), "q": np.array([[0.0, np.pi, 0.0]])}, (2, 3))[0]
    array([[ 1., -1.,  1.],
           [ 2., -2.,  2.]])
    """
    r, c = shape
    out = np.empty((len(tape.outputs), r, c))
    given = {name: np.asarray(inputs[name], dtype=float) for name in tape.inputs}
    # a grid of one row or one column has both kinds all the same
    rows = frozenset(name for name, x in given.items() if x.ndim and x.shape == (r, 1) and (r > 1 or c > 1))
    columns = frozenset(name for name, x in given.items() if x.ndim and name not in rows)
    grid = compiled(tape, rows, columns)
    with np.errstate(all="ignore"):
        for j in range(0, c, WIDE):
            part = {name: x[:, j : j + WIDE] if name in columns else x for name, x in given.items()}
            grid.over(part, out[:, :, j : j + WIDE])  # type: ignore[arg-type]
    return out
