"""The heavy symmetric top in closed form: a body with a fixed point on its axis, under gravity.

With u = cos θ, Lz the momentum about the vertical, L3 that about the axis and w± = 1 ± u,

    u̇² = (2a/I1) (u - u1)(u2 - u)(u3 - u),   u = u1 + (u2 - u1) sn²,   a = m g l     (Goldstein, §5.7).

The attitude is the pair α = √(w₊/2) e^{iχ₊}, β = √(w₋/2) e^{iχ₋} of Cayley and Klein (q = Re α, Re β, Im β,
Im α), whose phases run at

    χ̇₊ = (Lz + L3)/(2 I1 w₊),   χ̇₋ = (Lz - L3)/(2 I1 w₋),

apart from the spin by which a top differs from a spherical one (Klein and Sommerfeld, Theorie des Kreisels).
Each phase is one elliptic integral of the third kind, here split so that its sharp turn, where the axis passes
near the vertical, is an arctangent and the rest is smooth. The three roots decide everything through their
differences: they are computed once per top with 200 digits.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_array, as_numbers, common_shape, filled, in_32_digits, is_doubled
from rigidbody3d import attitude as quaternion
from rigidbody3d.elliptic import Jacobi, argument, jacobi, parameter, third, third_complete
from rigidbody3d.states import InClosedForm, PictureData, from_start, in_blocks
from rigidbody3d.top_roots import constants

Array = NDArray[np.float64]

LIGHTEST = 1e60
"""I ω² over m g l: what it takes from the 200 digits of the roots."""


@record
@dataclass(frozen=True, eq=False, repr=False)
class Top:
    """A heavy symmetric top from its inertia about the fixed point and its state at time zero.

    Parameters
    ----------
    inertia
        Principal moments about the fixed point, the axis last: (I1, I1, I3), (..., 3), kg·m².
    mgl
        Weight times the distance of the centre of mass from the fixed point along +z of the body, (...), N·m;
        negative if it lies on the other side. Gravity acts along -z of space.
    omega
        Angular velocity at time zero in body axes, (..., 3), rad/s.
    attitude
        Quaternion [w, x, y, z] at time zero, body to space, (..., 4).

    Raises
    ------
    ValueError
        Two different moments across the axis, a moment that is not positive, shapes that do not fit; a rotation
        so fast that the weight is below 200 digits.

    Examples
    --------
    A fast top released at 0.4 rad without precession, after 2π seconds.

    >>> q0 = [np.cos(0.2), np.sin(0.2), 0, 0]
    >>> top = Top([0.002, 0.002, 0.0008], 0.1962, [0, 0, 100.0], q0)
    >>> top.at(2 * np.pi).attitude.round(8)
    array([ 0.68965605, -0.2128629 ,  0.041763  ,  0.69088333])
    """

    inertia: ArrayLike
    mgl: ArrayLike
    omega: ArrayLike
    attitude: ArrayLike = (1.0, 0.0, 0.0, 0.0)
    _lead: tuple[int, ...] = field(init=False, repr=False, compare=False)
    _rotation: TopRotation = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        I = as_array(self.inertia)
        if I.shape[-2:] == (3, 3):
            if (I * np.eye(3) != I).any():
                raise ValueError("a top's axis is body z: expected a tensor without products of inertia")
            I = np.diagonal(I, axis1=-2, axis2=-1)
        omega, mgl = as_numbers("omega", self.omega), as_numbers("mgl", self.mgl)
        q = as_numbers("attitude", self.attitude)
        if I.shape[-1:] != (3,) or omega.shape[-1:] != (3,):
            raise ValueError(f"inertia and omega have three components, found {I.shape} and {omega.shape}")
        if not (np.isfinite(I).all() and np.isfinite(omega).all() and np.isfinite(mgl).all()):
            raise ValueError("inertia, mgl and omega must be finite")
        if (I[..., 0] != I[..., 1]).any() or (I[..., 0] <= 0).any() or (I[..., 2] < 0).any():
            raise ValueError(
                "a symmetric top has two equal positive moments across its axis, body z, and one about it"
            )
        lead = common_shape(
            inertia=I.shape[:-1], mgl=mgl.shape, omega=omega.shape[:-1], attitude=q.shape[:-1]
        )
        turning = (I * omega**2).sum(axis=-1)
        if ((mgl != 0) & (turning > LIGHTEST * np.abs(mgl))).any():
            raise ValueError(
                f"the weight is negligible against the rotation (I ω² is more than {LIGHTEST:.0e} m g l): expected a slower "
                "rotation, or a free body"
            )
        unit = np.broadcast_to(quaternion.normalize(q), lead + (4,)).reshape(-1, 4)
        rotation = TopRotation(
            np.broadcast_to(I, lead + (3,)).reshape(-1, 3),
            np.broadcast_to(mgl, lead).reshape(-1),
            np.broadcast_to(omega, lead + (3,)).reshape(-1, 3),
            unit,
        )
        object.__setattr__(self, "_lead", lead)
        object.__setattr__(self, "_rotation", rotation)

    def at(self, t: ArrayLike) -> TopState:
        """Return the state at times t, (n,) or a single one, s: `.omega` (..., n, 3), `.attitude` (..., n, 4)."""
        time = as_array(t)
        if time.ndim > 1 or not np.isfinite(time).all():
            raise ValueError("times are a finite number or one row of them")
        return TopState(self, time)

    @property
    def nutation(self) -> Array:
        """The least and the largest angle of the axis with the vertical, (..., 2), rad."""
        m = self._rotation
        low = 2 * np.arctan2(np.sqrt(m.below + 0), np.sqrt(2 - m.below))
        high = 2 * np.arctan2(np.sqrt(2 - m.above), np.sqrt(m.above))
        return np.concatenate([low, high], axis=-1).reshape(self._lead + (2,))

    @property
    def nutation_period(self) -> Array:
        """The period of that angle, (...), s; infinite on the way to the sleeping position."""
        return as_array(2 * self._rotation.p.quarter / self._rotation.rate).reshape(self._lead)

    @cached_property
    def in_32_digits(self) -> Top:
        """This top in doubled numbers."""
        return Top(*map(in_32_digits, (self.inertia, self.mgl, self.omega, self.attitude)))


@record
@dataclass(frozen=True, eq=False, repr=False)
class TopState(InClosedForm):
    """The state of a top at given times; each quantity is computed on the first request."""

    top: Top
    time: Array

    @cached_property
    def _both(self) -> Array:
        return in_blocks(self.top._rotation.state_at, self.time, self.top._lead, 7)

    @property
    def attitude(self) -> Array:
        """Quaternion [w, x, y, z], body to space, (..., n, 4)."""
        start = quaternion.normalize(as_numbers("attitude", self.top.attitude))
        return from_start(self._both[..., :4], start, self.time)

    @property
    def omega(self) -> Array:
        """Angular velocity in body axes, (..., n, 3), rad/s."""
        return from_start(self._both[..., 4:], self.top.omega, self.time)

    @cached_property
    def momentum(self) -> Array:
        """Angular momentum about the fixed point in space axes, (..., n, 3), kg·m²/s."""
        return quaternion.rotate(self.attitude, self._moments * self.omega)

    @cached_property
    def energy(self) -> Array:
        """Kinetic and potential energy, m g l cos θ included, (..., n), J."""
        w, x, y, z = np.moveaxis(self.attitude, -1, 0)
        kinetic = (self._moments * self.omega**2).sum(axis=-1) / 2
        return as_array(kinetic + self._mgl * (w * w + z * z - x * x - y * y))

    @property
    def _picture_data(self) -> PictureData:
        return PictureData(self.top.inertia, free=False, top=True)

    @cached_property
    def in_32_digits(self) -> TopState:
        """This state in doubled numbers."""
        return self.top.in_32_digits.at(in_32_digits(self.time))

    @property
    def _moments(self) -> Array:
        I = _moments(self.top.inertia)
        return I[..., None, :] if self.time.ndim else I

    @property
    def _mgl(self) -> Array:
        mgl = as_array(self.top.mgl)
        return mgl[..., None] if self.time.ndim and mgl.ndim else mgl


def _moments(inertia: ArrayLike) -> Array:
    """Return principal moments (..., 3) that are given as such or as a diagonal tensor."""
    I = as_array(inertia)
    return np.diagonal(I, axis1=-2, axis2=-1) if I.shape[-2:] == (3, 3) else I


class TopRotation:
    """The motion of b tops: what is constant in it, arrays (b, 1), and the state at any time."""

    def __init__(self, I: Array, mgl: Array, omega: Array, q: Array) -> None:
        self.count, self.omega = len(I), omega
        # what is 1e-45 of the rest would have to grow by e^100 before it mattered, and has no fourth power
        q = np.where(np.abs(q) < 1e-45, 0.0, q)
        rate = np.abs(omega).max(axis=-1) + np.sqrt(np.abs(mgl) / I[:, 0])
        omega = np.where(np.abs(omega) < 1e-45 * rate[:, None], 0.0, omega)
        # a centre of mass below: the same motion seen upside down
        self.upside = mgl < 0
        q = np.where(self.upside[:, None], quaternion.compose([0.0, 1.0, 0.0, 0.0], q), q)
        rows = [constants(I[b], mgl[b : b + 1], omega[b], q[b]) for b in range(self.count)]
        # of no top the names alone count
        names = rows[0] if rows else constants(np.ones(3), np.ones(1), np.ones(3), np.eye(4)[0])
        c = {name: _column([row[name] for row in rows], I) for name in names}
        self.p = parameter(c["m"], c["m1"])
        self.rate, self.span, self.above, self.below = c["rate"], c["span"], c["above"], c["below"]
        self.plus, self.minus, self.twice_I1 = c["plus"], c["minus"], 2 * I[:, :1]
        self.c = c
        self.begin = argument(c["sn"], c["cn"], self.p)
        self.extra = (omega[:, 2] * ((I[:, 0] - I[:, 2]) / I[:, 0]))[:, None]
        n_plus, n_minus = c["n_plus"], c["n_minus"]
        self.sharp = n_plus > np.sqrt(c["m"]), n_minus > np.sqrt(c["m"])
        with np.errstate(divide="ignore", invalid="ignore"):
            self.n = tuple(
                np.where(sharp, c["m"] / n, n) for sharp, n in zip(self.sharp, (n_plus, n_minus), strict=True)
            )
        self.quarter = tuple(third_complete(self.p, n) for n in self.n)
        a, b = _complex(q[:, :1], q[:, 3:]), _complex(q[:, 1:2], q[:, 2:3])
        w1, w2 = omega[:, :1], omega[:, 1:2]
        # from sn and cn as given: near the vertical the phases turn too fast to be had from a rounded argument
        dn = np.sqrt(self.p.m1 + self.p.m * c["cn"] ** 2)
        at = Jacobi(np.zeros_like(dn), self.begin, c["sn"], c["cn"], dn)
        start = self._phases(at)
        # where α or β is zero its direction is that of its rate, just before or just after as rounding has it
        before_a = np.where(at.sn < 0, -1.0, 1.0)
        before_b = np.where(at.r > 0, -1.0, 1.0)
        a_rate = _complex(-(q[:, 1:2] * w1 + q[:, 2:3] * w2), q[:, 1:2] * w2 - q[:, 2:3] * w1)
        b_rate = a * _complex(w1, w2)
        self.a0 = _direction(a, a_rate, before_a) * _polar(-start[0])
        self.b0 = _direction(b, b_rate, before_b) * _polar(-start[1])
        self.q = q
        # no lever, or upright or hanging at rest but for its spin: q(t) = exp(P t) q0 exp(S t)
        self.simple = np.flatnonzero(c["still"][:, 0] != 0)
        of = self.simple
        free = (mgl[of] == 0)[:, None]
        momentum = quaternion.rotate(q[of], I[of] * omega[of])
        self.precession = np.where(free, momentum / I[of, :1], 0.0)
        self.spin = np.where(free, self.extra[of] * [0.0, 0.0, 1.0], omega[of])

    def _phases(self, at: Jacobi) -> tuple[Array, Array]:
        """χ₊ and χ₋, but for a constant."""
        c, p = self.c, self.p
        lone = np.isinf(p.quarter)
        half = np.where(lone, 0.0, 2 * p.quarter)
        first = self._integral(at, 0)
        turns = np.where(lone, 0.0, at.turns)
        plus = first + turns * np.where(
            self.sharp[0],
            c["plus_arc"] * np.pi + c["plus_rest"] * 2 * self.quarter[0],
            c["plus_line"] * (half - c["n_plus"] * 2 * self.quarter[0]),
        )
        # χ₋ is counted from the upper turning point: a quarter period on, without loss (A&S 16.8)
        ahead = at.r > 0
        shift = np.where(ahead, -1.0, 1.0)
        root = np.sqrt(np.where(lone, 1.0, p.m1))
        quarter = np.where(lone, 0.0, p.quarter)
        other = Jacobi(
            at.turns,
            np.where(lone, 0.0, at.r + shift * quarter),
            np.where(lone, 0.0, shift * at.cn / at.dn),
            np.where(lone, 1.0, root * np.abs(at.sn) / at.dn),
            np.where(lone, 1.0, root / at.dn),
        )
        n = c["n_minus"]
        whole = np.where(
            self.sharp[1],
            c["minus_arc"] * np.pi - c["minus_line"] * (half - (1 + self.n[1]) * 2 * self.quarter[1]),
            c["minus_line"] * (half - (n + p.m) * 2 * self.quarter[1]),
        )
        # the upper turning points lie at odd multiples of K
        minus = self._integral(other, 1) + (turns + np.where(ahead, 1.0, 0.0)) * np.where(lone, 0.0, whole)
        return plus, minus

    def _integral(self, at: Jacobi, which: int) -> Array:
        c, p, n, sharp = self.c, self.p, self.n[which], self.sharp[which]
        smooth = third(at, p, n)
        if which == 0:
            sn = np.where(at.sn == 0, 1e-150, at.sn)
            arc = np.arctan2(c["plus_g"] * sn, at.cn * at.dn)
            return np.where(
                sharp,
                c["plus_arc"] * arc + c["plus_rest"] * smooth,
                c["plus_line"] * (at.r - n * smooth),
            )
        # zero has a side: just before the turning point, or just after
        sn = np.where(at.sn == 0, np.copysign(1e-150, at.sn), at.sn)
        arc = np.arctan2(c["minus_g"] * sn, at.cn * at.dn)
        return np.where(
            sharp,
            c["minus_arc"] * arc - c["minus_line"] * (at.r - (1 + n) * smooth),
            c["minus_line"] * (at.r - (n + p.m) * smooth),
        )

    def state_at(self, t: Array) -> Array:
        """Attitude and angular velocity at times t, (b, n, 7)."""
        out = filled((self.count, len(t), 7), 0.0, self.omega)
        at = jacobi(self.begin + self.rate * t, self.p)
        plus, minus = self._phases(at)
        turn = self.extra * t / 2
        # no square underflows
        sn = np.where(np.abs(at.sn) < 1e-150, 1e-150, at.sn)
        cn = np.where(np.abs(at.cn) < 1e-150, 1e-150, at.cn)
        across_a, across_b = np.sqrt(self.above / 2), np.sqrt(self.below / 2)
        swing_by = np.sqrt(self.span / 2)
        size_a, size_b = np.hypot(across_a, swing_by * sn), np.hypot(across_b, swing_by * cn)
        way_a, way_b = self.a0 * _polar(plus + turn), self.b0 * _polar(minus - turn)
        a, b = way_a * size_a, way_b * size_b
        # θ̇ and φ̇ sin θ, each as the small over the small
        with np.errstate(divide="ignore", invalid="ignore"):
            tilt = -self.span * self.rate * sn * cn * at.dn / (size_a * size_b)
            swing = (self.plus * (size_b / size_a) + self.minus * (size_a / size_b)) / self.twice_I1
        across = way_a.conj() * way_b * _complex(tilt, swing)
        out[..., 0], out[..., 1], out[..., 2], out[..., 3] = a.real, b.real, b.imag, a.imag
        out[..., 4], out[..., 5] = across.real, across.imag
        out[..., 6] = self.omega[:, 2:]
        if len(self.simple):
            turn_in_space = quaternion.from_vector(self.precession[:, None, :] * t[:, None])
            spin = quaternion.from_vector(self.spin[:, None, :] * t[:, None])
            start = quaternion.compose(turn_in_space, self.q[self.simple][:, None, :])
            out[self.simple, :, :4] = quaternion.compose(start, spin)
            out[self.simple, :, 4:] = quaternion.rotate(
                quaternion.inverse(spin), self.omega[self.simple][:, None, :]
            )
        upside = np.flatnonzero(self.upside)
        if len(upside):
            out[upside, :, :4] = quaternion.compose([0.0, -1.0, 0.0, 0.0], out[upside, :, :4])
        return out


def _column(numbers: list[Decimal], like: Array) -> Array:
    """Numbers of 200 digits as a column (b, 1), rounded once."""
    if is_doubled(like):
        from dalembert.arithmetic.doubled_fractions import exactly

        return as_array(exactly(map(Fraction, numbers), (len(numbers), 1)))
    return np.array([float(x) for x in numbers])[:, None]


def _complex(x: Any, y: Any) -> Any:
    """x + iy."""
    if is_doubled(x):
        from dalembert.arithmetic.doubled_arrays import Vectors

        return Vectors.of_parts(x, y)
    return x + 1j * y


def _polar(angle: Array) -> Any:
    """e^{i·angle}."""
    return _complex(np.cos(angle), np.sin(angle)) if is_doubled(angle) else np.exp(1j * angle)


def _direction(z: Any, otherwise: Any, sign: Array) -> Any:
    """z/|z|, or where z is zero that of another number with a sign."""
    zero = (z.real == 0) & (z.imag == 0)
    x, y = np.where(zero, otherwise.real, z.real), np.where(zero, otherwise.imag, z.imag)
    sign = np.where(zero, sign, 1.0)
    if not is_doubled(x):
        return sign * _polar(np.arctan2(y, x))
    size = np.hypot(x, y)
    # nothing turns about nothing
    still = size == 0
    size = np.where(still, 1.0, size)
    return _complex(np.where(still, 1.0, x / size), y / size) * sign
