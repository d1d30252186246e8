"""Even sweeps of one input: e^{iq} by angle addition."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from virtualwork.formulas.numbers import EPS, Complexes, Reals
from virtualwork.formulas.positions import BLOCK


class EvenSweep:
    """An even sweep of an input, whose e^{iq} follow by angle addition: e^{i(q0 + jh)} = e^{iq0}·e^{ijh}.

    Each factor is rounded once and the product twice, whatever the length of the sweep; the sweep's own rounding,
    the difference between q and q0 + jh, is put back to first order, which is exact here. A block of `BLOCK` poses
    needs no other block of the sweep.

    Parameters
    ----------
    first, last : float
        rad.
    n : int
        Number of poses.
    even : bool
        False where some block is known not to be even: then none is taken as such.

    Examples
    --------
    >>> sweep = EvenSweep(0.0, 6.0, 7)
    >>> bool(np.allclose(sweep.turns(np.arange(7.0)), np.exp(1j * np.arange(7.0)), rtol=1e-15))
    True
    >>> sweep.turns(np.arange(7.0) ** 2) is None
    True
    """

    def __init__(self, first: float, last: float, n: int, even: bool = True) -> None:
        self.even = even
        h = (last - first) / (n - 1)
        self.ramp = h * np.arange(min(n, BLOCK))
        self.bound = 64 * EPS * max(abs(first), abs(last), 1e-3)

    @cached_property
    def _table(self) -> Complexes:
        table = np.empty(len(self.ramp), complex)
        np.cos(self.ramp, out=table.real)
        np.sin(self.ramp, out=table.imag)
        return table

    def off(self, q: Reals) -> Reals | None:
        """By how much a block's inputs are off from even steps; None where they are not even to rounding."""
        with np.errstate(invalid="ignore"):
            off = (q - q[0]) - self.ramp[: len(q)]
            return off if off.max() <= self.bound and off.min() >= -self.bound else None

    def turns(self, q: Reals) -> Complexes | None:
        """e^{iq} of a block, (≤ BLOCK,); None where the sweep is not even."""
        off = self.off(q) if self.even else None
        if off is None:
            return None
        e = self._table[: len(q)] * complex(np.cos(q[0]), np.sin(q[0]))
        turn = np.empty(len(q), complex)
        turn.real = 1.0
        turn.imag = off
        e *= turn
        return e
