"""Groups whose arms an input bends or stretches, wheels on moving links, inputs that move only a part."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from dalembert.arithmetic.varied import direction
from virtualwork import Gear, Guess, Guide, Input, Link, Mechanism

QUARTER = math.pi / 2


def test_a_joint_that_is_driven_closes_its_loop() -> None:
    """A motor holds the angle between crank and coupler: with it AC, and the triangle ACD, by the law of cosines."""
    m = Mechanism(
        {"A": (0, 0), "D": (10, 0)},
        {"crank": Link({"A": (0, 0), "B": (4, 0)}), "coupler": Link({"B": (0, 0), "C": (12, 0)}),
         "rocker": Link({"D": (0, 0), "C": (8, 0)})},
        inputs=Input(link="coupler", on="crank"),
        guess=Guess(-0.7, {"crank": 1.0, "coupler": 0.3, "rocker": 1.0}),
    )  # fmt: skip
    for bent in (-0.7, -1.0):
        arm = 4 + 12 * cmath.exp(1j * bent)  # from A to C in the crank's axes
        reach = abs(arm)
        above = math.acos((reach**2 + 100 - 64) / (20 * reach))  # of AC over the ground
        crank = above - cmath.phase(arm)
        motion = m.motion(bent)
        assert motion.link("crank").angle[0] == pytest.approx(crank, abs=1e-14)
        assert motion.point("C").complex(0)[0] == pytest.approx(reach * cmath.exp(1j * above), rel=1e-14)


@pytest.mark.parametrize("order", [("boom", "cylinder", "rod"), ("rod", "cylinder", "boom")])
def test_a_cylinder_that_stands_askew_on_its_links(order: tuple[str, ...]) -> None:
    """Slope and turn of a sliding pair: the triangle APB by its three sides, whichever link is named first."""
    slope, turned = 0.4, -0.7
    links = {
        "boom": Link({"A": (0, 0), "B": (2, 0)}),
        "cylinder": Link({"P": (0, 0)}),
        "rod": Link({"R": (0, 0), "B": (1, 0.3)}),
    }
    m = Mechanism(
        {"A": (0, 0), "P": (1, -0.5)},
        {name: links[name] for name in order},
        [Guide("R", "rod", "cylinder", "P", slope, turned)],
        inputs=Input(slider="R"),
        guess=Guess(0.6, {"boom": 0.5}),
    )
    for stroke in (0.6, 0.8):
        # from P to B in the cylinder's axes: along the line, then the rod's own vector, turned with it
        arm = stroke * cmath.exp(1j * slope) + (1 + 0.3j) * cmath.exp(1j * (slope + turned))
        base = 1 - 0.5j
        between = math.acos((4 + abs(base) ** 2 - abs(arm) ** 2) / (4 * abs(base)))
        motion = m.motion(stroke)
        boom = motion.link("boom").angle[0]
        assert boom == pytest.approx(cmath.phase(base) + between, abs=1e-14)
        cylinder = cmath.phase((2 * cmath.exp(1j * boom) - base) / arm)
        assert motion.link("cylinder").angle[0] == pytest.approx(cylinder, abs=1e-14)
        assert motion.link("rod").angle[0] == pytest.approx(cylinder + slope + turned, abs=1e-14)


def test_an_oldham_coupling() -> None:
    """Two slides on turning discs: the block's centre runs twice round the circle over the shafts' offset (Shigley)."""
    offset = 0.3
    m = Mechanism(
        {"O": (0, 0), "Q": (offset, 0)},
        {"first": Link({"O": (0, 0)}), "block": Link({"M": (0, 0), "N": (0, 0)}), "last": Link({"Q": (0, 0)})},
        [Guide("M", "block", "first", "O", 0.2, 0.5), Guide("N", "block", "last", "Q", 0.0, 0.5 + QUARTER)],
        inputs=Input(link="first"),
        guess=Guess(0.3),
    )  # fmt: skip
    q = np.array([0.3, 1.0, 2.0, 4.0, 6.0])
    motion = m.motion(q, speed=2.0, acceleration=0.0)
    line = q + 0.2  # of the first disc's guide; the last disc's stands across it
    assert motion.point("M").complex(0) == pytest.approx(offset * np.cos(line) * np.exp(1j * line), abs=1e-15)
    assert motion.point("N").complex(0) == pytest.approx(motion.point("M").complex(0), abs=1e-15)
    assert np.exp(1j * motion.link("block").angle) == pytest.approx(np.exp(1j * (line + 0.5)), abs=1e-15)
    assert np.exp(1j * motion.link("last").angle) == pytest.approx(np.exp(1j * (line - QUARTER)), abs=1e-15)
    assert motion.slide("M").position == pytest.approx(offset * np.cos(line), abs=1e-15)
    assert motion.slide("M").speed == pytest.approx(-2 * offset * np.sin(line), abs=1e-14)
    # e (1 + exp(2iθ))/2: a circle of half the offset, run through at twice the speed
    spoke = offset / 2 * np.exp(2j * line)
    assert motion.point("M").complex(1) == pytest.approx(4j * spoke, abs=1e-14)
    assert motion.point("M").complex(2) == pytest.approx(-16 * spoke, abs=1e-14)


@pytest.mark.parametrize("order", [("crank", "block", "lever"), ("lever", "block", "crank")])
def test_a_lever_with_a_sleeve_askew(order: tuple[str, ...]) -> None:
    """An inverted slider-crank, its sleeve's line sloping in the lever and its block turned on it."""
    slope, turned, off = 0.4, -0.7, 0.25j
    links = {
        "crank": Link({"O": (0, 0), "B": (1, 0)}),
        "block": Link({"B": (0, 0)}),
        "lever": Link({"Q": (0, 0)}),
    }
    m = Mechanism(
        {"O": (0, 0), "Q": (3, 0)},
        {name: links[name] for name in order},
        [Guide("B", "block", "lever", off, slope, turned)],
        inputs=Input(link="crank"),
        guess=Guess(1.0, {"lever": 2.3}),
    )
    q = np.array([0.5, 1.0, 2.0, 4.0])
    motion = m.motion(q)
    # QB in the lever's axes is off + s·exp(i slope): the foot of the perpendicular from Q is fixed
    rail = cmath.exp(1j * slope)
    along, foot = (off / rail).real, (off / rail).imag
    bar = np.exp(1j * q) - 3
    slide = np.sqrt(np.abs(bar) ** 2 - foot**2) - along
    assert motion.slide("B").position == pytest.approx(slide, rel=1e-14)
    lever = bar / (off + slide * rail)
    assert np.exp(1j * motion.link("lever").angle) == pytest.approx(lever, abs=1e-14)
    assert np.exp(1j * motion.link("block").angle) == pytest.approx(
        lever * cmath.exp(1j * (slope + turned)), abs=1e-14
    )


@pytest.mark.parametrize("ratio", [1.0, -1.0, 2.0, -2.0, 3.0, -0.5, 1.3])
def test_a_wheel_on_a_rocker_turns_by_its_ratio(ratio: float) -> None:
    m = Mechanism(
        {"A": (0, 0), "D": (4, 0)},
        {"crank": Link({"A": (0, 0), "B": (1, 0)}), "coupler": Link({"B": (0, 0), "C": (4, 0)}),
         "rocker": Link({"D": (0, 0), "C": (2, 0)}), "wheel": Link({"D": (0, 0), "M": (1, 0)})},
        gears=[Gear(("rocker", "wheel"), ratio)],
        inputs=Input(link="crank"),
        guess=Guess(0.5, {"coupler": 0.4, "rocker": 1.5, "wheel": 0.1}),
    )  # fmt: skip
    q = np.array([0.5, 1.0, 2.0, 3.0, 4.0])
    motion = m.motion(q, speed=1.0)
    rocker = motion.link("rocker").angle
    # at the guess's pose, the first, the wheel stands at its own guess of 0.1
    mark = motion.point("M").complex(0) - 4
    assert mark == pytest.approx(np.exp(1j * (0.1 + ratio * (rocker - rocker[0]))), abs=2e-14)
    assert motion.link("wheel").omega == pytest.approx(ratio * motion.link("rocker").omega, rel=1e-14)


def test_an_input_moves_only_its_own_loop() -> None:
    """Two four-bars on one ground, each with its input: the other's coefficients are zero, not small."""
    links, guess = {}, {}
    for side in "lr":
        links |= {
            f"{side}crank": Link({f"A{side}": (0, 0), f"B{side}": (1, 0)}),
            f"{side}coupler": Link({f"B{side}": (0, 0), f"C{side}": (4, 0)}),
            f"{side}rocker": Link({f"D{side}": (0, 0), f"C{side}": (2, 0)}),
        }
        guess |= {f"{side}coupler": 0.4, f"{side}rocker": 1.5}
    m = Mechanism(
        {"Al": 0j, "Dl": 4, "Ar": 20, "Dr": 24},
        links,
        inputs=[Input(link="lcrank"), Input(link="rcrank")],
        guess=Guess((0.5, 0.5), guess),
    )
    motion = m.motion(np.array([[0.5, 0.7], [1.0, 1.4]]), speed=[1.0, 0.0])
    for here, there, j in (("l", "r", 0), ("r", "l", 1)):
        assert np.abs(motion.point(f"C{here}").coefficient(j)).min() > 0.1
        for point in (f"B{there}", f"C{there}"):
            assert np.array_equal(np.zeros(2), np.abs(motion.point(point).coefficient(j)) * np.ones(2))
    assert np.array_equal(motion.point("Cr").complex(1), [0, 0])


def test_a_wheel_on_a_block_that_turns_with_its_disc() -> None:
    """The block's angle is the disc's and a constant: the wheel's phase is found at the guess, constant included."""
    m = Mechanism(
        {"O": 0j},
        {"disc": Link({"O": 0j}), "block": Link({"M": 0j}), "wheel": Link({"M": 0j, "K": 1})},
        [Guide("M", "block", "disc", "O", 0.2, 0.5)],
        [Gear(("block", "wheel"), 3.0)],
        inputs=[Input(link="disc"), Input(slider="M")],
        guess=Guess((0.3, 1.0), {"wheel": 0.1}),
    )
    motion = m.motion(np.array([[0.3, 1.0], [0.9, 1.4]]))
    assert motion.link("block").angle == pytest.approx([1.0, 1.6], rel=1e-15)
    assert motion.link("wheel").angle == pytest.approx([0.1, 1.9], rel=1e-14)
    spoke = motion.point("K").complex(0) - motion.point("M").complex(0)
    assert spoke == pytest.approx(np.exp([0.1j, 1.9j]), rel=1e-14)


def test_a_step_reads_what_it_does_not_make_itself() -> None:
    m = Mechanism(
        {"A": 0j, "D": 4},
        {
            "crank": Link({"A": 0j, "B": 1}),
            "coupler": Link({"B": 0j, "C": 4}),
            "rocker": Link({"D": 0j, "C": 2}),
        },
        inputs=Input(link="crank"),
        guess=Guess(0.5, {"coupler": 0.4, "rocker": 1.5}),
    )
    plan = m.assembly.plan
    (group,) = plan.groups
    assert set(plan.writes(group)) == {"angle:coupler", "angle:rocker"}
    assert {name for name in plan.reads(group) if name.startswith("angle")} <= {"angle:crank"}
    assert "point:D" in plan.reads(group)
    assert [s for s in plan.needed(["point:B"]) if s is group] == []
    assert [s for s in plan.needed(["point:C"]) if s is group] == [group]


@pytest.mark.parametrize("order", [("crank", "plate"), ("plate", "crank")])
def test_a_plate_that_carries_the_rail(order: tuple[str, ...]) -> None:
    """The pin stands on the crank and the rail slides past it: the plate's origin is B − (through + s·e^{iα})·e^{iθ}."""
    slope, turned, through = 0.3, 0.4, 0.2j
    links = {"crank": Link({"O": 0j, "A": 0.5j, "B": 1}), "plate": Link({"K": 0.5 + 0.1j})}
    m = Mechanism(
        {"O": 0j},
        {name: links[name] for name in order} | {"rod": Link({"A": 0j, "S": 2})},
        [Guide("S", "rod"), Guide("B", "crank", "plate", through, slope, turned)],  # a slider-crank beside it
        inputs=[Input(link="crank"), Input(slider="B")],
        guess=Guess((0.5, 0.3), {"rod": -0.2}),
    )
    q, s = np.array([0.5, 1.2]), np.array([0.3, -0.4])
    motion = m.motion(np.stack([q, s], axis=1), speed=[2.0, 3.0])
    turn = np.exp(1j * (q - slope - turned))
    place = np.exp(1j * q) - (through + s * cmath.exp(1j * slope)) * turn
    assert motion.point("K").complex(0) == pytest.approx(place + (0.5 + 0.1j) * turn, abs=1e-15)
    a = 0.5j * np.exp(1j * q)
    assert motion.slide("S").position == pytest.approx(a.real + np.sqrt(4 - a.imag**2), rel=1e-15)
    rate = 2j * (motion.point("K").complex(0)) - 3 * cmath.exp(1j * slope) * turn
    assert motion.point("K").complex(1) == pytest.approx(rate, abs=1e-14)


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("order", [("sun", "planet", "ring", "arm"), ("arm", "ring", "planet", "sun")])
def test_a_differential(flip: bool, order: tuple[str, ...]) -> None:
    """Sun of 20 and ring of 60 teeth both driven: ω_arm = (20 ω_s + 60 ω_r)/80 (Willis), the planet of 20 between them."""
    links = {
        "sun": Link({"O": 0j}),
        "planet": Link({"P": 0j}),
        "ring": Link({"O": 0j}),
        "arm": Link({"O": 0j, "P": 2}),
    }
    gears = [Gear(("sun", "planet"), -1.0, "arm"), Gear(("planet", "ring"), 20 / 60, "arm")]
    m = Mechanism(
        {"O": 0j},
        {name: links[name] for name in order},
        gears=gears[::-1] if flip else gears,
        inputs=[Input(link="sun"), Input(link="ring")],
        guess=Guess((0.1, 0.2), {"arm": 0.4, "planet": 0.7}),
    )
    motion = m.motion(np.array([[0.1, 0.2], [1.3, 0.5]]), speed=[4.0, 1.0])
    arm = (20 * 4 + 60 * 1) / 80
    assert motion.link("arm").omega == pytest.approx([arm, arm], rel=1e-14)
    assert motion.link("planet").omega == pytest.approx([2 * arm - 4.0] * 2, rel=1e-14)
    turned = (20 * 1.2 + 60 * 0.3) / 80
    assert motion.link("arm").angle == pytest.approx([0.4, 0.4 + turned], rel=1e-13)
    assert motion.link("planet").angle == pytest.approx([0.7, 0.7 + 2 * turned - 1.2], rel=1e-13)


@pytest.mark.parametrize("apart", [0.0, 0.6])
def test_cranks_on_one_belt(apart: float) -> None:
    """A five-bar whose outer links a belt holds at one angle, driven at a coupler: a triangle, as both outer links turn."""
    up, down, left, right, base = 3.0, 2.2, 2.0, 1.0, 4.0
    m = Mechanism(
        {"A": 0j, "E": base},
        {
            "up": Link({"B": 0j, "C": up}),
            "left": Link({"A": 0j, "B": left}),
            "right": Link({"E": 0j, "D": right}),
            "down": Link({"D": 0j, "C": down}),
        },
        gears=[Gear(("left", "right"), 1.0)],
        inputs=Input(link="up"),
        guess=Guess(0.3, {"left": 1.2, "right": 1.2 + apart, "down": 1.9}),
    )
    motion = m.motion(np.array([0.3, 0.35]))
    assert motion.assembled.all()
    # down·e^{iψ} = up·e^{iφ} − base + (left − right·e^{ic})·e^{iθ}
    for i, phi in enumerate((0.3, 0.35)):
        known, arm = up * cmath.exp(1j * phi) - base, left - right * cmath.exp(1j * apart)
        opening = math.acos((down**2 - abs(known) ** 2 - abs(arm) ** 2) / (2 * abs(known) * abs(arm)))
        both = [cmath.exp(1j * (cmath.phase(known) - cmath.phase(arm) + side * opening)) for side in (1, -1)]
        theta = cmath.exp(1j * motion.link("left").angle[i])
        assert min(abs(theta - e) for e in both) < 1e-13
        right_turn = cmath.exp(1j * motion.link("right").angle[i])
        assert right_turn == pytest.approx(theta * cmath.exp(1j * apart), abs=1e-13)
        assert abs(motion.point("C").complex(0)[i] - motion.point("D").complex(0)[i]) == pytest.approx(
            down, rel=1e-13
        )


def test_rails_at_quarter_turns_are_exact() -> None:
    turns = [direction(k * math.pi / 2) for k in range(-4, 5)]
    assert turns == [1, 1j, -1, -1j, 1, 1j, -1, -1j, 1]
    assert direction(1.0) == cmath.exp(1j)
