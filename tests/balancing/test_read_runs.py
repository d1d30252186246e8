"""Measured runs read by the library: the same arrays whatever the layout of the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from balancing import joint_fit, least_squares, read_runs
from cli.examples import EXAMPLES
from dalembert.errors import DataError

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
