"""Exact derivatives of what a motion does to the numbers that describe its mechanism.

The formulas are written down with those numbers as inputs of the tape; one sweep backwards over it gives the derivative
of a result to all of them. A group without a closed form takes one Newton step on the tape, whose derivative is that of
its solution (the implicit function theorem).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dalembert.arithmetic.engines import run
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import DescriptionError, MechanismError
from virtualwork.describe.dimensions import Dimension, named, value
from virtualwork.family.written import Written
from virtualwork.formulas.asked import FORCES, JOINTS, Key, quantity
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.poses import Poses
from virtualwork.formulas.recording import NAMES

# what an input's own numbers are called on the tape
ENTERS = dict(zip(("value", "speed", "acceleration", "jerk"), NAMES, strict=True))


class Sensitivities:
    """Derivatives of the quantities of some poses of an assembly."""

    def __init__(self, assembly: Assembly, poses: Poses) -> None:
        self.assembly, self.poses = assembly, poses
        self._lanes = Lanes(assembly, poses)
        self._written: dict[tuple[Dimension, ...], Written] = {}

    def dimension(self, path: str) -> Dimension:
        """The one number that a path names.

        Raises
        ------
        DescriptionError
            Where it names none, or two.
        """
        found = named(self.assembly.mechanism, path)
        if len(found) > 1:
            raise DescriptionError(f"'{path}' names two numbers: expected {found[0].path} or {found[1].path}")
        return found[0]

    def of(self, keys: Sequence[Key], dimensions: Sequence[Dimension]) -> list[list[Any]]:
        """The derivative of each quantity (`Recording.value`) to each dimension, (n,), real or complex.

        Raises
        ------
        MechanismError
            With friction, or redundant statics, where forces have no closed form; with a gear whose phase is that of
            a link which has to be placed first.
        """
        every = tuple(dimensions)
        written = self._formulas(every)
        self._refuse(keys, written)
        # an input's own numbers enter as those of every input do
        enters = [
            d.path if d.where[0] != "inputs" else f"{ENTERS[str(d.where[2])]}{d.where[1]}" for d in every
        ]
        tape = written.slopes(tuple(keys), tuple(enters))
        given = {
            d.path: float(value(self.assembly.mechanism, d.path).real)
            for d in every
            if d.where[0] != "inputs"
        }
        rest = [name for name in tape.inputs if name not in given]
        with np.errstate(all="ignore"):
            found = run(tape, given | self._lanes.entering(rest))
        return [[quantity(found, key, self.poses.n, to=name) for name in enters] for key in keys]

    def values(self, keys: Sequence[Key]) -> list[Any]:
        """The quantities themselves, (n,)."""
        return self._lanes.values(list(keys))

    def _formulas(self, dimensions: tuple[Dimension, ...]) -> Written:
        if dimensions not in self._written:
            own = {d.where[-1] for d in dimensions if d.where[0] == "inputs"}
            moves = tuple(
                any(np.any(rate) for rate in rates) or rate in own
                for rate, rates in zip(list(ENTERS)[1:], self.poses.rates, strict=True)
            )
            inner = [d for d in dimensions if d.where[0] != "inputs"]
            # which signs change on the way is known once the way was looked over
            _ = self.poses.states()
            self._written[dimensions] = Written(self.assembly, inner, moves, own_signs=False, settled=False)
        return self._written[dimensions]

    def _refuse(self, keys: Sequence[Key], written: Written) -> None:
        m = self.assembly.mechanism
        if written.open_gears:
            raise MechanismError(
                "sensitivity: the phase of a gear hangs on links that have to be placed first"
            )
        if self.assembly.folded:
            raise MechanismError("sensitivity: the mechanism is singular in every pose")
        if any(key[0] in FORCES for key in keys):
            if m.friction:
                raise MechanismError("sensitivity: forces with friction are not differentiated")
            if any(key[0] in JOINTS for key in keys) and written.recording.forces[0].order.redundant:
                raise MechanismError("sensitivity: redundant joint forces are not differentiated")
