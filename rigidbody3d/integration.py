"""Forced rotation: integration that keeps what nature keeps.

The state is the angular momentum in SPACE axes and a unit quaternion. Where no torque acts the momentum is then
constant by the equations themselves, and a constant torque in space is integrated exactly by every method; with
the momentum in body axes both would drift with the integrator's error. The step is scipy's DOP853; for a
symmetric top also a splitting into the exact free rotation and the exact kick of the weight, composed to
order six: a symplectic map, whose energy error does not grow with time.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record
from rigidbody3d import attitude as quaternion
from rigidbody3d.inertia import principal
from rigidbody3d.splitting import check_steps, split
from rigidbody3d.states import STATE, AtTimes, PictureData, State, require

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_arrays import DoubledArray

Array = NDArray[np.float64]
Torque = Callable[[float, Array, Array], ArrayLike]


@record
@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(AtTimes):
    """States at the requested times: `.omega` (n, 3) in body axes, `.attitude` (n, 4), `.momentum` (n, 3) in space axes."""

    time: Array
    momentum: Array
    attitude: Array
    tensor: Array
    mgl: float
    evaluations: int
    """The number of evaluations of the equations of motion (for the splitting: stages)."""
    finer: Callable[[ArrayLike], Trajectory] | None = field(default=None, compare=False)
    """The motion of a body of this inertia with steps half as long."""

    @cached_property
    def omega(self) -> Array:
        """Angular velocity in body axes, (n, 3), rad/s."""
        body = quaternion.rotate(quaternion.inverse(self.attitude), self.momentum)
        return np.asarray(np.linalg.solve(self.tensor, body[..., None])[..., 0])

    @cached_property
    def energy(self) -> Array:
        """Kinetic energy, with the potential energy of a top, (n,), J."""
        body = quaternion.rotate(quaternion.inverse(self.attitude), self.momentum)
        w, x, y, z = np.moveaxis(self.attitude, -1, 0)
        return np.asarray((body * self.omega).sum(axis=-1) / 2 + self.mgl * (w * w + z * z - x * x - y * y))

    @cached_property
    def _finer(self) -> Trajectory:
        return self._run_again(self.tensor)

    @property
    def _picture_data(self) -> PictureData:
        return PictureData(self.tensor, free=False, top=self.mgl != 0)

    def error_estimate(self, of: str = "attitude", exact: DoubledArray | None = None) -> Array:
        """Return an estimate of the error, of the method and of rounding together.

        Parameters
        ----------
        of
            "attitude", as an angle (n,), rad, or "quaternion", its components (n, 4); "omega" or "momentum", (n, 3);
            "energy", (n,).
        exact
            The tensor in doubled numbers, (3, 3), if it has more digits than floats: a second run.

        Notes
        -----
        The motion is integrated once more with each step halved, at twice the cost: the tolerance of a step says
        little about the drift of many turns. Rounding adds up as a random walk.

        Examples
        --------
        >>> run = integrate([1, 2, 3], [1.0, 0.1, 0.5], t=[10.0])
        >>> bool(1e-15 < run.error_estimate()[0] < 1e-9)
        True
        """
        require(of, *STATE)
        finer = self._finer
        walk = FEW * (1 + np.sqrt(self.evaluations))
        # of a method of the third order the finer run is off by an eighth of this one's error, of one of the sixth by 2 %, or
        # by rounding alone; twice the difference leaves room where the error does not yet follow that law
        bound = 2 * _apart(finer, self, of)
        if of == "energy":
            bound = bound + walk * (np.abs(self.energy) + abs(self.mgl))
        elif of in ("attitude", "quaternion"):
            bound = bound + walk
        else:
            here: Array = getattr(self, of)
            bound = bound + walk * quaternion.length(here)
        off = np.zeros((3, 3)) if exact is None else (exact - self.tensor).value
        if off.any():
            # by a visible multiple of the tensor's error; no moment becomes negative
            moments = principal(self.tensor).moments
            times = max(1.0, float(min(1e-7 * moments[2], 1e-3 * moments[0]) / np.abs(off).max()))
            bound = bound + _apart(self._run_again(self.tensor + times * off), finer, of) / times
        return np.asarray(bound)

    def _run_again(self, tensor: Array) -> Trajectory:
        if self.finer is None:
            raise ValueError("an estimate needs the finer run that `integrate` offers")
        return self.finer(tensor)


def _apart(there: State, here: State, of: str) -> Array:
    """Return how far two states are apart: an angle, the components of a vector, a difference."""
    if of == "attitude":
        return quaternion.angle_between(there.attitude, here.attitude)
    if of == "quaternion":
        return np.abs(quaternion.apart(there.attitude, here.attitude))
    apart: Array = np.abs(getattr(there, of) - getattr(here, of))
    return apart


FEW = 12 * EPS
"""The error of a dozen roundings."""
MOST = 10_000_000
"""The largest number of steps, which takes a quarter of an hour."""
METHODS = ("DOP853", "RK45", "RK23", "Radau", "splitting")
"""scipy's one-step methods, whose steps can be halved for an estimate, and the splitting."""


def integrate(
    inertia: ArrayLike,
    omega: ArrayLike,
    attitude: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    t: ArrayLike = 0.0,
    *,
    torque: ArrayLike | Torque | None = None,
    frame: str = "body",
    mgl: float = 0.0,
    method: str = "DOP853",
    rtol: float = 1e-13,
    steps_per_turn: float = 60,
    refine: int = 1,
    longest: float = math.inf,
    most: float = MOST,
    halved: Steps | None = None,
) -> Trajectory:
    """Integrate the rotation of a body under a torque from time zero to each time.

    Parameters
    ----------
    inertia
        Principal moments (3,) or tensor (3, 3), kg·m²: about the fixed point if `mgl` is given, else about the
        centre of mass.
    omega
        Angular velocity at time zero in body axes, (3,), rad/s.
    attitude
        Quaternion [w, x, y, z] at time zero, body to space, (4,).
    t
        Times, (n,), s, in any order, of either sign.
    torque
        A constant torque (3,), N·m, or a function of time, attitude and angular velocity; None: no torque.
    frame
        "body" or "space": the axes of `torque`.
    mgl
        Weight times the distance of the centre of mass from the fixed point along body z, N·m.
    method
        One of scipy's one-step methods (`METHODS`), or "splitting" for a symmetric top without further torque.
    rtol
        Relative tolerance of a scipy method.
    steps_per_turn
        Steps of the splitting per turn of the fastest motion.
    refine
        Each of these steps is cut into as many.
    longest
        No step of a scipy method is longer, s.
    most
        Steps that are not to be exceeded.
    halved
        The steps of another run: no step of a scipy method is longer than half of the one taken there.

    Returns
    -------
    Trajectory
        The states in the order of `t`, with the drift of momentum and energy.

    Raises
    ------
    ValueError
        More steps than `most` would be needed; a splitting of what is no symmetric top; another method or frame; an inertia
        that is not positive; numbers that are not finite, shapes that do not fit.
    RuntimeError
        The integrator gave up; with its reason.

    Examples
    --------
    >>> run = integrate([1, 2, 3], [1.0, 0.1, 0.5], t=[0.0, 10.0])
    >>> run.omega[1].round(6)
    array([ 0.559657, -0.834736, -0.145162])
    """
    moments = principal(inertia).moments
    if not (moments > 0).all():
        raise ValueError(f"integration needs positive principal moments, found {moments}")
    if frame not in ("body", "space"):
        raise ValueError(f"frame is 'body' or 'space', found '{frame}'")
    if method not in METHODS:
        raise ValueError(f"method is one of {', '.join(METHODS)}, found '{method}'")
    I = np.asarray(inertia, dtype=float)
    tensor = np.diag(I) if I.ndim == 1 else I
    time = np.atleast_1d(np.asarray(t, dtype=float))
    w0, q0 = np.asarray(omega, dtype=float), quaternion.normalize(attitude)
    constant = np.zeros(3) if torque is None or callable(torque) else np.asarray(torque, dtype=float)
    shapes = {
        "inertia": (tensor, (3, 3)),
        "omega": (w0, (3,)),
        "attitude": (q0, (4,)),
        "torque": (constant, (3,)),
    }
    for name, (value, shape) in shapes.items():
        if value.shape != shape:
            raise ValueError(f"{name}: expected one body, the shape {shape}, found {value.shape}")
    if not all(np.isfinite(value).all() for value in (w0, constant, time, mgl)):
        raise ValueError("omega, torque, times and mgl must be finite")
    H0 = quaternion.rotate(q0, tensor @ w0)
    # the finer repetition of an estimate may take as many more steps as it is finer
    again = partial(
        integrate,
        omega=omega,
        attitude=attitude,
        t=t,
        torque=torque,
        frame=frame,
        mgl=mgl,
        method=method,
        most=4 * most,
    )
    if method == "splitting":
        if (
            callable(torque)
            or constant.any()
            or not (tensor == np.diag(np.diag(tensor))).all()
            or tensor[0, 0] != tensor[1, 1]
        ):
            raise ValueError("the splitting is for a symmetric top, its axis body z, under its weight alone")
        H, q, count = split(tensor[0, 0], tensor[2, 2], mgl, H0, q0, time, steps_per_turn, refine, most)
        finer = partial(again, steps_per_turn=steps_per_turn, refine=2 * refine)
        return Trajectory(time, H, q, tensor, mgl, count, finer)
    load = torque if callable(torque) else constant
    limits = _Limits(rtol, longest, most, halved)
    H, q, count, taken = _solve(tensor, w0, H0, q0, time, load, frame, mgl, method, limits)
    finer = partial(again, halved=taken, rtol=rtol / 256)
    return Trajectory(time, H, q, tensor, mgl, count, finer)


class Steps:
    """The steps of an integration, forwards and backwards: where they begin and how long they are, s."""

    def __init__(self) -> None:
        self.starts: dict[float, list[float]] = {1.0: [], -1.0: []}
        self.sizes: dict[float, list[float]] = {1.0: [], -1.0: []}

    def add(self, sign: float, start: float, size: float) -> None:
        """Add a step in the direction of the sign."""
        self.starts[sign].append(abs(start))
        self.sizes[sign].append(size)

    def half(self, sign: float, t: float) -> float:
        """Return half of the step that was taken at a time."""
        return self.sizes[sign][max(bisect_right(self.starts[sign], abs(t)) - 1, 0)] / 2


class _Limits(NamedTuple):
    """The limits of the steps of an integration: see `integrate`."""

    rtol: float
    longest: float
    most: float
    halved: Steps | None


def _solve(
    tensor: Array,
    omega: Array,
    H0: Array,
    q0: Array,
    time: Array,
    torque: Array | Torque,
    frame: str,
    mgl: float,
    method: str,
    limits: _Limits,
) -> tuple[Array, Array, int, Steps]:
    import scipy.integrate

    rtol, longest, most, halved = limits

    (a, b, c), (d, e, f), (g, h, i) = np.linalg.inv(tensor).tolist()
    function = torque if callable(torque) else None
    fixed = np.zeros(3) if callable(torque) else torque
    tx, ty, tz = fixed.tolist()
    # measured by the momentum itself, so that one tolerance serves a watch and a ship
    reach = float(np.abs(time).max(initial=0.0))
    size = max(
        float(np.linalg.norm(H0)), float(np.linalg.norm(fixed)) * reach, math.sqrt(abs(mgl) * tensor.trace())
    )
    size = size or 1.0

    def rates(s: float, y: Array) -> list[float]:
        X, Y, Z, w, x, y_, z = y.tolist()
        n = 1 / (w * w + x * x + y_ * y_ + z * z)
        k = size * n
        # the columns of the turn: space components to body components
        l = k * ((w * w + x * x - y_ * y_ - z * z) * X + 2 * ((x * y_ + w * z) * Y + (x * z - w * y_) * Z))
        m = k * ((w * w - x * x + y_ * y_ - z * z) * Y + 2 * ((x * y_ - w * z) * X + (y_ * z + w * x) * Z))
        o = k * ((w * w - x * x - y_ * y_ + z * z) * Z + 2 * ((x * z + w * y_) * X + (y_ * z - w * x) * Y))
        p, q, r = a * l + b * m + c * o, d * l + e * m + f * o, g * l + h * m + i * o
        u, v, t = tx, ty, tz
        if function is not None:
            q_now = np.array([w, x, y_, z]) * math.sqrt(n)
            u, v, t = np.asarray(function(s, q_now, np.array([p, q, r])), dtype=float).tolist()
        if frame == "body" and (u or v or t):
            u, v, t = (
                n
                * ((w * w + x * x - y_ * y_ - z * z) * u + 2 * ((x * y_ - w * z) * v + (x * z + w * y_) * t)),
                n
                * ((w * w - x * x + y_ * y_ - z * z) * v + 2 * ((x * y_ + w * z) * u + (y_ * z - w * x) * t)),
                n
                * ((w * w - x * x - y_ * y_ + z * z) * t + 2 * ((x * z - w * y_) * u + (y_ * z + w * x) * v)),
            )
        if mgl:
            u, v = u - mgl * n * 2 * (y_ * z - w * x), v + mgl * n * 2 * (x * z + w * y_)
        return [
            u / size,
            v / size,
            t / size,
            (-x * p - y_ * q - z * r) / 2,
            (w * p + y_ * r - z * q) / 2,
            (w * q - x * r + z * p) / 2,
            (w * r + x * q - y_ * p) / 2,
        ]

    out = np.empty((len(time), 7))
    start = np.concatenate([H0 / size, q0])
    count = steps = 0
    taken = Steps()
    for sign in (1.0, -1.0):
        side = np.flatnonzero(time * sign > 0)
        order = side[np.argsort(np.abs(time[side]), kind="stable")]
        if not len(order):
            continue
        method_class = getattr(scipy.integrate, method)
        # The error estimate of a step says little about the drift of many turns: at the finest tolerance
        # never less than 40 steps a turn, at a coarser one as many fewer as order eight allows.
        rate = max(float(np.linalg.norm(omega)), math.sqrt(abs(mgl) / tensor.diagonal().min()))
        if rate:
            longest = min(longest, 2 * math.pi / rate / 40 * (max(rtol, 1e-13) / 1e-13) ** 0.125)
        check_steps(float(np.abs(time[order]).max()) / longest, most)
        first = longest if halved is None else min(longest, halved.half(sign, 0.0))
        tolerances = {"rtol": max(rtol, 3e-14), "atol": rtol}
        solver = method_class(rates, 0.0, start, sign * np.inf, max_step=first, **tolerances)
        before = (0.0, start)
        for index in order:
            stop = float(time[index])
            while abs(solver.t) < abs(stop):
                before = (solver.t, solver.y)
                if halved is not None:
                    solver.max_step = min(longest, halved.half(sign, solver.t))
                message = solver.step()
                steps += 1
                taken.add(sign, before[0], abs(solver.t - before[0]))
                if steps > most:
                    raise RuntimeError(f"the integration stopped at {solver.t:g} s, after {most:.0e} steps")
                if solver.status == "failed":
                    raise RuntimeError(f"the integration stopped at {solver.t:g} s: {message}")
            # a shorter step from the last station: the interpolant of the step taken is some digits worse
            last = method_class(
                rates, *before, stop, first_step=abs(stop - before[0]) or None, rtol=1e-3, atol=1e9
            )
            if stop != before[0]:
                last.step()
            out[index] = last.y
            count += last.nfev
        count += solver.nfev
    out[time == 0] = start
    return out[:, :3] * size, quaternion.normalize(out[:, 3:]), count, taken
