"""Bounds of the rounding errors of formulas on arrays: run once on recorded numbers, a formula leaves its tape.

A formula does with its arrays what numpy does with any kind of number: sums, products, quotients, roots, matrices.
The adjoint of its tape (`rounding`) bounds its own rounding and carries on what its numbers are off by.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.recorded import Recorder
from dalembert.arithmetic.rounding import FEW, bounds_of_few, rounding_bounds
from dalembert.arithmetic.tape import Tape

Array = NDArray[np.float64]
Shapes = tuple[tuple[int, ...], ...]
Formula = Callable[..., Sequence[Any]]

CONSTANT = 1.0
"""A constant such as 0.4 errs by one rounding."""


Given = tuple[ArrayLike, int, ArrayLike]
"""Numbers that enter a formula (..., *own), how many last axes are a vector's or tensor's own, and what they are off by.

The other axes are lanes, which the formula keeps apart.
"""


def read(value: ArrayLike, axes: int, relative: float) -> Given:
    """Return numbers that may be off by as much of themselves."""
    return value, axes, relative * np.abs(np.asarray(value, dtype=float))


def bounds(formula: Formula, inputs: Mapping[str, Given], *options: Hashable) -> list[Array]:
    """Bound the errors of what a formula gives, in its shapes; of a complex number: the size of its error.

    Parameters
    ----------
    formula
        Takes the options, then the numbers by name, each with one axis of lanes in front; returns arrays (lanes, ...).
    given
        By name; the leading axes broadcast.

    Examples
    --------
    What is left of a difference is all error; the quotient's is half a unit in its last place:

    >>> (bound,) = bounds(lambda a, b: [a / 3 - b], {"a": ([1.0, 2.0], 0, 0.0), "b": (1 / 3, 0, 0.0)})
    >>> [float(round(x * 2**53, 3)) for x in bound]
    [0.25, 0.75]
    """
    arrays = {name: np.asarray(value, dtype=float) for name, (value, _, _) in inputs.items()}
    own = {name: array.shape[array.ndim - inputs[name][1] :] for name, array in arrays.items()}
    lead = np.broadcast_shapes(*(x.shape[: x.ndim - len(own[name])] for name, x in arrays.items()))
    tape, shapes = _taped(formula, options, tuple(own.items()))
    entering: dict[str, Any] = {}
    errors: list[str] = []
    for name, (_, _, error) in inputs.items():
        entering |= _lanes(name, arrays[name], own[name], lead)
        if np.any(error):
            off = _lanes(f"off {name}", np.asarray(error, dtype=float), own[name], lead)
            errors += [key.removeprefix("off ") for key in off]
            entering |= off
    result = _bounded(tape, tuple(name for name in errors if name in tape.inputs), entering, math.prod(lead))
    results = []
    for number, shape in enumerate(shapes):
        bound = np.zeros((math.prod(lead), math.prod(shape)))
        for k in range(bound.shape[1]):
            parts = [
                result[f"error({part} {number} {k})"] for part in PARTS if f"{part} {number} {k}" in result
            ]
            bound[:, k] = parts[0] if len(parts) == 1 else np.hypot(*parts)
        results.append(bound.reshape(lead + shape))
    return results


PARTS = ("real", "imag")


@lru_cache(maxsize=512)
def _taped(
    formula: Formula, options: tuple[Hashable, ...], own: tuple[tuple[str, tuple[int, ...]], ...]
) -> tuple[Tape, Shapes]:
    """What a formula does with one lane of numbers of these shapes, and the shapes of its results."""
    recorder = Recorder()
    numbers = {}
    for name, shape in own:
        entries = np.empty(math.prod(shape), dtype=object)
        entries[:] = [recorder.input(f"{name} {k}") for k in range(entries.size)]
        numbers[name] = entries.reshape(1, *shape)
    results = [np.asarray(x, dtype=object) for x in formula(*options, **numbers)]
    outputs = {
        f"{part} {number} {k}": getattr(value, part)
        for number, result in enumerate(results)
        for k, value in enumerate(result.flat)
        for part in PARTS
        if part == "real" or not _real(value)
    }
    return recorder.tape(outputs), tuple(result.shape[1:] for result in results)


def _real(value: Any) -> bool:
    return isinstance(value.imag, (int, float)) and value.imag == 0


def _lanes(name: str, array: Array, own: tuple[int, ...], lead: tuple[int, ...]) -> dict[str, Any]:
    """The numbers of arrays (..., *own) by lane, (n,) each; one for all lanes as such."""
    if array.size == math.prod(own):
        return {f"{name} {k}": x for k, x in enumerate(array.ravel().tolist())}
    rows = np.broadcast_to(array, lead + own).reshape(-1, math.prod(own)).T
    return {f"{name} {k}": row for k, row in enumerate(np.ascontiguousarray(rows))}


def _bounded(
    tape: Tape, errors: tuple[str, ...], entering: Mapping[str, Any], lanes: int
) -> Mapping[str, Any]:
    if lanes <= FEW:
        inputs = {name: f"off {name}" for name in errors}
        return bounds_of_few(tape, entering, inputs, tape.names, CONSTANT)
    # not loaded where few are asked for
    from dalembert.arithmetic.engines import run

    return run(_written(tape, errors), entering)


@lru_cache(maxsize=64)
def _written(tape: Tape, errors: tuple[str, ...]) -> Tape:
    return rounding_bounds(tape, {name: f"off {name}" for name in errors}, constants=CONSTANT)
