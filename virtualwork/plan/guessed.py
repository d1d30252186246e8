"""What the guess says of links and points that it does not name."""

from __future__ import annotations

from dalembert.arithmetic.varied import heading, rotation
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND


def known_by_guess(m: Description) -> tuple[dict[str, float], dict[str, complex]]:
    """Rough link angles and point positions from the guess, the ground and the inputs, as far as they reach."""
    angles = dict(m.guess.angles)
    points = dict(m.ground) | dict(m.guess.points)
    for j, e in enumerate(m.inputs):
        if e.link is not None and e.on == GROUND:
            angles[e.link] = m.at[j]
    for g in m.guides:
        if g.turned is not None and g.on == GROUND:
            angles.setdefault(g.link, g.angle + g.turned)
        if g.turned is not None and g.link == GROUND:
            angles.setdefault(g.on, -(g.angle + g.turned))
    before = -1
    while len(angles) + len(points) > before:
        before = len(angles) + len(points)
        for name, link in m.links.items():
            here = [p for p in link.points if p in points]
            if name not in angles and len(here) >= 2:
                ends = max(
                    ((a, b) for a in here for b in here),
                    key=lambda ab: abs(link.points[ab[1]] - link.points[ab[0]]),
                )
                local = link.points[ends[1]] - link.points[ends[0]]
                seen = points[ends[1]] - points[ends[0]]
                if local and seen:
                    angles[name] = heading(seen / local)
            if name in angles and here:
                turn = rotation(angles[name])
                for p, z in link.points.items():
                    points.setdefault(p, points[here[0]] + (z - link.points[here[0]]) * turn)
    return angles, points
