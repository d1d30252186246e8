"""The vibration at once per turn, out of a signal and a mark on the shaft."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.marks import Marks, marks
from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import filled, floats, in_32_digits, is_doubled
from dalembert.dataclass import dataclass, field, replace

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

HARMONICS = 3
"""The number of orders that are fitted together, where a turn has samples enough."""
REFINED = 4
"""Steps of refinement in 32 digits, where one is not enough."""
BLOCK = 8192
"""Samples that are worked on together."""
SUDDEN = 1.5
"""No speed changes by this factor from one pulse of a mark to the next."""


@record
@dataclass(frozen=True, eq=False, repr=False)
class OncePerTurn:
    """The once-per-turn vector V of V e^{iωt} (t = 0 at the mark), a mean over turns."""

    vector: Complex
    """Mean over the turns, complex (s,)."""
    deviation: Real
    """Standard deviation of each component of the mean as the turns scatter, (s,); NaN with one turn."""
    speed: float
    """Mean speed, rad/s."""
    speed_deviation: float
    """Standard deviation of the speeds of single turns, rad/s; NaN with one turn."""
    turns: int
    phase_resolution: float = 0.0
    """The possible error of the phases, either way, from the samples at the edge of a mark of two levels, rad."""
    recording: tuple[Any, ...] = field(default=(), compare=False)
    """Times, signals, mark, pulses and tacho."""

    def error_estimate(self, exact: tuple[Any, ...] | None = None) -> OncePerTurn:
        """Return the rounding errors: by what the same formulas in 32 digits differ; of `vector` the length of the error.

        `exact`: times (n,), signals (n, s), mark (n,), pulses and tacho (n,) or None, in 32 digits; None: the floats.

        >>> t = np.arange(0, 1, 0.001)
        >>> found = once_per_turn(t, np.cos(40 * np.pi * t)[:, None], np.sin(40 * np.pi * t))
        >>> bool(found.error_estimate().vector[0] < 1e-13)
        True
        """
        true: Any = self.second_run(exact)
        vector = np.asarray(true.vector.off(self.vector))
        numbers = (
            np.where(
                np.isfinite(value := np.asarray(getattr(self, name))), getattr(true, name).off(value), np.nan
            )
            for name in ("deviation", "speed", "speed_deviation", "phase_resolution")
        )
        deviation, speed, of_speed, resolution = numbers
        return OncePerTurn(vector, deviation, float(speed), float(of_speed), self.turns, float(resolution))

    def second_run(self, exact: tuple[Any, ...] | None = None) -> OncePerTurn:
        """Return the same in 32 digits, of a recording as for `error_estimate`."""
        if exact is None:
            t, signal, mark, pulses, tacho = self.recording
            t, signal, mark = map(in_32_digits, (t, signal, mark))
            exact = t, signal, mark, pulses, None if tacho is None else in_32_digits(tacho)
        return _averaged(*exact)


def once_per_turn(
    t: ArrayLike, signal: ArrayLike, mark: ArrayLike, pulses: int = 1, tacho: ArrayLike | None = None
) -> OncePerTurn:
    """Find the once-per-turn vectors of signals in each turn between marks, and their mean.

    Parameters
    ----------
    t
        Times, rising, (n,), s.
    signal
        Vibration, (n, s).
    mark
        Any unit, (n,): it rises `pulses` times in a turn.
    pulses
        With several pulses in a turn, evenly spaced, t = 0 is the first one of the recording: the recording does
        not show which one of the shaft it is.
    tacho
        A second signal with several pulses in a turn, (n,), in addition to a mark that comes once: it gives the angle, and the mark
        where it is zero.

    Returns
    -------
    OncePerTurn
        `.vector` (s,) complex, in the unit of the signal; `.speed`, rad/s; `.turns`; `.phase_resolution`, rad.

    Raises
    ------
    ValueError
        Times that do not rise, not finite, fewer pulses than one turn has, turns with other numbers of pulses, or fewer than
        four samples in a turn.

    Notes
    -----
    From pulse to pulse the angle is a cubic of time, which is exact at a constant acceleration. In each turn the signal is fitted by a constant and up to three orders of
    cos and sin of that angle (least squares), so that neither the sampling nor other orders leak into the first;
    the mean over turns is the synchronous average of the first order.

    Examples
    --------
    >>> t = np.arange(0, 1, 0.001) + 0.0005
    >>> found = once_per_turn(t, 3 * np.cos(2 * np.pi * 20 * t + 0.5)[:, None], np.arange(1000) % 50 == 0)
    >>> np.abs(found.vector).round(9), np.angle(found.vector).round(9), round(found.speed / np.pi, 9), found.turns
    (array([3.]), array([0.5]), 40.0, 19)
    >>> round(float(np.degrees(found.phase_resolution)), 9)  # half a sample of 7.2 degrees
    3.6
    """
    time, x = np.asarray(t, dtype=float), np.asarray(signal, dtype=float)
    level = np.asarray(mark, dtype=float)
    if time.ndim != 1 or x.ndim != 2 or x.shape[0] != len(time) or level.shape != time.shape or len(time) < 2:
        raise ValueError(f"shapes do not fit: t {time.shape}, signal {x.shape}, mark {level.shape}")
    if not (np.isfinite(time).all() and np.isfinite(x).all() and np.isfinite(level).all()):
        raise ValueError("times, signal and mark must be finite")
    if not (np.diff(time) > 0).all():
        raise ValueError("the times must rise from row to row")
    if pulses < 1:
        raise ValueError(f"{pulses} pulses in a turn: expected one at least")
    knots = marks(time, level).at
    if len(knots) < pulses + 1:
        expected = (
            "two at least, a turn apart" if pulses == 1 else f"{pulses + 1} at least, a turn of {pulses}"
        )
        raise ValueError(f"the mark rises {len(knots)} time{'s' * (len(knots) != 1)}: expected {expected}")
    recording = time, x, level, pulses, None if tacho is None else np.asarray(tacho, dtype=float)
    if tacho is not None and pulses != 1:
        raise ValueError(
            "the pulses of a turn are counted from mark to mark where there is a tacho: expected no pulses"
        )
    return replace(_averaged(*recording), recording=recording)


def _averaged(time: Any, x: Any, level: Any, pulses: int, tacho: Any) -> OncePerTurn:
    """Return the vectors of a recording, of floats or of numbers in 32 digits."""
    rises = marks(time, level)
    if tacho is not None:
        knots, at, pulses, resolution = _counted(time, tacho, rises)
    else:
        knots, at = rises.at, rises.at[::pulses]
        _require_each(floats(knots))
        resolution = rises.resolution((len(at) - 1) * pulses / 2, pulses)
    each = at[1:] - at[:-1]
    vectors = _turns(time, x, at, knots, pulses)
    turns = len(each)
    mean = vectors.sum(axis=0) / turns
    deviation: Any = np.full(mean.shape, np.nan)
    of_speed: Any = np.nan
    if turns > 1:
        off = vectors - mean
        scatter = (off * off.conj()).real.sum(axis=0) / (turns - 1)
        deviation = np.sqrt(scatter / 2 / turns)
        speeds = 2 * np.pi / each
        spread = speeds - speeds.sum(axis=0) / turns
        of_speed = np.sqrt((spread * spread).sum(axis=0) / (turns - 1))
    speed = 2 * np.pi * turns / (at[-1] - at[0])
    if is_doubled(time):
        deviation, of_speed, sure = map(in_32_digits, (deviation, of_speed, speed * resolution))
        return OncePerTurn(mean, deviation, speed, of_speed, turns, sure)
    return OncePerTurn(mean, deviation, float(speed), float(of_speed), turns, float(speed * resolution))


def _require_each(knots: Real) -> None:
    """Raise ValueError where a pulse comes much sooner or later than the ones beside it."""
    apart = np.diff(knots)
    faster = apart[:-1] / apart[1:]
    odd = np.flatnonzero(np.maximum(faster, 1 / faster) > SUDDEN)
    if len(odd):
        k = int(odd[0])
        raise ValueError(
            f"the interval after the pulse at {knots[k + 1]:g} s is {1 / faster[k]:.3g} times the one before it: a pulse was missed "
            "between two samples, or noise was counted as one: expected even pulses longer than a sample, at a speed that changes slowly"
        )


def _counted(time: Any, tacho: Any, rises: Marks) -> tuple[Any, Any, int, Any]:
    """Return the times of a tacho's pulses, the marks between them, how many pulses a turn has, and the resolution, s."""
    if tacho.shape != time.shape or not np.isfinite(floats(tacho)).all():
        raise ValueError("the tacho must be finite, a value for each time")
    pulse = marks(time, tacho)
    knots = pulse.at
    if len(knots) < 2:
        raise ValueError(f"the tacho rises {len(knots)} times: expected several pulses in each turn")
    places = floats(knots)
    within = np.flatnonzero((floats(rises.at) >= places[0]) & (floats(rises.at) <= places[-1]))
    at = rises.at[within]
    if len(at) < 2:
        raise ValueError("the tacho has no whole turn from mark to mark")
    # pulses and marks may coincide: their whole number between marks is the rounded mean
    passed = np.interp(floats(at), places, np.arange(len(places)))
    pulses = round(float(passed[-1] - passed[0]) / (len(at) - 1))
    odd = np.flatnonzero(np.abs(np.diff(passed) - pulses) > 0.5)
    if pulses < 1 or len(odd):
        k = int(odd[0]) if len(odd) else 0
        period = float(passed[k + 1] - passed[k])
        raise ValueError(
            f"the turn at {floats(at)[k]:g} s has {period:.3g} pulses of the tacho: expected {max(pulses, 1)}, as others"
        )
    # turns begin at marks; from there on the pulses give the angle
    begin = float(passed[:-1].mean())
    of_tacho = pulse.slack(begin) + pulse.resolution(begin + pulses / 2, pulses)
    return knots, at, pulses, rises.slack(float(within[:-1].mean())) + of_tacho


def _turns(t: Any, x: Any, at: Any, knots: Any, pulses: int) -> Any:
    """Return the first order of every turn between marks, (turns, s); the angle grows evenly from pulse to pulse."""
    places, starts = floats(t), floats(at)
    first = np.searchsorted(places, starts)
    samples = np.diff(first)
    short = np.flatnonzero(samples < 4)
    if len(short):
        k = int(short[0])
        raise ValueError(f"the turn at {starts[k]:g} s has {samples[k]} samples: expected four at least")
    # of all samples of whole turns, and of the turns' beginnings: counted in pulses
    since = _interpolated(t[first[0] : first[-1]], knots), _interpolated(at[:-1], knots)
    turn = np.repeat(np.arange(len(samples)), samples)
    angle = (since[0] - since[1][turn]) * 2.0 * np.pi / float(pulses)
    orders = np.minimum(HARMONICS, (samples - 1) // 2)
    result = np.zeros_like(t, dtype=complex, shape=(len(samples), x.shape[1]))
    for order in np.unique(orders).tolist():
        alike = np.flatnonzero(orders == order)
        # turns one below the other, the shorter ones filled up, as many as the cache holds
        place = np.arange(samples[alike].max())
        for rows in np.array_split(alike, 1 + len(alike) * len(place) // BLOCK):
            there = place < samples[rows, None]
            index = np.where(there, first[rows, None] - first[0] + place, 0)
            signal = np.where(there[..., None], x[index + first[0]], 0.0)
            result[rows] = _first_order(angle[index], signal, there, order)
    return result


def _interpolated(t: Any, knots: Any) -> Any:
    """Return how many pulses there have been at times, parts of them by cubics.

    Each is the mean of the two parabolas through three pulses that share its part, the nearer one with more weight.
    """
    i = np.clip(np.searchsorted(floats(knots), floats(t), side="right") - 1, 0, len(knots) - 2)
    h = knots[1:] - knots[:-1]
    share = (t - knots[i]) / h[i]
    if len(h) == 1:
        return share + i
    # parabolas share + bend·share·(1 - share), with the part before and with the one after
    turn = (h[1:] - h[:-1]) / (h[1:] + h[:-1])
    before, after = turn * h[1:] / h[:-1], turn * h[:-1] / h[1:]
    before, after = np.concatenate([after[:1], before]), np.concatenate([after, before[-1:]])
    left = 1.0 - share
    return share * left * (left * before[i] + share * after[i]) + share + i


def _first_order(angle: Any, x: Any, there: Any, orders: int) -> Any:
    """Return the first order (k, s) of signals (k, n, s) by least squares, of a constant and some orders."""
    c, s = np.cos(angle), np.sin(angle)
    cosines, sines = [c], [s]
    for _ in range(orders - 1):
        cosines.append(cosines[-1] * c - sines[-1] * s)
        sines.append(sines[-1] * c + cosines[-2] * s)
    columns = [np.where(there, each, 0.0) for each in (filled(angle.shape, 1.0, angle), *cosines, *sines)]
    rows = np.stack(columns, axis=-1)
    q, r = np.linalg.qr(floats(rows))
    coefficients = np.linalg.solve(r, np.swapaxes(q, -1, -2) @ floats(x))
    if is_doubled(rows):
        # the gradient of what is left, in 32 digits, says by how much they are off
        coefficients = in_32_digits(coefficients)
        for _ in range(1 if np.linalg.cond(r).max() < 1e3 else REFINED):
            left = np.where(there[..., None], x - coefficients[..., 0, None, :], 0.0)
            for i, column in enumerate(columns[1:], 1):
                left = left - column[..., None] * coefficients[..., i, None, :]
            slopes = [left, *(column[..., None] * left for column in columns[1:])]
            slope: Any = np.stack([each.sum(axis=-2) for each in slopes], axis=-2)
            step = np.linalg.solve(np.swapaxes(r, -1, -2), slope.value)
            coefficients = coefficients + np.linalg.solve(r, step)
    result = np.zeros_like(angle, dtype=complex, shape=(len(rows), x.shape[-1]))
    result.real, result.imag = coefficients[..., 1, :], -coefficients[..., 1 + orders, :]
    return result
