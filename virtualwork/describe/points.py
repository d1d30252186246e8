"""Points of the plane: complex numbers x + iy, by coordinates or in polar form from another point."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from dalembert.dataclass import dataclass
from dalembert.hints import choices
from virtualwork.describe import DescriptionError
from virtualwork.describe.forms import Form, Scalar
from virtualwork.describe.keys import convert, declared
from virtualwork.describe.values import Point, as_point


def by_name(what: str, entries: Mapping[str, Any]) -> Mapping[str, Any]:
    """Refuse what is no mapping of names."""
    if not isinstance(entries, Mapping):
        raise DescriptionError(f"{what}: expected a mapping of names, found {type(entries).__name__}")
    for name in entries:
        if not isinstance(name, str):
            raise DescriptionError(f"{what}: found the name {name!r}, expected a text such as '{name}'")
    return entries


def several(what: str, entries: object) -> tuple[Any, ...]:
    """Return the entries of a list as a tuple."""
    if not isinstance(entries, Iterable) or isinstance(entries, str | Mapping):
        raise DescriptionError(
            f"{what}: expected a list, found {type(entries).__name__}: write [...] around it"
        )
    return tuple(entries)


def as_points(points: Mapping[str, Point], what: str = "points") -> Mapping[str, complex]:
    """Read named points, and freeze them."""
    return MappingProxyType(
        {name: as_point(value, what, name) for name, value in by_name(what, points).items()}
    )


@dataclass(frozen=True)
class Polar:
    """A point of a link by its distance and direction from another point of it, in the link's axes, m and rad.

    >>> from virtualwork import Link
    >>> Link({"C": 0.3, "G": Polar("C", 0.5, 0.0)}).points["G"]
    (0.8+0j)
    """

    origin: str = declared(Form(), "another point of this link", name="from")
    length: float = declared(Scalar("length"), "the distance from there")
    angle: float = declared(Scalar("angle"), "its direction against the link's x-axis")

    def __post_init__(self) -> None:
        convert(self)

    @property
    def arm(self) -> complex:
        """From the other point to this one."""
        # the schema needs no tape
        from dalembert.arithmetic.varied import rotation

        return self.length * rotation(self.angle)  # type: ignore[no-any-return]


def placed(points: Mapping[str, Point | Polar]) -> Mapping[str, complex]:
    """The places of the points of a link, those in polar form too; frozen.

    Raises
    ------
    DescriptionError
        Where one refers to no point, or to itself.

    Examples
    --------
    >>> dict(placed({"H": Polar("G", 2, 0), "G": (1, 0)}))
    {'H': (3+0j), 'G': (1+0j)}
    """
    places: dict[str, complex] = {}
    waiting = dict(points)
    while waiting:
        ready = [p for p, at in waiting.items() if not isinstance(at, Polar) or at.origin in places]
        if not ready:
            point, at = next((p, at) for p, at in waiting.items() if isinstance(at, Polar))
            if at.origin not in waiting:
                raise DescriptionError(
                    f"points.{point} from: unknown point '{at.origin}'{choices(at.origin, points)}"
                )
            raise DescriptionError(f"points.{point} from: '{at.origin}' itself is placed from '{point}'")
        for point in ready:
            z = waiting.pop(point)
            places[point] = places[z.origin] + z.arm if isinstance(z, Polar) else as_point(z, "points", point)
    return MappingProxyType({point: places[point] for point in points})
