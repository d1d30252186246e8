"""The tape as JavaScript, for a page: the operations as data, and the engine that runs them in a browser.

`engine.js` does the operations of a tape lane by lane, in their order and with their roundings, as Python and numpy do
them; sine, cosine and arctangent are those of compiled code to the last bit. Its `twice` does them in numbers of 32 digits.
Nothing is made of text at run time: a tape is a list of numbers, which a page holds in its own hashed script.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from importlib.resources import files
from itertools import pairwise

from dalembert.arithmetic.engines import polynomials
from dalembert.arithmetic.sines import STEP, STEPS, WHOLE
from dalembert.arithmetic.tape import SIGNS, Tape

# the order of `KINDS` in engine.js
CODES = {kind: code for code, kind in enumerate(SIGNS)}
# one of a list of constants, by where a number lies between the knots of another
PICK = len(CODES)
# knots from which on it is worth a list
LONG = 8
# the operation that lies between knots, the knots, the values
Pick = tuple[int, tuple[float, ...], tuple[float, ...]]


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


def written(tape: Tape, lists: list[tuple[float, ...]] | None = None) -> str:
    """A tape as JavaScript has it: an object literal that `new Tape(…)` takes.

    Parameters
    ----------
    tape : Tape
    lists : list, optional
        Of several tapes together, which gets the long lists of constants of which one is chosen: `new Tape(…, lists)` takes
        them too, so that each stands in a page once. Without it they are choices of choices on the tape, as elsewhere.

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

    picks = {} if lists is None else _picks(tape)
    places: dict[int, int] = {}
    enters, constants, operations = list[str](), list[float](), list[int]()
    needed = _needed(tape, picks)
    kinds = [tape.operations[n][0] for n in needed]
    first = {"input": 0, "const": kinds.count("input")}
    first["operation"] = first["const"] + kinds.count("const")
    for n in needed:
        kind, *arguments = tape.operations[n]
        group = kind if kind in first else "operation"
        places[n] = first[group]
        first[group] += 1
        if kind == "input":
            enters.append(arguments[0])
        elif kind == "const":
            constants.append(arguments[0])
        elif n in picks and lists is not None:
            at, *columns = picks[n]
            for column in columns:
                if column not in lists:
                    lists.append(column)
            operations += [PICK, places[at], *map(lists.index, columns)]
        else:
            operations += [CODES[kind], *(places[a] for a in arguments)]
    # a name cannot end the script that holds it
    names = dumps(enters, ensure_ascii=False).replace("<", "\\u003c")
    outputs = [places[number] for _, number in tape.outputs]
    return (
        f"{{enters:{names},constants:{_value(constants)},"
        f"operations:{_value(operations)},outputs:{_value(outputs)}}}"
    )


def literal(tapes: Mapping[str, Tape]) -> str:
    """Tapes by their names as one object literal, and `lists`, which they share."""
    lists: list[tuple[float, ...]] = []
    made = [f"{name}: {written(tape, lists)}" for name, tape in tapes.items()]
    return "{\n" + ",\n".join([*made, f"lists: [{','.join(_listed(lists))}]"]) + "\n}"


def _listed(lists: Sequence[tuple[float, ...]]) -> Iterator[str]:
    """Lists as JavaScript has them; what is a part of a longer one as its number, and where the part begins and ends."""
    for values in lists:
        for k, longer in enumerate(lists):
            begin = longer.index(values[0]) if len(longer) > len(values) and values[0] in longer else -1
            if begin >= 0 and longer[begin : begin + len(values)] == values:
                yield f"{{of:{k},from:{begin},to:{begin + len(values)}}}"
                break
        else:
            yield _value(values)


def _picks(tape: Tape) -> dict[int, Pick]:
    """Choices of choices among constants by where one number lies between rising knots: long ones, by their last operation."""
    trees: dict[int, Pick] = {}
    operations = tape.operations

    def branch(number: int, at: int) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
        if operations[number][0] == "neg":
            inner = branch(operations[number][1], at)
            return None if inner is None else (inner[0], tuple(-value for value in inner[1]))
        if operations[number][0] == "const":
            return (), (operations[number][1],)
        tree = trees.get(number)
        return tree[1:] if tree is not None and tree[0] == at else None

    for n, (kind, *arguments) in enumerate(operations):
        if kind != "select":
            continue
        test, *cases = arguments
        # a knot below zero is added
        sense = {"sub": 1.0, "add": -1.0}.get(operations[test][0])
        if sense is None or operations[operations[test][2]][0] != "const":
            continue
        at, knot = operations[test][1], sense * operations[operations[test][2]][1]
        above, below = (branch(case, at) for case in cases)
        if above is not None and below is not None:
            knots = (*below[0], knot, *above[0])
            if all(low < high for low, high in pairwise(knots)):
                trees[n] = at, knots, (*below[1], *above[1])
    return {n: tree for n, tree in trees.items() if len(tree[1]) >= LONG}


def _needed(tape: Tape, picks: Mapping[int, Pick]) -> list[int]:
    """The operations that outputs depend on, in their order; all inputs among them."""
    needed = {number for _, number in tape.outputs}
    for n in range(len(tape.operations) - 1, -1, -1):
        kind, *arguments = tape.operations[n]
        if kind == "input":
            needed.add(n)
        elif n in needed and kind != "const":
            needed.update(picks[n][:1] if n in picks else arguments)
    return sorted(needed)


def _value(value: float | Iterable[float]) -> str:
    """A number or a list of them as JavaScript has it, each read back to the same bits."""
    if isinstance(value, (int, float)):
        if isinstance(value, float) and not math.isfinite(value):
            return "NaN" if math.isnan(value) else "Infinity" if value > 0 else "-Infinity"
        return repr(value)
    return f"[{','.join(map(_value, value))}]"
