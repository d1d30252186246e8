"""Torque-free rotation in closed form: angular velocity and attitude at any time, without stepping.

With the body's angular momentum H in principal axes, I1 ≤ I2 ≤ I3, and a = 1/I, Euler's equations read
Ḣ1 = -(a2-a3) H2 H3, Ḣ2 = (a1-a3) H3 H1, Ḣ3 = -(a1-a2) H1 H2. They keep the same form when 1 and 3 change
places, so that both kinds of motion, around the axis of the largest and of the smallest moment, are

    Hx = Ax cn u,   Hy = Ay sn u,   Hz = Az dn u,   u = λt + u0,

where z is the axis that H circles, y the middle one (Landau and Lifshitz, Mechanics, §37). The attitude
follows from Euler's angles about H with the body's axis of LEAST moment as the polar axis: the node's rate,

    φ̇ = |H| (a2 H2² + a3 H3²)/(H2² + H3²) = |H| a3 + |H| (a2-a3) H2²/(H2² + H3²),

lies between |H|a3 and |H|a2, which are never far apart (I3 ≤ 2 I2), and is a sum of positive terms: nothing
cancels on either side of the separatrix, nor for nearly symmetric bodies. Its integral is one R_J of Carlson.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dalembert.arithmetic.doubled import Doubled
from dalembert.arithmetic.shapes import as_array, filled, is_doubled
from rigidbody3d import attitude as quaternion
from rigidbody3d.elliptic import Jacobi, argument, jacobi, parameter, third, third_complete

Array = NDArray[np.float64]


class FreeRotation:
    """The motion of b bodies: what is constant in it, in principal axes I1 ≤ I2 ≤ I3, and the state at any time."""

    def __init__(self, moments: Array, axes: Array, omega: Array, q: Array) -> None:
        self.moments, self.axes, self.omega, self.count = moments, axes, omega, len(moments)
        H = moments * omega
        # the square of what is 1e-100 of the rest may vanish; it would have to grow by e^230 before it mattered
        H = np.where(np.abs(H) < 1e-100 * np.abs(H).max(axis=-1, keepdims=True), 0.0, H)
        # principal axes to space
        self.to_axes = quaternion.from_matrix(np.swapaxes(axes, -1, -2))
        start = quaternion.compose(q, self.to_axes)
        self.momentum = quaternion.rotate(start, moments * omega)
        self.simple = (
            (moments[:, 0] == moments[:, 1]) | (moments[:, 1] == moments[:, 2]) | ((H != 0).sum(axis=-1) < 2)
        )
        self.period = filled((self.count,), np.inf, moments)
        self.m1 = filled((self.count,), 1.0, moments)
        self._start, self._q = start, q
        self._prepare_simple(np.flatnonzero(self.simple), H)
        self._prepare_general(np.flatnonzero(~self.simple), H)

    # --- bodies with two equal moments, and permanent rotation about a principal axis ---

    def _prepare_simple(self, bodies: NDArray[np.int64], H: Array) -> None:
        """q(t) = exp(P t) q0 exp(S t): precession P fixed in space, spin S fixed in the body."""
        moments, omega = self.moments[bodies], self.omega[bodies]
        I1, I2, I3 = moments.T
        single = ((H[bodies] != 0).sum(axis=-1) < 2) & (I1 > 0)
        prolate = (I2 == I3) & (I1 != I2)
        pole = np.where(prolate, 0, 2)
        across = np.where(prolate, I3, I1)
        along = np.where(prolate, I1, I3)
        rows = np.arange(len(bodies))
        spin = np.zeros_like(omega)
        # (across - along)/across: exactly what the difference of the given moments says
        spin[rows, pole] = omega[rows, pole] * (across - along) / across
        spin = np.where(single[:, None], omega, spin)
        precession = np.where(single[:, None], 0.0, self.momentum[bodies] / across[:, None])
        self._simple = bodies
        self._spin, self._precession = spin, precession
        rate = np.abs(spin).sum(axis=-1)
        still = single | (rate == 0) | ((omega != 0).sum(axis=-1) < 2)
        with np.errstate(divide="ignore", over="ignore"):
            self.period[bodies] = np.where(still, np.inf, 2 * np.pi / rate)

    # --- everything else ---

    def _prepare_general(self, bodies: NDArray[np.int64], H: Array) -> None:
        self._general = bodies
        # elliptic functions are imported for those that need them alone
        if not len(bodies):
            return
        I1, I2, I3 = (self.moments[bodies][:, i : i + 1] for i in range(3))
        H1, H2, H3 = (H[bodies][:, i : i + 1] for i in range(3))
        # measured by a power of two near |ω|: exact, and no square underflows
        scale = np.exp2(np.frexp(np.abs(self.omega[bodies]).max(axis=-1, keepdims=True))[1].astype(float) - 1)
        H1, H2, H3 = H1 / scale, H2 / scale, H3 / scale
        w1, w2, w3 = (
            np.where(h == 0, 0.0, self.omega[bodies][:, i : i + 1] / scale)
            for i, h in enumerate((H1, H2, H3))
        )
        d12, d23, d13 = (I2 - I1) / (I1 * I2), (I3 - I2) / (I2 * I3), (I3 - I1) / (I1 * I3)
        # 2E - |H|²/I3 and |H|²/I1 - 2E, as sums; and their weighted difference, whose sign gives the circled axis
        c3 = (I1 * (I3 - I1) * w1**2 + I2 * (I3 - I2) * w2**2) / I3
        c1 = (I3 * (I3 - I1) * w3**2 + I2 * (I2 - I1) * w2**2) / I1
        # on the separatrix it is all cancellation
        apart = _apart(I1, I2, I3, w1, w3) / I2
        # circles the axis of the largest moment
        self._large = apart <= 0
        big = np.where(self._large, d23 * c1, d12 * c3)
        small = np.where(self._large, d12 * c3, d23 * c1)
        self._rate = np.sqrt(big)
        self._p = parameter(small / big, np.minimum(d13 * np.abs(apart) / big, 1.0))
        cz, cx = np.where(self._large, c3, c1), np.where(self._large, c1, c3)
        dyz = np.where(self._large, d23, d12)
        hx, hz = np.where(self._large, H1, H3), np.where(self._large, H3, H1)
        sign = np.where(hz < 0, -1.0, 1.0)
        # on the separatrix itself Hx keeps its sign too
        other = np.where((hx < 0) & np.isinf(self._p.quarter), -1.0, 1.0)
        self._ax, self._az = other * np.sqrt(cz / d13), sign * np.sqrt(cx / d13)
        self._ay = other * sign * np.sqrt(cz / dyz)
        self._sign = sign
        cn, sn = hx / self._ax, H2 / self._ay
        size = np.hypot(cn, sn)
        self._u0 = argument(sn / size, cn / size, self._p)
        self._I, self._scale = np.concatenate([I1, I2, I3], axis=1), scale
        self.m1[bodies] = self._p.m1[:, 0]
        # the node's angle: |H| a3 t + weight·third(u), third with parameter n; where n is large it is |H| a1 t less
        # an arctangent and a smooth rest, since n sn²/(1 + n sn²) is then all but constant (see _node)
        total = np.sqrt(H1**2 + H2**2 + H3**2)
        self._total = total
        n = np.where(self._large, c3 / c1, d23 / np.where(d12 > 0, d12, 1.0))
        self._sharp = n > 1
        self._drift = total / np.where(self._sharp, I1, I3)
        whole = total * d13 / self._rate
        self._n = np.where(self._sharp, self._p.m / n, n)
        self._weight = np.where(self._sharp, -whole, whole) * self._n
        self._steep = np.sqrt((1 + n) * (1 + self._p.m / n))
        self._arc = np.where(self._sharp, -whole / self._steep, 0.0)
        self._drift, self._rate = self._drift * scale, self._rate * scale
        with np.errstate(over="ignore"):
            self.period[bodies] = (4 * self._p.quarter / self._rate)[:, 0]

    @cached_property
    def _third_quarter(self) -> Array:
        return third_complete(self._p, self._n)

    @cached_property
    def _attitude_start(self) -> tuple[Array, Array]:
        """The node's integral at time zero, and the 4 × 4 matrix from Euler's quaternion to the attitude."""
        at, bodies = self._jacobi(np.zeros(1)), self._general
        frame = _cyclic(len(bodies))
        before = quaternion.compose(self._euler(at, np.zeros(1))[:, 0], frame)
        left = quaternion.compose(self._start[bodies], quaternion.inverse(before))
        right = quaternion.compose(frame, quaternion.inverse(self.to_axes[bodies]))
        return self._node(at), quaternion.left_matrix(left) @ quaternion.right_matrix(right)

    def _jacobi(self, t: Array) -> Jacobi:
        return jacobi(self._u0 + self._rate * t, self._p)

    def _node(self, at: Jacobi) -> Array:
        """The periodic part of the node's angle and its mean, but for |H| a3 t or |H| a1 t.

        Where n > 1, ∫ du/(1 + n sn²) = arctan(g sn/(cn dn))/g + (m/n) ∫ sn²/(1 + (m/n) sn²) du with g² =
        (1 + n)(1 + m/n): DLMF 19.7.8. Its arctangent and that of Euler's third angle cancel as angles, not as
        large numbers, where the momentum passes near the first axis.
        """
        turns = np.where(np.isinf(self._p.quarter), 0.0, at.turns)
        smooth = 2 * turns * self._third_quarter + third(at, self._p, self._n)
        angle = np.arctan2(self._steep * at.sn, at.cn * at.dn) + np.pi * turns
        node: Array = self._weight * smooth + self._arc * angle
        return node

    def _momentum(self, at: Jacobi) -> tuple[Array, Array, Array]:
        """H1, H2, H3 in principal axes, without the sign (-1)ⁿ of the half turns for the two that have it."""
        x, y, z = self._ax * at.cn, self._ay * at.sn, self._az * at.dn
        return np.where(self._large, x, z), y, np.where(self._large, z, x)

    def _euler(self, at: Jacobi, node: Array) -> Array:
        """The quaternion of Euler's angles (node, tilt, spin) about H and the first principal axis."""
        h1, h2, h3 = (h / self._total for h in self._momentum(at))
        flip = np.where(at.turns % 2 != 0, -1.0, 1.0)
        # around the largest moment H3 keeps its sign; around the smallest the spin angle runs on
        side = np.where(self._large & (self._sign < 0), -1.0, 1.0)
        h2 = np.where(self._large, flip * h2, h2)
        h1 = np.where(self._large, flip * h1, h1)
        # half turns by quarters of their half angle, exact however many there have been
        turned = np.where(self._large, np.where(side < 0, 1.0, 0.0), np.fmod(self._sign * at.turns, 4.0))
        half = (np.arctan2(side * h2, side * h3) + np.pi * turned) / 2
        across = np.hypot(h2, h3)
        larger = np.sqrt((1 + np.abs(h1)) / 2)
        smaller = across / (2 * larger)
        c, s = np.where(h1 >= 0, larger, smaller), np.where(h1 >= 0, smaller, larger)
        # the two angles apart: the momentum's direction then does not feel the rounding of a large node
        cn, sn, cs, ss = np.cos(node / 2), np.sin(node / 2), np.cos(half), np.sin(half)
        return np.stack(
            [
                c * (cn * cs - sn * ss),
                s * (cn * cs + sn * ss),
                s * (sn * cs - cn * ss),
                c * (sn * cs + cn * ss),
            ],
            axis=-1,
        )

    def attitude_at(self, t: Array) -> Array:
        """Quaternions (b, n, 4)."""
        out = filled((self.count, len(t), 4), 0.0, self.omega)
        if len(self._simple):
            turn = quaternion.from_vector(self._precession[:, None, :] * t[:, None])
            spin = quaternion.from_vector(self._spin[:, None, :] * t[:, None])
            first = quaternion.compose(turn, self._start[self._simple][:, None, :])
            back = quaternion.inverse(self.to_axes[self._simple])[:, None, :]
            out[self._simple] = quaternion.compose(quaternion.compose(first, spin), back)
        if len(self._general):
            node0, both = self._attitude_start
            at = self._jacobi(t)
            euler = self._euler(at, self._drift * t + (self._node(at) - node0))
            out[self._general] = euler @ np.swapaxes(both, -1, -2)
        return out

    def omega_at(self, t: Array) -> Array:
        """Angular velocity in the given body axes (b, n, 3)."""
        spin = filled((self.count, len(t), 3), 0.0, self.omega)
        if len(self._simple):
            turn = quaternion.from_vector(-self._spin[:, None, :] * t[:, None])
            spin[self._simple] = quaternion.rotate(turn, self.omega[self._simple][:, None, :])
        if len(self._general):
            at = self._jacobi(t)
            flip = np.where(at.turns % 2 != 0, -1.0, 1.0)
            h1, h2, h3 = self._momentum(at)
            h1, h2, h3 = np.where(self._large, flip * h1, h1), flip * h2, np.where(self._large, h3, flip * h3)
            spin[self._general] = np.stack([h1, h2, h3], axis=-1) / self._I[:, None, :] * self._scale[:, None]
        return spin @ self.axes


def _apart(I1: Array, I2: Array, I3: Array, w1: Array, w3: Array) -> Array:
    """I1 (I2 - I1) w1² - I3 (I3 - I2) w3², whose terms all but cancel near the separatrix."""
    exact: Any = (I1, I2, I3, w1, w3)
    if is_doubled(I1):
        from dalembert.arithmetic.doubled_fractions import by_fractions

        doubled: Any = by_fractions(_difference, *exact)
        return as_array(doubled)
    result = _difference(*map(Doubled, exact))
    return np.asarray(result.value)


def _difference(I1: Any, I2: Any, I3: Any, w1: Any, w3: Any) -> Any:
    return (I2 - I1) * I1 * (w1 * w1) - (I3 - I2) * I3 * (w3 * w3)


def _cyclic(count: int) -> Array:
    """The turn that brings the first axis to the third place: e1 -> Z, e2 -> X, e3 -> Y."""
    return np.broadcast_to([0.5, -0.5, -0.5, -0.5], (count, 4))
