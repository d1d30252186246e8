"""Which variants of a mechanism are asked for: `--set`, `--vary`, `--variants`."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cli.errors import DataError
from cli.mechanism.read import MOST, place_or_angle
from cli.read import options
from cli.read.units import UNITS, is_number, read_degrees, to_si
from virtualwork.describe import DescriptionError
from virtualwork.describe.dimensions import Dimension, changed, dimensions, named
from virtualwork.describe.units import Units

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from virtualwork import Mechanism

# values of one dimension in a grid
VALUES = 10**6


@dataclass(frozen=True)
class Variants:
    """Sets of numbers for some dimensions of a mechanism.

    Attributes
    ----------
    dimensions : tuple of Dimension
    columns : sequence of arrays, the values of each dimension as they are shown, SI but degrees
    grid : bool
        Whether the variants are all combinations of the values, the last dimension the fastest; else rows.
    """

    dimensions: tuple[Dimension, ...]
    columns: Sequence[NDArray[np.float64]]
    grid: bool

    @property
    def count(self) -> int:
        """How many there are."""
        return math.prod(map(len, self.columns)) if self.grid else len(self.columns[0])

    @property
    def moves_inputs(self) -> bool:
        """Whether the file's own pose is another in each."""
        return any(each.where[0] == "inputs" and each.where[-1] == "value" for each in self.dimensions)

    def part(self, low: int, high: int) -> NDArray[np.float64]:
        """The values of the variants from low to high, or to the last, as they are shown: (v, d)."""
        places: Any = np.arange(low, min(high, self.count))
        each = (
            np.unravel_index(places, [len(c) for c in self.columns])
            if self.grid
            else [places] * len(self.columns)
        )
        return np.stack([c[i] for c, i in zip(self.columns, each, strict=True)], axis=1)


def with_numbers(m: Mechanism, dimensions: Sequence[Dimension], shown: Sequence[float]) -> Mechanism:
    """The mechanism with other numbers, which are given as they are shown."""
    return changed(m, {each.path: in_si(each, value) for each, value in zip(dimensions, shown, strict=True)})


def in_si(dimension: Dimension, shown: float) -> float:
    """A number of a dimension, from what is shown of it."""
    return math.radians(shown) if dimension.unit == "deg" else shown


def assigned(m: Mechanism, bare: Mapping[str, str], given: Sequence[str]) -> Mechanism:
    """The mechanism after every `--set PATH=VALUE`; both coordinates of a point as `X,Y`."""
    numbers: list[tuple[Dimension, float]] = []
    for text in given:
        found, value = assignment(m, text, "--set", "VALUE")
        parts = value.split(",")
        if len(parts) != len(found):
            wanted = "one value" if len(found) == 1 else "two values X,Y"
            raise options.bad("--set", f"'{text}': expected {wanted} for {text.rpartition('=')[0]}")
        for dimension, part in zip(found, parts, strict=True):
            if any(dimension == other for other, _ in numbers):
                raise options.bad("--set", f"'{text}': {dimension.path} is given twice")
            numbers.append((dimension, quantity(dimension, part, "--set", bare)))
    try:
        return with_numbers(m, *zip(*numbers, strict=True))
    except DescriptionError as error:
        raise options.bad("--set", error) from None


def asked(
    m: Mechanism, bare: Mapping[str, str], vary: Sequence[str] | None, table: str | None, said: list[str]
) -> Variants | None:
    """The variants of `--vary` or `--variants`; None where neither is given. Remarks on the table are added to `said`."""
    if vary and table is not None:
        raise options.bad("--variants", "expected --vary or --variants, not both")
    if table is not None:
        return _from_table(m, table, said)
    if not vary:
        return None
    found: dict[Dimension, list[float]] = {}
    for text in vary:
        dimension, span = one_number(m, text, "--vary", "FROM:TO:STEP", [each.path for each in found])
        found[dimension] = options.grid(
            "--vary",
            span,
            lambda part, of=dimension: quantity(of, part, "--vary", bare),  # type: ignore[misc]
            "values",
            "50mm:60mm:1mm",
            VALUES,
        )
    variants = Variants(tuple(found), [np.array(values) for values in found.values()], grid=True)
    if variants.count > MOST:
        raise options.bad("--vary", f"{variants.count:.3g} variants: expected at most {MOST:.0e}")
    return variants


def assignment(m: Mechanism, text: str, flag: str, what: str) -> tuple[tuple[Dimension, ...], str]:
    """Part `PATH=VALUE`, and find the path."""
    path, equals, value = text.rpartition("=")
    if not equals or not path.strip():
        raise options.bad(flag, f"'{text}': expected PATH={what}, such as links.crank.B.x=...")
    try:
        return named(m, path.strip()), value
    except DescriptionError as error:
        raise options.bad(flag, error) from None


def one_number(m: Mechanism, text: str, flag: str, what: str, taken: Container[str]) -> tuple[Dimension, str]:
    """The same of a path that names one number, which is not among those taken."""
    (dimension, *both), value = assignment(m, text, flag, what)
    if both:
        raise options.bad(flag, f"'{text}': two numbers: expected {dimension.path} or {both[0].path}")
    if dimension.path in taken:
        raise options.bad(flag, f"'{text}': {dimension.path} is given twice")
    return dimension, value


def quantity(dimension: Dimension, text: str, flag: str, bare: Mapping[str, str]) -> float:
    """A value as it is shown: SI, angles in degrees; bare numbers as in the file."""
    if dimension.kind in ("length", "angle") and not (is_number(text) and dimension.kind not in bare):
        return place_or_angle(text, dimension.kind, flag, bare)
    try:
        si = Units({}).number(text.strip(), dimension.kind, dimension.path)
    except DescriptionError as error:
        raise options.bad(flag, error) from None
    return read_degrees(si) if dimension.unit == "deg" else si


def cli_dimension(of: Dimension) -> str:
    """What a table of the command calls such a quantity."""
    return next(name for name, units in UNITS.items() if of.unit in units)


def _from_table(m: Mechanism, path: str, said: list[str]) -> Variants:
    """A column for each path with its unit, `links.crank.B.x_mm`, a row for each variant."""
    from cli.read.tables import read

    every = dimensions(m)
    # headers are read in any case
    known = {name.lower(): each for name, each in every.items()}
    table = read(
        path, numbers={name: cli_dimension(each) for name, each in known.items()}, texts=("variant",)
    )
    used = {column.header for column in table.numbers.values()}
    for header in table.header:
        if "." in header and header not in used:
            try:
                (*_, last) = named(m, header.strip(), every)
            except DescriptionError as error:
                raise DataError(f"{table.file}: column {header}: {error}") from None
            raise DataError(f"{table.file}: column {header}: expected one number, such as {last.header}")
    if not table.numbers:
        example = next(iter(every.values())).header
        raise DataError(f"{table.file}: no column names a dimension, such as {example} {table.told}")
    said += table.warnings
    found: list[tuple[Dimension, NDArray[np.float64]]] = []
    for name, column in table.numbers.items():
        dimension, kind = known[name], cli_dimension(known[name])
        if dimension.unit == "deg" and column.unit == "deg":
            shown = column.values
        else:
            shown = to_si(column.values, kind, column.unit)
            shown = shown * 180 / math.pi if dimension.unit == "deg" else shown
        found.append((dimension, np.asarray(shown, dtype=float)))
    return Variants(tuple(d for d, _ in found), [values for _, values in found], grid=False)
