"""Friction at one state: joint forces, accelerations and slides, each linear in the friction of every joint that rubs."""

from __future__ import annotations

from operator import mul
from typing import Any, NamedTuple

import numpy as np

from virtualwork.formulas.friction import balanced
from virtualwork.formulas.numbers import Complexes
from virtualwork.intime.watch import Floats, sign

Mode = tuple[int, ...]
"""For each joint that rubs: the sign of its rate, 0 where it sticks."""


class Values(NamedTuple):
    """The outputs of the tape at one state; complex R = P + Q·φ, accelerations a + A·φ, of the joints' rates s + S·φ."""

    a: Floats
    per: list[Floats]
    p: list[complex]
    q: list[list[complex]]
    rate: Floats
    slip: Floats
    slips: list[Floats]
    power: float
    # whether it is so close to a change point that without friction it is interpolated
    near: bool

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

    def followed(self, mode: Mode, arms: Floats, inverse: Any) -> Floats | None:
        """The friction of all joints in a mode where it does not settle by putting it in again and again; None where they lock.

        What keeps a joint at rest is linear in the friction of those that slide, by the `inverse` of what the friction of
        those at rest does to their slides: these alone are unknown.
        """
        slides = [n for n, sense in enumerate(mode) if sense]
        stuck = [n for n, sense in enumerate(mode) if not sense]
        if not slides:
            return None
        # the friction of every joint: its constant, and its share in that of each joint that slides
        whole = np.zeros((len(mode), 1 + len(slides)))
        whole[slides, 1 + np.arange(len(slides))] = 1.0
        if inverse is not None:
            rest = np.array(self.slips)[stuck] @ whole
            rest[:, 0] += np.array(self.slip)[stuck]
            whole[stuck] = -inverse @ rest
        forces: Complexes = np.asarray(np.array(self.q)[slides] @ whole, dtype=complex)
        forces[:, 0] += np.array(self.p)[slides]
        phi = balanced(np.array([mode[n] * arms[n] for n in slides]), forces[:, 0], forces[:, 1:])
        return None if phi is None else (whole @ np.append(1.0, phi)).tolist()
