"""The tape as straight-line numpy over blocks of lanes: every operation writes into a slot of a small scratch.

A fresh array costs more in page faults than the arithmetic; the scratch is made once for each thread and stays in
the cache. What depends on uniform inputs alone is worked out once, not for each lane.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.arrays import EXPONENT, NUMPY
from dalembert.arithmetic.engines import floats
from dalembert.arithmetic.exact import UPPER, upper
from dalembert.arithmetic.sines import STEPS, table
from dalembert.arithmetic.tape import Operation, Tape, performed, shortened

Reals = NDArray[np.float64]
# lanes of a block: as many as let the scratch fit the second cache. Longer ones pay numpy's calls by more lanes
LEAST, MOST = 1024, 8192
ROOM = 1 << 20  # bytes
# of a tape in doubled numbers, whose operations are so many that numpy's calls cost more than the third cache
LONG, LONG_ROOM = 16384, 1 << 24
LONGEST = 1000  # operations of one generated function
# to prepare a tape takes as long as so many runs over so many lanes do that do its operations one by one
SOON, NARROW = 8, 2048

UFUNCS = {
    "add": "add",
    "sub": "subtract",
    "mul": "multiply",
    "div": "divide",
    "neg": "negative",
    "abs": "absolute",
    "sqrt": "sqrt",
    "sin": "sin",
    "cos": "cos",
    "atan2": "arctan2",
}

# what the formulas of plain numbers consist of
SIMPLE = {*UFUNCS, "const", "input", "select", "binade"}


class Blocks:
    """A tape prepared for lanes: what its inputs depend `on`, as bits, and all of these, which an operation of lanes has."""

    def __init__(self, tape: Tape, on: Mapping[str, int], every: int = 1) -> None:
        whole, tape = tape, split(tape)
        self.tape = tape
        self.varying = [name for name in tape.inputs if on[name] == every]
        operations = tape.operations
        self.of_lanes = lanes = [bits == every for bits in tape.dependence(on)]
        body = [n for n, op in enumerate(operations) if lanes[n] and op[0] != "input"]
        last = {a: n for n in body for a in operations[n][1:]}
        outputs: dict[int, str] = {}
        # outputs that no lane's operation writes: (row, what it repeats, its name or number)
        self.fill: list[tuple[int, str, Any]] = []
        for row, (_, number) in enumerate(tape.outputs):
            if operations[number][0] == "input" and lanes[number]:
                self.fill.append((row, "input", operations[number][1]))
            elif not lanes[number]:
                self.fill.append((row, "common", number))
            elif number in outputs:
                self.fill.append((row, "row", int(outputs[number][1:])))
            else:
                outputs[number] = f"o{row}"
        self.written = sorted(int(name[1:]) for name in outputs.values())
        place: dict[int, str] = {}
        for number, (kind, *arguments) in enumerate(operations):
            if not lanes[number]:
                place[number] = f"c{number}"
            elif kind == "input":
                place[number] = f"x{self.varying.index(arguments[0])}"
        # what is the same for all lanes: which of it the lanes read, and its own operations
        self.read = sorted({a for n in body for a in operations[n][1:] if not lanes[a]})
        same = {*self.read, *(source for _, kind, source in self.fill if kind == "common")}
        self.same = shortened(operations, [(str(number), number) for number in sorted(same)])
        free: list[str] = []
        slots = 0
        lines: list[str] = []
        for number in body:
            kind, *arguments = operations[number]
            ends = {place[a] for a in arguments if last[a] == number and place[a][0] == "s"}
            if kind != "select":
                free += sorted(ends)
            if number in outputs:
                place[number] = outputs[number]
            elif free:
                place[number] = free.pop()
            else:
                place[number] = f"s{slots}"
                slots += 1
            target, operands = place[number], [place[a] for a in arguments]
            if kind == "select":
                lines += [
                    f"greater({operands[0]}, 0.0, mask)",
                    f"copyto({target}, {operands[2]})",
                    f"copyto({target}, {operands[1]}, where=mask)",
                ]
                free += sorted(ends)
            elif kind == "upper":
                lines.append(f"bitwise_and({operands[0]}.view(int64), {UPPER}, {target}.view(int64))")
            elif kind == "place":
                lines.append(f"bitwise_and({operands[0]}.view(int64), {STEPS - 1}, {target}.view(int64))")
            elif kind.startswith("entry"):
                lines.append(f"take(table[{kind[-1]}], {operands[0]}.view(int64), 0, {target}, 'clip')")
            elif kind == "binade":
                lines.append(f"bitwise_and({operands[0]}.view(int64), {EXPONENT}, {target}.view(int64))")
            else:
                lines.append(f"{UFUNCS[kind]}({', '.join(operands)}, {target})")
        self.slots = slots
        most, room = (MOST, ROOM) if tape is whole else (LONG, LONG_ROOM)
        self.block = min(most, max(LEAST, room // (8 * max(slots, 1)) // LEAST * LEAST))
        self.parts = self._compiled(lines)
        self._own = threading.local()

    def _compiled(self, lines: list[str]) -> list[Callable[..., None]]:
        names = [f"x{k}" for k in range(len(self.varying))] + [f"c{n}" for n in self.read]
        names += [f"o{row}" for row in self.written] + [f"s{k}" for k in range(self.slots)] + ["mask"]
        room: dict[str, Any] = {
            name: getattr(np, name)
            for name in (*UFUNCS.values(), "bitwise_and", "int64", "greater", "copyto", "take")
        }
        if any(line.startswith("take") for line in lines):
            room["table"] = table()
        parts = []
        for start in range(0, len(lines), LONGEST):
            text = "".join(f"    {line}\n" for line in lines[start : start + LONGEST])
            exec(compile(f"def part({', '.join(names)}):\n{text}", "<tape>", "exec"), room)
            parts.append(room["part"])
        return parts

    def _scratch(self) -> tuple[list[Reals], NDArray[np.bool_]]:
        if not hasattr(self._own, "scratch"):
            # eight further lanes a row, so that the rows do not all begin at the same place of a cache's way
            table = np.empty((self.slots, self.block + 8))
            self._own.scratch = list(table[:, : self.block]), np.empty(self.block, dtype=bool)
        return self._own.scratch  # type: ignore[no-any-return]

    def __call__(self, columns: Sequence[Reals | float], out: Sequence[Reals] | Reals) -> None:
        """Run: `columns` in the order of the tape's inputs, (n,), or one number; `out` a row an output, (n,)."""
        n = len(out[0]) if len(out) else 0
        inputs = dict(zip(self.tape.inputs, columns, strict=True))
        varying: list[Any] = [inputs[name] for name in self.varying]
        with np.errstate(all="ignore"):
            common = self._common(inputs)
            constants = [common[str(number)] for number in self.read]
            slots, mask = self._scratch()
            for i in range(0, n if self.parts else 0, self.block):
                j = min(i + self.block, n)
                rows = [out[row][i:j] for row in self.written]
                whole = j - i == self.block
                here, there = (slots, mask) if whole else ([s[: j - i] for s in slots], mask[: j - i])
                arguments = [*(x[i:j] for x in varying), *constants, *rows, *here, there]
                for part in self.parts:
                    part(*arguments)
        for row, kind, source in self.fill:
            if kind == "common":
                out[row][:] = common[str(source)]
            else:
                out[row][:] = inputs[source] if kind == "input" else out[source]

    def _common(self, inputs: Mapping[str, Reals | float]) -> Mapping[str, Any]:
        """The values that are the same for all lanes, as floats where those go on."""
        values = [float(inputs[name]) for name in self.same.inputs]
        if floats.takes(self.same):
            try:
                return dict(zip(self.same.names, floats.function(self.same)(*values), strict=True))
            except (ZeroDivisionError, ValueError, OverflowError):
                pass
        return self.same.on(dict(zip(self.same.inputs, map(np.float64, values), strict=True)), NUMPY)


def split(tape: Tape) -> Tape:
    """The tape with the rests of products in operations that numpy has (Dekker, as `exact.two_product`)."""
    if all(operation[0] != "left" for operation in tape.operations):
        return tape
    made: list[Operation] = []
    numbers: dict[Operation, int] = {}
    place: list[int] = []

    def node(*operation: Any) -> int:
        if operation not in numbers:
            numbers[operation] = len(made)
            made.append(operation)
        return numbers[operation]

    def halves(a: int) -> tuple[int, int]:
        kind, *of = made[a]
        if kind == "const":
            high = float(upper(np.array(of[0])))
            return node("const", high), node("const", of[0] - high)
        high = node("upper", a)
        return high, node("sub", a, high)

    for kind, *arguments in tape.operations:
        if kind in ("const", "input"):
            place.append(node(kind, *arguments))
            continue
        operands = [place[a] for a in arguments]
        if kind != "left":
            place.append(node(kind, *operands))
            continue
        (a1, a2), (b1, b2) = halves(operands[0]), halves(operands[1])
        rest = node("sub", node("mul", a1, b1), operands[2])
        if operands[0] == operands[1]:
            rest = node("add", rest, node("mul", node("add", a1, a1), a2))
        else:
            rest = node("add", node("add", rest, node("mul", a1, b2)), node("mul", a2, b1))
        place.append(node("add", rest, node("mul", a2, b2)))
    return Tape(tuple(made), tuple((name, place[number]) for name, number in tape.outputs))


@lru_cache(maxsize=128)
def compiled(tape: Tape, uniform: frozenset[str]) -> Blocks:
    """The tape prepared for lanes, once; `uniform` names the inputs that are one number for all of them."""
    return Blocks(tape, {name: int(name not in uniform) for name in tape.inputs})


def run(tape: Tape, columns: Sequence[Reals], out: Sequence[Reals] | Reals) -> None:
    """Run a tape: inputs in its order, (n,), or () for one number; `out` a row an output, (n,).

    The first times on few lanes it is done operation by operation: to prepare it takes longer than that.
    """
    runs = _runs(tape)
    runs[0] += 1
    if (
        runs[0] <= SOON
        and len(out)
        and len(out[0]) <= NARROW
        and SIMPLE.issuperset(op[0] for op in tape.operations)
    ):
        _once(tape, columns, out)
        return
    uniform = frozenset(name for name, x in zip(tape.inputs, columns, strict=True) if not x.ndim)
    compiled(tape, uniform)(columns, out)


@lru_cache(maxsize=256)
def _runs(tape: Tape) -> list[int]:
    """How often a tape has been run."""
    return [0]


def _once(tape: Tape, columns: Sequence[Reals], out: Sequence[Reals] | Reals) -> None:
    """Do a tape's operations one by one."""
    with np.errstate(all="ignore"):
        values = one_by_one(tape, dict(zip(tape.inputs, columns, strict=True)))
    for row, (_, number) in zip(out, tape.outputs, strict=True):
        row[:] = values[number]


def one_by_one(tape: Tape, inputs: Mapping[str, Reals], left: Sequence[bool] | None = None) -> list[Any]:
    """The values of a tape's operations: of arrays by numpy, of numbers on floats; None where they are `left` for later."""
    values: list[Any] = []
    for number, (kind, *arguments) in enumerate(tape.operations):
        if kind == "const":
            values.append(arguments[0])
        elif kind == "input":
            x = inputs[arguments[0]]
            values.append(x if x.ndim else float(x))
        elif left is not None and left[number]:
            values.append(None)
        else:
            of = [values[a] for a in arguments]
            same = all(isinstance(x, float) for x in of)
            values.append(_on_floats(kind, of) if same else performed(kind, of, NUMPY))
    return values


def _on_floats(kind: str, of: list[float]) -> float:
    """An operation on floats; where Python raises, with numpy's infinity or NaN."""
    try:
        return float(performed(kind, of, floats.FLOATS))
    except (ZeroDivisionError, ValueError, OverflowError):
        return float(performed(kind, [np.float64(x) for x in of], NUMPY))
