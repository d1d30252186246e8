"""Bodies: mass, centre of mass and inertia tensor; of shapes, moved and turned, put together of parts.

The tensor is stored at the centre of mass, so that moving a body changes no digit of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.exact import UNIT
from dalembert.arithmetic.records import components, numbers, record, table
from dalembert.arithmetic.shapes import common_shape
from rigidbody3d import solids
from rigidbody3d.inertia import Principal, point_tensor, principal, products, turned_tensor
from rigidbody3d.rounding import BodyError, MassProperties, of_body
from rigidbody3d.shapes import inertia_of, shape_tensor
from rigidbody3d.solids import Solid, Whole

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import FigureBase

    from dalembert.arithmetic.bounds import Given

Array = NDArray[np.float64]
Formula = Callable[..., MassProperties]
"""Mass, centre and tensor of a body from those of another, on arrays of any kind of number, recorded ones for bounds too."""


@record
@dataclass(frozen=True, eq=False, repr=False)
class Body:
    """Mass (...), centre of mass (..., 3) and inertia tensor at it (..., 3, 3), kg, m, kg·m²; leading axes are bodies.

    `rounding` bounds the errors of a body that was worked out (moved, turned, put together); see `error_estimate`. `form`
    has the shapes it was made of, for its picture.

    Examples
    --------
    >>> rod = Body.of("rod", mass=3.0, length=2.0)
    >>> rod.moved([0, 0, 1]).about([0, 0, 0]).diagonal()
    array([4., 4., 0.])
    """

    mass: Array
    center: Array
    inertia: Array
    rounding: Callable[[], BodyError] | None = field(default=None, repr=False, compare=False)
    form: Callable[[], list[Solid]] | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        mass, center, inertia = (np.asarray(x, dtype=float) for x in (self.mass, self.center, self.inertia))
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
        m, c = np.asarray(mass, dtype=float), np.asarray(center, dtype=float)
        quantities: dict[str, Given] = {"mass": (m, 0, 0.0), "center": (c, 1, 0.0)}
        quantities |= {name: (x, 0, 0.0) for name, x in dimensions.items()}
        return cls(
            m,
            c,
            inertia_of(shape, mass, **dimensions),
            partial(_error, _shaped, dict, quantities, shape),
            partial(solids.of_shape, shape, m, c, dimensions),
        )

    def moved(self, offset: ArrayLike) -> Body:
        """Return the body moved by an offset (..., 3), m: its tensor stays as it is, digit for digit."""
        by = np.asarray(offset, dtype=float)
        return self._made(_moved, partial(solids.moved, self.solids, by), offset=(by, 1, 0.0))

    def turned(self, rotation: ArrayLike, about: ArrayLike | None = None, error: ArrayLike = 0.0) -> Body:
        """Return the body turned by a rotation matrix (..., 3, 3) about a point (default: its centre of mass).

        `error` bounds what the entries of the matrix are off by, for `error_estimate`.
        """
        R = np.asarray(rotation, dtype=float)
        point = None if about is None else np.asarray(about, dtype=float)
        there: dict[str, Given] = {} if point is None else {"point": (point, 1, 0.0)}
        form = partial(solids.turned, self.solids, R, point)
        return self._made(_turned, form, rotation=(R, 2, error), **there)

    def _made(self, formula: Formula, form: Callable[[], list[Solid]], **given: Given) -> Body:
        numbers = {name: np.asarray(x) for name, (x, _, _) in given.items()}
        made = formula(self.mass, self.center, self.inertia, **numbers)
        return Body(*made, partial(_error, formula, self.given, given), form)

    def about(self, point: ArrayLike) -> Array:
        """Return the tensor about a point (..., 3): the parallel axis theorem, (..., 3, 3), kg·m²."""
        return _about(self.mass, self.center, self.inertia, np.asarray(point, dtype=float)).inertia

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

    def given(self) -> dict[str, Given]:
        """Return mass, centre of mass and tensor with the errors of how the body was made."""
        return of_body(self.mass, self.center, self.inertia, self.error_estimate())

    def error_estimate(self, about: ArrayLike | None = None) -> BodyError:
        """Return bounds of the rounding errors of `.mass`, `.center` and `.inertia`, in their shapes.

        Parameters
        ----------
        about
            A point (..., 3): `.inertia` then bounds the tensor that `about` gives there.

        Notes
        -----
        Zero for a body as given; where it was moved, turned or put together the adjoint of its formula says what
        each rounding becomes, so that what a hole all but cancels shows. The given numbers count as exact.

        Examples
        --------
        >>> block = Body.of("box", [1.0, -0.999999], width=1.0, height=2.0, depth=[3.0, 2.999997])
        >>> wall = compose(block)
        >>> bool((wall.error_estimate().inertia.diagonal() > 1e-12 * wall.inertia.diagonal()).all())
        True
        """
        if about is not None:
            return _error(_about, self.given, {"point": (about, 1, 0.0)})
        return self._own_error

    @cached_property
    def _own_error(self) -> BodyError:
        if self.rounding is not None:
            return self.rounding()
        return BodyError(*(np.zeros_like(x) for x in (self.mass, self.center, self.inertia)))


def compose(parts: Body, axis: int = -1) -> Body:
    """Put parts together: the body of all parts along one axis of the bodies; a hole is a part of negative mass.

    Raises
    ------
    ValueError
        A total mass that is not positive.

    Notes
    -----
    Each part is shifted to the common centre directly, never to the origin and back; the rounding of that
    centre is taken out again, since Σ m (c - G) is zero only in exact arithmetic.

    Examples
    --------
    Two rods at right angles.

    >>> arms = Body.of("rod", mass=[1.0, 1.0], center=[[0, 0, 0.5], [0, 0, -0.5]], length=1.0)
    >>> compose(arms).inertia.diagonal().round(12)
    array([0.66666667, 0.66666667, 0.        ])
    """
    at = axis % parts.mass.ndim
    mass, center, inertia = (np.moveaxis(x, at, 0) for x in (parts.mass, parts.center, parts.inertia))
    total = mass.sum(axis=0)
    if not (total > 0).all():
        raise ValueError(f"the total mass must be positive, found {np.min(total):g} kg")
    middle = center[0] + (mass[..., None] * (center - center[0])).sum(axis=0) / total[..., None]
    total, moment, own, shifted = (x.sum(axis=0) for x in _shares(mass, center, inertia, middle))
    whole = _whole(total, moment, own, shifted, middle)
    return Body(*whole, partial(_composed_error, parts.given, at, middle), parts.solids)


def _moved(mass: Array, center: Array, inertia: Array, offset: Array) -> MassProperties:
    return MassProperties(mass, center + offset, inertia)


def _turned(
    mass: Array, center: Array, inertia: Array, rotation: Array, point: Array | None = None
) -> MassProperties:
    if point is not None:
        center = point + np.einsum("...ij,...j->...i", rotation, center - point)
    return MassProperties(mass, center, turned_tensor(inertia, rotation))


def _shaped(shape: str, mass: Array, center: Array, **dimensions: Array) -> MassProperties:
    return MassProperties(mass, center, shape_tensor(shape, mass, dimensions))


def _about(mass: Array, center: Array, inertia: Array, point: Array) -> MassProperties:
    return MassProperties(mass, center, np.asarray(inertia + point_tensor(mass, center - point)))


def _shares(mass: Array, center: Array, inertia: Array, middle: Array) -> list[Array]:
    """What each part adds to the whole: mass, its moment about the middle, its own tensor, and the shift there."""
    offset = center - middle
    return [mass, mass[..., None] * offset, inertia, point_tensor(mass, offset)]


def _whole(mass: Array, moment: Array, inertia: Array, shifted: Array, middle: Array) -> MassProperties:
    """The body of these sums; the middle counts as exact: what it is off from the centre is taken out again."""
    slip = moment / mass[..., None]
    return MassProperties(mass, middle + slip, inertia + shifted - point_tensor(mass, slip))


# --- bounds of rounding errors ---


def _error(
    formula: Formula, body: Callable[[], Mapping[str, Given]], quantities: Mapping[str, Given], *options: str
) -> BodyError:
    """Bound what a formula makes of a body, or of nothing but what is given."""
    from dalembert.arithmetic.bounds import bounds

    return BodyError(*bounds(formula, {**body(), **quantities}, *options))


def _composed_error(parts: Callable[[], dict[str, Given]], axis: int, middle: Array) -> BodyError:
    """Bound the body of all parts."""
    from dalembert.arithmetic.bounds import bounds

    there: dict[str, Given] = {"middle": (middle, 1, 0.0)}
    for name, (x, axes, error) in parts().items():
        by_part = (np.moveaxis(y, axis, 0) for y in np.broadcast_arrays(np.asarray(x, dtype=float), error))
        there[name] = next(by_part), axes, next(by_part)
    shares = _shares(**{name: np.asarray(x) for name, (x, _, _) in there.items()})
    sums: dict[str, Given] = {"middle": (middle, 1, 0.0)}
    for name, share, error in zip(SUMMED, shares, bounds(_shares, there), strict=True):
        # added up in whatever order
        rounded = UNIT * (len(share) - 1) * np.abs(share).sum(axis=0)
        sums[name] = share.sum(axis=0), SUMMED[name], error.sum(axis=0) + rounded
    mass, center, inertia = bounds(_whole, sums)
    # the division by the mass, beyond the first order
    part = mass / shares[0].sum(axis=0)
    grown = np.divide(1.0, 1.0 - part, out=np.full(part.shape, np.inf), where=part < 1)
    return BodyError(mass, center * grown[..., None], inertia * grown[..., None, None])


SUMMED = {"mass": 0, "moment": 1, "inertia": 2, "shifted": 2}
"""What is summed over parts, and how many axes it has."""
