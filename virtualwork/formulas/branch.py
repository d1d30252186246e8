"""One assembly of a mechanism, as its poses and tapes need it: what to solve, which way every loop closes, what is kept of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.guard import Lock
from virtualwork.describe.description import Description
from virtualwork.formulas.numbers import Number, Reals
from virtualwork.formulas.positions import State
from virtualwork.formulas.rates import Passage
from virtualwork.plan.steps import Group, Plan, Step


class Branch(Protocol):
    """One assembly of a mechanism; the sign of its closed forms may change along the input."""

    @property
    def lock(self) -> Lock:
        """Of all that is worked out of it."""

    @property
    def mechanism(self) -> Description:
        """What moves."""

    @property
    def plan(self) -> Plan:
        """The order of solution."""

    @property
    def merged(self) -> tuple[Plan, Group | None]:
        """All loops at once."""

    @property
    def passage(self) -> Passage | None:
        """How derivatives go through change points; None with several inputs."""

    @property
    def recordings(self) -> dict[Any, Any]:
        """What has been made of it once for all poses: what is written down, loads, what a first request brings (`one_pose`)."""

    def needed(self, targets: Iterable[str]) -> tuple[Step, ...]:
        """The steps that targets depend on; worked out once for each set of targets."""

    @property
    def plain(self) -> dict[str, Callable[[State], None]]:
        """The closed forms that keep their sign wherever the input goes, each ready to be solved."""

    @property
    def close(self) -> Callable[[Group, State], None]:
        """Closes the loops of any other group on its branch."""

    def cover(self, low: float, high: float) -> None:
        """Look for change points and limits over the inputs from low to high."""

    @property
    def may_open(self) -> bool:
        """Whether it may not be assembled somewhere in the covered range."""

    @property
    def signs(self) -> Mapping[str, int]:
        """The sign of each closed form at the guess."""

    @property
    def geared(self) -> set[str]:
        """Bodies whose angle itself is needed."""

    @property
    def turning_over(self) -> frozenset[str]:
        """The closed forms that change their sign somewhere in what was covered."""

    @property
    def settled(self) -> bool:
        """Whether no change point lies anywhere, however far the input turns."""

    @property
    def folded(self) -> set[str]:
        """The groups that are singular in every pose."""

    def sign(self, group: str, q: Reals) -> Number:
        """The sign of a closed form at inputs."""

    @property
    def change_points(self) -> list[tuple[float, float]]:
        """Where two branches meet, each with how far off poses are close to it, in what was covered."""

    @property
    def phases(self) -> Mapping[int, float]:
        """The constants of gears, by their numbers."""

    def close_to_change(self, q: Reals) -> NDArray[np.bool_]:
        """Which inputs are close to a change point."""
