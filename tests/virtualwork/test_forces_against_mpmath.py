"""Effort and joint forces against absolute coordinates with Lagrange multipliers in 40-digit arithmetic.

The oracle knows nothing of groups, loops or velocity coefficients: three coordinates for each link, the joints'
equations, Jᵀλ = Q − M q̈. It starts from the library's positions only to choose the assembly.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Any

import mpmath as mp
import numpy as np
import pytest

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


class Oracle:
    """Absolute coordinates (x, y, θ) of every link's axes, Lagrange multipliers, in mpmath."""

    def __init__(self, made: Made, inputs: tuple[float, ...], start: list[tuple[complex, float]]) -> None:
        self.m, self.made = made.mechanism, made
        self.links = list(self.m.links)
        self.inputs = inputs
        self.q = [mp.mpf(v) for z, t in start for v in (z.real, z.imag, t)]
        self.rates = mp.mpf(made.speed), mp.mpf(made.acceleration)
        self.solve()

    def point(self, q: Any, body: str, z: complex) -> Any:
        if body == GROUND:
            return mp.mpc(z)
        i = 3 * self.links.index(body)
        return mp.mpc(q[i], q[i + 1]) + mp.mpc(z) * mp.expj(q[i + 2])

    def angle(self, q: Any, body: str) -> Any:
        return mp.mpf(0) if body == GROUND else q[3 * self.links.index(body) + 2]

    def constraints(self) -> list[Any]:
        """The joints' equations as functions of the coordinates; inputs last, less their value."""
        m, found = self.m, []
        for name, bodies in m.pins.items():
            first, *others = bodies
            for body in others:

                def gap(q: Any, first: str = first, body: str = body, name: str = name) -> Any:
                    return self.point(q, body, m.bodies[body][name]) - self.point(
                        q, first, m.bodies[first][name]
                    )

                found.append((("pin", name, body, "x"), lambda q, gap=gap: gap(q).real))
                found.append((("pin", name, body, "y"), lambda q, gap=gap: gap(q).imag))
        for i, g in enumerate(m.guides):
            found.append((("normal", i), lambda q, g=g: self.along(q, g).imag))
            if g.turned is not None:
                found.append((("turn", i), lambda q, g=g: self.angle(q, g.link) - self.angle(q, g.on)))
        for i, gear in enumerate(m.gears):
            a, b = gear.links
            found.append(
                (("gear", i), lambda q, a=a, b=b, r=gear.ratio: self.angle(q, b) - r * self.angle(q, a))
            )
        for j, e in enumerate(m.inputs):
            if e.slider is not None:
                g = next(g for g in m.guides if g.point == e.slider)
                found.append((("input", j), lambda q, g=g: self.along(q, g).real))
            else:
                found.append((("input", j), lambda q, e=e: self.angle(q, str(e.link)) - self.angle(q, e.on)))
        return found

    def along(self, q: Any, g: Guide) -> Any:
        d = self.point(q, g.link, self.m.links[g.link].points[g.point]) - self.point(q, g.on, g.through)  # type: ignore[arg-type]
        return d * mp.expj(-self.angle(q, g.on) - mp.mpf(g.angle))

    def derivative(self, f: Any, order: int, direction: Any) -> Any:
        """The derivative of f along a direction, by a Taylor polynomial in extended precision."""
        return mp.diff(lambda t: f([x + t * v for x, v in zip(self.q, direction, strict=True)]), 0, order)

    def solve(self) -> None:
        rows = self.constraints()
        n = len(self.q)
        target = [mp.mpf(0)] * len(rows)
        offsets = [f(self.q0()) if label[0] in ("turn", "gear") else mp.mpf(0) for label, f in rows]
        for i, (label, _) in enumerate(rows):
            target[i] = mp.mpf(self.inputs[label[1]]) if label[0] == "input" else offsets[i]
        unit = [[mp.mpf(int(i == j)) for i in range(n)] for j in range(n)]
        for _ in range(8):
            gap = mp.matrix([f(self.q) - t for (_, f), t in zip(rows, target, strict=True)])
            self.jacobian = mp.matrix([[self.derivative(f, 1, u) for u in unit] for _, f in rows])
            step = mp.lu_solve(self.jacobian, -gap)
            self.q = [x + s for x, s in zip(self.q, step, strict=True)]
            if max(abs(s) for s in step) < mp.mpf(10) ** (-mp.mp.dps + 8):
                break
        drive = [mp.mpf(int(label[0] == "input")) for label, _ in rows]
        self.v = list(mp.lu_solve(self.jacobian, mp.matrix([d * self.rates[0] for d in drive])))
        bend = [self.derivative(f, 2, self.v) for _, f in rows]
        self.a = list(
            mp.lu_solve(
                self.jacobian, mp.matrix([d * self.rates[1] - b for d, b in zip(drive, bend, strict=True)])
            )
        )
        self.labels = [label for label, _ in rows]
        # a motor carried by another link than its input's `on` reacts there: another pattern of the same multiplier
        for j, e in enumerate(self.m.inputs):
            for carrier in [k.carrier for k in self.m.motors if k.drives == e.link]:
                self.jacobian[self.labels.index(("input", j)), 3 * self.links.index(carrier) + 2] -= 1
        self.multipliers = list(mp.lu_solve(self.jacobian.T, -self.loads()))

    def q0(self) -> list[Any]:
        """All link axes as they were thrown: angles zero."""
        return [mp.mpf(0)] * len(self.q)

    def loads(self) -> Any:
        """Generalized forces with inertia, for each coordinate."""
        m, n = self.m, len(self.q)
        total = [mp.mpf(0)] * n

        def push(body: str, z: Any, force: Any) -> None:
            if body != GROUND:
                i = 3 * self.links.index(body)
                total[i] += force.real
                total[i + 1] += force.imag
                arm = mp.mpc(z) * mp.expj(self.q[i + 2])
                total[i + 2] += (mp.conj(arm) * force).imag

        def turn(body: str, torque: Any) -> None:
            if body != GROUND:
                total[3 * self.links.index(body) + 2] += torque

        def moved(body: str, z: complex) -> tuple[Any, Any, Any]:
            """Position, velocity, acceleration of a point."""
            if body == GROUND:
                return mp.mpc(z), mp.mpc(0), mp.mpc(0)
            i = 3 * self.links.index(body)
            arm = mp.mpc(z) * mp.expj(self.q[i + 2])
            w, al = self.v[i + 2], self.a[i + 2]
            return (
                mp.mpc(self.q[i], self.q[i + 1]) + arm,
                mp.mpc(self.v[i], self.v[i + 1]) + mp.mpc(0, w) * arm,
                mp.mpc(self.a[i], self.a[i + 1]) + (mp.mpc(0, al) - w * w) * arm,
            )

        for body, part in m.links.items():
            parts = [(part.mass, part.center)] + [(k.mass, k.center) for k in m.motors if k.carrier == body]
            for mass, center in parts:
                push(body, center, mp.mpf(mass) * (mp.mpc(m.gravity) - moved(body, center)[2]))
            turn(body, -mp.mpf(part.inertia) * self.a[3 * self.links.index(body) + 2])
        for f in m.forces:
            push(
                f.link,
                f.point,
                mp.mpc(f.force) * (mp.expj(self.angle(self.q, f.link)) if f.frame == "link" else 1),
            )
        for t in m.torques:
            turn(t.link, mp.mpf(t.torque))
        for s in m.springs:
            (p1, v1, _), (p2, v2, _) = (moved(*end) for end in s.between)
            d, rate = p2 - p1, v2 - v1
            length = abs(d)
            pull = s.stiffness * (length - s.free_length) + s.damping * (mp.conj(d) * rate).real / length
            push(*s.between[0], d / length * pull)
            push(*s.between[1], -d / length * pull)
        for ts in m.torsion_springs:
            first, second = ts.links
            angle = self.angle(self.q, second) - self.angle(self.q, first) - mp.mpf(ts.free_angle)
            rate = self.v[3 * self.links.index(second) + 2] - self.v[3 * self.links.index(first) + 2]
            torque = ts.stiffness * angle + ts.damping * rate
            turn(first, torque)
            turn(second, -torque)
        return mp.matrix(total)

    def effort(self, j: int = 0) -> Any:
        return self.multipliers[self.labels.index(("input", j))]

    def pin(self, name: str, on: str) -> complex:
        """The force of a pin on one of its later bodies."""
        x, y = (self.multipliers[self.labels.index(("pin", name, on, axis))] for axis in "xy")
        return complex(x, y)

    def terms(self) -> float:
        """The size of the loads."""
        return max(float(abs(v)) for v in [*self.loads(), *self.multipliers])


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
    start = [(complex(motion.at(n, 0j).complex(0)[0]), float(motion.link(n).angle[0])) for n in m.links]
    oracle = Oracle(made, inputs, start)
    size = max(oracle.terms(), 1e-3)
    effort = motion.dynamics.effort[0]
    euler = motion.dynamics.newton_euler[0]
    errors = [abs(effort[j] - float(oracle.effort(j))) for j in range(k)]
    errors += [abs(euler[j] - float(oracle.effort(j))) for j in range(k)]
    forces = []
    for joint in motion.dynamics.reactions.joints:
        if joint.guide is None:
            for body in joint.bodies[1:]:
                found = motion.reaction(joint.name, body) if len(m.guides) == 0 else None
                value = motion.dynamics.joint_force(joint, body)[0]
                if found is not None:
                    assert complex(*found[0]) == value
                forces.append(abs(value - oracle.pin(joint.name, body)))
        else:
            g = m.guides[joint.guide]
            value = motion.dynamics.joint_force(joint, g.link)[0]
            rail = np.exp(1j * (g.angle + (0 if g.on == GROUND else motion.link(g.on).angle[0])))
            normal = complex(value * rail.conjugate())
            exact = float(oracle.multipliers[oracle.labels.index(("normal", joint.guide))])
            forces += [abs(normal.real), abs(normal.imag - exact)]
            if g.is_slider:
                moment = motion.dynamics.joint_moment(joint, g.link)[0]
                # the oracle's multiplier holds the moment about the point of the link, as the guide's does
                forces.append(
                    abs(moment - float(oracle.multipliers[oracle.labels.index(("turn", joint.guide))]))
                )
    return max(errors) / size / condition, max(forces) / size / condition


@pytest.mark.parametrize("kind", KINDS)
def test_effort_and_joint_forces(kind: str) -> None:
    mp.mp.dps = 40
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
    mp.mp.dps = 30
    rng = np.random.default_rng(5)
    made = throw("four-bar", rng)
    motion = made.mechanism.motion(0.01, made.speed, made.acceleration)
    start = [
        (complex(motion.at(n, 0j).complex(0)[0]), float(motion.link(n).angle[0]))
        for n in made.mechanism.links
    ]
    wrong = Made(made.mechanism, -made.speed, made.acceleration)
    exact = float(Oracle(wrong, (0.01,), start).effort())
    assert not math.isclose(exact, motion.effort[0], rel_tol=1e-6)
