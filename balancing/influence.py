"""Influence coefficients: what a unit mass in a plane adds to the vibration at a sensor, from trial runs.

The vibration V_s at sensor s (and speed) answers linearly to the masses w_p in the planes,

    r = V + α w                                   (Goodman 1964, eq. 1; ISO 21940-12, annex on flexible rotors)

A vibration, a mass, a coefficient is a complex number: size and phase, and both phases are counted in one common
sense.

An initial run with its trial runs has as many different loads as a fit has unknowns, one of them none (`Loads`). Runs with the
same masses count as their mean, and the means leave nothing to spare: x₀ is the mean without masses, α what each load adds to it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.dependence import DependentTrials, adjoint, columns_scaled, require_independent
from dalembert.arithmetic.shapes import as_numbers, common_shape

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def influence_coefficients(initial: ArrayLike, trials: ArrayLike, trial_masses: ArrayLike) -> Complex:
    """Find the influence coefficients from an initial run and trial runs.

    Parameters
    ----------
    initial
        Vibration without trial masses, complex (..., s).
    trials
        Vibration in the trial runs, complex (..., r, s).
    trial_masses
        The trial masses that were ON the rotor in each run, complex (..., r, p), kg: a mass left on stands in
        every later run's row too. With more runs than planes the coefficients are fitted by least squares.

    Returns
    -------
    ndarray
        α, complex (..., s, p), amplitude per kg.

    Raises
    ------
    DependentTrials
        The runs cannot distinguish the planes: fewer runs than planes, a plane never tried, runs alike.
    ValueError
        Not finite, or shapes that do not fit.

    Notes
    -----
    Trial run j has V_j = V_0 + α t_j, t_j what was on the rotor: T αᵀ = V_j - V_0, one linear system for any
    pattern of masses put on, left on and taken off. With T diagonal it is α = (V_1 - V_0)/t of Thearle
    (Trans. ASME 56, 1934, 745-753) and of ISO 21940-13.

    Examples
    --------
    A fan (Brüel & Kjær, application note 17-227): 3.4 mm/s at 116°, with 2 g at 0° 1.8 mm/s at 42°.

    >>> from balancing import least_squares
    >>> v0, v1 = np.array([3.4, 1.8]) * np.exp(1j * np.radians([116, 42]))
    >>> alpha = influence_coefficients([v0], [[v1]], [[0.002]])
    >>> fix = least_squares(alpha, [v0])
    >>> abs(fix.corrections).round(6), np.degrees(np.angle(fix.corrections)).round(2)
    (array([0.002012]), array([-30.79]))
    """
    v0, v = as_numbers("initial", initial, complex), as_numbers("trials", trials, complex)
    t = as_numbers("trial_masses", trial_masses, complex)
    for name, array, axes in (("initial", v0, 1), ("trials", v, 2), ("trial_masses", t, 2)):
        if array.ndim < axes:
            raise ValueError(f"{name} must have at least {axes} axes, found shape {array.shape}")
        if not np.isfinite(array).all():
            raise ValueError(f"{name} must be finite")
    if v.shape[-1] != v0.shape[-1] or t.shape[-2] != v.shape[-2]:
        raise ValueError(f"shapes do not fit: initial {v0.shape}, trials {v.shape}, trial_masses {t.shape}")
    common_shape(initial=v0.shape[:-1], trials=v.shape[:-2], trial_masses=t.shape[:-2])
    runs, planes = t.shape[-2:]
    change = v - v0[..., None, :]
    scaled, scale = columns_scaled(t)
    require_independent(scaled, scale, runs, planes, "trial runs", DependentTrials)
    if runs == planes:
        lead = np.broadcast_shapes(scaled.shape[:-2], change.shape[:-2])
        alpha = np.linalg.solve(scaled, np.broadcast_to(change, lead + change.shape[-2:]))
    else:
        q, r = np.linalg.qr(scaled)
        alpha = np.linalg.solve(r, adjoint(q) @ change)
    return np.asarray(np.swapaxes(alpha * scale[..., None], -1, -2))


class Loads(NamedTuple):
    """Runs with as many different loads as unknowns, the first of them none."""

    masses: Complex
    """(..., r, p)."""
    first: NDArray[np.intp]
    """A run of each load, (1 + p,)."""
    of_run: NDArray[np.bool_]
    """Which load each run has, (r, 1 + p)."""
    present: NDArray[np.bool_]
    often: Real
    """The number of readings of each channel with each load, (..., 1 + p, s)."""

    def means(self, of_rows: NDArray[np.float64 | np.complex128]) -> NDArray[np.float64 | np.complex128]:
        """Return the means over the runs of each load, (..., r, s) -> (..., 1 + p, s)."""
        read = np.where(self.present, of_rows, 0)
        sums = [read[..., np.flatnonzero(mine), :].sum(axis=-2) for mine in self.of_run.T]
        return np.asarray(np.stack(sums, axis=-2) / self.often)

    def solve(self, readings: Complex) -> tuple[Complex, Complex, Real]:
        """Return θ = (x₀, α), x₀ the mean without masses, its gain and the leverage of the readings.

        Raises
        ------
        DependentTrials
            The loads cannot distinguish the planes.
        """
        means = np.asarray(self.means(readings), dtype=complex)
        on = self.masses[..., self.first[1:], :]
        alpha = influence_coefficients(means[..., 0, :], means[..., 1:, :], on)
        unknowns = np.concatenate([means[..., 0, :, None], alpha], axis=-1)
        # θ = gain y: α = T⁻¹ (means with masses less the mean without)
        undo = np.linalg.inv(on)
        of_means = np.zeros((*undo.shape[:-2], *(undo.shape[-1] + 1,) * 2), dtype=complex)
        of_means[..., 0, 0], of_means[..., 1:, 0], of_means[..., 1:, 1:] = 1.0, -undo.sum(axis=-1), undo
        share = np.where(self.present, (self.of_run @ (1 / self.often)), 0.0)
        gain = (of_means @ self.of_run.T)[..., None, :, :] * np.swapaxes(share, -1, -2)[..., None, :]
        return np.asarray(unknowns + 0.0, dtype=complex), np.asarray(gain, dtype=complex), np.asarray(share)


def loads_of(masses: Complex, present: NDArray[np.bool_]) -> Loads | None:
    """Return the different loads of the runs; None if they are more or fewer than the unknowns, or if no run is without load."""
    runs, planes = masses.shape[-2:]
    if runs < 1 + planes:
        return None
    each = np.moveaxis(masses, -2, 0).reshape(runs, -1)
    if runs == 1 + planes:
        first = np.arange(runs)
        number = first
    else:
        parts = np.concatenate([each.real, each.imag], axis=1) + 0.0
        _, first, number = np.unique(parts, axis=0, return_index=True, return_inverse=True)
        number = number.ravel()
    bare = np.flatnonzero(~each[first].any(axis=1))
    if len(first) != 1 + planes or len(bare) != 1:
        return None
    order = np.concatenate([bare, np.delete(np.arange(1 + planes), bare)])
    order[1:] = order[1:][np.argsort(first[order[1:]], kind="stable")]
    of_run = number[:, None] == order
    count = np.stack([present[..., np.flatnonzero(mine), :].sum(axis=-2) for mine in of_run.T], axis=-2)
    return Loads(masses, first[order], of_run, present, count.astype(float)) if count.all() else None
