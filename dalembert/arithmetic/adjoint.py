"""Exact derivatives: one sweep backwards over a tape gives those of an output to every input.

The adjoint v̄ = ∂y/∂v of every operation v of an output y (A. Griewank, A. Walther, Evaluating Derivatives, 2nd ed.,
SIAM 2008, §3.2) is written down as a tape again and runs on every engine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

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


class _Sweep:
    """A tape worked out on any kind of number, with the values of its operations at hand."""

    def __init__(self, tape: Tape, inputs: Mapping[str, Any], kind: Kind) -> None:
        self.tape, self.kind = tape, kind
        self.values = tape.values(inputs, kind)

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
                else:
                    moved = times(own, PARTIALS[kind][i](self.kind, given, self.values[number]))
                bar[a] = moved if a not in bar else bar[a] + moved


def times(own: Number, partial: Number) -> Number:
    """An adjoint times a derivative, which is often 1 or −1."""
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
