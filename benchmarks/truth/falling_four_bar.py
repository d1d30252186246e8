"""A four-bar that falls without friction, by its energy alone: one degree of freedom is a quadrature.

With the kinetic energy M(q) q̇²/2 and the potential V(q) it goes to and fro between two places of the potential it
starts at. With q = (a + b)/2 − (b − a)/2·cos u the time is ∫ √(M/2(V₀ − V)) dq/du du, whose integrand is smooth and
periodic in u: its trapezoidal sums converge faster than any power, and the integral up to any u is that of its Fourier
series. Of the mechanism only the two circles that meet are used.
"""

from __future__ import annotations

from typing import Any

import mpmath as mp

# lengths m, masses kg, inertias kg m² about the centres, which lie in the middle of the bars; the base is horizontal
CRANK, COUPLER, ROCKER, BASE = "0.1", "0.35", "0.25", "0.4"
MASSES, INERTIAS, G = ("1", "2", "1.5"), ("0.1", "0.02", "0.008"), "9.81"


def angle(t: Any, start: Any, digits: int = 30, points: int = 256) -> Any:
    """The crank's angle, rad, at a time t after it was released at rest at `start`, the coupler's joint above.

    Raises
    ------
    ArithmeticError
        It takes more points, as from a place near a dead point.
    """
    with mp.workdps(digits + 10):
        begin = mp.mpf(start)
        energy = _energies(begin)[1]
        # downwards to the other place of that potential
        other, step = begin - mp.mpf("0.2"), mp.mpf("0.05")
        while _energies(other)[1] < energy:
            other -= step
        end = mp.findroot(lambda q: _energies(q)[1] - energy, (other, other + step), solver="anderson")
        middle, half = (begin + end) / 2, (begin - end) / 2

        def slowness(u: Any) -> Any:
            """dt/du."""
            q = middle + half * mp.cos(u)
            mass, potential = _energies(q)
            return half * mp.sin(u) * mp.sqrt(mass / (2 * (energy - potential)))

        # dt/du is even about 0 and π: a cosine series, from the middles between its points
        n = points
        us = [mp.pi * (k + mp.mpf("0.5")) / n for k in range(n)]
        values = [slowness(u) for u in us]
        series = [
            sum(v * mp.cos(j * u) for u, v in zip(us, values, strict=True)) * (1 if j == 0 else 2) / n
            for j in range(n)
        ]
        if abs(series[-1]) > mp.mpf(10) ** (-digits) * abs(series[0]):
            raise ArithmeticError("more points")
        lasts = 2 * mp.pi * series[0]
        left = mp.mpf(t) - lasts * mp.floor(mp.mpf(t) / lasts)

        def elapsed(u: Any) -> Any:
            return series[0] * u + sum(c * mp.sin(j * u) / j for j, c in enumerate(series[1:], 1))

        u = mp.findroot(lambda x: elapsed(x) - left, 2 * mp.pi * left / lasts)
        return +(middle + half * mp.cos(u))


def _energies(q: Any) -> tuple[Any, Any]:
    """M and V at a crank's angle."""
    a, c, r, d = (mp.mpf(x) for x in (CRANK, COUPLER, ROCKER, BASE))
    crank = mp.expj(q)
    across = d - a * crank
    far = abs(across)
    along = (far**2 + c**2 - r**2) / (2 * far)
    up = mp.sqrt(c**2 - along**2)
    coupler = across / far * (along + 1j * up) / c
    rocker = (a * crank + c * coupler - d) / r
    # a·i e_a + c·i e_c·θ = r·i e_r·ψ, over the other one's direction
    other = mp.im(a * crank * mp.conj(coupler)) / (r * mp.im(rocker * mp.conj(coupler)))
    turn = -mp.im(a * crank * mp.conj(rocker)) / (c * mp.im(coupler * mp.conj(rocker)))
    places = a * crank / 2, a * crank + c * coupler / 2, d + r * rocker / 2
    rates = 1j * a * crank / 2, 1j * (a * crank + turn * c * coupler / 2), 1j * other * r * rocker / 2
    masses, inertias = ([mp.mpf(x) for x in of] for of in (MASSES, INERTIAS))
    mass = sum(m * abs(w) ** 2 for m, w in zip(masses, rates, strict=True))
    mass += sum(i * w**2 for i, w in zip(inertias, (1, turn, other), strict=True))
    return mass, mp.mpf(G) * sum(m * mp.im(z) for m, z in zip(masses, places, strict=True))
