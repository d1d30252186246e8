"""The balance of virtual power from a plain table of link states: the second source document, eqs. (3) to (5).

Only the state of each link of a mechanism is needed: the velocity of its centre of mass, its angular velocity,
and the loads on it. In equilibrium, at rest or (with inertia loads, d'Alembert) in motion, their power vanishes:

    Σ F·v_F + Σ T ω + Σ m g·v_G − Σ m a_G·v_G − Σ I α ω = 0                      (Riul, unit II, eq. 5)

Forces between links and on fixed supports do no work and do not appear. One load may be unknown; with several
independent velocity fields of the same instant, as many unknowns as fields. Vectors of the plane are complex
numbers x + iy: F·v is the real part of F v̄.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, as_vectors, in_32_digits

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]

KINDS = ("applied force", "applied torque", "weight", "inertia force", "inertia torque")
"""The kinds of terms, in the order of eq. (5)."""

ROUNDING = 8 * np.finfo(float).eps
"""A power below this share of load times largest velocity is rounding: the load does no work."""

HIDDEN = 2.0**-97
"""The possible error of sums in 32 digits, as a share of the sizes of their terms."""


class PowerTerm(NamedTuple):
    """The loads of one kind on all links."""

    power: Real
    """(..., n), W; exactly zero where the load does no work."""
    works: Mask
    """(..., n): there is a load, and it does work."""
    workless: Mask
    """(..., n): there is a load, and it does none: it is normal to the velocity, or its point is at rest."""


@record
@dataclass(frozen=True, eq=False, repr=False)
class LinkStates:
    """The states of n links, at one instant or at many.

    Every entry is an array (..., n) or a number, links on the last axis. Vectors are complex, x + iy.

    Parameters
    ----------
    velocity : complex, (..., n)
        Of the centres of mass, m/s.
    omega : (..., n)
        Angular velocities, rad/s.
    mass, inertia : (..., n)
        kg, and kg·m² about the centre of mass.
    acceleration : complex, (..., n)
        Of the centres of mass, m/s².
    alpha : (..., n)
        Angular accelerations, rad/s².
    force, torque : (..., n)
        The applied force (complex, N) and torque (N·m) on each link.
    point_velocity : complex, (..., n), optional
        Velocity of the force's point of application, m/s; default: that of the centre of mass.
    gravity : complex
        m/s², such as −9.81j.

    Examples
    --------
    Riul's example 1, links 2, 3 and 4: the weight, the inertia force and the inertia torque of the coupler,
    the inertia force of the piston and the gas force on it.

    >>> states = LinkStates(
    ...     velocity=[0, 300 + 200j, -500], omega=[20, -50, 0], mass=[0, 3, 2], inertia=[0, 0.1, 0],
    ...     acceleration=[0, 900 - 600j, 900], alpha=[0, -800, 0], force=[0, 0, 5000], gravity=-10j)
    >>> float(states.power), float(states.terms["inertia torque"].power[1])
    (-2060000.0, -4000.0)
    """

    velocity: ArrayLike
    omega: ArrayLike = 0.0
    mass: ArrayLike = 0.0
    inertia: ArrayLike = 0.0
    acceleration: ArrayLike = 0.0
    alpha: ArrayLike = 0.0
    force: ArrayLike = 0.0
    torque: ArrayLike = 0.0
    point_velocity: ArrayLike | None = None
    gravity: complex = 0j

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """The common shape (..., n)."""
        fields = [getattr(self, name) for name in self.__dataclass_fields__ if name != "gravity"]
        return np.broadcast_shapes(*(np.shape(value) for value in fields if value is not None), (1,))

    @cached_property
    def terms(self) -> dict[str, PowerTerm]:
        """The power of every load, by kind (see KINDS); a kind of which there is no load is absent.

        Kinds without a load are never multiplied out.
        """
        terms = {}
        for kind, (load, rate) in self.products().items():
            if load.any():
                size, power = np.abs(load), power_of(load, rate)
                fastest = self.fastest[1 if kind.endswith("torque") else 0]
                works = (np.abs(power) > ROUNDING * size * fastest) | np.isinf(power)
                works, there = (np.broadcast_to(mask, self.shape) for mask in (works, size > 0))
                terms[kind] = PowerTerm(np.where(works, power, 0.0), works, there & ~works)
        return terms

    @cached_property
    def power(self) -> Real:
        """The power of all known loads together, (...), W: the left side of eq. (5) without the unknown."""
        total = np.zeros(self.shape[:-1])
        for term in self.terms.values():
            total = total + term.power.sum(axis=-1)
        return total

    @cached_property
    def fastest(self) -> tuple[Real, Real]:
        """The largest speed of a point (m/s) and the largest angular speed (rad/s) among the links, each (..., 1)."""
        speed = np.abs(np.asarray(self.velocity, dtype=complex))
        if self.point_velocity is not None:
            speed = np.maximum(speed, np.abs(self.applied_velocity))
        turning = np.abs(np.asarray(self.omega, dtype=float))
        full = self.shape
        return (
            np.broadcast_to(speed, full).max(axis=-1, keepdims=True),
            np.broadcast_to(turning, full).max(axis=-1, keepdims=True),
        )

    @cached_property
    def applied_velocity(self) -> Complex:
        """The velocities of the points of application of the forces, m/s."""
        return as_vectors(self.velocity if self.point_velocity is None else self.point_velocity)

    @property
    def in_32_digits(self) -> LinkStates:
        """Return these states in numbers of 32 digits, the floats exactly."""
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return replace(self, **{name: in_32_digits(x) for name, x in fields.items() if x is not None})

    def error_estimate(self, kind: str = "", exact: LinkStates | None = None) -> Real:
        """Return the rounding error (...) of `power`, or (..., n) of each power of one kind, W.

        It is by what the same in 32 digits differs: of the states `exact`, or None: of the floats. A power that was taken
        for none since it is as small as rounding counts as it is there.

        >>> states = LinkStates(velocity=[0.1 + 0.3j], mass=[0.7], gravity=-9.81j)
        >>> bool(0 < states.error_estimate()[()] < 1e-15)
        True
        """
        second = self.in_32_digits if exact is None else exact
        if kind:
            each = power_of(*second.products()[kind])
            return np.broadcast_to(each.off(self.terms[kind].power), self.shape)
        size = sum(
            (np.abs(term.power).sum(axis=-1) for term in self.terms.values()), np.zeros(self.shape[:-1])
        )
        return np.asarray(second.whole_power.off(self.power) + HIDDEN * size)

    @property
    def whole_power(self) -> Any:
        """`power` with what is as small as rounding, (...), W."""
        powers = (power_of(*pair) for pair in self.products().values() if pair[0].any())
        return sum(
            ((power + np.zeros(self.shape)).sum(axis=-1) for power in powers), 0.0 * np.zeros(self.shape[:-1])
        )

    def products(self) -> dict[str, tuple[Any, Any]]:
        """Return what is multiplied for the power of each kind: force and velocity, complex, or torque and ω.

        >>> states = LinkStates(velocity=[2 + 1j], mass=[3], gravity=-10j)
        >>> force, velocity = states.products()["weight"]
        >>> float(force[0].imag), complex(velocity[0])
        (-30.0, (2+1j))
        """
        v, a, force = (as_vectors(x) for x in (self.velocity, self.acceleration, self.force))
        mass, inertia, omega, alpha, torque = (
            as_array(x) for x in (self.mass, self.inertia, self.omega, self.alpha, self.torque)
        )
        return {
            "applied force": (force, self.applied_velocity),
            "applied torque": (torque, omega),
            "weight": (mass * as_vectors(self.gravity), v),
            "inertia force": (-mass * a, v),
            "inertia torque": (-inertia * alpha, omega),
        }


def power_of(load: Any, rate: Any) -> Any:
    """Return the powers (..., n) of loads: F·v of complex forces N and velocities m/s, T ω of torques N·m and rad/s; W."""
    product = load * rate.conj()
    return product.real


@record
@dataclass(frozen=True, eq=False, repr=False)
class UnitLoad:
    """An unknown load: its force and torque on each link for one newton or newton-metre of it.

    `force` is complex, (..., n), acting where `LinkStates.force` acts; `torque` is (..., n).

    Examples
    --------
    >>> UnitLoad(torque=[1, 0, 0])  # an unknown torque on the first of three links
    UnitLoad(force=0, torque=[1 0 0])
    """

    force: ArrayLike = 0.0
    torque: ArrayLike = 0.0

    @property
    def acts(self) -> Mask:
        """(n,): it acts on this link."""
        force, torque = np.broadcast_arrays(self.force, self.torque)
        here = (force != 0) | (torque != 0)
        return np.asarray(here.reshape(-1, here.shape[-1]).any(axis=0))

    @property
    def unit(self) -> str:
        """The unit of the unknown: N, N·m, or neither if it is both a force and a torque."""
        kinds = {"N": np.any(np.asarray(self.force) != 0), "N·m": np.any(np.asarray(self.torque) != 0)}
        return " and ".join(unit for unit, there in kinds.items() if there)
