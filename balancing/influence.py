"""Influence coefficients: what a unit mass in a plane adds to the vibration at a sensor, from trial runs.

The vibration V_s at sensor s (and speed) answers linearly to the masses w_p in the planes,

    r = V + α w                                   (Goodman 1964, eq. 1; ISO 21940-12, annex on flexible rotors)

A vibration, a mass, a coefficient is a complex number: size and phase, and both phases are counted in one common
sense.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.dependence import DependentTrials, adjoint, columns_scaled, require_independent
from dalembert.arithmetic.shapes import as_numbers, common_shape

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
