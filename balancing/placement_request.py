"""Corrections, from vectors or from a file, put where masses can go; the holes that remove as much."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing.placement import Placement, drill_depth, place, transfer
from balancing.weights import ENOUGH, fewest_from_stock, place_from_stock, place_weights
from dalembert.angles import degrees, in_turn, phasor
from dalembert.errors import DataError, quote
from dalembert.tables.files import read_bytes, remember
from dalembert.units import from_si, to_si

Real = NDArray[np.float64]
HOLES = 10_000  # more at one place are refused


class Vector(NamedTuple):
    """A mass at an angle, in the units of the input."""

    mass: float
    mass_unit: str
    angle: float
    angle_unit: str

    @property
    def in_si(self) -> complex:
        """m·e^{iθ}, kg."""
        mass = np.array(to_si(self.mass, "mass", self.mass_unit))
        return complex(phasor(mass, np.array(self.angle), self.angle_unit))


class Drill(NamedTuple):
    """The drill that removes material, in SI."""

    diameter: float
    density: float
    point: float
    """Point angle, rad."""
    max_depth: float | None
    exact_point: Fraction
    """Point angle as written, degrees."""


@dataclass(frozen=True)
class Request:
    """Where masses can go, and how; angles in degrees, the rest in SI."""

    places: list[float] | None
    limit: float | None
    """Largest mass of a place."""
    stock: list[float] | None
    weights: list[float] | None
    """Weights of fixed mass, at any angle."""
    pieces: int
    max_pieces: int | None
    radii: tuple[float, float] | None
    """Radius of the corrections, radius of the places."""
    drill: Drill | None
    planes: tuple[float, list[float]] | None
    """Axial position of the corrections, axial positions of the new planes."""
    remove: bool
    exact_places: Callable[[], list[Fraction]]
    """The angles of the places as written, degrees."""

    @property
    def ratio(self) -> float:
        """Radius of the corrections over that of the places."""
        return 1.0 if self.radii is None else self.radii[0] / self.radii[1]

    @property
    def removes(self) -> bool:
        """Whether the masses are material to remove."""
        return self.remove or self.drill is not None


class Correction(NamedTuple):
    """A correction: the sum of vectors, or that of one plane of one rotor in a file."""

    rotor: str
    plane: str
    vectors: list[Vector]
    removed: bool = False
    """Whether the file has it as material to remove."""

    @property
    def unit(self) -> str:
        """The unit of the masses in the result."""
        return self.vectors[0].mass_unit

    @property
    def name(self) -> str:
        """Rotor and plane, to name it among several corrections."""
        return f"rotor {self.rotor}, plane {self.plane}"


def read_corrections(path: str, rotor: str | None = None, plane: str | None = None) -> list[Correction]:
    """Read the corrections of a file that `dalembert field` wrote: its JSON, or a table with mass, angle, rotor, plane.

    Parameters
    ----------
    path : str
    rotor, plane : str, optional
        Which of them alone; all of them where None.

    Raises
    ------
    DataError
        The file cannot be read, or has no such correction.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     table = Path(folder, "corrections.csv")
    ...     _ = table.write_text("plane,mass_g,angle_deg\\nA,3,90\\nB,2,180\\n")
    ...     (correction,) = read_corrections(str(table), plane="B")
    >>> correction.name, correction.vectors[0]
    ('rotor 1, plane B', Vector(mass=2.0, mass_unit='g', angle=180.0, angle_unit='deg'))
    """
    corrections = _from_json(path) if path.lower().endswith(".json") else _from_table(path)
    for noun, wanted, field in (("rotor", rotor, 0), ("plane", plane, 1)):
        if wanted is None:
            continue
        names = dict.fromkeys(str(each[field]) for each in corrections)
        corrections = [each for each in corrections if each[field] == wanted]
        if not corrections:
            raise DataError(f"{path}: no {noun} {quote(wanted)}: expected one of {', '.join(names)}")
    return corrections


def _from_table(path: str) -> list[Correction]:
    from dalembert.tables.table import read

    # columns of a table of corrections that are not used here: no warning
    further = {"mass_uncertainty": "mass", "angle_uncertainty": "angle", "z": "length", "radius": "length"}
    further |= {"trim_mass": "mass", "trim_angle": "angle"}
    table = read(
        path,
        numbers={"mass": "mass", "angle": "angle", "unbalance": "unbalance", "weight": "force", **further},
        texts=["rotor", "plane"],
        blank=list(further),
    )
    if "mass" not in table.numbers and "unbalance" in table.numbers:
        raise DataError(
            f"{table.file}: corrections as unbalances: expected masses, as trial masses in the runs give them"
        )
    mass, angle = table.require("mass", "mass"), table.require("angle", "angle")
    table.reject(mass.values < 0, "mass", "a mass that is not negative")
    names = [table.named(name) for name in ("rotor", "plane")]
    return [
        Correction(rotor, plane, [Vector(m, mass.unit, a, angle.unit)])
        for rotor, plane, m, a in zip(*names, mass.values.tolist(), angle.values.tolist(), strict=True)
    ]


def _from_json(path: str) -> list[Correction]:
    import json

    remember(path)
    file, data = read_bytes(path)
    try:
        document = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise DataError(f"{file}: no valid JSON: {error}") from None
    try:
        removed = document.get("correction") == "remove"
        corrections = [
            Correction(str(rotor["rotor"]), str(one["plane"]), [_vector(one)], removed)
            for rotor in document["rotors"]
            for one in rotor["corrections"]
        ]
    except (AttributeError, KeyError, TypeError, ValueError):
        corrections = []
    if not corrections:
        raise DataError(
            f"{file}: no corrections with plane, mass_kg and angle_deg below rotors: expected the JSON of dalembert field"
        )
    return corrections


def _vector(one: Mapping[str, str | float]) -> Vector:
    mass, angle = float(one["mass_kg"]), float(one["angle_deg"])
    if not (0 <= mass <= 1e60 and abs(angle) <= 1e60):
        raise ValueError
    return Vector(mass, "kg", angle, "deg")


@dataclass(frozen=True)
class Share:
    """The correction of one plane, and the masses that make it."""

    z: float | None
    goal: complex
    places: list[float]
    placed: Placement

    @property
    def error(self) -> complex:
        """The error of the masses; zero where it is rounding."""
        error = self.placed.error
        return error if abs(error) > 1e-14 * max(abs(self.goal), float(self.placed.masses.sum())) else 0j


class Placed(NamedTuple):
    """A mass on a place (its number from 0), and the holes that remove it."""

    share: Share
    place: int
    mass: float
    angle: float
    depth: float | None
    holes: int | None


class Placing:
    """A correction placed on request: a share for each plane, the masses, what to warn of.

    Raises
    ------
    DataError
        One place cannot bear the correction; the weights in stock do not do; too many holes.

    Examples
    --------
    10 g at 45° on two places beside it, by the sine rule 7.07 g each:

    >>> angles = [0.0, 90.0]
    >>> request = Request(angles, None, None, None, 1, None, None, None, None, False, lambda: [])
    >>> placing = Placing(Correction("1", "A", [Vector(10.0, "g", 45.0, "deg")]), request)
    >>> [(each.angle, round(1000 * each.mass, 2)) for each in placing.masses]
    [(0.0, 7.07), (90.0, 7.07)]
    """

    def __init__(self, correction: Correction, request: Request) -> None:
        self.correction, self.request = correction, request
        self.warnings: list[str] = []
        self.vectors = [v.in_si for v in correction.vectors]
        self.target = sum(self.vectors, 0j)
        if abs(self.target) <= 1e-15 * max(map(abs, self.vectors)):
            self.target = 0j  # the rest of corrections that cancel is rounding
        self.opposite = request.drill is not None and not request.remove
        goal = -self.target * request.ratio if self.opposite else self.target * request.ratio
        if self.target == 0:
            rest = (
                "there is nothing to place"
                if not request.weights
                else "the weights are set against each other"
            )
            self.warnings.append(f"the corrections add up to nothing: {rest}")
        goals: list[tuple[float | None, complex]] = [(None, goal)]
        if request.planes is not None:
            at, planes = request.planes
            goals = list(zip(planes, transfer([goal], [at], planes).tolist(), strict=True))
        self.shares = [Share(z, goal, *self._place(goal)) for z, goal in goals]
        if self.opposite:
            self.warnings.append("material is drilled out opposite (+180°) to the mass that would be added")
        self.masses = [
            Placed(share, i, float(mass), in_turn(share.places[i]), *_drilled(float(mass), request.drill))
            for share in self.shares
            for i, mass in enumerate(share.placed.masses)
            if mass > 0
        ]
        # the largest of the planes
        self.error = max((share.error for share in self.shares), key=abs)

    @property
    def action(self) -> str:
        """Whether material is added or removed: `add` or `remove`."""
        return "remove" if self.request.removes else "add"

    def text(self, mass: float) -> str:
        """Return a mass as text, in the unit of the result."""
        return f"{from_si(mass, 'mass', self.correction.unit):.4g} {self.correction.unit}"

    def _place(self, goal: complex) -> tuple[list[float], Placement]:
        """Place the correction of one plane: the angles of the places in degrees, and the masses on them."""
        request = self.request
        if request.weights is not None:
            return self._at_any_angle(goal, request.weights)
        if request.places is None:
            if request.limit is not None and abs(goal) > request.limit * (1 + 1e-12):
                raise DataError(
                    f"the correction of {self.text(abs(goal))} is beyond --max-mass {self.text(request.limit)}, and "
                    "there is only one place: expected --positions or --blades, to divide it among several places"
                )
            alone = Placement(goal, np.array([np.angle(goal)]), np.array([abs(goal)]))
            return [degrees(goal)], alone
        angles = np.radians(request.places)
        if request.stock is not None:
            return request.places, self._from_stock(goal, request.stock, angles)
        placed = place(goal, angles, request.limit)
        if abs(placed.error) > 1e-9 * abs(goal):
            limited = " with this --max-mass" if request.limit else ""
            self.warnings.append(
                f"the correction cannot be reached from these places{limited}: the least possible error is "
                f"{self.text(abs(placed.error))}"
            )
        return request.places, placed

    def _from_stock(self, goal: complex, stock: list[float], angles: Real) -> Placement:
        request = self.request
        try:
            if request.max_pieces is None:
                placed = self._fewest(goal, angles, stock)
            else:
                most = request.max_pieces
                placed = place_from_stock(
                    goal, angles, stock, request.limit, pieces=request.pieces, max_pieces=most
                )
                self._warn_of_error(
                    f"at most {most} weight{'s' * (most != 1)} leave{'s' * (most == 1)}", placed
                )
        except ValueError as error:
            raise DataError(f"--stock: {error}") from None
        if len(angles) > 2 and placed.bound == 0 and abs(placed.error) > 1e-12 * abs(goal):
            self.warnings.append(
                "too many choices to compare all of them: only the places nearest to the correction were used"
            )
        return placed

    def _fewest(self, goal: complex, angles: Real, stock: list[float]) -> Placement:
        """Use the fewest weights with a small error; the warning gives the error with one more."""
        request = self.request
        choice = fewest_from_stock(goal, angles, stock, request.limit, pieces=request.pieces)
        placed, used, more = choice.placed, choice.used, choice.tried + 1
        further = place_from_stock(
            goal, angles, stock, request.limit, pieces=request.pieces, max_pieces=more
        ).error
        weights = f"{used} weight{'s' * (used != 1)} leave{'s' * (used == 1)}"
        if goal and abs(further) < abs(placed.error) - 1e-12 * abs(goal):
            self.warnings.append(
                f"{weights} {self._error_text(placed)}; with {more} it would be {self.text(abs(further))} (--max-pieces {more})"
            )
        else:
            self._warn_of_error(weights, placed, "; one more does not make it smaller")
        return placed

    def _error_text(self, placed: Placement) -> str:
        """The error of weights from stock, as mass and in percent of the correction."""
        error = abs(placed.error)
        return f"an error of {self.text(error)} ({error / abs(placed.target):.2%})"

    def _warn_of_error(self, weights: str, placed: Placement, more: str = "") -> None:
        """Warn of an error of weights from stock that is large."""
        if abs(placed.error) > ENOUGH * abs(placed.target):
            self.warnings.append(f"{weights} {self._error_text(placed)}{more}")

    def _at_any_angle(self, goal: complex, weights: list[float]) -> tuple[list[float], Placement]:
        """Find the angles of weights of fixed mass, in degrees."""
        placed = place_weights(goal, weights)
        if placed.bound:
            whole = sum(weights)
            reach = (
                f"{self.text(whole)} at most"
                if abs(goal) > whole
                else f"{self.text(abs(placed.total))} at least"
            )
            self.warnings.append(
                f"the weights together make {reach}: the correction of {self.text(abs(goal))} is missed by "
                f"{self.text(placed.bound)}"
            )
        return np.degrees(placed.angles).tolist(), placed


def _drilled(mass: float, drill: Drill | None) -> tuple[float | None, int | None]:
    """Return the depth of each hole and how many there are."""
    if drill is None:
        return None, None
    holes = 1
    depth = float(drill_depth(mass, drill.diameter, drill.density, drill.point))
    while drill.max_depth is not None and depth > drill.max_depth * (1 + 1e-12):
        # the depth falls a little less than the number of holes rises, because of the drill's point
        holes = max(holes + 1, math.ceil(holes * depth / drill.max_depth * (1 - 1e-9)) - 1)
        if holes > HOLES:
            raise DataError(f"--max-depth: more than {HOLES} holes: expected a larger drill or deeper holes")
        depth = float(drill_depth(mass / holes, drill.diameter, drill.density, drill.point))
    return depth, holes
