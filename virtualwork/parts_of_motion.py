"""Points, links and slides of a motion: each quantity is asked of the whole when it is first asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from virtualwork.describe.description import Description
from virtualwork.formulas.asked import Key
from virtualwork.formulas.numbers import Complexes, Reals, xy

if TYPE_CHECKING:
    from virtualwork.bounds.quantities import Bounds


class Asked(Protocol):
    """What has quantities: the motion of one mechanism, (n,) each, or of variants, (v, n) each."""

    def value(self, key: Key) -> Any:
        """A quantity by its key (`Recording.value`)."""


class Whole(Asked, Protocol):
    """A motion of a mechanism."""

    @property
    def mechanism(self) -> Description:
        """What moves."""

    @property
    def n(self) -> int:
        """How many poses."""

    @property
    def rounding(self) -> Bounds:
        """Bounds of its rounding errors."""

    def derivative(self, key: Key, path: str) -> Any:
        """The derivative of a quantity to a number of the description."""


class PointRates:
    """A point of a link: its position and derivatives in time, of one mechanism or (v, ...) of variants."""

    def __init__(self, motion: Asked, body: str, place: complex, node: str | None = None) -> None:
        self.motion, self.body, self.place, self.node = motion, body, place, node
        # a named point stands wherever the description, or a variant, has it
        self._where = 0j if node is not None else place

    @property
    def position(self) -> Reals:
        """(n, 2) m; NaN where the pose cannot be assembled."""
        return xy(self.complex(0))

    @property
    def velocity(self) -> Reals:
        """(n, 2) m/s (Ibrahim eq. 1.4.1)."""
        return xy(self.complex(1))

    @property
    def acceleration(self) -> Reals:
        """(n, 2) m/s² (Ibrahim eq. 1.5.1)."""
        return xy(self.complex(2))

    @property
    def jerk(self) -> Reals:
        """(n, 2) m/s³ (Ibrahim eq. 1.5.3)."""
        return xy(self.complex(3))

    def complex(self, order: int) -> Complexes:
        """The order-th time derivative as x + iy, (n,)."""
        return self.motion.value(self.key(order))  # type: ignore[no-any-return]

    def key(self, order: int = 0) -> Key:
        """What the position or a time derivative is asked for by (`Recording.value`)."""
        return "point", self.body, self._where, self.node, order


class PointMotion(PointRates):
    """Motion of one point of a link.

    Attributes
    ----------
    position, velocity, acceleration, jerk : array (n, 2)
        m, m/s, m/s², m/s³, in ground axes; NaN where the pose cannot be assembled.
    """

    motion: Whole

    def __repr__(self) -> str:
        return f"PointMotion({self.node or self.place!r} of {self.body}, {self.motion.n} poses)"

    def error_estimate(self, order: int = 0) -> Reals:
        """Return a bound (n,) of the rounding error of the position (order 0), velocity (1), acceleration (2) or jerk.

        It is the length of the error, in the unit of the quantity; the dimensions and the input are taken as exact.
        Infinite where no digit is known, within rounding of a limit of the input. See `virtualwork.bounds`.

        Examples
        --------
        A crank of length 1 at 60°: y = √3/2.

        >>> import math
        >>> from virtualwork import Input, Link, Mechanism
        >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 1})}, inputs=Input(link="crank"))
        >>> point = crank.motion(math.pi / 3).point("P")
        >>> bool(abs(point.position[0, 1] - math.sqrt(0.75)) <= point.error_estimate()[0] < 1e-15)
        True
        """
        return self.motion.rounding.of(self.key(order))

    def sensitivity(self, path: str, order: int = 0) -> Reals:
        """Return the derivative (n, 2) of the position (order 0), velocity (1), ... to a number of the description.

        Parameters
        ----------
        path : str
            Of the number, such as "links.crank.B.x"; angles count in radians.
        order : int

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
        return xy(self.motion.derivative(self.key(order), path))

    def coefficient(self, j: int = 0) -> Complexes:
        """The velocity coefficient dP/dq_j as x + iy, (n,): the point's virtual displacement for a unit of input j."""
        return self.motion.value(("dpoint", self.body, self._where, self.node, j, 1))  # type: ignore[no-any-return]


class LinkRates:
    """A link: its angle and derivatives in time, of one mechanism or (v, ...) of variants."""

    def __init__(self, motion: Asked, body: str) -> None:
        self.motion, self.body = motion, body

    @property
    def angle(self) -> Reals:
        """(n,) rad, of the link's own x-axis, in (−π, π]."""
        return self._rate(0)

    @property
    def omega(self) -> Reals:
        """(n,) rad/s (Ibrahim eq. 1.4.2)."""
        return self._rate(1)

    @property
    def alpha(self) -> Reals:
        """(n,) rad/s² (Ibrahim eq. 1.5.2)."""
        return self._rate(2)

    @property
    def jerk(self) -> Reals:
        """(n,) rad/s³ (Ibrahim eq. 1.5.3)."""
        return self._rate(3)

    def _rate(self, order: int) -> Reals:
        return self.motion.value(self.key(order))  # type: ignore[no-any-return]

    def key(self, order: int = 0) -> Key:
        """What the angle or a time derivative is asked for by (`Recording.value`)."""
        return "angle", self.body, order


class LinkMotion(LinkRates):
    """Motion of one link.

    Attributes
    ----------
    angle : array (n,)
        rad, of the link's own x-axis, in (−π, π].
    omega, alpha, jerk : array (n,)
        rad/s, rad/s², rad/s³.
    """

    motion: Whole

    def __repr__(self) -> str:
        return f"LinkMotion({self.body}, {self.motion.n} poses)"

    def error_estimate(self, order: int = 0) -> Reals:
        """Return a bound (n,) of the rounding error of the angle (order 0, rad), ω (1), α (2) or the angular jerk (3).

        The dimensions and the input are taken as exact. See `virtualwork.bounds`.
        """
        return self.motion.rounding.of(self.key(order))

    def sensitivity(self, path: str, order: int = 0) -> Reals:
        """Return the derivative (n,) of the angle (order 0, rad), ω (1), α (2) to a number of the description.

        `path` names the number, such as "links.crank.B.x".
        """
        return self.motion.derivative(self.key(order), path)  # type: ignore[no-any-return]

    def coefficient(self, j: int = 0) -> Reals:
        """The velocity coefficient dθ/dq_j, (n,): the link's virtual rotation for a unit of input j."""
        return self.motion.value(("dangle", self.body, j, 1))  # type: ignore[no-any-return]


class SlideRates:
    """A slide: its position along the guide and derivatives in time, of one mechanism or (v, ...) of variants."""

    def __init__(self, motion: Asked, guide: int) -> None:
        self.motion, self.guide = motion, guide

    @property
    def position(self) -> Reals:
        """(n,) m."""
        return self._rate(0)

    @property
    def speed(self) -> Reals:
        """(n,) m/s."""
        return self._rate(1)

    @property
    def acceleration(self) -> Reals:
        """(n,) m/s²."""
        return self._rate(2)

    @property
    def jerk(self) -> Reals:
        """(n,) m/s³."""
        return self._rate(3)

    def _rate(self, order: int) -> Reals:
        return self.motion.value(self.key(order))  # type: ignore[no-any-return]

    def key(self, order: int = 0) -> Key:
        """What the slide or a time derivative is asked for by (`Recording.value`)."""
        return "slide", self.guide, order


class SlideMotion(SlideRates):
    """Motion along one guide: `position`, `speed`, `acceleration`, `jerk`, each (n,), m from the guide's `through`."""

    motion: Whole

    def __repr__(self) -> str:
        return f"SlideMotion({self.motion.mechanism.guides[self.guide].point}, {self.motion.n} poses)"

    def error_estimate(self, order: int = 0) -> Reals:
        """Return a bound (n,) of the rounding error of the slide (order 0, m), its speed (1), acceleration (2) or jerk (3).

        The dimensions and the input are taken as exact. See `virtualwork.bounds`.
        """
        return self.motion.rounding.of(self.key(order))

    def sensitivity(self, path: str, order: int = 0) -> Reals:
        """Return the derivative (n,) of the slide (order 0, m), its speed (1), ... to a number of the description."""
        return self.motion.derivative(self.key(order), path)  # type: ignore[no-any-return]
