"""Exact derivatives: one sweep backwards over a tape gives those of an output to every input.

The adjoint v̄ = ∂y/∂v of every operation v of an output y (A. Griewank, A. Walther, Evaluating Derivatives, 2nd ed.,
SIAM 2008, §3.2) is written down as a tape again and runs on every engine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from dalembert.arithmetic.recorded import RECORDED, Number, Recorder
from dalembert.arithmetic.tape import Kind, Tape

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


def handed_on(kind: Kind, name: str, i: int, own: Number, operands: list[Number], value: Number) -> Number:
    """What an operation hands on of its adjoint to its i-th argument; its derivative is often 1 or −1."""
    if name == "select":
        return kind.select(operands[0], *((own, 0.0) if i == 1 else (0.0, own)))
    partial = PARTIALS[name][i](kind, operands, value)
    if isinstance(partial, float) and abs(partial) == 1.0:
        return own if partial > 0 else -own
    return partial if isinstance(own, float) and own == 1.0 else own * partial


def _adjoints(tape: Tape, values: list[Number], output: int) -> dict[str, Number]:
    """v̄ of every input that the output depends on, by its name."""
    bar: dict[int, Number] = {output: 1.0}
    adjoints: dict[str, Number] = {}
    for number in range(output, -1, -1):
        kind, *arguments = tape.operations[number]
        if number not in bar or kind == "const":
            continue
        own = bar.pop(number)
        if kind == "input":
            adjoints[arguments[0]] = own
            continue
        operands = [values[a] for a in arguments]
        for i, a in enumerate(arguments):
            if tape.operations[a][0] != "const" and not (kind == "select" and i == 0):
                moved = handed_on(RECORDED, kind, i, own, operands, values[number])
                bar[a] = moved if a not in bar else bar[a] + moved
    return adjoints


def derivatives(tape: Tape, to: Iterable[str]) -> Tape:
    """The tape of exact derivatives of outputs to inputs.

    Parameters
    ----------
    tape : Tape
    to : names of inputs

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
    recorder, wanted, outputs = Recorder(), list(to), dict(tape.outputs)
    values = tape.values({name: recorder.input(name) for name in tape.inputs}, RECORDED)
    for variable in wanted:
        if variable not in tape.inputs:
            raise KeyError(variable)
    results: dict[str, Number] = {}
    for name in tape.names:
        bar = _adjoints(tape, values, outputs[name])
        results |= {f"d({name})/d({variable})": bar.get(variable, 0.0) for variable in wanted}
    return recorder.tape(results)
