"""Bounds of a tape's own rounding errors, from one sweep backwards over it.

With the adjoint v̄ = ∂y/∂v of every operation v of an output y (`adjoint`), the rounding error of y is to first order
Σ v̄·δ_v with |δ_v| ≤ r·u·2^e, 2^e ≤ |v| < 2^(e+1), u = 2⁻⁵³: half a unit in the last place, r times (N. J. Higham,
Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM 2002, §2.1 and §3.1). Ways of one rounding to the result
over several paths cancel here as they do in truth, which a running bound cannot see. The bounds are a tape again and run
on every engine; for a few lanes the sweep is done on numbers.

What a factor adds to the error, u·|a|, is what its product adds, ā·a = v̄·v for v = a·b, if it is used nowhere else;
and the terms of a sum share its adjoint. So the sum over v is one over far fewer adjoints, Σ |v̄|·S, and the sums S of
sizes are the same for many outputs (`_Pattern`).

A root of what may cancel is not smooth where its argument a is no more than the argument's own error κ. There the
first order is not enough. The true argument is within κ of a, and that of the engine whose answer is judged within κ of
the true one: no step between the two is steeper than the chord from a to a − 3κ, which has it in its middle. That is the
root's slope here. Where a < 3κ it is 4/√κ: the sign of √a may be the other then, and √3κ + √4κ < 4√κ.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from math import frexp
from typing import Any, NamedTuple

import numpy as np

from dalembert.arithmetic.adjoint import handed_on
from dalembert.arithmetic.arrays import NUMPY
from dalembert.arithmetic.recorded import RECORDED, Number, Recorder
from dalembert.arithmetic.tape import Kind, Operation, Tape, reached

UNIT_ROUNDOFF = 2.0**-53
CONSTANT = 1.0
"""A constant such as 0.4 errs by one rounding."""

ROUNDINGS: Mapping[str, float] = {
    "add": 1.0,
    "sub": 1.0,
    "mul": 1.0,
    "div": 1.0,
    "sqrt": 1.0,
    # two units in the last place are at most four roundings
    "sin": 4.0,
    "cos": 4.0,
    "atan2": 4.0,
}
"""How many roundings, half a unit in the last place each, an operation errs by, at most; what is not named is exact."""


def rounding_bounds(
    tape: Tape,
    inputs: Mapping[str, str] | None = None,
    of: Iterable[str] | None = None,
    constants: float = 0.0,
) -> Tape:
    """The tape of bounds of the outputs' own rounding errors, to first order.

    Parameters
    ----------
    tape : Tape
    inputs : mapping of an input to the name of a further input, its absolute error
        Inputs are exact where not named.
    of : names of outputs; all where not given
    constants : float
        How many roundings a constant errs by; short ones, as 3 or 0.25, are exact.

    Returns
    -------
    Tape
        The outputs themselves and the bounds, `error(output)`.

    Examples
    --------
    (1 − cos q)/q² near 0 loses digits: at q = 1e-4 the bound says that half of them are left.

    >>> from dalembert.arithmetic.engines import run
    >>> recorder = Recorder()
    >>> q = recorder.input("q")
    >>> tape = recorder.tape({"y": (1.0 - RECORDED.cos(q)) / (q * q)})
    >>> value, bound = run(tape, {"q": 1e-4})["y"], run(rounding_bounds(tape), {"q": 1e-4})["error(y)"]
    >>> bool(abs(value - (0.5 - 1e-8 / 24)) < bound < 1e-7)
    True
    """
    recorder = Recorder()
    given = {name: recorder.input(name) for name in tape.inputs}
    errors = {name: recorder.input(other) for name, other in (inputs or {}).items()}
    return recorder.tape(_Bounds(tape, given, RECORDED, errors, constants).of(of))


def bounds_of_few(
    tape: Tape,
    given: Mapping[str, Any],
    inputs: Mapping[str, str],
    of: Iterable[str],
    constants: float = 0.0,
) -> dict[str, Any]:
    """The same for a few lanes, on numbers, without writing it down."""
    arrays = {name: np.asarray(value, dtype=float) for name, value in given.items()}

    def results(numbers: Mapping[str, Any], kind: Kind) -> dict[str, Any]:
        errors = {name: numbers[other] for name, other in inputs.items()}
        return _Bounds(tape, numbers, kind, errors, constants).of(of)

    if all(array.size == 1 for array in arrays.values()):
        # one pose: nothing of numpy, but at a singular place, where its numbers go on with infinity and NaN
        try:
            return results({name: array.item() for name, array in arrays.items()}, RECORDED)
        except (ZeroDivisionError, ValueError, OverflowError):
            pass
    with np.errstate(all="ignore"):
        return results({name: array[()] for name, array in arrays.items()}, NUMPY)


class _Bounds:
    """Σ |v̄|·(what v errs by) over a tape worked out on any kind of number."""

    def __init__(
        self,
        tape: Tape,
        inputs: Mapping[str, Any],
        kind: Kind,
        errors: Mapping[str, Number],
        constants: float,
    ) -> None:
        self.tape, self.kind, self.errors = tape, kind, errors
        self.constants = constants
        self.values = tape.values(inputs, kind)
        # the slopes of roots that are no derivatives
        self.slopes: dict[int, Number] = {}
        self._sums: dict[tuple[Term, ...], Number] = {}
        self._own: dict[int, Number] = {}
        self._errors: dict[int, Number] = {}

    def of(self, names: Iterable[str] | None) -> dict[str, Number]:
        """The outputs, and the bounds of some."""
        tape = self.tape
        wanted = set(tape.names if names is None else names)
        roots = [
            (number, arguments[0])
            for number, (name, *arguments) in enumerate(tape.operations)
            if name == "sqrt" and not _norm(tape, arguments[0])
        ]
        needed = set(reached(tape.operations, [number for name, number in tape.outputs if name in wanted]))
        for number, argument in roots:
            if number in needed:
                self._root(number, argument)
        results: dict[str, Number] = {}
        for name, number in tape.outputs:
            results[name] = self.values[number]
            if name in wanted:
                results[f"error({name})"] = self.error(number)
        return results

    def error(self, output: int) -> Number:
        """The bound of one operation's value, formed once: outputs may be one, as entries of a symmetric matrix are."""
        if output not in self._errors:
            self._errors[output] = self._error(output)
        return self._errors[output]

    def _error(self, output: int) -> Number:
        kind, *arguments = self.tape.operations[output]
        if kind in ("const", "input"):
            return self.errors.get(arguments[0], 0.0)
        pattern = _pattern(self.tape, output, frozenset(self.errors), frozenset(self.slopes), self.constants)
        operations, values = self.tape.operations, self.values
        bars: dict[int, Number] = {output: 1.0}
        for number in pattern.swept:
            kind, *arguments = operations[number]
            own, operands = bars[number], [values[a] for a in arguments]
            for i, a in enumerate(arguments):
                if a not in pattern.needed or (kind == "select" and i == 0):
                    continue
                if number in self.slopes:
                    moved = own * self.slopes[number]
                else:
                    moved = handed_on(self.kind, kind, i, own, operands, values[number])
                bars[a] = moved if a not in bars else bars[a] + moved
        total: Number = 0.0
        for number, terms in pattern.sums:
            size, bar = self._sum(terms), abs(bars[number])
            if not (isinstance(size, float) and size == 0):
                total = total + (size if isinstance(bar, float) and bar == 1 else bar * size)
        # the bound's own roundings, and the products of two of them that the first order leaves out
        return total * (UNIT_ROUNDOFF * (1 + 2.0**-20))

    def _sum(self, terms: tuple[Term, ...]) -> Number:
        """What operations with one adjoint err by together, in units u: so many times their sizes, or by themselves."""
        if terms not in self._sums:
            total: Number = 0.0
            for number, times_size, own in terms:
                if not times_size:
                    part = self._alone(number)
                else:
                    # what is rounded to nearest errs by half a unit in its last place, by its size less than that
                    part = self.kind.binade(self.values[number]) if own else abs(self.values[number])
                    part = part if times_size == 1 else part * times_size
                total = total + part
            self._sums[terms] = total
        return self._sums[terms]

    def _alone(self, number: int) -> Number:
        """What an operation errs by, in units u, where that is no multiple of its size."""
        if number not in self._own:
            name, *arguments = self.tape.operations[number]
            operations = self.tape.operations
            if name == "input":
                bound: Number = abs(self.errors[arguments[0]] * (1 / UNIT_ROUNDOFF))
            elif name in ("sin", "cos"):
                bound = self.kind.binade(self.values[number]) * ROUNDINGS[name]
            else:
                constant = next(operations[a][1] for a in arguments if operations[a][0] == "const")
                bound = abs(self.values[number]) + self.constants * abs(constant)
            self._own[number] = bound
        return self._own[number]

    def _root(self, number: int, argument: int) -> None:
        kind, a = self.kind, self.values[argument]
        error = self.error(argument)
        if isinstance(error, float) and error == 0:
            return
        apart = a - 3.0 * error
        chord = 1.0 / (self.values[number] + kind.sqrt(kind.select(apart, apart, 0.0)))
        self.slopes[number] = kind.select(apart, chord, 4.0 / kind.sqrt(error))


Term = tuple[int, float, bool]


class _Pattern(NamedTuple):
    """What a sweep from one output forms.

    Attributes
    ----------
    swept : tuple of int
        The operations whose adjoints go on to their arguments, from the last to the first.
    needed : frozenset of int
        Those that have an adjoint.
    sums : tuple of (number, terms)
        The operations that err with the adjoint of `number`, by its size: each with how many roundings of its size it
        stands for, its own and those of its factors, and whether they are its own alone; 0 where it errs by what its
        size does not tell.
    """

    swept: tuple[int, ...]
    needed: frozenset[int]
    sums: tuple[tuple[int, tuple[Term, ...]], ...]


@lru_cache(maxsize=1024)
def _pattern(
    tape: Tape, output: int, errors: frozenset[str], rough: frozenset[int], constants: float
) -> _Pattern:
    """The pattern of a sweep; `rough` are the roots whose slope is no derivative."""
    operations = tape.operations
    uses: dict[int, list[int]] = {output: []}
    # which operation says how much one errs, and how many times its own error counts there
    share: dict[int, tuple[int, float]] = {}
    adjoint: dict[int, int] = {}
    roundings: dict[int, float] = {}
    alone: set[int] = set()
    # those that stand for others besides
    further: set[int] = set()
    for number in range(output, -1, -1):
        if number not in uses:
            continue
        kind, *arguments = operations[number]
        users = uses[number]
        user = users[0] if len(set(users)) == 1 else None
        weight = 0.0 if user is None else _weight(operations[user], user, len(users), rough)
        share[number] = (
            (share[user][0], weight * share[user][1]) if user is not None and weight else (number, 1.0)
        )
        passed = user is not None and len(users) == 1 and operations[user][0] in ("add", "sub", "neg", "abs")
        adjoint[number] = adjoint[user] if user is not None and passed else number
        if kind == "input":
            if arguments[0] in errors:
                alone.add(number)
            continue
        if kind == "const":
            continue
        own = _roundings(tape, number, constants)
        if own is None:
            alone.add(number)
        elif own:
            at, times_own = share[number]
            roundings[at] = roundings.get(at, 0.0) + own * times_own
            if at != number or own > ROUNDINGS[kind]:
                further.add(at)
        for i, a in enumerate(arguments):
            if operations[a][0] != "const" and not (kind == "select" and i == 0):
                uses.setdefault(a, []).append(number)
    needed: set[int] = set()
    for number in sorted(uses):
        kind, *arguments = operations[number]
        if (
            number in roundings
            or number in alone
            or (kind not in ("const", "input") and not needed.isdisjoint(arguments[kind == "select" :]))
        ):
            needed.add(number)
    needed.add(output)
    sums: dict[int, list[Term]] = {}
    for number in sorted(needed):
        if number in roundings:
            sums.setdefault(adjoint[number], []).append((number, roundings[number], number not in further))
        if number in alone:
            sums.setdefault(adjoint[number], []).append((number, 0.0, False))
    swept = tuple(n for n in sorted(needed, reverse=True) if operations[n][0] not in ("const", "input"))
    return _Pattern(swept, frozenset(needed), tuple((n, tuple(terms)) for n, terms in sums.items()))


def _weight(operation: Operation, user: int, count: int, rough: frozenset[int]) -> float:
    """How often the error of an argument counts in that of its only user, relative to their sizes; 0: not so simply."""
    kind, *_ = operation
    if kind == "mul" or (kind in ("neg", "abs", "div") and count == 1):
        return float(count)
    return 0.5 if kind == "sqrt" and user not in rough else 0.0


def _roundings(tape: Tape, number: int, constants: float) -> float | None:
    """By how many roundings of its own size an operation errs; None where its size does not tell."""
    name, *arguments = tape.operations[number]
    if name not in ROUNDINGS:
        return 0.0
    if name in ("sin", "cos"):
        return None
    if name == "add" and arguments[0] == arguments[1]:
        return 0.0
    constant = next((tape.operations[a][1] for a in arguments if tape.operations[a][0] == "const"), None)
    if name == "mul" and constant is not None and abs(frexp(constant)[0]) == 0.5:
        # by a power of two
        return 0.0
    further = bool(constants) and constant is not None and not (constant * 1024).is_integer()
    if further and name in ("add", "sub"):
        return None
    return ROUNDINGS[name] + (constants if further and name in ("mul", "div") else 0.0)


def _norm(tape: Tape, number: int) -> bool:
    """Whether it is a sum of squares, which does not cancel."""
    kind, *arguments = tape.operations[number]
    if kind == "add":
        return all(_norm(tape, a) for a in arguments)
    return kind == "mul" and arguments[0] == arguments[1]
