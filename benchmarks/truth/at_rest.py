"""A mechanism at rest in 50 digits: the potential of its loads, its derivatives, and the generalized mass.

From the places of absolute coordinates and their derivatives along the inputs (`constraints`), by the potential of every load
itself.
"""

from __future__ import annotations

from itertools import combinations
from typing import Any, NamedTuple

import mpmath as mp

from benchmarks.truth.constraints import DIGITS
from benchmarks.truth.mechanism import Exact
from virtualwork import Mechanism


class Along(NamedTuple):
    """The potential along a way of the inputs, and its two derivatives; K m K is the mass, with the K of every coordinate."""

    potential: Any
    slope: Any
    bend: Any
    coefficients: list[tuple[Any, Any]]


def _dot(a: Any, b: Any) -> Any:
    return mp.re(mp.conj(a) * b)


def along(m: Mechanism, inputs: list[Any], way: list[float], constants: Any = None) -> Along:
    """Work out the loads at a position, over a way on which input j moves by `way[j]`."""
    motion = m.motion([[float(q) for q in inputs]], way, [0.0] * len(way))
    e = Exact(motion, inputs=inputs, constants=constants)
    potential = slope = bend = mp.mpf(0)
    moved: list[tuple[Any, Any]] = []

    def store(stiffness: Any, stretch: Any, first: Any, second: Any) -> None:
        nonlocal potential, slope, bend
        k = mp.mpf(stiffness)
        potential += k * stretch**2 / 2
        slope += k * stretch * first
        bend += k * (first**2 + stretch * second)

    def push(force: Any, *places: Any) -> None:
        nonlocal potential, slope, bend
        p, k, second = places
        potential -= _dot(force, p)
        slope -= _dot(force, k)
        bend -= _dot(force, second)

    for name, link in m.links.items():
        places = [e.point(name, link.center, k) for k in range(3)]
        push(mp.mpf(link.mass) * mp.mpc(m.gravity), *places)
        moved += [(mp.mpf(link.mass), places[1]), (mp.mpf(link.inertia), mp.mpc(e.angle(name, 1)))]
    for f in m.forces:
        places = [e.point(f.link, m.place(f.link, f.point), k) for k in range(3)]
        force = mp.mpc(f.force)
        if f.frame == "link":
            force *= e.turn(f.link, 0)[0]
            # what has no potential has a generalized force that turns
            bend -= _dot(1j * e.angle(f.link, 1) * force, places[1])
        push(force, *places)
    for t in m.torques:
        push(mp.mpc(t.torque), *(mp.mpc(e.angle(t.link, k)) for k in range(3)))
    for s in m.springs:
        (a, za), (b, zb) = ((body, m.place(body, point)) for body, point in s.between)
        d, d1, d2 = (e.point(b, zb, k) - e.point(a, za, k) for k in range(3))
        length = abs(d)
        first = _dot(d, d1) / length
        second = (_dot(d1, d1) + _dot(d, d2) - first**2) / length
        store(s.stiffness, length - mp.mpf(s.free_length), first, second)
    for ts in m.torsion_springs:
        angle, first, second = (e.angle(ts.links[1], k) - e.angle(ts.links[0], k) for k in range(3))
        twist = angle - mp.mpf(ts.free_angle) - 2 * mp.pi * e.whole_turns(ts, angle)
        store(ts.stiffness, twist, first, second)
    return Along(potential, slope, bend, moved)


class AtRest:
    """A position of rest in 50 digits, by Newton's method from one near it.

    Attributes
    ----------
    inputs : list of k numbers
    potential : number
    stiffness, mass : matrices (k, k)
    """

    def __init__(self, m: Mechanism, inputs: list[float], constants: Any = None) -> None:
        k = len(inputs)
        ways = [[float(i == j) for j in range(k)] for i in range(k)]
        with mp.workdps(DIGITS):
            self.inputs = [mp.mpf(q) for q in inputs]
            for _ in range(9):
                own = [along(m, self.inputs, way, constants) for way in ways]
                stiffness, mass = mp.zeros(k), mp.zeros(k)
                for i in range(k):
                    stiffness[i, i] = own[i].bend
                for i, j in combinations(range(k), 2):
                    both = along(m, self.inputs, [float(x in (i, j)) for x in range(k)], constants)
                    stiffness[i, j] = stiffness[j, i] = (both.bend - own[i].bend - own[j].bend) / 2
                step = mp.lu_solve(stiffness, mp.matrix([-each.slope for each in own]))
                if max(abs(x) for x in step) < mp.mpf(10) ** (5 - DIGITS):
                    break
                self.inputs = [q + x for q, x in zip(self.inputs, step, strict=True)]
            for i in range(k):
                for j in range(k):
                    pairs = zip(own[i].coefficients, own[j].coefficients, strict=True)
                    mass[i, j] = mp.fsum(weight * _dot(a, b) for (weight, a), (_, b) in pairs)
            self.potential, self.stiffness, self.mass = own[0].potential, stiffness, mass

    @property
    def periods(self) -> list[Any]:
        """2π √μ with V″ a μ = M a, the longest first."""
        with mp.workdps(DIGITS):
            root = mp.cholesky(self.stiffness) ** -1
            values = mp.eigsy(root * self.mass * root.T, eigvals_only=True)
            return sorted((2 * mp.pi * mp.sqrt(mp.mpf(abs(x))) for x in values), reverse=True)
