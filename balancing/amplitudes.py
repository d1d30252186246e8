"""Balancing without phase: influence coefficients from amplitudes alone (the four-run, or three-point, method)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.phase import angle_of
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record, table

if TYPE_CHECKING:
    import pandas as pd

    from dalembert.arithmetic.doubled import Doubled
    from dalembert.arithmetic.doubled_arrays import Vectors

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

STARTS = 24
"""Directions from which the fit is started: it has few minima, and this number finds all."""


@record
@dataclass(frozen=True, eq=False, repr=False)
class AmplitudeFit:
    """The influence coefficients of one plane, fitted to amplitudes by `influence_from_amplitudes`."""

    influence: Complex
    """α (s,), amplitude per kg; its phase is counted from each sensor's own initial vibration."""
    misfit: Real
    """√(mean square of fitted - read amplitude) over the trial runs, (s,)."""
    other: Complex
    """A second coefficient (s,) that fits (almost) as well, or NaN where the answer is unique."""
    initial: Real
    """The amplitudes it was found from, (s,), those of the trial runs (r, s), and the trial masses (r,), kg."""
    trials: Real
    trial_masses: Complex

    def to_frame(self) -> pd.DataFrame:
        """Return a table with a row per sensor: initial, influence (size per kg, angle_deg), misfit, condition_number."""
        columns = {
            "initial": self.initial,
            "influence_per_kg": np.abs(self.influence),
            "angle_deg": np.degrees(angle_of(self.influence)),
            "misfit": self.misfit,
            "condition_number": self.condition_number,
        }
        return table(columns, ("sensor",))

    @cached_property
    def _at(self) -> _Normal:
        """The normal equations at the coefficients, relative to each sensor's initial amplitude and to the masses."""
        t = self.trial_masses / np.abs(self.trial_masses).max()
        z = self.influence * np.abs(self.trial_masses).max() / self.initial
        return _normal(z, (self.trials / self.initial).T, t)

    @property
    def condition_number(self) -> Real:
        """The factor by which relative errors of the readings can grow in the coefficient, (s,); inf where circles touch."""
        at = self._at
        # largest |∂z/∂R| over the runs
        gain = np.linalg.norm(at.gain(at.rows), axis=-2).max(axis=-1)
        size = np.abs(self.influence) * np.abs(self.trial_masses).max() / self.initial
        return np.asarray(gain * (self.trials / self.initial).max(axis=0) / np.where(size > 0, size, np.nan))

    def error_estimate(self, quantity: str = "influence") -> Real:
        """Return the rounding error of `influence` or of `misfit`, (s,): by what the same fit in 32 digits differs.

        Amplitudes and trial masses are taken as exact. inf where the second derivatives are singular: two circles that touch,
        trials on a line through them.
        """
        from dalembert.arithmetic.doubled import Doubled
        from dalembert.arithmetic.doubled_arrays import Vectors
        from dalembert.arithmetic.doubled_operations import off

        if quantity not in ("influence", "misfit"):
            raise ValueError(f"'{quantity}': expected influence or misfit")
        data = Doubled(self.initial), Doubled(self.trials), Vectors.of(self.trial_masses)
        influence, misfit = self.second_run(*data)
        error = influence.off(self.influence) if quantity == "influence" else off(self.misfit, misfit)
        return np.where(np.isfinite(influence.x.high), error, np.inf)

    def second_run(self, initial: Doubled, trials: Doubled, trial_masses: Vectors) -> tuple[Vectors, Doubled]:
        """Return the coefficients (s,) and the misfits (s,) in 32 digits, of such data: (s,), (r, s), (r,); NaN where singular.

        With f_r = |O + α t_r| - R_r and J its derivatives the fit is where Jᵀf = 0. Newton's method goes on from the
        coefficients with these values in 32 digits and the inverse of the second derivatives in 16.
        """
        from dalembert.arithmetic.doubled import Doubled
        from dalembert.arithmetic.doubled_arrays import Vectors
        from dalembert.arithmetic.doubled_functions import DOUBLED
        from dalembert.arithmetic.doubled_operations import part, total

        unit, inverse = float(np.abs(self.trial_masses).max()), self._at.inverse
        sure = np.asarray(np.isfinite(inverse).all(axis=(-2, -1)))
        inverse = np.where(sure[:, None, None], inverse, 0.0)
        t = (trial_masses / np.array(unit))[None]
        read = Doubled(*(np.broadcast_to(x, trials.high.shape).T for x in (trials.high, trials.low)))
        read = read / part(initial, (..., None))
        z = Vectors.of(self._at.z)
        reached, last = np.zeros(sure.shape, dtype=np.bool_), np.full(sure.shape, np.inf)
        for _ in range(60):
            y = z[:, None] * t + Vectors.of(np.ones((1, 1)))
            length = y.size
            f = length - read
            pull = (y * t.conj() * (f / length)).sum().value
            step = (inverse @ np.stack([pull.real, pull.imag], axis=-1)[..., None])[..., 0]
            reach = np.hypot(step[:, 0], step[:, 1])
            size = np.abs(z.value)
            reached = reached | (reach <= 1e-29 * size) | ((reach >= last / 2) & (last <= 1e-20 * size))
            if (reached | ~sure).all():
                break
            z, last = z - Vectors.of(step[:, 0] + 1j * step[:, 1]), reach
        misfit = DOUBLED.sqrt(total(f * f) / float(len(self.trials))) * initial
        known = np.where(sure & reached, 1.0, np.nan)
        return z * (initial / unit) * known, misfit * known


def influence_from_amplitudes(initial: ArrayLike, trials: ArrayLike, trial_masses: ArrayLike) -> AmplitudeFit:
    """Find the influence coefficients of one plane from amplitudes without phase.

    Parameters
    ----------
    initial
        Amplitudes O without trial mass, (s,), positive.
    trials
        Amplitudes R with a trial mass in the plane, (r, s), r >= 2.
    trial_masses
        The trial mass at its angle in each run, complex (r,), kg.

    Returns
    -------
    AmplitudeFit
        α with Σ_r (|O + α t_r| - R_r)² least, the initial vibrations standing at phase 0; the misfit; and the
        second answer where the runs leave two (two trial runs, or all trials on one line).

    Raises
    ------
    ValueError
        Fewer than two trial runs, an amplitude that is not positive, a trial without mass, all trials alike.

    Notes
    -----
    The four-run method (O, and three trials some 120° apart) draws circles of radius R_r about -O e^{iθ_r}, whose
    common point is the trial's effect; readings never meet in one point, and the least-squares point is taken. With
    two trials the circles meet in two points.

    Examples
    --------
    SPM A2010 manual, p. 68: 6.1 mm/s; 7.7, 3.2, 10.3 with 12.3 g at 0°, 120°, 240°.

    >>> fit = influence_from_amplitudes([6.1], [[7.7], [3.2], [10.3]], 12.3 * np.exp(2j * np.pi * np.arange(3) / 3))
    >>> w = -6.1 / fit.influence[0]
    >>> abs(w).round(3), np.degrees(np.angle(w)).round(3)
    (np.float64(16.364), np.float64(89.956))
    """
    o = np.atleast_1d(np.asarray(initial, dtype=float))
    reading = np.asarray(trials, dtype=float)
    t: Complex = np.asarray(trial_masses, dtype=complex)
    if reading.ndim != 2 or reading.shape != (len(t), len(o)):
        raise ValueError(
            f"shapes do not fit: initial {o.shape}, trials {reading.shape}, trial_masses {t.shape}"
        )
    if len(t) < 2:
        raise ValueError("expected at least two trial runs (three for a unique answer)")
    if not ((o > 0).all() and (reading >= 0).all() and np.isfinite(reading).all() and np.isfinite(o).all()):
        raise ValueError("amplitudes must be finite, and positive in the initial run")
    if not (np.abs(t) > 0).all():
        raise ValueError("a trial run without trial mass")
    if np.ptp(t.real) + np.ptp(t.imag) <= 1e-9 * np.abs(t).max():
        raise ValueError("the trial masses are all alike: expected different angles")
    unit = float(np.abs(t).max())
    scaled: Complex = np.asarray(t / unit, dtype=complex)
    fits = [_fit(read / first, scaled) for first, read in zip(o, reading.T, strict=True)]
    return AmplitudeFit(
        np.array([fit[0] for fit in fits]) * o / unit,
        np.array([fit[1] for fit in fits]) * o,
        np.array([fit[2] for fit in fits]) * o / unit,
        o,
        reading,
        t,
    )


class _Normal(NamedTuple):
    """Σ (|1 + z t_r| - R_r)² about z, for each of several z (n,): values f, rows of derivatives by (Re z, Im z)."""

    z: Complex
    t: Complex
    read: Real
    length: Real
    f: Real
    rows: Real
    """(n, r, 2)."""
    inverse: Real
    """The inverse of the second derivatives, (n, 2, 2); inf where they are singular."""

    def gain(self, rows: Real) -> Real:
        """H⁻¹ times derivatives (n, r, 2): (n, 2, r)."""
        return np.asarray(self.inverse @ np.swapaxes(rows, -1, -2))


def _derivatives(z: Complex, read: Real, t: Complex) -> tuple[Real, Real, Real, Real, Real]:
    """Return |y|, the misfits f, their derivatives (n, r, 2), and Σ ½f² in second derivatives, first without curvature."""
    y = 1 + z[:, None] * t
    length = np.abs(y)
    u = y / np.where(length > 0, length, 1.0)
    f = length - read
    # d|y| = Re(ū t dz): rows (Re, -Im) of ū t; the exact curvature |y|'' = (Im ū t dz)²/|y|
    slope = u.conj() * t
    rows = np.stack([slope.real, -slope.imag], axis=-1)
    across = np.stack([slope.imag, slope.real], axis=-1)
    bend = np.where(length > 1e-12, f / np.where(length > 0, length, 1.0), 0.0)
    normal = np.einsum("nrk,nrl->nkl", rows, rows)
    return length, f, rows, normal, normal + np.einsum("nr,nrk,nrl->nkl", bend, across, across)


def _normal(z: Complex, read: Real, t: Complex) -> _Normal:
    """Work out the normal equations at z (n,) for readings (n, r) or (r,)."""
    length, f, rows, _, hessian = _derivatives(z, read, t)
    a, b, c = hessian[:, 0, 0], hessian[:, 0, 1], hessian[:, 1, 1]
    det = a * c - b * b
    sure = np.abs(det) > 64 * EPS * (np.abs(a * c) + b * b)
    adjugate = np.stack([np.stack([c, -b], axis=-1), np.stack([-b, a], axis=-1)], axis=-2)
    inverse = adjugate / np.where(sure, det, 1.0)[:, None, None]
    return _Normal(z, t, read, length, f, rows, np.where(sure[:, None, None], inverse, np.inf))


def _fit(read: Real, t: Complex) -> tuple[complex, float, complex]:
    """Minimise Σ (|1 + z t_r| - R_r)² over complex z from all directions at once: the best, its misfit, its rival."""
    # each reading bounds the size: |R - 1| <= |z t| <= R + 1
    low, high = float((np.abs(read - 1) / np.abs(t)).max()), float(((read + 1) / np.abs(t)).min())
    sizes = np.geomspace(max(min(low, high), high / 20), max(low, high), 5)
    z = np.outer(sizes, np.exp(2j * np.pi * (np.arange(STARTS) + 0.5) / STARTS)).ravel()
    damping = np.full(z.shape, 1e-3)
    cost = _cost(z, read, t)
    for _ in range(80):
        _, f, rows, normal, hessian = _derivatives(z, read, t)
        gradient = np.einsum("nrk,nr->nk", rows, f)
        definite = (hessian[:, 0, 0] > 0) & (
            np.linalg.det(hessian) > 1e-9 * np.trace(hessian, axis1=1, axis2=2) ** 2
        )
        hessian = np.where(definite[:, None, None], hessian, normal)
        hessian = hessian + (damping * np.trace(normal, axis1=1, axis2=2))[:, None, None] * np.eye(2)
        move = -np.linalg.solve(hessian, gradient[..., None])[..., 0]
        trial = z + (move[:, 0] + 1j * move[:, 1])
        new = _cost(trial, read, t)
        better = new <= cost
        z, cost = np.where(better, trial, z), np.where(better, new, cost)
        damping = np.where(better, damping * 0.1, np.minimum(damping * 10, 1e6))
        if (np.abs(move).max(axis=1) <= 1e-15 * np.abs(z)).all():
            break
    best = int(np.argmin(cost))
    z[best] = _finished(z[best], read, t)
    misfit = float(np.sqrt(cost[best] / len(t)))
    away = np.abs(z - z[best]) > 1e-3 * abs(z[best])
    rival: complex = complex(np.nan, np.nan)
    if away.any():
        second = int(np.argmin(np.where(away, cost, np.inf)))
        # a rival is one that the readings cannot distinguish from the best
        if np.sqrt(cost[second] / len(t)) <= max(2 * misfit, 1e-3 * float(np.abs(read).max())):
            rival = complex(z[second])
    return complex(z[best]), misfit, rival


def _finished(z: complex, read: Real, t: Complex) -> complex:
    """Finish by Newton's method on the gradient: the cost is flat near its minimum, and shows half of the digits."""
    here = _normal(np.array([z]), read, t)
    for _ in range(4):
        pull = here.gain(np.einsum("nrk,nr->nk", here.rows, here.f)[:, None])[0, :, 0]
        step = complex(pull[0], pull[1])
        if not abs(step) < 1e-4 * abs(z):
            break
        there = _normal(np.array([z - step]), read, t)
        last, new = (np.linalg.norm(np.einsum("rk,r->k", at.rows[0], at.f[0])) for at in (here, there))
        if new >= last:
            break
        z, here = z - step, there
    return z


def _cost(z: Complex, read: Real, t: Complex) -> Real:
    return np.asarray(np.square(np.abs(1 + z[:, None] * t) - read).sum(axis=-1))
