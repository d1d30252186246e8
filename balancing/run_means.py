"""Repeated readings of an initial run and trial runs: their means, how far they scatter, and which contradict each other."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from balancing.dependence import directions
from balancing.reading_errors import Errors
from balancing.run_log import JointFit

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class RunMeans:
    """The mean reading of each run, as vectors, of machines that were measured in the same way.

    Parameters
    ----------
    readings
        (g, r, s); NaN where a row lacks a channel.
    rows
        For each run the rows of readings that are of it.

    Examples
    --------
    A run that was read twice, and one that was read once:

    >>> means = RunMeans(np.array([[[4.0], [6.0], [2.0]]], dtype=complex), [[0, 1], [2]])
    >>> means.values[0, :, 0].real, means.counts[:, 0], means.degrees_of_freedom
    (array([5., 2.]), array([2, 1]), 1)
    >>> means.reading_sd.round(3), means.contradictory[0, :, 0]
    (array([1.414]), array([ True, False]))
    """

    def __init__(self, readings: Complex, rows: Sequence[Sequence[int]]) -> None:
        self.readings, self.rows = readings, rows

    @cached_property
    def counts(self) -> NDArray[np.intp]:
        """The number of readings of each sensor in each run, (1 + r, s)."""
        return np.array([np.isfinite(self.readings[0, of]).sum(axis=0) for of in self.rows])

    @cached_property
    def values(self) -> Complex:
        """The means, (g, 1 + r, s)."""
        read = np.where(np.isfinite(self.readings), self.readings, 0)
        sums = np.stack([read[:, of].sum(axis=1) for of in self.rows], axis=1)
        return np.asarray(sums / self.counts)

    @cached_property
    def scatter(self) -> Real:
        """Σ|reading - mean|² of each run, (g, 1 + r, s)."""
        off = [np.abs(self.readings[:, of] - self.values[:, [j]]) for j, of in enumerate(self.rows)]
        return np.stack([np.nansum(np.square(each), axis=1) for each in off], axis=1)

    @property
    def degrees_of_freedom(self) -> int:
        """Complex, of the repeats: readings less means."""
        return int((self.counts - 1).sum())

    @cached_property
    def reading_sd(self) -> Real:
        """Standard deviation of one reading as the repeats show it, √(Σ|reading - mean|²/degrees of freedom), (g,)."""
        if not self.degrees_of_freedom:
            return np.zeros(len(self.readings))
        sd = np.sqrt(self.scatter.sum(axis=(1, 2)) / self.degrees_of_freedom)
        # what lies in the rounding of the mean is agreement
        return np.where(sd > 1e-14 * np.abs(self.values).max(axis=(1, 2)), sd, 0.0)

    @cached_property
    def contradictory(self) -> NDArray[np.bool_]:
        """Whether repeats differ by as much as a trial mass should move the vibration, 30 % of it, (g, 1 + r, s)."""
        spread = self.scatter / self.counts
        largest = np.sqrt((np.square(np.abs(self.values)) + spread).max(axis=1, keepdims=True))
        return np.asarray(np.sqrt(spread) > 0.15 * largest)

    @cached_property
    def deviation(self) -> Real:
        """Standard deviation of each component of each mean as the repeats show it, (g, 1 + r, s).

        One estimate serves all readings; where repeats contradict each other their own holds if it is larger.
        """
        pooled = np.square(self.reading_sd)[:, None, None]
        own = np.where(self.contradictory, self.scatter / np.maximum(self.counts - 1, 1), 0.0)
        return np.asarray(np.sqrt(np.maximum(pooled, own) / (2 * self.counts)))

    def errors(self, fit: JointFit, amplitude: float = 0.0, phase: float = 0.0) -> Errors:
        """Return the errors of the readings of a fit of these runs: stated, or as repeats scatter where that is more.

        What repeats show (a type A evaluation, JCGM 100:2008, 4.2) is the less for their mean; what is stated (type B, 4.3)
        is not averaged away. `amplitude` is relative, `phase` in rad.
        """
        shape = fit.readings.shape
        mean, scatter, count = np.zeros(shape, dtype=complex), np.zeros(shape), np.ones(shape)
        for j, rows in enumerate(self.rows):
            # a fit with stored coefficients has the initial run alone
            if rows[-1] < shape[1]:
                mean[:, rows] = self.values[:, [j]]
                scatter[:, rows] = self.deviation[:, [j]]
                count[:, rows] = self.counts[j]
        size = np.abs(mean)
        of_reading = np.sqrt(count) * fit.present
        return Errors(
            directions(mean),
            of_reading * np.maximum(scatter, amplitude * size),
            of_reading * np.maximum(scatter, phase * size),
            np.full(len(mean), float(self.degrees_of_freedom) or np.inf),
            np.where(scatter > phase * size, 0.0, phase * np.sqrt(count)),
            ~(scatter > amplitude * size),
        )
