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
from dalembert.arithmetic.tape import Tape, shortened

Reals = NDArray[np.float64]
# lanes of a block: as many as let the scratch fit the second cache. Longer ones pay numpy's calls by more lanes
LEAST, MOST = 1024, 8192
ROOM = 1 << 20  # bytes
LONGEST = 1000  # operations of one generated function

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


class Blocks:
    """A tape prepared for lanes; `uniform` names the inputs that are one number for all lanes."""

    def __init__(self, tape: Tape, uniform: frozenset[str]) -> None:
        self.tape = tape
        self.varying = [name for name in tape.inputs if name not in uniform]
        operations = tape.operations
        self.of_lanes = lanes = self.lanes_of(tape, uniform)
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
            elif kind == "binade":
                lines.append(f"bitwise_and({operands[0]}.view(int64), {EXPONENT}, {target}.view(int64))")
            else:
                lines.append(f"{UFUNCS[kind]}({', '.join(operands)}, {target})")
        self.slots = slots
        self.block = min(MOST, max(LEAST, ROOM // (8 * max(slots, 1)) // LEAST * LEAST))
        self.parts = self._compiled(lines)
        self._own = threading.local()

    def lanes_of(self, tape: Tape, uniform: frozenset[str]) -> list[bool]:
        """Which operations are not the same for all lanes."""
        lanes: list[bool] = []
        for kind, *arguments in tape.operations:
            if kind == "input":
                lanes.append(arguments[0] not in uniform)
            else:
                lanes.append(kind != "const" and any(lanes[a] for a in arguments))
        return lanes

    def _compiled(self, lines: list[str]) -> list[Callable[..., None]]:
        names = [f"x{k}" for k in range(len(self.varying))] + [f"c{n}" for n in self.read]
        names += [f"o{row}" for row in self.written] + [f"s{k}" for k in range(self.slots)] + ["mask"]
        room: dict[str, Any] = {
            name: getattr(np, name)
            for name in (*UFUNCS.values(), "bitwise_and", "int64", "greater", "copyto")
        }
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
                return dict(zip(self.same.names, floats.compiled(self.same)(*values), strict=True))
            except (ZeroDivisionError, ValueError, OverflowError):
                pass
        return self.same.on(dict(zip(self.same.inputs, map(np.float64, values), strict=True)), NUMPY)


@lru_cache(maxsize=128)
def compiled(tape: Tape, uniform: frozenset[str]) -> Blocks:
    """The tape prepared for lanes, once."""
    return Blocks(tape, uniform)


def run(tape: Tape, columns: Sequence[Reals], out: Sequence[Reals] | Reals) -> None:
    """Run a tape: inputs in its order, (n,), or () for one number; `out` a row an output, (n,)."""
    uniform = frozenset(name for name, x in zip(tape.inputs, columns, strict=True) if not x.ndim)
    compiled(tape, uniform)(columns, out)
