"""Around the measurement: the trial mass to begin with, what it must do, the error budget."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, as_numbers, common_shape, in_32_digits
from dalembert.dataclass import dataclass, field

Real = NDArray[np.float64]

STANDARD_GRAVITY = 9.80665


def trial_unbalance(
    rotor_mass: ArrayLike, speed: ArrayLike, planes: int = 1, share: float = 0.1
) -> NDArray[np.float64]:
    """Return a trial unbalance m·r for the first run, (...), kg·m.

    Parameters
    ----------
    rotor_mass
        Mass of the rotor, (...), kg.
    speed
        Speed of the trial run, (...), rad/s.
    planes
        The number of planes that share the mass of the rotor.
    share
        The centrifugal force over the static load of a plane.

    Raises
    ------
    ValueError
        A number that is not positive.

    Notes
    -----
    Rule of practice: m·r·ω² = share·(M/planes)·g. A tenth of the static load is measurable and does no harm.

    Examples
    --------
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
@dataclass(frozen=True, eq=False, repr=False)
class TrialEffect:
    """The effect of a trial mass: the relative change of amplitude and the change of phase (rad), (...) each."""

    amplitude: Real
    phase: Real
    readings: tuple[Any, Any] = field(compare=False)
    """Before and after, complex, (...,)."""

    def error_estimate(self, exact: tuple[Any, Any] | None = None) -> TrialEffect:
        """Return the rounding errors: by what the same formula in 32 digits differs.

        `exact`: the readings in 32 digits; None: they are the floats. A rise from zero, which is inf, has the error inf.

        >>> error = trial_effect(3.0, 3.0 + 2**-40).error_estimate()
        >>> bool(error.amplitude < 1e-16 * 2**-40)
        True
        """
        before, after = readings = tuple(map(in_32_digits, self.readings)) if exact is None else exact
        amplitude, phase = _effect(before, after)
        size, other = (np.abs(z.value) for z in (before, after))
        # what cancels in 32 digits
        with np.errstate(divide="ignore", invalid="ignore"):
            hidden = 2.0**-98 * (1 + other / size)
        rise = np.where(np.isfinite(self.amplitude), amplitude.off(self.amplitude) + hidden, np.inf)
        return TrialEffect(rise[()], phase.off(self.phase)[()], readings)


def trial_effect(before: ArrayLike, after: ArrayLike) -> TrialEffect:
    """Return the effect of a trial mass on the readings, for the 30/30 rule.

    The rule of the practitioner: a trial run is informative if the amplitude changed by 30 % or the phase
    by 30° at one sensor at least. A vibration that rises from zero has changed by inf.

    Parameters
    ----------
    before, after
        Vibration without and with the trial mass, complex (...).

    Returns
    -------
    TrialEffect
        `.amplitude`, the relative change, and `.phase`, the change in rad, (...).

    Examples
    --------
    >>> effect = trial_effect(3.4 * np.exp(1j * np.radians(116)), 1.8 * np.exp(1j * np.radians(42)))
    >>> effect.amplitude.round(2), np.degrees(effect.phase).round()
    (np.float64(0.47), np.float64(74.0))
    """
    v0, v1 = as_numbers("before", before, complex), as_numbers("after", after, complex)
    common_shape(before=v0.shape, after=v1.shape)
    amplitude, phase = _effect(v0, v1)
    return TrialEffect(amplitude[()], phase[()], (v0, v1))


def _effect(v0: Any, v1: Any) -> tuple[Any, Any]:
    """Return the changes of amplitude and phase, of complex floats or of complex numbers in 32 digits."""
    size = np.abs(v0)
    change = np.abs(np.abs(v1) - size)
    there = size > 0
    amplitude = np.where(there, change / np.where(there, size, 1.0), np.where(change > 0, np.inf, 0.0))
    turned = v1 * v0.conj()
    return amplitude, np.where(there & (np.abs(v1) > 0), np.abs(np.arctan2(turned.imag, turned.real)), 0.0)


@record
@dataclass(frozen=True, eq=False, repr=False)
class ErrorBudget:
    """The error of a residual unbalance, and the limits of its reading to accept or reject a rotor."""

    error: Real
    accept: Real
    """At most this reading: within tolerance whatever the error."""
    reject: Real
    """More than this reading: beyond tolerance whatever the error."""

    errors: tuple[Any, Any, Any] = field(compare=False)
    """The permissible unbalance (...), random and systematic errors (..., n)."""

    def error_estimate(self, exact: tuple[Any, Any, Any] | None = None) -> ErrorBudget:
        """Return the rounding errors: by what the same formula in 32 digits differs.

        `exact`: permissible unbalance and errors in 32 digits; None: they are the floats.

        >>> bool(error_budget(100.0, random=[0.1, 0.2]).error_estimate().accept < 1e-14)
        True
        """
        numbers: Any = tuple(map(in_32_digits, self.errors)) if exact is None else exact
        true = zip(_budget(*numbers), (self.error, self.accept, self.reject), strict=True)
        error, accept, reject = (x.off(value) for x, value in true)
        return ErrorBudget(error, accept, reject, numbers)


def error_budget(permissible: ArrayLike, random: ArrayLike = (), systematic: ArrayLike = ()) -> ErrorBudget:
    """Combine the errors of balancing and return the limits of the residual readings.

    Parameters
    ----------
    permissible
        U_per of the plane, kg·m (any one unit for all three), scalar or (...).
    random
        Random errors (clearance, repeatability, drive play ...), (..., n): they add by squares.
    systematic
        Systematic errors that were NOT corrected, sizes, (..., n): they add in full, as the worst case.

    Returns
    -------
    ErrorBudget
        `.error` ΔU, `.accept` U_per - ΔU and `.reject` U_per + ΔU, (...), in the unit of the parameters.

    Raises
    ------
    ValueError
        A permissible unbalance that is not positive, or errors that are not finite.

    Notes
    -----
    ISO 21940-14:2012 (before: ISO 1940-2): ΔU = Σ systematic + √Σ random². The maker accepts a reading up to
    U_per - ΔU, the user rejects one above U_per + ΔU; between the two there is no decision.

    Examples
    --------
    >>> error_budget(100.0, random=[3.0, 4.0], systematic=[2.0])
    ErrorBudget(error=7, accept=93, reject=107)
    """
    u, r, s = as_array(permissible), as_array(random), as_array(systematic)
    if not ((u > 0).all() and np.isfinite(r).all() and np.isfinite(s).all()):
        raise ValueError("permissible must be positive and the errors finite")
    error, accept, reject = map(np.asarray, _budget(u, r, s))
    return ErrorBudget(error, accept, reject, (u, r, s))


def _budget(u: Any, r: Any, s: Any) -> tuple[Any, Any, Any]:
    """Return ΔU, and the readings that are accepted and rejected, of floats or of numbers in 32 digits."""
    error = np.abs(s).sum(axis=-1) + np.sqrt(np.square(r).sum(axis=-1))
    return error, np.maximum(u - error, 0.0), u + error
