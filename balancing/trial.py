"""Around the measurement: the trial mass to begin with, what it must do, the error budget."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_numbers, common_shape

Real = NDArray[np.float64]

STANDARD_GRAVITY = 9.80665


def trial_unbalance(
    rotor_mass: ArrayLike, speed: ArrayLike, planes: int = 1, share: float = 0.1
) -> NDArray[np.float64]:
    """Suggest a trial unbalance m·r for the first run, kg·m.

    The rule: its centrifugal force is a tenth (`share`) of the static load that the plane carries,
    m·r·ω² = share·(M/planes)·g. It is felt, and does no harm. Rotor mass in kg, speed in rad/s.

    >>> m_r = trial_unbalance(100.0, 1500 * np.pi / 30, planes=2)
    >>> round(float(m_r / 0.2) * 1000, 2)  # grams at 200 mm
    9.94
    """
    mass, omega = np.asarray(rotor_mass, dtype=float), np.asarray(speed, dtype=float)
    if not ((mass > 0).all() and (omega > 0).all() and planes >= 1 and share > 0):
        raise ValueError("rotor mass, speed, planes and share must be positive")
    return np.asarray(load_rule(mass, omega, planes, share, STANDARD_GRAVITY))


def load_rule(mass: Any, omega: Any, planes: float, share: Any, gravity: Any) -> Any:
    """m·r = share·(M/planes)·g/ω², of floats or of numbers in 32 digits."""
    return share * mass / planes * gravity / (omega * omega)


@record
class TrialEffect(NamedTuple):
    """What a trial mass changed: the amplitude by this share, the phase by this angle (rad), (...,) each."""

    amplitude: Real
    phase: Real

    def error_estimate(self) -> TrialEffect:
        """Return bounds of the rounding errors, the readings taken as exact: both are differences of readings."""
        return TrialEffect(4 * EPS * (2 + self.amplitude), 4 * EPS * (1 + self.phase))


def trial_effect(before: ArrayLike, after: ArrayLike) -> TrialEffect:
    """Tell how much a trial mass changed the readings, for the 30/30 rule.

    The rule of the practitioner: a trial run tells something where the amplitude changed by 30 % or the phase
    by 30° at one sensor at least. A vibration that rises from zero has changed by inf.

    >>> effect = trial_effect(3.4 * np.exp(1j * np.radians(116)), 1.8 * np.exp(1j * np.radians(42)))
    >>> effect.amplitude.round(2), np.degrees(effect.phase).round()
    (np.float64(0.47), np.float64(74.0))
    """
    v0, v1 = as_numbers("before", before, complex), as_numbers("after", after, complex)
    common_shape(before=v0.shape, after=v1.shape)
    size = np.abs(v0)
    change = np.abs(np.abs(v1) - size)
    amplitude = np.where(size > 0, change / np.where(size > 0, size, 1.0), np.where(change > 0, np.inf, 0.0))
    phase = np.where((size > 0) & (np.abs(v1) > 0), np.abs(np.angle(v1 * v0.conj())), 0.0)
    return TrialEffect(amplitude[()], phase[()])


@record
class ErrorBudget(NamedTuple):
    """The error of a residual unbalance, and the readings from which on a rotor is in or out of tolerance."""

    error: Real
    accept: Real
    """At most this reading: within tolerance whatever the error."""
    reject: Real
    """More than this reading: beyond tolerance whatever the error."""

    def error_estimate(self) -> ErrorBudget:
        """Return bounds of the rounding errors, the given errors taken as exact (up to some ten of them)."""
        bound = 8 * EPS * (self.error + self.reject)
        return ErrorBudget(8 * EPS * self.error, bound, bound)


def error_budget(permissible: ArrayLike, random: ArrayLike = (), systematic: ArrayLike = ()) -> ErrorBudget:
    """Combine the errors of balancing and say which residual readings pass.

    Parameters
    ----------
    permissible
        U_per of the plane, kg·m (any one unit for all three), scalar or (...).
    random
        Random errors (clearance, repeatability, drive play ...), (..., n): they add by squares.
    systematic
        Systematic errors that were NOT corrected, sizes, (..., n): they add in full, as the worst case.

    Notes
    -----
    ISO 21940-14:2012 (before: ISO 1940-2): ΔU = Σ systematic + √Σ random²; the maker accepts a reading up to
    U_per - ΔU, the user rejects one above U_per + ΔU; between the two it is not decided.

    >>> error_budget(100.0, random=[3.0, 4.0], systematic=[2.0])
    ErrorBudget(error=7, accept=93, reject=107)
    """
    u = np.asarray(permissible, dtype=float)
    r, s = np.asarray(random, dtype=float), np.asarray(systematic, dtype=float)
    if not ((u > 0).all() and np.isfinite(r).all() and np.isfinite(s).all()):
        raise ValueError("permissible must be positive and the errors finite")
    error = np.abs(s).sum(axis=-1) + np.sqrt(np.square(r).sum(axis=-1))
    return ErrorBudget(np.asarray(error), np.asarray(np.maximum(u - error, 0.0)), np.asarray(u + error))
