"""`.plot()` of the library's results: axes of matplotlib whose lines are the results' own numbers."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files

import numpy as np
import pytest
from faults import faults
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from balancing import LogBalance, correct, joint_fit, least_squares, place
from rigidbody3d import Body, FreeBody, Shaft, Top, compose, integrate
from virtualwork import DescriptionError, LinkStates, Mechanism, UnitLoad, balance

MOMENT = np.array([9 * 0.030, 6 * 0.050]) * np.exp(1j * np.radians([60, 210]))
ON = np.array([[0], [1], [1j], [-1]])
FIT = joint_fit(5 + 2 * ON + 0.1 * np.array([[1], [-1], [0], [1]]), ON)
ROD = Body.of("rod", 4.0, length=1.0).turned([[0.5, 0, np.sqrt(0.75)], [0, 1, 0], [-np.sqrt(0.75), 0, 0.5]])
PARTS = Body.of("cylinder", [3.0, -0.5], [[0, 0, 0.1], [0.03, 0, 0.1]], radius=[0.1, 0.02], length=0.2)
KLANN_TOML = (files("cli") / "examples/klann/klann.toml").read_text()
KLANN = Mechanism.from_toml_text(KLANN_TOML)
ENGINE = Mechanism.from_toml(str(files("cli") / "examples/engine/engine.toml"))
PENDULUM = Mechanism.from_toml(str(files("cli") / "examples/double-pendulum/double-pendulum.toml"))
SLIDER_CRANK = LinkStates(
    velocity=[0, 300 + 200j, -500],
    omega=[20, -50, 0],
    mass=[0, 3, 2],
    inertia=[0, 0.1, 0],
    acceleration=[0, 900 - 600j, 900],
    alpha=[0, -800, 0],
    force=[0, 0, 5000],
    gravity=-10j,
)
TWICE = LinkStates(velocity=[[1, 2, 3], [2, 3, 4]], omega=[2, 0, 0], force=[0, 0, 5])
SWEEP = np.linspace(0, 4 * np.pi, 73)
PLOTS: dict[str, Callable[[Figure], object]] = {
    "correct": lambda f: correct(MOMENT, [0.020, 0.065], [0, 0.090]).plot(figure=f),
    "one plane": lambda f: correct(MOMENT, [0, 0], [0]).plot(["fan", "hub"], ["disc"], figure=f),
    "rotors": lambda f: correct(np.outer([1, 2, 3, 4, 5], MOMENT), [0.020, 0.065], [0, 0.090]).plot(figure=f),
    "least squares": lambda f: least_squares([[3, -2], [5, -2], [5, -3j]], [1, -1, 0]).plot(figure=f),
    "fit": lambda f: FIT.plot(["bearing"], "mm/s", figure=f),
    "log": lambda f: LogBalance(
        FIT, least_squares(FIT.influence, FIT.initial).corrections, FIT.scatter()
    ).plot(figure=f),
    "placement": lambda f: place(0.0835, np.arange(16) * np.pi / 8 + 0.1).plot(figure=f),
    "pose": lambda f: KLANN.motion(np.pi / 3).plot(figure=f),
    "motion": lambda f: KLANN.motion(SWEEP, speed=2.0).plot(figure=f),
    "curves": lambda f: KLANN.motion(SWEEP, speed=2.0).plot_curves("H.x", "H.y", "leg.omega", figure=f),
    "forces": lambda f: ENGINE.motion(SWEEP).dynamics.plot(figure=f),
    "in time": lambda f: PENDULUM.simulate(np.linspace(0, 1, 9), accuracy=1e-6).plot(figure=f),
    "work": lambda f: balance(SLIDER_CRANK, [UnitLoad(torque=[1, 0, 0])]).plot(["crank", "rod", "slider"], f),
    "work at instants": lambda f: balance(TWICE, [UnitLoad(torque=[1, 0, 0])]).plot(figure=f),
    "body": lambda f: compose(PARTS).plot(["disc", "hole"], {"ω": [0, 1, 1]}, figure=f),
    "tensor": lambda f: Body(1.0, [0, 0, 0], np.diag([1.0, 2, 2.5])).plot(figure=f),
    "shaft": lambda f: Shaft(ROD, (-0.5, 0.5), 10.0, gravity=[0, -9.81, 0]).plot(figure=f),
    "free body": lambda f: FreeBody([1, 2, 3], [0.1, 1.0, 0.1]).at(np.linspace(0, 30, 400)).plot(figure=f),
    "top": lambda f: (
        Top([1, 1, 0.5], 1.0, [0.1, 0.2, 9.0], [0.9, 0.1, 0.2, 0.3]).at(np.linspace(0, 9, 400)).plot(figure=f)
    ),
    "integrated": lambda f: integrate(
        [1.0, 2, 3], [0.1, 1, 0.1], [1, 0, 0, 0], np.linspace(0, 9, 99), torque=[0, 0, 1]
    ).plot(figure=f),
}


@pytest.mark.parametrize("name", PLOTS)
def test_a_plot_returns_axes_in_the_figure_given(name: str) -> None:
    figure = Figure()
    axes = np.atleast_1d(np.asarray(PLOTS[name](figure), dtype=object)).ravel()
    assert len(axes) > 0
    assert all(isinstance(one, Axes) and one.figure.figure is figure for one in axes)
    assert faults(figure) == []


def test_without_a_figure_it_is_one_of_pyplots(monkeypatch: pytest.MonkeyPatch) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    axes = KLANN.motion(1.0).plot()
    assert pyplot.gcf() is axes.figure
    pyplot.close("all")


def tips(axes: PolarAxes) -> list[complex]:
    """Return where the arrows of a dial end."""
    return [r * np.exp(1j * a) for a, r in (text.xy for text in axes.texts if not text.get_text())]


def test_bars_are_the_powers_of_the_loads() -> None:
    """Riul's example 1: 103 kN·m at 20 rad/s against the others, which are 0.9 − 0.45 − 0.006 − 0.004 − 2.5 MW."""
    (axes,) = balance(SLIDER_CRANK, [UnitLoad(torque=[1, 0, 0])]).plot(["crank", "rod", "slider"], Figure())
    named = [label.get_text() for label in axes.get_yticklabels()]
    bars = dict(zip(named, (bar.get_width() for bar in axes.patches), strict=True))
    assert axes.get_xlabel().startswith("virtual power, MW")
    expected = {
        "slider: applied force": -2.5,
        "rod: weight": -0.006,
        "rod: inertia force": -0.45,
        "slider: inertia force": 0.9,
        "rod: inertia torque": -0.004,
        "crank: unknown": 2.06,
    }
    assert bars == pytest.approx(expected, rel=1e-9)


def test_two_velocity_fields_have_bars_of_their_own() -> None:
    """Two unknown torques of 3 and −2 N·m against forces of −3 N and 2 N at 1 m/s in each one's own field."""
    states = LinkStates(velocity=[[1, 0], [0, 1]], omega=[[1, 0], [0, 1]], force=[-3, 2])
    found = balance(states, [UnitLoad(torque=[1, 0]), UnitLoad(torque=[0, 1])])
    (axes,) = found.plot(figure=Figure())
    named = [label.get_text() for label in axes.get_yticklabels()]
    bars = dict(zip(named, (bar.get_width() for bar in axes.patches), strict=True))
    assert bars == pytest.approx(
        {
            "1: applied force (field 1)": -3.0,
            "1: unknown (field 1)": 3.0,
            "2: unknown (field 1)": 0.0,
            "2: applied force (field 2)": 2.0,
            "1: unknown (field 2)": 0.0,
            "2: unknown (field 2)": -2.0,
        }
    )


def test_a_motion_in_time_is_drawn_through_more_times_than_asked_for() -> None:
    """The curves pass through the run's own states, and lie within their tolerance of a finer run between."""
    run = PENDULUM.simulate(np.linspace(0, 1, 5), accuracy=1e-9)
    fine = PENDULUM.simulate(np.linspace(0, 1, 41), accuracy=1e-9)
    angle, *_ = run.plot(Figure())
    for line, own, other in zip(angle.lines, run.angle.T, fine.angle.T, strict=True):
        t, drawn = line.get_data()
        assert np.interp(run.t, t, drawn) == pytest.approx(np.degrees(own), abs=1e-6)
        assert np.interp(fine.t, t, drawn) == pytest.approx(np.degrees(other), abs=1e-3)


def test_arrows_are_the_results_own_numbers() -> None:
    """Riul, example 2: shares add up to the resultant, the correction cancels it, all in one unit."""
    fix = correct(MOMENT, [0.020, 0.065], [0, 0.090])
    for k, axes in enumerate(fix.plot(figure=Figure())):
        first, second, resultant, correction = np.array(tips(axes)) * 1e-3  # kg·mm
        assert first + second == pytest.approx(resultant)
        assert correction == pytest.approx(fix.unbalance[k])
        assert resultant == pytest.approx(-fix.unbalance[k])
        assert first == pytest.approx(MOMENT[0] * (0.070 if k == 0 else 0.020) / 0.090)


def test_curves_are_the_motions_own_numbers() -> None:
    motion = KLANN.motion(SWEEP, speed=2.0)
    top, bottom = motion.plot_curves("H.x", "leg.omega", figure=Figure())
    np.testing.assert_allclose(top.lines[0].get_ydata(), motion.point("H").position[:, 0], atol=1e-11)
    np.testing.assert_allclose(bottom.lines[0].get_ydata(), motion.link("leg").omega, atol=1e-10)
    np.testing.assert_allclose(bottom.lines[0].get_xdata(), np.degrees(SWEEP))


def test_the_drawing_is_to_scale() -> None:
    motion = KLANN.motion(np.pi / 3)
    axes = motion.plot(figure=Figure())
    # pins and free points are circles: their middle is that of their outline
    drawn = np.array(
        [line.get_xydata()[:-1].mean(axis=0) for line in axes.lines if len(line.get_xydata()) == 73]
    )
    for name in "ABCDEFGH":
        at = 1e3 * motion.point(name).position[0]
        assert np.abs(drawn - at).max(axis=1).min() < 1e-9, name
    assert axes.get_aspect() == 1.0


def test_curves_of_a_vector_and_of_an_effort() -> None:
    """The way from A to H is the difference of both points; its angle goes on through whole turns as a link's does."""
    motion = ENGINE.motion(SWEEP, speed=100.0, acceleration=0.0)
    length, angle, torque = motion.plot_curves("B-A.length", "A-O.angle", "crank.torque", figure=Figure())
    apart = np.hypot(*(motion.point("B").position - motion.point("A").position).T)
    assert length.lines[0].get_ydata() == pytest.approx(apart, rel=1e-9)
    assert angle.lines[0].get_ydata() == pytest.approx(np.degrees(SWEEP), abs=1e-9 * 720)
    assert torque.get_ylabel().endswith("N·m")
    assert torque.lines[0].get_ydata() == pytest.approx(motion.effort, abs=1e-9 * np.abs(motion.effort).max())


@pytest.mark.parametrize("word", ["Q.x", "H.q", "leg.x", "H"])
def test_a_bad_name_is_named(word: str) -> None:
    with pytest.raises(DescriptionError, match=word):
        KLANN.motion(1.0).plot_curves(word, figure=Figure())


def test_a_slotted_link_is_drawn_to_its_pin() -> None:
    quick = Mechanism.from_toml(str(files("cli") / "examples/quick-return/quick-return.toml"))
    for angle in np.radians([0, 80, 200]):
        motion = quick.motion(angle)
        axes = motion.plot(figure=Figure())
        pin, pivot = (complex(*(1e3 * motion.point(p).position[0])) for p in "BC")
        lines = [line.get_xydata() @ [1, 1j] for line in axes.lines if line.get_linewidth() == 2.2]
        # some line as wide as a link holds the pin and points to the link's pivot
        assert any(
            abs(a - pin) + abs(b - pin) == pytest.approx(abs(a - b))
            and abs(((pin - pivot) / (b - a)).imag) < 1e-9
            for a, b in (line for line in lines if len(line) == 2)
        )


def test_noise_is_drawn_as_zero() -> None:
    """A parallelogram's coupler does not turn: what rounding leaves of its ω and α is zero in the picture."""
    bars = Mechanism.from_toml(str(files("cli") / "examples/parallelogram/parallelogram.toml"))
    motion = bars.motion(np.linspace(0, 4 * np.pi, 91))
    for name in ("coupler.omega", "coupler.alpha"):
        (axes,) = motion.plot_curves(name, figure=Figure())
        assert not np.any(axes.lines[0].get_ydata())


def test_what_is_zero_everywhere_has_one_number_on_its_axis() -> None:
    """A shaft on its own axis loads no bearing, a leg without masses no joint: a scale about zero would be made up."""
    balanced = Shaft(Body.of("cylinder", 1.0, radius=0.05, length=0.1), (-0.1, 0.1), 60.0).plot(
        figure=Figure()
    )
    resting = KLANN.motion(SWEEP, speed=2.0).dynamics.plot(figure=Figure())
    coupler = KLANN.motion(SWEEP, speed=0.0).plot_curves("coupler.omega", figure=Figure())
    for axes in (*balanced[1], resting[0], resting[-1], *coupler):
        assert list(axes.get_yticks()) == [0]


def test_long_names_leave_room_for_their_curves() -> None:
    name = "the crank of the machine in the second hall on the left"
    text = KLANN_TOML.replace("[links.crank]", f'[links."{name}"]').replace('"crank"', f'"{name}"')
    motion = Mechanism.from_toml_text(text).motion(SWEEP, speed=2.0)
    figure = Figure()
    (axes,) = motion.plot_curves(f"{name}.omega", "leg.omega", figure=figure)
    figure.draw_without_rendering()
    assert faults(figure) == []
    assert axes.bbox.width > 0.4 * figure.bbox.width


def test_parts_are_drawn_as_their_shapes_to_scale() -> None:
    """A tube of radius 50 and 30, length 200, along x: a rectangle from the side, two circles along its axis."""
    turn = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    tube = Body.of("tube", 2.0, [0.3, 0, 0], radius=0.05, inner_radius=0.03, length=0.2).turned(turn)
    extents = []
    for axes in tube.plot(figure=Figure()):
        outline = np.concatenate([patch.get_xy() for patch in axes.patches])
        extents.append((axes.get_xlabel()[0], axes.get_ylabel()[0], *np.ptp(outline, axis=0).round(6)))
    assert extents == [("x", "z", 200.0, 100.0), ("x", "y", 200.0, 100.0)]


def test_moved_and_turned_bodies_keep_their_shapes() -> None:
    rod = (
        Body.of("rod", 1.0, length=2.0).moved([0, 0, 1]).turned([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], [0, 0, 0])
    )
    (solid,) = rod.solids()
    np.testing.assert_allclose(solid.center, rod.center)
    np.testing.assert_allclose(solid.rotation @ [0, 0, 1], [1, 0, 0])
    both = compose(Body.of("sphere", [1.0, 2.0], [[0, 0, 0], [1, 0, 0]], radius=[0.1, 0.2]))
    assert [(s.shape, s.mass, s.dimensions["radius"]) for s in both.solids()] == [
        ("sphere", 1, 0.1),
        ("sphere", 2, 0.2),
    ]


def test_the_ellipsoid_of_a_tensor_has_that_tensor() -> None:
    """m/5 (b² + c²) …: the homogeneous ellipsoid's moments."""
    (solid,) = Body(2.0, [0, 0, 0], np.diag([1.0, 2.0, 2.5])).solids()
    square = np.square([solid.dimensions[name] for name in "abc"])
    moments = 2.0 / 5 * (square.sum() - square)
    np.testing.assert_allclose(
        solid.rotation @ np.diag(moments) @ solid.rotation.T, np.diag([1.0, 2.0, 2.5]), atol=1e-12
    )


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: PARTS.plot(figure=Figure()),
        lambda: FreeBody([1, 2, 3], [0.1, 1, 0.1]).at(1.0).plot(figure=Figure()),
        lambda: FreeBody([1, 2, 3], np.ones((2, 3))).at([0.0, 1.0]).plot(figure=Figure()),
    ],
)
def test_what_one_picture_cannot_show_is_refused(wrong: Callable[[], object]) -> None:
    with pytest.raises(ValueError, match="a picture shows one body"):
        wrong()
