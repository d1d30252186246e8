"""A six-bar whose assemblies nearly meet, and whose branch does not repeat after a turn of its input, released from rest."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.truth.bodies_in_time import Bodies
from virtualwork import Guess, Input, Link, Mechanism
from virtualwork.intime.coordinates import Coordinates
from virtualwork.intime.equations import Equations

ANGLES = {"AB": -2.9852865, "BCE": 2.7463323, "CD": 3.1204706, "EF": -2.0157000, "FG": 0.7635385}


def six_bar(mirrored: bool) -> Mechanism:
    def place(z: complex) -> complex:
        return z.conjugate() if mirrored else z

    sign = -1.0 if mirrored else 1.0
    bodies = {
        "AB": ({"A": 0j, "B": -0.28894030 - 0.42000631j}, 2.0),
        "BCE": ({"B": 0j, "C": -0.55111664 + 0.40199112j, "E": -0.41463778 - 0.29331297j}, 1.0),
        "CD": ({"C": 0j, "D": 0.41299583 - 0.46674236j}, 0.5),
        "EF": ({"E": 0j, "F": 0.58197579 - 0.63597935j}, 3.0),
        "FG": ({"F": 0j, "G": 0.43973495 - 0.53786340j}, 1.5),
    }
    links = {}
    for name, (points, mass) in bodies.items():
        own = {point: place(z) for point, z in points.items()}
        links[name] = Link(own, mass=mass, center=sum(own.values()) / len(own), inertia=0.02 * mass)
    ground = {"A": -0.21812154 - 0.20131495j, "D": -0.04729471 + 0.15070871j, "G": 0.36257215 + 0.03349733j}
    angles = {name: sign * angle for name, angle in ANGLES.items()}
    return Mechanism(
        {name: place(z) for name, z in ground.items()},
        links,
        inputs=Input(link="FG", value=angles["FG"]),
        guess=Guess(angles["FG"], angles),
        gravity=-9.81j * sign,
    )


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("accuracy", [1e-4, 1e-7])
def test_every_solution_begins_in_the_assembly_of_the_guess(accuracy: float, mirrored: bool) -> None:
    m, times = six_bar(mirrored), np.linspace(0, 1.4, 5)
    run = m.simulate(times, accuracy=accuracy)
    true = Bodies(m).angles([float(m.inputs[0].value or 0)], [0.0], times, 1e-12)["FG"]
    error = np.abs(run.angle[:, 0] - run.angle[0, 0] - (true - true[0]))
    assert (error <= run.error_estimate[:, 0] + 1e-11).all()
    assert not run.unknown.any()


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_pose_is_that_of_its_own_turn_wherever_a_motion_was(mirrored: bool) -> None:
    m = six_bar(mirrored)
    coordinates, start = Coordinates(Equations(m.assembly), m.inputs), float(m.inputs[0].value or 0)
    margin = coordinates.margin([start])
    assert margin < 0.01
    # a turn further the other assembly is near
    for q in np.linspace(start, 5.0968 if mirrored else -5.0968, 80).tolist():
        coordinates.margin([q])
    assert coordinates.margin([start]) == pytest.approx(margin, rel=1e-9)
