"""What runs a loop: LLVM's code where it is installed and pays, else numpy on all lanes that are not done."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.choice import wanted
from dalembert.arithmetic.engines import blocks, llvm
from dalembert.arithmetic.loop import Loop

Reals = NDArray[np.float64]
# what an operation takes on floats, and of numpy's the call and each lane, s; the time from which compiling a loop pays
FLOATS, CALL, LANE = 4e-8, 1e-6, 1e-9
PAYS = 0.15
# of the code that is written: another number makes old files on disk useless
FORMAT = 2

_lock = threading.Lock()
_time: dict[Loop, float] = {}
_compiled: dict[Loop, Code | None] = {}


class Code:
    """Compiled code of one loop, and the engine that holds it in memory."""

    def __init__(self, loop: Loop, width: int, keeper: Any, address: int) -> None:
        self.loop, self.width, self._keeper = loop, width, keeper
        long = ctypes.c_int64
        kind = ctypes.CFUNCTYPE(None, long, *[ctypes.c_void_p] * 5, long)
        self._call = kind(address)

    def __call__(self, constants: Reals, state: Reals, fed: Reals, capacity: int) -> tuple[Reals, Reals]:
        """The state (s, n) after as many rounds as `capacity` at most, and what is kept of each, (rounds, kept, n)."""
        loop, width, n = self.loop, self.width, state.shape[1]
        groups = -(-n // width)
        # lanes that fill the last vector do the last lane's work again
        lanes = np.minimum(np.arange(groups * width), n - 1)
        constants, state = (self._vectors(of, lanes) for of in (constants, state))
        food = self._vectors(fed.reshape(-1, n), lanes)
        nodes = np.empty((groups, capacity, len(loop.kept), width))
        counts = np.empty(groups, dtype=np.int64)
        self._call(groups, *(of.ctypes.data for of in (constants, state, food, nodes, counts)), capacity)
        rounds = int(counts.max())
        kept = nodes[:, :rounds].transpose(1, 2, 0, 3).reshape(rounds, len(loop.kept), -1)[:, :, :n]
        if counts.min() < rounds:
            last = np.repeat(counts, width)[:n] - 1
            after = np.arange(rounds)[:, None] > last
            at = np.minimum(np.arange(rounds)[:, None], last)
            kept = np.where(after[:, None], np.take_along_axis(kept, at[:, None], axis=0), kept)
        return state.transpose(1, 0, 2).reshape(len(loop.states), -1)[:, :n], kept

    def _vectors(self, of: Reals, lanes: NDArray[np.intp]) -> Reals:
        """Rows of lanes as groups of rows of vectors."""
        return np.ascontiguousarray(
            of[:, lanes].reshape(len(of), len(lanes) // self.width, self.width).transpose(1, 0, 2)
        )


def run(
    loop: Loop,
    inputs: Mapping[str, Any],
    state: Mapping[str, Any],
    capacity: int,
    engine: str | None = None,
    fed: Mapping[str, Reals] | None = None,
) -> tuple[dict[str, Reals], dict[str, Reals]]:
    """Do rounds of a loop in every lane, until none goes on or `capacity` rounds are done.

    Parameters
    ----------
    loop : Loop
    inputs, state : mapping of name to float or array (n,)
        Constants and the state to begin with.
    engine : "numpy" or "llvm"
        Default: chosen by the work done so far.
    fed : mapping of name to array (capacity, n), optional
        What every round has of its own.

    Returns
    -------
    state : dict of name to array (n,)
    kept : dict of name to array (rounds, n)
        What a lane that is done has at its last round stays.

    Examples
    --------
    >>> from dalembert.arithmetic.loop import Calls
    >>> from dalembert.arithmetic.recorded import Recorder
    >>> again, quotient = Recorder(), Recorder()
    >>> inner = quotient.tape({"y": quotient.input("of") / quotient.input("x")})
    >>> calls, x, left = Calls(again, ["x"], ["y"]), again.input("x"), again.input("left")
    >>> (y,) = calls({"x": x})
    >>> body = again.tape({"x": 0.5 * (x + y), "left": left - 1.0} | calls.outputs)
    >>> given, state = {"of": np.array([2.0, 9.0])}, {"x": 1.0, "left": 6.0}
    >>> run(Loop(body, inner, ("x",)), given, state, 100)[0]["x"].round(6)
    array([1.414214, 3.      ])
    """
    n = max(np.size(x) for x in (*inputs.values(), *state.values()))
    constants = _rows(loop.constants, inputs, n)
    states = _rows(loop.states, state, n)
    food = np.empty((capacity, len(loop.fed), n))
    for i, name in enumerate(loop.fed):
        food[:, i] = (fed or {})[name]
    # compiled code does a round before it looks whether there is one
    code = ready(loop, engine) if capacity else None
    if code is not None:
        states, kept = code(constants, states, food, capacity)
    else:
        states, kept = _on_blocks(loop, constants, states, food)
        _spent(loop, len(kept) * (CALL + LANE * n))
    return (
        dict(zip(loop.states, states, strict=True)),
        {name: kept[:, i] for i, name in enumerate(loop.kept)},
    )


def ready(loop: Loop, engine: str | None = None) -> Code | None:
    """The compiled code of a loop, once so much time has gone into it that its making pays, and where it can be."""
    engine = engine or wanted()
    if engine == "llvm" or (engine is None and _time.get(loop, 0.0) > PAYS):
        return compiled(loop)
    return None


def on_floats(loop: Loop, rounds: int) -> None:
    """Note rounds of one lane that have been done on Python's floats."""
    _spent(loop, rounds * FLOATS)


def _spent(loop: Loop, each: float) -> None:
    _time[loop] = _time.get(loop, 0.0) + each * loop.cost


def forget() -> None:
    """Forget the time that has gone into loops."""
    _time.clear()


def compiled(loop: Loop) -> Code | None:
    """The code of a loop, made once; None where this machine or this loop is not for compiled code."""
    if loop.cost > 100 * llvm.LONGEST or max(loop.body.cost, loop.inner.cost) > llvm.LONGEST:
        return None
    with _lock:
        if loop not in _compiled:
            _compiled[loop] = _code(loop)
        return _compiled[loop]


def _code(loop: Loop) -> Code | None:
    def written(width: int) -> Any:
        from dalembert.arithmetic.engines.looped import looped

        return looped(loop, width)

    name = "|".join([f"rounds {FORMAT}", loop.body.key, loop.inner.key, *loop.kept, "fed", *loop.fed])
    library = llvm.loaded(name, "rounds", written)
    return None if library is None else Code(loop, *library)


def _rows(names: tuple[str, ...], of: Mapping[str, Any], n: int) -> Reals:
    rows = np.empty((len(names), n))
    for row, name in zip(rows, names, strict=True):
        row[:] = of[name]
    return rows


def _on_blocks(loop: Loop, constants: Reals, state: Reals, fed: Reals) -> tuple[Reals, Reals]:
    """Run the rounds by numpy, on the lanes that still go on."""
    tape, state = loop.whole, state.copy()
    places = {name: i for i, name in enumerate(loop.states)}
    every = (*loop.states, *loop.constants, *loop.fed)
    rows = [every.index(x) for x in tape.inputs]
    going = np.arange(state.shape[1])
    kept = []
    for food in fed:
        results = np.empty((len(places), len(going)))
        whole = (*state, *constants, *food)
        blocks.run(tape, [whole[i][going] for i in rows], results)
        state[:, going] = results
        kept.append(state[[places[name] for name in loop.kept]])
        going = going[results[places["left"]] > 0]
        if not len(going):
            break
    return state, np.reshape(kept, (-1, len(loop.kept), state.shape[1]))
