"""The parts of a mechanism: links, guides, gears, inputs, the guess that chooses the assembly, and the loads.

Points and vectors of the plane are complex numbers x + iy: R e^{iθ} is then written as the books print it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from types import MappingProxyType
from typing import Literal

from dalembert.arithmetic.records import Record, record
from dalembert.arithmetic.varied import rotation
from virtualwork.describe import DescriptionError, hint

GROUND = "ground"
Point = complex | tuple[float, float] | Sequence[float]


def as_point(value: Point) -> complex:
    """Read a point of the plane, `x + iy` or `(x, y)`, as a complex number.

    >>> as_point((3, 4))
    (3+4j)
    """
    if isinstance(value, complex):
        # a number that varies stays what it is
        return complex(value) if hasattr(value, "dtype") else value
    if isinstance(value, Real):
        return complex(value)
    x, y = value
    return joined(x, y)


def joined(x: float, y: float) -> complex:
    """x + iy, of numbers that vary too.

    >>> joined(3, 4)
    (3+4j)
    """
    plain = isinstance(x, Real) and isinstance(y, Real)
    return complex(x, y) if plain else as_number(x) + 1j * as_number(y)


def as_number(value: float) -> float:
    """Read a real number as a float; one that varies stays what it is.

    >>> as_number(3)
    3.0
    """
    return value if isinstance(value, complex) else float(value)


def as_points(given: Mapping[str, Point]) -> Mapping[str, complex]:
    """Read named points, and freeze them."""
    return MappingProxyType({name: as_point(value) for name, value in given.items()})


@dataclass(frozen=True)
class Polar:
    """A point of a link by its distance and direction from another point of it, in the link's axes, m and rad."""

    origin: str
    length: float
    angle: float

    @property
    def arm(self) -> complex:
        """From the other point to this one."""
        return self.length * rotation(self.angle)  # type: ignore[no-any-return]


def placed(given: Mapping[str, Point | Polar]) -> Mapping[str, complex]:
    """Where the points of a link lie, those given by distance and direction too; frozen.

    Raises
    ------
    DescriptionError
        Where one hangs on no point, or on itself.

    Examples
    --------
    >>> dict(placed({"H": Polar("G", 2, 0), "G": (1, 0)}))
    {'H': (3+0j), 'G': (1+0j)}
    """
    found: dict[str, complex] = {}
    waiting = dict(given)
    while waiting:
        ready = [p for p, at in waiting.items() if not isinstance(at, Polar) or at.origin in found]
        if not ready:
            point, at = next((p, at) for p, at in waiting.items() if isinstance(at, Polar))
            if at.origin not in waiting:
                raise DescriptionError(
                    f"points.{point} from: unknown point '{at.origin}'{hint(at.origin, given)}"
                )
            raise DescriptionError(f"points.{point} from: '{at.origin}' hangs on '{point}' itself")
        for point in ready:
            z = waiting.pop(point)
            found[point] = found[z.origin] + z.arm if isinstance(z, Polar) else as_point(z)
    return MappingProxyType({point: found[point] for point in given})


@record
@dataclass(frozen=True, eq=False, repr=False)
class Link(Record):
    """A rigid link: its named points in its own axes, and its mass.

    Parameters
    ----------
    points : mapping of name to (x, y) or Polar
        In the link's own axes, m. Points that share a name with another link's are pinned together.
    mass : float
        kg.
    center : (x, y)
        Centre of mass in the link's own axes, m.
    inertia : float
        About the centre of mass, kg·m².
    polar : mapping of name to Polar
        The points that are given by distance and direction: they win over `points`.
    """

    points: Mapping[str, complex]
    mass: float = 0.0
    center: complex = 0j
    inertia: float = 0.0
    polar: Mapping[str, Polar] = field(default_factory=dict)

    def __init__(
        self,
        points: Mapping[str, Point | Polar],
        mass: float = 0.0,
        center: Point = 0j,
        inertia: float = 0.0,
        polar: Mapping[str, Polar] | None = None,
    ) -> None:
        given = {**points, **(polar or {})}
        object.__setattr__(self, "points", placed(given))
        object.__setattr__(self, "mass", as_number(mass))
        object.__setattr__(self, "center", as_point(center))
        object.__setattr__(self, "inertia", as_number(inertia))
        hung = {point: at for point, at in given.items() if isinstance(at, Polar)}
        object.__setattr__(self, "polar", MappingProxyType(hung))


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
            None
            if at is None
            else (as_number(at),)
            if isinstance(at, (int, float, complex))
            else tuple(map(as_number, at))
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


@dataclass(frozen=True)
class Force:
    """A force of fixed components in ground or link axes (N), at a point of a link.

    The point is given in the link's axes (m), by its name, or not at all: the link's own centre of mass.
    `history` is a table (input, force) in place of a constant, linear between its rows; with a turning input and a
    span of whole turns it is `periodic`, one cycle that repeats.
    """

    link: str
    point: complex | str | None
    force: complex = 0j
    frame: Literal["ground", "link"] = "ground"
    history: tuple[tuple[float, complex], ...] | None = None
    periodic: bool = False


@dataclass(frozen=True)
class Torque:
    """A torque on a link, N·m, counter-clockwise.

    `history` is a table (x, torque) in place of a constant, linear between its rows, `over` the time (s), the link's
    angle (rad) or its speed (rad/s); over an angle with a span of whole turns it is `periodic`.
    """

    link: str
    torque: float = 0.0
    history: tuple[tuple[float, float], ...] | None = None
    over: Literal["time", "angle", "speed"] = "time"
    periodic: bool = False


@dataclass(frozen=True)
class Spring:
    """A spring and damper between two points, each given as (link, point): its name, or its place in the link's axes."""

    between: tuple[tuple[str, complex | str], tuple[str, complex | str]]
    stiffness: float = 0.0
    free_length: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True)
class TorsionSpring:
    """A torsion spring and damper between two links; its angle is θ_second − θ_first."""

    links: tuple[str, str]
    stiffness: float = 0.0
    free_angle: float = 0.0
    damping: float = 0.0


@dataclass(frozen=True)
class Motor:
    """A motor carried by one link and driving another; its mass joins the carrier (Ibrahim §2.3)."""

    carrier: str
    drives: str
    mass: float = 0.0
    center: complex = 0j


@dataclass(frozen=True)
class Friction:
    """Coulomb friction in a joint: a pin of `radius`, or a guide (radius 0)."""

    joint: str
    coefficient: float
    radius: float = 0.0
