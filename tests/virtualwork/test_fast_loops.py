"""Loops that go round faster than the input, and loops far smaller than the file: nothing depends on how they are sampled."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
from numpy.typing import NDArray

from virtualwork import DescriptionError, Gear, Guess, Guide, Input, Link, Mechanism
from virtualwork.branch.sampling import common_rate

Reals = NDArray[np.float64]
AT = 0.3


def behind_a_gear(ratio: float, arm: float = 1.0, base: float = 4.0, far: complex | None = None) -> Mechanism:
    """A parallelogram whose crank a pinion drives: its rocker stands as its crank, 1 + ratio·(q − 0.3)."""
    ground = {"G": -2 * base + 0j, "A": 0j, "D": base + 0j} | ({} if far is None else {"F": far})
    links = {
        "pinion": Link({"G": 0j}),
        "crank": Link({"A": 0j, "B": arm + 0j}),
        "coupler": Link({"B": 0j, "C": base + 0j}),
        "rocker": Link({"D": 0j, "C": arm + 0j}),
    }
    guess = Guess(AT, {"crank": 1.0, "coupler": 0.0, "rocker": 1.0})
    return Mechanism(
        ground, links, gears=[Gear(("pinion", "crank"), ratio)], inputs=Input("pinion"), guess=guess
    )


def quick_return(
    offset: float, ratio: float = 1.0, mirror: int = 1, size: float = 1.0, arm: float = 1.0
) -> Mechanism:
    """A Whitworth quick return, its crank 1 and its lever's pivot `offset` beside it, that drives a parallelogram."""
    ground = {"O": 0j, "Q": offset * size + 0j, "D": (offset + 4) * size + 0j, "G": -5j * size}
    links = {
        "pinion": Link({"G": 0j}),
        "crank": Link({"O": 0j, "P": size + 0j}),
        "lever": Link({"Q": 0j, "B": arm * size + 0j}),
        "coupler": Link({"B": 0j, "C": 4 * size + 0j}),
        "rocker": Link({"D": 0j, "C": arm * size + 0j}),
    }
    lever = float(np.angle(np.exp(1j * AT * mirror) - offset))
    return Mechanism(
        ground,
        links,
        [Guide("P", "crank", on="lever", through="Q")],
        [Gear(("pinion", "crank"), ratio * mirror)],
        inputs=Input("pinion"),
        guess=Guess(AT, {"crank": AT * mirror, "lever": lever, "coupler": 0.0, "rocker": lever}),
    )


def lever_of(offset: float, ratio: float, mirror: int, q: Reals) -> Reals:
    """Where the lever of that quick return stands: along the line from its pivot to the crank's pin."""
    return np.angle(np.exp(1j * mirror * (AT + ratio * (q - AT))) - offset)


def apart(a: Reals, b: Reals) -> float:
    return float(np.abs(np.exp(1j * a) - np.exp(1j * b)).max())


# --- change points ----------------------------------------------------------------------------------------------------
def test_a_parallelogram_behind_a_quick_return_passes_its_change_points() -> None:
    m = quick_return(0.85)
    rocker = float(m.motion(math.radians(390)).link("rocker").angle[0])
    with mp.workdps(30):
        true = mp.degrees(mp.arg(mp.expj(mp.radians(390)) - mp.mpf("0.85")))
    assert math.degrees(rocker) % 360 == pytest.approx(float(true), abs=1e-9)
    assert round(float(true), 2) == 88.16
    assert np.degrees(m.check.change_points) == pytest.approx([0, 180], abs=1e-9)


@pytest.mark.parametrize("offset", [0.0, 0.3, 0.85, 0.99, 0.9999, 0.999999, 1.0001, 1.5, -0.85])
@pytest.mark.parametrize("mirror", [1, -1])
def test_quick_returns_however_near_the_pivot_is_to_the_pin(offset: float, mirror: int) -> None:
    m = quick_return(offset, mirror=mirror)
    q = np.linspace(-7.0, 20.0, 301)
    motion = m.motion(q, speed=1.0)
    assert apart(motion.link("rocker").angle, lever_of(offset, 1.0, mirror, q)) < 1e-10
    assert motion.link("rocker").omega == pytest.approx(motion.link("lever").omega, rel=1e-9)


@pytest.mark.parametrize("ratio", [0.5, 5.0, 17.0, -17.0, 29.7, 100.0, 170.5, -360.0, 720.0, 1440.0, 3000.0])
def test_a_parallelogram_behind_a_gear_of_any_ratio(ratio: float) -> None:
    m = behind_a_gear(ratio)
    q = np.random.default_rng(7).uniform(-9.0, 9.0, 400)
    motion = m.motion(q, speed=1.0)
    assert apart(motion.link("rocker").angle, 1 + ratio * (q - AT)) < 1e-12 * max(10.0, abs(ratio))
    assert motion.link("rocker").omega == pytest.approx(np.full(len(q), ratio), rel=1e-9)


def test_all_change_points_of_a_turn_are_named() -> None:
    """Half a turn of the crank apart, as many times as it turns."""
    for ratio in (1.0, 17.0, 300.0):
        at = np.array(behind_a_gear(ratio).check.change_points)
        n = np.arange(2 * ratio)
        expected = np.sort((AT + (np.pi * n - 1) / ratio) % (2 * np.pi))
        assert at == pytest.approx(expected, abs=1e-10)


def test_short_arms_behind_a_long_crank() -> None:
    """A crank of 1 m moves arms of 1 mm: they are together for a few thousandths of a turn."""
    links = {
        "crank": Link({"O": 0j, "B": 1 + 0j}),
        "rod": Link({"B": 0j, "C": 1e-3 + 0j}),
        "rocker": Link({"D": 0j, "C": 1.5e-3 + 0j}),
    }
    # |B − D| = 2·sin(|q − 0.5|/2): the arms reach from half a millimetre to two and a half
    at = 0.5 + 2 * math.asin(1e-3)
    m = Mechanism({"O": 0j, "D": np.exp(0.5j)}, links, inputs=Input("crank"), guess=Guess(at, {"rod": -1.0}))
    ends = [0.5 + s * 2 * math.asin(x / 2) for s in (-1, 1) for x in (5e-4, 2.5e-3)]
    assert m.check.dead_points == pytest.approx(sorted(ends), abs=1e-12)
    assert m.check.input_limits == pytest.approx(ends[2:], abs=1e-12)


@pytest.mark.parametrize("ratio", [17.0, 50.0, -90.0, 100.0])
def test_many_variants_behind_a_gear(ratio: float) -> None:
    base, q = np.linspace(3.5, 4.5, 40), np.array([1.234])
    several = behind_a_gear(ratio).vary({"ground.D.x": base, "links.coupler.C.x": base})
    assert apart(several.motion(q).link("rocker").angle, 1 + ratio * (q - AT)) < 1e-11


@pytest.mark.parametrize("offset", [0.85, 0.999])
def test_many_variants_of_a_quick_return(offset: float) -> None:
    arms, q = np.linspace(0.5, 1.5, 40), np.array([4.5])
    several = quick_return(offset).vary({"links.lever.B.x": arms, "links.rocker.C.x": arms})
    assert apart(several.motion(q).link("rocker").angle, lever_of(offset, 1.0, 1, q)) < 1e-11


def test_what_rates_have_in_common() -> None:
    assert common_rate([17.0, 17.0]) == 17.0
    assert common_rate([0.0, -3.5, 7.0]) == 3.5
    assert common_rate([math.pi, math.e]) is None


# --- a far point ------------------------------------------------------------------------------------------------------
def driven_by_its_slide(
    a: float, b: float, at: float, side: int, far: dict[str, complex], rail: float, size: float
) -> Mechanism:
    """A block on the x-axis, a rod a from it and a lever b at the origin: b² = |C|², a² = |C − x|²."""
    x = (at * at + b * b - a * a) / (2 * at)
    c = complex(x, side * math.sqrt(b * b - x * x))
    return Mechanism(
        {"D": 0j} | {name: z * size for name, z in far.items()},
        {
            "block": Link({"P": 0j}),
            "rod": Link({"P": 0j, "C": a * size + 0j}, 1.0, 0.4 * a * size + 0j),
            "lever": Link({"D": 0j, "C": b * size + 0j}, 2.0, 0.5 * b * size + 0j),
        },
        [Guide("P", "block", "ground", complex(-rail * size), 0.0, 0.0)],
        inputs=Input(slider="P"),
        guess=Guess((at + rail) * size, {"rod": float(np.angle(c - at)), "lever": float(np.angle(c))}),
        gravity=-9.81j,
    )


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("far", [{}, {"F": 1000 + 0j}, {"F": -1000j, "E": 1e7 + 0j}])
def test_a_far_point_that_holds_nothing_changes_nothing(
    far: dict[str, complex], side: int, size: float
) -> None:
    m = driven_by_its_slide(0.3, 0.1, 0.35, side, far, 0.0, size)
    assert np.array(m.check.input_limits) / size == pytest.approx([0.2, 0.4], abs=1e-12)
    q = np.linspace(0.21, 0.39, 37)
    c = m.motion(q * size).point("C").position / size
    x = (q * q + 0.1**2 - 0.3**2) / (2 * q)
    assert c == pytest.approx(np.stack([x, side * np.sqrt(0.1**2 - x * x)], axis=1), abs=1e-12)
    # the weights' heights are shares of C's: they rest where C is above or below D, x² = a² − b²
    rest = [e.inputs[0] / size for e in m.equilibria().found]
    assert [x for x in rest if x > 0] == pytest.approx([math.sqrt(0.08)], abs=1e-9)


@pytest.mark.parametrize("rail", [1e3, -1e5])
def test_a_rail_that_is_measured_from_far_away(rail: float) -> None:
    m = driven_by_its_slide(0.3, 0.1, 0.35, 1, {}, rail, 1.0)
    assert np.array(m.check.input_limits) - rail == pytest.approx([0.2, 0.4], abs=1e-9)
    rest = [e.inputs[0] - rail for e in m.equilibria().found]
    assert [x for x in rest if x > 0] == pytest.approx([math.sqrt(0.08)], abs=1e-7)


def test_a_second_loop_a_kilometre_away() -> None:
    """A parallelogram there, which a gear drives: it folds where the lever is level, in line with the rod's ends or not."""
    near = driven_by_its_slide(0.3, 0.1, 0.35, 1, {}, 0.0, 1.0)
    lever = near.guess.angles["lever"]
    m = Mechanism(
        {"D": 0j, "U": 1000 + 0j, "V": 1000.4 + 0j},
        near.links
        | {
            "c": Link({"U": 0j, "X": 0.1 + 0j}),
            "k": Link({"X": 0j, "Y": 0.4 + 0j}),
            "r": Link({"V": 0j, "Y": 0.1 + 0j}),
        },
        near.guides,
        [Gear(("lever", "c"), 1.0)],
        inputs=near.inputs,
        guess=Guess(near.at, {**near.guess.angles, "c": lever, "k": 0.0, "r": lever}),
    )
    q = np.linspace(0.201, 0.399, 50)
    motion = m.motion(q)
    assert m.check.input_limits == pytest.approx((0.2, 0.4), abs=1e-12)
    assert apart(motion.link("r").angle, motion.link("lever").angle) < 1e-8
    assert m.check.singular == ()


# --- fast gears -------------------------------------------------------------------------------------------------------
def pendulum(ratio: float) -> Mechanism:
    links = {"pinion": Link({"G": 0j}), "bob": Link({"O": 0j}, 2.0, 0.5 + 0j)}
    gears = [Gear(("pinion", "bob"), ratio)]
    return Mechanism(
        {"G": 0j, "O": 1 + 0j},
        links,
        gears=gears,
        inputs=Input("pinion"),
        guess=Guess(AT, {"bob": 1.0}),
        gravity=-9.81j,
    )


@pytest.mark.parametrize("ratio", [1.0, 50.0, -720.0, 1000.0, 1440.0, 17.3])
def test_every_equilibrium_behind_a_gear(ratio: float) -> None:
    """A pendulum rests upright or hanging: twice a turn of its own, over the turns of the input that bring it back."""
    found = pendulum(ratio).equilibria().found
    turns = Fraction(str(ratio)).denominator
    ends = sorted(1 + ratio * (q - AT) for q in (0.0, 2 * np.pi * turns))
    n = np.arange(math.ceil(ends[0] / np.pi - 0.5), math.floor(ends[1] / np.pi - 0.5) + 1)
    angles = np.sort([1 + ratio * (e.inputs[0] - AT) for e in found])
    assert angles == pytest.approx(np.pi * (n + 0.5), abs=1e-14 * max(10.0, 8 * abs(ratio)))
    assert sum(e.stable is True for e in found) == np.sum(n % 2 == 1)


def triple_rocker(ratio: float) -> Mechanism:
    links = {
        "pinion": Link({"G": 0j}),
        "crank": Link({"A": 0j, "B": 2 + 0j}),
        "coupler": Link({"B": 0j, "C": 5 + 0j}),
        "rocker": Link({"D": 0j, "C": 2 + 0j}),
    }
    return Mechanism(
        {"A": 0j, "D": 4 + 0j, "G": -3 + 0j},
        links,
        gears=[Gear(("pinion", "crank"), ratio)],
        inputs=Input("pinion"),
        guess=Guess(0.0, {"crank": math.pi, "coupler": 0.3, "rocker": 2.0}),
    )


@pytest.mark.parametrize("ratio", [1.0, 30.0, -300.0, 720.0, 1440.0])
def test_limits_behind_a_gear(ratio: float) -> None:
    """The arms fold where |B − D| = 5 − 2: cos q = (4 + 16 − 9)/16."""
    half = math.pi - math.acos(11 / 16)
    check = triple_rocker(ratio).check
    assert np.array(check.input_limits) * abs(ratio) == pytest.approx([-half, half], abs=1e-10)
    assert len(check.dead_points) == 2 * abs(ratio)


# --- the period ---------------------------------------------------------------------------------------------------------
def change_point_four_bar(dyad: tuple[complex, float, float, float, float] | None) -> Mechanism:
    """Crank 60, coupler 90, rocker 70, ground 100 mm: folded at 180°, the same pose again after two turns."""
    ground, angles = {"A": 0j, "D": 0.1 + 0j}, {"coupler": -1.45, "rocker": 3.7}
    links = {
        "crank": Link({"A": 0j, "B": 0.06 + 0j}),
        "coupler": Link({"B": 0j, "C": 0.09 + 0j}),
        "rocker": Link({"D": 0j, "C": 0.07 + 0j}),
    }
    if dyad is not None:
        foot, rod, lever, first, second = dyad
        ground["F"] = foot
        links |= {"rod": Link({"C": 0j, "E": rod + 0j}), "lever": Link({"F": 0j, "E": lever + 0j})}
        angles |= {"rod": first, "lever": second}
    return Mechanism(ground, links, inputs=Input("crank"), guess=Guess(math.radians(60), angles))


def joint_c(q: Reals) -> NDArray[np.complex128]:
    """C over two turns: on one side of the way from B to D up to the fold at 180°, on the other up to that at 540°."""
    w = 0.1 - 0.06 * np.exp(1j * q)
    along = (np.abs(w) ** 2 + 0.09**2 - 0.07**2) / (2 * np.abs(w))
    side = np.where((q % (4 * np.pi) > np.pi) & (q % (4 * np.pi) < 3 * np.pi), 1.0, -1.0)
    return 0.1 - w + w / np.abs(w) * (along + 1j * side * np.sqrt(np.maximum(0.09**2 - along**2, 0.0)))


def scanned_dyad(foot: complex, rod: float, lever: float) -> tuple[Mechanism, Reals] | None:
    """The mechanism with a dyad between C and a foot, and its dead points over 720° by a scan and bisection."""

    def stretch(q: Reals) -> Reals:
        d = np.abs(joint_c(q) - foot)
        return np.asarray((rod + lever - d) * (d - abs(rod - lever)))

    here = joint_c(np.array([math.radians(60)]))[0]
    w = foot - here
    along = (abs(w) ** 2 + rod**2 - lever**2) / (2 * abs(w))
    if along**2 >= rod**2:
        return None
    elbow = here + w / abs(w) * (along + 1j * math.sqrt(rod**2 - along**2))
    q = np.linspace(0, 4 * np.pi, 20001)[:-1] + 1e-5
    value = stretch(q)
    i = np.flatnonzero((value >= 0) != (np.roll(value, -1) >= 0))
    low, high = q[i], q[i] + 4 * np.pi / 20000
    for _ in range(60):
        middle = (low + high) / 2
        same = (stretch(middle) >= 0) == (stretch(low) >= 0)
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    angles = float(np.angle(elbow - here)), float(np.angle(elbow - foot))
    return change_point_four_bar((foot, rod, lever, *angles)), np.sort(low % (4 * np.pi))


def check_dyad(foot: complex, rod: float, lever: float) -> bool:
    case = scanned_dyad(foot, rod, lever)
    if case is None:
        return False
    m, dead = case
    assert m.check.dead_points == pytest.approx(dead, abs=1e-8), (foot, rod, lever)
    if len(dead):
        assert m.assembly.reach.turns == 2
    return bool(len(dead))


@pytest.mark.parametrize(
    ("foot", "rod", "lever", "count"),
    [
        (0.021812495732711434 + 0.2175362118938841j, 0.2502804596128137, 0.030739395045939984, 4),
        (-0.1824517474887944 + 0.11074417009704085j, 0.171845667068446, 0.11376530640091803, 4),
        (0.21455211039850308 - 0.21695875163796263j, 0.2571556654953435, 0.04800630236711738, 6),
    ],
)
def test_every_dead_point_of_two_turns(foot: complex, rod: float, lever: float, count: int) -> None:
    """The dyad's own range is shorter than a turn; the other ranges are those of 720° all the same."""
    assert check_dyad(foot, rod, lever)
    case = scanned_dyad(foot, rod, lever)
    assert case is not None
    assert len(case[1]) == count


@pytest.mark.parametrize("on", ["crank", "ground"])
def test_a_link_is_not_driven_against_itself(on: str) -> None:
    def made() -> Mechanism:
        return Mechanism({"O": 0j}, {"crank": Link({"O": 0j, "P": 1 + 0j})}, inputs=Input("crank", on=on))

    if on == "ground":
        assert made().motion(1.0).point("P").position == pytest.approx(np.array([[math.cos(1), math.sin(1)]]))
        return
    with pytest.raises(DescriptionError, match=r"on: link 'crank' cannot turn against itself") as error:
        made()
    assert "\n" not in str(error.value)


# --- campaigns ----------------------------------------------------------------------------------------------------------
def many(seeds: int, one: Callable[[np.random.Generator], None]) -> None:
    for seed in range(seeds):
        try:
            one(np.random.default_rng(seed))
        except Exception as error:
            raise AssertionError(f"seed {seed}: {error}") from error


@pytest.mark.slow
def test_quick_returns_behind_gears_of_all_sizes() -> None:
    def one(rng: np.random.Generator) -> None:
        offset = float(
            rng.choice([rng.uniform(0, 0.95), 1 - 10 ** rng.uniform(-6, -1), rng.uniform(1.05, 3)])
        )
        ratio = float(np.round(10 ** rng.uniform(0, 3), int(rng.integers(0, 3)))) * rng.choice([1, -1])
        mirror, size = int(rng.choice([1, -1])), 10.0 ** int(rng.integers(-6, 7))
        m = quick_return(offset, ratio, mirror, size, rng.uniform(0.2, 3))
        q = rng.uniform(-10, 10, 200)
        lever = lever_of(offset, ratio, mirror, q)
        # the lever turns so many times as fast at most
        steep = abs(ratio) * 10 / min(1.0, abs(1 - offset))
        assert apart(m.motion(q).link("rocker").angle, lever) < 1e-9 + 1e-14 * steep, (
            offset,
            ratio,
            mirror,
            size,
        )

    many(60, one)


@pytest.mark.slow
def test_parallelograms_behind_gears_with_points_anywhere() -> None:
    def one(rng: np.random.Generator) -> None:
        ratio = float(np.round(10 ** rng.uniform(0, 3.5), int(rng.integers(0, 4)))) * rng.choice([1, -1])
        size = 10.0 ** int(rng.integers(-6, 7))
        arm, base = size * rng.uniform(0.1, 2), size * rng.uniform(2.5, 6)
        far = complex(*rng.uniform(-1, 1, 2)) * size * 10 ** rng.uniform(0, 6)
        q = rng.uniform(-7, 7, 200)
        motion = behind_a_gear(ratio, arm, base, far).motion(q)
        assert apart(motion.link("rocker").angle, 1 + ratio * (q - AT)) < 1e-11 * max(10.0, abs(ratio)), (
            ratio,
            size,
        )

    many(60, one)


@pytest.mark.slow
def test_slides_with_points_anywhere() -> None:
    def one(rng: np.random.Generator) -> None:
        a, b = rng.uniform(0.05, 1, 2)
        low, high = abs(a - b), a + b
        at, side = (
            rng.uniform(low + 0.02 * (high - low), high - 0.02 * (high - low)),
            int(rng.choice([1, -1])),
        )
        far = {f"F{i}": complex(*rng.uniform(-1, 1, 2)) * 10 ** rng.uniform(0, 6) for i in range(2)}
        size, rail = 10.0 ** int(rng.integers(-6, 7)), float(rng.choice([0.0, 10 ** rng.uniform(0, 4)]))
        m = driven_by_its_slide(a, b, at, side, far, rail, size)
        found = np.array(m.check.input_limits) / size - rail
        assert found == pytest.approx([low, high], abs=1e-11 * (1 + rail))
        q = rng.uniform(low, high, 50)
        x = (q * q + b * b - a * a) / (2 * q)
        y = side * np.sqrt(np.maximum(b * b - x * x, 0.0))
        c = m.motion((q + rail) * size).point("C").position / size
        assert c == pytest.approx(np.stack([x, y], axis=1), abs=1e-6 * (1 + rail) ** 0.5)
        rest = [e.inputs[0] / size - rail for e in m.equilibria().found]
        # dy_C/dx = 0 where C is above D or, of a shorter rod, above the block
        expected = [math.sqrt(abs(a * a - b * b))]
        assert sorted(v for v in rest if v > 0) == pytest.approx(expected, abs=1e-7 * (1 + rail))

    many(80, one)


@pytest.mark.slow
def test_dead_points_of_dyads_by_a_scan() -> None:
    met = 0
    for seed in range(160):
        rng = np.random.default_rng(seed)
        met += check_dyad(complex(*rng.uniform(-0.25, 0.25, 2)), *rng.uniform(0.03, 0.3, 2))
    assert met > 40
