"""Jacobi's elliptic functions and Legendre's third integral, by the complementary parameter m₁ = 1 - m.

Near a separatrix m₁ decides everything and 1 - m has lost it; here m₁ is what is given. Numbers or arrays
that broadcast; a parameter may differ from body to body.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.shapes import is_doubled

Array = NDArray[np.float64]
Doubled = Any
"""Numbers of 32 digits (`DoubledArray`), or what enters their operations."""

SPREAD = 3e-5
"""The share of their mean by which the arguments of a doubled integral may differ at the end: its series leaves out their eighth power."""


class Parameter(NamedTuple):
    """A parameter m, its complement, its quarter period and its ladder of arithmetic-geometric means."""

    m: Array
    m1: Array
    quarter: Array
    """K(m); infinite where m₁ = 0."""
    ladder: tuple[tuple[Array, Array], ...]
    mean: Array


class Jacobi(NamedTuple):
    """sn, cn, dn of u = r + 2nK with |r| ≤ K, at the reduced argument r."""

    turns: Array
    """n; sn and cn of u itself are (-1)ⁿ times those of r."""
    r: Array
    sn: Array
    cn: Array
    dn: Array


def parameter(m: Array, m1: Array) -> Parameter:
    """Prepare a parameter for `jacobi`: the quarter period by the arithmetic-geometric mean.

    Parameters
    ----------
    m, m1
        The parameter in [0, 1] and its complement, each to full relative precision.

    Notes
    -----
    Abramowitz and Stegun 17.6.3; the ladder is that of R. Bulirsch, Numer. Math. 7 (1965) 78-90.

    Examples
    --------
    >>> float(parameter(np.array(0.5), np.array(0.5)).quarter)
    1.854074677301371...
    """
    lone = m1 == 0
    a = np.zeros_like(m1) + 1.0
    b = np.sqrt(np.where(lone, 1.0, m1))
    ladder = []
    # 9 steps at m₁ = 1e-300
    for _ in range(24):
        ladder.append((a, b))
        # the next step squares it
        if (np.abs(a - b) <= (2e-16 if is_doubled(a) else 2e-8) * a).all():
            break
        a, b = (a + b) / 2, np.sqrt(a * b)
    mean = (a + b) / 2
    return Parameter(m, m1, np.where(lone, np.inf, np.pi / 2 / mean), tuple(ladder), mean)


def jacobi(u: Array, p: Parameter) -> Jacobi:
    """Return sn, cn and dn at u, each to full relative precision of the reduced argument.

    Notes
    -----
    Bulirsch's `sncndn` (Numer. Math. 7, 1965, 78-90): one sine and cosine, then products, quotients and sums
    of positive numbers only. Where m₁ = 0: tanh and sech.

    Examples
    --------
    >>> at = jacobi(np.array(0.5), parameter(np.array(0.5), np.array(0.5)))
    >>> [round(float(x), 15) for x in (at.sn, at.cn, at.dn)]
    [0.470750473655657, 0.88226639489044, 0.942972425777386]
    """
    lone = np.isinf(p.quarter)
    half = np.where(lone, 1.0, 2 * p.quarter)
    turns = np.where(lone, 0.0, np.rint(u / half))
    r = u - turns * half
    x = r * p.mean
    sine, cosine = np.sin(x), np.cos(x)
    # there sn = r, to r³
    small = np.abs(x) < (1e-16 if is_doubled(x) else 1e-9)
    cotangent = cosine / np.where(small, 1.0, sine)
    c = p.mean * cotangent
    a = cotangent
    dn = np.zeros_like(a) + 1.0
    for b, e in reversed(p.ladder):
        a = a * c
        c = c * dn
        dn = (e + a) / (b + a)
        a = c / b
    size = 1 / np.sqrt(1 + c * c)
    sn = np.where(small, r, np.copysign(size, sine))
    cn = np.where(small, 1.0, np.abs(c) * size)
    dn = np.where(small, 1.0, dn)
    if np.any(lone):
        w = np.where(lone, r, 0.0)
        far = 300.0 if is_doubled(w) else 700.0
        sech = 1 / np.cosh(np.minimum(np.abs(w), far))
        sn, cn, dn = np.where(lone, np.tanh(w), sn), np.where(lone, sech, cn), np.where(lone, sech, dn)
    return Jacobi(turns, r, sn, cn, dn)


def argument(sn: Array, cn: Array, p: Parameter) -> Array:
    """Return u in [-2K, 2K] with these sn and cn: the elliptic integral of the first kind.

    Notes
    -----
    Carlson's R_F, DLMF 19.25.5, from the half turn that holds the point.

    Examples
    --------
    >>> round(float(argument(np.array(0.6), np.array(0.8), parameter(np.array(0.5), np.array(0.5)))), 15)
    0.66584782526294...
    """
    lone = np.isinf(p.quarter)
    c2 = cn * cn
    with np.errstate(divide="ignore"):
        u = np.where(
            lone, np.arcsinh(sn / np.abs(cn)), sn * _first(c2, np.where(lone, 1.0, c2 + p.m1 * sn * sn), 1.0)
        )
    return np.where(cn < 0, np.copysign(2 * p.quarter, sn) - u, u)


def third(at: Jacobi, p: Parameter, n: Array) -> Array:
    """Return ∫₀ʳ sn²/(1 + n·sn²) du for n ≥ 0, a sum of nothing but positive terms.

    Notes
    -----
    (Π(-n) - F)/(-n) in Legendre's integrals; (sn³/3)·R_J(cn², dn², 1, 1 + n·sn²), DLMF 19.25.14. Where
    m₁ = 0 it is elementary.

    Examples
    --------
    >>> p = parameter(np.array(0.5), np.array(0.5))
    >>> round(float(third(jacobi(np.array(1.0), p), p, np.array(0.7))), 12)
    0.199247296731
    """
    lone = np.isinf(p.quarter)
    s2 = at.sn * at.sn
    safe = np.where(lone, 1.0, at.cn * at.cn)
    value = at.sn * s2 / 3 * _third(safe, np.where(lone, 1.0, at.dn * at.dn), 1.0, 1 + n * s2)
    if np.any(lone):
        root = np.sqrt(np.where(lone & (n > 0), n, 1.0))
        arc = np.where(n > 0, np.arctan(root * at.sn) / root, at.sn)
        value = np.where(lone, (at.r - arc) / (1 + n), value)
    return value


def third_complete(p: Parameter, n: Array) -> Array:
    """Return `third` over a quarter period, ∫₀ᴷ sn²/(1 + n·sn²) du; 0 where the period is infinite."""
    lone = np.isinf(p.quarter)
    return np.where(lone, 0.0, _third(0.0, np.where(lone, 1.0, p.m1), 1.0, 1 + n) / 3)


def _first(x: Array, y: Array, z: float) -> Array:
    """R_F: scipy's of floats, our own of doubled numbers."""
    if is_doubled(x):
        doubled: Array = _doubled_first(x, y, z)
        return doubled
    from scipy.special import elliprf

    return np.asarray(elliprf(x, y, z))


def _third(x: ArrayLike, y: Array, z: float, p: Array) -> Array:
    """R_J: scipy's of floats, our own of doubled numbers."""
    if is_doubled(y):
        doubled: Array = _doubled_third(x, y, z, p)
        return doubled
    from scipy.special import elliprj

    return np.asarray(elliprj(x, y, z, p))


# --- Carlson's integrals of doubled numbers: B. C. Carlson, Numerical Algorithms 10 (1995) 13-26; DLMF, §19.36(i): duplication
# draws the arguments together, and a series of order seven ends it ---


def _doubled_first(x: Doubled, y: Doubled, z: Doubled) -> Doubled:
    """R_F(x, y, z) of numbers that are not negative, at most one of them 0.

    >>> from dalembert.arithmetic.doubled_arrays import DoubledArray
    >>> float(_doubled_first(DoubledArray(1.0), 2.0, 4.0).value)
    0.6850858166...
    """
    x, y, z = np.broadcast_arrays(x, y, z)
    for _ in range(40):
        mean = (x + y + z) / 3
        if _near(mean, x, y, z):
            break
        a, b, c = np.sqrt(x), np.sqrt(y), np.sqrt(z)
        shift = a * b + b * c + c * a
        x, y, z = (x + shift) / 4, (y + shift) / 4, (z + shift) / 4
    X, Y = 1 - x / mean, 1 - y / mean
    Z = -X - Y
    e2, e3 = X * Y - Z * Z, X * Y * Z
    # DLMF 19.36.1
    series = 1 - e2 / 10 + e3 / 14 + e2 * e2 / 24 - 3 * e2 * e3 / 44
    series = series - 5 * e2 * e2 * e2 / 208 + 3 * e3 * e3 / 104 + e2 * e2 * e3 / 16
    return series / np.sqrt(mean)


def _doubled_third(x: Doubled, y: Doubled, z: Doubled, p: Doubled) -> Doubled:
    """R_J(x, y, z, p) with p no less than the others, of which at most one is 0.

    >>> from dalembert.arithmetic.doubled_arrays import DoubledArray
    >>> float(_doubled_third(DoubledArray(2.0), 3.0, 4.0, 5.0).value)
    0.1429757966...
    """
    x, y, z, p = np.broadcast_arrays(x, y, z, p)
    delta = (p - x) * (p - y) * (p - z)
    total, factor = 0.0 * x, 1.0
    for _ in range(40):
        mean = (x + y + z + 2 * p) / 5
        if _near(mean, x, y, z, p):
            break
        a, b, c, d = np.sqrt(x), np.sqrt(y), np.sqrt(z), np.sqrt(p)
        across = (d + a) * (d + b) * (d + c)
        e = delta * factor**3 / (across * across)
        total = total + _elementary(e) * factor / across
        shift = a * b + b * c + c * a
        x, y, z, p = ((v + shift) / 4 for v in (x, y, z, p))
        factor /= 4
    X, Y, Z = 1 - x / mean, 1 - y / mean, 1 - z / mean
    P = -(X + Y + Z) / 2
    e2 = X * Y + X * Z + Y * Z - 3 * P * P
    e3 = X * Y * Z + 2 * e2 * P + 4 * P * P * P
    e4 = (2 * X * Y * Z + e2 * P + 3 * P * P * P) * P
    e5 = X * Y * Z * P * P
    # DLMF 19.36.2
    series = 1 - 3 * e2 / 14 + e3 / 6 + 9 * e2 * e2 / 88 - 3 * e4 / 22 - 9 * e2 * e3 / 52 + 3 * e5 / 26
    series = series - e2 * e2 * e2 / 16 + 3 * e3 * e3 / 40 + 3 * e2 * e4 / 20
    series = series + 45 * e2 * e2 * e3 / 272 - 9 * (e3 * e4 + e2 * e5) / 68
    return series * factor / (mean * np.sqrt(mean)) + 6 * total


def _elementary(e: Doubled) -> Doubled:
    """R_C(1, 1 + e), arctan(√e)/√e, for e ≥ 0."""
    root = np.sqrt(np.where(e > 1e-60, e, 1.0))
    return np.where(e > 1e-60, np.arctan(root) / root, 1.0)


def _near(mean: Doubled, *x: Doubled) -> bool:
    return all((np.abs((v - mean).high) <= SPREAD * mean.high).all() for v in x)
