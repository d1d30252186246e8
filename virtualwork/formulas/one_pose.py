"""One pose of a motion as a function of floats, straight through: the way of an evaluator, for a motion asked again and again.

A loop asks each of its motions for the same quantities, one after the other. What motions of an assembly were often asked for
after the same first request comes with it from then on, by one function for all of it.
"""

from __future__ import annotations

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
        known = self.known
        if key not in known and not self._work_out((key,)):
            return None
        return array([known[key]])

    def vector(self, key: Quantity) -> Reals | None:
        """A vector, (1, 2); None as above."""
        known = self.known
        if key not in known and not self._work_out((key,)):
            return None
        value = known[key]
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
        _, speed, acceleration, jerk = self.numbers
        moves = speed != 0.0, acceleration != 0.0, jerk != 0.0
        first, every = self._first, self.branch.together
        if first is None:
            first = every.get((moves, keys))
            if first is not None:
                self._first = first
                return self._run(*first.brought)
        recordings = self.branch.recordings
        made: Ready | None = recordings.get(("ready", moves, keys))
        if made is None:
            return False
        if first is None:
            self._first = every.setdefault((moves, keys), Together((made, keys)))
            return self._run(made, keys)
        count = first.later[keys] = first.later.get(keys, 0) + 1
        if count == OFTEN:
            wanted = tuple(dict.fromkeys((*first.brought[1], *keys)))
            together = ready(self.branch, moves, wanted)
            if together is not None:
                first.brought = together, wanted
        return self._run(made, keys)

    def _run(self, made: Ready, keys: tuple[Quantity, ...]) -> bool:
        try:
            result = made(*self.numbers)
        except (ZeroDivisionError, ValueError, OverflowError):
            return False
        # what another thread has put there meanwhile has the same bits
        self.known.update(zip(keys, result, strict=True))
        return True


def one_pose(branch: Branch, angle: Any, speed: Any, acceleration: Any, jerk: Any) -> OnePose | None:
    """The one pose at a float, over one input; None where it is anything else. A rate of None is the description's own."""
    entries = branch.mechanism.inputs
    if not isinstance(angle, float) or len(entries) > 1:
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
