"""The pitch circles of gears: two that roll on each other, about the pins that carry the wheels on their arm."""

from __future__ import annotations

from typing import NamedTuple

from virtualwork.describe.description import Description
from virtualwork.describe.parts import Gear


class PitchCircle(NamedTuple):
    """The pitch circle of a toothed body about one of its pins, m."""

    body: str
    center: str
    radius: float


def pitch_circles(mechanism: Description) -> list[PitchCircle]:
    """Return the pitch circles of all gears whose wheels turn about pins of their arm, each once.

    With the distance a of the centres and the ratio i = (ω_b − ω_arm)/(ω_a − ω_arm): r_a = |i| r_b, and a = r_a + r_b
    where i is negative, a = |r_a − r_b| where it is positive (a wheel within a ring).

    Examples
    --------
    >>> from virtualwork.describe.parts import Link
    >>> train = Description({"O": 0j, "P": 3}, {"a": Link({"O": 0j}), "b": Link({"P": 0j})}, gears=[Gear(("a", "b"), -2)])
    >>> pitch_circles(train)
    [PitchCircle(body='a', center='O', radius=2.0), PitchCircle(body='b', center='P', radius=1.0)]
    """
    found: list[PitchCircle] = []
    for gear in mechanism.gears:
        arm = mechanism.bodies[gear.arm]
        centers = [next((p for p in mechanism.bodies[body] if p in arm), None) for body in gear.links]
        first, second = centers
        if first is None or second is None:
            continue
        radii = _radii(gear, abs(arm[second] - arm[first]))
        for body, center, radius in zip(gear.links, (first, second), radii, strict=False):
            circle = PitchCircle(body, center, radius)
            if not any(
                c.body == body and c.center == center and abs(c.radius - radius) <= 1e-9 * radius
                for c in found
            ):
                found.append(circle)
    return found


def _radii(gear: Gear, apart: float) -> tuple[float, ...]:
    """Return r_a and r_b; nothing of wheels on one centre, or that turn alike."""
    share = 1 - gear.ratio if gear.ratio < 0 else abs(gear.ratio - 1)
    if not (apart > 0 and share > 0 and gear.ratio):
        return ()
    radius = apart / share
    return abs(gear.ratio) * radius, radius
