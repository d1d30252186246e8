"""The heavy symmetric top in closed form: a body with a fixed point on its axis, under gravity.

With u = cos θ, Lz the momentum about the vertical, L3 that about the axis and w± = 1 ± u,

    u̇² = (2a/I1) (u - u1)(u2 - u)(u3 - u),   u = u1 + (u2 - u1) sn²,   a = m g l     (Goldstein, §5.7).

The attitude is the pair α = √(w₊/2) e^{iχ₊}, β = √(w₋/2) e^{iχ₋} of Cayley and Klein (q = Re α, Re β, Im β,
Im α), whose phases run at

    χ̇₊ = (Lz + L3)/(2 I1 w₊),   χ̇₋ = (Lz - L3)/(2 I1 w₋),

apart from the spin by which a top differs from a spherical one (Klein and Sommerfeld, Theorie des Kreisels).
Each phase is one elliptic integral of the third kind, here split so that its sharp turn, where the axis passes
near the vertical, is an arctangent and the rest is smooth. The three roots decide everything through their
differences: they are worked out once per top with 200 digits.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record
from dalembert.arithmetic.shapes import as_numbers, common_shape
from rigidbody3d import attitude as quaternion
from rigidbody3d.elliptic import Jacobi, argument, jacobi, parameter, third, third_complete
from rigidbody3d.rounding_in_time import FEW, STATE, apart, require
from rigidbody3d.states import AtTimes, Seen, in_blocks
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
        so fast that 200 digits do not tell the weight.

    Examples
    --------
    A fast top let go at 0.4 rad without precession, after 2π seconds.

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
        I = np.asarray(self.inertia, dtype=float)
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
                f"the weight is nothing beside the rotation (I ω² is more than {LIGHTEST:.0e} m g l): expected a slower "
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
        time = np.asarray(t, dtype=float)
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
        return np.asarray(2 * self._rotation.p.quarter / self._rotation.rate).reshape(self._lead)


@record
@dataclass(frozen=True, eq=False, repr=False)
class TopState(AtTimes):
    """The state of a top at given times; each quantity is computed on the first request."""

    top: Top
    time: Array

    @cached_property
    def _both(self) -> Array:
        return in_blocks(self.top._rotation.state_at, self.time, self.top._lead, 7)

    @property
    def attitude(self) -> Array:
        """Quaternion [w, x, y, z], body to space, (..., n, 4)."""
        return self._both[..., :4]

    @property
    def omega(self) -> Array:
        """Angular velocity in body axes, (..., n, 3), rad/s."""
        return self._both[..., 4:]

    @cached_property
    def momentum(self) -> Array:
        """Angular momentum about the fixed point in space axes, (..., n, 3), kg·m²/s."""
        return quaternion.rotate(self.attitude, self._moments * self.omega)

    @cached_property
    def energy(self) -> Array:
        """Kinetic and potential energy, m g l cos θ included, (..., n), J."""
        w, x, y, z = np.moveaxis(self.attitude, -1, 0)
        return np.asarray(
            (self._moments * self.omega**2).sum(axis=-1) / 2 + self._mgl * (w * w + z * z - x * x - y * y)
        )

    @property
    def _seen(self) -> Seen:
        return Seen(self.top.inertia, free=False, top=True)

    def error_estimate(self, of: str = "attitude", moments: ArrayLike = 0.0) -> Array:
        """Return a bound of the rounding error of a quantity, the given data as exact.

        Parameters
        ----------
        of
            "attitude", as an angle (..., n), rad; "omega" or "momentum", (..., n, 3); "energy", (..., n).
        moments
            Bounds of the errors of the moments of inertia, (..., 3), kg·m², where they were worked out.
        """
        require(of, *STATE)
        bound = self._rounding(of)
        E, top = np.asarray(moments, dtype=float), self.top
        # each moment in turn is put off by its error
        for entry in ([1.0, 1.0, 0.0], [0.0, 0.0, 1.0]) if E.any() else ():
            I = _moments(top.inertia) + E * entry
            bound = bound + apart(Top(I, top.mgl, top.omega, top.attitude).at(self.time), self, of)
        return bound

    def _rounding(self, of: str) -> Array:
        """Bound what rounding does on the way from the given moments to the state."""
        rotation, lead = self.top._rotation, self.top._lead
        shape = lead + self.time.shape
        late, turned, runs = (v.reshape(shape) for v in rotation.phase_errors(np.atleast_1d(self.time)))
        late, turned, runs = EPS * late, FEW + EPS * turned, EPS * runs
        if of == "attitude":
            return turned
        I = np.broadcast_to(self._moments, self.omega.shape)
        w, x, y, z = np.moveaxis(self.attitude, -1, 0)
        mgl, omega = self._mgl, self.omega
        weight = np.stack([2 * mgl * (y * z + w * x), -2 * mgl * (x * z - w * y), 0 * x], axis=-1)
        torque = np.cross(I * omega, omega) + weight
        rise = np.divide(torque, I, out=np.zeros_like(torque), where=I > 0)
        # the swing is a sum of two terms with opposite signs, each as large as the fall from the vertical gives
        up, down = np.sqrt(w * w + z * z), np.sqrt(x * x + y * y)
        with np.errstate(divide="ignore", invalid="ignore"):
            terms = [
                np.abs(push.reshape(lead + (1,) * self.time.ndim)) * np.where(b > 0, a / b, 0.0)
                for push, a, b in ((rotation.plus, down, up), (rotation.minus, up, down))
            ]
        swing = np.minimum(terms[0] + terms[1], 1e300) / (2 * I[..., 0])
        level = quaternion.length(omega[..., :2])[..., 0]
        around = FEW * (level + swing) + runs * level
        bound = late[..., None] * quaternion.length(rise) + around[..., None]
        bound = np.concatenate([bound, np.zeros_like(bound), EPS * np.abs(omega[..., 2:])], axis=-1)
        bound[..., 1] = bound[..., 0]
        if of == "omega":
            return np.asarray(bound)
        kinetic = (I * omega**2).sum(axis=-1) / 2
        # it stays what it was however late the state is
        if of == "energy":
            return np.asarray(2 * FEW * (kinetic + np.abs(mgl)) + I[..., 0] * level * FEW * swing)
        size = quaternion.length(I * omega)[..., 0]
        error = turned * size + quaternion.length(I * bound)[..., 0]
        return np.asarray(error[..., None] + np.zeros(3))

    @property
    def _moments(self) -> Array:
        I = _moments(self.top.inertia)
        return I[..., None, :] if self.time.ndim else I

    @property
    def _mgl(self) -> Array:
        mgl = np.asarray(self.top.mgl, dtype=float)
        return mgl[..., None] if self.time.ndim and mgl.ndim else mgl


def _moments(inertia: ArrayLike) -> Array:
    """Return principal moments (..., 3) that are given as such or as a diagonal tensor."""
    I = np.asarray(inertia, dtype=float)
    return np.diagonal(I, axis1=-2, axis2=-1) if I.shape[-2:] == (3, 3) else I


class PhaseErrors(NamedTuple):
    """What rounding does to the phases of b tops at n times, (b, n) each, in units of ε."""

    late: Array
    """By how much the state may be late, s."""
    turned: Array
    """By how much the body may be turned, rad."""
    runs: Array
    """How far the angles have run that turn ω about the axis, rad."""


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
        rows = [
            constants(float(I[b, 0]), float(I[b, 2]), abs(float(mgl[b])), omega[b], q[b])
            for b in range(self.count)
        ]
        c = {name: np.array([[row[name]] for row in rows]) for name in rows[0]} if rows else {}
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
        a, b = q[:, :1] + 1j * q[:, 3:], q[:, 1:2] + 1j * q[:, 2:3]
        w1, w2 = omega[:, :1], omega[:, 1:2]
        # from sn and cn as given: near the vertical the phases turn too fast to be had from a rounded argument
        dn = np.sqrt(self.p.m1 + self.p.m * c["cn"] ** 2)
        at = Jacobi(np.zeros_like(dn), self.begin, c["sn"], c["cn"], dn)
        start = self._phases(at)
        half = 0.5j
        # where α or β is zero its direction is that of its rate, just before or just after as rounding has it
        before_a = np.where(at.sn < 0, -1.0, 1.0)
        before_b = np.where(at.r > 0, -1.0, 1.0)
        a_rate = -(q[:, 1:2] * w1 + q[:, 2:3] * w2) / 2 + half * (q[:, 1:2] * w2 - q[:, 2:3] * w1)
        b_rate = (a * (w1 + 1j * w2)) / 2
        self.a0 = np.where(np.abs(a) > 0, _unit(a), before_a * _unit(a_rate)) * np.exp(-1j * start[0])
        self.b0 = np.where(np.abs(b) > 0, _unit(b), before_b * _unit(b_rate)) * np.exp(-1j * start[1])
        self.q = q
        # no lever, or upright or hanging at rest but for its spin: q(t) = exp(P t) q0 exp(S t)
        self.simple = np.flatnonzero(c["still"][:, 0])
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

    def phase_errors(self, t: Array) -> PhaseErrors:
        """Bound what rounding does to the phases at times t."""
        way = np.abs(t)
        phases = (
            *self._phases(jacobi(self.begin + self.rate * t, self.p)),
            *self._phases(jacobi(self.begin, self.p)),
        )
        begin = 1 + np.abs(self.begin)
        late = 3 * begin / self.rate + 4 * way
        runs = sum(np.abs(x) for x in phases) + np.abs(self.extra) * way
        turned = begin + 4 * self.rate * way + 3 * runs
        if len(self.simple):
            spin, nod = (quaternion.length(x) for x in (self.spin, self.precession))
            late[self.simple] = 4 * way
            runs[self.simple] = (spin + nod) * way
            turned[self.simple] = 4 * (spin + nod) * way
        return PhaseErrors(late, turned, runs)

    def state_at(self, t: Array) -> Array:
        """Attitude and angular velocity at times t, (b, n, 7)."""
        out = np.empty((self.count, len(t), 7))
        at = jacobi(self.begin + self.rate * t, self.p)
        plus, minus = self._phases(at)
        turn = self.extra * t / 2
        # no square underflows
        sn = np.where(np.abs(at.sn) < 1e-150, 1e-150, at.sn)
        cn = np.where(np.abs(at.cn) < 1e-150, 1e-150, at.cn)
        across_a, across_b = np.sqrt(self.above / 2), np.sqrt(self.below / 2)
        swing_by = np.sqrt(self.span / 2)
        size_a, size_b = np.hypot(across_a, swing_by * sn), np.hypot(across_b, swing_by * cn)
        way_a, way_b = self.a0 * np.exp(1j * (plus + turn)), self.b0 * np.exp(1j * (minus - turn))
        a, b = size_a * way_a, size_b * way_b
        # θ̇ and φ̇ sin θ, each as the small over the small
        with np.errstate(divide="ignore", invalid="ignore"):
            tilt = -self.span * self.rate * sn * cn * at.dn / (size_a * size_b)
            swing = (self.plus * (size_b / size_a) + self.minus * (size_a / size_b)) / self.twice_I1
        across = np.conj(way_a) * way_b * (tilt + 1j * swing)
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


def _unit(z: Array | NDArray[np.complex128]) -> NDArray[np.complex128]:
    return np.asarray(np.exp(1j * np.angle(z)))
