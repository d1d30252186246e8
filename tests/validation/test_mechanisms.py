"""Published mechanisms: printed digits, and exact values to 1e-12."""

from __future__ import annotations

import math
from importlib.resources import files

import numpy as np
import pytest

from virtualwork import (
    Guess,
    Guide,
    Input,
    Link,
    Mechanism,
    block_on_bar,
    crank_rod_piston,
    on_incline,
    on_moving_ramp,
    rotation,
    second_point,
    sense,
)
from virtualwork.study.check import Check, grashof_class
from virtualwork.study.newton_table import all_at_once

R = math.radians
EXAMPLES = files("cli") / "examples"


def example(folder: str, file: str) -> Mechanism:
    return Mechanism.from_toml(str(EXAMPLES / folder / file))


def degrees(motion, *links):
    return [math.degrees(motion.link(name).angle[0]) for name in links]


# --- 003: R. Nicoletti, SEM 104, lecture 7 -----------------------------------------------------------------
KLANN = ("coupler", "rocker", "arm", "leg")
PRINTED = {  # gamma, beta, delta, theta; gamma and theta are positive clockwise there
    2: [10.5138, 67.0074, 36.7323, 45.7048],
    3: [10.6570, 67.3283, 34.4691, 45.7564],
    4: [10.6570, 67.3283, 34.4634, 45.7220],
    5: [10.6570, 67.3283, 34.4634, 45.7220],
    6: [10.6570, 67.3283, 34.4634, 45.7220],
}
EXACT = {
    2: [10.513765783302766, 67.00962624523348, 36.73268616835997, 45.70461199396262],
    3: [10.659130307233932, 67.3292051414453, 34.47071362058157, 45.75621025899983],
    4: [10.659455241169335, 67.32948351863458, 34.46398625907649, 45.722937494850996],
    6: [10.65945524124986, 67.3294835208457, 34.463973119841164, 45.72293552846572],
}
SIGN = np.array([-1, 1, 1, -1])


def test_klann_at_60_degrees_in_closed_form():
    motion = example("klann", "klann.toml").motion(R(60), speed=10.0, acceleration=0.0)
    assert np.array(degrees(motion, *KLANN)) * SIGN == pytest.approx(EXACT[6], rel=1e-13)
    omega = [motion.link(n).omega[0] for n in KLANN]
    alpha = [motion.link(n).alpha[0] for n in KLANN]
    assert omega == pytest.approx([-0.447190154, 8.26873953, 3.575354533, -2.032034594], abs=6e-9)
    assert alpha == pytest.approx([6.848284, 14.9868316, -7.8791222, -11.5982907], abs=6e-7)
    assert motion.point("H").position[0] * 1e3 == pytest.approx(
        [796.0057379415451, -303.76275028920315], rel=1e-13
    )


def test_klann_newton_raphson_iterates():
    done = all_at_once(example("klann", "klann.toml").assembly, (R(60),))
    rows = {it.k: np.degrees(it.unknowns) * SIGN for it in done.iterates}
    for k, printed in PRINTED.items():
        assert rows[k] == pytest.approx(printed, abs=0.003)
    for k, exact in EXACT.items():
        assert rows[k] == pytest.approx(exact, rel=1e-12)
    residual = {it.k: it.residual * 1e3 for it in done.iterates}
    assert residual[2] == pytest.approx(10.746883121656163, rel=1e-12)
    assert residual[3] == pytest.approx(0.20763829226477937, rel=1e-10)
    assert residual[4] == pytest.approx(6.104257783031931e-05, rel=1e-6)
    # quadratic: each gap is bounded by a constant times the square of the one before
    assert residual[4] / residual[3] ** 2 < 1 < 1e3
    assert residual[3] / residual[2] ** 2 < 0.01
    assert done.closed
    assert done.difference < 1e-14


def test_two_disc_four_bar_newton_and_geometry_agree():
    m = example("two-disc-four-bar", "four-bar.toml")
    q = np.radians(np.arange(0, 360, 5.0))
    motion = m.motion(q)
    # the geometric method: the circle of radius 500 about B and of radius 120 about D
    b = 0.1 * np.exp(1j * q)
    c = 0.5 + 0.12 * np.exp(1j * motion.link("disc").angle)
    assert np.abs(c - b) == pytest.approx(np.full(len(q), 0.5), rel=1e-14)
    assert max(all_at_once(m.assembly, (v,)).difference for v in q) < 1e-13


# --- Norton, Design of Machinery ---------------------------------------------------------------------------
def norton(at, coupler, rocker, lengths=(40, 120, 80, 100)):
    a, b, c, d = lengths
    return Mechanism(
        {"A": (0, 0), "D": (d, 0)},
        {"crank": Link({"A": (0, 0), "B": (a, 0)}), "coupler": Link({"B": (0, 0), "C": (b, 0)}),
         "rocker": Link({"D": (0, 0), "C": (c, 0)})},
        inputs=Input(link="crank"),
        guess=Guess(R(at), {"coupler": R(coupler), "rocker": R(rocker)}),
    )  # fmt: skip


def test_norton_4_1_both_assemblies():
    m = norton(40, 20, 57)
    opened, crossed = (a.state((R(40),)) for a in m.assemblies())
    found = [math.degrees(np.angle(s.turn[n])) for s in (opened, crossed) for n in ("coupler", "rocker")]
    assert found == pytest.approx([20.30, 57.33, -60.98, -98.01], abs=0.006)
    assert found == pytest.approx([20.2978827882, 57.3248800704, -60.9779667959, -98.004964078], abs=1e-9)


def test_norton_6_7_and_7_1_velocity_and_acceleration():
    motion = norton(40, 20, 57).motion(R(40), speed=25.0, acceleration=15.0)
    found = [getattr(motion.link(n), k)[0] for k in ("omega", "alpha") for n in ("coupler", "rocker")]
    assert found == pytest.approx([-4.121, 6.998, 296.089, 470.134], abs=6e-4)
    assert found == pytest.approx([-4.1209144153, 6.9979852422, 296.0891931743, 470.133530261], rel=1e-10)


def test_norton_11_3_kinematics():
    motion = norton(60, 20, 104, (5, 15, 10, 19)).motion(R(60), speed=25.0, acceleration=-40.0)
    assert degrees(motion, "coupler", "rocker") == pytest.approx([20.9172248665, 104.4097212748], abs=1e-9)
    assert motion.link("coupler").alpha[0] == pytest.approx(120.8968454373, rel=1e-11)
    assert motion.link("rocker").alpha[0] == pytest.approx(276.2890990761, rel=1e-11)


def test_norton_4_2_and_6_8_slider_crank():
    m = Mechanism(
        {"O": (0, 0)},
        {"crank": Link({"O": (0, 0), "A": (40, 0)}), "rod": Link({"B": (0, 0), "A": (120, 0)})},
        [Guide("B", "rod", through=-20j)],
        inputs=Input(link="crank"),
        guess=Guess(R(60), {"rod": R(150)}),
    )
    found = []
    for a in m.assemblies():
        st = a.state((R(60),))
        found += [math.degrees(np.angle(st.turn["rod"])), st.slide[0]]
    assert found == pytest.approx([152.91, 126.84, 27.09, -86.84], abs=0.006)
    motion = m.motion(R(60), speed=-30.0)
    assert motion.link("rod").omega[0] == pytest.approx(5.6159790601, rel=1e-10)
    assert motion.slide("B").speed[0] == pytest.approx(1346.0932870725, rel=1e-12)


def test_triple_rocker_limits():
    m = norton(180, 17, 115, (2, 5, 2, 4))
    check = Check(m.assembly)
    assert np.degrees(check.input_limits) == pytest.approx([46.56746344221, 313.43253655779], abs=1e-10)
    assert np.degrees(check.dead_points) == pytest.approx([46.56746344221, 313.43253655779], abs=1e-10)
    assert check.four_bars[0].grashof == "triple-rocker"
    assert grashof_class(100, 40, 120, 80) == "crank-rocker"


def test_transmission_angle_of_norton_4_1():
    four = Check(norton(40, 20, 57).assembly).four_bars[0]
    # law of cosines at d = 100 - 40 and 100 + 40
    low = math.acos((120**2 + 80**2 - 60**2) / (2 * 120 * 80))
    high = math.acos((120**2 + 80**2 - 140**2) / (2 * 120 * 80))
    assert four.transmission == pytest.approx((low, high), rel=1e-14)


# --- slider-cranks -----------------------------------------------------------------------------------------
def slider(r, length, at, speed):
    m = Mechanism(
        {"O": (0, 0)},
        {
            "crank": Link({"O": (0, 0), "A": (r, 0)}),
            "rod": Link({"A": (0, 0), "M": (length / 2, 0), "B": (length, 0)}),
        },
        [Guide("B", "rod")],
        inputs=Input(link="crank"),
        guess=Guess(R(at), {"rod": 0.0}),
    )
    return m.motion(R(at), speed=speed, acceleration=0.0)


def test_slider_crank_at_90_degrees_exactly():
    motion = slider(1, 3, 90, 1.0)
    x, v, a = (motion.point("B").complex(k)[0].real for k in range(3))
    assert (x, v, a) == pytest.approx((math.sqrt(8), -1.0, 1 / math.sqrt(8)), abs=1e-14)
    assert motion.link("rod").alpha[0] == pytest.approx(1 / math.sqrt(8), abs=1e-14)


@pytest.mark.parametrize(
    ("source", "r", "length", "at", "rpm", "v", "a"),
    [("Khurmi 15.4", 0.3, 1.5, 40, 180, 4.196433719368739, 85.5988562671621),
     ("Khurmi 15.7", 0.3, 1.2, 60, 250, 7.672622158706391, 77.12922462049917)],
)  # fmt: skip
def test_khurmi_piston(source, r, length, at, rpm, v, a):
    motion = slider(r, length, at, rpm * math.pi / 30)
    assert abs(motion.slide("B").speed[0]) == pytest.approx(v, rel=1e-12), source
    assert abs(motion.slide("B").acceleration[0]) == pytest.approx(a, rel=1e-12), source


def test_khurmi_8_1_middle_of_the_rod():
    motion = slider(0.15, 0.6, 45, 10 * math.pi)
    m = motion.point("M")
    assert np.hypot(*m.velocity[0]) == pytest.approx(3.9953581078742966, rel=1e-12)
    assert np.hypot(*m.acceleration[0]) == pytest.approx(117.31042577013007, rel=1e-12)
    assert abs(motion.link("rod").omega[0]) == pytest.approx(5.642466973930921, rel=1e-12)
    assert abs(motion.link("rod").alpha[0]) == pytest.approx(171.54515606539752, rel=1e-12)


# --- Marghitu, R-RTR-RRT -----------------------------------------------------------------------------------
def test_marghitu_quick_return():
    m = example("quick-return", "quick-return.toml")
    motion = m.motion()
    assert motion.link("crank").omega[0] == pytest.approx(700 * math.pi / 30, rel=1e-15)
    assert degrees(motion, "link3") == pytest.approx([-17.8779871443], abs=1e-9)
    assert degrees(motion, "link4")[0] % 180 - 180 == pytest.approx(-64.7780996375, abs=1e-9)
    found = [motion.link(n).__getattribute__(k)[0] for k in ("omega", "alpha") for n in ("link3", "link4")]
    assert found == pytest.approx([-51.9342346696, 25.1764162312, 7157.346811472, 882.338887952], rel=1e-11)
    # the book's relative motion is along the line from B to C
    slide = motion.slide("B")
    assert [-slide.speed[0], -slide.acceleration[0]] == pytest.approx(
        [-6.7510845953, -1086.9445398647], rel=1e-11
    )
    assert motion.point("D").velocity[0] == pytest.approx([3.1886684813, 9.8852912221], rel=1e-11)
    assert motion.point("D").acceleration[0] == pytest.approx([73.9368294154, -1527.9482268156], rel=1e-11)
    assert motion.point("E").velocity[0] == pytest.approx([0, 8.3833287633], rel=1e-11, abs=1e-13)
    assert motion.point("E").acceleration[0] == pytest.approx([0, -1660.8656182122], rel=1e-11, abs=1e-10)
    # and its Coriolis part by 000 §1.10: the block B on the turning bar C-D
    b = motion.point("B")
    block = block_on_bar(
        b.complex(0)[0] - complex(-0.3, 0), motion.link("link3").omega[0], motion.link("link3").alpha[0],
        slide.speed[0], slide.acceleration[0], along=np.exp(1j * motion.link("link3").angle[0]),
    )  # fmt: skip
    assert block.velocity == pytest.approx(b.complex(1)[0], rel=1e-12)
    assert block.acceleration == pytest.approx(b.complex(2)[0], rel=1e-12)
    assert abs(block.coriolis) == pytest.approx(2 * 51.9342346696 * 6.7510845953, rel=1e-10)


# --- exact straight line, PMKS verification set ------------------------------------------------------------
def test_peaucellier_exactly():
    motion = example("peaucellier", "peaucellier.toml").motion(R(40), speed=3.0, acceleration=0.0)
    b = motion.point("B")
    assert b.position[0] == pytest.approx([1.5, 0.5459553513993035], abs=1e-12)
    assert b.velocity[0] == pytest.approx([0, 2.548067245721537], abs=1e-12)
    assert b.acceleration[0, 0] == pytest.approx(0, abs=1e-12)


def from_initial(ground, bodies, driven, guides=()):
    """A mechanism from initial coordinates: every link's frame is the ground's at the start."""
    return Mechanism(
        ground,
        {name: Link(points) for name, points in bodies.items()},
        guides,
        inputs=Input(link=driven),
        guess=Guess(0.0, dict.fromkeys(bodies, 0.0)),
    )


def test_pmks_teaching_four_bar():
    bodies = {
        "ABH": {"A": (0, 0), "B": (1.52, 0), "H": (0.7598, 1.0278)},
        "BCFG": {"B": (1.52, 0), "C": (4.23, 3.029), "F": (2.548, 1.958), "G": (2.053, 3.543)},
        "CDEI": {"C": (4.23, 3.029), "D": (4.572, 0), "E": (4.79, 1.632), "I": (4.1798, 1.952)},
    }
    m = from_initial({"A": (0, 0), "D": (4.572, 0)}, bodies, "ABH")
    motion = m.motion(
        [0.0, 2.0943951023931966, 4.188790204786368], speed=1.0796606752836921, acceleration=0.0
    )
    c = np.hstack([motion.point("C").position, motion.point("C").velocity, motion.point("C").acceleration])
    expected = [
        [4.23, 3.029, 1.6287169468742273, 0.18389606993429686, -2.2579278443726185, -1.1418778409864705],
        [3.077054467166948, 2.656490702762292, -1.4272765737164856, -0.8032027877138977, 0.5871467617162572,
         -0.6792798881809624],
        [2.0125060702645725, 1.655534905596225, 0.20384886817162773, 0.31515490184171946, 0.6104764759845882,
         0.8587157277768926],
    ]  # fmt: skip
    assert c == pytest.approx(np.array(expected), abs=1e-12)
    assert motion.link("CDEI").angle == pytest.approx([0, 0.40014850326711904, 0.8842266298146912], abs=1e-12)
    assert motion.link("BCFG").alpha == pytest.approx(
        [-0.09819336662115119, 0.22287499705197764, -0.06385931650435475], abs=1e-12
    )


def test_pmks_slider_crank():
    bodies = {"AB": {"A": (0, 0), "B": (4, 2)}, "BCD": {"B": (4, 2), "C": (12, 0), "D": (20, 2)}}
    m = from_initial({"A": (0, 0)}, bodies, "AB", [Guide("C", "BCD", through=12 + 0j)])
    motion = m.motion([0.0, 2.0943951023931913, 4.188790204786362], speed=math.pi / 3, acceleration=0.0)
    assert motion.point("C").position[:, 0] == pytest.approx(
        [12.0, 4.137396646368126, 6.665433587260392], abs=1e-12
    )
    assert motion.point("C").velocity[:, 0] == pytest.approx(
        [-math.pi, -1.3566572798942553, 4.494132968880307], abs=1e-12
    )
    assert motion.point("C").acceleration[:, 0] == pytest.approx(
        [-6.168502750680848, 2.8075471059099684, 3.4297322464736126], abs=1e-12
    )
    assert motion.link("BCD").angle == pytest.approx([0, -0.05847328633470475, 0.8170227486069381], abs=1e-12)


def test_pmks_watt_six_bar():
    m = example("watt-six-bar", "watt.toml")
    motion = m.motion(
        [0.0, 0.06981317007977328, -0.06981317007977306], speed=[math.pi / 3, -math.pi / 3, -math.pi / 3]
    )
    names = ("BCD", "DE", "EF", "CFG")
    omega = np.array([motion.link(n).omega for n in names]).T
    alpha = np.array([motion.link(n).alpha for n in names]).T
    assert omega[0] == pytest.approx(
        [-1.7033236397490774, 2.522416751645328, -3.061902045381477, 1.0899216286934674], rel=1e-11
    )
    assert omega[1] == pytest.approx(
        [3.3485252704103035, -4.0559780825264875, 4.257088392320268, -2.1620183634874954], rel=1e-10
    )
    assert omega[2] == pytest.approx(
        [1.32599896573027, -3.2816105528259003, 4.486405564517505, -0.8074992573749454], rel=1e-10
    )
    assert alpha[0] == pytest.approx(
        [-8.934593051317965, 3.1258606391772923, 1.6505485244949112, 6.269419366229072], rel=1e-10
    )
    assert alpha[1] == pytest.approx(
        [-75.20388426843645, 80.66974806015807, -70.94605297808097, 47.56221537542913], rel=1e-9
    )
    e = motion.point("E")
    assert e.acceleration[2] == pytest.approx([-37.06077944561615, -266.3967394213907], rel=1e-9)
    assert [list(g["links"]) for g in Check(m.assembly).groups] == [["BCD", "CFG"], ["DE", "EF"]]


# --- 000: combinations of motion ---------------------------------------------------------------------------
def test_000_1_6_incline_in_components():
    body = on_incline(R(25), 2.0, 3.0, -1.5)
    assert body.velocity == pytest.approx(3 * complex(math.cos(R(25)), math.sin(R(25))))
    assert body.position.imag / body.position.real == pytest.approx(math.tan(R(25)))
    assert on_incline(R(90), 2.0, 3.0).velocity == 3j
    assert math.degrees(sense(body.acceleration)) == pytest.approx(205)


def test_000_1_7_moving_ramp():
    a = on_moving_ramp(R(30), 2 + 0j, 4.0, -1 + 0j, 0.5)
    assert a.velocity == pytest.approx(2 + 4 * complex(math.cos(R(30)), 0.5))
    assert a.acceleration == pytest.approx(-1 + 0.5 * complex(math.cos(R(30)), 0.5))
    assert a.velocity - a.carried_velocity == pytest.approx(a.relative_velocity)


def test_000_1_8_and_1_9_rotation_and_two_points_against_a_mechanism():
    motion = norton(40, 20, 57).motion(R(40), speed=25.0, acceleration=15.0)
    b, c = motion.point("B"), motion.point("C")
    crank = rotation(b.complex(0)[0], 25.0, 15.0)
    assert crank.velocity == pytest.approx(b.complex(1)[0], rel=1e-14)
    assert crank.normal == pytest.approx(-625 * b.complex(0)[0], rel=1e-14)
    assert abs(crank.tangential) == pytest.approx(15 * 40, rel=1e-14)
    arm = c.complex(0)[0] - b.complex(0)[0]
    rod = motion.link("coupler")
    other = second_point(arm, rod.omega[0], rod.alpha[0], b.complex(1)[0], b.complex(2)[0])
    assert other.velocity == pytest.approx(c.complex(1)[0], rel=1e-13)
    assert other.acceleration == pytest.approx(c.complex(2)[0], rel=1e-13)
    assert (np.conj(other.normal) * arm).real < 0


def test_000_1_10_block_on_a_turning_bar():
    block = block_on_bar(2 + 0j, -3.0, 4.0, 1.5, -0.5, carrier_velocity=1 + 1j, carrier_acceleration=2j)
    assert block.coriolis == pytest.approx(2 * -3.0 * 1.5 * 1j)
    assert math.degrees(sense(block.coriolis)) == pytest.approx(270)
    assert block.normal == pytest.approx(-18 + 0j)
    assert block.tangential == pytest.approx(8j)
    assert block.acceleration == pytest.approx(2j + 8j - 18 - 0.5 - 9j)
    assert block.velocity == pytest.approx(1 + 1j + 2 * -3j + 1.5)


def test_000_1_8_to_1_10_take_lists_of_vectors(recwarn):
    assert rotation([2, 1j], 3.0).velocity.tolist() == [6j, -3]
    assert second_point(1, 2.0, 0.0, [1j, 2]).velocity.tolist() == [3j, 2 + 2j]
    assert block_on_bar([1, 1j], 2.0, 0.0, 3.0).velocity.tolist() == [3 + 2j, -2 + 3j]
    # along an arm of no length the block has no direction
    assert np.isnan(block_on_bar(0, 2.0, 0.0, 3.0).velocity)
    assert block_on_bar(0, 2.0, 0.0, 3.0, along=1j).velocity == 3j
    assert not recwarn


@pytest.mark.parametrize("angle", [np.pi / 2, np.array([np.pi / 2, np.pi / 2]), np.empty(0)])
def test_000_1_11_a_rod_that_is_too_short_reaches_nowhere(angle, recwarn):
    """A rod of 0.5 on a crank of 1 at 90°: no warning, and no number."""
    further, nearer = crank_rod_piston(1, 0.5, angle)
    assert np.isnan(further.slide).all()
    assert np.isnan(nearer.slide).all()
    # at 0° it reaches from 0.5 to 1.5
    assert [float(piston.slide) for piston in crank_rod_piston(1, 0.5, 0.0)] == [1.5, 0.5]
    assert not recwarn


@pytest.mark.parametrize("incline", [0.0, 30.0, 90.0, 137.0])
def test_000_1_11_both_solution_sets_on_any_incline(incline):
    through = 0.02 - 0.01j
    found = crank_rod_piston(0.06, 0.18, R(100), 20.0, 5.0, R(incline), through)
    m = Mechanism(
        {"O": (0, 0)},
        {"crank": Link({"O": (0, 0), "A": (0.06, 0)}), "rod": Link({"A": (0, 0), "B": (0.18, 0)})},
        [Guide("B", "rod", through=through, angle=R(incline))],
        inputs=Input(link="crank"),
        guess=Guess(R(100), {"rod": float(found[0].rod_angle)}),
    )
    from virtualwork.motion import Motion

    for piston, assembly in zip(found, m.assemblies(), strict=True):
        motion = Motion(assembly, R(100), 20.0, 5.0)
        b, rod = motion.point("B"), motion.link("rod")
        assert piston.position == pytest.approx(b.complex(0)[0], abs=1e-15)
        assert piston.velocity == pytest.approx(b.complex(1)[0], rel=1e-12)
        assert piston.acceleration == pytest.approx(b.complex(2)[0], rel=1e-10)
        assert piston.rod_omega == pytest.approx(rod.omega[0], rel=1e-12)
        assert piston.rod_alpha == pytest.approx(rod.alpha[0], rel=1e-10)
        # the line's condition with its signs: V_By cos α = V_Bx sin α
        v = piston.velocity
        assert v.imag * math.cos(R(incline)) == pytest.approx(v.real * math.sin(R(incline)), abs=1e-12)
