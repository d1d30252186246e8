"""What recorded operations are made of, as numbers that do not depend on what was recorded before."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from zlib import crc32

from dalembert.arithmetic.tape import Operation

# operations whose arguments change places, perhaps with the sign
TURNING = ("mul", "add", "sub")


@cache
def _of_text(text: str) -> int:
    """A number for a text, the same in every process."""
    return crc32(text.encode())


class Structures:
    """The structures of operations, each computed once.

    Compiled code joins one of two products and their sum into one rounding: the second. Which one that is follows from their
    structures, so that a sum has the same digits whatever was recorded before it.

    >>> x, y = ("input", "x"), ("input", "y")
    >>> one = Structures([x, y, ("mul", 0, 0), ("mul", 1, 1)])
    >>> other = Structures([y, x, ("mul", 0, 0), ("mul", 1, 1)])
    >>> one.turns(2, 3) != other.turns(2, 3)
    True
    """

    def __init__(self, operations: Sequence[Operation]) -> None:
        self.operations, self._numbers = operations, list[int]()

    def are_products(self, a: int, b: int) -> bool:
        """Whether two operations are products."""
        return self.operations[a][0] == self.operations[b][0] == "mul"

    def turns(self, a: int, b: int) -> bool:
        """Whether two operations change places."""
        numbers = self._numbers
        for operation in self.operations[len(numbers) : max(a, b) + 1]:
            kind = operation[0]
            if kind in TURNING:
                number = numbers[operation[1]] + numbers[operation[2]]
            elif kind == "const":
                number = crc32(repr(operation[1]).encode())
            elif kind == "input":
                number = _of_text(operation[1])
            else:
                number = hash(tuple([numbers[k] for k in operation[1:]]))
            numbers.append(hash((_of_text(kind), number)))
        return (numbers[a], a) > (numbers[b], b)
