"""The estimates of rounding errors bound the true ones, against 50 digits, and are not idle."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from importlib.resources import files

import mpmath as mp
import numpy as np
import pytest

from benchmarks.stress import random_linkages
from benchmarks.stress.campaigns import replay
from benchmarks.stress.groups import compare
from benchmarks.truth.constraints import along
from benchmarks.truth.four_bar import circles, two_rates
from benchmarks.truth.mechanism import Exact
from tests.virtualwork.judged import judge
from tests.virtualwork.mechanisms import slider_crank
from virtualwork import (
    Force,
    Friction,
    Guess,
    Guide,
    Input,
    Link,
    Mechanism,
    Motor,
    Spring,
    Torque,
    TorsionSpring,
)
from virtualwork.forces import Forces

EXAMPLES = files("cli") / "examples"


def example(name: str) -> Mechanism:
    folder = EXAMPLES / name
    (path,) = (p for p in folder.iterdir() if p.name.endswith(".toml") and p.name != "example.toml")
    m = Mechanism.from_toml(str(path))
    # the truth takes the numbers as floats, points in polar form as the rounded coordinates that they have
    links = {name: replace(link, polar={}) for name, link in m.links.items()}
    rid = {"friction": (), "motors": (), "decimals": None, "links": links}
    return replace(m, **rid, forces=tuple(f for f in m.forces if not f.history))


def heavy(m: Mechanism) -> Mechanism:
    """The same with masses off the pins, and gravity."""
    links = {
        name: Link(link.points, 1.0 + i, (0.1 + 0.05j) * m.size * (i + 1), 0.1 * m.size**2)
        for i, (name, link) in enumerate(m.links.items())
    }
    return replace(m, links=links, gravity=-9.81j)


@pytest.mark.parametrize(
    "name",
    ["boom", "crank-press", "five-bar", "jansen", "klann", "moving-ramp", "parallelogram", "peaucellier",
     "quick-return", "scissors-lift", "scotch-yoke", "stephenson-six-bar", "toggle-clamp"],
)  # fmt: skip
def test_motion_of_every_kind(name: str) -> None:
    m = example(name)
    rng = np.random.default_rng(7)
    pairs: list[tuple[float, float]] = []
    for _ in range(6):
        q = np.array(
            [
                a + rng.uniform(-1, 1) * (0.1 * m.size if e.is_slide else 0.3)
                for a, e in zip(m.at, m.inputs, strict=True)
            ]
        )
        rates = rng.normal(size=(2, len(q))) * 3
        motion = m.motion(q[0], *rates[:, 0]) if len(q) == 1 else m.motion(q[None], *rates)
        if motion.assembled[0]:
            pairs += compare(motion)
    assert len(pairs) > 10
    judge(pairs)


def pairs_of_forces(m: Mechanism, q: float, *rates: float) -> list[tuple[float, float]]:
    motion = m.motion(q, *rates)
    exact, d = Exact(motion), motion.dynamics
    true, bounds = exact.forces(), d.error_estimate()
    found = []
    with mp.workdps(50):
        for value, bound in ((d.effort, bounds.effort), (d.newton_euler, bounds.newton_euler)):
            found.append((float(abs(true["input", "0", 0] - mp.mpf(float(value[0, 0])))), bound[0, 0]))
        for joint in d.reactions.joints:
            if joint.guide is None:
                body = joint.bodies[1]
                force = mp.mpc(true[joint.key, body, 0], true[joint.key, body, 1])
            else:
                g = m.guides[joint.guide]
                body = g.link
                rail = along(g.angle) * exact.turn(g.on, 0)[0]
                force = mp.mpc(0, 1) * rail * true[joint.key, body, 1]
                if g.is_slider:
                    moment = true[f"moment:{joint.guide}", body, 0]
                    error = abs(moment - mp.mpf(float(d.joint_moment(joint, body)[0])))
                    found.append((float(error), bounds.joint_moment(joint, body)[0]))
            error = abs(force - mp.mpc(complex(d.joint_force(joint, body)[0])))
            found.append((float(error), bounds.joint_force(joint, body)[0]))
    # what is left of the 50 digits is no error
    return [(0.0 if error < 1e-35 else error, float(bound)) for error, bound in found]


@pytest.mark.parametrize(
    "name", ["crank-press", "klann", "quick-return", "stephenson-six-bar", "toggle-clamp"]
)
def test_forces_of_every_kind(name: str) -> None:
    m = heavy(example(name))
    pairs = []
    for k in range(5):
        pairs += pairs_of_forces(m, m.at[0] + 0.05 * k, 3.0, -2.0)
    judge(pairs, 2)


def test_springs_dampers_and_forces_that_turn() -> None:
    m = random_linkages.four_bar(np.random.default_rng(3), 0.8, 1.0)[0]
    m = replace(
        m,
        springs=(Spring((("coupler", 0.3 + 0.2j), ("ground", 1j)), 120.0, 0.4, 3.0),),
        torques=(Torque("rocker", 2.5),),
        forces=(Force("coupler", 0.2j, 4 - 3j, "link"),),
    )
    judge([p for q in (0.8, 0.85, 0.9) for p in pairs_of_forces(m, q, 2.0, 1.0)], 2)


def test_forces_of_a_gear_train() -> None:
    """Heavy geared five-bars: the gears' torques are between the others."""
    found = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        at = float(rng.uniform(-3, 3))
        m = random_linkages.geared_five_bar(rng, at, 1.0)
        if m is not None:
            found += pairs_of_forces(heavy(m), at, 2.0, 1.0)
    judge(found, 2)


def test_a_torsion_spring_and_a_motor_on_a_moving_link() -> None:
    """A pendulum on a pendulum: each torque is known in a line."""
    links = {"first": Link({"O": 0j, "A": 1}), "second": Link({"A": 0j}, mass=2, center=0.5)}
    m = Mechanism(
        ground={"O": 0j},
        links=links,
        inputs=[Input(link="first"), Input(link="second")],
        gravity=-9.81j,
        torsion_springs=[TorsionSpring(("first", "second"), stiffness=3.0, free_angle=0.2)],
        motors=[Motor("first", "second")],
    )
    motion = m.motion([[0.7, 1.1]])
    bound = motion.dynamics.error_estimate().effort[0]
    with mp.workdps(50):
        a, b = mp.mpf(0.7), mp.mpf(1.1)
        weight = 2 * mp.mpf(9.81)
        second = weight * mp.cos(b) / 2 + 3 * (b - a - mp.mpf(0.2))
        first = weight * mp.cos(a) - 3 * (b - a - mp.mpf(0.2)) + second
        euler = motion.dynamics.error_estimate().newton_euler[0]
        for value, true, error, other in zip(motion.effort[0], (first, second), bound, euler, strict=True):
            assert abs(true - mp.mpf(float(value))) <= error <= 1e-13
            assert abs(true - mp.mpf(float(value))) <= other <= 1e-12


def test_what_redundant_statics_determines() -> None:
    """A platform on three parallel cranks: what each carries nobody knows, the torque is W·r·cos q."""
    bars = {f"bar{i}": Link({f"A{i}": 0j, f"B{i}": 0.5}) for i in range(3)}
    top = Link({f"B{i}": complex(i) for i in range(3)}, mass=3, center=0.7 + 0.1j)
    m = Mechanism(
        ground={f"A{i}": complex(i) for i in range(3)},
        links={**bars, "top": top},
        inputs=Input(link="bar0"),
        guess=Guess(at=1.0, angles={"bar1": 1.0, "bar2": 1.0, "top": 0.0}),
        gravity=-9.81j,
    )
    q = np.array([0.4, 1.0, 1.2, 2.7])
    d = m.motion(q).dynamics
    assert d.reactions.redundant
    bounds, pairs = d.error_estimate(), []
    with mp.workdps(40):
        for i, at in enumerate(q):
            true = 3 * mp.mpf(9.81) * mp.cos(mp.mpf(at)) / 2
            for value, bound in ((d.newton_euler, bounds.newton_euler), (d.effort, bounds.effort)):
                pairs.append((float(abs(true - mp.mpf(float(value[i, 0])))), float(bound[i, 0])))
    judge(pairs, 2)


def test_friction_beside_redundant_statics(recwarn: pytest.WarningsRecorder) -> None:
    """A block that a platform on three cranks pushes along a rough guide: both ways to the torque, each within its estimate."""
    q = np.array([0.4, 1.0, 1.2, 2.5])

    def dynamics(*friction: Friction) -> Forces:
        bars = {f"bar{i}": Link({f"A{i}": 0j, f"B{i}": 0.5}) for i in range(3)}
        top = Link({f"B{i}": complex(i) for i in range(3)}, mass=3, center=0.7 + 0.1j)
        rod, block = Link({"B0": 0j, "S": 2.0}, 1.0, 1.0, 0.3), Link({"S": 0j}, 2.0, 0j, 0.1)
        m = Mechanism(
            ground={f"A{i}": complex(i) for i in range(3)},
            links={**bars, "top": top, "rod": rod, "block": block},
            guides=[Guide("S", "block", through=-0.3j, angle=0.0, turned=0.0)],
            inputs=Input(link="bar0"),
            guess=Guess(at=1.0, angles={"bar1": 1.0, "bar2": 1.0, "top": 0.0, "rod": -0.4, "block": 0.0}),
            gravity=-9.81j,
            friction=friction,
        )
        return m.motion(q, 2.0, 0.0).dynamics

    d = dynamics(Friction("S", 0.2))
    assert d.reactions.redundant
    bounds = d.error_estimate()
    apart = np.abs(d.effort - d.newton_euler)
    assert (apart <= bounds.effort + bounds.newton_euler).all()
    assert (bounds.newton_euler < 1e-12).all()
    for joint in d.reactions.joints:
        for body in joint.bodies:
            known = np.isfinite(d.joint_force(joint, body))
            assert (bounds.joint_force(joint, body)[known] < 1e-12).all()
            assert (bounds.joint_moment(joint, body) < 1e-12).all()
    # the force along the guide is the friction, to its own estimate
    joint = next(joint for joint in d.reactions.joints if joint.guide is not None)
    force = d.joint_force(joint, "block")
    rough = np.abs(np.abs(force.real) - 0.2 * np.abs(force.imag))
    assert (rough <= 2 * bounds.joint_force(joint, "block")).all()
    # a pin whose force no statics determines rubs with a torque that nothing determines
    d = dynamics(Friction("B1", 0.1, 0.02))
    bounds = d.error_estimate()
    for value, bound in ((d.effort, bounds.effort), (d.newton_euler, bounds.newton_euler)):
        assert np.isnan(value).all()
        assert np.isnan(bound).all()
    joint = next(joint for joint in d.reactions.joints if joint.name == "B1")
    assert np.isnan(bounds.joint_moment(joint, "top")).all()
    assert not recwarn.list


@pytest.mark.slow
def test_a_chain_of_a_hundred_links() -> None:
    """Four-bars in a row, each rocker the next one's crank: dyad by dyad in 50 digits."""
    bars, length = 50, 1 + 2**-6
    ground, links, angles = {"A": 0j}, {"crank": Link({"A": 0j, "B": 0.75})}, {}
    with mp.workdps(50):
        pin = 0.75 * mp.expj(mp.mpf(0.7))
        v, w = mp.mpc(0, 3) * pin, mp.mpc(0, 1) * pin - 9 * pin
        rates, before = [], "B"
        for i in range(bars):
            foot = 1.0 * (i + 1)
            p = circles(pin, mp.mpf(length), mp.mpc(foot), mp.mpf(0.75), 1)[0] - pin
            length = 2 - length
            q = pin + p - foot
            w3, w4 = two_rates(p, q, -v)
            _, a4 = two_rates(p, q, -w + w3**2 * p - w4**2 * q)
            rates.append((mp.arg(q), w4, a4))
            pin, v, w = foot + q, mp.mpc(0, w4) * q, mp.mpc(0, a4) * q - w4**2 * q
            ground[f"D{i}"] = foot + 0j
            links[f"coupler{i}"] = Link({before: 0j, f"C{i}": 2 - length})
            links[f"rocker{i}"] = Link({f"D{i}": 0j, f"C{i}": 0.75})
            angles[f"coupler{i}"], angles[f"rocker{i}"] = float(mp.arg(p)), float(mp.arg(q))
            before = f"C{i}"
        m = Mechanism(ground, links, inputs=Input(link="crank"), guess=Guess(at=0.7, angles=angles))
        motion = m.motion(0.7, 3.0, 1.0)
        pairs = []
        for i in range(0, bars, 7):
            link = motion.link(f"rocker{i}")
            for order, value in enumerate((link.angle, link.omega, link.alpha)):
                error = abs(rates[i][order] - mp.mpf(float(value[0])))
                pairs.append((float(error), float(link.error_estimate(order)[0])))
    judge(pairs, 2)


def test_a_sweep_has_the_estimates_of_its_poses() -> None:
    m = heavy(example("quick-return"))
    q = np.linspace(0, 6, 13)
    whole = m.motion(q, 2.0, 0.5)
    link, point = "ram", m.size * 0.2j
    name = link if link in m.links else list(m.links)[-1]
    for i in (0, 5, 12):
        alone = m.motion(q[i], 2.0, 0.5)
        for order in range(4):
            for a, b in (
                (whole.at(name, point), alone.at(name, point)),
                (whole.link(name), alone.link(name)),
            ):
                assert a.error_estimate(order)[i] == pytest.approx(b.error_estimate(order)[0], rel=0.9)
        forces = (motion.dynamics.error_estimate() for motion in (whole, alone))
        one, other = (f.newton_euler for f in forces)
        assert one[i, 0] == pytest.approx(other[0, 0], rel=0.9)


def test_no_estimate_for_a_pose_that_is_not_assembled() -> None:
    m = random_linkages.four_bar(np.random.default_rng(5), 1e-3, 1.0, limit=True)[0]
    limit = m.assembly.reach.limits()[0]
    outside = m.motion(limit.input - 0.01 * limit.side)
    assert not outside.assembled[0]
    assert np.isnan(outside.link("rocker").error_estimate()[0])


@pytest.mark.parametrize("speed", [2.0, -2.0])
def test_friction_of_a_guide_in_closed_form(speed: float) -> None:
    """A rod without mass at φ to the guide: S cos φ = P + μN and N = S sin φ, so that τ = P r sin(θ + φ)/(cos φ − μ sin φ)."""
    m = slider_crank(forces=[Force("piston", 0j, 50 + 0j)], friction=[Friction("B", 0.3)])
    q, pairs = np.array([0.4, 0.9, 1.6, 2.3, 2.9]), []
    forces = m.motion(q, speed).dynamics
    errors = forces.error_estimate()
    with mp.workdps(40):
        for i, at in enumerate(q):
            turn = mp.asin(mp.mpf(0.1) * mp.sin(mp.mpf(at)) / mp.mpf(0.3))
            # the piston goes against its load as the crank turns forwards
            way = -1 if speed > 0 else 1
            rod = 50 / (mp.cos(turn) + way * mp.mpf(0.3) * mp.sin(turn))
            true = rod * mp.mpf(0.1) * mp.sin(mp.mpf(at) + turn)
            for value, error in ((forces.effort, errors.effort), (forces.newton_euler, errors.newton_euler)):
                pairs.append((float(abs(true - mp.mpf(float(value[i, 0])))), float(error[i, 0])))
    judge(pairs)


def test_a_group_that_cannot_be_assembled_leaves_those_before_it_their_estimates() -> None:
    """A four-bar that drives another one, which ends first."""
    m = Mechanism(
        ground={"A": 0j, "D": 1 + 0j, "E": 2.5 + 0j},
        links={
            "crank": Link({"A": 0j, "B": 0.25}),
            "coupler": Link({"B": 0j, "C": 1.0}),
            "rocker": Link({"D": 0j, "C": 0.75}),
            "second": Link({"C": 0j, "F": 1.0}),
            "last": Link({"E": 0j, "F": 0.8}),
        },
        inputs=Input(link="crank"),
        guess=Guess(at=0.7, angles={"coupler": 0.3, "rocker": 1.2, "second": 0.0, "last": 2.0}),
    )
    motion = m.motion(np.linspace(0, 6, 40), 1.0)
    lost = ~motion.assembled
    assert lost.any()
    assert not lost.all()
    for order in range(3):
        assert (motion.link("rocker").error_estimate(order) < 1e-11).all()
        assert (np.isnan(motion.link("last").error_estimate(order)) == lost).all()


def test_an_input_that_is_not_exact_counts() -> None:
    m = random_linkages.four_bar(np.random.default_rng(3), 0.8, 1.0)[0]
    motion = m.motion(0.8)
    motion.input_error = 1e-9
    moved = m.motion(0.8 + 1e-9).link("rocker").angle - m.motion(0.8).link("rocker").angle
    assert abs(moved[0]) <= motion.link("rocker").error_estimate()[0] <= 30 * abs(moved[0])
    slide = example("scissors-lift")
    moves = slide.motion(slide.at[0])
    moves.input_error = 1e-9
    assert moves.slide(slide.inputs[0].name).error_estimate()[0] == pytest.approx(1e-9, rel=0.02)
    assert moves.link(next(iter(slide.links))).error_estimate()[0] > 1e-10


def test_nothing_is_loaded_for_estimates_unless_asked() -> None:
    program = (
        "import sys; from virtualwork import Mechanism; "
        f"m = Mechanism.from_toml({str(EXAMPLES / 'klann' / 'klann.toml')!r}); "
        "motion = m.motion([0.1, 0.2], 1.0); motion.dynamics.effort; motion.point('H').jerk; "
        "print([name for name in sys.modules if 'rounding' in name or 'bounds' in name])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("campaign", "seed"),
    [
        # positions within rounding of a limit: what the second order makes of them
        ("near dead points", 2321),
        ("near dead points", 3412),
        # an avoided crossing next to a change point: the weakest direction's own curvature counts
        ("near change points", 256),
        ("near change points", 204),
        ("near change points", 3482),
        ("near change points", 1856),
        ("near change points", 1358),
        # a parallelogram but for rounding, which a series carries through what it takes for a change point
        ("near change points", 5),
        # links that stand still: what follows from constants alone is rounded too
        ("any topology", 7),
        ("any topology", 9),
        # a triad 5e-11 from its limit: rates that the Jacobian gives, where nothing can be bridged
        ("near-singular triads", 117),
        # forces so near a dead point that no digit is known: infinite, not NaN
        ("forces near dead points", 34),
        # a gear whose constant is a difference of larger angles
        ("geared five-bars", 1255),
        ("geared five-bars", 1604),
        ("geared five-bars", 1768),
        ("forces near dead points", 53),
        # a swept e^{iθ} is a product of three factors
        ("long sweeps", 200051),
    ],
)
def test_worst_cases_of_campaigns(campaign: str, seed: int) -> None:
    pairs = replay(campaign, seed)
    assert pairs
    assert all(error <= bound for error, bound in pairs)


def test_poses_without_assembly_have_no_estimate_and_raise_no_warning() -> None:
    m = example("watt-six-bar")
    motion = m.motion(np.linspace(0.0, 2 * math.pi, 400), speed=1.0)
    assert 0 < motion.assembled.sum() < 400
    for name in m.links:
        link = motion.link(name)
        for order, value in enumerate((link.angle, link.omega)):
            assert (np.isnan(link.error_estimate(order)) == np.isnan(value)).all()


def test_turns_backwards_are_settled_as_those_forwards() -> None:
    """A crank-rocker far back of its guess: one turn says it all, whichever way."""
    m = example("two-disc-four-bar")
    back = m.motion(m.at[0] - 2 * math.pi * 3000)
    assert back.assembled[0]
    assert m.assembly.track.settled
