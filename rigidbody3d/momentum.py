"""Angular momentum, its true rate in turning axes, and d'Alembert's wrench.

    H_G = I ω                                   (Riul II, eqs. 24-35)
    Ḣ_G = (Ḣ_G)_rel + Ω × H_G                   (eqs. 36-44), Ω the rate of the axes
    ΣF = m a_G,  ΣM_G = Ḣ_G                     (eqs. 22, 23): the inertia wrench is (-m a_G, -Ḣ_G).

Where the axes turn with the body (Ω = ω) the tensor is constant in them and (Ḣ)_rel = I·(ω̇)_rel. Where they do
not, (Ḣ)_rel also holds the rate of the tensor itself, which vanishes only for a body of revolution about the
axis of the difference ω - Ω; here Ḣ is always the true rate, I α + ω × (I ω) with α = (ω̇)_rel + Ω × ω.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import components, numbers, record, table
from dalembert.arithmetic.shapes import as_array, as_numbers, common_shape, in_32_digits, is_doubled
from rigidbody3d.inertia import vectors
from rigidbody3d.states import BLOCK, require

if TYPE_CHECKING:
    import pandas as pd

    from rigidbody3d.body import Body

Array = NDArray[np.float64]


@record
class Wrench(NamedTuple):
    """A force and a moment, (..., 3) each, N and N·m."""

    force: Array
    moment: Array


@record
@dataclass(frozen=True, init=False, eq=False, repr=False)
class Motion:
    """A rigid body in motion, one state or many: its momentum and the forces that the motion needs.

    Each quantity is computed on the first request. All components are along one set of axes, in which the
    tensor is given: the fixed axes at the instant looked at, or axes turning with the body.

    Parameters
    ----------
    inertia
        The tensor at the centre of mass, (3, 3) or (..., 3, 3), kg·m²; the products enter as -I_xy.
    omega
        Angular velocity of the body, (..., 3), rad/s.
    alpha
        Rate of the components of ω in the axes given by `frame_omega`, (..., 3), rad/s².
    frame_omega
        Angular velocity Ω of axes that do not turn with the body, (..., 3), rad/s; None: they turn with it.
    mass
        (...), kg.
    center
        Position of the centre of mass, (..., 3), m.
    velocity, acceleration
        Of the centre of mass in fixed space, (..., 3), m/s, m/s².

    Examples
    --------
    Riul's example 3: a disk of 3.63 kg, here 0.2 m in radius, spins at 12 rad/s about z on an arm that turns at
    4 rad/s about y.

    >>> from rigidbody3d import inertia_of
    >>> disk = Motion(inertia_of("disk", 3.63, radius=0.2), [0, 4, 12.0], frame_omega=[0, 4.0, 0])
    >>> disk.momentum.round(6)
    array([0.    , 0.1452, 0.8712])
    >>> disk.rate.round(6)
    array([3.4848, 0.    , 0.    ])
    """

    inertia: Array
    omega: Array
    alpha: Array
    frame_omega: Array | None
    mass: Array
    center: Array
    velocity: Array
    acceleration: Array
    pivot: Array | None
    """The point fixed in space from which velocity and acceleration follow; None: they are arguments."""

    def __init__(
        self,
        inertia: ArrayLike,
        omega: ArrayLike,
        alpha: ArrayLike = (0.0, 0.0, 0.0),
        frame_omega: ArrayLike | None = None,
        mass: ArrayLike = 0.0,
        center: ArrayLike = (0.0, 0.0, 0.0),
        velocity: ArrayLike = (0.0, 0.0, 0.0),
        acceleration: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        I, m = as_numbers("inertia", inertia), as_numbers("mass", mass)
        if I.shape[-2:] != (3, 3):
            raise ValueError(f"inertia must have the shape (..., 3, 3), found {I.shape}")
        arguments = {
            "omega": omega,
            "alpha": alpha,
            "center": center,
            "velocity": velocity,
            "acceleration": acceleration,
        }
        if frame_omega is not None:
            arguments["frame_omega"] = frame_omega
        each = {name: vectors(name, value) for name, value in arguments.items()}
        common_shape(inertia=I.shape[:-2], mass=m.shape, **{name: v.shape[:-1] for name, v in each.items()})
        none = {"frame_omega": None, "pivot": None}
        for name, value in ({"inertia": I, "mass": m} | none | each).items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        states = np.broadcast_shapes(self.inertia.shape[:-2], self.omega.shape[:-1], self.mass.shape)
        if states:
            return f"<Motion: {np.prod(states)} states, omega {numbers(self.omega)} rad/s>"
        return f"<Motion: omega {numbers(self.omega)} rad/s, momentum {numbers(self.momentum)} kg·m²/s>"

    @cached_property
    def momentum(self) -> Array:
        """H_G = I ω about the centre of mass, (..., 3), kg·m²/s."""
        return _times(self.inertia, self.omega)

    @cached_property
    def true_alpha(self) -> Array:
        """The angular acceleration in fixed space, (ω̇)_rel + Ω × ω, (..., 3), rad/s²."""
        if self.frame_omega is None:
            return self.alpha
        return self.alpha + _cross(self.frame_omega, self.omega)

    @cached_property
    def rate(self) -> Array:
        """Ḣ_G in fixed space, (..., 3), N·m: the moment about the centre of mass that the motion asks for."""
        I, w, alpha = self.inertia, self.omega, self.true_alpha
        if I.ndim > 2 or w.ndim == 1 or w.shape != alpha.shape or is_doubled(w):
            return _times(I, alpha) + _cross(w, self.momentum)
        # both in one pass, while a block of ω is in the cache; H is not computed twice
        momentum, rate = _momentum_and_rate(I, w, alpha, self.__dict__.get("momentum"))
        self.__dict__["momentum"] = momentum
        return rate

    @cached_property
    def transport(self) -> Array:
        """Ω × H_G, the part of the rate that the turning of the axes gives, (..., 3), N·m."""
        frame = self.omega if self.frame_omega is None else self.frame_omega
        return _cross(frame, self.momentum)

    @cached_property
    def relative(self) -> Array:
        """(Ḣ_G)_rel, the rate of the components of H_G in the turning axes, (..., 3), N·m."""
        if self.frame_omega is None:
            return _times(self.inertia, self.alpha)
        return _times(self.inertia, self.alpha) + self.tensor_rate

    @cached_property
    def tensor_rate(self) -> Array:
        """İ_rel ω: what the change of the tensor in the turning axes adds, (..., 3), N·m; zero in body axes.

        With ν = ω - Ω the turning of the body in those axes, İ_rel ω = ν × (I ω) - I (ν × ω).
        """
        if self.frame_omega is None:
            return np.zeros_like(self.momentum)
        slip = self.omega - self.frame_omega
        return _cross(slip, self.momentum) - _times(self.inertia, _cross(slip, self.omega))

    @cached_property
    def linear_momentum(self) -> Array:
        """m v_G, (..., 3), kg·m/s."""
        return _scaled(self.mass, self.velocity)

    @cached_property
    def force(self) -> Array:
        """m a_G, the external force that the motion asks for, (..., 3), N."""
        return _scaled(self.mass, self.acceleration)

    @cached_property
    def inertia_force(self) -> Array:
        """d'Alembert's inertia force, -m a_G, (..., 3), N."""
        return _scaled(self.mass, self.acceleration, -1.0)

    @cached_property
    def inertia_wrench(self) -> Wrench:
        """d'Alembert's wrench at the centre of mass: -m a_G and -Ḣ_G."""
        return Wrench(self.inertia_force, -self.rate)

    @cached_property
    def energy(self) -> Array:
        """Kinetic energy, ½ m v² + ½ ω·H, (...), J."""
        v2: Array = (self.velocity * self.velocity).sum(axis=-1)
        turning: Array = (self.omega * self.momentum).sum(axis=-1)
        return self.mass * v2 / 2 + turning / 2

    def momentum_about(self, point: ArrayLike) -> Array:
        """Return H about a point, H_G + (G - P) × m v_G, (..., 3), kg·m²/s."""
        return self.momentum + _cross(self.center - as_array(point), self.linear_momentum)

    def rate_about(self, point: ArrayLike) -> Array:
        """Return Ḣ about a point fixed in space, Ḣ_G + (G - P) × m a_G, (..., 3), N·m: the moment needed there."""
        return self.rate + _cross(self.center - as_array(point), self.force)

    def to_frame(self) -> pd.DataFrame:
        """Return a table with a row per state: ω, H and its rate, d'Alembert's inertia force, kinetic energy."""
        columns = components("omega_*_rad_s", self.omega)
        columns |= components("momentum_*_kg_m2_s", self.momentum)
        columns |= components("momentum_rate_*_N_m", self.rate)
        columns |= components("inertia_force_*_N", self.inertia_force)
        return table(columns | {"energy_J": self.energy}, ("state",))

    @cached_property
    def in_32_digits(self) -> Motion:
        """This motion in doubled numbers."""
        return self.of_body(*map(in_32_digits, (self.mass, self.center, self.inertia)))

    def of_body(self, mass: Array, center: Array, inertia: Array) -> Motion:
        """Return this motion, in doubled numbers, of a body with other mass, centre and tensor."""
        omega, alpha = in_32_digits(self.omega), in_32_digits(self.alpha)
        frame = None if self.frame_omega is None else in_32_digits(self.frame_omega)
        if self.pivot is not None:
            at = {"mass": mass, "center": center, "point": in_32_digits(self.pivot)}
            return Motion.about_fixed_point(inertia, omega, alpha, frame_omega=frame, **at)
        velocity, acceleration = in_32_digits(self.velocity), in_32_digits(self.acceleration)
        return Motion(inertia, omega, alpha, frame, mass, center, velocity, acceleration)

    def error_estimate(self, of: str, point: ArrayLike | None = None, body: Body | None = None) -> Array:
        """Return an estimate of the error of a quantity, in its shape and unit: computed twice, with 16 and with 32 digits.

        Parameters
        ----------
        of
            Its name: momentum, rate, transport, relative, tensor_rate, linear_momentum, force, inertia_force,
            inertia_moment, energy, momentum_about, rate_about, true_alpha.
        point
            What momentum_about and rate_about are about, (..., 3), m.
        body
            The body to 32 digits, where it was computed (`Body.in_32_digits`).

        Examples
        --------
        >>> disk = Motion(np.diag([1.0, 1.0, 2.0]), [0, 4, 12.1], frame_omega=[0, 4.3, 0])
        >>> bool((disk.error_estimate("rate") < 1e-14).all())
        True
        """
        require(of, *ESTIMATED)
        if point is None and of.endswith("_about"):
            raise ValueError(f"{of}: expected the point that it is about")
        second = self.in_32_digits if body is None else self.of_body(body.mass, body.center, body.inertia)

        def quantity(motion: Motion) -> Any:
            value = getattr(motion, "rate" if of == "inertia_moment" else of)
            return value(point) if of.endswith("_about") else value

        return quantity(second).off(quantity(self))  # type: ignore[no-any-return]

    @classmethod
    def about_fixed_point(
        cls,
        inertia: ArrayLike,
        omega: ArrayLike,
        alpha: ArrayLike = (0.0, 0.0, 0.0),
        *,
        mass: ArrayLike,
        center: ArrayLike,
        point: ArrayLike = (0.0, 0.0, 0.0),
        frame_omega: ArrayLike | None = None,
    ) -> Motion:
        """Return the motion of a body that turns about a point fixed in space: v = ω × r, a = α × r + ω × v."""
        motion, pivot = cls(inertia, omega, alpha, frame_omega, mass, center), vectors("point", point)
        common_shape(point=pivot.shape[:-1], center=motion.center.shape[:-1], omega=motion.omega.shape[:-1])
        velocity, acceleration = _about_pivot(motion, pivot)
        for name, value in (("velocity", velocity), ("acceleration", acceleration), ("pivot", pivot)):
            object.__setattr__(motion, name, value)
        return motion


ESTIMATED = [
    "momentum",
    "true_alpha",
    "rate",
    "transport",
    "relative",
    "tensor_rate",
    "linear_momentum",
    "force",
    "inertia_force",
    "inertia_moment",
    "energy",
    "momentum_about",
    "rate_about",
]
"""The quantities of a motion with an error estimate."""


def _about_pivot(motion: Motion, pivot: Array) -> tuple[Array, Array]:
    """Velocity and acceleration of the centre of mass of a body that turns about a point fixed in space."""
    arm = motion.center - pivot
    velocity = _cross(motion.omega, arm)
    return velocity, _cross(motion.true_alpha, arm) + _cross(motion.omega, velocity)


def _times(I: Array, w: Array) -> Array:
    """I ω for states (..., 3)."""
    if I.ndim == 2:
        if w.ndim > 1 and w.dtype == I.dtype == float:
            return _in_blocks(w, I)
        return w @ I.T
    product: Array = (I * w[..., None, :]).sum(axis=-1)
    return product


def _in_blocks(w: Array, I: Array) -> Array:
    """I ω for states (..., 3) of one tensor, in blocks that stay in the cache."""
    flat, transposed = w.reshape(-1, 3), np.ascontiguousarray(I.T)
    out = np.empty_like(flat)
    for s in range(0, len(flat), BLOCK):
        np.matmul(flat[s : s + BLOCK], transposed, out=out[s : s + BLOCK])
    return out.reshape(w.shape)


def _momentum_and_rate(
    I: Array, w: Array, alpha: Array, momentum: Array | None = None
) -> tuple[Array, Array]:
    """I ω, unless it is given, and ω × I ω + I α for states (..., 3) of one tensor, in blocks that stay in the cache."""
    flat, turn = w.reshape(-1, 3), alpha.reshape(-1, 3)
    transposed = np.ascontiguousarray(I.T)
    coefficients = np.concatenate([_gyroscopic(I), transposed])
    rate = np.empty_like(flat)
    new = np.empty_like(flat) if momentum is None else None
    most = min(BLOCK, len(flat))
    columns, terms = np.empty((3, most)), np.empty((9, most))
    for s in range(0, len(flat), BLOCK):
        part, size = slice(s, s + BLOCK), min(BLOCK, len(flat) - s)
        spin, each = columns[:, :size], terms[:, :size]
        if new is not None:
            np.matmul(flat[part], transposed, out=new[part])
        # products of components of ω, then α, as rows: whole columns of a block in one stroke
        spin[...], each[6:] = flat[part].T, turn[part].T
        np.multiply(spin, spin, out=each[:3])
        for row, (a, b) in enumerate(_PAIRS, 3):
            np.multiply(spin[a], spin[b], out=each[row])
        np.matmul(each.T, coefficients, out=rate[part])
    if new is not None:
        momentum = new.reshape(w.shape)
    assert momentum is not None
    return momentum, rate.reshape(w.shape)


_PAIRS = ((1, 2), (2, 0), (0, 1))


def _gyroscopic(I: Array) -> Array:
    """The coefficients of ω × I ω in ωx², ωy², ωz², ωy ωz, ωz ωx, ωx ωy, (6, 3): Euler's (I_zz - I_yy) ωy ωz …."""
    out = np.zeros((6, 3))
    for x, (y, z) in enumerate(_PAIRS):
        out[y, x], out[z, x] = I[z, y], -I[y, z]
        out[3 + x, x], out[3 + y, x], out[3 + z, x] = I[z, z] - I[y, y], -I[y, x], I[z, x]
    return out


def _cross(a: Array, b: Array) -> Array:
    """a × b of vectors (..., 3); of many in blocks, whose parts stay in the cache."""
    if is_doubled(a) or is_doubled(b) or a.ndim != 2 or a.shape != b.shape or len(a) <= BLOCK:
        return np.cross(a, b)
    out = np.empty_like(a)
    for s in range(0, len(a), BLOCK):
        out[s : s + BLOCK] = np.cross(a[s : s + BLOCK], b[s : s + BLOCK])
    return out


def _scaled(factor: Array, vectors: Array, sign: float = 1.0) -> Array:
    """A factor (...) times vectors (..., 3); of many each column by itself, in blocks: numpy takes twice as long for rows of three."""
    if is_doubled(vectors) or vectors.ndim != 2 or factor.shape != vectors.shape[:1] or len(vectors) <= BLOCK:
        return (sign * factor)[..., None] * vectors
    out = np.empty_like(vectors)
    for s in range(0, len(vectors), BLOCK):
        part = slice(s, s + BLOCK)
        signed = sign * factor[part]
        for k in range(3):
            np.multiply(signed, vectors[part, k], out=out[part, k])
    return out
