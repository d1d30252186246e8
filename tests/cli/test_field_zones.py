"""`dalembert field --zone-class`: zones of vibration severity, for velocities alone."""

from __future__ import annotations

import numpy as np
import pytest

from balancing import ZONE_BOUNDARIES, severity_zone
from tests.cli.measured import FAN
from tests.cli.printed import document
from tests.conftest import Dalembert


def zones(dalembert: Dalembert, unit: str, machine: str) -> list[str]:
    text = FAN.replace("amplitude_um", f"amplitude_{unit}")
    (rotor,) = document(dalembert("field", "-", "--json", "--zone-class", machine, stdin=text))["rotors"]
    (row,) = rotor["zones"]
    assert row["sensor"] == "1"
    return [row["before_zone"], row["predicted_zone"]]


def test_the_boundaries_in_every_class() -> None:
    for machine, ends in ZONE_BOUNDARIES.items():
        at = np.array(ends)
        assert severity_zone(at, machine).tolist() == ["A", "B", "C"]
        assert severity_zone(at * (1 + 1e-12), machine).tolist() == ["B", "C", "D"]
    assert str(severity_zone(0.0, "1-rigid")) == "A"
    for wrong in ((-1.0, "1-rigid"), (1.0, "3-rigid")):
        with pytest.raises(ValueError, match=r"velocity|expected one of"):
            severity_zone(*wrong)


def test_readings_in_every_form(dalembert: Dalembert) -> None:
    # 3.4 mm/s: r.m.s.; as a peak 2.40, peak to peak 1.20; inches are larger
    assert zones(dalembert, "mm_s", "2-rigid") == ["C", "A"]
    assert zones(dalembert, "mm_s_rms", "1-rigid") == ["B", "A"]
    assert zones(dalembert, "mm_s_pk", "2-rigid") == ["B", "A"]
    assert zones(dalembert, "mm_s_pp", "2-rigid") == ["A", "A"]
    assert zones(dalembert, "in_s", "1-flexible") == ["D", "A"]


def test_the_last_run_with_corrections_has_its_zone(dalembert: Dalembert) -> None:
    """As measured, beside before and predicted; in the report too. Without such a run there is no such key."""
    log = [
        "run,sensor,amplitude_mm_s,phase_deg,trial_plane,trial_mass_g,trial_angle_deg",
        "a,1,8,0,,,", "b,1,13.342,12.995,A,10,0", "c,1,6.964,21.04,A,5,90", "d,1,1.011,-6.70,A,12,150",
    ]  # fmt: skip
    call = ("field", "-", "--json", "--zone-class", "1-rigid")
    (rotor,) = document(dalembert(*call, "--fit", stdin="\n".join(log)))["rotors"]
    (row,) = rotor["zones"]
    assert (row["before_zone"], row["measured_zone"]) == ("D", "A")
    (rotor,) = document(dalembert(*call, stdin="\n".join(log[:3])))["rotors"]
    assert rotor["zones"][0].keys() == {"sensor", "speed_rad_s", "before_zone", "predicted_zone"}


def test_the_last_run_is_judged_alike_whether_all_runs_are_fitted(dalembert: Dalembert) -> None:
    """With --from-here the last run is one with corrections, of an initial run with trial runs and of a log."""
    text = FAN.replace("amplitude_um", "amplitude_mm_s")
    call = ("field", "-", "--json", "--zone-class", "1-rigid", "--from-here")
    trials, log = (document(dalembert(*call, *more, stdin=text))["rotors"][0] for more in ([], ["--fit"]))
    assert "measured_zone" in trials["zones"][0]
    assert trials["zones"] == log["zones"]


def test_what_is_no_velocity_is_refused(dalembert: Dalembert) -> None:
    for machine in ("2-rigid", "3-rigid"):
        done = dalembert("field", "-", "--zone-class", machine, stdin=FAN)
        assert done.returncode == 2
        assert done.stdout == ""
    assert "the readings are in um" in dalembert("field", "-", "--zone-class", "2-rigid", stdin=FAN).stderr
