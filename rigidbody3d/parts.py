"""A body from a CSV of parts: each row a shape with its mass, place and orientation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dalembert.angles import cosine_sine
from dalembert.errors import DataError, needs, quote
from dalembert.figures import last_place
from dalembert.hints import nearest
from dalembert.tables.files import note
from dalembert.tables.table import Table, read
from dalembert.units import UNITS, to_si
from rigidbody3d.body import Body, compose
from rigidbody3d.inertia import check, tensor
from rigidbody3d.shapes import SHAPES, inertia_of, load_mesh, measure_of, mesh
from rigidbody3d.solids import Solid, of_tensor
from rigidbody3d.turning import TURNS, along, rotation_of, turned, vectors

if TYPE_CHECKING:
    from rigidbody3d.solids import Solid

Array = NDArray[np.float64]

LENGTHS = ("radius", "inner_radius", "length", "width", "height", "depth")
MOMENTS = ("ixx", "iyy", "izz")
PRODUCTS = ("ixy", "ixz", "iyz")
DENSITIES = {3: "density", 2: "area_density", 1: "linear_density"}
TENSOR = "tensor"
MESH = "mesh"
POINT = "point"
_NUMBERS = {
    "mass": "mass",
    "density": "density",
    "area_density": "area density",
    "linear_density": "linear density",
    **dict.fromkeys(("x", "y", "z", *LENGTHS), "length"),
    **dict.fromkeys(("axis_x", "axis_y", "axis_z"), "number"),
    **dict.fromkeys((*TURNS, "angle"), "angle"),
    **dict.fromkeys((*MOMENTS, *PRODUCTS), "inertia"),
}


POLAR = ("radius", "angle")
"""Where a point lies, in place of x and y."""
SEVERAL = "body"
"""The column that names each row's body where a table has several."""


@dataclass(frozen=True)
class Parts:
    """The parts as read, and the body they make."""

    file: str
    body: str
    """Its name in the column `body`."""
    several: bool
    """Whether the table has that column."""
    name: list[str]
    shape: list[str]
    each: Body
    """Mass (k,), centre (k, 3), tensor (k, 3, 3) of the parts."""
    whole: Body
    warnings: list[str]


class _Mesh(NamedTuple):
    """A closed mesh from a file: its triangles are about its centre of mass."""

    mass: float
    center: Array
    inertia: Array
    exact: Callable[[], tuple[Any, Any, Any]]
    """Volume, centre and tensor of unit density to 32 digits."""
    triangles: Array


@dataclass(frozen=True, eq=False, repr=False)
class _Unturned:
    """The parts along their own axes; meshes by their number."""

    shapes: list[str]
    rows: list[dict[str, float]]
    meshes: dict[int, _Mesh]
    mass: Array
    center: Array
    inertia: Array
    table: Table
    index: list[int]
    """Their rows of the table."""

    def exact(self) -> Body:
        """Return the parts, turned, to 32 digits: from the decimals of the table as they are written."""
        from dalembert.arithmetic.doubled_arrays import DoubledArray
        from dalembert.tables.exact import column, cosine_and_sine

        read, shape = self.table.numbers, np.array(self.shapes)
        cells = {name: column(numbers, self.index) for name, numbers in read.items()}
        zero = DoubledArray(np.zeros(len(self.index)))
        center = np.stack([cells.get(axis, zero) for axis in "xyz"], axis=-1)
        if "angle" in read:
            by_angle = (shape == POINT) & np.isfinite(read["angle"].values[self.index])
            c, s = cosine_and_sine(read["angle"], self.index)
            polar = np.stack([cells["radius"] * c, cells["radius"] * s, center[:, 2]], axis=-1)
            center = np.where(by_angle[:, None], polar, center)
        mass = cells.get("mass", zero) + 0.0
        own = [cells.get(name, zero) for name in (*MOMENTS, *PRODUCTS)]
        inertia: Any = tensor(*own)
        inertia = np.where(
            (inertia.value.trace(axis1=1, axis2=2) * mass.high < 0)[:, None, None], -inertia, inertia
        )
        for kind in dict.fromkeys(self.shapes):
            if kind in SHAPES:
                places = np.flatnonzero(shape == kind)
                form = SHAPES[kind]
                sizes = {
                    name: cells[name][places] for name in form.dimensions + form.optional if name in cells
                }
                if form.thin:
                    density = cells.get(DENSITIES[form.thin], zero)[places]
                    dense: Any = measure_of(kind, **sizes)[0] * density
                    mass[places] = np.where(mass.high[places] == 0, dense, mass[places])
                inertia[places] = inertia_of(kind, mass[places], **sizes)
        for place, solid in self.meshes.items():
            volume, middle, moments = solid.exact()
            density = cells["density"][place] if "density" in self.rows[place] else mass[place] / volume
            mass[place], inertia[place] = density * volume, moments * density
            if not self.rows[place].keys() & {"x", "y", "z"}:
                center[place] = middle
        turns = [
            (axis, *cosine_and_sine(read[name], self.index))
            for axis, name in enumerate(TURNS)
            if name in read
        ]
        rotation = turned(turns, along(np.stack([cells.get(f"axis_{a}", zero) for a in "xyz"], axis=-1)))
        return Body(mass, center, inertia).turned(rotation)

    def solids(self) -> list[Solid]:
        """Return what they look like."""
        solids = []
        for i, (shape, row) in enumerate(zip(self.shapes, self.rows, strict=True)):
            if shape == TENSOR:
                solids += of_tensor(self.mass[i : i + 1], self.center[i : i + 1], self.inertia[i : i + 1])
            else:
                drawn = (self.meshes[i].triangles,) if i in self.meshes else ()
                looks = {} if drawn else row
                solids.append(Solid(shape, looks, float(self.mass[i]), self.center[i], np.eye(3), *drawn))
        return solids


def read_parts(path: str | Path) -> Parts:
    """Read a table of the parts of one body, and put them together.

    Parameters
    ----------
    path : str or Path
        CSV or workbook with a row for each part: its shape, mass or density, place, turn (docs/rigid-body.md).

    Returns
    -------
    Parts
        `whole`, the `Body` that they make; `each`, mass (k,), centre (k, 3) and tensor (k, 3, 3) of the parts, in SI and
        about their own centres of mass, with their `name` and `shape`; `warnings`.

    Raises
    ------
    DataError
        The table cannot be read, has several bodies, or no body is made of its parts.

    Examples
    --------
    Two points on a line, 2 kg at 0 and 1 kg at 0.3 m:

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder, "parts.csv")
    ...     _ = table.write_text("part,shape,mass_kg,x_mm\\na,point,2,0\\nb,point,1,300\\n")
    ...     body = read_parts(table).whole
    >>> float(body.mass), body.center.round(3), body.inertia.diagonal().round(3)
    (3.0, array([0.1, 0. , 0. ]), array([0.  , 0.06, 0.06]))
    """
    bodies = read_bodies(str(path))
    if len(bodies) > 1:
        several = ", ".join(quote(parts.body) for parts in bodies)
        raise DataError(f"{bodies[0].file}: column body: found {several}, expected one body")
    return bodies[0]


def read_bodies(path: str) -> list[Parts]:
    """Read a table of parts and put them together: one body, or with a column `body` each of its own."""
    return bodies_of(read_table(path), path)


def read_table(path: str) -> Table:
    """Read a table of parts as it stands."""
    texts = ["part", "shape", "file", "file_unit", SEVERAL]
    return read(path, numbers=_NUMBERS, texts=texts, blank=list(_NUMBERS))


def bodies_of(table: Table, path: str) -> list[Parts]:
    """Put the parts of a table together; meshes stand in files of the path's folder."""
    values = {name: column.si + 0.0 for name, column in table.numbers.items()}
    # row by row Python's numbers are faster; turns are no shape's
    columns = {key: column.tolist() for key, column in values.items() if key not in TURNS}
    labels = table.texts.get("part", [str(index + 1) for index in range(table.rows)])
    centers = vectors(values, *"xyz")
    folder = Path() if path == "-" else Path(path).parent
    names, body_of = table.numbered(SEVERAL)
    warnings: list[list[str]] = [[] for _ in names]
    warnings[0] += table.warnings
    left_out: list[list[str]] = [[] for _ in names]
    kept: list[int] = []
    shapes, rows, masses, tensors = [], [], [], []
    meshes: dict[int, _Mesh] = {}
    for index, shape in enumerate(map(str.lower, table.needed("shape"))):
        row = {key: value for key, column in columns.items() if (value := column[index]) == value}
        if shape == POINT and row.keys() & set(POLAR):
            centers[index, :2] = _polar(table, index, row)
            row = {key: value for key, value in row.items() if key not in POLAR}
        if shape == MESH:
            solid = _mesh(table, index, row, folder)
            own, moments = solid.mass, solid.inertia
            meshes[len(kept)] = solid
            # it stays where the file has it
            if not row.keys() & {"x", "y", "z"}:
                centers[index] = solid.center
        else:
            own, moments = _part(table, index, shape, row, warnings[body_of[index]], labels[index])
        if own == 0:
            left_out[body_of[index]].append(f"{table.file}: part {quote(labels[index])}: mass 0: left out")
            continue
        kept.append(index)
        shapes.append(shape)
        rows.append(row)
        masses.append(own)
        tensors.append(moments)
    mass, inertia = np.array(masses), np.array(tensors).reshape(-1, 3, 3)
    missing = np.zeros(len(names))
    for place, by in _check_tensors(table, kept, shapes, mass, inertia):
        index = kept[place]
        warnings[body_of[index]].append(_broken(table, index, labels[index], by))
        missing[body_of[index]] += by
    rotation = rotation_of(table, values)[kept]
    result = []
    for number, name in enumerate(names):
        mine = np.flatnonzero(body_of[kept] == number)
        own_rows = [kept[i] for i in mine]
        parts = _Unturned(
            [shapes[i] for i in mine],
            [rows[i] for i in mine],
            {k: meshes[i] for k, i in enumerate(mine.tolist()) if i in meshes},
            mass[mine],
            centers[own_rows],
            inertia[mine],
            table,
            own_rows,
        )
        drawn = Body(parts.mass, parts.center, parts.inertia, form=parts.solids).turned(rotation[mine])
        each = replace(drawn, exact=parts.exact)
        of = f"{table.file}: body {quote(name)}" if SEVERAL in table.texts else table.file
        whole = _whole(of, each, float(missing[number]))
        shown = [labels[i] for i in own_rows]
        notes = [*warnings[number], *left_out[number]]
        result.append(
            Parts(table.file, name, SEVERAL in table.texts, shown, parts.shapes, each, whole, notes)
        )
    return result


def _whole(of: str, each: Body, missing: float) -> Body:
    """Put the parts of a body together; `missing` is by how much printed digits let the tensors miss a body's, kg·m²."""
    total = each.mass.sum()
    if not total > 0:
        raise DataError(
            f"{of}: the masses add up to {total:g} kg: expected a positive total (a hole is a negative mass)"
        )
    whole = compose(each)
    verdict = check(whole.inertia)
    if not verdict.valid and not verdict.margin >= -missing:
        raise DataError(
            f"{of}: no body is made of these parts: {verdict.reason}: is a hole outside its part?"
        )
    return whole


def _polar(table: Table, index: int, row: dict[str, float]) -> tuple[float, float]:
    """Return x and y of a point by radius and angle, m."""
    for key, other in (POLAR, POLAR[::-1]):
        if key not in row:
            raise table.wrong(index, other, f"radius and angle together: a point has no {key}")
    for key in "xy":
        if key in row:
            raise table.wrong(index, key, f"{key} or radius and angle of a point, not both")
    radius = row["radius"]
    if radius < 0:
        raise table.wrong(index, "radius", "a radius that is not negative")
    angle = table.numbers["angle"]
    c, s = (float(x) for x in cosine_sine(angle.values[index], angle.unit))
    return radius * c, radius * s


def _part(
    table: Table, index: int, shape: str, row: dict[str, float], warnings: list[str], name: str
) -> tuple[float, Array]:
    """Return the mass of a part and its tensor along its own axes."""
    shapes = [*SHAPES, TENSOR, MESH]
    if shape not in shapes:
        expected = f"one of {', '.join(shapes)}{nearest(shape, shapes)}"
        raise table.error(index, "shape", table.texts["shape"][index], expected)
    needed = MOMENTS if shape == TENSOR else SHAPES[shape].dimensions
    optional = PRODUCTS if shape == TENSOR else SHAPES[shape].optional
    for dimension in needed:
        if dimension not in row:
            column = table.numbers[dimension].header if dimension in table.numbers else dimension
            raise table.error(index, column, "", f"a value: a {shape} needs {', '.join(needed)}")
    unused = [
        key for key in (*LENGTHS, "angle", *MOMENTS, *PRODUCTS) if key in row and key not in needed + optional
    ]
    if unused:
        warnings.append(f"{table.file}: part {quote(name)}: a {shape} has no {', '.join(unused)}: not used")
    dimensions = {key: row[key] for key in needed + optional if key in row}
    if shape != TENSOR:
        for key, value in dimensions.items():
            if value < 0 or (value == 0 and key != "inner_radius"):
                raise table.wrong(index, key, "a positive number")
        if dimensions.get("inner_radius", 0.0) > dimensions.get("radius", np.inf):
            raise table.wrong(index, "inner_radius", "no more than the radius")
    mass = _mass(table, index, shape, row, dimensions)
    if shape != TENSOR:
        formulas: Any = SHAPES[shape]  # they hold for plain numbers too, and those are faster one by one
        full = dict.fromkeys(formulas.optional, 0.0) | dimensions
        return mass, np.diag([mass * moment for moment in formulas.moments(**full)])
    own = tensor(*(row.get(key, 0.0) for key in (*MOMENTS, *PRODUCTS)))
    # a hole's tensor may be that of the material taken away, or have its sign already
    if mass < 0 and np.trace(own) > 0:
        own = -own
    return mass, own


def _check_tensors(
    table: Table, kept: list[int], shapes: list[str], mass: Array, inertia: Array
) -> Iterator[tuple[int, float]]:
    """Refuse a tensor of the table that no body can have; all at once, for one by one takes long.

    Yield the places of those that miss it by no more than their last printed digit, and by how much, kg·m².
    """
    places = [place for place, shape in enumerate(shapes) if shape == TENSOR]
    if not places:
        return
    tensors = inertia[places] * np.sign(mass[places])[:, None, None]
    verdict = check(tensors)
    for at in np.flatnonzero(~verdict.valid):
        index, by = kept[places[at]], -float(verdict.margin[at])
        # the digit's own rounding is no reason to refuse
        if not by <= _last_digit(table, index) * (1 + 1e-6):
            raise table.wrong(index, "ixx", f"a tensor that a body can have: {check(tensors[at]).reason}")
        yield places[at], by


def _broken(table: Table, index: int, name: str, by: float) -> str:
    return (
        f"{table.file}: part {quote(name)}: the tensor breaks the triangle inequality by {by:.3g} kg·m², "
        f"no more than its last printed digit ({_last_digit(table, index):.3g} kg·m²): taken as it is"
    )


def _last_digit(table: Table, index: int) -> float:
    """The last printed digit of a row's moments and products, the coarsest, kg·m²; a whole number is exact."""
    digits = [0.0]
    for key in (*MOMENTS, *PRODUCTS):
        if key in table.numbers:
            written = table.written(index, key)
            if "." in written or "," in written:
                digits.append(float(to_si(10.0 ** last_place(written), "inertia", table.numbers[key].unit)))
    return max(digits)


def _mesh(table: Table, index: int, row: dict[str, float], folder: Path) -> _Mesh:
    """Read the mesh of a part."""
    cell, unit = (table.named(name, "")[index] for name in ("file", "file_unit"))
    if not cell:
        raise table.error(index, "file", "", "the name of an STL or OBJ file")
    if unit not in UNITS["length"]:
        raise table.error(
            index, "file_unit", unit, f"the file's unit of length: {', '.join(UNITS['length'])}"
        )
    if ("mass" in row) == ("density" in row) or not row.get("density", 1.0) > 0 or row.get("mass", 1.0) == 0:
        raise table.error(index, "shape", MESH, "with it a mass, or a positive density_kg_m3")
    try:
        read, faces = load_mesh(str(note(folder / cell)))
        vertices = to_si(read, "length", unit)
        volume, center, inertia = mesh(vertices, faces)
    except ImportError:
        raise needs(f"{table.file}: a mesh", "trimesh", "mesh") from None
    except ValueError as error:
        raise table.error(index, "file", cell, f"a closed mesh: {error}") from None
    size = float(volume)
    density = row["density"] if "density" in row else row["mass"] / size
    return _Mesh(
        density * size,
        center,
        density * inertia,
        partial(_exact_mesh, read, unit, faces),
        vertices[faces] - center,
    )


def _exact_mesh(vertices: Array, unit: str, faces: NDArray[np.int64]) -> tuple[Any, Any, Any]:
    from dalembert.arithmetic.doubled_arrays import DoubledArray

    numerator, denominator = UNITS["length"][unit]
    return mesh(DoubledArray(vertices) * numerator / denominator, faces)


def _mass(table: Table, index: int, shape: str, row: dict[str, float], dimensions: dict[str, float]) -> float:
    densities = [key for key in DENSITIES.values() if key in row]
    if "mass" in row:
        if densities:
            raise table.wrong(index, densities[0], "mass or density, not both")
        return row["mass"]
    if not densities:
        raise table.error(index, "mass", "", "a mass, or a density where the shape has a volume")
    key = densities[0]
    if not row[key] > 0:
        raise table.wrong(index, key, "a positive density (a hole is a negative mass)")
    kind = 0 if shape == TENSOR else SHAPES[shape].thin
    if DENSITIES.get(kind) != key or len(densities) > 1:
        wanted = f"{DENSITIES[kind]} or mass" if kind else "mass"
        raise table.wrong(index, key, f"{wanted} for a {shape}")
    declared: Any = SHAPES[shape]
    mass = row[key] * float(declared.measure(**dict.fromkeys(declared.optional, 0.0) | dimensions))
    if mass == 0:
        raise table.wrong(index, key, "a mass that is not zero: this shape has no volume")
    return mass
