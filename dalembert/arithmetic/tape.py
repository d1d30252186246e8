"""The tape: the real operations that a formula performs, written down once, as data.

A tape is a list of operations in the order in which they can be done; the number of an operation is its place in the
list, and its arguments are the numbers of earlier ones. Nothing is done twice, and nothing is on it that no output
depends on. It is made by `recorded.Recorder`, transformed by `adjoint`, and run by `engines`, or by `Tape.on` with any
kind of number: floats, arrays, recorded numbers, many digits.
"""

from __future__ import annotations

import operator
from collections.abc import Container, Iterable, Mapping, Sequence
from functools import cached_property, reduce
from types import MappingProxyType
from typing import Any, Protocol

from dalembert.dataclass import dataclass

Operation = tuple[str, *tuple[Any, ...]]
"""(kind, arguments …): `("const", value)`, `("input", name)`, or a kind of `SIGNS` and the numbers of its arguments."""

SIGNS = {
    "add": "{} + {}",
    "sub": "{} - {}",
    "mul": "{} * {}",
    "div": "{} / {}",
    "neg": "-{}",
    "abs": "abs({})",
    # the largest power of two that is no larger than the size of the number
    "binade": "binade({})",
    "sqrt": "sqrt({})",
    "sin": "sin({})",
    "cos": "cos({})",
    "atan2": "atan2({}, {})",
    # the only decision: the second where the first is positive, else the third (NaN is not positive)
    "select": "({1} if {0} > 0 else {2})",
}

DOUBLED = {
    # of a product, what its rounding leaves out: a·b - p, exactly
    "left": "left({}, {}, {})",
    # the upper 26 bits of a number: products of these and of what they leave are exact
    "upper": "upper({})",
    # see `sines`
    "place": "place({})",
    **{f"entry{row}": f"entry{row}({{}})" for row in range(4)},
}
"""Further kinds, on the tape of a tape in doubled numbers (`engines.doubled`)."""

OWN = {name: getattr(operator, name) for name in ("add", "sub", "mul", "neg", "abs")} | {
    "div": operator.truediv
}
"""The kinds that are operations of the numbers themselves; the others are functions of a `Kind`."""
EMPTY: Mapping[Any, Any] = MappingProxyType({})


class Kind(Protocol):
    """The functions of one kind of number; sums, products, quotients and absolute values are the numbers' own."""

    def const(self, value: float) -> Any: ...
    def binade(self, x: Any) -> Any: ...
    def sqrt(self, x: Any) -> Any: ...
    def sin(self, x: Any) -> Any: ...
    def cos(self, x: Any) -> Any: ...
    def atan2(self, y: Any, x: Any) -> Any: ...
    def select(self, test: Any, positive: Any, otherwise: Any) -> Any: ...


@dataclass(frozen=True)
class Tape:
    """A list of real operations and the names of its results.

    Attributes
    ----------
    operations : tuple of (kind, arguments …)
    outputs : tuple of (name, number of an operation)

    Examples
    --------
    >>> from dalembert.arithmetic.recorded import Recorder
    >>> recorder = Recorder()
    >>> x, y = recorder.input("x"), recorder.input("y")
    >>> tape = recorder.tape({"norm": (x * x + y * y).sqrt(), "product": y * x})
    >>> print(tape)
    x
    y
    v2 = x * x
    v3 = y * y
    v4 = v3 + v2
    v5 = sqrt(v4)
    v6 = x * y
    norm: v5
    product: v6
    >>> tape.cost
    5
    """

    operations: tuple[Operation, ...]
    outputs: tuple[tuple[str, int], ...]

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """The names of the inputs, in the order of their first use."""
        return tuple(operation[1] for operation in self.operations if operation[0] == "input")

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the outputs."""
        return tuple(name for name, _ in self.outputs)

    @cached_property
    def rows(self) -> Mapping[str, int]:
        """The place of each output."""
        return {name: row for row, name in enumerate(self.names)}

    @cached_property
    def cost(self) -> int:
        """The count of operations, inputs and constants not counted."""
        return sum(operation[0] not in ("const", "input") for operation in self.operations)

    @cached_property
    def key(self) -> str:
        """A name for caches on disk: the same for the same operations in every process."""
        from hashlib import sha256

        return sha256(repr((self.operations, self.outputs)).encode()).hexdigest()

    @cached_property
    def _hash(self) -> int:
        return hash((self.operations, self.outputs))

    def __hash__(self) -> int:
        return self._hash

    def __reduce__(self) -> tuple[type[Tape], tuple[object, ...]]:
        # what is computed on the first request does not travel: hashes of text differ between processes
        return Tape, (self.operations, self.outputs)

    def __str__(self) -> str:
        names: list[str] = []
        lines = []
        for number, (kind, *arguments) in enumerate(self.operations):
            if kind == "const":
                names.append(repr(arguments[0]))
                continue
            if kind == "input":
                names.append(str(arguments[0]))
                lines.append(str(arguments[0]))
                continue
            names.append(f"v{number}")
            lines.append(f"v{number} = {(SIGNS | DOUBLED)[kind].format(*(names[a] for a in arguments))}")
        return "\n".join([*lines, *(f"{name}: {names[number]}" for name, number in self.outputs)])

    def dependence(self, on: Mapping[str, int]) -> list[int]:
        """What each operation depends on, as bits that its inputs have by their names.

        >>> from dalembert.arithmetic.recorded import Recorder
        >>> recorder = Recorder()
        >>> recorder.tape({"x": recorder.input("a") + recorder.input("b")}).dependence({"a": 1, "b": 2})
        [1, 2, 3]
        """
        levels: list[int] = []
        for kind, *arguments in self.operations:
            if kind == "input":
                levels.append(on[arguments[0]])
            else:
                levels.append(0 if kind == "const" else reduce(operator.or_, (levels[a] for a in arguments)))
        return levels

    def on(self, inputs: Mapping[str, Any], kind: Kind) -> dict[str, Any]:
        """The outputs, worked out operation by operation on any kind of number."""
        values = self.values(inputs, kind)
        return {name: values[number] for name, number in self.outputs}

    def values(self, inputs: Mapping[str, Any], kind: Kind) -> list[Any]:
        """The value of every operation, on any kind of number."""
        results: list[Any] = []
        for name, *arguments in self.operations:
            if name == "const":
                results.append(kind.const(arguments[0]))
            elif name == "input":
                results.append(inputs[arguments[0]])
            else:
                results.append(performed(name, [results[a] for a in arguments], kind))
        return results


def performed(name: str, values: list[Any], kind: Kind) -> Any:
    """One operation on numbers of a kind."""
    return (OWN.get(name) or getattr(kind, name))(*values)


def reached(
    operations: Sequence[Operation], outputs: Iterable[int], inputs: Container[int] = frozenset()
) -> list[int]:
    """The operations that `outputs` depend on, in order, themselves included; `inputs` depend on nothing."""
    wanted = set(outputs)
    last = max(wanted, default=-1)
    marks = bytearray(last + 1)
    for number in wanted:
        marks[number] = 1
    for number in range(last, -1, -1):
        if marks[number] and number not in inputs:
            operation = operations[number]
            if operation[0] not in ("const", "input"):
                for argument in operation[1:]:
                    marks[argument] = 1
    return [number for number, mark in enumerate(marks) if mark]


def shortened(
    operations: Sequence[Operation], outputs: Sequence[tuple[str, int]], inputs: Mapping[int, str] = EMPTY
) -> Tape:
    """The tape of outputs: what they do not depend on is left out, and the rest numbered anew.

    The values of operations that are known enter, by name.
    """
    place: dict[int, int] = {}
    kept: list[Operation] = []
    for number in reached(operations, (number for _, number in outputs), inputs):
        operation = operations[number]
        if number in inputs:
            operation = "input", inputs[number]
        elif operation[0] not in ("const", "input"):
            operation = operation[0], *[place[a] for a in operation[1:]]
        place[number] = len(kept)
        kept.append(operation)
    return Tape(tuple(kept), tuple((name, place[number]) for name, number in outputs))
