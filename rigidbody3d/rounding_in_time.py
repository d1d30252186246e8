"""Bounds of the rounding errors of rotations in time: free bodies and heavy tops in closed form, integrated ones.

A closed form is wrong in two ways. Its phase u0 + λt is a large number and rounded as one: that is an error of the
time, (1 + |u0|)/λ + t times ε, and moves the state along its own path. The angles that run on, of the node and of
the spin, are large numbers too: they turn the body about the momentum or about its axis by ε times their size. All
else is rounded a few times and keeps its last digits.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigidbody3d import attitude as quaternion
from rigidbody3d.inertia import principal
from rigidbody3d.rounding import EPS

if TYPE_CHECKING:
    from rigidbody3d.freebody import FreeBody, FreeState
    from rigidbody3d.spin import Trajectory
    from rigidbody3d.top import TopState


Array = NDArray[np.float64]

FEW = 12 * EPS
"""What a dozen roundings leave."""


def _wrong(of: str, *known: str) -> ValueError:
    return ValueError(f"no estimate for '{of}': expected one of {', '.join(known)}")


# --- free bodies ---


def free(state: FreeState, of: str, tensor: ArrayLike) -> Array:
    """Bound attitude (..., n), omega or momentum (..., n, 3), or energy (..., n) of a free body."""
    if of not in ("attitude", "omega", "momentum", "energy"):
        raise _wrong(of, "attitude", "omega", "momentum", "energy")
    body = state.body
    motion, lead = body._motion, body._lead
    t = np.atleast_1d(state.time)
    count = motion.count
    late = np.zeros((count, len(t)))  # how late the state may be
    angle = np.zeros((count, len(t)))  # by how much it may be turned
    across = np.zeros((count, 1, 3))  # what turns about a body of revolution's axis
    way = np.abs(t)
    if len(motion._simple):
        spin, nod = (np.sqrt(np.square(x).sum(axis=-1))[:, None] for x in (motion._spin, motion._precession))
        late[motion._simple] = 4 * way
        angle[motion._simple] = 4 * (spin + nod) * way
        own = np.where(motion._spin != 0, 0.0, motion.omega[motion._simple])
        across[motion._simple, 0] = np.where(
            motion._spin != 0, 0.0, np.sqrt(np.square(own).sum(axis=-1, keepdims=True))
        )
    if len(motion._general):
        begin = 1 + np.abs(motion._u0)
        late[motion._general] = 3 * begin / motion._rate + 4 * way
        node = np.abs(motion._node(motion._jacobi(t))) + np.abs(motion._node(motion._jacobi(np.zeros(1))))
        angle[motion._general] = begin + 4 * (np.abs(motion._drift) + motion._rate) * way + 3 * node
    shape = (*lead, len(t)) if state.time.ndim else lead
    turned = (FEW + EPS * angle).reshape(shape)
    if of == "attitude":
        found = turned
    elif of == "omega":
        axes = np.broadcast_to(principal(body.inertia).axes, (*lead, 3, 3)).reshape(count, 3, 3)
        w = state.omega.reshape(count, len(t), 3) @ np.swapaxes(axes, -1, -2)
        I = motion.moments[:, None, :]
        torque = np.cross(I * w, w)
        rise = np.divide(torque, I, out=np.zeros_like(torque), where=I > 0)
        bound = EPS * late[..., None] * np.abs(rise) + FEW * (np.abs(w) + across)
        found = (bound @ np.abs(axes)).reshape(*shape, 3)
    else:
        # both stay what they were however late the state is
        size = FEW * 3 * np.abs(body.energy)
        if of == "momentum":
            size = FEW * 3 * np.sqrt(np.square(body.momentum).sum(axis=-1))
        found = np.zeros(shape) + (size[..., None] if state.time.ndim else size)
        found = found[..., None] + np.zeros(3) if of == "momentum" else found
    return np.asarray(found + _of_tensor(state, of, tensor))


def _of_tensor(state: FreeState, of: str, tensor: ArrayLike) -> Array | float:
    """What errors of the tensor's entries do: those given, and those of working out principal axes.

    Each entry in turn is put off by its error, and the change of the answer is counted.
    """
    from rigidbody3d.freebody import FreeBody

    body = state.body
    total: Array | float = 0.0
    for other in _perturbed(body.inertia, tensor):
        total = total + _change(FreeBody(other, body.omega, body.attitude).at(state.time), state, of)
    return total


class _State(Protocol):
    """A state in time, of whatever kind."""

    @property
    def attitude(self) -> Array: ...


def _change(there: _State, here: _State, of: str) -> Array:
    """How far two states are apart: an angle, the size of a vector (..., 1), a difference."""
    if of == "attitude":
        return quaternion.angle_between(there.attitude, here.attitude)
    off = np.abs(getattr(there, of) - getattr(here, of))
    return np.asarray(off if of == "energy" else np.sqrt(np.square(off).sum(axis=-1, keepdims=True)))


def _perturbed(inertia: ArrayLike, tensor: ArrayLike, axes: bool = True) -> list[Array]:
    """The tensors with one entry off each; none where the tensor is exact and, if axes are sought, diagonal."""
    I = np.asarray(inertia, dtype=float)
    E = np.asarray(tensor, dtype=float)
    if I.ndim == 1 or I.shape[-2:] != (3, 3):
        if not E.any():
            return []
        I = I[..., None, :] * np.eye(3)
    E = np.broadcast_to(E, I.shape)
    if axes:
        oblique = (I * np.eye(3) != I).any(axis=(-1, -2), keepdims=True)
        E = E + np.where(oblique, 4 * EPS * np.abs(I).max(axis=(-1, -2), keepdims=True), 0.0)
    if not E.any():
        return []
    # a moment of zero, of a thin rod, shall not become negative
    rod = np.where(principal(I).moments[..., :1, None] <= 8 * E.max(), 4.0, 0.0) * E.max() * np.eye(3)
    found = []
    for i in range(3):
        for j in range(i, 3):
            entry = np.zeros((3, 3))
            entry[i, j] = entry[j, i] = 1.0
            found.append(I + rod + E * entry)
    return found


def free_body(body: FreeBody, of: str, tensor: ArrayLike) -> Array:
    """Bound the period (...), the energy (...) or the momentum (..., 3) of a free body."""
    from rigidbody3d.freebody import FreeBody

    if of not in ("period", "momentum", "energy"):
        raise _wrong(of, "period", "momentum", "energy")
    here = getattr(body, of)
    size = np.sqrt(np.square(here).sum(axis=-1, keepdims=True)) if of == "momentum" else np.abs(here)
    total = FEW * np.where(np.isfinite(size), size, 0.0)
    for other in _perturbed(body.inertia, tensor):
        there = getattr(FreeBody(other, body.omega, body.attitude), of)
        with np.errstate(invalid="ignore"):
            change = np.where(there == here, 0.0, np.abs(there - here))
        total = total + (change.max(axis=-1, keepdims=True) if of == "momentum" else change)
    return np.asarray(total + np.zeros(np.shape(here)))


# --- tops ---


def top(state: TopState, of: str, moments: ArrayLike) -> Array:
    """Bound attitude (..., n), omega or momentum (..., n, 3), or energy (..., n) of a heavy top.

    `moments` bounds the errors of the moments of inertia, (..., 3): each in turn is put off by as much.
    """
    from rigidbody3d.top import Top

    bound = _top(state, of)
    E, given = np.asarray(moments, dtype=float), state.top
    for entry in ([1.0, 1.0, 0.0], [0.0, 0.0, 1.0]) if E.any() else ():
        I = np.asarray(given.inertia, dtype=float)
        I = np.diagonal(I, axis1=-2, axis2=-1) if I.shape[-2:] == (3, 3) else I
        other = Top(I + E * entry, given.mgl, given.omega, given.attitude).at(state.time)
        bound = bound + _change(other, state, of)
    return np.asarray(bound)


def _top(state: TopState, of: str) -> Array:
    from rigidbody3d.elliptic import jacobi

    if of not in ("attitude", "omega", "momentum", "energy"):
        raise _wrong(of, "attitude", "omega", "momentum", "energy")
    motion, lead = state.top._motion, state.top._lead
    t = np.atleast_1d(state.time)
    way = np.abs(t)
    at = jacobi(motion.begin + motion.rate * t, motion.p)
    plus, minus = motion._phases(at)
    start = motion._phases(jacobi(motion.begin, motion.p))
    begin = 1 + np.abs(motion.begin)
    late = 3 * begin / motion.rate + 4 * way
    runs = sum(np.abs(x) for x in (plus, minus, *start)) + np.abs(motion.extra) * way
    angle = begin + 4 * motion.rate * way + 3 * runs
    if len(motion.simple):
        spin, nod = (np.sqrt(np.square(x).sum(axis=-1))[:, None] for x in (motion.spin, motion.precession))
        late[motion.simple] = 4 * way
        runs[motion.simple] = (spin + nod) * way
        angle[motion.simple] = 4 * (spin + nod) * way
    I = np.broadcast_to(state._moments, state.omega.shape)
    w, x, y, z = np.moveaxis(state.attitude, -1, 0)
    mgl = np.asarray(state.top.mgl, dtype=float)
    mgl = mgl[..., None] if state.time.ndim and mgl.ndim else mgl
    shape = (*lead, len(t)) if state.time.ndim else lead
    late, turned, runs = (v.reshape(shape) for v in (EPS * late, FEW + EPS * angle, EPS * runs))
    if of == "attitude":
        return turned
    omega = state.omega
    weight = np.stack([2 * mgl * (y * z + w * x), -2 * mgl * (x * z - w * y), 0 * x], axis=-1)
    torque = np.cross(I * omega, omega) + weight
    rise = np.divide(torque, I, out=np.zeros_like(torque), where=I > 0)
    # the swing is a sum of two terms with opposite signs, each as large as the fall from the vertical gives
    up, down = np.sqrt(w * w + z * z), np.sqrt(x * x + y * y)
    with np.errstate(divide="ignore", invalid="ignore"):
        terms = [
            np.abs(push.reshape(lead + (1,) * bool(state.time.ndim))) * np.where(b > 0, a / b, 0.0)
            for push, a, b in ((motion.plus, down, up), (motion.minus, up, down))
        ]
    swing = np.minimum(terms[0] + terms[1], 1e300) / (2 * I[..., 0])
    level = np.sqrt(np.square(omega[..., :2]).sum(axis=-1))
    around = FEW * (level + swing) + runs * level
    bound = late[..., None] * np.sqrt(np.square(rise).sum(axis=-1, keepdims=True)) + around[..., None]
    bound = np.concatenate([bound, np.zeros_like(bound), EPS * np.abs(omega[..., 2:])], axis=-1)
    bound[..., 1] = bound[..., 0]
    if of == "omega":
        return np.asarray(bound)
    kinetic = (I * omega**2).sum(axis=-1) / 2
    if of == "energy":  # it stays what it was however late the state is
        return np.asarray(2 * FEW * (kinetic + np.abs(mgl)) + I[..., 0] * level * FEW * swing)
    size = np.sqrt(np.square(I * omega).sum(axis=-1))
    error = turned * size + np.sqrt(np.square(I * bound).sum(axis=-1))
    return np.asarray(error[..., None] + np.zeros(3))


# --- integration ---


def integrated(run: Trajectory, finer: Trajectory, of: str, tensor: ArrayLike) -> Array:
    """Bound an integrated rotation by another one with twice as many steps.

    Both methods are at least of the sixth order: the finer run is off by some 2 % of the coarser one's error, or by
    rounding alone. Twice their difference leaves room where the error does not yet follow that law. Rounding adds
    up as a random walk. Errors of the tensor's entries are counted by putting off each in turn.
    """
    if of not in ("attitude", "omega", "momentum", "energy"):
        raise _wrong(of, "attitude", "omega", "momentum", "energy")
    walk = FEW * (1 + np.sqrt(run.evaluations))
    here: Any = getattr(run, of)
    bound = 2 * _change(finer, run, of)
    if of == "attitude":
        bound = bound + walk
    elif of == "energy":
        bound = bound + walk * (np.abs(here) + abs(run.mgl))
    else:
        bound = bound + walk * np.sqrt(np.square(here).sum(axis=-1, keepdims=True)) + 0 * here
    again = run.finer
    if isinstance(again, partial):
        for other in _perturbed(again.args[0], tensor, axes=False):
            bound = bound + _change(again.func(other, *again.args[1:], **again.keywords), finer, of)
    return np.asarray(bound)
