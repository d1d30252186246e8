"""Effort and joint forces against absolute coordinates with Lagrange multipliers in 50 digits (mpmath).

The oracle (`benchmarks.truth.mechanism`) knows nothing of groups, loops or velocity coefficients: three coordinates for
each link, the joints' equations, Jᵀλ = Q − M q̈. It starts from the library's positions only to choose the assembly.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from benchmarks.truth.mechanism import Exact
from virtualwork import (
    GROUND,
    Force,
    Gear,
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

KINDS = (
    "four-bar", "slider-crank", "inverted slider-crank", "Watt I", "Stephenson III", "cylinder", "geared five-bar",
    "triad", "moving slider", "carried motor", "two inputs",
)  # fmt: skip


@dataclass
class Made:
    """A random mechanism, put together in the pose in which its joints were thrown."""

    mechanism: Mechanism
    speed: float
    acceleration: float


def throw(kind: str, rng: np.random.Generator, *, loads: bool = True) -> Made:
    """Throw the joints of a mechanism; lengths and link axes follow, so that it is assembled at input 0."""

    def at(x: float, y: float) -> complex:
        return complex(x + rng.uniform(-0.25, 0.25), y + rng.uniform(-0.25, 0.25))

    def link(**joints: complex) -> Link:
        first = next(iter(joints.values()))
        center = complex(*rng.uniform(-0.5, 1.5, 2))
        return Link(
            {n: z - first for n, z in joints.items()}, rng.uniform(0.2, 3), center, rng.uniform(0.01, 0.5)
        )

    a, b, c, d = at(0, 0), at(0.3, 1), at(2, 1.6), at(2.3, 0)
    links: dict[str, Link] = {}
    ground: dict[str, complex] = {"A": a}
    guides: list[Guide] = []
    gears: list[Gear] = []
    motors: list[Motor] = []
    inputs: Any = Input(link="crank")
    links["crank"] = link(A=a, B=b)
    if kind in ("four-bar", "Watt I", "Stephenson III", "triad", "carried motor"):
        ground["D"] = d
        e, f, g = at(1.2, 2.4), at(3.2, 2.3), at(4, 0.2)
        if kind == "four-bar":
            links["coupler"], links["rocker"] = link(B=b, C=c), link(D=d, C=c)
        elif kind == "carried motor":
            # the rocker is driven relative to the ground by a motor that the coupler carries
            links["coupler"], links["rocker"] = link(B=b, C=c), link(D=d, C=c)
            inputs = Input(link="rocker")
            motors = [Motor("coupler", "rocker", 0.7, complex(*rng.uniform(-1, 1, 2)))]
        elif kind == "Watt I":
            links["coupler"], links["rocker"] = link(B=b, C=c, E=e), link(D=d, C=c, F=f)
            links["left"], links["right"] = link(E=e, G=at(2.2, 3.2)), None  # type: ignore[assignment]
            top = links["left"].points["G"] + e
            links["right"] = link(F=f, G=top)
        else:
            ground["G"] = g
            links["coupler"], links["rocker"] = link(B=b, C=c, E=e), link(D=d, C=c)
            links["rod"], links["arm"] = link(E=e, F=f), link(G=g, F=f)
            if kind == "triad":  # driven far from the four-bar: the rest is one group of four links
                inputs = Input(link="arm")
    elif kind in ("slider-crank", "moving slider"):
        angle = rng.uniform(-0.6, 0.6)
        links["rod"] = link(B=b, C=c)
        links["block"] = link(C=c, P=c + 0.2)
        if kind == "slider-crank":
            turned = -angle
            guides = [Guide("C", "block", GROUND, c - 0.7 * cmath.exp(1j * angle), angle, turned)]
        else:
            ground["D"] = d
            links["carrier"] = link(D=d, Q=d + 0.5)
            guides = [Guide("C", "block", "carrier", c - 0.7 * cmath.exp(1j * angle) - d, angle, -angle)]
            inputs = (Input(link="crank"), Input(link="carrier"))
    elif kind == "inverted slider-crank":
        ground["D"] = d
        links["rocker"] = link(D=d, Q=d + 1)
        angle = cmath.phase(b - d) + rng.uniform(-0.5, 0.5)
        guides = [Guide("B", "crank", "rocker", b - d - 0.4 * cmath.exp(1j * angle), angle)]
    elif kind == "cylinder":
        ground["D"] = d
        links["tube"], links["rod"] = link(D=d, Q=d + 0.3), link(B=b, R=b - 0.2)
        angle = cmath.phase(b - d)
        guides = [Guide("B", "rod", "tube", b - d - 0.6 * cmath.exp(1j * angle), angle, -angle)]
        inputs = Input(slider="B")
    elif kind == "geared five-bar":
        ground["D"] = d
        links["arm"] = link(D=d, E=at(3, 1.2))
        e = links["arm"].points["E"] + d
        links["left"], links["right"] = link(B=b, C=c), link(E=e, C=c)
        gears = [Gear(("crank", "arm"), float(rng.choice([-2.0, -1.0, 1.5])))]
    elif kind == "two inputs":
        ground["D"] = d
        links["arm"] = link(D=d, E=at(3, 1.2))
        e = links["arm"].points["E"] + d
        links["left"], links["right"] = link(B=b, C=c), link(E=e, C=c)
        inputs = (Input(link="crank"), Input(link="arm"))
    names = list(links)
    given: dict[str, Any] = {"motors": motors}
    if loads:

        def place() -> complex:
            return complex(*rng.uniform(-1, 1, 2))

        def name() -> str:
            return str(rng.choice(names))

        given |= {
            "gravity": complex(*rng.uniform(-10, 10, 2)),
            "forces": [
                Force(name(), place(), 20 * place(), "ground"),
                Force(name(), place(), 20 * place(), "link"),
            ],
            "torques": [Torque(name(), rng.uniform(-9, 9))],
            "springs": [
                Spring(
                    ((name(), place()), (GROUND, place() + 4)), rng.uniform(1, 90), 0.3, rng.uniform(0, 3)
                ),
                Spring(((names[0], place()), (names[-1], place() + 3)), rng.uniform(1, 90), 0.0, 0.0),
            ],
            "torsion_springs": [
                TorsionSpring((names[0], names[-1]), rng.uniform(1, 9), 0.3, rng.uniform(0, 2))
            ],
        }
    inputs_ = (inputs,) if isinstance(inputs, Input) else inputs
    home = tuple(0.6 if e.is_slide else 0.0 for e in inputs_)
    m = Mechanism(
        ground, links, guides=guides, gears=gears, inputs=inputs_,
        guess=Guess(at=home, angles=dict.fromkeys(names, 0.0)), **given,
    )  # fmt: skip
    return Made(m, float(rng.uniform(-3, 3)), float(rng.uniform(-5, 5)))


def compare(kind: str, seed: int) -> tuple[float, float] | None:
    """The errors of effort and joint forces relative to the largest force, over the condition number; None if ill."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    made = throw(kind, rng)
    m = made.mechanism
    k = len(m.inputs)
    inputs = tuple(h + float(rng.uniform(-0.03, 0.03)) for h in m.at)
    motion = m.motion(np.array([inputs]), made.speed, made.acceleration)
    condition = float(motion.condition[0])
    if not motion.assembled[0] or not condition < 100:
        return None
    exact = Exact(motion)
    assert exact.closed
    true = exact.forces()
    size = max(1e-3, *(float(abs(v)) for v in [*exact.generalized_loads(), *true.values()]))
    effort = motion.dynamics.effort[0]
    euler = motion.dynamics.newton_euler[0]
    errors = [abs(effort[j] - float(true["input", str(j), 0])) for j in range(k)]
    errors += [abs(euler[j] - float(true["input", str(j), 0])) for j in range(k)]
    forces = []
    for joint in motion.dynamics.reactions.joints:
        if joint.guide is None:
            for body in joint.bodies[1:]:
                found = motion.reaction(joint.name, body) if len(m.guides) == 0 else None
                value = motion.dynamics.joint_force(joint, body)[0]
                if found is not None:
                    assert complex(*found[0]) == value
                forces.append(abs(value - complex(true[joint.key, body, 0], true[joint.key, body, 1])))
        else:
            g = m.guides[joint.guide]
            value = motion.dynamics.joint_force(joint, g.link)[0]
            rail = np.exp(1j * (g.angle + (0 if g.on == GROUND else motion.link(g.on).angle[0])))
            normal = complex(value * rail.conjugate())
            along = float(true[f"guide:{joint.guide}", g.link, 1])
            forces += [abs(normal.real), abs(normal.imag - along)]
            if g.is_slider:
                moment = motion.dynamics.joint_moment(joint, g.link)[0]
                # the oracle's multiplier holds the moment about the point of the link, as the guide's does
                forces.append(abs(moment - float(true[f"moment:{joint.guide}", g.link, 0])))
    return max(errors) / size / condition, max(forces) / size / condition


@pytest.mark.parametrize("kind", KINDS)
def test_effort_and_joint_forces(kind: str) -> None:
    seen, seed = 0, 0
    while seen < 4:
        found = compare(kind, seed)
        seed += 1
        assert seed < 60
        if found is None:
            continue
        seen += 1
        assert max(found) < 1e-14, (kind, seed, found)


def test_the_oracle_sees_an_error() -> None:
    """A wrong sign of one load is seen at once: the comparison can fail."""
    rng = np.random.default_rng(5)
    made = throw("four-bar", rng)
    motion = made.mechanism.motion(0.01, made.speed, made.acceleration)
    wrong = Exact(made.mechanism.motion(0.01, -made.speed, made.acceleration))
    assert not math.isclose(float(wrong.forces()["input", "0", 0]), motion.effort[0], rel_tol=1e-6)
