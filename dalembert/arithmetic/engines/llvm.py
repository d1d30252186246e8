"""The tape as machine code with explicit vectors, through llvmlite (the extra `fast`): no compiler is needed.

Compiled code is kept on disk in the platform's cache folder, by tape, processor and version; a damaged file or a folder
that cannot be written is ignored. Where a machine forbids making code at run time, one warning says so and numpy
does the work.
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
import warnings
from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic import circular
from dalembert.arithmetic.tape import Tape

Reals = NDArray[np.float64]
LONGEST = 8000  # operations: about a second to compile; numpy runs what is longer
SHORT = 500  # operations up to which two vectors are worked on in turn: one waits for a result while the other goes on
LANES = 8  # at most at a time
FORMAT = "9"  # of the code below: another number makes old files on disk useless

_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)
# kept for the life of the process: compiled code holds their addresses
_EXACT = {"sin": _FUNCTION(circular.sin), "cos": _FUNCTION(circular.cos)}
_lock = threading.Lock()
_compiled: dict[tuple[Tape, str, str], Code | None] = {}
_unusable: list[str] = []


class Code:
    """Compiled code of one tape, and the engine that holds it in memory; `width`: how many lanes it works on at a time."""

    def __init__(self, width: int, keeper: Any, address: int) -> None:
        self.width, self._keeper = width, keeper
        of = ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p
        self._call = ctypes.CFUNCTYPE(None, *of)(address)

    def __call__(self, inputs: Sequence[Reals], out: Sequence[Reals] | Reals, shape: tuple[int, int]) -> None:
        """Run: arrays as `run` takes them. At least one vector is done, and the last may do lanes again."""
        rows, columns = shape
        if columns < self.width:
            # the pieces that complex numbers are of lie apart here, as any two outputs
            wide = np.empty((len(out), 2 * self.width))
            inputs = [np.resize(x, self.width) if x.ndim else x for x in inputs]
            to = [
                row[::2] if x.strides[-1] == 16 else row[: self.width]
                for row, x in zip(wide, out, strict=True)
            ]
            for k in _pairs(out):
                to[k + 1] = wide[k, 1::2]
            self(inputs, to, (1, self.width))
            for x, row in zip(out, to, strict=True):
                x[:] = row[:columns]
            return
        inputs = [np.ascontiguousarray(x) if x.ndim else x for x in inputs]
        # numbers that all lanes share stand side by side: an address of each array's own costs more than the work
        shared = np.array([x.item() for x in inputs if not x.ndim])
        places = count(address(shared), shared.itemsize)
        addresses = np.array([address(x) if x.ndim else next(places) for x in inputs], dtype=np.uintp)
        results = np.array([address(x) for x in out], dtype=np.uintp)
        self.at(rows, columns, addresses, results)

    def at(self, rows: int, columns: int, addresses: NDArray[np.uintp], results: NDArray[np.uintp]) -> None:
        """Run on what lies at the addresses of inputs and outputs."""
        self._call(rows, columns, address(addresses), address(results))


class Steady:
    """Compiled code on the same lanes again and again: their addresses are looked up once.

    Parameters
    ----------
    code : Code
    lanes : sequence of array (n,) or None
        In the order of the inputs; None for a number.
    n, outputs : int
    tested : bool
        Whether the last output is a test.
    """

    def __init__(self, code: Code, lanes: Sequence[Reals | None], n: int, outputs: int, tested: bool) -> None:
        self.code, self.n, self.tested, self._lanes = code, n, tested, lanes
        places = count(0, 8)
        self._open = np.array([x is None for x in lanes], dtype=np.uintp)
        self._given = np.array([next(places) if x is None else address(x) for x in lanes], dtype=np.uintp)
        # the test is the first byte of a row of its own
        self._rows = np.arange(outputs, dtype=np.uintp) * np.uintp(8 * n)

    def __call__(self, numbers: Sequence[float]) -> tuple[Reals, bool]:
        """The outputs (outputs, n), and whether the test is positive in all lanes."""
        shared, table = np.array(numbers), np.empty((len(self._rows), self.n))
        addresses = self._given + self._open * np.uintp(address(shared))
        self.code.at(1, self.n, addresses, self._rows + np.uintp(address(table)))
        return (table[:-1], bool(table[-1].view(bool)[0])) if self.tested else (table, True)


def address(x: NDArray[Any]) -> int:
    """Where an array begins."""
    return int(x.__array_interface__["data"][0])


def _pairs(out: Sequence[Reals] | Reals) -> list[int]:
    """The outputs that lie in turn with the next one."""
    pairs: list[int] = []
    if not isinstance(out, np.ndarray):
        for k, x in enumerate(out):
            if x.strides[-1] == 16 and k - 1 not in pairs:
                pairs.append(k)
    return pairs


def run(tape: Tape, inputs: Sequence[Reals], out: Sequence[Any] | Reals, shape: tuple[int, int]) -> bool:
    """Run a tape; False where this machine or this tape is not for compiled code.

    Parameters
    ----------
    tape : Tape
    inputs : sequence of array
        (), (r, 1), (1, c) or (r, c); of one row also (c,).
    out : sequence of array
        Of each output (r, c), in one piece; or a bool of each row: whether it is positive in every column. Of one row also
        (c,). What lies in memory in turn with the next output is a part of a complex number.
    shape : (r, c)
        More than one row, and bools, take as many columns as a vector has.
    """
    if len(tape.operations) > LONGEST or _unusable or not len(out) or not min(shape):
        return False
    kinds = [_kind(x, *shape) for x in inputs]
    pairs = _pairs(out)
    results = ["h" if x.dtype == bool else "p" if k in pairs else "l" for k, x in enumerate(out)]
    code = _once(tape, "".join(kinds), "".join(results))
    if code is None:
        return False
    code(inputs, out, shape)
    return True


def steady(tape: Tape, lanes: Mapping[str, Reals], n: int, tested: bool) -> Steady | None:
    """A tape on the same lanes again and again, no fewer than a vector has; None where it is not for compiled code."""
    if len(tape.operations) > LONGEST or _unusable:
        return None
    inputs = [lanes.get(name) for name in tape.inputs]
    kinds = "".join("u" if x is None else "c" for x in inputs)
    results = "l" * (len(tape.outputs) - tested) + "h" * tested
    code = _once(tape, kinds, results)
    return None if code is None else Steady(code, inputs, n, len(tape.outputs), tested)


def _once(*key: Any) -> Code | None:
    with _lock:
        if key not in _compiled:
            _compiled[key] = _code(*key)
        return _compiled[key]


def _kind(x: Reals, rows: int, columns: int) -> str:
    """What an input is (see `lowered`); a grid of one row has columns alone."""
    if not x.ndim:
        return "u"
    if rows == 1 or len(x) < rows:
        return "c"
    return "r" if x.shape[1] < columns else "b"


def _code(tape: Tape, inputs: str, outputs: str) -> Code | None:
    from dalembert.arithmetic.engines.lowered import lowered

    def lanes(width: int) -> int:
        return min(2 * width, LANES) if len(tape.operations) <= SHORT else width

    code = loaded(
        f"{tape.key}|{inputs}|{outputs}", "tape", lambda width: lowered(tape, inputs, outputs, lanes(width))
    )
    return None if code is None else Code(lanes(code[0]), *code[1:])


def loaded(name: str, symbol: str, written: Callable[[int], Any]) -> tuple[int, Any, int] | None:
    """Code from disk, or compiled now and kept there: the vectors' width, what holds it in memory, and its address.

    Parameters
    ----------
    name : str
        What it is code of, the same in every process.
    symbol : str
        The function that is wanted.
    written : callable
        Its module for vectors of a width.

    Returns
    -------
    tuple, or None
        None where this machine is not for compiled code.
    """
    if _unusable:
        return None
    try:
        import llvmlite
        import llvmlite.binding as binding
    except ImportError:
        _unusable.append("llvmlite is not installed")
        return None
    try:
        binding.initialize_native_target()
        binding.initialize_native_asmprinter()
        _name_system_functions(binding)
        cpu, features = binding.get_host_cpu_name(), binding.get_host_cpu_features()
        width = 8 if features.get("avx512f") else 4 if features.get("avx2") else 2
        # whole vectors of 512 bits where the processor has them
        features_text = (
            ",".join([features.flatten(), "-prefer-256-bit"]) if width == 8 else features.flatten()
        )
        machine = binding.Target.from_default_triple().create_target_machine(
            cpu=cpu, features=features_text, opt=2, jit=True
        )
        whole = "|".join([FORMAT, llvmlite.__version__, cpu, features_text, sys.platform, name])
        path = folder() / (sha256(whole.encode()).hexdigest() + ".o")
        code = _read(path)
        if code is None:
            code = _made(binding, machine, written(width))
            _keep(path, code)
        empty = binding.parse_assembly("")
        engine = binding.create_mcjit_compiler(empty, machine)
        engine.add_object_file(binding.ObjectFileRef.from_data(code))
        engine.finalize_object()
        address = engine.get_function_address(symbol)
        if not address:
            raise RuntimeError("the compiled function is not found")
        return width, engine, address
    except Exception as error:
        # after any error of LLVM or the system numpy does the work, with one warning
        _unusable.append(str(error))
        warnings.warn(
            f"no code can be made at run time ({error}); numpy does the work", RuntimeWarning, stacklevel=2
        )
        return None


def _name_system_functions(binding: Any) -> None:
    library = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)
    if not hasattr(library, "atan2"):
        from ctypes.util import find_library

        library = ctypes.CDLL(find_library("m"))
    for name in ("sin", "cos", "atan2"):
        address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
        binding.add_symbol(f"dalembert_{name}", address)
    # what LLVM itself calls where the processor has no such operation
    binding.add_symbol("fma", ctypes.cast(library.fma, ctypes.c_void_p).value)
    for name, function in _EXACT.items():
        binding.add_symbol(f"dalembert_exact_{name}", ctypes.cast(function, ctypes.c_void_p).value)


def _made(binding: Any, machine: Any, written: Any) -> bytes:
    """The object code of a module."""
    module = binding.parse_assembly(str(written))
    module.verify()
    options = binding.create_pipeline_tuning_options(speed_level=1)
    binding.create_pass_builder(machine, options).getModulePassManager().run(
        module, binding.create_pass_builder(machine, options)
    )
    return bytes(machine.emit_object(module))


def folder() -> Path:
    """Where compiled code is kept: `DALEMBERT_CACHE`, else the platform's cache folder."""
    chosen = os.environ.get("DALEMBERT_CACHE")
    if chosen:
        return Path(chosen)
    home = Path.home()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "dalembert"


def _read(path: Path) -> bytes | None:
    """Code kept on disk, if it is whole: its own digest stands before it."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    code = data[32:]
    return code if code and sha256(code).digest() == data[:32] else None


def _keep(path: Path, code: bytes) -> None:
    """Keep code on disk: whole or not at all, and in silence where that cannot be."""
    partial = path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_bytes(sha256(code).digest() + code)
        os.replace(partial, path)
        # what one that was killed left of it; whoever still writes the same finds it done
        for left in path.parent.glob(f"{path.name}.*.part"):
            left.unlink(missing_ok=True)
    except OSError:
        try:
            partial.unlink(missing_ok=True)
        except OSError:
            return
