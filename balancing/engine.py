"""Shaking forces and couples of engines of several cylinders, by exact orders of the slider-crank.

Every force of one order turns: a force along a fixed direction is one that turns with the crank and one that turns against it.
Cylinders, rotating masses, counterweights and balance shafts are all sources of such forces, each at its place on the shaft.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.correction import correct
from dalembert.angles import phasor
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

LONGEST_RATIO = 1 - 1e-8
"""Throw over rod: at 1 the piston's force has no bound."""


def piston_orders(ratio: float, highest: int = 8) -> Real:
    """Return the orders of a piston's inertia force over m·r·ω², (highest,): those of cos φ, cos 2φ, ….

    Parameters
    ----------
    ratio
        Throw over length of the rod, λ, above 0 and below 1.
    highest
        The highest order.

    Notes
    -----
    The piston stands at s = r cos φ + l √(1 − λ² sin² φ). With κ = √(1 − λ²) and q = λ²/(1 + κ)² the root is
    ½(1 + κ)(1 + q e^{2iφ})^½ (1 + q e^{−2iφ})^½; the product of the two binomial series gives its orders 2n,

        c_n = (1 + κ) Σ_k C(½, k) C(½, k + n) q^{2k + n},

    and −s̈/(r ω²) has order 1 with coefficient 1 and the orders 2n with (2n)² c_n/λ. The odd ones above 1 vanish. The
    first terms are the λ + λ³/4 + … of order 2 and −λ³/4 − … of order 4 in the textbooks.

    Examples
    --------
    >>> [round(order, 6) for order in piston_orders(0.25, 6).tolist()]
    [1.0, 0.254025, 0.0, -0.004098, 0.0, 7.4e-05]
    """
    if not 0 < ratio <= LONGEST_RATIO:
        raise ValueError("expected a rod that is longer than the throw, and a throw above zero")
    root = np.sqrt((1 - ratio) * (1 + ratio))
    q = ratio**2 / (1 + root) ** 2
    half = highest // 2
    terms = int(np.ceil(np.log(EPS**1.2) / (2 * np.log(q)))) + 4 + half
    k = np.arange(1, terms + half + 1)
    binomial = np.concatenate([[1.0], np.cumprod((1.5 - k) / k)])
    powers = q ** (2.0 * np.arange(terms))
    orders = np.zeros(highest)
    orders[:1] = 1.0
    for n in range(1, half + 1):
        c = (1 + root) * q**n * np.sum((binomial[:terms] * binomial[n : n + terms] * powers)[::-1])
        orders[2 * n - 1] = (2 * n) ** 2 * c / ratio
    return orders


@record
class Forces(NamedTuple):
    """Forces of the orders 1 to K of sources along a shaft: with·e^{ikθ} + against·e^{−ikθ}, x + iy, N."""

    z: Real
    """Where each source stands, (s,), m."""
    with_crank: Complex
    """(s, K)."""
    against: Complex
    """(s, K)."""

    def joined(self, *others: Forces) -> Forces:
        """Return the forces of these sources and of others together."""
        z, ahead, back = zip(*(tuple(each) for each in (self, *others)), strict=True)
        return Forces(np.concatenate(z), np.concatenate(ahead), np.concatenate(back))

    def coefficients(self, couple: bool = False) -> Real:
        """Return the coefficients of cos kθ and sin kθ along x and y, (K, 2, 2): of ΣF, N, or of Σ z F, N·m."""
        lever = self.z[:, None] if couple else np.ones((len(self.z), 1))
        ahead, back = (lever * self.with_crank).sum(axis=0), (lever * self.against).sum(axis=0).conj()
        # F_x = Re(C_x e^{ikθ})
        both = np.stack([ahead + back, -1j * (ahead - back)], axis=-1)
        result = np.stack([both.real, -both.imag], axis=-1)
        # what rounding leaves of zero
        return np.where(np.abs(result) > self.rounding(couple)[:, None, None], result, 0.0)

    def largest(self, couple: bool = False) -> Real:
        """Return the largest size of each order over a turn, (K,): the half-axis of its ellipse."""
        c = self.coefficients(couple)
        x, y = (c[:, axis, 0] - 1j * c[:, axis, 1] for axis in (0, 1))
        return np.asarray((np.abs(x + 1j * y) + np.abs(x - 1j * y)) / 2)

    def rounding(self, couple: bool = False) -> Real:
        """Return bounds of the rounding errors of the coefficients, (K,)."""
        lever = np.abs(self.z[:, None]) if couple else np.ones((len(self.z), 1))
        size = (lever * (np.abs(self.with_crank) + np.abs(self.against))).sum(axis=0)
        orders = np.arange(1, size.shape[-1] + 1)
        return np.asarray(EPS * (len(self.z) + 16 + 8 * orders) * size)


def reciprocating_forces(
    crank: ArrayLike,
    bank: ArrayLike,
    z: ArrayLike,
    throw: ArrayLike,
    rod: ArrayLike,
    mass: ArrayLike,
    speed: float,
    highest: int = 8,
) -> Forces:
    """Return the inertia forces of the reciprocating masses of cylinders, as they shake the frame.

    Parameters
    ----------
    crank
        The angle of each crank pin ahead of θ, (n,), degrees: the pin stands at θ + crank.
    bank
        The direction of each cylinder's axis, (n,), degrees counter-clockwise from +x.
    z, throw, rod, mass
        Places along the shaft, crank radii, lengths of the rods, m, and reciprocating masses, kg, (n,).
    speed
        ω, rad/s.
    highest
        The highest order.

    Notes
    -----
    With φ = θ + crank − bank the force is m r ω² Σ_k A_k cos kφ along the axis, A_k from `piston_orders`; half of each
    order turns with the crank from bank + k(crank − bank), half against it from bank − k(crank − bank).

    Examples
    --------
    An inline four: the first order vanishes, the second adds up to 4 m r ω² (λ + λ³/4 + …).

    >>> four = reciprocating_forces([0, 180, 180, 0], [90] * 4, [0, 0.1, 0.2, 0.3], [0.05] * 4, [0.2] * 4, [0.5] * 4, 100.0)
    >>> four.largest()[:2].round(3), four.largest(couple=True)[0]
    (array([  0.   , 254.025]), np.float64(0.0))
    """
    crank, bank, z, throw, rod, mass = np.broadcast_arrays(
        *(np.asarray(each, dtype=float) for each in (crank, bank, z, throw, rod, mass))
    )
    ratios = (throw / rod).tolist()
    orders = {ratio: piston_orders(ratio, highest) for ratio in set(ratios)}
    size = (mass * throw * speed**2)[:, None] * np.array([orders[ratio] for ratio in ratios]) / 2
    turn = np.arange(1, highest + 1) * (crank - bank)[:, None]
    return Forces(
        np.array(z),
        phasor(size, bank[:, None] + turn, "deg"),
        phasor(size, bank[:, None] - turn, "deg"),
    )


def turning_force(
    unbalance: ArrayLike, z: ArrayLike, speed: float, highest: int, order: int = 1, against: bool = False
) -> Forces:
    """Return the forces of unbalances (s,), kg·m, on shafts that turn at `order` times the speed of the crank."""
    u, at = np.atleast_1d(np.asarray(unbalance, dtype=complex)), np.atleast_1d(np.asarray(z, dtype=float))
    ahead, back = np.zeros((2, len(u), highest), dtype=complex)
    (back if against else ahead)[:, order - 1] = u * (order * speed) ** 2
    return Forces(at, ahead, back)


def shaft_unbalances(
    forces: Forces, z: Sequence[float], speed: float, order: int, against: bool = False
) -> Complex:
    """Return the unbalances of balance shafts at `z` that turn at `order` times the speed, (p,), kg·m.

    One shaft takes up the part of the force that turns as it does. Two take up the part of the couple too; of more the sum of
    squares is least (`correct`). The angle is that at θ = 0.

    >>> four = reciprocating_forces([0, 180, 180, 0], 90, [0, 0.1, 0.2, 0.3], 0.05, 0.2, 0.5, 100.0)
    >>> shaft = shaft_unbalances(four, [0.15], 100.0, order=2)
    >>> (abs(shaft) * 200**2).round(3), np.degrees(np.angle(shaft)).round(6)
    (array([127.013]), array([90.]))
    """
    part = (forces.against if against else forces.with_crank)[:, order - 1]
    return np.asarray(correct(part, forces.z, z).unbalance / (order * speed) ** 2)
