"""Every variant of a family does what it does described alone."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from dalembert.arithmetic.choice import ENGINES
from dalembert.arithmetic.processes import Processes
from virtualwork import Force, Gear, Guess, Input, Link, Mechanism, Motor, Spring, Torque, TorsionSpring
from virtualwork.describe import DescriptionError, MechanismError
from virtualwork.describe.dimensions import changed, dimensions, value
from virtualwork.family.part import Solver
from virtualwork.formulas.forces import Effort

KINDS = ["four-bar", "slider-crank", "inverted slider-crank", "Watt", "Stephenson", "triad"]


def drawn(m, rng, v, spread, only=None):
    """Numbers for every coordinate of a mechanism's points, centres and guides."""
    every = [p for p, d in dimensions(m).items() if d.kind in ("length", "angle") and d.where[0] != "inputs"]
    return {
        path: float(value(m, path)) + spread * rng.normal(size=v)
        for path in every
        if only is None or only(path)
    }


EPS = float(np.finfo(float).eps)


def scale(unit, size):
    return size if unit == "m" else 1.0


def compared(m, numbers, angle, speed=None, acceleration=None):
    """The family beside a loop over mechanisms: the largest difference of anything, over what its pose rounds."""
    motion = m.vary(numbers).motion(angle, speed, acceleration)
    names = [name for link in m.links.values() for name in link.points]
    worst = 0.0
    for i in range(len(motion)):
        try:
            one = changed(m, {path: column[i] for path, column in numbers.items()})
            rates = ([getattr(e, what) or 0.0 for e in one.inputs] for what in ("speed", "acceleration"))
            own = [
                given if given is not None else rate
                for given, rate in zip((speed, acceleration), rates, strict=True)
            ]
            alone = one.motion(angle, *own)
            there = alone.assembled
        except MechanismError:
            assert not motion.assembled[i].any()
            assert motion.reason(i)
            continue
        np.testing.assert_array_equal(motion.assembled[i], there, str(i))
        assert (motion.reason(i) is None) == there.all()
        pairs = []
        for name in names:
            mine, its = motion.point(name), alone.point(name)
            pairs += [("m", mine.complex(k)[i], its.complex(k), its.error_estimate(k)) for k in range(3)]
        for link in m.links:
            mine, its = motion.link(link), alone.link(link)
            pairs.append(("", np.exp(1j * mine.angle[i]), np.exp(1j * its.angle), its.error_estimate(0)))
            pairs += [
                ("", mine.omega[i], its.omega, its.error_estimate(1)),
                ("", mine.alpha[i], its.alpha, its.error_estimate(2)),
            ]
        # what a pose rounds is in all its quantities, by chance more or less
        size = m.size
        share = [np.max([b / scale(name, size) for name, _, _, b in pairs[k::3]], axis=0) for k in range(3)]
        for j, (name, mine, its, bound) in enumerate(pairs):
            np.testing.assert_array_equal(np.isfinite(mine), np.isfinite(its), str(i))
            good = there & np.isfinite(its) & np.isfinite(bound)
            # both are rounded, and the guess has its own
            rounded = 20 * share[j % 3][good] * scale(name, size) + 4e-15 * np.abs(its[good]) + 1e-300
            # to first order each order of derivatives takes the condition once more
            rounded = rounded + 4 * EPS * alone.condition[good] ** (j % 3 + 1) * scale(name, size)
            error = np.abs(mine - its)[good] / rounded
            worst = max(worst, float(error.max(initial=0.0)))
    return worst, motion


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("spread", [0.001, 0.2])
def test_a_family_is_a_loop_over_mechanisms(kind, spread, random_mechanism):
    rng = np.random.default_rng(KINDS.index(kind))
    m = random_mechanism(kind, rng)
    # a mechanism that has to be described one by one takes its time
    v = 40 if kind != "triad" else 4
    angle = m.at[0] + np.linspace(-2.0, 3.0, 12)
    worst, motion = compared(m, drawn(m, rng, v, spread), angle, 1.5, -0.7)
    assert worst <= 1
    assert motion.assembled.any()


def four_bar(ground=0.1, guess=None, **more):
    """Norton's four-bar, with masses."""
    links = {
        "crank": Link({"A": (0, 0), "B": (0.04, 0)}, 0.5, 0.02, 1e-4),
        "coupler": Link({"B": (0, 0), "C": (0.12, 0), "H": (0.06, 0.04)}, 0.8, 0.05 + 0.01j, 3e-4),
        "rocker": Link({"D": (0, 0), "C": (0.08, 0)}, 0.6, 0.03),
    }
    return Mechanism(
        {"A": 0j, "D": ground}, links, inputs=Input("crank", value=0.7, speed=8.0, acceleration=-3.0),
        guess=guess or Guess(0.7, {"coupler": 0.3, "rocker": 1.0}), gravity=-9.81j, **more,
    )  # fmt: skip


PATHS = ("links.crank.B.x", "links.coupler.C.x", "links.rocker.C.x", "ground.D.x", "links.coupler.mass")
LOADS = {
    "forces": [Force("coupler", "H", 20 - 30j, "link"), Force("rocker", None, 5j)],
    "torques": [Torque("rocker", 0.4)],
    "springs": [Spring((("coupler", "H"), ("ground", "D")), 300.0, 0.05, 2.0)],
    "motors": [Motor("coupler", "rocker", 0.2, 0.03j)],
}


def test_forces_of_a_family_are_those_of_each_mechanism():
    m, rng = four_bar(**LOADS), np.random.default_rng(1)
    paths = [p for p, d in dimensions(m).items() if d.where[0] != "inputs"]
    numbers = {p: float(value(m, p)) * (1 + 0.05 * rng.normal(size=30)) for p in paths}
    angle = np.linspace(0.7, 5.0, 9)
    motion = m.vary(numbers).motion(angle)
    assert motion.part.shape == (30, 9)
    for i in range(30):
        alone = m.vary(numbers)[i].motion(angle, 8.0, -3.0)
        bounds = alone.dynamics.error_estimate()
        np.testing.assert_allclose(motion.effort[i], alone.effort, rtol=1e-14, atol=4 * bounds.effort.max())
        for joint, on in (("A", "crank"), ("B", "coupler"), ("C", "rocker"), ("D", "rocker")):
            true = alone.reaction(joint, on)
            np.testing.assert_allclose(
                motion.reaction(joint, on)[i], true, rtol=1e-12, atol=1e-12 * abs(true).max()
            )


@pytest.mark.parametrize("poses", [1, 3, 9, 40])
def test_every_engine_has_the_same_variants_and_poses(monkeypatch, poses):
    """Some cannot be assembled at the guess, some not everywhere: those are masked whoever works them out."""
    m, rng = four_bar(**LOADS), np.random.default_rng(3)
    numbers = {p: float(value(m, p)) * (1 + 0.15 * rng.normal(size=50)) for p in PATHS}
    angle = np.linspace(0.7, 6.0, poses)
    found = {}
    for engine in ENGINES:
        monkeypatch.setenv("DALEMBERT_ENGINE", engine)
        motion = m.vary(numbers).motion(angle)
        found[engine] = [motion.point("H").acceleration, motion.effort, motion.reaction("B", "coupler")]
    assert 0 < motion.failed < 50
    for engine in ENGINES:
        for mine, its in zip(found[engine], found["numpy"], strict=True):
            scale = np.abs(np.nan_to_num(its)).max(axis=1, keepdims=True) + 1e-300
            np.testing.assert_array_equal(np.isnan(mine), np.isnan(its))
            # close to a limit the condition is large
            np.testing.assert_allclose(mine / scale, its / scale, rtol=0, atol=1e-10)


def test_nothing_but_numbers_is_told_of_masses():
    """Twice the masses and the gravity alone: twice the weight's effort, exactly."""
    m = four_bar()
    masses = {f"links.{link}.mass": [m.links[link].mass * 2**k for k in range(3)] for link in m.links}
    effort = m.vary(masses).motion(np.linspace(0, 6, 7), speed=0.0, acceleration=0.0).effort
    np.testing.assert_array_equal(effort[1:], effort[:1] * np.array([[2.0], [4.0]]))


def test_rates_come_from_the_file_unless_given_or_varied():
    m = four_bar()
    speeds = np.array([1.0, 2.0, 5.0])
    family = m.vary({"input.speed": speeds, "input.angle": [0.7, 0.9, 1.1]})
    own = family.motion()
    np.testing.assert_array_equal(own.link("crank").omega[:, 0], speeds)
    np.testing.assert_array_equal(own.link("crank").angle[:, 0], [0.7, 0.9, 1.1])
    np.testing.assert_array_equal(own.link("crank").alpha[:, 0], -3.0)
    beaten = family.motion([0.1, 0.2], speed=4.0, acceleration=[1.0, 2.0])
    np.testing.assert_array_equal(beaten.link("crank").omega, 4.0)
    np.testing.assert_array_equal(beaten.link("crank").alpha, [[1.0, 2.0]] * 3)


def test_the_guess_of_the_file_holds_for_an_input_that_it_does_not_name():
    """Without `at` the guess is meant at the input's own value, which is another in each variant."""
    m = four_bar(guess=Guess(None, {"coupler": 0.3, "rocker": 1.0}))
    angles = np.array([0.5, 0.7, 0.9])
    found = m.vary({"input.angle": angles}).motion().point("C").position
    for i, angle in enumerate(angles):
        alone = changed(m, {"input.angle": angle}).motion()
        np.testing.assert_array_equal(found[i], alone.point("C").position)


def test_variants_with_change_points_and_limits_go_as_they_go_alone():
    """A parallelogram goes through 0° and 180°; its neighbours jump to neither branch, or stop."""
    crank, ground = 0.04, 0.1
    links = {
        "crank": Link({"A": (0, 0), "B": (crank, 0)}),
        "coupler": Link({"B": (0, 0), "C": (ground, 0)}),
        "rocker": Link({"D": (0, 0), "C": (crank, 0)}),
    }
    m = Mechanism(
        {"A": 0j, "D": ground},
        links,
        inputs=Input("crank"),
        guess=Guess(1.0, {"coupler": 0.0, "rocker": 1.0}),
    )
    lengths = ground + np.array([-1e-2, -1e-5, -1e-9, 0.0, 1e-9, 1e-5, 1e-2])
    angle = np.linspace(1.0, 13.0, 60)
    worst, motion = compared(m, {"links.coupler.C.x": lengths}, angle, 1.0, 0.0)
    assert worst <= 1
    np.testing.assert_allclose(np.exp(1j * motion.link("rocker").angle[3]), np.exp(1j * angle), atol=1e-12)
    assert not motion.assembled[0].all()
    assert "reach" in motion.reason(0) or "no nearer" in motion.reason(0)


@pytest.mark.slow
def test_a_guess_that_each_variant_reads_differently():
    """The guess gives points alone: which of two assemblies is nearer hangs on the variant's own lengths."""
    m = four_bar(guess=Guess(0.7, points={"C": (0.11, 0.01)}))
    rng = np.random.default_rng(2)
    numbers = drawn(m, rng, 60, 0.02, lambda path: path.startswith(("links", "ground")))
    worst, motion = compared(m, numbers, [0.7, 1.2], 1.0, 0.5)
    assert worst <= 1
    assert 0 < motion.failed < 60


def test_gears_and_several_inputs_are_families_too(random_mechanism):
    train = Mechanism(
        {"O": 0j},
        {"arm": Link({"O": 0j, "P": 0.3}), "sun": Link({"O": 0j}), "planet": Link({"P": 0j, "T": 0.1})},
        gears=[Gear(("sun", "planet"), -2.0, "arm")],
        inputs=[Input("arm"), Input("sun")],
        guess=Guess((0.0, 0.0), {"planet": 0.2}),
    )
    numbers = {"gears.1.ratio": [-2.0, -1.5, 0.7], "links.arm.P.x": [0.3, 0.2, 0.1]}
    worst, _ = compared(train, numbers, np.array([[0.3, 0.1], [2.0, 5.0]]), 1.0, 0.0)
    assert worst <= 1
    five = Mechanism(
        {"A": 0j, "D": 0.2},
        {
            "left": Link({"A": 0j, "B": 0.1}), "right": Link({"D": 0j, "E": 0.1}),
            "rod": Link({"B": 0j, "C": 0.15}), "other": Link({"E": 0j, "C": 0.15}),
        },
        inputs=[Input("left"), Input("right")],
        guess=Guess((1.5, 1.6), {"rod": 0.8, "other": 2.3}),
    )  # fmt: skip
    numbers = {"links.rod.C.x": [0.15, 0.14, 0.02], "ground.D.x": [0.2, 0.21, 0.2]}
    worst, motion = compared(five, numbers, np.array([[1.5, 1.6], [1.0, 2.0]]), 1.0, 0.0)
    assert worst <= 1
    assert motion.assembled.any(axis=1).tolist() == [True, True, False]


@pytest.mark.parametrize(
    ("numbers", "kind", "said"),
    [
        ({"links.crnak.B.x": [1.0]}, DescriptionError, "did you mean 'links.crank.B.x'"),
        ({"links.crank.B": [1.0]}, ValueError, r"expected shape \(v, 2\)"),
        ({"links.crank.B.x": [1.0, np.nan]}, ValueError, "found nan at 1"),
        ({"links.crank.B.x": [1.0], "ground.D.x": [1.0, 2.0]}, ValueError, "as many values"),
    ],
)
def test_what_cannot_be_varied_is_refused(numbers, kind, said):
    with pytest.raises(kind, match=said):
        four_bar().vary(numbers)


def test_both_coordinates_of_a_point_are_varied_by_its_own_path():
    m, places = four_bar(), np.array([[0.04, 0.0], [0.03, 0.02]])
    pair = m.vary({"links.crank.B": places}).motion(1.0).point("C").position
    apart = m.vary({"links.crank.B.x": places[:, 0], "links.crank.B.y": places[:, 1]}).motion(1.0)
    np.testing.assert_array_equal(pair, apart.point("C").position)
    as_complex = m.vary({"links.crank.B": places @ [1, 1j]}).motion(1.0)
    np.testing.assert_array_equal(pair, as_complex.point("C").position)


def test_a_variant_that_no_description_would_be_is_masked_and_says_why():
    m = four_bar()
    motion = m.vary({"links.coupler.mass": [0.5, -1.0], "links.coupler.C.x": [0.12, 0.12]}).motion(1.0)
    assert motion.assembled[:, 0].tolist() == [True, False]
    assert "must not be negative" in motion.reason(1)
    assert np.isnan(motion.effort[1]).all()
    assert motion.failed == 1


def test_an_executor_gives_the_same_numbers_whatever_it_is(monkeypatch):
    monkeypatch.setattr("virtualwork.family.family.LANES", 64)
    m, rng = four_bar(), np.random.default_rng(5)
    family = m.vary(drawn(m, rng, 50, 0.03))
    angle = np.linspace(0.0, 6.0, 10)
    alone = family.motion(angle)
    with ThreadPoolExecutor(2) as threads:
        shared = family.motion(angle, executor=threads)
        np.testing.assert_array_equal(alone.point("H").acceleration, shared.point("H").acceleration)
        np.testing.assert_array_equal(alone.effort, shared.effort)
        assert [alone.reason(i) for i in range(50)] == [shared.reason(i) for i in range(50)]
    with Processes(2) as processes:
        sent = family.motion(angle, executor=processes)
        np.testing.assert_array_equal(alone.effort, sent.effort)
        np.testing.assert_array_equal(alone.assembled, sent.assembled)


TABLE = tuple((float(q), complex(3 * np.cos(q), 2 * np.sin(2 * q))) for q in np.linspace(0, 2 * np.pi, 25))


@pytest.mark.parametrize(("last", "wound"), [(2.5, False), (9.0, True)])
def test_torsion_springs_and_tables_over_the_input_are_lanes(last, wound):
    """Where no spring counts whole turns the tape has it; elsewhere each variant is described alone."""
    springs = [
        TorsionSpring(("crank", "coupler"), 0.7, -1.5, 0.01),
        TorsionSpring(("coupler", "rocker"), 2.0, 0.3),
        TorsionSpring(("ground", "crank"), 0.2, 0.1),
    ]
    m = four_bar(torsion_springs=springs, forces=[Force("coupler", "H", 0j, history=TABLE)])
    paths = ("links.coupler.C.x", "ground.D.x", "torsion_springs.2.stiffness", "torsion_springs.2.free_angle")
    rng = np.random.default_rng(4)
    numbers = {p: float(value(m, p)) * (1 + 0.05 * rng.normal(size=24)) for p in paths}
    angle = np.linspace(0.7, last, 9)
    motion = m.vary(numbers).motion(angle)
    solver = Solver(motion.part)
    _, alone = solver.lanes([Effort(0)])
    assert alone.all() == wound
    assert wound or not alone.any()
    effort, force = motion.effort, motion.reaction("C", "rocker")
    for i in range(24):
        alone_one = m.vary(numbers)[i].motion(angle, 8.0, -3.0)
        scale = np.nanmax(np.abs(alone_one.effort))
        np.testing.assert_allclose(effort[i], alone_one.effort, rtol=1e-12, atol=1e-12 * scale)
        true = alone_one.reaction("C", "rocker")
        np.testing.assert_allclose(force[i], true, rtol=1e-11, atol=1e-12 * np.nanmax(np.abs(true)))
