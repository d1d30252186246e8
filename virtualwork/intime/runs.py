"""What is found of many variants that are let go."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from virtualwork.family.family import Family, FamilyMotion
from virtualwork.family.part import Part
from virtualwork.formulas.numbers import Reals
from virtualwork.intime.run import Run

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Runs:
    """What `Variants.simulate` has found: every array has a leading axis of variants.

    Attributes
    ----------
    t : array (n,)
        The times asked for, s.
    times : array (v, n)
        Those of each variant: where its motion ends before the last, that of its end comes after those before it, and
        what follows is NaN. So is all of a variant that cannot be let go.
    unknown : array (v, n)
        From when on no digit is known.
    warnings : dict of a variant's place to what must be said of it
    """

    family: Family
    t: Reals
    times: Reals = field(repr=False)
    inputs: Reals = field(repr=False)
    energies: Reals = field(repr=False)
    unknown: Mask = field(repr=False)
    warnings: dict[int, tuple[str, ...]] = field(default_factory=dict)

    @classmethod
    def of(cls, family: Family, t: Reals) -> Runs:
        """Nothing yet."""
        v, n, k = len(family), len(t), len(family.mechanism.inputs)
        times, inputs, energies = (np.full(size, np.nan) for size in ((v, n), (4, v, n, k), (2, v, n)))
        return cls(family, t, times, inputs, energies, np.zeros((v, n), dtype=bool))

    @property
    def angle(self) -> Reals:
        """(v, n, k): the inputs, rad or m."""
        return np.asarray(self.inputs[0])

    @property
    def speed(self) -> Reals:
        """(v, n, k): their speeds."""
        return np.asarray(self.inputs[1])

    @property
    def acceleration(self) -> Reals:
        """(v, n, k): their accelerations."""
        return np.asarray(self.inputs[2])

    @property
    def error_estimate(self) -> Reals:
        """(v, n, k): how far the inputs may be from the truth, rad or m."""
        return np.asarray(self.inputs[3])

    @property
    def energy(self) -> Reals:
        """(v, n): kinetic energy and that of gravity and springs, J."""
        return np.asarray(self.energies[0])

    @property
    def energy_drift(self) -> Reals:
        """(v, n): the change of energy since the first time that the work of the loads does not explain, J."""
        return np.asarray(self.energy - self.energy[:, :1] - self.energies[1])

    @cached_property
    def motion(self) -> FamilyMotion:
        """The motion of every variant through all times: points, links, slides, joint forces."""
        f = self.family
        rates = [[of[:, :, j] for j in range(of.shape[2])] for of in (self.speed, self.acceleration)]
        return FamilyMotion(
            Part(f.mechanism, f.dimensions, f.values, self.angle, [*rates, [0.0] * len(rates[0])])
        )

    def put(self, i: int, own: Run) -> None:
        """Take over a variant that was let go singly."""
        n = len(own.t)
        self.times[i, n:], self.inputs[:, i, n:], self.energies[:, i, n:] = np.nan, np.nan, np.nan
        self.times[i, :n], self.unknown[i, :n] = own.t, own.unknown
        for of, values in zip(
            self.inputs, (own.angle, own.speed, own.acceleration, own.error_estimate), strict=True
        ):
            of[i, :n] = values
        self.energies[0, i, :n] = own.energy
        self.energies[1, i, :n] = own.energy - own.energy[0] - own.energy_drift
        if own.warnings:
            self.warnings[i] = own.warnings
