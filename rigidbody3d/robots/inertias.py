"""The inertias of a robot file: whether a body can have them, the nearest that it can have, the likely mistake."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.documents.robots import ROWS, Inertial, Robot, RobotLink
from rigidbody3d import inertia
from rigidbody3d.robots.elements import DIAGONAL_FIRST, PLACES, symmetric

if TYPE_CHECKING:
    from rigidbody3d.body import Body

Array = NDArray[np.float64]

SLIPS = {1: "a slipped decimal", 2: "a slipped decimal", 3: "g for kg", 6: "mm for m"}
ROUNDING = 1e-12
# of a whole tensor, either way
UNITS = {1e3: "g for kg, or a slipped decimal point, in all entries", 1e6: "mm for m", 1e9: "g mm² for kg m²"}
# moments of what reaches so far lie between this share of m·r² and all of it: less is a point beside its joints
LIGHT = 1e-3
# without shapes a link is taken to reach no farther than this many times its joints
ROOM = 3.0


class Guess(NamedTuple):
    """A likely mistake, and the ratio of the moments once it is corrected."""

    what: str
    entry: str
    spread: float


@dataclass(frozen=True)
class InertiaCheck:
    """The check of a link's inertia: whether some body can have it, the nearest that one can have, the likely mistake."""

    link: RobotLink
    held: Inertial
    reach: float | None
    """How far from its centre of mass the link reaches at most, m, by its shapes, its joints or the whole robot."""
    spans: float = 0.0
    """How far from it the link has shapes or joints for certain, m."""

    @cached_property
    def moments(self) -> Array:
        """The principal moments, ascending, kg·m²."""
        return inertia.principal(self.held.tensor).moments

    @cached_property
    def missing(self) -> float:
        """By how much no body has the tensor, whatever its digits behind the last printed one are, kg·m²; 0 if one has.

        The least eigenvalue of the second moments, raised as far as half units of the last digits can: vᵀ(δS)v for its
        own vector v is the most that it can gain (Rayleigh).
        """
        S = inertia.second_moments(self.held.tensor)
        values, vectors = np.linalg.eigh(S)
        v = vectors[:, 0]
        gain = np.abs(np.eye(3) / 2 - np.outer(v, v))
        room = float((self.held.half * gain).sum()) + ROUNDING * float(np.abs(self.held.tensor).max())
        return max(0.0, -float(values[0]) - room)

    @property
    def valid(self) -> bool:
        """Whether some body has this mass and tensor, to the digits that are printed."""
        return self.missing == 0 and self.held.mass >= 0

    @cached_property
    def nearest(self) -> Array:
        """The nearest tensor that a body can have."""
        return inertia.nearest(self.held.tensor)

    @cached_property
    def likely(self) -> str | None:
        """The likely mistake; None where none is seen."""
        if self.held.mass < 0:
            return "a stray minus sign in the mass"
        if self.missing == 0:
            return self._whole()
        guesses = self._signs() or self._decimals()
        if guesses:
            least = min(g.spread for g in guesses)
            best = [g for g in guesses if g.spread <= least * 1.0001]
            return f"{best[0].what} in {' or '.join(g.entry for g in best)}"
        if _can_be(self._reordered()):
            return "entries in another order"
        if _can_be(self.held.tensor + self._carried()):
            return "the term m·d² of the parallel axis taken off once too often: about the origin instead of the centre"
        return self._whole()

    def _carried(self) -> Array:
        """Return what the parallel axis theorem adds at the link's origin, in the tensor's axes."""
        inside = self.held.pose[:3, :3].T @ self.held.pose[:3, 3]
        return inertia.shift(self.held.mass, inside)

    def _with(self, entry: str, value: float) -> Array:
        made = self.held.tensor.copy()
        i, j = PLACES[entry]
        made[i, j] = made[j, i] = value
        return made

    def _signs(self) -> list[Guess]:
        signs = []
        for entry in ("ixx", "iyy", "izz"):
            value = self.held.tensor[PLACES[entry]]
            changed = self._with(entry, -value)
            if value < 0 and _can_be(changed):
                signs.append(Guess("a stray minus sign", entry, _spread(changed)))
        return signs

    def _decimals(self) -> list[Guess]:
        """Return entries that are off by the smallest power of ten that makes the tensor possible."""
        for power, what in SLIPS.items():
            decimals = []
            for entry, factor in product(PLACES, (10.0**-power, 10.0**power)):
                value = self.held.tensor[PLACES[entry]]
                changed = self._with(entry, value * factor)
                if value != 0 and _can_be(changed):
                    decimals.append(Guess(what, entry, _spread(changed)))
            if decimals:
                return decimals
        return []

    def _reordered(self) -> Array:
        """Return the tensor with its numbers typed in the other order."""
        pairs = zip(ROWS, DIAGONAL_FIRST, strict=True)
        return symmetric({meant: float(self.held.tensor[PLACES[typed]]) for typed, meant in pairs})

    def _whole(self) -> str | None:
        """Return a mistake of the whole tensor: no moment exceeds m·r² where the body reaches to r, nor is one far below that."""
        held, largest = self.held, float(self.moments[2])
        if held.mass <= 0 or largest <= 0:
            return None
        if self.too_small:
            most = held.mass * self.spans**2
            return _units(most / largest)
        if self.reach is None or largest <= held.mass * self.reach**2 * (1 + 1e-9):
            return None
        most = held.mass * self.reach**2
        if np.linalg.norm(held.pose[:3, 3]) > 0:
            central = held.tensor - self._carried()
            if _can_be(central, 1e-3) and inertia.principal(central).moments[2] <= most * (1 + 1e-9):
                return "about the origin instead of the centre of mass"
        return _units(largest / (LIGHT * most))

    @property
    def too_small(self) -> bool:
        """Whether its moments are those of a point beside what it spans."""
        return 0 < float(self.moments[2]) < LIGHT * self.held.mass * self.spans**2


def _units(times: float) -> str | None:
    """Name the least power that brings moments back which are so many times off, and at most a thousand times as much."""
    return next((what for power, what in UNITS.items() if power <= times <= power / LIGHT), None)


def _can_be(tensor: Array, room: float = 1e-9) -> bool:
    return bool(np.linalg.eigvalsh(inertia.second_moments(tensor))[0] >= -room * np.abs(tensor).max())


def _spread(tensor: Array) -> float:
    moments = inertia.principal(tensor).moments
    return float(moments[2] / max(moments[0], 1e-300))


def link_body(link: RobotLink) -> Body | None:
    """Return the mass, centre of mass and inertia tensor of a robot's link in its own axes; None where the file gives none.

    Parameters
    ----------
    link : RobotLink
        One of the `links` of a robot; its `pose` (4, 4) places these axes in the world.

    Examples
    --------
    >>> from dalembert.documents.robots import Inertial, RobotLink
    >>> at = np.eye(4)
    >>> at[:3, 3] = 0.1, 0.0, 0.0
    >>> tensor = np.diag([1.0, 2.0, 3.0])
    >>> link_body(RobotLink("arm", np.eye(4), Inertial(2.0, at, tensor, np.zeros((3, 3)))))
    <Body: 2 kg at [0.1 0 0] m, principal moments [1 2 3] kg·m²>
    """
    from rigidbody3d.body import Body

    held = link.inertial
    if held is None:
        return None
    return Body(np.asarray(held.mass), held.pose[:3, 3], inertia.turn(held.tensor, held.pose[:3, :3]))


def check_robot_inertias(robot: Robot) -> list[InertiaCheck]:
    """Return the check of every link whose tensor a robot's file gives.

    Parameters
    ----------
    robot : Robot
        Of `read_robot`.

    Returns
    -------
    list of InertiaCheck
        In the order of the file: `link`; `moments` (3,), ascending, and `nearest` (3, 3), kg·m²; `valid`, to the digits that
        are printed; `likely`, the likely mistake, also in a tensor that a body can have but hardly this link.

    Notes
    -----
    A body can have a tensor where S = ½ tr(I) E − I = ∫ r rᵀ dm has no negative eigenvalue. The nearest one is
    `rigidbody3d.inertia.nearest`.

    Examples
    --------
    >>> from dalembert.documents.robots import Inertial, Robot, RobotLink
    >>> tensor = np.diag([1.23, 0.0123, 0.0131])
    >>> arm = RobotLink("arm", np.eye(4), Inertial(1.0, np.eye(4), tensor, np.full((3, 3), 0.00005)))
    >>> (check,) = check_robot_inertias(Robot("arm.urdf", "", {"arm": arm}))
    >>> check.valid, check.likely, check.nearest.diagonal().round(4)
    (False, 'a slipped decimal in ixx', array([0.8285, 0.4138, 0.4146]))
    """
    checks = []
    places = [end for j in robot.joints.values() for end in j.ends]
    for link in robot.links.values():
        held = link.inertial
        if held is None:
            continue
        center = (link.pose @ held.pose)[:3, 3]
        ends = [
            end
            for j in robot.joints.values()
            for body, end in zip((j.parent, j.child), j.ends, strict=True)
            if body == link.name
        ]
        spans = max((float(np.linalg.norm(end - center)) for end in ends), default=0.0)
        reach = ROOM * (
            spans or max((float(np.linalg.norm(place - center)) for place in places), default=0.0)
        )
        if link.shapes:
            at = held.pose[:3, 3]
            reach = max(float(np.linalg.norm(c - at)) + r for c, r in link.shapes)
            spans = max(float(r) for _, r in link.shapes)
        checks.append(InertiaCheck(link, held, reach or None, spans))
    return checks
