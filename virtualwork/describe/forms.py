"""The forms of values in a mechanism's file: how each is read, checked and written, and its JSON Schema.

Names are checked when the whole mechanism is there: the same check serves a file and a description in Python.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set
from numbers import Real
from typing import Any, ClassVar, Protocol

from dalembert.dataclass import dataclass
from dalembert.hints import nearest
from virtualwork.describe import DescriptionError, require
from virtualwork.describe.file import GROUND, Entry
from virtualwork.describe.units import SI, Units, text_of, wrong
from virtualwork.describe.values import as_number, as_point

Schema = dict[str, Any]

# a number, perhaps with its unit behind it; both stand in the definitions of the schema
SCALAR: Schema = {"$ref": "#/$defs/quantity"}
PAIR: Schema = {"$ref": "#/$defs/pair"}
TEXT: Schema = {"type": "string"}


# the two ends of a spring in Python
ENDS = 'two ends such as ("crank", "B") and ("ground", "D")'


class Names(Protocol):
    """The names of a mechanism."""

    @property
    def links(self) -> Mapping[str, Any]:
        """The moving links."""

    @property
    def bodies(self) -> Mapping[str, Mapping[str, complex]]:
        """The points of each body, the ground's too."""

    @property
    def guides(self) -> Sequence[Any]:
        """The guides, each with its point."""


@dataclass(eq=False, repr=False)
class Form:
    """A form of values; one that holds numbers names their dimension, a key of `dalembert.units.DIMENSIONS`."""

    parts: ClassVar[tuple[str | int, ...]] = ()
    """The numbers that it holds: "x" and "y" of a pair, places in a list; empty where it is one number."""

    @property
    def restricts(self) -> bool:
        """Whether `check` refuses anything."""
        return type(self).check is not Form.check

    @property
    def converts(self) -> bool:
        """Whether `converted` changes or refuses anything."""
        return type(self).converted is not Form.converted

    def dimension(self, slides: bool) -> str:
        """The dimension of its numbers, of a part that slides or turns; empty where it holds none."""
        return ""

    def schema(self) -> Schema:
        """Return the JSON Schema of the value, for editors."""
        return TEXT

    def read(self, value: Any, where: str, entry: Entry) -> Any:
        """The value of the field, SI."""
        return text_of(value, where)

    def fields(self, name: str, value: Any, where: str, entry: Entry) -> dict[str, Any]:
        """The fields that a value fills: its own, and those that a table in the file's folder fills too."""
        return {name: self.read(value, where, entry)}

    def converted(self, value: Any, where: str) -> Any:
        """The value of the field from one that comes from Python; what is no such value is refused."""
        return value

    def check(self, value: Any, where: str, part: Any, names: Names) -> None:
        """Refuse a value that this mechanism cannot have."""

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        """The value of a field as the file has it."""
        return value


def _row(value: Any, count: int | None, where: str, expected: str) -> tuple[Any, ...]:
    """The entries of a row that comes from Python, of as many as are expected."""
    ordered = isinstance(value, Iterable) and not isinstance(value, str | Set | Mapping)
    entries = tuple(value) if ordered else ()
    if not ordered or count not in (None, len(entries)):
        raise wrong(where, value, expected)
    return entries


def whole(number: float) -> float:
    """An integer where a number is one: files and schemas are written with few digits.

    >>> whole(3.0), whole(0.5)
    (3, 0.5)
    """
    return (
        int(number) if isinstance(number, Real) and number == int(number) and abs(number) < 1e15 else number
    )


@dataclass(eq=False, repr=False)
class Scalar(Form):
    """A number with a dimension; `sliding` is that of a part that slides, `negative` whether it may be below zero."""

    turning: str
    sliding: str = ""
    negative: bool = True

    @property
    def restricts(self) -> bool:
        return not self.negative

    def dimension(self, slides: bool) -> str:
        return self.sliding if slides and self.sliding else self.turning

    def schema(self) -> Schema:
        return SCALAR

    def read(self, value: Any, where: str, entry: Entry) -> float:
        return entry.file.units.number(value, self.dimension(entry.slides), where)

    def converted(self, value: Any, where: str) -> float:
        return as_number(value, where)

    def check(self, value: Any, where: str, part: Any, names: Names) -> None:
        if not self.negative and not value >= 0:
            raise DescriptionError(f"{where}: found {value}, but it must not be negative")

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        return whole(units.bare(value, self.dimension(slides)))


@dataclass(eq=False, repr=False)
class Pair(Form):
    """Two numbers [x, y] of one dimension."""

    of: str
    parts = "x", "y"

    def dimension(self, slides: bool) -> str:
        return self.of

    def schema(self) -> Schema:
        return PAIR

    def read(self, value: Any, where: str, entry: Entry) -> Any:
        return entry.file.units.pair(value, self.of, where)

    def converted(self, value: Any, where: str) -> complex:
        return as_point(value, where)

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        return [whole(units.bare(x, self.of)) for x in (value.real, value.imag)]


@dataclass(eq=False, repr=False)
class Lengths(Form):
    """A list of this number of lengths."""

    count: int

    def __post_init__(self) -> None:
        self.parts = tuple(range(self.count))  # type: ignore[misc]

    def dimension(self, slides: bool) -> str:
        return "length"

    def schema(self) -> Schema:
        return {"type": "array", "items": SCALAR, "minItems": self.count, "maxItems": self.count}

    def read(self, value: Any, where: str, entry: Entry) -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) != self.count:
            raise wrong(where, value, f"{self.count} lengths")
        return tuple(entry.file.units.number(x, "length", where) for x in value)

    def converted(self, value: Any, where: str) -> tuple[float, ...]:
        return tuple(as_number(x, where) for x in _row(value, self.count, where, f"{self.count} lengths"))

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        return [whole(units.bare(x, "length")) for x in value]


@dataclass(eq=False, repr=False)
class Flag(Form):
    """True or false."""

    def schema(self) -> Schema:
        return {"type": "boolean"}

    def read(self, value: Any, where: str, entry: Entry) -> bool:
        if not isinstance(value, bool):
            raise wrong(where, value, "true or false")
        return value

    def converted(self, value: Any, where: str) -> bool:
        if isinstance(value, str) or value not in (True, False):
            raise wrong(where, value, "True or False")
        return bool(value)


@dataclass(eq=False, repr=False)
class Choice(Form):
    """One of some words."""

    words: tuple[str, ...]

    def schema(self) -> Schema:
        return {"enum": list(self.words)}

    def check(self, value: Any, where: str, part: Any, names: Names) -> None:
        if value not in self.words:
            raise wrong(where, value, " or ".join(map(repr, self.words)) + nearest(str(value), self.words))


@dataclass(eq=False, repr=False)
class Body(Form):
    """The name of a link, or of the ground."""

    ground: bool = True

    def check(self, value: Any, where: str, part: Any, names: Names) -> None:
        require(value, names.bodies if self.ground else names.links, where, "link")


@dataclass(eq=False, repr=False)
class TwoBodies(Form):
    """The names of two links."""

    def schema(self) -> Schema:
        return {"type": "array", "items": TEXT, "minItems": 2, "maxItems": 2}

    def read(self, value: Any, where: str, entry: Entry) -> tuple[Any, Any]:
        if not isinstance(value, list) or len(value) != 2:
            raise wrong(where, value, "two links")
        return text_of(value[0], where), text_of(value[1], where)

    def converted(self, value: Any, where: str) -> tuple[Any, ...]:
        return _row(value, 2, where, "two links")

    def check(self, value: Any, where: str, part: Any, names: Names) -> None:
        for body in value:
            require(body, names.bodies, where, "link")

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        return list(value)


def _has(names: Names, body: str, point: str, where: str) -> None:
    """Refuse a point that a body does not have; another check refuses an unknown body."""
    if body in names.bodies:
        owner = GROUND if body == GROUND else f"link {body}"
        require(point, names.bodies[body], where, f"point of {owner}")


@dataclass(eq=False, repr=False)
class PointName(Form):
    """The name of a point of the body that another field names; of any body where it names no field."""

    of: str = ""

    def check(self, value: Any, where: str, part: Any, names: Names) -> None:
        if self.of:
            _has(names, getattr(part, self.of), value, where)
        else:
            require(value, {p for points in names.bodies.values() for p in points}, where, "point")


@dataclass(eq=False, repr=False)
class Place(Form):
    """A point of the body that another field names: its name, or [x, y] in the axes of that body."""

    of: str
    parts = "x", "y"

    def dimension(self, slides: bool) -> str:
        return "length"

    def schema(self) -> Schema:
        return {"anyOf": [TEXT, PAIR]}

    def read(self, value: Any, where: str, entry: Entry) -> Any:
        return value if isinstance(value, str) else entry.file.units.pair(value, "length", where)

    def converted(self, value: Any, where: str) -> str | complex:
        return value if isinstance(value, str) else as_point(value, where)

    def check(self, value: Any, where: str, part: Any, names: Names) -> None:
        if isinstance(value, str):
            _has(names, getattr(part, self.of), value, where)

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        return value if isinstance(value, str) else Pair("length").text(value, units)


@dataclass(eq=False, repr=False)
class Ends(TwoBodies):
    """Two points, each (body, its name or its place in the axes of the body); `crank.B` in the file."""

    def read(self, value: Any, where: str, entry: Entry) -> tuple[Any, Any]:
        if not isinstance(value, list) or len(value) != 2:
            raise wrong(where, value, 'two points such as ["crank.B", "ground.D"]')
        return entry.file.point_of(value[0], where), entry.file.point_of(value[1], where)

    def converted(self, value: Any, where: str) -> tuple[Any, ...]:
        ends = _row(value, 2, where, ENDS)
        return tuple(
            (body, point if isinstance(point, str) else as_point(point, where))
            for body, point in (_row(end, 2, where, ENDS) for end in ends)
        )

    def check(self, value: Any, where: str, part: Any, names: Names) -> None:
        for body, point in value:
            require(body, names.bodies, where, "link")
            if isinstance(point, str):
                _has(names, body, point, where)

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        for body, point in value:
            if not isinstance(point, str):
                raise DescriptionError(f"between: the end at {point} of {body} needs a named point in a file")
        return [f"{body}.{point}" for body, point in value]


@dataclass(eq=False, repr=False)
class DrivenPoint(Form):
    """The point of the one slot or slider that an input drives."""

    def check(self, value: Any, where: str, part: Any, names: Names) -> None:
        points = [guide.point for guide in names.guides]
        require(value, points, where, "slot or slider")
        if points.count(value) > 1:
            raise DescriptionError(f"{where}: '{value}' runs in more than one guide")


@dataclass(eq=False, repr=False)
class RackPoint(DrivenPoint):
    """The point of the one slot or slider that moves with a toothed wheel."""

    def check(self, value: Any, where: str, part: Any, names: Names) -> None:
        super().check(value, where, part, names)
        guide = next(guide for guide in names.guides if guide.point == value)
        if guide.on == part.gear:
            raise DescriptionError(
                f"{where}: '{value}' slides on the wheel '{part.gear}' itself, expected a guide of another link"
            )
        if guide.link == part.gear and guide.is_slider:
            raise DescriptionError(
                f"{where}: the wheel '{part.gear}' cannot turn in a slider, expected a slot"
            )


@dataclass(eq=False, repr=False)
class FollowerPoint(DrivenPoint):
    """The point of the one slot or slider along which a cam moves its follower."""

    def check(self, value: Any, where: str, part: Any, names: Names) -> None:
        super().check(value, where, part, names)
        guide = next(guide for guide in names.guides if guide.point == value)
        if part.cam in (guide.link, guide.on):
            raise DescriptionError(
                f"{where}: '{value}' is a point of the cam '{part.cam}' or slides on it, expected a follower of its own"
            )


@dataclass(eq=False, repr=False)
class Nested(Form):
    """A list of tables, each with the keys that a dataclass declares."""

    of: type

    def converted(self, value: Any, where: str) -> tuple[Any, ...]:
        return _row(value, None, where, f"a list of {self.of.__name__}")

    def text(self, value: Any, units: Units = SI, slides: bool = False) -> Any:
        raise NotImplementedError("`describe.text` writes the tables of a part")


@dataclass(eq=False, repr=False)
class Free(Form):
    """A value that the reader takes in a way of its own; `schema` names its schema."""

    name: str
