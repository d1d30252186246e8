"""Fits to an effort, and fits that keep bounds, against closed forms, hidden dimensions and another solver."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from virtualwork import (
    DescriptionError,
    Guess,
    Guide,
    Input,
    Link,
    Mechanism,
    MechanismError,
    Spring,
    TorsionSpring,
)
from virtualwork.family.keep import Bound, Bounds
from virtualwork.family.target import Target

G = 9.81


def bar(**loads: Any) -> Mechanism:
    """A bar of 2 kg on a pivot, its centre of mass at 0.5 m, a spring of no free length from 0.3 m to 0.5 m above it."""
    spring = Spring((("bar", "K"), ("ground", "T")), 10.0, 0.0)
    return Mechanism(
        {"O": 0j, "T": 0.5j}, {"bar": Link({"O": 0j, "K": 0.3}, 2.0, 0.5, 0.1)},
        inputs=Input(link="bar", **loads), gravity=-G * 1j, springs=[spring],
    )  # fmt: skip


def four_bar(a: float = 0.3, b: float = 1.0, c: float = 0.8, z: complex = 0.5 + 0.3j) -> Mechanism:
    """A four-bar on a base of 1 m with a coupler point."""
    links = {
        "crank": Link({"A": 0j, "B": a}), "coupler": Link({"B": 0j, "C": b, "P": z}), "rocker": Link({"D": 0j, "C": c})
    }  # fmt: skip
    return Mechanism(
        {"A": 0j, "D": 1 + 0j},
        links,
        inputs=Input("crank"),
        guess=Guess(0.0, {"coupler": 0.9, "rocker": 1.6}),
    )


FREE = {"links.crank.B.x": (0.1, 0.5), "links.coupler.C.x": (0.5, 1.5), "links.rocker.C.x": (0.4, 1.5)}
TURN = np.linspace(0, 2 * np.pi, 24, endpoint=False)


def least_transmission(a: float, b: float, c: float) -> float:
    """Of a crank-rocker: with the crank in line with the base (law of cosines)."""
    angles = [math.acos((b * b + c * c - d * d) / (2 * b * c)) for d in (1 - a, 1 + a)]
    return min(min(x, math.pi - x) for x in angles)


def test_a_spring_balances_a_weight() -> None:
    """No effort at any angle: k a h = m g r, whatever the angles of the target."""
    found = bar().fit(
        [Target({"effort.bar": np.zeros(5)}, inputs=np.linspace(-1, 1, 5))],
        free={"springs.1.stiffness": (1, 1000)},
    )
    assert found.parameters["springs.1.stiffness"] == pytest.approx(2 * G * 0.5 / (0.3 * 0.5), rel=1e-13)
    assert found.max < 1e-13


def test_an_effort_in_motion_has_the_inertia() -> None:
    """At the file's own acceleration: (I + m r²) α beside the loads; the mass is found back."""
    m, q = bar(speed=2.0, acceleration=3.0), np.linspace(-1, 1, 7)
    want = m.changed({"links.bar.mass": 3.5, "springs.1.stiffness": 25.0}).motion(q).effort
    free = {"links.bar.mass": (1, 6), "springs.1.stiffness": (1, 100)}
    found = m.fit([Target({"effort.bar": want}, inputs=q)], free=free)
    assert found.values == pytest.approx([3.5, 25.0], rel=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_a_torque_curve_of_a_four_bar(seed: int) -> None:
    """Hidden spring and length are found back."""
    rng = np.random.default_rng(seed)
    m = four_bar().changed({})
    loads: dict[str, Any] = {
        "springs": [Spring((("rocker", "C"), ("ground", "A")), 100.0, 0.4)],
        "gravity": -G * 1j,
    }
    links = dict(m.links) | {"rocker": Link({"D": 0j, "C": 0.8}, 2.0, 0.4, 0.1)}
    m = Mechanism(m.ground, links, inputs=m.inputs, guess=m.guess, **loads)
    hidden = {
        "springs.1.stiffness": rng.uniform(50, 400),
        "springs.1.free_length": rng.uniform(0.2, 0.7),
        "links.rocker.C.x": rng.uniform(0.75, 0.9),
    }
    want = m.changed(hidden).motion(TURN, 0.0, 0.0).effort
    free = {
        "springs.1.stiffness": (20, 500),
        "springs.1.free_length": (0.1, 0.8),
        "links.rocker.C.x": (0.7, 0.95),
    }
    found = m.fit([Target({"effort.crank": want}, inputs=TURN)], free=free, starts=32)
    assert found.parameters == pytest.approx(hidden, rel=1e-9)


def test_a_bound_that_does_not_press_changes_nothing() -> None:
    """The hidden four-bar has 45.86°: 40° is kept by itself."""
    want = four_bar(0.35, 0.9, 0.7).motion(TURN).point("P").position
    aim = [Target({"P": want}, inputs=TURN)]
    found = four_bar().fit(aim, free=FREE, keep=[Bound("transmission", least=math.radians(40))])
    assert found.values == pytest.approx([0.35, 0.9, 0.7], rel=1e-12)
    (kept,) = found.kept
    assert kept.met
    assert kept.extreme == pytest.approx(least_transmission(0.35, 0.9, 0.7), abs=1e-5)


@pytest.mark.slow
def test_a_bound_that_presses_is_met_to_rounding() -> None:
    """Above 50° the least transmission is 50°, and another solver finds no better four-bar."""
    from scipy.optimize import minimize

    want = four_bar(0.35, 0.9, 0.7).motion(TURN).point("P").position
    least = math.radians(50)
    # the extreme poses of a crank in line with the base are among those that are held
    inputs = np.append(TURN, 2 * np.pi)
    want = np.vstack([want, want[:1]])
    found = four_bar().fit(
        [Target({"P": want}, inputs=inputs)], free=FREE, keep=[Bound("transmission", least=least)], starts=32
    )
    assert least_transmission(*found.values) == pytest.approx(least, abs=1e-8)

    def cost(x: Any) -> float:
        at = four_bar(*x).motion(inputs).point("P").position
        return float(np.nan_to_num(((at - want) ** 2).sum(), nan=1e3))

    other = minimize(
        cost, found.values + 0.01, method="SLSQP", bounds=list(FREE.values()), options={"ftol": 1e-14, "maxiter": 300},
        constraints={"type": "ineq", "fun": lambda x: least_transmission(*x) - least},
    )  # fmt: skip
    assert cost(found.values) <= other.fun * (1 + 1e-6)
    assert found.values == pytest.approx(other.x, abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "bound"),
    [("points.P.y", {"most": 0.7}), ("links.coupler", {"most": 0.9}), ("points.P.x", {"least": 0.1})],
)
def test_coordinates_and_angles_are_kept(name: str, bound: dict[str, float]) -> None:
    """The extreme over a fine sweep lies at the bound."""
    want = four_bar(0.35, 0.9, 0.7).motion(TURN).point("P").position
    found = four_bar().fit(
        [Target({"P": want}, inputs=TURN)], free=FREE, keep=[Bound(name, **bound)], starts=16
    )
    motion = found.mechanism.motion(np.linspace(0, TURN[-1], 20_001))
    values = (
        motion.link("coupler").angle
        if name == "links.coupler"
        else motion.point("P").position[:, "xy".index(name[-1])]
    )
    (number,) = bound.values()
    extreme = values.max() if "most" in bound else values.min()
    assert extreme == pytest.approx(number, abs=3e-8)
    assert (extreme - number) * (1 if "most" in bound else -1) < 1e-8


def test_what_cannot_be_kept_is_refused() -> None:
    """With the nearest that was reached."""
    want = four_bar(0.35, 0.9, 0.7).motion(TURN).point("P").position
    free = {"links.crank.B.x": (0.3, 0.4)}
    with pytest.raises(MechanismError, match=r"keeps transmission >= 85 deg \(it comes to [\d.]+ deg\)"):
        four_bar().fit(
            [Target({"P": want}, inputs=TURN)],
            free=free,
            keep=[Bound("transmission", least=math.radians(85))],
            starts=4,
        )


def test_bad_bounds() -> None:
    """Each is named."""
    m = four_bar()
    for bound, said in (
        (Bound("transmission", most=1.0), "least angle"),
        (Bound("transmission", least=2.0), "0 to 90"),
        (Bound("points.P", least=1.0), "two coordinates"),
        (Bound("points.Q.x", least=1.0), "no point"),
        (Bound("effort.rocker", most=1.0), "no input is named 'rocker': expected crank"),
    ):
        with pytest.raises(DescriptionError, match=said):
            Bounds(m, (), [bound])
    for bound in (Bound("points.P.x"), Bound("points.P.x", 0.0, 1.0), Bound("points.P.x", math.nan)):
        with pytest.raises(ValueError, match="one bound"):
            _ = bound.value


def test_transmissions_of_every_kind_of_group() -> None:
    """Rod and guide: asin |cos|; a slot: as it passes its pivot; with exact derivatives."""
    from virtualwork.describe.dimensions import named

    crank = {"crank": Link({"O": 0j, "A": 0.05}), "rod": Link({"A": 0j, "B": 0.2})}
    slider = Mechanism(
        {"O": 0j},
        crank,
        [Guide("B", "rod", through=0.02j)],
        inputs=Input("crank"),
        guess=Guess(0.3, {"rod": 0.0}),
    )
    links = {"crank": Link({"O": 0j, "A": 0.05}), "arm": Link({"D": 0j})}
    slot = Mechanism(
        {"O": 0j, "D": -0.2j},
        links,
        [Guide("A", "crank", "arm", 0.03j, 0.0)],
        inputs=Input("crank"),
        guess=Guess(0.3, {"arm": 1.5}),
    )
    q = np.linspace(0, 6, 40)
    for m, path in ((slider, "links.crank.A.x"), (slot, "links.crank.A.x")):
        (d,) = named(m, path)
        bounds = Bounds(m, (d,), [Bound("transmission", least=0.0)])
        at = np.array([0.05])
        motion = m.motion(q)
        if m is slider:
            expected = np.cos(motion.link("rod").angle) ** 2
        else:
            reach = motion.point("A").position @ [1, 1j] + 0.2j
            along = reach * np.exp(-1j * motion.link("arm").angle)
            assert np.allclose(along.imag, 0.03, atol=1e-14)
            expected = along.real**2 / np.abs(reach) ** 2
        assert bounds.margins(at, q)[0] == pytest.approx(expected, rel=1e-12, abs=1e-14)
        step = 1e-6
        slopes = (bounds.margins(at + step, q) - bounds.margins(at - step, q))[0] / (2 * step)
        assert bounds.slopes(at, q)[0, :, 0] == pytest.approx(slopes, rel=1e-6, abs=1e-7)


def test_a_torque_that_no_spring_gives_is_left() -> None:
    """A torsion spring is a line over the angle: of a parabola the fitted line is that of least squares."""
    m = Mechanism(
        {"O": 0j},
        {"bar": Link({"O": 0j})},
        inputs=Input("bar"),
        torsion_springs=[TorsionSpring(("ground", "bar"), 1.0, 0.0)],
    )
    q = np.linspace(0, 1, 11)
    found = m.fit(
        [Target({"effort.bar": q**2}, inputs=q)],
        free={"torsion_springs.1.stiffness": (0.1, 5), "torsion_springs.1.free_angle": (-1, 1)},
    )
    slope, start = np.polyfit(q, q**2, 1)
    assert found.parameters["torsion_springs.1.stiffness"] == pytest.approx(slope, rel=1e-9)
    assert -found.parameters["torsion_springs.1.free_angle"] * slope == pytest.approx(start, rel=1e-8)
