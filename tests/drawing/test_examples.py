"""The picture of every worked example, as the command draws it: no words that collide or are cut, no offsets."""

from __future__ import annotations

import contextlib
import shlex
from collections.abc import Callable
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from faults import faults
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import dalembert.drawing.sheet
from cli.app import main
from cli.examples import ABOUT, EXAMPLES, describe, names

Draw = Callable[..., Figure]
FURTHER = {
    "engine": [
        "--at 150deg",
        "--over 90deg:450deg:30deg",
        "--over 0deg:720deg:5deg --only B.y,B.vy,B.ay,rod.omega",
    ],
    "klann": ["--over 0deg:360deg:10deg", "forces: --over 0deg:360deg:10deg"],
    "parallelogram": ["--over 0deg:720deg:5deg --only coupler.omega,rocker.omega,coupler.alpha"],
    "peaucellier": ["--over=-90deg:90deg:1deg --only B.x,B.y"],
    "planetary-gear": ["--at 60deg"],
    "scissors-lift": ["--over 0.4m:1.15m:0.05m"],
    "quick-return": ["--over 0deg:360deg:10deg"],
    "fan-one-plane": ["--blades 12"],
    "pump-trials-left-on": ["--blades 12"],
    "turbine-train": [""],
    "blades": ["--max-mass 9g", "--drill 10mm --density 7850kg_m3"],
    "crankshaft": [""],
    "riul-rod": ["--shaft=-500mm:500mm --speed 10rad_s --correct A:-200mm:50mm --correct B:200mm:50mm"],
    "tennis-racket": ["--at 5"],
}
"""Further calls of an example's file: these words in place of its own options; before a colon another command."""
# exercises, what a signal holds and a first trial mass have no picture
WITHOUT = ("fan-signal", "first-trial-mass")
CALLS = [(name, None) for name in names() if not name.startswith("exercise-") and name not in WITHOUT] + [
    (name, words) for name, more in FURTHER.items() for words in more
]


@pytest.fixture
def draw(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Draw:
    """Return what draws the picture of an example's call, in this process."""

    def drawn(name: str, words: str | None) -> Figure:
        for file in EXAMPLES.joinpath(name).iterdir():
            if file.name != ABOUT:
                (tmp_path / file.name).write_bytes(file.read_bytes())
        call = shlex.split(describe(name)["command"])
        if "--plot" in call:
            del call[call.index("--plot") : call.index("--plot") + 2]
        if words is not None:
            command, colon, others = words.partition(": ")
            if colon:
                call[1], words = command, others
            call = [
                *(
                    call
                    if call[1] == "place" or name in ("fan-one-plane", "pump-trials-left-on", "turbine-train")
                    else call[:3]
                ),
                *shlex.split(words),
            ]
        figures: list[Figure] = []

        def keep(picture: Callable[[], Figure], _: str) -> bytes:
            matplotlib.use("Agg")
            figures.append(picture())
            return b""

        monkeypatch.setattr(dalembert.drawing.sheet, "drawn", keep)
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr("sys.argv", [*call, "--plot", "picture.png"])
        with contextlib.suppress(SystemExit):
            main()
        (figure,) = figures
        return figure

    return drawn


@pytest.mark.parametrize(
    ("name", "words"), [*CALLS[:6], *(pytest.param(*call, marks=pytest.mark.slow) for call in CALLS[6:])]
)
def test_a_picture_can_be_handed_on(
    name: str, words: str | None, draw: Draw, caplog: pytest.LogCaptureFixture
) -> None:
    assert faults(draw(name, words)) == []
    # matplotlib's own remarks would stand on the user's terminal
    assert [record.message for record in caplog.records] == []


def test_a_straight_guide_has_no_band_across_it(draw: Draw) -> None:
    """The worst case across the path of a point on a straight guide is zero, at the dead centre too, where the path turns back."""
    axes = draw("tolerances", None).axes[0]
    (band,) = axes.collections
    assert isinstance(band, PolyCollection)
    corners = np.concatenate([path.vertices for path in band.get_paths()])
    assert np.ptp(corners[:, 0]) == pytest.approx(100, rel=0.01)
    assert np.abs(corners[:, 1]).max() < 1e-9
    assert axes.get_title() == "paths with their worst case across"


@pytest.mark.parametrize("side", [1, -1])
def test_one_pose_has_points_with_the_worst_case_of_each_coordinate(draw: Draw, side: int) -> None:
    """The pin B of a crank of 50 mm, 0.05 mm long or short, errs by 0.05 cos 40° and 0.05 sin 40°: drawn 100 times as wide."""
    axes = draw("tolerances", f"--at {40 * side}deg").axes[0]
    assert axes.get_title() == "points with their worst case in x and y, drawn 100 times as wide"
    bars = {bars.get_label(): bars for bars in axes.containers}
    (_, caps, (across, up)) = bars["B"]
    assert len(caps) == 4
    (x,), (y,) = across.get_segments(), up.get_segments()
    assert np.ptp(x[:, 0]) == pytest.approx(2 * 100 * 0.05 * np.cos(np.radians(40)))
    assert np.ptp(y[:, 1]) == pytest.approx(2 * 100 * 0.05 * np.sin(np.radians(40)))
    assert y[:, 1].mean() == pytest.approx(side * 50 * np.sin(np.radians(40)))


def test_names_with_dollars_are_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`$x^{$` is no formula, nor is a plane `A$\\frac$`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.csv").write_text("name,unbalance_g_mm,angle_deg\n$x^{$,10,20\n")
    call = ["dalembert", "balance", "r.csv", "--plane", "A$\\frac$:20mm", "--plot", "r.svg", "-o", "o.csv"]
    monkeypatch.setattr("sys.argv", call)
    with contextlib.suppress(SystemExit):
        main()
    picture = (tmp_path / "r.svg").read_text()
    assert "<!-- $x^{$ -->" in picture
    assert "A$\\frac$ -->" in picture
