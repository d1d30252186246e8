"""`dalembert signal`: a recording becomes rows of a log."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import Dalembert


def test_the_command_gives_the_rows_of_a_log(dalembert: Dalembert, tmp_path: Path) -> None:
    # the mark rises half a sample before its first high one
    t = (np.arange(3000) + 0.5) / 1000
    lines = ["t_s,mark,A_um,B_um"]
    for k, s in enumerate(t.tolist()):
        angle = 2 * np.pi * 10 * s
        values = [s, 4 * np.cos(angle + 1), 2 * np.cos(angle - 2)]
        time, a, b = (f"{value:.17g}" for value in values)
        lines.append(f"{time},{int(k % 100 == 0)},{a},{b}")
    (tmp_path / "s.csv").write_text("\n".join(lines) + "\n")
    done = dalembert("signal", "s.csv", "--json")
    assert done.returncode == 0, done.stderr
    first, second = json.loads(done.stdout)["signal"]
    assert (first["sensor"], second["sensor"]) == ("A", "B")
    assert first["amplitude"] == pytest.approx(4, rel=1e-9)
    assert first["phase_deg"] == pytest.approx(np.degrees(1), rel=1e-9)
    assert second["phase_deg"] == pytest.approx(360 - np.degrees(2), rel=1e-9)
    assert first["speed_rad_s"] == pytest.approx(20 * np.pi, rel=1e-9)
    assert first["turns"] == 29
    # half of a sample's 3.6 degrees
    assert first["phase_resolution_deg"] == pytest.approx(1.8, rel=1e-9)
    assert any("hold to ± 1.8°" in warning for warning in json.loads(done.stdout)["warnings"])
    head, row = dalembert("signal", "s.csv").stdout.splitlines()[:2]
    assert head == "sensor,speed_rpm,amplitude_um,phase_deg,amplitude_uncertainty_um,turns"
    assert float(row.split(",")[1]) == pytest.approx(600)
    (tmp_path / "bad.csv").write_text("t_s,A_um\n0,1\n")
    bad = dalembert("signal", "bad.csv")
    assert bad.returncode == 1
    assert "no column mark" in bad.stderr
    assert dalembert("field", "--signal", "s.csv").returncode == 2
    # the amplitude is a peak: it was given out as µm peak to peak, half of it
    (tmp_path / "pp.csv").write_text("\n".join(["t_s,mark,A_um_pp,B_um_pp", *lines[1:]]) + "\n")
    bad = dalembert("signal", "pp.csv")
    assert (bad.returncode, "expected a unit without _pp" in bad.stderr) == (1, True)


def test_a_mark_in_volts(dalembert: Dalembert) -> None:
    rows = [f"{k / 1000},{5 * (k % 50 < 5)},{np.cos(2 * np.pi * k / 50)}" for k in range(200)]
    results = [
        dalembert("signal", "-", stdin="\n".join([f"t_s,{mark},A_um", *rows]) + "\n").stdout
        for mark in ("mark", "keyphasor_V", "Tacho [mV]")
    ]
    assert results[0].startswith("sensor,speed_rpm")
    assert results == results[:1] * 3


def test_a_tacho_with_several_pulses(dalembert: Dalembert, tmp_path: Path) -> None:
    t = np.arange(4000) / 4000
    angle = 2 * np.pi * 10 * t + 0.3
    rows = np.stack([t, np.sin(angle), np.sin(6 * angle), 4 * np.cos(angle + 1)], axis=1)
    for name, header, columns in (
        ("both.csv", "t_s,mark,tacho,A_um", [0, 1, 2, 3]),
        ("tacho.csv", "t_s,tacho,A_um", [0, 2, 3]),
    ):
        lines = [",".join(f"{value:.12g}" for value in row) for row in rows[:, columns]]
        (tmp_path / name).write_text("\n".join([header, *lines]) + "\n")
    both = dalembert("signal", "both.csv", "--json")
    (one,) = json.loads(both.stdout)["signal"]
    assert one["amplitude"] == pytest.approx(4, rel=1e-4)
    assert one["phase_deg"] == pytest.approx(np.degrees(1), abs=0.01)
    alone = dalembert("signal", "tacho.csv", "--pulses", "6", "--json")
    found = json.loads(alone.stdout)
    # the first pulse after 0.3 rad is at a sixth of a turn
    assert found["signal"][0]["phase_deg"] == pytest.approx(np.degrees(1) + 60, abs=0.01)
    assert found["signal"][0]["speed_rad_s"] == pytest.approx(20 * np.pi, rel=1e-5)
    assert any("the first of 6 pulses" in warning for warning in found["warnings"])
    assert dalembert("signal", "both.csv", "--pulses", "6").returncode == 2
    assert dalembert("field", "both.csv", "--pulses", "6").returncode == 2


def test_the_header_below_a_title(dalembert: Dalembert) -> None:
    rows = "".join(f"{k / 200},{int(k % 20 < 3)},{k % 7}\n" for k in range(100))
    plain = dalembert("signal", "-", stdin="t_s,mark,A_um\n" + rows)
    below = dalembert("signal", "-", stdin="Recorder 7\n\nt_s,mark,A_um\n" + rows)
    assert plain.returncode == 0
    assert below.stdout == plain.stdout
    assert "the header is in line 3" in below.stderr
    unmarked = dalembert("signal", "-", stdin="t_s,A_um\n0,1\n")
    assert unmarked.stderr.startswith("dalembert: standard input: no column mark")


@pytest.mark.parametrize(
    ("level", "digits", "is_clipped"), [(2.0, 6, True), (9.0, 6, False), (9.0, 1, False)]
)
def test_a_clipped_recording_is_named(
    dalembert: Dalembert, level: float, digits: int, is_clipped: bool
) -> None:
    """A sine of 3.2 µm cut off at 2 gives 2.4 µm; one in steps of 0.1 is whole."""
    t = (np.arange(3000) + 0.5) / 1000
    wave = np.clip(3.2 * np.cos(2 * np.pi * 9.7 * t), -level, level).round(digits)
    rows = [f"{s},{int((9.7 * s) % 1 < 0.1)},{v}" for s, v in zip(t.tolist(), wave.tolist(), strict=True)]
    done = dalembert("signal", "-", "--json", stdin="\n".join(["t_s,mark,A_um", *rows]) + "\n")
    result = json.loads(done.stdout)
    assert any("57% of the samples of A" in warning for warning in result["warnings"]) == is_clipped
    # of cos cut off at c = cos a: the first harmonic is (2/π)(π/2 - a + sin a cos a), times the size
    edge = np.arccos(min(level / 3.2, 1.0))
    first = 3.2 * 2 / np.pi * (np.pi / 2 - edge + np.sin(edge) * np.cos(edge))
    assert result["signal"][0]["amplitude"] == pytest.approx(first, rel=2e-3)


@pytest.mark.parametrize(("drift", "warned"), [(0.0, False), (0.001, False), (0.2, True), (-0.2, True)])
def test_a_level_that_drifts_is_named(drift: float, warned: bool, dalembert: Dalembert) -> None:
    turns = (np.arange(2500) + 0.5) / 100
    a = 4 * np.cos(2 * np.pi * turns + 1) + 3 + drift * turns
    rows = [f"{turn / 10:.5f},{int(turn % 1 < 0.1)},{x:.9f},1" for turn, x in zip(turns, a, strict=True)]
    done = dalembert("signal", "-", "--json", stdin="t_s,mark,A_um,B_um\n" + "\n".join(rows) + "\n")
    result = json.loads(done.stdout)
    named = [warning for warning in result["warnings"] if "drifts" in warning]
    assert [("level of A" in warning, "0.064 um" in warning) for warning in named] == [(True, True)] * warned
    # the warning states how far the amplitude may be off
    assert abs(result["signal"][0]["amplitude"] - 4) <= abs(drift) / np.pi + 1e-8
