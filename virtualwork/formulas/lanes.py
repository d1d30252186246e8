"""Quantities of many poses, or of one, from the tape: each pose is a lane.

What is wanted is written down once for an assembly (`recording`), pruned, and run by the engine that suits the count of
poses. What a tape does not solve enters it (`solving`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dalembert.arithmetic.choice import wanted
from dalembert.arithmetic.engines import as_part, run
from dalembert.arithmetic.guard import guarded
from virtualwork.formulas.forces import Effort, Force, Generalized
from virtualwork.formulas.numbers import leave_out
from virtualwork.formulas.quantity import Quantity
from virtualwork.formulas.solving import Solving, is_closed
from virtualwork.formulas.tapes import cut, ready, taped
from virtualwork.plan.steps import Step

if TYPE_CHECKING:
    from virtualwork.formulas.dynamics import Dynamics

# poses from which on a second request brings all of its kind, and how many times the operations of those requested
MANY_POSES, WASTE = 10_000, 4
# requests of one pose from which on the tape pays
OFTEN = 50


@guarded
class Lanes(Solving):
    """Poses of an assembly whose quantities come from the tape.

    Parameters are those of `Poses`.
    """

    def _begin(self) -> None:
        super()._begin()
        self.known: dict[Quantity, Any] = {}
        # which quantities of one pose come from the tape
        self._taped: dict[Quantity, bool] = {}
        # values of operations for later requests, by their numbers
        self._kept: dict[int, Any] = {}
        # what was requested, and of which kinds and orders
        self.requested: dict[Quantity, None] = {}
        self._families: set[tuple[type[Quantity], int]] = set()
        self._repeated = False

    @property
    def solved(self) -> list[tuple[Step, int]]:
        """What has been worked out so far, (step, order); order 0 is position."""
        result = {(id(step), k): (step, k) for step, k in self._solved}
        for steps, order in (key.steps(self.recording) for key in self.known):
            result |= {(id(step), k): (step, k) for k in range(order + 1) for step in steps}
        return list(result.values())

    def takes(self, keys: Iterable[Quantity]) -> bool:
        """Whether the tape alone has these quantities, and nothing is solved for it outside but groups without a closed form."""
        return not self.enters and self.recording.takes(keys)

    def operations(self, keys: Iterable[Quantity]) -> int:
        """What quantities of a pose cost, in operations on real numbers, with all that they depend on."""
        return taped(self.branch, self.recording, tuple(keys)).cost

    def values(self, keys: Sequence[Quantity], forces: Callable[[], Dynamics] | None = None) -> list[Any]:
        """The quantities, each (n,), real or complex, in arrays of the caller's own.

        Of many poses they come from the tape, of one from the formulas on floats. One pose that is requested often comes from the
        tape too, as a function of floats; its forces from what `forces` gives.
        """
        new = tuple([key for key in keys if key not in self._taped])
        self.requested |= dict.fromkeys(keys)
        if new and not self.many and not wanted():
            self._taped |= dict.fromkeys(new, self._often(new) and self.one(new))
        elif new:
            new = self._foreseen(new)
            if self.many or not self.one(new):
                self._fill(new)
            # not before: the quantity of a table is requested on the way, and may be among these
            self._taped |= dict.fromkeys(new, True)
        # what was handed out once stays as it is, to its last digit
        without = [key for key in keys if not self._taped[key]]
        known = self.known | self._alone(without, forces) if without else self.known
        return [known[key] if self.once else known[key].copy() for key in keys]

    def _foreseen(self, keys: tuple[Quantity, ...]) -> tuple[Quantity, ...]:
        """What a request is answered with: the second of a kind and order over very many poses brings all of them.

        One tape for all is cheaper than one for each; what nobody asks for twice is not computed.
        """
        kinds = {key.family for key in keys}
        self._repeated = self._repeated or not kinds.isdisjoint(self._families)
        self._families |= kinds
        if len(kinds) > 1 or not self._repeated or self.n < MANY_POSES:
            return keys
        ((kind, order),) = kinds
        more = [key for key in kind.every(self.mechanism, order) if key not in self.known]
        if set(more).issubset(keys):
            return keys
        spent = self.operations([*keys, *(key for key in self.known if key.family in kinds)])
        if self.operations([*keys, *more]) > WASTE * spent:
            return keys
        return tuple(dict.fromkeys((*keys, *more)))

    def taped(self, keys: Sequence[Quantity]) -> list[Any]:
        """Quantities from the tape, of one pose too."""
        new = tuple(key for key in keys if key not in self.known)
        if new:
            self._fill(new)
        return [self.known[key].copy() for key in keys]

    def _often(self, keys: tuple[Quantity, ...]) -> bool:
        """Whether requests of one pose are so many that writing the tape pays, which takes some milliseconds."""
        counts = self.branch.recordings.setdefault("requests", {})
        counts[keys] = counts.get(keys, 0) + 1
        return bool(counts[keys] > OFTEN)

    def _fill(self, keys: tuple[Quantity, ...]) -> None:
        # a part of a sweep has the digits of the whole
        if self.block_of:
            as_part(self.block_of, self._run, list(keys))
        else:
            self._run(list(keys))

    def _alone(self, keys: Sequence[Quantity], forces: Callable[[], Dynamics] | None) -> dict[Quantity, Any]:
        """Quantities of one pose by the formulas on floats."""
        loaded = [key for key in keys if isinstance(key, Force)]
        moving = [key for key in keys if not isinstance(key, Force)]
        try:
            result = dict(zip(moving, self.by_floats(moving), strict=True))
        except (ZeroDivisionError, OverflowError):
            # a singular pose
            result = dict(zip(moving, self.taped(moving), strict=True))
        if loaded:
            of = _dynamics_of(self) if forces is None else forces()
            result |= {key: of.value(key) for key in loaded}
        if self._nowhere is not None:
            for value in result.values():
                leave_out(value, self._nowhere)
        return result

    def one(self, keys: tuple[Quantity, ...]) -> bool:
        """Work out one pose that depends on nothing but its input, by a function of floats; False where it depends on more."""
        inputs = [self.inputs, *(rates[0] for rates in self.rates)]
        values = [x if isinstance(x, float) else float(np.ravel(x)[0]) for x in inputs]
        function = ready(self.branch, tuple(x != 0.0 for x in values[1:]), keys)
        if function is None or self._nowhere is not None:
            return False
        try:
            result = function(*values)
        except (ZeroDivisionError, ValueError, OverflowError):
            return False
        self.known.update((key, np.array([value])) for key, value in zip(keys, result, strict=True))
        return True

    def _run(self, keys: list[Quantity]) -> None:
        every = self._doubts(tuple(keys))
        doubts, opens = [key for key in every if key not in self._bad], any(map(is_closed, every))
        kept = self._kept
        known = frozenset(kept) if self.n > 1 and not self.once else None
        later = cut(self.branch, self.recording, (*keys, *doubts), known, not self.known)
        entering = self.entering(name for name in later.tape.inputs if name not in later.takes)
        entering |= {name: kept[number] for name, number in later.takes.items()}
        out = run(later.tape, entering, pairs=[key.names[0] for key in keys if key.is_vector])
        self._kept.update((number, out[name]) for name, number in later.leaves.items())
        for key in doubts:
            self._bad[key] = self._where_bad(key, out[key.names[0]])
        # what a table is over has been handed out
        new = [key for key in keys if key not in self.known]
        if len(new) < len(keys):
            keys, every = new, self._doubts(tuple(new))
        for key in keys:
            value = key.of_rows(out, self.n)
            for nowhere in (self._nowhere, *(map(self._bad.get, self._closed(key)) if opens else ())):
                if nowhere is not None:
                    leave_out(value, nowhere)
            self.known[key] = value
            if isinstance(key, Force) and key.is_rubbed and self.mechanism.friction:
                leave_out(self.known[key], self.locked)
            if self.enters and isinstance(key, Effort | Generalized):
                leave_out(self.known[key], self._too_fast(key.input))
        apart = self._apart_of([key for key in every if not is_closed(key)])
        if apart is not None:
            rows, again = apart
            again._run([key for key in keys if key not in again.known])
            for key in keys:
                self.known[key][rows] = again.known[key]


def _dynamics_of(poses: Lanes) -> Dynamics:
    # a dozen files: positions and rates do not load them
    from virtualwork.formulas.dynamics import Dynamics

    return Dynamics(poses)
