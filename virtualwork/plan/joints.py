"""Each kind of joint once: what it joins, the angles it ties, its name in messages.

A pin or a guide holds a point; a slider, a gear and a turning input tie angles, Σ c·θ = const + Σ k·input. The shares c
are also how the torque of the joint acts on the bodies.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal

from virtualwork.describe.description import Description
from virtualwork.plan.steps import Angle


@dataclass(frozen=True)
class Joint:
    """A joint that holds a point: a pin or a guide, and the bodies it joins in the file's order."""

    key: str
    name: str
    bodies: tuple[str, ...]
    guide: int | None = None
    label: str = ""


def joints(m: Description) -> list[Joint]:
    """Every joint of the mechanism that holds a point: pins in the order of the file, then guides."""
    found = [Joint(f"pin:{name}", name, bodies, None, f"pin {name}") for name, bodies in m.pins.items()]
    order = list(m.bodies)
    for i, g in enumerate(m.guides):
        bodies = tuple(sorted((g.link, g.on), key=order.index))
        found.append(Joint(f"guide:{i}", g.point, bodies, i, guide_label(m, i)))
    return found


def guide_label(m: Description, i: int) -> str:
    """How messages call a guide."""
    return f"{'slider' if m.guides[i].is_slider else 'slot'} {m.guides[i].point}"


@dataclass(frozen=True)
class Relation:
    """Angles that a slider, a gear or a turning input ties: Σ share·θ = right.

    `number` counts the guides, gears or inputs of the file. A gear's constant is that of the guess.
    """

    kind: Literal["guide", "gear", "input"]
    number: int
    label: str
    shares: Mapping[str, float]
    right: Angle = field(default_factory=Angle)

    @property
    def gear(self) -> int | None:
        """The gear's number; None of others."""
        return self.number if self.kind == "gear" else None


def relations(m: Description) -> Iterator[Relation]:
    """Every relation between angles: of inputs, sliders and gears."""
    for j, e in enumerate(m.inputs):
        if e.link is not None:
            yield Relation(
                "input", j, f"input {e.name}", {e.link: 1.0, e.on: -1.0}, Angle(inputs=((j, 1.0),))
            )
    for i, g in enumerate(m.guides):
        if g.turned is not None:
            right = Angle(g.angle + g.turned)
            yield Relation("guide", i, guide_label(m, i), {g.link: 1.0, g.on: -1.0}, right)
    for i, gear in enumerate(m.gears):
        yield Relation("gear", i, f"gear {'-'.join(gear.links)}", gear.shares())
