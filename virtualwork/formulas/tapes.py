"""The tapes of an assembly: each is written once, for whoever asks, and kept with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.engines import floats
from dalembert.arithmetic.tape import Tape
from virtualwork.formulas.entering import Entering
from virtualwork.formulas.kept import Later, later
from virtualwork.formulas.numbers import Number, Reals
from virtualwork.formulas.poses import Branch
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.recording import NAMES, Recording

# tapes of later requests that an assembly keeps
MANY = 256

# quantities of one pose, real or complex, as a function of the input, its speed, acceleration and jerk
Ready = Callable[[float, float, float, float], tuple[complex, ...]]


class Turning(Branch, Protocol):
    """A branch whose closed forms may change their sign along the input."""

    @property
    def signs(self) -> Mapping[str, int]:
        """The sign of each closed form at the guess."""

    @property
    def geared(self) -> set[str]:
        """Bodies whose angle itself is needed."""

    @property
    def recordings(self) -> dict[Any, Any]:
        """What has been written down of it."""

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


def recorded(branch: Turning, moves: tuple[bool, ...]) -> Recording:
    """The formulas of a branch, written down once for rates that are zero or not."""
    key = moves, branch.turning_over
    with branch.lock:
        if key not in branch.recordings:
            branch.recordings[key] = Recording(
                branch.mechanism, branch.plan, branch.signs, moves, branch.turning_over, branch.geared
            )
    result: Recording = branch.recordings[key]
    return result


def entered(branch: Turning, moves: tuple[bool, ...]) -> Entering:
    """The same where groups enter that have no closed form, are singular in every pose or have a change point."""
    changes = () if branch.passage is None else branch.passage.changes
    names = frozenset(g.name for g in branch.plan.groups if g.kind == "Newton").union(branch.folded, changes)
    key = "entering", names, moves, branch.turning_over
    with branch.lock:
        if key not in branch.recordings:
            of = branch.mechanism, branch.plan, branch.signs, moves, branch.turning_over, branch.geared
            branch.recordings[key] = Entering(names, *of)
            branch.recordings[key].st.folded.update(branch.folded)
    result: Entering = branch.recordings[key]
    return result


def taped(branch: Turning, recording: Recording, keys: tuple[Quantity, ...]) -> Tape:
    """The tape of quantities, pruned once."""
    key = recording, keys
    with branch.lock:
        if key not in branch.recordings:
            branch.recordings[key] = recording.tape(keys)
    result: Tape = branch.recordings[key]
    return result


def cut(
    branch: Turning, recording: Recording, keys: tuple[Quantity, ...], known: frozenset[int] | None
) -> Later:
    """The tape of quantities, from what is known on; None where nothing is, nor to be left."""
    if known is None:
        return Later(taped(branch, recording, keys), {}, {})
    with branch.lock:
        made = branch.recordings.setdefault("later", {})
        key = recording, keys, known
        if key not in made:
            if len(made) >= MANY:
                del made[next(iter(made))]
            made[key] = later(recording, keys, known)
        result: Later = made[key]
        return result


def ready(branch: Turning, moves: tuple[bool, ...], keys: tuple[Quantity, ...]) -> Ready | None:
    """Quantities of one pose as a function of floats; None where they depend on more than the input and its rates.

    Such a mechanism has one input that turns, no change point, no limit, and a closed form for every group.
    """
    recordings = branch.recordings
    name = "ready", moves, keys
    if name not in recordings:
        with branch.lock:
            recordings[name] = _made(branch, moves, keys)
    result: Ready | None = recordings[name]
    return result


def _made(branch: Turning, moves: tuple[bool, ...], keys: tuple[Quantity, ...]) -> Ready | None:
    if len(branch.mechanism.inputs) > 1 or not branch.settled or branch.folded or branch.may_open:
        return None
    recording = recorded(branch, moves)
    if not recording.takes(keys):
        return None
    tape = taped(branch, recording, keys)
    arguments = tuple(f"{name}0" for name in NAMES)
    if not floats.takes(tape) or not set(tape.inputs) <= set(arguments):
        return None
    return floats.compiled(tape, among=arguments, vectors=tuple(key.is_vector for key in keys))
