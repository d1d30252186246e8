"""The inputs of every pose: what varies, an input, its rate or a dimension; the axes of its values, and their grid.

An axis holds one number of a range, or several side by side: the rows of a table. The cases are the grid of all axes,
the last fastest. The inputs of the poses are formed when they are needed, a part at a time where they are many.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dalembert.angles import read_degrees
from dalembert.dataclass import dataclass, field, replace
from dalembert.units import UNITS
from dalembert.written import ROWS, Range, Written

if TYPE_CHECKING:
    from numpy.typing import NDArray

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

    def own(self, m: Mechanism) -> Written:
        """Return the file's own value; where the file has none, that of the guess."""
        value = m.inputs[self.j].value
        si = m.at[self.j] if value is None else value
        return Written(self.shown(si), si, m.decimals.rest(self.dimension, si) if m.decimals else 0.0)

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


def with_numbers(m: Mechanism, dimensions: Sequence[Dimension], numbers: Sequence[Written]) -> Mechanism:
    """Return the mechanism with other numbers."""
    from virtualwork.describe.dimensions import changed

    if m.decimals is not None:
        rests = ((d.kind, each.si, each.rest) for d, each in zip(dimensions, numbers, strict=True))
        m = replace(m, decimals=m.decimals.and_also(rests))
    return changed(m, {d.path: each.si for d, each in zip(dimensions, numbers, strict=True)})


# --- axes, and their grid ---------------------------------------------------------------------------------------------
class GridRows(NamedTuple):
    """Some rows of a grid."""

    shown: Reals
    """(rows, names): SI, but angles in degrees."""
    si: Reals
    labels: list[str]
    """The names of the rows: those of a table, else their numbers from 1."""
    time: Reals | None
    """The times of a law of motion, s."""
    rest: Callable[[], Reals]
    """The exact numbers less their floats, SI."""


@dataclass(frozen=True, eq=False)
class Axis:
    """Numbers that vary together: a range of one, or the rows of several.

    Attributes
    ----------
    option : str
        Where they were requested, for messages.
    names : tuple of Driven or Varied
        The inputs, rates of inputs or dimensions that they are values of.
    range : Range, optional
    rows : array (rows, names), optional
        Of `Written` numbers.
    labels : sequence of str, optional
        The names of the rows.
    time : array, optional
        The times of the rows, s.
    rest : function, optional
        Returns what the first names of the rows are exactly less their floats, SI, where the rows do not have it: of a long
        table it takes time.
    """

    option: str
    names: tuple[Driven | Varied, ...]
    range: Range | None = None
    rows: NDArray[Any] | None = None
    labels: Sequence[str] | None = None
    time: Reals | None = None
    rest: Callable[[], Reals] | None = None

    @property
    def n(self) -> int:
        """The number of values."""
        if self.range is not None:
            return self.range.steps.n
        return 0 if self.rows is None else len(self.rows)

    def at(self, i: NDArray[np.intp]) -> tuple[Reals, Reals]:
        """Return the values at some places as they are shown, and in SI, (places, names)."""
        if self.rows is not None:
            return self.rows["shown"][i], self.rows["si"][i]
        assert self.range is not None
        shown, si = self.range.at(i)
        return shown[:, None], si[:, None]

    def rest_at(self, i: NDArray[np.intp]) -> Reals:
        """Return the exact values at some places less their floats, SI."""
        if self.range is not None:
            return np.asarray((self.range.exact(i) - self.range.at(i)[1]).value)[:, None]
        return self._rests[i]

    @cached_property
    def _rests(self) -> Reals:
        """Those of all rows."""
        assert self.rows is not None
        if self.rest is None:
            return np.asarray(self.rows["rest"])
        rest = self.rest()
        return np.pad(rest, ((0, 0), (0, len(self.names) - rest.shape[1])))


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
        parts = [axis.at(i) for axis, i in self._places(low, high)]
        shown, si = (np.concatenate(values, axis=1) for values in zip(*parts, strict=True))
        # the names and times of the rows of a table, where nothing else varies
        names, time = (axes[0].labels, axes[0].time) if len(axes) == 1 else (None, None)
        labels = [str(i + 1) for i in range(low, high)] if names is None else list(names[low:high])
        rest = partial(self.rest, low, high)
        return GridRows(shown, si, labels, None if time is None else time[low:high], rest)

    def rest(self, low: int, high: int) -> Reals:
        """Return the exact numbers of the rows from low to high less their floats, SI."""
        return np.concatenate([axis.rest_at(i) for axis, i in self._places(low, high)], axis=1)

    def written(self, low: int, high: int) -> NDArray[Any]:
        """Return the rows from low to high, or to the last, as `Written` numbers."""
        part = self.part(low, high)
        rows = np.empty(part.si.shape, dtype=ROWS)
        rows["shown"], rows["si"], rows["rest"] = part.shown, part.si, part.rest()
        return rows

    def _places(self, low: int, high: int) -> Iterator[tuple[Axis, NDArray[np.intp]]]:
        """Yield each axis with the places in it of the rows from low to high."""
        places: Any = np.arange(low, high)
        several = len(self.axes) > 1
        each = np.unravel_index(places, [axis.n for axis in self.axes]) if several else [places]
        return zip(self.axes, each, strict=True)


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
    rest: Callable[[], Reals] | None = None
    """What the inputs are exactly less their floats, SI, (n, k)."""

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

    def part(self, low: int, high: int) -> Inputs:
        """Return the poses from low to high."""
        speed, acceleration = (None if r is None else r[low:high] for r in (self.speed, self.acceleration))
        time = None if self.time is None else self.time[low:high]
        rest = None if self.rest is None else partial(_rows_of, self.rest, low, high)
        return Inputs(
            self.values[low:high], self.shown[low:high], speed, acceleration, self.steps[low:high], time, rest
        )


def _rows_of(rest: Callable[[], Reals], low: int, high: int) -> Reals:
    return rest()[low:high]


@dataclass(frozen=True, eq=False)
class InputGrid:
    """The inputs of a grid of axes; the other inputs stay where they are.

    Attributes
    ----------
    names : tuple of Driven
        The inputs.
    held : sequence of Written
        What the grid does not move.
    rates : dict of Driven to float
        Rates that a row of a table gives all poses.
    """

    grid: Grid
    names: tuple[Driven, ...]
    held: Sequence[Written]
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
        if others or first.range is None:
            return self.whole.span
        if first.names[0] != self.names[0]:
            return (self.held[0].si,) * 2
        ends = first.at(np.array([0, first.n - 1]))[1][:, 0].tolist()
        return min(ends), max(ends)

    def part(self, low: int, high: int) -> Inputs:
        """Return the poses from low to high, or to the last."""
        moved = self.grid.part(low, high)
        n = len(moved.shown)
        # what is held, and in its place what the grid moves
        shown, values = (np.tile([each[i] for each in self.held], (n, 1)) for i in range(2))
        rates = {order: np.zeros((n, len(self.names))) for order in self.orders}
        for name, rate in self.rates.items():
            rates[name.order][:, name.j] = rate
        for i, of in enumerate(self.grid.names):
            assert isinstance(of, Driven)
            if of.order:
                rates[of.order][:, of.j] = moved.si[:, i]
            else:
                shown[:, of.j], values[:, of.j] = moved.shown[:, i], moved.si[:, i]
        rest = partial(self._rest, moved.rest, n)
        return Inputs(values, shown, rates.get(1), rates.get(2), moved.labels, moved.time, rest)

    def _rest(self, moved: Callable[[], Reals], n: int) -> Reals:
        """Return the exact inputs less their floats, SI, where the grid moves some."""
        rest = np.tile([each.rest for each in self.held], (n, 1))
        for of, column in zip(self.grid.names, moved().T, strict=True):
            assert isinstance(of, Driven)
            if not of.order:
                rest[:, of.j] = column
        return rest

    @cached_property
    def whole(self) -> Inputs:
        """All poses, listed."""
        return self.part(0, self.n)


def of_one(m: Mechanism, grid: Grid | None, row: Sequence[tuple[Driven, Written]] = ()) -> Inputs | InputGrid:
    """Return the inputs of a mechanism: those of a grid; an input that the grid does not move stays at the file's pose.

    `row`: inputs and rates that a row of variants sets.
    """
    names = tuple(Driven.of(m, j) for j in range(len(m.inputs)))
    held = [name.own(m) for name in names]
    rates = {}
    for name, value in row:
        if name.order:
            rates[name] = value.si
        else:
            held[name.j] = value
    if grid is not None:
        return InputGrid(grid, names, held, rates)
    listed = {
        order: np.array([[rates.get(name.rate(order), 0.0) for name in names]])
        for order in (1, 2)
        if any(name.order == order for name in rates)
    }
    shown, si, rest = (np.array([row], dtype=float) for row in zip(*held, strict=True))
    return Inputs(si, shown, listed.get(1), listed.get(2), ["1"], rest=rest.copy)
