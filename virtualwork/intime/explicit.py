"""Dormand and Prince's explicit Runge-Kutta method of order 8, for q̈ = a(t, q, q̇).

Coefficients in `tableau`. A step runs on Python's floats, for a mechanism has few inputs;
the same step over arrays, from the node before each time asked for, is the dense output: it has the method's own order.
"""

from __future__ import annotations

from operator import mul

import numpy as np

from virtualwork.formulas.numbers import Reals
from virtualwork.intime.equations import Equations
from virtualwork.intime.step import Step
from virtualwork.intime.tableau import AT, FIFTH, STAGES, THIRD, WEIGHTS
from virtualwork.intime.watch import Floats


class DormandPrince:
    """The method: its steps, and how large the error of one is."""

    name = "explicit Runge-Kutta method of order 8 (Dormand and Prince)"
    order = 8
    # h·|λ| beyond which it is not stable (Hairer and Wanner, §IV.2)
    stable = 6.1

    def step(self, f: Equations, t: float, q: Floats, v: Floats, rates: Floats, h: float) -> Step:
        """One step of length h from a state whose rates are known."""
        k = len(q)
        speeds, others = [[x] for x in v], [[x] for x in rates]
        place: tuple[Floats, Floats] = ([], [])
        for c, row in zip(AT, STAGES, strict=True):
            place = (
                [x + h * sum(map(mul, row, s)) for x, s in zip(q, speeds, strict=True)],
                [x + h * sum(map(mul, row, s)) for x, s in zip(v, others, strict=False)],
            )
            found = f(t + c * h, *place)
            for s, x in zip(speeds, place[1], strict=True):
                s.append(x)
            for s, x in zip(others, found, strict=True):
                s.append(x)
        dq = [h * sum(map(mul, WEIGHTS, s)) for s in speeds]
        *dv, work = [h * sum(map(mul, WEIGHTS, s)) for s in others]
        end = [x + d for x, d in zip(q, dq, strict=True)], [x + d for x, d in zip(v, dv, strict=True)]
        found = f(t + h, *end)
        # the last two evaluations stand at one time: how fast the rates change between them is what is stiff
        apart = sum((a - b) ** 2 for a, b in zip(end[1], place[1], strict=True))
        steep = sum((a - s[-1]) ** 2 for a, s in zip(found[:k], others, strict=False))
        stiffness = abs(h) * (steep / apart) ** 0.5 if apart > 0 else 0.0
        for s, x in zip(speeds, end[1], strict=True):
            s.append(x)
        for s, x in zip(others, found, strict=True):
            s.append(x)
        errors = (
            [h * sum(map(mul, weights, s)) for s in (*speeds, *others[:k])] for weights in (THIRD, FIFTH)
        )
        return Step(dq, dv, work, found, tuple(errors), stiffness)

    def steps(
        self, f: Equations, t: Reals, q: Reals, v: Reals, rates: Reals, h: Reals
    ) -> tuple[Reals, Reals, Reals]:
        """Changes of q and q̇ (n, k) and the work (n,) over a step from each of n states, each of its own length."""
        k = q.shape[1]
        length = h[:, None]
        y = np.concatenate([q, v], axis=1)
        slopes = np.empty((len(STAGES) + 1, len(q), 2 * k + 1))
        slopes[0] = np.concatenate([v, rates], axis=1)
        for i, (c, row) in enumerate(zip(AT, STAGES, strict=True)):
            place = y + length * np.tensordot(row, slopes[: i + 1, :, : 2 * k], 1)
            slopes[i + 1, :, :k] = place[:, k:]
            slopes[i + 1, :, k:] = f.many(t + c * h, place[:, :k], place[:, k:])
        change = length * np.tensordot(WEIGHTS, slopes, 1)
        return change[:, :k], change[:, k : 2 * k], change[:, 2 * k]

    def size(self, done: Step, scale: Floats) -> float:
        """A step's error over the one allowed in each of (q, q̇)."""
        third, fifth = (sum((e / s) ** 2 for e, s in zip(of, scale, strict=True)) for of in done.errors)
        return fifth / ((fifth + 0.01 * third) * len(scale)) ** 0.5 if fifth else 0.0
