"""Placements in 32 digits: of corrections, places and options as they are written."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from typing import NamedTuple

import numpy as np

from balancing.fixed_weights import angles_again
from balancing.second_run import ExactMasses
from cli.place.corrections import Drill
from cli.place.placing import Placed, Placing, Share
from cli.read.exact import vectors, written, writtens
from dalembert.arithmetic.doubled import PI, Doubled
from dalembert.arithmetic.doubled_functions import DOUBLED
from dalembert.arithmetic.doubled_vectors import Vectors, doubled_array, part
from dalembert.tables.table import Numbers


class Made(NamedTuple):
    """A mass, its angle in degrees and the depth of its hole, NaN where they are not determined."""

    mass: Doubled
    angle: Doubled
    depth: Doubled


class SecondRun:
    """The second run of a placement."""

    def __init__(self, placing: Placing) -> None:
        self.placing, self.request = placing, placing.request

    @cached_property
    def target(self) -> Vectors:
        """What the corrections are together."""
        total = Vectors.of(np.zeros(()))
        for v in self.placing.of.vectors:
            (size,), angle = (
                Numbers("", v.mass_unit, np.array([v.mass]), "mass").exact,
                Numbers("", v.angle_unit, np.array([v.angle]), "angle"),
            )
            total = total + vectors([size], angle)[0]
        return total

    @cached_property
    def goals(self) -> list[Vectors]:
        """What goes into each plane."""
        request = self.request
        goal = self.target
        if request.radii is not None:
            of_corrections, of_places = (Doubled.of(written(radius)) for radius in request.radii)
            goal = goal * (of_corrections / of_places)
        goal = -goal if self.placing.opposite else goal
        if request.planes is None:
            return [goal]
        at, planes = request.planes
        shares = -ExactMasses(goal[None], writtens([at]), writtens(planes)).corrections
        return [shares[k] for k in range(len(planes))]

    @cached_property
    def made(self) -> list[Made]:
        """Each mass on its place."""
        of_share = {
            id(share): self._placed(share, goal)
            for share, goal in zip(self.placing.shares, self.goals, strict=True)
        }
        return [self._made(of_share[id(placed.share)], placed) for placed in self.placing.masses]

    def _made(self, of_share: tuple[Doubled, Doubled], placed: Placed) -> Made:
        masses, angles = of_share
        mass, depth, drill = part(masses, placed.place), Doubled(0.0), self.request.drill
        if drill is not None and placed.holes:
            depth = _depth(mass / float(placed.holes), drill)
        return Made(mass, part(angles, placed.place), depth)

    def _placed(self, share: Share, goal: Vectors) -> tuple[Doubled, Doubled]:
        """Return the masses of a plane and their angles in degrees, (n,) each."""
        request = self.request
        if request.weights is not None:
            masses = writtens(request.weights)
            return masses, angles_again(share.placed, goal, masses) * 180.0 / PI
        if request.places is None:
            return goal.size * np.ones(1), goal[None].degrees
        places = request.exact_places()
        angles = doubled_array([place % 360 for place in places], (len(places),))
        arms = Vectors.polar(Doubled(np.ones(len(places))), places, "deg", (len(places),))
        masses = writtens(share.placed.masses)
        if request.stock is None:
            masses = share.placed.second_run(goal, arms, masses)
        return masses, angles


def _row(numbers: Iterable[Doubled]) -> Doubled:
    pairs = [(float(x.high), float(x.low)) for x in numbers]
    return Doubled(*(np.array([pair[k] for pair in pairs]) for k in (0, 1)))


def column(runs: Iterable[SecondRun], of: Callable[[Made], Doubled]) -> Doubled:
    """One number of all masses of several placements."""
    return _row(of(made) for run in runs for made in run.made)


def goals(runs: Iterable[SecondRun], of: Callable[[SecondRun], Iterable[Vectors]]) -> Vectors:
    """Vectors of several placements, one after the other."""
    return Vectors.joined([vector[None] for run in runs for vector in of(run)])


def _depth(mass: Doubled, drill: Drill) -> Doubled:
    """How deep to drill, as `balancing.drill_depth` has it."""
    diameter = Doubled.of(written(drill.diameter))
    volume, area = mass / Doubled.of(written(drill.density)), PI * diameter * diameter / 4.0
    if drill.exact_point == 180:
        return volume / area
    sine, cosine = DOUBLED.sincos(Doubled.of(drill.exact_point) * PI / 360.0)
    slope = sine / cosine
    tip = diameter / 2.0 / slope
    cone = area * tip / 3.0
    if float(volume.high) >= float(cone.high):
        return (volume - cone) / area + tip
    cube = volume * 3.0 / (PI * slope * slope)
    root = Doubled(float(np.cbrt(cube.high)))
    return root - (root * root * root - cube) / (root * root * 3.0)
