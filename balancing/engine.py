"""Shaking forces and couples of engines of several cylinders, by exact orders of the slider-crank.

Every force of one order turns: a force along a fixed direction is one that turns with the crank and one that turns against it.
Cylinders, rotating masses, counterweights and balance shafts are all sources of such forces, each at its place on the shaft.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.correction import correct
from dalembert.angles import phasor
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, as_numbers, filled, in_32_digits, is_doubled

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

LONGEST_RATIO = 1 - 1e-8
"""Throw over rod: at 1 the piston's force has no bound."""


def piston_orders(ratio: ArrayLike, highest: int = 8) -> Real:
    """Return the orders of a piston's inertia force over m·r·ω², (..., highest): those of cos φ, cos 2φ, ….

    Parameters
    ----------
    ratio
        Throw over length of the rod, λ, above 0 and below 1, (...).
    highest
        The highest order.

    Raises
    ------
    ValueError
        A throw that is not above zero, or not shorter than the rod.

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
    ratio = as_array(ratio)
    if not ((ratio > 0) & (ratio <= LONGEST_RATIO)).all():
        raise ValueError("expected a rod that is longer than the throw, and a throw above zero")
    half = highest // 2
    orders = filled((*ratio.shape, highest), 0.0, ratio)
    orders[..., :1] = 1.0
    if not ratio.size:
        return orders
    root = np.sqrt((1 - ratio) * (1 + ratio))[..., None]
    q = ratio[..., None] ** 2 / (1 + root) ** 2
    # what is left out is nothing in 32 digits either
    terms = int(np.ceil(np.log(EPS**2.4) / (2 * np.log(float(q.max()))))) + 4 + half
    k = filled((terms + half,), 0.0, ratio) + np.arange(1.0, terms + half + 1)
    binomial = np.concatenate([filled((1,), 1.0, ratio), np.cumprod((1.5 - k) / k)])
    powers = q ** (2.0 * np.arange(terms))
    for n in range(1, half + 1):
        series = (binomial[:terms] * binomial[n : n + terms] * powers)[..., ::-1].sum(axis=-1)
        c = ((1 + root) * q**n)[..., 0] * series
        orders[..., 2 * n - 1] = (2 * n) ** 2 * c / ratio
    return orders


@record
@dataclass(frozen=True, eq=False, repr=False)
class Forces:
    """Forces of the orders 1 to K of sources along a shaft: with·e^{ikθ} + against·e^{−ikθ}, x + iy, N."""

    z: Real
    """The position of each source, (s,), m."""
    with_crank: Complex
    """(s, K)."""
    against: Complex
    """(s, K)."""
    again: Callable[[], Forces] | None = field(default=None, compare=False)
    """These forces in 32 digits, computed on request; None: the floats are exact."""

    def joined(self, *others: Forces) -> Forces:
        """Return the forces of these sources and of others together."""
        every = (self, *others)
        z, ahead, back = (
            np.concatenate([getattr(each, name) for each in every]) for name in ("z", "with_crank", "against")
        )
        if is_doubled(z):
            return Forces(z, ahead, back)
        return Forces(z, ahead, back, partial(_joined_again, every))

    @property
    def exact(self) -> Forces:
        """These forces in 32 digits."""
        if is_doubled(self.z):
            return self
        if self.again is not None:
            return self.again()
        return Forces(*map(in_32_digits, (self.z, self.with_crank, self.against)))

    def coefficients(self, couple: bool = False) -> Real:
        """Return the coefficients of cos kθ and sin kθ along x and y, (K, 2, 2): of ΣF, N, or of Σ z F, N·m."""
        ahead, back = self._sums(couple)
        back = back.conj()
        # F_x = Re(C_x e^{ikθ})
        both = np.stack([ahead + back, -1j * (ahead - back)], axis=-1)
        return self._without_nothing(np.stack([both.real, -both.imag], axis=-1), couple)

    def largest(self, couple: bool = False) -> Real:
        """Return the largest size of each order over a turn, (K,): the half-axis of its ellipse."""
        # the parts with and against the crank meet twice in a turn
        ahead, back = self._sums(couple)
        return self._without_nothing(np.abs(ahead) + np.abs(back), couple)

    def error_estimate(self, quantity: str = "coefficients", couple: bool = False) -> Real:
        """Return the rounding errors of `coefficients` (K, 2, 2) or `largest` (K,): by what the same in 32 digits differs.

        Examples
        --------
        >>> four = reciprocating_forces([0, 180, 180, 0], 90, [0, 0.1, 0.2, 0.3], 0.05, 0.2, 0.5, 100.0)
        >>> bool((four.error_estimate("largest") <= 1e-15 * 254).all())
        True
        """
        if quantity not in ("coefficients", "largest"):
            raise ValueError(f"'{quantity}': expected coefficients or largest")
        true: Any = getattr(self.exact, quantity)(couple)
        # what cancels in the sums of 32 digits
        hidden = 2.0**-96 * self._sizes(couple)
        return np.asarray(
            true.off(getattr(self, quantity)(couple)) + hidden.reshape(-1, *(1,) * (true.ndim - 1))
        )

    def turning(self, order: int, against: bool, couple: bool = False) -> complex:
        """Return what turns with the crank, or against it, at an order: of ΣF, N, or of Σ z F, N·m; 0 where its terms cancel."""
        total = complex(self._sums(couple)[against][order - 1])
        return total if abs(total) > self.negligible(couple)[order - 1] else 0j

    def _sums(self, couple: bool) -> tuple[Complex, Complex]:
        """Return what turns with and against the crank, (K,) each."""
        lever = self.z[:, None] if couple else np.ones((len(self.z), 1))
        return (lever * self.with_crank).sum(axis=0), (lever * self.against).sum(axis=0)

    def _sizes(self, couple: bool) -> Real:
        """Return the sizes of what the sums are of, (K,)."""
        lever = np.abs(self.z[:, None]) if couple else np.ones((len(self.z), 1))
        return np.asarray((lever * (np.abs(self.with_crank) + np.abs(self.against))).sum(axis=0))

    def negligible(self, couple: bool = False) -> Real:
        """Return the size of each order below which a sum is nothing: its terms cancel to their last digits, (K,)."""
        orders = np.arange(1, self.with_crank.shape[-1] + 1)
        return np.asarray(EPS * (len(self.z) + 16 + 8 * orders) * self._sizes(couple))

    def _without_nothing(self, values: Any, couple: bool) -> Real:
        if is_doubled(values):
            doubled: Real = values
            return doubled
        limit = self.negligible(couple).reshape(-1, *(1,) * (values.ndim - 1))
        return np.array(np.where(np.abs(values) > limit, values, 0.0))


def _again(formula: Callable[..., Forces], numbers: tuple[Any, ...], *more: Any) -> Forces:
    return formula(*map(in_32_digits, numbers), *more)


def _joined_again(every: tuple[Forces, ...]) -> Forces:
    first, *others = (each.exact for each in every)
    return first.joined(*others)


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
        *(as_array(each) for each in (crank, bank, z, throw, rod, mass))
    )
    size = (mass * throw * speed**2)[:, None] * piston_orders(throw / rod, highest) / 2
    turn = np.arange(1.0, highest + 1) * (crank - bank)[:, None]
    return Forces(
        z + 0.0,
        phasor(size, bank[:, None] + turn, "deg"),
        phasor(size, bank[:, None] - turn, "deg"),
        partial(_again, reciprocating_forces, (crank, bank, z, throw, rod, mass, speed), highest),
    )


def turning_force(
    unbalance: ArrayLike, z: ArrayLike, speed: float, highest: int, order: int = 1, against: bool = False
) -> Forces:
    """Return the forces of unbalances (s,), kg·m, on shafts that turn at `order` times the speed of the crank."""
    u, at = np.atleast_1d(as_numbers("unbalance", unbalance, complex)), np.atleast_1d(as_array(z))
    ahead, back = (np.zeros_like(at, dtype=complex, shape=(len(u), highest)) for _ in range(2))
    (back if against else ahead)[:, order - 1] = u * (order * speed) ** 2
    return Forces(
        at + 0.0,
        ahead,
        back,
        partial(_again, turning_force, (u, at, speed), highest, order, against),
    )


def shaft_unbalances(
    forces: Forces, z: ArrayLike, speed: float, order: int, against: bool = False
) -> Complex:
    """Return the unbalances of balance shafts at `z` that turn at `order` times the speed, (p,), kg·m.

    One shaft takes up the part of the force that turns as it does. Two take up the part of the couple too; of more the sum of
    squares is least (`correct`). The angle is that at θ = 0. Of forces in 32 digits they have 32 digits.

    >>> four = reciprocating_forces([0, 180, 180, 0], 90, [0, 0.1, 0.2, 0.3], 0.05, 0.2, 0.5, 100.0)
    >>> shaft = shaft_unbalances(four, [0.15], 100.0, order=2)
    >>> (abs(shaft) * 200**2).round(3), np.degrees(np.angle(shaft)).round(6)
    (array([127.013]), array([90.]))
    """
    z = np.atleast_1d(as_array(z))
    part = (forces.against if against else forces.with_crank)[:, order - 1]
    couples = (False, True)[: len(z)]
    if not (is_doubled(part) or any(forces.turning(order, against, couple) for couple in couples)):
        return np.zeros(len(z), dtype=complex)
    return opposite(part, forces.z, z) / (order * speed) ** 2  # type: ignore[no-any-return]


def opposite(moment: Any, z: Any, planes: Any) -> Any:
    """Return the corrections (p,) of unbalances or forces (k,) at z (k,), of floats or of numbers in 32 digits.

    >>> opposite(np.array([1.0]), np.array([0.5]), np.array([0.0, 1.0]))
    array([-0.5+0.j, -0.5+0.j])
    """
    if not is_doubled(moment):
        return correct(moment, z, planes).unbalance
    from balancing.second_run import ExactMasses

    places = (in_32_digits(np.atleast_1d(x)).doubled for x in (z, planes))
    return ExactMasses(moment, *places).corrections
