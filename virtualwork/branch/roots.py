"""Where a smooth function along the input vanishes: the real roots of the Chebyshev series through its samples."""

from __future__ import annotations

import numpy as np

from virtualwork.formulas.numbers import Reals

# a last coefficient below this share of the largest is none: what is divided by it would overflow
NONE = 1e-100


def chebyshev_nodes(n: int) -> Reals:
    """The n Chebyshev points of the first kind in (−1, 1)."""
    return np.cos(np.pi * (np.arange(n) + 0.5) / n)


def real_roots(series: np.polynomial.Chebyshev, within: float) -> Reals:
    """The real roots of a series within ±`within`; none of a series that is zero or not finite.

    Examples
    --------
    >>> from numpy.polynomial import Chebyshev
    >>> nodes = chebyshev_nodes(8)
    >>> real_roots(Chebyshev.fit(nodes, 1e-300 * (nodes - 0.25), 6, domain=[-1, 1]), 1.0).round(12)
    array([0.25])
    >>> real_roots(Chebyshev([np.nan, 1.0]), 1.0)
    array([], dtype=float64)
    """
    largest = float(np.abs(series.coef).max(initial=0.0))
    if not (np.isfinite(largest) and largest > 0):
        return np.empty(0)
    # by a power of two, which rounds nothing
    scaled = type(series)(np.ldexp(series.coef, -int(np.frexp(largest)[1]))).trim(NONE)
    roots = scaled.roots()
    return np.asarray(np.real(roots[(np.abs(np.imag(roots)) < 1e-6) & (np.abs(np.real(roots)) <= within)]))
