"""What a value of an option is of: an input, its rate, or a dimension; and its number, in the unit that it is shown in."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from cli.read import options
from dalembert.angles import read_degrees
from dalembert.dataclass import dataclass, replace
from dalembert.hints import nearest
from dalembert.quantities import is_number, parse_number, parse_quantity
from dalembert.units import UNITS, to_si
from virtualwork.describe import DescriptionError
from virtualwork.describe.units import Units

if TYPE_CHECKING:
    from virtualwork import Mechanism
    from virtualwork.describe.dimensions import Dimension

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
        """The value of an input."""
        return cls(j, m.inputs[j].name, m.inputs[j].is_slide)

    @classmethod
    def all(cls, m: Mechanism, j: int) -> Iterator[Driven]:
        """The value of an input and its rates."""
        value = cls.of(m, j)
        return (value.rate(k) for k in range(3))

    def rate(self, order: int) -> Driven:
        """Its rate of this order."""
        return Driven(self.j, self.name, self.slides, order)

    @property
    def label(self) -> str:
        """What a header calls it, without its unit: `crank`, `crank_speed`."""
        return f"{self.name}_{RATES[self.order]}" if self.order else self.name

    @property
    def dimension(self) -> str:
        """Which of the tables' dimensions it has."""
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
        """A value as it is shown."""
        return si if self.slides or self.order else read_degrees(si)

    def own(self, m: Mechanism) -> float:
        """The file's own value as it is shown; where it has none, that of the guess."""
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
        """Which of the tables' dimensions it has."""
        return self.of.kind

    @property
    def unit(self) -> str:
        """The unit that it is shown in."""
        return self.of.unit

    @property
    def kind(self) -> str:
        """Which quantity it is."""
        return self.of.kind

    def si(self, shown: float) -> float:
        """A value in SI."""
        return math.radians(shown) if self.of.unit == "deg" else shown


def driven(m: Mechanism, name: str, text: str, flag: str) -> int:
    """The place of an input."""
    names = [e.name for e in m.inputs]
    if name not in names:
        raise options.bad(
            flag, f"'{text}': no input drives '{name}': expected {', '.join(names)}{nearest(name, names)}"
        )
    return names.index(name)


def dimension_named(m: Mechanism, path: str, text: str, flag: str) -> Varied:
    """The one number that a path names."""
    from virtualwork.describe.dimensions import named

    try:
        first, *both = named(m, path)
    except DescriptionError as error:
        inputs = [e.name for e in m.inputs]
        hint = "" if "did you mean" in str(error) else nearest(path, inputs)
        raise options.bad(flag, f"{error}{hint}") from None
    if both:
        raise options.bad(flag, f"'{text}': two numbers: expected {first.path} or {both[0].path}")
    return Varied(first)


def assigned_paths(m: Mechanism, text: str, flag: str, what: str) -> tuple[tuple[Dimension, ...], str]:
    """Part `NAME=VALUE`, and find the dimensions that it names."""
    from virtualwork.describe.dimensions import named

    path, equals, value = text.rpartition("=")
    if not equals or not path.strip():
        raise options.bad(flag, f"'{text}': expected NAME={what}, such as links.crank.B.x=...")
    try:
        return named(m, path.strip()), value
    except DescriptionError as error:
        raise options.bad(flag, error) from None


def assigned(m: Mechanism, bare: Mapping[str, str], texts: Sequence[str]) -> Mechanism:
    """The mechanism after every `--set NAME=VALUE`; both coordinates of a point as `X,Y`."""
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


def with_numbers(m: Mechanism, dimensions: Sequence[Dimension], shown: Sequence[float]) -> Mechanism:
    """The mechanism with other numbers, as they are shown."""
    from virtualwork.describe.dimensions import changed

    numbers = {d.path: Varied(d).si(value) for d, value in zip(dimensions, shown, strict=True)}
    if m.decimals is not None:
        read = ((d.kind, numbers[d.path], x, _factor(d)) for d, x in zip(dimensions, shown, strict=True))
        m = replace(m, decimals=m.decimals.and_also(read))
    return changed(m, numbers)


def _factor(dimension: Dimension) -> tuple[float, float]:
    """What a number as it is shown has to be multiplied by."""
    return (math.pi, 180) if dimension.unit == "deg" else (1, 1)


def quantity(of: Driven | Varied, text: str, flag: str, bare: Mapping[str, str]) -> float:
    """A value as it is shown: SI, angles in degrees; a bare number is in the unit of the file."""
    if isinstance(of, Driven) or (
        of.kind in ("length", "angle") and not (is_number(text) and of.kind not in bare)
    ):
        return place_or_angle(text, of.kind, flag, bare)
    try:
        si = Units({}).number(text.strip(), of.kind, of.label)
    except DescriptionError as error:
        raise options.bad(flag, error) from None
    return read_degrees(si) if of.unit == "deg" else si


def place_or_angle(text: str, kind: str, flag: str, bare: Mapping[str, str]) -> float:
    """A length in metres, or an angle in degrees: those of an angle in degrees stay as they are written."""
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
