"""The options that say which poses, and which mechanism: `--at`, `--over`, `--cases` as axes, `--set` as numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cli.cases.inputs import Axis, Driven, Grid, Varied, axis_of_rows, with_numbers
from cli.read import options
from dalembert.angles import read_degrees
from dalembert.errors import DataError
from dalembert.hints import nearest
from dalembert.quantities import is_number, parse_number, parse_quantity
from dalembert.units import UNITS, to_si
from virtualwork.describe import DescriptionError
from virtualwork.describe.units import Units

if TYPE_CHECKING:
    from decimal import Decimal

    from numpy.typing import NDArray

    from dalembert.tables.table import Numbers
    from virtualwork import Mechanism
    from virtualwork.describe.dimensions import Dimension

    Reals = NDArray[np.float64]

# cases of one call: beyond it a double cannot count them
MOST = 10**15
TIMES = ("time", "t")


# --- a name and its value ---------------------------------------------------------------------------------------------
def driven(m: Mechanism, name: str, text: str, flag: str) -> int:
    """Return the index of an input."""
    names = [e.name for e in m.inputs]
    if name not in names:
        raise options.bad(
            flag, f"'{text}': no input drives '{name}': expected {', '.join(names)}{nearest(name, names)}"
        )
    return names.index(name)


def dimension_named(m: Mechanism, path: str, text: str, flag: str) -> Varied:
    """Return the one dimension that a path names."""
    first, *both = _named(m, path, flag)
    if both:
        raise options.bad(flag, f"'{text}': two numbers: expected {first.path} or {both[0].path}")
    return Varied(first)


def assigned_paths(m: Mechanism, text: str, flag: str, what: str) -> tuple[tuple[Dimension, ...], str]:
    """Part `NAME=VALUE`, and find the dimensions that it names."""
    path, equals, value = text.rpartition("=")
    if not equals or not path.strip():
        raise options.bad(flag, f"'{text}': expected NAME={what}, such as links.crank.B.x=...")
    return _named(m, path.strip(), flag), value


def _named(m: Mechanism, path: str, flag: str) -> tuple[Dimension, ...]:
    """Return the dimensions that a path names."""
    from virtualwork.describe.dimensions import dimensions, named

    try:
        return named(m, path)
    except DescriptionError as error:
        inputs = [str(entry.name) for entry in m.inputs]
        if path in inputs:
            place = ("inputs", inputs.index(path), "value")
            own = next(each.path for each in dimensions(m).values() if each.where == place)
            raise options.bad(flag, f"'{path}' is an input: expected its place in the file, {own}") from None
        hint = "" if "did you mean" in str(error) else nearest(path, inputs)
        raise options.bad(flag, f"{error}{hint}") from None


def assigned(m: Mechanism, bare: Mapping[str, str], texts: Sequence[str]) -> Mechanism:
    """Return the mechanism after every `--set NAME=VALUE`; a point takes both coordinates as `X,Y`."""
    numbers: dict[Dimension, float] = {}
    for text in texts:
        dimensions, value = assigned_paths(m, text, "--set", "VALUE")
        parts = value.split(",")
        if len(parts) != len(dimensions):
            wanted = "one value" if len(dimensions) == 1 else "two values X,Y"
            raise options.bad("--set", f"'{text}': expected {wanted} for {text.rpartition('=')[0]}")
        for dimension, part in zip(dimensions, parts, strict=True):
            if dimension in numbers:
                raise options.bad("--set", f"'{text}': {dimension.path} is given twice")
            numbers[dimension] = quantity(Varied(dimension), part, "--set", bare)
    try:
        return with_numbers(m, list(numbers), list(numbers.values()))
    except DescriptionError as error:
        raise options.bad("--set", error) from None


def quantity(of: Driven | Varied, text: str, flag: str, bare: Mapping[str, str]) -> float:
    """Return a value as it is shown: SI, angles in degrees; a bare number is in the unit of the file."""
    return quantities(of, [text], flag, bare)[0]


def quantities(of: Driven | Varied, texts: Sequence[str], flag: str, bare: Mapping[str, str]) -> list[float]:
    """Return values as they are shown: SI, angles in degrees; a bare number is in the unit of the file."""
    kind, values = of.kind, []
    for text in texts:
        if isinstance(of, Driven) or (
            kind in ("length", "angle") and not (is_number(text) and kind not in bare)
        ):
            values.append(place_or_angle(text, kind, flag, bare))
            continue
        try:
            si = Units({}).number(text.strip(), kind, of.label)
        except DescriptionError as error:
            raise options.bad(flag, error) from None
        values.append(read_degrees(si) if of.unit == "deg" else si)
    return values


def place_or_angle(text: str, kind: str, flag: str, bare: Mapping[str, str]) -> float:
    """Return a length in metres, or an angle in degrees; an angle that is typed in degrees keeps its digits."""
    named_unit = bare.get(kind)
    if named_unit is not None and is_number(text):
        if named_unit in ("deg", "°"):
            return parse_number(text)
        si = Units({kind: named_unit}).number(text, kind, flag)
        return si if kind == "length" else read_degrees(si)
    try:
        value, its_unit = parse_quantity(text, kind)
    except ValueError as error:
        raise options.bad(flag, error) from None
    if kind == "length":
        return float(to_si(value, "length", its_unit))
    return value if its_unit == "deg" else read_degrees(value)


# --- --at and --over --------------------------------------------------------------------------------------------------
def at_axis(m: Mechanism, texts: Sequence[str], bare: Mapping[str, str]) -> Axis:
    """Return the axis of `--at crank=60deg,arm=30deg`: a row for each option."""
    rows = [input_values(m, text, "--at", bare) for text in texts]
    names = [Driven.of(m, j) for j in sorted({j for row in rows for j in row})]
    shown = [[row.get(name.j, name.own(m)) for name in names] for row in rows]
    return axis_of_rows("--at", names, np.array(shown, dtype=float))


def input_values(m: Mechanism, text: str, flag: str, bare: Mapping[str, str]) -> dict[int, float]:
    """Return the values of `crank=60deg,arm=30deg` by input, as they are shown; a bare value belongs to the only input."""
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
    """Return the axis of `--over 0deg:360deg:1deg`, or of `--over NAME=FROM:TO:STEP` for any input or dimension."""
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

    def values(parts: list[str]) -> list[float]:
        return quantities(of, parts, "--over", bare)

    steps = options.steps("--over", span, values, "0deg:360deg:1deg")
    if steps.n > MOST:
        raise options.bad("--over", f"'{span}': {steps.n:.3g} values: expected at most {MOST:.0e}")
    return Axis("--over", (of,), steps)


# --- --cases ----------------------------------------------------------------------------------------------------------
def cases_axis(m: Mechanism, path: str, elsewhere: set[int], remarks: list[str]) -> Axis:
    """Return the axis of `--cases FILE.csv`: columns are inputs or dimensions, `crank_deg`, `links.crank.B.x_mm`; rows are cases.

    With `t_s` the speeds of the inputs follow from a spline over time; columns such as `crank_speed_rad_s` give them.
    `elsewhere` are the inputs that other options hold.
    """
    from dalembert.tables.table import read
    from virtualwork.describe.dimensions import dimensions, named

    every = dimensions(m)
    inputs = {name.label: name for j in range(len(m.inputs)) for name in Driven.all(m, j)}
    varied = {path: Varied(of) for path, of in every.items()}
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
            f"{next(iter(every.values())).header} {table.hint}"
        )
    driven_here = {name.j for name in columns if isinstance(name, Driven)}
    for j in range(len(m.inputs)):
        if driven_here and j not in driven_here | elsewhere:
            raise DataError(
                f"{table.file}: no column {_headers(Driven.of(m, j))} for the input '{m.inputs[j].name}' {table.hint}"
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
    times = [table.numbers[t] for t in TIMES if t in table.numbers]
    if len(times) > 1:
        raise DataError(
            f"{table.file}: the column of time stands twice ({', '.join(t.header for t in times)}): expected it once"
        )
    time = times[0] if times else None
    if time is not None and not (np.diff(time.si) > 0).all():
        raise DataError(f"{table.file}: column {time.header}: expected rows with rising time")
    rates = [name for name in order if isinstance(name, Driven) and name.order]
    if rates:
        order, shown, values = _with_rates_at_rest(m, order, shown, values)
    elif time is not None and driven_here:
        here = [i for i, name in enumerate(order) if isinstance(name, Driven)]
        exact = [_exact(columns[order[i]]) for i in here]
        speed, acceleration = rates_over_time(f"{table.file}: column {time.header}", _exact(time), exact)
        order = [*order, *(order[i].rate(1) for i in here), *(order[i].rate(2) for i in here)]  # type: ignore[union-attr]
        shown = [*shown, *speed.T, *acceleration.T]
        values = np.concatenate([values, speed, acceleration], axis=1)
    seconds = None if time is None else time.si
    return axis_of_rows("--cases", order, np.array(shown).T, values, table.texts.get("step"), seconds)


def _headers(of: Driven) -> str:
    return " or ".join(f"{of.label}_{unit}" for unit in list(UNITS[of.dimension])[:2])


def _with_rates_at_rest(
    m: Mechanism, order: list[Driven | Varied], shown: list[Reals], values: Reals
) -> tuple[list[Driven | Varied], list[Reals], Reals]:
    """Add zero rates of the other inputs to a table that has a rate of one input."""
    zero = np.zeros(len(values))
    for k in (1, 2):
        if any(isinstance(name, Driven) and name.order == k for name in order):
            missing = [Driven.of(m, j).rate(k) for j in range(len(m.inputs))]
            missing = [name for name in missing if name not in order]
            order, shown = [*order, *missing], [*shown, *([zero] * len(missing))]
            values = np.concatenate([values, np.zeros((len(values), len(missing)))], axis=1)
    return order, shown, values


def _exact(column: Numbers) -> list[Decimal]:
    """Return the numbers of a column in SI, as the decimals that the file has."""
    from dalembert.arithmetic.splines import decimals

    return decimals(map(repr, column.values.tolist()), UNITS[column.dimension][column.unit])


def rates_over_time(
    place: str, time: Sequence[Decimal], q: Sequence[Sequence[Decimal]]
) -> tuple[Reals, Reals]:
    """Return speed and acceleration (n, k) of a law of motion over time, from the cubic spline through its rows.

    `q` has a list for each input, `place` names the column of time in messages.
    """
    from dalembert.arithmetic.splines import rates

    if len(time) < 4:
        raise DataError(f"{place}: expected at least 4 rows, for the speeds of the law of motion")
    of_inputs = [rates(time, values) for values in q]
    speed, acceleration = (np.array([[*map(float, of[k])] for of in of_inputs]).T for k in range(2))
    if not (np.isfinite(speed).all() and np.isfinite(acceleration).all()):
        raise DataError(f"{place}: rows too close in time for the speeds of the law of motion")
    return speed, acceleration


def history_axis(m: Mechanism) -> Axis:
    """Return the axis of the laws of motion that the file has as tables over time."""
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
            raise DescriptionError("[[input]] law: the tables of several inputs must have the same times")
    # loaded where a file has a table over time
    from dalembert.arithmetic.splines import sums

    def exact(values: list[float], dimension: str) -> list[Decimal]:
        return sums(values, [m.decimals.rest(dimension, x) if m.decimals else 0.0 for x in values])

    columns = [exact(q[:, name.j].tolist(), name.dimension) for name in names]
    try:
        speed, acceleration = rates_over_time("[input] law", exact(time.tolist(), "time"), columns)
    except DataError as error:
        # the name of the file is added to it
        raise DescriptionError(str(error)) from None
    shown = np.array([[name.shown(v) for name, v in zip(names, row, strict=True)] for row in q])
    order = [*names, *(name.rate(1) for name in names), *(name.rate(2) for name in names)]
    si = np.concatenate([q, speed, acceleration], axis=1)
    shown = np.concatenate([shown, speed, acceleration], axis=1)
    return axis_of_rows("[input] law", order, shown, si, time=time)


# --- all of them -----------
def grids(
    m: Mechanism,
    at: Sequence[str] | None,
    over: Sequence[str] | None,
    cases: str | None,
    bare: Mapping[str, str],
    remarks: list[str],
) -> tuple[Grid | None, Grid | None]:
    """Return the grid of the variants, and the grid of inputs that all variants go through; None where no option moves them."""
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
    count = Grid(tuple(axes)).n
    if count > MOST:
        raise options.bad("--over", f"{float(count):.3g} cases: expected at most {MOST:.0e}")
    varied = tuple(axis for axis in axes if not _of_inputs(axis))
    moved = tuple(axis for axis in axes if _of_inputs(axis))
    if not moved and not any(isinstance(name, Driven) for name in seen) and any(e.history for e in m.inputs):
        moved = (history_axis(m),)
    return Grid(varied) if varied else None, Grid(moved) if moved else None


def _of_inputs(axis: Axis) -> bool:
    """Whether an axis moves inputs alone."""
    return all(isinstance(name, Driven) for name in axis.names)
