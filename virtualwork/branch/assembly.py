"""An assembly of a mechanism: on which branch each group closes, wherever its input goes.

The guess picks each group's sign once. What a pose at another input looks like follows from the branch alone (no
marching): the sign of each closed form, turned over at each change point on the way (`virtualwork.branch.track`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.guard import guarded
from virtualwork.branch.choice import Choice
from virtualwork.branch.guess import choose
from virtualwork.branch.track import Track
from virtualwork.describe.description import Description
from virtualwork.formulas.numbers import Number, Reals
from virtualwork.formulas.positions import State
from virtualwork.formulas.rates import Passage
from virtualwork.plan.steps import Group, Step

if TYPE_CHECKING:
    from virtualwork.branch.limits import Reach


@guarded
class Assembly(Choice):
    """A mechanism put together in one way, ready to move."""

    @classmethod
    def from_guess(cls, m: Description) -> Assembly:
        """The assembly that the guess chooses.

        Raises
        ------
        AssemblyError
            Where the guess is missing and there is more than one: the choices are listed.
        """
        return choose(m, cls)

    @cached_property
    def recordings(self) -> dict[Any, Any]:
        """What has been made of it once for all motions: what is written down on tapes, what acts at rest and in motion."""
        return {}

    # --- along the input ------------------------------------------------------------------------------------------
    @cached_property
    def track(self) -> Track:
        """Change points and limits along the input."""
        return Track(self)

    @cached_property
    def reach(self) -> Reach:
        """How far the input goes, and after how many turns the branch repeats itself."""
        # poses that all close, asked for by their inputs, do not load it
        from virtualwork.branch.limits import Reach

        return Reach(self.track)

    @property
    def passage(self) -> Passage | None:
        """How derivatives go through change points; None with several inputs."""
        return self.track if self.track.active else None

    @property
    def turning_over(self) -> frozenset[str]:
        """The closed forms that change their sign somewhere in what was covered."""
        flips = self.track.flips
        return frozenset(name for name in flips if len(flips[name]) and name not in self.folded)

    @property
    def settled(self) -> bool:
        """Whether no change point lies anywhere, however far the input turns."""
        at = self.mechanism.at
        self.cover(at[0], at[0])
        return self.track.settled

    @property
    def folded(self) -> set[str]:
        """The groups that are singular in every pose."""
        return self.track.folded

    @property
    def may_open(self) -> bool:
        """Whether it cannot be assembled somewhere in what was covered, as far as is known."""
        track = self.track
        simple = track.active and not track.slides and len(self.plain) == len(self.plan.groups)
        return not simple or track.has_limits or not self._stands

    @cached_property
    def _stands(self) -> bool:
        """Whether it is assembled at the guess."""
        return all(margin >= 0 for margin in self.state(self.mechanism.at).margin.values())

    def sign(self, group: str, q: Reals) -> Number:
        """The sign of a closed form at inputs."""
        return self.track.sign(group, q)

    @property
    def change_points(self) -> list[tuple[float, float]]:
        """Where two branches meet, each with how far off poses are close to it, in what was covered."""
        return [(change.input, change.reach) for of in self.track.changes.values() for change in of]

    def close_to_change(self, q: Reals) -> NDArray[np.bool_]:
        """Which inputs are close to a change point."""
        near = np.zeros(np.shape(q), dtype=bool)
        for at, reach in self.change_points:
            near |= np.abs(q - at) < reach
        return near

    def cover(self, low: float, high: float) -> None:
        """Look for change points and limits over the inputs from low to high."""
        self.track.cover(low, high)

    @property
    def close(self) -> Callable[[Group, State], None]:
        """Closes the loops of a group on its branch."""
        return self.track.close

    def run(self, steps: Iterable[Step], st: State) -> None:
        """Work out positions, step by step."""
        self.track.run(steps, st)

    def state(self, inputs: tuple[float, ...]) -> State:
        """Positions of one pose, as Python numbers."""
        return self.track.pose(self.plan.steps, inputs)
