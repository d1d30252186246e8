"""From corrections and the places where masses can go to the masses, in every form they are shown in."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from balancing import Placement, correct, drill_depth, place, place_from_stock, transfer
from cli.errors import DataError
from cli.read.rounding import EPS, angle_error, size_error, vector_error
from cli.read.units import degrees, from_si, phasor, to_si
from cli.show.shown import Shown
from cli.show.text import angle_text

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
    planes: tuple[float, list[float]] | None
    """Where along the shaft the corrections are, and the planes they are carried over to, m."""
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
    wrong = float(
        sum(vector_error(to_si(mass, "mass", unit), angle, turn) for (mass, unit), (angle, turn) in vectors)
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
    goals: list[tuple[float | None, complex]] = [(None, goal)]
    if wanted.planes is not None:
        at, planes = wanted.planes
        goals = list(zip(planes, transfer([goal], [at], planes).tolist(), strict=True))
    shares = [_place(z, share, wanted, warnings) for z, share in goals]

    def goal_errors() -> list[float]:
        """Bounds of the errors of the goals, in the shares' order."""
        of_goal = (wrong + (len(vectors) + 4) * EPS * largest) * wanted.ratio
        if wanted.planes is None:
            return [of_goal]
        at, planes = wanted.planes
        # positions as written, and the lever's arms, are rounded too
        over = correct([goal], [at], planes)
        arms = np.array(planes)
        reach = float(np.abs([at, *planes]).max() / np.ptp(arms))
        bound = over.error_estimate() + float(over.amplification) * (of_goal + 4 * EPS * reach * abs(goal))
        return [float(x) for x in bound]

    if opposite:
        warnings.append("material is drilled out opposite (+180°) to the mass that would be added")
    return _Placed(target, shares, wanted, warnings, goal_errors).shown()


@dataclass(frozen=True)
class _Share:
    """What goes into one plane."""

    z: float | None
    goal: complex
    places: list[float]
    placed: Placement

    @property
    def error(self) -> complex:
        error = self.placed.error
        return error if abs(error) > 1e-14 * abs(self.goal) else 0j


def _place(z: float | None, goal: complex, wanted: Wanted, warnings: list[str]) -> _Share:
    """Place what goes into one plane."""
    if wanted.places is None:
        if wanted.limit is not None and abs(goal) > wanted.limit * (1 + 1e-12):
            raise DataError(
                f"the correction of {_show(abs(goal), wanted)} is beyond --max-mass {_show(wanted.limit, wanted)}, and "
                "there is one place only: expected --positions or --blades to spread it over"
            )
        alone = Placement(goal, np.array([np.angle(goal)]), np.array([abs(goal)]))
        return _Share(z, goal, [float(degrees(goal))], alone)
    angles = np.radians(wanted.places)
    if wanted.stock is None:
        placed = place(goal, angles, wanted.limit)
        if abs(placed.error) > 1e-9 * abs(goal):
            limited = " with this --max-mass" if wanted.limit else ""
            warnings.append(
                f"the correction cannot be reached from these places{limited}: an error of "
                f"{_show(abs(placed.error), wanted)} is left, the least there is"
            )
        return _Share(z, goal, wanted.places, placed)

    def choose(most: int | None) -> Placement:
        assert wanted.stock is not None
        return place_from_stock(
            goal, angles, wanted.stock, wanted.limit, pieces=wanted.pieces, max_pieces=most
        )

    try:
        placed = choose(wanted.max_pieces)
    except ValueError as error:
        raise DataError(f"--stock: {error}") from None
    used = int((placed.masses > 0).sum())
    if used > 4 and wanted.max_pieces is None:
        warnings.append(
            f"{used} places carry weights to come within {_show(abs(placed.error), wanted)}; with 3 weights the error "
            f"would be {_show(abs(choose(3).error), wanted)} (--max-pieces 3)"
        )
    if len(wanted.places) > 2 and placed.bound == 0 and abs(placed.error) > 1e-12 * abs(goal):
        warnings.append("too many choices to search them all: the places nearest to the correction were used")
    return _Share(z, goal, wanted.places, placed)


def _show(mass: float, wanted: Wanted) -> str:
    return f"{from_si(mass, 'mass', wanted.unit):.4g} {wanted.unit}"


@dataclass
class _Placed:
    """A placement with its drilling, ready to be shown."""

    target: complex
    shares: list[_Share]
    wanted: Wanted
    warnings: list[str]
    goal_errors: Callable[[], list[float]]

    def __post_init__(self) -> None:
        self.used = [
            (share, i) for share in self.shares for i, mass in enumerate(share.placed.masses) if mass > 0
        ]
        self.mass = [float(share.placed.masses[i]) for share, i in self.used]
        self.angle = [share.places[i] % 360.0 for share, i in self.used]
        self.depth: list[float | None] = [None] * len(self.used)
        self.holes: list[int | None] = [None] * len(self.used)
        if self.wanted.drill is not None:
            for k, mass in enumerate(self.mass):
                self.depth[k], self.holes[k] = self._drilled(mass)
        # of several planes the largest error
        self.error = max((share.error for share in self.shares), key=abs)

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

    def shown(self) -> Shown:
        unit = self.wanted.unit
        columns: dict[str, Any] = {}
        if self.wanted.planes is not None:
            columns["z_mm"] = [from_si(share.z or 0.0, "length", "mm") for share, _ in self.used]
        columns |= {
            "position": [str(i + 1) for _, i in self.used],
            "angle_deg": self.angle,
            f"mass_{unit}": [float(from_si(mass, "mass", unit)) for mass in self.mass],
        }
        if self.wanted.drill is not None:
            columns["drill_depth_mm"] = [from_si(depth or 0.0, "length", "mm") for depth in self.depth]
            columns["holes"] = self.holes
        return Shown(
            document=self.document,
            columns=columns,
            keys=("position",) if self.wanted.planes is None else (),
            notes=self.notes,
            afterword=self.afterword,
            figure=self.figure,
            errors=self.errors,
            warnings=self.warnings,
        )

    def errors(self) -> dict[str, Any]:
        """Bounds of the rounding errors of the columns."""
        unit, places = self.wanted.unit, self.wanted.places
        of_goal = dict(zip(map(id, self.shares), self.goal_errors(), strict=True))
        bounds, turns = [], []
        for share, i in self.used:
            placed, wrong = share.placed, of_goal[id(share)]
            if places is None:
                bounds.append(float(size_error(share.goal, wrong)))
                turns.append(float(angle_error(share.goal, wrong, share.places[i] % 360.0)))
                continue
            # a place as written is rounded, as a share of a turn, and takes the whole with it
            of_arm = EPS * (2 + np.abs(np.radians(places)).max())
            terms = abs(share.goal) + float(placed.masses.sum())
            growth = placed.condition_number if i in placed.free else 0.0
            bound = placed.error_estimate()[i] + growth * (wrong + of_arm * terms)
            bounds.append(float(size_error(placed.masses[i], bound)))
            turns.append(2 * EPS * (360 + abs(places[i])))
        out: dict[str, Any] = {
            "angle_deg": turns,
            f"mass_{unit}": [float(from_si(bound, "mass", unit)) for bound in bounds],
        }
        if self.wanted.drill is not None:
            diameter, _, point = self.wanted.drill
            deep = []
            for depth, mass, bound in zip(self.depth, self.mass, bounds, strict=True):
                assert depth is not None
                # a depth grows no faster than the mass; the point's angle as written is rounded, times the radius
                rounded = 8 * EPS * (depth + diameter * point)
                deep.append(float(from_si(depth * bound / mass + rounded, "length", "mm")))
            out["drill_depth_mm"] = deep
        return out

    def document(self) -> dict[str, Any]:
        masses = [
            {
                "position": str(i + 1),
                "angle_deg": angle,
                "mass_kg": mass,
                "drill_depth_m": depth,
                "holes": holes,
            }
            | ({} if self.wanted.planes is None else {"z_m": share.z})
            for (share, i), angle, mass, depth, holes in zip(
                self.used, self.angle, self.mass, self.depth, self.holes, strict=True
            )
        ]
        return {
            "target": {"mass_kg": abs(self.target), "angle_deg": float(degrees(self.target))},
            "masses": masses,
            "error_kg": abs(self.error),
            "error_angle_deg": float(degrees(self.error)),
            "action": "remove" if self.wanted.remove or self.wanted.drill is not None else "add",
        }

    def notes(self) -> str:
        lines = [
            f"correction: {_show(abs(self.target), self.wanted)} at {angle_text(degrees(self.target), '.4g')}° (angles counter-clockwise)"
        ]
        if self.wanted.ratio != 1:
            lines.append(f"at the other radius: {_show(abs(self.target) * self.wanted.ratio, self.wanted)}")
        for share in self.shares:
            if share.z is not None:
                lines.append(
                    f"in the plane z = {from_si(share.z, 'length', 'mm'):g} mm: {_show(abs(share.goal), self.wanted)} at "
                    f"{angle_text(degrees(share.goal), '.4g')}°"
                )
        remove = self.wanted.remove or self.wanted.drill is not None
        return "\n".join([*lines, f"material to {'REMOVE' if remove else 'ADD'}:"])

    def afterword(self) -> str:
        whole = max(abs(share.goal) for share in self.shares)
        share = f" ({abs(self.error) / whole:.3%} of the correction)" if whole else ""
        return f"error: {_show(abs(self.error), self.wanted)} at {angle_text(degrees(self.error), '.4g')}°{share}"

    def figure(self) -> Any:
        from cli.plots.place import draw

        unit = self.wanted.unit
        return draw(
            [
                (
                    "" if share.z is None else f"z = {from_si(share.z, 'length', 'mm'):g} mm: ",
                    [angle % 360.0 for angle in share.places],
                    [float(m) for m in from_si(share.placed.masses, "mass", unit)],
                    complex(from_si(share.goal, "mass", unit)),
                    complex(from_si(share.placed.total, "mass", unit)),
                )
                for share in self.shares
            ],
            unit,
            removed=self.wanted.remove or self.wanted.drill is not None,
        )
