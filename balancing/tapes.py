"""Balancing on tapes: what a page needs to compute corrections anew, from the same functions as everywhere.

Corrections are linear in what they balance: what a vibration of 1 at each sensor asks of every plane comes from the same least
squares as everywhere (`qr`); the tape holds the vectors of the readings, their sums, sizes and angles.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from balancing.qr import smallest_squares
from dalembert.arithmetic.recorded import RECORDED, Recorder
from dalembert.arithmetic.tape import Tape

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Number = Any
Outputs = dict[str, Any]


def size_and_angle(name: str, z: Number) -> Outputs:
    """The outputs of a vector: its size, and its angle in (−π, π]."""
    return {f"{name} size": abs(z), f"{name} angle": RECORDED.angle(z)}


def vector(recorder: Recorder, name: str) -> Number:
    """A vector that enters by its parts."""
    return RECORDED.join(recorder.input(f"{name} x"), recorder.input(f"{name} y"))


def parts(name: str, z: Number) -> Outputs:
    """The outputs of a vector: its parts."""
    return {f"{name} x": z.real, f"{name} y": z.imag}


def measured(
    influence: Complex,
    weights: Real | None = None,
    ridge: float = 0.0,
    runs: int = 3,
    errors: tuple[float, float] | None = None,
    runout: Complex | None = None,
    covariance: Complex | None = None,
    unbalance: Complex | None = None,
) -> Tape:
    """The tape of a machine's sheet: stored coefficients, readings of an initial run and of runs with masses.

    Inputs are `run K amplitude S`, `run K phase S` and `run K there S` (1 where it tells of the initial vibration, else 0), `run K mass P`
    and `run K angle P` (the masses on the rotor in that run, nothing in the first), with `unbalance` also `run K read S` (1 where it was read, else 0). The initial vibration is the mean of what
    every run says of it that is there. Outputs: corrections, the vibration they leave, the trim after each run (the corrections
    less what stands; `fresh`: what its own reading alone asks for), what each run's reading is off, the vibration of each run as read
    (without the run-out) and as the coefficients expect it, and with stated errors of readings the standard deviations of the corrections and the trims.

    Parameters
    ----------
    influence : complex array (s, p)
        Amplitude per kg.
    weights : array (s,), optional
        As `balance.least_squares` takes them; `ridge` too.
    errors : (relative error of the amplitude, error of the phase in rad), optional
    runout : complex array (s,), optional
        What the sensors read of a rotor that runs true.
    covariance : complex array (s, p, p), optional
        E δδᴴ of the coefficients' errors, which count as independent of the readings.
    unbalance : complex array (s, p), optional
        The unbalance that explains a vibration of 1 at each sensor (`initial_unbalance`). Then `left K P` is what remains of it in each
        run, of the vibration as read, or as expected where a sensor was not read.
    """
    s, p = influence.shape
    off = np.zeros(s, dtype=complex) if runout is None else runout
    root = np.ones(s) if weights is None else np.sqrt(weights)
    # what a vibration of 1 at each sensor asks of every plane
    scaled = np.asarray(influence * root[:, None], dtype=complex)
    each = [smallest_squares(scaled, (one * root).astype(complex), ridge)[0] for one in np.eye(s)]
    solution = np.stack(each, axis=1)
    recorder = Recorder()
    outputs: Outputs = {}
    alpha = [[complex(x) for x in row] for row in influence.tolist()]
    standing = [
        [
            recorder.input(f"run {k} mass {j}") * RECORDED.turn(recorder.input(f"run {k} angle {j}"))
            for j in range(p)
        ]
        if k
        else [0j] * p
        for k in range(runs)
    ]
    read: list[list[Number]] = []
    initial: list[Number] = []
    for i in range(s):
        total, count, mine = 0j, 0.0, []
        for k in range(runs):
            there = recorder.input(f"run {k} there {i}")
            v = recorder.input(f"run {k} amplitude {i}") * RECORDED.turn(recorder.input(f"run {k} phase {i}"))
            v = v - complex(off[i])
            mine.append(v)
            own = v - sum((a * w for a, w in zip(alpha[i], standing[k], strict=True)), 0j) if k else v
            total, count = total + own * there, count + there
        read.append(mine)
        initial.append(total * (1.0 / count))
    corrections = [
        sum((complex(c) * v for c, v in zip(row, initial, strict=True)), 0j) for row in solution.tolist()
    ]
    for j, w in enumerate(corrections):
        outputs |= size_and_angle(f"plane {j}", w)
        for k in range(1, runs):
            outputs |= size_and_angle(f"trim {k} {j}", w - standing[k][j])
            last = sum((complex(c) * mine[k] for c, mine in zip(solution[j].tolist(), read, strict=True)), 0j)
            outputs |= size_and_angle(f"fresh {k} {j}", last)
    for i, v in enumerate(initial):
        left = v + sum((a * w for a, w in zip(alpha[i], corrections, strict=True)), 0j) + complex(off[i])
        outputs |= size_and_angle(f"residual {i}", left) | size_and_angle(f"initial {i}", v)
        for k in range(runs):
            expected = v + sum((a * w for a, w in zip(alpha[i], standing[k], strict=True)), 0j)
            outputs[f"off {k} {i}"] = abs(read[i][k] - expected)
            outputs |= {f"read {k} {i}": abs(read[i][k]), f"expected {k} {i}": abs(expected)}
    if unbalance is not None:
        for k in range(runs):
            left = [0j] * p
            for i, v in enumerate(initial):
                flag = recorder.input(f"run {k} read {i}")
                expected = v + sum((a * w for a, w in zip(alpha[i], standing[k], strict=True)), 0j)
                seen = read[i][k] * flag + expected * (1.0 - flag)
                left = [u + complex(one) * seen for u, one in zip(left, unbalance[i].tolist(), strict=True)]
            outputs |= {f"left {k} {j}": abs(u) for j, u in enumerate(left)}
    if errors is not None:
        # of the corrections, and of the trims, which differ from them by masses that are exact
        targets = {f"{j}": (j, w) for j, w in enumerate(corrections)} | {
            f"{k} {j}": (j, w - standing[k][j]) for k in range(1, runs) for j, w in enumerate(corrections)
        }
        for name, (j, w) in targets.items():
            along, across = 0.0, 0.0
            way = w.conjugate() * (1.0 / abs(w))
            for i, v in enumerate(initial):
                if covariance is not None:
                    # as likely in every direction
                    of_channel = covariance[i].tolist()
                    terms = [
                        (complex(c) * corrections[m].conjugate() * corrections[n]).real
                        for m, row in enumerate(of_channel)
                        for n, c in enumerate(row)
                    ]
                    half = sum(terms, 0.0) * (0.5 * abs(solution[j, i]) ** 2)
                    along, across = along + half, across + half
                turned = complex(solution[j, i]) * v * way
                a, b = turned * errors[0], turned * errors[1]
                along = along + a.real * a.real + b.imag * b.imag
                across = across + a.imag * a.imag + b.real * b.real
            outputs[f"along {name}"] = RECORDED.sqrt(along)
            outputs[f"across {name}"] = RECORDED.sqrt(across)
    return recorder.tape(outputs)


def split() -> Tape:
    """The tape of a correction on two places: `size`, `angle`, and the places' angles `first`, `second`.

    `first` and `second` are the shares of the two, `near first` and `near second` the mass on one of them that comes nearest where
    they do not stand on either side of the correction within half a turn, and `off first`, `off second` what is missed then.
    """
    recorder = Recorder()
    size, angle, first, second = (recorder.input(name) for name in ("size", "angle", "first", "second"))
    w, a, b = size * RECORDED.turn(angle), RECORDED.turn(first), RECORDED.turn(second)

    def across(z: Number, other: Number) -> Number:
        return z.real * other.imag - z.imag * other.real

    inverse = 1.0 / across(a, b)
    outputs: Outputs = {"first": across(w, b) * inverse, "second": across(a, w) * inverse}
    for name, arm in (("first", a), ("second", b)):
        mass = w.real * arm.real + w.imag * arm.imag
        outputs |= {f"near {name}": mass, f"off {name}": abs(across(w, arm))}
    return recorder.tape(outputs)
