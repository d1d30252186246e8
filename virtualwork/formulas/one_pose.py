"""One pose of a motion as a function of floats, straight through: the way of an evaluator, for a motion with many requests.

A loop requests the same quantities of each of its motions, one after the other. What was often requested of motions of an assembly
after the same first request comes with it from then on, by one function for all of it.
"""

from __future__ import annotations

from math import isfinite
from typing import Any

from numpy import array, empty

from dalembert.dataclass import dataclass, field
from virtualwork.formulas.branch import Branch
from virtualwork.formulas.lanes import OFTEN
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.tapes import Ready, ready


@dataclass
class Together:
    """What a first request brings, a function and its quantities, and how often others were requested after it."""

    brought: tuple[Ready, tuple[Quantity, ...]]
    later: dict[tuple[Quantity, ...], int] = field(default_factory=dict)


class OnePose:
    """The quantities of one pose that depend on nothing but its input and its rates.

    Several threads may ask it: each number is put down whole.

    Parameters
    ----------
    branch : Branch
    numbers : tuple of float
        The input, its speed, acceleration and jerk.
    """

    __slots__ = ("_first", "branch", "known", "numbers")

    def __init__(self, branch: Branch, numbers: tuple[float, float, float, float]) -> None:
        self.branch, self.numbers = branch, numbers
        self.known: dict[Quantity, float | complex] = {}
        self._first: Together | None = None

    def value(self, key: Quantity) -> Any:
        """A quantity, (1,); None where a function of floats has not been made of it, or fails."""
        value = self.known.get(key)
        if value is None:
            if not self._work_out((key,)):
                return None
            value = self.known[key]
        return array([value])

    def vector(self, key: Quantity) -> Reals | None:
        """A vector, (1, 2); None as above."""
        value = self.known.get(key)
        if value is None:
            if not self._work_out((key,)):
                return None
            value = self.known[key]
        # twice as fast as an array of a list
        result = empty((1, 2))
        result[0, 0], result[0, 1] = value.real, value.imag
        return result

    def values(self, keys: tuple[Quantity, ...]) -> list[Any] | None:
        """Quantities, (1,) each; None where a function of floats has not been made of them, or fails."""
        known = self.known
        new = tuple([key for key in keys if key not in known])
        if new and not self._work_out(new):
            return None
        return [array([known[key]]) for key in keys]

    def _work_out(self, keys: tuple[Quantity, ...]) -> bool:
        """Work out quantities; False where a function of floats has not been made of them, or fails."""
        branch, numbers = self.branch, self.numbers
        _, speed, acceleration, jerk = numbers
        moves = speed != 0.0, acceleration != 0.0, jerk != 0.0
        first = self._first
        together = branch.recordings.get(("together", moves, keys)) if first is None else None
        if together is None:
            made: Ready | None = branch.recordings.get(("ready", moves, keys))
            if made is None:
                return False
            function: Ready = made
            if first is None:
                together = branch.recordings.setdefault(("together", moves, keys), Together((function, keys)))
            else:
                self._note(first, moves, keys)
        if together is not None:
            self._first = together
            function, keys = together.brought
        try:
            result = function(*numbers)
        except (ZeroDivisionError, ValueError, OverflowError):
            return False
        # what another thread has put there meanwhile has the same bits
        known = self.known
        for key, value in zip(keys, result, strict=True):
            known[key] = value
        return True

    def _note(self, first: Together, moves: tuple[bool, ...], keys: tuple[Quantity, ...]) -> None:
        """Count a request that came later than a first one; if it comes often, the first brings it from then on."""
        count = first.later[keys] = first.later.get(keys, 0) + 1
        if count == OFTEN:
            wanted = tuple(dict.fromkeys((*first.brought[1], *keys)))
            together = ready(self.branch, moves, wanted)
            if together is not None:
                first.brought = together, wanted


def one_pose(branch: Branch, angle: Any, speed: Any, acceleration: Any, jerk: Any) -> OnePose | None:
    """The one pose at a finite float, over one input; None where it is anything else. A rate of None is the description's own."""
    entries = branch.mechanism.inputs
    if not isinstance(angle, float) or not isfinite(angle) or len(entries) > 1:
        return None
    own = entries[0]
    if speed is None:
        speed = own.speed or 0.0
    if acceleration is None:
        acceleration = own.acceleration or 0.0
    if jerk is None:
        jerk = own.jerk or 0.0
    if isinstance(speed, float) and isinstance(acceleration, float) and isinstance(jerk, float):
        return OnePose(branch, (angle, speed, acceleration, jerk))
    return None
