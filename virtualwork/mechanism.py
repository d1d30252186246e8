"""A planar mechanism as its designer describes it: links, joints, inputs, loads. All frozen, all SI.

Points and vectors of the plane are complex numbers x + iy: R e^{iθ} is then written as the books print it.
Nothing is solved here; `Mechanism.motion` hands the description on to `virtualwork.motion`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

from virtualwork.describe.errors import DescriptionError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from virtualwork.assembly import Assembly
    from virtualwork.motion import Motion

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


def _points(given: Mapping[str, Point]) -> Mapping[str, complex]:
    return MappingProxyType({name: as_point(value) for name, value in given.items()})


@dataclass(frozen=True)
class Link:
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
        object.__setattr__(self, "points", _points(points))
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


@dataclass(frozen=True)
class Guess:
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
        object.__setattr__(self, "points", _points(points or {}))


@dataclass(frozen=True)
class Force:
    """A force of fixed components in ground or link axes (N), at a point of a link given in the link's axes (m).

    `history` is a table (input, force) in place of a constant, linear between its rows; with a turning input and a
    span of whole turns it is `periodic`, one cycle that repeats.
    """

    link: str
    point: complex
    force: complex = 0j
    frame: Literal["ground", "link"] = "ground"
    history: tuple[tuple[float, complex], ...] | None = None
    periodic: bool = False


@dataclass(frozen=True)
class Torque:
    """A torque on a link, N·m, counter-clockwise."""

    link: str
    torque: float


@dataclass(frozen=True)
class Spring:
    """A spring and damper between two points, each given as (link, point in its axes)."""

    between: tuple[tuple[str, complex], tuple[str, complex]]
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
    """A motor carried by one link and driving another; its mass joins the carrier (000 §2.3)."""

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


@dataclass(frozen=True)
class Mechanism:
    """A planar mechanism, described: who is pinned, guided, geared, driven and loaded by what.

    Parameters
    ----------
    ground : mapping of name to (x, y)
        The fixed points, m.
    links : mapping of name to Link
        Points that share a name are pinned together.
    guides : sequence of Guide
        Slots and sliders.
    gears : sequence of Gear
    inputs : Input or sequence of Input
    guess : Guess
        Rough link angles or point positions that choose the assembly.

    Raises
    ------
    DescriptionError
        Where names are unknown or sizes contradict each other; the message names the place.

    Examples
    --------
    Norton's four-bar (Design of Machinery, ex. 4-1): crank 40, coupler 120, rocker 80, ground 100 mm.

    >>> import math
    >>> m = Mechanism(
    ...     ground={"A": (0, 0), "D": (0.100, 0)},
    ...     links={"crank": Link({"A": (0, 0), "B": (0.040, 0)}),
    ...            "coupler": Link({"B": (0, 0), "C": (0.120, 0)}),
    ...            "rocker": Link({"D": (0, 0), "C": (0.080, 0)})},
    ...     inputs=Input(link="crank"),
    ...     guess=Guess(at=(math.radians(40),), angles={"coupler": 0.3, "rocker": 1.0}))
    >>> round(math.degrees(m.motion(math.radians(40)).link("rocker").angle[0]), 2)
    57.32
    """

    ground: Mapping[str, complex]
    links: Mapping[str, Link]
    guides: tuple[Guide, ...] = ()
    gears: tuple[Gear, ...] = ()
    inputs: tuple[Input, ...] = ()
    guess: Guess = field(default_factory=Guess)
    name: str = ""
    gravity: complex = 0j
    forces: tuple[Force, ...] = ()
    torques: tuple[Torque, ...] = ()
    springs: tuple[Spring, ...] = ()
    torsion_springs: tuple[TorsionSpring, ...] = ()
    motors: tuple[Motor, ...] = ()
    friction: tuple[Friction, ...] = ()

    def __init__(
        self,
        ground: Mapping[str, Point],
        links: Mapping[str, Link],
        guides: Sequence[Guide] = (),
        gears: Sequence[Gear] = (),
        inputs: Input | Sequence[Input] = (),
        guess: Guess | None = None,
        name: str = "",
        gravity: Point = 0j,
        **loads: Any,
    ) -> None:
        put = object.__setattr__
        put(self, "ground", _points(ground))
        put(self, "links", MappingProxyType(dict(links)))
        put(self, "guides", tuple(guides))
        put(self, "gears", tuple(gears))
        put(self, "inputs", (inputs,) if isinstance(inputs, Input) else tuple(inputs))
        put(self, "guess", guess or Guess())
        put(self, "name", name)
        put(self, "gravity", as_point(gravity))
        for key in ("forces", "torques", "springs", "torsion_springs", "motors", "friction"):
            put(self, key, tuple(loads.pop(key, ())))
        if loads:
            raise TypeError(f"Mechanism has no field {', '.join(sorted(loads))}")
        _validate(self)

    @classmethod
    def from_toml(cls, path: str | Path) -> Mechanism:
        """Read the TOML description of a mechanism.

        Parameters
        ----------
        path : str or Path

        Raises
        ------
        DescriptionError
            Names the file, the table and the key, what was found and what was expected.
        """
        from virtualwork.describe.reader import read

        return read(Path(path))

    @cached_property
    def size(self) -> float:
        """The characteristic length, m: the longest distance between two points of one link or of the ground.

        Every tolerance is relative to it.
        """
        spans = [abs(a - b) for body in self.bodies.values() for a in body.values() for b in body.values()]
        rooms = [abs(g.through) for g in self.guides if not isinstance(g.through, str)]
        return max(spans + rooms, default=0.0) or 1.0

    @cached_property
    def bodies(self) -> Mapping[str, Mapping[str, complex]]:
        """The points of each body in its own axes; the ground comes first."""
        return {GROUND: self.ground} | {name: link.points for name, link in self.links.items()}

    @cached_property
    def pins(self) -> Mapping[str, tuple[str, ...]]:
        """The bodies that meet at each pin, in the order of the file, the ground first."""
        holders: dict[str, list[str]] = {}
        for body, points in self.bodies.items():
            for point in points:
                holders.setdefault(point, []).append(body)
        return {point: tuple(bodies) for point, bodies in holders.items() if len(bodies) > 1}

    @cached_property
    def at(self) -> tuple[float, ...]:
        """The inputs at which the guess is meant: its `at`, else each input's own value, else its guessed angle."""
        if self.guess.at is not None:
            return self.guess.at
        return tuple(
            entry.value if entry.value is not None else self.guess.angles.get(entry.name, 0.0)
            for entry in self.inputs
        )

    @cached_property
    def assembly(self) -> Assembly:
        """The assembly that the guess chooses, ready to move."""
        from virtualwork.assembly import Assembly

        return Assembly.from_guess(self)

    def motion(
        self,
        angle: ArrayLike | None = None,
        speed: ArrayLike = 0.0,
        acceleration: ArrayLike = 0.0,
        jerk: ArrayLike = 0.0,
    ) -> Motion:
        """Motion of the assembly that the guess chooses; every quantity is solved when first asked for.

        Parameters
        ----------
        angle : array (n,), or (n, k) for k inputs
            The input: rad for a turning input, m for a slide. Without it the motion is the description's own: its
            value, its speed and its acceleration.
        speed, acceleration, jerk : same shape or scalar
            Its derivatives in time.

        Returns
        -------
        Motion

        Examples
        --------
        >>> m = Mechanism(ground={"O": (0, 0)}, links={"arm": Link({"O": (0, 0), "P": (2, 0)})},
        ...               inputs=Input(link="arm"))
        >>> m.motion(0.0, speed=3.0).point("P").velocity
        array([[0., 6.]])
        """
        from virtualwork.motion import Motion

        if angle is None:
            return Motion(self.assembly)
        return Motion(self.assembly, angle, speed, acceleration, jerk)

    def assemblies(self) -> tuple[Assembly, ...]:
        """Every assembly at the input where the guess is meant, the guess's own first."""
        from virtualwork.assembly import all_assemblies

        return all_assemblies(self)


def _validate(m: Mechanism) -> None:
    """Refuse unknown names and impossible sizes, each with its place."""
    from difflib import get_close_matches

    def known(name: str, names: Mapping[str, object] | set[str], where: str, what: str) -> None:
        if name not in names:
            close = get_close_matches(name, list(names), n=1, cutoff=0.4)
            hint = f"; did you mean '{close[0]}'?" if close else ""
            raise DescriptionError(f"{where}: unknown {what} '{name}'{hint}")

    if GROUND in m.links:
        raise DescriptionError("[links.ground]: 'ground' is the fixed body; give this link another name")
    if not m.links:
        raise DescriptionError("[links]: the mechanism has no links")
    bodies = m.bodies
    for name, link in m.links.items():
        seen: dict[complex, str] = {}
        for point, z in link.points.items():
            if not (abs(z) < float("inf")):
                raise DescriptionError(
                    f"[links.{name}] points.{point}: found {z}, expected finite coordinates"
                )
            shared = point in m.pins or any(g.point == point and g.link == name for g in m.guides)
            if z in seen and shared and seen[z] in m.pins:
                raise DescriptionError(
                    f"[links.{name}] points: {seen[z]} and {point} are both joints at the same place: "
                    "a link of zero length; pin the links at one point name instead"
                )
            if shared:
                seen[z] = point
        if link.mass < 0 or link.inertia < 0:
            raise DescriptionError(f"[links.{name}]: mass and inertia must not be negative")
    for i, guide in enumerate(m.guides):
        where = f"[[{'sliders' if guide.is_slider else 'slots'}]] {i + 1} ({guide.point})"
        known(guide.link, bodies, where + " link", "link")
        known(guide.on, bodies, where + " on", "link")
        owner = GROUND if guide.link == GROUND else f"link {guide.link}"
        known(guide.point, bodies[guide.link], where + " point", f"point of {owner}")
        if isinstance(guide.through, str):
            known(guide.through, bodies[guide.on], where + " through", f"point of {guide.on}")
        if guide.link == guide.on:
            raise DescriptionError(f"{where}: link '{guide.link}' cannot be guided by itself")
    names = [g.point for g in m.guides]
    for i, gear in enumerate(m.gears):
        where = f"[[gears]] {i + 1}"
        for body in (*gear.links, gear.arm):
            known(body, bodies, where, "link")
        if gear.ratio == 0 or len({*gear.links, gear.arm}) < 3:
            raise DescriptionError(
                f"{where}: expected two links, an arm that is neither, and a ratio other than 0"
            )
    for i, entry in enumerate(m.inputs):
        where = "[input]" if len(m.inputs) == 1 else f"[[input]] {i + 1}"
        if (entry.link is None) == (entry.slider is None):
            raise DescriptionError(f"{where}: expected either a link or a slider")
        if entry.slider is not None:
            known(entry.slider, set(names), where + " slider", "slot or slider")
            if names.count(entry.slider) > 1:
                raise DescriptionError(f"{where} slider: '{entry.slider}' runs in more than one guide")
        else:
            known(str(entry.link), m.links, where + " link", "link")
            known(entry.on, bodies, where + " on", "link")
    if m.guess.at is not None and len(m.guess.at) != len(m.inputs):
        raise DescriptionError(
            f"[guess] at: found {len(m.guess.at)} values, expected one for each of {len(m.inputs)} inputs"
        )
    for name in m.guess.angles:
        known(name, m.links, f"[guess] {name}", "link or point")
    for i, force in enumerate(m.forces):
        known(force.link, m.links, f"[[forces]] {i + 1} link", "link")
    for i, torque in enumerate(m.torques):
        known(torque.link, m.links, f"[[torques]] {i + 1} link", "link")
