"""Stress of the equilibria: four-bars and slider-cranks under weights, springs and forces, against the potential itself.

The potential of the loads is written down here over the closed form of the linkage, in the ground's x and y, so that a
complex step gives its slope to rounding (W. Squire and G. Trapp, SIAM Review 40, 1998): the effort at rest. Its sign
changes on a fine grid are the equilibria, its slope their stability.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.stress.pairs import Pairs
from virtualwork import GROUND, Force, Guess, Guide, Input, Link, Mechanism, Spring, Torque, TorsionSpring

Generator = np.random.Generator
Reals = NDArray[np.float64]
Place = tuple[Any, Any]  # x and y, which a complex step makes complex
Potential = Callable[[Any], Any]

GRID = 28_800  # of a turn: twenty times as fine as the search that is tried
STEP = 1e-30


def _seat(origin: Place, turn: Place, z: complex) -> Place:
    """A point of a link from its origin and the cosine and sine of its angle."""
    c, s = turn
    return origin[0] + c * z.real - s * z.imag, origin[1] + s * z.real + c * z.imag


def _meet(a: Place, b: Place, r: float, s: float, side: float) -> Place:
    """Where circles of radius r about a and s about b meet, on the left of the way from a to b or on its right."""
    x, y = b[0] - a[0], b[1] - a[1]
    square = x * x + y * y
    along = (square + r * r - s * s) / (2 * square)
    across = side * np.sqrt(r * r / square - along * along)
    return a[0] + along * x - across * y, a[1] + along * y + across * x


def _link(rng: Generator, points: dict[str, complex], length: float) -> Link:
    center = length * complex(rng.uniform(-0.3, 1.3), rng.uniform(-0.5, 0.5))
    return Link(points, float(rng.uniform(0.2, 2)), center, 1.0)


def scene(rng: Generator) -> tuple[Mechanism, Potential]:
    """A linkage at rest under some loads, and its potential as a function of the crank's angle.

    Returns
    -------
    (Mechanism, callable)
        The potential, J, of angles in rad, with any constant; NaN where the linkage is not assembled.

    Examples
    --------
    >>> m, potential = scene(np.random.default_rng(1))
    >>> slope = float(potential(m.at[0] + 1j * STEP).imag / STEP)
    >>> effort = float(m.motion(m.at[0]).effort[0])
    >>> abs(slope - effort) < 1e-12 * abs(effort)
    True
    """
    bars = rng.random() < 0.6
    a, b, c, d = (float(x) for x in 10.0 ** rng.uniform(-0.4, 0.4, 4))
    side = float(rng.choice([-1, 1]))
    lift = float(rng.uniform(-0.5, 0.5)) * b
    crank = _link(rng, {"A": 0j, "B": a}, a)
    coupler = _link(rng, {"B": 0j, "C": b}, b)
    last = _link(rng, {"D": 0j, "C": c}, c) if bars else Link({"C": 0j}, float(rng.uniform(0.2, 2)))

    def places(q: Any) -> dict[str, tuple[Place, Place]]:
        """The origin of each link, and cosine and sine of its angle."""
        turn = np.cos(q), np.sin(q)
        pin = a * turn[0], a * turn[1]
        if bars:
            end = _meet(pin, (d, 0.0), b, c, side)
            rest = (d, 0.0), ((end[0] - d) / c, end[1] / c)
        else:
            end = pin[0] + side * np.sqrt(b * b - (lift - pin[1]) ** 2), lift
            rest = end, (1.0, 0.0)
        rod = (end[0] - pin[0]) / b, (end[1] - pin[1]) / b
        return {
            GROUND: ((0.0, 0.0), (1.0, 0.0)),
            "crank": ((0.0, 0.0), turn),
            "coupler": (pin, rod),
            "last": rest,
        }

    links = {"crank": crank, "coupler": coupler, "last": last}
    gravity = complex(*rng.normal(size=2)) * 10 if rng.random() < 0.8 else 0j
    span = a + b

    def anywhere() -> tuple[str, complex]:
        return str(rng.choice(["crank", "coupler"])), span * complex(*rng.uniform(-1, 1, 2))

    springs = [
        Spring(
            (anywhere(), (GROUND, 2 * span * complex(*rng.uniform(-1, 1, 2)))),
            stiffness=float(10.0 ** rng.uniform(0, 2)),
            free_length=span * float(rng.choice([0.0, rng.uniform(0, 2)])),
        )
        for _ in range(int(rng.integers(0, 3)))
    ]
    forces = [Force(*anywhere(), 20 * complex(*rng.normal(size=2)))] if rng.random() < 0.3 else []
    torque = float(rng.normal()) * 10 if rng.random() < 0.3 else 0.0
    # of a whole turn its potential has two values at one place: the crank's own angle counts
    torsion = (
        (float(rng.uniform(1, 20)), float(rng.uniform(0, 2 * np.pi))) if rng.random() < 0.2 else (0.0, 0.0)
    )

    def potential(q: Any) -> Any:
        at = places(q)
        total = torsion[0] / 2 * (q - torsion[1]) ** 2 - torque * q
        for name, link in links.items():
            x, y = _seat(*at[name], complex(link.center))
            total = total - link.mass * (gravity.real * x + gravity.imag * y)
        for spring in springs:
            (x, y), (u, v) = (_seat(*at[body], complex(z)) for body, z in spring.between)
            length = np.sqrt((x - u) ** 2 + (y - v) ** 2)
            total = total + spring.stiffness / 2 * (length - spring.free_length) ** 2
        for force in forces:
            assert isinstance(force.point, complex)
            x, y = _seat(*at[force.link], force.point)
            total = total - (force.force.real * x + force.force.imag * y)
        return total

    grid = np.linspace(0, 2 * np.pi, 721)
    with np.errstate(invalid="ignore"):
        good = np.flatnonzero(np.isfinite(potential(grid)))
    if not len(good):
        return scene(rng)
    start = float(grid[int(rng.choice(good))])
    pose = places(start)
    mechanism = Mechanism(
        ground={"A": 0j, "D": d} if bars else {"A": 0j},
        links=links,
        guides=[] if bars else [Guide("C", "last", through=1j * lift, turned=0.0)],
        inputs=Input(link="crank"),
        guess=Guess(
            at=start, angles={k: float(np.arctan2(pose[k][1][1], pose[k][1][0])) for k in ("coupler", "last")}
        ),
        gravity=gravity,
        forces=forces,
        torques=[Torque("crank", torque)] if torque else [],
        springs=springs,
        torsion_springs=[TorsionSpring((GROUND, "crank"), *torsion)] if torsion[0] else [],
    )
    return mechanism, potential


def slope(potential: Potential, q: Any) -> Any:
    """dV/dq, N·m; NaN where the linkage is not assembled."""
    with np.errstate(invalid="ignore"):
        outside = ~np.isfinite(potential(q))
        return np.where(outside, np.nan, potential(q + 1j * STEP).imag / STEP)


def _looked_through(mechanism: Mechanism, potential: Potential) -> Reals:
    """Angles of the crank, a `GRID`th of a turn apart: a turn; under a torsion spring, whose turns count, those that the guess leads to."""
    if not mechanism.torsion_springs:
        return np.linspace(0, 2 * np.pi, GRID + 1)
    q: Reals = mechanism.at[0] + np.linspace(-2 * np.pi, 2 * np.pi, 2 * GRID + 1)
    with np.errstate(invalid="ignore"):
        gaps = np.flatnonzero(~np.isfinite(potential(q)))
    before, behind = gaps[gaps < GRID], gaps[gaps > GRID]
    return np.asarray(q[before.max(initial=-1) + 1 : behind.min(initial=len(q))])


def faults(mechanism: Mechanism, potential: Potential) -> list[str]:
    """What is wrong with the equilibria that a mechanism gives: one line for each."""
    found = mechanism.equilibria()
    q = _looked_through(mechanism, potential)
    effort = slope(potential, q)
    good = np.isfinite(effort)
    scale = float(np.median(np.abs(effort[good])))
    if found.everywhere or found.region:
        return [] if scale < 1e-10 else ["everywhere"]
    told = np.array([e.inputs[0] for e in found.found])
    change = np.flatnonzero(good[:-1] & good[1:] & (np.sign(effort[:-1]) * np.sign(effort[1:]) < 0))
    cell, wrong = 2 * np.pi / GRID, []
    for i in change:
        away = np.abs(told - q[i] - cell / 2)
        if not mechanism.torsion_springs:
            away = np.abs(np.angle(np.exp(1j * away)))
        near = np.flatnonzero(away < cell)
        stable = bool(effort[i] < 0)
        if not len(near):
            wrong.append(f"missed {q[i]:.9g} {'stable' if stable else 'unstable'}")
        elif all(found.found[k].stable is (not stable) for k in near):
            wrong.append(f"stability of {q[i]:.9g}")
    for e in found.found:
        x = e.inputs[0]
        # the least slope that the rounding of the input itself leaves
        around = slope(potential, x + np.array([-1.0, 0.0, 1.0]) * 1e-7)
        if not np.abs(around[1]) <= 1e-9 * scale + 1e-6 * np.nanmax(np.abs(around), initial=0.0):
            wrong.append(f"invented {x:.9g}")
        elif mechanism.torsion_springs and not q[0] - cell <= x <= q[-1] + cell:
            wrong.append(f"out of reach {x:.9g}")
    return wrong


def _rest(rng: Generator) -> Pairs:
    mechanism, potential = scene(rng)
    wrong = faults(mechanism, potential)
    return [(0.0, 1.0)] * (1 + len(mechanism.equilibria().found)) + [(np.inf, 1.0)] * len(wrong)


CAMPAIGNS = {
    "equilibria": (
        "four-bars and slider-cranks under weights, springs, forces: missed, invented, misjudged",
        _rest,
    ),
}
