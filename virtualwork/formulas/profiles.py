"""The profile of a cam: the curve that touches its follower all around, and the pitch curve of the trace point."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from operator import itemgetter
from typing import Any

from dalembert.arithmetic.varied import direction, heading
from virtualwork.describe.cams import CamDrive
from virtualwork.describe.description import Description
from virtualwork.describe.laws import TURN, Lift
from virtualwork.describe.values import joined
from virtualwork.formulas.lifts import lift, placed
from virtualwork.formulas.numbers import WRITTEN, Number, One
from virtualwork.formulas.touches import carried


class Own(One):
    """Constants of the mechanism, plain or varied: decisions are those of the numbers they are made with."""

    def exp(self, angle: Number) -> Number:
        """e^{i·angle}."""
        return direction(angle)

    def angle(self, z: Number) -> Number:
        """The angle."""
        return heading(z)

    join = staticmethod(joined)  # type: ignore[assignment]


OWN = Own()
# of a profile in a picture; in a file for a workshop
STEPS, FINE = 180, 1440


@dataclass(frozen=True)
class ProfilePoint:
    """A point of a profile.

    Attributes
    ----------
    angle : float
        The cam's angle, against the body that carries it, at which it touches, rad.
    lift : float
        m, of an arm rad.
    pitch, profile : complex
        The trace point and the touching point, in the cam's own axes, m.
    pressure_angle : float
        rad.
    curvature_radius : float
        Of the profile, m, positive where it is convex.
    offset : float
        Of a flat face: how far along it from the trace point it touches, m; 0 of others.
    """

    angle: Any
    lift: Any
    pitch: Any
    profile: Any
    pressure_angle: Any
    curvature_radius: Any
    offset: Any


def profile(m: Description, drive: CamDrive, steps: int = STEPS) -> list[ProfilePoint]:
    """The profile of a cam, over one turn from where its law begins.

    Parameters
    ----------
    m : Description
        Its numbers may vary.
    drive : CamDrive
        One of `m.cam_drives`.
    steps : int
        About so many, the ends of all segments among them.

    Examples
    --------
    A law that only dwells gives a circle:

    >>> from virtualwork import Cam, Guide, Input, Link, Segment
    >>> m = Description({"O": 0j}, {"disk": Link({"O": 0j}), "rod": Link({"F": 0j})}, [Guide("F", "rod", turned=0.0)],
    ...                 inputs=Input("disk"), cams=[Cam("disk", 0.04, slider="F", law=(Segment(),))])
    >>> {round(abs(point.profile), 15) for point in profile(m, m.cam_drives[0], 8)}
    {0.04}
    """
    of, center = drive.lift, m.bodies[drive.cam.cam][drive.pin]
    points: list[ProfilePoint] = []
    for i, count in enumerate(counts(of, steps)):
        low, high = of.knots[i], of.knots[i + 1]
        for j in range(count):
            angle: Number = low + (high - low) * (j / count)
            at = placed(OWN, of, angle, itemgetter(i))
            touching = carried(m, drive, OWN, at)
            back = OWN.exp(-(of.first + angle))
            points.append(
                ProfilePoint(
                    of.first + angle,
                    lift(at, 0),
                    center + touching.r * back,
                    center + touching.touch() * back,
                    touching.pressure_angle(),
                    touching.curvature_radius(),
                    touching.offset() if touching.flat else 0.0,
                )
            )
    return points


def counts(of: Lift, steps: int) -> list[int]:
    """How many points of a profile begin on each piece of its law: about `steps` in all."""
    widths = [float(complex(high - low).real) for low, high in pairwise(of.knots)]
    return [max(1, math.ceil(steps * width / TURN - 1e-9)) for width in widths]


def written_profile(m: Description, drive: CamDrive, piece: Number, share: Number) -> Number:
    """The touching point in the cam's own axes, m, written down once for all points of `profile`.

    Parameters
    ----------
    m : Description
        Its numbers may vary.
    drive : CamDrive
        One of `m.cam_drives`.
    piece, share : recorded numbers
        The number of the law's piece, and how much of it lies before the point.
    """
    of, center = drive.lift, m.bodies[drive.cam.cam][drive.pin]
    middles = [i - 0.5 for i in range(len(of.pieces))]

    def chosen(values: list[Number]) -> Number:
        return WRITTEN.among(piece, middles, values)

    # both ends of a piece from one list
    low, high = (WRITTEN.among(piece + i, [*middles, middles[-1] + 1], list(of.knots)) for i in (0.0, 1.0))
    angle = low + (high - low) * share
    touching = carried(m, drive, WRITTEN, placed(WRITTEN, of, angle, chosen))
    return center + touching.touch() * WRITTEN.exp(-(of.first + angle))
