"""The tape in numbers of 32 digits: over blocks of lanes, each value freed after its last use.

What hangs on uniform inputs alone is worked out once, on Python's numbers.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from dalembert.arithmetic.doubled import Doubled, doubled
from dalembert.arithmetic.doubled_functions import DOUBLED
from dalembert.arithmetic.tape import Tape, performed

# lanes of a block: its numbers stay in the cache
BLOCK = 4096


def run(tape: Tape, inputs: Mapping[str, Any]) -> dict[str, Doubled]:
    """Run a tape in numbers of 32 digits.

    Parameters
    ----------
    tape : Tape
    inputs : mapping of name to float, array (n,) or Doubled of these
        A float is the same for every lane. Further names are ignored.

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
    uniform, varying, last = _split(tape, frozenset(name for name, x in numbers.items() if np.ndim(x.high)))
    with np.errstate(all="ignore"):
        common = _run(tape, numbers, uniform, {}, {})
        if not n:
            return {name: common[number] for name, number in tape.outputs}
        found: dict[int, Any] = {
            number: common[number] if number in common else Doubled(np.empty(n), np.empty(n))
            for number in dict.fromkeys(number for _, number in tape.outputs)
        }
        for start in range(0, n, BLOCK):
            rows = slice(start, min(start + BLOCK, n))
            here = {name: _rows(x, rows) for name, x in numbers.items()}
            values = _run(tape, here, varying, dict(common), last)
            for number, whole in found.items():
                if number not in common:
                    whole.high[rows], whole.low[rows] = values[number].high, values[number].low
    return {name: found[number] for name, number in tape.outputs}


def _rows(x: Doubled, rows: slice) -> Doubled:
    if not np.ndim(x.high):
        return x
    return Doubled(x.high[rows], x.low[rows] if np.ndim(x.low) else x.low)


@lru_cache(maxsize=128)
def _split(
    tape: Tape, arrays: frozenset[str]
) -> tuple[tuple[int, ...], tuple[int, ...], dict[int, tuple[int, ...]]]:
    """The operations that are the same for all lanes, the others, and what each of these is the last to use."""
    lanes = tape.hang({name: int(name in arrays) for name in tape.inputs})
    uniform = tuple(number for number, varies in enumerate(lanes) if not varies)
    varying = tuple(number for number, varies in enumerate(lanes) if varies)
    outputs = {number for _, number in tape.outputs}
    user = {
        a: number
        for number in varying
        for a in tape.operations[number][1:]
        if tape.operations[number][0] != "input"
    }
    last: dict[int, tuple[int, ...]] = {}
    for a, number in user.items():
        if lanes[a] and a not in outputs:
            last[number] = (*last.get(number, ()), a)
    return uniform, varying, last


def _run(
    tape: Tape,
    inputs: Mapping[str, Doubled],
    which: tuple[int, ...],
    values: dict[int, Any],
    last: Mapping[int, tuple[int, ...]],
) -> dict[int, Any]:
    turns: dict[int, tuple[Doubled, Doubled]] = {}
    operations = tape.operations
    for number in which:
        kind, *of = operations[number]
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
        for a in last.get(number, ()):
            del values[a]
    return values
