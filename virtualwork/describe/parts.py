"""The parts of a mechanism: links, guides, gears, inputs, the guess that chooses the assembly, and the loads.

A field is declared once, with its key in the file: the form of its value, its meaning, its default. The reader, the
schema, the paths of dimensions, the checks of names and the TOML text follow from that (`describe.keys`).

Points and vectors of the plane are complex numbers x + iy: R e^{iθ} is then written as the books print it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import Any, ClassVar, Literal

from dalembert.arithmetic.records import Record, record
from dalembert.dataclass import dataclass, field
from virtualwork.describe import DescriptionError
from virtualwork.describe.cams import Cam as Cam
from virtualwork.describe.curves import ForceTable, Law, TorqueOrTable
from virtualwork.describe.file import GROUND as GROUND
from virtualwork.describe.file import Entry
from virtualwork.describe.forms import (
    Body,
    Choice,
    DrivenPoint,
    Ends,
    Free,
    Pair,
    Place,
    PointName,
    Scalar,
    TwoBodies,
)
from virtualwork.describe.keys import Key, Part, declared
from virtualwork.describe.laws import Segment as Segment
from virtualwork.describe.meshes import Belt as Belt
from virtualwork.describe.meshes import Gear as Gear
from virtualwork.describe.meshes import Rack as Rack
from virtualwork.describe.points import Polar as Polar
from virtualwork.describe.points import as_points, by_name, placed
from virtualwork.describe.values import Point as Point
from virtualwork.describe.values import as_number
from virtualwork.describe.values import as_point as as_point


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
        The points in polar form: they win over `points`.
    """

    points: Mapping[str, complex] = declared(
        Free("points"),
        "named points in the link's own axes; links that share a name are pinned there",
        needed=False,
    )
    mass: float = declared(Scalar("mass", negative=False), "the mass, kg", default=0.0)
    center: complex = declared(Pair("length"), "the centre of mass in the link's own axes", default=0j)
    inertia: float = declared(
        Scalar("inertia", negative=False),
        "the moment of inertia about the centre of mass, kg m2",
        default=0.0,
    )
    polar: Mapping[str, Polar] = field(default_factory=dict)

    def __init__(
        self,
        points: Mapping[str, Point | Polar],
        mass: float = 0.0,
        center: Point = 0j,
        inertia: float = 0.0,
        polar: Mapping[str, Polar] | None = None,
    ) -> None:
        every = {**by_name("points", points), **(polar or {})}
        object.__setattr__(self, "points", placed(every))
        object.__setattr__(self, "mass", as_number(mass, "mass"))
        object.__setattr__(self, "center", as_point(center, "center"))
        object.__setattr__(self, "inertia", as_number(inertia, "inertia"))
        relative = {point: at for point, at in every.items() if isinstance(at, Polar)}
        object.__setattr__(self, "polar", MappingProxyType(relative))


def only_holder(entry: Entry) -> str:
    """The body whose point is guided, where one alone can be meant: a link that does not carry the line, else the ground.

    Raises
    ------
    DescriptionError
        Where there is none, or more than one.
    """
    point, bodies = str(entry.keys["point"]), entry.file.bodies
    carrier = entry.keys.get("on")
    holders = [name for name in bodies if point in bodies[name] and name not in (GROUND, carrier)]
    if not holders and point in bodies[GROUND]:
        return GROUND
    if len(holders) != 1:
        raise DescriptionError(
            f"{entry.where} link: missing; expected the link whose point {point} is guided"
        )
    return holders[0]


@dataclass(frozen=True)
class Guide(Part):
    """A point of one link that stays on a straight line of another: a slot, or a slider that cannot turn in it.

    The line runs through `through` (a named point of `on`, or coordinates in its axes), at `angle` to its x-axis.
    `turned` None is a slot, the link may turn; a number is a prism: the link's x-axis stands at `turned` to the
    line. The slide is the signed distance of the point from `through` along the line. `link` may be the ground: a fixed
    pin in a moving slot, or a fixed block on which a rail slides.
    """

    tables: ClassVar = ("slots", "sliders")
    collection: ClassVar = "guides"

    point: str = declared(PointName("link"), "the point that is guided")
    link: str = declared(
        Body(), "the link of the point; where it is left out, the only one that has it", absent=only_holder
    )
    on: str = declared(Body(), "the link that carries the line", default=GROUND)
    through: str | complex = declared(
        Place("on"), "a point of the line: a name on that link or [x, y]", default=0j
    )
    angle: float = declared(
        Scalar("angle"), "the direction of the line against the carrier's x-axis", default=0.0
    )
    turned: float | None = declared(
        Scalar("angle"), "the link's x-axis against the line", default=None, absent=0.0, table="sliders"
    )

    @property
    def is_slider(self) -> bool:
        """True where the link cannot turn in its guide."""
        return self.turned is not None

    @property
    def table(self) -> str:
        """The table of the file, slots or sliders."""
        return self.tables[self.is_slider]

    @property
    def label(self) -> str:
        """The point's name, as messages have it after the table."""
        return f" ({self.point})"

    def check(self, where: str) -> None:
        if self.link == self.on:
            raise DescriptionError(f"{where}: link '{self.link}' cannot be guided by itself")


@dataclass(frozen=True)
class Input(Part):
    """An input: the angle of `link` (against `on`), or the position of a `slider` along its guide.

    `value` is the angle (rad) or position (m) of the single pose that is meant; `speed` and its rates are its
    derivatives in time. `history` is a table (time, value) where the law of motion is data.
    """

    tables: ClassVar = ("input",)
    collection: ClassVar = "inputs"

    link: str | None = declared(
        Body(ground=False), "the link that is driven by its angle", default=None, unless="slider"
    )
    on: str = declared(Body(), "the link against which the angle is measured", default=GROUND, beside="link")
    slider: str | None = declared(
        DrivenPoint(), "the point of the slot or slider that is driven by its position", default=None
    )
    value: float | None = declared(
        Scalar("angle"),
        "the angle of the link in the file's own pose",
        default=None,
        name="angle",
        beside="link",
        also=(
            Key(
                Scalar("length"),
                "the position of the slider in the file's own pose",
                name="position",
                beside="slider",
            ),
        ),
    )
    speed: float | None = declared(
        Scalar("speed", sliding="velocity"), "the speed: rad/s of a link, m/s of a slider", default=None
    )
    acceleration: float | None = declared(
        Scalar("angular acceleration", sliding="acceleration"),
        "the acceleration: rad/s2 of a link, m/s2 of a slider",
        default=None,
    )
    jerk: float | None = declared(
        Scalar("angular jerk", sliding="jerk"),
        "the jerk: rad/s3 of a link, m/s3 of a slider",
        default=None,
    )
    history: tuple[tuple[float, float], ...] | None = declared(
        Law(), "a table in the file's folder: time_s and the angle or position", default=None, name="law"
    )

    def check(self, where: str) -> None:
        if (self.link is None) == (self.slider is None):
            raise DescriptionError(f"{where}: expected either a link or a slider")
        if self.link == self.on:
            raise DescriptionError(
                f"{where} on: link '{self.link}' cannot turn against itself; name another link, "
                "or leave `on` out for the ground"
            )

    @property
    def name(self) -> str:
        """The driven link, or the point of the driven slider."""
        return self.slider if self.slider is not None else str(self.link)

    @property
    def is_slide(self) -> bool:
        """True where the input is a position along a guide, m, instead of an angle, rad."""
        return self.slider is not None

    slides = is_slide


@record
@dataclass(frozen=True, eq=False, repr=False)
class Guess(Record):
    """A rough pose of the mechanism at the inputs `at`; it chooses the assembly."""

    at: tuple[float, ...] | None = declared(
        Free("inputs"), "the input, or every input, for which the guess holds", default=None
    )
    angles: Mapping[str, float] = field(default_factory=dict)
    points: Mapping[str, complex] = field(default_factory=dict)

    def __init__(
        self,
        at: float | Sequence[float] | None = None,
        angles: Mapping[str, float] | None = None,
        points: Mapping[str, Point] | None = None,
    ) -> None:
        every: Any = at if isinstance(at, Iterable) and getattr(at, "ndim", True) else (at,)
        values = None if at is None else tuple(as_number(value, "[guess] at") for value in every)
        turns = by_name("[guess] angles", angles or {})
        object.__setattr__(self, "at", values)
        object.__setattr__(
            self,
            "angles",
            MappingProxyType({link: as_number(turn, f"[guess] {link}") for link, turn in turns.items()}),
        )
        object.__setattr__(self, "points", as_points(points or {}, "[guess] points"))


@dataclass(frozen=True)
class Rigid:
    """Mass, centre of mass and inertia of a link, with the motors it carries."""

    mass: float
    center: complex
    inertia: float


def _check_rising(where: str, over: str, rows: Sequence[tuple[float, complex]] | None) -> None:
    if rows is not None and (len(rows) < 2 or any(not b > a for (a, _), (b, _) in pairwise(rows))):
        raise DescriptionError(f"{where} history: expected at least two rows, the {over} rising")


@dataclass(frozen=True)
class Force(Part):
    """A force of fixed components in ground or link axes (N), at a point of a link.

    The point is given in the link's axes (m), by its name, or not at all: the link's own centre of mass.
    `history` is a table (input, force) in place of a constant, linear between its rows; with a turning input and a
    span of whole turns it is `periodic`, one cycle that repeats.
    """

    tables: ClassVar = ("forces",)
    collection: ClassVar = "forces"

    link: str = declared(Body(ground=False), "the link it acts on")
    point: complex | str | None = declared(
        Place("link"),
        "a point of the link by name or [x, y] in its axes; else its centre of mass",
        default=None,
    )
    force: complex = declared(Pair("force"), "its two components, N", default=0j, unless="history")
    frame: Literal["ground", "link"] = declared(
        Choice(("ground", "link")), "the axes of the components", default="ground"
    )
    history: tuple[tuple[float, complex], ...] | None = declared(
        ForceTable(),
        "a table in the file's folder in place of force: the input, fx_N and fy_N",
        default=None,
        name="table",
    )
    periodic: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_rising(f"force on {self.link}", "input", self.history)


@dataclass(frozen=True)
class Torque(Part):
    """A torque on a link, N·m, counter-clockwise.

    `history` is a table (x, torque) in place of a constant, linear between its rows, `over` the time (s), the link's
    angle (rad) or its speed (rad/s); over an angle with a span of whole turns it is `periodic`.
    """

    tables: ClassVar = ("torques",)
    collection: ClassVar = "torques"

    link: str = declared(Body(ground=False), "the link it acts on")
    torque: float = declared(
        TorqueOrTable(),
        "counter-clockwise, N m; or a table in the file's folder: torque_N_m over t_s, angle_deg or speed_rad_s of the link",
        default=0.0,
        needed=True,
        unless="history",
    )
    history: tuple[tuple[float, float], ...] | None = None
    over: Literal["time", "angle", "speed"] = "time"
    periodic: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.over not in ("time", "angle", "speed"):
            raise DescriptionError(
                f"torque on {self.link} over: found '{self.over}', expected time, angle or speed"
            )
        _check_rising(f"torque on {self.link}", self.over, self.history)


@dataclass(frozen=True)
class Spring(Part):
    """A spring and damper between two points, each (link, point): a name, or coordinates in the link's axes."""

    tables: ClassVar = ("springs",)
    collection: ClassVar = "springs"

    between: tuple[tuple[str, complex | str], tuple[str, complex | str]] = declared(
        Ends(), "its ends: two points such as crank.B and ground.D"
    )
    stiffness: float = declared(Scalar("stiffness"), "N/m", default=0.0)
    free_length: float = declared(Scalar("length"), "the length without force", default=0.0)
    damping: float = declared(Scalar("damping"), "of a damper, N s/m", default=0.0)


@dataclass(frozen=True)
class TorsionSpring(Part):
    """A torsion spring and damper between two links; its angle is θ_second − θ_first.

    At the guess it is twisted by less than half a turn from free, plus the whole `turns`.
    """

    tables: ClassVar = ("torsion_springs",)
    collection: ClassVar = "torsion_springs"

    links: tuple[str, str] = declared(
        TwoBodies(), "the two links; its angle is the second's less the first's"
    )
    stiffness: float = declared(Scalar("torsional stiffness"), "N m/rad", default=0.0)
    free_angle: float = declared(Scalar("angle"), "the angle without torque", default=0.0)
    damping: float = declared(Scalar("torsional damping"), "of a damper, N m s/rad", default=0.0)
    turns: int = 0


@dataclass(frozen=True)
class Motor(Part):
    """A motor carried by one link and driving another; its mass joins the carrier (Ibrahim §2.3)."""

    tables: ClassVar = ("motors",)
    collection: ClassVar = "motors"

    carrier: str = declared(Body(), "the link that carries it")
    drives: str = declared(Body(ground=False), "the link that it drives")
    mass: float = declared(
        Scalar("mass", negative=False), "its mass, which joins the carrier, kg", default=0.0
    )
    center: complex = declared(Pair("length"), "its centre in the carrier's axes", default=0j)


@dataclass(frozen=True)
class Friction(Part):
    """Coulomb friction in a joint: a pin of `radius`, or a guide (radius 0)."""

    tables: ClassVar = ("friction",)
    collection: ClassVar = "friction"

    joint: str = declared(PointName(), "the point of the pin or guide")
    coefficient: float = declared(Scalar("number", negative=False), "the coefficient of friction")
    radius: float = declared(
        Scalar("length", negative=False),
        "the radius of the pin; 0 for the guide of a point that has both",
        default=0.0,
    )


PARTS: tuple[type[Part], ...] = (
    Input,
    Guide,
    Gear,
    Belt,
    Rack,
    Cam,
    Force,
    Torque,
    Spring,
    TorsionSpring,
    Motor,
    Friction,
)
"""The parts that stand in lists; a new one is added here, and its list to `Description`."""

TABLES: Mapping[str, type[Part]] = {table: part for part in PARTS for table in part.tables}
"""The tables of the file that may stand once or many times, with the part that each describes."""
