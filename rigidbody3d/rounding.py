"""Bounds of rounding errors: a formula worked out once more on numbers that carry their own error.

Each operation passes on what the errors of its operands become and adds half an ε of its own result: the running
error analysis of J. H. Wilkinson (N. J. Higham, Accuracy and Stability of Numerical Algorithms, §3.3). It follows
cancellation where it happens. None of it is computed unless an estimate is asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from rigidbody3d.inertia import Body
    from rigidbody3d.momentum import Motion
    from rigidbody3d.shaft import Shaft

Array = NDArray[np.float64]

EPS = float(np.finfo(float).eps)
UNIT = EPS / 2


class Bounded(NDArrayOperatorsMixin):
    """Numbers (...) and bounds of their errors (...); numpy's functions of them are such numbers again.

    Examples
    --------
    >>> x = Bounded(1.0) / 3.0
    >>> bool(x.error == UNIT / 3)
    True
    >>> bool((x - 1 / 3).error > UNIT / 4)  # what is left of a difference is all error
    True
    """

    def __init__(self, value: ArrayLike, error: ArrayLike = 0.0) -> None:
        self.value = np.asarray(value, dtype=float)
        self.error = np.broadcast_to(np.asarray(error, dtype=float), self.value.shape)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **_: Any) -> Any:
        if method != "__call__" or ufunc not in _SPREAD:
            return NotImplemented
        given = [x if isinstance(x, Bounded) else Bounded(x) for x in inputs]
        with np.errstate(all="ignore"):
            value = ufunc(*(x.value for x in given))
            return Bounded(value, _SPREAD[ufunc](value, *given) + UNIT * np.abs(value))

    def __getitem__(self, index: Any) -> Bounded:
        return Bounded(self.value[index], self.error[index])

    def sum(self, axis: int = -1) -> Bounded:
        """Return the sum along an axis, added up in whatever order."""
        rounded = UNIT * max(self.value.shape[axis] - 1, 0) * np.abs(self.value).sum(axis=axis)
        return Bounded(self.value.sum(axis=axis), self.error.sum(axis=axis) + rounded)

    def moved(self, move: Callable[[Array], Array]) -> Bounded:
        """Return what only puts the numbers in another order or place."""
        return Bounded(move(self.value), move(self.error))


def _divide(v: Array, a: Bounded, b: Bounded) -> Array:
    size = np.abs(b.value)
    return np.asarray(np.where(b.error < size, (a.error + np.abs(v) * b.error) / (size - b.error), np.inf))


def _power(v: Array, a: Bounded, n: Bounded) -> Array:
    spread = (np.abs(a.value) + a.error) ** (n.value - 1) * a.error
    return np.asarray(np.abs(n.value) * (spread + UNIT * np.abs(v)))


# what these give of numbers with errors are such numbers, of which numpy's own types know nothing
_cos: Any = np.cos
_sqrt: Any = np.sqrt
_hypot: Any = np.hypot
_arctan2: Any = np.arctan2

_SPREAD: dict[np.ufunc, Callable[..., Any]] = {
    np.add: lambda v, a, b: a.error + b.error,
    np.subtract: lambda v, a, b: a.error + b.error,
    np.multiply: lambda v, a, b: np.abs(a.value) * b.error + (np.abs(b.value) + b.error) * a.error,
    np.divide: _divide,
    np.power: _power,
    np.negative: lambda v, a: a.error,
    np.absolute: lambda v, a: a.error,
    np.sqrt: lambda v, a: np.where(a.error < a.value, a.error / np.where(v > 0, v, 1.0), np.sqrt(a.error)),
    np.sin: lambda v, a: a.error + UNIT * np.abs(v),
    np.cos: lambda v, a: a.error + UNIT * np.abs(v),
    np.hypot: lambda v, a, b: a.error + b.error + UNIT * v,
    np.arctan2: lambda v, a, b: (
        np.where(
            (a.error > 0) | (b.error > 0),
            (np.abs(b.value) * a.error + np.abs(a.value) * b.error)
            / np.where(v == v, a.value**2 + b.value**2, 1.0),
            0.0,
        )
        + UNIT * np.abs(v)
    ),
}


def stack(parts: list[Bounded], axis: int = -1) -> Bounded:
    """Put numbers side by side along a new axis."""
    values, errors = (np.broadcast_arrays(*(getattr(x, name) for x in parts)) for name in ("value", "error"))
    return Bounded(np.stack(values, axis=axis), np.stack(errors, axis=axis))


def cross(a: Any, b: Any) -> Bounded:
    """Return a × b of vectors (..., 3)."""
    terms = [a[..., j] * b[..., k] - a[..., k] * b[..., j] for j, k in ((1, 2), (2, 0), (0, 1))]
    return stack(terms)


def times(I: Bounded, w: Any) -> Bounded:
    """Return I ω of a tensor (..., 3, 3) and a vector (..., 3)."""
    product: Bounded = I * w[..., None, :]
    return product.sum(axis=-1)


# --- mass properties ---


class BodyError(NamedTuple):
    """Bounds of the rounding errors of a body's mass (...), centre (..., 3) and tensor (..., 3, 3)."""

    mass: Array
    center: Array
    inertia: Array


class Numbers(NamedTuple):
    """Mass, centre of mass and tensor with their errors."""

    mass: Bounded
    center: Bounded
    inertia: Bounded

    @property
    def errors(self) -> BodyError:
        """The errors alone."""
        return BodyError(*(x.error for x in self))


def numbers(body: Body, error: BodyError | None = None) -> Numbers:
    """Return a body with its errors: those of how it was made, or others."""
    e = body.error_estimate() if error is None else error
    return Numbers(
        Bounded(body.mass, e.mass), Bounded(body.center, e.center), Bounded(body.inertia, e.inertia)
    )


def shift(mass: Any, offset: Bounded) -> Bounded:
    """Return m (|r|² E - r rᵀ), as `inertia.shift` does."""
    x, y, z = (offset[..., i] for i in range(3))
    a, b, c = mass * (y * y + z * z), mass * (x * x + z * z), mass * (x * x + y * y)
    d, e, f = -(mass * (x * y)), -(mass * (x * z)), -(mass * (y * z))
    return stack([stack([a, d, e]), stack([d, b, f]), stack([e, f, c])], axis=-2)


def shaped(shape: str, mass: Any, dimensions: dict[str, Any]) -> Bounded:
    """Return the tensor of a shape, its dimensions and mass with their errors."""
    from rigidbody3d.shapes import SHAPES

    given = {name: x if isinstance(x, Bounded) else Bounded(x) for name, x in dimensions.items()}
    given |= {name: Bounded(0.0) for name in SHAPES[shape].optional if name not in given}
    moments = stack([Bounded(0.0) + mass * x for x in SHAPES[shape].moments(**given)])
    return moments.moved(lambda x: x[..., None, :] * np.eye(3))


def turn(inertia: Bounded, rotation: Bounded) -> Bounded:
    """Return R I Rᵀ."""
    back = rotation.moved(lambda x: np.swapaxes(x, -1, -2))
    half = (rotation[..., :, :, None] * inertia[..., None, :, :]).sum(axis=-2)
    whole: Bounded = half[..., :, :, None] * back[..., None, :, :]
    return whole.sum(axis=-2)


def turned(body: Body, rotation: Array, about: Array | None, error: ArrayLike = 0.0) -> BodyError:
    """Bound a body turned by a rotation matrix whose entries have an error."""
    old, R = numbers(body), Bounded(rotation, error)
    center = old.center if about is None else about + times(R, old.center - about)
    return Numbers(old.mass, center, turn(old.inertia, R)).errors


def moved(body: Body, offset: Array) -> BodyError:
    """Bound a body moved by an offset."""
    old = numbers(body)
    return Numbers(old.mass, old.center + offset, old.inertia).errors


def of_shape(shape: str, mass: Array, center: Array, dimensions: dict[str, ArrayLike]) -> BodyError:
    """Bound the body of a shape."""
    return Numbers(Bounded(mass), Bounded(center), shaped(shape, mass, dimensions)).errors


def composed(parts: Body, axis: int, middle: Array, error: BodyError | None = None) -> BodyError:
    """Bound the body of all parts.

    The point that the tensors are shifted to counts as exact: whatever it is, what is off from the true centre is
    taken out again.
    """
    m, c, I = (x.moved(partial(np.moveaxis, source=axis, destination=0)) for x in numbers(parts, error))
    total = m.sum(axis=0)
    offset = c - middle
    slip = (m[..., None] * offset).sum(axis=0) / total[..., None]
    whole = I.sum(axis=0) + shift(m, offset).sum(axis=0) - shift(total, slip)
    return Numbers(total, middle + slip, whole).errors


def about(body: Body, point: Array) -> BodyError:
    """Bound the tensor about a point."""
    old = numbers(body)
    return Numbers(old.mass, old.center, old.inertia + shift(old.mass, old.center - point)).errors


EIGEN = 10 * EPS
"""By how much of the largest moment the eigensolver, and the snapping of a thin rod's moment to zero, may miss."""


def principal(moments: Array, axes: Array, tensor: ArrayLike) -> tuple[Array, Array]:
    """Bound principal moments (..., 3) and axes (..., 3, 3), whose tensor has errors (..., 3, 3).

    With E the error, λ_i moves by a_iᵀ E a_i and the axis a_i by (a_jᵀ E a_i)/(λ_i - λ_j) towards a_j (G. Stewart
    and J. Sun, Matrix Perturbation Theory, §V.2). Where two moments are as near as that, the axes are anything.
    """
    size = np.abs(axes)
    E = np.broadcast_to(np.asarray(tensor, dtype=float), axes.shape)
    push = size @ E @ np.swapaxes(size, -1, -2) + (EIGEN * np.abs(moments).max(axis=-1))[..., None, None]
    own = np.diagonal(push, axis1=-2, axis2=-1)
    gap = np.abs(moments[..., :, None] - moments[..., None, :]) - own[..., :, None] - own[..., None, :]
    with np.errstate(divide="ignore"):
        swing = np.where(gap > 0, push / np.where(gap > 0, gap, 1.0), np.inf)
    swing = np.minimum(np.where(np.eye(3, dtype=bool), 0.0, swing), 2.0)
    back = np.minimum(np.square(swing).sum(axis=-1, keepdims=True) / 2, 2.0)
    bound = swing @ size + back * size + 4 * EPS * size + EPS * swing.sum(axis=-1, keepdims=True)
    # an axis points where its largest component is positive: undecided where two of opposite sign are as large
    largest = np.sort(size, axis=-1)[..., -1:]
    rivals = (size + bound >= largest - bound.max(axis=-1, keepdims=True)) & (size > 0)
    torn = (rivals & (axes > 0)).any(axis=-1) & (rivals & (axes < 0)).any(axis=-1)
    torn[..., 2] = torn[..., :2].any(axis=-1)
    return own.copy(), np.minimum(np.where(torn[..., None], 2.0, bound), 2.0)


# --- momentum ---


def motion(
    of: Motion, what: str, point: ArrayLike | None, error: BodyError | None, given: float = 0.0
) -> Array:
    """Bound a quantity of a motion, (...) or (..., 3): its formula on numbers with errors."""
    e = error or BodyError(*(np.zeros(()) for _ in range(3)))
    I, m, center = Bounded(of.inertia, e.inertia), Bounded(of.mass, e.mass), Bounded(of.center, e.center)
    w, own, v, a = (_read(x, given) for x in (of.omega, of.alpha, of.velocity, of.acceleration))
    frame = None if of.frame_omega is None else _read(of.frame_omega, given)
    alpha = own if frame is None else own + cross(frame, w)
    if of.pivot is not None:  # the centre of mass follows the body
        r = center - _read(of.pivot, given)
        v = cross(w, r)
        a = cross(alpha, r) + cross(w, v)
    m3 = m[..., None]
    slip = w - (w if frame is None else frame)

    def momentum() -> Bounded:
        return times(I, w)

    def rate() -> Bounded:
        whole: Bounded = times(I, alpha) + cross(w, momentum())
        return whole

    def change() -> Bounded:
        whole: Bounded = cross(slip, momentum()) - times(I, cross(slip, w))
        return whole

    def lever() -> Bounded:
        arm: Bounded = center - _read(point, given)
        return arm

    formulas: dict[str, Callable[[], Bounded]] = {
        "momentum": momentum,
        "true_alpha": lambda: alpha,
        "rate": rate,
        "transport": lambda: cross(w if frame is None else frame, momentum()),
        "relative": lambda: times(I, own) if frame is None else times(I, own) + change(),
        "tensor_rate": lambda: momentum() * 0.0 if frame is None else change(),
        "linear_momentum": lambda: m3 * v,
        "force": lambda: m3 * a,
        "inertia_force": lambda: m3 * a,
        "inertia_moment": rate,
        "energy": lambda: m * (v * v).sum() / 2 + (w * momentum()).sum() / 2,
        "momentum_about": lambda: momentum() + cross(lever(), m3 * v),
        "rate_about": lambda: rate() + cross(lever(), m3 * a),
    }
    return _named(formulas, what)


def _named(formulas: dict[str, Callable[[], Bounded]], what: str) -> Array:
    if what not in formulas:
        raise ValueError(f"no estimate for '{what}': expected one of {', '.join(formulas)}")
    return np.array(formulas[what]().error)


def _read(given: Any, relative: float) -> Bounded:
    """Numbers that may be off by as much of themselves."""
    value = np.asarray(given, dtype=float)
    return Bounded(value, relative * np.abs(value))


# --- shafts ---


def shaft(of: Shaft, what: str, given: float = 0.0) -> Array:
    """Bound a quantity of a shaft, in its shape; of a complex one: the size of its error."""
    m, c, I = numbers(of.body)
    z1, z2 = (_read(of.bearings[..., i], given) for i in range(2))
    weight = m[..., None] * _read(of.gravity, given)
    U = m[..., None] * c[..., :2]  # x and y as the last axis
    push, pull = -(_read(of.speed, given) ** 2), _read(of.speed_rate, given)

    def moment(z: Bounded) -> Bounded:
        products = -stack([I[..., 0, 2], I[..., 1, 2]])
        whole: Bounded = products + U * (c[..., 2] - z)[..., None]
        return whole

    def unbalance() -> Bounded:
        first = moment(z2) / (z1 - z2)[..., None]
        second = moment(z1) / (z2 - z1)[..., None]
        return stack([first, second], axis=-2)

    def size(vector: Bounded) -> Bounded:
        return vector.moved(lambda x: np.hypot(x[..., 0], x[..., 1]))

    def dynamic() -> Bounded:
        x, y = (unbalance()[..., i] for i in range(2))
        p, q = push[..., None], pull[..., None]
        return stack([p * x - q * y, p * y + q * x])

    def static() -> Bounded:
        forces = []
        for here, other in ((z1, z2), (z2, z1)):
            lever = (c[..., 2] - other)[..., None]
            turning = weight[..., :2] * lever - c[..., :2] * weight[..., 2:]
            forces.append(turning / (here - other)[..., None])
        return stack(forces, axis=-2)

    def drive() -> Bounded:
        x, y = c[..., 0], c[..., 1]
        about_z = I[..., 2, 2] + m * (x**2 + y**2)
        torque: Bounded = about_z * pull - (x * weight[..., 1] - y * weight[..., 0])
        return torque

    return _named(
        {
            "static_unbalance": lambda: size(U),
            "unbalance": lambda: size(unbalance()),
            "dynamic": dynamic,
            "static": static,
            "axial": lambda: weight[..., 2],
            "drive_torque": drive,
        },
        what,
    )


# --- gyroscopes ---


def steady(I1: Array, I3: Array, mgl: Array, tilt: Array, spin: Array) -> tuple[Bounded, Bounded]:
    """Return the slow and the fast rate of steady precession with their errors."""
    B = Bounded(I3) * spin
    c: Bounded = _cos(Bounded(tilt))
    # a right angle given in radians is one to rounding
    c = c.moved(lambda x: np.where(np.abs(c.value) < 1e-16, 0.0, x))
    square = B * B - 4 * I1 * mgl * c
    large = B + np.where(B.value < 0, -1.0, 1.0) * _sqrt(square)
    slow = 2 * Bounded(mgl) / large
    return slow.moved(lambda x: np.where(mgl == 0, 0.0, x)), large / (2 * I1 * c)


def cones(I1: Array, I3: Array, w: Array) -> tuple[Bounded, ...]:
    """Return the cones of a free symmetric body with their errors."""
    across, along = _hypot(Bounded(w[..., 0]), w[..., 1]), Bounded(w[..., 2])
    ahead = abs(along)
    space = _arctan2(abs(Bounded(I1) - I3) * across * ahead, I1 * across**2 + I3 * along**2)
    precession = _hypot(across, I3 * along / I1)
    return space, _arctan2(across, ahead), precession, along * (Bounded(I1) - I3) / I1
