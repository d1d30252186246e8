"""Which quantities a graph shows: `H.x`, `coupler.omega`, `B.slide`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cli.errors import nearest
from cli.mechanism.solve import Analysis
from cli.read import options

if TYPE_CHECKING:
    from numpy.typing import NDArray

POINTS = {"x": (0, 0, "m"), "y": (0, 1, "m"), "vx": (1, 0, "m/s"), "vy": (1, 1, "m/s"), "ax": (2, 0, "m/s²"),
          "ay": (2, 1, "m/s²"), "jx": (3, 0, "m/s³"), "jy": (3, 1, "m/s³")}  # fmt: skip
LINKS = {"angle": "deg", "omega": "rad/s", "alpha": "rad/s²", "jerk": "rad/s³"}
SLIDES = {"slide": ("position", "m"), "speed": ("speed", "m/s"), "acceleration": ("acceleration", "m/s²")}


@dataclass(frozen=True)
class Quantity:
    """One curve: its label, its unit, its values."""

    label: str
    unit: str
    values: NDArray[np.float64]


def quantities(analysis: Analysis, text: str) -> list[Quantity]:
    """The curves that `--graph` names, of the first assembly asked for."""
    motion = analysis.motions[0]
    m = analysis.mechanism
    points = {p for body in m.bodies.values() for p in body}
    guides = {g.point for g in m.guides}
    found = []
    for word in (w.strip() for w in text.split(",")):
        name, _, what = word.rpartition(".")
        known = {*points, *m.links}
        if name not in known:
            raise options.bad(
                "--graph", f"'{word}': no link or point is named '{name}'{nearest(name, known)}"
            )
        if name in points and what in POINTS:
            order, part, unit = POINTS[what]
            z = motion.point(name).complex(order)
            values = z.imag if part else z.real
        elif name in m.links and what in LINKS:
            unit = LINKS[what]
            values = getattr(motion.link(name), what)
            if what == "angle":
                values = _unwrapped(values)
        elif name in guides and what in SLIDES:
            attribute, unit = SLIDES[what]
            values = getattr(motion.slide(name), attribute)
        else:
            choices = [
                *(POINTS if name in points else ()),
                *(LINKS if name in m.links else ()),
                *(SLIDES if name in guides else ()),
            ]
            raise options.bad("--graph", f"'{word}': expected {name}. with one of {', '.join(choices)}")
        found.append(Quantity(word, unit, np.asarray(values)))
    return found


def _unwrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Degrees without jumps, across gaps too."""
    out = np.degrees(angle)
    good = np.isfinite(angle)
    out[good] = np.degrees(np.unwrap(angle[good]))
    return out
