"""Gyroscopes: the couple of a rotor on a turning base, steady precession, cones, the sleeping top."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, in_32_digits
from rigidbody3d.inertia import vectors

Array = NDArray[np.float64]


def gyroscopic_couple(momentum: ArrayLike, frame_omega: ArrayLike) -> Array:
    """Return the moment Ω × H on a rotor whose base turns, (..., 3), N·m; the rotor exerts -Ω × H.

    Parameters
    ----------
    momentum
        H of the rotor, (..., 3), kg·m²/s.
    frame_omega
        Angular velocity Ω of the base, (..., 3), rad/s.

    Raises
    ------
    ValueError
        Not three components.

    Notes
    -----
    Beer and Johnston, ch. 18; Riul II, eq. 44, with a constant H in the axes of the base.

    Examples
    --------
    Beer and Johnston 18.81: I = 0.29632 kg·m² at 2700 rpm, taken through a 200 m curve at 90 km/h.

    >>> H = [0, 0.29632 * 2700 * np.pi / 30, 0]
    >>> gyroscopic_couple(H, [0, 0, 25 / 200])
    array([-10.4728...,   0.        ,   0.        ])
    """
    return np.asarray(np.cross(vectors("frame_omega", frame_omega), vectors("momentum", momentum)))


class _Rates(NamedTuple):
    slow: Array
    fast: Array


@record
class Steady(_Rates):
    """The two rates of steady precession, `.slow` and `.fast`, rad/s; NaN where the spin is too slow for any."""

    inputs: tuple[Array, ...]
    """The arguments of `steady_precession`."""

    def error_estimate(self) -> tuple[Array, Array]:
        """Return estimates of the errors of both rates, (...), rad/s: computed twice, with 16 and with 32 digits.

        Where the two nearly coincide, at the least spin that allows them, the square root leaves half the digits.
        """
        second: Any = steady_precession(*map(in_32_digits, self.inputs))
        slow, fast = (there.off(here) for there, here in zip(second, self, strict=True))
        # the spin is just fast enough for 16 digits, and just too slow for 32
        slow, fast = (np.where(np.isnan(off) & ~np.isnan(self.slow), np.inf, off) for off in (slow, fast))
        return slow, fast


def steady_precession(
    transverse: ArrayLike, axial: ArrayLike, mgl: ArrayLike, tilt: ArrayLike, spin: ArrayLike
) -> Steady:
    """Return the slow and the fast rate of precession of a top at constant tilt.

    Parameters
    ----------
    transverse, axial
        Moments I1 and I3 about the fixed point, (...), kg·m².
    mgl
        N·m.
    tilt
        Angle of the axis with the vertical, (...), rad.
    spin
        ω3, the component of the angular velocity along the axis, (...), rad/s.

    Returns
    -------
    Steady
        `.slow` and `.fast`, (...), rad/s.

    Notes
    -----
    I1 cos θ φ̇² - I3 ω3 φ̇ + m g l = 0 (Goldstein, §5.7); with B = I3 ω3 and D = B² - 4 I1 m g l cos θ the
    larger root is (B ± √D)/(2 I1 cos θ), the other 2 m g l/(B ± √D), the sign that of B: nothing cancels. The
    fast rate is infinite at a right angle.

    Examples
    --------
    >>> [float(x) for x in steady_precession(0.002, 0.0008, 0.1962, 0.4, 60.0)]
    [5.07653596218304..., 20.980370319014...]
    """
    inputs = tuple(map(as_array, (transverse, axial, mgl, tilt, spin)))
    I1, I3, a, theta, w = inputs
    c = np.cos(theta)
    # a right angle given in radians is one to rounding
    c = np.where(np.abs(c) < 1e-16, 0.0, c)
    side = np.where(I3 * w < 0, -1.0, 1.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        B = I3 * w
        large = B + side * np.sqrt(B * B - 4 * I1 * a * c)
        slow, fast = 2 * a / large, large / (2 * I1 * c)
    rates = Steady(np.where((a == 0) & (w == 0), 0.0, slow), fast)
    rates.inputs = inputs
    return rates


def sleeping_threshold(transverse: ArrayLike, axial: ArrayLike, mgl: ArrayLike) -> Array:
    """Return the spin above which a top is stable upright, 2 √(m g l I1)/I3, (...), rad/s.

    It is zero if the centre of mass lies below the fixed point, infinite for a thin rod along the axis.

    Parameters
    ----------
    transverse, axial
        Moments I1 and I3 about the fixed point, (...), kg·m².
    mgl
        Weight times the distance of the centre of mass from the fixed point, (...), N·m.

    Notes
    -----
    H. Goldstein, Classical Mechanics, §5.7.

    Examples
    --------
    >>> float(sleeping_threshold(0.002, 0.0008, 0.1962))
    49.5227...
    """
    I1, I3, a = map(as_array, (transverse, axial, mgl))
    with np.errstate(divide="ignore", invalid="ignore"):
        return as_array(2 * np.sqrt(np.maximum(a, 0.0) * I1) / I3)


class _Cones(NamedTuple):
    space: Array
    body: Array
    precession: Array
    spin: Array


@record
class Cones(_Cones):
    """The cones of a free symmetric body: half angles, rad, and rates, rad/s.

    `.space` is the angle between ω and H, the cone fixed in space; `.body` that between ω and the axis of the body,
    the cone fixed in it; `.precession` the rate at which the axis goes round H, |H|/I1; `.spin` the rate of the body
    about its axis relative to the precessing plane, ω3 (I1 - I3)/I1.
    """

    inputs: tuple[Array, Array, Array]
    """The arguments of `cones`."""

    def error_estimate(self) -> tuple[Array, ...]:
        """Return estimates of the errors of the four, (...): computed twice, with 16 and with 32 digits."""
        second: Any = cones(*map(in_32_digits, self.inputs))
        return tuple(there.off(here) for there, here in zip(second, self, strict=True))


def cones(transverse: ArrayLike, axial: ArrayLike, omega: ArrayLike) -> Cones:
    """Return the cones that roll on each other in the free rotation of a symmetric body.

    Parameters
    ----------
    transverse, axial
        I1 (twice) and I3, (...), kg·m².
    omega
        Angular velocity in body axes, the axis last, (..., 3), rad/s.

    Returns
    -------
    Cones
        Half angles (rad) of both cones, precession and spin (rad/s), (...) each.

    Notes
    -----
    Beer and Johnston, ch. 18; Goldstein, §5.6. The angle between ω and H from its own sine,
    (I1 - I3) ω⊥ ω3, which does not cancel where they are close.

    Examples
    --------
    >>> c = cones(1.0, 2.0, [0.0, 1.0, 1.0])
    >>> [round(float(np.degrees(x)), 4) for x in c[:2]]
    [18.4349, 45.0]
    """
    I1, I3, w = as_array(transverse), as_array(axial), as_array(omega)
    across, along = np.hypot(w[..., 0], w[..., 1]), w[..., 2]
    result = Cones(
        np.arctan2(np.abs(I1 - I3) * across * np.abs(along), I1 * across**2 + I3 * along**2),
        np.arctan2(across, np.abs(along)),
        np.hypot(across, I3 * along / I1),
        along * (I1 - I3) / I1,
    )
    result.inputs = (I1, I3, w)
    return result
