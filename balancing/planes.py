"""Correction planes: their names, places and radii, from a table too."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dalembert.dataclass import dataclass
from dalembert.errors import DataError, quote
from dalembert.tables.table import read
from dalembert.units import SMALLEST


@dataclass(frozen=True, eq=False, repr=False)
class Planes:
    """Correction planes, in SI; `rotor` names each plane's rotor where they differ from rotor to rotor."""

    name: list[str]
    z: NDArray[np.float64] | None
    radius: NDArray[np.float64]
    z_unit: str
    radius_unit: str
    file: str = "--plane"
    rotor: list[str] | None = None

    @property
    def several(self) -> bool:
        """Whether any rotor has more than one plane: then the axial positions count."""
        owners = self.rotor or ["" for _ in self.name]
        return len(set(owners)) < len(owners)

    def rows(self, rotors: Sequence[str], table: str) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return for each rotor the number of its first plane and how many it has.

        Raises DataError where a rotor has no plane, or a plane's rotor is not in the table.
        """
        if self.rotor is None:
            return np.zeros(len(rotors), dtype=np.intp), np.full(len(rotors), len(self.name))
        count: dict[str, int] = {}
        for owner in self.rotor:
            count[owner] = count.get(owner, 0) + 1
        if strange := count.keys() - set(rotors):
            raise DataError(f"{self.file}: planes for rotor {quote(min(strange))}, which {table} lacks")
        start = dict(zip(count, np.cumsum([0, *count.values()]).tolist(), strict=False))
        for rotor in rotors:
            if rotor not in count:
                raise DataError(
                    f"{self.file}: no plane for rotor {quote(rotor)} of {table}: expected at least one"
                )
        return np.array([start[r] for r in rotors], dtype=np.intp), np.array(
            [count[r] for r in rotors], dtype=np.intp
        )

    def same_place(self, among: range) -> str:
        """Say which two of these planes lie at one place; empty where none do."""
        if self.z is None:
            return ""
        seen: dict[float, int] = {}
        for index in among:
            other = seen.setdefault(float(self.z[index]), index)
            if other != index:
                of = f" of rotor {quote(self.rotor[other])}" if self.rotor else ""
                return (
                    f"the planes {self.name[other]} and {self.name[index]}{of} lie at the same place, z = {self.z[other]:g} m: "
                    "together they cannot correct a couple; expected different places"
                )
        return ""


def read_planes(path: str) -> Planes:
    """Read a table with the columns plane, radius_* and, but for single planes, z_*; rotor where they differ.

    Raises
    ------
    DataError
        A plane that stands twice, no place along the axis where there are several planes, two planes at one place.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder, "planes.csv")
    ...     _ = table.write_text("plane,z_mm,radius_mm\\nA,0,20\\nB,90,20\\n")
    ...     planes = read_planes(str(table))
    >>> planes.name, planes.z, planes.several
    (['A', 'B'], array([0.  , 0.09]), True)
    """
    needed = [("plane",), ("radius",)]
    table = read(path, numbers={"z": "length", "radius": "length"}, texts=["plane", "rotor"], needed=needed)
    names, rotor = table.needed("plane"), table.texts.get("rotor")
    radius = table.require("radius", "length")
    table.reject(~(radius.values >= SMALLEST), "radius", "a positive radius")
    owners = rotor or [""] * len(names)
    seen: set[tuple[str, str]] = set()
    for index, named in enumerate(zip(owners, names, strict=True)):
        if named in seen:
            of = f" for rotor {quote(named[0])}" if rotor else ""
            raise table.error(index, "plane", names[index], f"each plane once{of}")
        seen.add(named)
    if len(set(owners)) < len(owners):
        table.require("z", "length")
    z = table.numbers.get("z")
    # the planes of a rotor stand together, rotors in the order in which they first stand
    order = np.argsort(table.numbered("rotor")[1], kind="stable").tolist()
    planes = Planes(
        [names[i] for i in order],
        z.si[order] if z else None,
        radius.si[order],
        z.unit if z else "",
        radius.unit,
        table.file,
        [owners[i] for i in order] if rotor else None,
    )
    start = 0
    for stop in range(1, len(names) + 1):
        if stop == len(names) or (planes.rotor and planes.rotor[stop] != planes.rotor[start]):
            if two := planes.same_place(range(start, stop)):
                raise DataError(f"{table.file}: {two}")
            start = stop
    return planes
