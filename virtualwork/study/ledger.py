"""The ledger of a mechanism's virtual power: every load with the velocity of its point, and why a force does no work.

Each load is taken one by one, action and reaction apart: Σ F·V + Σ T·ω = 0 over all that acts on the moving links, the
drives among them (J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 3 to 5). Forces between links do no work together, those
in fixed bearings none, and those normal to the displacement none (what follows eq. 2 there).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from virtualwork.describe.parts import GROUND
from virtualwork.formulas.dynamics import Dynamics
from virtualwork.formulas.loads import FrictionLoad
from virtualwork.formulas.numbers import minus, times
from virtualwork.plan.joint_forces import pairs

if TYPE_CHECKING:
    from virtualwork.formulas.loaded_pose import LoadedPose
    from virtualwork.formulas.loads import Load
    from virtualwork.formulas.numbers import Complexes, Number, Reals
    from virtualwork.formulas.scene import Scene


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
    effort = dynamics.effort
    result = [_applied(dynamics, load, unit) for load in dynamics.scene.case.everything]
    return [*result, *_drives(dynamics, effort, unit), *_joints(dynamics, unit)]


def _over(dynamics: Dynamics, kind: type, *forms: Callable[[LoadedPose], Number]) -> list[Any]:
    """Arrays (n,) of what forms make of a pose; zero where it is identically zero."""
    return dynamics.scene.over(forms, kind)


def _turning(pose: LoadedPose, body: str, unit: int | None) -> Number:
    return pose.omega(body) if unit is None else pose.turning(body, unit)


def _applied(dynamics: Dynamics, load: Load, unit: int | None) -> Item:
    if load.path is None:
        turning = partial(_turning, body=load.body, unit=unit)
        value, rate = _over(dynamics, float, load.form, turning)
        return Item(load.body, load.kind, value, rate, turns=True)
    path = load.path

    def velocity(pose: LoadedPose) -> Number:
        result = pose.velocity(path) if unit is None else pose.coefficient(path, unit)
        if load.rail is None:
            return result
        # on a rail the material point under the slide: without the slide's own speed along it
        s = pose.slide_rate(load.rail) if unit is None else pose.by[unit].slide[load.rail][0]
        return minus(result, times(s, dynamics.reactions.rail(pose, load.rail)))

    value, rate = _over(dynamics, complex, load.form, velocity)
    kind = "friction" if isinstance(load, FrictionLoad) else load.kind
    return Item(load.body, kind, value, rate, turns=False)


def _drives(dynamics: Dynamics, effort: Reals, unit: int | None) -> Iterator[Item]:
    """The efforts: on the driven link, and their reaction on a link that carries the drive (Ibrahim §2.3)."""
    m, reactions = dynamics.poses.mechanism, dynamics.reactions
    for j, entry in enumerate(m.inputs):
        if not entry.is_slide:
            for body, sign in ((str(entry.link), 1.0), (m.carrier(j), -1.0)):
                if body != GROUND:
                    (rate,) = _over(dynamics, float, partial(_turning, body=body, unit=unit))
                    yield Item(body, "unknown", sign * effort[:, j], rate, turns=True)
            continue
        guide = m.guide_of(entry)
        (rail,) = _over(dynamics, complex, partial(reactions.rail, guide=guide))
        g = m.guides[guide]
        for body, sign in ((g.link, 1.0), (g.on, -1.0)):
            if body != GROUND:
                rate = _joint_velocity(dynamics, m.bodies, guide, body, unit)
                yield Item(body, "unknown", sign * effort[:, j] * rail, rate, turns=False)


def _joint_velocity(dynamics: Dynamics, bodies: Any, guide: int, body: str, unit: int | None) -> Complexes:
    """The velocity of a link's own point at a guide."""
    g, case = dynamics.poses.mechanism.guides[guide], dynamics.scene.case
    path = case.path(g.link, bodies[g.link][g.point])

    def velocity(pose: LoadedPose) -> Number:
        result = pose.velocity(path) if unit is None else pose.coefficient(path, unit)
        if body == g.link:
            return result
        s = pose.slide_rate(guide) if unit is None else pose.by[unit].slide[guide][0]
        return minus(result, times(s, dynamics.reactions.rail(pose, guide)))

    (rate,) = _over(dynamics, complex, velocity)
    return np.asarray(rate)


def _joints(dynamics: Dynamics, unit: int | None) -> Iterator[Item]:
    """Every joint force once, and the moment of a slider: none of them does work."""
    m, case = dynamics.poses.mechanism, dynamics.scene.case
    for joint, on, _ in pairs(dynamics.reactions.joints):
        force = dynamics.joint_force(joint, on)
        if joint.guide is not None:
            rate = _joint_velocity(dynamics, m.bodies, joint.guide, on, unit)
        else:
            path = case.path(on, m.bodies[on][joint.name])

            def velocity(pose: LoadedPose, path: Any = path) -> Number:
                return pose.velocity(path) if unit is None else pose.coefficient(path, unit)

            (rate,) = _over(dynamics, complex, velocity)
        workless = "pair"
        if GROUND in joint.bodies:
            workless = "at rest" if joint.guide is None else "perpendicular to the displacement"
        if joint.guide is not None and any(load.joint == joint.key for load in dynamics.scene.friction):
            # its friction stands among the loads
            (rail,) = _over(dynamics, complex, partial(dynamics.reactions.rail, guide=joint.guide))
            force = force - (force * np.conj(rail)).real * rail
        yield Item(on, "joint force", force, rate, False, joint.name, workless)


def ledger(scene: Scene, j: int = 0) -> tuple[dict[str, Reals], list[str], list[str]]:
    """Return the virtual work of each load for a unit of input j, the workless loads and the absent kinds.

    Parameters
    ----------
    scene : Scene
        The poses and loads of a motion: `motion.dynamics.scene`.
    j : int
        The number of the input, from 0.

    Returns
    -------
    works : dict of load name to (n,), N·m (or N for a slide)
    workless : list of str
        Loads on parts that cannot move.
    absent : list of str
        Kinds of loads that the scene does not have, with the reason.

    Notes
    -----
    J. A. Riul, Dinâmica das Máquinas, unit II, eqs. 3 and 5, term by term.

    Examples
    --------
    The weight of 2 kg at the end of a horizontal arm of 0.5 m:

    >>> from virtualwork import Input, Link, Mechanism
    >>> bob = Link({"O": 0j}, mass=2, center=0.5)
    >>> m = Mechanism({"O": 0j}, {"bob": bob}, inputs=Input(link="bob"), gravity=-9.81j)
    >>> works, _, _ = ledger(m.motion(0.0).dynamics.scene)
    >>> works
    {'bob: weight': array([-9.81])}
    """
    done: dict[str, Reals] = {}
    workless: list[str] = []
    pose, working = scene.pose, list["Load"]()
    for load in scene.case.everything:
        if load.power(pose, j) is not None:
            working.append(load)
        elif load.displacement(pose, j) is None and load.name not in workless and load.carries:
            workless.append(load.name)
    each = scene.over([partial(load.power, j=j) for load in working], float)
    for load, value in zip(working, each, strict=True):
        done[load.name] = done.get(load.name, 0.0) + value
    return done, [name for name in workless if name not in done], absent(scene)


def absent(scene: Scene) -> list[str]:
    """Which terms of eq. (5) the scene does not have, and why: they are never formed."""
    m, remarks = scene.mechanism, []
    massless = [body for body, r in scene.rigid.items() if not r.mass]
    if massless:
        remarks.append(f"{', '.join(massless)}: no weight and no inertia force, for there is no mass")
    flat = [body for body, r in scene.rigid.items() if r.mass and not r.inertia]
    if flat:
        remarks.append(f"{', '.join(flat)}: no inertia torque, for there is no inertia")
    if not m.gravity:
        remarks.append("no weights: gravity is zero")
    if not scene.moves:
        remarks.append("no inertia loads, no damping, no friction: speed and acceleration are zero")
    for what, entries in (
        ("applied forces", m.forces),
        ("applied torques", m.torques),
        ("springs", m.springs),
    ):
        if not entries:
            remarks.append(f"no {what} in the file")
    return remarks
