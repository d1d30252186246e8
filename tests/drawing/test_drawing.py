"""What pictures share: labels that keep clear, units with their prefix, curves that can be told apart."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from importlib.resources import files

import numpy as np
import pytest
from faults import faults
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from dalembert.drawing.amounts import prefixed, quiet
from dalembert.drawing.curves import COLORS, DASHES, Curve, panel, spread
from dalembert.drawing.labels import Label, place
from dalembert.drawing.polar import FOUND, GIVEN, Vector, dial
from dalembert.drawing.sheet import sheet
from virtualwork import Mechanism

PREFIX = {"n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}


def value_of(unit: str, base: str) -> float:
    """Return how many of the base a unit with a prefix is, read off its letters."""
    raised = re.fullmatch(rf"(?:10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+) )?([nµmkMG]?){re.escape(base)}", unit)
    assert raised, unit
    power = (raised[1] or "⁰").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    return 10.0 ** int(power) * PREFIX[raised[2]]


@pytest.mark.parametrize("base", ["N", "N·m", "W", "rad/s²", "µm pk-pk", "mil"])
@pytest.mark.parametrize("exponent", range(-12, 13))
def test_a_prefix_changes_no_value(base: str, exponent: int) -> None:
    size = 3.7 * 10.0**exponent
    factor, unit = prefixed(size, base)
    letters = base.lstrip("µ") if base.startswith("µ") else base
    own = value_of(base, letters)
    assert factor * value_of(unit, letters) / own == pytest.approx(1, rel=1e-12)
    assert 0.01 <= size * factor < 1e4


@pytest.mark.parametrize("size", [0.0, math.inf, math.nan])
def test_without_a_size_the_unit_stays(size: float) -> None:
    assert prefixed(size, "N") == (1, "N")


def test_noise_is_zero_and_a_constant_is_constant() -> None:
    rng = np.random.default_rng(1)
    noise = 1e-14 * rng.standard_normal(100)
    assert not quiet(noise, 1.0).any()
    assert np.ptp(quiet(1.5 + noise, 1.0)) == 0
    signal = np.sin(np.linspace(0, 7, 100))
    np.testing.assert_allclose(quiet(signal, 1.0), signal, atol=1e-12)
    assert np.isnan(quiet([np.nan, 1.0], 1.0)).tolist() == [True, False]


@pytest.mark.parametrize("seed", range(5))
def test_labels_lie_neither_on_each_other_nor_outside(seed: int) -> None:
    """Thirty names at points of which many nearly coincide."""
    rng = np.random.default_rng(seed)
    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.subplots()
    points = np.round(rng.random((30, 2)), 1) + 1e-3 * rng.random((30, 2))
    axes.plot(*points.T, "o")
    written = place([(axes, [Label(f"point {i}", (x, y)) for i, (x, y) in enumerate(points.tolist())])])
    assert len(written) == 30
    assert faults(figure) == []


def test_the_faults_of_a_figure_are_seen() -> None:
    figure = Figure(figsize=(4, 3))
    axes = figure.subplots()
    axes.plot([0, 1], [0, 2e9])
    for x in (0.5, 0.52):
        axes.text(x, 1e9, "a name")
    axes.text(0.98, 1e9, "a name that leaves the sheet")
    found = faults(figure)
    assert any("lies on" in fault for fault in found)
    assert any("cut off" in fault for fault in found)
    assert any("offset" in fault for fault in found)


def grey(color: str) -> float:
    """Return a colour's luminance, as a print in grey has it (Rec. 601, as PIL's)."""
    r, g, b = to_rgb(color)
    return 0.299 * r + 0.587 * g + 0.114 * b


def test_curves_are_told_apart_in_grey_too() -> None:
    figure = Figure()
    axes = figure.subplots()
    x = np.linspace(0, 1, 5)
    panel(axes, x, [Curve(str(k), k * x) for k in range(1, 25)], "", "N")
    looks = [(line._unscaled_dash_pattern, grey(line.get_color())) for line in axes.lines]  # type: ignore[attr-defined]
    assert len(looks) == 24
    assert len(COLORS) == len(DASHES) == 6
    for i, (dash, shade) in enumerate(looks[:12]):
        for other, its in looks[:i]:
            assert dash != other or abs(shade - its) > 0.1


def test_equal_curves_are_said_once() -> None:
    figure = sheet(6, 3, Figure())
    axes = figure.subplots()
    x = np.linspace(0, 1, 50)
    curves = [Curve("A", x), Curve("B", 2 * x), Curve("C", x * (1 + 1e-13)), Curve("D", x * (1 + 1e-6))]
    ends = panel(axes, x, curves, "force", "N")
    spread([ends])
    assert [text.get_text() for text in ends.names] == ["A = C", "B", "D"]
    assert len(axes.lines) == 3
    assert faults(figure) == []  # type: ignore[arg-type]


def test_without_values_no_scale_is_made_up() -> None:
    axes = Figure().subplots()
    x = np.linspace(5, 6, 3)
    panel(axes, x, [Curve("A", x * np.nan)], "", "N")
    assert len(axes.get_yticks()) == 0
    assert axes.get_xlim()[0] <= 5 < 6 <= axes.get_xlim()[1] < 7
    assert [text.get_text() for text in axes.texts] == ["no values"]
    dials = Figure().add_subplot(projection="polar")
    dial(dials, "", [Vector(0, GIVEN)])
    assert len(dials.get_yticks()) == 0


def test_a_mechanism_that_stands_nowhere_is_no_empty_frame() -> None:
    m = Mechanism.from_toml(str(files("cli.examples") / "boom" / "boom.toml"))
    axes = m.motion([5.0, 6.0]).plot(figure=Figure())
    assert [text.get_text() for text in axes.texts] == ["cannot be assembled in any of these poses"]
    assert len(axes.get_xticks()) == len(axes.get_yticks()) == 0


def test_a_gap_makes_curves_differ() -> None:
    axes = Figure().subplots()
    x = np.linspace(0, 1, 5)
    ends = panel(axes, x, [Curve("A", x), Curve("B", np.where(x > 0.5, np.nan, x))], "", "N")
    assert [text.get_text() for text in ends.names] == ["A", "B"]


@pytest.mark.parametrize("count", [1, 40, 41])
def test_what_few_values_are_of_is_seen(count: int) -> None:
    """A line between poses that were not computed has a dot at each that was; a mean is everywhere, and has none."""
    axes = Figure().subplots()
    x = np.arange(count, dtype=float)
    panel(axes, x, [Curve("A", x**2), Curve("mean", 0 * x + 0.5, level=True)], "", "N")
    line, mean = axes.lines
    assert (line.get_marker(), line.get_markevery()) == (
        ("o", [*range(count)]) if count <= 40 else ("None", None)
    )
    assert mean.get_marker() == "None"


def test_a_pose_between_two_gaps_is_seen() -> None:
    """No line leads to it: of a sweep with one pose that can be assembled nothing was drawn."""
    axes = Figure().subplots()
    values = np.full(100, np.nan)
    values[[0, 7, 8, 30, 99]] = 1.0, 2.0, 3.0, 4.0, 5.0
    panel(axes, np.arange(100.0), [Curve("A", values)], "", "N")
    assert axes.lines[0].get_markevery() == [0, 30, 99]


@pytest.mark.parametrize("count", [2, 9, 20])
def test_names_at_the_ends_keep_clear(count: int) -> None:
    figure = sheet(6, 0.17 * count + 1.5, Figure())
    axes = figure.subplots()
    x = np.linspace(0, 1, 50)
    # all meet at the end
    spread([panel(axes, x, [Curve(f"curve {k}", k * (1 - x)) for k in range(1, count + 1)], "", "N")])
    assert faults(figure) == []  # type: ignore[arg-type]


def test_what_nearly_vanishes_is_a_dot() -> None:
    axes = Figure().add_subplot(projection="polar")
    dial(axes, "", [Vector(1.0, GIVEN), Vector(1e-16j, FOUND), Vector(0.5j, FOUND)])
    dots = [line for line in axes.lines if line.get_marker() == "o"]
    assert len(dots) == 1
    assert dots[0].get_ydata()[0] == 1e-16
    assert len(axes.texts) == 2  # the heads of the two arrows


def test_an_empty_figure_takes_the_size_and_another_keeps_it() -> None:
    assert sheet(3, 2, Figure(figsize=(9, 9))).get_size_inches().tolist() == [3, 2]  # type: ignore[attr-defined]
    used = Figure(figsize=(9, 9))
    used.subplots()
    assert sheet(3, 2, used).get_size_inches().tolist() == [9, 9]  # type: ignore[attr-defined]


def test_without_matplotlib_the_extra_is_named() -> None:
    script = (
        "import sys; sys.modules['matplotlib'] = None; sys.modules['matplotlib.figure'] = None\n"
        "from balancing import correct\n"
        "try:\n    correct([1.0], z=[0.0], planes=[0.0]).plot()\n"
        "except ImportError as error:\n    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "dalembert[plot]" in done.stdout
