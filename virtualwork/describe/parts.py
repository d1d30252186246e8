"""The parts of a mechanism: links, guides, gears, inputs, and the guess that chooses the assembly.

Points and vectors of the plane are complex numbers x + iy: R e^{iθ} is then written as the books print it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from dalembert.arithmetic.records import record
from virtualwork.describe.record import Record

GROUND = "ground"
Point = complex | tuple[float, float] | Sequence[float]


def as_point(value: Point) -> complex:
    """Read a point of the plane, `x + iy` or `(x, y)`, as a complex number.

    >>> as_point((3, 4))
    (3+4j)
    """
    if isinstance(value, (complex, float, int)):
        return complex(value)
    x, y = value
    return complex(float(x), float(y))


def as_points(given: Mapping[str, Point]) -> Mapping[str, complex]:
    """Read named points, and freeze them."""
    return MappingProxyType({name: as_point(value) for name, value in given.items()})


@record
@dataclass(frozen=True, eq=False, repr=False)
class Link(Record):
    """A rigid link: its named points in its own axes, and its mass.

    Parameters
    ----------
    points : mapping of name to (x, y)
        In the link's own axes, m. Points that share a name with another link's are pinned together.
    mass : float
        kg.
    center : (x, y)
        Centre of mass in the link's own axes, m.
    inertia : float
        About the centre of mass, kg·m².
    """

    points: Mapping[str, complex]
    mass: float = 0.0
    center: complex = 0j
    inertia: float = 0.0

    def __init__(
        self, points: Mapping[str, Point], mass: float = 0.0, center: Point = 0j, inertia: float = 0.0
    ) -> None:
        object.__setattr__(self, "points", as_points(points))
        object.__setattr__(self, "mass", float(mass))
        object.__setattr__(self, "center", as_point(center))
        object.__setattr__(self, "inertia", float(inertia))


@dataclass(frozen=True)
class Guide:
    """A point of one link that stays on a straight line of another: a slot, or a slider that cannot turn in it.

    The line runs through `through` (a named point of `on`, or coordinates in its axes), at `angle` to its x-axis.
    `turned` None is a slot, the link may turn; a number is a prism: the link's x-axis stands at `turned` to the
    line. The slide is the signed distance of the point from `through` along the line. `link` may be the ground: a fixed
    pin in a moving slot, or a fixed block on which a rail slides.
    """

    point: str
    link: str
    on: str = GROUND
    through: str | complex = 0j
    angle: float = 0.0
    turned: float | None = None

    @property
    def is_slider(self) -> bool:
        """True where the link cannot turn in its guide."""
        return self.turned is not None


@dataclass(frozen=True)
class Gear:
    """Two toothed links: (ω_b − ω_arm) = ratio·(ω_a − ω_arm); an external mesh has a negative ratio."""

    links: tuple[str, str]
    ratio: float
    arm: str = GROUND

    def shares(self) -> dict[str, float]:
        """The share c of each body in Σ c·θ = const; the arm has none where the two links turn alike.

        >>> Gear(("sun", "planet"), -0.5, "arm").shares()
        {'planet': 1.0, 'sun': 0.5, 'arm': -1.5}
        """
        a, b = self.links
        found = {b: 1.0, a: -self.ratio, self.arm: self.ratio - 1.0}
        return {body: c for body, c in found.items() if c != 0}


@dataclass(frozen=True)
class Input:
    """What drives: the angle of `link` (against `on`), or the position of a `slider` along its guide.

    `value` is the angle (rad) or position (m) of the single pose that is meant; `speed` and its rates are its
    derivatives in time. `history` is a table (time, value) where the law of motion is data.
    """

    link: str | None = None
    on: str = GROUND
    slider: str | None = None
    value: float | None = None
    speed: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    history: tuple[tuple[float, float], ...] | None = None

    @property
    def name(self) -> str:
        """The driven link, or the point of the driven slider."""
        return self.slider if self.slider is not None else str(self.link)

    @property
    def is_slide(self) -> bool:
        """True where the input is a position along a guide, m, instead of an angle, rad."""
        return self.slider is not None


@record
@dataclass(frozen=True, eq=False, repr=False)
class Guess(Record):
    """Roughly how the mechanism stands when its inputs are `at`: this chooses the assembly."""

    at: tuple[float, ...] | None = None
    angles: Mapping[str, float] = field(default_factory=dict)
    points: Mapping[str, complex] = field(default_factory=dict)

    def __init__(
        self,
        at: float | Sequence[float] | None = None,
        angles: Mapping[str, float] | None = None,
        points: Mapping[str, Point] | None = None,
    ) -> None:
        values = (
            None if at is None else (float(at),) if isinstance(at, (int, float)) else tuple(map(float, at))
        )
        object.__setattr__(self, "at", values)
        object.__setattr__(self, "angles", MappingProxyType(dict(angles or {})))
        object.__setattr__(self, "points", as_points(points or {}))


@dataclass(frozen=True)
class Rigid:
    """Mass, centre of mass and inertia of a link, with the motors it carries."""

    mass: float
    center: complex
    inertia: float
