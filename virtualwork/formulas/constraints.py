"""All joints of a mechanism at once in the coordinates (θ, x, y) of every link, and what their rank says of its freedom.

No loops, no groups, no order of solution: Φ(x) = 0 with two rows for a pin, one for a slot, two for a slider, one for a
gear. A motion that every row of Φ_x and every input leaves free, at poses all around, is a freedom that no input holds,
whatever Grübler's count says (J. García de Jalón, E. Bayo, Kinematic and Dynamic Simulation of Multibody Systems,
1994, §2.2 and §3.5).
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from virtualwork.mechanism import GROUND

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from virtualwork.mechanism import Mechanism
    from virtualwork.plan.steps import Plan
    from virtualwork.state import State

    Reals = NDArray[np.float64]

RANK = 1e-9  # a singular value below this share of the largest is zero
STEP = (
    0.05  # how far the pose is moved to tell a freedom from a singular pose: rad, or of the mechanism's size
)


def coordinates(m: Mechanism, plan: Plan, st: State) -> Reals:
    """A pose as θ, x/size, y/size of every link's origin, (3·links,)."""
    found = []
    for link in m.links:
        base, terms = plan.anchors[link]
        origin = complex(np.ravel(st.point[base] + st.sum(terms))[0])
        turn = complex(np.ravel(st.turn[link])[0])
        found += [float(np.angle(turn)), origin.real / m.size, origin.imag / m.size]
    return np.array(found)


@dataclass(frozen=True)
class Constraints:
    """What the joints leave at a pose, and their Jacobian; lengths over the mechanism's size.

    Attributes
    ----------
    labels : list of str
        The joint of each row.
    values : array (constraints,)
    jacobian : array (constraints, 3·links)
    inputs : array (inputs, 3·links)
        The Jacobian of the inputs.
    driving : array (inputs,)
        The inputs themselves.
    """

    labels: list[str]
    values: Reals
    jacobian: Reals
    inputs: Reals
    driving: Reals

    @classmethod
    def at(cls, m: Mechanism, x: Reals, phases: Mapping[int, float]) -> Constraints:
        """At a pose (3·links,); `phases` are the constants of the gears."""
        rows = _Rows(m, x)
        for pin, bodies in m.pins.items():
            first = bodies[0]
            for other in bodies[1:]:
                for along in (1 + 0j, 1j):
                    label = f"pin {pin}"
                    rows.between(label, (first, m.bodies[first][pin]), (other, m.bodies[other][pin]), along)
        for g in m.guides:
            label = f"{'slider' if g.is_slider else 'slot'} {g.point}"
            through = m.bodies[g.on][g.through] if isinstance(g.through, str) else g.through
            normal = 1j * cmath.exp(1j * g.angle)
            rows.between(label, (g.link, m.bodies[g.link][g.point]), (g.on, through), normal, on=g.on)
            if g.turned is not None:
                rows.turn(label, {g.link: 1.0, g.on: -1.0}, g.angle + g.turned)
        for i, gear in enumerate(m.gears):
            rows.turn(f"gear {gear.links[0]}-{gear.links[1]}", gear.shares(), phases.get(i, 0.0))
        joints = len(rows.labels)
        for e in m.inputs:
            if e.link is not None:
                rows.turn("", {e.link: 1.0, e.on: -1.0}, 0.0)
            else:
                g = next(g for g in m.guides if g.point == e.slider)
                through = m.bodies[g.on][g.through] if isinstance(g.through, str) else g.through
                along = cmath.exp(1j * g.angle)
                rows.between("", (g.link, m.bodies[g.link][g.point]), (g.on, through), along, on=g.on)
        every = np.array(rows.rows).reshape(-1, len(x))
        values = np.array(rows.values)
        return cls(rows.labels[:joints], values[:joints], every[:joints], every[joints:], values[joints:])

    @property
    def driven(self) -> Reals:
        """The Jacobian of the joints and of the inputs."""
        return np.concatenate([self.jacobian, self.inputs])


class _Rows:
    """Writes down rows."""

    def __init__(self, m: Mechanism, x: Reals) -> None:
        self.size, self.x = m.size, x
        self.column = {link: 3 * i for i, link in enumerate(m.links)}
        self.labels: list[str] = []
        self.values: list[float] = []
        self.rows: list[Reals] = []

    def between(
        self, label: str, a: tuple[str, complex], b: tuple[str, complex], along: complex, on: str = GROUND
    ) -> None:
        """The distance of two points along a direction, which turns with body `on`."""
        row = np.zeros(len(self.x))
        if on != GROUND:
            along = along * cmath.exp(1j * self.x[self.column[on]])
        gap = 0j
        for (body, z), sign in ((a, 1.0), (b, -1.0)):
            arm = z / self.size
            if body != GROUND:
                i = self.column[body]
                arm = arm * cmath.exp(1j * self.x[i])
                gap += sign * complex(self.x[i + 1], self.x[i + 2])
                row[i] += sign * (along.conjugate() * 1j * arm).real
                row[i + 1] += sign * along.real
                row[i + 2] += sign * along.imag
            gap += sign * arm
        if on != GROUND:
            row[self.column[on]] += ((1j * along).conjugate() * gap).real
        self._add(label, (along.conjugate() * gap).real, row)

    def turn(self, label: str, shares: Mapping[str, float], const: float) -> None:
        """Σ c·θ = const."""
        row = np.zeros(len(self.x))
        for body, c in shares.items():
            if body != GROUND:
                row[self.column[body]] += c
        self._add(label, float(row @ self.x) - const, row)

    def _add(self, label: str, value: float, row: Reals) -> None:
        self.labels.append(label)
        self.values.append(value)
        self.rows.append(row)


def dependent(labels: list[str], jacobian: Reals) -> tuple[int, tuple[str, ...]]:
    """The rank of the joints' Jacobian, and the joints whose rows depend on each other."""
    u, s, _ = np.linalg.svd(jacobian)
    rank = int((s > RANK * s[0]).sum())
    left = u[:, rank:]
    found = [label for label, row in zip(labels, left, strict=True) if np.abs(row).max(initial=0) > 1e-6]
    return rank, tuple(dict.fromkeys(found))


def hidden_freedom(m: Mechanism, x: Reals) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
    """The links that no input holds although the count says so, and the joints and inputs that depend on each other.

    Parameters
    ----------
    m : Mechanism
    x : array (3·links,)
        A pose, as `coordinates` gives it; roughly is enough.

    Returns
    -------
    (links, joints), or None where nothing is free, or free only where the mechanism stands.
    """
    phases = {
        i: sum(c * x[3 * list(m.links).index(b)] for b, c in gear.shares().items() if b != GROUND)
        for i, gear in enumerate(m.gears)
    }
    start = _settled(m, x, phases)
    if start is None:
        return None
    here = Constraints.at(m, start, phases)
    if _free(here.driven) is None:
        return None
    # a little farther on the input's way, either side; where it cannot move, wherever anything can
    there = [_settled(m, start, phases, here.driving + side * STEP) for side in (1, -1)]
    null = _free(here.jacobian)
    if all(pose is None for pose in there) and null is not None:
        for k in (1.0, 2.0, 3.0):
            mix = null @ np.cos(k * np.sqrt(np.arange(1, 1 + null.shape[1])))
            there.append(_settled(m, start + STEP * mix, phases))
    found = None
    for pose in there:
        if pose is None:
            continue
        here = Constraints.at(m, pose, phases)
        free = _free(here.driven)
        if free is None:
            return None
        # a double root is no freedom: it comes back
        mix = free @ np.cos(np.sqrt(np.arange(1, 1 + free.shape[1])))
        away = _settled(m, pose + STEP * mix, phases, here.driving)
        if away is None or np.abs(away - pose).max() < 0.1 * STEP * np.abs(mix).max():
            return None
        moves = np.abs(free).max(axis=1).reshape(-1, 3).max(axis=1)
        links = tuple(link for link, size in zip(m.links, moves, strict=True) if size > 1e-6)
        labels = [*here.labels, *(f"input {e.name}" for e in m.inputs)]
        found = links, dependent(labels, here.driven)[1]
    return found


def _free(jacobian: Reals) -> Reals | None:
    """A basis of what a Jacobian leaves free, (coordinates, freedoms); None where that is nothing."""
    _, s, vt = np.linalg.svd(jacobian)
    rank = int((s > RANK * s[0]).sum()) if len(s) else 0
    return np.asarray(vt[rank:].T) if rank < len(vt) else None


def _settled(
    m: Mechanism, x: Reals, phases: Mapping[int, float], driving: Reals | None = None
) -> Reals | None:
    """The pose nearby at which all joints close, with the inputs free or given; None where there is none."""
    for _ in range(30):
        here = Constraints.at(m, x, phases)
        values, jacobian = here.values, here.jacobian
        if driving is not None:
            values, jacobian = np.append(values, here.driving - driving), here.driven
        if not np.isfinite(jacobian).all() or not np.isfinite(values).all():
            return None
        # Gauss-Newton steps of least norm
        step = np.linalg.lstsq(jacobian, -values, rcond=RANK)[0]
        if np.abs(step).max(initial=0.0) < 1e-11:
            return x if np.abs(values).max(initial=0.0) < 1e-9 else None
        x = x + step * min(1.0, 0.5 / float(np.abs(step).max()))
    return None
