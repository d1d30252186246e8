"""One design after another, each described alone: those of which the branch is more than signs.

The formulas are written down once, with the dimensions as inputs, and with one Newton step of every group that has no closed
form. What closes such a group enters as the design's own iteration finds it: there the derivative of the step is that of the
solution (the implicit function theorem), and one sweep backwards over the tape has the derivatives to all dimensions.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from dalembert.arithmetic.adjoint import derivatives
from dalembert.arithmetic.engines import run
from dalembert.arithmetic.tape import Tape
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import MechanismError
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension, changed
from virtualwork.family.part import assembled
from virtualwork.family.written import Written
from virtualwork.formulas.asked import COMPLEX, Key, names, over_blocks
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.poses import Poses

REST = (False, False, False)


class Alone:
    """Positions over the input of designs that are described alone; the last of them is kept.

    Parameters
    ----------
    mechanism : Description
    dimensions : sequence of Dimension
    keys : sequence of Key
    """

    def __init__(self, mechanism: Description, dimensions: Sequence[Dimension], keys: Sequence[Key]) -> None:
        self.mechanism, self.dimensions, self.keys = mechanism, tuple(dimensions), tuple(keys)
        self._last: tuple[bytes, Assembly | None] | None = None
        self._tapes: dict[tuple[str, ...], Tape] = {}

    @cached_property
    def written(self) -> Written | None:
        """The formulas; None where a gear's phase hangs on links that have to be placed first, or every pose is singular.

        And where the mechanism's own dimensions cannot be put together.
        """
        try:
            own = assembled(self.mechanism)
        except MechanismError:
            return None
        if own.folded:
            return None
        found = Written(own, self.dimensions, REST, own_signs=True, settled=False)
        return None if found.open_gears else found

    def values(self, x: Reals, q: Reals) -> Reals:
        """What is asked for of one design, (rows, n); NaN where it cannot be assembled."""
        poses = self._poses(x, q)
        rows = []
        for key in self.keys:
            found = np.full(len(q), np.nan, dtype=complex) if poses is None else over_blocks(poses, key)
            rows += [found.real, found.imag] if key[0] in COMPLEX else [found.real]
        return np.stack(rows)

    def slopes(self, x: Reals, q: Reals, enters: tuple[str, ...]) -> Reals:
        """Its derivatives to dimensions by their paths, and to the input `q0`, (rows, n, len(enters))."""
        of = [name for key in self.keys for name in names(key)]
        out = np.full((len(of), len(q), len(enters)), np.nan)
        poses = self._poses(x, q)
        if poses is None:
            return out
        assert self.written is not None
        if enters not in self._tapes:
            tape = self.written.tape(self.keys)
            self._tapes[enters] = derivatives(tape, [name for name in enters if name in tape.inputs])
        tape = self._tapes[enters]
        given = {d.path: number for d, number in zip(self.dimensions, x.tolist(), strict=True)}
        rest = [name for name in tape.inputs if name not in given]
        assert self._last is not None
        assert self._last[1] is not None
        with np.errstate(all="ignore"):
            found = run(tape, given | Lanes(self._last[1], poses).entering(rest))
        for row, name in enumerate(of):
            for column, to in enumerate(enters):
                # what does not hang on it has no row
                out[row, :, column] = found.get(f"d({name})/d({to})", 0.0)
        out[:, ~poses.assembled] = np.nan
        return out

    def _poses(self, x: Reals, q: Reals) -> Poses | None:
        """A design at some inputs; None where it cannot be put together."""
        name = x.tobytes()
        if self._last is None or self._last[0] != name:
            numbers = {d.path: number for d, number in zip(self.dimensions, x.tolist(), strict=True)}
            try:
                self._last = name, Assembly.from_guess(changed(self.mechanism, numbers))
            except MechanismError:
                self._last = name, None
        return None if self._last[1] is None else Poses(self._last[1], q, 0.0, 0.0, 0.0)
