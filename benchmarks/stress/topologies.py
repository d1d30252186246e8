"""Mechanisms of any topology: the pose is drawn first, and the bodies are joined where they stand.

Pins, slots, prisms and gears join bodies at random until the count leaves as many freedoms as there are inputs. The
pose is thereby known by construction and stands in the guess to full precision. What the program makes of it is
compared with all constraints at once in the coordinates (x, y, θ) of every link: another formulation, without loops,
groups or an order of solution.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from virtualwork import GROUND, Belt, Gear, Guess, Guide, Input, Link, Mechanism, Rack

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Reals = NDArray[np.float64]
    Generator = np.random.Generator

REGULAR = (
    1e-5  # least singular value over the largest from which a pose is taken as determined by its constraints
)
LINKS = (2, 6)
REGULAR_SHARE = 0.85  # of the mechanisms


@dataclass(frozen=True)
class Topology:
    """A mechanism and the pose it was built in: of each link the place of its origin, m, and its angle, rad."""

    seed: int
    mechanism: Mechanism
    origins: dict[str, complex]
    angles: dict[str, float]

    @property
    def inputs(self) -> tuple[float, ...]:
        """The inputs of the pose."""
        return self.mechanism.at

    @cached_property
    def rows(self) -> list[tuple[str, tuple[Any, ...]]]:
        """Every constraint as data, once."""
        return rows(self)

    @cached_property
    def kinds(self) -> list[str]:
        """The kind of each scalar constraint."""
        return [kind for kind, _ in self.rows for _ in range(2 if kind == "pin" else 1)]

    def unknowns(self) -> Reals:
        """The pose as x, y, θ of every link in order, (3·links,)."""
        return np.array(
            [
                v
                for b in self.mechanism.links
                for v in (self.origins[b].real, self.origins[b].imag, self.angles[b])
            ]
        )


class _Builder:
    """Draws bodies and joints from a generator."""

    def __init__(self, rng: Generator, links: int) -> None:
        self.rng = rng
        names = [f"l{i + 1}" for i in range(links)]
        # the file's order is not the order of solution
        self.names = [names[i] for i in rng.permutation(links)]
        self.origins = {b: self.place() for b in names} | {GROUND: 0j}
        self.angles = {b: float(rng.uniform(-math.pi, math.pi)) for b in names} | {GROUND: 0.0}
        self.points: dict[str, dict[str, complex]] = {b: {} for b in (GROUND, *self.names)}
        self.guides: list[Guide] = []
        self.gears: list[Gear] = []
        self.belts: list[Belt] = []
        self.racks: list[Rack] = []
        self.pins: dict[str, list[str]] = {}
        self.count = 0

    def place(self) -> complex:
        return complex(*self.rng.uniform(-1, 1, 2))

    def local(self, body: str, z: complex) -> complex:
        """A place in a body's own axes."""
        return (z - self.origins[body]) * cmath.exp(-1j * self.angles[body])

    def fresh(self, letter: str) -> str:
        self.count += 1
        return f"{letter}{self.count}"

    def two(self) -> tuple[str, str]:
        a, b = self.rng.choice([GROUND, *self.names], 2, replace=False)
        return str(a), str(b)

    def pin(self, a: str, b: str) -> None:
        """Pin two bodies together, sometimes at a pin that one of them already has."""
        shared = [p for p, held in self.pins.items() if (a in held) != (b in held)]
        if shared and self.rng.random() < 0.2:
            name = str(self.rng.choice(shared))
            z = self.seat(self.pins[name][0], self.points[self.pins[name][0]][name])
        else:
            name, z = self.fresh("P"), self.place()
            self.pins[name] = []
        for body in (a, b):
            if body not in self.pins[name]:
                self.pins[name].append(body)
                self.points[body][name] = self.local(body, z)

    def seat(self, body: str, z: complex) -> complex:
        """The place of a point of a body."""
        return self.origins[body] + z * cmath.exp(1j * self.angles[body])

    def guide(self, link: str, on: str, prism: bool) -> None:
        """Guide a point of a link, one of its own or a pin of it, along a line of another body."""
        if link == GROUND:
            link, on = on, link
        runs = {g.point for g in self.guides}
        held = [p for p in self.points[link] if p not in runs and on not in self.pins.get(p, ())]
        if held and self.rng.random() < 0.3:
            name = str(self.rng.choice(held))
        else:
            name = self.fresh("S")
            self.points[link][name] = self.local(link, self.place())
        angle = float(self.rng.choice([0.0, math.pi / 2, self.rng.uniform(-math.pi, math.pi)]))
        along = float(self.rng.uniform(-1, 1)) * cmath.exp(1j * angle)
        through = self.local(on, self.seat(link, self.points[link][name])) - along
        turned = self.angles[link] - self.angles[on] - angle if prism else None
        self.guides.append(Guide(name, link, on, complex(through), angle, turned))

    def gear(self, a: str, b: str) -> None:
        """Gear two bodies, on the ground or on another link that carries them."""
        if GROUND in (a, b):
            a, b = [str(x) for x in self.rng.choice(self.names, 2, replace=False)]
        carriers = [x for x in (GROUND, *self.names) if x not in (a, b)]
        arm = str(self.rng.choice(carriers)) if self.rng.random() < 0.7 else GROUND
        ratio = float(self.rng.choice([-2.0, -1.0, -0.5, 1.0, 2.0, 3.0, float(self.rng.uniform(-3, 3))]))
        self.gears.append(Gear((a, b), ratio, arm))

    def belt(self, a: str, b: str) -> None:
        """Lay a belt around two bodies, open or crossed, on the ground or on another link that carries them."""
        self.gear(a, b)
        gear = self.gears.pop()
        self.belts.append(Belt(gear.links, (abs(gear.ratio), 1.0), gear.ratio < 0, gear.arm))

    def rack(self) -> bool:
        """Let a body be the wheel of a rack; False where there is no guide for one."""
        runs = [g.point for g in self.guides]
        pairs = [
            (g.point, wheel)
            for g in self.guides
            for wheel in self.names
            if runs.count(g.point) == 1 and wheel != g.on and not (wheel == g.link and g.is_slider)
        ]
        if not pairs:
            return False
        point, wheel = pairs[int(self.rng.integers(len(pairs)))]
        self.racks.append(Rack(wheel, point, float(self.rng.choice([-1, 1]) * self.rng.uniform(0.1, 1))))
        return True

    def drive(self) -> tuple[Input, float]:
        """An input of the pose: a link against the ground or another link, or a slide."""
        speed, acceleration = map(float, self.rng.normal(size=2))
        if self.guides and self.rng.random() < 0.25:
            g = self.guides[int(self.rng.integers(len(self.guides)))]
            d = cmath.exp(1j * (g.angle + self.angles[g.on]))
            through = self.seat(g.on, complex(g.through))
            run = self.seat(g.link, self.points[g.link][g.point]) - through
            return Input(slider=g.point, speed=speed, acceleration=acceleration), (run * d.conjugate()).real
        link = str(self.rng.choice(self.names))
        others = [GROUND, GROUND, *(b for b in self.names if b != link)]
        on = str(self.rng.choice(others))
        return Input(link=link, on=on, speed=speed, acceleration=acceleration), self.angles[
            link
        ] - self.angles[on]


def generate(seed: int, toothed: bool = False) -> Topology:
    """A random mechanism in a random pose.

    Parameters
    ----------
    seed : int
    toothed : bool
        With belts and at least one rack besides.

    Returns
    -------
    Topology

    Examples
    --------
    >>> one = generate(3)
    >>> bool(np.abs(constraints(one, one.unknowns(), one.inputs)).max() < 1e-14)
    True
    """
    rng = np.random.default_rng(seed)
    # most bodies joined at random are structures with a part that floats: those are drawn again, but for a few
    regular = bool(rng.random() < REGULAR_SHARE)
    links = int(rng.integers(LINKS[0], LINKS[1] + 1))
    while True:
        found = _draw(rng, seed, links, toothed)
        if found is not None and (not regular or regularity(found) > REGULAR):
            return found


def _draw(rng: Generator, seed: int, links: int, toothed: bool) -> Topology | None:
    """Bodies joined and driven at random; None where one of them is left without a joint."""
    made = _Builder(rng, links)
    freedoms = 1 if rng.random() < 0.8 else 2
    if not _join(made, 3 * links - freedoms, toothed):
        return None
    runs = [g.point for g in made.guides]
    if toothed and (not made.racks or any(runs.count(rack.slider) > 1 for rack in made.racks)):
        return None
    driven: list[Input] = []
    at: list[float] = []
    while len(driven) < freedoms:
        entry, value = made.drive()
        if all(entry.name != other.name for other in driven):
            driven.append(entry)
            at.append(value)
    points = made.points
    mechanism = Mechanism(
        ground=points[GROUND],
        links={b: Link(points[b]) for b in made.names},
        guides=made.guides,
        gears=made.gears,
        belts=made.belts,
        racks=made.racks,
        inputs=driven,
        guess=Guess(
            at=at,
            angles={b: made.angles[b] for b in made.names},
            points={p: made.seat(b, z) for b in made.names for p, z in points[b].items()},
        ),
        name=f"topology {seed}",
    )
    del made.origins[GROUND], made.angles[GROUND]
    return Topology(seed, mechanism, made.origins, made.angles)


def _join(made: _Builder, left: int, toothed: bool) -> bool:
    """Join until so many constraints are used up; False where a link is left without a joint."""
    loose = set(made.names)
    while left:
        a, b = made.two()
        if loose:  # every body first hangs on one that is joined already
            a = str(made.rng.choice(sorted(loose)))
            b = str(made.rng.choice([GROUND, *(x for x in made.names if x not in loose)]))
            loose.discard(a)
        kind = str(made.rng.choice(["pin", "slot", "prism", "gear"], p=[0.5, 0.2, 0.15, 0.15]))
        if toothed and kind == "gear" and made.rng.random() < 0.8:
            if not made.rack():
                if len(made.names) < 2:
                    continue
                made.belt(a, b)
            left -= 1
        elif kind == "gear" and len(made.names) > 1:
            made.gear(a, b)
            left -= 1
        elif kind == "slot" or left == 1:
            made.guide(a, b, prism=False)
            left -= 1
        elif kind == "prism":
            made.guide(a, b, prism=True)
            left -= 2
        else:
            before = sum(map(len, made.pins.values())) - len(made.pins)
            made.pin(a, b)
            left -= 2 * (sum(map(len, made.pins.values())) - len(made.pins) - before)
        if left < 0:
            return False
    return not loose and all(made.points[b] for b in made.names)


def rows(t: Topology) -> list[tuple[str, tuple[Any, ...]]]:
    """Every scalar or vector constraint as data: pins, guides, turns (Σ c·θ = a guide's angle and what is added), slides that are driven."""
    m = t.mechanism
    found: list[tuple[str, tuple[Any, ...]]] = []
    for pin, bodies in m.pins.items():
        for other in bodies[1:]:
            found.append(("pin", (bodies[0], m.bodies[bodies[0]][pin], other, m.bodies[other][pin])))
    for g in m.guides:
        found.append(("line", (g.link, m.links[g.link].points[g.point], g.on, g.through, g.angle)))
        if g.turned is not None:
            found.append(("turn", ({g.link: 1.0, g.on: -1.0}, (g.angle, g.turned), None)))
    toothed: tuple[Gear | Belt, ...] = (*m.gears, *m.belts)
    for part in toothed:
        a, b = part.links
        held = {b: 1.0, a: -part.ratio}
        held[part.arm] = held.get(part.arm, 0.0) + part.ratio - 1.0
        # with a ratio of 1 the arm's angle is no part of it
        found.append(("turn", ({body: c for body, c in held.items() if c}, None, None)))
    for rack in m.racks:
        g = next(g for g in m.guides if g.point == rack.slider)
        line = g.link, m.bodies[g.link][g.point], g.on, g.through, g.angle
        found.append(("rack", (*line, {rack.gear: -rack.radius, g.on: rack.radius})))
    for j, e in enumerate(m.inputs):
        if e.link is not None:
            found.append(("turn", ({e.link: 1.0, e.on: -1.0}, (0.0, 0.0), j)))
        else:
            g = next(g for g in m.guides if g.point == e.slider)
            found.append(("run", (g.link, m.links[g.link].points[g.point], g.on, g.through, g.angle, j)))
    return found


def _seat(t: Topology, x: Any, body: str, z: complex) -> tuple[complex, complex, int]:
    """A point of a body, the part of it that turns, and the body's first column (−1: the ground)."""
    if body == GROUND:
        return z, z, -1
    i = 3 * list(t.mechanism.links).index(body)
    arm = z * cmath.exp(1j * x[i + 2])
    return complex(x[i], x[i + 1]) + arm, arm, i


def constraints(t: Topology, x: Reals, inputs: tuple[float, ...]) -> Reals:
    """What every constraint leaves at x (x, y, θ of every link), (3·links,): m, or rad."""
    return evaluate(t, x, inputs)[0]


def evaluate(t: Topology, x: Reals, inputs: tuple[float, ...]) -> tuple[Reals, Reals]:
    """Every constraint and its Jacobian."""
    out: list[float] = []
    jacobian: list[Reals] = []
    n = len(x)

    def add(value: float, parts: list[tuple[int, float]]) -> None:
        row = np.zeros(n)
        for column, factor in parts:
            if column >= 0:
                row[column] += factor
        out.append(value)
        jacobian.append(row)

    def moves(i: int, arm: complex, along: complex, sign: float) -> list[tuple[int, float]]:
        """Derivatives of sign·Re(conj(along)·P)."""
        if i < 0:
            return []
        turned = (along.conjugate() * 1j * arm).real
        return [(i, sign * along.real), (i + 1, sign * along.imag), (i + 2, sign * turned)]

    for kind, data in t.rows:
        if kind == "pin":
            (p, arm_p, i), (q, arm_q, k) = _seat(t, x, *data[:2]), _seat(t, x, *data[2:])
            for along in (1 + 0j, 1j):
                value = (along.conjugate() * (p - q)).real
                add(value, moves(i, arm_p, along, 1.0) + moves(k, arm_q, along, -1.0))
        elif kind == "turn":
            held, const, j = data
            columns = {b: _seat(t, x, b, 0j)[2] + 2 for b in held if b != GROUND}
            # a gear stands as it was drawn
            const = sum(c * t.angles.get(b, 0.0) for b, c in held.items()) if const is None else sum(const)
            value = sum(c * x[columns[b]] for b, c in held.items() if b in columns) - const
            if j is not None:
                value -= inputs[j]
            add(value, [(columns[b], c) for b, c in held.items() if b in columns])
        else:
            (p, arm_p, i), (q, arm_q, k) = _seat(t, x, *data[:2]), _seat(t, x, *data[2:4])
            turn = 1.0 if k < 0 else cmath.exp(1j * x[k + 2])
            d = cmath.exp(1j * data[4]) * turn
            along = 1j * d if kind == "line" else d
            value = (along.conjugate() * (p - q)).real - (inputs[data[5]] if kind == "run" else 0.0)
            if kind == "rack":
                # as it was drawn
                turned = {b: _seat(t, x, b, 0j)[2] + 2 for b in data[5] if b != GROUND}
                value += sum(c * (x[turned[b]] - t.angles[b]) for b, c in data[5].items() if b in turned)
                (drawn, _, _), (from_, _, _) = (_seat(t, t.unknowns(), *of) for of in (data[:2], data[2:4]))
                here = cmath.exp(1j * (data[4] + t.angles.get(data[2], 0.0)))
                value -= (here.conjugate() * (drawn - from_)).real
            parts = moves(i, arm_p, along, 1.0) + moves(k, arm_q, along, -1.0)
            if k >= 0:  # the line turns with its body
                parts.append((k + 2, ((1j * along).conjugate() * (p - q)).real))
            if kind == "rack":
                parts += [(turned[b], c) for b, c in data[5].items() if b in turned]
            add(value, parts)
    return np.array(out), np.array(jacobian)


def regularity(t: Topology) -> float:
    """The least singular value of all constraints at the pose over the largest; 0 where their number does not fit."""
    jacobian = evaluate(t, t.unknowns(), t.inputs)[1]
    if jacobian.shape[0] != jacobian.shape[1]:
        return 0.0
    s = np.linalg.svd(jacobian, compute_uv=False)
    return float(s[-1] / s[0])
