"""The options that say which poses, and which mechanism: `--at`, `--over`, `--cases` as axes, `--set` as numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cli.cases.inputs import Axis, Driven, Grid, Varied, with_numbers
from cli.read import options
from dalembert.decimals import Factor
from dalembert.errors import DataError
from dalembert.hints import nearest
from dalembert.quantities import decimals, exactly, exactly_in_degrees, is_number, option_digits
from dalembert.units import UNITS
from dalembert.written import DEGREES, ROWS, Range, Written
from virtualwork.describe import DescriptionError
from virtualwork.describe.units import Units

if TYPE_CHECKING:
    from decimal import Decimal
    from fractions import Fraction

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
    numbers: dict[Dimension, Written] = {}
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


def quantity(of: Driven | Varied, text: str, flag: str, bare: Mapping[str, str]) -> Written:
    """Read a value; a bare number is in the unit of the file."""
    return Written.of(*digits(of, text, flag, bare), is_angle=of.unit == "deg")


def digits(of: Driven | Varied, text: str, flag: str, bare: Mapping[str, str]) -> tuple[str, Factor]:
    """Read the decimals of a value, and the factor of its unit."""
    kind = of.kind
    if isinstance(of, Driven) or (kind in ("length", "angle") and not (is_number(text) and kind not in bare)):
        return digits_of_place(text, kind, flag, bare)
    parts = decimals(text.strip(), kind)
    if parts is None:
        # units of options may stand in capitals
        with suppress(ValueError):
            return option_digits(text, kind)
    try:
        Units({}).number(text.strip(), kind, of.label)
    except DescriptionError as error:
        raise options.bad(flag, error) from None
    assert parts is not None
    return parts


def place_or_angle(text: str, kind: str, flag: str, bare: Mapping[str, str]) -> Written:
    """Read a length or an angle; a bare number is in the unit of the file."""
    return Written.of(*digits_of_place(text, kind, flag, bare), is_angle=kind == "angle")


def digits_of_place(text: str, kind: str, flag: str, bare: Mapping[str, str]) -> tuple[str, Factor]:
    """Read the decimals of a length or an angle, and the factor of its unit."""
    named_unit = bare.get(kind)
    if named_unit is not None and is_number(text):
        parts = decimals(text, kind, Units({kind: named_unit}).factors[kind])
        assert parts is not None
        return parts
    try:
        return option_digits(text, kind)
    except ValueError as error:
        raise options.bad(flag, error) from None


# --- --at and --over --------------------------------------------------------------------------------------------------
def at_axis(m: Mechanism, texts: Sequence[str], bare: Mapping[str, str]) -> Axis:
    """Return the axis of `--at crank=60deg,arm=30deg`: a row for each option."""
    rows = [input_values(m, text, "--at", bare) for text in texts]
    names = [Driven.of(m, j) for j in sorted({j for row in rows for j in row})]
    cells = [[row.get(name.j) or name.own(m) for name in names] for row in rows]
    return Axis("--at", tuple(names), rows=np.array(cells, dtype=ROWS))


def input_values(m: Mechanism, text: str, flag: str, bare: Mapping[str, str]) -> dict[int, Written]:
    """Return the values of `crank=60deg,arm=30deg` by input; a bare value belongs to the only input."""
    names = [e.name for e in m.inputs]
    result: dict[int, Written] = {}
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

    factor: Factor = (1, 1)

    def values(parts: list[str]) -> list[Fraction]:
        nonlocal factor
        numbers, factor = _in_one_unit([digits(of, part, "--over", bare) for part in parts])
        return numbers

    steps = options.steps("--over", span, values, "0deg:360deg:1deg")
    if steps.n > MOST:
        raise options.bad("--over", f"'{span}': {steps.n:.3g} values: expected at most {MOST:.0e}")
    return Axis("--over", (of,), Range(steps, factor, of.unit == "deg"))


def _in_one_unit(parts: list[tuple[str, Factor]]) -> tuple[list[Fraction], Factor]:
    """Return the numbers of a range in one unit, and its factor: SI, or their own unit where π is in its factor.

    >>> _in_one_unit([("0", (1, 1)), ("90", DEGREES)]), _in_one_unit([("5", (1, 1000))])
    (([Fraction(0, 1), Fraction(90, 1)], (3.141592653589793, 180)), ([Fraction(1, 200)], (1, 1)))
    """
    numbers = [exactly(number, (1, 1)) for number, _ in parts]
    factors = {factor for number, (_, factor) in zip(numbers, parts, strict=True) if number}
    only = factors.pop() if len(factors) == 1 else None
    if only is not None and not all(isinstance(part, int) for part in only):
        return numbers, only
    exact = [exactly(*part) for part in parts]
    if DEGREES in factors:
        return [exactly_in_degrees(x) for x in exact], DEGREES
    return exact, (1, 1)


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
                (*_, last) = named(m, header.strip())
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
    cells = [_shown_and_si(column) for column in columns.values()]
    shown = [each for each, _ in cells]
    order = list(columns)
    values = np.array([si for _, si in cells]).T
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
        laws = [_decimals(columns[order[i]]) for i in here]
        speed, acceleration = rates_over_time(f"{table.file}: column {time.header}", _decimals(time), laws)
        order = [*order, *(order[i].rate(1) for i in here), *(order[i].rate(2) for i in here)]  # type: ignore[union-attr]
        shown = [*shown, *speed.T, *acceleration.T]
        values = np.concatenate([values, speed, acceleration], axis=1)
    elif time is not None:
        remarks.append(
            f"{table.file}: the column {time.header} has no effect: rates follow from it where a column names an input, such as "
            f"{_headers(Driven.of(m, 0))}"
        )
    seconds = None if time is None else time.si
    rows = np.zeros(values.shape, dtype=ROWS)
    rows["shown"], rows["si"] = np.array(shown).T, values
    rest = partial(_rest_of_columns, [*columns.values()])
    return Axis("--cases", tuple(order), rows=rows, labels=table.texts.get("step"), time=seconds, rest=rest)


def _shown_and_si(column: Numbers) -> tuple[Reals, Reals]:
    """Return the numbers of a column as they are shown, and in SI."""
    if column.unit == "deg":
        return column.values, np.radians(column.values)
    if column.dimension == "angle":
        from dalembert.tables.exact import as_written

        return as_written(column).value, column.si
    return column.si, column.si


def _rest_of_columns(columns: Sequence[Numbers]) -> Reals:
    """Return the exact numbers of columns less their floats, SI, (n, columns)."""
    from dalembert.tables.exact import column

    each = range(len(columns[0].values))
    return np.array([(column(c, each) - _shown_and_si(c)[1]).value for c in columns]).T


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


def _decimals(column: Numbers) -> list[Decimal]:
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
            q[:, j] = m.own_inputs[j]
        elif np.array_equal(law[:, 0], time):
            q[:, j] = law[:, 1]
        else:
            raise DescriptionError("[[input]] law: the tables of several inputs must have the same times")
    # loaded where a file has a table over time
    from dalembert.arithmetic.splines import sums

    def written(values: list[float], dimension: str) -> list[Decimal]:
        return sums(values, [m.decimals.rest(dimension, x) if m.decimals else 0.0 for x in values])

    columns = [written(q[:, name.j].tolist(), name.dimension) for name in names]
    try:
        speed, acceleration = rates_over_time("[input] law", written(time.tolist(), "time"), columns)
    except DataError as error:
        # the name of the file is added to it
        raise DescriptionError(str(error)) from None
    shown = np.array([[name.shown(v) for name, v in zip(names, row, strict=True)] for row in q])
    order = [*names, *(name.rate(1) for name in names), *(name.rate(2) for name in names)]
    rows = np.zeros((len(q), len(order)), dtype=ROWS)
    rows["si"] = np.concatenate([q, speed, acceleration], axis=1)
    rows["shown"] = np.concatenate([shown, speed, acceleration], axis=1)
    return Axis("[input] law", tuple(order), rows=rows, time=time, rest=partial(_rest_of_file, m, names, q))


def _rest_of_file(m: Mechanism, names: Sequence[Driven], q: Reals) -> Reals:
    """Return the exact numbers of a file less their floats, SI."""
    rest = m.decimals.rest if m.decimals else lambda dimension, x: 0.0
    return np.array([[rest(n.dimension, x) for n, x in zip(names, row, strict=True)] for row in q.tolist()])


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
