"""The tape in numbers of 32 digits.

A few lanes run on doubled numbers as they stand, each value freed after its last use; what depends on uniform inputs alone
stays Python's numbers. Where there is more to do, the tape is run once on recorded doubled numbers: what they do is a tape
in floats, of some ten operations for each, which the engines of all tapes run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import pi
from typing import Any, NamedTuple

import numpy as np

from dalembert.arithmetic.choice import wanted
from dalembert.arithmetic.doubled import PI, Doubled, doubled
from dalembert.arithmetic.doubled_functions import DOUBLED, functions
from dalembert.arithmetic.engines import FEW, compiled_code, work_on
from dalembert.arithmetic.engines import PAYS as COMPILED
from dalembert.arithmetic.engines import run as run_floats
from dalembert.arithmetic.exact import two_sum
from dalembert.arithmetic.recorded import Recorder
from dalembert.arithmetic.sines import WHOLE
from dalembert.arithmetic.tape import EMPTY, Tape, performed

# lanes from which writing a tape in floats pays, for numpy; and how many operations in floats one comes to, for compiled code
PAYS, EACH = 2e4, 12.0
# of the difference of two runs, and of the quantity: what the second run itself may be off by, far from singular places
OWN, LAST = 1.01, 2.0**-96
ZERO, TURN = Doubled(0.0), PI * 2.0


class Answer(NamedTuple):
    """A quantity that a first run gave: the names of its one or two parts, and whether whole turns of it are nothing."""

    parts: tuple[str, ...]
    turning: bool = False


def run(tape: Tape, inputs: Mapping[str, Any], direct: bool = False) -> dict[str, Doubled]:
    """Run a tape in numbers of 32 digits.

    Parameters
    ----------
    tape : Tape
    inputs : mapping of name to float, array (n,) or Doubled of these
        A float is the same for every lane. Further names are ignored.
    direct : bool
        On doubled numbers as they stand, however many lanes there are.

    Returns
    -------
    dict of an output's name to its values, Doubled of (n,) or of a number

    Examples
    --------
    What the sixteen digits of a third leave:

    >>> from dalembert.arithmetic.recorded import Recorder
    >>> recorder = Recorder()
    >>> tape = recorder.tape({"third": recorder.input("x") / 3.0})
    >>> float((1 / 3 - run(tape, {"x": 1.0})["third"]).value)
    -1.850371707708594e-17
    """
    numbers = {name: doubled(inputs[name]) for name in tape.inputs}
    lanes = {len(x.high) for x in numbers.values() if np.ndim(x.high)}
    if len(lanes) > 1:
        raise ValueError(f"inputs of different lengths: {', '.join(map(str, sorted(lanes)))}")
    n = lanes.pop() if lanes else 0
    if n > FEW and not direct:
        engine = _engine(tape, n)
        if engine is not None:
            parts = _in_floats(tape, numbers, engine)
            return {name: Doubled(parts[name], parts[f"{name} low"]) for name in tape.names}
    with np.errstate(all="ignore"):
        out = _run(tape, numbers)
    return {name: Doubled(x.high, x.low + np.zeros(n)) if np.ndim(x.high) else x for name, x in out.items()}


def compared(
    tape: Tape, inputs: Mapping[str, Any], answers: Mapping[Answer, Sequence[Any]]
) -> tuple[list[Any], dict[str, Doubled]]:
    """Hold answers against their tape in numbers of 32 digits.

    Parameters
    ----------
    tape, inputs : as for `run`
    answers : mapping of what was computed to its parts, (n,) each
        A part that the tape has not is zero.

    Returns
    -------
    estimates of their errors, (n,) each
        The length of the error of two parts; NaN or infinite where either run has no number.
    the other outputs

    Examples
    --------
    >>> from dalembert.arithmetic.recorded import Recorder
    >>> recorder = Recorder()
    >>> tape = recorder.tape({"third": recorder.input("x") / 3.0})
    >>> (error,), _ = compared(tape, {"x": np.array([1.0])}, {Answer(("third",)): [np.array([1 / 3])]})
    >>> bool(1.85e-17 < error[0] < 1.87e-17)
    True
    """
    numbers = {name: doubled(inputs[name]) for name in tape.inputs}
    n = max((len(x.high) for x in numbers.values() if np.ndim(x.high)), default=0)
    compared_with = {part for answer in answers for part in answer.parts}
    others = [name for name in tape.names if name not in compared_with]
    engine = _engine(tape, n) if n > FEW else None
    if engine is None:
        results = run(tape, inputs, direct=True)
        with np.errstate(all="ignore"):
            estimates = [
                estimated([results.get(part, ZERO) for part in answer.parts], parts, answer.turning)
                for answer, parts in answers.items()
            ]
        return estimates, {name: results[name] for name in others}
    entering = {
        f"answer {part}": x
        for answer, parts in answers.items()
        for part, x in zip(answer.parts, parts, strict=True)
    }
    out = _in_floats(tape, numbers, engine, tuple(answers), entering)
    return [out[f"estimate {i}"] for i in range(len(answers))], {
        name: Doubled(out[name], out[f"{name} low"]) for name in others
    }


def estimated(exact: Sequence[Doubled], answer: Sequence[Any], turning: bool = False) -> Any:
    """The estimate of the error of an answer of one or two parts, by its second run."""
    pairs = list(zip(exact, answer, strict=True))
    errors = [
        _turned_off(value, part) if turning else (part - value.high) - value.low for value, part in pairs
    ]
    error, size = _length(errors), _length(answer)
    return OWN * error + LAST * size


def _length(parts: Sequence[Any]) -> Any:
    if len(parts) == 1:
        return abs(parts[0])
    x, y = parts
    return functions(x + y).sqrt(x * x + y * y)


def _turned_off(value: Doubled, answer: Any) -> Any:
    """The difference of two angles, less whole turns."""
    apart, rest = two_sum(answer, -value.high)
    turns = Doubled((apart * (0.5 / pi) + WHOLE) - WHOLE)
    product = turns.high * TURN.high
    return (apart - product) + (rest - turns.left(TURN, product) - turns.high * TURN.low - value.low)


def _engine(tape: Tape, n: int) -> str | None:
    """The engine of the tape in floats; None where doubled numbers run as they stand."""
    work, engine = work_on(tape, n), wanted()
    if engine == "llvm" or (engine is None and EACH * work > COMPILED and compiled_code()):
        return "llvm"
    return "numpy" if engine != "python" and work > PAYS * tape.cost else None


def _in_floats(
    tape: Tape,
    numbers: Mapping[str, Doubled],
    engine: str,
    answers: tuple[Answer, ...] = (),
    entering: Mapping[str, Any] = EMPTY,
) -> Mapping[str, Any]:
    rests = frozenset(name for name, x in numbers.items() if np.any(x.low))
    inputs = {name: x.high for name, x in numbers.items()} | dict(entering)
    inputs |= {f"{name} low": numbers[name].low for name in rests}
    return run_floats(in_floats(tape, rests, answers), inputs, engine)


@lru_cache(maxsize=64)
def in_floats(tape: Tape, rests: frozenset[str], answers: tuple[Answer, ...] = ()) -> Tape:
    """A tape in doubled numbers, as a tape in floats.

    Parameters
    ----------
    tape : Tape
    rests : names of inputs
        Those that are no floats: what the float leaves of each enters too, under its name and "low".
    answers : tuple of Answer
        What the first run gave, to be compared: each part enters under "answer" and its name, and the estimate of the
        error is the output "estimate" with its place.

    Returns
    -------
    Tape
        Two outputs for each that is not compared.

    Examples
    --------
    A product needs the rounding error of its floats:

    >>> from dalembert.arithmetic.recorded import Recorder
    >>> recorder = Recorder()
    >>> tape = recorder.tape({"area": recorder.input("x") * recorder.input("y")})
    >>> print(in_floats(tape, frozenset()))
    x
    y
    v2 = x * y
    v3 = left(x, y, v2)
    area: v2
    area low: v3
    """
    recorder = Recorder()
    numbers = {
        name: Doubled(recorder.input(name), recorder.input(f"{name} low") if name in rests else 0.0)
        for name in tape.inputs
    }
    values, outputs = _run(tape, numbers), dict[str, Any]()
    for i, (parts, turning) in enumerate(answers):
        exact = [values.pop(part, ZERO) for part in parts]
        entering = [recorder.input(f"answer {part}") for part in parts]
        outputs[f"estimate {i}"] = estimated(exact, entering, turning)
    for name, value in values.items():
        outputs |= {name: value.high, f"{name} low": value.low}
    return recorder.tape(outputs)


@lru_cache(maxsize=128)
def _ends(tape: Tape) -> list[list[int]]:
    """What each operation is the last to use, but for the outputs."""
    outputs = {number for _, number in tape.outputs}
    last = {
        a: number
        for number, (kind, *of) in enumerate(tape.operations)
        for a in (() if kind in ("const", "input") else of)
    }
    ends: list[list[int]] = [[] for _ in tape.operations]
    for a, number in last.items():
        if a not in outputs:
            ends[number].append(a)
    return ends


def _run(tape: Tape, inputs: Mapping[str, Doubled]) -> dict[str, Doubled]:
    """The outputs, operation by operation on doubled numbers."""
    values: dict[int, Any] = {}
    turns: dict[int, tuple[Doubled, Doubled]] = {}
    for number, ((kind, *of), ends) in enumerate(zip(tape.operations, _ends(tape), strict=True)):
        if kind == "const":
            values[number] = Doubled(of[0])
        elif kind == "input":
            values[number] = inputs[of[0]]
        elif kind in ("sin", "cos"):
            if of[0] not in turns:
                turns[of[0]] = DOUBLED.sincos(values[of[0]])
            values[number] = turns[of[0]][kind == "cos"]
        else:
            values[number] = performed(kind, [values[a] for a in of], DOUBLED)
        for a in ends:
            del values[a]
    return {name: values[number] for name, number in tape.outputs}
