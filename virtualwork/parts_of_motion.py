"""Points, links and slides of a motion: each quantity is computed by the whole motion on the first request."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from dalembert.hints import choices
from virtualwork.describe import DescriptionError
from virtualwork.describe.description import Description
from virtualwork.describe.parts import Point as Place
from virtualwork.describe.parts import as_point
from virtualwork.formulas.kinematics import Angle, AnglePartial, Point, PointPartial, Slide
from virtualwork.formulas.numbers import Complexes, Reals, xy
from virtualwork.formulas.quantity import Quantity

if TYPE_CHECKING:
    from virtualwork.digits.estimates import Estimates


ORDERS = range(4)
"""Of derivatives in time: position, velocity, acceleration, jerk."""


def _checked(order: int) -> int:
    if order not in ORDERS:
        raise ValueError(f"order: found {order!r}, expected 0 (position or angle), 1, 2 or 3 (jerk)")
    return order


# what a loop asks of each pose is made once
@lru_cache(maxsize=1024)
def _point(body: str, place: complex, node: str | None, order: int) -> Point:
    return Point(body, place, node, _checked(order))


@lru_cache(maxsize=1024)
def _angle(body: str, order: int) -> Angle:
    return Angle(body, _checked(order))


@lru_cache(maxsize=1024)
def _slide(guide: int, order: int) -> Slide:
    return Slide(guide, _checked(order))


def number_of_input(m: Description, j: int) -> int:
    """The number of an input, from 0.

    Raises
    ------
    ValueError
        There is no such input.
    """
    if j not in range(len(m.inputs)):
        names = ", ".join(f"{i} ({entry.name})" for i, entry in enumerate(m.inputs))
        raise ValueError(f"input: found {j!r}, expected the number of an input: {names}")
    return j


class AnyMotion(Protocol):
    """A motion with quantities: of one mechanism, (n,) each, or of variants, (v, n) each."""

    def value(self, key: Quantity) -> Any:
        """Return a quantity."""

    def vector(self, key: Quantity) -> Reals:
        """Return a vector, its parts along the last axis."""


class OneMotion(AnyMotion, Protocol):
    """A motion of a mechanism."""

    @property
    def mechanism(self) -> Description:
        """The mechanism that moves."""

    @property
    def n(self) -> int:
        """The number of poses."""

    @property
    def rounding(self) -> Estimates:
        """Estimates of its rounding errors."""

    def derivative(self, key: Quantity, path: str) -> Any:
        """Return the derivative of a quantity with respect to a number of the description."""


class PartOfMotion:
    """A moving point, link or slide; `order` 0 is its position or angle, 1 to 3 are its rates in time.

    Of one mechanism; of variants every array has a leading axis of them.
    """

    def __init__(self, motion: AnyMotion) -> None:
        self.motion = motion

    def key(self, order: int = 0) -> Quantity:
        """The position or the angle, or a rate of it, as `Motion.value` takes it."""
        raise NotImplementedError

    def value(self, order: int) -> Reals:
        """The position, the angle or a rate, (n,)."""
        return self.motion.value(self.key(order))  # type: ignore[no-any-return]


class PointRates(PartOfMotion):
    """A point of a link, and its rates."""

    def __init__(self, motion: AnyMotion, body: str, place: complex, node: str | None = None) -> None:
        self.motion, self.body, self.place, self.node = motion, body, place, node
        # a named point stands wherever the description, or a variant, has it
        self._where = 0j if node is not None else place

    @property
    def position(self) -> Reals:
        """The position, (n, 2), m; NaN if the pose cannot be assembled."""
        return self.motion.vector(self.key(0))

    @property
    def velocity(self) -> Reals:
        """The velocity, (n, 2), m/s (Ibrahim eq. 1.4.1)."""
        return self.motion.vector(self.key(1))

    @property
    def acceleration(self) -> Reals:
        """The acceleration, (n, 2), m/s² (Ibrahim eq. 1.5.1)."""
        return self.motion.vector(self.key(2))

    @property
    def jerk(self) -> Reals:
        """The jerk, (n, 2), m/s³ (Ibrahim eq. 1.5.3)."""
        return self.motion.vector(self.key(3))

    def complex(self, order: int) -> Complexes:
        """The order-th time derivative as x + iy, (n,)."""
        return self.motion.value(self.key(order))  # type: ignore[no-any-return]

    def key(self, order: int = 0) -> Quantity:
        return _point(self.body, self._where, self.node, order)


class LinkRates(PartOfMotion):
    """A link's angle, and its rates."""

    def __init__(self, motion: AnyMotion, body: str) -> None:
        super().__init__(motion)
        self.body = body

    @property
    def angle(self) -> Reals:
        """The angle of the link's x-axis, (n,), rad, in (−π, π]."""
        return self.value(0)

    @property
    def omega(self) -> Reals:
        """The angular velocity, (n,), rad/s (Ibrahim eq. 1.4.2)."""
        return self.value(1)

    @property
    def alpha(self) -> Reals:
        """The angular acceleration, (n,), rad/s² (Ibrahim eq. 1.5.2)."""
        return self.value(2)

    @property
    def jerk(self) -> Reals:
        """The angular jerk, (n,), rad/s³ (Ibrahim eq. 1.5.3)."""
        return self.value(3)

    def key(self, order: int = 0) -> Quantity:
        return _angle(self.body, order)


class SlideRates(PartOfMotion):
    """A slide along its guide, from the guide's `through`, and its rates."""

    def __init__(self, motion: AnyMotion, guide: int) -> None:
        super().__init__(motion)
        self.guide = guide

    @property
    def position(self) -> Reals:
        """The position along the guide, (n,), m."""
        return self.value(0)

    @property
    def speed(self) -> Reals:
        """The speed along the guide, (n,), m/s."""
        return self.value(1)

    @property
    def acceleration(self) -> Reals:
        """The acceleration along the guide, (n,), m/s²."""
        return self.value(2)

    @property
    def jerk(self) -> Reals:
        """The jerk along the guide, (n,), m/s³."""
        return self.value(3)

    def key(self, order: int = 0) -> Quantity:
        return _slide(self.guide, order)


class OfOneMechanism(PartOfMotion):
    """Estimates of rounding errors, and derivatives to the numbers of the description."""

    motion: OneMotion

    def error_estimate(self, order: int = 0) -> Reals:
        """Return the rounding error (n,) of the position or angle (order 0), or of its rate of that order.

        It is the difference to a second run in 32 digits, in the unit of the quantity, the length of a point's error. The
        decimals of a file are exact in it, and floats are exactly these. Infinite if no digit holds, within
        rounding of a limit of the input. See `virtualwork.digits.estimates`.

        Examples
        --------
        A crank of length 1 at 60°:

        >>> import math
        >>> from virtualwork import Input, Link, Mechanism
        >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 1})}, inputs=Input(link="crank"))
        >>> point = crank.motion(math.pi / 3).point("P")
        >>> bool(0 < point.error_estimate()[0] < 1e-15)
        True
        """
        return self.motion.rounding.of(self.key(order))

    def sensitivity(self, path: str, order: int = 0) -> Reals:
        """Return the derivative of position or angle (order 0), or of a rate, with respect to a number of the description.

        Parameters
        ----------
        path : str
            Of the number, such as "links.crank.B.x"; angles count in radians.
        order : int

        Returns
        -------
        array (n,); (n, 2) of a point

        Raises
        ------
        DescriptionError
            Where the path names no number.

        Examples
        --------
        A crank's end moves along with its length:

        >>> import math
        >>> from virtualwork import Input, Link, Mechanism
        >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 1})}, inputs=Input(link="crank"))
        >>> crank.motion(math.pi / 2).point("P").sensitivity("links.crank.P.x").round(15)
        array([[0., 1.]])
        """
        return self.motion.derivative(self.key(order), path)  # type: ignore[no-any-return]


class PointMotion(OfOneMechanism, PointRates):
    """Motion of one point of a link.

    Attributes
    ----------
    position, velocity, acceleration, jerk : array (n, 2)
        m, m/s, m/s², m/s³, in ground axes; NaN where the pose cannot be assembled.
    """

    def __repr__(self) -> str:
        return f"PointMotion({self.node or self.place!r} of {self.body}, {self.motion.n} poses)"

    def sensitivity(self, path: str, order: int = 0) -> Reals:
        return xy(self.motion.derivative(self.key(order), path))

    def coefficient(self, j: int = 0) -> Complexes:
        """The velocity coefficient dP/dq_j as x + iy, (n,): the point's virtual displacement for a unit of input j."""
        number_of_input(self.motion.mechanism, j)
        return self.motion.value(PointPartial(self.body, self._where, self.node, j, 1))  # type: ignore[no-any-return]


class LinkMotion(OfOneMechanism, LinkRates):
    """Motion of one link.

    Attributes
    ----------
    angle : array (n,)
        rad, of the link's own x-axis, in (−π, π].
    omega, alpha, jerk : array (n,)
        rad/s, rad/s², rad/s³.
    """

    def __repr__(self) -> str:
        return f"LinkMotion({self.body}, {self.motion.n} poses)"

    def coefficient(self, j: int = 0) -> Reals:
        """The velocity coefficient dθ/dq_j, (n,): the link's virtual rotation for a unit of input j."""
        number_of_input(self.motion.mechanism, j)
        return self.motion.value(AnglePartial(self.body, j, 1))  # type: ignore[no-any-return]


class SlideMotion(OfOneMechanism, SlideRates):
    """Motion along one guide: `position`, `speed`, `acceleration`, `jerk`, each (n,), m from the guide's `through`."""

    def __repr__(self) -> str:
        return f"SlideMotion({self.motion.mechanism.guides[self.guide].point}, {self.motion.n} poses)"


P = TypeVar("P", bound=PointRates)
L = TypeVar("L", bound=LinkRates)
S = TypeVar("S", bound=SlideRates)


class NamedParts(Generic[P, L, S]):
    """A motion whose points, links and slides have names; `kinds` are what the motion of each of these is."""

    kinds: tuple[type[P], type[L], type[S]]

    @property
    def mechanism(self) -> Description:
        """What moves."""
        raise NotImplementedError

    def value(self, key: Quantity) -> Any:
        """Return a quantity."""
        raise NotImplementedError

    def vector(self, key: Quantity) -> Reals:
        """Return a vector, its parts along the last axis."""
        raise NotImplementedError

    def point(self, name: str) -> P:
        """Return the motion of a named point.

        Raises
        ------
        DescriptionError
            Where no body has a point of that name.
        """
        points = self.mechanism.points
        place = points.get(name)
        if place is None:
            raise DescriptionError(f"no point is named '{name}'{choices(str(name), points)}")
        return self.kinds[0](self, *place, name)

    def at(self, link: str, point: Place | str) -> P:
        """Return the motion of any point of a link: a name, or coordinates in the link's own axes.

        Raises
        ------
        DescriptionError
            Where there is no link of that name, or it has no point of that name.
        """
        places = self.mechanism.bodies.get(link)
        if places is None:
            raise self._no_link(link)
        if not isinstance(point, str):
            return self.kinds[0](self, link, point if isinstance(point, complex) else as_point(point))
        if point not in places:
            raise DescriptionError(f"link '{link}' has no point named '{point}'{choices(point, places)}")
        return self.kinds[0](self, link, places[point], point)

    def link(self, name: str) -> L:
        """Return the motion of a link.

        Raises
        ------
        DescriptionError
            Where there is no link of that name.
        """
        if name not in self.mechanism.links:
            raise self._no_link(name)
        return self.kinds[1](self, name)

    def _no_link(self, name: str) -> DescriptionError:
        return DescriptionError(f"no link is named '{name}'{choices(str(name), self.mechanism.links)}")

    def slide(self, name: str) -> S:
        """Return the motion along the guide in which the named point runs."""
        guided = self.mechanism.guided
        if name not in guided:
            raise DescriptionError(
                f"no slot or slider runs at a point named '{name}'{choices(str(name), guided)}"
            )
        return self.kinds[2](self, guided[name])
