"""Friction at one state: joint forces, accelerations and slides, each linear in the friction of every joint that rubs."""

from __future__ import annotations

from operator import mul
from typing import NamedTuple

from virtualwork.intime.watch import Floats, sign

Mode = tuple[int, ...]
"""For each joint that rubs: the sign of its rate, 0 where it sticks."""


class Values(NamedTuple):
    """What the tape says at one state; complex R = P + Q·φ, accelerations a + A·φ, of the joints' rates s + S·φ."""

    a: Floats
    per: list[Floats]
    p: list[complex]
    q: list[list[complex]]
    rate: Floats
    slip: Floats
    slips: list[Floats]
    power: float

    @property
    def signs(self) -> Mode:
        """Which way each joint slides."""
        return tuple(sign(rate) for rate in self.rate)

    def force(self, n: int, phi: Floats) -> float:
        """A joint's force with friction, in size."""
        return float(abs(self.p[n] + sum(map(mul, self.q[n], phi))))

    def slid(self, n: int, phi: Floats) -> float:
        """The acceleration of a joint's slide with friction."""
        return float(self.slip[n] + sum(map(mul, self.slips[n], phi)))

    def moved(self, phi: Floats) -> Floats:
        """The accelerations with friction."""
        result = list(self.a)
        for x, per in zip(phi, self.per, strict=True):
            result = [a + x * b for a, b in zip(result, per, strict=True)]
        return result
