"""From corrections and the places where masses can go to the masses, in every form they are shown in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from balancing import Placement, drill_depth, place, place_from_stock
from cli.errors import DataError
from cli.render import Shown
from cli.units import degrees, from_si, phasor, to_si

PI = math.pi


@dataclass(frozen=True)
class Wanted:
    """What the options ask for; SI, angles in degrees."""

    places: list[float] | None
    limit: float | None
    stock: list[float] | None
    pieces: int
    max_pieces: int | None
    ratio: float
    """Radius of the corrections over that of the places."""
    drill: tuple[float, float, float] | None
    """Diameter, density, point angle in rad."""
    deepest: float | None
    remove: bool
    unit: str


def place_corrections(
    vectors: Sequence[tuple[tuple[float, str], tuple[float, str]]], wanted: Wanted
) -> Shown:
    """Combine the corrections, and place them."""
    target = sum(
        (
            complex(phasor(np.array(to_si(mass, "mass", unit)), np.array(angle), turn)[()])
            for (mass, unit), (angle, turn) in vectors
        ),
        0j,
    )
    largest = max(float(to_si(mass, "mass", unit)) for (mass, unit), _ in vectors)
    if abs(target) <= 1e-15 * largest:
        target = 0j  # what rounding leaves of corrections that cancel
    goal = target * wanted.ratio
    opposite = wanted.drill is not None and not wanted.remove
    if opposite:
        goal = -goal  # material is drilled out opposite
    warnings: list[str] = []
    if target == 0:
        warnings.append("the corrections add up to nothing: there is nothing to place")
    if wanted.places is None:
        placed = Placement(goal, np.array([np.angle(goal)]), np.array([abs(goal)]))
        places = [float(degrees(goal))]
        if wanted.limit is not None and abs(goal) > wanted.limit * (1 + 1e-12):
            raise DataError(
                f"the correction of {_show(abs(goal), wanted)} is beyond --max-mass {_show(wanted.limit, wanted)}, and "
                "there is one place only: expected --positions or --blades to spread it over"
            )
    else:
        places = wanted.places
        angles = np.radians(places)
        if wanted.stock is not None:
            try:
                placed = place_from_stock(
                    goal,
                    angles,
                    wanted.stock,
                    wanted.limit,
                    pieces=wanted.pieces,
                    max_pieces=wanted.max_pieces,
                )
            except ValueError as error:
                raise DataError(f"--stock: {error}") from None
            used = int((placed.masses > 0).sum())
            if used > 4 and wanted.max_pieces is None:
                few = place_from_stock(
                    goal, angles, wanted.stock, wanted.limit, pieces=wanted.pieces, max_pieces=3
                )
                warnings.append(
                    f"{used} places carry weights to come within {_show(abs(placed.error), wanted)}; with 3 weights the error "
                    f"would be {_show(abs(few.error), wanted)} (--max-pieces 3)"
                )
            if len(places) > 2 and placed.bound == 0 and abs(placed.error) > 1e-12 * abs(goal):
                warnings.append(
                    "too many choices to search them all: the places nearest to the correction were used"
                )
        else:
            placed = place(goal, angles, wanted.limit)
            if abs(placed.error) > 1e-9 * abs(goal):
                warnings.append(
                    f"the correction cannot be reached from these places{' with this --max-mass' if wanted.limit else ''}: an error "
                    f"of {_show(abs(placed.error), wanted)} is left, the least there is"
                )
    if opposite:
        warnings.append("material is drilled out opposite (+180°) to the mass that would be added")
    return _Placed(target, goal, placed, places, wanted, warnings).shown()


def _show(mass: float, wanted: Wanted) -> str:
    return f"{from_si(mass, 'mass', wanted.unit):.4g} {wanted.unit}"


@dataclass
class _Placed:
    """A placement with its drilling, ready to be shown."""

    target: complex
    goal: complex
    placed: Placement
    places: list[float]
    wanted: Wanted
    warnings: list[str]

    def __post_init__(self) -> None:
        masses = self.placed.masses
        self.used = [i for i, mass in enumerate(masses) if mass > 0]
        self.depth: list[float | None] = [None] * len(self.used)
        self.holes: list[int | None] = [None] * len(self.used)
        if self.wanted.drill is not None:
            for k, i in enumerate(self.used):
                self.depth[k], self.holes[k] = self._drilled(float(masses[i]))

    def _drilled(self, mass: float) -> tuple[float, int]:
        """Return the depth of each hole and how many there are."""
        assert self.wanted.drill is not None
        diameter, density, point = self.wanted.drill
        holes = 1
        depth = float(drill_depth(mass, diameter, density, point))
        if self.wanted.deepest is not None:
            while depth > self.wanted.deepest * (1 + 1e-12):
                # one hole's worth at a time; the first guess is close, the point takes a little more
                holes = max(holes + 1, math.ceil(holes * depth / self.wanted.deepest * (1 - 1e-9)) - 1)
                if holes > 10_000:
                    raise DataError(
                        "--max-depth: more than 10000 holes: expected a larger drill or deeper holes"
                    )
                depth = float(drill_depth(mass / holes, diameter, density, point))
        return depth, holes

    def _error(self) -> complex:
        error = self.placed.error
        return error if abs(error) > 1e-14 * abs(self.goal) else 0j

    def shown(self) -> Shown:
        unit = self.wanted.unit
        columns: dict[str, Any] = {
            "position": [str(i + 1) for i in self.used],
            "angle_deg": [self._angle(i) for i in self.used],
            f"mass_{unit}": [float(from_si(self.placed.masses[i], "mass", unit)) for i in self.used],
        }
        if self.wanted.drill is not None:
            columns["drill_depth_mm"] = [float(from_si(depth, "length", "mm")) for depth in self.depth]
            columns["holes"] = self.holes
        return Shown(
            document=self.document,
            columns=columns,
            keys=("position",),
            notes=self.notes,
            afterword=self.afterword,
            figure=self.figure,
            warnings=self.warnings,
        )

    def _angle(self, i: int) -> float:
        return self.places[i] % 360.0 if self.wanted.places is not None else self.places[i]

    def document(self) -> dict[str, Any]:
        error = self._error()
        total = self.placed.total
        return {
            "target": {"mass_kg": abs(self.target), "angle_deg": float(degrees(self.target))},
            "masses": [
                {
                    "position": str(i + 1),
                    "angle_deg": self._angle(i),
                    "mass_kg": float(self.placed.masses[i]),
                    "drill_depth_m": depth,
                    "holes": holes,
                }
                for i, depth, holes in zip(self.used, self.depth, self.holes, strict=True)
            ],
            "error_kg": abs(error),
            "error_angle_deg": float(degrees(error)),
            "total": {"mass_kg": abs(total), "angle_deg": float(degrees(total))},
            "action": "remove" if self.wanted.remove or self.wanted.drill is not None else "add",
        }

    def notes(self) -> str:
        lines = [
            f"correction: {_show(abs(self.target), self.wanted)} at {degrees(self.target):.4g}° (angles counter-clockwise)"
        ]
        if self.wanted.ratio != 1:
            lines.append(f"at the other radius: {_show(abs(self.goal), self.wanted)}")
        remove = self.wanted.remove or self.wanted.drill is not None
        return "\n".join([*lines, f"material to {'REMOVE' if remove else 'ADD'}:"])

    def afterword(self) -> str:
        error = self._error()
        share = f" ({abs(error) / abs(self.goal):.3%} of the correction)" if self.goal else ""
        return f"error: {_show(abs(error), self.wanted)} at {degrees(error):.4g}°{share}"

    def figure(self) -> Any:
        from cli.plots.place import draw

        unit = self.wanted.unit
        return draw(
            [self._angle(i) for i in range(len(self.places))],
            [float(m) for m in from_si(self.placed.masses, "mass", unit)],
            from_si(self.goal, "mass", unit),
            from_si(self.placed.total, "mass", unit),
            unit,
            removed=self.wanted.remove or self.wanted.drill is not None,
        )
