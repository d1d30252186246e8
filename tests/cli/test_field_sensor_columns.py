"""Columns that name a sensor in words of the trade, alone or together; a header that says that the phase lags."""

from __future__ import annotations

import csv
import io

import pytest

from tests.conftest import Dalembert

PUMP = """Run,{head},Displacement (mils p-p),{phase},Trial Weight (oz),Trial Angle (deg)
0,{x},2.4,110,,
0,{y},1,135,,
1,{x},1.54,61.4,1.5,90
1,{y},0.64,86.4,1.5,90
"""


def angle(stdout: str) -> float:
    (row,) = csv.DictReader(io.StringIO(stdout))
    return float(row["angle_deg"])


@pytest.mark.parametrize(
    ("head", "x", "y"),
    [
        ("Probe", "1X", "1Y"),
        ("Pickup", "1X", "1Y"),
        ("Bearing,Probe", "1,X", "1,Y"),
        ("Lager,Richtung", "DE,H", "DE,V"),
        ("Direction,Bearing", "H,DE", "V,DE"),
        ("Bearing,Direction,Probe", "DE,,1", "DE,H,"),
    ],
)
def test_readings_of_two_probes_are_two_sensors(head: str, x: str, y: str, dalembert: Dalembert) -> None:
    plain = dalembert("field", "-", stdin=PUMP.format(head="sensor", x="a", y="b", phase="Phase (deg)"))
    done = dalembert("field", "-", stdin=PUMP.format(head=head, x=x, y=y, phase="Phase (deg)"))
    assert (done.returncode, done.stdout) == (0, plain.stdout), done.stderr
    assert ("together as sensor" in done.stderr) == ("," in head)
    assert "read 2 times" not in done.stderr


def test_a_column_named_sensor_is_the_sensor(dalembert: Dalembert) -> None:
    text = PUMP.format(head="sensor,direction", x="a,H", y="b,V", phase="Phase (deg)")
    done = dalembert("field", "-", stdin=text)
    assert "ignored the column 'direction'" in done.stderr
    assert "together" not in done.stderr


def test_a_short_row_is_named_as_the_file_has_it(dalembert: Dalembert) -> None:
    text = PUMP.format(head="Bearing,Probe", x="1,X", y="1", phase="Phase (deg)")
    done = dalembert("field", "-", stdin=text)
    assert done.returncode == 1
    assert "row 2 (line 3): found 6 cells, expected 7" in done.stderr


@pytest.mark.parametrize(
    ("phase", "options", "warned"),
    [
        ("Phase Lag (deg)", (), True),
        ("Phase Lag (deg)", ("--phase-lag",), False),
        ("Phase Lag (deg)", ("--rotation", "ccw"), False),
        ("Phase (deg)", (), False),
    ],
)
def test_a_header_that_says_that_the_phase_lags(
    phase: str, options: tuple[str, ...], warned: bool, dalembert: Dalembert
) -> None:
    done = dalembert("field", "-", *options, stdin=PUMP.format(head="Probe", x="a", y="b", phase=phase))
    assert done.returncode == 0, done.stderr
    assert ("says that the phase lags" in done.stderr) == warned
    # the unbalance of these readings is at 310° if the phase lags
    assert round(angle(done.stdout)) == (130 if "--phase-lag" in options else 50)
