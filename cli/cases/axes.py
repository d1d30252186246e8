"""Axes: the values that inputs and dimensions go through, one by one, of `--at`, `--over` and `--cases`.

An axis holds one number of a range, or several side by side: the rows of a table. The cases are the grid of all axes,
the last fastest.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cli.cases.values import Driven, Varied, dimension_named, driven, quantity
from cli.read import options
from cli.read.options import Steps
from dalembert.dataclass import dataclass
from dalembert.errors import DataError
from dalembert.units import UNITS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork import Mechanism

    Reals = NDArray[np.float64]

# cases of one call: beyond it a double cannot count them
MOST = 10**15
TIMES = ("time", "t")


class Values(NamedTuple):
    """The values of an axis at some places."""

    shown: Reals
    """(places, numbers): SI, but angles in degrees."""
    si: Reals


class Part(NamedTuple):
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
        """How many values."""
        if self.steps is not None:
            return self.steps.n
        return 0 if self.rows is None else len(self.rows.shown)

    def at(self, i: NDArray[np.intp]) -> Values:
        """The values at some places."""
        if self.rows is not None:
            return Values(self.rows.shown[i], self.rows.si[i])
        assert self.steps is not None
        shown = self.steps.at(i)[:, None]
        return Values(shown, _in_si(self.names, shown))

    @property
    def of_inputs(self) -> bool:
        """Whether it moves inputs alone."""
        return all(isinstance(name, Driven) for name in self.names)


def listed(
    option: str,
    names: Sequence[Driven | Varied],
    shown: Reals,
    si: Reals | None = None,
    labels: Sequence[str] | None = None,
    time: Reals | None = None,
) -> Axis:
    """An axis of rows."""
    rows = Values(shown, _in_si(names, shown) if si is None else si)
    return Axis(option, tuple(names), rows=rows, labels=labels, time=time)


def _in_si(names: Sequence[Driven | Varied], shown: Reals) -> Reals:
    degrees = [name.unit == "deg" for name in names]
    return np.where(degrees, np.radians(shown), shown)


# --- --at and --over --------------------------------------------------------------------------------------------------
def at_axis(m: Mechanism, texts: Sequence[str], bare: Mapping[str, str]) -> Axis:
    """`--at crank=60deg,arm=30deg`, repeated: a row for each."""
    rows = [input_values(m, text, "--at", bare) for text in texts]
    names = [Driven.of(m, j) for j in sorted({j for row in rows for j in row})]
    shown = [[row.get(name.j, name.own(m)) for name in names] for row in rows]
    return listed("--at", names, np.array(shown, dtype=float))


def input_values(m: Mechanism, text: str, flag: str, bare: Mapping[str, str]) -> dict[int, float]:
    """`crank=60deg,arm=30deg` as it is shown, by input; a bare value is the only input's."""
    names = [e.name for e in m.inputs]
    result: dict[int, float] = {}
    for part in text.split(","):
        name, equals, value = part.partition("=")
        if not equals:
            if len(names) > 1:
                raise options.bad(
                    flag, f"'{text}': expected a value for each input, such as {names[0]}=...,{names[1]}=..."
                )
            name, value = names[0], part
        j = driven(m, name.strip(), text, flag)
        if j in result:
            raise options.bad(flag, f"'{text}': {name.strip()} is given twice")
        result[j] = quantity(Driven.of(m, j), value.strip(), flag, bare)
    return result


def over_axis(m: Mechanism, text: str, bare: Mapping[str, str]) -> Axis:
    """`--over 0deg:360deg:1deg`, or `--over NAME=FROM:TO:STEP` for any input or dimension."""
    name, equals, span = text.rpartition("=")
    of: Driven | Varied
    if not equals:
        if len(m.inputs) > 1:
            inputs = " or ".join(e.name for e in m.inputs)
            raise options.bad("--over", f"'{text}': expected the name of an input too, {inputs}: NAME={text}")
        of = Driven.of(m, 0)
    elif name.strip() in [e.name for e in m.inputs]:
        of = Driven.of(m, [e.name for e in m.inputs].index(name.strip()))
    else:
        of = dimension_named(m, name.strip(), text, "--over")
    steps = options.steps("--over", span, lambda part: quantity(of, part, "--over", bare), "0deg:360deg:1deg")
    if steps.n > MOST:
        raise options.bad("--over", f"'{span}': {steps.n:.3g} values: expected at most {MOST:.0e}")
    return Axis("--over", (of,), steps)


# --- --cases ----------------------------------------------------------------------------------------------------------
def cases_axis(m: Mechanism, path: str, elsewhere: set[int], remarks: list[str]) -> Axis:
    """`--cases FILE.csv`: a column for each input or dimension, `crank_deg`, `links.crank.B.x_mm`; a row for each case.

    With `t_s` the speeds of the inputs follow from a spline over time; columns such as `crank_speed_rad_s` give them.
    `elsewhere` are the inputs that other options hold.
    """
    from dalembert.tables.table import read
    from virtualwork.describe import DescriptionError
    from virtualwork.describe.dimensions import dimensions, named

    every = dimensions(m)
    inputs = {name.label.lower(): name for j in range(len(m.inputs)) for name in Driven.all(m, j)}
    varied = {path.lower(): Varied(of) for path, of in every.items()}
    names: dict[str, Driven | Varied] = {**varied, **inputs}
    kinds = dict.fromkeys(TIMES, "time") | {name: of.dimension for name, of in names.items()}
    table = read(path, numbers=kinds, texts=("step", "variant"))
    used = {column.header for column in table.numbers.values()}
    for header in table.header:
        if "." in header and header not in used:
            try:
                (*_, last) = named(m, header.strip(), every)
            except DescriptionError as error:
                raise DataError(f"{table.file}: column {header}: {error}") from None
            raise DataError(f"{table.file}: column {header}: expected one number, such as {last.header}")
    columns = {names[name]: column for name, column in table.numbers.items() if name in names}
    if not columns:
        wanted = [_headers(Driven.of(m, j)) for j in range(len(m.inputs))]
        raise DataError(
            f"{table.file}: no column names an input or a dimension, such as {', '.join(wanted)} or "
            f"{next(iter(every.values())).header} {table.told}"
        )
    driven_here = {name.j for name in columns if isinstance(name, Driven)}
    for j in range(len(m.inputs)):
        if driven_here and j not in driven_here | elsewhere:
            raise DataError(
                f"{table.file}: no column {_headers(Driven.of(m, j))} for the input '{m.inputs[j].name}' {table.told}"
            )
    remarks += table.warnings
    shown, si = [], []
    for name, column in columns.items():
        value = column.si
        si.append(value)
        in_degrees = column.values if column.unit == "deg" else np.degrees(value)
        shown.append(in_degrees if name.unit == "deg" else value)
    order = list(columns)
    values = np.array(si).T
    time = next((table.numbers[t].si for t in TIMES if t in table.numbers), None)
    rates = [name for name in order if isinstance(name, Driven) and name.order]
    if rates:
        order, shown, values = _with_rates_at_rest(m, order, shown, values)
    elif time is not None and driven_here:
        here = [i for i, name in enumerate(order) if isinstance(name, Driven)]
        speed, acceleration = rates_over_time(path, time, values[:, here])
        order = [*order, *(order[i].rate(1) for i in here), *(order[i].rate(2) for i in here)]  # type: ignore[union-attr]
        shown = [*shown, *speed.T, *acceleration.T]
        values = np.concatenate([values, speed, acceleration], axis=1)
    if time is not None and not (np.diff(time) > 0).all():
        raise DataError(f"{path}: time_s: expected rows with rising time")
    return listed("--cases", order, np.array(shown).T, values, table.texts.get("step"), time)


def _headers(of: Driven) -> str:
    return " or ".join(f"{of.label}_{unit}" for unit in list(UNITS[of.dimension])[:2])


def _with_rates_at_rest(
    m: Mechanism, order: list[Driven | Varied], shown: list[Reals], values: Reals
) -> tuple[list[Driven | Varied], list[Reals], Reals]:
    """Where a table has the speed of one input, others have none: zero."""
    zero = np.zeros(len(values))
    for k in (1, 2):
        if any(isinstance(name, Driven) and name.order == k for name in order):
            missing = [Driven.of(m, j).rate(k) for j in range(len(m.inputs))]
            missing = [name for name in missing if name not in order]
            order, shown = [*order, *missing], [*shown, *([zero] * len(missing))]
            values = np.concatenate([values, np.zeros((len(values), len(missing)))], axis=1)
    return order, shown, values


def rates_over_time(path: str, time: Reals, q: Reals) -> tuple[Reals, Reals]:
    """Speed and acceleration of a law of motion over time: those of the cubic spline through its rows."""
    if len(time) < 4 or not (np.diff(time) > 0).all():
        raise DataError(
            f"{path}: time_s: expected at least 4 rows with rising time, for the speeds of the law of motion"
        )
    from scipy.interpolate import CubicSpline

    with np.errstate(all="ignore"):
        try:
            spline = CubicSpline(time, q, axis=0)
            speed, acceleration = spline(time, 1), spline(time, 2)
        except (ValueError, np.linalg.LinAlgError):
            speed = acceleration = np.array([np.nan])
    if not (np.isfinite(speed).all() and np.isfinite(acceleration).all()):
        raise DataError(f"{path}: time_s: rows too close in time for the speeds of the law of motion")
    return speed, acceleration


def history_axis(m: Mechanism) -> Axis:
    """The laws of motion that stand in the file as tables over time."""
    laws = [np.array(e.history) if e.history else None for e in m.inputs]
    first = next(law for law in laws if law is not None)
    time = first[:, 0]
    names = [Driven.of(m, j) for j in range(len(laws))]
    q = np.empty((len(time), len(laws)))
    for j, law in enumerate(laws):
        if law is None:
            q[:, j] = m.at[j] if m.inputs[j].value is None else m.inputs[j].value
        elif np.array_equal(law[:, 0], time):
            q[:, j] = law[:, 1]
        else:
            raise DataError("[[input]] law: the tables of several inputs must have the same times")
    speed, acceleration = rates_over_time("[input] law", time, q)
    shown = np.array([[name.shown(v) for name, v in zip(names, row, strict=True)] for row in q])
    order = [*names, *(name.rate(1) for name in names), *(name.rate(2) for name in names)]
    si = np.concatenate([q, speed, acceleration], axis=1)
    shown = np.concatenate([shown, speed, acceleration], axis=1)
    return listed("[input] law", order, shown, si, time=time)


# --- the grid of some axes --------------------------------------------------------------------------------------------
@dataclass(frozen=True, eq=False)
class Grid:
    """All combinations of the values of some axes, the last fastest."""

    axes: tuple[Axis, ...]

    @cached_property
    def names(self) -> tuple[Driven | Varied, ...]:
        """What the columns are values of."""
        return tuple(name for axis in self.axes for name in axis.names)

    @cached_property
    def n(self) -> int:
        """How many there are."""
        return math.prod(axis.n for axis in self.axes)

    def part(self, low: int, high: int) -> Part:
        """The rows from low to high, or to the last."""
        axes, high = self.axes, min(high, self.n)
        places: Any = np.arange(low, high)
        each = np.unravel_index(places, [axis.n for axis in axes]) if len(axes) > 1 else [places]
        parts = [axis.at(i) for axis, i in zip(axes, each, strict=True)]
        shown, si = (np.concatenate(values, axis=1) for values in zip(*parts, strict=True))
        # the names and times of the rows of a table, where nothing else varies
        names, time = (axes[0].labels, axes[0].time) if len(axes) == 1 else (None, None)
        labels = [str(i + 1) for i in range(low, high)] if names is None else list(names[low:high])
        return Part(shown, si, labels, None if time is None else time[low:high])


def grids(
    m: Mechanism,
    at: Sequence[str] | None,
    over: Sequence[str] | None,
    cases: str | None,
    bare: Mapping[str, str],
    remarks: list[str],
) -> tuple[Grid | None, Grid | None]:
    """The grid of what makes variants, and that of inputs alone; None where no option moves such."""
    axes = [over_axis(m, text, bare) for text in over or ()]
    if at:
        axes = [at_axis(m, at, bare), *axes]
    if cases is not None:
        elsewhere = {name.j for axis in axes for name in axis.names if isinstance(name, Driven)}
        axes = [cases_axis(m, cases, elsewhere, remarks), *axes]
    seen: dict[Driven | Varied, str] = {}
    for axis in axes:
        for name in axis.names:
            if name in seen:
                both = axis.option if axis.option == seen[name] else f"{seen[name]} and {axis.option}"
                raise options.bad(
                    axis.option, f"{name.label} is given twice, by {both}: expected one of them"
                )
            seen[name] = axis.option
    if math.prod(axis.n for axis in axes) > MOST:
        raise options.bad(
            "--over", f"{float(math.prod(axis.n for axis in axes)):.3g} cases: expected at most {MOST:.0e}"
        )
    varied = tuple(axis for axis in axes if not axis.of_inputs)
    moved = tuple(axis for axis in axes if axis.of_inputs)
    if not moved and not any(isinstance(name, Driven) for name in seen) and any(e.history for e in m.inputs):
        moved = (history_axis(m),)
    return Grid(varied) if varied else None, Grid(moved) if moved else None
