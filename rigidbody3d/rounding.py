"""Bounds of rounding errors: each formula of mass properties, momentum, shafts and tops on numbers with errors.

None of it is computed unless an estimate is asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.bounded import Bounded, apply, stack
from dalembert.arithmetic.exact import EPS
from dalembert.arithmetic.records import record
from rigidbody3d.shapes import SHAPES

if TYPE_CHECKING:
    from dalembert.arithmetic.bounds import Given

Array = NDArray[np.float64]


def cross(a: Bounded, b: Bounded) -> Bounded:
    """Return a × b of vectors (..., 3)."""
    terms = [a[..., j] * b[..., k] - a[..., k] * b[..., j] for j, k in ((1, 2), (2, 0), (0, 1))]
    return stack(terms)


def times(I: Bounded, w: Bounded) -> Bounded:
    """Return I ω of a tensor (..., 3, 3) and a vector (..., 3)."""
    return (I * w[..., None, :]).sum(axis=-1)


# --- mass properties ---


@record
class BodyError(NamedTuple):
    """Bounds of the rounding errors of a body's mass (...), centre (..., 3) and tensor (..., 3, 3)."""

    mass: Array
    center: Array
    inertia: Array


class MassProperties(NamedTuple):
    """Mass (...), centre of mass (..., 3) and tensor at it (..., 3, 3) alone, of any kind of number."""

    mass: Array
    center: Array
    inertia: Array


def of_body(mass: Array, center: Array, inertia: Array, error: BodyError | None = None) -> dict[str, Given]:
    """Return mass properties as numbers that enter a formula; None: they are exact."""
    from dalembert.arithmetic.bounds import Given

    m, c, I = error or (0.0, 0.0, 0.0)
    return {"mass": Given(mass, 0, m), "center": Given(center, 1, c), "inertia": Given(inertia, 2, I)}


class Numbers(NamedTuple):
    """Mass, centre of mass and tensor with their errors."""

    mass: Bounded
    center: Bounded
    inertia: Bounded

    @property
    def errors(self) -> BodyError:
        """The errors alone."""
        return BodyError(*(x.error for x in self))


def numbers(mass: Array, center: Array, inertia: Array, error: BodyError | None = None) -> Numbers:
    """Return mass properties with their errors; None: they are exact."""
    e = error or BodyError(*(np.zeros(()) for _ in range(3)))
    return Numbers(Bounded(mass, e.mass), Bounded(center, e.center), Bounded(inertia, e.inertia))


def shift(mass: Bounded, offset: Bounded) -> Bounded:
    """Return m (|r|² E - r rᵀ), as `inertia.shift` does."""
    x, y, z = (offset[..., i] for i in range(3))
    a, b, c = mass * (y * y + z * z), mass * (x * x + z * z), mass * (x * x + y * y)
    d, e, f = -(mass * (x * y)), -(mass * (x * z)), -(mass * (y * z))
    return stack([stack([a, d, e]), stack([d, b, f]), stack([e, f, c])], axis=-2)


def shaped(shape: str, mass: Bounded, dimensions: Mapping[str, Bounded | ArrayLike]) -> Bounded:
    """Return the tensor of a shape, its dimensions and mass with their errors."""
    given = {name: x if isinstance(x, Bounded) else Bounded(x) for name, x in dimensions.items()}
    given |= {name: Bounded(0.0) for name in SHAPES[shape].optional if name not in given}
    moments = stack([Bounded(0.0) + mass * x for x in SHAPES[shape].moments(**given)])
    return moments.moved(lambda x: x[..., None, :] * np.eye(3))


def turn(inertia: Bounded, rotation: Bounded) -> Bounded:
    """Return R I Rᵀ."""
    back = rotation.moved(lambda x: np.swapaxes(x, -1, -2))
    half = (rotation[..., :, :, None] * inertia[..., None, :, :]).sum(axis=-2)
    return (half[..., :, :, None] * back[..., None, :, :]).sum(axis=-2)


Made = Callable[[], Numbers]
"""Tells a body's mass properties with the errors of how it was made, when they are asked for."""


def turned(body: Made, rotation: Array, about: Array | None, error: ArrayLike = 0.0) -> BodyError:
    """Bound a body turned by a rotation matrix whose entries have an error."""
    old, R = body(), Bounded(rotation, error)
    center = old.center if about is None else about + times(R, old.center - about)
    return Numbers(old.mass, center, turn(old.inertia, R)).errors


def moved(body: Made, offset: Array) -> BodyError:
    """Bound a body moved by an offset."""
    old = body()
    return Numbers(old.mass, old.center + offset, old.inertia).errors


def of_shape(shape: str, mass: Array, center: Array, dimensions: dict[str, ArrayLike]) -> BodyError:
    """Bound the body of a shape."""
    return Numbers(Bounded(mass), Bounded(center), shaped(shape, Bounded(mass), dimensions)).errors


def composed(parts: Made, axis: int, middle: Array) -> BodyError:
    """Bound the body of all parts.

    The point that the tensors are shifted to counts as exact: whatever it is, what is off from the true centre is
    taken out again.
    """
    m, c, I = (x.moved(partial(np.moveaxis, source=axis, destination=0)) for x in parts())
    total = m.sum(axis=0)
    offset = c - middle
    slip = (m[..., None] * offset).sum(axis=0) / total[..., None]
    whole = I.sum(axis=0) + shift(m, offset).sum(axis=0) - shift(total, slip)
    return Numbers(total, middle + slip, whole).errors


def about(old: Numbers, point: Array) -> BodyError:
    """Bound the tensor about a point."""
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


# --- gyroscopes ---


def steady(I1: Array, I3: Array, mgl: Array, tilt: Array, spin: Array) -> tuple[Bounded, Bounded]:
    """Return the slow and the fast rate of steady precession with their errors."""
    B = Bounded(I3) * spin
    c = apply(np.cos, Bounded(tilt))
    # a right angle given in radians is one to rounding
    c = c.moved(lambda x: np.where(np.abs(c.value) < 1e-16, 0.0, x))
    square = B * B - 4 * I1 * mgl * c
    large = B + np.where(B.value < 0, -1.0, 1.0) * apply(np.sqrt, square)
    slow = 2 * Bounded(mgl) / large
    return slow.moved(lambda x: np.where(mgl == 0, 0.0, x)), large / (2 * I1 * c)


def cones(I1: Array, I3: Array, w: Array) -> tuple[Bounded, ...]:
    """Return the cones of a free symmetric body with their errors."""
    across, along = apply(np.hypot, Bounded(w[..., 0]), w[..., 1]), Bounded(w[..., 2])
    ahead = abs(along)
    space = apply(np.arctan2, abs(Bounded(I1) - I3) * across * ahead, I1 * across**2 + I3 * along**2)
    precession = apply(np.hypot, across, I3 * along / I1)
    return space, apply(np.arctan2, across, ahead), precession, along * (Bounded(I1) - I3) / I1
