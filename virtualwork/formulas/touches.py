"""Where a cam and its follower touch: the normal, the pressure angle, the radius of curvature, the profile.

With y the follower's coordinate (a slide, or the angle of an arm), e = ∂T/∂y of its trace point T (the knife's edge, the
roller's centre), r = T − O from the cam's axis O, and y′ = dy/dθ of the cam's angle θ, the pitch curve goes along
y′e − i r, seen from the cam, and the contact force along the normal r + i y′e. Of the force λ that moves the follower
along y (by virtual work: what the loads do for a unit of y) it is

    F = λ (r + i y′e)/(r·e)                         knife and roller
    F = λ d                                         a flat face across a guide of direction d
    F = λ i u (1 − y′)/(c·u)                        a flat face along u of an arm, c from its pivot to the cam's axis

so that the cam feels the torque −λ y′ about its axis. The pitch curve's radius of curvature is |z′|³/(z′ × z″) (with z″ =
y″e + y′²∂e/∂y − 2i y′e − r); a flat face's profile has h + h″ over the direction of its normal, h the distance of the
face from the axis (R. L. Norton, Design of Machinery, 5th ed., §8.6, eqs. 8.31 to 8.36).
"""

from __future__ import annotations

import math

from dalembert.dataclass import dataclass
from virtualwork.describe.cams import Cam, CamDrive
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.lifts import Located, lift
from virtualwork.formulas.numbers import Kind, Number, cross, dot
from virtualwork.formulas.positions import State
from virtualwork.plan.steps import Path, Plan, Term, key_of, path_reads


@dataclass(frozen=True)
class Touching:
    """A cam and its follower as they touch, in axes of any direction.

    Attributes
    ----------
    cam : Cam
    kind : Kind
    r : complex
        The trace point from the cam's axis.
    e : complex
        How the trace point moves for a unit of the follower's coordinate.
    rates : list of float
        y′, y″.
    arm : (u, p), or None of a slide
        The direction of the arm's x-axis, and the trace point from its pivot.
    """

    cam: Cam
    kind: Kind
    r: Number
    e: Number
    rates: list[Number]
    arm: tuple[Number, Number] | None

    @property
    def flat(self) -> bool:
        """Whether a flat face touches."""
        return self.cam.face == "flat"

    def _face(self, u: Number, p: Number) -> tuple[Number, Number, Number]:
        """Of a flat face along u: c·u, c × u of the pivot to the cam's axis, and how far it is off the pivot."""
        c = p - self.r
        return dot(u, c), cross(u, c), cross(u, p)

    def unit(self) -> Number:
        """The contact force on the follower for a unit of what moves it along its coordinate."""
        if self.flat and self.arm is None:
            return self.e
        if self.flat and self.arm is not None:
            u, p = self.arm
            return 1j * u * ((1 - self.rates[0]) / self._face(u, p)[0])
        return (self.r + 1j * (self.rates[0] * self.e)) / dot(self.r, self.e)

    def place(self) -> Number:
        """A point of the line of the contact force, from the cam's axis: the trace point, or where a flat face touches."""
        if not self.flat:
            return self.r
        return self.r + self.offset() * (1j * self.e if self.arm is None else self.arm[0])

    def offset(self) -> Number:
        """How far from the trace point a flat face touches, along the face: to the left of a slide, along an arm."""
        if self.arm is None:
            return -(cross(self.e, self.r) + self.rates[0])
        u, p = self.arm
        return self._face(u, p)[0] / (1 - self.rates[0]) - dot(u, p)

    def touch(self) -> Number:
        """The point of the profile that touches, from the cam's axis."""
        if self.cam.face != "roller":
            return self.place()
        normal = self.r + 1j * (self.rates[0] * self.e)
        return self.r - normal * (self.cam.roller / abs(normal))

    def pressure_angle(self) -> Number:
        """From the way of the follower as it rises to the contact force on it, counter-clockwise, rad."""
        first = self.rates[0]
        if self.flat and self.arm is None:
            return 0.0 * first
        if self.flat and self.arm is not None:
            reach, _, off = self._face(*self.arm)
            return self.kind.angle(self.kind.join(reach / (1 - first), -off))
        along, across = dot(self.e, self.r), cross(self.e, self.r) + first * dot(self.e, self.e)
        sign = self.cam.sign
        return self.kind.angle(self.kind.join(sign * along, sign * across))

    def curvature_radius(self) -> Number:
        """The radius of curvature of the profile, m, positive where it is convex."""
        first, second = self.rates
        if self.flat and self.arm is None:
            return dot(self.e, self.r) + second
        if self.flat and self.arm is not None:
            reach, across, off = self._face(*self.arm)
            slow = 1 - first
            bent = (second * reach / slow + first * first * across) / (slow * slow)
            return self.cam.sign * (off - across + bent)
        return self.pitch_radius() - self.cam.roller

    def pitch_radius(self) -> Number:
        """The radius of curvature of the pitch curve, m, positive where it is convex; NaN where it is straight."""
        first, second = self.rates
        way = first * self.e - 1j * self.r
        bend = second * self.e - 2j * (first * self.e) - self.r
        if self.arm is not None:
            bend = bend + (first * first) * (1j * self.e)
        length, bent = abs(way), -cross(way, bend)
        return length * length * length / self.kind.select(abs(bent), bent, math.nan)


class Touch:
    """A cam and its follower in the order of solution."""

    def __init__(self, m: Description, plan: Plan, drive: CamDrive) -> None:
        self.plan, self.drive = plan, drive
        self._axis = _path(plan, drive.on, m.bodies[drive.on][drive.pin])
        if drive.guide is None:
            assert drive.body is not None
            self.body = drive.body
            self._trace = _path(plan, drive.body, m.bodies[drive.body][str(drive.cam.point)])
            self._pivot = _path(plan, drive.on, m.bodies[drive.on][drive.pivot])
        else:
            guide = m.guides[drive.guide]
            # the guided point lies on the line of the guide, whichever of the two bodies slides
            self.body = guide.link
            base, terms = plan.anchors[guide.on]
            line = (
                Term(m.through(guide), guide.on),
                Term(plan.directions[drive.guide], guide.on, drive.guide),
            )
            self._trace = self._pivot = base, (*terms, *line)

    @property
    def targets(self) -> set[str]:
        """What it depends on."""
        reads = path_reads(self._axis) | path_reads(self._trace) | path_reads(self._pivot)
        bodies = {self.drive.cam.cam, self.body, self.drive.on} - {GROUND}
        return reads | {f"angle:{body}" for body in bodies} | {self.coordinate}

    @property
    def coordinate(self) -> str:
        """The key of the follower's coordinate, `angle:BODY` or `slide:GUIDE`."""
        return key_of(self.body if self.drive.guide is None else self.drive.guide)

    def rate(self, st: State, k: int) -> Number:
        """The k-th derivative of the follower's coordinate to the cam's angle."""
        return signed_rate(self.drive, st.lifts[self.drive.lift], k)

    def axis(self, st: State) -> Number:
        """The cam's axis."""
        return st.at(self._axis)

    def at(self, st: State) -> Touching:
        """How they touch at the poses of a state, in the ground's axes."""
        trace, drive = st.at(self._trace), self.drive
        r, rates = trace - st.at(self._axis), [self.rate(st, k) for k in (1, 2)]
        if drive.guide is None:
            p = trace - st.at(self._pivot)
            return Touching(drive.cam, st.kind, r, 1j * p, rates, (st.turn[self.body], p))
        d = self.plan.directions[drive.guide]
        return Touching(
            drive.cam, st.kind, r, d if drive.on == GROUND else d * st.turn[drive.on], rates, None
        )


class Touches:
    """The cams of a mechanism, by what they turn with and what they touch."""

    def __init__(self, m: Description, plan: Plan) -> None:
        self.every = [Touch(m, plan, drive) for drive in m.cam_drives]

    def turned_by(self, key: str) -> list[tuple[Touch, float]]:
        """The cams whose angle grows, or falls (−1), with the angle of a body, `angle:BODY`."""
        return [
            (touch, sign)
            for touch in self.every
            for body, sign in ((touch.drive.cam.cam, 1.0), (touch.drive.on, -1.0))
            if key == f"angle:{body}"
        ]

    def on(self, body: str) -> list[tuple[Touch, float]]:
        """The cams that touch a body, and the sign of the contact force on it."""
        return [
            (touch, sign)
            for touch in self.every
            for touched, sign in ((touch.body, 1.0), (touch.drive.cam.cam, -1.0))
            if touched == body
        ]


def signed_rate(drive: CamDrive, at: Located, k: int) -> Number:
    """The k-th derivative of a follower's coordinate to the angle of its cam; the coordinate from rest for k = 0."""
    value = lift(at, k)
    return value if drive.cam.sign == 1 else -value


def carried(m: Description, drive: CamDrive, kind: Kind, at: Located) -> Touching:
    """How a cam and its follower touch, in the axes of the body that carries both, where the cam's law is at a place."""
    bodies = m.bodies
    axis = bodies[drive.on][drive.pin]
    y = drive.rest + signed_rate(drive, at, 0)
    rates = [signed_rate(drive, at, k) for k in (1, 2)]
    if drive.guide is not None:
        guide = m.guides[drive.guide]
        d = kind.exp(guide.angle)
        return Touching(drive.cam, kind, m.through(guide) + y * d - axis, d, rates, None)
    arm, u = bodies[str(drive.body)], kind.exp(y)
    p = (arm[str(drive.cam.point)] - arm[drive.pivot]) * u
    return Touching(drive.cam, kind, bodies[drive.on][drive.pivot] + p - axis, 1j * p, rates, (u, p))


def _path(plan: Plan, body: str, z: complex) -> Path:
    """Where a point of a body lies."""
    base, terms = plan.anchors[body]
    return base, (*terms, Term(z, body))
