"""Cams: a link whose profile moves a follower, a slide or an arm, by a law of its angle.

The follower stands at its law wherever the cam turns (a spring, its weight or a groove holds it there). With y the
follower's coordinate, a slide or the angle of an arm,

    y = y₀ ± s(θ_cam − θ_on),

y₀ where it touches the base circle (R. L. Norton, Design of Machinery, 5th ed., §8.5 and §8.6).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from dalembert.arithmetic.varied import direction, heading, root
from dalembert.dataclass import dataclass, field
from virtualwork.describe import DescriptionError
from virtualwork.describe.curves import LiftTable
from virtualwork.describe.forms import Body, Choice, FollowerPoint, Nested, PointName, Scalar
from virtualwork.describe.keys import Part, check, declared
from virtualwork.describe.laws import Lift, Segment, pieces, spans, splined

FACES = ("knife", "roller", "flat")
SENSES = ("ccw", "cw")


@dataclass(frozen=True)
class Cam(Part):
    """A cam and its follower: a point that slides along a guide away from the cam, or an arm on a pivot.

    A sliding follower touches the cam with its guided point (knife), with a roller about it, or with a flat face across
    the guide through it. An arm touches it with its `point`, with a roller about that, or with a face along its own
    x-axis through it. Law: `law`, or `history`, a table of lift over one turn; either over the angle of the cam against
    the body that carries both.
    """

    tables: ClassVar = ("cams",)
    collection: ClassVar = "cams"

    cam: str = declared(Body(ground=False), "the link that is the cam")
    base_radius: float = declared(
        Scalar("length"), "the radius of its base circle, which the follower touches at lift zero"
    )
    slider: str | None = declared(
        FollowerPoint(), "the point of the slider or slot that is the follower", default=None
    )
    follower: str | None = declared(
        Body(ground=False), "the arm that is the follower", default=None, unless="slider"
    )
    point: str | None = declared(
        PointName("follower"),
        "the arm's point that touches the cam: a knife's edge, a roller's centre, a point of the face",
        default=None,
        beside="follower",
    )
    sense: str = declared(
        Choice(SENSES), "which way the arm turns as it rises: ccw or cw", default="ccw", beside="follower"
    )
    face: str = declared(Choice(FACES), "what touches the cam: knife, roller or flat", default="knife")
    roller_radius: float | None = declared(Scalar("length"), "the radius of the roller", default=None)
    law: tuple[Segment, ...] | None = declared(
        Nested(Segment), "segments of the lift over one turn of the cam", default=None
    )
    history: tuple[tuple[float, float], ...] | None = declared(
        LiftTable(),
        "a table in the file's folder: angle_deg and lift_mm (of an arm swing_deg) over one turn",
        default=None,
        name="table",
        unless="law",
    )

    # in a run with more digits π has them too, and the spline through a table
    pi: float = field(default=math.pi, compare=False, repr=False)
    spline: Any = field(default=None, compare=False, repr=False)

    @property
    def slides(self) -> bool:
        """Whether the follower is a slide."""
        return self.slider is not None

    @property
    def label(self) -> str:
        """The cam's name, as messages have it after the table."""
        return f" ({self.cam})"

    def check(self, where: str) -> None:
        if (self.slider is None) == (self.follower is None):
            raise DescriptionError(f"{where}: expected either a slider or a follower")
        if self.follower is not None and self.point is None:
            raise DescriptionError(f"{where} point: missing; expected the arm's point that touches the cam")
        if self.follower == self.cam:
            raise DescriptionError(f"{where} follower: '{self.cam}' cannot follow itself")
        if (self.law is None) == (self.history is None):
            raise DescriptionError(f"{where}: expected either a law or a table")
        if not self.base_radius > 0:
            raise DescriptionError(
                f"{where} base_radius: found {self.base_radius:g} m, expected a radius above zero"
            )
        if self.face == "roller" and self.roller_radius is None:
            raise DescriptionError(f"{where} roller_radius: missing; expected the radius of the roller")
        if self.face in ("knife", "flat") and self.roller_radius is not None:
            raise DescriptionError(f"{where} roller_radius: expected none with face = '{self.face}'")
        if self.roller_radius is not None and not self.roller_radius > 0:
            raise DescriptionError(
                f"{where} roller_radius: found {self.roller_radius:g} m, expected a radius above zero"
            )
        for i, segment in enumerate(self.law or (), 1):
            check(segment, f"{where} law {i}", None)  # type: ignore[arg-type]
        if self.law is not None:
            spans(self.law, f"{where} law")

    @property
    def roller(self) -> float:
        """The radius of the roller; 0 without one."""
        return 0.0 if self.roller_radius is None else self.roller_radius

    @property
    def prime_radius(self) -> float:
        """The base circle of the trace point, the knife's edge or the roller's centre, m."""
        return self.base_radius + self.roller

    @property
    def lowest(self) -> float:
        """The least lift of its law; laws rise or return without turning back in a segment."""
        if self.law is None:
            return min(lift for _, lift in self.history or ())
        levels: list[float] = [span.high for span in spans(self.law, "law")]
        return min(levels, key=lambda lift: float(complex(lift).real))

    @property
    def sign(self) -> float:
        """Which way the follower's coordinate goes as it rises."""
        return 1.0 if self.slides or self.sense == "ccw" else -1.0

    def lift(self, on: str) -> Lift:
        """Its lift over its angle against the body that carries it."""
        if self.law is not None:
            law = spans(self.law, "law", self.pi)
            return Lift(self.cam, on, law[0].start, 2 * self.pi, *pieces(law, self.pi))
        assert self.history is not None
        first, knots, curve = self.spline or splined(self.history)
        return Lift(self.cam, on, first, 2 * self.pi, knots, curve)


@dataclass(frozen=True, eq=False)
class CamDrive:
    """A cam in its mechanism: what carries it, where its axis is, where the follower stands at lift zero.

    Attributes
    ----------
    cam : Cam
    number : int
        Its place in the list of cams, from 0.
    on : str
        The body that carries the cam and the follower.
    pin : str
        The pin on which the cam turns on it.
    guide : int or None
        The guide of a sliding follower.
    pivot : str
        The pin of an arm on `on`; empty of a slide.
    rest : float
        The slide, or the angle of the arm against `on`, at lift zero.
    lift : Lift
    """

    cam: Cam
    number: int
    on: str
    pin: str
    guide: int | None
    pivot: str
    rest: Any
    lift: Lift

    @property
    def body(self) -> str | None:
        """The arm; None of a slide."""
        return self.cam.follower

    @property
    def label(self) -> str:
        """Its name in messages."""
        return f"cam {self.cam.cam}-{self.cam.slider or self.cam.follower}"


def drive_of(m: Any, number: int) -> CamDrive:
    """A cam of a description, in its place.

    Raises
    ------
    DescriptionError
        No body carries both the cam and its follower, or the base circle cannot be touched.
    """
    cam: Cam = m.cams[number]
    where = f"[[cams]] {number + 1} ({cam.cam})"
    bodies: Mapping[str, Mapping[str, complex]] = m.bodies
    if cam.slides:
        i = m.guide_at(cam.slider)
        guide = m.guides[i]
        if cam.face == "flat" and not guide.is_slider:
            raise DescriptionError(f"{where} face: a flat face cannot turn: expected a slider, found a slot")
        pin = _pin(bodies, cam.cam, guide.on)
        if not pin:
            raise DescriptionError(
                f"{where} cam: expected a pin of '{cam.cam}' on '{guide.on}', which carries the guide of {cam.slider}"
            )
        axis = bodies[guide.on][pin] - m.through(guide)
        rest = _sliding(cam, where, axis, guide.angle)
        low = rest - (axis * direction(guide.angle).conjugate()).real + cam.lowest
        if not low > 0:
            raise DescriptionError(
                f"{where} law: the follower would pass the cam's axis: found a lift of "
                f"{float(complex(cam.lowest).real):g} m, expected more than -{float(complex(low - cam.lowest).real):g} m"
            )
        return CamDrive(cam, number, guide.on, pin, i, "", rest, cam.lift(guide.on))
    arm = str(cam.follower)
    on = next(
        (b for b in bodies if b not in (arm, cam.cam) and _pin(bodies, cam.cam, b) and _pin(bodies, arm, b)),
        None,
    )
    if on is None:
        raise DescriptionError(
            f"{where} follower: expected a body on which both '{cam.cam}' and '{arm}' are pinned"
        )
    pin, pivot = _pin(bodies, cam.cam, on), _pin(bodies, arm, on)
    if pivot == pin:
        raise DescriptionError(
            f"{where} follower: expected a pivot of '{arm}' that is not the cam's own, {pin}"
        )
    reach = bodies[arm][str(cam.point)] - bodies[arm][pivot]
    rest = _turning(cam, where, bodies[on][pin] - bodies[on][pivot], reach)
    return CamDrive(cam, number, on, pin, None, pivot, rest, cam.lift(on))


def _pin(bodies: Mapping[str, Mapping[str, complex]], first: str, second: str) -> str:
    """The first point that two bodies share; empty where there is none."""
    return next((p for p in bodies[first] if p in bodies[second]), "")


def _sliding(cam: Cam, where: str, axis: Any, angle: Any) -> Any:
    """The slide at lift zero: √(R² − ε²) from the foot of the axis on the guide; `axis`: from `through`."""
    foot = axis * direction(angle).conjugate()
    if cam.face == "flat":
        return foot.real + cam.base_radius
    radius, offset = cam.prime_radius, foot.imag
    inside = (radius - offset) * (radius + offset)
    if not inside > 0:
        raise DescriptionError(
            f"{where} base_radius: the guide passes the cam's axis at {float(abs(complex(offset))):g} m, expected less "
            f"than the prime radius, {float(complex(radius).real):g} m"
        )
    return foot.real + root(inside)


def _turning(cam: Cam, where: str, apart: Any, reach: Any) -> Any:
    """The angle of an arm at lift zero, by the triangle of its pivot, the cam's axis and the point that touches."""
    distance, length = abs(apart), abs(reach)
    if cam.face == "flat":
        across = reach.imag - cam.sign * cam.base_radius
        inside = (distance - across) * (distance + across)
        turned: Any = (root(inside) if inside > 0 else 0.0) + 1j * across
        angle = heading(apart) - heading(turned)
    else:
        radius = cam.prime_radius
        inside = (distance + length + radius) * (distance + length - radius)
        inside = inside * ((radius + length - distance) * (radius + distance - length))
        turned = (distance * distance + length * length - radius * radius) + 1j * (
            root(inside) if inside > 0 else 0.0
        )
        angle = heading(apart) + cam.sign * heading(turned) - (heading(reach) if reach else 0.0)
    if not inside > 0:
        raise DescriptionError(
            f"{where} base_radius: the arm cannot touch the base circle: the pivot is "
            f"{float(complex(distance).real):g} m from the cam's axis"
        )
    return angle
