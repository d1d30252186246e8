"""Dimensions found again from the path of a mechanism with other dimensions."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from importlib.resources import files

import mpmath as mp
import numpy as np
import pytest

from dalembert.arithmetic.choice import ENGINES
from virtualwork import DescriptionError, Guess, Guide, Input, Link, Mechanism, MechanismError
from virtualwork.describe.dimensions import changed, value
from virtualwork.family.target import Target

FOUR_BAR = Mechanism(
    ground={"A": (0, 0), "D": (0.1, 0)},
    links={
        "crank": Link({"A": (0, 0), "B": (0.04, 0)}),
        "coupler": Link({"B": (0, 0), "C": (0.12, 0), "H": (0.08, 0.05)}),
        "rocker": Link({"D": (0, 0), "C": (0.08, 0)}),
    },
    inputs=Input(link="crank"),
    guess=Guess(at=(0.7,), angles={"coupler": 0.35, "rocker": 1.0}),
)
SLIDER_CRANK = Mechanism(
    ground={"O": (0, 0)},
    links={
        "crank": Link({"O": (0, 0), "A": (0.06, 0)}),
        "rod": Link({"A": (0, 0), "B": (0.18, 0), "H": (0.09, 0.05)}),
    },
    guides=[Guide("B", "rod", "ground", through=0.02 - 0.01j, angle=np.radians(30))],
    inputs=Input(link="crank"),
    guess=Guess(at=(1.7,), angles={"rod": 0.0}),
)
# Watt I, of the examples: every link stands parallel to the ground at the guess
WATT = Mechanism(
    ground={"A": (-3.74, -2.41), "G": (7.32, -3.51)},
    links={
        "AB": Link({"A": (0, 0), "B": (1.02, 3.32)}),
        "BCD": Link({"B": (0, 0), "C": (4.30, -0.48), "D": (2.48, 3.10)}),
        "DE": Link({"D": (0, 0), "E": (5.32, 1.30)}),
        "EF": Link({"E": (0, 0), "F": (3.06, -1.96)}),
        "CFG": Link({"C": (0, 0), "F": (6.56, 2.92), "G": (5.74, -3.94)}),
    },
    inputs=Input(link="AB"),
    guess=Guess(at=(0.0,), angles={"BCD": 0.0, "DE": 0.0, "EF": 0.0, "CFG": 0.0}),
)
# a crank-rocker with a dyad between its coupler and its rocker: it turns all the way
TURNING_WATT = Mechanism(
    ground={"A": (0, 0), "D": (0.1, 0)},
    links={
        "crank": Link({"A": (0, 0), "B": (0.04, 0)}),
        "coupler": Link({"B": (0, 0), "C": (0.12, 0), "P": (0.08, 0.06)}),
        "rocker": Link({"D": (0, 0), "C": (0.08, 0), "R": (0.12, -0.03)}),
        "upper": Link({"P": (0, 0), "E": (0.09, 0), "H": (0.05, 0.03)}),
        "lower": Link({"R": (0, 0), "E": (0.07, 0)}),
    },
    inputs=Input(link="crank"),
    guess=Guess(at=(0.7,), angles={"coupler": 0.35, "rocker": 1.0, "upper": -0.3, "lower": 1.5}),
)
CASES = {
    "four-bar": (
        FOUR_BAR,
        "H",
        "links.crank.B.x links.coupler.C.x links.coupler.H.x links.coupler.H.y links.rocker.C.x ground.D.x",
        (0.0, 2 * np.pi),
    ),
    "slider-crank": (
        SLIDER_CRANK,
        "H",
        "links.crank.A.x links.rod.B.x links.rod.H.x links.rod.H.y slots.1.angle slots.1.through.y",
        (0.0, 2 * np.pi),
    ),
    "turning Watt": (
        TURNING_WATT,
        "H",
        "links.crank.B.x links.coupler.C.x links.coupler.P.x links.coupler.P.y links.rocker.C.x links.rocker.R.x "
        "links.rocker.R.y links.upper.E.x links.upper.H.x links.upper.H.y links.lower.E.x ground.D.x",
        (0.0, 2 * np.pi),
    ),
    "Watt": (
        WATT,
        "E",
        "links.AB.B.x links.AB.B.y links.BCD.D.x links.BCD.D.y links.DE.E.x links.DE.E.y ground.G.x",
        (-0.08, 0.08),
    ),
}


def fitted(name, count, timed, seed):
    """A fit that begins at other dimensions, in bounds of 30 % about those that made the target."""
    truth, point, paths, (low, high) = CASES[name]
    q = np.linspace(low, high, count, endpoint=False)
    target = truth.motion(q).point(point).position
    own = {path: value(truth, path) for path in paths.split()}
    free = {path: tuple(sorted((0.7 * number, 1.3 * number))) for path, number in own.items()}
    apart = np.random.default_rng(seed).uniform(0.75, 1.25, len(own))
    begun = changed(truth, {path: number * k for (path, number), k in zip(own.items(), apart, strict=True)})
    found = begun.fit(point, target, free, q if timed else None, seed=seed)
    return found, target, truth.size


@pytest.mark.parametrize(
    ("name", "timed"),
    [
        *((name, True) for name in CASES),
        ("four-bar", False),
        ("slider-crank", False),
        ("Watt", False),
        # twelve dimensions and the inputs: seconds
        pytest.param("turning Watt", False, marks=pytest.mark.slow),
    ],
)
def test_a_path_is_met_by_the_mechanism_that_is_found(name, timed):
    found, target, size = fitted(name, 10, timed, 1)
    # described anew, by the found numbers and inputs alone
    again = found.mechanism.motion(found.inputs).point(CASES[name][1]).position
    assert np.abs(again - target).max() < 1e-9 * size
    assert found.max < 1e-9 * size
    assert found.remarks == ()


# each seed scrambles the starts and puts the file's own numbers elsewhere
@pytest.mark.slow
@pytest.mark.parametrize("count", [10, 60])
@pytest.mark.parametrize("name", CASES)
def test_nineteen_of_twenty_seeds_meet_the_timed_path(name, count):
    fits = [fitted(name, count, True, seed) for seed in range(20)]
    assert sum(found.max < 1e-9 * size for found, _, size in fits) >= 19


def test_the_same_seed_gives_the_same_numbers():
    one, two = (fitted("four-bar", 10, False, 3)[0] for _ in range(2))
    assert one.parameters == two.parameters
    assert one.evaluations == two.evaluations


def test_a_target_that_no_dimension_meets_is_met_at_the_least_squares():
    # an arm whose end has to lie on circles of 1 and 2 m: the mean is nearest, half a metre away
    arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 1.2})}, inputs=Input("arm"))
    found = arm.fit("P", [(1, 0), (0, 2)], {"links.arm.P.x": (0.5, 3)}, inputs=[0, np.pi / 2])
    assert found.parameters["links.arm.P.x"] == pytest.approx(1.5, abs=1e-9)
    assert found.rms == pytest.approx(0.5, abs=1e-12)
    assert found.max == pytest.approx(0.5, abs=1e-8)
    short = arm.fit("P", [(1, 0), (0, 2)], {"links.arm.P.x": (0.5, 1.4)}, inputs=[0, np.pi / 2])
    assert short.remarks == ("fit: links.arm.P.x ends at its bound",)


def test_a_gap_between_the_target_points_is_a_branch_defect():
    # 100² + 90² − 2·100·90 cos q < (120 − 80)²: no pose for |q| < 23.56 deg, and the way round leads past it
    longer = changed(FOUR_BAR, {"links.crank.B.x": 0.09})
    q = np.array([-1.0, -0.9, 0.9, 1.0])
    target = longer.motion(q).point("H").position
    found = longer.fit("H", target, {"links.coupler.H.y": (0.02, 0.07)}, inputs=q)
    assert found.max < 1e-9
    (said,) = found.remarks
    limit = np.degrees(np.arccos((0.1**2 + 0.09**2 - 0.04**2) / (2 * 0.1 * 0.09)))
    low, high = (float(word.split()[0]) for word in said.split("from ")[1].split(" (")[0].split(" to "))
    assert "branch defect" in said
    # the range is looked at in 720 steps
    assert -limit <= low < -limit + np.degrees(2 / 720)
    assert limit - np.degrees(2 / 720) < high <= limit


def test_points_out_of_order_are_an_order_defect():
    # on a circle in the order 1, 3, 2, 4: whichever way the arm turns
    arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 1})}, inputs=Input("arm"))
    angles = np.array([0.1, 0.8, 0.5, 1.2])
    found = arm.fit("P", np.exp(1j * angles), {"links.arm.P.x": (0.5, 3)})
    assert found.inputs == pytest.approx(angles, abs=1e-9)
    assert found.remarks == ("fit: order defect: the input meets target point 3 before target point 2",)


@pytest.mark.parametrize("exact", [True, False])
def test_a_mechanism_off_the_tape_is_fitted_alone_and_with_differences(monkeypatch, exact):
    from virtualwork.family.design import Alone
    from virtualwork.family.part import Solver

    monkeypatch.setattr(Solver, "written", None)
    if not exact:
        monkeypatch.setattr(Alone, "written", None)
    truth, point, *_ = CASES["four-bar"]
    q = np.linspace(0, 5, 8)
    target = truth.motion(q).point(point).position
    for inputs in (q, None):
        found = truth.fit(
            point, target, {"ground.D.x": (0.08, 0.11), "links.coupler.H.y": (0.01, 0.09)}, inputs, starts=8
        )
        assert found.max < 1e-9 * truth.size
        assert exact == (found.remarks == ())


def stephenson():
    """Stephenson III, driven in its five-bar loop: a triad, which has no closed form."""
    return Mechanism.from_toml(str(files("cli") / "examples" / "stephenson-six-bar" / "stephenson.toml"))


def test_a_design_that_cannot_be_put_together_has_no_number_in_any_row():
    m = stephenson()
    design = m.design(["links.left.B.x"], "points.E", "links.coupler")
    x = [100 * m.size], [m.at[0], m.at[0] + 0.1]
    assert np.isnan(design(*x)).all()
    assert design(*x).shape == (3, 2)
    assert np.isnan(design.slopes(*x)).all()


@pytest.mark.parametrize("timed", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_path_of_a_group_without_a_closed_form_is_met_with_exact_derivatives(timed):
    truth = stephenson()
    q = truth.at[0] + np.linspace(-0.6, 0.6, 12)
    target = truth.motion(q).point("E").position
    free = {
        path: tuple(np.sort(np.outer(value(truth, path).real, (0.9, 1.1)).ravel()))
        for path in ("links.left.B.x", "links.coupler.E.x", "links.coupler.E.y", "links.right.C.x")
    }
    begun = changed(truth, {path: 0.03 * low + 0.97 * high for path, (low, high) in free.items()})
    found = begun.fit("E", target, free, q if timed else None, starts=8)
    assert found.remarks == ()
    again = found.mechanism.motion(found.inputs).point("E").position
    assert np.abs(again - target).max() < 1e-9 * truth.size


def test_derivatives_of_a_design_without_a_closed_form_in_fifty_digits():
    """Newton's iteration in fifty digits at both sides of each dimension, 1e-20 apart."""
    m = stephenson()
    paths = [
        "links.left.B.x",
        "links.coupler.C.x",
        "links.coupler.E.y",
        "links.crank.F.x",
        "ground.G.y",
        "links.right.C.x",
    ]
    q = m.at[0] + np.array([-0.4, 0.0, 0.7])
    own = np.array([float(value(m, path).real) for path in paths])
    found = m.design(paths, "points.E").slopes(own, q)
    motion = m.motion(q)
    at = {name: motion.point(name).complex(0) for name in "BCEF"}
    with mp.workdps(50):

        def places(i, numbers, angle):
            """B, C and E from the lengths alone: six equations for their coordinates."""
            given = dict(zip(paths, numbers, strict=True))

            def number(path):
                return given.get(path, mp.mpf(float(value(m, path).real)))

            ground = {name: mp.mpc(number(f"ground.{name}.x"), number(f"ground.{name}.y")) for name in "ADG"}
            tip = ground["G"] + number("links.crank.F.x") * mp.exp(1j * angle)
            side = number("links.coupler.C.x")
            apex = mp.mpc(number("links.coupler.E.x"), number("links.coupler.E.y"))

            def gaps(bx, by, turn):
                b, along = mp.mpc(bx, by), mp.exp(1j * turn)
                c, e = b + side * along, b + apex * along
                return [
                    abs(b - ground["A"]) ** 2 - number("links.left.B.x") ** 2,
                    abs(c - ground["D"]) ** 2 - number("links.right.C.x") ** 2,
                    abs(e - tip) ** 2 - number("links.rod.E.x") ** 2,
                ]

            near = at["B"][i], np.angle(at["C"][i] - at["B"][i])
            start = mp.mpf(near[0].real), mp.mpf(near[0].imag), mp.mpf(near[1])
            bx, by, turn = mp.findroot(gaps, start, tol=mp.mpf(10) ** -90)
            return mp.mpc(bx, by) + apex * mp.exp(1j * turn)

        for i, angle in enumerate(q):
            exact = [mp.mpf(float(x)) for x in [*own, angle]]
            for j in range(len(exact)):
                h = mp.mpf(10) ** -20
                ends = []
                for side in (-1, 1):
                    moved = [*exact]
                    moved[j] += side * h
                    ends.append(places(i, moved[:-1], moved[-1]))
                slope = (ends[1] - ends[0]) / (2 * h)
                off = abs(complex(slope) - complex(*found[:, i, j]))
                # angles are in rad, lengths in m
                assert off <= 1e-12 * max(abs(slope), m.size if j == len(paths) else 1), (i, j)


@pytest.mark.parametrize(
    ("options", "error", "said"),
    [
        ({"target": [(1, 0)]}, ValueError, "expected two or more"),
        ({"target": [(1, 0), (np.nan, 1)]}, ValueError, "finite"),
        ({"inputs": [1.0]}, ValueError, "one for each row"),
        ({"wanted": "X"}, DescriptionError, "no point is named 'X'"),
        ({"free": {}}, DescriptionError, "expected one or more"),
        ({"free": {"ground.D.x": (0.2, 0.1)}}, DescriptionError, "expected low < high"),
        ({"free": {"ground.D": (0.1, 0.2)}}, DescriptionError, "names two numbers"),
        ({"free": {"links.crank.mass": (0.1, 0.2)}}, DescriptionError, "moves no point"),
        ({"free": {"links.crnk.B.x": (0.1, 0.2)}}, DescriptionError, "did you mean"),
        ({"free": {"ground.D.x": (8, 9)}}, MechanismError, "none can be assembled"),
    ],
)
def test_what_cannot_be_fitted_is_named(options, error, said):
    given = {"wanted": "H", "target": [(0, 0.1), (0.05, 0.1)], "free": {"ground.D.x": (0.09, 0.11)}}
    with pytest.raises(error, match=said):
        FOUR_BAR.fit(**given | options)


def test_a_function_is_generated_over_the_input():
    q = np.linspace(0, 2, 15)
    truth = changed(FOUR_BAR, {"links.coupler.C.x": 0.11, "links.rocker.C.x": 0.085})
    target = truth.motion(q).link("rocker").angle
    free = {"links.coupler.C.x": (0.09, 0.15), "links.rocker.C.x": (0.06, 0.11)}
    # whole turns of an angle are no difference
    found = FOUR_BAR.fit("links.rocker", target + 2 * np.pi * np.arange(15), free, q)
    assert found.parameters["links.coupler.C.x"] == pytest.approx(0.11, rel=1e-9)
    assert found.parameters["links.rocker.C.x"] == pytest.approx(0.085, rel=1e-9)
    assert found.max < 1e-12
    travel = SLIDER_CRANK.motion(q).slide("B").position
    found = SLIDER_CRANK.fit(
        "slides.B", travel, {"links.crank.A.x": (0.04, 0.09), "links.rod.B.x": (0.1, 0.3)}, q
    )
    assert list(found.parameters.values()) == pytest.approx([0.06, 0.18], rel=1e-9)


def test_a_row_of_weight_two_counts_as_two_rows():
    # P on a circle: two places at 1 and 2 m, and the second once more, have their mean at 5/3 m
    arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 1.2})}, inputs=Input("arm"))
    free = {"links.arm.P.x": (0.5, 3)}
    places, q = [(1, 0), (0, 2)], [0, np.pi / 2]
    by_row = Target({"P": places}, q, {"P": [1.0, 2.0]})
    assert arm.fit([by_row], free=free).parameters["links.arm.P.x"] == pytest.approx(5 / 3, abs=1e-9)
    twice = [Target({"P": places}, q), Target({"P": [(0, 2), (0, 2)]}, [np.pi / 2] * 2, {"P": 0.5})]
    assert arm.fit(twice, free=free).parameters["links.arm.P.x"] == pytest.approx(5 / 3, abs=1e-9)


def test_a_point_and_an_angle_are_met_together():
    q = np.linspace(0, 5, 9)
    truth = changed(FOUR_BAR, {"ground.D.x": 0.104, "links.coupler.H.y": 0.045})
    motion = truth.motion(q)
    target = Target({"H": motion.point("H").position, "links.rocker": motion.link("rocker").angle})
    free = {"ground.D.x": (0.09, 0.12), "links.coupler.H.y": (0.03, 0.07)}
    found = FOUR_BAR.fit([target], free=free)
    assert [each.name for each in found.reached] == ["H", "links.rocker"]
    assert found.parameters["ground.D.x"] == pytest.approx(0.104, rel=1e-9)
    assert found.inputs == pytest.approx(q, abs=1e-8)
    assert max(each.max for each in found.reached) < 1e-11


def test_the_best_distinct_solutions_are_all_there_are():
    # an arm of length r at an angle: through (1, 0) and (0, 1) leads r = ±1, with P at its other end
    arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j, "P": 0.3})}, inputs=Input("arm"))
    found = arm.fit("P", [(1, 0), (0, 1)], {"links.arm.P.x": (-2, 2)}, best=2)
    (other,) = found.others
    ends = sorted(each.parameters["links.arm.P.x"] for each in (found, other))
    assert ends == pytest.approx([-1, 1], abs=1e-9)


def test_two_workers_find_the_same_numbers():
    one, _, _ = fitted("four-bar", 10, False, 2)
    truth, point, paths, _ = CASES["four-bar"]
    free = {
        path: tuple(sorted((0.7 * value(truth, path), 1.3 * value(truth, path)))) for path in paths.split()
    }
    with ThreadPoolExecutor(2) as pool:
        two = changed(truth, {}).fit(point, one.target, free, seed=2, executor=pool)
    alone = changed(truth, {}).fit(point, one.target, free, seed=2)
    assert two.parameters == alone.parameters
    assert two.evaluations == alone.evaluations


def test_a_problem_travels_to_another_process():
    design = FOUR_BAR.design(["ground.D.x"], "points.H", "links.rocker")
    q = np.linspace(0, 1, 5)
    there = pickle.loads(pickle.dumps(design))
    assert (there([0.1], q) == design([0.1], q)).all()


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", CASES)
def test_a_design_is_what_its_own_description_does(monkeypatch, name, engine):
    truth, point, paths, (low, high) = CASES[name]
    paths, q = paths.split(), np.linspace(low, high, 73)
    design = truth.design(paths, point)
    own = np.array([value(truth, path) for path in paths])
    for seed in range(4):
        x = own * np.random.default_rng(seed).uniform(0.8, 1.2, len(own))
        monkeypatch.delenv("DALEMBERT_ENGINE", raising=False)
        alone = changed(truth, dict(zip(paths, x.tolist(), strict=True))).motion(q).point(point).position.T
        monkeypatch.setenv("DALEMBERT_ENGINE", engine)
        assert design(x, q) == pytest.approx(alone, abs=1e-13 * truth.size, nan_ok=True)
        slopes = design.slopes(x, q)
        step = 1e-6 * truth.size
        for i in range(len(own)):
            apart = step * np.eye(len(own))[i]
            unit = (design(x + apart, q) - design(x - apart, q)) / (2 * step)
            good = np.isfinite(unit) & (np.abs(slopes[..., i]) < 10)
            assert slopes[..., i][good] == pytest.approx(unit[good], rel=1e-4, abs=1e-4)


def test_a_picture_has_the_target_and_both_curves():
    from matplotlib.figure import Figure

    q = np.linspace(0, 2, 5)
    motion = FOUR_BAR.motion(q)
    target = Target({"H": motion.point("H").position, "links.rocker": motion.link("rocker").angle}, q)
    found = changed(FOUR_BAR, {"ground.D.x": 0.11}).fit([target], free={"ground.D.x": (0.09, 0.12)})
    figure = Figure()
    path, angle = found.plot(figure)
    before, after, marks = path.lines
    assert (marks.get_xdata(), marks.get_ydata()) == tuple(
        pytest.approx(1e3 * motion.point("H").position[:, k]) for k in (0, 1)
    )
    ends = [0, -1]
    assert after.get_xdata()[ends] == pytest.approx(marks.get_xdata()[ends])
    assert np.abs(before.get_xdata() - after.get_xdata()).max() > 1
    assert angle.lines[2].get_ydata() == pytest.approx(np.degrees(motion.link("rocker").angle))


@pytest.mark.parametrize(("off", "weight"), [(20.0, 1.0), (1.0, 1e6)])
def test_a_target_out_of_reach_is_approached_by_mechanisms_that_can_be_assembled(off, weight):
    """The nearest of four-bars that are drawn within the bounds, each moved alone, is no nearer."""
    m = Mechanism(
        {"A": 0j, "D": 0.1},
        {
            "crank": Link({"A": 0j, "B": 0.04}),
            "coupler": Link({"B": 0j, "C": 0.12, "H": 0.08 + 0.04j}),
            "rocker": Link({"D": 0j, "C": 0.08}),
        },
        inputs=Input("crank"),
        guess=Guess(0.7, {"coupler": 0.4, "rocker": 1.0}),
    )
    q = np.linspace(0.0, 6.0, 12)
    target = m.motion(q).point("H").position + off * m.size
    free = {"links.crank.B.x": (0.02, 0.2), "links.coupler.C.x": (0.05, 0.3), "links.rocker.C.x": (0.03, 0.2)}
    found = m.fit([Target({"points.H": target}, q, {"points.H": weight})], free=free, starts=16)
    assert found.mechanism.motion(q).assembled.all()
    rng = np.random.default_rng(0)
    drawn = {path: rng.uniform(low, high, 300) for path, (low, high) in free.items()}
    motion = m.vary(drawn).motion(q)
    apart = np.abs((motion.point("H").position - target) @ np.array([1.0, 1j]))
    assert found.rms <= np.sqrt((apart[motion.assembled.all(axis=1)] ** 2).mean(axis=1)).min() * (1 + 1e-12)
