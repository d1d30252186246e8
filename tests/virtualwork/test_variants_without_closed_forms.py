"""Variants of mechanisms whose loops are closed by iteration: begun from the nominal one's way, they stand as alone."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest

from dalembert.arithmetic.recorded import Recorder
from virtualwork import Guess, Guide, Input, Link, Mechanism
from virtualwork.branch.continuation import Continuation
from virtualwork.describe import MechanismError
from virtualwork.describe.dimensions import dimensions, value
from virtualwork.family import family

Q = np.linspace(-1.0, 7.0, 13)


def drawn(m, rng, v, spread):
    """Numbers for every coordinate of the links' points."""
    paths = [p for p, d in dimensions(m).items() if d.kind == "length" and p.startswith("links")]
    return {p: float(value(m, p).real) + spread * rng.normal(size=v) for p in paths}


def compared(m, numbers, q):
    """Hold every variant against what it does alone, which no other has led; how many pairs of poses were assembled."""
    variants = m.vary(numbers)
    motion = variants.motion(q, 1.5, -0.7)
    places = {name: motion.point(name) for name in m.points}
    rates = {name: motion.link(name) for name in m.links}
    assembled = 0
    for i in range(len(variants)):
        try:
            alone = variants[i].motion(q, 1.5, -0.7)
            there = alone.assembled
        except MechanismError as refused:
            reason = str(refused)
        else:
            reason = None
        if reason is not None:
            assert motion.reason(i) == reason
            assert not motion.assembled[i].any()
            continue
        np.testing.assert_array_equal(motion.assembled[i], there)
        assembled += int(there.sum())
        for k in range(3):
            # what a pose rounds is in all its quantities, by chance more or less
            rounded = np.max([alone.point(name).error_estimate(k) for name in places], axis=0)[there]
            for name, point in places.items():
                own = alone.point(name).complex(k)
                apart = np.abs(point.complex(k)[i] - own)[there]
                # to first order each order of derivatives takes the condition once more
                known = 4 * np.finfo(float).eps * alone.condition[there] ** (k + 1) * alone.mechanism.size
                assert (apart <= 20 * rounded + 4e-15 * np.abs(own)[there] + known).all(), (i, name, k)
        for name, link in rates.items():
            turned = np.exp(1j * (link.angle[i] - alone.link(name).angle))[there]
            np.testing.assert_allclose(turned, 1.0, atol=1e-9)
    return assembled


@pytest.mark.parametrize("spread", [1e-4, 0.2])
def test_a_triad_stands_as_alone(spread, random_mechanism):
    rng = np.random.default_rng(3)
    m = random_mechanism("triad", rng)
    assert compared(m, drawn(m, rng, 2, spread), Q[::3])


def stephenson():
    """The worked example, a crank that turns round in the five-bar loop of a Stephenson chain, with masses."""
    m = Mechanism.from_toml(str(files("cli") / "examples" / "stephenson-six-bar" / "stephenson.toml"))
    return m.changed({"gravity.y": -9.81, "links.coupler.mass": 2.0, "links.rod.mass": 0.5})


def chain(rng):
    """A crank drives a triad, whose coupler drives another one, whose coupler drives a dyad; assembled at its guess."""
    names = "GFEBCADHUVWXYKM"
    at = dict(zip(names, rng.uniform(-1, 1, len(names)) + 1j * rng.uniform(-1, 1, len(names)), strict=True))
    at["F"] = at["G"] + 0.15 * (at["F"] - at["G"])
    bodies = {
        "crank": "GF", "rod": "FE", "coupler": "EBCH", "left": "BA", "right": "CD",
        "rod2": "HU", "coupler2": "UVWM", "left2": "VX", "right2": "WY", "short": "MK",
    }  # fmt: skip
    at["Z"] = at["K"] + 0.9 - 0.4j
    bodies["last"] = "KZ"
    turned = {name: rng.uniform(-3, 3) for name in bodies}
    links = {
        name: Link({p: (at[p] - at[points[0]]) * np.exp(-1j * turned[name]) for p in points})
        for name, points in bodies.items()
    }
    ground = {p: at[p] for p in "GADXYZ"}
    return Mechanism(ground, links, inputs=Input("crank"), guess=Guess(turned["crank"], turned))


def test_the_formulas_of_all_variants_are_written_down_once(monkeypatch):
    m = stephenson()
    written, followed = [], []
    tape, begin = Recorder.tape, Continuation.__init__
    monkeypatch.setattr(Recorder, "tape", lambda *given: written.append(given) or tape(*given))
    monkeypatch.setattr(Continuation, "__init__", lambda *given: followed.append(given) or begin(*given))
    counts = []
    for v in (2, 40):
        written.clear()
        family = m.vary({"links.crank.F.x": np.linspace(0.0175, 0.0185, v)})
        motion = family.motion(np.arange(0.0, 6.0), 5.0)
        assert np.isfinite(motion.point("C").acceleration).all()
        assert np.isfinite(motion.effort).all()
        counts.append(len(written))
    assert counts[1] <= counts[0]
    # the nominal mechanism's way alone is gone step by step
    assert len(followed) == 1


@pytest.mark.parametrize("count", [1, 3, 200])
def test_no_number_depends_on_how_many_variants_there_are(count):
    m, q = stephenson(), np.arange(0.5, 6.5)
    lengths = np.linspace(0.0175, 0.0185, count)
    motion = m.vary({"links.crank.F.x": lengths}).motion(q, 5.0, 2.0)
    for i in {0, count // 2, count - 1}:
        alone = m.changed({"links.crank.F.x": lengths[i]}).motion(q, 5.0, 2.0)
        known = 4e-15 * alone.condition
        for order, scale in ((0, 1.0), (1, 5.0), (2, 25.0)):
            apart = np.abs(motion.point("E").complex(order)[i] - alone.point("E").complex(order))
            assert (apart <= known * alone.condition**order * m.size * scale).all()
        own = alone.effort
        assert (np.abs(motion.effort[i] - own) <= known * alone.condition**2 * np.abs(own).max()).all()


def test_mirrored_variants_are_the_mirror_image():
    m, q = stephenson(), np.arange(0.5, 6.5)
    sides = {
        p: -float(m.value(p)) for p, d in m.dimensions.items() if p.endswith(".y") and d.kind == "length"
    }
    guess = Guess(
        tuple(-at for at in m.guess.at),
        {name: -angle for name, angle in m.guess.angles.items()},
        {p: np.conj(z) for p, z in m.guess.points.items()},
    )
    other = replace(m, guess=guess).changed(sides)
    lengths = np.linspace(0.0175, 0.0185, 5)
    own, mirrored = (
        each.vary({"links.crank.F.x": lengths}).motion(side * q, side * 5.0, side * 2.0)
        for each, side in ((m, 1), (other, -1))
    )
    for order in range(3):
        right = own.point("E").complex(order)
        np.testing.assert_allclose(
            mirrored.point("E").complex(order), right.conj(), rtol=0, atol=1e-13 * np.abs(right).max()
        )


@pytest.mark.slow
def test_a_group_that_another_group_drives_and_one_in_closed_form_behind_it():
    # two triads one after the other, and a dyad on the last: the signs behind depend on the unknowns before
    rng = np.random.default_rng(5)
    m = chain(rng)
    numbers = drawn(m, rng, 4, 1e-3)
    motion = m.vary(numbers).motion(m.at[0] + np.linspace(-0.1, 0.1, 3), 1.5)
    _ = motion.assembled
    (solver,) = [s for (name, _), s in family._solvers.items() if name == motion._name]
    assert solver.together.all()
    assert compared(m, numbers, m.at[0] + np.linspace(-0.1, 0.1, 3)) == 12


def two_inputs(slides):
    """The same chain, the pivot of its crank on a second crank, or on a slide."""
    m = stephenson()
    ground = {name: z for name, z in m.ground.items() if name != "G"}
    if slides:
        base, guides, second = (
            Link({"G": 0j}),
            [Guide("G", "base", "ground", 0.15j + 0.15, np.pi / 2, 0.0)],
            Input(slider="G"),
        )
    else:
        base, guides, second = Link({"K": 0j, "G": 0.02}), [], Input("base")
        ground["K"] = 0.15 + 0.04j
    guess = replace(m.guess, at=(m.at[0], -0.09 if slides else np.pi / 2))
    inputs = (*m.inputs, second)
    return replace(
        m, ground=ground, links={**m.links, "base": base}, guides=guides, inputs=inputs, guess=guess
    )


def one_by_one(m, numbers, q):
    """Two inputs: every variant against what it does alone, with rates and forces."""
    variants = m.vary(numbers)
    motion = variants.motion(q, [5.0, 0.3])
    for i in range(len(variants)):
        alone = m.changed({path: x[i] for path, x in numbers.items()}).motion(q, [5.0, 0.3])
        there = alone.assembled
        np.testing.assert_array_equal(motion.assembled[i], there)
        for order in range(3):
            own = alone.point("E").complex(order)[there]
            apart = np.abs(motion.point("E").complex(order)[i][there] - own)
            known = 4e-15 * alone.condition[there] ** (order + 1) * m.size * 5.0**order
            assert (apart <= known + 4e-15 * np.abs(own)).all(), (i, order)
        efforts = alone.effort[there]
        known = 4e-15 * alone.condition[there] ** 3
        apart = np.abs(motion.effort[i][there] - efforts)
        assert (apart <= known[:, None] * np.abs(efforts).max()).all()
    (solver,) = [s for (name, _), s in family._solvers.items() if name == motion._name]
    return solver.together


def way_of(m, count, reach):
    rng = np.random.default_rng(count)
    second = 0.1 * m.size if m.inputs[1].is_slide else 1.0
    return np.array(m.at) + reach * rng.uniform(-1, 1, (count, 2)) * [1.0, second]


@pytest.mark.parametrize("slides", [False, True])
def test_several_inputs_lead_every_pose_along_a_line_of_its_own(slides):
    m = two_inputs(slides)
    numbers = {"links.rod.E.x": np.linspace(0.104, 0.106, 3), "links.coupler.mass": np.linspace(1.0, 3.0, 3)}
    assert one_by_one(m, numbers, way_of(m, 5, 0.5)).all()


def test_of_several_inputs_what_is_out_of_reach_is_described_alone():
    m = two_inputs(slides=False)
    numbers = {"links.rod.E.x": np.array([0.105, 0.092])}
    q = np.array(m.at) + np.linspace(0, 4.5, 4)[:, None] * [1.0, 0.05]
    assert one_by_one(m, numbers, q).tolist() == [True, False]


@pytest.mark.parametrize("slides", [False, True])
def test_of_several_inputs_no_bit_depends_on_the_number_of_variants_or_the_thread(slides):
    m = two_inputs(slides)
    q, lengths = way_of(m, 4, 0.5), np.linspace(0.104, 0.106, 32)

    def solved(count):
        motion = m.vary({"links.rod.E.x": np.resize(lengths, count)}).motion(q, [5.0, 0.3])
        return motion.point("E").acceleration, motion.effort

    whole = solved(32)
    for count in (1, 1000):
        first = min(count, 32)
        for some, every in zip(solved(count), whole, strict=True):
            np.testing.assert_array_equal(some[:first], every[:first])
    with ThreadPoolExecutor(4) as pool:
        for each in pool.map(solved, [32] * 4):
            for some, every in zip(each, whole, strict=True):
                np.testing.assert_array_equal(some, every)


def test_of_several_inputs_a_group_drives_another_one():
    """The line of the second triad leads through poses of the first one."""
    rng = np.random.default_rng(5)
    m = chain(rng)
    base = Link({"P": 0j, "X": 0.1})
    ground = {name: z for name, z in m.ground.items() if name != "X"} | {"P": m.ground["X"] - 0.1}
    guess = replace(m.guess, at=(*m.at, 0.0))
    m = replace(
        m, ground=ground, links={**m.links, "base": base}, inputs=(*m.inputs, Input("base")), guess=guess
    )
    numbers = drawn(m, rng, 3, 1e-4)
    q = np.array(m.at) + np.linspace(-0.05, 0.05, 3)[:, None] * [1.0, 0.5]
    motion = m.vary(numbers).motion(q)
    places = motion.point("M").position
    (solver,) = [s for (name, _), s in family._solvers.items() if name == motion._name]
    assert solver.together.all()
    for i in range(3):
        alone = m.changed({path: x[i] for path, x in numbers.items()}).motion(q)
        known = 4e-15 * alone.condition.max() * m.size
        assert np.abs(places[i] - alone.point("M").position).max() <= known


@pytest.mark.slow
def test_refusals_and_limits_are_those_of_each_variant_alone():
    m, q = stephenson(), np.arange(0.0, 6.3, 0.5)
    # a rod with which the crank turns round, one with which it does not, one that is too short at the guess
    numbers = {"links.rod.E.x": np.array([0.105, 0.092, 0.05])}
    assert compared(m, numbers, q) == 20
    motion = m.vary(numbers).motion(q)
    assert [motion.reason(0), motion.assembled.sum(axis=1).tolist()] == [None, [13, 7, 0]]
    assert "its loops have a gap" in motion.reason(1)
    with pytest.raises(MechanismError) as refused:
        m.changed({"links.rod.E.x": 0.05}).motion(q).assembled.any()
    assert motion.reason(2) == str(refused.value)


def test_derivatives_of_the_effort_to_dimensions_of_a_group_without_a_closed_form():
    """Against differences of the effort of mechanisms that are described alone."""
    m, q = stephenson(), np.array([1.0, 2.0, 4.0])
    design = m.design(["links.rod.E.x", "links.coupler.mass"], "effort.crank")
    x = np.array([0.105, 2.0])
    np.testing.assert_allclose(design(x, q)[0], m.motion(q).effort, rtol=1e-12)

    def effort(q, *step):
        names = ("links.rod.E.x", "links.coupler.mass")
        return m.changed(dict(zip(names, x + step, strict=True))).motion(q).effort

    h = 1e-6
    slopes = design.slopes(x, q)[0]
    for column, off, turned in ((0, (h, 0.0), 0.0), (1, (0.0, h), 0.0), (2, (0.0, 0.0), h)):
        back = tuple(-each for each in off)
        expected = (effort(q + turned, *off) - effort(q - turned, *back)) / (2 * h)
        np.testing.assert_allclose(slopes[:, column], expected, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("spread", [1e-3, 0.05, 0.4])
def test_random_triads_stand_as_alone(seed, spread, random_mechanism):
    rng = np.random.default_rng(seed)
    m = random_mechanism("triad", rng)
    compared(m, drawn(m, rng, 12, spread), Q)
