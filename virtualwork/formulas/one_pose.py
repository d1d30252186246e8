"""One pose of a motion as a function of floats, straight through: the way of an evaluator, for a motion asked again and again.

A loop asks each of its motions for the same quantities, one after the other. What motions of an assembly were often asked for
after the same first request comes with it from then on, by one function for all of it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dalembert.dataclass import dataclass, field
from virtualwork.formulas.lanes import OFTEN, Ready, Turning, ready
from virtualwork.formulas.quantity import Quantity

RATES = ("speed", "acceleration", "jerk")


@dataclass
class Together:
    """What a first request brings: the function, its quantities, and how often others were requested after it."""

    function: Ready
    keys: tuple[Quantity, ...]
    later: dict[tuple[Quantity, ...], int] = field(default_factory=dict)


class OnePose:
    """The quantities of one pose that depend on nothing but its input and its rates.

    Parameters
    ----------
    branch : Turning
    numbers : tuple of float
        The input, its speed, acceleration and jerk.
    """

    __slots__ = ("_first", "_moves", "branch", "known", "numbers")

    def __init__(self, branch: Turning, numbers: tuple[float, float, float, float]) -> None:
        self.branch, self.numbers = branch, numbers
        self._moves = numbers[1] != 0.0, numbers[2] != 0.0, numbers[3] != 0.0
        self.known: dict[Quantity, float | complex] = {}
        self._first: Together | None = None

    def values(self, keys: tuple[Quantity, ...]) -> list[Any] | None:
        """Quantities, (1,) each; None where a function of floats has not been made of them, or fails."""
        known = self.known
        new = tuple(key for key in keys if key not in known)
        if new and not self._work_out(new):
            return None
        return [np.array([known[key]]) for key in keys]

    def _work_out(self, keys: tuple[Quantity, ...]) -> bool:
        made: Ready | None = self.branch.recordings.get(("ready", self._moves, keys))
        if made is None:
            return False
        if self._first is None:
            every = self.branch.recordings.setdefault("together", {})
            name = self._moves, keys
            self._first = every.get(name) or every.setdefault(name, Together(made, keys))
            return self._run(self._first.function, self._first.keys)
        first = self._first
        first.later[keys] = first.later.get(keys, 0) + 1
        if first.later[keys] == OFTEN:
            wanted = tuple(dict.fromkeys((*first.keys, *keys)))
            together = ready(self.branch, self._moves, wanted)
            if together is not None:
                first.function, first.keys = together, wanted
        return self._run(made, keys)

    def _run(self, made: Ready, keys: tuple[Quantity, ...]) -> bool:
        function, places, vectors = made
        numbers = self.numbers
        try:
            found = iter(function(*[numbers[i] for i in places]))
        except (ZeroDivisionError, ValueError, OverflowError):
            return False
        for key, vector in zip(keys, vectors, strict=True):
            self.known[key] = complex(next(found), next(found)) if vector else next(found) + 0.0
        return True


def one_pose(branch: Turning, given: tuple[Any, ...]) -> OnePose | None:
    """The one pose at a float, over one input; None where it is anything else.

    Parameters
    ----------
    given : tuple
        The input, its speed, acceleration and jerk, as they are requested; None: the description's own.
    """
    angle, *rates = given
    if not isinstance(angle, float):
        return None
    entries = branch.mechanism.inputs
    if len(entries) > 1:
        return None
    numbers = [angle]
    for name, value in zip(RATES, rates, strict=True):
        if value is None:
            value = getattr(entries[0], name) or 0.0
        elif not isinstance(value, float):
            return None
        numbers.append(value)
    return OnePose(branch, (numbers[0], numbers[1], numbers[2], numbers[3]))
