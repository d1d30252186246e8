"""All joints of a mechanism at once in the coordinates (θ, x, y) of every link, and what their rank says of its freedom.

No loops, no groups, no order of solution: Φ(x) = 0 with two rows for a pin, one for a slot, two for a slider, one for a
gear, a belt, a rack or a cam. A motion that every row of Φ_x and every input leaves free, at poses all around, is a freedom that no input holds,
whatever Grübler's count says (J. García de Jalón, E. Bayo, Kinematic and Dynamic Simulation of Multibody Systems,
1994, §2.2 and §3.5).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping

import numpy as np

from dalembert.dataclass import dataclass
from virtualwork.describe.description import Description
from virtualwork.describe.parts import GROUND
from virtualwork.formulas.lifts import lift_at
from virtualwork.formulas.numbers import Reals
from virtualwork.formulas.positions import State
from virtualwork.plan.steps import Plan, joints, relations

# a singular value below this share of the largest is zero
RANK = 1e-9
# how far the pose is moved to distinguish a freedom from a singular pose: rad, or of the mechanism's size
STEP = 0.05


def coordinates(m: Description, plan: Plan, st: State) -> Reals:
    """A pose as θ, x/size, y/size of every link's origin, (3·links,)."""
    coordinates = []
    for link in m.links:
        path = plan.anchors[link]
        origin = complex(np.ravel(st.at(path))[0])
        turn = complex(np.ravel(st.turn[link])[0])
        coordinates += [float(np.angle(turn)), origin.real / m.size, origin.imag / m.size]
    return np.array(coordinates)


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
    def at(cls, m: Description, x: Reals, phases: Mapping[int, float]) -> Constraints:
        """At a pose (3·links,); `phases` are the constants of the gears."""
        rows = _Rows(m, x)
        tied = {(r.kind, r.number): r for r in relations(m)}

        def along(label: str, i: int, angle: complex) -> None:
            """The place of a guide's point along a direction in the axes of its rail."""
            g = m.guides[i]
            ends = (g.link, m.bodies[g.link][g.point]), (g.on, m.through(g))
            rows.between(label, *ends, angle * cmath.exp(1j * g.angle), on=g.on)

        for joint in joints(m):
            if joint.guide is None:
                first, *others = joint.bodies
                for other in others:
                    ends = (first, m.bodies[first][joint.name]), (other, m.bodies[other][joint.name])
                    for axis in (1 + 0j, 1j):
                        rows.between(joint.label, *ends, axis)
                continue
            along(joint.label, joint.guide, 1j)
            if ("guide", joint.guide) in tied:
                slider = tied["guide", joint.guide]
                rows.turn(slider.label, slider.torques, slider.right.const)
        for i, mesh in enumerate(m.meshes):
            if mesh.guide is not None:
                along(mesh.label, mesh.guide, 1 + 0j)
                rows.tie({body: c / m.size for body, c in mesh.torques.items()}, phases.get(i, 0.0) / m.size)
            else:
                rows.turn(mesh.label, mesh.torques, phases.get(i, 0.0))
        for drive in m.cam_drives:
            cam, on = (
                0.0 if body == GROUND else float(x[rows.column[body]]) for body in (drive.cam.cam, drive.on)
            )
            lifted, slope = (drive.cam.sign * float(lift_at(drive.lift, cam - on, k)) for k in (0, 1))
            unit = 1.0 if drive.guide is None else m.size
            if drive.guide is not None:
                along(drive.label, drive.guide, 1 + 0j)
            else:
                rows.turn(drive.label, {str(drive.body): 1.0, drive.on: -1.0}, 0.0)
                here = (rows.values[-1] - drive.rest - lifted + math.pi) % (2 * math.pi) - math.pi
                rows.values[-1] = here + drive.rest + lifted
            rows.follow({drive.cam.cam: -slope / unit, drive.on: slope / unit}, (drive.rest + lifted) / unit)
        count = len(rows.labels)
        for j, e in enumerate(m.inputs):
            if e.is_slide:
                along("", m.guide_of(e), 1 + 0j)
            else:
                rows.turn("", tied["input", j].torques, 0.0)
        every = np.array(rows.rows).reshape(-1, len(x))
        values = np.array(rows.values)
        return cls(rows.labels[:count], values[:count], every[:count], every[count:], values[count:])

    @property
    def driven(self) -> Reals:
        """The Jacobian of the joints and of the inputs."""
        return np.concatenate([self.jacobian, self.inputs])


class _Rows:
    """Writes down rows."""

    def __init__(self, m: Description, x: Reals) -> None:
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

    def follow(self, slopes: Mapping[str, float], const: float) -> None:
        """Take a number that goes with angles, and its derivatives by them, from the last row."""
        for body, slope in slopes.items():
            if body != GROUND:
                self.rows[-1][self.column[body]] += slope
        self.values[-1] -= const

    def tie(self, shares: Mapping[str, float], const: float) -> None:
        """Add Σ c·θ − const to the last row: a distance that goes with angles."""
        for body, c in shares.items():
            if body != GROUND:
                self.rows[-1][self.column[body]] += c
                self.values[-1] += c * float(self.x[self.column[body]])
        self.values[-1] -= const

    def _add(self, label: str, value: float, row: Reals) -> None:
        self.labels.append(label)
        self.values.append(value)
        self.rows.append(row)


def dependent(labels: list[str], jacobian: Reals) -> tuple[int, tuple[str, ...]]:
    """The rank of the joints' Jacobian, and the joints whose rows depend on each other."""
    u, s, _ = np.linalg.svd(jacobian)
    rank = int((s > RANK * s[0]).sum())
    left = u[:, rank:]
    result = [label for label, row in zip(labels, left, strict=True) if np.abs(row).max(initial=0) > 1e-6]
    return rank, tuple(dict.fromkeys(result))


def hidden_freedom(m: Description, x: Reals) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
    """The links that no input holds although the count says so, and the joints and inputs that depend on each other.

    Parameters
    ----------
    m : Description
    x : array (3·links,)
        A pose, as `coordinates` gives it; roughly is enough.

    Returns
    -------
    (links, joints), or None where nothing is free, or free only where the mechanism stands.
    """
    phases = _phases(m, x)
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
    result = None
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
        result = links, dependent(labels, here.driven)[1]
    return result


def _phases(m: Description, x: Reals) -> dict[int, float]:
    """The constants of gears, belts and racks that a pose has."""
    left = Constraints.at(m, x, {})
    values = dict(zip(left.labels, left.values, strict=True))
    return {
        i: float(values[mesh.label]) * (1.0 if mesh.guide is None else m.size)
        for i, mesh in enumerate(m.meshes)
    }


def _free(jacobian: Reals) -> Reals | None:
    """A basis of what a Jacobian leaves free, (coordinates, freedoms); None where that is nothing."""
    _, s, vt = np.linalg.svd(jacobian)
    rank = int((s > RANK * s[0]).sum()) if len(s) else 0
    return np.asarray(vt[rank:].T) if rank < len(vt) else None


def _settled(
    m: Description, x: Reals, phases: Mapping[int, float], driving: Reals | None = None
) -> Reals | None:
    """The pose nearby at which all joints close, with the inputs free or fixed; None where there is none."""
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
