"""`dalembert equilibrium`: a pendulum, a wound spring, gears."""

from __future__ import annotations

import math

import pytest

from tests.cli.printed import document
from tests.conftest import Dalembert

BOB = """
gravity = [0, -9.81]
[ground]
O = [0, 0]
[links.bob]
points = { O = [0, 0] }
mass = 2
center = [0.5, 0]
[input]
link = "bob"
"""


def test_equilibrium(dalembert: Dalembert) -> None:
    found = document(dalembert("equilibrium", "-", "--json", stdin=BOB))
    assert [(round(e["input_deg"], 9), e["stable"]) for e in found["equilibria"]] == [
        (90.0, False),
        (270.0, True),
    ]
    assert found["equilibria"][1]["potential_J"] == pytest.approx(-9.81, rel=1e-14)
    assert set(found) == {"name", "equilibria", "warnings"}


def test_equilibrium_of_a_wound_spring(dalembert: Dalembert) -> None:
    """The angle has its whole turns, which the spring's torque depends on: it may be negative, and `forces` finds no effort there."""
    text = BOB + '[[torsion_springs]]\nlinks = ["ground", "bob"]\nstiffness = 30\n'
    (rest,) = document(dalembert("equilibrium", "-", "--json", stdin=text))["equilibria"]
    assert (-45 < rest["input_deg"] < 0, rest["stable"]) == (True, True)
    found = document(dalembert("forces", "-", "--at", f"{rest['input_deg']!r}deg", "--json", stdin=text))
    assert abs(found["poses"][0]["effort"]["input_torque_N_m"]) < 1e-13 * 9.81


@pytest.mark.parametrize(("stiffness", "stable"), [(9.81, None), (9.8, False), (9.82, True)])
def test_equilibrium_of_a_spring_of_critical_stiffness(
    dalembert: Dalembert, stiffness: float, stable: bool | None
) -> None:
    """Upright on a torsion spring of k = m g c the second variation is zero: neither stability nor a period follows from it."""
    text = (
        BOB
        + f'[[torsion_springs]]\nlinks = ["ground", "bob"]\nstiffness = {stiffness}\nfree_angle = "90 deg"\n'
    )
    rest = document(dalembert("equilibrium", "-", "--json", stdin=text))["equilibria"]
    assert len(rest) == (3 if stable is False else 1)
    upright = rest[len(rest) // 2]
    assert upright["input_deg"] == pytest.approx(90, abs=1e-3 if stable is None else 1e-9)
    assert upright["stable"] is stable
    assert (upright["period_s"] is None) == (not stable)


@pytest.mark.parametrize(
    ("ratio", "searched"), [("-0.5", None), ("0.7", None), ("-0.7071", "from -360 to 360 deg")]
)
def test_equilibrium_of_gears(dalembert: Dalembert, ratio: str, searched: str | None) -> None:
    """The loads of a pair 1:2 come back after two turns, of 7:10 after ten, of 7071:10000 after no number that is tried."""
    text = f"""
    gravity = [0, -9.81]
    [ground]
    O = [0, 0]
    Q = [1, 0]
    [links.crank]
    points = {{ O = [0, 0] }}
    mass = 2
    center = [0.5, 0]
    [links.gear]
    points = {{ Q = [0, 0] }}
    mass = 3
    center = [0.4, 0]
    [[gears]]
    links = ["crank", "gear"]
    ratio = {ratio}
    [input]
    link = "crank"
    [guess]
    at = 0
    gear = 0
    """
    found = document(dalembert("equilibrium", "-", "--json", stdin=text))
    at = [e["input_deg"] for e in found["equilibria"]]
    text_of = "the loads do not repeat after whole turns of crank: searched {}; --over sets another range"
    assert found["warnings"] == ([text_of.format(searched)] if searched else [])
    r = float(ratio)
    for x in map(math.radians, at):
        assert abs(2 * 0.5 * math.cos(x) + 3 * 0.4 * r * math.cos(r * x)) < 1e-12
    assert (min(at) < 0) is (searched is not None)
    assert (max(at) > 360) is (searched is None)
