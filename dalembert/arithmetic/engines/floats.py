"""The tape as straight-line Python on floats: for one pose or a few, without numpy's cost of a call.

Python's compiler takes as long for an operation as a hundred lanes that do it one by one: a function is made of a tape
that is run again and again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any

from dalembert.arithmetic.loop import called
from dalembert.arithmetic.recorded import binade
from dalembert.arithmetic.tape import DOUBLED, SIGNS, Tape

LONGEST = 2000  # operations of one function: Python's own compiler slows down on longer ones
DEEPEST = 12  # operations of one expression
PAYS = 100  # lanes of a tape from which on to compile it pays


class Floats:
    """The functions of floats, for `Tape.on`; they raise where Python's do."""

    const, binade = staticmethod(float), staticmethod(binade)
    sqrt, sin, cos = staticmethod(math.sqrt), staticmethod(math.sin), staticmethod(math.cos)
    atan2 = staticmethod(math.atan2)

    @staticmethod
    def select(test: float, positive: float, otherwise: float) -> float:
        return positive if test > 0 else otherwise


FLOATS = Floats()


@lru_cache(maxsize=256)
def compiled(
    tape: Tape,
    passed: tuple[str, ...] = (),
    results: tuple[str, ...] = (),
    among: tuple[str, ...] = (),
    numbers: tuple[tuple[str, ...], ...] = (),
) -> Callable[..., tuple[Any, ...]]:
    """The tape as a function of floats: inputs in the order of `tape.inputs`, outputs in that of `tape.outputs`.

    It raises where Python's own arithmetic does: ZeroDivisionError, ValueError (a root), OverflowError.

    Parameters
    ----------
    tape : Tape
    passed, results : names, optional
        Of the body of a `loop.Loop`: the arguments of each call, which may be none, and its results. Where there are
        `results`, the called function comes first among the arguments, and the arguments of calls are no outputs. A call
        whose results nothing uses is left out.
    among : names, optional
        The arguments, among which the inputs are; by default the inputs alone.
    numbers : tuple of names, optional
        The output of each real number, which has no −0 then, and the two of each complex one; default: all outputs as they are.
    """
    inputs = list(among) or [name for name in tape.inputs if called(name) is None]
    places = dict(tape.outputs)
    uses = [0] * len(tape.operations)
    for kind, *arguments in tape.operations:
        if kind not in ("const", "input"):
            for a in arguments:
                # an argument of a select is worked out only where it is taken: it must not be wanted elsewhere
                uses[a] += 2 if kind == "select" else 1
    for _, number in tape.outputs:
        uses[number] += 2
    text: list[str] = []
    depth: list[int] = []
    lines: list[str] = []
    done: set[int] = set()
    for number, (kind, *arguments) in enumerate(tape.operations):
        if kind == "const":
            text.append(repr(arguments[0]) if math.isfinite(arguments[0]) else f"float('{arguments[0]}')")
            depth.append(0)
        elif kind == "input":
            of = called(arguments[0])
            if of is None:
                text.append(f"x{inputs.index(arguments[0])}")
            else:
                text.append(f"c{of[0]}_{results.index(of[1])}")
                if of[0] not in done:
                    passed_text = ", ".join(text[places[f"call {of[0]} {name}"]] for name in passed)
                    to = "".join(f"c{of[0]}_{i}, " for i in range(len(results)))
                    lines.append(f"{to}= f({passed_text})")
                    done.add(of[0])
            depth.append(0)
        else:
            expression = (SIGNS | DOUBLED)[kind].format(*(text[a] for a in arguments))
            deep = 1 + max(depth[a] for a in arguments)
            if uses[number] == 1 and deep < DEEPEST:
                text.append(f"({expression})")
                depth.append(deep)
            else:
                lines.append(f"v{number} = {expression}")
                text.append(f"v{number}")
                depth.append(0)
    names = ", ".join([*(["f"] if results else []), *(f"x{k}" for k in range(len(inputs)))])
    if numbers:
        parts = [[text[places[name]] for name in each] for each in numbers]
        values = [f"complex({', '.join(of)})" if len(of) > 1 else f"{of[0]} + 0.0" for of in parts]
    else:
        values = [text[number] for name, number in tape.outputs if called(name) is None]
    returned = "".join(f"{value}, " for value in values)
    source = (
        f"def tape({names}):\n" + "".join(f"    {line}\n" for line in lines) + f"    return ({returned})\n"
    )
    room: dict[str, object] = {name: getattr(math, name) for name in ("sin", "cos", "atan2", "sqrt")}
    room["binade"] = binade
    if any(operation[0] in DOUBLED for operation in tape.operations):
        from dalembert.arithmetic.arrays import NUMPY

        room |= {name: getattr(NUMPY, name) for name in DOUBLED if name != "left"}
    exec(compile(source, "<tape>", "exec"), room)
    return room["tape"]  # type: ignore[return-value]


def takes(tape: Tape) -> bool:
    """Is the tape short enough for one Python function?"""
    return len(tape.operations) <= LONGEST


def function(tape: Tape, lanes: int = 1) -> Callable[..., Sequence[float]]:
    """What runs a tape on so many lanes of floats: `compiled` once that pays; the bits, and what it raises, are the same.

    Examples
    --------
    >>> from dalembert.arithmetic.recorded import Recorder
    >>> recorder = Recorder()
    >>> x = recorder.input("x")
    >>> tape = recorder.tape({"square": x * x, "inverse": 1 / x})
    >>> list(function(tape)(4.0)), list(function(tape, PAYS)(4.0))
    ([16.0, 0.25], [16.0, 0.25])
    """
    run = _runs(tape)
    run.lanes += lanes
    return compiled(tape) if run.lanes > PAYS or not run.plain else run.once


class _Runs:
    """How many lanes of a tape have been run."""

    def __init__(self, tape: Tape) -> None:
        self.lanes = 0
        # without loops, and with operations of plain numbers alone
        self.plain = SIGNS.keys() >= {op[0] for op in tape.operations} - {"const", "input"} and not any(
            map(called, tape.inputs)
        )
        self.once = partial(_once, tape)


_runs = lru_cache(maxsize=256)(_Runs)


def _once(tape: Tape, *inputs: float) -> list[float]:
    """Do a tape's operations one by one."""
    return [*tape.on(dict(zip(tape.inputs, inputs, strict=True)), FLOATS).values()]
