"""What one sweep backwards over a tape gives: derivatives to its inputs, and bounds of its own rounding errors.

With the adjoint v̄ = ∂y/∂v of every operation v of an output y (A. Griewank, A. Walther, Evaluating Derivatives,
2nd ed., SIAM 2008, §3.2), the derivative to an input is its adjoint, and the rounding error of y is to first order
Σ v̄·δ_v with |δ_v| ≤ r·u·|v|, u = 2⁻⁵³ (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed.,
SIAM 2002, §3.1). Ways of one rounding to the result over several paths cancel here as they do in truth, which a
running bound cannot see. Both are tapes again and run on every engine; for a few lanes the sweep is done on numbers.

A root of what may cancel is not smooth where its argument a is no more than the argument's own error κ. There the
first order is not enough: the slope 1/2√a is taken as that of the chord to a − κ, and where that is negative as 2/√κ,
for √a errs by √κ then, and its sign may be the other. What hangs on 1/√a needs τ = κ/2a too, the share of the second
order in the first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from math import frexp
from typing import Any

import numpy as np

from dalembert.arithmetic.arrays import NUMPY
from dalembert.arithmetic.recorded import RECORDED, Number, Recorder
from dalembert.arithmetic.tape import Kind, Tape

UNIT_ROUNDOFF = 2.0**-53
# lanes up to which a sweep on numbers costs less than writing it down; a tape has to be compiled besides
FEW = 4096

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
"""How many roundings u·|value| an operation errs by, at most; what is not named here is exact."""

Partial = Callable[[Kind, list[Number], Number], Number]


def _both_squared(a: list[Number]) -> Number:
    return a[0] * a[0] + a[1] * a[1]


PARTIALS: Mapping[str, Sequence[Partial]] = {
    "add": (lambda kind, a, v: 1.0, lambda kind, a, v: 1.0),
    "sub": (lambda kind, a, v: 1.0, lambda kind, a, v: -1.0),
    "mul": (lambda kind, a, v: a[1], lambda kind, a, v: a[0]),
    "div": (lambda kind, a, v: 1.0 / a[1], lambda kind, a, v: -(v / a[1])),
    "neg": (lambda kind, a, v: -1.0,),
    "abs": (lambda kind, a, v: kind.select(a[0], 1.0, -1.0),),
    "sqrt": (lambda kind, a, v: 0.5 / v,),
    "sin": (lambda kind, a, v: kind.cos(a[0]),),
    "cos": (lambda kind, a, v: -kind.sin(a[0]),),
    "atan2": (
        lambda kind, a, v: a[1] / _both_squared(a),
        lambda kind, a, v: -(a[0] / _both_squared(a)),
    ),
}
"""∂v/∂argument of each kind of operation, from its arguments and its own value v; a select hands its own on."""


class _Sweep:
    """A tape worked out on any kind of number, with the values of its operations at hand."""

    def __init__(self, tape: Tape, inputs: Mapping[str, Any], kind: Kind) -> None:
        self.tape, self.kind = tape, kind
        self.values = tape.values(inputs, kind)
        # the slopes of roots that are no derivatives
        self.slopes: dict[int, Number] = {}

    def adjoints(self, output: int) -> Iterator[tuple[int, Number]]:
        """v̄ of every operation and input that the output hangs on, from the last to the first."""
        operations = self.tape.operations
        bar: dict[int, Number] = {output: 1.0}
        for number in range(output, -1, -1):
            if number not in bar:
                continue
            own = bar.pop(number)
            yield number, own
            kind, *arguments = operations[number]
            if kind in ("const", "input"):
                continue
            given = [self.values[a] for a in arguments]
            for i, a in enumerate(arguments):
                if operations[a][0] == "const" or (kind == "select" and i == 0):
                    continue
                if kind == "select":
                    share = (own, 0.0) if i == 1 else (0.0, own)
                    moved = self.kind.select(given[0], *share)
                elif number in self.slopes:
                    moved = own * self.slopes[number]
                else:
                    moved = _times(own, PARTIALS[kind][i](self.kind, given, self.values[number]))
                bar[a] = moved if a not in bar else bar[a] + moved


def _times(own: Number, partial: Number) -> Number:
    if isinstance(partial, float) and abs(partial) == 1.0:
        return own if partial > 0 else -own
    if isinstance(own, float) and own == 1.0:
        return partial
    return own * partial


def derivatives(tape: Tape, to: Iterable[str], of: Iterable[str] | None = None) -> Tape:
    """The tape of exact derivatives of outputs to inputs.

    Parameters
    ----------
    tape : Tape
    to : names of inputs
    of : names of outputs; all where not given

    Returns
    -------
    Tape
        Its outputs are named `d(output)/d(input)`.

    Raises
    ------
    KeyError
        Where a name is not on the tape.

    Examples
    --------
    >>> recorder = Recorder()
    >>> r, q = recorder.input("r"), recorder.input("q")
    >>> slope = derivatives(recorder.tape({"x": r * RECORDED.cos(q)}), to=["r", "q"])
    >>> print(slope)
    r
    q
    v2 = cos(q)
    v3 = sin(q)
    v4 = r * v3
    v5 = -v4
    d(x)/d(r): v2
    d(x)/d(q): v5
    """
    recorder, wanted = Recorder(), list(to)
    sweep = _Sweep(tape, {name: recorder.input(name) for name in tape.inputs}, RECORDED)
    known = dict(tape.outputs)
    place = {name: number for number, (kind, name, *_) in enumerate(tape.operations) if kind == "input"}
    found: dict[str, Number] = {}
    for name in tape.names if of is None else of:
        bar = {
            number: own
            for number, own in sweep.adjoints(known[name])
            if tape.operations[number][0] == "input"
        }
        for variable in wanted:
            found[f"d({name})/d({variable})"] = bar.get(place[variable], 0.0)
    return recorder.tape(found)


def rounding_bounds(
    tape: Tape,
    inputs: Mapping[str, str] | None = None,
    of: Iterable[str] | None = None,
    constants: float = 0.0,
    turned: float = 0.0,
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
    turned : float
        By how many units u the sine and cosine of an input err besides.

    Returns
    -------
    Tape
        The outputs themselves, the bounds, `error(output)`, and `tau`, the largest share of the second order in the
        first, of the roots that they hang on.

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
    sweep = _Sweep(tape, {name: recorder.input(name) for name in tape.inputs}, RECORDED)
    errors = {name: recorder.input(other) for name, other in (inputs or {}).items()}
    return recorder.tape(_Bounds(sweep, errors, constants, turned).of(of))


def bounds_of_few(
    tape: Tape,
    given: Mapping[str, Any],
    inputs: Mapping[str, str],
    of: Iterable[str],
    constants: float = 0.0,
    turned: float = 0.0,
) -> dict[str, Any]:
    """The same for a few lanes, on numbers, without writing it down."""
    arrays = {name: np.asarray(value, dtype=float) for name, value in given.items()}

    def found(numbers: Mapping[str, Any], kind: Kind) -> dict[str, Any]:
        errors = {name: numbers[other] for name, other in inputs.items()}
        return _Bounds(_Sweep(tape, numbers, kind), errors, constants, turned).of(of)

    if all(array.size == 1 for array in arrays.values()):
        # one pose: nothing of numpy, but at a singular place, where its numbers go on with infinity and NaN
        try:
            return found({name: array.item() for name, array in arrays.items()}, RECORDED)
        except (ZeroDivisionError, ValueError, OverflowError):
            pass
    with np.errstate(all="ignore"):
        return found({name: array[()] for name, array in arrays.items()}, NUMPY)


class _Bounds:
    """Σ |v̄|·(what v errs by) over a sweep."""

    def __init__(self, sweep: _Sweep, errors: Mapping[str, Number], constants: float, turned: float) -> None:
        self.sweep, self.constants, self.turned = sweep, constants, turned
        self.errors = errors
        self._own: dict[int, Number] = {}
        # τ of roots
        self.shares: dict[int, Number] = {}

    def of(self, names: Iterable[str] | None) -> dict[str, Number]:
        """The outputs, the bounds of some, and τ."""
        tape, kind = self.sweep.tape, self.sweep.kind
        wanted = set(tape.names if names is None else names)
        needed = _needed(tape, wanted)
        for number, (name, *arguments) in enumerate(tape.operations):
            if name == "sqrt" and needed[number] and not _norm(tape, arguments[0]):
                self._root(number, arguments[0])
        found: dict[str, Number] = {}
        # outputs may be one operation, as entries of a symmetric matrix are
        known: dict[int, Number] = {}
        for name, number in tape.outputs:
            found[name] = self.sweep.values[number]
            if name in wanted:
                if number not in known:
                    known[number] = self.error(number)
                found[f"error({name})"] = known[number]
        largest: Number = 0.0
        for share in self.shares.values():
            # what is no number counts as none: the bound is none either
            largest = kind.select(share - largest, share, largest)
        return found | {"tau": largest}

    def error(self, output: int) -> Number:
        """The bound of one operation's value."""
        total: Number = 0.0
        for number, bar in self.sweep.adjoints(output):
            if number not in self._own:
                self._own[number] = self._errs_by(number)
            own = self._own[number]
            if isinstance(own, float) and own == 0:
                continue
            part = abs(_times(bar, own))
            total = part if isinstance(total, float) and total == 0 else total + part
        # the bound's own roundings, and the products of two of them that the first order leaves out
        return total * (UNIT_ROUNDOFF * (1 + 2.0**-20))

    def _root(self, number: int, argument: int) -> None:
        kind, a = self.sweep.kind, self.sweep.values[argument]
        error = self.error(argument)
        if isinstance(error, float) and error == 0:
            return
        apart = a - error
        chord = 1.0 / (self.sweep.values[number] + kind.sqrt(kind.select(apart, apart, 0.0)))
        self.sweep.slopes[number] = kind.select(apart, chord, 2.0 / kind.sqrt(error))
        self.shares[number] = 0.5 * error / a

    def _errs_by(self, number: int) -> Number:
        """What an operation adds to the error, in units u; of either sign."""
        name, *arguments = self.sweep.tape.operations[number]
        if name == "input":
            error = self.errors.get(arguments[0])
            return 0.0 if error is None else error * (1 / UNIT_ROUNDOFF)
        if name not in ROUNDINGS:
            return 0.0
        operations, roundings = self.sweep.tape.operations, ROUNDINGS[name]
        constant = next((operations[a][1] for a in arguments if operations[a][0] == "const"), None)
        further = 0.0
        if constant is not None:
            if name == "mul" and abs(frexp(constant)[0]) == 0.5:
                # by a power of two
                return 0.0
            if (constant * 1024).is_integer():
                constant = None
        if constant is not None and name in ("mul", "div"):
            roundings += self.constants
        elif constant is not None and name in ("add", "sub"):
            further = self.constants * abs(constant)
        elif name in ("sin", "cos") and operations[arguments[0]][0] == "input":
            further = self.turned
        size = self.sweep.values[number]
        if name in ("sin", "cos"):
            # next to 1 they have no more than half as many
            size = abs(size) * roundings
            size = self.sweep.kind.select(size - 2.0, 2.0, size)
        elif roundings != 1.0:
            size = size * roundings
        return abs(size) + further if further else size


def _needed(tape: Tape, names: set[str]) -> list[bool]:
    """Which operations some outputs hang on."""
    found = [False] * len(tape.operations)
    for name, number in tape.outputs:
        found[number] |= name in names
    for number in range(len(found) - 1, -1, -1):
        kind, *arguments = tape.operations[number]
        if found[number] and kind not in ("const", "input"):
            for a in arguments:
                found[a] = True
    return found


def _norm(tape: Tape, number: int) -> bool:
    """Whether it is a sum of squares, which does not cancel."""
    kind, *arguments = tape.operations[number]
    if kind == "add":
        return all(_norm(tape, a) for a in arguments)
    return kind == "mul" and arguments[0] == arguments[1]
