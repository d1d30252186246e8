"""The quantities of positions and of their rates: the same formulas of a recorded pose and of one on floats."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.numbers import PARTS, Number, minus, times
from virtualwork.formulas.positions import State
from virtualwork.formulas.quantity import Planned, Quantity, Recording
from virtualwork.formulas.rates import Rates
from virtualwork.formulas.touches import Touch
from virtualwork.plan.steps import Path, Term, path_reads


class Kinematic(Quantity):
    """A quantity that the positions of a state and their derivatives give."""

    def place(self, of: Planned, st: State) -> Number:
        """Its value at the positions of a state."""
        raise NotImplementedError

    def rate(self, of: Planned, rates: Rates, k: int) -> Number:
        """Its k-th derivative along the rates; None where it is zero."""
        raise NotImplementedError

    def write(self, recording: Recording) -> Number:
        recording.solve(self.targets(recording), self.order)
        if not self.order:
            return self.place(recording, recording.st)
        return recording.in_time(self.order, lambda k: self.rate(recording, recording.along, k))


class Partial(Kinematic):
    """The derivative of a place to one input; with one input the second one too."""

    @property
    def input(self) -> int:
        """The number of that input."""
        raise NotImplementedError

    def write(self, recording: Recording) -> Number:
        recording.solve(self.targets(recording), self.order)
        return self.rate(recording, recording.by[self.input], self.order)


class OfPoint(Kinematic):
    """Of the point z of a body; where the point has a name, `node`, the name says where."""

    is_vector = True
    body: str
    z: complex
    node: str | None

    def _path(self, of: Planned) -> Path:
        if self.node is not None:
            return self.node, ()
        base, terms = of.plan.anchors[self.body]
        return base, (*terms, Term(self.z, self.body))

    def targets(self, of: Planned) -> Iterable[str]:
        return sorted(path_reads(self._path(of)))

    def place(self, of: Planned, st: State) -> Number:
        return st.at(self._path(of))

    def rate(self, of: Planned, rates: Rates, k: int) -> Number:
        return rates.vector(self._path(of), k)


class Point(OfPoint, kind="point"):
    """The position of a point, m, or a derivative in time."""

    dimension = "length"
    order: int

    @classmethod
    def every(cls, m: Description, order: int) -> Iterator[Quantity]:
        moving = ((body, name) for name, (body, _) in m.points.items() if body != GROUND)
        return (cls(body, 0j, name, order) for body, name in moving)


class Coordinate(OfPoint, kind="coordinate"):
    """x (0) or y (1) of a point, m."""

    is_vector = False
    dimension = "length"
    axis: int

    def place(self, of: Planned, st: State) -> Number:
        return PARTS[self.axis](super().place(of, st))


class PointPartial(OfPoint, Partial, kind="dpoint"):
    """∂P/∂q_j, or ∂²P/∂q² with one input."""

    input: int
    order: int


class OfBody(Kinematic):
    """Of the direction of a body; that of the ground is zero."""

    body: str

    def targets(self, of: Planned) -> Iterable[str]:
        return () if self.body == GROUND else (f"angle:{self.body}",)

    def place(self, of: Planned, st: State) -> Number:
        return 0.0 if self.body == GROUND else st.kind.angle(st.turn[self.body])

    def rate(self, of: Planned, rates: Rates, k: int) -> Number:
        return None if self.body == GROUND else rates.angle[self.body][k - 1]


class Angle(OfBody, kind="angle"):
    """θ in (−π, π], rad, or ω, α, the angular jerk."""

    dimension = "angle"
    order: int

    @classmethod
    def every(cls, m: Description, order: int) -> Iterator[Quantity]:
        driven = {entry.link for entry in m.inputs}
        return (cls(link, order) for link in m.links if link not in driven)


class AnglePartial(OfBody, Partial, kind="dangle"):
    """∂θ/∂q_j, or ∂²θ/∂q² with one input."""

    input: int
    order: int


class Turn(OfBody, kind="turn"):
    """e^{iθ}."""

    is_vector = True

    def place(self, of: Planned, st: State) -> Number:
        return st.turn[self.body]


class Slide(Kinematic, kind="slide"):
    """The travel along a guide, m, or a derivative in time."""

    dimension = "length"
    guide: int
    order: int

    def targets(self, of: Planned) -> Iterable[str]:
        return (f"slide:{self.guide}",)

    def place(self, of: Planned, st: State) -> Number:
        return st.slide[self.guide]

    def rate(self, of: Planned, rates: Rates, k: int) -> Number:
        return rates.slide[self.guide][k - 1]

    @classmethod
    def every(cls, m: Description, order: int) -> Iterator[Quantity]:
        return (cls(guide, order) for guide in range(len(m.guides)))


class Carried(Kinematic, kind="carried"):
    """The velocity of the point of a guide's body at which its slide stands, m/s: without that along the guide."""

    is_vector = True
    guide: int
    order: int

    def _slid(self, of: Planned) -> Term:
        return Term(of.plan.directions[self.guide], of.mechanism.guides[self.guide].on, self.guide)

    def _path(self, of: Planned) -> Path:
        g = of.mechanism.guides[self.guide]
        base, terms = of.plan.anchors[g.on]
        return base, (*terms, Term(of.mechanism.through(g), g.on), self._slid(of))

    def targets(self, of: Planned) -> Iterable[str]:
        return sorted(path_reads(self._path(of)))

    def rate(self, of: Planned, rates: Rates, k: int) -> Number:
        slid = self._slid(of)
        along = times(rates.slide[self.guide][k - 1], slid.z * rates.st.turn[slid.body])
        return minus(rates.vector(self._path(of), k), along)


class OfCam(Kinematic):
    """Of a cam, from 0, where it touches its follower."""

    cam: int

    def _touch(self, of: Planned) -> Touch:
        return Touch(of.mechanism, of.plan, of.mechanism.cam_drives[self.cam])

    def targets(self, of: Planned) -> Iterable[str]:
        return sorted(self._touch(of).targets)


class PressureAngle(OfCam, kind="pressure angle"):
    """The angle from the way of the follower to the contact force on it, rad."""

    dimension = "angle"

    def place(self, of: Planned, st: State) -> Number:
        return self._touch(of).at(st).pressure_angle()


class CurvatureRadius(OfCam, kind="curvature radius"):
    """The radius of curvature of the profile, m, positive where it is convex."""

    dimension = "length"

    def place(self, of: Planned, st: State) -> Number:
        return self._touch(of).at(st).curvature_radius()


class ContactWay(OfCam, kind="contact way"):
    """The direction in which a cam presses on its follower, a unit vector."""

    is_vector = True

    def place(self, of: Planned, st: State) -> Number:
        touch = self._touch(of)
        unit = touch.at(st).unit()
        return touch.drive.cam.sign * unit / abs(unit)


class ContactPlace(OfCam, kind="contact at"):
    """Where a cam and its follower touch, m."""

    is_vector = True

    def place(self, of: Planned, st: State) -> Number:
        touch = self._touch(of)
        return touch.axis(st) + touch.at(st).touch()
