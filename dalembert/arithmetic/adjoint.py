"""What one sweep backwards over a tape gives: derivatives to its inputs, and bounds of its own rounding errors.

With the adjoint v̄ = ∂y/∂v of every operation v of an output y (A. Griewank, A. Walther, Evaluating Derivatives,
2nd ed., SIAM 2008, §3.2), the derivative to an input is its adjoint, and the rounding error of y is to first order
Σ v̄·δ_v with |δ_v| ≤ r·u·|v|, u = 2⁻⁵³ (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed.,
SIAM 2002, §3.1). Ways of one rounding to the result over several paths cancel here as they do in truth, which a
running bound cannot see. Both are tapes again and run on every engine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from dalembert.arithmetic.recorded import RECORDED, Number, Real, Recorder
from dalembert.arithmetic.tape import Tape

UNIT_ROUNDOFF = 2.0**-53

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


def _sign(x: Number) -> Number:
    return RECORDED.select(x, 1.0, -1.0)


def _atan2(y: Number, x: Number, _: Number) -> list[Number]:
    inverse = 1.0 / (x * x + y * y)
    return [x * inverse, -(y * inverse)]


PARTIALS: Mapping[str, Callable[..., Sequence[Number]]] = {
    "add": lambda a, b, v: (1.0, 1.0),
    "sub": lambda a, b, v: (1.0, -1.0),
    "mul": lambda a, b, v: (b, a),
    "div": lambda a, b, v: (1.0 / b, -(v / b)),
    "neg": lambda a, v: (-1.0,),
    "abs": lambda a, v: (_sign(a),),
    "sqrt": lambda a, v: (0.5 / v,),
    "sin": lambda a, v: (RECORDED.cos(a),),
    "cos": lambda a, v: (-RECORDED.sin(a),),
    "atan2": _atan2,
    "select": lambda t, a, b, v: (0.0, RECORDED.select(t, 1.0, 0.0), RECORDED.select(t, 0.0, 1.0)),
}
"""∂v/∂argument of each kind of operation, from its arguments and its own value v."""


class _Replay:
    """A tape written down again, with the values of its operations at hand."""

    def __init__(self, tape: Tape) -> None:
        self.tape, self.recorder = tape, Recorder()
        self.inputs = {name: self.recorder.input(name) for name in tape.inputs}
        self.values = tape.values(self.inputs, RECORDED)

    def adjoints(self, output: int) -> dict[int, Number]:
        """v̄ of every operation that the output hangs on."""
        bar: dict[int, Number] = {output: 1.0}
        for number in range(output, -1, -1):
            kind, *arguments = self.tape.operations[number]
            if number not in bar or kind in ("const", "input"):
                continue
            if not any(isinstance(self.values[a], Real) for a in arguments):
                continue
            own = bar[number]
            partials = PARTIALS[kind](*(self.values[a] for a in arguments), self.values[number])
            for a, partial in zip(arguments, partials, strict=True):
                bar[a] = bar.get(a, 0.0) + own * partial
        return bar


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
    replay, wanted = _Replay(tape), list(to)
    known = dict(tape.outputs)
    place = {name: number for number, (kind, name, *_) in enumerate(tape.operations) if kind == "input"}
    found: dict[str, Number] = {}
    for name in tape.names if of is None else of:
        bar = replay.adjoints(known[name])
        for variable in wanted:
            found[f"d({name})/d({variable})"] = bar.get(place[variable], 0.0)
    return replay.recorder.tape(found)


def rounding_bounds(tape: Tape, inputs: Mapping[str, str] | None = None) -> Tape:
    """The tape of bounds of the outputs' own rounding errors, to first order.

    Parameters
    ----------
    tape : Tape
    inputs : mapping of an input to the name of a further input, its absolute error
        Inputs are exact where not named.

    Returns
    -------
    Tape
        Its outputs are named `error(output)`.

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
    replay = _Replay(tape)
    errors = {name: replay.recorder.input(other) for name, other in (inputs or {}).items()}
    own: dict[int, Number] = {}
    for number, (kind, *arguments) in enumerate(tape.operations):
        value = replay.values[number]
        if kind == "input" and arguments[0] in errors:
            own[number] = errors[arguments[0]] / UNIT_ROUNDOFF
        elif kind in ROUNDINGS and isinstance(value, Real) and not _exact(kind, replay.values, arguments):
            own[number] = abs(value) * ROUNDINGS[kind]
    found: dict[str, Number] = {}
    for name, output in tape.outputs:
        total: Number = 0.0
        for number, bar in replay.adjoints(output).items():
            if number in own:
                total = total + abs(bar) * own[number]
        # the bound's own roundings, and the products of two of them that the first order leaves out
        found[f"error({name})"] = total * (UNIT_ROUNDOFF * (1 + 2.0**-20))
    return replay.recorder.tape(found)


def _exact(kind: str, values: list[Any], arguments: list[int]) -> bool:
    """A product with a power of two is not rounded."""
    powers = (2.0, 4.0, 8.0, 0.5, 0.25, 0.125)
    return kind == "mul" and any(isinstance(values[a], float) and values[a] in powers for a in arguments)
