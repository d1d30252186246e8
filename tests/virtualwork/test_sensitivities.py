"""Derivatives to dimensions against differences in fifty digits, and against mechanisms a little different."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from virtualwork import Force, Friction, Guess, Guide, Input, Link, Mechanism, Motor, Spring, Torque
from virtualwork.describe import DescriptionError, MechanismError
from virtualwork.describe.dimensions import changed, dimensions, value
from virtualwork.describe.parts import Polar
from virtualwork.formulas.kinematics import Point

KINDS = ["four-bar", "slider-crank", "inverted slider-crank", "Watt", "Stephenson", "triad"]
FOUR = {"crank": 0.04, "coupler": 0.12, "rocker": 0.08, "ground": 0.1, "along": 0.06, "turn": 0.5}


def four_bar(**lengths):
    n = FOUR | lengths
    links = {
        "crank": Link({"A": 0j, "B": n["crank"]}, 0.5, 0.02, 1e-4),
        "coupler": Link(
            {"B": 0j, "C": n["coupler"], "H": Polar("B", n["along"], n["turn"])}, 0.8, 0.05, 3e-4
        ),
        "rocker": Link({"D": 0j, "C": n["rocker"]}, 0.6, 0.03, 2e-4),
    }
    return Mechanism(
        {"A": 0j, "D": n["ground"]}, links, inputs=Input("crank"),
        guess=Guess(0.7, {"coupler": 0.3, "rocker": 1.0}), gravity=-9.81j,
    )  # fmt: skip


PATHS = {
    "crank": "links.crank.B.x", "coupler": "links.coupler.C.x", "rocker": "links.rocker.C.x", "ground": "ground.D.x",
    "along": "links.coupler.H.length", "turn": "links.coupler.H.angle",
}  # fmt: skip


def exact(n, q):
    """Coupler angle and H of the four-bar in many digits, by the triangle B, C, D (law of cosines)."""
    b = n["crank"] * mp.expj(q)
    d = n["ground"] - b
    beta = mp.acos((n["coupler"] ** 2 + abs(d) ** 2 - n["rocker"] ** 2) / (2 * n["coupler"] * abs(d)))
    phi = mp.arg(d) + beta
    return phi, b + n["along"] * mp.expj(phi + n["turn"])


@pytest.mark.parametrize("name", FOUR)
def test_a_four_bar_against_differences_in_fifty_digits(name):
    angle = np.linspace(0.7, 6.0, 9)
    motion = four_bar().motion(angle, 1.0, 0.0)
    found = motion.point("H").sensitivity(PATHS[name]) @ [1, 1j]
    turned, rate = (
        motion.link("coupler").sensitivity(PATHS[name]),
        motion.link("coupler").sensitivity(PATHS[name], 1),
    )
    with mp.workdps(60):
        h = mp.mpf(10) ** -20
        n = {key: mp.mpf(length) for key, length in FOUR.items()}

        def slope(what, q):
            low, high = (what(n | {name: n[name] + side * h}, q) for side in (-1, 1))
            return (high - low) / (2 * h)

        def omega(n, q):
            return mp.diff(lambda x: exact(n, x)[0], q)

        for i, q in enumerate(map(mp.mpf, angle.tolist())):
            for mine, true in (
                (complex(found[i]), slope(lambda n, q: exact(n, q)[1], q)),
                (float(turned[i]), slope(lambda n, q: exact(n, q)[0], q)),
                (float(rate[i]), slope(omega, q)),
            ):
                assert abs(mine - true) <= 1e-12 * abs(true) + mp.mpf(10) ** -18


LOADS = {
    "forces": [Force("coupler", "H", 20 - 30j, "link"), Force("rocker", None, 5j)],
    "torques": [Torque("rocker", 0.4)],
    "springs": [Spring((("coupler", "H"), ("ground", "D")), 300.0, 0.05, 2.0)],
    "motors": [Motor("coupler", "rocker", 0.2, 0.03j)],
}


def neighbours(m, path, of, step=1e-4):
    """The derivative by mechanisms that are a little different: Richardson of central differences."""
    at = float(value(m, path).real)

    def difference(h):
        return (of(changed(m, {path: at + h})) - of(changed(m, {path: at - h}))) / (2 * h)

    return (4 * difference(step / 2) - difference(step)) / 3


def everything(m, angle):
    motion = m.motion(angle, 2.0, -1.0)
    links = list(m.links)
    values = [motion.point(p).complex(k) for p in m.links[links[-1]].points for k in (0, 1, 2)]
    values += [motion.link(links[-1]).omega, motion.link(links[1]).alpha, motion.effort]
    return np.concatenate(values)


def derivatives(m, angle, path):
    motion = m.motion(angle, 2.0, -1.0)
    links = list(m.links)
    points = m.links[links[-1]].points
    found = [motion.point(p).sensitivity(path, k) @ [1, 1j] for p in points for k in (0, 1, 2)]
    found += [motion.link(links[-1]).sensitivity(path, 1), motion.link(links[1]).sensitivity(path, 2)]
    return np.concatenate([*found, motion.sensitivity("effort", path)])


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_any_mechanism_against_its_neighbours(kind, random_mechanism):
    """Groups without a closed form too (the triad)."""
    rng = np.random.default_rng(KINDS.index(kind) + 20)
    m = random_mechanism(kind, rng)
    while not m.motion(m.at).condition[0] < 30:
        m = random_mechanism(kind, rng)
    links = {
        name: Link(
            link.points, *rng.uniform(0.5, 2, 1), complex(*rng.normal(size=2)), *rng.uniform(0.1, 1, 1)
        )
        for name, link in m.links.items()
    }
    m = Mechanism(m.ground, links, m.guides, inputs=m.inputs, guess=m.guess, gravity=-9.81j)
    angle = m.at[0] + np.array([0.0, 0.01])
    scale = np.abs(everything(m, angle)).max()
    for path, d in dimensions(m).items():
        if d.where[0] != "inputs":
            found = derivatives(m, angle, path)
            expected = neighbours(m, path, lambda m: everything(m, angle))
            np.testing.assert_allclose(
                found, expected, rtol=1e-6, atol=1e-7 * max(scale, np.abs(expected).max()), err_msg=path
            )


def test_loads_and_their_dimensions_against_neighbours():
    four = four_bar()
    m = Mechanism(four.ground, four.links, inputs=four.inputs, guess=four.guess, gravity=-9.81j, **LOADS)
    angle = np.array([0.7, 1.9])
    for path, d in dimensions(m).items():
        if d.where[0] != "inputs":
            found = derivatives(m, angle, path)
            # the dimensions are a thousand times smaller than those of the random mechanisms
            expected = neighbours(m, path, lambda m: everything(m, angle), 1e-5)
            np.testing.assert_allclose(
                found, expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max() + 1e-8, err_msg=path
            )


def test_an_input_has_its_own_derivatives():
    motion = four_bar().motion([0.7, 1.2], 3.0, 0.5)
    point = motion.point("H")
    np.testing.assert_allclose(point.sensitivity("input.angle"), point.velocity / 3.0, rtol=1e-13)
    np.testing.assert_allclose(point.sensitivity("input.speed", 1), point.velocity / 3.0, rtol=1e-13)
    rest = four_bar().motion([0.7])
    np.testing.assert_allclose(
        rest.point("H").sensitivity("input.speed", 1), point.velocity[:1] / 3.0, rtol=1e-13
    )
    assert not rest.point("H").sensitivity("links.rocker.mass").any()


def test_through_a_change_point_and_on_a_guide():
    """A parallelogram beyond 180°: its rocker turns with the crank's length as on either side."""
    links = {
        "crank": Link({"A": 0j, "B": 0.04}),
        "coupler": Link({"B": 0j, "C": 0.1}),
        "rocker": Link({"D": 0j, "C": 0.04}),
    }
    m = Mechanism(
        {"A": 0j, "D": 0.1}, links, inputs=Input("crank"), guess=Guess(1.0, {"coupler": 0.0, "rocker": 1.0})
    )
    q = np.array([1.0, 2.5, 4.0, 8.0])
    # B + c·e^{iφ} = D + r·e^{iψ}, φ = 0, ψ = q: dr e^{iq} + i r dψ e^{iq} = i c dφ, so r·dψ = dr·cot(q)
    found = m.motion(q).link("rocker").sensitivity("links.rocker.C.x")
    np.testing.assert_allclose(found, 1 / np.tan(q) / 0.04, rtol=1e-12)
    slide = Mechanism(
        {"O": 0j},
        {"crank": Link({"O": 0j, "A": 0.05}), "rod": Link({"A": 0j, "B": 0.2})},
        [Guide("B", "rod", "ground", 0.01j, 0.1)],
        inputs=Input("crank"),
        guess=Guess(0.5, {"rod": -0.1}),
    )
    at = slide.motion([0.5]).slide("B")
    for path in ("slots.1.angle", "slots.1.through.y", "links.rod.B.x"):
        expected = neighbours(slide, path, lambda m: m.motion([0.5]).slide("B").position)
        np.testing.assert_allclose(at.sensitivity(path), expected, rtol=1e-8)


def test_what_has_no_derivative_is_refused():
    motion = four_bar().motion([0.7])
    with pytest.raises(DescriptionError, match="did you mean"):
        motion.point("H").sensitivity("links.crnak.B.x")
    with pytest.raises(DescriptionError, match="two numbers"):
        motion.point("H").sensitivity("links.crank.B")
    with pytest.raises(DescriptionError, match="no quantity is named 'torque'"):
        motion.sensitivity("torque", "links.crank.B.x")
    with pytest.raises(MechanismError, match="friction"):
        rubbing().motion([0.7], 1.0).sensitivity("effort", "links.crank.B.x")


def rubbing():
    four = four_bar()
    return Mechanism(
        four.ground,
        four.links,
        inputs=four.inputs,
        guess=four.guess,
        gravity=-9.81j,
        friction=[Friction("B", 0.1, 0.01)],
    )


def test_rounding_of_derivatives_of_a_slider_crank() -> None:
    """x = r cos θ + √(l² − r² sin² θ), its numbers decimals of a file: the estimates hold, and are close."""
    text = """
    [ground]
    A = [0, 0]
    [links.crank]
    points = { A = [0, 0], B = [0.0507, 0] }
    [links.rod]
    points = { B = [0, 0], C = [0.1501, 0] }
    [[slots]]
    point = "C"
    angle = 0
    [input]
    link = "crank"
    [guess]
    at = 0
    rod = -0.1
    """
    motion = Mechanism.from_toml_text(text).motion(np.linspace(0.1, 6.1, 13))
    every, key = motion.sensitivities, Point("rod", 0.1501 + 0j, "C", 0)
    paths = [every.dimension(path) for path in ("links.crank.B.x", "links.rod.C.x")]
    slopes = every.of([key], paths)
    (errors,), pairs = every.errors([key], paths, slopes), []
    with mp.workdps(40):
        r, l = mp.mpf("0.0507"), mp.mpf("0.1501")
        for i, q in enumerate(motion.poses.inputs[:, 0].tolist()):
            root = mp.sqrt(l**2 - (r * mp.sin(mp.mpf(q))) ** 2)
            truth = mp.cos(mp.mpf(q)) - r * mp.sin(mp.mpf(q)) ** 2 / root, l / root
            for exact, slope, error in zip(truth, slopes[0], errors, strict=True):
                pairs.append((float(abs(exact - slope[i].real)), error[i]))
    assert all(off <= error for off, error in pairs)
    assert np.median([error for _, error in pairs]) <= 1.2 * np.median([off for off, _ in pairs])
