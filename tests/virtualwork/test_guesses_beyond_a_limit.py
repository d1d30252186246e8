"""A guess where nothing closes: the range beside it is named, and a mechanism that closes nowhere is refused."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from tests.four_bars import body, four_bar
from virtualwork import AssemblyError, Guess, Guide, Input, Link, Mechanism

# the pins are 1.434 + 4.029 apart at most, and 4.029 − 1.434 at least
LENGTHS = (5.4, 1.434, 4.029, 4.359)


def reached(distance: float) -> float:
    """The angle of the crank, deg, at which its pin is so far from the rocker's (the law of cosines)."""
    a, d = LENGTHS[0], LENGTHS[-1]
    return math.degrees(math.acos((a * a + d * d - distance * distance) / (2 * a * d)))


def text(at: float, mass: float = 1) -> str:
    return four_bar(
        body(mass),
        lengths=LENGTHS,
        length="m",
        at=at,
        guess={"coupler": 100, "rocker": 90},
        head="gravity = [0, -9.81]",
    )


@pytest.mark.parametrize(
    ("at", "mirrored"), [(10, False), (27, False), (50, False), (100, False), (350, True), (200, True)]
)
def test_the_range_is_the_one_beside_the_guess(dalembert, tmp_path, at, mirrored):
    near, far = reached(LENGTHS[2] - LENGTHS[1]), reached(LENGTHS[2] + LENGTHS[1])
    (tmp_path / "m.toml").write_text(text(at))
    check = json.loads(dalembert("inspect", "m.toml", "--json").stdout)["check"]
    expected = (360 - far, 360 - near) if mirrored else (near, far)
    assert check["input_limits_deg"] == pytest.approx(expected, abs=1e-11)
    assert check["dead_points_deg"] == pytest.approx([near, far, 360 - far, 360 - near], abs=1e-11)


def test_each_limit_is_named_once(dalembert, tmp_path):
    """Through a change point at 0° (70.1 − 80.2 = 20.2 − 30.3) a turn on is another pose: limits of two turns."""
    (tmp_path / "m.toml").write_text(
        four_bar(lengths=(70.1, 20.2, 30.3, 80.2), at=60, guess={"coupler": 20, "rocker": 80})
    )
    found = dalembert("mechanism", "m.toml", "--only", "C.x")
    named = found.stderr.split("limits ")[1].split(" deg")[0].split(", ")
    assert len(named) == len(set(named)) > 1


def test_a_mechanism_that_closes_nowhere_has_no_rest_and_no_character(dalembert, tmp_path):
    lines = text(10).replace("C = [1.434, 0]", "C = [0.01, 0]").replace("B = [5.4, 0]", "B = [54, 0]")
    (tmp_path / "m.toml").write_text(lines)
    for command in ("inspect", "equilibrium"):
        found = dalembert(command, "m.toml")
        assert (found.returncode, found.stdout) == (1, "")
        assert "cannot be assembled at any input" in found.stderr
        assert "reach 4.039 m" in found.stderr
        assert found.stderr.count("\n") == 1


def test_of_variants_one_that_closes_nowhere_is_a_row_that_says_so(dalembert, tmp_path):
    (tmp_path / "m.toml").write_text(text(50))
    found = dalembert("equilibrium", "m.toml", "--over", "links.crank.B.x=54:4.4:-49.6")
    assert found.returncode == 0
    assert found.stdout.splitlines()[1].startswith("1,54.0,false,")
    assert "variant 1: the mechanism cannot be assembled at any input of the range" in found.stderr


def test_several_inputs_that_close_nowhere():
    """Two cranks whose pins stay farther apart than the rods reach."""
    m = Mechanism(
        {"A": (0, 0), "E": (9, 0)},
        {
            "left": Link({"A": (0, 0), "B": (1, 0)}, mass=1, center=0.5),
            "first": Link({"B": (0, 0), "C": (2, 0)}),
            "second": Link({"C": (0, 0), "D": (2, 0)}),
            "right": Link({"E": (0, 0), "D": (1, 0)}),
        },
        inputs=(Input("left"), Input("right")),
        guess=Guess((1.0, 1.0), {"first": 0.5, "second": -0.5}),
        gravity=-9.81j,
    )
    with pytest.raises(AssemblyError, match="at any input of the range"):
        m.equilibria()


def test_a_range_beyond_a_limit_is_refused_and_one_at_rest_is_not():
    crank = Link({"O": (0, 0), "A": (2, 0)}, mass=1, center=1)
    m = Mechanism(
        {"O": (0, 0)},
        {"crank": crank, "rod": Link({"A": (0, 0), "B": (1, 0)})},
        [Guide("B", "rod")],
        inputs=Input("crank"),
        guess=Guess(0.1, {"rod": -0.3}),
        gravity=-9.81j,
    )
    # the rod reaches the line within 30° of it
    with pytest.raises(AssemblyError):
        m.equilibria(np.radians([[40, 140]]))
    assert m.equilibria(np.radians([[-20, 20]])).found == ()
