"""A log of runs fitted all at once: initial vibration and influence coefficients are unknown together.

For each sensor and operating state (one channel) the reading of run j, with the masses w on the rotor, is

    y_j = x₀ + Σ_p α_p w_jp + ε_j,

linear in the unknowns θ = (x₀, α). Every run has its error, the initial one too: weighted least squares of complex
numbers (Goodman 1964; Seber and Lee, Linear Regression Analysis, 2nd ed., ch. 3 and 10), by QR. The errors ε are
circular, E|ε|² = σ²/weight, of one σ for all channels of a machine. An initial run with a trial run for each plane is
the fit with nothing to spare: x₀ is the initial reading, and α follows from the differences (`influence_coefficients`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.dependence import DependentTrials, Unseen, adjoint, design, directions, threshold
from balancing.influence import loads_of
from balancing.qr import factors
from balancing.reading_errors import Errors
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import (
    as_array,
    as_vectors,
    filled,
    floats,
    in_32_digits,
    is_doubled,
    spread_to,
)

if TYPE_CHECKING:
    from matplotlib.figure import FigureBase
    from matplotlib.projections.polar import PolarAxes

    from dalembert.arithmetic.doubled_arrays import Vectors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Undetermined(Unseen):
    """The runs do not determine x₀ and α: their `combination` (1 + p,), x₀ first, has no effect at `case`."""


@record
@dataclass(frozen=True, eq=False, repr=False)
class Foreknown:
    """The prior knowledge in a fit."""

    plain: JointFit
    """The runs alone: of least norm where they do not determine the unknowns."""
    sources: Complex
    """Errors of θ for errors z, E|z|² = 1, of the prior knowledge, (..., s, 1 + p, q)."""
    degrees_of_freedom: Real
    """Complex, of the estimate that these are, (...)."""
    again: Callable[[], Vectors]
    """Computes the unknowns in 32 digits."""


@record
@dataclass(frozen=True, eq=False, repr=False)
class JointFit:
    """Initial vibration and influence coefficients of every channel, fitted by `joint_fit`."""

    readings: Complex
    """(..., r, s); NaN where a run lacks a channel."""
    masses: Complex
    """The masses ON the rotor, (..., r, p)."""
    weights: Real | None
    """(..., r, s)."""
    unknowns: Complex
    """θ = (x₀, α), (..., s, 1 + p)."""
    gain: Complex
    """θ = gain y, (..., s, 1 + p, r); 0 where a reading is missing."""
    leverage: Real
    """h, how far a reading is its own fitted value, in [0, 1], (..., r, s)."""
    count: NDArray[np.intp] | None = None
    """The number of unknowns that the runs determine, (...), if these are not all."""
    foreknown: Foreknown | None = None
    """The prior knowledge of the fit, if there is any: see `balancing.prior`."""

    def machine(self, i: int) -> JointFit:
        """Return the fit of one of many machines, along the leading axis."""
        parts = (self.readings, self.masses, self.unknowns, self.gain, self.leverage)
        y, t, unknowns, gain, leverage = (part[i] for part in parts)
        weights, count = (None if part is None else part[i] for part in (self.weights, self.count))
        prior = self.foreknown
        if prior is not None:
            again = partial(_of_machine, prior.again, i)
            prior = Foreknown(prior.plain.machine(i), prior.sources[i], prior.degrees_of_freedom[i], again)
        return JointFit(y, t, weights, unknowns, gain, leverage, count, prior)

    def without(self, runout: Complex) -> JointFit:
        """Return the fit with the run-out (..., s) subtracted from every reading."""
        unknowns = self.unknowns.copy()
        unknowns[..., 0] -= runout
        prior = self.foreknown
        if prior is not None:
            again = partial(_without, prior.again, runout)
            prior = replace(prior, plain=prior.plain.without(runout), again=again)
        return replace(
            self, readings=self.readings - runout[..., None, :], unknowns=unknowns, foreknown=prior
        )

    @property
    def alone(self) -> JointFit:
        """The fit of the runs alone: itself, without prior knowledge."""
        return self if self.foreknown is None else self.foreknown.plain

    @property
    def initial(self) -> Complex:
        """x₀, the vibration without masses, (..., s)."""
        return self.unknowns[..., 0]

    @property
    def influence(self) -> Complex:
        """α, (..., s, p), amplitude per kg."""
        return self.unknowns[..., 1:]

    @cached_property
    def present(self) -> NDArray[np.bool_]:
        """Which channels were read in which run, with a weight, (..., r, s)."""
        read = np.isfinite(self.readings)
        return read if self.weights is None else read & (self.weights > 0)

    @cached_property
    def residuals(self) -> Complex:
        """Reading less fitted value, (..., r, s); NaN where there is no reading, 0 within rounding."""
        left = self.readings - self.fitted(self.masses)
        size = np.abs(design(floats(self.masses))) @ np.swapaxes(np.abs(floats(self.unknowns)), -1, -2)
        noise = 16 * EPS * (np.abs(floats(self.readings)) + size)
        return as_vectors(np.where(np.abs(floats(left)) <= noise, 0.0, left))

    def again(self, readings: Complex) -> JointFit:
        """Return the fit of other readings of the same channels in the same runs, (..., r, s)."""
        y = np.swapaxes(np.where(self.present, readings, 0.0), -1, -2)
        return replace(self, readings=readings, unknowns=np.matvec(self.gain, y))

    def plot(
        self, sensors: Sequence[str] = (), amplitude: str = "", figure: FigureBase | None = None
    ) -> PolarAxes:
        """Draw one machine's readings, each joined to its fitted value, and the vibration without masses.

        Returns matplotlib's polar axes. Without a figure it is a new one of pyplot's; without matplotlib (the extra
        `plot`) an ImportError.
        """
        from balancing.picture import readings

        here, names = self.present, sensors or [str(k + 1) for k in range(self.initial.shape[-1])]
        pairs = self.readings[here], (self.readings - self.residuals)[here]
        return readings(names, self.initial, *pairs, amplitude, figure=figure)

    def fitted(self, masses: ArrayLike) -> Complex:
        """Return the vibration with these masses on, (..., k, p) -> (..., k, s)."""
        return as_vectors(design(as_vectors(masses)) @ np.swapaxes(self.unknowns, -1, -2))

    @cached_property
    def degrees_of_freedom(self) -> NDArray[np.intp]:
        """ν: complex readings less complex unknowns that they determine, (...)."""
        if self.foreknown is not None:
            return self.alone.degrees_of_freedom
        unknowns = self.unknowns.shape[-2] * self.unknowns.shape[-1] if self.count is None else self.count
        return np.asarray(self.present.sum(axis=(-2, -1)) - unknowns)

    @cached_property
    def sum_of_squares(self) -> Real:
        """Σ weight·|residual|², (...); of the runs alone."""
        if self.foreknown is not None:
            return self.alone.sum_of_squares
        square = np.square(np.abs(np.where(self.present, self.residuals, 0.0)))
        return as_array((square if self.weights is None else self.weights * square).sum(axis=(-2, -1)))

    @cached_property
    def residual_sd(self) -> Real:
        """s = √(Σ weight·|residual|²/ν), (...); NaN where no degree of freedom is left."""
        left = np.asarray(self.degrees_of_freedom, dtype=float)
        return as_array(np.sqrt(self.sum_of_squares / np.where(left > 0, left, np.nan)))

    @cached_property
    def standardized(self) -> Real:
        """|residual|/(s √(1 - h)), the internally studentised residual, (..., r, s); NaN where there is none.

        Where h is 1 the reading alone determines an unknown and has no residual. Of the runs alone.
        """
        if self.foreknown is not None:
            return self.alone.standardized
        free = np.where(self.leverage < 1 - 1e-9, 1 - self.leverage, np.nan)
        root = 1.0 if self.weights is None else np.sqrt(self.weights)
        sd = self.residual_sd[..., None, None]
        size = np.abs(self.residuals) * root
        return np.asarray(np.where(size > 0, size / np.where(sd > 0, sd, np.nan), 0.0 * sd) / np.sqrt(free))

    def error_estimate(self) -> Real:
        """Return the rounding errors of the unknowns, (..., s, 1 + p): readings, masses and prior knowledge taken as exact.

        >>> fit = joint_fit([[5], [7], [9.5]], [[0], [1], [2]])
        >>> bool((fit.error_estimate() < 1e-14).all())
        True
        """
        from dalembert.arithmetic.doubled_arrays import Vectors

        if self.foreknown is not None:
            return self.foreknown.again().off(self.unknowns)
        readings = Vectors.of(np.where(self.present, self.readings, 0.0))
        return self.second_run(readings, Vectors.of(self.masses)).off(self.unknowns)

    def second_run(self, readings: Vectors, masses: Vectors) -> Vectors:
        """Return the unknowns (..., s, 1 + p) in 32 digits, of readings (..., r, s) and masses (..., r, p) in 32 digits.

        Where a reading is missing any number stands. Of the runs alone: prior knowledge has its own (`Foreknown.again`).
        """
        from balancing.second_run import smallest_squares
        from dalembert.arithmetic.doubled import Doubled
        from dalembert.arithmetic.doubled_arrays import Vectors
        from dalembert.arithmetic.doubled_functions import DOUBLED
        from dalembert.arithmetic.doubled_operations import part

        weights = np.where(self.present, 1.0 if self.weights is None else self.weights, 0.0)
        of_rows = DOUBLED.sqrt(Doubled(np.swapaxes(weights, -1, -2)))
        ones = Vectors.of(np.ones((*masses.shape[:-1], 1)))
        rows = Vectors.joined([ones, masses], axis=-1)[..., None, :, :] * part(of_rows, (..., None))
        by_channel: Any = np.swapaxes(cast("Any", readings), -1, -2)
        return smallest_squares(rows, -by_channel * of_rows)[0]

    def scatter(self) -> Errors:
        """Return the errors of readings as the residuals show them: s/√2 in each component."""
        each = np.broadcast_to(self.residual_sd[..., None, None] / np.sqrt(2), self.readings.shape)
        if self.weights is not None:
            each = np.where(self.present, each / np.sqrt(np.where(self.present, self.weights, 1.0)), 0.0)
        ones = np.ones(self.readings.shape, dtype=complex)
        return Errors(ones, each, each, np.asarray(self.degrees_of_freedom, dtype=float))

    def known(self, sd: ArrayLike, degrees_of_freedom: ArrayLike = np.inf) -> Errors:
        """Return errors of √E|ε|² = sd, (...), with this number of complex degrees of freedom."""
        each = as_array(sd)[..., None, None]
        each = np.broadcast_to(each / np.sqrt(filled((), 2.0, each)), self.readings.shape)
        nu = np.broadcast_to(np.asarray(degrees_of_freedom, dtype=float), self.readings.shape[:-2])
        return Errors(np.ones(self.readings.shape, dtype=complex), each, each, nu)

    def stated(self, amplitude: float, phase: float) -> Errors:
        """Return errors that are known: relative ones of the amplitude, and those of the phase in rad."""
        read = np.where(self.present, self.readings, 0.0)
        unit, size = directions(read), np.abs(read)
        degrees, ones = np.full(self.readings.shape[:-2], np.inf), np.ones(size.shape)
        return Errors(unit, amplitude * size, phase * size, degrees, phase * ones, ones > 0)


def _of_machine(again: Callable[[], Vectors], i: int) -> Vectors:
    return again()[i]


def _without(again: Callable[[], Vectors], runout: Complex) -> Vectors:
    from dalembert.arithmetic.doubled_arrays import Vectors

    unknowns = again()
    unknowns[..., 0] = unknowns[..., 0] - Vectors.of(runout)
    return unknowns


def joint_fit(readings: ArrayLike, masses: ArrayLike, weights: ArrayLike | None = None) -> JointFit:
    """Fit initial vibration and influence coefficients of all channels to all runs at once.

    Parameters
    ----------
    readings
        Vibration, complex (..., r, s): runs and channels (a sensor in an operating state or at a speed). NaN where a
        run lacks the channel. A channel that was read twice in a run takes two rows of equal masses.
    masses
        The masses ON the rotor in each run, complex (..., r, p), kg. No run need be without masses.
    weights
        One over the readings' variances, in any common unit, (..., r, s). Default 1 each.

    Returns
    -------
    JointFit
        `.initial` (..., s), `.influence` (..., s, p), `.residuals` (..., r, s), `.residual_sd`,
        `.degrees_of_freedom` (...).

    Raises
    ------
    Undetermined
        The runs do not determine every unknown of a channel; what leaves no trace is named.
    ValueError
        Infinite, or shapes that do not fit.

    Notes
    -----
    Channels are independent of one another, and each is a QR of its rows (1, w_j), columns scaled by powers of two and
    rows in the order of their size (`balancing.qr`); the normal equations are never formed. Leading axes are machines
    of like shape, all solved in one go. Runs with the same masses count as their mean; where there are but as many
    different loads as unknowns, and one of them is none, the means alone are solved, and nothing is rounded in x₀.

    Examples
    --------
    Three runs of one sensor, none of them without a mass: 80 µm at 40°, 2 µm/kg at 150°.

    >>> at = lambda size, degrees: size * np.exp(1j * np.radians(degrees))
    >>> on = np.array([[at(10, -90)], [at(30, -60)], [at(20, 100)]])
    >>> fit = joint_fit(at(80, 40) + at(2, 150) * on, on)
    >>> np.abs(fit.initial).round(9), np.abs(fit.influence).round(9), int(fit.degrees_of_freedom)
    (array([80.]), array([[2.]]), 1)
    """
    y = np.asarray(readings, dtype=complex)
    t = np.asarray(masses, dtype=complex)
    if y.ndim < 2 or t.ndim < 2 or y.shape[:-1] != t.shape[:-1] or 0 in y.shape[-2:]:
        raise ValueError(f"shapes do not fit: readings {y.shape}, masses {t.shape}")
    if np.isinf(y).any() or not np.isfinite(t).all():
        raise ValueError("masses must be finite, and readings finite or NaN")
    present = np.isfinite(y)
    rows = design(t)[..., None, :, :]
    root: Real | None = None
    w: Real | None = None
    if weights is not None:
        w = spread_to("weights", weights, y.shape)
        if not ((w >= 0) & (w < np.inf)).all():
            raise ValueError("weights must be finite and not negative")
        root = np.sqrt(w) * present
    elif not present.all():
        root = present.astype(float)
    if w is None and (loads := loads_of(t, present)) is not None:
        try:
            return JointFit(y, t, None, *loads.solve(y))
        except DependentTrials:
            pass  # what the runs do not determine is named below
    b = np.swapaxes(np.where(present, y, 0.0), -1, -2)
    if root is not None:
        # where nothing is missing one QR serves all channels
        root = np.swapaxes(root, -1, -2)
        rows, b = root[..., None] * rows, root * b
    if rows.shape[-2] < rows.shape[-1]:
        _require(rows[..., :1, :], rows)
    q, r, scale = factors(rows)
    _require(r, rows)
    back = adjoint(q)
    unknowns = scale * np.linalg.solve(r, np.matvec(back, b)[..., None])[..., 0]
    gain = scale[..., None] * np.linalg.solve(r, back)
    leverage = np.square(np.abs(q)).sum(axis=-1)
    if root is not None:
        gain = gain * root[..., None, :]
    gain = np.broadcast_to(gain, (*unknowns.shape, y.shape[-2]))
    leverage = np.swapaxes(np.broadcast_to(leverage, b.shape), -1, -2)
    return JointFit(y, t, w, np.asarray(unknowns + 0.0), gain, leverage)


def initial_alone(readings: ArrayLike, influence: ArrayLike) -> JointFit:
    """Fit only the initial vibration, to runs without masses; the influence coefficients are given.

    Parameters
    ----------
    readings
        As for `joint_fit`, (..., r, s), each channel read once at least.
    influence
        α, complex (..., s, p), without errors.

    Returns
    -------
    JointFit
        Its `.influence` are the given coefficients; the degrees of freedom are those of repeated readings.

    Raises
    ------
    ValueError
        A channel without a reading.

    Examples
    --------
    >>> fit = initial_alone([[5], [7]], [[2]])
    >>> fit.unknowns.real, int(fit.degrees_of_freedom)
    (array([[6., 2.]]), 1)
    """
    y, alpha = as_vectors(readings), as_vectors(influence)
    present = np.isfinite(y)
    count = present.sum(axis=-2, keepdims=True)
    if not count.all():
        raise ValueError("a channel has no reading")
    share = np.where(present, 1 / (in_32_digits(count) if is_doubled(y) else count), 0.0)
    x0 = (np.where(present, y, 0.0).sum(axis=-2) / count[..., 0, :])[..., None]
    unknowns = np.concatenate([x0, np.broadcast_to(alpha, (*x0.shape[:-1], alpha.shape[-1]))], axis=-1)
    gain: Any = filled((*unknowns.shape, y.shape[-2]), 0.0, share)
    gain[..., 0, :] = np.swapaxes(share, -1, -2)
    masses = np.zeros((*y.shape[:-1], alpha.shape[-1]), dtype=complex)
    counts = np.full(y.shape[:-2], y.shape[-1])
    return JointFit(y, masses, None, unknowns, gain, share, counts)


def determined(masses: ArrayLike, present: ArrayLike) -> NDArray[np.bool_]:
    """Return which channels (..., s) the runs determine in which they were read.

    Parameters
    ----------
    masses
        On the rotor in each run, complex (..., r, p), kg.
    present
        Whether a run has a reading of a channel, (..., r, s).

    Examples
    --------
    >>> determined([[0], [1], [2]], [[True, True], [True, False], [True, False]])
    array([ True, False])
    """
    t, read = np.asarray(masses, dtype=complex), np.asarray(present, dtype=bool)
    rows = design(t)[..., None, :, :]
    channels = (*np.broadcast_shapes(t.shape[:-2], read.shape[:-2]), read.shape[-1])
    if rows.shape[-2] < rows.shape[-1]:
        return np.zeros(channels, dtype=bool)
    if not read.all():
        # where nothing is missing one QR serves all channels
        rows = np.swapaxes(read, -1, -2)[..., None] * rows
    return np.broadcast_to(_seen(factors(rows)[1], rows.shape[-2]), channels)


def _seen(r: Complex, rows: int) -> NDArray[np.bool_]:
    n = r.shape[-1]
    # σ_min ≥ |det R|/‖R‖ⁿ⁻¹: where that is enough no singular values are needed
    size = np.sqrt(np.square(np.abs(r)).sum(axis=(-2, -1)))
    product = np.abs(np.diagonal(r, axis1=-2, axis2=-1)).prod(axis=-1)
    sure = np.asarray(product > threshold(rows, n) * size**n)
    if sure.all():
        return sure
    sigma = np.linalg.svd(r, compute_uv=False)
    return np.asarray(sigma[..., -1] > threshold(rows, r.shape[-1]) * sigma[..., 0])


def _require(r: Complex, rows: Complex) -> None:
    """Raise Undetermined where a channel's rows do not determine its unknowns."""
    few = rows.shape[-2] < rows.shape[-1]
    seen = np.zeros(r.shape[:-2], dtype=bool) if few else _seen(r, rows.shape[-2])
    if seen.all():
        return
    case = tuple(int(i) for i in np.argwhere(~seen)[0])
    mine = rows[case]
    size = np.linalg.norm(mine, axis=0)
    size = np.where(size > 0, size, size.max() or 1.0)
    combination = np.linalg.svd(mine / size)[2][-1].conj() / size
    combination = combination / combination[np.argmax(np.abs(combination) * size)]
    reasons = [
        "the initial vibration" if k == 0 else f"the coefficient of plane {k - 1}"
        for k in np.flatnonzero(np.abs(combination) * size > 1e-6 * np.abs(combination * size).max())
    ]
    raise Undetermined(f"the runs do not determine {' and '.join(reasons)}", combination, case)
