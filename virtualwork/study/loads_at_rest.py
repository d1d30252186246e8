"""Loads of a mechanism at rest: generalized forces, their derivative, the generalized mass, the potential.

At rest the effort is τ_j = −Q_j with the generalized force Q_j = Σ F·K_j + Σ T κ_j (Riul, unit II, eq. 3); of many poses it comes
from the tape, with everything else that the search for equilibria asks of the same poses.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial
from itertools import combinations, combinations_with_replacement

import numpy as np

from virtualwork.branch.assembly import Assembly
from virtualwork.branch.limits import TURNED
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.at_rest import mass, mass_reads, potential, second_variation
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.loaded_pose import LoadedPose
from virtualwork.formulas.numbers import EPS, Number, Reals, plus
from virtualwork.plan.steps import path_reads

# steps of a turn in which usual loads are looked at
AROUND = 72
# positions in which the loads some turns later are compared, and what makes no difference, as a share of their terms
COMPARED, ALIKE = 24, 1e-9


class Rest:
    """Generalized forces, their derivative and the potential of a mechanism at rest at given inputs (n, k)."""

    def __init__(self, assembly: Assembly, inputs: Reals) -> None:
        self.assembly, self.inputs, self.k = assembly, inputs, inputs.shape[1]
        self.poses = Lanes(assembly, inputs if self.k > 1 else inputs[:, 0], 0.0, 0.0)
        self.loaded = Dynamics(self.poses, at_rest=True)

    def force(self) -> tuple[Reals, Reals]:
        """Q and the sum of the sizes of its terms, each (n, k)."""
        force, size, *_ = self._values
        return force, size

    @cached_property
    def _values(self) -> list[Reals]:
        """Q and the sum of the sizes of its terms, (n, k); of many poses over one input also ∂Q/∂q and V, (n,), from one tape."""

        def of(j: int, sized: bool) -> Callable[[LoadedPose], Number]:
            def form(pose: LoadedPose) -> Number:
                total: Number = None
                for load in self.loaded.case.loads:
                    value = load.power(pose, j)
                    total = plus(total, value if value is None or not sized else abs(value))
                return total

            return form

        forms = [of(j, sized) for sized in (False, True) for j in range(self.k)]
        if self._together:
            more = self._bent, self._stored
            each = self.loaded.over([*forms, *more], float, self._reads(), 2, name="rest")
        else:
            each = self.loaded.over(forms, float, name="rest")
        return [*(np.stack(each[i : i + self.k], axis=1) for i in (0, self.k)), *each[2 * self.k :]]

    @property
    def _together(self) -> bool:
        return self.k == 1 and self.loaded.on_tape

    def _reads(self) -> list[str]:
        """What the loads depend on."""
        return sorted(set().union(*(load.reads() for load in self.loaded.case.loads)) - {f"angle:{GROUND}"})

    def _bent(self, pose: LoadedPose) -> Number:
        """The second variation of the work, along the direction of the rates."""
        return second_variation(self.loaded.case.loads, pose, pose.along or pose.by[0])

    def along(self, direction: Reals) -> Reals:
        """∂Q/∂q along a direction in the inputs, times the direction: d²(work), (n,)."""
        if self._together:
            return np.asarray(self._values[2] * direction[0] ** 2)
        still: list[Number] = [0.0] * self.k
        way = [direction.tolist(), still, still] if self.k > 1 else None
        poses = self.poses.again(self.inputs, way)
        poses.at_rest = True
        loaded = Dynamics(poses, at_rest=True)
        if loaded.on_tape:
            (total,) = loaded.over([self._bent], float, self._reads(), 2, name="rest, second")
        else:
            total = np.array([self._along(loaded, self._reads())])
        return np.asarray(total * (direction[0] ** 2 if self.k == 1 else 1.0))

    def _along(self, loaded: Dynamics, reads: list[str]) -> float:
        """The derivative of one pose along its rates; NaN at a singular pose."""
        rates = loaded.along(reads)
        if rates is None:
            return math.nan
        return float(second_variation(loaded.case.loads, loaded.pose, rates) or 0.0)

    def hessian(self) -> Reals:
        """V″, (n, k, k), by polarization of exact second derivatives along the inputs and their pairs."""
        k = self.k
        unit = np.eye(k)
        out = np.zeros((len(self.inputs), k, k))
        for i in range(k):
            out[:, i, i] = -self.along(unit[i])
        for i, j in combinations(range(k), 2):
            both = -self.along(unit[i] + unit[j])
            out[:, i, j] = out[:, j, i] = (both - out[:, i, i] - out[:, j, j]) / 2
        return out

    def mass(self) -> Reals:
        """The generalized mass, (n, k, k)."""
        pairs = list(combinations_with_replacement(range(self.k), 2))
        case, out = self.loaded.case, np.zeros((len(self.inputs), self.k, self.k))
        forms = [partial(mass, case, i=i, j=j) for i, j in pairs]
        values = self.loaded.over(forms, float, mass_reads(case), name="rest, mass")
        for (i, j), value in zip(pairs, values, strict=True):
            out[:, i, j] = out[:, j, i] = value
        return out

    def potential(self) -> Reals:
        """V, (n,) J; NaN where a load has no potential."""
        if self._together:
            return self._values[3]
        keys = {
            key for load in self.loaded.case.loads if load.path is not None for key in path_reads(load.path)
        }
        (result,) = self.loaded.over([self._stored], float, sorted(keys), name="rest, potential")
        return np.asarray(result)

    def _stored(self, pose: LoadedPose) -> Number:
        return potential(self.loaded.case.loads, pose)


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
