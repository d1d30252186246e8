"""A computed rotor through two criticals: `field` corrects it, and the model with the corrections on does as predicted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.truth.rotor import turbine
from tests.cli.logs import polar
from tests.conftest import Dalembert

EXAMPLE = Path(__file__).parents[2] / "cli" / "examples" / "rotordynamics-log"
UNBALANCES = {
    6: 40e-6 * np.exp(2.4j),
    8: 60e-6 * np.exp(0.5j),
    12: 90e-6 * np.exp(2.1j),
    17: 70e-6 * np.exp(-1.9j),
}
PLANES, PROBES = {"A": 7, "B": 18}, {"DE": 2, "NDE": 22}


def test_the_log_is_the_model_s(dalembert: Dalembert) -> None:
    rotor = turbine()
    done = dalembert("field", "-", "--json", stdin=(EXAMPLE / "runs.csv").read_text())
    assert done.returncode == 0, done.stderr
    (found,) = json.loads(done.stdout)["rotors"]
    balanced = dict(UNBALANCES)
    for fix in found["corrections"]:
        node = PLANES[fix["plane"]]
        balanced[node] = balanced.get(node, 0) + polar(fix["unbalance_kg_m"], fix["angle_deg"])
    assert len(found["residual"]) == 8
    for row in found["residual"]:
        expected = rotor.response(row["speed_rad_s"], balanced)[PROBES[row["sensor"]]] * 1e6
        assert polar(row["amplitude"], row["phase_deg"]) == pytest.approx(expected, abs=1e-6)
    for one in found["influence"]:
        alpha = (
            rotor.influence(one["speed_rad_s"], [PLANES[one["plane"]]], [PROBES[one["sensor"]]])[0, 0] * 1e6
        )
        assert polar(one["magnitude_per_kg_m"], one["phase_deg"]) == pytest.approx(alpha, rel=1e-4)
    # no correction of these two planes leaves less, at these speeds and sensors
    speeds = sorted({row["speed_rad_s"] for row in found["residual"]})
    a = np.concatenate([rotor.influence(w, list(PLANES.values()), list(PROBES.values())) for w in speeds])
    v = np.concatenate([rotor.response(w, UNBALANCES)[list(PROBES.values())] for w in speeds])
    left = v - a @ np.linalg.lstsq(a, v, rcond=None)[0]
    assert found["residual_rms"] == pytest.approx(1e6 * np.sqrt(np.mean(np.abs(left) ** 2)), rel=1e-6)
