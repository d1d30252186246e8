"""The tape as JavaScript, for a page: the operations as data, and the engine that runs them in a browser.

`engine.js` does the operations of a tape lane by lane, in their order and with their roundings, as Python and numpy do
them; sine, cosine and arctangent are those of compiled code to the last bit. Its `twice` does them in numbers of 32 digits.
Nothing is made of text at run time: a tape is a list of numbers, which a page holds in its own hashed script.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cache
from importlib.resources import files

from dalembert.arithmetic.engines import polynomials
from dalembert.arithmetic.sines import STEP, STEPS, WHOLE
from dalembert.arithmetic.tape import SIGNS, Tape

# the order of `KINDS` in engine.js
CODES = {kind: code for code, kind in enumerate(SIGNS)}


@cache
def engine() -> str:
    """The engine: the text that every page with a tape begins with."""
    numbers: dict[str, float | Iterable[float]] = {
        "farthest": polynomials.FARTHEST,
        "nearest": polynomials.NEAREST,
        "smallest": polynomials.SMALLEST,
        "largest": polynomials.LARGEST,
        "steep": polynomials.STEEP,
        "twoOverPi": polynomials.TWO_OVER_PI,
        "whole": WHOLE,
        "quarter": polynomials.QUARTER,
        "halfPi": polynomials.HALF_PI,
        "sine": polynomials.SINE,
        "cosine": polynomials.COSINE,
        "arctangentOdd": polynomials.ARCTANGENT_ODD,
        "arctangentEven": polynomials.ARCTANGENT_EVEN,
        "halfPiParts": [part * (STEPS / 4) for part in STEP],
    }
    listed = ", ".join(f"{name}: {_value(value)}" for name, value in numbers.items())
    text = (files("dalembert.arithmetic.engines") / "engine.js").read_text(encoding="utf-8")
    return f"const F = {{ {listed} }};\n{text}"


def written(tape: Tape) -> str:
    """A tape as JavaScript has it: an object literal that `new Tape(…)` takes.

    Parameters
    ----------
    tape : Tape

    Returns
    -------
    str
        What enters by name, then constants, then operations (a code and the places of the arguments), then the places of
        the outputs. A place counts what enters, constants and operations, in this order.

    Examples
    --------
    >>> from dalembert.arithmetic.recorded import Recorder
    >>> recorder = Recorder()
    >>> x = recorder.input("x")
    >>> written(recorder.tape({"y": 2.0 * x + x}))
    '{enters:["x"],constants:[2.0],operations:[2,0,1,0,0,2],outputs:[3]}'
    """
    from json import dumps

    kinds = [operation[0] for operation in tape.operations]
    first = {"input": 0, "const": kinds.count("input")}
    first["operation"] = first["const"] + kinds.count("const")
    places: list[int] = []
    enters, constants, operations = list[str](), list[float](), list[int]()
    for kind, *arguments in tape.operations:
        group = kind if kind in first else "operation"
        places.append(first[group])
        first[group] += 1
        if kind == "input":
            enters.append(arguments[0])
        elif kind == "const":
            constants.append(arguments[0])
        else:
            operations += [CODES[kind], *(places[a] for a in arguments)]
    # a name cannot end the script that holds it
    names = dumps(enters, ensure_ascii=False).replace("<", "\\u003c")
    outputs = [places[number] for _, number in tape.outputs]
    return (
        f"{{enters:{names},constants:{_value(constants)},"
        f"operations:{_value(operations)},outputs:{_value(outputs)}}}"
    )


def _value(value: float | Iterable[float]) -> str:
    """A number or a list of them as JavaScript has it, each read back to the same bits."""
    if isinstance(value, (int, float)):
        if isinstance(value, float) and not math.isfinite(value):
            return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
        return repr(value)
    return f"[{','.join(map(_value, value))}]"
