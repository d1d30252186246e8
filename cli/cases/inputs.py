"""The inputs of the poses of one mechanism: formed when they are needed, a part at a time where they are many."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cli.cases.axes import Grid, Values
from cli.cases.values import Driven
from dalembert.dataclass import dataclass, field

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dalembert.arithmetic.doubled import Doubled
    from virtualwork import Mechanism

    Reals = NDArray[np.float64]


@dataclass(frozen=True)
class Inputs:
    """The inputs of every pose, in SI and as they are shown (degrees or metres), and their rates where a table gives them."""

    values: Reals
    """(n, k)."""
    shown: Reals
    """(n, k), deg or m."""
    speed: Reals | None = None
    acceleration: Reals | None = None
    steps: list[str] = field(default_factory=list)
    time: Reals | None = None
    """(n,) s, of a law of motion over time."""

    @property
    def n(self) -> int:
        """How many poses."""
        return len(self.shown)

    @property
    def orders(self) -> set[int]:
        """Of which orders there are rates."""
        return {order for order, rate in enumerate((self.speed, self.acceleration), 1) if rate is not None}

    @property
    def whole(self) -> Inputs:
        """All poses, listed."""
        return self

    @property
    def span(self) -> tuple[float, float]:
        """The least and the largest value of the first input."""
        return float(self.values[:, 0].min()), float(self.values[:, 0].max())

    def rest(self) -> Reals:
        """What the inputs are exactly, by their decimals in degrees or metres, less the floats in SI, (n, k)."""
        from dalembert.arithmetic.doubled import PI, Doubled

        rest = np.zeros(self.values.shape)
        for j, (si, shown) in enumerate(zip(self.values.T, self.shown.T, strict=True)):
            exact = decimals(shown)
            if not np.array_equal(si, shown):
                exact = exact * (PI / 180.0)
            rest[:, j] = (exact - Doubled(si)).value
        return rest

    def part(self, low: int, high: int) -> Inputs:
        """The poses from low to high."""
        speed, acceleration = (None if r is None else r[low:high] for r in (self.speed, self.acceleration))
        time = None if self.time is None else self.time[low:high]
        return Inputs(
            self.values[low:high], self.shown[low:high], speed, acceleration, self.steps[low:high], time
        )


def decimals(shown: Reals) -> Doubled:
    """The decimals that numbers are written with, in 32 digits; numbers without few decimals are what they are.

    >>> float(decimals(np.array([0.1, 2.5])).low[0])
    -5.551115123125783e-18
    """
    from dalembert.arithmetic.doubled import Doubled

    for places in range(13):
        whole = np.rint(shown * 10.0**places)
        if (np.abs(whole) < 2.0**53).all() and (whole / 10.0**places == shown).all():
            return Doubled(whole) / 10.0**places
    return Doubled(shown)


@dataclass(frozen=True, eq=False)
class InputGrid:
    """The inputs of a grid of axes; the other inputs stay where they are.

    Attributes
    ----------
    names : tuple of Driven
        The inputs.
    held : array (k,), array (k,)
        What the grid does not move, as it is shown and in SI.
    rates : dict of Driven to float
        Rates that a row of a table gives all poses.
    """

    grid: Grid
    names: tuple[Driven, ...]
    held: Values
    rates: dict[Driven, float] = field(default_factory=dict)

    @property
    def n(self) -> int:
        """How many poses."""
        return self.grid.n

    @property
    def orders(self) -> set[int]:
        """Of which orders there are rates."""
        named = (*self.grid.names, *self.rates)
        return {name.order for name in named if isinstance(name, Driven) and name.order}

    @property
    def span(self) -> tuple[float, float]:
        """The least and the largest value of the first input."""
        if len(self.grid.axes) > 1 or self.grid.axes[0].steps is None:
            return self.whole.span
        ends = [float(self.part(i, i + 1).values[0, 0]) for i in (0, self.n - 1)]
        return min(ends), max(ends)

    def part(self, low: int, high: int) -> Inputs:
        """The poses from low to high, or to the last."""
        moved = self.grid.part(low, high)
        n = len(moved.shown)
        # what is held, and in its place what the grid moves
        shown, values = (np.tile(held, (n, 1)) for held in self.held)
        rates = {order: np.zeros((n, len(self.names))) for order in self.orders}
        for name, rate in self.rates.items():
            rates[name.order][:, name.j] = rate
        for i, of in enumerate(self.grid.names):
            assert isinstance(of, Driven)
            if of.order:
                rates[of.order][:, of.j] = moved.si[:, i]
            else:
                shown[:, of.j], values[:, of.j] = moved.shown[:, i], moved.si[:, i]
        return Inputs(values, shown, rates.get(1), rates.get(2), moved.labels, moved.time)

    @cached_property
    def whole(self) -> Inputs:
        """All poses, listed."""
        return self.part(0, self.n)


def of_one(
    m: Mechanism, grid: Grid | None, row: Sequence[tuple[Driven, float, float]] = ()
) -> Inputs | InputGrid:
    """The inputs of a mechanism: those of a grid, held at its own pose where the grid moves none.

    `row`: inputs and rates that a row of variants sets, as they are shown and in SI.
    """
    names = tuple(Driven.of(m, j) for j in range(len(m.inputs)))
    own = [m.at[j] if e.value is None else e.value for j, e in enumerate(m.inputs)]
    shown = [name.shown(value) for name, value in zip(names, own, strict=True)]
    rates = {}
    for name, value, si in row:
        if name.order:
            rates[name] = si
        else:
            shown[name.j], own[name.j] = value, si
    held = Values(np.array(shown, dtype=float), np.array(own, dtype=float))
    if grid is not None:
        return InputGrid(grid, names, held, rates)
    listed = {
        order: np.array([[rates.get(name.rate(order), 0.0) for name in names]])
        for order in (1, 2)
        if any(name.order == order for name in rates)
    }
    return Inputs(held.si[None], held.shown[None], listed.get(1), listed.get(2), ["1"])
