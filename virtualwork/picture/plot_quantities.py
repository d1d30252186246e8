"""Quantities of a motion by name: `H.x`, `coupler.omega`, `B.position`; and how large one of a kind is."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from dalembert.hints import nearest
from virtualwork.describe import DescriptionError
from virtualwork.formulas.kinematics import Slide
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.poses import Poses

POINTS = {f"{rate}{part}": (order, part) for order, rate in enumerate(("", "v", "a", "j")) for part in "xy"}
LINKS = {"angle": 0, "omega": 1, "alpha": 2, "jerk": 3}
SLIDES = {"position": 0, "speed": 1, "acceleration": 2}
LENGTHS = ("m", "m/s", "m/s²", "m/s³")
ANGLES = ("deg", "rad/s", "rad/s²", "rad/s³")


class PlotQuantity(NamedTuple):
    """A quantity over the poses: its name, its unit, its values (n,), and how large one of its kind is."""

    name: str
    unit: str
    values: Reals
    scale: float


def plot_quantities(poses: Poses, names: Iterable[str]) -> list[PlotQuantity]:
    """Return the quantities of these names.

    Raises
    ------
    DescriptionError
        No link or point of that name, or it has no such quantity; the message lists the names.
    """
    return [_quantity(poses, name) for name in names]


def _quantity(poses: Poses, word: str) -> PlotQuantity:
    m = poses.mechanism
    name, _, what = word.rpartition(".")
    guides = {g.point: i for i, g in enumerate(m.guides)}
    names = {*m.points, *m.links}
    if not name:
        raise DescriptionError(
            f"'{word}': expected a quantity, such as {word}.{'x' if word in m.points else 'omega'}"
        )
    if name not in names:
        raise DescriptionError(f"'{word}': no link or point is named '{name}'{nearest(name, names)}")
    if name in m.points and what in POINTS:
        order, part = POINTS[what]
        body, place = m.points[name]
        z = poses.point(body, place, order, name)
        return PlotQuantity(
            word, LENGTHS[order], z.real if part == "x" else z.imag, m.size * pace(poses) ** order
        )
    if name in m.links and what in LINKS:
        order = LINKS[what]
        if order:
            return PlotQuantity(word, ANGLES[order], poses.angle(name, order), pace(poses) ** order)
        return PlotQuantity(word, "deg", unwrapped(poses.angle(name)), 180.0)
    if name in guides and what in SLIDES:
        order = SLIDES[what]
        values = poses.values([Slide(guides[name], order)])[0]
        return PlotQuantity(word, LENGTHS[order], values, m.size * pace(poses) ** order)
    kinds = ((POINTS, m.points), (LINKS, m.links), (SLIDES, guides))
    choices = [choice for of, holders in kinds if name in holders for choice in of]
    raise DescriptionError(f"'{word}': expected {name}. with one of {', '.join(choices)}")


def pace(poses: Poses) -> float:
    """Return how fast the inputs go, 1/s: the largest of ω, √α and ∛jerk, a slide in the mechanism's sizes."""
    m = poses.mechanism
    result = 0.0
    for j, entry in enumerate(m.inputs):
        for order in (1, 2, 3):
            rate = np.abs(poses.rate(j, order)).max(initial=0.0) / (m.size if entry.is_slide else 1.0)
            result = max(result, float(rate) ** (1 / order))
    return result


def unwrapped(angle: Reals) -> Reals:
    """Return angles (n,), rad, as degrees without jumps, across gaps too."""
    out = np.degrees(angle)
    good = np.isfinite(angle)
    out[good] = np.degrees(np.unwrap(angle[good]))
    return out
