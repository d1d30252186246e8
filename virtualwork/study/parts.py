"""The parts of motion of every point on a turning link and of every slide: base, tangential, normal, relative, Coriolis.

Ibrahim §1.7 to §1.10, by the functions of `virtualwork.textbook.combinations`, over all poses of a motion.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.kinematics import Slide, Turn
from virtualwork.textbook.combinations import block_on_bar, second_point

if TYPE_CHECKING:
    from virtualwork.describe.description import Description
    from virtualwork.formulas.numbers import Complexes, Reals
    from virtualwork.formulas.poses import Poses


class Parts(NamedTuple):
    """The parts of the motion of a point, each (n,) complex: the five of its acceleration add up to it."""

    point: str
    on: str
    base: str
    """The point that tangential and normal are about."""
    base_velocity: Complexes
    turning_velocity: Complexes
    relative_velocity: Complexes
    base_acceleration: Complexes
    tangential: Complexes
    normal: Complexes
    relative: Complexes
    coriolis: Complexes

    @property
    def carried_velocity(self) -> Complexes:
        """The velocity of the body's own point there."""
        return np.asarray(self.base_velocity + self.turning_velocity)

    @property
    def velocity(self) -> Complexes:
        """The point's velocity."""
        return np.asarray(self.carried_velocity + self.relative_velocity)

    @property
    def acceleration(self) -> Complexes:
        """The point's acceleration (Ibrahim eq. 1.10.7)."""
        return np.asarray(
            self.base_acceleration + self.tangential + self.normal + self.relative + self.coriolis
        )


def parts(poses: Poses) -> list[Parts]:
    """Return the parts of every point on a link that turns, about its fixed or else its first point, and of every slide.

    Examples
    --------
    A crank of 2 m that turns with 3 rad/s and 5 rad/s²: its end has Aᵗ = 10 and Aⁿ = 18 m/s².

    >>> from virtualwork import Input, Link, Mechanism
    >>> crank = Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 2})}, inputs=Input(link="crank"))
    >>> end, = parts(crank.motion(0.0, speed=3.0, acceleration=5.0).poses)
    >>> end.point, end.base, complex(end.tangential[0]), complex(end.normal[0])
    ('P', 'O', 10j, (-18+0j))
    """
    m = poses.mechanism
    result = []
    for body, link in m.links.items():
        omega, alpha = _turning(poses, body, 1), _turning(poses, body, 2)
        if not (np.any(np.nan_to_num(omega)) or np.any(np.nan_to_num(alpha))) or not link.points:
            continue
        base = pivot(m, body)
        at, v, a = (_point(poses, body, base, k) for k in range(3))
        for point in link.points:
            if point != base:
                arm = _point(poses, body, point, 0) - at
                two = second_point(arm, omega, alpha, v, a)
                none = np.zeros(poses.n, complex)
                result.append(
                    Parts(
                        point, body, base, v, two.velocity_difference, none, a, two.tangential, two.normal, none, none
                    )
                )  # fmt: skip
    return [*result, *(_slide(poses, i) for i in range(len(m.guides)))]


def pivot(m: Description, body: str) -> str:
    """Return the point of a link that its others turn about: one that stands on the ground, else its first."""
    points = m.links[body].points
    return next((point for point in points if point in m.ground), next(iter(points)))


def _slide(poses: Poses, i: int) -> Parts:
    """A block on a bar that turns and moves (Ibrahim §1.10); on the ground nothing carries it (§1.6)."""
    m = poses.mechanism
    g = m.guides[i]
    through = m.through(g)
    omega, alpha = _turning(poses, g.on, 1), _turning(poses, g.on, 2)
    s, speed, rate = (poses.values((Slide(i, k),))[0] for k in range(3))
    rail = poses.plan.directions[i]
    along = rail if g.on == GROUND else rail * poses.values((Turn(g.on),))[0]
    v, a = (_place(poses, g.on, through, k) for k in (1, 2))
    its = block_on_bar(s * along, omega, alpha, speed, rate, v, a, along)
    base = g.through if isinstance(g.through, str) else f"({through.real:g}, {through.imag:g})"
    every: list[Any] = [
        its.carrier_velocity, its.turning_velocity, its.relative_velocity, its.carrier_acceleration, its.tangential,
        its.normal, its.relative_acceleration, its.coriolis,
    ]  # fmt: skip
    return Parts(
        g.point, g.on, base, *(np.broadcast_to(np.asarray(part, complex), poses.n) for part in every)
    )


def _turning(poses: Poses, body: str, order: int) -> Reals:
    return np.zeros(poses.n) if body == GROUND else poses.angle(body, order)


def _point(poses: Poses, body: str, point: str, order: int) -> Complexes:
    return poses.point(body, 0j, order, point)


def _place(poses: Poses, body: str, z: complex, order: int) -> Complexes:
    return np.zeros(poses.n, complex) if body == GROUND else poses.point(body, z, order)
