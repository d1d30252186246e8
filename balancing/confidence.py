"""What the errors of readings do to corrections, and what vibration is left then."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.balance import least_squares
from balancing.dependence import directions
from balancing.influence import influence_coefficients
from balancing.propagation import components, response
from dalembert.arithmetic.records import record

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@record
@dataclass(frozen=True, eq=False, repr=False)
class Readings:
    """The readings from which corrections were found, and their errors; one rotor.

    The errors are standard deviations: of the amplitude, relative to it, and of the phase in rad; those of
    different readings are independent. Errors of repeated readings are seen in their scatter (a type A evaluation,
    JCGM 100:2008, 4.2), whose mean is the better for it; the stated ones (type B, 4.3) are not averaged away.
    """

    initial: Complex
    """V as read, run-out not yet subtracted, (s,)."""
    amplitude_error: float
    phase_error: float
    trials: Complex | None = None
    """The trial runs as read, (r, s); None where the coefficients were given, and count as exact."""
    trial_masses: Complex | None = None
    """(r, p), kg."""
    influence: Complex | None = None
    """The given coefficients (s, p), where there are no trials."""
    runout: Complex | None = None
    """(s,), subtracted from every reading."""
    scatter: Real | None = None
    """Standard deviation of each component of each run's mean reading as repeats of readings show it, (1 + r, s), in
    units of the readings: it takes the place of the stated errors where it is larger."""
    degrees_of_freedom: int = 0
    """Of `scatter`, complex: the repeated readings less their means."""

    @cached_property
    def _errors(self) -> tuple[Complex, Complex, Real, Real]:
        """Direction and share of the error along a reading and across it: (1 + r, s) each."""
        v = self._all
        if self.scatter is None:
            return v, v, np.full(v.shape, self.amplitude_error), np.full(v.shape, self.phase_error)
        size, unit = np.abs(v), directions(v)
        along, across = (self.scatter > error * size for error in (self.amplitude_error, self.phase_error))
        return (
            np.where(along, unit, v),
            np.where(across, unit, v),
            np.where(along, self.scatter, self.amplitude_error),
            np.where(across, self.scatter, self.phase_error),
        )

    @cached_property
    def _all(self) -> Complex:
        """Initial run and trial runs, (1 + r, s)."""
        runs = [self.initial[None]] if self.trials is None else [self.initial[None], self.trials]
        return np.concatenate(runs)

    @cached_property
    def coefficients(self) -> Complex:
        """α from these readings, (s, p)."""
        if self.trials is None or self.trial_masses is None:
            assert self.influence is not None
            return self.influence
        return influence_coefficients(self.initial, self.trials, self.trial_masses)

    @cached_property
    def vibration(self) -> Complex:
        """V without run-out, (s,)."""
        return self.initial if self.runout is None else self.initial - self.runout

    def _share(self, corrections: Complex) -> Complex:
        """How the residual at fixed corrections depends on each run: r = Σ_j share_j V_j, (1 + r,).

        With c = wᵀT⁺ it is r = (1 - Σc) V_0 + Σ c_j V_j.
        """
        if self.trial_masses is None or self.trials is None:
            return np.ones(1, dtype=complex)
        c = corrections @ np.linalg.pinv(self.trial_masses)
        return np.concatenate([[1 - c.sum()], c])

    def residual_samples(self, corrections: Complex, n: int = 4000, seed: int = 0) -> Complex:
        """Draw the residual vibration (n, s) that the corrections as made leave on the true rotor.

        At fixed corrections the residual is linear in the readings: no further approximation is made.
        """
        share = self._share(corrections)
        error = self._draw(n, seed, student=True) - self._all
        expected = self.vibration + self.coefficients @ corrections
        return np.asarray(expected + np.tensordot(error, share, axes=([1], [0])))

    def _draw(self, n: int, seed: int, *, student: bool = False) -> Complex:
        """Draw readings, (n, 1 + r, s); errors known from repeats with Student's distribution where asked for."""
        rng = np.random.default_rng(seed)
        normal = rng.standard_normal((2, n, *self._all.shape))
        if self.scatter is None:
            return np.asarray(
                self._all * (1 + self.amplitude_error * normal[0]) * np.exp(1j * self.phase_error * normal[1])
            )
        along, across, of_size, of_phase = self._errors
        stated = self.scatter <= self.phase_error * np.abs(self._all)
        if student:
            # each complex degree of freedom is two real ones; the scatter is one estimate for all readings
            real = 2 * self.degrees_of_freedom
            wider = np.sqrt(real / rng.chisquare(real, n))[:, None, None]
            normal[0] *= np.where(self.scatter > self.amplitude_error * np.abs(self._all), wider, 1.0)
            normal[1] *= np.where(stated, 1.0, wider)
        turn = np.where(stated, of_phase, 0.0)
        aside = 1j * across * np.where(stated, 0.0, of_phase) * normal[1]
        return np.asarray((self._all + along * of_size * normal[0]) * np.exp(1j * turn * normal[1]) + aside)

    def correction_samples(
        self, weights: ArrayLike | None = None, ridge: float = 0.0, n: int = 4000, seed: int = 0
    ) -> Complex:
        """Draw least-squares corrections (n, p) from readings with their errors (Monte Carlo)."""
        runs = self._draw(n, seed)
        shift = 0 if self.runout is None else self.runout
        if self.trials is None:
            return least_squares(self.coefficients, runs[:, 0] - shift, weights, ridge=ridge).corrections
        assert self.trial_masses is not None
        alpha = influence_coefficients(runs[:, 0], runs[:, 1:], self.trial_masses)
        return least_squares(alpha, runs[:, 0] - shift, weights, ridge=ridge).corrections

    def problem_samples(self, n: int = 200, seed: int = 0) -> Iterator[tuple[Complex, Complex]]:
        """Draw coefficients (s, p) and vibration (s,) from readings with their errors."""
        shift = 0 if self.runout is None else self.runout
        for runs in self._draw(n, seed):
            if self.trials is None or self.trial_masses is None:
                yield self.coefficients, runs[0] - shift
            else:
                yield influence_coefficients(runs[0], runs[1:], self.trial_masses), runs[0] - shift

    def covariance(
        self,
        corrections: Complex,
        weights: ArrayLike | None = None,
        ridge: float = 0.0,
        *,
        along: Complex | None = None,
    ) -> Real:
        """Propagate the reading errors linearly to least-squares corrections.

        Parameters
        ----------
        corrections
            The corrections from the initial state, (p,).
        weights, ridge
            As they were found with.
        along
            The directions, (p,), where they are not the corrections' own.

        Returns
        -------
        ndarray
            (p, 2, 2), kg²: the covariance of each correction along itself (its size) and across (its angle).

        Notes
        -----
        First order (`balancing.propagation`): the coefficients, too, come from readings.
        """
        alpha, w = self.coefficients, corrections
        weight = np.ones(len(alpha)) if weights is None else np.asarray(weights, dtype=float)
        linear, antilinear = response(alpha, w, self.vibration + alpha @ w, weight, ridge)
        # from vibration and coefficients to the runs, (1 + p, 1 + r)
        gain = np.ones((1, 1), dtype=complex)
        if self.trials is None or self.trial_masses is None:
            linear, antilinear = linear[..., :1], antilinear[..., :1]
        else:
            undo = np.linalg.pinv(self.trial_masses)
            gain = np.zeros((1 + undo.shape[0], 1 + undo.shape[1]), dtype=complex)
            gain[0, 0], gain[1:, 0], gain[1:, 1:] = 1.0, -undo.sum(axis=1), undo
        e_along, e_across, of_size, of_phase = self._errors
        return components(
            (linear @ gain).reshape(len(w), -1),
            (antilinear @ gain.conj()).reshape(len(w), -1),
            w if along is None else along,
            directions(self._all.T.ravel()),
            (np.abs(e_along) * of_size).T.ravel(),
            (np.abs(e_across) * of_phase).T.ravel(),
        )


def spread(samples: Complex, about: Complex) -> Real:
    """Return the covariance (p, 2, 2) of drawn corrections (n, p) along and across the given ones."""
    turned = (samples - about) * directions(about.conj())
    parts = np.stack([turned.real, turned.imag])
    return np.asarray(np.einsum("anp,bnp->pab", parts, parts) / len(samples))
