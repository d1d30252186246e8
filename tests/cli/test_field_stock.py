"""Corrections in the field made of weights in stock: against every choice of up to three weights, and against `place`."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
import pytest

from tests.cli.printed import document
from tests.conftest import Dalembert

ONE = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n0,1,{amplitude},{phase},,,\n1,1,{second},{turned},A,5,0\n"
BLADES = np.exp(2j * np.pi * np.arange(12) / 12)


def readings(correction: complex) -> str:
    """One plane, one sensor, a coefficient of 2 µm/g at 40°; the initial run needs this correction, g."""
    alpha = 2 * np.exp(1j * np.radians(40))
    first = -alpha * correction
    second = first + alpha * 5
    (a, p), (b, q) = ((abs(v), np.degrees(np.angle(v)) % 360) for v in (first, second))
    return ONE.format(
        amplitude=repr(float(a)), phase=repr(float(p)), second=repr(float(b)), turned=repr(float(q))
    )


@pytest.mark.parametrize("angle", [0.0, 73.0, -73.0])
def test_the_fewest_weights_within_a_hundredth(dalembert: Dalembert, angle: float) -> None:
    wanted = 8.3 * np.exp(1j * np.radians(angle))
    done = dalembert("field", "-", "--json", "--blades", "12", "--stock", "1g,2g,5g", stdin=readings(wanted))
    found = document(done)
    (fix,) = found["rotors"][0]["corrections"]
    sums = [(part["mass_kg"] * 1e3, np.radians(part["angle_deg"])) for part in fix["split"]]
    placed = sum(m * np.exp(1j * a) for m, a in sums)
    loads = [
        (f, k) for k in range(12) for f in (1.0, 2.0, 5.0)
    ]  # one weight a blade, every choice of up to three
    least = {0: abs(wanted)}
    for n in (1, 2, 3):
        least[n] = min(
            abs(wanted - sum(f * BLADES[k] for f, k in choice))
            for choice in combinations_with_replacement(loads, n)
            if len({k for _, k in choice}) == n
        )
    enough = [n for n in least if least[n] <= 0.01 * abs(wanted)]
    best = min(least[n] for n in least) if not enough else least[enough[0]]
    assert abs(placed - wanted) == pytest.approx(best, rel=1e-9)
    assert len(sums) == (enough[0] if enough else min(n for n in least if least[n] <= best * (1 + 1e-12)))
    missed = [line for line in found["warnings"] if "weights in stock miss" in line]
    assert bool(missed) == (best > 0.01 * abs(wanted))


def test_the_split_is_that_of_place(dalembert: Dalembert) -> None:
    done = dalembert(
        "field", "-", "--json", "--blades", "12", "--stock", "1g,2g,5g", stdin=readings(6.1 + 2.2j)
    )
    (fix,) = document(done)["rotors"][0]["corrections"]
    vector = f"{fix['mass_kg']!r}kg@{fix['angle_deg']!r}deg"
    placed = document(dalembert("place", vector, "--blades", "12", "--stock", "1g,2g,5g", "--json"))["masses"]
    assert [(m["position"], m["mass_kg"]) for m in fix["split"]] == [
        (m["position"], m["mass_kg"]) for m in placed
    ]


def test_stock_needs_places_and_masses(dalembert: Dalembert) -> None:
    text = readings(3 + 1j)
    assert dalembert("field", "-", "--stock", "1g", stdin=text).returncode == 2
    assert dalembert("field", "-", "--blades", "4", "--stock", "1mm", stdin=text).returncode == 2
    unbalances = text.replace("trial_mass_g", "trial_unbalance_g_mm")
    refused = dalembert("field", "-", "--blades", "4", "--stock", "1g", stdin=unbalances)
    assert refused.returncode == 2
    assert "unbalances" in refused.stderr
    nothing = document(
        dalembert("field", "-", "--json", "--blades", "4", "--stock", "1kg", stdin=readings(0.001 + 0j))
    )
    assert nothing["rotors"][0]["corrections"][0]["split"] == []
