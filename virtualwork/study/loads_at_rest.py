"""Loads of a mechanism at rest: generalized forces, their derivative, the generalized mass, the potential.

At rest the effort is τ_j = −Q_j with the generalized force Q_j = Σ F·K_j + Σ T κ_j (Riul, unit II, eq. 3); of many poses it comes
from the tape, with everything else that the search for equilibria asks of the same poses.
"""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

from virtualwork.branch.assembly import Assembly
from virtualwork.branch.limits import TURNED
from virtualwork.formulas.at_rest import Mass, Potential, Stiffness, Work, WorkSize
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import EPS, Reals
from virtualwork.formulas.quantity import Quantity

# steps of a turn in which usual loads are looked at
AROUND = 72
# positions in which the loads some turns later are compared, and what makes no difference, as a share of their terms
COMPARED, ALIKE = 24, 1e-9


class Rest:
    """Generalized forces, their derivative and the potential of a mechanism at rest at given inputs (n, k)."""

    def __init__(self, assembly: Assembly, inputs: Reals) -> None:
        self.inputs, self.k = inputs, inputs.shape[1]
        self.poses = Lanes(assembly, inputs if self.k > 1 else inputs[:, 0], 0.0, 0.0)

    def force(self) -> tuple[Reals, Reals]:
        """Q and the sum of the sizes of its terms, each (n, k)."""
        keys: list[Quantity] = [kind(j) for kind in (Work, WorkSize) for j in range(self.k)]
        # over one input the search asks for these too, at the same poses
        more = [Stiffness(0, 0), Potential()] if self.k == 1 else []
        each = self.poses.taped([*keys, *more])
        return np.stack(each[: self.k], axis=1), np.stack(each[self.k : 2 * self.k], axis=1)

    def slope(self) -> Reals:
        """∂Q/∂q of the one input, (n,)."""
        return np.asarray(-self.hessian()[:, 0, 0])

    def hessian(self) -> Reals:
        """V″, (n, k, k)."""
        return self._matrix(Stiffness)

    def mass(self) -> Reals:
        """The generalized mass, (n, k, k)."""
        return self._matrix(Mass)

    def _matrix(self, kind: type[Mass | Stiffness]) -> Reals:
        pairs = list(combinations_with_replacement(range(self.k), 2))
        out = np.empty((len(self.inputs), self.k, self.k))
        for (i, j), value in zip(pairs, self.poses.taped([kind(i, j) for i, j in pairs]), strict=True):
            out[:, i, j] = out[:, j, i] = value
        return out

    def potential(self) -> Reals:
        """V, (n,) J; NaN where a load has no potential."""
        (result,) = self.poses.taped([Potential()])
        return np.asarray(result)


def turns_of_loads(assembly: Assembly, j: int) -> int | None:
    """After how many turns of an input the loads repeat, whatever the others are; None where they do not within the `TURNED`."""
    at = np.asarray(assembly.mechanism.at, dtype=float)
    shares = np.multiply.outer(np.arange(1.0, COMPARED + 1), np.sqrt(np.arange(2.0, 2 + len(at)))) % 1.0
    rest = Rest(assembly, at + 2 * np.pi * shares)
    force, size = rest.force()
    slope, tried = np.abs(rest.hessian()[:, :, j]), 0
    for last in TURNED:
        turns = np.arange(tried + 1, last + 1)
        later = rest.inputs + 2 * np.pi * np.multiply.outer(turns, np.eye(len(at))[[j]])
        off = np.abs(Rest(assembly, later.reshape(-1, len(at))).force()[0].reshape(later.shape) - force)
        # what is not assembled contradicts nothing
        back = ~(off > ALIKE * size + 4 * EPS * np.abs(later[:, :, [j]]) * slope).any(axis=(1, 2))
        if back.any():
            return int(turns[np.argmax(back)])
        tried = last
    return None


def goes_round(assembly: Assembly, j: int) -> bool:
    """Whether one of several inputs turns all the way round with the others as in the guess."""
    ways = np.tile(np.asarray(assembly.mechanism.at, dtype=float), (AROUND + 1, 1))
    ways[:, j] += np.linspace(-np.pi, np.pi, AROUND + 1)
    return bool(Rest(assembly, ways).poses.assembled.all())


def usual(size: Reals) -> float:
    """The middle one of the sizes of loads that are not zero; 0 where none is.

    >>> usual(np.array([0.0, 1.0, 2.0, 1e14]))
    2.0
    """
    some = size[(size > 0) & np.isfinite(size)]
    return float(np.median(some)) if len(some) else 0.0
