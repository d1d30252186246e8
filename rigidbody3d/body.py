"""Bodies: mass, centre of mass and inertia tensor; of shapes, moved and turned, put together of parts.

The tensor is stored at the centre of mass, so that moving a body changes no digit of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.records import components, numbers, record, table
from dalembert.arithmetic.shapes import as_array, common_shape, in_32_digits
from rigidbody3d import solids
from rigidbody3d.inertia import Principal, principal, products, shift, turn, vectors
from rigidbody3d.shapes import inertia_of
from rigidbody3d.solids import Solid, Whole

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import FigureBase

Array = NDArray[np.float64]


@record
class BodyError(NamedTuple):
    """Estimates of the errors of a body's mass (...), centre (..., 3) and tensor (..., 3, 3)."""

    mass: Array
    center: Array
    inertia: Array


@record
@dataclass(frozen=True, eq=False, repr=False)
class Body:
    """A body: mass (...), centre of mass (..., 3) and inertia tensor about it (..., 3, 3), kg, m, kg·m².

    Leading axes are bodies. The numbers may also be doubled ones (`DoubledArray`). `exact` computes the same body (moved,
    turned, composed) to 32 digits; see `error_estimate`. `form` has the shapes of its parts, for its picture.

    Examples
    --------
    >>> rod = Body.of("rod", mass=3.0, length=2.0)
    >>> rod.moved([0, 0, 1]).about([0, 0, 0]).diagonal()
    array([4., 4., 0.])
    """

    mass: Array
    center: Array
    inertia: Array
    exact: Callable[[], Body] | None = field(default=None, repr=False, compare=False)
    form: Callable[[], list[Solid]] | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        mass, center, inertia = map(as_array, (self.mass, self.center, self.inertia))
        if center.shape[-1:] != (3,) or inertia.shape[-2:] != (3, 3):
            raise ValueError(
                f"center must be (..., 3) and inertia (..., 3, 3), found {center.shape} and {inertia.shape}"
            )
        if not (np.isfinite(mass).all() and np.isfinite(center).all() and np.isfinite(inertia).all()):
            raise ValueError("mass, center and inertia must be finite")
        lead = common_shape(mass=mass.shape, center=center.shape[:-1], inertia=inertia.shape[:-2])
        object.__setattr__(self, "mass", np.broadcast_to(mass, lead))
        object.__setattr__(self, "center", np.broadcast_to(center, lead + (3,)))
        object.__setattr__(self, "inertia", np.broadcast_to(inertia, lead + (3, 3)))

    def __repr__(self) -> str:
        if self.mass.ndim:
            return f"<Body: {self.mass.size} bodies, {self.mass.sum():.6g} kg together>"
        moments = numbers(self.principal.moments)
        return f"<Body: {self.mass:.6g} kg at {numbers(self.center)} m, principal moments {moments} kg·m²>"

    @classmethod
    def of(
        cls, shape: str, mass: ArrayLike, center: ArrayLike = (0.0, 0.0, 0.0), **dimensions: ArrayLike
    ) -> Body:
        """Return a body of a shape (see `shapes.SHAPES`) along its own axes."""
        m, c = as_array(mass), as_array(center)
        return cls(
            m,
            c,
            inertia_of(shape, m, **dimensions),
            partial(_shaped, shape, m, c, dimensions),
            partial(solids.of_shape, shape, m, c, dimensions),
        )

    def moved(self, offset: ArrayLike) -> Body:
        """Return the body moved by an offset (..., 3), m: its tensor stays as it is, digit for digit."""
        by = vectors("offset", offset)
        return Body(
            self.mass,
            self.center + by,
            self.inertia,
            partial(_again, Body.moved, self, by),
            partial(solids.moved, self.solids, by),
        )

    def turned(self, rotation: ArrayLike, about: ArrayLike | None = None) -> Body:
        """Return the body turned by a rotation matrix (..., 3, 3) about a point (default: its centre of mass)."""
        R = as_array(rotation)
        if R.shape[-2:] != (3, 3):
            raise ValueError(f"rotation must have the shape (..., 3, 3), found {R.shape}")
        point = None if about is None else vectors("about", about)
        center = self.center
        if point is not None:
            center = point + (R * (center - point)[..., None, :]).sum(axis=-1)
        return Body(
            self.mass,
            center,
            turn(self.inertia, R),
            partial(_again, Body.turned, self, R, point),
            partial(solids.turned, self.solids, R, point),
        )

    def about(self, point: ArrayLike) -> Array:
        """Return the tensor about a point (..., 3): the parallel axis theorem, (..., 3, 3), kg·m²."""
        return self.inertia + shift(self.mass, self.center - vectors("point", point))

    def to_frame(self) -> pd.DataFrame:
        """Return a table with a row per body: mass_kg, x_m …, and the tensor at the centre of mass, ixx_kg_m2 … iyz_kg_m2."""
        I = self.inertia
        columns = {"mass_kg": self.mass} | components("*_m", self.center)
        columns |= {f"i{a}{a}_kg_m2": I[..., i, i] for i, a in enumerate("xyz")}
        columns |= {f"i{ab}_kg_m2": products(I)[..., i] for i, ab in enumerate(("xy", "xz", "yz"))}
        return table(columns, ("body",))

    @property
    def principal(self) -> Principal:
        """The central principal moments and axes."""
        return principal(self.inertia)

    def solids(self) -> list[Solid]:
        """Return the shapes that the body was made of, in their places; of a tensor alone the ellipsoid that has it."""
        if self.form is not None:
            return self.form()
        return solids.of_tensor(self.mass, self.center, self.inertia)

    def plot(
        self,
        names: Sequence[str] = (),
        vectors: Mapping[str, ArrayLike] | None = None,
        figure: FigureBase | None = None,
    ) -> NDArray[np.object_]:
        """Draw the body in the two views that show most of it, its parts as their shapes to scale, and principal axes.

        Parameters
        ----------
        names
            Of the parts.
        vectors
            By name, (3,): ω, H …, drawn by their direction.
        figure
            Where to draw; None: a new figure of pyplot's.

        Returns
        -------
        array (2,) of matplotlib axes

        Raises
        ------
        ValueError
            Several bodies: put them together (`compose`), or take one.
        ImportError
            matplotlib (the extra `plot`) is missing.
        """
        from rigidbody3d.picture import views

        arrows = {name: np.asarray(v, dtype=float) for name, v in (vectors or {}).items()}
        return views.body(self.solids(), names, self.whole(), arrows, figure)

    def whole(self) -> Whole:
        """Return where a body's centre of mass and principal axes lie, and the principal radii of gyration."""
        if self.mass.ndim:
            raise ValueError(
                f"a picture shows one body, found {self.mass.size}: compose() puts parts together"
            )
        moments, axes = self.principal
        return Whole(self.center, np.sqrt(np.clip(moments, 0, None) / self.mass), axes)

    @cached_property
    def in_32_digits(self) -> Body:
        """This body in doubled numbers, computed again from the numbers that it was made of."""
        if self.exact is not None:
            return self.exact()
        return Body(*map(in_32_digits, (self.mass, self.center, self.inertia)))

    def error_estimate(self, about: ArrayLike | None = None) -> BodyError:
        """Return estimates of the errors of `.mass`, `.center` and `.inertia`, in their shapes.

        Parameters
        ----------
        about
            A point (..., 3): `.inertia` then is that of the tensor that `about` gives there.

        Notes
        -----
        Computed twice, with 16 and with 32 digits, from the numbers that the body was made of: zero for a body as given, and
        what a hole all but cancels shows.

        Examples
        --------
        >>> block = Body.of("box", [1.0, -0.999999], width=1.0, height=2.0, depth=[3.0, 2.999997])
        >>> wall = compose(block)
        >>> bool((wall.error_estimate().inertia.diagonal() > 1e-12 * wall.inertia.diagonal()).all())
        True
        """
        if self.exact is None and about is None:
            return BodyError(*(np.zeros(x.shape) for x in (self.mass, self.center, self.inertia)))
        second: Any = self.in_32_digits
        mass, center = second.mass.off(self.mass), second.center.off(self.center)
        if about is not None:
            return BodyError(mass, center, second.about(about).off(self.about(about)))
        return BodyError(mass, center, second.inertia.off(self.inertia))


def compose(parts: Body | Sequence[Body], axis: int = -1) -> Body:
    """Compose a body from parts: several bodies, or a `Body` along one of its axes; a hole is a part of negative mass.

    Parameters
    ----------
    parts
        The parts: a list of bodies, or one `Body` whose leading axes are parts and bodies.
    axis
        The axis of the parts of one `Body`.

    Returns
    -------
    Body
        One body for all parts along the axis.

    Raises
    ------
    ValueError
        No part, a total mass that is not positive, shapes that do not fit.

    Notes
    -----
    I = Σ [I_i + m_i (|d_i|² E − d_i d_iᵀ)], d_i = c_i − G (Beer and Johnston, ch. 9: parallel axis theorem). Each part is
    shifted to the common centre directly, never to the origin and back; the result is corrected for the rounding of that
    centre, since Σ m (c - G) is zero only in exact arithmetic.

    Examples
    --------
    Two rods at right angles.

    >>> arms = Body.of("rod", mass=[1.0, 1.0], center=[[0, 0, 0.5], [0, 0, -0.5]], length=1.0)
    >>> compose(arms).inertia.diagonal().round(12)
    array([0.66666667, 0.66666667, 0.        ])

    A hammer: a handle and a head.

    >>> head = Body.of("cylinder", mass=1.0, radius=0.02, length=0.08).moved([0, 0, 0.3])
    >>> compose([Body.of("rod", mass=0.5, length=0.6), head]).center.round(12)
    array([0. , 0. , 0.2])
    """
    if not isinstance(parts, Body):
        parts = _beside_each_other(parts)
    elif not parts.mass.ndim:
        parts = _beside_each_other([parts])
    at = axis % parts.mass.ndim
    mass, center, inertia = (np.moveaxis(x, at, 0) for x in (parts.mass, parts.center, parts.inertia))
    total = mass.sum(axis=0)
    if not (total > 0).all():
        raise ValueError(f"the total mass must be positive, found {np.min(total):g} kg")
    # any point near the centre will do: what it is off is taken out again
    middle = center[0] + (mass[..., None] * (center - center[0])).sum(axis=0) / total[..., None]
    offset = center - middle
    slip = (mass[..., None] * offset).sum(axis=0) / total[..., None]
    whole = inertia.sum(axis=0) + shift(mass, offset).sum(axis=0) - shift(total, slip)
    return Body(total, middle + slip, whole, partial(_again, compose, parts, axis), parts.solids)


def _beside_each_other(bodies: Sequence[Body]) -> Body:
    """Bodies as the parts along a new last axis."""
    if not bodies:
        raise ValueError("a body is composed of at least one part, found none")
    lead = common_shape(**{f"part {k}": body.mass.shape for k, body in enumerate(bodies, 1)})
    mass, center, inertia = (
        np.stack([np.broadcast_to(getattr(body, name), lead + own) for body in bodies], axis=-1 - len(own))
        for name, own in (("mass", ()), ("center", (3,)), ("inertia", (3, 3)))
    )
    return Body(mass, center, inertia, partial(_beside_again, bodies), partial(_solids_of, bodies))


def _beside_again(bodies: Sequence[Body]) -> Body:
    return _beside_each_other([body.in_32_digits for body in bodies])


def _solids_of(bodies: Sequence[Body]) -> list[Solid]:
    return [solid for body in bodies for solid in body.solids()]


def _shaped(shape: str, mass: Array, center: Array, dimensions: Mapping[str, ArrayLike]) -> Body:
    """A body of a shape, from doubled numbers."""
    each = {name: in_32_digits(x) for name, x in dimensions.items()}
    return Body.of(shape, in_32_digits(mass), in_32_digits(center), **each)


def _again(work: Callable[..., Body], body: Body, *numbers: Any) -> Body:
    """A body computed from another, again in doubled numbers."""
    return work(body.in_32_digits, *numbers)
