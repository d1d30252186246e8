"""Measured runs read by the library: the same arrays whatever the layout of the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from balancing import fit_with_prior, joint_fit, least_squares, read_runs
from cli.examples import EXAMPLES
from dalembert.errors import DataError
from tests.conftest import Dalembert

HEAD = "run,sensor,amplitude_um,phase_deg,trial_plane,trial_mass_g,trial_angle_deg\n"
LONG = f"{HEAD}initial,1,8,90,,,\ninitial,2,6,-90,,,\ntrial,1,10,180,A,20,90\ntrial,2,5,0,A,20,90\n"
# the same measurement
LAYOUTS = {
    "long.csv": LONG,
    "semicolons.csv": LONG.replace(",", ";"),
    "wide.csv": "run,1_um,1_phase_deg,2_um,2_phase_deg,trial_mass_A_g,trial_angle_A_deg\n"
    "initial,8,90,6,-90,,\ntrial,10,180,5,0,20,90\n",
    "vectors.yaml": "A: [8@90, 6@-90]\nB: [[10@180], [5@0]]\nU: [0.02@90]\n",
}
READINGS = [[8j, -6j], [-10, 5]]


def written(folder: Path, text: str, name: str = "runs.csv") -> Path:
    file = folder / name
    file.write_text(text)
    return file


@pytest.mark.parametrize("name", LAYOUTS)
def test_one_measurement_in_every_layout(tmp_path: Path, name: str) -> None:
    runs = read_runs(written(tmp_path, LAYOUTS[name], name))
    (group,) = runs.groups
    assert [channel.sensor for channel in group.channels] == ["1", "2"]
    assert len(group.planes) == 1
    np.testing.assert_allclose(group.readings, [READINGS], rtol=1e-15)
    np.testing.assert_allclose(group.masses, [[[0], [0.02j]]], rtol=1e-15)


def test_a_phase_that_lags_is_the_mirror_image(tmp_path: Path) -> None:
    file = written(tmp_path, LONG)
    plain, mirrored = (read_runs(file, lagging=lagging).groups[0] for lagging in (False, True))
    np.testing.assert_array_equal(mirrored.readings, plain.readings.conj())
    np.testing.assert_array_equal(mirrored.masses, plain.masses)


def test_amplitudes_alone(tmp_path: Path) -> None:
    text = "run,amplitude_um,trial_plane,trial_mass_g,trial_angle_deg\n1,8,,,\n2,10,A,20,0\n3,9,A,20,120\n4,7,A,20,240\n"
    (group,) = read_runs(written(tmp_path, text), without_phase=True).groups
    np.testing.assert_array_equal(group.readings[0, :, 0], [8, 10, 9, 7])


def test_rotors_of_other_planes_are_other_groups(tmp_path: Path) -> None:
    rows = [
        f"{rotor},{line}"
        for rotor, plane in (("r1", "A"), ("r2", "B"), ("r3", "A"))
        for line in LONG.replace(",A,", f",{plane},").splitlines()[1:]
    ]
    runs = read_runs(written(tmp_path, f"rotor,{HEAD}" + "\n".join(rows)))
    assert [(group.planes, [runs.rotors[i] for i in group.rotors]) for group in runs.groups] == [
        (["A"], ["r1", "r3"]),
        (["B"], ["r2"]),
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD + "initial,1,8,90,,,\n", "no trial run"),
        (HEAD, "no rows"),
        ("run,sensor\ninitial,1\n", "amplitude"),
    ],
)
def test_what_determines_nothing_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(DataError, match=message):
        read_runs(written(tmp_path, text))


def test_a_file_that_is_not_there() -> None:
    with pytest.raises(DataError, match=r"none\.csv"):
        read_runs("none.csv")


def test_the_pump_of_feese_and_grazier() -> None:
    """Trial masses that stay on: 15.3 g in their paper, and as `dalembert field` computes."""
    runs = read_runs(EXAMPLES / "pump-trials-left-on" / "pump.csv")
    (group,) = runs.groups
    fit = joint_fit(group.readings, group.masses)
    fix = least_squares(fit.influence, fit.initial).corrections[0]
    assert runs.amplitude_unit == "mil"
    assert group.planes == ["aft", "forward"]
    np.testing.assert_allclose(np.abs(fix), [0.0153298, 0.00661689], rtol=1e-5)


STORED = "sensor,plane,magnitude_per_g,phase_deg{0}\n1,A,0.2,180{1}\n2,A,0.1,0{2}\n"


@pytest.mark.parametrize("sd", [None, 0.01])
def test_stored_coefficients_are_the_prior_of_later_runs(tmp_path: Path, sd: float | None) -> None:
    more = ("", "", "") if sd is None else (",magnitude_uncertainty_per_g", f",{sd}", f",{sd}")
    stored = written(tmp_path, STORED.format(*more), "stored.csv")
    today = written(tmp_path, "run,sensor,amplitude_um,phase_deg\ntoday,1,8,90\ntoday,2,6,-90\n")
    runs = read_runs(today, stored)
    (group,) = runs.groups
    assert group.planes == ["A"]
    assert group.before is not None
    np.testing.assert_allclose(group.before.prior.mean, [[-200], [100]], rtol=1e-15)
    fit = fit_with_prior(group.readings, group.masses, group.before.prior)
    np.testing.assert_allclose(fit.initial, [[8j, -6j]], rtol=1e-15)
    # least squares by hand: 200 w = 8j, -100 w = -6j
    fix = least_squares(fit.influence, fit.initial).corrections[0, 0]
    np.testing.assert_allclose(fix, 1j * (200 * 8 + 100 * 6) / (200**2 + 100**2), rtol=1e-13)
    assert any("count as exact" in warning for warning in runs.warnings) == (sd is None)


def test_coefficients_of_the_command_in_the_library(tmp_path: Path, dalembert: Dalembert) -> None:
    """What --save-influence wrote: the corrections are those of the command."""
    for name, text in (
        ("long.csv", LONG),
        ("today.csv", "run,sensor,amplitude_um,phase_deg\ntoday,1,5,10\ntoday,2,6,-90\n"),
    ):
        written(tmp_path, text, name)
    dalembert("field", "long.csv", "--reading-error", "2%,2deg", "--save-influence", "alpha.csv")
    row = dalembert("field", "today.csv", "--influence", "alpha.csv").stdout.splitlines()[1].split(",")
    (group,) = read_runs(tmp_path / "today.csv", [tmp_path / "alpha.csv"]).groups
    assert group.before is not None
    fit = fit_with_prior(group.readings, group.masses, group.before.prior)
    fix = least_squares(fit.influence, fit.initial).corrections[0, 0]
    np.testing.assert_allclose(abs(fix) * 1e3, float(row[2]), rtol=1e-12)
    np.testing.assert_allclose(np.degrees(np.angle(fix)) % 360, float(row[3]), rtol=1e-12)


def test_a_sensor_without_a_stored_coefficient(tmp_path: Path) -> None:
    stored = written(tmp_path, STORED.format("", "", ""), "stored.csv")
    with pytest.raises(DataError, match="no coefficient of sensor 3 for plane A"):
        read_runs(written(tmp_path, "run,sensor,amplitude_um,phase_deg\ntoday,3,8,90\n"), stored)
