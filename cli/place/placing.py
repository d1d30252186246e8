"""From corrections and the places where masses can go to the masses, and the holes that remove as much."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from balancing import (
    Placement,
    drill_depth,
    fewest_from_stock,
    place,
    place_from_stock,
    place_weights,
    transfer,
)
from balancing.stock import ENOUGH
from cli.place.corrections import Correction, Drill, Request
from dalembert.angles import degrees, in_turn, phasor
from dalembert.errors import DataError
from dalembert.units import from_si, to_si

Real = NDArray[np.float64]
HOLES = 10_000  # more at one place are refused


@dataclass(frozen=True)
class Share:
    """What goes into one plane."""

    z: float | None
    goal: complex
    places: list[float]
    placed: Placement

    @property
    def error(self) -> complex:
        """What is missed; below the rounding of the goal nothing is."""
        error = self.placed.error
        return error if abs(error) > 1e-14 * abs(self.goal) else 0j


class Placed(NamedTuple):
    """A mass on a place, and the holes that remove it."""

    share: Share
    place: int
    mass: float
    angle: float
    depth: float | None
    holes: int | None


class Placing:
    """Corrections combined and placed."""

    def __init__(self, of: Correction, request: Request) -> None:
        self.of, self.request = of, request
        self.warnings: list[str] = []
        self._sizes = [to_si(v.mass, "mass", v.mass_unit) for v in of.vectors]
        self._largest = max(self._sizes)
        each = zip(self._sizes, of.vectors, strict=True)
        turned = (phasor(np.array(size), np.array(v.angle), v.angle_unit) for size, v in each)
        self.target = sum(map(complex, turned), 0j)
        if abs(self.target) <= 1e-15 * self._largest:
            self.target = 0j  # what rounding leaves of corrections that cancel
        self.opposite = opposite = request.drill is not None and not request.remove
        self._goal = -self.target * request.ratio if opposite else self.target * request.ratio
        if self.target == 0:
            self.warnings.append("the corrections add up to nothing: there is nothing to place")
        goals: list[tuple[float | None, complex]] = [(None, self._goal)]
        if request.planes is not None:
            at, planes = request.planes
            goals = list(zip(planes, transfer([self._goal], [at], planes).tolist(), strict=True))
        self.shares = [Share(z, goal, *self._place(goal)) for z, goal in goals]
        if opposite:
            self.warnings.append("material is drilled out opposite (+180°) to the mass that would be added")
        self.masses = [
            Placed(share, i, float(mass), in_turn(share.places[i]), *_drilled(float(mass), request.drill))
            for share in self.shares
            for i, mass in enumerate(share.placed.masses)
            if mass > 0
        ]
        # of several planes the largest error
        self.error = max((share.error for share in self.shares), key=abs)

    @property
    def action(self) -> str:
        """What is done with material on the places: `add` or `remove`."""
        return "remove" if self.request.removes else "add"

    def text(self, mass: float) -> str:
        """Return a mass in the unit it is shown in."""
        return f"{from_si(mass, 'mass', self.of.unit):.4g} {self.of.unit}"

    def _place(self, goal: complex) -> tuple[list[float], Placement]:
        """Place what goes into one plane: the places, and what is on them."""
        request = self.request
        if request.weights is not None:
            return self._turned(goal, request.weights)
        if request.places is None:
            if request.limit is not None and abs(goal) > request.limit * (1 + 1e-12):
                raise DataError(
                    f"the correction of {self.text(abs(goal))} is beyond --max-mass {self.text(request.limit)}, and "
                    "there is one place only: expected --positions or --blades to spread it over"
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
                f"the correction cannot be reached from these places{limited}: an error of "
                f"{self.text(abs(placed.error))} is left, the least there is"
            )
        return request.places, placed

    def _from_stock(self, goal: complex, stock: list[float], angles: Real) -> Placement:
        request = self.request

        try:
            if request.max_pieces is None:
                placed = self._few(goal, angles, stock)
            else:
                most = request.max_pieces
                placed = place_from_stock(
                    goal, angles, stock, request.limit, pieces=request.pieces, max_pieces=most
                )
                self._far(f"at most {most} weight{'s' * (most != 1)} leave{'s' * (most == 1)}", placed)
        except ValueError as error:
            raise DataError(f"--stock: {error}") from None
        if len(angles) > 2 and placed.bound == 0 and abs(placed.error) > 1e-12 * abs(goal):
            self.warnings.append(
                "too many choices to search them all: the places nearest to the correction were used"
            )
        return placed

    def _few(self, goal: complex, angles: Real, stock: list[float]) -> Placement:
        """Take the fewest weights that come near enough, and say what one more would leave."""
        request = self.request
        choice = fewest_from_stock(goal, angles, stock, request.limit, pieces=request.pieces)
        placed, used, more = choice.placed, choice.used, choice.tried + 1
        further = place_from_stock(
            goal, angles, stock, request.limit, pieces=request.pieces, max_pieces=more
        ).error
        weights = f"{used} weight{'s' * (used != 1)} leave{'s' * (used == 1)}"
        if goal and abs(further) < abs(placed.error) - 1e-12 * abs(goal):
            self.warnings.append(
                f"{weights} {self._missed(placed)}; with {more} it would be {self.text(abs(further))} (--max-pieces {more})"
            )
        else:
            self._far(weights, placed, "; one more leaves no less")
        return placed

    def _missed(self, placed: Placement) -> str:
        """The error of weights from stock, and its share of the correction."""
        error = abs(placed.error)
        return f"an error of {self.text(error)} ({error / abs(placed.target):.2%})"

    def _far(self, weights: str, placed: Placement, more: str = "") -> None:
        """Warn where weights from stock do not come near the correction."""
        if abs(placed.error) > ENOUGH * abs(placed.target):
            self.warnings.append(f"{weights} {self._missed(placed)}{more}")

    def _turned(self, goal: complex, weights: list[float]) -> tuple[list[float], Placement]:
        """Turn weights of fixed mass: their angles, and what they are together."""
        placed = place_weights(goal, weights)
        if placed.bound:
            whole = sum(weights)
            reach = (
                f"{self.text(whole)} at most"
                if abs(goal) > whole
                else f"{self.text(abs(placed.total))} at least"
            )
            self.warnings.append(
                f"the weights together come to {reach}: the correction of {self.text(abs(goal))} is missed by "
                f"{self.text(placed.bound)}"
            )
        return np.degrees(placed.angles).tolist(), placed


def _drilled(mass: float, drill: Drill | None) -> tuple[float | None, int | None]:
    """Return the depth of each hole and how many there are."""
    if drill is None:
        return None, None
    holes = 1
    depth = float(drill_depth(mass, drill.diameter, drill.density, drill.point))
    while drill.deepest is not None and depth > drill.deepest * (1 + 1e-12):
        # one hole's worth at a time; the first guess is close, the point takes a little more
        holes = max(holes + 1, math.ceil(holes * depth / drill.deepest * (1 - 1e-9)) - 1)
        if holes > HOLES:
            raise DataError(f"--max-depth: more than {HOLES} holes: expected a larger drill or deeper holes")
        depth = float(drill_depth(mass / holes, drill.diameter, drill.density, drill.point))
    return depth, holes
