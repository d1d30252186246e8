"""The inputs of every pose: what varies, an input, its rate or a dimension; the axes of its values, and their grid.

An axis holds one number of a range, or several side by side: the rows of a table. The cases are the grid of all axes,
the last fastest. The inputs of the poses are formed when they are needed, a part at a time where they are many.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.read.options import Steps
from dalembert.angles import read_degrees, read_radians
from dalembert.dataclass import dataclass, field, replace
from dalembert.units import UNITS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dalembert.arithmetic.doubled import Doubled
    from virtualwork import Mechanism
    from virtualwork.describe.dimensions import Dimension

    Reals = NDArray[np.float64]

# of an input: its value, and its rates as a table's header and a description call them
RATES = ("", "speed", "acceleration")


@dataclass(frozen=True)
class Driven:
    """An input, or a rate of it.

    Attributes
    ----------
    j : int
        Its place among the inputs.
    name : str
    slides : bool
    order : int
        0: its value; 1: its speed; 2: its acceleration.
    """

    j: int
    name: str
    slides: bool
    order: int = 0

    @classmethod
    def of(cls, m: Mechanism, j: int) -> Driven:
        """Return the value of an input."""
        return cls(j, m.inputs[j].name, m.inputs[j].is_slide)

    @classmethod
    def all(cls, m: Mechanism, j: int) -> Iterator[Driven]:
        """Return the value of an input and its rates."""
        value = cls.of(m, j)
        return (value.rate(k) for k in range(3))

    def rate(self, order: int) -> Driven:
        """Return the rate of this order."""
        return Driven(self.j, self.name, self.slides, order)

    @property
    def label(self) -> str:
        """Its header without the unit: `crank`, `crank_speed`."""
        return f"{self.name}_{RATES[self.order]}" if self.order else self.name

    @property
    def dimension(self) -> str:
        """Its dimension, as the tables name it."""
        kinds = (
            ("length", "velocity", "acceleration")
            if self.slides
            else ("angle", "speed", "angular acceleration")
        )
        return kinds[self.order]

    @property
    def unit(self) -> str:
        """The unit that it is shown in."""
        return ("m" if self.slides else "deg") if not self.order else next(iter(UNITS[self.dimension]))

    def shown(self, si: float) -> float:
        """Return a value as it is shown."""
        return si if self.slides or self.order else read_degrees(si)

    def own(self, m: Mechanism) -> float:
        """Return the file's own value as it is shown; where the file has none, that of the guess."""
        value = m.inputs[self.j].value
        return self.shown(m.at[self.j] if value is None else value)

    @property
    def kind(self) -> str:
        """The unit that a bare number of it takes, as `[units]` of a file has it."""
        return "length" if self.slides else "angle"


@dataclass(frozen=True)
class Varied:
    """A dimension, by its path in the file."""

    of: Dimension

    @property
    def label(self) -> str:
        """Its path."""
        return self.of.path

    @property
    def dimension(self) -> str:
        """Its dimension, as the tables name it."""
        return self.of.kind

    @property
    def unit(self) -> str:
        """The unit that it is shown in."""
        return self.of.unit

    @property
    def kind(self) -> str:
        """The unit that a bare number of it takes, as `[units]` of a file has it."""
        return self.of.kind

    def si(self, shown: float) -> float:
        """Return a value in SI."""
        return math.radians(shown) if self.of.unit == "deg" else shown


def with_numbers(m: Mechanism, dimensions: Sequence[Dimension], shown: Sequence[float]) -> Mechanism:
    """Return the mechanism with other numbers, which are as they are shown."""
    from virtualwork.describe.dimensions import changed

    numbers = {d.path: Varied(d).si(value) for d, value in zip(dimensions, shown, strict=True)}
    if m.decimals is not None:
        read = ((d.kind, numbers[d.path], x, _factor(d)) for d, x in zip(dimensions, shown, strict=True))
        m = replace(m, decimals=m.decimals.and_also(read))
    return changed(m, numbers)


def _factor(dimension: Dimension) -> tuple[float, float]:
    """Return numerator and denominator that take a number as it is shown to SI."""
    return (math.pi, 180) if dimension.unit == "deg" else (1, 1)


# --- axes, and their grid ---------------------------------------------------------------------------------------------
class Values(NamedTuple):
    """The values of an axis at some places."""

    shown: Reals
    """(places, numbers): SI, but angles in degrees."""
    si: Reals


class GridRows(NamedTuple):
    """Some rows of a grid."""

    shown: Reals
    """(rows, names): SI, but angles in degrees."""
    si: Reals
    labels: list[str]
    """The names of the rows: those of a table, else their numbers from 1."""
    time: Reals | None
    """The times of a law of motion, s."""


@dataclass(frozen=True, eq=False)
class Axis:
    """Numbers that vary together: a range of one, or the rows of several.

    Attributes
    ----------
    option : str
        Where they were requested, for messages.
    names : tuple of Driven or Varied
        The inputs, rates of inputs or dimensions that they are values of.
    steps : Steps, optional
        The range.
    rows : Values, optional
    labels : sequence of str, optional
        The names of the rows.
    time : array, optional
        The times of the rows, s.
    """

    option: str
    names: tuple[Driven | Varied, ...]
    steps: Steps | None = None
    rows: Values | None = None
    labels: Sequence[str] | None = None
    time: Reals | None = None

    @property
    def n(self) -> int:
        """The number of values."""
        if self.steps is not None:
            return self.steps.n
        return 0 if self.rows is None else len(self.rows.shown)

    def at(self, i: NDArray[np.intp]) -> Values:
        """Return the values at some places."""
        if self.rows is not None:
            return Values(self.rows.shown[i], self.rows.si[i])
        assert self.steps is not None
        shown = self.steps.at(i)[:, None]
        return Values(shown, _in_si(self.names, shown))


def axis_of_rows(
    option: str,
    names: Sequence[Driven | Varied],
    shown: Reals,
    si: Reals | None = None,
    labels: Sequence[str] | None = None,
    time: Reals | None = None,
) -> Axis:
    """Return an axis of rows."""
    if si is None:
        si = shown.copy()
        for j, name in enumerate(names):
            if name.unit == "deg":
                si[:, j] = list(map(read_radians, shown[:, j].tolist()))
    rows = Values(shown, si)
    return Axis(option, tuple(names), rows=rows, labels=labels, time=time)


def _in_si(names: Sequence[Driven | Varied], shown: Reals) -> Reals:
    degrees = [name.unit == "deg" for name in names]
    return np.where(degrees, np.radians(shown), shown)


@dataclass(frozen=True, eq=False)
class Grid:
    """All combinations of the values of some axes, the last fastest."""

    axes: tuple[Axis, ...]

    @cached_property
    def names(self) -> tuple[Driven | Varied, ...]:
        """The inputs, rates and dimensions of the columns."""
        return tuple(name for axis in self.axes for name in axis.names)

    @cached_property
    def n(self) -> int:
        """The number of combinations."""
        return math.prod(axis.n for axis in self.axes)

    def part(self, low: int, high: int) -> GridRows:
        """Return the rows from low to high, or to the last."""
        axes, high = self.axes, min(high, self.n)
        places: Any = np.arange(low, high)
        each = np.unravel_index(places, [axis.n for axis in axes]) if len(axes) > 1 else [places]
        parts = [axis.at(i) for axis, i in zip(axes, each, strict=True)]
        shown, si = (np.concatenate(values, axis=1) for values in zip(*parts, strict=True))
        # the names and times of the rows of a table, where nothing else varies
        names, time = (axes[0].labels, axes[0].time) if len(axes) == 1 else (None, None)
        labels = [str(i + 1) for i in range(low, high)] if names is None else list(names[low:high])
        return GridRows(shown, si, labels, None if time is None else time[low:high])


# --- the inputs of the poses of one mechanism -------------------------------------------------------------------------
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
        """The number of poses."""
        return len(self.shown)

    @property
    def orders(self) -> set[int]:
        """The orders of the rates that are given."""
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
        """Return the exact inputs, by their decimals in degrees, metres or radians, less the floats in SI, (n, k)."""
        from dalembert.arithmetic.doubled import PI, Doubled

        rest = np.zeros(self.values.shape)
        for j, (si, shown) in enumerate(zip(self.values.T, self.shown.T, strict=True)):
            exact, unit = decimals(shown), 1.0 if np.array_equal(si, shown) else PI / 180.0
            if exact is None and (exact := decimals(si)) is not None:
                # it is written in radians
                unit = 1.0
            rest[:, j] = ((exact or Doubled(shown)) * unit - Doubled(si)).value
        return rest

    def part(self, low: int, high: int) -> Inputs:
        """Return the poses from low to high."""
        speed, acceleration = (None if r is None else r[low:high] for r in (self.speed, self.acceleration))
        time = None if self.time is None else self.time[low:high]
        return Inputs(
            self.values[low:high], self.shown[low:high], speed, acceleration, self.steps[low:high], time
        )


def decimals(shown: Reals) -> Doubled | None:
    """Return the decimals of numbers in 32 digits; None of numbers with many decimals.

    >>> float(decimals(np.array([0.1, 2.5])).low[0])
    -5.551115123125783e-18
    """
    from dalembert.arithmetic.doubled import Doubled

    for places in range(13):
        whole = np.rint(shown * 10.0**places)
        if (np.abs(whole) < 2.0**53).all() and (whole / 10.0**places == shown).all():
            return Doubled(whole) / 10.0**places
    return None


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
        """The number of poses."""
        return self.grid.n

    @property
    def orders(self) -> set[int]:
        """The orders of the rates that are given."""
        named = (*self.grid.names, *self.rates)
        return {name.order for name in named if isinstance(name, Driven) and name.order}

    @property
    def span(self) -> tuple[float, float]:
        """The least and the largest value of the first input."""
        first, *others = self.grid.axes
        if others or first.steps is None:
            return self.whole.span
        if first.names[0] != self.names[0]:
            return (float(self.held.si[0]),) * 2
        ends = first.at(np.array([0, first.n - 1])).si[:, 0].tolist()
        return min(ends), max(ends)

    def part(self, low: int, high: int) -> Inputs:
        """Return the poses from low to high, or to the last."""
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
    """Return the inputs of a mechanism: those of a grid; an input that the grid does not move stays at the file's pose.

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
