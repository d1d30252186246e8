"""Bounds that a fit keeps over the whole sweep, transmission angles first of all.

A bound is held by multipliers (M. R. Hestenes, J. Optim. Theory Appl. 4 (1969) 303; M. J. D. Powell 1969): rows
√ρ·max(0, λ/ρ − c) stand below the residuals of the target, c the margin of each pose to the bound; after each descent
λ becomes max(0, λ − ρ c). At the end c ≥ 0 to rounding, and λ c = 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from virtualwork.describe import DescriptionError
from virtualwork.describe.description import Description
from virtualwork.describe.dimensions import Dimension
from virtualwork.family.design import Design, numbers_of
from virtualwork.formulas.loops import Transmission
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.quantity import Quantity

# poses of the sweep at which bounds are held, and at which they are judged
HELD, JUDGED = 181, 1441
# of what a bound is compared with: what is left of a bound that is met
MET = 1e-9
# the penalty of a first descent, and how it grows where a bound is not neared fast enough
FIRST, FASTER, NEARER, LARGEST = 10.0, 10.0, 0.25, 1e8
# a pose that cannot be assembled counts as this far beyond
AWAY = 1.0


@dataclass(frozen=True)
class Bound:
    """A bound of one quantity over the whole sweep, in SI units.

    Attributes
    ----------
    name : str
        `transmission` (the least transmission angle of all two-link groups, 0 to π/2), or as the library's targets have
        it with the coordinate: `points.H.x`, `links.coupler`, `slides.B`, `effort.crank`.
    least, most : float or None
        One of the two.
    """

    name: str
    least: float | None = None
    most: float | None = None

    @property
    def value(self) -> float:
        """The bound."""
        number = self.most if self.least is None else self.least
        if number is None or (self.least is not None and self.most is not None) or not math.isfinite(number):
            raise ValueError(f"{self.name}: expected one bound, a finite number")
        return number


@dataclass(frozen=True)
class Kept:
    """The result of a bound: the extreme of the quantity over the sweep, and whether it is met."""

    bound: Bound
    extreme: float
    met: bool
    at: float
    """The input there, rad or m."""


class Bounds:
    """Bounds of a mechanism of which dimensions vary.

    Raises
    ------
    DescriptionError
        Names that are not there, a mechanism without a group of two links.
    """

    def __init__(self, m: Description, dimensions: Sequence[Dimension], bounds: Sequence[Bound]) -> None:
        self.m, self.bounds = m, tuple(bounds)
        quantities = [_numbers(m, bound) for bound in self.bounds]
        keys = list(dict.fromkeys(key for of in quantities for key in of))
        # of each bound the keys of its quantity and their rows in the design's one table
        self._rows = [[(key, keys.index(key)) for key in of] for of in quantities]
        self._design = Design(m, dimensions, keys)
        # transmissions are judged by their sines, so that they have derivatives where they are largest
        self._limits = [self.limit(i, bound.value) for i, bound in enumerate(self.bounds)]

    @property
    def evaluations(self) -> int:
        """Mechanisms computed over the sweep so far."""
        return self._design.evaluations

    def hold(self, values: Reals | None) -> None:
        """Hold every loop on the branch that it has at some numbers; None: on each design's own again."""
        self._design.hold(values)

    def margins(self, values: Reals, q: Reals) -> Reals:
        """Return the distance of each quantity from its bound at each pose, (rows, n): relative, in sizes, or rad."""
        result = np.concatenate(self._margins(values, q))
        return np.where(np.isfinite(result), result, -AWAY)

    def _margins(self, values: Reals, q: Reals) -> list[Reals]:
        """Return the margins of the rows of each bound, (its rows, n); not finite if a pose cannot be assembled."""
        table = self._design(values, q)
        return [
            np.array([self._margin(i, key, table[row]) for key, row in rows])
            for i, rows in enumerate(self._rows)
        ]

    def slopes(self, values: Reals, q: Reals) -> Reals:
        """Their derivatives to the dimensions, (rows, n, d); 0 where a pose cannot be assembled."""
        table, out = self._design.slopes(values, q), []
        for i, rows in enumerate(self._rows):
            sign = -1.0 if self.bounds[i].least is None else 1.0
            out += [sign * table[row, :, :-1] / self._unit(i, key) for key, row in rows]
        return np.where(np.isfinite(out), out, 0.0)

    def judged(self, values: Reals, q: Reals) -> tuple[Kept, ...]:
        """The extremes over a fine sweep, between its poses by the parabola through the three about the extreme."""
        result = []
        for i, (bound, rows) in enumerate(zip(self.bounds, self._margins(values, q), strict=True)):
            margins = rows.min(axis=0)
            k = int(np.argmin(np.where(np.isfinite(margins), margins, -np.inf)))
            least, at = float(margins[k]), float(q[k])
            if not np.isfinite(margins).all():
                least = -math.inf
            elif 0 < k < len(q) - 1:
                before, here, after = margins[k - 1 : k + 2].tolist()
                bend = before - 2 * here + after
                if bend > 0:
                    vertex = at + (q[1] - q[0]) * (before - after) / (2 * bend)
                    lower = float(self._margins(values, np.array([vertex]))[i].min())
                    least, at = (lower, float(vertex)) if lower < least else (least, at)
            result.append(Kept(bound, self._extreme(i, least), least >= -MET, at))
        return tuple(result)

    def limit(self, i: int, number: float) -> float:
        """A number of a quantity as margins have it."""
        return math.sin(number) ** 2 if self.bounds[i].name == "transmission" else number

    def _unit(self, i: int, key: Quantity) -> float:
        if key.dimension == "length":
            return self.m.size
        return max(abs(self._limits[i]), 1e-300) if key.is_force and self._limits[i] else 1.0

    def _margin(self, i: int, key: Quantity, numbers: Reals) -> Reals:
        apart = numbers - self._limits[i]
        if key.is_angle:
            apart = apart - 2 * np.pi * np.round(apart / (2 * np.pi))
        return np.asarray((-apart if self.bounds[i].least is None else apart) / self._unit(i, key))

    def _extreme(self, i: int, margin: float) -> float:
        """The quantity at a margin."""
        bound, key = self.bounds[i], self._rows[i][0][0]
        number = self._limits[i] + (-1 if bound.least is None else 1) * margin * self._unit(i, key)
        if bound.name != "transmission":
            return number
        return math.asin(math.sqrt(min(max(number, 0.0), 1.0)))


def _numbers(m: Description, bound: Bound) -> tuple[Quantity, ...]:
    """The numbers that a bound is of."""
    _ = bound.value
    if bound.name == "transmission":
        from virtualwork.plan.order import plan

        if bound.least is None:
            raise DescriptionError("transmission: expected a least angle, transmission>=40deg")
        if not 0 <= bound.least <= math.pi / 2:
            raise DescriptionError("transmission: expected an angle from 0 to 90 deg")
        groups = [g for g in plan(m).groups if g.kind != "Newton"]
        if not groups:
            raise DescriptionError("transmission: the mechanism has no group of two links")
        return tuple(Transmission(g.name) for g in groups)
    numbers = numbers_of(m, bound.name)
    if len(numbers) == 2:
        raise DescriptionError(f"{bound.name}: a point has two coordinates: expected {bound.name}.x or .y")
    return numbers


class Held:
    """Bounds during one descent: their rows, and what they weigh."""

    def __init__(self, bounds: Bounds, q: Reals, width: Reals) -> None:
        self.bounds, self.q, self.width = bounds, q, width
        self.penalty = FIRST
        self.multipliers: Reals | None = None
        self._beyond = math.inf

    def rows(self, values: Reals) -> tuple[Reals, Reals]:
        """Rows below the residuals, and their derivatives to the shares of the bounds of the dimensions."""
        margins = self.bounds.margins(values, self.q)
        pressed = self._pressed(margins)
        slopes = self.bounds.slopes(values, self.q) * self.width
        on = (pressed > 0)[..., None]
        root = math.sqrt(self.penalty)
        return (root * pressed).ravel(), np.where(on, -root * slopes, 0.0).reshape(-1, len(self.width))

    def _pressed(self, margins: Reals) -> Reals:
        if self.multipliers is None:
            self.multipliers = np.zeros_like(margins)
        return np.maximum(0.0, self.multipliers / self.penalty - margins)

    def settle(self, values: Reals) -> bool:
        """Move the multipliers after a descent; whether the bounds hold to rounding and press only where they are met."""
        margins = self.bounds.margins(values, self.q)
        assert self.multipliers is not None
        before = self.multipliers
        self.multipliers = self.penalty * self._pressed(margins)
        moved = float(np.abs(self.multipliers - before).max())
        beyond = max(0.0, -float(margins.min()))
        if beyond > NEARER * self._beyond:
            self.penalty = min(self.penalty * FASTER, LARGEST)
        self._beyond = beyond
        held = beyond <= MET / 10 and moved <= MET * self.penalty
        # at the largest penalty what is not met cannot be met from here
        return held or (self.penalty == LARGEST and beyond > math.sqrt(MET))

    def hold_too(self, kept: Sequence[Kept]) -> None:
        """Hold the poses between the others in which a bound is not met."""
        more = [each.at for each in kept if not each.met]
        self.q, self._beyond = np.append(self.q, more), math.inf
        if self.multipliers is not None:
            self.multipliers = np.hstack([self.multipliers, np.zeros((len(self.multipliers), len(more)))])
