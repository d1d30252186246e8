"""The dimensions of a mechanism: every number of its description by its path in the file, read and changed.

`links.crank.B.x`, `links.leg.H.length` (a point in polar form), `links.coupler.mass`, `ground.D.y`, `springs.1.stiffness`
(lists count from 1), `input.speed`. A point's own path, `links.crank.B`, names both its coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

from virtualwork.describe import DescriptionError, hint
from virtualwork.describe.description import Description
from virtualwork.describe.entries import ENTRIES, LOADS, numbers
from virtualwork.describe.parts import joined
from virtualwork.describe.units import HEADERS

D = TypeVar("D", bound=Description)
Where = tuple[str | int, ...]
"""The way into a description: names of fields, keys, places in a list; x or y of a point comes last."""

# the numbers of an entry in a list, with their kinds of quantity
_LISTS: Mapping[str, Mapping[str, str]] = {name: numbers(ENTRIES[name]) for name in ("gears", *LOADS)} | {
    "forces": {"force": "pair of force", "point": "pair of length"},
    "torques": {"torque": "torque"},
}
_GUIDE = {"angle": "angle", "turned": "angle", "through": "pair of length"}
_LINK = {"mass": "mass", "inertia": "inertia", "center": "pair of length"}
_POLAR = {"length": "length", "angle": "angle"}


@dataclass(frozen=True)
class Dimension:
    """One number of a description.

    Attributes
    ----------
    path : str
    kind : str
        Which quantity it is, a key of `units.EXPECTED`.
    where : tuple
        The way to it.
    """

    path: str
    kind: str
    where: Where

    @property
    def unit(self) -> str:
        """How a column of it ends: `m`, `deg`; empty for a plain number."""
        return HEADERS[self.kind]

    @property
    def header(self) -> str:
        """Its path with its unit: `links.crank.B.x_m`."""
        return f"{self.path}_{self.unit}" if self.unit else self.path


def dimensions(m: Description) -> dict[str, Dimension]:
    """Every dimension of a mechanism by its path, in the order of the file.

    Examples
    --------
    >>> from virtualwork.describe.parts import Input, Link, Polar
    >>> arm = Link({"O": 0j, "P": (0.06, 0), "Q": Polar("P", 0.02, 0.5)}, mass=2)
    >>> found = dimensions(Description({"O": 0j}, {"arm": arm}, inputs=Input("arm")))
    >>> found["links.arm.P.x"].header, found["links.arm.Q.angle"].header, "links.arm.Q.x" in found
    ('links.arm.P.x_m', 'links.arm.Q.angle_deg', False)
    """
    return {dimension.path: dimension for dimension in _all(m)}


def _all(m: Description) -> Iterator[Dimension]:
    for point in m.ground:
        yield from _numbers(f"ground.{point}", "pair of length", ("ground", point))
    for name, link in m.links.items():
        for point in link.points:
            # a point that is called as a key of the link is named by the longer path
            path = f"links.{name}.points.{point}" if point in _LINK else f"links.{name}.{point}"
            if point in link.polar:
                for key, kind in _POLAR.items():
                    yield Dimension(f"{path}.{key}", kind, ("links", name, "polar", point, key))
            else:
                yield from _numbers(path, "pair of length", ("links", name, "points", point))
        for key, kind in _LINK.items():
            yield from _numbers(f"links.{name}.{key}", kind, ("links", name, key))
    count = {"slots": 0, "sliders": 0}
    for i, guide in enumerate(m.guides):
        table = "sliders" if guide.is_slider else "slots"
        count[table] += 1
        for key, kind in _GUIDE.items():
            if getattr(guide, key) is not None and not isinstance(getattr(guide, key), str):
                yield from _numbers(f"{table}.{count[table]}.{key}", kind, ("guides", i, key))
    for j, entry in enumerate(m.inputs):
        path = "input" if len(m.inputs) == 1 else f"input.{j + 1}"
        slide = "slide " if entry.is_slide else ""
        value = ("position", "length") if entry.is_slide else ("angle", "angle")
        yield Dimension(f"{path}.{value[0]}", value[1], ("inputs", j, "value"))
        for key in ("speed", "acceleration", "jerk"):
            yield Dimension(f"{path}.{key}", slide + key, ("inputs", j, key))
    yield from _numbers("gravity", "pair of slide acceleration", ("gravity",))
    for table, keys in _LISTS.items():
        for i, load in enumerate(getattr(m, table)):
            for key, kind in keys.items():
                tabled = key == "force" and load.history is not None
                if not tabled and isinstance(getattr(load, key), (int, float, complex)):
                    yield from _numbers(f"{table}.{i + 1}.{key}", kind, (table, i, key))


def _numbers(path: str, kind: str, where: Where) -> Iterator[Dimension]:
    one = kind.removeprefix("pair of ")
    if one == kind:
        yield Dimension(path, kind, where)
    else:
        yield from (Dimension(f"{path}.{axis}", one, (*where, axis)) for axis in "xy")


def named(m: Description, path: str, known: Mapping[str, Dimension] | None = None) -> tuple[Dimension, ...]:
    """The dimensions that a path names: one, or both coordinates of a point.

    Raises
    ------
    DescriptionError
        Where the path names none, or is of the wrong kind; the nearest is named.
    """
    known = dimensions(m) if known is None else known
    if path in known:
        return (known[path],)
    if f"{path}.x" in known:
        return known[f"{path}.x"], known[f"{path}.y"]
    stem, _, last = path.rpartition(".")
    # what the point has in place of what was asked for
    other = {"x": "length", "y": "length", "length": "x", "angle": "x"}.get(last)
    if f"{path}.length" in known or (other == "length" and f"{stem}.length" in known):
        point = path if f"{path}.length" in known else stem
        raise DescriptionError(
            f"'{path}': the point is given by distance and direction: expected {point}.length or {point}.angle"
        )
    if other == "x" and f"{stem}.x" in known:
        raise DescriptionError(f"'{path}': the point is given by coordinates: expected {stem}.x or {stem}.y")
    held = [each for each in known if each.startswith(f"{path}.")]
    if held:
        more = f" and {len(held) - 4} more" if len(held) > 4 else ""
        raise DescriptionError(f"'{path}' is no single number: expected one of {', '.join(held[:4])}{more}")
    raise DescriptionError(f"unknown dimension '{path}'{hint(path, known)}")


def value(m: Description, path: str) -> float | complex:
    """The number at a path; x + iy of a point. A rate of an input that is not given is 0, its angle that of the guess.

    Examples
    --------
    >>> from virtualwork.describe.parts import Input, Link
    >>> arm = Description({"O": 0j}, {"arm": Link({"O": 0j, "P": (3, 4)}, mass=2)}, inputs=Input("arm"))
    >>> value(arm, "links.arm.mass"), value(arm, "links.arm.P"), value(arm, "input.speed")
    (2.0, (3+4j), 0.0)
    """
    found = [_value(m, dimension) for dimension in named(m, path)]
    return found[0] if len(found) == 1 else joined(*found)


def _value(m: Description, dimension: Dimension) -> float:
    found: Any = m
    for key in dimension.where:
        found = _part(found, key)
    if found is None:
        _, j, key = dimension.where
        return m.at[int(j)] if key == "value" else 0.0
    number: float = found
    return number


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
    A point that hangs on another follows it:

    >>> from virtualwork.describe.parts import Input, Link, Polar
    >>> arm = Link({"O": 0j, "P": (0.5, 0), "Q": Polar("P", 0.25, 0)})
    >>> m = Description({"O": 0j}, {"arm": arm}, inputs=Input("arm"))
    >>> changed(m, {"links.arm.P": (1, 0)}).links["arm"].points["Q"]
    (1.25+0j)
    """
    known = dimensions(m)
    parts: dict[str | int, Any] = {f.name: getattr(m, f.name) for f in fields(m)}
    for path, number in numbers.items():
        found = named(m, path, known)
        pair = (number.real, number.imag) if isinstance(number, complex) and len(found) == 2 else number
        for dimension, part in zip(found, pair if len(found) == 2 else (number,), strict=True):
            first, *rest = dimension.where
            parts[first] = _with(parts[first], tuple(rest), part)
    return type(m)(**parts)  # type: ignore[arg-type]


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
