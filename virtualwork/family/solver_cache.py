"""The solutions of parts of families that a process keeps for further requests."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock
from typing import Any

from numpy.typing import NDArray

from virtualwork.family.part import Part, Solver
from virtualwork.formulas.quantity import Quantity

_lock = Lock()
_solvers: dict[tuple[str, int], Solver] = {}
# parts whose solutions a process keeps for further questions
PARTS = 16


def answer(
    family: str,
    number: int,
    part: Part,
    keys: Sequence[Quantity],
    out: Sequence[NDArray[Any]] | None = None,
) -> tuple[list[Any], dict[int, str]]:
    """Quantities of a part, and why some of its variants have none; what a process has solved of it is kept.

    `family` names what has been asked of which variants, and `number` the part; `out` is where to write them.
    """
    with _lock:
        solver = _solvers.get((family, number))
        if solver is None:
            while len(_solvers) >= PARTS:
                _solvers.pop(next(iter(_solvers)), None)
            before = next((s for (name, _), s in list(_solvers.items()) if name == family), None)
            solver = _solvers[family, number] = Solver(part, before)
    return solver.values(keys, out), solver.reasons


def forget(family: str) -> None:
    """Let what this process keeps of a family go."""
    # called wherever a family is collected, in the midst of `answer` too: it must not wait for the lock
    for key in [key for key in list(_solvers) if key[0] == family]:
        _solvers.pop(key, None)
