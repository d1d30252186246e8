"""Gyroscopes: the couple of a rotor on a turning base, steady precession, cones, the sleeping top."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.exact import UNIT
from dalembert.arithmetic.records import record

if TYPE_CHECKING:
    from dalembert.arithmetic.bounds import Given

Array = NDArray[np.float64]


def gyroscopic_couple(momentum: ArrayLike, frame_omega: ArrayLike) -> Array:
    """Return the moment that must act on a rotor whose base turns, Ω × H, (..., 3), N·m; the rotor answers -Ω × H.

    Examples
    --------
    Beer and Johnston 18.81: I = 0.29632 kg·m² at 2700 rpm, taken through a 200 m curve at 90 km/h.

    >>> H = [0, 0.29632 * 2700 * np.pi / 30, 0]
    >>> gyroscopic_couple(H, [0, 0, 25 / 200])
    array([-10.4728...,   0.        ,   0.        ])
    """
    return np.asarray(np.cross(np.asarray(frame_omega, dtype=float), np.asarray(momentum, dtype=float)))


class _Rates(NamedTuple):
    slow: Array
    fast: Array


@record
class Steady(_Rates):
    """The two rates of steady precession, `.slow` and `.fast`, rad/s; NaN where the spin is too slow for any."""

    given: dict[str, Given]
    """I1, I3, m g l, the tilt's cosine, the spin, and the sign of its momentum."""

    def error_estimate(self) -> tuple[Array, Array]:
        """Return bounds of the rounding errors of both rates, (...), rad/s.

        Where the two nearly coincide, at the least spin that allows them, the square root leaves half the digits.
        """
        from dalembert.arithmetic.bounds import bounds

        slow, fast = bounds(_rates, self.given)
        return np.where(self.slow == 0, 0.0, slow), np.where(np.isinf(self.fast), np.inf, fast)


def steady_precession(
    transverse: ArrayLike, axial: ArrayLike, mgl: ArrayLike, tilt: ArrayLike, spin: ArrayLike
) -> Steady:
    """Return the slow and the fast rate at which a top precesses at constant tilt.

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
    I1, I3, a, theta, w = (np.asarray(x, dtype=float) for x in (transverse, axial, mgl, tilt, spin))
    c = np.cos(theta)
    # a right angle given in radians is one to rounding
    c = np.where(np.abs(c) < 1e-16, 0.0, c)
    side = np.where(I3 * w < 0, -1.0, 1.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        slow, fast = _rates(I1, I3, a, c, w, side)
    rates = Steady(np.where((a == 0) & (w == 0), 0.0, slow), np.asarray(fast))
    exact = {"I1": I1, "I3": I3, "mgl": a, "spin": w, "side": side}
    # a cosine errs by one unit in its last place
    rates.given = {"c": (c, 0, 2 * UNIT * np.abs(c)), **{name: (x, 0, 0.0) for name, x in exact.items()}}
    return rates


def _rates(I1: Array, I3: Array, mgl: Array, c: Array, spin: Array, side: Array) -> tuple[Array, Array]:
    """On arrays of any kind of number, recorded ones for bounds too."""
    B = I3 * spin
    large = B + side * np.sqrt(B * B - 4 * I1 * mgl * c)
    return 2 * mgl / large, large / (2 * I1 * c)


def sleeping_threshold(transverse: ArrayLike, axial: ArrayLike, mgl: ArrayLike) -> Array:
    """Return the spin above which a top stands upright stably, 2 √(m g l I1)/I3, (...), rad/s (Goldstein, §5.7).

    Zero where the centre of mass lies below the fixed point.

    Examples
    --------
    >>> float(sleeping_threshold(0.002, 0.0008, 0.1962))
    49.5227...
    """
    I1, I3, a = (np.asarray(x, dtype=float) for x in (transverse, axial, mgl))
    return np.asarray(2 * np.sqrt(np.maximum(a, 0.0) * I1) / I3)


@record
class Cones(NamedTuple):
    """The cones of a free symmetric body: half angles, rad, and rates, rad/s.

    `.space` is the angle between ω and H, the cone fixed in space; `.body` that between ω and the axis of the body,
    the cone fixed in it; `.precession` the rate at which the axis goes round H, |H|/I1; `.spin` the rate of the body
    about its axis relative to the precessing plane, ω3 (I1 - I3)/I1.
    """

    space: Array
    body: Array
    precession: Array
    spin: Array

    def error_estimate(self) -> tuple[Array, ...]:
        """Return bounds of the rounding errors of the four, (...): small beside each, since nothing here cancels."""
        roundings = (16, 6, 8, 4)
        return tuple(n * UNIT * np.abs(x) for n, x in zip(roundings, self, strict=True))


def cones(transverse: ArrayLike, axial: ArrayLike, omega: ArrayLike) -> Cones:
    """Return the cones that roll on each other when a symmetric body turns freely.

    Parameters
    ----------
    transverse, axial
        I1 (twice) and I3, (...), kg·m².
    omega
        Angular velocity in body axes, the axis last, (..., 3), rad/s.

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
    I1, I3 = np.asarray(transverse, dtype=float), np.asarray(axial, dtype=float)
    w = np.asarray(omega, dtype=float)
    across, along = np.hypot(w[..., 0], w[..., 1]), w[..., 2]
    space = np.arctan2(np.abs(I1 - I3) * across * np.abs(along), I1 * across**2 + I3 * along**2)
    return Cones(
        space,
        np.arctan2(across, np.abs(along)),
        np.hypot(across, I3 * along / I1),
        np.asarray(along * (I1 - I3) / I1),
    )
