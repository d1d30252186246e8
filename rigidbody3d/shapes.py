"""The shapes a part can have: their dimensions, their measure, their inertia tensor at the centre of mass.

Each shape is named by its field's word and lies along its own axes: a rod, cylinder, cone or tube along z
(the cone's apex at +z), the normal of a disk, ring or plate along z. The tensors are those of the tables
(as in the appendices of Beer and Johnston, and of Meriam and Kraige), with the hollow ones in product form: they hold
down to walls without thickness, and arcs down to a straight wire.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dalembert.arithmetic.shapes import as_array
from dalembert.hints import nearest

Array = NDArray[np.float64]
Moments = tuple[Array, Array, Array]


@dataclass(frozen=True)
class Shape:
    """A shape: its dimensions, tensor and measure."""

    dimensions: tuple[str, ...]
    """The names of the dimensions it needs, m (angles: rad)."""
    moments: Callable[..., tuple[ArrayLike, ArrayLike, ArrayLike]]
    """Dimensions -> I_xx, I_yy, I_zz of unit mass, m²."""
    measure: Callable[..., ArrayLike] | None = None
    """Dimensions -> volume, area or length; None for a point."""
    thin: int = 3
    """The dimension of its measure: 3 volume, 2 area, 1 length."""
    optional: tuple[str, ...] = ()
    """Further dimensions that default to zero."""


def _round(radius: Array) -> Moments:
    return radius**2 / 4, radius**2 / 4, radius**2 / 2


def _hollow(radius: Array, inner: Array) -> Array:
    """2/5 (R⁵ - r⁵)/(R³ - r³), divided out."""
    R, r = radius, inner
    return 0.4 * (R**4 + R**3 * r + R**2 * r**2 + R * r**3 + r**4) / (R**2 + R * r + r**2)


def _arc(radius: Array, angle: Array) -> Moments:
    """The variances of cos φ and sin φ over an arc: up to a half turn by their series, where the closed forms cancel."""
    half: Any = angle / 2
    bent = half > 1.5
    mean = np.sin(half) / half
    double = np.sin(angle) / (2 * angle)
    x2: Any = 0.0
    y2: Any = 0.0
    short: Any = 0.0
    term: Any = np.where(bent, 0.0, half * half)
    square = term
    for k in range(1, 25):
        # (−half²)ᵏ/(2k + 1)!, of which 1 − sin(half)/half, 1 − sin(angle)/angle and what they make are sums
        term = term / 6 if k == 1 else -term * square / (2 * k * (2 * k + 1))
        short = short + term
        y2 = y2 + term * (4.0**k / 2)
        x2 = x2 - term * (4.0**k / 2 - 2)
    x2, y2 = np.where(bent, 0.5 + double - mean * mean, x2 - short * short), np.where(bent, 0.5 - double, y2)
    return radius**2 * y2, radius**2 * x2, radius**2 * (x2 + y2)


SHAPES: dict[str, Shape] = {
    "point": Shape((), lambda: (0.0, 0.0, 0.0), None, 0),
    "rod": Shape(
        ("length",), lambda length: (length**2 / 12, length**2 / 12, 0 * length), lambda length: length, 1
    ),
    "disk": Shape(("radius",), _round, lambda radius: np.pi * radius**2, 2),
    "ring": Shape(
        ("radius",),
        lambda radius: (radius**2 / 2, radius**2 / 2, radius**2),
        lambda radius: 2 * np.pi * radius,
        1,
    ),
    "arc": Shape(("radius", "angle"), _arc, lambda radius, angle: radius * angle, 1),
    "cylinder": Shape(
        ("radius", "length"),
        lambda radius, length: (*(2 * ((3 * radius**2 + length**2) / 12,)), radius**2 / 2),
        lambda radius, length: np.pi * radius**2 * length,
    ),
    "cone": Shape(
        ("radius", "length"),
        lambda radius, length: (*(2 * (0.0375 * (4 * radius**2 + length**2),)), 0.3 * radius**2),
        lambda radius, length: np.pi * radius**2 * length / 3,
    ),
    "tube": Shape(
        ("radius", "inner_radius", "length"),
        lambda radius, inner_radius, length: (
            *(2 * ((3 * (radius**2 + inner_radius**2) + length**2) / 12,)),
            (radius**2 + inner_radius**2) / 2,
        ),
        lambda radius, inner_radius, length: (
            np.pi * (radius - inner_radius) * (radius + inner_radius) * length
        ),
    ),
    "box": Shape(
        ("width", "height", "depth"),
        lambda width, height, depth: (
            (height**2 + depth**2) / 12,
            (width**2 + depth**2) / 12,
            (width**2 + height**2) / 12,
        ),
        lambda width, height, depth: width * height * depth,
    ),
    "plate": Shape(
        ("width", "height"),
        lambda width, height: (height**2 / 12, width**2 / 12, (width**2 + height**2) / 12),
        lambda width, height: width * height,
        2,
    ),
    "sphere": Shape(
        ("radius",),
        lambda radius, inner_radius: 3 * (_hollow(radius, inner_radius),),
        lambda radius, inner_radius: (
            np.pi * (radius - inner_radius) * (radius**2 + radius * inner_radius + inner_radius**2) * 4 / 3
        ),
        optional=("inner_radius",),
    ),
}
"""Name -> shape. An arc is a thin wire of a given radius and angle, its middle on +x of its circle's centre."""


def find(shape: str) -> Shape:
    """Return the shape of this name.

    Raises
    ------
    ValueError
        An unknown shape; the nearest name is suggested.

    Examples
    --------
    >>> find("cilinder")
    Traceback (most recent call last):
    ...
    ValueError: unknown shape 'cilinder': expected one of point, rod, ...; did you mean 'cylinder'?
    """
    if shape not in SHAPES:
        raise ValueError(
            f"unknown shape '{shape}': expected one of {', '.join(SHAPES)}{nearest(shape, SHAPES)}"
        )
    return SHAPES[shape]


def _dimensions(shape: str, dimensions: dict[str, ArrayLike]) -> dict[str, Array]:
    definition = find(shape)
    missing = [name for name in definition.dimensions if name not in dimensions]
    extra = [name for name in dimensions if name not in definition.dimensions + definition.optional]
    if missing or extra:
        raise ValueError(
            f"a {shape} needs {', '.join(definition.dimensions) or 'no dimension'}: "
            + (
                f"{', '.join(missing)} missing"
                if missing
                else f"{', '.join(extra)} is none of its dimensions"
            )
        )
    values = {
        name: as_array(dimensions.get(name, 0.0)) for name in definition.dimensions + definition.optional
    }
    for name, value in values.items():
        if (
            not np.isfinite(value).all()
            or (value < 0).any()
            or (name in definition.dimensions and (value == 0).any() and name != "inner_radius")
        ):
            raise ValueError(f"the {name} of a {shape} must be a positive number, found {value}")
    if "inner_radius" in values and (values["inner_radius"] > values["radius"]).any():
        raise ValueError(f"the inner_radius of a {shape} is larger than its radius")
    return values


def inertia_of(shape: str, mass: ArrayLike, **dimensions: ArrayLike) -> Array:
    """Return the inertia tensor of a shape at its centre of mass, along its own axes, (..., 3, 3), kg·m².

    Parameters
    ----------
    shape
        A name of `SHAPES`.
    mass
        (...), kg; negative for a hole.
    **dimensions
        The dimensions of the shape, m.

    Returns
    -------
    ndarray
        (..., 3, 3), kg·m².

    Raises
    ------
    ValueError
        An unknown shape, a missing dimension, one too many, one that is not positive.

    Notes
    -----
    The tables of Beer and Johnston and of Meriam and Kraige; hollow shapes in divided form, which holds down to walls
    without thickness.

    Examples
    --------
    >>> inertia_of("disk", 2.0, radius=0.3).diagonal()
    array([0.045, 0.045, 0.09 ])
    """
    definition, values = SHAPES.get(shape), _dimensions(shape, dimensions)
    assert definition is not None
    m: Any = as_array(mass)
    moments = np.broadcast_arrays(*(m * x for x in definition.moments(**values)))
    return np.stack(moments, axis=-1)[..., None, :] * np.eye(3)


def measure_of(shape: str, **dimensions: ArrayLike) -> tuple[Array, int]:
    """Return the volume, area or length of a shape, and its dimension 3, 2 or 1.

    Parameters
    ----------
    shape
        A name of `SHAPES`.
    **dimensions
        The dimensions of the shape, (...), m.

    Returns
    -------
    measure, dimension
        (...), m³, m² or m; 3, 2 or 1.

    Raises
    ------
    ValueError
        An unknown shape, one without a measure, a missing dimension, one too many, one that is not positive.

    Examples
    --------
    >>> measure_of("box", width=1, height=2, depth=3)
    (array(6.), 3)
    """
    definition = find(shape)
    values = _dimensions(shape, dimensions)
    if definition.measure is None:
        raise ValueError(f"a {shape} has no volume: give its mass")
    return as_array(definition.measure(**values)), definition.thin


def mesh(vertices: ArrayLike, faces: ArrayLike, density: float = 1.0) -> tuple[Array, Array, Array]:
    """Return mass, centre of mass and central tensor of a closed triangle mesh of uniform density.

    Parameters
    ----------
    vertices
        (v, 3), m.
    faces
        Indices of the vertices of each triangle, counter-clockwise seen from outside, (f, 3).
    density
        kg/m³.

    Returns
    -------
    mass, center, inertia
        kg; (3,), m; (3, 3), kg·m².

    Raises
    ------
    ValueError
        A mesh that is not closed (an edge without its opposite), or turned inside out.

    Notes
    -----
    Sum of signed tetrahedra from the mean of the vertices: ∫ x xᵀ dV = V/20 (Σ p pᵀ + s sᵀ) over the corners p
    with s their sum (F. Tonon, J. Math. Stat. 1, 2005, 8-11).

    Examples
    --------
    >>> corner = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> m, c, I = mesh(corner, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], density=6.0)
    >>> round(float(m), 12), c, round(float(I[0, 0]), 12)
    (1.0, array([0.25, 0.25, 0.25]), 0.075)
    """
    points, triangles = as_array(vertices), np.asarray(faces, dtype=np.int64)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    ahead = edges[:, 0] * len(points) + edges[:, 1]
    back = edges[:, 1] * len(points) + edges[:, 0]
    if not np.array_equal(np.sort(ahead), np.sort(back)):
        raise ValueError("the mesh is not closed: some edge has no neighbour that runs it the other way")
    corners = points[np.unique(triangles)]
    middle = corners.sum(axis=0) / len(corners)
    p = (points - middle)[triangles]
    volume = (p[:, 0] * np.cross(p[:, 1], p[:, 2])).sum(axis=-1) / 6
    total = volume.sum()
    if not total > 0:
        raise ValueError("the mesh encloses no volume, or its faces are turned inside out")
    s = p.sum(axis=1)
    first = (volume[:, None] * s).sum(axis=0) / 4
    parts = np.stack([p[:, 0], p[:, 1], p[:, 2], s], axis=1)
    second = (
        (volume[:, None] * np.swapaxes(parts, 0, 1))[..., None] * np.swapaxes(parts, 0, 1)[..., None, :]
    ).sum(axis=1)
    whole = second.sum(axis=0) / 20
    center = first / total
    whole = whole - total * (center[:, None] * center)
    inertia = density * ((whole[0, 0] + whole[1, 1] + whole[2, 2]) * np.eye(3) - whole)
    return density * total, center + middle, (inertia + inertia.T) / 2


def load_mesh(path: str) -> tuple[Array, NDArray[np.int64]]:
    """Return vertices (v, 3) and triangles (f, 3) of a mesh file (STL, OBJ …), in the unit of the file.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    ImportError
        trimesh is not installed (the extra `mesh`).
    ValueError
        No mesh can be read from the file.

    Examples
    --------
    A corner of a unit cube:

    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> text = "v 0 0 0;v 1 0 0;v 0 1 0;v 0 0 1;f 1 3 2;f 1 2 4;f 1 4 3;f 2 3 4"
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder, "corner.obj")
    ...     _ = file.write_text(text.replace(";", chr(10)))
    ...     vertices, triangles = load_mesh(str(file))
    >>> round(float(mesh(vertices, triangles, density=6.0)[0]), 12)
    1.0
    """
    import trimesh

    try:
        loaded = trimesh.load_mesh(path)
        return np.asarray(loaded.vertices, dtype=float), np.asarray(loaded.faces, dtype=np.int64)
    except ImportError:
        raise
    except Exception as error:
        raise ValueError(f"{path}: no mesh can be read from it: {error}") from None
