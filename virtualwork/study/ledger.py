"""The ledger of a mechanism's virtual power: every load with the velocity of its point, and why a force does no work.

Each load is taken one by one, action and reaction apart: Σ F·V + Σ T·ω = 0 over all that acts on the moving links, the
drives among them (J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 3 to 5). Forces between links do no work together, those
in fixed bearings none, and those normal to the displacement none (what follows eq. 2 there).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.forces import Force, Load, LoadTorque, Rail
from virtualwork.formulas.numbers import Complexes, Number, Reals, minus, times
from virtualwork.formulas.pose_forces import PoseForces
from virtualwork.plan.joint_forces import pairs
from virtualwork.plan.steps import Path


class Item(NamedTuple):
    """A load over all poses: a force (complex, N) with the velocity of its point, or a torque (N·m) with ω."""

    link: str
    kind: str
    load: Complexes | Reals
    rate: Complexes | Reals
    """The velocity of the point of application, or the angular velocity of the link; (n,)."""
    turns: bool
    """Whether it is a torque."""
    joint: str = ""
    """Of a joint force: its joint."""
    workless: str = ""
    """Of a joint force: why it does no work; empty of all that is applied."""

    @property
    def power(self) -> Reals:
        """Its power, (n,) W; none of a joint force, which does no work with its opposite."""
        if self.workless:
            return np.where(np.isfinite(self.load), 0.0, np.nan)
        return np.asarray((self.load * np.conj(self.rate)).real)


def items(dynamics: Dynamics, unit: int | None = None) -> list[Item]:
    """Return every load of poses, in the order weight, inertia, applied; then the drives; then the joint forces.

    Parameters
    ----------
    dynamics : Dynamics
        The forces of a motion.
    unit : int, optional
        Take the virtual velocities of a unit speed of this input in place of the motion's own: for mechanisms at rest.

    Examples
    --------
    A weight of 2·9.81 N on an arm of 0.5 m, held at 0° and moved by 1 rad/s:

    >>> from virtualwork import Input, Link, Mechanism
    >>> arm = Mechanism({"O": 0j}, {"arm": Link({"O": 0j}, mass=2, center=0.5)}, inputs=Input(link="arm"), gravity=-9.81j)
    >>> for item in items(arm.motion(0.0).dynamics, unit=0):
    ...     print(item.kind, item.power.round(9), item.workless or "works")
    weight [-9.81] works
    unknown [9.81] works
    joint force [0.] at rest
    """
    result = [_applied(dynamics, i, unit) for i in range(len(dynamics.case.everything))]
    return [*result, *_drives(dynamics, unit), *_joints(dynamics, unit)]


class Turning(Force, kind="turning"):
    """The angular velocity of a body, rad/s, or ∂θ/∂q of one input (`unit`)."""

    is_rubbed = False
    body: str
    unit: int | None

    def form(self, forces: PoseForces) -> Number:
        forces.solve_places()
        of = forces.pose
        return of.omega(self.body) if self.unit is None else of.turning(self.body, self.unit)


class Moving(Force, kind="moving"):
    """The velocity of a point, m/s, or ∂P/∂q of one input (`unit`).

    On the `rail` of a guide that of the material point under the slide, without the slide's own speed.
    """

    is_rubbed = False
    is_vector = True
    path: Path
    unit: int | None
    rail: int | None

    def form(self, forces: PoseForces) -> Number:
        forces.solve_places()
        pose, unit, rail = forces.pose, self.unit, self.rail
        result = pose.velocity(self.path) if unit is None else pose.coefficient(self.path, unit)
        if rail is None:
            return result
        s = pose.slide_rate(rail) if unit is None else pose.by[unit].slide[rail][0]
        return minus(result, times(s, forces.rail(rail)))


def _applied(dynamics: Dynamics, i: int, unit: int | None) -> Item:
    load = dynamics.case.everything[i]
    path = load.path
    rate: Force = Turning(load.body, unit) if path is None else Moving(path, unit, load.rail)
    value, moved = dynamics.values([LoadTorque(i) if path is None else Load(i), rate])
    return Item(load.body, load.kind, value, moved, path is None)


def _drives(dynamics: Dynamics, unit: int | None) -> Iterator[Item]:
    """The efforts: on the driven link, and their reaction on a link that carries the drive (Ibrahim §2.3)."""
    m, effort = dynamics.poses.mechanism, dynamics.effort
    for j, entry in enumerate(m.inputs):
        if not entry.is_slide:
            for body, sign in ((str(entry.link), 1.0), (m.carrier(j), -1.0)):
                if body != GROUND:
                    rate = dynamics.value(Turning(body, unit))
                    yield Item(body, "unknown", sign * effort[:, j], rate, turns=True)
            continue
        guide = m.guide_of(entry)
        rail, g = dynamics.value(Rail(guide)), m.guides[guide]
        for body, sign in ((g.link, 1.0), (g.on, -1.0)):
            if body != GROUND:
                rate = dynamics.value(_at_guide(dynamics, guide, body, unit))
                yield Item(body, "unknown", sign * effort[:, j] * rail, rate, turns=False)


def _at_guide(dynamics: Dynamics, guide: int, body: str, unit: int | None) -> Moving:
    """The velocity of a link's own point at a guide."""
    m = dynamics.poses.mechanism
    g = m.guides[guide]
    path = dynamics.case.path(g.link, m.bodies[g.link][g.point])
    return Moving(path, unit, None if body == g.link else guide)


def _joints(dynamics: Dynamics, unit: int | None) -> Iterator[Item]:
    """Every joint force once, and the moment of a slider: none of them does work."""
    m, case = dynamics.poses.mechanism, dynamics.case
    for joint, on, _ in pairs(dynamics.reactions.joints):
        force = dynamics.joint_force(joint, on)
        if joint.guide is not None:
            rate = _at_guide(dynamics, joint.guide, on, unit)
        else:
            rate = Moving(case.path(on, m.bodies[on][joint.name]), unit, None)
        workless = "pair"
        if GROUND in joint.bodies:
            workless = "at rest" if joint.guide is None else "perpendicular to the displacement"
        if joint.guide is not None and any(load.joint == joint.key for load in case.friction):
            # its friction stands among the loads
            rail = dynamics.value(Rail(joint.guide))
            force = force - (force * np.conj(rail)).real * rail
        yield Item(on, "joint force", force, dynamics.value(rate), False, joint.name, workless)


class LoadWork(Force, kind="load work"):
    """The virtual work of a load, by its number, for a unit of an input, N·m (or N for a slide)."""

    is_rubbed = False
    number: int
    input: int

    def form(self, forces: PoseForces) -> Number:
        return forces.case.everything[self.number].power(forces.pose, self.input)


def ledger(dynamics: Dynamics, j: int = 0) -> tuple[dict[str, Reals], list[str], list[str]]:
    """Return the virtual work of each load for a unit of input j, the workless loads and the absent kinds.

    Parameters
    ----------
    dynamics : Dynamics
        The loads of a motion.
    j : int
        The number of the input, from 0.

    Returns
    -------
    works : dict of load name to (n,), N·m (or N for a slide)
    workless : list of str
        Loads on parts that cannot move.
    absent : list of str
        Kinds of loads that there are none of, with the reason.

    Notes
    -----
    J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 3 and 5, term by term.

    Examples
    --------
    The weight of 2 kg at the end of a horizontal arm of 0.5 m:

    >>> from virtualwork import Input, Link, Mechanism
    >>> bob = Link({"O": 0j}, mass=2, center=0.5)
    >>> m = Mechanism({"O": 0j}, {"bob": bob}, inputs=Input(link="bob"), gravity=-9.81j)
    >>> works, _, _ = ledger(m.motion(0.0).dynamics)
    >>> works
    {'bob: weight': array([-9.81])}
    """
    done: dict[str, Reals] = {}
    workless: list[str] = []
    pose, every, working = dynamics.pose, dynamics.case.everything, list[LoadWork]()
    for i, load in enumerate(every):
        if load.power(pose, j) is not None:
            working.append(LoadWork(i, j))
        elif load.displacement(pose, j) is None and load.name not in workless and load.carries:
            workless.append(load.name)
    for of, value in zip(working, dynamics.values(working), strict=True):
        name = every[of.number].name
        done[name] = done.get(name, 0.0) + value
    return done, [name for name in workless if name not in done], absent(dynamics)


def absent(dynamics: Dynamics) -> list[str]:
    """Which terms of eq. (5) there are none of, and why: they are never formed."""
    m, remarks = dynamics.poses.mechanism, []
    massless = [body for body, r in m.rigid.items() if not r.mass]
    if massless:
        remarks.append(f"{', '.join(massless)}: no weight and no inertia force, for there is no mass")
    flat = [body for body, r in m.rigid.items() if r.mass and not r.inertia]
    if flat:
        remarks.append(f"{', '.join(flat)}: no inertia torque, for there is no inertia")
    if not m.gravity:
        remarks.append("no weights: gravity is zero")
    if not dynamics.moves:
        remarks.append("no inertia loads, no damping, no friction: speed and acceleration are zero")
    for what, entries in (
        ("applied forces", m.forces),
        ("applied torques", m.torques),
        ("springs", m.springs),
    ):
        if not entries:
            remarks.append(f"no {what} in the file")
    return remarks
