"""The dimensions of a mechanism: every number of its description by its path in the file, read and changed.

`links.crank.B.x`, `links.leg.H.length` (a point in polar form), `links.coupler.mass`, `ground.D.y`, `springs.1.stiffness`
(lists count from 1), `input.speed`. A point's own path, `links.crank.B`, names both its coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from numbers import Real
from types import MappingProxyType
from typing import Any, TypeVar

from dalembert.arithmetic.recorded import Constant
from dalembert.hints import nearest
from dalembert.units import LARGEST, LISTED
from virtualwork.describe import DescriptionError
from virtualwork.describe.description import Description, listed
from virtualwork.describe.forms import Nested
from virtualwork.describe.keys import keys_of, table_keys
from virtualwork.describe.parts import Input, Link
from virtualwork.describe.values import joined

D = TypeVar("D", bound=Description)
Where = tuple[str | int, ...]
"""The way into a description: names of fields, keys, places in a list; x or y of a point comes last."""


@dataclass(frozen=True)
class Dimension:
    """One number of a description.

    Attributes
    ----------
    path : str
    kind : str
        Which quantity it is, a key of `dalembert.units.DIMENSIONS`.
    where : tuple
        The way to it.
    """

    path: str
    kind: str
    where: Where

    @property
    def unit(self) -> str:
        """The suffix of its column: `m`, `deg`; empty for a plain number."""
        return LISTED[self.kind][0]

    @property
    def header(self) -> str:
        """Its path with its unit: `links.crank.B.x_m`."""
        return f"{self.path}_{self.unit}" if self.unit else self.path


def dimensions(m: Description) -> Mapping[str, Dimension]:
    """Every dimension of a mechanism by its path, in the order of the file; listed once.

    Examples
    --------
    >>> from virtualwork.describe.parts import Input, Link, Polar
    >>> arm = Link({"O": 0j, "P": (0.06, 0), "Q": Polar("P", 0.02, 0.5)}, mass=2)
    >>> listed = dimensions(Description({"O": 0j}, {"arm": arm}, inputs=Input("arm")))
    >>> listed["links.arm.P.x"].header, listed["links.arm.Q.angle"].header, "links.arm.Q.x" in listed
    ('links.arm.P.x_m', 'links.arm.Q.angle_deg', False)
    """
    held = vars(m)
    if "_dimensions" not in held:
        held["_dimensions"] = MappingProxyType({dimension.path: dimension for dimension in _all(m)})
    result: Mapping[str, Dimension] = held["_dimensions"]
    return result


def _all(m: Description) -> Iterator[Dimension]:
    for point in m.ground:
        yield from _numbers(f"ground.{point}", "length", ("x", "y"), ("ground", point))
    for name, link in m.links.items():
        yield from _of_link(name, link)
    yield from _declared("", (), m)
    for i, number, part in listed(m):
        # the paths of a single input have no number
        alone = part.table == "input" and len(m.inputs) == 1
        prefix = "input." if alone else f"{part.table}.{number}."
        yield from _declared(prefix, (part.collection, i), part, part.slides)


def _of_link(name: str, link: Link) -> Iterator[Dimension]:
    """The numbers of a link's points, and its own."""
    for point in link.points:
        # a point that is called as a key of the link is named by the longer path
        key = f"points.{point}" if point in table_keys(Link) else point
        where = ("links", name, "polar" if point in link.polar else "points", point)
        if point in link.polar:
            yield from _declared(f"links.{name}.{key}.", where, link.polar[point])
        else:
            yield from _numbers(f"links.{name}.{key}", "length", ("x", "y"), where)
    yield from _declared(f"links.{name}.", ("links", name), link)


def _declared(prefix: str, where: Where, part: Any, slides: bool = False) -> Iterator[Dimension]:
    """The numbers of one part, by the keys that it declares."""
    for key in keys_of(type(part)):
        kind, held = key.form.dimension(slides), getattr(part, key.field)
        if isinstance(key.form, Nested):
            for i, row in enumerate(held or ()):
                yield from _declared(f"{prefix}{key.name}.{i + 1}.", (*where, key.field, i), row, slides)
            continue
        if held is None and not isinstance(part, Input):
            continue
        number = not isinstance(held, str) and not (held is None and key.form.parts)
        if kind and number and key.applies(part):
            yield from _numbers(prefix + key.name, kind, key.form.parts, (*where, key.field))


def _numbers(path: str, kind: str, parts: tuple[str | int, ...], where: Where) -> Iterator[Dimension]:
    for part in parts:
        # lists count from 1
        name = part + 1 if isinstance(part, int) else part
        yield Dimension(f"{path}.{name}", kind, (*where, part))
    if not parts:
        yield Dimension(path, kind, where)


def named(m: Description, path: str) -> tuple[Dimension, ...]:
    """The dimensions that a path names: one, or both coordinates of a point.

    Raises
    ------
    DescriptionError
        Where the path names none, or is of the wrong kind; the nearest is named.
    """
    every = dimensions(m)
    if not isinstance(path, str):
        raise DescriptionError(f"expected a path such as '{next(iter(every), 'links')}', found {path!r}")
    if path in every:
        return (every[path],)
    if f"{path}.x" in every:
        return every[f"{path}.x"], every[f"{path}.y"]
    stem, _, last = path.rpartition(".")
    # the key of the other form of a point
    other = {"x": "length", "y": "length", "length": "x", "angle": "x"}.get(last)
    if f"{path}.length" in every or (other == "length" and f"{stem}.length" in every):
        point = path if f"{path}.length" in every else stem
        raise DescriptionError(
            f"'{path}': the point is given by distance and direction: expected {point}.length or {point}.angle"
        )
    if other == "x" and f"{stem}.x" in every:
        raise DescriptionError(f"'{path}': the point is given by coordinates: expected {stem}.x or {stem}.y")
    held = [each for each in every if each.startswith(f"{path}.")]
    if held:
        more = f" and {len(held) - 4} more" if len(held) > 4 else ""
        raise DescriptionError(f"'{path}' is no single number: expected one of {', '.join(held[:4])}{more}")
    hint = nearest(path, every) or f": expected its path in the file, such as {next(iter(every), 'links')}"
    raise DescriptionError(f"unknown dimension '{path}'{hint}")


def value(m: Description, path: str) -> float | complex:
    """The number at a path; x + iy of a point. A rate of an input that is not given is 0, its angle that of the guess.

    Examples
    --------
    >>> from virtualwork.describe.parts import Input, Link
    >>> arm = Description({"O": 0j}, {"arm": Link({"O": 0j, "P": (3, 4)}, mass=2)}, inputs=Input("arm"))
    >>> value(arm, "links.arm.mass"), value(arm, "links.arm.P"), value(arm, "input.speed")
    (2.0, (3+4j), 0.0)
    """
    numbers = [number_of(m, dimension) for dimension in named(m, path)]
    return numbers[0] if len(numbers) == 1 else joined(*numbers)


def number_of(m: Description, dimension: Dimension) -> float:
    """The number of a dimension."""
    of: Any = m
    for key in dimension.where:
        of = _part(of, key)
    if of is None:
        _, j, key = dimension.where
        return m.at[int(j)] if key == "value" else 0.0
    return of  # type: ignore[no-any-return]


def by_path(dimensions: Iterable[Dimension], numbers: Iterable[float]) -> dict[str, float]:
    """The numbers of dimensions, as `changed` takes them."""
    return dict(zip((d.path for d in dimensions), numbers, strict=True))


def changed(m: D, numbers: Mapping[str, Any]) -> D:
    """The mechanism with other numbers at some paths; everything else, the kind too, is as it was.

    Parameters
    ----------
    m : Description
    numbers : mapping of path to number, SI
        Floats, or any numbers that behave so. A point's own path takes x + iy or (x, y).

    Raises
    ------
    DescriptionError
        Where a path names nothing, or the mechanism cannot be so.

    Examples
    --------
    A point that depends on another follows it:

    >>> from virtualwork.describe.parts import Input, Link, Polar
    >>> arm = Link({"O": 0j, "P": (0.5, 0), "Q": Polar("P", 0.25, 0)})
    >>> m = Description({"O": 0j}, {"arm": arm}, inputs=Input("arm"))
    >>> changed(m, {"links.arm.P": (1, 0)}).links["arm"].points["Q"]
    (1.25+0j)
    """
    return type(m)(**parts_with(m, numbers))


def parts_with(m: Description, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a mechanism with other numbers at some paths, as `changed` takes them; whether they fit is not checked."""
    if not isinstance(numbers, Mapping):
        raise DescriptionError(
            f"expected numbers by their paths, such as {{'{next(iter(dimensions(m)))}': 1.0}}, found {numbers!r}"
        )
    parts: dict[Any, Any] = {f.name: getattr(m, f.name) for f in fields(m)}
    for path, number in numbers.items():
        places = named(m, path)
        for dimension, part in zip(places, _finite(path, number, len(places)), strict=True):
            first, *rest = dimension.where
            parts[first] = _with(parts[first], tuple(rest), part)
    return parts


def _finite(path: str, number: Any, count: int) -> tuple[Any, ...]:
    """One number, or the two of a point; numbers that vary pass.

    Raises
    ------
    DescriptionError
    """
    parts: tuple[Any, ...] = (number,)
    if path == "gravity" and isinstance(number, Real) and number != 0:
        raise DescriptionError(
            f"'gravity': found {number!r}, expected its two components, such as (0, -9.81)"
        )
    if count == 2 and isinstance(number, complex | Real):
        parts = number.real, number.imag
    elif count == 2 and isinstance(number, Iterable):
        parts = tuple(number)
    finite = (isinstance(x, Constant) or (isinstance(x, Real) and abs(float(x)) <= LARGEST) for x in parts)
    if len(parts) != count or not all(finite):
        expected = "a finite number" if count == 1 else "a point (x, y) or x + iy of finite numbers"
        raise DescriptionError(f"'{path}': found {number!r}, expected {expected}")
    return parts


def _part(of: Any, key: str | int) -> Any:
    if isinstance(of, (Mapping, tuple)):
        return of[key]  # type: ignore[index]
    if isinstance(of, complex):
        return of.real if key == "x" else of.imag
    return getattr(of, str(key))


def _with(of: Any, where: Where, number: Any) -> Any:
    """A part of a description with another number somewhere in it."""
    if not where:
        return number
    key, *rest = where
    part = _with(_part(of, key), tuple(rest), number)
    if isinstance(of, Mapping):
        return {**of, key: part}
    if isinstance(of, tuple):
        return tuple(part if i == key else each for i, each in enumerate(of))
    if isinstance(of, complex):
        return joined(part, of.imag) if key == "x" else joined(of.real, part)
    return replace(of, **{str(key): part})
