"""Runs with as many different loads as a fit has unknowns, one of them none: an initial run with its trial runs.

Runs with the same masses count as their mean, and the means leave nothing to spare: θ = (x₀, α) solves them exactly, x₀ the
mean without masses, α from what each load adds to it (`balancing.influence`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing.influence import influence_coefficients

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


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
