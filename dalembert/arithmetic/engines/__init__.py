"""What runs a tape: floats for a few lanes, numpy for many, LLVM's code where it is installed and pays.

Which one runs is chosen here, by the size of the work and by what is installed; `DALEMBERT_ENGINE=python|numpy|llvm`
overrides. All agree to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.choice import checked, wanted
from dalembert.arithmetic.engines import blocks, floats
from dalembert.arithmetic.tape import EMPTY, Tape

R = TypeVar("R")
Reals = NDArray[np.float64]
Rows = Sequence[Reals] | Reals
Tables = Sequence[NDArray[Any]] | NDArray[Any]
NARROW = 32  # columns from which on few lanes of a grid are worked on as one
WIDEST = 8  # columns from which on compiled code takes a grid: its longest vector
FEW = 4  # lanes up to which Python's floats are faster than numpy's calls
PAYS = 3e8  # operations × lanes of one tape from which compiling it pays (some 0.1 s with the import)

_done: dict[Tape, float] = {}
_whole: ContextVar[int] = ContextVar("_whole", default=0)


class Outputs(Mapping[str, Any]):
    """The results of a run by name.

    Attributes
    ----------
    tape : Tape
    table : the row of each output, (lanes,), or a number where every input was one
    pairs : mapping of a row to the complex numbers of which it and the next one are the parts, (lanes,)
    """

    __slots__ = ("pairs", "table", "tape")

    def __init__(self, tape: Tape, table: Any, pairs: Mapping[int, NDArray[np.complex128]] = EMPTY) -> None:
        self.tape, self.table, self.pairs = tape, table, pairs

    def __getitem__(self, name: str) -> Any:
        return self.table[self.tape.rows[name]]

    def complex(self, real: str, imaginary: str) -> Any:
        """Two outputs as one complex number: without a copy where they are among the run's `pairs`."""
        row = self.tape.rows.get(real, -1)
        if row in self.pairs and self.tape.rows.get(imaginary) == row + 1:
            return self.pairs[row]
        x, y = self.get(real, 0.0), self.get(imaginary, 0.0)
        value = np.empty(np.broadcast_shapes(np.shape(x), np.shape(y)), complex)
        value.real, value.imag = x, y
        return value

    def __iter__(self) -> Iterator[str]:
        return iter(self.tape.names)

    def __len__(self) -> int:
        return len(self.tape.outputs)


def run(
    tape: Tape, inputs: Mapping[str, Any], engine: str | None = None, pairs: Iterable[str] = ()
) -> Outputs:
    """Run a tape on lanes.

    Parameters
    ----------
    tape : Tape
    inputs : mapping of name to float, or array (n,)
        A float is the same for every lane. Further names are ignored.
    engine : "python", "numpy" or "llvm"
        Default: chosen by the size of the work.
    pairs : names of outputs
        Each and the output after it are the parts of a complex number, and are laid side by side for it.

    Returns
    -------
    Outputs
        Mapping of an output's name to its values (n,), or a number where all inputs are numbers.

    Raises
    ------
    KeyError
        Where an input is missing.
    ValueError
        Where two inputs have different lengths, or the engine is unknown.

    Examples
    --------
    >>> from dalembert.arithmetic.recorded import RECORDED, Recorder
    >>> recorder = Recorder()
    >>> tape = recorder.tape({"x": recorder.input("r") * RECORDED.cos(recorder.input("q"))})
    >>> run(tape, {"r": 2.0, "q": np.array([0.0, 1.0])})["x"].round(3)
    array([2.   , 1.081])
    """
    values = [inputs[name] for name in tape.inputs]
    engine = engine or wanted()
    one = all(isinstance(value, float) for value in values)
    if one and engine in (None, "python") and floats.takes(tape):
        # one pose: nothing of numpy on the way, but at a singular place, where its numbers go on with infinity and NaN
        try:
            return Outputs(tape, floats.function(tape)(*values))
        except (ZeroDivisionError, ValueError, OverflowError):
            engine = "numpy"
    columns = [np.asarray(value, dtype=float) for value in values]
    lengths = {len(column) for column in columns if column.ndim}
    if len(lengths) > 1:
        raise ValueError(f"inputs of different lengths: {', '.join(map(str, sorted(lengths)))}")
    n = lengths.pop() if lengths else 1
    engine = checked(engine or chosen(tape, n))
    table, both = _table(len(tape.outputs), n, [tape.rows[name] for name in pairs])
    _lanes(tape, columns, table, n, engine)
    if any(column.ndim for column in columns):
        return Outputs(tape, table, both)
    return Outputs(tape, np.array([row[0] for row in table]))


def _table(rows: int, n: int, pairs: Iterable[int]) -> tuple[Rows, dict[int, NDArray[np.complex128]]]:
    """The rows of a run, one after the other in memory, and by its first row each pair, whose numbers lie in turn."""
    table = np.empty((rows, n))
    both = {row: table[row : row + 2].reshape(-1).view(complex) for row in pairs}
    if not both:
        return table, both
    result = list(table)
    for row, numbers in both.items():
        result[row], result[row + 1] = numbers.real, numbers.imag
    return result, both


def run_grid(
    tape: Tape, inputs: Mapping[str, Any], shape: tuple[int, int], out: Tables | None = None
) -> Tables:
    """Run a tape over a grid, every row with every column, such as variants with poses.

    Parameters
    ----------
    tape : Tape
    inputs : mapping of name to number, or array that broadcasts to the shape
        What depends on the row alone is (r, 1), on the column alone (1, c).
    shape : (r, c)
    out : sequence of array, optional
        Where to write each output: (r, c), in one piece, or the parts of a complex array of one piece, one after the
        other. Or of bool, (r,): whether the output is positive in every column of the row.

    Returns
    -------
    sequence of array
        `out`, or new arrays (r, c).
    """
    r, c = shape
    table: Tables = np.empty((len(tape.outputs), r, c)) if out is None else out
    arrays = [np.asarray(inputs[name], dtype=float) for name in tape.inputs]
    arrays = [x.reshape(()) if x.size == 1 else x for x in arrays]
    engine = wanted() or chosen(tape, r * c)
    wide = r > 1 and (engine == "numpy" or (engine == "llvm" and c >= WIDEST))
    if wide and engine == "llvm" and _on_llvm(tape, arrays, table, shape):
        return table
    # few lanes are done sooner than a tape is prepared
    if wide and (c >= NARROW or lanes_in_all(r * c) > blocks.NARROW):
        from dalembert.arithmetic.engines import grids

        grids.run(tape, arrays, shape, table)
        return table
    # every lane by itself
    flat = [(x if x.shape == shape else np.broadcast_to(x, shape)).ravel() if x.ndim else x for x in arrays]
    tests = {k: np.empty((r, c)) for k, x in enumerate(table) if x.dtype == bool}
    rows = [tests.get(k, x).reshape(r * c) for k, x in enumerate(table)]
    _lanes(tape, flat, rows, r * c, engine)
    for k, test in tests.items():
        table[k][:] = test[:, 0] > 0 if c == 1 else (test > 0).all(axis=1)
    return table


class Repeated:
    """A tape that is run again and again on the same lanes, with other numbers: what can be got ready is, once.

    Parameters
    ----------
    tape : Tape
    lanes : mapping of name to array (n,)
        The other inputs are numbers.
    tested : bool
        Whether of the last output is wanted only if it is positive in every lane.

    Examples
    --------
    >>> from dalembert.arithmetic.recorded import RECORDED, Recorder
    >>> recorder = Recorder()
    >>> r, q = recorder.input("r"), recorder.input("q")
    >>> tape = recorder.tape({"x": r * RECORDED.cos(q), "test": r - q})
    >>> again = Repeated(tape, {"q": np.array([0.0, np.pi])}, tested=True)
    >>> again({"r": 2.0}), again({"r": 4.0})
    ((array([[ 2., -2.]]), False), (array([[ 4., -4.]]), True))
    """

    def __init__(self, tape: Tape, lanes: Mapping[str, Reals], tested: bool = False) -> None:
        self.tape, self.tested = tape, tested
        self.lanes = {name: np.ascontiguousarray(x, dtype=float) for name, x in lanes.items()}
        self.n = len(next(iter(self.lanes.values())))
        self._numbers = [name for name in tape.inputs if name not in lanes]
        self._columns = [(name, self.lanes.get(name)) for name in tape.inputs]
        self._blocks = blocks.compiled(tape, frozenset(self._numbers))
        self._steady: Any = None

    def __call__(self, numbers: Mapping[str, float]) -> tuple[Reals, bool]:
        """The outputs, (outputs, n), without the test; and whether it holds."""
        engine = wanted() or chosen(self.tape, self.n)
        if engine == "llvm" and self.n >= WIDEST:
            from dalembert.arithmetic.engines import llvm

            self._steady = self._steady or llvm.steady(self.tape, self.lanes, self.n, self.tested)
            if self._steady is not None:
                return self._steady([numbers[name] for name in self._numbers])  # type: ignore[no-any-return]
        table = np.empty((len(self.tape.outputs), self.n))
        columns = [numbers[name] if x is None else x for name, x in self._columns]
        if engine == "python":
            _lanes(self.tape, list(map(np.asarray, columns)), table, self.n, engine)
        else:
            self._blocks(columns, table)
        return (table[:-1], bool((table[-1] > 0).all())) if self.tested else (table, True)


def lanes_in_all(n: int) -> int:
    """The lanes of the whole work of which n lanes are a part (`as_part`); n where they are no part."""
    return _whole.get() or n


def chosen(tape: Tape, n: int) -> str:
    """The engine for n lanes: compiled code only after so many requests of the tape that it pays."""
    if lanes_in_all(n) <= FEW:
        return "python"
    return "llvm" if work_on(tape, n) > PAYS else "numpy"


def work_on(tape: Tape, n: int) -> float:
    """The work on a tape so far, n lanes more: lanes × operations; of a part of a whole, that of the whole."""
    whole = _whole.get()
    if whole:
        return float(whole * tape.cost)
    _done[tape] = _done.get(tape, 0.0) + n * tape.cost
    return _done[tape]


def as_part(lanes: int, function: Callable[..., R], *arguments: Any) -> R:
    """Call a function on a part of work of so many lanes in all: the engine is chosen by these alone.

    Then no digit depends on what else a process has done, and on how many processes there are.
    """
    before = _whole.set(lanes)
    try:
        return function(*arguments)
    finally:
        _whole.reset(before)


def anew() -> None:
    """Forget the work done so far: which engine does what follows depends on that alone, in whatever process."""
    from dalembert.arithmetic.engines import rounds

    _done.clear()
    rounds.forget()


def compiled_code() -> bool:
    """Whether LLVM's code may run here, as far as one can say without loading it."""
    from importlib.util import find_spec

    return find_spec("llvmlite") is not None


def _lanes(tape: Tape, columns: list[Reals], table: Rows, n: int, engine: str) -> None:
    """Run a tape on lanes: inputs (n,) or (), a row an output."""
    if engine == "python" and floats.takes(tape):
        _on_floats(tape, columns, table, n)
    elif not (engine == "llvm" and _on_llvm(tape, columns, table, (1, n))):
        blocks.run(tape, columns, table)


def _on_floats(tape: Tape, columns: list[Reals], table: Rows, n: int) -> None:
    function = floats.function(tape, n)
    # a tape without inputs has its lanes too
    lanes = zip(*(np.broadcast_to(c, n).tolist() for c in columns), strict=True) if columns else [()] * n
    for lane, values in enumerate(lanes):
        try:
            for row, value in zip(table, function(*values), strict=True):
                row[lane] = value
        except (ZeroDivisionError, ValueError, OverflowError):
            blocks.run(tape, [np.array([value]) for value in values], [row[lane : lane + 1] for row in table])


def _on_llvm(tape: Tape, inputs: list[Reals], table: Tables, shape: tuple[int, int]) -> bool:
    # llvmlite takes some 0.1 s to load: only where it works
    from dalembert.arithmetic.engines import llvm

    return llvm.run(tape, inputs, table, shape)
