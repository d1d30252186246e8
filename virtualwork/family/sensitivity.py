"""Exact derivatives of what a motion does to the numbers that describe its mechanism.

The formulas are written down with those numbers as inputs of the tape; one sweep backwards over it gives the derivative
of a result to all of them. A group without a closed form takes one Newton step on the tape, whose derivative is that of
its solution (the implicit function theorem).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.engines import run
from dalembert.arithmetic.engines.doubled import Answer, compared
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.guard import guarded
from dalembert.arithmetic.tape import Operation, Tape
from virtualwork.branch.assembly import Assembly
from virtualwork.describe import DescriptionError, MechanismError
from virtualwork.describe.dimensions import Dimension, dimensions, named, number_of
from virtualwork.digits.second_run import SecondRun, parts
from virtualwork.family.varied_formulas import VariedFormulas
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.numbers import Reals, leave_out
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.recording import NAMES

# number of poses in which it is checked whether a quantity varies
LOOKED_AT = 8
GOLDEN = (5**0.5 - 1) / 2
# relative: what is read from decimals, turned to radians, or computed by iteration; and by how much it is moved to see what that does
OFF, NUDGE = 4 * EPS, 2.0**-30
# what an input's own numbers are called on the tape
ENTERS = dict(zip(("value", "speed", "acceleration", "jerk"), NAMES, strict=True))


@guarded
class Sensitivities:
    """Derivatives of the quantities of some poses of an assembly."""

    def __init__(self, assembly: Assembly, poses: Lanes) -> None:
        self.assembly, self.poses, self.lock = assembly, poses, assembly.lock
        self._written: dict[tuple[Dimension, ...], VariedFormulas] = {}

    def dimension(self, path: str) -> Dimension:
        """The one number that a path names.

        Raises
        ------
        DescriptionError
            Where it names none, or two.
        """
        result = named(self.assembly.mechanism, path)
        if len(result) > 1:
            raise DescriptionError(
                f"'{path}' names two numbers: expected {result[0].path} or {result[1].path}"
            )
        return result[0]

    def of(self, keys: Sequence[Quantity], dimensions: Sequence[Dimension]) -> list[list[Any]]:
        """The derivative of each quantity to each dimension, (n,), real or complex.

        Raises
        ------
        MechanismError
            With friction, or redundant statics, where forces have no closed form; with a gear whose phase is that of
            a link which has to be placed first.
        """
        every = tuple(dimensions)
        written = self._formulas(every)
        self._refuse(keys, written)
        enters = self._entering(every)
        tape = written.slopes(tuple(keys), tuple(enters))
        entering = self._given(tape, every)
        with np.errstate(all="ignore"):
            outputs = run(tape, entering)
        slopes = [[key.of_rows(outputs, self.poses.n, to=name) for name in enters] for key in keys]
        nowhere = ~self.poses.assembled
        if nowhere.any():
            for slope in (slope for row in slopes for slope in row):
                leave_out(slope, nowhere)
        return slopes

    def errors(
        self, keys: Sequence[Quantity], dimensions: Sequence[Dimension], slopes: Sequence[Sequence[Any]]
    ) -> list[list[Reals]]:
        """Estimates of the rounding errors of derivatives that `of` has given, (n,) each: by what those in 32 digits differ from them.

        Every number of the description enters, with a file's decimals exact: what its differences round is an error too.
        """
        every, enters = tuple(dimensions), self._with_lengths(dimensions)
        names, second = self._entering(every), SecondRun(self.poses)
        tape = self._formulas(enters).slopes(tuple(keys), tuple(names))
        given = {name: Doubled(x) for name, x in self._given(tape, enters).items() if name in tape.inputs}
        given = {name: second.exact.known.get(name, x) for name, x in given.items() if "." in name}
        answers = {
            Answer(tuple(f"d({part})/d({name})" for part in key.names)): parts(key, slope)
            for key, row in zip(keys, slopes, strict=True)
            for name, slope in zip(names, row, strict=True)
        }
        with np.errstate(all="ignore"):
            estimates, _ = compared(tape, second.entering(tape.inputs, given), answers)
        each = iter(np.broadcast_to(error, self.poses.n) for error in estimates)
        return [[next(each) for _ in names] for _ in keys]

    def _with_lengths(self, requested: Sequence[Dimension]) -> tuple[Dimension, ...]:
        """Return dimensions, and all others but those of inputs."""
        own = (d for d in dimensions(self.assembly.mechanism).values() if d.where[0] != "inputs")
        return tuple(dict.fromkeys((*requested, *own)))

    def _entering(self, dimensions: Sequence[Dimension]) -> list[str]:
        """Return the names of dimensions on the tape: an input's own numbers enter as those of every input do."""
        return [
            d.path if d.where[0] != "inputs" else f"{ENTERS[str(d.where[2])]}{d.where[1]}" for d in dimensions
        ]

    def _given(self, tape: Tape, dimensions: Sequence[Dimension]) -> dict[str, Any]:
        """Return the inputs of a tape: the dimensions' own numbers, and those of the poses."""
        own = {
            d.path: float(number_of(self.assembly.mechanism, d)) for d in dimensions if d.where[0] != "inputs"
        }
        return own | self.poses.entering([name for name in tape.inputs if name not in own])

    def vary(self, keys: Sequence[Quantity], limits: Mapping[Dimension, float]) -> list[tuple[bool, ...]]:
        """Which quantities vary at all with these dimensions: of each its parts, x and y of what is complex.

        What is constant, as a coordinate across its slide is, has derivatives of nothing but rounding. So a quantity
        varies if along one direction of all dimensions its derivative is anywhere larger than its own rounding error, by
        a second run in 32 digits, and than what the rounding of the numbers that enter makes of it. Every dimension enters:
        what rounds where two constants meet would be exact in both runs.
        """
        there = np.flatnonzero(self.poses.assembled)
        if not len(there):
            # nothing is known: no number of it is shown either
            return [(True,) * len(key.names) for key in keys]
        every = tuple(limits)
        # of no simple ratio to each other: derivatives do not cancel
        steps = [limit * (1 + GOLDEN * i % 1) for i, limit in enumerate(limits.values(), 1)]
        enters = self._with_lengths(every)
        tape = self._formulas(enters).along(
            tuple(keys), tuple(zip(self._entering(every), steps, strict=True))
        )
        if not tape.outputs:
            # nothing of them depends on any dimension
            return [(False,) * len(key.names) for key in keys]
        rows = there[np.unique(np.linspace(0, len(there) - 1, LOOKED_AT).astype(int))]
        entering = {
            name: np.asarray(value, dtype=float)[rows] if np.ndim(value) else np.full(len(rows), value)
            for name, value in self._given(tape, enters).items()
        }
        with np.errstate(all="ignore"):
            slopes = {name: np.broadcast_to(x, len(rows)) for name, x in dict(run(tape, entering)).items()}
            own, _ = compared(tape, entering, {Answer((name,)): [x] for name, x in slopes.items()})
            moved = _moved(tape, entering, slopes)
            varies = {
                name: bool(np.any(np.abs(x) > error + moved[name]))
                for (name, x), error in zip(slopes.items(), own, strict=True)
            }
        return [tuple(varies.get(name, False) for name in key.names) for key in keys]

    def values(self, keys: Sequence[Quantity]) -> list[Any]:
        """The quantities themselves, (n,)."""
        return self.poses.values(list(keys))

    def _formulas(self, dimensions: tuple[Dimension, ...]) -> VariedFormulas:
        if dimensions not in self._written:
            own = {d.where[-1] for d in dimensions if d.where[0] == "inputs"}
            moves = tuple(
                any(np.any(rate) for rate in rates) or rate in own
                for rate, rates in zip(list(ENTERS)[1:], self.poses.rates, strict=True)
            )
            inner = [d for d in dimensions if d.where[0] != "inputs"]
            # which signs change on the way is known once the way was looked over
            self.poses.cover()
            self._written[dimensions] = VariedFormulas(
                self.assembly, inner, moves, own_signs=False, settled=False
            )
        return self._written[dimensions]

    def _refuse(self, keys: Sequence[Quantity], written: VariedFormulas) -> None:
        m = self.assembly.mechanism
        if not written.placed:
            raise MechanismError(
                "sensitivity: the phase of a gear depends on links that have to be placed first"
            )
        if self.assembly.folded:
            raise MechanismError("sensitivity: the mechanism is singular in every pose")
        if any(key.is_force for key in keys):
            if m.friction:
                raise MechanismError("sensitivity: forces with friction are not differentiated")
            if any(key.is_joint_force for key in keys) and written.recording.forces.redundant:
                raise MechanismError("sensitivity: redundant joint forces are not differentiated")


def _moved(tape: Tape, entering: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the change of the outputs of a tape, (n,), by the rounding of every input and of its constants."""
    inputs = dict(entering)
    operations: list[Operation] = []
    for kind, *arguments in tape.operations:
        if kind == "const" and not (arguments[0] * 1024).is_integer():
            kind, arguments = "input", [f"constant {len(operations)}"]
            inputs[arguments[0]] = float(tape.operations[len(operations)][1])
        operations.append((kind, *arguments))
    n = len(next(iter(values.values())))
    # a block of lanes for each number, in which that one is moved
    lanes = {}
    for i, (name, x) in enumerate(inputs.items()):
        lanes[name] = np.tile(np.broadcast_to(x, n), (len(inputs), 1))
        lanes[name][i] *= 1 + NUDGE
        lanes[name] = lanes[name].ravel()
    moved = run(Tape(tuple(operations), tape.outputs), lanes)
    return {
        name: OFF
        / NUDGE
        * np.abs(np.reshape(np.broadcast_to(moved[name], n * len(inputs)), (-1, n)) - x).sum(axis=0)
        for name, x in values.items()
    }
