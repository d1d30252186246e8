"""Groups with no closed form that hold slides and tied angles; singular systems among good ones."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.stress.topologies import generate
from dalembert.arithmetic.tape import Tape
from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism
from virtualwork.describe.dimensions import changed
from virtualwork.formulas import group_loops
from virtualwork.formulas.group_loops import Loops
from virtualwork.formulas.lanes import Lanes
from virtualwork.formulas.newton import newton
from virtualwork.formulas.numbers import inverse_norm, solve, solve_columns, stack
from virtualwork.formulas.positions import State
from virtualwork.study.newton_table import all_at_once


def triad() -> Mechanism:
    """A ternary link held by a rod, by a rocker, and by a bar along which it slides without turning."""
    return Mechanism(
        {"A": (0, 0), "G": (150, 60), "D": (100, 0)},
        {
            "crank": Link({"G": (0, 0), "F": (20, 0)}),
            "rod": Link({"F": (0, 0), "E": (105, 0)}),
            "coupler": Link({"B": (0, 0), "C": (80, 0), "E": (45, 60)}),
            "left": Link({"A": (0, 0), "B": (70, 0)}),
            "bar": Link({"D": (0, 0)}),
            "wheel": Link({"A": (0, 0), "W": (1, 0)}),
        },
        [Guide("C", "coupler", "bar", 5 + 2j, 0.3, -1.4)],
        [Gear(("bar", "wheel"), 1.3)],
        inputs=Input(link="crank"),
        guess=Guess(
            math.radians(90),
            points={"B": (10, 69), "C": (88, 74), "E": (50, 130), "F": (150, 80)},
            angles={"wheel": 0.2},
        ),
    )


def test_a_slide_and_a_tied_angle_in_a_group_of_its_own_kind() -> None:
    m = triad()
    group = next(g for g in m.assembly.plan.groups if g.kind == "Newton")
    assert group.slides
    assert group.ties
    q = np.radians([80.0, 90.0, 100.0])
    motion = m.motion(q, speed=2.0, acceleration=0.0)
    assert motion.assembled.all()

    def place(link: str, z: complex) -> np.ndarray:
        return motion.at(link, z).complex(0)

    # every joint from both of its links
    for name, first, second in (("B", "left", "coupler"), ("E", "coupler", "rod"), ("F", "rod", "crank")):
        gap = place(first, m.links[first].points[name]) - place(second, m.links[second].points[name])
        assert np.abs(gap).max() < 1e-12 * m.size
    bar = motion.link("bar").angle
    slide = motion.slide("C").position
    on_bar = 100 + np.exp(1j * bar) * (5 + 2j + slide * np.exp(0.3j))
    assert motion.point("C").complex(0) == pytest.approx(on_bar, rel=1e-13)
    assert np.exp(1j * motion.link("coupler").angle) == pytest.approx(
        np.exp(1j * (bar + 0.3 - 1.4)), abs=1e-14
    )
    assert motion.link("coupler").omega == pytest.approx(motion.link("bar").omega, rel=1e-14)
    # the wheel counts the turns of the bar from the guess, which is the second pose
    assert motion.point("W").complex(0) == pytest.approx(np.exp(1j * (0.2 + 1.3 * (bar - bar[1]))), abs=1e-13)
    # the rates against a polynomial through positions close by
    t = np.cos(np.pi * (np.arange(16) + 0.5) / 16) * 0.05
    near = m.motion(q[1] + 2 * t)
    for values, found in (
        (near.slide("C").position, (motion.slide("C").speed, motion.slide("C").acceleration)),
        (np.unwrap(near.link("bar").angle), (motion.link("bar").omega, motion.link("bar").alpha)),
    ):
        fit = np.polynomial.Chebyshev.fit(t, values, 11)
        for k, rate in enumerate(found, 1):
            assert rate[1] == pytest.approx(fit.deriv(k)(0.0), rel=1e-7)
    one = m.motion(q[1], speed=2.0)
    assert one.slide("C").position[0] == pytest.approx(slide[1], rel=1e-13)
    assert one.slide("C").speed[0] == pytest.approx(motion.slide("C").speed[1], rel=1e-12)


def test_a_singular_pose_spoils_no_other() -> None:
    jacobian = np.array(
        [[[2.0, 0.0], [0.0, 4.0]], [[1.0, 2.0], [2.0, 4.0]], [[np.nan, 0.0], [0.0, 1.0]], np.eye(2)]
    )
    right = np.array([[2.0, 4.0], [1.0, 1.0], [1.0, 1.0], [5.0, np.inf]])
    x = solve(jacobian, right)
    assert x[0].tolist() == [1.0, 1.0]
    assert np.isnan(x[1:]).all()
    norm = inverse_norm(jacobian)
    assert norm[[0, 1, 3]].tolist() == [0.5, np.inf, 1.0]
    assert np.isnan(norm[2])
    # the row sums of [[1, 2], [3, 5]]⁻¹ = [[-5, 2], [3, -1]]
    assert inverse_norm(np.array([[[1.0, 2.0], [3.0, 5.0]]]))[0] == pytest.approx(7.0, rel=1e-14)


def test_redundant_rows_are_solved_where_they_agree() -> None:
    """Three rows for two unknowns: [1, 2] solves them all; ‖J⁺‖∞ of an upright stack of unit rows is its share."""
    jacobian = np.array([[[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, -1.0]]])
    assert solve(jacobian, np.array([[1.0, 2.0, 3.0, 0.0]]))[0] == pytest.approx([1.0, 2.0], rel=1e-14)
    assert inverse_norm(np.array([[[1.0], [1.0]]]))[0] == pytest.approx(1.0, rel=1e-15)


def test_complex_columns_become_two_real_rows() -> None:
    cols = [[1 + 2j, 3 - 1j], [np.array([1j, 2j]), 5.0]]
    found = stack(cols, 2)
    assert found[0].tolist() == [[1, 3], [2, -1], [0, 5], [1, 0]]
    assert found[1].tolist() == [[1, 3], [2, -1], [0, 5], [2, 0]]
    # x + iy with 1·x + i·y = 3 + 4j
    assert solve_columns([[1 + 0j, 1j]], [-3 - 4j]) == [3.0, 4.0]
    many = solve_columns([[1 + 0j, 1j]], [np.array([-3 - 4j, 1j])])
    assert [v.tolist() for v in many] == [[3.0, 0.0], [4.0, -1.0]]


def four_bar() -> Mechanism:
    return Mechanism(
        {"A": (0, 0), "D": (100, 0)},
        {
            "crank": Link({"A": (0, 0), "B": (40, 0)}),
            "coupler": Link({"B": (0, 0), "C": (120, 0)}),
            "rocker": Link({"D": (0, 0), "C": (80, 0)}),
        },
        inputs=Input(link="crank"),
        guess=Guess(math.radians(40), {"coupler": 0.3, "rocker": 1.0}),
    )


def test_a_damped_step_never_widens_the_gap() -> None:
    """From anywhere that leads home: the gap falls from step to step, and no angle turns by more than a radian in one."""
    m = four_bar()
    merged, group = m.assembly.merged
    loops = m.assembly.loops(group)
    rng = np.random.default_rng(0)
    closed = 0
    for _ in range(40):
        st = State([np.array([m.at[0]])])
        for step in merged.steps[: merged.steps.index(group)]:
            m.assembly.run([step], st)
        start = rng.uniform(-math.pi, math.pi, (1, 2))
        x, found = newton(loops, st, start, m.size)
        if not found[0]:  # in a valley of the gap no twelfth halving falls any further
            continue
        closed += 1
        steps = [loops.search(st, start, m.size, limit) for limit in range(61)]
        assert [to.tolist() for to, _ in (steps[0], steps[-1])] == [start.tolist(), x.tolist()]
        gaps = np.array([gap[0] for _, gap in steps])
        assert (gaps[1:] <= gaps[:-1] * (1 + 1e-12) + 1e-13 * m.size).all()
        turned = np.abs(np.diff([to[0] for to, _ in steps], axis=0))
        assert turned.max() <= 1 + 1e-12
    assert closed >= 30


def known(m: Mechanism, q: object) -> tuple[Loops, State]:
    """All loops of a mechanism at once, and what they depend on at inputs."""
    merged, group = m.assembly.merged
    st = State([q])
    m.assembly.run(merged.steps[: merged.steps.index(group)], st)
    return m.assembly.loops(group), st


def test_many_poses_close_as_each_of_them_alone() -> None:
    """By numpy and on floats, with a pose that does not close and one whose input is no number."""
    m = four_bar()
    q = np.array([0.3, 1.0, np.nan, 2.0])
    start = np.array([[0.5, 1.2], [0.3, 1.0], [0.3, 1.0], [np.nan, 1.0]])
    loops, st = known(m, q)
    x, closed = newton(loops, st, start, m.size)
    assert closed.tolist() == [True, True, False, False]
    for i in range(4):
        alone, own = newton(*known(m, float(q[i])), start[i : i + 1], m.size)
        assert own[0] == closed[i]
        if closed[i]:
            assert np.abs(alone[0] - x[i]).max() < 1e-15
            assert m.motion(q[i]).link("coupler").angle == pytest.approx(x[i, :1], abs=1e-15)


def test_a_part_of_a_sweep_has_the_digits_of_the_whole() -> None:
    """Few poses are searched for one by one on floats; not those that are a part of many."""
    m = triad()
    q = np.linspace(1.2, 1.8, 300)
    whole = Lanes(m.assembly, q)
    part = Lanes(m.assembly, q[40:45], block_of=len(q))
    assert part.assembled.all()
    assert part.angle("coupler").tolist() == whole.angle("coupler")[40:45].tolist()


@pytest.mark.parametrize("many", [False, True])
def test_a_step_whose_system_is_not_on_the_tape_is_the_same(
    many: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Groups of more unknowns than `WHOLE` take each step from LAPACK: step for step the same search."""
    m = four_bar()
    q = np.full(20, 0.9) if many else 0.9
    start = np.random.default_rng(1).uniform(-math.pi, math.pi, (20 if many else 1, 2))
    loops, st = known(m, q)
    monkeypatch.setattr(group_loops, "WHOLE", 1)
    monkeypatch.setattr(group_loops, "_topology", group_loops.Topology)
    other = Loops(loops.group)
    for limit in range(12):
        (x, gap), (y, left) = (each.search(st, start, m.size, limit) for each in (loops, other))
        assert x == pytest.approx(y, abs=1e-9)
        assert gap == pytest.approx(left, abs=1e-9)


def test_groups_of_other_dimensions_have_the_same_tape() -> None:
    """A tape holds the topology alone; what is nothing is left out of it, and makes another one."""

    def tape(rocker: complex) -> Tape:
        m = replace(four_bar(), links={**four_bar().links, "rocker": Link({"D": 0j, "C": rocker})})
        return m.assembly.loops(m.assembly.plan.groups[0]).tape

    assert tape(80) is tape(81.5)
    assert tape(80) is not tape(80 + 1j)


def test_all_at_once_says_how_far_another_assembly_is() -> None:
    """The two assemblies are mirror images in the diagonal DB: each angle differs by twice that to the diagonal."""
    m = four_bar()
    here = m.assembly
    assert all_at_once(here, m.at).difference < 1e-14
    (other,) = (a for a in m.assemblies() if a.signs != here.signs)
    diagonal = 100 - 40 * np.exp(1j * m.at[0])  # from B to D
    d = abs(diagonal)
    coupler = math.acos((120**2 + d**2 - 80**2) / (2 * 120 * d))
    rocker = math.pi - math.acos((80**2 + d**2 - 120**2) / (2 * 80 * d))
    apart = [abs(math.remainder(2 * angle, 2 * math.pi)) for angle in (coupler, rocker)]
    assert all_at_once(other, m.at).difference == pytest.approx(max(apart), rel=1e-13)


def test_a_gear_on_an_arm_that_multiplies_turns() -> None:
    """A ratio of 0.99996 on an arm turns a link 26 300 times as far: its angle rounds by 3e-11 rad, its loop by 3e-12."""
    m = generate(20261238).mechanism
    ratio = {"gears.2.ratio": 0.9999619792998344, "links.l2.P2.y": 0.28660601790560924}
    motion = changed(m, ratio).motion(np.linspace(0.5367, 0.5377, 41))
    # one pose in four was called not assembled
    assert motion.assembled.all()
    assert np.ptp(motion.condition) < 0.1
