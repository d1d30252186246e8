"""Random mechanisms with racks and belts, against 50 digits."""

from __future__ import annotations

import math
from importlib.resources import files

import numpy as np
import pytest

from benchmarks.stress.topologies import generate, regularity
from benchmarks.truth.mechanism import Exact
from virtualwork import Belt, Guess, Guide, Input, Link, Mechanism, Rack
from virtualwork.study.free_bodies import free_bodies


def thrown(rng: np.random.Generator) -> Mechanism:
    """A mechanism with a rack: in front of a loop, behind one, on an arm that swings, or between two wheels."""
    kind = int(rng.integers(4))
    x = rng.uniform(0.6, 1.4, 12)
    radius = float(rng.choice([-1, 1]) * rng.uniform(0.02, 0.2))
    loaded = {
        "gravity": complex(*rng.normal(size=2)),
        "inputs": Input("crank", speed=float(rng.normal()), acceleration=float(rng.normal())),
    }

    def body(points: dict[str, complex]) -> Link:
        return Link(points, float(rng.uniform(0, 2)), complex(*rng.normal(size=2)), float(rng.uniform(0, 1)))

    crank = body({"O": 0j, "A": 0.1 * x[0]})
    if kind == 0:
        # crank, rod and rack; a wheel that it turns, and another one by a belt
        links = {
            "crank": crank,
            "rod": body({"A": 0j, "B": 0.4 * x[1]}),
            "rack": body({"B": 0j}),
            "wheel": body({"P": 0j}),
            "fan": body({"F": 0j}),
        }
        return Mechanism(
            {"O": 0j, "P": 0.5 + 0.1j * x[2], "F": 1 + 0.4j},
            links,
            guides=[Guide("B", "rack", through=0.02j * x[3], angle=0.2 * x[4], turned=float(x[5]))],
            racks=[Rack("wheel", "B", radius)],
            belts=[Belt(("wheel", "fan"), (0.1 * x[6], 0.2 * x[7]), bool(rng.integers(2)))],
            guess=Guess(0.3, {"rod": 0.0, "wheel": float(x[8]), "fan": float(x[9])}),
            **loaded,
        )
    if kind == 1:
        # the crank's rod runs as a rack in an arm about the axis of the wheel
        links = {
            "crank": crank,
            "arm": body({"P": 0j}),
            "rod": body({"A": 0j}),
            "wheel": body({"P": 0j}),
        }
        return Mechanism(
            {"O": 0j, "P": 0.4 * x[1]},
            links,
            guides=[Guide("A", "rod", "arm", through=1j * radius, angle=float(x[2]), turned=float(x[3]))],
            racks=[Rack("wheel", "A", -radius)],
            guess=Guess(0.3, {"arm": math.pi - float(x[2]), "wheel": 0.3}, {"A": 0.1 * x[0] * np.exp(0.3j)}),
            **loaded,
        )
    if kind == 2:
        # a rocker turns a wheel on its own axis that moves a rack, which pushes a rod and a lever
        links = {
            "crank": crank,
            "rack": body({"R": 0j, "S": 0.05 + 0.02j}),
            "rod": body({"S": 0j, "T": 0.4 * x[1]}),
            "lever": body({"L": 0j, "T": 0.3 * x[2]}),
        }
        return Mechanism(
            {"O": 0j, "L": 0.4 + 0.3j},
            links,
            guides=[Guide("R", "rack", through=-1j * radius, turned=0.0)],
            racks=[Rack("crank", "R", radius)],
            guess=Guess(0.3, {"rod": 0.6, "lever": 2.0}, {"R": -1j * radius}),
            **loaded,
        )
    # a wheel that a rod rolls on the ground's rack moves another one on its top
    links = {
        "crank": crank,
        "rod": body({"A": 0j, "C": 0.4 * x[1]}),
        "wheel": body({"C": 0j}),
        "top": body({"T": 0j}),
    }
    return Mechanism(
        {"O": 0j},
        links,
        guides=[Guide("C", "wheel", through=0.03j * x[2]), Guide("T", "top", through=0.3j, turned=0.0)],
        racks=[Rack("wheel", "C", radius), Rack("wheel", "T", 2 * radius)],
        guess=Guess(0.3, {"rod": 0.0, "wheel": float(x[3])}),
        **loaded,
    )


def agrees(seed: int) -> bool:
    """Whether a random mechanism agrees with 50 digits; False where it is nearly singular."""
    rng = np.random.default_rng([77, seed])
    m = thrown(rng)
    motion = m.motion(np.array([0.3 + float(rng.uniform(-0.5, 0.5))]))
    if not motion.assembled[0] or not motion.condition[0] < 50:
        return False
    exact = Exact(motion)
    assert exact.closed
    for name in m.links:
        link = motion.link(name)
        for order, value in enumerate((link.angle, link.omega, link.alpha)):
            apart = float(exact.angle(name, order)) - value[0]
            apart = float(np.angle(np.exp(1j * apart))) if order == 0 else apart
            assert abs(apart) < 1e-11 * (1 + abs(value[0])), (name, order)
    true = exact.forces()
    size = max(float(abs(v)) for v in [*exact.generalized_loads(), *true.values()])
    wanted = float(true["input", "0", 0])
    assert abs(motion.dynamics.effort[0, 0] - wanted) < 1e-11 * size
    assert abs(motion.dynamics.newton_euler[0, 0] - wanted) < 1e-11 * size
    for joint in motion.dynamics.reactions.joints:
        if joint.guide is None:
            for body in joint.bodies[1:]:
                value = motion.dynamics.joint_force(joint, body)[0]
                apart = abs(value - complex(true[joint.key, body, 0], true[joint.key, body, 1]))
                assert apart < 1e-10 * size, (joint.name, body)
        else:
            g = m.guides[joint.guide]
            rail = np.exp(1j * (g.angle + (0 if g.on == "ground" else motion.link(g.on).angle[0])))
            normal = complex(motion.dynamics.joint_force(joint, g.link)[0] * rail.conjugate())
            assert abs(normal.real) < 1e-10 * size or g.point == "T"
            assert abs(normal.imag - float(true[f"guide:{joint.guide}", g.link, 1])) < 1e-10 * size
            if g.is_slider:
                moment = motion.dynamics.joint_moment(joint, g.link)[0]
                assert abs(moment - float(true[f"moment:{joint.guide}", g.link, 0])) < 1e-10 * size
    return True


def test_some_random_racks_in_fifty_digits() -> None:
    assert sum(map(agrees, range(12))) > 5


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_random_racks_in_fifty_digits(seed: int) -> None:
    agrees(seed)


@pytest.mark.parametrize(
    "seed",
    [37, 55, 60, 77, 88, 114, 135, 155, 198, 203, 265, 435, 450, 467, 484, 491, 574, 599, *range(1, 24, 2)],
)
def test_an_exact_guess_is_obeyed_where_a_rack_turns_a_link_that_carries_a_slide(seed: int) -> None:
    """The turn of such a link depends on a slide that is sought with it: before, its slides were read at another turn."""
    built = generate(seed, True)
    if regularity(built) < 1e-3:
        return
    m = built.mechanism
    motion = m.motion(np.array([m.at] if len(m.at) > 1 else m.at))
    for name in m.links:
        apart = math.remainder(float(motion.link(name).angle[0]) - built.angles[name], 2 * math.pi)
        assert abs(apart) < 1e-9


def closes(m: Mechanism) -> float:
    """The largest share of what acts on a link that ΣF and ΣM leave."""
    worst = 0.0
    for body in free_bodies(m.motion().dynamics):
        force, moment = body.resultant()
        size = sum(np.abs(f.force) for f in body.forces)
        arms = sum(np.abs(f.force) * np.abs(f.at - body.center) for f in body.forces)
        arms = arms + sum(np.abs(t.torque) for t in body.torques)
        for rest, scale in ((force, size), (moment, arms + size * m.size)):
            worst = max(worst, float(np.max(np.abs(rest) / np.where(scale == 0, 1, scale))))
    return worst


@pytest.mark.parametrize("seed", range(30))
def test_every_link_of_random_racks_is_in_equilibrium(seed: int) -> None:
    """The tooth force acts at the pitch point of the wheel."""
    m = thrown(np.random.default_rng(seed))
    assert closes(m) < 1e-9


@pytest.mark.parametrize("file", ["belt-drive/belt-drive", "rack-lift/rack-lift", "planetary-gear/planetary"])
def test_every_link_of_gears_and_belts_is_in_equilibrium(file: str) -> None:
    assert closes(Mechanism.from_toml(str(files("cli.examples") / f"{file}.toml"))) < 1e-9
