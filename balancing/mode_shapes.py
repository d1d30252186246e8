"""Mode shapes at stations along the shaft, from a table: the sums that must vanish at masses and planes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from balancing.modal import UnreachedMode, shapes_at
from dalembert.errors import DataError, quote
from dalembert.tables.headers import Heading
from dalembert.tables.sources import Source
from dalembert.tables.table import read
from dalembert.units import parted

if TYPE_CHECKING:
    from dalembert.arithmetic.doubled_arrays import DoubledArray

Real = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Modes:
    """Mode shapes at stations along the shaft, and what else is to vanish."""

    file: str
    names: list[str]
    z: Real
    shapes: Real
    """(k, n)."""
    rigid: bool
    """Whether force and couple are to vanish too."""
    warnings: list[str]
    exact: Callable[[], tuple[DoubledArray, DoubledArray]]
    """Stations and shapes in 32 digits, as the file has them."""

    @property
    def conditions(self) -> list[str]:
        """The sums that must vanish."""
        return [*(["force", "couple"] if self.rigid else []), *(f"mode {name}" for name in self.names)]

    @property
    def shaft(self) -> tuple[float, float] | None:
        """Middle and length of the shaft, in which the couple is of the size of the force; None where both may stay."""
        low, high = float(self.z[0]), float(self.z[-1])
        return ((low + high) / 2, high - low) if self.rigid else None

    def at(self, z: Real, what: str) -> Real:
        """Return the rows of the conditions at places (...): (..., q, m)."""
        low, high = float(self.z[0]), float(self.z[-1])
        slack = 1e-9 * (high - low)
        beyond = (z < low - slack) | (z > high + slack)
        if beyond.any():
            place = float(z[beyond][0])
            raise DataError(
                f"{self.file}: the shapes reach from z = {low:g} m to {high:g} m, {what} stands at {place:g} m: expected shapes "
                "along the whole shaft"
            )
        shapes = np.moveaxis(shapes_at(self.z, self.shapes, np.clip(z, low, high)), 0, -2)
        if self.shaft is None:
            return shapes
        middle, length = self.shaft
        arm = (z - middle) / length
        return np.concatenate([np.ones_like(arm)[..., None, :], arm[..., None, :], shapes], axis=-2)

    def exactly_at(self, z: DoubledArray) -> DoubledArray:
        """Return the same rows in 32 digits."""
        from dalembert.arithmetic.doubled_splines import Spline

        x, y = self.exact()
        rows = [Spline(x, shape).at(z) for shape in y]
        if self.rigid:
            arm: Any = (z - (x[0] + x[-1]) / 2.0) / (x[-1] - x[0])
            rows = [arm * 0.0 + 1.0, arm, *rows]
        stacked: Any = np.stack
        return stacked(rows, axis=-2)  # type: ignore[no-any-return]

    def unreached(self, error: UnreachedMode) -> str:
        """Say on which conditions the planes do not act."""
        left = [
            name for name, share in zip(self.conditions, error.combination, strict=True) if abs(share) > 1e-6
        ]
        if len(left) == 1:
            return f"the planes do not act on {left[0]}: they lie at its nodes; expected a plane elsewhere"
        return f"the planes cannot balance {', '.join(left)} independently: expected planes at other places"


def read_modes(path: str, count: int | None = None, rigid: bool = False) -> Modes:
    """Read mode shapes: `z_*` and a column for each mode, or rows of `mode, z_*, shape`.

    Parameters
    ----------
    path : str
        CSV or workbook.
    count : int, optional
        The number of modes, from the first on; all of them where it is None.
    rigid : bool
        Whether force and couple are to vanish too.

    Raises
    ------
    DataError
        A mode that stands twice at a station, has none there, or is zero; fewer than two stations.
    ValueError
        The table has fewer modes than `count`.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder, "modes.csv")
    ...     _ = table.write_text("z_mm,1,2\\n0,0,0\\n250,1,1\\n500,0,-1\\n")
    ...     modes = read_modes(str(table), rigid=True)
    >>> modes.conditions, modes.shapes
    (['force', 'couple', 'mode 1', 'mode 2'], array([[ 0.,  1.,  0.],
           [ 0.,  1., -1.]]))
    >>> modes.at(np.array([0.25]), "a mass").round(3).ravel()
    array([1., 0., 1., 1.])
    """
    table = read(path, numbers={"z": "length", "shape": "number"}, texts=["mode"], layout=_by_mode)
    z, shape = table.require("z", "length").si, table.require("shape", "number").values
    names, code = table.numbered("mode", "1")
    if count is not None:
        if count > len(names):
            raise ValueError(f"{count}: {table.file} has {len(names)} modes")
        names = names[:count]
    stations = np.unique(z)
    shapes = np.full((len(names), len(stations)), np.nan)
    at = np.searchsorted(stations, z)
    for i, (k, j) in enumerate(zip(code.tolist(), at.tolist(), strict=True)):
        if k >= len(names):
            continue
        if shapes[k, j] == shapes[k, j]:
            raise DataError(
                f"{table.file}: mode {quote(names[k])} stands twice at z = {stations[j]:g} m: expected it once"
            )
        shapes[k, j] = shape[i]
    for k, name in enumerate(names):
        if np.isnan(shapes[k]).any():
            place = stations[np.isnan(shapes[k])][0]
            raise DataError(
                f"{table.file}: no shape of mode {quote(name)} at z = {place:g} m: expected every mode at every station"
            )
        if not shapes[k].any():
            raise DataError(f"{table.file}: mode {quote(name)} is zero everywhere: expected a shape")
    if len(stations) < 2:
        raise DataError(f"{table.file}: one station along the shaft: expected two at least")

    def exact() -> tuple[DoubledArray, DoubledArray]:
        from dalembert.arithmetic.doubled_fractions import exactly

        places, values = table.numbers["z"].exact, table.numbers["shape"].exact
        there = dict(zip(at.tolist(), places, strict=True))
        of = {(k, j): values[i] for i, (k, j) in enumerate(zip(code.tolist(), at.tolist(), strict=True))}
        every = [of[k, j] for k in range(len(names)) for j in range(len(stations))]
        x = exactly([there[j] for j in range(len(stations))], stations.shape)
        return x, exactly(every, shapes.shape)

    return Modes(table.file, names, stations, shapes, rigid, table.warnings, exact)


def _by_mode(source: Source) -> Source:
    """Bring a column for each mode to a row for each station and mode."""
    if any(each.name.lower() in ("shape", "mode") for each in source.headings):
        return source
    place = next((k for k, each in enumerate(source.headings) if _stem(each) == "z"), None)
    if place is None:
        return source
    modes = [k for k, each in enumerate(source.headings) if k != place and each.written]
    if not modes:
        raise DataError(f"{source.file}: no column of a mode: expected z_* and a column for each mode")
    source.check_cells([place, *modes])
    named = {k: source.headings[k].written.removeprefix("mode_") for k in modes}
    rows = [
        (line, [name, cells[place], cells[k]]) for line, cells in source.rows() for k, name in named.items()
    ]
    rows.sort(key=lambda row: list(named.values()).index(row[1][0]))
    headings = [Heading("mode", "mode"), source.headings[place], Heading("shape", "shape")]
    return source.laid_out(headings, rows)


def _stem(heading: Heading) -> str:
    """Return a heading without its unit."""
    return (heading.base if heading.unit else parted(heading.name)[0]).strip().lower()
